//! The differences between two documents, as text.

use std::collections::{BTreeMap, BTreeSet};

use crate::document::{
    Document, Place,
    check::{NodeEntry, exposed::Section},
    syntax::{format::format_source, literal::value_text},
};
use crate::{
    graph::Instance,
    node::{Fallback, Input},
    param::{ParamSpec, ParamValue},
    unit::Unit,
    world::{Boundary, GeoPlace, World},
};

/// The changes from one document to another, one line per change, such as `rivers.duration 1 Myr → 2 Myr`.
///
/// Comments, order, layout and the notation of values do not matter. Empty for documents with the same meaning.
#[must_use]
pub fn diff(a: &Document, b: &Document) -> Vec<String> {
    let mut lines = Vec::new();
    worlds(&a.world(), &b.world(), &mut lines);
    let (old, new) = (entries(a), entries(b));
    let renamed = renamed(a, b, &old, &new);
    for (from, to) in &renamed {
        lines.push(format!("node {from} renamed to {to}"));
    }
    let now = |name: &str| renamed.get(name).cloned().unwrap_or_else(|| name.to_owned());
    let was: BTreeSet<&str> = renamed.values().map(String::as_str).collect();
    for (name, entry) in &old {
        match new.get(now(name).as_str()) {
            Some(other) => nodes(a, b, entry, other, &now, &mut lines),
            None => lines.push(format!("node {name} ({}) removed", entry.kind)),
        }
    }
    for (name, entry) in new.iter().filter(|(name, _)| !old.contains_key(*name) && !was.contains(*name)) {
        lines.push(format!("node {name} ({}) added{}", kind(b, entry), contents(b, entry)));
    }
    muted(a, b, &now, &mut lines);
    outputs(a, b, &now, &mut lines);
    expectations(a, b, &mut lines);
    named(a, b, &now, &mut lines);
    lines
}

fn entries(document: &Document) -> BTreeMap<&str, &NodeEntry> {
    document.nodes().iter().map(|entry| (entry.name.as_str(), entry)).collect()
}

fn instance<'d>(document: &'d Document, entry: &NodeEntry) -> Option<&'d Instance> {
    entry.index.map(|index| document.graph().instance(index))
}

/// The kind of a node by its current name.
fn kind(document: &Document, entry: &NodeEntry) -> String {
    instance(document, entry).map_or_else(|| entry.kind.clone(), |instance| instance.node.id.to_owned())
}

/// Nodes that disappear under one name and appear, with equal contents, under another.
fn renamed(
    a: &Document,
    b: &Document,
    old: &BTreeMap<&str, &NodeEntry>,
    new: &BTreeMap<&str, &NodeEntry>,
) -> BTreeMap<String, String> {
    let mut found: BTreeMap<String, String> = BTreeMap::new();
    // In file order, sources mostly come before the nodes that they feed, so that a renamed source is already known.
    loop {
        let before = found.len();
        for entry in a.nodes().iter().filter(|entry| !new.contains_key(entry.name.as_str())) {
            if found.contains_key(&entry.name) {
                continue;
            }
            let now = |name: &str| found.get(name).cloned().unwrap_or_else(|| name.to_owned());
            let twin = b.nodes().iter().find(|other| {
                !old.contains_key(other.name.as_str()) && !found.values().any(|name| *name == other.name) && {
                    let mut lines = Vec::new();
                    nodes(a, b, entry, other, &now, &mut lines);
                    lines.is_empty()
                }
            });
            if let Some(twin) = twin {
                found.insert(entry.name.clone(), twin.name.clone());
            }
        }
        if found.len() == before {
            return found;
        }
    }
}

