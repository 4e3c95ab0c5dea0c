//! Backends, which run kernels.

use std::sync::Arc;

use crate::{
    graph::Instance,
    job::{Job, NodeError, Outputs},
    node::Node,
    param::ParamValues,
    process::Process,
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

    /// Starts the node's process. Returns None when it leaves the process to the CPU, after a [warning](Job::warn) if
    /// something failed.
    ///
    /// # Errors
    /// [`NodeError`], also when the job was cancelled.
    fn begin(self: Arc<Self>, node: &Node, job: &Job<'_>) -> Result<Option<Box<dyn Process>>, NodeError>;
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

    fn begin(self: Arc<Self>, node: &Node, job: &Job<'_>) -> Result<Option<Box<dyn Process>>, NodeError> {
        node.process.map(|begin| begin(job)).transpose()
    }
}

/// Which backend should run a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Prefer {
    /// The evaluator's usual one, if it supports the node.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// The device for nodes that ask for one, if it supports the node.
    Device,
}

/// The backends of an evaluator.
pub(crate) struct Backends {
    /// For nodes without a preference.
    pub(crate) usual: Arc<dyn Backend>,
    /// For nodes that ask for a device.
    pub(crate) device: Arc<dyn Backend>,
    cpu: Arc<dyn Backend>,
}

impl Backends {
    pub(crate) fn new(usual: Arc<dyn Backend>, device: Arc<dyn Backend>) -> Self {
        Self { usual, device, cpu: Arc::new(Cpu) }
    }

    /// The one that runs an instance: the preferred one, or the CPU, which runs all.
    pub(crate) fn of(&self, instance: &Instance) -> &Arc<dyn Backend> {
        let preferred = match instance.prefers {
            Prefer::Auto => &self.usual,
            Prefer::Device => &self.device,
            Prefer::Cpu => &self.cpu,
        };
        if preferred.supports(instance.node, &instance.params) { preferred } else { &self.cpu }
    }
}
