//! Dialogs: files, examples, export, and questions that need an answer.

pub(crate) mod browser;
pub(crate) mod export;
pub(crate) mod gallery;
pub(crate) mod questions;
pub(crate) mod system;
pub(super) mod variations;
pub(super) mod welcome;
