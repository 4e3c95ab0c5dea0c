//! Tests of saving and opening files, and of the questions that prevent losing work.

use std::{fs, path::Path};

use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable as _;
use orograph::editor::{Answer, FileCommand, Question, Session};
use orograph_graph::Edit;

use crate::hand::type_text;

/// A text with comments and an unusual order.
pub(crate) const HILLS: &str = "// Two hills.\n(\n    nodes: {\n        \"b\": Perlin(octaves: 3), // low\n        \
                     \"a\": Perlin,\n    },\n    outputs: { \"height\": \"b\" },\n)\n";

pub(crate) fn session(file: Option<&Path>) -> Session {
    Session::open(file.map(Path::to_owned), orograph_nodes::registry(), orograph::build::storage::in_memory(), || {})
        .expect("the file can be read")
}

pub(crate) fn octaves(count: &str) -> Edit {
    Edit::SetText { node: "b".into(), name: "octaves".into(), text: count.into() }
}

pub(crate) fn hills() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("hills.ron");
    fs::write(&file, HILLS).expect("written");
    (folder, file)
}

pub(crate) fn text(file: &Path) -> String {
    fs::read_to_string(file).expect("a text")
}

#[test]
fn saving_changes_only_what_was_edited() {
    let (_folder, file) = hills();
    let mut session = session(Some(&file));
    assert!(!session.is_dirty());
    assert!(session.apply(&octaves("5")));
    assert!(session.is_dirty());
    assert!(session.save());
    assert!(!session.is_dirty());
    assert_eq!(text(&file), HILLS.replace("octaves: 3", "octaves: 5"));
    assert!(session.undo() && session.is_dirty(), "undo goes back behind the save");
    assert!(session.save());
    assert_eq!(text(&file), HILLS);
}

#[test]
fn changes_by_other_programs_are_not_overwritten() {
    let (_folder, file) = hills();
    let mut session = session(Some(&file));
    session.apply(&octaves("5"));
    let theirs = HILLS.replace("octaves: 3", "octaves: 7");
    fs::write(&file, &theirs).expect("written");
    let asked = |saving| Question::Changed { theirs: theirs.clone(), conflicts: vec!["b.octaves".to_owned()], saving };
    assert!(!session.save());
    assert_eq!(session.question(), Some(&asked(true)));
    assert_eq!(text(&file), theirs);
    session.answer(Answer::Cancel);
    assert!(!session.save(), "asked again");
    session.answer(Answer::TakeTheirs);
    assert_eq!(session.document().source(), theirs);
    assert!(!session.is_dirty());
    assert!(session.undo());
    assert_eq!(session.document().source(), HILLS.replace("octaves: 3", "octaves: 5"));
    assert!(session.save(), "its text is known now");
    assert_eq!(text(&file), HILLS.replace("octaves: 3", "octaves: 5"));
    // Keep the work.
    session.apply(&octaves("6"));
    fs::write(&file, &theirs).expect("written");
    assert!(!session.save());
    session.answer(Answer::KeepMine);
    assert!(!session.is_dirty());
    assert_eq!(text(&file), HILLS.replace("octaves: 3", "octaves: 6"));
}

#[test]
fn changes_without_conflicts_are_merged_and_saved() {
    let (_folder, file) = hills();
    let mut session = session(Some(&file));
    session.apply(&octaves("5"));
    fs::write(&file, HILLS.replace("low", "lower")).expect("written");
    assert!(session.save());
    assert_eq!(text(&file), HILLS.replace("low", "lower").replace("octaves: 3", "octaves: 5"));
    assert!(session.undo(), "their change is a step");
    assert_eq!(session.document().source(), HILLS.replace("octaves: 3", "octaves: 5"));
}

#[test]
fn saving_under_a_new_name_asks_nothing_and_updates_file_paths() {
    let (folder, file) = hills();
    fs::create_dir(folder.path().join("maps")).expect("made");
    fs::write(folder.path().join("maps/a.png"), "").expect("written");
    fs::create_dir(folder.path().join("copies")).expect("made");
    let source = HILLS.replace("\"a\": Perlin,", "\"a\": Import(version: 2, file: \"maps/a.png\"),");
    fs::write(&file, &source).expect("written");
    let mut session = session(Some(&file));
    session.apply(&octaves("5"));
    assert!(session.save_as(&folder.path().join("copies/other")));
    let copy = folder.path().join("copies/other.ron");
    assert_eq!(session.path(), Some(copy.as_path()));
    assert_eq!(text(&copy), source.replace("octaves: 3", "octaves: 5").replace("maps/a.png", "../maps/a.png"));
    assert_eq!(text(&file), source, "the first file is as it was");
    assert!(!session.is_dirty());
    assert_eq!(session.document().steps(), 2);
}

