//! River incision by the stream-power law, in balance with uplift.
//!
//! Howard (1994) for the law, Braun and Willett (2013) for the implicit solution along the drainage tree, receivers
//! first. What differs from the paper: depressions are routed through (Cordonnier, Bovy and Braun 2019), receivers may
//! be drawn at random between the two neighbours of the steepest facet, the drainage area has a lower limit, and slopes
//! an upper one that varies as rock does, headwaters are cut by debris flows and the floors of valleys by their river,
//! erodibility may vary at random and hillslopes have ribs, a margin beyond `inland` sides is computed and cut off, and
//! soil creeps between the rivers (Culling 1960). Heights are kept in double precision through the whole run, because
//! the uplift of one step can be too small for the single precision of a height.

mod analytical;
mod area;
mod bedrock;
#[cfg(test)]
mod bedrock_tests;
mod course;
mod deposition;
mod ground;
#[cfg(test)]
mod hillslope_tests;
mod incision;
mod inland;
mod land;
mod levels;
mod links;
#[cfg(test)]
mod look_tests;
mod memory;
mod rock;
mod slides;
mod steepest;
mod tectonics;
#[cfg(test)]
mod tests;
mod winding;

use std::sync::Arc;

use orograph_graph::{Column, Glimpses, Layer, Strata};

use self::{
    bedrock::Bedrock,
    inland::Inland,
    land::{Asked, Displacement, Footing, Land, Work},
    rock::DEFAULT_ERODIBILITY,
    tectonics::Tectonics,
};
use crate::{numerics::par, prelude::*};

choice! {
    /// How the receiver of a cell is chosen.
    pub enum Receivers {
        /// Drawn at random in each step from the two neighbours that bound the steepest facet, so that rivers run
        /// equally in every direction.
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
        /// Without time steps, as a preview: the age of the terrain can be changed with a slider.
        Analytical = "analytical",
    }
}

choice! {
    /// On which cells the run takes place.
    pub enum Schedule {
        /// Mostly on levels with larger cells, which do not depend on the number of cells of the world.
        CoarseToFine = "coarse_to_fine",
        /// All of it on the cells of the world.
        Full = "full",
    }
}

