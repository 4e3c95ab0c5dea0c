//! Overlays of the canvas: tooltips, the legend, the search and renaming.

use egui::{Align2, FontId, Id, Key, Modifiers, Pos2, Rect, Response, RichText, Sense, Stroke, Ui, Vec2, vec2};
use orograph_graph::{Edit, bytes};

use super::{
    super::session::NodeState,
    Canvas, Gesture, Session,
    hit::Hit,
    list::ListKeys,
    look::{Look, MEANINGS},
    model::{Side, Spot, TITLE},
    overview::MARGIN,
    paint::{Brush, legend, span},
};
use crate::editor::window::{
    actions::{self, Part},
    names::Named as _,
};

/// The open search for a node.
#[derive(Debug, Default)]
pub(super) struct Find {
    query: String,
    /// Index of the current match.
    at: usize,
    frames: u32,
    /// True if it had the keyboard focus in the last frame.
    typing: bool,
}

/// A node or a frame that is being renamed.
#[derive(Clone, Debug)]
pub(super) struct Rename {
    from: String,
    to: String,
    note: String,
    /// True for a frame.
    frame: bool,
    /// Why the last attempt was refused.
    refused: Option<String>,
    frames: u32,
}

impl Rename {
    pub(super) fn of_node(name: &str, note: &str) -> Self {
        Self {
            from: name.to_owned(),
            to: name.to_owned(),
            note: note.to_owned(),
            frame: false,
            refused: None,
            frames: 0,
        }
    }

    pub(super) fn of_frame(name: &str, note: &str) -> Self {
        Self { frame: true, ..Self::of_node(name, note) }
    }
}

/// A short text in its own box, beside the pointer.
pub(super) fn bubble(ui: &Ui, id: &str, at: Pos2, brush: &Brush, text: &str) {
    let width = 320.0_f32.min(brush.lens.rect.width() - 20.0).max(120.0);
    egui::Area::new(Id::new("canvas").with(id))
        .order(egui::Order::Tooltip)
        .fixed_pos(at)
        .constrain_to(ui.ctx().content_rect().shrink(4.0))
        .interactable(false)
        .show(ui.ctx(), |ui| {
            egui::Frame::popup(ui.style()).stroke(Stroke::new(1.0, brush.look.bad)).show(ui, |ui| {
                ui.set_max_width(width);
                ui.label(RichText::new(text).color(brush.look.bad));
            });
        });
}

impl Canvas {
    /// Shows for a while why an edit was refused.
    pub(super) fn refusal_ui(&mut self, ui: &Ui, brush: &Brush) {
        let Some((reason, at, until)) = &self.refusal else { return };
        let left = until - ui.input(|input| input.time);
        if left <= 0.0 || ui.input(|input| input.pointer.any_pressed()) {
            self.refusal = None;
            return;
        }
        bubble(ui, "refusal", *at + vec2(16.0, 12.0), brush, reason);
        ui.ctx().request_repaint_after_secs(left as f32);
    }

    /// The tooltip of the part of the graph under the pointer.
    pub(super) fn hint(&self, response: &Response, session: &Session, brush: &Brush) {
        let calm = matches!(self.gesture, Gesture::Idle) && self.palette.is_none() && self.menu.is_none();
        let Some(hit) = self.hovered.as_ref().filter(|_| calm && self.refusal.is_none()) else { return };
        let model = &self.model;
        match hit {
            Hit::Pin(spot) => {
                response.clone().on_hover_ui_at_pointer(|ui| self.tell_pin(ui, *spot, brush));
            }
            Hit::Wire(name) | Hit::Bend(name, _) => {
                if let Some(wire) = model.wire(name) {
                    response.clone().on_hover_ui_at_pointer(|ui| {
                        ui.label(format!("{} to {}", model.port_name(wire.from), model.port_name(wire.to)));
                        ui.label(RichText::new(wire.ty.to_string()).color(brush.look.port(wire.ty)));
                    });
                }
            }
            Hit::Card(card) => {
                let point = response.hover_pos().map(|point| brush.lens.to_graph(point));
                let on_title = point.is_some_and(|point| point.y < model.cards[*card].at.y + TITLE);
                let info = session.node(&model.cards[*card].name);
                let failed = matches!(info.state, NodeState::Failed { .. } | NodeState::Unwired { .. });
                if on_title || failed {
                    response.clone().on_hover_ui_at_pointer(|ui| self.tell_node(ui, *card, session, brush));
                }
            }
            Hit::Head(_) | Hit::Corner(_) | Hit::Ground => {}
        }
    }

