//! Pipelines and layouts: what all renderers of a device share.

use super::{
    error::{ViewError, caught},
    lod::{TILE, Tile},
};

/// Samples of a pixel: edges of the land are smooth, and each sample passes the tone curve by itself, so that they stay
/// smooth before a bright sky.
const SAMPLES: u32 = 4;
/// Light, before the tone curve.
pub(super) const LIGHT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
pub(super) const HEIGHT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;
pub(super) const GRADIENT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;

/// What a shader reads at a binding.
#[derive(Clone, Copy, Debug)]
enum Reads {
    Uniform,
    Sampler,
    /// A texture without filter.
    Cells,
    /// A texture with filter.
    Smooth,
    /// A texture of several samples a pixel.
    Samples,
}

/// Pipelines and layouts of a device and a format of pictures.
#[derive(Debug)]
pub(super) struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) format: wgpu::TextureFormat,
    pub(super) frame_layout: wgpu::BindGroupLayout,
    pub(super) land_layout: wgpu::BindGroupLayout,
    pub(super) map_layout: wgpu::BindGroupLayout,
    pub(super) light_layout: wgpu::BindGroupLayout,
    pub(super) surface: wgpu::RenderPipeline,
    pub(super) walls: wgpu::RenderPipeline,
    pub(super) sky: wgpu::RenderPipeline,
    pub(super) gradient: wgpu::RenderPipeline,
    pub(super) halved_gradient: wgpu::RenderPipeline,
    pub(super) halved_colour: wgpu::RenderPipeline,
    pub(super) finish: wgpu::RenderPipeline,
    pub(super) smooth: wgpu::Sampler,
    pub(super) slant: wgpu::Sampler,
    /// Triangles of a tile, then of a wall.
    pub(super) indices: wgpu::Buffer,
}

/// The part of the indices that is a tile.
pub(super) const TILE_INDICES: std::ops::Range<u32> = 0..TILE * TILE * 6;
/// The part of the indices that is a wall.
pub(super) const WALL_INDICES: std::ops::Range<u32> = TILE * TILE * 6..TILE * TILE * 6 + TILE * 6;

impl Gpu {
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
    ) -> Result<Self, ViewError> {
        caught(device, || Self::made(device, queue, format))
    }

    fn made(device: &wgpu::Device, queue: &wgpu::Queue, format: wgpu::TextureFormat) -> Self {
        use Reads::{Cells, Sampler, Samples, Smooth, Uniform};
        let frame_layout = layout(device, "frame", &[Uniform, Sampler, Sampler]);
        let land_layout = layout(device, "land", &[Cells, Cells, Smooth, Smooth, Smooth, Smooth]);
        let map_layout = layout(device, "map", &[Cells]);
        let light_layout = layout(device, "light", &[Samples]);

        let terrain = shader(device, "terrain", &[FRAME, LAND, include_str!("../../../../shaders/view/terrain.wgsl")]);
        let sky = shader(device, "sky", &[FRAME, include_str!("../../../../shaders/view/sky.wgsl")]);
        let maps = shader(device, "maps", &[FRAME, include_str!("../../../../shaders/view/gradient.wgsl")]);
        let finish = shader(device, "finish", &[FRAME, include_str!("../../../../shaders/view/finish.wgsl")]);

        let drawn = Make { device, frame: &frame_layout, samples: SAMPLES, depth: true };
        let plain = Make { samples: 1, depth: false, ..drawn };
        let land = [&land_layout];
        let map = [&map_layout];
        Self {
            surface: drawn.pipeline(&terrain, ["surface_vertex", "surface_fragment"], &land, LIGHT),
            walls: drawn.pipeline(&terrain, ["wall_vertex", "wall_fragment"], &land, LIGHT),
            sky: drawn.pipeline(&sky, ["sky_vertex", "sky_fragment"], &[], LIGHT),
            gradient: plain.pipeline(&maps, ["map_vertex", "gradient_fragment"], &map, GRADIENT),
            halved_gradient: plain.pipeline(&maps, ["map_vertex", "halved_fragment"], &map, GRADIENT),
            halved_colour: plain.pipeline(&maps, ["map_vertex", "halved_fragment"], &map, COLOUR),
            finish: plain.pipeline(&finish, ["finish_vertex", "finish_fragment"], &[&light_layout], format),
            smooth: sampler(device, 1),
            slant: sampler(device, 8),
            indices: indices(device, queue),
            device: device.clone(),
            queue: queue.clone(),
            format,
            frame_layout,
            land_layout,
            map_layout,
            light_layout,
        }
    }
}

/// Colours of land.
pub(super) const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

const FRAME: &str = include_str!("../../../../shaders/view/frame.wgsl");
const LAND: &str = include_str!("../../../../shaders/view/land.wgsl");

