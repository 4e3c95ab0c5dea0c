//! The disk cache: a folder of files under a size limit, which several programs may share.
//!
//! A result is the file `FF/HASH.X.Y.WxH.orovalue`: the hash identifies program, key and output, `FF` are its first two
//! digits, and the numbers are the window, so that a wider result is found by its name. Files are written under a
//! temporary name and renamed into place, are verified when they are read ([`entry`]) like what a kernel returns, and
//! are deleted when they are invalid. Files of other users are ignored ([`trust`]). The modification time is the time
//! of last use.

use std::{
    collections::HashSet,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    sync::{LazyLock, Mutex, OnceLock},
    time::{Duration, SystemTime},
};

use super::{
    entry::{self, Form, Name},
    memory::Slot,
    trust::{self, Guard, Trust},
};
use crate::{
    eval::{event::lock, key::Key},
    files::{self, Access, Part},
    job::Cancel,
    value::Value,
    world::Window,
};

const ENDING: &str = "orovalue";
const NOTES: &str = "oronotes";

/// A folder of stored results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoreFolder {
    /// The folder; it is created with the first result. The store touches only its own files in it.
    pub folder: PathBuf,
    /// Size limit of its files in bytes; the least recently used are deleted.
    pub budget: u64,
    /// Smallest computing time of results that are written automatically; faster ones are written only on request
    /// ([`Evaluator::persist`]).
    ///
    /// [`Evaluator::persist`]: crate::Evaluator::persist
    pub worth: Duration,
    /// The users whose results are read.
    pub trust: Trust,
}

/// The contents of a folder of results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Usage {
    /// Number of results.
    pub files: u64,
    /// Their size in bytes.
    pub bytes: u64,
}

impl StoreFolder {
    /// Counts its contents. A folder that does not exist is empty.
    ///
    /// # Errors
    /// When it cannot be listed.
    pub fn usage(&self) -> io::Result<Usage> {
        let files = files(&self.folder)?;
        Ok(Usage { files: files.len() as u64, bytes: files.iter().map(|file| file.bytes).sum() })
    }

    /// Why results in it are neither read nor written. Returns None when they are.
    #[must_use]
    pub fn refusal(&self) -> Option<String> {
        trust::refusal(&self.folder, self.trust).map(|error| error.to_string())
    }

    /// Deletes all results, including those of other versions of the program; returns what they used.
    ///
    /// # Errors
    /// When the folder cannot be listed or a file cannot be deleted.
    pub fn clear(&self) -> io::Result<Usage> {
        let mut cleared = Usage::default();
        for file in files(&self.folder)? {
            match files::remove_file(&file.path) {
                Ok(()) => cleared = Usage { files: cleared.files + 1, bytes: cleared.bytes + file.bytes },
                // another program was faster
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(error),
            }
        }
        for shard in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            if shard.file_name().to_str().is_some_and(is_shard) {
                // Keep one that contains other files.
                let _ = files::remove_folder(&shard.path());
            }
        }
        Ok(cleared)
    }
}

/// A stored result that was found by its name.
#[derive(Clone, Debug)]
pub(in crate::eval) struct Ticket {
    path: PathBuf,
    name: Name,
    stored: Window,
}

/// The store's access to a folder.
pub(super) struct Disk {
    place: StoreFolder,
    /// Size of its files when they were last counted, and bytes written since.
    held: Mutex<Option<[u64; 2]>>,
    guard: Guard,
    /// Files that could not be read, and perhaps not be deleted either; they are not tried again.
    unreadable: Mutex<HashSet<PathBuf>>,
}

impl Disk {
    /// Fraction of the budget (one over this number) after which the files are counted again, since other programs may
    /// share the folder.
    const RECOUNT: u64 = 16;

    pub(super) fn new(place: StoreFolder) -> Self {
        let guard = Guard::new(place.trust);
        Self { place, held: Mutex::default(), guard, unreadable: Mutex::default() }
    }

    pub(super) const fn place(&self) -> &StoreFolder {
        &self.place
    }

    /// A result that covers the window, if there is one. Its file is not opened.
    pub(super) fn find(&self, slot: Slot, form: Form, window: &Window) -> Option<Ticket> {
        if trust::refusal(&self.place.folder, self.place.trust).is_some() {
            return None;
        }
        let name = name(slot);
        let ticket = |stored: Window| Ticket { path: self.path(&name, &stored), name, stored };
        let is_there = |ticket: &Ticket| ticket.path.is_file() && !lock(&self.unreadable).contains(&ticket.path);
        let exact = ticket(*window);
        if is_there(&exact) {
            return Some(exact);
        }
        if !matches!(form, Form::Planes(_)) || window.is_whole() {
            return None;
        }
        let whole = ticket(Window::whole(window.world));
        if is_there(&whole) {
            return Some(whole);
        }
        let hex = hex(&name);
        let stored = fs::read_dir(exact.path.parent()?).ok()?.flatten().filter_map(|entry| {
            let file = entry.file_name();
            let (origin, cells) = parse(file.to_str()?.strip_prefix(&hex)?)?;
            Some(Window { world: window.world, origin, cells })
        });
        let wider = stored.filter(|stored| is_within_world(stored) && stored.contains(window)).map(ticket);
        wider.filter(is_there).min_by_key(|ticket| ticket.stored.len())
    }

