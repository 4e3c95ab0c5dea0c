//! Cuts terrain into steps, as left by layers of rock or by river terraces.

mod steps;

use orograph_graph::memory::copied;

use self::steps::Uneven;
use crate::numerics::noise::{Basis, Fractal, Octave, sum, table};
use crate::{
    numerics::{
        cells::{BLOCK, blocks, masked, samples},
        math,
        simd::simd,
    },
    prelude::*,
    wgsl,
};

choice! {
    /// Placement of the steps.
    pub enum Steps {
        /// Everywhere, with the height `step`.
        Even = "even",
        /// At the heights of `layers`.
        Layers = "layers",
    }
}

params! {
    /// Placement of the steps.
    steps: Steps = Steps::Even, One, ..;
    /// Height of a step.
    step: f64 = 100.0, Metres, 0.01..=1e5, soft 5..=500, when steps = "even";
    /// How steep risers and how flat treads are: 1 leaves the terrain unchanged, from 8 upwards treads are level.
    sharpness: f64 = 3.0, One, 1.0..=32.0, soft 1..=12, when steps = "even";
    /// Height of each tread above `base`, in ascending order, and the sharpness of the riser that begins there.
    layers: StepPoints = StepPoints(vec![[0.0, 2.0], [200.0, 8.0], [350.0, 4.0], [800.0, 12.0], [950.0, 3.0], [1400.0, 1.0]]), One, .., when steps = "layers";
    /// How much steps differ from each other and from place to place: 0 for a staircase.
    ///
    /// They differ in sharpness, even ones also in height, and are absent in places.
    variation: f64 = 0.6, One, 0.0..=1.0;
    /// How far edges are broken into headlands and alcoves: 0 for edges that follow contour lines.
    edges: f64 = 0.6, One, 0.0..=1.0;
    /// Size of the largest alcoves; steps are absent over some multiples of it.
    edge_size: f64 = 600.0, Metres, 0.01..=1e6, soft 50..=3000;
    /// How much gentler the foot of a riser is than its top: 0 for equal halves.
    talus: f64 = 0.5, One, 0.0..=1.0;
    /// Random seed of the variation.
    seed: Seed = Seed(0), Count, ..;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// A height at which a tread lies, per cell if wired.
    base: Scalar(Metres) = 0.0, -1e6..=1e6, soft -1000.0..=1000.0;
    /// Where terraces are cut: fully at 1, not at all at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// Terraced terrain.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Terrace",
    version: 2,
    migrations: &[Migration {
        from: 1,
        steps: &[
            Step::Keep { name: "variation", value: "0" },
            Step::Keep { name: "edges", value: "0" },
            Step::Keep { name: "talus", value: "0" },
        ],
    }],
    category: "filter",
    summary: "Cuts terrain into steps with a height in metres.",
    doc: include_str!("page.md"),
    sources: &[
        "F. K. Musgrave, C. E. Kolb and R. S. Mace, 1989, The synthesis and rendering of eroded fractal terrains",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&GPU),
    example: "height: \"base\", step: 400, sharpness: 6",
    ..Node::DEFAULT
};

/// Wavelength of the noise by which steps are absent and dip, in sizes of alcoves.
const WIDE: f64 = 5.0;
/// Salts of the noises: two wide ones and that of the edges.
const SALTS: [u32; 3] = [0x510e_527f, 0x9b05_688c, 0x1f83_d9ab];

