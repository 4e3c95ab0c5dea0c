//! Tests of `--window` and of the cache folder.

use std::fs;

use super::{Place, json_lines};

/// Generators, a filter with a halo, and rivers, which need the whole world.
const LAND: &str = r#"(
    format: 1,
    world: (size: ("9.6 km", "6.4 km"), cells: (96, 64), seed: 3),
    nodes: {
        "hills": Ridged(wavelength: "3 km", amplitude: "500 m"),
        "soft": Blur(value: "hills", radius: "300 m"),
        "rivers": StreamPower(height: "hills", duration: "20 kyr"),
        "relief": Hillshade(height: "soft"),
        "report": Metrics(height: "rivers"),
    },
    outputs: {
        "soft": "soft", "rivers": "rivers", "area": "rivers.area", "colour": "relief.colour", "report": "report",
    },
)
"#;

fn samples(place: &Place, file: &str) -> Vec<[u8; 4]> {
    fs::read(place.path(file)).expect("written").as_chunks().0.to_vec()
}

/// Supersampling writes the means of the finer build, of a window and with the largest drainage areas.
#[test]
fn supersampling_averages_a_build_on_finer_cells() {
    let place = Place::new();
    place.write("g.ron", LAND);
    let finer = ["run", "g.ron", "-q", "--format", "r32", "--cells", "192", "-o", "fine"];
    place.run(&finer).done();
    let averaged = ["run", "g.ron", "--format", "r32", "--cells", "96", "--supersample", "2", "-o", "mean"];
    let ran = place.run(&averaged).done();
    assert!(ran.out.contains("96 x 64 cells of 100 m, each from 2 x 2 finer ones"), "{}", ran.out);
    let part = ["run", "g.ron", "-q", "--format", "r32", "--supersample", "2", "--window", "1 km,2 km,1 km x 1 km"];
    place.run(&[&part[..], &["-o", "part"]].concat()).done();
    let number = |bytes: [u8; 4]| f32::from_le_bytes(bytes);
    for (output, largest) in [("rivers", false), ("area", true)] {
        let [fine, mean, part] =
            ["fine", "mean", "part"].map(|folder| samples(&place, &format!("{folder}/{output}.r32")));
        for (x, y) in (0..96).flat_map(|x| (0..64).map(move |y| (x, y))) {
            let four = [0, 1, 192, 193].map(|at| number(fine[2 * y * 192 + 2 * x + at]));
            let expected = if largest {
                four.into_iter().fold(0.0, f32::max)
            } else {
                (four.map(f64::from).iter().sum::<f64>() / 4.0) as f32
            };
            assert_eq!(number(mean[y * 96 + x]), expected, "{output} in {x}, {y}");
        }
        assert!((0..10).all(|y| part[y * 10..][..10] == mean[(20 + y) * 96 + 10..][..10]), "window of {output}");
    }
    let sidecar = |folder: &str| -> serde_json::Value {
        serde_json::from_str(&place.read(&format!("{folder}/rivers.r32.json"))).expect("JSON")
    };
    assert_eq!([sidecar("fine")["supersample"].as_u64(), sidecar("mean")["supersample"].as_u64()], [None, Some(2)]);
    let hash = |folder: &str| sidecar(folder)["graph_hash"].as_str().expect("a hash").to_owned();
    assert!(hash("fine") != hash("mean") && hash("fine").len() == hash("mean").len());
    for factor in ["0", "9"] {
        place
            .run(&["run", "g.ron", "--supersample", factor, "-o", "none"])
            .ended(1, &["not a whole number from 1 to 8"]);
    }
    let too_many = ["run", "g.ron", "--cells", "15000", "--supersample", "8", "-o", "none"];
    place.run(&too_many).ended(1, &["`--supersample 8`", "limit"]);
}

