//! The editor, driven as a person would, on a software graphics driver.
#![cfg(feature = "editor")]
#![expect(clippy::disallowed_methods, reason = "what waits for another thread gives up in the end")]

mod brush;
mod canvas;
mod export;
mod files;
mod hand;
mod inspector;
mod live;
mod looks;
mod menu;
mod opening;
mod problems;
mod safety;
mod viewport;
mod ways;

use std::{path::PathBuf, thread, time::Duration};

use egui_kittest::Harness;
use orograph::editor::App;

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

/// A window of 1280 x 800 points on a file, or on an empty graph.
fn window(file: Option<PathBuf>) -> Harness<'static, App> {
    Harness::builder()
        .with_size([1280.0, 800.0])
        .with_max_steps(64)
        .with_step_dt(1.0 / 60.0)
        .wgpu()
        .build_eframe(|context| App::new(context, file).expect("the file can be read"))
}

/// Runs frames until everything that is shown has been built.
fn settle(window: &mut Harness<'_, App>) {
    for _ in 0..3000 {
        window.step();
        if !window.state().session().is_busy() {
            window.step();
            return;
        }
        thread::sleep(Duration::from_millis(10));
    }
    panic!("the worker is still busy");
}

/// The window as it looks, some frames after what is in it was built; kept in the folder `OROGRAPH_PICTURES` names, to be
/// looked at.
fn picture(window: &mut Harness<'_, App>, name: &str) -> image::RgbaImage {
    for _ in 0..10 {
        window.step();
        thread::sleep(Duration::from_millis(20));
    }
    let picture = window.render().expect("there is a graphics driver");
    if let Some(folder) = std::env::var_os("OROGRAPH_PICTURES") {
        picture.save(PathBuf::from(folder).join(format!("{name}.png"))).expect("the folder can be written to");
    }
    picture
}
