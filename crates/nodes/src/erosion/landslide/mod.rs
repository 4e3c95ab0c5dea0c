//! Landslides: single failures of rock and soil, with scars, deposits and a record of every event.
//!
//! A. L. Densmore, M. A. Ellis and R. S. Anderson (1998) and B. Campforts et al. (2020) for rock, D. R. Montgomery and
//! W. E. Dietrich (1994) for soil, R. M. Iverson et al. (1998) for deposits. The node's manual page has the equations
//! and lists the differences.

mod deposit;
mod draw;
mod land;
mod noise;
mod record;
mod run;
mod runout;
mod scar;
mod soil;
#[cfg(test)]
mod tests;
mod wedge;

use self::run::Slides;
use crate::{numerics::par, prelude::*};

params! {
    /// Time for which slides happen.
    duration: f64 = 10e3, Years, 0.0..=1e9, soft 0..=50e3;
    /// Number of places per km² and 1000 years at which rock is tested.
    rate: f64 = 2.0, One, 0.0..=1e4, soft 0..=10;
    /// Length of the smallest zones of weak rock or soil.
    smallest: f64 = 60.0, Metres, 1.0..=1e5, soft 10..=500;
    /// Length of the largest zones of weak rock or soil: no scar is much longer.
    largest: f64 = 1200.0, Metres, 1.0..=1e5, soft 100..=5000;
    /// Exponent α of the areas of these zones, whose probability density is proportional to A^(−α).
    size_exponent: f64 = 1.8, One, 1.1..=6.0, soft 1.5..=3;
    /// Thickness of zones of weak rock that are 100 m long; for other lengths, it scales with length to the power of 0.7.
    thickness: f64 = 10.0, Metres, 0.1..=1e4, soft 1..=50;
    /// Cohesion of rock masses. Layers multiply it by their hardness.
    cohesion: f64 = 15e3, Pascals, 0.0..=1e8, soft 0..=200e3;
    /// Density of rock in kg/m³.
    density: f64 = 2500.0, One, 500.0..=5000.0, soft 2000..=3000;
    /// Horizontal acceleration in earthquakes, as a fraction of gravity. It lowers the angle of friction.
    shaking: f64 = 0.2, One, 0.0..=2.0, soft 0..=0.5;
    /// How much `repose` varies from place to place: its standard deviation. Harder rock holds steeper slopes.
    repose_variation: f64 = 7.0, Degrees, 0.0..=45.0, soft 0..=15;
    /// Size of the largest bodies of harder or softer rock; 0 for the same `repose` everywhere.
    variation_size: f64 = 6e3, Metres, 0.0..=1e7, soft 0..=50e3;
    /// How rough hillslopes are: the `roughness` of `StreamPower`. Knolls of harder rock stand steeper.
    knolls: f64 = 0.25, One, 0.0..=1.0, soft 0..=0.5, given headwater_area;
    /// How far knolls are drawn out down a slope: the `ribs` of `StreamPower`.
    ribs: f64 = 0.7, One, 0.0..=4.0, soft 0..=2, given headwater_area, given knolls;
    /// The `headwater_area` of `StreamPower`; the largest knolls are half as long as its square root.
    headwater_area: f64 = 5e5, SquareMetres, 0.0..=1e12, soft 0..=5e6;
    /// Largest deviation of the dip and the strike of a failure plane from those of the law.
    scatter: f64 = 5.0, Degrees, 0.0..=30.0, soft 0..=10;
    /// Irregularity of the outlines and floors of scars.
    roughness: f64 = 0.2, One, 0.0..=1.0, soft 0..=0.5;
    /// Volume of debris per volume of rock.
    bulking: f64 = 1.25, One, 1.0..=2.0, soft 1..=1.5;
    /// Area of a deposit over its volume to the power of 2/3.
    spread: f64 = 20.0, One, 1.0..=1e3, soft 5..=200;
    /// Fall divided by runout for a slide of 1 m³; with 0, debris runs until its sheet is complete.
    ///
    /// Fall and runout are measured from the crown of the scar to the farthest debris. Larger slides run farther.
    reach: f64 = 0.9, One, 0.0..=10.0, soft 0.5..=1.5;
    /// Slope at and above which no debris comes to rest.
    deposit_slope: f64 = 25.0, Degrees, 1.0..=80.0, soft 10..=40;
    /// Number of places per km² and 1000 years at which soil is tested.
    soil_rate: f64 = 20.0, One, 0.0..=1e4, soft 0..=100, with soil;
    /// Cohesion of soil with its roots.
    soil_cohesion: f64 = 2e3, Pascals, 0.0..=1e6, soft 0..=20e3, with soil;
    /// Angle of friction of soil.
    soil_friction: f64 = 33.0, Degrees, 0.0..=80.0, soft 20..=45, with soil;
    /// Density of moist soil in kg/m³.
    soil_density: f64 = 1800.0, One, 500.0..=5000.0, soft 1200..=2200, with soil;
    /// Random seed of the events, and of the variation of `repose`.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Angle of friction of rock: the steepest stable slope of `StreamPower`. With `strata`, the layers have their own.
    repose: Scalar(Degrees) = 38.0, 0.0..=90.0, soft 20.0..=60.0;
    /// Thickness of soil. Shallow slides happen only if it is wired.
    soil: Option<Scalar(Metres)>;
    /// Saturated fraction of the soil, from its base up; used only if `soil` is wired.
    wetness: Scalar(One) = 0.7, 0.0..=1.0;
    /// Rock at depth, from `Stratify`: its layers have their own angles, and multiply `cohesion` by their hardness.
    strata: Option<Strata>;
}

