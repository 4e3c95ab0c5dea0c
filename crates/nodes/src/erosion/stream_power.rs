//! River incision by the stream-power law, in balance with uplift.
//!
//! Howard (1994) for the law, Braun and Willett (2013) for the implicit solution along the drainage tree, receivers
//! first. What differs from the paper: depressions are routed through (Cordonnier, Bovy and Braun 2019), receivers may
//! be drawn at random between the two neighbours of the steepest facet, the drainage area has a lower limit, and slopes
//! an upper one, and erodibility may vary at random. Heights are kept in double precision through the whole run, because the uplift of one step can be less
//! than a height in single precision can hold.

use rayon::prelude::*;

use super::{incision::Law, slides};
use crate::{
    hydrology::engine::{Depressions, Drainage, Grid, Outlet, code, receivers},
    math,
    prelude::*,
};

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
    time_step: f64 = 0.0, Years, 0.0..=1e9, soft 0..=1e5;
    /// Seed of the random receivers and of the variation.
    seed: Seed = Seed(0), Count, ..;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "StreamPower",
    category: "erosion",
    summary: "Rivers that cut into rising land until erosion balances uplift.",
    doc: "The height h of every cell that drains follows\n\n\
          > ∂h/∂t = U − K Aᵐ Sⁿ\n\n\
          with U the `uplift`, K the `erodibility`, A the drainage area in m² and S the slope to the cell's receiver, \
          a plain ratio. All that is eroded leaves the world (detachment-limited erosion). Where uplift and erosion \
          balance, S = (U / K)^(1/n) A^(−m/n): steep headwaters, gentle rivers, with m/n near 0.5 in real land. \
          Land rises until it does; a river of length L takes some L / (K Aᵐ) years to answer a change when n is 1, \
          a few million years in most mountains.\n\n\
          K has the unit m^(1−2m)/yr, so it must be chosen with m. For m = 0.5 and n = 1 hard rock has 1e-7 to 1e-6, \
          weak rock 1e-5 to 1e-4 per year. Wire a map to make bands of hard and soft rock.\n\n\
          Each step solves the law implicitly, from the outlets upstream, so it is stable for any time step and never \
          cuts below the receiver. Water crosses depressions through their lowest pass and incises it; a lake's floor \
          does not erode until the pass is below it. Cells at sides that are `base` keep their height: the sea, or the \
          valley that everything drains to. Cells at `open` sides rise with the uplift, and where no neighbour is lower \
          water leaves there without cutting.\n\n\
          Where the drainage area is below `critical_area`, erosion is that of this area: these are hillslopes, which \
          the law is not about. Without it relief grows without limit as cells shrink. It must be larger than a cell; \
          where it is not, hillslopes are not resolved and the land depends on the cell size. `repose` is the steepest \
          slope: what is steeper slides and is gone by the end of the step; 90° lets everything stand. `variation` makes \
          each cell's erodibility differ a little, as rock does. With `critical_area: 0`, `variation: 0`, `repose: 90` \
          and `receivers: d8` what remains is the law itself.\n\n\
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
        "G. Cordonnier, B. Bovy and J. Braun (2019), A versatile, linear complexity algorithm for flow routing in \
         topographies with depressions, Earth Surface Dynamics 7, 549-562",
        "E. Rouy and A. Tourin (1992), A viscosity solutions approach to shape-from-shading, SIAM Journal on Numerical \
         Analysis 29, 867-884",
        "D. G. Tarboton (1997), A new method for the determination of flow directions and upslope areas in grid \
         digital elevation models, Water Resources Research 33, 309-319",
    ],
    inputs: &[
        Input::needs("height", PortType::Height, "The land at the start."),
        Input::number(
            "uplift",
            Unit::MetresPerYear,
            0.0,
            [-1.0, 1.0],
            [0.0, 0.005],
            "Rate at which the land rises, or sinks where it is below 0.",
        ),
        Input::number(
            "erodibility",
            Unit::Erodibility,
            2e-6,
            [0.0, 1e3],
            [0.0, 1e-4],
            "The coefficient K of the law. Below 0 counts as 0: nothing erodes.",
        ),
        Input::number(
            "repose",
            Unit::Degrees,
            35.0,
            [0.0, 90.0],
            [20.0, 60.0],
            "Steepest slope that stands; 90° is without limit.",
        ),
    ],
    outputs: &[
        Output::gives("height", PortType::Height, "The land at the end."),
        Output::gives("area", PortType::Scalar(Unit::SquareMetres), "Drainage area at the end, by steepest descent."),
        Output::gives("erosion", PortType::Scalar(Unit::Metres), "Thickness of the rock that was eroded."),
    ],
    params: Params::specs,
    reach: Reach::World,
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

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let start = job.field("height")?;
    let mut land = Land::new(job, &params, start)?;
    let asked_yr = if params.time_step > 0.0 { params.time_step } else { params.duration / 100.0 };
    let steps = if params.duration > 0.0 { (params.duration / asked_yr).ceil().min(MAX_STEPS) as u32 } else { 0 };
    for step in 0..steps {
        job.advance(step as f32 / (steps + 1) as f32)?;
        land.step(job, params.duration / f64::from(steps), step)?;
    }
    job.advance(steps as f32 / (steps + 1) as f32)?;
    land.route(job, None)?;

    let cell_m2 = job.cell_m() * job.cell_m();
    let area = land.cells.par_iter().map(|&cells| (f64::from(cells) * cell_m2) as f32).collect();
    let height: Vec<f32> = land.heights.par_iter().map(|&height| height as f32).collect();
    let uplift = job.lane("uplift");
    let mut erosion = vec![0.0; height.len()];
    erosion.par_iter_mut().zip(start.samples()).zip(&land.heights).enumerate().for_each(
        |(cell, ((erosion, &start), &end))| {
            let risen = if land.is_base(cell) { 0.0 } else { f64::from(uplift.at(cell)) * params.duration };
            // The heights of many steps add up to rounding errors of the order of 1e-12 m where nothing was eroded.
            *erosion = (f64::from(start) + risen - end).max(0.0) as f32;
        },
    );
    let field = |samples| Field::new(job.window(), samples);
    Ok(Outputs::one("height", field(height)).with("area", field(area)).with("erosion", field(erosion)))
}

