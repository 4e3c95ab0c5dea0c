//! The export window writes the same files as the command line that it shows.

use std::path::Path;

use egui::{Key, Modifiers, accesskit::Role};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::{editor::App, export::engine::Engine};

use crate::{scratch, until, window};

const GRAPH: &str = "(world: (size: \"1 km\", cells: 64, seed: 3), nodes: { \"land\": Ridged(wavelength: 400, amplitude: 90), \
                     \"steep\": Slope(height: \"land\") }, outputs: { \"height\": \"land\", \"steep\": \"steep.mask\" })";

/// A window on the graph above, with the export window open.
fn exporting(file: &Path, folder: &Path) -> Harness<'static, App> {
    let mut window = window(Some(file.to_owned()));
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::E);
    window.run_steps(4);
    window.get_by_role_and_label(Role::TextInput, "Folder").focus();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.run_steps(1);
    window.get_by_role_and_label(Role::TextInput, "Folder").type_text(&folder.display().to_string());
    window.run_steps(2);
    window
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
    window.get_by_label(Engine::Unreal.title()).click();
    window.run_steps(3);
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
    until(&mut window, "the failure is shown", |window| window.query_by_label_contains(message).is_some());
    assert_eq!(std::fs::read_to_string(&file).expect("there"), GRAPH);
    for output in ["height", "steep"] {
        window.get_by_role_and_label(Role::CheckBox, output).click();
        window.run_steps(2);
    }
    window.get_by_role_and_label(Role::Button, "Export").click();
    window.run_steps(3);
    assert!(window.query_by_label_contains("no output is chosen").is_some());
}
