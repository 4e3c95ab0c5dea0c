//! Tests of saved views: a view is saved, restored, kept for its file, and removed, by mouse.

use std::path::Path;

use egui::{Event, pos2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

use crate::{
    hand::{click, drag},
    picture, scratch, settle, until, window,
};

const HILL: &str = r#"(
    world: (size: 2000, cells: 64, seed: 3),
    nodes: { "hill": Ridged(wavelength: 900, amplitude: 300) },
    outputs: { "height": "hill" },
)"#;

fn opened(file: &Path) -> Harness<'static, App> {
    let mut window = window(Some(file.to_owned()));
    window.state_mut().session_mut().set_cells(64);
    settle(&mut window);
    until(&mut window, "the terrain is drawn", |window| window.state().seen().is_some());
    window
}

/// Opens the menu of views. All tests of it are one, because the views of all files are stored in one place.
fn views(window: &mut Harness<'_, App>) {
    let button = window.get_by_label("Views").rect().center();
    click(window, button);
}

/// Chooses a line of the menu of views.
fn choose(window: &mut Harness<'_, App>, line: &str) {
    views(window);
    let line = window.get_by_label(line).rect().center();
    click(window, line);
}

fn remove(window: &mut Harness<'_, App>, view: &str) {
    choose(window, &format!("Remove {view}"));
    views(window);
    assert!(window.query_by_label(view).is_none(), "{view}");
    click(window, pos2(900.0, 250.0));
}

/// The terrain as it is drawn, without the pointer.
fn terrain(window: &mut Harness<'_, App>, name: &str) -> Vec<u8> {
    window.event(Event::PointerGone);
    window.run_steps(2);
    let picture = picture(window, name).expect("there is a device");
    image::imageops::crop_imm(&picture, 200, 120, 500, 240).to_image().into_raw()
}

#[test]
fn a_view_is_saved_restored_and_removed() {
    crate::draws();
    if crate::device::skips("saved views") {
        return;
    }
    let folder = scratch(HILL);
    let file = folder.path().join("graph.ron");
    let mut window = opened(&file);
    let whole = terrain(&mut window, "view_whole");
    drag(&mut window, pos2(400.0, 250.0), pos2(560.0, 220.0));
    let turned = terrain(&mut window, "view_turned");
    assert!(turned != whole);
    choose(&mut window, "Save this view");
    assert!(window.query_by_label("Save this view").is_none(), "the menu is closed");
    choose(&mut window, "From above");
    let above = terrain(&mut window, "view_above");
    assert!(above != turned && above != whole);
    choose(&mut window, "Save this view");

    choose(&mut window, "View 1");
    assert!(terrain(&mut window, "view_1") == turned, "the first view is shown again, to the pixel");
    choose(&mut window, "View 2");
    assert!(terrain(&mut window, "view_2") == above);

    // Views are kept when the window is closed, for this file only.
    drop(window);
    let mut window = opened(&file);
    choose(&mut window, "View 1");
    assert!(terrain(&mut window, "view_1_later") == turned);
    let elsewhere = scratch(HILL);
    let mut other = opened(&elsewhere.path().join("graph.ron"));
    views(&mut other);
    assert!(other.query_by_label("From above").is_some() && other.query_by_label("View 1").is_none());

    remove(&mut window, "View 1");
    drop(window);
    let mut window = opened(&file);
    views(&mut window);
    assert!(window.query_by_label("View 1").is_none() && window.query_by_label("View 2").is_some());
    // A new view takes the free name.
    click(&mut window, pos2(900.0, 250.0));
    choose(&mut window, "Save this view");
    views(&mut window);
    assert!(window.query_by_label("View 1").is_some());
    click(&mut window, pos2(900.0, 250.0));

    // A view that another window saves meanwhile is not lost.
    click(&mut other, pos2(900.0, 250.0));
    choose(&mut other, "Save this view");
    // Leaves nothing in the folder of the user.
    remove(&mut window, "View 1");
    remove(&mut window, "View 2");
    drop([window, other]);
    let mut other = opened(&elsewhere.path().join("graph.ron"));
    remove(&mut other, "View 1");
}
