//! Glaciers of many steps: where ice and debris go depends on the last bit of the bed, so that sums are compared instead of
//! cells.

use std::sync::Arc;

use orograph_graph::{Backend, Boundary, Edge, InputValue, ParamValue, Wanted, Window, World};
use orograph_nodes::gpu::{Gpu, GpuOptions};
use orograph_tests::{
    Case, example,
    gpu::{apart, field, nudge, open, report, run},
    inputs,
};

fn world(boundary: Boundary) -> World {
    World { size: [19_200.0, 16_000.0], cells: [96, 80], seed: 7, boundary, ..World::default() }
}

fn glaciers(changes: &[(&'static str, ParamValue)]) -> Case {
    let node = orograph_nodes::registry().get("Glacial").expect("a node");
    let mut case = example(node);
    let params = &mut case.graph.instance_mut(case.node).params;
    for (name, value) in [("ice_cell", 200.0), ("warming", 600.0)] {
        params.set(name, ParamValue::Float(value));
    }
    for (name, value) in changes {
        params.set(name, value.clone());
    }
    case
}

fn check(gpu: &Gpu, case: &Case, window: Window) {
    let given = inputs(case, window);
    let by_cpu = |given: Vec<InputValue>| (case.kind().cpu)(&case.job(given, window)).expect("the kernel runs");
    let mut expected = by_cpu(given.clone());
    let odd = |cell: usize| orograph_graph::mix(cell as u32) & 1 == 1;
    let mut nudged = by_cpu(given.iter().map(|input| nudge(input, odd)).collect());
    let mut found = run(gpu, case, &given, window, Wanted::ALL).expect("the kernel runs");
    for name in ["height", "ice", "till", "moraine", "erosion"] {
        let [found, expected, nudged] = [&mut found, &mut expected, &mut nudged].map(|outputs| field(outputs, name));
        let (distance, allowed) = (apart(&found, &expected), apart(&nudged, &expected));
        // steps of other lengths end elsewhere, by some 1e-3 of the thickness
        assert!(distance < 2.0 * allowed + 1e-3, "{name}: {distance}, and {allowed} by the last bit");
    }
    let [found, expected] = [&mut found, &mut expected].map(report);
    // a cell gains and loses a hundred times the ice that it has, summed in single precision
    let ice = found.balance_of("ice").expect("a balance");
    assert!(ice.error.abs() < 2e-6, "{}", ice.error);
    for name in ["ice", "till"] {
        let [found, expected] = [&found, &expected].map(|report| report.balance_of(name).expect("a balance"));
        let most = expected.gained.iter().map(|amount| amount.volume).fold(1.0, f64::max);
        for (found, expected) in
            found.gained.iter().chain(&found.lost).zip(expected.gained.iter().chain(&expected.lost))
        {
            let distance = (found.volume - expected.volume).abs() / most;
            assert!(distance < 5e-3, "{name}, {}: {distance}", found.name);
        }
    }
}

/// A whole cycle of ice: cells differ by no more than after a change of the terrain by its last bit, and so do the
/// balances. All kinds of sides, and both climates.
#[test]
fn glaciers_of_many_steps_end_as_on_the_cpu() {
    let Some(gpu) = open("ice", &GpuOptions { poison: true, ..GpuOptions::default() }) else { return };
    let open_sides = Boundary::all(Edge::Open);
    check(&gpu, &glaciers(&[]), Window::whole(world(Boundary { north: Edge::Wall, east: Edge::Base, ..open_sides })));
    let joined = Boundary { north: Edge::Periodic, south: Edge::Periodic, ..Boundary::all(Edge::Inland) };
    let cold = [
        ("climate", ParamValue::Choice("temperature")),
        ("law", ParamValue::Choice("area")),
        ("steps", ParamValue::Int(20)),
        ("warming", ParamValue::Float(0.0)),
    ];
    let mut cold = glaciers(&cold);
    let temperature = cold.kind().inputs.iter().position(|input| input.name == "temperature").expect("an input");
    cold.graph.instance_mut(cold.node).constants[temperature] = Some(-1.0);
    check(&gpu, &cold, Window::whole(world(joined)));
}

/// Ice grids that are hardly longer than what lies beyond their sides.
#[test]
fn ice_on_a_few_cells_ends_as_on_the_cpu() {
    let Some(gpu) = open("few cells", &GpuOptions { poison: true, ..GpuOptions::default() }) else { return };
    let case = glaciers(&[("steps", ParamValue::Int(4)), ("warming", ParamValue::Float(0.0))]);
    for edge in [Edge::Periodic, Edge::Open, Edge::Base, Edge::Wall] {
        for cells in [[1, 5], [5, 1], [2, 2], [2, 7], [3, 3]] {
            let size = cells.map(|count| 200.0 * f64::from(count));
            check(&gpu, &case, Window::whole(World { size, cells, ..world(Boundary::all(edge)) }));
        }
    }
}

/// A run that is watched ends with the bytes of a build, also with layers of rock, which stay on the host.
#[test]
fn a_live_run_ends_as_a_build() {
    let Some(gpu) = open("live ice", &GpuOptions::default()) else { return };
    let window = Window::whole(world(Boundary::all(Edge::Inland)));
    let case = Case { name: String::new(), ..glaciers(&[("steps", ParamValue::Int(6))]) };
    let mut given = inputs(&case, window);
    let strata = case.kind().inputs.iter().position(|input| input.name == "strata").expect("an input");
    let rock = Case { name: String::new(), ..example(orograph_nodes::registry().get("Stratify").expect("a node")) };
    let mut layers = (rock.kind().cpu)(&rock.job(inputs(&rock, window), window)).expect("the kernel runs");
    given[strata] = InputValue::Value(layers.take("strata").expect("an output"));
    let mut built = run(&gpu, &case, &given, window, Wanted::ALL).expect("the kernel runs");
    let job = case.job(given, window);
    let mut process = Backend::begin(Arc::clone(&gpu), case.kind(), &job).expect("begins").expect("on the device");
    while !process.moment().is_over() {
        process.step(&job).expect("goes on");
    }
    let mut ended = process.outputs(&job).expect("there");
    for output in case.kind().outputs {
        assert!(ended.take(output.name) == built.take(output.name), "{}", output.name);
    }
}
