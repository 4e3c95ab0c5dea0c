//! Tests of outputs that lie on the terrain in the viewport: colours, numbers with their legend, and lines.

use egui::{Key, Modifiers, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use image::RgbaImage;
use orograph::editor::App;

use crate::{
    canvas::{ground, window_on},
    graph,
    hand::{click, key, title, type_text},
    look, picture, settle, until, window,
};

/// Terrain with red colours, weights, slopes and rivers.
const LAND: &str = r##"(
    format: 1,
    world: (size: "4 km", cells: 96, seed: 3),
    nodes: {
        "land":   Ridged(wavelength: "3 km", amplitude: "600 m"),
        "red":    Ramp(version: 2, value: "land", palette: stops, stops: [(0, "#ff0000"), (900, "#ff2000")]),
        "layers": Splat(second: "steep.mask"),
        "steep":  Slope(height: "land"),
        "water":  Flow(height: "land"),
        "net":    Rivers(flow: "water.flow", channel_area: "100000 m²"),
    },
    outputs: { "height": "land" },
    layout: {
        "land": (0, 0), "red": (300, 0), "layers": (300, 300), "steep": (600, 0), "water": (600, 300), "net": (900, 0),
    },
)
"##;

/// The viewport in a picture of the window.
const PANE: [u32; 4] = [30, 110, 900, 400];

/// The fraction of the viewport's pixels for which a condition holds.
fn share(picture: &RgbaImage, so: impl Fn([f32; 3]) -> bool) -> f64 {
    let [left, top, right, bottom] = PANE;
    let pixels = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
    let fits = pixels.filter(|(x, y)| {
        let [r, g, b, _] = picture.get_pixel(*x, *y).0;
        so([r, g, b].map(f32::from))
    });
    fits.count() as f64 / f64::from((right - left) * (bottom - top))
}

/// The fraction of the viewport's pixels that differ clearly between two pictures.
fn apart(a: &RgbaImage, b: &RgbaImage) -> f64 {
    let [left, top, right, bottom] = PANE;
    let pixels = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
    let differs = |(x, y): &(u32, u32)| {
        let [a, b] = [a, b].map(|picture| picture.get_pixel(*x, *y).0);
        a.iter().zip(&b).any(|(a, b)| a.abs_diff(*b) > 24)
    };
    pixels.filter(differs).count() as f64 / f64::from((right - left) * (bottom - top))
}

/// Waits until the newest result is drawn.
fn drawn(window: &mut Harness<'_, App>) {
    settle(window);
    until(window, "the terrain is drawn", |window| {
        let app = window.state();
        app.seen().is_some_and(|(revision, _)| revision == app.session().revision())
    });
    window.run_steps(10);
}

fn is_red([r, g, b]: [f32; 3]) -> bool {
    r > 40.0 && r > 2.0 * g && r > 2.0 * b
}

/// Selects a node by a click on its title.
fn select(window: &mut Harness<'_, App>, node: &str) {
    let title = title(window, node);
    click(window, title);
    assert_eq!(window.state().session().selected(), Some(node));
    drawn(window);
}

/// Chooses an output in the viewport's list.
fn choose(window: &mut Harness<'_, App>, port: &str) {
    let before = window.state().session().shown();
    let list = window.query_all_by_role(Role::ComboBox).find(|list| list.value() == before);
    list.expect("the list of outputs").click();
    window.run_steps(3);
    window.get_by_label(port).click();
    window.run_steps(3);
    drawn(window);
}

#[test]
fn selected_colours_lie_on_the_terrain_in_3d() {
    crate::draws();
    let (mut window, _folder) = window_on(LAND);
    drawn(&mut window);
    let Some(plain) = picture(&mut window, "drape_natural") else { return };
    assert!(share(&plain, is_red) < 0.01);
    select(&mut window, "red");
    let red = picture(&mut window, "drape_red").expect("a device");
    assert!(share(&red, is_red) > 0.1, "{}", share(&red, is_red));
    select(&mut window, "layers");
    let layers = picture(&mut window, "drape_layers").expect("a device");
    assert!(apart(&plain, &layers) > 0.1 && apart(&red, &layers) > 0.1);
    select(&mut window, "land");
    let again = picture(&mut window, "drape_natural_again").expect("a device");
    assert!(share(&again, is_red) < 0.01, "heights have the tints of the look");
}

#[test]
fn the_colours_of_the_painted_range_lie_on_its_terrain() {
    crate::draws();
    let mut window = window(Some(graph("painted.ron")));
    window.state_mut().session_mut().set_cells(192);
    drawn(&mut window);
    let Some(natural) = picture(&mut window, "drape_painted_natural") else { return };
    window.hover_at(ground(&window));
    window.run_steps(3);
    key(&mut window, Modifiers::COMMAND, Key::F);
    type_text(&mut window, "painted");
    key(&mut window, Modifiers::NONE, Key::Escape);
    assert_eq!(window.state().session().shown().as_deref(), Some("painted.colour"));
    drawn(&mut window);
    let painted = picture(&mut window, "drape_painted").expect("a device");
    assert!(apart(&natural, &painted) > 0.15, "{}", apart(&natural, &painted));
}

#[test]
fn selected_numbers_lie_on_the_terrain_with_a_legend() {
    crate::draws();
    let (mut window, _folder) = window_on(LAND);
    drawn(&mut window);
    assert!(window.query_by_label_contains("legend").is_none(), "heights have none");
    let Some(plain) = picture(&mut window, "drape_plain") else { return };
    select(&mut window, "steep");
    let steep = picture(&mut window, "drape_slope").expect("a device");
    assert!(apart(&plain, &steep) > 0.1, "{}", apart(&plain, &steep));
    let legend = |window: &Harness<'_, App>| {
        let found =
            window.query_by_label_contains("legend").map(|node| node.accesskit_node().label().unwrap_or_default());
        found.expect("there is a legend")
    };
    let of_slope = legend(&window);
    assert!(of_slope.starts_with("legend of steep.slope: ") && of_slope.contains('°'), "{of_slope}");
    window.get_by_label("Map").click();
    window.run_steps(3);
    assert_eq!(legend(&window), of_slope, "the map has the same");
    look(&mut window, "drape_slope_map");
    choose(&mut window, "water.area");
    assert!(legend(&window).contains("km²"), "{}", legend(&window));
    look(&mut window, "drape_area_map");
}

#[test]
fn lines_lie_on_the_map_and_on_the_terrain() {
    crate::draws();
    let (mut window, _folder) = window_on(LAND);
    drawn(&mut window);
    let Some(plain) = picture(&mut window, "drape_plain") else { return };
    select(&mut window, "net");
    choose(&mut window, "net.lines");
    assert!(window.query_by_label_contains("previewed").is_none());
    let rivers = picture(&mut window, "drape_lines").expect("a device");
    let blue = |[r, _, b]: [f32; 3]| b > 80.0 && b > 2.0 * r;
    assert!(apart(&plain, &rivers) > 0.005, "{}", apart(&plain, &rivers));
    assert!(share(&rivers, blue) > share(&plain, blue) + 0.004, "{} {}", share(&rivers, blue), share(&plain, blue));
    window.get_by_label("Map").click();
    drawn(&mut window);
    let map = picture(&mut window, "drape_lines_map").expect("a device");
    assert!(share(&map, blue) > 0.004, "{}", share(&map, blue));
}
