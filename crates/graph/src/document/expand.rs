//! The graph that is built: each `Subgraph` is replaced by the nodes of its file.
//!
//! A node of a used file is named after the use and itself, `hills/base`. The definitions of the use are written into
//! the nodes: a parameter at every place that it drives, a wire or a number at every input that it feeds, file names
//! relative to the outermost file. Muted nodes are removed; the wire that a muted node passes on replaces its first
//! output. Inner nodes therefore have their own keys; nodes that are equal in several uses are added only once.

use std::{
    collections::{BTreeMap, HashMap},
    path::{Path, PathBuf},
    sync::Arc,
};

use petgraph::stable_graph::NodeIndex;

use super::{Document, OutputDecl, check::muted::passed_input};
use crate::{
    graph::{Graph, Port},
    job::mix,
    param::ParamValue,
    value::PortType,
};

/// A document's graph including the nodes of the files that it uses.
#[derive(Clone, Debug, Default)]
pub struct Expanded {
    /// The graph; it has no `Subgraph`. It stays the same one while edits change nothing that is built.
    pub graph: Arc<Graph>,
    /// The document's outputs, in this graph.
    pub outputs: Vec<OutputDecl>,
    /// Outputs of the document's graph in this one; `None` when they are the same.
    ports: Option<Arc<HashMap<Port, Port>>>,
}

impl Expanded {
    /// The output in this graph for an output of the document's graph.
    #[must_use]
    pub fn port(&self, port: Port) -> Option<Port> {
        self.ports.as_ref().map_or(Some(port), |ports| ports.get(&port).copied())
    }
}

/// The cached expanded graph.
#[derive(Debug)]
pub(super) struct Placed {
    graph: Arc<Graph>,
    ports: Option<Arc<HashMap<Port, Port>>>,
    /// The document's outputs in file order; `None` for an output without a source.
    outputs: Vec<Option<(Port, PortType)>>,
}

