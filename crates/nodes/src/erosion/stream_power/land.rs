//! The land during a run: its heights and what the law needs to know of it.

mod age;
mod budget;
mod floors;
mod irregular;
mod levels;

use orograph_graph::{
    memory::{OutOfMemory, copied, zeroed},
    mix,
};

pub use self::irregular::Displacement;
use self::{budget::Budget, floors::Floors};
use super::{
    Inputs, Method, Params, Receivers, Wants,
    area::{Area, Heads, Scheme},
    bedrock::Bedrock,
    deposition::Transport,
    ground::Ground,
    incision::Law,
    inland,
    links::Links,
    rock::Rock,
    slides::{self, KnollHeights},
    steepest::{Repose, Steepest},
    tectonics::Tectonics,
    winding::Winding,
};
use crate::{
    numerics::{
        hillslope::Hillslope,
        par,
        rock::{Bodies, tangent},
        routing::{Depressions, Drainage, Grid, Outlet, receivers},
        waves::SHORTEST_CELLS,
    },
    prelude::*,
};

/// Wavelengths in which A₀ varies, the longest in √A₀ and the shortest as a share of it.
const HILLSLOPES: f64 = 20.0;
const HILLSLOPE_WAVES: f64 = 1.0 / 16.0;

/// The state of a run, and what does not change during it.
pub struct Land<'a> {
    grid: Grid,
    /// Heights in metres.
    pub heights: Vec<f64>,
    codes: Vec<u8>,
    /// Directions of steepest descent, for random receivers.
    tangents: Vec<u8>,
    depressions: Depressions<f64>,
    drainage: Drainage,
    /// Drainage areas of the last routing.
    pub area: Area<'a>,
    cell_m: f64,
    /// What moves the land.
    pub tectonics: Tectonics<'a>,
    /// Years that have passed.
    time_yr: f64,
    rock: Rock<'a>,
    /// What makes rivers wind.
    winding: Winding,
    ground: Ground,
    /// Layers of rock, where there are any.
    bedrock: Option<Bedrock<'a>>,
    steepest: Steepest,
    /// Its mean, once it is needed.
    mean_steepest: Option<f64>,
    hillslope: Hillslope<'a>,
    /// The drainage area at which a river carries off what creeps into it; infinite without such rivers.
    river_m2: f64,
    /// How wide the floors of valleys are.
    floors: Floors,
    /// Cells of the rim of `inland` sides through which rivers leave.
    gates: Vec<u32>,
    receivers: Receivers,
    seed: u32,
    law: Law,
    n: f64,
    /// Level of the sea in metres; without one it is below everything.
    sea_level_m: f64,
    /// What is carried and settles; without it, all that is eroded leaves the world.
    sediment: Option<Sediment<'a>>,
    /// True if the balance of rock is followed.
    is_followed: bool,
    /// The balance since the first step.
    budget: Option<Budget>,
}

/// The loose material of the land.
struct Sediment<'a> {
    deposition: Lane<'a>,
    /// What came loose at the last step and joins the rivers at the next one, in metres.
    debris: Vec<f64>,
    /// Thickness of what lies on the rock, in metres; only where it is wanted.
    thickness: Option<Vec<f32>>,
}

/// What is left of a land when its time has passed.
pub struct Ended<'a> {
    grid: Grid,
    /// Heights in metres.
    pub heights: Vec<f64>,
    /// Drainage areas of the last routing.
    pub area: Area<'a>,
    /// What has moved the land.
    pub tectonics: Tectonics<'a>,
    /// Thickness of the sediment on the rock in metres; None where there is none or it was not followed.
    pub sediment_m: Option<Vec<f32>>,
}

impl Ended<'_> {
    /// Whether a cell has kept its height.
    #[must_use]
    pub fn is_base(&self, cell: usize) -> bool {
        is_base(&self.grid, cell)
    }
}

fn is_base(grid: &Grid, cell: usize) -> bool {
    grid.outlet(cell % grid.nx, cell / grid.nx) == Outlet::Base
}

