//! Supersampling: a build on finer cells, whose results are averaged into the requested ones.
//!
//! Terrain on finer cells has detail that the requested cells are too large for. In its means that detail is right,
//! and crests and valleys narrower than a cell are neither jagged nor as sharp as a knife, as in an elevation model that
//! was measured more finely than it is published.

use orograph_graph::{Averaging, Field, Window, World, memory::zeroed};
use orograph_nodes::numerics::math;

use crate::report::failure::Failure;

/// The largest number of finer cells along the side of a cell.
pub const MOST: u32 = 8;

/// The same part of the world on finer cells.
#[must_use]
pub fn finer(window: Window, factor: u32) -> Window {
    let more = |counts: [u32; 2]| counts.map(|count| count.saturating_mul(factor));
    let world = World { cells: more(window.world.cells), ..window.world };
    Window { world, origin: more(window.origin), cells: more(window.cells) }
}

/// The hash of what a file contains, from that of the finer raster.
#[must_use]
pub fn hash(finer: &str, factor: u32) -> String {
    if factor == 1 {
        return finer.to_owned();
    }
    blake3::hash(format!("{finer} {factor}").as_bytes()).to_hex().as_str()[..finer.len().min(64)].to_owned()
}

/// The value of a cell from those of its finer cells, row by row.
fn of_cell(values: &[f32], averaging: Averaging) -> f32 {
    match averaging {
        Averaging::Mean | Averaging::UnitVector => mean_of(values),
        Averaging::Largest => values.iter().copied().fold(f32::NEG_INFINITY, f32::max),
        Averaging::Commonest => {
            let count = |value: f32| values.iter().filter(|other| other.to_bits() == value.to_bits()).count();
            values.iter().rev().copied().max_by_key(|value| count(*value)).unwrap_or_default()
        }
        Averaging::Direction => direction(values),
    }
}

fn mean_of(values: &[f32]) -> f32 {
    (values.iter().map(|&value| f64::from(value)).sum::<f64>() / values.len() as f64) as f32
}

/// The direction of the sum of unit vectors, in degrees; -1 where most values have none, or their sum is 0.
fn direction(values: &[f32]) -> f32 {
    let given = || values.iter().filter(|degrees| **degrees >= 0.0).map(|&degrees| f64::from(degrees).to_radians());
    if 2 * given().count() < values.len() {
        return -1.0;
    }
    let [east, north] = [math::sin as fn(f64) -> f64, math::cos].map(|part| given().map(part).sum::<f64>());
    if math::hypot(east, north) < 1e-9 {
        return -1.0;
    }
    let degrees = math::atan2(east, north).to_degrees().rem_euclid(360.0) as f32;
    // a rounding error west of north becomes 360 in single precision
    if degrees < 360.0 { degrees } else { 0.0 }
}

/// Averages the rasters of one output, which may come in bands of rows.
#[derive(Debug)]
pub struct Averager {
    factor: usize,
    averaging: Averaging,
    asked: Window,
    /// Rows of requested cells that have gone out.
    done: u32,
    /// Plane by plane, the finer rows that do not make a row of cells yet.
    kept: Vec<Vec<f32>>,
}

impl Averager {
    /// For an output that is averaged like this, on the requested cells.
    #[must_use]
    pub const fn new(averaging: Averaging, asked: Window, factor: u32) -> Self {
        Self { factor: factor as usize, averaging, asked, done: 0, kept: Vec::new() }
    }

    /// Takes the next rows of the finer raster. Returns the rows of cells that they complete, if any.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub fn rows(&mut self, finer: &Field) -> Result<Option<Field>, Failure> {
        let (factor, nx) = (self.factor, self.asked.nx());
        let finer_nx = nx * factor;
        self.kept.resize_with(finer.planes(), Vec::new);
        let kept = self.kept.first().map_or(0, Vec::len) / finer_nx;
        let ny = (kept + finer.window().ny()) / factor;
        let refused = |error: orograph_graph::memory::OutOfMemory| Failure::unable(error.to_string());
        let mut samples = zeroed(finer.planes() * nx * ny).map_err(refused)?;
        let mut values = Vec::with_capacity(factor * factor);
        for (plane, kept) in self.kept.iter_mut().enumerate() {
            let rows: Vec<&[f32]> = kept.chunks(finer_nx).chain(finer.plane(plane).chunks(finer_nx)).collect();
            let cells = samples[plane * nx * ny..].chunks_mut(nx).take(ny);
            for (cells, rows) in cells.zip(rows.chunks(factor)) {
                for (x, cell) in cells.iter_mut().enumerate() {
                    values.clear();
                    rows.iter().for_each(|row| values.extend_from_slice(&row[x * factor..(x + 1) * factor]));
                    *cell = of_cell(&values, self.averaging);
                }
            }
            *kept = rows[ny * factor..].concat();
        }
        if ny == 0 {
            return Ok(None);
        }
        if self.averaging == Averaging::UnitVector {
            to_unit_length(&mut samples, nx * ny);
        }
        let [west, north] = self.asked.origin;
        let band = Window { origin: [west, north + self.done], cells: [nx as u32, ny as u32], ..self.asked };
        self.done += ny as u32;
        Ok(Some(Field::with_planes(band, finer.planes(), samples)))
    }
}

