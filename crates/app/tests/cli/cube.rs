//! `run --cube`: a sweep in one Zarr store.

use std::{collections::BTreeMap, fs, path::Path, time::Duration};

use super::Place;

const GRAPH: &str = r#"(
    world: (size: (1600, 1200), cells: (40, 30), place: (epsg: 32611, corner: ("378 km", "3812 km"))),
    nodes: { "land": Ridged(amplitude: 300), "hills": Slope(height: "land") },
    outputs: { "height": "land", "steep": "hills" },
)"#;

/// The files below a folder.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if path.is_dir() {
            all.extend(files(&path).into_iter().map(|(inner, bytes)| (format!("{name}/{inner}"), bytes)));
        } else {
            all.insert(name, fs::read(&path).expect("readable"));
        }
    }
    all
}

const SWEEP: [&str; 11] = [
    "run",
    "g.ron",
    "--cube",
    "--sweep",
    "seed=1..3",
    "--sweep",
    "land.amplitude=200,400",
    "--above",
    "height=100",
    "-q",
    "-o",
];

#[test]
fn a_sweep_fills_a_cube() {
    let place = Place::new();
    place.write("g.ron", GRAPH);
    place.run(&[&SWEEP[..], &["out"]].concat()).done();
    let cube = files(&place.path("out/g.zarr"));
    let json = |name: &str| serde_json::from_slice::<serde_json::Value>(&cube[name]).expect("JSON");
    let height = json("height/zarr.json");
    assert_eq!(height["dimension_names"], serde_json::json!(["land_amplitude", "seed", "y", "x"]), "the seed last");
    assert_eq!(height["shape"], serde_json::json!([2, 3, 30, 40]));
    assert_eq!(json("zarr.json")["consolidated_metadata"]["metadata"]["height"], height);
    let system = json("spatial_ref/zarr.json")["attributes"]["spatial_ref"].to_string();
    assert!(system.contains("PROJCS[") && system.contains("UTM zone 11N") && system.contains("32611"), "{system}");
    let numbers = |name: &str| -> Vec<f32> {
        cube[name].chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
    };
    let mut all = Vec::new();
    for (i, relief) in ["200", "400"].iter().enumerate() {
        for (j, seed) in ["1", "2", "3"].iter().enumerate() {
            let set = format!("land.amplitude={relief}");
            let one = ["run", "g.ron", "--set", &set, "--seed", seed, "--format", "r32", "-q", "-o", "one"];
            place.run(&one).done();
            assert!(place.bytes("one/height.r32") == cube[&format!("height/c.{i}.{j}.0.0")], "{relief} {seed}");
            all.push(numbers(&format!("height/c.{i}.{j}.0.0")));
        }
    }
    let (mean, median, above) =
        (numbers("height_mean/c.0.0"), numbers("height_quantile/c.1.0.0"), numbers("height_above/c.0.0.0"));
    for cell in 0..1200 {
        let mut values: Vec<f32> = all.iter().map(|member| member[cell]).collect();
        let sum: f64 = values.iter().map(|v| f64::from(*v)).sum();
        assert_eq!(mean[cell], (sum / 6.0) as f32);
        assert_eq!(above[cell], (values.iter().filter(|v| **v > 100.0).count() as f64 / 6.0) as f32);
        values.sort_by(f32::total_cmp);
        assert_eq!(median[cell], ((f64::from(values[2]) + f64::from(values[3])) / 2.0) as f32);
    }
    // another sweep does not continue it
    let other = ["run", "g.ron", "--cube", "--sweep", "seed=1..4", "-o", "out"];
    place.run(&other).ended(1, &["is there already, and of another graph or sweep", "-o"]);
    // nor one with as many values, or with other statistics
    let [mut seeds, mut above] = [SWEEP.to_vec(), SWEEP.to_vec()];
    (seeds[4], above[8]) = ("seed=4..6", "height=120");
    for mut other in [seeds, above] {
        other.push("out");
        place.run(&other).ended(1, &["is there already, and of another graph or sweep", "-o"]);
    }
    assert!(files(&place.path("out/g.zarr")) == cube);
    place.run(&["run", "g.ron", "--cube", "--mesh", "glb"]).ended(1, &["--mesh"]);
    let swept = ["run", "g.ron", "--cube", "--sweep", "seed=1..2", "-o"];
    place.run(&[&swept[..], &["x", "--above", "land=3"]].concat()).ended(1, &["no such output"]);
    // statistics are those of a sweep, and a cube is one folder
    place.run(&["run", "g.ron", "--cube", "--above", "height=3", "-o", "x"]).ended(1, &["--sweep"]);
    place.run(&["run", "g.ron", "--cube", "--quantiles", "0.5", "-o", "x"]).ended(1, &["--sweep"]);
    place.run(&[&swept[..], &["x/{seed}"]].concat()).ended(1, &["one cube holds all terrains"]);
    assert!(!place.path("x").exists());
}

