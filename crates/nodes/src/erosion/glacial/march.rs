//! Ice through time: steps as long as thickness changes slowly.

use orograph_graph::{Job, NodeError};

use super::sheet::{Change, Sheet};

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
}

impl Ledger {
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
    }
}

/// Lets the ice flow for `years`. `balance(surface, out, now)` sets the balance in metres of ice per year of each row.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub(super) fn march(
    job: &Job<'_>,
    sheet: &mut Sheet,
    pace: &mut Pace,
    years: f64,
    balance: &mut [f64],
    mut renew: impl FnMut(&Sheet, f64, &mut [f64]),
) -> Result<Ledger, NodeError> {
    let mut ledger = Ledger::default();
    let mut left_yr = years;
    while left_yr > 0.0 {
        job.check()?;
        renew(sheet, years - left_yr, balance);
        loop {
            // the last two steps are of one length
            let fits = pace.step_yr.min(pace.longest_yr);
            let dt_yr = if left_yr <= fits { left_yr } else { fits.min(0.5 * left_yr).max(pace.shortest_yr.min(fits)) };
            let change = sheet.attempt(dt_yr, balance);
            if change.most_m > 2.0 * pace.aim_m && dt_yr > pace.shortest_yr {
                pace.step_yr = 0.5 * dt_yr;
                continue;
            }
            sheet.accept();
            ledger.add(&change);
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
