//! Pipelines and layouts shared by all renderers of a device.

use super::{
    error::{ViewError, caught},
    lod::{TILE, Tile},
};

/// Multisampling, which smooths the edges of the terrain. Each sample passes the tone curve on its own, so that edges
/// stay smooth against a bright sky.
const SAMPLES: u32 = 4;
/// The format of linear light before the tone curve.
pub(super) const LIGHT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
pub(super) const HEIGHT: wgpu::TextureFormat = wgpu::TextureFormat::R32Float;
pub(super) const GRADIENT: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;

/// The source of a shader.
macro_rules! code {
    ($name:literal) => {
        include_str!(concat!("../../../../shaders/view/", $name, ".wgsl"))
    };
}
/// The resource that a shader reads or writes at a binding.
#[derive(Clone, Copy, Debug)]
enum Reads {
    Uniform,
    Sampler,
    /// A texture that is read without filtering.
    Cells,
    /// A filtered texture.
    Smooth,
    /// A multisampled texture.
    Samples,
    /// A multisampled depth texture.
    Depths,
    /// A storage texture, written by a compute shader.
    Writes,
}

/// Pipelines and layouts for a device and a picture format.
#[derive(Debug)]
pub(super) struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) format: wgpu::TextureFormat,
    pub(super) frame_layout: wgpu::BindGroupLayout,
    pub(super) land_layout: wgpu::BindGroupLayout,
    pub(super) map_layout: wgpu::BindGroupLayout,
    pub(super) sky_layout: wgpu::BindGroupLayout,
    pub(super) sweep_layout: wgpu::BindGroupLayout,
    pub(super) depth_layout: wgpu::BindGroupLayout,
    pub(super) light_layout: wgpu::BindGroupLayout,
    pub(super) relief_layout: wgpu::BindGroupLayout,
    pub(super) around_layout: wgpu::BindGroupLayout,
    pub(super) surface: wgpu::RenderPipeline,
    /// The surface where a tile crosses the edge of the inset: draws either the inset or the terrain around it.
    pub(super) split: wgpu::RenderPipeline,
    pub(super) walls: wgpu::RenderPipeline,
    pub(super) sky: wgpu::RenderPipeline,
    pub(super) gradient: wgpu::RenderPipeline,
    pub(super) inset_gradient: wgpu::RenderPipeline,
    halved: [(wgpu::TextureFormat, wgpu::RenderPipeline); 4],
    pub(super) sweep: wgpu::ComputePipeline,
    pub(super) sweep_inset: wgpu::ComputePipeline,
    pub(super) seen: wgpu::RenderPipeline,
    pub(super) open: wgpu::RenderPipeline,
    /// The tables of transmittance, multiple scattering, sky and ambient light.
    pub(super) sky_tables: [wgpu::RenderPipeline; 4],
    pub(super) haze: wgpu::RenderPipeline,
    /// Horizontal, then vertical.
    pub(super) blur: [wgpu::RenderPipeline; 2],
    pub(super) finish: wgpu::RenderPipeline,
    pub(super) smooth: wgpu::Sampler,
    pub(super) slant: wgpu::Sampler,
    /// Indices of a tile, then of a wall.
    pub(super) indices: wgpu::Buffer,
}

/// The range of the indices of a tile.
pub(super) const TILE_INDICES: std::ops::Range<u32> = 0..TILE * TILE * 6;
/// The range of the indices of a wall.
pub(super) const WALL_INDICES: std::ops::Range<u32> = TILE * TILE * 6..TILE * TILE * 6 + TILE * 6;

