//! `run`: files, formats, events, caches.

use std::fs;

use orograph_nodes::raster;

use super::{Place, Ran, SMALL, json_lines};

#[test]
fn every_output_is_written_with_its_side_files() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let ran = place.run(&["run", "g.ron", "-o", "deep/out"]).done();
    assert!(ran.out.contains("built 4 files"), "{}", ran.out);
    assert_eq!(
        place.names("deep/out"),
        ["height.exr", "height.exr.json", "height.preview.png", "picture.png", "steep.exr", "steep.exr.json"]
    );
    let sidecar: serde_json::Value = serde_json::from_str(&place.read("deep/out/height.exr.json")).expect("JSON");
    assert_eq!(
        (&sidecar["columns"], &sidecar["rows"], &sidecar["cell_m"], &sidecar["unit"], &sidecar["seed"]),
        (&32.into(), &16.into(), &100.0.into(), &"m".into(), &7.into())
    );
    assert!(sidecar["program"].as_str().is_some_and(|program| program.starts_with("orograph ")));
    assert_eq!(sidecar["graph_hash"].as_str().map(str::len), Some(32));
    let land = raster::read(&place.path("deep/out/height.exr")).expect("readable");
    assert_eq!((land.head.columns, land.head.rows), (32, 16));
    assert!(land.samples.iter().all(|v| *v == 700.0));
}

#[test]
fn command_line_options_change_the_build() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let args = ["run", "g.ron", "--cells", "8", "--seed", "9", "--set", "plain.value=1200", "--only", "height"];
    place.run(&[&args[..], &["--format", "r32", "--no-preview", "--threads", "1", "-q"]].concat()).done();
    assert_eq!(place.names("out"), ["height.r32", "height.r32.json"]);
    let sidecar: serde_json::Value = serde_json::from_str(&place.read("out/height.r32.json")).expect("JSON");
    assert_eq!((&sidecar["columns"], &sidecar["rows"], &sidecar["seed"]), (&8.into(), &4.into(), &9.into()));
    let bytes = fs::read(place.path("out/height.r32")).expect("written");
    assert_eq!(bytes, 1200f32.to_le_bytes().repeat(32));
    assert_eq!(place.read("g.ron"), SMALL, "the file stays as it is");
}

#[test]
fn reports_are_printed_and_written_with_their_ledger() {
    let place = Place::new();
    place.write(
        "g.ron",
        r#"(
            format: 1,
            world: (size: (3200, 1600), cells: (32, 16), seed: 7),
            nodes: { "hills": Perlin(), "soft": Creep(height: "hills") },
            outputs: { "height": "soft", "soil": "soft.report" },
        )"#,
    );
    let ran = place.run(&["run", "g.ron"]).done();
    for line in ["+ eroded", "− settled", "− left the world", "unaccounted for"] {
        assert!(ran.out.contains(line), "{line}: {}", ran.out);
    }
    let report: serde_json::Value = serde_json::from_str(&place.read("out/soil.json")).expect("JSON");
    let soil = &report["ledger"][0];
    assert_eq!((&soil["material"], &soil["gained"][0]["name"]), (&"soil".into(), &"eroded".into()));
    let volume = soil["gained"][0]["volume"].as_f64().expect("a volume");
    assert!(volume > 0.0 && soil["error"].as_f64().expect("a fraction").abs() < 1e-9, "{soil}");
    assert!(!place.run(&["run", "g.ron", "-q"]).done().out.contains("eroded"), "quiet runs print no report");
}

#[test]
fn every_format_is_read_back() {
    let place = Place::new();
    place.write("g.ron", &SMALL.replace("Constant(value: 700)", "Constant(value: 250.5)"));
    for (format, file) in [
        ("exr", "height.exr"),
        ("png16", "height.png"),
        ("tiff", "height.tif"),
        ("r16", "height.r16"),
        ("r32", "height.r32"),
    ] {
        place.run(&["run", "g.ron", "-o", format, "--format", format, "-q"]).done();
        let land = raster::read(&place.path(format).join(file)).expect("readable").decoded([0.0, 1.0]);
        assert!(land.samples.iter().all(|v| *v == 250.5), "{format}");
    }
}

#[test]
fn events_are_lines_of_json() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let ran = place.run(&["run", "g.ron", "--json", "--timings"]).done();
    let lines = json_lines(&ran.out);
    let of = |kind: &str| lines.iter().filter(|line| line["event"] == kind).count();
    assert_eq!(
        (lines[0]["event"].as_str(), of("plan"), of("node"), of("output")),
        (Some("start"), 1, 3, 4),
        "{lines:?}"
    );
    assert_eq!(lines.last().map(|line| &line["event"]), Some(&"done".into()));
    assert!(ran.err.contains("total"), "timings go to standard error: {}", ran.err);
}

