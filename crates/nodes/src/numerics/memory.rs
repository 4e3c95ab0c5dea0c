//! Memory for large rasters on large pages.
//!
//! A raster of 4096 x 4096 cells occupies 16 384 pages of 4 KiB. The operating system provides each page at the first
//! write; measured, this cost 1.8 ns per cell, more than noise of eight octaves. Most Linux distributions offer pages
//! of 2 MiB on request, with which it was 0.65 ns.
//!
//! The C library keeps what smaller rasters have freed, up to some ten megabytes per thread, which rasters too large
//! for it would never use. So it gives that back first.

use std::alloc::{GlobalAlloc, Layout, System};

/// The system's allocator with large pages for blocks of 32 MiB and more, which the C library of Linux always maps from
/// the system and returns to it. For `#[global_allocator]` in programs; on other systems it is the plain system
/// allocator.
#[derive(Clone, Copy, Debug, Default)]
pub struct LargePages;

#[expect(unsafe_code, reason = "an allocator is a promise to the compiler")]
// SAFETY: every call is forwarded to the system's allocator; the advice on pages changes no memory.
unsafe impl GlobalAlloc for LargePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        give_back(layout.size());
        // SAFETY: the caller upholds the contract of the allocator.
        advised(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        give_back(layout.size());
        // SAFETY: as above.
        advised(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        advised(unsafe { System.realloc(block, layout, size) }, size)
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(block, layout) }
    }
}

/// From now on, maps each block of a megabyte and more from the system, and returns it when it is freed.
///
/// Otherwise the C library raises that limit to the largest block that was freed, up to 32 MiB, and keeps the smaller
/// ones in pieces that fit the next ones badly: the peak of a program that builds terrain after terrain grows with their
/// number. Fresh pages cost a program of small rasters some time.
pub fn return_rasters() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        const SMALL: libc::c_int = 1 << 20;
        #[expect(unsafe_code, reason = "a call of the C library")]
        // SAFETY: it changes only where later blocks are placed.
        unsafe {
            libc::mallopt(libc::M_MMAP_THRESHOLD, SMALL);
        }
    }
}

#[cfg(target_os = "linux")]
/// Size in bytes of a block that the C library always maps from the system.
const LARGE: usize = 32 << 20;

/// Gives freed memory back to the system before a large block is mapped.
#[inline]
fn give_back(size: usize) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    if size >= LARGE {
        #[expect(unsafe_code, reason = "a call of the C library")]
        // SAFETY: it touches no memory that is in use.
        unsafe {
            libc::malloc_trim(0);
        }
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    let _ = size;
}

/// Returns the block, after requesting large pages for its memory if it is large.
#[cfg(target_os = "linux")]
#[inline]
fn advised(block: *mut u8, size: usize) -> *mut u8 {
    const PAGE: usize = 2 << 20;
    if size >= LARGE && !block.is_null() {
        // only whole pages, so that no other memory is affected
        let skip = block.align_offset(PAGE);
        let whole = size.saturating_sub(skip) / PAGE * PAGE;
        #[expect(unsafe_code, reason = "a call of the system")]
        // SAFETY: the range lies within the block. The advice may be refused, which does no harm.
        unsafe {
            libc::madvise(block.add(skip.min(size)).cast(), whole, libc::MADV_HUGEPAGE);
        }
    }
    block
}

#[cfg(not(target_os = "linux"))]
fn advised(block: *mut u8, _: usize) -> *mut u8 {
    block
}

#[cfg(test)]
mod tests {
    /// Used by all tests of this crate.
    #[global_allocator]
    static MEMORY: super::LargePages = super::LargePages;

    #[test]
    fn large_blocks_are_zeroed_grow_and_keep_what_they_hold() {
        let mut samples = vec![0_u32; 9 << 20];
        assert!(samples.iter().all(|&sample| sample == 0));
        (0..).zip(&mut samples).for_each(|(k, sample)| *sample = k);
        samples.resize(20 << 20, 7);
        samples.shrink_to(0);
        let (old, new) = samples.split_at(9 << 20);
        assert!((0..).zip(old).all(|(k, &sample)| sample == k) && new.iter().all(|&sample| sample == 7));
    }
}
