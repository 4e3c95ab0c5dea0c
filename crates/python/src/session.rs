//! What runs share: the threads, and the results that later runs reuse.

use std::{
    num::NonZero,
    path::PathBuf,
    sync::{Mutex, PoisonError},
};

use orograph::{
    Failure,
    build::{
        Builder,
        backend::BackendName,
        request::Means,
        storage::{Storage, memory_budget},
    },
};
use pyo3::prelude::*;

use crate::errors;

static BUILDER: Mutex<Option<Builder>> = Mutex::new(None);

/// Sets the number of threads (one per core without it), a folder that stores results on disk (none without it), and
/// the memory in bytes for results that later runs reuse (a quarter of the machine's without it). Later runs use it.
#[pyfunction]
#[pyo3(signature = (*, threads=None, cache=None, memory=None))]
pub fn configure(
    py: Python<'_>,
    threads: Option<NonZero<usize>>,
    cache: Option<PathBuf>,
    memory: Option<usize>,
) -> PyResult<()> {
    let made = make(threads, cache, memory).map_err(|failure| errors::of_failure(py, &failure))?;
    *BUILDER.lock().unwrap_or_else(PoisonError::into_inner) = Some(made);
    Ok(())
}

fn make(threads: Option<NonZero<usize>>, cache: Option<PathBuf>, memory: Option<usize>) -> Result<Builder, Failure> {
    // results on disk belong to this build of the package, and not to the interpreter that runs
    let code = Python::attach(|py| py.import("orograph._orograph")?.filename()?.extract::<PathBuf>());
    if let Ok(code) = code {
        orograph_graph::code_is_in(code);
    }
    let storage = Storage { no_cache: cache.is_none(), cache, cache_trust: false };
    Builder::new(&Means { backend: BackendName::Cpu, threads, storage }, memory.unwrap_or_else(memory_budget))
}

/// The builder of all runs; the first call makes it.
///
/// # Errors
/// When the system cannot start threads.
pub fn builder() -> Result<Builder, Failure> {
    let mut builder = BUILDER.lock().unwrap_or_else(PoisonError::into_inner);
    match &*builder {
        Some(builder) => Ok(builder.clone()),
        None => Ok(builder.insert(make(None, None, None)?).clone()),
    }
}
