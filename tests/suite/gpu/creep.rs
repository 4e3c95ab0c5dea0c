//! Creep on the GPU is that of the CPU on high ground, where single precision rounds heights to half a millimetre.

use orograph_graph::{Boundary, Edge, Field, InputValue, Outputs, ParamValue, Report, Wanted, Window, World, mix};
use orograph_nodes::gpu::GpuOptions;
use orograph_tests::{
    Case, example,
    gpu::{field, open, run},
    inputs, set,
};

/// Diffusivity in m²/yr, and the side of a cell in metres.
const DIFFUSIVITY: f64 = 0.02;
const CELL_M: f64 = 30.0;
/// A hole in the data, in metres.
const HOLE: f32 = 2e15;

/// D Δt / d² of each step, and the number of steps: below and above the one from which on steps are solved for heights.
const STEPS: [(f64, f64); 3] = [(0.3, 3.0), (15.0, 64.0), (17.0, 64.0)];

/// Boundaries of which each kind of side is at all four sides or at opposite ones.
fn boundaries() -> [Boundary; 4] {
    let [open, base, joined] = [Edge::Open, Edge::Base, Edge::Periodic].map(Boundary::all);
    [open, base, joined, Boundary { west: Edge::Open, east: Edge::Base, north: Edge::Wall, south: Edge::Open }]
}

/// Rough hills around 4000 m; with holes inside and at both ends of some rows and columns.
fn hills(window: Window, has_holes: bool) -> Field {
    let height = |cell: usize| {
        let [x, y] = [cell % window.nx(), cell / window.nx()];
        let is_hole = [x, window.nx() - 1 - x, y, window.ny() - 1 - y].contains(&0) && (x + y) % 5 < 2;
        if has_holes && (is_hole || cell % 97 == 13) {
            return HOLE;
        }
        // ridges along both axes
        let [across, down] = [(x % 29) as f32 - 14.0, (y % 41) as f32 - 20.0].map(f32::abs);
        4000.0 + 8.0 * across - 5.0 * down + (mix(cell as u32) % 1024) as f32 / 80.0
    };
    Field::new(window, (0..window.len()).map(height).collect())
}

/// The volumes of the soil's balance, from its start to its end.
fn volumes(outputs: &mut Outputs) -> Vec<f64> {
    let value = outputs.take("report").expect("a report");
    let report: &Report = value.as_report().expect("a report");
    let balance = report.balance_of("soil").expect("a balance");
    balance.gained.iter().chain(&balance.lost).map(|amount| amount.volume).collect()
}

fn most(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, v| most.max(v.abs()))
}

#[test]
fn gains_on_high_ground_and_balances_are_those_of_the_cpu() {
    let Some(gpu) = open("creep", &GpuOptions { poison: true, ..GpuOptions::default() }) else { return };
    let node = orograph_nodes::registry().get("Creep").expect("a node");
    let place = |name| node.inputs.iter().position(|input| input.name == name).expect("an input");
    let mut wrong = Vec::new();
    for boundary in boundaries() {
        let size = [83.0 * CELL_M, 70.0 * CELL_M];
        let window = Window::whole(World { size, cells: [83, 70], boundary, ..World::default() });
        for ((each, count), critical_slope, has_holes) in
            STEPS.into_iter().flat_map(|step| [(step, 0.0, false), (step, 0.9, false), (step, 0.0, true)])
        {
            let duration = each * count * CELL_M * CELL_M / DIFFUSIVITY;
            let changes =
                [("duration", ParamValue::Float(duration)), ("critical_slope", ParamValue::Float(critical_slope))];
            let case: Case = set(example(node), &changes);
            let mut given = inputs(&case, window);
            given[place("height")] = InputValue::Value(hills(window, has_holes).into());
            given[place("diffusivity")] = InputValue::Constant(DIFFUSIVITY);
            let mut expected = (node.cpu)(&case.job(given.clone(), window)).expect("the kernel runs");
            let mut found = run(&gpu, &case, &given, window, Wanted::ALL).expect("the kernel runs");
            let [gains, right] = [&mut found, &mut expected].map(|outputs| field(outputs, "moved"));
            let range = most(right.samples().iter().map(|v| f64::from(*v)));
            let apart = most(gains.samples().iter().zip(right.samples()).map(|(a, b)| f64::from(*a) - f64::from(*b)));
            let name = format!("{each} with {critical_slope}, holes {has_holes}, {boundary:?}");
            if apart.is_nan() || apart > 1e-4 * range {
                wrong.push(format!("{name}: {apart} m of {range} m"));
            }
            let [volumes, right] = [&mut found, &mut expected].map(volumes);
            let range = most(right.iter().copied());
            let apart = most(volumes.iter().zip(&right).map(|(a, b)| a - b));
            if apart.is_nan() || apart > 1e-5 * range {
                wrong.push(format!("{name}: {volumes:?} {right:?} m³"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
