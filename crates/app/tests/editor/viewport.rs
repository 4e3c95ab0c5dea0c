//! Tests of the viewport.

use egui::{Event, Key, Modifiers, PointerButton, ViewportId, pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;
use orograph_graph::Edit;

use crate::{
    built,
    canvas::{ROW, ground, window_on},
    graph,
    hand::{at, button, click, click_with, drag, drag_with, key, pull, title, wheel},
    look, picture, settle, until, window,
};

fn hello() -> Harness<'static, App> {
    let mut window = built("hello.ron", 128);
    seen(&mut window);
    window
}

/// Waits until the newest result is drawn; it is prepared for drawing on another thread.
fn seen(window: &mut Harness<'_, App>) {
    until(window, "the terrain is drawn", |window| {
        let app = window.state();
        app.seen().is_some_and(|(revision, _)| revision == app.session().revision())
    });
}

/// The number of colours along a line through the middle of the viewport.
fn colours(picture: &image::RgbaImage) -> usize {
    let line = (0..60).map(|k| picture.get_pixel(250 + 8 * k, 160 + 3 * k).0);
    line.collect::<std::collections::BTreeSet<[u8; 4]>>().len()
}

#[test]
fn the_shown_output_is_seen_in_3d_and_as_a_map() {
    crate::draws();
    let mut window = hello();
    let Some(land) = picture(&mut window, "land") else { return };
    window.get_by_label("Map").click();
    window.step();
    let Some(map) = picture(&mut window, "map") else { return };
    for (name, picture) in [("3D", &land), ("map", &map)] {
        assert!(colours(picture) > 20, "{name}: {} colours", colours(picture));
    }
    assert!(land != map);
}

/// Moves a window to a display of this scale, where it keeps its size in points.
fn onto(window: &mut Harness<'_, App>, scale: f32) {
    let root = window.input_mut().viewports.entry(ViewportId::ROOT).or_default();
    root.native_pixels_per_point = Some(scale);
    window.run_steps(4);
}

/// The viewport in a picture of this scale.
fn of_the_viewport(picture: &image::RgbaImage, scale: u32) -> image::RgbaImage {
    let [x, y, width, height] = [20, 110, 500, 132].map(|points| points * scale);
    image::imageops::crop_imm(picture, x, y, width, height).to_image()
}

/// Dragged to a display with another scale, a window of the same size in points is drawn as if it had opened there.
#[test]
fn a_window_may_move_to_a_display_of_another_scale() {
    crate::draws();
    for view in ["3D", "Map"] {
        let opened = |scale: f32| {
            let mut window = hello();
            window.set_size(vec2(720.0, 450.0));
            onto(&mut window, scale);
            window.get_by_label(view).click();
            window.run_steps(4);
            window
        };
        let [mut moved, mut there] = [1.0, 2.0].map(opened);
        // the pictures contain what the pointer reads
        moved.event(Event::PointerMoved(pos2(300.0, 160.0)));
        there.event(Event::PointerMoved(pos2(300.0, 160.0)));
        let Some(before) = picture(&mut moved, &format!("display_before_{view}")) else { return };
        onto(&mut moved, 2.0);
        let after = picture(&mut moved, &format!("display_after_{view}")).expect("there was one");
        let fresh = picture(&mut there, &format!("display_fresh_{view}")).expect("there was one");
        assert_eq!([after.width(), after.height()], [2 * before.width(), 2 * before.height()], "{view}");
        let [after, fresh] = [after, fresh].map(|picture| of_the_viewport(&picture, 2));
        assert!(after == fresh, "{view}: it differs from a window that opened there");
        onto(&mut moved, 1.0);
        let Some(back) = picture(&mut moved, &format!("display_back_{view}")) else { return };
        let [before, back] = [before, back].map(|picture| of_the_viewport(&picture, 1));
        assert!(before == back, "{view}: it differs after it moved back");
    }
}

