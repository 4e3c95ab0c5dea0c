//! The store of results: in memory and, with a folder, on disk. Evaluators and programs may share one.

mod disk;
mod entry;
mod in_flight;
mod json;
mod memory;
mod state;
mod strata;
mod trust;

use std::{
    collections::HashMap,
    fmt, io,
    sync::{Arc, Mutex},
};

use disk::Disk;
pub(super) use disk::Ticket;
pub use disk::{StoreFolder, Usage, code_is_in};
pub(super) use entry::Form;
pub(super) use in_flight::{Claim, Elsewhere, InFlight};
use memory::MemoryCache;
pub(super) use memory::Slot;
pub use trust::Trust;

use super::{event::lock, key::Key};
use crate::{job::Cancel, value::Value, world::Window};

/// A cache of results, by their provenance. A raster is also found as a part of one that was kept for a wider window.
pub struct Store {
    memory: MemoryCache,
    disk: Option<Disk>,
    /// The warnings of nodes by their keys, as far as they have been looked up.
    notes: Mutex<HashMap<Key, Arc<[String]>>>,
    /// What is being computed.
    in_flight: InFlight,
}

/// Limit of the keys with warnings in memory; beyond it, all are forgotten and looked up again.
const MOST_NOTES: usize = 1 << 16;

/// The location of a result.
pub(super) enum Found {
    /// In memory.
    Memory(Value),
    /// In a file, to be [loaded](Store::load).
    Disk(Ticket),
}

impl Store {
    /// A store with a size limit in memory, and an optional folder on disk.
    #[must_use]
    pub fn new(memory_budget: usize, folder: Option<StoreFolder>) -> Self {
        let disk = folder.map(Disk::new);
        let memory = MemoryCache::new(memory_budget);
        Self { memory, disk, notes: Mutex::default(), in_flight: InFlight::default() }
    }

    /// Size of the results in memory; never more than the limit.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.memory.bytes()
    }

    /// Whether it keeps anything, in memory or in a folder.
    #[must_use]
    pub fn keeps(&self) -> bool {
        self.disk.is_some() || self.memory.keeps()
    }

    /// The folder of the disk cache. Returns None when there is none.
    #[must_use]
    pub fn folder(&self) -> Option<&StoreFolder> {
        self.disk.as_ref().map(Disk::place)
    }

    /// The result on a window, or its location.
    pub(super) fn find(&self, slot: Slot, form: Form, window: &Window) -> Option<Found> {
        if let Some(value) = self.memory.get(slot, window) {
            return Some(Found::Memory(value));
        }
        Some(Found::Disk(self.disk.as_ref()?.find(slot, form, window)?))
    }

    /// The result on a window, if it is in memory.
    pub(super) fn in_memory(&self, slot: Slot, window: &Window) -> Option<Value> {
        self.memory.get(slot, window)
    }

    /// Reads a result from disk, and keeps it in memory.
    ///
    /// # Errors
    /// When it cannot be read after all, with what is wrong with its file, if anything.
    pub(super) fn load(
        &self,
        ticket: &Ticket,
        slot: Slot,
        form: Form,
        window: &Window,
        cancel: &Cancel,
    ) -> Result<Value, Option<String>> {
        let disk = self.disk.as_ref().ok_or(None)?;
        let value = disk.load(ticket, form, window, cancel)?;
        self.memory.insert(slot, window, &value);
        Ok(value)
    }

    /// Keeps a result in memory.
    pub(super) fn insert(&self, slot: Slot, window: &Window, value: &Value) {
        self.memory.insert(slot, window, value);
    }

    /// Keeps a result on disk, if there is a folder.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn persist(&self, slot: Slot, window: &Window, value: &Value, cancel: &Cancel) -> io::Result<()> {
        self.disk.as_ref().map_or(Ok(()), |disk| disk.store(slot, value, window, cancel))
    }

    /// What is being computed.
    pub(super) const fn in_flight(&self) -> &InFlight {
        &self.in_flight
    }

    /// The warnings of a node's kernel for the results of this key.
    pub(super) fn notes(&self, key: Key) -> Arc<[String]> {
        let mut notes = lock(&self.notes);
        if notes.len() > MOST_NOTES {
            notes.clear();
        }
        let read = || self.disk.as_ref().map_or_else(Vec::new, |disk| disk.notes(key)).into();
        Arc::clone(notes.entry(key).or_insert_with(read))
    }

    /// Keeps the warnings of a node's kernel. Write errors are ignored: nothing is lost that cannot be computed again.
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
