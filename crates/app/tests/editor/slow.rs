//! Tests of slow frames: no key press and no click is lost if one frame has several.

use egui::{Event, Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;
use orograph_graph::Edit;

use crate::{
    canvas::{ROW, document, ground, selection, window_on},
    hand::{at, title},
    settle,
};

/// Delivers events in one frame, then runs a few more.
fn at_once(window: &mut Harness<'_, App>, events: Vec<Event>) {
    window.input_mut().events.extend(events);
    window.run_steps(12);
}

fn press(key: Key, modifiers: Modifiers) -> Event {
    Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers }
}

fn button(pos: Pos2, pressed: bool) -> Event {
    Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Modifiers::NONE }
}

/// A click at a position, with the pointer elsewhere before and after it.
fn click(pos: Pos2) -> [Event; 4] {
    let away = Event::PointerMoved(pos + vec2(160.0, 60.0));
    [Event::PointerMoved(pos), button(pos, true), button(pos, false), away]
}

#[test]
fn thirty_undos_in_one_frame_are_thirty() {
    crate::draws();
    let (mut window, _folder) = window_on(ROW);
    for count in 0..40 {
        let at = Some([f64::from(count) * 12.0, 600.0]);
        let edit = Edit::AddNode { name: format!("hill{count}"), kind: "Constant".into(), at };
        assert!(window.state_mut().session_mut().apply(&edit));
    }
    window.run_steps(2);
    let hills = |window: &Harness<'_, App>| document(window).nodes().len() - 4;
    at_once(&mut window, (0..30).map(|_| press(Key::Z, Modifiers::COMMAND)).collect());
    assert_eq!(hills(&window), 10);
    // In their order: two more undos, then four redos of which the last two redo what was undone before.
    let (undo, redo) = (press(Key::Z, Modifiers::COMMAND), press(Key::Z, Modifiers::COMMAND.plus(Modifiers::SHIFT)));
    let keys = [&undo, &undo, &redo, &redo, &redo, &redo, &undo];
    at_once(&mut window, keys.into_iter().cloned().collect());
    assert_eq!(hills(&window), 11);
}

#[test]
fn clicks_and_keys_of_one_frame_act_in_their_order() {
    crate::draws();
    let (mut window, _folder) = window_on(ROW);
    settle(&mut window);
    let [map, contours] = ["Map", "Contours"].map(|label| at(&window, label));
    let toggled = |window: &Harness<'_, App>, label: &str| {
        use egui_kittest::kittest::NodeT as _;
        window.get_by_label(label).accesskit_node().toggled() == Some(egui::accesskit::Toggled::True)
    };
    // Two clicks on two buttons.
    let events = [click(map), click(contours)].concat();
    at_once(&mut window, events);
    assert!(toggled(&window, "Map") && toggled(&window, "Contours"));
    // A click on a node, and a key for it.
    let (place, empty) = (title(&window, "place"), ground(&window));
    let mut events = click(place).to_vec();
    events.extend([Event::PointerMoved(empty), press(Key::M, Modifiers::NONE)]);
    at_once(&mut window, events);
    assert_eq!(selection(&window), ["place"]);
    assert!(document(&window).nodes().iter().any(|node| node.name == "place" && node.muted));
    // A drag.
    let lonely = title(&window, "lonely");
    let by = |x: f32| lonely + vec2(x, -0.5 * x);
    let mut events = vec![Event::PointerMoved(lonely), button(lonely, true)];
    events.extend([20.0, 40.0, 60.0].map(|x| Event::PointerMoved(by(x))));
    events.extend([button(by(60.0), false), Event::PointerMoved(by(200.0))]);
    at_once(&mut window, events);
    let moved = title(&window, "lonely") - lonely;
    assert!((moved.x - 60.0).abs() < 14.0 && moved.y < -10.0, "{moved:?}");
}

#[test]
fn a_click_that_slow_frames_stretch_is_a_click() {
    crate::draws();
    let (mut window, _folder) = window_on(ROW);
    settle(&mut window);
    let map = at(&window, "Contours");
    window.hover_at(map);
    window.step();
    window.event(button(map, true));
    // Two seconds between the frames of the press and of the release.
    window.run_steps(120);
    window.event(button(map, false));
    window.run_steps(3);
    let contours = window.get_by_label("Contours");
    let on = egui_kittest::kittest::NodeT::accesskit_node(&contours).toggled();
    assert_eq!(on, Some(egui::accesskit::Toggled::True));
}