#[test]
fn the_land_turns_with_the_hand_and_comes_nearer_with_the_wheel() {
    crate::draws();
    let mut window = hello();
    let Some(before) = picture(&mut window, "before") else { return };
    drag(&mut window, pos2(400.0, 250.0), pos2(520.0, 250.0));
    let Some(turned) = picture(&mut window, "turned") else { return };
    assert!(before != turned);
    wheel(&mut window, 4.0);
    let Some(near) = picture(&mut window, "near") else { return };
    assert!(turned != near);
    drag_with(&mut window, pos2(400.0, 250.0), pos2(460.0, 280.0), Modifiers::SHIFT);
    let Some(panned) = picture(&mut window, "panned") else { return };
    assert!(near != panned);
    window.get_by_label("Fit view").click();
    window.step();
    window.event(Event::PointerGone);
    window.step();
    assert!(picture(&mut window, "whole").is_some_and(|whole| whole == before));
}

/// Keys of the camera change the picture, in 3D and on the map, and so do their opposites.
#[test]
fn the_camera_and_the_divider_are_moved_by_keys() {
    crate::draws();
    let mut window = hello();
    for view in [Key::Num3, Key::Num2] {
        window.hover_at(pos2(400.0, 250.0));
        key(&mut window, Modifiers::NONE, view);
        window.step();
        for (modifiers, there, back) in [
            (Modifiers::NONE, Key::ArrowLeft, Key::ArrowRight),
            (Modifiers::NONE, Key::ArrowUp, Key::ArrowDown),
            (Modifiers::SHIFT, Key::ArrowUp, Key::ArrowDown),
            (Modifiers::NONE, Key::Plus, Key::Minus),
        ] {
            let Some(before) = picture(&mut window, "before") else { return };
            key(&mut window, modifiers, there);
            window.step();
            let Some(moved) = picture(&mut window, "moved") else { return };
            assert!(before != moved, "{view:?} {there:?}");
            key(&mut window, modifiers, back);
            window.step();
            let Some(after) = picture(&mut window, "after") else { return };
            assert!(after != moved, "{view:?} {back:?}");
        }
        window.get_by_label("A|B").click();
        settle(&mut window);
        window.hover_at(pos2(400.0, 250.0));
        let Some(before) = picture(&mut window, "divided") else { return };
        key(&mut window, Modifiers::NONE, Key::OpenBracket);
        window.step();
        let Some(moved) = picture(&mut window, "moved") else { return };
        assert!(before != moved, "{view:?}: the divider stays");
        window.get_by_label("A|B").click();
        settle(&mut window);
    }
}

#[test]
fn an_output_can_be_pinned_and_compared() {
    crate::draws();
    let mut window = hello();
    window.state_mut().session_mut().select_only("ground");
    assert_eq!(window.state().session().shown().as_deref(), Some("ground.height"));
    window.step();
    window.get_by_label("Pin").click();
    window.step();
    window.step();
    assert_eq!(window.state().session().pinned(), Some("ground.height"));
    window.state_mut().session_mut().select_only("rivers");
    assert_eq!(window.state().session().shown().as_deref(), Some("ground.height"));
    window.get_by_label("A|B").click();
    window.step();
    window.step();
    let compared = window.state().session().compared().map(str::to_owned);
    assert!(compared.is_some_and(|port| port != "ground.height"));
    settle(&mut window);
    look(&mut window, "compare");
}

#[test]
fn a_node_is_compared_with_its_input() {
    let mut window = hello();
    for (node, input) in [("rivers", "ground.height"), ("ground", "rivers.height")] {
        window.state_mut().session_mut().select_only(node);
        window.step();
        window.get_by_label("A|B").click();
        window.run_steps(2);
        assert_eq!(window.state().session().compared(), Some(input), "{node}");
        window.get_by_label("A|B").click();
        window.run_steps(2);
        assert_eq!(window.state().session().compared(), None);
    }
}

