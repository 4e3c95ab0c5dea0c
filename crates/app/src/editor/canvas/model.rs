//! The drawable form of a document: a card for each node, with pins, and wires between pins.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use egui::{Pos2, Rect, Vec2, pos2, vec2};
use orograph_graph::{Document, Fallback, Frame, FrameEntry, NodeIndex, PortType, Srgb};

use super::place;

/// Width of a card.
pub(super) const WIDTH: f32 = 180.0;
/// Height of the title.
pub(super) const TITLE: f32 = 36.0;
/// Side of the square of the thumbnail.
pub(super) const PICTURE: f32 = 84.0;
/// Height of a row of pins.
pub(super) const ROW: f32 = 19.0;
/// Padding around the parts of a card.
pub(super) const PAD: f32 = 6.0;
/// Height of the title bar by which a frame is dragged, and side of its resize corner.
const HEAD: f32 = 30.0;
const GRIP: f32 = 18.0;

/// A pin: the end of a wire at a card.
#[derive(Clone, Debug)]
pub(super) struct Pin {
    /// Name of the input or output.
    pub(super) name: &'static str,
    pub(super) doc: &'static str,
    pub(super) ty: PortType,
    pub(super) wired: bool,
    /// True if a required wire is missing.
    pub(super) missing: bool,
    /// The constant that replaces a wire.
    pub(super) constant: Option<f64>,
}

impl Pin {
    /// The constant with its unit.
    pub(super) fn constant_text(&self) -> Option<String> {
        self.constant.map(|value| self.ty.unit().display(value))
    }
}

/// The card of a node.
#[derive(Clone, Debug)]
pub(super) struct Card {
    pub(super) name: String,
    pub(super) kind: String,
    pub(super) category: &'static str,
    pub(super) summary: &'static str,
    /// The node; None for an unknown node type.
    pub(super) index: Option<NodeIndex>,
    pub(super) inputs: Vec<Pin>,
    pub(super) outputs: Vec<Pin>,
    /// Its north-west corner.
    pub(super) at: Pos2,
    /// True if the document has its position.
    pub(super) placed: bool,
    /// True if it is collapsed: only its title is drawn.
    pub(super) collapsed: bool,
    /// True if it is muted.
    pub(super) muted: bool,
    /// The note, shown below it.
    pub(super) note: String,
}

/// An area behind the cards, with a name and a note.
#[derive(Clone, Debug)]
pub(super) struct Area {
    pub(super) name: String,
    pub(super) rect: Rect,
    pub(super) note: String,
    pub(super) colour: Option<Srgb>,
}

impl Area {
    /// The title bar by which it is dragged.
    pub(super) fn head(&self) -> Rect {
        Rect::from_min_size(self.rect.min, vec2(self.rect.width(), HEAD.min(self.rect.height())))
    }

    /// The corner by which it is resized.
    pub(super) fn corner(&self) -> Rect {
        Rect::from_min_max(self.rect.max - Vec2::splat(GRIP), self.rect.max)
    }

    /// The frame as the document describes it.
    pub(super) fn frame(&self) -> Frame {
        let pair = |x: f32, y: f32| [f64::from(x.round()), f64::from(y.round())];
        Frame {
            at: pair(self.rect.min.x, self.rect.min.y),
            size: pair(self.rect.width(), self.rect.height()),
            note: self.note.clone(),
            colour: self.colour,
        }
    }
}

impl Card {
    pub(super) fn size(&self) -> Vec2 {
        vec2(WIDTH, if self.collapsed { TITLE } else { self.rows_top() + self.rows() as f32 * ROW + PAD })
    }

    pub(super) fn rect(&self) -> Rect {
        Rect::from_min_size(self.at, self.size())
    }

    fn rows(&self) -> usize {
        self.inputs.len().max(self.outputs.len())
    }

