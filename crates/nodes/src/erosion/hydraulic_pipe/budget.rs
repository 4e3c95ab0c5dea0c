//! Balances of water and solids.

use super::{
    band::{Scene, State},
    physics::Physics,
    run::{Pacing, Run},
};
use crate::prelude::*;

/// Returns the sum of row sums over the world's rows, in order, so that it is the same for any number of bands.
pub(super) fn total(scene: &Scene<'_>, row: impl Fn(usize) -> f64) -> f64 {
    (0..scene.cells[1]).map(row).sum()
}

/// Returns false for the height of a cell outside of the terrain.
pub(super) fn is_land(height: f32) -> bool {
    height.abs() < super::flow::HIGHEST
}

/// Rain on land over all cells, in mm/h.
pub(super) fn rain(scene: &Scene<'_>) -> f64 {
    let nx = scene.cells[0];
    total(scene, |j| {
        let cells = (j * nx..(j + 1) * nx).filter(|&at| is_land(scene.land[at]));
        cells.map(|at| f64::from(scene.rain.at(at).max(0.0))).sum()
    })
}

/// The water on the terrain, in m³.
pub(super) fn water(run: &Run, scene: &Scene<'_>) -> f64 {
    let nx = scene.cells[0];
    let cell_m2 = scene.physics.cell_m * scene.physics.cell_m;
    cell_m2 * total(scene, |j| run.row(State::Water, j)[..nx].iter().map(|&depth| f64::from(depth)).sum())
}

/// Sums over all cells at the end of a run, in metres over one cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    /// Water on the terrain.
    pub stored: f64,
    /// Water that left across the sides, and into the air and the ground.
    pub water_out: f64,
    pub lost: f64,
    pub eroded: f64,
    pub deposited: f64,
    /// Solids in the water, and those that left with it.
    pub suspended: f64,
    pub solid_out: f64,
}

impl Sums {
    pub fn of(run: &Run, scene: &Scene<'_>) -> Self {
        let nx = scene.cells[0];
        let state = |state: State, part: &dyn Fn(f64) -> f64| {
            total(scene, |j| run.row(state, j)[..nx].iter().map(|&v| part(f64::from(v))).sum())
        };
        let left =
            |part: &dyn Fn(&super::band::Left) -> f64| run.bands.iter().flat_map(|band| &band.left).map(part).sum();
        Self {
            stored: state(State::Water, &|depth| depth),
            water_out: left(&|row| row.water),
            lost: left(&|row| row.lost),
            eroded: state(State::Change, &|gain| (-gain).max(0.0)),
            deposited: state(State::Change, &|gain| gain.max(0.0)),
            suspended: state(State::Sediment, &|depth| depth),
            solid_out: left(&|row| row.solid),
        }
    }
}

/// Returns volumes in m³, and the errors of the balances as a fraction of the turnover. `water_start` was there at
/// the start, and `water_in` has rained since.
pub(super) fn report(sums: &Sums, physics: &Physics, pacing: &Pacing, water_start: f64, water_in: f64) -> Report {
    let cell_m2 = physics.cell_m * physics.cell_m;
    let acceleration = f64::from(physics.pace(1.0).acceleration);
    let mut report = Report::default();
    report.measure("steps", pacing.steps as f64, "");
    report.measure("time_step_mean", pacing.time_s / pacing.steps.max(1) as f64, "s");
    report.measure("time_step_least", pacing.shortest_s, "s");
    report.balance(Balance::new(
        "water",
        water_start,
        &[("rain", water_in)],
        &[("left_the_world", cell_m2 * sums.water_out), ("seeped_or_evaporated", cell_m2 * sums.lost)],
        cell_m2 * sums.stored,
    ));
    report.balance(Balance::new(
        "sediment",
        0.0,
        &[("eroded", cell_m2 * sums.eroded)],
        &[("deposited", cell_m2 * sums.deposited), ("left_the_world", acceleration * (cell_m2 * sums.solid_out))],
        acceleration * (cell_m2 * sums.suspended),
    ));
    report
}
