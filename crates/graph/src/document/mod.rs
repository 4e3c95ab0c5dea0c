//! The document: the graph as a file.
//!
//! The notation is RON (Rusty Object Notation) with two limits: a string ends on its line, and brackets nest at most 64
//! levels deep. The source text is kept. A syntax tree ([`syntax`]) records where everything is, [`check`] turns it
//! into a graph and a list of all problems, and an edit replaces bytes at the tree's offsets, so that everything it
//! does not touch survives, including comments and order.
//!
//! We wrote our own parser. We tried the one of the `ron2` crate: its recovery skips to the closing bracket, so that
//! one missing comma gave four messages and hid the nodes after it, and each error counts lines from the start of the
//! file, so that a file of 80 kB with many mistakes took nine seconds. The tests use it as a reference: it accepts
//! everything that ours accepts.

mod check;
mod edit;
mod effect;
mod expand;
mod file;
mod json;
mod read;
mod subgraph;
mod syntax;

pub use self::check::canvas::Reroute;
pub use self::check::expect::{Expectation, Expectations};
pub use self::check::exposed::{NamedInput, NamedParameter, Place};
pub use self::check::frames::{Frame, FrameEntry};
pub use self::check::wires::LooseWire;
pub use self::edit::diff::diff;
pub use self::edit::extract::{Extract, Extracted};
pub use self::edit::fresh::fresh_name;
pub use self::edit::history::History;
pub use self::edit::inline::Inlined;
pub use self::edit::journal::{JournalEntry, JournalError, JournalWriter, Recovered, recover};
pub use self::syntax::format::format_source;
pub use self::syntax::splice::Splice;
pub(crate) use check::expect::FIELDS as EXPECT_FIELDS;
pub use check::{NodeEntry, OutputDecl};
pub use edit::{Edit, EditError};
pub use expand::Expanded;
pub use file::LoadError;
pub use read::Statistics;
pub use subgraph::{SUBGRAPH, UsedGraph};

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::Arc,
};

use petgraph::stable_graph::NodeIndex;

use crate::{
    diagnostic::{Diagnostic, Severity},
    graph::Graph,
    node::Node,
    param::ParamValue,
    registry::Registry,
    world::World,
};
use read::Read;
use subgraph::{Home, Loader};

/// A graph as a file: its text, its problems, and the graph of its valid part.
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
    home: Home,
    read: Arc<Read>,
    /// The text before the last edit, if known, for an edit that replaces the last one.
    before: Option<Arc<Read>>,
    history: History,
    /// How often the document's own text was parsed.
    parsed: u64,
}

impl Document {
    /// Reads a source that has no file. It always succeeds: problems are in [`Self::problems`], the valid part is in
    /// [`Self::graph`]. Graph files that it uses are looked up in the current folder.
    #[must_use]
    pub fn parse(source: impl Into<String>, registry: &Registry) -> Self {
        Self::with_home(source.into(), registry, Home::default())
    }

    /// Reads a source that has no file, such as a copy of an example. The files that it names are looked up in that
    /// folder.
    #[must_use]
    pub fn parse_in(source: impl Into<String>, folder: impl Into<PathBuf>, registry: &Registry) -> Self {
        Self::with_home(source.into(), registry, Home { folder: folder.into(), ..Home::default() })
    }

    /// Reads a source that is, or will be, the text of a file at that path. The files that it names are looked up
    /// relative to its folder.
    #[must_use]
    pub fn parse_at(source: impl Into<String>, path: impl AsRef<Path>, registry: &Registry) -> Self {
        Self::with_home(source.into(), registry, Home::of_file(path.as_ref()))
    }

    fn with_home(source: String, registry: &Registry, home: Home) -> Self {
        let mut loader = Loader::new(&home);
        Self::read(source, registry, home, &mut loader)
    }

    /// A new document without nodes, in a world whose terrain continues beyond its sides.
    #[must_use]
    pub fn empty(registry: &Registry) -> Self {
        Self::parse("(\n    format: 1,\n    world: (boundary: inland),\n    nodes: {},\n)\n", registry)
    }

    /// All problems of the file, sorted by position.
    #[must_use]
    pub fn problems(&self) -> &[Diagnostic] {
        &self.read.checked.problems
    }

