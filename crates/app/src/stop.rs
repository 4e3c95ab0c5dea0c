//! Signals. Ctrl-C: the first press cancels the work, which removes unfinished files; the second ends the program at
//! once, which may leave the hidden folder of unfinished files, which the next run removes.

use orograph_graph::{Cancel, memory::REMEDY};

use crate::{
    machine,
    report::failure::{Exit, Failure},
};

/// A switch that is set by Ctrl-C or SIGTERM.
///
/// # Errors
/// When the system refuses a signal handler. A program can install one only once.
pub fn on_interrupt() -> Result<Cancel, Failure> {
    let unable = |why: &str| Failure::unable(format!("cannot listen for Ctrl-C: {why}")).hint(REMEDY);
    if !machine::has_room_for(1) {
        return Err(unable("there is no memory for a thread"));
    }
    let cancel = Cancel::default();
    let switch = cancel.clone();
    let handler = move || {
        if switch.is_cancelled() {
            std::process::exit(i32::from(Exit::Stopped as u8));
        }
        switch.cancel();
    };
    ctrlc::set_handler(handler).map_err(|error| unable(&error.to_string()))?;
    Ok(cancel)
}

/// Makes a write beyond the limit on the size of files fail, so that it is reported; otherwise the system ends the
/// program.
#[cfg_attr(target_os = "linux", expect(unsafe_code, reason = "a call of the system"))]
pub fn survive_file_limits() {
    #[cfg(target_os = "linux")]
    // SAFETY: no code runs for a signal that is ignored.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
}
