//! Wires of a file: resolved, checked for circles, and connected from the sources on, so that types follow them.

use std::{
    collections::{BTreeMap, BTreeSet, VecDeque},
    ops::Range,
};

use petgraph::stable_graph::NodeIndex;

use super::problems::Problems;
use crate::{
    closest,
    diagnostic::Diagnostic,
    graph::{Graph, GraphError, Port},
    node::OutputType,
    value::PortType,
};

/// What the file gives an input.
pub(super) struct Pending {
    pub(super) node: NodeIndex,
    pub(super) input: usize,
    /// A wire from `node` or `node.port`; `None` where a number stands.
    pub(super) end: Option<String>,
    pub(super) span: Range<usize>,
}

/// A wire that begins at a node which is not in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LooseWire {
    /// The node that takes it.
    pub node: String,
    /// Its input.
    pub input: &'static str,
    /// Where it would begin: `node`, or `node.port`.
    pub from: String,
}

/// The wires that begin at nodes which are not in the file.
pub(super) fn loose(
    graph: &Graph,
    pending: &[Pending],
    entries: &BTreeMap<String, Option<NodeIndex>>,
) -> Vec<LooseWire> {
    let begins = |end: &str| entries.contains_key(end.split_once('.').map_or(end, |(name, _)| name));
    let ends = pending.iter().filter_map(|wire| Some((wire, wire.end.as_ref().filter(|end| !begins(end))?)));
    let loose = ends.map(|(wire, end)| {
        let instance = graph.instance(wire.node);
        LooseWire { node: instance.name.clone(), input: instance.node.inputs[wire.input].name, from: end.clone() }
    });
    loose.collect()
}

/// A wire whose end exists.
struct Found {
    from: Port,
    to: NodeIndex,
    input: usize,
    span: Range<usize>,
    /// Not part of a reported circle.
    sound: bool,
}

/// The output that a wire's end names; reports what does not exist, and nothing for a placeholder.
pub(super) fn resolve(
    graph: &Graph,
    end: &str,
    what: &str,
    span: &Range<usize>,
    entries: &BTreeMap<String, Option<NodeIndex>>,
    problems: &mut Problems,
) -> Option<Port> {
    let name = end.split_once('.').map_or(end, |(name, _)| name);
    match entries.get(name) {
        Some(None) => None,
        Some(Some(_)) => match graph.port(end) {
            Ok(port) => Some(port),
            Err(error) => {
                let mut problem = Diagnostic::error("unknown-port", span.clone(), format!("{what}: {error}"));
                if let GraphError::UnknownPort { node, id, port, suggestion, .. } = &error {
                    let outputs = graph.find(node).map(|index| graph.instance(index).node.outputs).unwrap_or_default();
                    let names: Vec<String> = outputs.iter().map(|output| format!("`{}`", output.name)).collect();
                    problem.message = format!("{what} is wired to `{end}`, but `{node}` ({id}) has no output `{port}`");
                    problem.hint = Some(match suggestion {
                        Some(near) => format!("did you mean `{node}.{near}`?"),
                        None => format!("it has {}", names.join(", ")),
                    });
                }
                problems.push(problem);
                None
            }
        },
        None => {
            let message = format!("{what} is wired to `{end}`, but there is no node `{name}`");
            let problem = Diagnostic::error("unknown-wire", span.clone(), message);
            problems.push(match closest(name, entries.keys().map(String::as_str)) {
                Some(near) => problem.hint(format!("did you mean `{near}`?")),
                None => problem.hint("write the name of a node of this file"),
            });
            None
        }
    }
}

/// Connects all wires that are sound and reports the others, each once.
///
/// Gives the types of all outputs, found once in the order of the wires; one that follows from something that could not
/// be read is not among them.
pub(super) fn connect(
    graph: &mut Graph,
    pending: Vec<Pending>,
    entries: &BTreeMap<String, Option<NodeIndex>>,
    bad: &BTreeSet<NodeIndex>,
    problems: &mut Problems,
) -> BTreeMap<Port, PortType> {
    // Inputs whose wire could not be made: what follows from their type is not known.
    let mut broken: BTreeSet<(NodeIndex, usize)> = BTreeSet::new();
    let mut wires = Vec::new();
    for Pending { node, input, end, span } in pending {
        let Some(end) = end else { continue };
        let instance = graph.instance(node);
        let what = format!("`{}.{}`", instance.name, instance.node.inputs[input].name);
        match resolve(graph, &end, &what, &span, entries, problems) {
            Some(from) => wires.push(Found { from, to: node, input, span, sound: true }),
            None => {
                broken.insert((node, input));
            }
        }
    }
    let order = order(graph, &mut wires, problems);
    broken.extend(wires.iter().filter(|wire| !wire.sound).map(|wire| (wire.to, wire.input)));

    let mut into: BTreeMap<NodeIndex, Vec<&Found>> = BTreeMap::new();
    for wire in wires.iter().filter(|wire| wire.sound) {
        into.entry(wire.to).or_default().push(wire);
    }
    let mut types: BTreeMap<Port, PortType> = BTreeMap::new();
    for node in order {
        let declared = graph.instance(node).node;
        let mut given: BTreeMap<usize, PortType> = BTreeMap::new();
        for wire in into.get(&node).map_or(&[][..], Vec::as_slice) {
            match types.get(&wire.from) {
                Some(gives) if declared.inputs[wire.input].ty.accepts(*gives) => {
                    graph.add_wire(wire.from, node, wire.input);
                    given.insert(wire.input, *gives);
                }
                Some(gives) => {
                    broken.insert((node, wire.input));
                    problems.push(refused(graph, wire, *gives, &types));
                }
                None => {
                    broken.insert((node, wire.input));
                }
            }
        }
        for (output, port) in declared.outputs.iter().enumerate() {
            let ty = match port.ty {
                OutputType::Fixed(ty) => Some(ty),
                OutputType::Chosen(choose) => (!bad.contains(&node)).then(|| choose(&graph.instance(node).params)),
                OutputType::SameAs(input) => match declared.inputs.iter().position(|i| i.name == input) {
                    Some(input) if broken.contains(&(node, input)) => None,
                    Some(input) => Some(given.get(&input).copied().unwrap_or(PortType::Height)),
                    None => Some(PortType::Height),
                },
            };
            if let Some(ty) = ty {
                types.insert(Port { node, output }, ty);
            }
        }
    }
    types
}

