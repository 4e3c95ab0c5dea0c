//! The surface that layers follow: dip, folds, swells and a fault.

use orograph_graph::mix;

use super::Params;
use crate::{
    numerics::{
        joins::{Joins, Weights},
        math,
        waves::{SHORTEST_CELLS, Sampler, Waves},
    },
    prelude::*,
};

/// Ratio of the wavelengths of the winding of folds along the strike to those across it.
const ALONG: f64 = 4.0;
/// The longest swells, in metres.
const SWELLS_M: f64 = 6e3;

/// The structure as a function of position.
pub struct Structure<'a> {
    params: &'a Params,
    /// Unit vector across the strike, to the right.
    across: [f64; 2],
    centre_m: [f64; 2],
    sine: f64,
    cosine: f64,
    winding: Sampler,
    swells: Sampler,
    joins: Option<Joins>,
}

impl<'a> Structure<'a> {
    /// The structure of a node.
    #[must_use]
    pub fn new(params: &'a Params, job: &Job<'_>) -> Self {
        let (azimuth, dip) = (params.strike.to_radians(), params.dip.to_radians());
        // y is south
        let along = [math::sin(azimuth), -math::cos(azimuth)];
        let grain = math::atan2(along[1], along[0]);
        let waves = |which: u32, longest_m: f64, spectral_slope: f64, stretch: f64| {
            let seed = mix(job.seed() ^ mix(0x57A7_0001 + which));
            Waves { longest_m, spectral_slope, stretch, grain, seed }.endless(SHORTEST_CELLS * job.cell_m())
        };
        Self {
            params,
            across: [-along[1], along[0]],
            centre_m: job.world().size.map(|size| 0.5 * size),
            sine: math::sin(dip),
            cosine: math::cos(dip),
            winding: waves(0, params.fold_length, 4.0, ALONG),
            swells: waves(1, SWELLS_M, 3.5, 1.0),
            // over half of the world, so that dips turn back as gently as they can
            joins: Joins::of(job.world(), f64::INFINITY, Weights::Mean),
        }
    }

    /// What is subtracted in the stratigraphic height at a position, in metres.
    #[must_use]
    pub fn offset_m(&self, at: [f64; 2]) -> f64 {
        Joins::apply(self.joins.as_ref(), at, |at| self.endless_m(at))
    }

    fn endless_m(&self, at: [f64; 2]) -> f64 {
        let params = self.params;
        let [x, y] = [0, 1].map(|axis| at[axis] - self.centre_m[axis]);
        let across = x * self.across[0] + y * self.across[1];
        let mut raised = 0.0;
        if params.fold_height > 0.0 {
            let winding = if params.winding > 0.0 { params.winding * self.winding.at(at) } else { 0.0 };
            let place = across / params.fold_length + winding;
            raised += params.fold_height * math::cos(std::f64::consts::TAU * place);
        }
        if params.swells > 0.0 {
            raised += params.swells * self.swells.at(at);
        }
        if params.throw != 0.0 && is_right_of(&params.fault.0, at) {
            raised -= params.throw;
        }
        raised * self.cosine - across * self.sine
    }
}

/// Returns true if a position is to the right of a path that is straight beyond its ends, for somebody who walks along
/// it.
fn is_right_of(path: &[[f64; 2]], at: [f64; 2]) -> bool {
    let last = path.len() - 2;
    let mut nearest = (f64::INFINITY, 0.0_f64);
    for (segment, ends) in path.windows(2).enumerate() {
        let [from, to] = [ends[0], ends[1]];
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        let [px, py] = [at[0] - from[0], at[1] - from[1]];
        let lowest = if segment == 0 { f64::NEG_INFINITY } else { 0.0 };
        let highest = if segment == last { f64::INFINITY } else { 1.0 };
        let length2 = dx * dx + dy * dy;
        let share = ((px * dx + py * dy) / length2).clamp(lowest, highest);
        let [qx, qy] = [px - share * dx, py - share * dy];
        // y is south: the right is where the cross product is positive
        let side = (dx * py - dy * px) / length2.sqrt();
        let distance2 = qx * qx + qy * qy;
        // beside a corner two segments are equally near; the one that sees the position from its side decides
        let is_nearer = distance2 < nearest.0 * (1.0 - 1e-12);
        let is_as_near = distance2 <= nearest.0 * (1.0 + 1e-12);
        if is_nearer || is_as_near && side.abs() > nearest.1.abs() {
            nearest = (distance2, side);
        }
    }
    nearest.1 > 0.0
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_side_of_a_bent_path_is_that_of_its_nearest_part() {
        // to the east, then to the south: a right turn
        let path = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]];
        for (at, is_right) in [
            ([5.0, 1.0], true),
            ([5.0, -1.0], false),
            ([9.0, 5.0], true),
            ([11.0, 5.0], false),
            // outside the corner
            ([12.0, -1.0], false),
            ([11.0, -2.0], false),
            // beyond the ends
            ([-50.0, 1.0], true),
            ([-50.0, -1.0], false),
            ([9.0, 80.0], true),
            ([11.0, 80.0], false),
        ] {
            assert_eq!(super::is_right_of(&path, at), is_right, "{at:?}");
        }
        // a left turn: to the east, then to the north
        let path = [[0.0, 0.0], [10.0, 0.0], [10.0, -10.0]];
        for (at, is_right) in [([12.0, 1.0], true), ([11.0, 2.0], true), ([9.0, -1.0], false), ([11.0, -5.0], true)] {
            assert_eq!(super::is_right_of(&path, at), is_right, "{at:?}");
        }
    }
}
