//! The final message of a program without memory. Nothing here allocates.

use std::{
    cell::Cell,
    fmt::{self, Write as _},
    mem,
    sync::{
        Mutex, PoisonError, TryLockError,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use orograph_graph::memory::{REMEDY, each_leftover, each_running};

use super::system;

/// True if the editor keeps a journal of unsaved work.
static JOURNAL: AtomicBool = AtomicBool::new(false);

/// True if standard output has lines of JSON.
static JSON_LINES: AtomicBool = AtomicBool::new(false);

/// Held while a line of JSON is written, and from the last one on.
static LINE: Mutex<()> = Mutex::new(());

/// True while a thread is ending the program.
static ENDING: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// True on the thread that is ending the program.
    static ENDING_HERE: Cell<bool> = const { Cell::new(false) };
}

/// Records that unsaved work is in a journal, so that the final message mentions it.
pub fn keeps_a_journal() {
    JOURNAL.store(true, Ordering::Relaxed);
}

/// Records that standard output has lines of JSON, so that its last line is JSON even when the program runs out of
/// memory.
pub fn writes_json_lines() {
    JSON_LINES.store(true, Ordering::Relaxed);
}

/// Writes a line of JSON. If the last line has been written, the thread waits for the program's end instead.
pub fn in_json_line<T>(write: impl FnOnce() -> T) -> T {
    let _line = LINE.lock().unwrap_or_else(PoisonError::into_inner);
    write()
}

/// Ends the program because an allocation of this many bytes was refused.
#[cold]
pub(super) fn end(bytes: usize) -> ! {
    if ENDING_HERE.replace(true) {
        // cleaning up has itself run out of memory
        system::leave();
    }
    if ENDING.swap(true, Ordering::Relaxed) {
        // another thread is ending the program; this one must not continue without its memory
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }
    let mut text = Text::new();
    text.push(if system::is_terminal() { "\nerror: " } else { "error: " });
    tell(&mut text, bytes);
    system::say(system::Stream::Error, text.written());
    if JSON_LINES.load(Ordering::Relaxed) {
        let mut line = Text::new();
        tell_json(&mut line, bytes);
        no_more_lines();
        system::say(system::Stream::Output, line.written());
    }
    each_leftover(system::remove);
    system::leave();
}

/// Waits until no other thread is writing a line of JSON, and prevents further lines.
fn no_more_lines() {
    /// A thread that takes longer was itself refused memory while writing its line. It waits for the end as well and
    /// keeps the lock, so that nothing follows the last line in this case either.
    const LONGEST_MS: u32 = 1000;
    for _ in 0..LONGEST_MS {
        match LINE.try_lock() {
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(1)),
            line => return mem::forget(line),
        }
    }
}

/// Writes the reason and the remedy.
fn tell(text: &mut Text, bytes: usize) {
    tell_what(text, bytes);
    text.push("\n hint: ");
    text.push(REMEDY);
    text.push("\n");
    if JOURNAL.load(Ordering::Relaxed) {
        text.push(" note: work that was not saved is in the journal; open the editor again to recover it\n");
    }
}

/// Writes the same as the last line of `--json`.
fn tell_json(line: &mut Text, bytes: usize) {
    let _ = write!(line, r#"{{"event":"error","exit":{},"message":""#, crate::Exit::Unable as u8);
    let mut what = Text::new();
    tell_what(&mut what, bytes);
    line.push_escaped(what.written());
    line.push(r#"","code":"memory","help":""#);
    line.push_escaped(REMEDY.as_bytes());
    line.push("\"}\n");
}

/// Writes how much memory was refused, and which nodes were running.
fn tell_what(text: &mut Text, bytes: usize) {
    let (size, unit) = match bytes {
        0..1024 => (bytes, "bytes"),
        1024..0x10_0000 => (bytes >> 10, "KiB"),
        0x10_0000.. => (bytes >> 20, "MiB"),
    };
    // text that does not fit is truncated
    let _ = write!(text, "out of memory: the system refused another {size} {unit}");
    let mut before = " while ";
    each_running(|name| {
        text.push(before);
        text.push("`");
        text.push_bytes(name);
        text.push("`");
        before = ", ";
    });
    if before == ", " {
        text.push(" ran");
    }
}

/// A text of bounded length; the caller guarantees valid UTF-8.
struct Text {
    bytes: [u8; 4096],
    len: usize,
}

impl Text {
    const fn new() -> Self {
        Self { bytes: [0; 4096], len: 0 }
    }

    fn push(&mut self, text: &str) {
        self.push_bytes(text.as_bytes());
    }

    fn push_bytes(&mut self, text: &[u8]) {
        let room = &mut self.bytes[self.len..];
        let len = text.len().min(room.len());
        room[..len].copy_from_slice(&text[..len]);
        self.len += len;
    }

    /// Appends text to a JSON string, as much as leaves room for the end of the line.
    fn push_escaped(&mut self, text: &[u8]) {
        const END: usize = 1024;
        for &byte in text {
            if self.len + END > self.bytes.len() {
                return;
            }
            match byte {
                b'"' | b'\\' => self.push_bytes(&[b'\\', byte]),
                0..0x20 => {
                    let _ = write!(self, "\\u{byte:04x}");
                }
                _ => self.push_bytes(&[byte]),
            }
        }
    }

    fn written(&self) -> &[u8] {
        &self.bytes[..self.len]
    }
}

impl fmt::Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.push(text);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::memory::running;

    use super::*;

    fn message_for(bytes: usize) -> String {
        let mut text = Text::new();
        tell(&mut text, bytes);
        String::from_utf8(text.written().to_vec()).expect("text")
    }

    #[test]
    fn the_message_names_nodes_size_and_hint() {
        let nodes = [running("rivers"), running("scree")];
        let text = message_for(3 << 20);
        drop(nodes);
        assert!(text.starts_with("out of memory: the system refused another 3 MiB while "), "{text}");
        assert!(
            text.contains("`rivers`, `scree`") && text.contains(" ran\n hint: give the world fewer cells"),
            "{text}"
        );
        assert!(message_for(700).contains("another 700 bytes") && message_for(70_000).contains("another 68 KiB"));
    }

    #[test]
    fn the_line_of_json_is_well_formed() {
        let nodes = [running("a \"quoted\" name\\\n"), running(&"long ".repeat(2000))];
        let mut line = Text::new();
        tell_json(&mut line, 3 << 20);
        drop(nodes);
        assert_eq!(line.written().last(), Some(&b'\n'));
        let value: serde_json::Value = serde_json::from_slice(line.written()).expect("a line of JSON");
        assert_eq!((&value["event"], &value["exit"]), (&"error".into(), &2.into()));
        let message = value["message"].as_str().expect("a message");
        assert!(message.contains("another 3 MiB while `a \"quoted\" name\\\n`, `long "), "{message}");
        assert_eq!(value["help"], REMEDY);
    }

    #[test]
    fn text_that_does_not_fit_is_cut() {
        let mut text = Text::new();
        (0..500).for_each(|_| text.push("0123456789"));
        assert_eq!(text.written().len(), 4096);
    }
}
