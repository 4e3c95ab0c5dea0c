//! Why an evaluation failed.

use std::path::PathBuf;

use crate::{
    memory::{OutOfMemory, REMEDY},
    value::PortType,
    world::{WorldError, bytes},
};

/// Why an evaluation failed. The message names the node; [`EvalError::hint`] suggests a remedy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvalError {
    /// The evaluation was cancelled.
    #[error("cancelled")]
    Cancelled,
    /// The world cannot be evaluated.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The requested output does not exist.
    #[error("{0}")]
    Request(String),
    /// A required input has no wire.
    #[error("nothing is wired to `{input}` of `{node}` ({id})")]
    Unwired {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// The input.
        input: &'static str,
    },
    /// The type of a wire does not fit its input, because a parameter has changed the type of the source.
    #[error("`{from}` gives {}, but `{to}` takes {}", .gives.one(), .takes.one())]
    Type {
        /// The output, as `node.port`.
        from: String,
        /// Its type.
        gives: PortType,
        /// The input, as `node.port`.
        to: String,
        /// The type that the input takes.
        takes: PortType,
    },
    /// The constant at an input is not a finite number.
    #[error("`{input}` of `{node}` is {value}, which is not a finite number")]
    Constant {
        /// The node's name.
        node: String,
        /// The input.
        input: &'static str,
        /// The constant.
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
        /// The reason.
        message: String,
    },
    /// The evaluation would need more memory than is available.
    #[error("building `{node}` needs {} of memory{}", bytes(*.needs), room(*.available))]
    TooLarge {
        /// The node that needs the most memory.
        node: String,
        /// Bytes needed.
        needs: u64,
        /// Bytes available: the limit that was set, or the free memory of the machine; `None` if the system refused an
        /// allocation.
        available: Option<u64>,
    },
    /// The system refused memory for a raster, although the estimate before the run was below the available memory.
    #[error("`{node}` ({id}): {refused}")]
    OutOfMemory {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// The allocation that failed.
        refused: OutOfMemory,
    },
    /// A kernel reported an error.
    #[error("`{node}` ({id}): {message}")]
    Node {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// The kernel's message.
        message: String,
        /// A possible remedy.
        hint: Option<String>,
    },
    /// A kernel panicked.
    #[error("`{node}` ({id}) failed with an internal error: {message}")]
    Panicked {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// The panic's message.
        message: String,
    },
    /// A kernel returned an output that contradicts its declaration.
    #[error("`{node}.{output}` ({id}) {message}")]
    Output {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// The output.
        output: &'static str,
        /// The contradiction.
        message: String,
    },
    /// The worker threads could not be started.
    #[error("cannot start the worker threads: {0}")]
    Threads(String),
}

fn room(available: Option<u64>) -> String {
    available.map_or_else(
        || ", which the system refused".to_owned(),
        |available| format!("; {} is available", bytes(available)),
    )
}

impl EvalError {
    /// The node that failed. Returns None when the error concerns no single node.
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

    /// The kind of error in kebab case, such as `node-failed`; for programs that read the output.
    #[must_use]
    pub const fn code(&self) -> &'static str {
        match self {
            Self::Cancelled => "stopped",
            Self::World(_) => "world",
            Self::Request(_) => "request",
            Self::Unwired { .. } => "unwired",
            Self::Type { .. } => "type",
            Self::Constant { .. } => "value",
            Self::File { .. } => "missing-file",
            Self::TooLarge { .. } | Self::OutOfMemory { .. } => "memory",
            Self::Node { .. } => "node-failed",
            Self::Panicked { .. } | Self::Output { .. } => "internal",
            Self::Threads(_) => "threads",
        }
    }

    /// A possible remedy. Returns None when none is known.
    #[must_use]
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Unwired { input, .. } => Some(format!("write `{input}: \"node\"` with the name of a node")),
            Self::Type { .. } => Some("wire another output, or put a converter between them".to_owned()),
            Self::Constant { .. } => Some("write a finite number".to_owned()),
            Self::File { parameter, .. } => {
                Some(format!("`{parameter}` names a file relative to the folder of the graph file"))
            }
            Self::TooLarge { .. } | Self::OutOfMemory { .. } => Some(REMEDY.to_owned()),
            Self::Node { hint, .. } => hint.clone(),
            Self::Panicked { .. } | Self::Output { .. } => {
                Some("this is a bug in the node, not in the graph; please report it with the graph file".to_owned())
            }
            Self::Threads(_) => Some("use fewer threads, or give the program more memory".to_owned()),
            Self::Cancelled | Self::World(_) | Self::Request(_) => None,
        }
    }
}
