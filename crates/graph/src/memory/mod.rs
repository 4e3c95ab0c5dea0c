//! Allocation of rasters and scratch memory, and support for ending the program when other memory runs out.
//!
//! A kernel allocates everything that grows with its window through [`zeroed`], [`filled`], [`copied`], [`collected`]
//! or [`with_capacity`]. When the system has no such memory they return [`OutOfMemory`], which `?` turns into an error
//! that names the node and the remedy.
//!
//! Every other allocation is small, and Rust's standard library ends the program if one fails. The program's allocator
//! then ends it cleanly: it asks [`is_asking`] whether the failed request came from here, and if not reports the
//! running nodes ([`running`]) and removes half-written files ([`Leftover`]). It also ends the program if a library's
//! own `Vec::try_reserve` fails.

mod leftover;
mod notes;
mod rasters;
mod work;

pub use leftover::{Left, Leftover, each_leftover};
pub use notes::{Note, Notes};
pub use rasters::{OutOfMemory, REMEDY, Zero, collected, copied, filled, is_asking, with_capacity, zeroed};
pub use work::{each_running, running};
