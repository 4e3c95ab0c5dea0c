//! What the measuring examples share: a window without a graphics device, and processor times.

use std::{fs, path::Path, thread, time::Duration};

use egui_kittest::Harness;
use orograph::editor::App;

/// A window of 1280 x 800 points on a graph, sixty frames a second.
pub fn window(folder: &Path, graph: &str) -> Harness<'static, App> {
    let path = folder.join("graph.ron");
    fs::write(&path, graph).expect("written");
    Harness::builder().with_size([1280.0, 800.0]).with_step_dt(1.0 / 60.0).build_eframe(|context| {
        context.wgpu_render_state = None;
        App::new(context, Some(path), orograph::build::storage::in_memory()).expect("the graph can be read")
    })
}

/// Runs frames until everything is built and drawn.
pub fn settle(window: &mut Harness<'_, App>) {
    let mut quiet = 0;
    while quiet <= 50 {
        window.step();
        thread::sleep(Duration::from_millis(2));
        quiet = if window.state().session().is_busy() { 0 } else { quiet + 1 };
    }
}

/// Milliseconds that this thread, or the whole program, has run, whatever else the machine does; 0 where the system does
/// not report it.
pub fn spent(all: bool) -> f64 {
    // The system updates the count when a thread yields.
    thread::yield_now();
    let own = Path::new("/proc/thread-self").canonicalize();
    let threads: Vec<_> = match fs::read_dir("/proc/self/task") {
        Ok(entries) if all => entries.flatten().map(|entry| entry.path()).collect(),
        _ => own.into_iter().collect(),
    };
    let told = threads.iter().filter_map(|thread| fs::read_to_string(thread.join("schedstat")).ok());
    told.filter_map(|told| told.split(' ').next()?.parse::<f64>().ok()).map(|ns| ns * 1e-6).sum()
}