params! {
    /// Simulated time.
    duration: f64 = 2e6, Years, 0.0..=1e9, soft 0..=10e6;
    /// Exponent m of the drainage area.
    m: f64 = 0.5, One, 0.0..=2.0, soft 0.3..=0.7;
    /// Exponent n of the slope.
    n: f64 = 1.0, One, 0.1..=5.0, soft 0.7..=2.0;
    /// Drainage area A₀ at which a river erodes as fast as debris flows do in the headwaters, where hardly any water runs.
    ///
    /// Hillslopes that balance an uplift U are as steep as S₀ = (U / (K A₀ᵐ))^(1/n). With 0, only rivers cut
    /// headwaters.
    headwater_area: f64 = 5e5, SquareMetres, 0.0..=1e12, soft 0..=5e6;
    /// How much `headwater_area` varies from place to place: the standard deviation of its natural logarithm.
    ///
    /// Long smooth slopes beside slopes with many gullies, in waves of some 20 √A₀, as in real land.
    headwater_variation: f64 = 0.8, One, 0.0..=3.0, soft 0..=2, given headwater_area;
    /// The least drainage area that counts: cells that drain less erode as if they drained this much; 0 for none.
    ///
    /// With a `headwater_area` of 0, it sets where rivers begin. Cells that drain more carry away the soil that creeps
    /// into them.
    critical_area: f64 = 0.0, SquareMetres, 0.0..=1e12, soft 0..=1e6;
    /// Width of the floor of a valley that drains 1 km², where its river is no steeper than 10 %; 0 for no floors.
    valley_width: f64 = 25.0, Metres, 0.0..=1e5, soft 0..=100;
    /// How much the floor widens and narrows along a valley: the standard deviation of the logarithm of its width.
    valley_variation: f64 = 0.5, One, 0.0..=2.0, soft 0..=1, given headwater_area, given valley_width;
    /// How gradually floors of valleys rise to the slopes: 0 for floors that are flat up to a sharp edge.
    valley_rounding: f64 = 1.0, One, 0.0..=3.0, soft 0..=2, given valley_width;
    /// How rough hillslopes are: the standard deviation of the slope of knolls and hollows, as a fraction of the mean slope.
    ///
    /// It applies to each octave of wavelengths, from half the length √A₀ of the hillslopes down to a few cells.
    roughness: f64 = 0.2, One, 0.0..=1.0, soft 0..=0.5, given headwater_area;
    /// How much `roughness` varies from place to place: the standard deviation of its natural logarithm.
    ///
    /// Smooth slopes beside rough ones, in waves of some 12 √A₀.
    roughness_variation: f64 = 0.0, One, 0.0..=2.0, soft 0..=1, given headwater_area, given roughness;
    /// How far knolls and hollows are drawn out into ribs and chutes, in wavelengths, both up and down the slope.
    ribs: f64 = 0.7, One, 0.0..=4.0, soft 0..=2, given headwater_area, given roughness;
    /// How deep gullies are: the fraction of `repose` by which dry spurs are steeper, and saturated hollows less steep.
    ///
    /// Water gathers in hollows, where ground stands less steep, so that they drain more and deepen. Half of the effect
    /// is reached where a fiftieth of `headwater_area` drains.
    gullies: f64 = 0.3, One, 0.0..=0.9, soft 0..=0.6, given headwater_area;
    /// How irregular ridges and valleys are in plan: how much they turn, as the standard deviation of the tangent.
    ///
    /// It applies to each octave of wavelengths, from 4 √A₀ down to two cells.
    irregularity: f64 = 0.15, One, 0.0..=0.5, soft 0..=0.3, given headwater_area;
    /// Creep that rounds features as small as a cell, relative to what headwaters erode in the same time.
    rounding: f64 = 0.1, One, 0.0..=100.0, soft 0..=0.5;
    /// How much rivers wind: how much the erodibility varies from cell to cell along them.
    ///
    /// It is the standard deviation of its natural logarithm. With 0, rivers run straight for long stretches.
    winding: f64 = 0.5, One, 0.0..=2.0, soft 0..=1.5, when method = "implicit";
    /// Factor on the uplift over the run: x is the time, from 0 at the start to 1 at the end.
    ///
    /// A smooth curve through the points, constant beyond them: growth, a pulse, decay.
    uplift_course: CurvePoints = CurvePoints(vec![[0.0, 1.0], [1.0, 1.0]]), One, ..;
    /// Rate at which the cells at `base` sides sink: the fall of the sea or of the valley that everything drains to.
    base_level_fall: f64 = 0.0, MetresPerYear, -1.0..=1.0, soft 0..=0.005;
    /// Slope at which creeping soil fails, in metres per metre; 0 for linear creep.
    ///
    /// Needs time steps in which the uplift is less than a twentieth of a cell times this slope; with longer ones the
    /// steepest slopes oscillate.
    critical_slope: f64 = 0.0, One, 0.0..=10.0, soft 0.0..=1.5;
    /// How much the erodibility varies from place to place: the standard deviation of its natural logarithm.
    ///
    /// Real rock always varies; on perfectly uniform terrain, rivers keep following rows and columns.
    variation: f64 = 0.5, One, 0.0..=2.0, soft 0..=1;
    /// Size of the largest bodies of harder or softer rock; smaller ones lie within them.
    /// 0 draws a factor on the erodibility for each cell and leaves `repose` the same everywhere.
    variation_size: f64 = 6e3, Metres, 0.0..=1e7, soft 0..=50e3;
    /// How much `repose` varies from place to place: its standard deviation. Harder rock holds steeper slopes.
    repose_variation: f64 = 7.0, Degrees, 0.0..=45.0, soft 0..=15;
    /// How the receiver of a cell is chosen.
    receivers: Receivers = Receivers::RhoInfinity, One, ..;
    /// Time step of the coarsest level, and the longest of the others; with 0, a hundredth of the duration, and no limit.
    ///
    /// Any step is stable. Longer ones give rivers fewer chances to find their way, and smear waves of erosion. A run
    /// has at most 10000 steps; if it would need more, they are longer than `time_step`.
    time_step: f64 = 0.0, Years, 0.0..=1e9, soft 0..=1e5, when method = "implicit";
    /// How the law is solved.
    ///
    /// `analytical` needs n = 1, no deposition, a constant uplift course and no sea.
    method: Method = Method::Implicit, One, ..;
    /// On which cells the run takes place.
    ///
    /// `coarse_to_fine` gives the same terrain at any number of cells, and is several times as fast.
    schedule: Schedule = Schedule::CoarseToFine, One, ..;
    /// Random seed of the receivers and of the variation.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Initial terrain.
    height: Height;
    /// Rate at which the terrain rises; it sinks where the rate is negative. At 0, rivers wear the terrain down.
    uplift: Scalar(MetresPerYear) = 1e-3, -1.0..=1.0, soft 0.0..=0.005;
    /// Coefficient K of the law. Negative values count as 0: nothing erodes.
    erodibility: Scalar(Erodibility) = DEFAULT_ERODIBILITY, 0.0..=1e3, soft 0.0..=1e-4;
    /// Instead of `erodibility`: the rate at which a river that drains 1 km² incises where its slope is 10 %.
    /// With 0, `erodibility` is used; in a map, nothing erodes where the rate is 0 or negative.
    reference_rate: Scalar(MetresPerYear) = 0.0, 0.0..=1.0, soft 0.0..=0.01;
    /// Rain relative to its mean: where it is 2, a cell counts as two in the drainage area. Negative values count as 0.
    rain: Scalar(One) = 1.0, 0.0..=1e6, soft 0.0..=4.0;
    /// Coefficient G of deposition: how readily sediment settles. With 0, rivers carry all of it out of the world.
    deposition: Scalar(One) = 0.0, 0.0..=1e3, soft 0.0..=4.0;
    /// Steepest stable slope; 90° removes the limit. With `strata`, the layers have their own.
    repose: Scalar(Degrees) = 38.0, 0.0..=90.0, soft 20.0..=60.0;
    /// Diffusion coefficient D of soil creep: 0.001 in dry to 0.1 in wet climates, 0 for none.
    /// Negative values count as 0.
    diffusivity: Scalar(SquareMetresPerYear) = 0.0, 0.0..=1e3, soft 0.0..=0.1;
    /// Rock at depth, from `Stratify`: rivers cut hard layers more slowly, and each layer has its own steepest slope.
    strata: Option<Strata>;
}

