//! Fractional Brownian motion from octaves of gradient noise.
//!
//! K. Perlin (1985), "An image synthesizer"; K. Perlin (2002), "Improving noise"; F. K. Musgrave, C. E. Kolb and R. S.
//! Mace (1989), "The synthesis and rendering of eroded fractal terrains". What differs from them is told in
//! [`super::noise`].

use super::noise::{
    Fractal, Gradients, NOISE_SCALE, Octave,
    raster::{self, Line},
};
use crate::prelude::*;
use crate::simd::simd;

params! {
    /// Wavelength of the largest hills.
    wavelength: f64 = 4000.0, Metres, 1.0..=1e6, soft 200..=20000;
    /// Octaves, from coarse to fine; those finer than the cells can hold are left out.
    octaves: i64 = 12, Count, 1..=24, soft 1..=16;
    /// Ratio of the wavelength of an octave to that of the next finer one.
    lacunarity: f64 = 2.0, One, 1.1..=8.0, soft 1.7..=3.0;
    /// Ratio of the amplitude of an octave to that of the one before: how rough the land is.
    gain: f64 = 0.5, One, 0.0..=1.0, soft 0.3..=0.7;
    /// Largest height above and depth below zero; the standard deviation is about 0.15 of it at the defaults.
    amplitude: f64 = 1000.0, Metres, 0.0..=1e6, soft 0..=4000;
    /// Directions of the gradients.
    gradients: Gradients = Gradients::Even, One, ..;
    /// Which of the endless landscapes this is.
    seed: Seed = Seed(0), Count, ..;
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
    outputs: &[Output::gives("height", PortType::Height, "Elevation, between ± `amplitude`.")],
    params: Params::specs,
    cpu: run,
    example: "wavelength: 5000, octaves: 10, gain: 0.45, amplitude: 800, seed: 3",
    ..Node::DEFAULT
};

impl Params {
    fn fractal(&self, seed: u32) -> Fractal {
        Fractal {
            wavelength_m: self.wavelength,
            octaves: self.octaves,
            lacunarity: self.lacunarity,
            gain: self.gain,
            gradients: self.gradients,
            seed,
        }
    }
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let octaves = params.fractal(job.seed()).octaves(job.cell_m());
    let sum = Sum::new(&octaves, params.amplitude);
    let samples = raster::raster(job, &octaves, &sum)?;
    Ok(Outputs::one("height", Field::new(job.window(), samples)))
}

/// Factor on an octave's noise: its share of the amplitude.
fn scale(octave: &Octave, amplitude: f64) -> f32 {
    (amplitude * octave.share * octave.fade) as f32 * NOISE_SCALE
}

/// The plain sum of octaves.
pub(crate) struct Sum {
    scales: Vec<f32>,
}

impl Sum {
    /// The sum with that amplitude, in the unit of the result.
    pub(crate) fn new(octaves: &[Octave], amplitude: f64) -> Self {
        Self { scales: octaves.iter().map(|octave| scale(octave, amplitude)).collect() }
    }
}

impl raster::Combine for Sum {
    fn scale(&self, octave: usize) -> f32 {
        self.scales[octave]
    }

    fn row(&self, octaves: &[Line], heights: &mut Line) {
        sum(octaves, heights);
    }
}

