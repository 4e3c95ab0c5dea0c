//! Archives: their entries damaged before and after they are compressed.

use std::{
    fs,
    io::Write as _,
    path::{Path, PathBuf},
};

use flate2::{Compression, write::GzEncoder};
use orograph::files::archive::unpack_into;
use tar::{EntryType, Header};
use tempfile::TempDir;

use super::{Attack, Taken};
use crate::dice::Dice;

struct Archives {
    folder: TempDir,
    sound: Vec<u8>,
}

const NAMES: [&str; 22] = [
    "g.ron",
    "a/b.ron",
    "../evil",
    "/evil",
    "a/../../evil",
    ".git/config",
    "con",
    "a/NUL.txt",
    "C:/evil",
    "a\\b",
    "a\u{202e}b",
    "a/",
    "",
    ".",
    "G.RON",
    "a",
    "a/b.ron/c",
    "x:y",
    "é.tif",
    "a b",
    "evil/../g.ron",
    "....//evil",
];

const KINDS: [EntryType; 10] = [
    EntryType::Regular,
    EntryType::Symlink,
    EntryType::Link,
    EntryType::Directory,
    EntryType::Char,
    EntryType::Fifo,
    EntryType::GNULongName,
    EntryType::GNULongLink,
    EntryType::XHeader,
    EntryType::XGlobalHeader,
];

const PIECES: [&[u8]; 6] = [b"ustar\0", b"../", b"\0\0\0\0\0\0\0\0", b"77777777777", b"/etc/passwd", b"\x1f\x8b"];

/// An uncompressed archive.
fn tar(entries: &[(&str, EntryType, &[u8])]) -> Vec<u8> {
    let mut builder = tar::Builder::new(Vec::new());
    for (name, kind, content) in entries {
        let mut header = Header::new_ustar();
        let bytes = name.as_bytes();
        if let Some(old) = header.as_ustar_mut() {
            old.name[..bytes.len().min(100)].copy_from_slice(&bytes[..bytes.len().min(100)]);
        }
        header.set_entry_type(*kind);
        header.set_mode(0o644);
        header.set_size(content.len() as u64);
        header.set_cksum();
        // Writing to memory cannot fail.
        let _ = builder.append(&header, *content);
    }
    builder.into_inner().unwrap_or_default()
}

pub(super) fn prepare() -> Box<dyn Attack> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let sound = tar(&[("g.ron", EntryType::Regular, b"(format: 1)"), ("data/a.tif", EntryType::Regular, &[7; 700])]);
    Box::new(Archives { folder, sound })
}

impl Attack for Archives {
    fn case(&mut self, dice: &mut Dice) -> Result<Taken, String> {
        let mut bytes = if dice.one_in(2) {
            self.sound.clone()
        } else {
            let content = vec![b'x'; dice.number(..600)];
            let extra: Vec<_> =
                (0..dice.number(1..4)).map(|_| (*dice.pick(&NAMES), *dice.pick(&KINDS), &content[..])).collect();
            tar(&[&[("g.ron", EntryType::Regular, &b"(format: 1)"[..])][..], &extra].concat())
        };
        if dice.one_in(2) {
            dice.damage(&mut bytes, &PIECES);
            if dice.one_in(2) {
                mend_checksums(&mut bytes);
            }
        }
        let mut gzip = GzEncoder::new(Vec::new(), Compression::fast());
        let packed = gzip.write_all(&bytes).and_then(|()| gzip.finish());
        let mut packed = packed.map_err(|error| error.to_string())?;
        if dice.one_in(8) {
            dice.damage(&mut packed, &PIECES);
        }
        let root = self.folder.path();
        let (archive, outer) = (root.join("case.orograph"), root.join("outer"));
        let inner = outer.join("inner");
        fs::create_dir_all(&inner).and_then(|()| fs::write(&archive, packed)).map_err(|error| error.to_string())?;
        let accepted = unpack_into(&archive, &inner).is_ok();
        let fault = escaped(root, &outer, &inner);
        fs::remove_dir_all(&outer).map_err(|error| error.to_string())?;
        fault.map_or(Ok(Taken::text(accepted)), Err)
    }
}

/// Gives every header the checksum of its contents.
fn mend_checksums(tar: &mut [u8]) {
    for block in tar.as_chunks_mut::<512>().0 {
        if block[257..262] == *b"ustar" {
            block[148..156].fill(b' ');
            let sum: u32 = block.iter().map(|byte| u32::from(*byte)).sum();
            block[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
        }
    }
}

/// What an archive wrote outside of its folder, or wrote in it that is not a plain file or a folder.
fn escaped(root: &Path, outer: &Path, inner: &Path) -> Option<String> {
    let names = |folder: &Path| -> Vec<PathBuf> {
        fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
    };
    if names(root).len() != 2 || names(outer).len() != 1 {
        return Some(format!("wrote outside of its folder: {:?} {:?}", names(root), names(outer)));
    }
    let mut left = names(inner);
    while let Some(path) = left.pop() {
        let kind = fs::symlink_metadata(&path).ok()?.file_type();
        if !kind.is_dir() && !kind.is_file() {
            return Some(format!("wrote {}, which is not a file", path.display()));
        }
        if path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.')) {
            return Some(format!("wrote {}, which is hidden", path.display()));
        }
        if kind.is_dir() {
            left.extend(names(&path));
        }
    }
    None
}
