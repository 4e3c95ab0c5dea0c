//! Route points of wires: each change is one edit.

use egui::Pos2;
use orograph_graph::Edit;

use super::{Canvas, Session, commands, model::WireName, place};

impl Canvas {
    /// Adds a route point to a wire, at a point of the window.
    pub(super) fn add_bend(&mut self, ui: &egui::Ui, session: &mut Session, name: &WireName, point: Pos2) {
        let (Some(lens), Some(wire)) = (self.lens, self.model.wire(name)) else { return };
        let (_, at) = lens.distance_to_way(point, &self.model.places(wire));
        let mut places = wire.bends.clone();
        places.insert(at, place::on_grid(lens.to_graph(point)));
        self.wires.clear();
        self.bend_wire(ui, session, name, &places);
        self.bend = Some((name.clone(), at));
    }

    /// Removes a route point of a wire.
    pub(super) fn remove_bend(&mut self, ui: &egui::Ui, session: &mut Session, name: &WireName, at: usize) {
        let mut places = self.model.wire(name).map(|wire| wire.bends.clone()).unwrap_or_default();
        if at < places.len() {
            places.remove(at);
            self.bend = None;
            self.bend_wire(ui, session, name, &places);
        }
    }

    /// Sets the route of a wire; also writes the positions of nodes that have none, so that the route fits them.
    pub(super) fn bend_wire(&mut self, ui: &egui::Ui, session: &mut Session, name: &WireName, places: &[Pos2]) {
        let edits = commands::settle(&self.model).chain([commands::way(name, places)]);
        self.apply(ui, session, &Edit::All(edits.collect()));
    }
}
