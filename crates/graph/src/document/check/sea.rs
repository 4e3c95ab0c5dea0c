//! The sea level of a file: the level of its world, or of nodes of older versions that each had one.

use std::ops::Range;

use super::{args::Moved, problems::Problems, world};
use crate::document::syntax::literal::Misfit;
use crate::{diagnostic::Diagnostic, migrate::Step, node::Node, unit::Unit, world::World};

/// A node whose kind once had a sea level parameter (or a file with such nodes), and the sea that it was written for.
#[derive(Clone, Debug)]
pub(crate) struct Own {
    pub(crate) node: String,
    /// Where the level is written, or else the node's kind.
    pub(crate) span: Range<usize>,
    /// The level in metres; `None` for no sea.
    pub(crate) level: Option<f64>,
}

/// The migration step that moved a kind's sea level to the world: the name of the parameter, and the level up to which
/// there was no sea.
fn given_up(node: &Node) -> Option<(&'static str, f64)> {
    node.migrations.iter().flat_map(|migration| migration.steps).find_map(|step| match *step {
        Step::SeaLevel { name, none } => Some((name, none)),
        _ => None,
    })
}

/// Advice for a parameter that has moved to the world.
pub(crate) fn moved_hint(node: &Node, name: &str) -> Option<String> {
    let (given_up, _) = given_up(node)?;
    (name == given_up).then(|| "the sea belongs to the world: write `world: (sea_level: \"0 m\")`".to_owned())
}

/// The sea that a node was written for. Returns None when its kind never had a sea level.
///
/// # Errors
/// When its value is not a valid sea level.
pub(crate) fn of_node(
    node: &Node,
    name: &str,
    kind_span: &Range<usize>,
    moved: Option<&Moved>,
) -> Result<Option<Own>, Misfit> {
    let Some((_, none)) = given_up(node) else { return Ok(None) };
    let level = moved.map(|moved| world::sea_level(&moved.literal)).transpose()?.filter(|level| *level > none);
    let span = moved.map_or_else(|| kind_span.clone(), |moved| moved.span.clone());
    Ok(Some(Own { node: name.to_owned(), span, level }))
}

/// Merges the seas that nodes were written for into the world's, and reports those that differ. `said` is true if the
/// world has a `sea_level`, valid or not.
///
/// Returns the sea that the file assumes of any world that uses it, or None when its own world defines it.
pub(crate) fn settle(world: &mut World, said: bool, seas: &[Own], problems: &mut Problems) -> Option<Option<f64>> {
    if said {
        let differing = seas.iter().filter(|own| own.level.is_some() && own.level != world.sea_level);
        for own in differing.filter(|_| world.sea_level.is_some()) {
            let message = format!(
                "`{}` has {}, but the world's `sea_level` is {}",
                own.node,
                level_text(own.level),
                level_text(world.sea_level)
            );
            let problem = Diagnostic::error("sea-level", own.span.clone(), message);
            problems.push(problem.hint("remove it from the node; a world has one sea"));
        }
        return None;
    }
    let first = seas.iter().find(|own| own.level.is_some()).or(seas.first())?;
    if let Some(other) = seas.iter().find(|own| own.level != first.level) {
        let [a, b] = [first, other].map(|own| format!("`{}` has {}", own.node, level_text(own.level)));
        let problem =
            Diagnostic::error("sea-level", first.span.clone(), format!("{a} and {b}, but a world has one sea"));
        problems.push(problem.hint("write its level into `world` as `sea_level`, and remove it from the nodes"));
    }
    world.sea_level = first.level;
    Some(first.level)
}

/// A sea level as text.
pub(crate) fn level_text(level: Option<f64>) -> String {
    level.map_or_else(|| "no sea".to_owned(), |level| format!("a sea at {}", Unit::Metres.display(level)))
}
