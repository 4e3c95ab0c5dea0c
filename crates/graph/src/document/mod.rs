//! The document: the graph as a file.
//!
//! The notation is RON (rusty object notation) with two limits: a text ends on its line, and brackets nest at most 64
//! deep. The source text is kept; a syntax tree ([`syntax`]) says what stands where, [`check`] turns it into a graph
//! and a list of all problems, and an edit replaces bytes at the tree's offsets, so that whatever it does not touch
//! survives, comments and order first of all.
//!
//! The parser is our own. That of the `ron2` crate was tried: its recovery skips to the closing bracket, so that one
//! missing comma gave four messages and hid the nodes after it, and each error counts lines from the start of the
//! file, so that a file of 80 kB with many mistakes took nine seconds. It checks ours in the tests: what we accept, it
//! accepts.

mod args;
mod check;
mod diff;
mod edit;
mod editor;
mod file;
mod format;
mod history;
mod lex;
mod literal;
mod problems;
mod splice;
mod syntax;
mod wires;
mod world;

pub use check::{NodeEntry, OutputDecl};
pub use diff::diff;
pub use edit::{Edit, EditError};
pub use file::LoadError;
pub use format::format_source;

use crate::{
    diagnostic::{Diagnostic, Severity},
    graph::Graph,
    registry::Registry,
    world::World,
};
use check::Checked;
use history::History;

/// A graph as a file: its text, what is wrong with it, and the graph of what is sound.
///
/// ```
/// use orograph_graph::{Document, Edit, Registry};
///
/// let registry = Registry::new([]);
/// let document = Document::parse("(nodes: { \"a\": Perlni(octaves: 3) })", &registry);
/// assert_eq!(document.problems()[0].message, "the file has no outputs, so a run writes nothing");
/// assert_eq!(document.problems()[1].message, "unknown node `Perlni`");
/// assert!(document.has_errors());
///
/// let mut document = Document::parse("(nodes: {}, /* kept */ world: (seed: 7))", &registry);
/// let world = orograph_graph::World { seed: 8, ..document.world() };
/// document.apply(&Edit::SetWorld(world))?;
/// assert_eq!(document.source(), "(nodes: {}, /* kept */ world: (seed: 8))");
/// document.undo();
/// assert_eq!(document.world().seed, 7);
/// # Ok::<(), orograph_graph::EditError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Document {
    registry: Registry,
    source: String,
    checked: Checked,
    history: History,
}

impl Document {
    /// Reads a source. It always succeeds: what is wrong is in [`Self::problems`], what is sound in [`Self::graph`].
    #[must_use]
    pub fn parse(source: impl Into<String>, registry: &Registry) -> Self {
        let source = source.into();
        let (tree, syntax) = syntax::parse(&source);
        let checked = check::check(&source, &tree, registry, syntax);
        Self { registry: registry.clone(), source, checked, history: History::default() }
    }

    /// A new file, without nodes.
    #[must_use]
    pub fn empty(registry: &Registry) -> Self {
        Self::parse("(\n    format: 1,\n    nodes: {},\n)\n", registry)
    }

    /// All problems of the file, sorted by place.
    #[must_use]
    pub fn problems(&self) -> &[Diagnostic] {
        &self.checked.problems
    }

    /// Whether a problem is an error, so that the file should not be built.
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.problems().iter().any(|problem| problem.severity == Severity::Error)
    }

    /// The graph of what is sound; nodes in file order.
    #[must_use]
    pub const fn graph(&self) -> &Graph {
        &self.checked.graph
    }

    /// The world, with defaults for what the file leaves out or has wrong.
    #[must_use]
    pub const fn world(&self) -> World {
        self.checked.world
    }

    /// The outputs whose wires exist, in file order.
    #[must_use]
    pub fn outputs(&self) -> &[OutputDecl] {
        &self.checked.outputs
    }

    /// All nodes, placeholders for unknown ones among them, in file order.
    #[must_use]
    pub fn nodes(&self) -> &[NodeEntry] {
        &self.checked.nodes
    }

    /// The text of the file.
    #[must_use]
    pub fn source(&self) -> &str {
        &self.source
    }

    /// The kinds of nodes it was read with.
    #[must_use]
    pub const fn registry(&self) -> &Registry {
        &self.registry
    }
}

#[cfg(test)]
mod tests;
