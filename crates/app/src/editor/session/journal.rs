//! Journals on disk: where they are, the thread that writes them, and the unsaved work that they contain.
//!
//! A separate thread writes the journal while the editor runs. Each edit is in the file a fifth of a second later and
//! is flushed to the disk (`fdatasync`) at once, so that a crash of the program loses at most that fifth, and a crash
//! of the machine hardly more. The journal is beside the graph file, as `.NAME.journal`, or in the system's state
//! folder if the graph has no name or its folder is not writable. The journal is locked while it is written, so that
//! two windows on one file detect each other.

use std::{
    fs::{File, OpenOptions, TryLockError},
    io::{self, Read as _, Seek as _, SeekFrom, Write as _},
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, RecvTimeoutError, Sender, channel},
    },
    thread,
    time::{Duration, Instant, SystemTime},
};

use orograph_graph::{
    JournalEntry, JournalError, JournalWriter, Recovered,
    files::{self, Access, Out},
    recover,
};

use crate::{editor::window::state, report::failure::reason};

/// How long entries are collected before they are written together.
const GATHERED: Duration = Duration::from_millis(200);
/// Delay before a failed write is tried again.
const AGAIN: Duration = Duration::from_secs(2);
/// Maximum number of journals of one file.
const MOST: u32 = 9;
/// The largest journal that is read, in bytes. An hour of work takes about one megabyte.
const MAX_BYTES: u64 = 1 << 30;

/// Where journals are stored.
#[derive(Clone, Debug, Default)]
pub struct Journals {
    /// For graphs without a name, and for folders that are not writable.
    state: Option<PathBuf>,
}

impl Journals {
    /// The folder of the system.
    #[must_use]
    pub fn of_system() -> Self {
        Self { state: state::folder() }
    }

    /// Uses this folder for graphs without a name.
    #[must_use]
    pub fn with_state(folder: &Path) -> Self {
        Self { state: Some(folder.to_owned()) }
    }

    /// The possible names of a journal of a file, the preferred name first.
    fn names(&self, file: Option<&Path>) -> Vec<PathBuf> {
        let mut stems = Vec::new();
        if let Some(place) = file.and_then(crate::files::watch::place) {
            let name = place.file_name().unwrap_or_default().to_string_lossy();
            stems.push(place.with_file_name(format!(".{name}")));
            // The whole path as one name; its end is the most distinctive part.
            let whole = place.to_string_lossy().replace(['/', '\\', ':'], "%");
            let skipped = whole.char_indices().rev().nth(180).map_or(0, |(at, _)| at);
            stems.extend(self.state.as_ref().map(|state| state.join(&whole[skipped..])));
        } else if file.is_none() {
            stems.extend(self.state.as_ref().map(|state| state.join("unnamed")));
        }
        let numbered = |stem: &PathBuf| {
            let stem = stem.to_string_lossy().into_owned();
            (1..=MOST).map(move |n| if n == 1 { format!("{stem}.journal") } else { format!("{stem}.{n}.journal") })
        };
        stems.iter().flat_map(numbered).map(PathBuf::from).collect()
    }

    /// The existing journals of a file, or of graphs without a name.
    pub(super) fn look(&self, file: Option<&Path>) -> Leftovers {
        let mut left = Leftovers::default();
        for path in self.names(file) {
            let Ok(mut file) = OpenOptions::new().read(true).write(true).open(&path) else { continue };
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => left.in_use = true,
                Err(TryLockError::Error(_)) => {}
                Ok(()) => match read(&mut file) {
                    Ok(recovered) => {
                        let when = file.metadata().and_then(|data| data.modified()).unwrap_or(SystemTime::UNIX_EPOCH);
                        left.found.push(Found { path, file, recovered, when });
                    }
                    // A journal that another window has just created is still empty.
                    Err(JournalError::Nothing) if age(&file) > Duration::from_secs(10) => remove(&path),
                    Err(JournalError::Nothing) => {}
                    Err(error) => left.unread.push((path, error)),
                },
            }
        }
        // The newest comes first.
        left.found.sort_by_key(|found| std::cmp::Reverse(found.when));
        left
    }

    /// Returns true if an earlier session has left unsaved work on a file.
    #[must_use]
    pub fn has_work(&self, file: &Path) -> bool {
        let exists = self.names(Some(file)).iter().any(|name| name.exists());
        exists && self.look(Some(file)).found.iter().any(|found| found.recovered.has_work())
    }

    /// Creates a journal for a file, or for a graph without a name.
    pub(super) fn begin(&self, file: Option<&Path>, start: JournalEntry, trouble: Trouble) -> io::Result<Journal> {
        let mut refused = io::Error::other("there is no folder for the journal");
        for path in self.names(file) {
            if let Some(folder) = path.parent().filter(|folder| Some(*folder) == self.state.as_deref()) {
                files::create_folders(folder, files::Access::Usual)?;
            }
            match Out::create(&path, Access::Private) {
                Ok(file) => {
                    // Without file locks, windows cannot detect each other; the check at each save remains.
                    let _ = file.file().try_lock();
                    return Journal::start(path, file, JournalWriter::default(), 0, Some(start), trouble);
                }
                // It belongs to another window, or waits to be recovered.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => refused = error,
            }
        }
        Err(refused)
    }
}

