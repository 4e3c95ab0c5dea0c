//! Shallow slides: soil over rock, held by friction and cohesion, pushed by water.
//!
//! D. R. Montgomery and W. E. Dietrich (1994): the factor of safety of an infinite slope.

use super::{
    Params,
    draw::{Draw, Test},
    land::{Land, Room},
    noise::noise,
    wedge::GRAVITY,
};
use crate::numerics::{math, routing::code::STEPS};

/// Unit weight of water in N/m³.
const WATER: f64 = 1000.0 * GRAVITY;
/// The factor of safety below which soil goes with a patch that fails.
pub(super) const DRAGGED: f64 = 1.2;
/// Distance over which the slope of soil is measured, in metres, unless cells are larger.
const SLOPE_M: f64 = 20.0;
/// Least thickness of soil that slides, in metres.
const LEAST_M: f64 = 0.05;

/// The strength of soil.
#[derive(Clone, Copy, Debug)]
pub(super) struct Soil {
    /// Cohesion with that of roots, in Pa.
    pub cohesion: f64,
    /// Tangent of the angle of friction.
    pub friction: f64,
    /// Unit weight of moist soil in N/m³.
    pub unit_weight: f64,
}

impl Soil {
    pub fn new(params: &Params) -> Self {
        Self {
            cohesion: params.soil_cohesion,
            friction: math::tan(params.soil_friction.to_radians()),
            unit_weight: params.soil_density * GRAVITY,
        }
    }

    /// Returns the factor of safety of soil of a thickness on a slope, of which the fraction `wet` from the base up is
    /// saturated.
    ///
    /// FS = (c + (γ − m γ_w) z cos² β tan φ) / (γ z sin β cos β); infinite on level ground and without soil.
    pub fn safety(&self, thickness_m: f64, tangent: f64, wet: f64) -> f64 {
        if thickness_m <= 0.0 || tangent <= 0.0 {
            return f64::INFINITY;
        }
        // cos² β and sin β cos β
        let square = 1.0 / (1.0 + tangent * tangent);
        let wet = wet.clamp(0.0, 1.0);
        let holds = self.cohesion + (self.unit_weight - wet * WATER).max(0.0) * thickness_m * square * self.friction;
        holds / (self.unit_weight * thickness_m * tangent * square)
    }
}

/// Returns the gradient at a place.
fn gradient(land: &Land, [x, y]: [f64; 2]) -> [f64; 2] {
    let half = 0.5 * SLOPE_M.max(land.cell_m);
    let between = |one: [f64; 2], other: [f64; 2]| {
        // at a side of the world over half of the distance
        let inside = |place: [f64; 2]| if land.holds(place) { place } else { [x, y] };
        let (one, other) = (inside(one), inside(other));
        let run = (other[0] - one[0]) + (other[1] - one[1]);
        if run > 0.0 { (land.height_m(other) - land.height_m(one)) / run } else { 0.0 }
    };
    [between([x - half, y], [x + half, y]), between([x, y - half], [x, y + half])]
}

/// Returns the cells whose soil slides in a test, with its thickness. Empty if it holds.
pub(super) fn cells(
    land: &Land,
    soil: &Soil,
    wet: &dyn Fn(usize) -> f64,
    test: &Test,
    params: &Params,
    room: &mut Room,
) -> Vec<(u32, f64)> {
    let safety = |cell: usize| {
        let [p, q] = gradient(land, land.centre_m(cell));
        soil.safety(land.soil[cell], (p * p + q * q).sqrt(), wet(cell))
    };
    let (top_m, length_m) = (test.place_m(), test.length_m(params));
    let first = land.cell_at(top_m);
    if land.soil[first] < LEAST_M || safety(first) >= 1.0 {
        return Vec::new();
    }
    let [p, q] = gradient(land, top_m);
    let steep = (p * p + q * q).sqrt().max(f64::MIN_POSITIVE);
    let down = [-p / steep, -q / steep];
    let (half, outline) = (0.5 * length_m, test.hash(Draw::Outline));
    let width = half * (0.3 + 0.3 * test.unit(Draw::Width));
    let inside = |cell: usize| {
        let [x, y] = land.offset_m(top_m, cell);
        let along = (x * down[0] + y * down[1] - 0.5 * half) / half;
        let across = (y * down[0] - x * down[1]) / width;
        let rough = noise([along, across].map(|at| 2.0 * at), outline)
            + 0.5 * noise([along, across].map(|at| 5.0 * at), !outline);
        math::hypot(along, across) * (1.0 + 2.0 * params.roughness * rough) < 1.0
    };
    room.seen[first] = true;
    let mut cells = vec![(first as u32, land.soil[first])];
    let mut at = 0;
    while let Some(&(cell, _)) = cells.get(at) {
        for way in 0..STEPS.len() {
            let Some(next) = land.neighbour(cell as usize, way).filter(|next| !room.seen[*next]) else { continue };
            if inside(next) && land.soil[next] >= LEAST_M && safety(next) < DRAGGED {
                room.seen[next] = true;
                cells.push((next as u32, land.soil[next]));
            }
        }
        at += 1;
    }
    cells.iter().for_each(|(cell, _)| room.seen[*cell as usize] = false);
    // debris on the soil goes with it
    cells.iter_mut().for_each(|(cell, depth)| *depth += land.debris[*cell as usize]);
    cells
}
