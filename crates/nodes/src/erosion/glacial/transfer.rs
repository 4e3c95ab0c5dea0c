//! Between the ice grid and the cells of the world, with sums kept.

use orograph_graph::{Job, NodeError, Window, memory::copied};

use crate::numerics::{
    coarse::{Between, Coarse},
    par,
};

/// Times that means are put right.
const ROUNDS: usize = 4;

/// The ice grid over a world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transfer {
    pub coarse: Coarse,
    /// True if ice cells are the cells of the world.
    pub is_same: bool,
}

impl Transfer {
    /// Ice cells of about that length, not shorter than the world's.
    pub fn new(window: &Window, ice_cell_m: f64) -> Self {
        let coarse = Coarse::new(window, (ice_cell_m / window.cell_m()).max(1.0));
        Self { coarse, is_same: coarse.cells() == [window.nx(), window.ny()] }
    }

    /// Values of the world's cells between those of ice cells, whose means over ice cells are those values but for what
    /// [`ROUNDS`] corrections leave. `progress` is that of the job.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn spread(&self, job: &Job<'_>, progress: f32, values: &[f32]) -> Result<Vec<f32>, NodeError> {
        if self.is_same {
            return Ok(copied(values)?);
        }
        let mut out = self.between(job, progress, values)?;
        for _ in 0..ROUNDS {
            let mut missing = self.coarse.means(job, &out)?;
            par::change_with(&mut missing, values, |missing, value| *missing = value - *missing);
            let more = self.between(job, progress, &missing)?;
            par::change_with(&mut out, &more, |out, more| *out += more);
        }
        Ok(out)
    }

    /// The same for values that are nowhere negative, and stay so: corrections are factors, the last of which is one for
    /// the whole world, so that the sum is that of the ice cells to rounding.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn spread_positive(&self, job: &Job<'_>, progress: f32, values: &[f32]) -> Result<Vec<f32>, NodeError> {
        if self.is_same {
            return Ok(copied(values)?);
        }
        let mut out = self.between(job, progress, values)?;
        for _ in 0..ROUNDS {
            let mut factors = self.coarse.means(job, &out)?;
            par::change_with(&mut factors, values, |mean, value| *mean = if *mean > 0.0 { value / *mean } else { 1.0 });
            let factors = self.between(job, progress, &factors)?;
            par::change_with(&mut out, &factors, |out, factor| *out *= factor);
        }
        let sum = |values: &[f32]| values.iter().map(|&value| f64::from(value)).sum::<f64>();
        let [across, down] = self.coarse.steps();
        let found = sum(&out);
        if found > 0.0 {
            let factor = (across * down * sum(values) / found) as f32;
            par::change(&mut out, |out| *out *= factor);
        }
        Ok(out)
    }

    fn between(&self, job: &Job<'_>, progress: f32, values: &[f32]) -> Result<Vec<f32>, NodeError> {
        self.coarse.spread(job, [progress; 2], values, Between::Linear)
    }
}