    /// Reads a result.
    ///
    /// # Errors
    /// What is wrong with an invalid file, which is then deleted or at least ignored. `None` when the file is merely
    /// gone, or reading was cancelled.
    pub(super) fn load(
        &self,
        ticket: &Ticket,
        form: Form,
        window: &Window,
        cancel: &Cancel,
    ) -> Result<Value, Option<String>> {
        let Ticket { path, name, stored } = ticket;
        let file = self.guard.open(path).inspect_err(|_| {
            lock(&self.unreadable).insert(path.clone());
        })?;
        let read = entry::read(&file, name, form, stored, window, cancel);
        let read = read.and_then(|value| value.fault().map_or(Ok(value), |fault| Err(entry::damaged(&fault))));
        match read {
            Ok(value) => {
                touch(path);
                Ok(value)
            }
            Err(_) if cancel.is_cancelled() => Err(None),
            Err(error) => {
                // A file that cannot be deleted is replaced by the new result, or ignored. Where memory or the disk
                // failed, the file may be sound.
                if matches!(error.kind(), io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof) {
                    let _ = files::remove_file(path);
                }
                lock(&self.unreadable).insert(path.clone());
                Err(Some(format!("{} {error}", path.display())))
            }
        }
    }

    /// Writes a result, and deletes the least recently used ones if the folder exceeds its limit.
    ///
    /// # Errors
    /// When the folder cannot be written to, the disk is full, or the evaluation was cancelled meanwhile.
    pub(super) fn store(&self, slot: Slot, value: &Value, window: &Window, cancel: &Cancel) -> io::Result<()> {
        if let Some(refusal) = trust::refusal(&self.place.folder, self.place.trust) {
            return Err(refusal);
        }
        let name = name(slot);
        let path = self.path(&name, window);
        let avoided = lock(&self.unreadable).contains(&path);
        if (path.is_file() && !avoided) || entry::bytes(value, window) > self.place.budget {
            return Ok(());
        }
        self.put(&path, |file| entry::write(file, &name, value, cancel))?;
        lock(&self.unreadable).remove(&path);
        Ok(())
    }

    /// The stored warnings of a node's results.
    pub(super) fn notes(&self, key: Key) -> Vec<String> {
        if trust::refusal(&self.place.folder, self.place.trust).is_some() {
            return Vec::new();
        }
        // Damaged warnings count as none: no result depends on them.
        let file = self.guard.open(&self.notes_path(key)).ok();
        file.and_then(|file| io::read_to_string(file).ok())
            .and_then(|text| serde_json::from_str(&text).ok())
            .unwrap_or_default()
    }

    /// Stores the warnings of a node's results.
    ///
    /// # Errors
    /// As [`Self::store`].
    pub(super) fn keep_notes(&self, key: Key, notes: &[String]) -> io::Result<()> {
        let text = serde_json::to_vec(notes)?;
        self.put(&self.notes_path(key), |file| io::Write::write_all(file, &text))
    }

    fn put(&self, path: &Path, write: impl FnOnce(&mut Part) -> io::Result<()>) -> io::Result<()> {
        let shard = path.parent().unwrap_or(&self.place.folder);
        let begin = || {
            files::create_folders(shard, Access::Private)?;
            Part::begin_beside(path, Access::Private)
        };
        // Another program may delete an empty shard between the two calls.
        let mut part = begin().or_else(|_| begin())?;
        write(&mut part)?;
        // A result that a failure of power damages is computed again.
        let bytes = part.persist_unflushed()?;
        self.trim(bytes)
    }

    fn path(&self, name: &Name, window: &Window) -> PathBuf {
        let ([x, y], [nx, ny]) = (window.origin, window.cells);
        self.shard(name).join(format!("{}.{x}.{y}.{nx}x{ny}.{ENDING}", hex(name)))
    }

    fn notes_path(&self, key: Key) -> PathBuf {
        let name = name((key, usize::MAX));
        self.shard(&name).join(format!("{}.0.0.0x0.{NOTES}", hex(&name)))
    }

    fn shard(&self, name: &Name) -> PathBuf {
        self.place.folder.join(format!("{:02x}", name[0]))
    }

