//! Hydraulic erosion by shallow water.
//!
//! X. Mei, P. Decaudin and B.-G. Hu (2007) for the order of steps and the virtual pipes; P. D. Bates, M. S. Horritt and
//! T. J. Fewtrell (2010) for water with inertia; G. A. M. de Almeida and P. Bates (2013) and X. Xia and Q. Liang (2018)
//! for its friction; B. van Leer (1974) for the depth over faces; C. T. Yang (1973) for the capacity; A. Selle et al.
//! (2008) for MacCormack's transport.
//! The node's manual page lists the differences.

mod band;
mod bed;
mod budget;
mod contacts;
mod course;
mod device;
mod flow;
mod painted;
mod physics;
#[cfg(test)]
mod reference;
mod ring;
mod run;
mod slip;
mod spread;
mod storm;
#[cfg(test)]
mod tests;
mod transport;
mod warm;

use orograph_graph::Process;

use self::{
    physics::{Law, Scheme, Transport},
    storm::Storm,
};
use crate::prelude::*;

params! {
    /// Length of the simulated storm.
    duration: f64 = 7200.0, Seconds, 0.0..=1e7, soft 0.0..=36000.0;
    /// Morphological factor: the erosion and deposition of the simulated water are multiplied by it.
    acceleration: f64 = 2000.0, One, 0.0..=1e5, soft 1.0..=10000.0;
    /// Scheme of the water flow.
    scheme: Scheme = Scheme::Inertial, One, .., when law = "stream_power" | "excess_shear";
    /// Scheme of sediment transport.
    transport: Transport = Transport::Upwind, One, ..;
    /// Law of erosion and deposition: how much sediment water carries, and how fast it erodes and deposits.
    law: Law = Law::StreamPower, One, ..;
    /// Manning's roughness of the bed.
    roughness: f64 = 0.05, Roughness, 0.005..=0.5, soft 0.02..=0.15, when scheme = "inertial", when law = "stream_power" | "excess_shear";
    /// Rate at which pipes lose their discharge.
    damping: f64 = 0.0, PerSecond, 0.0..=10.0, soft 0.0..=1.0, when scheme = "pipes", when law = "stream_power" | "excess_shear";
    /// Concentration of sediment that water can carry, divided by the ratio of unit stream power to settling velocity.
    capacity: f64 = 0.01, One, 0.0..=10.0, soft 0.001..=0.1, when law = "stream_power" | "excess_shear";
    /// Settling velocity of the grains.
    settling: f64 = 0.02, MetresPerSecond, 1e-5..=2.0, soft 0.002..=0.2, when law = "stream_power" | "excess_shear";
    /// Rate at which water on loose ground reaches its capacity.
    entrainment: f64 = 0.2, PerSecond, 0.0..=100.0, soft 0.01..=1.0, when law = "stream_power" | "excess_shear";
    /// Shear stress below which the bed does not erode.
    critical_shear: f64 = 5.0, Pascals, 0.01..=1e5, soft 0.1..=200.0, when law = "excess_shear";
    /// Erosion rate of rock as a fraction of that of loose ground.
    rock: f64 = 0.01, One, 0.0..=1.0;
    /// Angle above which loose ground slides.
    talus: f64 = 35.0, Degrees, 1.0..=89.0, soft 20.0..=60.0;
    /// Depth of a film of water that is too thin to erode.
    film: f64 = 0.005, Metres, 1e-4..=1.0, soft 0.001..=0.02, when law = "stream_power" | "excess_shear";
    /// Depth at which water stops eroding its bed: its transport capacity falls to 0 towards it.
    deep: f64 = 5.0, Metres, 0.01..=1e4, soft 1.0..=20.0, when law = "stream_power" | "excess_shear";
    /// Width of the narrowest channel, 5 cells or more: erosion and deposition are spread over it. 0 for a single cell.
    width: f64 = 20.0, Metres, 0.0..=1e4, soft 0.0..=100.0, when law = "stream_power" | "excess_shear";
    /// Fraction of the water that evaporates per second.
    evaporation: f64 = 0.0, PerSecond, 0.0..=1.0, soft 0.0..=0.001, when law = "stream_power" | "excess_shear";
    /// Rate at which water seeps into the ground.
    infiltration: f64 = 0.0, MillimetresPerHour, 0.0..=1e4, soft 0.0..=50.0;
    /// Discharge of a spring.
    river: f64 = 0.0, CubicMetresPerSecond, 0.0..=1e6, soft 0.0..=500.0;
    /// Position of the spring.
    river_at: Position = Position([0.0, 0.0]), Metres, -1e7..=1e7, given river;
    /// Radius of the spring; its inflow is strongest in the middle.
    river_radius: f64 = 100.0, Metres, 0.0..=1e6, soft 1.0..=1000.0, given river;
    /// Fraction of a cell that waves may cross in a step (Courant number).
    courant: f64 = 0.6, One, 0.05..=0.7;
    /// Strokes, replayed at their times during the run.
    ///
    /// A stroke has a `tool` (`raise`, `lower`, `rain` or `erase`), a `radius` in metres, a `strength` (metres for
    /// `raise` and `lower`, default 10; mm/h for `rain`, default 200; a fraction for `erase`), a `hardness` (the
    /// fraction of the radius within which it acts fully, default 0.5), a `time` in seconds from the start, default
    /// 0, and `points`.
    strokes: TimedStrokes = TimedStrokes(Vec::new()), Metres, -1e7..=1e7;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Rain, per cell if wired.
    rain: Scalar(MillimetresPerHour) = 20.0, 0.0..=1e5, soft 0.0..=200.0;
    /// Factor on `entrainment`, per cell if wired: a mask, or the softness of the ground.
    erodibility: Scalar(One) = 1.0, 0.0..=1e6, soft 0.0..=4.0;
    /// Initial thickness of loose ground on the rock, per cell if wired.
    regolith: Scalar(Metres) = 10.0, 0.0..=1e9, soft 0.0..=50.0;
    /// Rock at depth, from `Stratify`: water erodes hard layers below the loose ground more slowly.
    strata: Option<Strata>;
    /// Drainage of the terrain, for a warm start: lakes are full and, with `scheme: inertial`, rivers flow from the start.
    flow: Option<Flow>;
}

