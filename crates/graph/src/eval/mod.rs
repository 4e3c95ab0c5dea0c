//! The evaluator: builds what is asked for, and of that only what has changed.
//!
//! Requests are pulled up the wires: [`plan`] finds the nodes they need and the window each is needed on, growing it by
//! the nodes' reaches; [`key`] names each result by a hash of all that can change it; [`needs`] finds what the [`store`]
//! holds under those names, in memory or on disk; [`memory`] asks whether there is room for the rest; [`run`] computes it,
//! independent nodes side by side, and delivers each requested value as soon as it is there; [`check`] holds each result
//! to its declaration. [`live`] runs one node step by step.

mod check;
mod error;
mod event;
mod files;
mod key;
mod live;
mod memory;
mod needs;
mod plan;
mod run;
mod stages;
mod store;
#[cfg(test)]
mod tests;
mod work;

use std::{fmt, io, num::NonZero, path::Path, sync::Arc, sync::Mutex, time::Duration};

pub use error::EvalError;
pub use event::{Event, Origin};
pub use key::Key;
pub use live::Live;
pub use store::{Store, StoreFolder, Usage};

use self::{
    files::Files,
    key::Origins,
    plan::Plan,
    work::{Pinned, Work},
};
use crate::{
    backend::{Backend, Cpu},
    graph::{Graph, Port},
    job::Cancel,
    value::Value,
    world::Window,
};

/// An output on a window of a world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// The output.
    pub port: Port,
    /// The part of the world. Requests of one evaluation may be of different worlds.
    pub window: Window,
}

/// What is asked of a graph.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<'a> {
    /// The graph.
    pub graph: &'a Graph,
    /// What file parameters are relative to.
    pub folder: &'a Path,
    /// What is delivered. What comes first is computed first.
    pub requests: &'a [Request],
    /// What is stored as well where its kernel runs for a request anyway; it is never delivered.
    pub byproducts: &'a [Request],
}

/// A requested value.
#[derive(Clone, Debug, PartialEq)]
pub struct Delivered {
    /// The value.
    pub value: Value,
    /// Its key: equal keys, equal values. It names a result in a file beside it.
    pub key: Key,
}

/// The answer to a request.
pub type Delivery = Result<Delivered, EvalError>;

/// How an [`Evaluator`] works. Nothing in it changes a result, save for a backend within its nodes' tolerances.
#[derive(Clone)]
pub struct EvaluatorOptions {
    /// Runs the kernels that it supports; the CPU runs the others.
    pub backend: Arc<dyn Backend>,
    /// Keeps results between evaluations; several evaluators may share it.
    pub store: Arc<Store>,
    /// Bytes that one evaluation may take at once, estimated before it starts; `None` for what the machine has free.
    pub memory_limit: Option<u64>,
    /// Threads that work; `None` for one per core.
    pub threads: Option<NonZero<usize>>,
    /// How often results are shown while their kernel goes on, where it can ([`Event::NodeGlimpse`]); `None` for never.
    pub glimpses: Option<Duration>,
}

impl Default for EvaluatorOptions {
    /// The CPU, a store of its own with 1 GiB of memory and no disk, the machine's limit, a thread per core.
    fn default() -> Self {
        Self {
            backend: Arc::new(Cpu),
            store: Arc::new(Store::new(1 << 30, None)),
            memory_limit: None,
            threads: None,
            glimpses: None,
        }
    }
}