#[test]
fn a_cache_keeps_results_between_runs() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let origins = |args: &[&str]| {
        let ran = place.run(&[&["run", "g.ron", "--json", "--cache", "kept"], args].concat()).done();
        let lines = json_lines(&ran.out);
        let nodes = lines.into_iter().filter(|line| line["event"] == "node");
        nodes.map(|line| line["origin"].as_str().unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    assert!(origins(&[]).iter().all(|origin| origin == "computed"));
    let first = fs::read(place.path("out/steep.exr")).expect("written");
    assert!(origins(&[]).iter().all(|origin| origin == "disk"));
    assert_eq!(fs::read(place.path("out/steep.exr")).expect("written"), first);
    assert!(origins(&["--seed", "8"]).iter().all(|origin| origin == "computed"));
    place.write("file", "");
    place.run(&["run", "g.ron", "--cache", "file"]).ended(1, &["`file` is a file"]);
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    for threads in ["1", "2", "5"] {
        place.run(&["run", "g.ron", "-o", threads, "--threads", threads, "-q"]).done();
        for name in place.names("1") {
            let bytes = |folder: &str| fs::read(place.path(folder).join(&name)).expect("written");
            assert!(bytes("1") == bytes(threads), "{name} with {threads} threads");
        }
    }
}

#[test]
fn timings_name_every_node() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let ran = place.run(&["run", "g.ron", "--timings"]).done();
    for name in ["plain", "relief", "steep", "cpu", "total"] {
        assert!(ran.out.contains(name), "{}", ran.out);
    }
    assert!(place.run(&["run", "g.ron", "--quiet"]).done().err.is_empty());
}

/// Without a graphics driver `--backend gpu` says so in one line, and the processor does the work.
#[test]
fn a_missing_graphics_driver_is_no_error() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let without = |args: &[&str]| {
        let mut command = place.command(args);
        command.env("VK_DRIVER_FILES", "/none").env("VK_ICD_FILENAMES", "/none");
        Ran::from(command.output().expect("the program starts")).done()
    };
    let ran = without(&["run", "g.ron", "--backend", "gpu", "--timings"]);
    let said: Vec<&str> = ran.err.lines().filter(|line| line.contains("on the CPU")).collect();
    assert!(said.len() == 1 && said[0].starts_with("computing on the CPU: "), "{}", ran.err);
    assert!(ran.out.contains("cpu"), "{}", ran.out);
    let files = |folder: &str| -> Vec<Vec<u8>> {
        place.names(folder).iter().map(|name| place.bytes(&format!("{folder}/{name}"))).collect()
    };
    let gpu = files("out");
    place.run(&["run", "g.ron", "--backend", "cpu", "-o", "cpu"]).done();
    assert!(files("cpu") == gpu, "the same files");
    let devices = without(&["devices"]).out;
    assert!(devices.contains("no graphics driver") || devices.contains("no GPU backend"), "{devices}");
    assert_eq!(without(&["devices", "--json"]).out.trim(), "[]");
}

const RIVERS: &str = r#"(
    format: 1,
    world: (size: 6400, cells: 64, seed: 3),
    nodes: {
        "land": Perlin(wavelength: 3000),
        "water": Flow(height: "land"),
        "rivers": Rivers(flow: "water.flow"),
    },
    outputs: { "rivers": "rivers.lines" },
)
"#;

#[test]
fn rivers_are_written_as_geojson_also_from_the_cache() {
    let place = Place::new();
    place.write("g.ron", RIVERS);
    place.run(&["run", "g.ron", "-q", "--cache", "cache"]).done();
    assert_eq!(place.names("out"), ["rivers.geojson"]);
    let text = place.read("out/rivers.geojson");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let features = json["features"].as_array().expect("features");
    assert!(!features.is_empty());
    for feature in features {
        let ends = feature["geometry"]["coordinates"].as_array().expect("coordinates");
        let [first, last] = [&ends[0], &ends[ends.len() - 1]].map(|end| end[2].as_f64().expect("an elevation"));
        assert!(last <= first && feature["properties"]["order"].as_u64().is_some_and(|order| order > 0));
    }
    place.run(&["run", "g.ron", "-q", "-o", "again", "--cache", "cache"]).done();
    assert_eq!(place.read("again/rivers.geojson"), text);
    place
        .run(&["render", "g.ron", "-o", "picture.png", "--output", "rivers"])
        .ended(1, &["the type lines, which cannot be drawn"]);
}

#[test]
fn a_flow_is_not_written_to_a_file() {
    let place = Place::new();
    place.write("g.ron", &RIVERS.replace("rivers.lines", "water.flow"));
    for command in ["check", "run"] {
        place.run(&[command, "g.ron"]).ended(1, &["output `rivers` is a flow", "`water.area`"]);
    }
    assert!(!place.path("out").exists());
}
