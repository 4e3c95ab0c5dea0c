//! Mouse and keyboard input.

use egui::{Event, Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::App;

/// The centre of the widget with this name, in the window.
pub fn at(window: &Harness<'_, App>, label: &str) -> Pos2 {
    window.get_by_label(label).rect().center()
}

/// The centre of a node's title.
pub fn title(window: &Harness<'_, App>, label: &str) -> Pos2 {
    let rect = window.get_by_label_contains(&format!("node {label}:")).rect();
    rect.center_top() + vec2(-8.0, 8.0)
}

pub fn button(window: &mut Harness<'_, App>, pos: Pos2, button: PointerButton, pressed: bool, modifiers: Modifiers) {
    window.event_modifiers(Event::PointerButton { pos, button, pressed, modifiers }, modifiers);
    window.step();
}

pub fn click_with(window: &mut Harness<'_, App>, pos: Pos2, modifiers: Modifiers) {
    window.hover_at(pos);
    window.step();
    button(window, pos, PointerButton::Primary, true, modifiers);
    button(window, pos, PointerButton::Primary, false, modifiers);
    // Two clicks must not count as a double-click.
    window.run_steps(30);
}

pub fn click(window: &mut Harness<'_, App>, pos: Pos2) {
    click_with(window, pos, Modifiers::NONE);
}

pub fn drag_with(window: &mut Harness<'_, App>, from: Pos2, to: Pos2, modifiers: Modifiers) {
    window.hover_at(from);
    window.step();
    button(window, from, PointerButton::Primary, true, modifiers);
    for step in 1..=4 {
        window.event_modifiers(Event::PointerMoved(from.lerp(to, step as f32 / 4.0)), modifiers);
        window.step();
    }
    button(window, to, PointerButton::Primary, false, modifiers);
    window.run_steps(2);
}

/// Presses the button and moves the pointer in steps, without letting go; looks at the window after each.
pub fn pull(window: &mut Harness<'_, App>, [from, to]: [Pos2; 2], steps: u32, each: impl Fn(&Harness<'_, App>)) {
    window.hover_at(from);
    window.step();
    button(window, from, PointerButton::Primary, true, Modifiers::NONE);
    for step in 1..=steps {
        window.hover_at(from.lerp(to, step as f32 / steps as f32));
        window.step();
        each(window);
    }
}

pub fn drag(window: &mut Harness<'_, App>, from: Pos2, to: Pos2) {
    drag_with(window, from, to, Modifiers::NONE);
}

/// Presses a key with the pointer over the graph.
pub fn key(window: &mut Harness<'_, App>, modifiers: Modifiers, key: Key) {
    window.key_press_modifiers(modifiers, key);
    window.run_steps(3);
}

pub fn type_text(window: &mut Harness<'_, App>, text: &str) {
    window.event(Event::Text(text.to_owned()));
    window.run_steps(2);
}

/// Turns the wheel by this many steps.
pub fn wheel(window: &mut Harness<'_, App>, steps: f32) {
    let (unit, phase) = (egui::MouseWheelUnit::Line, egui::TouchPhase::Move);
    window.event(Event::MouseWheel { unit, delta: vec2(0.0, steps), phase, modifiers: Modifiers::NONE });
    window.run_steps(3);
}