impl fmt::Debug for EvaluatorOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("EvaluatorOptions")
            .field("backend", &self.backend.name())
            .field("store", &self.store)
            .field("memory_limit", &self.memory_limit)
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
///     Cancel, Evaluation, Evaluator, EvaluatorOptions, Field, Graph, Instance, Node, Output, Outputs, PortType, Request,
///     Window, World,
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
/// let requests = [Request { port: graph.port("plain.height")?, window: Window::whole(World::default()) }];
/// let evaluation = Evaluation { graph: &graph, folder: ".".as_ref(), requests: &requests, byproducts: &[] };
/// let values = evaluator.evaluate(&evaluation, &Cancel::default(), &|_| {});
/// let height = values[0].as_ref().expect("a plain node").as_field().expect("a raster");
/// assert_eq!(height.range(0), Some((120.0, 120.0)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Evaluator {
    backend: Arc<dyn Backend>,
    pool: rayon::ThreadPool,
    store: Arc<Store>,
    memory_limit: Option<u64>,
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
            store: options.store,
            memory_limit: options.memory_limit,
            files: Files::default(),
            glimpses: options.glimpses,
        })
    }

    /// Number of worker threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Where its results are kept.
    #[must_use]
    pub const fn store(&self) -> &Arc<Store> {
        &self.store
    }

    /// The answers to the requests, in their order. Blocks until all are there.
    pub fn evaluate(
        &self,
        evaluation: &Evaluation<'_>,
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
    ) -> Vec<Result<Value, EvalError>> {
        let answers = Mutex::new(vec![Err(EvalError::Cancelled); evaluation.requests.len()]);
        self.deliver(evaluation, cancel, events, &|request, delivery| {
            event::lock(&answers)[request] = delivery.map(|delivered| delivered.value);
        });
        answers.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// The values of outputs on one window, for callers that neither watch nor cancel.
    ///
    /// # Errors
    /// That of the first output that cannot be had.
    pub fn values(
        &self,
        graph: &Graph,
        folder: &Path,
        ports: &[Port],
        window: Window,
    ) -> Result<Vec<Value>, EvalError> {
        let requests: Vec<Request> = ports.iter().map(|port| Request { port: *port, window }).collect();
        let evaluation = Evaluation { graph, folder, requests: &requests, byproducts: &[] };
        self.evaluate(&evaluation, &Cancel::default(), &|_| {}).into_iter().collect()
    }

    /// Answers each request as soon as its value is there, or cannot be; the value is released when the receiver drops
    /// it. A request that fails does not affect those that do not depend on what failed. Blocks until all are answered.
    ///
    /// `events` and `deliver` are called from the worker threads. `events` should return at once; while `deliver` holds a
    /// thread, the others compute. `deliver` must not wait for this evaluator.
    pub fn deliver(
        &self,
        evaluation: &Evaluation<'_>,
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
        deliver: &(dyn Fn(usize, Delivery) + Sync),
    ) {
        let pinned = Pinned::default();
        Work { evaluation: *evaluation, pinned: &pinned, keeps: true, cancel, events, deliver }.carry_out(self);
    }

    fn origins(&self, plan: &mut Plan<'_>, folder: &Path, cancel: &Cancel) -> Vec<Option<Origins>> {
        key::origins(plan, &*self.backend, &self.files, folder, cancel)
    }

    /// Writes the requested values that are in memory to the store's folder, where there is one, so that another run of
    /// the program finds them.
    ///
    /// # Errors
    /// When the folder takes no files; the results stay in memory.
    pub fn persist(&self, evaluation: &Evaluation<'_>, cancel: &Cancel) -> Result<(), String> {
        if self.store.folder().is_none() {
            return Ok(());
        }
        let mut plan = Plan::new(evaluation.graph, evaluation.requests, &[]);
        let origins = self.origins(&mut plan, evaluation.folder, cancel);
        for target in plan.targets.iter().flatten() {
            let (Some(origins), step) = (&origins[target.step], &plan.steps[target.step]) else { continue };
            let slot = (origins.key, target.output);
            if let Some(value) = self.store.in_memory(slot, &step.wanted) {
                let written = self.pool.install(|| self.store.persist(slot, &step.wanted, &value, cancel));
                written.map_err(|error| self.unkept(&error))?;
            }
        }
        Ok(())
    }

    fn unkept(&self, error: &io::Error) -> String {
        let folder = self.store.folder().map_or_else(String::new, |place| place.folder.display().to_string());
        format!("results cannot be kept in {folder}: {error}")
    }

    /// The key of an output on a window: equal keys, equal results.
    ///
    /// # Errors
    /// As [`Evaluator::evaluate`], for what can be seen without running anything.
    pub fn key(&self, graph: &Graph, folder: &Path, port: Port, window: Window) -> Result<Key, EvalError> {
        let mut plan = Plan::new(graph, &[Request { port, window }], &[]);
        let origins = self.origins(&mut plan, folder, &Cancel::default());
        let target = plan.targets[0].clone()?;
        match &origins[target.step] {
            Some(origins) => Ok(origins.key.output(port.output, &window)),
            None => Err(plan.steps[target.step].fault.clone().unwrap_or(EvalError::Cancelled)),
        }
    }
}

impl fmt::Debug for Evaluator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Evaluator").field("backend", &self.backend.name()).field("threads", &self.threads()).finish()
    }
}
