//! Tests of Ctrl-C, and of `watch`, which only Ctrl-C ends.

use std::{
    fs,
    io::{BufRead as _, BufReader},
    process::{Child, Command, Stdio},
    sync::mpsc::{Receiver, channel},
    time::{Duration, Instant},
};

use super::{Place, SMALL, repository};

/// Timeout: longer than any of these operations takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// The running program, with the lines of its standard output as they arrive.
struct Running {
    child: Child,
    lines: Receiver<String>,
}

impl Running {
    fn start(place: &Place, args: &[&str]) -> Self {
        let mut child =
            place.command(args).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the program starts");
        let (tell, lines) = channel();
        let stdout = BufReader::new(child.stdout.take().expect("piped"));
        std::thread::Builder::new()
            .name("lines".to_owned())
            .spawn(move || stdout.lines().map_while(Result::ok).try_for_each(|line| tell.send(line)))
            .expect("a thread");
        Self { child, lines }
    }

    /// Waits for a line that contains the text.
    #[track_caller]
    fn wait_for(&self, text: &str) {
        let mut seen = Vec::new();
        loop {
            match self.lines.recv_timeout(PATIENCE) {
                Ok(line) if line.contains(text) => return,
                Ok(line) => seen.push(line),
                Err(error) => panic!("`{text}` did not come ({error}); there was {seen:?}"),
            }
        }
    }

