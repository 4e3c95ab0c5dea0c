//! A graph file in memory.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use orograph::{
    build::request::{Array, Cells, Changes, Request, Setting},
    cli,
    export::geojson::{self, Coordinates},
    files::archive::Source,
    report::problems,
};
use orograph_graph::{Document, Origin, Value};
use pyo3::{
    buffer::PyBuffer,
    exceptions::{PyOSError, PyValueError},
    prelude::*,
};
use serde_json::json;

use crate::{errors, raster::Raster, run, session};

/// An array as Python gives it: its name, its shape, and its samples as C-ordered 32-bit floats.
type Input = (String, Vec<usize>, PyBuffer<f32>);

/// The outputs of a run by name, each a raster or the JSON of lines or a report with what it is; times and warnings of
/// nodes.
type Outputs = (Vec<(String, Py<PyAny>)>, Vec<(String, String, f64, usize, &'static str)>, Vec<(String, String)>);

/// A graph file with the changes that were made to it.
#[pyclass(frozen, module = "orograph._orograph")]
pub struct Graph {
    document: Mutex<Document>,
    path: PathBuf,
    /// Keeps the files of an archive.
    source: Arc<Source>,
}

impl Graph {
    fn new(py: Python<'_>, document: Document, path: PathBuf, source: Source) -> PyResult<Self> {
        if document.has_errors() {
            return Err(errors::of_problems(py, &document, &path, |text| source.shown(text)));
        }
        Ok(Self { document: Mutex::new(document), path, source: Arc::new(source) })
    }

    fn document(&self) -> MutexGuard<'_, Document> {
        self.document.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Graph {
    /// Reads a graph file or an archive.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = || {
            let source = Source::open(&path)?;
            Ok((problems::load(&source.path, &orograph_nodes::registry())?, source))
        };
        let (document, source) = read().map_err(|failure| errors::of_failure(py, &failure))?;
        Self::new(py, document, path, source)
    }

    /// Reads a text. File names in it are relative to the folder.
    #[staticmethod]
    fn parse(py: Python<'_>, text: String, folder: PathBuf) -> PyResult<Self> {
        let document = Document::parse_in(text, folder, &orograph_nodes::registry());
        let path = Path::new("<graph>");
        Self::new(py, document, path.to_owned(), Source::file(path))
    }

    /// The text of the file, with the changes.
    fn text(&self) -> String {
        self.document().source().to_owned()
    }

    /// The file as JSON, in the form of the schema.
    fn json(&self) -> String {
        self.document().to_json().unwrap_or_default().to_string()
    }

    /// What the file declares, as JSON.
    fn describe(&self, py: Python<'_>) -> PyResult<String> {
        cli::described(&self.document(), &self.path).map_err(|failure| errors::of_failure(py, &failure))
    }

    /// Sets an exposed parameter, or `node.parameter`, to a value in the notation of the file.
    fn set(&self, py: Python<'_>, name: String, text: String) -> PyResult<()> {
        let setting = Setting { place: name, value: text };
        setting.apply(&mut self.document(), "set").map_err(|failure| errors::of_failure(py, &failure))
    }

    /// Evaluates outputs; all of the file without names.
    #[pyo3(signature = (only, cells, window, supersample, seed, settings, inputs, progress))]
    #[expect(clippy::too_many_arguments, reason = "the options of a run")]
    fn run(
        &self,
        py: Python<'_>,
        only: Vec<String>,
        cells: Option<[u32; 2]>,
        window: Option<String>,
        supersample: Option<u32>,
        seed: Option<u32>,
        settings: Vec<(String, String)>,
        inputs: Vec<Input>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Outputs> {
        let failed = |failure: orograph::Failure| {
            let message = self.source.shown(&failure.message);
            errors::of_failure(py, &orograph::Failure { message, ..failure })
        };
        let window = window.map(|text| text.parse().map_err(PyValueError::new_err)).transpose()?;
        let set = settings.into_iter().map(|(place, value)| Setting { place, value }).collect();
        let cells = cells.map(|[nx, ny]| if ny == 0 { Cells::Longer(nx) } else { Cells::Both([nx, ny]) });
        let document = self.document().clone();
        let request = Request::of_document(document, &Changes { cells, window, supersample, seed, set });
        let mut request = request.and_then(|request| request.only(&only)).map_err(failed)?;
        for (name, shape, buffer) in inputs {
            let array = Array { shape, samples: buffer.to_vec(py)? };
            request.give(&name, array).map_err(failed)?;
        }
        let builder = session::builder().map_err(failed)?;
        let ports: Vec<_> = request.outputs.iter().map(|output| output.port).collect();
        let ran = run::run(py, &builder, &request, &ports, progress.as_ref())?;
        let mut outputs = Vec::new();
        for (output, value) in request.outputs.iter().zip(ran.values) {
            let value = match value {
                Value::Field(field) => Raster::new(field, output.ty).into_pyobject(py)?.into_any().unbind(),
                Value::Lines(lines) => {
                    let mut text = Vec::new();
                    let on = Coordinates::new(None, &request.world).map_err(failed)?;
                    let written = geojson::write(&mut text, &lines, &on);
                    written.map_err(|error| PyOSError::new_err(error.to_string()))?;
                    ("lines", String::from_utf8_lossy(&text).into_owned()).into_pyobject(py)?.into_any().unbind()
                }
                Value::Report(report) => {
                    ("report", json!(report.as_ref()).to_string()).into_pyobject(py)?.into_any().unbind()
                }
                // an output of a file is never strata or a state
                Value::Strata(_) | Value::State(_) => py.None(),
            };
            outputs.push((output.name.clone(), value));
        }
        let timings = ran.timings.into_iter().map(|timing| {
            let origin = match timing.origin {
                Origin::Computed => "computed",
                Origin::Memory => "memory",
                Origin::Disk => "disk",
            };
            (timing.name, timing.kind.to_owned(), timing.time.as_secs_f64(), timing.bytes, origin)
        });
        Ok((outputs, timings.collect(), ran.warnings))
    }
}
