//! What runs the kernels: the processor, or a graphics card as well.

use std::sync::Arc;

use clap::ValueEnum;
use orograph_graph::{Backend, Cpu};

/// The backend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendName {
    /// The graphics card for nodes that have a kernel for it, if there is one; otherwise the processor
    Auto,
    /// The processor
    Cpu,
    /// As `auto`, but a software graphics driver counts as well
    Gpu,
}

impl BackendName {
    /// The backend, and a message if it is not what was asked for.
    #[must_use]
    pub fn open(self) -> (Arc<dyn Backend>, Option<String>) {
        match self {
            Self::Cpu => (Arc::new(Cpu), None),
            Self::Auto => (automatic::backend(), None),
            Self::Gpu => match automatic::any() {
                Ok(backend) => (backend, None),
                Err(why) => (Arc::new(Cpu), Some(format!("computing on the CPU: {why}"))),
            },
        }
    }

    /// The backends of the editor: that of `auto`, and one for nodes that ask for a device: the same card, or any
    /// driver where there is none.
    #[must_use]
    pub fn both() -> (Arc<dyn Backend>, Arc<dyn Backend>) {
        automatic::both()
    }
}

#[cfg(feature = "gpu")]
mod automatic {
    use std::sync::{Arc, OnceLock};

    use orograph_graph::{Backend, Cpu, Job, Node, NodeError, Outputs, ParamValues, Process};
    use orograph_nodes::gpu::{Adapters, Gpu, GpuOptions};

    /// Any adapter, or why there is none.
    pub(super) fn any() -> Result<Arc<Gpu>, String> {
        let adapters = Adapters::find();
        let adapter = adapters.best(false).ok_or_else(|| {
            "no graphics driver was found; install a Vulkan driver, such as the package `mesa-vulkan-drivers`"
                .to_owned()
        })?;
        match Gpu::new(adapter, &GpuOptions::default()) {
            Ok(gpu) => Ok(Arc::new(gpu)),
            Err(trouble) => Err(format!("{trouble}; {}", trouble.remedy())),
        }
    }

    pub(super) fn backend() -> Arc<dyn Backend> {
        Arc::new(Automatic::new(best))
    }

    pub(super) fn both() -> (Arc<dyn Backend>, Arc<dyn Backend>) {
        let usual = Arc::new(Automatic::new(best));
        let card = Arc::clone(&usual);
        let device = Automatic::new(move || card.gpu().cloned().or_else(|| any().ok()));
        (usual, Arc::new(device))
    }

    /// The best card.
    fn best() -> Option<Arc<Gpu>> {
        let adapters = Adapters::may_be_real().then(Adapters::find)?;
        Gpu::new(adapters.best(true)?, &GpuOptions::default()).ok().map(Arc::new)
    }

    /// A device that is opened when the first node has a use for it.
    struct Automatic {
        open: Box<dyn Fn() -> Option<Arc<Gpu>> + Send + Sync>,
        gpu: OnceLock<Option<Arc<Gpu>>>,
    }

    impl Automatic {
        fn new(open: impl Fn() -> Option<Arc<Gpu>> + Send + Sync + 'static) -> Self {
            Self { open: Box::new(open), gpu: OnceLock::new() }
        }

        fn gpu(&self) -> Option<&Arc<Gpu>> {
            self.gpu.get_or_init(|| (self.open)()).as_ref()
        }
    }

    impl Backend for Automatic {
        fn name(&self) -> &'static str {
            "gpu"
        }

        fn identity(&self) -> &str {
            self.gpu().map_or_else(|| Cpu.identity(), |gpu| gpu.identity())
        }

        fn supports(&self, node: &Node, params: &ParamValues) -> bool {
            node.gpu.is_some() && self.gpu().is_some_and(|gpu| gpu.supports(node, params))
        }

        fn run(&self, node: &Node, job: &Job<'_>) -> Result<Option<Outputs>, NodeError> {
            self.gpu().map_or(Ok(None), |gpu| gpu.run(node, job))
        }

        fn begin(self: Arc<Self>, node: &Node, job: &Job<'_>) -> Result<Option<Box<dyn Process>>, NodeError> {
            self.gpu().map_or(Ok(None), |gpu| Arc::clone(gpu).begin(node, job))
        }
    }
}

#[cfg(not(feature = "gpu"))]
mod automatic {
    use std::sync::Arc;

    use orograph_graph::{Backend, Cpu};

    pub(super) fn any() -> Result<Arc<dyn Backend>, String> {
        Err("this build of the program has no GPU backend; use one that has".to_owned())
    }

    pub(super) fn backend() -> Arc<dyn Backend> {
        Arc::new(Cpu)
    }

    pub(super) fn both() -> (Arc<dyn Backend>, Arc<dyn Backend>) {
        (Arc::new(Cpu), Arc::new(Cpu))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_asked_for_is_opened_or_the_reason_is_said() {
        let (backend, said) = BackendName::Cpu.open();
        assert!(backend.is_cpu() && said.is_none());
        assert!(BackendName::Auto.open().1.is_none(), "`auto` is content with the processor");
        let (backend, said) = BackendName::Gpu.open();
        assert_eq!(backend.is_cpu(), said.is_some());
        assert!(said.is_none_or(|said| said.contains("on the CPU: ") && !said.contains('\n')));
    }
}
