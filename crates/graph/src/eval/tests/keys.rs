//! Tests of keys: the data that they include, and the data that they leave out.

use std::fs;

use super::*;
use crate::{Backend, Boundary, Edge, Exactness, GeoPlace, Prefer};

static INEXACT: Node = Node {
    id: "Waves",
    exactness: Exactness::Within { tolerance: 1e-3, why: "a test" },
    outputs: HEIGHT,
    params: Params::specs,
    cpu: WAVES.cpu,
    ..Node::DEFAULT
};
static NEWER: Node = Node { id: "Waves", version: 2, outputs: HEIGHT, params: Params::specs, ..Node::DEFAULT };
static OTHER: Node = Node { id: "Ripples", outputs: HEIGHT, params: Params::specs, ..Node::DEFAULT };

/// Runs everything, or nothing.
struct Elsewhere(bool);

impl Backend for Elsewhere {
    fn name(&self) -> &'static str {
        "elsewhere"
    }

    fn supports(&self, _: &Node, _: &ParamValues) -> bool {
        self.0
    }

    fn run(&self, node: &Node, job: &Job<'_>) -> Result<Option<Outputs>, NodeError> {
        (node.cpu)(job).map(Some)
    }

    fn begin(self: Arc<Self>, _: &Node, _: &Job<'_>) -> Result<Option<Box<dyn crate::Process>>, NodeError> {
        Ok(None)
    }
}

fn key(graph: &Graph, end: &str, window: Window) -> Key {
    key_in(graph, end, window, Path::new(""))
}

fn key_in(graph: &Graph, end: &str, window: Window, folder: &Path) -> Key {
    evaluator(1).key(graph, folder, graph.port(end).expect("exists"), window).expect("a key")
}

fn graph() -> Graph {
    Build::default().node("a", &WAVES, &[]).node("b", &ADD, &[("height", "a")]).0
}

#[test]
fn names_order_and_the_rest_of_the_graph_are_not_included() {
    let window = Window::whole(world(16));
    let other = Build::default()
        .node("unused", &WAVES, &[])
        .set("unused", "level", ParamValue::Float(3.0))
        .node("sum", &ADD, &[("height", "unused")])
        .node("source", &WAVES, &[]);
    let mut other = other.0;
    let (source, sum) = (other.port("source").expect("exists"), other.find("sum").expect("exists"));
    other.connect(source, sum, "height").expect("fits");
    assert_eq!(key(&graph(), "b", window), key(&other, "sum", window));
}

#[test]
fn a_default_that_is_written_is_the_same_as_one_that_is_not() {
    let window = Window::whole(world(16));
    let mut written = graph();
    let b = written.find("b").expect("exists");
    written.instance_mut(b).constants[1] = Some(1.0);
    assert_eq!(key(&graph(), "b", window), key(&written, "b", window));
    let zero = |v| key(&Build(graph()).set("a", "level", ParamValue::Float(v)).0, "b", window);
    assert_eq!(zero(0.0), zero(-0.0));
}

#[test]
fn whatever_can_change_the_result_is_included() {
    let whole = world(16);
    let window = Window::whole(whole);
    let base = key(&graph(), "b", window);
    let mut constant = graph();
    let b = constant.find("b").expect("exists");
    constant.instance_mut(b).constants[1] = Some(2.0);
    let worlds = [
        World { seed: 8, ..whole },
        World { cells: [32; 2], ..whole },
        World { size: [32.0; 2], ..whole },
        World { boundary: Boundary { east: Edge::Wall, ..whole.boundary }, ..whole },
    ];
    let mut keys = vec![
        base,
        key(&graph(), "a", window),
        key(&constant, "b", window),
        key(&graph(), "b", Window { cells: [8, 16], ..window }),
        key(&graph(), "b", Window { cells: [8, 16], origin: [1, 0], ..window }),
    ];
    keys.extend(worlds.map(|world| key(&graph(), "b", Window::whole(world))));
    let values = [("level", ParamValue::Float(1.0)), ("radius", ParamValue::Float(1.0)), ("seed", ParamValue::Seed(1))];
    keys.extend(values.map(|(name, value)| key(&Build(graph()).set("a", name, value).0, "b", window)));
    for node in [&NEWER, &OTHER, &INEXACT] {
        let graph = Build::default().node("a", node, &[]).node("b", &ADD, &[("height", "a")]).0;
        keys.push(key(&graph, "b", window));
    }
    let count = keys.len();
    keys.sort();
    keys.dedup();
    assert_eq!(keys.len(), count);
}

