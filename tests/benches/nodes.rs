//! Time per cell of every node, at 512, 1024 and 2048 cells a side: `cargo bench -p orograph-tests`.
//!
//! The node runs on its example. Its inputs are computed once, before, and only its own kernel is timed.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use orograph_graph::{Cancel, Evaluator, EvaluatorOptions, Fallback, InputValue, Job, Port, Window};
use orograph_nodes::registry;
use orograph_tests::{Case, data_folder, example, world};

/// The inputs of a case over a window, as its kernel gets them.
fn inputs(case: &Case, window: Window) -> Vec<InputValue> {
    let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("an evaluator");
    let value = |port: Port| {
        let values = evaluator.evaluate(&case.graph, &data_folder(), &[(port, window)], &Cancel::default(), &|_| {});
        values.expect("an input").remove(0)
    };
    let instance = case.graph.instance(case.node);
    let declared = instance.node.inputs.iter().enumerate();
    declared
        .map(|(position, input)| match (case.graph.source(case.node, position), input.fallback) {
            (Some(port), _) => InputValue::Value(value(port)),
            (None, Fallback::Constant { default, .. }) => {
                InputValue::Constant(instance.constants[position].unwrap_or(default))
            }
            (None, _) => InputValue::Absent,
        })
        .collect()
}

fn nodes(c: &mut Criterion) {
    for node in registry().nodes() {
        let mut group = c.benchmark_group(node.id);
        group.sample_size(10);
        for cells in [512, 1024, 2048] {
            let case = example(node);
            let window = Window::whole(world(cells));
            let job = Job {
                node,
                params: &case.graph.instance(case.node).params.clone(),
                inputs: inputs(&case, window),
                window,
                folder: data_folder(),
                cancel: Cancel::default(),
                progress: &|_| {},
            };
            group.throughput(Throughput::Elements(window.len() as u64));
            group.bench_function(BenchmarkId::from_parameter(cells), |b| b.iter(|| (node.cpu)(&job)));
        }
        group.finish();
    }
}

criterion_group!(benches, nodes);
criterion_main!(benches);
