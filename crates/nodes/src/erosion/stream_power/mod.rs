//! River incision by the stream-power law, in balance with uplift.
//!
//! Howard (1994) for the law, Braun and Willett (2013) for the implicit solution along the drainage tree, receivers
//! first. What differs from the paper: depressions are routed through (Cordonnier, Bovy and Braun 2019), receivers may
//! be drawn at random between the two neighbours of the steepest facet, the drainage area has a lower limit, and slopes
//! an upper one that varies as rock does, headwaters are cut by debris flows and the floors of valleys by their river,
//! erodibility may vary at random, a margin beyond `inland` sides is computed and cut off, and soil creeps between the rivers (Culling 1960). Heights are kept in
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
mod inland;
mod land;
mod levels;
mod links;
#[cfg(test)]
mod look_tests;
mod memory;
mod rock;
mod slides;
mod tectonics;
#[cfg(test)]
mod tests;

use orograph_graph::Glimpses;
use rayon::prelude::*;

use self::{
    inland::Inland,
    land::{Asked, Footing, Land, Work},
    rock::DEFAULT_ERODIBILITY,
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
        /// Long times mostly on levels of larger cells, which are the same whatever cells are asked for.
        CoarseToFine = "coarse_to_fine",
        /// All of it on the cells of the world.
        Full = "full",
    }
}

params! {
    /// Time that passes.
    duration: f64 = 2e6, Years, 0.0..=1e9, soft 0..=10e6;
    /// Exponent m of the drainage area.
    m: f64 = 0.5, One, 0.0..=2.0, soft 0.3..=0.7;
    /// Exponent n of the slope.
    n: f64 = 1.0, One, 0.1..=5.0, soft 0.7..=2.0;
    /// Drainage area A₀ that the debris flows of headwaters are worth: what cuts where hardly any water runs.
    ///
    /// Hillslopes that balance an uplift U are as steep as S₀ = (U / (K A₀ᵐ))^(1/n). 0 leaves headwaters to rivers alone.
    headwater_area: f64 = 5e5, SquareMetres, 0.0..=1e12, soft 0..=5e6;
    /// Drainage area at which rivers begin, where `headwater_area` is 0; 0 begins them at every cell.
    ///
    /// Smaller areas erode as if they were this large.
    critical_area: f64 = 0.0, SquareMetres, 0.0..=1e12, soft 0..=1e6;
    /// Width of the floor of a valley that drains 1 km², where its river is no steeper than 10 %; 0 is without floors.
    valley_width: f64 = 25.0, Metres, 0.0..=1e5, soft 0..=100;
    /// Creep that rounds what is as small as a cell, as a share of what the headwaters cut in the same time.
    rounding: f64 = 0.05, One, 0.0..=100.0, soft 0..=0.5;
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
    /// How much the erodibility differs from place to place: the standard deviation of its natural logarithm.
    ///
    /// Rock is never the same everywhere, and perfectly even land keeps rivers that follow rows and columns.
    variation: f64 = 0.5, One, 0.0..=2.0, soft 0..=1;
    /// Size of the largest bodies of rock that differ; smaller ones lie within. 0 draws a factor for each cell.
    variation_size: f64 = 8e3, Metres, 0.0..=1e7, soft 0..=50e3;
    /// How much `repose` differs from place to place: its standard deviation. Hard rock stands steeper.
    repose_variation: f64 = 7.0, Degrees, 0.0..=45.0, soft 0..=15;
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
    /// Coarse to fine makes one terrain on any cells, and is several times as fast.
    schedule: Schedule = Schedule::CoarseToFine, One, .., when method = "implicit";
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
    /// Instead of `erodibility`: how fast a river that drains 1 km² cuts down where its slope is 10 %.
    /// 0 leaves it to `erodibility`; in a map, nothing erodes where it is 0 or below.
    reference_rate: Scalar(MetresPerYear) = 0.0, 0.0..=1.0, soft 0.0..=0.01;
    /// Rain as a share of the mean: where it is 2, a cell counts as two in the drainage area. Below 0 counts as 0.
    rain: Scalar(One) = 1.0, 0.0..=1e6, soft 0.0..=4.0;
    /// The coefficient G of deposition: how readily the load of rivers settles. 0 carries all of it out of the world.
    deposition: Scalar(One) = 0.0, 0.0..=1e3, soft 0.0..=4.0;
    /// Steepest slope that stands; 90° is without limit.
    repose: Scalar(Degrees) = 38.0, 0.0..=90.0, soft 20.0..=60.0;
    /// The coefficient D of creep on hillslopes: 0.001 in dry to 0.1 in wet lands, 0 for none. Below 0 counts as 0.
    diffusivity: Scalar(SquareMetresPerYear) = 0.0, 0.0..=1e3, soft 0.0..=0.1;
}

