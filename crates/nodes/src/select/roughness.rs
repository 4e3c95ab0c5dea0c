//! Terrain roughness at a length in metres.

use crate::{
    numerics::{gaussian::Gaussian, lines::separable, par},
    prelude::*,
};

params! {
    /// Length that separates form from roughness: the standard deviation of the Gaussian.
    radius: f64 = 100.0, Metres, 0.1..=1e5, soft 10..=2000;
}

inputs! {
    /// Terrain height.
    height: Height;
}

outputs! {
    /// Root mean square height above the smoothed form.
    roughness: Scalar(Metres);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Roughness",
    category: "select",
    summary: "Roughness: how far the ground departs from its smoothed form, in metres.",
    doc: include_str!("roughness.md"),
    sources: &["M. W. Smith (2014), Roughness in the Earth Sciences, Earth-Science Reviews 136, 202-225"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| 2.0 * Gaussian::reach_m(Params::read(params).radius, cell_m)),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Within(0.08),
    example: "height: \"base\", radius: 500",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // squares, which are then smoothed
    sizing.cells(4.0) + Gaussian::bytes(Params::read(sizing.params).radius, &sizing.window)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let height = Inputs::read(job)?.height.samples();
    let filter = Gaussian::new(Params::read(job.params).radius / job.cell_m());
    let mut out = separable(job, [0.0, 0.5], height, &filter)?;
    par::change_with(&mut out, height, |smoothed, height| {
        let rest = height - *smoothed;
        *smoothed = rest * rest;
    });
    let mut out = separable(job, [0.5, 1.0], &out, &filter)?;
    par::change(&mut out, |mean| *mean = mean.sqrt());
    Ok(Given { roughness: Some(Field::new(job.window(), out)) }.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, run as result, with_params, world};

    #[test]
    fn short_waves_count_and_slopes_do_not() {
        // 5 m high and 60 m long on a slope of 50 %, in the middle of the world, away from its mirrored edges
        let wave = |height_m: f64| {
            field(world(300, 40, 5.0), move |x, y| {
                0.5 * x + height_m * libm::sin(std::f64::consts::TAU * (x + 0.3 * y) / 60.0)
            })
        };
        let params = with_params(&NODE, "radius=60");
        let (rough, plane) = (
            result(&NODE, &params, &[("height", &wave(5.0))], "roughness"),
            result(&NODE, &params, &[("height", &wave(0.0))], "roughness"),
        );
        for i in 130..170 {
            let (rough, plane) = (rough.samples()[20 * 300 + i], plane.samples()[20 * 300 + i]);
            // box filters transmit a few per cent of a wave of one radius
            assert!((rough / (5.0 * std::f32::consts::FRAC_1_SQRT_2) - 1.0).abs() < 0.02, "{rough}");
            assert!(plane < 1e-3, "{plane}");
        }
    }
}
