//! Tests of the inspector: every kind of value has a widget, and a refused value shows the reason.

use egui::{Key, accesskit::Role};
use egui_kittest::{
    Harness,
    kittest::{NodeT as _, Queryable as _},
};
use orograph::editor::App;
use orograph_graph::{GeoPlace, ParamValue, Port};

use crate::{graph, look, scratch, settle, until, window};

/// A window on a file, with a node selected.
pub fn selected(file: &str, node: &str) -> Harness<'static, App> {
    let mut window = window(Some(graph(file)));
    window.state_mut().session_mut().set_cells(64);
    window.state_mut().session_mut().select_only(node);
    settle(&mut window);
    window.run_steps(4);
    window
}

pub fn param(window: &Harness<'_, App>, node: &str, name: &str) -> ParamValue {
    let graph = window.state().session().document().graph();
    let index = graph.find(node).expect("the node is there");
    graph.instance(index).params.get(name).cloned().expect("the parameter is there")
}

/// Types into the field of a row and presses Enter.
fn fill(window: &mut Harness<'_, App>, line: &str, text: &str) {
    window.get_by_role_and_label(Role::TextInput, line).focus();
    window.run_steps(2);
    window.get_by_role_and_label(Role::TextInput, line).type_text(text);
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(3);
}

#[test]
fn a_slider_drag_is_one_undo_step() {
    let mut window = selected("hello.ron", "rivers");
    let before = window.state().session().document().source().to_owned();
    let rect = window.get_by_role_and_label(Role::Slider, "duration").rect();
    window.drag_at(rect.center());
    window.run_steps(2);
    for step in 1..6 {
        window.hover_at(rect.center() + egui::vec2(4.0 * step as f32, 0.0));
        window.run_steps(1);
    }
    let document = window.state().session().document();
    assert_ne!(document.source(), before, "the document follows the pointer");
    assert_eq!(document.steps(), 1);
    window.drop_at(rect.center() + egui::vec2(20.0, 0.0));
    window.run_steps(3);
    let rect = window.get_by_role_and_label(Role::Slider, "duration").rect();
    window.drag_at(rect.left_center() + egui::vec2(10.0, 0.0));
    window.run_steps(2);
    window.drop_at(rect.left_center() + egui::vec2(10.0, 0.0));
    window.run_steps(3);
    let session = window.state_mut().session_mut();
    assert_eq!(session.document().steps(), 2, "{}", session.document().source());
    session.undo();
    session.undo();
    assert_eq!(session.document().source(), before);
}

#[test]
fn quantities_are_typed_with_their_units() {
    let mut window = selected("hello.ron", "ground");
    fill(&mut window, "wavelength", "2 km");
    assert_eq!(param(&window, "ground", "wavelength"), ParamValue::Float(2000.0));
    let source = window.state().session().document().source().to_owned();
    assert!(source.contains("wavelength: \"2 km\""), "{source}");
    // a refused value shows the reason beside the field, and changes nothing
    fill(&mut window, "wavelength", "2 years");
    assert_eq!(window.state().session().document().source(), source);
    assert!(window.query_by_label_contains("`years` is not a unit of a length").is_some());
    assert_eq!(window.state_mut().session_mut().take_notes(), []);
    fill(&mut window, "wavelength", "7000 km");
    assert!(window.query_by_label_contains("is 7000 km, but must be").is_some());
    fill(&mut window, "octaves", "5");
    assert_eq!(param(&window, "ground", "octaves"), ParamValue::Int(5));
    assert!(window.query_by_label_contains("but must be").is_none(), "the reason is gone with the next value");
}

/// A value in its field is not lost when another node is selected before Enter.
#[test]
fn a_typed_value_is_applied_when_another_node_is_selected() {
    let mut window = selected("hello.ron", "ground");
    window.get_by_role_and_label(Role::TextInput, "wavelength").focus();
    window.run_steps(2);
    window.get_by_role_and_label(Role::TextInput, "wavelength").type_text("9 km");
    window.run_steps(1);
    window.state_mut().session_mut().select_only("rivers");
    window.run_steps(3);
    let session = window.state().session();
    assert!(session.document().source().contains("wavelength: \"9 km\""), "{}", session.document().source());
    assert_eq!((session.document().steps(), session.selected()), (1, Some("rivers")));
}