#[test]
fn a_line_is_measured() {
    crate::draws();
    let mut window = hello();
    window.get_by_label("Measure").click();
    window.step();
    let is_open = |window: &Harness<'_, App>| window.query_by_label_contains("length").is_some();
    // the pane opens when the line is drawn, and not under the pointer
    let (from, to) = (pos2(380.0, 150.0), pos2(560.0, 300.0));
    pull(&mut window, [from, to], 6, |window| assert!(!is_open(window)));
    button(&mut window, to, PointerButton::Primary, false, Modifiers::NONE);
    window.step();
    assert!(is_open(&window));
    look(&mut window, "measure");
    // it stays open while another line is drawn
    drag(&mut window, pos2(380.0, 150.0), pos2(560.0, 300.0));
    window.step();
    assert!(is_open(&window));
}

#[test]
fn land_is_seen_while_it_grows() {
    crate::draws();
    let mut window = window(Some(graph("hello.ron")));
    // short steps, so that the coarsest level takes several times the interval of intermediate results
    let edit = Edit::SetText { node: "rivers".into(), name: "time_step".into(), text: "2 kyr".into() };
    window.state_mut().session_mut().apply(&edit);
    window.state_mut().session_mut().set_cells(384);
    let mut seen = std::collections::BTreeSet::new();
    let mut look = |window: &Harness<'_, App>| {
        let built = window.state().session().built("rivers.height");
        seen.extend(built.map(|built| (built.cells, built.step)));
    };
    while window.state().session().is_busy() {
        window.step();
        look(&window);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    window.step();
    look(&window);
    // at least one intermediate result of some level, even on a busy machine, and the final one
    assert!(seen.iter().any(|(_, step)| *step > 0) && seen.contains(&(384, 0)), "{seen:?}");
}

#[test]
fn fewer_cells_that_are_asked_for_while_land_grows_are_the_ones_shown() {
    crate::draws();
    let shown = |window: &Harness<'_, App>| {
        let built = window.state().session().built("rivers.height")?;
        Some((built.cells, built.step))
    };
    let mut window = window(Some(graph("hello.ron")));
    window.state_mut().session_mut().set_cells(384);
    until(&mut window, "the finer land is seen", |window| shown(window).is_some_and(|(cells, _)| cells == 384));
    window.state_mut().session_mut().set_cells(192);
    settle(&mut window);
    assert_eq!(shown(&window), Some((192, 0)));
}

#[test]
fn the_look_chooses_colours_and_water_with_the_mouse() {
    crate::draws();
    let mut window = hello();
    let choose = |window: &mut Harness<'_, App>, row: &str, item: &str| {
        if window.query_by_label("Reset look").is_none() {
            let look = at(window, "Look");
            click(window, look);
        }
        let list = window.query_all_by_label_contains(row).next().expect("a row of the menu").rect().center();
        click(window, list);
        // The list is right of the menu, which can have the same text elsewhere.
        let items = window.query_all_by_label(item).map(|node| node.rect());
        let item = items.max_by(|a, b| a.left().total_cmp(&b.left())).expect("a line of the list").center();
        click(window, item);
        assert!(window.query_by_label("Reset look").is_some(), "the menu stays open");
    };
    let Some(natural) = picture(&mut window, "look_natural") else { return };
    choose(&mut window, "by slope and height", "clay");
    choose(&mut window, "From the shown node", "none");
    look(&mut window, "look_menu");
    // A click elsewhere closes it.
    click(&mut window, pos2(400.0, 430.0));
    assert!(window.query_by_label("Reset look").is_none());
    let look = at(&window, "Look");
    click(&mut window, look);
    let count = |window: &Harness<'_, App>, text: &str| window.query_all_by_label_contains(text).count();
    let counts = ["clay", "From the shown node", "by slope and height"].map(|text| count(&window, text));
    assert_eq!(counts, [1, 0, 0], "the menu names the choices");
    click(&mut window, pos2(400.0, 430.0));
    let clay = picture(&mut window, "look_clay").expect("a device");
    let middle = |picture: &image::RgbaImage| picture.get_pixel(475, 280).0;
    let [r, g, b, _] = middle(&clay);
    assert!(middle(&natural) != middle(&clay) && r.abs_diff(g) < 24 && g.abs_diff(b) < 40, "{:?}", middle(&clay));
}

