//! Slides on a graphics device. The whole slide stays there if all of the terrain is loose and slopes come to rest;
//! otherwise the CPU computes first which rock fails, and which slopes are stable after `duration`.

use orograph_graph::{
    InputValue, Value,
    gpu::{ScratchId, Size},
    memory::copied,
};

use super::{Inputs, Layer, Params, Start, Sums, Until, Wants, left_of, report, warn_of_loose, warn_of_steep};
use crate::{
    numerics::repose::{
        HIGHEST,
        device::{CLOSED, GRIDS, SWEEP, Slide, padded},
        least, tangent, wraps,
    },
    prelude::*,
    wgsl,
};

static LOAD: Shader = Shader {
    name: "erosion/thermal",
    source: wgsl!("erosion/thermal"),
    library: &[wgsl::REPOSE],
    values: &[
        ("k_wide", Number::U32),
        ("k_high", Number::U32),
        ("k_tangents", Number::U32),
        ("k_highest", Number::F32),
        ("k_share", Number::F32),
        ("k_part", Number::U32),
    ],
    slots: &[
        Slot::input("height"),
        Slot::input("mask"),
        Slot::words("tangents", "f32"),
        Slot::words("land", "vec2<f32>").written(),
        Slot::words("moved", "f32"),
        Slot::words("changes", "vec2<f32>").written(),
    ],
};

static END: Shader = Shader {
    name: "erosion/thermal_end",
    source: wgsl!("erosion/thermal_end"),
    library: &[],
    values: &[
        ("k_wide", Number::U32),
        ("k_layered", Number::U32),
        ("k_share", Number::F32),
        ("k_swelling", Number::F32),
    ],
    slots: &[
        Slot::input("height"),
        Slot::words("moved", "f32"),
        Slot::words("loose", "f32"),
        Slot::words("rock", "f32"),
        Slot::output("height"),
        Slot::output("moved"),
        Slot::output("debris"),
        Slot::output("crumbled"),
    ],
};

pub(super) static GPU: GpuKernel = GpuKernel {
    shaders: &[&LOAD, &SWEEP, &GRIDS, &END],
    passes: Passes::Recorded(record),
    covers: |params| {
        let params = Params::read(params);
        params.until == Until::Equilibrium || left_of(&params) < 1.0
    },
    // sweeps end within the tolerance of slopes, sometimes one cycle sooner or later than on the CPU
    tolerance: &[
        Tolerance::relative(1e-3).except(0.02),
        Tolerance::relative(1e-3).except(0.02),
        Tolerance::relative(1e-3).except(0.02),
        Tolerance::relative(1e-5),
        Tolerance::relative(1e-3),
    ],
    ..GpuKernel::DEFAULT
};

/// What slides, on the device.
struct Loaded {
    /// Ground and rise at repose.
    land: ScratchId,
    loose: Option<Loose>,
}

/// A loose layer on rock.
struct Loose {
    /// Its thickness, with room beyond the window.
    thickness: ScratchId,
    /// Rock that has failed.
    rock: ScratchId,
    /// The least rise at repose.
    least: f32,
    /// The layer on the host.
    host: Layer,
}

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let (params, window) = (Params::read(job.params), job.window());
    let cells = [window.nx(), window.ny()];
    let wraps = wraps(&window.world.boundary);
    let has_debris = job.input("debris").is_some_and(InputValue::is_wired);
    let start = if has_debris || params.until == Until::Duration {
        uploaded(job, recorder, &params, wraps)?
    } else {
        Loaded { land: loaded(job, recorder, padded(cells, wraps))?, loose: None }
    };
    let loose = start.loose.as_ref().map(|loose| (loose.thickness, loose.least));
    let mut slide = Slide::new(recorder, (cells, wraps), (start.land, loose), params.tolerance as f32)?;
    if !slide.settle(recorder, job)? {
        warn_of_steep(job, &params);
    }
    let changes = Changes::new(job, recorder, slide.moved(), padded(cells, wraps))?;
    let [gained, lost] = changes.measure(recorder, 1.0)?;
    // gains and losses add up to nothing
    let share = if gained > 0.0 { (lost / gained) as f32 } else { 1.0 };
    let wide = Scalar::U32(padded(cells, wraps)[0] as u32);
    let moved = ("moved", Bind::Scratch(slide.moved()));
    let layer = start
        .loose
        .iter()
        .flat_map(|loose| [("loose", Bind::Scratch(loose.thickness)), ("rock", Bind::Scratch(loose.rock))]);
    recorder.pass(&Pass {
        shader: &END,
        entry: "main",
        bind: &std::iter::once(moved).chain(layer).collect::<Vec<_>>(),
        values: &[
            ("k_wide", wide),
            ("k_layered", Scalar::U32(u32::from(start.loose.is_some()))),
            ("k_share", Scalar::F32(share)),
            ("k_swelling", Scalar::F32(params.bulking as f32 - 1.0)),
        ],
        over: Over::Cells(Rows::Around(0)),
    })?;
    if Wants::of(job).report {
        let slid_m = changes.measure(recorder, share)?;
        let sums = match start.loose {
            None => Sums { slid_m, ..Sums::default() },
            Some(Loose { host, .. }) => {
                let bits = recorder.read(slide.moved(), padded(cells, wraps).iter().product())?;
                let rows = bits.chunks_exact(padded(cells, wraps)[0]).flat_map(|row| &row[..cells[0]]);
                let slid = rows.map(|bits| f32::from_bits(*bits));
                let slid = slid.map(|slid| if slid > 0.0 { slid * share } else { slid });
                let end = host.loose.iter().zip(slid).map(|(loose, slid)| f64::from((loose + slid).max(0.0)));
                Sums { slid_m, end_m: end.filter(|thickness| thickness.is_finite()).sum(), ..host.sums }
            }
        };
        recorder.give("report", report(job, params.bulking, sums).into());
    }
    Ok(())
}

