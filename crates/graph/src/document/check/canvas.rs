//! Data of the canvas only: positions of nodes, notes, and routes of wires. It does not affect the build.

use std::collections::{BTreeMap, HashMap};

use petgraph::stable_graph::NodeIndex;

use super::{NodeEntry, problems::Problems};
use crate::document::syntax::{
    Group, Item,
    literal::{Literal, pair},
};
use crate::{diagnostic::Diagnostic, graph::Graph, unit::Unit};

/// The route of a wire that is not straight.
#[derive(Clone, Debug, PartialEq)]
pub struct Reroute {
    /// The node that the wire leads into.
    pub node: String,
    /// Its input.
    pub input: String,
    /// The points that the wire passes, in order from its source.
    pub places: Vec<[f64; 2]>,
}

/// The span of an entry's name.
fn place_of(item: &Item) -> std::ops::Range<usize> {
    item.key.as_ref().map_or_else(|| item.span(), |key| key.span.clone())
}

/// The entries of nodes that exist; reports the others.
fn of_nodes<'i>(
    group: &'i Group,
    field: &str,
    does: &str,
    nodes: &[NodeEntry],
    by_name: &HashMap<String, usize>,
    problems: &mut Problems,
) -> Vec<(usize, &'i str, &'i Item)> {
    let mut found = Vec::new();
    for (name, item) in problems.duplicates(group, format_args!("in `{field}`")) {
        match by_name.get(name).copied() {
            Some(position) => found.push((position, name, item)),
            None => {
                let message = format!("`{field}` {does} `{name}`, but there is no such node");
                let problem = Diagnostic::warning("unknown-layout", place_of(item), message);
                let near = problems.meant(name, nodes.iter().map(|entry| entry.name.as_str()));
                problems.push(problem.suggest(near));
            }
        }
    }
    found
}

/// Reads `layout`: positions of nodes.
pub(crate) fn layout(
    group: &Group,
    source: &str,
    nodes: &mut [NodeEntry],
    by_name: &HashMap<String, usize>,
    problems: &mut Problems,
) {
    for (position, name, item) in of_nodes(group, "layout", "places", nodes, by_name, problems) {
        match pair(name, Unit::One, &Literal::read(&item.value, source)) {
            Some(Ok(place)) => nodes[position].layout = Some(place),
            _ => problems.misplaced(&item.value, name, "a place such as `(240, 80)`", source),
        }
    }
}

/// Reads `notes`: notes on nodes.
pub(crate) fn notes(
    group: &Group,
    source: &str,
    nodes: &mut [NodeEntry],
    by_name: &HashMap<String, usize>,
    problems: &mut Problems,
) {
    for (position, name, item) in of_nodes(group, "notes", "has a note for", nodes, by_name, problems) {
        match Literal::read(&item.value, source) {
            Literal::Text(note) => nodes[position].note = note,
            _ => problems.misplaced(&item.value, name, "a text in quotes", source),
        }
    }
}

/// Reads `reroutes`: the routes of wires, by the inputs that they lead into.
pub(crate) fn reroutes(
    group: &Group,
    source: &str,
    graph: &Graph,
    entries: &BTreeMap<String, Option<NodeIndex>>,
    problems: &mut Problems,
) -> Vec<Reroute> {
    let mut found = Vec::new();
    for (name, item) in problems.duplicates(group, "in `reroutes`") {
        let (node, input) = name.split_once('.').unwrap_or((name, ""));
        let missing = match entries.get(node) {
            None => Some(format!("there is no node `{node}`")),
            Some(Some(index)) if graph.instance(*index).node.input(input).is_none() => {
                Some(format!("`{node}` has no input `{input}`"))
            }
            Some(_) => None,
        };
        if let Some(missing) = missing {
            let message = format!("`reroutes` routes the wire into `{name}`, but {missing}");
            problems.push(Diagnostic::warning("unknown-layout", place_of(item), message).hint("remove it"));
            continue;
        }
        let places = match Literal::read(&item.value, source) {
            Literal::List(places) => {
                let places = places.iter().map(|place| pair(name, Unit::One, place)?.ok());
                places.collect::<Option<Vec<_>>>().filter(|places| !places.is_empty())
            }
            _ => None,
        };
        match places {
            Some(places) => found.push(Reroute { node: node.to_owned(), input: input.to_owned(), places }),
            None => problems.misplaced(&item.value, name, "a list of places such as `[(120, 40)]`", source),
        }
    }
    found
}
