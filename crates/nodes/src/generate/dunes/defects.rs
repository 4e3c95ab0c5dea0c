//! Ends of crests.
//!
//! Around a point where a crest ends, the phase of the ridges grows by one turn more than on straight ridges, as around
//! an edge dislocation in a crystal. Ends come in pairs: between the two of a pair there is one crest more than beside
//! them, which joins none, or one less, a gap. The shift of the phase is the angle under which the pair is seen, and it
//! fades with distance. Positions are along and across the wind in wavelengths, and wind with the crests.

use std::f64::consts::TAU;

use orograph_graph::mix;

use super::square;
use crate::numerics::{math, noise::place};

/// Width of the lattice squares, each with at most one pair: a pair acts no farther.
const SQUARE: f64 = 3.0;
/// Half of the distance between the ends of a pair.
const HALF: [f64; 2] = [0.3, 0.9];
/// Distance beyond its ends up to which a pair acts fully, and that over which it fades.
const FADES: [f64; 2] = [0.3, 1.8];
/// Largest angle between a pair and the crest.
const TURN: f64 = 0.5;
/// Distance from an end at which a ridge has half of its height.
const LOW: f64 = 0.3;

/// What pairs do to the ridges at a place.
pub struct Shift {
    /// Shift of the phase.
    pub by: f64,
    /// Its slope along and across the wind, per wavelength.
    pub slope: [f64; 2],
    /// The share of the height that is left.
    pub share: f64,
}

/// Two ends of crests.
struct Pair {
    centre: [f64; 2],
    /// From the centre to one of the ends.
    half: [f64; 2],
    /// Length of `half`.
    length: f64,
    /// 1 with one crest more between them, -1 with one less.
    sign: f64,
}

/// The pairs of a field of ridges, of which those near the last place are known.
pub struct Defects {
    chance: f64,
    seed: u32,
    near: Option<([i64; 2], Vec<Pair>)>,
}

impl Defects {
    /// Pairs in that share of the lattice squares.
    pub fn new(chance: f64, seed: u32) -> Self {
        Self { chance, seed, near: None }
    }

    /// Returns what pairs do to a place.
    pub fn shift(&mut self, place: [f64; 2]) -> Shift {
        let here = place.map(|at| square(at, SQUARE));
        if self.near.as_ref().is_none_or(|(of, _)| *of != here) {
            let around = (-1..=1).flat_map(|j| (-1..=1).map(move |i| [here[0] + i, here[1] + j]));
            self.near = Some((here, around.filter_map(|square| self.pair(square)).collect()));
        }
        let mut shift = Shift { by: 0.0, slope: [0.0; 2], share: 1.0 };
        self.near.iter().flat_map(|(_, pairs)| pairs).for_each(|pair| pair.act(place, &mut shift));
        shift
    }

    /// Returns the pair of a lattice square.
    fn pair(&self, square: [i64; 2]) -> Option<Pair> {
        let key = place::key_at(self.seed, square);
        let unit = |salt: u32| f64::from(mix(key ^ salt) >> 8) / f64::from(1 << 24);
        (unit(0x9e37_79b9) < self.chance).then(|| {
            let centre =
                [(square[0] as f64 + unit(0x3c6e_f372)) * SQUARE, (square[1] as f64 + unit(0xdaa6_6d2b)) * SQUARE];
            let length = HALF[0] + (HALF[1] - HALF[0]) * unit(0x78dd_e6e4);
            let turn = TURN * (2.0 * unit(0x5be0_cd19) - 1.0);
            let sign = if unit(0x510e_527f) < 0.5 { -1.0 } else { 1.0 };
            Pair { centre, half: [length * math::sin(turn), length * math::cos(turn)], length, sign }
        })
    }
}

impl Pair {
    fn act(&self, place: [f64; 2], shift: &mut Shift) {
        let from = [place[0] - self.centre[0], place[1] - self.centre[1]];
        let (far, full) = (math::hypot(from[0], from[1]), self.length + FADES[0]);
        if far >= full + FADES[1] {
            return;
        }
        // seen from the place
        let a = [self.half[0] - from[0], self.half[1] - from[1]];
        let b = [-self.half[0] - from[0], -self.half[1] - from[1]];
        let squares = [a, b].map(|[u, v]| (u * u + v * v).max(1e-12));
        let turn = math::atan2(a[0] * b[1] - a[1] * b[0], a[0] * b[0] + a[1] * b[1]);
        let of_turn = [b[1] / squares[1] - a[1] / squares[0], a[0] / squares[0] - b[0] / squares[1]];
        // a cubic from 1 to 0
        let t = ((far - full) / FADES[1]).max(0.0);
        let (share, of_share) = (1.0 - t * t * (3.0 - 2.0 * t), -6.0 * t * (1.0 - t) / (FADES[1] * far.max(1e-6)));
        shift.by += self.sign * share * turn / TAU;
        for k in 0..2 {
            shift.slope[k] += self.sign * (share * of_turn[k] + of_share * from[k] * turn) / TAU;
        }
        let left: f64 = squares.iter().map(|square| square / (square + LOW * LOW)).product();
        shift.share *= 1.0 - share * (1.0 - left);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stated slopes are those of the shift, and round one end of a crest the phase grows by one turn.
    #[test]
    fn slopes_and_turns_are_those_of_an_end() {
        let mut defects = Defects::new(1.0, 5);
        let mut by = |u: f64, v: f64| defects.shift([u, v]).by;
        let turns = |difference: f64| difference - difference.round();
        for k in 0..2000 {
            let [u, v] = [0.31, 0.17].map(|step| f64::from(k) * step % 40.0);
            let found = Defects::new(1.0, 5).shift([u, v]).slope;
            let expected = [turns(by(u + 1e-6, v) - by(u - 1e-6, v)), turns(by(u, v + 1e-6) - by(u, v - 1e-6))];
            for (found, expected) in found.iter().zip(expected) {
                // 1e-4 of slopes, and the rounding of differences of 2e-6
                assert!((found - 0.5e6 * expected).abs() < 1e-4 * (1.0 + found.abs() * found * found), "{k}: {found}");
            }
        }
        let pair = defects.pair([4, 7]).expect("a pair in each square");
        for (end, expected) in [(1.0, 1.0), (-1.0, -1.0)] {
            let [u, v] = [0, 1].map(|axis| pair.centre[axis] + end * pair.half[axis]);
            let around = |k: i32| {
                let angle = f64::from(k) * TAU / 360.0;
                defects.shift([u + 0.02 * math::cos(angle), v + 0.02 * math::sin(angle)]).by
            };
            let all: Vec<f64> = (0..=360).map(around).collect();
            let winding: f64 = all.windows(2).map(|pair| turns(pair[1] - pair[0])).sum();
            assert!((winding * pair.sign * expected + 1.0).abs() < 1e-9, "{winding}");
        }
    }
}
