//! Glaciers: shallow ice with sliding, what it erodes, and what it leaves.
//!
//! A. H. Jarosch, C. G. Schoof and F. S. Anslow (2013) for ice over steep ground; J. Harbor (1992) for the form of
//! cross-sections; F. Herman et al. (2015) for the rate of abrasion; S. V. Ugelvig, D. L. Egholm and N. R. Iverson
//! (2016) for plucking. The node's manual page has the equations and lists the differences.

mod blur;
mod climate;
mod debris;
mod device;
mod fast;
#[cfg(test)]
mod flow_tests;
mod glacier;
mod grid;
mod ice;
mod kernels;
mod law;
mod march;
mod result;
mod sheet;
#[cfg(test)]
mod tests;
mod transfer;

use orograph_graph::Process;

use self::glacier::Glacier;
use crate::prelude::*;

choice! {
    /// How the ice is computed.
    pub enum Method {
        /// Shallow-ice approximation with sliding, stepped through time.
        Full = "full",
        /// Plastic ice along the paths of steepest descent: for previews and ice caps.
        Fast = "fast",
    }
}

choice! {
    /// How the mass balance is computed.
    pub enum Climate {
        /// The equilibrium line altitude and gradients of the balance.
        Ela = "ela",
        /// Temperature and precipitation.
        Temperature = "temperature",
    }
}

choice! {
    /// The law of abrasion.
    pub enum Law {
        /// A power of the sliding speed.
        Sliding = "sliding",
        /// The same times a power of the ice drainage area.
        Area = "area",
    }
}

