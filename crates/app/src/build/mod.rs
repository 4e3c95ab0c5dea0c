//! Builds a request: evaluation, then files.

pub mod backend;
pub mod fit;
pub mod request;
pub mod storage;
pub mod supersample;

use std::{
    path::Path,
    sync::{Arc, Mutex, PoisonError, mpsc::sync_channel},
    thread,
    time::Duration,
};

use orograph_graph::{
    Cancel, Delivered, Document, EvalError, Evaluation, Evaluator, EvaluatorOptions, Event, Origin, OutputDecl, Port,
    PortType, Value,
};

use self::{
    request::{Means, Request},
    supersample::{Averager, finer},
};
use crate::{
    export::{
        cube::{self, Cube},
        geojson::Coordinates,
        outputs::{Holes, OutputFolder, OutputOptions, OutputWriter, Written, check_holes},
    },
    files::read_by,
    machine,
    report::{
        expect::{Expected, Watch},
        failure::{Exit, Failure, Spot, reason},
        progress::{Progress, Quiet},
        terminal,
    },
};

/// Maximum number of results that wait for writing before computation pauses.
const WAITING: usize = 1;

/// The cost of a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Timing {
    /// Its name.
    pub name: String,
    /// Its type.
    pub kind: &'static str,
    /// Time spent computing it, or reading it from the cache.
    pub time: Duration,
    /// Size of its results in bytes.
    pub bytes: usize,
    /// Whether its results were computed or read from a cache.
    pub origin: Origin,
    /// What computed them, or would compute them.
    pub backend: &'static str,
}

/// The result of a build.
#[derive(Clone, Debug)]
pub struct Built {
    /// The files, in the order of the outputs.
    pub files: Vec<Written>,
    /// The cost of each node, in the order in which they finished.
    pub timings: Vec<Timing>,
    /// The total time.
    pub time: Duration,
    /// What became of the expectations of the file.
    pub expected: Expected,
}

/// Builds requests.
#[derive(Clone, Debug)]
pub struct Builder {
    evaluator: Arc<Evaluator>,
}

impl Builder {
    /// A builder whose store keeps this many bytes of results in memory.
    ///
    /// # Errors
    /// When the requested folder does not exist. Without the requested backend it says so and takes the processor.
    pub fn new(means: &Means, memory: usize) -> Result<Self, Failure> {
        machine::start_threads(means.threads)?;
        let (backend, said) = means.backend.open();
        said.iter().for_each(|said| terminal::remark(&format!("{said}\n")));
        let options = EvaluatorOptions {
            backend,
            store: means.storage.store(memory)?,
            threads: means.threads,
            ..EvaluatorOptions::default()
        };
        Ok(Self { evaluator: Arc::new(Evaluator::new(options).map_err(|error| failure(error, None))?) })
    }

    /// A builder that shares the results of an evaluator.
    #[must_use]
    pub const fn sharing(evaluator: Arc<Evaluator>) -> Self {
        Self { evaluator }
    }

    /// Evaluates outputs of the graph on the window of the request.
    ///
    /// # Errors
    /// When they cannot be computed, or the build is cancelled.
    pub fn evaluate(
        &self,
        request: &Request,
        ports: &[Port],
        cancel: &Cancel,
        progress: &dyn Progress,
    ) -> Result<(Vec<Value>, Vec<Timing>), Failure> {
        let mut values = vec![None; ports.len()];
        let timings = self.stream(request, ports, &vec![false; ports.len()], cancel, progress, |at, delivered| {
            values[at] = Some(delivered.value);
            Ok(())
        })?;
        Ok((values.into_iter().flatten().collect(), timings))
    }