/// Scales the vectors whose components are in planes of so many cells. A normal of length 0 points up; a vector of length
/// 0 in the plane stays.
fn to_unit_length(samples: &mut [f32], cells: usize) {
    let is_normal = samples.len() == 3 * cells;
    for cell in 0..cells {
        let places = || (cell..samples.len()).step_by(cells);
        let length = places().map(|at| f64::from(samples[at]) * f64::from(samples[at])).sum::<f64>().sqrt();
        let last = samples.len() - cells + cell;
        for at in (cell..samples.len()).step_by(cells) {
            let scaled = f64::from(samples[at]) / length;
            samples[at] = if length > 0.0 { scaled as f32 } else { f32::from(u8::from(is_normal && at == last)) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(origin: [u32; 2], cells: [u32; 2]) -> Window {
        Window { origin, cells, ..Window::whole(World { size: [80.0, 60.0], cells: [8, 6], ..World::default() }) }
    }

    fn raster(asked: Window, factor: u32, sample: impl Fn(u32, u32) -> f32) -> Field {
        let finer = finer(asked, factor);
        let [nx, ny] = finer.cells;
        let samples = (0..ny).flat_map(|y| (0..nx).map(move |x| (x, y))).map(|(x, y)| sample(x, y)).collect();
        Field::new(finer, samples)
    }

    #[test]
    fn bands_of_any_height_give_the_means_of_the_whole() {
        let (asked, factor) = (window([2, 1], [5, 4]), 3);
        let all = raster(asked, factor, |x, y| (x * x + 7 * y) as f32);
        let mut averager = Averager::new(Averaging::Mean, asked, factor);
        let whole = averager.rows(&all).expect("memory").expect("rows");
        assert_eq!(*whole.window(), asked);
        // rows 0 to 2 and columns 0 to 2: (0 + 1 + 4) / 3 + 7 (0 + 1 + 2) / 3
        assert!((whole.samples()[0] - (5.0 / 3.0 + 7.0)).abs() < 1e-6);
        for height in [1, 2, 4, 5, 12] {
            let mut averager = Averager::new(Averaging::Mean, asked, factor);
            let mut samples = Vec::new();
            let Window { origin: [west, north], cells: [nx, ny], .. } = *all.window();
            for first in (0..ny).step_by(height) {
                let rows = (ny - first).min(height as u32);
                let band = Window { origin: [west, north + first], cells: [nx, rows], ..*all.window() };
                if let Some(means) = averager.rows(&all.crop(&band)).expect("memory") {
                    assert_eq!(means.window().origin, [2, 1 + samples.len() as u32 / 5], "bands of {height}");
                    samples.extend_from_slice(means.samples());
                }
            }
            assert_eq!(samples, whole.samples(), "bands of {height}");
        }
    }

    #[test]
    fn rivers_numbers_angles_and_normals_have_their_own_rules() {
        let one = window([0, 0], [1, 1]);
        let value = |ty, samples: [f32; 4]| {
            let field = Field::new(finer(one, 2), samples.to_vec());
            Averager::new(ty, one, 2).rows(&field).expect("memory").expect("a row").samples()[0]
        };
        assert_eq!(value(Averaging::Mean, [0.0, 1.0, 1.0, 1.0]), 0.75);
        assert_eq!(value(Averaging::Largest, [1.0, 900.0, 2.0, 3.0]), 900.0);
        assert_eq!(value(Averaging::Commonest, [7.0, 3.0, 3.0, 8.0]), 3.0);
        assert_eq!(value(Averaging::Commonest, [7.0, 3.0, 3.0, 7.0]), 7.0);
        let near = |degrees: [f32; 4], expected: f32| {
            let found = value(Averaging::Direction, degrees);
            assert!((found - expected).abs() < 1e-3 && found < 360.0, "{degrees:?}: {found}");
        };
        near([30.0, 40.0, 30.0, 40.0], 35.0);
        near([340.0, 10.0, 355.0, 25.0], 2.5);
        near([100.0, 260.0, 170.0, 190.0], 180.0);
        near([90.0, -1.0, 90.0, 90.0], 90.0);
        near([90.0, -1.0, -1.0, -1.0], -1.0);
        near([90.0, 270.0, 0.0, 180.0], -1.0);
        let vectors = |planes: Vec<f32>| {
            let field = Field::with_planes(finer(one, 2), planes.len() / 4, planes);
            Averager::new(Averaging::UnitVector, one, 2).rows(&field).expect("memory").expect("a row").into_samples()
        };
        let normal = vectors(vec![0.6, 0.6, 0.6, 0.6, 0.0, 0.0, 0.0, 0.0, 0.8, 0.8, 0.2, 0.2]);
        assert!((normal.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-6 && normal[0] > normal[2]);
        assert_eq!(vectors(vec![1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), [1.0, 0.0], "water in one of four");
        assert_eq!(vectors(vec![0.0; 8]), [0.0, 0.0], "no water");
    }
}
