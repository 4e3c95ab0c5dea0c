//! Helpers for tests of nodes: small worlds, fields from formulas, runs of kernels.

use std::sync::Arc;

use orograph_graph::{
    Cancel, Column, Fallback, InputValue, Kind, Layer, ParamValue, Strata, Value, Wanted, Warnings, World, check_value,
};

use crate::{
    numerics::simd::{self, Level},
    prelude::*,
};

/// Returns a world of square cells.
pub(crate) fn world(nx: u32, ny: u32, cell_m: f64) -> World {
    World { size: [f64::from(nx) * cell_m, f64::from(ny) * cell_m], cells: [nx, ny], ..World::default() }
}

/// Evaluates a function of position in metres at cell centres.
pub(crate) fn field(world: World, value: impl Fn(f64, f64) -> f64) -> Field {
    let window = Window::whole(world);
    let samples = (0..window.len()).map(|at| {
        let [x, y] = window.centre_m(at % window.nx(), at / window.nx());
        value(x, y) as f32
    });
    Field::new(window, samples.collect())
}

/// Returns the same field in a world with a sea.
pub(crate) fn at_sea(field: &Field, level_m: f64) -> Field {
    let window = *field.window();
    field.crop(&Window { world: World { sea_level: Some(level_m), ..window.world }, ..window })
}