#[test]
fn escape_discards_typed_text() {
    let mut window = selected("hello.ron", "ground");
    let source = window.state().session().document().source().to_owned();
    window.get_by_role_and_label(Role::TextInput, "wavelength").focus();
    window.run_steps(2);
    window.get_by_role_and_label(Role::TextInput, "wavelength").type_text("9 km");
    window.run_steps(1);
    window.key_press(Key::Escape);
    window.run_steps(2);
    assert_eq!(window.state().session().document().source(), source);
    assert_eq!(window.get_by_role_and_label(Role::TextInput, "wavelength").value().as_deref(), Some("5 km"));
}

#[test]
fn choices_switches_and_seeds_are_set() {
    let mut window = selected("alps.ron", "relief");
    window.get_by_role_and_label(Role::CheckBox, "water").click();
    window.run_steps(2);
    assert_eq!(param(&window, "relief", "water"), ParamValue::Bool(false));
    window.state_mut().session_mut().select_only("old");
    window.run_steps(3);
    window.get_by_role_and_label(Role::ComboBox, "mode").click();
    window.run_steps(3);
    window.get_by_label("max").click();
    window.run_steps(3);
    assert_eq!(param(&window, "old", "mode"), ParamValue::Choice("max"));
    window.state_mut().session_mut().select_only("swells");
    window.run_steps(3);
    let before = param(&window, "swells", "seed");
    window.get_by_label("randomise seed").click();
    window.run_steps(3);
    assert_ne!(param(&window, "swells", "seed"), before);
}

#[test]
fn values_are_reset_to_their_defaults() {
    let mut window = selected("hello.ron", "ground");
    fill(&mut window, "octaves", "5");
    assert_eq!(window.query_all_by_label_contains("reset ").count(), 3, "wavelength, amplitude and octaves differ");
    let count = |window: &Harness<'_, App>| window.state().session().document().source().matches("octaves").count();
    assert_eq!(count(&window), 1);
    window.get_by_label("reset octaves").click();
    window.run_steps(3);
    assert_eq!(count(&window), 0);
}

#[test]
fn wires_are_shown_followed_and_removed() {
    let mut window = selected("hello.ron", "rivers");
    window.get_by_label_contains("⬅ rise").click();
    window.run_steps(3);
    assert_eq!(window.state().session().selected(), Some("rise"));
    window.state_mut().session_mut().select_only("rivers");
    window.run_steps(3);
    window.get_by_label("disconnect uplift").click();
    window.run_steps(3);
    let session = window.state().session();
    let index = session.document().graph().find("rivers").expect("there");
    let uplift = session.document().graph().instance(index).node.inputs.iter().position(|input| input.name == "uplift");
    assert_eq!(session.document().graph().source(index, uplift.expect("an input")), None);
}

#[test]
fn an_input_is_wired_from_a_list_of_compatible_outputs() {
    let mut window = window(Some(graph("hello.ron")));
    window
        .state_mut()
        .session_mut()
        .apply(&orograph_graph::Edit::Disconnect { node: "rivers".into(), input: "height".into() });
    window.state_mut().session_mut().select_only("rivers");
    window.run_steps(3);
    // the terrain, and the rock at depth, which is optional
    assert_eq!(window.query_all_by_label("not wired").count(), 2);
    window.get_by_label("wire into height").click();
    window.run_steps(3);
    assert!(window.query_by_role_and_label(Role::Button, "rivers.height").is_none(), "no circle is offered");
    window.get_by_role_and_label(Role::Button, "ground.height").click();
    window.run_steps(3);
    let graph = window.state().session().document().graph();
    let (rivers, ground) = (graph.find("rivers").expect("there"), graph.find("ground").expect("there"));
    assert_eq!(graph.source(rivers, 0), Some(Port { node: ground, output: 0 }));
}

#[test]
fn a_node_is_renamed_and_stays_selected() {
    let mut window = selected("hello.ron", "rivers");
    let name = window.query_all_by_role(Role::TextInput).next().expect("the name comes first");
    assert_eq!(name.value().as_deref(), Some("rivers"));
    name.focus();
    window.run_steps(2);
    window.query_all_by_role(Role::TextInput).next().expect("there").type_text("carved");
    window.run_steps(1);
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert_eq!(window.state().session().selected(), Some("carved"));
    assert!(window.state().session().document().source().contains("\"height\": \"carved\""));
}

