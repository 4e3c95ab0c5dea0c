//! The balance of rock and sediment while time passes.

use super::{Land, Sediment};
use crate::{numerics::routing::code, prelude::*};

/// Sums over all cells, in metres over a cell, since the land was first changed.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// The time at which the sums begin, in years.
    since_yr: f64,
    start_m: f64,
    risen_m: f64,
    left_m: f64,
    /// What the displacement of the result added.
    displaced_m: f64,
}

impl Budget {
    /// The sums before the first step.
    pub(super) const fn new(since_yr: f64, start_m: f64) -> Self {
        Self { since_yr, start_m, risen_m: 0.0, left_m: 0.0, displaced_m: 0.0 }
    }

    /// Adds what uplift did in a step.
    pub(super) fn rise(&mut self, risen_m: f64) {
        self.risen_m += risen_m;
    }

    /// Adds what the displacement of the result changed.
    pub(super) fn displace(&mut self, displaced_m: f64) {
        self.displaced_m += displaced_m;
    }

    /// Adds what rivers carried out of the world in a step, from the flux of each cell.
    pub(super) fn leave(&mut self, codes: &[u8], flux: &[f64]) {
        let outlets = codes.iter().zip(flux).filter(|(code, _)| **code & code::OUTLET != 0);
        self.left_m += outlets.map(|(_, flux)| flux).sum::<f64>();
    }
}

impl Land<'_> {
    /// The balance until now, in cells of `cell_m2`.
    #[must_use]
    pub fn report(&self, cell_m2: f64) -> Report {
        let mut report = Report::default();
        let end_m = self.total_m();
        let budget = self.budget.unwrap_or_else(|| Budget::new(self.time_yr, end_m));
        let span_yr = self.time_yr - budget.since_yr;
        let area_m2 = cell_m2 * self.heights.len() as f64;
        report.measure("area", area_m2, "m²");
        report.measure("time", span_yr, "yr");
        if span_yr > 0.0 {
            report.measure("mean_erosion_rate", cell_m2 * budget.left_m / area_m2 / span_yr, "m/yr");
        }
        let gains = [("uplift", budget.risen_m), ("displacement", budget.displaced_m)];
        let gains = gains.map(|(name, gain_m)| (name, cell_m2 * gain_m));
        // nothing is displaced without `irregularity`
        let gains = if budget.displaced_m == 0.0 { &gains[..1] } else { &gains[..] };
        report.balance(Balance::new(
            "rock",
            cell_m2 * budget.start_m,
            gains,
            &[("left_the_world", cell_m2 * budget.left_m)],
            cell_m2 * end_m,
        ));
        if self.budget.is_some() && budget.since_yr > 0.0 {
            report.notes.push(format!(
                "the balance covers the last {}, which pass on these cells; coarser levels passed the time before",
                Unit::Years.display(span_yr)
            ));
        }
        report
    }

    /// Heights and what joins the rivers at the next step, in metres over a cell.
    pub(super) fn total_m(&self) -> f64 {
        let debris = |sediment: &Sediment<'_>| sediment.debris.iter().sum::<f64>();
        self.heights.iter().filter(|height| height.is_finite()).sum::<f64>()
            + self.sediment.as_ref().map_or(0.0, debris)
    }
}