/// Returns a node's default parameters with `name=value` changes, separated by commas.
pub(crate) fn with_params(node: &'static Node, changes: &str) -> ParamValues {
    let specs = node.specs();
    let mut params = ParamValues::defaults(&specs);
    for change in changes.split(',').filter(|change| !change.is_empty()) {
        let (name, text) = change.trim().split_once('=').expect("name=value");
        let spec = specs.iter().find(|spec| spec.name == name).expect("a declared parameter");
        let value = match &spec.kind {
            Kind::Float { .. } => ParamValue::Float(text.parse().expect("a number")),
            Kind::Int { .. } => ParamValue::Int(text.parse().expect("a whole number")),
            Kind::Bool { .. } => ParamValue::Bool(text.parse().expect("true or false")),
            Kind::Seed { .. } => ParamValue::Seed(text.parse().expect("a seed")),
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

/// Runs a node on the window of its first field; inputs without a field have their default constant.
pub(crate) fn outputs(node: &Node, params: &ParamValues, fields: &[(&str, &Field)]) -> Result<Outputs, NodeError> {
    outputs_on(*fields[0].1.window(), node, params, fields)
}

/// Runs a node on a window; inputs without a field have their default constant.
pub(crate) fn outputs_on(
    window: Window,
    node: &Node,
    params: &ParamValues,
    fields: &[(&str, &Field)],
) -> Result<Outputs, NodeError> {
    outputs_until(&Cancel::default(), window, node, params, fields)
}

/// As [`outputs_on`], with a flag that cancels it.
pub(crate) fn outputs_until(
    cancel: &Cancel,
    window: Window,
    node: &Node,
    params: &ParamValues,
    fields: &[(&str, &Field)],
) -> Result<Outputs, NodeError> {
    outputs_and_warnings(cancel, window, node, params, fields).0
}

/// As [`outputs_until`], with the kernel's warnings.
pub(crate) fn outputs_and_warnings(
    cancel: &Cancel,
    window: Window,
    node: &Node,
    params: &ParamValues,
    fields: &[(&str, &Field)],
) -> (Result<Outputs, NodeError>, Vec<String>) {
    outputs_wanted(Wanted::ALL, cancel, window, node, params, fields)
}

/// As [`outputs_and_warnings`], with only some outputs wanted.
pub(crate) fn outputs_wanted(
    wanted: Wanted,
    cancel: &Cancel,
    window: Window,
    node: &Node,
    params: &ParamValues,
    fields: &[(&str, &Field)],
) -> (Result<Outputs, NodeError>, Vec<String>) {
    let of = |name: &str| fields.iter().find(|(field, _)| *field == name);
    run_with(wanted, cancel, window, node, params, &|name| of(name).map(|(_, field)| Value::Field((*field).clone())))
}

/// As [`outputs`], in layers of rock.
pub(crate) fn outputs_in_rock(
    strata: &Strata,
    node: &Node,
    params: &ParamValues,
    fields: &[(&str, &Field)],
) -> Result<Outputs, NodeError> {
    let of = |name: &str| fields.iter().find(|(field, _)| *field == name);
    let value = |name: &str| match name {
        "strata" => Some(strata.clone().into()),
        _ => of(name).map(|(_, field)| Value::Field((*field).clone())),
    };
    run_with(Wanted::ALL, &Cancel::default(), *fields[0].1.window(), node, params, &value).0
}

/// Layers that follow a surface, of `(thickness in metres, hardness, steepest slope in degrees)`, from `top_m` down;
/// the first and the last one continue.
pub(crate) fn strata(offset: Field, top_m: f64, layers: &[(f64, f64, f64)]) -> Strata {
    let layer =
        |&(thickness, hardness, repose): &(f64, f64, f64)| Layer { thickness, hardness, repose, ..Layer::USUAL };
    let layers = layers.iter().map(layer).collect();
    Strata::new(Arc::new(Column { layers, top_m, repeats: false, cosine: 1.0 }), offset)
}

/// A job without inputs.
#[cfg(feature = "gpu")]
pub(crate) fn job_on<'a>(node: &'a Node, params: &'a ParamValues, window: Window) -> Job<'a> {
    Job {
        node,
        params,
        inputs: Vec::new(),
        level: orograph_graph::LevelJob::default(),
        window,
        wanted: Wanted::ALL,
        folder: std::path::PathBuf::new(),
        cancel: Cancel::default(),
        progress: &|_| {},
        warnings: Warnings::default(),
        glimpses: None,
    }
}

/// Runs a node on a window with the values of its inputs; those without one have their default constant, but `uplift`
/// is 0.
pub(crate) fn run_with(
    wanted: Wanted,
    cancel: &Cancel,
    window: Window,
    node: &Node,
    params: &ParamValues,
    value: &dyn Fn(&str) -> Option<Value>,
) -> (Result<Outputs, NodeError>, Vec<String>) {
    let inputs = node.inputs.iter().map(|input| match (value(input.name), input.fallback) {
        (Some(value), _) => InputValue::Value(value),
        // terrain does not rise by itself
        (None, _) if input.name == "uplift" => InputValue::Constant(0.0),
        (None, Fallback::Constant { default, .. }) => InputValue::Constant(default),
        (None, _) => InputValue::Absent,
    });
    let job = Job {
        node,
        params,
        inputs: inputs.collect(),
        window,
        wanted,
        folder: std::path::PathBuf::new(),
        cancel: cancel.clone(),
        progress: &|fraction| assert!((0.0..=1.0).contains(&fraction)),
        level: orograph_graph::LevelJob::default(),
        warnings: Warnings::default(),
        glimpses: None,
    };
    let outputs = (node.cpu)(&job);
    (outputs, job.warnings.take())
}

/// Calls `work` with a job of an empty node, for code that needs only its window.
pub(crate) fn with_job<T>(window: Window, work: impl FnOnce(&Job<'_>) -> T) -> T {
    work(&Job {
        node: &Node::DEFAULT,
        params: &ParamValues::defaults(&[]),
        inputs: Vec::new(),
        window,
        wanted: Wanted::ALL,
        folder: std::path::PathBuf::new(),
        cancel: Cancel::default(),
        progress: &|_| (),
        level: orograph_graph::LevelJob::default(),
        warnings: Warnings::default(),
        glimpses: None,
    })
}

/// Returns the distance in metres around a window that a node declares to read; 0 if its reach is not a distance.
pub(crate) fn reach_m(node: &Node, params: &ParamValues, cell_m: f64) -> f64 {
    match node.reach {
        Reach::Metres(reach) => reach(params, cell_m),
        _ => 0.0,
    }
}

/// Returns the largest step between neighbours inside a field, and across its opposite sides.
pub(crate) fn seams(field: &Field) -> [f32; 2] {
    let [nx, ny] = [field.window().nx(), field.window().ny()];
    let step = |a: usize, b: usize| (field.samples()[a] - field.samples()[b]).abs();
    let rows = || (0..ny).flat_map(|j| (1..nx).map(move |i| (j * nx + i - 1, j * nx + i)));
    let columns = || (1..ny).flat_map(|j| (0..nx).map(move |i| ((j - 1) * nx + i, j * nx + i)));
    let sides = (0..ny).map(|j| (j * nx, (j + 1) * nx - 1)).chain((0..nx).map(|i| (i, (ny - 1) * nx + i)));
    let most = |pairs: &mut dyn Iterator<Item = (usize, usize)>| pairs.map(|(a, b)| step(a, b)).fold(0.0, f32::max);
    [most(&mut rows().chain(columns())), most(&mut { sides })]
}

/// Runs a node and returns the output of that name as a field.
pub(crate) fn run(node: &Node, params: &ParamValues, fields: &[(&str, &Field)], output: &str) -> Field {
    let value = outputs(node, params, fields).expect("a result").take(output).expect("a declared output");
    value.as_field().expect("a field").clone()
}

/// Runs a generator without wires on a window, with changes as for [`with_params`], and returns its first output.
pub(crate) fn generate(window: Window, node: &'static Node, changes: &str) -> Field {
    let value =
        outputs_on(window, node, &with_params(node, changes), &[]).expect("a result").take(node.outputs[0].name);
    value.expect("a declared output").as_field().expect("a field").clone()
}

/// Returns the mean and the standard deviation.
pub(crate) fn moments(samples: &[f32]) -> (f64, f64) {
    let n = samples.len() as f64;
    let mean = samples.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
    let square = |v: &f32| (f64::from(*v) - mean) * (f64::from(*v) - mean);
    (mean, (samples.iter().map(square).sum::<f64>() / n).sqrt())
}

/// Returns means over squares of `side` x `side` cells, which must divide the field.
pub(crate) fn block_means(field: &Field, side: usize) -> Vec<f32> {
    let (nx, ny) = (field.window().nx(), field.window().ny());
    let blocks = (0..ny / side).flat_map(|j| (0..nx / side).map(move |i| (i * side, j * side)));
    let mean = |(x, y)| {
        let cells = (y..y + side).flat_map(|j| (x..x + side).map(move |i| j * nx + i));
        cells.map(|at| f64::from(field.samples()[at])).sum::<f64>() / (side * side) as f64
    };
    blocks.map(|block| mean(block) as f32).collect()
}

/// Returns all outputs, computed by that many threads.
pub(crate) fn run_in(threads: usize, node: &Node, params: &ParamValues, fields: &[(&str, &Field)]) -> Outputs {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
    pool.install(|| outputs(node, params, fields)).expect("a result")
}

/// Returns the power by direction of waves of 4 to 8 cells on terrain of 512 x 512 cells, averaged over four seeds; see
/// [`crate::numerics::noise::spectrum::by_direction`].
pub(crate) fn power_by_direction(node: &'static Node, changes: &str) -> [f64; 10] {
    let mut mean = [0.0; 10];
    for seed in 0..4 {
        let field = generate(
            Window::whole(world(512, 512, 1.0)),
            node,
            &format!("wavelength=128,octaves=10,seed={seed},{changes}"),
        );
        let powers = crate::numerics::noise::spectrum::by_direction(field.samples(), 512, 4.0, 8.0);
        mean.iter_mut().zip(powers).for_each(|(mean, power)| *mean += power / 4.0);
    }
    mean
}

/// Asserts that a result is the same at every SIMD level of this machine.
pub(crate) fn at_every_level<T: PartialEq + std::fmt::Debug>(result: impl Fn() -> T) {
    let widest = result();
    for level in [Level::Baseline, Level::Avx2, Level::Avx512] {
        assert!(simd::at(level, &result) == widest, "{level:?} differs");
    }
}
