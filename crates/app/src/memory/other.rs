//! The end of the program with the standard library, for systems for which no system calls are implemented here. If an
//! allocation is refused meanwhile, the program ends at once.

use std::{ffi::CStr, io::Write as _, path::Path};

use orograph_graph::memory::Left;

/// Returns true if errors go to a terminal.
pub(super) fn is_terminal() -> bool {
    std::io::IsTerminal::is_terminal(&std::io::stderr())
}

/// The stream to write to.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stream {
    Output,
    Error,
}

/// Writes as much of the text as possible.
pub(super) fn say(to: Stream, text: &[u8]) {
    let _ = match to {
        Stream::Output => std::io::stdout().write_all(text),
        Stream::Error => std::io::stderr().write_all(text),
    };
}

/// Ends the program.
pub(super) fn leave() -> ! {
    std::process::exit(i32::from(crate::Exit::Unable as u8))
}

/// Removes leftover files, as far as possible. The path ends with a zero byte.
pub(super) fn remove(path: &[u8], left: Left) {
    let Some(path) = CStr::from_bytes_with_nul(path).ok().and_then(|path| path.to_str().ok()).map(Path::new) else {
        return;
    };
    let _ = match left {
        Left::Temporary if path.is_dir() => std::fs::remove_dir_all(path),
        Left::Temporary => std::fs::remove_file(path),
        Left::Around => std::fs::remove_dir(path),
    };
}