    /// Counts new bytes, and deletes the least recently used files while the total exceeds the limit.
    fn trim(&self, new: u64) -> io::Result<()> {
        let mut held = lock(&self.held);
        let budget = self.place.budget;
        if let Some([counted, written]) = held.as_mut() {
            *written += new;
            if *counted + *written <= budget && *written <= budget / Self::RECOUNT {
                return Ok(());
            }
        }
        let mut files = files(&self.place.folder)?;
        files.sort_by_key(|file| file.used);
        let mut bytes: u64 = files.iter().map(|file| file.bytes).sum();
        for file in files {
            if bytes <= budget {
                break;
            }
            if files::remove_file(&file.path).is_ok() {
                bytes -= file.bytes;
            }
        }
        *held = Some([bytes, 0]);
        Ok(())
    }
}

/// A file of the store.
struct Stored {
    /// Time of last use. A time in the future, after the clock was set back, counts as the oldest.
    used: SystemTime,
    path: PathBuf,
    bytes: u64,
}

/// The store's files. Leftovers of a killed program are removed.
#[expect(clippy::disallowed_methods, reason = "the age of a file changes no result")]
fn files(folder: &Path) -> io::Result<Vec<Stored>> {
    let now = SystemTime::now();
    let mut found = Vec::new();
    let shards = match fs::read_dir(folder) {
        Ok(shards) => shards,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(found),
        Err(error) => return Err(error),
    };
    for shard in shards {
        let shard = shard?;
        if !shard.file_name().to_str().is_some_and(is_shard) {
            continue;
        }
        // A shard that another program has just deleted is empty.
        for entry in fs::read_dir(shard.path()).into_iter().flatten().flatten() {
            let file = entry.file_name();
            let (Some(file), Ok(meta)) = (file.to_str(), entry.metadata()) else { continue };
            let used = meta.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            if !meta.is_file() {
                continue;
            }
            if is_name(file) {
                let used = if used > now { SystemTime::UNIX_EPOCH } else { used };
                found.push(Stored { used, path: entry.path(), bytes: meta.len() });
            } else {
                files::remove_if_dead(&entry.path());
            }
        }
    }
    Ok(found)
}

fn is_shard(name: &str) -> bool {
    name.len() == 2 && is_hex(name)
}

fn is_hex(text: &str) -> bool {
    text.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f'))
}

/// Returns true if a file name is in the format of the store.
fn is_name(file: &str) -> bool {
    file.split_at_checked(32).is_some_and(|(hash, rest)| is_hex(hash) && parse(&rest.replace(NOTES, ENDING)).is_some())
}

/// The window in the part of a file name after the hash: `.X.Y.WxH.orovalue`.
fn parse(rest: &str) -> Option<([u32; 2], [u32; 2])> {
    let mut parts = rest.strip_prefix('.')?.strip_suffix(ENDING)?.strip_suffix('.')?.split('.');
    let mut number = || parts.next()?.parse().ok();
    let origin = [number()?, number()?];
    let (nx, ny) = parts.next()?.split_once('x')?;
    let cells = [nx.parse().ok()?, ny.parse().ok()?];
    parts.next().is_none().then_some((origin, cells))
}

fn is_within_world(window: &Window) -> bool {
    (0..2).all(|axis| {
        window.origin[axis].checked_add(window.cells[axis]).is_some_and(|end| end <= window.world.cells[axis])
    })
}

/// The name of the result for a slot, unique to this program.
fn name((key, output): Slot) -> Name {
    let mut hash = blake3::Hasher::new();
    hash.update(&*PROGRAM).update(key.bytes()).update(&(output as u64).to_le_bytes());
    let mut name = Name::default();
    hash.finalize_xof().fill(&mut name);
    name
}

fn hex(name: &Name) -> String {
    name.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The file with the code of the program, if it is not the one that runs.
static CODE: OnceLock<PathBuf> = OnceLock::new();

/// Names the file with the code, for a library in a program of another name, such as the Python package. It counts only
/// before the first result is looked up on disk.
pub fn code_is_in(file: PathBuf) {
    // another file named before stays
    let _ = CODE.set(file);
}

/// Hash of the running program: another build may compute other results under the same key. A program that cannot read
/// its own file is identified by its version alone.
static PROGRAM: LazyLock<[u8; 32]> = LazyLock::new(|| {
    let mut hash = blake3::Hasher::new();
    hash.update(env!("CARGO_PKG_VERSION").as_bytes());
    let running = || std::env::current_exe().ok();
    if let Some(path) = CODE.get().cloned().or_else(running)
        && let Ok(file) = File::open(path)
    {
        let _ = hash.update_reader(file);
    }
    *hash.finalize().as_bytes()
});

/// Marks a file as used now. Without permission for it, the file merely looks older than it is.
#[expect(clippy::disallowed_methods, reason = "the time of last use changes no result")]
fn touch(path: &Path) {
    if let Ok(file) = File::options().append(true).open(path) {
        let _ = file.set_modified(SystemTime::now());
    }
}
