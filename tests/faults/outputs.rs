//! `run` and `run --sweep`: the files of one build at a time, each raster with its own side file.

use std::{collections::BTreeMap, fs, num::NonZero, path::Path};

use orograph::{
    Failure,
    build::{
        Builder,
        backend::BackendName,
        request::{Changes, Means, Request},
        storage::Storage,
    },
    export::outputs::OutputOptions,
    report::progress::Quiet,
};
use orograph_graph::{
    Cancel,
    files::{self, faults::Fault},
};
use orograph_nodes::raster::Format;

use crate::{at_each_step, fill, hidden, place, view};

type Files = BTreeMap<String, Vec<u8>>;

/// A height whose JSON file states the range of its codes, and a picture that has a JSON file only in a window.
const GRAPH: &str = r#"(
    world: (size: 1600, cells: 16),
    nodes: { "land": Perlin(wavelength: 400), "relief": Hillshade(version: 3, height: "land") },
    outputs: { "height": "land", "relief": "relief.colour" },
)"#;

pub(crate) fn builder(storage: Storage) -> Builder {
    let means = Means { backend: BackendName::Cpu, threads: NonZero::new(2), storage };
    Builder::new(&means, 1 << 20).expect("threads")
}

pub(crate) fn without_cache() -> Storage {
    Storage { no_cache: true, ..Storage::default() }
}

fn request(seed: u32) -> Request {
    let place = place();
    let path = place.path().join("g.ron");
    fs::write(&path, GRAPH).expect("written");
    let changes = Changes { seed: Some(seed), ..Changes::default() };
    Request::new(&path, &changes, &orograph_nodes::registry(), false).expect("a sound graph")
}

fn build(builder: &Builder, request: &Request, folder: &Path) -> Result<(), Failure> {
    let options = OutputOptions { format: Format::Png16, no_preview: true, ..OutputOptions::default() };
    builder.build(request, folder, &options, &Cancel::default(), &Quiet).map(drop)
}

/// The files of a build.
fn built(builder: &Builder, request: &Request) -> Files {
    let place = place();
    build(builder, request, place.path()).expect("built");
    let files = view(place.path());
    assert_eq!(files.keys().map(String::as_str).collect::<Vec<_>>(), ["height.png", "height.png.json", "relief.png"]);
    files
}

/// Every file is of one of the builds and all are of the same one, and the height has its JSON file.
#[track_caller]
fn is_of_one_build(found: &Files, builds: [&Files; 2], what: &str) {
    let is_of = |build: &&Files| found.iter().all(|(name, bytes)| build.get(name) == Some(bytes));
    assert!(builds.iter().any(is_of), "{what}: {:?}", found.keys());
    assert!(!found.contains_key("height.png") || found.contains_key("height.png.json"), "{what}: {:?}", found.keys());
}

#[test]
fn a_run_replaces_all_files_or_none() {
    let builder = builder(without_cache());
    let requests = [1, 2].map(request);
    let [mut before, after] = requests.each_ref().map(|request| built(&builder, request));
    // as of a window: it would give the new picture a wrong position
    before.insert("relief.png.json".to_owned(), b"{}".to_vec());
    for fault in Fault::ALL {
        at_each_step(
            fault,
            &|folder| fill(&folder.join("out"), &before),
            &|folder| build(&builder, &requests[1], &folder.join("out")),
            &|folder, at, ended| {
                let what = at.to_string();
                let out = folder.join("out");
                is_of_one_build(&view(&out), [&before, &after], &what);
                if ended.is_ok() {
                    assert!(view(&out) == after, "{what}");
                } else if fault == Fault::Denied || fault == Fault::Full {
                    assert!(view(&out) == before, "{what}");
                }
                files::settle(&out);
                let found = view(&out);
                assert!(found == after || ended.is_err() && found == before, "{what}: {:?}", found.keys());
                assert_eq!(hidden(&out), [""; 0], "{what}");
            },
        );
    }
}

#[test]
fn each_terrain_of_a_sweep_is_whole_or_missing() {
    let builder = builder(without_cache());
    let requests = [3, 4].map(request);
    let after = requests.each_ref().map(|request| built(&builder, request));
    let names = ["out/3", "out/4"];
    for fault in [Fault::Full, Fault::Killed, Fault::PowerLost] {
        at_each_step(
            fault,
            &|_| {},
            &|folder| {
                requests.iter().zip(names).try_for_each(|(request, name)| build(&builder, request, &folder.join(name)))
            },
            &|folder, at, ended| {
                for (name, after) in names.iter().zip(&after) {
                    let out = folder.join(name);
                    is_of_one_build(&view(&out), [after, after], &at.to_string());
                    files::settle(&out);
                    let found = view(&out);
                    assert!(found == *after || ended.is_err() && found.is_empty(), "{at}: {:?}", found.keys());
                    assert_eq!(hidden(&out), [""; 0], "{at}");
                }
            },
        );
    }
}
