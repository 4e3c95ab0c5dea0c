//! From a syntax tree to a graph: finds every problem of the file, and keeps the valid part.

pub(crate) mod args;
pub(crate) mod canvas;
pub(crate) mod exposed;
pub(crate) mod frames;
pub(crate) mod muted;
pub(crate) mod problems;
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
    args::Arg,
    canvas::Reroute,
    exposed::{NamedInput, NamedParameter, Reader, Section},
    frames::FrameEntry,
    muted::Muted,
    problems::{Problems, list},
    wires::{LooseWire, Pending},
};
use super::{
    subgraph::{self, Home, Loader, UsedGraph},
    syntax::{
        Expr, FIELDS, Group, Item, Tree,
        literal::{Literal, Misfit, constant, is_name, param},
    },
};
use crate::{
    Document, closest,
    diagnostic::Diagnostic,
    graph::{Graph, Instance, Port},
    node::Node,
    param::{Kind, ParamValue},
    registry::Registry,
    value::PortType,
    world::World,
};

/// The newest version of the file format that this program reads.
pub(super) const FORMAT: i64 = 1;

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
    /// True if it is muted: built as if it were not there.
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
    /// The sea level that the file assumes when another file uses it, if any.
    pub(super) sea: Option<Option<f64>>,
    pub(super) nodes: Vec<NodeEntry>,
    /// Positions in `nodes`.
    pub(super) by_name: HashMap<String, usize>,
    pub(super) outputs: Vec<OutputDecl>,
    pub(super) parameters: Vec<NamedParameter>,
    pub(super) inputs: Vec<NamedInput>,
    pub(super) uses: Vec<UsedGraph>,
    pub(super) muted: Muted,
    pub(super) frames: Vec<FrameEntry>,
    pub(super) reroutes: Vec<Reroute>,
    pub(super) loose: Vec<LooseWire>,
    pub(super) subgraphs: BTreeMap<NodeIndex, Arc<Document>>,
    /// Number of nodes including those of all files that it uses, counted once per use.
    pub(super) size: usize,
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
            let mut checker = Checker { source, registry, home, loader, problems, out, bad, seas };
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
}

