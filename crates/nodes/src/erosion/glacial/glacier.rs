//! The run: climate, ice, erosion and debris, step after step.

use orograph_graph::{Job, Moment, NodeError, Process, memory::copied, memory::zeroed};

use super::{
    Inputs, Law, Method, Params, Wants, climate,
    climate::{Climate, Layer},
    debris,
    fast::Plastic,
    grid::Grid,
    ice::{Ice, THIN_M},
    kernels::Rheology,
    law,
    march::{Ledger, OnHost, Pace, march},
    sheet::Sheet,
    transfer::Transfer,
};
use crate::{
    numerics::{
        beds::{Beds, Ground},
        math, par, voids,
    },
    prelude::*,
};

/// A step lowers the bed by at most this much.
const DEEPEST_M: f64 = 30.0;
/// If limits prevent more than this share of the erosion, a warning says so.
const NOTABLE: f64 = 0.02;
/// Till is this many times as erodible as rock.
const SOFT: f64 = 5.0;
/// Ice thinner than this is the margin: what is dropped there is moraine.
const MARGIN_M: f64 = 25.0;
/// Standard deviation over which a margin that comes and goes spreads its debris.
const SMEAR_M: f64 = 90.0;
/// As till approaches this thickness, less and less comes to rest on it: ice and meltwater take it on.
const THICKEST_M: f64 = 60.0;
/// The thinnest fall of a wall that counts.
const LEAST_FALL_M: f32 = 0.02;
/// Sweeps in which till slides, per step.
const SLIDES: usize = 6;
/// Steps of the fast mode per step of the full one.
const FAST: f64 = 0.2;
/// Aim, shortest and longest step of the ice.
const PACE: [f64; 3] = [40.0, 0.05, 5.0];
const SECONDS_PER_YEAR: f64 = 365.25 * 86_400.0;

/// Volumes in m³ since the start.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Volumes {
    /// Rock removed, by ice and from walls.
    pub eroded: f64,
    /// The part of it that leaves as rock flour.
    pub flour: f64,
    /// Debris that ice carried out of the world.
    pub left: f64,
    /// Debris that meltwater took away where till was thick.
    pub washed: f64,
}

/// Glaciers in progress.
pub(super) struct Glacier {
    pub params: Params,
    pub transfer: Transfer,
    pub grid: Grid,
    pub climate: Climate,
    erodibility: Layer,
    /// Layers of rock and what is subtracted in the stratigraphic height of each ice cell.
    strata: Option<(Beds, Vec<f32>)>,
    pub flow: Flow,
    pub ice: Ice,
    /// Levels of the rock at the start and now, and thickness of till on it, per ice cell.
    pub start: Vec<f64>,
    pub rock: Vec<f64>,
    pub till: Vec<f64>,
    /// Thickness of debris that was dropped at a margin.
    pub moraine: Vec<f32>,
    active: Vec<bool>,
    pub ledger: Ledger,
    pub volumes: Volumes,
    pub done: u64,
    /// Largest thickness of any moment, in metres.
    pub deepest_m: f64,
    /// Erosion by ice, and the erosion that the limits of a step prevented, in metres over an ice cell.
    lowered: [f64; 2],
}

/// The two ways in which ice is found.
pub(super) enum Flow {
    Full { sheet: Sheet, pace: Pace, balance: Vec<f64> },
    Fast(Plastic),
}

