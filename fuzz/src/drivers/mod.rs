//! What is given damaged input.

mod archive;
mod cache;
mod graph;
mod journal;
mod raster;
mod setting;

use std::path::{Path, PathBuf};

use crate::dice::Dice;

/// A reader and the input for it.
#[derive(Debug)]
pub struct Driver {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it reads.
    pub about: &'static str,
    /// Each case counts as so many, because it damages as many files.
    pub files: u64,
    /// Prepares for any number of cases.
    pub prepare: fn() -> Box<dyn Attack>,
}

/// The cases of a driver.
pub trait Attack {
    /// Runs a case.
    ///
    /// # Errors
    /// What went wrong. That the program refuses the input is no error.
    fn case(&mut self, dice: &mut Dice) -> Result<Taken, String>;
}

/// What became of an input that did no harm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Taken {
    /// Whether the program accepted it as valid.
    pub accepted: bool,
    /// Number of cells that the program needs for it.
    pub cells: usize,
}

impl Taken {
    /// Input that needs no cells.
    const fn text(accepted: bool) -> Self {
        Self { accepted, cells: 0 }
    }
}

/// All drivers.
pub static ALL: [Driver; 6] = [
    Driver { name: "graph", about: "graph files, edits, undo and redo", files: 1, prepare: graph::prepare },
    Driver {
        name: "raster",
        about: "imports of every raster format, of sidecars, GeoJSON and SVG",
        files: 1,
        prepare: raster::prepare,
    },
    Driver { name: "archive", about: "archives", files: 1, prepare: archive::prepare },
    Driver { name: "journal", about: "journals of the editor", files: 1, prepare: journal::prepare },
    Driver { name: "cache", about: "stored results", files: 10, prepare: cache::prepare },
    Driver { name: "setting", about: "--set, --sweep, --cells and --window", files: 1, prepare: setting::prepare },
];

/// The driver with a name.
pub fn find(name: &str) -> Result<&'static Driver, String> {
    let names = || ALL.iter().map(|driver| driver.name).collect::<Vec<_>>().join(", ");
    ALL.iter().find(|driver| driver.name == name).ok_or_else(|| format!("there are the drivers {}", names()))
}

/// The root of the project.
fn project() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// The files of a folder of the project with one of some extensions, in order of their names.
///
/// # Panics
/// When there is none.
fn files(folder: &str, endings: &[&str]) -> Vec<(PathBuf, Vec<u8>)> {
    let listed = std::fs::read_dir(project().join(folder)).expect("a folder of the project");
    let mut paths: Vec<PathBuf> = listed.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| endings.iter().any(|wanted| ending == *wanted)));
    paths.sort();
    assert!(!paths.is_empty(), "there are files in {folder}");
    paths.into_iter().map(|path| (path.clone(), std::fs::read(&path).expect("a readable file"))).collect()
}

/// The graph files of the project.
fn graphs() -> Vec<String> {
    files("graphs", &["ron"]).into_iter().map(|(_, bytes)| String::from_utf8_lossy(&bytes).into_owned()).collect()
}

/// Pieces of the notation of graph files.
const PIECES: [&[u8]; 40] = [
    b"(",
    b")",
    b"[",
    b"]",
    b"{",
    b"}",
    b":",
    b",",
    b"\"",
    b"'",
    b"//",
    b"/*",
    b"*/",
    b"\n",
    b"\r\n",
    b"\\",
    b"r#\"",
    b"\"#",
    b"-",
    b"1e999",
    b"NaN",
    b"-inf",
    b"0x",
    b"\"a\"",
    b"\"a.b\"",
    b"\"2 km\"",
    b"nodes",
    b"outputs",
    b"world",
    b"expect",
    b"layout",
    b"format",
    b"cells: 99999999999",
    b"version: 2",
    b"Ridged",
    b"Subgraph(file: \"a.ron\")",
    b"\xef\xbb\xbf",
    b"\0",
    b"\xe2\x80\xae",
    b"((((((((((((((((",
];