/// Ground and rises at repose where everything is loose, computed on the device; only angles come from the host.
fn loaded(job: &Job<'_>, recorder: &mut dyn Recorder, [wide, high]: [usize; 2]) -> Result<ScratchId, NodeError> {
    if job.input("strata").is_some_and(InputValue::is_wired) {
        warn_of_loose(job);
    }
    let angles: Vec<f32> = match job.input("talus") {
        Some(InputValue::Value(Value::Field(field))) => {
            field.fetch()?;
            copied(field.samples())?
        }
        Some(InputValue::Constant(angle)) => vec![*angle as f32],
        _ => Vec::new(),
    };
    let tangents: Vec<u32> = angles.iter().map(|angle| tangent(*angle).to_bits()).collect();
    let tangents_of_cells = u32::from(tangents.len() == job.window().len());
    let tangents = recorder.table(&tangents)?;
    let land = recorder.scratch(Size::Words(2 * wide * high))?;
    recorder.pass(&Pass {
        shader: &LOAD,
        entry: "load",
        bind: &[("tangents", Bind::Scratch(tangents)), ("land", Bind::Scratch(land))],
        values: &values([wide, high], tangents_of_cells, 1.0),
        over: Over::Array([wide as u32, high as u32]),
    })?;
    Ok(land)
}

fn values([wide, high]: [usize; 2], tangents: u32, share: f32) -> [(&'static str, Scalar); 6] {
    [
        ("k_wide", Scalar::U32(wide as u32)),
        ("k_high", Scalar::U32(high as u32)),
        ("k_tangents", Scalar::U32(tangents)),
        ("k_highest", Scalar::F32(HIGHEST)),
        ("k_share", Scalar::F32(share)),
        ("k_part", Scalar::U32(Changes::PART)),
    ]
}

/// The same where the CPU computes what fails, and what is stable.
fn uploaded(
    job: &Job<'_>,
    recorder: &mut dyn Recorder,
    params: &Params,
    wraps: [bool; 2],
) -> Result<Loaded, NodeError> {
    job.inputs.iter().try_for_each(InputValue::fetch)?;
    let (inputs, window) = (Inputs::read(job)?, job.window());
    let cells = [window.nx(), window.ny()];
    let Start { rise, layer } = Start::new(job, &inputs, params)?;
    let closed = CLOSED.map(f32::to_bits);
    let ground = layer.as_ref().map_or(inputs.height.samples(), |layer| &layer.ground);
    let pair = |(height, rise): (&f32, &f32)| {
        if rise.is_finite() { [height.to_bits(), rise.to_bits()] } else { closed }
    };
    let pairs: Vec<[u32; 2]> = ground.iter().zip(&rise).map(pair).collect();
    let land = recorder.table(extended(&pairs, cells, wraps, closed).as_flattened())?;
    let Some(host) = layer else { return Ok(Loaded { land, loose: None }) };
    let lying = |(loose, rise): (&f32, &f32)| [if rise.is_finite() { loose.to_bits() } else { 0 }];
    let lying: Vec<[u32; 1]> = host.loose.iter().zip(&rise).map(lying).collect();
    let rock: Vec<u32> = host.crumbled.iter().map(|metres| metres.to_bits()).collect();
    let loose = Loose {
        thickness: recorder.table(extended(&lying, cells, wraps, [0]).as_flattened())?,
        rock: recorder.table(&rock)?,
        least: least(&rise),
        host,
    };
    Ok(Loaded { land, loose: Some(loose) })
}

/// Rows of a raster with the cells of [`padded`] beyond them.
fn extended<const N: usize>(
    samples: &[[u32; N]],
    cells: [usize; 2],
    wraps: [bool; 2],
    beyond: [u32; N],
) -> Vec<[u32; N]> {
    let [wide, high] = padded(cells, wraps);
    let mut all = vec![beyond; wide * high];
    for (from, to) in samples.chunks_exact(cells[0]).zip(all.chunks_exact_mut(wide)) {
        to[..cells[0]].copy_from_slice(from);
    }
    all
}

/// Sums of what cells gain and lose: of parts of rows on the device, which the host adds up.
struct Changes {
    moved: ScratchId,
    sums: ScratchId,
    /// Columns and rows of the gains.
    cells: [usize; 2],
    parts: [u32; 2],
}

impl Changes {
    /// Cells of a part of a row.
    const PART: u32 = 64;

    fn new(job: &Job<'_>, recorder: &mut dyn Recorder, moved: ScratchId, cells: [usize; 2]) -> Result<Self, NodeError> {
        let parts = [job.window.cells[0].div_ceil(Self::PART), job.window.cells[1]];
        let sums = recorder.scratch(Size::Words(2 * (parts[0] * parts[1]) as usize))?;
        Ok(Self { moved, sums, cells, parts })
    }

    /// What all cells have gained, times a share, and lost, in metres.
    fn measure(&self, recorder: &mut dyn Recorder, share: f32) -> Result<[f64; 2], NodeError> {
        recorder.pass(&Pass {
            shader: &LOAD,
            entry: "sums",
            bind: &[("moved", Bind::Scratch(self.moved)), ("changes", Bind::Scratch(self.sums))],
            values: &values(self.cells, 0, share),
            over: Over::Array(self.parts),
        })?;
        let words = recorder.read(self.sums, 2 * (self.parts[0] * self.parts[1]) as usize)?;
        Ok(words.as_chunks::<2>().0.iter().fold([0.0; 2], |[gained, lost], pair| {
            let [gain, loss] = pair.map(|bits| f64::from(f32::from_bits(bits)));
            [gained + gain, lost + loss]
        }))
    }
}