/// The journals of earlier sessions.
#[derive(Debug, Default)]
pub(super) struct Leftovers {
    pub(super) found: Vec<Found>,
    /// Journals that cannot be read, and the reasons.
    pub(super) unread: Vec<(PathBuf, JournalError)>,
    /// True if another window is working on the file.
    pub(super) in_use: bool,
}

/// A journal of an earlier session. It stays locked while this value lives.
#[derive(Debug)]
pub(super) struct Found {
    path: PathBuf,
    file: File,
    pub(super) recovered: Recovered,
    pub(super) when: SystemTime,
}

impl Found {
    /// Continues this journal.
    pub(super) fn recover(self, trouble: Trouble) -> io::Result<Journal> {
        let Recovered { writer, read, .. } = self.recovered;
        let file = Out::opened(self.file, &self.path);
        Journal::start(self.path, file, writer, read as u64, None, trouble)
    }

    /// Deletes the journal and its work.
    pub(super) fn discard(self) {
        remove(&self.path);
    }
}

fn age(file: &File) -> Duration {
    file.metadata().and_then(|data| data.modified()).ok().and_then(|when| when.elapsed().ok()).unwrap_or_default()
}

fn read(file: &mut File) -> Result<Recovered, JournalError> {
    let mut bytes = Vec::new();
    // Reading ends at the first unreadable entry.
    let _ = file.take(MAX_BYTES).read_to_end(&mut bytes);
    recover(&bytes)
}

fn remove(path: &Path) {
    // If it cannot be removed, the next start finds it without unsaved work.
    let _ = files::remove_file(path);
}

/// Why the journal cannot be written at present; the session reports it.
pub(super) type Trouble = Arc<Mutex<Option<String>>>;

enum Order {
    Write(Box<JournalEntry>),
    /// The journal is no longer needed.
    Remove,
}

/// A journal that is being written.
#[derive(Debug)]
pub(super) struct Journal {
    orders: Option<Sender<Order>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Journal {
    fn start(
        path: PathBuf,
        file: Out,
        writer: JournalWriter,
        length: u64,
        first: Option<JournalEntry>,
        trouble: Trouble,
    ) -> io::Result<Self> {
        let (orders, inbox) = channel();
        let mut writer = Writer { path, file, writer, length, waiting: first.into_iter().collect(), trouble };
        let thread = thread::Builder::new().name("journal".to_owned()).spawn(move || writer.work(&inbox))?;
        Ok(Self { orders: Some(orders), thread: Some(thread) })
    }

    pub(super) fn write(&self, entry: JournalEntry) {
        self.order(Order::Write(Box::new(entry)));
    }

    /// Removes the journal: all work is saved or discarded.
    pub(super) fn remove(self) {
        self.order(Order::Remove);
    }

    fn order(&self, order: Order) {
        if let Some(orders) = &self.orders {
            // The writer only ends when this end is dropped.
            let _ = orders.send(order);
        }
    }
}

impl Drop for Journal {
    /// Writes all pending entries before it returns.
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Writer {
    path: PathBuf,
    file: Out,
    writer: JournalWriter,
    /// The number of bytes in complete lines.
    length: u64,
    waiting: Vec<JournalEntry>,
    trouble: Trouble,
}

impl Writer {
    fn work(&mut self, inbox: &Receiver<Order>) {
        let mut due = (!self.waiting.is_empty()).then(Instant::now);
        loop {
            let order = match due {
                None => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
                Some(due) => inbox.recv_timeout(due.saturating_duration_since(Instant::now())),
            };
            match order {
                Ok(Order::Write(entry)) => {
                    self.gather(*entry);
                    due = due.or_else(|| Some(Instant::now() + GATHERED));
                }
                Ok(Order::Remove) => return remove(&self.path),
                Err(RecvTimeoutError::Timeout) => {
                    due = self.flush().is_err().then(|| Instant::now() + AGAIN);
                }
                Err(RecvTimeoutError::Disconnected) => {
                    // A last attempt; any failure has already been reported.
                    let _ = self.flush();
                    return;
                }
            }
        }
    }

