//! Graph files made from a selection, and the `Subgraph` replaced by their nodes.

use egui::{Key, Modifiers};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;
use orograph_graph::{Cancel, Evaluation, Evaluator, EvaluatorOptions, Request, Value, Window};

use crate::{
    canvas::{document, selection, window_on},
    hand::{click, click_with, key, title},
    look, settle,
};

const HILLS: &str = "(
    format: 1,
    world: (size: \"8 km\", cells: 48, seed: 3),
    parameters: { \"depth\": \"steps.step\" },
    nodes: {
        \"ground\": Ridged(wavelength: \"5 km\"),
        \"where\":  Slope(height: \"ground\"),
        \"steps\":  Terrace(version: 2, height: \"ground\", step: 90),
        \"scree\":  Thermal(height: \"steps\", talus: \"where\"),
        \"last\":   Terrace(version: 2, height: \"scree\", step: 20),
    },
    outputs: { \"height\": \"last\", \"scree\": \"scree\", \"steps\": \"steps\" },
    layout: { \"ground\": (0, 0), \"where\": (0, 300), \"steps\": (240, 0), \"scree\": (480, 0), \"last\": (720, 0) },
)
";

/// All outputs of the document, computed again.
fn outputs(window: &Harness<'_, App>) -> Vec<(String, Value)> {
    let (document, expanded) = (document(window), document(window).expand());
    let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("it has threads");
    let whole = Window::whole(document.world());
    let requests: Vec<Request> =
        expanded.outputs.iter().map(|output| Request { port: output.port, window: whole }).collect();
    let evaluation =
        Evaluation { graph: &expanded.graph, folder: document.folder(), requests: &requests, byproducts: &[] };
    let values = evaluator.evaluate(&evaluation, &Cancel::default(), &|_| {});
    let values = values.into_iter().map(|value| value.expect("it can be built"));
    expanded.outputs.iter().map(|output| output.name.clone()).zip(values).collect()
}

/// Asserts that two sets of outputs are equal to the byte.
#[track_caller]
fn assert_same(before: &[(String, Value)], after: &[(String, Value)]) {
    assert_eq!(before.len(), after.len());
    for ((name, a), (other, b)) in before.iter().zip(after) {
        let bits = |value: &Value| -> Vec<u32> {
            value.as_field().expect("a field").samples().iter().map(|sample| sample.to_bits()).collect()
        };
        assert!(name == other && bits(a) == bits(b), "{name}");
    }
}

#[test]
fn a_selection_becomes_a_subgraph_and_back() {
    crate::draws();
    let (mut window, folder) = window_on(HILLS);
    assert!(!document(&window).has_errors(), "{:?}", document(&window).problems());
    let before = outputs(&window);
    let steps = title(&window, "steps");
    click(&mut window, steps);
    let scree = title(&window, "scree");
    click_with(&mut window, scree, Modifiers::COMMAND);
    key(&mut window, Modifiers::COMMAND, Key::G);
    assert!(window.query_by_label_contains("The 2 selected nodes move").is_some());
    // The name is proposed, and can be changed.
    assert_eq!(window.get_by_label("Name of the file").value().as_deref(), Some("scree"));
    look(&mut window, "subgraph_dialog");
    window.key_press(Key::Enter);
    window.run_steps(4);
    assert!(window.query_by_label_contains("selected nodes move").is_none());
    assert!(folder.path().join("scree.ron").is_file());
    assert_eq!(selection(&window), ["scree2"]);
    assert_eq!(document(&window).problems(), []);
    assert_eq!(document(&window).steps(), 1);
    assert_same(&before, &outputs(&window));
    settle(&mut window);
    look(&mut window, "subgraph");

    let text = document(&window).source().to_owned();
    key(&mut window, Modifiers::COMMAND | Modifiers::SHIFT, Key::G);
    assert_eq!(selection(&window), ["scree", "steps"]);
    assert_eq!(document(&window).problems(), []);
    assert_same(&before, &outputs(&window));
    settle(&mut window);
    look(&mut window, "inlined");
    key(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(document(&window).source(), text);
    key(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(document(&window).source(), HILLS);
}

#[test]
fn a_refused_subgraph_says_why() {
    crate::draws();
    let (mut window, folder) = window_on(HILLS);
    std::fs::write(folder.path().join("taken.ron"), "mine").expect("written");
    let ground = title(&window, "ground");
    click(&mut window, ground);
    let scree = title(&window, "scree");
    click_with(&mut window, scree, Modifiers::COMMAND);
    key(&mut window, Modifiers::COMMAND, Key::G);
    window.key_press(Key::Enter);
    window.run_steps(4);
    assert!(window.query_by_label_contains("a wire leaves the selection and comes back").is_some());
    assert!(!folder.path().join("scree.ron").exists());
    window.get_by_label("Cancel").click();
    window.run_steps(3);
    let steps = title(&window, "steps");
    click(&mut window, steps);
    key(&mut window, Modifiers::COMMAND, Key::G);
    for (typed, said) in [("taken", "`taken.ron` already exists"), ("../up", "is not the name of a file")] {
        key(&mut window, Modifiers::COMMAND, Key::A);
        crate::hand::type_text(&mut window, typed);
        window.get_by_label("Create").click();
        window.run_steps(4);
        assert!(window.query_by_label_contains(said).is_some(), "{typed}");
    }
    look(&mut window, "subgraph_refused");
    assert_eq!(std::fs::read_to_string(folder.path().join("taken.ron")).expect("it is still there"), "mine");
    assert_eq!(document(&window).source(), HILLS);
}