    /// Evaluates outputs of the graph and passes each to `take`, on this thread, as soon as it is ready and while
    /// others are computed; outputs for which `streamed` is true may arrive in bands of rows.
    fn stream(
        &self,
        request: &Request,
        ports: &[Port],
        streamed: &[bool],
        cancel: &Cancel,
        progress: &dyn Progress,
        mut take: impl FnMut(usize, Delivered) -> Result<(), Failure>,
    ) -> Result<Vec<Timing>, Failure> {
        progress.started(request, self.evaluator.threads());
        let graph = &*request.graph;
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
            if let Event::NodeFinished { name, time, bytes, origin, backend, .. } = &event {
                let (name, time, bytes) = (name.to_string(), *time, *bytes);
                let timing = Timing { name, kind, time, bytes, origin: *origin, backend };
                timings.lock().unwrap_or_else(PoisonError::into_inner).push(timing);
            }
            progress.event(kind, &event);
        };
        let (asked, factor) = (request.window(), request.supersample());
        let window = finer(asked, factor);
        let averager = |port: &Port| {
            let node = graph.instance(port.node).node;
            Averager::new(node.averaging(port.output, graph.output_type(*port)), asked, factor)
        };
        let mut averagers: Vec<_> = ports.iter().map(|port| (factor > 1).then(|| averager(port))).collect();
        let requests: Vec<_> = ports.iter().map(|port| orograph_graph::Request { port: *port, window }).collect();
        let evaluation = Evaluation { graph, folder: request.folder(), requests: &requests, byproducts: &[] };
        // After a failure the remaining work is cancelled.
        let stop = cancel.child();
        let (sender, deliveries) = sync_channel(WAITING);
        let outcome = thread::scope(|scope| {
            let evaluate = || {
                self.evaluator.deliver_in_bands(&evaluation, streamed, &stop, &events, &|at, delivery| {
                    // Ignored: after a failure nobody receives.
                    let _ = sender.send((at, delivery));
                });
                drop(sender);
            };
            let builder = thread::Builder::new().name("evaluation".to_owned());
            builder.spawn_scoped(scope, evaluate).map_err(|error| {
                Failure::unable(format!("cannot start a thread: {}", reason(&error)))
                    .hint("use fewer threads with `--threads`, or give the program more memory")
            })?;
            let mut outcome = Ok(());
            for (at, delivery) in deliveries {
                if outcome.is_ok() {
                    let placed = |error| failure(error, Some(&request.document));
                    let averaged = delivery.map_err(placed).and_then(|it| averaged(averagers[at].as_mut(), it));
                    outcome = averaged.and_then(|delivered| delivered.map_or(Ok(()), |it| take(at, it)));
                    if outcome.is_err() {
                        stop.cancel();
                    }
                }
            }
            outcome
        });
        outcome.map_err(|failure| request.shown_in(failure))?;
        Ok(timings.into_inner().unwrap_or_else(PoisonError::into_inner))
    }

    /// Builds a terrain of a cube, then measures what the file expects.
    ///
    /// # Errors
    /// When it cannot be computed or written, or the build is cancelled; what is complete of the cube stays.
    pub fn build_member(
        &self,
        request: &Request,
        cube: &Cube,
        member: usize,
        cancel: &Cancel,
        progress: &dyn Progress,
    ) -> Result<Expected, Failure> {
        let ports: Vec<Port> = request.outputs.iter().map(|output| output.port).collect();
        let (mut watch, mut expected) = watch(request)?;
        let mut rows = cube.member(member);
        let built = self.stream(request, &ports, &vec![true; ports.len()], cancel, progress, |at, delivered| {
            let Some(field) = delivered.value.as_field() else { return Ok(()) };
            if let Some(watch) = &mut watch {
                watch.add(&request.outputs[at].name, field)?;
            }
            rows.rows(at, field)?;
            if cancel.is_cancelled() { Err(cube::stopped()) } else { Ok(()) }
        });
        progress.ended();
        if let Err(failure) = built {
            let failure = if failure.exit == Exit::Stopped { cube::stopped() } else { failure };
            progress.failed(&failure);
            return Err(failure);
        }
        if let Some(watch) = watch {
            expected = watch.finish(request.document.registry(), cancel)?;
        }
        Ok(expected)
    }

    /// Evaluates the mask of the cells that have data, before all outputs, which arrive in any order.
    fn holes(&self, request: &Request, mask: &str, cancel: &Cancel) -> Result<Holes, Failure> {
        let wrong = |what: String| Failure::wrong(format!("`--holes {mask}`: {what}"));
        let port = request.graph.port(mask).map_err(|error| wrong(error.to_string()))?;
        let ty = request.graph.output_type(port);
        if ty != PortType::Mask {
            return Err(wrong(format!("it is {}", ty.one())).hint("name a mask, such as `NODE.data` of an `Import`"));
        }
        let (values, _) = self.evaluate(request, &[port], cancel, &Quiet)?;
        let holes = values.first().and_then(Value::as_field).map(Holes::of);
        holes.ok_or_else(|| wrong("it has no raster".to_owned()))
    }

    /// Builds the outputs of a request into a folder. Writes all files or none, then measures what the file expects.
    ///
    /// # Errors
    /// When they cannot be computed or written, or the build is cancelled; earlier files are then unchanged.
    pub fn build(
        &self,
        request: &Request,
        folder: &Path,
        options: &OutputOptions,
        cancel: &Cancel,
        progress: &dyn Progress,
    ) -> Result<Built, Failure> {
        let built = self.build_files(request, folder, options, cancel, progress);
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
        options: &OutputOptions,
        cancel: &Cancel,
        progress: &dyn Progress,
    ) -> Result<Built, Failure> {
        let start = machine::now();
        let cells = request.window().cells;
        options.engine.map_or(Ok(()), |engine| engine.check(cells, options.tiles()))?;
        options.tiles().map_or(Ok(()), |tiles| tiles.check(cells))?;
        if request.outputs.iter().any(|output| output.ty == PortType::Lines) {
            Coordinates::new(options.lines, &request.world)?;
        }
        OutputFolder::protect(folder, &request.outputs, options, read_by(&request.document))?;
        check_holes(&request.outputs, options)?;
        let mut staging = OutputFolder::prepare(folder, &request.outputs, options)?;
        if let Some(mask) = &options.holes {
            staging.leave(self.holes(request, mask, cancel)?);
        }
        staging.supersample(request.supersample());
        let ports: Vec<Port> = request.outputs.iter().map(|output| output.port).collect();
        let window = request.window();
        let has_rows = |output: &OutputDecl| output.ty.planes().is_some();
        let mut writers: Vec<Option<OutputWriter<'_>>> = Vec::with_capacity(ports.len());
        for output in &request.outputs {
            writers.push(has_rows(output).then(|| staging.writer(output, &window)).transpose()?);
        }
        let streamed: Vec<bool> =
            writers.iter().map(|writer| writer.as_ref().is_some_and(OutputWriter::is_streamable)).collect();
        let (mut watch, mut expected) = watch(request)?;
        let mut left = ports.len();
        let timings = self.stream(request, &ports, &streamed, cancel, progress, |at, Delivered { value, key }| {
            let key = supersample::hash(&key.to_string(), request.supersample());
            let end = window.origin[1] + window.cells[1];
            let is_last =
                value.as_field().is_none_or(|field| field.window().origin[1] + field.window().cells[1] == end);
            left -= usize::from(is_last);
            if left == 0 {
                progress.writing();
            }
            if let (Some(watch), Some(rows)) = (&mut watch, value.as_field()) {
                watch.add(&request.outputs[at].name, rows)?;
            }
            match (writers[at].as_mut(), value.as_field()) {
                (Some(writer), Some(rows)) => writer.rows(rows, cancel)?,
                _ => staging.write(&request.outputs[at], &value, &window, &key, cancel)?,
            }
            drop(value);
            if let Some(writer) = writers[at].take_if(|_| is_last) {
                writer.finish(&key, cancel)?;
            }
            if cancel.is_cancelled() { Err(Failure::stopped()) } else { Ok(()) }
        })?;
        drop(writers);
        if left > 0 {
            return Err(Failure::unable(format!("{left} of {} outputs are incomplete", ports.len())));
        }
        let files = staging.commit()?;
        if let Some(watch) = watch {
            expected = watch.finish(request.document.registry(), cancel)?;
        }
        Ok(Built { files, timings, time: start.elapsed(), expected })
    }
}

