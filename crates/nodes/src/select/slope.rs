//! Slope angle, and a mask of a range of slopes.

use orograph_graph::memory::zeroed;

use super::within;
use crate::{
    numerics::{
        gradient::{Method, Surface, slope_degrees},
        joins, par,
    },
    prelude::*,
    wgsl,
};

params! {
    /// Gentlest slope that is fully selected.
    from: f64 = 30.0, Degrees, 0.0..=90.0;
    /// Steepest slope that is fully selected.
    to: f64 = 90.0, Degrees, 0.0..=90.0;
    /// Width of the soft edge outside each end of the range.
    falloff: f64 = 5.0, Degrees, 0.0..=45.0, soft 0.0..=20.0;
    /// How the gradient is computed.
    method: Method = Method::Horn, One, ..;
}

inputs! {
    /// Terrain height.
    height: Height;
}

outputs! {
    /// Angle of slope, 0° to 90°.
    slope: Scalar(Degrees);
    /// 1 where the slope is within the range.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Slope",
    category: "select",
    summary: "Slope of the ground in degrees, and a mask of a range of slopes.",
    doc: include_str!("slope.md"),
    sources: &["B. K. P. Horn, 1981, Hill shading and the reflectance map, Proceedings of the IEEE 69(1), 14-47"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|_, cell_m| cell_m),
    refuses: Some(refuses),
    cpu: run,
    gpu: Some(&GPU),
    resolution: Resolution::Cells(
        "the gradient is measured between neighbouring cells, so slopes are gentler with larger cells",
    ),
    example: "height: \"base\", from: 30, to: 50",
    ..Node::DEFAULT
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&Shader {
        name: "select/slope",
        source: wgsl!("select/slope"),
        library: &[wgsl::MATH, wgsl::WITHIN, wgsl::LINES, wgsl::GRADIENT],
        values: &joins::NUMBERS,
        slots: &[Slot::input("height"), Slot::output("slope"), Slot::output("mask")],
    }],
    passes: Passes::One {
        rows: |job| joins::rows(&job.window(), 1),
        values: |job| joins::numbers(&job.window()).to_vec(),
    },
    covers: |params| {
        let params = Params::read(params);
        params.from <= params.to
    },
    // degrees; a sharp edge of the mask lies between two numbers
    tolerance: &[Tolerance::absolute(2e-4), Tolerance::absolute(1e-3).except(0.005)],
    ..GpuKernel::DEFAULT
};

