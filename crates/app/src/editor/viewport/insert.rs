//! Adds nodes from the viewport: after the shown terrain, or beside the graph.

use orograph_graph::{Edit, Input, Node, OutputType, Port, PortType};

use crate::editor::Session;

/// Distance between the corners of neighbouring nodes in the graph.
const STEP: [f64; 2] = [240.0, 240.0];

/// A node to add.
#[derive(Clone, Copy)]
pub(super) struct New {
    pub(super) kind: &'static Node,
    /// What its name begins with.
    pub(super) name: &'static str,
    /// Parameters that do not have their defaults, and their values as text.
    pub(super) values: &'static [(&'static str, &'static str)],
}

impl New {
    /// A node with the defaults of its kind.
    pub(super) const fn of(kind: &'static Node) -> Self {
        Self { kind, name: kind.id, values: &[] }
    }

    /// A name that no node has yet.
    fn fresh_name(self, session: &Session) -> String {
        let is_taken = |name: &str| session.document().nodes().iter().any(|node| node.name == *name);
        orograph_graph::fresh_name(&self.name.to_lowercase(), is_taken)
    }

    /// The edits that add it under a name at a position in the graph.
    fn edits(self, name: &str, at: Option<[f64; 2]>) -> Vec<Edit> {
        let node = || name.to_owned();
        let added = Edit::AddNode { name: node(), kind: self.kind.id.to_owned(), at };
        let set = self.values.iter().map(|(param, text)| Edit::SetText {
            node: node(),
            name: (*param).to_owned(),
            text: (*text).to_owned(),
        });
        std::iter::once(added).chain(set).collect()
    }
}

/// Adds a node and selects it: if it changes a terrain, after the shown one, otherwise before the selected node, if that
/// has an input for it that is not wired yet, such as `lines` of `Carve` for a `Path`.
pub(super) fn add(session: &mut Session, new: New) {
    let shown = session.shown().filter(|shown| {
        let graph = session.document().graph();
        graph.port(shown).is_ok_and(|port| graph.output_type(port) == PortType::Height)
    });
    let kind = new.kind;
    let is_filter = kind.inputs.first().is_some_and(|input| input.ty == PortType::Height) && !kind.outputs.is_empty();
    match shown.filter(|_| is_filter) {
        Some(shown) => {
            after(session, new, &shown);
        }
        None => {
            let name = new.fresh_name(session);
            let places = session.document().nodes().iter().filter_map(|node| node.layout);
            let lowest = places.reduce(|[x, y], [u, v]| [x.min(u), y.max(v)]);
            let at = Some(lowest.map_or([0.0, 0.0], |[x, y]| [x, y + STEP[1]]));
            let wire = free_input(session, kind).map(|(to, input)| Edit::Connect { from: name.clone(), to, input });
            if session.apply(&Edit::All(new.edits(&name, at).into_iter().chain(wire).collect())) {
                session.select_only(&name);
            }
        }
    }
}

/// The first input of the selected node that has the type of a kind's first output and no wire, with the node's name.
fn free_input(session: &Session, kind: &Node) -> Option<(String, String)> {
    let OutputType::Fixed(made) = kind.outputs.first()?.ty else { return None };
    let graph = session.document().graph();
    let index = graph.find(session.selected()?).ok()?;
    let instance = graph.instance(index);
    let free = |(position, input): &(usize, &Input)| input.ty == made && graph.source(index, *position).is_none();
    let (_, input) = instance.node.inputs.iter().enumerate().find(free)?;
    Some((instance.name.clone(), input.name.to_owned()))
}

/// Inserts a node after an output: it reads the output, and the readers of the output read it. Selects it.
pub(super) fn after(session: &mut Session, new: New, shown: &str) {
    let document = session.document();
    let Some(input) = new.kind.inputs.iter().find(|input| input.ty == PortType::Height) else { return };
    let graph = document.graph();
    let Ok(port) = graph.port(shown) else { return };
    let name = new.fresh_name(session);
    let place = document.nodes().iter().find(|node| node.index == Some(port.node)).and_then(|node| node.layout);
    let at = place.map(|[x, y]| [x + STEP[0], y]);
    let mut edits = new.edits(&name, at);
    for index in graph.indices() {
        let instance = graph.instance(index);
        for (position, taken) in instance.node.inputs.iter().enumerate() {
            if graph.source(index, position) == Some(port) {
                let (to, input) = (instance.name.clone(), taken.name.to_owned());
                edits.push(Edit::Connect { from: name.clone(), to, input });
            }
        }
    }
    for output in document.outputs().iter().filter(|output| output.port == port) {
        edits.push(Edit::SetOutput { name: output.name.clone(), from: name.clone() });
    }
    let from = graph.port_name(Port { ..port });
    edits.push(Edit::Connect { from, to: name.clone(), input: input.name.to_owned() });
    if session.apply(&Edit::All(edits)) {
        session.pin(None);
        session.select_only(&name);
    }
}
