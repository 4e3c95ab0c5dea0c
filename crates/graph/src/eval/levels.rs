//! Events of nodes that run on several [levels](crate::Levels): the steps of a node, and those of what it reads, on the
//! levels below a requested world are reported as one run of each node on that world.

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    sync::{Arc, Mutex},
    time::Duration,
};

use petgraph::stable_graph::NodeIndex;

use super::{
    event::{Event, Origin, lock},
    needs::Needs,
    plan::{Level, Plan},
};
use crate::world::World;

/// Passes events on.
pub(super) struct LevelEvents<'a> {
    events: &'a (dyn Fn(Event) + Sync),
    /// The steps of each node.
    steps: BTreeMap<NodeIndex, Vec<Place>>,
    runs: Mutex<Vec<Run>>,
}

/// A step of a node.
struct Place {
    level: Level,
    /// The run that it is a part of.
    run: usize,
    /// Its position in the run.
    part: usize,
}

/// The steps of one node for one requested world.
struct Run {
    asked: World,
    parts: Vec<Part>,
    /// True from its first kernel to its last.
    is_going: bool,
    reported: f32,
    time: Duration,
    bytes: usize,
    /// Warnings that were passed on. Bands and stages repeat those of results that they read.
    warned: BTreeSet<String>,
}

/// One step.
struct Part {
    is_asked: bool,
    /// Its kernel runs, is going to or has.
    counts: bool,
    work: f64,
    done: f32,
    is_over: bool,
}

impl<'a> LevelEvents<'a> {
    pub(super) fn new(plan: &Plan<'_>, needs: &Needs, events: &'a (dyn Fn(Event) + Sync)) -> Self {
        let mut steps = BTreeMap::<NodeIndex, Vec<Place>>::new();
        let mut runs: Vec<Run> = Vec::new();
        for (at, step) in plan.steps.iter().enumerate() {
            let places = steps.entry(step.index).or_default();
            let known = places.iter().map(|place| place.run).find(|run| runs[*run].asked == step.asked);
            let run = known.unwrap_or_else(|| {
                let (asked, parts, is_going) = (step.asked, Vec::new(), false);
                let (time, bytes, warned) = (Duration::ZERO, 0, BTreeSet::new());
                runs.push(Run { asked, parts, is_going, reported: 0.0, time, bytes, warned });
                runs.len() - 1
            });
            places.push(Place { level: step.level, run, part: runs[run].parts.len() });
            let (is_asked, counts, work) = (step.is_asked(), needs.computes(at), step.work());
            runs[run].parts.push(Part { is_asked, counts, work, done: 0.0, is_over: false });
        }
        Self { events, steps, runs: Mutex::new(runs) }
    }

    /// What a plan announces: the nodes of each requested world, however many levels they have.
    pub(super) fn planned(plan: &Plan<'_>, needs: &Needs) -> Event {
        let mut worlds: Vec<World> = Vec::new();
        let mut computed = HashMap::<(NodeIndex, usize), bool>::new();
        for (at, step) in plan.steps.iter().enumerate() {
            let world = worlds.iter().position(|world| *world == step.asked).unwrap_or(worlds.len());
            if world == worlds.len() {
                worlds.push(step.asked);
            }
            if needs.computes(at) {
                computed.insert((step.index, world), true);
            } else if needs.is_found(at) && step.is_asked() {
                computed.entry((step.index, world)).or_insert(false);
            }
        }
        let compute = computed.values().filter(|computed| **computed).count();
        Event::Planned { compute, cached: computed.len() - compute }
    }

    /// Receives an event of the step on a level, or one that is about no step.
    pub(super) fn hear(&self, level: Option<&Level>, event: Event) {
        let passed = match level {
            Some(level) => self.of_step(level, event),
            None => Some(event),
        };
        passed.into_iter().for_each(self.events);
    }

    fn of_step(&self, level: &Level, event: Event) -> Option<Event> {
        let (Event::NodeStarted { node, .. }
        | Event::NodeProgress { node, .. }
        | Event::NodeFinished { node, .. }
        | Event::NodeGlimpse { node, .. }
        | Event::Warning { node, .. }) = &event
        else {
            return Some(event);
        };
        let place = self.steps.get(node).and_then(|places| places.iter().find(|place| place.level == *level));
        let Some(place) = place else { return Some(event) };
        let mut runs = lock(&self.runs);
        let run = &mut runs[place.run];
        match event {
            Event::NodeStarted { node, name } => {
                let part = &mut run.parts[place.part];
                (part.counts, part.is_over, part.done) = (true, false, 0.0);
                let is_first = !std::mem::replace(&mut run.is_going, true);
                is_first.then_some(Event::NodeStarted { node, name })
            }
            Event::NodeProgress { node, name, fraction } => {
                run.parts[place.part].done = fraction;
                let fraction = run.fraction();
                let is_more = fraction > run.reported;
                run.reported = run.reported.max(fraction);
                is_more.then_some(Event::NodeProgress { node, name, fraction })
            }
            Event::NodeFinished { node, name, cells, time, bytes, origin, backend } => {
                run.finish(place.part, time, bytes, (origin, backend), (node, name, cells))
            }
            // a remark on the cells of a level is none on those that are asked for
            Event::Warning { node, name, message } => {
                let is_new = run.parts[place.part].is_asked && run.warned.insert(message.clone());
                is_new.then_some(Event::Warning { node, name, message })
            }
            other => Some(other),
        }
    }
}

impl Run {
    /// The finished part.
    fn fraction(&self) -> f32 {
        let counted = || self.parts.iter().filter(|part| part.counts);
        let all: f64 = counted().map(|part| part.work).sum();
        let done = counted().map(|part| part.work * f64::from(if part.is_over { 1.0 } else { part.done }));
        (done.sum::<f64>() / all.max(f64::MIN_POSITIVE)) as f32
    }

    /// Ends one of its steps.
    fn finish(
        &mut self,
        part: usize,
        time: Duration,
        bytes: usize,
        (origin, backend): (Origin, &'static str),
        (node, name, cells): (NodeIndex, Arc<str>, [u32; 2]),
    ) -> Option<Event> {
        let is_asked = self.parts[part].is_asked;
        self.parts[part].is_over = true;
        if is_asked || !self.parts.iter().any(|part| part.is_asked && part.counts) {
            self.bytes = bytes;
        }
        if !self.is_going {
            // found in the store; of levels only the requested one is reported
            return is_asked.then_some(Event::NodeFinished { node, name, cells, time, bytes, origin, backend });
        }
        self.time += time;
        if self.parts.iter().any(|part| part.counts && !part.is_over) {
            return None;
        }
        (self.is_going, self.reported) = (false, 0.0);
        let (time, cells) = (std::mem::take(&mut self.time), self.asked.cells);
        let (bytes, origin) = (self.bytes, Origin::Computed);
        Some(Event::NodeFinished { node, name, cells, time, bytes, origin, backend })
    }
}
