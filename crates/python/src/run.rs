//! One run: evaluation on other threads, while this one tells the progress and listens to Ctrl-C.

use std::{
    sync::mpsc::{RecvTimeoutError, Sender, channel},
    thread,
    time::Duration,
};

use orograph::{
    Failure,
    build::{Builder, Timing, request::Request},
    report::progress::Progress,
};
use orograph_graph::{Cancel, Event, Port, Value};
use pyo3::{exceptions::PyRuntimeError, prelude::*};

use crate::errors;

/// Interval of checks for Ctrl-C while no event comes.
const LOOK: Duration = Duration::from_millis(50);

/// An event that the caller hears.
enum Heard {
    Progress(String, f32),
    Warning(String, String),
}

/// Sends the events of a run to the calling thread.
struct Tell {
    sender: Sender<Heard>,
    /// False if nobody listens to progress.
    fractions: bool,
}

impl Progress for Tell {
    fn event(&self, _: &'static str, event: &Event) {
        let heard = match event {
            Event::NodeProgress { name, fraction, .. } if self.fractions => {
                Heard::Progress(name.to_string(), *fraction)
            }
            Event::NodeFinished { name, .. } if self.fractions => Heard::Progress(name.to_string(), 1.0),
            Event::Warning { name, message, .. } => Heard::Warning(name.to_string(), message.clone()),
            _ => return,
        };
        // Ignored: the calling thread listens until the run has ended.
        let _ = self.sender.send(heard);
    }
}

/// The result of a run.
pub struct Ran {
    pub values: Vec<Value>,
    pub timings: Vec<Timing>,
    /// Nodes with their warnings.
    pub warnings: Vec<(String, String)>,
}

/// Evaluates outputs without holding the interpreter's lock. `progress` is called with the name of a node and the
/// finished part of its work; an exception in it, or Ctrl-C, stops the run.
pub fn run(
    py: Python<'_>,
    builder: &Builder,
    request: &Request,
    ports: &[Port],
    progress: Option<&Py<PyAny>>,
) -> PyResult<Ran> {
    let cancel = Cancel::default();
    let (sender, events) = channel();
    let tell = Tell { sender, fractions: progress.is_some() };
    let mut warnings = Vec::new();
    let (outcome, raised) = py.detach(|| {
        // the receiver belongs to the thread that listens
        let events = events;
        thread::scope(|scope| {
            let evaluate = {
                let cancel = &cancel;
                move || builder.evaluate(request, ports, cancel, &tell)
            };
            let worker = match thread::Builder::new().name("run".to_owned()).spawn_scoped(scope, evaluate) {
                Ok(worker) => worker,
                Err(error) => return (Err(Failure::unable(format!("cannot start a thread: {error}"))), None),
            };
            let mut raised = None;
            loop {
                let heard = match events.recv_timeout(LOOK) {
                    Ok(Heard::Warning(node, message)) => {
                        warnings.push((node, message));
                        continue;
                    }
                    Ok(Heard::Progress(node, fraction)) => progress.map(|progress| (progress, node, fraction)),
                    Err(RecvTimeoutError::Timeout) => None,
                    Err(RecvTimeoutError::Disconnected) => break,
                };
                if raised.is_some() {
                    continue;
                }
                let told = Python::attach(|py| {
                    if let Some((progress, node, fraction)) = heard {
                        progress.call1(py, (node, fraction))?;
                    }
                    py.check_signals()
                });
                raised = told.err();
                if raised.is_some() {
                    cancel.cancel();
                }
            }
            (worker.join().unwrap_or_else(|_| Err(Failure::unable("the run ended with an internal error"))), raised)
        })
    });
    if let Some(raised) = raised {
        return Err(raised);
    }
    let (values, timings) = outcome.map_err(|failure| errors::of_failure(py, &failure))?;
    if values.len() != ports.len() {
        return Err(PyRuntimeError::new_err("the run ended without all of its outputs"));
    }
    Ok(Ran { values, timings, warnings })
}
