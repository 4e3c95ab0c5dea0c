//! The program `orograph`, as a library so that tests can call its parts: the command line ([`cli`]), what it says and
//! where ([`terminal`]), and how it fails ([`Failure`]).

pub mod cli;

mod failure;
pub mod problems;
pub mod terminal;

pub use cli::run;
pub use failure::{Exit, Failure};
