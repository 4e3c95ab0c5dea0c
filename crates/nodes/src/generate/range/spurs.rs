//! Spurs and the valleys between them: waves across the fall line, octave by octave.
//!
//! T. Tricard et al. (2019), "Procedural phasor noise": each point of a jittered lattice emits a plane wave under a
//! bell-shaped window, and the phase of their sum forms stripes of even contrast that follow a direction field. Here
//! the waves of an octave travel along the contours of the terrain with all coarser octaves, so that their crests run
//! downhill and spurs have smaller spurs. Differences: amplitudes follow the slope of the terrain, stripes have sharp
//! crests and round valleys, and where waves cancel they fade instead of breaking.

use orograph_graph::mix;

use crate::{
    numerics::{math::lane, par, simd::simd},
    prelude::*,
};

/// Maximum number of octaves, each with half the wavelength of the one before.
const OCTAVES: i32 = 9;
/// Radius of a wave's window in wavelengths: within the neighbouring lattice cells.
const REACH: f64 = 1.2;
/// Maximum displacement of points from the centres of their cells, in cells.
const JITTER: f64 = 0.3;
/// Amplitude of an octave over slope times wavelength, for spurs of 1.
const HEIGHT: f64 = 1.9;
/// Steeper slopes count as this.
const STEEPEST: f32 = 1.2;
/// Offset that makes the added height, as a fraction of slope times wavelength, about 0 on average.
const MEAN: f32 = 0.64;

/// A rectangular grid of places, `step_m` apart and counted from the world's corner.
#[derive(Clone, Copy)]
pub(super) struct Places {
    pub step_m: f64,
    pub first: [i64; 2],
    pub cells: [usize; 2],
}

impl Places {
    /// Returns the x coordinates of the columns from west to east.
    pub fn xs(&self) -> Vec<f64> {
        (0..self.cells[0] as i64).map(|i| (self.first[0] + i) as f64 * self.step_m).collect()
    }

    /// Returns the y coordinate of a row.
    pub fn y(&self, row: usize) -> f64 {
        (self.first[1] + row as i64) as f64 * self.step_m
    }
}

/// The spurs of all octaves.
pub(super) struct Spurs {
    octaves: Vec<Octave>,
}

/// An octave on the window.
struct Octave {
    wavelength_m: f64,
    /// Amplitude in metres for a slope of 1: in full, and the part that the raster can represent.
    height_m: f32,
    held_m: f32,
    /// First column and row of the stored lattice cells, and the number per row.
    first: [i64; 2],
    width: usize,
    waves: Vec<Wave>,
}

/// The wave of a lattice point.
#[derive(Clone, Copy)]
struct Wave {
    centre: [f64; 2],
    /// Wave vector in turns per wavelength along x and y.
    along: [f32; 2],
    /// Phase at the centre, in turns.
    phase: f32,
    /// Slope of the terrain at the centre.
    slope: f32,
}

