//! Temporary names, and the locks by which a living process holds them.

use std::{
    fs::{self, File, TryLockError},
    hash::{BuildHasher as _, RandomState},
    io,
    path::{Path, PathBuf},
};

use super::calls::{Access, Out};
use crate::memory::Leftover;

/// The beginning of temporary names.
const PREFIX: &str = ".orograph-";

/// Number of digits of a temporary name.
const DIGITS: usize = 16;

/// The ending of a file that is not complete.
pub(super) const PART: &str = ".part";

/// The ending of the file that is locked for a folder.
pub(super) const LOCK: &str = ".lock";

/// Attempts to find a name that is free.
const TRIES: u32 = 16;

/// Creates a file under a temporary name, which is locked until it is closed. Until the returned note is dropped, the
/// file is removed if the program ends for lack of memory.
pub(super) fn hold(folder: &Path, ending: &str, access: Access) -> io::Result<(Out, PathBuf, Leftover)> {
    for _ in 0..TRIES {
        // a hasher is seeded at random
        let random = RandomState::new().hash_one(std::process::id());
        let path = folder.join(format!("{PREFIX}{random:0digits$x}{ending}", digits = DIGITS));
        // noted before it is there: creating it takes memory
        let noted = Leftover::note(&[&path], &[]);
        let out = match Out::create(&path, access) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
            out => out?,
        };
        // A process that removes leftovers may have taken it before it was locked. Without file locks, nobody can take
        // it, and it stays if the process is killed.
        if !matches!(out.file().try_lock(), Err(TryLockError::WouldBlock)) && path.exists() {
            return Ok((out, path, noted));
        }
    }
    Err(io::ErrorKind::AlreadyExists.into())
}

/// The ending of a temporary name. Returns None for any other name.
pub(super) fn ending(name: &str) -> Option<&str> {
    let (digits, ending) = name.strip_prefix(PREFIX)?.split_at_checked(DIGITS)?;
    digits.bytes().all(|digit| matches!(digit, b'0'..=b'9' | b'a'..=b'f')).then_some(ending)
}

/// Returns true if a folder is a temporary one, or in a temporary one.
pub(super) fn is_temporary(folder: &Path) -> bool {
    folder.iter().any(|part| part.to_str().is_some_and(|part| ending(part) == Some("")))
}

/// Opens a file that no process holds, which is locked then. Returns None if one does, or the system cannot tell.
pub(super) fn take(path: &Path) -> Option<File> {
    // opening a named pipe would wait, and a link leads elsewhere
    fs::symlink_metadata(path).ok().filter(fs::Metadata::is_file)?;
    let file = File::open(path).ok()?;
    file.try_lock().ok().map(|()| file)
}
