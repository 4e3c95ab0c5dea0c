//! Drainage on the GPU is that of the CPU: every receiver, level and lake, on rough land and on exact flats.

use orograph_graph::{Boundary, Edge, Field, InputValue, ParamValue, Wanted, Window, World, mix};
use orograph_nodes::gpu::GpuOptions;
use orograph_tests::{
    Case, example,
    gpu::{field, open, run},
    inputs, set,
};

/// A draw from 0 to 1 for each cell.
fn draw(cell: usize, seed: u32) -> f32 {
    (mix(cell as u32 ^ mix(seed)) >> 8) as f32 / 16_777_216.0
}

/// Rough land: each ninth cell is a pit.
fn rough(window: Window) -> Field {
    let height = |cell: usize| {
        let [x, y] = [cell % window.nx(), cell / window.nx()];
        300.0 * draw(cell, 5) + 2.0 * x as f32 - 3.0 * (y as f32 - 0.4 * window.ny() as f32).abs()
    };
    Field::new(window, (0..window.len()).map(height).collect())
}

/// The same in steps of 20 m, with ties, flats and lakes.
fn stepped(window: Window) -> Field {
    let samples = rough(window).into_samples().into_iter().map(|v| (0.05 * v).round() * 20.0);
    Field::new(window, samples.collect())
}

fn worlds() -> Vec<World> {
    let world = |nx: u32, ny: u32, boundary| World {
        size: [f64::from(nx) * 30.0, f64::from(ny) * 30.0],
        cells: [nx, ny],
        boundary,
        ..World::default()
    };
    let [base, open] = [Edge::Base, Edge::Open].map(Boundary::all);
    let joined = Boundary { west: Edge::Periodic, east: Edge::Periodic, north: Edge::Wall, south: Edge::Open };
    let gate = Boundary { north: Edge::Open, ..Boundary::all(Edge::Wall) };
    vec![
        world(201, 147, base),
        world(130, 190, open),
        World { sea_level: Some(90.0), ..world(150, 90, open) },
        world(97, 120, joined),
        world(2, 40, joined),
        world(90, 100, gate),
        world(3, 200, base),
    ]
}

/// The greatest relative difference of two planes, infinite if one of the samples is not finite.
fn apart(found: &[f32], expected: &[f32]) -> f64 {
    let pairs = found.iter().zip(expected).map(|(a, b)| (f64::from(*a), f64::from(*b)));
    pairs.fold(0.0_f64, |most, (a, b)| {
        let share = (a - b).abs() / b.abs().max(1e-30);
        if share.is_finite() { most.max(share) } else { f64::INFINITY }
    })
}

#[test]
fn drainage_equals_that_of_the_cpu() {
    let Some(gpu) = open("drainage", &GpuOptions { poison: true, ..GpuOptions::default() }) else { return };
    let node = orograph_nodes::registry().get("Flow").expect("a node");
    let [height, runoff, data] =
        ["height", "runoff", "data"].map(|name| node.inputs.iter().position(|input| input.name == name));
    for world in worlds() {
        let window = Window::whole(world);
        for sinks in ["carve", "jump", "keep"] {
            for (land, is_wet, has_voids) in
                [(rough(window), true, false), (rough(window), false, true), (stepped(window), true, false)]
            {
                let case: Case = set(example(node), &[("depressions", ParamValue::Choice(sinks))]);
                let mut given = inputs(&case, window);
                given[height.expect("an input")] = InputValue::Value(land.into());
                if is_wet {
                    let rates = (0..window.len()).map(|cell| 3.0 * draw(cell, 8) - 0.2).collect();
                    given[runoff.expect("an input")] = InputValue::Value(Field::new(window, rates).into());
                }
                if has_voids {
                    // blocks of five cells by three, and single cells
                    let block = |cell: usize| (cell / window.nx() / 3) * 1000 + cell % window.nx() / 5;
                    let known =
                        |cell: usize| if draw(block(cell), 3) < 0.1 || draw(cell, 4) < 0.02 { 0.3 } else { 0.9 };
                    let known = Field::new(window, (0..window.len()).map(known).collect());
                    given[data.expect("an input")] = InputValue::Value(known.into());
                }
                let mut expected = (node.cpu)(&case.job(given.clone(), window)).expect("the kernel runs");
                let mut found = run(&gpu, &case, &given, window, Wanted::ALL).expect("the kernel runs");
                let name = format!("{:?}, {sinks}, runoff {is_wet}, voids {has_voids}", window.world.cells);
                for output in ["direction", "conditioned", "lake_depth", "lake"] {
                    let [found, expected] = [&mut found, &mut expected].map(|outputs| field(outputs, output));
                    // as numbers: a level of 0 may have either sign
                    assert!(found.samples() == expected.samples(), "{output}: {name}");
                }
                // areas are whole numbers of cells, times a factor; these rates are whole numbers in the sums of runoff
                for (output, most) in [("area", 2e-7), ("discharge", 4e-7)] {
                    let [found, expected] = [&mut found, &mut expected].map(|outputs| field(outputs, output));
                    let apart = apart(found.samples(), expected.samples());
                    assert!(apart <= most, "{output}: {name}: {apart}");
                }
                let [found, expected] = [&mut found, &mut expected].map(|outputs| field(outputs, "flow"));
                for (plane, most) in [0.0, 2e-7, 4e-7, 0.0].into_iter().enumerate() {
                    let apart = apart(found.plane(plane), expected.plane(plane));
                    assert!(apart <= most, "plane {plane}: {name}: {apart}");
                }
            }
        }
    }
}