    /// Returns true if at least one problem is an error, so that the file should not be built.
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.problems().iter().any(|problem| problem.severity == Severity::Error)
    }

    /// The graph of the valid part; nodes are in file order.
    #[must_use]
    pub fn graph(&self) -> &Graph {
        &self.read.checked.graph
    }

    /// The world, with defaults for fields that are missing or invalid.
    #[must_use]
    pub fn world(&self) -> World {
        self.read.checked.world
    }

    /// The raster from which the world has its size, its cells and its place, relative to [`Self::folder`]. Returns
    /// None when the file states them.
    #[must_use]
    pub fn world_raster(&self) -> Option<&str> {
        self.read.checked.from.as_deref()
    }

    /// The outputs whose wires exist, in file order.
    #[must_use]
    pub fn outputs(&self) -> &[OutputDecl] {
        &self.read.checked.outputs
    }

    /// What must hold of the terrain. Returns None when the file states nothing.
    #[must_use]
    pub fn expectations(&self) -> Option<&Arc<Expectations>> {
        self.read.checked.expectations.as_ref()
    }

    /// The parameters that the file exposes, in file order.
    #[must_use]
    pub fn parameters(&self) -> &[NamedParameter] {
        &self.read.checked.parameters
    }

    /// The inputs that the file exposes, in file order.
    #[must_use]
    pub fn inputs(&self) -> &[NamedInput] {
        &self.read.checked.inputs
    }

    /// The frames on the canvas, in file order.
    #[must_use]
    pub fn frames(&self) -> &[FrameEntry] {
        &self.read.checked.frames
    }

    /// The routes of wires on the canvas that are not straight, in file order.
    #[must_use]
    pub fn reroutes(&self) -> &[Reroute] {
        &self.read.checked.reroutes
    }

    /// The wires whose source node is not in the document, as in copied parts of a file.
    #[must_use]
    pub fn loose_wires(&self) -> &[LooseWire] {
        &self.read.checked.loose
    }

    /// The graph files that it uses, in file order, including those that cannot be used.
    #[must_use]
    pub fn uses(&self) -> &[UsedGraph] {
        &self.read.checked.uses
    }

    /// The document behind a `Subgraph` node of the graph.
    #[must_use]
    pub fn subgraph(&self, node: NodeIndex) -> Option<&Arc<Self>> {
        self.read.checked.subgraphs.get(&node)
    }

    /// Its path. Returns None when the text has no file.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.home.path.as_deref()
    }

    /// The folder that file names in it are relative to.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.home.folder
    }

    /// The file as the declaration of a node: its named inputs and parameters after those that every [`SUBGRAPH`] has,
    /// and its outputs.
    #[must_use]
    pub fn declaration(&self) -> &'static Node {
        subgraph::interface(self)
    }

    /// Every file that it reads, directly or through the graph files that it uses, whether it exists or not.
    #[must_use]
    pub fn files(&self) -> BTreeSet<PathBuf> {
        let mut files = BTreeSet::new();
        self.add_files(&mut files, &mut BTreeSet::new());
        files
    }

    /// Adds the files that it reads. `seen` holds the graph files whose files were added, because many may use the
    /// same.
    fn add_files(&self, files: &mut BTreeSet<PathBuf>, seen: &mut BTreeSet<*const Self>) {
        for used in self.uses() {
            files.insert(used.path.clone());
            if let Some(document) = used.document.as_ref().filter(|document| seen.insert(Arc::as_ptr(document))) {
                document.add_files(files, seen);
            }
        }
        files.extend(self.world_raster().map(|file| self.folder().join(file)));
        for index in self.graph().indices() {
            let instance = self.graph().instance(index);
            for (name, value) in instance.params.iter() {
                if let ParamValue::File(file) = value
                    && !file.is_empty()
                    && !(instance.node.is_subgraph() && name == subgraph::FILE)
                {
                    files.insert(self.folder().join(file));
                }
            }
        }
    }

    /// The file's description: the comments before its opening bracket, without comment markers.
    #[must_use]
    pub fn about(&self) -> String {
        let tree = &self.read.parsed.tree;
        let start = tree.root.as_ref().map_or(self.read.source.len(), |root| root.span.start);
        let before = tree.comments.iter().take_while(|comment| comment.span.start < start);
        let lines = before.flat_map(|comment| {
            let text = &self.read.source[comment.span.clone()];
            let text = text.strip_prefix("//").or_else(|| text.strip_prefix("/*")?.strip_suffix("*/")).unwrap_or(text);
            text.lines().map(str::trim)
        });
        lines.collect::<Vec<_>>().join("\n").trim().to_owned()
    }

    /// All nodes in file order, including placeholders for unknown ones.
    #[must_use]
    pub fn nodes(&self) -> &[NodeEntry] {
        &self.read.checked.nodes
    }

    /// The node of that name; it may be a placeholder.
    #[must_use]
    pub fn node(&self, name: &str) -> Option<&NodeEntry> {
        self.read.checked.by_name.get(name).map(|position| &self.nodes()[*position])
    }

    /// The text of the file.
    #[must_use]
    pub fn source(&self) -> &str {
        &self.read.source
    }

    /// How often texts were parsed since the document was opened.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        Statistics { texts_parsed: self.parsed, files_parsed: self.home.kept.parsed() }
    }

    /// A number that changes with every change that affects the build: nodes, wires, world, outputs and files, but not
    /// positions on the canvas, notes or comments. No two documents with different graphs have the same number.
    #[must_use]
    pub fn build(&self) -> u64 {
        self.read.build.id
    }

    /// The registry it was read with.
    #[must_use]
    pub const fn registry(&self) -> &Registry {
        &self.registry
    }
}

#[cfg(test)]
mod tests;
