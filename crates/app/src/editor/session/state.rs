//! The state of nodes and outputs in a session.

use std::{sync::Arc, time::Duration};

use orograph_graph::Value;

use crate::report::expect::Checked;

/// The state of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum NodeState {
    /// The state is unknown, or the result is out of date.
    #[default]
    Waiting,
    /// Its kernel is running.
    Running {
        /// The finished part, 0 to 1.
        fraction: f32,
    },
    /// A required input is not wired yet.
    Unwired {
        /// The input.
        input: &'static str,
        /// The node that lacks the input, if it is another one.
        at: Option<String>,
    },
    /// Its results are up to date.
    Fresh,
    /// It could not be built.
    Failed {
        /// The reason.
        message: String,
        /// The remedy.
        hint: Option<String>,
        /// The node that failed, if it is another one.
        at: Option<String>,
    },
}

impl NodeState {
    /// The missing input, as text. Returns None when no wire is missing.
    #[must_use]
    pub fn lacks(&self) -> Option<String> {
        match self {
            Self::Unwired { input, at: None } => Some(format!("Needs an input: {input}")),
            Self::Unwired { input, at: Some(at) } => Some(format!("Waiting for {at} (no {input} input)")),
            _ => None,
        }
    }
}

/// The known state of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeInfo {
    /// Its state.
    pub state: NodeState,
    /// How long its kernel last ran, and with how many cells along the longer side.
    pub time: Option<(Duration, u32)>,
    /// The size of its results then, in bytes.
    pub bytes: usize,
    /// Its warnings.
    pub warnings: Vec<String>,
    /// True if its results are those of a graphics device.
    pub on_device: bool,
}

/// An output that has been built.
#[derive(Clone, Debug)]
pub struct Built {
    /// The state of the document that it was built from.
    pub revision: u64,
    /// Cells along the longer side.
    pub cells: u32,
    /// Increases with each intermediate result; 0 for the final result.
    pub step: u64,
    /// The value.
    pub value: Value,
}

/// A message for the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The text.
    pub message: String,
    /// True if something failed.
    pub error: bool,
}

/// The figures of what the file expects.
#[derive(Clone, Debug)]
pub struct Measured {
    /// The revision that they belong to.
    pub revision: u64,
    /// The figures, or why there are none.
    pub checked: Result<Arc<Checked>, String>,
}
