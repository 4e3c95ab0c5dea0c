//! One kernel, from its inputs to verified results.

use std::panic::{AssertUnwindSafe, catch_unwind};

use super::Run;
use crate::{
    backend::Cpu,
    eval::{
        check,
        error::EvalError,
        event::{Event, Origin, Throttle, Ticker, lock, now},
        plan::{Coarser, Step},
        store::Claim,
    },
    graph::Instance,
    job::{Cancel, Glimpses, InputValue, Job, NodeError, Outputs, Warnings},
    memory::running,
    value::Value,
};

impl Run<'_> {
    /// Runs a step's kernel; returns its wanted outputs. An error of `None` means that the evaluation is being stopped,
    /// or that a stored input could not be read. Those who wait for the claim see the progress.
    pub(super) fn compute(
        &self,
        at: usize,
        step: &Step<'_>,
        claim: Option<&Claim<'_>>,
    ) -> Result<Vec<Option<Value>>, Option<EvalError>> {
        let node = step.instance.node;
        if self.cancel.is_cancelled() {
            return Err(None);
        }
        let wanted = lock(&self.state).wanted[at];
        let mut inputs = self.inputs(at)?;
        if let (Some(given), Some(input)) = (&step.instance.given, inputs.first_mut()) {
            *input = InputValue::Value(Value::Field(given.field().clone()));
        }
        let level = self.level(at, wanted).ok_or(None)?;
        let start = now();
        self.report(step, Event::NodeStarted { node: step.index, name: step.name.clone() });
        let throttle = Throttle::new();
        let progress = |fraction: f32| {
            if throttle.admits(fraction) {
                claim.into_iter().for_each(|claim| claim.progress(fraction));
                self.report(step, Event::NodeProgress { node: step.index, name: step.name.clone(), fraction });
            }
        };
        let ticker = self.evaluator.glimpses.map(Ticker::new);
        let due = || ticker.as_ref().is_some_and(Ticker::is_due);
        let take = |outputs: Outputs| {
            let named = outputs.into_iter_named();
            let values = named.filter_map(|(output, value)| Some((node.output_index(output)?, value))).collect();
            self.report(step, Event::NodeGlimpse { node: step.index, name: step.name.clone(), values });
        };
        let job = Job {
            node,
            params: &step.instance.params,
            inputs,
            level,
            window: step.window,
            wanted,
            folder: self.folder.to_owned(),
            cancel: self.cancel.clone(),
            progress: &progress,
            warnings: Warnings::default(),
            glimpses: ticker.is_some().then_some(Glimpses { due: &due, take: &take }),
        };
        let mut backend = &**self.evaluator.backends.of(step.instance);
        let named = running(&step.name);
        let mut outcome = if backend.is_cpu() { Ok(None) } else { self.attempt(step, || backend.run(node, &job)) };
        if let Ok(None) = outcome {
            // the device that has the inputs is gone: plan again without it
            job.inputs.iter().try_for_each(InputValue::fetch).map_err(|_| None)?;
            backend = &Cpu;
            outcome = self.attempt(step, || backend.run(node, &job));
        }
        drop(named);
        let mut warnings = job.warnings.take();
        drop(job);
        let outputs = outcome.map_err(|error| Some(error).filter(|error| *error != EvalError::Cancelled))?;
        let outputs = outputs.unwrap_or_default();
        if step.wanted.cells != step.window.cells {
            outputs.fetch().map_err(|_| None)?;
        }
        let values = check::take(step, wanted, outputs)?;
        if let Some(origins) = &self.origins[at] {
            for file in &origins.files {
                file.check_unchanged(&step.instance.name)?;
            }
            if let Coarser::Results(below) = step.below
                && let Some(below) = &self.origins[below]
            {
                warnings.extend(self.evaluator.store.notes(below.key).iter().cloned());
            }
            // a run for its state alone warns of nothing, and must not drop what another run has warned of
            if (0..step.types.len()).any(|output| wanted.contains(output)) {
                self.evaluator.store.keep_notes(origins.key, &warnings);
            }
        }
        for message in warnings {
            self.report(step, Event::Warning { node: step.index, name: step.name.clone(), message });
        }
        self.report(
            step,
            Event::NodeFinished {
                node: step.index,
                name: step.name.clone(),
                cells: step.window.world.cells,
                time: start.elapsed(),
                bytes: values[..step.types.len()].iter().flatten().map(Value::bytes).sum(),
                origin: Origin::Computed,
                backend: backend.name(),
            },
        );
        Ok(values)
    }

    fn attempt<T>(&self, step: &Step<'_>, code: impl FnOnce() -> Result<T, NodeError>) -> Result<T, EvalError> {
        attempt(step.instance, self.cancel, code)
    }
}

/// Runs a function of a node, and returns the reason if it fails.
pub(in crate::eval) fn attempt<T>(
    instance: &Instance,
    cancel: &Cancel,
    code: impl FnOnce() -> Result<T, NodeError>,
) -> Result<T, EvalError> {
    let (node, id) = (instance.name.clone(), instance.node.id);
    match catch_unwind(AssertUnwindSafe(code)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(NodeError::Cancelled)) if cancel.is_cancelled() => Err(EvalError::Cancelled),
        Ok(Err(NodeError::Cancelled)) => {
            let message = "it stopped as if it had been cancelled, but nothing cancelled it".to_owned();
            Err(EvalError::Node { node, id, message, hint: None })
        }
        Ok(Err(NodeError::OutOfMemory(refused))) => Err(EvalError::OutOfMemory { node, id, refused }),
        Ok(Err(NodeError::Failed { message, hint })) => Err(EvalError::Node { node, id, message, hint }),
        Err(panic) => Err(EvalError::Panicked { node, id, message: panic_message(&*panic) }),
    }
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_owned())
}