#[test]
fn an_empty_click_keeps_the_shown_output() {
    crate::draws();
    let text = ROW.replace("outputs: { \"height\": \"steps\" },\n", "");
    let (mut window, _folder) = window_on(&text);
    settle(&mut window);
    let shown = |window: &Harness<'_, App>| window.state().session().shown();
    assert!(shown(&window).is_some(), "a file without outputs shows one of its nodes");
    assert!(window.query_by_label_contains("Add a node to see").is_none());
    let steps = title(&window, "steps");
    click(&mut window, steps);
    assert_eq!(shown(&window).as_deref(), Some("steps.height"));
    let empty = ground(&window);
    click(&mut window, empty);
    assert_eq!((window.state().session().selected(), shown(&window).as_deref()), (None, Some("steps.height")));
    // Several selected nodes do not change it either, and neither does the removal of another node.
    key(&mut window, Modifiers::COMMAND, Key::A);
    assert_eq!(shown(&window).as_deref(), Some("steps.height"));
    click(&mut window, empty);
    let place = title(&window, "place");
    click_with(&mut window, place, Modifiers::COMMAND);
    key(&mut window, Modifiers::NONE, Key::Delete);
    assert!(shown(&window).is_some());
    assert!(window.query_by_label_contains("Add a node to see").is_none());
}

#[test]
fn the_status_bar_is_ready_only_when_the_picture_is_final() {
    crate::draws();
    let mut window = hello();
    if picture(&mut window, "ready").is_none() {
        return;
    }
    for value in ["700 m", "800 m", "900 m"] {
        let edit = Edit::SetText { node: "ground".into(), name: "amplitude".into(), text: value.into() };
        assert!(window.state_mut().session_mut().apply(&edit));
        let mut early = 0;
        until(&mut window, "it is ready", |window| {
            let app = window.state();
            let ready = window.query_by_label("Ready").is_some();
            let drawn = app.seen().is_some_and(|seen| seen == (app.session().revision(), 128));
            early += usize::from(ready && !drawn && !app.session().is_busy());
            ready && drawn
        });
        assert_eq!(early, 0, "frames in which the bar was ahead of the picture");
    }
}

#[test]
fn without_a_3d_driver_the_viewport_says_why() {
    crate::draws();
    let mut window = Harness::builder().with_size([1280.0, 800.0]).with_max_steps(64).build_eframe(|context| {
        App::new(context, Some(graph("hello.ron")), orograph::build::storage::in_memory()).expect("opened")
    });
    window.state_mut().session_mut().set_cells(64);
    settle(&mut window);
    assert!(window.query_by_label_contains("no graphics driver was found").is_some());
}

/// The pointer reads the other layers at its place, each with its unit.
#[test]
fn the_pointer_reads_all_layers() {
    crate::draws();
    let text = r#"(world: (size: "1 km", cells: 64), nodes: {
        "hill": Gradient(centre: (500, 500), azimuth: 90, length: 1000, to: 500),
        "steep": Slope(height: "hill"),
        "depth": Constant(value: 3) },
        outputs: { "height": "hill", "slope": "steep.slope", "depth": "depth" })"#;
    let (mut window, _folder) = window_on(text);
    window.state_mut().session_mut().select_only("steep");
    settle(&mut window);
    window.get_by_label("Map").click();
    window.run_steps(3);
    window.hover_at(pos2(470.0, 260.0));
    window.run_steps(3);
    let read = window.query_all_by_label_contains("hill.value  ").next().and_then(|node| node.value());
    let read = read.expect("the pointer is over the terrain");
    let values: Vec<&str> = read.split(", ").collect();
    assert!(values.iter().any(|value| value.starts_with("hill.value  ") && value.ends_with(" m")), "{read}");
    assert!(values.contains(&"depth.value  3 m"), "{read}");
    look(&mut window, "layers_at_the_pointer");
}
