//! Painting onto the land.

use egui::pos2;
use egui_kittest::kittest::Queryable as _;
use orograph_graph::{ParamValue, Stroke};

use crate::{graph, settle, viewport::drag, window};

#[test]
fn strokes_are_painted_onto_the_land_and_undone_one_by_one() {
    let mut window = window(Some(graph("hello.ron")));
    window.state_mut().session_mut().set_cells(128);
    settle(&mut window);
    let before = height(&window, "rivers.height");
    window.get_by_label("Map").click();
    window.get_by_label("Brush").click();
    window.run_steps(3);
    window.get_by_label("paint on top of what is shown").click();
    window.run_steps(3);
    let session = window.state().session();
    assert_eq!(session.selected(), Some("paint"));
    let outputs = session.document().outputs();
    assert_eq!(session.document().graph().port_name(outputs[0].port), "paint.height", "the file gives what is painted");

    settle(&mut window);
    for at in [pos2(440.0, 250.0), pos2(520.0, 250.0)] {
        drag(&mut window, at, at + egui::vec2(0.0, 40.0));
    }
    window.run_steps(2);
    let painted = strokes(&window);
    assert_eq!(painted.len(), 2);
    assert!(painted.iter().all(|stroke| stroke.points.len() > 1), "{painted:?}");
    settle(&mut window);
    let after = height(&window, "paint.height");
    let raised = before.iter().zip(&after).map(|(before, after)| after - before).fold(0.0, f32::max);
    assert!((45.0..=100.5).contains(&raised), "by 50 m a stroke, which may cross: {raised}");

    window.state_mut().session_mut().undo();
    assert_eq!(strokes(&window), painted[..1]);
    window.state_mut().session_mut().undo();
    assert_eq!(strokes(&window), []);
    window.state_mut().session_mut().undo();
    assert!(window.state().session().document().graph().find("paint").is_err());
}

fn height(window: &egui_kittest::Harness<'_, orograph::editor::App>, port: &str) -> Vec<f32> {
    let built = window.state().session().small(port).expect("it is built");
    built.value.as_field().expect("a field").samples().to_vec()
}

fn strokes(window: &egui_kittest::Harness<'_, orograph::editor::App>) -> Vec<Stroke> {
    let graph = window.state().session().document().graph();
    match graph.instance(graph.find("paint").expect("it is there")).params.get("strokes") {
        Some(ParamValue::Strokes(strokes)) => strokes.clone(),
        other => panic!("{other:?}"),
    }
}
