//! The plate on a graphics device: transforms in single precision of a load that is averaged by halves.

use orograph_graph::gpu::{ScratchId, Size};

use super::Params;
use crate::{
    numerics::fourier::device::{self, Lines, Transform, complex, over},
    prelude::*,
    wgsl,
};

static SHADER: Shader = Shader {
    name: "tectonics/flexure",
    source: wgsl!("tectonics/flexure"),
    library: &[wgsl::MATH],
    values: &[
        ("k_wide", Number::U32),
        ("k_high", Number::U32),
        ("k_side", Number::U32),
        ("k_coarser", Number::U32),
        ("k_stiff", Number::F32),
        ("k_local", Number::F32),
    ],
    slots: &[
        Slot::input("load"),
        Slot::words("fine", "f32"),
        Slot::words("means", "f32").written(),
        Slot::words("grid", "vec2<f32>").updated(),
        Slot::output("deflection"),
    ],
};

pub(super) static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER, &device::SHADER],
    passes: Passes::Recorded(record),
    // the CPU has double precision; four transforms lose 5e-7 of the largest deflection on rough loads
    tolerance: &[Tolerance::relative(1e-6)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let plate = Params::read(job.params).plate();
    let window = job.window();
    let (coarser, side) = if plate.rigidity == 0.0 { (1, 1) } else { plate.grid(&window) };
    // from waves across the grid to radians per metre
    let per_metre = std::f64::consts::TAU / (side as f64 * coarser as f64 * job.cell_m());
    let stiff = (per_metre * per_metre * (plate.rigidity / plate.restoring).sqrt()) as f32;
    let local = (plate.local() / (side as f64 * side as f64)) as f32;
    let pass = |recorder: &mut dyn Recorder, entry, [wide, high]: [usize; 2], bound: &[(_, ScratchId)], over| {
        let whole = [("k_wide", wide), ("k_high", high), ("k_side", side), ("k_coarser", coarser)]
            .map(|(name, v)| (name, Scalar::U32(v as u32)));
        let single = [("k_stiff", stiff), ("k_local", local)].map(|(name, v)| (name, Scalar::F32(v)));
        let values: Vec<_> = whole.into_iter().chain(single).collect();
        let bind: Vec<_> = bound.iter().map(|&(name, id)| (name, Bind::Scratch(id))).collect();
        recorder.pass(&Pass { shader: &SHADER, entry, bind: &bind, values: &values, over })
    };
    let mut cells = [window.nx(), window.ny()];
    let each = Over::Cells(Rows::Around(0));
    if plate.rigidity == 0.0 {
        return pass(recorder, "float_alone", cells, &[], each);
    }
    let mut means = None;
    for _ in 0..coarser.trailing_zeros() {
        let [wide, high] = cells.map(|count| count.div_ceil(2));
        let halved = recorder.scratch(Size::Words(wide * high))?;
        let over = over(wide, high);
        match means {
            None => pass(recorder, "halve_load", cells, &[("means", halved)], over)?,
            Some(fine) => pass(recorder, "halve_means", cells, &[("fine", fine), ("means", halved)], over)?,
        }
        (cells, means) = ([wide, high], Some(halved));
    }
    let grids = [complex(recorder, side * side)?, complex(recorder, side * side)?];
    let (bound, all) = ([("grid", grids[0])], over(side, side));
    match means {
        None => pass(recorder, "place_load", cells, &bound, all)?,
        Some(fine) => pass(recorder, "place_means", cells, &[("fine", fine), bound[0]], all)?,
    }
    job.advance(0.1)?;
    let transform = Transform::new(recorder, side)?;
    let lines = |down| Lines { count: side, pitch: side, down };
    // columns without load remain 0 in both buffers
    recorder.clear(grids[1])?;
    let grids = transform.run(recorder, grids, Lines { count: cells[0], ..lines(true) })?;
    let grids = transform.run(recorder, grids, lines(false))?;
    pass(recorder, "respond", cells, &[("grid", grids[0])], all)?;
    job.advance(0.5)?;
    let grids = transform.run(recorder, grids, lines(false))?;
    let [bent, _] = transform.run(recorder, grids, lines(true))?;
    pass(recorder, "main", cells, &[("grid", bent)], each)?;
    job.advance(1.0)
}
