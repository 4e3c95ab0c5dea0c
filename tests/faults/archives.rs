//! `pack` and `unpack`: an archive or a folder is whole, or as it was.

use std::{collections::BTreeMap, fs, path::Path};

use orograph::files::archive::{pack, unpack};
use orograph_graph::{
    Document,
    files::{self, faults::Fault},
};

use crate::{at_each_step, fill, hidden, place, view};

const GRAPH: &str = r#"(
    nodes: { "land": Subgraph(file: "lib/land.ron") },
    outputs: { "height": "land" },
    world: (cells: 16),
)"#;

const INNER: &str = r#"(nodes: { "land": Perlin() }, outputs: { "height": "land" })"#;

fn graph() -> BTreeMap<String, Vec<u8>> {
    [("g.ron", GRAPH), ("lib/land.ron", INNER)].map(|(name, text)| (name.to_owned(), text.into())).into()
}

fn pack_in(folder: &Path) -> Result<(), orograph::Failure> {
    let path = folder.join("g.ron");
    let document = Document::load(&path, &orograph_nodes::registry()).expect("a graph");
    pack(&document, &path, &folder.join("g.orograph"), false).map(drop)
}

#[test]
fn an_archive_is_whole_or_as_it_was() {
    let first = place();
    fill(first.path(), &graph());
    pack_in(first.path()).expect("packed");
    let after = fs::read(first.path().join("g.orograph")).expect("there");
    for fault in Fault::ALL {
        at_each_step(
            fault,
            &|folder| {
                fill(folder, &graph());
                fs::write(folder.join("g.orograph"), "before").expect("written");
            },
            &pack_in,
            &|folder, at, ended| {
                let found = fs::read(folder.join("g.orograph")).expect("there");
                assert!(found == after || ended.is_err() && found == b"before", "{at}");
                files::settle(folder);
                assert_eq!(hidden(folder), [""; 0], "{at}");
            },
        );
    }
}

#[test]
fn an_unpacked_folder_is_whole_or_missing() {
    let first = place();
    fill(first.path(), &graph());
    pack_in(first.path()).expect("packed");
    let archive = first.path().join("g.orograph");
    for fault in Fault::ALL {
        at_each_step(
            fault,
            &|_| {},
            &|folder| unpack(&archive, &folder.join("in/g")).map(drop),
            &|folder, at, ended| {
                let found = view(&folder.join("in/g"));
                assert!(found == graph() || ended.is_err() && found.is_empty(), "{at}: {:?}", found.keys());
                files::settle(&folder.join("in"));
                assert_eq!(hidden(&folder.join("in")), [""; 0], "{at}");
            },
        );
    }
}
