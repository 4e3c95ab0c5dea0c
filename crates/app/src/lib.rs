//! The program `orograph`, as a library so that tests can call its parts: the command line ([`cli`]), what it says and
//! where ([`terminal`], [`progress`], [`problems`]), what is asked for ([`request`]), how it is built and written
//! ([`build`], [`outputs`], [`piece`], [`engine`], [`mesh`]), and how it fails ([`Failure`], [`memory`]). With the feature `editor` there is the
//! window ([`editor`]) and land in three dimensions ([`view`]).

pub mod archive;
pub mod build;
pub mod cli;
#[cfg(feature = "editor")]
pub mod editor;
pub mod engine;
mod failure;
mod geojson;
pub mod heightfile;
mod machine;
pub mod measure;
pub mod memory;
pub mod mesh;
pub mod outputs;
pub mod picture;
pub mod piece;
pub mod problems;
pub mod progress;
pub mod request;
mod stop;
pub mod storage;
pub mod terminal;
#[cfg(test)]
mod testing;
mod vertices;
#[cfg(feature = "editor")]
pub mod view;
mod watch;

pub use cli::run;
pub use failure::{Exit, Failure};
