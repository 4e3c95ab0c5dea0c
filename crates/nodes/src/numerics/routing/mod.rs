//! Flow routing on a raster: receivers, lakes and drainage areas.
//!
//! 1. [`Grid`]: the raster's topology and its outlets, from the world's boundary.
//! 2. [`receivers`]: one receiver per cell, from the heights.
//! 3. [`basins`]: depressions, their fill levels, and receivers that lead out of them; the modules `cross`, `jump` and
//!    `breach` are alternatives.
//! 4. [`drainage`]: donors-first order and drainage area.
//! 5. [`spread`]: drainage area with dispersed flow.
//!
//! Every stage is O(N), parallel for the most part, and bit-identical for any thread count. A receiver is one byte, a
//! [`code`]: no index is stored, and a neighbour is an offset.

pub mod basins;
mod breach;
pub mod code;
mod cross;
pub mod donors;
pub mod drainage;
mod elevation;
mod exits;
mod grid;
mod jump;
mod passes;
pub mod receivers;
#[cfg(test)]
pub mod reference;
pub mod spread;

pub use basins::Depressions;
pub use breach::Limits;
pub use drainage::Drainage;
pub use elevation::Elevation;
pub use exits::Exit;
pub use grid::{Grid, Outlet};
pub use spread::Spread;
