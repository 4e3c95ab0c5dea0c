//! Tests of the variations: other seeds as a grid of pictures.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use orograph_graph::ParamValue;

use crate::{picture, scratch, settle, window};

#[test]
fn a_seed_is_kept_by_a_click() {
    let folder = scratch(
        r#"(world: (size: "4 km", cells: 64, seed: 7), nodes: {
            "a": Perlin(wavelength: 900, amplitude: 300), "b": Terrace(height: "a") }, outputs: { "h": "b" })"#,
    );
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(64);
    settle(&mut window);
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    window.run_steps(3);
    assert!(window.query_by_label_contains("other seeds of the world").is_some());
    for _ in 0..60 {
        window.step();
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    picture(&mut window, "variations");
    window.get_by_label("seed 9").click();
    window.run_steps(3);
    assert_eq!(window.state().session().document().world().seed, 9);
    assert_eq!(window.state().session().document().steps(), 1);

    // the seed of the selected node
    window.state_mut().session_mut().select_only("a");
    window.run_steps(3);
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    window.run_steps(3);
    assert!(window.query_by_label_contains("other seeds of a.seed").is_some());
    window.get_by_label("More").click();
    window.run_steps(3);
    window.get_by_label("seed 12").click();
    window.run_steps(3);
    let graph = window.state().session().document().graph();
    let seed = graph.instance(graph.find("a").expect("a node")).params.get("seed").cloned();
    assert_eq!(seed, Some(ParamValue::Seed(12)));
}