/// What is asked of a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked {
    /// [`Work::lowered`].
    pub lowered: bool,
    /// [`Work::flux`].
    pub flux: bool,
}

impl Asked {
    /// Returns true if anything is asked.
    pub const fn any(self) -> bool {
        self.lowered || self.flux
    }

    /// Amounts for each of the two that is asked for, copied only for both.
    pub fn split(self, amounts: Vec<f64>) -> (Option<Vec<f64>>, Option<Vec<f64>>) {
        match (self.lowered, self.flux) {
            (true, true) => (Some(amounts.clone()), Some(amounts)),
            (false, true) => (None, Some(amounts)),
            (lowered, false) => (lowered.then_some(amounts), None),
        }
    }
}

/// What a step did, as far as it was asked.
#[derive(Debug, Default)]
pub struct Work {
    /// By how much the land is lower than the uplift alone would have it, in metres.
    pub lowered: Option<Vec<f64>>,
    /// What rivers carried out of each cell, in metres over a cell.
    pub flux: Option<Vec<f64>>,
}

/// What a land is computed on; by default a single grid.
#[derive(Debug, Default)]
pub struct Footing {
    /// Cells through which rivers leave at `inland` sides; None lets them be found.
    pub gates: Option<Vec<u32>>,
    /// The number of a level, and the side of a cell of the coarsest in metres.
    pub level: Option<(u32, f64)>,
    /// True if the land goes on from that of a coarser level.
    pub goes_on: bool,
    /// True if the thickness of the sediment is followed even if no output needs it.
    pub keeps_sediment: bool,
}

impl<'a> Land<'a> {
    /// The land at the start.
    ///
    /// # Errors
    /// When the world has no outlet or the inputs contradict each other.
    pub fn new(job: &'a Job<'_>, params: &Params, start: &Field, footing: Footing) -> Result<Self, NodeError> {
        let gates = footing.gates.unwrap_or_else(|| inland::gates(&job.window(), start.samples(), job.seed()));
        let grid = Grid::new(&job.window())?.with_gates(gates.clone(), inland::sides(&job.window().world));
        let cells = grid.cells();
        let (cell_m, inputs, wants) = (job.cell_m(), Inputs::read(job)?, Wants::of(job));
        let law = Law::new(params.n);
        let holds_m = SHORTEST_CELLS * cell_m;
        let (seed, shortest_m, scheme) = match footing.level {
            // what is shorter than the coarsest cells hold would change their mean when a finer level adds it
            Some((number, coarsest_m)) => (mix(job.seed() ^ mix(number)), holds_m.min(coarsest_m), Scheme::Level),
            None => (job.seed(), holds_m, Scheme::SingleGrid),
        };
        let (rock, varied) = Rock::new(job, &inputs, params, &law, shortest_m)?;
        let heads = Heads { critical_m2: params.critical_area, headwater_m2: params.headwater_area, m: params.m };
        let (bedrock, varied) = match inputs.strata {
            Some(strata) => (Some(Bedrock::new(strata, inputs.uplift, inputs.repose, varied)?), None),
            None => (None, varied),
        };
        // the analytical method has one network, and not the mean of many, so that its rivers would differ between cells
        let winding = if params.method == Method::Analytical { 0.0 } else { params.winding };
        let winding = Winding::new(&law, winding, params.headwater_area, seed);
        // creep that keeps pace with the headwaters over some cells, whatever the cells are
        let weakness = bedrock.as_ref().map_or(1.0, Bedrock::mean_weakness);
        let least_diffusivity = params.rounding * rock.mean(cells) * weakness * heads.power() * cell_m;
        let repose = match (varied, inputs.repose) {
            (Some(tangents), _) => Repose::Each(tangents),
            // looked up at each step
            (None, _) if bedrock.is_some() => Repose::Each(zeroed(cells)?),
            (None, Lane::Constant(degrees)) => Repose::Everywhere(tangent(degrees)),
            (None, Lane::Samples(degrees)) => Repose::Each(par::map_of(degrees, |&degrees| tangent(degrees) as f32)),
        };
        let mut area = Area::new(&law, cells, inputs.rain, cell_m * cell_m, heads, scheme);
        if params.headwater_variation > 0.0 && params.headwater_area > 0.0 {
            let longest_m = HILLSLOPES * params.headwater_area.sqrt();
            let waves = Bodies { longest_m, shortest_m: HILLSLOPE_WAVES * longest_m }.hillslopes(job)?;
            area.vary_headwaters(params.headwater_variation, waves);
        }
        Ok(Self {
            heights: par::map_of(start.samples(), |&height| f64::from(height)),
            codes: zeroed(cells)?,
            tangents: zeroed(if params.receivers == Receivers::RhoInfinity { cells } else { 0 })?,
            depressions: Depressions::default(),
            drainage: Drainage::default(),
            area,
            cell_m,
            tectonics: Tectonics::new(&inputs, params),
            time_yr: 0.0,
            rock,
            winding,
            ground: Ground::new(job, params, footing.goes_on)?,
            bedrock,
            steepest: Steepest::new(repose, params.gullies),
            mean_steepest: None,
            hillslope: Hillslope::new(&job.window(), inputs.diffusivity, params.critical_slope)
                .at_least(least_diffusivity)
                .risen(),
            river_m2: if params.critical_area > 0.0 { params.critical_area } else { f64::INFINITY },
            floors: Floors::new(job, params),
            gates,
            receivers: params.receivers,
            seed,
            law,
            n: params.n,
            sea_level_m: job.sea_level().unwrap_or(f64::NEG_INFINITY),
            sediment: Sediment::new(
                inputs.deposition,
                cells,
                wants.sediment || wants.erosion || footing.keeps_sediment,
            )?,
            is_followed: wants.report,
            budget: None,
            grid,
        })
    }

