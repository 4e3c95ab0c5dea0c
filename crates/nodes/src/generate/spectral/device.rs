//! The sum of waves on a graphics device: the same waves as on the CPU, and transforms in single precision.
//!
//! Columns of waves are drawn and transformed some at a time, so that they need little memory; what the world keeps of
//! them goes into pairs of rows at once.

use super::{
    Params, Power, checked,
    torus::{FADE, to_first_cell},
};
use crate::{
    numerics::fourier::device::{self, Lines, Transform, complex, over},
    prelude::*,
    wgsl,
};

/// Most complex numbers in a chunk of columns: 32 MiB.
const MOST_IN_CHUNK: usize = 1 << 22;

static SHADER: Shader = Shader {
    name: "generate/spectral",
    source: wgsl!("generate/spectral"),
    library: &[wgsl::MATH, wgsl::HASH],
    values: &[
        ("k_first", Number::U32),
        ("k_count", Number::U32),
        ("k_columns", Number::U32),
        ("k_along", Number::U32),
        ("k_down", Number::U32),
        ("k_pairs", Number::U32),
        ("k_pitch", Number::U32),
        ("k_most_south", Number::U32),
        ("k_fade", Number::F32),
        ("k_per_fade", Number::F32),
        ("k_scale", Number::F32),
        ("k_along_x", Number::F32),
        ("k_along_y", Number::F32),
        ("k_across_x", Number::F32),
        ("k_across_y", Number::F32),
        ("k_octaves", Number::F32),
        ("k_root", Number::F32),
        ("k_fall", Number::F32),
    ],
    slots: &[
        Slot::words("wavenumbers", "vec4<u32>"),
        Slot::words("columns", "vec2<f32>").updated(),
        Slot::words("rows", "vec2<f32>").updated(),
        Slot::output("height"),
    ],
};

pub(super) static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER, &device::SHADER],
    passes: Passes::Recorded(record),
    // both have the rounding errors of their transforms: they are 3e-7 of the highest place apart, 6e-7 in convolutions,
    // whose error grows with their length
    tolerance: &[Tolerance::relative(2e-6)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let params = Params::read(job.params);
    checked(job, &params)?;
    let (torus, power) = (params.torus(job.world()), Power::new(&params));
    let (nx, ny) = (job.window().nx(), job.window().ny());
    let waves = torus.waves([nx, ny], params.draw(job), &power);
    let along = Transform::new(recorder, waves.cells[0])?;
    let other = (waves.cells[1] != waves.cells[0]).then(|| Transform::new(recorder, waves.cells[1])).transpose()?;
    let down = other.as_ref().unwrap_or(&along);
    let (columns, most_south) = (waves.most(0) + 1, waves.most(1));
    let wavenumbers = (0..columns).map(|k| (k, 0)).chain((0..=most_south).map(|k| (k, 1)));
    let words: Vec<u32> = wavenumbers
        .flat_map(|(k, axis)| {
            let cells = waves.cells[axis];
            let per_cell = k as f32 * (1.0 / cells as f64) as f32;
            let [onwards, backwards] = [k as i64, -(k as i64)].map(|k| to_first_cell(k, cells));
            [((k as f64 * waves.per_m[axis]) as f32).to_bits(), per_cell.to_bits(), onwards, backwards]
        })
        .collect();
    let wavenumbers = recorder.table(&words)?;
    let (pairs, pitch) = (ny.div_ceil(2), along.room());
    let rows = [complex(recorder, pairs * pitch)?, complex(recorder, pairs * pitch)?];
    let chunk = (MOST_IN_CHUNK / down.room()).max(1).min(columns);
    let chunks = [complex(recorder, chunk * down.room())?, complex(recorder, chunk * down.room())?];
    recorder.clear(rows[0])?;
    let fade = FADE.map(|waves| waves * waves);
    let pass = |recorder: &mut dyn Recorder, entry, first: usize, count: usize, bind: &[(_, Bind)], over: Over| {
        let whole = [
            ("k_first", first),
            ("k_count", count),
            ("k_columns", columns),
            ("k_along", waves.cells[0]),
            ("k_down", waves.cells[1]),
            ("k_pairs", pairs),
            ("k_pitch", pitch),
            ("k_most_south", most_south),
        ];
        let single = [
            ("k_fade", fade[1] as f32),
            ("k_per_fade", (1.0 / (fade[1] - fade[0])) as f32),
            ("k_scale", waves.scale),
            ("k_along_x", power.along_m[0]),
            ("k_along_y", power.along_m[1]),
            ("k_across_x", power.across_m[0]),
            ("k_across_y", power.across_m[1]),
            ("k_octaves", power.octaves as f32),
            ("k_root", power.root as f32),
            ("k_fall", -power.fall as f32),
        ];
        let whole = whole.map(|(name, v)| (name, Scalar::U32(v as u32)));
        let values: Vec<_> = whole.into_iter().chain(single.map(|(name, v)| (name, Scalar::F32(v)))).collect();
        recorder.pass(&Pass { shader: &SHADER, entry, bind, values: &values, over })
    };
    for first in (0..columns).step_by(chunk) {
        let count = chunk.min(columns - first);
        let drawn = [("wavenumbers", Bind::Scratch(wavenumbers)), ("columns", Bind::Scratch(chunks[0]))];
        pass(recorder, "draw", first, count, &drawn, over(count, waves.cells[1]))?;
        let [sums, _] = down.run(recorder, chunks, Lines { count, pitch: count, down: true })?;
        let paired = [("columns", Bind::Scratch(sums)), ("rows", Bind::Scratch(rows[0]))];
        pass(recorder, "pair", first, count, &paired, over(count, pairs))?;
        job.advance(0.6 * (first + count) as f32 / columns as f32)?;
    }
    let [sums, _] = along.run(recorder, rows, Lines { count: pairs, pitch, down: false })?;
    let heights = [("rows", Bind::Scratch(sums)), ("out_height", Bind::Output("height", 0))];
    pass(recorder, "apart", 0, 0, &heights, over(nx, pairs))?;
    job.advance(1.0)
}
