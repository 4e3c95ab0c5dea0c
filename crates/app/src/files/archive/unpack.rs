//! Unpacking an untrusted archive.

use std::{
    collections::BTreeSet,
    fs,
    io::{self, BufReader, Read as _},
    path::{Path, PathBuf},
};

use flate2::read::GzDecoder;
use orograph_graph::{
    files::{self, Access, Out, Staging},
    input,
};

use super::fault_of;
use crate::report::failure::{Failure, reason, remedy};

/// Maximum total size of the files of an archive, in bytes.
const MAX_BYTES: u64 = 4 << 30;

/// Maximum number of files in an archive.
const MAX_FILES: usize = 10_000;

/// Maximum number of bytes after the last file: the zeros with which programs fill the last block.
const MAX_REST: u64 = 1 << 20;

/// The result of unpacking.
#[derive(Debug)]
pub struct Unpacked {
    /// The graph, by its name in the folder.
    pub graph: PathBuf,
    /// Number of files.
    pub files: usize,
}

/// Unpacks an archive into a folder that does not exist yet, or is empty. The folder appears whole or not at all.
///
/// # Errors
/// When the folder is not empty, the archive is unsafe, or something cannot be written.
pub fn unpack(archive: &Path, folder: &Path) -> Result<Unpacked, Failure> {
    let unwritable = |error: &io::Error| unwritable(folder, error);
    let empty = fs::read_dir(folder).map(|mut entries| entries.next().is_none());
    if folder.exists() && !empty.unwrap_or(false) {
        return Err(Failure::wrong(format!("`{}` exists already and is not empty", folder.display()))
            .hint("name another folder with `-o`"));
    }
    let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    files::create_folders(parent, files::Access::Usual).map_err(|error| unwritable(&error))?;
    let staging = Staging::begin(parent, &[]).map_err(|error| unwritable(&error))?;
    let unpacked = unpack_into(archive, &staging.files())?;
    files::flush_all(&staging.files()).map_err(|error| unwritable(&error))?;
    if folder.exists() {
        files::remove_folder(folder).map_err(|error| unwritable(&error))?;
    }
    files::rename(&staging.files(), folder).map_err(|error| unwritable(&error))?;
    // the folder is whole under either name
    let _ = files::flush_folder(parent);
    Ok(unpacked)
}

/// Unpacks an archive into a new, empty folder.
///
/// # Errors
/// When the archive is unsafe, which leaves a part of it in the folder, or something cannot be written.
pub fn unpack_into(archive: &Path, folder: &Path) -> Result<Unpacked, Failure> {
    unpack_within(archive, folder, MAX_BYTES)
}

fn unpack_within(archive: &Path, folder: &Path, most: u64) -> Result<Unpacked, Failure> {
    let shown = archive.display();
    let refused = |what: String| {
        Failure::wrong(format!("`{shown}` cannot be unpacked: {what}"))
            .hint("it is damaged, or was not made by `orograph pack`")
    };
    let damaged = |error: io::Error| refused(format!("it is not a valid archive ({error})"));
    let (file, _) = input::open(archive)
        .map_err(|error| Failure::wrong(format!("`{shown}` cannot be read: {}", reason(&error))))?;
    // Headers and padding take at most 1 KiB a file.
    let bound = most + (MAX_FILES as u64 + 2) * 1024;
    let mut tar = tar::Archive::new(GzDecoder::new(BufReader::new(file)).take(bound));
    let (mut graph, mut names, mut folders) = (None, BTreeSet::new(), BTreeSet::new());
    let mut left = most;
    // Raw entries: long names and extended headers, which the library would read whole, are entries of their own kind.
    for entry in tar.entries().map_err(damaged)?.raw(true) {
        let mut entry = entry.map_err(damaged)?;
        let name = String::from_utf8(entry.path_bytes().into_owned())
            .map_err(|_| refused("it has a file whose name is not valid text".to_owned()))?;
        let quoted = name.escape_debug().to_string();
        if entry.header().entry_type() != tar::EntryType::Regular {
            return Err(refused(format!("`{quoted}` is not a plain file but a link, a folder, a device or a header")));
        }
        if let Some(fault) = fault_of(&name) {
            return Err(refused(format!("the name `{quoted}` {fault}")));
        }
        let lower = name.to_lowercase();
        let above: Vec<String> = lower.match_indices('/').map(|(at, _)| lower[..at].to_owned()).collect();
        if above.iter().any(|folder| names.contains(folder)) || folders.contains(&lower) || !names.insert(lower) {
            return Err(refused(format!("`{quoted}` is in it twice, or is a file and a folder")));
        }
        folders.extend(above);
        if names.len() > MAX_FILES {
            return Err(refused(format!("it has more than {MAX_FILES} files")));
        }
        let size = entry.size();
        left = left
            .checked_sub(size)
            .ok_or_else(|| refused(format!("its files are larger than {} in total", orograph_graph::bytes(most))))?;
        let target = folder.join(&name);
        let unwritable = |error: io::Error| unwritable(&target, &error);
        if let Some(parent) = target.parent() {
            files::create_folders(parent, files::Access::Usual).map_err(unwritable)?;
        }
        let mut to = Out::create(&target, Access::Usual).map_err(unwritable)?;
        if copy(&mut entry, &mut to, &damaged, &unwritable)? != size {
            return Err(refused(format!("`{quoted}` is cut off")));
        }
        graph.get_or_insert_with(|| PathBuf::from(name));
    }
    // Zeros after the last entry are ignored, but the checksum behind them must be right.
    let mut rest = tar.into_inner().take(MAX_REST + 1);
    if io::copy(&mut rest, &mut io::sink()).map_err(damaged)? > MAX_REST {
        return Err(refused("it goes on after its last file".to_owned()));
    }
    let graph = graph.ok_or_else(|| refused("there is nothing in it".to_owned()))?;
    if graph.extension().is_none_or(|extension| extension != "ron") {
        return Err(refused(format!("its first file, `{}`, is not a graph file", graph.display())));
    }
    Ok(Unpacked { graph, files: names.len() })
}

