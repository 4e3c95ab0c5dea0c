//! Random fields with long wavelengths, such as rock properties: sums of gradient noise as functions of position.
//!
//! Each octave is noise of Perlin (2002), with half the wavelength of the one before and an amplitude that gives the
//! sum its spectral slope. The lattice is rotated against rows and columns, and may be stretched along its first axis.
//! The standard deviation of the sum is 1 with all octaves, including those too short for the cells, so that the field
//! does not depend on the cell size; finer cells only add detail. In a periodic world they go on across its sides.

use orograph_graph::{Job, NodeError, Window, World, memory::zeroed, mix};

use super::{
    joins::{Joins, Weights},
    math, par,
    simd::simd,
};

/// The shortest wavelength that cells can represent, in cells.
pub const SHORTEST_CELLS: f64 = 4.0;
/// Standard deviation of an octave: 4 (mean of w² u²) (mean of w²), with w the squared fade and u the distance.
const OCTAVE_DEVIATION: f64 = 0.215_710_8;
/// Maximum number of octaves.
const MOST_OCTAVES: u32 = 16;

/// Parameters of a field.
#[derive(Clone, Copy, Debug)]
pub struct Waves {
    /// The longest wavelength in metres, across the grain.
    pub longest_m: f64,
    /// Slope of the two-dimensional power spectrum, above 2.
    pub spectral_slope: f64,
    /// Ratio of the wavelengths along the grain to those across it.
    pub stretch: f64,
    /// Direction of the grain in radians from the x axis towards the y axis.
    pub grain: f64,
    /// Seed of the field.
    pub seed: u32,
}

/// Positions whose place on the lattice is found together.
const BLOCK: usize = 256;
/// Positions that are evaluated together.
const GROUP: usize = 8;

/// A field that can be evaluated at any position.
pub struct Sampler {
    /// Components of 256 unit vectors.
    gradients: [[f64; 256]; 2],
    cosine: f64,
    sine: f64,
    stretch: f64,
    /// Wavelength in metres, weight and seed of each octave.
    octaves: Vec<(f64, f64, u32)>,
    joins: Option<Joins>,
}

impl Waves {
    /// Creates a sampler for a world, without wavelengths below `shortest_m` metres, except for the longest octave.
    #[must_use]
    pub fn sampler(&self, shortest_m: f64, world: &World) -> Sampler {
        // along the grain waves are longer
        let weights = Weights::Random { longest_m: self.longest_m * self.stretch.max(1.0) };
        Sampler { joins: Joins::of(world, self.longest_m, weights), ..self.endless(shortest_m) }
    }

    /// As [`Self::sampler`], on a plane without end.
    #[must_use]
    pub fn endless(&self, shortest_m: f64) -> Sampler {
        let angle = |at: usize| at as f64 * (std::f64::consts::TAU / 256.0);
        let gradients =
            [std::array::from_fn(|at| math::cos(angle(at))), std::array::from_fn(|at| math::sin(angle(at)))];
        let fall = math::exp2(-(self.spectral_slope - 2.0) / 2.0);
        let first = (1.0 - fall * fall).sqrt() / OCTAVE_DEVIATION;
        let waves = (0..MOST_OCTAVES).map(|octave| (octave, self.longest_m / f64::from(1_u32 << octave)));
        let octaves = waves
            .take_while(|(octave, wave_m)| *octave == 0 || *wave_m >= shortest_m)
            .map(|(octave, wave_m)| {
                (wave_m, first * math::pow(fall, f64::from(octave)), mix(self.seed ^ mix(octave + 1)))
            })
            .collect();
        let (cosine, sine) = (math::cos(self.grain), math::sin(self.grain));
        Sampler { gradients, cosine, sine, stretch: self.stretch, octaves, joins: None }
    }

    /// Evaluates the field without wavelengths below `shortest_m` metres on the cells of a window.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn field(&self, job: &Job<'_>, window: &Window, shortest_m: f64) -> Result<Vec<f32>, NodeError> {
        let sampler = self.sampler(shortest_m, &window.world);
        let mut samples = zeroed(window.len())?;
        par::each(samples.chunks_mut(window.nx()), |j, row| {
            job.check()?;
            row.iter_mut().zip(sampler.row(window, j)).for_each(|(sample, value)| *sample = value as f32);
            Ok::<(), NodeError>(())
        })?;
        Ok(samples)
    }
}

impl Sampler {
    /// Returns the field at a position in metres.
    #[must_use]
    pub fn at(&self, place_m: [f64; 2]) -> f64 {
        Joins::apply(self.joins.as_ref(), place_m, |place_m| self.endless_at(place_m))
    }

    fn endless_at(&self, [x, y]: [f64; 2]) -> f64 {
        let along = (x * self.cosine + y * self.sine) / self.stretch;
        let across = y * self.cosine - x * self.sine;
        let octave = |&(wave_m, weight, seed): &(f64, f64, u32)| {
            weight * octave_at(&self.gradients, along / wave_m, across / wave_m, seed)
        };
        self.octaves.iter().map(octave).sum()
    }

