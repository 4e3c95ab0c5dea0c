//! A graph file as a node of another: the declaration of `Subgraph`, how files are found and read, and the inputs,
//! outputs and parameters of a use.
//!
//! A use is a node like any other: its declaration is made from the file. Declarations of nodes are `'static`, so one
//! is leaked for each set of inputs, outputs and parameters that a program meets, a few kilobytes each; a file that
//! changes without changing these leaks nothing more.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use super::{
    Document, LoadError,
    check::args,
    file::read,
    read::{Parsed, Read},
    syntax::{Expr, FIELDS, Group, literal::Literal},
};
use crate::{
    diagnostic::Diagnostic,
    graph::Port,
    job::NodeError,
    node::{Input, Node, Output, OutputType},
    param::{Kind, ParamSpec},
    registry::Registry,
    unit::Unit,
    value::PortType,
};

/// The parameter that names the file.
pub(super) const FILE: &str = "file";

/// Names that every use has, so that a file cannot expose them.
pub(super) const RESERVED: [&str; 3] = [FILE, "seed", "version"];

/// Graph files nested deeper than this are refused.
const MAX_DEPTH: usize = 16;

/// The ending of graph files. Others are not read as a part of a graph.
const ENDING: &str = "ron";

/// The largest number of inputs, parameters and outputs of a graph file that others use.
const MAX_DECLARED: usize = 1000;

/// The largest size of a file including all that it uses, counted once per use.
pub(super) const MAX_SIZE: Size = Size { nodes: 100_000, text: 256 << 20 };

/// A size of graphs, to bound that of the expanded one before it is expanded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Size {
    /// Number of nodes.
    pub(super) nodes: usize,
    /// Bytes of text, which bound the memory of parameters such as strokes.
    pub(super) text: usize,
}

impl Size {
    /// A node, whose text belongs to its file.
    pub(super) const NODE: Self = Self { nodes: 1, text: 0 };

    /// Both together.
    pub(super) const fn with(self, other: Self) -> Self {
        Self { nodes: self.nodes.saturating_add(other.nodes), text: self.text.saturating_add(other.text) }
    }

    /// Returns true if it is larger in nodes or in text.
    pub(super) const fn is_beyond(self, most: Self) -> bool {
        self.nodes > most.nodes || self.text > most.text
    }
}

/// The node of a graph file. It has no kernel: [`Document::expand`] replaces it with the nodes of the file.
pub static SUBGRAPH: Node = DECLARATION;

const DECLARATION: Node = Node {
    id: "Subgraph",
    category: "reuse",
    summary: "A graph file as a node, with the inputs, outputs and parameters that the file declares.",
    doc: "\
The nodes of the file replace this one: they are computed, cached and shared as if they were written here, and a
change of the file recomputes only what depends on it.

- **Inputs and parameters** are those that the file exposes in `inputs` and `parameters`; those left out here have the
  file's values. **Outputs** are those in the file's `outputs`; a wire that names none takes the first.
- **World**: size, cells, boundary, seed and sea level are those of the graph that is built. The file's own `world` is
  used only when the file is built by itself.
- **File names** in the file are relative to the file itself.
- **Recursion**: a file that uses itself, directly or through others, is refused. Files can be nested at most 16 deep.

`orograph check --describe FILE` prints what a file declares. The [page of the graph file](../graph-files.md) describes
how to declare it.",
    params: own_specs,
    cpu: |_| Err(NodeError::failed("a subgraph is built as the nodes of its file, by `Document::expand`")),
    example: "file: \"ridge.ron\", height: \"base\"",
    ..Node::DEFAULT
};

fn own_specs() -> Vec<ParamSpec> {
    vec![
        ParamSpec {
            name: FILE,
            doc: "The graph file, relative to this one.",
            unit: Unit::One,
            kind: Kind::File,
            when: &[],
        },
        ParamSpec {
            name: "seed",
            doc: "Changes every random draw of the file's nodes; 0 leaves their seeds as they are.\n\nThe seed of each \
                  node is combined by xor with a hash of this one.",
            unit: Unit::Count,
            kind: Kind::Seed { default: 0 },
            when: &[],
        },
    ]
}

