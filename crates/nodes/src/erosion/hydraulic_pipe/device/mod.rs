//! The storm on a graphics device: the same steps as [`super::run()`], each stage a pass over all cells.
//!
//! Faces are numbered by the cell east or south of them; those on the east and the south side of the world are in the
//! `rim`, with the ghosts of the sides and what has left across them. Time steps are chosen on the host, after each
//! sweep, from the greatest depth of water.

mod rasters;
mod storm;

use self::storm::DeviceStorm;
use crate::{prelude::*, wgsl};

/// Numbers of the world's sides, of a run and of a step, for all shaders: in the order in which a storm gives them.
const VALUES: &[(&str, Number)] = &[
    ("side_west", Number::U32),
    ("side_east", Number::U32),
    ("side_north", Number::U32),
    ("side_south", Number::U32),
    ("k_highest", Number::F32),
    ("k_dry", Number::F32),
    ("k_law", Number::U32),
    ("k_talus", Number::F32),
    ("k_talus_diagonal", Number::F32),
    ("k_springs", Number::U32),
    ("k_warm", Number::U32),
    ("k_distance", Number::I32),
    ("k_per_time", Number::F32),
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
];

static BEGIN: Shader = Shader {
    name: "erosion/pipe_begin",
    source: wgsl!("erosion/pipe_begin"),
    library: &[wgsl::MATH, wgsl::SIDES, wgsl::PIPE],
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
    library: &[wgsl::MATH, wgsl::SIDES, wgsl::PIPE],
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
    library: &[wgsl::MATH, wgsl::SIDES, wgsl::PIPE, wgsl::PIPE_GHOSTS],
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
    library: &[wgsl::MATH, wgsl::SIDES, wgsl::PIPE, wgsl::PIPE_FACES],
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
    library: &[wgsl::MATH, wgsl::SIDES, wgsl::PIPE, wgsl::PIPE_GHOSTS, wgsl::PIPE_FACES],
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
    library: &[wgsl::MATH, wgsl::SIDES, wgsl::PIPE, wgsl::PIPE_FACES],
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
    library: &[wgsl::MATH, wgsl::SIDES, wgsl::PIPE],
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
    library: &[wgsl::MATH, wgsl::SIDES, wgsl::PIPE],
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
    library: &[wgsl::MATH, wgsl::SIDES, wgsl::PIPE, wgsl::PIPE_FACES],
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
    passes: Passes::Stepped(|job, recorder| Ok(Box::new(DeviceStorm::new(job, recorder)?))),
    tolerance: TOLERANCE,
    ..GpuKernel::DEFAULT
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