/// A wire whose type does not fit, with outputs of the same node that do.
fn refused(graph: &Graph, wire: &Found, gives: PortType, types: &BTreeMap<Port, PortType>) -> Diagnostic {
    let target = graph.instance(wire.to);
    let input = &target.node.inputs[wire.input];
    let takes = input.ty;
    let from = graph.port_name(wire.from);
    let error = GraphError::Type { from, gives, to: format!("{}.{}", target.name, input.name), takes };
    let problem = Diagnostic::error("type", wire.span.clone(), error.to_string());
    let source = graph.instance(wire.from.node);
    let fitting: Vec<String> = (0..source.node.outputs.len())
        .map(|output| Port { node: wire.from.node, output })
        .filter(|port| types.get(port).is_some_and(|ty| takes.accepts(*ty)))
        .map(|port| format!("`{}`", graph.port_name(port)))
        .collect();
    if fitting.is_empty() {
        problem.hint(format!("wire something that gives a {takes}"))
    } else {
        problem.hint(format!("{} would fit", fitting.join(" or ")))
    }
}

/// The nodes with sources before what they feed. Wires that close a circle are reported and marked.
fn order(graph: &Graph, wires: &mut [Found], problems: &mut Problems) -> Vec<NodeIndex> {
    let nodes: Vec<NodeIndex> = graph.indices().collect();
    let mut out_of: BTreeMap<NodeIndex, Vec<usize>> = BTreeMap::new();
    let mut into: BTreeMap<NodeIndex, Vec<usize>> = BTreeMap::new();
    for (at, wire) in wires.iter().enumerate() {
        out_of.entry(wire.from.node).or_default().push(at);
        into.entry(wire.to).or_default().push(at);
    }
    let mut waiting: BTreeMap<NodeIndex, usize> =
        nodes.iter().map(|node| (*node, into.get(node).map_or(0, Vec::len))).collect();
    let mut ready: VecDeque<NodeIndex> = nodes.iter().copied().filter(|node| waiting[node] == 0).collect();
    let mut order = Vec::with_capacity(nodes.len());
    let mut unvisited = nodes.iter().copied();
    let mut stuck = unvisited.next();
    loop {
        while let Some(node) = ready.pop_front() {
            waiting.remove(&node);
            order.push(node);
            for at in out_of.get(&node).into_iter().flatten().filter(|at| wires[**at].sound) {
                if let Some(count) = waiting.get_mut(&wires[*at].to) {
                    *count -= 1;
                    if *count == 0 {
                        ready.push_back(wires[*at].to);
                    }
                }
            }
        }
        // What still waits feeds itself: one wire of each circle is left out.
        while stuck.is_some_and(|node| !waiting.contains_key(&node)) {
            stuck = unvisited.next();
        }
        let Some(start) = stuck else { return order };
        let circle = circle(start, wires, &into, &waiting);
        let Some(closing) = circle.iter().copied().max_by_key(|at| wires[*at].span.start) else { return order };
        problems.push(circular(graph, wires, &circle, closing));
        wires[closing].sound = false;
        if let Some(count) = waiting.get_mut(&wires[closing].to) {
            *count -= 1;
            if *count == 0 {
                ready.push_back(wires[closing].to);
            }
        }
    }
}

/// The wires of a circle among waiting nodes, each feeding the one before it.
fn circle(
    start: NodeIndex,
    wires: &[Found],
    into: &BTreeMap<NodeIndex, Vec<usize>>,
    waiting: &BTreeMap<NodeIndex, usize>,
) -> Vec<usize> {
    let mut seen: BTreeMap<NodeIndex, usize> = BTreeMap::new();
    let mut way: Vec<usize> = Vec::new();
    let mut node = start;
    loop {
        if let Some(first) = seen.insert(node, way.len()) {
            return way.split_off(first);
        }
        // A waiting node has a sound wire from a waiting node, or it would be ready.
        let back = into.get(&node).into_iter().flatten().copied();
        let Some(at) = back.into_iter().find(|at| wires[*at].sound && waiting.contains_key(&wires[*at].from.node))
        else {
            return Vec::new();
        };
        way.push(at);
        node = wires[at].from.node;
    }
}

fn circular(graph: &Graph, wires: &[Found], circle: &[usize], closing: usize) -> Diagnostic {
    // `circle` runs against the flow; turned round, it begins with the node that stands first in the file.
    let mut nodes: Vec<NodeIndex> = circle.iter().rev().map(|at| wires[*at].from.node).collect();
    let first = nodes.iter().enumerate().min_by_key(|(_, node)| **node).map_or(0, |(at, _)| at);
    nodes.rotate_left(first);
    nodes.extend(nodes.first().copied());
    let names: Vec<&str> = nodes.iter().map(|node| graph.instance(*node).name.as_str()).collect();
    let message = format!("the wires form a circle: {}", names.join(" → "));
    Diagnostic::error("cycle", wires[closing].span.clone(), message).hint("remove one of these wires")
}
