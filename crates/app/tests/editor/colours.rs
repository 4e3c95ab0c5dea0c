//! Tests of colours in the inspector: typed, and taken from the window.

use egui::{Key, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;
use orograph_graph::ParamValue;

use crate::{
    inspector::{param, selected},
    look,
};

#[test]
fn colours_are_typed_in_hexadecimal() {
    let mut window = selected("mesas.ron", "sand");
    let colours = |window: &Harness<'_, App>| {
        let ParamValue::Stops(stops) = param(window, "sand", "stops") else { return Vec::new() };
        stops.iter().map(|stop| stop.colour.to_string()).collect::<Vec<_>>()
    };
    let before = colours(&window);
    let mut fill = |old: &str, new: &str| {
        let fields = window.query_all_by_role(Role::TextInput);
        fields.into_iter().find(|field| field.value().as_deref() == Some(old)).expect("a field").focus();
        window.run_steps(2);
        // The field has the focus, with all of its text selected.
        window.event(egui::Event::Text(new.to_owned()));
        window.run_steps(2);
        window.key_press(Key::Enter);
        window.run_steps(3);
        colours(&window)
    };
    assert_eq!(fill(&before[0], "#1a2B3c")[0], "#1a2b3c");
    assert_eq!(fill("#1a2b3c", "ff8000")[0], "#ff8000");
    assert_eq!(fill("#ff8000", "orange")[0], "#ff8000");
    assert!(window.query_by_label_contains("six hexadecimal digits").is_some());
}

#[test]
fn a_colour_is_taken_from_the_window() {
    crate::draws();
    if crate::device::skips("the eyedropper") {
        return;
    }
    let mut window = selected("mesas.ron", "sand");
    let first = |window: &Harness<'_, App>| {
        let ParamValue::Stops(stops) = param(window, "sand", "stops") else { return String::new() };
        stops[0].colour.to_string()
    };
    let before = first(&window);
    let dropper = |window: &Harness<'_, App>| {
        window.query_all_by_label_contains("Take a colour").next().expect("a button").rect().center()
    };
    let revision = |window: &Harness<'_, App>| window.state().session().document().steps();
    let at = egui::pos2(400.0, 300.0);
    let picture = |colour: egui::Color32| {
        let mut image = egui::ColorImage::filled([1280, 800], egui::Color32::BLACK);
        image.pixels[300 * 1280 + 400] = colour;
        let (viewport_id, user_data) = (egui::ViewportId::ROOT, egui::UserData::default());
        egui::Event::Screenshot { viewport_id, user_data, image: std::sync::Arc::new(image) }
    };
    // Escape cancels.
    let button = dropper(&window);
    crate::hand::click(&mut window, button);
    crate::hand::key(&mut window, egui::Modifiers::NONE, Key::Escape);
    window.event(picture(egui::Color32::from_rgb(1, 2, 3)));
    window.run_steps(3);
    assert_eq!((first(&window), revision(&window)), (before.clone(), 0));
    // The colour is that of the clicked point, which is another one where rows and columns are exchanged.
    let shown = crate::picture(&mut window, "eyedropper").expect("there is a device");
    let [here, exchanged] = [(400, 300), (300, 400)].map(|(x, y)| {
        let [red, green, blue, _] = shown.get_pixel(x, y).0;
        format!("#{red:02x}{green:02x}{blue:02x}")
    });
    assert!(here != exchanged && here != before, "{here} {exchanged}");
    crate::hand::click(&mut window, button);
    crate::hand::click(&mut window, at);
    assert_eq!(window.state().session().selected(), Some("sand"), "the click takes a colour and nothing else");
    window.run_steps(3);
    let taken = first(&window);
    assert_eq!((taken.as_str(), revision(&window)), (here.as_str(), 1));
    // The eyedropper has done its work.
    window.event(picture(egui::Color32::from_rgb(1, 2, 3)));
    window.run_steps(3);
    assert_eq!(first(&window), taken);
}

/// The eyedropper of a field that is no longer shown ends: clicks are clicks again, and the field that comes back takes
/// no colour.
#[test]
fn the_eyedropper_ends_with_its_field() {
    let mut window = selected("mesas.ron", "sand");
    let dropper = window.query_all_by_label_contains("Take a colour").next().expect("a button").rect().center();
    crate::hand::click(&mut window, dropper);
    let session = window.state_mut().session_mut();
    let other = session.document().nodes().iter().map(|entry| entry.name.clone()).find(|name| name != "sand");
    session.select_only(&other.expect("there are others"));
    window.run_steps(5);
    window.state_mut().session_mut().select_only("sand");
    window.run_steps(5);
    let ground = window.get_by_label("graph").rect().left_bottom() + egui::vec2(60.0, -12.0);
    crate::hand::click(&mut window, ground);
    assert_eq!(window.state().session().selected(), None, "a click beside the nodes selects none");
    assert_eq!(window.state().session().document().steps(), 0);
}

#[test]
fn the_colour_of_a_layer_of_rock_is_typed() {
    crate::draws();
    let mut window = selected("canyon.ron", "rock");
    let colour = |window: &Harness<'_, App>| {
        let ParamValue::Layers(layers) = param(window, "rock", "layers") else { return String::new() };
        layers[0].colour.to_string()
    };
    let before = colour(&window);
    let fields = window.query_all_by_role(Role::TextInput);
    fields.into_iter().find(|field| field.value() == Some(before.clone())).expect("a field").focus();
    window.run_steps(2);
    window.event(egui::Event::Text("#102030".to_owned()));
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert_eq!(colour(&window), "#102030");
    look(&mut window, "layers_of_rock");
}
