//! Tests of copies of examples and archives, which have no file. They find the files that they read, even after a
//! crash.

use std::{
    fs,
    path::{Path, PathBuf},
};

use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::{
    editor::{App, FileCommand, Journals, NodeState, Question, Session},
    files::archive,
};
use orograph_graph::{Document, Edit};

use crate::{graph, settle};

fn kept(file: Option<PathBuf>, state: &Path) -> Harness<'static, App> {
    let state = state.to_owned();
    crate::harness([1000.0, 700.0]).build_eframe(move |context| {
        App::new(context, file, orograph::build::storage::in_memory())
            .expect("the file can be read")
            .kept(context, Journals::with_state(&state))
    })
}

fn add(session: &mut Session) {
    assert!(session.apply(&Edit::AddNode { name: "new".into(), kind: "Constant".into(), at: None }));
}

/// Simulates a crash and a start without a file; recovers the work and returns the new window.
fn crash_and_take_up(window: Harness<'_, App>, state: &Path) -> Harness<'static, App> {
    let source = window.state().session().document().source().to_owned();
    drop(window);
    let mut window = kept(None, state);
    window.run_steps(4);
    window.get_by_label("Work on Untitled was not saved");
    window.get_by_label("Recover").click();
    window.run_steps(4);
    assert_eq!(window.state().session().document().source(), source);
    window
}

/// Checks that the files that the graph reads exist, and that a node can be built.
#[track_caller]
fn is_whole(window: &mut Harness<'_, App>, node: &str) {
    window.state_mut().session_mut().set_cells(32);
    settle(window);
    let session = window.state().session();
    assert_eq!(session.document().problems(), []);
    assert!(!session.document().files().is_empty() && session.document().files().iter().all(|file| file.is_file()));
    assert_eq!(session.node(node).state, NodeState::Fresh);
}

/// An archive of a graph that reads another, which reads a raster beside it, with the heights of its codes in a side file.
fn packed(folder: &Path) -> PathBuf {
    fs::create_dir_all(folder.join("parts/data")).expect("made");
    for (from, to) in [("glencoe_48x64_u16.png", "land.png"), ("glencoe_48x64_u16.png.json", "land.png.json")] {
        fs::copy(graph(&format!("../tests/data/{from}")), folder.join("parts/data").join(to)).expect("copied");
    }
    let part = r#"(nodes: { "dem": Import(file: "data/land.png") }, outputs: { "height": "dem" })"#;
    fs::write(folder.join("parts/dem.ron"), part).expect("written");
    let text = r#"(world: (cells: 32), nodes: { "a": Subgraph(file: "parts/dem.ron") }, outputs: { "height": "a" })"#;
    let path = folder.join("packed.ron");
    fs::write(&path, text).expect("written");
    let document = Document::load(&path, &orograph_nodes::registry()).expect("readable");
    let archive = folder.join("packed.orograph");
    archive::pack(&document, &path, &archive, false).expect("packed");
    archive
}

#[test]
fn a_copy_of_an_archive_survives_a_crash_with_its_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let state = folder.path().join("state");
    let archive = packed(&folder.path().join("far"));
    let mut window = kept(Some(archive), &state);
    window.run_steps(2);
    is_whole(&mut window, "a");
    let unpacked = window.state().session().document().folder().to_owned();
    add(window.state_mut().session_mut());
    let mut window = crash_and_take_up(window, &state);
    is_whole(&mut window, "a");
    assert_eq!(window.state().session().document().folder(), unpacked);
    // After saving, all its files are beside it, under the same names.
    let home = folder.path().join("home");
    fs::create_dir(&home).expect("made");
    let source = window.state().session().document().source().to_owned();
    assert!(window.state_mut().session_mut().save_as(&home.join("mine.ron")));
    assert_eq!(fs::read_to_string(home.join("mine.ron")).expect("there"), source);
    assert!(!unpacked.exists(), "nothing is left behind");
    is_whole(&mut window, "a");
    assert!(window.state().session().document().files().iter().all(|file| file.starts_with(&home)));
    assert!(home.join("parts/data/land.png.json").is_file(), "without it, codes would have other heights");
}

#[test]
fn discarding_work_deletes_the_files_of_its_archive() {
    let folder = tempfile::tempdir().expect("a folder");
    let state = folder.path().join("state");
    let archive = packed(&folder.path().join("far"));
    let open = |file: Option<PathBuf>| {
        let mut session = Session::open(file, orograph_nodes::registry(), orograph::build::storage::in_memory(), || {})
            .expect("it can be read");
        session.keep(Journals::with_state(&state), || {});
        session
    };
    let looked_at = open(Some(archive.clone()));
    let unpacked = looked_at.document().folder().to_owned();
    assert!(unpacked.exists());
    drop(looked_at);
    assert!(!unpacked.exists());
    let mut worked_on = open(Some(archive.clone()));
    let unpacked = worked_on.document().folder().to_owned();
    add(&mut worked_on);
    drop(worked_on);
    // Another window neither uses nor deletes files that wait for recovery.
    drop(open(Some(archive)));
    assert!(unpacked.exists());
    let mut later = open(None);
    assert!(matches!(later.question(), Some(Question::Found(_))));
    later.answer(orograph::editor::Answer::Discard);
    assert!(!unpacked.exists());
}

#[test]
fn a_copy_of_an_example_survives_a_crash_with_its_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let state = folder.path().join("state");
    let mut window = kept(None, &state);
    window.run_steps(2);
    window.get_by_label("File").click();
    window.run_steps(3);
    window.get_by_label_contains("Examples").click();
    window.run_steps(4);
    window.query_all_by_label("A real landscape, eroded further").next().expect("offered").click();
    window.run_steps(4);
    add(window.state_mut().session_mut());
    let mut window = crash_and_take_up(window, &state);
    is_whole(&mut window, "new");
    // If a file of the same name exists, the copies go to a new folder.
    fs::create_dir(folder.path().join("data")).expect("made");
    let other = folder.path().join("data/bigtujunga_512_30m.tif");
    fs::write(&other, "something else").expect("written");
    assert!(window.state_mut().session_mut().save_as(&folder.path().join("mine")));
    let session = window.state_mut().session_mut();
    assert!(session.document().source().contains("mine_files/data/bigtujunga_512_30m.tif"));
    assert!(session.document().files().iter().all(|file| file.is_file() && file.starts_with(folder.path())));
    assert_eq!(fs::read_to_string(other).expect("there"), "something else");
    assert!(session.take_notes().iter().any(|note| note.message.contains("were saved with it")));
    session.request(FileCommand::Close);
    assert!(session.is_over());
}
