//! A storm of many steps: erosion amplifies differences in the last bit, so that sums are compared instead of cells.

use orograph_graph::{InputValue, ParamValue, Report, Wanted, Window, World};
use orograph_nodes::gpu::GpuOptions;
use orograph_tests::{
    Case, example,
    gpu::{apart, field, nudge, open, report, run},
    inputs,
};

const SIDE: u32 = 48;

fn world() -> World {
    World { size: [20.0 * f64::from(SIDE); 2], cells: [SIDE; 2], seed: 7, ..World::default() }
}

fn storm(changes: &[(&'static str, ParamValue)]) -> Case {
    let node = orograph_nodes::registry().get("HydraulicPipe").expect("a node");
    let mut case = example(node);
    let params = &mut case.graph.instance_mut(case.node).params;
    params.set("duration", ParamValue::Float(600.0));
    for (name, value) in changes {
        params.set(name, value.clone());
    }
    case
}

/// The volumes of a balance, from its start to its end.
fn volumes(report: &Report, material: &str) -> Vec<f64> {
    let balance = report.balance_of(material).expect("a balance");
    let moved = balance.gained.iter().chain(&balance.lost).map(|amount| amount.volume);
    std::iter::once(balance.start).chain(moved).chain([balance.end]).collect()
}

/// Ten minutes: cells differ by no more than after a change of the terrain by its last bit, and so do the balances.
#[test]
fn a_storm_of_many_steps_ends_as_on_the_cpu() {
    let Some(gpu) = open("storm", &GpuOptions::default()) else { return };
    let window = Window::whole(world());
    let choice = |name, option| storm(&[(name, ParamValue::Choice(option)), ("evaporation", ParamValue::Float(1e-4))]);
    for case in
        [storm(&[]), choice("scheme", "pipes"), choice("transport", "maccormack"), choice("law", "webgl_erosion")]
    {
        let given = inputs(&case, window);
        let mut expected = (case.kind().cpu)(&case.job(given.clone(), window)).expect("the kernel runs");
        let nudged: Vec<InputValue> = given.iter().map(|input| nudge(input, |_| true)).collect();
        let mut nudged = (case.kind().cpu)(&case.job(nudged, window)).expect("the kernel runs");
        let mut found = run(&gpu, &case, &given, window, Wanted::ALL).expect("the kernel runs");
        for name in ["water", "deposition", "sediment", "flow"] {
            let [found, expected, nudged] =
                [&mut found, &mut expected, &mut nudged].map(|outputs| field(outputs, name));
            let (distance, allowed) = (apart(&found, &expected), apart(&nudged, &expected));
            assert!(distance < 2.0 * allowed + 1e-6, "{name}: {distance}, and {allowed} by the last bit");
        }
        let [found, expected] = [&mut found, &mut expected].map(report);
        for name in ["water", "sediment"] {
            let [found, expected] = [&found, &expected].map(|report| volumes(report, name));
            let most = expected.iter().fold(0.0_f64, |most, volume| most.max(volume.abs()));
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found - expected).abs() <= 1e-5 * most, "{name}: {found} {expected} of {most}");
            }
        }
    }
}
