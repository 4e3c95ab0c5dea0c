//! Rasters that a program gives to a graph, instead of what a node would compute.

use std::sync::Arc;

use petgraph::stable_graph::NodeIndex;

use crate::{
    field::Field,
    graph::{Graph, GraphError, Instance, Port},
    node::Node,
    value::PortType,
};

/// A raster that a program gives. A node gets it as its first input, on its own cells and whatever the window; its keys
/// include the content.
#[derive(Clone, Debug)]
pub struct Given {
    field: Field,
    ty: PortType,
    content: [u8; 32],
}

impl Given {
    /// A raster of this type.
    ///
    /// # Errors
    /// A message when it has another number of planes than values of the type, or a number that is not finite.
    pub fn new(field: Field, ty: PortType) -> Result<Arc<Self>, String> {
        match ty.planes() {
            Some(planes) if planes == field.planes() => {}
            Some(planes) => return Err(format!("has {} planes; a {ty} has {planes}", field.planes())),
            None => return Err(format!("is a raster instead of a {ty}")),
        }
        if let Some(at) = field.samples().iter().position(|sample| !sample.is_finite()) {
            let (cell, nx) = (at % field.window().len(), field.window().nx());
            return Err(format!("has {} in row {}, column {}", field.samples()[at], cell / nx, cell % nx));
        }
        let content = content(&field);
        Ok(Arc::new(Self { field, ty, content }))
    }

    /// The raster. Its world has the extent of the world that is built, but may have other cells.
    #[must_use]
    pub const fn field(&self) -> &Field {
        &self.field
    }

    /// Its type.
    #[must_use]
    pub const fn ty(&self) -> PortType {
        self.ty
    }

    /// A hash of its cells and samples.
    pub(crate) const fn content(&self) -> &[u8; 32] {
        &self.content
    }
}

fn content(field: &Field) -> [u8; 32] {
    const CHUNK: usize = 1 << 14;
    let mut hash = blake3::Hasher::new();
    field.window().cells.iter().for_each(|count| {
        hash.update(&count.to_le_bytes());
    });
    let mut bytes = Vec::with_capacity(CHUNK * size_of::<f32>());
    for chunk in field.samples().chunks(CHUNK) {
        bytes.clear();
        bytes.extend(chunk.iter().flat_map(|sample| sample.to_le_bytes()));
        hash.update(&bytes);
    }
    *hash.finalize().as_bytes()
}

impl Graph {
    /// Adds a node of a kind with one output, which returns the raster.
    ///
    /// # Errors
    /// [`GraphError::NameTaken`].
    pub fn add_given(&mut self, name: &str, kind: &'static Node, given: Arc<Given>) -> Result<Port, GraphError> {
        let node = self.add(Instance { given: Some(given), ..Instance::new(name, kind) })?;
        Ok(Port { node, output: 0 })
    }

    /// Wires every input that reads an output to another output of the same type.
    ///
    /// # Errors
    /// [`GraphError::Type`] or [`GraphError::Cycle`]; wires before the refused one stay changed.
    pub fn redirect(&mut self, from: Port, to: Port) -> Result<(), GraphError> {
        let readers: Vec<(NodeIndex, &'static str)> = self
            .indices()
            .flat_map(|node| {
                self.instance(node).node.inputs.iter().enumerate().map(move |(at, input)| (node, at, input))
            })
            .filter(|(node, at, _)| self.source(*node, *at) == Some(from))
            .map(|(node, _, input)| (node, input.name))
            .collect();
        readers.into_iter().try_for_each(|(node, input)| self.connect(to, node, input))
    }
}