/// Compares two nodes; `now` returns the new name of a node of the old file.
fn nodes(
    a: &Document,
    b: &Document,
    old: &NodeEntry,
    new: &NodeEntry,
    now: &dyn Fn(&str) -> String,
    lines: &mut Vec<String>,
) {
    let name = &new.name;
    let (old_kind, new_kind) = (kind(a, old), kind(b, new));
    if old_kind != new_kind {
        lines.push(format!("node {name} {old_kind} → {new_kind}"));
        return;
    }
    let (Some(before), Some(after)) = (instance(a, old), instance(b, new)) else {
        if text(a, old) != text(b, new) {
            lines.push(format!("node {name} ({new_kind}, unknown here) changed"));
        }
        return;
    };
    for spec in after.node.specs() {
        let (x, y) = (before.params.get(spec.name), after.params.get(spec.name));
        if x != y
            && let (Some(x), Some(y)) = (x, y)
        {
            lines.push(format!("{name}.{} {} → {}", spec.name, show(&spec, x, y), show(&spec, y, x)));
        }
    }
    for input in after.node.inputs {
        let (x, y) = (given(a, old, input.name), given(b, new, input.name));
        let followed = match &x {
            Given::Wire(node, port) => Given::Wire(now(node), port.clone()),
            other => other.clone(),
        };
        if !followed.means(&y, input) {
            lines.push(format!("{name}.{} {} → {}", input.name, x.show(input, &y), y.show(input, &x)));
        }
    }
    // The contents of a file matter, not only its name; its world does not.
    let inner = |document: &Document, entry: &NodeEntry| entry.index.and_then(|at| document.subgraph(at).cloned());
    if let (Some(x), Some(y)) = (inner(a, old), inner(b, new))
        && x.source() != y.source()
    {
        let inside = diff(&x, &y).into_iter().filter(|line| !line.starts_with("world."));
        lines.extend(inside.map(|line| format!("{name}/ {line}")));
    }
}

/// The value of an input.
#[derive(Clone, PartialEq)]
enum Given {
    Nothing,
    Number(f64),
    Wire(String, String),
}

impl Given {
    /// Returns true if both mean the same to an input.
    fn means(&self, other: &Self, input: &Input) -> bool {
        let number = |given: &Self| match (given, input.fallback) {
            (Self::Number(value), _) => Some(*value),
            (Self::Nothing, Fallback::Constant { default, .. }) => Some(default),
            _ => None,
        };
        self == other || number(self).is_some_and(|value| number(other) == Some(value))
    }

    fn show(&self, input: &Input, other: &Self) -> String {
        match (self, &input.fallback) {
            (Self::Wire(node, port), _) => format!("{node}.{port}"),
            (Self::Number(value), _) | (Self::Nothing, Fallback::Constant { default: value, .. }) => {
                let against = match other {
                    Self::Number(value) => Some(*value),
                    _ => None,
                };
                quantity(input.ty.unit(), *value, against)
            }
            (Self::Nothing, _) => "nothing".to_owned(),
        }
    }
}

fn given(document: &Document, entry: &NodeEntry, input: &str) -> Given {
    let Some(index) = entry.index else { return Given::Nothing };
    let graph = document.graph();
    let inputs = graph.instance(index).node.inputs;
    let Some(position) = inputs.iter().position(|declared| declared.name == input) else { return Given::Nothing };
    match (graph.source(index, position), graph.instance(index).constants[position]) {
        (Some(port), _) => {
            let source = graph.instance(port.node);
            Given::Wire(source.name.clone(), source.node.outputs[port.output].name.to_owned())
        }
        (None, Some(value)) => Given::Number(value),
        (None, None) => Given::Nothing,
    }
}

/// The non-default values of a new node.
fn contents(document: &Document, entry: &NodeEntry) -> String {
    let Some(instance) = instance(document, entry) else { return String::new() };
    let mut said = Vec::new();
    for input in instance.node.inputs {
        let given = given(document, entry, input.name);
        if !given.means(&Given::Nothing, input) {
            said.push(format!("{}: {}", input.name, given.show(input, &Given::Nothing)));
        }
    }
    for spec in instance.node.specs() {
        if let Some(value) = instance.params.get(spec.name).filter(|value| **value != spec.kind.default_value()) {
            said.push(format!("{}: {}", spec.name, show(&spec, value, value)));
        }
    }
    if said.is_empty() { String::new() } else { format!(": {}", said.join(", ")) }
}