outputs! {
    /// Terrain at the end.
    height: Height;
    /// Drainage area at the end, along the steepest descent, weighted by `rain`.
    area: Scalar(SquareMetres);
    /// Thickness of eroded rock, including where sediment now covers it.
    erosion: Scalar(Metres);
    /// Rate of erosion during the last time step; negative where terrain was built up.
    /// At steady state it equals the uplift with `schedule: full`. On levels the last one has not caught up: with the
    /// defaults it gives 0.84 to 0.87 of the uplift.
    erosion_rate: Scalar(MetresPerYear);
    /// Thickness of the sediment on the rock at the end; 0 without `deposition`.
    sediment: Scalar(Metres);
    /// Sediment that rivers carried out of each cell during the last time step.
    sediment_flux: Scalar(CubicMetresPerYear);
    /// The rock at depth at the end: the layers of `strata`, raised by the uplift. Without that input, it is a single layer.
    strata: Strata;
    /// Volumes of rock that rose, left, and remain, with the margin of `inland` sides, and the error of the balance.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "StreamPower",
    version: 20,
    migrations: &[
        Migration { from: 1, steps: &[Step::SeaLevel { name: "sea_level", none: -12000.0 }] },
        Migration {
            from: 2,
            steps: &[
                Step::Keep { name: "headwater_area", value: "0" },
                Step::Keep { name: "critical_area", value: "2e4" },
                Step::Keep { name: "valley_width", value: "0" },
                Step::Keep { name: "rounding", value: "0" },
                Step::Keep { name: "variation", value: "0.3" },
                Step::Keep { name: "variation_size", value: "0" },
                Step::Keep { name: "repose_variation", value: "0" },
                Step::Keep { name: "repose", value: "35" },
            ],
        },
        Migration { from: 3, steps: &[Step::Keep { name: "schedule", value: "full" }] },
        // with a larger displacement from level to level, rivers and ridges are no longer straight along rows and diagonals
        Migration { from: 4, steps: &[Step::Keep { name: "variation_size", value: "8e3" }] },
        // slopes have a foot beside rivers, and rough ground
        Migration {
            from: 5,
            steps: &[Step::Keep { name: "roughness", value: "0" }, Step::Keep { name: "rounding", value: "0.05" }],
        },
        // `method: analytical` is on levels
        Migration { from: 6, steps: &[] },
        Migration { from: 7, steps: &[Step::Keep { name: "winding", value: "0" }] },
        Migration { from: 8, steps: &[Step::Keep { name: "headwater_variation", value: "0" }] },
        // slopes have ribs, and keep their grain
        Migration {
            from: 9,
            steps: &[Step::Keep { name: "ribs", value: "0" }, Step::Keep { name: "rounding", value: "0.1" }],
        },
        // results on the cells of the coarsest level follow the inputs on those of the next
        Migration { from: 10, steps: &[] },
        // larger bodies of rock, rounder crests, and hillslopes that are rough everywhere
        Migration {
            from: 11,
            steps: &[
                Step::Keep { name: "headwater_variation", value: "1.5" },
                Step::Keep { name: "roughness", value: "0.22" },
                Step::Keep { name: "rounding", value: "0.05" },
                Step::Keep { name: "variation_size", value: "3e3" },
            ],
        },
        // floors of varying width
        Migration { from: 12, steps: &[Step::Keep { name: "valley_variation", value: "0" }] },
        // short runs take more steps, `method: analytical` agrees between cells, margins are equally wide on all cells
        Migration { from: 13, steps: &[] },
        // gullies in steep slopes
        Migration { from: 14, steps: &[Step::Keep { name: "gullies", value: "0" }] },
        // floors that rise to their sides, and gullies that agree better between cells
        Migration { from: 15, steps: &[Step::Keep { name: "valley_rounding", value: "0" }] },
        // ridges and valleys that are irregular in plan
        Migration { from: 16, steps: &[Step::Keep { name: "irregularity", value: "0" }] },
        // smoother and rounder hillslopes with more irregular crests
        Migration {
            from: 17,
            steps: &[
                Step::Keep { name: "roughness", value: "0.25" },
                Step::Keep { name: "irregularity", value: "0.12" },
                Step::Keep { name: "rounding", value: "0.08" },
            ],
        },
        // without a wire to `uplift`, ground rises; before, rivers wore all of it down
        Migration { from: 18, steps: &[Step::Keep { name: "uplift", value: "0" }] },
        // rivers that drain 1 km² as steep as real ones; where sediment settles on layers, the last bits differ
        Migration { from: 19, steps: &[Step::Keep { name: "uplift", value: "5e-4" }] },
    ],
    category: "erosion",
    summary: "Rivers that cut into rising terrain until erosion balances uplift.",
    doc: include_str!("page.md"),
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
        "J. D. Stock and W. E. Dietrich (2003), Valley incision by debris flows: evidence of a topographic signature, \
         Water Resources Research 39, 1089",
        "J. D. Stock and W. E. Dietrich (2006), Erosion of steepland valleys by debris flows, GSA Bulletin 118, 1125-1148",
        "G. Cordonnier, B. Bovy and J. Braun (2019), A versatile, linear complexity algorithm for flow routing in \
         topographies with depressions, Earth Surface Dynamics 7, 549-562",
        "W. E. H. Culling (1960), Analytical theory of erosion, Journal of Geology 68, 336-344",
        "J. J. Roering, J. W. Kirchner and W. E. Dietrich (1999), Evidence for nonlinear, diffusive sediment transport on \
         hillslopes and implications for landscape morphology, Water Resources Research 35, 853-870",
        "D. R. Montgomery and W. E. Dietrich (1994), A physically based model for the topographic control on shallow \
         landsliding, Water Resources Research 30, 1153-1171",
        "B. Cabral and L. C. Leedom (1993), Imaging vector fields using line integral convolution, SIGGRAPH '93, 263-270",
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
    levels: Some(levels::LEVELS),
    scratch: Scratch::Bytes(memory::scratch),
    refuses: Some(refuses),
    cpu: run,
    resolution: Resolution::Cells(
        "on levels, heights differ by a few percent of their standard deviation; with `schedule: full`, the drainage network \
         changes with the number of cells",
    ),
    example: "height: \"base\", uplift: 0.001, erodibility: 2e-6, duration: 2e6, m: 0.5, n: 1.2",
    ..Node::DEFAULT
};

