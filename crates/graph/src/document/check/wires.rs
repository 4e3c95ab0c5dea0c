//! Wires of a file: resolved, checked for cycles, and connected from the sources on, so that output types are known.

use std::{
    collections::{BTreeMap, BTreeSet, HashMap, VecDeque},
    fmt::Display,
    ops::Range,
};

use petgraph::stable_graph::NodeIndex;

use super::problems::Problems;
use crate::{
    diagnostic::Diagnostic,
    graph::{Graph, GraphError, Port},
    node::OutputType,
    param::{Kind, ParamValue, ParamValues},
    registry::Registry,
    value::PortType,
};

/// The wire or the number that a file has at an input.
pub(crate) struct Pending {
    pub(crate) node: NodeIndex,
    pub(crate) input: usize,
    /// A wire from `node` or `node.port`; `None` for a number.
    pub(crate) end: Option<String>,
    pub(crate) span: Range<usize>,
}

/// A wire whose source node is not in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LooseWire {
    /// The node that it leads into.
    pub node: String,
    /// Its input.
    pub input: &'static str,
    /// Its source: `node`, or `node.port`.
    pub from: String,
}

/// The wires whose source nodes are not in the file.
pub(crate) fn loose(
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

/// A wire whose source exists.
struct Found {
    from: Port,
    to: NodeIndex,
    input: usize,
    span: Range<usize>,
    /// False if it closes a reported cycle.
    sound: bool,
}

/// The wires at one of their ends, by node; those of a node in their order.
struct ByNode(Vec<(NodeIndex, usize)>);

impl ByNode {
    fn new(wires: &[Found], end: impl Fn(&Found) -> NodeIndex) -> Self {
        let mut all: Vec<_> = wires.iter().enumerate().map(|(at, wire)| (end(wire), at)).collect();
        all.sort_unstable();
        Self(all)
    }

    /// The positions of the wires of a node.
    fn of(&self, node: NodeIndex) -> impl Iterator<Item = usize> {
        let first = self.0.partition_point(|(other, _)| *other < node);
        self.0[first..].iter().take_while(move |(other, _)| *other == node).map(|(_, at)| *at)
    }
}

/// The output at a wire's source. Reports a source that does not exist, except on placeholders.
pub(crate) fn resolve(
    graph: &Graph,
    end: &str,
    what: impl Display,
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
            let near = problems.meant(name, entries.keys().map(String::as_str));
            problems.push(match near {
                Some(near) => problem.hint(format!("did you mean `{near}`?")),
                None => problem.hint("write the name of a node of this file"),
            });
            None
        }
    }
}

