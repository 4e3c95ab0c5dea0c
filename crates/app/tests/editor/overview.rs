//! Tests of the overview of the graph: it appears when a part is out of view, and a click or a drag there moves the view.

use egui::{Key, Modifiers, PointerButton, Pos2, Rect, Vec2, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

use crate::{
    canvas::{document, ground, selection, window_on},
    hand::{button, click, drag, key, title, wheel},
};

/// Four nodes at the corners of a graph much larger than the pane.
const WIDE: &str = "(
    format: 1,
    world: (size: \"8 km\", cells: 64, seed: 3),
    nodes: {
        \"north_west\": Ridged(wavelength: \"5 km\"),
        \"north_east\": Terrace(height: \"north_west\"),
        \"south_west\": Slope(height: \"north_west\"),
        \"south_east\": Terrace(height: \"north_east\"),
    },
    outputs: { \"height\": \"north_east\" },
    layout: { \"north_west\": (0, 0), \"north_east\": (2400, 0), \"south_west\": (0, 1500), \"south_east\": (2400, 1500) },
)
";

fn opened() -> (Harness<'static, App>, tempfile::TempDir) {
    let (mut window, folder) = window_on(WIDE);
    let pane = window.get_by_label("graph").rect();
    window.hover_at(pane.center());
    window.step();
    (window, folder)
}

fn overview(window: &Harness<'_, App>) -> Option<Rect> {
    window.query_by_label("overview").map(|node| node.rect())
}

/// The part of the pane in which a node is drawn. Returns None when it is out of view.
fn node(window: &Harness<'_, App>, name: &str) -> Option<Rect> {
    let pane = window.get_by_label("graph").rect();
    let label = format!("node {name}:");
    let rect = window.query_by_label_contains(&label)?.rect();
    Some(rect.intersect(pane)).filter(Rect::is_positive)
}

/// A corner of the overview, 12 % from both sides.
fn corner(window: &Harness<'_, App>, share: [f32; 2]) -> Pos2 {
    overview(window).expect("it is there").lerp_inside(Vec2::from(share))
}

#[test]
fn it_is_shown_while_a_part_is_out_of_view() {
    let (mut window, _folder) = opened();
    let pane = window.get_by_label("graph").rect();
    let map = overview(&window).expect("a part is out of view");
    assert!(pane.contains_rect(map) && pane.right() - map.right() < 20.0 && pane.bottom() - map.bottom() < 20.0);
    // It goes when all is in view, and is switched off and on by its key.
    key(&mut window, Modifiers::NONE, Key::Home);
    assert_eq!(overview(&window), None);
    wheel(&mut window, 8.0);
    assert!(overview(&window).is_some());
    key(&mut window, Modifiers::NONE, Key::O);
    assert_eq!(overview(&window), None);
    key(&mut window, Modifiers::NONE, Key::O);
    assert!(overview(&window).is_some());
}

#[test]
fn a_click_in_it_moves_the_view() {
    let (mut window, _folder) = opened();
    let corners = [
        ("north_west", [0.1, 0.2]),
        ("south_east", [0.9, 0.8]),
        ("south_west", [0.1, 0.8]),
        ("north_east", [0.9, 0.2]),
    ];
    for (name, place) in corners {
        let at = corner(&window, place);
        click(&mut window, at);
        for (other, _) in corners {
            assert_eq!(node(&window, other).is_some(), other == name, "{other} after a click at {name}");
        }
    }
    assert_eq!(document(&window).source(), WIDE, "nothing in the file moves");
}

#[test]
fn a_drag_in_it_moves_the_view_and_nothing_below() {
    let (mut window, _folder) = opened();
    let from = corner(&window, [0.1, 0.2]);
    click(&mut window, from);
    let width = node(&window, "north_west").expect("in view").width();
    // The view follows the pointer while the button is pressed, so the graph moves the other way.
    window.hover_at(from);
    window.step();
    button(&mut window, from, PointerButton::Primary, true, Modifiers::NONE);
    let mut places = Vec::new();
    for step in 1..=4 {
        // A drag starts after some points.
        window.hover_at(from + vec2(8.0, 2.0) * step as f32);
        window.run_steps(2);
        places.push(window.get_by_label_contains("node north_west:").rect().min);
    }
    button(&mut window, from + vec2(32.0, 8.0), PointerButton::Primary, false, Modifiers::NONE);
    let moves = |pair: &[Pos2]| pair[1].x < pair[0].x - 10.0 && pair[1].y < pair[0].y;
    assert!(places[1..].windows(2).all(moves), "{places:?}");
    let to = corner(&window, [0.9, 0.8]);
    let from = corner(&window, [0.1, 0.2]);
    drag(&mut window, from, to);
    assert!(node(&window, "south_east").is_some() && node(&window, "north_west").is_none());
    assert_eq!(window.get_by_label_contains("node south_east:").rect().width(), width, "at the same zoom");
    assert_eq!(document(&window).source(), WIDE);
    assert_eq!(window.state().session().document().steps(), 0);
}

#[test]
fn a_node_below_it_is_not_clicked_or_moved() {
    let (mut window, _folder) = opened();
    let at = corner(&window, [0.1, 0.2]);
    click(&mut window, at);
    // Brings a node under the overview: pans with the middle button by the distance between the two.
    let map = overview(&window).expect("it is there");
    let from = ground(&window) - vec2(0.0, 60.0);
    let by = map.center() - title(&window, "north_west");
    let middle = PointerButton::Middle;
    window.hover_at(from);
    window.step();
    button(&mut window, from, middle, true, Modifiers::NONE);
    for step in 1..=4 {
        window.hover_at(from + by * step as f32 / 4.0);
        window.step();
    }
    button(&mut window, from + by, middle, false, Modifiers::NONE);
    window.run_steps(2);
    let map = overview(&window).expect("it is there");
    let below = node(&window, "north_west").expect("in view").intersect(map);
    assert!(below.width() > 20.0 && below.height() > 20.0, "the node is below: {below} {map}");
    let chosen = selection(&window);
    click(&mut window, below.center());
    assert_eq!(selection(&window), chosen, "a click there selects nothing");
    let (from, to) = (map.center(), map.center() + vec2(20.0, 10.0));
    drag(&mut window, from, to);
    assert_eq!((selection(&window), document(&window).source()), (chosen, WIDE), "a drag moves no node");
    assert_eq!(window.state().session().document().steps(), 0);
}

#[test]
fn a_new_node_is_not_below_it() {
    let (mut window, _folder) = opened();
    let at = corner(&window, [0.1, 0.2]);
    click(&mut window, at);
    // By keys with the pointer over the overview, and by the menu of the window, without a pointer over the graph.
    for name in ["perlin", "perlin2"] {
        window.hover_at(overview(&window).expect("it is there").center());
        window.run_steps(2);
        key(&mut window, Modifiers::NONE, Key::Tab);
        crate::hand::type_text(&mut window, "perlin");
        key(&mut window, Modifiers::NONE, Key::Enter);
        let map = overview(&window).expect("it is there");
        let new = node(&window, name).expect("it is in view");
        assert!(!new.intersects(map), "{name} at {new} below {map}");
    }
}

#[test]
fn copies_come_into_view_beside_the_overview() {
    let (mut window, _folder) = opened();
    let pane = window.get_by_label("graph").rect();
    for wanted in ["north_west", "south_east"] {
        // select a node, leave it out of view, and duplicate it with the pointer elsewhere
        let place = corner(&window, if wanted == "north_west" { [0.12, 0.12] } else { [0.88, 0.88] });
        click(&mut window, place);
        let card = title(&window, wanted);
        click(&mut window, card);
        let middle = corner(&window, [0.5, 0.5]);
        click(&mut window, middle);
        assert_eq!(node(&window, wanted), None);
        window.hover_at(pane.center());
        key(&mut window, Modifiers::COMMAND, Key::D);
        window.run_steps(3);
        let copy = selection(&window);
        assert_ne!(copy, [wanted]);
        let whole = window.get_by_label_contains(&format!("node {}:", copy[0])).rect();
        let map = overview(&window).expect("a part is out of view");
        assert!(pane.contains_rect(whole) && !whole.intersects(map), "{whole} in {pane}, {map}");
    }
}
