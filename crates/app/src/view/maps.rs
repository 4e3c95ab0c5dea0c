//! The textures of a terrain.

use orograph_graph::Field;
use orograph_nodes::numerics::{math::f32 as math, palettes::Palette};
use rayon::prelude::*;

use super::{
    gpu::{COLOUR, GRADIENT, Gpu, HEIGHT, SEEN, SHADE},
    scene::Scene,
    sweep::{self, Sweep},
    terrain::Terrain,
    uniforms::open_texels,
};
use crate::export::picture::{TINTS, tints};

/// The textures of a terrain.
#[derive(Debug)]
pub(super) struct Maps {
    /// All maps.
    group: wgpu::BindGroup,
    /// All maps but sun and sky visibility.
    bare: wgpu::BindGroup,
    /// All maps with the swept shadows, but without sun visibility.
    swept: wgpu::BindGroup,
    sweep_out: wgpu::BindGroup,
    /// Heights and depths of water.
    relief: [wgpu::TextureView; 2],
    gradient: wgpu::TextureView,
    shade: wgpu::TextureView,
    seen: wgpu::TextureView,
    open: wgpu::TextureView,
    /// The shadows of the terrain around an inset; None for the whole terrain.
    around: Option<wgpu::BindGroup>,
    /// Passes that fill the mip-maps of sun visibility.
    seen_halves: Vec<Fill>,
    /// Passes that fill textures from others and are not recorded yet.
    waiting: Vec<Fill>,
    /// The sweep, exaggeration and sea level of the computed shadows.
    shadows_of: Option<(Sweep, f64, Option<f64>)>,
    /// The exaggeration of the computed sky visibility.
    open_of: Option<f64>,
}

/// A pass that fills one level of a map from another.
#[derive(Debug)]
struct Fill {
    target: wgpu::TextureView,
    sources: Vec<wgpu::BindGroup>,
    what: What,
}

/// The terrain around an inset.
#[derive(Clone, Copy, Debug)]
pub(super) struct Around<'a> {
    pub(super) maps: &'a Maps,
    /// Its uniform.
    pub(super) frame: &'a wgpu::Buffer,
}

#[derive(Clone, Copy, Debug)]
enum What {
    Gradient,
    /// Of an inset.
    InsetGradient,
    Halved(wgpu::TextureFormat),
}

impl Maps {
    /// Creates the textures of a terrain, or of an inset in the terrain around it.
    pub(super) fn new(gpu: &Gpu, terrain: &Terrain, around: Option<Around<'_>>) -> Self {
        let copy = wgpu::TextureUsages::COPY_DST;
        let drawn = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let cells = terrain.cells();
        let mips = cells[0].max(cells[1]).ilog2() + 1;
        let mut waiting = Vec::new();

        let height = gpu.texture(cells, HEIGHT, mips, copy | drawn);
        gpu.fill(&height, bytemuck::cast_slice(terrain.height().plane(0)));
        waiting.extend(halves(gpu, &height));
        let water = match terrain.water() {
            Some(water) => {
                let texture = gpu.texture(cells, HEIGHT, 1, copy);
                gpu.fill(&texture, bytemuck::cast_slice(water.plane(0)));
                texture
            }
            None => one(gpu, HEIGHT, &[0; 4]),
        };
        let gradient = gpu.texture(cells, GRADIENT, mips, drawn);
        let slopes_of = std::iter::once(level(&height, 0)).chain(around.map(|around| around.maps.gradient.clone()));
        waiting.push(Fill {
            target: level(&gradient, 0),
            sources: slopes_of.map(|view| gpu.group(&gpu.map_layout, &[&view])).collect(),
            what: if around.is_some() { What::InsetGradient } else { What::Gradient },
        });
        waiting.extend(halves(gpu, &gradient));
        let colour = match terrain.colour() {
            Some(colour) => {
                let texture = gpu.texture(cells, COLOUR, mips, copy | drawn);
                gpu.fill(&texture, &coded(colour));
                waiting.extend(halves(gpu, &texture));
                texture
            }
            None => one(gpu, COLOUR, &[255; 4]),
        };
        let overlay = match [terrain.mask(), terrain.lines()] {
            [None, None] => one(gpu, wgpu::TextureFormat::Rg8Unorm, &[0; 2]),
            overlays => {
                let texture = gpu.texture(cells, wgpu::TextureFormat::Rg8Unorm, 1, copy);
                let planes = overlays.map(|field| field.map(|field| field.plane(0)));
                let code = |plane: Option<&[f32]>, at: usize| {
                    plane.map_or(0, |plane| (plane[at].clamp(0.0, 1.0) * 255.0).round() as u8)
                };
                let texels = (0..terrain.height().window().len()).into_par_iter();
                gpu.fill(
                    &texture,
                    &texels.flat_map_iter(|at| planes.map(|plane| code(plane, at))).collect::<Vec<u8>>(),
                );
                texture
            }
        };
        let rows = gpu.texture([TINTS as u32, 3], COLOUR, 1, copy);
        gpu.fill(&rows, &[Palette::Alpine, Palette::Rock, Palette::Map].map(row).concat());

        let seen = gpu.texture(cells, SEEN, mips, drawn);
        // an inset is too small to compute sky visibility; it uses that of the whole terrain
        let open = match around {
            Some(around) => around.maps.open.clone(),
            None => whole(&gpu.texture(open_texels(terrain), SEEN, 1, drawn)),
        };
        let shade = gpu.texture(sweep::largest(terrain), SHADE, 1, wgpu::TextureUsages::STORAGE_BINDING);
        let shade = whole(&shade);
        let nothing = whole(&one(gpu, SEEN, &[255]));
        let no_shade = whole(&one(gpu, SHADE, &[0; 8]));
        let of_land = [&height, &water, &gradient, &colour, &overlay, &rows].map(whole);
        let group = |seen: &wgpu::TextureView, open: &wgpu::TextureView, shade: &wgpu::TextureView| {
            let views: Vec<&wgpu::TextureView> = of_land.iter().chain([seen, open, shade]).collect();
            gpu.group(&gpu.land_layout, &views)
        };
        Self {
            group: group(&whole(&seen), &open, &shade),
            bare: group(&nothing, &nothing, &no_shade),
            swept: group(&nothing, &nothing, &shade),
            sweep_out: gpu.group(&gpu.sweep_layout, &[&shade]),
            seen_halves: halves(gpu, &seen).collect(),
            seen: level(&seen, 0),
            relief: [&height, &water].map(whole),
            gradient: level(&gradient, 0),
            around: around.map(|around| gpu.around(around.frame, &around.maps.shade)),
            shade,
            open,
            waiting,
            shadows_of: None,
            open_of: None,
        }
    }

