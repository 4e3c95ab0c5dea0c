//! Rivers as rasters and as lines: channel heads, junctions, widths and depths.
//!
//! Channel heads by Montgomery and Dietrich (1992), order by Strahler (1957), widths and depths by Leopold and Maddock
//! (1953), lines simplified by Visvalingam and Whyatt (1993) and smoothed by Chaikin (1974).

mod lines;
mod network;
mod shape;
#[cfg(test)]
mod tests;

use self::network::Network;
use crate::numerics::{cover, drained::Drained, par, routing::Grid};
use crate::{numerics::math::f32 as math, prelude::*};

choice! {
    /// Criterion for channel heads.
    pub enum Heads {
        /// Drainage area above `channel_area`.
        Area = "area",
        /// Drainage area times the square of the slope above `channel_constant`: heads lie higher on steep terrain.
        SlopeArea = "slope_area",
    }
}

params! {
    /// Criterion for channel heads.
    heads: Heads = Heads::Area, One, ..;
    /// Drainage area above which there is a channel.
    channel_area: f64 = 1e5, SquareMetres, 0.0..=1e15, soft 1e4..=1e7, when heads = "area";
    /// Threshold of A S². Measured thresholds are 500 to 4000 m².
    channel_constant: f64 = 2000.0, SquareMetres, 0.0..=1e12, soft 100.0..=10000.0, when heads = "slope_area";
    /// Bankfull width of a river of 1 m³/s.
    width: f64 = 8.0, Metres, 0.0..=1e4, soft 1.0..=30.0;
    /// Bankfull depth of a river of 1 m³/s.
    depth: f64 = 0.5, Metres, 0.0..=1e3, soft 0.1..=2.0;
    /// Removes line vertices whose triangle with their neighbours is smaller than the square of this; 0 keeps all.
    simplify: f64 = 20.0, Metres, 0.0..=1e5, soft 0.0..=200.0;
    /// Rounds corners of lines until no piece is longer than this, at most five times; 0 keeps corners.
    smooth: f64 = 20.0, Metres, 0.0..=1e5, soft 0.0..=200.0;
}

inputs! {
    /// Where water runs, from `Flow`.
    flow: Flow;
}

outputs! {
    /// 1 in cells with a channel, 0 elsewhere.
    mask: Mask;
    /// Strahler order of the channel, 0 elsewhere.
    order: Scalar(Count);
    /// Bankfull width of the channel, 0 elsewhere.
    width: Scalar(Metres);
    /// Bankfull depth of the channel, 0 elsewhere.
    depth: Scalar(Metres);
    /// Fraction of each cell that rivers cover, drawn along `lines`.
    cover: Mask;
    /// A line from each head or junction down to the next junction or end.
    lines: Lines;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Rivers",
    category: "hydrology",
    summary: "The river network: channels, their order, width and depth, and lines along them.",
    doc: include_str!("page.md"),
    sources: &[
        "D. R. Montgomery and W. E. Dietrich (1992), Channel initiation and the problem of landscape scale, Science 255, \
         826-830",
        "A. N. Strahler (1957), Quantitative analysis of watershed geomorphology, Transactions of the American \
         Geophysical Union 38, 913-920",
        "L. B. Leopold and T. Maddock (1953), The hydraulic geometry of stream channels and some physiographic \
         implications, U.S. Geological Survey Professional Paper 252",
        "M. Visvalingam and J. D. Whyatt (1993), Line generalisation by repeated elimination of points, The Cartographic \
         Journal 30, 46-51",
        "G. M. Chaikin (1974), An algorithm for high-speed curve generation, Computer Graphics and Image Processing 3, \
         346-349",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    averaging: &[("order", Averaging::Largest), ("width", Averaging::Largest), ("depth", Averaging::Largest)],
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells("a channel is one cell wide in rasters, and more of its bends show in smaller cells"),
    example: "flow: \"flow.flow\", channel_area: 500000",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let wants = Wants::among(sizing.wanted);
    // orders and directions; of lines also inflows, and sections that are no outputs
    let sections = [wants.width, wants.depth].into_iter().filter(|is_output| !is_output).count();
    sizing.cells(if wants.lines || wants.cover { 3.0 + 4.0 * sections as f64 } else { 2.0 })
}

/// Exponents of width and depth as functions of discharge, downstream hydraulic geometry (Leopold and Maddock 1953).
const WIDTH_EXPONENT: f32 = 0.5;
const DEPTH_EXPONENT: f32 = 0.4;

/// Width and depth of channels, zero elsewhere.
struct Sections {
    width_m: Vec<f32>,
    depth_m: Vec<f32>,
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let grid = Grid::new(&job.window())?;
    let drained = Drained::read(Inputs::read(job)?.flow);
    let network = Network::find(job, &grid, &drained, &params)?;
    job.advance(0.4)?;

    let law = |factor: f64, exponent: f32| -> Vec<f32> {
        let discharges = drained.discharge_m3_per_s;
        par::map(discharges.len(), |cell| match network.orders[cell] {
            0 => 0.0,
            _ => factor as f32 * math::pow(discharges[cell], exponent),
        })
    };
    let wants = Wants::of(job);
    let traced = wants.lines || wants.cover;
    let width_m = if wants.width || traced { law(params.width, WIDTH_EXPONENT) } else { Vec::new() };
    let depth_m = if wants.depth || traced { law(params.depth, DEPTH_EXPONENT) } else { Vec::new() };
    let sections = Sections { width_m, depth_m };
    job.advance(0.6)?;
    let traced = traced.then(|| lines::trace(job, &grid, &drained, &network, &sections, &params));
    let lines = traced.transpose()?;
    job.advance(0.8)?;
    let cover = lines.as_ref().filter(|_| wants.cover).map(|lines| cover::draw(job, lines)).transpose()?;

    let field = |samples| Field::new(job.window(), samples);
    let numbers = |of: fn(u8) -> f32| field(par::map_of(&network.orders, |&order| of(order)));
    Ok(Given {
        mask: wants.mask.then(|| numbers(|order| if order > 0 { 1.0 } else { 0.0 })),
        order: wants.order.then(|| numbers(f32::from)),
        width: wants.width.then(|| field(sections.width_m)),
        depth: wants.depth.then(|| field(sections.depth_m)),
        cover: cover.map(field),
        lines: lines.filter(|_| wants.lines),
    }
    .into())
}
