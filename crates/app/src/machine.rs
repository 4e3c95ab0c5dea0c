//! Resources of the machine: time, memory, threads.

use std::{error::Error as _, fs, num::NonZero, sync::OnceLock, thread::available_parallelism, time::Instant};

use orograph_graph::{EvalError, memory::with_capacity};

use crate::report::failure::Failure;

/// The time, for reports about a run; no result depends on it.
#[expect(clippy::disallowed_methods, reason = "durations are reported, never computed with")]
#[must_use]
pub fn now() -> Instant {
    Instant::now()
}

/// The peak memory of the program in bytes, if the system reports it (Linux).
#[must_use]
pub fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// Address space of a thread: its stack, and what the system and the libraries add.
const THREAD_BYTES: usize = 9 << 20;

/// Returns true if there is room for this many more threads. Check it before starting them: the program ends if there
/// is room for a stack but not for the rest.
#[must_use]
pub fn has_room_for(threads: usize) -> bool {
    with_capacity::<u8>(threads.saturating_mul(THREAD_BYTES)).is_ok()
}

/// Starts the threads that write files, as many as the threads that compute nodes: one per core by default. They are
/// started once; later calls have no effect.
///
/// # Errors
/// When the system cannot start threads.
pub fn start_threads(threads: Option<NonZero<usize>>) -> Result<(), Failure> {
    static STARTED: OnceLock<Result<(), String>> = OnceLock::new();
    let start = || {
        let count = threads.or_else(|| available_parallelism().ok()).map_or(1, NonZero::get);
        // the computing threads come on top
        if !has_room_for(2 * count) {
            return Err(format!("there is no memory for {count} of them"));
        }
        let started = rayon::ThreadPoolBuilder::new().num_threads(count).build_global();
        // an error without a source means that they are already running
        started.or_else(|error| error.source().map_or(Ok(()), |error| Err(error.to_string())))
    };
    STARTED.get_or_init(start).clone().map_err(|why| {
        let error = EvalError::Threads(why);
        Failure { hint: error.hint(), ..Failure::unable(error.to_string()) }
    })
}