/// The most steps of a run.
const MAX_STEPS: f64 = 10_000.0;
/// Runs shorter than this share of the rivers' response time get a warning.
const SHORT_RUN: f64 = 0.05;
/// Rates of a shorter step are computed for this length, so that they are finite.
const SHORTEST_YR: f64 = 1e-30;

/// Refuses two ways to say how easily the rock erodes, and what the analytical method does not know.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    let [rate, erodibility, deposition] = ["reference_rate", "erodibility", "deposition"].map(|name| stated.feed(name));
    // kernels read numbers in single precision
    let is_given = |feed: Feed, default: f64| matches!(feed, Feed::Number(number) if number as f32 != default as f32);
    if is_given(rate, 0.0) && is_given(erodibility, DEFAULT_ERODIBILITY) {
        return Err(rock::given_twice());
    }
    let params = Params::read(stated.params);
    if params.method == Method::Analytical {
        analytical::refuses(&params, is_given(deposition, 0.0), stated.feed("strata") != Feed::Nothing)?;
    }
    Ok(())
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    // a job that only averages a finer level has no inputs
    if let Ok(inputs) = Inputs::read(job) {
        warn_of_unused_repose(job, &inputs);
        warn_of_much_rain(job, &inputs);
    }
    if levels::has_levels(&params) {
        return levels::run(job, &params);
    }
    warn_of_unresolved_hillslopes(job, &params);
    let Some(inland) = Inland::around(job.window(), &params) else { return erode(job, &params) };
    let take = |outputs| {
        if let Some(glimpses) = job.glimpses {
            (glimpses.take)(inland.cut(outputs));
        }
    };
    let glimpses = job.glimpses.map(|glimpses| Glimpses { due: glimpses.due, take: &take });
    let outer = inland.job(job, glimpses);
    let outputs = erode(&outer, &params);
    Inland::forward_warnings(&outer, job);
    outputs.map(|outputs| inland.cut(outputs))
}

