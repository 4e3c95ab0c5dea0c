//! Tests of journals, recovery, and changes of the file by other windows and programs.

mod copies;
mod memory;

use std::{
    fs,
    path::{Path, PathBuf},
    thread,
    time::Duration,
};

use egui_kittest::{Harness, kittest::Queryable as _};
use orograph::editor::{Answer, App, FileCommand, Journals, Lost, Question, Session};
use orograph_graph::{Edit, recover};

use crate::{
    files::{HILLS, hills, octaves, session, text},
    wait,
};

fn kept(file: Option<&Path>, state: &Path) -> Session {
    let mut session = session(file);
    session.keep(Journals::with_state(state), || {});
    session
}

fn with(count: &str) -> String {
    HILLS.replace("octaves: 3", &format!("octaves: {count}"))
}

/// Names of the journals in a folder.
fn journals(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|name| name.ends_with(".journal")).collect();
    names.sort();
    names
}

fn lost(session: &Session) -> Lost {
    match session.question() {
        Some(Question::Found(lost)) => lost.clone(),
        other => panic!("{other:?}"),
    }
}

fn notes(session: &mut Session) -> String {
    session.take_notes().into_iter().map(|note| note.message + "\n").collect()
}

#[test]
fn an_edit_is_in_the_journal_soon() {
    let (folder, file) = hills();
    let mut session = kept(Some(&file), folder.path());
    assert_eq!(journals(folder.path()), [""; 0], "looking at a file leaves nothing behind");
    session.apply(&octaves("5"));
    let journal = folder.path().join(".hills.ron.journal");
    let holds = |text: &str| fs::read(&journal).is_ok_and(|bytes| recover(&bytes).is_ok_and(|read| read.text == text));
    wait("the first edit is written", || holds(&with("5")));
    // A drag of a slider.
    for count in ["6", "7", "8", "9"] {
        session.gesture(&octaves(count));
    }
    session.end_gesture();
    wait("the drag is written", || holds(&with("9")));
    let read = recover(&fs::read(&journal).expect("there")).expect("whole");
    assert_eq!(read.history.steps(), 2);
    assert!(session.save());
    wait("the save is written", || recover(&fs::read(&journal).expect("there")).is_ok_and(|read| !read.has_work()));
    drop(session);
    assert_eq!(journals(folder.path()), [""; 0], "what is saved needs no journal");
}

#[test]
fn unsaved_work_is_offered_with_its_history() {
    let (folder, file) = hills();
    let mut before = kept(Some(&file), folder.path());
    before.apply(&octaves("5"));
    before.save();
    before.apply(&octaves("6"));
    before.gesture(&octaves("7"));
    before.gesture(&octaves("8"));
    before.end_gesture();
    before.apply(&octaves("9"));
    before.undo();
    drop(before);
    for answer in [Answer::Cancel, Answer::Recover, Answer::Recover, Answer::Discard] {
        let mut session = kept(Some(&file), folder.path());
        let lost = lost(&session);
        assert_eq!((lost.steps, lost.changed_since, lost.torn), (3, false, false));
        assert_eq!(lost.differences, ["b.octaves 5 \u{2192} 8"]);
        assert_eq!(session.document().source(), with("5"), "nothing is applied unasked");
        session.answer(answer.clone());
        assert_eq!(session.question(), None);
        if answer == Answer::Recover {
            assert!(session.is_dirty());
            let mut steps = vec![session.document().source().to_owned()];
            while session.undo() {
                steps.push(session.document().source().to_owned());
            }
            assert_eq!(steps, [with("8"), with("6"), with("5"), HILLS.to_owned()]);
            while session.redo() {}
            assert_eq!(session.document().source(), with("9"), "what was taken back can be made again");
            session.undo();
        } else {
            assert_eq!(session.document().source(), with("5"));
        }
    }
    assert_eq!(kept(Some(&file), folder.path()).question(), None);
    assert_eq!(journals(folder.path()), [""; 0]);
}

/// The welcome page marks a file with work to recover.
#[test]
fn unsaved_work_is_known_before_its_file_is_opened() {
    let (folder, file) = hills();
    let journals = Journals::with_state(folder.path());
    assert!(!journals.has_work(&file));
    let mut before = kept(Some(&file), folder.path());
    before.apply(&octaves("5"));
    drop(before);
    assert!(journals.has_work(&file) && !journals.has_work(&folder.path().join("other.ron")));
    let mut session = kept(Some(&file), folder.path());
    session.answer(Answer::Discard);
    drop(session);
    assert!(!journals.has_work(&file));
}

