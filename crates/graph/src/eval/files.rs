//! The content of the files that nodes read, hashed once as long as they stay as they are.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::{self, Read as _},
    path::{Path, PathBuf},
    sync::Mutex,
    time::{Duration, SystemTime},
};

use super::{error::EvalError, event::lock, plan::Step};
use crate::{job::Cancel, param::ParamValue};

/// What tells a changed file from an unchanged one without reading it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Stamp {
    modified: SystemTime,
    bytes: u64,
}

/// A file as it was when it was hashed.
#[derive(Clone, Debug)]
pub(super) struct Stamped {
    parameter: &'static str,
    path: PathBuf,
    stamp: Stamp,
    /// BLAKE3 hash of its content.
    pub(super) content: [u8; 32],
}

/// Hashes of files by path.
#[derive(Default)]
pub(super) struct Files(Mutex<BTreeMap<PathBuf, (Stamp, [u8; 32])>>);

impl Files {
    /// Coarser than the clock of any file system in use: a file as young as this may change once more without its
    /// time of modification changing.
    const SETTLED: Duration = Duration::from_secs(3);

    /// The files that a step's parameters name, in the order of the parameters. A parameter that names none is left
    /// out: the kernel says what it makes of that.
    pub(super) fn of_step(&self, step: &Step<'_>, folder: &Path, cancel: &Cancel) -> Result<Vec<Stamped>, EvalError> {
        let mut found = Vec::new();
        for (parameter, value) in step.instance.params.iter() {
            let ParamValue::File(name) = value else { continue };
            if name.is_empty() {
                continue;
            }
            let path = folder.join(name);
            match self.hash(parameter, &path, cancel) {
                Ok(file) => found.push(file),
                Err(_) if cancel.is_cancelled() => return Err(EvalError::Cancelled),
                Err(error) => return Err(unreadable(&step.instance.name, parameter, path, words(&error))),
            }
        }
        Ok(found)
    }

    fn hash(&self, parameter: &'static str, path: &Path, cancel: &Cancel) -> io::Result<Stamped> {
        let stamp = stamp(path)?;
        let known = lock(&self.0).get(path).filter(|known| known.0 == stamp).map(|known| known.1);
        let content = match known {
            Some(content) => content,
            None => {
                let content = hash_content(path, cancel)?;
                if is_settled(&stamp) {
                    lock(&self.0).insert(path.to_owned(), (stamp, content));
                }
                content
            }
        };
        Ok(Stamped { parameter, path: path.to_owned(), stamp, content })
    }
}

impl Stamped {
    /// Checks, after the kernel has read it, that the file is still the one that was hashed.
    pub(super) fn check_unchanged(&self, node: &str) -> Result<(), EvalError> {
        match stamp(&self.path) {
            Ok(stamp) if stamp == self.stamp => Ok(()),
            _ => {
                let message = "it changed while it was being read; build again".to_owned();
                Err(unreadable(node, self.parameter, self.path.clone(), message))
            }
        }
    }
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

fn hash_content(path: &Path, cancel: &Cancel) -> io::Result<[u8; 32]> {
    let mut file = File::open(path)?;
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
