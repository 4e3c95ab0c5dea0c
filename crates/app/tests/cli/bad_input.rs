//! Tests of bad input: a clear message with position and remedy, the right exit code, earlier outputs unchanged.

use std::fs;

use super::{Place, SMALL};

#[test]
fn files_that_are_not_graphs() {
    let place = Place::new();
    fs::create_dir(place.path("folder")).expect("made");
    fs::write(place.path("binary.ron"), [0xff, 0xfe, 0x00]).expect("written");
    place.write("empty.ron", "");
    for command in ["run", "check"] {
        place.run(&[command, "none.ron"]).ended(1, &["none.ron", "check the name"]);
        place.run(&[command, "folder"]).ended(1, &["`folder` is a folder"]);
        place.run(&[command, "binary.ron"]).ended(1, &["UTF-8"]);
        place.run(&[command, "empty.ron"]).ended(1, &["empty.ron"]);
    }
    assert_eq!(place.names("."), ["binary.ron", "empty.ron", "folder"], "no `out` is left");
}

#[test]
fn six_errors_are_six_problems() {
    let place = Place::new();
    place.write(
        "six.ron",
        r#"(
    format: 1,
    world: (size: (3200, 1600), cells: (32, 16)),
    nodes: {
        "plain": Constent(value: 700),
        "high": Constant(valeu: 700),
        "far": Constant(value: 1e12),
        "steep": Slope(height: "nowhere"),
        "high": Constant(value: 3),
        "light": Hillshade(version: 3, height: "far", azimuth: "2 km"),
    },
    outputs: { "steep": "steep" },
)
"#,
    );
    let ran = place.run(&["check", "six.ron"]).ended(
        1,
        &[
            "6 problems in six.ron",
            "did you mean `Constant`?",
            "did you mean `value`?",
            "six.ron:7:",
            "nowhere",
            "`km`",
        ],
    );
    assert_eq!(ran.err.matches("error:").count(), 6, "{}", ran.err);
    assert_eq!(super::json_lines(&place.run(&["check", "--json", "six.ron"]).ended(1, &[]).out).len(), 7);
    place.run(&["run", "six.ron"]).ended(1, &["6 problems in six.ron"]);
    assert!(!place.path("out").exists());
}

#[test]
fn invalid_graphs() {
    let place = Place::new();
    let deep = format!("(nodes: {{ \"a\": Constant(value: {}1{}) }})", "(".repeat(100_000), ")".repeat(100_000));
    let cycle = SMALL.replace("Slope(height: \"plain\")", "Slope(height: \"steep\")");
    for (name, text, said) in [
        ("cycle", cycle.as_str(), "cycle"),
        ("newer", &SMALL.replace("format: 1", "format: 99"), "99"),
        ("type", &SMALL.replace("Slope(height: \"plain\")", "Slope(height: \"relief.colour\")"), "colour"),
        (
            "quantity",
            &SMALL.replace("Slope(height: \"plain\")", "Creep(height: \"plain\", diffusivity: \"plain\")"),
            "put a `Remap` with `quantity: diffusivity` between them",
        ),
        ("port", &SMALL.replace("relief.colour", "relief.color"), "colour"),
        ("deep", &deep, "deep"),
        ("nothing", &SMALL.replace("cells: (32, 16)", "cells: (0, 0)"), "is empty"),
        ("huge", &SMALL.replace("cells: (32, 16)", "cells: (1000000000, 500000000)"), "EiB"),
        ("billion", &SMALL.replace("cells: (32, 16)", "cells: (44800, 22400)"), "3.7 GiB"),
        ("oblong", &SMALL.replace("cells: (32, 16)", "cells: (32, 32)"), "square"),
    ] {
        let file = place.write(&format!("{name}.ron"), text);
        let file = file.to_str().expect("plain name");
        place.run(&["check", file]).ended(1, &[said, &format!("{name}.ron:")]);
        place.run(&["run", file]).ended(1, &[said]);
    }
    assert!(!place.path("out").exists());
}