/// The whole run on the cells of the job.
fn erode(job: &Job<'_>, params: &Params) -> Result<Outputs, NodeError> {
    let (start, wants) = (Inputs::read(job)?.height, Wants::of(job));
    let mut land = Land::new(job, params, start, Footing::default())?;
    let asked = Asked { lowered: wants.erosion_rate, flux: wants.sediment_flux };
    let (step_yr, work) = match params.method {
        Method::Implicit => implicit(job, params, &mut land, asked)?,
        Method::Analytical => {
            land.make_ribs(job)?;
            analytical::check(job, params)?;
            analytical::warn_of_creep(job)?;
            analytical::grow(job, params, &mut land)?;
            analytical::wear(job, params, &mut land, asked)?
        }
    };
    results(job, params, land, start, step_yr, work)
}

/// The outputs of a land at the end; `work` is that of the last step, which took `step_yr`.
fn results(
    job: &Job<'_>,
    params: &Params,
    mut land: Land<'_>,
    start: &Field,
    step_yr: f64,
    mut work: Work,
) -> Result<Outputs, NodeError> {
    let wants = Wants::of(job);
    let displacement = land.displacement(job, params)?;
    if let Some(displacement) = &displacement {
        land.displace(displacement, &mut work);
    }
    let strata = wants.strata.then(|| strata(job, &land.tectonics, displacement.as_ref())).transpose()?;
    drop(displacement);
    if wants.area {
        land.route(job, None)?;
    }
    let cell_m2 = job.cell_m() * job.cell_m();
    let report = wants.report.then(|| land.report(cell_m2));
    let land = land.end();

    let cells = land.heights.len();
    let field = |samples| Field::new(job.window(), samples);
    let nothing = || Field::constant(job.window(), 0.0);
    // The heights of many steps add up to rounding errors of the order of 1e-12 m where nothing was eroded.
    let eroded = |cell: usize| {
        let risen_m = land.tectonics.risen_m(cell, land.is_base(cell));
        let buried_m = land.sediment_m.as_ref().map_or(0.0, |sediment| f64::from(sediment[cell]));
        (f64::from(start.samples()[cell]) + risen_m - land.heights[cell] + buried_m).max(0.0) as f32
    };
    let per_yr = |metres: f64| metres / step_yr.max(SHORTEST_YR);
    let rate = |lowered: Vec<f64>| field(par::map_of(&lowered, |&lowered_m| per_yr(lowered_m) as f32));
    let flux =
        |carried: Vec<f64>| field(par::map_of(&carried, |&carried_m| (per_yr(carried_m).max(0.0) * cell_m2) as f32));
    Ok(Given {
        height: wants.height.then(|| field(par::map_of(&land.heights, |&height| height as f32))),
        area: wants.area.then(|| field(par::map(cells, |cell| land.area.m2(cell) as f32))),
        erosion: wants.erosion.then(|| field(par::map(cells, eroded))),
        erosion_rate: wants.erosion_rate.then(|| work.lowered.map_or_else(nothing, rate)),
        sediment: wants.sediment.then(|| land.sediment_m.map_or_else(nothing, &field)),
        sediment_flux: wants.sediment_flux.then(|| work.flux.map_or_else(nothing, flux)),
        strata,
        report,
    }
    .into())
}

