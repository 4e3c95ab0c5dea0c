//! Ice on a graphics device: the same steps as those of a [`Sheet`](super::sheet::Sheet), in single precision.
//!
//! The device has the thickness of the ice and finds its flow; the host erodes the bed between two marches, with the
//! thickness and the fluxes that come back. So ice flows on the device for many short steps, and comes to the host once
//! in each step of erosion. The length of a step follows from the greatest change, which the host reads.

mod glacier;
mod ice;

use self::glacier::DeviceGlacier;
use super::{Method, Params};
use crate::{prelude::*, wgsl};

/// The grid, the sides, how ice flows, and the numbers of a step.
const VALUES: &[(&str, Number)] = &[
    ("k_nx", Number::U32),
    ("k_ny", Number::U32),
    ("side_west", Number::U32),
    ("side_east", Number::U32),
    ("side_north", Number::U32),
    ("side_south", Number::U32),
    ("k_dx", Number::F32),
    ("k_dy", Number::F32),
    ("k_deformation", Number::F32),
    ("k_sliding", Number::F32),
    ("k_yield", Number::F32),
    ("k_level_step", Number::U32),
    ("k_rain_step", Number::U32),
    ("k_lapse_step", Number::U32),
    ("k_entries", Number::U32),
    ("k_coldest", Number::F32),
    ("k_per_degree", Number::F32),
    ("k_datum", Number::F32),
    ("k_shift", Number::F32),
    ("k_dt", Number::F32),
    ("k_over_x", Number::F32),
    ("k_over_y", Number::F32),
    ("k_scale", Number::F32),
    ("k_columns", Number::U32),
    ("k_last", Number::U32),
];

static SIDES: Shader = Shader {
    name: "erosion/ice_sides",
    source: wgsl!("erosion/ice_sides"),
    library: &[wgsl::SIDES, wgsl::ICE],
    values: VALUES,
    slots: &[Slot::words("bed", "f32").updated(), Slot::words("thickness", "f32").updated()],
};

static BALANCE: Shader = Shader {
    name: "erosion/ice_balance",
    source: wgsl!("erosion/ice_balance"),
    library: &[wgsl::SIDES, wgsl::ICE],
    values: VALUES,
    slots: &[
        Slot::words("bed", "f32"),
        Slot::words("thickness", "f32"),
        Slot::words("levels", "f32"),
        Slot::words("rainfall", "f32"),
        Slot::words("lapse_rates", "f32"),
        Slot::words("table", "f32"),
        Slot::words("balance", "f32").written(),
    ],
};

static FACES: Shader = Shader {
    name: "erosion/ice_faces",
    source: wgsl!("erosion/ice_faces"),
    library: &[wgsl::SIDES, wgsl::ICE],
    values: VALUES,
    slots: &[
        Slot::words("bed", "f32"),
        Slot::words("thickness", "f32"),
        Slot::words("flux", "f32").written(),
        Slot::words("gain", "f32").written(),
        Slot::words("loss", "f32").written(),
    ],
};

static LINES: Shader = Shader {
    name: "erosion/ice_lines",
    source: wgsl!("erosion/ice_lines"),
    library: &[wgsl::PARTS, wgsl::SIDES, wgsl::ICE],
    values: VALUES,
    slots: &[
        Slot::words("gain", "f32"),
        Slot::words("loss", "f32"),
        Slot::words("delta", "f32").updated(),
        Slot::words("ends", "f32").updated(),
        Slot::words("ratio", "f32").updated(),
        Slot::words("flux", "f32").updated(),
    ],
};

static CHANGE: Shader = Shader {
    name: "erosion/ice_change",
    source: wgsl!("erosion/ice_change"),
    library: &[wgsl::SIDES, wgsl::ICE],
    values: VALUES,
    slots: &[
        Slot::words("thickness", "f32"),
        Slot::words("east", "f32").updated(),
        Slot::words("south", "f32").updated(),
        Slot::words("balance", "f32"),
        Slot::words("delta", "f32").updated(),
        Slot::words("next", "f32").written(),
        Slot::words("found", "atomic<u32>").updated(),
    ],
};

static ACCEPT: Shader = Shader {
    name: "erosion/ice_accept",
    source: wgsl!("erosion/ice_accept"),
    library: &[wgsl::SIDES, wgsl::ICE],
    values: VALUES,
    slots: &[
        Slot::words("next", "f32"),
        Slot::words("thickness", "f32").updated(),
        Slot::words("balance", "f32"),
        Slot::words("east", "f32"),
        Slot::words("south", "f32"),
        Slot::words("book", "f32").updated(),
    ],
};

static BOOK: Shader = Shader {
    name: "erosion/ice_book",
    source: wgsl!("erosion/ice_book"),
    library: &[],
    values: VALUES,
    slots: &[Slot::words("book", "f32"), Slot::words("sums", "f32").written()],
};

pub(super) static GPU: GpuKernel = GpuKernel {
    shaders: &[&SIDES, &BALANCE, &FACES, &LINES, &CHANGE, &ACCEPT, &BOOK],
    passes: Passes::Stepped(|job, recorder| Ok(Box::new(DeviceGlacier::new(job, recorder)?))),
    // the fast method has no steps in time, and takes a tenth of the time of the full one
    covers: |params| Params::read(params).method == Method::Full,
    ports: Ports::Host,
    // of one step of erosion; later ones depend on the last bit of the terrain
    tolerance: &[
        Tolerance::relative(5e-6).except(0.01),
        Tolerance::relative(5e-6).except(0.01),
        Tolerance::relative(5e-6).except(0.01),
        Tolerance::relative(5e-6).except(0.01),
        Tolerance::absolute(1e-3).except(0.01),
        Tolerance::relative(5e-6).except(0.01),
        Tolerance::relative(5e-6),
    ],
};
