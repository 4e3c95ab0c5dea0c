//! Replacing a `Subgraph` with the nodes of its file.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use petgraph::stable_graph::NodeIndex;

use super::{Edit, EditError, editor::refused, fresh::fresh_name};
use crate::{
    document::{Document, Place},
    graph::{Instance, Port},
    job::mix,
    node::Fallback,
    param::ParamValue,
};

/// The edit that replaces a `Subgraph` with the nodes of its file.
#[derive(Clone, Debug)]
pub struct Inlined {
    /// The edit.
    pub edit: Edit,
    /// The names of the new nodes.
    pub names: Vec<String>,
}

/// A `Subgraph` that is replaced.
struct Inlining<'a> {
    outer: &'a Document,
    /// The document of its file, with the names that its nodes get.
    inner: Document,
    node: NodeIndex,
    instance: &'a Instance,
}

impl Document {
    /// Prepares to replace a `Subgraph` with the nodes of its file, with unused names. `places` has their positions on
    /// the canvas, by their names in the file. Every output of this document stays the same, to the byte.
    ///
    /// # Errors
    /// [`EditError`] with the reason, when the node is not a `Subgraph` with a usable file, is muted, or has a seed
    /// that the file exposes.
    pub fn inline(&self, name: &str, places: &BTreeMap<String, [f64; 2]>) -> Result<Inlined, EditError> {
        let graph = self.graph();
        let entry = self.node(name);
        let unknown = || EditError::UnknownNode { name: name.to_owned(), suggestion: None };
        let node = entry.ok_or_else(unknown)?.index.ok_or_else(|| EditError::Placeholder(name.to_owned()))?;
        let Some(inner) = self.subgraph(node) else {
            return Err(refused(format!("`{name}` is not a `Subgraph` with a usable file")));
        };
        if self.is_muted(node) {
            return Err(refused(format!("`{name}` is muted; unmute it first")));
        }
        let seed = Place { node, name: "seed" };
        if let Some(named) = self.parameters().iter().find(|named| named.places.contains(&seed)) {
            let message =
                format!("`{}` exposes the seed of `{name}`, which the nodes of the file do not have", named.name);
            return Err(EditError::Refused { message, hint: Some("remove that parameter first".to_owned()) });
        }
        let mut copy = Self::clone(inner);
        // The names of files become relative to this document.
        copy.move_to(&self.path().map_or_else(|| self.folder().join("outer.ron"), Path::to_owned));
        let places = self.rename(&mut copy, name, places)?;
        let inlining = Inlining { outer: self, inner: copy, node, instance: graph.instance(node) };
        let edits = [inlining.added(&places), inlining.values()?, inlining.readers(name), inlining.exposed(name)];
        let mut edits: Vec<Edit> = edits.into_iter().flatten().collect();
        edits.push(Edit::RemoveNode { name: name.to_owned() });
        Ok(Inlined { edit: Edit::All(edits), names: places.into_keys().collect() })
    }

    /// Gives the nodes of a file names that are unused here; returns their positions by their new names.
    fn rename(
        &self,
        inner: &mut Self,
        gone: &str,
        places: &BTreeMap<String, [f64; 2]>,
    ) -> Result<BTreeMap<String, Option<[f64; 2]>>, EditError> {
        let outer = self.nodes().iter().map(|entry| &entry.name).filter(|name| *name != gone);
        let mut taken: BTreeSet<String> = outer.chain(inner.nodes().iter().map(|entry| &entry.name)).cloned().collect();
        // The `Subgraph` is removed last, so that its name is still in use.
        taken.insert(gone.to_owned());
        let (mut renames, mut placed) = (Vec::new(), BTreeMap::new());
        for entry in inner.nodes() {
            let mut name = entry.name.clone();
            if self.node(&name).is_some() {
                let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
                name = fresh_name(stem, |name| taken.contains(name));
                taken.insert(name.clone());
                renames.push(Edit::RenameNode { from: entry.name.clone(), to: name.clone() });
            }
            placed.insert(name, places.get(&entry.name).copied());
        }
        inner.apply(&Edit::All(renames))?;
        Ok(placed)
    }
}