    fn tell_pin(&self, ui: &mut Ui, spot: Spot, brush: &Brush) {
        let model = &self.model;
        let pin = model.pin(spot);
        ui.set_max_width(300.0);
        ui.horizontal(|ui| {
            ui.label(RichText::new(pin.name).strong());
            ui.label(RichText::new(pin.ty.to_string()).color(brush.look.port(pin.ty)));
        });
        ui.label(pin.doc.lines().next().unwrap_or_default());
        let state = match (spot.side, model.wire_into(spot)) {
            (Side::Input, Some(wire)) => format!("from {}", model.port_name(wire.from)),
            (Side::Input, None) if pin.missing => "Required input.".to_owned(),
            (Side::Input, None) => pin
                .constant_text()
                .map_or_else(|| "Optional input.".to_owned(), |constant| format!("{constant}, unless wired")),
            (Side::Output, _) => "Drag to an input, or to empty space to add a node that accepts it.".to_owned(),
        };
        ui.label(RichText::new(state).weak());
    }

    fn tell_node(&self, ui: &mut Ui, card: usize, session: &Session, brush: &Brush) {
        let card = &self.model.cards[card];
        let info = session.node(&card.name);
        let look = &brush.look;
        ui.set_max_width(340.0);
        ui.label(RichText::new(&card.name).strong());
        if card.index.is_none() {
            ui.label(format!("`{}` is not a known node type. It is kept unchanged.", card.kind));
            return;
        }
        ui.label(format!("{}: {}", card.kind, card.summary));
        match &info.state {
            NodeState::Failed { message, hint, at } => {
                let at = at.as_ref().map_or_else(String::new, |at| format!("At `{at}`: "));
                ui.label(RichText::new(format!("{at}{message}")).color(look.bad));
                if let Some(hint) = hint {
                    ui.label(hint);
                }
            }
            NodeState::Running { fraction } => {
                ui.label(RichText::new(format!("Running: {:.0} %", fraction * 100.0)).color(look.busy));
            }
            NodeState::Waiting => {
                ui.label(RichText::new("Waiting").weak());
            }
            state @ NodeState::Unwired { .. } => {
                ui.label(RichText::new(state.lacks().unwrap_or_default()).weak());
            }
            NodeState::Fresh => {}
        }
        for warning in &info.warnings {
            ui.label(RichText::new(warning).color(look.doubtful));
        }
        if let Some((time, cells)) = info.time {
            let caption = format!("{} at {cells} cells per side, {} of memory", span(time), bytes(info.bytes as u64));
            ui.label(RichText::new(caption).weak());
        }
    }

    /// The overview, the legend, the search, and the hint on an empty graph.
    pub(super) fn overlays(&mut self, ui: &mut Ui, response: &Response, session: &mut Session, brush: &Brush) {
        if self.model.cards.is_empty() {
            let words = "Press Tab or Space, or double-click, to add a node";
            let middle = brush.lens.rect.center();
            let colour = brush.look.weak;
            brush.painter.text(middle, Align2::CENTER_CENTER, words, FontId::proportional(15.0), colour);
        }
        self.overview(ui, brush);
        self.legend(ui, brush);
        self.find_ui(ui, response, session);
    }

