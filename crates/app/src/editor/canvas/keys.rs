//! What can be asked for by key or menu.

use std::collections::BTreeSet;

use egui::{Event, EventFilter, Key, KeyboardShortcut, Modifiers, OutputCommand, Response, Ui, Vec2, ViewportCommand};
use orograph_graph::Edit;

use super::{
    Canvas, Session, clip,
    commands::{self, Alignment},
    gesture::Gesture,
    overlay::{Find, Rename},
    palette::{Palette, Purpose},
    place,
};

/// What can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    Add,
    Copy,
    Cut,
    Paste,
    Duplicate,
    Delete,
    SelectAll,
    Align(Alignment),
    Arrange,
    Collapse,
    Rename,
    Mute,
    Frame,
    Show,
    Find,
    Fit,
    FitAll,
    Map,
}

const NONE: Modifiers = Modifiers::NONE;
const COMMAND: Modifiers = Modifiers::COMMAND;

/// The keys, as they are told.
pub(super) const KEYS: [(Command, &str, &str); 17] = [
    (Command::Add, "Tab or Space", "Add a node"),
    (Command::Copy, "Ctrl+C", "Copy as text"),
    (Command::Cut, "Ctrl+X", "Cut"),
    (Command::Paste, "Ctrl+V", "Paste"),
    (Command::Duplicate, "Ctrl+D", "Duplicate"),
    (Command::Delete, "Del", "Delete, and heal the wires"),
    (Command::SelectAll, "Ctrl+A", "Select all"),
    (Command::Arrange, "L", "Arrange"),
    (Command::Collapse, "H", "Collapse or expand"),
    (Command::Rename, "F2", "Name and note"),
    (Command::Mute, "M", "Mute: build as if it were not there"),
    (Command::Frame, "C", "Comment: a frame around the selection"),
    (Command::Show, "V", "Show in the viewport"),
    (Command::Find, "Ctrl+F", "Find a node"),
    (Command::Fit, "F", "Zoom to the selection"),
    (Command::FitAll, "Home", "Zoom to fit all"),
    (Command::Map, "O", "Overview"),
];

/// The keys with what they do, for people.
pub(in crate::editor) fn told() -> impl Iterator<Item = (&'static str, &'static str)> {
    KEYS.iter().map(|(_, keys, what)| (*keys, *what))
}

/// The key of a command, for a menu.
pub(super) fn key_of(command: Command) -> &'static str {
    KEYS.iter().find(|(known, _, _)| *known == command).map_or("", |(_, key, _)| key)
}

/// The command that an event asks for.
fn command_of(event: &Event) -> Option<Command> {
    let Event::Key { key, pressed: true, modifiers, .. } = event else {
        return match event {
            Event::Copy => Some(Command::Copy),
            Event::Cut => Some(Command::Cut),
            _ => None,
        };
    };
    let is = |wanted: Modifiers, keys: &[Key]| {
        keys.iter().any(|wanted_key| {
            let shortcut = KeyboardShortcut::new(wanted, *wanted_key);
            shortcut.logical_key == *key && modifiers.matches_exact(shortcut.modifiers)
        })
    };
    let command = match () {
        () if is(NONE, &[Key::Tab, Key::Space]) => Command::Add,
        () if is(COMMAND, &[Key::D]) => Command::Duplicate,
        () if is(NONE, &[Key::Delete, Key::Backspace]) => Command::Delete,
        () if is(COMMAND, &[Key::A]) => Command::SelectAll,
        () if is(NONE, &[Key::L]) => Command::Arrange,
        () if is(NONE, &[Key::H]) => Command::Collapse,
        () if is(NONE, &[Key::F2]) => Command::Rename,
        () if is(NONE, &[Key::M]) => Command::Mute,
        () if is(NONE, &[Key::C]) => Command::Frame,
        () if is(NONE, &[Key::V]) => Command::Show,
        () if is(COMMAND, &[Key::F]) => Command::Find,
        () if is(NONE, &[Key::F]) => Command::Fit,
        () if is(NONE, &[Key::Home]) => Command::FitAll,
        () if is(NONE, &[Key::O]) => Command::Map,
        () => return None,
    };
    Some(command)
}

