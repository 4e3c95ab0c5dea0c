//! What a node does, step by step, for who watches it and has a hand in it.

use crate::{
    job::{Job, NodeError, Outputs},
    param::ParamValues,
};

/// Where a [`Process`] is, in seconds from its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// How far it is.
    pub now: f64,
    /// Where its last step began; what happens after that can still be said. `None` before the first step.
    pub since: Option<f64>,
    /// Where it ends.
    pub end: f64,
}

impl Moment {
    /// Whether there is nothing more to do.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.now >= self.end
    }

    /// The time of something that happens now, with as few digits as tell it from what happened before the last step.
    #[must_use]
    pub fn time(&self) -> f64 {
        let later = |time: &f64| *time <= self.now && self.since.is_none_or(|since| *time > since);
        let rounded = [1.0, 10.0, 1e3, 1e6].into_iter().map(|part: f64| (self.now * part).floor() / part);
        rounded.into_iter().find(later).unwrap_or(self.now)
    }
}

/// What a node does from its start to its end. Stepped to the end it gives what the kernel gives, to the last bit.
///
/// Each call is given the same job as the one before, but for the parameters where [`Process::take`] has taken others. It
/// must depend on nothing but that and the steps before.
pub trait Process: Send + Sync {
    /// Where it is.
    fn moment(&self) -> Moment;

    /// Goes on by one step.
    ///
    /// # Errors
    /// [`NodeError`], also when the job was cancelled; then there is no going on.
    fn step(&mut self, job: &Job<'_>) -> Result<(), NodeError>;

    /// The node's outputs as they are now.
    ///
    /// # Errors
    /// [`NodeError`], also when the job was cancelled.
    fn outputs(&self, job: &Job<'_>) -> Result<Outputs, NodeError>;

    /// Takes other parameters, where all that has happened is what would have happened with them; else it stays as it is and
    /// says no.
    fn take(&mut self, params: &ParamValues) -> bool;
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
