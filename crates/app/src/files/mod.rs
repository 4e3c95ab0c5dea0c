//! Input files: archives, height files, and file watching.

pub mod archive;
pub mod heightfile;
pub(crate) mod watch;

/// Returns true if Windows keeps a name for a device, with any ending and in any case.
pub(crate) fn is_device(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or(name).trim_end().to_ascii_lowercase();
    let is_port = ["com", "lpt"].iter().any(|port| {
        stem.strip_prefix(port).is_some_and(|number| number.len() == 1 && number.chars().all(|c| c.is_ascii_digit()))
    });
    is_port || ["con", "prn", "aux", "nul"].contains(&stem.as_str())
}