    pub(super) const fn group(&self) -> &wgpu::BindGroup {
        &self.group
    }

    /// Heights and depths of water.
    pub(super) fn relief(&self) -> [&wgpu::TextureView; 2] {
        self.relief.each_ref()
    }

    /// Records the passes that this scene needs and that are not computed yet.
    pub(super) fn prepare(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::BindGroup,
        scene: &Scene,
        sweep: &Sweep,
    ) {
        for fill in self.waiting.drain(..) {
            fill.record(gpu, encoder, frame);
        }
        if self.around.is_none() && self.open_of != Some(scene.exaggeration) {
            gpu.over(encoder, &self.open, &gpu.open, &[frame, &self.bare]);
            self.open_of = Some(scene.exaggeration);
        }
        let shadows = Some((*sweep, scene.exaggeration, scene.sea_level));
        if scene.shadows && self.shadows_of != shadows {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(if self.around.is_some() { &gpu.sweep_inset } else { &gpu.sweep });
            for (index, group) in (0..).zip([frame, &self.bare, &self.sweep_out].into_iter().chain(&self.around)) {
                pass.set_bind_group(index, group, &[]);
            }
            pass.dispatch_workgroups(sweep.lines.div_ceil(64), 1, 1);
            drop(pass);
            gpu.over(encoder, &self.seen, &gpu.seen, &[frame, &self.swept]);
            for fill in &self.seen_halves {
                fill.record(gpu, encoder, frame);
            }
            self.shadows_of = shadows;
        }
    }
}

impl Fill {
    fn record(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, frame: &wgpu::BindGroup) {
        let pipeline = match self.what {
            What::Gradient => &gpu.gradient,
            What::InsetGradient => &gpu.inset_gradient,
            What::Halved(format) => gpu.halved(format),
        };
        let groups: Vec<&wgpu::BindGroup> = std::iter::once(frame).chain(&self.sources).collect();
        gpu.over(encoder, &self.target, pipeline, &groups);
    }
}

/// The passes that fill the mip-maps of a texture.
fn halves(gpu: &Gpu, texture: &wgpu::Texture) -> impl Iterator<Item = Fill> {
    let what = What::Halved(texture.format());
    (1..texture.mip_level_count()).map(move |mip| {
        let finer = level(texture, mip - 1);
        Fill { target: level(texture, mip), sources: vec![gpu.group(&gpu.map_layout, &[&finer])], what }
    })
}

fn whole(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn level(texture: &wgpu::Texture, mip: u32) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        base_mip_level: mip,
        mip_level_count: Some(1),
        ..wgpu::TextureViewDescriptor::default()
    })
}

/// A texture of one texel, for maps that the terrain does not have.
fn one(gpu: &Gpu, format: wgpu::TextureFormat, texel: &[u8]) -> wgpu::Texture {
    let texture = gpu.texture([1, 1], format, 1, wgpu::TextureUsages::COPY_DST);
    gpu.fill(&texture, texel);
    texture
}

/// Linear RGB as sRGB bytes.
fn coded(colour: &Field) -> Vec<u8> {
    /// Steps of a table: fine enough to separate the darkest codes.
    const STEPS: usize = 1 << 14;
    let table: Vec<u8> = (0..=STEPS).map(|step| code(step as f32 / STEPS as f32)).collect();
    let byte = |v: f32| table[(v.clamp(0.0, 1.0) * STEPS as f32 + 0.5) as usize];
    let [red, green, blue] = [0, 1, 2].map(|plane| colour.plane(plane));
    let mut bytes = vec![255; 4 * red.len()];
    bytes.par_chunks_exact_mut(4).enumerate().for_each(|(at, texel)| {
        texel[..3].copy_from_slice(&[byte(red[at]), byte(green[at]), byte(blue[at])]);
    });
    bytes
}

/// The sRGB code (IEC 61966-2-1) of a linear value between 0 and 1.
fn code(light: f32) -> u8 {
    let v = if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * math::pow(light, 1.0 / 2.4) - 0.055 };
    (v * 255.0).round() as u8
}

/// The colours of a palette as sRGB bytes.
fn row(palette: Palette) -> Vec<u8> {
    tints(palette).into_iter().flat_map(|[r, g, b]| [code(r), code(g), code(b), 255]).collect()
}
