//! An hour of work in a few seconds: nodes, a wire, a slider, undo, save, a crash.

use std::{thread, time::Duration};

use image::{Rgb, RgbImage};
use orograph_graph::{Document, diff};

use crate::{
    EMPTY, EditorProcess, VIEWPORT, document,
    screen::{Area, TRIAL, around, colours, count, pixels, until, within},
};

/// Where nodes are added in the window. Positions are rounded to twelve units, and these two differ by half of that in
/// both directions, so that both together locate the graph to three units.
const PLACES: [[i32; 2]; 2] = [[150, 450], [546, 492]];
/// Measures of a card: its width, half the height of its title, the distance from its top to the first pin, the spacing
/// of pins.
const WIDTH: f64 = 180.0;
const TITLE: f64 = 18.0;
const FIRST_PIN: f64 = 141.5;
/// The grid step of positions.
const GRID: f64 = 12.0;

/// The area of the inspector's values in the window.
const VALUES: Area = [950, 50, 1270, 690];

/// Colours of the dark theme: a slider's rail before its handle and after it, and its handle under the pointer while no
/// button is pressed.
const RAIL: [Rgb<u8>; 2] = [Rgb([0x1f, 0x66, 0x66]), Rgb([0x33, 0x38, 0x3d])];
const HANDLE: Rgb<u8> = Rgb([0x3e, 0x44, 0x4a]);

/// The ends of the rail of the topmost slider among the values. A rail has the colours of a button but is thinner.
fn slider(picture: &RgbImage) -> Option<[[i32; 2]; 2]> {
    let [left, top, right, bottom] = VALUES;
    let is_rail = |x: u32, y: u32| RAIL.contains(picture.get_pixel(x, y));
    let run = |y: u32| {
        let mut longest = (left, left);
        let mut found: Option<(u32, u32)> = None;
        for x in (left..right).filter(|x| is_rail(*x, y)) {
            // The handle covers some pixels of the rail.
            let start = found.filter(|(_, end)| x - end < 14).map_or(x, |(start, _)| start);
            found = Some((start, x));
            longest = if x - start > longest.1 - longest.0 { (start, x) } else { longest };
        }
        (longest.1 - longest.0 > 45).then_some(longest)
    };
    let mut rows = Vec::new();
    for y in top..bottom {
        match run(y) {
            Some(found) => rows.push((y, found)),
            None if (4..=12).contains(&rows.len()) => break,
            None => rows.clear(),
        }
    }
    let (y, (from, to)) = *rows.get(rows.len() / 2)?;
    Some([from, to].map(|x| [x as i32, y as i32]))
}

/// Positions of pins in the window: the output of one node and the first input of another.
fn pins(work: &Document) -> [[i32; 2]; 2] {
    let at = |node: &str| {
        let entry = work.nodes().iter().find(|entry| entry.name == node);
        entry.and_then(|entry| entry.layout).expect("it has a place")
    };
    let nodes = [at("ridged"), at("terrace")];
    // A new node has its corner at the pointer, minus half a title, rounded to the grid.
    let origin = [0, 1].map(|axis| {
        let corner = [WIDTH / 2.0, TITLE][axis];
        let guesses = [0, 1].map(|k| f64::from(PLACES[k][axis]) - corner - nodes[k][axis]);
        let low = guesses[0].max(guesses[1]) - GRID / 2.0;
        let high = guesses[0].min(guesses[1]) + GRID / 2.0;
        assert!(low <= high, "the graph is seen in its own size: {guesses:?}");
        f64::midpoint(low, high)
    });
    let from = [nodes[0][0] + WIDTH, nodes[0][1] + FIRST_PIN];
    let to = [nodes[1][0], nodes[1][1] + FIRST_PIN];
    [from, to].map(|pin| [0, 1].map(|axis| (origin[axis] + pin[axis]).round() as i32))
}

/// The source of the first input of a node.
fn source(work: &Document, node: &str) -> Option<String> {
    let graph = work.graph();
    graph.source(graph.find(node).ok()?, 0).map(|port| graph.port_name(port))
}

/// The document once it no longer changes: the journal is written after a fifth of a second.
fn still(editor: &EditorProcess) -> Document {
    until("the work stands still", || {
        let [before, after] = [0, 600].map(|pause| {
            thread::sleep(Duration::from_millis(pause));
            editor.work()
        });
        after.filter(|after| before.is_some_and(|before| before.source() == after.source()))
    })
}

