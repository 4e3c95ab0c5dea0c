//! Hashes of the files that nodes read, reused as long as a file stays unchanged.
//!
//! A file is hashed together with its companion, if there is one: `NAME.png.json` next to `NAME.png`, or `NAME.prj`
//! next to `NAME.asc`, with metadata that the file format cannot hold.

use std::{
    collections::BTreeMap,
    fs,
    io::{self, Read as _},
    path::{Path, PathBuf},
    sync::Mutex,
    time::{Duration, SystemTime},
};

use super::{error::EvalError, event::lock, plan::Step};
use crate::{input, job::Cancel, param::ParamValue};

/// Metadata that shows that a file has changed, without reading it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stamp {
    modified: SystemTime,
    bytes: u64,
}

/// A file of a parameter and its companion, as they were when they were hashed.
#[derive(Clone, Debug)]
pub(super) struct Stamped {
    parameter: &'static str,
    parts: [Part; 2],
}

/// One file; its metadata is `None` when it did not exist.
#[derive(Clone, Debug)]
struct Part {
    path: PathBuf,
    seen: Option<(Stamp, Content)>,
}

/// BLAKE3 hash of a file's content.
type Content = [u8; 32];

/// Hashes of files by path.
#[derive(Default)]
pub(super) struct Files(Mutex<BTreeMap<PathBuf, (Stamp, Content)>>);

impl Files {
    /// Coarser than the clock of any file system in use: a file as recent as this may change again without a new
    /// modification time.
    const SETTLED: Duration = Duration::from_secs(3);

    /// The files that a step's parameters name, in the order of the parameters. Empty parameters are left out: the
    /// kernel handles them.
    pub(super) fn of_step(&self, step: &Step<'_>, folder: &Path, cancel: &Cancel) -> Result<Vec<Stamped>, EvalError> {
        let mut found = Vec::new();
        for (parameter, value) in step.instance.params.iter() {
            let ParamValue::File(name) = value else { continue };
            if name.is_empty() {
                continue;
            }
            let path = folder.join(name);
            let fault = |path: PathBuf, error: &io::Error| match cancel.is_cancelled() {
                true => EvalError::Cancelled,
                false => unreadable(&step.instance.name, parameter, path, words(error)),
            };
            let file = match self.hash(&path, cancel) {
                Ok(seen) => Part { path, seen: Some(seen) },
                Err(error) => return Err(fault(path, &error)),
            };
            let path = companion(&file.path);
            let companion = match self.hash(&path, cancel) {
                Ok(seen) => Part { path, seen: Some(seen) },
                Err(error) if error.kind() == io::ErrorKind::NotFound => Part { path, seen: None },
                Err(error) => return Err(fault(path, &error)),
            };
            found.push(Stamped { parameter, parts: [file, companion] });
        }
        Ok(found)
    }

    fn hash(&self, path: &Path, cancel: &Cancel) -> io::Result<(Stamp, Content)> {
        let stamp = stamp(path)?;
        let known = lock(&self.0).get(path).filter(|known| known.0 == stamp).copied();
        if let Some(known) = known {
            return Ok(known);
        }
        let content = hash_content(path, cancel)?;
        if is_settled(&stamp) {
            lock(&self.0).insert(path.to_owned(), (stamp, content));
        }
        Ok((stamp, content))
    }
}

impl Stamped {
    /// The hashes of the file and of its companion.
    pub(super) fn contents(&self) -> impl Iterator<Item = Option<&Content>> {
        self.parts.iter().map(|part| part.seen.as_ref().map(|(_, content)| content))
    }

    /// Checks, after the kernel has read them, that the files are still those that were hashed.
    pub(super) fn check_unchanged(&self, node: &str) -> Result<(), EvalError> {
        for part in &self.parts {
            if stamp(&part.path).ok() != part.seen.map(|(stamp, _)| stamp) {
                let message = "it changed while it was being read; build again".to_owned();
                return Err(unreadable(node, self.parameter, part.path.clone(), message));
            }
        }
        Ok(())
    }
}

/// The path of a file's companion: the file name followed by `.json`, or `NAME.prj` of `NAME.asc`.
fn companion(path: &Path) -> PathBuf {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("asc")) {
        return path.with_extension("prj");
    }
    let mut name = path.as_os_str().to_owned();
    name.push(".json");
    PathBuf::from(name)
}

fn unreadable(node: &str, parameter: &'static str, path: PathBuf, message: String) -> EvalError {
    EvalError::File { node: node.to_owned(), parameter, path, message }
}

fn words(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".to_owned(),
        io::ErrorKind::IsADirectory => "it is a folder, not a file".to_owned(),
        io::ErrorKind::PermissionDenied => "reading it is not permitted".to_owned(),
        _ => error.to_string(),
    }
}

fn stamp(path: &Path) -> io::Result<Stamp> {
    let meta = fs::metadata(path)?;
    if meta.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if !meta.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    Ok(Stamp { modified: meta.modified()?, bytes: meta.len() })
}

#[expect(clippy::disallowed_methods, reason = "decides whether a hash is remembered, never what it is")]
fn is_settled(stamp: &Stamp) -> bool {
    SystemTime::now().duration_since(stamp.modified).is_ok_and(|age| age > Files::SETTLED)
}

fn hash_content(path: &Path, cancel: &Cancel) -> io::Result<Content> {
    let (mut file, _) = input::open(path)?;
    let mut hash = blake3::Hasher::new();
    let mut buffer = vec![0; 1 << 20];
    loop {
        if cancel.is_cancelled() {
            return Err(io::Error::other("cancelled"));
        }
        match file.read(&mut buffer) {
            Ok(0) => return Ok(*hash.finalize().as_bytes()),
            Ok(count) => hash.update(&buffer[..count]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
    }
}