outputs! {
    /// Terrain with scars and deposits.
    height: Height;
    /// Depth that slides have removed.
    scars: Scalar(Metres);
    /// Thickness of the debris of slides.
    deposit: Scalar(Metres);
    /// Thickness of soil and debris.
    soil: Scalar(Metres);
    /// Number, sizes and exponents of slides, the balances of rock, soil and debris, and a table of events.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Landslide",
    version: 6,
    migrations: &[
        // the rock of `StreamPower` at its defaults
        Migration { from: 1, steps: &[Step::Keep { name: "variation_size", value: "8e3" }] },
        // and its rough ground; sizes with published exponents of volumes too
        Migration {
            from: 2,
            steps: &[Step::Keep { name: "knolls", value: "0" }, Step::Keep { name: "size_exponent", value: "2.2" }],
        },
        Migration { from: 3, steps: &[Step::Keep { name: "ribs", value: "0" }] },
        // the rock of `StreamPower` 12
        Migration {
            from: 4,
            steps: &[Step::Keep { name: "variation_size", value: "3e3" }, Step::Keep { name: "knolls", value: "0.22" }],
        },
        // mounds of one size on all deposits
        Migration { from: 5, steps: &[] },
    ],
    category: "erosion",
    summary: "Rock fails in wedges and soil in shallow slides; debris runs out and comes to rest below.",
    doc: include_str!("page.md"),
    sources: &[
        "C. Culmann (1875), Die graphische Statik, Meyer & Zeller, Zürich",
        "A. L. Densmore, M. A. Ellis and R. S. Anderson (1998), Landsliding and the evolution of normal-fault-bounded \
         mountains, Journal of Geophysical Research 103, 15203-15219",
        "B. Campforts, C. M. Shobe, P. Steer, M. Vanmaercke, D. Lague and J. Braun (2020), HyLands 1.0: a hybrid landscape \
         evolution model to simulate the impact of landslides and landslide-derived sediment on landscape evolution, \
         Geoscientific Model Development 13, 3863-3886",
        "D. R. Montgomery and W. E. Dietrich (1994), A physically based model for the topographic control on shallow \
         landsliding, Water Resources Research 30, 1153-1171",
        "R. M. Iverson, S. P. Schilling and J. W. Vallance (1998), Objective delineation of lahar-inundation hazard zones, \
         Geological Society of America Bulletin 110, 972-984",
        "J. P. Griswold and R. M. Iverson (2008), Mobility statistics and automated hazard mapping for debris flows and rock \
         avalanches, U.S. Geological Survey Scientific Investigations Report 2007-5276",
        "J. Corominas (1996), The angle of reach as a mobility index for small and large landslides, Canadian Geotechnical \
         Journal 33, 260-271",
        "B. D. Malamud, D. L. Turcotte, F. Guzzetti and P. Reichenbach (2004), Landslide inventories and their statistical \
         properties, Earth Surface Processes and Landforms 29, 687-711",
        "I. J. Larsen, D. R. Montgomery and O. Korup (2010), Landslide erosion controlled by hillslope material, Nature \
         Geoscience 3, 247-251",
        "A. Clauset, C. R. Shalizi and M. E. J. Newman (2009), Power-law distributions in empirical data, SIAM Review 51, \
         661-703",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells(
        "scars shorter than three cells are left out, and slopes between smaller cells are steeper",
    ),
    example: "height: \"base\", repose: 25, rate: 4",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let (params, wants) = (Params::read(sizing.params), Wants::among(sizing.wanted));
    let if_wired = |input: &str, bytes: f64| if sizing.is_wired(Inputs::PORTS, input) { bytes } else { 0.0 };
    let when = |is: bool, bytes: f64| if is { bytes } else { 0.0 };
    // ground, debris, scars and soil
    let held = 24.0 + if_wired("soil", 8.0);
    let world = &sizing.window.world;
    let soil_rate = if sizing.is_wired(Inputs::PORTS, "soil") { params.soil_rate } else { 0.0 };
    let tests = (params.rate + soil_rate) * 1e-9 * params.duration * world.size[0] * world.size[1];
    // what moves and where it comes from, and the steepest slopes
    let varies = params.variation_size > 0.0 && params.repose_variation > 0.0;
    let steepest = when(varies, 8.0).max(when(varies || sizing.is_wired(Inputs::PORTS, "repose"), 4.0));
    let knolls = when(params.knolls > 0.0 && params.headwater_area > 0.0, 4.0);
    let step = when(tests > 0.0, 33.0 + steepest + knolls);
    let given = 4.0 * (wants.count() - usize::from(wants.report)) as f64;
    let events = (200.0 * tests.min(draw::MOST_TESTS)) as u64;
    // outputs are made when nothing moves any more
    sizing.cells(held + (step - given).max(0.0)) + events
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (params, wants) = (Params::read(job.params), Wants::of(job));
    let inputs = Inputs::read(job)?;
    let slides = Slides::happen(job, &params, &inputs)?;
    let land = &slides.land;
    let cells = |value: &(dyn Fn(usize) -> f32 + Sync)| par::field(job, [0.95, 1.0], value);
    let soil = |cell: usize| (land.debris[cell] + land.soil.get(cell).copied().unwrap_or(0.0)) as f32;
    Ok(Given {
        height: wants.height.then(|| cells(&|cell| land.ground[cell] as f32)).transpose()?,
        scars: wants.scars.then(|| cells(&|cell| land.scars[cell] as f32)).transpose()?,
        deposit: wants.deposit.then(|| cells(&|cell| land.debris[cell] as f32)).transpose()?,
        soil: wants.soil.then(|| cells(&soil)).transpose()?,
        report: wants.report.then(|| slides.record(&params, &inputs).report()),
    }
    .into())
}