params! {
    /// How the ice is computed.
    method: Method = Method::Full, One, ..;
    /// Time for which glaciers erode, all cycles together.
    duration: f64 = 2e5, Years, 0.0..=1e7, soft 0..=1e6;
    /// Number of glacial cycles.
    cycles: i64 = 1, Count, 1..=50;
    /// How much higher the equilibrium line is at the warmest time than at the glacial maximum; 0 for a constant climate.
    warming: f64 = 1000.0, Metres, 0.0..=6000.0, soft 0..=2000;
    /// Number of stages in which ice retreats, each with its moraines.
    stages: i64 = 4, Count, 1..=50, soft 1..=10;
    /// Number of steps in which the bed erodes.
    steps: i64 = 60, Count, 1..=1000, soft 20..=400;
    /// Time for which ice flows before each step of erosion.
    relaxation: f64 = 20.0, Years, 1.0..=500.0, soft 10..=100, when method = "full";
    /// How the mass balance is computed.
    climate: Climate = Climate::Ela, One, ..;
    /// Gradient of the mass balance above the equilibrium line.
    accumulation_gradient: f64 = 0.004, PerYear, 0.0..=0.1, soft 0.001..=0.01, when climate = "ela";
    /// Gradient of the mass balance below the equilibrium line.
    ablation_gradient: f64 = 0.007, PerYear, 1e-4..=0.1, soft 0.002..=0.02, when climate = "ela";
    /// Largest mass balance, as thickness of ice.
    max_accumulation: f64 = 0.8, MetresPerYear, 0.0..=20.0, soft 0.1..=4, when climate = "ela";
    /// Melt per day and kelvin above 0 °C, in millimetres of water.
    degree_day: f64 = 5.0, One, 0.1..=30.0, soft 2..=10, when climate = "temperature";
    /// Standard deviation of the temperature over the year.
    variability: f64 = 7.0, Celsius, 0.0..=30.0, soft 2..=12, when climate = "temperature";
    /// Glen's rate factor A for n = 3, in Pa⁻³ yr⁻¹: 7.6e-17 for ice at the melting point.
    rate_factor: f64 = 7.6e-17, One, 0.0..=1e-14, soft 1e-17..=2e-16;
    /// Coefficient of sliding, in m yr⁻¹ Pa⁻³; without sliding nothing erodes.
    sliding: f64 = 2e-14, One, 0.0..=1e-11, soft 0..=1e-13;
    /// Maximum basal shear stress.
    yield_stress: f64 = 2e5, Pascals, 1e4..=1e7, soft 5e4..=3e5;
    /// Largest sliding speed in the laws of erosion; faster ice erodes no faster.
    fastest: f64 = 150.0, MetresPerYear, 1.0..=1e5, soft 50..=1000;
    /// Side of the cells on which ice flows, or the world's cell size if that is larger.
    ice_cell: f64 = 75.0, Metres, 5.0..=1e5, soft 25..=500;
    /// The law of abrasion.
    law: Law = Law::Sliding, One, ..;
    /// Coefficient of abrasion, in (m/yr)^(1 − exponent).
    abrasion: f64 = 2.7e-7, One, 0.0..=1.0, soft 0..=1e-6;
    /// Exponent of the sliding speed.
    exponent: f64 = 2.0, One, 0.1..=4.0, soft 1..=3;
    /// Exponent of the ice drainage area in km².
    area_exponent: f64 = 0.3, One, 0.0..=2.0, soft 0..=1, when law = "area";
    /// Coefficient of plucking: erosion over sliding speed on a bed that falls by 45° along the flow.
    plucking: f64 = 1e-4, One, 0.0..=1.0, soft 0..=1e-3;
    /// Strength of the cross-section law: 0 cuts slots, 6 troughs with parabolic sections.
    cross_section: f64 = 6.0, One, 0.0..=20.0, soft 0..=8;
    /// Adverse slope, in metres per metre, up to which ice erodes fully; at twice this slope it deepens no basin.
    reverse_slope: f64 = 0.1, One, 0.001..=1.0, soft 0.02..=0.3;
    /// Steepest stable angle of walls above ice.
    walls: f64 = 50.0, Degrees, 5.0..=85.0, soft 35..=70;
    /// Fraction of the eroded rock that becomes debris and till; meltwater carries the rest away.
    debris: f64 = 0.3, One, 0.0..=1.0;
    /// Angle of repose of till.
    repose: f64 = 30.0, Degrees, 1.0..=60.0, soft 15..=40;
    /// Depth of erosion over which landforms finer than ice cells fade by a factor of e.
    smoothing: f64 = 15.0, Metres, 0.0..=1e4, soft 0..=100;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Equilibrium line altitude at the glacial maximum; used if `climate` is `ela`.
    ela: Scalar(Metres) = 1000.0, -10000.0..=20000.0, soft 0.0..=4000.0;
    /// Mean annual temperature at height 0 at the glacial maximum; used if `climate` is `temperature`.
    temperature: Scalar(Celsius) = 5.0, -80.0..=60.0, soft -20.0..=20.0;
    /// Precipitation as depth of water; used if `climate` is `temperature`. Negative values count as 0.
    precipitation: Scalar(MetresPerYear) = 1.5, -10.0..=50.0, soft 0.0..=5.0;
    /// Lapse rate: cooling of the air with height; used if `climate` is `temperature`.
    lapse_rate: Scalar(KelvinsPerKilometre) = 6.5, 0.0..=15.0, soft 4.0..=10.0;
    /// Factor on abrasion and plucking: the softness of the rock.
    erodibility: Scalar(One) = 1.0, 0.0..=1e4, soft 0.0..=4.0;
    /// Rock at depth, from `Stratify`: ice wears down hard layers more slowly, and their own slopes replace `walls`.
    strata: Option<Strata>;
}