impl Node {
    /// Returns true if it is a graph file: [`SUBGRAPH`], or a use of it with the declarations of the file.
    #[must_use]
    pub fn is_subgraph(&self) -> bool {
        self.id == SUBGRAPH.id
    }
}

/// The location of a document.
#[derive(Clone, Debug, Default)]
pub(super) struct Home {
    /// Folder that file names are relative to.
    pub(super) folder: PathBuf,
    /// The path; `None` for a text without a file.
    pub(super) path: Option<PathBuf>,
    /// The graph files that it used last.
    pub(super) kept: Kept,
}

impl Home {
    pub(super) fn of_file(path: &Path) -> Self {
        Self {
            folder: path.parent().map(Path::to_owned).unwrap_or_default(),
            path: Some(path.to_owned()),
            ..Self::default()
        }
    }
}

/// A graph file that a document uses.
#[derive(Clone, Debug)]
pub struct UsedGraph {
    /// The file.
    pub path: PathBuf,
    /// Its contents; `None` when it cannot be read.
    pub document: Option<Arc<Document>>,
}

impl UsedGraph {
    /// Identifies a state of the file.
    pub(super) fn content(&self) -> (&Path, Option<*const Document>) {
        (&self.path, self.document.as_ref().map(Arc::as_ptr))
    }
}

/// Why a file cannot be used.
#[derive(Clone, Debug)]
pub(super) struct Unusable {
    pub(super) message: String,
    pub(super) hint: Option<String>,
    /// The document, if it could be read anyway.
    pub(super) document: Option<Arc<Document>>,
}

/// Reads graph files that use each other, each once.
#[derive(Default)]
pub(super) struct Loader {
    /// The files being read, from the outermost: their resolved paths, and the names that were used.
    open: Vec<(PathBuf, PathBuf)>,
    done: BTreeMap<PathBuf, Result<Arc<Document>, Unusable>>,
    kept: Kept,
}

impl Loader {
    pub(super) fn new(home: &Home) -> Self {
        let open = home.path.as_ref().and_then(|path| Some((path.canonicalize().ok()?, path.clone())));
        Self { open: open.into_iter().collect(), done: BTreeMap::new(), kept: home.kept.clone() }
    }

