//! The storm on a graphics device: the same steps as [`super::run()`], each stage a pass over all cells.
//!
//! Faces are numbered by the cell east or south of them; those on the east and the south side of the world are in the
//! `rim`, with the ghosts of the sides and what has left across them. Time steps are chosen on the host, after each
//! sweep, from the greatest depth of water.

use std::{f32::consts::SQRT_2, iter};

use orograph_graph::{
    Edge, InputValue,
    gpu::{ScratchId, Size},
};

use super::{
    Inputs, Params, Wants,
    band::STEPS_PER_SWEEP,
    budget::{self, Sums},
    painted::spring_rates,
    physics::{Capacity, Pace, Physics, Scheme, Transport},
    run::Pacing,
    spread, storm, warm,
};
use crate::{prelude::*, wgsl};

/// Numbers of a step, and of the world's sides, for all shaders.
const VALUES: &[(&str, Number)] = &[
    ("side_west", Number::U32),
    ("side_east", Number::U32),
    ("side_north", Number::U32),
    ("side_south", Number::U32),
    ("k_law", Number::U32),
    ("k_dt", Number::F32),
    ("k_step", Number::F32),
    ("k_rain", Number::F32),
    ("k_push", Number::F32),
    ("k_steepest", Number::F32),
    ("k_friction", Number::F32),
    ("k_critical", Number::F32),
    ("k_section", Number::F32),
    ("k_damping", Number::F32),
    ("k_per_film", Number::F32),
    ("k_per_deep", Number::F32),
    ("k_tilt", Number::F32),
    ("k_tilt_floor", Number::F32),
    ("k_shear", Number::F32),
    ("k_capacity", Number::F32),
    ("k_thickest", Number::F32),
    ("k_settling", Number::F32),
    ("k_entrainment", Number::F32),
    ("k_rock", Number::F32),
    ("k_acceleration", Number::F32),
    ("k_per_acceleration", Number::F32),
    ("k_most", Number::F32),
    ("k_bite", Number::F32),
    ("k_bite_deeper", Number::F32),
    ("k_evaporation", Number::F32),
    ("k_infiltration", Number::F32),
    ("k_talus", Number::F32),
    ("k_talus_diagonal", Number::F32),
    ("k_springs", Number::U32),
    ("k_warm", Number::U32),
    ("k_distance", Number::I32),
    ("k_per_time", Number::F32),
];

static BEGIN: Shader = Shader {
    name: "erosion/pipe_begin",
    source: wgsl!("erosion/pipe_begin"),
    library: &[wgsl::MATH, wgsl::PIPE],
    values: VALUES,
    slots: &[
        Slot::input("height"),
        Slot::input("rain"),
        Slot::input("regolith"),
        Slot::words("spring", "f32"),
        Slot::words("warm", "f32"),
        Slot::words("rim", "f32").updated(),
        Slot::cells("loose", "f32").written(),
        Slot::cells("rain_of", "f32").written(),
        Slot::cells("water", "f32").written(),
    ],
};

static LOAD: Shader = Shader {
    name: "erosion/pipe_load",
    source: wgsl!("erosion/pipe_load"),
    library: &[wgsl::MATH, wgsl::PIPE],
    values: VALUES,
    slots: &[
        Slot::input("height"),
        Slot::cells("change", "f32"),
        Slot::cells("water", "f32"),
        Slot::cells("rain_of", "f32"),
        Slot::cells("bed", "f32").written(),
        Slot::cells("wet", "f32").written(),
    ],
};

static WATER: Shader = Shader {
    name: "erosion/pipe_water",
    source: wgsl!("erosion/pipe_water"),
    library: &[wgsl::MATH, wgsl::PIPE, wgsl::PIPE_GHOSTS],
    values: VALUES,
    slots: &[
        Slot::cells("bed", "f32"),
        Slot::cells("wet", "f32"),
        Slot::cells("west", "f32").updated(),
        Slot::cells("north", "f32").updated(),
        Slot::words("rim", "f32").updated(),
        Slot::cells("east", "f32").updated(),
        Slot::cells("south", "f32").updated(),
    ],
};

