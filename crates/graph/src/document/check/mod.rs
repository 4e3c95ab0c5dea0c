//! From a syntax tree to a graph: finds every problem of the file, and keeps the valid part.

pub(crate) mod args;
pub(crate) mod canvas;
pub(crate) mod expect;
pub(crate) mod exposed;
pub(crate) mod frames;
pub(crate) mod muted;
mod nodes;
mod outputs;
pub(crate) mod problems;
mod refused;
pub(crate) mod sea;
pub(crate) mod wires;
pub(crate) mod world;

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    ops::Range,
    sync::Arc,
};

use petgraph::stable_graph::NodeIndex;

use self::{
    canvas::Reroute,
    expect::Expectations,
    exposed::{NamedInput, NamedParameter, Reader, Section},
    frames::FrameEntry,
    muted::Muted,
    problems::Problems,
    wires::LooseWire,
};
use super::{
    subgraph::{Home, Loader, Size, UsedGraph},
    syntax::{Expr, FIELDS, Group, Tree, literal::Literal},
};
use crate::{
    Document,
    diagnostic::Diagnostic,
    graph::{Graph, Port},
    param::ParamSpec,
    registry::Registry,
    value::PortType,
    world::World,
};

/// The newest version of the file format that this program reads.
pub(in crate::document) const FORMAT: i64 = 1;

/// A node of the file, in file order.
#[derive(Clone, Debug)]
pub struct NodeEntry {
    /// Its name.
    pub name: String,
    /// Its kind as written; empty when the value is not a node.
    pub kind: String,
    /// The node in the graph; `None` for a placeholder: a node of an unknown kind, kept unchanged.
    pub index: Option<NodeIndex>,
    /// Byte range of the whole entry, from its name to its closing bracket.
    pub span: Range<usize>,
    /// Byte range of its kind.
    pub kind_span: Range<usize>,
    /// Its position in the editor.
    pub layout: Option<[f64; 2]>,
    /// Its note on the canvas; may be empty.
    pub note: String,
    /// True if it is muted, so that the build bypasses it.
    pub muted: bool,
}

/// An output of the file: a name for a value that a run writes.
#[derive(Clone, Debug)]
pub struct OutputDecl {
    /// Its name.
    pub name: String,
    /// The output that is written.
    pub port: Port,
    /// The type of the value.
    pub ty: PortType,
    /// Of weights, the layers that can be present: the first, and those with a wired input.
    pub layers: [bool; 4],
    /// Byte range of the entry.
    pub span: Range<usize>,
}

/// The contents of a file.
#[derive(Clone, Debug, Default)]
pub(super) struct Checked {
    pub(super) graph: Arc<Graph>,
    pub(super) world: World,
    /// The raster from which the world has its size, if it has it from one, relative to the file's folder.
    pub(super) from: Option<String>,
    /// The sea level that the file assumes when another file uses it, if any.
    pub(super) sea: Option<Option<f64>>,
    pub(super) nodes: Vec<NodeEntry>,
    /// Positions in `nodes`.
    pub(super) by_name: HashMap<String, usize>,
    pub(super) outputs: Vec<OutputDecl>,
    /// What must hold of the terrain, if the file states it.
    pub(super) expectations: Option<Arc<Expectations>>,
    pub(super) parameters: Vec<NamedParameter>,
    pub(super) inputs: Vec<NamedInput>,
    pub(super) uses: Vec<UsedGraph>,
    pub(super) muted: Muted,
    pub(super) frames: Vec<FrameEntry>,
    pub(super) reroutes: Vec<Reroute>,
    pub(super) loose: Vec<LooseWire>,
    pub(super) subgraphs: BTreeMap<NodeIndex, Arc<Document>>,
    /// Its size including that of all files that it uses, counted once per use.
    pub(super) size: Size,
    /// How deep the graph files that it uses are nested; 0 without any.
    pub(super) depth: usize,
    pub(super) problems: Vec<Diagnostic>,
}

