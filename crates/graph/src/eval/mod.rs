//! The evaluator: builds requested outputs, and recomputes only what has changed.
//!
//! Requests are pulled up the wires: [`plan`] finds the nodes they need and the window for each, grown by the nodes'
//! reaches; [`key`] names each result by a hash of everything that can change it; [`needs`] looks these names up in the
//! [`store`], in memory or on disk; [`memory`] checks whether there is room for the rest; [`run`] computes it,
//! independent nodes in parallel, and delivers each requested value as soon as it is available; [`check`] verifies each
//! result against its declaration; [`levels`] reports the runs of a node on several levels as one. [`live`] runs one
//! node step by step.

mod check;
mod error;
mod event;
mod files;
mod key;
mod levels;
mod live;
mod memory;
mod needs;
mod plan;
mod run;
mod stages;
mod store;
#[cfg(test)]
mod tests;
mod twins;
mod work;

use std::{fmt, io, num::NonZero, path::Path, sync::Arc, sync::Mutex, time::Duration};

pub(crate) use self::event::lock;
pub use error::EvalError;
pub use event::{Event, Origin};
pub use key::{KEY_SCHEME, Key};
pub use live::{Live, LiveNode};
pub use store::{Store, StoreFolder, Trust, Usage, code_is_in};

use self::{
    files::Files,
    key::Origins,
    plan::Plan,
    work::{Listener, Pinned, Work},
};
use crate::{
    backend::{Backend, Backends, Cpu},
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
    /// The part of the world. The requests of one evaluation may be in different worlds.
    pub window: Window,
}

/// The input of an evaluation.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<'a> {
    /// The graph.
    pub graph: &'a Graph,
    /// The folder that file parameters are relative to.
    pub folder: &'a Path,
    /// The outputs to deliver. Earlier requests are computed first.
    pub requests: &'a [Request],
    /// Outputs to store as well if their kernel runs for a request anyway; they are never delivered.
    pub byproducts: &'a [Request],
}

/// A requested value.
#[derive(Clone, Debug, PartialEq)]
pub struct Delivered {
    /// The value.
    pub value: Value,
    /// Its key: values with equal keys are equal. It also names a stored result.
    pub key: Key,
}

/// The result of a request.
pub type Delivery = Result<Delivered, EvalError>;

/// Options of an [`Evaluator`]. They do not change results, except a backend within the tolerances of its nodes.
#[derive(Clone)]
pub struct EvaluatorOptions {
    /// Runs the kernels that it supports; the CPU runs the others.
    pub backend: Arc<dyn Backend>,
    /// Runs the kernels that it supports of nodes that [ask](crate::Prefer) for a device.
    pub device: Arc<dyn Backend>,
    /// Caches results between evaluations; several evaluators may share it.
    pub store: Arc<Store>,
    /// Memory limit of one evaluation in bytes, checked against an estimate before it starts; `None` for the free
    /// memory of the machine.
    pub memory_limit: Option<u64>,
    /// Number of worker threads; `None` for one per core.
    pub threads: Option<NonZero<usize>>,
    /// Interval between intermediate results ([`Event::NodeGlimpse`]) from kernels that offer them; `None` turns them
    /// off.
    pub glimpses: Option<Duration>,
}

impl Default for EvaluatorOptions {
    /// The CPU alone, a separate store with 1 GiB of memory and no disk, the machine's memory limit, one thread per core.
    fn default() -> Self {
        Self {
            backend: Arc::new(Cpu),
            device: Arc::new(Cpu),
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
            .field("device", &self.device.name())
            .field("store", &self.store)
            .field("memory_limit", &self.memory_limit)
            .field("threads", &self.threads)
            .field("glimpses", &self.glimpses)
            .finish()
    }
}

/// Evaluates graphs and caches results by their provenance. It can be shared between threads: their evaluations reuse
/// each other's results and share its workers, so an evaluation may have to wait for a kernel of another.
///
/// ```
/// use orograph_graph::{
///     Cancel, Evaluation, Evaluator, EvaluatorOptions, Field, Graph, Instance, Node, Output, Outputs, PortType,
///     Request, Window, World,
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
    backends: Backends,
    pool: rayon::ThreadPool,
    store: Arc<Store>,
    memory_limit: Option<u64>,
    files: Files,
    glimpses: Option<Duration>,
}

impl Evaluator {
    /// Stack size of a worker. A worker that waits inside a kernel may start another kernel on top of the first.
    const STACK_BYTES: usize = 8 << 20;

    /// Creates an evaluator with its own worker threads.
    ///
    /// # Errors
    /// [`EvalError::Threads`] when the system cannot start threads.
    pub fn new(options: EvaluatorOptions) -> Result<Self, EvalError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(options.threads.map_or(0, NonZero::get))
            .thread_name(|i| format!("evaluator {i}"))
            .stack_size(Self::STACK_BYTES)
            .build()
            .map_err(|error| EvalError::Threads(error.to_string()))?;
        Ok(Self {
            backends: Backends::new(options.backend, options.device),
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

    /// The store that caches its results.
    #[must_use]
    pub const fn store(&self) -> &Arc<Store> {
        &self.store
    }

    /// Evaluates all requests and returns the results in the order of the requests. Blocks until all are available.
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

    /// The values of outputs on one window, for callers that need neither events nor cancellation.
    ///
    /// # Errors
    /// That of the first output that fails.
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

    /// Delivers the result of each request as soon as it is available or has failed; the value is released when the
    /// receiver drops it. A failing request does not affect requests that do not depend on the failure. Blocks until
    /// all results are delivered.
    ///
    /// `events` and `deliver` are called from the worker threads. `events` should return quickly; while `deliver`
    /// blocks a thread, the others compute. `deliver` must not wait for this evaluator.
    pub fn deliver(
        &self,
        evaluation: &Evaluation<'_>,
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
        deliver: &(dyn Fn(usize, Delivery) + Sync),
    ) {
        let pinned = Pinned::default();
        Work {
            evaluation: *evaluation,
            pinned: &pinned,
            keeps: true,
            cancel,
            listener: Listener::Whole(events),
            deliver,
        }
        .carry_out(self);
    }

    fn origins(&self, plan: &mut Plan<'_>, folder: &Path, cancel: &Cancel) -> Vec<Option<Origins>> {
        let origins = key::origins(plan, &self.backends, &self.files, folder, cancel);
        plan.share(&origins);
        origins
    }

    /// Writes the requested values that are in memory to the store's folder, if it has one, so that another run of the
    /// program finds them.
    ///
    /// # Errors
    /// When the folder cannot be written; the results stay in memory.
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
                value.fetch().map_err(|error| self.unkept(&io::Error::other(error)))?;
                let written = self.pool.install(|| self.store.persist(slot, &step.wanted, &value, cancel));
                written.map_err(|error| self.unkept(&error))?;
            }
        }
        Ok(())
    }

    fn unkept(&self, error: &io::Error) -> String {
        let folder = self.store.folder().map_or_else(String::new, |place| place.folder.display().to_string());
        format!("results cannot be stored in {folder}: {error}")
    }

    /// The key of an output on a window: equal keys, equal results.
    ///
    /// # Errors
    /// As [`Evaluator::evaluate`], for errors that are known without running anything.
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
        let backends = [self.backends.usual.name(), self.backends.device.name()];
        f.debug_struct("Evaluator").field("backends", &backends).field("threads", &self.threads()).finish()
    }
}
