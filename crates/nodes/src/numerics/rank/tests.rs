//! Ranks compared with sorted neighbourhoods, on level, steep and periodic terrain.

use orograph_graph::{Boundary, Edge, Window, World, mix};

use crate::numerics::rank::*;
use crate::testing::{with_job, world};

fn ranked(window: Window, samples: &[f32], radius_m: f64, share: f64) -> Vec<f32> {
    with_job(window, |job| rank(job, [0.0, 1.0], samples, radius_m, share, Beyond::Mirrored)).expect("a result")
}

/// Reference: sorts the neighbourhood of each cell.
fn brute_force(window: &Window, samples: &[f32], radius: f64, share: f64) -> Vec<f32> {
    let ends = [0, 1].map(|axis| Ends::of(window, axis));
    let circle = Circle::new(radius);
    let reach = circle.reach() as i64;
    let inside = |x: i64, y: i64| match &circle {
        Circle::Cells(cells) => cells.contains(&[x, y]),
        Circle::Steps(steps) => steps.contains(x.abs() as i16, y.abs() as i16),
    };
    let around: Vec<[i64; 2]> =
        (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| [x, y])).filter(|[x, y]| inside(*x, *y)).collect();
    assert_eq!(around.len(), circle.count());
    let (nx, ny) = (window.nx(), window.ny());
    (0..nx * ny)
        .map(|at| {
            let value = |[x, y]: &[i64; 2]| {
                let row = ends[1].index((at / nx) as i64 + y, ny);
                samples[row * nx + ends[0].index((at % nx) as i64 + x, nx)]
            };
            let mut values: Vec<f32> = around.iter().map(value).collect();
            values.sort_by(f32::total_cmp);
            values[(share * (values.len() - 1) as f64).round() as usize]
        })
        .collect()
}

fn rough(count: usize) -> Vec<f32> {
    // both signs, equal values and values of all magnitudes
    (0..count as u32).map(|at| ((mix(at) % 997) as f32 - 400.0) * (mix(at + 7) % 5) as f32 * 0.37).collect()
}

#[test]
fn values_are_those_of_sorted_surroundings() {
    for (nx, ny, radius, edge) in [
        (70, 45, 1.0, Edge::Base),
        (70, 45, 1.5, Edge::Periodic),
        (33, 70, 2.5, Edge::Base),
        (33, 70, 2.9, Edge::Base),
        (70, 45, 3.5, Edge::Wall),
        (70, 45, 3.7, Edge::Base),
        (150, 90, 5.3, Edge::Periodic),
        (90, 250, 5.3, Edge::Base),
        (150, 90, 12.0, Edge::Base),
        (1, 90, 8.0, Edge::Base),
        (5, 3, 30.0, Edge::Periodic),
    ] {
        let window = Window::whole(World { boundary: Boundary::all(edge), ..world(nx, ny, 1.0) });
        let samples = rough(window.len());
        for share in [0.0, 0.2, 0.5, 1.0] {
            let expected = brute_force(&window, &samples, radius, share);
            assert!(ranked(window, &samples, radius, share) == expected, "{nx} x {ny} {radius} {share}");
        }
    }
}

/// Masks, terraces and seas have many equal values, which form runs of their own that are skipped.
#[test]
fn equal_values_are_ranked_as_others_are() {
    let window = Window::whole(world(130, 110, 1.0));
    let noise = rough(window.len());
    let slope = |at: usize| (at % 130) as f32 + 2.0 * (at / 130) as f32;
    let lands: [Vec<f32>; 4] = [
        noise.iter().map(|z| f32::from(*z > 30.0)).collect(),
        (0..noise.len()).map(|at| (slope(at) / 40.0).floor()).collect(),
        (0..noise.len()).map(|at| (slope(at) + 0.1 * noise[at] - 100.0).max(0.0)).collect(),
        vec![7.5; noise.len()],
    ];
    for land in lands {
        for (radius, share) in [(3.0, 0.5), (6.0, 0.5), (14.0, 0.3), (14.0, 0.5), (25.0, 1.0)] {
            assert!(ranked(window, &land, radius, share) == brute_force(&window, &land, radius, share), "{radius}");
        }
    }
}

