//! Backends, which run kernels.

use crate::{
    job::{Job, NodeError, Outputs},
    node::Node,
    param::ParamValues,
};

/// Runs kernels. The CPU backend defines every result; another backend must agree with it within the tolerance that a
/// node declares.
pub trait Backend: Send + Sync {
    /// Its name, such as `cpu`.
    fn name(&self) -> &'static str;

    /// Distinguishes backends that may give different bytes, such as two graphics cards. It is part of the keys of their
    /// results.
    fn identity(&self) -> &str {
        self.name()
    }

    /// Returns true for [`Cpu`] alone.
    fn is_cpu(&self) -> bool {
        false
    }

    /// Returns true if it can run this kind of node with these parameters.
    fn supports(&self, node: &Node, params: &ParamValues) -> bool;

    /// Runs the node's kernel on a job. Returns None when it leaves this run to the CPU, after a
    /// [warning](Job::warn) if something failed.
    ///
    /// # Errors
    /// [`NodeError`], also when the job was cancelled.
    fn run(&self, node: &Node, job: &Job<'_>) -> Result<Option<Outputs>, NodeError>;
}

/// The CPU: runs every node's own kernel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cpu;

impl Backend for Cpu {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn is_cpu(&self) -> bool {
        true
    }

    fn supports(&self, _: &Node, _: &ParamValues) -> bool {
        true
    }

    fn run(&self, node: &Node, job: &Job<'_>) -> Result<Option<Outputs>, NodeError> {
        (node.cpu)(job).map(Some)
    }
}