    /// Distance from the top of the card to the rows of pins.
    pub(super) fn rows_top(&self) -> f32 {
        if self.index.is_some() { TITLE + PICTURE + 2.0 * PAD } else { TITLE + PAD }
    }

    pub(super) fn pins(&self, side: Side) -> &[Pin] {
        match side {
            Side::Input => &self.inputs,
            Side::Output => &self.outputs,
        }
    }

    /// Distance from the top of the card to the centre of a pin.
    pub(super) fn pin_offset(&self, pin: usize) -> f32 {
        if self.collapsed { TITLE / 2.0 } else { self.rows_top() + (pin as f32 + 0.5) * ROW }
    }

    /// The centre of a pin.
    pub(super) fn pin_at(&self, side: Side, pin: usize) -> Pos2 {
        let x = if side == Side::Input { self.at.x } else { self.at.x + WIDTH };
        pos2(x, self.at.y + self.pin_offset(pin))
    }

    /// The largest square below the title, for a thumbnail without text.
    pub(super) fn body(&self) -> Rect {
        let room = Rect::from_min_max(self.at + vec2(0.0, TITLE), self.rect().max).shrink2(vec2(14.0, PAD));
        Rect::from_center_size(room.center(), Vec2::splat(room.size().min_elem()))
    }

    /// The square of the thumbnail; its text is beside it.
    pub(super) fn picture(&self) -> Rect {
        Rect::from_min_size(self.at + vec2(PAD, TITLE + PAD), Vec2::splat(PICTURE))
    }
}

/// The side of a card that a pin is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Side {
    Input,
    Output,
}

/// A pin of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Spot {
    /// Index of the card.
    pub(super) card: usize,
    pub(super) side: Side,
    /// Index of the pin on its side.
    pub(super) pin: usize,
}

/// A wire, by the indices of cards and pins.
#[derive(Clone, Debug)]
pub(super) struct Wire {
    pub(super) from: Spot,
    pub(super) to: Spot,
    pub(super) ty: PortType,
    /// Its route points.
    pub(super) bends: Vec<Pos2>,
}

/// The identity of a wire: each input has at most one.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct WireName {
    /// The node with the input.
    pub(super) node: String,
    pub(super) input: &'static str,
}

/// The drawable form of a document.
#[derive(Clone, Debug, Default)]
pub(super) struct Model {
    pub(super) cards: Vec<Card>,
    pub(super) wires: Vec<Wire>,
    /// In drawing order, the largest first.
    pub(super) areas: Vec<Area>,
    by_name: HashMap<String, usize>,
}

