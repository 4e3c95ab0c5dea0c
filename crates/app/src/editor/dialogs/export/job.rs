//! A build in the background, with its progress and its result.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use egui::Context;
use orograph_graph::{Cancel, Evaluator, Event, NodeIndex, Origin};

use crate::{
    build::{Builder, Built, request::Request},
    export::outputs::OutputOptions,
    machine,
    report::{failure::Failure, progress::Progress},
};

/// The part of a build that must be finished, and the time that must have passed, before the remaining time is known.
const LEAST: (f32, Duration) = (0.02, Duration::from_secs(1));

/// The progress of a build.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    /// When it began.
    began: Option<Instant>,
    /// The share of each node in the time of the whole build, as far as it is known.
    shares: Arc<BTreeMap<NodeIndex, f32>>,
    /// Number of kernels to run, and number finished.
    pub(super) planned: usize,
    pub(super) finished: usize,
    /// The share of the finished kernels.
    share: f32,
    /// The running nodes, and their finished parts.
    running: BTreeMap<NodeIndex, f32>,
    /// The name of the node that told its progress last.
    pub(super) node: Option<String>,
    /// True while files are written.
    pub(super) writing: bool,
    /// Warnings of nodes.
    pub(super) warnings: Vec<String>,
    /// How it ended.
    pub(super) end: Option<Result<Built, Failure>>,
}

impl State {
    /// That of a build that could not start.
    pub(super) fn failed(failure: Failure) -> Self {
        Self { end: Some(Err(failure)), ..Self::default() }
    }

    /// The finished part, 0 to 1: by the time of the kernels, or by their number if results come from the cache.
    pub(super) fn fraction(&self) -> f32 {
        if self.writing {
            return 1.0;
        }
        let fraction = if self.planned == self.shares.len() {
            let share = |(node, part): (&NodeIndex, &f32)| self.shares.get(node).copied().unwrap_or_default() * part;
            self.share + self.running.iter().map(share).sum::<f32>()
        } else {
            (self.finished as f32 + self.running.values().sum::<f32>()) / self.planned.max(1) as f32
        };
        fraction.clamp(0.0, 1.0)
    }

    /// The time that it will still take, if it goes on as until now. Returns None at the beginning and the end.
    pub(super) fn remaining(&self) -> Option<Duration> {
        let (fraction, elapsed) = (self.fraction(), machine::now().duration_since(self.began?));
        let known = fraction >= LEAST.0 && elapsed >= LEAST.1 && !self.writing && self.end.is_none();
        known.then(|| elapsed.mul_f32((1.0 - fraction) / fraction))
    }

    fn event(&mut self, event: &Event) {
        match event {
            Event::Planned { compute, .. } => self.planned = *compute,
            Event::NodeStarted { node, name } => {
                self.running.insert(*node, 0.0);
                self.node = Some(name.to_string());
            }
            Event::NodeProgress { node, name, fraction } => {
                self.running.insert(*node, *fraction);
                self.node = Some(name.to_string());
            }
            Event::NodeFinished { node, origin, .. } => {
                self.running.remove(node);
                if *origin == Origin::Computed {
                    self.finished += 1;
                    self.share += self.shares.get(node).copied().unwrap_or_default();
                }
            }
            Event::NodeGlimpse { .. } => {}
            Event::Warning { name, message, .. } => self.warnings.push(format!("{name}: {message}")),
        }
    }
}

/// A build in the background.
#[derive(Debug)]
pub(super) struct Job {
    state: Arc<Mutex<State>>,
    cancel: Cancel,
}

impl Job {
    /// Starts a build into a folder, reusing the results of an evaluator. `shares` are those of the nodes in the time
    /// of the build, with the sum 1; they only serve the report of its progress.
    ///
    /// # Errors
    /// When the system cannot start a thread.
    pub(super) fn start(
        evaluator: &Arc<Evaluator>,
        request: Request,
        folder: PathBuf,
        options: OutputOptions,
        shares: BTreeMap<NodeIndex, f32>,
        context: &Context,
    ) -> Result<Self, Failure> {
        let state = State { began: Some(machine::now()), shares: Arc::new(shares), ..State::default() };
        let job = Self { state: Arc::new(Mutex::new(state)), cancel: Cancel::default() };
        let (state, cancel, context) = (Arc::clone(&job.state), job.cancel.clone(), context.clone());
        let builder = Builder::sharing(Arc::clone(evaluator));
        let work = move || {
            let teller = Teller { state, context };
            let built = builder.build(&request, &folder, &options, &cancel, &teller);
            teller.tell(|state| state.end = Some(built));
        };
        let thread = thread::Builder::new().name("export".to_owned());
        thread.spawn(work).map_err(|error| Failure::unable(format!("cannot start a thread: {error}")))?;
        Ok(job)
    }

    /// The current progress.
    pub(super) fn state(&self) -> State {
        lock(&self.state).clone()
    }

    /// Cancels the build; then nothing is written.
    pub(super) fn cancel(&self) {
        self.cancel.cancel();
    }

    /// Returns true if it was cancelled.
    pub(super) fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        self.cancel();
    }
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Receives the progress of a build.
struct Teller {
    state: Arc<Mutex<State>>,
    context: Context,
}

impl Teller {
    fn tell(&self, change: impl FnOnce(&mut State)) {
        change(&mut lock(&self.state));
        self.context.request_repaint();
    }
}

impl Progress for Teller {
    fn event(&self, _: &'static str, event: &Event) {
        self.tell(|state| state.event(event));
    }

    fn writing(&self) {
        self.tell(|state| state.writing = true);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_counts_the_time_of_nodes() {
        let [a, b] = [0, 1].map(NodeIndex::new);
        let shares = Arc::new(BTreeMap::from([(a, 0.1), (b, 0.9)]));
        let mut state = State { began: Some(machine::now()), shares, ..State::default() };
        let progress = |node, fraction| Event::NodeProgress { node, name: "n".into(), fraction };
        state.event(&Event::Planned { compute: 2, cached: 0 });
        state.event(&progress(a, 0.5));
        assert!((state.fraction() - 0.05).abs() < 1e-6);
        let finished = |node| Event::NodeFinished {
            node,
            name: "n".into(),
            cells: [4, 4],
            time: Duration::ZERO,
            bytes: 0,
            origin: Origin::Computed,
            backend: "cpu",
        };
        state.event(&finished(a));
        state.event(&progress(b, 0.5));
        assert!((state.fraction() - 0.55).abs() < 1e-6);
        // Not before a second has passed.
        assert_eq!(state.remaining(), None);
        state.began = state.began.and_then(|began| began.checked_sub(Duration::from_secs(11)));
        let left = state.remaining().expect("it is known").as_secs_f32();
        assert!((8.8..9.3).contains(&left), "{left}");
        // With results from the cache, the shares do not add up.
        state.event(&Event::Planned { compute: 4, cached: 1 });
        assert!((state.fraction() - 0.375).abs() < 1e-6);
    }
}
