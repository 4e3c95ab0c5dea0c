//! Moving nodes into a new graph file, which a `Subgraph` uses in their place.
//!
//! The inputs of the new file are the wires that enter the selection: one for each output outside and type of input.
//! Its outputs are those that something outside reads. What the outer file exposes of the selected nodes, the new file
//! exposes too, and the outer file's entries then refer to the `Subgraph`.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
};

use petgraph::stable_graph::NodeIndex;

use super::{Edit, EditError, editor::refused};
use crate::{
    diagnostic::Severity,
    document::{
        Document, NamedInput, NamedParameter, Place,
        check::FORMAT,
        subgraph::{FILE, RESERVED, SUBGRAPH},
        syntax::{format::format_source, lex::quote},
    },
    graph::Port,
    value::PortType,
};

/// Nodes to move into a new graph file.
#[derive(Clone, Debug)]
pub struct Extract {
    /// Their names.
    pub nodes: BTreeSet<String>,
    /// The name of the new file, in the folder of the document.
    pub file: String,
    /// The name of the `Subgraph` that replaces them.
    pub name: String,
    /// Its position on the canvas.
    pub at: Option<[f64; 2]>,
    /// The positions of the nodes on the canvas.
    pub places: BTreeMap<String, [f64; 2]>,
}

/// A new graph file, and the edit that replaces its nodes.
#[derive(Clone, Debug)]
pub struct Extracted {
    /// The document of the new file, which has not been written yet.
    pub file: Document,
    /// The edit that replaces the nodes, to be applied once the file is written.
    pub edit: Edit,
}

/// Places of selected nodes that one input or parameter of the new file stands for.
struct Group {
    name: String,
    places: Vec<Place>,
    /// The output outside that feeds them.
    from: Option<Port>,
    ty: Option<PortType>,
    /// The entry of the outer file that refers to them.
    named: Option<String>,
}

/// Names that are taken, and where to look for others.
#[derive(Default)]
struct Names(BTreeSet<String>);

impl Names {
    /// The first unused one of the names, or else the last one with a number.
    fn take(&mut self, names: &[String]) -> String {
        let fitted = names.iter().map(|name| {
            let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
            if name.starts_with(|c: char| c.is_ascii_digit()) { format!("_{name}") } else { name }
        });
        let fitted: Vec<String> = fitted.collect();
        let stem = fitted.last().cloned().unwrap_or_default();
        let numbered = (2..).map(|number| format!("{stem}{number}"));
        let mut all = fitted.into_iter().chain(numbered);
        let free = all.find(|name| !RESERVED.contains(&name.as_str()) && !self.0.contains(name)).unwrap_or_default();
        self.0.insert(free.clone());
        free
    }
}

impl Document {
    /// Prepares to move nodes into a new graph file. Every output of this document stays the same, to the
    /// byte.
    ///
    /// # Errors
    /// [`EditError`] with the reason, when the document has no file, the nodes cannot be moved, for example because a
    /// wire leaves them and comes back, or the new file would have a problem.
    pub fn extract(&self, what: &Extract) -> Result<Extracted, EditError> {
        let Some(path) = self.path() else {
            return Err(refused("save the graph first: the new file goes into its folder".to_owned()));
        };
        let path = path.with_file_name(&what.file);
        let current = Edit::All(what.nodes.iter().map(|node| Edit::Migrate { node: node.clone() }).collect());
        let mut base = self.clone();
        base.apply(&current)?;
        let selection = base.selection(what)?;
        let (inputs, parameters) = (base.fed(&selection), base.driven(&selection));
        let (inputs, parameters) = base.named(inputs, parameters);
        let outputs = base.given(&selection)?;

        let file = base.new_file(what, &inputs, &parameters, &outputs)?;
        let file = Self::parse_at(file, path, self.registry());
        if let Some(problem) = file.problems().iter().find(|problem| problem.severity == Severity::Error) {
            let message = format!("the new file would have a problem: {}", problem.message);
            return Err(EditError::Refused { message, hint: problem.hint.clone() });
        }
        let edit = base.replacement(what, current, (&inputs, &parameters, &outputs), &selection);
        Ok(Extracted { file, edit })
    }

