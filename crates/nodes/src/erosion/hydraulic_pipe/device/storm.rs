//! A storm whose state is on a device.

use std::{f32::consts::SQRT_2, iter};

use orograph_graph::{
    Edge, InputValue, Moment,
    gpu::{ScratchId, Size, Steps},
};

use super::{
    super::{
        Inputs, Params, Wants,
        band::STEPS_PER_SWEEP,
        budget::{self, Sums},
        course::Course,
        flow,
        painted::{Painted, spring_rates},
        physics::{Capacity, Physics, Scheme},
        run::Pacing,
        spread,
        storm::checked,
        warm,
    },
    BEGIN, END, VALUES, VELOCITY,
    rasters::Rasters,
};
use crate::{
    numbers::{Numbers, side},
    numerics::ledger,
    prelude::*,
};

/// The buffers that are read or replaced by name.
struct Buffers {
    rim: ScratchId,
    deepest: ScratchId,
    water: ScratchId,
    rain: ScratchId,
    change: ScratchId,
    sediment: ScratchId,
    lost: ScratchId,
    /// The terrain, once strokes have changed it.
    land: Option<ScratchId>,
}

/// A storm in progress.
pub(super) struct DeviceStorm {
    course: Course,
    physics: Physics,
    pacing: Pacing,
    rasters: Rasters,
    buffers: Buffers,
    /// Distances of the averages that spread what a sweep has eroded, in cells.
    distances: Vec<usize>,
    /// Greatest depth of water, and that before the last sweep.
    deepest_m: f32,
    before_m: f32,
    /// Terrain and rain with the strokes that have acted, from the first stroke on.
    painted: Option<Painted>,
    /// Painted rain over all land, in mm/h.
    drops_mm_h: f64,
    /// True if the terrain on the device has strokes that have not acted yet.
    is_ahead: bool,
    /// Water at the start, in metres over one cell, and painted rain, in m³.
    water_start_m: f64,
    water_painted: f64,
}

