//! The past of a live run: pictures of its outputs at earlier moments of its simulated time.
//!
//! They are the values that the run reported to be shown, so nothing is computed for them, and the run does not know of
//! them. They have a fixed memory budget: when it is used up, every second one is dropped, and new ones follow at the
//! distance that the others then have.

use std::{collections::BTreeMap, sync::Arc};

use super::Built;

/// Memory for the pictures, in bytes.
const BUDGET: usize = 256 << 20;

/// The most pictures.
const MOST: usize = 512;

/// The outputs at one moment.
#[derive(Debug)]
struct Picture {
    /// The simulated time.
    time: f64,
    bytes: usize,
    values: BTreeMap<String, Built>,
}

/// The pictures of a live run, and the one that is shown instead of the present.
#[derive(Clone, Debug)]
pub(super) struct Past {
    budget: usize,
    /// In the order of their times.
    pictures: Vec<Arc<Picture>>,
    /// The least time between two pictures.
    gap: f64,
    shown: Option<Arc<Picture>>,
}

impl Default for Past {
    fn default() -> Self {
        Self { budget: BUDGET, pictures: Vec::new(), gap: 0.0, shown: None }
    }
}

impl Past {
    /// Keeps the outputs at a moment of a run that lasts until `end`, unless the last picture is too close. After a
    /// restart, when time goes back, the pictures of the run before are dropped.
    pub(super) fn keep(&mut self, time: f64, end: f64, values: &BTreeMap<String, Built>) {
        if self.pictures.last().is_some_and(|last| last.time > time) {
            *self = Self { budget: self.budget, ..Self::default() };
        }
        // A stroke can change what is shown at the time of the last picture.
        self.pictures.pop_if(|last| last.time == time);
        self.gap = self.gap.max(end / MOST as f64);
        let is_due = self.pictures.last().is_none_or(|last| time - last.time >= self.gap);
        if values.is_empty() || !is_due {
            return;
        }
        let bytes = values.values().map(|built| built.value.bytes()).sum();
        self.pictures.push(Arc::new(Picture { time, bytes, values: values.clone() }));
        while self.pictures.len() > MOST
            || self.pictures.iter().map(|picture| picture.bytes).sum::<usize>() > self.budget
        {
            self.thin();
        }
    }

    /// Drops every second picture, or the only one.
    fn thin(&mut self) {
        if self.pictures.len() < 2 {
            return self.pictures.clear();
        }
        let mut stays = false;
        self.pictures.retain(|_| {
            stays = !stays;
            stays
        });
        if let [first, .., last] = &self.pictures[..] {
            self.gap = (last.time - first.time) / (self.pictures.len() - 1) as f64;
        }
    }

    /// The times of the pictures of an output before `now`, the earliest first.
    pub(super) fn times(&self, port: &str, now: f64) -> Vec<f64> {
        let pictures = self.pictures.iter().filter(|picture| picture.values.contains_key(port));
        pictures.map(|picture| picture.time).take_while(|time| *time < now).collect()
    }

    /// Shows the picture of this time; None shows the present.
    pub(super) fn show(&mut self, time: Option<f64>) {
        self.shown = time.and_then(|time| self.pictures.iter().find(|picture| picture.time == time).cloned());
    }

    /// The time of the shown picture. Returns None while the present is shown.
    pub(super) fn shown(&self) -> Option<f64> {
        self.shown.as_ref().map(|picture| picture.time)
    }

    /// The outputs of the shown picture. Returns None while the present is shown.
    pub(super) fn values(&self) -> Option<&BTreeMap<String, Built>> {
        self.shown.as_ref().map(|picture| &picture.values)
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Field, Window, World};

    use super::*;

    /// An output of 16 x 16 cells of 4 bytes.
    fn values(port: &str) -> BTreeMap<String, Built> {
        let world = World { cells: [16; 2], ..World::default() };
        let value = Field::constant(Window::whole(world), 1.0).into();
        BTreeMap::from([(port.to_owned(), Built { revision: 1, cells: 16, step: 1, value })])
    }

    #[test]
    fn pictures_are_evenly_spaced_within_the_budget() {
        let values = values("a.height");
        let bytes: usize = values.values().map(|built| built.value.bytes()).sum();
        assert!(bytes > 0);
        let mut past = Past { budget: 9 * bytes, ..Past::default() };
        // Reports come at uneven times. The end is so early that it sets no distance.
        let mut time = 0.0;
        for report in 0..2000 {
            past.keep(time, 1.0, &values);
            assert!(past.pictures.iter().map(|picture| picture.bytes).sum::<usize>() <= past.budget);
            let times = past.times("a.height", f64::INFINITY);
            assert!(times.len() >= 4.min(report + 1), "{times:?}");
            time += if report % 7 == 0 { 110.0 } else { 60.0 };
        }
        let times = past.times("a.height", time);
        let gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let [least, most] = [f64::min, f64::max].map(|pick| gaps.iter().copied().reduce(pick).expect("some"));
        assert!(times[0] == 0.0 && times.len() >= 5 && most < 1.2 * least, "{times:?}");
        assert!(time - times[times.len() - 1] < 1.2 * most, "up to the present");
    }

    #[test]
    fn the_shown_picture_stays_when_others_are_dropped() {
        let values = values("a.height");
        let bytes: usize = values.values().map(|built| built.value.bytes()).sum();
        let mut past = Past { budget: 4 * bytes, ..Past::default() };
        for time in 0..4 {
            past.keep(f64::from(time), 100.0, &values);
        }
        past.show(Some(1.0));
        past.keep(4.0, 100.0, &values);
        assert_eq!((past.shown(), past.times("a.height", 9.0)), (Some(1.0), vec![0.0, 2.0, 4.0]));
        assert!(past.values().is_some_and(|values| values.contains_key("a.height")));
        past.show(None);
        assert_eq!(past.shown(), None);
        assert_eq!(past.times("a.water", 9.0), [0.0; 0], "another output has no pictures");
    }

    #[test]
    fn a_restart_drops_the_pictures_of_the_run_before() {
        let values = values("a.height");
        let mut past = Past::default();
        for time in [0.0, 50.0, 90.0] {
            past.keep(time, 100.0, &values);
        }
        past.show(Some(50.0));
        past.keep(0.0, 100.0, &values);
        assert_eq!((past.shown(), past.times("a.height", 9.0)), (None, vec![0.0]));
    }

    #[test]
    fn a_picture_larger_than_the_budget_is_not_kept() {
        let values = values("a.height");
        let mut past = Past { budget: 10, ..Past::default() };
        past.keep(0.0, 100.0, &values);
        assert_eq!(past.times("a.height", 9.0), [0.0; 0]);
    }
}
