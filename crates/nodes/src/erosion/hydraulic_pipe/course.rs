//! The course of a storm in time, with the strokes painted during it.

use std::ops::Range;

use orograph_graph::Moment;

use super::Params;
use crate::prelude::*;

/// Where a storm is.
#[derive(Clone, Debug)]
pub(super) struct Course {
    /// With the strokes in the order in which they act.
    pub params: Params,
    /// How many of the strokes have acted.
    pub acted: usize,
    /// Time left, in seconds.
    pub left_s: f64,
    /// Start time of the last sweep.
    pub since_s: Option<f64>,
}

/// Parameters with the strokes in the order in which they act.
fn read(values: &ParamValues) -> Params {
    let mut params = Params::read(values);
    params.strokes.0.sort_by(|a, b| a.time.total_cmp(&b.time));
    params
}

impl Course {
    pub fn new(values: &ParamValues) -> Self {
        let params = read(values);
        let left_s = params.duration;
        Self { params, acted: 0, left_s, since_s: None }
    }

    /// Returns the fraction of the run that is done.
    pub fn fraction(&self) -> f32 {
        if self.params.duration > 0.0 { (1.0 - self.left_s / self.params.duration) as f32 } else { 1.0 }
    }

    /// The position in time.
    pub fn moment(&self) -> Moment {
        Moment { now: self.params.duration - self.left_s, since: self.since_s, end: self.params.duration }
    }

    /// Returns the strokes that became due since the last sweep began.
    pub fn due(&self) -> Range<usize> {
        let now = self.moment().now;
        self.acted..self.params.strokes.0.partition_point(|stroke| stroke.time <= now).max(self.acted)
    }

    /// Adopts other parameters if every sweep so far would have been the same with them.
    pub fn take(&mut self, values: &ParamValues) -> bool {
        let params = read(values);
        let (old, new) = (&self.params.strokes.0, &params.strokes.0);
        let past = new.get(..self.acted) == old.get(..self.acted);
        let later = new.iter().skip(self.acted).all(|stroke| self.since_s.is_none_or(|since| stroke.time > since));
        let rest = Params { strokes: params.strokes.clone(), ..self.params.clone() } == params;
        let fits = past && later && rest;
        if fits {
            self.params = params;
        }
        fits
    }
}
