//! The backends that nodes should run on. They belong to the machine rather than to the terrain, so that they are kept
//! with the session and never in a file; no undo step changes them.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use orograph_graph::{Edit, Graph, Prefer};

use super::{NodeState, Session, worker};

/// Backends by the names of nodes; others have [`Prefer::Auto`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Preferred(BTreeMap<String, Prefer>);

impl Preferred {
    fn of(&self, node: &str) -> Prefer {
        self.0.get(node).copied().unwrap_or_default()
    }

    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// A graph with the backends of its nodes.
    pub(crate) fn applied(&self, graph: Arc<Graph>) -> Arc<Graph> {
        if self.0.values().all(|backend| *backend == Prefer::Auto) {
            return graph;
        }
        let mut graph = Graph::clone(&graph);
        for index in graph.indices().collect::<Vec<_>>() {
            let backend = self.of(worker::outer(&graph.instance(index).name));
            graph.instance_mut(index).prefers = backend;
        }
        Arc::new(graph)
    }
}

impl Session {
    /// The backend that a node should run on.
    #[must_use]
    pub fn preferred(&self, node: &str) -> Prefer {
        self.preferred.of(node)
    }

    /// The backends that nodes should run on.
    pub(crate) const fn preferences(&self) -> &Preferred {
        &self.preferred
    }

    /// Returns true if a kernel for a graphics device can run a node, or a node of the file that it stands for.
    #[must_use]
    pub fn can_prefer(&self, node: &str) -> bool {
        let graph = self.document.expand().graph;
        let kernel = |index| graph.instance(index).node.gpu.is_some();
        graph.indices().any(|index| worker::outer(&graph.instance(index).name) == node && kernel(index))
    }

    /// Returns true if a node should run on a device, and has a kernel for its settings, but was computed on the CPU: no
    /// device could be opened, or it was lost.
    #[must_use]
    pub fn lacks_device(&self, node: &str) -> bool {
        let graph = self.document.graph();
        let instance = graph.find(node).map(|index| graph.instance(index));
        let has_kernel = instance.is_ok_and(|instance| instance.node.has_gpu_kernel(&instance.params));
        let info = self.node(node);
        has_kernel
            && self.preferred(node) == Prefer::Device
            && matches!(info.state, NodeState::Fresh)
            && !info.on_device
    }

    /// Lets a node, and the nodes of the file that it stands for, run on a backend.
    pub fn prefer(&mut self, node: &str, backend: Prefer) {
        if self.preferred(node) != backend {
            self.preferred.0.insert(node.to_owned(), backend);
            self.outdated();
        }
    }

    /// After an edit: a renamed node keeps its backend, under both names, as undo gives it the first again. A new node has
    /// none, even if a node before it had its name.
    pub(super) fn keep_preferred(&mut self, edit: &Edit) {
        match edit {
            Edit::RenameNode { from, to } => {
                self.preferred.0.insert(to.clone(), self.preferred(from));
                for port in [&mut self.pinned, &mut self.compared, &mut self.last].into_iter().flatten() {
                    if let Some(output) = port.strip_prefix(from.as_str()).and_then(|rest| rest.strip_prefix('.')) {
                        *port = format!("{to}.{output}");
                    }
                }
            }
            Edit::AddNode { name, .. } | Edit::AddWritten { name, .. } => {
                self.preferred.0.remove(name);
            }
            Edit::All(edits) => edits.iter().for_each(|edit| self.keep_preferred(edit)),
            _ => {}
        }
    }

    /// After a change of the whole text: nodes that were not in it before have no backend.
    pub(super) fn keep_preferred_of(&mut self, before: &BTreeSet<String>) {
        for entry in self.document.nodes().iter().filter(|entry| !before.contains(&entry.name)) {
            self.preferred.0.remove(&entry.name);
        }
    }
}
