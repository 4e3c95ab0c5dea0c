//! The export window writes the same files as the command line that it shows.

use std::path::Path;

use egui::{Key, Modifiers, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::{
    editor::{Answer, App, FileCommand},
    export::engine::Engine,
};
use orograph_graph::{Edit, World};

use crate::{look, scratch, until, window};

const GRAPH: &str = "(world: (size: \"1 km\", cells: 64, seed: 3), nodes: { \"land\": Ridged(wavelength: 400, amplitude: 90), \
                     \"steep\": Slope(height: \"land\") }, outputs: { \"height\": \"land\", \"steep\": \"steep.mask\" })";

/// A window on the graph above, with the export window open.
fn exporting(file: &Path, folder: &Path) -> Harness<'static, App> {
    let mut window = window(Some(file.to_owned()));
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    window.run_steps(4);
    type_folder(&mut window, folder);
    window
}

/// Types the folder of the files.
fn type_folder(window: &mut Harness<'_, App>, folder: &Path) {
    window.get_by_role_and_label(Role::TextInput, "Folder").focus();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.run_steps(1);
    window.get_by_role_and_label(Role::TextInput, "Folder").type_text(&folder.display().to_string());
    window.run_steps(2);
}

/// The typed or proposed folder.
fn folder(window: &Harness<'_, App>) -> String {
    window.get_by_role_and_label(Role::TextInput, "Folder").value().unwrap_or_default()
}

/// Presses the button and waits for the files.
fn export(window: &mut Harness<'_, App>) {
    window.get_by_role_and_label(Role::Button, "Export").click();
    until(window, "files are written", |window| window.query_by_label_contains("Wrote ").is_some());
}

#[test]
fn the_copied_command_line_writes_the_same_files() {
    let folder = scratch(GRAPH);
    let (file, out) = (folder.path().join("graph.ron"), folder.path().join("engine"));
    let mut window = exporting(&file, &out);
    window.get_by_role_and_label(Role::CheckBox, "steep").click();
    window.run_steps(3);
    // the first of the combo boxes that show `none`
    let engines = window.get_all_by_role(Role::ComboBox).find(|combo| combo.value().as_deref() == Some("none"));
    engines.expect("a choice of engines").click();
    window.run_steps(3);
    let format = |window: &Harness<'_, App>| window.get_by_role_and_label(Role::ComboBox, "Format").value();
    assert_eq!(format(&window).as_deref(), Some("exr"));
    window.get_by_label(Engine::Unreal.title()).click();
    window.run_steps(3);
    assert_eq!(format(&window).as_deref(), Some("set by the engine"), "a height is a PNG for this engine");
    window.get_by_label("Copy the command line").click();
    window.step();
    let copied = window.output().platform_output.commands.iter().find_map(|command| match command {
        egui::OutputCommand::CopyText(text) => Some(text.clone()),
        _ => None,
    });
    let line = copied.expect("a text is copied");
    export(&mut window);
    let written = |folder: &Path| {
        let mut names: Vec<String> = std::fs::read_dir(folder)
            .expect("a folder")
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    };
    let again = folder.path().join("again");
    let line = line.replace(&out.display().to_string(), &again.display().to_string());
    assert!(line.contains("--only height"), "{line}");
    let words = line.split(' ').map(std::ffi::OsString::from).chain(["--quiet".into()]);
    orograph::run(words);
    assert_eq!(written(&out), ["height.png", "height.png.json", "height.preview.png", "unreal.txt"]);
    assert!(window.query_by_label_contains("Wrote 4 files, 1 of them JSON descriptions").is_some());
    assert_eq!(written(&again), written(&out));
    for name in written(&out) {
        assert_eq!(
            std::fs::read(out.join(&name)).expect("there"),
            std::fs::read(again.join(&name)).expect("there"),
            "{name}"
        );
    }
}

#[test]
fn a_refused_export_shows_the_reason() {
    let folder = scratch(GRAPH);
    let file = folder.path().join("graph.ron");
    // the folder is a file
    let mut window = exporting(&file, &file);
    window.get_by_role_and_label(Role::Button, "Export").click();
    let message = "cannot write to the folder";
    // in the list of exports and as a message
    until(&mut window, "the failure is shown", |window| window.query_all_by_label_contains(message).count() == 2);
    assert_eq!(std::fs::read_to_string(&file).expect("there"), GRAPH);
    for output in ["height", "steep"] {
        window.get_by_role_and_label(Role::CheckBox, output).click();
        window.run_steps(2);
    }
    window.get_by_role_and_label(Role::Button, "Export").click();
    window.run_steps(3);
    assert!(window.query_by_label_contains("no output is chosen").is_some());
}

/// A new graph without a name, with another terrain.
fn new_graph(window: &mut Harness<'_, App>, value: &str) {
    let session = window.state_mut().session_mut();
    if session.is_dirty() {
        session.request(FileCommand::New);
        session.answer(Answer::Discard);
    } else {
        session.request(FileCommand::New);
    }
    let node = || "land".to_owned();
    assert!(session.apply(&Edit::AddNode { name: node(), kind: "Constant".to_owned(), at: None }));
    assert!(session.apply(&Edit::SetText { node: node(), name: "value".to_owned(), text: value.to_owned() }));
    let world = World { cells: [32, 32], ..session.document().world() };
    assert!(session.apply(&Edit::SetWorld(world)));
    assert!(session.apply(&Edit::SetOutput { name: "height".to_owned(), from: node() }));
    window.run_steps(4);
}

