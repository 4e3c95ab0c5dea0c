//! Input files: archives, height files, and file watching.

pub mod archive;
pub mod heightfile;
pub(crate) mod watch;
