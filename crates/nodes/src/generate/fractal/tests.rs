//! Every kind compared with closed forms and published values, and properties that all kinds share.

use super::*;
use crate::testing::{at_every_level, block_means, generate, moments, seams, with_params, world};

const KINDS: [&str; 7] = ["billow", "hybrid", "heterogeneous", "eroded", "swiss", "jordan", "blend"];

fn measured<R: Rule<N>, const N: usize>(changes: &str) -> (f64, f64) {
    Params::read(&with_params(&NODE, changes)).moments::<R, N>()
}

/// The published values for Perlin's noise with eight octaves (Musgrave's parameters), to 2 % of the standard
/// deviation, the sampling error of 9000 cells.
#[test]
fn moments_are_those_of_the_literature() {
    let classic = "octaves=8,gradients=classic";
    let (mean, std) = measured::<rules::Billow, 1>(&format!("kind=billow,{classic}"));
    let total = 2.0 - 1.0 / 128.0;
    assert!((mean / total + 0.50).abs() < 0.01 && (std / total - 0.205).abs() < 0.004, "{mean} {std}");
    let (mean, std) = measured::<rules::Hybrid, 2>(&format!("kind=hybrid,detail=0,{classic}"));
    assert!((mean - 0.98).abs() < 0.02 && (std - 0.43).abs() < 0.01, "{mean} {std}");
    let alps = "kind=hybrid,detail=0,lacunarity=2.5,gain=0.45,octaves=16,gradients=classic";
    let (mean, std) = measured::<rules::Hybrid, 2>(alps);
    assert!((mean - 0.943).abs() < 0.02 && (std - 0.415).abs() < 0.01, "{mean} {std}");
}

/// The mean of heterogeneous octaves is a product, since they are independent. Without damping the eroded sum is the
/// plain one.
#[test]
fn moments_are_those_of_closed_forms() {
    let (mean, _) = measured::<rules::Heterogeneous, 1>("kind=heterogeneous,octaves=6,offset=1");
    let expected: f64 = (1..6).map(|k| 1.0 + crate::numerics::math::pow(0.5, f64::from(k))).product();
    assert!((mean / expected - 1.0).abs() < 0.01, "{mean} {expected}");
    let (mean, std) = measured::<rules::Eroded, 3>("kind=eroded,octaves=6,damping=0");
    let expected = 0.305 * (f64::from(4095) / f64::from(4096) / 0.75).sqrt();
    assert!(mean.abs() < 0.01 && (std / expected - 1.0).abs() < 0.015, "{mean} {std} {expected}");
}

/// On terrain of about 2600 hills: the mean to 0.06 of the standard deviation, the standard deviation to 5 %.
#[test]
fn land_has_the_mean_and_the_deviation_it_is_scaled_to() {
    for kind in KINDS {
        let window = Window::whole(world(1024, 1024, 10.0));
        let land = generate(window, &NODE, &format!("kind={kind},wavelength=200,amplitude=300,octaves=5"));
        let (mean, std) = moments(land.samples());
        assert!(mean.abs() < 6.0 && (std - 100.0).abs() < 5.0, "{kind}: {mean} {std}");
    }
}

#[test]
fn equal_bits_at_every_simd_level_and_in_every_window() {
    for kind in KINDS {
        let changes = format!("kind={kind},wavelength=900,lacunarity=2.13,octaves=9,seed=5");
        let whole = Window::whole(world(331, 150, 12.5));
        at_every_level(|| generate(whole, &NODE, &changes));
        let land = generate(whole, &NODE, &changes);
        for (origin, cells) in [([0, 0], [1, 1]), ([255, 63], [3, 3]), ([123, 17], [200, 130])] {
            let window = Window { origin, cells, ..whole };
            assert_eq!(generate(window, &NODE, &changes), land.crop(&window), "{kind}");
        }
        assert!(land != generate(whole, &NODE, &format!("{changes},gradients=classic")), "{kind}");
    }
}

/// Without damping, an eroded fractal is `Perlin` up to scale and rounding.
#[test]
fn without_damping_it_is_the_plain_sum() {
    let window = Window::whole(world(200, 150, 20.0));
    let land = generate(window, &NODE, "kind=eroded,damping=0,octaves=8");
    let plain = generate(window, &super::super::perlin::NODE, "wavelength=5000,octaves=8");
    // the measured mean of the recursion is 0 only to a percent of the standard deviation
    let [land, plain] = [land, plain].map(|field| {
        let first = f64::from(field.samples()[0]);
        field.samples().iter().map(|h| f64::from(*h) - first).collect::<Vec<f64>>()
    });
    let ratio = land[20_000] / plain[20_000];
    for (land, plain) in land.iter().zip(&plain) {
        assert!((land - ratio * plain).abs() < 1e-2, "{land} {plain}");
    }
}