impl Spurs {
    /// Creates the spurs of a terrain, given its heights at `places`. Each octave is as steep as the one before times `fine`.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn new(
        job: &Job<'_>,
        [spurs, spacing_m, fine]: [f64; 3],
        land: impl Fn(&Places) -> Result<Vec<f32>, NodeError>,
    ) -> Result<Self, NodeError> {
        let (window, cell_m) = (job.window(), job.cell_m());
        let wavelengths = (0..OCTAVES).map(|k| spacing_m / f64::from(1 << k)).take_while(|w| *w > 3.0 * cell_m);
        let wavelengths: Vec<f64> = if spurs > 0.0 { wavelengths.collect() } else { Vec::new() };
        // required lattice cells, from fine to coarse: around the window and around all points of finer octaves
        let mut area = [0, 1].map(|axis| {
            let first = f64::from(window.origin[axis]);
            [first * cell_m, (first + f64::from(window.cells[axis])) * cell_m]
        });
        let mut spans = Vec::new();
        for wavelength_m in wavelengths.iter().rev() {
            let span = area.map(|ends| {
                let [first, last] = ends.map(|end| (end / wavelength_m).floor() as i64);
                [first - 1, last + 1]
            });
            area = span.map(|[first, last]| [first as f64 * wavelength_m, (last + 1) as f64 * wavelength_m]);
            spans.push(span);
        }
        let mut spurs_of = Self { octaves: Vec::new() };
        for ((k, &wavelength_m), span) in (0..).zip(&wavelengths).zip(spans.iter().rev()) {
            let fade = crate::numerics::math::smoothstep(wavelength_m / (3.0 * cell_m) - 1.0);
            let height_m = spurs * HEIGHT * crate::numerics::math::pow(fine, f64::from(k)) * wavelength_m;
            let [first, cells] = [span.map(|[first, _]| first), span.map(|[first, last]| last - first + 1)];
            let places = Places {
                step_m: 0.5 * wavelength_m,
                first: first.map(|first| 2 * first),
                cells: cells.map(|cells| 2 * cells as usize + 1),
            };
            let mut heights = land(&places)?;
            let xs = places.xs();
            par::each(heights.chunks_mut(xs.len()), |row, heights| {
                spurs_of.carve(&xs, places.y(row), heights, true);
                job.check()
            })?;
            let width = cells[0] as usize;
            let seed = mix(job.seed().wrapping_add(k as u32));
            let flat = Wave { centre: [0.0; 2], along: [0.0; 2], phase: 0.0, slope: 0.0 };
            let mut waves = vec![flat; width * cells[1] as usize];
            par::all(waves.chunks_mut(width), |row, waves| {
                for (column, wave) in waves.iter_mut().enumerate() {
                    let cell = [first[0] + column as i64, first[1] + row as i64];
                    *wave = Wave::new(cell, wavelength_m, seed, |place| slope(&heights, &places, place));
                }
            });
            spurs_of.octaves.push(Octave {
                wavelength_m,
                height_m: height_m as f32,
                held_m: (height_m * fade) as f32,
                first,
                width,
                waves,
            });
        }
        Ok(spurs_of)
    }

    /// Adds spurs to the heights of equally spaced places in a row, from west to east: with the full amplitude of each
    /// octave, or with the part that the raster can represent.
    pub fn carve(&self, xs: &[f64], y: f64, heights: &mut [f32], whole: bool) {
        if self.octaves.is_empty() || xs.is_empty() {
            return;
        }
        let mut sums: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; xs.len()]);
        let mut added = vec![0.0; xs.len()];
        for octave in &self.octaves {
            sums.iter_mut().for_each(|sum| sum.fill(0.0));
            gather(octave, xs, y, &mut sums);
            add(&sums, if whole { octave.height_m } else { octave.held_m }, &mut added);
        }
        shape(heights, &added);
    }
}

impl Wave {
    /// Creates the wave of a lattice cell on terrain with the given slopes.
    fn new(cell: [i64; 2], wavelength_m: f64, seed: u32, slope: impl Fn([f64; 2]) -> [f32; 2]) -> Self {
        let row = mix((cell[1] as u32).wrapping_mul(0xd816_3841).wrapping_add(seed));
        let key = mix((cell[0] as u32).wrapping_mul(0x8da6_b343).wrapping_add(row));
        let unit = |salt: u32| f64::from(mix(key ^ salt) >> 8) / f64::from(1 << 24);
        let place = |cell: i64, salt: u32| (cell as f64 + 0.5 + JITTER * (2.0 * unit(salt) - 1.0)) * wavelength_m;
        let centre = [place(cell[0], 0x3c6e_f372), place(cell[1], 0xdaa6_6d2b)];
        let [x, y] = slope(centre);
        let steep = (x * x + y * y).sqrt();
        let along = if steep > 1e-6 { [-y / steep, x / steep] } else { [0.0; 2] };
        Self { centre, along, phase: unit(0x9e37_79b9) as f32, slope: steep.min(STEEPEST) }
    }
}