/// Settings that no terrain can be computed with get a warning before anything runs, where an output needs them. They
/// are no errors: another setting may make them right.
#[test]
fn check_warns_of_what_cannot_be_computed() {
    let place = Place::new();
    let graph = |node: &str, output: &str, more: &str| {
        format!(
            "(format: 1, world: (size: 3200, cells: 32), nodes: {{ \"plain\": Constant(value: 700), \"it\": {node} }}, \
             outputs: {{ \"height\": \"{output}\" }}, {more})"
        )
    };
    for (node, said) in [
        ("Distance()", "there is nothing to measure distances from"),
        ("Match(value: \"plain\")", "nothing is wired to `reference`"),
        ("Select(value: \"plain\", from: 3, to: 2)", "`from` is 3, above `to`, 2"),
        ("Remap(value: \"plain\", from: (2, 2))", "both values of `from` are 2"),
        (
            "StreamPower(version: 20, uplift: 0, height: \"plain\", erodibility: 1e-6, reference_rate: 0.001)",
            "both `erodibility` and `reference_rate` are given",
        ),
        (
            "StreamPower(version: 20, uplift: 0, height: \"plain\", method: analytical, n: 2)",
            "is for n = 1, and n is 2",
        ),
    ] {
        place.write("g.ron", &graph(node, "it", ""));
        let warned = place.run(&["check", "g.ron"]).done().err;
        assert!(warned.contains("warning: `it`") && warned.contains(said) && warned.contains("hint"), "{warned}");
        let ran = place.run(&["run", "g.ron"]).ended(1, &[said]);
        assert!(!ran.err.contains("computed in"), "nothing has run: {ran:?}");
        // unfinished, but not needed
        place.write("g.ron", &graph(node, "plain", ""));
        let noted = place.run(&["check", "g.ron"]).done().err;
        assert!(noted.starts_with("note: no output needs `it`") && !noted.contains("warning"), "{noted}");
    }
    let is_quiet = |node: &str, more: &str| {
        place.write("g.ron", &graph(node, "it", more));
        assert_eq!(place.run(&["check", "g.ron"]).done().err, "", "{node} {more}");
    };
    is_quiet("Match(value: \"plain\")", "muted: [\"it\"]");
    // what feeds a muted node only by its mask is not computed
    is_quiet("Combine(a: \"plain\", mask: \"far.mask\"), \"far\": Distance()", "muted: [\"it\"]");
    is_quiet("Select(value: \"plain\", from: 3, to: 2)", "parameters: { \"end\": \"it.to\" }");
    // a muted node without an input passes nothing on
    place.write("g.ron", &graph("Distance(selection: \"far.mask\"), \"far\": Distance()", "it", "muted: [\"far\"]"));
    assert!(place.run(&["check", "g.ron"]).done().err.contains("`it` (Distance) will fail"));
    // two settings that pass through a wrong range
    place.write("g.ron", &graph("Select(value: \"plain\", from: 1, to: 2)", "it", ""));
    place.run(&["run", "g.ron", "-q", "-o", "far", "--set", "it.from=5", "--set", "it.to=6"]).done();
    assert!(!place.path("out").exists());
}

#[test]
fn invalid_requests() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    for (args, said) in [
        (vec!["--cells", "0"], "not a whole number from 1"),
        (vec!["--set", "seed=4"], "write `--seed N`"),
        (vec!["--set", "world.cells=4"], "write `--cells N`"),
        (vec!["--set", "world.size=4"], "change the world in the file"),
        (vec!["--set", "plain.value="], "there is no value"),
        (vec!["--cells", "-5"], "`-5` is not a whole number from 1"),
        (vec!["--supersample", "2.5"], "not a whole number from 1 to 8"),
        (vec!["--window", "-1 km,0,2 km x 2 km"], "not within the world"),
        (vec!["--cells", "1000000000"], "EiB"),
        (vec!["--cells", "44800"], "3.7 GiB"),
        (vec!["--cells", "33x17"], "along the longer side alone"),
        (vec!["--cells", "many"], "not a whole number"),
        (vec!["--threads", "0"], "--threads"),
        (vec!["--format", "jpeg"], "possible values: exr"),
        (vec!["--only", "hieght"], "did you mean `height`?"),
        (vec!["--set", "plain.value"], "node.param=value"),
        (vec!["--set", "plian.value=3"], "did you mean `plain`?"),
        (vec!["--set", "plain.valeu=3"], "did you mean `value`?"),
        (vec!["--set", "plain.value=2 yr"], "yr"),
        (vec!["--backend", "cuda"], "possible values: auto, cpu, gpu"),
        (vec!["--colour"], "--colour"),
        (vec!["--dither"], "`--dither` has no effect"),
        (vec!["--set", "plain.value=3", "--set", "plain.value=4"], "`plain.value` is set twice"),
    ] {
        place.run(&[&["run", "g.ron"], &args[..]].concat()).ended(1, &[said]);
    }
    assert!(!place.path("out").exists());
}

