//! Barchans: crescents on bare ground, on lattices of squares with at most one each.

use orograph_graph::{memory::zeroed, mix};

use super::{Params, REACH, SALTS, square};
use crate::{
    numerics::{math, noise::place, par},
    prelude::*,
};

/// Half width, length of the windward side, and length of the horns, in heights.
const HALF_WIDTH: f64 = 5.5;
const WINDWARD: f64 = 6.0;
const HORNS: f64 = 6.6;

impl Params {
    /// Returns the heights of barchans.
    pub(super) fn crescents(&self, job: &Job<'_>, slip: f64) -> Result<Vec<f32>, NodeError> {
        let window = job.window();
        let seed = mix(job.seed() ^ SALTS[0]);
        let [wind_x, wind_y] = self.wind();
        let mut heights = zeroed(window.len())?;
        par::rows(job, &mut heights, |j, row| {
            // small crescents lie on lattices of their own
            for octave in 0..if self.variety > 0.0 { OCTAVES } else { 1 } {
                let lattice = Lattice { octave, wide_m: self.wavelength / f64::from(1 << octave), seed };
                let line = square(window.centre_m(0, j)[1], lattice.wide_m);
                let mut known: Option<(i64, Vec<Crescent>)> = None;
                for (i, height) in row.iter_mut().enumerate() {
                    let [x, y] = window.centre_m(i, j);
                    let column = square(x, lattice.wide_m);
                    // all samples of a square have the same neighbours
                    let around = match known.take() {
                        Some((of, around)) if of == column => around,
                        _ => self.around(&lattice, column, line),
                    };
                    let tallest = around.iter().map(|crescent| {
                        let (dx, dy) = (x - crescent.centre[0], y - crescent.centre[1]);
                        let (along_m, across_m) = (dx * wind_x + dy * wind_y, dx * wind_y - dy * wind_x);
                        let [cos, sin] = crescent.turn;
                        crescent.height(along_m * cos - across_m * sin, across_m * cos + along_m * sin, slip)
                    });
                    *height = tallest.fold(f64::from(*height), f64::max) as f32;
                    known = Some((column, around));
                }
            }
        })?;
        Ok(heights)
    }

    /// Returns the barchans of a lattice square and its neighbours.
    fn around(&self, lattice: &Lattice, column: i64, line: i64) -> Vec<Crescent> {
        let squares =
            (line - 1..=line + 1).flat_map(|line| (column - 1..=column + 1).map(move |column| [column, line]));
        squares.filter_map(|square| self.crescent(lattice, square)).collect()
    }

    /// Returns the barchan of a lattice square.
    pub(super) fn crescent(&self, lattice: &Lattice, square: [i64; 2]) -> Option<Crescent> {
        let Lattice { octave, wide_m, seed } = *lattice;
        let key = place::key_at(seed.wrapping_add(octave), square);
        let unit = |salt: u32| f64::from(mix(key ^ salt) >> 8) / f64::from(1 << 24);
        let centre = [(square[0] as f64 + unit(0x3c6e_f372)) * wide_m, (square[1] as f64 + unit(0xdaa6_6d2b)) * wide_m];
        let even = 0.5 + 0.5 * unit(0x78dd_e6e4);
        if self.variety == 0.0 {
            let height_m = self.height * even;
            return (unit(0x9e37_79b9) < 0.7).then_some(Crescent { centre, height_m, turn: [1.0, 0.0], skew: 0.0 });
        }
        // swarms and bare ground between them, the same for all sizes
        let swarm = place::at(centre.map(|metres| metres / (3.5 * self.wavelength)), seed ^ SALTS[1]);
        let small = f64::from(octave) / f64::from(OCTAVES);
        let chance = (0.7 - 0.45 * small) * (1.0 + 2.2 * self.variety * swarm).max(0.0);
        let chance = if octave == 0 { chance } else { self.variety * chance };
        // many small ones and few large ones
        let size = even * (1.0 - self.variety * (0.7 - 0.7 * unit(0x1715_609d) * unit(0x2f0b_4dd1)));
        let height_m = self.height / f64::from(1 << octave) * size.max(0.12);
        let turn = 0.3 * self.variety * (unit(0x5be0_cd19) + unit(0x510e_527f) - 1.0);
        // horns reach no farther than the neighbouring squares
        let room = ((wide_m / height_m - REACH) / 2.5).clamp(0.0, 1.0);
        let skew = 0.75 * self.variety * room * (unit(0xa54f_f53a) + unit(0x3c6e_f371) - 1.0);
        (unit(0x9e37_79b9) < chance).then(|| Crescent {
            centre,
            height_m,
            turn: [math::cos(turn), math::sin(turn)],
            skew,
        })
    }
}

/// A lattice of squares with at most one barchan each.
pub(super) struct Lattice {
    pub octave: u32,
    pub wide_m: f64,
    pub seed: u32,
}

/// Lattices of barchans, each with squares and heights half as large as the one before.
pub(super) const OCTAVES: u32 = 3;

/// A barchan.
pub(super) struct Crescent {
    /// Position of its highest point.
    pub centre: [f64; 2],
    pub height_m: f64,
    /// Cosine and sine of the angle between its own wind and that of the field.
    pub turn: [f64; 2],
    /// How much longer one horn is than the other.
    pub skew: f64,
}

impl Crescent {
    /// Returns the height at a position, along and across the wind from the centre.
    pub fn height(&self, along_m: f64, across_m: f64, slip: f64) -> f64 {
        if self.height_m <= 0.0 {
            return 0.0;
        }
        let (u, v) = (along_m / self.height_m, across_m / (HALF_WIDTH * self.height_m));
        let body = 1.0 - v * v;
        if body <= 0.0 {
            return 0.0;
        }
        // the crest becomes lower and recedes downwind towards the horns
        let (top, crest) = (body * body, HORNS * v * v * (1.0 + self.skew * v));
        let windward = WINDWARD * body;
        let share = (u - (crest - windward)) / windward;
        if share <= 0.0 {
            0.0
        } else if share <= 1.0 {
            self.height_m * top * (0.5 - 0.5 * math::cos(std::f64::consts::PI * share))
        } else {
            // gentler along the wind where the crest is oblique, so that the slip face is at repose down its slope
            let skew = HORNS * v * (2.0 + 3.0 * self.skew * v) / HALF_WIDTH;
            self.height_m * (top - (u - crest) * slip / (1.0 + skew * skew).sqrt()).max(0.0)
        }
    }
}
