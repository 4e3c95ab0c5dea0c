//! The last words of a program without memory. Nothing here allocates.

use std::{
    cell::Cell,
    fmt::{self, Write as _},
    sync::atomic::{AtomicBool, Ordering},
    time::Duration,
};

use orograph_graph::memory::{REMEDY, each_leftover, each_running};

use super::system;

/// Whether the editor keeps what was not saved.
static JOURNAL: AtomicBool = AtomicBool::new(false);

/// Whether a thread is ending the program.
static ENDING: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Whether it is this one.
    static ENDING_HERE: Cell<bool> = const { Cell::new(false) };
}

/// From now on work that was not saved is in a journal, which is said when the program ends for lack of memory.
pub fn keeps_a_journal() {
    JOURNAL.store(true, Ordering::Relaxed);
}

/// Ends the program because so many bytes were refused.
#[cold]
pub(super) fn end(bytes: usize) -> ! {
    if ENDING_HERE.replace(true) {
        // cleaning up has asked for memory itself
        system::leave();
    }
    if ENDING.swap(true, Ordering::Relaxed) {
        // another thread does it; this one must not go on without its memory
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }
    let mut text = Text { bytes: [0; 4096], len: 0 };
    text.push(if system::is_terminal() { "\nerror: " } else { "error: " });
    tell(&mut text, bytes);
    system::say(text.written());
    each_leftover(system::remove);
    system::leave();
}

/// What has happened and what helps.
fn tell(text: &mut Text, bytes: usize) {
    let (size, unit) = match bytes {
        0..1024 => (bytes, "bytes"),
        1024..0x10_0000 => (bytes >> 10, "KiB"),
        0x10_0000.. => (bytes >> 20, "MiB"),
    };
    // a text that is full drops what comes after
    let _ = write!(text, "out of memory: the system refused another {size} {unit}");
    let mut before = " while ";
    each_running(|name| {
        text.push(before);
        text.push("`");
        text.push_bytes(name);
        text.push("`");
        before = ", ";
    });
    text.push(if before == ", " { " ran\n" } else { "\n" });
    text.push(" hint: ");
    text.push(REMEDY);
    text.push("\n");
    if JOURNAL.load(Ordering::Relaxed) {
        text.push(" note: work that was not saved is in the journal; open the editor again to recover it\n");
    }
}

/// A text of bounded length, whose characters were checked by who wrote them.
struct Text {
    bytes: [u8; 4096],
    len: usize,
}

impl Text {
    fn push(&mut self, text: &str) {
        self.push_bytes(text.as_bytes());
    }

    fn push_bytes(&mut self, text: &[u8]) {
        let room = &mut self.bytes[self.len..];
        let len = text.len().min(room.len());
        room[..len].copy_from_slice(&text[..len]);
        self.len += len;
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

    fn told(bytes: usize) -> String {
        let mut text = Text { bytes: [0; 4096], len: 0 };
        tell(&mut text, bytes);
        String::from_utf8(text.written().to_vec()).expect("text")
    }

    #[test]
    fn the_nodes_the_size_and_the_remedy_are_named() {
        let nodes = [running("rivers"), running("scree")];
        let text = told(3 << 20);
        drop(nodes);
        assert!(text.starts_with("out of memory: the system refused another 3 MiB while "), "{text}");
        assert!(
            text.contains("`rivers`, `scree`") && text.contains(" ran\n hint: give the world fewer cells"),
            "{text}"
        );
        assert!(told(700).contains("another 700 bytes") && told(70_000).contains("another 68 KiB"));
    }

    #[test]
    fn a_text_that_is_full_is_cut() {
        let mut text = Text { bytes: [0; 4096], len: 0 };
        (0..500).for_each(|_| text.push("0123456789"));
        assert_eq!(text.written().len(), 4096);
    }
}
