//! The lattice of one octave: hash, gradients, positions.

use orograph_graph::mix;

use super::Gradients;

/// Factor that brings gradient noise of unit gradients, whose extremes are ±√½, to ±1.
pub(crate) const NOISE_SCALE: f32 = std::f32::consts::SQRT_2;

/// The unit vectors at (k + ½) · 11.25° in the first quadrant.
const QUADRANT: [[f32; 2]; 8] = [
    [0.995_184_7, 0.098_017_14],
    [0.956_940_35, 0.290_284_66],
    [0.881_921_3, 0.471_396_74],
    [0.773_010_43, 0.634_393_3],
    [0.634_393_3, 0.773_010_43],
    [0.471_396_74, 0.881_921_3],
    [0.290_284_66, 0.956_940_35],
    [0.098_017_14, 0.995_184_7],
];

/// 32 unit vectors at (k + ½) · 11.25°: the quadrant, turned by right angles.
static EVEN: [[f32; 2]; 32] = {
    let mut table = [[0.0; 2]; 32];
    let mut k = 0;
    while k < 32 {
        let [x, y] = QUADRANT[k % 8];
        table[k] = match k / 8 {
            0 => [x, y],
            1 => [-y, x],
            2 => [-x, -y],
            _ => [y, -x],
        };
        k += 1;
    }
    table
};

const DIAGONAL: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// 8 unit vectors at k · 45°, each four times, so that both tables are indexed by five bits.
static CLASSIC: [[f32; 2]; 32] = {
    const DIRECTIONS: [[f32; 2]; 8] = [
        [1.0, 0.0],
        [DIAGONAL, DIAGONAL],
        [0.0, 1.0],
        [-DIAGONAL, DIAGONAL],
        [-1.0, 0.0],
        [-DIAGONAL, -DIAGONAL],
        [0.0, -1.0],
        [DIAGONAL, -DIAGONAL],
    ];
    let mut table = [[0.0; 2]; 32];
    let mut k = 0;
    while k < 32 {
        table[k] = DIRECTIONS[k / 4];
        k += 1;
    }
    table
};

impl Gradients {
    /// The table of unit vectors.
    pub(super) fn table(self) -> &'static [[f32; 2]; 32] {
        match self {
            Self::Even => &EVEN,
            Self::Classic => &CLASSIC,
        }
    }
}

/// The part of the hash that is the same along a lattice row.
#[inline(always)]
pub(super) fn hash_row(row: i32, seed: u32) -> u32 {
    mix((row as u32).wrapping_mul(0xd816_3841).wrapping_add(seed))
}

/// The hash of a lattice point from its column and [`hash_row`].
#[inline(always)]
pub(super) fn hash(column: i32, row_hash: u32) -> u32 {
    mix((column as u32).wrapping_mul(0x8da6_b343).wrapping_add(row_hash))
}

/// The gradient at a lattice point: the five highest bits of its hash choose from the table.
#[inline(always)]
pub(super) fn gradient(table: &[[f32; 2]; 32], hash: u32) -> [f32; 2] {
    table[(hash >> 27) as usize]
}

/// The quintic fade 6t⁵ − 15t⁴ + 10t³: first and second derivatives are zero at 0 and 1.
#[inline(always)]
pub(super) fn fade(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

/// Positions of cell centres along one axis of an octave's lattice, in units of its wavelength, as 32.32 fixed-point
/// numbers: the whole part names the lattice cell, the rest is the exact fraction within it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Axis {
    pub(super) base: i64,
    pub(super) step: i64,
}

impl Axis {
    /// The positions of an axis with cells of `cell_m` metres, a lattice of `wavelength_m` metres and a shift of
    /// `shift / 2³²` wavelengths.
    pub(super) fn new(cell_m: f64, wavelength_m: f64, shift: u32) -> Self {
        const ONE: f64 = 4_294_967_296.0;
        let step = (ONE * (cell_m / wavelength_m)).round() as i64;
        Self { base: step / 2 + i64::from(shift), step }
    }

    /// The lattice cell and the fraction within it, 0 to below 1 in steps of 2⁻²⁴, of the centre of a cell of the
    /// world.
    #[inline(always)]
    pub(super) fn at(self, index: u32) -> (i32, f32) {
        let position = self.base + i64::from(index) * self.step;
        ((position >> 32) as i32, self.fraction(index))
    }

    /// The fraction alone, which needs the low halves of the numbers only.
    #[inline(always)]
    pub(super) fn fraction(self, index: u32) -> f32 {
        let position = (self.base as u32).wrapping_add(index.wrapping_mul(self.step as u32));
        (position >> 8) as f32 * (1.0 / 16_777_216.0)
    }
}
