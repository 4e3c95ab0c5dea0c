//! The evaluator: builds what is asked for, and of that only what has changed.
//!
//! A request is pulled up the wires: [`plan`] finds the nodes it needs and the window each is needed on, growing it by
//! the nodes' reaches; [`key`] names each result by a hash of all that can change it; [`needs`] takes from the caches
//! ([`cache`] in memory, [`disk`]) what they hold under those names; [`memory`] asks whether there is room for the rest;
//! [`run`] computes it, independent nodes side by side; [`check`] holds each result against its declaration. [`live`] runs one
//! node step by step.

mod cache;
mod check;
mod disk;
mod error;
mod event;
mod files;
mod key;
mod live;
mod memory;
mod needs;
mod plan;
mod run;
#[cfg(test)]
mod tests;

use std::{fmt, num::NonZero, path::Path, path::PathBuf, sync::Arc, time::Duration};

pub use error::EvalError;
pub use event::{Event, Origin};
pub use key::Key;
pub use live::Live;

use self::{cache::MemoryCache, disk::DiskCache, files::Files, needs::Needs, plan::Plan, run::Run};
use crate::{
    backend::{Backend, Cpu},
    graph::{Graph, Port},
    job::Cancel,
    value::Value,
    world::Window,
};

/// How an [`Evaluator`] works. Nothing in it changes a result, save for a backend within its nodes' tolerances.
#[derive(Clone)]
pub struct EvaluatorOptions {
    /// Runs the kernels that it supports; the CPU runs the others.
    pub backend: Arc<dyn Backend>,
    /// Bytes of results that are kept in memory between evaluations.
    pub memory_budget: usize,
    /// Bytes that the values of one evaluation may take at once, estimated before it starts; `None` for what the machine
    /// has free. What kernels use beside their inputs and outputs is not counted.
    pub memory_limit: Option<u64>,
    /// Keeps results between runs of the program.
    pub disk_cache: Option<DiskCacheOptions>,
    /// Threads that work; `None` for one per core.
    pub threads: Option<NonZero<usize>>,
    /// How often results are shown while their kernel goes on, where it can ([`Event::NodeGlimpse`]); `None` for never.
    pub glimpses: Option<Duration>,
}

/// A folder of results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DiskCacheOptions {
    /// The folder; it is made when the first result is written. Only files of the cache in it are ever touched.
    pub folder: PathBuf,
    /// Bytes that its files may take; the least recently used are deleted.
    pub budget: u64,
}

impl Default for EvaluatorOptions {
    /// The CPU, 1 GiB of results in memory, the machine's limit, none on disk, a thread per core.
    fn default() -> Self {
        Self {
            backend: Arc::new(Cpu),
            memory_budget: 1 << 30,
            memory_limit: None,
            disk_cache: None,
            threads: None,
            glimpses: None,
        }
    }
}

impl fmt::Debug for EvaluatorOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("EvaluatorOptions")
            .field("backend", &self.backend.name())
            .field("memory_budget", &self.memory_budget)
            .field("memory_limit", &self.memory_limit)
            .field("disk_cache", &self.disk_cache)
            .field("threads", &self.threads)
            .field("glimpses", &self.glimpses)
            .finish()
    }
}

/// Evaluates graphs, and remembers results by what they come from. It can be shared: evaluations of several threads
/// find each other's results, and take turns on its workers, so that one may wait for a kernel of another.
///
/// ```
/// use orograph_graph::{
///     Cancel, Evaluator, EvaluatorOptions, Field, Graph, Instance, Node, Output, Outputs, PortType, Window, World,
/// };
///
/// static PLAIN: Node = Node {
///     id: "Plain",
///     outputs: &[Output::gives("height", PortType::Height, "Elevation.")],
///     cpu: |job| Ok(Outputs::one("height", Field::constant(job.window(), 120.0))),
///     ..Node::DEFAULT
/// };
///
/// let mut graph = Graph::default();
/// graph.add(Instance::new("plain", &PLAIN))?;
/// let evaluator = Evaluator::new(EvaluatorOptions::default())?;
/// let requests = [(graph.port("plain.height")?, Window::whole(World::default()))];
/// let values = evaluator.evaluate(&graph, ".".as_ref(), &requests, &Cancel::default(), &|_| {})?;
/// assert_eq!(values[0].as_field().and_then(|field| field.range(0)), Some((120.0, 120.0)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Evaluator {
    backend: Arc<dyn Backend>,
    pool: rayon::ThreadPool,
    memory: MemoryCache,
    memory_limit: Option<u64>,
    disk: Option<DiskCache>,
    files: Files,
    glimpses: Option<Duration>,
}

impl Evaluator {
    /// Stack of a worker. A worker that waits inside a kernel may take up another one, on top of the first.
    const STACK_BYTES: usize = 8 << 20;

    /// An evaluator with its own worker threads.
    ///
    /// # Errors
    /// [`EvalError::Threads`] when the system gives no threads.
    pub fn new(options: EvaluatorOptions) -> Result<Self, EvalError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(options.threads.map_or(0, NonZero::get))
            .thread_name(|i| format!("evaluator {i}"))
            .stack_size(Self::STACK_BYTES)
            .build()
            .map_err(|error| EvalError::Threads(error.to_string()))?;
        Ok(Self {
            backend: options.backend,
            pool,
            memory: MemoryCache::new(options.memory_budget),
            memory_limit: options.memory_limit,
            disk: options.disk_cache.map(|DiskCacheOptions { folder, budget }| DiskCache::new(folder, budget)),
            files: Files::default(),
            glimpses: options.glimpses,
        })
    }

    /// Number of worker threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Bytes of the results that are kept in memory; never more than the budget.
    #[must_use]
    pub fn cached_bytes(&self) -> usize {
        self.memory.bytes()
    }

    /// The requested outputs, each on its window, in the order of the requests. Blocks until they are there.
    ///
    /// Every request must be of one world. File parameters are relative to `folder`. `events` is called from the worker
    /// threads and should return at once.
    ///
    /// # Errors
    /// The first thing that is in the way, see [`EvalError`]. Nothing runs on after that; results that were complete
    /// stay in the caches.
    pub fn evaluate(
        &self,
        graph: &Graph,
        folder: &Path,
        requests: &[(Port, Window)],
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
    ) -> Result<Vec<Value>, EvalError> {
        let plan = Plan::new(graph, requests)?;
        let origins = key::origins(&plan, &*self.backend, &self.files, folder, cancel)?;
        let needs = Needs::new(self, &plan, &origins, cancel, events);
        if cancel.is_cancelled() {
            return Err(EvalError::Cancelled);
        }
        memory::check(&plan, &needs, self.memory_limit)?;
        let run = Run::new(self, &plan, &origins, needs, folder, cancel, events);
        self.pool.scope(|scope| run.pump(scope));
        run.finish()
    }

    /// The key of an output on a window: equal keys, equal results. It names a result in a file beside it.
    ///
    /// # Errors
    /// As [`Evaluator::evaluate`], for what can be seen without running anything.
    pub fn key(&self, graph: &Graph, folder: &Path, port: Port, window: Window) -> Result<Key, EvalError> {
        let plan = Plan::new(graph, &[(port, window)])?;
        let origins = key::origins(&plan, &*self.backend, &self.files, folder, &Cancel::default())?;
        Ok(origins[plan.targets[0].step].key.output(port.output, &window))
    }
}

impl fmt::Debug for Evaluator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Evaluator").field("backend", &self.backend.name()).field("threads", &self.threads()).finish()
    }
}