impl Checker<'_> {
    fn file(&mut self, root: &Group) {
        self.problems.names(root, "a graph file", &FIELDS);
        if let Some(item) = root.get("world") {
            self.out.world = world::read(&item.value, self.source, &mut self.problems);
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
        let types =
            wires::connect(Arc::make_mut(&mut self.out.graph), pending, &entries, &self.bad, &mut self.problems);
        self.out.graph.find_types();
        let named = self.exposed(root, &entries, &types);
        self.unwired(&wired, &named);
        self.outputs(root, &entries, &types);
        if let Some(item) = root.get("muted") {
            let (muted, names) = muted::read(&item.value, self.source, &entries, &mut self.problems);
            for entry in &mut self.out.nodes {
                entry.muted = names.contains(&entry.name);
            }
            let outputs: Vec<_> = self.out.outputs.iter().map(|output| (output.name.clone(), output.port)).collect();
            muted::check(&self.out.graph, &muted, &self.out.nodes, &outputs, &mut self.problems);
            self.out.muted = muted;
        }
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

    fn nodes(&mut self, group: &Group) -> Vec<Pending> {
        let mut pending = Vec::new();
        for (name, item) in self.problems.duplicates(group, "in `nodes`") {
            self.check_name(name, item, "a node");
            let (kind_span, body) = args::kind_of(&item.value).unwrap_or((item.value.span.clone(), None));
            let is_node = args::kind_of(&item.value).is_some();
            let kind = if is_node { self.source[kind_span.clone()].to_owned() } else { String::new() };
            let mut entry = NodeEntry {
                name: name.to_owned(),
                kind,
                index: None,
                span: item.span(),
                kind_span,
                layout: None,
                note: String::new(),
                muted: false,
            };
            if !is_node {
                self.problems.misplaced(&item.value, name, "a node such as `Perlin(…)`", self.source);
            } else if let Some(node) = self.known_kind(&entry)
                && let Some(version) = self.known_version(node, &entry, body)
            {
                entry.index = if node.is_subgraph() {
                    self.subgraph(version, &entry, body, &mut pending)
                } else {
                    self.node(node, version, &entry, body, &mut pending)
                };
                self.out.size += usize::from(entry.index.is_some());
            }
            self.out.by_name.insert(entry.name.clone(), self.out.nodes.len());
            self.out.nodes.push(entry);
        }
        pending
    }

    fn check_name(&mut self, name: &str, item: &Item, what: &str) {
        if let Some(key) = &item.key
            && !is_name(name)
            && !self.problems.has_syntax_in(&key.span)
        {
            let problem =
                Diagnostic::error("name", key.span.clone(), format!("`{}` cannot name {what}", name.escape_debug()));
            self.problems.push(problem.hint("a name is a letter, then letters, digits, `_` and `-`"));
        }
    }

    fn known_kind(&mut self, entry: &NodeEntry) -> Option<&'static Node> {
        let node = self.registry.get(&entry.kind);
        if node.is_none() {
            let message = format!("unknown node `{}`", entry.kind);
            let problem = Diagnostic::error("unknown-node", entry.kind_span.clone(), message);
            self.problems.push(match self.registry.suggest(&entry.kind) {
                Some(near) => problem.hint(format!("did you mean `{near}`?")),
                None => problem.hint("`orograph nodes` lists all nodes"),
            });
        }
        node
    }

    fn known_version(&mut self, node: &Node, entry: &NodeEntry, body: Option<&Group>) -> Option<u32> {
        let Some(group) = body else { return Some(1) };
        let version = args::version(group, self.source);
        if version.is_some_and(|version| version <= node.version) {
            return version;
        }
        let span = group.get("version").map_or_else(|| entry.kind_span.clone(), |item| item.value.span.clone());
        let (message, hint) = match version {
            Some(version) => (
                format!(
                    "`{}` ({}) has version {version}, but this program supports versions up to {}",
                    entry.name, node.id, node.version
                ),
                "update the program",
            ),
            None => {
                (format!("the version of `{}` is not a whole number of at least 1", entry.name), "write `version: 1`")
            }
        };
        if !self.problems.has_syntax_in(&span) {
            self.problems.push(Diagnostic::error("version", span, message).hint(hint));
        }
        None
    }

    /// A use of a graph file: a node with the ports and parameters that the file declares, or a placeholder if the file
    /// cannot be used.
    fn subgraph(
        &mut self,
        version: u32,
        entry: &NodeEntry,
        body: Option<&Group>,
        pending: &mut Vec<Pending>,
    ) -> Option<NodeIndex> {
        let item = body.and_then(|group| group.get(subgraph::FILE));
        let span = item.map_or_else(|| entry.kind_span.clone(), |item| item.value.span.clone());
        let Some(file) = subgraph::file_of(body, self.source) else {
            if !self.problems.has_syntax_in(&entry.span) {
                let problem =
                    Diagnostic::error("no-file", span, format!("`{}` does not name a graph file", entry.name));
                self.problems.push(problem.hint("write `file: \"ridge.ron\"`, relative to this file"));
            }
            return None;
        };
        let path = self.home.folder.join(file);
        match self.loader.load(&path, self.registry) {
            Ok(inner) if self.out.size.saturating_add(inner.size()) > subgraph::MAX_NODES => {
                let most = subgraph::MAX_NODES;
                let message = format!("with `{}` the graph has more than {most} nodes", path.display());
                self.problems.push(Diagnostic::error("subgraph", span, message));
                None
            }
            Ok(inner) => {
                self.out.uses.push(UsedGraph { path, document: Some(Arc::clone(&inner)) });
                let index = self.node(subgraph::interface(&inner), version, entry, body, pending)?;
                if let Some(level) = inner.read.checked.sea {
                    self.seas.push(sea::Own { node: entry.name.clone(), span, level });
                }
                self.out.size += inner.size();
                self.out.subgraphs.insert(index, inner);
                Some(index)
            }
            Err(unusable) => {
                let mut problem = Diagnostic::error("subgraph", span, unusable.message);
                problem.hint = unusable.hint;
                self.problems.push(problem);
                self.out.uses.push(UsedGraph { path, document: unusable.document });
                None
            }
        }
    }

    /// Reports a missing file. Only a document with a path can tell where its files are.
    fn check_file(&mut self, node: &Node, entry: &NodeEntry, arg: &Arg, value: &ParamValue) {
        if let ParamValue::File(file) = value
            && !file.is_empty()
            && self.home.path.is_some()
            && !node.is_subgraph()
            && !self.home.folder.join(file).is_file()
        {
            let path = self.home.folder.join(file);
            let message =
                format!("`{}.{}` names `{}`, but there is no such file", entry.name, arg.name, path.display());
            let problem = Diagnostic::error("missing-file", arg.span.clone(), message);
            self.problems.push(problem.hint("file names are relative to the folder of the graph file"));
        }
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

    fn node(
        &mut self,
        node: &'static Node,
        version: u32,
        entry: &NodeEntry,
        body: Option<&Group>,
        pending: &mut Vec<Pending>,
    ) -> Option<NodeIndex> {
        let specs = node.specs();
        let mut instance = Instance::with(&entry.name, node, &specs);
        let mut given = Vec::new();
        if let Some(group) = body {
            self.problems.duplicates(group, &format!("in `{}`", entry.name));
            given = args::args(group, self.source);
        }
        let moved = args::migrate(&mut given, node, version, &entry.kind_span);
        match sea::of_node(node, &entry.name, &entry.kind_span, moved.as_ref()) {
            Ok(own) => self.seas.extend(own),
            Err(misfit) => {
                if let Some(moved) = &moved {
                    self.problems.take(owned(Err::<(), _>(misfit), entry), &moved.literal, &moved.span, |()| {});
                }
            }
        }
        let mut sound = true;
        let mut wires = Vec::new();
        for arg in &given {
            if let Some(position) = node.inputs.iter().position(|input| input.name == arg.name) {
                match arg.literal.as_wire() {
                    Some(end) => wires.push((position, Some(end.to_owned()), arg.span.clone())),
                    None => {
                        let value = constant(&node.inputs[position], &arg.literal);
                        let constants = &mut instance.constants;
                        self.problems.take(owned(value, entry), &arg.literal, &arg.span, |value| {
                            constants[position] = Some(value);
                        });
                        // Even if the value is wrong, the input was not forgotten.
                        wires.push((position, None, arg.span.clone()));
                    }
                }
            } else if let Some(spec) = specs.iter().find(|spec| spec.name == arg.name) {
                let value = owned(param(spec, &arg.literal), entry);
                if let (Kind::File, Ok(file)) = (&spec.kind, &value) {
                    self.check_file(node, entry, arg, file);
                }
                let params = &mut instance.params;
                sound &= self.problems.take(value, &arg.literal, &arg.span, |value| params.set(spec.name, value));
            } else if let Some(meant) = self.unknown_arg(node, entry, arg) {
                // The input that was probably meant was not forgotten either.
                wires.push((meant, None, arg.span.clone()));
            }
        }
        // The name is new: entries with a duplicate name were dropped before.
        let index = Arc::make_mut(&mut self.out.graph).add(instance).ok()?;
        if !sound {
            self.bad.insert(index);
        }
        pending.extend(wires.into_iter().map(|(input, end, span)| Pending { node: index, input, end, span }));
        Some(index)
    }

    /// Reports a name that the node does not have; returns the input that was probably meant.
    fn unknown_arg(&mut self, node: &Node, entry: &NodeEntry, arg: &Arg) -> Option<usize> {
        let specs = node.specs();
        let names = || node.inputs.iter().map(|input| input.name).chain(specs.iter().map(|spec| spec.name));
        let message = format!("`{}` ({}) has no input or parameter `{}`", entry.name, node.id, arg.name);
        let problem = Diagnostic::error("unknown-parameter", arg.name_span.clone(), message);
        if let Some(hint) = sea::moved_hint(node, &arg.name) {
            self.problems.push(problem.hint(hint));
            return None;
        }
        let near = closest(&arg.name, names());
        self.problems.push(match near {
            Some(near) => problem.hint(format!("did you mean `{near}`?")),
            None => problem.hint(format!("it has {}", list(names()))),
        });
        node.inputs.iter().position(|input| Some(input.name) == near)
    }

    /// Reports required inputs without a wire. An exposed input may be wired from outside.
    fn unwired(&mut self, wired: &BTreeSet<(NodeIndex, usize)>, named: &BTreeSet<(NodeIndex, &'static str)>) {
        let entries: BTreeMap<NodeIndex, usize> =
            self.out.nodes.iter().enumerate().filter_map(|(i, entry)| Some((entry.index?, i))).collect();
        for (index, position) in self.out.graph.unwired() {
            let Some(entry) = entries.get(&index).map(|i| &self.out.nodes[*i]) else { continue };
            if wired.contains(&(index, position)) || self.problems.has_syntax_in(&entry.span) {
                continue;
            }
            let node = self.out.graph.instance(index).node;
            let input = node.inputs[position].name;
            if named.contains(&(index, input)) {
                let message =
                    format!("nothing is wired into `{}.{input}` , so only another graph can use this file", entry.name);
                let problem = Diagnostic::warning("open-input", entry.kind_span.clone(), message);
                self.problems.push(problem.hint("wire a fallback to it, used when the file is built by itself"));
                continue;
            }
            let message = format!("`{}` ({}) needs a wire into `{input}`", entry.name, node.id);
            let problem = Diagnostic::error("unwired", entry.kind_span.clone(), message);
            let hint =
                format!("write `{input}: \"…\"` with the name of a node that gives a {}", node.inputs[position].ty);
            self.problems.push(problem.hint(hint));
        }
    }

    fn outputs(
        &mut self,
        root: &Group,
        entries: &BTreeMap<String, Option<NodeIndex>>,
        types: &BTreeMap<Port, PortType>,
    ) {
        let group = match root.get("outputs") {
            Some(item) => match self.map(&item.value, "outputs", "`{ \"name\": \"node.port\", … }`") {
                Some(group) => group,
                None => return,
            },
            None => root,
        };
        if group.items.is_empty() || std::ptr::eq(group, root) {
            if self.problems.has_syntax_in(&(0..self.source.len())) {
                return;
            }
            let place = group.open..group.open + 1;
            let problem = Diagnostic::warning("no-outputs", place, "the file has no outputs, so a run writes nothing");
            self.problems.push(problem.hint("write `outputs: { \"height\": \"node\" }`"));
            return;
        }
        for (name, item) in self.problems.duplicates(group, "in `outputs`") {
            self.check_name(name, item, "an output");
            let literal = Literal::read(&item.value, self.source);
            let span = &item.value.span;
            let Some(end) = literal.as_wire() else {
                let takes = "a node, or one of its outputs, in quotes";
                self.problems.misplaced(&item.value, name, takes, self.source);
                continue;
            };
            let what = format!("output `{name}`");
            if let Some(port) = wires::resolve(&self.out.graph, end, &what, span, entries, &mut self.problems) {
                // An unknown type is treated as a height, as in the graph.
                let ty = types.get(&port).copied().unwrap_or(PortType::Height);
                if !ty.is_writable() {
                    let message = format!("output `{name}` is a {ty}, which cannot be written to a file");
                    let problem = Diagnostic::error("not-writable", span.clone(), message);
                    let hint = self.writable(port, types);
                    self.problems.push(problem.hint(hint));
                }
                self.out.outputs.push(OutputDecl {
                    name: name.to_owned(),
                    port,
                    ty,
                    layers: [true; 4],
                    span: item.span(),
                });
            }
        }
    }

    /// Advice on what to write instead of an output that cannot be written.
    fn writable(&self, port: Port, types: &BTreeMap<Port, PortType>) -> String {
        let outputs = 0..self.out.graph.instance(port.node).node.outputs.len();
        let ports = outputs.map(|output| Port { node: port.node, output });
        let names: Vec<String> = ports
            .filter(|port| types.get(port).is_some_and(|ty| ty.is_writable()))
            .map(|port| format!("`{}`", self.out.graph.port_name(port)))
            .collect();
        match names.split_last() {
            Some((last, [])) => format!("write {last}"),
            Some((last, rest)) => format!("write {} or {last}", rest.join(", ")),
            None => "wire it to a node, and write what that gives".to_owned(),
        }
    }
}

/// Names the node in the message of a misfit: `` `rivers.m` is … ``.
fn owned<T>(result: Result<T, Misfit>, entry: &NodeEntry) -> Result<T, Misfit> {
    result.map_err(|misfit| {
        let message = match misfit.message.strip_prefix('`') {
            Some(rest) => format!("`{}.{rest}", entry.name),
            None => format!("`{}`: {}", entry.name, misfit.message),
        };
        Misfit { message, ..misfit }
    })
}
