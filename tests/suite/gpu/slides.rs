//! Slides on the GPU: over all grids of the pyramid they come to rest as on the CPU.

use std::f64::consts::TAU;

use orograph_graph::{Balance, Boundary, Edge, Field, InputValue, ParamValue, Wanted, Window, World};
use orograph_nodes::{gpu::GpuOptions, numerics::math};
use orograph_tests::{
    Case, example,
    gpu::{field, open, run},
    inputs, set,
};

/// Cliffs, ridges and a mesa, on cells of 10 m.
fn cliffs(window: Window) -> Field {
    let [nx, ny] = [window.nx(), window.ny()].map(|count| count as f64);
    let height = |cell: usize| {
        let [x, y] = [cell % window.nx(), cell / window.nx()].map(|at| at as f64);
        let wave = math::sin(TAU * 5.0 * x / nx) * math::cos(TAU * 3.0 * y / ny);
        let mesa = if math::hypot(x - 0.6 * nx, y - 0.4 * ny) < 0.2 * ny { 40.0 } else { 0.0 };
        let rough = f64::from(orograph_graph::mix(cell as u32) >> 8) / 16_777_216.0;
        (400.0 + 60.0 * wave + mesa + 2.0 * rough) as f32
    };
    Field::new(window, (0..window.len()).map(height).collect())
}

/// One whose sides are no multiples of coarse cells, and one with joined sides; each with the slides in it.
fn worlds() -> [(World, &'static [&'static str]); 2] {
    let world = |nx: u32, ny: u32, boundary| World {
        size: [f64::from(nx) * 10.0, f64::from(ny) * 10.0],
        cells: [nx, ny],
        boundary,
        ..World::default()
    };
    let joined = Boundary { west: Edge::Periodic, east: Edge::Periodic, ..Boundary::all(Edge::Wall) };
    let some = &["loose", "brief", "bare rock", "a brief layer"];
    [(world(141, 131, Boundary::all(Edge::Open)), some), (world(128, 128, joined), &["angles", "brief", "a layer"])]
}

/// The root of the mean square of differences, over that of the second.
fn apart(found: &Field, expected: &Field) -> f64 {
    let pairs = || found.samples().iter().zip(expected.samples()).map(|(a, b)| (f64::from(*a), f64::from(*b)));
    let squares = pairs().map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    (squares / pairs().map(|(_, b)| b * b).sum::<f64>().max(1e-9)).sqrt()
}

#[test]
fn slides_come_to_rest_as_on_the_cpu() {
    let Some(gpu) = open("slides", &GpuOptions { poison: true, ..GpuOptions::default() }) else { return };
    let node = orograph_nodes::registry().get("Thermal").expect("a node");
    let input = |name| node.inputs.iter().position(|input| input.name == name).expect("an input");
    for (world, names) in worlds() {
        let window = Window::whole(world);
        let layer = |metres: f32| InputValue::Value(Field::constant(window, metres).into());
        let angles = (0..window.len()).map(|cell| 25.0 + 10.0 * math::sin(cell as f64 * 0.001) as f32).collect();
        let angles = InputValue::Value(Field::new(window, angles).into());
        let half = (0..window.len()).map(|cell| if cell % window.nx() < window.nx() / 2 { 1.0 } else { 0.0 }).collect();
        let half = InputValue::Value(Field::new(window, half).into());
        let brief = [("until", ParamValue::Choice("duration")), ("duration", ParamValue::Float(80.0))];
        for (name, changes, given) in [
            ("loose", &[][..], vec![]),
            ("angles", &[], vec![("talus", angles), ("mask", half)]),
            ("brief", &brief[..], vec![]),
            ("bare rock", &[], vec![("debris", layer(0.0))]),
            ("a layer", &[], vec![("debris", layer(6.0))]),
            ("a brief layer", &brief[..], vec![("debris", layer(6.0))]),
        ]
        .into_iter()
        .filter(|(name, ..)| names.contains(name))
        {
            let case: Case = set(example(node), changes);
            let mut all = inputs(&case, window);
            all[input("height")] = InputValue::Value(cliffs(window).into());
            for (name, value) in given {
                all[input(name)] = value;
            }
            let mut expected = (node.cpu)(&case.job(all.clone(), window)).expect("the kernel runs");
            let mut found = run(&gpu, &case, &all, window, Wanted::ALL).expect("the kernel runs");
            // slopes that were steep at first and stay as they are rest at their rise: whether a sweep still sees them as
            // steep hangs on the last bit on every device, and one more cycle through the grids moves about 1 %
            let moving = if name == "brief" { 0.02 } else { 1e-4 };
            for (output, most) in [("moved", moving), ("debris", moving), ("crumbled", 1e-6), ("height", 0.1 * moving)]
            {
                let [found, expected] = [&mut found, &mut expected].map(|outputs| field(outputs, output));
                let apart = apart(&found, &expected);
                assert!(apart < most, "{:?} {name} {output}: {apart}", world.cells);
            }
            let [found, expected] = [&mut found, &mut expected].map(|outputs| {
                let value = outputs.take("report").expect("a report");
                value.as_report().expect("a report").balance_of("debris").expect("a balance").clone()
            });
            let volumes = |balance: &Balance| {
                let moved = balance.gained.iter().chain(&balance.lost).map(|amount| amount.volume);
                moved.chain([balance.start, balance.end]).collect::<Vec<f64>>()
            };
            let [found_m3, expected_m3] = [&found, &expected].map(volumes);
            let largest = expected_m3.iter().fold(0.0_f64, |most, volume| most.max(volume.abs()));
            for (found, expected) in found_m3.iter().zip(&expected_m3) {
                assert!((found - expected).abs() < moving * largest, "{name}: {found} {expected}");
            }
            assert!(found.error.abs() < 1e-6, "{name}: {}", found.error);
        }
    }
}
