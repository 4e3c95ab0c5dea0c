//! Soil creep: diffusion of hillslopes.

mod device;

use crate::numerics::{hillslope::Hillslope, ledger};
use crate::prelude::*;
use orograph_graph::{Boundary, Edge, memory::zeroed};

params! {
    /// Simulated time.
    duration: f64 = 1e5, Years, 0.0..=1e9, soft 0.0..=1e6;
    /// Slope at which the ground fails, in metres per metre; 0 for linear creep.
    critical_slope: f64 = 0.0, One, 0.0..=10.0, soft 0.0..=1.5;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Diffusion coefficient D. Negative values count as 0: the ground does not change.
    diffusivity: Scalar(SquareMetresPerYear) = 0.01, 0.0..=1e3, soft 0.0..=0.1;
}

outputs! {
    /// Terrain at the end.
    height: Height;
    /// Change in height of each cell; negative where it has lost material.
    moved: Scalar(Metres);
    /// The soil that was eroded, settled and left the world, with the error of the balance.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Creep",
    category: "erosion",
    summary: "Soil creep: rounds crests, fills hollows and smooths roughness.",
    doc: include_str!("page.md"),
    sources: &[
        "W. E. H. Culling (1960), Analytical theory of erosion, Journal of Geology 68, 336-344",
        "J. J. Roering, J. W. Kirchner and W. E. Dietrich (1999), Evidence for nonlinear, diffusive sediment transport on \
         hillslopes and implications for landscape morphology, Water Resources Research 35, 853-870",
        "N. F. Fernandes and W. E. Dietrich (1997), Hillslope evolution by diffusive processes: The timescale for \
         equilibrium adjustments, Water Resources Research 33, 1307-1318",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&device::GPU),
    // creep depends on curvature, which coarser cells underestimate
    resolution: Resolution::Within(0.08),
    example: "height: \"base\", diffusivity: 0.02, duration: 2e6",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    sizing.cells(if Wants::among(sizing.wanted).report { 16.0 } else { 8.0 })
}

/// Maximum number of steps of a run.
const MAX_STEPS: f64 = 64.0;

/// Number of steps between two reports of progress.
const TOGETHER: usize = 8;

/// Returns the number of steps: D Δt / d² of each is at most 1/3, where steps are fourth-order in space, unless that takes
/// more than [`MAX_STEPS`].
fn steps(mobility: f64) -> u32 {
    (3.0 * mobility).ceil().min(MAX_STEPS) as u32
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height: start, diffusivity } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let window = job.window();
    let slope = Hillslope::new(&without_margin(window), diffusivity, params.critical_slope);
    let steps = steps(slope.mobility(params.duration));
    let mut heights: Vec<f64> = start.samples().iter().map(|&height| f64::from(height)).collect();
    let wants = Wants::of(job);
    let mut left = zeroed(if wants.report { heights.len() } else { 0 })?;
    for first in (0..steps).step_by(TOGETHER) {
        job.advance(first as f32 / steps as f32)?;
        let left = wants.report.then_some(&mut left[..]);
        let turns = first..steps.min(first + TOGETHER as u32);
        slope.creep(job, &mut heights, params.duration / f64::from(steps), turns, &|_| false, left)?;
    }
    let moved = |(height, &before): (&f64, &f32)| {
        if before.is_finite() { (height - f64::from(before)) as f32 } else { 0.0 }
    };
    let report = || {
        let changes = heights.iter().zip(start.samples()).map(|(height, &before)| height - f64::from(before));
        balance(job, ledger::gains_and_losses(changes), left.iter().sum())
    };
    Ok(Given {
        report: wants.report.then(report),
        height: wants.height.then(|| Field::new(window, heights.iter().map(|&height| height as f32).collect())),
        moved: wants.moved.then(|| Field::new(window, heights.iter().zip(start.samples()).map(moved).collect())),
    }
    .into())
}

/// A window whose `inland` sides are `open`: only nodes that compute a margin continue the terrain beyond them.
fn without_margin(mut window: Window) -> Window {
    let Boundary { west, east, north, south } = &mut window.world.boundary;
    for edge in [west, east, north, south] {
        *edge = if *edge == Edge::Inland { Edge::Open } else { *edge };
    }
    window
}

/// Returns the balance of soil from the sums of gains and losses of cells, and of what left the world, in metres over a
/// cell.
fn balance(job: &Job<'_>, [settled, eroded]: [f64; 2], left: f64) -> Report {
    let volume = |metres: f64| job.cell_m() * job.cell_m() * metres;
    let mut report = Report::default();
    report.balance(Balance::new(
        "soil",
        0.0,
        &[("eroded", volume(eroded))],
        &[("settled", volume(settled)), ("left_the_world", volume(left))],
        0.0,
    ));
    report
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, outputs, with_params, world};

    /// `inland` sides are like `open` ones: soil leaves at the low side, and does not pile up there.
    #[test]
    fn soil_leaves_at_inland_sides() {
        let params = with_params(&NODE, "duration=1e6");
        let of = |edge| {
            let world = orograph_graph::World { boundary: Boundary::all(edge), ..world(40, 30, 20.0) };
            let plane = field(world, |x, _| 0.1 * x);
            let mut found = outputs(&NODE, &params, &[("height", &plane)]).expect("soil that creeps");
            found.take("height").and_then(|value| value.as_field().cloned()).expect("a field").samples().to_vec()
        };
        let inland = of(Edge::Inland);
        assert_eq!(inland, of(Edge::Open));
        assert!(inland != of(Edge::Wall));
    }
}
