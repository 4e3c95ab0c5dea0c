//! The commands that move selected nodes into a new graph file, and that put the nodes of a `Subgraph` in its
//! place.

use std::collections::{BTreeMap, BTreeSet};

use egui::{Button, Id, Key, Rect, RichText, TextEdit, Ui, Vec2};
use orograph_graph::Edit;

use super::{
    Canvas, Session,
    commands::{self, GAP, written},
    model::{Model, WIDTH},
    place,
};
use crate::editor::window::theme;

/// The dialog that asks for the name of a new graph file.
#[derive(Debug)]
pub(super) struct NewSubgraph {
    name: String,
    /// Why the last attempt was refused.
    refused: Option<String>,
    /// False until the field has the focus.
    shown: bool,
}

impl Canvas {
    /// Asks for the name of the graph file of the selected nodes.
    pub(super) fn ask_subgraph(&mut self, ui: &Ui, session: &Session) {
        if session.path().is_none() {
            self.refuse(ui, "save the graph first: the new file goes into its folder".to_owned());
            return;
        }
        self.new_subgraph = Some(NewSubgraph { name: session.subgraph_name(), refused: None, shown: false });
        ui.ctx().request_repaint();
    }

    /// The dialog that asks for the name.
    pub(super) fn new_subgraph_ui(&mut self, ui: &Ui, session: &mut Session) {
        let Some(mut new) = self.new_subgraph.take() else { return };
        let (mut make, mut cancel) = (false, false);
        let modal = theme::modal(ui.ctx(), Id::new("new subgraph")).show(ui.ctx(), |ui| {
            ui.set_max_width(360.0_f32.min(ui.ctx().content_rect().width() - 32.0));
            ui.heading("Make a subgraph");
            let count = session.selection().count();
            let (nodes, their) = if count == 1 {
                ("The selected node moves".to_owned(), "its")
            } else {
                (format!("The {count} selected nodes move"), "their")
            };
            ui.label(format!(
                "{nodes} into a new graph file in the folder of this one. A Subgraph node takes {their} place, with the \
                 wires that cross the selection."
            ));
            ui.add_space(4.0);
            let label = ui.label("Name of the file");
            let field = ui.add(TextEdit::singleline(&mut new.name).desired_width(f32::INFINITY).hint_text("NAME.ron"));
            let field = field.labelled_by(label.id);
            if !std::mem::replace(&mut new.shown, true) {
                field.request_focus();
            }
            let is_named = !new.name.trim().is_empty();
            make = is_named && field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
            if let Some(reason) = &new.refused {
                ui.label(RichText::new(reason).color(ui.visuals().error_fg_color));
            }
            ui.add_space(8.0);
            ui.horizontal_wrapped(|ui| {
                make |= ui.add_enabled(is_named, Button::new("Create")).clicked();
                cancel = ui.button("Cancel").clicked();
            });
        });
        if make {
            new.refused = self.make_subgraph(session, &new.name).err();
            new.shown = false;
        }
        if !(cancel || modal.should_close() || make && new.refused.is_none()) {
            self.new_subgraph = Some(new);
        }
    }

    fn make_subgraph(&mut self, session: &mut Session, name: &str) -> Result<(), String> {
        let (model, chosen) = (&self.model, self.chosen(session));
        let all = chosen.iter().map(|card| model.cards[*card].rect()).fold(Rect::NOTHING, Rect::union);
        let at = place::on_grid(all.center() - Vec2::new(0.5 * WIDTH, 60.0));
        let places = chosen.iter().map(|card| &model.cards[*card]).map(|card| (card.name.clone(), written(card.at)));
        let settled = commands::settle(model).collect();
        session.make_subgraph(name, settled, places.collect(), written(at))?;
        self.moved = true;
        Ok(())
    }

    /// Puts the nodes of the selected `Subgraph` in its place.
    pub(super) fn inline(&mut self, ui: &Ui, session: &mut Session) {
        let [card] = self.chosen(session)[..] else { return };
        let (model, card) = (&self.model, &self.model.cards[card]);
        let inner = card.index.and_then(|node| session.document().subgraph(node)).cloned();
        let inner = inner.map(|inner| Model::of(&inner, &BTreeSet::new(), &mut BTreeMap::new()));
        let inner = inner.unwrap_or_default();
        let size = inner.bounds(|_| true).size().max(card.size());
        let shift = card.at - inner.bounds(|_| true).min;
        let places = inner.cards.iter().map(|inner| (inner.name.clone(), written(place::on_grid(inner.at + shift))));
        let places = places.collect();
        let name = card.name.clone();
        let edits = commands::settle(model).chain(room(model, card.rect(), size)).collect();
        if let Err(reason) = session.inline_subgraph(&name, edits, &places) {
            self.refuse(ui, reason);
            return;
        }
        self.moved = true;
    }
}

/// The edits that move cards to the right and down, so that the card with this rectangle can grow to a size.
fn room(model: &Model, card: Rect, size: Vec2) -> Vec<Edit> {
    let by = (size - card.size()).max(Vec2::ZERO);
    let grown = Rect::from_min_size(card.min, size).expand(0.5 * GAP);
    let moved = model.cards.iter().filter_map(|other| {
        let rect = other.rect();
        let shift = if rect.min.x >= card.max.x {
            Vec2::new(by.x, 0.0)
        } else if rect.min.y >= card.max.y && rect.x_range().intersects(grown.x_range()) {
            Vec2::new(0.0, by.y)
        } else {
            Vec2::ZERO
        };
        (shift != Vec2::ZERO).then(|| commands::put(&other.name, place::on_grid(other.at + shift)))
    });
    moved.collect()
}