/// The definitions of a use of a file.
#[derive(Default)]
struct Use {
    /// Prefix of the names of the file's nodes.
    prefix: String,
    /// The file's folder, relative to that of the outermost file.
    folder: PathBuf,
    /// The seed of the use.
    seed: u32,
    /// Values of parameters, and of numbers at inputs, by node and name.
    values: BTreeMap<(NodeIndex, &'static str), ParamValue>,
    /// Sources of inputs, by node and name.
    wires: BTreeMap<(NodeIndex, &'static str), Port>,
}

/// The names of the inputs that a node of ground layers mixes, in the order of the layers.
const LAYERS: [&str; 4] = ["first", "second", "third", "fourth"];

/// The layers of weights that can have coverage: all of them, unless the node has an input for each.
fn layers(graph: &Graph, port: Port) -> [bool; 4] {
    let inputs = graph.instance(port.node).node.inputs;
    let at = LAYERS.map(|layer| inputs.iter().position(|input| input.name == layer));
    let mut layers = at.map(|at| at.is_none_or(|at| graph.source(port.node, at).is_some()));
    // the first layer covers what the others leave
    layers[0] = true;
    layers
}

impl Document {
    /// The graph to build. For a document with errors it is the graph of the valid part.
    #[must_use]
    pub fn expand(&self) -> Expanded {
        let Placed { graph, ports, outputs } = self.read.build.placed.get_or_init(|| self.placed());
        let outputs = self.outputs().iter().zip(outputs).filter_map(|(output, placed)| {
            let (port, ty) = (*placed)?;
            Some(OutputDecl { port, ty, layers: layers(graph, port), ..output.clone() })
        });
        Expanded { graph: Arc::clone(graph), outputs: outputs.collect(), ports: ports.clone() }
    }

    fn placed(&self) -> Placed {
        let checked = &self.read.checked;
        if checked.subgraphs.is_empty() && checked.muted.is_empty() {
            let outputs =
                self.outputs().iter().map(|output| Some((output.port, checked.graph.output_type(output.port))));
            return Placed { graph: Arc::clone(&checked.graph), ports: None, outputs: outputs.collect() };
        }
        let mut graph = Graph::default();
        let mut known = (!checked.subgraphs.is_empty()).then(Known::new);
        let ports = place(self, &Use::default(), &mut graph, &mut known);
        let outputs = self.outputs().iter().map(|output| {
            let port = *ports.get(&output.port)?;
            Some((port, graph.output_type(port)))
        });
        let outputs = outputs.collect();
        Placed { graph: Arc::new(graph), ports: Some(Arc::new(ports)), outputs }
    }
}

/// Nodes of used files by their contents, to merge equal nodes.
type Known = HashMap<String, NodeIndex>;

/// Adds the nodes of a document to a graph; returns where its outputs are. Without `known`, equal nodes are not merged.
fn place(document: &Document, given: &Use, to: &mut Graph, known: &mut Option<Known>) -> HashMap<Port, Port> {
    let graph = document.graph();
    let mut ports = HashMap::new();
    for index in graph.topological() {
        let mut instance = graph.instance(index).clone();
        let node = instance.node;
        instance.name.insert_str(0, &given.prefix);
        for (name, value) in graph.instance(index).params.iter() {
            let said = given.values.get(&(index, name));
            let value = match said.unwrap_or(value) {
                // File names given by the use are already relative to the outermost file.
                ParamValue::File(file) if said.is_none() && !file.is_empty() => {
                    ParamValue::File(given.folder.join(file).to_string_lossy().into_owned())
                }
                ParamValue::Seed(seed) => ParamValue::Seed(seed ^ mix(given.seed)),
                other => other.clone(),
            };
            instance.params.set(name, value);
        }
        let mut wires = Vec::new();
        for (position, input) in node.inputs.iter().enumerate() {
            if let Some(ParamValue::Float(value)) = given.values.get(&(index, input.name)) {
                instance.constants[position] = Some(*value);
            }
            let inner = graph.source(index, position).and_then(|port| ports.get(&port).copied());
            let number = given.values.contains_key(&(index, input.name));
            let outer = given.wires.get(&(index, input.name)).copied();
            if let Some(port) = outer.or(inner.filter(|_| !number)) {
                wires.push((position, port));
            }
        }
        if document.is_muted(index) {
            let ty = |at| wires.iter().find(|(wired, _)| *wired == at).map(|(_, port)| to.output_type(*port));
            if let Some(passed) = passed_input(graph, index, ty) {
                let port = wires.iter().find(|(wired, _)| *wired == passed);
                ports.extend(port.map(|(_, port)| (Port { node: index, output: 0 }, *port)));
            }
            continue;
        }
        if let Some(inner) = document.subgraph(index) {
            let mut inside = Use { prefix: format!("{}/", instance.name), ..Use::default() };
            if let Some(ParamValue::File(file)) = instance.params.get(super::subgraph::FILE) {
                inside.folder = Path::new(file).parent().map(Path::to_owned).unwrap_or_default();
            }
            if let Some(ParamValue::Seed(seed)) = instance.params.get("seed") {
                inside.seed = *seed;
            }
            for parameter in inner.parameters() {
                if let Some(value) = instance.params.get(&parameter.name) {
                    let places = parameter.places.iter().map(|place| ((place.node, place.name), value.clone()));
                    // If the use has an empty file name or no strokes, the file keeps its own.
                    let own = [ParamValue::File(String::new()), ParamValue::Strokes(Vec::new())];
                    inside.values.extend(places.filter(|(_, value)| !own.contains(value)));
                }
            }
            for (position, input) in inner.inputs().iter().enumerate() {
                let places = || input.places.iter().map(|place| (place.node, place.name));
                if let Some(value) = instance.constants.get(position).copied().flatten() {
                    inside.values.extend(places().map(|place| (place, ParamValue::Float(value))));
                }
                if let Some((_, port)) = wires.iter().find(|(wired, _)| *wired == position) {
                    inside.wires.extend(places().map(|place| (place, *port)));
                }
            }
            let inner_ports = place(inner, &inside, to, known);
            for (output, declared) in inner.outputs().iter().enumerate() {
                if let Some(port) = inner_ports.get(&declared.port) {
                    ports.insert(Port { node: index, output }, *port);
                }
            }
            continue;
        }
        let what =
            known.as_ref().map(|_| format!("{} {:?} {:?} {wires:?}", node.id, instance.params, instance.constants));
        let equal = known.as_ref().zip(what.as_ref()).and_then(|(known, what)| known.get(what).copied());
        let equal = equal.filter(|_| !given.prefix.is_empty());
        let new = match equal {
            Some(equal) => equal,
            None => {
                // Names in a file are unique, and its nodes are prefixed with the name of the use.
                let Ok(new) = to.add(instance) else { continue };
                for (position, port) in wires {
                    to.add_wire(port, new, position);
                }
                if let (Some(known), Some(what)) = (known.as_mut(), what) {
                    known.insert(what, new);
                }
                new
            }
        };
        ports.extend((0..node.outputs.len()).map(|output| (Port { node: index, output }, Port { node: new, output })));
    }
    ports
}
