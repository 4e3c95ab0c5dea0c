//! Tests of graph files made from a selection, and of the way back.

use std::collections::{BTreeMap, BTreeSet};

use tempfile::TempDir;

use super::*;
use crate::{Extract, Graph, Inlined, Port};

const OUTER: &str = r#"(
    world: (size: 4000, cells: 64, seed: 3),
    inputs: { "land": ["rivers.height", "other.height"] },
    parameters: { "age": (drives: ["rivers.duration", "other.duration"], doc: "Years.") },
    nodes: {
        "base": Ridged(octaves: 3, seed: 5),
        "rough": Ridged(octaves: 9),
        // hard granite
        "rivers": StreamPower(height: "base"), // cut
        "late": Thermal(version: 3, height: "rivers", talus: "rough.slope"),
        "scree": Thermal(version: 1, height: "late", talus: "rough.slope", passes: 9),
        "other": StreamPower(height: "base"),
        "end": Thermal(version: 3, height: "scree", talus: 30),
    },
    outputs: { "height": "end", "area": "rivers.area", "scree": "scree" },
    layout: { "rivers": (240, 80), "late": (480, 80) },
    notes: { "late": "A guess." },
)
"#;

/// What an output is made of, whatever its nodes are called.
fn made(graph: &Graph, port: Port) -> String {
    let instance = graph.instance(port.node);
    let inputs = (0..instance.node.inputs.len())
        .map(|input| graph.source(port.node, input).map_or_else(String::new, |source| made(graph, source)));
    let inputs: Vec<String> = inputs.collect();
    format!("{}.{} {:?} {:?} {inputs:?}", instance.node.id, port.output, instance.params, instance.constants)
}

/// What all outputs of the file are made of.
fn results(document: &Document) -> Vec<(String, String)> {
    let expanded = document.expand();
    expanded.outputs.iter().map(|output| (output.name.clone(), made(&expanded.graph, output.port))).collect()
}

fn outer(text: &str) -> (TempDir, Document) {
    let folder = tempfile::tempdir().expect("a folder");
    let document = Document::parse_at(text, folder.path().join("outer.ron"), &registry());
    (folder, document)
}

fn part(nodes: &[&str]) -> Extract {
    Extract {
        nodes: nodes.iter().map(|name| (*name).to_owned()).collect(),
        file: "part.ron".to_owned(),
        name: "part".to_owned(),
        at: Some([240.0, 80.0]),
        places: BTreeMap::from([("rivers".to_owned(), [240.0, 80.0]), ("late".to_owned(), [480.0, 80.0])]),
    }
}

/// Replaces nodes by a `Subgraph`; returns the text of its file.
#[track_caller]
fn extracted(document: &mut Document, nodes: &[&str]) -> String {
    let made = document.extract(&part(nodes)).expect("nodes without a way back");
    let path = made.file.path().expect("a path").to_owned();
    made.file.save(path).expect("written");
    document.apply(&made.edit).expect("an edit that fits the document");
    made.file.source().to_owned()
}

#[test]
fn a_selection_becomes_a_file_with_the_wires_that_cross_its_border() {
    let (_folder, mut document) = outer(OUTER);
    assert_eq!(document.problems(), []);
    let before = results(&document);
    let file = extracted(&mut document, &["rivers", "late", "scree"]);
    let expected = r#"(
    format: 1,
    world: (size: 4000, cells: 64, seed: 3),
    inputs: { "land": "rivers.height", "talus": ["late.talus", "scree.talus"] },
    parameters: { "age": "rivers.duration" },
    outputs: { "area": "rivers.area", "height": "scree" },
    nodes: {
        // hard granite
        "rivers": StreamPower(), // cut
        "late":   Thermal(version: 3, height: "rivers"),
        "scree":  Thermal(version: 3, height: "late", passes: 9),
    },
    layout: { "rivers": (240, 80), "late": (480, 80) },
    notes: { "late": "A guess." },
)
"#;
    assert_eq!(file, expected);
    assert_eq!(document.problems(), []);
    let source = document.source();
    for line in [
        r#""part": Subgraph(file: "part.ron", land: "base", talus: "rough.slope"),"#,
        r#"inputs: { "land": ["part.land", "other.height"] },"#,
        r#"parameters: { "age": (drives: ["part.age", "other.duration"], doc: "Years.") },"#,
        r#""end": Thermal(version: 3, height: "part.height", talus: 30),"#,
        r#"outputs: { "height": "end", "area": "part", "scree": "part.height" },"#,
    ] {
        assert!(source.contains(line), "{line}\n{source}");
    }
    assert_eq!(results(&document), before);
    assert_eq!(document.steps(), 1);
    document.apply(&Edit::SetNamed { name: "age".to_owned(), text: "2 Myr".to_owned() }).expect("it is still exposed");
    assert_ne!(results(&document), before);
    while document.undo() {}
    assert_eq!(document.source(), OUTER);
}

