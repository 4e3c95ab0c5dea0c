//! The land at an age as a fixed point of its own drainage network, found on the coarsest level first.
//!
//! Rivers that compete for land take many rounds to settle, but the outlines of the network can be found on large
//! cells, where a round costs little (Tzathas, Gailleton, Steer and Cordonnier 2024). They are the cells of the coarsest
//! of the [`levels`](super::levels), so that the network does not depend on the cells that are asked for. Finer levels
//! pass their own, shorter time with the same solution.

use super::{
    Inputs, Params,
    land::{Asked, Land, Work},
};
use crate::prelude::*;

/// Rounds on the coarsest level and on a single grid, where the network forms.
const ROUNDS: u32 = 32;

/// Refuses settings that the solution does not know.
///
/// # Errors
/// What it is, and what to do.
pub fn refuses(params: &Params, settles: bool, has_strata: bool) -> Result<(), NodeError> {
    if params.n != 1.0 {
        return refuse(&format!("is for n = 1, and n is {}", params.n), "leave `n` at its default");
    }
    if settles {
        return refuse("does not support deposition", "leave `deposition` at its default");
    }
    if params.uplift_course.0.iter().any(|[_, factor]| *factor != params.uplift_course.0[0][1]) {
        return refuse("does not support uplift that changes with time", "leave `uplift_course` at its default");
    }
    if has_strata {
        return refuse("does not support rock at depth", "leave `strata` unwired");
    }
    Ok(())
}

/// Refuses what the solution does not know of the inputs.
///
/// # Errors
/// What it is, and what to do.
pub fn check(job: &Job<'_>, params: &Params) -> Result<(), NodeError> {
    let inputs = Inputs::read(job)?;
    refuses(params, inputs.deposition.constant().is_none_or(|g| g > 0.0), inputs.strata.is_some())?;
    let under = |level: f64| inputs.height.samples().iter().any(|&height| f64::from(height) < level);
    if job.sea_level().is_some_and(under) {
        return refuse(
            "does not support a sea, and terrain lies below the world's sea level",
            "lower the world's `sea_level`",
        );
    }
    Ok(())
}

fn refuse(what: &str, way: &str) -> Result<(), NodeError> {
    Err(NodeError::failed_with_hint(
        format!("`method: analytical` {what}"),
        format!("{way}, or use `method: implicit`"),
    ))
}

/// Puts the land at its age at the end of the run, and finds its network.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn grow(job: &Job<'_>, params: &Params, land: &mut Land<'_>) -> Result<(), NodeError> {
    let inputs = Inputs::read(job)?;
    if params.duration <= 0.0 {
        return Ok(());
    }
    for round in 0..ROUNDS {
        job.advance(round as f32 / (ROUNDS + 1) as f32)?;
        land.grow(job, inputs.height.samples(), [0.0, params.duration], round)?;
    }
    Ok(())
}

/// The same land at an earlier time, on the network that [`grow`] has found.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn go_back(job: &Job<'_>, land: &mut Land<'_>, until_yr: f64) -> Result<(), NodeError> {
    land.grow(job, Inputs::read(job)?.height.samples(), [0.0, until_yr], ROUNDS)
}

/// Warns of creep on a single grid, where the solution leaves it out.
///
/// # Errors
/// When an input is missing.
pub fn warn_of_creep(job: &Job<'_>) -> Result<(), NodeError> {
    if Inputs::read(job)?.diffusivity.constant().is_none_or(|diffusivity| diffusivity > 0.0) {
        job.warn(
            "`method: analytical` with `schedule: full` leaves out the creep of `diffusivity`; use `coarse_to_fine` or \
             `method: implicit` to see it",
        );
    }
    Ok(())
}

