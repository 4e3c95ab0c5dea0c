//! The nodes of a file: their kinds, versions, parameters and required inputs.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
    sync::Arc,
};

use petgraph::stable_graph::NodeIndex;

use super::{
    Checker, NodeEntry,
    args::{self, Arg},
    problems::list,
    sea,
    wires::Pending,
};
use crate::{
    closest,
    diagnostic::Diagnostic,
    document::{
        subgraph::{self, Size, UsedGraph},
        syntax::{
            Group, Item,
            literal::{Misfit, constant, is_name, param},
        },
    },
    graph::Instance,
    migrate::Step,
    node::Node,
    param::{Kind, ParamSpec, ParamValue},
    world::bytes,
};

/// The longest name of a node in bytes. A use of a file puts its own name before those of all nodes of the file.
const MAX_NAME: usize = 200;

impl Checker<'_> {
    pub(super) fn nodes(&mut self, group: &Group) -> Vec<Pending> {
        let mut pending = Vec::new();
        self.out.size.text = self.source.len();
        let mut nodes = self.problems.duplicates(group, "in `nodes`");
        let most = subgraph::MAX_SIZE.nodes;
        if nodes.len() > most {
            let place = group.open..group.open + 1;
            let message = format!("the file has {} nodes, but a graph can have at most {most}", nodes.len());
            self.problems.push(Diagnostic::error("too-large", place, message));
            nodes.truncate(most);
        }
        for (name, item) in nodes {
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
            } else if name.len() > MAX_NAME {
                let message =
                    format!("the name of a node has {} bytes, but it can have at most {MAX_NAME}", name.len());
                let place = item.key.as_ref().map_or_else(|| item.span(), |key| key.span.clone());
                self.problems.push(Diagnostic::error("name", place, message).hint("give it a shorter name"));
            } else if let Some(node) = self.known_kind(&entry)
                && let Some(version) = self.known_version(node, &entry, body)
            {
                entry.index = if node.is_subgraph() {
                    self.subgraph(version, &entry, body, &mut pending)
                } else {
                    self.node(node, version, &entry, body, &mut pending)
                };
                if entry.index.is_some() {
                    self.out.size = self.out.size.with(Size::NODE);
                }
            }
            self.out.by_name.insert(entry.name.clone(), self.out.nodes.len());
            self.out.nodes.push(entry);
        }
        self.check_size();
        pending
    }

    /// Reports that the graph is too large with the files that it uses, which were only counted.
    fn check_size(&mut self) {
        let Some(place) = self.beyond.take() else { return };
        let Size { nodes, text } = self.out.size;
        let too_many = nodes > subgraph::MAX_SIZE.nodes;
        let shown = |size: Size| match too_many {
            true => format!("{} nodes", size.nodes),
            false => format!("{} of text", bytes(size.text as u64)),
        };
        let message = format!(
            "with the files that it uses, the graph has {}, but a graph can have at most {}",
            shown(Size { nodes, text }),
            shown(subgraph::MAX_SIZE)
        );
        let problem = Diagnostic::error("too-large", place, message);
        let mut uses: BTreeMap<&Path, (usize, Size)> = BTreeMap::new();
        for used in &self.out.uses {
            if let Some(inner) = used.document.as_deref().filter(|inner| !inner.has_errors()) {
                uses.entry(&used.path).or_insert((0, inner.size())).0 += 1;
            }
        }
        let weight = |size: Size| if too_many { size.nodes } else { size.text };
        let largest = uses.into_iter().max_by_key(|(_, (times, size))| times.saturating_mul(weight(*size)));
        self.problems.push(match largest.map(|(path, (times, size))| (path.display(), times, shown(size))) {
            Some((path, 1, of)) => problem.hint(format!("`{path}` has {of}; use less of it")),
            Some((path, times, of)) => {
                problem.hint(format!("`{path}` has {of} and is used {times} times; use it less often"))
            }
            None => problem,
        });
    }

    pub(super) fn check_name(&mut self, name: &str, item: &Item, what: &str) {
        if let Some(key) = &item.key
            && !is_name(name)
            && !self.problems.has_syntax_in(&key.span)
        {
            let problem =
                Diagnostic::error("name", key.span.clone(), format!("`{}` cannot name {what}", name.escape_debug()));
            self.problems.push(problem.hint("a name is a letter or `_`, then letters, digits, `_` and `-`"));
        }
    }

    fn known_kind(&mut self, entry: &NodeEntry) -> Option<&'static Node> {
        let node = self.registry.get(&entry.kind);
        if node.is_none() {
            let message = format!("unknown node `{}`", entry.kind);
            let problem = Diagnostic::error("unknown-node", entry.kind_span.clone(), message);
            if self.problems.has_enough() {
                self.problems.push(problem);
                return None;
            }
            self.problems.push(match self.registry.suggest(&entry.kind) {
                Some(near) => problem.hint(format!("did you mean `{near}`?")),
                None => problem.hint("`orograph nodes` lists all nodes"),
            });
        }
        node
    }

    fn known_version(&mut self, node: &Node, entry: &NodeEntry, body: Option<&Group>) -> Option<u32> {
        let is_given = |name: &str| body.is_some_and(|group| group.get(name).is_some());
        let mut steps = node.migrations.iter().flat_map(|migration| migration.steps);
        let differs = steps.any(|step| matches!(step, Step::Keep { name, .. } if !is_given(name)));
        if differs && !is_given("version") {
            self.warn_of_first_version(node, entry);
        }
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

    /// Warns that a node without a version has the defaults of the first one, and not those of the manual.
    fn warn_of_first_version(&mut self, node: &Node, entry: &NodeEntry) {
        let (name, id, newest) = (&entry.name, node.id, node.version);
        let message =
            format!("`{name}` has no `version`, which means version 1 of `{id}`, with other defaults than today");
        let hint =
            format!("write `{id}(version: {newest}, …)` for the present defaults, or `version: 1` to keep the first");
        self.problems.push(Diagnostic::warning("no-version", entry.kind_span.clone(), message).hint(hint));
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
            Ok(inner) if self.out.size.with(inner.size()).with(Size::NODE).is_beyond(subgraph::MAX_SIZE) => {
                self.out.size = self.out.size.with(inner.size()).with(Size::NODE);
                self.out.uses.push(UsedGraph { path, document: Some(inner) });
                self.beyond.get_or_insert(span);
                None
            }
            Ok(inner) => {
                self.out.depth = self.out.depth.max(inner.depth() + 1);
                self.out.uses.push(UsedGraph { path, document: Some(Arc::clone(&inner)) });
                let index = self.node(subgraph::interface(&inner), version, entry, body, pending)?;
                if let Some(level) = inner.read.checked.sea {
                    self.seas.push(sea::Own { node: entry.name.clone(), span, level });
                }
                self.out.size = self.out.size.with(inner.size());
                self.out.subgraphs.insert(index, inner);
                Some(index)
            }
            Err(unusable) => {
                let mut problem = Diagnostic::error("subgraph", span, unusable.message);
                problem.hint = unusable.hint;
                self.problems.push(problem);
                self.out.depth = self.out.depth.max(unusable.document.as_ref().map_or(0, |inner| inner.depth() + 1));
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
            let what = match path.metadata().map(|metadata| metadata.is_dir()) {
                Ok(true) => "but that is a folder",
                Ok(false) => "but that is a pipe, a device or a socket, not a regular file",
                Err(_) => "but there is no such file",
            };
            let message = format!("`{}.{}` names `{}`, {what}", entry.name, arg.name, path.display());
            let problem = Diagnostic::error("missing-file", arg.span.clone(), message);
            self.problems.push(problem.hint("file names are relative to the folder of the graph file"));
        }
    }

    /// The specifications of a kind, made once for all of its nodes. Each file that is used has its own.
    fn specs(&mut self, node: &'static Node) -> Arc<[ParamSpec]> {
        if node.is_subgraph() {
            return node.specs().into();
        }
        Arc::clone(self.specs.entry(node.id).or_insert_with(|| node.specs().into()))
    }

    fn node(
        &mut self,
        node: &'static Node,
        version: u32,
        entry: &NodeEntry,
        body: Option<&Group>,
        pending: &mut Vec<Pending>,
    ) -> Option<NodeIndex> {
        let specs = self.specs(node);
        let mut instance = Instance::with(&entry.name, node, &specs);
        let mut given = Vec::new();
        if let Some(group) = body {
            self.problems.duplicates(group, format_args!("in `{}`", entry.name));
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
                        // The value may be wrong, but the input is not missing.
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
            } else if let Some(meant) = self.unknown_arg(node, &specs, entry, arg) {
                // The input that was probably meant is not missing either.
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
    fn unknown_arg(&mut self, node: &Node, specs: &[ParamSpec], entry: &NodeEntry, arg: &Arg) -> Option<usize> {
        let names = || node.inputs.iter().map(|input| input.name).chain(specs.iter().map(|spec| spec.name));
        let message = format!("`{}` ({}) has no input or parameter `{}`", entry.name, node.id, arg.name);
        let problem = Diagnostic::error("unknown-parameter", arg.name_span.clone(), message);
        if let Some(hint) = sea::moved_hint(node, &arg.name) {
            self.problems.push(problem.hint(hint));
            return None;
        }
        if self.problems.has_enough() {
            self.problems.push(problem);
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
    pub(super) fn unwired(
        &mut self,
        wired: &BTreeSet<(NodeIndex, usize)>,
        named: &BTreeSet<(NodeIndex, &'static str)>,
    ) {
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
                    format!("nothing is wired into `{}.{input}`, so only another graph can use this file", entry.name);
                let problem = Diagnostic::warning("open-input", entry.kind_span.clone(), message);
                self.problems.push(problem.hint("wire a fallback to it, used when the file is built by itself"));
                continue;
            }
            let message = format!("`{}` ({}) needs a wire into `{input}`", entry.name, node.id);
            let problem = Diagnostic::error("unwired", entry.kind_span.clone(), message);
            let hint =
                format!("write `{input}: \"…\"` with the name of a node that gives {}", node.inputs[position].ty.one());
            self.problems.push(problem.hint(hint));
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