outputs! {
    /// The land at the end.
    height: Height;
    /// Drainage area at the end, by steepest descent, weighted by the rain.
    area: Scalar(SquareMetres);
    /// Thickness of the rock that was eroded, also where sediment lies on it now.
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
    version: 4,
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
    ],
    category: "erosion",
    summary: "Rivers that cut into rising land until erosion balances uplift.",
    doc: "The height h of every cell that drains follows\n\n    ∂h/∂t = U − K (Aᵐ + A₀ᵐ) Sⁿ\n\n\
          with U the `uplift`, K the `erodibility`, A the drainage area in m², A₀ the `headwater_area` and S the slope to the cell's receiver, \
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
          plains and fans form where land sinks or mountains end. What rivers bring into standing water spreads over some \
          500 m, so that deltas grow from the mouths up to the water's surface; full lakes pass on the rest. What slides joins the rivers at the next step. The mass of the sediment is kept to \
          rounding errors: what is eroded lies somewhere or has left at an outlet.\n\n\
          A₀ᵐ stands for the debris flows that cut headwaters, where hardly any water runs. Where land balances its uplift, hillslopes \
          are as steep as\n\n    S₀ = (U / (K A₀ᵐ))^(1/n)\n\n\
          and ease into rivers where A is several times A₀, as in measured land, instead of lying at one angle down to a sudden \
          valley. S₀ of 0.8 makes alpine, 0.4 gentle mountains: U = 3 mm/yr, K = 4e-6, A₀ = 1 km² make 0.75. A small A₀ makes short \
          flanks, as in badlands (1e5 m²), a large one long flanks (1e6 m²). The area of headwaters, below a fifth of A₀, is the mean of the last steps, in each of which water takes one way \
          of several. Without A₀, `critical_area` says where rivers begin; smaller areas erode as it does.\n\n\
          `repose` is the steepest slope: what is steeper slides and is gone by the end of the step; 90° lets everything \
          stand. It varies by `repose_variation` in waves from `variation_size` down, as rock does, because one angle everywhere makes \
          planes.\n\n\
          A river wanders over the floor of its valley and cuts all of it. The floor is\n\n    w = `valley_width` (A / 1 km²)^0.4 min(1, 0.1 / S)\n\n\
          wide; the area of the river counts for all cells of a disc of that width in the law, less towards its rim. Floors narrower than a \
          cell are not made.\n\n\
          `rounding` lets all ground creep with D = `rounding` K A₀ᵐ d, with K the mean and d the side of a cell: what is as small as a \
          cell fades, at any cell size. 0.05 is hardly seen, 0.3 is soft.\n\n          With a `diffusivity` above 0 soil creeps on all land that is no river, as in `Creep`: crests are round, and what is rough fades,\n\n    \
          ∂h/∂t = U − K Aᵐ Sⁿ + ∇·(D ∇h)\n\n\
          with D the `diffusivity`, divided by 1 − (|∇h| / S)² where a `critical_slope` S is given. 0.01 m²/yr suits gentle, \
          soil-mantled land; valleys narrower than some D / (K Aᵐ), 35 m with it, do not form. Where `critical_area` is above 0, rivers, which drain more, \
          take what creeps into them and do not rise: it leaves the world, or joins their load where there is \
          `deposition`. Where `critical_area` is 0 everything creeps. Water gathers less in smooth hollows the smaller the \
          cells are: gentle land that creep shapes stands some 10 % higher when cells are halved, which is why creep is off \
          unless asked for.\n\n\
          `variation` makes the erodibility differ from place to place, as rock does: its logarithm is a sum of waves from \
          `variation_size` down, 2.5 times as long along a grain as across it, with a spectral slope of 2.5. Harder rock stands steeper. The \
          node `Rock` makes such maps with beds, folds and faults; wire them and set `variation` and `repose_variation` to 0. With \
          `variation_size: 0` each cell draws a factor.\n\n\
          With `headwater_area: 0`, `valley_width: 0`, `rounding: 0`, `variation: 0`, `repose_variation: 0`, `repose: 90` \
          and `receivers: d8` what remains is the stream-power law itself.\n\n\
          At `inland` sides of the world the land goes on: the node works on a margin of a tenth of the shorter side that is cut off. What is \
          wired is reflected there, and the height falls outwards by 2 %. Rivers leave the margin through the lowest cell of each \
          stretch of its rim, which keeps its height; the rest of the rim rises with the land. So no side shows.\n\n\
          Rivers need time: where the run lasts less than a twentieth of that in which they respond, the node says so.\n\n\
          `uplift_course` makes the uplift grow, pulse or fade: it multiplies it by a curve over the run. Every step \
          takes the curve's exact mean over its time.\n\n\
          `method: analytical` gives the land at the age `duration` at once, as a preview whose age can be drawn like a \
          slider. For n = 1 a wave of erosion travels upstream at K Aᵐ, so that on a given network every height is known: \
          τ years up from an outlet it is U τ above it, once τ have passed; before, it is the old land lifted. The \
          network itself is found in a few rounds, most of them on cells up to 8 times as large as those of the world, not on the levels below. It needs n = 1, no \
          `deposition`, an even `uplift_course` and no sea, leaves out creep, and does not use `time_step` and `schedule`; \
          `erosion_rate` and `sediment_flux` are those of the law, without slides. Where the \
          duration is a few times that in which the land answers a change, mean height and relief come out within some \
          5 % of those of 200 steps, in a fifteenth of the time for 512 × 512 cells; while waves are still on their way, \
          up to 10 % off, because rivers that have moved are not remembered.\n\n\
          The network that forms depends on the cells on which the time passes, so it passes on levels whose cells follow from the \
          world and the parameters, each half as large as those before, up to the cells of the world. The coarsest has 128 cells along the shorter side, or \
          256 where 128 would be longer than 0.4 √A₀; it passes the whole time, in a hundredth a step. \
          Each further level begins late with the land that the level below it had then, and ends with it: the second has 0.15 τ, with τ the \
          time in which the land answers a change, each one after that half as long as the one before, in 6 steps. A finer level so \
          keeps the rivers of the coarser ones and adds what its cells can resolve; a preview is the same terrain as the final build, and costs less. \
          Every level reads inputs that are made for its own cells, and its state is kept in the cache: twice as many cells pass one more \
          level. Land is \
          displaced by up to a third of a coarse cell on its way to the next level, which lets straight rivers wind, and what the law \
          has left of the detail of the start is added. On levels half a cell less than the drainage area \
          cuts, which makes relief depend less on the cells. Heights are those at the centres of cells. A world with \
          fewer cells than the coarsest level gets its means, and of `area` and `sediment_flux` the largest in each cell. Where a level would have \
          more than half of the duration it begins at the start: land that has hardly had time to change stays as it was. With `time_step`, no step is longer. With \
          `deposition`, the thickness of the sediment is kept from level to level, but the interpolated heights are not exactly those of the same mass. \
          `schedule: full` passes all time on the cells of the world, and makes another network on each number of cells.\n\n\
          Rivers follow what they find. Start from land with some roughness (any noise of a few metres) unless straight \
          parallel valleys are wanted.",
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
    cpu: run,
    resolution: Resolution::Cells(
        "on levels heights differ by some percent of their deviation; with `schedule: full` and at once, each number of \
         cells has its own drainage network",
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

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    if levels::has_levels(&params) {
        return levels::run(job, &params);
    }
    warn_of_unresolved_hillslopes(job, &params);
    let Some(inland) = Inland::around(job.window()) else { return erode(job, &params) };
    let take = |outputs| {
        if let Some(glimpses) = job.glimpses {
            (glimpses.take)(inland.cut(outputs));
        }
    };
    let glimpses = job.glimpses.map(|glimpses| Glimpses { due: glimpses.due, take: &take });
    let outer = inland.job(job, glimpses);
    let outputs = erode(&outer, &params);
    Inland::tell(&outer, job);
    outputs.map(|outputs| inland.cut(outputs))
}

