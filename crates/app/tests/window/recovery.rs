//! The plug is pulled at any moment, twenty times in a row, and the work comes back each time.

use std::{
    thread,
    time::{Duration, Instant},
};

use crate::{Desk, EMPTY};

/// How often the plug is pulled, and over how long a time after an edit.
const TIMES: u32 = 20;
const SPREAD: Duration = Duration::from_millis(1200);

#[test]
fn work_comes_back_twenty_times_in_a_row() {
    let Some(mut desk) = Desk::new(EMPTY) else { return };
    desk.start();
    desk.until_saved();
    let (mut nodes, mut delays) = (0, Vec::new());
    for time in 0..TIMES {
        // Some edits in a row; the plug is pulled while the last ones are made or written.
        let edits = 1 + time as usize % 3;
        desk.turn_to_graph();
        desk.add("constant", [500, 560]);
        if edits > 1 {
            desk.until("a node", |work| (work.nodes().len() == nodes + 1).then_some(()));
            desk.screen.keys(&["ctrl+d"].repeat(edits - 1));
        }
        let (made, mut seen) = (Instant::now(), 0);
        // Seven steps go through all of the twenty moments, out of order.
        while made.elapsed() < SPREAD * (7 * time % TIMES) / (TIMES - 1) {
            let now = desk.work().map_or(0, |work| work.nodes().len());
            if now == nodes + edits && now != seen {
                delays.push(made.elapsed());
            }
            seen = seen.max(now);
            thread::sleep(Duration::from_millis(10));
        }
        desk.kill();

        // What was on the disk, which is all that had been seen there, and nothing but what was done.
        let left = desk.journal().filter(|journal| journal.has_work());
        let text = left.as_ref().map_or_else(|| desk.text(), |journal| journal.text.clone());
        let found = crate::document(&text).nodes().len();
        assert!((seen.max(nodes)..=nodes + edits).contains(&found), "{nodes} and {edits} more, {seen} seen: {found}");
        desk.start();
        desk.until_saved();
        if left.is_some() {
            desk.take_up();
        }
        // Some work is saved at once; the other goes on from where it was.
        if time % 2 == 0 {
            desk.screen.keys(&["ctrl+s"]);
            desk.until_saved();
            assert_eq!(desk.text(), text);
        }
        nodes = found;
    }
    desk.screen.keys(&["ctrl+s"]);
    desk.until_saved();
    assert_eq!(crate::document(&desk.text()).nodes().len(), nodes);
    delays.sort();
    println!("{nodes} nodes; edits were on the disk after {delays:.0?}");
    // The machine may be too busy to draw now and then, but not most of the time.
    let median = delays.get(delays.len() / 2).copied().unwrap_or_default();
    assert!(median < Duration::from_secs(1), "{delays:?}");
}
