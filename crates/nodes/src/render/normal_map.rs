//! The texture of surface normals for engines.

use orograph_graph::memory::zeroed;

use crate::{
    numerics::{
        gradient::{Method, Surface},
        joins, par,
        simd::simd,
    },
    prelude::*,
    wgsl,
};

choice! {
    /// Direction of the green channel.
    pub enum Convention {
        /// Up in the picture, to the north: OpenGL, Godot, Unity, Blender.
        OpenGl = "opengl",
        /// Down in the picture, to the south: DirectX, Unreal.
        DirectX = "directx",
    }
}

params! {
    /// Which way green points: up in OpenGL, Godot, Unity and Blender, down in DirectX and Unreal.
    convention: Convention = Convention::OpenGl, One, ..;
    /// Factor on heights; 1 is true to scale.
    exaggeration: f64 = 1.0, One, 0.0..=1000.0, soft 0.1..=10.0;
}

inputs! {
    /// Terrain height.
    height: Height;
}

outputs! {
    /// Unit normals: red east, green by `convention`, blue up.
    normal: Normal;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "NormalMap",
    category: "render",
    summary: "The normal map of the terrain, for OpenGL or DirectX.",
    doc: include_str!("normal_map.md"),
    sources: &["B. K. P. Horn, 1981, Hill shading and the reflectance map, Proceedings of the IEEE 69(1), 14-47"],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|_, cell_m| cell_m),
    cpu: run,
    gpu: Some(&GPU),
    resolution: Resolution::Cells(
        "the gradient is measured between neighbouring cells, so slopes are gentler with larger cells",
    ),
    example: "height: \"base\", exaggeration: 2",
    ..Node::DEFAULT
};

/// Steeper slopes count as this one, which is practically vertical and has a finite square.
const STEEPEST: f32 = 1e15;

static GPU: GpuKernel = GpuKernel {
    shaders: &[&Shader {
        name: "render/normal_map",
        source: wgsl!("render/normal_map"),
        library: &[wgsl::LINES, wgsl::GRADIENT],
        values: &[("k_steepest", Number::F32), joins::NUMBERS[0], joins::NUMBERS[1]],
        slots: &[
            Slot::input("height"),
            Slot::output("normal"),
            Slot::output("normal").plane(1),
            Slot::output("normal").plane(2),
        ],
    }],
    passes: Passes::One {
        rows: |job| joins::rows(&job.window(), 1),
        values: |job| [&[("k_steepest", Scalar::F32(STEEPEST))], &joins::numbers(&job.window())[..]].concat(),
    },
    tolerance: &[Tolerance::absolute(1e-5)],
    ..GpuKernel::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let surface = Surface::new(Inputs::read(job)?.height, Method::Horn);
    let scale = params.exaggeration as f32;
    let scales = match params.convention {
        Convention::OpenGl => [-scale, scale],
        Convention::DirectX => [-scale, -scale],
    };
    let window = job.window();
    let (nx, len) = (window.nx(), window.len());
    let mut normal = zeroed(3 * len)?;
    let (red, rest) = normal.split_at_mut(len);
    let (green, blue) = rest.split_at_mut(len);
    par::each(red.chunks_mut(nx).zip(green.chunks_mut(nx)).zip(blue.chunks_mut(nx)), |j, ((red, green), blue)| {
        surface.row(j, |start, east, south| {
            let block = start..start + east.len();
            normals(east, south, scales, [&mut red[block.clone()], &mut green[block.clone()], &mut blue[block]]);
        });
        job.check()
    })?;
    Ok(Given { normal: Some(Field::with_planes(window, 3, normal)) }.into())
}

simd! {
    fn normals(east: &[f32], south: &[f32], scales: [f32; 2], out: [&mut [f32]; 3]) {
        let [red, green, blue] = out;
        for ((((red, green), blue), &p), &q) in red.iter_mut().zip(green).zip(blue).zip(east).zip(south) {
            let x = (p * scales[0]).clamp(-STEEPEST, STEEPEST);
            let y = (q * scales[1]).clamp(-STEEPEST, STEEPEST);
            let length = (1.0 + (x * x + y * y)).sqrt();
            *red = x / length;
            *green = y / length;
            *blue = 1.0 / length;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{at_every_level, field, run, run_in, with_params, world};

    /// A plane that rises by 3/4 to the east and falls by 1/2 to the south; all numbers are dyadic, so only the root
    /// and the quotient are rounded.
    #[test]
    fn planes_have_their_normal_in_every_cell() {
        let height = field(world(300, 7, 16.0), |x, y| 0.75 * x - 0.5 * y);
        let length = (1.0 + 0.75 * 0.75 + 0.5 * 0.5_f64).sqrt();
        for (convention, green) in [("opengl", -0.5), ("directx", 0.5)] {
            let params = with_params(&NODE, &format!("convention={convention}"));
            let normal = run(&NODE, &params, &[("height", &height)], "normal");
            for (plane, expected) in [-0.75, green, 1.0].into_iter().enumerate() {
                let expected = (expected / length) as f32;
                assert!(normal.plane(plane).iter().all(|v| (v - expected).abs() < 1e-7), "{convention} {plane}");
            }
        }
        let flat = run(&NODE, &with_params(&NODE, "exaggeration=0"), &[("height", &height)], "normal");
        assert!(flat.plane(2).iter().all(|v| *v == 1.0) && flat.plane(0).iter().all(|v| *v == 0.0));
    }

    #[test]
    fn normals_have_length_one_on_any_land() {
        let cliff = field(world(4, 4, 1e-3), |x, y| if x > 2e-3 { 1e30 } else { -1e30 * y });
        for height in [cliff, field(world(1, 9, 5.0), |_, y| y), field(world(1, 1, 5.0), |_, _| -7.0)] {
            let normal = run(&NODE, &with_params(&NODE, "exaggeration=1000"), &[("height", &height)], "normal");
            for cell in 0..height.window().len() {
                let square: f32 = (0..3).map(|plane| normal.plane(plane)[cell] * normal.plane(plane)[cell]).sum();
                assert!((square - 1.0).abs() < 1e-6, "{square}");
            }
        }
    }

    #[test]
    fn windows_threads_and_simd_levels_give_the_same_bits() {
        let height = field(world(300, 40, 25.0), |x, y| 900.0 * libm::sin(x / 700.0) * libm::cos(y / 300.0));
        let params = ParamValues::defaults(&NODE.specs());
        let inputs = [("height", &height)];
        assert_eq!(run_in(1, &NODE, &params, &inputs), run_in(4, &NODE, &params, &inputs));
        at_every_level(|| run_in(2, &NODE, &params, &inputs));
        let part = Window { origin: [30, 11], cells: [260, 20], ..*height.window() };
        let grown = run(&NODE, &params, &[("height", &height.crop(&part.grown(25.0)))], "normal");
        assert_eq!(grown.crop(&part), run(&NODE, &params, &inputs, "normal").crop(&part));
    }
}