    /// Drops what only a further step would need.
    #[must_use]
    pub fn end(self) -> Ended<'a> {
        let sediment_m = self.sediment.and_then(|sediment| sediment.thickness);
        let (grid, heights, tectonics) = (self.grid, self.heights, self.tectonics);
        Ended { grid, heights, area: self.area.end(), tectonics, sediment_m }
    }

    /// Whether a cell keeps its height.
    #[must_use]
    pub fn is_base(&self, cell: usize) -> bool {
        is_base(&self.grid, cell)
    }

    /// Raises the land for the time of a step, then erodes it. Says what it did as far as it is asked.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn step(&mut self, job: &Job<'_>, step_yr: f64, step: u32, asked: Asked) -> Result<Work, NodeError> {
        if !self.is_followed {
            self.raise(job, step_yr)?;
            return self.cut(job, step_yr, step, asked);
        }
        let before_m = self.total_m();
        let mut budget = self.budget.unwrap_or_else(|| Budget::new(self.time_yr, before_m));
        self.raise(job, step_yr)?;
        budget.rise(self.total_m() - before_m);
        let work = self.cut(job, step_yr, step, Asked { flux: true, ..asked })?;
        budget.leave(&self.codes, work.flux.as_deref().unwrap_or_default());
        self.budget = Some(budget);
        Ok(Work { flux: work.flux.filter(|_| asked.flux), ..work })
    }

    /// Raises the land for the time of a step.
    fn raise(&mut self, job: &Job<'_>, step_yr: f64) -> Result<(), NodeError> {
        let until_yr = self.time_yr + step_yr;
        self.tectonics.raise(job, &self.grid, &mut self.heights, [self.time_yr, until_yr])?;
        self.time_yr = until_yr;
        Ok(())
    }

    /// Erodes the land for the time of a step.
    fn cut(&mut self, job: &Job<'_>, step_yr: f64, step: u32, asked: Asked) -> Result<Work, NodeError> {
        self.look_up();
        self.route(job, Some(step))?;
        self.wet(job)?;
        let Some(mut sediment) = self.sediment.take() else {
            let before = asked.any().then(|| copied(&self.heights)).transpose()?;
            self.erode(job, step_yr)?;
            self.slide(job)?;
            let Some(mut lowered) = before else {
                self.creep(job, step_yr, step, None)?;
                return Ok(Work::default());
            };
            par::change_with(&mut lowered, &self.heights, |height, after| *height -= after);
            let (mut lowered, mut flux) = asked.split(lowered);
            let fluvial = asked.lowered.then(|| copied(&self.heights)).transpose()?;
            self.creep(job, step_yr, step, flux.as_mut())?;
            if let (Some(lowered), Some(fluvial)) = (&mut lowered, fluvial) {
                let crept = |cell: usize| fluvial[cell] - self.heights[cell];
                par::change_at(lowered, |cell, lowered| *lowered += crept(cell));
            }
            if let Some(flux) = &mut flux {
                self.drainage.accumulate(job, &self.grid, &self.codes, flux)?;
            }
            return Ok(Work { lowered, flux });
        };
        let mut lowered = (asked.lowered || sediment.thickness.is_some()).then(|| copied(&self.heights)).transpose()?;
        let flux = self.carry(job, step_yr, &mut sediment)?;
        let fluvial = copied(&self.heights)?;
        self.slide(job)?;
        let slid = |cell: usize| fluvial[cell] - self.heights[cell];
        par::change_at(&mut sediment.debris, |cell, debris| *debris += slid(cell));
        self.creep(job, step_yr, step, Some(&mut sediment.debris))?;
        if let Some(lowered) = &mut lowered {
            par::change_with(lowered, &self.heights, |height, after| *height -= after);
        }
        if let (Some(thickness), Some(lowered)) = (&mut sediment.thickness, &lowered) {
            let layer = |thickness: &mut f32, lowered: &f64| {
                *thickness = (f64::from(*thickness) - lowered).max(0.0) as f32;
            };
            par::change_with(thickness, lowered, layer);
        }
        self.sediment = Some(sediment);
        Ok(Work { lowered: lowered.filter(|_| asked.lowered), flux: asked.flux.then_some(flux) })
    }

    /// Takes in the drainage areas of the last routing: what cuts floors and headwaters, and where ground is saturated.
    fn wet(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        self.area.spread();
        self.widen(job)?;
        self.steepest.soak(job, &self.grid, &self.codes, &self.area)
    }

    /// Looks up the layers at the surface.
    fn look_up(&mut self) {
        if let (Some(bedrock), Some(repose)) = (&mut self.bedrock, self.steepest.each()) {
            bedrock.look_up(self.tectonics.risen_yr(self.time_yr), &self.heights, repose);
            self.mean_steepest = None;
        }
    }

    /// Lets slopes give way that are steeper than repose.
    fn slide(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        if !self.steepest.is_limited() {
            return Ok(());
        }
        let mut heights = std::mem::take(&mut self.heights);
        let (grid, cell_m, steepest) = (&self.grid, self.cell_m, &self.steepest);
        // One slope for all knolls: where rock stands steeper from place to place, they do not.
        let mut slope = || *self.mean_steepest.get_or_insert_with(|| steepest.mean());
        let slope = if self.ground.is_even() { 0.0 } else { slope() };
        let knolls = KnollHeights { slope, ground: self.ground.heights() };
        let slid = slides::settle(job, grid, &mut heights, cell_m, steepest, knolls);
        self.heights = heights;
        slid
    }

    /// Lets the land between rivers creep. What comes to rivers and leaves the world is added to `lost`.
    pub(super) fn creep(
        &mut self,
        job: &Job<'_>,
        step_yr: f64,
        step: u32,
        lost: Option<&mut Vec<f64>>,
    ) -> Result<(), NodeError> {
        let (area, river_m2, gates) = (&self.area, self.river_m2, &self.gates);
        let rivers = area.at_least(river_m2);
        let is_river = |cell: usize| rivers.has(cell);
        let held: Vec<f64> = gates.iter().map(|&gate| self.heights[gate as usize]).collect();
        let mut lost = lost;
        self.hillslope.creep(
            job,
            &mut self.heights,
            step_yr,
            step..step + 1,
            &is_river,
            lost.as_mut().map(|lost| &mut lost[..]),
        )?;
        for (&gate, held) in gates.iter().zip(held) {
            let height = &mut self.heights[gate as usize];
            if let Some(lost) = &mut lost {
                lost[gate as usize] += *height - held;
            }
            *height = held;
        }
        Ok(())
    }

    /// Receivers, ways out of depressions and drainage areas of the land as it is: of a step, or by steepest descent.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn route(&mut self, job: &Job<'_>, step: Option<u32>) -> Result<(), NodeError> {
        let (grid, heights, codes) = (&self.grid, &self.heights, &mut self.codes);
        match step {
            Some(step) if self.receivers == Receivers::RhoInfinity => {
                let seed = mix(self.seed ^ mix(step));
                receivers::rho_infinity(job, grid, heights, codes, &mut self.tangents, seed)?;
            }
            _ => receivers::d8(job, grid, heights, codes)?,
        }
        // only the surface of the water, which deposition needs, is found from the basins later
        let shares_room = self.sediment.is_none();
        if shares_room {
            self.drainage.exchange_room(&mut self.depressions);
        }
        self.depressions.find(job, grid, heights, codes)?;
        self.depressions.carve(job, grid, codes)?;
        if shares_room {
            self.drainage.exchange_room(&mut self.depressions);
        }
        self.area.accumulate(job, grid, codes, &mut self.drainage)
    }

    fn links(&self, step_yr: f64) -> Links<'_> {
        let links = Links::new(&self.law, &self.rock, &self.area, &self.tangents, self.cell_m, step_yr, self.n);
        let links = links.in_layers(self.bedrock.as_ref());
        links.on_ground(&self.ground, &self.grid).of_beds(&self.winding)
    }

    /// Solves the law over a step, receivers first.
    fn erode(&mut self, job: &Job<'_>, step_yr: f64) -> Result<(), NodeError> {
        let mut heights = std::mem::take(&mut self.heights);
        // layers are cut one after the other
        let (links, sea_level_m) = (self.links(step_yr).in_layers(None), self.sea_level_m);
        // the coefficient and the steepest drop that stands
        let prepare = |cell: usize, code: u8| {
            let (coefficient, length_m) = links.of(cell, code);
            (coefficient, self.steepest.at(cell) * length_m)
        };
        let solve = |cell: usize, _: u8, (coefficient, steepest): (f64, f64), height: f64, below: f64| {
            let below = if below < sea_level_m { sea_level_m } else { below };
            let drop = height - below;
            // The floor of a lake waits until the pass it drains through is cut below it.
            if drop.is_nan() || drop <= 0.0 {
                return height;
            }
            let left = match &self.bedrock {
                Some(bedrock) => bedrock.left(&self.law, self.n, cell, coefficient, [height, below]),
                None => self.law.left(coefficient, drop),
            };
            below + if left > steepest { steepest } else { left }
        };
        let solved = self.drainage.upstream_prepared(job, &self.grid, &self.codes, &mut heights, prepare, solve);
        self.heights = heights;
        solved
    }

    /// Solves the law with deposition over a step; gives the flux of sediment.
    fn carry(&mut self, job: &Job<'_>, step_yr: f64, sediment: &mut Sediment<'_>) -> Result<Vec<f64>, NodeError> {
        let mut surface = copied(&self.heights)?;
        self.depressions.fill(&mut surface);
        let sea_level_m = self.sea_level_m;
        par::change(&mut surface, |level| *level = level.max(sea_level_m));
        let links = self.links(step_yr);
        let transport = Transport {
            grid: &self.grid,
            codes: &self.codes,
            drainage: &self.drainage,
            links: &links,
            tangents: None,
            area: &self.area,
            cell_m2: self.cell_m * self.cell_m,
            deposition: sediment.deposition,
            steepest: &|cell| self.steepest.at(cell),
            sea_level_m,
            surface: &surface,
        };
        let (beds, flux) = if self.n == 1.0 {
            transport.solve(job, &self.heights, &sediment.debris)?
        } else {
            transport.solve_power(job, &self.heights, &sediment.debris, &self.law, self.n)?
        };
        par::change_with(&mut self.heights, &beds, |height, bed| *height = bed.height);
        par::change_with(&mut sediment.debris, &beds, |debris, bed| *debris = bed.loose);
        Ok(flux)
    }
}

