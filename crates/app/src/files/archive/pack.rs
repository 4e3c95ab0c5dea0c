//! Packing an archive.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt, io,
    path::{Component, Path, PathBuf},
    sync::Arc,
};

use flate2::{Compression, GzBuilder};
use orograph_graph::{
    Document, NodeError, ParamValue,
    files::{Access, Part},
    input,
};
use orograph_nodes::{raster, vector};

use super::fault_of;
use crate::report::failure::{Failure, reason, remedy};

/// The folder in the archive for files outside the graph's folder.
const OUTSIDE: &str = "outside";

/// The result of packing.
#[derive(Debug)]
pub struct Packed {
    /// Names in the archive, the graph first.
    pub names: Vec<String>,
    /// Names of files whose path in the archive differs from that on disk.
    pub moved: Vec<(PathBuf, String)>,
    /// Size of the archive in bytes.
    pub bytes: u64,
}

/// The content of an entry.
enum Content {
    /// A graph file, with its file names changed to those in the archive.
    Graph(Arc<Document>),
    /// Any other file, unchanged.
    File,
}

/// Packs a document that was read from a file, with everything it reads. The archive appears whole or not at all.
///
/// Only graphs and rasters are packed, because a graph of somebody else can name any file. `outside` also packs those
/// that are not in the folder of the graph; links are followed before this is judged.
///
/// # Errors
/// When a file cannot be read, is not a graph or a raster, or is not in the folder; when its name is not allowed in an
/// archive, or the archive cannot be written.
pub fn pack(document: &Document, path: &Path, archive: &Path, outside: bool) -> Result<Packed, Failure> {
    let mut packing = Packing::new(path, outside)?;
    let graph = packing.add_outermost(document, path)?;
    packing.follow(document)?;

    let unwritable = |error: &io::Error| {
        Failure::unable(format!("cannot write `{}`: {}", archive.display(), reason(error)))
            .hint(format!("an earlier file is unchanged; {}, or choose another place with `-o`", remedy(error)))
    };
    let part = Part::begin(archive, Access::Usual).map_err(|error| unwritable(&error))?;
    // Without name and time the header is the same for equal contents.
    let mut tar = tar::Builder::new(GzBuilder::new().write(part, Compression::default()));
    let mut names: Vec<&String> = packing.entries.keys().filter(|name| **name != graph).collect();
    names.insert(0, &graph);
    for name in &names {
        packing.write(&mut tar, name, &unwritable)?;
    }
    let written = tar.into_inner().and_then(|gz| gz.finish()).and_then(Part::persist);
    let bytes = written.map_err(|error| unwritable(&error))?;
    let names = names.into_iter().cloned().collect();
    let moved = packing.entries.iter().filter(|(name, _)| name.starts_with(OUTSIDE));
    let moved = moved.filter(|(_, (path, _))| !path.starts_with(&packing.root));
    let moved = moved.map(|(name, (path, _))| (path.clone(), name.clone())).collect();
    Ok(Packed { names, moved, bytes })
}

/// The files of an archive that is being packed.
struct Packing {
    /// True if files outside the root are packed.
    outside: bool,
    /// The folder of the graph, which is the root of the archive.
    root: PathBuf,
    /// By name in the archive: the path on disk, and the content to pack.
    entries: BTreeMap<String, (PathBuf, Content)>,
    /// Names in the archive by path on disk.
    names: BTreeMap<PathBuf, String>,
    /// Names in lower case, because some systems ignore case.
    taken: BTreeSet<String>,
}

impl Packing {
    fn new(graph: &Path, outside: bool) -> Result<Self, Failure> {
        // File names in the graph are relative to the folder in which it was named, even if it is a link.
        let folder = graph.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let root = place_of(folder)?;
        Ok(Self { outside, root, entries: BTreeMap::new(), names: BTreeMap::new(), taken: BTreeSet::new() })
    }

    /// Adds the graph that is packed; returns its name in the archive.
    fn add_outermost(&mut self, document: &Document, path: &Path) -> Result<String, Failure> {
        let name = allowed(path, path.file_name().and_then(|name| name.to_str()).map(str::to_owned))?;
        self.insert(place_of(path)?, name.clone(), Content::Graph(Arc::new(document.clone())));
        Ok(name)
    }

