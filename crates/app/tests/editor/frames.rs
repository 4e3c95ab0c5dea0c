//! Tests of frames.

use egui::{Key, Modifiers, vec2};
use egui_kittest::kittest::Queryable as _;

use crate::{
    canvas::{ROW, document, place_of, window_on},
    hand::{click, click_with, drag, key, title, type_text},
    look, settle,
};

#[test]
fn a_frame_is_drawn_around_nodes_and_moves_with_them() {
    let (mut window, _folder) = window_on(ROW);
    let ground_node = title(&window, "ground");
    click(&mut window, ground_node);
    key(&mut window, Modifiers::NONE, Key::C);
    type_text(&mut window, "base");
    key(&mut window, Modifiers::NONE, Key::Enter);
    let frames = document(&window).frames();
    assert_eq!(frames.len(), 1);
    assert_eq!(frames[0].name, "base");
    let before = frames[0].frame.at;
    let pane = window.get_by_label("graph").rect();
    let head = title(&window, "ground") - vec2(0.0, 26.0);
    assert!(pane.contains(head));
    let steps = document(&window).steps();
    drag(&mut window, head, head + vec2(-40.0, 30.0));
    let after = document(&window).frames()[0].frame.at;
    assert!(after[0] < before[0] && after[1] > before[1], "{before:?} {after:?}");
    let place = place_of(&window, "ground").expect("it has a place");
    assert_eq!([place[0], place[1]], [after[0] - before[0], after[1] - before[1]], "the node moves with it");
    assert_eq!(document(&window).steps(), steps + 1);
    key(&mut window, Modifiers::NONE, Key::Delete);
    assert!(document(&window).frames().is_empty());
    assert_eq!(document(&window).nodes().len(), 4);
}

#[test]
fn an_empty_frame_cuts_no_node() {
    crate::draws();
    let (mut window, _folder) = window_on(ROW);
    settle(&mut window);
    // Over the corner of a node that is not selected.
    let over = window.get_by_label_contains("node lonely:").rect().left_top() - vec2(6.0, 6.0);
    window.hover_at(over);
    window.run_steps(3);
    key(&mut window, Modifiers::NONE, Key::C);
    type_text(&mut window, "free");
    key(&mut window, Modifiers::NONE, Key::Enter);
    let frame = &document(&window).frames()[0];
    assert_eq!(frame.name, "free");
    let [at, size] = [frame.frame.at, frame.frame.size].map(|[x, y]| vec2(x as f32, y as f32));
    let rect = egui::Rect::from_min_size(at.to_pos2(), size);
    for node in ["ground", "steps", "lonely", "place"] {
        let [x, y] = place_of(&window, node).expect("it has a place");
        let card = egui::Rect::from_min_size(egui::pos2(x as f32, y as f32), vec2(180.0, 200.0));
        assert!(!rect.intersects(card), "{node} {card} {rect}");
    }
    look(&mut window, "frame_free");
    // A frame around selected nodes also encloses the nodes between them.
    let ground_node = title(&window, "ground");
    click(&mut window, ground_node);
    let lonely = title(&window, "lonely");
    click_with(&mut window, lonely, Modifiers::COMMAND);
    key(&mut window, Modifiers::NONE, Key::C);
    type_text(&mut window, "round");
    key(&mut window, Modifiers::NONE, Key::Enter);
    let frame =
        document(&window).frames().iter().find(|frame| frame.name == "round").expect("a second frame").frame.clone();
    for node in ["ground", "lonely", "place"] {
        let [x, y] = place_of(&window, node).expect("it has a place");
        let within =
            |axis: usize, low: f64, long: f64| frame.at[axis] <= low && low + long <= frame.at[axis] + frame.size[axis];
        assert!(within(0, x, 180.0) && within(1, y, 100.0), "{node} is cut by {frame:?}");
    }
    look(&mut window, "frame_round");
}
