//! Tests of the variations: other seeds as a grid of pictures.

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use orograph_graph::ParamValue;

use crate::{look, scratch, settle, window};

#[test]
fn a_seed_is_kept_by_a_click() {
    crate::draws();
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
    look(&mut window, "variations");
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

#[test]
fn two_values_are_kept_by_a_click() {
    crate::draws();
    let text = r#"(world: (size: "4 km", cells: 64, seed: 7), nodes: {
            "a": Perlin(wavelength: 900, amplitude: 300), "b": Terrace(version: 2, height: "a", step: 60),
            "other": Ridged() }, outputs: { "h": "b" })"#;
    let folder = scratch(text);
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(64);
    window.state_mut().session_mut().select_only("a");
    window.state_mut().session_mut().pin(Some("b.height".to_owned()));
    settle(&mut window);
    window.key_press_modifiers(Modifiers::COMMAND, Key::R);
    window.run_steps(3);
    window.run_steps(8);
    window.get_by_label("Two parameters").click();
    window.run_steps(8);
    assert!(window.query_by_label_contains("other values of two parameters").is_some());
    // The numbers of the selected node come first, with the present values in the middle.
    let centre = "a.wavelength 900 m, a.octaves 12";
    assert!(window.query_by_label(centre).is_some());
    // Another parameter, upstream of the shown output only.
    window.get_by_label("Down").click();
    window.run_steps(3);
    assert!(window.query_by_label("other.wavelength").is_none());
    window.get_by_label("b.step").click();
    window.run_steps(3);
    assert!(window.query_by_label("a.wavelength 900 m, b.step 60 m").is_some());
    window.get_by_label("4 x 4").click();
    window.run_steps(3);
    // The ends of the range are typed with units and arithmetic.
    let from = window.get_by_label("Down from");
    from.focus();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.event(egui::Event::Text("0.1 km - 80".to_owned()));
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(3);
    for theme in [egui::Theme::Light, egui::Theme::Dark] {
        window.ctx.set_theme(theme);
        for _ in 0..60 {
            window.step();
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        look(&mut window, &format!("two_parameters_{theme:?}"));
    }
    window.get_by_label("a.wavelength 1.35 km, b.step 20 m").click();
    window.run_steps(3);
    let document = window.state().session().document();
    let value = |node: &str, param: &str| {
        let graph = document.graph();
        graph.instance(graph.find(node).expect("a node")).params.read::<f64>(param)
    };
    assert_eq!((value("a", "wavelength"), value("b", "step")), (1350.0, 20.0));
    assert_eq!(document.steps(), 1);
    assert!(window.query_by_label("Two parameters").is_none());
    window.state_mut().session_mut().undo();
    assert_eq!(window.state().session().document().source(), text);
}
