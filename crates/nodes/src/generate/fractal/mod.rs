//! Fractals other than the plain sum: each octave of gradient noise depends on those before it.
//!
//! Common to all kinds: heights are h = amplitude (r − μ) / 3σ, where r is the result of the recursion and μ and σ are
//! its mean and standard deviation for these parameters. Octaves are independent of each other, so both are measured
//! from the recursion at independent places of each octave: at fixed places, not on the terrain. A window, a finer
//! raster and another seed therefore have the same μ and σ. The recursions are in `rules`.

use crate::numerics::noise::{
    Gradients, Octave, fold, fractal_params,
    raster::{self, Combine, LANES, Lanes, Noise},
    scattered::Scattered,
    sheet::Sheets,
    table,
};
use crate::{prelude::*, wgsl};

mod rules;
#[cfg(test)]
mod tests;

use rules::{Finish, Layer, Rule};

choice! {
    /// How octaves are combined.
    pub enum Kind {
        /// Octaves folded upwards: round knolls between sharp clefts, like clouds or old dunes.
        Billow = "billow",
        /// Low ground smooth, high ground rough: valley floors among mountains.
        Hybrid = "hybrid",
        /// Roughness grows with height, more strongly: plains that rise to rugged terrain.
        Heterogeneous = "heterogeneous",
        /// Fine octaves fade on steep slopes, as if worn: smooth flanks, detail on ridges and valley floors.
        Eroded = "eroded",
        /// Ridges that pull finer octaves towards them: flanks with gullies that run downhill.
        Swiss = "swiss",
        /// Squared noise, displaced by its own slopes and damped on level ground: worn mountains.
        Jordan = "jordan",
        /// Plain hills that turn to ridges between the elevations `low` and `high`.
        Blend = "blend",
    }
}

fractal_params! {
    [
        /// How octaves are combined.
        kind: Kind = Kind::Hybrid, One, ..;
    ]
    wavelength: 5000.0, lacunarity: 2.0, gain: 0.5;
    /// Three standard deviations of the heights about their mean of 0: nearly all terrain lies between ± this.
    amplitude: f64 = 1000.0, Metres, 0.0..=1e6, soft 0..=4000;
    /// Added to the noise before octaves are multiplied: lower values make low ground smoother.
    offset: f64 = 0.7, One, 0.0..=2.0, soft 0.4..=1.2, when kind = "hybrid" | "heterogeneous";
    /// How much detail rough ground has: 0 as published, where details of a low `gain` vanish.
    detail: f64 = 1.0, One, 0.0..=1.0, when kind = "hybrid";
    /// How strongly slopes damp finer octaves, 1 as published.
    damping: f64 = 1.0, One, 0.0..=4.0, when kind = "eroded" | "jordan";
    /// How far octaves are displaced by those before them, 1 as published.
    warp: f64 = 1.0, One, 0.0..=2.0, when kind = "swiss" | "jordan";
    /// Elevation of the base (the first two octaves) below which a blend has no ridges.
    low: f64 = -150.0, Metres, -1e6..=1e6, soft -1000..=1000, when kind = "blend";
    /// Elevation of the base above which a blend is all ridges.
    high: f64 = 450.0, Metres, -1e6..=1e6, soft -1000..=2000, when kind = "blend";
}

outputs! {
    /// Elevation about 0; `amplitude` is three standard deviations.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Fractal",
    version: 2,
    migrations: &[Migration { from: 1, steps: &[Step::Keep { name: "detail", value: "0" }] }],
    category: "generate",
    summary: "Billows, multifractals and turbulence: noise whose octaves depend on each other.",
    doc: include_str!("page.md"),
    sources: &[
        "F. K. Musgrave, C. E. Kolb, R. S. Mace, 1989, The synthesis and rendering of eroded fractal terrains",
        "D. S. Ebert, F. K. Musgrave, D. Peachey, K. Perlin, S. Worley, 2003, Texturing and Modeling, chapter 16",
        "I. Quilez, 2008, Value noise derivatives and analytic derivatives of fractal sums",
        "G. de Carpentier, R. Bidarra, 2009, Interactive GPU-based procedural heightfield brushes",
        "G. de Carpentier, 2011, Scape: procedural extensions",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&GPU),
    example: "kind: eroded, wavelength: 6000, gain: 0.5, amplitude: 1500, seed: 2",
    ..Node::DEFAULT
};