#[test]
fn the_journal_of_an_unnamed_graph_is_in_the_state_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let state = folder.path().join("state");
    let mut before = kept(None, &state);
    before.apply(&Edit::AddNode { name: "x".into(), kind: "Perlin".into(), at: None });
    drop(before);
    assert_eq!(journals(&state), ["unnamed.journal"]);
    let mut session = kept(None, &state);
    assert_eq!(lost(&session).differences, ["node x (Perlin) added"]);
    session.answer(Answer::Recover);
    assert!(session.document().source().contains("\"x\": Perlin"));
    session.request(FileCommand::Close);
    session.answer(Answer::Save);
    session.answer(Answer::SaveAs(folder.path().join("new.ron")));
    assert!(session.is_over());
    drop(session);
    assert_eq!(journals(&state), [""; 0]);
}

#[test]
fn a_read_only_folder_has_its_journals_in_the_state_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let state = folder.path().join("state");
    // The name of its journal would be too long.
    let file = folder.path().join(format!("{}.ron", "a".repeat(246)));
    fs::write(&file, HILLS).expect("written");
    let mut before = kept(Some(&file), &state);
    before.apply(&octaves("5"));
    drop(before);
    assert_eq!((journals(folder.path()).len(), journals(&state).len()), (0, 1));
    let mut session = kept(Some(&file), &state);
    session.answer(Answer::Recover);
    assert_eq!(session.document().source(), with("5"));
    // If no journal can be written, a message appears once.
    let mut session = crate::files::session(Some(&file));
    session.keep(Journals::default(), || {});
    session.apply(&octaves("6"));
    session.apply(&octaves("7"));
    session.poll();
    session.poll();
    let message = notes(&mut session);
    assert_eq!(message.matches("Crash recovery is off").count(), 1, "{message}");
}

#[test]
fn two_windows_on_one_file_detect_each_other() {
    let (folder, file) = hills();
    let mut one = kept(Some(&file), folder.path());
    one.apply(&octaves("5"));
    let mut two = kept(Some(&file), folder.path());
    assert!(notes(&mut two).contains("another window has this file open"));
    assert_eq!(two.question(), None, "what the other does is not lost work");
    two.apply(&octaves("6"));
    assert_eq!(journals(folder.path()), [".hills.ron.2.journal", ".hills.ron.journal"]);
    assert!(one.save());
    assert!(!two.save(), "the other has saved something else");
    assert!(matches!(two.question(), Some(Question::Changed { .. })));
    assert_eq!(text(&file), with("5"));
    drop(two);
    one.apply(&octaves("7"));
    drop(one);
    // Both are offered, the newest first.
    let mut session = kept(Some(&file), folder.path());
    assert_eq!(lost(&session).differences, ["b.octaves 5 \u{2192} 7"]);
    session.answer(Answer::Discard);
    assert_eq!(lost(&session).differences, ["b.octaves 5 \u{2192} 6"]);
    assert!(lost(&session).changed_since);
    session.answer(Answer::Discard);
    assert_eq!((session.question(), journals(folder.path()).len()), (None, 0));
}

#[test]
fn a_journal_of_another_file_state_is_merged_or_asked_about() {
    let (folder, file) = hills();
    let mut before = kept(Some(&file), folder.path());
    before.apply(&octaves("5"));
    drop(before);
    fs::write(&file, HILLS.replace("low", "lower")).expect("written");
    let mut session = kept(Some(&file), folder.path());
    assert!(lost(&session).changed_since);
    session.answer(Answer::Recover);
    assert_eq!(session.document().source(), with("5").replace("low", "lower"), "both go together");
    drop(session);
    fs::write(&file, with("7")).expect("written");
    let mut session = kept(Some(&file), folder.path());
    session.answer(Answer::Recover);
    assert!(matches!(session.question(), Some(Question::Changed { .. })), "{:?}", session.question());
    session.answer(Answer::TakeTheirs);
    assert_eq!((session.document().source(), session.is_dirty()), (with("7").as_str(), false));
}

