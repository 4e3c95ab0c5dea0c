//! The store of results: in memory and, where a folder is given, on disk. Evaluators, and programs, may share one.

mod disk;
mod entry;
mod json;
mod memory;

use std::{
    collections::HashMap,
    fmt, io,
    sync::{Arc, Mutex},
};

use disk::Disk;
pub(super) use disk::Ticket;
pub use disk::{StoreFolder, Usage};
use memory::MemoryCache;
pub(super) use memory::Slot;

use super::{event::lock, key::Key};
use crate::{
    job::Cancel,
    value::{PortType, Value},
    world::Window,
};

/// Results by what they come from. A raster is also found as a part of one that was kept for a wider window.
pub struct Store {
    memory: MemoryCache,
    disk: Option<Disk>,
    /// The warnings of nodes by their keys, as far as they have been looked up.
    notes: Mutex<HashMap<Key, Arc<[String]>>>,
}

/// Keys whose warnings are remembered in memory; beyond, all are forgotten and looked up again.
const MOST_NOTES: usize = 1 << 16;

/// Where a result is.
pub(super) enum Found {
    /// Here.
    Memory(Value),
    /// In a file, to be [loaded](Store::load).
    Disk(Ticket),
}

impl Store {
    /// A store of so many bytes in memory, and a folder on disk.
    #[must_use]
    pub fn new(memory_budget: usize, folder: Option<StoreFolder>) -> Self {
        let disk = folder.map(Disk::new);
        Self { memory: MemoryCache::new(memory_budget), disk, notes: Mutex::default() }
    }

    /// Bytes of the results in memory; never more than the budget.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.memory.bytes()
    }

    /// The folder of results on disk.
    #[must_use]
    pub fn folder(&self) -> Option<&StoreFolder> {
        self.disk.as_ref().map(Disk::place)
    }

    /// The result on a window, or where it is.
    pub(super) fn find(&self, slot: Slot, ty: PortType, window: &Window) -> Option<Found> {
        if let Some(value) = self.memory.get(slot, window) {
            return Some(Found::Memory(value));
        }
        Some(Found::Disk(self.disk.as_ref()?.find(slot, ty, window)?))
    }

    /// The result on a window, if it is in memory.
    pub(super) fn in_memory(&self, slot: Slot, window: &Window) -> Option<Value> {
        self.memory.get(slot, window)
    }

    /// Reads a result from disk, and keeps it in memory.
    ///
    /// # Errors
    /// When it cannot be had after all, with what is wrong with its file if anything is.
    pub(super) fn load(
        &self,
        ticket: &Ticket,
        slot: Slot,
        ty: PortType,
        window: &Window,
        cancel: &Cancel,
    ) -> Result<Value, Option<String>> {
        let disk = self.disk.as_ref().ok_or(None)?;
        let value = disk.load(ticket, ty, window, cancel)?;
        self.memory.insert(slot, window, &value);
        Ok(value)
    }

    /// Keeps a result in memory.
    pub(super) fn insert(&self, slot: Slot, window: &Window, value: &Value) {
        self.memory.insert(slot, window, value);
    }

    /// Keeps a result on disk, where there is a folder.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn persist(&self, slot: Slot, window: &Window, value: &Value, cancel: &Cancel) -> io::Result<()> {
        self.disk.as_ref().map_or(Ok(()), |disk| disk.store(slot, value, window, cancel))
    }

    /// The warnings of a node's kernel when it made the results of this key.
    pub(super) fn notes(&self, key: Key) -> Arc<[String]> {
        let mut notes = lock(&self.notes);
        if notes.len() > MOST_NOTES {
            notes.clear();
        }
        let read = || self.disk.as_ref().map_or_else(Vec::new, |disk| disk.notes(key)).into();
        Arc::clone(notes.entry(key).or_insert_with(read))
    }

    /// Keeps the warnings of a node's kernel. A disk that takes none loses nothing that cannot be computed.
    pub(super) fn keep_notes(&self, key: Key, notes: &[String]) {
        if !notes.is_empty()
            && let Some(disk) = &self.disk
        {
            let _ = disk.keep_notes(key, notes);
        }
        lock(&self.notes).insert(key, notes.into());
    }
}

impl fmt::Debug for Store {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Store").field("bytes", &self.bytes()).field("folder", &self.folder()).finish_non_exhaustive()
    }
}
