//! Running a plan: ready steps run in parallel on the thread pool.
//!
//! Each task on the pool runs one kernel or delivers one result, and there are at most as many tasks at a time as the
//! pool has threads. Kernels use the same pool; a thread that waits inside a kernel may start another task meanwhile,
//! so no lock is held while a kernel runs, and the bound on tasks limits such nesting. Two kernels run in parallel only
//! if their memory stays below the peak of running one after the other.

mod kernel;
mod state;

use std::{
    path::Path,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use rayon::Scope;

pub(super) use self::kernel::attempt;
use self::state::{State, Task};
use super::{
    Delivered, Delivery, Evaluator, Work,
    error::EvalError,
    event::{Event, Origin, lock, now},
    key::Origins,
    needs::{Needs, Slot},
    plan::{Coarser, Level, Plan, Source, Step},
    store::{Claim, Elsewhere},
};
use crate::{
    job::{self, Cancel, InputValue, LevelJob, Outputs, Wanted},
    memory::OutOfMemory,
    value::Value,
    world::Window,
};

/// A running evaluation.
pub(super) struct Run<'r> {
    evaluator: &'r Evaluator,
    plan: &'r Plan<'r>,
    origins: &'r [Option<Origins>],
    folder: &'r Path,
    /// Receives events, with the level of the step if they are about one.
    events: &'r (dyn Fn(Option<&Level>, Event) + Sync),
    deliver: &'r (dyn Fn(usize, Delivery) + Sync),
    /// True if results are kept in the store.
    keeps: bool,
    /// Per request of the plan, its index for the caller.
    numbers: &'r [usize],
    /// Limit for the memory of kernels that run in parallel.
    ceiling: u64,
    /// On when the caller cancels.
    cancel: &'r Cancel,
    /// True after a failed write to disk; no other write is tried in this run.
    disk_failed: AtomicBool,
    /// A step that was left out because another evaluation is computing it.
    elsewhere: Mutex<Option<(usize, Elsewhere)>>,
    state: Mutex<State>,
}

/// What a run has left undone.
pub(super) struct Left {
    /// The unanswered requests of the plan: a stored result could not be read, or something is computed elsewhere.
    pub(super) requests: Vec<usize>,
    /// The step of the plan to wait for, if something is computed elsewhere.
    pub(super) elsewhere: Option<(usize, Elsewhere)>,
}

impl<'r> Run<'r> {
    #[expect(clippy::too_many_arguments, reason = "what a run consists of")]
    pub(super) fn new(
        evaluator: &'r Evaluator,
        work: &'r Work<'r>,
        events: &'r (dyn Fn(Option<&Level>, Event) + Sync),
        plan: &'r Plan<'r>,
        origins: &'r [Option<Origins>],
        needs: Needs,
        numbers: &'r [usize],
        ceiling: u64,
    ) -> Self {
        let state = Mutex::new(State::new(plan, needs));
        let Work { evaluation, keeps, cancel, deliver, .. } = *work;
        let (folder, disk_failed) = (evaluation.folder, AtomicBool::new(false));
        Self {
            evaluator,
            plan,
            origins,
            folder,
            events,
            deliver,
            keeps,
            numbers,
            ceiling,
            cancel,
            disk_failed,
            elsewhere: Mutex::default(),
            state,
        }
    }

