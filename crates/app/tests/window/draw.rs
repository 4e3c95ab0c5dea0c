//! A river and a road, drawn with the mouse on the terrain, shape it, and can be dragged after the file is opened again.

use std::process::Command;

use image::Rgb;
use orograph_graph::{Document, ParamValue};

use crate::{
    EditorProcess,
    screen::{Area, TRIAL, around, count, pixels, until, within},
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

/// The titles of the nodes with a path, in the view in which the graph opens.
const CARDS: [(&str, [i32; 2]); 2] = [("river", [475, 476]), ("road", [715, 476])];
/// The inspector's field with the name of the selected node, and the button of the drawing tool.
const NAME: Area = [952, 64, 1250, 90];
const BUTTON: Area = [504, 58, 548, 77];
/// Colours of the dark theme: a button that is on, and a handle under the pointer or picked.
const ON: Rgb<u8> = Rgb([0x1f, 0x66, 0x66]);
const HOT: Rgb<u8> = Rgb([0xff; 3]);

fn path(work: &Document, node: &str) -> Vec<[f64; 2]> {
    let graph = work.graph();
    match graph.instance(graph.find(node).expect("a node")).params.get("path") {
        Some(ParamValue::Path(points)) => points.clone(),
        other => panic!("{other:?}"),
    }
}

impl EditorProcess {
    /// Switches the drawing tool on.
    #[track_caller]
    fn take_tool(&self) {
        self.turn_to_graph();
        self.screen.point(ASIDE);
        self.screen.keys(&["p"]);
        until("the tool is on", || (count(&self.screen.picture()?, BUTTON, ON) > 300).then_some(()));
    }

    /// Selects a node, until the inspector shows another name than before.
    #[track_caller]
    fn choose(&self, node: &str) {
        let (_, card) = CARDS.into_iter().find(|(name, _)| *name == node).expect("it has a card");
        self.turn_to_graph();
        let name = || Some(pixels(&self.screen.picture()?, NAME));
        let before = until("a picture", name);
        until("the node is selected", || {
            self.screen.click(card);
            within(TRIAL, || name().filter(|now| *now != before))
        });
    }

    /// Returns Some if a handle near a position is under the pointer or picked.
    fn handle(&self, at: [i32; 2]) -> Option<()> {
        (count(&self.screen.picture()?, around(at, 12), HOT) > 50).then_some(())
    }

    /// Clicks places in the viewport with the drawing tool, each once the point before it is seen.
    #[track_caller]
    fn draw(&self, node: &str, places: &[[i32; 2]]) -> Vec<[f64; 2]> {
        self.choose(node);
        for at in places {
            self.screen.click(*at);
            until("the point is drawn", || self.handle(*at));
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
            self.screen.drag([from, to], || self.handle(from), moved);
            within(TRIAL, moved)
        });
        let now = path(&self.work().expect("a journal"), node);
        assert_eq!(now.len(), before.len());
        let others = (0..now.len()).filter(|at| *at != point);
        assert!(others.into_iter().all(|at| now[at] == before[at]), "only one point moves: {before:?} {now:?}");
    }

    /// The terrain of the saved file, as a raster file.
    fn terrain(&self) -> Vec<u8> {
        let out = self.folder.path().join("out");
        let mut run = Command::new(env!("CARGO_BIN_EXE_orograph"));
        let run = run.arg("run").arg(self.file()).args(["--only", "height", "-o"]).arg(&out);
        assert!(run.output().expect("it runs").status.success());
        std::fs::read(out.join("height.exr")).expect("it is built")
    }
}

#[test]
fn a_river_and_a_road_are_drawn_and_dragged_again_after_reopening() {
    let Some(mut editor) = EditorProcess::new(LAND) else { return };
    editor.start();
    editor.until_land();
    editor.take_tool();
    let river = editor.draw("river", &RIVER);
    let road = editor.draw("road", &ROAD);
    assert!(river[0][0] < river[2][0] && road[0][1] < road[1][1], "{river:?} {road:?}");
    if let Some(folder) = std::env::var_os("OROGRAPH_PICTURES") {
        let seen = until("a picture", || editor.screen.picture());
        seen.save(std::path::PathBuf::from(folder).join("window_drawn.png")).expect("the folder can be written to");
    }
    let level = editor.terrain();
    editor.screen.keys(&["ctrl+s"]);
    editor.until_saved();
    editor.kill();
    let drawn = editor.terrain();
    assert!(drawn != level, "the drawn lines shape the terrain");

    // Opened again, both lines are dragged where they are seen.
    editor.start();
    editor.until_saved();
    editor.until_land();
    editor.take_tool();
    editor.choose("river");
    editor.pull("river", 1, [RIVER[1], [RIVER[1][0] + 30, RIVER[1][1] - 20]], &river);
    editor.choose("road");
    editor.pull("road", 0, [ROAD[0], [ROAD[0][0] + 60, ROAD[0][1] - 5]], &road);
    editor.screen.keys(&["ctrl+s"]);
    editor.until_saved();
    assert!(editor.terrain() != drawn, "the dragged lines shape it again");
}
