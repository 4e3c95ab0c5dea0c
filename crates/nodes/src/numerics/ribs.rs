//! Ribs and chutes: knolls and hollows drawn out along the slopes that they lie on.
//!
//! Knolls that are as long across a slope as down it make faces mottled. Where water, snow and rockfall run down a
//! slope, what is rough on it lies along their way. In each octave of the knolls, a cell therefore gets the mean along
//! the steepest ascent and descent from it, with weights that fall linearly to the ends (line integral convolution, B.
//! Cabral and L. C. Leedom, 1993, Imaging vector fields using line integral convolution), and all cells together the
//! standard deviation that they had. Ribs of every octave are as many wavelengths long, so that their cost per cell
//! does not depend on the cells.

use orograph_graph::{Job, NodeError};

use super::{
    gaussian::Gaussian,
    lines::{Ends, separable},
    math, par,
    rock::Knolls,
};

/// Terrain is smoothed over so much of the longest knolls before it gives directions, and over so many cells at least.
const SMOOTHED: f64 = 0.24;
const SMOOTHED_CELLS: f64 = 1.2;
/// Samples per wavelength along a rib.
const SAMPLES: f64 = 3.0;

/// Returns knolls drawn out to `half` wavelengths on either side along the descent of the terrain `heights`. Empty
/// where cells are too large for them.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn ribs(job: &Job<'_>, knolls: &Knolls, heights: &[f32], half: f64) -> Result<Vec<f32>, NodeError> {
    let Some(longest) = knolls.wavelengths().next().filter(|_| half > 0.0) else { return knolls.all(job) };
    let smoothed = separable(job, [0.0; 2], heights, &Gaussian::new((SMOOTHED * longest).max(SMOOTHED_CELLS)))?;
    let slopes = Slopes::new(job, &smoothed)?;
    drop(smoothed);
    let mut sum = Vec::new();
    for (k, wavelength) in knolls.wavelengths().enumerate() {
        let drawn_out = slopes.drawn_out(job, &knolls.octave(job, k)?, half * wavelength, wavelength / SAMPLES)?;
        if sum.is_empty() {
            sum = drawn_out;
        } else {
            par::change_with(&mut sum, &drawn_out, |sum, rib| *sum += rib);
        }
    }
    Ok(sum)
}

/// The code of a cell where terrain is level, and the number of codes of directions.
const LEVEL: u8 = u8::MAX;
const DIRECTIONS: usize = LEVEL as usize;

/// The directions of steepest ascent.
struct Slopes {
    size: [usize; 2],
    ends: [Ends; 2],
    /// The code of the direction of each cell.
    codes: Vec<u8>,
    /// The unit vector of each code, to the east and to the south.
    directions: Vec<[f32; 2]>,
}

