//! Ctrl-C: the first asks the work to stop, which removes what is half done; the second ends the program at once, which
//! may leave the hidden folder of half-written files.

use orograph_graph::{Cancel, memory::REMEDY};

use crate::{
    failure::{Exit, Failure},
    machine,
};

/// A switch that Ctrl-C turns, or a polite request of the system to end.
///
/// # Errors
/// When the system gives no handler for signals. A program can ask for one only once.
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
