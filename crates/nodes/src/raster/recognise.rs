//! Recognising raster files by their first bytes, their length and their name.

use std::{
    io::Read as _,
    path::{Path, PathBuf},
};

use orograph_graph::input;

use super::{Problem, RasterError, Sidecar, ascii, hgt, prj, raw, reader::unreadable, sidecar_path};

/// Number of bytes from the start of a file that are looked at.
const HEAD: u64 = 4096;

/// Checks that [`read`] would take a file for a raster, without reading it whole. Returns the path of its sidecar, or
/// None if it has none.
///
/// The formats without a mark in their first bytes are recognised by the name that the file has behind all links, so
/// that a link cannot make a raster of any file.
///
/// # Errors
/// [`RasterError`] when it is not a raster file, or its sidecar is not one.
///
/// [`read`]: super::read()
pub fn recognise(path: &Path) -> Result<Option<PathBuf>, RasterError> {
    let sidecar = Sidecar::beside(path)?;
    let beside = sidecar.as_ref().map(|_| sidecar_path(path));
    if let Some(beside) = beside.as_ref().filter(|_| sidecar == Some(Sidecar::default())) {
        let what = "it says nothing about a raster".to_owned();
        return Err(Problem::Sidecar { path: beside.clone(), what }.of(path));
    }
    format(path, sidecar.as_ref()).map_err(|problem| problem.of(path))?;
    if prj::is_grid(path) {
        return prj::recognise(path);
    }
    Ok(beside)
}

/// Checks the format of a file.
fn format(path: &Path, sidecar: Option<&Sidecar>) -> Result<(), Problem> {
    let (file, meta) = input::open(path).map_err(unreadable)?;
    let mut head = Vec::new();
    file.take(HEAD).read_to_end(&mut head).map_err(unreadable)?;
    let place = path.canonicalize().map_err(unreadable)?;
    let extension = place.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match (head.as_slice(), extension.as_str()) {
        ([b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..], _)
        | ([0x89, b'P', b'N', b'G', ..] | [0x76, 0x2f, 0x31, 0x01, ..], _) => Ok(()),
        (head, "asc") if ascii::begins(head) => Ok(()),
        (_, "hgt") => hgt::side(meta.len()).map(|_| ()),
        (_, "r16" | "raw") => raw::head(meta.len(), 2, sidecar).map(|_| ()),
        (_, "r32") => raw::head(meta.len(), 4, sidecar).map(|_| ()),
        (_, "asc" | "tif" | "tiff" | "png" | "exr") => {
            Err(Problem::damaged(format!("it does not begin like a .{extension} file")))
        }
        _ => Err(Problem::UnknownFormat),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn rasters_are_recognised_and_others_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            fs::write(&path, bytes).expect("written");
            recognise(&path)
        };
        for (name, bytes) in [
            ("a.tif", &b"II*\0...."[..]),
            ("a.dat", b"MM\0*...."),
            ("a.png", b"\x89PNG...."),
            ("a.exr", b"\x76\x2f\x31\x01...."),
            ("a.asc", b"  NCOLS 3\nnrows 2"),
            ("a.hgt", &[0; 18]),
            ("a.r16", &[0; 8]),
            ("a.r32", &[0; 16]),
        ] {
            assert_eq!(file(name, bytes).expect(name), None);
        }
        for (name, bytes) in [
            ("secret", &b"root:hash"[..]),
            ("b.tif", b"root:hash"),
            ("b.asc", b"root:hash"),
            ("b.hgt", b"root:hash"),
            ("b.r16", b"root:hash"),
            ("b.exr", b""),
        ] {
            let error = file(name, bytes).expect_err(name).to_string();
            assert!(!error.contains("hash"), "{error}");
        }
        file("a.png.json", b"{\"password\": \"hash\"}").expect_err("not a raster");
        let error = recognise(&folder.path().join("a.png")).expect_err("a wrong sidecar").to_string();
        assert!(error.contains("says nothing about a raster"), "{error}");
        fs::write(folder.path().join("a.png.json"), "{\"range\": [0, 5]}").expect("written");
        let beside = recognise(&folder.path().join("a.png")).expect("a raster").expect("a sidecar");
        assert!(beside.ends_with("a.png.json"));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_does_not_make_a_raster_of_a_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let secret = folder.path().join("secret");
        fs::write(&secret, "12345678").expect("written");
        for name in ["a.r16", "a.r32", "a.asc", "a.hgt", "a.tif"] {
            let link = folder.path().join(name);
            std::os::unix::fs::symlink(&secret, &link).expect("linked");
            assert!(matches!(recognise(&link).expect_err(name).problem, Problem::UnknownFormat), "{name}");
        }
    }
}