/// Returns the slope along x and y at a place, by differences of its neighbours.
fn slope(heights: &[f32], places: &Places, place: [f64; 2]) -> [f32; 2] {
    let at = [0, 1].map(|axis| place[axis] / places.step_m - places.first[axis] as f64);
    let [i, j] = at.map(|at| at as usize);
    let [s, t] = at.map(|at| (at - at.floor()) as f32);
    let nx = places.cells[0];
    let h = |i: usize, j: usize| heights[j * nx + i];
    let (a, b, c, d) = (h(i, j), h(i + 1, j), h(i, j + 1), h(i + 1, j + 1));
    let per_metre = (1.0 / places.step_m) as f32;
    [((b - a) * (1.0 - t) + (d - c) * t) * per_metre, ((c - a) * (1.0 - s) + (d - b) * s) * per_metre]
}

simd! {
    /// Sums the waves of an octave at places in a row: cosines, sines, weights and slopes.
    fn gather(octave: &Octave, xs: &[f64], y: f64, sums: &mut [Vec<f32>; 4]) {
        let [cosines, sines, weights, slopes] = sums;
        let per_wavelength = 1.0 / octave.wavelength_m;
        let step_m = if xs.len() > 1 { xs[1] - xs[0] } else { octave.wavelength_m };
        let line = (y / octave.wavelength_m).floor() as i64 - octave.first[1];
        let column = |x: f64| (x / octave.wavelength_m).floor() as i64 - octave.first[0];
        let columns = (column(xs[0]) - 1) as usize..=(column(xs[xs.len() - 1]) + 1) as usize;
        for line in line - 1..=line + 1 {
            for wave in &octave.waves[line as usize * octave.width..][columns.clone()] {
                let down = (y - wave.centre[1]) * per_wavelength;
                let across = REACH * REACH - down * down;
                if across <= 0.0 {
                    continue;
                }
                // one more place on each side than is within reach
                let half_m = across.sqrt() * octave.wavelength_m;
                let from = ((wave.centre[0] - half_m - xs[0]) / step_m) as usize;
                let to = (((wave.centre[0] + half_m - xs[0]) / step_m + 2.0).max(0.0) as usize).min(xs.len());
                if from >= to {
                    continue;
                }
                let down = down as f32;
                let (square, offset) = (down * down, down * wave.along[1] + wave.phase);
                let xs = &xs[from..to];
                let cosines = &mut cosines[from..to][..xs.len()];
                let sines = &mut sines[from..to][..xs.len()];
                let weights = &mut weights[from..to][..xs.len()];
                let slopes = &mut slopes[from..to][..xs.len()];
                for i in 0..xs.len() {
                    let dx = ((xs[i] - wave.centre[0]) * per_wavelength) as f32;
                    let rest = (1.0 - (dx * dx + square) * (1.0 / (REACH * REACH)) as f32).max(0.0);
                    let weight = rest * rest * rest;
                    // between 8 and 16 the lowest 20 bits are the fraction of a turn
                    let turns = dx * wave.along[0] + offset;
                    let [cos, sin] = lane::turn((turns + 12.0).to_bits() << 12);
                    cosines[i] += weight * cos;
                    sines[i] += weight * sin;
                    weights[i] += weight;
                    slopes[i] += weight * wave.slope;
                }
            }
        }
    }
}

simd! {
    /// Adds an octave with `height_m` metres for a slope of 1 to `added`.
    fn add(sums: &[Vec<f32>; 4], height_m: f32, added: &mut [f32]) {
        let [cosines, sines, weights, slopes] = sums;
        let sums = cosines.iter().zip(sines).zip(weights).zip(slopes);
        for (added, (((cos, sin), weight), slope)) in added.iter_mut().zip(sums) {
            let even = cos / ((cos * cos + sin * sin).sqrt() + 0.15);
            let crest = MEAN - (0.51 - 0.5 * even).sqrt();
            *added += height_m * (slope / weight) * crest;
        }
    }
}

simd! {
    /// Adds to heights within limits: no height falls below 0 or exceeds three times its value.
    fn shape(heights: &mut [f32], added: &[f32]) {
        for (height, added) in heights.iter_mut().zip(added) {
            let share = added / height.max(1e-6);
            let above = share.max(0.0);
            let factor = 1.0 + above / (1.0 + 0.5 * above);
            *height *= if share < 0.0 { lane::exp(share.max(-60.0)) } else { factor };
        }
    }
}