/// Connects all valid wires and reports the others, each once.
///
/// Returns the types of all outputs, found in one pass along the wires. Types that depend on something invalid are
/// missing.
pub(crate) fn connect(
    graph: &mut Graph,
    pending: Vec<Pending>,
    entries: &BTreeMap<String, Option<NodeIndex>>,
    bad: &BTreeSet<NodeIndex>,
    registry: &Registry,
    problems: &mut Problems,
) -> BTreeMap<Port, PortType> {
    // Inputs whose wire could not be connected: types that follow from them are unknown.
    let mut broken: BTreeSet<(NodeIndex, usize)> = BTreeSet::new();
    let mut wires = Vec::new();
    for Pending { node, input, end, span } in pending {
        let Some(end) = end else { continue };
        let instance = graph.instance(node);
        let what = format_args!("`{}.{}`", instance.name, instance.node.inputs[input].name);
        match resolve(graph, &end, what, &span, entries, problems) {
            Some(from) => wires.push(Found { from, to: node, input, span, sound: true }),
            None => {
                broken.insert((node, input));
            }
        }
    }
    let order = order(graph, &mut wires, problems);
    broken.extend(wires.iter().filter(|wire| !wire.sound).map(|wire| (wire.to, wire.input)));

    let into = ByNode::new(&wires, |wire| wire.to);
    let mut types: BTreeMap<Port, PortType> = BTreeMap::new();
    for node in order {
        let declared = graph.instance(node).node;
        let mut given: Vec<(usize, PortType)> = Vec::new();
        for wire in into.of(node).map(|at| &wires[at]).filter(|wire| wire.sound) {
            match types.get(&wire.from) {
                Some(gives) if declared.inputs[wire.input].ty.accepts(*gives) => {
                    graph.add_wire(wire.from, node, wire.input);
                    given.push((wire.input, *gives));
                }
                Some(gives) => {
                    broken.insert((node, wire.input));
                    problems.push(refused(graph, wire, *gives, &types, registry));
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
                    Some(input) => {
                        let wired = given.iter().find(|(wired, _)| *wired == input);
                        Some(wired.map_or(PortType::Height, |(_, gives)| *gives))
                    }
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

/// Reports a wire whose type does not fit, and suggests outputs of the same node that do, or a node that converts it.
fn refused(
    graph: &Graph,
    wire: &Found,
    gives: PortType,
    types: &BTreeMap<Port, PortType>,
    registry: &Registry,
) -> Diagnostic {
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
    if !fitting.is_empty() {
        return problem.hint(format!("{} would fit", fitting.join(" or ")));
    }
    problem.hint(match converter(registry, gives, takes) {
        Some((node, param, option)) => format!("put a `{node}` with `{param}: {option}` between them"),
        None => format!("wire something that gives {}", takes.one()),
    })
}

/// A node that reads one raster and gives the wanted type with an option of one of its parameters.
fn converter(
    registry: &Registry,
    gives: PortType,
    takes: PortType,
) -> Option<(&'static str, &'static str, &'static str)> {
    registry.nodes().iter().find_map(|node| {
        let (OutputType::Chosen(choose), [input]) = (node.outputs.first()?.ty, node.inputs) else { return None };
        let mut options = node.specs().into_iter().flat_map(|spec| match spec.kind {
            Kind::Choice { options, .. } => options.iter().map(|(option, _)| (spec.name, *option)).collect(),
            _ => Vec::new(),
        });
        let fits = |(param, option): &(&'static str, &'static str)| {
            let mut params = ParamValues::defaults(&node.specs());
            params.set(param, ParamValue::Choice(option));
            takes.accepts(choose(&params))
        };
        let (param, option) = options.find(fits).filter(|_| input.ty.accepts(gives))?;
        Some((node.id, param, option))
    })
}

/// The nodes, sources first. Wires that close a cycle are reported and marked.
fn order(graph: &Graph, wires: &mut [Found], problems: &mut Problems) -> Vec<NodeIndex> {
    let nodes: Vec<NodeIndex> = graph.indices().collect();
    let (out_of, into) = (ByNode::new(wires, |wire| wire.from.node), ByNode::new(wires, |wire| wire.to));
    let mut waiting: HashMap<NodeIndex, usize> = nodes.iter().map(|node| (*node, into.of(*node).count())).collect();
    let mut ready: VecDeque<NodeIndex> = nodes.iter().copied().filter(|node| waiting[node] == 0).collect();
    let mut order = Vec::with_capacity(nodes.len());
    let mut unvisited = nodes.iter().copied();
    let mut stuck = unvisited.next();
    loop {
        while let Some(node) = ready.pop_front() {
            waiting.remove(&node);
            order.push(node);
            for wire in out_of.of(node).map(|at| &wires[at]).filter(|wire| wire.sound) {
                if let Some(count) = waiting.get_mut(&wire.to) {
                    *count -= 1;
                    if *count == 0 {
                        ready.push_back(wire.to);
                    }
                }
            }
        }
        // Every node that is still waiting depends on itself: drop one wire of each cycle.
        while stuck.is_some_and(|node| !waiting.contains_key(&node)) {
            stuck = unvisited.next();
        }
        let Some(start) = stuck else { return order };
        let cycle = cycle(start, wires, &into, &waiting);
        let Some(closing) = cycle.iter().copied().max_by_key(|at| wires[*at].span.start) else { return order };
        problems.push(cyclic(graph, wires, &cycle, closing));
        wires[closing].sound = false;
        if let Some(count) = waiting.get_mut(&wires[closing].to) {
            *count -= 1;
            if *count == 0 {
                ready.push_back(wires[closing].to);
            }
        }
    }
}

/// The wires of a cycle among waiting nodes, each feeding the one before it.
fn cycle(start: NodeIndex, wires: &[Found], into: &ByNode, waiting: &HashMap<NodeIndex, usize>) -> Vec<usize> {
    let mut seen: BTreeMap<NodeIndex, usize> = BTreeMap::new();
    let mut way: Vec<usize> = Vec::new();
    let mut node = start;
    loop {
        if let Some(first) = seen.insert(node, way.len()) {
            return way.split_off(first);
        }
        // A waiting node has a valid wire from another waiting node, otherwise it would be ready.
        let Some(at) = into.of(node).find(|at| wires[*at].sound && waiting.contains_key(&wires[*at].from.node)) else {
            return Vec::new();
        };
        way.push(at);
        node = wires[at].from.node;
    }
}

fn cyclic(graph: &Graph, wires: &[Found], cycle: &[usize], closing: usize) -> Diagnostic {
    // `cycle` runs upstream; reverse it, and begin with the first node of the file.
    let mut nodes: Vec<NodeIndex> = cycle.iter().rev().map(|at| wires[*at].from.node).collect();
    let first = nodes.iter().enumerate().min_by_key(|(_, node)| **node).map_or(0, |(at, _)| at);
    nodes.rotate_left(first);
    nodes.extend(nodes.first().copied());
    let names: Vec<&str> = nodes.iter().map(|node| graph.instance(*node).name.as_str()).collect();
    let message = format!("the wires form a cycle: {}", names.join(" → "));
    Diagnostic::error("cycle", wires[closing].span.clone(), message).hint("remove one of these wires")
}