#[test]
fn a_window_equals_the_same_part_of_the_whole_build() {
    let place = Place::new();
    place.write("g.ron", LAND);
    for cells in ["96", "192"] {
        let n: usize = cells.parse().expect("a number");
        let whole = format!("whole{cells}");
        place.run(&["run", "g.ron", "-q", "--format", "r32", "--cells", cells, "-o", &whole]).done();
        // inside the world, in a corner, a single cell, from the north side to the south side
        for (at, window) in
            ["1 km,2 km,3 km x 1.5 km", "0,0,500x400", "5000,3000,1 x 1", "9 km,0,0.6 km x 6.4 km"].iter().enumerate()
        {
            let out = format!("part{cells}-{at}");
            place
                .run(&["run", "g.ron", "-q", "--format", "r32", "--cells", cells, "--window", window, "-o", &out])
                .done();
            for output in ["soft", "rivers", "area"] {
                let sidecar: serde_json::Value =
                    serde_json::from_str(&place.read(&format!("{out}/{output}.r32.json"))).expect("JSON");
                let number = |name: &str, axis: usize| sidecar[name][axis].as_u64().expect("a number") as usize;
                let (x, y) = (number("origin_cells", 0), number("origin_cells", 1));
                let nx = sidecar["columns"].as_u64().expect("columns") as usize;
                let ny = sidecar["rows"].as_u64().expect("rows") as usize;
                let (all, part) = (
                    samples(&place, &format!("{whole}/{output}.r32")),
                    samples(&place, &format!("{out}/{output}.r32")),
                );
                assert_eq!(part.len(), nx * ny);
                for j in 0..ny {
                    assert!(part[j * nx..][..nx] == all[(y + j) * n + x..][..nx], "{output} of {window}, row {j}");
                }
                let cell_m = 9600.0 / n as f64;
                assert_eq!(sidecar["origin_m"][0].as_f64(), Some(x as f64 * cell_m));
            }
            assert_eq!(place.read(&format!("{out}/report.json")), place.read(&format!("{whole}/report.json")));
        }
    }
}

#[test]
fn an_impossible_window_is_refused() {
    let place = Place::new();
    place.write("g.ron", LAND);
    let refused = |window: &str, words: &str| {
        place.run(&["run", "g.ron", &format!("--window={window}"), "-o", "none"]).ended(1, &[words]);
        assert!(!place.path("none").exists());
    };
    refused("9 km,0,1 km x 1 km", "not within the world of 9.6 km x 6.4 km");
    refused("-1,0,10x10", "not within");
    let ran = place.run(&["run", "g.ron", "--window", "1,2"]);
    assert!(ran.err.contains("4 km,6 km,2 km x 2 km"), "{}", ran.err);
    place.write("round.ron", &LAND.replace("seed: 3", "seed: 3, boundary: periodic"));
    place.run(&["run", "round.ron", "--window", "9 km,0,1 km x 1 km"]).ended(1, &["periodic"]);
}

#[test]
fn the_cache_folder_is_shown_and_cleared() {
    let place = Place::new();
    place.write("g.ron", LAND);
    place.run(&["run", "g.ron", "-q", "--cache", "kept"]).done();
    let shown = place.run(&["cache", "--cache", "kept"]).done().out;
    assert!(shown.contains("kept") && shown.contains("results") && shown.contains("limit"), "{shown}");
    // the inputs of a window are cropped from the stored results of the whole world
    let args = ["run", "g.ron", "--json", "--cache", "kept", "--window", "1 km,1 km,1 km x 1 km", "-o", "part"];
    let lines = json_lines(&place.run(&args).done().out);
    let nodes: Vec<_> = lines.iter().filter(|line| line["event"] == "node").collect();
    assert!(!nodes.is_empty() && nodes.iter().all(|node| node["origin"] == "disk"), "{nodes:?}");
    let json = |args: &[&str]| -> serde_json::Value {
        serde_json::from_str(&place.run(&[args, &["--cache", "kept", "--json"]].concat()).done().out).expect("JSON")
    };
    let found = json(&["cache"]);
    assert!(found["results"].as_u64() > Some(0) && found["bytes"].as_u64() > Some(0), "{found}");
    assert_eq!(json(&["cache", "clear"])["deleted"], found["results"]);
    place.run(&["run", "g.ron", "-q", "--cache", "kept"]).done();
    assert!(place.run(&["cache", "clear", "--cache", "kept"]).done().out.contains("deleted"));
    assert!(place.run(&["cache", "--cache", "kept"]).done().out.contains("0 results"));
    assert!(place.run(&["cache"]).done().out.contains("OROGRAPH_CACHE"), "turned off in these tests");
    let computed = json_lines(&place.run(&["run", "g.ron", "--json", "--no-cache"]).done().out);
    assert!(computed.iter().filter(|line| line["event"] == "node").all(|node| node["origin"] == "computed"));
}
