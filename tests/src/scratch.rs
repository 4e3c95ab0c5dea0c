//! The memory that kernels use besides inputs and outputs: measured and declared.

use orograph_graph::{InputValue, Sizing, Value, Wanted, Window, World};
use orograph_nodes::registry;

use crate::{Case, Counting, cases, inputs, world};

/// One measurement of a kernel.
#[derive(Clone, Debug)]
pub struct Scratch {
    /// The node's kind.
    pub id: &'static str,
    /// The case.
    pub case: String,
    /// Cells of the window.
    pub cells: usize,
    /// Peak memory of the kernel in bytes, besides its inputs and outputs.
    pub measured: u64,
    /// Bytes declared by its node.
    pub declared: u64,
    /// Bytes of its outputs.
    pub given: u64,
}

/// Largest difference between declaration and measurement, as a fraction of the larger.
const SHARE: f64 = 0.2;

/// Bytes per cell below which a difference does not count: memory that does not grow with the window (tables, a row per
/// thread, spans of a few per cent of the rows) is not declared, and is smaller than this in the windows of the test.
const FLOOR: f64 = 1.0;

impl Scratch {
    /// A measurement in bytes per cell.
    #[must_use]
    pub fn per_cell(&self, bytes: u64) -> f64 {
        bytes as f64 / self.cells as f64
    }

    /// Returns true if the declaration is close enough to the measurement.
    #[must_use]
    pub fn holds(&self) -> bool {
        let (measured, declared) = (self.measured as f64, self.declared as f64);
        (measured - declared).abs() <= (SHARE * measured.max(declared)).max(FLOOR * self.cells as f64)
    }
}

/// Measures a case on a window of `side` cells per side. Returns None when its kernel refuses the case. On one thread
/// other cases may be measured at the same time.
///
/// # Panics
/// When the inputs cannot be computed.
#[must_use]
pub fn scratch(memory: &Counting, case: &Case, side: u32, threads: usize) -> Option<Scratch> {
    scratch_in(memory, case, world(side), threads)
}

/// Measures a case in a world. Returns None when its kernel refuses the case.
///
/// # Panics
/// When the inputs cannot be computed.
#[must_use]
pub fn scratch_in(memory: &Counting, case: &Case, world: World, threads: usize) -> Option<Scratch> {
    let window = Window::whole(world);
    let values = inputs(case, window);
    let wired: Vec<bool> = values.iter().map(|value| matches!(value, InputValue::Value(_))).collect();
    let node = case.kind();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let job = case.job(values, window);
    // threads allocate their own structures on first use
    pool.broadcast(|_| ());
    let kernel = || (node.cpu)(&job);
    let (outputs, peak) = match threads {
        1 => pool.install(|| memory.peak_of_thread(kernel)),
        _ => memory.peak_of(|| pool.install(kernel)),
    };
    let given: u64 = outputs.ok()?.into_iter_named().map(|(_, value)| new_bytes(&value, &job.inputs)).sum();
    let params = job.params;
    let sizing = Sizing { params, window, wired: &wired, wanted: Wanted::ALL, folder: &job.folder };
    let declared = node.scratch.bytes(&sizing);
    let measured = (peak as u64).saturating_sub(given);
    Some(Scratch { id: node.id, case: case.name.clone(), cells: window.len(), measured, declared, given })
}

/// Size of an output; 0 for an input that is passed on.
fn new_bytes(value: &Value, inputs: &[InputValue]) -> u64 {
    let samples = |value: &Value| value.as_field().map(|field| field.samples().as_ptr());
    let is_input = |input: &InputValue| match input {
        InputValue::Value(input) => samples(input).is_some() && samples(input) == samples(value),
        InputValue::Constant(_) | InputValue::Absent => false,
    };
    if inputs.iter().any(is_input) { 0 } else { value.bytes() as u64 }
}

/// Measures all cases of all nodes, or of those named, each at the given sizes and numbers of threads.
pub fn scratches<'a>(
    memory: &'a Counting,
    names: &'a [String],
    runs: &'a [(u32, usize)],
) -> impl Iterator<Item = Vec<Scratch>> + 'a {
    let registry = registry();
    let nodes = registry.nodes().to_vec();
    let chosen = nodes.into_iter().filter(|node| names.is_empty() || names.iter().any(|name| name == node.id));
    chosen.flat_map(cases).filter_map(move |case| {
        let measured: Option<Vec<_>> =
            runs.iter().map(|(side, threads)| scratch(memory, &case, *side, *threads)).collect();
        measured
    })
}
