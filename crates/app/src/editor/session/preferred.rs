//! The backends that nodes should run on. They belong to the machine rather than to the terrain, so that they are kept
//! with the session and never in a file; no undo step changes them.

use std::sync::Arc;

use orograph_graph::{Edit, Graph, Prefer};

use super::{Session, worker};

impl Session {
    /// The backend that a node should run on.
    #[must_use]
    pub fn preferred(&self, node: &str) -> Prefer {
        self.preferred.get(node).copied().unwrap_or_default()
    }

    /// Returns true if a kernel for a graphics device can run a node, or a node of the file that it stands for.
    #[must_use]
    pub fn can_prefer(&self, node: &str) -> bool {
        let graph = self.document.expand().graph;
        let kernel = |index| graph.instance(index).node.gpu.is_some();
        graph.indices().any(|index| worker::outer(&graph.instance(index).name) == node && kernel(index))
    }

    /// Lets a node, and the nodes of the file that it stands for, run on a backend.
    pub fn prefer(&mut self, node: &str, backend: Prefer) {
        if self.preferred(node) != backend {
            self.preferred.insert(node.to_owned(), backend);
            self.outdated();
        }
    }

    /// After an edit: a renamed node keeps its backend, under both names, as undo gives it the first again.
    pub(super) fn rename_preferred(&mut self, edit: &Edit) {
        match edit {
            Edit::RenameNode { from, to } => {
                self.preferred.insert(to.clone(), self.preferred(from));
            }
            Edit::All(edits) => edits.iter().for_each(|edit| self.rename_preferred(edit)),
            _ => {}
        }
    }

    /// The graph with the backends of its nodes.
    pub(crate) fn with_preferences(&self, graph: Arc<Graph>) -> Arc<Graph> {
        if self.preferred.values().all(|backend| *backend == Prefer::Auto) {
            return graph;
        }
        let mut graph = Graph::clone(&graph);
        for index in graph.indices().collect::<Vec<_>>() {
            let backend = self.preferred(worker::outer(&graph.instance(index).name));
            graph.instance_mut(index).prefers = backend;
        }
        Arc::new(graph)
    }
}
