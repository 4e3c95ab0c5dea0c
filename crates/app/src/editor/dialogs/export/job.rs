//! A build in the background, with its progress and its result.

use std::{
    path::PathBuf,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
};

use egui::Context;
use orograph_graph::{Cancel, Evaluator, Event};

use crate::{
    build::{Builder, Built, request::Request},
    export::outputs::OutputOptions,
    report::{failure::Failure, progress::Progress},
};

/// The progress of a build.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    /// Number of kernels to run, and number finished.
    pub(super) planned: usize,
    pub(super) finished: usize,
    /// The running node, and its finished part.
    pub(super) node: Option<(String, f32)>,
    /// True while files are written.
    pub(super) writing: bool,
    /// Warnings of nodes.
    pub(super) warnings: Vec<String>,
    /// How it ended.
    pub(super) end: Option<Result<Built, Failure>>,
}

impl State {
    /// The finished part, 0 to 1.
    pub(super) fn fraction(&self) -> f32 {
        let part = self.node.as_ref().map_or(0.0, |(_, fraction)| *fraction);
        if self.writing { 1.0 } else { (self.finished as f32 + part) / self.planned.max(1) as f32 }
    }
}

/// A build in the background.
#[derive(Debug)]
pub(super) struct Job {
    state: Arc<Mutex<State>>,
    cancel: Cancel,
}

impl Job {
    /// Starts a build into a folder, reusing the results of an evaluator.
    ///
    /// # Errors
    /// When the system cannot start a thread.
    pub(super) fn start(
        evaluator: &Arc<Evaluator>,
        request: Request,
        folder: PathBuf,
        options: OutputOptions,
        context: &Context,
    ) -> Result<Self, Failure> {
        let job = Self { state: Arc::default(), cancel: Cancel::default() };
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
        self.tell(|state| match event {
            Event::Planned { compute, .. } => state.planned = *compute,
            Event::NodeStarted { name, .. } => state.node = Some((name.to_string(), 0.0)),
            Event::NodeProgress { name, fraction, .. } => state.node = Some((name.to_string(), *fraction)),
            Event::NodeFinished { .. } => {
                state.finished += 1;
                state.node = None;
            }
            Event::NodeGlimpse { .. } => {}
            Event::Warning { name, message, .. } => state.warnings.push(format!("{name}: {message}")),
        });
    }

    fn writing(&self) {
        self.tell(|state| state.writing = true);
    }
}