#[test]
fn the_nodes_of_a_file_replace_it_again() {
    let (_folder, mut document) = outer(OUTER);
    let before = results(&document);
    extracted(&mut document, &["rivers", "late", "scree"]);
    let text = document.source().to_owned();
    // A name that is in use by now.
    let added = Edit::AddNode { name: "late".to_owned(), kind: "Ridged".to_owned(), at: None };
    document.apply(&added).expect("added");
    let places = BTreeMap::from([("rivers".to_owned(), [10.0, 20.0])]);
    let Inlined { edit, names } = document.inline("part", &places).expect("it can be");
    document.apply(&edit).expect("it fits");
    assert_eq!(names, ["late2", "rivers", "scree"]);
    assert_eq!(document.problems(), [], "{}", document.source());
    assert_eq!(results(&document), before);
    assert!(document.source().contains(r#""age": (drives: ["rivers.duration", "other.duration"]"#));
    assert!(document.source().contains(r#""rivers": (10, 20)"#), "{}", document.source());
    let late = document.node("late2").expect("it is there");
    assert_eq!(late.note, "A guess.");
    assert!(document.undo() && document.undo());
    assert_eq!(document.source(), text);
}

#[test]
fn comments_and_frames_of_the_file_stay_in_it() {
    let (folder, mut document) = outer(OUTER);
    extracted(&mut document, &["rivers", "late", "scree"]);
    let path = folder.path().join("part.ron");
    let file = std::fs::read_to_string(&path).expect("written");
    let nodes = "    nodes: {\n";
    assert!(file.contains(nodes), "{file}");
    let frames = "    frames: { \"Valley\": (at: (0, 0), size: (600, 300), note: \"Steep.\") },\n";
    let file =
        file.replace(nodes, &format!("    // how the valley forms\n{frames}{nodes}        // first the rivers\n"));
    std::fs::write(&path, &file).expect("written");
    let mut document = Document::parse_at(document.source(), folder.path().join("outer.ron"), &registry());
    assert_eq!(document.problems(), []);
    let frames = document.frames().len();
    let Inlined { edit, .. } = document.inline("part", &BTreeMap::new()).expect("it can be");
    document.apply(&edit).expect("it fits");
    assert_eq!(document.problems(), [], "{}", document.source());
    assert_eq!(document.frames().len(), frames);
    for left in ["how the valley forms", "first the rivers", "Valley", "Steep."] {
        assert!(!document.source().contains(left), "{left}: {}", document.source());
    }
    assert_eq!(std::fs::read_to_string(&path).expect("it is still there"), file);
}

#[test]
fn every_selection_without_a_way_back_keeps_the_results() {
    let names = ["base", "rough", "rivers", "late", "scree", "other", "end"];
    let mut made = 0;
    for chosen in 1..1_u32 << names.len() {
        let (_folder, mut document) = outer(OUTER);
        let before = results(&document);
        let nodes: Vec<&str> = (0..names.len()).filter(|at| chosen >> at & 1 == 1).map(|at| names[at]).collect();
        match document.extract(&part(&nodes)) {
            Ok(_) => {
                extracted(&mut document, &nodes);
                assert_eq!(results(&document), before, "{nodes:?}\n{}", document.source());
                let inlined = document.inline("part", &BTreeMap::new()).expect("it can be inlined");
                document.apply(&inlined.edit).expect("an edit that fits the document");
                assert_eq!(results(&document), before, "{nodes:?}\n{}", document.source());
                made += 1;
            }
            Err(error) => {
                let back = error.to_string().contains("comes back");
                assert!(back, "{nodes:?}: {error}");
            }
        }
    }
    assert!(made > 50, "{made}");
}

#[test]
fn a_use_with_its_own_values_is_replaced_by_nodes_with_these_values() {
    let (folder, _) = outer(OUTER);
    let inner = r#"(
        inputs: { "land": "rivers.height", "wall": "late.talus" },
        parameters: { "age": ["rivers.duration", "more.duration"], "talus": "scree.talus" },
        nodes: {
            "base": Ridged(octaves: 3, seed: 5, file: "map.png"),
            "rivers": StreamPower(height: "base"),
            "more": StreamPower(height: "rivers"),
            "late": Thermal(version: 3, height: "more", talus: 45),
            "scree": Thermal(version: 3, height: "late", talus: 31),
        },
        muted: ["more"],
        outputs: { "height": "scree", "base": "base" },
    )"#;
    std::fs::create_dir(folder.path().join("lib")).expect("made");
    std::fs::write(folder.path().join("lib/inner.ron"), inner).expect("written");
    std::fs::write(folder.path().join("lib/map.png"), "").expect("written");
    let text = r#"(
        parameters: { "age": "b.age" },
        nodes: {
            "a": Ridged,
            "b": Subgraph(file: "lib/inner.ron", land: "a", wall: 50, age: "2 Myr", talus: 40, seed: 9),
            "c": Thermal(version: 3, height: "b"),
        },
        outputs: { "c": "c", "base": "b.base" },
    )"#;
    let mut document = Document::parse_at(text, folder.path().join("outer.ron"), &registry());
    assert_eq!(document.problems(), []);
    let before = results(&document);
    let inlined = document.inline("b", &BTreeMap::new()).expect("it can be");
    document.apply(&inlined.edit).expect("it fits");
    assert_eq!(document.problems(), [], "{}", document.source());
    assert_eq!(results(&document), before, "{}", document.source());
    assert!(document.source().contains(r#"file: "lib/map.png""#), "{}", document.source());
    assert!(document.source().contains(r#"{ "age": ["rivers.duration", "more.duration"] }"#), "{}", document.source());
    assert!(document.undo());
    assert_eq!(document.source(), text);
}

#[test]
fn the_sea_level_of_an_older_node_stays_with_the_graph() {
    let (_folder, mut document) =
        outer(r#"(nodes: { "a": Ridged, "c": Coast(height: "a", water: 12) }, outputs: { "o": "c" })"#);
    assert_eq!(document.world().sea_level, Some(12.0));
    let before = results(&document);
    let file = extracted(&mut document, &["c"]);
    assert!(file.contains("sea_level: 12"), "{file}");
    assert_eq!((results(&document), document.world().sea_level), (before, Some(12.0)), "{}", document.source());
}

#[test]
fn the_sea_level_of_an_older_node_in_the_file_comes_back_with_it() {
    let (folder, mut document) = outer(r#"(nodes: { "a": Ridged, "c": Coast(height: "a") }, outputs: { "o": "c" })"#);
    let file = extracted(&mut document, &["c"]);
    let older = file.replacen("Coast(version: 3)", "Coast(water: 12)", 1);
    assert!(older.contains("Coast(water: 12),"), "{older}");
    std::fs::write(folder.path().join("part.ron"), older).expect("written");
    let mut document = Document::parse_at(document.source().to_owned(), folder.path().join("outer.ron"), &registry());
    assert_eq!((document.problems(), document.world().sea_level), (&[][..], Some(12.0)));
    let before = results(&document);
    let inlined = document.inline("part", &BTreeMap::new()).expect("it can be inlined");
    document.apply(&inlined.edit).expect("an edit that fits the document");
    assert_eq!((results(&document), document.world().sea_level), (before, Some(12.0)), "{}", document.source());
}

#[test]
fn what_cannot_be_moved_is_refused_with_the_reason() {
    let refusal = |document: &Document, nodes: &[&str]| {
        document.extract(&part(nodes)).expect_err("it cannot be moved").to_string()
    };
    let (_folder, document) = outer(OUTER);
    assert_eq!(refusal(&document, &[]), "no node is selected");
    assert_eq!(
        refusal(&document, &["base", "scree"]),
        "a wire leaves the selection and comes back: `scree` reads `late`; select the nodes between them too"
    );
    let unsaved = Document::parse(OUTER, &registry());
    assert_eq!(refusal(&unsaved, &["late"]), "save the graph first: the new file goes into its folder");
    let (_folder, open) = outer(r#"(nodes: { "a": Thermal(version: 3), "b": Nothing }, outputs: { "o": "a" })"#);
    let said = refusal(&open, &["a"]);
    assert!(said.starts_with("the new file would have a problem: "), "{said}");
    assert!(refusal(&open, &["b"]).contains("does not know"));
    for (name, said) in [("late", "is not a `Subgraph`"), ("nobody", "there is no node `nobody`")] {
        let error = document.inline(name, &BTreeMap::new()).expect_err("it cannot be").to_string();
        assert!(error.contains(said), "{error}");
    }
    let (_folder, mut document) = outer(OUTER);
    extracted(&mut document, &["late"]);
    document.apply(&Edit::SetMuted { node: "part".to_owned(), muted: true }).expect("muted");
    let error = document.inline("part", &BTreeMap::new()).expect_err("it is muted").to_string();
    assert_eq!(error, "`part` is muted; unmute it first");
    let names = BTreeSet::from(["rivers".to_owned()]);
    assert!(document.excerpt(&names, &BTreeMap::new()).expect("sound").contains("// hard granite"));
}
