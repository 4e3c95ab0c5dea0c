//! The lattice of one octave: hash, gradients, positions.

use orograph_graph::mix;

use super::Gradients;

/// Factor that brings noise of unit gradients and of values within ±½, whose extremes are ±(√½ + ½), to ±1.
pub(crate) const NOISE_SCALE: f32 = 0.828_427_1;

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

    /// By how much the lattices of octaves are turned, from coarse to fine, as `[cos, sin]`: multiples of 36.87°, whose
    /// sine is 3/5, less right angles, which leave a square lattice as it is. Their quadruples, which tell how the
    /// lattice's own fourfold pattern lies, are 147.5° apart, so that octaves that follow each other all but undo what
    /// they prefer. `Classic` lattices are not turned.
    pub(super) fn turns(self) -> impl Iterator<Item = [f64; 2]> {
        let turn = move |&[cos, sin]: &[f64; 2]| {
            let [c, s] = match self {
                Self::Even => [0.8 * cos - 0.6 * sin, 0.6 * cos + 0.8 * sin],
                Self::Classic => [cos, sin],
            };
            Some(if c < 0.0 { [s, -c] } else { [c, s] })
        };
        let first = turn(&[1.0, 0.0]);
        std::iter::successors(first, turn)
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

/// The value at a lattice point, from −½ to below ½ evenly: the 24 lowest bits of its hash.
#[inline(always)]
pub(super) fn value(hash: u32) -> f32 {
    (hash & 0xff_ffff) as f32 * (1.0 / 16_777_216.0) - 0.5
}

/// A fraction of 2⁻³² units to 24 bits, exactly.
#[inline(always)]
pub(super) fn fraction(units: u32) -> f32 {
    (units >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Positions of cell centres in an octave's lattice, in units of its wavelength, as 32.32 fixed-point numbers: the whole
/// part names the lattice cell, the rest is the exact fraction within it. They are linear in the world's cell indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Lattice {
    pub(super) base: [i64; 2],
    /// Steps from column to column, never negative and less than one half.
    pub(super) along: [i64; 2],
    /// Steps from row to row.
    pub(super) across: [i64; 2],
}

impl Lattice {
    /// A lattice of `wavelength_m` metres under cells of `cell_m` metres, turned by the angle of the unit vector
    /// `[cos, sin]`, neither of which is negative, and shifted by `shift / 2³²` wavelengths.
    pub(super) fn new(cell_m: f64, wavelength_m: f64, [cos, sin]: [f64; 2], shift: [u32; 2]) -> Self {
        const ONE: f64 = 4_294_967_296.0;
        let step = |part: f64| (ONE * (part * (cell_m / wavelength_m))).round() as i64;
        let (along, across) = ([step(cos), step(sin)], [step(-sin), step(cos)]);
        let base = std::array::from_fn(|axis| (along[axis] + across[axis]) / 2 + i64::from(shift[axis]));
        Self { base, along, across }
    }

    /// The position of the centre of a cell of the world.
    #[inline(always)]
    pub(super) fn at(&self, [column, row]: [u32; 2]) -> [i64; 2] {
        std::array::from_fn(|axis| {
            self.base[axis] + i64::from(column) * self.along[axis] + i64::from(row) * self.across[axis]
        })
    }

    /// Steps from column to column in wavelengths.
    #[inline(always)]
    pub(super) fn steps(&self) -> [f32; 2] {
        self.along.map(|step| step as f32 * (1.0 / 4_294_967_296.0))
    }
}
