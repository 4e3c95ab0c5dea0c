//! Spectra, relief, isotropy, seams and cell sizes of spectral synthesis.

use orograph_graph::{Window, World};

use super::*;
use crate::{
    numerics::noise::spectrum,
    testing::{at_every_level, block_means, generate, moments, outputs_on, with_params, world},
};

/// The direct sum of waves, without transforms.
#[test]
fn the_land_is_the_sum_of_its_waves() {
    for (nx, ny, tileable) in [(16, 16, true), (12, 7, true), (8, 8, false), (5, 9, false), (1, 6, false)] {
        let world = world(nx, ny, 50.0);
        let params = with_params(&NODE, &format!("outer_scale=400,inner_scale=60,tileable={tileable}"));
        let got = generate(Window::whole(world), &NODE, &format!("outer_scale=400,inner_scale=60,tileable={tileable}"));
        let params = Params::read(&params);
        let power = Power::new(&params);
        let torus = if tileable { Torus::tiled(&world) } else { Torus::around(&world, 400.0) };
        let seed = orograph_graph::mix(orograph_graph::mix(0));
        let direct = torus.by_definition(&world, Draw { seed, even: false }, &power);
        for (got, direct) in got.samples().iter().zip(direct) {
            // heights of 250 m in single precision
            assert!((f64::from(*got) - direct).abs() < 2e-4, "{nx} x {ny} {tileable}: {got} {direct}");
        }
    }
}

/// The surface's spectral exponent is β + 1 for the profile convention and β for the surface convention.
#[test]
fn power_falls_with_the_exponent() {
    for (changes, beta) in [("beta=2", 3.0), ("beta=2.6", 3.6), ("beta=2,convention=surface", 2.0)] {
        let mean = (0..12).map(|seed| {
            let changes = format!("outer_scale=8000,inner_scale=1,seed={seed},{changes}");
            let land = generate(Window::whole(world(256, 256, 16.0)), &NODE, &changes);
            spectrum::fall(land.samples(), 256, 5.0, 64.0)
        });
        let mean = mean.sum::<f64>() / 12.0;
        // a twelfth of the variance of single terrains, 0.09²; the Hann window lowers it by 0.02 to 0.03
        assert!((mean - beta).abs() < 0.05, "{changes}: {mean}");
    }
}

#[test]
fn relief_is_the_root_mean_square() {
    // 32 outer scales per side, and the shortest waves have 8 cells
    let land = Window::whole(world(512, 512, 10.0));
    for changes in ["", "beta=1.5", "convention=surface,beta=2", "stretch=4", "amplitudes=even,beta=4"] {
        let changes = format!("relief=70,outer_scale=320,inner_scale=80,tileable=true,{changes}");
        let (mean, deviation) = moments(generate(land, &NODE, &changes).samples());
        assert!(mean.abs() < 1e-3, "{changes}: mean {mean}");
        // about a thousand waves near the outer scale, with random amplitudes
        assert!((deviation / 70.0 - 1.0).abs() < 0.05, "{changes}: {deviation}");
    }
    let changes = "relief=70,outer_scale=320,inner_scale=80,tileable=true,amplitudes=even";
    let (_, deviation) = moments(generate(land, &NODE, changes).samples());
    // the difference between the sum over waves and the integral
    assert!((deviation / 70.0 - 1.0).abs() < 2e-3, "{deviation}");
}

#[test]
fn no_direction_stands_out_unless_stretched() {
    let mut powers = [0.0; 10];
    for seed in 0..6 {
        let changes = format!("outer_scale=2000,inner_scale=1,beta=3,seed={seed}");
        let land = generate(Window::whole(world(512, 512, 16.0)), &NODE, &changes);
        let of_one = spectrum::by_direction(land.samples(), 512, 5.0, 12.0);
        powers.iter_mut().zip(of_one).for_each(|(sum, power)| *sum += power / 6.0);
    }
    // six terrains of 1500 waves per bin
    assert!(powers.iter().all(|power| (power - 1.0).abs() < 0.05), "{powers:?}");

    // stretched to the east, slopes to the east are lower by the stretch
    let land = generate(
        Window::whole(world(512, 512, 16.0)),
        &NODE,
        "stretch=4,azimuth=90,outer_scale=1000,inner_scale=200,tileable=true",
    );
    let slope = |step: usize| {
        let pairs = land.samples().iter().zip(&land.samples()[step..]);
        pairs.map(|(a, b)| f64::from((a - b) * (a - b))).sum::<f64>().sqrt()
    };
    let ratio: f64 = slope(512) / slope(1);
    // cells of a twelfth of the shortest waves along the stretch, and of a sixth of those across it
    assert!((3.8..4.2).contains(&ratio), "{ratio}");
}

/// Steps between cells across the sides of a tileable terrain are like those inside.
#[test]
fn a_tileable_land_has_no_seams_and_another_one_does() {
    let window = Window::whole(World { size: [9600.0, 6400.0], ..world(150, 100, 64.0) });
    for (tileable, seamless) in [(true, true), (false, false)] {
        let land = generate(window, &NODE, &format!("tileable={tileable}"));
        let at = |i: usize, j: usize| f64::from(land.samples()[j * 150 + i]);
        let difference = |pairs: Vec<f64>| (pairs.iter().map(|d| d * d).sum::<f64>() / pairs.len() as f64).sqrt();
        let seam = difference((0..100).map(|j| at(149, j) - at(0, j)).collect());
        let within = difference((0..100).map(|j| at(74, j) - at(75, j)).collect());
        assert_eq!(seam < 2.0 * within, seamless, "{tileable}: {seam} {within}");
    }
}

/// Averaged to coarse cells, fine terrain equals the coarse terrain: waves keep their phase for any ratio of cells.
#[test]
fn the_same_land_at_every_cell_count() {
    for tileable in [false, true] {
        let land = |cells: u32| {
            let window = Window::whole(world(cells, cells, 9600.0 / f64::from(cells)));
            generate(window, &NODE, &format!("tileable={tileable},inner_scale=1000,outer_scale=4000"))
        };
        let coarse = land(96);
        for factor in [2, 3] {
            let fine = block_means(&land(96 * factor as u32), factor);
            let error: f64 = coarse.samples().iter().zip(&fine).map(|(a, b)| f64::from((a - b) * (a - b))).sum::<f64>();
            let rms = (error / fine.len() as f64).sqrt();
            // means over cells of 100 m lose up to π²/6 (100 / 700)² of the shortest waves, 3 %
            assert!(rms < 0.01 * 250.0, "{factor}: {rms}");
        }
    }
}

#[test]
fn any_world_any_thread_and_any_vector() {
    for (nx, ny, cell_m) in [(1, 1, 10.0), (1, 1, 1e-3), (3, 500, 16.0), (500, 3, 1e4), (37, 90, 100.0), (64, 64, 1.0)]
    {
        let window = Window::whole(world(nx, ny, cell_m));
        let land = generate(window, &NODE, "");
        assert!(land.samples().iter().all(|v| v.is_finite()), "{nx} x {ny}");
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        assert_eq!(one.install(|| generate(window, &NODE, "")), land);
    }
    at_every_level(|| generate(Window::whole(world(45, 64, 100.0)), &NODE, "tileable=true"));
}

#[test]
fn scales_the_wrong_way_around_are_refused() {
    let params = with_params(&NODE, "outer_scale=100,inner_scale=100");
    let error = outputs_on(Window::whole(world(8, 8, 10.0)), &NODE, &params, &[]);
    assert!(matches!(error, Err(NodeError::Failed { hint: Some(hint), .. }) if hint.contains("below 100")));
}