outputs! {
    /// Terrain after the storm.
    height: Height;
    /// Depth of water at the end.
    water: Scalar(Metres);
    /// Velocity of the water at the end.
    velocity: Vector(MetresPerSecond);
    /// Suspended sediment at the end, as a depth of solid.
    sediment: Scalar(Metres);
    /// Change in height of each cell; negative where it has lost material.
    deposition: Scalar(Metres);
    /// Discharge per metre of width, averaged over the run.
    flow: Scalar(SquareMetresPerSecond);
    /// Steps, and the balances of water and of solids.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "HydraulicPipe",
    version: 2,
    // the limits on the change of the bed, per step and in cells, depended on the cells: there is nothing to keep
    migrations: &[Migration { from: 1, steps: &[] }],
    category: "erosion",
    summary: "A storm: rain runs off as shallow water, erodes where it is steep and fast, and deposits where it slows.",
    doc: include_str!("page.md"),
    sources: &[
        "X. Mei, P. Decaudin, B.-G. Hu, 2007, Fast hydraulic erosion simulation and visualization on GPU, Pacific Graphics",
        "O. Št'ava, B. Beneš, M. Brisbin, J. Křivánek, 2008, Interactive terrain modeling using hydraulic erosion, SCA",
        "P. D. Bates, M. S. Horritt, T. J. Fewtrell, 2010, A simple inertial formulation of the shallow water equations \
         for efficient two-dimensional flood inundation modelling, Journal of Hydrology 387, 33-45",
        "G. A. M. de Almeida, P. Bates, 2013, Applicability of the local inertial approximation of the shallow water \
         equations to flood modeling, Water Resources Research 49, 4833-4844",
        "X. Xia, Q. Liang, 2018, A new efficient implicit scheme for discretising the stiff friction terms in the \
         shallow water equations, Advances in Water Resources 117, 87-97",
        "C. T. Yang, 1973, Incipient motion and sediment transport, Journal of the Hydraulics Division 99, 1679-1704",
        "E. Partheniades, 1965, Erosion and deposition of cohesive soils, Journal of the Hydraulics Division 91, 105-139",
        "B. van Leer, 1974, Towards the ultimate conservative difference scheme II: monotonicity and conservation combined \
         in a second-order scheme, Journal of Computational Physics 14, 361-370",
        "A. Selle, R. Fedkiw, B. Kim, Y. Liu, J. Rossignac, 2008, An unconditionally stable MacCormack method, Journal \
         of Scientific Computing 35, 350-371",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&device::GPU),
    process: Some(begin),
    resolution: Resolution::Cells(
        "water runs in channels that can be one cell wide, but the gullies that it cuts are at least 5 cells wide, unless \
         `width` is 0",
    ),
    example: "height: \"base\", duration: 3600, rain: 60, acceleration: 4000",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    let spreads = params.law != Law::WebglErosion && params.width > 0.0;
    // the state of the storm, what is spread, and the layer of each cell; rows in progress, for one thread
    let layers = if sizing.is_wired(Inputs::PORTS, "strata") { 12.0 } else { 0.0 };
    sizing.cells(if spreads { 46.0 } else { 36.0 } + layers) + 6600 * sizing.window.nx() as u64
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let mut storm = Storm::new(job)?;
    while !storm.moment().is_over() {
        storm.step(job)?;
        job.advance(storm.fraction())?;
        job.glimpse(|| storm.glimpse(job));
    }
    storm.outputs(job)
}

fn begin(job: &Job<'_>) -> Result<Box<dyn Process>, NodeError> {
    Ok(Box::new(Storm::new(job)?))
}
