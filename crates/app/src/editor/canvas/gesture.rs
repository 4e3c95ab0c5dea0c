//! Pointer gestures: select, move and wire. Each ends with one edit.

use std::collections::{BTreeMap, BTreeSet};

use egui::{CursorIcon, Modifiers, PointerButton, Pos2, Rect, Response, Vec2};
use orograph_graph::Edit;

use super::{
    Canvas, Session, clip, commands,
    hit::Hit,
    lens::Lens,
    menu::Menu,
    model::{Area, Card, Model, Side, Spot, WIDTH, Wire, WireName},
    overlay::{self, Rename},
    paint::Brush,
    palette::{Palette, Purpose},
    place,
};

/// Distance to the pane's edge at which the view starts to scroll, in points, and its maximum speed in points per
/// second.
const EDGE: [f32; 2] = [28.0, 900.0];

/// The current pointer gesture.
#[derive(Debug, Default)]
pub(super) enum Gesture {
    #[default]
    Idle,
    /// Pans the view.
    Pan,
    /// Draws a selection rectangle.
    Net {
        from: Pos2,
        to: Pos2,
        /// The nodes that stay selected whatever the rectangle touches.
        base: BTreeSet<String>,
        caught: BTreeSet<String>,
    },
    /// Moves cards.
    Move {
        from: Pos2,
        /// The grabbed card, whose corner stays on the grid.
        held: String,
        starts: BTreeMap<String, Pos2>,
        /// The route points of the wires among the cards, which move with them.
        ways: BTreeMap<usize, Vec<Pos2>>,
        /// The wire into which the card would be inserted.
        onto: Option<WireName>,
        /// True if copies of the cards go there, with Alt, and the cards stay.
        copies: bool,
    },
    /// Moves a frame with its content, or resizes it.
    Shift {
        from: Pos2,
        area: String,
        start: Rect,
        size: bool,
        starts: BTreeMap<String, Pos2>,
        ways: BTreeMap<usize, Vec<Pos2>>,
    },
    /// Moves a route point of a wire.
    Bend { from: Pos2, wire: WireName, at: usize, start: Pos2 },
    /// Draws a wire.
    Link(Link),
}

/// A wire that is being drawn.
#[derive(Debug)]
pub(super) struct Link {
    /// The fixed end, by node and pin.
    node: String,
    side: Side,
    pin: usize,
    /// The wire whose end was detached from its input.
    detached: Option<WireName>,
    /// The position of the free end.
    to: Pos2,
    /// The pin that it would connect to, and the reason if that is refused.
    target: Option<(Spot, Option<String>)>,
}

impl Gesture {
    /// The fixed end of the wire that is being drawn, and the cards that it cannot connect to.
    pub(super) fn link(&self, model: &Model) -> Option<(Spot, BTreeSet<usize>)> {
        let Self::Link(link) = self else { return None };
        let fixed = link.fixed(model)?;
        Some((fixed, model.barred(fixed)))
    }

    /// The wire whose end is detached.
    pub(super) const fn detached(&self) -> Option<&WireName> {
        match self {
            Self::Link(link) => link.detached.as_ref(),
            _ => None,
        }
    }

    /// The wire into which a card would be inserted.
    pub(super) const fn onto(&self) -> Option<&WireName> {
        match self {
            Self::Move { onto, .. } => onto.as_ref(),
            _ => None,
        }
    }

    /// Returns true if the selection rectangle touches this card.
    pub(super) fn has_caught(&self, node: &str) -> bool {
        matches!(self, Self::Net { caught, .. } if caught.contains(node))
    }

    /// Ends the gesture if its subject no longer exists.
    pub(super) fn forget_what_is_gone(&mut self, model: &Model) {
        let gone = match self {
            Self::Move { starts, .. } => starts.keys().any(|node| model.find(node).is_none()),
            Self::Link(link) => link.fixed(model).is_none(),
            Self::Shift { area, .. } => model.area(area).is_none(),
            Self::Bend { wire, at, .. } => model.wire(wire).is_none_or(|wire| wire.bends.len() <= *at),
            _ => false,
        };
        if gone {
            *self = Self::Idle;
        }
    }

