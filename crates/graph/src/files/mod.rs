//! Files on disk: each appears whole, a set of them together, and what killed processes leave is removed.
//!
//! All changes that the program makes to documents, outputs, archives, journals and stored results go through here:
//!
//! - [`Part`] is a file under a temporary name, which is renamed when it is complete.
//! - [`Staging`] is a temporary folder; [`Staging::commit`] exchanges its files for those of the folder around it, all
//!   of them or none, even if the process is killed or the power fails meanwhile.
//! - [`Out`] and the functions of this module are the single calls of the system.
//! - [`faults`] makes any of these calls fail, for tests.
//!
//! Temporary names are `.orograph-` with 16 hexadecimal digits: `.part` for a file, and a folder with a file `.lock` of
//! the same name. The process that owns one holds the file locked. A file whose lock is free belongs to a process that
//! is dead: the next one that writes to the folder completes the exchange that it began, and removes the rest.

mod calls;
mod exchange;
pub mod faults;
mod hold;
mod part;
mod staging;
mod sweep;
#[cfg(test)]
mod tests;

pub use calls::{
    Access, Out, create_folder, create_folders, flush_all, flush_folder, remove_all, remove_file, remove_folder, rename,
};
pub use exchange::{Change, CommitError};
pub use part::Part;
pub use staging::{Staging, settle};
pub(crate) use sweep::remove_if_dead;
