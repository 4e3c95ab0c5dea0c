//! River incision by the stream-power law, in balance with uplift.
//!
//! Howard (1994) for the law, Braun and Willett (2013) for the implicit solution along the drainage tree, receivers
//! first. What differs from the paper: depressions are routed through (Cordonnier, Bovy and Braun 2019), receivers may
//! be drawn at random between the two neighbours of the steepest facet, the drainage area has a lower limit, and slopes
//! an upper one, erodibility may vary at random, and soil creeps between the rivers (Culling 1960). Heights are kept in
//! double precision through the whole run, because the uplift of one step can be less than a height in single precision
//! can hold.

mod analytical;
mod area;
mod coarse;
mod course;
mod deposition;
#[cfg(test)]
mod hillslope_tests;
mod incision;
mod land;
mod links;
mod memory;
mod rock;
mod schedule;
mod slides;
mod tectonics;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use self::{
    land::{Asked, Land, Work},
    rock::DEFAULT_ERODIBILITY,
    schedule::Steps,
};
use crate::prelude::*;

choice! {
    /// How the receiver of a cell is chosen.
    pub enum Receivers {
        /// At random at each step between the two neighbours of the steepest facet, so that rivers run in every
        /// direction alike.
        RhoInfinity = "rho_infinity",
        /// The neighbour of steepest descent.
        D8 = "d8",
    }
}

choice! {
    /// How the law is solved.
    pub enum Method {
        /// Step by step.
        Implicit = "implicit",
        /// At once, as a preview: the age of the land can be drawn like a slider.
        Analytical = "analytical",
    }
}

choice! {
    /// On which cells the time passes.
    pub enum Schedule {
        /// All of it on the cells of the world.
        Full = "full",
        /// Long times mostly on cells four times and twice as large.
        CoarseToFine = "coarse_to_fine",
    }
}

params! {
    /// Time that passes.
    duration: f64 = 2e6, Years, 0.0..=1e9, soft 0..=10e6;
    /// Exponent m of the drainage area.
    m: f64 = 0.5, One, 0.0..=2.0, soft 0.3..=0.7;
    /// Exponent n of the slope.
    n: f64 = 1.0, One, 0.1..=5.0, soft 0.7..=2.0;
    /// Drainage area at which rivers begin; 0 begins them at every cell.
    ///
    /// Smaller areas erode as if they were this large, which makes the hillslopes between rivers the same at every
    /// cell size whose cells are smaller than this.
    critical_area: f64 = 2e4, SquareMetres, 0.0..=1e12, soft 0..=1e6;
    /// Factor of the uplift in the course of the run: places from 0, the start, to 1, the end.
    ///
    /// A smooth curve through the points, level beyond them: growth, a pulse, decay.
    uplift_course: CurvePoints = CurvePoints(vec![[0.0, 1.0], [1.0, 1.0]]), One, ..;
    /// Rate at which the cells at `base` sides sink: the fall of the sea or of the valley that everything drains to.
    base_level_fall: f64 = 0.0, MetresPerYear, -1.0..=1.0, soft 0..=0.005;
    /// Slope at which creeping ground no longer holds, in metres per metre; 0 is without, which is linear creep.
    ///
    /// Takes time steps in which the uplift is below a tenth of a cell; with longer ones the steepest slopes waver.
    critical_slope: f64 = 0.0, One, 0.0..=10.0, soft 0.0..=1.5;
    /// How much the erodibility differs from cell to cell: the standard deviation of its natural logarithm.
    ///
    /// Rock is never the same everywhere, and perfectly even land keeps rivers that follow rows and columns.
    variation: f64 = 0.3, One, 0.0..=2.0, soft 0..=1;
    /// How the receiver of a cell is chosen.
    receivers: Receivers = Receivers::RhoInfinity, One, ..;
    /// Time step; 0 is a hundredth of the duration.
    ///
    /// Any step is stable. Longer ones give rivers less chances to find their way and smear waves of erosion. At most
    /// 10000 steps are made, longer ones than asked for if need be.
    time_step: f64 = 0.0, Years, 0.0..=1e9, soft 0..=1e5, when method = "implicit";
    /// How the law is solved.
    ///
    /// At once needs n = 1, no deposition, an even uplift course and no sea.
    method: Method = Method::Implicit, One, ..;
    /// On which cells the time passes.
    ///
    /// Coarse to fine is several times as fast over long times, and not quite the same land.
    schedule: Schedule = Schedule::Full, One, .., when method = "implicit";
    /// Seed of the random receivers and of the variation.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// The land at the start.
    height: Height;
    /// Rate at which the land rises, or sinks where it is below 0.
    uplift: Scalar(MetresPerYear) = 0.0, -1.0..=1.0, soft 0.0..=0.005;
    /// The coefficient K of the law. Below 0 counts as 0: nothing erodes.
    erodibility: Scalar(Erodibility) = DEFAULT_ERODIBILITY, 0.0..=1e3, soft 0.0..=1e-4;
    /// In place of `erodibility`: how fast a river that drains 1 km² cuts down where its slope is 10 %.
    /// 0 leaves it to `erodibility`; in a map, nothing erodes where it is 0 or below.
    reference_rate: Scalar(MetresPerYear) = 0.0, 0.0..=1.0, soft 0.0..=0.01;
    /// Rain as a share of the mean: where it is 2, a cell counts as two in the drainage area. Below 0 counts as 0.
    rain: Scalar(One) = 1.0, 0.0..=1e6, soft 0.0..=4.0;
    /// The coefficient G of deposition: how readily the load of rivers settles. 0 carries all of it out of the world.
    deposition: Scalar(One) = 0.0, 0.0..=1e3, soft 0.0..=4.0;
    /// Steepest slope that stands; 90° is without limit.
    repose: Scalar(Degrees) = 35.0, 0.0..=90.0, soft 20.0..=60.0;
    /// The coefficient D of creep on hillslopes: 0.001 in dry to 0.1 in wet lands, 0 for none. Below 0 counts as 0.
    diffusivity: Scalar(SquareMetresPerYear) = 0.0, 0.0..=1e3, soft 0.0..=0.1;
}

