//! Long runs mostly on large cells.
//!
//! A step costs a quarter on cells twice as large. Where the ranges and the trunks of the rivers stand depends on the
//! whole run; what the small cells add, they add in a share of the time in which the land answers a change. So the land
//! spends its time on coarse cells first, and on each finer level what is left when this share has come.

use super::{
    Inputs, Params,
    coarse::Coarse,
    land::{Asked, Land},
};
use crate::prelude::*;

/// Coarser levels.
const LEVELS: u32 = 2;
/// What a level is left of the time, as a share of the response time of the land. Less leaves relief too low.
const SHARE: f64 = 0.3;
/// The fewest steps of a level: the interpolated land shows for some steps.
const LEAST_STEPS: u32 = 8;

/// The fewest cells along a side: fewer do not hold a river network.
const FEWEST_CELLS: u32 = 64;

/// The steps of a run.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// How many.
    pub count: u32,
    /// How long each is.
    pub step_yr: f64,
}

/// Makes the steps that coarser cells can make, and brings the land to where they left it. Gives their number.
///
/// # Errors
/// When an input is refused, or [`NodeError::Cancelled`].
pub fn begin(job: &Job<'_>, params: &Params, steps: Steps, land: &mut Land<'_>) -> Result<u32, NodeError> {
    below(job, params, steps, land, Inputs::read(job)?.height, 1)
}

fn below(
    job: &Job<'_>,
    params: &Params,
    steps: Steps,
    land: &mut Land<'_>,
    start: &Field,
    level: u32,
) -> Result<u32, NodeError> {
    if level > LEVELS || steps.count <= LEAST_STEPS {
        return Ok(0);
    }
    let Some(coarse) = Coarse::below(job, FEWEST_CELLS)? else { return Ok(0) };
    let coarse_job = coarse.job(job);
    let coarse_start = Inputs::read(&coarse_job)?.height;
    let mut coarse_land = Land::new(&coarse_job, params, coarse_start)?;
    let first = below(&coarse_job, params, steps, &mut coarse_land, coarse_start, level + 1)?;
    let mut step = first;
    while step + LEAST_STEPS * level < steps.count {
        let left_yr = f64::from(steps.count - step) * steps.step_yr;
        let finer_share = SHARE * f64::from(level);
        if step >= first + LEAST_STEPS
            && left_yr <= finer_share * coarse_land.response_yr(&coarse_job, steps.step_yr)?
        {
            break;
        }
        job.advance(step as f32 / (steps.count + 1) as f32)?;
        coarse_land.step(&coarse_job, steps.step_yr, step, Asked::default())?;
        step += 1;
    }
    land.take_over(job, &coarse, [start, coarse_start], coarse_land)?;
    Ok(step)
}

#[cfg(test)]
mod tests {
    use crate::{
        erosion::stream_power::{
            NODE,
            tests::{outputs, samples, white},
        },
        hydrology::engine::reference,
        prelude::*,
        testing,
    };

    #[test]
    fn detail_stays_and_base_level_falls_evenly() {
        for (nx, ny) in [(160, 129), (131, 301), (9, 400), (400, 1)] {
            let height = testing::field(testing::world(nx, ny, 20.0), |x, y| 300.0 * white(x, y));
            let [zero, repose] = [0.0, 90.0].map(|value| Field::constant(*height.window(), value));
            for (uplift, fall) in [(0.0, 0.0), (0.001, 0.0002)] {
                let uplift = Field::constant(*height.window(), uplift);
                let changes = format!("duration=1e6,schedule=coarse_to_fine,base_level_fall={fall}");
                let fields = [("height", &height), ("uplift", &uplift), ("erodibility", &zero), ("repose", &repose)];
                let after = samples(&mut outputs(&changes, &fields).expect("a result"), "height");
                for (cell, (after, before)) in after.iter().zip(height.samples()).enumerate() {
                    let base = reference::on_border(nx as usize, height.samples().len(), cell);
                    let risen = if base { -fall as f32 } else { uplift.samples()[0] } * 1e6;
                    // Beside the border the change is interpolated between the two.
                    let (x, y) = (cell as u32 % nx, cell as u32 / nx);
                    let near = !base && (x < 4 || y < 4 || x + 4 >= nx || y + 4 >= ny);
                    // 2e-3 m: the uplift and the heights are f32.
                    assert!(near || (after - before - risen).abs() < 2e-3, "{nx} {ny}, {cell}: {before} {after}");
                    assert!(fall != 0.0 || after == before, "{nx} {ny}, {cell}: {before} {after}");
                }
            }
        }
    }

    #[test]
    fn coarse_steps_make_nearly_the_same_land() {
        let height = testing::field(testing::world(192, 192, 50.0), |x, y| 20.0 * white(x, y));
        let uplift = Field::constant(*height.window(), 0.001);
        let reference_rate = testing::field(height.window().world, |x, _| if x < 4800.0 { 1e-3 } else { 2e-3 });
        let fields = [("height", &height), ("uplift", &uplift), ("reference_rate", &reference_rate)];
        let mean = |schedule: &str| {
            let changes = format!("duration=5e6,time_step=1e5,critical_area=40000,variation=0,schedule={schedule}");
            let heights = samples(&mut outputs(&changes, &fields).expect("a result"), "height");
            heights.iter().sum::<f32>() / heights.len() as f32
        };
        let (full, coarse) = (mean("full"), mean("coarse_to_fine"));
        // 5 %: other networks formed. Where the rock varies from cell to cell, rivers need longer to find its weak cells.
        assert!(full != coarse && (coarse / full - 1.0).abs() < 0.05, "{full} {coarse}");
    }

    #[test]
    fn the_same_for_any_thread_count() {
        let height = testing::field(testing::world(150, 131, 50.0), |x, y| 300.0 * white(x, y));
        let deposition = Field::constant(*height.window(), 0.5);
        let params = testing::with_params(&NODE, "duration=3e6,time_step=1e5,schedule=coarse_to_fine,n=1.2");
        let fields = [("height", &height), ("deposition", &deposition)];
        assert!(testing::run_in(1, &NODE, &params, &fields) == testing::run_in(7, &NODE, &params, &fields));
    }
}