/// Terrain that slopes along its rows and terrain that slopes along its columns give the same ranks.
#[test]
fn blocks_may_be_turned() {
    let window = Window::whole(world(140, 75, 1.0));
    let noise = rough(window.len());
    for fall in [[3.0, 0.1], [0.1, 3.0], [-2.0, 2.0]] {
        let land: Vec<f32> = (0..noise.len())
            .map(|at| fall[0] * (at % 140) as f32 + fall[1] * (at / 140) as f32 + 0.01 * noise[at])
            .collect();
        assert!(ranked(window, &land, 9.0, 0.5) == brute_force(&window, &land, 9.0, 0.5), "{fall:?}");
    }
}

/// On a plane the median is the plane, up to its edges, where slopes continue.
#[test]
fn slopes_go_on_where_they_are_to() {
    let window = Window::whole(world(60, 40, 1.0));
    let samples: Vec<f32> = (0..window.len()).map(|at| 2.0 * (at % 60) as f32 - 3.0 * (at / 60) as f32).collect();
    for radius in [2.0, 6.0, 90.0] {
        let ends = [Ends::Mirror; 2];
        let padded = Padded::new(&samples, [60, 40], ends, Beyond::Straight, radius);
        let at = |x: usize, y: usize| padded.samples[(y + padded.margin) * padded.width + x + padded.margin];
        assert_eq!(at(59, 39), samples[samples.len() - 1]);
        if padded.margin < 30 {
            assert!((0..padded.samples.len()).all(|at| {
                let place = |at: usize| at as f32 - padded.margin as f32;
                padded.samples[at] == 2.0 * place(at % padded.width) - 3.0 * place(at / padded.width)
            }));
        }
    }
}

#[test]
fn small_circles_are_exact() {
    for tenths in 10..=36 {
        let radius = 0.1 * f64::from(tenths);
        let around = (-4..=4_i16).flat_map(|y| (-4..=4_i16).map(move |x| [x, y]));
        let circle = Circle::new(radius);
        for [x, y] in around {
            let inside = match &circle {
                Circle::Cells(cells) => cells.contains(&[i64::from(x), i64::from(y)]),
                Circle::Steps(steps) => steps.contains(x.abs(), y.abs()),
            };
            assert_eq!(inside, f64::from(x * x + y * y) <= radius * radius, "{radius} {x} {y}");
        }
    }
}

#[test]
fn circles_have_the_area_of_circles() {
    for radius in [4.0, 7.5, 20.0, 63.0, 128.0] {
        let circle = Circle::new(radius);
        let share = circle.count() as f64 / (std::f64::consts::PI * radius * radius);
        // half a cell along a circumference of 6 radii
        assert!((share - 1.0).abs() < 0.9 / radius, "{radius}: {share}");
        assert!(circle.count() < usize::from(u16::MAX));
    }
}

/// Above 128 cells, neighbourhoods are counted in coarser cells of a 128th of the radius; for waves as long as the
/// radius the error is less than a percent of their height.
#[test]
fn wide_surroundings_are_counted_in_coarser_cells() {
    let window = Window::whole(world(420, 6, 1.0));
    let wave = |at: usize| (100.0 * libm::sin(0.04 * (at % 420) as f64)) as f32 + (mix(at as u32) % 16) as f32;
    let samples: Vec<f32> = (0..window.len()).map(wave).collect();
    let expected = brute_force(&window, &samples, 150.0, 0.5);
    let found = ranked(window, &samples, 150.0, 0.5);
    for (found, expected) in found.iter().zip(&expected) {
        assert!((found - expected).abs() < 3.0, "{found} {expected}");
    }
}
