//! The journal of the editor is complete when memory runs out.

use std::{fs, path::PathBuf, process::Command};

use orograph::memory::keeps_a_journal;
use orograph_graph::recover;

use super::{kept, with};
use crate::{
    files::{hills, octaves},
    wait,
};

/// The variable that names the graph file for the process that runs out of memory.
const FILE: &str = "OROGRAPH_TEST_WITHOUT_MEMORY";

const NAME: &str = "safety::memory::what_was_not_saved_is_in_the_journal_when_memory_runs_out";

#[test]
fn what_was_not_saved_is_in_the_journal_when_memory_runs_out() {
    if let Some(file) = std::env::var_os(FILE).map(PathBuf::from) {
        run_out(&file);
    }
    let (folder, file) = hills();
    let mut child = Command::new(std::env::current_exe().expect("this program"));
    let ended = child.args(["--exact", NAME, "--nocapture"]).env(FILE, &file).output().expect("it starts");
    let message = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(2), "{message}");
    assert!(message.contains("out of memory") && message.contains("is in the journal"), "{message}");
    let journal = fs::read(folder.path().join(".hills.ron.journal")).expect("there");
    assert_eq!(recover(&journal).expect("whole").text, with("5"));
}

/// Edits a file, and then allocates more than any machine has.
fn run_out(file: &std::path::Path) {
    let folder = file.parent().expect("a folder");
    keeps_a_journal();
    let mut session = kept(Some(file), folder);
    session.apply(&octaves("5"));
    let journal = folder.join(".hills.ron.journal");
    let holds = || fs::read(&journal).is_ok_and(|bytes| recover(&bytes).is_ok_and(|read| read.text == with("5")));
    wait("the edit is written", holds);
    drop(Vec::<u8>::with_capacity(std::hint::black_box(1 << 60)));
    panic!("there was memory");
}
