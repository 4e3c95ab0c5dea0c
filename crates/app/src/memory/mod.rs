//! The program's allocator, and the end of the program when memory runs out.
//!
//! Most large allocations can be refused ([`orograph_graph::memory`]), which becomes an ordinary error. Small ones (a
//! name, a message, a thread's queue) cannot. If the system refuses one of those, the program cannot continue, and
//! cannot do anything that needs memory, such as unwinding or formatting a message. It then prints the running nodes
//! and a hint (with `--json` also as the last line), removes unfinished files, and exits with code 2. The journal of
//! the editor stays; it is always complete up to its last entry.

mod ending;
#[cfg(target_os = "linux")]
#[path = "linux.rs"]
mod system;
#[cfg(not(target_os = "linux"))]
#[path = "other.rs"]
mod system;

use std::alloc::{GlobalAlloc, Layout};

pub use ending::{in_json_line, keeps_a_journal, writes_json_lines};
use orograph_graph::memory::is_asking;
use orograph_nodes::numerics::memory::LargePages;

/// The program's allocator: [`LargePages`], which ends the program when an essential allocation is refused.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory;

#[expect(unsafe_code, reason = "an allocator is a promise to the compiler")]
// SAFETY: every call is forwarded to another allocator; a null block is returned or the program ends.
unsafe impl GlobalAlloc for Memory {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller upholds the contract.
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

/// The block; null only for callers that handle a refusal.
#[inline]
fn given(block: *mut u8, size: usize) -> *mut u8 {
    if block.is_null() && !is_asking() {
        ending::end(size);
    }
    block
}
