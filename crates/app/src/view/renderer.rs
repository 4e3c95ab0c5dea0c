//! The passes of a picture.

use std::sync::Arc;

use super::{
    error::{ViewError, caught},
    gpu::{DEPTH, Gpu, LIGHT, TILE_INDICES, WALL_INDICES},
    land::Land,
    lod::{self, TILE, Tile},
    maps::Maps,
    scene::Scene,
    sky::Sky,
    sweep::Sweep,
    uniforms::{self, Frame},
};

/// Draws land. One for each view of a window; those of one device share their pipelines.
#[derive(Debug)]
pub struct Renderer {
    gpu: Arc<Gpu>,
    uniform: wgpu::Buffer,
    frame: wgpu::BindGroup,
    tiles: wgpu::Buffer,
    sky: Sky,
    shown: Option<Shown>,
    targets: Option<Targets>,
}

/// The land that is shown.
#[derive(Debug)]
struct Shown {
    land: Arc<Land>,
    maps: Maps,
}

/// Textures of the size of the picture.
#[derive(Debug)]
struct Targets {
    size: [u32; 2],
    light: wgpu::TextureView,
    depth: wgpu::TextureView,
    depth_group: wgpu::BindGroup,
    finish_group: wgpu::BindGroup,
    /// Haze as it is marched, and blurred across; blurred down it is back in the first.
    haze: [wgpu::TextureView; 2],
    haze_groups: [wgpu::BindGroup; 2],
}

/// What a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Tiles of land.
    pub tiles: usize,
    /// Triangles of land and walls.
    pub triangles: usize,
}

impl Renderer {
    /// A renderer into textures of that format. Where the format is not one of sRGB, the shader writes the codes of the
    /// screen itself.
    ///
    /// # Errors
    /// When the device cannot do what it needs.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, format: wgpu::TextureFormat) -> Result<Self, ViewError> {
        Self::with(Arc::new(Gpu::new(device, queue, format)?))
    }

    /// Another one on the same device, with its own land. Each may draw once in a submission.
    ///
    /// # Errors
    /// When the device has too little memory.
    pub fn sibling(&self) -> Result<Self, ViewError> {
        Self::with(Arc::clone(&self.gpu))
    }

    fn with(gpu: Arc<Gpu>) -> Result<Self, ViewError> {
        let device = &gpu.device;
        let (uniform, frame, tiles, sky) = caught(device, || {
            let uniform = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("frame"),
                size: size_of::<Frame>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let frame = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("frame"),
                layout: &gpu.frame_layout,
                entries: &[
                    wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                    wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&gpu.smooth) },
                    wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(&gpu.slant) },
                ],
            });
            (uniform, frame, instances(device, 2048), Sky::new(&gpu))
        })?;
        Ok(Self { gpu, uniform, frame, tiles, sky, shown: None, targets: None })
    }

    /// Shows another land.
    ///
    /// # Errors
    /// When the device has too little memory; what was shown stays.
    pub fn set_land(&mut self, land: Arc<Land>) -> Result<(), ViewError> {
        let maps = caught(&self.gpu.device, || Maps::new(&self.gpu, &land))?;
        self.shown = Some(Shown { land, maps });
        Ok(())
    }

    /// The land that is shown.
    #[must_use]
    pub fn land(&self) -> Option<&Arc<Land>> {
        self.shown.as_ref().map(|shown| &shown.land)
    }

    /// Records a picture of the land into a texture of that size; nothing while there is no land. The buffers it fills are
    /// read when the encoder is submitted, so a renderer draws once in a submission. Shadows and sky are recorded where they
    /// have changed and count as computed from then on, so an encoder must not be dropped.
    ///
    /// # Errors
    /// When the scene has numbers that are none, or the device cannot do it. What a pass does wrong shows when the encoder is finished.
    pub fn draw(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        size: [u32; 2],
        scene: &Scene,
    ) -> Result<Drawn, ViewError> {
        scene.check()?;
        let size = size.map(|n| n.max(1));
        let Some(Shown { land, maps }) = &mut self.shown else { return Ok(Drawn::default()) };
        let gpu = &*self.gpu;
        if self.targets.as_ref().is_none_or(|targets| targets.size != size) {
            self.targets = Some(caught(&gpu.device, || Targets::new(gpu, size))?);
        }
        let Some(targets) = &self.targets else { return Ok(Drawn::default()) };

        let ground = uniforms::ground(land, scene);
        let lod::Selection { tiles, walls } = lod::select(&ground, &scene.camera, size, scene.detail_px);
        let all = [&tiles[..], &walls[..]].concat();
        let needed = (all.len() * size_of::<Tile>()) as u64;
        if needed > self.tiles.size() {
            self.tiles = caught(&gpu.device, || instances(&gpu.device, all.len().next_power_of_two()))?;
        }
        gpu.queue.write_buffer(&self.tiles, 0, bytemuck::cast_slice(&all));
        let sweep = Sweep::new(land, &scene.sun);
        let uniform = Frame::new(land, scene, &sweep, size, !gpu.format.is_srgb());
        gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));

        let frame = &self.frame;
        self.sky.prepare(gpu, encoder, frame, scene, uniforms::altitude_km(scene, ground.base));
        maps.prepare(gpu, encoder, frame, scene, &sweep);
        let (tile_count, all_count) = (tiles.len() as u32, all.len() as u32);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("land"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &targets.light,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &targets.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        for (index, group) in (0..).zip([frame, maps.group(), self.sky.group()]) {
            pass.set_bind_group(index, group, &[]);
        }
        pass.set_vertex_buffer(0, self.tiles.slice(..));
        pass.set_index_buffer(gpu.indices.slice(..), wgpu::IndexFormat::Uint16);
        pass.set_pipeline(&gpu.surface);
        pass.draw_indexed(TILE_INDICES, 0, 0..tile_count);
        pass.set_pipeline(&gpu.walls);
        pass.draw_indexed(WALL_INDICES, 0, tile_count..all_count);
        pass.set_pipeline(&gpu.sky);
        pass.draw(0..3, 0..1);
        drop(pass);

        let [haze, other] = &targets.haze;
        if scene.haze > 0.0 {
            gpu.over(encoder, haze, &gpu.haze, &[frame, maps.group(), self.sky.group(), &targets.depth_group]);
            gpu.over(encoder, other, &gpu.blur[0], &[frame, &targets.haze_groups[0]]);
            gpu.over(encoder, haze, &gpu.blur[1], &[frame, &targets.haze_groups[1]]);
        }
        gpu.over(encoder, target, &gpu.finish, &[frame, maps.group(), self.sky.group(), &targets.finish_group]);
        let triangles = 2 * (TILE * TILE) as usize * tiles.len() + 2 * TILE as usize * walls.len();
        Ok(Drawn { tiles: tiles.len(), triangles })
    }
}

fn instances(device: &wgpu::Device, count: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("tiles"),
        size: (count * size_of::<Tile>()) as u64,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

impl Targets {
    fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let light = gpu.target(size, LIGHT);
        let depth = gpu.target(size, DEPTH);
        let half = size.map(|n| n.div_ceil(2));
        let haze = [(); 2].map(|()| {
            let texture = gpu.texture(half, LIGHT, 1, wgpu::TextureUsages::RENDER_ATTACHMENT);
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        });
        Self {
            size,
            depth_group: gpu.group(&gpu.depth_layout, &[&depth]),
            finish_group: gpu.group(&gpu.light_layout, &[&light, &depth, &haze[0]]),
            haze_groups: haze.each_ref().map(|haze| gpu.group(&gpu.map_layout, &[haze])),
            light,
            depth,
            haze,
        }
    }
}