/// Where the base is below `low` a blend is the plain sum, and where it is above `high` it is all ridges.
#[test]
fn a_blend_is_plain_below_and_ridged_above() {
    let window = Window::whole(world(200, 150, 20.0));
    let plain = generate(window, &NODE, "kind=blend,low=1e5,high=1e6");
    let perlin = generate(window, &super::super::perlin::NODE, "wavelength=5000,octaves=12");
    let ratio = f64::from(plain.samples()[7]) / f64::from(perlin.samples()[7]);
    for (a, b) in plain.samples().iter().zip(perlin.samples()) {
        // the measured mean of the recursion is 0 only to a percent of the standard deviation
        assert!((f64::from(*a) - ratio * f64::from(*b)).abs() < 15.0);
    }
    let ridged = generate(window, &NODE, "kind=blend,low=-1e6,high=-1e5");
    assert_ne!(plain, ridged);
    assert_ne!(generate(window, &NODE, "kind=blend"), ridged);
}

/// A finer raster only adds detail: means over 512 m are those of the coarse raster, to 2 %.
#[test]
fn finer_cells_only_add_detail() {
    for kind in KINDS {
        let changes = format!("kind={kind}");
        let coarse = generate(Window::whole(world(256, 256, 64.0)), &NODE, &changes);
        let fine = generate(Window::whole(world(512, 512, 32.0)), &NODE, &changes);
        let (_, std) = moments(coarse.samples());
        let (coarse, fine) = (block_means(&coarse, 8), block_means(&fine, 16));
        let difference: Vec<f32> = coarse.iter().zip(&fine).map(|(a, b)| a - b).collect();
        let (offset, rms) = moments(&difference);
        assert!(rms < 0.02 * std && offset.abs() < 0.015 * std, "{kind}: {} {}", rms / std, offset / std);
    }
}

/// The power of waves of 4 to 8 cells, on terrain with octaves of 16, 8 and 4 cells, is isotropic to 10 % in bins of
/// 9°. A single octave is less isotropic than a sum of many: its waves shorter than its lattice cells prefer the axes.
/// They dominate where finer octaves are weak, so the gain is that of Musgrave's hybrid, 2^-0.25.
#[test]
fn the_spectrum_is_the_same_in_every_direction() {
    for kind in KINDS {
        let changes = format!("kind={kind},wavelength=16,octaves=3,gain=0.84,amplitude=5,low=-1,high=2");
        let powers = crate::testing::power_by_direction(&NODE, &changes);
        assert!(powers.iter().all(|p| (p - 1.0).abs() < 0.1), "{kind}: {powers:?}");
    }
}

#[test]
fn opposite_sides_of_a_tile_fit_together() {
    for kind in KINDS {
        let changes = format!("kind={kind},wavelength=700,tileable=true");
        let field = generate(Window::whole(world(256, 192, 10.0)), &NODE, &changes);
        let [within, across] = seams(&field);
        assert!(across <= 1.2 * within, "{kind}: {across} {within}");
    }
}

#[test]
fn nothing_extreme_breaks_it() {
    let changes = [
        "wavelength=1",
        "wavelength=1e6,octaves=24,lacunarity=1.1,gain=1,offset=2",
        "wavelength=1e6,octaves=24,lacunarity=8,gain=1,amplitude=1e6,damping=0,warp=2",
        "wavelength=1e6,octaves=24,lacunarity=8,gain=1,amplitude=1e6,damping=4,warp=2",
        "gain=0,offset=0,octaves=1",
        "amplitude=0",
        "tileable=true,low=5,high=5",
    ];
    for (cell_m, kind) in [1e-3, 1.0, 1e6].into_iter().flat_map(|cell_m| KINDS.map(|kind| (cell_m, kind))) {
        for changes in changes {
            let field = generate(Window::whole(world(70, 5, cell_m)), &NODE, &format!("kind={kind},{changes}"));
            assert!(field.samples().iter().all(|h| h.is_finite()), "{kind} {changes} {cell_m}");
        }
    }
}
