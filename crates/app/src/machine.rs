//! What the machine tells: time, memory.

use std::{fs, time::Instant};

/// The time, for what is told of a run; no result depends on it.
#[expect(clippy::disallowed_methods, reason = "durations are reported, never computed with")]
#[must_use]
pub fn now() -> Instant {
    Instant::now()
}

/// Bytes of memory that the program has used at most so far, where the system says so (Linux).
#[must_use]
pub fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}
