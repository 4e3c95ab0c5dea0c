//! The receiver of a cell in one byte.
//!
//! Bits 0 to 2 are the direction, counter-clockwise from east: E, NE, N, NW, W, SW, S, SE. The other bits are the
//! kind of cell.

/// Set on cells of a reversed path out of a depression, which may lead uphill.
pub const TURNED: u8 = 1 << 3;
/// Set on the outermost cells of the raster, whose neighbours may be missing or on the opposite side.
pub const BORDER: u8 = 1 << 4;
/// Set where no neighbour is lower and water stays: the bottom of a depression, a pit.
pub const PIT: u8 = 1 << 5;
/// Set where water leaves the world.
pub const OUTLET: u8 = 1 << 6;

/// Bits that decide whether a cell drains in a given direction.
pub const LINK: u8 = 0b111 | PIT | OUTLET;

/// Offsets of the eight directions in columns and rows (rows run south).
pub const STEPS: [(i32, i32); 8] = [(1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1)];

/// Returns true if the cell has a receiver.
#[must_use]
#[inline(always)]
pub const fn has_receiver(code: u8) -> bool {
    code & (PIT | OUTLET) == 0
}

/// Returns the direction of a code that has a receiver.
#[must_use]
#[inline(always)]
pub const fn direction(code: u8) -> usize {
    (code & 0b111) as usize
}

/// The length of the link of a code that has a receiver, in cells.
#[must_use]
#[inline(always)]
pub const fn length(code: u8) -> f64 {
    if is_diagonal(direction(code)) { std::f64::consts::SQRT_2 } else { 1.0 }
}

/// The opposite direction.
#[must_use]
#[inline(always)]
pub const fn opposite(direction: usize) -> usize {
    direction ^ 4
}

/// Returns true if the neighbour in a direction is diagonal.
#[must_use]
#[inline(always)]
pub const fn is_diagonal(direction: usize) -> bool {
    direction & 1 == 1
}
