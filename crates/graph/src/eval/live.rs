//! A node's running process, with its inputs.

use std::{fmt, path::PathBuf, sync::Arc};

use petgraph::stable_graph::NodeIndex;

use super::{
    Evaluation, Evaluator, Request, check,
    error::EvalError,
    event::Event,
    key::{self, Key, Origins},
    plan::{Plan, Source, Step},
    run::attempt,
};
use crate::{
    backend::{Backend, Cpu},
    graph::{Graph, Instance, Port},
    job::{Cancel, InputValue, Job, LevelJob, NodeError, Wanted, Warnings},
    process::{Moment, Process},
    value::Value,
    world::{Window, World},
};

/// A node of a graph, on the whole of a world.
#[derive(Clone, Debug)]
pub struct LiveNode {
    /// The graph.
    pub graph: Graph,
    /// The folder that its files are relative to.
    pub folder: PathBuf,
    /// The node.
    pub node: NodeIndex,
    /// The world, with its cells.
    pub world: World,
}

impl LiveNode {
    fn instance(&self) -> &Instance {
        self.graph.instance(self.node)
    }
}

/// A node's [process](crate::Node::process), run step by step on the whole world. At its end its outputs equal those of
/// an evaluation of the node; once they are [kept](Self::keep) they are not computed again.
///
/// The process runs on the backend that runs the node's kernel, if that can run processes. If its device fails, the CPU
/// starts it again, with a warning, and catches up.
pub struct Live {
    of: LiveNode,
    inputs: Vec<InputValue>,
    /// The provenance of the inputs.
    ground: Key,
    process: Box<dyn Process>,
    /// The identity of the backend that runs the process.
    runs_on: String,
    /// True after its device has failed.
    has_fallen_back: bool,
    /// The time to catch up with, after that.
    goal: f64,
    warnings: Vec<String>,
}

/// A plan of one node and its sources, with the keys.
struct Planned<'g> {
    plan: Plan<'g>,
    origins: Vec<Option<Origins>>,
    /// The node itself; its sources come before it.
    at: usize,
}

impl<'g> Planned<'g> {
    fn new(evaluator: &Evaluator, of: &'g LiveNode, cancel: &Cancel) -> Result<Self, EvalError> {
        let LiveNode { graph, folder, node, world } = of;
        let request = Request { port: Port { node: *node, output: 0 }, window: Window::whole(*world) };
        let mut plan = Plan::new(graph, &[request], &[]);
        let origins = key::origins(&mut plan, &evaluator.backends, &evaluator.files, folder, cancel);
        let at = plan.targets[0].clone()?.step;
        match plan.steps[at].fault.take() {
            Some(fault) => Err(fault),
            None => Ok(Self { plan, origins, at }),
        }
    }

    fn step(&self) -> &Step<'g> {
        &self.plan.steps[self.at]
    }

    /// The provenance of its results.
    fn origins(&self) -> &Origins {
        self.origins[self.at].as_ref().expect("a step without a fault has a key")
    }

    fn ground(&self) -> Key {
        key::ground(self.step(), self.origins(), &self.origins)
    }
}

impl Live {
    /// Starts the process of a node after evaluating its inputs.
    ///
    /// # Errors
    /// As [`Evaluator::evaluate`]; [`EvalError::Request`] for a node that has no process.
    pub fn begin(
        evaluator: &Evaluator,
        of: LiveNode,
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
    ) -> Result<Self, EvalError> {
        let backend = Arc::clone(evaluator.backends.of(of.instance()));
        Self::begin_on(&backend, evaluator, of, cancel, events)
    }