/// Checks a whole file. `syntax` holds the syntax errors found by the parser.
pub(super) fn check(
    source: &str,
    tree: &Tree,
    registry: &Registry,
    home: &Home,
    syntax: Vec<Diagnostic>,
    loader: &mut Loader,
) -> Checked {
    let mut problems = Problems::new(syntax);
    let mut checked = match root(source, tree, &mut problems) {
        Some(root) => {
            let (out, bad, seas) = (Checked::default(), BTreeSet::new(), Vec::new());
            let mut checker = Checker {
                source,
                registry,
                home,
                loader,
                problems,
                out,
                bad,
                seas,
                beyond: None,
                specs: HashMap::new(),
            };
            checker.file(root);
            problems = checker.problems;
            checker.out
        }
        None => Checked::default(),
    };
    checked.problems = problems.finish(source);
    checked
}

/// The outermost brackets, if the file's format can be read.
fn root<'a>(source: &str, tree: &'a Tree, problems: &mut Problems) -> Option<&'a Group> {
    let Some(root) = &tree.root else {
        if problems.is_empty() {
            let problem = Diagnostic::error("empty", 0..0, "the file is empty");
            problems.push(problem.hint("a graph file is `( format: 1, nodes: { … }, outputs: { … } )`"));
        }
        return None;
    };
    let Some(group) = root.as_group().filter(|g| g.name.is_none() && g.bracket == super::syntax::lex::Bracket::Round)
    else {
        if problems.is_empty() {
            let start = root.span.start..(root.span.start + 1).min(root.span.end);
            let problem = Diagnostic::error("type", start, "a graph file begins with `(`");
            problems.push(problem.hint("a graph file is `( format: 1, nodes: { … }, outputs: { … } )`"));
        }
        return None;
    };
    let Some(item) = group.get("format") else { return Some(group) };
    match Literal::read(&item.value, source) {
        Literal::Number(_, Some(FORMAT)) | Literal::Bad => Some(group),
        Literal::Number(_, Some(format)) if format > FORMAT => {
            // Anything else that looks wrong may be right in that format.
            *problems = Problems::new(Vec::new());
            let message = format!("the file has format {format}, but this program reads formats up to {FORMAT}");
            let problem = Diagnostic::error("format", item.value.span.clone(), message);
            problems.push(problem.hint("update the program"));
            None
        }
        other => {
            let message = format!("`format` is {}, but takes a whole number from 1", other.describe());
            let problem = Diagnostic::error("format", item.value.span.clone(), message);
            problems.push(problem.hint(format!("write `format: {FORMAT}`")));
            Some(group)
        }
    }
}

struct Checker<'a> {
    source: &'a str,
    registry: &'a Registry,
    home: &'a Home,
    loader: &'a mut Loader,
    problems: Problems,
    out: Checked,
    /// Nodes with an invalid parameter, so that an output type it would choose is unknown.
    bad: BTreeSet<NodeIndex>,
    /// The sea levels that nodes were written for.
    seas: Vec<sea::Own>,
    /// The first use of a file with which the graph is too large.
    beyond: Option<Range<usize>>,
    /// The specifications of the kinds so far.
    specs: HashMap<&'static str, Arc<[ParamSpec]>>,
}

