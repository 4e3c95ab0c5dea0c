//! Rills, spurs and gullies on hillslopes of a model whose heights are means over coarse cells.
//!
//! The stream-power law with a headwater term cuts rills and the gullies that they join, while the means over the
//! model's cells are preserved: where a mean falls below the model's, uplift raises the terrain. At equilibrium the
//! terrain drains like eroded terrain and has the means of the model; see the module `detail`. Perron, Kirchner and
//! Dietrich (2009) show that the ratio of incision to creep sets the spacing of valleys; here the spacing is given and
//! the coefficients follow from it.

mod detail;
mod drain;
#[cfg(test)]
mod tests;

use crate::{
    numerics::{math, par},
    prelude::*,
    raster::fill_voids,
};

params! {
    /// Cell size of the model, over which means are kept.
    coarse: f64 = 90.0, Metres, 1e-3..=1e6, soft 10..=1000;
    /// Distance from one rill to the next on an even slope.
    ///
    /// Cells of a sixth of it or less show rills in full, cells of a third or more not at all.
    spacing: f64 = 90.0, Metres, 1e-3..=1e6, soft 10..=1000;
    /// How deep rills cut: a factor on erosion.
    depth: f64 = 1.0, One, 0.0..=4.0, soft 0..=2;
    /// How much `depth` varies from place to place: the standard deviation of its natural logarithm.
    ///
    /// Smooth slopes beside slopes with deep rills, in waves of 20 spacings and shorter.
    variation: f64 = 0.4, One, 0.0..=2.0, soft 0..=1.5;
    /// How round crests and valley floors are: a factor on creep.
    rounding: f64 = 1.0, One, 0.0..=10.0, soft 0..=4;
    /// How irregular the slopes are on which rills begin, relative to their gradient. Low values make rills straighter.
    irregularity: f64 = 0.25, One, 0.0..=1.0, soft 0..=0.5;
    /// Random seed of the rills.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Terrain to add detail to: a coarse elevation model, noise, a range.
    height: Height;
    /// How deep rills cut: 1 for the full `depth`, 0 for not at all.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// Terrain with rills.
    height: Height;
    /// Change in height of each cell: negative in rills and gullies, positive on spurs.
    change: Scalar(Metres);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Rills",
    version: 3,
    migrations: &[
        // rills as deep everywhere as `depth` says
        Migration { from: 1, steps: &[Step::Keep { name: "variation", value: "0" }] },
        // `base` sides stay at the level of the model
        Migration { from: 2, steps: &[] },
    ],
    category: "erosion",
    summary: "Rills, gullies and spurs on the slopes of a coarse model, preserving the means of its cells.",
    doc: include_str!("page.md"),
    sources: &[
        "J. T. Perron, J. W. Kirchner and W. E. Dietrich (2009), Formation of evenly spaced ridges and valleys, \
         Nature 460, 502-505",
        "J. Braun and S. D. Willett (2013), A very efficient O(n), implicit and parallel method to solve the stream \
         power equation, Geomorphology 180-181, 170-179",
        "J. D. Stock and W. E. Dietrich (2006), Erosion of steepland valleys by debris flows, Geological Society of \
         America Bulletin 118, 1125-1148",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells(
        "rills are the same on cells of an eighth of the spacing and less, and begin to differ on larger ones",
    ),
    example: "height: \"base\", coarse: 1024, spacing: 1024",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    if strength(&params, sizing.window.cell_m()) <= 0.0 {
        return 0;
    }
    // heights and uplift; the noise or the change of means; mean drainage areas; lake levels; codes, basins and order
    let wanted = Wants::among(sizing.wanted).count() as f64;
    let factors = if params.variation > 0.0 { 4.0 } else { 0.0 };
    sizing.cells(BYTES + factors - 4.0 * wanted)
}

/// Bytes per cell at the stage that needs the most.
const BYTES: f64 = 43.5;

/// Returns the factor on erosion: `depth`, faded out where cells are too coarse for the spacing.
fn strength(params: &Params, cell_m: f64) -> f64 {
    if params.coarse <= cell_m {
        return 0.0;
    }
    params.depth * math::smoothstep(params.spacing / (3.0 * cell_m) - 1.0)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, mask } = Inputs::read(job)?;
    let (params, window, wants) = (Params::read(job.params), job.window(), Wants::of(job));
    let strength = strength(&params, job.cell_m());
    let is_void = |height: &f32| !height.is_finite();
    if strength <= 0.0 || !par::any(height.samples(), |height| !is_void(height)) {
        if params.depth > 0.0 && strength <= 0.0 {
            job.warn(format!(
                "cells of {:.2} m are too coarse for rills {} m apart on a model of {} m, so that nothing changes; use \
                 more `cells`, or a larger `spacing` and `coarse`",
                job.cell_m(),
                params.spacing,
                params.coarse
            ));
        }
        let change = wants.change.then(|| Field::constant(window, 0.0));
        return Ok(Given { height: wants.height.then(|| height.clone()), change }.into());
    }
    let mut model = height.clone();
    if par::any(model.samples(), is_void) {
        let mut samples = model.into_samples();
        samples.iter_mut().filter(|height| is_void(height)).for_each(|height| *height = f32::NAN);
        fill_voids(window.nx(), window.ny(), &mut samples, &|| job.check())?;
        model = Field::new(window, samples);
    }
    let found = detail::of(job, &params, strength, model.samples(), mask)?;
    let (model, before) = (model.samples(), height.samples());
    let field = |of: &(dyn Fn(usize) -> f32 + Sync)| Field::new(window, par::map(found.len(), of));
    let changed = |cell: usize| if is_void(&before[cell]) { 0.0 } else { found[cell] - model[cell] };
    let kept = |cell: usize| if is_void(&before[cell]) { before[cell] } else { found[cell] };
    let change = wants.change.then(|| field(&changed));
    let height = wants.height.then(|| field(&kept));
    Ok(Given { height, change }.into())
}
