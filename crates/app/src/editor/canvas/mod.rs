//! The canvas: nodes as cards, the wires between them, and direct manipulation.
//!
//! A [`Model`] is the drawable form of a document, rebuilt after each change of the document; it duplicates no state.
//! [`Lens`] is the view. A [`Gesture`] is the current use of the pointer; it ends with one edit. [`commands`] turn user
//! commands into edits. [`paint`] draws the cards and wires in points of the window and not in a scaled scene, so that
//! text is sharp at every zoom and pins can be grabbed wherever they are visible; `egui_graph` computes the automatic
//! layout, in [`place`].

mod bends;
mod clip;
mod commands;
mod connect;
mod gesture;
mod hit;
mod keys;
mod lens;
mod list;
mod look;
mod menu;
mod model;
mod overlay;
mod overview;
mod paint;
mod palette;
mod place;
mod reuse;
mod thumbs;
mod values;

pub(super) use commands::Alignment;

use std::collections::{BTreeMap, BTreeSet};

use egui::{Id, Pos2, Rect, Response, Sense, Vec2, WidgetInfo, WidgetType};
use orograph_graph::Edit;

pub(super) use self::thumbs::of_fields as thumbnails;
use super::{Session, session::NodeState, window::actions::Action};
use gesture::Gesture;
use hit::Hit;
use lens::Lens;
use look::Look;
use model::{Model, Side, Spot, WireName};
use paint::{Brush, Emphasis};
use thumbs::Thumbs;

/// Time in seconds for which the reason of a refused edit is shown at the pointer.
const REFUSAL: f64 = 4.0;

/// A state of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Seen {
    /// The number of the session's document.
    number: u64,
    edits: u64,
}

/// The canvas.
#[derive(Debug, Default)]
pub(super) struct Canvas {
    model: Model,
    /// The file, and its state, that the model shows.
    seen: Option<Seen>,
    /// Positions of nodes that have none in the document.
    places: BTreeMap<String, Pos2>,
    /// Collapsed nodes, of which only the title is drawn.
    collapsed: BTreeSet<String>,
    lens: Option<Lens>,
    /// True once you have panned or zoomed; until then the view fits the graph, or the readable part of it.
    moved: bool,
    /// The pane and the extent of the graph for which the view was chosen.
    opened: Option<(Rect, Rect)>,
    gesture: Gesture,
    /// True if the pointer has been away from the pane's edge since the drag began, so that the view may scroll.
    away: bool,
    hovered: Option<Hit>,
    wires: BTreeSet<WireName>,
    /// The selected frame.
    area: Option<String>,
    /// The selected route point of a wire.
    bend: Option<(WireName, usize)>,
    /// The only selected node in the last frame.
    followed: Option<String>,
    thumbs: Thumbs,
    palette: Option<palette::Palette>,
    menu: Option<menu::Menu>,
    find: Option<overlay::Find>,
    rename: Option<overlay::Rename>,
    connect: Option<connect::Connect>,
    new_subgraph: Option<reuse::NewSubgraph>,
    /// The reason of a refused edit, its position, and until when it is shown.
    refusal: Option<(String, Pos2, f64)>,
    without_map: bool,
    /// The part of the graph that the overview shows while it is dragged.
    held_overview: Option<Rect>,
    /// Nodes that were just pasted or duplicated, which the view has to show.
    added: Vec<String>,
    /// The nodes that arrow keys move, and the positions that were written with the first step.
    nudged: Option<(BTreeSet<String>, Vec<Edit>)>,
    /// Number of pastes away from the pointer, each shifted from the one before.
    pasted: u32,
    /// The modifier keys that were held at the end of the last frame.
    held: egui::Modifiers,
    /// Remaining frames to wait for the clipboard after a menu command, and the command.
    pasting: Option<(u8, Action)>,
    /// The queued command of a menu of the window.
    asked: Option<Action>,
}