impl Checker<'_> {
    fn file(&mut self, root: &Group) {
        self.problems.names(root, "a graph file", &FIELDS);
        if let Some(item) = root.get("world") {
            let rasters = world::Rasters { registry: self.registry, folder: &self.home.folder };
            self.out.world = world::read(&item.value, self.source, &rasters, &mut self.problems);
            self.out.from = world::from_of(&item.value, self.source);
        }
        let mut pending = Vec::new();
        match root.get("nodes") {
            Some(item) => {
                if let Some(group) = self.map(&item.value, "nodes", "`{ \"name\": Kind(…), … }`") {
                    pending = self.nodes(group);
                }
            }
            None if self.problems.has_syntax_in(&(0..self.source.len())) => {}
            None => {
                let problem = Diagnostic::error("no-nodes", root.open..root.open + 1, "the file has no `nodes`");
                self.problems.push(problem.hint("write `nodes: { \"name\": Kind(…), … }`"));
            }
        }
        let world = root.get("world").and_then(|item| item.value.as_group());
        let said = world.is_some_and(|world| world.get(world::SEA_LEVEL).is_some());
        self.out.sea = sea::settle(&mut self.out.world, said, &self.seas, &mut self.problems);
        let entries: BTreeMap<String, Option<NodeIndex>> =
            self.out.nodes.iter().map(|entry| (entry.name.clone(), entry.index)).collect();
        let wired: BTreeSet<(NodeIndex, usize)> = pending.iter().map(|wire| (wire.node, wire.input)).collect();
        self.out.loose = wires::loose(&self.out.graph, &pending, &entries);
        let graph = Arc::make_mut(&mut self.out.graph);
        let types = wires::connect(graph, pending, &entries, &self.bad, self.registry, &mut self.problems);
        self.out.graph.find_types();
        let named = self.exposed(root, &entries, &types);
        self.unwired(&wired, &named);
        self.outputs(root, &entries, &types);
        if let Some(item) = root.get("expect")
            && let Some(group) = self.map(&item.value, "expect", "`{ \"measure\": (0.4, 0.6), … }`")
        {
            self.expect(group, root);
        }
        if let Some(item) = root.get("muted") {
            let (muted, names) = muted::read(&item.value, self.source, &entries, &mut self.problems);
            for entry in &mut self.out.nodes {
                entry.muted = names.contains(&entry.name);
            }
            let outputs: Vec<_> = self.out.outputs.iter().map(|output| (output.name.clone(), output.port)).collect();
            muted::check(&self.out.graph, &muted, &self.out.nodes, &outputs, &mut self.problems);
            self.out.muted = muted;
        }
        self.refused(&named);
        if let Some(item) = root.get("layout")
            && let Some(group) = self.map(&item.value, "layout", "`{ \"node\": (0, 0), … }`")
        {
            canvas::layout(group, self.source, &mut self.out.nodes, &self.out.by_name, &mut self.problems);
        }
        if let Some(item) = root.get("notes")
            && let Some(group) = self.map(&item.value, "notes", "`{ \"node\": \"…\", … }`")
        {
            canvas::notes(group, self.source, &mut self.out.nodes, &self.out.by_name, &mut self.problems);
        }
        if let Some(item) = root.get("reroutes")
            && let Some(group) = self.map(&item.value, "reroutes", "`{ \"node.input\": [(120, 40), …], … }`")
        {
            self.out.reroutes = canvas::reroutes(group, self.source, &self.out.graph, &entries, &mut self.problems);
        }
        if let Some(item) = root.get("frames")
            && let Some(group) = self.map(&item.value, "frames", "`{ \"name\": (at: (0, 0), size: (400, 300)), … }`")
        {
            for (name, item) in self.problems.duplicates(group, "in `frames`") {
                self.out.frames.extend(frames::read(name, item, self.source, &mut self.problems));
            }
        }
    }

    /// The curly brackets that a field takes.
    fn map<'e>(&mut self, value: &'e Expr, name: &str, takes: &str) -> Option<&'e Group> {
        let group = value.as_group().filter(|g| g.name.is_none() && g.bracket == super::syntax::lex::Bracket::Curly);
        if group.is_none() {
            self.problems.misplaced(value, name, takes, self.source);
        }
        group
    }

    /// The names that the file exposes; returns the inputs among their places.
    fn exposed(
        &mut self,
        root: &Group,
        entries: &BTreeMap<String, Option<NodeIndex>>,
        types: &BTreeMap<Port, PortType>,
    ) -> BTreeSet<(NodeIndex, &'static str)> {
        let groups = Section::ALL.map(|section| {
            let item = root.get(section.field())?;
            self.map(&item.value, section.field(), "`{ \"name\": \"node.name\", … }`")
        });
        let mut reader = Reader {
            source: self.source,
            graph: &self.out.graph,
            entries,
            types,
            bad: &self.bad,
            problems: &mut self.problems,
            names: BTreeSet::new(),
            taken: BTreeMap::new(),
        };
        let [inputs, parameters] = groups;
        let inputs = inputs.map(|group| reader.inputs(group)).unwrap_or_default();
        let parameters = parameters.map(|group| reader.parameters(group)).unwrap_or_default();
        let named = reader.taken.into_keys().collect();
        (self.out.inputs, self.out.parameters) = (inputs, parameters);
        named
    }
}