#[test]
fn nodes_are_wired_and_a_value_is_dragged_and_nothing_is_lost() {
    let Some(mut editor) = EditorProcess::new(EMPTY) else { return };
    editor.start();
    // Without terrain the viewport shows only a line of text.
    until("the window is drawn", || (8..1000).contains(&colours(&editor.screen.picture()?, VIEWPORT)).then_some(()));

    // Two nodes, by keys alone. The second has no input, so it is not wired to the first.
    editor.turn_to_graph();
    for (kind, at, count) in [("terrace", PLACES[1], 1), ("ridged", PLACES[0], 2)] {
        editor.add(kind, at);
        editor.until(kind, |work| (work.nodes().len() == count && work.nodes()[count - 1].name == kind).then_some(()));
    }
    editor.until_unsaved();

    // The terrain of the last added node appears.
    let land = editor.until_land();
    if let Some(folder) = std::env::var_os("OROGRAPH_PICTURES") {
        land.save(std::path::PathBuf::from(folder).join("window.png")).expect("the folder can be written to");
    }

    // A wire between them. Escape closes the menu that a wire opens which ends on no pin.
    let work = editor.work().expect("written");
    assert_eq!(source(&work, "terrace"), None);
    let [from, to] = pins(&work);
    let before_pin = [to[0] - 60, to[1] - 30, to[0] - 20, to[1] + 30].map(|x| x as u32);
    until("the wire", || {
        editor.screen.keys(&["Escape"]);
        editor.screen.point(PLACES[1]);
        let free = editor.screen.picture()?;
        let is_pointed_at = || {
            let pin = around(from, 12);
            (pixels(&editor.screen.picture()?, pin) != pixels(&free, pin)).then_some(())
        };
        editor.screen.drag([from, to], is_pointed_at, || {
            let seen = editor.screen.picture()?;
            (colours(&seen, before_pin) > colours(&free, before_pin)).then_some(())
        });
        within(TRIAL, || (source(&editor.work()?, "terrace").as_deref() == Some("ridged.height")).then_some(()))
    });

    // A drag of a slider, one undo and one redo.
    let work = editor.work().expect("written");
    let [left, right] = slider(&land).expect("there is a slider");
    let at = |share: f64| [(f64::from(left[0]) + share * f64::from(right[0] - left[0])) as i32, left[1]];
    let rail = [left[0] - 8, left[1] - 8, right[0] + 8, right[1] + 8].map(|x| x as u32);
    until("the value follows", || {
        editor.screen.point(PLACES[1]);
        let free = editor.screen.picture()?;
        let is_pointed_at = || (pixels(&editor.screen.picture()?, rail) != pixels(&free, rail)).then_some(());
        let follows = || editor.work().filter(|now| now.source() != work.source());
        editor.screen.drag([at(0.3), at(0.65)], is_pointed_at, follows)
    });
    until("the slider is let go", || (count(&editor.screen.picture()?, around(at(0.65), 6), HANDLE) > 0).then_some(()));
    let dragged = still(&editor);
    let change = diff(&work, &dragged);
    assert!(change.len() == 1 && change[0].starts_with("ridged."), "{change:?}");
    assert_eq!(source(&dragged, "terrace").as_deref(), Some("ridged.height"));
    editor.screen.keys(&["ctrl+z"]);
    editor.until("the drag is taken back", |now| (now.source() == work.source()).then_some(()));
    editor.screen.keys(&["ctrl+shift+z"]);
    editor.until("the drag is there again", |now| (now.source() == dragged.source()).then_some(()));

    // Saving keeps the comment.
    editor.screen.keys(&["ctrl+s"]);
    editor.until_saved();
    assert_eq!(editor.text(), dragged.source());
    assert!(editor.text().starts_with("// Drawn by hand.\n"));
    assert!(!document(&editor.text()).has_errors());

    // More edits, then a crash.
    editor.turn_to_graph();
    editor.add("slope", [350, 450]);
    editor.until("slope", |work| (work.nodes().len() == 3).then_some(()));
    let lost = editor.work().expect("written");
    editor.kill();
    assert_eq!(editor.text(), dragged.source());

    // The work is recovered, with its history.
    editor.start();
    editor.until_saved();
    editor.recover();
    editor.screen.keys(&["ctrl+s"]);
    editor.until_saved();
    assert_eq!(editor.text(), lost.source());
    for earlier in [&dragged, &work] {
        editor.screen.keys(&["ctrl+z"]);
        editor.until("an earlier state", |now| (now.source() == earlier.source()).then_some(()));
    }
}
