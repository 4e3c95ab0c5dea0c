//! Compass direction of descent, and a mask of a range of directions.

use orograph_graph::memory::zeroed;

use crate::{
    numerics::{
        gradient::{Method, Surface},
        joins, math, par,
    },
    prelude::*,
    wgsl,
};

params! {
    /// Direction that is fully selected, clockwise from north.
    azimuth: f64 = 0.0, Degrees, -360.0..=360.0, soft 0..=360;
    /// Total width of the range of directions that is fully selected.
    width: f64 = 90.0, Degrees, 0.0..=360.0;
    /// Width of the soft edge at each end of the range.
    falloff: f64 = 30.0, Degrees, 0.0..=180.0;
    /// Slope below which the mask fades out: level ground faces no direction.
    level: f64 = 2.0, Degrees, 0.0..=45.0, soft 0..=10;
}

inputs! {
    /// Terrain height.
    height: Height;
}

outputs! {
    /// Direction, 0° to 360° clockwise from north; −1 on level ground.
    aspect: Scalar(Azimuth);
    /// 1 where the ground faces the chosen directions.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Aspect",
    version: 2,
    migrations: &[Migration { from: 1, steps: &[] }],
    category: "select",
    summary: "The compass direction that the ground faces, and a mask of a range of directions.",
    doc: include_str!("aspect.md"),
    sources: &["B. K. P. Horn, 1981, Hill shading and the reflectance map, Proceedings of the IEEE 69(1), 14-47"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    averaging: &[("aspect", Averaging::Direction)],
    params: Params::specs,
    reach: Reach::Metres(|_, cell_m| cell_m),
    cpu: run,
    gpu: Some(&GPU),
    resolution: Resolution::Cells(
        "the gradient is that between neighbouring cells, and directions jump from 360° to 0°",
    ),
    example: "height: \"base\", azimuth: 180",
    ..Node::DEFAULT
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&Shader {
        name: "select/aspect",
        source: wgsl!("select/aspect"),
        library: &[wgsl::MATH, wgsl::LINES, wgsl::GRADIENT],
        values: &[("steep", Number::F32), joins::NUMBERS[0], joins::NUMBERS[1]],
        slots: &[Slot::input("height"), Slot::output("aspect"), Slot::output("mask")],
    }],
    passes: Passes::One {
        rows: |job| joins::rows(&job.window(), 1),
        values: |job| {
            let steep = math::tan(Params::read(job.params).level.to_radians()) as f32;
            [&[("steep", Scalar::F32(steep))], &joins::numbers(&job.window())[..]].concat()
        },
    },
    // degrees, which jump from 360 to 0
    tolerance: &[Tolerance::absolute(0.01).except(0.005), Tolerance::absolute(1e-3).except(0.005)],
    ..GpuKernel::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let surface = Surface::new(Inputs::read(job)?.height, Method::Horn);
    let mut aspect = zeroed(job.window().len())?;
    par::rows_within(job, [0.0, 0.6], &mut aspect, |j, row| {
        surface.row(j, |start, east, south| {
            for ((out, &p), &q) in row[start..].iter_mut().zip(east).zip(south) {
                *out = facing(p, q);
            }
        });
    })?;
    let steep = math::tan(params.level.to_radians()) as f32;
    let (half, falloff) = (0.5 * params.width as f32, params.falloff as f32);
    let wants = Wants::of(job);
    let mask = |j, row: &mut [f32]| {
        surface.row(j, |start, east, south| {
            for ((out, &p), &q) in row[start..].iter_mut().zip(east).zip(south) {
                let aspect = *out;
                let outside = (apart(aspect, params.azimuth as f32) - half).max(0.0);
                let chosen = if outside == 0.0 { 1.0 } else { math::lane::smoothstep(1.0 - outside / falloff) };
                let slope = (p * p + q * q).sqrt();
                let sloping = if slope >= steep { 1.0 } else { math::lane::smoothstep(slope / steep) };
                *out = if aspect < 0.0 { 0.0 } else { chosen * sloping };
            }
        });
    };
    let field = |samples| Field::new(job.window(), samples);
    Ok(Given {
        mask: wants
            .mask
            .then(|| par::rows_from(job, [0.6, 1.0], &mut aspect, wants.aspect, mask))
            .transpose()?
            .map(field),
        aspect: wants.aspect.then(|| field(aspect)),
    }
    .into())
}

/// Returns the direction of descent, given the slopes to the east and to the south.
fn facing(east: f32, south: f32) -> f32 {
    if east == 0.0 && south == 0.0 {
        return -1.0;
    }
    let degrees = math::f32::atan2(-east, south).to_degrees();
    if degrees < 0.0 { (degrees + 360.0).min(359.999_97) } else { degrees }
}

/// Returns the angle between two directions, 0° to 180°.
fn apart(a: f32, b: f32) -> f32 {
    let turn = (a - b).rem_euclid(360.0);
    turn.min(360.0 - turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, run as result, with_params, world};

    /// A plane that falls towards an azimuth faces it.
    #[test]
    fn planes_face_where_they_fall() {
        for azimuth in [0.0_f64, 30.0, 90.0, 135.0, 180.0, 270.0, 359.0] {
            let (east, north) = (libm::sin(azimuth.to_radians()), libm::cos(azimuth.to_radians()));
            let plane = field(world(9, 7, 10.0), |x, y| 500.0 - 0.3 * (east * x - north * y));
            let aspect = result(&NODE, &with_params(&NODE, ""), &[("height", &plane)], "aspect");
            // heights are in single precision: 3e-5 m on a fall of 6 m over 20 m
            assert!(
                aspect.samples().iter().all(|found| apart(*found, azimuth as f32) < 0.01),
                "{azimuth}: {:?}",
                aspect.samples()
            );
            let mask = |azimuth: f64| {
                let params = with_params(&NODE, &format!("azimuth={azimuth},width=20,falloff=40"));
                result(&NODE, &params, &[("height", &plane)], "mask").samples()[31]
            };
            assert_eq!((mask(azimuth - 9.9), mask(azimuth - 51.0)), (1.0, 0.0), "{azimuth}");
            assert!((mask((azimuth + 30.0) % 360.0) - 0.5).abs() < 1e-3);
        }
    }

    #[test]
    fn level_ground_faces_nowhere() {
        let flat = field(world(5, 5, 10.0), |_, _| 7.0);
        assert!(
            result(&NODE, &with_params(&NODE, ""), &[("height", &flat)], "aspect").samples().iter().all(|v| *v == -1.0)
        );
        assert!(
            result(&NODE, &with_params(&NODE, "width=360"), &[("height", &flat)], "mask")
                .samples()
                .iter()
                .all(|v| *v == 0.0)
        );
        let gentle = field(world(5, 5, 10.0), |_, y| y * libm::tan(1_f64.to_radians()));
        let mask = result(&NODE, &with_params(&NODE, "level=2"), &[("height", &gentle)], "mask");
        assert!((mask.samples()[12] - 0.5).abs() < 1e-3, "half of the slope that counts fully: {}", mask.samples()[12]);
    }
}
