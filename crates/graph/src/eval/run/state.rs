//! The bookkeeping of a run: ready steps, remaining readers, memory in use.

use std::{cmp::Reverse, collections::BinaryHeap};

use crate::{
    eval::{
        needs::{Needs, Slot},
        plan::{Plan, Target},
    },
    job::Wanted,
    value::Value,
};

/// The next task. Earlier steps come first, and delivering (which releases memory) before computing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Task {
    /// Answers a request with an available output of a step.
    Deliver(usize, usize),
    /// Runs the kernel of a step.
    Compute(usize),
}

impl Task {
    const fn order(self) -> (usize, usize) {
        match self {
            Self::Deliver(at, _) => (at, 0),
            Self::Compute(at) => (at, 1),
        }
    }
}

impl Ord for Task {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.order().cmp(&other.order())
    }
}

impl PartialOrd for Task {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// The state of a run.
pub(super) struct State {
    /// Values that will still be read, per step and output.
    values: Vec<Vec<Slot>>,
    /// How often they will be read.
    readers: Vec<Vec<usize>>,
    /// Outputs that kernels compute.
    pub(super) wanted: Vec<Wanted>,
    consumers: Vec<Vec<usize>>,
    requests: Vec<Vec<usize>>,
    /// Per step, the number of its wires from steps that have not run.
    missing: Vec<usize>,
    /// Steps that have succeeded or failed.
    over: Vec<bool>,
    /// Steps whose reading from disk has been reported.
    told: Vec<bool>,
    ready: BinaryHeap<Reverse<Task>>,
    /// Number of running tasks.
    pub(super) active: usize,
    /// Requests that have been answered.
    pub(super) answered: Vec<bool>,
    /// Size of the values in memory.
    held: u64,
    /// Memory of running kernels, per step.
    working: Vec<u64>,
}

impl State {
    pub(super) fn new(plan: &Plan<'_>, needs: Needs) -> Self {
        let count = plan.steps.len();
        let mut ready = BinaryHeap::new();
        let mut missing = vec![0; count];
        let requests = plan.requests_of_steps();
        for (at, step) in plan.steps.iter().enumerate() {
            if needs.computes(at) {
                missing[at] = step.wires(needs.wanted[at]).filter(|(source, _)| needs.computes(*source)).count();
                if missing[at] == 0 {
                    ready.push(Reverse(Task::Compute(at)));
                }
            }
            for request in &requests[at] {
                let output = plan.targets[*request].as_ref().map_or(0, |target| target.output);
                if !matches!(needs.found[at][output], Slot::Empty) {
                    ready.push(Reverse(Task::Deliver(at, *request)));
                }
            }
        }
        let held = needs.found.iter().flatten().map(Slot::bytes).sum();
        // Requests with a fault have been answered before the run.
        let is_at_fault = |target: &Target| plan.steps[target.step].fault.is_some();
        let answered = plan.targets.iter().map(|target| target.as_ref().map_or(true, is_at_fault)).collect();
        let told = (0..count).map(|at| !needs.is_stored(at)).collect();
        Self {
            values: needs.found,
            readers: needs.readers,
            wanted: needs.wanted,
            consumers: needs.consumers,
            requests,
            missing,
            over: vec![false; count],
            told,
            ready,
            active: 0,
            answered,
            held,
            working: vec![0; count],
        }
    }

    /// The next task, if it fits: a kernel waits while others run and their total memory would exceed the ceiling.
    pub(super) fn start(&mut self, plan: &Plan<'_>, ceiling: u64) -> Option<Task> {
        loop {
            let Reverse(task) = *self.ready.peek()?;
            if let Task::Compute(at) = task {
                if self.over[at] {
                    self.ready.pop();
                    continue;
                }
                let step = &plan.steps[at];
                let read = step.wires(self.wanted[at]);
                let read: u64 = read.map(|(source, output)| self.values[source][output].bytes()).sum();
                let takes = read + step.kernel_bytes(self.wanted[at], &plan.steps);
                if self.active > 0 && self.held + self.working.iter().sum::<u64>() + takes > ceiling {
                    return None;
                }
                self.working[at] = takes;
            }
            self.ready.pop();
            self.active += 1;
            return Some(task);
        }
    }

    /// Takes a value for one reader; the last one gets the value itself.
    pub(super) fn read(&mut self, at: usize, output: usize) -> Slot {
        let slot = &mut self.values[at][output];
        self.readers[at][output] -= 1;
        if self.readers[at][output] > 0 {
            return slot.clone();
        }
        self.held -= slot.bytes();
        std::mem::take(slot)
    }

    /// Keeps a value that was read from disk for its other readers. Returns true if the reading should be reported.
    pub(super) fn hold(&mut self, at: usize, output: usize, value: &Value) -> bool {
        if self.readers[at][output] > 0 {
            self.held += value.bytes() as u64;
            self.values[at][output] = Slot::Here(value.clone());
        }
        !std::mem::replace(&mut self.told[at], true)
    }

    /// Stores the results of a step, and makes the steps that waited for them ready.
    pub(super) fn publish(&mut self, at: usize, plan: &Plan<'_>, values: &[Option<Value>]) {
        for (output, value) in values.iter().enumerate() {
            if let Some(value) = value
                && self.readers[at][output] > 0
            {
                self.held += value.bytes() as u64;
                self.values[at][output] = Slot::Here(value.clone());
            }
        }
        for consumer in &self.consumers[at] {
            self.missing[*consumer] -= 1;
            if self.missing[*consumer] == 0 && !self.over[*consumer] {
                self.ready.push(Reverse(Task::Compute(*consumer)));
            }
        }
        for request in &self.requests[at] {
            let output = plan.targets[*request].as_ref().map_or(0, |target| target.output);
            if self.wanted[at].contains(output) {
                self.ready.push(Reverse(Task::Deliver(at, *request)));
            }
        }
        self.end(at);
    }

    fn end(&mut self, at: usize) {
        self.over[at] = true;
        self.working[at] = 0;
        self.active -= 1;
    }

    /// Handles a failed step: gives up everything that depends on it, and releases what that would have read. Returns
    /// the unanswered requests among it, which count as answered if `answer`.
    pub(super) fn fail(&mut self, at: usize, plan: &Plan<'_>, answer: bool) -> Vec<usize> {
        self.end(at);
        let mut requests = Vec::new();
        let mut stack: Vec<usize> = vec![at];
        while let Some(at) = stack.pop() {
            for request in self.requests[at].clone() {
                let output = plan.targets[request].as_ref().map_or(0, |target| target.output);
                if self.wanted[at].contains(output) && !self.answered[request] {
                    self.answered[request] = answer;
                    requests.push(request);
                }
            }
            for consumer in self.consumers[at].clone() {
                if !std::mem::replace(&mut self.over[consumer], true) {
                    for (source, output) in plan.steps[consumer].wires(self.wanted[consumer]) {
                        let _ = self.read(source, output);
                    }
                    stack.push(consumer);
                }
            }
        }
        requests
    }
}
