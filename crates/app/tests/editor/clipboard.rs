//! Nodes copied as text and pasted.

use egui::{Event, Key, Modifiers};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

use crate::{
    canvas::{ROW, document, selection, source_of, window_on},
    hand::{click, click_with, key, title},
    look, settle,
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
fn parameters_are_copied_to_nodes_of_the_same_kind() {
    crate::draws();
    let text = ROW
        .replace("Terrace(", "Terrace(version: 2, ")
        .replace("height: \"ground\"),\n        \"lonely", "height: \"ground\", step: 70),\n        \"lonely");
    let (mut window, _folder) = window_on(&text);
    let step = |window: &Harness<'_, App>, name: &str| {
        let graph = document(window).graph();
        graph.instance(graph.find(name).expect("it is there")).params.read::<f64>("step")
    };
    let default = step(&window, "lonely");
    let steps = title(&window, "steps");
    click(&mut window, steps);
    // The system sends Copy and Paste with and without Shift.
    let shift = Modifiers::COMMAND | Modifiers::SHIFT;
    window.event(Event::ModifiersChanged(shift));
    let copied = copied(&mut window);
    window.event(Event::ModifiersChanged(Modifiers::NONE));
    assert!(copied.contains("step: 70") && !copied.contains("ground"), "{copied}");
    let lonely = title(&window, "lonely");
    click(&mut window, lonely);
    let place = title(&window, "place");
    click_with(&mut window, place, Modifiers::COMMAND);
    window.event_modifiers(Event::Paste(copied.clone()), shift);
    window.run_steps(3);
    assert_ne!(default, 70.0);
    assert_eq!(step(&window, "lonely"), 70.0);
    assert_eq!(source_of(&window, "lonely", 0), None);
    let said = "Set the parameters of 1 node; 1 node of another kind was left as it is";
    assert!(window.query_by_label_contains(said).is_some());
    assert_eq!((document(&window).steps(), document(&window).nodes().len()), (1, 4));
    look(&mut window, "parameters_pasted");
    key(&mut window, Modifiers::COMMAND, Key::Z);
    assert_eq!(document(&window).source(), text);
    // From the menu, where the clipboard comes some frames later.
    click(&mut window, lonely);
    window.get_by_label("Edit").click();
    window.run_steps(3);
    window.get_by_label_contains("Paste parameters").click();
    window.step();
    window.event(Event::Paste(copied));
    window.run_steps(3);
    assert_eq!(step(&window, "lonely"), 70.0);
    // Without Shift, and with Shift+Insert, the node is pasted.
    for (modifiers, nodes) in [(Modifiers::NONE, 5), (Modifiers::SHIFT, 6)] {
        click(&mut window, lonely);
        window.event_modifiers(Event::Paste("{ \"x\": Terrace(version: 2, step: 33) }".to_owned()), modifiers);
        window.run_steps(3);
        assert_eq!(document(&window).nodes().len(), nodes);
    }
}

#[test]
fn a_copy_keeps_the_wires_into_it() {
    crate::draws();
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
    look(&mut window, "left_out");
}
