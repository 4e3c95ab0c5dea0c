//! Exposed parameters and inputs: `parameters` names values of a file's nodes, `inputs` names inputs of its nodes. An
//! entry only lists places; type, unit, range, default and documentation come from them.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::Range,
};

use petgraph::stable_graph::NodeIndex;

use super::{
    problems::{Problems, list},
    sea,
};
use crate::document::{
    subgraph,
    syntax::{
        Expr, Group,
        lex::Bracket,
        literal::{Literal, Misfit, pair},
    },
};
use crate::{
    closest,
    diagnostic::Diagnostic,
    graph::{Graph, Instance, Port},
    node::{Fallback, Input},
    param::{Kind, ParamSpec, ParamValue},
    unit::Unit,
    value::PortType,
};

/// A parameter or an input of a node that an exposed name refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// The node.
    pub node: NodeIndex,
    /// The parameter or input.
    pub name: &'static str,
}

/// An entry of a file's `parameters`: a name for one value, or for the same value in several places.
#[derive(Clone, Debug)]
pub struct NamedParameter {
    /// Its name.
    pub name: String,
    /// Documentation: from the file, or else from its first place.
    pub doc: String,
    /// Unit of its numbers.
    pub unit: Unit,
    /// Kind and range; the default is the value at its places in the file.
    pub kind: Kind,
    /// The places that it drives; at least one.
    pub places: Vec<Place>,
    /// Bytes of the entry.
    pub span: Range<usize>,
}

/// An entry of a file's `inputs`: a name for an input of one or several of its nodes.
#[derive(Clone, Debug)]
pub struct NamedInput {
    /// Its name.
    pub name: String,
    /// Documentation: from the file, or else from its first place.
    pub doc: String,
    /// The type that may be wired to it.
    pub ty: PortType,
    /// The fallback without a wire; [`Fallback::None`] if the file wires one of its places or their constants differ.
    pub fallback: Fallback,
    /// The inputs that it feeds; at least one.
    pub places: Vec<Place>,
    /// Bytes of the entry.
    pub span: Range<usize>,
}

/// A place as written, and its span.
pub(crate) type Written = (String, Range<usize>);

/// The contents of an entry.
struct Entry<'a> {
    places: Vec<Written>,
    doc: Option<String>,
    range: Option<&'a Expr>,
}

/// The section that an entry belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Section {
    Inputs,
    Parameters,
}

impl Section {
    pub(crate) const ALL: [Self; 2] = [Self::Inputs, Self::Parameters];

    /// The name of the section in a file.
    pub(crate) const fn field(self) -> &'static str {
        match self {
            Self::Inputs => "inputs",
            Self::Parameters => "parameters",
        }
    }

    /// The field of an entry that lists the places.
    const fn verb(self) -> &'static str {
        match self {
            Self::Inputs => "feeds",
            Self::Parameters => "drives",
        }
    }

    const fn fields(self) -> &'static [&'static str] {
        match self {
            Self::Inputs => &["feeds", "doc"],
            Self::Parameters => &["drives", "doc", "range"],
        }
    }

    const fn noun(self) -> &'static str {
        match self {
            Self::Inputs => "an input",
            Self::Parameters => "a parameter",
        }
    }
}

/// The expression of an entry that lists its places.
pub(crate) fn places_of(value: &Expr, section: Section) -> Option<&Expr> {
    match value.as_group() {
        Some(group) if group.items.iter().any(|item| item.key.is_some()) => {
            group.get(section.verb()).map(|item| &item.value)
        }
        _ => Some(value),
    }
}

/// The places of an entry, as written; anything that is not a place is left out.
pub(crate) fn places(value: &Expr, section: Section, source: &str) -> Vec<Written> {
    let text = |expr: &Expr| match Literal::read(expr, source) {
        Literal::Text(text) => Some((text, expr.span.clone())),
        _ => None,
    };
    let Some(value) = places_of(value, section) else { return Vec::new() };
    match value.as_group().filter(|group| is_list(group)) {
        Some(group) => group.items.iter().filter_map(|item| text(&item.value)).collect(),
        None => text(value).into_iter().collect(),
    }
}

/// Returns true if the brackets hold a list of items without names.
pub(crate) fn is_list(group: &Group) -> bool {
    group.name.is_none() && group.bracket != Bracket::Curly && group.items.iter().all(|item| item.key.is_none())
}

