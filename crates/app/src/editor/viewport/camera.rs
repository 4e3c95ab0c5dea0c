//! The camera of the map.

use egui::{Pos2, Rect, Vec2, vec2};
use orograph_graph::Window;

/// The part of the world that the map shows. Positions are in metres from the world's origin, x east and y south.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Camera {
    /// The position in the centre of the pane.
    pub(super) centre: [f64; 2],
    /// Metres per point of the screen.
    pub(super) metres: f64,
}

impl Camera {
    /// Shows the whole world, with a margin.
    pub(super) fn fit(size: [f64; 2], pane: Rect) -> Self {
        let metres = (size[0] / f64::from(pane.width().max(1.0))).max(size[1] / f64::from(pane.height().max(1.0)));
        Self { centre: [size[0] / 2.0, size[1] / 2.0], metres: metres * 1.04 }
    }

    /// Converts a position to a point of the screen.
    pub(super) fn to_screen(self, pane: Rect, [x, y]: [f64; 2]) -> Pos2 {
        let [cx, cy] = self.centre;
        let offset = vec2(((x - cx) / self.metres) as f32, ((y - cy) / self.metres) as f32);
        pane.center() + offset
    }

    /// Converts a point of the screen to a position.
    pub(super) fn to_world(self, pane: Rect, at: Pos2) -> [f64; 2] {
        let offset = at - pane.center();
        [self.centre[0] + f64::from(offset.x) * self.metres, self.centre[1] + f64::from(offset.y) * self.metres]
    }

    /// Pans with the pointer, as if it held the terrain.
    pub(super) fn drag(&mut self, by: Vec2) {
        self.centre[0] -= f64::from(by.x) * self.metres;
        self.centre[1] -= f64::from(by.y) * self.metres;
    }

    /// Zooms around a point of the screen. The limits keep the world in view.
    pub(super) fn zoom(&mut self, pane: Rect, at: Pos2, factor: f64, size: [f64; 2]) {
        let place = self.to_world(pane, at);
        let whole = Self::fit(size, pane).metres;
        self.metres = (self.metres / factor).clamp(whole / 4096.0, whole * 4.0);
        let after = self.to_world(pane, at);
        self.centre = [self.centre[0] + place[0] - after[0], self.centre[1] + place[1] - after[1]];
    }

    /// The rectangle of the world on the screen.
    pub(super) fn world(self, pane: Rect, size: [f64; 2]) -> Rect {
        Rect::from_min_max(self.to_screen(pane, [0.0; 2]), self.to_screen(pane, size))
    }

    /// The rectangle of a window on the screen.
    pub(super) fn window(self, pane: Rect, window: &Window) -> Rect {
        let corner = |cells: [u32; 2]| self.to_screen(pane, cells.map(|count| f64::from(count) * window.cell_m()));
        let [first, size] = [window.origin, window.cells];
        Rect::from_min_max(corner(first), corner([first[0] + size[0], first[1] + size[1]]))
    }
}

#[cfg(test)]
mod tests {
    use egui::pos2;

    use super::*;

    const PANE: Rect = Rect { min: pos2(100.0, 50.0), max: pos2(500.0, 350.0) };

    #[test]
    fn the_whole_world_fits() {
        let camera = Camera::fit([8000.0, 2000.0], PANE);
        let world = camera.world(PANE, [8000.0, 2000.0]);
        assert!(PANE.contains_rect(world) && world.width() > 380.0, "{world:?}");
    }

    #[test]
    fn what_is_under_the_pointer_stays_there() {
        let mut camera = Camera::fit([8000.0, 8000.0], PANE);
        let at = pos2(220.0, 300.0);
        let place = camera.to_world(PANE, at);
        camera.zoom(PANE, at, 3.0, [8000.0; 2]);
        let there = camera.to_screen(PANE, place);
        assert!(there.distance(at) < 1e-2, "{there:?}");
        camera.drag(vec2(10.0, -4.0));
        let moved = camera.to_screen(PANE, place);
        assert!(moved.distance(at + vec2(10.0, -4.0)) < 1e-2, "{moved:?}");
    }
}
