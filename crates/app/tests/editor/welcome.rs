//! Tests of the welcome page and of the scale of the window.

use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

use crate::{harness, look, settle};

/// A window with the welcome page.
pub fn welcomed(size: [f32; 2]) -> Harness<'static, App> {
    harness(size).with_step_dt(1.0 / 60.0).build_eframe(|context| {
        App::new(context, None, orograph::build::storage::in_memory()).expect("no file is read").welcoming()
    })
}

#[test]
fn an_example_is_opened_from_its_picture() {
    crate::draws();
    let mut window = welcomed([1280.0, 800.0]);
    window.run_steps(3);
    look(&mut window, "welcome");
    window.get_by_label("Mountains").click();
    window.run_steps(3);
    assert!(window.query_by_label("Welcome to Orograph").is_none(), "the page is closed");
    assert_eq!(window.state().session().example(), Some("hello"));
    assert!(window.state().session().path().is_none(), "it is a copy");
    window.state_mut().session_mut().set_cells(64);
    settle(&mut window);
}

#[test]
fn the_page_can_be_left_in_small_windows_and_at_a_large_scale() {
    for (size, scale) in [([400.0, 300.0], 1.0), ([200.0, 200.0], 1.0), ([1280.0, 800.0], 3.0)] {
        let mut window = welcomed(size);
        window.ctx.set_zoom_factor(scale);
        window.run_steps(4);
        assert!(window.query_by_label("Welcome to Orograph").is_some(), "{size:?}");
        window.key_press(egui::Key::Escape);
        window.run_steps(3);
        assert!(window.query_by_label("Welcome to Orograph").is_none(), "{size:?}");
    }
}