impl Model {
    /// The model of a document. `places` has positions of nodes that have none in the document; new ones are added.
    pub(super) fn of(document: &Document, collapsed: &BTreeSet<String>, places: &mut BTreeMap<String, Pos2>) -> Self {
        let mut model = Self::default();
        let graph = document.graph();
        let mut of_index = HashMap::new();
        for entry in document.nodes() {
            let card = entry.index.map_or_else(
                || Card {
                    name: entry.name.clone(),
                    kind: entry.kind.clone(),
                    category: "",
                    summary: "",
                    index: None,
                    inputs: Vec::new(),
                    outputs: Vec::new(),
                    at: Pos2::ZERO,
                    placed: false,
                    collapsed: false,
                    muted: false,
                    note: String::new(),
                },
                |index| card(document, index),
            );
            if let Some(index) = entry.index {
                of_index.insert(index, model.cards.len());
            }
            model.by_name.insert(entry.name.clone(), model.cards.len());
            let at = entry.layout.map(|[x, y]| pos2(x as f32, y as f32)).filter(|at| at.is_finite());
            model.cards.push(Card {
                at: at.unwrap_or_default(),
                placed: at.is_some(),
                collapsed: collapsed.contains(&entry.name),
                muted: entry.muted,
                note: entry.note.clone(),
                ..card
            });
        }
        let ways: HashMap<(&str, &str), Vec<Pos2>> = document
            .reroutes()
            .iter()
            .map(|way| {
                let places = way.places.iter().map(|[x, y]| pos2(*x as f32, *y as f32)).filter(|at| at.is_finite());
                ((way.node.as_str(), way.input.as_str()), places.collect())
            })
            .collect();
        for (position, entry) in document.nodes().iter().enumerate() {
            let Some(index) = entry.index else { continue };
            for input in 0..model.cards[position].inputs.len() {
                let Some(source) = graph.source(index, input) else { continue };
                let Some(card) = of_index.get(&source.node).copied() else { continue };
                model.cards[position].inputs[input].wired = true;
                model.cards[card].outputs[source.output].wired = true;
                let (name, node) = (model.cards[position].inputs[input].name, &entry.name);
                let bends = ways.get(&(node.as_str(), name)).cloned().unwrap_or_default();
                model.wires.push(Wire {
                    from: Spot { card, side: Side::Output, pin: source.output },
                    to: Spot { card: position, side: Side::Input, pin: input },
                    ty: graph.output_type(source),
                    bends,
                });
            }
        }
        place::fill(&mut model, places);
        model.areas = document.frames().iter().filter_map(area).collect();
        // An inner frame is drawn over the outer one.
        model.areas.sort_by(|a, b| b.rect.area().total_cmp(&a.rect.area()));
        model
    }

    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// The bounding rectangle of all cards, or of those that `wanted` selects.
    pub(super) fn bounds(&self, wanted: impl Fn(&Card) -> bool) -> Rect {
        let cards = self.cards.iter().filter(|card| wanted(card));
        cards.fold(Rect::NOTHING, |all, card| all.union(card.rect()))
    }

    /// The bounding rectangle of all cards and frames.
    pub(super) fn extent(&self) -> Rect {
        let cards = self.areas.iter().fold(self.bounds(|_| true), |all, area| all.union(area.rect));
        self.wires.iter().flat_map(|wire| &wire.bends).fold(cards, |all, bend| all.union(Rect::from_pos(*bend)))
    }

    /// The points of a wire, from pin to pin.
    pub(super) fn places(&self, wire: &Wire) -> Vec<Pos2> {
        let ends = [self.pin_at(wire.from), self.pin_at(wire.to)];
        [ends[0]].into_iter().chain(wire.bends.iter().copied()).chain([ends[1]]).collect()
    }

    /// Restores the routes of wires, shifted.
    pub(super) fn put_ways(&mut self, ways: &BTreeMap<usize, Vec<Pos2>>, by: Vec2) {
        for (at, places) in ways {
            if let Some(wire) = self.wires.get_mut(*at) {
                wire.bends = places.iter().map(|place| *place + by).collect();
            }
        }
    }

    /// Moves a route point of a wire.
    pub(super) fn put_bend(&mut self, name: &WireName, at: usize, place: Pos2) {
        let wire = self.wires.iter().position(|wire| self.is(wire, name));
        if let Some(bend) = wire.and_then(|wire| self.wires[wire].bends.get_mut(at)) {
            *bend = place;
        }
    }

    /// The routes of the wires among some cards, by the indices of the wires.
    pub(super) fn ways_among(&self, inside: impl Fn(&str) -> bool) -> BTreeMap<usize, Vec<Pos2>> {
        let among = |wire: &&Wire| [wire.from, wire.to].iter().all(|spot| inside(&self.cards[spot.card].name));
        let wires = self.wires.iter().enumerate();
        wires
            .filter(|(_, wire)| !wire.bends.is_empty() && among(wire))
            .map(|(at, wire)| (at, wire.bends.clone()))
            .collect()
    }

    pub(super) fn area(&self, name: &str) -> Option<usize> {
        self.areas.iter().position(|area| area.name == name)
    }

