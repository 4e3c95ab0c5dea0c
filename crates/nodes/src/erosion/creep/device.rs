//! Creep on a graphics device: the same implicit steps as the module `hillslope`, one invocation for each line.
//!
//! The state is what cells have gained, so that small changes are not lost on high ground. Steps are solved for the gain
//! where cells of a step change little. Where a step mixes many cells, the flows between them would cancel out with
//! large rounding errors, and it is solved for the heights.

use orograph_graph::{
    Edge, InputValue,
    gpu::{Size, WORKGROUP},
};

use super::{Inputs, Params, Wants, balance, steps};
use crate::{
    numerics::{
        hillslope::{EXPLICIT, GIVEN_M, HIGHEST_M, Hillslope, MOST_MOBILE, STEEPEST},
        ledger,
        repose::wraps,
    },
    prelude::*,
};

/// D Δt / d² of a step above which it is solved for heights.
const FAR: f64 = 16.0;

static LINES: Shader = Shader {
    name: "erosion/creep",
    source: wgsl!("erosion/creep"),
    library: &[],
    values: &[
        ("k_columns", Number::U32),
        ("k_far", Number::U32),
        ("k_per_diffusivity", Number::F32),
        ("k_highest", Number::F32),
        ("k_most_mobile", Number::F32),
        ("k_explicit", Number::F32),
        ("k_steepest", Number::F32),
        ("k_given", Number::F32),
        ("k_wraps_x", Number::U32),
        ("k_wraps_y", Number::U32),
        ("k_west", Number::U32),
        ("k_east", Number::U32),
        ("k_north", Number::U32),
        ("k_south", Number::U32),
    ],
    slots: &[
        Slot::input("height"),
        Slot::input("diffusivity"),
        Slot::cells("moved", "f32"),
        Slot::cells("solved", "f32").updated(),
        Slot::cells("ratio", "f32").updated(),
        Slot::cells("ends", "f32").updated(),
        Slot::words("left", "f32").updated(),
    ],
};

static ADD: Shader = Shader {
    name: "erosion/creep_add",
    source: wgsl!("erosion/creep_add"),
    library: &[],
    values: &[("k_far", Number::U32)],
    slots: &[
        Slot::input("height"),
        Slot::cells("solved", "f32"),
        Slot::cells("moved", "f32").updated(),
        Slot::output("height"),
        Slot::output("moved"),
    ],
};

pub(super) static GPU: GpuKernel = GpuKernel {
    shaders: &[&LINES, &ADD],
    passes: Passes::Recorded(record),
    // sums along lines in single precision, in up to 128 passes; the last is that of the balance
    tolerance: &[Tolerance::relative(2e-6), Tolerance::relative(2e-6), Tolerance::relative(1e-5)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let (params, window) = (Params::read(job.params), job.window());
    let mobility = mobility(job, &params)?;
    let steps = steps(mobility);
    let per_diffusivity = params.duration / f64::from(steps.max(1)) / (job.cell_m() * job.cell_m());
    let far = u32::from(mobility / f64::from(steps.max(1)) > FAR);
    let [nx, ny] = window.cells;
    let joined = wraps(&window.world.boundary);
    let mut raster = || recorder.scratch(Size::Cells);
    let [moved, solved, ratio] = [raster()?, raster()?, raster()?];
    let ends = joined.contains(&true).then(|| recorder.scratch(Size::Cells)).transpose()?;
    let left = recorder.scratch(Size::Words(2 * (nx + ny) as usize))?;
    recorder.clear(moved)?;
    recorder.clear(left)?;
    let of_line = [("moved", moved), ("solved", solved), ("ratio", ratio), ("left", left)];
    let bind: Vec<(&'static str, Bind)> = of_line
        .into_iter()
        .chain(ends.map(|ends| ("ends", ends)))
        .map(|(name, id)| (name, Bind::Scratch(id)))
        .collect();
    let boundary = window.world.boundary;
    let [west, east, north, south] = [boundary.west, boundary.east, boundary.north, boundary.south].map(side);
    let whole = [("k_far", far), ("k_wraps_x", u32::from(joined[0])), ("k_wraps_y", u32::from(joined[1]))];
    let single = [
        ("k_per_diffusivity", per_diffusivity),
        ("k_highest", HIGHEST_M),
        ("k_most_mobile", MOST_MOBILE),
        ("k_explicit", EXPLICIT),
        ("k_steepest", STEEPEST),
        ("k_given", GIVEN_M),
    ];
    let sides = [("k_west", west), ("k_east", east), ("k_north", north), ("k_south", south)];
    let values: Vec<_> = whole
        .map(|(name, v)| (name, Scalar::U32(v)))
        .into_iter()
        .chain(single.map(|(name, v)| (name, Scalar::F32(v as f32))))
        .chain(sides)
        .collect();
    let add = |recorder: &mut dyn Recorder, entry| {
        recorder.pass(&Pass {
            shader: &ADD,
            entry,
            bind: &[("solved", Bind::Scratch(solved)), ("moved", Bind::Scratch(moved))],
            values: &[("k_far", Scalar::U32(far))],
            over: Over::Cells(Rows::Around(0)),
        })
    };
    for step in 0..steps {
        // rows first in every other step
        for columns in if step.is_multiple_of(2) { [0, 1] } else { [1, 0] } {
            let lines = if columns == 0 { ny } else { nx };
            recorder.pass(&Pass {
                shader: &LINES,
                entry: "lines",
                bind: &bind,
                values: &[&[("k_columns", Scalar::U32(columns))][..], &values].concat(),
                over: Over::Groups([lines.div_ceil(WORKGROUP), 1, 1]),
            })?;
            add(recorder, "add")?;
        }
        job.advance((step + 1) as f32 / steps as f32)?;
    }
    add(recorder, "main")?;
    if Wants::of(job).report {
        let metres = |recorder: &mut dyn Recorder, id, count: usize| {
            let words = recorder.read(id, count)?;
            Ok::<_, NodeError>(words.into_iter().map(|bits| f64::from(f32::from_bits(bits))).collect::<Vec<_>>())
        };
        let [settled, eroded] = ledger::gains_and_losses(metres(recorder, moved, window.len())?.into_iter());
        let is_closed = ![boundary.west, boundary.east, boundary.north, boundary.south]
            .iter()
            .any(|edge| matches!(edge, Edge::Open | Edge::Base));
        let left: f64 = match far {
            0 => metres(recorder, left, 2 * (nx + ny) as usize)?.into_iter().sum(),
            _ if is_closed => 0.0,
            // sides at base level may give more than they get; flows from side to side, far above what leaves, would round
            // the sum at the ends of lines
            _ => eroded - settled,
        };
        recorder.give("report", balance(job, [settled, eroded], left).into());
    }
    Ok(())
}

/// The largest D Δt / d² of a cell over the whole run, from all cells on the host.
fn mobility(job: &Job<'_>, params: &Params) -> Result<f64, NodeError> {
    job.input("diffusivity").map_or(Ok(()), InputValue::fetch)?;
    let diffusivity = Inputs::read(job)?.diffusivity;
    Ok(Hillslope::new(&job.window(), diffusivity, params.critical_slope).mobility(params.duration))
}

/// The number of a side in the shader.
fn side(edge: Edge) -> Scalar {
    Scalar::U32(match edge {
        Edge::Open => 0,
        Edge::Base => 1,
        Edge::Wall | Edge::Periodic | Edge::Inland => 2,
    })
}
