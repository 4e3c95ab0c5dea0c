//! Creep of soil: hillslopes that relax as heat spreads.

use super::hillslope::Hillslope;
use crate::prelude::*;

params! {
    /// Time that passes.
    duration: f64 = 1e5, Years, 0.0..=1e9, soft 0.0..=1e6;
    /// Slope at which ground no longer holds, in metres per metre; 0 is without, which is linear creep.
    critical_slope: f64 = 0.0, One, 0.0..=10.0, soft 0.0..=1.5;
}

inputs! {
    /// The land.
    height: Height;
    /// The coefficient D. Below 0 counts as 0: the ground stays.
    diffusivity: Scalar(SquareMetresPerYear) = 0.01, 0.0..=1e3, soft 0.0..=0.1;
}

outputs! {
    /// The land at the end.
    height: Height;
    /// What each cell has gained; below 0 where it has lost.
    moved: Scalar(Metres);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Creep",
    category: "erosion",
    summary: "Soil that creeps downhill: rounds crests, fills hollows, wipes out what is rough.",
    doc: "Frost, roots, burrows and rain splash move soil downhill, the faster the steeper the slope. The flux is \
          q = −D ∇h, so heights h diffuse:\n\n    ∂h/∂t = ∇·(D ∇h)\n\n\
          with D the `diffusivity`, 0.001 m²/yr in dry and 0.1 m²/yr in wet lands, about 0.01 m²/yr in most. In a time t, \
          features narrower than √(D t) are gone: some 30 m in 100 000 years. A cosine of wavenumber k fades as \
          e^(−D k² t).\n\n\
          Above 0, `critical_slope` is the slope S near which soil fails:\n\n    q = −D ∇h / (1 − (|∇h| / S)²)\n\n\
          Real soils have 0.6 to 1.4. Gentle slopes stay as with linear creep, steep ones become straight at just \
          below S. (|∇h| / S)² counts as at most 0.95, so what is steeper creeps 20 times as readily as level ground; cliffs \
          need `Thermal`, which lets them fall at once.\n\n\
          Nothing is lost inside the world: `moved` sums to 0, but for what crosses its sides. Cells at `base` sides keep \
          their height and take what comes; those at `open` sides pass on what would raise them; `wall` lets nothing \
          through; `periodic` sides are joined. Where `diffusivity` is 0, as on bare rock, the ground stays as it is.\n\n\
          Steps are solved row by row and column by column, implicitly, and never overshoot. There are at most 64 of \
          them; past D · duration = 20 cells² they grow longer, with errors of 1 % in how far broad features have \
          faded.",
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
    scratch: Scratch::PerCell(8.0),
    cpu: run,
    // what moves is what bends, and coarser cells see less of it
    resolution: Resolution::Within(0.08),
    example: "height: \"base\", diffusivity: 0.02, duration: 2e6",
    ..Node::DEFAULT
};

/// The most steps of a run.
const MAX_STEPS: f64 = 64.0;

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height: start, diffusivity } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let window = job.window();
    let slope = Hillslope::new(&window, diffusivity, params.critical_slope);
    // As long as steps are of high order.
    let steps = (3.0 * slope.mobility(params.duration)).ceil().min(MAX_STEPS) as u32;
    let mut heights: Vec<f64> = start.samples().iter().map(|&height| f64::from(height)).collect();
    for step in 0..steps {
        job.advance(step as f32 / steps as f32)?;
        slope.creep(job, &mut heights, params.duration / f64::from(steps), step, &|_| false, None)?;
    }
    let wants = Wants::of(job);
    let moved = |(height, &before): (&f64, &f32)| {
        if before.is_finite() { (height - f64::from(before)) as f32 } else { 0.0 }
    };
    Ok(Given {
        height: wants.height.then(|| Field::new(window, heights.iter().map(|&height| height as f32).collect())),
        moved: wants.moved.then(|| Field::new(window, heights.iter().zip(start.samples()).map(moved).collect())),
    }
    .into())
}