    /// The document of a file, if it has no errors.
    pub(super) fn load(&mut self, path: &Path, registry: &Registry) -> Result<Arc<Document>, Unusable> {
        let unusable = |message: String| Unusable { message, hint: None, document: None };
        let Ok(place) = path.canonicalize() else {
            return Err(unusable(LoadError::Missing(path.to_owned()).to_string()));
        };
        if let Some(first) = self.open.iter().position(|(open, _)| *open == place) {
            let chain = self.open[first..].iter().map(|(_, named)| named.as_path()).chain([path]);
            let chain: Vec<String> = chain.map(|path| path.display().to_string()).collect();
            let message = format!("the file uses itself: {}", chain.join(" → "));
            let hint = Some("a file cannot be a part of itself; move what both need into a third".to_owned());
            return Err(Unusable { hint, ..unusable(message) });
        }
        let too_deep = || unusable(format!("graph files are nested more than {MAX_DEPTH} deep"));
        if self.open.len() > MAX_DEPTH {
            return Err(too_deep());
        }
        if let Some(done) = self.done.get(&place) {
            let document = done.as_ref().map_or_else(|unusable| unusable.document.as_ref(), Some);
            let depth = self.open.len() + document.map_or(0, |document| document.depth());
            return if depth > MAX_DEPTH { Err(too_deep()) } else { done.clone() };
        }
        let is_graph = place.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(ENDING));
        if !is_graph && !place.is_dir() {
            let message = format!("`{}` is not a graph file: the name does not end with `.{ENDING}`", place.display());
            let hint = Some(format!("name a graph file, or give this one a name that ends with `.{ENDING}`"));
            return Err(Unusable { hint, ..unusable(message) });
        }
        let source = read(path).map_err(|error| unusable(error.to_string()))?;
        self.open.push((place.clone(), path.to_owned()));
        let document = match self.kept.find(path).filter(|kept| kept.source() == source) {
            Some(kept) if self.is_sound(&kept, registry) => kept,
            _ => {
                let document = Document::read(source, registry, Home::of_file(path), self);
                self.kept.add(path, document)
            }
        };
        self.open.pop();
        let declared = document.inputs().len() + document.parameters().len() + document.outputs().len();
        let done = if !document.is_graph() {
            let message = format!("`{}` is not a graph file", path.display());
            let hint = Some(format!("`orograph check {}` lists its problems", path.display()));
            Err(Unusable { hint, ..unusable(message) })
        } else if declared > MAX_DECLARED {
            let message = format!(
                "`{}` has {declared} inputs, parameters and outputs; a file that others use can have {MAX_DECLARED}",
                path.display()
            );
            Err(Unusable { hint: Some("remove those that no file uses".to_owned()), ..unusable(message) })
        } else if document.has_errors() {
            let message = format!("`{}` has errors, which must be fixed first", path.display());
            Err(Unusable { message, hint: None, document: Some(document) })
        } else if document.outputs().is_empty() {
            let hint = Some("add `outputs: { \"height\": \"node\" }` to it".to_owned());
            let message = format!("`{}` has no outputs, so nothing could be wired from it", path.display());
            Err(Unusable { message, hint, document: Some(document) })
        } else {
            Ok(document)
        };
        self.done.insert(place, done.clone());
        done
    }

    /// Returns true if a document with an unchanged text is still valid: the files that it names exist, and the graph
    /// files that it uses are the same. A document with an error about a file is read again.
    fn is_sound(&mut self, document: &Document, registry: &Registry) -> bool {
        let same = |loader: &mut Self, used: &UsedGraph| {
            let now = loader.load(&used.path, registry).ok();
            now.is_some_and(|now| used.document.as_ref().is_some_and(|before| Arc::ptr_eq(&now, before)))
        };
        let about_files = |problem: &Diagnostic| matches!(problem.code, "subgraph" | "missing-file");
        !document.problems().iter().any(about_files)
            && document.uses().iter().all(|used| same(self, used))
            && document.files().iter().all(|file| file.is_file())
    }
}

/// Graph files as they were last read, by the paths that refer to them, for a document and its copies.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept(Arc<Mutex<Shelf>>);

#[derive(Debug, Default)]
struct Shelf {
    files: BTreeMap<PathBuf, Arc<Document>>,
    parsed: u64,
}

impl Kept {
    fn shelf(&self) -> MutexGuard<'_, Shelf> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn find(&self, path: &Path) -> Option<Arc<Document>> {
        self.shelf().files.get(path).cloned()
    }

    fn add(&self, path: &Path, document: Document) -> Arc<Document> {
        let document = Arc::new(document);
        let mut shelf = self.shelf();
        shelf.files.insert(path.to_owned(), Arc::clone(&document));
        shelf.parsed += 1;
        document
    }

    /// How often a file was parsed.
    pub(super) fn parsed(&self) -> u64 {
        self.shelf().parsed
    }
}

impl Document {
    /// Reads a source that may be one of several files.
    pub(super) fn read(source: String, registry: &Registry, home: Home, loader: &mut Loader) -> Self {
        let parsed = Arc::new(Parsed::of(&source));
        let read = Read::new(source, parsed, registry, &home, loader, None);
        let history = super::History::default();
        Self { registry: registry.clone(), home, read: Arc::new(read), before: None, history, parsed: 1 }
    }

