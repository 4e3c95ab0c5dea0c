//! The lattice of one octave: positions on it, and hashes of its points.

use orograph_graph::mix;

/// Positions of cell centres along one axis of an octave's lattice in wavelengths, as 32.32 fixed-point numbers: the
/// integer part is the index of the lattice cell, the rest the exact fraction within it. They are linear in the world's
/// cell indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Axis {
    /// Position of the centre of the world's first cell.
    pub(crate) base: i64,
    /// Step from cell to cell.
    pub(crate) step: i64,
    /// Period in lattice cells; 0 for none.
    pub(crate) period: i32,
}

impl Axis {
    /// Creates an axis with a step of `step` wavelengths per cell, shifted by `shift / 2³²` wavelengths.
    pub(crate) fn new(step: f64, shift: u32, period: i32) -> Self {
        let step = (4_294_967_296.0 * step).round() as i64;
        Self { base: step / 2 + i64::from(shift), step, period }
    }

    /// Returns the same lattice sampled every `cells` cells of the world, at places counted from the world's corner,
    /// starting with `first`.
    pub(crate) fn seen(&self, cells: f64, first: i64) -> Self {
        let step = (self.step as f64 * cells).round() as i64;
        Self { base: self.base - self.step / 2 + first * step, step, period: self.period }
    }

    /// Returns the position of the centre of a cell of the world.
    #[inline(always)]
    pub(crate) fn at(&self, cell: u32) -> i64 {
        self.base + i64::from(cell) * self.step
    }

    /// Returns the lattice cell of a position.
    #[inline(always)]
    pub(crate) fn cell(position: i64) -> i32 {
        (position >> 32) as i32
    }

    /// Returns the fraction of a position in its lattice cell, to 24 bits, exactly.
    #[inline(always)]
    pub(crate) fn fraction(position: i64) -> f32 {
        (position as u32 >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Returns the index of a lattice line modulo the period.
    #[inline(always)]
    pub(crate) fn wrap(&self, line: i32) -> i32 {
        if self.period == 0 { line } else { line.rem_euclid(self.period) }
    }
}

/// Returns the part of the hash that depends only on the lattice row.
#[inline(always)]
pub(crate) fn hash_row(row: i32, seed: u32) -> u32 {
    mix((row as u32).wrapping_mul(0xd816_3841).wrapping_add(seed))
}

/// Returns the hash of a lattice point from its column and [`hash_row`].
#[inline(always)]
pub(crate) fn hash(column: i32, row_hash: u32) -> u32 {
    mix((column as u32).wrapping_mul(0x8da6_b343).wrapping_add(row_hash))
}
