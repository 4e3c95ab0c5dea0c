//! The cost of edits: number of parsed texts, and reuse of the built graph.

use super::*;
use crate::ParamValue;

/// A chain of `count` nodes, each reading the one before; `more` follows them.
fn chain(count: usize, more: &str) -> String {
    let node = |number: usize| match number.checked_sub(1) {
        None => "        \"n0\": Ridged(octaves: 3),\n".to_owned(),
        Some(before) => format!("        \"n{number}\": StreamPower(height: \"n{before}\", m: 0.4),\n"),
    };
    let nodes: String = (0..count).map(node).collect();
    format!("(\n    nodes: {{\n{nodes}    }},\n    outputs: {{ \"o\": \"n{}\" }},\n{more})\n", count - 1)
}

fn slider(node: &str, value: f64) -> Edit {
    Edit::SetParam { node: node.into(), param: "m".into(), value: ParamValue::Float(value) }
}

fn place(node: &str, at: [f64; 2]) -> Edit {
    Edit::SetLayout { node: node.into(), at: Some(at) }
}

/// A document's text, problems and number of undo steps.
fn said(document: &Document) -> (String, Vec<Diagnostic>, usize) {
    (document.source().to_owned(), document.problems().to_vec(), document.steps())
}

#[test]
fn an_event_of_a_drag_parses_the_text_once() {
    let mut document = parse(&chain(20, "    layout: { \"n3\": (0, 0) },\n"));
    assert_eq!(document.statistics().texts_parsed, 1);
    let before = document.source().to_owned();
    let drags: [fn(f64) -> Edit; 4] = [
        |at| slider("n9", 0.5 + at / 100.0),
        |at| Edit::SetText { node: "n0".into(), name: "amplitude".into(), text: format!("{at} km") },
        |at| place("n3", [at, 2.0]),
        |at| place("n4", [at, 2.0]),
    ];
    for drag in drags {
        document.apply(&drag(1.0)).expect("it is fine");
        for event in 2..10 {
            let parsed = document.statistics().texts_parsed;
            document.amend(&drag(f64::from(event))).expect("it is fine");
            assert_eq!(document.statistics().texts_parsed, parsed + 1);
        }
        assert_eq!(document.problems(), parse(document.source()).problems());
        assert!(document.undo());
        assert_eq!((document.source(), document.steps()), (before.as_str(), 0));
    }
}

#[test]
fn an_edit_that_replaces_the_last_one_is_the_same_as_undo_and_an_edit() {
    let mut document = parse(ALPS);
    let edits = [
        slider("rivers", 0.6),
        slider("rivers", 0.5),
        Edit::RemoveNode { name: "report".into() },
        Edit::Connect { from: "scree".into(), to: "rivers".into(), input: "height".into() },
        Edit::RenameNode { from: "base".into(), to: "ground".into() },
        place("base", [1.0, 2.0]),
    ];
    for prepare in [|_: &mut Document| (), |document: &mut Document| assert!(document.undo() && document.redo())] {
        for first in &edits {
            for second in &edits {
                if document.apply(first).is_err() || document.steps() == 0 {
                    continue;
                }
                prepare(&mut document);
                let (mut other, before) = (document.clone(), said(&document));
                assert!(other.undo());
                let expected = other.apply(second).map(|()| said(&other));
                let made = document.amend(second);
                assert_eq!(made.as_ref().err(), expected.as_ref().err(), "{first:?} {second:?}");
                assert_eq!(said(&document), expected.unwrap_or(before), "{first:?} {second:?}");
                while document.undo() {}
                assert_eq!(document.source(), ALPS);
            }
        }
    }
}

#[test]
fn edits_of_the_canvas_keep_the_built_graph() {
    let mut document = parse(ALPS);
    let (build, graph) = (document.build(), document.expand().graph);
    let frame = Frame { at: [0.0; 2], size: [200.0; 2], note: String::new(), colour: None };
    let canvas = [
        place("rivers", [1.0, 2.0]),
        Edit::SetNote { node: "base".into(), note: "rough".into() },
        Edit::SetReroutes { node: "rivers".into(), input: "height".into(), places: vec![[1.0, 1.0]] },
        Edit::SetFrame { name: "all".into(), frame: Some(frame) },
        Edit::SetText { node: "rivers".into(), name: "duration".into(), text: "2 Myr".into() },
    ];
    for edit in &canvas {
        document.apply(edit).expect("it is fine");
        assert_eq!(document.build(), build, "{edit:?}");
        assert!(Arc::ptr_eq(&document.expand().graph, &graph), "{edit:?}");
    }
    assert!(document.replace(&format!("// more\n{}", document.source())));
    assert!(document.undo() && document.build() == build);
    let output = &document.expand().outputs[0];
    assert_eq!(
        document.source()[output.span.clone()],
        *"\"height\": \"scree\"",
        "its place is that of the present text"
    );
    let built = [
        slider("rivers", 0.6),
        Edit::Connect { from: "base".into(), to: "scree".into(), input: "height".into() },
        Edit::SetMuted { node: "scree".into(), muted: true },
        Edit::RenameNode { from: "base".into(), to: "ground".into() },
        Edit::SetWorld(World { seed: 9, ..document.world() }),
        Edit::RenameOutput { from: "flow".into(), to: "area".into() },
        Edit::RemoveNode { name: "report".into() },
    ];
    let mut seen = vec![document.build()];
    for edit in &built {
        document.apply(edit).expect("it is fine");
        assert!(!seen.contains(&document.build()), "{edit:?}");
        seen.push(document.build());
    }
    document.look_again();
    assert!(!seen.contains(&document.build()), "files may say something else");
}

