//! `fit`: parameters found again from the terrain that they built, and requests that make no sense.

use super::{Place, Ran};

/// Hills with screes, 96 cells of 90 m.
const HILLS: &str = r#"// Hills with screes.
(
    format: 1,
    world: (size: (8640, 8640), cells: (96, 96), seed: 5),
    nodes: {
        "hills": Perlin(wavelength: "2 km", octaves: 6, amplitude: "0.9 km"), // quite high
        "scree": Thermal(height: "hills", talus: 30),
    },
    outputs: { "height": "scree", "before": "hills" },
    parameters: { "steepness": "scree.talus" },
)
"#;

/// The place with the graph to fit, whose values are 30 % off, and the target.
fn twin() -> Place {
    let place = Place::new();
    place.write("truth.ron", HILLS);
    place.run(&["run", "truth.ron", "-o", "t", "--only", "height"]).done();
    place.write("start.ron", &HILLS.replace("0.9 km", "0.63 km").replace("talus: 30", "talus: 39"));
    place
}

fn fit(place: &Place, args: &[&str]) -> Ran {
    place.run(&[&["fit", "start.ron", "--target", "t/height.exr", "-o", "out.ron"], args].concat())
}

/// The number behind a name in a file.
fn number(text: &str, name: &str) -> f64 {
    let (_, after) = text.split_once(&format!("{name}: ")).expect("the name");
    let digits: String =
        after.trim_start_matches('"').chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
    digits.parse().expect("a number")
}

#[test]
fn a_twin_is_recovered_and_written_in_place() {
    let place = twin();
    let ran = fit(&place, &["--vary", "hills.amplitude", "--vary", "steepness"]).done();
    let fitted = place.read("out.ron");
    let (amplitude, talus) = (number(&fitted, "amplitude"), number(&fitted, "talus"));
    assert!((amplitude / 0.9 - 1.0).abs() < 0.05 && (talus / 30.0 - 1.0).abs() < 0.05, "{amplitude} {talus}");
    // notation, comments and layout stay
    let there = fitted.replace(&format!("{amplitude} km"), "0.9 km").replace(&format!("talus: {talus}"), "talus: 30");
    assert_eq!(there, HILLS);
    for text in ["hills.amplitude", "630 m", "-10 %", "44 measures"] {
        assert!(ran.out.contains(text), "{text} is not in {}", ran.out);
    }
    assert!(ran.err.starts_with("   1  loss ") && ran.err.contains("steepness 39°"), "{}", ran.err);
    place.run(&["check", "out.ron"]).done();
}

#[test]
fn threads_do_not_change_the_result() {
    let place = twin();
    let args =
        ["--vary", "hills.amplitude=\"100 m..5 km\"", "--vary", "hills.octaves", "--evaluations", "25", "--json"];
    let with = |threads: &str| {
        let ran = fit(&place, &[&args[..], &["--threads", threads]].concat()).done();
        (ran.out, ran.err, place.bytes("out.ron"))
    };
    let one = with("1");
    assert_eq!(one, with("2"));
    let page: serde_json::Value = serde_json::from_str(&one.0).expect("JSON");
    assert_eq!((page["evaluations"].as_array().map(Vec::len), &page["stopped"]), (Some(25), &false.into()));
    let parameters = page["parameters"].as_array().expect("parameters");
    assert_eq!((&parameters[0]["start"], &parameters[0]["logarithmic"]), (&630.0.into(), &true.into()));
    assert!(parameters[1]["fitted"].as_f64().is_some_and(|octaves| octaves.fract() == 0.0), "{page:#}");
    assert!(page["loss"].as_f64() < page["loss_at_start"].as_f64(), "{page:#}");
    assert_eq!(one.1, "", "no progress beside JSON");
}

#[test]
fn requests_that_make_no_sense_are_refused() {
    let place = twin();
    place.write(
        "flat.asc",
        "ncols 4\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 90\n1 1 1 1\n1 1 1 1\n1 1 1 1\n1 1 1 1\n",
    );
    for (args, said) in [
        (&[][..], &["nothing to fit", "--vary NODE.PARAM"][..]),
        (&["--vary", "hill.amplitude"], &["there is no node `hill`", "did you mean `hills`?"]),
        (&["--vary", "hills.amplitud"], &["no input or parameter `amplitud`", "did you mean `amplitude`?"]),
        (&["--vary", "steepnes"], &["no parameter `steepnes`", "did you mean `steepness`?"]),
        (&["--vary", "hills.seed"], &["it is not a number", "the numbers of `hills` are wavelength"]),
        (&["--vary", "scree.height"], &["it is wired"]),
        (&["--vary", "scree.talus=40..20"], &["the range 40°..20° is empty", "write `=20°..40°`"]),
        (&["--vary", "scree.talus=30..30"], &["is empty"]),
        (&["--vary", "scree.talus=20..95"], &["not within the declared one", "write `=20°.."]),
        (&["--vary", "scree.talus=20..40 km"], &["`km` is not a unit of an angle"]),
        (&["--vary", "scree.talus", "--vary", "scree.talus=20..40"], &["varied twice"]),
    ] {
        fit(&place, args).ended(1, said);
    }
    let to = |args: &[&str], said: &[&str]| {
        place.run(&[&["fit", "--vary", "scree.talus", "-o", "out.ron"], args].concat()).ended(1, said);
    };
    to(&["start.ron", "--target", "t/missing.exr"], &["missing.exr"]);
    to(&["start.ron", "--target", "flat.asc"], &["has no measure whose spread", "use a target of"]);
    place.write("bare.r32", "0123456789abcdef");
    to(&["start.ron", "--target", "bare.r32"], &["does not state its cell size", "--cell 30"]);
    place.write("several.ron", &HILLS.replace("\"height\": \"scree\"", "\"after\": \"scree\""));
    to(&["several.ron", "--target", "t/height.exr"], &["`after`, `before`", "name the output to fit `height`"]);
    place.write(
        "none.ron",
        &HILLS.replace("{ \"height\": \"scree\", \"before\": \"hills\" }", "{ \"m\": \"scree.moved\" }"),
    );
    to(&["none.ron", "--target", "t/height.exr"], &["`none.ron` has no height among its outputs", "add the height"]);
    assert!(!place.path("out.ron").exists());
    let args = ["fit", "start.ron", "--target", "t/height.exr", "--vary", "scree.talus"];
    for (out, said) in [
        ("start.ron", "`start.ron` is the graph itself"),
        ("t", "`t` is a folder"),
        ("no/g.ron", "there is no folder `no`"),
    ] {
        place.run(&[&args[..], &["-o", out]].concat()).ended(1, &[said]);
    }
}

/// The first press of Ctrl-C ends the search, whose best values are written.
#[cfg(target_os = "linux")]
#[test]
fn a_stopped_search_writes_the_best_values_so_far() {
    let place = twin();
    let line = "\"$0\" fit start.ron --target t/height.exr --vary hills.amplitude --vary hills.gain --vary hills.wavelength \
                --cells 384 --evaluations 5000 -o out.ron 2>err & \
                while ! grep -q '^  12 ' err; do sleep 0.05; done; kill -INT $!; wait $!; code=$?; cat err >&2; exit $code";
    let ran = place.shell(line).ended(130, &["stopped after", "the best values so far are in `out.ron`"]);
    assert!(ran.out.contains("fitted") && !ran.out.contains("-10 %"), "{}", ran.out);
    place.run(&["check", "out.ron"]).done();
}
