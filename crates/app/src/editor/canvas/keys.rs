//! Carries out the commands of keys and menus in the graph.

use std::collections::BTreeSet;

use egui::{Event, EventFilter, Key, OutputCommand, Pos2, Response, Ui, Vec2, ViewportCommand};
use orograph_graph::Edit;

use super::{
    Canvas, Session, clip, commands,
    gesture::Gesture,
    lens::Lens,
    overlay::{Find, Rename},
    palette::{Palette, Purpose},
    place, values,
};
use crate::editor::{
    viewport,
    window::actions::{self, Action, Part, Status},
};

/// Number of frames to wait for the clipboard.
const PATIENCE: u8 = 4;
/// Points of the window that an arrow key scrolls by.
const SCROLL: f32 = 60.0;
/// Factor by which a key zooms.
const ZOOM: f32 = 1.2;

impl Canvas {
    /// Handles keys while the canvas has the keyboard: the pointer is over it, and no text field has the focus.
    pub(super) fn keys(&mut self, ui: &Ui, response: &Response, session: &mut Session) {
        let id = response.id;
        let free = !ui.ctx().text_edit_focused();
        // A handle in the viewport keeps the keyboard until the pointer moves.
        let still = ui.input(|input| input.pointer.delta() == Vec2::ZERO && !input.pointer.any_pressed());
        let taken = still && viewport::has_keyboard(ui.ctx());
        if free && !taken && response.contains_pointer() && self.palette.is_none() {
            response.request_focus();
        }
        // The keyboard follows the pointer to another pane.
        let elsewhere = ui.ctx().pointer_latest_pos().is_some_and(|at| !response.rect.contains(at));
        if elsewhere && matches!(self.gesture, Gesture::Idle) {
            response.surrender_focus();
        }
        let mut held = std::mem::replace(&mut self.held, ui.input(|input| input.modifiers));
        let waiting = self.pasting.take();
        self.pasting = waiting.and_then(|(frames, action)| Some((frames.checked_sub(1)?, action)));
        if !response.has_focus() {
            // A menu has requested the clipboard; its content goes to the graph wherever the pointer is.
            let pasted = ui.input(|input| input.events.iter().find(|event| matches!(event, Event::Paste(_))).cloned());
            if let (Some(Event::Paste(text)), Some((_, action))) = (pasted, waiting) {
                self.pasting = None;
                self.paste(ui, session, action, &text);
            }
            return;
        }
        let all = EventFilter { tab: true, horizontal_arrows: true, vertical_arrows: true, escape: false };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(id, all));
        if self.palette.is_some()
            || self.find.is_some()
            || self.rename.is_some()
            || self.new_subgraph.is_some()
            || self.connect.is_some()
        {
            return;
        }
        let events = ui.input(|input| input.events.clone());
        let mut events = events.iter();
        while let Some(event) = events.next() {
            if let Event::ModifiersChanged(modifiers) = event {
                held = *modifiers;
            } else if let Event::Paste(text) = event {
                // The system sends the same event with and without Shift.
                let by_key = if held.command && held.shift { Action::PasteParameters } else { Action::Paste };
                let action = waiting.map_or(by_key, |(_, action)| action);
                self.pasting = None;
                self.paste(ui, session, action, text);
            } else if let Some(action) = actions::asked_by(Part::Graph, event, held) {
                self.run(ui, session, action);
            }
            if let Some(palette) = &mut self.palette {
                // Text typed after the key that opens the palette goes to the palette, however slow the frames are.
                for event in events.by_ref() {
                    if let Event::Text(text) = event {
                        palette.typed(text);
                    }
                }
            }
            if self.find.is_some() || self.rename.is_some() || self.new_subgraph.is_some() || self.connect.is_some() {
                return;
            }
            // The next key applies to the new state.
            self.read(session);
        }
    }

    /// Queues a menu command of the window until the canvas is drawn.
    pub(in crate::editor) const fn ask(&mut self, action: Action) {
        self.asked = Some(action);
    }

    /// Whether a command is available, and whether it is on.
    pub(in crate::editor) fn status(&self, session: &Session, action: Action) -> Status {
        let entries = || session.document().nodes().iter();
        let chosen: Vec<_> = entries().filter(|entry| session.is_selected(&entry.name)).collect();
        let (some, any) = (!chosen.is_empty(), entries().next().is_some());
        match action {
            Action::Cut | Action::Copy | Action::Duplicate | Action::Fit => Status::can(some),
            Action::Delete => Status::can(some || self.area.is_some() || self.bend.is_some() || !self.wires.is_empty()),
            Action::SelectAll | Action::Find | Action::Arrange | Action::FullSize => Status::can(any),
            Action::FitAll => Status::can(any || !session.document().frames().is_empty()),
            Action::CopyParameters => Status::can(chosen.len() == 1 && chosen[0].index.is_some()),
            Action::PasteParameters | Action::Connect => Status::can(some),
            Action::Align(_) => Status::can(chosen.len() > 1),
            Action::Subgraph => Status::can(some && chosen.iter().all(|entry| entry.index.is_some())),
            Action::Inline => {
                let node = chosen.first().filter(|_| chosen.len() == 1).and_then(|entry| entry.index);
                Status::can(node.is_some_and(|node| session.document().subgraph(node).is_some()))
            }
            Action::Rename => Status::can(self.area.is_some() || chosen.len() == 1),
            Action::Mute => Status::switch(some, some && chosen.iter().all(|entry| entry.muted)),
            Action::Collapse => {
                Status::switch(some, some && chosen.iter().all(|entry| self.collapsed.contains(&entry.name)))
            }
            Action::PinToViewport => {
                let pinned = session.pinned().and_then(|pinned| pinned.split_once('.'));
                let on = pinned.is_some_and(|(node, _)| chosen.iter().any(|entry| entry.name == node));
                Status::switch(chosen.len() == 1, on)
            }
            Action::Overview => Status::switch(true, !self.without_map),
            _ => Status::can(true),
        }
    }

    /// Carries out a command.
    pub(super) fn run(&mut self, ui: &Ui, session: &mut Session, action: Action) {
        let Some(lens) = self.lens else { return };
        let chosen = self.chosen(session);
        let names: BTreeSet<String> = session.selection().map(str::to_owned).collect();
        match action {
            Action::Add => self.ask_for_node(ui, lens),
            Action::Copy | Action::Cut => {
                let copied = self.copy(ui, session, &names);
                if copied && action == Action::Cut {
                    self.delete(ui, session, &names);
                }
            }
            Action::CopyParameters => self.copy_parameters(ui, session, &chosen),
            Action::Paste | Action::PasteParameters => {
                self.pasting = Some((PATIENCE, action));
                ui.ctx().send_viewport_cmd(ViewportCommand::RequestPaste);
            }
            Action::Duplicate => self.duplicate(ui, session, &names),
            Action::Delete => self.delete(ui, session, &names),
            Action::SelectAll => session.select(self.model.cards.iter().map(|card| card.name.clone())),
            Action::Align(how) => {
                if let Some(edit) = commands::align(&self.model, &chosen, how) {
                    self.apply(ui, session, &edit);
                }
            }
            Action::Subgraph if self.status(session, action).enabled => self.ask_subgraph(ui, session),
            Action::Inline if self.status(session, action).enabled => self.inline(ui, session),
            Action::Arrange => {
                let cards = if chosen.len() > 1 { chosen } else { (0..self.model.cards.len()).collect() };
                if let Some(edit) = commands::arrange(&self.model, &cards) {
                    self.apply(ui, session, &edit);
                }
            }
            Action::Connect => self.ask_for_wire(ui, &chosen),
            Action::Move(way) if chosen.is_empty() => {
                self.lens = Some(Lens { centre: lens.centre + SCROLL / lens.zoom * way.vector(), ..lens });
                self.moved = true;
            }
            Action::Move(way) => self.nudge(session, names, place::STEP * way.vector()),
            Action::ZoomIn | Action::ZoomOut => {
                let factor = if action == Action::ZoomIn { ZOOM } else { 1.0 / ZOOM };
                let mut closer = lens;
                closer.zoom_at(lens.rect.center(), factor);
                self.lens = Some(closer);
                self.moved = true;
            }
            Action::Collapse => self.collapse(names),
            Action::Mute => {
                let muted = !chosen.iter().all(|card| self.model.cards[*card].muted);
                let edits = names.into_iter().map(|node| Edit::SetMuted { node, muted });
                self.apply(ui, session, &Edit::All(edits.collect()));
            }
            Action::Frame => self.frame(ui, session, lens, &chosen),
            Action::Rename => self.ask_for_name(ui, &chosen),
            Action::PinToViewport => {
                if let [card] = chosen[..] {
                    let card = &self.model.cards[card];
                    let port = card.outputs.first().map(|output| format!("{}.{}", card.name, output.name));
                    let same = port.as_deref() == session.pinned();
                    session.pin(port.filter(|_| !same));
                }
            }
            Action::Find => {
                self.find = Some(Find::default());
                ui.ctx().request_repaint();
            }
            Action::FullSize => {
                self.lens = Some(Lens { zoom: 1.0, ..lens });
                self.moved = true;
            }
            Action::Fit if !names.is_empty() => self.fit(self.model.bounds(|card| names.contains(&card.name))),
            Action::Fit | Action::FitAll => self.fit(self.model.extent()),
            Action::Overview => self.without_map = !self.without_map,
            // Carried out elsewhere.
            _ => {}
        }
    }

    /// Moves nodes, with the routes of the wires among them. One undo step goes on while an arrow key is held.
    fn nudge(&mut self, session: &mut Session, names: BTreeSet<String>, step: Vec2) {
        if self.nudged.as_ref().is_none_or(|(moved, _)| *moved != names) {
            session.end_gesture();
            self.nudged = Some((names.clone(), commands::settle(&self.model).collect()));
        }
        let settled = self.nudged.iter().flat_map(|(_, edits)| edits.iter().cloned());
        let chosen = names.iter().filter_map(|name| self.model.find(name)).map(|card| &self.model.cards[card]);
        let moved = chosen.map(|card| commands::put(&card.name, card.at + step));
        let ways = self.model.ways_among(|name| names.contains(name)).into_iter().map(|(wire, places)| {
            let places: Vec<Pos2> = places.into_iter().map(|place| place + step).collect();
            commands::way(&self.model.wire_name(&self.model.wires[wire]), &places)
        });
        let edit = Edit::All(settled.chain(moved).chain(ways).collect());
        session.gesture(&edit);
        self.moved = true;
    }

    /// Ends the undo step of [`Self::nudge`] once no arrow key is held.
    pub(super) fn end_nudge(&mut self, ui: &Ui, session: &mut Session) {
        let arrows = [Key::ArrowLeft, Key::ArrowRight, Key::ArrowUp, Key::ArrowDown];
        if self.nudged.is_some() && !ui.input(|input| arrows.iter().any(|key| input.key_down(*key))) {
            self.nudged = None;
            session.end_gesture();
        }
    }

    /// Opens the palette at the pointer.
    fn ask_for_node(&mut self, ui: &Ui, lens: Lens) {
        self.cancel();
        self.gesture = Gesture::Idle;
        let at = pointer(ui, lens).unwrap_or_else(|| lens.rect.center());
        self.palette = Some(Palette::new(at, lens.to_graph(at), Purpose::Add));
        ui.ctx().request_repaint();
    }

    /// Copies nodes as text; returns true if there are some.
    fn copy(&mut self, ui: &Ui, session: &Session, names: &BTreeSet<String>) -> bool {
        if names.is_empty() {
            return false;
        }
        match clip::text(session.document(), &self.model, names) {
            Ok(text) => ui.ctx().output_mut(|output| output.commands.push(OutputCommand::CopyText(text))),
            Err(reason) => {
                self.refuse(ui, reason);
                return false;
            }
        }
        self.pasted = 0;
        true
    }

    fn copy_parameters(&mut self, ui: &Ui, session: &Session, chosen: &[usize]) {
        let [card] = *chosen else {
            return self.refuse(ui, "select one node to copy its parameters".to_owned());
        };
        match values::copied(session.document(), &self.model, &self.model.cards[card]) {
            Ok(text) => ui.ctx().output_mut(|output| output.commands.push(OutputCommand::CopyText(text))),
            Err(reason) => self.refuse(ui, reason),
        }
    }

    fn duplicate(&mut self, ui: &Ui, session: &mut Session, names: &BTreeSet<String>) {
        if names.is_empty() {
            return;
        }
        let shift = Vec2::splat(3.0 * place::STEP);
        let pasted = clip::text(session.document(), &self.model, names)
            .and_then(|text| clip::paste(session.document(), &text, None, shift));
        self.add(ui, session, pasted);
    }

    /// Deletes the selected nodes and wires; without any, the selected bend or frame.
    fn delete(&mut self, ui: &Ui, session: &mut Session, names: &BTreeSet<String>) {
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
        let edit = commands::remove(session.document(), names, &self.wires);
        if self.apply(ui, session, &edit) {
            self.wires.clear();
            self.moved = true;
        }
    }

    /// Collapses nodes, or expands them if all are collapsed.
    fn collapse(&mut self, names: BTreeSet<String>) {
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

    /// Adds a frame around nodes and asks for its name.
    fn frame(&mut self, ui: &Ui, session: &mut Session, lens: Lens, chosen: &[usize]) {
        let at = pointer(ui, lens).unwrap_or_else(|| lens.rect.center());
        let name = orograph_graph::fresh_name("frame", |name| self.model.area(name).is_some());
        let edit = commands::frame(&self.model, chosen, &name, lens.to_graph(at), lens.seen());
        if self.apply(ui, session, &edit) {
            session.select([]);
            self.moved = true;
            self.rename = Some(Rename::of_frame(&name, ""));
            self.area = Some(name);
            ui.ctx().request_repaint();
        }
    }

    /// Asks for the name of the selected frame or node.
    fn ask_for_name(&mut self, ui: &Ui, chosen: &[usize]) {
        if let Some(area) = self.area.as_deref().and_then(|name| self.model.area(name)) {
            let area = &self.model.areas[area];
            self.rename = Some(Rename::of_frame(&area.name, &area.note));
            ui.ctx().request_repaint();
        } else if let [card] = *chosen {
            let card = &self.model.cards[card];
            self.rename = Some(Rename::of_node(&card.name, &card.note));
            ui.ctx().request_repaint();
        }
    }

    /// Pastes the nodes of a text, at the pointer if it is over the pane, or their parameters.
    fn paste(&mut self, ui: &Ui, session: &mut Session, action: Action, text: &str) {
        if action == Action::PasteParameters {
            self.paste_parameters(ui, session, text);
            return;
        }
        let Some(lens) = self.lens else { return };
        self.pasted += 1;
        let shift = Vec2::splat(3.0 * place::STEP * self.pasted as f32);
        let at = pointer(ui, lens).map(|at| place::on_grid(lens.to_graph(at)));
        let pasted = clip::paste(session.document(), text, at, shift);
        self.add(ui, session, pasted);
    }

    /// Gives the selected nodes the parameters in a text.
    fn paste_parameters(&mut self, ui: &Ui, session: &mut Session, text: &str) {
        let names: BTreeSet<String> = session.selection().map(str::to_owned).collect();
        if names.is_empty() {
            return;
        }
        match values::pasted(session.document(), text, &names) {
            Ok(pasted) => {
                let message = pasted.message();
                if pasted.edits.is_empty() {
                    return session.note(message, false);
                }
                if self.apply(ui, session, &Edit::All(pasted.edits)) {
                    session.note(message, false);
                }
            }
            Err(reason) => self.refuse(ui, reason),
        }
    }

    pub(super) fn add(&mut self, ui: &Ui, session: &mut Session, pasted: Result<clip::Pasted, String>) {
        match pasted {
            Ok(pasted) => {
                let left = pasted.message();
                let edits: Vec<Edit> = commands::settle(&self.model).chain(pasted.edits).collect();
                if self.apply(ui, session, &Edit::All(edits)) {
                    if let Some(left) = left {
                        session.note(left, false);
                    }
                    self.wires.clear();
                    self.moved = true;
                    self.added.clone_from(&pasted.names);
                    session.select(pasted.names);
                }
            }
            Err(reason) => self.refuse(ui, reason),
        }
    }
}

/// The pointer, if it is over the pane.
fn pointer(ui: &Ui, lens: Lens) -> Option<Pos2> {
    ui.ctx().pointer_latest_pos().filter(|at| lens.rect.contains(*at))
}