simd! {
    /// Sums octaves, two at a time to spare loads and stores.
    fn sum(octaves: &[Line], heights: &mut Line) {
        heights.row_mut().fill(0.0);
        let mut pairs = octaves.chunks_exact(2);
        for pair in &mut pairs {
            let (coarse, fine) = (pair[0].row(), pair[1].row());
            for ((height, coarse), fine) in heights.row_mut().iter_mut().zip(coarse).zip(fine) {
                *height = (*height + coarse) + fine;
            }
        }
        for last in pairs.remainder() {
            for (height, noise) in heights.row_mut().iter_mut().zip(last.row()) {
                *height += noise;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::World;

    use super::{super::noise::reference, *};
    use crate::{
        generate::noise::spectrum,
        math,
        testing::{at_every_level, block_means, generate, moments, with_params, world},
    };

    const ROUGH: &str = "wavelength=700,octaves=9,lacunarity=2.13,gain=0.6,seed=5";

    #[test]
    fn the_raster_equals_the_reference_at_every_simd_level() {
        for changes in [ROUGH, "wavelength=90000,octaves=2", "wavelength=26,gradients=classic"] {
            let window = Window { world: world(1000, 900, 10.0), origin: [37, 51], cells: [531, 201] };
            at_every_level(|| generate(window, &NODE, changes));
            let field = generate(window, &NODE, changes);
            let params = Params::read(&with_params(&NODE, changes));
            let seed = orograph_graph::mix(orograph_graph::mix(params.seed.0));
            let fractal = params.fractal(seed);
            let octaves = fractal.octaves(10.0);
            assert!(!octaves.is_empty());
            for (at, &height) in field.samples().iter().enumerate() {
                let cell = [37 + (at % 531) as u32, 51 + (at / 531) as u32];
                let expected = octaves.iter().fold(0.0_f32, |sum, octave| {
                    sum + reference::sample(octave, scale(octave, params.amplitude), cell)
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

    /// The variance of an octave in closed form: with independent gradients of variance ½ a component, independent values
    /// of variance 1/12 and four corners of weight w = (1 − q(s)) (1 − q(t)) it is the square of the factor on the noise
    /// times 4 ∫(1 − q)² ds (∫(1 − q)² s² ds + ∫(1 − q)² ds / 12).
    #[test]
    fn an_octave_has_its_standard_deviation() {
        let n = 10_000;
        let moment = |power: f64| {
            (0..n)
                .map(|k| {
                    let s = (f64::from(k) + 0.5) / f64::from(n);
                    let weight = 1.0 - s * s * s * (s * (s * 6.0 - 15.0) + 10.0);
                    weight * weight * math::pow(s, power) / f64::from(n)
                })
                .sum::<f64>()
        };
        let closed = f64::from(NOISE_SCALE) * (4.0 * moment(0.0) * (moment(2.0) + moment(0.0) / 12.0)).sqrt();
        assert!((closed - 0.259).abs() < 5e-4, "{closed}");
        let window = Window::whole(world(2048, 2048, 10.0));
        // Some 36 000 lattice cells: the deviation of the estimate is about 0.4 %.
        let (mean, std) =
            moments(generate(window, &NODE, "wavelength=107,octaves=1,amplitude=1,lacunarity=2").samples());
        assert!((std / closed - 1.0).abs() < 0.01, "{std}");
        assert!(mean.abs() < 0.005, "{mean}");
    }

    #[test]
    fn the_sum_has_the_deviation_the_manual_states() {
        let window = Window::whole(world(2048, 2048, 10.0));
        let (_, std) = moments(generate(window, &NODE, "wavelength=400,octaves=4,amplitude=1").samples());
        let expected = 0.259 * ((1.0 - 1.0 / 256.0) / 0.75_f64).sqrt() / 1.875;
        assert!((std / expected - 1.0).abs() < 0.03, "{std} {expected}"); // 2600 hills
    }

    /// A finer raster adds detail and changes nothing else: seen through a low-pass filter it is the coarse raster.
    /// To 3 %: values at lattice points give the fine octaves a little power at long waves too, and means over squares
    /// are no sharp filter.
    #[test]
    fn finer_cells_only_add_detail() {
        for changes in ["wavelength=4000,octaves=12", "wavelength=4000,octaves=12,gain=0.6,lacunarity=2.3"] {
            let coarse = generate(Window::whole(world(256, 256, 64.0)), &NODE, changes);
            let fine = generate(Window::whole(world(512, 512, 32.0)), &NODE, changes);
            let (_, std) = moments(coarse.samples());
            // The low-pass filter: means over 512 m.
            let (coarse, fine) = (block_means(&coarse, 8), block_means(&fine, 16));
            let difference: Vec<f32> = coarse.iter().zip(&fine).map(|(a, b)| a - b).collect();
            let (offset, rms) = moments(&difference);
            assert!(rms < 0.03 * std && offset.abs() < 0.002 * std, "{changes}: {rms} {offset} of {std}");
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

    /// The mean of e^(4iα) and e^(8iα) over the aspects α of all cells: 0 for land without preferred directions, 1 for a
    /// square pyramid. At 9 · 10⁵ cells of some 10⁵ independent ones chance alone gives 0.003.
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

    /// The power of the finest octaves is the same in every direction: the mean of four seeds in ten bins of 9° is within
    /// 10 %. Lattices that are not turned prefer axes over diagonals by 45 %; chance alone gives 2 %.
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