impl Glacier {
    pub fn new(job: &Job<'_>) -> Result<Self, NodeError> {
        let (inputs, params) = (Inputs::read(job)?, Params::read(job.params));
        let window = job.window();
        let transfer = Transfer::new(&window, params.ice_cell);
        let grid = Grid::new(&window, &transfer.coarse)?;
        let climates = climate::Inputs {
            ela: inputs.ela,
            temperature: inputs.temperature,
            precipitation: inputs.precipitation,
            lapse_rate: inputs.lapse_rate,
        };
        let climate = Climate::new(job, &transfer.coarse, &params, &climates)?;
        if climate.is_negative(&grid) {
            job.warn("`precipitation` is negative in some places, where it counts as 0");
        }
        let means = transfer.coarse.means(job, &voids::filled(job, inputs.height.samples())?)?;
        let start: Vec<f64> = means.iter().map(|&mean| f64::from(mean)).collect();
        let strata = match inputs.strata {
            Some(strata) => {
                let offset = transfer.coarse.means(job, strata.offset().samples())?;
                Some((Beds::of_rock(strata.column()), offset))
            }
            None => None,
        };
        let rheology = Rheology::new(params.rate_factor, params.sliding, params.yield_stress);
        let flow = match params.method {
            Method::Full => {
                let mut sheet = Sheet::new(grid, rheology)?;
                sheet.set_bed(|cell| start[cell]);
                let [aim, shortest, longest] = PACE;
                Flow::Full { sheet, pace: Pace::new(aim, shortest, longest), balance: zeroed(grid.len())? }
            }
            Method::Fast => Flow::Fast(Plastic::new(&window, &grid, rheology, &start)?),
        };
        Ok(Self {
            transfer,
            grid,
            climate,
            erodibility: Layer::new(job, &transfer.coarse, inputs.erodibility)?,
            strata,
            flow,
            ice: Ice::new(&grid)?,
            rock: copied(&start)?,
            start,
            till: zeroed(grid.len())?,
            moraine: zeroed(grid.len())?,
            active: vec![false; grid.len()],
            ledger: Ledger::default(),
            volumes: Volumes::default(),
            done: 0,
            deepest_m: 0.0,
            lowered: [0.0; 2],
            params,
        })
    }

    /// Steps of the run.
    pub fn steps(&self) -> u64 {
        if self.params.duration <= 0.0 {
            return 0;
        }
        let steps = self.params.steps.max(1) as f64;
        (if self.params.method == Method::Fast { (FAST * steps).ceil() } else { steps }) as u64
    }

    /// Returns the fraction of the run that is done.
    pub fn fraction(&self) -> f32 {
        let steps = self.steps();
        if steps == 0 { 1.0 } else { (self.done as f64 / steps as f64) as f32 }
    }

    /// Lets the ice adjust to the climate of a step.
    fn freeze(&mut self, job: &Job<'_>, shift_m: f64) -> Result<(), NodeError> {
        let climate = &self.climate;
        match &mut self.flow {
            Flow::Full { sheet, pace, balance } => {
                let renew = |sheet: &Sheet, _: f64, out: &mut [f64]| {
                    let nx = sheet.grid.nx;
                    par::all(out.chunks_mut(nx * 16), |part, out| {
                        for (k, out) in out.chunks_mut(nx).enumerate() {
                            let j = part * 16 + k;
                            let levels = sheet.grid.row(&sheet.surface, 0, j as isize, nx);
                            climate.balances(j * nx, levels, shift_m, out);
                        }
                    });
                };
                let ledger = march(job, &mut OnHost { sheet, balance, renew }, pace, self.params.relaxation)?;
                self.ledger.join(&ledger);
            }
            Flow::Fast(plastic) => {
                let bed: Vec<f64> = self.rock.iter().zip(&self.till).map(|(rock, till)| rock + till).collect();
                // the balance depends on the surface that it makes
                let rounds = if self.done == 0 { 3 } else { 1 };
                for _ in 0..rounds {
                    plastic.find(job, &self.grid, climate, &bed, [shift_m, self.params.fastest], &mut self.ice)?;
                }
            }
        }
        Ok(())
    }

    /// Lets the ice as it is now erode its bed, and drop what it carries.
    pub fn carve(&mut self, job: &Job<'_>, shift_m: f64) -> Result<(), NodeError> {
        if let Flow::Full { sheet, .. } = &self.flow {
            self.ice.read(sheet, self.params.fastest);
        }
        let deepest = self.ice.depth.iter().fold(0.0_f32, |most, depth| most.max(*depth));
        self.deepest_m = self.deepest_m.max(f64::from(deepest));
        let debris = self.erode(self.params.duration / self.steps() as f64, shift_m)?;
        self.deposit(job, debris, shift_m)?;
        if let Flow::Full { sheet, .. } = &mut self.flow {
            let (rock, till) = (&self.rock, &self.till);
            sheet.set_bed(|cell| rock[cell] + till[cell]);
        }
        self.done += 1;
        Ok(())
    }

