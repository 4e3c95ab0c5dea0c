//! The contribution of a lattice point: its random draws and the windows over them.
//!
//! The noise at a place is the sum over the four corners of its lattice cell:
//!
//! ```text
//! v φ(s) φ(t) + x ψ(s) φ(t) + y φ(s) ψ(t) + w ψ(s) ψ(t),   ψ(s) = s φ(s) or the like,
//! ```
//!
//! where (s, t) is the place relative to the corner in wavelengths, v the corner's value, (x, y) its gradient and w its
//! twist. Each term is a product of a function of the column and a function of the row, which makes it fast on a
//! raster.

/// A kind of lattice noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Basis {
    /// Gradients in 32 directions, values and twists under bell-shaped windows: as isotropic as noise of four corners
    /// can be.
    ///
    /// φ(s) = (1 − s²)³ (1 + 5/4 s²), ψ(s) = s (1 − s²)³, unit gradients, uniform values with variance 1/10, twists
    /// ±√2. These numbers result from a search for the smallest dependence of power on direction (1 % for the sum of
    /// octaves) and of variance on the place in the lattice cell (0.94 to 1.02 of the mean), so that neither axes nor
    /// lattice are visible.
    Bell,
    /// Perlin's of 2002: eight gradients, φ(s) = 1 − q(|s|) with the fade q(t) = 6t⁵ − 15t⁴ + 10t³, ψ(s) = s φ(s).
    Classic,
    /// Values only, uniform from −1 to 1, with the same fade.
    Value,
}

/// The random draws of a lattice point: value, gradient along x and y, twist.
pub(crate) type Draw = [f32; 4];

/// The largest value of [`Basis::Bell`]: √(3/10), for a variance of 1/10.
const BELL_VALUE: f32 = 0.547_722_6;

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

const DIAGONAL: f32 = std::f32::consts::FRAC_1_SQRT_2;

impl Basis {
    /// Returns the factor that scales the noise to ±1: for `Bell` its bound is 1.5842, for `Classic` √½.
    pub(crate) const fn scale(self) -> f32 {
        match self {
            Self::Bell => 0.631_2,
            Self::Classic => std::f32::consts::SQRT_2,
            Self::Value => 1.0,
        }
    }

    /// Returns the gradient and the twist of each class of lattice points; the class is the six highest bits of a hash.
    fn class(self, class: usize) -> Draw {
        let turned = |[x, y]: [f32; 2], quarters: usize| match quarters {
            0 => [x, y],
            1 => [-y, x],
            2 => [-x, -y],
            _ => [y, -x],
        };
        match self {
            Self::Bell => {
                let [x, y] = turned(QUADRANT[class / 2 % 8], class / 16);
                let twist = std::f32::consts::SQRT_2;
                [0.0, x, y, if class.is_multiple_of(2) { twist } else { -twist }]
            }
            Self::Classic => {
                let [x, y] = turned([[1.0, 0.0], [DIAGONAL; 2]][class / 8 % 2], class / 16);
                [0.0, x, y, 0.0]
            }
            Self::Value => [0.0; 4],
        }
    }

    /// Returns the largest value at a lattice point.
    fn value(self) -> f32 {
        match self {
            Self::Bell => BELL_VALUE,
            Self::Classic => 0.0,
            Self::Value => 1.0,
        }
    }

    /// Returns φ(s), ψ(s), φ(s − 1) and ψ(s − 1) for a fraction s: the weights of the lattice lines before and after.
    #[inline(always)]
    pub(crate) fn weights(self, s: f32) -> [f32; 4] {
        let r = s - 1.0;
        match self {
            Self::Bell => {
                let ([phi_s, psi_s], [phi_r, psi_r]) = (bell(s), bell(r));
                [phi_s, psi_s, phi_r, psi_r]
            }
            Self::Classic | Self::Value => {
                let fade = s * s * s * (s * (s * 6.0 - 15.0) + 10.0);
                [1.0 - fade, s * (1.0 - fade), fade, r * fade]
            }
        }
    }

    /// Returns the derivatives of [`Self::weights`] with respect to s.
    #[inline(always)]
    pub(crate) fn rates(self, s: f32) -> [f32; 4] {
        let r = s - 1.0;
        match self {
            Self::Bell => {
                let ([phi_s, psi_s], [phi_r, psi_r]) = (bell_rates(s), bell_rates(r));
                [phi_s, psi_s, phi_r, psi_r]
            }
            Self::Classic | Self::Value => {
                let fade = s * s * s * (s * (s * 6.0 - 15.0) + 10.0);
                let rate = 30.0 * (s * r) * (s * r);
                [-rate, (1.0 - fade) - s * rate, rate, fade + r * rate]
            }
        }
    }
}

/// The windows of [`Basis::Bell`].
#[inline(always)]
fn bell(s: f32) -> [f32; 2] {
    let square = s * s;
    let rest = 1.0 - square;
    let cube = rest * rest * rest;
    [cube * (1.0 + 1.25 * square), s * cube]
}

/// The derivatives of [`bell`].
#[inline(always)]
fn bell_rates(s: f32) -> [f32; 2] {
    let square = s * s;
    let rest = 1.0 - square;
    let rest = rest * rest;
    [-s * rest * (3.5 + 10.0 * square), rest * (1.0 - 7.0 * square)]
}

/// The draws of an octave, multiplied by its scale.
#[derive(Clone)]
pub(super) struct Draws {
    classes: [Draw; 64],
    value_step: f32,
    value_least: f32,
}

impl Draws {
    pub fn new(basis: Basis, scale: f32) -> Self {
        let value = basis.value() * scale;
        Self {
            classes: std::array::from_fn(|class| basis.class(class).map(|part| part * scale)),
            value_step: value * (2.0 / 16_777_216.0),
            value_least: -value,
        }
    }

    /// Returns the step and the least of the values at lattice points.
    pub const fn values(&self) -> [f32; 2] {
        [self.value_step, self.value_least]
    }

    /// Returns the draw at a lattice point: the class from the six highest bits of its hash, the value from the 24
    /// lowest.
    #[inline(always)]
    pub fn at(&self, hash: u32) -> Draw {
        let [_, x, y, twist] = self.classes[(hash >> 26) as usize];
        [(hash & 0xff_ffff) as f32 * self.value_step + self.value_least, x, y, twist]
    }
}