impl DeviceStorm {
    pub fn new(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<Self, NodeError> {
        let course = Course::new(job.params);
        let params = &course.params;
        let physics = checked(job, params)?;
        let boundary = job.world().boundary;
        let [nx, ny] = [job.window().nx(), job.window().ny()];
        let spring = spring_rates(job, params);
        let depths = depths(job, params)?;
        let reads_all =
            boundary.west == Edge::Periodic || boundary.north == Edge::Periodic || spring.is_some() || depths.is_some();
        let mut rasters = Rasters::new(values(&physics, job, [spring.is_some(), depths.is_some()]), reads_all);
        rasters.pace(&physics.pace(1.0));
        for (name, table) in [("spring", &spring), ("warm", &depths)] {
            if let Some(table) = table {
                let id = recorder.table(&bits(table))?;
                rasters.bind(name, id);
            }
        }
        let distances = spread::distances(spread::kept_m(physics.width_m, [nx, ny], physics.cell_m) / physics.cell_m);
        let rim = rasters.buffer(recorder, "rim", Size::Words(8 * (nx + ny)))?;
        let deepest = rasters.buffer(recorder, "deepest", Size::Words(1))?;
        recorder.clear(rim)?;
        for name in ["loose", "bed", "wet", "share", "load", "part"] {
            rasters.buffer(recorder, name, Size::Cells)?;
        }
        let water = rasters.buffer(recorder, "water", Size::Cells)?;
        let rain = rasters.buffer(recorder, "rain_of", Size::Cells)?;
        let change = rasters.zeros(recorder, "change")?;
        let sediment = rasters.zeros(recorder, "sediment")?;
        let lost = rasters.zeros(recorder, "lost")?;
        for name in ["taken", "passed", "west", "north"] {
            rasters.zeros(recorder, name)?;
        }
        if physics.scheme == Scheme::Inertial {
            rasters.buffer(recorder, "east", Size::Cells)?;
            rasters.buffer(recorder, "south", Size::Cells)?;
        }
        if !distances.is_empty() {
            for name in ["spread", "next", "hollow"] {
                rasters.buffer(recorder, name, Size::Cells)?;
            }
        }
        rasters.pass(recorder, &BEGIN, "main", 1)?;
        Ok(Self {
            course,
            physics,
            pacing: Pacing::default(),
            rasters,
            buffers: Buffers { rim, deepest, water, rain, change, sediment, lost, land: None },
            distances,
            deepest_m: depths.iter().flatten().fold(0.0_f32, |most, depth| most.max(*depth)),
            before_m: 0.0,
            painted: None,
            drops_mm_h: 0.0,
            is_ahead: false,
            water_start_m: depths.iter().flatten().map(|&depth| f64::from(depth)).sum(),
            water_painted: 0.0,
        })
    }

    /// The terrain and the rain with the strokes that have acted.
    fn painted(&self, job: &Job<'_>) -> Result<Painted, NodeError> {
        job.inputs.iter().try_for_each(InputValue::fetch)?;
        match &self.painted {
            Some(painted) => Ok(painted.clone()),
            None => Ok(Painted::new(job, &Inputs::read(job)?, &self.course.params)),
        }
    }

    /// Paints the strokes that are due.
    fn paint(&mut self, job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
        let due = self.course.due();
        if !due.is_empty() {
            let mut painted = self.painted(job)?;
            painted.paint(&self.course.params.strokes.0[due.clone()], job, self.course.fraction())?;
            self.course.acted = due.end;
            self.show_land(&painted, job, recorder)?;
            if let Some(rain) = &painted.rain {
                let rain = iter::zip(rain, painted.land(job)?);
                // as at the start, no rain falls outside of the terrain
                let rain: Vec<f32> =
                    rain.map(|(rain, land)| if budget::is_land(*land) { *rain } else { 0.0 }).collect();
                recorder.write(self.buffers.rain, &bits(&rain))?;
            }
            self.drops_mm_h = painted.drops(&painted.scene(job, self.physics)?);
            self.painted = Some(painted);
        } else if self.is_ahead {
            let painted = self.painted(job)?;
            self.show_land(&painted, job, recorder)?;
        }
        self.is_ahead = false;
        Ok(())
    }

    /// Replaces the terrain on the device where strokes have changed it.
    fn show_land(&mut self, painted: &Painted, job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
        if painted.land.is_none() && self.buffers.land.is_none() {
            return Ok(());
        }
        let land = match self.buffers.land {
            Some(land) => land,
            None => self.rasters.buffer(recorder, "height", Size::Cells)?,
        };
        self.buffers.land = Some(land);
        recorder.write(land, &bits(painted.land(job)?))?;
        self.rasters.pass(recorder, &BEGIN, "sides", 1)
    }

    /// Steps, and the balances of water and solids.
    fn report(&self, job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<Report, NodeError> {
        let Self { physics, pacing, buffers, .. } = self;
        let [nx, ny] = [job.window().nx(), job.window().ny()];
        let mut read = |id: ScratchId| recorder.read(id, nx * ny);
        let sum = |words: &[u32]| ledger::sums(words, |value| [value])[0];
        let [eroded, deposited] = ledger::sums(&read(buffers.change)?, |gain| [(-gain).max(0.0), gain.max(0.0)]);
        let sums = Sums {
            stored: sum(&read(buffers.water)?),
            eroded,
            deposited,
            suspended: sum(&read(buffers.sediment)?),
            lost: sum(&read(buffers.lost)?),
            ..Sums::default()
        };
        let rain_mm_h = match &self.painted {
            Some(painted) => budget::rain(&painted.dry_scene(job, *physics)?),
            None => sum(&read(buffers.rain)?),
        };
        let rim = recorder.read(buffers.rim, 8 * (nx + ny))?;
        let left = |from: usize| {
            let side = rim.iter().skip(from * (nx + ny)).take(2 * (nx + ny));
            side.map(|bits| f64::from(f32::from_bits(*bits))).sum::<f64>()
        };
        let sums = Sums { water_out: left(4), solid_out: left(6), ..sums };
        let cell_m2 = physics.cell_m * physics.cell_m;
        let water_in = rain_mm_h * cell_m2 * pacing.time_s / 3.6e6 + self.water_painted;
        Ok(budget::report(&sums, physics, pacing, cell_m2 * self.water_start_m, water_in))
    }
}

impl Steps for DeviceStorm {
    fn moment(&self) -> Moment {
        self.course.moment()
    }

    fn step(&mut self, job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
        let now = self.course.moment().now;
        self.paint(job, recorder)?;
        let before_s = self.pacing.time_s;
        let grown_m = (self.deepest_m - self.before_m).max(0.0);
        self.before_m = self.deepest_m;
        let sweep = self.physics.sweep(self.deepest_m + grown_m, self.course.left_s, STEPS_PER_SWEEP);
        let pace = self.physics.pace(sweep.dt_s);
        self.rasters.pace(&pace);
        recorder.clear(self.buffers.deepest)?;
        for _ in 0..sweep.steps {
            self.rasters.step(recorder, &self.physics, &pace)?;
        }
        self.rasters.settle(recorder, &self.distances)?;
        self.pacing.add(&sweep, &pace);
        let deepest = recorder.read(self.buffers.deepest, 1)?;
        self.deepest_m = deepest.first().map_or(0.0, |bits| f32::from_bits(*bits));
        // water that is not finite ends the run, and is found in the results
        self.course.left_s = if self.deepest_m.is_finite() { sweep.left_s } else { 0.0 };
        self.course.since_s = Some(now);
        let cell_m2 = self.physics.cell_m * self.physics.cell_m;
        self.water_painted += self.drops_mm_h * cell_m2 * (self.pacing.time_s - before_s) / 3.6e6;
        Ok(())
    }

    fn outputs(&mut self, job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
        let due = self.course.due();
        if !due.is_empty() || self.is_ahead {
            // strokes are seen at once, before the step in which they act, and may be taken back before it
            self.is_ahead = !due.is_empty();
            let mut painted = self.painted(job)?;
            painted.paint(&self.course.params.strokes.0[due], job, self.course.fraction())?;
            self.show_land(&painted, job, recorder)?;
        }
        let wants = Wants::of(job);
        let time_s = self.pacing.time_s;
        self.rasters.put("k_per_time", Scalar::F32(if time_s > 0.0 { (1.0 / time_s) as f32 } else { 0.0 }));
        self.rasters.pace(&self.physics.pace(1.0));
        if wants.height || wants.water || wants.sediment || wants.deposition || wants.flow {
            self.rasters.pass(recorder, &END, "main", 0)?;
        }
        if wants.velocity {
            self.rasters.pass(recorder, &VELOCITY, "main", 1)?;
        }
        if wants.report {
            let report = self.report(job, recorder)?;
            recorder.give("report", report.into());
        }
        Ok(())
    }

    fn take(&mut self, params: &ParamValues) -> bool {
        self.course.take(params)
    }
}

/// The numbers of a run by their names in the shaders: whether there is a spring, and water at the start.
fn values(physics: &Physics, job: &Job<'_>, [springs, warm]: [bool; 2]) -> Numbers {
    let boundary = job.world().boundary;
    let talus_m = (physics.talus * physics.cell_m) as f32;
    let law = match physics.law {
        Capacity::UnitPower => 0,
        Capacity::Shear => 1,
        Capacity::Speed => 2,
    };
    let mut values = Numbers::new(VALUES);
    for (name, value) in [
        ("side_west", side(boundary.west)),
        ("side_east", side(boundary.east)),
        ("side_north", side(boundary.north)),
        ("side_south", side(boundary.south)),
        ("k_highest", Scalar::F32(flow::HIGHEST)),
        ("k_dry", Scalar::F32(flow::DRY_M)),
        ("k_law", Scalar::U32(law)),
        ("k_talus", Scalar::F32(talus_m)),
        ("k_talus_diagonal", Scalar::F32(talus_m * SQRT_2)),
        ("k_springs", Scalar::U32(u32::from(springs))),
        ("k_warm", Scalar::U32(u32::from(warm))),
        ("k_distance", Scalar::I32(1)),
    ] {
        values.put(name, value);
    }
    values
}

fn bits(samples: &[f32]) -> Vec<u32> {
    samples.iter().map(|v| v.to_bits()).collect()
}

/// The depth of water at the start, where drainage is known: computed on the host, once.
fn depths(job: &Job<'_>, params: &Params) -> Result<Option<Vec<f32>>, NodeError> {
    if !job.input("flow").is_some_and(InputValue::is_wired) {
        return Ok(None);
    }
    job.inputs.iter().try_for_each(InputValue::fetch)?;
    warm::depths(job, &Inputs::read(job)?, params)
}
