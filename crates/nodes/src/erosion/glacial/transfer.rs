//! Between the ice grid and the cells of the world, with sums kept.

use orograph_graph::{Job, NodeError, Window, memory::copied};

use crate::numerics::{
    coarse::{Between, Coarse},
    par,
};

/// Times that means are put right. More would make waves of two ice cells.
const ROUNDS: usize = 1;

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

    /// Values of the world's cells from those of ice cells, with the same sum and nearly the same means over ice cells.
    /// `progress` is that of the job.
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
        let [across, down] = self.coarse.steps();
        let missing = (across * down * sum(values) - sum(&out)) / out.len() as f64;
        // where nothing changes, nothing is added
        let changed = par::count(&out, |value| *value != 0.0);
        if changed > 0 {
            let each = (missing * out.len() as f64 / changed as f64) as f32;
            par::change(&mut out, |out| *out += if *out == 0.0 { 0.0 } else { each });
        }
        Ok(out)
    }

    /// The same for values that are nowhere negative, and stay so: corrections are factors.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn spread_positive(&self, job: &Job<'_>, progress: f32, values: &[f32]) -> Result<Vec<f32>, NodeError> {
        if self.is_same {
            return Ok(copied(values)?);
        }
        let mut out = self.between(job, progress, values)?;
        par::change(&mut out, |out| *out = out.max(0.0));
        for _ in 0..ROUNDS {
            let mut factors = self.coarse.means(job, &out)?;
            par::change_with(&mut factors, values, |mean, value| *mean = if *mean > 0.0 { value / *mean } else { 1.0 });
            let factors = self.coarse.spread(job, [progress; 2], &factors, Between::Linear)?;
            par::change_with(&mut out, &factors, |out, factor| *out *= factor);
        }
        let [across, down] = self.coarse.steps();
        let found = sum(&out);
        if found > 0.0 {
            let factor = (across * down * sum(values) / found) as f32;
            par::change(&mut out, |out| *out *= factor);
        }
        Ok(out)
    }

    /// By cubics, whose slopes have no breaks at the centres of ice cells.
    fn between(&self, job: &Job<'_>, progress: f32, values: &[f32]) -> Result<Vec<f32>, NodeError> {
        self.coarse.spread(job, [progress; 2], values, Between::Cubic)
    }
}

/// Sum in the order of the cells.
fn sum(values: &[f32]) -> f64 {
    values.iter().map(|&value| f64::from(value)).sum()
}