/// Integer codes over the range of a raster need the whole raster, here 2 GiB for each of two. The shell limits the
/// program to 4 GiB of address space, whatever memory the machine has.
#[cfg(target_os = "linux")]
#[test]
fn a_world_that_does_not_fit_into_memory_is_refused_before_it_is_built() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let limited = "ulimit -v 4194304; exec \"$0\" run g.ron --threads 2 --cells 32768 --format png16";
    place.shell(limited).ended(2, &["GiB of memory", "fewer cells"]);
    assert!(!place.path("out").exists(), "a folder made for nothing is removed");
}

#[test]
fn outputs_without_files() {
    let place = Place::new();
    place.write("up.ron", &SMALL.replace("\"picture\":", "\"../picture\":"));
    let ran = place.run(&["run", "up.ron"]);
    assert_eq!(ran.code, 1, "{ran:?}");
    place.write(
        "none.ron",
        &SMALL.replace(
            "outputs: { \"height\": \"plain\", \"picture\": \"relief.colour\", \"steep\": \"steep\" }",
            "outputs: {}",
        ),
    );
    place.run(&["run", "none.ron"]).ended(1, &["no outputs"]);
    assert_eq!(place.names("."), ["none.ron", "up.ron"]);
}

#[test]
fn unwritable_folders() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    place.run(&["run", "g.ron", "-o", "g.ron"]).ended(2, &["g.ron", "not a folder"]);
    place.run(&["run", "g.ron", "-o", "g.ron/below"]).ended(2, &["not a folder"]);
    assert_eq!(place.read("g.ron"), SMALL);
    if cfg!(target_os = "linux") {
        // Not even root can create a folder there.
        place.run(&["run", "g.ron", "-o", "/proc/orograph"]).ended(2, &["/proc/orograph"]);
    }
    fs::create_dir_all(place.path("out/height.exr")).expect("made");
    place.run(&["run", "g.ron"]).ended(2, &["`out/height.exr` is a folder"]);
    assert_eq!(place.names("out"), ["height.exr"]);
}

#[test]
fn a_failure_leaves_earlier_outputs_unchanged() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    place.run(&["run", "g.ron", "-q"]).done();
    let before: Vec<Vec<u8>> =
        place.names("out").iter().map(|name| fs::read(place.path("out").join(name)).unwrap()).collect();
    // The mask is refused by its kernel, after the other nodes have run.
    let broken = SMALL.replace("Slope(height: \"plain\")", "Constant(value: 2, quantity: mask)");
    place.write("g.ron", &broken.replace("value: 700", "value: 900"));
    place.run(&["run", "g.ron", "-q"]).ended(1, &["`steep` (Constant)", "0 to 1"]);
    let after: Vec<Vec<u8>> =
        place.names("out").iter().map(|name| fs::read(place.path("out").join(name)).unwrap()).collect();
    assert!(before == after, "{:?}", place.names("out"));
}

/// A limit on the size of files simulates a full disk: both end a write in the middle.
#[cfg(unix)]
#[test]
fn a_failed_write_leaves_earlier_outputs_unchanged() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    place.run(&["run", "g.ron", "-q"]).done();
    let before = fs::read(place.path("out/height.exr")).expect("written");
    let names = place.names("out");
    // The signal that would end the program is ignored, so that the write fails instead.
    let limited = "trap '' XFSZ; ulimit -f 64; exec \"$0\" run g.ron --cells 1024 --set plain.value=900 --format";
    for (format, file) in [("exr", "height.exr"), ("tiff", "height.tif"), ("r32", "height.r32")] {
        let said = format!("cannot write `out/{file}`: the system does not allow a file of that size");
        place.shell(&format!("{limited} {format}")).ended(2, &[&said, "earlier files are unchanged"]);
    }
    assert!(fs::read(place.path("out/height.exr")).expect("there") == before);
    assert_eq!(place.names("out"), names);
}

/// An elevation model that the graph imports is not replaced by the output of its name, nor through a link to its
/// folder.
#[test]
fn a_graph_does_not_write_over_what_it_reads() {
    let place = Place::new();
    place.write("first.ron", SMALL);
    place.run(&["run", "first.ron", "--format", "tiff", "-o", "."]).done();
    let name = place.names(".").into_iter().find(|name| name.ends_with(".tif")).expect("a raster");
    let model = fs::read(place.path(&name)).expect("readable");
    let output = name.trim_end_matches(".tif");
    place.write(
        "g.ron",
        &format!(
            "(world: (size: 3200, cells: 32), nodes: {{ \"dem\": Import(file: \"{name}\") }}, \
             outputs: {{ \"{output}\": \"dem\" }})"
        ),
    );
    let refused = place.run(&["run", "g.ron", "--format", "tiff", "-o", "."]);
    refused.ended(1, &["the graph reads it", "choose another folder"]);
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(place.path("."), place.path("link")).expect("a link");
        place.run(&["run", "g.ron", "--format", "tiff", "-o", "link"]).ended(1, &["the graph reads it"]);
    }
    assert!(fs::read(place.path(&name)).expect("readable") == model, "the model is as it was");
    place.run(&["run", "g.ron", "--format", "tiff", "-o", "out"]).done();
}