/// The rock at depth at the end.
fn strata(job: &Job<'_>, tectonics: &Tectonics<'_>, displacement: Option<&Displacement>) -> Result<Strata, NodeError> {
    let inputs = Inputs::read(job)?;
    let Some(strata) = inputs.strata else {
        let column = Column { layers: vec![Layer::USUAL], top_m: 0.0, repeats: false, cosine: 1.0 };
        return Ok(Strata::new(Arc::new(column), Field::constant(job.window(), 0.0)));
    };
    let moved = Bedrock::moved(strata, inputs.uplift, tectonics.risen_at_end_yr());
    Ok(match displacement {
        Some(displacement) => moved.on(Field::new(job.window(), displacement.smooth_single(moved.offset().samples()))),
        None => moved,
    })
}

/// Makes the steps of a run. Gives how long they are and what the last one did, as far as it is asked.
fn implicit(job: &Job<'_>, params: &Params, land: &mut Land<'_>, asked: Asked) -> Result<(f64, Work), NodeError> {
    let (count, step_yr) = count_steps(params);
    let mut work = Work::default();
    for step in 0..count {
        job.advance(step as f32 / (count + 1) as f32)?;
        if step == count / 2 {
            land.make_ribs(job)?;
        }
        let asked = if step + 1 == count { asked } else { Asked::default() };
        work = land.step(job, step_yr, step, asked)?;
        job.glimpse(|| glimpse(job, land));
    }
    job.advance(count as f32 / (count + 1) as f32)?;
    if count > 0 {
        warn_of_short_runs(job, params.duration, land.response_yr(job, step_yr)?);
    }
    Ok((step_yr, work))
}

/// How many steps a run has on a single grid, and how long each is in years.
fn count_steps(params: &Params) -> (u32, f64) {
    let is_set = params.time_step > 0.0 && params.method == Method::Implicit;
    let asked_yr = if is_set { params.time_step } else { params.duration / 100.0 };
    let count = if params.duration > 0.0 { (params.duration / asked_yr).ceil().min(MAX_STEPS) as u32 } else { 0 };
    (count, params.duration / f64::from(count.max(1)))
}

/// What is shown of a land on the way.
fn glimpse(job: &Job<'_>, land: &Land<'_>) -> Outputs {
    let height = par::map_of(&land.heights, |height| *height as f32);
    Given { height: Some(Field::new(job.window(), height)), ..Given::default() }.into()
}

/// Two significant digits, for messages.
fn rounded(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// Warns where rivers have hardly begun to respond.
fn warn_of_short_runs(job: &Job<'_>, duration_yr: f64, response_yr: f64) {
    if duration_yr < SHORT_RUN * response_yr && response_yr.is_finite() {
        let [response, duration] = [response_yr, duration_yr].map(|years| Unit::Years.display(rounded(years)));
        job.warn(format!(
            "rivers here take {response} to respond, but the run lasts {duration}, so that most of the terrain is \
             unchanged; increase `duration` or `erodibility`"
        ));
    }
}

/// Rain above this factor is taken for millimetres a year.
const MOST_RAIN: f32 = 50.0;

/// Tells that rain is a factor, to those who give it in millimetres.
fn warn_of_much_rain(job: &Job<'_>, inputs: &Inputs<'_>) {
    if let Some(rain) = inputs.rain.constant().filter(|rain| *rain > MOST_RAIN) {
        job.warn(format!("`rain` is a factor, with 1 for ordinary rain, not millimetres a year; {rain} makes floods"));
    }
}

/// Tells that a map of `repose` has no effect where the layers have their own steepest slopes.
fn warn_of_unused_repose(job: &Job<'_>, inputs: &Inputs<'_>) {
    if inputs.strata.is_some() && inputs.repose.constant().is_none() {
        job.warn(
            "`repose` is wired, but the layers of `strata` have their own steepest slopes; disconnect one of them",
        );
    }
}

/// Warns where cells are larger than the drainage area of a river's head.
fn warn_of_unresolved_hillslopes(job: &Job<'_>, params: &Params) {
    let critical_area_m2 = if params.headwater_area > 0.0 { params.headwater_area } else { params.critical_area };
    let cell_m = job.cell_m();
    if critical_area_m2 > 0.0 && cell_m * cell_m > critical_area_m2 {
        let [cell, area] = [cell_m * cell_m, critical_area_m2].map(|m2| Unit::SquareMetres.display(rounded(m2)));
        job.warn(format!(
            "a cell of {cell} is larger than the drainage area of {area} at which rivers begin: hillslopes are not \
             resolved, and relief depends on the cells; use smaller cells or a larger `headwater_area`"
        ));
    }
}
