//! Backends, which run kernels.

use crate::{
    job::{Job, NodeError, Outputs},
    node::Node,
};

/// Runs kernels. The CPU backend defines every result; another backend must agree with it within the tolerance that a
/// node declares.
pub trait Backend: Send + Sync {
    /// Its name, such as `cpu`. It is part of the key of results that the backend may change.
    fn name(&self) -> &'static str;

    /// Returns true if it can run this kind of node.
    fn supports(&self, node: &Node) -> bool;

    /// Runs the node's kernel on a job.
    ///
    /// # Errors
    /// [`NodeError`], also when the job was cancelled.
    fn run(&self, node: &Node, job: &Job<'_>) -> Result<Outputs, NodeError>;
}

/// The CPU: runs every node's own kernel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cpu;

impl Backend for Cpu {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn supports(&self, _: &Node) -> bool {
        true
    }

    fn run(&self, node: &Node, job: &Job<'_>) -> Result<Outputs, NodeError> {
        (node.cpu)(job)
    }
}
