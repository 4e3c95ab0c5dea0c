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

/// A loss of 0 cannot fall: the search ends.
#[test]
fn a_twin_whose_values_are_known_ends_at_once() {
    let place = twin();
    let args = ["fit", "truth.ron", "--target", "t/height.exr", "-o", "out.ron", "--vary", "scree.talus", "--json"];
    let ran = place.run(&[&args[..], &["--evaluations", "200"]].concat()).done();
    let page: serde_json::Value = serde_json::from_str(&ran.out).expect("JSON");
    assert_eq!((&page["loss"], &page["stopped"]), (&0.0.into(), &false.into()));
    assert!(page["evaluations"].as_array().is_some_and(|all| all.len() < 100), "{}", ran.out);
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
    // nor a file that the graph reads
    let reads =
        HILLS.replace("Perlin(wavelength: \"2 km\", octaves: 6, amplitude: \"0.9 km\")", "Import(file: \"flat.asc\")");
    place.write("reads.ron", &reads);
    let before = place.read("flat.asc");
    let args = ["fit", "reads.ron", "--target", "t/height.exr", "--vary", "scree.talus", "-o", "flat.asc"];
    place.run(&args).ended(1, &["`flat.asc` would be written over"]);
    assert_eq!(place.read("flat.asc"), before);
}

/// A range that rivers cut, whose uplift varies from place to place.
const RANGE: &str = r#"(
    format: 1,
    world: (size: (20000, 20000), cells: (64, 64), seed: 3),
    nodes: {
        "ground": Perlin(wavelength: "12 km", octaves: 6, amplitude: "150 m"),
        "blocks": Perlin(wavelength: "10 km", octaves: 1, amplitude: 1),
        "rise": Remap(value: "blocks", from: (-1, 1), to: (0.0002, 0.0018), quantity: rate),
        // the uplift is to be found
        "rivers": StreamPower(version: 4, height: "ground", uplift: "rise", erodibility: 0.000003, duration: "600 kyr"),
    },
    outputs: { "height": "rivers", "rise": "rise" },
)
"#;

/// The place with the range of an even uplift, and the target.
fn uplifted() -> Place {
    let place = Place::new();
    place.write("truth.ron", RANGE);
    place.run(&["run", "truth.ron", "-o", "t", "--format", "tiff"]).done();
    place.write("start.ron", &RANGE.replace("uplift: \"rise\"", "uplift: \"0.7 mm/yr\""));
    place
}

fn fit_field(place: &Place, args: &[&str]) -> Ran {
    place.run(&[&["fit", "start.ron", "--target", "t/height.tif", "-o", "out.ron"], args].concat())
}

/// The values of a raw raster.
fn raw(place: &Place, name: &str) -> Vec<f64> {
    let bytes = place.bytes(name);
    bytes.chunks_exact(4).map(|four| f64::from(f32::from_le_bytes(four.try_into().expect("four bytes")))).collect()
}

#[test]
fn an_uplift_field_is_recovered_as_a_raster_beside_the_graph() {
    let place = uplifted();
    let ran = fit_field(&place, &["--vary", "rivers.uplift@5 km", "--evaluations", "12"]).done();
    for text in ["rivers.uplift", "-10 %", "8 x 8 values", "out.rivers_uplift.asc", "loss by measures"] {
        assert!(ran.out.contains(text), "{text} is not in {}", ran.out);
    }
    assert!(ran.err.starts_with("   1  loss ") && ran.err.contains("rivers.uplift 0.7 mm/yr"), "{}", ran.err);
    // the graph reads the field, and keeps its comments
    let fitted = place.read("out.ron");
    for text in [
        "uplift: \"rivers_uplift\"",
        "\"rivers_uplift\": Remap(value: \"rivers_uplift_map\", quantity: rate, clamp: false)",
        "Import(version: 2, file: \"out.rivers_uplift.asc\", quantity: scalar, placement: stretch)",
        "// the uplift is to be found",
    ] {
        let plain = fitted.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(plain.contains(text), "{text} is not in {fitted}");
    }
    place.run(&["check", "out.ron"]).done();
    // the uplift of the twin at the same values
    let truth = fitted.replace("\"height\": \"rivers\"", "\"found\": \"rivers_uplift\", \"height\": \"rivers\"");
    place.write("both.ron", &truth);
    place
        .run(&["run", "both.ron", "-o", "b", "--cells", "8", "--only", "found", "--only", "rise", "--format", "r32"])
        .done();
    let [found, rise] = [raw(&place, "b/found.r32"), raw(&place, "b/rise.r32")];
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let [a, b] = [mean(&found), mean(&rise)];
    let sum = |f: &dyn Fn(f64, f64) -> f64| found.iter().zip(&rise).map(|(x, y)| f(x - a, y - b)).sum::<f64>();
    let correlation = sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt();
    assert!(correlation > 0.9 && (a / b - 1.0).abs() < 0.05, "correlation {correlation}, means {a} and {b}");
}

