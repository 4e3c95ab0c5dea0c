//! Tests of finer cells in close views.

use egui::{pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::{App, Detail};
use orograph_graph::{Edit, Evaluator, EvaluatorOptions, Value, Window};

use crate::{
    built, device,
    hand::{drag, wheel},
    look, picture, scratch, settle, until, window,
};

const HILLS: &str = r#"(
    world: (size: 8000, cells: 256, seed: 3),
    nodes: {
        "hills": Perlin(wavelength: 1500, octaves: 10, amplitude: 400),
        "soft":  Blur(value: "hills", radius: 12),
        "steep": Slope(height: "soft"),
    },
    outputs: { "height": "soft" },
)"#;

fn hills() -> (Harness<'static, App>, tempfile::TempDir) {
    let folder = scratch(HILLS);
    let mut window = window(Some(folder.path().join("graph.ron")));
    window.state_mut().session_mut().set_cells(128);
    settle(&mut window);
    (window, folder)
}

fn detail(window: &Harness<'_, App>) -> Option<Detail> {
    window.state().session().detail().cloned()
}

/// Zooms with the wheel at the centre of the terrain, then waits until the view is still.
fn zoom(window: &mut Harness<'_, App>, steps: f32) {
    window.hover_at(pos2(460.0, 260.0));
    window.step();
    wheel(window, steps);
    window.run_steps(20);
}