/// Samples per side of the area on which moments are measured: about 9000 cells of each octave's lattice.
const SIDE: usize = 256;

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    // lines of the octaves on the area of the moments, with their slopes if these are used
    let per_octave = match params.kind {
        Kind::Swiss | Kind::Jordan => return 128 << 10,
        Kind::Eroded => 78 << 10,
        _ => 56 << 10,
    };
    per_octave * (1 + params.octaves as u64)
}

static SHADER: Shader = Shader {
    name: "generate/fractal",
    source: wgsl!("generate/fractal"),
    library: &[wgsl::MATH, wgsl::HASH, wgsl::LATTICE],
    values: &[
        ("count", Number::U32),
        ("count_all", Number::U32),
        ("basis", Number::U32),
        ("factor", Number::F32),
        ("lift_m", Number::F32),
        ("unit_m", Number::F32),
        ("per_metre", Number::F32),
    ],
    slots: &[Slot::words("octaves_of", "Octave"), Slot::words("layers", "Layer"), Slot::output("height")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    // octaves that displace each other lie between the positions of the lattice table
    covers: |params| !matches!(Params::read(params).kind, Kind::Swiss | Kind::Jordan),
    // octaves multiply each other's differences
    tolerance: &[Tolerance::relative(5e-5)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let params = Params::read(job.params);
    let octaves = params.fractal(job.seed()).octaves(job.world());
    let Constants { layers, finish, scale, lift_m } = match params.kind {
        Kind::Billow => params.constants::<rules::Billow, 1>(&octaves),
        Kind::Hybrid => params.constants::<rules::Hybrid, 2>(&octaves),
        Kind::Heterogeneous => params.constants::<rules::Heterogeneous, 1>(&octaves),
        Kind::Eroded => params.constants::<rules::Eroded, 3>(&octaves),
        Kind::Swiss => params.constants::<rules::Swiss, 4>(&octaves),
        Kind::Jordan => params.constants::<rules::Jordan, 5>(&octaves),
        Kind::Blend => params.constants::<rules::Blend, 4>(&octaves),
    };
    let (basis, factor) = (params.gradients.basis(), params.gradients.even_scale());
    let octaves_of = recorder.table(&table::table(&octaves, basis, |_| factor))?;
    let words: Vec<u32> = layers.iter().flat_map(|layer| layer.words().map(f32::to_bits)).collect();
    let layers_of = recorder.table(&words)?;
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("octaves_of", Bind::Scratch(octaves_of)), ("layers", Bind::Scratch(layers_of))],
        values: &[
            ("count", Scalar::U32(octaves.len() as u32)),
            ("count_all", Scalar::U32(layers.len() as u32)),
            ("basis", Scalar::U32(table::number(basis))),
            ("factor", Scalar::F32(scale)),
            ("lift_m", Scalar::F32(lift_m)),
            ("unit_m", Scalar::F32(finish.unit_m)),
            ("per_metre", Scalar::F32(finish.per_metre)),
        ],
        over: Over::Cells(Rows::Around(0)),
    })
}

