//! `expect`: figures, misses and exit codes.

use super::{Place, json_lines};

/// Ridges of about 500 m, and a mask of them.
const LAND: &str = r#"(
    format: 1,
    world: (size: ("9.6 km", "6.4 km"), cells: (96, 64), seed: 3),
    nodes: {
        "hills": Ridged(wavelength: "3 km", amplitude: "500 m"),
        "flat": Constant(value: 5),
        "steep": Slope(height: "hills"),
    },
    outputs: { "height": "hills", "steep": "steep" },
    expect: { "cell": "200 m", "relief": ("10 m", "2 km"), "hypsometric_integral": (0, 1) },
)
"#;

/// The file with other expectations.
fn expecting(expect: &str) -> String {
    let (before, rest) = LAND.split_once("    expect: ").expect("it has some");
    let (_, after) = rest.split_once('\n').expect("a line");
    format!("{before}    expect: {{ {expect} }},\n{after}")
}

#[test]
fn figures_are_printed_and_a_miss_exits_with_1_after_all_files_are_written() {
    let place = Place::new();
    place.write("g.ron", LAND);
    let ran = place.run(&["run", "g.ron", "-o", "met"]).done();
    for text in ["expectations of height (cells of 200 m)", "10 m to 2 km", "met", "0 to 1"] {
        assert!(ran.out.contains(text), "{text} is not in {}", ran.out);
    }
    place.write("missed.ron", &expecting(r#""relief": ("8 km", inf), "elevation.max": (-inf, "9 km")"#));
    let ran =
        place.run(&["run", "missed.ron"]).ended(1, &["1 of 2 expectations missed: `relief` is", "not at least 8 km"]);
    assert!(ran.out.contains("missed") && ran.out.contains("at most 9 km"), "{}", ran.out);
    assert_eq!(place.names("out").len(), 5, "all files are written");
    place.run(&["run", "missed.ron", "-q"]).ended(1, &["`relief`"]);
    let figure = |out: &str| {
        let line = out.lines().find(|line| line.trim_start().starts_with("hypsometric_integral"));
        line.expect("the figure").split_whitespace().nth(1).expect("a number").parse::<f64>().expect("a number")
    };
    // with other cells it is measured on the same ones
    let fine = place.run(&["run", "g.ron", "--cells", "192", "-o", "fine"]).done();
    let coarse = place.run(&["run", "g.ron", "-o", "met"]).done();
    assert!((figure(&fine.out) - figure(&coarse.out)).abs() < 0.01, "{}", fine.out);
    let coarser = place.run(&["run", "g.ron", "--cells", "24", "-o", "coarse"]).done();
    let note = "expected on cells of 200 m, but those of the world are 400 m";
    assert!(coarser.out.contains(note), "{}", coarser.out);
}

#[test]
fn undefined_figures_are_missed_and_parts_are_not_checked() {
    let place = Place::new();
    let flat = LAND.replace("\"height\": \"hills\"", "\"height\": \"flat\"");
    place.write("flat.ron", &flat);
    place.run(&["run", "flat.ron"]).ended(1, &["`hypsometric_integral` is undefined", "2 of 2 expectations"]);
    for args in [["--window", "1 km,1 km,2 km x 2 km"], ["--only", "steep"]] {
        let ran = place.run(&[&["run", "flat.ron"][..], &args].concat()).done();
        assert!(ran.out.contains("expectations are not checked"), "{}", ran.out);
    }
    place.write("unclear.ron", &LAND.replace("\"height\": \"hills\"", "\"a\": \"hills\", \"b\": \"flat\""));
    place
        .run(&["run", "unclear.ron"])
        .ended(1, &["may be about any of `a`, `b`", "name the output that they are about"]);
    place.run(&["check", "unclear.ron"]).done();
    let sea = expecting(r#""land_share": (0.1, 0.99), "sea_level": ("90 m", "91 m")"#);
    place.write("sea.ron", &sea.replace("seed: 3", "seed: 3, sea_level: \"90.5 m\""));
    place.run(&["run", "sea.ron"]).done();
    place.run(&["render", "flat.ron", "-o", "map.png"]).done();
}

#[test]
fn expectations_that_make_no_sense_are_problems() {
    let place = Place::new();
    for (expect, said) in [
        (r#""relif": (0, 1)"#, "did you mean `relief`?"),
        (r#""relief": ("3 km", "1 km")"#, "the lowest figure of `relief` is above the highest"),
        (r#""relief": ("3 yr", "1 km")"#, "`yr` is not a unit of a length"),
        (r#""relief": (0, 1), "in": (0, 0, "10 km", "1 km")"#, "is not within the world of 9.6 km x 6.4 km"),
        (r#""relief": (0, 1), "in": (0, 0, 0, 0)"#, "`in` has no extent"),
        (r#""relief": (0, 1), "cell": -3"#, "must be above zero"),
    ] {
        place.write("g.ron", &expecting(expect));
        place.run(&["check", "g.ron"]).ended(1, &[said]);
        place.run(&["run", "g.ron"]).ended(1, &[said]);
    }
    assert!(!place.path("out").exists());
}

#[test]
fn programs_read_figures_as_json() {
    let place = Place::new();
    place.write("g.ron", &expecting(r#""in": (0, 0, "4 km", "4 km"), "relief": ("8 km", inf), "slope.mean": (0, 90)"#));
    let lines = json_lines(&place.run(&["run", "g.ron", "--json"]).ended(1, &["`relief`"]).out);
    let figures: Vec<_> = lines.iter().filter(|line| line["event"] == "expectation").collect();
    assert_eq!(figures.len(), 2);
    assert_eq!(
        (&figures[0]["measure"], &figures[0]["met"], &figures[0]["unit"]),
        (&"relief".into(), &false.into(), &"m".into())
    );
    assert_eq!(figures[0]["bounds"], serde_json::json!([8000.0, null]));
    assert!(figures[1]["met"] == true && figures[1]["value"].as_f64().is_some_and(|slope| slope > 0.0));
    let ends: Vec<_> = lines[lines.len() - 2..].iter().map(|line| line["event"].as_str()).collect();
    assert_eq!(ends, [Some("done"), Some("error")]);
    assert_eq!(lines.last().map(|line| &line["exit"]), Some(&1.into()));

    let page = json_lines(&place.run(&["check", "g.ron", "--describe", "--json"]).done().out);
    let expect = &page.last().expect("a page")["expect"];
    assert_eq!((&expect["output"], &expect["part_m"][2]), (&"height".into(), &4000.0.into()));
    assert_eq!(
        (&expect["measures"][0]["name"], &expect["measures"][0]["bounds"][0]),
        (&"relief".into(), &8000.0.into())
    );
    let text = place.run(&["check", "g.ron", "--describe"]).done().out;
    assert!(text.contains("Expectations") && text.contains("4 km x 4 km from (0 m, 0 m)"), "{text}");
    assert!(text.contains("at least 8 km"), "{text}");
}

#[test]
fn a_sweep_names_each_terrain_that_misses() {
    let place = Place::new();
    place.write("g.ron", &expecting(r#""relief": ("10 m", "2 km")"#));
    let args = ["run", "g.ron", "--sweep", "hills.amplitude=500 m,20 km,30 km", "-o", "out/{hills.amplitude}"];
    let ran = place.run(&args).ended(1, &["2 of 3 terrains missed an expectation"]);
    let lines: Vec<_> = ran.err.lines().filter(|line| line.starts_with("missed: ")).collect();
    assert!(lines.len() == 2 && lines[0].contains("hills.amplitude=20 km: 1 of 1 expectation missed"), "{}", ran.err);
    assert_eq!(place.names("out").len(), 3, "all are built");
    place.run(&["run", "g.ron", "--sweep", "seed=1..2", "-o", "seeds/{seed}"]).done();
}