    /// The selected nodes, if they can be moved.
    fn selection(&self, what: &Extract) -> Result<BTreeSet<NodeIndex>, EditError> {
        let graph = self.graph();
        let mut selection = BTreeSet::new();
        for name in &what.nodes {
            let entry =
                self.node(name).ok_or_else(|| EditError::UnknownNode { name: name.clone(), suggestion: None })?;
            selection.insert(entry.index.ok_or_else(|| EditError::Placeholder(name.clone()))?);
        }
        if selection.is_empty() {
            return Err(refused("no node is selected".to_owned()));
        }
        // A node outside that reads the selection, and that the selection reads.
        let mut after: BTreeSet<NodeIndex> = BTreeSet::new();
        for node in graph.topological() {
            let inputs = 0..graph.instance(node).node.inputs.len();
            let sources: Vec<NodeIndex> =
                inputs.filter_map(|input| graph.source(node, input)).map(|port| port.node).collect();
            if !selection.contains(&node) {
                if sources.iter().any(|source| selection.contains(source) || after.contains(source)) {
                    after.insert(node);
                }
            } else if let Some(between) = sources.iter().find(|source| after.contains(source)) {
                let (between, name) = (&graph.instance(*between).name, &graph.instance(node).name);
                let message = format!("a wire leaves the selection and comes back: `{name}` reads `{between}`");
                let hint = Some("select the nodes between them too".to_owned());
                return Err(EditError::Refused { message, hint });
            }
        }
        Ok(selection)
    }

    /// The inputs that the selection needs: for each wire that enters it, and for what the file exposes of it.
    fn fed(&self, selection: &BTreeSet<NodeIndex>) -> Vec<Group> {
        let graph = self.graph();
        let named = |place: &Place| self.inputs().iter().find(|named| named.places.contains(place));
        let mut groups: Vec<Group> = Vec::new();
        for (node, position, input) in self.all_inputs().filter(|(node, ..)| selection.contains(node)) {
            let place = Place { node, name: input.name };
            let from = graph.source(node, position).filter(|port| !selection.contains(&port.node));
            let named = named(&place).map(|named: &NamedInput| named.name.clone());
            if from.is_none() && named.is_none() {
                continue;
            }
            let same = |group: &&mut Group| group.from == from && group.ty == Some(input.ty) && group.named == named;
            match groups.iter_mut().find(same) {
                Some(group) => group.places.push(place),
                None => {
                    groups.push(Group { name: String::new(), places: vec![place], from, ty: Some(input.ty), named })
                }
            }
        }
        groups
    }

    /// The parameters of the selection that the file exposes.
    fn driven(&self, selection: &BTreeSet<NodeIndex>) -> Vec<Group> {
        let of = |named: &NamedParameter| {
            let places = named.places.iter().filter(|place| selection.contains(&place.node)).copied();
            let (places, named) = (places.collect(), Some(named.name.clone()));
            Group { name: String::new(), places, from: None, ty: None, named }
        };
        self.parameters().iter().map(of).filter(|group| !group.places.is_empty()).collect()
    }

    /// Gives all groups different names; those that the file exposes keep theirs if possible.
    fn named(&self, mut inputs: Vec<Group>, mut parameters: Vec<Group>) -> (Vec<Group>, Vec<Group>) {
        let mut names = Names::default();
        let mut all: Vec<&mut Group> = inputs.iter_mut().chain(&mut parameters).collect();
        all.sort_by_key(|group| group.named.is_none());
        for group in all {
            let place = group.places[0];
            let node = &self.graph().instance(place.node).name;
            let own = [place.name.to_owned(), format!("{node}_{}", place.name)];
            let wanted: Vec<String> = group.named.clone().map_or_else(|| own.to_vec(), |named| vec![named]);
            group.name = names.take(&wanted);
        }
        (inputs, parameters)
    }

    /// The outputs of the selection that something outside reads, with their names in the new file. If there is none,
    /// the first outputs of the last nodes.
    fn given(&self, selection: &BTreeSet<NodeIndex>) -> Result<Vec<(String, Port)>, EditError> {
        let graph = self.graph();
        let (mut outside, mut inside) = (BTreeSet::new(), BTreeSet::new());
        for (node, position, _) in self.all_inputs() {
            if let Some(port) = graph.source(node, position).filter(|port| selection.contains(&port.node)) {
                inside.insert(port.node);
                if !selection.contains(&node) {
                    outside.insert((port.node, port.output));
                }
            }
        }
        let written = self.outputs().iter().map(|output| output.port).filter(|port| selection.contains(&port.node));
        outside.extend(written.map(|port| (port.node, port.output)));
        if outside.is_empty() {
            let ends =
                selection.iter().filter(|node| !inside.contains(node)).map(|node| Port { node: *node, output: 0 });
            let ends = ends.filter(|port| !graph.instance(port.node).node.outputs.is_empty());
            outside.extend(ends.filter(|port| graph.output_type(*port).is_writable()).map(|port| (port.node, 0)));
        }
        if outside.is_empty() {
            return Err(refused("the selection has no output that a file could have".to_owned()));
        }
        let mut names = Names::default();
        let mut outputs = Vec::new();
        for (node, output) in outside {
            let (port, instance) = (Port { node, output }, graph.instance(node));
            let ty = graph.output_type(port);
            if !ty.is_writable() {
                let message = format!("`{}` is a {ty}, which cannot be the output of a file", graph.port_name(port));
                return Err(EditError::Refused { message, hint: Some("select the nodes that read it too".to_owned()) });
            }
            let name = instance.node.outputs[output].name;
            outputs.push((names.take(&[name.to_owned(), format!("{}_{name}", instance.name)]), port));
        }
        Ok(outputs)
    }

