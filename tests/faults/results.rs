//! The folder of results: a fault never changes what is built, and what is left is removed.

use std::{fs, path::Path};

use orograph::{
    build::{
        request::{Changes, Request},
        storage::Storage,
    },
    report::progress::Quiet,
};
use orograph_graph::{Cancel, Value, files::faults::Fault};

use crate::{
    At, Ended, at_each_step, hidden,
    outputs::{builder, without_cache},
    place,
};

const GRAPH: &str = r#"(
    world: (size: 1600, cells: 16),
    nodes: { "land": Perlin(wavelength: 400), "flow": Flow(height: "land"), "rivers": Rivers(flow: "flow.flow") },
    outputs: { "area": "flow.area", "rivers": "rivers.lines" },
)"#;

fn values(request: &Request, storage: Storage) -> Vec<Value> {
    let ports: Vec<_> = request.outputs.iter().map(|output| output.port).collect();
    builder(storage).evaluate(request, &ports, &Cancel::default(), &Quiet).expect("computed").0
}

#[test]
fn results_do_not_depend_on_the_disk() {
    let place = place();
    let path = place.path().join("g.ron");
    fs::write(&path, GRAPH).expect("written");
    let request = Request::new(&path, &Changes::default(), &orograph_nodes::registry(), false).expect("a sound graph");
    let expected = values(&request, without_cache());
    let cached = |folder: &Path| Storage { cache: Some(folder.join("cache")), ..Storage::default() };
    for fault in Fault::ALL {
        let check = |folder: &Path, at: At, _: &Ended| {
            // damaged results are recognized, and files of dead processes are removed
            assert!(values(&request, cached(folder)) == expected, "{at}");
            let place = cached(folder).folder().expect("a folder").expect("it is on");
            place.usage().expect("counted");
            for shard in fs::read_dir(&place.folder).expect("a folder").map(|shard| shard.expect("an entry").path()) {
                assert_eq!(hidden(&shard), [""; 0], "{at}");
            }
        };
        let run = |folder: &Path| {
            assert!(values(&request, cached(folder)) == expected, "{fault:?}");
            Ok(())
        };
        at_each_step(fault, &|_| {}, &run, &check);
    }
}