impl Inlining<'_> {
    /// The nodes of the file as they are written, with their mutes, notes and routes of wires.
    fn added(&self, places: &BTreeMap<String, Option<[f64; 2]>>) -> Vec<Edit> {
        let inner = &self.inner;
        let added = inner.nodes().iter().map(|entry| Edit::AddWritten {
            name: entry.name.clone(),
            text: inner.source()[entry.kind_span.start..entry.span.end].to_owned(),
            at: places.get(&entry.name).copied().flatten(),
        });
        let muted = inner.nodes().iter().filter(|entry| entry.muted);
        let muted = muted.map(|entry| Edit::SetMuted { node: entry.name.clone(), muted: true });
        let notes = inner.nodes().iter().filter(|entry| !entry.note.is_empty());
        let notes = notes.map(|entry| Edit::SetNote { node: entry.name.clone(), note: entry.note.clone() });
        let ways = inner.reroutes().iter().map(|way| Edit::SetReroutes {
            node: way.node.clone(),
            input: way.input.clone(),
            places: way.places.clone(),
        });
        added.chain(muted).chain(notes).chain(ways).collect()
    }

    /// What the `Subgraph` sets: parameters, numbers and wires at their places, and seeds.
    fn values(&self) -> Result<Vec<Edit>, EditError> {
        let (inner, instance) = (&self.inner, self.instance);
        let mut edits = Vec::new();
        for named in inner.parameters() {
            let value = instance.params.get(&named.name);
            // Without a file name or strokes of its own, the `Subgraph` uses those of the file.
            let own = [ParamValue::File(String::new()), ParamValue::Strokes(Vec::new())];
            if let Some(value) = value.filter(|value| !own.contains(value)) {
                edits.extend(named.places.iter().map(|place| self.set(place, value)));
            }
        }
        for (position, input) in inner.inputs().iter().enumerate() {
            let number = instance.constants.get(position).copied().flatten();
            let wire = self.outer.graph().source(self.node, position);
            for place in &input.places {
                if let Some(port) = wire {
                    let from = self.outer.graph().port_name(port);
                    edits.push(Edit::Connect { from, to: self.name(place), input: place.name.to_owned() });
                } else if let Some(number) = number {
                    edits.push(self.set(place, &ParamValue::Float(number)));
                }
            }
        }
        let Some(ParamValue::Seed(seed)) = instance.params.get("seed").filter(|seed| **seed != ParamValue::Seed(0))
        else {
            return Ok(edits);
        };
        for node in inner.graph().indices() {
            let instance = inner.graph().instance(node);
            for (param, value) in instance.params.iter() {
                let ParamValue::Seed(own) = value else { continue };
                if inner.parameters().iter().any(|named| named.places.contains(&Place { node, name: param })) {
                    let message =
                        format!("the file exposes the seed of `{}`, and the `Subgraph` has a seed too", instance.name);
                    return Err(EditError::Refused { message, hint: Some("set the seed to 0 first".to_owned()) });
                }
                let value = ParamValue::Seed(own ^ mix(*seed));
                edits.push(Edit::SetParam { node: instance.name.clone(), param: param.to_owned(), value });
            }
        }
        Ok(edits)
    }

    /// The edit that sets a parameter, or an input that takes a number.
    fn set(&self, place: &Place, value: &ParamValue) -> Edit {
        let kind = self.inner.graph().instance(place.node).node;
        let node = self.name(place);
        match (kind.input(place.name).map(|input| input.fallback), value) {
            (Some(Fallback::Constant { .. }), ParamValue::Float(value)) => {
                Edit::SetConstant { node, input: place.name.to_owned(), value: *value }
            }
            _ => Edit::SetParam { node, param: place.name.to_owned(), value: value.clone() },
        }
    }

    /// The wires from the `Subgraph`, from the nodes of the file instead.
    fn readers(&self, name: &str) -> Vec<Edit> {
        let (graph, mut edits) = (self.outer.graph(), Vec::new());
        let source = |port: Port| {
            let declared = (port.node == self.node).then(|| self.inner.outputs().get(port.output))?;
            declared.map(|output| self.inner.graph().port_name(output.port))
        };
        for (node, position, input) in self.outer.all_inputs() {
            let to = &graph.instance(node).name;
            if let Some(from) = graph.source(node, position).and_then(source).filter(|_| to != name) {
                edits.push(Edit::Connect { from, to: to.clone(), input: input.name.to_owned() });
            }
        }
        for output in self.outer.outputs() {
            let from = source(output.port);
            edits.extend(from.map(|from| Edit::SetOutput { name: output.name.clone(), from }));
        }
        edits
    }

    /// What the document exposes of the `Subgraph`, at the places in the nodes of the file instead.
    fn exposed(&self, name: &str) -> Vec<Edit> {
        let inner = &self.inner;
        let inputs = inner.inputs().iter().map(|named| (&named.name, &named.places));
        let parameters = inner.parameters().iter().map(|named| (&named.name, &named.places));
        let moved = inputs.chain(parameters).map(|(named, places)| Edit::MovePlace {
            from: format!("{name}.{named}"),
            to: places.iter().map(|place| format!("{}.{}", self.name(place), place.name)).collect(),
        });
        moved.collect()
    }

    /// The node of a place in the file.
    fn name(&self, place: &Place) -> String {
        self.inner.graph().instance(place.node).name.clone()
    }
}