impl Gpu {
    pub(super) fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        format: wgpu::TextureFormat,
    ) -> Result<Self, ViewError> {
        if device.adapter_info().backend == wgpu::Backend::Gl {
            return Err(ViewError::OpenGl);
        }
        caught(device, || Self::made(device, queue, format))
    }

    fn made(device: &wgpu::Device, queue: &wgpu::Queue, format: wgpu::TextureFormat) -> Self {
        use Reads::{Cells, Depths, Sampler, Samples, Smooth, Uniform, Writes};
        let frame_layout = layout(device, "frame", &[Uniform, Sampler, Sampler]);
        let land_layout =
            layout(device, "land", &[Cells, Cells, Smooth, Smooth, Smooth, Smooth, Smooth, Smooth, Cells]);
        let map_layout = layout(device, "map", &[Cells]);
        let sky_layout = layout(device, "sky", &[Smooth, Smooth, Smooth]);
        let sweep_layout = layout(device, "sweep", &[Writes]);
        let depth_layout = layout(device, "depth", &[Depths]);
        let light_layout = layout(device, "light", &[Samples, Depths, Cells]);
        let relief_layout = layout(device, "relief", &[Cells, Cells, Cells, Cells]);
        let around_layout = layout(device, "around", &[Uniform, Cells]);

        let lit_by = |label, parts: &[&str]| {
            let light = [code!("frame"), code!("land"), code!("light"), code!("shadow"), code!("lighting")];
            shader(device, label, &[&light[..], parts].concat())
        };
        let terrain = lit_by("terrain", &[code!("relief"), code!("terrain")]);
        let sky = lit_by("sky", &[code!("sky")]);
        let tables = shader(device, "atmosphere", &[code!("frame"), code!("light"), code!("atmosphere")]);
        let maps = shader(device, "maps", &[code!("frame"), code!("inset"), code!("gradient")]);
        let swept = [code!("frame"), code!("land"), code!("inset"), code!("shadow"), code!("shade")];
        let shade = shader(device, "shade", &swept);
        let seen = lit_by("seen", &[code!("seen")]);
        let haze = lit_by("haze", &[code!("haze")]);
        let blur = shader(device, "blur", &[code!("frame"), code!("blur")]);
        let finish = lit_by("finish", &[code!("finish")]);

        let drawn = Make { device, frame: &frame_layout, samples: SAMPLES, depth: true };
        let plain = Make { samples: 1, depth: false, ..drawn };
        let (land, map) = ([&land_layout], [&map_layout]);
        let lit = [&land_layout, &sky_layout];
        let shaped = [&land_layout, &sky_layout, &relief_layout];
        let halved = |format| (format, plain.pipeline(&maps, ["map_vertex", "halved_fragment"], &map, format));
        let table = |fragment| plain.pipeline(&tables, ["table_vertex", fragment], &[&sky_layout], LIGHT);
        let blurred = |fragment| plain.pipeline(&blur, ["blur_vertex", fragment], &map, LIGHT);
        let hazed = [&land_layout, &sky_layout, &depth_layout];
        let finished = [&land_layout, &sky_layout, &light_layout];
        Self {
            surface: drawn.pipeline(&terrain, ["surface_vertex", "surface_fragment"], &shaped, LIGHT),
            split: drawn.pipeline(&terrain, ["surface_vertex", "split_fragment"], &shaped, LIGHT),
            walls: drawn.pipeline(&terrain, ["wall_vertex", "wall_fragment"], &shaped, LIGHT),
            sky: drawn.pipeline(&sky, ["sky_vertex", "sky_fragment"], &lit, LIGHT),
            gradient: plain.pipeline(&maps, ["map_vertex", "gradient_fragment"], &map, GRADIENT),
            inset_gradient: plain.pipeline(
                &maps,
                ["map_vertex", "inset_gradient_fragment"],
                &[&map_layout, &map_layout],
                GRADIENT,
            ),
            halved: [HEIGHT, GRADIENT, COLOUR, SEEN].map(halved),
            sweep: plain.compute(&shade, "sweep", &[&land_layout, &sweep_layout]),
            sweep_inset: plain.compute(&shade, "sweep_inset", &[&land_layout, &sweep_layout, &around_layout]),
            seen: plain.pipeline(&seen, ["seen_vertex", "sun_fragment"], &land, SEEN),
            open: plain.pipeline(&seen, ["seen_vertex", "open_fragment"], &land, SEEN),
            sky_tables: ["clear_fragment", "again_fragment", "sky_fragment", "ambient_fragment"].map(table),
            haze: plain.pipeline(&haze, ["haze_vertex", "haze_fragment"], &hazed, LIGHT),
            blur: ["across_fragment", "down_fragment"].map(blurred),
            finish: plain.pipeline(&finish, ["finish_vertex", "finish_fragment"], &finished, format),
            smooth: sampler(device, 1),
            slant: sampler(device, 8),
            indices: indices(device, queue),
            device: device.clone(),
            queue: queue.clone(),
            format,
            frame_layout,
            land_layout,
            map_layout,
            sky_layout,
            sweep_layout,
            depth_layout,
            light_layout,
            relief_layout,
            around_layout,
        }
    }

    /// The pipeline that fills the coarser mip-map levels of a format.
    pub(super) fn halved(&self, format: wgpu::TextureFormat) -> &wgpu::RenderPipeline {
        let [(_, first), rest @ ..] = &self.halved;
        rest.iter().find(|(of, _)| *of == format).map_or(first, |(_, pipeline)| pipeline)
    }
}

