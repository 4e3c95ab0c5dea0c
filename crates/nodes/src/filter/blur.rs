//! A Gaussian filter whose cost does not depend on its width; see [`crate::numerics::gaussian`].

use super::mix;
use crate::numerics::{gaussian::Gaussian, lines::separable, smooth};
use crate::{prelude::*, wgsl};

params! {
    /// Distance of the smoothing: the standard deviation of the Gaussian.
    ///
    /// Waves shorter than twice this length disappear; waves of ten times it keep four fifths of their height.
    radius: f64 = 100.0, Metres, 0.0..=1e6, soft 0..=2000;
}

inputs! {
    /// Field to smooth.
    value: AnyScalar;
    /// Strength of the smoothing: full at 1, none at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The smoothed values, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Blur",
    category: "filter",
    summary: "Smooths a field over a distance in metres.",
    doc: include_str!("blur.md"),
    sources: &[
        "T. Lindeberg (1990), Scale-space for discrete signals, IEEE Transactions on Pattern Analysis and Machine Intelligence \
         12, 234-254",
        "P. Gwosdek, S. Grewenig, A. Bruhn and J. Weickert (2011), Theoretical foundations of Gaussian convolution by extended \
         box filtering, Scale Space and Variational Methods in Computer Vision, 447-458",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| Gaussian::reach_m(Params::read(params).radius, cell_m)),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&GPU),
    example: "value: \"base\", radius: 300",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "filter/blur",
    source: wgsl!("filter/blur"),
    library: &[wgsl::MATH],
    values: &[],
    slots: &[Slot::cells("before", "f32"), Slot::input("value"), Slot::input("mask"), Slot::output("value")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&smooth::SHADER, &SHADER],
    passes: Passes::Recorded(record),
    // without a radius the CPU passes the input on
    covers: |params| Params::read(params).radius > 0.0,
    tolerance: &[Tolerance::relative(2e-6)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let sigma_cells = Params::read(job.params).radius / job.cell_m();
    let smoothed = smooth::smooth(job, recorder, Bind::Input("value", 0), sigma_cells, [0.0, 0.8])?;
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
    let radius_m = Params::read(sizing.params).radius;
    if radius_m == 0.0 { 0 } else { Gaussian::bytes(radius_m, &sizing.window) }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, mask } = Inputs::read(job)?;
    let radius_m = Params::read(job.params).radius;
    if radius_m == 0.0 {
        return Ok(Given { value: Some(value.clone()) }.into());
    }
    let filter = Gaussian::new(radius_m / job.cell_m());
    let mut out = separable(job, [0.0, 0.9], value.samples(), &filter)?;
    mix(job, value.samples(), &mut out, mask)?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::*;
    use crate::testing::{at_every_level, field, run as result, run_in, with_params, world};

    /// The amplitude of a plane wave decreases to exp(−2π² R² / λ²), whatever the cell size.
    #[test]
    fn a_wave_falls_by_its_transfer() {
        for (cell_m, radius_m, wavelength_m) in [(10.0, 25.0, 160.0), (10.0, 80.0, 640.0), (2.0, 80.0, 640.0)] {
            let n = (2.0 * wavelength_m / cell_m) as u32;
            let world = World { boundary: Boundary::all(Edge::Periodic), ..world(n, 4, cell_m) };
            let wave = field(world, |x, _| 100.0 * libm::sin(std::f64::consts::TAU * x / wavelength_m));
            let blurred =
                result(&NODE, &with_params(&NODE, &format!("radius={radius_m}")), &[("value", &wave)], "value");
            let number = std::f64::consts::TAU * radius_m / wavelength_m;
            let expected = libm::exp(-0.5 * number * number);
            for (before, after) in wave.samples().iter().zip(blurred.samples()) {
                // extended boxes differ from the Gaussian; below four cells only rounding and discretisation do
                assert!(
                    (f64::from(*after) - expected * f64::from(*before)).abs() < 0.6,
                    "{cell_m} {after} {before} {expected}"
                );
            }
        }
    }

    #[test]
    fn level_ground_and_walls_keep_their_sum() {
        let flat = field(world(37, 23, 5.0), |_, _| 812.5);
        for radius in [3.0, 12.0, 90.0, 5e5] {
            let params = with_params(&NODE, &format!("radius={radius}"));
            let blurred = result(&NODE, &params, &[("value", &flat)], "value");
            assert!(blurred.samples().iter().all(|value| *value == 812.5), "{radius}");
        }
        // mirrored edges preserve the mean; half a millimetre is the precision of f32 at 1000 m, which all cells may
        // lose alike
        let hills = field(world(37, 23, 5.0), |x, y| 1000.0 * libm::sin(x * 0.05) * libm::cos(y * 0.03));
        let sum = |field: &Field| field.samples().iter().map(|value| f64::from(*value)).sum::<f64>();
        let blurred = result(&NODE, &with_params(&NODE, "radius=40"), &[("value", &hills)], "value");
        assert!((sum(&hills) - sum(&blurred)).abs() < 37.0 * 23.0 * 5e-4);
    }

    #[test]
    fn nothing_changes_without_a_radius_or_a_mask() {
        let hills = field(world(40, 9, 5.0), |x, y| libm::sin(x * y));
        assert_eq!(result(&NODE, &with_params(&NODE, "radius=0"), &[("value", &hills)], "value"), hills);
        let nowhere = field(world(40, 9, 5.0), |_, _| 0.0);
        let fields = [("value", &hills), ("mask", &nowhere)];
        assert_eq!(result(&NODE, &with_params(&NODE, "radius=30"), &fields, "value"), hills);
    }

    #[test]
    fn windows_threads_and_widths_of_vectors_give_the_same_bits() {
        let hills =
            field(world(211, 190, 5.0), |x, y| 900.0 + 300.0 * libm::sin(x * 0.05 + y * 0.02) * libm::cos(y * 0.3));
        for radius in [7.0, 31.0] {
            let params = with_params(&NODE, &format!("radius={radius}"));
            let whole = result(&NODE, &params, &[("value", &hills)], "value");
            let part = Window { origin: [83, 77], cells: [60, 50], ..*hills.window() };
            let grown = hills.crop(&part.grown(Gaussian::reach_m(radius, 5.0)));
            assert!(!grown.window().is_whole());
            assert_eq!(result(&NODE, &params, &[("value", &grown)], "value").crop(&part), whole.crop(&part));
            assert_eq!(
                run_in(1, &NODE, &params, &[("value", &hills)]),
                run_in(3, &NODE, &params, &[("value", &hills)])
            );
            at_every_level(|| run_in(2, &NODE, &params, &[("value", &hills)]));
        }
    }

    #[test]
    fn a_periodic_world_moves_with_its_land() {
        let world = World { boundary: Boundary::all(Edge::Periodic), ..world(64, 64, 5.0) };
        let wave = |shift: f64| {
            field(world, move |x, y| {
                100.0 * libm::sin(std::f64::consts::TAU * (x + shift) / 320.0) + libm::cos(y * 0.196_349_540_849_362_08)
            })
        };
        let params = with_params(&NODE, "radius=33");
        let (still, moved) = (
            result(&NODE, &params, &[("value", &wave(0.0))], "value"),
            result(&NODE, &params, &[("value", &wave(40.0))], "value"),
        );
        for j in 0..64 {
            for i in 0..64 {
                let (a, b) = (still.samples()[j * 64 + (i + 8) % 64], moved.samples()[j * 64 + i]);
                assert!((a - b).abs() < 1e-4, "{a} {b}"); // rounding: parts of lines begin at other cells
            }
        }
    }
}
