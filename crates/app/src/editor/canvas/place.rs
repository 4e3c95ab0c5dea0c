//! Automatic positions for nodes that have none in the document: in layers, so that wires run from left to right.

use std::collections::BTreeMap;

use egui::{Direction, Pos2, Rect, Vec2, pos2, vec2};
use egui_graph::{LayoutNode, LayoutParams, NodeId};

use super::model::{Model, Side};

/// The grid step to which positions are rounded.
pub(super) const STEP: f32 = 12.0;
/// Space between layers, and between the nodes of a layer.
const GAPS: [f32; 2] = [72.0, 36.0];

/// A position on the grid.
pub(super) fn on_grid(at: Pos2) -> Pos2 {
    pos2((at.x / STEP).round() * STEP, (at.y / STEP).round() * STEP)
}

/// Positions of some cards in layers, along the wires among them; the north-west corner is at the origin.
pub(super) fn layered(model: &Model, wanted: impl Fn(usize) -> bool) -> BTreeMap<usize, Pos2> {
    let id = |card: usize| NodeId::from_u64(card as u64);
    let offsets = |card: usize, side: Side| {
        let card = &model.cards[card];
        (0..card.pins(side).len()).map(|pin| card.pin_offset(pin)).collect::<Vec<_>>()
    };
    let nodes = (0..model.cards.len()).filter(|card| wanted(*card)).map(|card| {
        let node = LayoutNode::new(model.cards[card].size())
            .input_offsets(offsets(card, Side::Input))
            .output_offsets(offsets(card, Side::Output));
        (id(card), node)
    });
    let wires = model.wires.iter().filter(|wire| wanted(wire.from.card) && wanted(wire.to.card));
    let wires = wires.map(|wire| ((id(wire.from.card), wire.from.pin), (id(wire.to.card), wire.to.pin)));
    let params = LayoutParams::new(Direction::LeftToRight)
        .layer_gap(GAPS[0])
        .node_gap(GAPS[1])
        .component_gap(GAPS[0])
        .straighten_edges(true);
    let layout = egui_graph::layout(nodes, wires, params);
    let places: BTreeMap<usize, Pos2> = layout.into_iter().map(|(node, at)| (node.value() as usize, at)).collect();
    let corner = places.values().fold(Pos2::new(f32::INFINITY, f32::INFINITY), |corner, at| corner.min(*at));
    places.into_iter().map(|(card, at)| (card, on_grid(at - corner.to_vec2()))).collect()
}

/// Gives a position to every card that has none: its previous one, otherwise one in a layer, beside the cards it is
/// wired to.
pub(super) fn fill(model: &mut Model, places: &mut BTreeMap<String, Pos2>) {
    let mut free = Vec::new();
    for (position, card) in model.cards.iter_mut().enumerate().filter(|(_, card)| !card.placed) {
        match places.get(&card.name) {
            Some(at) => card.at = *at,
            None => free.push(position),
        }
    }
    if free.is_empty() {
        return;
    }
    // A node between two others needs a layer of its own: if no position was set by hand, all nodes are arranged again.
    let new = |card: usize| free.contains(&card);
    let between = |card: &usize| {
        model.wires.iter().any(|wire| wire.to.card == *card && !new(wire.from.card))
            && model.wires.iter().any(|wire| wire.from.card == *card && !new(wire.to.card))
    };
    if free.iter().any(between) && model.cards.iter().all(|card| !card.placed) {
        free = (0..model.cards.len()).collect();
    }
    let layers = layered(model, |_| true);
    let mut settled: Vec<bool> = (0..model.cards.len()).map(|card| !free.contains(&card)).collect();
    let all_free = settled.iter().all(|settled| !settled);
    let shifts: Vec<Vec2> =
        layers.iter().filter(|(card, _)| settled[**card]).map(|(card, at)| model.cards[*card].at - *at).collect();
    let mean = shifts.iter().fold(Vec2::ZERO, |sum, shift| sum + *shift) / shifts.len().max(1) as f32;
    for position in free {
        let Some(at) = layers.get(&position).copied() else { continue };
        let above = model.wires.iter().filter(|wire| wire.to.card == position).map(|wire| wire.from.card);
        let below = model.wires.iter().filter(|wire| wire.from.card == position).map(|wire| wire.to.card);
        let neighbour = above.chain(below).find(|card| settled[*card]);
        let shift = neighbour.map_or(mean, |other| model.cards[other].at - layers[&other]);
        model.cards[position].at = on_grid(at + shift);
        if !all_free {
            let taken = |rect: Rect| {
                let others = model.cards.iter().enumerate().filter(|(other, _)| settled[*other]);
                others.map(|(_, card)| card.rect()).find(|other| other.expand(STEP).intersects(rect))
            };
            let mut rect = model.cards[position].rect();
            while let Some(other) = taken(rect) {
                rect = rect.translate(vec2(0.0, other.max.y + 2.0 * STEP - rect.min.y));
            }
            model.cards[position].at = rect.min;
        }
        settled[position] = true;
        places.insert(model.cards[position].name.clone(), model.cards[position].at);
    }
}