/// Runs frames for more than twice the time that the view must be still before a finer part is requested.
fn rest(window: &mut Harness<'_, App>) {
    for _ in 0..35 {
        window.step();
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
}

#[track_caller]
fn drawn(window: &mut Harness<'_, App>) -> Window {
    until(window, "finer cells are drawn", |window| {
        let session = window.state().session();
        let part = session.shown().and_then(|port| session.finer(&port)?.value.as_field());
        let current = matches!(detail(window), Some(Detail::Built { .. }));
        current && part.is_some_and(|part| window.state().finer() == Some(*part.window()))
    });
    window.state().finer().expect("just now")
}

/// The mean difference of the colours of two pictures over a part right of the divider.
fn difference(a: &image::RgbaImage, b: &image::RgbaImage) -> f64 {
    let places = (150..350).flat_map(|y| (540..840).map(move |x| (x, y)));
    let apart = places.map(|(x, y)| a.get_pixel(x, y)[1].abs_diff(b.get_pixel(x, y)[1]));
    apart.map(f64::from).sum::<f64>() / (200.0 * 300.0)
}

/// Compares the finer part with the same part of a build of the whole world.
#[track_caller]
fn check(window: &Harness<'_, App>) {
    let session = window.state().session();
    let port = session.shown().expect("an output");
    let built = session.finer(&port).expect("it is there");
    let part = built.value.as_field().expect("a raster");
    let document = session.document();
    let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("threads");
    let (graph, whole) = (document.graph(), Window::whole(part.window().world));
    let port = graph.port(&port).expect("exists");
    let values = evaluator.values(graph, std::path::Path::new(""), &[port], whole).expect("it runs");
    let Value::Field(whole) = &values[0] else { panic!("a raster") };
    assert!(whole.crop(part.window()) == *part, "the same samples");
}

/// Compares the shown output with itself: the picture stays the same, with finer cells on both sides of the divider.
fn compare_with_itself(window: &mut Harness<'_, App>, name: &str) {
    let alone = picture(window, name);
    window.state_mut().session_mut().compare(Some("soft.value".to_owned()));
    window.step();
    settle(window);
    drawn(window);
    rest(window);
    let (Some(alone), Some(both)) = (alone, picture(window, &format!("{name}_compared"))) else { return };
    let apart = difference(&alone, &both);
    assert!(apart < 0.5, "{apart}");
}

#[test]
fn a_close_map_shows_finer_cells_of_the_part_in_view() {
    crate::draws();
    let (mut window, _folder) = hills();
    window.get_by_label("Map").click();
    window.run_steps(3);
    rest(&mut window);
    assert_eq!((detail(&window), window.state().finer()), (None, None), "the whole world is in view");

    zoom(&mut window, 12.0);
    let part = drawn(&mut window);
    assert_eq!(part.world.cells, [1024; 2], "four times the document's");
    assert!(!part.is_whole() && part.len() < 1 << 20, "{part:?}");
    check(&window);
    look(&mut window, "detail");
    assert!(window.query_by_label_contains("Detail: 1024 cells").is_some());

    // A small move needs no new part; a long one does.
    drag(&mut window, pos2(460.0, 260.0), pos2(464.0, 262.0));
    rest(&mut window);
    assert_eq!((detail(&window), window.state().finer()), (Some(Detail::Built { cells: 1024 }), Some(part)));
    drag(&mut window, pos2(460.0, 260.0), pos2(460.0, 260.0) + vec2(-260.0, -120.0));
    let moved = drawn(&mut window);
    assert!(moved != part && moved.world == part.world, "{moved:?}");
    check(&window);

    compare_with_itself(&mut window, "detail_moved");

    let edit = Edit::SetText { node: "hills".into(), name: "amplitude".into(), text: "200 m".into() };
    assert!(window.state_mut().session_mut().apply(&edit));
    window.step();
    assert_eq!(window.state().finer(), None, "finer cells of the state before do not count");
    drawn(&mut window);
    check(&window);

    window.get_by_label("Fit view").click();
    window.run_steps(2);
    assert_eq!(detail(&window), None);
}

#[test]
fn a_node_that_needs_the_whole_world_keeps_the_detail_of_the_build() {
    crate::draws();
    let mut window = built("hello.ron", 128);
    window.get_by_label("Map").click();
    window.run_steps(3);
    zoom(&mut window, 12.0);
    rest(&mut window);
    assert_eq!(detail(&window), Some(Detail::OfBuild { node: "rivers".into() }));
    assert!(window.query_by_label("Full detail at export: rivers is computed for the whole world").is_some());
    assert!(window.state().session().finer("rivers.height").is_none() && window.state().finer().is_none());
    look(&mut window, "detail_of_build");

    // the other side of a comparison can have finer cells
    window.state_mut().session_mut().compare(Some("ground.height".to_owned()));
    until(&mut window, "finer cells of the other side", |window| {
        window.state().session().finer("ground.height").is_some()
    });
    assert_eq!(detail(&window), Some(Detail::OfBuild { node: "rivers".into() }));
    assert!(window.state().finer().is_none());
    look(&mut window, "detail_of_build_compared");
}

/// The 3D view of [`HILLS`].
fn hills_in_3d() -> (Harness<'static, App>, tempfile::TempDir) {
    let (mut window, folder) = hills();
    until(&mut window, "the terrain is drawn", |window| window.state().seen().is_some());
    (window, folder)
}

#[test]
fn a_close_camera_shows_finer_cells_of_the_part_in_view() {
    crate::draws();
    if device::skips("a_close_camera_shows_finer_cells_of_the_part_in_view") {
        return;
    }
    let (mut window, _folder) = hills_in_3d();
    rest(&mut window);
    assert_eq!((detail(&window), window.state().finer()), (None, None), "the whole world is in view");
    assert!(window.state().session().finer("soft.value").is_none(), "nothing was ordered");

    zoom(&mut window, 12.0);
    let part = drawn(&mut window);
    assert_eq!(part.world.cells, [1024; 2], "four times the document's");
    assert!(!part.is_whole() && part.len() < 1 << 20, "{part:?}");
    check(&window);
    assert!(window.query_by_label_contains("Detail: 1024 cells").is_some());

    compare_with_itself(&mut window, "detail_3d");

    let edit = Edit::SetText { node: "hills".into(), name: "amplitude".into(), text: "200 m".into() };
    assert!(window.state_mut().session_mut().apply(&edit));
    drawn(&mut window);
    check(&window);

    // From a distance the cells of the preview are fine enough.
    zoom(&mut window, -20.0);
    until(&mut window, "the preview alone is drawn", |window| window.state().finer().is_none());
    assert_eq!(detail(&window), None);
}

#[test]
fn colours_of_a_close_camera_are_as_fine_as_its_heights() {
    crate::draws();
    if device::skips("colours_of_a_close_camera_are_as_fine_as_its_heights") {
        return;
    }
    let (mut window, _folder) = hills_in_3d();
    window.state_mut().session_mut().select_only("steep");
    window.step();
    settle(&mut window);
    zoom(&mut window, 12.0);
    let part = drawn(&mut window);
    let session = window.state().session();
    let of = |port: &str| session.finer(port).and_then(|built| built.value.as_field()).map(|field| *field.window());
    assert_eq!([of("steep.slope"), of("soft.value")], [Some(part); 2]);
    look(&mut window, "detail_3d_mask");
}

#[test]
fn a_camera_behind_a_node_that_needs_the_whole_world_sees_the_build() {
    crate::draws();
    let mut window = built("hello.ron", 128);
    until(&mut window, "the terrain is drawn", |window| window.state().seen().is_some());
    zoom(&mut window, 12.0);
    until(&mut window, "the view is close", |window| detail(window) == Some(Detail::OfBuild { node: "rivers".into() }));
    rest(&mut window);
    assert!(window.state().finer().is_none());
}
