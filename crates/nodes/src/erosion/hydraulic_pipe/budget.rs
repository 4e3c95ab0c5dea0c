//! Balances of water and solids.

use super::{
    band::{Scene, State},
    run::{Pacing, Run},
};
use crate::prelude::*;

/// Returns the sum of row sums over the world's rows, in order, so that it is the same for any number of bands.
pub(super) fn total(scene: &Scene<'_>, row: impl Fn(usize) -> f64) -> f64 {
    (0..scene.cells[1]).map(row).sum()
}

/// Rain on land over all cells, in mm/h.
pub(super) fn rain(scene: &Scene<'_>) -> f64 {
    let nx = scene.cells[0];
    let land = |at: usize| scene.land[at].abs() < super::flow::HIGHEST;
    total(scene, |j| {
        let cells = (j * nx..(j + 1) * nx).filter(|&at| land(at));
        cells.map(|at| f64::from(scene.rain.at(at).max(0.0))).sum()
    })
}

/// The water on the terrain, in m³.
pub(super) fn water(run: &Run, scene: &Scene<'_>) -> f64 {
    let nx = scene.cells[0];
    let cell_m2 = scene.physics.cell_m * scene.physics.cell_m;
    cell_m2 * total(scene, |j| run.row(State::Water, j)[..nx].iter().map(|&depth| f64::from(depth)).sum())
}

/// Returns volumes in m³, and the errors of the balances as a fraction of the turnover. `water_start` was there at
/// the start, and `water_in` has rained since.
pub(super) fn report(run: &Run, scene: &Scene<'_>, pacing: &Pacing, water_start: f64, water_in: f64) -> Report {
    let physics = &scene.physics;
    let nx = scene.cells[0];
    let cell_m2 = physics.cell_m * physics.cell_m;
    let sum = |row: &[f32], part: &dyn Fn(f64) -> f64| row[..nx].iter().map(|&v| part(f64::from(v))).sum::<f64>();
    let state = |state: State, part: &dyn Fn(f64) -> f64| cell_m2 * total(scene, |j| sum(run.row(state, j), part));
    let left = |part: &dyn Fn(&super::band::Left) -> f64| {
        cell_m2 * run.bands.iter().flat_map(|band| &band.left).map(part).sum::<f64>()
    };
    let (water_out, water_lost) = (left(&|row| row.water), left(&|row| row.lost));
    let water_stored = water(run, scene);
    let acceleration = f64::from(physics.pace(1.0).acceleration);
    let eroded = state(State::Change, &|gain| (-gain).max(0.0));
    let deposited = state(State::Change, &|gain| gain.max(0.0));
    let suspended = acceleration * state(State::Sediment, &|depth| depth);
    let solid_out = acceleration * left(&|row| row.solid);

    let mut report = Report::default();
    report.measure("steps", pacing.steps as f64, "");
    report.measure("time_step_mean", pacing.time_s / pacing.steps.max(1) as f64, "s");
    report.measure("time_step_least", pacing.shortest_s, "s");
    report.balance(Balance::new(
        "water",
        water_start,
        &[("rain", water_in)],
        &[("left_the_world", water_out), ("seeped_or_evaporated", water_lost)],
        water_stored,
    ));
    report.balance(Balance::new(
        "sediment",
        0.0,
        &[("eroded", eroded)],
        &[("deposited", deposited), ("left_the_world", solid_out)],
        suspended,
    ));
    report
}
