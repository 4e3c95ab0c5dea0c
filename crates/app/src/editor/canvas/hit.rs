//! Finds what is under the pointer, and which pins can be connected.

use std::collections::BTreeSet;

use egui::Pos2;

use super::{
    lens::Lens,
    model::{Area, Model, Side, Spot, WireName},
};

/// The part of the graph under a point of the window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Hit {
    Pin(Spot),
    Card(usize),
    Wire(WireName),
    /// A route point of a wire.
    Bend(WireName, usize),
    /// The title bar of a frame.
    Head(usize),
    /// The resize corner of a frame.
    Corner(usize),
    Ground,
}

/// Maximum distance from the pointer to a wire, in points of the window.
const NEAR_WIRE: f32 = 7.0;

impl Model {
    /// The topmost part of the graph under a point of the window. `order` lists the cards in drawing order, the topmost
    /// last.
    pub(super) fn hit(&self, lens: Lens, order: &[usize], point: Pos2) -> Hit {
        if let Some(spot) = self.pin_near(lens, order, point, |_| true) {
            return Hit::Pin(spot);
        }
        if let Some(card) = self.card_at(lens, order, point) {
            return Hit::Card(card);
        }
        if let Some((wire, bend)) = self.bend_near(lens, point) {
            return Hit::Bend(wire, bend);
        }
        if let Some(wire) = self.wire_at(lens, point, |_| true) {
            return Hit::Wire(wire);
        }
        let place = lens.to_graph(point);
        let part = |(area, at): (usize, &Area)| match () {
            () if at.corner().contains(place) => Some(Hit::Corner(area)),
            () if at.head().contains(place) => Some(Hit::Head(area)),
            () => None,
        };
        self.areas.iter().enumerate().rev().find_map(part).unwrap_or(Hit::Ground)
    }

    /// The nearest pin to a point of the window. Returns None when none is near enough.
    pub(super) fn pin_near(
        &self,
        lens: Lens,
        order: &[usize],
        point: Pos2,
        wanted: impl Fn(Spot) -> bool,
    ) -> Option<Spot> {
        let place = lens.to_graph(point);
        let reach = (7.0 / lens.zoom).max(9.0);
        let near = order.iter().filter(|card| self.cards[**card].rect().expand(reach).contains(place));
        let spots = near.flat_map(|card| self.spots(*card)).filter(|spot| wanted(*spot));
        let distances = spots.map(|spot| (self.pin_at(spot).distance(place), spot));
        let nearest = distances.min_by(|(a, _), (b, _)| a.total_cmp(b));
        nearest.filter(|(distance, _)| *distance <= reach).map(|(_, spot)| spot)
    }

    /// The topmost card at a point of the window.
    pub(super) fn card_at(&self, lens: Lens, order: &[usize], point: Pos2) -> Option<usize> {
        let place = lens.to_graph(point);
        order.iter().rev().copied().find(|card| self.cards[*card].rect().contains(place))
    }

    /// The nearest wire to a point of the window. Returns None when none is near enough.
    pub(super) fn wire_at(&self, lens: Lens, point: Pos2, wanted: impl Fn(usize) -> bool) -> Option<WireName> {
        let distances = self
            .wires
            .iter()
            .enumerate()
            .filter(|(position, _)| wanted(*position))
            .map(|(_, wire)| (lens.distance_to_way(point, &self.places(wire)).0, wire));
        let nearest = distances.min_by(|(a, _), (b, _)| a.total_cmp(b));
        nearest.filter(|(distance, _)| *distance <= NEAR_WIRE).map(|(_, wire)| self.wire_name(wire))
    }

    /// The nearest route point to a point of the window. Returns None when none is near enough.
    fn bend_near(&self, lens: Lens, point: Pos2) -> Option<(WireName, usize)> {
        let bends = self.wires.iter().flat_map(|wire| wire.bends.iter().enumerate().map(move |bend| (wire, bend)));
        let distances = bends.map(|(wire, (at, bend))| (lens.to_screen(*bend).distance(point), wire, at));
        let (distance, wire, at) = distances.min_by(|(a, ..), (b, ..)| a.total_cmp(b))?;
        (distance <= NEAR_WIRE.max(6.0 * lens.zoom)).then(|| (self.wire_name(wire), at))
    }

    /// Returns true if a wire between two pins is allowed: from an output to an input that accepts it, without a cycle.
    /// `upstream` are the cards that must not read the wire.
    pub(super) fn fits(&self, a: Spot, b: Spot, barred: &BTreeSet<usize>) -> bool {
        let (output, input) = if a.side == Side::Output { (a, b) } else { (b, a) };
        output.side != input.side && !barred.contains(&b.card) && self.pin(input).ty.accepts(self.pin(output).ty)
    }

    /// The cards that a wire from or to this pin cannot connect to because it would close a cycle: the card itself, and
    /// all cards upstream (of an output) or downstream (of an input).
    pub(super) fn barred(&self, fixed: Spot) -> BTreeSet<usize> {
        let mut found = BTreeSet::from([fixed.card]);
        let mut queue = vec![fixed.card];
        while let Some(card) = queue.pop() {
            let next = self.wires.iter().filter_map(|wire| match fixed.side {
                Side::Output if wire.to.card == card => Some(wire.from.card),
                Side::Input if wire.from.card == card => Some(wire.to.card),
                _ => None,
            });
            for card in next {
                if found.insert(card) {
                    queue.push(card);
                }
            }
        }
        found
    }

    /// The pin of a card at which a wire from `fixed` can end, preferably a free one.
    pub(super) fn fitting_pin(&self, fixed: Spot, card: usize, barred: &BTreeSet<usize>) -> Option<Spot> {
        let fitting = || self.spots(card).filter(|spot| self.fits(fixed, *spot, barred));
        // An exact type match is better than a conversion.
        let exact = |spot: &Spot| self.pin(*spot).ty == self.pin(fixed).ty;
        let free = |spot: &Spot| spot.side == Side::Output || !self.pin(*spot).wired;
        let mut all: Vec<Spot> = fitting().collect();
        all.sort_by_key(|spot| (!free(spot), !exact(spot)));
        all.first().copied()
    }
}
