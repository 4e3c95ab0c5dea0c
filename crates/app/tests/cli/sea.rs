//! Tests of the world's sea in pictures, files and measures.

use super::{Place, repository};

/// Number of pixels of a picture, and of those whose blue exceeds their red by `by`.
fn blue(place: &Place, name: &str, by: i32) -> (usize, usize) {
    let picture = image::load_from_memory(&place.bytes(name)).expect("a picture").to_rgb8();
    let is_blue = |pixel: &image::Rgb<u8>| i32::from(pixel[2]) > i32::from(pixel[0]) + by;
    (picture.pixels().len(), picture.pixels().filter(|pixel| is_blue(pixel)).count())
}

fn graph(name: &str) -> String {
    repository(&format!("graphs/{name}")).to_str().expect("a plain name").to_owned()
}

#[test]
fn a_map_is_blue_only_below_the_sea_level_of_the_world() {
    let place = Place::new();
    let map = |out: &str, graph: &str, more: &[&str]| {
        place.run(&[&["render", graph, "-o", out, "--cells", "64", "--output", "height"], more].concat()).done();
        // snow in a shadow is a little blue
        blue(&place, out, 8)
    };
    let isles = graph("isles.ron");
    let (all, sea) = map("isles.png", &isles, &[]);
    assert!(sea > all / 4 && sea < all * 3 / 4, "{sea} of {all} pixels are sea");
    assert_eq!(map("dry.png", &isles, &["--sea", "none"]).1, 0);
    assert!(map("high.png", &isles, &["--sea", "100"]).1 > sea);
    // hills on either side of 0 m
    place.write(
        "hills.ron",
        "(world: (size: \"8 km\", cells: 64), nodes: { \"a\": Perlin(amplitude: 300) }, outputs: { \"height\": \"a\" })",
    );
    assert_eq!(map("plain.png", "hills.ron", &[]).1, 0, "land below 0 m without a sea");
    assert!(map("wet.png", "hills.ron", &["--sea", "0"]).1 > 0);
    place.run(&["render", &isles, "-o", "no.png", "--sea", "13 km"]).ended(1, &["--sea", "12000"]);
}

#[cfg(feature = "editor")]
#[test]
fn the_3d_view_shows_the_sea_of_the_world() {
    if crate::device::skips("the_3d_view_shows_the_sea_of_the_world") {
        return;
    }
    let place = Place::new();
    let isles = graph("isles.ron");
    let seen = |out: &str, more: &[&str]| {
        let all =
            ["render", &isles, "-o", out, "--cells", "96", "--view", "3d", "--size", "96x96", "--elevation", "89"];
        place.run(&[&all[..], &["--haze", "0", "--distance", "20 km"], more].concat()).done();
        blue(&place, out, 12)
    };
    let (all, sea) = seen("sea.png", &[]);
    let (_, dry) = seen("dry.png", &["--sea", "none"]);
    assert!(sea > dry + all / 5, "{sea} and {dry} of {all} pixels are blue");
    seen("same.png", &["--sea", "0 m"]);
    assert!(place.bytes("same.png") == place.bytes("sea.png"));
}

#[test]
fn files_and_measures_state_the_sea() {
    let place = Place::new();
    let ran = place.run(&["run", &graph("isles.ron"), "-o", "out", "--cells", "64", "--json"]).done();
    let start: serde_json::Value = serde_json::from_str(ran.out.lines().next().expect("a line")).expect("JSON");
    assert_eq!(start["sea_level_m"], 0.0);
    let sidecar: serde_json::Value = serde_json::from_str(&place.read("out/height.exr.json")).expect("JSON");
    assert_eq!(sidecar["sea_level_m"], 0.0);
    let share = |more: &[&str]| {
        let text = place.run(&[&["metrics", "out/height.exr", "--json"], more].concat()).done().out;
        let value: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let measures = value["measures"].as_array().expect("measures").clone();
        let named = |measure: &&serde_json::Value| measure["name"] == "land_share";
        (value["sea_level_m"].clone(), measures.iter().find(named).and_then(|share| share["value"].as_f64()))
    };
    let (level, land) = share(&[]);
    assert!(level == 0.0 && land.is_some_and(|land| (0.25..0.75).contains(&land)), "{level} {land:?}");
    assert_eq!(share(&["--sea", "none"]), (serde_json::Value::Null, None));
    let (level, higher) = share(&["--sea", "200 m"]);
    assert!(level == 200.0 && higher < land, "{level} {higher:?}");
    place.write("out/height.exr.json", r#"{"cell_m": 100, "sea_level_m": 1e9}"#);
    place.run(&["metrics", "out/height.exr"]).ended(1, &["a sea at 1000000000 m"]);
    let message = place.run(&["check", "--describe", &graph("isles.ron")]).done().out;
    assert!(message.contains("sea at 0 m"), "{message}");
    // a format that states its cell size itself
    place.run(&["run", &graph("isles.ron"), "-o", "out", "--cells", "64", "--format", "tiff"]).done();
    let measured = place.run(&["metrics", "out/height.tif", "--json"]).done().out;
    let measured: serde_json::Value = serde_json::from_str(&measured).expect("JSON");
    assert_eq!(measured["sea_level_m"], 0.0);
}

/// A file from when `StreamPower` had its own sea parameter still builds the same result.
#[test]
fn an_older_file_sets_the_sea_level_of_the_world() {
    const FILE: &str = r#"(
        world: (size: "6 km", cells: 64, WORLD),
        nodes: {
            "ground": Perlin(wavelength: "3 km", amplitude: "400 m"),
            "rivers": StreamPower(height: "ground", duration: "200 kyr", OWN),
            "late": StreamPower(height: "rivers", duration: "100 kyr", LATE),
        },
        outputs: { "height": "late" },
    )"#;
    let place = Place::new();
    let write = |name: &str, world: &str, own: &str, late: &str| {
        place.write(name, &FILE.replace("WORLD", world).replace("OWN", own).replace("LATE", late));
    };
    let built = |folder: &str, graph: &str| {
        place.run(&["run", graph, "-o", folder]).done();
        place.bytes(&format!("{folder}/height.exr"))
    };
    write("old.ron", "seed: 1", "sea_level: \"30 m\"", "sea_level: 30");
    write("new.ron", "seed: 1, sea_level: \"30 m\"", "version: 2", "version: 2");
    write("dry.ron", "seed: 1", "seed: 0", "sea_level: -12000");
    let old = built("old", "old.ron");
    assert!(old == built("new", "new.ron") && old != built("dry", "dry.ron"));
    let sidecar = |folder: &str| place.read(&format!("{folder}/height.exr.json")).contains("sea_level_m");
    assert_eq!((sidecar("old"), sidecar("dry")), (true, false));

    write("two.ron", "seed: 1", "sea_level: 30", "sea_level: 40");
    let message = ["`rivers` has a sea at 30 m and `late` has a sea at 40 m", "write its level into `world`"];
    place.run(&["check", "two.ron"]).ended(1, &message);
    write("one.ron", "seed: 1", "sea_level: 30", "seed: 0");
    place.run(&["run", "one.ron", "-o", "no"]).ended(1, &["`late` has no sea"]);
    place.run(&["run", "new.ron", "-o", "no", "--set", "rivers.sea_level=5"]).ended(1, &["belongs to the world"]);
}
