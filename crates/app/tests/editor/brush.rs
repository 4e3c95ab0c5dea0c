//! Tests of the brush.

use egui::{Key, Modifiers, pos2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;
use orograph_graph::{ParamValue, Stroke};

use crate::{
    built, device,
    hand::{drag, key, title, type_text},
    look, picture, settle,
};

#[test]
fn strokes_are_painted_and_undone_one_by_one() {
    crate::draws();
    let mut window = built("hello.ron", 128);
    let before = height(&window, "rivers.height");
    window.get_by_label("Map").click();
    window.get_by_label("Brush").click();
    window.run_steps(3);
    window.get_by_label("Add a Paint node here").click();
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
    assert!((90.0..=200.5).contains(&raised), "by 100 m a stroke, which may cross: {raised}");
    look(&mut window, "painted");

    window.state_mut().session_mut().undo();
    assert_eq!(strokes(&window), painted[..1]);
    window.state_mut().session_mut().undo();
    assert_eq!(strokes(&window), []);
    window.state_mut().session_mut().undo();
    assert!(window.state().session().document().graph().find("paint").is_err());
}

#[test]
fn a_stroke_within_one_slow_frame_is_painted_and_its_mask_shown() {
    crate::draws();
    let mut window = built("hello.ron", 128);
    window.get_by_label("Map").click();
    window.get_by_label("Brush").click();
    window.run_steps(3);
    window.get_by_label("Add a Paint node here").click();
    window.run_steps(3);
    settle(&mut window);
    window.get_by_label("Mask").click();
    window.run_steps(3);
    assert_eq!(window.state().session().pinned(), Some("paint.mask"));
    settle(&mut window);
    let button = |pos, pressed| egui::Event::PointerButton {
        pos,
        button: egui::PointerButton::Primary,
        pressed,
        modifiers: egui::Modifiers::default(),
    };
    window.event(egui::Event::PointerMoved(pos2(440.0, 250.0)));
    window.step();
    let moved = [450.0, 480.0, 520.0, 560.0].map(|x| egui::Event::PointerMoved(pos2(x, 250.0)));
    let events = &mut window.input_mut().events;
    events.push(button(pos2(440.0, 250.0), true));
    events.extend(moved);
    window.step();
    let moved = [550.0, 552.0].map(|x| egui::Event::PointerMoved(pos2(x, 290.0)));
    let events = &mut window.input_mut().events;
    events.extend(moved);
    events.push(button(pos2(553.0, 300.0), false));
    window.step();
    window.run_steps(2);
    let painted = strokes(&window);
    assert_eq!(painted.len(), 1);
    let points = &painted[0].points;
    assert!(points.len() >= 6, "{points:?}");
    let [first, last] = [points[0], points[points.len() - 1]];
    // the drag of 113 by 50 points, in metres, including the end where the button was released
    let ratio = (last[0] - first[0]) / (last[1] - first[1]);
    assert!((ratio - 113.0 / 50.0).abs() < 0.02, "{points:?}");
    // in red, on the hillshade of the terrain
    settle(&mut window);
    if let Some(picture) = picture(&mut window, "mask on the map") {
        let greys = picture.pixels().filter(|pixel| pixel[0] == pixel[1] && pixel[1] == pixel[2] && pixel[0] > 60);
        let shades: std::collections::BTreeSet<u8> = greys.map(|pixel| pixel[0]).collect();
        let red = picture.pixels().filter(|pixel| pixel[0].saturating_sub(pixel[1]) > 60).count();
        assert!(shades.len() > 40 && red > 1000, "{} shades, {red} red pixels", shades.len());
    }
    window.get_by_label("Raise").click();
    window.run_steps(3);
    assert_eq!(window.state().session().pinned(), None, "heights are painted on the land again");
    window.get_by_label("Mask").click();
    window.run_steps(3);
    assert_eq!(window.state().session().pinned(), Some("paint.mask"));
    window.get_by_label("Brush").click();
    window.run_steps(3);
    assert_eq!(window.state().session().pinned(), None, "the mask is hidden with the brush");
}

/// The recipe of the manual.
#[test]
fn a_lake_is_painted() {
    crate::draws();
    let mut window = built("hello.ron", 128);
    window.get_by_label("Map").click();
    for name in ["Brush", "Add a Paint node here", "Lower"] {
        window.get_by_label(name).click();
        window.run_steps(3);
    }
    settle(&mut window);
    drag(&mut window, pos2(440.0, 250.0), pos2(500.0, 280.0));
    assert_eq!(strokes(&window).len(), 1);
    let empty = title(&window, "paint") + egui::vec2(120.0, 150.0);
    window.hover_at(empty);
    window.run_steps(2);
    key(&mut window, Modifiers::NONE, Key::Tab);
    type_text(&mut window, "lake");
    key(&mut window, Modifiers::NONE, Key::Enter);
    assert_eq!(window.state().session().shown().as_deref(), Some("lakes.level"));
    settle(&mut window);
    let deepened = height(&window, "lakes.level").into_iter().zip(height(&window, "paint.height")).map(|(a, b)| a - b);
    let deepest = deepened.fold(0.0, f32::max);
    assert!(deepest > 20.0, "the hollow holds water: {deepest} m");
    if device::missing().is_none() {
        window.get_by_label("3D").click();
        look(&mut window, "painted_lake");
    }
}

#[test]
fn a_mask_over_the_terrain_is_hidden_with_the_brush() {
    crate::draws();
    if device::skips("a mask over the terrain") {
        return;
    }
    let mut window = built("hello.ron", 64);
    window.get_by_label("Brush").click();
    window.run_steps(3);
    window.get_by_label("Add a Paint node here").click();
    window.run_steps(3);
    settle(&mut window);
    let is_over = |window: &mut Harness<'_, App>, colours: &str| {
        window.get_by_label("Look").click();
        window.run_steps(3);
        let is_over = window.query_by_label(&format!("Colours: {colours}")).is_some();
        window.key_press(Key::Escape);
        window.run_steps(3);
        is_over
    };
    let usual = "by slope and height";
    for ends in ["Raise", "Brush"] {
        assert!(is_over(&mut window, usual));
        window.get_by_label("Mask").click();
        window.run_steps(3);
        assert!(is_over(&mut window, "paint.mask"));
        window.get_by_label(ends).click();
        window.run_steps(3);
        assert!(is_over(&mut window, usual), "{ends}");
    }
}

fn height(window: &Harness<'_, App>, port: &str) -> Vec<f32> {
    let built = window.state().session().small(port).expect("it is built");
    built.value.as_field().expect("a field").samples().to_vec()
}

fn strokes(window: &Harness<'_, App>) -> Vec<Stroke> {
    let graph = window.state().session().document().graph();
    match graph.instance(graph.find("paint").expect("it is there")).params.get("strokes") {
        Some(ParamValue::Strokes(strokes)) => strokes.clone(),
        other => panic!("{other:?}"),
    }
}
