//! Snapshots: the file and the shown terrain at one moment, to go back to or to compare with.

use orograph_graph::{Field, Port, PortType, Value};

use super::Session;

/// The file and the shown output at one moment.
#[derive(Clone, Debug)]
pub struct Snapshot {
    name: String,
    port: String,
    ty: PortType,
    /// The samples of the output, and the heights that they lie on.
    pub(crate) field: Field,
    pub(crate) ground: Option<Field>,
    text: String,
}

impl Snapshot {
    /// Its name, which is also that of its output in a comparison.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The output, as `node.port`.
    #[must_use]
    pub fn port(&self) -> &str {
        &self.port
    }

    /// The type of the output.
    #[must_use]
    pub const fn ty(&self) -> PortType {
        self.ty
    }
}

impl Session {
    /// The snapshots, the oldest first.
    #[must_use]
    pub fn snapshots(&self) -> &[Snapshot] {
        &self.snapshots
    }

    /// The snapshot of this name. Returns None when there is none.
    #[must_use]
    pub fn snapshot(&self, name: &str) -> Option<&Snapshot> {
        self.snapshots.iter().find(|snapshot| snapshot.name == name)
    }

    /// Keeps the file and the shown output as they are. Notes why if nothing is shown that can be kept.
    pub fn take_snapshot(&mut self) {
        let field = |session: &Self, port: &str| match session.built(port).map(|built| &built.value) {
            Some(Value::Field(field)) => Some(field.clone()),
            _ => None,
        };
        let graph = self.document.graph();
        let shown = self.shown().and_then(|name| Some((graph.port(&name).ok()?, name)));
        let kept = shown.and_then(|(port, name)| Some((field(self, &name)?, graph.output_type(port), port, name)));
        let Some((samples, ty, port, name)) = kept else {
            self.note("no terrain is shown that a snapshot could keep", true);
            return;
        };
        let ground = if ty == PortType::Height { None } else { self.ground_of(port) };
        let ground = ground.and_then(|ground| field(self, &graph.port_name(ground)));
        let numbers =
            self.snapshots.iter().filter_map(|snapshot| snapshot.name.strip_prefix("snapshot ")?.parse().ok());
        let number: u32 = 1 + numbers.max().unwrap_or(0);
        let ground = ground.filter(|ground: &Field| ground.window() == samples.window());
        self.snapshots.push(Snapshot {
            name: format!("snapshot {number}"),
            port: name,
            ty,
            field: samples,
            ground,
            text: self.document.source().to_owned(),
        });
    }

    /// The heights under an output: of the same node, of the node's inputs, or of the file.
    #[must_use]
    pub fn ground_of(&self, port: Port) -> Option<Port> {
        let graph = self.document.graph();
        let is_height = |port: &Port| graph.output_type(*port) == PortType::Height;
        if is_height(&port) {
            return Some(port);
        }
        let outputs = graph.instance(port.node).node.outputs.len();
        let inputs = graph.instance(port.node).node.inputs.len();
        let beside = (0..outputs).map(|output| Port { output, ..port }).find(is_height);
        let sources = || (0..inputs).filter_map(|input| graph.source(port.node, input));
        let file = || self.document.outputs().iter().map(|output| output.port).find(is_height);
        beside
            .or_else(|| sources().find(is_height))
            .or_else(|| sources().find_map(|source| self.ground_of(source)))
            .or_else(file)
    }

    /// Goes back to the file of a snapshot, as one undo step.
    pub fn restore_snapshot(&mut self, name: &str) {
        let Some(text) = self.snapshot(name).map(|snapshot| snapshot.text.clone()) else { return };
        self.replace(&text);
    }

    /// Removes a snapshot.
    pub fn remove_snapshot(&mut self, name: &str) {
        self.snapshots.retain(|snapshot| snapshot.name != name);
        if self.compared.as_deref() == Some(name) {
            self.compare(None);
        }
    }

    /// Undoes or redoes edits until this many are done.
    pub fn go_to_step(&mut self, steps: usize) {
        while self.document.steps() > steps && self.undo() {}
        while self.document.steps() < steps && self.redo() {}
    }
}
