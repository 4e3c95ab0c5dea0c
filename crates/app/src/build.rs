//! Building what is asked for: evaluation, then files.

use std::{
    path::Path,
    sync::{Mutex, PoisonError},
    time::Duration,
};

use orograph_graph::{
    Cancel, DiskCacheOptions, EvalError, Evaluator, EvaluatorOptions, Event, Origin, Port, Value, Window,
};

use crate::{
    failure::Failure,
    machine,
    outputs::{Form, OutputFolder, Written},
    progress::Progress,
    request::{Means, Request},
};

/// Bytes that the cache on disk may take.
const DISK_BUDGET: u64 = 10 << 30;

/// What a node took.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: &'static str,
    /// How long it was computed or read back.
    pub time: Duration,
    /// Bytes of its results.
    pub bytes: usize,
    /// Where they came from.
    pub origin: Origin,
}

/// What was built.
#[derive(Clone, Debug)]
pub struct Built {
    /// The files, in the order of the outputs.
    pub files: Vec<Written>,
    /// What each node took, in the order in which they finished.
    pub timings: Vec<Timing>,
    /// How long all took.
    pub time: Duration,
}

/// Builds requests, one after the other; remembers results in between if it is told to.
#[derive(Debug)]
pub struct Builder {
    evaluator: Evaluator,
}

impl Builder {
    /// A builder that remembers so many bytes of results.
    ///
    /// # Errors
    /// When the means asked for do not exist.
    pub fn new(means: &Means, memory: usize) -> Result<Self, Failure> {
        means.backend.check()?;
        machine::start_threads(means.threads)?;
        if let Some(cache) = means.cache.as_ref().filter(|cache| cache.exists() && !cache.is_dir()) {
            return Err(Failure::wrong(format!("`{}` is a file; `--cache` takes a folder", cache.display())));
        }
        let options = EvaluatorOptions {
            memory_budget: memory,
            disk_cache: means.cache.clone().map(|folder| DiskCacheOptions { folder, budget: DISK_BUDGET }),
            threads: means.threads,
            ..EvaluatorOptions::default()
        };
        Ok(Self { evaluator: Evaluator::new(options).map_err(failure)? })
    }

    /// Evaluates outputs of the graph on the whole world.
    ///
    /// # Errors
    /// When they cannot be computed, or it is stopped.
    pub fn evaluate(
        &self,
        request: &Request,
        ports: &[Port],
        cancel: &Cancel,
        progress: &dyn Progress,
    ) -> Result<(Vec<Value>, Vec<Timing>), Failure> {
        progress.started(request, self.evaluator.threads());
        let graph = &request.graph;
        let timings = Mutex::new(Vec::new());
        let events = |event: Event| {
            let kind = match &event {
                Event::Planned { .. } => "",
                Event::NodeStarted { node, .. }
                | Event::NodeProgress { node, .. }
                | Event::NodeFinished { node, .. }
                | Event::NodeGlimpse { node, .. }
                | Event::Warning { node, .. } => graph.instance(*node).node.id,
            };
            if let Event::NodeFinished { name, time, bytes, origin, .. } = &event {
                let timing = Timing { name: name.to_string(), kind, time: *time, bytes: *bytes, origin: *origin };
                timings.lock().unwrap_or_else(PoisonError::into_inner).push(timing);
            }
            progress.event(kind, &event);
        };
        let window: Window = request.window();
        let wanted: Vec<(Port, Window)> = ports.iter().map(|port| (*port, window)).collect();
        let values = self.evaluator.evaluate(graph, request.folder(), &wanted, cancel, &events);
        let timings = timings.into_inner().unwrap_or_else(PoisonError::into_inner);
        let values = values.map_err(failure);
        Ok((values.map_err(|failure| Failure { message: request.shown(&failure.message), ..failure })?, timings))
    }

    /// Builds the outputs of a request into a folder: all of them, or none.
    ///
    /// # Errors
    /// When they cannot be computed or written, or it is stopped; earlier files are as they were then.
    pub fn build(
        &self,
        request: &Request,
        folder: &Path,
        form: &Form,
        cancel: &Cancel,
        progress: &dyn Progress,
    ) -> Result<Built, Failure> {
        let built = self.build_files(request, folder, form, cancel, progress);
        progress.ended();
        match &built {
            Ok(built) => progress.finished(built),
            Err(failure) => progress.failed(failure),
        }
        built
    }

    fn build_files(
        &self,
        request: &Request,
        folder: &Path,
        form: &Form,
        cancel: &Cancel,
        progress: &dyn Progress,
    ) -> Result<Built, Failure> {
        let start = machine::now();
        form.engine.map_or(Ok(()), |engine| engine.check(request.world.cells))?;
        let mut staging = OutputFolder::prepare(folder, &request.outputs, form)?;
        let ports: Vec<Port> = request.outputs.iter().map(|output| output.port).collect();
        let (values, timings) = self.evaluate(request, &ports, cancel, progress)?;
        progress.writing();
        for (output, value) in request.outputs.iter().zip(&values) {
            let window = request.window();
            let key = self.evaluator.key(&request.graph, request.folder(), output.port, window).map_err(failure)?;
            staging.write(output, value, &window.world, &key.to_string(), cancel)?;
            if cancel.is_cancelled() {
                return Err(Failure::stopped());
            }
        }
        let files = staging.commit()?;
        Ok(Built { files, timings, time: start.elapsed() })
    }
}

/// A failed evaluation as the end of a command.
fn failure(error: EvalError) -> Failure {
    let (message, hint) = (error.to_string(), error.hint());
    let failure = match error {
        EvalError::Cancelled => return Failure::stopped(),
        EvalError::World(_)
        | EvalError::Request(_)
        | EvalError::Unwired { .. }
        | EvalError::Type { .. }
        | EvalError::Constant { .. }
        | EvalError::File { .. }
        | EvalError::Node { .. } => Failure::wrong(message),
        EvalError::TooLarge { .. }
        | EvalError::OutOfMemory { .. }
        | EvalError::Panicked { .. }
        | EvalError::Output { .. }
        | EvalError::Threads(_) => Failure::unable(message),
    };
    Failure { hint, ..failure }
}