static LIMIT: Shader = Shader {
    name: "erosion/pipe_limit",
    source: wgsl!("erosion/pipe_limit"),
    library: &[wgsl::MATH, wgsl::PIPE, wgsl::PIPE_FACES],
    values: VALUES,
    slots: &[
        Slot::cells("wet", "f32"),
        Slot::cells("share", "f32").updated(),
        Slot::cells("west", "f32").updated(),
        Slot::cells("north", "f32").updated(),
        Slot::words("rim", "f32").updated(),
    ],
};

static EXCHANGE: Shader = Shader {
    name: "erosion/pipe_exchange",
    source: wgsl!("erosion/pipe_exchange"),
    library: &[wgsl::MATH, wgsl::PIPE, wgsl::PIPE_GHOSTS, wgsl::PIPE_FACES],
    values: VALUES,
    slots: &[
        Slot::input("erodibility"),
        Slot::cells("bed", "f32"),
        Slot::cells("wet", "f32"),
        Slot::cells("west", "f32"),
        Slot::cells("north", "f32"),
        Slot::words("rim", "f32").updated(),
        Slot::cells("sediment", "f32"),
        Slot::cells("water", "f32").written(),
        Slot::cells("passed", "f32").updated(),
        Slot::cells("change", "f32").updated(),
        Slot::cells("loose", "f32").updated(),
        Slot::cells("taken", "f32").updated(),
        Slot::cells("load", "f32").written(),
        Slot::cells("part", "f32").written(),
        Slot::words("deepest", "atomic<u32>").updated(),
    ],
};

static CARRY: Shader = Shader {
    name: "erosion/pipe_carry",
    source: wgsl!("erosion/pipe_carry"),
    library: &[wgsl::MATH, wgsl::PIPE, wgsl::PIPE_FACES],
    values: VALUES,
    slots: &[
        Slot::cells("wet", "f32"),
        Slot::cells("west", "f32"),
        Slot::cells("north", "f32"),
        Slot::words("rim", "f32"),
        Slot::cells("load", "f32"),
        Slot::cells("part", "f32").updated(),
        Slot::cells("water", "f32").updated(),
        Slot::cells("sediment", "f32").written(),
        Slot::cells("lost", "f32").updated(),
    ],
};

static SPREAD: Shader = Shader {
    name: "erosion/pipe_spread",
    source: wgsl!("erosion/pipe_spread"),
    library: &[wgsl::MATH, wgsl::PIPE],
    values: VALUES,
    slots: &[
        Slot::input("height"),
        Slot::input("erodibility"),
        Slot::cells("change", "f32"),
        Slot::cells("taken", "f32"),
        Slot::cells("bed", "f32").updated(),
        Slot::cells("spread", "f32").updated(),
        Slot::cells("hollow", "f32").updated(),
        Slot::cells("next", "f32").written(),
    ],
};

static SLIP: Shader = Shader {
    name: "erosion/pipe_slip",
    source: wgsl!("erosion/pipe_slip"),
    library: &[wgsl::MATH, wgsl::PIPE],
    values: VALUES,
    slots: &[
        Slot::input("height"),
        Slot::cells("spread", "f32"),
        Slot::cells("bed", "f32").updated(),
        Slot::cells("share", "f32").updated(),
        Slot::cells("change", "f32").updated(),
        Slot::cells("loose", "f32").updated(),
        Slot::cells("taken", "f32").updated(),
    ],
};

static END: Shader = Shader {
    name: "erosion/pipe_end",
    source: wgsl!("erosion/pipe_end"),
    library: &[],
    values: &[("k_per_time", Number::F32)],
    slots: &[
        Slot::input("height"),
        Slot::cells("change", "f32"),
        Slot::cells("water", "f32"),
        Slot::cells("sediment", "f32"),
        Slot::cells("passed", "f32"),
        Slot::output("height"),
        Slot::output("water"),
        Slot::output("sediment"),
        Slot::output("deposition"),
        Slot::output("flow"),
    ],
};

static VELOCITY: Shader = Shader {
    name: "erosion/pipe_velocity",
    source: wgsl!("erosion/pipe_velocity"),
    library: &[wgsl::MATH, wgsl::PIPE, wgsl::PIPE_FACES],
    values: VALUES,
    slots: &[
        Slot::cells("water", "f32"),
        Slot::cells("west", "f32"),
        Slot::cells("north", "f32"),
        Slot::words("rim", "f32"),
        Slot::output("velocity"),
        Slot::output("velocity").plane(1),
    ],
};