impl Canvas {
    pub(super) fn ui(&mut self, ui: &mut egui::Ui, session: &mut Session) {
        let rect = ui.available_rect_before_wrap();
        let id = Id::new("canvas");
        ui.set_clip_rect(rect.intersect(ui.clip_rect()));
        let response = ui.interact(rect, id, Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(WidgetType::Other, true, "graph"));
        if !rect.is_positive() {
            return;
        }
        self.read(session);
        let lens = self.look_through(rect, session);
        self.follow_selection(session);
        self.move_view(ui, &response);
        self.end_nudge(ui, session);
        self.keys(ui, &response, session);
        self.read(session);
        if let Some(action) = self.asked.take() {
            self.run(ui, session, action);
            self.read(session);
        }
        let order = self.order(session);
        self.point(ui, &response, session, &order);
        self.read(session);
        self.bring_into_view();
        let brush =
            Brush { painter: ui.painter_at(rect), lens: self.lens.unwrap_or(lens), look: Look::of(ui.visuals()) };
        self.draw(ui, &brush, session);
        self.hint(&response, session, &brush);
        self.overlays(ui, &response, session, &brush);
        self.menu_ui(ui, session);
        self.palette_ui(ui, session);
        self.rename_ui(ui, session);
        self.connect_ui(ui, session);
        self.new_subgraph_ui(ui, session);
        self.refusal_ui(ui, &brush);
    }

    /// Rebuilds the model if the document has changed.
    fn read(&mut self, session: &Session) {
        let now = Seen { number: session.number(), edits: session.edits() };
        if self.seen == Some(now) {
            return;
        }
        if self.seen.is_some_and(|seen| seen.number != now.number) {
            *self = Self { without_map: self.without_map, ..Self::default() };
        }
        self.model = Model::of(session.document(), &self.collapsed, &mut self.places);
        self.seen = Some(now);
        self.gesture.forget_what_is_gone(&self.model);
        self.wires =
            std::mem::take(&mut self.wires).into_iter().filter(|wire| self.model.wire(wire).is_some()).collect();
        self.area = self.area.take().filter(|name| self.model.area(name).is_some());
        let exists = |(wire, at): &(WireName, usize)| self.model.wire(wire).is_some_and(|wire| *at < wire.bends.len());
        self.bend = self.bend.take().filter(exists);
        self.hovered = None;
        self.thumbs.keep(&self.model);
    }

    /// The view in this pane. Until you pan or zoom it shows all of the graph, or the readable part around the selected
    /// or shown node.
    fn look_through(&mut self, rect: Rect, session: &Session) -> Lens {
        let extent = self.model.extent();
        let lens = match self.lens {
            Some(lens) if self.moved => Lens { rect, ..lens },
            Some(lens) if self.opened == Some((rect, extent)) => lens,
            _ => {
                let shown = session.shown();
                let shown = shown.as_deref().and_then(|port| port.split_once('.')).map(|(node, _)| node);
                let card = session.selected().or(shown).and_then(|name| self.model.find(name));
                let focus = card.map_or(extent.center(), |card| self.model.cards[card].rect().center());
                Lens::opening(rect, extent, focus)
            }
        };
        self.opened = Some((rect, extent));
        self.lens = Some(lens);
        lens
    }

    /// Scrolls to a node that was selected elsewhere, such as in the list of problems.
    fn follow_selection(&mut self, session: &Session) {
        let selected = session.selected().map(str::to_owned);
        if selected == self.followed {
            return;
        }
        let card = selected.as_deref().and_then(|name| self.model.find(name));
        if let (Some(card), Some(lens)) = (card, &mut self.lens)
            && !self.model.cards[card].rect().intersects(lens.seen())
        {
            lens.centre = self.model.cards[card].rect().center();
            self.moved = true;
        }
        self.followed = selected;
    }

    /// The cards in drawing order, the selected ones last.
    fn order(&self, session: &Session) -> Vec<usize> {
        let (above, below): (Vec<usize>, Vec<usize>) =
            (0..self.model.cards.len()).partition(|card| session.is_selected(&self.model.cards[*card].name));
        below.into_iter().chain(above).collect()
    }

    /// The selected cards.
    fn chosen(&self, session: &Session) -> Vec<usize> {
        session.selection().filter_map(|name| self.model.find(name)).collect()
    }

