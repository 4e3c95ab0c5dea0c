//! Tests of the editor with simulated input, on a software graphics driver.
#![cfg(feature = "editor")]
#![expect(clippy::disallowed_methods, reason = "what waits for another thread gives up in the end")]

mod backends;
mod brush;
mod canvas;
mod clipboard;
mod colours;
mod detail;
#[path = "../common/device.rs"]
mod device;
mod drags;
mod drape;
mod draw;
mod expected;
mod export;
mod files;
mod frames;
mod hand;
mod handles;
mod history;
mod inspector;
mod keyboard;
mod live;
mod looks;
mod menu;
mod opening;
mod problems;
mod random;
mod reuse;
mod safety;
mod slow;
mod store;
mod variations;
mod viewport;
mod ways;
mod welcome;

use std::{
    path::PathBuf,
    thread,
    time::{Duration, Instant},
};

use egui_kittest::{Harness, HarnessBuilder};
use orograph::{editor::App, memory::Memory};

/// The program's allocator.
#[global_allocator]
static MEMORY: Memory = Memory;

/// A graph file of the project.
fn graph(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../graphs")).join(name)
}

/// A folder with a graph file of this text, `graph.ron`.
fn scratch(text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("graph.ron"), text).expect("written");
    folder
}

/// Modules whose tests do not look at what is drawn, so that their windows have no graphics device: in software, drawing
/// takes nine tenths of the time of a test.
const PLAIN: [&str; 13] = [
    "canvas",
    "clipboard",
    "drags",
    "files",
    "frames",
    "history",
    "inspector",
    "keyboard",
    "menu",
    "problems",
    "reuse",
    "safety",
    "store",
];

/// The tests of these modules that do look at it.
const DRAWN: [&str; 19] = [
    "the_canvas_is_drawn_in_both_themes_at_any_size",
    "a_node_without_its_wire_waits_and_has_not_failed",
    "a_large_graph_is_opened_where_it_can_be_read",
    "parameters_are_copied_to_nodes_of_the_same_kind",
    "a_copy_keeps_the_wires_into_it",
    "parameters_without_effect_are_greyed_out_with_a_reason",
    "numbers_are_never_cut_and_tooltips_have_the_units",
    "a_note_of_several_lines_is_one_undo_step",
    "the_3d_view_is_saved_as_a_picture_beside_the_graph",
    "an_example_is_opened_as_a_copy_that_finds_its_files",
    "every_key_command_is_in_the_menus",
    "views_are_switched_by_the_menu",
    "a_key_maximises_the_pane_under_the_pointer",
    "an_empty_frame_cuts_no_node",
    "steps_are_named_and_clicked",
    "a_snapshot_is_compared_and_restored",
    "several_nodes_are_edited_at_once",
    "a_selection_becomes_a_subgraph_and_back",
    "a_refused_subgraph_says_why",
];

/// Returns true if the running test looks at what is drawn.
fn is_drawn() -> bool {
    let thread = thread::current();
    let name = thread.name().unwrap_or_default();
    let (module, test) = (name.split("::").next(), name.rsplit("::").next());
    !PLAIN.iter().any(|plain| module == Some(plain)) || DRAWN.iter().any(|drawn| test == Some(drawn))
}

/// A window builder, which draws if the test looks at it and there is a graphics device.
fn harness<S>(size: [f32; 2]) -> HarnessBuilder<S> {
    let builder = Harness::builder().with_size(size).with_max_steps(64);
    if is_drawn() && device::missing().is_none() { builder.wgpu() } else { builder }
}

/// A window of 1280 x 800 points on a file, or on an empty graph.
fn window(file: Option<PathBuf>) -> Harness<'static, App> {
    harness([1280.0, 800.0]).with_step_dt(1.0 / 60.0).build_eframe(|context| {
        App::new(context, file, orograph::build::storage::in_memory()).expect("the file can be read")
    })
}

/// Timeout, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(180);

/// Polls until a condition is true.
#[track_caller]
fn wait(what: &str, mut so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !so() {
        assert!(start.elapsed() < PATIENCE, "{what}: not after {PATIENCE:?}");
        thread::sleep(Duration::from_millis(10));
    }
}

/// Runs frames until a condition is true.
#[track_caller]
fn until(window: &mut Harness<'_, App>, what: &str, mut so: impl FnMut(&Harness<'_, App>) -> bool) {
    wait(what, || {
        window.step();
        so(window)
    });
}

/// Runs frames until everything in the window has been built.
#[track_caller]
fn settle(window: &mut Harness<'_, App>) {
    until(window, "all is built", |window| !window.state().session().is_busy());
    window.step();
}

/// A picture of the window, some frames after everything is built. Also saves it to the folder `OROGRAPH_PICTURES`, if
/// set. Returns None, after a message, when there is no graphics device.
fn picture(window: &mut Harness<'_, App>, name: &str) -> Option<image::RgbaImage> {
    for _ in 0..10 {
        window.step();
        thread::sleep(Duration::from_millis(20));
    }
    if device::skips(&format!("the picture {name}")) {
        return None;
    }
    let picture = window.render().expect("a graphics driver, and a test in `DRAWN`");
    if let Some(folder) = std::env::var_os("OROGRAPH_PICTURES") {
        picture.save(PathBuf::from(folder).join(format!("{name}.png"))).expect("the folder can be written to");
    }
    Some(picture)
}
