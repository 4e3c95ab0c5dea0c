//! Ridged multifractal: octaves of gradient noise folded into crests, each weighted by the one before.
//!
//! F. K. Musgrave, in D. S. Ebert et al. (2003), "Texturing and Modeling", chapter 16. Differences: the sum is divided
//! by its maximum possible value; crests are rounded over a fraction of a cell; an octave that the raster cannot
//! represent is replaced by its mean, which is not zero, unlike that of plain noise: omitting it would lower the
//! terrain.

use crate::numerics::noise::{
    Basis, Gradients, Octave,
    fold::Fold,
    fractal_params,
    raster::{self, Lanes, Noise},
    sheet::Sheets,
    table,
};
use crate::{numerics::math, prelude::*, wgsl};

mod crest;

use crest::{Crest, Tail};

fractal_params! {
    wavelength: 6000.0, lacunarity: 2.2, gain: 0.48;
    /// Maximum height of crests; valleys do not fall below 0.
    amplitude: f64 = 2000.0, Metres, 0.0..=1e6, soft 0..=6000;
    /// Noise value, from 0 to 1, at which the slope down from a crest ends in a flat valley floor.
    offset: f64 = 1.0, One, 0.1..=2.0, soft 0.4..=1.2;
    /// Sharpness of crests: 1 gives straight flanks, more gives steep crests above wide valleys.
    exponent: f64 = 2.0, One, 0.5..=8.0, soft 1..=4;
    /// How strongly an octave's height weights the next: low values keep valleys smooth, high ones roughen everything.
    weight_gain: f64 = 2.0, One, 0.0..=100.0, soft 0.5..=4;
    /// How much the exponent decreases from octave to octave: at 1, the finest octave has 0.6 of `exponent`.
    sharpening: f64 = 0.0, One, 0.0..=1.0;
}

outputs! {
    /// Elevation, from 0 to `amplitude`.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Ridged",
    category: "generate",
    summary: "Mountain crests above smoother valleys: a ridged multifractal.",
    doc: include_str!("ridged.md"),
    sources: &[
        "F. K. Musgrave, C. E. Kolb, R. S. Mace, 1989, The synthesis and rendering of eroded fractal terrains",
        "D. S. Ebert, F. K. Musgrave, D. Peachey, K. Perlin, S. Worley, 2003, Texturing and Modeling, chapter 16",
        "K. Perlin, 2002, Improving noise",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    gpu: Some(&GPU),
    example: "wavelength: 6000, octaves: 12, lacunarity: 2.3, gain: 0.48, amplitude: 2400",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "generate/ridged",
    source: wgsl!("generate/ridged"),
    library: &[wgsl::MATH, wgsl::HASH, wgsl::LATTICE],
    values: &[
        ("count", Number::U32),
        ("basis", Number::U32),
        ("squared", Number::U32),
        ("linear", Number::F32),
        ("square", Number::F32),
    ],
    slots: &[Slot::words("octaves_of", "Octave"), Slot::words("layers", "Layer"), Slot::output("height")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    // the weights of octaves multiply their differences
    tolerance: &[Tolerance::relative(2e-5)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let params = Params::read(job.params);
    let octaves = params.fractal(job.seed()).octaves(job.world());
    let ridges = Ridges::<false>::new(&params, &octaves);
    let octaves_of = recorder.table(&table::table(&octaves, ridges.basis, |_| ridges.scale))?;
    let words = ridges.layers.iter().flat_map(|layer| {
        let ([round, half_per_round, top], crest) = (layer.fold.parts(), layer.crest);
        let rest = [layer.height_m, layer.fade, layer.rest, crest.exponent, crest.weight_gain];
        [round, half_per_round, top].into_iter().chain(rest).map(f32::to_bits)
    });
    let layers = recorder.table(&words.collect::<Vec<u32>>())?;
    let [linear, square] = ridges.tail.factors();
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("octaves_of", Bind::Scratch(octaves_of)), ("layers", Bind::Scratch(layers))],
        values: &[
            ("count", Scalar::U32(octaves.len() as u32)),
            ("basis", Scalar::U32(table::number(ridges.basis))),
            ("squared", Scalar::U32(u32::from(params.is_squared()))),
            ("linear", Scalar::F32(linear)),
            ("square", Scalar::F32(square)),
        ],
        over: Over::Cells(Rows::Around(0)),
    })
}

impl Params {
    /// Returns true if every octave's crest is a square.
    fn is_squared(&self) -> bool {
        self.exponent == 2.0 && self.sharpening == 0.0
    }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let octaves = params.fractal(job.seed()).octaves(job.world());
    let samples = if params.is_squared() {
        Ridges::<true>::new(&params, &octaves).raster(job, &octaves)?
    } else {
        Ridges::<false>::new(&params, &octaves).raster(job, &octaves)?
    };
    Ok(Given { height: Some(Field::new(job.window(), samples)) }.into())
}

