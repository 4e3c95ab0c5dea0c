//! The tables of the sky, recomputed when the sun or the altitude of the camera changes.

use super::{gpu::Gpu, scene::Scene};

/// The tables of `shaders/view/atmosphere.wgsl`.
#[derive(Debug)]
pub(super) struct Sky {
    group: wgpu::BindGroup,
    steps: [Step; 4],
    /// True once the tables that are independent of sun and camera are computed.
    begun: bool,
    /// Elevation of the sun in degrees and altitude of the camera in kilometres of the computed tables.
    of: Option<[f64; 2]>,
}

/// A table, and the pass that computes it.
#[derive(Debug)]
struct Step {
    target: wgpu::TextureView,
    source: wgpu::BindGroup,
}

/// Sizes of the tables of transmittance, multiple scattering, sky and ambient light.
const SIZES: [[u32; 2]; 4] = [[256, 64], [32, 32], [192, 108], [16, 16]];

impl Sky {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let table = |size| {
            let texture = gpu.texture(size, super::gpu::LIGHT, 1, wgpu::TextureUsages::RENDER_ATTACHMENT);
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let [clear, again, sky, ambient] = SIZES.map(table);
        let none = table([1, 1]);
        let sources = [[&none, &none, &none], [&clear, &none, &none], [&clear, &again, &none], [&clear, &again, &sky]]
            .map(|views| gpu.group(&gpu.sky_layout, &views));
        let group = gpu.group(&gpu.sky_layout, &[&sky, &ambient, &clear]);
        let [a, b, c, d] = sources;
        let step = |target, source| Step { target, source };
        let steps = [step(clear, a), step(again, b), step(sky, c), step(ambient, d)];
        Self { group, steps, begun: false, of: None }
    }

    pub(super) const fn group(&self) -> &wgpu::BindGroup {
        &self.group
    }

    /// Records the passes that this scene needs and that are not computed yet.
    pub(super) fn prepare(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        scene: &Scene,
        altitude_km: f64,
    ) {
        let now = [scene.sun.elevation_deg, altitude_km];
        let first = match (self.begun, self.of == Some(now)) {
            (false, _) => 0,
            (true, false) => 2,
            (true, true) => return,
        };
        for (step, pipeline) in self.steps.iter().zip(&gpu.sky_tables).skip(first) {
            gpu.over(encoder, &step.target, pipeline, &[frame, &step.source]);
        }
        (self.begun, self.of) = (true, Some(now));
    }
}
