//! The renderer: records the passes of a picture.

use std::sync::Arc;

use super::{
    error::{ViewError, caught},
    gpu::{DEPTH, Gpu, LIGHT, TILE_INDICES, WALL_INDICES},
    inset::Inset,
    lod::{self, TILE, Tile},
    maps::{Around, Maps},
    scene::Scene,
    sky::Sky,
    sweep::Sweep,
    terrain::Terrain,
    uniforms::{self, Frame},
};

/// Factor on the length of triangle sides where the terrain has an inset, whose finer cells show through their slopes.
const INSET_DETAIL: f64 = 1.5;

/// Draws a terrain. Each view of a window has one; those on the same device share their pipelines.
#[derive(Debug)]
pub struct Renderer {
    gpu: Arc<Gpu>,
    whole: Uniform,
    /// The uniform of the inset.
    part: Uniform,
    tiles: wgpu::Buffer,
    sky: Sky,
    shown: Option<Shown>,
    targets: Option<Targets>,
}

/// The drawn terrain.
#[derive(Debug)]
struct Shown {
    terrain: Arc<Terrain>,
    maps: Maps,
    inset: Option<(Arc<Inset>, Maps)>,
    /// The heights that displace the mesh.
    relief: wgpu::BindGroup,
}

/// A uniform buffer with its bind group.
#[derive(Debug)]
struct Uniform {
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Textures of the size of the picture.
#[derive(Debug)]
struct Targets {
    size: [u32; 2],
    light: wgpu::TextureView,
    depth: wgpu::TextureView,
    depth_group: wgpu::BindGroup,
    finish_group: wgpu::BindGroup,
    /// Haze: the first is marched, the second blurred horizontally; the vertical blur writes to the first again.
    haze: [wgpu::TextureView; 2],
    haze_groups: [wgpu::BindGroup; 2],
}

/// Counts of a drawn picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Tiles of the terrain; those across the edge of an inset count twice.
    pub tiles: usize,
    /// Triangles of terrain and walls.
    pub triangles: usize,
}