#[test]
fn a_value_is_exposed_and_concealed() {
    let mut window = selected("hello.ron", "rivers");
    let before = window.state().session().document().source().to_owned();
    window.get_by_label("menu of duration").click();
    window.run_steps(3);
    window.get_by_label("Expose as parameter").click();
    window.run_steps(3);
    let names = |window: &Harness<'_, App>| {
        let named = window.state().session().document().parameters().iter().map(|named| named.name.clone());
        named.collect::<Vec<_>>()
    };
    assert_eq!(names(&window), ["duration"]);
    // in the inspector of the file it is a row of its own that sets the node's value
    window.state_mut().session_mut().select([]);
    window.run_steps(3);
    fill(&mut window, "duration", "5 Myr");
    assert_eq!(param(&window, "rivers", "duration"), ParamValue::Float(5e6));
    window.state_mut().session_mut().undo();
    window.run_steps(2);
    window.get_by_label("stop exposing duration").click();
    window.run_steps(3);
    assert!(names(&window).is_empty());
    let session = window.state_mut().session_mut();
    session.undo();
    session.undo();
    assert_eq!(session.document().source(), before);
}

#[test]
fn the_world_and_the_outputs_are_edited_while_nothing_is_selected() {
    let mut window = window(Some(graph("hello.ron")));
    window.run_steps(3);
    fill(&mut window, "cells", "300");
    assert_eq!(window.state().session().document().world().cells, [300, 300]);
    fill(&mut window, "seed", "8");
    assert_eq!(window.state().session().document().world().seed, 8);
    let sea = |window: &Harness<'_, App>| window.state().session().document().world().sea_level;
    fill(&mut window, "sea level", "-0.2 km");
    assert_eq!(sea(&window), Some(-200.0));
    fill(&mut window, "sea level", "20 km");
    assert_eq!(sea(&window), Some(-200.0), "refused");
    assert!(window.query_by_label_contains("but must be a length from -12 km to 12 km").is_some());
    fill(&mut window, "sea level", " ");
    assert_eq!(sea(&window), None);
    let before = window.state().session().document().source().to_owned();
    let place = |window: &Harness<'_, App>| window.state().session().document().world().place;
    fill(&mut window, "EPSG code", "32611");
    fill(&mut window, "easting", "378 km");
    fill(&mut window, "northing", "3812345.25");
    let placed = GeoPlace { epsg: 32_611, corner_m: [378_000.0, 3_812_345.25] };
    assert_eq!(place(&window), Some(placed));
    fill(&mut window, "EPSG code", "4326");
    assert_eq!(place(&window), Some(placed), "degrees are refused");
    assert!(window.query_by_label_contains("EPSG:4326 is not a projected coordinate system").is_some());
    fill(&mut window, "EPSG code", " ");
    assert_eq!(place(&window), None);
    window.state_mut().session_mut().undo();
    assert_eq!(place(&window), Some(placed));
    (0..3).for_each(|_| assert!(window.state_mut().session_mut().undo()));
    assert_eq!(window.state().session().document().source(), before);
    window.get_by_role_and_label(Role::ComboBox, "boundary").click();
    window.run_steps(3);
    window.get_by_label("open").click();
    window.run_steps(3);
    assert_eq!(window.state().session().document().world().boundary.west.name(), "open");
    window.get_by_label("➕ output").click();
    window.run_steps(3);
    window.get_by_label("ground.height").click();
    window.run_steps(3);
    let outputs: Vec<String> =
        window.state().session().document().outputs().iter().map(|output| output.name.clone()).collect();
    assert_eq!(outputs, ["height", "ground"]);
}

#[test]
fn points_of_a_curve_are_dragged_and_added() {
    let file = scratch(
        "(world: (cells: 64), nodes: { \"a\": Constant(value: 1), \"b\": Curve(value: \"a\") }, outputs: { \"h\": \"b\" })",
    );
    let mut window = window(Some(file.path().join("graph.ron")));
    window.state_mut().session_mut().select_only("b");
    window.run_steps(4);
    let points = |window: &Harness<'_, App>| match param(window, "b", "points") {
        ParamValue::Curve(points) => points,
        other => panic!("not the points of a curve: {other:?}"),
    };
    let row = window.get_by_label("points").rect();
    let pad = |window: &Harness<'_, App>| {
        let below = window.get_by_label_contains("2 points").rect();
        egui::Rect::from_min_max(
            egui::pos2(row.left(), row.bottom() + 6.0),
            egui::pos2(row.left() + 200.0, below.top() - 4.0),
        )
    };
    let middle = pad(&window).center();
    for _ in 0..2 {
        window.drag_at(middle);
        window.drop_at(middle);
        window.run_steps(1);
    }
    window.run_steps(3);
    assert_eq!(points(&window).len(), 3, "a double click adds a point");
    let steps = window.state().session().document().steps();
    window.drag_at(middle);
    window.run_steps(2);
    for step in 1..6 {
        window.hover_at(middle + egui::vec2(0.0, -4.0 * step as f32));
        window.run_steps(1);
    }
    window.drop_at(middle + egui::vec2(0.0, -20.0));
    window.run_steps(3);
    let (before, after) = (window.state().session().document().steps() - steps, points(&window));
    assert_eq!((before, after.len()), (1, 3));
    assert!(after[1][1] > 500.0 && after[1][0] > after[0][0] && after[2][0] > after[1][0], "{after:?}");
}