    /// Erodes for `years` and returns the volume of debris in each cell.
    fn erode(&mut self, years: f64, shift_m: f64) -> Result<Vec<f64>, NodeError> {
        let (grid, params, area_m2) = (self.grid, &self.params, self.grid.area_m2());
        let mut debris: Vec<f64> = zeroed(grid.len())?;
        let area = match &self.flow {
            _ if params.law != Law::Area => None,
            Flow::Full { sheet, .. } => {
                Some(debris::drained(sheet, |cell| self.climate.balance(cell, sheet.level(cell), shift_m) > 0.0)?)
            }
            Flow::Fast(plastic) => Some(copied(&plastic.area)?),
        };
        let ground = self.strata.as_ref().map(|(beds, offset)| Ground { beds, offset });
        let (rock, till) = (&self.rock, &self.till);
        let rates = law::rates(&grid, params, &self.ice, &|cell| rock[cell] + till[cell], area.as_deref())?;
        // what is removed of the rock of each cell; the volumes are sums in the order of the cells
        let mut worn: Vec<f64> = zeroed(grid.len())?;
        let nx = grid.nx;
        let rows = self.rock.chunks_mut(nx).zip(self.till.chunks_mut(nx)).zip(self.active.chunks_mut(nx));
        let rows = rows.zip(debris.chunks_mut(nx).zip(worn.chunks_mut(nx))).zip(rates.chunks(nx));
        let (ice, erodibility) = (&self.ice, &self.erodibility);
        let lowered = par::collect_all(rows, |j, ((((rock, till), active), (debris, worn)), rates)| {
            let mut sums = [0.0; 2];
            for (i, law::Rate { base, section, most }) in rates.iter().copied().enumerate() {
                let cell = j * nx + i;
                active[i] |= f64::from(ice.depth[cell]) > THIN_M;
                let weakness = ground.map_or(1.0, |ground| ground.weakness(cell, rock[i]));
                let lowered = f64::from(base) * years * erodibility.at(cell).max(0.0) * weakness;
                if lowered <= 0.0 {
                    continue;
                }
                // limited before the section's factor, which keeps the bed even
                let most = f64::from(most).min(DEEPEST_M);
                let asked = lowered * f64::from(section);
                let lowered = (lowered.min(most) * f64::from(section)).min(DEEPEST_M);
                sums = [sums[0] + lowered, sums[1] + (asked - lowered).min(f64::from(f32::MAX))];
                let loose = till[i].min(SOFT * lowered);
                let hard = lowered - loose / SOFT;
                till[i] -= loose;
                rock[i] -= hard;
                debris[i] += area_m2 * (loose + params.debris * hard);
                worn[i] = hard;
            }
            sums
        });
        for sums in lowered {
            self.lowered = [self.lowered[0] + sums[0], self.lowered[1] + sums[1]];
        }
        for hard in &worn {
            self.volumes.eroded += area_m2 * hard;
            self.volumes.flour += area_m2 * (1.0 - params.debris) * hard;
        }
        drop((rates, worn));
        let bed: Vec<f64> = self.rock.iter().zip(&self.till).map(|(rock, till)| rock + till).collect();
        let walls = math::tan(params.walls.to_radians());
        let rock = &self.rock;
        let tangent = |cell: usize| ground.map_or(walls, |ground| ground.tangent(cell, rock[cell]));
        for (cell, fallen) in law::failures(&grid, &tangent, &bed, &self.active)?.into_iter().enumerate() {
            // the blur's tails are no failures
            if fallen < LEAST_FALL_M {
                continue;
            }
            let fallen = f64::from(fallen);
            let loose = self.till[cell].min(fallen);
            self.till[cell] -= loose;
            self.rock[cell] -= fallen - loose;
            self.volumes.eroded += area_m2 * (fallen - loose);
            debris[law::below(&grid, &bed, cell)] += area_m2 * fallen;
            self.active[cell] = true;
        }
        Ok(debris)
    }

