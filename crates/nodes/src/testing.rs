//! What the tests of nodes share: small worlds, fields from formulas, runs of a kernel.

use orograph_graph::{Cancel, Fallback, InputValue, Kind, ParamValue, World, check_value};

use crate::{
    prelude::*,
    simd::{self, Level},
};

/// A world of square cells.
pub(crate) fn world(nx: u32, ny: u32, cell_m: f64) -> World {
    World { size: [f64::from(nx) * cell_m, f64::from(ny) * cell_m], cells: [nx, ny], ..World::default() }
}

/// The field of a function of a cell centre's position in metres.
pub(crate) fn field(world: World, value: impl Fn(f64, f64) -> f64) -> Field {
    let window = Window::whole(world);
    let samples = (0..window.len()).map(|at| {
        let [x, y] = window.centre_m(at % window.nx(), at / window.nx());
        value(x, y) as f32
    });
    Field::new(window, samples.collect())
}

/// A node's defaults with `name=value` changes, separated by commas.
pub(crate) fn with_params(node: &'static Node, changes: &str) -> ParamValues {
    let specs = node.specs();
    let mut params = ParamValues::defaults(&specs);
    for change in changes.split(',') {
        let (name, text) = change.trim().split_once('=').expect("name=value");
        let spec = specs.iter().find(|spec| spec.name == name).expect("a declared parameter");
        let value = match &spec.kind {
            Kind::Float { .. } => ParamValue::Float(text.parse().expect("a number")),
            Kind::Int { .. } => ParamValue::Int(text.parse().expect("a whole number")),
            Kind::Bool { .. } => ParamValue::Bool(text.parse().expect("true or false")),
            Kind::Choice { options, .. } => {
                ParamValue::Choice(options.iter().find(|(name, _)| *name == text).expect("an option").0)
            }
            other => panic!("no text for {other:?}"),
        };
        check_value(spec, &value).expect("an allowed value");
        params.set(spec.name, value);
    }
    params
}

/// Runs a node on the window of its first field; inputs without a field have their constant.
pub(crate) fn outputs(node: &Node, params: &ParamValues, fields: &[(&str, &Field)]) -> Result<Outputs, NodeError> {
    let inputs =
        node.inputs.iter().map(|input| match (fields.iter().find(|(name, _)| *name == input.name), input.fallback) {
            (Some((_, field)), _) => InputValue::Value(Value::Field((*field).clone())),
            (None, Fallback::Constant { default, .. }) => InputValue::Constant(default),
            (None, _) => InputValue::Absent,
        });
    let job = Job {
        node,
        params,
        inputs: inputs.collect(),
        window: *fields[0].1.window(),
        folder: std::path::PathBuf::new(),
        cancel: Cancel::default(),
        progress: &|fraction| assert!((0.0..=1.0).contains(&fraction)),
    };
    (node.cpu)(&job)
}

/// The output of that name as a field.
pub(crate) fn run(node: &Node, params: &ParamValues, fields: &[(&str, &Field)], output: &str) -> Field {
    let value = outputs(node, params, fields).expect("a result").take(output).expect("a declared output");
    value.as_field().expect("a field").clone()
}

/// All outputs, computed by that many threads.
pub(crate) fn run_in(threads: usize, node: &Node, params: &ParamValues, fields: &[(&str, &Field)]) -> Outputs {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    pool.install(|| outputs(node, params, fields)).expect("a result")
}

/// Asserts that a result is the same at every SIMD level of this machine.
pub(crate) fn at_every_level<T: PartialEq + std::fmt::Debug>(result: impl Fn() -> T) {
    let widest = result();
    for level in [Level::Baseline, Level::Avx2, Level::Avx512] {
        simd::limit(level);
        assert!(result() == widest, "{level:?} differs");
    }
    simd::limit(simd::detected());
}
