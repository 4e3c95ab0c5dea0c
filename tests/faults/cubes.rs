//! `run --cube`: a cube that was interrupted at any step is continued by the same command to the same bytes.

use std::{fs, path::Path};

use orograph::{
    Failure,
    build::{
        Builder,
        request::{Changes, Request},
    },
    export::cube::{Axis, Cube, Plan},
    report::progress::Quiet,
};
use orograph_graph::{Cancel, files::faults::Fault};

use crate::{
    at_each_step, hidden,
    outputs::{builder, without_cache},
    place, view,
};

const GRAPH: &str = r#"(
    world: (size: 1600, cells: 8, place: (epsg: 32611, corner: ("378 km", "3812 km"))),
    nodes: { "land": Perlin(wavelength: 400) },
    outputs: { "height": "land" },
)"#;
const SEEDS: [u32; 2] = [3, 4];

fn requests() -> [Request; 2] {
    let place = place();
    let path = place.path().join("g.ron");
    fs::write(&path, GRAPH).expect("written");
    SEEDS.map(|seed| {
        let changes = Changes { seed: Some(seed), ..Changes::default() };
        Request::new(&path, &changes, &orograph_nodes::registry(), false).expect("a sound graph")
    })
}

fn plan(request: &Request) -> Plan {
    Plan {
        axes: vec![Axis { name: "seed".to_owned(), values: SEEDS.map(|seed| seed.to_string()).to_vec() }],
        outputs: request.outputs.clone(),
        window: request.window(),
        attributes: serde_json::Map::new(),
        quantiles: vec![0.5],
        thresholds: vec![("height".to_owned(), 0.0)],
    }
}

/// Builds what is missing; returns the number of terrains that were built.
fn build(builder: &Builder, requests: &[Request; 2], folder: &Path) -> Result<usize, Failure> {
    let cube = Cube::open(&folder.join("g.zarr"), plan(&requests[0]))?;
    let mut built = 0;
    for (member, request) in requests.iter().enumerate().filter(|(member, _)| !cube.is_complete(*member)) {
        builder.build_member(request, &cube, member, &Cancel::default(), &Quiet)?;
        built += 1;
    }
    cube.finish(&Cancel::default())?;
    Ok(built)
}

#[test]
fn an_interrupted_cube_is_continued_to_the_same_bytes() {
    let (builder, requests) = (builder(without_cache()), requests());
    let whole = place();
    assert_eq!(build(&builder, &requests, whole.path()), Ok(2));
    let whole = view(whole.path());
    assert!(whole.contains_key("g.zarr/height/c.1.0.0") && whole.contains_key("g.zarr/height_quantile/c.0.0.0"));
    for fault in Fault::ALL {
        at_each_step(fault, &|_| {}, &|folder| build(&builder, &requests, folder).map(drop), &|folder, at, ended| {
            let before = view(folder);
            assert!(ended.is_err() || before == whole, "{at}");
            assert!(before.iter().all(|(name, bytes)| whole.get(name) == Some(bytes)), "{at}: a torn file");
            let chunks = before.keys().filter(|name| name.starts_with("g.zarr/height/c.")).count();
            assert_eq!(build(&builder, &requests, folder), Ok(SEEDS.len() - chunks), "{at}");
            assert!(view(folder) == whole, "{at}");
            assert_eq!(hidden(&folder.join("g.zarr/height")), [""; 0], "{at}");
        });
    }
}