    /// The button that shows the legend of wire colours and keys.
    fn legend(&self, ui: &mut Ui, brush: &Brush) {
        let pane = brush.lens.rect;
        if pane.width() < 180.0 || pane.height() < 100.0 {
            return;
        }
        let rect = Rect::from_min_size(pane.left_bottom() + vec2(MARGIN, -MARGIN - 22.0), Vec2::splat(22.0));
        let response = ui.interact(rect, Id::new("canvas legend"), Sense::click());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, "colours and keys"));
        let look = &brush.look;
        let edge = if response.hovered() { look.text } else { look.weak };
        brush.painter.circle(rect.center(), 10.0, look.well, Stroke::new(1.0, edge));
        brush.painter.text(rect.center(), Align2::CENTER_CENTER, "?", FontId::proportional(13.0), edge);
        // A click keeps it open until the next click.
        let opened = egui::Popup::from_toggle_button_response(&response).show(|ui| colours_and_keys(ui, look));
        if opened.is_none() {
            response.on_hover_ui(|ui| colours_and_keys(ui, look));
        }
    }

    /// The search for a node by name or type.
    fn find_ui(&mut self, ui: &mut Ui, canvas: &Response, session: &mut Session) {
        let Some(mut find) = self.find.take() else { return };
        let word = find.query.to_lowercase();
        let hits: Vec<String> = self
            .model
            .cards
            .iter()
            .filter(|card| card.name.to_lowercase().contains(&word) || card.kind.to_lowercase().contains(&word))
            .map(|card| card.name.clone())
            .collect();
        // A field in which Escape was pressed has already lost its focus.
        let typing = find.frames == 0 || find.typing;
        if !typing && canvas.clicked() {
            return;
        }
        let keys = if typing { ListKeys::take(ui) } else { ListKeys::default() };
        let mut changed = false;
        let at = canvas.rect.left_top() + Vec2::splat(MARGIN);
        egui::Area::new(Id::new("find")).order(egui::Order::Foreground).fixed_pos(at).show(ui.ctx(), |ui| {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                ui.horizontal(|ui| {
                    let edit =
                        egui::TextEdit::singleline(&mut find.query).hint_text("Find a node").desired_width(150.0);
                    let response = ui.add(edit).named("find a node");
                    if find.frames == 0 {
                        response.request_focus();
                    }
                    changed = response.changed();
                    find.typing = response.has_focus() || find.frames == 0;
                    let caption = match (find.query.is_empty(), hits.len()) {
                        (true, _) => String::new(),
                        (_, 0) => "none".to_owned(),
                        (_, count) => format!("{} of {count}", find.at.min(count - 1) + 1),
                    };
                    ui.add_sized([48.0, 18.0], egui::Label::new(RichText::new(caption).weak()));
                });
            });
        });
        find.frames += 1;
        let step = match (changed, keys.enter || keys.down, keys.up) {
            (true, _, _) => {
                find.at = 0;
                // The matches of the new text are shown in the next frame.
                ui.ctx().request_repaint();
                find.frames = 1;
                false
            }
            (_, true, _) => {
                find.at = (find.at + 1) % hits.len().max(1);
                true
            }
            (_, _, true) => {
                find.at = (find.at + hits.len().max(1) - 1) % hits.len().max(1);
                true
            }
            _ => find.frames == 2,
        };
        if step
            && !find.query.is_empty()
            && let Some(name) = hits.get(find.at)
        {
            session.select_only(name);
            if let (Some(card), Some(lens)) = (self.model.find(name), &mut self.lens) {
                lens.centre = self.model.cards[card].rect().center();
                lens.zoom = lens.zoom.max(0.6);
                self.moved = true;
            }
        }
        if keys.escape {
            canvas.request_focus();
        } else {
            self.find = Some(find);
        }
    }

    /// The fields for renaming a node, or for the name and note of a frame.
    pub(super) fn rename_ui(&mut self, ui: &mut Ui, session: &mut Session) {
        let (Some(mut rename), Some(lens)) = (self.rename.take(), self.lens) else { return };
        let corner = match rename.frame {
            false => self.model.find(&rename.from).map(|card| self.model.cards[card].at),
            true => self.model.area(&rename.from).map(|area| self.model.areas[area].rect.min),
        };
        let Some(corner) = corner else { return };
        let (enter, escape) = ui.input_mut(|input| {
            (input.consume_key(Modifiers::NONE, Key::Enter), input.consume_key(Modifiers::NONE, Key::Escape))
        });
        let at = lens.to_screen(corner);
        let at = at.clamp(lens.rect.min, lens.rect.max - vec2(60.0, 30.0).min(lens.rect.size()));
        let mut focused = false;
        egui::Area::new(Id::new("rename"))
            .order(egui::Order::Foreground)
            .fixed_pos(at)
            .constrain_to(ui.ctx().content_rect().shrink(4.0))
            .show(ui.ctx(), |ui| {
                egui::Frame::popup(ui.style()).inner_margin(3.0).show(ui, |ui| {
                    focused = rename.fields(ui, 176.0_f32.max(lens.zoom * 170.0));
                });
            });
        rename.frames += 1;
        let lost = rename.frames > 2 && !focused;
        if (enter || lost) && !escape {
            self.rename = self.finish_rename(session, rename);
        } else if !escape {
            self.rename = Some(rename);
        }
        if self.rename.is_some() {
            return;
        }
        ui.memory_mut(|memory| memory.request_focus(Id::new("canvas")));
    }

    /// Applies the name and the note. If they are refused, returns them with the reason, so that nothing that was typed
    /// is lost.
    fn finish_rename(&mut self, session: &mut Session, rename: Rename) -> Option<Rename> {
        let Rename { from, to, note, frame, .. } = rename.clone();
        let renamed = from != to;
        let mut edits = Vec::new();
        if frame && let Some(area) = self.model.area(&from) {
            let frame = self.model.areas[area].frame();
            if frame.note != note {
                let frame = Some(orograph_graph::Frame { note, ..frame });
                edits.push(Edit::SetFrame { name: from.clone(), frame });
            }
            edits.extend(renamed.then(|| Edit::RenameFrame { from: from.clone(), to: to.clone() }));
        } else if let Some(card) = self.model.find(&from)
            && self.model.cards[card].note != note
        {
            edits.push(Edit::SetNote { node: from.clone(), note });
        }
        if renamed && !frame {
            edits.push(Edit::RenameNode { from: from.clone(), to: to.clone() });
        }
        if edits.is_empty() {
            return None;
        }
        if let Err(reason) = session.attempt(&Edit::All(edits)) {
            return Some(Rename { refused: Some(reason), frames: 0, ..rename });
        }
        if renamed && !frame {
            if let Some(at) = self.places.get(&from).copied() {
                self.places.insert(to.clone(), at);
            }
            if self.collapsed.contains(&from) {
                self.collapsed.insert(to.clone());
            }
        }
        if frame {
            self.read(session);
            self.area = Some(to);
        } else {
            session.select_only(&to);
        }
        None
    }
}