    /// Carries debris with the ice and lets it come to rest.
    fn deposit(&mut self, job: &Job<'_>, debris: Vec<f64>, shift_m: f64) -> Result<(), NodeError> {
        let (grid, area_m2, climate) = (self.grid, self.grid.area_m2(), &self.climate);
        let till = &self.till;
        let room = |cell: usize| area_m2 * (THICKEST_M - till[cell]);
        let settled = match &self.flow {
            Flow::Full { sheet, .. } => {
                debris::carry(job, sheet, |cell| -climate.balance(cell, sheet.level(cell), shift_m), room, debris)?
            }
            Flow::Fast(plastic) => {
                let melt = |cell: usize| -area_m2 * climate.balance(cell, plastic.level[cell], shift_m);
                plastic.carry(job, melt, &self.ice.depth, room, debris)?
            }
        };
        self.volumes.left += settled.left_m3;
        self.volumes.washed += settled.washed_m3;
        let mut thickness: Vec<f32> = zeroed(grid.len())?;
        thickness.iter_mut().zip(&settled.volume).for_each(|(out, volume)| *out = (volume / area_m2) as f32);
        let [thickness] = super::blur::blurred(&grid, [&thickness], &|_| SMEAR_M, SMEAR_M)?;
        par::change_with(&mut self.till, &thickness, |till, gained| *till += f64::from(*gained));
        let depth = &self.ice.depth;
        par::change_at(&mut self.moraine, |cell, moraine| {
            if f64::from(depth[cell]) < MARGIN_M {
                *moraine += thickness[cell];
            }
        });
        let tangent = math::tan(self.params.repose.to_radians());
        debris::slump(&grid, &self.rock, &mut self.till, tangent, SLIDES)
    }

    /// The climate of a step, as the rise of its heights in metres.
    pub fn shift_m(&self, step: u64) -> f64 {
        climate::shift_m(&self.params, (step as f64 + 0.5) / self.steps().max(1) as f64)
    }

    /// The ground and the ice as they are, as a preview.
    pub fn glimpse(&self, job: &Job<'_>) -> Outputs {
        let wants = Wants { height: true, ice: true, ..Wants::among(orograph_graph::Wanted::NONE) };
        super::result::outputs(self, job, wants).unwrap_or_default()
    }

    /// The ice of all cells, in metres over an ice cell; the fast mode does not follow it in time.
    pub fn ice_total_m(&self) -> Option<f64> {
        let Flow::Full { sheet, .. } = &self.flow else { return None };
        Some(sheet.total_m())
    }

    /// Warns of what a user would not expect.
    fn tell(&self, job: &Job<'_>) {
        if self.params.duration > 0.0 && self.deepest_m <= THIN_M {
            job.warn(
                "no ice forms: the equilibrium line is above all ground; lower `ela` or the temperature, or raise the \
                 precipitation",
            );
        }
        if self.ledger.is_unsteady() {
            job.warn(
                "the ice is too fast for its cells, so its thickness is not to be trusted; use larger `ice_cell`, or lower \
                 `sliding`, `yield_stress` or `fastest`",
            );
        }
        let [done, prevented] = self.lowered;
        let share = prevented / (done + prevented).max(f64::MIN_POSITIVE);
        if share > NOTABLE {
            job.warn(format!(
                "the limits on the erosion of one step, {DEEPEST_M} m or less, prevented {:.0} % of it; raise `steps`, or lower \
                 `abrasion`, `plucking` or `duration`",
                100.0 * share
            ));
        }
    }
}

impl Process for Glacier {
    fn moment(&self) -> Moment {
        let (steps, end) = (self.steps(), self.params.duration.max(0.0) * SECONDS_PER_YEAR);
        let at = |done: u64| if done >= steps { end } else { end * done as f64 / steps as f64 };
        Moment { now: at(self.done), since: self.done.checked_sub(1).map(at), end }
    }

    fn step(&mut self, job: &Job<'_>) -> Result<(), NodeError> {
        if self.done >= self.steps() {
            return Ok(());
        }
        let shift_m = self.shift_m(self.done);
        self.freeze(job, shift_m)?;
        self.carve(job, shift_m)
    }

    fn outputs(&self, job: &Job<'_>) -> Result<Outputs, NodeError> {
        if self.moment().is_over() {
            self.tell(job);
        }
        super::result::outputs(self, job, Wants::of(job))
    }

    fn take(&mut self, values: &ParamValues) -> bool {
        Params::read(values) == self.params
    }
}
