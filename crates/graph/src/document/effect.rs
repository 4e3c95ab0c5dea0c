//! What a file says without effect on any output: settings that other settings switch off, and nodes that no output
//! needs.

use std::collections::BTreeSet;

use petgraph::stable_graph::NodeIndex;

use super::{
    Document, NodeEntry,
    check::args::{self, Arg},
    syntax::{Group, Item},
};
use crate::{
    diagnostic::Diagnostic,
    param::{ParamSpec, When},
};

/// The most notes that are listed.
const MOST: usize = 100;

impl Document {
    /// Parts of the file that change no output, as notes, sorted by position: nodes that no output needs, and parameters
    /// of the others that have no effect with the node's other settings and wires. At most 100; empty for a file with
    /// errors.
    ///
    /// They are legitimate, as in a file that somebody is working on, so they do not count as problems.
    #[must_use]
    pub fn without_effect(&self) -> Vec<Diagnostic> {
        if self.has_errors() {
            return Vec::new();
        }
        let needed = self.graph().upstream(self.outputs().iter().map(|output| output.port.node));
        let mut notes = self.needless_nodes(&needed);
        notes.extend(self.idle_parameters(&needed));
        notes.sort_by_key(|note| note.span.start);
        notes.truncate(MOST);
        notes
    }

    /// Parameters that have no effect, of these nodes.
    fn idle_parameters(&self, of: &BTreeSet<NodeIndex>) -> Vec<Diagnostic> {
        let root = self.read.parsed.tree.root.as_ref().and_then(|root| root.as_group());
        let nodes = root.and_then(|root| root.get("nodes")).and_then(|item| item.value.as_group());
        let idle = |item: &Item| {
            let entry = self.node(&item.key.as_ref()?.text)?;
            let (_, body) = args::kind_of(&item.value)?;
            Some(self.idle_of(entry, entry.index.filter(|index| of.contains(index))?, body?))
        };
        nodes.into_iter().flat_map(|group| &group.items).filter_map(idle).flatten().collect()
    }

    /// The parameters of one node that its brackets state without effect.
    fn idle_of(&self, entry: &NodeEntry, index: NodeIndex, body: &Group) -> Vec<Diagnostic> {
        let instance = self.graph().instance(index);
        let specs = instance.node.specs();
        if specs.iter().all(|spec| spec.when.is_empty()) {
            return Vec::new();
        }
        let mut written = args::args(body, self.source());
        args::migrate(&mut written, instance.node, args::version(body, self.source()).unwrap_or(1), &entry.span);
        let is_wired = |input: &str| self.graph().is_wired(index, input);
        let idle = |arg: &Arg| {
            let spec: &ParamSpec = specs.iter().find(|spec| arg.item.is_some() && spec.name == arg.name)?;
            let when = spec.idle(&instance.params, is_wired)?;
            // a name of the file may set it otherwise
            let (When::Setting { param: on, .. }
            | When::NonZero(on)
            | When::Empty(on)
            | When::Wired(on)
            | When::Unwired(on)) = when;
            (!self.is_exposed(index, on)).then(|| {
                let message = format!("`{}` of `{}` has no effect: it is used only if {when}", spec.name, entry.name);
                Diagnostic::note("no-effect", arg.name_span.clone(), message)
            })
        };
        written.iter().filter_map(idle).collect()
    }

    /// Returns true if a name of the file sets that input or parameter.
    fn is_exposed(&self, node: NodeIndex, name: &str) -> bool {
        let inputs = self.inputs().iter().flat_map(|named| &named.places);
        let parameters = self.parameters().iter().flat_map(|named| &named.places);
        inputs.chain(parameters).any(|place| place.node == node && place.name == name)
    }

    /// The last of the nodes that no output needs, each with the number of others before it.
    fn needless_nodes(&self, needed: &BTreeSet<NodeIndex>) -> Vec<Diagnostic> {
        let graph = self.graph();
        let nodes = self.nodes().iter().filter_map(|entry| Some((entry, entry.index?)));
        let needless: Vec<(&NodeEntry, NodeIndex)> = nodes.filter(|(_, index)| !needed.contains(index)).collect();
        let sources = |index: NodeIndex| {
            (0..graph.instance(index).node.inputs.len()).filter_map(move |input| graph.source(index, input))
        };
        let feeds: BTreeSet<NodeIndex> =
            needless.iter().flat_map(|(_, index)| sources(*index)).map(|port| port.node).collect();
        let note = |(entry, index): &(&NodeEntry, NodeIndex)| {
            let before = graph.upstream([*index]).difference(needed).count() - 1;
            let message = match before {
                0 => format!("no output needs `{}`", entry.name),
                1 => format!("no output needs `{}` and the node before it", entry.name),
                more => format!("no output needs `{}` and {more} nodes before it", entry.name),
            };
            let span = entry.span.start..entry.kind_span.end;
            Diagnostic::note("unused-node", span, message).hint("add one of its outputs to `outputs`, or remove it")
        };
        needless.iter().filter(|(_, index)| !feeds.contains(index)).map(note).collect()
    }
}
