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
        let mut found = BTreeMap::new();
        for entry in &self.out.nodes {
            let Some(index) = entry.index.filter(|index| !muted.contains_key(index)) else { continue };
            let instance = graph.instance(index);
            let node = instance.node;
            let Some(refuses) = node.refuses else { continue };
            let is_wired =
                |input: usize| source(index, input).is_some() || named.contains(&(index, node.inputs[input].name));
            let Err(NodeError::Failed { message, hint }) = refuses(&Stated::of_instance(instance, is_wired)) else {
                continue;
            };
            let is_exposed = named.iter().any(|(of, name)| *of == index && node.input(name).is_none());
            if !is_exposed && !self.problems.has_any_in(&entry.span) {
                let message = format!("`{}` ({}) will fail: {message}", entry.name, node.id);
                let problem = Diagnostic::warning("refused", entry.kind_span.clone(), message);
                found.insert(index, Diagnostic { hint, ..problem });
            }
        }
        if found.is_empty() {
            return;
        }
        // as `Graph::upstream`, but past muted nodes
        let mut needed = BTreeSet::new();
        let outputs = self.out.outputs.iter().filter_map(|output| behind.port(muted, output.port));
        let mut next: Vec<NodeIndex> = outputs.map(|port| port.node).collect();
        while let Some(index) = next.pop() {
            if needed.insert(index) {
                let inputs = 0..graph.instance(index).node.inputs.len();
                next.extend(inputs.filter_map(|input| source(index, input)).map(|port| port.node));
            }
        }
        found.retain(|index, _| needed.contains(index));
        found.into_values().for_each(|problem| self.problems.push(problem));
    }
}
