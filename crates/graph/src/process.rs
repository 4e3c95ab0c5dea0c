//! A node's process, for callers that run it incrementally, watch it and change its parameters meanwhile.

use crate::{
    job::{Job, NodeError, Outputs},
    param::ParamValues,
};

/// The position of a [`Process`] in time, in seconds from its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// The current time.
    pub now: f64,
    /// Start of its last step; strokes after that can still be added. `None` before the first step.
    pub since: Option<f64>,
    /// Its end.
    pub end: f64,
}

impl Moment {
    /// Returns true if the process has reached its end.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.now >= self.end
    }

    /// The time for something that happens now, with as few digits as are needed to place it after the start of the
    /// last step.
    #[must_use]
    pub fn time(&self) -> f64 {
        let later = |time: &f64| *time <= self.now && self.since.is_none_or(|since| *time > since);
        let rounded = [1.0, 10.0, 1e3, 1e6].into_iter().map(|part: f64| (self.now * part).floor() / part);
        rounded.into_iter().find(later).unwrap_or(self.now)
    }
}

/// A node's computation from start to end. Stepped to the end, its outputs are byte-identical to those of the kernel.
///
/// Each call gets the same job as the one before, except for the wanted outputs, and the parameters after
/// [`Process::take`] has adopted others. The result must depend only on the job and the earlier steps.
pub trait Process: Send + Sync {
    /// The position in time.
    fn moment(&self) -> Moment;

    /// Advances by one step.
    ///
    /// # Errors
    /// [`NodeError`], also when the job was cancelled; the process cannot continue after it.
    fn step(&mut self, job: &Job<'_>) -> Result<(), NodeError>;

    /// The node's current outputs.
    ///
    /// # Errors
    /// [`NodeError`], also when the job was cancelled.
    fn outputs(&self, job: &Job<'_>) -> Result<Outputs, NodeError>;

    /// Adopts other parameters if every step so far would have been the same with them, and returns true; otherwise
    /// changes nothing and returns false.
    fn take(&mut self, params: &ParamValues) -> bool;

    /// Returns true after an error of the device that runs it, with a warning that says why: then the CPU can run the
    /// same process from its start.
    fn has_lost_device(&self) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_told_shortly_and_after_the_last_step() {
        let time = |now, since| Moment { now, since, end: 100.0 }.time();
        assert_eq!(time(12.3456, None), 12.0);
        assert_eq!(time(12.3456, Some(11.9)), 12.0);
        assert_eq!(time(12.3456, Some(12.0)), 12.3);
        assert_eq!(time(12.3456, Some(12.31)), 12.345);
        assert_eq!(time(0.0, None), 0.0);
        let near = 12.345_600_000_01;
        assert_eq!(time(near, Some(12.3456)), near);
    }
}
