//! What dead processes have left in a folder.

use std::{
    fs::{self, File},
    io,
    path::Path,
};

use super::{
    calls::{remove_all, remove_file},
    exchange::{self, Ended},
    hold::{LOCK, PART, ending, take},
};

/// Completes the exchanges of dead processes in a folder, and removes their temporary files and folders. `own` is a
/// file that this process has created: what others have made is left alone.
///
/// # Errors
/// When an exchange can be neither completed nor undone. Other errors are ignored: what is left does no harm.
pub(super) fn sweep(folder: &Path, own: &File) -> io::Result<()> {
    let mut swept = Ok(());
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let Some(name) = entry.file_name().to_str().map(str::to_owned) else { continue };
        let path = entry.path();
        let Some(ending) = ending(&name).filter(|_| is_of_owner(&path, own)) else { continue };
        let one = match ending {
            LOCK => settle_held(folder, &path.with_extension(""), own),
            PART => {
                remove_if_dead(&path);
                Ok(())
            }
            // one without a lock: whoever holds a folder creates its lock first, and removes it last
            "" if !path.with_extension("lock").exists() => settle(folder, &path),
            _ => Ok(()),
        };
        swept = swept.and(one);
    }
    swept
}

/// Removes a file under a temporary name, if no process holds it.
pub(crate) fn remove_if_dead(path: &Path) {
    let is_part = path.file_name().and_then(|name| name.to_str()).and_then(ending) == Some(PART);
    if let Some(_held) = is_part.then(|| take(path)).flatten() {
        let _ = remove_file(path);
    }
}

/// Settles a folder whose lock no process holds, and removes the lock.
fn settle_held(folder: &Path, staging: &Path, own: &File) -> io::Result<()> {
    let lock = staging.with_extension("lock");
    let Some(_held) = take(&lock) else { return Ok(()) };
    if staging.exists() {
        if !is_of_owner(staging, own) {
            return Ok(());
        }
        settle(folder, staging)?;
    }
    if !staging.exists() {
        let _ = remove_file(&lock);
    }
    Ok(())
}

/// Completes the exchange in a temporary folder, if there is one, and removes the folder.
fn settle(folder: &Path, staging: &Path) -> io::Result<()> {
    if !fs::symlink_metadata(staging)?.is_dir() {
        return Ok(());
    }
    match exchange::resume(folder, staging)? {
        Some(Ended::Stuck { error, .. }) => return Err(error),
        Some(ended) if !ended.is_over() => {}
        // a folder that is not completely removed now is removed by the next process
        _ => drop(remove_all(staging)),
    }
    Ok(())
}

/// Returns true if a file belongs to the owner of an open one, as far as the system tells.
fn is_of_owner(path: &Path, own: &File) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let [theirs, ours] = [fs::symlink_metadata(path), own.metadata()];
        theirs.is_ok_and(|theirs| ours.is_ok_and(|ours| ours.uid() == theirs.uid()))
    }
    #[cfg(not(unix))]
    {
        let _ = (path, own);
        true
    }
}