    fn begin_on(
        backend: &Arc<dyn Backend>,
        evaluator: &Evaluator,
        of: LiveNode,
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
    ) -> Result<Self, EvalError> {
        let planned = Planned::new(evaluator, &of, cancel)?;
        let (step, ground) = (planned.step(), planned.ground());
        let instance = step.instance;
        let Some(begin) = instance.node.process else {
            return Err(EvalError::Request(format!("`{}` cannot be run step by step", instance.name)));
        };
        let wires: Vec<Request> = step
            .inputs
            .iter()
            .filter_map(|source| match source {
                Source::Wire { step: source, output } => {
                    let from = planned.plan.steps[*source].index;
                    Some(Request { port: Port { node: from, output: *output }, window: step.window })
                }
                Source::Constant(_) | Source::Absent => None,
            })
            .collect();
        let evaluation = Evaluation { graph: &of.graph, folder: &of.folder, requests: &wires, byproducts: &[] };
        let values: Result<Vec<Value>, EvalError> =
            evaluator.evaluate(&evaluation, cancel, events).into_iter().collect();
        let mut values = values?.into_iter();
        let input = |source: &Source| match source {
            Source::Wire { .. } => values.next().map_or(InputValue::Absent, InputValue::Value),
            Source::Constant(value) => InputValue::Constant(*value),
            Source::Absent => InputValue::Absent,
        };
        let inputs: Vec<InputValue> = step.inputs.iter().map(input).collect();
        let mut warnings = Vec::new();
        let call = Call { evaluator, of: &of, inputs: &inputs, wanted: Wanted::NONE, cancel };
        let (process, runs_on) = call.run(&mut warnings, |job| {
            if let Some(process) = Arc::clone(backend).begin(job.node, job)? {
                return Ok((process, backend.identity().to_owned()));
            }
            begin(job).map(|process| (process, Cpu.identity().to_owned()))
        })?;
        drop(planned);
        Ok(Self { of, inputs, ground, process, runs_on, has_fallen_back: false, goal: 0.0, warnings })
    }

    /// Starts the process again on the CPU, which catches up from then on.
    fn fall_back(&mut self, evaluator: &Evaluator, cancel: &Cancel) -> Result<(), EvalError> {
        let goal = self.goal.max(self.moment().now);
        let backend: Arc<dyn Backend> = Arc::new(Cpu);
        let cpu = Self::begin_on(&backend, evaluator, self.of.clone(), cancel, &|_| {})?;
        let mut warnings = std::mem::take(&mut self.warnings);
        add_new(&mut warnings, cpu.warnings);
        *self = Self { goal, warnings, has_fallen_back: true, ..cpu };
        Ok(())
    }

    /// Returns true if the process runs on a device that the evaluator has lost since.
    fn has_lost_device(&self, evaluator: &Evaluator) -> bool {
        let now = evaluator.backends.of(self.of.instance());
        self.is_on_device() && now.is_cpu()
    }

    /// Continues with another state of the graph if every step so far would have been the same there, and returns true;
    /// otherwise changes nothing and returns false.
    ///
    /// # Errors
    /// As [`Evaluator::key`]; also as [`Self::begin`] if its device was lost meanwhile.
    pub fn follow(&mut self, evaluator: &Evaluator, to: LiveNode, cancel: &Cancel) -> Result<bool, EvalError> {
        if self.has_lost_device(evaluator) {
            self.fall_back(evaluator, cancel)?;
        }
        let ground = Planned::new(evaluator, &to, cancel)?.ground();
        let (before, now) = (self.of.instance(), to.instance());
        if ground != self.ground || now.prefers != before.prefers {
            return Ok(false);
        }
        if now.params != before.params && !self.process.take(&now.params) {
            return Ok(false);
        }
        self.of = to;
        Ok(true)
    }

    /// The position in time.
    #[must_use]
    pub fn moment(&self) -> Moment {
        self.process.moment()
    }

    /// Cells along x and y.
    #[must_use]
    pub const fn cells(&self) -> [u32; 2] {
        self.of.world.cells
    }

    /// Returns true while it catches up, after its device has failed.
    #[must_use]
    pub fn is_behind(&self) -> bool {
        self.moment().now < self.goal
    }

    /// Returns true if a device runs it.
    #[must_use]
    pub fn is_on_device(&self) -> bool {
        self.runs_on != Cpu.identity()
    }

