//! The memory that the machine gives this process: its own memory, the limits of the control groups that the process is
//! in, and the limits of the process itself. Known on Linux only; elsewhere a failing allocation is the only sign.

mod groups;
mod process;
#[cfg(test)]
mod tests;

use std::path::Path;

use groups::memory_groups;

/// Reads a small file of the system. Returns None when it does not exist. Tests replace it.
type Read<'a> = &'a dyn Fn(&Path) -> Option<String>;

/// Bytes that this process can allocate without displacing others: free memory and swap, within what is left of every
/// limit. Returns None when the system does not report them.
#[must_use]
pub fn available() -> Option<u64> {
    available_by(&|path| std::fs::read_to_string(path).ok())
}

/// Bytes of memory that this process could allocate if nothing else ran: the machine's memory without swap, within
/// every limit. Limits of caches depend on it. Returns None when the system does not report it.
#[must_use]
pub fn total() -> Option<u64> {
    total_by(&|path| std::fs::read_to_string(path).ok())
}

fn available_by(read: Read<'_>) -> Option<u64> {
    let machine = process::machine(&read(Path::new("/proc/meminfo"))?)?;
    let groups = memory_groups(read).into_iter().map(|group| group.room(read, machine.swap_free));
    let own = process::limits(read).into_iter().map(|limit| Some(limit.left()));
    let limits = groups.chain(own).flatten();
    Some(limits.fold(machine.free.saturating_add(machine.swap_free), u64::min))
}

fn total_by(read: Read<'_>) -> Option<u64> {
    let machine = process::machine(&read(Path::new("/proc/meminfo"))?)?;
    let groups = memory_groups(read).into_iter().map(|group| group.limit(read));
    let own = process::limits(read).into_iter().map(|limit| Some(limit.most));
    Some(groups.chain(own).flatten().fold(machine.total, u64::min))
}
