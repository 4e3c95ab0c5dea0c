//! Nodes whose parameters and inputs cannot be computed together.

use std::collections::{BTreeMap, BTreeSet};

use petgraph::stable_graph::NodeIndex;

use super::Checker;
use crate::{diagnostic::Diagnostic, job::NodeError, stated::Stated};

impl Checker<'_> {
    /// Reports nodes that would fail, whatever the terrain. Only those count that an output needs and that are not muted:
    /// any other may be unfinished. Inputs in `named` may be wired from outside.
    pub(super) fn refused(&mut self, named: &BTreeSet<(NodeIndex, &'static str)>) {
        let graph = &self.out.graph;
        let entries: BTreeMap<NodeIndex, usize> =
            self.out.nodes.iter().enumerate().filter_map(|(i, entry)| Some((entry.index?, i))).collect();
        let mut needed = BTreeSet::new();
        let mut queue: Vec<NodeIndex> = self.out.outputs.iter().map(|output| output.port.node).collect();
        while let Some(index) = queue.pop() {
            if needed.insert(index) {
                let inputs = 0..graph.instance(index).node.inputs.len();
                queue.extend(inputs.filter_map(|input| graph.source(index, input)).map(|port| port.node));
            }
        }
        let mut found = Vec::new();
        for index in needed.into_iter().filter(|index| !self.out.muted.contains_key(index)) {
            let instance = graph.instance(index);
            let (Some(refuses), Some(entry)) = (instance.node.refuses, entries.get(&index)) else { continue };
            let entry = &self.out.nodes[*entry];
            let is_wired = |input: usize| {
                graph.source(index, input).is_some() || named.contains(&(index, instance.node.inputs[input].name))
            };
            let stated = Stated::of_instance(instance, is_wired);
            if self.problems.has_any_in(&entry.span) {
                continue;
            }
            if let Err(NodeError::Failed { message, hint }) = refuses(&stated) {
                let message = format!("`{}` ({}): {message}", entry.name, instance.node.id);
                let problem = Diagnostic::error("refused", entry.kind_span.clone(), message);
                found.push(match hint {
                    Some(hint) => problem.hint(hint),
                    None => problem,
                });
            }
        }
        found.into_iter().for_each(|problem| self.problems.push(problem));
    }
}