impl Slopes {
    fn new(job: &Job<'_>, heights: &[f32]) -> Result<Self, NodeError> {
        let window = job.window();
        let (size, ends) = ([window.nx(), window.ny()], [0, 1].map(|axis| Ends::of(&window, axis)));
        let at = |x: i64, y: i64| heights[ends[1].index(y, size[1]) * size[0] + ends[0].index(x, size[0])];
        let turn = DIRECTIONS as f64 / std::f64::consts::TAU;
        let mut codes = vec![LEVEL; heights.len()];
        par::each(codes.chunks_mut(size[0]), |y, codes| {
            job.check()?;
            let y = y as i64;
            for (x, code) in (0..).zip(codes) {
                let [east, south] = [at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1)].map(f64::from);
                if east != 0.0 || south != 0.0 {
                    let nearest = (math::atan2(south, east) * turn).round() as i64;
                    *code = nearest.rem_euclid(DIRECTIONS as i64) as u8;
                }
            }
            Ok::<(), NodeError>(())
        })?;
        let direction = |code: usize| [math::cos, math::sin].map(|of| of(code as f64 / turn) as f32);
        Ok(Self { size, ends, codes, directions: (0..DIRECTIONS).map(direction).collect() })
    }

    /// Returns samples drawn out to `half` cells on either side, of places that are at most `step` cells from each
    /// other.
    fn drawn_out(&self, job: &Job<'_>, samples: &[f32], half: f64, step: f64) -> Result<Vec<f32>, NodeError> {
        let [nx, ny] = self.size;
        let count = (half / step).ceil().max(1.0);
        let (steps, step) = (count as usize, (half / count) as f32);
        let weights: Vec<f32> = (1..=steps).map(|nth| 1.0 - nth as f32 / (steps + 1) as f32).collect();
        let mut out = vec![0.0; samples.len()];
        // so far from the sides, no rib leaves the raster
        let inner = |at: usize, n: usize| at as f64 > half + 1.0 && (at as f64) < n as f64 - half - 2.0;
        par::each(out.chunks_mut(nx), |y, out| {
            job.check()?;
            for (x, out) in out.iter_mut().enumerate() {
                *out = if inner(x, nx) && inner(y, ny) {
                    self.mean::<true>(samples, [x, y], step, &weights)
                } else {
                    self.mean::<false>(samples, [x, y], step, &weights)
                };
            }
            Ok::<(), NodeError>(())
        })?;
        let gain = (squares(samples) / squares(&out).max(f64::MIN_POSITIVE)).sqrt() as f32;
        par::change(&mut out, |rib| *rib *= gain);
        Ok(out)
    }

    /// The weighted mean of samples along the rib through a cell, with the weights of the places to either side.
    #[inline(always)]
    fn mean<const INNER: bool>(&self, samples: &[f32], [x, y]: [usize; 2], step: f32, weights: &[f32]) -> f32 {
        let (mut sum, mut total) = (samples[y * self.size[0] + x], 1.0);
        for step in [-step, step] {
            let mut place = [x as f32, y as f32];
            for weight in weights {
                let [east, south] = place.map(|at| floor::<INNER>(at + 0.5));
                let code = self.codes[self.cell::<INNER>(east, south)];
                let Some(ascent) = self.directions.get(usize::from(code)) else { break };
                place = [place[0] + step * ascent[0], place[1] + step * ascent[1]];
                sum += weight * self.between::<INNER>(samples, place);
                total += weight;
            }
        }
        sum / total
    }

    /// The bilinear sample of a place.
    #[inline(always)]
    fn between<const INNER: bool>(&self, samples: &[f32], place: [f32; 2]) -> f32 {
        let [x, y] = place.map(floor::<INNER>);
        let [u, v] = [place[0] - x as f32, place[1] - y as f32];
        let row = |y: i64| {
            let [west, east] = [x, x + 1].map(|x| samples[self.cell::<INNER>(x, y)]);
            west * (1.0 - u) + east * u
        };
        row(y) * (1.0 - v) + row(y + 1) * v
    }

    #[inline(always)]
    fn cell<const INNER: bool>(&self, x: i64, y: i64) -> usize {
        let [nx, ny] = self.size;
        if INNER { y as usize * nx + x as usize } else { self.ends[1].index(y, ny) * nx + self.ends[0].index(x, nx) }
    }
}

/// The whole number below a place, which is positive inside a raster: there, no function is called for it.
#[inline(always)]
fn floor<const INNER: bool>(at: f32) -> i64 {
    if INNER { at as i64 } else { at.floor() as i64 }
}