impl<'a> Sediment<'a> {
    /// A land without sediment, whose thickness is followed if it is `measured`. Returns None when `deposition` is 0
    /// everywhere.
    fn new(deposition: Lane<'a>, cells: usize, measured: bool) -> Result<Option<Self>, OutOfMemory> {
        if deposition.constant().is_some_and(|g| g <= 0.0) {
            return Ok(None);
        }
        let thickness = measured.then(|| zeroed(cells)).transpose()?;
        Ok(Some(Self { deposition, debris: zeroed(cells)?, thickness }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{erosion::stream_power::NODE, numerics::routing::code, testing};

    /// Twenty steps over rough, rising land with lakes, a sea, slides and creep: what left and what is on its way is
    /// what the land lost.
    fn balance(job: &Job<'_>) -> Result<Outputs, NodeError> {
        let (params, start) = (Params::read(job.params), Inputs::read(job)?.height);
        let mut land = Land::new(job, &params, start, Footing::default())?;
        let cells = || 0..start.samples().len();
        let (mut left, mut moved) = (0.0, 0.0);
        for step in 0..20 {
            let work = land.step(job, params.duration / 20.0, step, Asked { lowered: true, flux: true })?;
            let (lowered, flux) = (work.lowered.expect("heights"), work.flux.expect("a flux"));
            left += cells().filter(|&c| land.codes[c] & code::OUTLET != 0).map(|c| flux[c]).sum::<f64>();
            moved += lowered.iter().map(|m| m.abs()).sum::<f64>();
        }
        let rise_m = f64::from(Inputs::read(job)?.uplift.at(0)) * params.duration;
        let lost: f64 = cells()
            .map(|c| f64::from(start.samples()[c]) + if land.is_base(c) { 0.0 } else { rise_m } - land.heights[c])
            .sum();
        let on_its_way: f64 = land.sediment.iter().flat_map(|sediment| &sediment.debris).sum();
        assert!(moved > 1e3 && left > 1.0, "{moved} {left}");
        // Sums of some 10 000 numbers in double precision.
        assert!((lost - left - on_its_way).abs() < 1e-9 * moved, "{lost} {left} {on_its_way}");
        Ok(Outputs::default())
    }

    #[test]
    fn sediment_is_conserved() {
        let world = testing::world(70, 90, 50.0);
        let height = testing::field(world, |x, y| {
            x * 0.05 + f64::from(mix((x * 8.0) as u32 ^ mix((y * 8.0) as u32))) / 4_294_967_296.0 * 200.0
        });
        let uplift = Field::constant(Window::whole(world), 0.001);
        let height = testing::at_sea(&height, 60.0);
        let node = Node { cpu: balance, inputs: NODE.inputs, params: NODE.params, reads_sea: true, ..Node::DEFAULT };
        for (deposition, diffusivity, changes) in [
            (0.5, 0.0, "duration=1e5"),
            (0.5, 0.01, "duration=1e5"),
            (3.0, 0.1, "duration=2e6,receivers=d8"),
            (1000.0, 0.1, "duration=1e7,critical_slope=1.2"),
            (0.0, 0.1, "duration=2e6"),
            (0.5, 0.01, "duration=1e6,n=1.5"),
            (1.0, 0.0, "duration=1e6,n=0.7,m=0.35"),
            (2.0, 0.0, "duration=1e6,n=2.5,receivers=d8"),
        ] {
            let [deposition, diffusivity] =
                [deposition, diffusivity].map(|value| Field::constant(Window::whole(world), value));
            let params = testing::with_params(&NODE, changes);
            let mut fields = vec![("height", &height), ("uplift", &uplift), ("diffusivity", &diffusivity)];
            if deposition.samples()[0] > 0.0 {
                fields.push(("deposition", &deposition));
            }
            testing::outputs(&node, &params, &fields).expect("a balance");
        }
    }
}
