//! Nodes whose parameters and inputs cannot be computed together.

use std::collections::{BTreeMap, BTreeSet};

use petgraph::stable_graph::NodeIndex;

use super::{Checker, muted::Behind};
use crate::{diagnostic::Diagnostic, job::NodeError, stated::Stated};

impl Checker<'_> {
    /// Warns of nodes that would fail, whatever the terrain. Skips muted nodes and nodes that no output needs, which may
    /// be unfinished, and nodes with a parameter in `named`, which another graph may set. Inputs in `named` may be wired
    /// from outside.
    pub(super) fn refused(&mut self, named: &BTreeSet<(NodeIndex, &'static str)>) {
        let (graph, muted) = (&self.out.graph, &self.out.muted);
        let behind = Behind::new(graph, muted);
        let source =
            |index: NodeIndex, input: usize| graph.source(index, input).and_then(|port| behind.port(muted, port));
        let entries: BTreeMap<NodeIndex, usize> =
            self.out.nodes.iter().enumerate().filter_map(|(i, entry)| Some((entry.index?, i))).collect();
        let outputs = self.out.outputs.iter().filter_map(|output| behind.port(muted, output.port));
        let (mut needed, mut queue) = (BTreeSet::new(), outputs.map(|port| port.node).collect::<Vec<_>>());
        while let Some(index) = queue.pop() {
            if needed.insert(index) {
                let inputs = 0..graph.instance(index).node.inputs.len();
                queue.extend(inputs.filter_map(|input| source(index, input)).map(|port| port.node));
            }
        }
        let mut found = Vec::new();
        for index in needed {
            let instance = graph.instance(index);
            let (node, entry) = (instance.node, entries.get(&index).map(|entry| &self.out.nodes[*entry]));
            let (Some(refuses), Some(entry)) = (node.refuses, entry) else { continue };
            let is_exposed = named.iter().any(|(of, name)| *of == index && node.input(name).is_none());
            if is_exposed || self.problems.has_any_in(&entry.span) {
                continue;
            }
            let is_wired =
                |input: usize| source(index, input).is_some() || named.contains(&(index, node.inputs[input].name));
            if let Err(NodeError::Failed { message, hint }) = refuses(&Stated::of_instance(instance, is_wired)) {
                let message = format!("`{}` ({}) will fail: {message}", entry.name, node.id);
                let mut problem = Diagnostic::warning("refused", entry.kind_span.clone(), message);
                problem.hint = hint;
                found.push(problem);
            }
        }
        found.into_iter().for_each(|problem| self.problems.push(problem));
    }
}