impl Renderer {
    /// A renderer into textures of this format. For a format that is not sRGB, the shader encodes sRGB itself.
    ///
    /// # Errors
    /// When the device lacks a feature that the renderer needs.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, format: wgpu::TextureFormat) -> Result<Self, ViewError> {
        Self::with(Arc::new(Gpu::new(device, queue, format)?))
    }

    /// Another renderer on the same device, for another terrain. Each may draw once per submission.
    ///
    /// # Errors
    /// When the device has too little memory.
    pub fn sibling(&self) -> Result<Self, ViewError> {
        Self::with(Arc::clone(&self.gpu))
    }

    fn with(gpu: Arc<Gpu>) -> Result<Self, ViewError> {
        let device = &gpu.device;
        let [whole, part] = [(); 2].map(|()| caught(device, || Uniform::new(&gpu)));
        let (tiles, sky) = caught(device, || (instances(device, 2048), Sky::new(&gpu)))?;
        Ok(Self { whole: whole?, part: part?, gpu, tiles, sky, shown: None, targets: None })
    }

    /// Sets the terrain, without an inset.
    ///
    /// # Errors
    /// When the device has too little memory; the previous terrain stays.
    pub fn set_terrain(&mut self, terrain: Arc<Terrain>) -> Result<(), ViewError> {
        let gpu = &*self.gpu;
        let (maps, relief) = caught(&gpu.device, || {
            let maps = Maps::new(gpu, &terrain, None);
            let relief = relief(gpu, &maps, None);
            (maps, relief)
        })?;
        self.shown = Some(Shown { terrain, maps, inset: None, relief });
        Ok(())
    }

    /// Sets or removes the inset. Does nothing without a terrain.
    ///
    /// # Errors
    /// When the device has too little memory; the previous inset stays.
    pub fn set_inset(&mut self, inset: Option<Arc<Inset>>) -> Result<(), ViewError> {
        let Some(shown) = &mut self.shown else { return Ok(()) };
        let gpu = &*self.gpu;
        let around = Around { maps: &shown.maps, frame: &self.whole.buffer };
        let (inset, relief) = caught(&gpu.device, || {
            let inset = inset.map(|inset| {
                let maps = Maps::new(gpu, inset.terrain(), Some(around));
                (inset, maps)
            });
            let relief = relief(gpu, &shown.maps, inset.as_ref().map(|(_, maps)| maps));
            (inset, relief)
        })?;
        (shown.inset, shown.relief) = (inset, relief);
        Ok(())
    }

    /// The current inset.
    #[must_use]
    pub fn inset(&self) -> Option<&Arc<Inset>> {
        self.shown.as_ref()?.inset.as_ref().map(|(inset, _)| inset)
    }

    /// The current terrain.
    #[must_use]
    pub fn terrain(&self) -> Option<&Arc<Terrain>> {
        self.shown.as_ref().map(|shown| &shown.terrain)
    }

    /// Records the passes of a picture into a texture of this size. Does nothing without a terrain. The buffers that it
    /// writes are read when the encoder is submitted, so draw once per submission. Shadows and sky are only recorded
    /// when they have changed and count as computed from then on, so do not drop the encoder.
    ///
    /// # Errors
    /// When numbers of the scene are invalid, or the device cannot draw it. Errors inside a pass appear when the
    /// encoder is finished.
    pub fn draw(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        size: [u32; 2],
        scene: &Scene,
    ) -> Result<Drawn, ViewError> {
        scene.check()?;
        let size = size.map(|n| n.max(1));
        let Some(Shown { terrain, maps, inset, relief }) = &mut self.shown else { return Ok(Drawn::default()) };
        let gpu = &*self.gpu;
        if self.targets.as_ref().is_none_or(|targets| targets.size != size) {
            self.targets = Some(caught(&gpu.device, || Targets::new(gpu, size))?);
        }
        let Some(targets) = &self.targets else { return Ok(Drawn::default()) };

        let part = inset.as_ref().map(|(inset, _)| &**inset);
        let ground = uniforms::ground(terrain, part, scene);
        let detail_px = scene.detail_px * part.map_or(1.0, |_| INSET_DETAIL);
        let lod::Selection { tiles, walls } = lod::select(&ground, &scene.camera, size, detail_px);
        let (mut outer, mut rim, mut inner) = (tiles, Vec::new(), Vec::new());
        if let Some(rectangle) = part.map(Inset::rectangle) {
            let meets = |tile: &Tile| ground.meets(tile, rectangle);
            let rest: Vec<Tile> = outer.iter().copied().filter(meets).collect();
            outer.retain(|tile| !meets(tile));
            (inner, rim) = rest.into_iter().partition(|tile| ground.lies_in(tile, rectangle));
        }
        let all = [&outer[..], &rim[..], &inner[..], &walls[..]].concat();
        let needed = (all.len() * size_of::<Tile>()) as u64;
        if needed > self.tiles.size() {
            self.tiles = caught(&gpu.device, || instances(&gpu.device, all.len().next_power_of_two()))?;
        }
        gpu.queue.write_buffer(&self.tiles, 0, bytemuck::cast_slice(&all));
        let sweep = Sweep::new(terrain, &scene.sun);
        let uniform = Frame::new((terrain, part), scene, &sweep, size, !gpu.format.is_srgb());
        gpu.queue.write_buffer(&self.whole.buffer, 0, bytemuck::bytes_of(&uniform));

        let frame = &self.whole.group;
        self.sky.prepare(gpu, encoder, frame, scene, uniforms::altitude_km(scene, ground.base));
        maps.prepare(gpu, encoder, frame, scene, &sweep);
        if let Some((part, maps)) = inset {
            let sweep = Sweep::new(part.terrain(), &scene.sun);
            let uniform = uniform.of_inset(terrain, part, scene, &sweep);
            gpu.queue.write_buffer(&self.part.buffer, 0, bytemuck::bytes_of(&uniform));
            maps.prepare(gpu, encoder, &self.part.group, scene, &sweep);
        }
        let mut end = 0;
        let [outer, rim, inner, walls] = [outer.len(), rim.len(), inner.len(), walls.len()].map(|count| {
            let first = end;
            end += count as u32;
            first..end
        });
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
        for (index, group) in (0..).zip([frame, maps.group(), self.sky.group(), relief]) {
            pass.set_bind_group(index, group, &[]);
        }
        pass.set_vertex_buffer(0, self.tiles.slice(..));
        pass.set_index_buffer(gpu.indices.slice(..), wgpu::IndexFormat::Uint16);
        pass.set_pipeline(&gpu.surface);
        pass.draw_indexed(TILE_INDICES, 0, outer.clone());
        pass.set_pipeline(&gpu.walls);
        pass.draw_indexed(WALL_INDICES, 0, walls.clone());
        if let Some((_, part_maps)) = inset {
            pass.set_pipeline(&gpu.split);
            pass.draw_indexed(TILE_INDICES, 0, rim.clone());
            pass.set_bind_group(0, &self.part.group, &[]);
            pass.set_bind_group(1, part_maps.group(), &[]);
            pass.draw_indexed(TILE_INDICES, 0, rim.clone());
            pass.set_pipeline(&gpu.surface);
            pass.draw_indexed(TILE_INDICES, 0, inner.clone());
            pass.set_bind_group(0, frame, &[]);
            pass.set_bind_group(1, maps.group(), &[]);
        }
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
        let tiles = outer.len() + 2 * rim.len() + inner.len();
        Ok(Drawn { tiles, triangles: 2 * (TILE * TILE) as usize * tiles + 2 * TILE as usize * walls.len() })
    }
}

impl Uniform {
    fn new(gpu: &Gpu) -> Self {
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("frame"),
            size: size_of::<Frame>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("frame"),
            layout: &gpu.frame_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: buffer.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&gpu.smooth) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::Sampler(&gpu.slant) },
            ],
        });
        Self { buffer, group }
    }
}

/// The heights that displace the mesh: those of the terrain, and of its inset.
fn relief(gpu: &Gpu, whole: &Maps, inset: Option<&Maps>) -> wgpu::BindGroup {
    let [whole, part] = [whole, inset.unwrap_or(whole)].map(Maps::relief);
    gpu.group(&gpu.relief_layout, &[whole, part].concat())
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
