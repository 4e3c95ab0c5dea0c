//! The graph: node instances and the wires between them, on petgraph.

use std::{
    collections::{BTreeMap, BTreeSet, HashMap, HashSet, VecDeque},
    sync::{Arc, OnceLock},
};

use petgraph::{
    Direction,
    stable_graph::{NodeIndex, StableDiGraph},
    visit::{EdgeRef as _, IntoEdgeReferences as _, IntoNodeReferences as _},
};

use crate::{
    backend::Prefer,
    given::Given,
    node::{Fallback, Node, OutputType, Reach},
    param::{ParamSpec, ParamValues},
    suggest::closest,
    value::PortType,
    world::World,
};

/// A node in a graph: its kind with parameters and constants.
#[derive(Clone, Debug)]
pub struct Instance {
    /// Its name, unique in the graph.
    pub name: String,
    /// Its kind.
    pub node: &'static Node,
    /// Checked parameters.
    pub params: ParamValues,
    /// Per declared input, the number that the file has instead of a wire.
    pub constants: Vec<Option<f64>>,
    /// The raster that a program gives as its first input; `None` for every node of a file.
    pub given: Option<Arc<Given>>,
    /// The backend that should run it; no file says that.
    pub prefers: Prefer,
}

impl Instance {
    /// A node with the defaults of its kind.
    #[must_use]
    pub fn new(name: impl Into<String>, node: &'static Node) -> Self {
        Self::with(name, node, &node.specs())
    }

    /// The same, if the specifications of the kind have been made already.
    pub(crate) fn with(name: impl Into<String>, node: &'static Node, specs: &[ParamSpec]) -> Self {
        let (params, constants) = (ParamValues::defaults(specs), vec![None; node.inputs.len()]);
        Self { name: name.into(), node, params, constants, given: None, prefers: Prefer::Auto }
    }

    /// The type of an output; `wired` returns the type of the wire into an input.
    fn output_type(&self, output: usize, wired: impl Fn(usize) -> Option<PortType>) -> PortType {
        if let Some(given) = &self.given {
            return given.ty();
        }
        match self.node.outputs[output].ty {
            OutputType::Fixed(ty) => ty,
            OutputType::Chosen(choose) => choose(&self.params),
            OutputType::SameAs(input) => {
                let position = self.node.inputs.iter().position(|declared| declared.name == input);
                position.and_then(wired).unwrap_or(PortType::Height)
            }
        }
    }
}

/// A wire from an output of one node to an input of another, by position in their declarations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wire {
    /// Position of the output.
    pub output: usize,
    /// Position of the input.
    pub input: usize,
}

/// An output of a node in a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Port {
    /// The node.
    pub node: NodeIndex,
    /// Position of the output in its declaration.
    pub output: usize,
}

/// Why a change of a graph was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GraphError {
    /// There is no node of that name.
    #[error("there is no node `{name}`{}", did_you_mean(.suggestion))]
    UnknownNode {
        /// The requested name.
        name: String,
        /// A similar name.
        suggestion: Option<String>,
    },
    /// There is already a node of that name.
    #[error("there is a node `{0}` already")]
    NameTaken(String),
    /// The node has no such port.
    #[error("`{node}` ({id}) has no {direction} `{port}`{}", did_you_mean(.suggestion))]
    UnknownPort {
        /// The node's name.
        node: String,
        /// Its kind.
        id: &'static str,
        /// `input` or `output`.
        direction: &'static str,
        /// The requested port.
        port: String,
        /// A similar port.
        suggestion: Option<String>,
    },
    /// The types do not fit.
    #[error("`{from}` gives {}, but `{to}` takes {}", .gives.one(), .takes.one())]
    Type {
        /// The output, as `node.port`.
        from: String,
        /// Its type.
        gives: PortType,
        /// The input, as `node.port`.
        to: String,
        /// The type that the input takes.
        takes: PortType,
    },
    /// The wire would close a cycle.
    #[error("the wire would close a cycle: {}", .0.join(" → "))]
    Cycle(Vec<String>),
}

