//! What of a plan is found in a cache and what has to be computed.

use super::{
    Evaluator,
    event::{Event, Origin, now},
    key::Origins,
    plan::{Plan, Step},
};
use crate::{job::Cancel, value::Value};

/// Per step of a plan: whether it is computed, what was found, and how often its outputs will be read.
pub(super) struct Needs {
    /// Whether the kernel runs. A step that is neither computed nor found is not needed.
    pub(super) compute: Vec<bool>,
    /// Values found in a cache, per output that is read.
    pub(super) found: Vec<Vec<Option<Value>>>,
    /// Per output, how many inputs of computed steps and requests read it.
    pub(super) readers: Vec<Vec<usize>>,
    /// The computed steps that read a step, once per wire.
    pub(super) consumers: Vec<Vec<usize>>,
}

impl Needs {
    /// Looks results up from the requests towards the sources: what feeds a result that was found is not looked at.
    pub(super) fn new(
        evaluator: &Evaluator,
        plan: &Plan<'_>,
        origins: &[Origins],
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
    ) -> Self {
        let count = plan.steps.len();
        let mut needs = Self {
            compute: vec![false; count],
            found: plan.steps.iter().map(|step| vec![None; step.types.len()]).collect(),
            readers: plan.steps.iter().map(|step| vec![0; step.types.len()]).collect(),
            consumers: vec![Vec::new(); count],
        };
        for target in &plan.targets {
            needs.readers[target.step][target.output] += 1;
        }
        let mut told = Vec::new();
        for (at, step) in plan.steps.iter().enumerate().rev() {
            if needs.readers[at].iter().all(|count| *count == 0) || cancel.is_cancelled() {
                continue;
            }
            let start = now();
            let Some((values, origin)) = recall(evaluator, step, &origins[at], &needs.readers[at], cancel, events)
            else {
                needs.compute[at] = true;
                for (source, output) in step.wires() {
                    needs.readers[source][output] += 1;
                    needs.consumers[source].push(at);
                }
                continue;
            };
            told.push(Event::NodeFinished {
                node: step.index,
                name: step.name.clone(),
                time: start.elapsed(),
                bytes: values.iter().flatten().map(Value::bytes).sum(),
                origin,
            });
            needs.found[at] = values;
        }
        let compute = needs.compute.iter().filter(|compute| **compute).count();
        events(Event::Planned { compute, cached: told.len() });
        told.into_iter().rev().for_each(events);
        needs
    }
}

/// The read outputs of a step from the caches; `None` when one of them is in neither.
fn recall(
    evaluator: &Evaluator,
    step: &Step<'_>,
    origins: &Origins,
    readers: &[usize],
    cancel: &Cancel,
    events: &(dyn Fn(Event) + Sync),
) -> Option<(Vec<Option<Value>>, Origin)> {
    let mut values = vec![None; readers.len()];
    let mut origin = Origin::Memory;
    for output in (0..readers.len()).filter(|output| readers[*output] > 0) {
        let slot = (origins.key, output);
        if let Some(value) = evaluator.memory.get(slot, &step.wanted) {
            values[output] = Some(value);
            continue;
        }
        let disk = evaluator.disk.as_ref()?;
        let key = origins.key.output(output, &step.wanted);
        let value = match disk.load(key, step.types[output], &step.wanted, cancel) {
            Ok(value) => value?,
            Err(damage) => {
                let message = format!("a result in the cache is not used: {damage}");
                events(Event::Warning { node: step.index, name: step.name.clone(), message });
                return None;
            }
        };
        evaluator.memory.insert(slot, &step.wanted, &value);
        values[output] = Some(value);
        origin = Origin::Disk;
    }
    Some((values, origin))
}