    /// Evaluates the field at positions in metres, given by their coordinates: the values of [`Self::at`], in a third
    /// of the time.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn fill(&self, [xs, ys]: [&[f64]; 2], values: &mut [f64]) {
        assert!(xs.len() == values.len() && ys.len() == values.len(), "a value for each position");
        let (mut along, mut across) = ([0.0; BLOCK], [0.0; BLOCK]);
        for ((xs, ys), values) in xs.chunks(BLOCK).zip(ys.chunks(BLOCK)).zip(values.chunks_mut(BLOCK)) {
            for (k, (&x, &y)) in xs.iter().zip(ys).enumerate() {
                let [x, y] = self.joins.map_or([x, y], |joins| joins.inside([x, y]));
                along[k] = (x * self.cosine + y * self.sine) / self.stretch;
                across[k] = y * self.cosine - x * self.sine;
            }
            // where a sum of numbers begins
            values.fill(-0.0);
            for octave in &self.octaves {
                add_octave(&self.gradients, &along, &across, octave, values);
            }
            let Some(joins) = &self.joins else { continue };
            for ((&x, &y), value) in xs.iter().zip(ys).zip(values) {
                if joins.changes(joins.inside([x, y])) {
                    *value = self.at([x, y]);
                }
            }
        }
    }

    /// Returns the field at the centres of the cells of a window's row `j`.
    #[must_use]
    pub fn row(&self, window: &Window, j: usize) -> Vec<f64> {
        let xs: Vec<f64> = (0..window.nx()).map(|i| window.centre_m(i, j)[0]).collect();
        let ys = vec![window.centre_m(0, j)[1]; window.nx()];
        let mut values = vec![0.0; window.nx()];
        self.fill([&xs, &ys], &mut values);
        values
    }
}

simd! {
    /// Adds an octave at positions on the turned and stretched lattice.
    fn add_octave(
        gradients: &[[f64; 256]; 2],
        along: &[f64; BLOCK],
        across: &[f64; BLOCK],
        octave: &(f64, f64, u32),
        values: &mut [f64],
    ) {
        let &(wave_m, weight, seed) = octave;
        let (along, across) = (along.as_chunks::<GROUP>().0, across.as_chunks::<GROUP>().0);
        for ((along, across), values) in along.iter().zip(across).zip(values.chunks_mut(GROUP)) {
            let [mut x, mut y, mut x0, mut y0, mut added] = [[0.0; GROUP]; 5];
            for k in 0..GROUP {
                (x[k], y[k]) = (along[k] / wave_m, across[k] / wave_m);
                (x0[k], y0[k]) = (x[k].floor(), y[k].floor());
            }
            // along a row, most groups lie in one square of the lattice
            if (0..GROUP).fold(true, |one, k| one & (x0[k] == x0[0]) & (y0[k] == y0[0])) {
                let corners = corners(gradients, x0[0], y0[0], seed);
                for k in 0..GROUP {
                    added[k] = weight * blend(&corners, x[k] - x0[k], y[k] - y0[k]);
                }
            } else {
                for k in 0..GROUP {
                    added[k] = weight * octave_at(gradients, x[k], y[k], seed);
                }
            }
            values.iter_mut().zip(added).for_each(|(value, added)| *value += added);
        }
    }
}

/// Gradient noise with unit gradients.
#[inline(always)]
fn octave_at(gradients: &[[f64; 256]; 2], x: f64, y: f64, seed: u32) -> f64 {
    let (x0, y0) = (x.floor(), y.floor());
    blend(&corners(gradients, x0, y0, seed), x - x0, y - y0)
}

/// The gradients at the corners of a square of the lattice: north-west, north-east, south-west and south-east.
#[inline(always)]
fn corners(gradients: &[[f64; 256]; 2], x0: f64, y0: f64, seed: u32) -> [[f64; 2]; 4] {
    let (column, row) = (low_word(x0), low_word(y0));
    let corner = |dx: u32, dy: u32| {
        let draw = mix(column.wrapping_add(dx).wrapping_mul(0x9E37_79B9) ^ mix(row.wrapping_add(dy) ^ seed)) >> 24;
        [gradients[0][draw as usize], gradients[1][draw as usize]]
    };
    [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)]
}

/// The noise at a place in a square.
#[inline(always)]
fn blend(corners: &[[f64; 2]; 4], u: f64, v: f64) -> f64 {
    let slope = |corner: usize, u: f64, v: f64| corners[corner][0] * u + corners[corner][1] * v;
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (p, q) = (fade(u), fade(v));
    let north = slope(0, u, v) * (1.0 - p) + slope(1, u - 1.0, v) * p;
    let south = slope(2, u, v - 1.0) * (1.0 - p) + slope(3, u - 1.0, v - 1.0) * p;
    north * (1.0 - q) + south * q
}