/// The state of a run, and what does not change during it.
struct Land<'a> {
    grid: Grid,
    heights: Vec<f64>,
    codes: Vec<u8>,
    /// Directions of steepest descent, for random receivers.
    tangents: Vec<u8>,
    depressions: Depressions<f64>,
    drainage: Drainage,
    cells: Vec<u32>,
    cell_m: f64,
    uplift: Lane<'a>,
    erodibility: Lane<'a>,
    steepest: Steepest,
    receivers: Receivers,
    seed: u32,
    law: Law,
    n: f64,
    area: AreaFactor,
    /// Coefficients of the variation of erodibility; a cell draws one.
    variation: Option<[f64; 256]>,
}

/// The steepest drop over a distance of 1.
enum Steepest {
    Everywhere(f64),
    Each(Vec<f32>),
}

impl<'a> Land<'a> {
    fn new(job: &'a Job<'_>, params: &Params, start: &Field) -> Result<Self, NodeError> {
        let grid = Grid::new(&job.window())?;
        let cells = grid.cells();
        let law = Law::new(params.n);
        let tangent = |degrees: f32| {
            let degrees = f64::from(degrees).clamp(0.0, 90.0);
            if degrees < 90.0 { math::tan(degrees.to_radians()) } else { f64::INFINITY }
        };
        let steepest = match job.lane("repose") {
            Lane::Constant(degrees) => Steepest::Everywhere(tangent(degrees)),
            Lane::Samples(degrees) => {
                Steepest::Each(degrees.par_iter().map(|&degrees| tangent(degrees) as f32).collect())
            }
        };
        Ok(Self {
            heights: start.samples().par_iter().map(|&height| f64::from(height)).collect(),
            codes: vec![0; cells],
            tangents: vec![0; if params.receivers == Receivers::RhoInfinity { cells } else { 0 }],
            depressions: Depressions::default(),
            drainage: Drainage::default(),
            cells: vec![0; cells],
            cell_m: job.cell_m(),
            uplift: job.lane("uplift"),
            erodibility: job.lane("erodibility"),
            steepest,
            receivers: params.receivers,
            seed: job.seed(),
            variation: (params.variation > 0.0).then(|| variation(&law, params.variation)),
            area: AreaFactor::new(&law, params, job.cell_m() * job.cell_m()),
            law,
            n: params.n,
            grid,
        })
    }

    fn is_base(&self, cell: usize) -> bool {
        self.codes[cell] & code::OUTLET != 0
            && self.grid.outlet(cell % self.grid.nx, cell / self.grid.nx) == Outlet::Base
    }

    /// Raises the land for the time of a step, then erodes it.
    fn step(&mut self, job: &Job<'_>, step_yr: f64, step: u32) -> Result<(), NodeError> {
        self.raise(job, step_yr)?;
        self.route(job, Some(step))?;
        self.erode(job, step_yr)?;
        match &self.steepest {
            Steepest::Everywhere(f64::INFINITY) => Ok(()),
            Steepest::Everywhere(slope) => slides::settle(job, &self.grid, &mut self.heights, self.cell_m, |_| *slope),
            Steepest::Each(slopes) => {
                slides::settle(job, &self.grid, &mut self.heights, self.cell_m, |cell| f64::from(slopes[cell]))
            }
        }
    }

    fn raise(&mut self, job: &Job<'_>, step_yr: f64) -> Result<(), NodeError> {
        if self.uplift.constant() == Some(0.0) {
            return Ok(());
        }
        let (grid, uplift) = (&self.grid, self.uplift);
        self.heights.par_chunks_mut(grid.nx).enumerate().try_for_each(|(y, heights)| {
            job.check()?;
            let first = y * grid.nx;
            let border = grid.is_border_row(y);
            for (x, height) in heights.iter_mut().enumerate() {
                let side = border || x == 0 || x + 1 == grid.nx;
                if !(side && grid.outlet(x, y) == Outlet::Base) {
                    *height += f64::from(uplift.at(first + x)) * step_yr;
                }
            }
            Ok(())
        })
    }