#[test]
fn positions_set_together_are_written_as_if_one_by_one() {
    let layouts = [
        "",
        "    layout: {},\n",
        "    layout: {\n    },\n",
        "    layout: { // none\n    },\n",
        "    layout: { \"n1\": (0, 0) },\n",
        "    layout: { \"n1\": (0, 0), },\n",
        "    layout: { \"n1\": (0, 0), /* two */ \"n2\": (5, 5) /* last */ },\n",
        "    layout: {\n        \"n1\": (0, 0), // one\n        \"n2\": (1, 1) // two\n    },\n",
        "    layout: {\n  \"n2\": (0, 0),\n  \"n0\": (1, 1),\n    },\n",
        "    layout: {\r\n  \"n2\": (0, 0),\r\n    },\r\n",
    ];
    let moves: Vec<Edit> =
        [("n0", 1.0), ("n3", 2.0), ("n1", 3.0), ("n3", 4.0), ("n2", 5.0)].map(|(node, x)| place(node, [x, -x])).into();
    for layout in layouts {
        let source = chain(4, layout);
        let (mut together, mut single) = (parse(&source), parse(&source));
        together.apply(&Edit::All(moves.clone())).unwrap_or_else(|error| panic!("{layout}: {error}"));
        moves.iter().for_each(|edit| single.apply(edit).expect("it is fine"));
        assert_eq!(together.source(), single.source(), "{layout}");
        assert!(together.statistics().texts_parsed <= 3, "{layout}");
        assert!(together.undo());
        assert_eq!(together.source(), source, "{layout}");
    }
    let mut document = parse(&chain(4, ""));
    let wrong = Edit::All(vec![place("n1", [0.0; 2]), place("m1", [0.0; 2])]);
    let error = document.apply(&wrong).expect_err("there is no such node").to_string();
    assert_eq!(error, "there is no node `m1`; did you mean `n1`?");
    assert_eq!(document.source(), chain(4, ""));
}

#[test]
fn ten_thousand_nodes_are_opened_and_edited() {
    const COUNT: usize = 10_000;
    let names = || (0..COUNT).map(|number| format!("n{number}"));
    let muted: Vec<String> = names().skip(1).map(|name| format!("\"{name}\"")).collect();
    let document = parse(&chain(COUNT, &format!("    muted: [{}],\n", muted.join(", "))));
    assert_eq!(document.problems(), []);
    assert_eq!(document.nodes().len(), COUNT);
    assert_eq!(document.expand().graph.indices().count(), 1, "the others pass on what the first gives");
    let middle = document.node("n5000").and_then(|node| node.index).expect("it is there");
    assert_eq!(document.passed_input(middle), Some(0));

    let mut document = parse(&chain(COUNT, ""));
    assert_eq!(document.problems(), []);
    let (source, output) = (document.source().to_owned(), document.outputs()[0].port);
    assert_eq!(document.expand().graph.output_type(output), PortType::Height);
    document.apply(&slider("n9999", 0.6)).expect("it is fine");
    document.amend(&slider("n0", 0.6)).expect_err("the first has no exponent");
    document.amend(&slider("n1", 0.6)).expect("it is fine");
    let cycle = Edit::Connect { from: "n9999".into(), to: "n1".into(), input: "height".into() };
    assert!(document.apply(&cycle).expect_err("a cycle").to_string().contains("cycle"));
    let parsed = document.statistics().texts_parsed;
    document.apply(&Edit::All(names().map(|name| place(&name, [1.0, 2.0])).collect())).expect("all are there");
    assert!(document.statistics().texts_parsed <= parsed + 3);
    assert!(document.nodes().iter().all(|node| node.layout == Some([1.0, 2.0])));
    assert!(document.undo() && document.undo() && !document.undo());
    assert_eq!(document.source(), source);
}