    /// Shows this part of the graph.
    fn fit(&mut self, bounds: Rect) {
        if let Some(lens) = &mut self.lens
            && bounds.is_positive()
        {
            *lens = Lens::fitted(lens.rect, bounds);
            self.moved = true;
        }
    }

    /// Makes an edit; if it is refused, shows the reason at the pointer.
    fn apply(&mut self, ui: &egui::Ui, session: &mut Session, edit: &Edit) -> bool {
        session.attempt(edit).map_err(|reason| self.refuse(ui, reason)).is_ok()
    }

    fn refuse(&mut self, ui: &egui::Ui, reason: String) {
        let at = ui.ctx().pointer_latest_pos().or(self.lens.map(|lens| lens.rect.center())).unwrap_or_default();
        self.refusal = Some((reason, at, ui.input(|input| input.time) + REFUSAL));
    }

    /// Pans and zooms by wheel, touchpad and the middle button.
    fn move_view(&mut self, ui: &egui::Ui, response: &Response) {
        let Some(lens) = &mut self.lens else { return };
        let before = *lens;
        if response.dragged_by(egui::PointerButton::Middle) {
            lens.pan(response.drag_delta());
        }
        if response.contains_pointer()
            && let Some(pointer) = response.hover_pos()
        {
            let (pinch, wheels) = ui.input(|input| {
                let wheels = input.events.iter().filter_map(|event| match event {
                    egui::Event::MouseWheel { unit, delta, modifiers, .. } => Some((*unit, *delta, *modifiers)),
                    _ => None,
                });
                let pinch = input.events.iter().filter_map(|event| match event {
                    egui::Event::Zoom(factor) => Some(*factor),
                    _ => None,
                });
                (pinch.product::<f32>(), wheels.collect::<Vec<_>>())
            });
            lens.zoom_at(pointer, pinch);
            for (unit, delta, modifiers) in wheels {
                // A wheel has steps and zooms; a touchpad scrolls and pans, unless Ctrl is held.
                match unit {
                    egui::MouseWheelUnit::Point if modifiers.command => lens.zoom_at(pointer, (delta.y / 200.0).exp2()),
                    egui::MouseWheelUnit::Point => lens.pan(delta),
                    _ if modifiers.shift => lens.pan(Vec2::new(delta.x + delta.y, 0.0) * 48.0),
                    _ => lens.zoom_at(pointer, (delta.y * 0.25).exp2()),
                }
            }
        }
        self.moved |= *lens != before;
    }

