//! A node's running process, with its inputs.

use std::{
    fmt,
    path::{Path, PathBuf},
};

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
    graph::{Graph, Instance, Port},
    job::{Cancel, InputValue, Job, LevelJob, NodeError, Wanted, Warnings},
    process::{Moment, Process},
    value::Value,
    world::{Window, World},
};

/// A node's [process](crate::Node::process), run step by step on the whole world. At its end its outputs equal those of
/// an evaluation of the node; once they are [kept](Self::keep) they are not computed again.
pub struct Live {
    graph: Graph,
    folder: PathBuf,
    node: NodeIndex,
    world: World,
    inputs: Vec<InputValue>,
    /// The provenance of the inputs.
    ground: Key,
    process: Box<dyn Process>,
}

/// A plan of one node and its sources, with the keys.
struct Planned<'g> {
    plan: Plan<'g>,
    origins: Vec<Option<Origins>>,
    /// The node itself; its sources come before it.
    at: usize,
}

impl<'g> Planned<'g> {
    fn new(
        evaluator: &Evaluator,
        graph: &'g Graph,
        folder: &Path,
        node: NodeIndex,
        world: World,
        cancel: &Cancel,
    ) -> Result<Self, EvalError> {
        let request = Request { port: Port { node, output: 0 }, window: Window::whole(world) };
        let mut plan = Plan::new(graph, &[request], &[]);
        let origins = key::origins(&mut plan, &*evaluator.backend, &evaluator.files, folder, cancel);
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
        graph: Graph,
        folder: PathBuf,
        node: NodeIndex,
        world: World,
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
    ) -> Result<Self, EvalError> {
        let planned = Planned::new(evaluator, &graph, &folder, node, world, cancel)?;
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
        let evaluation = Evaluation { graph: &graph, folder: &folder, requests: &wires, byproducts: &[] };
        let values: Result<Vec<Value>, EvalError> =
            evaluator.evaluate(&evaluation, cancel, events).into_iter().collect();
        let mut values = values?.into_iter();
        let input = |source: &Source| match source {
            Source::Wire { .. } => values.next().map_or(InputValue::Absent, InputValue::Value),
            Source::Constant(value) => InputValue::Constant(*value),
            Source::Absent => InputValue::Absent,
        };
        let inputs: Vec<InputValue> = step.inputs.iter().map(input).collect();
        let place = (Window::whole(world), folder.as_path());
        let process = with_job(evaluator, instance, &inputs, place, cancel, begin)?;
        drop(planned);
        Ok(Self { graph, folder, node, world, inputs, ground, process })
    }

    /// Continues with another state of the graph if every step so far would have been the same there, and returns true;
    /// otherwise changes nothing and returns false.
    ///
    /// # Errors
    /// As [`Evaluator::key`].
    pub fn follow(
        &mut self,
        evaluator: &Evaluator,
        graph: Graph,
        folder: PathBuf,
        node: NodeIndex,
        world: World,
    ) -> Result<bool, EvalError> {
        let planned = Planned::new(evaluator, &graph, &folder, node, world, &Cancel::default())?;
        let instance = planned.step().instance;
        if planned.ground() != self.ground {
            return Ok(false);
        }
        let same = instance.params == self.graph.instance(self.node).params;
        if !same && !self.process.take(&instance.params) {
            return Ok(false);
        }
        drop(planned);
        (self.graph, self.folder, self.node, self.world) = (graph, folder, node, world);
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
        self.world.cells
    }

    /// Advances by one step; does nothing at the end.
    ///
    /// # Errors
    /// [`EvalError`]; the process cannot continue after it.
    pub fn step(&mut self, evaluator: &Evaluator, cancel: &Cancel) -> Result<(), EvalError> {
        if self.moment().is_over() {
            return Ok(());
        }
        let Self { graph, folder, node, world, inputs, process, .. } = self;
        let instance = graph.instance(*node);
        with_job(evaluator, instance, inputs, (Window::whole(*world), folder), cancel, |job| process.step(job))
    }

    /// The node's current outputs, in the order of its declaration.
    ///
    /// # Errors
    /// [`EvalError`], as for a kernel.
    pub fn outputs(&self, evaluator: &Evaluator, cancel: &Cancel) -> Result<Vec<Value>, EvalError> {
        let place = (Window::whole(self.world), self.folder.as_path());
        let instance = self.graph.instance(self.node);
        let outputs = with_job(evaluator, instance, &self.inputs, place, cancel, |job| self.process.outputs(job))?;
        let planned = Planned::new(evaluator, &self.graph, &self.folder, self.node, self.world, cancel)?;
        Ok(check::take(planned.step(), Wanted::ALL, outputs)?.into_iter().flatten().collect())
    }

    /// Stores the outputs of a finished process as the results of the node, so that an evaluation finds them.
    ///
    /// # Errors
    /// As [`Self::outputs`].
    pub fn keep(&self, evaluator: &Evaluator, outputs: &[Value]) -> Result<(), EvalError> {
        let planned = Planned::new(evaluator, &self.graph, &self.folder, self.node, self.world, &Cancel::default())?;
        // If a file has changed since, the same process has another key.
        if self.moment().is_over() && planned.ground() == self.ground {
            for (output, value) in outputs.iter().enumerate() {
                evaluator.store.insert((planned.origins().key, output), &planned.step().wanted, value);
            }
        }
        Ok(())
    }
}

impl fmt::Debug for Live {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Live").field("moment", &self.moment()).finish_non_exhaustive()
    }
}

/// Runs a function of the node on the evaluator's threads.
fn with_job<T: Send>(
    evaluator: &Evaluator,
    instance: &Instance,
    inputs: &[InputValue],
    (window, folder): (Window, &Path),
    cancel: &Cancel,
    code: impl FnOnce(&Job<'_>) -> Result<T, NodeError> + Send,
) -> Result<T, EvalError> {
    let job = Job {
        node: instance.node,
        params: &instance.params,
        inputs: inputs.to_vec(),
        level: LevelJob::default(),
        window,
        wanted: Wanted::ALL,
        folder: folder.to_owned(),
        cancel: cancel.clone(),
        progress: &|_| {},
        warnings: Warnings::default(),
        glimpses: None,
    };
    evaluator.pool.install(|| attempt(instance, cancel, || code(&job)))
}
