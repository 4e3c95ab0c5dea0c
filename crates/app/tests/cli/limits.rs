//! Too little memory: the program says so, names what helps, and leaves nothing half written.

use std::fs;

use super::{Place, Ran};

/// Nodes of several categories whose kernels ask for memory of many sizes.
const GRAPH: &str = r#"(
    world: (size: "8 km", cells: 512, seed: 7),
    nodes: {
        "hills": Ridged(wavelength: "5 km", amplitude: "300 m"),
        "rise": Uplift(centre: ("4 km", "4 km"), radius: "3 km", rate: "1 mm/yr"),
        "rivers": StreamPower(height: "hills", uplift: "rise", duration: "200 kyr"),
        "scree": Thermal(height: "rivers"),
        "smooth": Blur(value: "scree", radius: "100 m"),
        "relief": Hillshade(height: "smooth"),
    },
    outputs: { "height": "smooth", "picture": "relief.colour", "area": "rivers.area" },
)
"#;

const RUN: &str = "run g.ron -q --threads 2";

const KIB: u64 = 1;
const MIB: u64 = 1024 * KIB;

/// Runs the program with so many KiB of addresses.
fn limited(place: &Place, kib: u64, args: &str) -> Ran {
    place.shell(&format!("ulimit -v {kib}; exec \"$0\" {args}"))
}

/// The least limit, to a MiB, with which the program does something; it does it with `most`.
fn least(place: &Place, most: u64, does: impl Fn(u64) -> bool) -> u64 {
    let (mut low, mut high) = (0, most);
    assert!(does(high), "it takes more than {} MiB", most / MIB);
    while high - low > MIB {
        let middle = u64::midpoint(low, high);
        if does(middle) {
            high = middle
        } else {
            low = middle
        }
        let _ = fs::remove_dir_all(place.path("out"));
    }
    high
}

/// Ended well, or badly with what helps; nothing is left but what was there or was asked for.
#[track_caller]
fn ended_in_good_order(place: &Place, ran: &Ran, what: &str) {
    assert!([0, 1, 2].contains(&ran.code), "{what}: {ran:?}");
    let out = place.path("out");
    if ran.code == 0 {
        assert!(place.names("out").iter().all(|name| !name.starts_with(".orograph")), "{what}: {ran:?}");
        fs::remove_dir_all(out).expect("removed");
    } else {
        assert!(ran.err.contains("error:") && ran.err.contains("fewer"), "{what}: {ran:?}");
        assert!(!out.exists(), "{what}: {:?} is left, {ran:?}", place.names("out"));
    }
}

#[test]
fn any_limit_between_too_little_and_enough_ends_in_good_order() {
    let place = Place::new();
    place.write("g.ron", GRAPH);
    // below this there is no program yet, only the system's loader
    let starts = least(&place, 256 * MIB, |kib| limited(&place, kib, "--version").code == 0);
    let enough = least(&place, 4096 * MIB, |kib| limited(&place, kib, RUN).code == 0);
    assert!(starts < enough);
    let mut codes = Vec::new();
    for step in 0..=20 {
        let kib = starts + (enough - starts) * step / 20;
        let ran = limited(&place, kib, RUN);
        ended_in_good_order(&place, &ran, &format!("{kib} KiB of {starts} to {enough}"));
        codes.push(ran.code);
    }
    assert!(codes.contains(&0) && codes.contains(&2), "{codes:?}");
}

#[test]
fn earlier_files_stay_when_memory_is_refused_in_the_middle() {
    let place = Place::new();
    place.write("g.ron", GRAPH);
    fs::create_dir(place.path("out")).expect("made");
    place.write("out/height.exr", "from before");
    let enough = least(&place, 4096 * MIB, |kib| limited(&place, kib, "run g.ron -q --threads 2 -o other").code == 0);
    for share in [95, 98, 99] {
        let ran = limited(&place, enough * share / 100, RUN);
        if ran.code == 2 {
            assert_eq!(place.names("out"), ["height.exr"], "{ran:?}");
            assert_eq!(place.read("out/height.exr"), "from before");
        } else {
            place.write("out/height.exr", "from before");
        }
    }
}

#[test]
fn threads_that_cannot_be_started_are_an_error() {
    let place = Place::new();
    place.write("g.ron", GRAPH);
    for threads in [200, 60, 40, 30, 20] {
        let ran = limited(&place, 300 * MIB, &format!("run g.ron -q --threads {threads}"));
        ended_in_good_order(&place, &ran, &format!("{threads} threads"));
    }
    limited(&place, 300 * MIB, "run g.ron -q --threads 200").ended(2, &["threads", "use fewer threads"]);
}
