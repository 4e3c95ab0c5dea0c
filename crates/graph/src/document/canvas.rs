//! What stands on the canvas alone: places of nodes, notes on them, and ways of wires. It changes nothing of what is built.

use std::collections::{BTreeMap, HashMap};

use petgraph::stable_graph::NodeIndex;

use super::{
    check::NodeEntry,
    literal::{Literal, pair},
    problems::Problems,
    syntax::{Group, Item},
};
use crate::{closest, diagnostic::Diagnostic, graph::Graph, unit::Unit};

/// The way of a wire that is not straight.
#[derive(Clone, Debug, PartialEq)]
pub struct Reroute {
    /// The node that takes the wire.
    pub node: String,
    /// Its input.
    pub input: String,
    /// The places that the wire passes, in the order from its source.
    pub places: Vec<[f64; 2]>,
}

/// Where the name of an entry stands.
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
    for (name, item) in problems.duplicates(group, &format!("in `{field}`")) {
        match by_name.get(name).copied() {
            Some(position) => found.push((position, name, item)),
            None => {
                let message = format!("`{field}` {does} `{name}`, but there is no such node");
                let problem = Diagnostic::warning("unknown-layout", place_of(item), message);
                problems.push(problem.suggest(closest(name, nodes.iter().map(|entry| entry.name.as_str()))));
            }
        }
    }
    found
}

/// Reads `layout`: places of nodes.
pub(super) fn layout(
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

/// Reads `notes`: what is told of nodes.
pub(super) fn notes(
    group: &Group,
    source: &str,
    nodes: &mut [NodeEntry],
    by_name: &HashMap<String, usize>,
    problems: &mut Problems,
) {
    for (position, name, item) in of_nodes(group, "notes", "tells of", nodes, by_name, problems) {
        match Literal::read(&item.value, source) {
            Literal::Text(note) => nodes[position].note = note,
            _ => problems.misplaced(&item.value, name, "a text in quotes", source),
        }
    }
}

/// Reads `reroutes`: the ways of wires, by the inputs that they end at.
pub(super) fn reroutes(
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
            let message = format!("`reroutes` leads the wire into `{name}`, but {missing}");
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