outputs! {
    /// Ground after the run, without any remaining ice.
    height: Height;
    /// Thickness of the ice at the end.
    ice: Scalar(Metres);
    /// Mean velocity of the ice at the end.
    velocity: Vector(MetresPerYear);
    /// Thickness of till.
    till: Scalar(Metres);
    /// Where debris was dropped at margins of ice: terminal, lateral and recessional moraines.
    moraine: Mask;
    /// Thickness of rock removed; negative where hollows finer than ice cells have been filled.
    erosion: Scalar(Metres);
    /// Volumes and areas of ice, rock and debris, and errors of their balances.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Glacial",
    version: 2,
    // `lapse_rate` takes a map
    migrations: &[Migration { from: 1, steps: &[] }],
    category: "erosion",
    summary: "Glaciers grow, carve troughs, cirques and basins, and leave moraines as they retreat.",
    doc: include_str!("page.md"),
    sources: &[
        "M. W. Mahaffy (1976), A three-dimensional numerical model of ice sheets: Tests on the Barnes Ice Cap, Northwest \
         Territories, Journal of Geophysical Research 81, 1059-1066",
        "B. van Leer (1979), Towards the ultimate conservative difference scheme V, Journal of Computational Physics 32, \
         101-136",
        "P. Halfar (1983), On the dynamics of the ice sheets 2, Journal of Geophysical Research 88, 6043-6051",
        "S. S. Vialov (1958), Regularities of glacial shields movement and the theory of plastic viscous flow, IAHS \
         Publication 47, 266-275",
        "E. Bueler, C. S. Lingle, J. A. Kallen-Brown, D. N. Covey, L. N. Bowman (2005), Exact solutions and verification of \
         numerical models for isothermal ice sheets, Journal of Glaciology 51, 291-306",
        "A. H. Jarosch, C. G. Schoof, F. S. Anslow (2013), Restoring mass conservation to shallow ice flow models over \
         complex terrain, The Cryosphere 7, 229-240",
        "J. M. Harbor (1992), Numerical modeling of the development of U-shaped valleys by glacial erosion, Geological \
         Society of America Bulletin 104, 1364-1375",
        "F. Herman et al. (2015), Erosion by an Alpine glacier, Science 350, 193-195",
        "S. V. Ugelvig, D. L. Egholm, N. R. Iverson (2016), Glacial landscape evolution by subglacial quarrying: A multiscale \
         computational approach, Journal of Geophysical Research: Earth Surface 121, 2042-2068",
        "J. F. Nye (1951), The flow of glaciers and ice-sheets as a problem in plasticity, Proceedings of the Royal Society \
         A 207, 554-572",
        "R. Calov, R. Greve (2005), A semi-analytical solution for the positive degree-day model with stochastic temperature \
         variations, Journal of Glaciology 51, 173-175",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    process: Some(begin),
    gpu: Some(&device::GPU),
    resolution: Resolution::Cells(
        "walls and moraines can be as narrow as an ice cell, and the size of ice cells affects where ice divides",
    ),
    example: "height: \"base\", ela: 900, warming: 300, ice_cell: 300",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    let transfer = transfer::Transfer::new(&sizing.window, params.ice_cell);
    let [nx, ny] = transfer.coarse.cells();
    // ground, till and ice; the sheet or the paths
    let held = if params.method == Method::Full { 45.0 + 104.0 } else { 45.0 + 35.0 };
    // what a step needs beside them, and what outputs do, per cell of the world
    let step = if params.duration <= 0.0 { 0.0 } else { 84.0 };
    let wants = Wants::among(sizing.wanted);
    let given = 4.0 * (wants.count() + usize::from(wants.velocity) - usize::from(wants.report)) as f64;
    let on_ice = |bytes: f64| (bytes * (nx * ny) as f64) as u64;
    // outputs are made after the last step
    on_ice(held + step).saturating_sub(sizing.cells(given)).max(on_ice(held) + sizing.cells(4.0))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let mut glacier = Glacier::new(job)?;
    while !glacier.moment().is_over() {
        glacier.step(job)?;
        job.advance(glacier.fraction())?;
        job.glimpse(|| glacier.glimpse(job));
    }
    glacier.outputs(job)
}

fn begin(job: &Job<'_>) -> Result<Box<dyn Process>, NodeError> {
    Ok(Box::new(Glacier::new(job)?))
}
