//! Failures as exceptions of the package, with the text that the command line prints.

use orograph::{
    Exit, Failure,
    report::{
        problems,
        terminal::{self, Page},
    },
};
use orograph_graph::Document;
use pyo3::{exceptions::PyKeyboardInterrupt, prelude::*};
use serde_json::{Value, json};
use std::path::Path;

/// A page without colours, for messages of exceptions.
const PLAIN: Page = Page { width: 100, colour: false, terminal: false };

/// The exception for a failure.
pub fn of_failure(py: Python<'_>, failure: &Failure) -> PyErr {
    if failure.exit == Exit::Stopped {
        return PyKeyboardInterrupt::new_err("");
    }
    let mut facts = json!({ "message": failure.message, "code": failure.code, "help": failure.hint });
    if let Some(place) = &failure.place
        && let (Some(facts), Ok(Value::Object(place))) = (facts.as_object_mut(), serde_json::to_value(place))
    {
        facts.extend(place);
    }
    let text = terminal::complaint(failure, PLAIN);
    make(py, if failure.exit == Exit::Wrong { "GraphError" } else { "RunError" }, text.trim_end(), &facts)
}

/// The exception for a graph file with problems.
pub fn of_problems(py: Python<'_>, document: &Document, path: &Path, shown: impl Fn(&str) -> String) -> PyErr {
    let text = problems::report_all(document, path, PLAIN);
    let all: Vec<Value> = problems::as_json(document, path);
    let first = all.iter().find(|problem| problem["severity"] == "error").cloned().unwrap_or_default();
    let mut facts = first;
    facts["problems"] = Value::Array(all);
    let facts = serde_json::from_str(&shown(&facts.to_string())).unwrap_or(facts);
    make(py, "GraphError", shown(&text).trim_end(), &facts)
}

fn make(py: Python<'_>, class: &str, text: &str, facts: &Value) -> PyErr {
    let raised = || py.import("orograph._errors")?.getattr(class)?.call1((text, facts.to_string()));
    match raised() {
        Ok(raised) => PyErr::from_value(raised),
        Err(error) => error,
    }
}