    /// Draws the rectangle or the wire.
    pub(super) fn draw(&self, ui: &egui::Ui, model: &Model, brush: &Brush) {
        match self {
            Self::Net { from, to, .. } => brush.net(Rect::from_two_pos(*from, *to)),
            Self::Link(link) => {
                let Some(fixed) = link.fixed(model) else { return };
                let refused = matches!(link.target, Some((_, Some(_))));
                let colour = if refused { brush.look.bad } else { brush.look.port(model.pin(fixed).ty) };
                let end = link.target.as_ref().map_or(link.to, |(spot, _)| model.pin_at(*spot));
                let [from, to] = match fixed.side {
                    Side::Output => [model.pin_at(fixed), end],
                    Side::Input => [end, model.pin_at(fixed)],
                };
                brush.wire(&[from, to], colour.gamma_multiply(0.3), 7.0);
                brush.wire(&[from, to], colour, 2.6);
                if let Some((_, Some(reason))) = &link.target {
                    let at = brush.lens.to_screen(link.to);
                    overlay::bubble(ui, "refused", at + egui::vec2(16.0, 12.0), brush, reason);
                }
            }
            Self::Idle | Self::Pan | Self::Move { .. } | Self::Shift { .. } | Self::Bend { .. } => {}
        }
    }
}

impl Link {
    fn fixed(&self, model: &Model) -> Option<Spot> {
        let card = model.find(&self.node)?;
        (self.pin < model.cards[card].pins(self.side).len()).then_some(Spot { card, side: self.side, pin: self.pin })
    }
}

impl Canvas {
    /// Handles the pointer in this frame.
    pub(super) fn point(&mut self, ui: &egui::Ui, response: &Response, session: &mut Session, order: &[usize]) {
        let Some(lens) = self.lens else { return };
        let modifiers = ui.input(|input| input.modifiers);
        let pointer = ui.ctx().pointer_latest_pos();
        self.hovered = match (&self.gesture, response.hover_pos().filter(|_| response.hovered())) {
            (Gesture::Idle, Some(point)) => Some(self.model.hit(lens, order, point)).filter(|hit| *hit != Hit::Ground),
            _ => None,
        };
        if let Gesture::Idle = self.gesture {
            self.click(ui, response, session, order, modifiers);
            let origin = ui.input(|input| input.pointer.press_origin());
            if let Some(origin) = origin.filter(|_| response.drag_started_by(PointerButton::Primary)) {
                self.begin(session, lens, order, origin, modifiers);
            }
        }
        let Some(pointer) = pointer.filter(|_| !matches!(self.gesture, Gesture::Idle)) else { return };
        if ui.input(|input| input.key_pressed(egui::Key::Escape)) {
            self.cancel();
        } else if response.drag_stopped() || !ui.input(|input| input.pointer.primary_down()) {
            self.go_on(ui, session, order, pointer, modifiers);
            self.end(ui, session, pointer);
        } else {
            self.follow_edge(ui, pointer);
            self.go_on(ui, session, order, pointer, modifiers);
        }
    }