    /// Sends the signal of Ctrl-C; returns the exit code.
    fn interrupt(mut self) -> Option<i32> {
        let sent = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().expect("kill runs");
        assert!(sent.success());
        let start = now();
        loop {
            if let Some(status) = self.child.try_wait().expect("is a child") {
                return status.code();
            }
            assert!(start.elapsed() < PATIENCE, "it goes on");
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

impl Drop for Running {
    /// A failed test leaves no process behind.
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[expect(clippy::disallowed_methods, reason = "what waits for another program gives up in the end")]
fn now() -> Instant {
    Instant::now()
}

/// Hundreds of layers with many octaves: a build that takes much longer than the timeout.
fn long_graph() -> String {
    let nodes: String = (0..400).map(|n| format!("\"n{n}\": Perlin(octaves: 16, seed: {n}),\n")).collect();
    let outputs: String = (0..400).map(|n| format!("\"n{n}\": \"n{n}\",\n")).collect();
    format!("(world: (cells: (512, 512)), nodes: {{\n{nodes}}}, outputs: {{\n{outputs}}})")
}

#[test]
fn ctrl_c_stops_a_run_and_leaves_nothing() {
    let place = Place::new();
    place.write("long.ron", &long_graph());
    fs::create_dir(place.path("out")).expect("made");
    place.write("out/n0.exr", "from before");
    let running = Running::start(&place, &["run", "long.ron", "--json"]);
    running.wait_for("\"event\":\"node\"");
    assert_eq!(running.interrupt(), Some(130));
    assert_eq!(place.names("out"), ["n0.exr"]);
    assert_eq!(place.read("out/n0.exr"), "from before");
}

#[test]
fn watching_rebuilds_at_every_save_and_survives_errors() {
    let place = Place::new();
    fs::copy(repository("tests/data/glencoe_128.tif"), place.path("land.tif")).expect("copied");
    let graph = SMALL.replace("\"plain\": Constant(value: 700), // metres", "\"plain\": Import(file: \"land.tif\"),");
    place.write("g.ron", &graph);
    let running = Running::start(&place, &["watch", "g.ron", "--only", "height"]);
    running.wait_for("watching g.ron");
    let first = place.read("out/height.exr.json");

    place.write("g.ron", &graph.replace("seed: 7", "seed: 8"));
    running.wait_for("g.ron changed");
    running.wait_for("watching g.ron");
    let second = place.read("out/height.exr.json");
    assert_ne!(first, second);

    place.write("g.ron", "(nodes: {");
    running.wait_for("watching g.ron");
    assert_eq!(place.read("out/height.exr.json"), second, "a mistake leaves the last good files");

    // Many editors write a new file and rename it into place.
    place.write("g.ron.new", &graph);
    fs::rename(place.path("g.ron.new"), place.path("g.ron")).expect("renamed");
    running.wait_for("g.ron changed");
    running.wait_for("built");
    running.wait_for("watching g.ron");

    fs::copy(repository("tests/data/bigtujunga_i32.tif"), place.path("land.tif")).expect("copied");
    running.wait_for("land.tif changed");
    running.wait_for("watching g.ron");
    assert_ne!(place.read("out/height.exr.json"), first, "the land is another");
    assert_eq!(running.interrupt(), Some(0));
}

#[test]
fn watching_prints_events_for_programs() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    let running = Running::start(&place, &["watch", "g.ron", "--only", "height", "--json"]);
    running.wait_for(r#""event":"output""#);
    running.wait_for(r#""event":"watching""#);
    place.write("g.ron", &SMALL.replace("Slope(", "Slop("));
    running.wait_for(r#"{"event":"changed","file":"g.ron"}"#);
    running.wait_for(r#""code":"unknown-node""#);
    running.wait_for(r#""event":"error""#);
    running.wait_for(r#""event":"watching""#);
    assert_eq!(running.interrupt(), Some(0));
}

#[test]
fn watching_follows_the_files_that_a_graph_uses() {
    let place = Place::new();
    let inner = r#"(nodes: { "dem": Import(file: "land.tif") }, outputs: { "height": "dem" })"#;
    fs::create_dir(place.path("lib")).expect("made");
    place.write("lib/dem.ron", inner);
    place.write(
        "g.ron",
        r#"(nodes: { "a": Subgraph(file: "lib/dem.ron") }, outputs: { "height": "a" }, world: (cells: 16))"#,
    );
    // `watch` waits for a file that does not exist yet.
    let running = Running::start(&place, &["watch", "g.ron"]);
    running.wait_for("watching g.ron");
    fs::copy(repository("tests/data/glencoe_128.tif"), place.path("lib/land.tif")).expect("copied");
    running.wait_for("land.tif changed");
    running.wait_for("built");
    running.wait_for("watching g.ron");
    place.write("lib/dem.ron", &inner.replace("nodes", "/* saved */ nodes"));
    running.wait_for("dem.ron changed");
    running.wait_for("watching g.ron");
    assert_eq!(running.interrupt(), Some(0));
}

/// A link to a link to a file in another folder, for the graph and for what it reads.
#[test]
fn watching_follows_links() {
    let place = Place::new();
    for folder in ["real", "middle", "work"] {
        fs::create_dir(place.path(folder)).expect("made");
    }
    let graph = r#"(nodes: { "dem": Import(file: "land.tif") }, outputs: { "height": "dem" }, world: (cells: 16))"#;
    place.write("real/graph.ron", graph);
    fs::copy(repository("tests/data/glencoe_128.tif"), place.path("real/data.tif")).expect("copied");
    for (target, link) in [
        ("../real/graph.ron", "middle/g.ron"),
        ("../middle/g.ron", "work/g.ron"),
        ("../real/data.tif", "work/land.tif"),
    ] {
        std::os::unix::fs::symlink(target, place.path(link)).expect("linked");
    }
    let running = Running::start(&place, &["watch", "work/g.ron"]);
    running.wait_for("watching work/g.ron");
    fs::copy(repository("tests/data/bigtujunga_i32.tif"), place.path("real/data.tif")).expect("copied");
    running.wait_for("land.tif changed");
    running.wait_for("watching work/g.ron");
    place.write("real/graph.ron", &graph.replace("16", "8"));
    running.wait_for("g.ron changed");
    running.wait_for("watching work/g.ron");
    assert_eq!(running.interrupt(), Some(0));
}

/// A link to a folder on the way to the graph that is led elsewhere, after which files of the new folder count.
#[test]
fn watching_follows_a_folder_link_that_is_led_elsewhere() {
    let place = Place::new();
    let graph = |cells: u32| {
        format!(r#"(nodes: {{ "plain": Constant() }}, outputs: {{ "height": "plain" }}, world: (cells: {cells}))"#)
    };
    for (folder, cells) in [("one", 4), ("two", 5)] {
        fs::create_dir_all(place.path(folder).join("deep")).expect("made");
        place.write(&format!("{folder}/deep/g.ron"), &graph(cells));
    }
    let lead = |to: &str| {
        std::os::unix::fs::symlink(to, place.path("new")).expect("linked");
        fs::rename(place.path("new"), place.path("link")).expect("renamed");
    };
    lead("one");
    let running = Running::start(&place, &["watch", "link/deep/g.ron"]);
    running.wait_for("4 x 4");
    running.wait_for("watching");
    lead("two");
    running.wait_for("g.ron changed");
    running.wait_for("5 x 5");
    running.wait_for("watching");
    place.write("two/deep/g.ron", &graph(6));
    running.wait_for("6 x 6");
    assert_eq!(running.interrupt(), Some(0));
}

#[test]
fn watching_a_graph_that_names_a_pipe_ends_with_ctrl_c() {
    let place = Place::new();
    assert!(Command::new("mkfifo").arg(place.path("pipe.ron")).status().expect("mkfifo").success());
    place.write("g.ron", r#"(nodes: { "a": Subgraph(file: "pipe.ron") }, outputs: { "height": "a" })"#);
    let running = Running::start(&place, &["watch", "g.ron"]);
    running.wait_for("watching g.ron");
    assert_eq!(running.interrupt(), Some(0));
}

#[test]
fn a_save_restarts_an_outdated_build() {
    let place = Place::new();
    place.write("g.ron", &long_graph().replace("512", "1024"));
    let running = Running::start(&place, &["watch", "g.ron"]);
    // The build has started once its folder exists.
    let start = now();
    while !place.path("out").exists() {
        assert!(start.elapsed() < PATIENCE, "it does not begin");
        std::thread::sleep(Duration::from_millis(5));
    }
    place.write("g.ron", SMALL);
    running.wait_for("g.ron changed");
    running.wait_for("built 4 files");
    running.wait_for("watching g.ron");
    assert_eq!(place.names("out").len(), 6, "{:?}", place.names("out"));
    assert_eq!(running.interrupt(), Some(0));
}
