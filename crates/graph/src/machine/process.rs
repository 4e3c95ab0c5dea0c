//! The machine's memory and the limits of this process, as reported by `/proc`.

use std::path::Path;

use super::Read;

/// The memory of the machine in bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Machine {
    /// All memory, without swap.
    pub(super) total: u64,
    /// Memory available without swapping, as the kernel estimates it.
    pub(super) free: u64,
    /// Unused swap.
    pub(super) swap_free: u64,
}

/// The memory according to `/proc/meminfo`.
pub(super) fn machine(info: &str) -> Option<Machine> {
    let (total, free) = (kib(info, "MemTotal")?, kib(info, "MemAvailable")?);
    Some(Machine { total, free, swap_free: kib(info, "SwapFree").unwrap_or(0) })
}

/// A limit of this process (`setrlimit`) in bytes, and how much of it is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Limit {
    pub(super) most: u64,
    pub(super) used: u64,
}

impl Limit {
    pub(super) const fn left(self) -> u64 {
        self.most.saturating_sub(self.used)
    }
}

/// The limits on address space (`RLIMIT_AS`) and data (`RLIMIT_DATA`), if they are set.
pub(super) fn limits(read: Read<'_>) -> Vec<Limit> {
    let text = |path: &str| read(Path::new(path)).unwrap_or_default();
    let (limits, status) = (text("/proc/self/limits"), text("/proc/self/status"));
    // name, soft limit, hard limit, unit; the soft one is in force
    let soft = |name: &str| -> Option<u64> {
        let line = limits.lines().find_map(|line| line.strip_prefix(name))?;
        line.split_whitespace().next()?.parse().ok()
    };
    let limit = |name, used| Some(Limit { most: soft(name)?, used: kib(&status, used).unwrap_or(0) });
    [limit("Max address space", "VmSize"), limit("Max data size", "VmData")].into_iter().flatten().collect()
}

/// The value of a line `NAME: 1234 kB`, in bytes.
fn kib(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?;
    rest.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}