/// Constants of a recursion on a raster.
struct Constants {
    /// Those of all octaves; octaves that are too fine for the raster come last.
    layers: Vec<Layer>,
    finish: Finish,
    /// Metres per unit of the result, and the offset in metres.
    scale: f32,
    lift_m: f32,
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let samples = match params.kind {
        Kind::Billow => params.raster::<rules::Billow, 1>(job)?,
        Kind::Hybrid => params.raster::<rules::Hybrid, 2>(job)?,
        Kind::Heterogeneous => params.raster::<rules::Heterogeneous, 1>(job)?,
        Kind::Eroded => params.raster::<rules::Eroded, 3>(job)?,
        Kind::Swiss => params.raster::<rules::Swiss, 4>(job)?,
        Kind::Jordan => params.raster::<rules::Jordan, 5>(job)?,
        Kind::Blend => params.raster::<rules::Blend, 4>(job)?,
    };
    Ok(Given { height: Some(Field::new(job.window(), samples)) }.into())
}

impl Params {
    fn raster<R: Rule<N>, const N: usize>(&self, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
        let octaves = self.fractal(job.seed()).octaves(job.world());
        let Constants { mut layers, finish, scale, lift_m } = self.constants::<R, N>(&octaves);
        let left = layers.split_off(octaves.len());
        let recursion = Recursion::<R, N> { layers, left, finish, scale, lift_m, rule: std::marker::PhantomData };
        let (basis, factor) = (self.gradients.basis(), self.gradients.even_scale());
        if R::SHIFTS {
            raster::raster(job, || Scattered::all(&octaves, basis, factor), &recursion)
        } else if R::SLOPES {
            raster::raster(job, || Sheets::sloped(&octaves, basis, |_| factor), &recursion)
        } else {
            raster::raster(job, || Sheets::new(&octaves, basis, |_| factor), &recursion)
        }
    }

    fn constants<R: Rule<N>, const N: usize>(&self, octaves: &[Octave]) -> Constants {
        let (mean, std) = self.moments::<R, N>();
        let scale = if std > 0.0 { self.amplitude / (3.0 * std) } else { 0.0 };
        Constants {
            layers: self.layers(octaves.iter().map(|octave| (octave.wavelength_cells, octave.fade))),
            finish: self.finish(),
            scale: scale as f32,
            lift_m: (-scale * mean) as f32,
        }
    }

    /// Returns the mean and standard deviation of the recursion with all its octaves.
    fn moments<R: Rule<N>, const N: usize>(&self) -> (f64, f64) {
        let octaves = self.fractal(0).spread();
        let recursion = Recursion::<R, N> {
            layers: self.layers(octaves.iter().map(|_| (1e6, 1.0))),
            left: Vec::new(),
            finish: self.finish(),
            scale: 1.0,
            lift_m: 0.0,
            rule: std::marker::PhantomData,
        };
        let (basis, factor) = (self.gradients.basis(), self.gradients.even_scale());
        if R::SHIFTS {
            raster::moments(&mut Scattered::all(&octaves, basis, factor), &recursion, SIDE)
        } else if R::SLOPES {
            raster::moments(&mut Sheets::sloped(&octaves, basis, |_| factor), &recursion, SIDE)
        } else {
            raster::moments(&mut Sheets::new(&octaves, basis, |_| factor), &recursion, SIDE)
        }
    }

