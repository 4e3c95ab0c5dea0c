//! Lines of JSON on standard output, for programs that run this one.

use std::{collections::BTreeMap, path::Path, sync::OnceLock};

use orograph_graph::{Event, Origin};
use serde_json::{Value, json};

use super::Progress;
use crate::{
    build::{Built, request::Request},
    memory,
    report::{failure::Failure, terminal},
};

/// The lines, for `--help`.
pub const HELP: &str = r#"With --json, standard output has one JSON object per line:
  {"event":"start","graph":F,"size_m":[X,Y],"cells":[NX,NY],"window":{"origin":[I,J],"cells":[NX,NY]}|null,"seed":S,"sea_level_m":Z|null,"threads":T,"outputs":[NAME...]}
  {"event":"plan","compute":N,"cached":M}
  {"event":"progress","node":NAME,"kind":KIND,"fraction":0.25}
  {"event":"node","node":NAME,"kind":KIND,"origin":"computed"|"memory"|"disk","seconds":T,"bytes":B}
  {"event":"warning","node":NAME,"message":TEXT}
  {"event":"output","name":NAME,"file":PATH,"type":TYPE,"bytes":B,"range":[LO,HI]|null,"unit":U,
   "import":{NAME:VALUE,...}|null}
  {"event":"expectation","measure":NAME,"value":V|null,"unit":U,"bounds":[LO|null,HI|null],"met":true|false,"reason":TEXT|null}
  {"event":"done","seconds":T,"files":N}
  {"event":"error","exit":CODE,"message":TEXT,"hint":TEXT|null,"problems":[{file,line,column,message,...}]}
In a sweep a line comes before those of each terrain:
  {"event":"sweep","index":N,"of":N,"values":{NAME:VALUE,...},"folder":FOLDER}
The last line is "done" or "error". An "error" after "done" says that all files are written, but do not meet what the
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

    /// Reports that a build failed, with the problems of its file.
    pub fn refused(failure: &Failure, problems: &[Value]) {
        let message = match (&*failure.message, problems.len()) {
            ("", count) => format!("{} in the graph file", terminal::counted(count, "problem")),
            (message, _) => message.to_owned(),
        };
        say(&json!({
            "event": "error", "exit": failure.exit as u8, "message": message, "hint": failure.hint, "problems": problems,
        }));
    }
}

/// Why lines were lost.
static LOST: OnceLock<Failure> = OnceLock::new();

/// Writes a line. If it cannot be written, the build continues, because its files were requested too.
fn say(line: &Value) {
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
            "threads": threads, "outputs": outputs, "window": part,
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
                "event": "output", "name": file.output, "file": file.path.display().to_string(), "type": file.what,
                "bytes": file.bytes, "range": file.range, "unit": file.unit,
                "import": file.import.as_ref().map(|import| &import.settings),
            }));
        }
        for figure in built.expected.figures() {
            let mut line = json!({"event": "expectation"});
            if let (Some(line), Value::Object(figure)) = (line.as_object_mut(), figure.as_json()) {
                line.extend(figure);
            }
            say(&line);
        }
        say(&json!({"event": "done", "seconds": built.time.as_secs_f64(), "files": built.files.len()}));
    }

    fn failed(&self, failure: &Failure) {
        Self::refused(failure, &[]);
    }
}
