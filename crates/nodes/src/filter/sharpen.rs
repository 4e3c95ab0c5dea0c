//! Sharpens: adds the detail that a Gaussian filter would remove.

use super::mix;
use crate::numerics::{gaussian::Gaussian, lines::separable, par, smooth};
use crate::{prelude::*, wgsl};

params! {
    /// Length below which detail is amplified: the standard deviation of a Gaussian.
    radius: f64 = 50.0, Metres, 0.0..=1e5, soft 5..=1000;
    /// How much of the detail is added; negative values remove it, and −1 is a blur.
    amount: f64 = 0.7, One, -1.0..=10.0, soft 0..=3;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Strength of the sharpening: full at 1, none at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// Sharpened terrain.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Sharpen",
    category: "filter",
    summary: "Amplifies crests and gullies smaller than a length in metres.",
    doc: include_str!("sharpen.md"),
    sources: &["A. Rosenfeld and A. C. Kak, 1982, Digital Picture Processing, 2nd edition, section 6.4"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| Gaussian::reach_m(Params::read(params).radius, cell_m)),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&GPU),
    example: "height: \"base\", radius: 400, amount: 0.5",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "filter/sharpen",
    source: wgsl!("filter/sharpen"),
    library: &[wgsl::MATH],
    values: &[],
    slots: &[Slot::cells("before", "f32"), Slot::input("height"), Slot::input("mask"), Slot::output("height")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&smooth::SHADER, &SHADER],
    passes: Passes::Recorded(record),
    // the CPU passes the input on where nothing changes
    covers: |params| {
        let params = Params::read(params);
        params.amount != 0.0 && params.radius > 0.0
    },
    tolerance: &[Tolerance::relative(2e-6)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let sigma_cells = Params::read(job.params).radius / job.cell_m();
    let smoothed = smooth::smooth(job, recorder, Bind::Input("height", 0), sigma_cells, [0.0, 0.8])?;
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("before", Bind::Scratch(smoothed))],
        values: &[],
        over: Over::Cells(Rows::Around(0)),
    })
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    let is_used = params.amount != 0.0 && params.radius != 0.0;
    if is_used { Gaussian::bytes(params.radius, &sizing.window) } else { 0 }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    if params.amount == 0.0 || params.radius == 0.0 {
        return Ok(Given { height: Some(height.clone()) }.into());
    }
    let filter = Gaussian::new(params.radius / job.cell_m());
    let mut out = separable(job, [0.0, 0.8], height.samples(), &filter)?;
    let amount = params.amount as f32;
    par::change_with(&mut out, height.samples(), |smooth, height| *smooth = height + amount * (height - *smooth));
    mix(job, height.samples(), &mut out, mask)?;
    Ok(Given { height: Some(Field::new(job.window(), out)) }.into())
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::*;
    use crate::testing::{field, run as result, with_params, world};

    /// The amplitude of a short wave grows by 1 + a, that of a long one is preserved, and −1 is a blur.
    #[test]
    fn short_waves_grow_and_long_ones_stay() {
        let world = World { boundary: Boundary::all(Edge::Periodic), ..world(400, 3, 5.0) };
        let wave = |length_m: f64| field(world, move |x, _| 100.0 * libm::sin(std::f64::consts::TAU * x / length_m));
        let gain = |length_m: f64, amount: f64| {
            let params = with_params(&NODE, &format!("radius=18,amount={amount}"));
            let sharp = result(&NODE, &params, &[("height", &wave(length_m))], "height");
            sharp.range(0).expect("finite").1 / wave(length_m).range(0).expect("finite").1
        };
        // a Gaussian of 18 m keeps exp(−2π² 18² / 20²) ≈ 0 of a wave of 20 m, and 99.84 % of one of 2 km
        assert!((gain(20.0, 0.7) - 1.7).abs() < 1e-3, "{}", gain(20.0, 0.7));
        assert!((gain(2000.0, 0.7) - 1.0).abs() < 2e-3, "{}", gain(2000.0, 0.7));
        assert!(gain(20.0, -1.0) < 1e-3);
    }

    #[test]
    fn nothing_changes_at_no_amount() {
        let land = field(world(70, 9, 5.0), |x, y| 900.0 * libm::sin(x * y));
        for changes in ["amount=0", "radius=0"] {
            assert_eq!(result(&NODE, &with_params(&NODE, changes), &[("height", &land)], "height"), land);
        }
    }
}
