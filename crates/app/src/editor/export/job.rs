//! A build beside the window, with its progress and its end.

use std::{
    path::PathBuf,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
};

use egui::Context;
use orograph_graph::{Cancel, Evaluator, Event};

use crate::{
    build::{Builder, Built},
    failure::Failure,
    outputs::Form,
    progress::Progress,
    request::Request,
};

/// How far a build is.
#[derive(Clone, Debug, Default)]
pub(super) struct State {
    /// Kernels that are to run, and that have run.
    pub(super) planned: usize,
    pub(super) finished: usize,
    /// The node whose kernel runs, and its finished part.
    pub(super) node: Option<(String, f32)>,
    /// Whether files are being written.
    pub(super) writing: bool,
    /// What nodes warned of.
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

/// A build beside the window.
#[derive(Debug)]
pub(super) struct Job {
    state: Arc<Mutex<State>>,
    cancel: Cancel,
}

impl Job {
    /// Begins a build into a folder, with the results that an evaluator has.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub(super) fn start(
        evaluator: &Arc<Evaluator>,
        request: Request,
        folder: PathBuf,
        form: Form,
        context: &Context,
    ) -> Result<Self, Failure> {
        let job = Self { state: Arc::default(), cancel: Cancel::default() };
        let (state, cancel, context) = (Arc::clone(&job.state), job.cancel.clone(), context.clone());
        let builder = Builder::sharing(Arc::clone(evaluator));
        let work = move || {
            let teller = Teller { state, context };
            let built = builder.build(&request, &folder, &form, &cancel, &teller);
            teller.tell(|state| state.end = Some(built));
        };
        let thread = thread::Builder::new().name("export".to_owned());
        thread.spawn(work).map_err(|error| Failure::unable(format!("cannot start a thread: {error}")))?;
        Ok(job)
    }

    /// How far it is.
    pub(super) fn state(&self) -> State {
        lock(&self.state).clone()
    }

    /// Asks it to stop; nothing is written then.
    pub(super) fn cancel(&self) {
        self.cancel.cancel();
    }

    /// Whether it was asked to stop.
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

/// What a build is told to.
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
