//! The program `orograph`, as a library so that tests can call its parts: the command line ([`cli`]); requests and
//! builds ([`build`]); output files ([`export`]) and input files ([`files`]); messages, progress and failures
//! ([`report`], [`Failure`]); the allocator that handles a refused allocation ([`memory`]). The feature `editor` adds
//! the editor ([`editor`]) and the 3D view ([`view`]).

pub mod build;
pub mod cli;
#[cfg(all(test, feature = "editor"))]
#[path = "../tests/common/device.rs"]
mod device;
#[cfg(feature = "editor")]
pub mod editor;
pub mod export;
pub mod files;
mod machine;
pub mod memory;
pub mod report;
mod stop;
#[cfg(test)]
mod testing;
#[cfg(feature = "editor")]
pub mod view;

#[cfg(test)]
extern crate self as orograph;

pub use crate::report::failure::{Exit, Failure, remedy};
pub use cli::run;