/// The recursion over octaves with its constants. `SQUARED` is the special case of an exponent of 2, which is several
/// times as fast.
struct Ridges<const SQUARED: bool> {
    /// The kind of noise and its scale.
    basis: Basis,
    scale: f32,
    /// Constants of each octave on the raster.
    layers: Vec<Layer>,
    /// Mean contribution of octaves that are too fine for the raster.
    tail: Tail,
}

/// Constants of one octave. Noise is in units of `offset`.
#[derive(Clone, Copy, Debug)]
struct Layer {
    crest: Crest,
    fold: Fold,
    /// Maximum height that the octave adds, in metres.
    height_m: f32,
    /// Fraction of the octave that the raster can represent, and the contribution that replaces the rest.
    fade: f32,
    rest: f32,
}

/// State of the samples between octaves.
#[derive(Clone, Copy, Debug)]
struct State {
    height: Lanes,
    /// Weight of the next octave.
    weight: Lanes,
}

impl<const SQUARED: bool> Ridges<SQUARED> {
    fn new(params: &Params, octaves: &[Octave]) -> Self {
        let gradients = params.gradients;
        let fractal = params.fractal(0);
        let total: f64 = fractal.amplitudes().sum();
        let last = (params.octaves - 1).max(1) as f64;
        let crests = (0..params.octaves).map(|k| {
            let exponent = params.exponent * (1.0 - 0.4 * params.sharpening * k as f64 / last);
            Crest::new(gradients, params.offset, exponent, params.weight_gain)
        });
        let all: Vec<(Crest, f64)> =
            crests.zip(fractal.amplitudes()).map(|(crest, share)| (crest, params.amplitude * share / total)).collect();
        let layers = octaves.iter().zip(&all).map(|(octave, &(crest, _))| {
            let fade = octave.fade as f32;
            Layer {
                crest,
                fold: Fold::new(octave.wavelength_cells, params.offset),
                height_m: (params.amplitude * octave.share) as f32,
                fade,
                rest: crest.mean * (1.0 - fade),
            }
        });
        let scale = gradients.even_scale() * (1.0 / params.offset) as f32;
        Self { basis: gradients.basis(), scale, layers: layers.collect(), tail: Tail::new(&all[octaves.len()..]) }
    }

    fn raster(&self, job: &Job<'_>, octaves: &[Octave]) -> Result<Vec<f32>, NodeError> {
        raster::raster(job, || Sheets::new(octaves, self.basis, |_| self.scale), self)
    }
}

impl<const SQUARED: bool> raster::Combine for Ridges<SQUARED> {
    type State = State;
    type Layer = Layer;

    fn layer(&self, octave: usize) -> Layer {
        self.layers[octave]
    }

    fn start(&self) -> State {
        State { height: Lanes::splat(0.0), weight: Lanes::splat(1.0) }
    }

    #[inline(always)]
    fn octave(layer: &Layer, noise: &Noise, state: &mut State) {
        let samples = noise.value.iter().zip(&mut state.weight.0).zip(&mut state.height.0);
        if layer.fade == 1.0 {
            samples.for_each(|((noise, weight), height)| step::<SQUARED, true>(*noise, weight, height, layer));
        } else {
            samples.for_each(|((noise, weight), height)| step::<SQUARED, false>(*noise, weight, height, layer));
        }
    }

    #[inline(always)]
    fn finish(&self, state: &State) -> Lanes {
        let mut heights = state.height;
        for (height, weight) in heights.0.iter_mut().zip(&state.weight.0) {
            *height += self.tail.at(*weight);
        }
        heights
    }
}

