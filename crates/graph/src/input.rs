//! Opening files to read: regular files only, so that nothing waits for a pipe or reads a device without end.

use std::{
    fs::{self, File, Metadata, OpenOptions},
    io::{self, BufRead, BufReader},
    path::Path,
};

/// Bytes of a file that are compared at a time.
const PIECE: usize = 64 << 10;

/// The path is a pipe, a device or a socket.
#[derive(Debug, thiserror::Error)]
#[error("it is not a regular file but a pipe, a device or a socket")]
struct Irregular;

/// Opens a regular file, or the one that a link leads to, to read it. Never waits.
///
/// # Errors
/// The error of the system; [`io::ErrorKind::IsADirectory`] for a folder; one of [`is_irregular`] for a pipe, a device
/// or a socket.
pub fn open(path: &Path) -> io::Result<(File, Metadata)> {
    // Checked first, because opening a device can have an effect, and again after it, because the path may lead to
    // something else by then.
    regular(fs::metadata(path)?)?;
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt as _;
        options.custom_flags(libc::O_NONBLOCK | libc::O_NOCTTY);
    }
    let file = options.open(path)?;
    let metadata = regular(file.metadata()?)?;
    Ok((file, metadata))
}

/// Returns true if [`open`] refused a pipe, a device or a socket.
#[must_use]
pub fn is_irregular(error: &io::Error) -> bool {
    error.get_ref().is_some_and(|error| error.is::<Irregular>())
}

/// Returns true if two regular files have the same contents. Reads them piece by piece, up to the first difference.
///
/// # Errors
/// When one of them cannot be opened, as for [`open`], or read.
pub fn has_same_contents(one: &Path, other: &Path) -> io::Result<bool> {
    let [(one, metadata), (other, others)] = [open(one)?, open(other)?];
    if metadata.len() != others.len() {
        return Ok(false);
    }
    let [mut one, mut other] = [BufReader::with_capacity(PIECE, one), BufReader::with_capacity(PIECE, other)];
    loop {
        let (left, right) = (one.fill_buf()?, other.fill_buf()?);
        let count = left.len().min(right.len());
        if left[..count] != right[..count] {
            return Ok(false);
        }
        if count == 0 {
            // a file may have grown meanwhile
            return Ok(left.is_empty() && right.is_empty());
        }
        one.consume(count);
        other.consume(count);
    }
}

/// The metadata of a regular file.
fn regular(metadata: Metadata) -> io::Result<Metadata> {
    match metadata.file_type() {
        kind if kind.is_file() => Ok(metadata),
        kind if kind.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        _ => Err(io::Error::other(Irregular)),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use super::*;

    #[test]
    fn only_regular_files_are_opened() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("file");
        fs::write(&file, "text").expect("written");
        let (mut opened, metadata) = open(&file).expect("a regular file");
        let mut text = String::new();
        opened.read_to_string(&mut text).expect("readable");
        assert_eq!((text.as_str(), metadata.len()), ("text", 4));
        let kind = |path: &Path| open(path).expect_err("not a regular file").kind();
        assert_eq!(kind(folder.path()), io::ErrorKind::IsADirectory);
        assert_eq!(kind(&folder.path().join("none")), io::ErrorKind::NotFound);
    }

    #[test]
    fn files_are_compared_by_their_contents() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            fs::write(&path, bytes).expect("written");
            path
        };
        let mut bytes = vec![7; 3 * PIECE + 5];
        let [one, same] = ["one", "same"].map(|name| file(name, &bytes));
        let shorter = file("shorter", &bytes[1..]);
        *bytes.last_mut().expect("a byte") = 8;
        let other = file("other", &bytes);
        let [none, empty] = [file("none", &[]), file("empty", &[])];
        let is_same = |left, right| has_same_contents(left, right).expect("readable");
        assert!(is_same(&one, &same) && is_same(&none, &empty));
        assert!(!is_same(&one, &shorter) && !is_same(&one, &other) && !is_same(&one, &none));
        assert!(has_same_contents(&one, &folder.path().join("missing")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_refused_at_once_through_links_too() {
        let folder = tempfile::tempdir().expect("a folder");
        let (pipe, link) = (folder.path().join("pipe"), folder.path().join("link"));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
        std::os::unix::fs::symlink(&pipe, &link).expect("linked");
        for path in [pipe.as_path(), &link, Path::new("/dev/zero"), Path::new("/dev/null")] {
            let error = open(path).expect_err("not a regular file");
            assert!(is_irregular(&error), "{path:?}: {error}");
        }
    }
}