/// The lowest 32 bits of a whole number below 2⁵¹, in two's complement; every instruction set has vectors for this.
#[inline(always)]
fn low_word(whole: f64) -> u32 {
    (whole + 6_755_399_441_055_744.0).to_bits() as u32
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge};

    use super::*;
    use crate::testing::{moments, world};

    /// Beside joined sides a field is as rough as elsewhere, and steps across them are as small.
    #[test]
    fn a_field_goes_on_across_joined_sides() {
        let sides = Boundary { west: Edge::Periodic, east: Edge::Periodic, ..Boundary::all(Edge::Open) };
        let world = World { boundary: sides, ..world(400, 4000, 25.0) };
        let waves = Waves { longest_m: 2e3, spectral_slope: 2.5, stretch: 2.5, grain: 0.7, seed: 5 };
        let (joined, endless) = (waves.sampler(100.0, &world), waves.endless(100.0));
        let rows = || (0..4000).map(|y| f64::from(y) * 25.0);
        let steps = |sampler: &Sampler, x: f64| {
            rows().map(|y| (sampler.at([x, y]) - sampler.at([x + 25.0, y])).abs()).fold(0.0, f64::max)
        };
        let (seam, inside) = (steps(&joined, 9_987.5), steps(&endless, 4000.0));
        assert!(seam < 1.3 * inside && steps(&joined, 9000.0) < 1.3 * inside, "{seam} {inside}");
        let samples: Vec<f32> = rows().map(|y| joined.at([9000.0, y]) as f32).collect();
        let (mean, deviation) = moments(&samples);
        // some 30 of the longest waves in a column
        assert!(mean.abs() < 0.3 && (deviation - 1.0).abs() < 0.2, "{mean} {deviation}");
    }

    #[test]
    fn many_positions_have_the_values_of_each() {
        let waves = Waves { longest_m: 3e3, spectral_slope: 2.4, stretch: 2.5, grain: 0.9, seed: 8 };
        let joined = World { boundary: Boundary::all(Edge::Periodic), ..world(700, 500, 40.0) };
        // a block and a part of one, beyond the world on both sides
        let xs: Vec<f64> = (0..300).map(|k| f64::from(k) * 731.7 - 9e4).collect();
        let ys: Vec<f64> = (0..300).map(|k| 7e4 - f64::from(k * k % 977) * 113.3).collect();
        for sampler in [waves.endless(40.0), waves.sampler(40.0, &joined)] {
            let mut values = vec![f64::NAN; 300];
            sampler.fill([&xs, &ys], &mut values);
            for (k, value) in values.iter().enumerate() {
                assert_eq!(value.to_bits(), sampler.at([xs[k], ys[k]]).to_bits(), "{k}");
            }
        }
        for whole in [-7.0, -1.0, 0.0, 4.0, 5e9, -5e9] {
            assert_eq!(low_word(whole), whole as i64 as u32, "{whole}");
        }
    }

    #[test]
    fn a_field_has_its_deviation_and_the_same_long_waves_on_any_cells() {
        let waves = Waves { longest_m: 2e3, spectral_slope: 2.5, stretch: 2.5, grain: 0.7, seed: 5 };
        let sampled = |cell_m: f64| -> Vec<f32> {
            let sampler = waves.endless(SHORTEST_CELLS * cell_m);
            (0..90_000).map(|k| sampler.at([f64::from(k % 300) * 150.0, f64::from(k / 300) * 150.0]) as f32).collect()
        };
        let (fine, coarse) = (sampled(1.0), sampled(100.0));
        let (mean, deviation) = moments(&fine);
        // about 250 waves of the longest octave, which has half of the variance; the omitted octaves have 2 %
        assert!(mean.abs() < 0.1 && (deviation - 1.0).abs() < 0.06, "{mean} {deviation}");
        let apart: Vec<f32> = fine.iter().zip(&coarse).map(|(fine, coarse)| fine - coarse).collect();
        // octaves of 2 km to 500 m have all but 0.707^3 of the variance
        let left = moments(&apart).1;
        assert!((left * left / 0.354 - 1.0).abs() < 0.15, "{left}");
    }

    #[test]
    fn the_grain_is_longer_than_it_is_wide() {
        let waves = Waves { longest_m: 1e3, spectral_slope: 3.0, stretch: 4.0, grain: 0.5, seed: 1 };
        let sampler = waves.endless(SHORTEST_CELLS * 100.0);
        let (cosine, sine) = (math::cos(0.5), math::sin(0.5));
        let change = |[dx, dy]: [f64; 2]| -> f64 {
            let places = (0..4000).map(|k| [f64::from(k % 63) * 700.0, f64::from(k / 63) * 700.0]);
            places.map(|[x, y]| (sampler.at([x + 100.0 * dx, y + 100.0 * dy]) - sampler.at([x, y])).abs()).sum()
        };
        let ratio = change([-sine, cosine]) / change([cosine, sine]);
        assert!((3.0..5.0).contains(&ratio), "{ratio}");
    }
}
