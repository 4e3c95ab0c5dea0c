//! Exposed parameters and inputs, and graph files as nodes of others.

use std::path::Path;

use tempfile::TempDir;

use super::*;
use crate::{Fallback, ParamValue, Port, mix};

/// A file with two parameters, one of them with two places, and an input.
const RIDGE: &str = r#"// A ridge,
// cut by rivers.
(
    inputs: { "land": (feeds: "rivers.height", doc: "Land to cut.") },
    // what others may set
    parameters: {
        "age": (drives: ["rivers.duration", "late.duration"], range: ("0.5 Myr", "4 Myr")), // years
        "rock": "rivers.erodibility",
    },
    nodes: {
        "base": Ridged(octaves: 3, seed: 5, file: "data/map.png"),
        "rivers": StreamPower(height: "base"),
        "late": StreamPower(height: "rivers"),
    },
    outputs: { "height": "late", "area": "late.area" },
)
"#;

/// A folder with the file above as `lib/ridge.ron`, and another that uses it.
fn using(nodes: &str) -> (TempDir, Document) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir_all(folder.path().join("lib/data")).expect("made");
    std::fs::write(folder.path().join("lib/data/map.png"), "").expect("written");
    std::fs::write(folder.path().join("lib/ridge.ron"), RIDGE).expect("written");
    let document = at(folder.path(), nodes);
    (folder, document)
}

fn at(folder: &Path, nodes: &str) -> Document {
    let source = format!("(nodes: {{ {nodes} }}, outputs: {{ \"o\": \"a\" }})");
    Document::parse_at(source, folder.join("outer.ron"), &registry())
}

#[track_caller]
fn problem(document: &Document) -> String {
    match document.problems() {
        [one] => format!("{}; {}", one.message, one.hint.as_deref().unwrap_or("")),
        other => panic!("{other:?}"),
    }
}