    /// Draws wires, cards, pins and the current gesture.
    fn draw(&mut self, ui: &mut egui::Ui, brush: &Brush, session: &Session) {
        let order = self.order(session);
        brush.ground();
        let model = &self.model;
        for (position, area) in model.areas.iter().enumerate() {
            let hovered = matches!(self.hovered, Some(Hit::Head(at) | Hit::Corner(at)) if at == position);
            brush.area(area, self.area.as_ref() == Some(&area.name), hovered);
        }
        let link = self.gesture.link(model);
        for wire in &model.wires {
            let is = |name: &WireName| model.is(wire, name);
            if self.gesture.detached().is_some_and(is) {
                continue;
            }
            let chosen = self.wires.iter().any(is);
            let hovered =
                matches!(&self.hovered, Some(Hit::Wire(name)) if is(name)) || self.gesture.onto().is_some_and(is);
            let colour = brush.look.port(wire.ty);
            let places = model.places(wire);
            if chosen || hovered {
                let halo = if chosen { brush.look.chosen } else { colour };
                brush.wire(&places, halo.gamma_multiply(if chosen { 0.9 } else { 0.45 }), 6.0);
            }
            let colour = if link.is_some() { colour.gamma_multiply(0.4) } else { colour };
            brush.wire(&places, colour, 2.4);
            for (at, bend) in wire.bends.iter().enumerate() {
                let here = |(name, bend): (&WireName, usize)| bend == at && is(name);
                let hovered = matches!(&self.hovered, Some(Hit::Bend(name, bend)) if here((name, *bend)));
                let chosen = self.bend.as_ref().is_some_and(|(name, bend)| here((name, *bend)));
                brush.bend(*bend, colour, chosen, hovered);
                tell_bend(ui, model, wire, at, brush.lens);
            }
        }
        let seen = brush.lens.seen().expand(8.0);
        let visible: Vec<usize> = order.into_iter().filter(|card| model.cards[*card].rect().intersects(seen)).collect();
        if !self.thumbs.renew(ui.ctx(), session, model, &visible, &brush.look) {
            ui.ctx().request_repaint();
        }
        let time = ui.input(|input| input.time);
        let shown = session.shown();
        let mut busy = false;
        for position in visible {
            let card = &model.cards[position];
            let info = session.info(&card.name);
            busy |= matches!(info.state, NodeState::Running { .. });
            let port = card.outputs.first().map(|output| format!("{}.{}", card.name, output.name));
            let thumb = port.as_deref().and_then(|port| self.thumbs.get(port));
            let fits = |side: Side, pin: usize| {
                let spot = Spot { card: position, side, pin };
                link.as_ref().is_none_or(|(fixed, barred)| *fixed == spot || model.fits(*fixed, spot, barred))
            };
            let emphasis = Emphasis {
                chosen: session.is_selected(&card.name) || self.gesture.has_caught(&card.name),
                hovered: self.hovered == Some(Hit::Card(position)),
                shown: shown
                    .as_deref()
                    .and_then(|shown| shown.split_once('.'))
                    .is_some_and(|(node, _)| node == card.name),
                faded: link.as_ref().is_some_and(|(fixed, _)| {
                    fixed.card != position && !model.spots(position).any(|spot| fits(spot.side, spot.pin))
                }),
            };
            brush.card(card, info, thumb, emphasis, time);
            if card.muted
                && let Some(passed) = model.passed(position)
            {
                brush.passed(card, passed.pin, model.pin(passed).ty);
            }
            let hovered = match self.hovered {
                Some(Hit::Pin(spot)) if spot.card == position => Some((spot.side, spot.pin)),
                _ => None,
            };
            brush.pins(card, fits, hovered);
            tell(ui, model, position, brush.lens, session);
        }
        if busy {
            ui.ctx().request_repaint_after_secs(0.05);
        }
        self.gesture.draw(ui, &self.model, brush);
    }
}

/// Exposes a route point of a wire to accessibility tools and to the tests.
fn tell_bend(ui: &egui::Ui, model: &Model, wire: &model::Wire, at: usize, lens: Lens) {
    let WireName { node, input } = model.wire_name(wire);
    let rect = Rect::from_center_size(lens.to_screen(wire.bends[at]), Vec2::splat(10.0));
    let response = ui.interact(rect, Id::new("canvas").with((&node, input, at)), Sense::hover());
    let label = format!("point {} of the wire into {node}.{input}", at + 1);
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Other, true, &label));
}

/// Exposes cards and pins to accessibility tools and to the tests.
fn tell(ui: &egui::Ui, model: &Model, position: usize, lens: Lens, session: &Session) {
    let card = &model.cards[position];
    let id = Id::new("canvas").with(&card.name);
    let response = ui.interact(lens.rect_to_screen(card.rect()), id, Sense::hover());
    let chosen = session.is_selected(&card.name);
    response.widget_info(|| {
        WidgetInfo::selected(WidgetType::SelectableLabel, true, chosen, format!("node {}: {}", card.name, card.kind))
    });
    // At small zooms there would be too many pins, all too small to grab.
    let spots = model.spots(position).filter(|_| lens.zoom > 0.2);
    for spot in spots {
        let at = Rect::from_center_size(lens.to_screen(model.pin_at(spot)), Vec2::splat(10.0));
        let side = if spot.side == Side::Input { "input" } else { "output" };
        let response = ui.interact(at, id.with((side, spot.pin)), Sense::hover());
        response
            .widget_info(|| WidgetInfo::labeled(WidgetType::Other, true, format!("{side} {}", model.port_name(spot))));
    }
}
