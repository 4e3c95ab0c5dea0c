//! Why an evaluation gave no result.

use std::path::PathBuf;

use crate::{
    memory::{OutOfMemory, REMEDY},
    value::PortType,
    world::{WorldError, bytes},
};

/// Why an evaluation gave no result. The message names the node; [`EvalError::hint`] says what would help.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvalError {
    /// It was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The world cannot be evaluated.
    #[error(transparent)]
    World(#[from] WorldError),
    /// What was asked for does not exist.
    #[error("{0}")]
    Request(String),
    /// An input that must be wired is not.
    #[error("nothing is wired to `{input}` of `{node}` ({id})")]
    Unwired {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// The input.
        input: &'static str,
    },
    /// What is wired to an input does not fit, since a parameter has changed the type of the source.
    #[error("`{from}` gives a {gives}, but `{to}` takes a {takes}")]
    Type {
        /// The output, as `node.port`.
        from: String,
        /// What it gives.
        gives: PortType,
        /// The input, as `node.port`.
        to: String,
        /// What it takes.
        takes: PortType,
    },
    /// The constant at an input is not a number.
    #[error("`{input}` of `{node}` is {value}, which is not a number to compute with")]
    Constant {
        /// The node's name.
        node: String,
        /// The input.
        input: &'static str,
        /// What stands there.
        value: f64,
    },
    /// A file that a node reads cannot be read.
    #[error("`{node}` cannot read `{path}`: {message}", path = .path.display())]
    File {
        /// The node's name.
        node: String,
        /// The file parameter.
        parameter: &'static str,
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        message: String,
    },
    /// It would take more memory than there is.
    #[error("building `{node}` needs {} of memory{}", bytes(*.needs), room(*.available))]
    TooLarge {
        /// The node at which the need is greatest.
        node: String,
        /// Bytes needed.
        needs: u64,
        /// Bytes there are: the limit that was set, or what the machine has free; `None` where it only refused.
        available: Option<u64>,
    },
    /// The system had no memory for a raster, though the estimate before the run was within what there is.
    #[error("`{node}` ({id}): {refused}")]
    OutOfMemory {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// What was asked for.
        refused: OutOfMemory,
    },
    /// A kernel said that it cannot do it.
    #[error("`{node}` ({id}): {message}")]
    Node {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// What is wrong, in the kernel's words.
        message: String,
        /// What would help.
        hint: Option<String>,
    },
    /// A kernel panicked.
    #[error("`{node}` ({id}) stopped with an internal fault: {message}")]
    Panicked {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// The panic's message.
        message: String,
    },
    /// A kernel gave an output that its declaration does not allow.
    #[error("`{node}.{output}` ({id}) {message}")]
    Output {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// The output.
        output: &'static str,
        /// What is wrong with it.
        message: String,
    },
    /// The worker threads could not be started.
    #[error("cannot start the worker threads: {0}")]
    Threads(String),
}

fn room(available: Option<u64>) -> String {
    available.map_or_else(
        || ", which this machine does not give".to_owned(),
        |available| format!("; {} is available", bytes(available)),
    )
}

impl EvalError {
    /// The node at which it went wrong, where it is one.
    #[must_use]
    pub fn node(&self) -> Option<&str> {
        match self {
            Self::Unwired { node, .. }
            | Self::Constant { node, .. }
            | Self::File { node, .. }
            | Self::TooLarge { node, .. }
            | Self::OutOfMemory { node, .. }
            | Self::Node { node, .. }
            | Self::Panicked { node, .. }
            | Self::Output { node, .. } => Some(node),
            Self::Type { to, .. } => to.split_once('.').map(|(node, _)| node),
            Self::Cancelled | Self::World(_) | Self::Request(_) | Self::Threads(_) => None,
        }
    }

    /// What would help, where something is known to.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Unwired { input, .. } => Some(format!("write `{input}: \"node\"` with the node it is to come from")),
            Self::Type { .. } => Some("wire another output, or put a converter between them".to_owned()),
            Self::Constant { .. } => Some("write a finite number".to_owned()),
            Self::File { parameter, .. } => {
                Some(format!("`{parameter}` names a file relative to the folder of the graph file"))
            }
            Self::TooLarge { .. } | Self::OutOfMemory { .. } => Some(REMEDY.to_owned()),
            Self::Node { hint, .. } => hint.clone(),
            Self::Panicked { .. } | Self::Output { .. } => {
                Some("this is a fault of the node, not of the graph; please report it with the graph file".to_owned())
            }
            Self::Threads(_) => Some("use fewer threads, or give the program more memory".to_owned()),
            Self::Cancelled | Self::World(_) | Self::Request(_) => None,
        }
    }
}
