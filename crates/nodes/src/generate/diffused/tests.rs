//! The mean filter compared with explicit layers and with its Gaussian limit.

use orograph_graph::Window;

use super::*;
use crate::{
    numerics::math,
    testing::{at_every_level, block_means, generate, moments, world},
};

/// Reference: layers of the mean filter, cell by cell, mirrored half a cell beyond the sides.
fn explicit(noise: &[f64], nx: usize, alpha: f64, layers: u32) -> Vec<f64> {
    let ny = noise.len() / nx;
    let mut values = noise.to_vec();
    for _ in 0..layers {
        let at = |i: i64, j: i64| {
            let [i, j] = [(i, nx), (j, ny)].map(|(k, n)| if k < 0 { 0 } else { (k as usize).min(n - 1) });
            values[j * nx + i]
        };
        let mean = |(place, value): (usize, &f64)| {
            let (i, j) = ((place % nx) as i64, (place / nx) as i64);
            let sum: f64 =
                (-1..=1).flat_map(|dj| (-1..=1).map(move |di| (di, dj))).map(|(di, dj)| at(i + di, j + dj)).sum();
            (1.0 - alpha) * value + alpha * (sum + value) / 10.0
        };
        values = values.iter().enumerate().map(mean).collect();
    }
    values
}

fn noise(len: usize) -> Vec<f64> {
    (0..len as u32).map(|k| f64::from(mix(k) >> 8) / f64::from(1 << 24) - 0.5).collect()
}

/// Returns the result of the filter on given noise, before scaling.
fn filtered(noise: &[f64], [nx, ny]: [u32; 2], response: impl Fn(f64) -> f64 + Sync) -> Vec<f64> {
    let window = Window::whole(world(nx, ny, 1.0));
    let params = ParamValues::defaults(&NODE.specs());
    let job = Job {
        node: &NODE,
        params: &params,
        inputs: Vec::new(),
        window,
        wanted: orograph_graph::Wanted::ALL,
        folder: std::path::PathBuf::new(),
        cancel: orograph_graph::Cancel::default(),
        progress: &|_| (),
        warnings: orograph_graph::Warnings::default(),
        level: orograph_graph::LevelJob::default(),
        glimpses: None,
    };
    let response = |x: f64, y: f64| response(mean(x, y));
    mirror::filter(&job, noise.to_vec(), nx as usize, response).expect("a result")
}

fn assert_same(got: &[f64], expected: &[f64], what: &str) {
    let largest = expected.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    for (got, expected) in got.iter().zip(expected) {
        // double precision throughout: a few hundred roundings
        assert!((got - expected).abs() < 1e-11 * largest, "{what}: {got} {expected}");
    }
}

#[test]
fn waves_give_what_explicit_layers_give() {
    for (nx, ny) in [(64, 48), (37, 50), (1, 20), (17, 1), (2, 3), (1, 1)] {
        let noise = noise((nx * ny) as usize);
        for (alpha, layers) in [(0.5, 0), (0.5, 1), (0.5, 10), (0.8, 150), (1.0, 7)] {
            let got = filtered(&noise, [nx, ny], |mean| power(layer(alpha, mean), layers));
            assert_same(&got, &explicit(&noise, nx as usize, alpha, layers), &format!("{nx} x {ny} {alpha} {layers}"));
        }
        for (alpha, doublings) in [(0.5, 4), (0.7, 8)] {
            let mut expected = explicit(&noise, nx as usize, alpha, 1);
            for i in 1..=doublings {
                let layers = explicit(&noise, nx as usize, alpha, 1 << i);
                expected.iter_mut().zip(layers).for_each(|(h, f)| *h = alpha * *h + (1.0 - alpha) * f);
            }
            let got = filtered(&noise, [nx, ny], |mean| blend(alpha, doublings, mean));
            assert_same(&got, &expected, &format!("{nx} x {ny} fractal {doublings}"));
        }
    }
}

#[test]
fn relief_is_the_root_mean_square_of_every_form() {
    let window = Window::whole(world(256, 256, 10.0));
    for changes in [
        "form=gaussian,correlation=60,octaves=1,tileable=true",
        "form=gaussian,correlation=60,octaves=2",
        "form=layers,layers=20",
        "form=fractal,octaves=4,alpha=0.7",
    ] {
        let (_, deviation) = moments(generate(window, &NODE, &format!("relief=80,{changes}")).samples());
        // about 500 independent hills of 120 m, and a mean that is not removed
        assert!((deviation / 80.0 - 1.0).abs() < 0.1, "{changes}: {deviation}");
    }
}

/// Gaussian-smoothed noise has the autocorrelation exp(−r² / 4ℓ²).
#[test]
fn heights_are_alike_over_the_correlation_length() {
    let land = generate(Window::whole(world(512, 512, 10.0)), &NODE, "correlation=60,octaves=1,tileable=true,relief=1");
    for cells in [5, 10, 15] {
        for [di, dj] in [[cells, 0], [0, cells]] {
            let product = (0..512 * 512).map(|at| {
                let beside = (at / 512 + dj) % 512 * 512 + (at + di) % 512;
                f64::from(land.samples()[at]) * f64::from(land.samples()[beside])
            });
            let got = product.sum::<f64>() / (512.0 * 512.0);
            let distance = cells as f64 / 6.0;
            // two thousand independent hills
            assert!((got - math::exp(-0.25 * distance * distance)).abs() < 0.06, "{cells} {di}: {got}");
        }
    }
}

/// L layers of the filter have a standard deviation of √(0.6 α L) cells.
#[test]
fn many_layers_are_a_gaussian() {
    let mut impulse = vec![0.0; 101 * 101];
    impulse[50 * 101 + 50] = 1.0;
    let spread = filtered(&impulse, [101, 101], |mean| power(layer(0.8, mean), 150));
    assert!((spread.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    let variance = 0.6 * 0.8 * 150.0;
    let (mut error, mut total) = (0.0, 0.0);
    for (at, value) in spread.iter().enumerate() {
        let [x, y] = [at % 101, at / 101].map(|k| k as f64 - 50.0);
        let gauss = math::exp(-0.5 * (x * x + y * y) / variance) / (std::f64::consts::TAU * variance);
        error += (value - gauss) * (value - gauss);
        total += gauss * gauss;
    }
    // the excess kurtosis of one layer, divided by 150 layers
    assert!((error / total).sqrt() < 2e-3, "{}", (error / total).sqrt());
}

#[test]
fn gaussian_land_is_the_same_at_every_cell_count_and_the_seed_is_read() {
    let land = |cells: u32, changes: &str| {
        generate(Window::whole(world(cells, cells, 9600.0 / f64::from(cells))), &NODE, changes)
    };
    let changes = "correlation=800,octaves=2";
    let coarse = land(96, changes);
    let fine = block_means(&land(288, changes), 3);
    let error: f64 = coarse.samples().iter().zip(&fine).map(|(a, b)| f64::from((a - b) * (a - b))).sum();
    // means over cells of 100 m of hills of 400 m lose (100 / 400)² / 24
    assert!((error / fine.len() as f64).sqrt() < 0.01 * 200.0, "{error}");
    for form in ["gaussian", "layers", "fractal"] {
        let first = land(40, &format!("form={form}"));
        assert_ne!(first, land(40, &format!("form={form},seed=1")));
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        assert_eq!(first, one.install(|| land(40, &format!("form={form}"))));
        at_every_level(|| land(40, &format!("form={form}")));
    }
}