/// Adds one octave at one sample: from the noise and the weight of the octave, adds to the height and computes the
/// weight of the next octave. `WHOLE` is for octaves that the raster represents fully, which are all but one or two.
#[inline(always)]
fn step<const SQUARED: bool, const WHOLE: bool>(noise: f32, weight: &mut f32, height: &mut f32, layer: &Layer) {
    let crest = layer.crest;
    let ridge = layer.fold.crest(noise).max(0.0);
    let ridge = if SQUARED { ridge * ridge } else { math::lane::pow(ridge, crest.exponent) };
    let ridge = *weight * if WHOLE { ridge } else { layer.rest + layer.fade * ridge };
    *height += layer.height_m * ridge;
    *weight = (crest.weight_gain * ridge).min(1.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::noise::reference;
    use crate::testing::{at_every_level, block_means, generate, moments, with_params, world};

    const STEEP: &str =
        "wavelength=900,octaves=10,lacunarity=2.13,exponent=1.4,offset=0.8,weight_gain=1.3,sharpening=0.5,seed=5";

    #[test]
    fn the_raster_equals_the_reference_at_every_simd_level() {
        for changes in [STEEP, "wavelength=26,gradients=classic", "wavelength=2"] {
            let window = Window { world: world(1000, 900, 10.0), origin: [37, 51], cells: [300, 99] };
            at_every_level(|| generate(window, &NODE, changes));
            let field = generate(window, &NODE, changes);
            let params = Params::read(&with_params(&NODE, changes));
            let octaves =
                params.fractal(orograph_graph::mix(orograph_graph::mix(params.seed.0))).octaves(&window.world);
            let ridges = Ridges::<true>::new(&params, &octaves);
            for (at, &got) in field.samples().iter().enumerate() {
                let cell = [37 + (at % 300) as u32, 51 + (at / 300) as u32];
                let (mut weight, mut height) = (1.0, [0.0]);
                for (octave, layer) in octaves.iter().zip(&ridges.layers) {
                    let noise = reference::sample(octave, ridges.basis, ridges.scale, cell);
                    let plain = params.exponent == 2.0 && params.sharpening == 0.0;
                    let step = if plain { step::<true, false> } else { step::<false, false> };
                    step(noise, &mut weight, &mut height[0], layer);
                }
                height[0] += ridges.tail.at(weight);
                assert_eq!(got.to_bits(), height[0].to_bits(), "{changes} {cell:?}: {got} {height:?}");
            }
        }
    }

    #[test]
    fn a_tile_has_the_bits_of_the_whole() {
        let world = world(700, 300, 12.5);
        let whole = generate(Window::whole(world), &NODE, STEEP);
        for (origin, cells) in [([0, 0], [1, 1]), ([255, 63], [3, 3]), ([123, 77], [300, 200])] {
            let window = Window { world, origin, cells };
            assert_eq!(generate(window, &NODE, STEEP), whole.crop(&window));
        }
    }

    /// The fractions that the manual states for Musgrave's parameters, measured on other seeds.
    #[test]
    fn the_manual_states_the_mean_and_the_deviation() {
        let window = Window::whole(world(2048, 2048, 1.0));
        let changes = "wavelength=640,octaves=8,lacunarity=2,gain=0.5,amplitude=1";
        let all: Vec<f32> =
            (0..8).flat_map(|seed| generate(window, &NODE, &format!("{changes},seed={seed}")).into_samples()).collect();
        let (mean, std) = moments(&all);
        assert!((mean - 0.54).abs() < 0.025, "{mean}");
        assert!((std - 0.175).abs() < 0.015, "{std}");
        assert!(all.iter().all(|h| (0.0..=1.0).contains(h)));
    }

    /// Also where the coarse raster has two octaves and the fine one four: omitted octaves do not lower the terrain.
    #[test]
    fn finer_cells_only_add_detail() {
        let cases = [
            ("", 40.0, 0.02),
            ("offset=0.7,weight_gain=1,gain=0.6", 40.0, 0.03),
            ("exponent=1.3,weight_gain=4", 40.0, 0.03),
            ("sharpening=1", 40.0, 0.02),
            ("octaves=8", 700.0, 0.15),
        ];
        for (changes, cell_m, tolerance) in cases {
            let coarse = generate(Window::whole(world(256, 256, cell_m)), &NODE, changes);
            let fine = generate(Window::whole(world(1024, 1024, cell_m / 4.0)), &NODE, changes);
            let (_, std) = moments(coarse.samples());
            let (coarse, fine) = (block_means(&coarse, 4), block_means(&fine, 16));
            let difference: Vec<f32> = coarse.iter().zip(&fine).map(|(a, b)| a - b).collect();
            let (offset, rms) = moments(&difference);
            assert!(rms < tolerance * std && offset.abs() < 0.02 * std, "{changes}: {rms} {offset} of {std}");
        }
    }

    /// The power of the finest octaves is isotropic to 10 % in bins of 9°. With classic noise, bins differ by up to a
    /// factor of two.
    #[test]
    fn the_spectrum_is_the_same_in_every_direction() {
        for changes in ["lacunarity=2", "lacunarity=2.3", "lacunarity=1.9"] {
            let powers = crate::testing::power_by_direction(&NODE, changes);
            assert!(powers.iter().all(|p| (p - 1.0).abs() < 0.1), "{changes}: {powers:?}");
        }
    }

    #[test]
    fn nothing_extreme_breaks_it() {
        let changes = [
            "wavelength=1,exponent=8",
            "wavelength=1e6,octaves=24,lacunarity=1.1,gain=1,weight_gain=100",
            "wavelength=1e6,octaves=24,lacunarity=8,gain=0,exponent=0.5",
            "weight_gain=0,offset=0.1",
            "amplitude=0",
            "offset=2,octaves=1",
        ];
        for cell_m in [1e-3, 1.0, 1e6] {
            for changes in changes {
                let field = generate(Window::whole(world(70, 5, cell_m)), &NODE, changes);
                let amplitude = Params::read(&with_params(&NODE, changes)).amplitude as f32;
                let sound = |h: &f32| (-1e-3..=amplitude * 1.000_01 + 1e-3).contains(h);
                assert!(field.samples().iter().all(sound), "{changes} {cell_m} {:?}", field.range(0));
            }
        }
    }
}
