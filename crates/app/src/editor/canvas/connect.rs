//! Wires by keyboard: a list of the connections that the selected node can get, and of those that it has.

use egui::{Id, ScrollArea, TextEdit, Ui, vec2};
use orograph_graph::Edit;

use super::{
    Canvas, Session, commands,
    list::{self, ListKeys},
    model::{Model, Side, Spot},
};
use crate::editor::window::names::Named as _;

/// Most lines that are shown; words narrow a longer list.
const MOST: usize = 100;
/// Size of the list in points.
const SIZE: [f32; 2] = [340.0, 240.0];

/// The open list.
#[derive(Debug, Default)]
pub(super) struct Connect {
    query: String,
    /// Index of the marked line.
    at: usize,
    frames: u32,
}

/// A line of the list: its text and what it does.
struct Line {
    text: String,
    edit: Edit,
}

impl Canvas {
    /// Opens the list, or says why there is nothing to list.
    pub(super) fn ask_for_wire(&mut self, ui: &Ui, chosen: &[usize]) {
        if chosen.is_empty() {
            return self.refuse(ui, "select a node to connect, or two to connect with each other".to_owned());
        }
        self.connect = Some(Connect::default());
        ui.ctx().request_repaint();
    }

    /// The list. Enter connects or disconnects, and Escape closes it.
    pub(super) fn connect_ui(&mut self, ui: &mut Ui, session: &mut Session) {
        let (Some(mut connect), Some(lens)) = (self.connect.take(), self.lens) else { return };
        let chosen = self.chosen(session);
        let Some(first) = chosen.first().map(|card| self.model.cards[*card].rect()) else { return };
        let keys = ListKeys::take(ui);
        let mut clicked = None;
        let mut lines = Vec::new();
        let area = egui::Area::new(Id::new("connect"))
            .order(egui::Order::Foreground)
            .fixed_pos(lens.to_screen(first.left_top()) + vec2(0.0, 24.0))
            .constrain_to(ui.ctx().content_rect().shrink(6.0))
            .show(ui.ctx(), |ui| {
                egui::Frame::popup(ui.style()).show(ui, |ui| {
                    ui.set_width(SIZE[0].min(ui.ctx().content_rect().width() - 40.0));
                    let edit =
                        TextEdit::singleline(&mut connect.query).hint_text("Connect").desired_width(f32::INFINITY);
                    let response = ui.add(edit).named("connect");
                    response.request_focus();
                    if response.changed() {
                        connect.at = 0;
                    }
                    lines = found(&self.model, &chosen, &connect.query);
                    connect.at = keys.marked(connect.at, lines.len());
                    ScrollArea::vertical()
                        .max_height(SIZE[1])
                        .min_scrolled_height(160.0)
                        .auto_shrink([false, true])
                        .show(ui, |ui| {
                            for (position, line) in lines.iter().enumerate() {
                                let response = ui.selectable_label(position == connect.at, &line.text);
                                if position == connect.at && keys.moves() {
                                    response.scroll_to_me(None);
                                }
                                if response.clicked() {
                                    clicked = Some(position);
                                }
                            }
                            if lines.is_empty() {
                                ui.weak("No connection found. Try fewer letters.");
                            }
                        });
                });
            });
        connect.frames += 1;
        let outside = list::left(ui, connect.frames, area.response.rect);
        let picked = clicked.or_else(|| (keys.enter && connect.at < lines.len()).then_some(connect.at));
        if let Some(picked) = picked {
            let edits = commands::settle(&self.model).chain([lines.swap_remove(picked).edit]).collect();
            self.apply(ui, session, &Edit::All(edits));
        } else if !(keys.escape || outside) {
            self.connect = Some(connect);
            return;
        }
        ui.memory_mut(|memory| memory.request_focus(Id::new("canvas")));
    }
}

/// The lines that contain all words of a query: connections of the chosen cards with others or, if there are several,
/// among them; then what disconnects their wires.
fn found(model: &Model, chosen: &[usize], query: &str) -> Vec<Line> {
    let mut lines = Vec::new();
    // what leaves a node comes before what enters it
    let of = |side: Side| chosen.iter().flat_map(|card| model.spots(*card)).filter(move |spot| spot.side == side);
    for fixed in of(Side::Output).chain(of(Side::Input)) {
        // among several cards, each connection is found from its output
        if chosen.len() > 1 && fixed.side == Side::Input {
            continue;
        }
        let barred = model.barred(fixed);
        let cards = (0..model.cards.len()).filter(|card| chosen.len() == 1 || chosen.contains(card));
        for end in cards.flat_map(|card| model.spots(card)).filter(|end| model.fits(fixed, *end, &barred)) {
            let (output, input) = if fixed.side == Side::Output { (fixed, end) } else { (end, fixed) };
            if model.wire_into(input).is_none_or(|wire| wire.from != output) {
                let mut text = format!("{} to {}", model.port_name(output), model.port_name(input));
                if let Some(wire) = model.wire_into(input) {
                    text += &format!(", instead of {}", model.port_name(wire.from));
                }
                lines.push(Line { text, edit: commands::connect(model, output, input) });
            }
        }
    }
    let is_chosen = |spot: Spot| chosen.contains(&spot.card);
    for wire in model.wires.iter().filter(|wire| is_chosen(wire.from) || is_chosen(wire.to)) {
        let text = format!("disconnect {} from {}", model.port_name(wire.from), model.port_name(wire.to));
        lines.push(Line { text, edit: commands::disconnect(&model.wire_name(wire)) });
    }
    let query = query.to_lowercase();
    lines.retain(|line| {
        // not by the wire that would go
        let text = line.text.split(", ").next().unwrap_or_default().to_lowercase();
        query.split_whitespace().all(|word| text.contains(word))
    });
    lines.truncate(MOST);
    lines
}
