//! The real window: the program on its own virtual display with software rendering, driven by simulated mouse and
//! keyboard input. The tests read its files, its title and its picture.
//!
//! They need Xvfb, xdotool and ImageMagick, and any graphics driver. If one of them is missing the tests are skipped
//! with a message, unless the variable `OROGRAPH_ALL_TESTS` is set, as `.ci/run` sets it.
#![cfg(all(feature = "editor", target_os = "linux"))]
#![expect(clippy::disallowed_methods, reason = "what waits for another program gives up in the end")]

#[path = "../common/device.rs"]
mod device;
mod draw;
mod recovery;
#[path = "../common/refusing.rs"]
mod refusing;
mod screen;
mod trouble;
mod work;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
};

use image::RgbImage;
use orograph_graph::{Document, Recovered, recover};
use screen::{Area, Screen, TRIAL, colours, until, within};

/// Position of the help button of the canvas, which is bright only while the pointer is over it.
const SIGN: [i32; 2] = [29, 666];
const BRIGHT: u8 = 0xb0;

/// The viewport in the window.
const VIEWPORT: Area = [20, 100, 920, 380];

/// A graph file without nodes.
const EMPTY: &str = "// Drawn by hand.\n(\n    format: 1,\n    world: (size: \"8 km\", cells: 128, seed: 3),\n    \
                     nodes: {},\n)\n";

/// A graph file in its own folder, the display on which it is edited, and the editor while it runs.
struct EditorProcess {
    screen: Screen,
    folder: tempfile::TempDir,
    window: Option<(Child, String)>,
}

impl EditorProcess {
    /// Creates them for a file with this text. Returns None when the tools are missing.
    fn new(text: &str) -> Option<Self> {
        let screen = Screen::open()?;
        let folder = tempfile::tempdir().expect("a folder");
        fs::create_dir(folder.path().join("state")).expect("made");
        // The tests look for the colours of the dark theme, whatever the system's theme is.
        fs::write(folder.path().join("state/theme"), "dark").expect("written");
        fs::write(folder.path().join("graph.ron"), text).expect("written");
        Some(Self { screen, folder, window: None })
    }

    fn file(&self) -> PathBuf {
        self.folder.path().join("graph.ron")
    }

    /// The text of the file.
    fn text(&self) -> String {
        fs::read_to_string(self.file()).expect("a text")
    }

    /// The journal. Returns None when there is none.
    fn journal(&self) -> Option<Recovered> {
        fs::read(self.folder.path().join(".graph.ron.journal")).ok().and_then(|bytes| recover(&bytes).ok())
    }

    /// The document in the journal.
    fn work(&self) -> Option<Document> {
        Some(document(&self.journal()?.text))
    }

    /// Polls the journal until `look` finds something.
    #[track_caller]
    fn until<T>(&self, what: &str, look: impl Fn(&Document) -> Option<T>) -> T {
        until(what, || look(&self.work()?))
    }

    /// The command of the editor on a file, on this display.
    fn command(&self, file: &Path) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orograph"));
        command.arg("edit").arg(file);
        command.env("DISPLAY", &self.screen.name).env("WINIT_X11_SCALE_FACTOR", "1");
        command.env("OROGRAPH_STATE", self.folder.path().join("state"));
        command.env("OROGRAPH_CACHE", self.folder.path().join("results"));
        command.env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command.stdin(Stdio::null()).stdout(Stdio::null());
        command
    }

    /// Starts the editor and waits for its window to have the keyboard focus.
    #[track_caller]
    fn start(&mut self) {
        let errors = fs::File::create(self.folder.path().join("errors")).expect("made");
        let child = self.command(&self.file()).stderr(errors).spawn().expect("it starts");
        self.window = Some((child, String::new()));
        let id = until("there is a window", || {
            if let Some((child, _)) = &mut self.window
                && let Some(status) = child.try_wait().expect("is a child")
            {
                let messages = fs::read_to_string(self.folder.path().join("errors")).unwrap_or_default();
                panic!("the editor has ended: {status}\n{messages}");
            }
            self.screen.window("graph.ron")
        });
        // There is no window manager on this display that would set the focus.
        until("the window has the keys", || {
            self.screen.ask(&["windowfocus", &id])?;
            (self.screen.ask(&["getwindowfocus"])?.trim() == id).then_some(())
        });
        if let Some((_, window)) = &mut self.window {
            *window = id;
        }
    }

    /// The title of the window: the file name, marked if there is unsaved work.
    fn title(&self) -> String {
        let id = self.window.as_ref().map_or("", |(_, id)| id);
        self.screen.ask(&["getwindowname", id]).unwrap_or_default().trim().to_owned()
    }

    #[track_caller]
    fn until_saved(&self) {
        until("all is saved", || (self.title() == "graph.ron \u{2013} Orograph").then_some(()));
    }

    #[track_caller]
    fn until_unsaved(&self) {
        until("there is work that is not saved", || self.title().starts_with('\u{2022}').then_some(()));
    }

    /// Waits until the viewport shows terrain in 3D. Until then a click or a drag would be over before the window sees it:
    /// the first such frame takes long.
    #[track_caller]
    fn until_land(&self) -> RgbImage {
        until("land is seen", || self.screen.picture().filter(|seen| colours(seen, VIEWPORT) > 2500))
    }

    /// Waits until the canvas has the keyboard focus, which follows the pointer with the next frame.
    #[track_caller]
    fn turn_to_graph(&self) {
        until("the pointer is seen over the graph", || {
            self.screen.point(SIGN);
            within(TRIAL, || {
                let seen = screen::pixels(&self.screen.picture()?, screen::around(SIGN, 12));
                seen.into_iter().any(|pixel| pixel[0] > BRIGHT).then_some(())
            })
        });
    }

    /// Answers the question at the start: recovers the work. The first button has the focus.
    #[track_caller]
    fn recover(&self) {
        until("the work is taken up", || {
            self.screen.keys(&["Return"]);
            within(TRIAL, || self.title().starts_with('\u{2022}').then_some(()))
        });
    }

    /// Adds a node with keys, with the pointer at a position of the graph.
    fn add(&self, kind: &str, at: [i32; 2]) {
        self.screen.point(at);
        let letters = kind.chars().map(String::from).collect::<Vec<_>>();
        let keys = ["Tab"].into_iter().chain(letters.iter().map(String::as_str)).chain(["Return"]);
        self.screen.keys(&keys.collect::<Vec<_>>());
    }

    /// Ends the editor like a power cut (`SIGKILL`).
    fn kill(&mut self) {
        if let Some((mut child, _)) = self.window.take() {
            child.kill().expect("it still runs");
            child.wait().expect("is a child");
        }
    }
}

impl Drop for EditorProcess {
    /// Leaves no process behind; a failed test saves the picture and prints the messages.
    fn drop(&mut self) {
        if std::thread::panicking() {
            let seen = Path::new(env!("CARGO_TARGET_TMPDIR")).join("window.png");
            let saved = self.screen.picture().map(|picture| picture.save(&seen));
            let messages = fs::read_to_string(self.folder.path().join("errors")).unwrap_or_default();
            let journal = self.journal().map(|journal| journal.text);
            eprintln!(
                "{}: {saved:?}\n{messages}\nin the file: {}\nin the journal: {journal:?}",
                seen.display(),
                self.text()
            );
        }
        if let Some((mut child, _)) = self.window.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn document(text: &str) -> Document {
    Document::parse(text, &orograph_nodes::registry())
}