#[test]
fn an_export_does_not_replace_the_files_of_another_graph_unasked() {
    let place = scratch(GRAPH);
    let [out, other] = ["out", "out 2"].map(|name| place.path().join(name));
    let mut window = exporting(&place.path().join("graph.ron"), &out);
    export(&mut window);
    let height = |folder: &Path| std::fs::read(folder.join("height.exr")).expect("there");
    let first = height(&out);
    let press = |window: &mut Harness<'_, App>, button: &str| {
        window.get_by_role_and_label(Role::Button, button).click();
        window.run_steps(4);
    };

    // another graph has another folder, and typing that of the first one asks
    new_graph(&mut window, "7");
    assert_ne!(folder(&window), out.display().to_string());
    type_folder(&mut window, &out);
    press(&mut window, "Export");
    let question = "The export would replace 3 files that this graph has not written: height.exr";
    assert!(window.query_by_label_contains(question).is_some());
    look(&mut window, "replace");
    press(&mut window, "Cancel this export");
    assert!(window.query_by_label_contains(question).is_none());
    press(&mut window, "Export");
    // the remedy: a folder that is free
    press(&mut window, "Export to “out 2”");
    until(&mut window, "the second graph is written", |_| other.join("height.exr").is_file());
    let second = height(&other);
    assert!(second != first && height(&out) == first);
    assert_eq!(folder(&window), other.display().to_string());
    assert!(window.query_all_by_label_contains("Untitled to out 2").next().is_some());

    // its own files are replaced without a question, those of the first one after it
    let edit = Edit::SetText { node: "land".to_owned(), name: "value".to_owned(), text: "8".to_owned() };
    assert!(window.state_mut().session_mut().apply(&edit));
    press(&mut window, "Export");
    assert!(window.query_by_label("Replace them").is_none());
    // files are missing for a moment while others replace them
    let is_other =
        |folder: &Path, before: &[u8]| std::fs::read(folder.join("height.exr")).is_ok_and(|now| now != before);
    until(&mut window, "they are replaced", |_| is_other(&other, &second));
    type_folder(&mut window, &out);
    press(&mut window, "Export");
    assert_eq!(height(&out), first);
    press(&mut window, "Replace them");
    until(&mut window, "they are replaced", |_| is_other(&out, &first));

    // the list of exports gives the third graph another name
    new_graph(&mut window, "9");
    type_folder(&mut window, &other);
    press(&mut window, "Export");
    assert!(window.query_by_label("Replace them").is_some());
    press(&mut window, "Replace them");
    until(&mut window, "the list names it", |window| {
        window.query_all_by_label_contains("Untitled 2 to out 2").next().is_some()
    });
}

/// A graph that takes some seconds to build.
const SLOW: &str = "(world: (size: \"20 km\", cells: 1536, seed: 3), nodes: { \"land\": Ridged(), \
                    \"rivers\": StreamPower(version: 9, height: \"land\", duration: \"900 kyr\") }, outputs: { \"height\": \"rivers\" })";

#[test]
fn builds_wait_for_each_other_and_can_be_cancelled() {
    crate::draws();
    let folder = scratch(SLOW);
    let out = |name: &str| folder.path().join(name);
    let mut window = exporting(&folder.path().join("graph.ron"), &out("first"));
    window.state_mut().session_mut().set_cells(32);
    assert!(!window.state().session().document().has_errors());
    let export = |window: &mut Harness<'_, App>| {
        window.get_by_role_and_label(Role::Button, "Export").click();
        window.run_steps(3);
    };
    export(&mut window);
    for name in ["second", "third"] {
        type_folder(&mut window, &out(name));
        export(&mut window);
    }
    assert!(window.query_by_label_contains("Wrote ").is_none(), "the first build is too fast for this test");
    assert_eq!(window.get_all_by_label("Waiting").count(), 2);
    assert!(window.query_by_label_contains("2 waiting").is_some(), "the status bar tells");
    for theme in [egui::Theme::Light, egui::Theme::Dark] {
        window.ctx.set_theme(theme);
        look(&mut window, &format!("queue_{theme:?}"));
    }
    // Closing the window asks first.
    window.key_press_modifiers(Modifiers::COMMAND, Key::Q);
    window.run_steps(3);
    assert!(window.query_by_label("Cancel the exports?").is_some());
    window.get_by_label("Keep exporting").click();
    window.run_steps(3);
    assert!(window.query_by_label("Cancel the exports?").is_none());
    // Cancels the build that waits last.
    window.get_all_by_label_contains("Cancel the export").next_back().expect("a button").click();
    window.run_steps(3);
    assert_eq!(window.get_all_by_label("Waiting").count(), 1);
    // Cancels the running one; the next one starts.
    window.get_all_by_label_contains("Cancel the export").next().expect("a button").click();
    until(&mut window, "the second build starts", |window| window.query_by_label("Waiting").is_none());
    let mut attention = false;
    until(&mut window, "the second build ends", |window| {
        let asked = egui::ViewportCommand::RequestUserAttention(egui::UserAttentionType::Informational);
        let mut viewports = window.output().viewport_output.values();
        attention |= viewports.any(|viewport| viewport.commands.contains(&asked));
        window.query_by_label_contains("Wrote 3 files").is_some()
    });
    assert!(attention, "the window asks for attention at the end");
    assert!(window.query_by_label_contains("Exported 3 files to").is_some(), "a message tells");
    look(&mut window, "queue_done");
    assert!(out("second").join("height.exr").is_file());
    assert!(!out("first").exists() && !out("third").exists());
}