    /// The warnings since its start.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Advances by one step; does nothing at the end.
    ///
    /// # Errors
    /// [`EvalError`]; the process cannot continue after it.
    pub fn step(&mut self, evaluator: &Evaluator, cancel: &Cancel) -> Result<(), EvalError> {
        if self.moment().is_over() {
            return Ok(());
        }
        let step = |process: &mut dyn Process, job: &Job<'_>| process.step(job);
        match self.call(evaluator, Wanted::NONE, cancel, step) {
            Err(_) if self.process.has_lost_device() => self.fall_back(evaluator, cancel),
            stepped => stepped,
        }
    }

    /// The current outputs of the node that are wanted, in the order of its declaration.
    ///
    /// # Errors
    /// [`EvalError`], as for a kernel.
    pub fn outputs(
        &mut self,
        evaluator: &Evaluator,
        wanted: Wanted,
        cancel: &Cancel,
    ) -> Result<Vec<Option<Value>>, EvalError> {
        let outputs = |process: &mut dyn Process, job: &Job<'_>| process.outputs(job);
        let outputs = match self.call(evaluator, wanted, cancel, outputs) {
            Err(_) if self.process.has_lost_device() => {
                self.fall_back(evaluator, cancel)?;
                self.call(evaluator, wanted, cancel, outputs)?
            }
            outputs => outputs?,
        };
        let planned = Planned::new(evaluator, &self.of, cancel)?;
        check::take(planned.step(), wanted, outputs)
    }

    /// Stores the outputs of a finished process as the results of the node, so that an evaluation finds them.
    ///
    /// # Errors
    /// As [`Self::outputs`].
    pub fn keep(&self, evaluator: &Evaluator, outputs: &[Option<Value>]) -> Result<(), EvalError> {
        let planned = Planned::new(evaluator, &self.of, &Cancel::default())?;
        // an evaluation leaves a kernel to the CPU as well if the device fails
        let backend = evaluator.backends.of(self.of.instance());
        let is_that_of_the_key = self.has_fallen_back || backend.identity() == self.runs_on;
        // If a file has changed since, the same process has another key.
        if self.moment().is_over() && planned.ground() == self.ground && is_that_of_the_key {
            for (output, value) in outputs.iter().enumerate().filter_map(|(at, value)| Some((at, value.as_ref()?))) {
                evaluator.store.insert((planned.origins().key, output), &planned.step().wanted, value);
            }
        }
        Ok(())
    }

    /// Calls the process.
    fn call<T: Send>(
        &mut self,
        evaluator: &Evaluator,
        wanted: Wanted,
        cancel: &Cancel,
        code: impl FnOnce(&mut dyn Process, &Job<'_>) -> Result<T, NodeError> + Send,
    ) -> Result<T, EvalError> {
        let Self { of, inputs, process, warnings, .. } = self;
        let call = Call { evaluator, of, inputs, wanted, cancel };
        call.run(warnings, |job| code(&mut **process, job))
    }
}

impl fmt::Debug for Live {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Live").field("moment", &self.moment()).finish_non_exhaustive()
    }
}

/// A call of a function of the node.
struct Call<'a> {
    evaluator: &'a Evaluator,
    of: &'a LiveNode,
    inputs: &'a [InputValue],
    wanted: Wanted,
    cancel: &'a Cancel,
}

impl Call<'_> {
    /// Runs it on the evaluator's threads, and adds its warnings to those before.
    fn run<T: Send>(
        &self,
        warnings: &mut Vec<String>,
        code: impl FnOnce(&Job<'_>) -> Result<T, NodeError> + Send,
    ) -> Result<T, EvalError> {
        let instance = self.of.instance();
        let job = Job {
            node: instance.node,
            params: &instance.params,
            inputs: self.inputs.to_vec(),
            level: LevelJob::default(),
            window: Window::whole(self.of.world),
            wanted: self.wanted,
            folder: self.of.folder.clone(),
            cancel: self.cancel.clone(),
            progress: &|_| {},
            warnings: Warnings::default(),
            glimpses: None,
        };
        let done = self.evaluator.pool.install(|| attempt(instance, self.cancel, || code(&job)));
        add_new(warnings, job.warnings.take());
        done
    }
}

fn add_new(warnings: &mut Vec<String>, more: Vec<String>) {
    for message in more {
        if !warnings.contains(&message) {
            warnings.push(message);
        }
    }
}