    /// Returns the constants of all requested octaves. `held` gives, for those on the raster, the cells per wavelength
    /// and the fraction that the raster can represent.
    fn layers(&self, held: impl Iterator<Item = (f64, f64)>) -> Vec<Layer> {
        let means = [|n| n, |n| n * n, |n: f64| (1.0 - n) * (1.0 - n)]
            .map(|function: fn(f64) -> f64| fold::mean(self.gradients, function) as f32);
        let unit_m = f64::from(self.finish().unit_m);
        let broad = if self.kind == Kind::Blend { 2 } else { 1 };
        let mut ratio = 1.0;
        let mut held = held.fuse();
        let amplitudes = self.fractal(0).amplitudes().collect::<Vec<_>>();
        (0..)
            .zip(&amplitudes)
            .map(|(k, &amplitude)| {
                let (wavelength_cells, fade) = held.next().unwrap_or((1.0, 0.0));
                let layer = Layer {
                    gain: match (self.kind, k) {
                        (Kind::Jordan, 0 | 1) => 0.8 * self.gain,
                        (Kind::Jordan, _) => 0.8 * amplitudes[k - 1],
                        _ => amplitude,
                    } as f32,
                    ratio: ratio as f32,
                    fade: fade as f32,
                    fold: fold::Fold::new(wavelength_cells, 1.0),
                    means: means.map(|mean| (1.0 - fade as f32) * mean),
                    steepness: (unit_m * amplitude * ratio / self.wavelength) as f32,
                    lift: if amplitude > 0.0 {
                        crate::numerics::math::pow(amplitude, -self.detail) as f32
                    } else {
                        1.0
                    },
                    first: if k < broad { 1.0 } else { 0.0 },
                    offset: self.offset as f32,
                    damping: match (self.kind, k) {
                        (Kind::Jordan, 0 | 1) => 0.0,
                        (Kind::Jordan, _) => self.damping.min(1.0),
                        _ => self.damping,
                    } as f32,
                    warp: self.warp as f32,
                    fall: self.gain as f32,
                };
                ratio *= self.lacunarity;
                layer
            })
            .collect()
    }

    fn finish(&self) -> Finish {
        let plain: f64 = self.fractal(0).amplitudes().map(|amplitude| amplitude * amplitude).sum();
        Finish {
            unit_m: (self.amplitude / (3.0 * 0.305 * plain.sqrt())) as f32,
            low_m: self.low as f32,
            per_metre: (1.0 / (self.high - self.low).max(0.001)) as f32,
        }
    }
}

/// A recursion with all its constants.
struct Recursion<R, const N: usize> {
    /// Octaves on the raster, and octaves that are too fine for it, which contribute their means.
    layers: Vec<Layer>,
    left: Vec<Layer>,
    finish: Finish,
    /// Metres per unit of the result, and the offset in metres.
    scale: f32,
    lift_m: f32,
    rule: std::marker::PhantomData<R>,
}

impl<R: Rule<N>, const N: usize> Combine for Recursion<R, N> {
    type State = [Lanes; N];
    type Layer = Layer;
    const SLOPES: bool = R::SLOPES;

    fn layer(&self, octave: usize) -> Layer {
        self.layers[octave]
    }

    fn start(&self) -> [Lanes; N] {
        R::START.map(Lanes::splat)
    }

    #[inline(always)]
    fn octave(layer: &Layer, noise: &Noise, state: &mut [Lanes; N]) {
        for lane in 0..LANES {
            let mut own = [0.0; N];
            for part in 0..N {
                own[part] = state[part].0[lane];
            }
            R::step(layer, noise.value[lane], [noise.slope[0][lane], noise.slope[1][lane]], &mut own);
            for part in 0..N {
                state[part].0[lane] = own[part];
            }
        }
    }

    #[inline(always)]
    fn shift(layer: &Layer, state: &[Lanes; N]) -> [[f32; LANES]; 2] {
        let [mut along, mut down] = [[0.0; LANES]; 2];
        for (lane, (along, down)) in along.iter_mut().zip(&mut down).enumerate() {
            let mut own = [0.0; N];
            for part in 0..N {
                own[part] = state[part].0[lane];
            }
            [*along, *down] = R::shift(layer, &own);
        }
        [along, down]
    }

    #[inline(always)]
    fn finish(&self, state: &[Lanes; N]) -> Lanes {
        let mut state = *state;
        for layer in &self.left {
            Self::octave(layer, &Noise::level([0.0; LANES]), &mut state);
        }
        let mut heights = Lanes::splat(0.0);
        for lane in 0..LANES {
            let mut own = [0.0; N];
            for part in 0..N {
                own[part] = state[part].0[lane];
            }
            heights.0[lane] = self.scale * R::height(&self.finish, &own) + self.lift_m;
        }
        heights
    }
}