static SHADER: Shader = Shader {
    name: "filter/terrace",
    source: wgsl!("filter/terrace"),
    library: &[wgsl::MATH, wgsl::HASH, wgsl::LATTICE],
    values: &[
        ("k_uneven", Number::U32),
        ("k_wide", Number::U32),
        ("k_fine", Number::U32),
        ("k_layers", Number::U32),
        ("k_hash", Number::U32),
        ("k_limits", Number::F32),
        ("k_dip", Number::F32),
    ],
    slots: &[
        Slot::input("height"),
        Slot::input("base"),
        Slot::input("mask"),
        Slot::words("octaves_of", "Octave"),
        Slot::words("layers_of", "Layer"),
        Slot::output("height"),
    ],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    // level steps are passed on by the CPU, which also explains what is wrong with a table
    covers: |params| {
        let params = Params::read(params);
        params.layers().is_ok_and(|layers| !params.level(&layers))
    },
    // risers are up to 32 times as steep as the terrain, whose heights are rounded
    tolerance: &[Tolerance::relative(2e-6)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let params = Params::read(job.params);
    let layers = params.layers()?;
    let hash = orograph_graph::mix(job.seed());
    let is_uneven = !params.uneven(hash).none();
    let octaves = if is_uneven { params.octaves(job) } else { Default::default() };
    let scale = |octave: &Octave| sum::scale(octave, 1.0) * Basis::Bell.scale();
    let octaves_of = recorder.table(&table::table(&octaves.concat(), Basis::Bell, scale))?;
    let of_layer = |layer: &Layer| [layer.tread, layer.step, layer.sharpness].map(f32::to_bits);
    let layers_of = recorder.table(&layers.iter().flat_map(of_layer).collect::<Vec<_>>())?;
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("octaves_of", Bind::Scratch(octaves_of)), ("layers_of", Bind::Scratch(layers_of))],
        values: &[
            ("k_uneven", Scalar::U32(u32::from(is_uneven))),
            ("k_wide", Scalar::U32(octaves[0].len() as u32)),
            ("k_fine", Scalar::U32(octaves[2].len() as u32)),
            ("k_layers", Scalar::U32(layers.len() as u32)),
            ("k_hash", Scalar::U32(hash)),
            ("k_limits", Scalar::F32(steps::LIMITS)),
            ("k_dip", Scalar::F32(steps::DIP)),
        ],
        over: Over::Cells(Rows::Around(0)),
    })
}

/// Memory that the kernel needs in addition to its inputs and outputs: the noises.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    if params.uneven(0).none() { 0 } else { sizing.cells(12.0) }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { height, base, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let layers = params.layers()?;
    if params.level(&layers) {
        return Ok(Given { height: Some(height.clone()) }.into());
    }
    let mut out = copied(height.samples())?;
    let uneven = params.uneven(orograph_graph::mix(job.seed()));
    let noises = if uneven.none() { None } else { Some(params.noises(job)?) };
    blocks(job, [0.0, 1.0], &mut out, |cells, first| {
        let (mut spare_base, mut spare_mask) = ([0.0; BLOCK], [0.0; BLOCK]);
        let base = samples(base, first, cells.len(), &mut spare_base);
        let mask = samples(mask, first, cells.len(), &mut spare_mask);
        let noises = noises.as_ref().map(|noises| noises.each_ref().map(|noise| &noise[first..first + cells.len()]));
        match (noises, layers.is_empty()) {
            (None, true) => cut(cells, base, mask, params.step as f32, params.sharpness as f32),
            (None, false) => cut_layers(cells, base, mask, &layers),
            (Some(noises), true) => {
                cut_uneven(cells, base, mask, noises, uneven, params.step as f32, params.sharpness as f32);
            }
            (Some(noises), false) => cut_uneven_layers(cells, base, mask, noises, uneven, &layers),
        }
    })?;
    Ok(Given { height: Some(Field::new(job.window(), out)) }.into())
}

impl Params {
    fn uneven(&self, seed: u32) -> Uneven {
        Uneven { variation: self.variation as f32, edges: self.edges as f32, talus: self.talus as f32, seed }
    }

    /// Returns the steps of the table, none for even steps.
    fn layers(&self) -> Result<Vec<Layer>, NodeError> {
        match self.steps {
            Steps::Even => Ok(Vec::new()),
            Steps::Layers => layers(&self.layers.0),
        }
    }

    /// Returns true if steps leave the terrain unchanged.
    fn level(&self, layers: &[Layer]) -> bool {
        if layers.is_empty() { self.sharpness == 1.0 } else { layers.iter().all(|layer| layer.sharpness == 1.0) }
    }

    /// Returns the octaves of the noises: two wide ones and that of the edges.
    fn octaves(&self, job: &Job<'_>) -> [Vec<Octave>; 3] {
        let noise = |salt: u32, wavelength_m: f64, octaves: i64, gain: f64| {
            let seed = orograph_graph::mix(job.seed() ^ salt);
            Fractal { wavelength_m, octaves, lacunarity: 2.0, gain, tileable: false, seed }.octaves(job.world())
        };
        let wide_m = WIDE * self.edge_size;
        [noise(SALTS[0], wide_m, 2, 0.5), noise(SALTS[1], wide_m, 2, 0.5), noise(SALTS[2], self.edge_size, 6, 0.6)]
    }

    /// Returns the noises of the cells, each within ±1.
    fn noises(&self, job: &Job<'_>) -> Result<[Vec<f32>; 3], NodeError> {
        let [first, second, edges] = self.octaves(job);
        let noise = |octaves: Vec<Octave>| sum::lattices(job, &octaves, Basis::Bell, 1.0);
        Ok([noise(first)?, noise(second)?, noise(edges)?])
    }
}