fn shader(device: &wgpu::Device, label: &str, parts: &[&str]) -> wgpu::ShaderModule {
    let source = wgpu::ShaderSource::Wgsl(parts.concat().into());
    device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(label), source })
}

fn layout(device: &wgpu::Device, label: &str, reads: &[Reads]) -> wgpu::BindGroupLayout {
    let texture = |filterable: bool, multisampled: bool| wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled,
    };
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(reads)
        .map(|(binding, reads)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE,
            ty: match reads {
                Reads::Uniform => wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                Reads::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                Reads::Cells => texture(false, false),
                Reads::Smooth => texture(true, false),
                Reads::Samples => texture(false, true),
            },
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// What pipelines of one kind of pass have in common.
#[derive(Clone, Copy)]
struct Make<'a> {
    device: &'a wgpu::Device,
    frame: &'a wgpu::BindGroupLayout,
    samples: u32,
    depth: bool,
}

impl Make<'_> {
    fn pipeline(
        &self,
        module: &wgpu::ShaderModule,
        [vertex, fragment]: [&str; 2],
        groups: &[&wgpu::BindGroupLayout],
        format: wgpu::TextureFormat,
    ) -> wgpu::RenderPipeline {
        let groups: Vec<Option<&wgpu::BindGroupLayout>> =
            std::iter::once(self.frame).chain(groups.iter().copied()).map(Some).collect();
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(fragment),
            bind_group_layouts: &groups,
            immediate_size: 0,
        });
        // the sky is drawn where nothing is, after the land
        let (write, compare) = match vertex {
            "sky_vertex" => (false, wgpu::CompareFunction::Equal),
            _ => (true, wgpu::CompareFunction::Greater),
        };
        let attributes = wgpu::vertex_attr_array![0 => Uint32x2, 1 => Uint32x2, 2 => Float32x2];
        let tiles = Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<Tile>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &attributes,
        });
        let of_tiles = matches!(vertex, "surface_vertex" | "wall_vertex");
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(fragment),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: if of_tiles { std::slice::from_ref(&tiles) } else { &[] },
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: self.depth.then_some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(write),
                depth_compare: Some(compare),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState { count: self.samples, ..wgpu::MultisampleState::default() },
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(fragment),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

fn sampler(device: &wgpu::Device, anisotropy_clamp: u16) -> wgpu::Sampler {
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("map"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        anisotropy_clamp,
        ..wgpu::SamplerDescriptor::default()
    })
}

/// Triangles of a tile of 17 x 17 vertices, and of a wall of 17 pairs. All squares are cut along the same diagonal, from
/// which odd vertices slide away without folding.
fn indices(device: &wgpu::Device, queue: &wgpu::Queue) -> wgpu::Buffer {
    let row = TILE + 1;
    let tile = (0..TILE * TILE).flat_map(|at| {
        let corner = at / TILE * row + at % TILE;
        [corner, corner + row, corner + 1, corner + 1, corner + row, corner + row + 1]
    });
    let wall = (0..TILE).flat_map(|at| [0, 1, 2, 2, 1, 3].map(|k| 2 * at + k));
    let all: Vec<u16> = tile.chain(wall).map(|index| index as u16).collect();
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("tile"),
        size: (all.len() * 2) as u64,
        usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&all));
    buffer
}

impl Gpu {
    /// A texture of one layer.
    pub(super) fn texture(
        &self,
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
        mips: u32,
        usage: wgpu::TextureUsages,
    ) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: mips,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        })
    }

    /// A target of several samples a pixel.
    pub(super) fn target(&self, [width, height]: [u32; 2], format: wgpu::TextureFormat) -> wgpu::TextureView {
        let texture = self.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: SAMPLES,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    }

    /// Fills the first level of a texture.
    pub(super) fn fill(&self, texture: &wgpu::Texture, bytes: &[u8]) {
        let size = texture.size();
        let texel = bytes.len() / (size.width as usize * size.height as usize);
        self.queue.write_texture(
            texture.as_image_copy(),
            bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(size.width * texel as u32),
                rows_per_image: None,
            },
            size,
        );
    }

    /// A bind group of textures.
    pub(super) fn group(&self, layout: &wgpu::BindGroupLayout, views: &[&wgpu::TextureView]) -> wgpu::BindGroup {
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(views)
            .map(|(binding, view)| wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::TextureView(view) })
            .collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
    }

    /// Draws one triangle over a whole texture.
    pub(super) fn over(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &wgpu::TextureView,
        pipeline: &wgpu::RenderPipeline,
        groups: &[&wgpu::BindGroup],
    ) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(pipeline);
        for (index, group) in (0..).zip(groups) {
            pass.set_bind_group(index, *group, &[]);
        }
        pass.draw(0..3, 0..1);
    }
}
