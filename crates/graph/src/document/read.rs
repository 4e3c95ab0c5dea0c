//! A parsed text: its tree, its contents, and the graph built from it.
//!
//! A text is parsed once and checked once. An edit starts from the tree of the text that it changes, and the check
//! reuses the tree of the result. The graph to build is expanded on demand and reused while edits do not affect the
//! build, such as moves on the canvas.

use std::sync::{
    Arc, OnceLock,
    atomic::{AtomicU64, Ordering},
};

use super::{
    check::{Checked, OutputDecl, check},
    expand::Placed,
    subgraph::{Home, Loader, UsedGraph},
    syntax::{Tree, parse},
};
use crate::{diagnostic::Diagnostic, node::Node, registry::Registry};

/// A syntax tree with the syntax errors of its text.
#[derive(Debug)]
pub(super) struct Parsed {
    pub(super) tree: Tree,
    pub(super) mistakes: Vec<Diagnostic>,
}

impl Parsed {
    pub(super) fn of(source: &str) -> Self {
        let (tree, mistakes) = parse(source);
        Self { tree, mistakes }
    }
}

/// A text with all data read from it.
#[derive(Debug)]
pub(super) struct Read {
    pub(super) source: String,
    pub(super) parsed: Arc<Parsed>,
    pub(super) checked: Checked,
    pub(super) build: Arc<Build>,
    /// Its declaration as a node, made on demand.
    pub(super) declaration: OnceLock<&'static Node>,
}

impl Read {
    /// Checks a text. Shares the built graph with `like` if it is the same.
    pub(super) fn new(
        source: String,
        parsed: Arc<Parsed>,
        registry: &Registry,
        home: &Home,
        loader: &mut Loader,
        like: Option<&Self>,
    ) -> Self {
        let checked = check(&source, &parsed.tree, registry, home, parsed.mistakes.clone(), loader);
        let same = like.filter(|like| checked.builds_as(&like.checked));
        let build = same.map_or_else(Arc::default, |like| Arc::clone(&like.build));
        Self { source, parsed, checked, build, declaration: OnceLock::new() }
    }

    /// Returns true if both use the same graph files, with the same contents.
    pub(super) fn reads_as(&self, other: &Self) -> bool {
        self.checked.uses.iter().map(UsedGraph::content).eq(other.checked.uses.iter().map(UsedGraph::content))
    }
}

/// The graph built from a text.
#[derive(Debug)]
pub(super) struct Build {
    /// Unique in the program.
    pub(super) id: u64,
    /// Filled on demand.
    pub(super) placed: OnceLock<Placed>,
}

impl Default for Build {
    fn default() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(1);
        Self { id: NEXT.fetch_add(1, Ordering::Relaxed), placed: OnceLock::new() }
    }
}

impl Checked {
    /// Returns true if the same graph is built from the same files in the same world.
    fn builds_as(&self, other: &Self) -> bool {
        let same_output = |(a, b): (&OutputDecl, &OutputDecl)| a.name == b.name && a.port == b.port && a.ty == b.ty;
        self.world == other.world
            && self.graph.same(&other.graph)
            && self.muted.keys().eq(other.muted.keys())
            && self.outputs.len() == other.outputs.len()
            && self.outputs.iter().zip(&other.outputs).all(same_output)
            && self.uses.iter().map(|used| &used.path).eq(other.uses.iter().map(|used| &used.path))
            && self.subgraphs.len() == other.subgraphs.len()
            && self.subgraphs.iter().zip(&other.subgraphs).all(|(a, b)| a.0 == b.0 && Arc::ptr_eq(a.1, b.1))
    }
}

/// How much was parsed, to measure the cost of edits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// How often the document's own text was parsed.
    pub texts_parsed: u64,
    /// How often the text of a graph file that the document uses was parsed.
    pub files_parsed: u64,
}