/// A step between two treads of a table.
#[derive(Clone, Copy, Debug)]
struct Layer {
    tread: f32,
    step: f32,
    sharpness: f32,
}

/// Returns the steps of a table.
fn layers(table: &[[f64; 2]]) -> Result<Vec<Layer>, NodeError> {
    let is_wrong = |[height, sharpness]: &&[f64; 2]| height.abs() > 1e6 || !(1.0..=32.0).contains(sharpness);
    if let Some([height, sharpness]) = table.iter().find(is_wrong) {
        return Err(NodeError::failed_with_hint(
            format!("there is a layer at {height} m with a sharpness of {sharpness}"),
            "give each layer a height within 1000 km and a sharpness from 1 to 32",
        ));
    }
    let layer = |pair: &[[f64; 2]]| Layer {
        tread: pair[0][0] as f32,
        step: ((pair[1][0] - pair[0][0]) as f32).max(f32::MIN_POSITIVE),
        sharpness: pair[0][1] as f32,
    };
    Ok(table.windows(2).map(layer).collect())
}

/// Maps the position `rest` within a step to the new one; both are 0 to 1.
#[inline(always)]
fn riser(rest: f32, sharpness: f32) -> f32 {
    // distance from the nearer tread: 0 there, 1 in the middle of the riser
    let upper = rest > 0.5;
    let near = if upper { 2.0 - 2.0 * rest } else { 2.0 * rest };
    let lift = 0.5 * math::lane::pow(near, sharpness);
    if upper { 1.0 - lift } else { lift }
}

simd! {
    fn cut(heights: &mut [f32], base: &[f32], mask: &[f32], step: f32, sharpness: f32) {
        for ((height, &base), &mask) in heights.iter_mut().zip(base).zip(mask) {
            let u = (*height - base) / step;
            let tread = u.floor();
            *height = masked(*height, base + step * (tread + riser(u - tread, sharpness)), mask);
        }
    }
}

simd! {
    fn cut_layers(heights: &mut [f32], base: &[f32], mask: &[f32], layers: &[Layer]) {
        let last = layers[layers.len() - 1];
        for ((height, &base), &mask) in heights.iter_mut().zip(base).zip(mask) {
            let above = *height - base;
            let mut here = layers[0];
            for layer in layers {
                here = if above >= layer.tread { *layer } else { here };
            }
            let rest = ((above - here.tread) / here.step).clamp(0.0, 1.0);
            let stepped = base + here.tread + here.step * riser(rest, here.sharpness);
            let outside = (above < here.tread) | (above >= last.tread + last.step) | (here.sharpness == 1.0);
            *height = masked(*height, if outside { *height } else { stepped }, mask);
        }
    }
}

simd! {
    fn cut_uneven(
        heights: &mut [f32],
        base: &[f32],
        mask: &[f32],
        noises: [&[f32]; 3],
        uneven: Uneven,
        step: f32,
        sharpness: f32,
    ) {
        let [wide, other, edges] = noises;
        let noises = wide.iter().zip(other).zip(edges);
        for (((height, &base), &mask), ((&a, &b), &c)) in heights.iter_mut().zip(base).zip(mask).zip(noises) {
            let stepped = uneven.even((*height - base) / step, sharpness, [a, b, c]);
            *height = masked(*height, base + step * stepped, mask);
        }
    }
}

simd! {
    fn cut_uneven_layers(
        heights: &mut [f32],
        base: &[f32],
        mask: &[f32],
        noises: [&[f32]; 3],
        uneven: Uneven,
        layers: &[Layer],
    ) {
        let last = layers[layers.len() - 1];
        let [wide, other, edges] = noises;
        let noises = wide.iter().zip(other).zip(edges);
        for (((height, &base), &mask), ((&a, &b), &c)) in heights.iter_mut().zip(base).zip(mask).zip(noises) {
            let above = *height - base;
            let (mut here, mut index) = (layers[0], 0.0);
            for (layer, k) in layers.iter().zip(0_u16..) {
                let reached = above >= layer.tread;
                here = if reached { *layer } else { here };
                index = if reached { f32::from(k) } else { index };
            }
            let rest = ((above - here.tread) / here.step).clamp(0.0, 1.0);
            let stepped = base + here.tread + here.step * uneven.riser(rest, here.sharpness, index, [a, b, c]);
            let outside = (above < here.tread) | (above >= last.tread + last.step) | (here.sharpness == 1.0);
            *height = masked(*height, if outside { *height } else { stepped }, mask);
        }
    }
}

#[cfg(test)]
mod tests;
