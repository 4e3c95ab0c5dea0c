//! Horizon angles around every cell in any number of directions, at a cost that hardly grows with distance.
//!
//! Along a direction the terrain is sampled where the ray crosses the columns of cells (or the rows, whichever it
//! crosses more of), interpolated between the two adjacent cells. Near the cell every column is sampled. Farther away,
//! distances grow by a given factor, and the sampled terrain is smoothed by a Gaussian that grows with them, so that no
//! crest falls between two samples. The samples of each direction begin at a different fraction of a step, so that
//! directions complement each other.
//!
//! A sample is the same shift for the whole raster, so a row is a loop over vectors, a cell's result does not depend on
//! the window, and a plane has its exact horizon. The drawback is the smoothing of distant edges: a distant cliff is up
//! to about 8 % low at a growth of 0.08.
//!
//! Sampling smoothed terrain in growing steps is the idea of cone tracing and of max-mip marching. The blocks of a
//! mip-map would be visible in the result; full-resolution rasters at each level are not.

pub mod device;
mod host;

use orograph_graph::{Window, World};

pub use self::host::Horizon;
use super::{gaussian::Gaussian, math};

/// The golden section, whose multiples spread evenly between 0 and 1.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Standard deviation of the smoothing Gaussian as a fraction of the step between samples.
const SMOOTHING: f64 = 0.35;

/// Standard deviation in cells of the first smoothed level; each further level has twice the previous one.
const FIRST_SIGMA: f64 = 0.7;

/// Maximum tangent, whose square is still finite.
const STEEPEST: f32 = 1e15;

/// A sample along a direction: two adjacent cells, and the position between them.
#[derive(Clone, Copy, Debug)]
struct Look {
    level: usize,
    first: [i64; 2],
    second: [i64; 2],
    share: f32,
    per_m: f32,
}

/// The sampling pattern: directions, distance and steps.
#[derive(Clone, Debug)]
pub struct Rays {
    rays: Vec<Vec<Look>>,
}

impl Rays {
    /// Creates samples towards azimuths in degrees clockwise from north, out to a distance, which is at least the next
    /// cell and at most the world's diagonal. `growth`, above 0, is the relative growth of distance from sample to
    /// sample where steps are longer than a cell.
    #[must_use]
    pub fn new(azimuths: impl IntoIterator<Item = f64>, distance_m: f64, world: &World, growth: f64) -> Self {
        let cell_m = world.cell_m();
        let distance_m = distance_m.min(math::hypot(world.size[0], world.size[1]));
        let rays = azimuths.into_iter().enumerate().map(|(number, azimuth)| {
            let radians = azimuth.to_radians();
            // x points east, y south
            let towards = [math::sin(radians), -math::cos(radians)];
            let major = usize::from(towards[1].abs() > towards[0].abs());
            let along = 1.0 / towards[major].abs();
            let phase = (number as f64 * GOLDEN).fract();
            columns(distance_m / cell_m / along, growth, phase)
                .into_iter()
                .map(|column| {
                    let minor = column * towards[1 - major] * along;
                    let (mut lower, mut share) = (minor.floor(), minor - minor.floor());
                    // a diagonal passes exactly through cell centres
                    if share > 1.0 - 1e-6 {
                        (lower, share) = (lower + 1.0, 0.0);
                    }
                    let share = if share < 1e-6 { 0.0 } else { share };
                    let at = |minor: f64| {
                        let mut cell = [0; 2];
                        cell[major] = (column * towards[major].signum()) as i64;
                        cell[1 - major] = minor as i64;
                        cell
                    };
                    Look {
                        level: level(SMOOTHING * growth * column * along),
                        first: at(lower),
                        second: at(if share > 0.0 { lower + 1.0 } else { lower }),
                        share: share as f32,
                        per_m: (1.0 / (column * along * cell_m)) as f32,
                    }
                })
                .collect()
        });
        Self { rays: rays.collect() }
    }

    /// Returns the distance around a cell in metres that is read.
    #[must_use]
    pub fn reach_m(distance_m: f64, cell_m: f64, growth: f64) -> f64 {
        let cells = (distance_m / cell_m).max(std::f64::consts::SQRT_2);
        let smoothing = match level(SMOOTHING * growth * cells) {
            0 => 0.0,
            level => Gaussian::reach_m(sigma(level), 1.0),
        };
        (cells.ceil() + 1.0 + smoothing) * cell_m
    }

