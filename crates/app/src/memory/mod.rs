//! The program's memory, and its end when there is none left.
//!
//! What is large is asked for in a way that can be refused ([`orograph_graph::memory`]) and becomes an ordinary error.
//! Everything else is small: a name, a message, a thread's queue. When the system refuses one of those there is nothing
//! to go on with, and nothing that would need memory can be done, such as unwinding or formatting a message. The
//! program then says which nodes ran and what helps, removes what it has half written, and ends with the exit code 2.
//! A journal of the editor is complete up to its last entry at any moment and stays.

mod ending;
#[cfg(target_os = "linux")]
#[path = "linux.rs"]
mod system;
#[cfg(not(target_os = "linux"))]
#[path = "other.rs"]
mod system;

use std::alloc::{GlobalAlloc, Layout};

pub use ending::keeps_a_journal;
use orograph_graph::memory::is_asking;
use orograph_nodes::memory::LargePages;

/// The program's allocator: [`LargePages`], which ends the program when it is refused memory that nothing can do
/// without.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory;

#[expect(unsafe_code, reason = "an allocator is a promise to the compiler")]
// SAFETY: every call goes to another allocator as it is; a null block is given back or the program ends.
unsafe impl GlobalAlloc for Memory {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise is passed on.
        given(unsafe { LargePages.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        given(unsafe { LargePages.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        given(unsafe { LargePages.realloc(block, layout, size) }, size)
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { LargePages.dealloc(block, layout) }
    }
}

/// The block; null only for who asked whether there is memory.
#[inline]
fn given(block: *mut u8, size: usize) -> *mut u8 {
    if block.is_null() && !is_asking() {
        ending::end(size);
    }
    block
}
