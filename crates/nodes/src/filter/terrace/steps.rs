//! Where a step lies, and its profile: a cliff over a talus slope, broken into headlands and alcoves, absent in places.

use orograph_graph::mix;

use crate::numerics::math::lane;

/// How steps differ from a staircase.
#[derive(Clone, Copy, Debug)]
pub(super) struct Uneven {
    /// How much steps differ in height and sharpness, 0 to 1.
    pub variation: f32,
    /// How far edges are displaced, 0 to 1.
    pub edges: f32,
    /// How gentle the lower half of a riser is compared with the upper half, 0 to 1.
    pub talus: f32,
    pub seed: u32,
}

/// Noise at a cell: two of wide features, one of the size of alcoves; each is within ±1.
pub(super) type Draws = [f32; 3];

/// Displacement of the limits of steps, in steps, for a variation of 1.
pub(super) const LIMITS: f32 = 0.36;
/// Displacement of all steps by the wide noise, in steps, for a variation of 1.
pub(super) const DIP: f32 = 0.5;

impl Uneven {
    /// Returns true if steps are a staircase.
    pub fn none(&self) -> bool {
        self.variation == 0.0 && self.edges == 0.0 && self.talus == 0.0
    }

    /// Returns the new position of the height `u`, both in steps.
    #[inline(always)]
    pub fn even(&self, u: f32, sharpness: f32, draws: Draws) -> f32 {
        let dip = DIP * self.variation * draws[0];
        let u = u + dip;
        let whole = u.floor();
        let limit = |index: f32| index + LIMITS * self.variation * (2.0 * self.draw(index, 0) - 1.0);
        // limits move by less than half a step, so that a height is in its own step or in a neighbouring one
        let (below, above) = (limit(whole), limit(whole + 1.0));
        let index = if u < below { whole - 1.0 } else { whole };
        let index = if u >= above { whole + 1.0 } else { index };
        let (low, high) = (limit(index), limit(index + 1.0));
        let rest = ((u - low) / (high - low)).clamp(0.0, 1.0);
        low + (high - low) * self.riser(rest, sharpness, index, draws) - dip
    }

    /// Maps the position `rest` within the step of that index to the new one; both are 0 to 1.
    #[inline(always)]
    pub fn riser(&self, rest: f32, sharpness: f32, index: f32, draws: Draws) -> f32 {
        // a step is absent in other places than the next one
        let local = (2.0 * self.draw(index, 1) - 1.0) * draws[0] + (2.0 * self.draw(index, 2) - 1.0) * draws[1];
        let strength = 1.0 - self.variation * (0.5 * self.draw(index, 3) - 2.4 * local + 0.15);
        let strength = if strength > 0.0 { strength } else { 0.0 };
        let strength = if strength < 1.0 { strength } else { 1.0 };
        let sharpness = 1.0 + (sharpness - 1.0) * strength * strength;
        // headlands and alcoves, which do not move the limits of the step
        let shift = 2.2 * self.edges * draws[2];
        let shift = if shift > -0.9 { shift } else { -0.9 };
        let shift = if shift < 0.9 { shift } else { 0.9 };
        let rest = rest + shift * rest * (1.0 - rest);
        let upper = rest > 0.5;
        let near = if upper { 2.0 - 2.0 * rest } else { 2.0 * rest };
        // the foot of a cliff is covered by its debris
        let own = if upper { sharpness } else { 1.0 + (sharpness - 1.0) * (1.0 - 0.85 * self.talus) };
        let lift = 0.5 * lane::pow(near, own);
        if upper { 1.0 - lift } else { lift }
    }

    /// Returns a number from 0 to 1 for a step; each salt gives another one.
    #[inline(always)]
    fn draw(&self, index: f32, salt: u32) -> f32 {
        let index = if index > -1e9 { index } else { -1e9 };
        let index = if index < 1e9 { index } else { 1e9 };
        let key = (index as i32 as u32).wrapping_mul(0x8da6_b343).wrapping_add(salt.wrapping_mul(0x9e37_79b9));
        (mix(key ^ self.seed) >> 8) as f32 * (1.0 / 16_777_216.0)
    }
}