    /// Returns the bytes of terrain that a [`Horizon`] keeps, and of the samples of all directions.
    #[must_use]
    pub fn bytes(&self, window: &Window) -> u64 {
        let looks: usize = self.rays.iter().map(Vec::len).sum();
        let cells = (window.nx() + 2 * self.margin(window)) * window.ny();
        // the terrain and its levels, and a level without margins while it is smoothed
        let smoothed = if self.levels() > 0 { window.len() } else { 0 };
        (((self.levels() + 1) * cells + smoothed) * size_of::<f32>()
            + looks * (size_of::<Look>() + size_of::<[isize; 2]>())) as u64
    }

    /// Returns the columns beyond the west and east sides that a [`Horizon`] keeps: what most samples read, and a block.
    fn margin(&self, window: &Window) -> usize {
        let looks = self.rays.iter().flatten().flat_map(|look| [look.first[0], look.second[0]]);
        let farthest = looks.map(i64::unsigned_abs).max().unwrap_or(0) as usize;
        farthest.min((window.nx() / 8).max(64)) + host::LANES
    }

    /// Returns the number of smoothing levels.
    fn levels(&self) -> usize {
        self.rays.iter().flatten().map(|look| look.level).max().unwrap_or(0)
    }

    /// Returns the number of directions.
    #[must_use]
    pub fn count(&self) -> usize {
        self.rays.len()
    }
}

/// Returns the distances of the sampled columns, from the next one to the last.
fn columns(last: f64, growth: f64, phase: f64) -> Vec<f64> {
    let mut columns = vec![1.0];
    let mut place = 1.0;
    let mut first = true;
    loop {
        if growth * place < 1.0 {
            place += 1.0;
        } else {
            place *= if first { math::pow(1.0 + growth, phase) } else { 1.0 + growth };
            first = false;
        }
        let column = place.round();
        if column > last {
            return columns;
        }
        if columns.last().is_some_and(|before| *before < column) {
            columns.push(column);
        }
    }
}

/// Returns the smoothest level whose standard deviation in cells does not exceed the given one; 0 is the terrain
/// itself.
fn level(sigma_cells: f64) -> usize {
    let mut level = 0;
    while sigma_cells >= sigma(level + 1) {
        level += 1;
    }
    level
}

/// Returns the standard deviation in cells of a level above 0.
fn sigma(level: usize) -> f64 {
    FIRST_SIGMA * (1_u64 << (level - 1)) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::world;

    #[test]
    fn looks_are_dense_nearby_and_grow_farther_out() {
        let near = columns(12.0, 0.08, 0.0);
        assert_eq!(near, (1..=12).map(f64::from).collect::<Vec<_>>());
        for phase in [0.0, 0.3, 0.9] {
            let far = columns(3000.0, 0.08, phase);
            assert!(far.len() < 90, "{}", far.len());
            for pair in far.windows(2) {
                assert!(pair[1] > pair[0] && pair[1] - pair[0] <= 1.0 + 0.09 * pair[0], "{pair:?}");
            }
            assert!(far.last().is_some_and(|last| *last > 2700.0));
        }
        assert_eq!(columns(0.2, 0.08, 0.5), [1.0]);
    }

    #[test]
    fn smoothing_follows_distance() {
        assert_eq!([0.0, 0.69, 0.7, 1.39, 1.4, 5.7].map(level), [0, 0, 1, 1, 2, 4]);
        for distance in [1.0, 30.0, 500.0, 20_000.0] {
            let rays = Rays::new((0..32).map(|k| 11.25 * f64::from(k)), distance, &world(9000, 20_000, 1.0), 0.08);
            let reach = Rays::reach_m(distance, 1.0, 0.08);
            for look in rays.rays.iter().flatten() {
                let smoothing = if look.level == 0 { 0.0 } else { Gaussian::reach_m(sigma(look.level), 1.0) };
                let cells = [look.first, look.second].concat().iter().map(|cell| cell.abs()).max().unwrap_or(0);
                assert!(cells as f64 + smoothing <= reach, "{look:?} {reach}");
            }
        }
    }
}