/// The meanings of the colours of wires, and the keys of the graph.
fn colours_and_keys(ui: &mut Ui, look: &Look) {
    // A tooltip with text that can be selected stays open under the pointer, and would cover the graph.
    ui.style_mut().interaction.selectable_labels = false;
    ui.horizontal_top(|ui| {
        ui.vertical(|ui| {
            ui.label(RichText::new("Wires").strong());
            legend(ui, look, &MEANINGS);
        });
        ui.add_space(12.0);
        ui.vertical(|ui| {
            ui.label(RichText::new("Keys").strong());
            egui::Grid::new("keys").num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
                for action in actions::with_keys(Part::Graph) {
                    ui.label(RichText::new(action.keys(ui.ctx())).weak());
                    ui.label(action.what());
                    ui.end_row();
                }
                ui.label(RichText::new("Wheel, middle drag").weak());
                ui.label("Zoom, pan");
                ui.end_row();
            });
        });
    });
}

impl Rename {
    /// The fields. Returns true if one of them has the focus.
    fn fields(&mut self, ui: &mut Ui, width: f32) -> bool {
        let edit = egui::TextEdit::singleline(&mut self.to).id(Id::new("rename field")).desired_width(width);
        let mut output = edit.show(ui);
        let response = output.response.response.clone().named("name");
        if self.frames == 0 {
            response.request_focus();
            let all = egui::text::CCursorRange::two(
                egui::text::CCursor::new(0),
                egui::text::CCursor::new(self.to.chars().count()),
            );
            output.state.cursor.set_char_range(Some(all));
            output.state.store(ui.ctx(), response.id);
        }
        let mut focused = response.has_focus();
        let note = egui::TextEdit::singleline(&mut self.note).id(Id::new("note field"));
        focused |= ui.add(note.hint_text("A note").desired_width(width)).named("note").has_focus();
        if let Some(reason) = &self.refused {
            ui.set_max_width(width.max(260.0));
            ui.label(RichText::new(reason).color(ui.visuals().error_fg_color));
        }
        focused
    }
}