fn unwritable(path: &Path, error: &io::Error) -> Failure {
    Failure::unable(format!("cannot write `{}`: {}", path.display(), reason(error)))
        .hint(format!("{}, or choose another folder with `-o`", remedy(error)))
}

/// Copies a file; returns its size.
fn copy(
    from: &mut impl io::Read,
    to: &mut impl io::Write,
    damaged: &dyn Fn(io::Error) -> Failure,
    unwritable: &dyn Fn(io::Error) -> Failure,
) -> Result<u64, Failure> {
    let mut buffer = vec![0; 1 << 16];
    let mut copied = 0;
    loop {
        match from.read(&mut buffer) {
            Ok(0) => return Ok(copied),
            Ok(count) => {
                to.write_all(&buffer[..count]).map_err(unwritable)?;
                copied += count as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(damaged(error)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use flate2::{Compression, write::GzEncoder};
    use tar::{EntryType, Header};

    use super::*;

    /// An archive of raw entries, with names written unchanged.
    fn archive(entries: &[(&str, EntryType, &[u8])]) -> (tempfile::TempDir, PathBuf) {
        let mut tar = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::fast()));
        for (name, kind, content) in entries {
            let mut header = Header::new_ustar();
            header.as_mut_bytes()[..name.len()].copy_from_slice(name.as_bytes());
            header.set_size(content.len() as u64);
            header.set_entry_type(*kind);
            if *kind != EntryType::Regular {
                header.set_link_name("/etc/passwd").expect("short");
            }
            header.set_cksum();
            tar.append(&header, *content).expect("written");
        }
        let bytes = tar.into_inner().and_then(|gz| gz.finish()).expect("written");
        of_bytes(&bytes)
    }

    fn of_bytes(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.orograph");
        fs::write(&path, bytes).expect("written");
        (folder, path)
    }

    /// Unpacks into a nested folder, and checks that nothing else appeared.
    #[track_caller]
    fn refused(archive: &(tempfile::TempDir, PathBuf), said: &str) {
        let failure = unpack(&archive.1, &archive.0.path().join("in")).expect_err("refused");
        assert!(failure.message.contains(said), "`{said}` is not in {failure}");
        assert_eq!(fs::read_dir(archive.0.path()).expect("readable").count(), 1, "something was written");
    }

    const FILE: EntryType = EntryType::Regular;

    #[test]
    fn unsafe_archives_are_refused_and_leave_nothing() {
        for (name, said) in [
            ("../evil.ron", "leads out"),
            ("a/../../evil.ron", "leads out"),
            ("/tmp/evil.ron", "absolute"),
            ("C:/evil.ron", "character"),
            ("..\\evil.ron", "character"),
            ("a//b.ron", "empty part"),
            (".git/config", "begins with a dot"),
            ("a/.hidden", "begins with a dot"),
            ("a\u{202e}nor.b", "direction of writing"),
        ] {
            refused(&archive(&[("g.ron", FILE, b"()"), (name, FILE, b"evil")]), said);
        }
        for kind in [EntryType::Symlink, EntryType::Link, EntryType::Directory, EntryType::Fifo, EntryType::Char] {
            refused(&archive(&[("g.ron", FILE, b"()"), ("l", kind, b""), ("l/x", FILE, b"evil")]), "not a plain file");
        }
        refused(&archive(&[("g.ron", FILE, b"()"), ("a", FILE, b"1"), ("A", FILE, b"2")]), "twice");
        refused(&archive(&[("g.ron", FILE, b"()"), ("a", FILE, b"1"), ("a/b", FILE, b"2")]), "a file and a folder");
        refused(&archive(&[("g.ron", FILE, b"()"), ("a/b", FILE, b"1"), ("a", FILE, b"2")]), "a file and a folder");
        refused(&archive(&[]), "nothing in it");
        refused(&archive(&[("g.txt", FILE, b"()")]), "not a graph file");
    }

    #[test]
    fn damaged_archives_are_refused() {
        refused(&of_bytes(b""), "not a valid archive");
        refused(&of_bytes(b"( nodes: {} )"), "not a valid archive");
        let (_folder, path) = archive(&[("g.ron", FILE, &[b' '; 5000])]);
        let whole = fs::read(path).expect("readable");
        for cut in [10, whole.len() / 2, whole.len() - 9] {
            refused(&of_bytes(&whole[..cut]), "");
        }
    }

    #[test]
    fn zip_bombs_are_refused() {
        let (folder, path) = archive(&[("g.ron", FILE, b"()"), ("big", FILE, &vec![0; 1 << 20])]);
        let target = folder.path().join("in");
        fs::create_dir(&target).expect("made");
        let failure = unpack_within(&path, &target, 1 << 19).expect_err("too much");
        assert!(failure.message.contains("larger than 512.0 KiB in total"), "{failure}");

        // A header that announces missing data, and one that announces more than there can be.
        for size in [1 << 20, u64::MAX / 2] {
            let mut header = Header::new_gnu();
            header.set_path("g.ron").expect("short");
            header.set_size(size);
            header.set_cksum();
            let mut gz = GzEncoder::new(Vec::new(), Compression::fast());
            gz.write_all(header.as_bytes()).expect("written");
            gz.write_all(&[0; 512]).expect("written");
            refused(&of_bytes(&gz.finish().expect("written")), "");
        }
    }
}
