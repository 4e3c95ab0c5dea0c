//! Fractional Brownian motion from octaves of gradient noise.
//!
//! K. Perlin (1985), "An image synthesizer"; K. Perlin (2002), "Improving noise"; F. K. Musgrave, C. E. Kolb and R. S.
//! Mace (1989), "The synthesis and rendering of eroded fractal terrains". Differences are described in
//! [`crate::numerics::noise`].

use crate::numerics::noise::{Gradients, fractal_params, sum, table};
use crate::{prelude::*, wgsl};

fractal_params! {
    wavelength: 4000.0, lacunarity: 2.0, gain: 0.5;
    /// Maximum height above and depth below zero; the standard deviation is about 0.12 of it at the defaults.
    amplitude: f64 = 1000.0, Metres, 0.0..=1e6, soft 0..=4000;
}

outputs! {
    /// Elevation, between ± `amplitude`.
    height: Height;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Perlin",
    category: "generate",
    summary: "Rolling hills: fractional Brownian motion from octaves of gradient noise.",
    doc: include_str!("perlin.md"),
    sources: &[
        "K. Perlin, 1985, An image synthesizer",
        "K. Perlin, 2002, Improving noise",
        "F. K. Musgrave, C. E. Kolb, R. S. Mace, 1989, The synthesis and rendering of eroded fractal terrains",
        "D. S. Ebert, F. K. Musgrave, D. Peachey, K. Perlin, S. Worley, 2003, Texturing and Modeling",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    gpu: Some(&GPU),
    example: "wavelength: 5000, octaves: 10, gain: 0.45, amplitude: 800, seed: 3",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "generate/perlin",
    source: wgsl!("generate/perlin"),
    library: &[wgsl::HASH, wgsl::LATTICE],
    values: &[("count", Number::U32), ("basis", Number::U32)],
    slots: &[Slot::words("octaves_of", "Octave"), Slot::output("height")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    tolerance: &[Tolerance::relative(4e-6)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let params = Params::read(job.params);
    let octaves = params.fractal(job.seed()).octaves(job.world());
    let basis = params.gradients.basis();
    let words = table::table(&octaves, basis, |octave| sum::scale(octave, params.amplitude) * basis.scale());
    let octaves_of = recorder.table(&words)?;
    let values = [("count", Scalar::U32(octaves.len() as u32)), ("basis", Scalar::U32(table::number(basis)))];
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("octaves_of", Bind::Scratch(octaves_of))],
        values: &values,
        over: Over::Cells(Rows::Around(0)),
    })
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let octaves = params.fractal(job.seed()).octaves(job.world());
    let samples = sum::lattices(job, &octaves, params.gradients.basis(), params.amplitude)?;
    Ok(Given { height: Some(Field::new(job.window(), samples)) }.into())
}

#[cfg(test)]
mod tests {
    use orograph_graph::World;

    use super::*;
    use crate::numerics::noise::{Basis, reference};
    use crate::{
        numerics::{math, noise::spectrum},
        testing::{at_every_level, block_means, generate, moments, seams, with_params, world},
    };

    const ROUGH: &str = "wavelength=700,octaves=9,lacunarity=2.13,gain=0.6,seed=5";

    #[test]
    fn the_raster_equals_the_reference_at_every_simd_level() {
        for changes in [ROUGH, "wavelength=90000,octaves=2", "wavelength=26,gradients=classic", "tileable=true"] {
            let window = Window { world: world(1000, 900, 10.0), origin: [37, 51], cells: [531, 201] };
            at_every_level(|| generate(window, &NODE, changes));
            let field = generate(window, &NODE, changes);
            let params = Params::read(&with_params(&NODE, changes));
            let octaves =
                params.fractal(orograph_graph::mix(orograph_graph::mix(params.seed.0))).octaves(&window.world);
            let basis = params.gradients.basis();
            assert!(!octaves.is_empty());
            for (at, &height) in field.samples().iter().enumerate() {
                let cell = [37 + (at % 531) as u32, 51 + (at / 531) as u32];
                let expected = octaves.iter().fold(0.0_f32, |sum, octave| {
                    let scale = sum::scale(octave, params.amplitude) * basis.scale();
                    sum + reference::sample(octave, basis, scale, cell)
                });
                assert_eq!(height.to_bits(), expected.to_bits(), "{cell:?}: {height} {expected}");
            }
        }
    }

    #[test]
    fn a_tile_has_the_bits_of_the_whole() {
        let world = world(700, 300, 12.5);
        let whole = generate(Window::whole(world), &NODE, ROUGH);
        for (origin, cells) in [([0, 0], [1, 1]), ([255, 63], [3, 3]), ([123, 77], [300, 200]), ([699, 0], [1, 300])] {
            let window = Window { world, origin, cells };
            assert_eq!(generate(window, &NODE, ROUGH), whole.crop(&window));
        }
    }