    fn click(
        &mut self,
        ui: &egui::Ui,
        response: &Response,
        session: &mut Session,
        order: &[usize],
        modifiers: Modifiers,
    ) {
        let (Some(lens), Some(point)) = (self.lens, response.interact_pointer_pos()) else { return };
        if response.clicked() || response.secondary_clicked() {
            response.request_focus();
        }
        if response.secondary_clicked() {
            let hit = self.model.hit(lens, order, point);
            match &hit {
                Hit::Card(card) | Hit::Pin(Spot { card, .. }) => {
                    let name = self.model.cards[*card].name.clone();
                    if !session.is_selected(&name) {
                        self.wires.clear();
                        session.select_only(&name);
                    }
                }
                Hit::Wire(wire) | Hit::Bend(wire, _) => self.wires = BTreeSet::from([wire.clone()]),
                Hit::Head(area) | Hit::Corner(area) => {
                    session.select([]);
                    self.area = Some(self.model.areas[*area].name.clone());
                }
                Hit::Ground => {}
            }
            self.menu = Some(Menu::new(hit, point, &self.model));
            return;
        }
        if !response.clicked() {
            return;
        }
        let additive = modifiers.command || modifiers.shift;
        let hit = self.model.hit(lens, order, point);
        if !additive && !matches!(hit, Hit::Wire(_)) {
            self.wires.clear();
        }
        (self.area, self.bend) = (None, None);
        match hit {
            Hit::Card(card) | Hit::Pin(Spot { card, .. }) => {
                let name = self.model.cards[card].name.clone();
                if response.double_clicked() {
                    let first = self.model.cards[card].outputs.first();
                    session.pin(first.map(|output| format!("{name}.{}", output.name)));
                } else if additive {
                    toggle(session, &name);
                } else {
                    session.select_only(&name);
                }
            }
            Hit::Wire(wire) if response.double_clicked() => self.add_bend(ui, session, &wire, point),
            Hit::Bend(wire, at) if response.double_clicked() => self.remove_bend(ui, session, &wire, at),
            Hit::Bend(wire, at) => {
                session.select([]);
                self.bend = Some((wire, at));
            }
            Hit::Wire(wire) if additive => {
                if !self.wires.remove(&wire) {
                    self.wires.insert(wire);
                }
            }
            Hit::Wire(wire) => {
                session.select([]);
                self.wires = BTreeSet::from([wire]);
            }
            Hit::Head(area) | Hit::Corner(area) => {
                let area = &self.model.areas[area];
                session.select([]);
                self.area = Some(area.name.clone());
                if response.double_clicked() {
                    self.rename = Some(Rename::of_frame(&area.name, &area.note));
                    ui.ctx().request_repaint();
                }
            }
            Hit::Ground if response.double_clicked() => {
                self.palette = Some(Palette::new(point, lens.to_graph(point), Purpose::Add));
                ui.ctx().request_repaint();
            }
            Hit::Ground if additive => {}
            Hit::Ground => session.select([]),
        }
    }

    fn begin(&mut self, session: &mut Session, lens: Lens, order: &[usize], origin: Pos2, modifiers: Modifiers) {
        let from = lens.to_graph(origin);
        let additive = modifiers.command || modifiers.shift;
        self.palette = None;
        self.away = false;
        self.gesture = match self.model.hit(lens, order, origin) {
            hit if modifiers.alt && !matches!(hit, Hit::Card(_)) => Gesture::Pan,
            Hit::Pin(spot) => Gesture::Link(self.link_from(spot, from)),
            Hit::Card(card) => {
                let held = self.model.cards[card].name.clone();
                if !session.is_selected(&held) {
                    if additive {
                        toggle(session, &held);
                    } else {
                        self.wires.clear();
                        session.select_only(&held);
                    }
                }
                let starts = self.chosen(session).into_iter().map(|card| {
                    let card = &self.model.cards[card];
                    (card.name.clone(), card.at)
                });
                let starts: BTreeMap<String, Pos2> = starts.collect();
                let ways = self.model.ways_among(|name| starts.contains_key(name));
                Gesture::Move { from, held, starts, ways, onto: None, copies: modifiers.alt }
            }
            Hit::Bend(wire, at) => {
                let start = self.model.wire(&wire).map_or(from, |wire| wire.bends[at]);
                Gesture::Bend { from, wire, at, start }
            }
            Hit::Head(area) => self.shift(area, from, false),
            Hit::Corner(area) => self.shift(area, from, true),
            Hit::Wire(_) | Hit::Ground => {
                let base = if additive { session.selection().map(str::to_owned).collect() } else { BTreeSet::new() };
                Gesture::Net { from, to: from, base, caught: BTreeSet::new() }
            }
        };
    }

