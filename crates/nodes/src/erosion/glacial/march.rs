//! Ice through time: steps as long as thickness changes slowly.

use orograph_graph::{Job, NodeError};

use super::sheet::{Change, Sheet};

/// Ice that flows in steps which may be tried again.
pub(super) trait Flowing {
    /// Sets the balance for the steps from a moment on, in years since the start of the march.
    fn renew(&mut self, now_yr: f64) -> Result<(), NodeError>;

    /// Computes a step without taking it over.
    fn attempt(&mut self, dt_yr: f64) -> Result<Change, NodeError>;

    /// Takes over the last attempt.
    fn accept(&mut self) -> Result<(), NodeError>;
}

/// A sheet on the host. `renew(sheet, now, out)` sets the balance in metres of ice per year of each cell.
pub(super) struct OnHost<'a, F> {
    pub sheet: &'a mut Sheet,
    pub balance: &'a mut [f64],
    pub renew: F,
}

impl<F: FnMut(&Sheet, f64, &mut [f64])> Flowing for OnHost<'_, F> {
    fn renew(&mut self, now_yr: f64) -> Result<(), NodeError> {
        (self.renew)(self.sheet, now_yr, self.balance);
        Ok(())
    }

    fn attempt(&mut self, dt_yr: f64) -> Result<Change, NodeError> {
        Ok(self.sheet.attempt(dt_yr, self.balance))
    }

    fn accept(&mut self) -> Result<(), NodeError> {
        self.sheet.accept();
        Ok(())
    }
}

/// How long steps are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    /// A step aims at a largest change in thickness of this much; twice as much is rejected and tried again.
    pub aim_m: f64,
    /// Shortest step: it is taken whatever happens.
    pub shortest_yr: f64,
    /// Longest step.
    pub longest_yr: f64,
    /// The next step.
    pub step_yr: f64,
}

impl Pace {
    /// Steps that follow valley glaciers.
    pub const fn new(aim_m: f64, shortest_yr: f64, longest_yr: f64) -> Self {
        Self { aim_m, shortest_yr, longest_yr, step_yr: shortest_yr }
    }
}

/// Sums over a march, as thickness of one cell in metres.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ledger {
    pub gained_m: f64,
    pub melted_m: f64,
    pub left_m: f64,
    pub steps: u64,
    /// Steps that were the shortest, although the ice changed by more than they aim at.
    pub hasty: u64,
}

impl Ledger {
    /// Returns true if the ice was too fast for its steps: then it may oscillate, and be thicker than any could be.
    pub const fn is_unsteady(&self) -> bool {
        100 * self.hasty > self.steps
    }

    fn add(&mut self, change: &Change) {
        self.gained_m += change.gained_m;
        self.melted_m += change.melted_m;
        self.left_m += change.left_m;
        self.steps += 1;
    }

    /// Adds another march.
    pub fn join(&mut self, other: &Self) {
        self.gained_m += other.gained_m;
        self.melted_m += other.melted_m;
        self.left_m += other.left_m;
        self.steps += other.steps;
        self.hasty += other.hasty;
    }
}

/// Lets the ice flow for `years`.
///
/// # Errors
/// [`NodeError::Cancelled`], or that of the ice.
pub(super) fn march(job: &Job<'_>, ice: &mut impl Flowing, pace: &mut Pace, years: f64) -> Result<Ledger, NodeError> {
    let mut ledger = Ledger::default();
    let mut left_yr = years;
    while left_yr > 0.0 {
        job.check()?;
        ice.renew(years - left_yr)?;
        loop {
            // the last two steps are of one length
            let fits = pace.step_yr.min(pace.longest_yr);
            let dt_yr = if left_yr <= fits { left_yr } else { fits.min(0.5 * left_yr).max(pace.shortest_yr.min(fits)) };
            let change = ice.attempt(dt_yr)?;
            if change.most_m > 2.0 * pace.aim_m && dt_yr > pace.shortest_yr {
                pace.step_yr = 0.5 * dt_yr;
                continue;
            }
            ice.accept()?;
            ledger.add(&change);
            ledger.hasty += u64::from(change.most_m > pace.aim_m && dt_yr <= pace.shortest_yr);
            // a step that was cut to fit says little about the next
            let growth = (pace.aim_m / change.most_m.max(1e-9)).clamp(0.5, 1.4);
            pace.step_yr = if dt_yr < fits { fits.min(dt_yr * growth).max(0.5 * fits) } else { dt_yr * growth };
            pace.step_yr = pace.step_yr.clamp(pace.shortest_yr, pace.longest_yr);
            left_yr -= dt_yr;
            if left_yr < 1e-9 * years {
                left_yr = 0.0;
            }
            break;
        }
    }
    Ok(ledger)
}