outputs! {
    /// The land at the end.
    height: Height;
    /// Drainage area at the end, by steepest descent, weighted by the rain.
    area: Scalar(SquareMetres);
    /// Thickness of the rock that was eroded.
    erosion: Scalar(Metres);
    /// How fast the land was worn down during the last time step, below 0 where it was built up.
    /// It nears the uplift where both balance.
    erosion_rate: Scalar(MetresPerYear);
    /// Thickness of the sediment that lies on the rock at the end; 0 without `deposition`.
    sediment: Scalar(Metres);
    /// What rivers carried out of each cell during the last time step.
    sediment_flux: Scalar(CubicMetresPerYear);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "StreamPower",
    version: 2,
    migrations: &[Migration { from: 1, steps: &[Step::SeaLevel { name: "sea_level", none: -12000.0 }] }],
    category: "erosion",
    summary: "Rivers that cut into rising land until erosion balances uplift.",
    doc: "The height h of every cell that drains follows\n\n    ∂h/∂t = U − K Aᵐ Sⁿ\n\n\
          with U the `uplift`, K the `erodibility`, A the drainage area in m² and S the slope to the cell's receiver, \
          a plain ratio. All that is eroded leaves the world (detachment-limited erosion). Where uplift and erosion \
          balance, S = (U / K)^(1/n) A^(−m/n): steep headwaters, gentle rivers, with m/n near 0.5 in real land. \
          Land rises until it does; a river of length L takes some L / (K Aᵐ) years to answer a change when n is 1, \
          a few million years in most mountains.\n\n\
          K has the unit m^(1−2m)/yr, so it must be chosen with m. For m = 0.5 and n = 1 hard rock has 1e-7 to 1e-6, \
          weak rock 1e-5 to 1e-4 per year. Wire a map to make bands of hard and soft rock. Easier to read is \
          `reference_rate`, the rate E at which a river that drains 1 km² cuts down where its slope is 10 %, from \
          0.01 mm/yr in hard to 10 mm/yr in weak rock; with it\n\n    K = E / ((10⁶ m²)ᵐ 0.1ⁿ)\n\n\
          whatever m and n are. The default K of 2e-6 is a rate of 0.2 mm/yr. A file gives one of the two.\n\n\
          `rain` weights the land: A is the discharge divided by the mean rain.\n\n\
          Each step solves the law implicitly, from the outlets upstream, so it is stable for any time step and never \
          cuts below the receiver. Water crosses depressions through their lowest pass and incises it; a lake's floor \
          does not erode until the pass is below it. Cells at sides that are `base` keep their height, or sink with \
          `base_level_fall`: the sea, or the valley that everything drains to, into which a plateau is cut from its \
          edge. Cells at `open` sides rise with the uplift, and where no neighbour is lower \
          water leaves there without cutting. What lies below the world's `sea_level` does not erode, and rivers end at \
          its shore.\n\n\
          Above 0, `deposition` makes rivers carry what they erode, and drop it where they are too gentle for it:\n\n    ∂h/∂t = U − K Aᵐ S + G Q / A\n\n\
          with Q the flux of sediment in m³/yr and G the `deposition`, 0.1 to 2 in most rivers, and Sⁿ for S where n is not 1. It is the \
          shared stream-power law with the transport coefficient K / G: a large G with an equally larger K makes rivers \
          that carry as much as they can everywhere. Slopes that balance uplift are (1 + G)^(1/n) times as steep, and alluvial \
          plains and fans form where land sinks or mountains end. Lakes and the sea fill from their \
          shores up to the water's surface, and pass on what they cannot hold. What slides joins the rivers at the next step. The mass of the sediment is kept to \
          rounding errors: what is eroded lies somewhere or has left at an outlet.\n\n\
          Where the drainage area is below `critical_area`, erosion is that of this area: these are hillslopes, which \
          the law is not about. Without it relief grows without limit as cells shrink. It must be larger than a cell; \
          where it is not, hillslopes are not resolved and the land depends on the cell size. `repose` is the steepest \
          slope: what is steeper slides and is gone by the end of the step; 90° lets everything stand.\n\n\
          With a `diffusivity` above 0 soil creeps on all land that is no river, as in `Creep`: crests are round, and what is rough fades,\n\n    \
          ∂h/∂t = U − K Aᵐ Sⁿ + ∇·(D ∇h)\n\n\
          with D the `diffusivity`, divided by 1 − (|∇h| / S)² where a `critical_slope` S is given. 0.01 m²/yr suits gentle, \
          soil-mantled land; valleys narrower than some D / (K Aᵐ), 35 m with it, do not form. Rivers, where the drainage area is `critical_area` or more, \
          take what creeps into them and do not rise: it leaves the world, or joins their load where there is \
          `deposition`. Where `critical_area` is 0 everything creeps. Water gathers less in smooth hollows the smaller the \
          cells are: gentle land that creep shapes stands some 10 % higher when cells are halved, which is why creep is off \
          unless asked for.\n\n\
          `variation` makes \
          each cell's erodibility differ a little, as rock does. With `critical_area: 0`, `variation: 0`, `repose: 90` \
          and `receivers: d8` what remains is the law itself.\n\n\
          `uplift_course` makes the uplift grow, pulse or fade: it multiplies it by a curve over the run. Every step \
          takes the curve's exact mean over its time.\n\n\
          `method: analytical` gives the land at the age `duration` at once, as a preview whose age can be drawn like a \
          slider. For n = 1 a wave of erosion travels upstream at K Aᵐ, so that on a given network every height is known: \
          τ years up from an outlet it is U τ above it, once τ have passed; before, it is the old land lifted. The \
          network itself is found in a few rounds, most of them on cells up to 8 times as large. It needs n = 1, no \
          `deposition`, an even `uplift_course` and no sea, leaves out creep, and does not use `time_step` and `schedule`; \
          `erosion_rate` and `sediment_flux` are those of the law, without slides. Where the \
          duration is a few times that in which the land answers a change, mean height and relief come out within some \
          5 % of those of 200 steps, in a fifteenth of the time for 512 × 512 cells; while waves are still on their way, \
          up to 10 % off, because rivers that have moved are not remembered.\n\n\
          `schedule: coarse_to_fine` passes most of a long time on cells four times and twice as large, and leaves the \
          cells of the world 0.3 of the time in which the land answers a change, 8 steps at least. What happens on large \
          cells is added to the land as a smooth change, so that detail of the start stays. It is some 5 times as fast where \
          the duration is a few such times. Without `variation`, mean height, local relief and slope come out within 1.5 % of the full \
          run; with it, mean and local relief are higher, by 5 % at the default and more where hillslopes are barely \
          resolved, because rivers have had less time to find the weak cells. Worlds of less than 128 cells along a side \
          pass all time on their own cells. With `deposition` the mass of the sediment is kept only from there on.\n\n\
          Rivers follow what they find. Start from land with some roughness (any noise of a few metres) unless straight \
          parallel valleys are wanted. Outlines of the network change with the cell size and the seed; the \
          mean height changes by some 2 % when cells are halved, as long as they are well below the critical area.",
    sources: &[
        "A. D. Howard (1994), A detachment-limited model of drainage basin evolution, Water Resources Research 30, \
         2261-2285",
        "K. X. Whipple and G. E. Tucker (1999), Dynamics of the stream-power river incision model, Journal of \
         Geophysical Research 104, 17661-17674",
        "J. Braun and S. D. Willett (2013), A very efficient O(n), implicit and parallel method to solve the stream \
         power equation governing fluvial incision and landscape evolution, Geomorphology 180-181, 170-179",
        "S. Hergarten (2020), Transport-limited fluvial erosion - simple formulation and efficient numerical treatment, \
         Earth Surface Dynamics 8, 841-854",
        "X. P. Yuan, J. Braun, L. Guerit, D. Rouby and G. Cordonnier (2019), A new efficient method to solve the stream \
         power law model taking into account sediment deposition, Journal of Geophysical Research: Earth Surface 124, \
         1346-1365",
        "P. Davy and D. Lague (2009), Fluvial erosion/transport equation of landscape evolution models revisited, \
         Journal of Geophysical Research 114, F03007",
        "P. Steer (2021), Short communication: Analytical models for 2D landscape evolution, Earth Surface Dynamics 9, \
         1239-1250",
        "P. Tzathas, B. Gailleton, P. Steer and G. Cordonnier (2024), Physically-based analytical erosion for fast \
         terrain generation, Computer Graphics Forum 43",
        "G. Cordonnier, B. Bovy and J. Braun (2019), A versatile, linear complexity algorithm for flow routing in \
         topographies with depressions, Earth Surface Dynamics 7, 549-562",
        "W. E. H. Culling (1960), Analytical theory of erosion, Journal of Geology 68, 336-344",
        "J. J. Roering, J. W. Kirchner and W. E. Dietrich (1999), Evidence for nonlinear, diffusive sediment transport on \
         hillslopes and implications for landscape morphology, Water Resources Research 35, 853-870",
        "E. Rouy and A. Tourin (1992), A viscosity solutions approach to shape-from-shading, SIAM Journal on Numerical \
         Analysis 29, 867-884",
        "D. G. Tarboton (1997), A new method for the determination of flow directions and upslope areas in grid \
         digital elevation models, Water Resources Research 33, 309-319",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    reads_sea: true,
    scratch: Scratch::Bytes(memory::scratch),
    cpu: run,
    resolution: Resolution::Cells(
        "the drainage network that forms depends on the cells; the mean height hardly does, as long as cells are well \
         below the critical area",
    ),
    example: "height: \"base\", uplift: 0.001, erodibility: 2e-6, duration: 2e6, m: 0.5, n: 1.2",
    ..Node::DEFAULT
};

/// The most steps of a run.
const MAX_STEPS: f64 = 10_000.0;
/// A shorter step counts as this long where its rates are told, so that they are finite.
const SHORTEST_YR: f64 = 1e-30;

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let start = Inputs::read(job)?.height;
    warn_of_unresolved_hillslopes(job, params.critical_area);
    let wants = Wants::of(job);
    let mut land = Land::new(job, &params, start)?;
    let asked = Asked { lowered: wants.erosion_rate, flux: wants.sediment_flux };
    let (step_yr, work) = match params.method {
        Method::Implicit => implicit(job, &params, &mut land, asked)?,
        Method::Analytical => (1.0, analytical::grow(job, &params, &mut land, asked)?),
    };
    if wants.area {
        land.route(job, None)?;
    }

    let cell_m2 = job.cell_m() * job.cell_m();
    let cells = || (0..land.heights.len()).into_par_iter();
    let field = |samples| Field::new(job.window(), samples);
    let nothing = || Field::constant(job.window(), 0.0);
    // The heights of many steps add up to rounding errors of the order of 1e-12 m where nothing was eroded.
    let eroded = |cell: usize| {
        let risen_m = land.tectonics.risen_m(cell, land.is_base(cell));
        (f64::from(start.samples()[cell]) + risen_m - land.heights[cell]).max(0.0) as f32
    };
    let per_yr = |metres: f64| metres / step_yr.max(SHORTEST_YR);
    let rate = |lowered: Vec<f64>| field(lowered.par_iter().map(|&lowered_m| per_yr(lowered_m) as f32).collect());
    let flux = |carried: Vec<f64>| {
        field(carried.par_iter().map(|&carried_m| (per_yr(carried_m).max(0.0) * cell_m2) as f32).collect())
    };
    Ok(Given {
        height: wants.height.then(|| field(cells().map(|cell| land.heights[cell] as f32).collect())),
        area: wants.area.then(|| field(cells().map(|cell| land.area.m2(cell) as f32).collect())),
        erosion: wants.erosion.then(|| field(cells().map(eroded).collect())),
        erosion_rate: wants.erosion_rate.then(|| work.lowered.map_or_else(nothing, rate)),
        sediment: wants.sediment.then(|| land.sediment_m().map_or_else(nothing, |metres| field(metres.to_vec()))),
        sediment_flux: wants.sediment_flux.then(|| work.flux.map_or_else(nothing, flux)),
    }
    .into())
}