    /// Grabs a frame, with the cards inside it if it is moved.
    fn shift(&self, area: usize, from: Pos2, size: bool) -> Gesture {
        let area = &self.model.areas[area];
        let inside = self.model.cards.iter().filter(|card| !size && area.rect.contains_rect(card.rect()));
        let starts: BTreeMap<String, Pos2> = inside.map(|card| (card.name.clone(), card.at)).collect();
        let ways = self.model.ways_among(|name| starts.contains_key(name));
        Gesture::Shift { from, area: area.name.clone(), start: area.rect, size, starts, ways }
    }

    /// Starts a wire at a pin. At a connected input, detaches the end of its wire instead.
    fn link_from(&self, spot: Spot, to: Pos2) -> Link {
        let model = &self.model;
        let taken = model.wire_into(spot);
        let fixed = taken.map_or(spot, |wire| wire.from);
        Link {
            node: model.cards[fixed.card].name.clone(),
            side: fixed.side,
            pin: fixed.pin,
            detached: taken.map(|wire| model.wire_name(wire)),
            to,
            target: None,
        }
    }

    /// Scrolls the view while the pointer drags something near the pane's edge.
    fn follow_edge(&mut self, ui: &egui::Ui, pointer: Pos2) {
        let Some(lens) = &mut self.lens else { return };
        if matches!(self.gesture, Gesture::Pan) {
            return;
        }
        let [margin, fastest] = EDGE;
        let push = |low: f32, high: f32| ((margin - low).max(0.0) - (margin - high).max(0.0)).clamp(-margin, margin);
        let by = Vec2::new(
            push(pointer.x - lens.rect.min.x, lens.rect.max.x - pointer.x),
            push(pointer.y - lens.rect.min.y, lens.rect.max.y - pointer.y),
        );
        self.away |= by == Vec2::ZERO;
        if by != Vec2::ZERO && self.away {
            lens.pan(by / margin * fastest * ui.input(|input| input.stable_dt).min(0.05));
            self.moved = true;
            ui.ctx().request_repaint();
        }
    }

    fn go_on(&mut self, ui: &egui::Ui, session: &Session, order: &[usize], pointer: Pos2, modifiers: Modifiers) {
        let Some(lens) = &mut self.lens else { return };
        let place = lens.to_graph(pointer);
        match &mut self.gesture {
            Gesture::Idle => {}
            Gesture::Pan => {
                lens.pan(ui.input(|input| input.pointer.delta()));
                self.moved = true;
            }
            Gesture::Net { from, to, base, caught } => {
                *to = place;
                let net = Rect::from_two_pos(*from, *to);
                let touched = self.model.cards.iter().filter(|card| card.rect().intersects(net));
                *caught = touched.map(|card| card.name.clone()).chain(base.iter().cloned()).collect();
            }
            Gesture::Move { from, held, starts, ways, onto, copies } => {
                let Some(start) = starts.get(held) else { return };
                let target = *start + (place - *from);
                if *copies {
                    ui.ctx().set_cursor_icon(CursorIcon::Copy);
                }
                let free = modifiers.alt && !*copies;
                let by = if free { target } else { place::on_grid(target) } - *start;
                for (name, start) in starts.iter() {
                    if let Some(card) = self.model.find(name) {
                        self.model.cards[card].at = *start + by;
                    }
                }
                self.model.put_ways(ways, by);
                *onto = (starts.len() == 1 && !*copies)
                    .then(|| self.model.find(held))
                    .flatten()
                    .and_then(|card| wire_below(&self.model, *lens, card, session));
                // The automatic view fits all; during a drag it would move the card away from the pointer.
                self.moved = true;
            }
            Gesture::Bend { from, wire, at, start } => {
                let target = *start + (place - *from);
                let target = if modifiers.alt { target } else { place::on_grid(target) };
                self.model.put_bend(wire, *at, target);
                self.moved = true;
            }
            Gesture::Shift { from, area, start, size, starts, ways } => {
                let Some(area) = self.model.area(area) else { return };
                let area = &mut self.model.areas[area];
                if *size {
                    let corner = place::on_grid(start.max + (place - *from));
                    area.rect.max = corner.max(start.min + Vec2::new(96.0, 60.0));
                } else {
                    let by = place::on_grid(start.min + (place - *from)) - start.min;
                    area.rect = start.translate(by);
                    for (name, at) in starts.iter() {
                        if let Some(card) = self.model.find(name) {
                            self.model.cards[card].at = *at + by;
                        }
                    }
                    self.model.put_ways(ways, by);
                }
                self.moved = true;
            }
            Gesture::Link(link) => {
                link.to = place;
                let Some(fixed) = link.fixed(&self.model) else { return };
                let model = &self.model;
                let barred = model.barred(fixed);
                let spot = model
                    .pin_near(*lens, order, pointer, |spot| spot.side != fixed.side && spot.card != fixed.card)
                    .or_else(|| {
                        let card = model.card_at(*lens, order, pointer)?;
                        model.fitting_pin(fixed, card, &barred)
                    });
                if link.target.as_ref().map(|(spot, _)| *spot) != spot {
                    let reason = |spot| {
                        let edit = commands::connect(model, fixed, spot);
                        session.document().clone().apply(&edit).err().map(|error| error.to_string())
                    };
                    link.target = spot.map(|spot| (spot, reason(spot)));
                }
            }
        }
    }