/// Averages what an evaluation on finer cells has delivered. Returns None while a band completes no row of cells.
fn averaged(averager: Option<&mut Averager>, delivered: Delivered) -> Result<Option<Delivered>, Failure> {
    let Some((averager, field)) = averager.zip(delivered.value.as_field()) else { return Ok(Some(delivered)) };
    let rows = averager.rows(field)?;
    Ok(rows.map(|rows| Delivered { value: Value::from(rows), ..delivered }))
}

/// Prepares to measure what the file of a request expects. Without that, says why nothing is measured.
fn watch(request: &Request) -> Result<(Option<Watch<'_>>, Expected), Failure> {
    let Some(expected) = request.document.expectations() else { return Ok((None, Expected::Nothing)) };
    let Some(output) = &expected.output else { return Ok((None, Expected::Unknown)) };
    let skipped = |why: String| Ok((None, Expected::Skipped(why)));
    if !request.window().is_whole() {
        return skipped("only a part of the world is built".to_owned());
    }
    if !request.outputs.iter().any(|built| built.name == *output) {
        return skipped(format!("they are about `{output}`, which is not built"));
    }
    Ok((Some(Watch::new(expected, output, request.world)?), Expected::Nothing))
}

/// Converts an evaluation error to the failure of a command, with the place of the node in its file.
fn failure(error: EvalError, document: Option<&Document>) -> Failure {
    let (message, hint, code) = (error.to_string(), error.hint(), error.code());
    let place = document.zip(error.node()).and_then(|(document, node)| Spot::of_node(document, node));
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
    Failure { hint, code, place: place.map(Box::new), ..failure }
}