#[test]
fn results_are_shown_as_numbers_and_curves() {
    let file = scratch(
        "(world: (size: \"2 km\", cells: 64), nodes: { \"a\": Ridged(wavelength: 900, amplitude: 300), \"m\": Metrics(height: \"a\") }, \
         outputs: { \"h\": \"a\", \"m\": \"m\" })",
    );
    let mut window = window(Some(file.path().join("graph.ron")));
    window.state_mut().session_mut().select_only("a");
    settle(&mut window);
    assert!(window.query_by_label("standard deviation").is_some());
    assert!(window.query_by_label_contains("a.height at 64 cells").is_some());
    window.state_mut().session_mut().select_only("m");
    settle(&mut window);
    assert!(window.query_by_label_contains("m.report at 64 cells").is_some());
    assert!(window.query_by_label("hypsometric integral").is_some());
}

#[test]
fn curves_of_real_land_are_beside_those_of_the_terrain() {
    let file = scratch(
        "(world: (size: \"9 km\", cells: 100), nodes: { \"a\": Ridged(wavelength: 900, amplitude: 300), \
         \"c\": Compare(height: \"a\", kind: highlands) }, outputs: { \"h\": \"a\", \"c\": \"c\" })",
    );
    let mut window = window(Some(file.path().join("graph.ron")));
    window.set_size(egui::vec2(1400.0, 6000.0));
    window.state_mut().session_mut().select_only("c");
    settle(&mut window);
    window.run_steps(3);
    assert!(window.query_by_label("slope histogram").is_some());
    assert!(window.query_all_by_label("this terrain").count() > 4);
    assert!(window.query_all_by_label("glencoe").count() > 4);
}

#[test]
fn a_failure_links_to_the_failed_node() {
    let file = scratch(
        "(world: (cells: 64), nodes: { \"here\": Import(file: \"none.tif\"), \"next\": Slope(height: \"here\") }, \
         outputs: { \"h\": \"next\" })",
    );
    let mut window = window(Some(file.path().join("graph.ron")));
    window.state_mut().session_mut().select_only("next");
    settle(&mut window);
    window.get_by_label("Go to here").click();
    window.run_steps(3);
    assert_eq!(window.state().session().selected(), Some("here"));
}

#[test]
fn parameters_without_effect_are_greyed_out_with_a_reason() {
    crate::draws();
    let file = scratch(
        "(world: (cells: 64), nodes: { \"a\": Ridged(), \"b\": Terrace(height: \"a\") }, outputs: { \"h\": \"b\" })",
    );
    let mut window = window(Some(file.path().join("graph.ron")));
    window.state_mut().session_mut().select_only("b");
    settle(&mut window);
    window.run_steps(4);
    assert!(window.query_by_label("only if steps is layers").is_some(), "layers count only there");
    assert!(window.query_by_label_contains("6 points").is_none(), "and take no room");
    for theme in [egui::Theme::Dark, egui::Theme::Light] {
        window.ctx.set_theme(theme);
        look(&mut window, &format!("resting_{theme:?}_even"));
    }
    let edit = orograph_graph::Edit::SetText { node: "b".into(), name: "steps".into(), text: "layers".into() };
    assert!(window.state_mut().session_mut().apply(&edit));
    settle(&mut window);
    window.run_steps(4);
    assert!(window.query_by_label_contains("6 points").is_some());
    let step = window.get_by_role_and_label(Role::TextInput, "step").rect().center();
    window.hover_at(step);
    until(&mut window, "the reason", |window| {
        window.query_by_label_contains("No effect now: used only if `steps` is `even`").is_some()
    });
    assert!(window.query_by_label_contains("A number; optional units").is_none(), "only one tooltip at a time");
    look(&mut window, "resting_layers");
    // It can still be edited.
    fill(&mut window, "step", "50 m");
    assert_eq!(param(&window, "b", "step"), ParamValue::Float(50.0));
}