    /// The text of the new file.
    fn new_file(
        &self,
        what: &Extract,
        inputs: &[Group],
        parameters: &[Group],
        outputs: &[(String, Port)],
    ) -> Result<String, EditError> {
        let graph = self.graph();
        let mut fields = format!("\n    format: {FORMAT},");
        // Writing to a string cannot fail.
        if let Some(world) = self.field_text("world") {
            let _ = write!(fields, "\n    world: {world},");
        }
        for (field, groups) in [("inputs", inputs), ("parameters", parameters)] {
            if groups.is_empty() {
                continue;
            }
            let _ = write!(fields, "\n    {field}: {{");
            for group in groups {
                let place = |place: &Place| quote(&format!("{}.{}", graph.instance(place.node).name, place.name));
                let places: Vec<String> = group.places.iter().map(place).collect();
                let places = if places.len() == 1 { places.concat() } else { format!("[{}]", places.join(", ")) };
                let _ = write!(fields, "\n        {}: {places},", quote(&group.name));
            }
            fields.push_str("\n    },");
        }
        let wires: Vec<String> =
            outputs.iter().map(|(name, port)| format!("{}: {}", quote(name), quote(&self.wire(*port)))).collect();
        let _ = write!(fields, "\n    outputs: {{ {} }},", wires.join(", "));
        let text = self.excerpt_under(&fields, &what.nodes, &what.places)?;
        let mut file = Self::parse_in(text, self.folder(), self.registry());
        let cut = inputs.iter().filter(|group| group.from.is_some()).flat_map(|group| &group.places);
        let cut = cut.map(|place| Edit::Disconnect {
            node: graph.instance(place.node).name.clone(),
            input: place.name.to_owned(),
        });
        file.apply(&Edit::All(cut.collect()))?;
        Ok(format_source(file.source()).unwrap_or_else(|_| file.source().to_owned()))
    }

    /// The edit that replaces the selection.
    fn replacement(
        &self,
        what: &Extract,
        current: Edit,
        (inputs, parameters, outputs): (&[Group], &[Group], &[(String, Port)]),
        selection: &BTreeSet<NodeIndex>,
    ) -> Edit {
        let graph = self.graph();
        let wired = |group: &Group| Some(format!(", {}: {}", group.name, quote(&self.wire(group.from?))));
        let wires: String = inputs.iter().filter_map(wired).collect();
        let text = format!("{}({FILE}: {}{wires})", SUBGRAPH.id, quote(&what.file));
        let mut edits = vec![current, Edit::AddWritten { name: what.name.clone(), text, at: what.at }];
        let new = |port: Port| {
            let output = outputs.iter().find(|(_, given)| *given == port);
            output.map(|(output, _)| format!("{}.{output}", what.name))
        };
        for (node, position, input) in self.all_inputs().filter(|(node, ..)| !selection.contains(node)) {
            if let Some(from) = graph.source(node, position).and_then(new) {
                let (to, input) = (graph.instance(node).name.clone(), input.name.to_owned());
                edits.push(Edit::Connect { from, to, input });
            }
        }
        for output in self.outputs() {
            let from = new(output.port);
            edits.extend(from.map(|from| Edit::SetOutput { name: output.name.clone(), from }));
        }
        for group in inputs.iter().chain(parameters).filter(|group| group.named.is_some()) {
            for place in &group.places {
                let from = format!("{}.{}", graph.instance(place.node).name, place.name);
                edits.push(Edit::MovePlace { from, to: vec![format!("{}.{}", what.name, group.name)] });
            }
        }
        edits.extend(what.nodes.iter().map(|name| Edit::RemoveNode { name: name.clone() }));
        Edit::All(edits)
    }

    /// A wire from an output, without the name of a first output.
    pub(super) fn wire(&self, port: Port) -> String {
        match port.output {
            0 => self.graph().instance(port.node).name.clone(),
            _ => self.graph().port_name(port),
        }
    }
}
