//! Journals on disk: where they are, who writes them, and what they hold from earlier times.
//!
//! A journal is written beside its window, by a thread of its own: what is edited is in the file a fifth of a second later,
//! and flushed to the disk (`fdatasync`) at once, so that a crash of the program loses that fifth at most, and a crash of the machine
//! hardly more. It lies beside the graph file, as `.NAME.journal`, or in the system's folder for such things where the
//! graph has no name or its folder cannot be written to. While it is written it is locked, so that two windows on one
//! file know of each other.

use std::{
    fs::{self, File, OpenOptions, TryLockError},
    io::{self, Read as _, Seek as _, SeekFrom, Write as _},
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, RecvTimeoutError, Sender, channel},
    },
    thread,
    time::{Duration, Instant, SystemTime},
};

use orograph_graph::{Entry, JournalError, Recovered, Scribe, recover};

use crate::{editor::state, failure::reason};

/// How long entries are gathered before they are written together.
const GATHERED: Duration = Duration::from_millis(200);
/// How long to wait before trying again what the system refused.
const AGAIN: Duration = Duration::from_secs(2);
/// How many journals there may be of one file.
const MOST: u32 = 9;
/// The largest journal that is read, in bytes. An hour's work takes about one megabyte.
const MAX_BYTES: u64 = 1 << 30;

/// Where journals are kept.
#[derive(Clone, Debug, Default)]
pub struct Journals {
    /// For graphs without a name, and for folders that cannot be written to.
    state: Option<PathBuf>,
}

impl Journals {
    /// As the system has it.
    #[must_use]
    pub fn of_system() -> Self {
        Self { state: state::folder() }
    }

    /// With this folder for graphs without a name.
    #[must_use]
    pub fn with_state(folder: &Path) -> Self {
        Self { state: Some(folder.to_owned()) }
    }

    /// The names that a journal of a file may have, the usual first.
    fn names(&self, file: Option<&Path>) -> Vec<PathBuf> {
        let mut stems = Vec::new();
        if let Some(place) = file.and_then(crate::watch::place) {
            let name = place.file_name().unwrap_or_default().to_string_lossy();
            stems.push(place.with_file_name(format!(".{name}")));
            // The whole path as one name; its end tells files apart best.
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

    /// What there is of a file, or of graphs without a name.
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
                    // One that another window has just begun has nothing in it yet.
                    Err(JournalError::Nothing) if age(&file) > Duration::from_secs(10) => remove(&path),
                    Err(JournalError::Nothing) => {}
                    Err(error) => left.unread.push((path, error)),
                },
            }
        }
        // The newest is what a person looks for.
        left.found.sort_by_key(|found| std::cmp::Reverse(found.when));
        left
    }

    /// A new journal of a file, or of a graph without a name.
    pub(super) fn begin(&self, file: Option<&Path>, start: Entry, trouble: Trouble) -> io::Result<Journal> {
        let mut refused = io::Error::other("there is no folder for it");
        for path in self.names(file) {
            if let Some(folder) = path.parent().filter(|folder| Some(*folder) == self.state.as_deref()) {
                fs::create_dir_all(folder)?;
            }
            let mut options = OpenOptions::new();
            options.read(true).write(true).create_new(true);
            #[cfg(unix)]
            {
                use std::os::unix::fs::OpenOptionsExt as _;
                options.mode(0o600);
            }
            match options.open(&path) {
                Ok(file) => {
                    // Where locks are unknown, windows do not know of each other, and the check of each save remains.
                    let _ = file.try_lock();
                    return Journal::start(path, file, Scribe::default(), 0, Some(start), trouble);
                }
                // Another window's, or work that waits to be taken up.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => refused = error,
            }
        }
        Err(refused)
    }
}

/// What is left of earlier times.
#[derive(Debug, Default)]
pub(super) struct Leftovers {
    pub(super) found: Vec<Found>,
    /// Journals that cannot be read, and why.
    pub(super) unread: Vec<(PathBuf, JournalError)>,
    /// Whether another window is at work.
    pub(super) in_use: bool,
}