#[test]
fn names_of_outputs_that_are_one_file_on_some_system() {
    let place = Place::new();
    for (names, why) in [(["Height", "height"], "two outputs"), (["con", "b"], "Windows"), (["a", "NUL"], "Windows")] {
        let [a, b] = names;
        place.write("g.ron", &format!("(nodes: {{ \"c\": Constant }}, outputs: {{ \"{a}\": \"c\", \"{b}\": \"c\" }})"));
        place.run(&["run", "g.ron", "--cells", "8"]).ended(1, &[why]);
    }
}

/// An option that none of the outputs uses is named; a quiet run says nothing.
#[test]
fn options_without_effect() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let idle = ["run", "g.ron", "--only", "picture", "--format", "tiff", "--mesh", "glb", "--lines", "metres"];
    let ran = place.run(&idle).done();
    for option in ["--format", "--mesh", "--lines"] {
        assert!(ran.err.contains(&format!("`{option}` has no effect: ")), "{option}: {ran:?}");
    }
    assert_eq!(place.run(&[&idle[..], &["-q"]].concat()).done().err, "");
    let used = place.run(&["run", "g.ron", "--only", "height", "--format", "tiff", "--mesh", "glb"]).done();
    assert!(!used.err.contains("no effect"), "{used:?}");
    let set = ["run", "g.ron", "--set", "plain.colour=3"];
    place.run(&set).ended(1, &["has no input or parameter `colour`", "it has `value`"]);
}

/// One value cannot be set twice, whether by the node's name or by a name of the file.
#[test]
fn a_value_is_set_once() {
    let place = Place::new();
    place.write("g.ron", &SMALL.replace("outputs:", "parameters: { \"level\": \"plain.value\" }, outputs:"));
    let (set, sweep) = (["--set", "level=800"], ["--sweep", "plain.value=800,900"]);
    let run = |more: [[&str; 2]; 2]| {
        place.run(&[&["run", "g.ron", "-q", "-o", "out/{plain.value}"], more.as_flattened()].concat())
    };
    run([set, ["--set", "plain.value=900"]]).ended(1, &["`level` and `plain.value` set the same value"]);
    run([set, sweep]).ended(1, &["`level` is set and `plain.value` swept", "remove one"]);
    run([sweep, ["--sweep", "level=700,800"]]).ended(1, &["`plain.value` and `level` sweep the same value"]);
    run([sweep, ["--sweep", "plain.value=700,800"]]).ended(1, &["swept twice"]);
    assert!(!place.path("out").exists());
}

#[test]
fn worlds_and_files_that_do_not_fit_name_their_remedy() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let fitted = place.run(&["run", "g.ron", "--cells", "33", "-o", "33"]).done();
    assert!(
        fitted.err.contains("the world becomes 3.2 km x 1.64") && fitted.err.contains("33 x 17 cells"),
        "{fitted:?}"
    );
    place.write("case.ron", &SMALL.replace("outputs: {", "outputs: { \"HEIGHT\": \"plain\","));
    place.run(&["run", "case.ron"]).ended(1, &["where file names have no case", "differs in more than its case"]);
    place.write("none.ron", &SMALL.replace("Constant(value: 700)", "Import(version: 2)"));
    place.run(&["check", "none.ron"]).ended(0, &["`plain` (Import) will fail: no file is named", "my.tif"]);
}

/// A raster is no graph, and one that does not hold heights is not taken for heights without a word.
#[test]
fn rasters_of_other_quantities() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    place.run(&["run", "g.ron", "-q", "--format", "tiff"]).done();
    place.run(&["check", "out/height.tif"]).ended(1, &["is a raster and not a graph file", "orograph new"]);
    for command in [&["metrics", "out/steep.tif"][..], &["new", "out/steep.tif", "-o", "new.ron"]] {
        place.run(command).ended(0, &["the file beside it says that it holds `scalar` in °"]);
    }
    let ran = place.run(&["metrics", "out/height.tif", "--range", "0,10"]).done();
    assert!(ran.err.contains("`--range` has no effect") && !ran.err.contains("beside it"), "{ran:?}");
}
