//! Pictures of the editor for the manual, drawn without a display:
//!
//! ```text
//! cargo run -p orograph --example screenshots
//! ```
//!
//! writes `docs/pictures/editor.png`, `editor_light.png`, `editor_map.png` and `editor_layers.png`; another folder can
//! be named.

use std::{path::PathBuf, thread, time::Duration};

use egui::{Theme, ThemePreference};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

/// The project's folder.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn main() {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from(ROOT).join("docs/pictures"), PathBuf::from);
    let mut window = window("canyon.ron", 400);
    window.state_mut().session_mut().select_only("rock");
    save(&mut window, &folder.join("editor_layers.png"));
    drop(window);

    let mut window = self::window("alps.ron", 400);
    window.state_mut().session_mut().select_only("rivers");
    save(&mut window, &folder.join("editor.png"));
    window.get_by_label("Map").click();
    window.get_by_label("Contours").click();
    save(&mut window, &folder.join("editor_map.png"));
    drop(window);

    let mut window = self::window("flood_dem.ron", 512);
    window.ctx.set_theme(ThemePreference::from(Theme::Light));
    window.state_mut().session_mut().select_only("flood");
    save(&mut window, &folder.join("editor_light.png"));
}

/// A window on a graph of the project, once it is fully built with this many cells per side.
fn window(graph: &str, cells: u32) -> Harness<'static, App> {
    let file = PathBuf::from(ROOT).join("graphs").join(graph);
    let mut window = Harness::builder().with_size([1440.0, 900.0]).wgpu().build_eframe(|context| {
        App::new(context, Some(file), orograph::build::storage::in_memory()).expect("the graph can be read")
    });
    window.state_mut().session_mut().set_cells(cells);
    window
}

fn save(window: &mut Harness<'_, App>, path: &std::path::Path) {
    // The requests are known after a frame; pictures are drawn in the background once the worker has finished.
    window.step();
    while window.state().session().is_busy() {
        window.step();
        thread::sleep(Duration::from_millis(20));
    }
    for _ in 0..30 {
        window.step();
        thread::sleep(Duration::from_millis(20));
    }
    let picture = window.render().expect("there is a graphics driver");
    image::DynamicImage::from(picture).to_rgb8().save(path).expect("the picture can be written");
    println!("{}", path.display());
}