#[test]
fn a_damaged_journal_is_recovered_up_to_the_damage() {
    let (folder, file) = hills();
    let journal = folder.path().join(".hills.ron.journal");
    let mut before = kept(Some(&file), folder.path());
    before.apply(&octaves("5"));
    wait("written", || fs::read(&journal).is_ok_and(|bytes| recover(&bytes).is_ok()));
    before.apply(&octaves("6"));
    drop(before);
    let whole = fs::read(&journal).expect("there");
    fs::write(&journal, &whole[..whole.len() - 7]).expect("written");
    let mut session = kept(Some(&file), folder.path());
    assert!(lost(&session).torn);
    session.answer(Answer::Recover);
    assert_eq!(session.document().source(), with("5"));
    // New entries replace the torn line.
    session.apply(&octaves("8"));
    drop(session);
    let read = recover(&fs::read(&journal).expect("there")).expect("whole");
    assert_eq!((read.text, read.torn), (with("8"), false));
    // A file that is not a journal is ignored.
    fs::write(&journal, [0xff; 100]).expect("written");
    let mut session = kept(Some(&file), folder.path());
    assert_eq!(session.question(), None);
    session.apply(&octaves("4"));
    drop(session);
    assert_eq!(lost(&kept(Some(&file), folder.path())).differences, ["b.octaves 3 \u{2192} 4"]);
}

#[test]
fn changes_by_other_programs_are_loaded() {
    let (folder, file) = hills();
    let mut session = kept(Some(&file), folder.path());
    let source = |session: &mut Session| {
        session.poll();
        session.document().source().to_owned()
    };
    fs::write(&file, with("7")).expect("written");
    wait("it is reloaded", || source(&mut session) == with("7"));
    assert!(!session.is_dirty() && notes(&mut session).contains("was reloaded"));
    assert!(session.undo(), "as one step");
    session.redo();
    // With unsaved work, both versions are merged.
    session.apply(&octaves("8"));
    fs::write(&file, with("7").replace("low", "lower")).expect("written");
    wait("both are there", || source(&mut session) == with("8").replace("low", "lower"));
    assert!(session.is_dirty() && notes(&mut session).contains("were merged with yours"));
    // Conflicts open a question; the file is renamed into place, as many programs do.
    let other = folder.path().join("other");
    fs::write(&other, with("9")).expect("written");
    fs::rename(&other, &file).expect("renamed");
    wait("it is asked", || {
        session.poll();
        session.question().is_some()
    });
    assert_eq!(text(&file), with("9"));
    session.answer(Answer::KeepMine);
    assert!(session.is_dirty() && session.save());
    assert_eq!(text(&file), with("8").replace("low", "lower"));
    // The session's own save does not count as a change.
    thread::sleep(Duration::from_millis(400));
    session.poll();
    assert_eq!(notes(&mut session), "");
    assert_eq!(session.question(), None);
}

fn window(file: &Path, state: PathBuf) -> Harness<'static, App> {
    let file = file.to_owned();
    crate::harness([1000.0, 700.0]).build_eframe(move |context| {
        App::new(context, Some(file), orograph::build::storage::in_memory())
            .expect("the file can be read")
            .kept(context, Journals::with_state(&state))
    })
}

#[test]
fn the_window_asks_and_follows_the_answer() {
    let (folder, file) = hills();
    let mut before = kept(Some(&file), folder.path());
    before.apply(&octaves("5"));
    drop(before);
    let mut window = window(&file, folder.path().to_owned());
    window.run_steps(4);
    window.get_by_label("Work on hills.ron was not saved");
    window.get_by_label("Differences (1)").click();
    window.run_steps(8);
    window.get_by_label("b.octaves 3 \u{2192} 5");
    window.get_by_label("Recover").click();
    window.run_steps(4);
    assert_eq!(window.state().session().document().source(), with("5"));
    assert!(window.query_by_label("Recover").is_none());
    window.state_mut().session_mut().request(FileCommand::New);
    window.run_steps(4);
    window.get_by_label("Save the changes to hills.ron?");
    window.get_by_label("Save").click();
    window.run_steps(4);
    assert_eq!(text(&file), with("5"));
    assert_eq!(window.state().session().path(), None);
}