pub(super) static GPU: GpuKernel = GpuKernel {
    shaders: &[&BEGIN, &LOAD, &WATER, &LIMIT, &EXCHANGE, &CARRY, &SPREAD, &SLIP, &END, &VELOCITY],
    passes: Passes::Recorded(record),
    // strokes are painted on the host
    covers: |params| Params::read(params).strokes.0.is_empty(),
    tolerance: TOLERANCE,
};

/// Those of a few steps, with room for devices that round fewer operations than the CPU: the longer a run, the farther
/// apart are two that differ in the last bit. The last is that of the balances.
const TOLERANCE: &[Tolerance] = &[
    Tolerance::relative(1e-6).except(0.01),
    Tolerance::absolute(1e-4).except(0.01),
    Tolerance::absolute(1e-3).except(0.01),
    Tolerance::absolute(1e-5).except(0.01),
    Tolerance::relative(1e-6).except(0.01),
    Tolerance::absolute(1e-3).except(0.01),
    Tolerance::relative(1e-5),
];

/// Rasters of a run.
struct Device<'r> {
    recorder: &'r mut dyn Recorder,
    /// All buffers by the names of their variables.
    buffers: Vec<(&'static str, Bind)>,
    /// Numbers of the run, and of the step.
    values: Vec<(&'static str, Scalar)>,
    /// Passes in a periodic world, or with tables of all cells, read any row.
    reads_all: bool,
}

impl Device<'_> {
    fn buffer(&mut self, name: &'static str, size: Size) -> Result<ScratchId, NodeError> {
        let id = self.recorder.scratch(size)?;
        self.buffers.push((name, Bind::Scratch(id)));
        Ok(id)
    }

    /// A pass in which a cell reads that many rows around its own.
    fn pass(&mut self, shader: &'static Shader, entry: &'static str, around: u32) -> Result<(), NodeError> {
        let rows = if self.reads_all { Rows::All } else { Rows::Around(around) };
        let (bind, values) = (&self.buffers, &self.values);
        self.recorder.pass(&Pass { shader, entry, bind, values, over: Over::Cells(rows) })
    }

    /// Changes a number.
    fn put(&mut self, name: &'static str, value: Scalar) {
        self.values.retain(|(known, _)| *known != name);
        self.values.push((name, value));
    }

    fn pace(&mut self, pace: &Pace) {
        for (name, value) in floats(pace) {
            self.put(name, Scalar::F32(value));
        }
    }

    /// What a step does.
    fn step(&mut self, physics: &Physics, pace: &Pace) -> Result<(), NodeError> {
        self.pass(&LOAD, "main", 0)?;
        match physics.scheme {
            Scheme::Inertial => {
                self.pass(&WATER, "drive", 2)?;
                self.pass(&WATER, "rub", 2)?;
            }
            Scheme::Pipes => self.pass(&WATER, "pipes", 2)?,
        }
        self.pass(&LIMIT, "supply", 1)?;
        self.pass(&LIMIT, "main", 1)?;
        self.pass(&EXCHANGE, "main", 1)?;
        match physics.transport {
            Transport::Upwind => self.pass(&CARRY, "upwind", 1)?,
            Transport::SemiLagrangian => self.pass(&CARRY, "trace", 1)?,
            Transport::MacCormack => {
                self.pass(&CARRY, "predict", 1)?;
                self.pass(&CARRY, "correct", 1)?;
            }
        }
        if pace.dries() {
            self.pass(&CARRY, "dry", 0)?;
        }
        Ok(())
    }

    /// Spreads what a sweep has eroded, and lets ground slide.
    fn settle(&mut self, distances: &[usize]) -> Result<(), NodeError> {
        if !distances.is_empty() {
            self.pass(&SPREAD, "gather", 0)?;
            self.pass(&SPREAD, "mark", 1)?;
            for &distance in distances {
                self.put("k_distance", Scalar::I32(i32::try_from(distance).unwrap_or(i32::MAX)));
                self.pass(&SPREAD, "average", u32::try_from(distance).unwrap_or(u32::MAX))?;
                for (name, _) in &mut self.buffers {
                    *name = match *name {
                        "spread" => "next",
                        "next" => "spread",
                        other => other,
                    };
                }
            }
            self.pass(&SLIP, "replace", 0)?;
        }
        self.pass(&SLIP, "level", 0)?;
        self.pass(&SLIP, "supply", 1)?;
        self.pass(&SLIP, "apply", 1)
    }
}

