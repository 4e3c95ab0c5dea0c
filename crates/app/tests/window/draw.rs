//! A river and a road, drawn with the mouse on the terrain, shape it, and can be dragged after the file is opened again.

use std::{thread, time::Duration};

use orograph_graph::{Document, ParamValue};

use crate::{
    EditorProcess,
    screen::{TRIAL, until, within},
};

/// Level land with two nodes that carve paths, which nobody has drawn yet.
const LAND: &str = r#"(
    format: 1,
    world: (size: "8 km", cells: 128, seed: 3),
    nodes: {
        "land": Constant(value: 200),
        "river": Carve(version: 2, height: "land", width: 300, depth: 80),
        "road": Carve(version: 2, height: "river", width: 300, depth: -30, mode: fill, profile: flat),
    },
    outputs: { "height": "road" },
    layout: { "land": (0, 0), "river": (240, 0), "road": (480, 0) },
)
"#;

/// Points in the viewport, and a place in it without handles.
const RIVER: [[i32; 2]; 3] = [[330, 200], [450, 180], [620, 230]];
const ROAD: [[i32; 2]; 2] = [[420, 155], [720, 240]];
const ASIDE: [i32; 2] = [150, 130];
/// Longer than a frame usually takes without a graphics card.
const REST: Duration = Duration::from_millis(1200);

fn path(work: &Document, node: &str) -> Vec<[f64; 2]> {
    let graph = work.graph();
    match graph.instance(graph.find(node).expect("a node")).params.get("path") {
        Some(ParamValue::Path(points)) => points.clone(),
        other => panic!("{other:?}"),
    }
}

impl EditorProcess {
    /// Switches the drawing tool on.
    fn take_tool(&self) {
        self.turn_to_graph();
        self.screen.point(ASIDE);
        thread::sleep(REST);
        self.screen.keys(&["p"]);
        thread::sleep(REST);
    }

    /// Selects a node with the search of the graph, then points at the viewport.
    #[track_caller]
    fn choose(&self, node: &str) {
        self.turn_to_graph();
        let letters: Vec<String> = node.chars().map(String::from).collect();
        let name: Vec<&str> = letters.iter().map(String::as_str).collect();
        for keys in [&["ctrl+f"][..], &name, &["Return"], &["Escape"]] {
            self.screen.keys(keys);
            thread::sleep(REST);
        }
        self.screen.point(ASIDE);
        thread::sleep(REST);
    }

    /// Clicks places in the viewport with the drawing tool, until the line has as many points.
    #[track_caller]
    fn draw(&self, node: &str, places: &[[i32; 2]]) -> Vec<[f64; 2]> {
        self.choose(node);
        for at in places {
            self.screen.click(*at);
            thread::sleep(REST);
        }
        self.until(&format!("{node} is drawn"), |work| {
            let points = path(work, node);
            (points.len() == places.len() && points.iter().flatten().all(|m| (0.0..=8000.0).contains(m)))
                .then_some(points)
        })
    }

    /// Drags a point of the selected node's line, until the document follows.
    #[track_caller]
    fn pull(&self, node: &str, point: usize, [from, to]: [[i32; 2]; 2], before: &[[f64; 2]]) {
        until("the point follows", || {
            let moved = || self.work().filter(|work| path(work, node)[point] != before[point]);
            self.screen.drag(from, to, moved);
            within(TRIAL, moved)
        });
        let now = path(&self.work().expect("a journal"), node);
        assert_eq!(now.len(), before.len());
        let others = (0..now.len()).filter(|at| *at != point);
        assert!(others.into_iter().all(|at| now[at] == before[at]), "only one point moves: {before:?} {now:?}");
    }
}

#[test]
fn a_river_and_a_road_are_drawn_and_dragged_again_after_reopening() {
    let Some(mut editor) = EditorProcess::new(LAND) else { return };
    editor.start();
    editor.take_tool();
    let river = editor.draw("river", &RIVER);
    let road = editor.draw("road", &ROAD);
    assert!(river[0][0] < river[2][0] && road[0][1] < road[1][1], "{river:?} {road:?}");
    if let Some(folder) = std::env::var_os("OROGRAPH_PICTURES") {
        let seen = until("a picture", || editor.screen.picture());
        seen.save(std::path::PathBuf::from(folder).join("window_drawn.png")).expect("the folder can be written to");
    }
    editor.screen.keys(&["ctrl+s"]);
    editor.until_saved();
    editor.kill();

    // Opened again, both lines are dragged where they are seen.
    editor.start();
    editor.until_saved();
    editor.take_tool();
    editor.choose("river");
    editor.pull("river", 1, [RIVER[1], [RIVER[1][0] + 30, RIVER[1][1] - 20]], &river);
    editor.choose("road");
    editor.pull("road", 0, [ROAD[0], [ROAD[0][0] + 60, ROAD[0][1] - 5]], &road);
    editor.screen.keys(&["ctrl+s"]);
    editor.until_saved();
}