fn show(spec: &ParamSpec, value: &ParamValue, other: &ParamValue) -> String {
    match (value, other) {
        (ParamValue::Float(value), ParamValue::Float(other)) => quantity(spec.unit, *value, Some(*other)),
        (ParamValue::Float(value), _) => quantity(spec.unit, *value, None),
        _ => value_text(value),
    }
}

/// A number with its unit at a readable scale, or with all its digits if it would look the same as the other one.
fn quantity(unit: Unit, value: f64, other: Option<f64>) -> String {
    let shown = unit.display(value);
    match other {
        Some(other) if other != value && unit.display(other) == shown => {
            format!("{value} {unit}").trim_end().to_owned()
        }
        _ => shown,
    }
}

/// A node as text in canonical form, for comparison when its kind is unknown.
fn text(document: &Document, entry: &NodeEntry) -> String {
    let text = &document.source()[entry.kind_span.start..entry.span.end];
    let text = format_source(text).unwrap_or_else(|_| text.to_owned());
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect()
}

fn muted(a: &Document, b: &Document, now: &dyn Fn(&str) -> String, lines: &mut Vec<String>) {
    let list = |document: &Document, now: &dyn Fn(&str) -> String| -> BTreeSet<String> {
        document.nodes().iter().filter(|node| node.muted).map(|node| now(&node.name)).collect()
    };
    let (old, new) = (list(a, now), list(b, &str::to_owned));
    // A node that is gone needs no second line.
    let stays = |name: &&String| b.nodes().iter().any(|node| node.name == **name);
    lines.extend(old.difference(&new).filter(stays).map(|name| format!("node {name} no longer muted")));
    lines.extend(new.difference(&old).map(|name| format!("node {name} muted")));
}

fn outputs(a: &Document, b: &Document, now: &dyn Fn(&str) -> String, lines: &mut Vec<String>) {
    let list = |document: &Document, follow: bool| -> BTreeMap<String, String> {
        let graph = document.graph();
        let end = |port: crate::Port| {
            let instance = graph.instance(port.node);
            let name = if follow { now(&instance.name) } else { instance.name.clone() };
            format!("{name}.{}", instance.node.outputs[port.output].name)
        };
        document.outputs().iter().map(|output| (output.name.clone(), end(output.port))).collect()
    };
    let (old, new) = (list(a, true), list(b, false));
    for (name, end) in &old {
        match new.get(name) {
            Some(other) if other == end => {}
            Some(other) => lines.push(format!("output {name} {end} → {other}")),
            None => lines.push(format!("output {name} ({end}) removed")),
        }
    }
    for (name, end) in new.iter().filter(|(name, _)| !old.contains_key(*name)) {
        lines.push(format!("output {name} ({end}) added"));
    }
}

/// What the files expect, in the order of the names.
fn expectations(a: &Document, b: &Document, lines: &mut Vec<String>) {
    let metres = |value: f64| Unit::Metres.display(value);
    let list = |document: &Document| -> BTreeMap<&str, (String, String)> {
        let Some(all) = document.expectations() else { return BTreeMap::new() };
        let exact = |value: &dyn std::fmt::Debug| format!("{value:?}");
        let measures = all.list.iter().map(|one| (one.measure.name, (one.bounds_text(), exact(&one.bounds))));
        let part = all.part_m.map(|part| ("in", (format!("({})", part.map(metres).join(", ")), exact(&part))));
        let cell = all.cell_m.map(|cell| ("cell", (metres(cell), exact(&cell))));
        measures.chain(part).chain(cell).collect()
    };
    let (old, new) = (list(a), list(b));
    for (name, (shown, value)) in &old {
        match new.get(name) {
            Some((_, other)) if other == value => {}
            // bounds that look the same are written with all their digits
            Some((same, other)) if same == shown => lines.push(format!("expect.{name} {value} → {other}")),
            Some((other, _)) => lines.push(format!("expect.{name} {shown} → {other}")),
            None => lines.push(format!("expect.{name} ({shown}) removed")),
        }
    }
    for (name, (shown, _)) in new.iter().filter(|(name, _)| !old.contains_key(*name)) {
        lines.push(format!("expect.{name} ({shown}) added"));
    }
}