/// Format of terrain colours.
pub(super) const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// Format of sun visibility and sky visibility.
pub(super) const SEEN: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;
/// Format of the heights below which the sun is hidden.
pub(super) const SHADE: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Float;

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
            visibility: match reads {
                Reads::Writes => wgpu::ShaderStages::COMPUTE,
                _ => wgpu::ShaderStages::VERTEX_FRAGMENT | wgpu::ShaderStages::COMPUTE,
            },
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
                Reads::Depths => wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Depth,
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: true,
                },
                Reads::Writes => wgpu::BindingType::StorageTexture {
                    access: wgpu::StorageTextureAccess::WriteOnly,
                    format: SHADE,
                    view_dimension: wgpu::TextureViewDimension::D2,
                },
            },
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// The common settings of the pipelines of a pass.
#[derive(Clone, Copy)]
struct Make<'a> {
    device: &'a wgpu::Device,
    frame: &'a wgpu::BindGroupLayout,
    samples: u32,
    depth: bool,
}

impl Make<'_> {
    fn layout(&self, groups: &[&wgpu::BindGroupLayout]) -> wgpu::PipelineLayout {
        let groups: Vec<Option<&wgpu::BindGroupLayout>> =
            std::iter::once(self.frame).chain(groups.iter().copied()).map(Some).collect();
        self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &groups,
            immediate_size: 0,
        })
    }

    fn compute(
        &self,
        module: &wgpu::ShaderModule,
        entry: &str,
        groups: &[&wgpu::BindGroupLayout],
    ) -> wgpu::ComputePipeline {
        self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout: Some(&self.layout(groups)),
            module,
            entry_point: Some(entry),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        })
    }

    fn pipeline(
        &self,
        module: &wgpu::ShaderModule,
        [vertex, fragment]: [&str; 2],
        groups: &[&wgpu::BindGroupLayout],
        format: wgpu::TextureFormat,
    ) -> wgpu::RenderPipeline {
        let layout = self.layout(groups);
        // the sky is drawn after the terrain, in pixels that are still empty
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

/// Indices of a tile of 17 x 17 vertices and of a wall of 17 pairs. All squares are split along the same diagonal, so
/// that sliding odd vertices never fold a triangle.
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
    /// A texture with one layer.
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

    /// A multisampled render target.
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

    /// Writes the first mip-map level of a texture.
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

    /// A bind group of the uniform and the shadows of the terrain around an inset.
    pub(super) fn around(&self, frame: &wgpu::Buffer, shade: &wgpu::TextureView) -> wgpu::BindGroup {
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("around"),
            layout: &self.around_layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: frame.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(shade) },
            ],
        })
    }

    /// Draws one triangle that covers a whole texture.
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