/// The place is part of the keys of nodes that read it and of those they feed, and of no others.
#[test]
fn the_place_is_included_where_it_is_read() {
    static MAP: Node = Node {
        id: "Map",
        outputs: HEIGHT,
        reads_place: true,
        cpu: |job| height(job, |_, _| job.place().map_or(-1.0, |place| place.corner_m[0]) as f32),
        ..Node::DEFAULT
    };
    let graph = Build::default().node("a", &WAVES, &[]).node("map", &MAP, &[]).node("b", &ADD, &[("height", "map")]).0;
    let place = |epsg, corner_m| Window::whole(World { place: Some(GeoPlace { epsg, corner_m }), ..world(16) });
    let places =
        [Window::whole(world(16)), place(32_611, [0.0, 5.0]), place(32_612, [0.0, 5.0]), place(32_611, [0.0, 6.0])];
    for (port, reads) in [("a", false), ("map", true), ("b", true)] {
        let mut keys = places.map(|window| key(&graph, port, window)).to_vec();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), if reads { 4 } else { 1 }, "{port}");
    }
}

/// The sea level is part of the keys of nodes that read it and of those they feed, and of no others.
#[test]
fn the_sea_level_is_included_where_it_is_read() {
    static TIDE: Node = Node {
        id: "Tide",
        inputs: ONE,
        outputs: HEIGHT,
        reads_sea: true,
        cpu: |job| height(job, |_, _| job.sea_level().unwrap_or(-1.0) as f32),
        ..Node::DEFAULT
    };
    let graph = Build::default()
        .node("a", &WAVES, &[])
        .node("stats", &ANOMALY, &[("height", "a")])
        .node("tide", &TIDE, &[("height", "stats")])
        .node("b", &ADD, &[("height", "tide")])
        .0;
    let window = |sea_level| Window::whole(World { sea_level, ..world(16) });
    let [none, low, high] = [None, Some(0.0), Some(50.0)].map(window);
    for (port, reads) in [("a", false), ("stats.lines", false), ("tide", true), ("b", true)] {
        let [none, low, high] = [none, low, high].map(|window| key(&graph, port, window));
        assert_eq!((none != low, low != high), (reads, reads), "{port}");
    }
    // a change of the level rebuilds the nodes that depend on it; results belong to the requested world
    let evaluator = evaluator(2);
    for (window, computed) in [(low, 4), (high, 2), (none, 2), (low, 0)] {
        let ports = ["a", "stats.lines", "b"].map(|port| (graph.port(port).expect("exists"), window));
        let count = Mutex::new(0);
        let events = |event| {
            if matches!(event, Event::NodeFinished { origin: Origin::Computed, .. }) {
                *count.lock().expect("counts") += 1;
            }
        };
        let values = evaluate(&evaluator, &graph, &ports, &Cancel::default(), &events).expect("values");
        assert_eq!(*count.lock().expect("counts"), computed, "{:?}", window.world.sea_level);
        for field in [&values[0], &values[2]].map(|value| value.as_field().expect("a field")) {
            assert_eq!(*field.window(), window);
        }
        let sea = window.world.sea_level.unwrap_or(-1.0) as f32;
        assert_eq!(values[2].as_field().and_then(|field| field.range(0)), Some((sea + 1.0, sea + 1.0)));
    }
}

#[test]
fn outputs_of_one_node_have_different_keys() {
    let graph = Build::default().node("base", &WAVES, &[]).node("stats", &ANOMALY, &[("height", "base")]).0;
    let window = Window::whole(world(16));
    assert_ne!(key(&graph, "stats.height", window), key(&graph, "stats.report", window));
}

/// No other backend gives the bytes of the CPU, also for exact nodes; nodes that it leaves to the CPU keep their keys.
#[test]
fn the_backend_is_included_unless_it_is_the_cpu() {
    let window = Window::whole(world(16));
    let differs = |node, end: &str, supports: bool| {
        let backend = Arc::new(Elsewhere(supports));
        let elsewhere = with(EvaluatorOptions { backend, ..EvaluatorOptions::default() });
        let graph = Build::default().node("a", node, &[]).node("b", &ADD, &[("height", "a")]).0;
        let port = graph.port(end).expect("exists");
        key(&graph, end, window) != elsewhere.key(&graph, Path::new(""), port, window).expect("a key")
    };
    for node in [&INEXACT, &WAVES] {
        for end in ["a", "b"] {
            assert!(differs(node, end, true) && !differs(node, end, false), "{} {end}", node.id);
        }
    }
}

