//! The sea level of a file: what its world says, or what nodes of older versions said each for itself.

use std::ops::Range;

use super::{args::Moved, literal::Misfit, problems::Problems, world};
use crate::{diagnostic::Diagnostic, migrate::Step, node::Node, unit::Unit, world::World};

/// A node whose kind had a sea level of its own, or a file with such nodes, and the sea that it was written for.
#[derive(Clone, Debug)]
pub(super) struct Own {
    pub(super) node: String,
    /// Where it says so, or its kind.
    pub(super) span: Range<usize>,
    /// The level in metres, or None for no sea.
    pub(super) level: Option<f64>,
}

/// The step that gave a kind's sea level to the world, by the name of the parameter and the level up to which there was no sea.
fn given_up(node: &Node) -> Option<(&'static str, f64)> {
    node.migrations.iter().flat_map(|migration| migration.steps).find_map(|step| match *step {
        Step::SeaLevel { name, none } => Some((name, none)),
        _ => None,
    })
}

/// What to do where a parameter is named that is now the world's.
pub(super) fn moved_hint(node: &Node, name: &str) -> Option<String> {
    let (given_up, _) = given_up(node)?;
    (name == given_up).then(|| "the sea belongs to the world: write `world: (sea_level: \"0 m\")`".to_owned())
}

/// The sea that a node was written for, or None where its kind never had one of its own.
///
/// # Errors
/// When what it says is no level of a sea.
pub(super) fn of_node(
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

/// Makes one sea of those that nodes were written for, and reports those that differ from it. `said` is true where the world
/// has a `sea_level`, right or wrong.
///
/// Gives the sea that the file takes for granted in a world that has to be its user's: None where its own says it.
pub(super) fn settle(world: &mut World, said: bool, seas: &[Own], problems: &mut Problems) -> Option<Option<f64>> {
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
            problems.push(problem.hint("take it out of the node; a world has one sea"));
        }
        return None;
    }
    let first = seas.iter().find(|own| own.level.is_some()).or(seas.first())?;
    if let Some(other) = seas.iter().find(|own| own.level != first.level) {
        let [a, b] = [first, other].map(|own| format!("`{}` has {}", own.node, level_text(own.level)));
        let problem =
            Diagnostic::error("sea-level", first.span.clone(), format!("{a} and {b}, but a world has one sea"));
        problems.push(problem.hint("write its level into `world` as `sea_level`, and take it out of the nodes"));
    }
    world.sea_level = first.level;
    Some(first.level)
}

/// A sea in words.
pub(super) fn level_text(level: Option<f64>) -> String {
    level.map_or_else(|| "no sea".to_owned(), |level| format!("a sea at {}", Unit::Metres.display(level)))
}