    /// Receivers, ways out of depressions and drainage areas of the land as it is: of a step, or by steepest descent.
    fn route(&mut self, job: &Job<'_>, step: Option<u32>) -> Result<(), NodeError> {
        let (grid, heights, codes) = (&self.grid, &self.heights, &mut self.codes);
        match step {
            Some(step) if self.receivers == Receivers::RhoInfinity => {
                let seed = orograph_graph::mix(self.seed ^ orograph_graph::mix(step));
                receivers::rho_infinity(job, grid, heights, codes, &mut self.tangents, seed)?;
            }
            _ => receivers::d8(job, grid, heights, codes)?,
        }
        self.depressions.find(job, grid, heights, codes)?;
        self.depressions.carve(job, grid, codes)?;
        self.cells.fill(1);
        self.drainage.accumulate(job, grid, codes, &mut self.cells)
    }

    /// Solves the law over a step, receivers first.
    fn erode(&mut self, job: &Job<'_>, step_yr: f64) -> Result<(), NodeError> {
        let mut heights = std::mem::take(&mut self.heights);
        let Self { law, cells, area, tangents, erodibility, variation, seed, .. } = &*self;
        // By direction of steepest descent, for links across a side and across a corner.
        let lengths_m = [false, true].map(|diagonal| {
            std::array::from_fn::<_, 256, _>(|tangent| self.cell_m * receivers::length(diagonal, tangent as u8))
        });
        let bases = lengths_m.map(|row| row.map(|length_m| step_yr / math::pow(length_m, self.n)));
        let coefficient = |erodibility: f32, base: f64| law.coefficient(f64::from(erodibility).max(0.0) * base);
        let everywhere = erodibility.constant().map(|k| bases.map(|row| row.map(|base| coefficient(k, base))));
        let solve = |cell: usize, code: u8, height: f64, below: f64| {
            let drop = height - below;
            // The floor of a lake waits until the pass it drains through is cut below it.
            if drop.is_nan() || drop <= 0.0 {
                return height;
            }
            let diagonal = usize::from(code::is_diagonal(code::direction(code)));
            let along = match tangents.get(cell) {
                Some(tangent) if code & code::TURNED == 0 => usize::from(*tangent),
                _ => 255 * diagonal,
            };
            let without_area = match &everywhere {
                Some(coefficients) => coefficients[diagonal][along],
                None => coefficient(erodibility.at(cell), bases[diagonal][along]),
            };
            let mut coefficient = law.times(without_area, area.of(law, cells[cell]));
            if let Some(variation) = variation {
                let draw = orograph_graph::mix((cell as u32).wrapping_mul(0x9E37_79B9) ^ seed) >> 24;
                coefficient = law.times(coefficient, variation[draw as usize]);
            }
            let left = law.left(coefficient, drop);
            let slope = match &self.steepest {
                Steepest::Everywhere(slope) => *slope,
                Steepest::Each(slopes) => f64::from(slopes[cell]),
            };
            let steepest = slope * lengths_m[diagonal][along];
            below + if left > steepest { steepest } else { left }
        };
        let solved = self.drainage.upstream(job, &self.grid, &self.codes, &mut heights, solve);
        self.heights = heights;
        solved
    }
}

/// Equally likely factors of the erodibility, as coefficients: their logarithm is uniform around 0 and has the given
/// standard deviation.
fn variation(law: &Law, deviation: f64) -> [f64; 256] {
    std::array::from_fn(|at| {
        let uniform = (at as f64 + 0.5) / 128.0 - 1.0;
        law.coefficient(math::exp(deviation * 3.0_f64.sqrt() * uniform))
    })
}

/// The factor Aᵐ of the law by number of cells, as a coefficient. Nearly all cells drain few others: theirs are
/// computed beforehand.
struct AreaFactor {
    table: Vec<f64>,
    cell_m2: f64,
    critical_m2: f64,
    m: f64,
}

impl AreaFactor {
    fn new(law: &Law, params: &Params, cell_m2: f64) -> Self {
        let mut factor = Self { table: Vec::new(), cell_m2, critical_m2: params.critical_area, m: params.m };
        factor.table = (0..4096).map(|cells| factor.compute(law, cells)).collect();
        factor
    }

    fn compute(&self, law: &Law, cells: u32) -> f64 {
        let area_m2 = (f64::from(cells.max(1)) * self.cell_m2).max(self.critical_m2);
        law.coefficient(math::pow(area_m2, self.m))
    }

    #[inline(always)]
    fn of(&self, law: &Law, cells: u32) -> f64 {
        self.table.get(cells as usize).copied().unwrap_or_else(|| self.compute(law, cells))
    }
}

#[cfg(test)]
#[path = "stream_power_tests.rs"]
mod tests;