/// The numbers of a step by their names in the shaders.
fn floats(pace: &Pace) -> [(&'static str, f32); 26] {
    [
        ("k_dt", pace.dt_s),
        ("k_step", pace.step),
        ("k_rain", pace.rain_m),
        ("k_push", pace.push),
        ("k_steepest", pace.steepest_m),
        ("k_friction", pace.friction),
        ("k_critical", pace.critical),
        ("k_section", pace.section_m),
        ("k_damping", pace.damping),
        ("k_per_film", pace.per_film),
        ("k_per_deep", pace.per_deep),
        ("k_tilt", pace.tilt),
        ("k_tilt_floor", pace.tilt_floor),
        ("k_shear", pace.shear),
        ("k_capacity", pace.capacity),
        ("k_thickest", pace.thickest),
        ("k_settling", pace.settling),
        ("k_entrainment", pace.entrainment),
        ("k_rock", pace.rock),
        ("k_acceleration", pace.acceleration),
        ("k_per_acceleration", pace.per_acceleration),
        ("k_most", pace.most_m),
        ("k_bite", pace.bite_m[0]),
        ("k_bite_deeper", pace.bite_m[1]),
        ("k_evaporation", pace.evaporation),
        ("k_infiltration", pace.infiltration_m),
    ]
}

/// A side of the world as the shaders number it.
const fn side(edge: Edge) -> Scalar {
    Scalar::U32(match edge {
        Edge::Open | Edge::Inland => 0,
        Edge::Base => 1,
        Edge::Wall => 2,
        Edge::Periodic => 3,
    })
}

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let params = storm::read(job.params);
    let physics = storm::checked(job, &params)?;
    let boundary = job.world().boundary;
    let [nx, ny] = [job.window().nx(), job.window().ny()];
    let wants = Wants::of(job);
    let spring = spring_rates(job, &params);
    let depths = depths(job, &params)?;
    let reads_all =
        boundary.west == Edge::Periodic || boundary.north == Edge::Periodic || spring.is_some() || depths.is_some();
    let talus_m = (physics.talus * physics.cell_m) as f32;
    let law = match physics.law {
        Capacity::UnitPower => 0,
        Capacity::Shear => 1,
        Capacity::Speed => 2,
    };
    let values = vec![
        ("side_west", side(boundary.west)),
        ("side_east", side(boundary.east)),
        ("side_north", side(boundary.north)),
        ("side_south", side(boundary.south)),
        ("k_law", Scalar::U32(law)),
        ("k_talus", Scalar::F32(talus_m)),
        ("k_talus_diagonal", Scalar::F32(talus_m * SQRT_2)),
        ("k_springs", Scalar::U32(u32::from(spring.is_some()))),
        ("k_warm", Scalar::U32(u32::from(depths.is_some()))),
        ("k_distance", Scalar::I32(1)),
        ("k_per_time", Scalar::F32(0.0)),
    ];
    let mut device = Device { recorder, buffers: Vec::new(), values, reads_all };
    device.pace(&physics.pace(1.0));
    for (name, table) in [("spring", &spring), ("warm", &depths)] {
        if let Some(table) = table {
            let words: Vec<u32> = table.iter().map(|v| v.to_bits()).collect();
            let id = device.recorder.table(&words)?;
            device.buffers.push((name, Bind::Scratch(id)));
        }
    }
    let distances = spread::distances(spread::kept_m(physics.width_m, [nx, ny], physics.cell_m) / physics.cell_m);
    let rim = device.buffer("rim", Size::Words(8 * (nx + ny)))?;
    let deepest = device.buffer("deepest", Size::Words(1))?;
    device.recorder.clear(rim)?;
    for name in ["loose", "bed", "wet", "share", "load", "part"] {
        device.buffer(name, Size::Cells)?;
    }
    let water = device.buffer("water", Size::Cells)?;
    let rain = device.buffer("rain_of", Size::Cells)?;
    let mut zeroed = |name| {
        let id = device.buffer(name, Size::Cells)?;
        device.recorder.clear(id).map(|()| id)
    };
    let [change, sediment, lost] = [zeroed("change")?, zeroed("sediment")?, zeroed("lost")?];
    for name in ["taken", "passed", "west", "north"] {
        zeroed(name)?;
    }
    if physics.scheme == Scheme::Inertial {
        device.buffer("east", Size::Cells)?;
        device.buffer("south", Size::Cells)?;
    }
    if !distances.is_empty() {
        for name in ["spread", "next", "hollow"] {
            device.buffer(name, Size::Cells)?;
        }
    }
    device.pass(&BEGIN, "main", 1)?;

    let mut pacing = Pacing::default();
    let mut left_s = params.duration;
    let mut before_m = 0.0;
    let mut deepest_m = depths.iter().flatten().fold(0.0_f32, |most, depth| most.max(*depth));
    // water that is not finite ends the run, and is found in the results
    while left_s > 0.0 && deepest_m.is_finite() {
        let grown_m = (deepest_m - before_m).max(0.0);
        before_m = deepest_m;
        let sweep = physics.sweep(deepest_m + grown_m, left_s, STEPS_PER_SWEEP);
        let pace = physics.pace(sweep.dt_s);
        device.pace(&pace);
        device.recorder.clear(deepest)?;
        for _ in 0..sweep.steps {
            device.step(&physics, &pace)?;
        }
        device.settle(&distances)?;
        pacing.add(&sweep, &pace);
        left_s = sweep.left_s;
        deepest_m = device.recorder.read(deepest, 1)?.first().map_or(0.0, |bits| f32::from_bits(*bits));
        job.advance((1.0 - left_s / params.duration) as f32)?;
    }

    let per_time = if pacing.time_s > 0.0 { (1.0 / pacing.time_s) as f32 } else { 0.0 };
    device.put("k_per_time", Scalar::F32(per_time));
    device.pace(&physics.pace(1.0));
    if wants.height || wants.water || wants.sediment || wants.deposition || wants.flow {
        device.pass(&END, "main", 0)?;
    }
    if wants.velocity {
        device.pass(&VELOCITY, "main", 1)?;
    }
    if !wants.report {
        return Ok(());
    }
    let cells = nx * ny;
    let mut sum = |id: ScratchId, part: &dyn Fn(f64) -> f64| {
        let words = device.recorder.read(id, cells)?;
        Ok::<f64, NodeError>(words.iter().map(|bits| part(f64::from(f32::from_bits(*bits)))).sum())
    };
    let sums = Sums {
        stored: sum(water, &|depth| depth)?,
        eroded: sum(change, &|gain| (-gain).max(0.0))?,
        deposited: sum(change, &|gain| gain.max(0.0))?,
        suspended: sum(sediment, &|depth| depth)?,
        lost: sum(lost, &|depth| depth)?,
        ..Sums::default()
    };
    let rain_mm_h = sum(rain, &|rain| rain)?;
    let rim = device.recorder.read(rim, 8 * (nx + ny))?;
    let left = |from: usize| {
        let side = rim.iter().skip(from * (nx + ny)).take(2 * (nx + ny));
        side.map(|bits| f64::from(f32::from_bits(*bits))).sum::<f64>()
    };
    let sums = Sums { water_out: left(4), solid_out: left(6), ..sums };
    let cell_m2 = physics.cell_m * physics.cell_m;
    let water_start = cell_m2 * depths.iter().flatten().map(|&depth| f64::from(depth)).sum::<f64>();
    let water_in = rain_mm_h * cell_m2 * pacing.time_s / 3.6e6;
    let report = budget::report(&sums, &physics, &pacing, water_start, water_in);
    device.recorder.give("report", report.into());
    Ok(())
}

/// The depth of water at the start, where drainage is known.
fn depths(job: &Job<'_>, params: &Params) -> Result<Option<Vec<f32>>, NodeError> {
    let is_wired = |name: &str| {
        let mut inputs = iter::zip(job.node.inputs, &job.inputs);
        inputs.any(|(input, value)| input.name == name && matches!(value, InputValue::Value(_)))
    };
    if !is_wired("flow") {
        return Ok(None);
    }
    // computed on the host, once
    for input in &job.inputs {
        if let InputValue::Value(value) = input {
            value.fetch().map_err(|error| NodeError::failed(error.0))?;
        }
    }
    warm::depths(job, &Inputs::read(job)?, params)
}
