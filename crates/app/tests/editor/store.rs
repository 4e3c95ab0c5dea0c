//! Exports and the next start of the program reuse results.

use std::{path::Path, sync::Arc, time::Duration};

use orograph::{
    build::{
        Builder,
        request::{Changes, Request},
    },
    editor::Session,
    export::outputs::OutputOptions,
    report::progress::Quiet,
};
use orograph_graph::{Cancel, Edit, Origin, Store, StoreFolder, Trust};

use crate::{scratch, wait};

const LAND: &str = r#"(
    world: (size: "4 km", cells: 200),
    nodes: {
        "hills": Ridged(wavelength: "2 km"),
        "rivers": StreamPower(height: "hills", duration: "10 kyr"),
        "steep": Slope(height: "rivers"),
    },
    outputs: { "height": "rivers", "area": "rivers.area", "slope": "steep" },
)"#;

fn store(folder: &Path) -> Arc<Store> {
    let place =
        StoreFolder { folder: folder.to_owned(), budget: 1 << 30, worth: Duration::from_secs(3600), trust: Trust::Own };
    Arc::new(Store::new(1 << 28, Some(place)))
}

fn session(file: &Path, store: Arc<Store>) -> Session {
    let mut session =
        Session::open(Some(file.to_owned()), orograph_nodes::registry(), store, || {}).expect("the file can be read");
    session.set_cells(200);
    settle(&mut session);
    session
}

fn settle(session: &mut Session) {
    wait("all is built", || {
        session.poll();
        !session.is_busy()
    });
}

/// The nodes whose kernels have run.
fn computed(session: &Session) -> Vec<&'static str> {
    ["hills", "rivers", "steep"].into_iter().filter(|node| session.node(node).time.is_some()).collect()
}

#[test]
fn an_export_and_a_restart_reuse_shown_results() {
    let folder = scratch(LAND);
    let (file, kept) = (folder.path().join("graph.ron"), folder.path().join("kept"));
    let mut first = session(&file, store(&kept));
    assert_eq!(computed(&first), ["hills", "rivers", "steep"]);
    assert_eq!(first.shown().as_deref(), Some("rivers.height"));

    // the shown height, and the drainage area from the same kernel
    let request = Request::of_document(first.document().clone(), &Changes::default()).expect("a request");
    let request = request.only(&["height".to_owned(), "area".to_owned()]).expect("outputs");
    let builder = Builder::sharing(Arc::clone(first.evaluator()));
    let out = folder.path().join("out");
    let built = builder.build(&request, &out, &OutputOptions::default(), &Cancel::default(), &Quiet).expect("built");
    let origins: Vec<_> = built.timings.iter().map(|timing| (timing.name.as_str(), timing.origin)).collect();
    assert_eq!(origins, [("rivers", Origin::Memory)]);
    assert!(out.join("height.exr").is_file() && out.join("area.exr").is_file());

    // an edit of the last node runs only the last node
    let text = "central".to_owned();
    assert!(first.apply(&Edit::SetText { node: "steep".into(), name: "method".into(), text }));
    settle(&mut first);
    assert!(first.undo());
    settle(&mut first);

    // the results of the session are written when it ends; the next session finds them
    drop(first);
    let second = session(&file, store(&kept));
    assert_eq!(computed(&second), [""; 0]);
    let built = second.built("rivers.height").expect("shown");
    assert_eq!(built.cells, 200, "at full resolution");
}