    /// Adds a file that a node reads, once; returns its name in the archive.
    fn add(&mut self, path: &Path, content: Content, reader: &Reader<'_>) -> Result<String, Failure> {
        let place = place_of(path)?;
        if let Some(name) = self.names.get(&place) {
            return Ok(name.clone());
        }
        let wanted = match place.strip_prefix(&self.root) {
            Ok(inside) => joined(inside),
            Err(_) if !self.outside => {
                let message = format!(
                    "`{}` cannot be packed: {reader} reads it, but it is not in the folder of the graph",
                    place.display()
                );
                return Err(Failure::wrong(message).hint(
                    "add `--outside` if everybody who gets the archive may have it, or copy it into the folder",
                ));
            }
            Err(_) => joined(Path::new(place.file_name().unwrap_or_default())).map(|name| format!("{OUTSIDE}/{name}")),
        };
        let name = allowed(path, Some(self.free(allowed(path, wanted)?)))?;
        self.insert(place, name.clone(), content);
        Ok(name)
    }

    fn insert(&mut self, place: PathBuf, name: String, content: Content) {
        self.taken.insert(name.to_lowercase());
        self.names.insert(place.clone(), name.clone());
        self.entries.insert(name, (place, content));
    }

    /// Adds a raster that a node reads, with its side file.
    fn add_raster(&mut self, path: &Path, reader: &Reader<'_>) -> Result<(), Failure> {
        let companion = raster::recognise(path).map_err(|error| {
            let message = format!("`{}` cannot be packed: {}; {reader} reads it", path.display(), error.problem);
            Failure::wrong(message).hint(error.remedy())
        })?;
        let name = self.add(path, Content::File, reader)?;
        let Some(companion) = companion else { return Ok(()) };
        let place = place_of(&companion)?;
        if !self.outside && !place.starts_with(&self.root) {
            // Refuses it, with the reason.
            self.add(&companion, Content::File, reader)?;
        }
        // The side file goes with the file, under its name.
        let name = raster::sidecar_path(Path::new(&name)).to_string_lossy().into_owned();
        let known = self.entries.get(&name).map(|(known, _)| known);
        if known.is_some_and(|known| *known != place) {
            let message = format!("`{}` and another file would both be `{name}`", companion.display());
            return Err(Failure::wrong(message).hint("rename one of them"));
        }
        self.insert(place, allowed(&companion, Some(name))?, Content::File);
        Ok(())
    }

    /// Adds a file with lines that a node reads.
    fn add_lines(&mut self, path: &Path, reader: &Reader<'_>) -> Result<(), Failure> {
        vector::read(path, &reader.document.world()).map_err(|error| {
            let failure = Failure::wrong(format!("`{}` cannot be packed: {error}; {reader} reads it", path.display()));
            match error {
                NodeError::Failed { hint: Some(hint), .. } => failure.hint(hint),
                _ => failure,
            }
        })?;
        self.add(path, Content::File, reader).map(drop)
    }

    /// The name, or a similar one if it or that of its side file is taken.
    fn free(&self, name: String) -> String {
        let taken = |name: &str| self.taken.contains(&name.to_lowercase());
        if !taken(&name) {
            return name;
        }
        let (stem, extension) = match name.rsplit_once('.') {
            Some((stem, extension)) if !extension.contains('/') => (stem.to_owned(), format!(".{extension}")),
            _ => (name, String::new()),
        };
        (2..).map(|n| format!("{stem}-{n}{extension}")).find(|name| !taken(name)).unwrap_or_default()
    }

    /// Adds the files that a document reads.
    fn follow(&mut self, document: &Document) -> Result<(), Failure> {
        let graph = document.graph();
        if let Some(file) = document.world_raster() {
            self.add_raster(&document.folder().join(file), &Reader { node: "world", document })?;
        }
        for index in graph.indices() {
            let instance = graph.instance(index);
            let reader = Reader { node: &instance.name, document };
            let used = document.subgraph(index);
            for (parameter, value) in instance.params.iter() {
                let ParamValue::File(file) = value else { continue };
                let path = document.folder().join(file);
                match used.filter(|_| parameter == "file") {
                    _ if file.is_empty() => {}
                    Some(inner) if !self.names.contains_key(&place_of(&path)?) => {
                        self.add(&path, Content::Graph(Arc::clone(inner)), &reader)?;
                        self.follow(inner)?;
                    }
                    Some(_) => {}
                    None if vector::is_known(&path) => self.add_lines(&path, &reader)?,
                    None => self.add_raster(&path, &reader)?,
                }
            }
        }
        Ok(())
    }

    fn write<W: io::Write>(
        &self,
        tar: &mut tar::Builder<W>,
        name: &str,
        unwritable: &dyn Fn(&io::Error) -> Failure,
    ) -> Result<(), Failure> {
        let Some((place, content)) = self.entries.get(name) else { return Ok(()) };
        let failed =
            |error: io::Error| Failure::unable(format!("cannot pack `{}`: {}", place.display(), reason(&error)));
        let written = match content {
            Content::Graph(document) => {
                let text = self.text(document, name)?;
                entry(tar, name, text.len() as u64, text.as_bytes())
            }
            Content::File => {
                let (file, metadata) = input::open(place).map_err(failed)?;
                entry(tar, name, metadata.len(), file)
            }
        };
        written.map_err(|error| unwritable(&error))?.map_err(failed)
    }