#[test]
fn a_field_is_the_same_on_any_number_of_threads() {
    let place = uplifted();
    let with = |threads: &str| {
        let args =
            ["--vary", "rivers.uplift@10 km=0.1..1.2 mm/yr", "--evaluations", "4", "--json", "--threads", threads];
        (fit_field(&place, &args).done().out, place.bytes("out.ron"), place.bytes("out.rivers_uplift.asc"))
    };
    let one = with("1");
    assert_eq!(one, with("2"));
    let page: serde_json::Value = serde_json::from_str(&one.0).expect("JSON");
    assert_eq!((page["evaluations"].as_array().map(Vec::len), &page["grid"]), (Some(4), &serde_json::json!([4, 4])));
    let values = page["values"].as_array().expect("values");
    assert!(
        values.iter().all(|value| value.as_f64().is_some_and(|value| (1e-4..=1.2001e-3).contains(&value))),
        "{page:#}"
    );
    assert!(page["loss"].as_f64() < page["loss_at_start"].as_f64(), "{page:#}");
}

#[test]
fn fields_that_make_no_sense_are_refused() {
    let place = uplifted();
    for (args, said) in [
        (&["--vary", "rivers.uplift@fast"][..], &["`fast` is not a wavelength"][..]),
        (&["--vary", "rivers.uplift@0 m"], &["is not a wavelength"]),
        (&["--vary", "rivers.uplift@500 m"], &["does not fit the world and its cells", "1.25 km to 20 km"]),
        (&["--vary", "rivers.uplift@90 km"], &["does not fit the world"]),
        (&["--vary", "rivers.upliff@5 km"], &["takes a field of numbers", "did you mean `uplift`?"]),
        (&["--vary", "rivers.duration@5 km"], &["takes a field of numbers", "those of `rivers` that do are"]),
        (&["--vary", "river.uplift@5 km"], &["there is no node `river`", "did you mean `rivers`?"]),
        (&["--vary", "uplift@5 km"], &["write `--vary NODE.INPUT@WAVELENGTH`"]),
        (&["--vary", "rivers.height@5 km"], &["it has no range of values", "fit another input: "]),
        (&["--vary", "rivers.uplift@5 km=3..1 mm/yr"], &["is empty"]),
        (&["--vary", "rivers.uplift@5 km=0..3"], &["not within the declared one"]),
        (&["--vary", "rivers.uplift@5 km", "--vary", "rivers.repose"], &["a field is fitted alone"]),
        (&["--vary", "rivers.uplift@5 km", "--evaluations", "2"], &["2 evaluations cannot fit a field"]),
    ] {
        fit_field(&place, args).ended(1, said);
    }
    let small = RANGE.replace("(20000, 20000)", "(10000, 10000)");
    place.write("start.ron", &small);
    fit_field(&place, &["--vary", "rivers.uplift@5 km"])
        .ended(1, &["covers 20 km x 20 km, but the world 10 km x 10 km"]);
    // an input that the output does not depend on
    let apart = RANGE.replace(
        "\"rivers\": Stream",
        "\"other\": StreamPower(version: 4, height: \"ground\"),\n        \"rivers\": Stream",
    );
    place.write("start.ron", &apart);
    fit_field(&place, &["--vary", "other.uplift@5 km"]).ended(1, &["the height does not depend on it"]);
    assert!(!place.path("out.ron").exists() && !place.path("out.other_uplift.asc").exists());
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
