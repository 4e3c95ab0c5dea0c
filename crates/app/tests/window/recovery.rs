//! The editor is killed at any moment, many times in a row, and the work is recovered each time.

use std::{
    thread,
    time::{Duration, Instant},
};

use crate::{EMPTY, EditorProcess};

/// Number of kills, and the variable that sets another number, which 7 must not divide.
const TIMES: u32 = 20;
const KILLS: &str = "OROGRAPH_KILLS";
/// The time after an edit over which the kills are spread.
const SPREAD: Duration = Duration::from_millis(1200);

#[test]
fn work_is_recovered_many_times_in_a_row() {
    let times = std::env::var(KILLS).map_or(TIMES, |kills| kills.parse().expect("a number of kills"));
    let Some(mut editor) = EditorProcess::new(EMPTY) else { return };
    editor.start();
    editor.until_saved();
    let (mut nodes, mut delays) = (0, Vec::new());
    for time in 0..times {
        // Several edits in a row; the kill happens while the last ones are made or written.
        let edits = 1 + time as usize % 3;
        editor.turn_to_graph();
        editor.add("constant", [500, 560]);
        if edits > 1 {
            editor.until("a node", |work| (work.nodes().len() == nodes + 1).then_some(()));
            editor.screen.keys(&["ctrl+d"].repeat(edits - 1));
        }
        let (made, mut seen) = (Instant::now(), 0);
        // Steps of seven cover all moments, out of order.
        while made.elapsed() < SPREAD * (7 * time % times) / (times - 1) {
            let now = editor.work().map_or(0, |work| work.nodes().len());
            if now == nodes + edits && now != seen {
                delays.push(made.elapsed());
            }
            seen = seen.max(now);
            thread::sleep(Duration::from_millis(10));
        }
        editor.kill();

        // The journal has every edit that was seen in it before, and no others.
        let left = editor.journal().filter(|journal| journal.has_work());
        let text = left.as_ref().map_or_else(|| editor.text(), |journal| journal.text.clone());
        let found = crate::document(&text).nodes().len();
        assert!((seen.max(nodes)..=nodes + edits).contains(&found), "{nodes} and {edits} more, {seen} seen: {found}");
        editor.start();
        editor.until_saved();
        if left.is_some() {
            editor.recover();
        }
        // Every other time the work is saved at once; otherwise it is continued.
        if time % 2 == 0 {
            editor.screen.keys(&["ctrl+s"]);
            editor.until_saved();
            assert_eq!(editor.text(), text);
        }
        nodes = found;
    }
    editor.screen.keys(&["ctrl+s"]);
    editor.until_saved();
    assert_eq!(crate::document(&editor.text()).nodes().len(), nodes);
    delays.sort();
    println!("{nodes} nodes; edits were on the disk after {delays:.0?}");
}
