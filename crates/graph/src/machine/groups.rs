//! The control groups that limit this process's memory, of both versions and at all levels.
//!
//! `/proc/self/cgroup` names the group of each hierarchy and `/proc/self/mountinfo` the folder that shows it. A group
//! is limited by its own limit and by those of all groups above it. In a container only the groups up to the
//! container's are visible; those above it count through the memory that the machine has free.

use std::path::{Component, Path, PathBuf};

use super::Read;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Version {
    One,
    Two,
}

/// A group that counts this process's memory.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Group {
    version: Version,
    folder: PathBuf,
}

/// The groups that count this process's memory, each before its parent.
pub(super) fn memory_groups(read: Read<'_>) -> Vec<Group> {
    let text = |path: &str| read(Path::new(path)).unwrap_or_default();
    let (own, mounts) = (text("/proc/self/cgroup"), text("/proc/self/mountinfo"));
    let mut groups = Vec::new();
    for Mount { version, root, point } in mounts.lines().filter_map(mount) {
        let Some(path) = own.lines().find_map(|line| own_path(line, version)) else { continue };
        let below = below(Path::new(path), &root).unwrap_or_default();
        for part in below.ancestors() {
            let folder = point.join(part);
            let group = Group { version, folder };
            if group.is_below_a_flat_one(read, &point) {
                // the groups above this one do not count its memory
                groups.push(group);
                break;
            }
            groups.push(group);
        }
    }
    groups
}

/// A hierarchy of control groups that counts memory, where it is mounted.
struct Mount {
    version: Version,
    /// The group that the mount point shows.
    root: PathBuf,
    point: PathBuf,
}

/// A line of `/proc/self/mountinfo`: `id parent device root point options [fields] - type source options`.
fn mount(line: &str) -> Option<Mount> {
    let (mount, system) = line.split_once(" - ")?;
    let mut mount = mount.split(' ').skip(3);
    let (root, point) = (mount.next()?, mount.next()?);
    let mut system = system.split(' ');
    let (kind, options) = (system.next()?, system.nth(1)?);
    let version = match kind {
        "cgroup2" => Version::Two,
        "cgroup" if options.split(',').any(|option| option == "memory") => Version::One,
        _ => return None,
    };
    Some(Mount { version, root: unescaped(root), point: unescaped(point) })
}

/// A path of `/proc/self/mountinfo`, where spaces, tabs, line ends and backslashes are written as octal numbers.
fn unescaped(path: &str) -> PathBuf {
    let codes = [("\\040", " "), ("\\011", "\t"), ("\\012", "\n"), ("\\134", "\\")];
    PathBuf::from(codes.iter().fold(path.to_owned(), |path, (code, letter)| path.replace(code, letter)))
}

/// The group in a line of `/proc/self/cgroup`, `number:controllers:path`, if it is the one that counts memory.
fn own_path(line: &str, version: Version) -> Option<&str> {
    let mut parts = line.splitn(3, ':');
    let (number, controllers, path) = (parts.next()?, parts.next()?, parts.next()?);
    let counts = match version {
        Version::One => controllers.split(',').any(|controller| controller == "memory"),
        Version::Two => number == "0" && controllers.is_empty(),
    };
    counts.then_some(path)
}

/// The path from the group of a mount point down to the process's own. Returns None when the mount point does not show
/// it, as when a container sees another's.
fn below(path: &Path, root: &Path) -> Option<PathBuf> {
    let below = path.strip_prefix(root).ok()?;
    below.components().all(|part| matches!(part, Component::Normal(_))).then(|| below.to_owned())
}

impl Group {
    /// Bytes still available within this group: the rest of its limit and of its limit on swap, of which the machine
    /// has `swap_free`. Returns None when it has no limit.
    pub(super) fn room(&self, read: Read<'_>, swap_free: u64) -> Option<u64> {
        let number = |name: &str| self.number(read, name);
        let limit = self.limit(read)?;
        match self.version {
            Version::One => {
                let used = number("memory.usage_in_bytes")?.saturating_sub(self.reclaimable(read));
                let memory = limit.saturating_sub(used);
                // including swap, if that is counted
                let both = number("memory.memsw.limit_in_bytes").zip(number("memory.memsw.usage_in_bytes"));
                let both = both.map_or(u64::MAX, |(limit, used)| {
                    limit.saturating_sub(used.saturating_sub(self.reclaimable(read)))
                });
                Some(memory.saturating_add(swap_free).min(both))
            }
            Version::Two => {
                let used = number("memory.current")?.saturating_sub(self.reclaimable(read));
                let swap = number("memory.swap.max").zip(number("memory.swap.current"));
                let swap = swap.map_or(swap_free, |(limit, used)| limit.saturating_sub(used).min(swap_free));
                Some(limit.saturating_sub(used).saturating_add(swap))
            }
        }
    }

    /// Memory limit of this group in bytes; above `memory.high` its processes are slowed down until they hardly
    /// progress. Returns None when it has no limit.
    pub(super) fn limit(&self, read: Read<'_>) -> Option<u64> {
        let names: &[&str] = match self.version {
            Version::One => &["memory.limit_in_bytes"],
            Version::Two => &["memory.max", "memory.high"],
        };
        names.iter().filter_map(|name| self.number(read, name)).min()
    }

    /// Bytes of the page cache of this group, which the system releases before it refuses an allocation.
    fn reclaimable(&self, read: Read<'_>) -> u64 {
        let stat = read(&self.folder.join("memory.stat")).unwrap_or_default();
        let names = match self.version {
            Version::One => ["total_inactive_file", "total_active_file"],
            Version::Two => ["inactive_file", "active_file"],
        };
        let value = |name: &str| -> Option<u64> {
            let line = stat.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '))?;
            line.trim().parse().ok()
        };
        names.into_iter().filter_map(value).sum()
    }

    /// A number in one of its files. Returns None for `max`.
    fn number(&self, read: Read<'_>, name: &str) -> Option<u64> {
        read(&self.folder.join(name))?.trim().parse().ok()
    }

    /// Returns true if the parent group, if it is visible, does not count the memory of its children
    /// (`memory.use_hierarchy` of version 1, which is always on in newer systems).
    fn is_below_a_flat_one(&self, read: Read<'_>, point: &Path) -> bool {
        let above = self.folder.parent().filter(|above| above.starts_with(point));
        let told = above.and_then(|above| read(&above.join("memory.use_hierarchy")));
        self.version == Version::One && told.is_some_and(|told| told.trim() == "0")
    }
}
