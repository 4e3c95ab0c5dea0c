//! Whose results the disk cache reads: by default only those of the user who runs the program, since a stored result
//! can be forged by whoever may write it. Systems without Unix owners protect the folder themselves.

use std::{
    fs::{self, File},
    io,
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
};

use crate::input;

/// The users whose results are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trust {
    /// Only the user who runs the program, from a folder into which not everyone may write.
    #[default]
    Own,
    /// Everyone who can write to the folder.
    Anyone,
}

/// Decides whether files are read, and complains about the first one that is not.
#[derive(Debug)]
pub(super) struct Guard {
    trust: Trust,
    user: Option<u32>,
    complained: AtomicBool,
}

impl Guard {
    pub(super) fn new(trust: Trust) -> Self {
        Self { trust, user: user(), complained: AtomicBool::new(false) }
    }

    /// Opens a file for reading.
    ///
    /// # Errors
    /// `None` when the file cannot be opened; a message when another user owns it, but only once.
    pub(super) fn open(&self, path: &Path) -> Result<File, Option<String>> {
        let (file, meta) = input::open(path).map_err(|_| None)?;
        if self.trust == Trust::Anyone || owner(&meta) == self.user {
            return Ok(file);
        }
        let is_first = !self.complained.swap(true, Ordering::Relaxed);
        Err(is_first.then(|| {
            format!("{} belongs to another user, as do perhaps more; `--cache-trust` accepts them", path.display())
        }))
    }
}

/// Why no result in a folder is read or written. Returns None when there is no reason, or no folder.
pub(super) fn refusal(folder: &Path, trust: Trust) -> Option<io::Error> {
    let meta = folder.metadata().ok().filter(|_| trust == Trust::Own)?;
    let fault = if owner(&meta) != user() {
        "the folder belongs to another user"
    } else if is_open_to_all(&meta) {
        "everyone may write to the folder"
    } else {
        return None;
    };
    Some(io::Error::other(format!("{fault}, who could change results; `--cache-trust` accepts that")))
}

/// The user who runs the program, where files have such owners.
#[cfg(unix)]
fn user() -> Option<u32> {
    Some(rustix::process::geteuid().as_raw())
}

#[cfg(unix)]
fn owner(meta: &fs::Metadata) -> Option<u32> {
    Some(std::os::unix::fs::MetadataExt::uid(meta))
}

#[cfg(unix)]
fn is_open_to_all(meta: &fs::Metadata) -> bool {
    std::os::unix::fs::MetadataExt::mode(meta) & 0o002 != 0
}

#[cfg(not(unix))]
const fn user() -> Option<u32> {
    None
}

#[cfg(not(unix))]
const fn owner(_: &fs::Metadata) -> Option<u32> {
    None
}

#[cfg(not(unix))]
const fn is_open_to_all(_: &fs::Metadata) -> bool {
    false
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::files::{self, Access};

    #[test]
    fn files_of_others_are_opened_only_on_trust() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("result");
        assert_eq!(Guard::new(Trust::Own).open(&path).expect_err("there is none"), None);
        fs::write(&path, "a result").expect("written");
        assert!(Guard::new(Trust::Own).open(&path).is_ok());
        let other = |trust| Guard { user: user().map(|user| user + 1), ..Guard::new(trust) };
        assert!(other(Trust::Anyone).open(&path).is_ok());
        let guard = other(Trust::Own);
        let first = guard.open(&path).expect_err("of another user").expect("a message");
        assert!(first.contains("another user") && first.contains("--cache-trust"), "{first}");
        assert_eq!(guard.open(&path).expect_err("of another user"), None, "one warning is enough");
    }

    #[test]
    fn folders_open_to_all_are_refused() {
        let scratch = tempfile::tempdir().expect("a folder");
        let path = scratch.path().join("a/b");
        assert!(refusal(&path, Trust::Own).is_none(), "it does not exist");
        files::create_folders(&path, Access::Private).expect("created");
        assert!(refusal(&path, Trust::Own).is_none());
        fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o777)).expect("set");
        let said = refusal(&path, Trust::Own).expect("refused").to_string();
        assert!(said.contains("everyone may write") && said.contains("--cache-trust"), "{said}");
        assert!(refusal(&path, Trust::Anyone).is_none());
    }
}