#[test]
fn numbers_are_never_cut_and_tooltips_have_the_units() {
    crate::draws();
    let file = scratch(
        "(world: (cells: 32), nodes: { \"a\": Constant(value: -1234567.875), \"r\": StreamPower(height: \"a\", erodibility: 2e-6) }, \
         outputs: { \"h\": \"r\" })",
    );
    let mut window = window(Some(file.path().join("graph.ron")));
    window.state_mut().session_mut().select_only("r");
    settle(&mut window);
    window.run_steps(4);
    let field = |window: &Harness<'_, App>, name: &str| {
        window.get_by_role_and_label(Role::TextInput, name).value().unwrap_or_default()
    };
    let short = field(&window, "erodibility");
    assert!(short.starts_with("2e-6 m") && short.ends_with('…'), "{short}");
    let at = window.get_by_role_and_label(Role::TextInput, "erodibility").rect().center();
    window.hover_at(at);
    until(&mut window, "the tooltip has all of it", |window| {
        window.query_by_label_contains("2e-6 m^(1−2m)/yr").is_some()
    });
    look(&mut window, "units");
    // The focused field shows the whole text, and leaving it changes nothing.
    let before = window.state().session().document().source().to_owned();
    window.get_by_role_and_label(Role::TextInput, "erodibility").focus();
    window.run_steps(3);
    assert_eq!(field(&window, "erodibility"), "2e-6 m^(1−2m)/yr");
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert_eq!(window.state().session().document().source(), before);
    assert_eq!(field(&window, "erodibility"), short);
    fill(&mut window, "erodibility", "3e-6");
    assert!(field(&window, "erodibility").starts_with("3e-6 m"));
    window.state_mut().session_mut().select_only("a");
    settle(&mut window);
    window.run_steps(4);
    assert_eq!(field(&window, "value"), "-1234570");
    look(&mut window, "numbers");
}

#[test]
fn a_note_of_several_lines_is_one_undo_step() {
    crate::draws();
    let mut window = selected("hello.ron", "rivers");
    let before = window.state().session().document().source().to_owned();
    let note = |window: &Harness<'_, App>, node: &str| {
        let nodes = window.state().session().document().nodes().iter();
        nodes.filter(|entry| entry.name == node).map(|entry| entry.note.clone()).collect::<String>()
    };
    let write = |window: &mut Harness<'_, App>, lines: [&str; 2]| {
        window.get_by_label("note").focus();
        window.run_steps(2);
        window.get_by_label("note").type_text(lines[0]);
        window.run_steps(1);
        window.key_press(Key::Enter);
        window.run_steps(1);
        window.get_by_label("note").type_text(lines[1]);
        window.run_steps(2);
    };
    write(&mut window, ["Cut for two million years,", "then left alone."]);
    assert_eq!(note(&window, "rivers"), "", "it is being written");
    for theme in [egui::Theme::Dark, egui::Theme::Light] {
        window.ctx.set_theme(theme);
        look(&mut window, &format!("note_field_{theme:?}"));
    }
    let elsewhere = window.get_by_label("graph").rect().center_bottom() - egui::vec2(0.0, 12.0);
    crate::hand::click(&mut window, elsewhere);
    assert_eq!(note(&window, "rivers"), "Cut for two million years,\nthen left alone.");
    assert_eq!(window.state().session().document().steps(), 1);
    assert!(window.state_mut().session_mut().undo());
    assert_eq!(window.state().session().document().source(), before);
    // Selecting another node at once loses nothing.
    window.state_mut().session_mut().select_only("rivers");
    window.run_steps(3);
    write(&mut window, ["a", "b"]);
    window.state_mut().session_mut().select_only("ground");
    window.run_steps(3);
    assert_eq!([note(&window, "rivers"), note(&window, "ground")], ["a\nb", ""]);
    // Escape discards the typed text.
    write(&mut window, ["c", "d"]);
    window.key_press(Key::Escape);
    window.run_steps(3);
    assert_eq!(note(&window, "ground"), "");
}

#[test]
fn the_planes_of_colours_and_weights_are_named() {
    let mut window = selected("painted.ron", "painted");
    for channel in ["red: ", "green: ", "blue: "] {
        assert!(window.query_by_label_contains(channel).is_some(), "{channel}");
    }
    window.state_mut().session_mut().pin(Some("ground.weights".to_owned()));
    window.state_mut().session_mut().select_only("ground");
    settle(&mut window);
    window.run_steps(3);
    for layer in ["first: ", "fourth: "] {
        assert!(window.query_by_label_contains(layer).is_some(), "{layer}");
    }
}