/// The whole run on the cells of the job.
fn erode(job: &Job<'_>, params: &Params) -> Result<Outputs, NodeError> {
    let (start, wants) = (Inputs::read(job)?.height, Wants::of(job));
    let mut land = Land::new(job, params, start, Footing::default())?;
    let asked = Asked { lowered: wants.erosion_rate, flux: wants.sediment_flux };
    let (step_yr, work) = match params.method {
        Method::Implicit => implicit(job, params, &mut land, asked)?,
        Method::Analytical => (1.0, analytical::grow(job, params, &mut land, asked)?),
    };
    results(job, &mut land, start, step_yr, work)
}

/// The outputs of a land at the end; `work` is that of the last step, which took `step_yr`.
fn results(job: &Job<'_>, land: &mut Land<'_>, start: &Field, step_yr: f64, work: Work) -> Result<Outputs, NodeError> {
    let wants = Wants::of(job);
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
        let buried_m = land.sediment_m().map_or(0.0, |sediment| f64::from(sediment[cell]));
        (f64::from(start.samples()[cell]) + risen_m - land.heights[cell] + buried_m).max(0.0) as f32
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
    let (count, step_yr) = count_steps(params);
    let mut work = Work::default();
    for step in 0..count {
        job.advance(step as f32 / (count + 1) as f32)?;
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
    let asked_yr = if params.time_step > 0.0 { params.time_step } else { params.duration / 100.0 };
    let count = if params.duration > 0.0 { (params.duration / asked_yr).ceil().min(MAX_STEPS) as u32 } else { 0 };
    (count, params.duration / f64::from(count.max(1)))
}

/// What is shown of a land on the way.
fn glimpse(job: &Job<'_>, land: &Land<'_>) -> Outputs {
    let height = land.heights.par_iter().map(|height| *height as f32).collect();
    Given { height: Some(Field::new(job.window(), height)), ..Given::default() }.into()
}

/// Tells where rivers have hardly begun to answer.
fn warn_of_short_runs(job: &Job<'_>, duration_yr: f64, response_yr: f64) {
    if duration_yr < SHORT_RUN * response_yr && response_yr.is_finite() {
        let myr =
            |years: f64| format!("{:.*} Myr", if years < 1e5 { 3 } else { usize::from(years < 1e7) + 1 }, years / 1e6);
        job.warn(format!(
            "rivers here respond in {}; the run lasts {}, so that most of the land is as it was; a longer `duration` or \
             a larger `erodibility` lets them shape it",
            myr(response_yr),
            myr(duration_yr)
        ));
    }
}

/// Tells where cells are larger than the drainage area of a river's head.
fn warn_of_unresolved_hillslopes(job: &Job<'_>, params: &Params) {
    let critical_area_m2 = if params.headwater_area > 0.0 { params.headwater_area } else { params.critical_area };
    let cell_m = job.cell_m();
    if critical_area_m2 > 0.0 && cell_m * cell_m > critical_area_m2 {
        job.warn(format!(
            "cells of {cell_m} m are larger than the {critical_area_m2} m² at which rivers begin: hillslopes are not \
             resolved, and relief depends on the cells; use smaller cells or a larger `headwater_area`"
        ));
    }
}
