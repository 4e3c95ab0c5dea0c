//! The recursions over octaves, at one sample. Noise n has the standard deviation 0.305 and slopes per wavelength.
//!
//! An octave that the raster cannot represent fully contributes, for the rest, its mean over the distribution of the
//! noise.

use crate::numerics::{math::lane, noise::fold::Fold};

/// Constants of one octave.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    /// gainᵏ, or its equivalent.
    pub gain: f32,
    /// lacunarityᵏ.
    pub ratio: f32,
    /// Fraction of the octave that the raster can represent.
    pub fade: f32,
    /// Its crests, and the means of |n|, n² and (1 − |n|)², times the fraction that the raster cannot represent.
    pub fold: Fold,
    pub means: [f32; 3],
    /// Factor from slopes per wavelength to slopes of the terrain in m/m.
    pub steepness: f32,
    /// Factor of the weight that a hybrid passes to the next octave.
    pub lift: f32,
    /// 1 for the first octave, in a blend also for the second, and 0 for all others.
    pub first: f32,
    /// See [`super::Params`].
    pub offset: f32,
    pub damping: f32,
    pub warp: f32,
    /// Ratio of the amplitudes of successive octaves.
    pub fall: f32,
}

impl Layer {
    /// Returns the constants that the shader reads.
    pub const fn words(&self) -> [f32; 12] {
        let ([round, half_per_round, top], [mean, _, square]) = (self.fold.parts(), self.means);
        let Self { gain, fade, steepness, lift, first, offset, damping, .. } = *self;
        [gain, fade, round, half_per_round, top, mean, square, steepness, lift, first, offset, damping]
    }

    /// 1 − |n|.
    #[inline(always)]
    fn crest(&self, noise: f32) -> f32 {
        self.fade * (self.fold.crest(noise) - 1.0) + (1.0 - self.means[0])
    }

    /// (1 − |n|)².
    #[inline(always)]
    fn squared_crest(&self, noise: f32) -> f32 {
        let crest = self.fold.crest(noise).max(0.0);
        self.fade * crest * crest + self.means[2]
    }

    /// n².
    #[inline(always)]
    fn square(&self, noise: f32) -> f32 {
        self.fade * noise * noise + self.means[1]
    }
}

/// Constants that turn the result of a recursion into heights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Finish {
    /// Metres per unit of a plain sum of octaves.
    pub unit_m: f32,
    /// Elevation where ridges begin, and the reciprocal of the metres over which they reach full strength.
    pub low_m: f32,
    pub per_metre: f32,
}

/// A recursion over octaves whose state is `N` numbers.
pub(super) trait Rule<const N: usize>: Sync {
    /// True if it uses the slopes of the noise.
    const SLOPES: bool = false;
    /// True if it displaces its noise.
    const SHIFTS: bool = false;
    /// The state before the first octave.
    const START: [f32; N];

    /// Adds an octave. Must always be inlined, like the other functions.
    fn step(layer: &Layer, noise: f32, slope: [f32; 2], state: &mut [f32; N]);

    /// Returns the displacement, in wavelengths, at which the noise of an octave is sampled.
    #[inline(always)]
    fn shift(_: &Layer, _: &[f32; N]) -> [f32; 2] {
        [0.0; 2]
    }

    /// Returns the height, in the recursion's own unit.
    #[inline(always)]
    fn height(_: &Finish, state: &[f32; N]) -> f32 {
        state[0]
    }
}

/// h = Σ gainᵏ (2 |n| − 1).
pub(super) struct Billow;

impl Rule<1> for Billow {
    const START: [f32; 1] = [0.0];

    #[inline(always)]
    fn step(layer: &Layer, noise: f32, _: [f32; 2], [height]: &mut [f32; 1]) {
        *height += layer.gain * (1.0 - 2.0 * layer.crest(noise));
    }
}

/// h += s, s = w gainᵏ (n + o), w ← s gain^(−k detail), limited to 1. State: h, w.
pub(super) struct Hybrid;

impl Hybrid {
    /// Width of the transition to the limit of a weight: a corner there would be visible as a line in the terrain.
    const ROUND: f32 = 0.15;

    /// Returns the smaller of a number and 1, with a parabolic transition.
    #[inline(always)]
    fn held(weight: f32) -> f32 {
        let weight = weight.min(1.0 + Self::ROUND);
        let over = (weight - (1.0 - Self::ROUND)).max(0.0);
        weight - over * over * (0.25 / Self::ROUND)
    }
}

impl Rule<2> for Hybrid {
    const START: [f32; 2] = [0.0, 1.0];