/// Makes the steps of a run. Gives how long they are and what the last one did, as far as it is asked.
fn implicit(job: &Job<'_>, params: &Params, land: &mut Land<'_>, asked: Asked) -> Result<(f64, Work), NodeError> {
    let asked_yr = if params.time_step > 0.0 { params.time_step } else { params.duration / 100.0 };
    let count = if params.duration > 0.0 { (params.duration / asked_yr).ceil().min(MAX_STEPS) as u32 } else { 0 };
    let step_yr = params.duration / f64::from(count.max(1));
    let first = match params.schedule {
        Schedule::Full => 0,
        Schedule::CoarseToFine => schedule::begin(job, params, Steps { count, step_yr }, land)?,
    };
    let mut work = Work::default();
    for step in first..count {
        job.advance(step as f32 / (count + 1) as f32)?;
        let asked = if step + 1 == count { asked } else { Asked::default() };
        work = land.step(job, step_yr, step, asked)?;
        job.glimpse(|| {
            let height = land.heights.par_iter().map(|height| *height as f32).collect();
            Given { height: Some(Field::new(job.window(), height)), ..Given::default() }.into()
        });
    }
    job.advance(count as f32 / (count + 1) as f32)?;
    Ok((step_yr, work))
}

/// Tells where cells are larger than the drainage area of a river's head.
fn warn_of_unresolved_hillslopes(job: &Job<'_>, critical_area_m2: f64) {
    let cell_m = job.cell_m();
    if critical_area_m2 > 0.0 && cell_m * cell_m > critical_area_m2 {
        job.warn(format!(
            "cells of {cell_m} m are larger than the critical area of {critical_area_m2} m²: hillslopes are not \
             resolved, and relief depends on the cells; use smaller cells or a larger `critical_area`"
        ));
    }
}
