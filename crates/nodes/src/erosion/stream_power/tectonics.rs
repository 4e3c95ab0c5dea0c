//! What moves the land while rivers cut it: uplift and its course in time, and the fall of the base level.

use super::{Inputs, Params, course::Course};
use crate::{
    numerics::{
        par,
        routing::{Grid, Outlet},
    },
    prelude::*,
};

/// The movements of a run.
#[derive(Debug)]
pub struct Tectonics<'a> {
    /// In m/yr, where the course is 1.
    uplift: Lane<'a>,
    course: Course,
    /// In m/yr.
    base_level_fall: f64,
    duration_yr: f64,
}

impl<'a> Tectonics<'a> {
    /// Reads `uplift`, `uplift_course` and `base_level_fall`.
    #[must_use]
    pub fn new(inputs: &Inputs<'a>, params: &Params) -> Self {
        Self {
            uplift: inputs.uplift,
            course: Course::new(&params.uplift_course),
            base_level_fall: params.base_level_fall,
            duration_yr: params.duration,
        }
    }

    /// How far a cell has risen after the whole run, in metres; below 0 it has sunk.
    #[must_use]
    pub fn risen_m(&self, cell: usize, is_base: bool) -> f64 {
        self.rate(cell, is_base) * self.duration_yr
    }

    /// How far cells at base level have sunk after a part of the run, in metres.
    #[must_use]
    pub fn base_fallen_m(&self, time_yr: f64) -> f64 {
        self.base_level_fall * time_yr
    }

    /// How far a cell has risen after a part of the run, for an uplift of 1 m/yr.
    #[must_use]
    pub fn risen_yr(&self, time_yr: f64) -> f64 {
        if time_yr > 0.0 { self.course.mean(0.0, time_yr / self.duration_yr) * time_yr } else { 0.0 }
    }

    /// [`Self::risen_yr`] after the whole run.
    #[must_use]
    pub fn risen_at_end_yr(&self) -> f64 {
        self.risen_yr(self.duration_yr)
    }

    /// How fast a cell rises in the mean of the run, in m/yr.
    #[must_use]
    pub fn rate(&self, cell: usize, is_base: bool) -> f64 {
        if is_base {
            return -self.base_level_fall;
        }
        f64::from(self.uplift.at(cell)) * self.course.mean(0.0, 1.0)
    }

    /// Moves the land from one time of the run to a later one, in years.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn raise(
        &self,
        job: &Job<'_>,
        grid: &Grid,
        heights: &mut [f64],
        [from_yr, to_yr]: [f64; 2],
    ) -> Result<(), NodeError> {
        let step_yr = to_yr - from_yr;
        let rise_yr = self.course.mean(from_yr / self.duration_yr, to_yr / self.duration_yr) * step_yr;
        let fall_m = self.base_level_fall * step_yr;
        if (self.uplift.constant() == Some(0.0) || rise_yr == 0.0) && fall_m == 0.0 {
            return Ok(());
        }
        par::each(heights.chunks_mut(grid.nx), |y, heights| {
            job.check()?;
            let first = y * grid.nx;
            let border = grid.is_border_row(y);
            for (x, height) in heights.iter_mut().enumerate() {
                let side = border || x == 0 || x + 1 == grid.nx;
                if side && grid.outlet(x, y) == Outlet::Base {
                    *height -= fall_m;
                } else {
                    *height += f64::from(self.uplift.at(first + x)) * rise_yr;
                }
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Cancel, ParamValue};

    use crate::{
        erosion::stream_power::{
            NODE,
            tests::{PLAIN, largest_relative_error, outputs, samples, steady, strip, white},
        },
        prelude::*,
        testing,
    };

    #[test]
    fn land_rises_by_the_integral_of_the_course() {
        let height = testing::field(testing::world(20, 20, 10.0), |x, y| 10.0 * white(x, y));
        let [uplift, erodibility, repose] = [0.001, 0.0, 90.0].map(|value| Field::constant(*height.window(), value));
        let fields = [("height", &height), ("uplift", &uplift), ("erodibility", &erodibility), ("repose", &repose)];
        for time_step in [1e6, 3e4] {
            let mut params = testing::with_params(&NODE, &format!("schedule=full,duration=1e6,time_step={time_step}"));
            params.set("uplift_course", ParamValue::Curve(vec![[0.0, 0.0], [1.0, 1.0]]));
            let mut found = testing::outputs(&NODE, &params, &fields).expect("a result");
            for (after, before) in samples(&mut found, "height").iter().zip(height.samples()).skip(21).take(18) {
                // 1e-3 m: the uplift and the heights are f32.
                assert!((after - before - 500.0).abs() < 1e-3, "{after}");
            }
            assert!(samples(&mut found, "erosion").iter().all(|&erosion| erosion < 1e-6));
        }
    }

    /// Seen from a base level that falls as fast as land would rise, the steady state is that of rising land.
    #[test]
    fn a_falling_base_level_is_an_uplift() {
        let height = strip(100, |x| 500.0 * white(x, 0.5));
        let [erodibility, repose] = [1e-5, 90.0].map(|value| Field::constant(*height.window(), value));
        let fields = [("height", &height), ("erodibility", &erodibility), ("repose", &repose)];
        let changes = format!("{PLAIN},duration=4e6,time_step=1e4,base_level_fall=0.001");
        let mut found = outputs(&changes, &fields).expect("a result");
        let heights: Vec<f32> = samples(&mut found, "height").iter().map(|height| height + 4000.0).collect();
        assert_eq!(heights[100], 0.0);
        // 1e-5: heights near 4000 m in f32.
        let error = largest_relative_error(&heights, &steady(100, 100.0, 0.5));
        assert!(error < 1e-5, "{error}");
        assert_eq!(samples(&mut found, "erosion")[100], 0.0, "the base level is not eroded");
    }

    #[test]
    fn short_runs_are_told() {
        // Some 3 km of river at K √A of 2 mm/yr and more take a good million years.
        for (duration, told) in [(1e3, true), (2e6, false)] {
            let height = testing::field(testing::world(60, 60, 100.0), |x, y| 50.0 * white(x, y));
            let params = testing::with_params(&NODE, &format!("duration={duration}"));
            let cancel = Cancel::default();
            let (outputs, warnings) =
                testing::outputs_and_warnings(&cancel, *height.window(), &NODE, &params, &[("height", &height)]);
            let said = warnings.iter().any(|text| text.contains("rivers here take"));
            assert!(outputs.is_ok() && said == told, "{duration}: {warnings:?}");
        }
    }

    #[test]
    fn unresolved_hillslopes_are_told() {
        for (areas, told) in [
            ("headwater_area=0,critical_area=0", false),
            ("headwater_area=0,critical_area=9e3", true),
            ("headwater_area=0,critical_area=1.1e4", false),
            ("headwater_area=9e3,critical_area=1.1e4", true),
            ("headwater_area=1.1e4,critical_area=9e3", false),
        ] {
            let height = Field::constant(Window::whole(testing::world(5, 5, 100.0)), 1.0);
            let params = testing::with_params(&NODE, &format!("{areas},duration=1,schedule=full"));
            let cancel = Cancel::default();
            let (outputs, warnings) =
                testing::outputs_and_warnings(&cancel, *height.window(), &NODE, &params, &[("height", &height)]);
            assert!(outputs.is_ok() && warnings.iter().any(|text| text.contains("hillslopes")) == told, "{warnings:?}");
        }
    }
}
