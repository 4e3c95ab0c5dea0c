//! The run of a plan: ready steps side by side on the pool.
//!
//! Each task on the pool runs one kernel, and there are at most as many at a time as the pool has threads. Kernels use
//! the same pool inside; a thread that waits there may take up another step meanwhile, so no lock is held while a
//! kernel runs, and the bound keeps such nesting, and the memory of steps under way, small.

use std::{
    cmp::Reverse,
    collections::BinaryHeap,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
};

use rayon::Scope;

use super::{
    Evaluator, check,
    error::EvalError,
    event::{Event, Origin, Throttle, Ticker, lock, now},
    key::{Origins, backend_of},
    needs::Needs,
    plan::{Plan, Source, Step},
};
use crate::{
    graph::Instance,
    job::{Cancel, Glimpses, InputValue, Job, NodeError, Outputs, Wanted, Warnings},
    memory::{OutOfMemory, running},
    value::Value,
    world::Window,
};

/// One evaluation under way.
pub(super) struct Run<'r> {
    evaluator: &'r Evaluator,
    plan: &'r Plan<'r>,
    origins: &'r [Origins],
    folder: &'r Path,
    events: &'r (dyn Fn(Event) + Sync),
    consumers: Vec<Vec<usize>>,
    /// On when the caller cancels.
    cancel: &'r Cancel,
    /// On then, and when a step has failed.
    stop: Cancel,
    /// Whether writing to the disk cache has failed before; it is not tried again in this run.
    disk_failed: AtomicBool,
    state: Mutex<State>,
}

struct State {
    /// Values that somebody will still read, per step and output.
    values: Vec<Vec<Option<Value>>>,
    /// How many will.
    readers: Vec<Vec<usize>>,
    /// Per step, its wires from steps that have not run.
    missing: Vec<usize>,
    /// Steps that can run, the earliest first.
    ready: BinaryHeap<Reverse<usize>>,
    /// Steps that run.
    active: usize,
    /// Steps that have not finished.
    left: usize,
    /// The earliest step that failed, and how.
    failure: Option<(usize, EvalError)>,
}

impl<'r> Run<'r> {
    pub(super) fn new(
        evaluator: &'r Evaluator,
        plan: &'r Plan<'r>,
        origins: &'r [Origins],
        needs: Needs,
        folder: &'r Path,
        cancel: &'r Cancel,
        events: &'r (dyn Fn(Event) + Sync),
    ) -> Self {
        let Needs { compute, found, readers, consumers } = needs;
        let steps = || (0..plan.steps.len()).filter(|at| compute[*at]);
        let mut missing = vec![0; plan.steps.len()];
        for at in steps() {
            missing[at] = plan.steps[at].wires().filter(|(source, _)| compute[*source]).count();
        }
        let ready = steps().filter(|at| missing[*at] == 0).map(Reverse).collect();
        let left = steps().count();
        Self {
            evaluator,
            plan,
            origins,
            folder,
            events,
            consumers,
            cancel,
            stop: cancel.child(),
            disk_failed: AtomicBool::new(false),
            state: Mutex::new(State { values: found, readers, missing, ready, active: 0, left, failure: None }),
        }
    }

