//! Shaded relief on a graphics device: light from the slopes and horizons, then one plane of colour after the other.

use orograph_graph::gpu::{ScratchId, Size};

use super::{
    Params, SKY, SUN, Sun, Wants,
    cast::{AROUND, edge, rays},
};
use crate::{
    numerics::{
        horizon::device,
        joins, smooth,
        tints::{self, Tints},
    },
    prelude::*,
    wgsl,
};

static LIGHT: Shader = Shader {
    name: "render/hillshade_light",
    source: wgsl!("render/hillshade_light"),
    library: &[wgsl::LINES, wgsl::GRADIENT],
    values: &[
        ("k_casts", Number::U32),
        ("k_share", Number::F32),
        ("k_hidden", Number::F32),
        ("k_seen", Number::F32),
        ("k_cos", Number::F32),
        ("k_sin", Number::F32),
        ("k_oblique", Number::F32),
        joins::NUMBERS[0],
        joins::NUMBERS[1],
    ],
    slots: &[
        Slot::input("height"),
        Slot::cells("tangents", "f32"),
        Slot::cells("sums", "f32"),
        Slot::words("suns", "vec2<f32>"),
        Slot::output("shade"),
    ],
};

static COLOUR: Shader = Shader {
    name: "render/hillshade",
    source: wgsl!("render/hillshade"),
    library: &[],
    values: &[
        ("k_casts", Number::U32),
        ("k_share", Number::F32),
        ("k_sin", Number::F32),
        ("k_plane", Number::U32),
        ("k_sky", Number::F32),
        ("k_sun", Number::F32),
        ("k_water", Number::F32),
        tints::VALUES[0],
        tints::VALUES[1],
        tints::VALUES[2],
        tints::VALUES[3],
    ],
    slots: &[
        Slot::input("height"),
        Slot::input("wet"),
        Slot::cells("shades", "f32"),
        Slot::cells("sums", "f32"),
        Slot::words("tint_table", "f32"),
        Slot::output("colour"),
    ],
};

pub(super) static GPU: GpuKernel = GpuKernel {
    shaders: &[&smooth::SHADER, &device::SHADER, &device::SKY, &LIGHT, &COLOUR],
    passes: Passes::Recorded(record),
    // the CPU explains what is wrong with the range
    covers: |params| {
        let params = Params::read(params);
        params.low <= params.high
    },
    // the same samples; heights for shadows are smoothed in single precision
    tolerance: &[Tolerance::absolute(1e-5), Tolerance::absolute(1e-5)],
    ..GpuKernel::DEFAULT
};

/// What terrain hides: the tangents of the horizon towards the sun, and the sums over the sky.
struct Cast {
    tangents: ScratchId,
    sums: ScratchId,
}

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let (params, wants) = (Params::read(job.params), Wants::of(job));
    let cast = if params.shadows > 0.0 { Some(cast(job, recorder, &params)?) } else { None };
    let (casts, share) = (u32::from(cast.is_some()), params.shadows as f32 / AROUND as f32);
    let of_cast: Vec<(&'static str, Bind)> = cast
        .iter()
        .flat_map(|cast| [("tangents", Bind::Scratch(cast.tangents)), ("sums", Bind::Scratch(cast.sums))])
        .collect();
    let shade = if wants.shade { Bind::Output("shade", 0) } else { Bind::Scratch(recorder.scratch(Size::Cells)?) };
    let sun = Sun::new(&params);
    let suns = recorder.table(&sun.towards.as_flattened().iter().map(|v| v.to_bits()).collect::<Vec<_>>())?;
    let [hidden, seen] = edge(&params);
    let [across, down] = joins::numbers(&job.window());
    recorder.pass(&Pass {
        shader: &LIGHT,
        entry: "main",
        bind: &[&of_cast[..], &[("suns", Bind::Scratch(suns)), ("out_shade", shade)]].concat(),
        values: &[
            ("k_casts", Scalar::U32(casts)),
            ("k_share", Scalar::F32(share)),
            ("k_hidden", Scalar::F32(hidden)),
            ("k_seen", Scalar::F32(seen)),
            ("k_cos", Scalar::F32(sun.cos_altitude)),
            ("k_sin", Scalar::F32(sun.sin_altitude)),
            ("k_oblique", Scalar::F32(sun.oblique)),
            across,
            down,
        ],
        over: Over::Cells(joins::rows(&job.window(), 1)),
    })?;
    if !wants.colour {
        return Ok(());
    }
    let tints = Tints::new(params.low, params.high, job.world().sea_level.filter(|_| params.water));
    let tint_table = recorder.table(&tints.words())?;
    let water = sun.lit(tints::open_water(), sun.sin_altitude, 1.0);
    let bind = [("shades", shade), ("tint_table", Bind::Scratch(tint_table))];
    for plane in 0..3 {
        let values = [
            ("k_casts", Scalar::U32(casts)),
            ("k_share", Scalar::F32(share)),
            ("k_sin", Scalar::F32(sun.sin_altitude)),
            ("k_plane", Scalar::U32(plane as u32)),
            ("k_sky", Scalar::F32(SKY[plane])),
            ("k_sun", Scalar::F32(SUN[plane])),
            ("k_water", Scalar::F32(water[plane])),
        ];
        recorder.pass(&Pass {
            shader: &COLOUR,
            entry: "main",
            bind: &[&of_cast[..], &bind, &[("out_colour", Bind::Output("colour", plane))]].concat(),
            values: &[&values[..], &tints.values()].concat(),
            over: Over::Cells(Rows::Around(0)),
        })?;
    }
    Ok(())
}

fn cast(job: &Job<'_>, recorder: &mut dyn Recorder, params: &Params) -> Result<Cast, NodeError> {
    let rays = rays(params, job.world());
    let horizons = device::Horizons::new(job, recorder, [0.0, 0.2], &rays)?;
    let tangents = recorder.scratch(Size::Cells)?;
    horizons.tangents(recorder, 0, tangents)?;
    Ok(Cast { tangents, sums: horizons.hidden(job, recorder, [0.2, 0.9], 1..rays.count())? })
}