/// What wears the land down in a year, as far as it is asked for, where time has passed.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn wear(job: &Job<'_>, params: &Params, land: &mut Land<'_>, asked: Asked) -> Result<(f64, Work), NodeError> {
    let work = if params.duration > 0.0 { land.wear(job, asked)? } else { Work::default() };
    Ok((1.0, work))
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use crate::{
        erosion::stream_power::{
            NODE,
            tests::{PLAIN, largest_relative_error, outputs, samples, steady, strip, white},
        },
        numerics::math,
        prelude::*,
        testing,
    };

    fn heights(height: &Field, changes: &str, uplift: f32, erodibility: f32) -> Vec<f32> {
        let [uplift, erodibility, repose] =
            [uplift, erodibility, 90.0].map(|value| Field::constant(*height.window(), value));
        let fields = [("height", height), ("uplift", &uplift), ("erodibility", &erodibility), ("repose", &repose)];
        let changes = format!("{PLAIN},method=analytical,{changes}");
        samples(&mut outputs(&changes, &fields).expect("a result"), "height")
    }

    /// Years from each cell of a strip to its end: ∑ d / (K √A).
    fn travel_yr(cells: usize, erodibility: f64) -> Vec<f64> {
        let link_yr = |cell: usize| 100.0 / (erodibility * ((cell + 1) as f64 * 1e4).sqrt());
        (0..=cells).map(|from| (from..cells).map(link_yr).sum()).collect()
    }

    /// Where uplift has doubled, the new steep reach ends in a knickpoint, and above it the old land is lifted:
    /// h = U τ below, U τ − U / 2 (τ − t) above.
    #[test]
    fn a_knickpoint_is_where_the_closed_form_has_it() {
        let before = steady(400, 50.0, 0.5);
        let height = strip(400, |x| before[(x / 100.0) as usize]);
        let travel_yr = travel_yr(400, 1e-5);
        for age_yr in [1e3, 1e5, 8e5, 2e6, 1e9] {
            let found = heights(&height, &format!("duration={age_yr}"), 0.001, 1e-5);
            let expected: Vec<f64> =
                travel_yr.iter().map(|tau_yr| 0.001 * tau_yr - 0.0005 * (tau_yr - age_yr).max(0.0)).collect();
            // 1e-6: constants and heights are f32.
            let error = largest_relative_error(&found, &expected);
            assert!(error < 1e-6, "{age_yr}: {error}");
        }
    }

    #[test]
    fn a_falling_base_level_travels_upstream() {
        let height = strip(100, |_| 0.0);
        let travel_yr = travel_yr(100, 1e-5);
        for age_yr in [1e5, 5e6] {
            let found = heights(&height, &format!("duration={age_yr},base_level_fall=0.001"), 0.0, 1e-5);
            for (found, tau_yr) in found.iter().zip(&travel_yr) {
                let expected = -0.001 * (age_yr - tau_yr).max(0.0);
                // 1e-3 m: heights of 5000 m in f32.
                assert!((f64::from(*found) - expected).abs() < 1e-3, "{age_yr}: {found} {expected}");
            }
        }
    }

    /// The mean height agrees to 5 % when land is old. Young land remembers rivers that have moved since.
    #[test]
    fn land_is_near_that_of_two_hundred_steps() {
        let window = Window::whole(testing::world(128, 128, 100.0));
        let height = testing::generate(window, &crate::generate::perlin::NODE, "wavelength=200,octaves=3,amplitude=10");
        let [uplift, erodibility] = [0.001, 1e-5].map(|value| Field::constant(*height.window(), value));
        let fields = [("height", &height), ("uplift", &uplift), ("erodibility", &erodibility)];
        for (duration, tolerance) in [(2e5, 0.1), (1e6, 0.05), (4e6, 0.05)] {
            let mean = |method: &str| {
                let changes =
                    format!("duration={duration},time_step={},critical_area=4e4,method={method}", duration / 200.0);
                let heights = samples(&mut outputs(&changes, &fields).expect("a result"), "height");
                heights.iter().sum::<f32>() / heights.len() as f32
            };
            let (steps, at_once) = (mean("implicit"), mean("analytical"));
            assert!((at_once / steps - 1.0).abs() < tolerance, "{duration}: {steps} {at_once}");
        }
    }

    #[test]
    fn rock_that_does_not_erode_only_rises() {
        let height = testing::field(testing::world(30, 40, 100.0), |x, y| 300.0 * white(x, y));
        let found = heights(&height, "duration=1e6", 0.001, 0.0);
        for (cell, (after, before)) in found.iter().zip(height.samples()).enumerate() {
            let base = crate::numerics::routing::reference::on_border(30, found.len(), cell);
            let risen = if base { 0.0 } else { 1000.0 };
            // 1e-3 m: a drop of up to 300 m over a millionth of a link.
            assert!((after - before - risen).abs() < 1e-3, "{before} {after}");
        }
        assert!(heights(&height, "duration=0", 0.001, 1e-5) == height.samples());
    }

    #[test]
    fn it_refuses_what_it_does_not_know() {
        let height = strip(4, |_| 1.0);
        let deposition = Field::constant(*height.window(), 0.5);
        let low = testing::at_sea(&height, 2.0);
        for (changes, fields) in [
            ("n=1.5", vec![("height", &height)]),
            ("", vec![("height", &low)]),
            ("", vec![("height", &height), ("deposition", &deposition)]),
        ] {
            let error = outputs(&format!("method=analytical,{changes}"), &fields).expect_err("unknown");
            assert!(matches!(error, NodeError::Failed { hint: Some(_), .. }), "{error}");
        }
        // a cell under the sea that only the finer levels have
        let land = testing::field(testing::world(300, 300, 50.0), |x, y| {
            if [x, y].iter().all(|at| (7500.0..7550.0).contains(at)) { -1.0 } else { 100.0 }
        });
        let lake = testing::at_sea(&land, 0.0);
        let params = testing::with_params(&NODE, "method=analytical,duration=1e6");
        let error = testing::outputs(&NODE, &params, &[("height", &lake)]).expect_err("a sea").to_string();
        assert!(error.contains("does not support a sea"), "{error}");
        let mut params = testing::with_params(&NODE, "method=analytical");
        params.set("uplift_course", ParamValue::Curve(vec![[0.0, 0.0], [1.0, 1.0]]));
        let error = testing::outputs(&NODE, &params, &[("height", &height)]).expect_err("unknown").to_string();
        assert!(error.contains("uplift that changes"), "{error}");
    }

    #[test]
    fn extreme_inputs_give_heights() {
        for (nx, ny) in [(1, 1), (1, 20), (20, 1), (2, 3), (33, 70), (130, 129)] {
            let rough = testing::field(testing::world(nx, ny, 10.0), |x, y| 500.0 * white(x, y));
            for (erodibility, uplift) in [(1e3, 0.001), (1e3, -1.0), (1e-30, 1.0), (2e-6, 0.0), (-1.0, 0.001)] {
                for changes in ["duration=1e9", "duration=1e-9", "duration=1e6,m=2,receivers=rho_infinity"] {
                    let found = heights(&rough, changes, uplift, erodibility);
                    assert!(found.iter().all(|height| height.is_finite()), "{nx} {ny}, {changes}");
                }
            }
        }
    }

    #[test]
    fn the_same_for_any_thread_count() {
        let world = testing::world(150, 131, 50.0);
        let height = testing::field(world, |x, y| 300.0 * white(x, y));
        let uplift = testing::field(world, |x, _| 0.0005 * (1.0 + math::sin(x / 1000.0)));
        let params = testing::with_params(&NODE, "method=analytical,duration=1e6");
        let fields = [("height", &height), ("uplift", &uplift)];
        assert!(testing::run_in(1, &NODE, &params, &fields) == testing::run_in(7, &NODE, &params, &fields));
    }
}
