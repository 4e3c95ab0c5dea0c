//! Muted nodes: the build bypasses the nodes in the file's `muted`.
//!
//! As its first output, a muted node passes on the first of its wires whose type fits. Its other outputs have no value,
//! so inputs connected to them count as unwired.

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    ops::Range,
};

use petgraph::stable_graph::NodeIndex;

use super::{NodeEntry, problems::Problems};
use crate::document::{
    Document,
    syntax::{Expr, lex::Bracket, literal::Literal},
};
use crate::{
    diagnostic::Diagnostic,
    graph::{Graph, Port},
    node::{Fallback, OutputType},
    value::PortType,
};

/// Nodes that are muted, with the spans of their names in `muted`.
pub(crate) type Muted = BTreeMap<NodeIndex, Range<usize>>;

/// The input whose wire a muted node passes on; `wired` returns the type of the wire into an input.
pub(crate) fn passed_input(graph: &Graph, node: NodeIndex, wired: impl Fn(usize) -> Option<PortType>) -> Option<usize> {
    let declared = graph.instance(node).node;
    let first = declared.outputs.first()?;
    let gives = graph.output_type(Port { node, output: 0 });
    let same = match first.ty {
        OutputType::SameAs(input) => Some(input),
        _ => None,
    };
    let fits = |position: &usize| {
        wired(*position).is_some_and(|ty| same == Some(declared.inputs[*position].name) || gives.accepts(ty))
    };
    (0..declared.inputs.len()).find(fits)
}

/// The replacements of outputs of muted nodes.
#[derive(Default)]
pub(super) struct Behind {
    /// By muted node: the input whose wire it passes on, and the output at the other end, which belongs to a node that
    /// is not muted.
    passed: HashMap<NodeIndex, (usize, Port)>,
}

impl Behind {
    /// Sources come before the nodes that they feed, so one pass is sufficient.
    pub(super) fn new(graph: &Graph, muted: &Muted) -> Self {
        let mut behind = Self::default();
        if muted.is_empty() {
            return behind;
        }
        for node in graph.topological().into_iter().filter(|node| muted.contains_key(node)) {
            let source = |position| behind.port(muted, graph.source(node, position)?);
            let passed = passed_input(graph, node, |position| Some(graph.output_type(source(position)?)));
            let passed = passed.and_then(|position| Some((position, source(position)?)));
            behind.passed.extend(passed.map(|passed| (node, passed)));
        }
        behind
    }

    /// The output that replaces an output. Returns None when a muted node passes nothing on.
    pub(super) fn port(&self, muted: &Muted, port: Port) -> Option<Port> {
        if !muted.contains_key(&port.node) {
            return Some(port);
        }
        self.passed.get(&port.node).filter(|_| port.output == 0).map(|(_, source)| *source)
    }
}

/// Reads `muted`: a list of names.
pub(crate) fn read(
    value: &Expr,
    source: &str,
    entries: &BTreeMap<String, Option<NodeIndex>>,
    problems: &mut Problems,
) -> (Muted, BTreeSet<String>) {
    let (mut muted, mut names) = (Muted::new(), BTreeSet::new());
    let takes = "a list of nodes such as `[\"scree\"]`";
    let Some(group) = value.as_group().filter(|g| g.name.is_none() && g.bracket == Bracket::Square) else {
        problems.misplaced(value, "muted", takes, source);
        return (muted, names);
    };
    for item in &group.items {
        let span = item.value.span.clone();
        let Literal::Text(name) = Literal::read(&item.value, source) else {
            problems.misplaced(&item.value, "muted", takes, source);
            continue;
        };
        match entries.get(&name) {
            None => {
                let message = format!("`muted` names `{name}`, but there is no such node");
                let problem = Diagnostic::warning("unknown-muted", span, message);
                let near = problems.meant(&name, entries.keys().map(String::as_str));
                problems.push(problem.suggest(near));
            }
            Some(_) if names.contains(&name) => {
                let message = format!("`{name}` appears twice in `muted`");
                problems.push(Diagnostic::warning("duplicate", span, message).hint("remove one of them"));
            }
            Some(index) => {
                muted.extend(index.map(|index| (index, span)));
                names.insert(name);
            }
        }
    }
    (muted, names)
}

/// Reports muted nodes that have no wire to pass on to an input that requires one.
pub(crate) fn check(
    graph: &Graph,
    muted: &Muted,
    nodes: &[NodeEntry],
    outputs: &[(String, Port)],
    problems: &mut Problems,
) {
    let needs = |index: NodeIndex| {
        let node = graph.instance(index).node;
        (0..node.inputs.len()).filter(move |at| node.inputs[*at].fallback == Fallback::Required)
    };
    if muted.is_empty() {
        return;
    }
    let behind = Behind::new(graph, muted);
    let silent = |port: Port| behind.port(muted, port).is_none();
    let mut told = BTreeSet::new();
    let mut tell = |port: Port, reader: String, remedy: &str| {
        // If the node already lacks a wire, that is the only problem to report.
        let lacks = needs(port.node).any(|at| graph.source(port.node, at).is_none());
        if let Some(span) = muted.get(&port.node)
            && !lacks
            && told.insert(port)
        {
            let name = &graph.instance(port.node).name;
            let message = format!("`{name}` is muted and passes nothing on as `{}`, which {reader} needs", {
                graph.instance(port.node).node.outputs[port.output].name
            });
            let problem = Diagnostic::error("muted", span.clone(), message);
            problems.push(problem.hint(remedy));
        }
    };
    for index in nodes.iter().filter_map(|entry| entry.index).filter(|index| !muted.contains_key(index)) {
        for at in needs(index) {
            if let Some(port) = graph.source(index, at).filter(|port| silent(*port)) {
                let instance = graph.instance(index);
                let reader = format!("`{}.{}`", instance.name, instance.node.inputs[at].name);
                tell(port, reader, "mute that too, or wire something else to it");
            }
        }
    }
    for (name, port) in outputs.iter().filter(|(_, port)| silent(*port)) {
        tell(*port, format!("the output `{name}`"), "take it out of `muted`, or remove the output");
    }
}

impl Document {
    /// Returns true if a node is muted, so that the build bypasses it.
    #[must_use]
    pub fn is_muted(&self, node: NodeIndex) -> bool {
        self.read.checked.muted.contains_key(&node)
    }

    /// The position of the input whose wire a muted node passes on as its first output.
    #[must_use]
    pub fn passed_input(&self, node: NodeIndex) -> Option<usize> {
        let (graph, muted) = (self.graph(), &self.read.checked.muted);
        if !self.is_muted(node) {
            return None;
        }
        Behind::new(graph, muted).passed.get(&node).map(|(position, _)| *position)
    }
}