    /// Cancels the gesture; nothing changes.
    pub(super) fn cancel(&mut self) {
        match std::mem::take(&mut self.gesture) {
            Gesture::Move { starts, ways, .. } => {
                self.take_back(starts);
                self.model.put_ways(&ways, Vec2::ZERO);
            }
            Gesture::Bend { wire, at, start, .. } => self.model.put_bend(&wire, at, start),
            Gesture::Shift { area, start, starts, ways, .. } => {
                self.take_back(starts);
                self.model.put_ways(&ways, Vec2::ZERO);
                if let Some(area) = self.model.area(&area) {
                    self.model.areas[area].rect = start;
                }
            }
            _ => {}
        }
    }

    /// Puts cards back to their old positions; returns the positions that they were dragged to.
    fn take_back(&mut self, starts: BTreeMap<String, Pos2>) -> BTreeMap<usize, Pos2> {
        let model = &mut self.model;
        let back = starts.into_iter().filter_map(|(name, start)| {
            let card = model.find(&name)?;
            Some((card, std::mem::replace(&mut model.cards[card].at, start)))
        });
        back.collect()
    }

    fn end(&mut self, ui: &egui::Ui, session: &mut Session, pointer: Pos2) {
        match std::mem::take(&mut self.gesture) {
            Gesture::Idle | Gesture::Pan => {}
            Gesture::Net { caught, .. } => {
                self.wires.clear();
                self.area = None;
                session.select(caught);
            }
            Gesture::Bend { wire, .. } => {
                let places = self.model.wire(&wire).map(|wire| wire.bends.clone()).unwrap_or_default();
                self.bend_wire(ui, session, &wire, &places);
            }
            Gesture::Move { starts, ways, copies: true, .. } => {
                let names: BTreeSet<String> = starts.keys().cloned().collect();
                // with the positions and routes that they were dragged to
                let text = clip::text(session.document(), &self.model, &names);
                let ends = self.take_back(starts);
                self.model.put_ways(&ways, Vec2::ZERO);
                let is_moved = ends.into_iter().any(|(card, end)| self.model.cards[card].at != end);
                if is_moved {
                    let copied = text.and_then(|text| clip::paste(session.document(), &text, None, Vec2::ZERO));
                    self.add(ui, session, copied);
                }
            }
            Gesture::Move { starts, ways, onto, held, .. } => {
                let ends = self.take_back(starts);
                let right = self.model.find(&held).and_then(|card| ends.get(&card)).map(|end| end.x + WIDTH);
                let mut edits: Vec<Edit> = commands::moved(&self.model, ends).into_iter().collect();
                edits.extend(commands::ways(&self.model, &ways));
                self.model.put_ways(&ways, Vec2::ZERO);
                let wire = onto.and_then(|wire| self.model.wire(&wire).cloned());
                if let Some(wire) = wire {
                    let kind = self.model.find(&held).and_then(|card| self.model.cards[card].index);
                    let kind = kind.map(|index| session.document().graph().instance(index).node);
                    let wires = kind.and_then(|kind| commands::into_wire(&self.model, &wire, kind, &held));
                    if let (Some(_), Some(right)) = (&wires, right) {
                        edits.extend(commands::aside(&self.model, wire.to.card, right));
                    }
                    edits.extend(wires.into_iter().flatten());
                }
                if !edits.is_empty() {
                    self.apply(ui, session, &Edit::All(edits));
                }
            }
            Gesture::Shift { area: name, start, starts, ways, .. } => {
                let ends = self.take_back(starts);
                let led: Vec<Edit> = commands::ways(&self.model, &ways).collect();
                self.model.put_ways(&ways, Vec2::ZERO);
                let Some(area) = self.model.area(&name) else { return };
                let area = &mut self.model.areas[area];
                let moved = Area { rect: std::mem::replace(&mut area.rect, start), ..area.clone() };
                self.area = Some(name.clone());
                session.select([]);
                if moved.rect != start {
                    let frame = Edit::SetFrame { name, frame: Some(moved.frame()) };
                    let edits = commands::moved(&self.model, ends).into_iter().chain(led).chain([frame]);
                    self.apply(ui, session, &Edit::All(edits.collect()));
                }
            }
            Gesture::Link(link) => self.tie(ui, session, &link, pointer),
        }
    }

