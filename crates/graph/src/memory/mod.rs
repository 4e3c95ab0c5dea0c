//! Allocation of rasters and scratch memory, and what happens when other memory runs out.
//!
//! A kernel allocates everything that grows with its window through [`zeroed`], [`filled`], [`copied`], [`collected`]
//! or [`with_capacity`]. When the system has no such memory they return [`OutOfMemory`], which `?` turns into an error
//! that names the node and the remedy.
//!
//! Every other allocation is small and cannot fail in Rust's standard library without ending the program. The program's
//! allocator then ends it cleanly: it asks [`is_asking`] whether the failed request came from here, and if not reports
//! the running nodes ([`running`]) and removes half-written files ([`Leftover`]). A library that tries to reserve
//! memory by itself (`Vec::try_reserve`) is ended in the same way.

mod leftover;
mod notes;
mod rasters;
mod work;

pub use leftover::{Left, Leftover, each_leftover};
pub use notes::{Note, Notes};
pub use rasters::{OutOfMemory, REMEDY, Zero, collected, copied, filled, is_asking, with_capacity, zeroed};
pub use work::{each_running, running};
