//! The command line as a user runs it: files, messages, exit codes.

mod bad_input;
mod cube;
#[cfg(feature = "editor")]
#[path = "../common/device.rs"]
mod device;
mod events;
mod expect;
#[cfg(unix)]
mod faults;
mod files;
mod fit;
#[cfg(target_os = "linux")]
mod limits;
mod manual;
mod new;
#[cfg(all(feature = "editor", target_os = "linux"))]
#[path = "../common/refusing.rs"]
mod refusing;
mod reuse;
mod run;
mod sea;
mod shell;
#[cfg(unix)]
mod signals;
#[cfg(unix)]
mod strangers;
#[cfg(unix)]
mod trust;
mod window;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use tempfile::TempDir;

/// A folder for one test, removed at its end.
struct Place(TempDir);

/// A graph with three outputs that builds quickly.
const SMALL: &str = r#"// A plain and its shade.
(
    format: 1,
    world: (size: (3200, 1600), cells: (32, 16), seed: 7),
    nodes: {
        "plain": Constant(value: 700), // metres
        "relief": Hillshade(version: 3, height: "plain"),
        "steep": Slope(height: "plain"),
    },
    outputs: { "height": "plain", "picture": "relief.colour", "steep": "steep" },
)
"#;

impl Place {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder for the test"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).expect("written");
        path
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// All names in a folder, sorted, including hidden files.
    fn names(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).expect("a folder");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_orograph"));
        command.current_dir(self.0.path()).env("NO_COLOR", "1").env("OROGRAPH_CACHE", "").args(args);
        // No window opens, wherever the tests run.
        ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"].into_iter().for_each(|name| {
            command.env_remove(name);
        });
        command
    }

    /// Runs the program in the folder.
    fn run(&self, args: &[&str]) -> Ran {
        let output = self.command(args).output().expect("the program starts");
        Ran::from(output)
    }

    /// Runs a shell command in the folder, in which `$0` is the program.
    #[cfg(unix)]
    fn shell(&self, line: &str) -> Ran {
        let mut shell = Command::new("sh");
        shell.current_dir(self.0.path()).env("NO_COLOR", "1").env("OROGRAPH_CACHE", "").args([
            "-c",
            line,
            env!("CARGO_BIN_EXE_orograph"),
        ]);
        Ran::from(shell.output().expect("a shell"))
    }
}

/// The result of a run of the program.
#[derive(Debug)]
struct Ran {
    code: i32,
    out: String,
    err: String,
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        assert!(output.status.code().is_some(), "ended by a signal: {output:?}");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the program writes UTF-8");
        Self {
            code: output.status.code().expect("it ends by itself"),
            out: text(output.stdout),
            err: text(output.stderr),
        }
    }
}

impl Ran {
    #[track_caller]
    fn done(self) -> Self {
        assert_eq!(self.code, 0, "{self:?}");
        self
    }

    /// The exit code was this one, and standard error contains each of these.
    #[track_caller]
    fn ended(self, code: i32, said: &[&str]) -> Self {
        assert_eq!(self.code, code, "{self:?}");
        for text in said {
            assert!(self.err.contains(text), "`{text}` is not in:\n{}", self.err);
        }
        self
    }
}

/// The lines of a text as JSON.
#[track_caller]
fn json_lines(text: &str) -> Vec<serde_json::Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"))).collect()
}

/// A file of the repository.
fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}