    /// Starts ready tasks until the pool is busy.
    pub(super) fn pump<'s>(&'s self, scope: &Scope<'s>) {
        let mut state = lock(&self.state);
        while state.active < self.evaluator.threads() && !self.cancel.is_cancelled() {
            let Some(task) = state.start(self.plan, self.ceiling) else { break };
            scope.spawn(move |scope| match task {
                Task::Deliver(at, request) => self.hand_over(at, request, scope),
                Task::Compute(at) => self.work(at, scope),
            });
        }
    }

    /// What is left undone.
    pub(super) fn finish(self) -> Left {
        let state = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        let requests = (0..self.plan.targets.len()).filter(|request| !state.answered[*request]).collect();
        Left { requests, elsewhere: self.elsewhere.into_inner().unwrap_or_else(PoisonError::into_inner) }
    }

    fn work<'s>(&'s self, at: usize, scope: &Scope<'s>) {
        let step = &self.plan.steps[at];
        let start = now();
        let claim = self.claim(at, step);
        let outcome = match &claim {
            Some(claim) => self.compute(at, step, claim.as_ref()),
            None => self.leave(at),
        };
        match outcome {
            Ok(values) => {
                self.publish(at, &values);
                drop(claim);
                self.pump(scope);
                if self.keeps && self.evaluator.store.folder().is_some_and(|place| start.elapsed() >= place.worth) {
                    self.write(at, step, &values);
                }
            }
            Err(error) => {
                self.fail(at, error.as_ref());
                self.pump(scope);
            }
        }
    }

    /// Claims what a step computes. Returns None when another evaluation is computing it.
    fn claim(&self, at: usize, step: &Step<'_>) -> Option<Option<Claim<'r>>> {
        let Some(origins) = self.origins[at].as_ref().filter(|_| self.keeps) else { return Some(None) };
        let wanted = lock(&self.state).wanted[at];
        let claimed = self.evaluator.store.in_flight().claim(self.number(), origins.key, step.wanted, wanted);
        match claimed {
            Ok(claim) => Some(Some(claim)),
            Err(elsewhere) => {
                lock(&self.elsewhere).get_or_insert((at, elsewhere));
                None
            }
        }
    }

    /// A number that no other run has while this one exists.
    fn number(&self) -> usize {
        std::ptr::from_ref(self).addr()
    }

    /// Leaves a step to another evaluation, and releases its inputs.
    fn leave(&self, at: usize) -> Result<Vec<Option<Value>>, Option<EvalError>> {
        let wanted = lock(&self.state).wanted[at];
        let _ = self.level(at, wanted);
        self.inputs(at).and(Err(None))
    }

    /// Delivers an available result, on the host.
    fn hand_over<'s>(&'s self, at: usize, request: usize, scope: &Scope<'s>) {
        let answer = self.plan.targets[request].as_ref().ok().and_then(|target| {
            let value = self.take(at, target.output)?;
            value.fetch().ok()?;
            let key = self.origins[at].as_ref()?.key.output(target.output, &target.window);
            let value = cut(value, &target.window).map_err(|refused| self.out_of_memory(at, refused));
            Some(value.map(|value| Delivered { value, key }))
        });
        if let Some(delivery) = answer {
            lock(&self.state).answered[request] = true;
            (self.deliver)(self.numbers[request], delivery);
        }
        lock(&self.state).active -= 1;
        self.pump(scope);
    }

    /// The inputs of a step on its window; values without further readers are dropped here.
    ///
    /// # Errors
    /// When there is no memory for a crop; `None` when a stored value could not be read.
    fn inputs(&self, at: usize) -> Result<Vec<InputValue>, Option<EvalError>> {
        let step = &self.plan.steps[at];
        let input = |source: &Source| match *source {
            Source::Wire { step: source, output } => {
                let value = self.take(source, output).ok_or(None)?;
                if value.as_field().is_some_and(|field| field.window().cells != step.window.cells) {
                    value.fetch().map_err(|_| None)?;
                }
                let value = cut(value, &step.window).map_err(|refused| self.out_of_memory(at, refused))?;
                Ok(InputValue::Value(value))
            }
            Source::Constant(value) => Ok(InputValue::Constant(value)),
            Source::Absent => Ok(InputValue::Absent),
        };
        let mut inputs: Vec<InputValue> = step.read_inputs().iter().map(input).collect::<Result<_, Option<_>>>()?;
        inputs.resize(step.inputs.len(), InputValue::Absent);
        Ok(inputs)
    }

    /// What a step goes on from, and whether it gives a state; `None` when a stored value could not be read.
    fn level(&self, at: usize, wanted: Wanted) -> Option<LevelJob> {
        let step = &self.plan.steps[at];
        let state = step.types.len();
        let below = match step.below {
            Coarser::Nothing => job::Coarser::Nothing,
            Coarser::State(below) => match self.take(below, state)? {
                Value::State(state) => job::Coarser::State(state),
                Value::Field(_) | Value::Strata(_) | Value::Lines(_) | Value::Report(_) => return None,
            },
            Coarser::Results(below) => {
                let outputs = step.instance.node.outputs.iter().enumerate();
                let outputs = outputs.filter(|(output, _)| wanted.contains(*output));
                let outputs = outputs.map(|(output, declared)| Some((declared.name, self.take(below, output)?)));
                let outputs: Option<Vec<_>> = outputs.collect();
                job::Coarser::Results(outputs?.into_iter().fold(Outputs::default(), |all, (name, v)| all.with(name, v)))
            }
        };
        Some(LevelJob { below, gives_state: step.has_state && wanted.contains(state) })
    }

    fn out_of_memory(&self, at: usize, refused: OutOfMemory) -> EvalError {
        let instance = self.plan.steps[at].instance;
        EvalError::OutOfMemory { node: instance.name.clone(), id: instance.node.id, refused }
    }

    /// Takes a value for one reader, from disk if necessary.
    fn take(&self, at: usize, output: usize) -> Option<Value> {
        let ticket = match lock(&self.state).read(at, output) {
            Slot::Here(value) => return Some(value),
            Slot::Stored(ticket) => ticket,
            Slot::Empty => return None,
        };
        let (step, start) = (&self.plan.steps[at], now());
        let slot = (self.origins[at].as_ref()?.key, output);
        match self.evaluator.store.load(&ticket, slot, step.form(output), &step.wanted, self.cancel) {
            Ok(value) => {
                let (node, name, bytes) = (step.index, step.name.clone(), value.bytes());
                if lock(&self.state).hold(at, output, &value) {
                    let (time, origin, cells) = (start.elapsed(), Origin::Disk, step.wanted.world.cells);
                    let backend = self.evaluator.backends.of(step.instance).name();
                    self.report(step, Event::NodeFinished { node, name, cells, time, bytes, origin, backend });
                }
                Some(value)
            }
            Err(damage) => {
                if let Some(damage) = damage {
                    let message = format!("a stored result was ignored: {damage}");
                    (self.events)(None, Event::Warning { node: step.index, name: step.name.clone(), message });
                }
                None
            }
        }
    }

    fn publish(&self, at: usize, values: &[Option<Value>]) {
        let step = &self.plan.steps[at];
        let bytes = values[..step.types.len()].iter().flatten().map(Value::bytes).sum();
        for twin in self.plan.twins(at) {
            let (node, name, cells) = (twin.index, twin.name.clone(), twin.wanted.world.cells);
            let (time, origin) = (std::time::Duration::ZERO, Origin::Memory);
            let backend = self.evaluator.backends.of(twin.instance).name();
            self.report(twin, Event::NodeFinished { node, name, cells, time, bytes, origin, backend });
        }
        let key = self.origins[at].as_ref().map(|origins| origins.key);
        for (output, value) in values.iter().enumerate() {
            if let (Some(value), Some(key), true) = (value, key, self.keeps) {
                self.evaluator.store.insert((key, output), &step.wanted, value);
            }
        }
        lock(&self.state).publish(at, self.plan, values);
    }

    /// Answers all requests that depend on a failed step. Without an error, it was cancelled.
    fn fail(&self, at: usize, error: Option<&EvalError>) {
        let requests = lock(&self.state).fail(at, self.plan, error.is_some());
        for request in requests {
            if let Some(error) = error {
                (self.deliver)(self.numbers[request], Err(error.clone()));
            }
        }
    }

    /// Writes results to disk, if the store has a folder. Steps that read them have been started before. A failure
    /// elsewhere does not stop the writing, so that the work is not lost.
    fn write(&self, at: usize, step: &Step<'_>, values: &[Option<Value>]) {
        let Some(origins) = &self.origins[at] else { return };
        for (output, value) in values.iter().enumerate() {
            if self.disk_failed.load(Ordering::Relaxed) || self.cancel.is_cancelled() {
                return;
            }
            let Some(value) = value else { continue };
            if value.fetch().is_err() {
                continue; // whoever reads it finds out
            }
            let written = self.evaluator.store.persist((origins.key, output), &step.wanted, value, self.cancel);
            if let Err(error) = written
                && !self.cancel.is_cancelled()
                && !self.disk_failed.swap(true, Ordering::Relaxed)
            {
                let message = self.evaluator.unkept(&error);
                (self.events)(None, Event::Warning { node: step.index, name: step.name.clone(), message });
            }
        }
    }

    /// Reports an event of a step.
    fn report(&self, step: &Step<'_>, event: Event) {
        (self.events)(Some(&step.level), event);
    }
}

/// Crops a value to a window.
fn cut(value: Value, window: &Window) -> Result<Value, OutOfMemory> {
    match value {
        Value::Field(field) => Ok(Value::Field(field.try_crop(window)?)),
        Value::Strata(strata) => Ok(strata.try_crop(window)?.into()),
        Value::Lines(_) | Value::Report(_) | Value::State(_) => Ok(value),
    }
}
