//! The surface on which a wedge fails, and the cells above it.

use super::{
    land::{Land, Room},
    noise::noise,
};
use crate::numerics::{math, routing::code::STEPS};

/// Tangent of the walls of a scar, relative to its plane.
const WALL: f64 = 1.73;
/// Tangent of the rise of the failure surface in front of the toe.
const FRONT: f64 = 0.5;
/// How the thickness of the weak zone falls to 0 at its outline: 1 is a paraboloid, smaller powers have steeper edges.
const EDGE_POWER: f64 = 0.6;
/// Place of the toe in the lower half of the outline: 1 is on the outline.
const TOE: f64 = 0.9;
/// Smallest depth of a scar.
const LEAST_M: f64 = 0.1;

/// The surface on which a wedge fails.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scar {
    pub toe_m: [f64; 2],
    pub toe_height_m: f64,
    /// Unit vector up the plane.
    pub up: [f64; 2],
    /// Tangent of the dip.
    pub dip: f64,
    /// Thickness of the weak zone in metres, below its middle, which no depth exceeds.
    pub thickness_m: f64,
    pub length_m: f64,
    pub width_m: f64,
    pub roughness: f64,
    pub outline: u32,
}

impl Scar {
    /// Returns the depth that slides off a cell; not positive outside of the scar.
    fn depth_m(&self, land: &Land, cell: usize) -> f64 {
        let [x, y] = land.offset_m(self.toe_m, cell);
        let along = x * self.up[0] + y * self.up[1];
        let across = y * self.up[0] - x * self.up[1];
        let (half, length) = (0.5 * self.width_m, self.length_m);
        if along < -0.25 * length || along > 2.0 * length || across.abs() > 4.0 * half {
            return -1.0;
        }
        let place = [along, across].map(|at| at / length);
        let rough = |scale: f64, salt: u32| noise(place.map(|at| scale * at), self.outline ^ salt);
        let rough_outline = 1.0 + self.roughness * (rough(3.0, 1) + 0.4 * rough(8.0, 2));
        // 1 on the outline, an ellipse that reaches a little below the toe
        let beyond = along / (0.5 * length) - 1.0;
        let radius = rough_outline * math::hypot(beyond.max(-TOE * beyond), across / half);
        let inside = 1.0 - radius * radius;
        if inside <= 0.0 {
            return -1.0;
        }
        // walls stand around the head and along the flanks
        let wall = (rough_outline * math::hypot(beyond.max(0.0), across / half) - 0.7).max(0.0);
        let floor = 0.04 * self.roughness * length * (rough(6.0, 3) + 0.5 * rough(14.0, 4));
        let up = along.max(0.0);
        let plane = self.dip * up + FRONT * (up - along);
        let depth = land.ground[cell] - (self.toe_height_m + plane + WALL * half * wall * wall / 1.2 + floor);
        let ratio = depth / (self.thickness_m * math::pow(inside, EDGE_POWER));
        if depth > 0.0 { depth / (1.0 + ratio * ratio).sqrt() } else { depth }
    }

    /// Returns the cells that slide, with their depths: those above the failure surface that are connected with the
    /// foot of the scar.
    pub fn cells(&self, land: &Land, room: &mut Room) -> Vec<(u32, f64)> {
        let steps = (2.0 * self.length_m / land.cell_m).ceil() as usize;
        let places = (0..=steps).map(|k| 0.5 * land.cell_m * k as f64);
        let along = places.map(|s| [0, 1].map(|axis| self.toe_m[axis] + s * self.up[axis]));
        let Some(first) = along
            .filter(|place| land.holds(*place))
            .map(|place| land.cell_at(place))
            .find(|&cell| self.depth_m(land, cell) > LEAST_M)
        else {
            return Vec::new();
        };
        room.seen[first] = true;
        let mut cells = vec![(first as u32, self.depth_m(land, first))];
        let mut at = 0;
        while let Some(&(cell, _)) = cells.get(at) {
            for way in 0..STEPS.len() {
                let Some(next) = land.neighbour(cell as usize, way).filter(|next| !room.seen[*next]) else { continue };
                let depth = self.depth_m(land, next);
                if depth > LEAST_M {
                    room.seen[next] = true;
                    cells.push((next as u32, depth));
                }
            }
            at += 1;
        }
        cells.iter().for_each(|(cell, _)| room.seen[*cell as usize] = false);
        cells
    }
}