    /// The variance of an octave in closed form. With independent draws, of mean squares V of values, G of each
    /// gradient component and W of twists, it is 4 (V P² + 2 G P Q + W Q²) times the squared scale of the noise, with P
    /// and Q the means of φ² and ψ² over half a window.
    #[test]
    fn an_octave_has_its_standard_deviation() {
        let window = Window::whole(world(2048, 2048, 10.0));
        // 0.305 is the published value for the noise of 2002, scaled to ±1
        for (basis, [v, g, w], stated) in
            [(Basis::Bell, [0.1, 0.5, 2.0], 0.2055), (Basis::Classic, [0.0, 0.5, 0.0], 0.305)]
        {
            let mean = |part: usize| {
                let square = |k: u16| f64::from(basis.weights((f32::from(k) + 0.5) / 10_000.0)[part]);
                (0..10_000).map(|k| square(k) * square(k) / 10_000.0).sum::<f64>()
            };
            let (p, q) = (mean(0), mean(1));
            let closed = f64::from(basis.scale()) * (4.0 * (v * p * p + 2.0 * g * p * q + w * q * q)).sqrt();
            assert!((closed - stated).abs() < 5e-4, "{closed}");
            let gradients = if basis == Basis::Bell { "even" } else { "classic" };
            let changes = format!("wavelength=107,octaves=1,amplitude=1,gradients={gradients}");
            // about 36 000 lattice cells: the standard error of the estimate is about 0.4 %
            let (mean, std) = moments(generate(window, &NODE, &changes).samples());
            assert!((std / closed - 1.0).abs() < 0.01, "{std} {closed}");
            assert!(mean.abs() < 0.005, "{mean}");
        }
    }

    #[test]
    fn the_sum_has_the_deviation_the_manual_states() {
        let window = Window::whole(world(2048, 2048, 10.0));
        let (_, std) = moments(generate(window, &NODE, "wavelength=400,octaves=4,amplitude=1").samples());
        let expected = 0.2055 * ((1.0 - 1.0 / 256.0) / 0.75_f64).sqrt() / 1.875;
        assert!((std / expected - 1.0).abs() < 0.03, "{std} {expected}"); // 2600 hills
    }

    /// Tileable terrain has no seam: the steepest step across the sides of the world is not above the steepest inside.
    #[test]
    fn opposite_sides_of_a_tile_fit_together() {
        let field = generate(Window::whole(world(256, 192, 10.0)), &NODE, "wavelength=700,tileable=true,gain=0.6");
        let [within, across] = seams(&field);
        assert!(across <= within, "{across} {within}");
        let free = seams(&generate(Window::whole(world(256, 192, 10.0)), &NODE, "wavelength=700,gain=0.6"));
        assert!(free[1] > 5.0 * within, "{free:?} {within}");
    }

    /// The form of 2002: octaves of half the wavelength and half the amplitude each, divided by the sum of amplitudes,
    /// each written as in the paper.
    #[test]
    fn the_classic_form_is_the_textbooks() {
        let window = Window::whole(world(80, 70, 1.0));
        for octaves in 1..=4_usize {
            let changes = format!("wavelength=40,octaves={octaves},amplitude=1,gradients=classic");
            let field = generate(window, &NODE, &changes);
            let params = Params::read(&with_params(&NODE, &changes));
            let lattices = params.fractal(orograph_graph::mix(orograph_graph::mix(0))).octaves(&window.world);
            let total = 2.0 - [1.0, 0.5, 0.25, 0.125][octaves - 1];
            for (at, &got) in field.samples().iter().enumerate() {
                let cell = [(at % 80) as u32, (at / 80) as u32];
                let noise = |(octave, share): (_, f64)| share * reference::textbook_at(octave, cell);
                let shares = [1.0, 0.5, 0.25, 0.125];
                let expected = lattices.iter().zip(shares).map(noise).sum::<f64>() * std::f64::consts::SQRT_2 / total;
                assert!((f64::from(got) - expected).abs() < 1e-6, "{cell:?}: {got} {expected}");
            }
        }
    }

