//! Tests of the editor with simulated input, on a software graphics driver.
#![cfg(feature = "editor")]
#![expect(clippy::disallowed_methods, reason = "what waits for another thread gives up in the end")]

mod backends;
mod bookmarks;
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
mod names;
mod opening;
mod overview;
mod problems;
mod random;
mod reuse;
mod safety;
mod scrub;
mod slow;
mod store;
mod tasks;
mod variations;
mod viewport;
mod ways;
mod welcome;

use std::{
    cell::Cell,
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

thread_local! {
    /// True if the test on this thread looks at what is drawn.
    static DRAWS: Cell<bool> = const { Cell::new(false) };
}

/// Says that a test looks at what is drawn: its windows have a graphics device, if there is one. Others have none, as in
/// software drawing takes nine tenths of the time of a test.
fn draws() {
    DRAWS.set(true);
}

/// A window builder, which draws if the test looks at it and there is a graphics device.
fn harness<S>(size: [f32; 2]) -> HarnessBuilder<S> {
    let builder = Harness::builder().with_size(size).with_max_steps(64);
    if DRAWS.get() && device::missing().is_none() { builder.wgpu() } else { builder }
}

/// A window of 1280 x 800 points on a file, or on an empty graph.
fn window(file: Option<PathBuf>) -> Harness<'static, App> {
    harness([1280.0, 800.0]).with_step_dt(1.0 / 60.0).build_eframe(|context| {
        App::new(context, file, orograph::build::storage::in_memory()).expect("the file can be read")
    })
}

/// A window on an example graph that is built with this number of cells.
fn built(file: &str, cells: u32) -> Harness<'static, App> {
    let mut window = window(Some(graph(file)));
    window.state_mut().session_mut().set_cells(cells);
    settle(&mut window);
    window
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

/// Some frames after everything is built.
fn frames(window: &mut Harness<'_, App>) {
    for _ in 0..10 {
        window.step();
        thread::sleep(Duration::from_millis(20));
    }
}

/// Draws the window for a person to look at, if `OROGRAPH_PICTURES` names a folder; otherwise only runs the frames.
fn look(window: &mut Harness<'_, App>, name: &str) {
    if std::env::var_os("OROGRAPH_PICTURES").is_some() {
        picture(window, name);
    } else {
        frames(window);
    }
}

/// A picture of the window, some frames after everything is built. Also saves it to the folder `OROGRAPH_PICTURES`, if
/// set. Returns None, after a message, when there is no graphics device.
fn picture(window: &mut Harness<'_, App>, name: &str) -> Option<image::RgbaImage> {
    frames(window);
    if device::skips(&format!("the picture {name}")) {
        return None;
    }
    let picture = window.render().expect("a graphics driver, and `draws` at the start of the test");
    if let Some(folder) = std::env::var_os("OROGRAPH_PICTURES") {
        picture.save(PathBuf::from(folder).join(format!("{name}.png"))).expect("the folder can be written to");
    }
    Some(picture)
}
