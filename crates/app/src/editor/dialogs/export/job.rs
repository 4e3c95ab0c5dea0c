//! A build in the background, with its progress and its result.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread::{self, JoinHandle},
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
    /// The name of the node that last reported progress.
    pub(super) node: Option<String>,
    /// True while files are written.
    pub(super) writing: bool,
    /// Warnings of nodes.
    pub(super) warnings: Vec<String>,
    /// How it ended.
    pub(super) end: Option<Result<Built, Failure>>,
}

impl State {
    /// A build that failed to start.
    pub(super) fn failed(failure: Failure) -> Self {
        Self { end: Some(Err(failure)), ..Self::default() }
    }

    /// The finished part, 0 to 1, by the time of the kernels. Which results come from the cache is not known before:
    /// kernels to run that have not begun count as the mean of all nodes that have not.
    pub(super) fn fraction(&self) -> f32 {
        if self.writing {
            return 1.0;
        }
        let share = |node: &NodeIndex| self.shares.get(node).copied().unwrap_or_default();
        let done = self.share + self.running.iter().map(|(node, part)| share(node) * part).sum::<f32>();
        let begun = self.share + self.running.keys().map(share).sum::<f32>();
        let count = self.finished + self.running.len();
        let others = self.shares.len().saturating_sub(count).max(1) as f32;
        let left = (1.0 - begun).max(0.0) * self.planned.saturating_sub(count) as f32 / others;
        if begun + left > 0.0 { (done / (begun + left)).clamp(0.0, 1.0) } else { 0.0 }
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
    thread: JoinHandle<()>,
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
        let (state, cancel) = (Arc::new(Mutex::new(state)), Cancel::default());
        let (shared, stop, context) = (Arc::clone(&state), cancel.clone(), context.clone());
        let builder = Builder::sharing(Arc::clone(evaluator));
        let work = move || {
            let teller = Teller { state: shared, context };
            let built = builder.build(&request, &folder, &options, &stop, &teller);
            teller.tell(|state| state.end = Some(built));
        };
        let thread = thread::Builder::new().name("export".to_owned());
        let thread = thread.spawn(work);
        let thread = thread.map_err(|error| Failure::unable(format!("cannot start a thread: {error}")))?;
        Ok(Self { state, cancel, thread })
    }

    /// The current progress.
    pub(super) fn state(&self) -> State {
        // Asked first: a thread that ends well has written its result before.
        let is_over = self.thread.is_finished();
        let mut state = lock(&self.state).clone();
        if is_over && state.end.is_none() {
            state.end = Some(Err(Failure::unable("the export ended unexpectedly".to_owned())));
        }
        state
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
        // With a result from the cache, the others are all that is to be done.
        let mut state = State { shares: Arc::clone(&state.shares), ..State::default() };
        state.event(&Event::Planned { compute: 1, cached: 1 });
        assert_eq!(state.fraction(), 0.0);
        state.event(&progress(b, 0.5));
        assert!((state.fraction() - 0.5).abs() < 1e-6);
    }
}
