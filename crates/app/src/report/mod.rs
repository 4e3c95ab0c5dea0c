//! Output of the program: progress, problems, failures and measures, on a terminal or as JSON.

pub mod expect;
pub(crate) mod failure;
pub mod measure;
pub mod problems;
pub mod progress;
pub mod reading;
pub mod terminal;
