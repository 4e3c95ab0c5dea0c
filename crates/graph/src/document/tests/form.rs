//! The canonical form, and differences as text.

use super::*;

const UNTIDY: &str = r#"// head


/* block */
( // root
 nodes : {"b" :Ridged( octaves:3 , /* wave */ wavelength : 6000.0 ),  // first

   // about the second


   "longer": StreamPower ( height : "b" // wire
     , duration: "2 Myr" /* time */, mask: +.50 ), "c": Ridged(profile: [(0,0),(0.25,0.1),(0.5,0.25),(0.75, 0.6),(1,1)], wavelength: "12 km", octaves: 11, amplitude: 1200, centre: (8000, 8000)),
   /* last */
 },
  outputs:{"height":"longer",}, world: (size:(16384,16384)),
  // end
) // tail

// foot"#;

const TIDY: &str = r#"// head

/* block */
( // root
    nodes: {
        "b":      Ridged(
            octaves: 3,
            /* wave */
            wavelength: 6000,
        ), // first

        // about the second

        "longer": StreamPower(
            height: "b", // wire
            duration: "2 Myr", /* time */
            mask: 0.5,
        ),
        "c":      Ridged(
            profile: [(0, 0), (0.25, 0.1), (0.5, 0.25), (0.75, 0.6), (1, 1)],
            wavelength: "12 km",
            octaves: 11,
            amplitude: 1200,
            centre: (8000, 8000),
        ),
        /* last */
    },
    outputs: { "height": "longer" },
    world: (size: (16384, 16384)),
    // end
) // tail

// foot
"#;

#[test]
fn a_file_is_brought_into_canonical_form() {
    let form = |source: &str| format_source(source).expect("sound");
    assert_eq!(form(UNTIDY), TIDY);
    assert_eq!(form(TIDY), TIDY);
    assert_eq!(form(ALPS), ALPS);
    assert_eq!(form(""), "");
    assert_eq!(form("\r\n// only a comment\r\n"), "// only a comment\n");
    assert_eq!(form("(nodes:{})"), "(\n    nodes: {},\n)\n");
    assert!(format_source("(nodes: {)").is_err());
    assert_eq!(diff(&parse(UNTIDY), &parse(TIDY)), [""; 0]);
}

#[test]
fn differences_are_named_with_units() {
    let a = parse(ALPS);
    let changed = |from: &str, to: &str| {
        assert!(ALPS.contains(from), "{from}");
        diff(&a, &parse(&ALPS.replace(from, to)))
    };
    assert_eq!(changed("duration: 2e6", "duration: \"3 Myr\""), ["rivers.duration 2 Myr → 3 Myr"]);
    assert_eq!(changed("duration: 2e6", "duration: \"2 Myr\""), [""; 0]);
    assert_eq!(changed("duration: 2e6", "duration: 2000000.5"), ["rivers.duration 2000000 yr → 2000000.5 yr"]);
    assert_eq!(changed("talus: 33", "talus: 35"), ["scree.talus 33° → 35°"]);
    assert_eq!(changed(", talus: 33", ""), ["scree.talus 33° → 35°"]);
    assert_eq!(changed("\"rivers.height\"", "\"base\""), ["scree.height rivers.height → base.height"]);
    assert_eq!(
        changed("seed: 7", "seed: 8, boundary: (west: wall)"),
        ["world.seed 7 → 8", "world.boundary.west base → wall"]
    );
    assert_eq!(changed("seed: 7", "seed: 7, sea_level: \"0 m\""), ["world.sea_level none → 0 m"]);
    let [low, high] =
        ["-50", "\"1.2 km\""].map(|level| ALPS.replace("seed: 7", &format!("seed: 7, sea_level: {level}")));
    assert_eq!(diff(&parse(&low), &parse(&high)), ["world.sea_level -50 m → 1.2 km"]);
    assert_eq!(changed("cells: (1024, 1024)", "cells: 512"), ["world.cells 1024 x 1024 → 512 x 512"]);
    assert_eq!(changed("(16384, 16384)", "\"8 km\""), ["world.size 16.384 km x 16.384 km → 8 km x 8 km"]);
    assert_eq!(changed("rivers", "water"), ["node rivers renamed to water"]);
    assert_eq!(
        changed("\"flow\": \"rivers.area\"", "\"flow\": \"rivers\""),
        ["output flow rivers.area → rivers.height"]
    );
    assert_eq!(changed("\"flow\": \"rivers.area\", ", ""), ["output flow (rivers.area) removed"]);
    assert_eq!(
        changed("\"report\": Metrics(height: \"scree\"),", "\"more\": Thermal(height: \"base\", version: 3),"),
        [
            "node report (Metrics) removed",
            "node more (Thermal) added: height: base.height",
            "output metrics (report.report) removed"
        ]
    );
    assert_eq!(
        changed("Metrics", "Volcano"),
        ["node report Metrics → Volcano", "output metrics (report.report) removed"]
    );
    assert_eq!(changed("(23, 32)", "(\"23 deg\", 32.0)"), [""; 0]);
    assert_eq!(changed("(23, 32)", "(23, inf)"), ["expect.slope.p50 23° to 32° → at least 23°"]);
    assert_eq!(changed("(23, 32)", "(23, 32.0000001)"), ["expect.slope.p50 [23.0, 32.0] → [23.0, 32.0000001]"]);
    assert_eq!(
        changed("\"cell\": \"90 m\", \"relief\": (\"2 km\", inf)", "\"in\": (0, 0, \"8 km\", \"8 km\")"),
        [
            "expect.cell (90 m) removed",
            "expect.relief (at least 2 km) removed",
            "expect.in ((0 m, 0 m, 8 km, 8 km)) added"
        ]
    );
    let x = parse("(nodes: { \"a\": Volcano(x: 1.0) })");
    assert_eq!(diff(&x, &parse("(nodes: { \"a\": Volcano( x: 1 ), })")), [""; 0]);
    assert_eq!(diff(&x, &parse("(nodes: { \"a\": Volcano(x: 2) })")), ["node a (Volcano, unknown here) changed"]);
}