    /// Its size including that of all files that it uses, counted once per use.
    pub(super) fn size(&self) -> Size {
        self.read.checked.size
    }

    /// How deep the graph files that it uses are nested; 0 without any.
    pub(super) fn depth(&self) -> usize {
        self.read.checked.depth
    }

    /// Returns true if the text has at least one field of a graph file. The text of another file, which a shared graph
    /// may name on purpose, is not quoted in messages.
    fn is_graph(&self) -> bool {
        let group = self.read.parsed.tree.root.as_ref().and_then(Expr::as_group);
        group.is_some_and(|group| group.name.is_none() && FIELDS.iter().any(|field| group.get(field).is_some()))
    }
}

/// The file named in the brackets of a `Subgraph`.
pub(super) fn file_of(group: Option<&Group>, source: &str) -> Option<String> {
    let given = args::args(group?, source);
    given.into_iter().find(|arg| arg.name == FILE).and_then(|arg| match arg.literal {
        Literal::Text(file) if !file.is_empty() => Some(file),
        _ => None,
    })
}

/// The declaration of a use of a file.
pub(super) fn interface(document: &Document) -> &'static Node {
    document.read.declaration.get_or_init(|| declare(document))
}

fn declare(document: &Document) -> &'static Node {
    let inputs: Vec<Input> = document
        .inputs()
        .iter()
        .map(|input| Input {
            name: leaked(&input.name),
            ty: input.ty,
            fallback: input.fallback,
            doc: leaked(&input.doc),
        })
        .collect();
    let outputs: Vec<Output> = document
        .outputs()
        .iter()
        .map(|output| {
            let graph = document.graph();
            let doc = graph.instance(output.port.node).node.outputs[output.port.output].doc;
            let ty = match open_input(document, output.port) {
                Some(input) => OutputType::SameAs(leaked(input)),
                None => OutputType::Fixed(output.ty),
            };
            Output { name: leaked(&output.name), ty, doc }
        })
        .collect();
    let named = document.parameters().iter().map(|parameter| ParamSpec {
        name: leaked(&parameter.name),
        doc: leaked(&parameter.doc),
        unit: parameter.unit,
        kind: parameter.kind.clone(),
        when: &[],
    });
    let declared: Vec<ParamSpec> = own_specs().into_iter().chain(named).collect();

    static KNOWN: Mutex<BTreeMap<String, &'static Node>> = Mutex::new(BTreeMap::new());
    let key = format!("{inputs:?} {outputs:?} {declared:?}");
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_insert_with(|| {
        Box::leak(Box::new(Node {
            inputs: inputs.leak(),
            outputs: outputs.leak(),
            declared: declared.leak(),
            ..DECLARATION
        }))
    })
}

/// The named input that determines an output's type, if the input accepts any numbers and the file wires nothing to it.
fn open_input(document: &Document, output: Port) -> Option<&str> {
    let graph = document.graph();
    let mut port = output;
    loop {
        let node = graph.instance(port.node).node;
        let OutputType::SameAs(input) = node.outputs[port.output].ty else { return None };
        let mut named = document.inputs().iter().filter(|named| named.ty == PortType::AnyScalar);
        if let Some(named) = named.find(|named| named.places.iter().any(|p| p.node == port.node && p.name == input)) {
            return Some(&named.name);
        }
        let position = node.inputs.iter().position(|declared| declared.name == input)?;
        port = graph.source(port.node, position)?;
    }
}

/// Leaks a text; equal texts are leaked once.
fn leaked(text: &str) -> &'static str {
    static KNOWN: Mutex<std::collections::BTreeSet<&'static str>> = Mutex::new(std::collections::BTreeSet::new());
    let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
    known.get(text).copied().unwrap_or_else(|| {
        let text: &'static str = Box::leak(text.to_owned().into_boxed_str());
        known.insert(text);
        text
    })
}