/// The exposed inputs and parameters.
fn named(a: &Document, b: &Document, now: &dyn Fn(&str) -> String, lines: &mut Vec<String>) {
    let same = |name: &str| name.to_owned();
    for section in Section::ALL {
        let noun = section.field().trim_end_matches('s');
        let (old, new) = (places(a, section, now), places(b, section, &same));
        for (name, list) in &old {
            match new.get(name) {
                Some(other) if other == list => {}
                Some(other) => lines.push(format!("{noun} {name} {list} → {other}")),
                None => lines.push(format!("{noun} {name} ({list}) removed")),
            }
        }
        for (name, list) in new.iter().filter(|(name, _)| !old.contains_key(*name)) {
            lines.push(format!("{noun} {name} ({list}) added"));
        }
    }
}

/// The names of a section with their places, and their ranges if the file narrows them.
fn places(document: &Document, section: Section, now: &dyn Fn(&str) -> String) -> BTreeMap<String, String> {
    let graph = document.graph();
    let list = |places: &[Place]| {
        let place = |place: &Place| format!("{}.{}", now(&graph.instance(place.node).name), place.name);
        places.iter().map(place).collect::<Vec<_>>().join(", ")
    };
    match section {
        Section::Inputs => document.inputs().iter().map(|named| (named.name.clone(), list(&named.places))).collect(),
        Section::Parameters => document
            .parameters()
            .iter()
            .map(|named| {
                let allowed = named.kind.describe(named.unit);
                (named.name.clone(), format!("{}, {allowed}", list(&named.places)))
            })
            .collect(),
    }
}

fn worlds(a: &World, b: &World, lines: &mut Vec<String>) {
    if a.size != b.size {
        let side = |v: f64| Unit::Metres.display(v);
        let show = |w: &World| format!("{} x {}", side(w.size[0]), side(w.size[1]));
        let (mut x, mut y) = (show(a), show(b));
        if x == y {
            (x, y) = (format!("{} x {} m", a.size[0], a.size[1]), format!("{} x {} m", b.size[0], b.size[1]));
        }
        lines.push(format!("world.size {x} → {y}"));
    }
    if a.cells != b.cells {
        lines.push(format!("world.cells {} x {} → {} x {}", a.cells[0], a.cells[1], b.cells[0], b.cells[1]));
    }
    if a.seed != b.seed {
        lines.push(format!("world.seed {} → {}", a.seed, b.seed));
    }
    if a.sea_level != b.sea_level {
        let [x, y] = [a, b].map(|w| w.sea_level.map_or_else(|| "none".to_owned(), |level| Unit::Metres.display(level)));
        lines.push(format!("world.sea_level {x} → {y}"));
    }
    if a.place != b.place {
        let show = |w: &World| {
            w.place.map_or_else(
                || "none".to_owned(),
                |GeoPlace { epsg, corner_m: [x, y] }| format!("EPSG:{epsg} at {x} m, {y} m"),
            )
        };
        lines.push(format!("world.place {} → {}", show(a), show(b)));
    }
    let sides = |w: &Boundary| [("west", w.west), ("east", w.east), ("north", w.north), ("south", w.south)];
    for ((side, x), (_, y)) in sides(&a.boundary).into_iter().zip(sides(&b.boundary)) {
        if x != y {
            lines.push(format!("world.boundary.{side} {} → {}", x.name(), y.name()));
        }
    }
}
