//! The cells that are measured: land with a height, inside the mask.

use crate::{
    numerics::{par, voids},
    prelude::*,
};

/// A heightfield and the cells of it that are measured.
pub(in crate::measure) struct Land<'a> {
    /// All heights, with voids as NaN.
    pub height: &'a Field,
    /// The heights that are measured; NaN in voids, below the sea and outside the mask.
    pub field: Field,
    pub sea_m: Option<f64>,
    /// Cells below the sea.
    pub sea_cells: u64,
    /// Cells outside the mask.
    pub masked: u64,
}

impl<'a> Land<'a> {
    /// A cell is inside where the mask is at least 0.5.
    pub fn of(height: &'a Field, mask: Option<&Field>) -> Self {
        let sea_m = height.window().world.sea_level;
        let is_sea = |z: f32| sea_m.is_some_and(|sea_m| f64::from(z) < sea_m);
        let outside = |at: usize| mask.is_some_and(|mask| voids::is_void(mask.plane(0)[at]));
        let heights = height.plane(0);
        if sea_m.is_none() && mask.is_none() {
            return Self { height, field: height.clone(), sea_m, sea_cells: 0, masked: 0 };
        }
        let measured = par::map(heights.len(), |at| {
            let left_out = outside(at) || is_sea(heights[at]);
            if left_out { f32::NAN } else { heights[at] }
        });
        let sea_cells = par::count(heights, |&z| is_sea(z)) as u64;
        let masked = mask.map_or(0, |mask| par::count(mask.plane(0), |m| voids::is_void(*m))) as u64;
        Self { height, field: Field::new(*height.window(), measured), sea_m, sea_cells, masked }
    }

    /// The measured heights; NaN where a cell is left out.
    pub fn samples(&self) -> &[f32] {
        self.field.plane(0)
    }

    /// Whether a cell is measured, for loops over cells.
    pub fn has(&self) -> impl Fn(usize) -> bool + Copy + '_ {
        let samples = self.samples();
        move |cell| samples[cell].is_finite()
    }

    pub fn nx(&self) -> usize {
        self.height.window().nx()
    }

    pub fn ny(&self) -> usize {
        self.height.window().ny()
    }

    pub fn cell_m(&self) -> f64 {
        self.height.window().cell_m()
    }

    /// Number of measured cells.
    pub fn cells(&self) -> usize {
        par::count(self.samples(), |z| z.is_finite())
    }

    /// Whether every cell is measured.
    pub fn is_whole(&self) -> bool {
        !par::any(self.samples(), |z| !z.is_finite())
    }
}