    /// Starts ready steps until the pool is busy.
    pub(super) fn pump<'s>(&'s self, scope: &Scope<'s>) {
        let mut state = lock(&self.state);
        while state.active < self.evaluator.threads() && !self.stop.is_cancelled() {
            let Some(Reverse(at)) = state.ready.pop() else { break };
            state.active += 1;
            scope.spawn(move |scope| self.work(at, scope));
        }
    }

    /// The requested values, after all work has ended.
    pub(super) fn finish(self) -> Result<Vec<Value>, EvalError> {
        let state = self.state.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        if self.cancel.is_cancelled() && (state.left > 0 || state.failure.is_some()) {
            return Err(EvalError::Cancelled);
        }
        if let Some((_, error)) = state.failure {
            return Err(error);
        }
        let targets = self.plan.targets.iter().map(|target| {
            let value = state.values[target.step][target.output].as_ref();
            let value = value.expect("a requested value is kept until the end");
            cut(value, &target.window).map_err(|refused| out_of_memory(self.plan.steps[target.step].instance, refused))
        });
        targets.collect()
    }

    fn work<'s>(&'s self, at: usize, scope: &Scope<'s>) {
        let step = &self.plan.steps[at];
        let result = if self.stop.is_cancelled() { Err(None) } else { self.compute(at, step) };
        let values = match result {
            Ok(values) => {
                self.publish(at, &values);
                values
            }
            Err(error) => {
                self.fail(at, error);
                return;
            }
        };
        self.pump(scope);
        self.write(at, step, &values);
    }

    /// Runs a step's kernel. `None` for an error when the evaluation is being stopped.
    fn compute(&self, at: usize, step: &Step<'_>) -> Result<Vec<Value>, Option<EvalError>> {
        let node = step.instance.node;
        let start = now();
        (self.events)(Event::NodeStarted { node: step.index, name: step.name.clone() });
        let throttle = Throttle::new();
        let progress = |fraction: f32| {
            if throttle.admits(fraction) {
                (self.events)(Event::NodeProgress { node: step.index, name: step.name.clone(), fraction });
            }
        };
        let ticker = self.evaluator.glimpses.map(Ticker::new);
        let due = || ticker.as_ref().is_some_and(Ticker::is_due);
        let take = |outputs: Outputs| {
            let named = outputs.into_iter_named();
            let values = named.filter_map(|(output, value)| Some((node.output_index(output)?, value))).collect();
            (self.events)(Event::NodeGlimpse { node: step.index, name: step.name.clone(), values });
        };
        let job = Job {
            node,
            params: &step.instance.params,
            inputs: self.inputs(step).map_err(|refused| Some(out_of_memory(step.instance, refused)))?,
            window: step.window,
            wanted: Wanted::ALL,
            folder: self.folder.to_owned(),
            cancel: self.stop.clone(),
            progress: &progress,
            warnings: Warnings::default(),
            glimpses: ticker.is_some().then_some(Glimpses { due: &due, take: &take }),
        };
        let backend = backend_of(&*self.evaluator.backend, node);
        let named = running(&step.name);
        let outcome = attempt(step.instance, &self.stop, || backend.run(node, &job));
        drop(named);
        let warnings = job.warnings.take();
        drop(job);
        let outputs = outcome.map_err(|error| Some(error).filter(|error| *error != EvalError::Cancelled))?;
        let values = check::take(step, outputs)?;
        for file in &self.origins[at].files {
            file.check_unchanged(&step.instance.name)?;
        }
        for message in warnings {
            (self.events)(Event::Warning { node: step.index, name: step.name.clone(), message });
        }
        (self.events)(Event::NodeFinished {
            node: step.index,
            name: step.name.clone(),
            time: start.elapsed(),
            bytes: values.iter().map(Value::bytes).sum(),
            origin: Origin::Computed,
        });
        Ok(values)
    }

    /// Takes a step's inputs, and drops the values that nobody else will read.
    fn inputs(&self, step: &Step<'_>) -> Result<Vec<InputValue>, OutOfMemory> {
        let mut state = lock(&self.state);
        let taken: Vec<InputValue> = step
            .inputs
            .iter()
            .map(|source| match *source {
                Source::Wire { step, output } => InputValue::Value(state.read(step, output)),
                Source::Constant(value) => InputValue::Constant(value),
                Source::Absent => InputValue::Absent,
            })
            .collect();
        drop(state);
        taken
            .into_iter()
            .map(|input| match input {
                InputValue::Value(value) => Ok(InputValue::Value(cut(&value, &step.window)?)),
                other => Ok(other),
            })
            .collect()
    }

    fn publish(&self, at: usize, values: &[Value]) {
        let step = &self.plan.steps[at];
        for (output, value) in values.iter().enumerate() {
            self.evaluator.memory.insert((self.origins[at].key, output), &step.wanted, value);
        }
        let mut state = lock(&self.state);
        for (output, value) in values.iter().enumerate() {
            if state.readers[at][output] > 0 {
                state.values[at][output] = Some(value.clone());
            }
        }
        for consumer in &self.consumers[at] {
            state.missing[*consumer] -= 1;
            if state.missing[*consumer] == 0 {
                state.ready.push(Reverse(*consumer));
            }
        }
        state.active -= 1;
        state.left -= 1;
    }

    fn fail(&self, at: usize, error: Option<EvalError>) {
        let mut state = lock(&self.state);
        state.active -= 1;
        if let Some(error) = error
            && state.failure.as_ref().is_none_or(|(earliest, _)| at < *earliest)
        {
            state.failure = Some((at, error));
        }
        self.stop.cancel();
    }

    /// Writes results to the disk cache, where there is one. What reads them has been started before. A failure
    /// elsewhere does not stop it, so that the work is not lost.
    fn write(&self, at: usize, step: &Step<'_>, values: &[Value]) {
        let Some(disk) = &self.evaluator.disk else { return };
        for (output, value) in values.iter().enumerate() {
            if self.disk_failed.load(Ordering::Relaxed) || self.cancel.is_cancelled() {
                return;
            }
            if let Err(error) =
                disk.store(self.origins[at].key.output(output, &step.wanted), value, &step.wanted, self.cancel)
                && !self.cancel.is_cancelled()
                && !self.disk_failed.swap(true, Ordering::Relaxed)
            {
                let message = format!("results cannot be kept in {}: {error}", disk.folder().display());
                (self.events)(Event::Warning { node: step.index, name: step.name.clone(), message });
            }
        }
    }
}

impl State {
    fn read(&mut self, step: usize, output: usize) -> Value {
        let slot = &mut self.values[step][output];
        self.readers[step][output] -= 1;
        let value = if self.readers[step][output] == 0 { slot.take() } else { slot.clone() };
        value.expect("a step runs after those that it reads")
    }
}

/// Runs a part of a node's code, and says why it gave nothing.
pub(super) fn attempt<T>(
    instance: &Instance,
    cancel: &Cancel,
    code: impl FnOnce() -> Result<T, NodeError>,
) -> Result<T, EvalError> {
    let (node, id) = (instance.name.clone(), instance.node.id);
    match catch_unwind(AssertUnwindSafe(code)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(NodeError::Cancelled)) if cancel.is_cancelled() => Err(EvalError::Cancelled),
        Ok(Err(NodeError::Cancelled)) => {
            let message = "it stopped as if cancelled, which nobody asked for".to_owned();
            Err(EvalError::Node { node, id, message, hint: None })
        }
        Ok(Err(NodeError::OutOfMemory(refused))) => Err(out_of_memory(instance, refused)),
        Ok(Err(NodeError::Failed { message, hint })) => Err(EvalError::Node { node, id, message, hint }),
        Err(panic) => Err(EvalError::Panicked { node, id, message: panic_message(&*panic) }),
    }
}

/// The part of a value on a window.
fn cut(value: &Value, window: &Window) -> Result<Value, OutOfMemory> {
    match value {
        Value::Field(field) => Ok(Value::Field(field.try_crop(window)?)),
        Value::Lines(_) | Value::Report(_) => Ok(value.clone()),
    }
}

fn out_of_memory(instance: &Instance, refused: OutOfMemory) -> EvalError {
    EvalError::OutOfMemory { node: instance.name.clone(), id: instance.node.id, refused }
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned())
}
