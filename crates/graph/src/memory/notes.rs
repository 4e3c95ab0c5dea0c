//! Short texts that can be read when no memory can be allocated.

use std::sync::{Mutex, PoisonError, TryLockError};

/// `COUNT` slots for texts of up to `BYTES` bytes, in static memory. Neither writing nor reading allocates.
#[derive(Debug)]
pub struct Notes<const COUNT: usize, const BYTES: usize>(Mutex<[Place<BYTES>; COUNT]>);

#[derive(Clone, Copy, Debug)]
struct Place<const BYTES: usize> {
    is_taken: bool,
    len: usize,
    text: [u8; BYTES],
}

/// A text among [`Notes`]; dropping it removes the text.
#[derive(Debug)]
#[must_use = "the note is taken out again when this is dropped"]
pub struct Note<const COUNT: usize, const BYTES: usize> {
    notes: &'static Notes<COUNT, BYTES>,
    /// Its slot; `None` when there was no room.
    place: Option<usize>,
}

impl<const COUNT: usize, const BYTES: usize> Notes<COUNT, BYTES> {
    /// An empty set.
    #[must_use]
    pub const fn new() -> Self {
        Self(Mutex::new([Place { is_taken: false, len: 0, text: [0; BYTES] }; COUNT]))
    }

    /// Adds a text. It is left out when it is too long or there is no room.
    pub fn add(&'static self, text: &[u8]) -> Note<COUNT, BYTES> {
        let mut places = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let place = places.iter().position(|place| !place.is_taken).filter(|_| text.len() <= BYTES);
        if let Some(place) = place.map(|at| &mut places[at]) {
            place.text[..text.len()].copy_from_slice(text);
            (place.is_taken, place.len) = (true, text.len());
        }
        Note { notes: self, place }
    }

    /// Reads all notes. Reads none if another thread keeps them locked for longer than a moment, because the reader
    /// must not block.
    pub fn each(&self, mut read: impl FnMut(&[u8])) {
        for _ in 0..1000 {
            let places = match self.0.try_lock() {
                Ok(places) => places,
                Err(TryLockError::Poisoned(places)) => places.into_inner(),
                Err(TryLockError::WouldBlock) => {
                    std::thread::yield_now();
                    continue;
                }
            };
            places.iter().filter(|place| place.is_taken).for_each(|place| read(&place.text[..place.len]));
            return;
        }
    }
}

impl<const COUNT: usize, const BYTES: usize> Default for Notes<COUNT, BYTES> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const COUNT: usize, const BYTES: usize> Drop for Note<COUNT, BYTES> {
    fn drop(&mut self) {
        if let Some(place) = self.place {
            self.notes.0.lock().unwrap_or_else(PoisonError::into_inner)[place].is_taken = false;
        }
    }
}