/// Refuses a range that falls.
fn refuses(stated: &Stated<'_>) -> Result<(), NodeError> {
    let params = Params::read(stated.params);
    if params.from > params.to {
        return Err(NodeError::failed_with_hint(
            format!("`from` is {}°, above `to`, {}°", params.from, params.to),
            "exchange the two",
        ));
    }
    Ok(())
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    refuses(&Stated::of_job(job))?;
    let surface = Surface::new(Inputs::read(job)?.height, params.method);
    let mut slope = zeroed(job.window().len())?;
    par::rows_within(job, [0.0, 0.8], &mut slope, |j, row| {
        surface.row(j, |start, east, south| slope_degrees(east, south, &mut row[start..start + east.len()]));
    })?;
    let wants = Wants::of(job);
    let range = [params.from as f32, params.to as f32];
    let mask = |_, row: &mut [f32]| within(row, range, params.falloff as f32);
    let field = |samples| Field::new(job.window(), samples);
    Ok(Given {
        mask: wants
            .mask
            .then(|| par::rows_from(job, [0.8, 1.0], &mut slope, wants.slope, mask))
            .transpose()?
            .map(field),
        slope: wants.slope.then(|| field(slope)),
    }
    .into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_every_level, field, run, run_in, with_params, world};

    /// The slope of a quadratic surface is exact inside the world, by either method: its values and differences are
    /// dyadic, so only the square root and the arc tangent are rounded.
    #[test]
    fn quadratic_surfaces_are_exact() {
        let world = world(24, 20, 5.0);
        let (a, b, c) = (1.0 / 64.0, -1.0 / 128.0, 1.0 / 32.0);
        let height = field(world, |x, y| a * x * x + b * y * y + c * x * y + 0.25 * x - 0.5 * y);
        for method in ["horn", "central"] {
            let slope = run(&NODE, &with_params(&NODE, &format!("method={method}")), &[("height", &height)], "slope");
            for j in 1..19 {
                for i in 1..23 {
                    let [x, y] = height.window().centre_m(i, j);
                    let steepness = libm::hypot(2.0 * a * x + c * y + 0.25, 2.0 * b * y + c * x - 0.5);
                    let expected = libm::atan(steepness).to_degrees();
                    let got = f64::from(slope.samples()[j * 24 + i]);
                    assert!((got - expected).abs() < 3e-7 * expected + 1e-6, "{method} ({i}, {j}): {got} {expected}");
                }
            }
        }
    }

    /// On z = a x³ the central difference exceeds the slope by a dx².
    #[test]
    fn the_central_difference_of_a_cubic_is_off_by_its_known_error() {
        let (dx, a) = (5.0, 1e-4);
        let height = field(world(16, 4, dx), |x, _| a * x * x * x);
        let slope = run(&NODE, &with_params(&NODE, "method=central"), &[("height", &height)], "slope");
        for i in 1..15 {
            let [x, _] = height.window().centre_m(i, 1);
            let error = libm::tan(f64::from(slope.samples()[16 + i]).to_radians()) - 3.0 * a * x * x;
            assert!((error - a * dx * dx).abs() < 5e-6, "{error}"); // heights are single precision
        }
    }

    /// A plane has the same slope in every cell, also at edges and corners, for any aspect.
    #[test]
    fn a_rotated_plane_has_one_slope() {
        for degrees in [0.0_f64, 17.0, 45.0, 122.0] {
            let (east, south) = (libm::cos(degrees.to_radians()), libm::sin(degrees.to_radians()));
            let height = field(world(300, 9, 10.0), |x, y| 0.7 * (east * x + south * y));
            let slope = run(&NODE, &ParamValues::defaults(&NODE.specs()), &[("height", &height)], "slope");
            let expected = libm::atan(0.7).to_degrees() as f32;
            // heights of 2000 m in single precision, on cells of 10 m
            assert!(slope.samples().iter().all(|s| (s - expected).abs() < 2e-3), "{degrees}");
        }
    }

    #[test]
    fn the_mask_is_full_within_the_range_and_soft_outside() {
        let height = field(world(90, 3, 1.0), |x, _| {
            // slopes increase from west to east: the arc of a circle of 100 m
            100.0 - (1e4 - x * x).sqrt()
        });
        let params = with_params(&NODE, "from=20, to=40, falloff=8");
        let slope = run(&NODE, &params, &[("height", &height)], "slope");
        let mask = run(&NODE, &params, &[("height", &height)], "mask");
        for (&s, &m) in slope.samples().iter().zip(mask.samples()) {
            match s {
                s if (20.0..=40.0).contains(&s) => assert_eq!(m, 1.0),
                s if !(12.0..=48.0).contains(&s) => assert_eq!(m, 0.0),
                _ => assert!(m > 0.0 && m < 1.0, "{s}: {m}"),
            }
        }
        let hard = run(&NODE, &with_params(&NODE, "from=20, to=40, falloff=0"), &[("height", &height)], "mask");
        assert!(hard.samples().iter().all(|&m| m == 0.0 || m == 1.0));
    }

    #[test]
    fn a_window_with_its_halo_is_a_window_of_the_whole() {
        let height = field(world(600, 40, 7.0), |x, y| 300.0 * libm::sin(x / 90.0) * libm::cos(y / 40.0));
        let params = ParamValues::defaults(&NODE.specs());
        let whole = run(&NODE, &params, &[("height", &height)], "slope");
        let part = Window { origin: [250, 10], cells: [300, 17], ..*height.window() };
        let grown = run(&NODE, &params, &[("height", &height.crop(&part.grown(7.0)))], "slope");
        assert_eq!(grown.crop(&part), whole.crop(&part));
    }

    #[test]
    fn threads_and_simd_levels_give_the_same_bits() {
        let height = field(world(333, 21, 7.0), |x, y| 300.0 * libm::sin(x / 90.0) * libm::cos(y / 40.0));
        let params = ParamValues::defaults(&NODE.specs());
        let one = run_in(1, &NODE, &params, &[("height", &height)]);
        assert_eq!(one, run_in(4, &NODE, &params, &[("height", &height)]));
        at_every_level(|| run_in(2, &NODE, &params, &[("height", &height)]));
    }

    #[test]
    fn small_and_level_worlds_are_measured() {
        let params = ParamValues::defaults(&NODE.specs());
        for (nx, ny) in [(1, 1), (1, 5), (5, 1), (2, 2)] {
            let slope = run(&NODE, &params, &[("height", &field(world(nx, ny, 1.0), |_, _| 7.0))], "slope");
            assert!(slope.samples().iter().all(|&s| s == 0.0), "{nx} x {ny}");
        }
        let cliff = field(world(4, 4, 1e-3), |x, _| if x > 2e-3 { 1e9 } else { -1e9 });
        let slope = run(&NODE, &params, &[("height", &cliff)], "slope");
        assert!(slope.samples().iter().all(|s| (0.0..=90.0).contains(s)));
    }
}