    /// The text of a graph file, with its file names changed to those in the archive.
    fn text(&self, document: &Document, name: &str) -> Result<String, Failure> {
        let folder = Path::new(name).parent().unwrap_or(Path::new(""));
        let renamed = document.with_file_names(&|_, _, file| {
            let target = self.names.get(&place_of(&document.folder().join(file)).ok()?)?;
            let same = normal(&folder.join(file)).is_some_and(|there| there == Path::new(target));
            (!same).then(|| relative(folder, target))
        });
        renamed.map_err(|error| Failure::wrong(error.to_string()))
    }
}

/// A node, or `world`, that reads a file, for messages.
struct Reader<'a> {
    node: &'a str,
    document: &'a Document,
}

impl fmt::Display for Reader<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.document.path().and_then(Path::file_name).unwrap_or_default();
        write!(f, "`{}` in `{}`", self.node, file.to_string_lossy())
    }
}

/// A name in the archive, if archives may have it; `None` is one that is not text.
fn allowed(path: &Path, name: Option<String>) -> Result<String, Failure> {
    let refused = |what: String| {
        Failure::wrong(format!("`{}` cannot be packed: {what}", path.display()))
            .hint("give it and its folders short names of letters, digits, `_` and `-`, without a dot before them")
    };
    let name = name.ok_or_else(|| refused("its name is not valid text".to_owned()))?;
    match fault_of(&name) {
        None => Ok(name),
        Some(fault) => Err(refused(format!("its name in the archive, `{}`, {fault}", name.escape_debug()))),
    }
}

/// The canonical path of a file.
fn place_of(path: &Path) -> Result<PathBuf, Failure> {
    path.canonicalize()
        .map_err(|error| Failure::wrong(format!("`{}` cannot be packed: {}", path.display(), reason(&error))))
}

/// A relative path with `/` between its parts. Returns None when it is not valid text.
fn joined(path: &Path) -> Option<String> {
    let parts: Option<Vec<&str>> = path.components().map(|part| part.as_os_str().to_str()).collect();
    parts.map(|parts| parts.join("/"))
}

/// A relative path without `.` and `..`. Returns None when it leads outside, or is not relative.
fn normal(path: &Path) -> Option<PathBuf> {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::Normal(part) => out.push(part),
            Component::CurDir => {}
            Component::ParentDir if out.pop() => {}
            Component::ParentDir | Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(out)
}

/// The relative path from a folder of the archive to a file of it.
fn relative(folder: &Path, target: &str) -> String {
    let from: Vec<&str> = folder.iter().filter_map(|part| part.to_str()).collect();
    let to: Vec<&str> = target.split('/').collect();
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n("..", from.len() - shared);
    up.chain(to[shared..].iter().copied()).collect::<Vec<_>>().join("/")
}

/// Writes an entry with only a name and content. Returns whether the content could be read.
///
/// # Errors
/// When the archive cannot be written.
fn entry<W: io::Write>(
    tar: &mut tar::Builder<W>,
    name: &str,
    bytes: u64,
    content: impl io::Read,
) -> io::Result<io::Result<()>> {
    let mut header = tar::Header::new_ustar();
    header.set_size(bytes);
    header.set_mode(0o644);
    header.set_mtime(0);
    header.set_uid(0);
    header.set_gid(0);
    header.set_entry_type(tar::EntryType::Regular);
    // A file that has grown since is truncated; one that has shrunk is refused.
    let mut content = Exact { inner: content, left: bytes, error: None };
    let written = tar.append_data(&mut header, name, &mut content);
    if let Some(error) = content.error {
        return Ok(Err(error));
    }
    written?;
    Ok(if content.left > 0 { Err(io::Error::other("it changed while it was being packed")) } else { Ok(()) })
}

/// The first bytes of a source, counted down.
struct Exact<R> {
    inner: R,
    left: u64,
    /// Why it could not be read.
    error: Option<io::Error>,
}

impl<R: io::Read> io::Read for Exact<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let most = usize::try_from(self.left).unwrap_or(usize::MAX).min(to.len());
        let count = match self.inner.read(&mut to[..most]) {
            Err(error) if error.kind() != io::ErrorKind::Interrupted => {
                let kind = error.kind();
                self.error = Some(error);
                return Err(kind.into());
            }
            count => count?,
        };
        self.left -= count as u64;
        Ok(count)
    }
}
