//! Creep on a graphics device: the same implicit steps as the module `hillslope`.
//!
//! The state is what cells have gained, so that small changes are not lost on high ground. Steps are solved for the gain
//! where cells of a step change little. Where a step mixes many cells, the flows between them would cancel out with
//! large rounding errors, and it is solved for the heights.
//!
//! A workgroup solves eight lines beside each other in 32 parts. So that its invocations read cells beside each other,
//! steps along rows have rasters with rows and columns exchanged.

use orograph_graph::{
    Edge, InputValue,
    gpu::{ScratchId, Size},
};

use super::{Inputs, Params, Wants, balance, steps};
use crate::{
    numerics::{
        hillslope::{EXPLICIT, GIVEN_M, HIGHEST_M, Hillslope, MOST_MOBILE, STEEPEST},
        ledger,
        repose::wraps,
    },
    prelude::*,
    wgsl,
};

/// D Δt / d² of a step above which it is solved for heights.
const FAR: f64 = 16.0;
/// Rows and columns that a workgroup exchanges.
const TURNED: [u32; 2] = [32; 2];

static LINES: Shader = Shader {
    name: "erosion/creep",
    source: wgsl!("erosion/creep"),
    library: &[wgsl::PARTS, wgsl::CREEP_FACES, wgsl::CREEP_PARTS],
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

static TURN: Shader = Shader {
    name: "erosion/creep_turn",
    source: wgsl!("erosion/creep_turn"),
    library: &[],
    values: &[("k_back", Number::U32), ("k_adds", Number::U32)],
    slots: &[Slot::cells("solved", "f32"), Slot::cells("moved", "f32"), Slot::cells("turned", "f32").written()],
};

pub(super) static GPU: GpuKernel = GpuKernel {
    shaders: &[&LINES, &ADD, &TURN],
    passes: Passes::Recorded(record),
    // sums along lines in single precision, in up to 128 passes; the last is that of the balance
    tolerance: &[Tolerance::relative(2e-6), Tolerance::relative(2e-6), Tolerance::relative(1e-5)],
    ..GpuKernel::DEFAULT
};

/// The rasters of steps along rows, which are turned, and along columns.
struct Rasters {
    /// What is bound to the slots of inputs.
    inputs: [Vec<(&'static str, Bind)>; 2],
    moved: [ScratchId; 2],
    solved: ScratchId,
    far: u32,
}

impl Rasters {
    /// Turns the inputs, if any step is made.
    fn new(job: &Job<'_>, recorder: &mut dyn Recorder, far: u32, is_still: bool) -> Result<Self, NodeError> {
        let mut raster = || recorder.scratch(Size::Cells);
        let [solved, columns] = [raster()?, raster()?];
        let rows = if is_still { columns } else { raster()? };
        let mut rasters = Self { inputs: [Vec::new(), Vec::new()], moved: [rows, columns], solved, far };
        for name in ["height", "diffusivity"] {
            if !is_still && job.input(name).is_some_and(InputValue::is_wired) {
                let turned = recorder.scratch(Size::Cells)?;
                rasters.turn(
                    recorder,
                    [("solved", Bind::Input(name, 0)), ("turned", Bind::Scratch(turned))],
                    [0, 0],
                )?;
                rasters.inputs[0].push((name, Bind::Scratch(turned)));
            }
        }
        Ok(rasters)
    }

    fn turn<const N: usize>(
        &self,
        recorder: &mut dyn Recorder,
        bind: [(&'static str, Bind); N],
        [back, adds]: [u32; 2],
    ) -> Result<(), NodeError> {
        recorder.pass(&Pass {
            shader: &TURN,
            entry: "turn",
            bind: &bind,
            values: &[("k_back", Scalar::U32(back)), ("k_adds", Scalar::U32(adds))],
            over: Over::Tiles(TURNED, Rows::All),
        })
    }

    fn add(&self, recorder: &mut dyn Recorder, entry: &'static str, moved: ScratchId) -> Result<(), NodeError> {
        recorder.pass(&Pass {
            shader: &ADD,
            entry,
            bind: &[("solved", Bind::Scratch(self.solved)), ("moved", Bind::Scratch(moved))],
            values: &[("k_far", Scalar::U32(self.far))],
            over: Over::Cells(Rows::Around(0)),
        })
    }

    /// Takes over what was solved for along rows (0) or columns (1), for what is solved next.
    fn take(&self, recorder: &mut dyn Recorder, along: usize, next: usize) -> Result<(), NodeError> {
        let [moved, turned] = [self.moved[along], self.moved[next]];
        if along == next {
            return self.add(recorder, "add", moved);
        }
        let bind = [("solved", self.solved), ("moved", moved), ("turned", turned)];
        self.turn(recorder, bind.map(|(name, id)| (name, Bind::Scratch(id))), [next as u32, 1 - self.far])
    }
}

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let (params, window) = (Params::read(job.params), job.window());
    let mobility = mobility(job, &params)?;
    let steps = steps(mobility);
    let per_diffusivity = params.duration / f64::from(steps.max(1)) / (job.cell_m() * job.cell_m());
    let far = u32::from(mobility / f64::from(steps.max(1)) > FAR);
    let [nx, ny] = window.cells;
    let rasters = Rasters::new(job, recorder, far, steps == 0)?;
    let [ratio, ends] = [recorder.scratch(Size::Cells)?, recorder.scratch(Size::Cells)?];
    let left = recorder.scratch(Size::Words(2 * (nx + ny) as usize))?;
    recorder.clear(left)?;
    // rows first in every other step; outputs are not turned
    let mut order: Vec<usize> =
        (0..steps).flat_map(|step| if step.is_multiple_of(2) { [0, 1] } else { [1, 0] }).collect();
    order.push(1);
    recorder.clear(rasters.moved[order[0]])?;
    let values = values(job, per_diffusivity, far);
    for (number, pair) in order.windows(2).enumerate() {
        let &[along, next] = pair else { continue };
        let of_line = [
            ("moved", rasters.moved[along]),
            ("solved", rasters.solved),
            ("ratio", ratio),
            ("ends", ends),
            ("left", left),
        ];
        let bind: Vec<_> = of_line.map(|(name, id)| (name, Bind::Scratch(id))).to_vec();
        recorder.pass(&Pass {
            shader: &LINES,
            entry: "lines",
            bind: &[&bind[..], &rasters.inputs[along]].concat(),
            values: &[&[("k_columns", Scalar::U32(along as u32))][..], &values].concat(),
            over: Over::Groups([[ny, nx][along].div_ceil(wgsl::LINES_TOGETHER), 1, 1]),
        })?;
        rasters.take(recorder, along, next)?;
        job.advance((number / 2 + 1) as f32 / steps as f32)?;
    }
    let moved = rasters.moved[1];
    rasters.add(recorder, "main", moved)?;
    if Wants::of(job).report {
        report(job, recorder, moved, (far == 0).then_some(left))?;
    }
    Ok(())
}

/// The numbers of [`LINES`], but for the direction of lines.
fn values(job: &Job<'_>, per_diffusivity: f64, far: u32) -> Vec<(&'static str, Scalar)> {
    let boundary = job.window().world.boundary;
    let [west, east, north, south] = [boundary.west, boundary.east, boundary.north, boundary.south].map(side);
    let joined = wraps(&boundary).map(u32::from);
    let whole = [("k_far", far), ("k_wraps_x", joined[0]), ("k_wraps_y", joined[1])];
    let single = [
        ("k_per_diffusivity", per_diffusivity),
        ("k_highest", HIGHEST_M),
        ("k_most_mobile", MOST_MOBILE),
        ("k_explicit", EXPLICIT),
        ("k_steepest", STEEPEST),
        ("k_given", GIVEN_M),
    ];
    let sides = [("k_west", west), ("k_east", east), ("k_north", north), ("k_south", south)];
    let whole = whole.map(|(name, v)| (name, Scalar::U32(v)));
    let single = single.map(|(name, v)| (name, Scalar::F32(v as f32)));
    whole.into_iter().chain(single).chain(sides).collect()
}

/// Gives the balance. `left` is what crossed the ends of lines, if steps were solved for gains.
fn report(
    job: &Job<'_>,
    recorder: &mut dyn Recorder,
    moved: ScratchId,
    left: Option<ScratchId>,
) -> Result<(), NodeError> {
    let window = job.window();
    let [settled, eroded] = ledger::sums(&recorder.read(moved, window.len())?, ledger::gain_and_loss);
    let boundary = window.world.boundary;
    let is_closed = ![boundary.west, boundary.east, boundary.north, boundary.south]
        .iter()
        .any(|edge| matches!(edge, Edge::Open | Edge::Inland | Edge::Base));
    let left: f64 = match left {
        Some(left) => ledger::sums(&recorder.read(left, 2 * (window.nx() + window.ny()))?, |metres| [metres])[0],
        None if is_closed => 0.0,
        // sides at base level may give more than they get; flows from side to side, far above what leaves, would round
        // the sum at the ends of lines
        None => eroded - settled,
    };
    recorder.give("report", balance(job, [settled, eroded], left).into());
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
        Edge::Open | Edge::Inland => 0,
        Edge::Base => 1,
        Edge::Wall | Edge::Periodic => 2,
    })
}