/// The sum of the squares of all samples.
fn squares(samples: &[f32]) -> f64 {
    let square = |&sample: &f32| f64::from(sample) * f64::from(sample);
    let part = |_, samples: &[f32]| samples.iter().map(square).sum::<f64>();
    par::collect_all(samples.chunks(1 << 14), part).iter().sum()
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, Window, World};

    use super::*;
    use crate::testing;

    const SIDE: usize = 96;
    const CELL_M: f64 = 20.0;

    /// Knolls, and the same on land that rises by so much to the east and to the south.
    fn on_plane(rise: [f64; 2], half: f64) -> [Vec<f32>; 2] {
        testing::with_job(Window::whole(testing::world(SIDE as u32, SIDE as u32, CELL_M)), |job| {
            let heights: Vec<f32> = (0..SIDE * SIDE)
                .map(|cell| (CELL_M * (rise[0] * (cell % SIDE) as f64 + rise[1] * (cell / SIDE) as f64)) as f32)
                .collect();
            let knolls = Knolls::new(job, 0.2, 800.0);
            [knolls.all(job).expect("knolls"), ribs(job, &knolls, &heights, half).expect("ribs")]
        })
    }

    /// How alike samples are at so many cells to the east and to the south of each other.
    fn alike(samples: &[f32], [dx, dy]: [usize; 2]) -> f64 {
        let inner = (0..SIDE - dy).flat_map(|y| (0..SIDE - dx).map(move |x| y * SIDE + x));
        let [mut product, mut one, mut other] = [0.0; 3];
        for cell in inner {
            let [a, b] = [cell, cell + dy * SIDE + dx].map(|cell| f64::from(samples[cell]));
            product += a * b;
            one += a * a;
            other += b * b;
        }
        product / (one * other).sqrt()
    }

    /// Ten cells on, half of the longest wavelength, samples are more alike down the slope than they were, and across it
    /// as they were; the deviation is what it was.
    #[test]
    fn ribs_run_down_the_slope() {
        for (rise, down, across) in [([0.3, 0.0], [10, 0], [0, 10]), ([0.0, 0.3], [0, 10], [10, 0])] {
            let [knolls, ribs] = on_plane(rise, 1.0);
            let deviation = (squares(&ribs) / squares(&knolls)).sqrt();
            assert!((deviation - 1.0).abs() < 0.1, "{deviation}");
            let [before, after] = [&knolls, &ribs].map(|samples| alike(samples, down));
            assert!(before < 0.3 && after > 0.6, "{before} {after}");
            let [before, after] = [&knolls, &ribs].map(|samples| alike(samples, across));
            assert!((after - before).abs() < 0.2, "{before} {after}");
        }
        // the same down a diagonal: seven cells to the east and seven to the south are ten
        let [diagonal, straight] =
            [([0.2, 0.2], [7, 7]), ([0.3, 0.0], [10, 0])].map(|(rise, lag)| alike(&on_plane(rise, 1.0)[1], lag));
        assert!((diagonal - straight).abs() < 0.15, "{diagonal} {straight}");
    }

    /// Knolls go on across joined sides: steps there are like those inside, and not like those between any two columns.
    #[test]
    fn knolls_and_ribs_go_on_across_joined_sides() {
        let sides = Boundary { west: Edge::Periodic, east: Edge::Periodic, ..Boundary::all(Edge::Open) };
        let world = World { boundary: sides, ..testing::world(SIDE as u32, SIDE as u32, CELL_M) };
        let turn = std::f64::consts::TAU / SIDE as f64;
        let height =
            |cell: usize| (60.0 * math::sin(turn * (cell % SIDE) as f64) + 0.3 * CELL_M * (cell / SIDE) as f64) as f32;
        let made = testing::with_job(Window::whole(world), |job| {
            let knolls = Knolls::new(job, 0.2, 700.0);
            let heights: Vec<f32> = (0..SIDE * SIDE).map(height).collect();
            [knolls.all(job).expect("knolls"), ribs(job, &knolls, &heights, 1.0).expect("ribs")]
        });
        for samples in made {
            let steps = |here: usize, next: usize| -> f32 {
                (0..SIDE).map(|y| (samples[y * SIDE + here] - samples[y * SIDE + next]).abs()).sum()
            };
            let inside = (0..SIDE - 1).map(|x| steps(x, x + 1)).fold(0.0, f32::max);
            assert!(steps(SIDE - 1, 0) < 1.1 * inside, "{} {inside}", steps(SIDE - 1, 0));
            assert!(steps(SIDE / 2, 0) > 1.5 * inside, "{} {inside}", steps(SIDE / 2, 0));
        }
    }

    #[test]
    fn level_ground_keeps_its_knolls() {
        let [knolls, ribs] = on_plane([0.0, 0.0], 1.0);
        let largest = knolls.iter().zip(&ribs).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(largest < 1e-4, "{largest}");
        let [knolls, ribs] = on_plane([0.3, 0.1], 0.0);
        assert_eq!(knolls, ribs);
    }
}