/// Enter in the field of the name does not replace another file; the button does.
#[test]
fn another_file_is_replaced_only_by_its_button() {
    crate::draws();
    let (folder, file) = hills();
    let other = folder.path().join("other.ron");
    fs::write(&other, "// mine").expect("written");
    let mut window = crate::window(Some(file));
    window.run_steps(2);
    window.state_mut().session_mut().ask_name();
    window.run_steps(3);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.run_steps(2);
    type_text(&mut window, &folder.path().join("other").display().to_string());
    window.key_press(Key::Enter);
    window.run_steps(3);
    assert!(window.query_by_label_contains("There is such a file already").is_some());
    assert_eq!((text(&other).as_str(), window.state().session().question()), ("// mine", Some(&Question::Name)));
    window.get_by_label("Replace").click();
    window.run_steps(3);
    assert_eq!((text(&other).as_str(), window.state().session().question()), (HILLS, None));
}

#[test]
fn a_file_with_errors_says_so() {
    let (folder, _) = hills();
    let broken = folder.path().join("broken.ron");
    fs::write(&broken, "(nodes: { \"a\": Perlin( }").expect("written");
    let mut session = session(None);
    session.request(FileCommand::Open(broken));
    let notes = session.take_notes();
    assert!(notes.iter().any(|note| note.message.contains("cannot be built; the Problems pane")), "{notes:?}");
}

#[test]
fn a_failed_save_keeps_the_work_open() {
    let (folder, file) = hills();
    let mut session = session(Some(&file));
    session.apply(&octaves("5"));
    assert!(!session.save_as(&file.join("below.ron")), "a file is no folder");
    let note = session.take_notes().pop().map(|note| note.message).unwrap_or_default();
    assert!(note.contains("was not saved") && note.contains("Your work is still open"), "{note}");
    assert_eq!(session.path(), Some(file.as_path()));
    assert!(session.is_dirty());
    let mut rights = fs::metadata(&file).expect("there").permissions();
    rights.set_readonly(true);
    fs::set_permissions(&file, rights).expect("set");
    assert!(!session.save());
    let note = session.take_notes().pop().map(|note| note.message).unwrap_or_default();
    assert!(note.contains("write-protected"), "{note}");
    assert_eq!(text(&file), HILLS);
    assert!(session.save_as(&folder.path().join("other.ron")));
}

#[test]
fn unsaved_work_opens_a_question_before_it_is_closed() {
    let (folder, file) = hills();
    let mut session = session(None);
    session.request(FileCommand::Open(file.clone()));
    assert_eq!((session.question(), session.path()), (None, Some(file.as_path())));
    session.apply(&octaves("5"));
    session.request(FileCommand::New);
    assert_eq!(session.question(), Some(&Question::Unsaved(FileCommand::New)));
    session.answer(Answer::Cancel);
    assert_eq!(session.path(), Some(file.as_path()));
    session.request(FileCommand::New);
    session.answer(Answer::Save);
    assert_eq!((session.question(), session.path()), (None, None));
    assert_eq!(text(&file), HILLS.replace("octaves: 3", "octaves: 5"));
    assert!(!session.document().can_undo(), "another document has another history");

    session.apply(&Edit::AddNode { name: "x".into(), kind: "Perlin".into(), at: None });
    session.request(FileCommand::Close);
    session.answer(Answer::Save);
    assert_eq!(session.question(), Some(&Question::Name), "without a name there is nowhere to save");
    assert!(!session.is_over());
    session.answer(Answer::SaveAs(folder.path().join("new.ron")));
    assert!(session.is_over());
    assert!(text(&folder.path().join("new.ron")).contains("\"x\": Perlin"));
}

#[test]
fn discarding_leaves_the_file_alone() {
    let (_folder, file) = hills();
    let mut session = session(Some(&file));
    session.apply(&octaves("5"));
    session.request(FileCommand::Close);
    session.answer(Answer::Discard);
    assert!(session.is_over());
    assert_eq!(text(&file), HILLS);
}

#[test]
fn reloading_is_one_undo_step() {
    let (_folder, file) = hills();
    let mut session = session(Some(&file));
    let theirs = HILLS.replace("octaves: 3", "octaves: 7");
    fs::write(&file, &theirs).expect("written");
    assert!(session.reload());
    assert_eq!((session.document().source(), session.is_dirty()), (theirs.as_str(), false));
    assert!(session.undo() && session.is_dirty());
    assert_eq!(session.document().source(), HILLS);
    fs::remove_file(&file).expect("removed");
    assert!(!session.reload());
    assert!(session.take_notes().iter().any(|note| note.message.contains("there is no file")));
    assert!(session.save(), "a file that is gone is written again");
    assert_eq!(text(&file), HILLS);
}