    /// Of a drag, only the last value is kept.
    fn gather(&mut self, entry: JournalEntry) {
        match (self.waiting.last_mut(), entry) {
            (Some(JournalEntry::Made(last) | JournalEntry::Amended(last)), JournalEntry::Amended(new)) => *last = new,
            (_, entry) => self.waiting.push(entry),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        let mut writer = self.writer.clone();
        let lines: String = self.waiting.iter().map(|entry| writer.line(entry)).collect();
        let written = self.write(lines.as_bytes());
        let mut trouble = self.trouble.lock().unwrap_or_else(PoisonError::into_inner);
        match &written {
            Ok(()) => {
                self.length += lines.len() as u64;
                self.writer = writer;
                self.waiting.clear();
                *trouble = None;
            }
            Err(error) => *trouble = Some(reason(error)),
        }
        written
    }

    fn write(&mut self, lines: &[u8]) -> io::Result<()> {
        // The rest is an unfinished line, or the end of a damaged journal.
        self.file.set_len(self.length)?;
        self.file.seek(SeekFrom::Start(self.length))?;
        self.file.write_all(lines)?;
        self.file.flush_to_disk()?;
        if self.length == 0
            && let Some(folder) = self.path.parent()
        {
            // The name is durable once the folder is flushed; not all systems can flush a folder.
            let _ = files::flush_folder(folder);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{
        Document,
        files::faults::{Fault, Plan},
    };

    use super::*;

    /// The texts of a document, each an edit further.
    fn texts() -> [String; 4] {
        [1, 2, 3, 4].map(|seed| format!("(nodes: {{ \"land\": Perlin(seed: {seed}) }})"))
    }

    /// Writes a journal of three edits; returns how many were on the disk for certain.
    fn write(journals: &Journals, trouble: &Trouble) -> usize {
        let mut document = Document::parse(texts()[0].clone(), &orograph_nodes::registry());
        let [path, ..] = &*journals.names(None) else { return 0 };
        let begun = files::create_folders(path.parent().expect("a folder"), files::Access::Usual);
        let Ok(file) = begun.and_then(|()| Out::create(path, Access::Private)) else { return 0 };
        let waiting = vec![document.start_entry(None)];
        let (path, trouble, length) = (path.clone(), Arc::clone(trouble), 0);
        let mut writer = Writer { path, file, writer: JournalWriter::default(), length, waiting, trouble };
        let mut safe = 0;
        for text in &texts()[1..] {
            assert!(document.replace(text));
            writer.gather(JournalEntry::Made(document.last_edit().expect("an edit")));
            safe = if writer.flush().is_ok() { document.steps() } else { safe };
        }
        safe
    }

    #[test]
    fn a_failure_at_any_step_loses_no_flushed_edit() {
        for fault in Fault::ALL {
            for at in 0.. {
                let place = tempfile::tempdir().expect("a folder");
                let journals = Journals::with_state(&place.path().join("state"));
                let plan = Plan::new(place.path(), fault, at);
                let trouble = Trouble::default();
                let safe = write(&journals, &trouble);
                let has_struck = plan.has_struck();
                drop(plan);
                let what = format!("{fault:?} at {at}");
                let found = journals.look(None).found;
                let text = found.first().map(|found| found.recovered.text.clone());
                let step = text.as_ref().map(|text| texts().iter().position(|made| made == text).expect("an edit"));
                assert!(step.unwrap_or(0) >= safe, "{what}: {step:?} of {safe}");
                if fault == Fault::Denied && step.is_some() {
                    assert!(step >= Some(2), "{what}: the next flush writes what one could not");
                }
                if !has_struck || fault == Fault::Slow {
                    assert_eq!((step, safe), (Some(3), 3), "{what}");
                    break;
                }
            }
        }
    }
}