    /// A finer raster only adds detail: low-pass filtered, it equals the coarse raster. To 2 %; to 4 % where fine
    /// octaves are strong, because values at lattice points also give them a little power at long waves.
    #[test]
    fn finer_cells_only_add_detail() {
        for (changes, tolerance) in [("", 0.02), ("gain=0.6,lacunarity=2.3", 0.04)] {
            let coarse = generate(Window::whole(world(256, 256, 64.0)), &NODE, changes);
            let fine = generate(Window::whole(world(512, 512, 32.0)), &NODE, changes);
            let (_, std) = moments(coarse.samples());
            // The low-pass filter: means over 512 m.
            let (coarse, fine) = (block_means(&coarse, 8), block_means(&fine, 16));
            let difference: Vec<f32> = coarse.iter().zip(&fine).map(|(a, b)| a - b).collect();
            let (offset, rms) = moments(&difference);
            assert!(rms < tolerance * std && offset.abs() < 0.003 * std, "{changes}: {rms} {offset} of {std}");
        }
    }

    /// The power spectrum falls with exponent 2 + 2H, H = −ln gain / ln lacunarity (F. K. Musgrave, 1993; D. Saupe,
    /// 1988): the mean of six seeds is within 0.15.
    #[test]
    fn the_spectrum_falls_with_the_hurst_exponent() {
        for (lacunarity, gain) in [(2.0, 0.5), (2.0, 0.7), (1.9, 0.5)] {
            let mean = (0..6)
                .map(|seed| {
                    let changes = format!("wavelength=128,octaves=8,lacunarity={lacunarity},gain={gain},seed={seed}");
                    let field = generate(Window::whole(world(512, 512, 1.0)), &NODE, &changes);
                    spectrum::fall(field.samples(), 512, 8.0, 128.0)
                })
                .sum::<f64>()
                / 6.0;
            let hurst = -math::ln(gain) / math::ln(lacunarity);
            assert!((mean - (2.0 + 2.0 * hurst)).abs() < 0.15, "lacunarity {lacunarity}, gain {gain}: {mean}");
        }
    }

    /// The mean of e^(4iα) and e^(8iα) over the aspects α of all cells: 0 for isotropic terrain, 1 for a square
    /// pyramid. For 9 · 10⁵ cells, of which some 10⁵ are independent, the expected random value is 0.003.
    #[test]
    fn no_direction_is_preferred() {
        for changes in ["", "gain=0.62", "lacunarity=2.3,gain=0.6,seed=9"] {
            let field = generate(Window::whole(world(950, 950, 20.0)), &NODE, changes);
            let at = |i: usize, j: usize| f64::from(field.samples()[j * 950 + i]);
            for fold in [4.0, 8.0] {
                let sum = (1..949).flat_map(|j| (1..949).map(move |i| (i, j))).fold([0.0, 0.0], |sum, (i, j)| {
                    let aspect = math::atan2(at(i, j + 1) - at(i, j - 1), at(i + 1, j) - at(i - 1, j));
                    [sum[0] + math::cos(fold * aspect), sum[1] + math::sin(fold * aspect)]
                });
                let harmonic = math::hypot(sum[0], sum[1]) / (948.0 * 948.0);
                assert!(harmonic < 0.02, "{changes}: {harmonic} of {fold}");
            }
        }
    }

    /// The power of the finest octaves is isotropic: the mean of four seeds in ten bins of 9° is within 10 %. Classic
    /// noise has 30 % more along axes than along diagonals; the random variation is 3 %.
    #[test]
    fn the_spectrum_is_the_same_in_every_direction() {
        for changes in ["lacunarity=2", "lacunarity=2.3", "lacunarity=1.9"] {
            let powers = crate::testing::power_by_direction(&NODE, changes);
            assert!(powers.iter().all(|p| (p - 1.0).abs() < 0.1), "{changes}: {powers:?}");
        }
    }

    #[test]
    fn nothing_extreme_breaks_it() {
        let sizes = [1e-3, 1.0, 1e6].map(|cell_m| world(70, 5, cell_m));
        let changes = [
            "wavelength=1",
            "wavelength=1e6,octaves=24,lacunarity=1.1,gain=1",
            "wavelength=1e6,octaves=24,lacunarity=8,gain=0",
            "amplitude=0",
            "amplitude=1e6,octaves=1",
        ];
        for (world, changes) in sizes.into_iter().flat_map(|world| changes.map(|changes| (world, changes))) {
            let field = generate(Window::whole(world), &NODE, changes);
            let amplitude = Params::read(&with_params(&NODE, changes)).amplitude as f32;
            assert!(field.samples().iter().all(|h| h.abs() <= amplitude * 1.000_01), "{changes} {world:?}");
        }
        let seam = World { cells: [65_536, 1], size: [65_536.0, 1.0], ..World::default() };
        let end = Window { world: seam, origin: [65_530, 0], cells: [6, 1] };
        assert!(generate(end, &NODE, "wavelength=2.5").samples().iter().all(|h| h.is_finite()));
    }
}
