//! Tests with the contents of `/proc` on various systems.

use std::{collections::HashMap, path::Path};

use super::{available_by, total_by};

const KIB: u64 = 1 << 10;
const MIB: u64 = 1 << 20;

/// The files of a system, by path.
struct Files(HashMap<&'static str, String>);

/// A machine of 8000 MiB, of which 3000 are free, and 100 MiB of free swap.
fn machine() -> Files {
    let info = "MemTotal:        8192000 kB\nMemFree: 1 kB\nMemAvailable:    3072000 kB\nSwapFree:         102400 kB\n";
    Files(HashMap::from([("/proc/meminfo", info.to_owned())]))
}

impl Files {
    fn with(mut self, path: &'static str, text: impl ToString) -> Self {
        self.0.insert(path, text.to_string());
        self
    }

    /// MiB available, MiB in all.
    fn mib(&self) -> (u64, u64) {
        let read = |path: &Path| self.0.get(path.to_str()?).cloned();
        let [available, total] =
            [available_by(&read), total_by(&read)].map(|bytes| bytes.expect("the system states it") / MIB);
        (available, total)
    }

    /// A hierarchy of version 2, and the group of this process in it.
    fn two(self, root: &str, own: &str) -> Self {
        let mount = format!("30 23 0:26 {root} /sys/fs/cgroup rw,nosuid shared:9 - cgroup2 cgroup2 rw,nsdelegate\n");
        self.with("/proc/self/mountinfo", format!("23 1 0:1 / / rw - ext4 /dev/sda rw\n{mount}"))
            .with("/proc/self/cgroup", format!("0::{own}\n"))
    }

    /// A hierarchy of version 1 and one of version 2 that counts no memory, as in hybrid systems.
    fn hybrid(self, root: &str, own: &str) -> Self {
        let mounts = format!(
            "33 25 0:28 / /sys/fs/cgroup/unified rw shared:10 - cgroup2 cgroup2 rw\n\
             35 25 0:30 {root} /sys/fs/cgroup/cpu rw shared:11 - cgroup cgroup rw,cpu,cpuacct\n\
             36 25 0:31 {root} /sys/fs/cgroup/memory rw shared:12 - cgroup cgroup rw,memory\n"
        );
        self.with("/proc/self/mountinfo", mounts)
            .with("/proc/self/cgroup", format!("5:memory:{own}\n4:cpu,cpuacct:/elsewhere\n0::{own}\n"))
    }
}

#[test]
fn a_machine_without_limits_gives_what_it_has() {
    assert_eq!(machine().mib(), (3100, 8000));
    let nothing = |_: &Path| None;
    assert_eq!((available_by(&nothing), total_by(&nothing)), (None, None));
    let old = |path: &Path| (path == Path::new("/proc/meminfo")).then(|| "MemTotal: 1 kB".to_owned());
    assert_eq!(available_by(&old), None, "kernels before 3.14 do not estimate it");
}

#[test]
fn a_group_of_version_2_limits_memory_and_swap() {
    let group = machine().two("/", "/user.slice/build").with("/sys/fs/cgroup/user.slice/build/memory.max", 900 * MIB);
    let group = group.with("/sys/fs/cgroup/user.slice/build/memory.current", 400 * MIB);
    assert_eq!(group.mib(), (600, 900), "swap is not limited");
    let group = group.with("/sys/fs/cgroup/user.slice/build/memory.swap.max", 30 * MIB);
    let group = group.with("/sys/fs/cgroup/user.slice/build/memory.swap.current", 10 * MIB);
    assert_eq!(group.mib(), (520, 900));
    let stat = format!("anon {}\ninactive_file {}\nactive_file {}\n", 300 * MIB, 60 * MIB, 40 * MIB);
    let group = group.with("/sys/fs/cgroup/user.slice/build/memory.stat", stat);
    assert_eq!(group.mib(), (620, 900), "files in memory give way");
    let group = group.with("/sys/fs/cgroup/user.slice/build/memory.high", 700 * MIB);
    assert_eq!(group.mib(), (420, 700));
    let group = group.with("/sys/fs/cgroup/user.slice/build/memory.current", 4000 * MIB);
    assert_eq!(group.mib(), (20, 700), "more may be used than is allowed");
}

#[test]
fn every_level_above_limits_as_well() {
    let groups = machine()
        .two("/", "/a/b/c")
        .with("/sys/fs/cgroup/a/b/c/memory.max", "max")
        .with("/sys/fs/cgroup/a/b/c/memory.current", MIB)
        .with("/sys/fs/cgroup/a/b/memory.max", 2000 * MIB)
        .with("/sys/fs/cgroup/a/b/memory.current", 500 * MIB)
        .with("/sys/fs/cgroup/a/memory.max", 1000 * MIB)
        .with("/sys/fs/cgroup/a/memory.current", 900 * MIB)
        .with("/sys/fs/cgroup/a/memory.swap.max", 0)
        .with("/sys/fs/cgroup/a/memory.swap.current", 0);
    assert_eq!(groups.mib(), (100, 1000));
    let unlimited = groups.with("/sys/fs/cgroup/a/memory.max", "max\n");
    assert_eq!(unlimited.mib(), (1600, 2000));
}

#[test]
fn groups_of_version_1_count_beside_those_of_version_2() {
    let endless = 9_223_372_036_854_771_712_u64;
    let group = machine()
        .hybrid("/", "/job/7")
        .with("/sys/fs/cgroup/memory/memory.limit_in_bytes", endless)
        .with("/sys/fs/cgroup/memory/memory.usage_in_bytes", 5000 * MIB)
        .with("/sys/fs/cgroup/memory/job/memory.limit_in_bytes", 1500 * MIB)
        .with("/sys/fs/cgroup/memory/job/memory.usage_in_bytes", 300 * MIB)
        .with("/sys/fs/cgroup/memory/job/7/memory.limit_in_bytes", endless)
        .with("/sys/fs/cgroup/memory/job/7/memory.usage_in_bytes", 200 * MIB);
    assert_eq!(group.mib(), (1300, 1500), "1200 and the swap");
    let stat = format!("inactive_file 1\ntotal_inactive_file {}\ntotal_active_file 0\n", 100 * MIB);
    let group = group.with("/sys/fs/cgroup/memory/job/memory.stat", stat);
    assert_eq!(group.mib(), (1400, 1500));
    let group = group.with("/sys/fs/cgroup/memory/job/memory.memsw.limit_in_bytes", 1510 * MIB);
    let group = group.with("/sys/fs/cgroup/memory/job/memory.memsw.usage_in_bytes", 300 * MIB);
    assert_eq!(group.mib(), (1310, 1500), "memory and swap together");
    let flat = group.with("/sys/fs/cgroup/memory/job/memory.use_hierarchy", "0\n");
    assert_eq!(flat.mib(), (3100, 8000), "a group that does not count its children does not limit them");
}

#[test]
fn a_container_sees_its_own_group_at_the_mount_point() {
    // group names are relative to the container
    let own = machine().two("/", "/").with("/sys/fs/cgroup/memory.max", 700 * MIB);
    assert_eq!(own.with("/sys/fs/cgroup/memory.current", 200 * MIB).mib(), (600, 700));
    // group names are the machine's, and the mount point shows the container's group
    for (root, path) in [("/docker/abc", "/docker/abc"), ("/docker/abc", "/docker/abc/worker")] {
        let group = machine().hybrid(root, path).with("/sys/fs/cgroup/memory/memory.limit_in_bytes", 700 * MIB);
        let group = group.with("/sys/fs/cgroup/memory/memory.usage_in_bytes", 200 * MIB);
        assert_eq!(group.mib(), (600, 700), "{path}");
    }
    // the process was moved to a group that the container cannot see; the limit at the mount point is the best known
    let moved = machine().two("/", "/../other").with("/sys/fs/cgroup/memory.max", 700 * MIB);
    assert_eq!(moved.with("/sys/fs/cgroup/memory.current", 200 * MIB).mib(), (600, 700));
}

#[test]
fn files_that_are_missing_or_odd_limit_nothing() {
    let bare = machine().two("/", "/a").with("/sys/fs/cgroup/a/memory.max", "a lot");
    assert_eq!(bare.mib(), (3100, 8000));
    let half = machine().two("/", "/a").with("/sys/fs/cgroup/a/memory.max", 10 * MIB);
    assert_eq!(half.mib(), (3100, 10), "what is used is not told");
    let torn = machine().with("/proc/self/mountinfo", "36 25 0:31 /\n - \n").with("/proc/self/cgroup", "0:\n::\n");
    assert_eq!(torn.mib(), (3100, 8000));
    let spaced = machine()
        .with("/proc/self/mountinfo", "30 23 0:26 / /my\\040groups rw - cgroup2 cgroup2 rw\n")
        .with("/proc/self/cgroup", "0::/a:b\n")
        .with("/my groups/a:b/memory.max", 50 * MIB)
        .with("/my groups/a:b/memory.current", 0);
    assert_eq!(spaced.mib(), (150, 50));
}

#[test]
fn limits_of_the_process_count_what_it_uses() {
    let limits = "Limit                     Soft Limit           Hard Limit           Units     \n\
                  Max data size             unlimited            unlimited            bytes     \n\
                  Max address space         1073741824           2147483648           bytes     \n";
    let status = format!("Name:\torograph\nVmSize:\t  {} kB\nVmData:\t  {} kB\n", 24 * KIB, 4 * KIB);
    let process = machine().with("/proc/self/limits", limits).with("/proc/self/status", status);
    assert_eq!(process.mib(), (1000, 1024));
    let data = limits.replacen("unlimited ", "104857600 ", 1);
    assert_eq!(process.with("/proc/self/limits", data).mib(), (96, 100));
}

#[cfg(target_os = "linux")]
#[test]
fn this_machine_tells() {
    let (available, total) = (super::available(), super::total());
    assert!(available.is_some_and(|bytes| bytes > MIB) && total.is_some_and(|bytes| bytes > MIB));
}