fn did_you_mean(suggestion: &Option<String>) -> String {
    suggestion.as_ref().map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

/// Instances and wires. Every wire matches in type, every input has at most one wire, and there are no cycles.
#[derive(Clone, Debug, Default)]
pub struct Graph {
    inner: StableDiGraph<Instance, Wire>,
    names: BTreeMap<String, NodeIndex>,
    /// The types of all outputs, from [`Self::find_types`] until the next change.
    types: OnceLock<HashMap<Port, PortType>>,
}

impl Graph {
    /// Adds a node.
    ///
    /// # Errors
    /// [`GraphError::NameTaken`].
    pub fn add(&mut self, instance: Instance) -> Result<NodeIndex, GraphError> {
        if self.names.contains_key(&instance.name) {
            return Err(GraphError::NameTaken(instance.name));
        }
        self.types.take();
        let name = instance.name.clone();
        let index = self.inner.add_node(instance);
        self.names.insert(name, index);
        Ok(index)
    }

    /// Removes a node with its wires.
    pub fn remove(&mut self, index: NodeIndex) -> Option<Instance> {
        self.types.take();
        let instance = self.inner.remove_node(index)?;
        self.names.remove(&instance.name);
        Some(instance)
    }

    /// The node of that name.
    ///
    /// # Errors
    /// [`GraphError::UnknownNode`], with a similar name.
    pub fn find(&self, name: &str) -> Result<NodeIndex, GraphError> {
        self.names.get(name).copied().ok_or_else(|| GraphError::UnknownNode {
            name: name.to_owned(),
            suggestion: closest(name, self.names.keys().map(String::as_str)).map(str::to_owned),
        })
    }

    /// The instance at an index. Returns None when the graph has none there.
    #[must_use]
    pub fn get(&self, index: NodeIndex) -> Option<&Instance> {
        self.inner.node_weight(index)
    }

    /// The instance at an index.
    ///
    /// # Panics
    /// When the index does not belong to this graph.
    #[must_use]
    pub fn instance(&self, index: NodeIndex) -> &Instance {
        &self.inner[index]
    }

    /// The instance at an index, mutable, to change its parameters and constants. Its name must stay the same.
    ///
    /// # Panics
    /// When the index does not belong to this graph.
    pub fn instance_mut(&mut self, index: NodeIndex) -> &mut Instance {
        self.types.take();
        &mut self.inner[index]
    }

    /// All nodes, in the order they were added.
    pub fn indices(&self) -> impl Iterator<Item = NodeIndex> {
        self.inner.node_indices()
    }

    /// All nodes in topological order: each after those that it reads.
    #[must_use]
    pub fn topological(&self) -> Vec<NodeIndex> {
        // Connecting refuses cycles, so there is an order.
        petgraph::algo::toposort(&self.inner, None).unwrap_or_default()
    }

    /// Nodes and all that they depend on.
    #[must_use]
    pub fn upstream(&self, nodes: impl IntoIterator<Item = NodeIndex>) -> BTreeSet<NodeIndex> {
        let mut found: BTreeSet<NodeIndex> = nodes.into_iter().collect();
        let mut next: Vec<NodeIndex> = found.iter().copied().collect();
        while let Some(node) = next.pop() {
            let sources = self.inner.neighbors_directed(node, Direction::Incoming);
            next.extend(sources.filter(|source| found.insert(*source)));
        }
        found
    }

    /// The output that a source such as `rivers` or `rivers.area` refers to; without a port, the first output.
    ///
    /// # Errors
    /// [`GraphError::UnknownNode`] or [`GraphError::UnknownPort`].
    pub fn port(&self, end: &str) -> Result<Port, GraphError> {
        let (name, output) = end.split_once('.').map_or((end, None), |(name, output)| (name, Some(output)));
        let node = self.find(name)?;
        let declared = self.inner[node].node;
        let Some(output) = output else { return Ok(Port { node, output: 0 }) };
        let output = declared.output_index(output).ok_or_else(|| GraphError::UnknownPort {
            node: name.to_owned(),
            id: declared.id,
            direction: "output",
            port: output.to_owned(),
            suggestion: closest(output, declared.outputs.iter().map(|o| o.name)).map(str::to_owned),
        })?;
        Ok(Port { node, output })
    }

    /// Wires an output to an input, replacing an earlier wire.
    ///
    /// # Errors
    /// [`GraphError::UnknownPort`], [`GraphError::Type`] or [`GraphError::Cycle`]; the graph is then unchanged.
    pub fn connect(&mut self, from: Port, to: NodeIndex, input: &str) -> Result<(), GraphError> {
        let target = &self.inner[to];
        let position =
            target.node.inputs.iter().position(|i| i.name == input).ok_or_else(|| GraphError::UnknownPort {
                node: target.name.clone(),
                id: target.node.id,
                direction: "input",
                port: input.to_owned(),
                suggestion: closest(input, target.node.inputs.iter().map(|i| i.name)).map(str::to_owned),
            })?;
        if let Some(cycle) = self.path(to, from.node) {
            let mut names: Vec<String> = cycle.iter().map(|n| self.inner[*n].name.clone()).collect();
            names.push(target.name.clone());
            return Err(GraphError::Cycle(names));
        }
        let (gives, takes) = (self.output_type(from), target.node.inputs[position].ty);
        if !takes.accepts(gives) {
            return Err(GraphError::Type {
                from: self.port_name(from),
                gives,
                to: format!("{}.{input}", target.name),
                takes,
            });
        }
        self.disconnect(to, position);
        self.types.take();
        self.inner.add_edge(from.node, to, Wire { output: from.output, input: position });
        Ok(())
    }

    /// Wires an output to an input without a wire. The caller has checked that the types match and that no cycle
    /// closes.
    pub(crate) fn add_wire(&mut self, from: Port, to: NodeIndex, input: usize) {
        self.types.take();
        self.inner.add_edge(from.node, to, Wire { output: from.output, input });
    }

    /// Removes the wire into an input, if there is one.
    pub fn disconnect(&mut self, to: NodeIndex, input: usize) {
        let edge = self.inner.edges_directed(to, Direction::Incoming).find(|e| e.weight().input == input);
        if let Some(edge) = edge.map(|e| e.id()) {
            self.types.take();
            self.inner.remove_edge(edge);
        }
    }

    /// The output wired to an input. Returns None when there is no wire.
    #[must_use]
    pub fn source(&self, to: NodeIndex, input: usize) -> Option<Port> {
        self.inner
            .edges_directed(to, Direction::Incoming)
            .find(|e| e.weight().input == input)
            .map(|e| Port { node: e.source(), output: e.weight().output })
    }

    /// Returns true if the input of this name is wired; false if there is none.
    #[must_use]
    pub fn is_wired(&self, node: NodeIndex, input: &str) -> bool {
        let position = self.instance(node).node.inputs.iter().position(|declared| declared.name == input);
        position.is_some_and(|position| self.source(node, position).is_some())
    }

    /// The type of an output in this graph.
    #[must_use]
    pub fn output_type(&self, port: Port) -> PortType {
        if let Some(ty) = self.types.get().and_then(|types| types.get(&port)) {
            return *ty;
        }
        let mut port = port;
        loop {
            let instance = &self.inner[port.node];
            if let Some(given) = &instance.given {
                return given.ty();
            }
            let source = match instance.node.outputs[port.output].ty {
                OutputType::Fixed(ty) => return ty,
                OutputType::Chosen(choose) => return choose(&instance.params),
                OutputType::SameAs(input) => instance.node.inputs.iter().position(|i| i.name == input),
            };
            match source.and_then(|position| self.source(port.node, position)) {
                Some(source) => port = source,
                None => return PortType::Height,
            }
        }
    }

    /// Finds the types of all outputs in one pass, so that [`Self::output_type`] does not follow wires until the next
    /// change.
    pub(crate) fn find_types(&self) {
        self.types.get_or_init(|| self.output_types());
    }

    fn output_types(&self) -> HashMap<Port, PortType> {
        let mut types = HashMap::new();
        for node in self.topological() {
            let instance = &self.inner[node];
            for output in 0..instance.node.outputs.len() {
                let wired = |input| self.source(node, input).and_then(|source| types.get(&source).copied());
                let ty = instance.output_type(output, wired);
                types.insert(Port { node, output }, ty);
            }
        }
        types
    }

    /// Returns true if the other graph has the same nodes, with the same names, parameters and indices, and the same
    /// wires.
    pub(crate) fn same(&self, other: &Self) -> bool {
        let instance = |a: &Instance, b: &Instance| {
            a.name == b.name && std::ptr::eq(a.node, b.node) && a.params == b.params && a.constants == b.constants
        };
        let mut nodes = self.inner.node_references().zip(other.inner.node_references());
        let mut wires = self.inner.edge_references().zip(other.inner.edge_references());
        self.inner.node_count() == other.inner.node_count()
            && self.inner.edge_count() == other.inner.edge_count()
            && nodes.all(|((a, this), (b, that))| a == b && instance(this, that))
            && wires.all(|(a, b)| a.source() == b.source() && a.target() == b.target() && a.weight() == b.weight())
    }

    /// An output as `node.port`.
    #[must_use]
    pub fn port_name(&self, port: Port) -> String {
        let instance = &self.inner[port.node];
        format!("{}.{}", instance.name, instance.node.outputs[port.output].name)
    }

    /// Required inputs without a wire, as node and position.
    #[must_use]
    pub fn unwired(&self) -> Vec<(NodeIndex, usize)> {
        let mut found = Vec::new();
        for index in self.inner.node_indices() {
            for (position, input) in self.inner[index].node.inputs.iter().enumerate() {
                if input.fallback == Fallback::Required && self.source(index, position).is_none() {
                    found.push((index, position));
                }
            }
        }
        found
    }

    /// The nearest node, from this one upstream, that needs the whole world to compute a part of it. Returns None when
    /// a part of the node can be computed from a part of every node upstream.
    #[must_use]
    pub fn needs_whole_world(&self, node: NodeIndex, world: &World) -> Option<NodeIndex> {
        let shorter = world.size[0].min(world.size[1]);
        let (mut seen, mut queue) = (HashSet::from([node]), VecDeque::from([node]));
        while let Some(node) = queue.pop_front() {
            let instance = &self.inner[node];
            let part = match instance.node.reach {
                Reach::Point => true,
                Reach::Metres(from) => (0.0..shorter).contains(&from(&instance.params, world.cell_m())),
                Reach::World => false,
            };
            if !part {
                return Some(node);
            }
            let sources = self.inner.neighbors_directed(node, Direction::Incoming);
            queue.extend(sources.filter(|source| seen.insert(*source)));
        }
        None
    }

    /// The nodes on a path along wires from one node to another, including both. Returns None when there is no path.
    fn path(&self, from: NodeIndex, to: NodeIndex) -> Option<Vec<NodeIndex>> {
        let mut before: BTreeMap<NodeIndex, NodeIndex> = BTreeMap::new();
        let mut queue = VecDeque::from([from]);
        while let Some(node) = queue.pop_front() {
            if node == to {
                let mut way = vec![node];
                while let Some(previous) = before.get(way.last()?) {
                    way.push(*previous);
                }
                way.reverse();
                return Some(way);
            }
            for next in self.inner.neighbors(node) {
                if next != from && !before.contains_key(&next) {
                    before.insert(next, node);
                    queue.push_back(next);
                }
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Input, Output, Unit};

    static SOURCE: Node = Node {
        id: "Source",
        outputs: &[
            Output::gives("height", PortType::Height, "H."),
            Output::gives("slope", PortType::Scalar(Unit::Degrees), "S."),
        ],
        ..Node::DEFAULT
    };
    static FILTER: Node = Node {
        id: "Filter",
        inputs: &[Input::needs("height", PortType::Height, "H."), Input::mask("mask", "M.")],
        outputs: &[Output::same_as("height", "height", "H.")],
        ..Node::DEFAULT
    };

    fn graph() -> Graph {
        let mut graph = Graph::default();
        graph.add(Instance::new("base", &SOURCE)).expect("new name");
        graph.add(Instance::new("one", &FILTER)).expect("new name");
        graph.add(Instance::new("two", &FILTER)).expect("new name");
        graph
    }

    #[test]
    fn wires_that_do_not_fit_are_refused_with_the_reason() {
        let mut graph = graph();
        let one = graph.find("one").expect("exists");
        let slope = graph.port("base.slope").expect("exists");
        let error = graph.connect(slope, one, "height").expect_err("a slope is no height").to_string();
        assert!(error.contains("scalar (°)") && error.contains("height (m)"), "{error}");
        assert!(
            matches!(graph.port("base.slop"), Err(GraphError::UnknownPort { suggestion: Some(s), .. }) if s == "slope")
        );
        assert!(matches!(graph.add(Instance::new("one", &FILTER)), Err(GraphError::NameTaken(_))));
    }

    #[test]
    fn cycles_are_refused_and_named() {
        let mut graph = graph();
        let (one, two) = (graph.find("one").expect("exists"), graph.find("two").expect("exists"));
        graph.connect(graph.port("base").expect("exists"), one, "height").expect("fits");
        graph.connect(graph.port("one").expect("exists"), two, "height").expect("fits");
        let error = graph.connect(graph.port("two").expect("exists"), one, "height").expect_err("a cycle");
        assert_eq!(error, GraphError::Cycle(vec!["one".into(), "two".into(), "one".into()]));
        let own = graph.connect(graph.port("one").expect("exists"), one, "height").expect_err("a cycle");
        assert_eq!(own, GraphError::Cycle(vec!["one".into(), "one".into()]));
        assert_eq!(graph.source(one, 0).map(|p| graph.port_name(p)), Some("base.height".into()));
    }

    #[test]
    fn types_follow_wires() {
        let mut graph = graph();
        let one = graph.find("one").expect("exists");
        assert_eq!(graph.unwired().len(), 2);
        graph.connect(graph.port("base").expect("exists"), one, "height").expect("fits");
        assert_eq!(graph.output_type(graph.port("one").expect("exists")), PortType::Height);
        assert_eq!(graph.unwired().len(), 1);
    }

    #[test]
    fn the_nearest_node_that_needs_the_whole_world_is_found_upwards() {
        static ROUTER: Node = Node { id: "Router", reach: Reach::World, ..FILTER };
        static FAR: Node = Node { id: "Far", reach: Reach::Metres(|_, _| 1e9), ..FILTER };
        let mut graph = graph();
        let router = graph.add(Instance::new("router", &ROUTER)).expect("new name");
        let [base, one, two] = ["base", "one", "two"].map(|name| graph.find(name).expect("exists"));
        graph.connect(Port { node: base, output: 0 }, router, "height").expect("fits");
        graph.connect(Port { node: base, output: 0 }, one, "height").expect("fits");
        graph.connect(Port { node: router, output: 0 }, two, "height").expect("fits");
        let needs = [base, one, two, router].map(|node| graph.needs_whole_world(node, &World::default()));
        assert_eq!(needs, [None, None, Some(router), Some(router)]);
        graph.instance_mut(one).node = &FAR;
        assert_eq!(graph.needs_whole_world(one, &World::default()), Some(one));
    }
}
