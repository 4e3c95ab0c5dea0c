//! The arguments of one node in a file: its version and its named values, migrated to the version that this program
//! supports.

use std::{collections::BTreeSet, ops::Range};

use crate::document::syntax::{
    Expr, ExprKind, Group,
    literal::{Literal, begins_like_a_number},
    parse_value,
};
use crate::{migrate::Step, node::Node};

/// A named value in a node's brackets.
#[derive(Clone, Debug)]
pub(crate) struct Arg {
    pub(crate) name: String,
    pub(crate) literal: Literal,
    /// Span of the name.
    pub(crate) name_span: Range<usize>,
    /// Span of the value.
    pub(crate) span: Range<usize>,
    /// Position in the brackets; `None` for a value that a migration added.
    pub(crate) item: Option<usize>,
    /// True if a migration changed the value.
    pub(crate) rewritten: bool,
}

/// A value that a migration moves from a node's brackets to the world.
#[derive(Clone, Debug)]
pub(crate) struct Moved {
    pub(crate) literal: Literal,
    /// Span of the value.
    pub(crate) span: Range<usize>,
}

/// The span and name of a node's kind, and its brackets if it has any. Returns None when the value is not a node.
pub(crate) fn kind_of(value: &Expr) -> Option<(Range<usize>, Option<&Group>)> {
    match &value.kind {
        ExprKind::Word => Some((value.span.clone(), None)),
        ExprKind::Group(group) => group.name.clone().map(|name| (name, Some(&**group))),
        _ => None,
    }
}

/// The named values in a node's brackets, without its version.
pub(crate) fn args(group: &Group, source: &str) -> Vec<Arg> {
    let (mut out, mut seen): (Vec<Arg>, BTreeSet<&str>) = (Vec::new(), BTreeSet::new());
    for (position, item) in group.items.iter().enumerate() {
        if let Some(key) = &item.key
            && key.text != "version"
            && seen.insert(&key.text)
        {
            out.push(Arg {
                name: key.text.clone(),
                literal: Literal::read(&item.value, source),
                name_span: key.span.clone(),
                span: item.value.span.clone(),
                item: Some(position),
                rewritten: false,
            });
        }
    }
    out
}

/// The version a node is written in; 1 when there is none. Returns None when the value is not a version.
pub(crate) fn version(group: &Group, source: &str) -> Option<u32> {
    match group.get("version").map(|item| Literal::read(&item.value, source)) {
        None => Some(1),
        Some(Literal::Number(_, Some(version))) => u32::try_from(version).ok().filter(|v| *v > 0),
        Some(_) => None,
    }
}

/// Applies the steps from `version` to the node's current version, in order; returns the node's own sea level, if it
/// has one. `place` is the span at which added values are reported.
pub(crate) fn migrate(args: &mut Vec<Arg>, node: &Node, version: u32, place: &Range<usize>) -> Option<Moved> {
    let mut sea = None;
    let due = node.migrations.iter().filter(|migration| migration.from >= version);
    for step in due.flat_map(|migration| migration.steps) {
        match *step {
            Step::Rename { from, to } => {
                if let Some(arg) = args.iter_mut().find(|arg| arg.name == from) {
                    arg.name = to.to_owned();
                }
            }
            Step::Keep { name, value } => {
                if !args.iter().any(|arg| arg.name == name) {
                    let literal = parse_value(value).map_or(Literal::Bad, |expr| Literal::read(&expr, value));
                    let (name_span, span) = (place.clone(), place.clone());
                    args.push(Arg { name: name.to_owned(), literal, name_span, span, item: None, rewritten: true });
                }
            }
            Step::Drop { name } => args.retain(|arg| arg.name != name),
            Step::SeaLevel { name, .. } => {
                if let Some(at) = args.iter().position(|arg| arg.name == name) {
                    let Arg { literal, span, .. } = args.remove(at);
                    sea = Some(Moved { literal, span });
                }
            }
            Step::Scale { name, factor } => {
                for arg in args.iter_mut().filter(|arg| arg.name == name) {
                    // A value with a unit means the same as before; a wire cannot be scaled.
                    let number = match &arg.literal {
                        Literal::Number(value, _) => Some(*value),
                        Literal::Text(text) if begins_like_a_number(text) => text.trim().parse().ok(),
                        _ => None,
                    };
                    if let Some(value) = number {
                        arg.literal = Literal::Number(value * factor, None);
                        arg.rewritten = true;
                    }
                }
            }
        }
    }
    sea
}
