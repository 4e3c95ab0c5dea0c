//! A virtual display, with its pointer, keyboard and picture.

use std::{
    collections::HashSet,
    io::{BufRead as _, BufReader, Write as _},
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use image::{Rgb, RgbImage};

/// Size in pixels of the display and of the window; a smaller one is drawn faster.
pub(crate) const SIZE: [u32; 2] = [1280, 720];
/// Timeout: longer than any of these operations takes on a busy machine without a graphics card, where the first frame
/// with terrain can take a minute.
const PATIENCE: Duration = Duration::from_secs(300);
/// Time for an action of the pointer to take effect before it is repeated.
pub(crate) const TRIAL: Duration = Duration::from_secs(40);
/// The variable that makes a missing tool a failure.
const VARIABLE: &str = "OROGRAPH_ALL_TESTS";
/// The tools, each with an argument that makes it exit at once.
const TOOLS: [(&str, &str); 3] = [("Xvfb", "-help"), ("xdotool", "version"), ("import", "-version")];

/// Polls until `look` finds something.
#[track_caller]
pub(crate) fn until<T>(what: &str, look: impl FnMut() -> Option<T>) -> T {
    within(PATIENCE, look).unwrap_or_else(|| panic!("{what}: not after {PATIENCE:?}"))
}

/// Polls for this long. Returns None at the timeout.
pub(crate) fn within<T>(time: Duration, mut look: impl FnMut() -> Option<T>) -> Option<T> {
    let start = Instant::now();
    loop {
        let found = look();
        if found.is_some() || start.elapsed() > time {
            return found;
        }
        thread::sleep(Duration::from_millis(20));
    }
}

/// A part of a picture: left, top, right, bottom.
pub(crate) type Area = [u32; 4];

/// The colours in a part of a picture.
pub(crate) fn pixels(picture: &RgbImage, [left, top, right, bottom]: Area) -> Vec<Rgb<u8>> {
    (top..bottom).flat_map(|y| (left..right).map(move |x| *picture.get_pixel(x, y))).collect()
}

/// The number of colours in a part of a picture.
pub(crate) fn colours(picture: &RgbImage, area: Area) -> usize {
    pixels(picture, area).into_iter().collect::<HashSet<_>>().len()
}

/// The number of pixels of a colour in a part of a picture.
pub(crate) fn count(picture: &RgbImage, area: Area, colour: Rgb<u8>) -> usize {
    pixels(picture, area).into_iter().filter(|pixel| *pixel == colour).count()
}

/// The square of this half side around a position.
pub(crate) fn around([x, y]: [i32; 2], by: i32) -> Area {
    [x - by, y - by, x + by, y + by].map(|x| x as u32)
}

/// A display in memory.
pub(crate) struct Screen {
    server: Child,
    /// Its name, for the variable `DISPLAY`.
    pub(crate) name: String,
}

impl Screen {
    /// Opens a display. Returns None when the tools for it are missing.
    pub(crate) fn open() -> Option<Self> {
        let missing = TOOLS.iter().find(|(tool, argument)| {
            let quiet = |command: &mut Command| command.stdout(Stdio::null()).stderr(Stdio::null()).status();
            quiet(Command::new(tool).arg(argument)).is_err()
        });
        if let Some((tool, _)) = missing {
            assert!(std::env::var_os(VARIABLE).is_none(), "`{tool}` is not installed");
            // A message that libtest does not capture; failing to write it does not fail the test.
            let _ = writeln!(std::io::stderr(), "SKIPPED the real window: `{tool}` is not installed");
            return None;
        }
        if crate::device::skips("the real window") {
            return None;
        }
        let size = format!("{}x{}x24", SIZE[0], SIZE[1]);
        let mut command = Command::new("Xvfb");
        // The server chooses a free display number, and prints it when it is ready. Without `-noreset` it would restart
        // after the editor closes, and could be unreachable when the next one connects.
        command.args(["-displayfd", "1", "-noreset", "-nolisten", "tcp", "-screen", "0", &size]);
        let mut server = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it starts");
        let mut number = String::new();
        let line = BufReader::new(server.stdout.take().expect("piped")).read_line(&mut number);
        let name = format!(":{}", number.trim());
        let screen = Self { server, name };
        assert!(line.is_ok() && screen.name.len() > 1, "there is no display");
        Some(screen)
    }

    /// The output of `xdotool`. Returns None when the command failed.
    pub(crate) fn ask(&self, arguments: &[&str]) -> Option<String> {
        let output = self.tool("xdotool").args(arguments).output().expect("it runs");
        output.status.success().then(|| String::from_utf8_lossy(&output.stdout).into_owned())
    }

    #[track_caller]
    fn tell(&self, arguments: &[&str]) {
        assert!(self.ask(arguments).is_some(), "{arguments:?}");
    }

    fn tool(&self, name: &str) -> Command {
        let mut command = Command::new(name);
        command.env("DISPLAY", &self.name).stderr(Stdio::null());
        command
    }

    /// The window whose title contains this text.
    pub(crate) fn window(&self, title: &str) -> Option<String> {
        self.ask(&["search", "--onlyvisible", "--name", title])?.lines().next().map(str::to_owned)
    }

    /// Presses keys, one after the other.
    #[track_caller]
    pub(crate) fn keys(&self, keys: &[&str]) {
        self.tell(&[&["key", "--delay", "8"], keys].concat());
    }

    /// Moves the pointer, starting beside the position so that there is always a movement.
    #[track_caller]
    pub(crate) fn point(&self, at: [i32; 2]) {
        self.step(at.map(|x| x - 1));
        self.step(at);
    }

    /// Clicks at a position.
    #[track_caller]
    pub(crate) fn click(&self, at: [i32; 2]) {
        self.point(at);
        self.tell(&["click", "1"]);
    }

    #[track_caller]
    fn step(&self, at: [i32; 2]) {
        let [x, y] = at.map(|x| x.to_string());
        self.tell(&["mousemove", &x, &y]);
    }

    /// Drags from one position to another. The button is pressed when `ready` finds that the window has seen the pointer,
    /// and released when `seen` finds something, or after a timeout, so that the callers try again.
    #[track_caller]
    pub(crate) fn drag<T>(
        &self,
        [from, to]: [[i32; 2]; 2],
        ready: impl FnMut() -> Option<()>,
        seen: impl FnMut() -> Option<T>,
    ) -> Option<T> {
        self.point(from);
        within(TRIAL, ready)?;
        self.tell(&["mousedown", "1"]);
        self.step([(from[0] + to[0]) / 2, (from[1] + to[1]) / 2]);
        self.step(to);
        let found = within(TRIAL, seen);
        self.tell(&["mouseup", "1"]);
        found
    }

    /// The picture of the display.
    pub(crate) fn picture(&self) -> Option<RgbImage> {
        let output = self.tool("import").args(["-window", "root", "-depth", "8", "rgb:-"]).output().ok()?;
        RgbImage::from_raw(SIZE[0], SIZE[1], output.stdout)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}