    /// The input that a muted node passes on as its first output.
    pub(super) fn passed(&self, card: usize) -> Option<Spot> {
        let gives = self.cards[card].outputs.first()?.ty;
        self.wires_into(card).iter().find(|wire| gives.accepts(wire.ty)).map(|wire| wire.to)
    }

    /// The wires into the inputs of a card, in the order of the inputs: [`Self::of`] adds those of one card after those of
    /// another.
    fn wires_into(&self, card: usize) -> &[Wire] {
        let first = self.wires.partition_point(|wire| wire.to.card < card);
        let after = self.wires.partition_point(|wire| wire.to.card <= card);
        &self.wires[first..after]
    }

    pub(super) fn pin(&self, spot: Spot) -> &Pin {
        &self.cards[spot.card].pins(spot.side)[spot.pin]
    }

    pub(super) fn pin_at(&self, spot: Spot) -> Pos2 {
        self.cards[spot.card].pin_at(spot.side, spot.pin)
    }

    /// `node.port`.
    pub(super) fn port_name(&self, spot: Spot) -> String {
        format!("{}.{}", self.cards[spot.card].name, self.pin(spot).name)
    }

    pub(super) fn wire_name(&self, wire: &Wire) -> WireName {
        WireName { node: self.cards[wire.to.card].name.clone(), input: self.pin(wire.to).name }
    }

    /// Returns true if a wire has this identity.
    pub(super) fn is(&self, wire: &Wire, name: &WireName) -> bool {
        self.pin(wire.to).name == name.input && self.cards[wire.to.card].name == name.node
    }

    pub(super) fn wire(&self, name: &WireName) -> Option<&Wire> {
        self.wires_into(self.find(&name.node)?).iter().find(|wire| self.pin(wire.to).name == name.input)
    }

    /// The wire into an input.
    pub(super) fn wire_into(&self, spot: Spot) -> Option<&Wire> {
        self.wires_into(spot.card).iter().find(|wire| wire.to == spot)
    }

    /// All pins of a card, on both sides.
    pub(super) fn spots(&self, card: usize) -> impl Iterator<Item = Spot> {
        let side = move |side| (0..self.cards[card].pins(side).len()).map(move |pin| Spot { card, side, pin });
        side(Side::Input).chain(side(Side::Output))
    }
}

fn card(document: &Document, index: NodeIndex) -> Card {
    let graph = document.graph();
    let instance = graph.instance(index);
    let input = |(position, input): (usize, &orograph_graph::Input)| Pin {
        name: input.name,
        doc: input.doc,
        ty: input.ty,
        wired: false,
        missing: input.fallback == Fallback::Required && graph.source(index, position).is_none(),
        constant: match input.fallback {
            Fallback::Constant { default, .. } if graph.source(index, position).is_none() => {
                Some(instance.constants[position].unwrap_or(default))
            }
            _ => None,
        },
    };
    let output = |(output, declared): (usize, &orograph_graph::Output)| Pin {
        name: declared.name,
        doc: declared.doc,
        ty: graph.output_type(orograph_graph::Port { node: index, output }),
        wired: false,
        missing: false,
        constant: None,
    };
    Card {
        name: instance.name.clone(),
        kind: instance.node.id.to_owned(),
        category: instance.node.category,
        summary: instance.node.summary,
        index: Some(index),
        inputs: instance.node.inputs.iter().enumerate().map(input).collect(),
        outputs: instance.node.outputs.iter().enumerate().map(output).collect(),
        at: Pos2::ZERO,
        placed: false,
        collapsed: false,
        muted: false,
        note: String::new(),
    }
}

fn area(entry: &FrameEntry) -> Option<Area> {
    let [at, size] = [entry.frame.at, entry.frame.size].map(|[x, y]| vec2(x as f32, y as f32));
    let rect = Rect::from_min_size(at.to_pos2(), size);
    let area = Area { name: entry.name.clone(), rect, note: entry.frame.note.clone(), colour: entry.frame.colour };
    rect.is_finite().then_some(area)
}
