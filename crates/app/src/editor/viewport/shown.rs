//! The values that the viewport shows: those of outputs, of snapshots, and of level ground.

use std::sync::Arc;

use orograph_graph::{Field, Lines, PortType, Value, Window};

use super::surface;
use crate::editor::{Session, session::worker::coarser};

/// The current value of an output.
#[derive(Clone)]
pub(super) struct Shown {
    /// The output with the samples, as `node.port`.
    pub(super) port: String,
    pub(super) ty: PortType,
    pub(super) field: Field,
    /// The shown output, as `node.port`, if it is lines, which lie on the samples.
    pub(super) lines: Option<(String, Arc<Lines>)>,
    /// The state of the document that it was built from.
    pub(super) revision: u64,
    /// Increases with each intermediate result; 0 for the final result.
    pub(super) step: u64,
    /// True if it is up to date and final, with all requested cells.
    pub(super) fresh: bool,
}

impl Shown {
    /// The shown output, as `node.port`.
    pub(super) fn name(&self) -> &str {
        self.lines.as_ref().map_or(&self.port, |(name, _)| name)
    }
}

/// All outputs of the graph that can be previewed, those of the selected nodes first.
pub(super) fn ports(session: &Session) -> Vec<(String, PortType)> {
    let graph = session.document().graph();
    let mut ports = Vec::new();
    for index in graph.topological() {
        let instance = graph.instance(index);
        for output in 0..instance.node.outputs.len() {
            let port = orograph_graph::Port { node: index, output };
            let ty = graph.output_type(port);
            if ty.planes().is_some() || ty == PortType::Lines {
                ports.push((!session.is_selected(&instance.name), (graph.port_name(port), ty)));
            }
        }
    }
    ports.sort_by_key(|(behind, _)| *behind);
    ports.into_iter().map(|(_, name)| name).collect()
}

/// The output to compare another with: the input of its node, of the same type if there is one, or the terrain under it;
/// otherwise another output, of the same type and of a node that reads it, if there is one.
pub(super) fn counterpart(session: &Session, own: &str) -> Option<String> {
    let graph = session.document().graph();
    let ports = ports(session);
    let input = graph.port(own).ok().and_then(|port| {
        let inputs = 0..graph.instance(port.node).node.inputs.len();
        let sources: Vec<_> = inputs.filter_map(|input| graph.source(port.node, input)).collect();
        let same = sources.iter().find(|source| graph.output_type(**source) == graph.output_type(port));
        same.copied().or_else(|| sources.iter().find_map(|source| session.ground_of(*source)))
    });
    let input = input.map(|port| graph.port_name(port)).filter(|name| ports.iter().any(|(port, _)| port == name));
    let ty = ports.iter().find(|(port, _)| port == own).map(|(_, ty)| *ty);
    let reads = |port: &str| {
        let (Ok(own), Ok(other)) = (graph.port(own), graph.port(port)) else { return false };
        let inputs = 0..graph.instance(other.node).node.inputs.len();
        inputs.into_iter().any(|input| graph.source(other.node, input) == Some(own))
    };
    let others = ports.into_iter().filter(|(port, _)| port != own);
    input.or_else(|| others.min_by_key(|(port, other)| (Some(*other) != ty, !reads(port))).map(|(port, _)| port))
}

/// The current value of an output. Returns None when it is not built or is not a field.
pub(super) fn shown(session: &Session, port: &str) -> Option<Shown> {
    if let Some(kept) = kept(session, port) {
        return Some(kept);
    }
    let built = session.built(port)?;
    let graph = session.document().graph();
    let index = graph.port(port).ok()?;
    let field = match &built.value {
        Value::Field(field) => field.clone(),
        Value::Lines(lines) => {
            let ground = session.ground_of(index).map(|ground| graph.port_name(ground));
            let ground = shown(session, ground.as_deref().unwrap_or(surface::LEVEL))?;
            let fresh = ground.fresh && built.revision == session.revision();
            return Some(Shown { lines: Some((port.to_owned(), Arc::clone(lines))), fresh, ..ground });
        }
        _ => return None,
    };
    let ty = graph.output_type(index);
    let live = session
        .simulation()
        .is_some_and(|simulation| port.split_once('.').is_some_and(|(node, _)| node == simulation.node()));
    let fresh = live || built.revision == session.revision() && built.step == 0 && !session.is_busy();
    let (revision, step) = (built.revision, built.step);
    Some(Shown { port: port.to_owned(), ty, field, lines: None, revision, step, fresh })
}

/// What the measuring tool reads: the heights under colours and vectors, if they are built.
pub(super) fn measured(session: &Session, shown: &Shown) -> Shown {
    let ground = (shown.ty.planes() != Some(1)).then(|| {
        let graph = session.document().graph();
        let ground = session.ground_of(graph.port(&shown.port).ok()?)?;
        self::shown(session, &graph.port_name(ground))
    });
    ground.flatten().unwrap_or_else(|| shown.clone())
}

/// The samples of a snapshot, those of the heights that they lie on, or level ground.
fn kept(session: &Session, name: &str) -> Option<Shown> {
    if name == surface::LEVEL {
        let field = Field::constant(Window::whole(coarser(session.document().world(), session.cells())), 0.0);
        let (port, ty) = (name.to_owned(), PortType::Height);
        return Some(Shown { port, ty, field, lines: None, revision: 0, step: 0, fresh: true });
    }
    let ground = name.strip_suffix(surface::GROUND);
    let snapshot = session.snapshot(ground.unwrap_or(name))?;
    let (ty, field) = match ground {
        Some(_) => (PortType::Height, snapshot.ground.clone()?),
        None => (snapshot.ty(), snapshot.field.clone()),
    };
    Some(Shown { port: name.to_owned(), ty, field, lines: None, revision: 0, step: 0, fresh: true })
}

/// The finer part of an output. Returns None when it is of another state of the document.
pub(super) fn finer(session: &Session, shown: &Shown) -> Option<Shown> {
    let built = session.finer(&shown.port)?;
    let Value::Field(field) = &built.value else { return None };
    let same = built.revision == shown.revision && shown.step == 0;
    same.then(|| Shown { port: shown.port.clone(), field: field.clone(), lines: shown.lines.clone(), ..*shown })
}
