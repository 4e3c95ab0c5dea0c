//! Floors of valleys: a river cuts over the whole width of its valley, not along a line.
//!
//! A river that drains the area A wanders over a floor of the width w = w₁ (A / 1 km²)^0.4 min(1, 0.1 / S), narrower
//! where it is steep. Its area counts for all cells of a disc of that width, less towards the rim; where discs overlap
//! the largest counts, so that the order does not matter. Only the law of incision sees it: what drains where stays as
//! it is.

use orograph_graph::{Job, NodeError};

use super::Land;
use crate::{
    erosion::stream_power::area::REFERENCE_M2,
    numerics::{math, par, routing::code},
};

/// The power of the drainage area that the width goes with.
const POWER: f64 = 0.4;
/// The slope above which floors are narrower.
const STEEP: f64 = 0.1;
/// The widest floor, as a radius in cells.
const WIDEST_CELLS: f64 = 64.0;

/// A disc: its middle, its radius in cells and the area in m².
type Disc = (u32, f32, f64);

impl Land<'_> {
    /// Lets the rivers of the last routing cut their floors. `width_m` is that of a valley that drains 1 km².
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn widen(&mut self, job: &Job<'_>, width_m: f64) -> Result<(), NodeError> {
        if width_m <= 0.0 {
            return Ok(());
        }
        let (nx, cell_m) = (self.grid.nx, self.cell_m);
        // below it a floor is narrower than a cell
        let least_m2 = REFERENCE_M2 * math::pow(cell_m / width_m, 1.0 / POWER);
        let disc = |cell: usize| -> Option<Disc> {
            let (area_m2, code) = (self.area.m2(cell), self.codes[cell]);
            if area_m2 < least_m2 || !code::has_receiver(code) {
                return None;
            }
            let receiver = self.grid.receiver(cell as u32, code) as usize;
            let length_m =
                if code::is_diagonal(code::direction(code)) { std::f64::consts::SQRT_2 } else { 1.0 } * cell_m;
            let slope = (self.heights[cell] - self.heights[receiver]) / length_m;
            let narrowed = if slope > STEEP { STEEP / slope } else { 1.0 };
            let radius = 0.5 * width_m * math::pow(area_m2 / REFERENCE_M2, POWER) * narrowed / cell_m;
            (radius >= 0.5).then_some((cell as u32, radius.min(WIDEST_CELLS) as f32, area_m2))
        };
        let discs: Vec<Vec<Disc>> = par::collect((0..self.grid.ny).step_by(8), |_, first| {
            job.check()?;
            Ok::<_, NodeError>((first * nx..(first + 8).min(self.grid.ny) * nx).filter_map(disc).collect())
        })?;
        let ny = self.grid.ny as isize;
        let widened = self.area.widened();
        for (cell, radius, area_m2) in discs.into_iter().flatten() {
            let (x, y) = ((cell as usize % nx) as isize, (cell as usize / nx) as isize);
            let rim = (f64::from(radius) + 0.5) * (f64::from(radius) + 0.5);
            let far = (radius + 0.5) as isize;
            for row in (y - far).max(0)..=(y + far).min(ny - 1) {
                for column in (x - far).max(0)..=(x + far).min(nx as isize - 1) {
                    let (dx, dy) = ((column - x) as f64, (row - y) as f64);
                    let counts_m2 = (area_m2 * (1.0 - (dx * dx + dy * dy) / rim)) as f32;
                    let place = row as usize * nx + column as usize;
                    if counts_m2 > widened[place] {
                        widened[place] = counts_m2;
                    }
                }
            }
        }
        Ok(())
    }
}
