//! A queue of cells by level, for a flood whose levels never fall.
//!
//! A radix heap (R. K. Ahuja, K. Mehlhorn, J. Orlin, R. E. Tarjan, 1990, "Faster algorithms for the shortest path
//! problem", J. ACM 37): a key is kept by the highest bit in which it differs from the last key that was taken, so that
//! most cells are moved a few times and hardly any are compared.

/// Cells with keys, which leave in the order of key and cell.
pub(super) struct Queue {
    /// The last key that was taken; no key in the queue is lower.
    last: u64,
    /// Entries by the number of bits up to the highest that differs from `last`. The first has equal keys, with cells in
    /// descending order.
    buckets: [Vec<(u64, u32)>; 65],
}

impl Queue {
    pub(super) const fn new() -> Self {
        Self { last: 0, buckets: [const { Vec::new() }; 65] }
    }

    /// Adds a cell. The key must not be below the last one that was taken.
    pub(super) fn push(&mut self, key: u64, cell: u32) {
        debug_assert!(key >= self.last, "the key is lower than one that was taken");
        let bucket = self.bucket(key);
        let entries = &mut self.buckets[bucket];
        if bucket > 0 {
            entries.push((key, cell));
        } else {
            let place = entries.partition_point(|entry| entry.1 > cell);
            entries.insert(place, (key, cell));
        }
    }

    /// Removes the cell with the lowest key, of equal keys the lowest cell.
    pub(super) fn pop(&mut self) -> Option<u32> {
        if self.buckets[0].is_empty() {
            let first = (1..self.buckets.len()).find(|&bucket| !self.buckets[bucket].is_empty())?;
            let mut entries = std::mem::take(&mut self.buckets[first]);
            self.last = entries.iter().map(|entry| entry.0).min().unwrap_or(self.last);
            for entry in entries.drain(..) {
                let bucket = self.bucket(entry.0);
                self.buckets[bucket].push(entry);
            }
            // its memory is kept
            self.buckets[first] = entries;
            self.buckets[0].sort_unstable_by_key(|entry| std::cmp::Reverse(entry.1));
        }
        self.buckets[0].pop().map(|entry| entry.1)
    }

    const fn bucket(&self, key: u64) -> usize {
        (64 - (key ^ self.last).leading_zeros()) as usize
    }
}

#[cfg(test)]
mod tests {
    use std::{cmp::Reverse, collections::BinaryHeap};

    use super::*;

    #[test]
    fn cells_leave_in_the_order_of_a_heap() {
        let (mut queue, mut heap) = (Queue::new(), BinaryHeap::new());
        let mut state = 4_u64;
        let mut dice = |sides: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % sides
        };
        let mut level = 1_u64 << 40;
        for cell in 0..4000_u32 {
            // also equal keys, those of the cell that was just taken, and far ones
            let key = level + [0, 1, 3, 1 << 20, 1 << 50][dice(5) as usize] * dice(3);
            let cell = cell ^ 0x55;
            queue.push(key, cell);
            heap.push(Reverse((key, cell)));
            if dice(3) > 0 {
                let Reverse((key, cell)) = heap.pop().expect("it is not empty");
                assert_eq!(queue.pop(), Some(cell));
                level = key;
            }
        }
        while let Some(Reverse((_, cell))) = heap.pop() {
            assert_eq!(queue.pop(), Some(cell));
        }
        assert_eq!(queue.pop(), None);
    }
}