/// Terrains that missed an expectation are not built again, and the command fails again.
#[test]
fn a_cube_that_missed_says_so_each_time() {
    let place = Place::new();
    place.write("g.ron", &GRAPH.replace("    outputs:", "    expect: { \"relief\": (0, 1) },\n    outputs:"));
    let sweep = ["run", "g.ron", "--cube", "--sweep", "seed=1..2", "-o", "out"];
    place.run(&sweep).ended(1, &["2 terrains missed an expectation", "expectations.json"]);
    place.run(&sweep).ended(1, &["continuing: 2 of 2", "2 terrains missed an expectation"]);
    let checked = place.path("out/g.zarr/expectations.json");
    let missed: BTreeMap<String, Option<String>> =
        serde_json::from_slice(&fs::read(&checked).expect("written")).expect("a table");
    let is_relief = |what: &Option<String>| what.as_ref().is_some_and(|what| what.contains("relief"));
    assert!(missed.len() == 2 && missed.values().all(is_relief), "{missed:?}");
    // terrains that were not measured before the program was stopped are built again
    fs::write(&checked, "{}").expect("written");
    place.run(&sweep).ended(1, &["1 of 2: ", "2 of 2: ", "2 terrains missed an expectation"]);
    fs::write(&checked, "damaged").expect("written");
    place.run(&sweep).ended(2, &["expectations.json", "remove it"]);
    fs::remove_file(&checked).expect("removed");
    place.run(&[&sweep[..], &["--timings"]].concat()).ended(1, &["--timings"]);
}

#[test]
fn a_killed_sweep_continues_to_the_same_bytes() {
    let place = Place::new();
    place.write("g.ron", GRAPH);
    place.run(&[&SWEEP[..], &["whole"]].concat()).done();
    let mut child = place.command(&[&SWEEP[..], &["out"]].concat()).spawn().expect("started");
    let second = place.path("out/g.zarr/steep/c.0.1.0.0");
    for _ in 0..30_000 {
        if second.exists() || child.try_wait().expect("a child").is_some() {
            break;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().expect("killed");
    child.wait().expect("ended");
    place.run(&[&SWEEP[..], &["out"]].concat()).done();
    assert!(files(&place.path("out")) == files(&place.path("whole")));
}

/// The peak of memory does not grow with the number of terrains.
#[cfg(target_os = "linux")]
#[test]
fn more_terrains_need_no_more_memory() {
    let place = Place::new();
    place.write(
        "g.ron",
        r#"(world: (size: 5120, cells: 512), nodes: { "land": Perlin(amplitude: 300), "flow": Flow(height: "land") },
        outputs: { "height": "land", "area": "flow.area" })"#,
    );
    let peak = |terrains: u32| {
        let sweep = format!("seed=1..{terrains}");
        let folder = format!("out{terrains}");
        let args = ["run", "g.ron", "--cube", "--sweep", &sweep, "--threads", "2", "--no-cache", "-q", "-o", &folder];
        let mut program = place.command(&args).spawn().expect("the program starts");
        let status = format!("/proc/{}/status", program.id());
        let mut kilobytes = 0_u64;
        while program.try_wait().expect("a child").is_none() {
            let text = fs::read_to_string(&status).unwrap_or_default();
            let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
            let peak = line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok());
            kilobytes = kilobytes.max(peak.unwrap_or(0));
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(program.wait().expect("a child").success());
        kilobytes
    };
    let (few, many) = (peak(8), peak(40));
    assert!(few > 0 && many as f64 <= 1.03 * few as f64, "{few} and {many} kB");
}