/// Reads the two sections of a file whose nodes and wires are already known.
pub(crate) struct Reader<'a> {
    pub(crate) source: &'a str,
    pub(crate) graph: &'a Graph,
    pub(crate) entries: &'a BTreeMap<String, Option<NodeIndex>>,
    /// The types of outputs, as far as they are known.
    pub(crate) types: &'a BTreeMap<Port, PortType>,
    /// Nodes with an invalid parameter, whose value is therefore unknown.
    pub(crate) bad: &'a BTreeSet<NodeIndex>,
    pub(crate) problems: &'a mut Problems,
    /// The names in use, and the places that have one.
    pub(crate) names: BTreeSet<String>,
    pub(crate) taken: BTreeMap<(NodeIndex, &'static str), String>,
}

impl Reader<'_> {
    pub(crate) fn inputs(&mut self, group: &Group) -> Vec<NamedInput> {
        let mut found = Vec::new();
        for (name, item) in self.problems.duplicates(group, "in `inputs`") {
            let Some(entry) = self.entry(name, &item.value, Section::Inputs) else { continue };
            self.check_name(name, item.key.as_ref().map_or(item.span(), |key| key.span.clone()), Section::Inputs);
            let places: Vec<(Place, &'static Input, Range<usize>)> = entry
                .places
                .iter()
                .filter_map(|(text, span)| {
                    let (place, input) = self.input_place(name, text, span)?;
                    Some((place, input, span.clone()))
                })
                .collect();
            if places.len() == entry.places.len()
                && let Some(ty) = self.input_type(name, &places)
            {
                let fallback = self.fallback(&places);
                let doc = entry.doc.unwrap_or_else(|| places[0].1.doc.to_owned());
                let places = places.into_iter().map(|(place, ..)| place).collect();
                found.push(NamedInput { name: name.to_owned(), doc, ty, fallback, places, span: item.span() });
            }
        }
        found
    }

    pub(crate) fn parameters(&mut self, group: &Group) -> Vec<NamedParameter> {
        let mut found = Vec::new();
        for (name, item) in self.problems.duplicates(group, "in `parameters`") {
            let Some(entry) = self.entry(name, &item.value, Section::Parameters) else { continue };
            self.check_name(name, item.key.as_ref().map_or(item.span(), |key| key.span.clone()), Section::Parameters);
            let driven: Vec<(Place, ParamSpec, ParamValue)> =
                entry.places.iter().filter_map(|(text, span)| self.parameter_place(name, text, span)).collect();
            if driven.len() != entry.places.len() {
                continue;
            }
            let Some(mut kind) = self.common(name, &driven, &entry.places) else { continue };
            let unit = driven[0].1.unit;
            if let Some(range) = entry.range {
                let literal = Literal::read(range, self.source);
                let narrowed = narrowed(name, &kind, unit, &literal);
                self.problems.take(narrowed, &literal, &range.span, |narrowed| kind = narrowed);
            }
            let doc = entry.doc.unwrap_or_else(|| driven[0].1.doc.to_owned());
            let places = driven.into_iter().map(|(place, ..)| place).collect();
            found.push(NamedParameter { name: name.to_owned(), doc, unit, kind, places, span: item.span() });
        }
        found
    }

    /// Reports a name that a use of the file could not write: there, names have no quotes and stand next to the
    /// reserved ones.
    fn check_name(&mut self, name: &str, span: Range<usize>, section: Section) {
        let plain = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        let problem = if !plain {
            if self.problems.has_syntax_in(&span) {
                return;
            }
            let message = format!("`{}` cannot name {}", name.escape_debug(), section.noun());
            Diagnostic::error("name", span, message).hint("a name is a letter, then letters, digits and `_`")
        } else if subgraph::RESERVED.contains(&name) {
            let message = format!("`{name}` cannot name {}: every `Subgraph` has a `{name}`", section.noun());
            Diagnostic::error("name", span, message).hint(format!("choose a more specific name, such as `rock_{name}`"))
        } else if !self.names.insert(name.to_owned()) {
            let message = format!("`{name}` names both an input and a parameter of the file");
            Diagnostic::error("duplicate", span, message).hint("rename one of them")
        } else {
            return;
        };
        self.problems.push(problem);
    }

    /// Reads `"node.name"`, `["node.name", ...]` or `(drives: ..., doc: "...")`.
    fn entry<'e>(&mut self, name: &str, value: &'e Expr, section: Section) -> Option<Entry<'e>> {
        let verb = section.verb();
        let takes = format!("a place such as \"node.name\", a list of places, or `({verb}: …, doc: \"…\")`");
        let mut entry = Entry { places: Vec::new(), doc: None, range: None };
        let fields = value.as_group().filter(|group| {
            group.name.is_none() && group.bracket == Bracket::Round && group.items.iter().any(|item| item.key.is_some())
        });
        if let Some(group) = fields {
            self.problems.names(group, &format!("`{name}`"), section.fields());
            if let Some(item) = group.get("doc") {
                match Literal::read(&item.value, self.source) {
                    Literal::Text(text) => entry.doc = Some(text),
                    _ => self.problems.misplaced(&item.value, "doc", "a text in quotes", self.source),
                }
            }
            entry.range = group.get("range").map(|item| &item.value);
            if group.get(verb).is_none() {
                let message = format!("`{name}` does not say what it {verb}");
                let problem = Diagnostic::error("no-place", group.open..group.open + 1, message);
                self.problems.push(problem.hint(format!("write `{verb}: \"node.name\"`")));
                return None;
            }
        }
        let said = places_of(value, section)?;
        entry.places = places(value, section, self.source);
        let listed = said.as_group().filter(|group| is_list(group));
        if entry.places.is_empty() || listed.is_some_and(|group| group.items.len() != entry.places.len()) {
            self.problems.misplaced(said, name, &takes, self.source);
            return None;
        }
        Some(entry)
    }

    /// The node of a place and the part after it. Reports a node or part that does not exist, except on placeholders.
    fn node<'t>(&mut self, name: &str, text: &'t str, span: &Range<usize>, verb: &str) -> Option<(NodeIndex, &'t str)> {
        let Some((node, part)) = text.split_once('.') else {
            let problem = Diagnostic::error(
                "place",
                span.clone(),
                format!("`{name}` {verb} `{text}`, which is not a parameter or an input of a node"),
            );
            self.problems.push(problem.hint("write the node and the name, such as \"node.name\""));
            return None;
        };
        match self.entries.get(node) {
            Some(index) => index.map(|index| (index, part)),
            None => {
                let message = format!("`{name}` {verb} `{text}`, but there is no node `{node}`");
                let problem = Diagnostic::error("unknown-place", span.clone(), message);
                let near = self.problems.meant(node, self.entries.keys().map(String::as_str));
                self.problems.push(problem.suggest(near));
                None
            }
        }
    }

    fn unknown(&mut self, name: &str, text: &str, span: &Range<usize>, instance: &Instance, section: Section) {
        let (owner, kind) = (&instance.name, instance.node.id);
        let part = text.split_once('.').map_or(text, |(_, part)| part);
        let (verb, specs) = (section.verb(), instance.node.specs());
        let inputs = instance.node.inputs.iter().map(|input| input.name);
        let specs = specs.iter().map(|spec| spec.name).filter(|_| section == Section::Parameters);
        let known: Vec<&str> = inputs.chain(specs).collect();
        let what = if section == Section::Inputs { "input" } else { "parameter" };
        let message = format!("`{name}` {verb} `{text}`, but `{owner}` ({kind}) has no {what} `{part}`");
        let problem = Diagnostic::error("unknown-place", span.clone(), message);
        if let Some(hint) = sea::moved_hint(instance.node, part) {
            self.problems.push(problem.hint(hint));
            return;
        }
        self.problems.push(match closest(part, known.iter().copied()) {
            Some(near) => problem.hint(format!("did you mean `{owner}.{near}`?")),
            None => problem.hint(format!("it has {}", list(known))),
        });
    }

    /// Records that a name refers to a place; reports a place that already has a name.
    fn take(&mut self, name: &str, place: Place, text: &str, span: &Range<usize>) -> Option<()> {
        match self.taken.insert((place.node, place.name), name.to_owned()) {
            None => Some(()),
            Some(other) => {
                let message = format!("`{text}` is already exposed as `{other}`");
                let problem = Diagnostic::error("duplicate", span.clone(), message);
                self.problems.push(problem.label("again here").hint("remove one of them"));
                None
            }
        }
    }

    fn input_place(&mut self, name: &str, text: &str, span: &Range<usize>) -> Option<(Place, &'static Input)> {
        let (node, part) = self.node(name, text, span, Section::Inputs.verb())?;
        let graph = self.graph;
        let Some(input) = graph.instance(node).node.input(part) else {
            self.unknown(name, text, span, graph.instance(node), Section::Inputs);
            return None;
        };
        let place = Place { node, name: input.name };
        self.take(name, place, text, span)?;
        Some((place, input))
    }

    /// The type that all places accept. For a place that accepts any scalar, it is the type of the file's own wire.
    fn input_type(&mut self, name: &str, places: &[(Place, &'static Input, Range<usize>)]) -> Option<PortType> {
        let of = |(place, input, _): &(Place, &'static Input, Range<usize>)| match (input.ty, self.source_of(place)) {
            (PortType::AnyScalar, Some(port)) => self.types.get(&port).copied().unwrap_or(PortType::AnyScalar),
            (ty, _) => ty,
        };
        let types: Vec<PortType> = places.iter().map(of).collect();
        let common = types.iter().find(|ty| types.iter().all(|other| other.accepts(**ty))).copied();
        if common.is_none() {
            let message = format!("the places that `{name}` feeds take different types: {} and {}", types[0], {
                types.iter().find(|ty| **ty != types[0]).unwrap_or(&types[0])
            });
            let problem = Diagnostic::error("type", places[0].2.clone(), message);
            self.problems.push(problem.hint("give each its own name"));
        }
        common
    }

    fn source_of(&self, place: &Place) -> Option<Port> {
        let position = self.graph.instance(place.node).node.inputs.iter().position(|input| input.name == place.name)?;
        self.graph.source(place.node, position)
    }

    fn fallback(&self, places: &[(Place, &'static Input, Range<usize>)]) -> Fallback {
        let wired = |place: &Place| self.source_of(place).is_some();
        if places.iter().any(|(place, input, _)| input.fallback == Fallback::Required && !wired(place)) {
            return Fallback::Required;
        }
        let constants: Option<Vec<Fallback>> = places
            .iter()
            .map(|(place, input, _)| {
                let (default, hard, soft) = number(self.graph.instance(place.node), input)?;
                (!wired(place)).then_some(Fallback::Constant { default, hard, soft })
            })
            .collect();
        // If a place is wired or the constants differ, each place keeps its own value until the name is wired.
        match constants {
            Some(all) if all.iter().all(|one| *one == all[0]) => all[0],
            _ => Fallback::None,
        }
    }

    /// A parameter, or an input with a number, as a specification with its current value as the default.
    fn parameter_place(
        &mut self,
        name: &str,
        text: &str,
        span: &Range<usize>,
    ) -> Option<(Place, ParamSpec, ParamValue)> {
        let (node, part) = self.node(name, text, span, Section::Parameters.verb())?;
        let graph = self.graph;
        let instance = graph.instance(node);
        let refused = |reader: &mut Self, message: String, hint: String| {
            reader.problems.push(Diagnostic::error("place", span.clone(), message).hint(hint));
            None
        };
        if let Some(mut spec) = instance.node.specs().into_iter().find(|spec| spec.name == part) {
            if instance.node.is_subgraph() && part == subgraph::FILE {
                let message = format!("`{name}` drives `{text}`, but the file of a `Subgraph` cannot be a parameter");
                return refused(self, message, "write one file for each variant".to_owned());
            }
            let place = Place { node, name: spec.name };
            self.take(name, place, text, span)?;
            let value = instance.params.get(part).cloned().unwrap_or_else(|| spec.kind.default_value());
            spec.kind = spec.kind.with_default(&value);
            return Some((place, spec, value));
        }
        let Some(position) = instance.node.inputs.iter().position(|input| input.name == part) else {
            self.unknown(name, text, span, instance, Section::Parameters);
            return None;
        };
        let input = &instance.node.inputs[position];
        let Some((default, hard, soft)) = number(instance, input) else {
            let message = format!("`{name}` drives `{text}`, which takes a wire, not a number");
            return refused(self, message, format!("name it in `inputs`: `inputs: {{ \"{name}\": \"{text}\" }}`"));
        };
        if graph.source(node, position).is_some() {
            let message = format!("`{name}` drives `{text}`, which has a wire");
            return refused(self, message, "remove the wire, or name it in `inputs`".to_owned());
        }
        let place = Place { node, name: input.name };
        self.take(name, place, text, span)?;
        let kind = Kind::Float { default, hard, soft };
        let spec = ParamSpec { name: input.name, doc: input.doc, unit: input.ty.unit(), kind, when: &[] };
        Some((place, spec, ParamValue::Float(default)))
    }

    /// The specification common to all places; reports places that do not match.
    fn common(&mut self, name: &str, driven: &[(Place, ParamSpec, ParamValue)], places: &[Written]) -> Option<Kind> {
        let (_, first, value) = driven.first()?;
        let mut kind = first.kind.clone();
        for ((place, spec, other), (text, span)) in driven.iter().zip(places).skip(1) {
            let first_text = &places[0].0;
            let Some(both) = both(&kind, &spec.kind).filter(|_| spec.unit == first.unit) else {
                let message = format!(
                    "`{name}` drives `{first_text}`, which is {}, and `{text}`, which is {}",
                    first.kind.describe(first.unit),
                    spec.kind.describe(spec.unit)
                );
                self.problems.push(Diagnostic::error("type", span.clone(), message).hint("give each its own name"));
                return None;
            };
            if other != value {
                if !self.bad.contains(&place.node) && !self.bad.contains(&driven[0].0.node) {
                    let message =
                        format!("`{name}` drives `{first_text}` ({value}) and `{text}` ({other}), which differ");
                    let problem = Diagnostic::error("default", span.clone(), message);
                    self.problems.push(problem.hint("give both the same value: it is the parameter's default"));
                }
                return None;
            }
            kind = both;
        }
        Some(kind)
    }
}

/// The number at an input, with its ranges. Returns None when the input takes no number.
fn number(instance: &Instance, input: &'static Input) -> Option<(f64, [f64; 2], [f64; 2])> {
    let Fallback::Constant { default, hard, soft } = input.fallback else { return None };
    let position = instance.node.inputs.iter().position(|other| other.name == input.name)?;
    Some((instance.constants.get(position).copied().flatten().unwrap_or(default), hard, soft))
}

/// A kind for values that fit both, with the default of the first. Returns None when they are of different kinds.
fn both(a: &Kind, b: &Kind) -> Option<Kind> {
    let meet = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a.max(c), b.min(d)];
    let mut kind = a.clone();
    match (&mut kind, b) {
        (Kind::Float { hard, soft, .. }, Kind::Float { hard: other, .. }) => {
            *hard = meet(*hard, *other);
            *soft = soft.map(|v| v.clamp(hard[0], hard[1].max(hard[0])));
        }
        (Kind::Int { hard, soft, .. }, Kind::Int { hard: other, .. }) => {
            *hard = [hard[0].max(other[0]), hard[1].min(other[1])];
            *soft = soft.map(|v| v.clamp(hard[0], hard[1].max(hard[0])));
        }
        (Kind::Point { hard, .. }, Kind::Point { hard: other, .. })
        | (Kind::Path { hard, .. }, Kind::Path { hard: other, .. })
        | (Kind::Waypoints { hard, .. }, Kind::Waypoints { hard: other, .. }) => *hard = meet(*hard, *other),
        (Kind::Choice { options, .. }, Kind::Choice { options: other, .. }) if options == other => {}
        (Kind::Bool { .. }, Kind::Bool { .. })
        | (Kind::Seed { .. }, Kind::Seed { .. })
        | (Kind::Curve { .. }, Kind::Curve { .. })
        | (Kind::Stops { .. }, Kind::Stops { .. })
        | (Kind::Layers { .. }, Kind::Layers { .. })
        | (Kind::File, Kind::File) => {}
        (Kind::Strokes { timed, .. }, Kind::Strokes { timed: other, .. }) if timed == other => {}
        _ => return None,
    }
    Some(kind)
}

/// A kind narrowed to the range in an entry, which must lie within the ranges of its places and contain the default.
fn narrowed(name: &str, kind: &Kind, unit: Unit, literal: &Literal) -> Result<Kind, Misfit> {
    let wrong = |message: String| Err(Misfit::new("range", message));
    let (hard, default) = match kind {
        Kind::Float { hard, default, .. } => (*hard, *default),
        Kind::Int { hard, default, .. } => (hard.map(|v| v as f64), *default as f64),
        _ => return wrong(format!("`{name}` is not a number, so it cannot have a range")),
    };
    let [lo, hi] = pair("range", unit, literal).unwrap_or_else(|| {
        let message = format!("the range of `{name}` is {}, but takes a pair", literal.describe());
        Err(Misfit::new("type", message).hint("write `range: (LOWEST, HIGHEST)`"))
    })?;
    let show = |v: f64| unit.display(v);
    if lo > hi {
        return wrong(format!("the range of `{name}` goes from {} down to {}", show(lo), show(hi)));
    }
    if lo < hard[0] || hi > hard[1] {
        return wrong(format!(
            "the range of `{name}`, {} to {}, is wider than its places allow: {}",
            show(lo),
            show(hi),
            kind.describe(unit)
        ));
    }
    if default < lo || default > hi {
        return wrong(format!("`{name}` is {}, but its range is {} to {}", show(default), show(lo), show(hi)));
    }
    Ok(match kind {
        Kind::Int { default, .. } => {
            let ends = [lo.ceil() as i64, hi.floor() as i64];
            Kind::Int { default: *default, hard: ends, soft: ends }
        }
        _ => Kind::Float { default, hard: [lo, hi], soft: [lo, hi] },
    })
}
