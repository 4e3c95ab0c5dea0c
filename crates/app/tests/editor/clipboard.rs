//! Nodes copied as text and pasted.

use egui::{Event, Key, Modifiers};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

use crate::{
    canvas::{ROW, document, selection, source_of, window_on},
    hand::{click, click_with, key, title},
    picture, settle,
};

/// The clipboard text of a copy of the selection.
fn copied(window: &mut Harness<'_, App>) -> String {
    window.event(Event::Copy);
    window.step();
    let text = window.output().platform_output.commands.iter().find_map(|command| match command {
        egui::OutputCommand::CopyText(text) => Some(text.clone()),
        _ => None,
    });
    text.expect("a text was copied")
}

#[test]
fn nodes_are_copied_as_text_and_pasted() {
    let (mut window, _folder) = window_on(ROW);
    let ground_node = title(&window, "ground");
    click(&mut window, ground_node);
    let steps = title(&window, "steps");
    click_with(&mut window, steps, Modifiers::COMMAND);
    let copied = copied(&mut window);
    assert!(copied.contains("Terrace(height: \"ground\")"), "{copied}");
    window.event(Event::Paste(copied));
    window.run_steps(3);
    assert_eq!(selection(&window), ["ground2", "steps2"]);
    assert_eq!(source_of(&window, "steps2", 0).as_deref(), Some("ground2.height"));
    assert_eq!(document(&window).steps(), 1);
    key(&mut window, Modifiers::COMMAND, Key::D);
    assert_eq!(selection(&window), ["ground3", "steps3"]);
    window.event(Event::Paste("a hill".to_owned()));
    window.run_steps(3);
    assert_eq!(document(&window).nodes().len(), 8);
    key(&mut window, Modifiers::COMMAND, Key::A);
    assert_eq!(selection(&window).len(), 8);
}

#[test]
fn a_copy_keeps_the_wires_into_it() {
    let (mut window, _folder) = window_on(ROW);
    settle(&mut window);
    let steps = title(&window, "steps");
    click(&mut window, steps);
    let copied = copied(&mut window);
    window.event(Event::Paste(copied.clone()));
    window.run_steps(3);
    assert_eq!(source_of(&window, "steps2", 0).as_deref(), Some("ground.height"));
    assert!(window.query_by_label_contains("left out").is_none());
    window.event(Event::Paste(copied.replace("\"ground\"", "\"rock\"")));
    window.run_steps(3);
    assert_eq!(source_of(&window, "steps3", 0), None);
    assert!(
        window.query_by_label_contains("One wire was left out: no compatible output here is named `rock`").is_some()
    );
    picture(&mut window, "left_out");
}