impl Canvas {
    /// Takes the keys while the canvas has them: the pointer is over it, and nothing else was asked to have them.
    pub(super) fn keys(&mut self, ui: &Ui, response: &Response, session: &mut Session) {
        let id = response.id;
        let free = ui.memory(|memory| memory.focused().is_none());
        if free && response.contains_pointer() && self.palette.is_none() {
            response.request_focus();
        }
        // The keys follow the pointer to another pane.
        let elsewhere = ui.ctx().pointer_latest_pos().is_some_and(|at| !response.rect.contains(at));
        if elsewhere && matches!(self.gesture, Gesture::Idle) {
            response.surrender_focus();
        }
        if !response.has_focus() {
            return;
        }
        let all = EventFilter { tab: true, horizontal_arrows: true, vertical_arrows: true, escape: false };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(id, all));
        if self.palette.is_some() || self.find.is_some() || self.rename.is_some() {
            return;
        }
        let events = ui.input(|input| input.events.clone());
        let mut events = events.iter();
        while let Some(event) = events.next() {
            if let Event::Paste(text) = event {
                self.paste(ui, session, text);
            } else if let Some(command) = command_of(event) {
                self.run(ui, session, command);
            }
            if let Some(palette) = &mut self.palette {
                // What is typed after the key that opens it is for it, however seldom the window draws.
                for event in events.by_ref() {
                    if let Event::Text(text) = event {
                        palette.typed(text);
                    }
                }
            }
            if self.find.is_some() || self.rename.is_some() {
                return;
            }
            // The next key is about what there is then.
            self.read(session);
        }
    }

    /// Does what was asked for.
    pub(super) fn run(&mut self, ui: &Ui, session: &mut Session, command: Command) {
        let Some(lens) = self.lens else { return };
        let pointer = ui.ctx().pointer_latest_pos().filter(|at| lens.rect.contains(*at));
        let chosen = self.chosen(session);
        let names: BTreeSet<String> = session.selection().map(str::to_owned).collect();
        let some_or_all = || if chosen.len() > 1 { chosen.clone() } else { (0..self.model.cards.len()).collect() };
        match command {
            Command::Add => {
                self.cancel();
                self.gesture = Gesture::Idle;
                let at = pointer.unwrap_or_else(|| lens.rect.center());
                self.palette = Some(Palette::new(at, lens.to_graph(at), Purpose::Add));
                ui.ctx().request_repaint();
            }
            Command::Copy | Command::Cut => {
                if names.is_empty() {
                    return;
                }
                match clip::text(session.document(), &self.model, &names, false) {
                    Ok(text) => ui.ctx().output_mut(|output| output.commands.push(OutputCommand::CopyText(text))),
                    Err(reason) => return self.refuse(ui, reason),
                }
                self.pasted = 0;
                if command == Command::Cut {
                    self.run(ui, session, Command::Delete);
                }
            }
            Command::Paste => ui.ctx().send_viewport_cmd(ViewportCommand::RequestPaste),
            Command::Duplicate => {
                if names.is_empty() {
                    return;
                }
                let shift = Vec2::splat(3.0 * place::STEP);
                let pasted = clip::text(session.document(), &self.model, &names, true)
                    .and_then(|text| clip::paste(session.document(), &text, None, shift));
                self.add(ui, session, pasted);
            }
            Command::Delete => {
                if let Some((wire, at)) = self.bend.clone().filter(|_| names.is_empty() && self.wires.is_empty()) {
                    self.remove_bend(ui, session, &wire, at);
                    return;
                }
                if let Some(name) = self.area.clone().filter(|_| names.is_empty()) {
                    self.apply(ui, session, &Edit::SetFrame { name, frame: None });
                    return;
                }
                if names.is_empty() && self.wires.is_empty() {
                    return;
                }
                let edit = commands::remove(session.document(), &names, &self.wires);
                if self.apply(ui, session, &edit) {
                    self.wires.clear();
                    self.moved = true;
                }
            }
            Command::SelectAll => session.select(self.model.cards.iter().map(|card| card.name.clone())),
            Command::Align(how) => {
                if let Some(edit) = commands::align(&self.model, &chosen, how) {
                    self.apply(ui, session, &edit);
                }
            }
            Command::Arrange => {
                if let Some(edit) = commands::arrange(&self.model, &some_or_all()) {
                    self.apply(ui, session, &edit);
                }
            }
            Command::Collapse => {
                let all = names.iter().all(|name| self.collapsed.contains(name));
                for name in names {
                    if all {
                        self.collapsed.remove(&name);
                    } else {
                        self.collapsed.insert(name);
                    }
                }
                self.seen = None;
            }
            Command::Mute => {
                let muted = !chosen.iter().all(|card| self.model.cards[*card].muted);
                let edits = names.into_iter().map(|node| Edit::SetMuted { node, muted });
                self.apply(ui, session, &Edit::All(edits.collect()));
            }
            Command::Frame => {
                let at = pointer.unwrap_or_else(|| lens.rect.center());
                let name = commands::fresh_name("frame", |name| self.model.area(name).is_some());
                let edit = commands::frame(&self.model, &chosen, &name, lens.to_graph(at));
                if self.apply(ui, session, &edit) {
                    session.select([]);
                    self.moved = true;
                    self.rename = Some(Rename::of_frame(&name, ""));
                    self.area = Some(name);
                    ui.ctx().request_repaint();
                }
            }
            Command::Rename => {
                if let Some(area) = self.area.as_deref().and_then(|name| self.model.area(name)) {
                    let area = &self.model.areas[area];
                    self.rename = Some(Rename::of_frame(&area.name, &area.note));
                    ui.ctx().request_repaint();
                } else if let [card] = chosen[..] {
                    let card = &self.model.cards[card];
                    self.rename = Some(Rename::of_node(&card.name, &card.note));
                    ui.ctx().request_repaint();
                }
            }
            Command::Show => {
                if let [card] = chosen[..] {
                    let card = &self.model.cards[card];
                    let port = card.outputs.first().map(|output| format!("{}.{}", card.name, output.name));
                    let same = port.as_deref() == session.pinned();
                    session.pin(port.filter(|_| !same));
                }
            }
            Command::Find => {
                self.find = Some(Find::default());
                ui.ctx().request_repaint();
            }
            Command::Fit if !names.is_empty() => self.fit(self.model.bounds(|card| names.contains(&card.name))),
            Command::Fit | Command::FitAll => self.fit(self.model.extent()),
            Command::Map => self.without_map = !self.without_map,
        }
    }

    /// Adds the nodes of a text, at the pointer if it is over the pane.
    pub(super) fn paste(&mut self, ui: &Ui, session: &mut Session, text: &str) {
        let Some(lens) = self.lens else { return };
        let pointer = ui.ctx().pointer_latest_pos().filter(|at| lens.rect.contains(*at));
        self.pasted += 1;
        let shift = Vec2::splat(3.0 * place::STEP * self.pasted as f32);
        let at = pointer.map(|at| place::on_grid(lens.to_graph(at)));
        let pasted = clip::paste(session.document(), text, at, shift);
        self.add(ui, session, pasted);
    }

    fn add(&mut self, ui: &Ui, session: &mut Session, pasted: Result<clip::Pasted, String>) {
        match pasted {
            Ok(pasted) => {
                let edits: Vec<Edit> = commands::settle(&self.model).chain(pasted.edits).collect();
                if self.apply(ui, session, &Edit::All(edits)) {
                    self.wires.clear();
                    self.moved = true;
                    session.select(pasted.names);
                }
            }
            Err(reason) => self.refuse(ui, reason),
        }
    }
}