#[test]
fn a_histogram_says_what_its_axes_measure() {
    crate::draws();
    let mut window = selected("hello.ron", "ground");
    window.set_size(egui::vec2(1280.0, 1500.0));
    window.run_steps(3);
    for theme in [egui::Theme::Dark, egui::Theme::Light] {
        window.ctx.set_theme(theme);
        let (name, area) = {
            let bars = window.get_by_label_contains("histogram: ");
            (bars.accesskit_node().label().unwrap_or_default(), bars.rect())
        };
        assert!(name.contains(" m to ") && name.contains(" % of the cells in a bar"), "{name}");
        assert!(area.height() > 80.0 && area.bottom() < 1480.0, "{area:?}");
        look(&mut window, &format!("histogram_{theme:?}"));
    }
}

#[test]
fn a_single_stroke_is_counted_as_one() {
    let text = "(\n  world: (size: 1000, cells: 32),\n  nodes: {\n    \"a\": Constant(value: 1),\n    \"paint\": Paint(height: \"a\", \
                strokes: [(tool: raise, radius: 80, points: [(100, 100), (200, 200)])]),\n  },\n  outputs: { \"h\": \"paint\" },\n)\n";
    let file = scratch(text);
    let mut window = window(Some(file.path().join("graph.ron")));
    window.state_mut().session_mut().select_only("paint");
    settle(&mut window);
    window.run_steps(4);
    assert!(window.query_by_label("1 stroke").is_some() && window.query_by_label("1 strokes").is_none());
}

#[test]
fn number_fields_calculate_with_units() {
    let mut window = selected("hello.ron", "ground");
    fill(&mut window, "wavelength", "6 km / 4");
    assert_eq!(param(&window, "ground", "wavelength"), ParamValue::Float(1500.0));
    assert!(window.state().session().document().source().contains("wavelength: \"1.5 km\""));
    fill(&mut window, "wavelength", "(2 km + 500) / 3");
    assert_eq!(param(&window, "ground", "wavelength"), ParamValue::Float(833.333333333));
    fill(&mut window, "octaves", "2 * 3");
    assert_eq!(param(&window, "ground", "octaves"), ParamValue::Int(6));
    fill(&mut window, "wavelength", "2 km / 3 km");
    fill(&mut window, "octaves", "7 / 2");
    assert_eq!(param(&window, "ground", "octaves"), ParamValue::Int(6), "not an integer");
    fill(&mut window, "wavelength", "2 km * 3 km");
    assert!(window.query_by_label_contains("is not a unit of a length").is_some(), "a refused text shows the reason");
    // the fields of the file
    window.state_mut().session_mut().select([]);
    window.run_steps(3);
    fill(&mut window, "cells", "128 * 3");
    assert_eq!(window.state().session().document().world().cells, [384, 384]);
}

/// The layers of a table lie above each other to scale, and say what they are.
#[test]
fn a_table_of_layers_is_a_column() {
    let mut window = selected("canyon.ron", "rock");
    let table = param(&window, "rock", "layers");
    let layers = if let ParamValue::Layers(layers) = table { layers } else { Vec::new() };
    assert_eq!(layers.len(), 8, "the table of the graph");
    let total: f64 = layers.iter().map(|layer| layer.thickness).sum();
    let column = window.get_by_role_and_label(Role::Image, "Column of 8 layers").rect();
    assert!(column.height() > 150.0 && column.width() > 100.0, "{column:?}");
    let mut depth = 0.0;
    for (at, layer) in layers.iter().enumerate() {
        let middle = (depth + 0.5 * layer.thickness) / total;
        window.hover_at(egui::pos2(column.left() + 8.0, column.top() + column.height() * middle as f32));
        let unit = orograph_graph::Unit::Metres;
        let says = [
            format!("Layer {}, {} below the top", at + 1, unit.display(depth)),
            format!("{} thick, hardness {}, ", unit.display(layer.thickness), layer.hardness),
        ];
        until(&mut window, &says[0], |window| says.iter().all(|line| window.query_by_label_contains(line).is_some()));
        depth += layer.thickness;
    }
    // a layer less, and the column has one less
    window.get_by_label("remove layer 8").click();
    window.run_steps(3);
    window.get_by_role_and_label(Role::Image, "Column of 7 layers");
}