/// A journal of an earlier time; nobody else can take it while it is held.
#[derive(Debug)]
pub(super) struct Found {
    path: PathBuf,
    file: File,
    pub(super) recovered: Recovered,
    pub(super) when: SystemTime,
}

impl Found {
    /// Goes on with it.
    pub(super) fn take_up(self, trouble: Trouble) -> io::Result<Journal> {
        let Recovered { scribe, read, .. } = self.recovered;
        Journal::start(self.path, self.file, scribe, read as u64, None, trouble)
    }

    /// Its work is given up.
    pub(super) fn discard(self) {
        remove(&self.path);
    }
}

fn age(file: &File) -> Duration {
    file.metadata().and_then(|data| data.modified()).ok().and_then(|when| when.elapsed().ok()).unwrap_or_default()
}

fn read(file: &mut File) -> Result<Recovered, JournalError> {
    let mut bytes = Vec::new();
    // What cannot be read ends what is read.
    let _ = file.take(MAX_BYTES).read_to_end(&mut bytes);
    recover(&bytes)
}

fn remove(path: &Path) {
    // What stays is found at the next start, with nothing in it that is not saved.
    let _ = fs::remove_file(path);
}

/// Why a journal cannot be written at present, for whoever tells the person.
pub(super) type Trouble = Arc<Mutex<Option<String>>>;

enum Order {
    Write(Entry),
    /// It is not needed any more.
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
        file: File,
        scribe: Scribe,
        length: u64,
        first: Option<Entry>,
        trouble: Trouble,
    ) -> io::Result<Self> {
        let (orders, inbox) = channel();
        let mut writer = Writer { path, file, scribe, length, waiting: first.into_iter().collect(), trouble };
        let thread = thread::Builder::new().name("journal".to_owned()).spawn(move || writer.work(&inbox))?;
        Ok(Self { orders: Some(orders), thread: Some(thread) })
    }

    pub(super) fn write(&self, entry: Entry) {
        self.order(Order::Write(entry));
    }

    /// Removes it: all is saved, or given up.
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
    /// What is waiting is written before it returns.
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Writer {
    path: PathBuf,
    file: File,
    scribe: Scribe,
    /// Bytes of it that are whole lines.
    length: u64,
    waiting: Vec<Entry>,
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
                    self.gather(entry);
                    due = due.or_else(|| Some(Instant::now() + GATHERED));
                }
                Ok(Order::Remove) => return remove(&self.path),
                Err(RecvTimeoutError::Timeout) => {
                    due = self.flush().is_err().then(|| Instant::now() + AGAIN);
                }
                Err(RecvTimeoutError::Disconnected) => {
                    // A last try; the trouble, if any, has been told.
                    let _ = self.flush();
                    return;
                }
            }
        }
    }

    /// Of a slider being dragged, the last place is enough.
    fn gather(&mut self, entry: Entry) {
        match (self.waiting.last_mut(), entry) {
            (Some(Entry::Made(last) | Entry::Amended(last)), Entry::Amended(new)) => *last = new,
            (_, entry) => self.waiting.push(entry),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.waiting.is_empty() {
            return Ok(());
        }
        let mut scribe = self.scribe.clone();
        let lines: String = self.waiting.iter().map(|entry| scribe.line(entry)).collect();
        let written = self.write(lines.as_bytes());
        let mut trouble = self.trouble.lock().unwrap_or_else(PoisonError::into_inner);
        match &written {
            Ok(()) => {
                self.length += lines.len() as u64;
                self.scribe = scribe;
                self.waiting.clear();
                *trouble = None;
            }
            Err(error) => *trouble = Some(reason(error)),
        }
        written
    }

    fn write(&mut self, lines: &[u8]) -> io::Result<()> {
        // Whatever stands there is a line that could not be finished, or of a journal that was torn.
        self.file.set_len(self.length)?;
        self.file.seek(SeekFrom::Start(self.length))?;
        self.file.write_all(lines)?;
        self.file.sync_data()?;
        #[cfg(unix)]
        if self.length == 0
            && let Some(folder) = self.path.parent()
        {
            // Its name lasts when the folder is on the disk; not all systems let a folder be flushed.
            let _ = File::open(folder).and_then(|folder| folder.sync_all());
        }
        Ok(())
    }
}
