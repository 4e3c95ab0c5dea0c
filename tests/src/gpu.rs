//! The GPU backend for tests, and comparisons with the CPU.

use std::{
    io::Write as _,
    sync::{Arc, Mutex, PoisonError},
};

use orograph_graph::{
    Backend as _, Field, InputValue, Node, NodeError, Outputs, Report, Value, Wanted, Window, gpu::Tolerance,
};
use orograph_nodes::gpu::{Adapters, Gpu, GpuOptions};

use crate::run::Case;

/// The variable that makes a skipped test a failure, as `.ci/run` sets it.
const VARIABLE: &str = "OROGRAPH_ALL_TESTS";

/// The backend on the first adapter; a driver in software will do. Without one the test is skipped with a message that
/// libtest does not capture, or fails if `OROGRAPH_ALL_TESTS` is set.
///
/// # Panics
/// When the driver does not work, or there is none and no test may be skipped.
#[must_use]
pub fn open(test: &str, options: &GpuOptions) -> Option<Arc<Gpu>> {
    static FIND: Mutex<()> = Mutex::new(());
    // drivers load slowly, and some are not safe to load twice at once
    let _one = FIND.lock().unwrap_or_else(PoisonError::into_inner);
    let adapters = Adapters::find();
    let Some(adapter) = adapters.best(false) else {
        assert!(std::env::var_os(VARIABLE).is_none(), "{test}: no graphics driver was found");
        let _ = writeln!(std::io::stderr(), "SKIPPED {test}: no graphics driver was found");
        return None;
    };
    Some(Arc::new(Gpu::new(adapter, options).expect("the driver works")))
}

/// All nodes with a kernel for the GPU.
#[must_use]
pub fn nodes() -> Vec<&'static Node> {
    orograph_nodes::registry().nodes().iter().copied().filter(|node| node.gpu.is_some()).collect()
}

/// How far an output of the GPU is from that of the CPU.
#[derive(Clone, Copy, Debug)]
pub struct Distance {
    /// The largest difference beyond the outliers that the tolerance allows.
    pub most: f64,
    /// The largest difference that the tolerance allows for it.
    pub allowed: f64,
    /// The fraction of samples that are equal to the last bit.
    pub equal: f64,
    /// The largest magnitude in the output and in the inputs.
    pub range: f64,
}

/// Runs a case on both backends and compares all outputs. Returns None when the CPU's kernel fails, which that of the
/// GPU then need not do, or runs because an input is no raster.
///
/// # Panics
/// When the GPU leaves the run to the CPU.
#[must_use]
pub fn compare(gpu: &Gpu, case: &Case, inputs: &[InputValue], window: Window) -> Option<Vec<Distance>> {
    let (node, job) = (case.kind(), case.job(inputs.to_vec(), window));
    if inputs.iter().any(|input| matches!(input, InputValue::Value(value) if value.as_field().is_none())) {
        return None;
    }
    let mut expected = (node.cpu)(&job).ok()?;
    let fields: Vec<(&'static str, Field)> = node
        .outputs
        .iter()
        .filter_map(|output| match expected.take(output.name)? {
            Value::Field(field) => Some((output.name, field)),
            _ => None,
        })
        .collect();
    if fields.iter().any(|(_, field)| field.samples().iter().any(|v| !v.is_finite())) {
        return None;
    }
    let mut found = run(gpu, case, inputs, window, Wanted::ALL).expect("the kernel runs");
    let kernel = node.gpu.expect("a kernel for the GPU");
    let distances = fields.iter().zip(kernel.tolerance).map(|((name, expected), tolerance)| {
        let value = found.take(name).unwrap_or_else(|| panic!("{}.{name} is not given", node.id));
        let found = value.as_field().expect("a raster");
        assert_eq!((found.window(), found.planes()), (expected.window(), expected.planes()));
        distance(found.samples(), expected.samples(), range(inputs), tolerance)
    });
    Some(distances.collect())
}

/// Runs a case on the GPU.
///
/// # Errors
/// That of the kernel.
///
/// # Panics
/// When the GPU leaves the run to the CPU.
pub fn run(
    gpu: &Gpu,
    case: &Case,
    inputs: &[InputValue],
    window: Window,
    wanted: Wanted,
) -> Result<Outputs, NodeError> {
    let mut job = case.job(inputs.to_vec(), window);
    job.wanted = wanted;
    let ran = gpu.run(case.kind(), &job)?;
    Ok(ran.unwrap_or_else(|| panic!("{} {}: {:?}", case.kind().id, case.name, job.warnings.take())))
}

/// Removes and returns a raster from outputs, and brings it to the host.
///
/// # Panics
/// When there is none of that name, or the device does not give it back.
pub fn field(outputs: &mut Outputs, name: &str) -> Field {
    let value = outputs.take(name).expect("an output");
    value.fetch().expect("the device gives it back");
    value.as_field().expect("a raster").clone()
}

/// Removes and returns the report from outputs.
///
/// # Panics
/// When there is none.
pub fn report(outputs: &mut Outputs) -> Report {
    outputs.take("report").expect("a report").as_report().expect("a report").clone()
}

/// The mean distance of two fields as a fraction of the mean magnitude of the second.
#[must_use]
pub fn apart(found: &Field, expected: &Field) -> f64 {
    let pairs = || found.samples().iter().zip(expected.samples()).map(|(a, b)| (f64::from(*a), f64::from(*b)));
    pairs().map(|(a, b)| (a - b).abs()).sum::<f64>() / pairs().map(|(_, b)| b.abs()).sum::<f64>().max(1e-9)
}

/// The largest magnitude of samples.
fn most(samples: &[f32]) -> f64 {
    samples.iter().fold(0.0_f64, |most, v| most.max(f64::from(v.abs())))
}

/// The largest magnitude in the inputs.
#[must_use]
pub fn range(inputs: &[InputValue]) -> f64 {
    let input = |input: &InputValue| match input {
        InputValue::Value(Value::Field(field)) => most(field.samples()),
        InputValue::Constant(v) => v.abs(),
        InputValue::Value(_) | InputValue::Absent => 0.0,
    };
    // numbers far beyond the samples, such as limits that are never reached, do not count
    inputs.iter().map(input).filter(|v| *v < 1e7).fold(0.0, f64::max)
}

/// How far samples are from those of the CPU, with inputs of that range.
#[must_use]
pub fn distance(found: &[f32], expected: &[f32], range: f64, tolerance: &Tolerance) -> Distance {
    let range = most(expected).max(range);
    let mut apart: Vec<f64> = found.iter().zip(expected).map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs()).collect();
    let equal = found.iter().zip(expected).filter(|(a, b)| a.to_bits() == b.to_bits()).count();
    let allowed = tolerance.absolute + tolerance.relative * range;
    let outliers = (tolerance.outliers * apart.len() as f64) as usize;
    let equal = equal as f64 / found.len() as f64;
    // NaN is above every number in this order
    apart.sort_by(f64::total_cmp);
    Distance { most: apart[apart.len() - 1 - outliers], allowed, equal, range }
}

/// An input whose samples are one bit larger in the chosen cells.
#[must_use]
pub fn nudge(input: &InputValue, chosen: impl Fn(usize) -> bool) -> InputValue {
    match input {
        InputValue::Value(Value::Field(field)) => {
            let samples = field.samples().iter().enumerate();
            let samples = samples.map(|(cell, v)| if chosen(cell) { v.next_up() } else { *v });
            InputValue::Value(Field::with_planes(*field.window(), field.planes(), samples.collect()).into())
        }
        other => other.clone(),
    }
}