    #[inline(always)]
    fn step(layer: &Layer, noise: f32, _: [f32; 2], [height, weight]: &mut [f32; 2]) {
        let signal = *weight * (layer.gain * (layer.fade * noise + layer.offset));
        *height += signal;
        *weight = Self::held(signal * layer.lift);
    }
}

/// h = n + o first, then h += gainᵏ (n + o) h.
pub(super) struct Heterogeneous;

impl Rule<1> for Heterogeneous {
    const START: [f32; 1] = [0.0];

    #[inline(always)]
    fn step(layer: &Layer, noise: f32, _: [f32; 2], [height]: &mut [f32; 1]) {
        *height += layer.gain * (layer.fade * noise + layer.offset) * (layer.first + *height);
    }
}

/// h += gainᵏ n / (1 + κ |d|²), d the slope of all octaves so far. State: h, d.
pub(super) struct Eroded;

impl Rule<3> for Eroded {
    const SLOPES: bool = true;
    const START: [f32; 3] = [0.0; 3];

    #[inline(always)]
    fn step(layer: &Layer, noise: f32, slope: [f32; 2], [height, dx, dy]: &mut [f32; 3]) {
        *dx += layer.fade * layer.steepness * slope[0];
        *dy += layer.fade * layer.steepness * slope[1];
        // a limit far above any terrain keeps the square finite
        let square = (*dx * *dx + *dy * *dy).min(1e30);
        *height += layer.gain * layer.fade * noise / (1.0 + layer.damping * square);
    }
}

/// h += a (1 − |n|), D −= a n ∇n, a ← gain a min(h, 1), where n is sampled at an offset of D. State: h, D, a.
pub(super) struct Swiss;

impl Rule<4> for Swiss {
    const SLOPES: bool = true;
    const SHIFTS: bool = true;
    const START: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

    #[inline(always)]
    fn step(layer: &Layer, noise: f32, slope: [f32; 2], [height, dx, dy, share]: &mut [f32; 4]) {
        *height += *share * layer.crest(noise);
        let pull = *share * layer.fade * noise;
        *dx -= pull * slope[0];
        *dy -= pull * slope[1];
        *share *= layer.fall * height.clamp(0.0, 1.0);
    }

    #[inline(always)]
    fn shift(layer: &Layer, state: &[f32; 4]) -> [f32; 2] {
        let reach = 0.15 * layer.warp * layer.ratio;
        [reach * state[1], reach * state[2]]
    }
}

/// h += a n², Dw += w n ∇n, Dd += d n ∇n, a = 0.8 gainᵏ⁻¹ (1 − q / (1 + |Dd|²)). State: h, Dw, Dd.
pub(super) struct Jordan;

impl Rule<5> for Jordan {
    const SLOPES: bool = true;
    const SHIFTS: bool = true;
    const START: [f32; 5] = [0.0; 5];

    #[inline(always)]
    fn step(layer: &Layer, noise: f32, slope: [f32; 2], [height, wx, wy, dx, dy]: &mut [f32; 5]) {
        let damped = 1.0 - layer.damping / (1.0 + (*dx * *dx + *dy * *dy));
        *height += (layer.first + (1.0 - layer.first) * layer.gain * damped) * layer.square(noise);
        let pull = layer.fade * noise;
        let [warp, damp] = [0.35 + 0.05 * layer.first, 0.8 + 0.2 * layer.first];
        *wx += layer.warp * warp * pull * slope[0];
        *wy += layer.warp * warp * pull * slope[1];
        *dx += damp * pull * slope[0];
        *dy += damp * pull * slope[1];
    }

    #[inline(always)]
    fn shift(_: &Layer, state: &[f32; 5]) -> [f32; 2] {
        [state[1], state[2]]
    }
}

/// The first two octaves are plain. The finer ones are plain where that base is low and ridges where it is high. State:
/// base, plain detail, ridges, weight of the next ridges.
pub(super) struct Blend;

impl Rule<4> for Blend {
    const START: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

    #[inline(always)]
    fn step(layer: &Layer, noise: f32, _: [f32; 2], [base, plain, ridges, weight]: &mut [f32; 4]) {
        let octave = layer.gain * layer.fade * noise;
        *base += layer.first * octave;
        let fine = 1.0 - layer.first;
        *plain += fine * octave;
        let ridge = *weight * layer.squared_crest(noise);
        *ridges += fine * layer.gain * ridge;
        *weight = layer.first.max((2.0 * ridge).min(1.0));
    }

    #[inline(always)]
    fn height(finish: &Finish, &[base, plain, ridges, _]: &[f32; 4]) -> f32 {
        let high = lane::smoothstep((finish.unit_m * base - finish.low_m) * finish.per_metre);
        base + plain + (ridges - plain) * high
    }
}
