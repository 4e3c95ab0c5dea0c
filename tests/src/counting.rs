//! Measures the peak memory of a piece of code with a counting allocator.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
};

/// The system's allocator with a count of allocated bytes and of their peak, of the program and of each thread. Use it
/// as `#[global_allocator]` of a separate program.
#[derive(Debug, Default)]
pub struct Counting {
    held: AtomicUsize,
    peak: AtomicUsize,
}

thread_local! {
    /// Bytes that this thread allocated and did not free, and their peak. What it frees for another counts as negative.
    static OWN: Cell<[isize; 2]> = const { Cell::new([0; 2]) };
}

impl Counting {
    /// With no memory allocated.
    #[must_use]
    pub const fn new() -> Self {
        Self { held: AtomicUsize::new(0), peak: AtomicUsize::new(0) }
    }

    /// The result of a piece of code, and the peak of the bytes allocated while it ran, not counting those allocated
    /// before. Nothing else may run at the same time.
    pub fn peak_of<T>(&self, run: impl FnOnce() -> T) -> (T, usize) {
        let before = self.held.load(Relaxed);
        self.peak.store(before, Relaxed);
        let result = run();
        (result, self.peak.load(Relaxed).saturating_sub(before))
    }

    /// As [`Self::peak_of`], for what this thread allocates, whatever others do at the same time.
    pub fn peak_of_thread<T>(&self, run: impl FnOnce() -> T) -> (T, usize) {
        let [before, _] = OWN.get();
        OWN.set([before; 2]);
        let result = run();
        let [_, peak] = OWN.get();
        (result, (peak - before).unsigned_abs())
    }

    fn add(&self, bytes: usize) {
        let held = self.held.fetch_add(bytes, Relaxed) + bytes;
        self.peak.fetch_max(held, Relaxed);
        // a thread that ends has lost its count before its last allocations
        let _ = OWN.try_with(|own| {
            let [held, peak] = own.get();
            let held = held + bytes as isize;
            own.set([held, peak.max(held)]);
        });
    }

    fn remove(&self, bytes: usize) {
        self.held.fetch_sub(bytes, Relaxed);
        let _ = OWN.try_with(|own| own.set([own.get()[0] - bytes as isize, own.get()[1]]));
    }
}

#[expect(unsafe_code, reason = "an allocator is a promise to the compiler")]
// SAFETY: every call goes unchanged to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        self.add(layout.size());
        // SAFETY: the caller's guarantee is passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        self.add(layout.size());
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // a block that moves exists twice for a while
        self.add(size);
        // SAFETY: as above.
        let moved = unsafe { System.realloc(block, layout, size) };
        self.remove(layout.size());
        moved
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        self.remove(layout.size());
        // SAFETY: as above.
        unsafe { System.dealloc(block, layout) }
    }
}
