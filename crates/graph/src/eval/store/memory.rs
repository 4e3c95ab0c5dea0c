//! The memory cache; the least recently used results are dropped first.

use std::{
    collections::{BTreeMap, HashMap},
    sync::Mutex,
};

use crate::eval::{event::lock, key::Key};
use crate::{value::Value, world::Window};

/// Identifies a value on any window: the key of its node, without the window, and the output.
pub(in crate::eval) type Slot = (Key, usize);

/// A cache with a size limit in bytes, shared by threads.
pub(super) struct MemoryCache {
    budget: usize,
    inner: Mutex<Inner>,
}

#[derive(Default)]
struct Inner {
    entries: HashMap<Slot, Vec<Entry>>,
    /// Slots by the last use of one of their entries.
    by_use: BTreeMap<u64, Slot>,
    clock: u64,
    bytes: usize,
}

struct Entry {
    window: Window,
    value: Value,
    used: u64,
}

impl MemoryCache {
    pub(super) fn new(budget: usize) -> Self {
        Self { budget, inner: Mutex::default() }
    }

    /// Whether anything fits.
    pub(super) const fn keeps(&self) -> bool {
        self.budget > 0
    }

    /// The value on a window, possibly cropped from one that was kept for a wider window. Strata, lines, reports and
    /// states cannot be cropped: they are found on their own window only. A crop for which there is no memory, or whose
    /// samples a device does not give back, counts as not found.
    pub(super) fn get(&self, slot: Slot, window: &Window) -> Option<Value> {
        let found = lock(&self.inner).touch(slot, window)?;
        Some(match found {
            Value::Field(field) => {
                if field.window().cells != window.cells {
                    field.fetch().ok()?;
                }
                Value::Field(field.try_crop(window).ok()?)
            }
            whole @ (Value::Strata(_) | Value::Lines(_) | Value::Report(_) | Value::State(_)) => whole,
        })
    }

    /// Keeps a value, unless it is larger than the whole limit.
    pub(super) fn insert(&self, slot: Slot, window: &Window, value: &Value) {
        let bytes = weight(value);
        if bytes > self.budget {
            return;
        }
        let mut inner = lock(&self.inner);
        inner.remove(slot, |entry| entry.window == *window);
        while inner.bytes > self.budget - bytes {
            let Some((used, oldest)) = inner.by_use.pop_first() else { break };
            inner.remove(oldest, |entry| entry.used == used);
        }
        inner.clock += 1;
        let used = inner.clock;
        inner.bytes += bytes;
        inner.by_use.insert(used, slot);
        inner.entries.entry(slot).or_default().push(Entry { window: *window, value: value.clone(), used });
    }

    /// Size of its contents in bytes.
    pub(super) fn bytes(&self) -> usize {
        lock(&self.inner).bytes
    }
}

impl Inner {
    fn touch(&mut self, slot: Slot, window: &Window) -> Option<Value> {
        let entry = self.entries.get_mut(&slot)?.iter_mut().find(|entry| match entry.value {
            Value::Field(_) => entry.window.contains(window),
            Value::Strata(_) | Value::Lines(_) | Value::Report(_) | Value::State(_) => {
                entry.window.contains(window) && window.contains(&entry.window)
            }
        })?;
        self.clock += 1;
        self.by_use.remove(&entry.used);
        self.by_use.insert(self.clock, slot);
        entry.used = self.clock;
        Some(entry.value.clone())
    }

    fn remove(&mut self, slot: Slot, which: impl Fn(&Entry) -> bool) {
        let Some(entries) = self.entries.get_mut(&slot) else { return };
        if let Some(at) = entries.iter().position(which) {
            let entry = entries.swap_remove(at);
            self.by_use.remove(&entry.used);
            self.bytes -= weight(&entry.value);
        }
        if entries.is_empty() {
            self.entries.remove(&slot);
        }
    }
}

/// Size of a value including that of its entry, so that many small reports count as well.
fn weight(value: &Value) -> usize {
    value.bytes() + size_of::<Entry>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Field, World};

    fn window(side: u32) -> Window {
        Window::whole(World { size: [f64::from(side); 2], cells: [side; 2], ..World::default() })
    }

    fn slots(count: u8) -> Vec<Slot> {
        (0..count).map(|i| (Key::from_bytes([i; 16]), 0)).collect()
    }

    #[test]
    fn the_least_recently_used_goes_first_and_the_budget_holds() {
        let window = window(16);
        let value = Value::Field(Field::constant(window, 1.0));
        let budget = 3 * weight(&value);
        let cache = MemoryCache::new(budget);
        let slots = slots(5);
        for slot in &slots[..3] {
            cache.insert(*slot, &window, &value);
        }
        assert!(cache.get(slots[0], &window).is_some());
        cache.insert(slots[3], &window, &value);
        assert!(cache.bytes() <= budget);
        let held: Vec<bool> = slots.iter().map(|slot| cache.get(*slot, &window).is_some()).collect();
        assert_eq!(held, [true, false, true, true, false]);
    }

    #[test]
    fn what_is_larger_than_the_budget_is_not_kept_and_drops_nothing() {
        let (small, large) = (window(4), window(64));
        let cache = MemoryCache::new(4096);
        let slots = slots(2);
        cache.insert(slots[0], &small, &Value::Field(Field::constant(small, 1.0)));
        cache.insert(slots[1], &large, &Value::Field(Field::constant(large, 1.0)));
        assert!(cache.get(slots[0], &small).is_some() && cache.get(slots[1], &large).is_none());
    }

    #[test]
    fn a_part_is_found_in_a_wider_window() {
        let whole = window(8);
        let cache = MemoryCache::new(1 << 20);
        let slot = slots(1)[0];
        cache.insert(slot, &whole, &Value::Field(Field::new(whole, (0..64).map(|v| v as f32).collect())));
        let part = Window { origin: [2, 1], cells: [2, 1], ..whole };
        let found = cache.get(slot, &part).expect("inside");
        assert_eq!(found.as_field().expect("a field").samples(), [10.0, 11.0]);
    }

    #[test]
    fn inserting_twice_counts_once() {
        let window = window(8);
        let value = Value::Field(Field::constant(window, 1.0));
        let cache = MemoryCache::new(1 << 20);
        let slot = slots(1)[0];
        cache.insert(slot, &window, &value);
        let once = cache.bytes();
        cache.insert(slot, &window, &value);
        assert_eq!(cache.bytes(), once);
    }
}
