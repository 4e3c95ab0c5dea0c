//! One evaluation: plan, look up, check the memory, run, and plan again what was lost.

use std::collections::HashMap;

use super::{
    Delivery, Evaluation, Evaluator, Request,
    event::{Event, Origin, Throttle},
    key::Origins,
    levels::LevelEvents,
    memory,
    needs::{Needs, Slot},
    plan::{Level, Plan, Step},
    run::{Left, Run},
    store::{self, Elsewhere},
};
use crate::{job::Cancel, value::Value};

/// Memory up to which kernels run in parallel even if running one after the other would need less.
const SIDE_BY_SIDE: u64 = 256 << 20;

/// Values that stay alive between the evaluations of one request.
pub(super) type Pinned = HashMap<store::Slot, Value>;

/// The receiver of events.
#[derive(Clone, Copy)]
pub(super) enum Listener<'a> {
    /// Of the events of the whole evaluation, in which the levels of a node are reported as one run.
    Whole(&'a (dyn Fn(Event) + Sync)),
    /// Of those of a part of one, with the level of the step if they are about one.
    Part(&'a (dyn Fn(Option<&Level>, Event) + Sync)),
}

/// An evaluation with its receivers.
#[derive(Clone, Copy)]
pub(super) struct Work<'a> {
    pub(super) evaluation: Evaluation<'a>,
    /// Values that are available whatever the store contains.
    pub(super) pinned: &'a Pinned,
    /// True if results are kept in the store.
    pub(super) keeps: bool,
    pub(super) cancel: &'a Cancel,
    pub(super) listener: Listener<'a>,
    pub(super) deliver: &'a (dyn Fn(usize, Delivery) + Sync),
}

impl Work<'_> {
    /// Answers all requests.
    pub(super) fn carry_out(&self, evaluator: &Evaluator) {
        let mut numbers: Vec<usize> = (0..self.evaluation.requests.len()).collect();
        // If a stored result cannot be read, plan again without it; if it is computed elsewhere, when it is there.
        while !numbers.is_empty() && !self.cancel.is_cancelled() {
            let left = self.attempt(evaluator, &numbers);
            numbers = left.into_iter().map(|request| numbers[request]).collect();
        }
        for number in numbers {
            (self.deliver)(number, Err(super::EvalError::Cancelled));
        }
    }

    /// Plans and runs once, and waits for what is computed elsewhere; returns the requests that remain unanswered, by
    /// their indices in `numbers`.
    fn attempt(&self, evaluator: &Evaluator, numbers: &[usize]) -> Vec<usize> {
        let Evaluation { graph, folder, requests, byproducts } = self.evaluation;
        let requests: Vec<Request> = numbers.iter().map(|number| requests[*number]).collect();
        let mut plan = Plan::new(graph, &requests, byproducts);
        if !(self.keeps && evaluator.store.keeps()) {
            plan.drop_kept_states();
        }
        let mut origins = evaluator.origins(&mut plan, folder, self.cancel);
        let (needs, peak) = loop {
            let needs = Needs::new(&evaluator.store, self.pinned, &plan, &origins);
            match memory::check(&plan, &needs, evaluator.memory_limit) {
                Ok(peak) => break (needs, peak),
                // states that only a later evaluation may read are left out first
                Err(_) if plan.drop_kept_states() => {}
                Err((at, error)) => {
                    plan.steps[at].fault = Some(error);
                    plan.spread_faults(&mut origins);
                }
            }
        };
        if self.cancel.is_cancelled() {
            return (0..numbers.len()).collect();
        }
        let merged = match self.listener {
            Listener::Whole(events) => Some(LevelEvents::new(&plan, &needs, events)),
            Listener::Part(_) => None,
        };
        let events = |level: Option<&Level>, event: Event| match (self.listener, &merged) {
            (Listener::Part(events), _) => events(level, event),
            (Listener::Whole(_), Some(merged)) => merged.hear(level, event),
            (Listener::Whole(events), None) => events(event),
        };
        self.report(evaluator, &plan, &origins, &needs, &events);
        for (request, target) in plan.targets.iter().enumerate() {
            let fault = target.as_ref().map_or_else(Some, |target| plan.steps[target.step].fault.as_ref());
            if let Some(fault) = fault {
                (self.deliver)(numbers[request], Err(fault.clone()));
            }
        }
        let run = Run::new(evaluator, self, &events, &plan, &origins, needs, numbers, peak.max(SIDE_BY_SIDE));
        evaluator.pool.scope(|scope| run.pump(scope));
        let Left { requests, elsewhere } = run.finish();
        if let Some((at, elsewhere)) = elsewhere {
            self.wait(evaluator, &plan.steps[at], &elsewhere, &events);
        }
        requests
    }

    /// Waits for a step that another evaluation computes, and reports its progress as that of its own run.
    fn wait(
        &self,
        evaluator: &Evaluator,
        step: &Step<'_>,
        elsewhere: &Elsewhere,
        events: &dyn Fn(Option<&Level>, Event),
    ) {
        let (node, name, level) = (step.index, || step.name.clone(), Some(&step.level));
        events(level, Event::NodeStarted { node, name: name() });
        let throttle = Throttle::new();
        evaluator.store.in_flight().wait(elsewhere, self.cancel, |fraction| {
            if throttle.admits(fraction) {
                events(level, Event::NodeProgress { node, name: name(), fraction });
            }
        });
    }

    /// Reports what was found and what will be computed, with the stored warnings of kernels that ran before.
    fn report(
        &self,
        evaluator: &Evaluator,
        plan: &Plan<'_>,
        origins: &[Option<Origins>],
        needs: &Needs,
        events: &dyn Fn(Option<&Level>, Event),
    ) {
        events(None, LevelEvents::planned(plan, needs));
        for (at, step) in plan.steps.iter().enumerate().filter(|(at, _)| !needs.computes(*at)) {
            let (node, name, level) = (step.index, || step.name.clone(), Some(&step.level));
            let kept = origins[at].as_ref().map(|origins| evaluator.store.notes(origins.key));
            for message in kept.iter().flat_map(|kept| kept.iter()) {
                events(level, Event::Warning { node, name: name(), message: message.clone() });
            }
            let is_pinned = |origins: &Origins| self.pinned.keys().any(|(key, _)| *key == origins.key);
            if needs.is_found(at) && !needs.is_stored(at) && !origins[at].as_ref().is_some_and(is_pinned) {
                let bytes = needs.found[at].iter().map(Slot::bytes).sum::<u64>() as usize;
                for step in std::iter::once(step).chain(plan.twins(at)) {
                    let (node, name, cells) = (step.index, step.name.clone(), step.wanted.world.cells);
                    let (time, origin) = (std::time::Duration::ZERO, Origin::Memory);
                    let backend = evaluator.backends.of(step.instance).name();
                    let finished = Event::NodeFinished { node, name, cells, time, bytes, origin, backend };
                    events(Some(&step.level), finished);
                }
            }
        }
    }
}
