//! Lines of JSON on standard output, for programs that run this one.

use std::{collections::BTreeMap, fs::File, path::Path, sync::OnceLock};

use orograph_graph::{Diagnostic, Document, Event, Origin, Severity};
use serde_json::{Value, json};

use super::Progress;
use crate::{
    build::{Built, request::Request},
    files::archive::Source,
    memory,
    report::{failure::Failure, problems, terminal},
};

/// The lines, for `--help`.
pub const HELP: &str = r#"With --json, standard output has one JSON object per line:
  {"event":"start","graph":F,"size_m":[X,Y],"cells":[NX,NY],"window":{"origin":[I,J],"cells":[NX,NY]}|null,"supersample":N,"seed":S,"sea_level_m":Z|null,"threads":T,"outputs":[NAME...]}
  {"event":"plan","compute":N,"cached":M}
  {"event":"progress","node":NAME,"kind":KIND,"fraction":0.25}
  {"event":"node","node":NAME,"kind":KIND,"origin":"computed"|"memory"|"disk","seconds":T,"bytes":B,"backend":"cpu"|"gpu"}
  {"event":"warning","node":NAME,"message":TEXT}
  {"event":"output","name":NAME,"file":PATH,"hash":HASH,"type":TYPE,"bytes":B,"range":[LO,HI]|null,"unit":U,
   "import":{NAME:VALUE,...}|null}
  {"event":"expectation","measure":NAME,"value":V|null,"unit":U,"bounds":[LO|null,HI|null],"met":true|false,
   "counts":true|false,"reason":TEXT|null}
  {"event":"done","seconds":T,"files":N}
  {"event":"problem","file":PATH,"line":L,"column":C,"severity":"error"|"warning","code":CODE,"message":TEXT,"help":TEXT|null}
  {"event":"error","exit":N,"code":CODE,"message":TEXT,"help":TEXT|null} and, if a node failed, "node","file","line","column"
In a sweep a line comes before those of each terrain:
  {"event":"sweep","index":N,"of":N,"values":{NAME:VALUE,...},"folder":FOLDER}
`watch` also prints {"event":"watching","file":PATH} when it waits and {"event":"changed","file":NAME} when a file was saved.
The last line of `run` is "done" or "error". An "error" after "done" says that all files are written, but do not meet what the
file expects. New kinds of lines and new fields may be added."#;

/// Writes the lines.
#[derive(Debug)]
pub struct JsonLines;

impl JsonLines {
    /// Announces the next terrain of a sweep.
    pub fn variant(index: usize, of: usize, values: &BTreeMap<String, String>, folder: &Path) {
        let folder = folder.display().to_string();
        say(&json!({"event": "sweep", "index": index, "of": of, "values": values, "folder": folder}));
    }

    /// Returns an error if lines were lost, unless their reader has closed the pipe.
    ///
    /// # Errors
    /// When a line could not be written.
    pub fn complete() -> Result<(), Failure> {
        LOST.get().filter(|failure| !failure.message.is_empty()).map_or(Ok(()), |failure| Err(failure.clone()))
    }

    /// Reports the problems of a file and of the graph files that it uses, one per line.
    pub fn problems(document: &Document, source: &Source) {
        problems::as_json(document, &source.path).iter().for_each(|line| say_text(&source.shown(&line.to_string())));
    }

    /// Reports that a file is not used, with its problems if these are why.
    pub fn refused(failure: &Failure, file: &Path) {
        let read = || {
            let source = Source::open(file).ok()?;
            Some((problems::load(&source.path, &orograph_nodes::registry()).ok()?, source))
        };
        let is_about_problems = failure.message.is_empty();
        if let Some((document, source)) = is_about_problems.then(read).flatten() {
            Self::problems(&document, &source);
        }
        error(failure);
    }

    /// Reports what a check found: problems, then notes, then their numbers.
    pub fn checked(document: &Document, notes: &[Diagnostic], source: &Source, file: &Path) {
        Self::problems(document, source);
        for note in notes {
            say_text(&source.shown(&problems::one_as_json(note, document, &source.path).to_string()));
        }
        let count = |severity| document.problems().iter().filter(|problem| problem.severity == severity).count();
        say(&json!({
            "event": "checked", "file": file.display().to_string(), "nodes": document.nodes().len(),
            "outputs": document.outputs().len(), "errors": count(Severity::Error), "warnings": count(Severity::Warning),
            "notes": notes.len(),
        }));
    }