    /// Ends a wire: at a pin, at a new node, or nowhere.
    fn tie(&mut self, ui: &egui::Ui, session: &mut Session, link: &Link, pointer: Pos2) {
        let Some(fixed) = link.fixed(&self.model) else { return };
        let Some(lens) = self.lens else { return };
        match (&link.target, &link.detached) {
            (Some((spot, _)), detached) => {
                let mut edits = vec![commands::connect(&self.model, fixed, *spot)];
                let same = detached.as_ref().is_some_and(|wire| {
                    self.model.wire_into(*spot).is_some_and(|at| self.model.wire_name(at) == *wire)
                });
                if same {
                    return;
                }
                if let Some(wire) = detached {
                    edits.insert(0, commands::disconnect(wire));
                }
                self.apply(ui, session, &Edit::All(edits));
            }
            (None, Some(wire)) => {
                self.apply(ui, session, &commands::disconnect(wire));
            }
            (None, None) => {
                let purpose = Purpose::Wire { end: self.model.port_name(fixed), side: fixed.side };
                self.palette = Some(Palette::new(pointer, lens.to_graph(pointer), purpose));
                ui.ctx().request_repaint();
            }
        }
    }
}

/// Adds a node to the selection, or removes it.
fn toggle(session: &mut Session, name: &str) {
    let mut names: BTreeSet<String> = session.selection().map(str::to_owned).collect();
    if !names.remove(name) {
        names.insert(name.to_owned());
    }
    session.select(names);
}

/// The wire under a card into which the card can be inserted: the pins that it would use must be free.
fn wire_below(model: &Model, lens: Lens, card: usize, session: &Session) -> Option<WireName> {
    let held: &Card = &model.cards[card];
    let kind = session.document().graph().instance(held.index?).node;
    let lonely = held.outputs.iter().chain(&held.inputs).all(|pin| !pin.wired);
    if !lonely {
        return None;
    }
    let fits = |wire: &Wire| {
        wire.from.card != card && wire.to.card != card && commands::into_wire(model, wire, kind, &held.name).is_some()
    };
    // The wire must be under the upper part of the card's body, or under one of its pins.
    let middle = lens.to_screen(held.at + held.size() * 0.5);
    let top = lens.to_screen(held.at + egui::vec2(held.size().x * 0.5, 18.0));
    let wanted = |position: usize| fits(&model.wires[position]);
    let near = |point: Pos2| model.wire_at(lens, point, wanted);
    let steps = (0..=4).map(|step| top.lerp(middle, step as f32 / 4.0));
    let pins = model.spots(card).map(|spot| lens.to_screen(model.pin_at(spot)));
    steps.chain(pins).find_map(near)
}
