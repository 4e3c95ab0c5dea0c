//! Which parts of a plan are in the store, and which have to be computed.

use super::{
    Store,
    key::Origins,
    plan::{Plan, Step},
    store::{Found, Ticket},
    work::Pinned,
};
use crate::{job::Wanted, value::Value};

/// The state of an output of a step.
#[derive(Clone, Debug, Default)]
pub(super) enum Slot {
    /// Not available yet, or released.
    #[default]
    Empty,
    /// In memory.
    Here(Value),
    /// On disk.
    Stored(Ticket),
}

impl Slot {
    /// Size of a value in memory.
    pub(super) fn bytes(&self) -> u64 {
        match self {
            Self::Here(value) => value.bytes() as u64,
            Self::Empty | Self::Stored(_) => 0,
        }
    }
}

/// Per step of a plan: what is computed, what was found, and how often its outputs will be read.
pub(super) struct Needs {
    /// The outputs that the kernel computes; none for a step whose kernel does not run.
    pub(super) wanted: Vec<Wanted>,
    /// Outputs that were found and will be read.
    pub(super) found: Vec<Vec<Slot>>,
    /// Per output, how many inputs of computed steps and requests read it.
    pub(super) readers: Vec<Vec<usize>>,
    /// The computed steps that read a step, once per wire.
    pub(super) consumers: Vec<Vec<usize>>,
}

impl Needs {
    /// Looks results up from the requests towards the sources: sources of a result that was found are not looked up.
    pub(super) fn new(store: &Store, pinned: &Pinned, plan: &Plan<'_>, origins: &[Option<Origins>]) -> Self {
        let count = plan.steps.len();
        let mut needs = Self {
            wanted: vec![Wanted::NONE; count],
            found: plan.steps.iter().map(|step| vec![Slot::Empty; step.outputs()]).collect(),
            readers: plan.steps.iter().map(|step| vec![0; step.outputs()]).collect(),
            consumers: vec![Vec::new(); count],
        };
        for target in plan.targets.iter().flatten().filter(|target| plan.steps[target.step].fault.is_none()) {
            needs.readers[target.step][target.output] += 1;
        }
        for (at, step) in plan.steps.iter().enumerate().rev() {
            let Some(origins) = &origins[at] else { continue };
            let wanted = needs.recall(store, pinned, at, step, origins);
            if wanted == Wanted::NONE {
                continue;
            }
            let missing = (0..step.outputs()).filter(|output| {
                let is_there = || store.find((origins.key, *output), step.form(*output), &step.wanted).is_some();
                step.byproducts.contains(*output) && !is_there()
            });
            needs.wanted[at] = missing.fold(wanted, Wanted::with);
            for (source, output) in step.wires(needs.wanted[at]) {
                needs.readers[source][output] += 1;
                needs.consumers[source].push(at);
            }
        }
        needs
    }

    /// Returns true if the step's kernel runs.
    pub(super) fn computes(&self, at: usize) -> bool {
        self.wanted[at] != Wanted::NONE
    }

    /// Finds the outputs of a step that are read; returns those that have to be computed.
    fn recall(&mut self, store: &Store, pinned: &Pinned, at: usize, step: &Step<'_>, origins: &Origins) -> Wanted {
        let mut wanted = Wanted::NONE;
        for output in (0..step.outputs()).filter(|output| self.readers[at][*output] > 0) {
            let slot = (origins.key, output);
            if let Some(value) = pinned.get(&slot) {
                self.found[at][output] = Slot::Here(value.clone());
                continue;
            }
            self.found[at][output] = match store.find(slot, step.form(output), &step.wanted) {
                Some(Found::Memory(value)) => Slot::Here(value),
                Some(Found::Disk(ticket)) => Slot::Stored(ticket),
                None => {
                    wanted = wanted.with(output);
                    Slot::Empty
                }
            };
        }
        wanted
    }

    /// Returns true if outputs of the step are read from disk and none of them has to be computed.
    pub(super) fn is_stored(&self, at: usize) -> bool {
        !self.computes(at) && self.found[at].iter().any(|slot| matches!(slot, Slot::Stored(_)))
    }

    /// Returns true if outputs of the step are read and none of them has to be computed.
    pub(super) fn is_found(&self, at: usize) -> bool {
        !self.computes(at) && self.readers[at].iter().any(|count| *count > 0)
    }
}
