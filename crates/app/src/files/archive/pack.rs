//! Packing an archive.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File},
    io::{self, Write as _},
    path::{Component, Path, PathBuf},
    sync::Arc,
};

use flate2::{Compression, GzBuilder};
use orograph_graph::{Document, ParamValue};
use orograph_nodes::raster;

use super::fault_of;
use crate::report::failure::{Failure, reason};

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
/// # Errors
/// When a file cannot be read, its name is not allowed in an archive, or the archive cannot be written.
pub fn pack(document: &Document, path: &Path, archive: &Path) -> Result<Packed, Failure> {
    let mut packing = Packing::new(path)?;
    let graph = packing.add(path, Content::Graph(Arc::new(document.clone())))?;
    packing.follow(document)?;

    let unwritable =
        |error: &io::Error| Failure::unable(format!("cannot write `{}`: {}", archive.display(), reason(error)));
    let folder = archive.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".orograph-").suffix(".tmp");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(|error| unwritable(&error))?;
    // Without name and time the header is the same for equal contents.
    let mut tar = tar::Builder::new(GzBuilder::new().write(file, Compression::default()));
    let mut names: Vec<&String> = packing.entries.keys().filter(|name| **name != graph).collect();
    names.insert(0, &graph);
    for name in &names {
        packing.write(&mut tar, name)?;
    }
    let file = tar.into_inner().and_then(|gz| gz.finish()).and_then(|mut file| {
        file.flush()?;
        Ok(file)
    });
    let file = file.map_err(|error| unwritable(&error))?.persist(archive).map_err(|error| unwritable(&error.error))?;
    let bytes = file.metadata().map_err(|error| unwritable(&error))?.len();
    let names = names.into_iter().cloned().collect();
    let moved = packing.entries.iter().filter(|(name, _)| name.starts_with(OUTSIDE));
    let moved = moved.filter(|(_, (path, _))| !path.starts_with(&packing.root));
    let moved = moved.map(|(name, (path, _))| (path.clone(), name.clone())).collect();
    Ok(Packed { names, moved, bytes })
}

/// The files of an archive that is being packed.
struct Packing {
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
    fn new(graph: &Path) -> Result<Self, Failure> {
        let place = place_of(graph)?;
        let root = place.parent().map(Path::to_owned).unwrap_or_default();
        Ok(Self { root, entries: BTreeMap::new(), names: BTreeMap::new(), taken: BTreeSet::new() })
    }

    /// Adds a file, once; returns its name in the archive.
    fn add(&mut self, path: &Path, content: Content) -> Result<String, Failure> {
        let place = place_of(path)?;
        if let Some(name) = self.names.get(&place) {
            return Ok(name.clone());
        }
        let wanted = match place.strip_prefix(&self.root) {
            Ok(inside) => joined(inside),
            Err(_) => joined(Path::new(place.file_name().unwrap_or_default())).map(|name| format!("{OUTSIDE}/{name}")),
        };
        let fault = wanted.as_deref().map_or(Some("is not valid text"), fault_of);
        if let Some(fault) = fault {
            return Err(Failure::wrong(format!("`{}` cannot be packed: its name {fault}", path.display()))
                .hint("give the file a name of letters, digits, `_` and `-`"));
        }
        let name = self.free(wanted.unwrap_or_default());
        self.taken.insert(name.to_lowercase());
        self.names.insert(place.clone(), name.clone());
        self.entries.insert(name.clone(), (place, content));
        Ok(name)
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
        for used in document.uses() {
            let Some(inner) = &used.document else { continue };
            if !self.names.contains_key(&place_of(&used.path)?) {
                self.add(&used.path, Content::Graph(Arc::clone(inner)))?;
                self.follow(inner)?;
            }
        }
        let graph = document.graph();
        let values = graph.indices().flat_map(|node| graph.instance(node).params.iter().map(|(_, value)| value));
        for value in values {
            let ParamValue::File(file) = value else { continue };
            if file.is_empty() {
                continue;
            }
            let path = document.folder().join(file);
            let name = self.add(&path, Content::File)?;
            // The side file goes with the file, under its name.
            let companion = raster::sidecar_path(&path);
            if companion.is_file() {
                let (place, name) = (place_of(&companion)?, format!("{name}.json"));
                let known = self.entries.get(&name).map(|(known, _)| known);
                if known.is_some_and(|known| *known != place) {
                    let message = format!("`{}` and another file would both be `{name}`", companion.display());
                    return Err(Failure::wrong(message).hint("rename one of them"));
                }
                self.names.insert(place.clone(), name.clone());
                self.taken.insert(name.to_lowercase());
                self.entries.insert(name, (place, Content::File));
            }
        }
        Ok(())
    }

    fn write<W: io::Write>(&self, tar: &mut tar::Builder<W>, name: &str) -> Result<(), Failure> {
        let Some((place, content)) = self.entries.get(name) else { return Ok(()) };
        let failed =
            |error: io::Error| Failure::unable(format!("cannot pack `{}`: {}", place.display(), reason(&error)));
        match content {
            Content::Graph(document) => {
                let text = self.text(document, name)?;
                entry(tar, name, text.len() as u64, text.as_bytes()).map_err(failed)
            }
            Content::File => {
                let file = File::open(place).map_err(failed)?;
                let bytes = file.metadata().map_err(failed)?.len();
                entry(tar, name, bytes, file).map_err(failed)
            }
        }
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

/// Writes an entry with only a name and content.
fn entry<W: io::Write>(tar: &mut tar::Builder<W>, name: &str, bytes: u64, content: impl io::Read) -> io::Result<()> {
    let mut header = tar::Header::new_ustar();
    header.set_size(bytes);
    header.set_mode(0o644);
    header.set_mtime(0);
    header.set_uid(0);
    header.set_gid(0);
    header.set_entry_type(tar::EntryType::Regular);
    // A file that has grown since is truncated; one that has shrunk is refused.
    let mut content = Exact { inner: content, left: bytes };
    tar.append_data(&mut header, name, &mut content)?;
    if content.left > 0 { Err(io::Error::other("it changed while it was being packed")) } else { Ok(()) }
}

/// The first bytes of a source, counted down.
struct Exact<R> {
    inner: R,
    left: u64,
}

impl<R: io::Read> io::Read for Exact<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let most = usize::try_from(self.left).unwrap_or(usize::MAX).min(to.len());
        let count = self.inner.read(&mut to[..most])?;
        self.left -= count as u64;
        Ok(count)
    }
}