/// The preferred backend counts where it runs the node, and nowhere else.
#[test]
fn the_preferred_backend_is_included() {
    let window = Window::whole(world(16));
    let of = |usual: bool, device: bool, prefers: Prefer| {
        let (backend, device) = (Arc::new(Elsewhere(usual)), Arc::new(Elsewhere(device)));
        let evaluator = with(EvaluatorOptions { backend, device, ..EvaluatorOptions::default() });
        let mut graph = graph();
        let node = graph.find("a").expect("exists");
        graph.instance_mut(node).prefers = prefers;
        let key = |end| evaluator.key(&graph, Path::new(""), graph.port(end).expect("exists"), window).expect("a key");
        [key("a"), key("b")]
    };
    let cpu = ["a", "b"].map(|end| key(&graph(), end, window));
    assert_eq!(of(false, false, Prefer::Device), cpu, "there is no device");
    assert_eq!(of(false, true, Prefer::Auto), cpu);
    assert_eq!(of(false, true, Prefer::Cpu), cpu);
    let there = of(false, true, Prefer::Device);
    assert!(there[0] != cpu[0] && there[1] != cpu[1], "and further down");
    let all = of(true, true, Prefer::Auto);
    assert_eq!(of(true, true, Prefer::Device), all);
    let part = of(true, true, Prefer::Cpu);
    assert!(part[0] == cpu[0] && part[1] != cpu[1], "only the node itself");
}

#[test]
fn the_content_of_a_file_is_included_and_its_folder_is_not() {
    let window = Window::whole(world(16));
    let folder = tempfile::tempdir().expect("a folder");
    let graph = |name: &str| Build(graph()).set("a", "file", ParamValue::File(name.to_owned())).0;
    fs::create_dir(folder.path().join("sub")).expect("made");
    fs::write(folder.path().join("a.txt"), "one").expect("written");
    fs::write(folder.path().join("sub/a.txt"), "one").expect("written");
    let evaluator = evaluator(1);
    let key = |name: &str| {
        let graph = graph(name);
        evaluator.key(&graph, folder.path(), graph.port("b").expect("exists"), window).expect("a key")
    };
    let first = key("a.txt");
    assert_eq!(first, key("sub/a.txt"));
    // equal length, written within the resolution of the file system's clock
    fs::write(folder.path().join("a.txt"), "two").expect("written");
    assert_ne!(first, key("a.txt"));
    // the companion
    fs::write(folder.path().join("sub/a.txt.json"), "{}").expect("written");
    let with_companion = key("sub/a.txt");
    assert_ne!(first, with_companion);
    fs::write(folder.path().join("sub/a.txt.json"), "[]").expect("written");
    assert_ne!(with_companion, key("sub/a.txt"));
}

/// Appends to its file while it reads it.
static RESTLESS: Node = Node {
    id: "Restless",
    outputs: HEIGHT,
    params: Params::specs,
    cpu: |job| {
        fs::write(job.file("file")?, "longer than before").map_err(|e| NodeError::failed(e.to_string()))?;
        height(job, |_, _| 0.0)
    },
    ..Node::DEFAULT
};

#[test]
fn a_file_that_changes_while_it_is_read_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("a.txt");
    fs::write(&file, "short").expect("written");
    let name = ParamValue::File(file.to_str().expect("unicode").to_owned());
    let graph = Build::default().node("a", &RESTLESS, &[]).set("a", "file", name).0;
    let error = run(&evaluator(1), &graph, &["a"], Window::whole(world(4))).err().expect("it fails");
    assert!(error.to_string().ends_with("it changed while it was being read; build again"), "{error}");
}

#[test]
fn a_missing_file_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let error = |name: &str| {
        let graph = Build(graph()).set("a", "file", ParamValue::File(name.to_owned())).0;
        let port = graph.port("b").expect("exists");
        evaluator(1).key(&graph, folder.path(), port, Window::whole(world(16))).expect_err("no file")
    };
    let missing = error("gone.tif");
    assert!(missing.to_string().contains("`a` cannot read") && missing.to_string().contains("gone.tif"), "{missing}");
    assert!(missing.hint().expect("a hint").contains("`file`"));
    assert!(error(".").to_string().contains("it is a folder"));
}