    /// Reports that the program waits for a change of a file or of those that it reads.
    pub fn watching(file: &Path) {
        say(&json!({"event": "watching", "file": file.display().to_string()}));
    }

    /// Reports that a file was changed.
    pub fn changed(name: &str) {
        say(&json!({"event": "changed", "file": name}));
    }
}

/// Why lines were lost.
static LOST: OnceLock<Failure> = OnceLock::new();

/// Reports why a command failed.
fn error(failure: &Failure) {
    let message = if failure.message.is_empty() { "the graph file has problems" } else { &failure.message };
    let mut line = json!({
        "event": "error", "exit": failure.exit as u8, "code": failure.code, "message": message, "help": failure.hint,
    });
    if let Some(place) = &failure.place
        && let (Some(line), Ok(Value::Object(place))) = (line.as_object_mut(), serde_json::to_value(place))
    {
        line.extend(place);
    }
    say(&line);
}

/// The BLAKE3 hash of a file's content; null if the file is gone.
fn hash(path: &Path) -> Value {
    let mut hash = blake3::Hasher::new();
    let read = File::open(path).and_then(|file| hash.update_reader(file).map(|hash| hash.finalize()));
    read.map_or(Value::Null, |hash| json!(hash.to_string()))
}

fn say(line: &Value) {
    say_text(&line.to_string());
}

/// Writes a line. If it cannot be written, the build continues, because its files were requested too.
fn say_text(line: &str) {
    let line = format!("{line}\n");
    if let Err(failure) = memory::in_json_line(|| terminal::print(&line)) {
        LOST.get_or_init(|| failure);
    }
}

impl Progress for JsonLines {
    fn started(&self, request: &Request, threads: usize) {
        let outputs: Vec<&str> = request.outputs.iter().map(|output| output.name.as_str()).collect();
        let window = request.window();
        let part = (!window.is_whole()).then(|| json!({"origin": window.origin, "cells": window.cells}));
        say(&json!({
            "event": "start", "graph": request.path.display().to_string(), "size_m": request.world.size,
            "cells": request.world.cells, "seed": request.world.seed, "sea_level_m": request.world.sea_level,
            "threads": threads, "outputs": outputs, "window": part, "supersample": request.supersample(),
        }));
    }

    fn event(&self, kind: &'static str, event: &Event) {
        match event {
            Event::Planned { compute, cached } => say(&json!({"event": "plan", "compute": compute, "cached": cached})),
            Event::NodeStarted { name, .. } => {
                say(&json!({"event": "progress", "node": &**name, "kind": kind, "fraction": 0.0}));
            }
            Event::NodeProgress { name, fraction, .. } => {
                let fraction = (f64::from(*fraction) * 1e4).round() / 1e4;
                say(&json!({"event": "progress", "node": &**name, "kind": kind, "fraction": fraction}));
            }
            // Only the editor shows progressive previews.
            Event::NodeGlimpse { .. } => {}
            Event::NodeFinished { name, time, bytes, origin, backend, .. } => {
                let origin = match origin {
                    Origin::Computed => "computed",
                    Origin::Memory => "memory",
                    Origin::Disk => "disk",
                };
                say(&json!({
                    "event": "node", "node": &**name, "kind": kind, "origin": origin, "seconds": time.as_secs_f64(),
                    "bytes": bytes, "backend": backend,
                }));
            }
            Event::Warning { name, message, .. } => {
                say(&json!({"event": "warning", "node": &**name, "message": message}));
            }
        }
    }

    fn finished(&self, built: &Built) {
        for file in &built.files {
            say(&json!({
                "event": "output", "name": file.output, "file": file.path.display().to_string(),
                "hash": hash(&file.path), "type": file.what, "bytes": file.bytes, "range": file.range, "unit": file.unit,
                "import": file.import.as_ref().map(|import| &import.settings),
            }));
        }
        for figure in built.expected.as_json() {
            let mut line = json!({"event": "expectation"});
            if let (Some(line), Value::Object(figure)) = (line.as_object_mut(), figure) {
                line.extend(figure);
            }
            say(&line);
        }
        say(&json!({"event": "done", "seconds": built.time.as_secs_f64(), "files": built.files.len()}));
    }

    fn failed(&self, failure: &Failure) {
        error(failure);
    }
}