#[test]
fn parameters_and_inputs_are_read_from_their_places() {
    let document = parse(&RIDGE.replace(r#", file: "data/map.png""#, ""));
    assert_eq!(document.problems(), []);
    let [age, rock] = document.parameters() else { panic!("{:?}", document.parameters()) };
    assert_eq!((age.name.as_str(), age.doc.as_str(), age.unit, age.places.len()), ("age", "How long.", Unit::Years, 2));
    assert_eq!(age.kind, crate::Kind::Float { default: 1e6, hard: [5e5, 4e6], soft: [5e5, 4e6] });
    assert_eq!((rock.unit, rock.kind.default_value()), (Unit::Erodibility, ParamValue::Float(2e-6)));
    let [land] = document.inputs() else { panic!("{:?}", document.inputs()) };
    assert_eq!((land.doc.as_str(), land.ty, land.fallback), ("Land to cut.", PortType::Height, Fallback::None));
    assert_eq!(document.about(), "A ridge,\ncut by rivers.");
}

#[test]
fn wrong_entries_are_reported_with_a_remedy() {
    for (entry, said) in [
        (r#""age": "rivers.duratoin""#, "no parameter `duratoin`; did you mean `rivers.duration`?"),
        (r#""age": "river.duration""#, "there is no node `river`; did you mean `rivers`?"),
        (r#""age": "rivers""#, "which is not a parameter"),
        (r#""age": 3"#, "`age` is the number `3`, but takes a place"),
        (r#""age": (doc: "x")"#, "does not say what it drives"),
        (r#""age": (drives: "rivers.m", dco: "x")"#, "no field `dco`; did you mean `doc`?"),
        (r#""age": (drives: "rivers.m", range: (0, 3))"#, "wider than its places allow"),
        (r#""age": (drives: "rivers.m", range: (1, 2))"#, "`age` is 0.5, but its range is 1 to 2"),
        (r#""age": (drives: "base.shape", range: (1, 2))"#, "not a number, so it cannot have a range"),
        (r#""age": ["rivers.m", "rivers.duration"]"#, "give each its own name"),
        (r#""age": ["rivers.duration", "late.duration"]"#, "(1000000) and `late.duration` (2000000), which differ"),
        (r#""age": "rivers.height""#, "takes a wire, not a number; name it in `inputs`"),
        (r#""seed": "base.seed""#, "every `Subgraph` has a `seed`"),
        (r#""my-age": "rivers.m""#, "`my-age` cannot name a parameter"),
        (r#""a": "rivers.m", "b": "rivers.m""#, "is already exposed as `a`"),
    ] {
        let document = parse(&format!(
            r#"(parameters: {{ {entry} }}, outputs: {{ "o": "late" }}, nodes: {{
                "base": Ridged, "rivers": StreamPower(height: "base"),
                "late": StreamPower(height: "rivers", duration: "2 Myr") }})"#
        ));
        let told = problem(&document);
        assert!(told.contains(said), "{entry}: {told}");
    }
    let open = parse(r#"(inputs: { "land": "a.height" }, nodes: { "a": StreamPower }, outputs: { "o": "a" })"#);
    assert!(!open.has_errors() && problem(&open).contains("only another graph can use"), "{:?}", open.problems());
    assert_eq!(open.inputs()[0].fallback, Fallback::Required);
}

#[test]
fn edits_carry_names_along() {
    let mut document = parse(&RIDGE.replace(r#", file: "data/map.png""#, ""));
    document.apply(&Edit::RenameNode { from: "late".into(), to: "last".into() }).expect("renamed");
    assert!(document.source().contains(r#"["rivers.duration", "last.duration"], range"#), "{}", document.source());
    document.apply(&Edit::SetNamed { name: "age".into(), text: "2 Myr".into() }).expect("set");
    for node in ["rivers", "last"] {
        let graph = document.graph();
        let instance = graph.instance(graph.find(node).expect("there"));
        assert_eq!(instance.params.get("duration"), Some(&ParamValue::Float(2e6)));
    }
    let wide = document.apply(&Edit::SetNamed { name: "age".into(), text: "5 Myr".into() });
    assert!(wide.expect_err("too long").to_string().contains("its range is 500 kyr to 4 Myr"));
    let unknown = document.apply(&Edit::SetNamed { name: "aeg".into(), text: "2 Myr".into() });
    assert!(unknown.expect_err("no such name").to_string().contains("did you mean `age`?"));
    document.apply(&Edit::RemoveNode { name: "rivers".into() }).expect("removed");
    assert!(document.source().contains(r#""age": (drives: ["last.duration"], range"#), "{}", document.source());
    assert!(!document.source().contains("rock") && document.inputs().is_empty(), "{}", document.source());
    assert!(document.source().contains("// what others may set"));
    while document.undo() {}
    assert_eq!(document.source(), RIDGE.replace(r#", file: "data/map.png""#, ""));
    let canonical = format_source(RIDGE).expect("sound");
    assert_eq!(format_source(&canonical), Ok(canonical.clone()));
    assert!(canonical.contains("// years") && canonical.contains("// what others may set"));
}

#[test]
fn values_are_exposed_and_concealed() {
    let expose =
        |node: &str, name: &str, to: &str| Edit::Expose { node: node.into(), name: name.into(), to: to.into() };
    let mut document = parse(&RIDGE.replace(r#", file: "data/map.png""#, ""));
    let before = document.source().to_owned();
    for (edit, line) in [
        // a parameter, a number at an input, a wire, and an input that accepts nothing else
        (expose("base", "octaves", "roughness"), r#""roughness": "base.octaves","#),
        (expose("late", "mask", "share"), r#""share": "late.mask","#),
        (
            expose("late", "height", "cut"),
            r#"inputs: { "land": (feeds: "rivers.height", doc: "Land to cut."), "cut": "late.height" },"#,
        ),
        // an existing name gets both places
        (expose("late", "erodibility", "rock"), r#""rock": ["rivers.erodibility", "late.erodibility"],"#),
        (
            Edit::RenameNamed { from: "age".into(), to: "years".into() },
            r#""years": (drives: ["rivers.duration", "late.duration"], range: ("0.5 Myr", "4 Myr")), // years"#,
        ),
        (
            Edit::RenameNamed { from: "land".into(), to: "ground".into() },
            r#"inputs: { "ground": (feeds: "rivers.height", doc: "Land to cut.") },"#,
        ),
    ] {
        document.apply(&edit).unwrap_or_else(|error| panic!("{edit:?}: {error}"));
        assert!(document.source().lines().any(|l| l.trim() == line), "{line}\n{}", document.source());
        assert_eq!(document.problems(), []);
        assert!(document.undo());
        assert_eq!(document.source(), before);
    }
    for (edit, said) in [
        (expose("rivers", "duration", "span"), "is already exposed as `age`"),
        (expose("base", "octaves", "rock"), "which is"),
        (expose("base", "octaves", "file"), "every `Subgraph` has a `file`"),
        (expose("base", "octaves", "2x"), "cannot name a parameter"),
        (expose("base", "octave", "x"), "did you mean `octaves`?"),
        (Edit::Conceal { name: "ages".into() }, "did you mean `age`?"),
        (Edit::RenameNamed { from: "rock".into(), to: "land".into() }, "names both"),
    ] {
        let error = document.apply(&edit).expect_err("refused").to_string();
        assert!(error.contains(said), "{edit:?}: {error}");
        assert_eq!(document.source(), before);
    }
    for name in ["age", "land"] {
        document.apply(&Edit::Conceal { name: name.into() }).expect("stands there");
    }
    assert_eq!(document.source().lines().find(|line| line.contains("inputs")), Some("    inputs: {},"));
    assert_eq!((document.parameters().len(), document.inputs().len()), (1, 0));

    let mut plain = parse("(nodes: { \"a\": Ridged })");
    plain.apply(&expose("a", "octaves", "detail")).expect("free");
    assert_eq!(plain.parameters().len(), 1, "{}", plain.source());
    assert!(plain.undo());
    assert_eq!(plain.source(), "(nodes: { \"a\": Ridged })");
}

#[test]
fn differences_of_names_and_of_inner_files_are_listed() {
    let (folder, before) = using(r#""a": Subgraph(file: "lib/ridge.ron")"#);
    std::fs::write(folder.path().join("lib/ridge.ron"), RIDGE.replace("octaves: 3", "octaves: 4")).expect("written");
    let after = at(folder.path(), r#""a": Subgraph(file: "lib/ridge.ron", age: "2 Myr")"#);
    assert_eq!(diff(&before, &after), ["a.age 1 Myr → 2 Myr", "a/ base.octaves 3 → 4"]);
    let named = |entry: &str| parse(&format!("(parameters: {{ {entry} }}, nodes: {{ \"base\": Ridged }})"));
    let lines = diff(&named(r#""width": "base.wavelength""#), &named(r#""width": "base.amplitude""#));
    assert!(matches!(lines.as_slice(), [line] if line.starts_with("parameter width base.wavelength")), "{lines:?}");
}

#[test]
fn a_graph_file_is_a_node() {
    let (_folder, document) = using(
        r#""hills": Ridged(octaves: 2), "a": Subgraph(file: "lib/ridge.ron", land: "hills", age: "2 Myr", rock: 3e-6),
           "b": Metrics(height: "a.area"), "c": Subgraph(file: "lib/ridge.ron", seed: 9)"#,
    );
    assert_eq!(document.problems(), []);
    let outputs = document.graph().instance(document.graph().find("a").expect("there")).node.outputs;
    assert_eq!(outputs.iter().map(|output| output.name).collect::<Vec<_>>(), ["height", "area"]);

    let expanded = document.expand();
    let graph = &expanded.graph;
    let node = |name: &str| graph.find(name).unwrap_or_else(|error| panic!("{error}"));
    let param = |name: &str, param: &str| graph.instance(node(name)).params.get(param).cloned();
    assert_eq!(graph.port_name(expanded.outputs[0].port), "a/late.height");
    assert_eq!(graph.source(node("b"), 0).map(|port| graph.port_name(port)), Some("a/late.area".into()));
    assert_eq!(graph.source(node("a/rivers"), 0).map(|port| graph.port_name(port)), Some("hills.height".into()));
    assert_eq!(graph.source(node("c/rivers"), 0).map(|port| graph.port_name(port)), Some("c/base.height".into()));
    assert_eq!((param("a/rivers", "duration"), param("a/late", "duration")), {
        let two = Some(ParamValue::Float(2e6));
        (two.clone(), two)
    });
    assert_eq!(graph.instance(node("a/rivers")).constants[1], Some(3e-6));
    assert_eq!(graph.instance(node("a/late")).constants[1], None);
    assert_eq!(param("c/rivers", "duration"), Some(ParamValue::Float(1e6)));
    assert_eq!(param("c/base", "seed"), Some(ParamValue::Seed(5 ^ mix(9))));
    assert_eq!(param("a/base", "seed"), Some(ParamValue::Seed(5)), "0 leaves seeds as they are");
    let file = param("c/base", "file");
    assert!(
        matches!(&file, Some(ParamValue::File(file)) if Path::new(file) == Path::new("lib/data/map.png")),
        "{file:?}"
    );
    let port = |output| Port { node: document.graph().find("a").expect("there"), output };
    assert_eq!(expanded.port(port(1)).map(|port| graph.port_name(port)), Some("a/late.area".into()));
}

#[test]
fn equal_nodes_of_several_uses_are_one() {
    let (_folder, document) = using(
        r#""a": Subgraph(file: "lib/ridge.ron"), "b": Subgraph(file: "lib/ridge.ron", rock: 1e-6),
           "c": Subgraph(file: "lib/ridge.ron", seed: 1)"#,
    );
    let graph = document.expand().graph;
    let names: Vec<&str> = graph.indices().map(|node| graph.instance(node).name.as_str()).collect();
    let mut sorted = names.clone();
    sorted.sort_unstable();
    // The base of two uses is equal, the nodes after it are not.
    assert_eq!(sorted.len(), 8, "{sorted:?}");
    assert_eq!(names.iter().filter(|name| name.ends_with("/base")).count(), 2);
}

#[test]
fn uses_are_checked_like_other_nodes() {
    for (nodes, said) in [
        (r#""a": Subgraph"#, "`a` does not name a graph file; write `file"),
        (r#""a": Subgraph(file: "lib/rigde.ron")"#, "there is no file"),
        (r#""a": Subgraph(file: "lib")"#, "is a folder"),
        (r#""a": Subgraph(file: "lib/ridge.ron", aeg: 3)"#, "no input or parameter `aeg`; did you mean `age`?"),
        (r#""a": Subgraph(file: "lib/ridge.ron", age: "9 Myr")"#, "but must be"),
        (r#""a": Subgraph(file: "lib/ridge.ron", land: 3)"#, "takes a wire from a height"),
        (r#""a": Subgraph(file: "lib/ridge.ron"), "b": StreamPower(height: "a.area")"#, "gives a scalar (m²)"),
        (r#""a": Subgraph(file: "lib/ridge.ron"), "b": StreamPower(height: "a.aera")"#, "did you mean `a.area`?"),
        (r#""a": Subgrahp(file: "lib/ridge.ron")"#, "did you mean `Subgraph`?"),
        (r#""a": Ridged(file: "lib/none.png")"#, "there is no such file"),
    ] {
        let (_folder, document) = using(nodes);
        let told = problem(&document);
        assert!(told.contains(said), "{nodes}: {told}");
    }
}

#[test]
fn faults_inside_a_file_are_reported_with_its_name() {
    let (folder, _) = using(r#""a": Ridged"#);
    std::fs::write(folder.path().join("lib/ridge.ron"), RIDGE.replace("Ridged", "Rigded")).expect("written");
    let document =
        at(folder.path(), r#""a": Subgraph(file: "lib/ridge.ron", anything: "b"), "b": Metrics(height: "a")"#);
    assert!(problem(&document).contains("has errors, which must be fixed"));
    let [used] = document.uses() else { panic!("{:?}", document.uses()) };
    assert!(used.path.ends_with("lib/ridge.ron"));
    let inner = used.document.as_ref().expect("was read");
    assert_eq!(inner.problems()[0].hint.as_deref(), Some("did you mean `Ridged`?"));
    assert!(document.files().contains(&used.path), "it is watched all the same");
    // a string in a use that cannot be read may be a wire, and follows a new name
    let mut document = document;
    document.apply(&Edit::RenameNode { from: "b".into(), to: "c".into() }).expect("renamed");
    assert!(document.source().contains("anything: \"c\""), "{}", document.source());
    document.set_from_text("a", "file", "lib/ridge.ron").expect("a broken use can be mended");
}

#[test]
fn recursion_is_refused_with_the_chain() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str, inner: &str| {
        let text = format!("(nodes: {{ \"a\": Subgraph(file: \"{inner}\") }}, outputs: {{ \"o\": \"a\" }})");
        std::fs::write(folder.path().join(name), text).expect("written");
    };
    file("one.ron", "two.ron");
    file("two.ron", "three.ron");
    file("three.ron", "./one.ron");
    let document = Document::load(folder.path().join("one.ron"), &registry()).expect("readable");
    let mut innermost = document.uses()[0].document.clone().expect("read");
    while let Some(next) = innermost.uses().first().and_then(|used| used.document.clone()) {
        innermost = next;
    }
    let told = problem(&innermost);
    let chain: Vec<usize> = ["one.ron →", "two.ron →", "three.ron →", "one.ron;"]
        .map(|part| told.find(part).unwrap_or_else(|| panic!("{part} is not in {told}")))
        .to_vec();
    assert!(chain.is_sorted() && told.contains("uses itself"), "{told}");

    file("self.ron", "self.ron");
    let document = Document::load(folder.path().join("self.ron"), &registry()).expect("readable");
    assert!(problem(&document).contains("uses itself"));
}

#[test]
fn files_that_multiply_and_files_too_deep_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write("0.ron", r#"(nodes: { "n0": Ridged }, outputs: { "o": "n0" })"#);
    for level in 1..=40 {
        let uses = if level <= 12 { 10 } else { 1 };
        let nodes: Vec<String> =
            (0..uses).map(|i| format!("\"n{i}\": Subgraph(file: \"{}.ron\")", level - 1)).collect();
        write(&format!("{level}.ron"), &format!("(nodes: {{ {} }}, outputs: {{ \"o\": \"n0\" }})", nodes.join(", ")));
    }
    let deepest = |name: &str| {
        let mut document =
            std::sync::Arc::new(Document::load(folder.path().join(name), &registry()).expect("readable"));
        while let Some(next) =
            document.uses().iter().find_map(|used| used.document.clone().filter(|inner| inner.has_errors()))
        {
            document = next;
        }
        document.problems().first().map(|problem| problem.message.clone()).unwrap_or_default()
    };
    assert!(deepest("8.ron").contains("the graph has 211110 nodes"), "{}", deepest("8.ron"));
    assert!(deepest("40.ron").contains("graph files are nested"), "{}", deepest("40.ron"));
    assert_eq!(deepest("4.ron"), "");
}

#[test]
fn a_file_is_parsed_again_only_when_it_says_something_else() {
    let (folder, mut document) = using(
        r#""a": Subgraph(file: "lib/ridge.ron", land: "b"), "b": Ridged(), "c": Subgraph(file: "lib/ridge.ron")"#,
    );
    let files = |document: &Document| document.statistics().files_parsed;
    assert_eq!(files(&document), 1);
    let shown = |document: &Document| document.problems().iter().map(|p| p.code).collect::<Vec<_>>();
    assert_eq!(shown(&document), [] as [&str; 0]);
    for age in 1..5 {
        document.set_from_text("a", "age", &format!("{age}5 Myr")).expect_err("only up to 4");
        document.set_from_text("a", "age", &format!("0.{}5 Myr", age + 5)).expect("it is fine");
        document.amend(&Edit::SetLayout { node: "b".into(), at: Some([f64::from(age), 0.0]) }).expect("it is fine");
    }
    document.apply(&Edit::RenameNode { from: "b".into(), to: "ground".into() }).expect("it is fine");
    assert!(document.undo() && document.redo());
    let ridge = folder.path().join("lib/ridge.ron");
    std::fs::write(&ridge, RIDGE).expect("written");
    let build = document.build();
    document.look_again();
    assert_eq!(files(&document), 1);
    assert_ne!(document.build(), build);

    std::fs::write(&ridge, RIDGE.replace("octaves: 3", "octaves: 4")).expect("written");
    document.set_from_text("a", "age", "1.25 Myr").expect("it is fine");
    assert_eq!(files(&document), 2);
    // Equal nodes of several uses are added once.
    let base = document.expand().graph.find("c/base").expect("it is there");
    assert_eq!(document.expand().graph.instance(base).params.get("octaves"), Some(&ParamValue::Int(4)));

    // The files that a document depends on are read again, although its text is the same.
    std::fs::remove_file(folder.path().join("lib/data/map.png")).expect("removed");
    document.look_again();
    assert!(shown(&document).contains(&"subgraph"), "{:?}", document.problems());
    std::fs::write(folder.path().join("lib/data/map.png"), "").expect("written");
    document.look_again();
    assert_eq!(shown(&document), [] as [&str; 0]);
}

#[test]
fn a_file_that_is_kept_is_still_refused_where_it_uses_itself() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, nodes: &str| {
        let text = format!("(nodes: {{ {nodes} }}, outputs: {{ \"o\": \"a\" }})");
        std::fs::write(folder.path().join(name), text).expect("written");
    };
    write("inner.ron", "\"a\": Ridged()");
    write("middle.ron", "\"a\": Subgraph(file: \"inner.ron\")");
    let mut document = at(folder.path(), "\"a\": Subgraph(file: \"middle.ron\")");
    assert_eq!(document.problems(), []);
    assert_eq!(document.statistics().files_parsed, 2);
    write("inner.ron", "\"a\": Subgraph(file: \"middle.ron\")");
    document.look_again();
    assert!(document.has_errors(), "middle.ron uses itself through inner.ron");
    write("inner.ron", "\"a\": Ridged(octaves: 2)");
    document.look_again();
    assert_eq!(document.problems(), []);
    let a = document.expand().graph.find("a/a/a").expect("it is there");
    assert_eq!(document.expand().graph.instance(a).params.get("octaves"), Some(&ParamValue::Int(2)));
}
