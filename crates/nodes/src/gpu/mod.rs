//! The GPU backend: runs the kernels that nodes declare for a GPU on a graphics card, through wgpu.
//!
//! It has its own instance and device, apart from that of the 3D view, so that a long kernel never delays a frame.
//! Results stay on the device (`memory`) until something on the host reads them. The host waits whenever the device has
//! work for about 40 ms, after which a run can be cancelled (`run`). If the device has too little memory, refuses a
//! shader or is lost, the CPU runs the node, and a warning says so.

mod adapters;
mod clock;
mod device;
mod memory;
mod process;
mod run;
#[cfg(test)]
mod tests;

use std::{
    collections::HashMap,
    path::PathBuf,
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

pub use adapters::{Adapter, Adapters, Speed};
use clock::Clock;
pub use device::Trouble;
use device::{Device, Pipeline};
use memory::Memory;
use orograph_graph::{
    Backend, Cancel, Fallback, Field, Input, InputValue, Job, LevelJob, Node, NodeError, Outputs, ParamValues, Process,
    Wanted, Warnings, Window, gpu,
};

/// Options of a [`Gpu`].
#[derive(Clone, Debug, Default)]
pub struct GpuOptions {
    /// Size limit of the values that stay on the device, in bytes; `None` for one that suits the adapter.
    pub budget: Option<u64>,
    /// Ask for no more than the limits that every WebGPU device has, rather than for all that the adapter has.
    pub plain_limits: bool,
    /// Bind no more than that many bytes of a buffer at a time, for tests; a larger raster is computed in bands.
    pub largest_binding: Option<u64>,
    /// Behave as a device with no more than that many bytes of memory, for tests.
    pub memory: Option<u64>,
    /// Fill results with NaN before a kernel writes them, for tests.
    pub poison: bool,
    /// Invocations of a workgroup in passes over cells, for tests and benchmarks; `None` for what suits the adapter.
    pub workgroup: Option<u32>,
    /// Measure how long the device itself works, for benchmarks; see [`Gpu::busy`].
    pub clock: bool,
}

/// A shader and its entry point.
type Entry = (&'static str, &'static str);
/// A compiled entry point, or why the driver refuses it.
type Compiled = Result<Arc<Pipeline>, String>;

/// The backend for one adapter.
pub struct Gpu {
    identity: String,
    memory: Arc<Memory>,
    /// Compiled shaders, and why others were refused.
    pipelines: Mutex<HashMap<(&'static str, Entry), Compiled>>,
    /// Nanoseconds per cell of entry points, as measured.
    rates: Mutex<HashMap<Entry, f64>>,
    /// The parameter structs of a submit.
    uniforms: wgpu::Buffer,
    turn: Turn,
    poison: bool,
    clock: Option<Clock>,
}

impl Gpu {
    /// Opens an adapter.
    ///
    /// # Errors
    /// [`Trouble`] when its driver does not work.
    pub fn new(adapter: &Adapter, options: &GpuOptions) -> Result<Self, Trouble> {
        let mut device = Device::open(adapter, options)?;
        if let Some(most) = options.largest_binding {
            let limit = &mut device.limits.max_storage_buffer_binding_size;
            *limit = most.min(*limit);
        }
        let budget = options.budget.unwrap_or_else(|| adapter.budget());
        let clock = if options.clock { Clock::new(&device)? } else { None };
        let uniforms = device.caught(|| {
            device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("parameters"),
                size: run::UNIFORM_BYTES,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        })?;
        Ok(Self {
            identity: adapter.identity(),
            memory: Arc::new(Memory::new(device, budget, options.memory.unwrap_or(u64::MAX))),
            pipelines: Mutex::default(),
            rates: Mutex::default(),
            uniforms,
            turn: Turn::default(),
            poison: options.poison,
            clock,
        })
    }

    /// Bytes of the values that are on the device, and of buffers that are kept for the next ones.
    #[must_use]
    pub fn held(&self) -> u64 {
        self.memory.held()
    }

    /// How long the device has worked on kernels since it was opened, without the time between submits; `None` unless
    /// [`GpuOptions::clock`] is set and the device has a clock.
    #[must_use]
    pub fn busy(&self) -> Option<Duration> {
        self.clock.as_ref().map(Clock::busy)
    }

    /// Destroys the device, as if the driver had lost it; for tests.
    pub fn lose(&self) {
        self.memory.device.lose();
    }

    /// The time of a node's kernel with default parameters, after a first run that compiles it; for reports.
    fn time(
        &self,
        node: &'static Node,
        window: Window,
        inputs: &[(&str, &Field)],
        cancel: &Cancel,
    ) -> Result<Duration, Trouble> {
        let params = ParamValues::defaults(&node.specs());
        let value = |input: &Input| match (inputs.iter().find(|(name, _)| *name == input.name), input.fallback) {
            (Some((_, field)), _) => InputValue::Value((*field).clone().into()),
            (None, Fallback::Constant { default, .. }) => InputValue::Constant(default),
            (None, Fallback::Required | Fallback::None) => InputValue::Absent,
        };
        let job = Job {
            node,
            params: &params,
            inputs: node.inputs.iter().map(value).collect(),
            level: LevelJob::default(),
            window,
            wanted: Wanted::ALL,
            folder: PathBuf::new(),
            cancel: cancel.clone(),
            progress: &|_| {},
            warnings: Warnings::default(),
            glimpses: None,
        };
        let kernel = node.gpu.ok_or(Trouble::Input)?;
        let mut best = Duration::MAX;
        for _ in 0..3 {
            let _turn = self.turn.take(&job).map_err(|_| Trouble::Input)?;
            let mut run = run::Run::begin(self, &job)?;
            let start = run::now();
            let recorded = gpu::record(kernel, &job, &mut run);
            run.finish(recorded).map_err(run::Stop::into_trouble)?;
            best = best.min(start.elapsed());
        }
        Ok(best)
    }

    /// Leaves a run to the CPU, and says why.
    fn decline(&self, job: &Job<'_>, trouble: &Trouble) {
        if matches!(trouble, Trouble::Lost(_)) {
            self.memory.device.give_up(trouble);
        }
        job.warn(format!("computed on the CPU: {trouble}; {}", trouble.remedy()));
    }
}

impl Backend for Gpu {
    fn name(&self) -> &'static str {
        "gpu"
    }

    fn identity(&self) -> &str {
        &self.identity
    }

    fn supports(&self, node: &Node, params: &ParamValues) -> bool {
        node.has_gpu_kernel(params) && !self.memory.device.is_lost()
    }

    fn run(&self, node: &Node, job: &Job<'_>) -> Result<Option<Outputs>, NodeError> {
        let Some(kernel) = node.gpu else { return Ok(None) };
        let _turn = self.turn.take(job)?;
        if self.memory.device.is_lost() {
            return Ok(None);
        }
        let ran = run::Run::begin(self, job).map_err(run::Stop::Trouble).and_then(|mut run| {
            let recorded = gpu::record(kernel, job, &mut run);
            run.finish(recorded)
        });
        match ran {
            Ok(outputs) => Ok(Some(outputs)),
            Err(run::Stop::Node(error)) => Err(error),
            Err(run::Stop::Trouble(trouble)) => {
                self.decline(job, &trouble);
                Ok(None)
            }
        }
    }

    fn begin(self: Arc<Self>, node: &Node, job: &Job<'_>) -> Result<Option<Box<dyn Process>>, NodeError> {
        match node.gpu.map(|kernel| kernel.passes) {
            Some(gpu::Passes::Stepped(begin)) => process::begin(self, begin, job),
            _ => Ok(None),
        }
    }
}

impl std::fmt::Debug for Gpu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Gpu").field("identity", &self.identity).field("held", &self.held()).finish_non_exhaustive()
    }
}

/// One kernel runs on the device at a time.
#[derive(Default)]
struct Turn {
    taken: Mutex<bool>,
    free: Condvar,
}

/// Ends a turn when it is dropped.
struct Taken<'a>(&'a Turn);

impl Turn {
    /// How often a run that waits looks whether it is cancelled.
    const PATIENCE: Duration = Duration::from_millis(20);

    /// Waits for the device.
    fn take(&self, job: &Job<'_>) -> Result<Taken<'_>, NodeError> {
        let mut taken = lock(&self.taken);
        while *taken {
            job.check()?;
            let waited = self.free.wait_timeout(taken, Self::PATIENCE).unwrap_or_else(PoisonError::into_inner);
            (taken, _) = waited;
        }
        *taken = true;
        Ok(Taken(self))
    }
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        *lock(&self.0.taken) = false;
        self.0.free.notify_one();
    }
}

/// Locks a mutex, even after a panic elsewhere: what these locks protect is consistent between any two statements.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
