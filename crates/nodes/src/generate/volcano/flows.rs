//! Lava flows: tongues with levees and lobed fronts, and the scoria cones at vents on the flanks.
//!
//! Scoria cones after C. A. Wood (1980), "Morphometric evolution of cinder cones": 0.18 times as high as wide, with
//! craters 0.40 times as wide as their base.

use std::f64::consts::{PI, TAU};

use super::shape::smooth_max;
use crate::numerics::{
    math::{self, smoothstep},
    noise::place::{self, along, unit},
};

/// Height and crater of a scoria cone as fractions of the width of its base.
pub(super) const SCORIA: [f64; 2] = [0.18, 0.40];

/// A tongue of lava.
#[derive(Clone, Copy, Debug)]
pub(super) struct LavaFlow {
    /// Direction from the centre.
    angle: f64,
    /// Distances of its vent and its front from the centre.
    from_m: f64,
    to_m: f64,
    /// Half width near the front.
    half_m: f64,
    thick_m: f64,
    /// Fraction of the gullies under it that it fills.
    fills: f64,
    key: u32,
}

impl LavaFlow {
    pub fn new(key: u32, height_m: f64, radius_m: f64) -> Self {
        let from = 0.05 + 0.5 * unit(key, 21) * unit(key, 22);
        let to = from + (1.02 - from) * (0.35 + 0.6 * unit(key, 23));
        Self {
            angle: TAU * unit(key, 24),
            from_m: from * radius_m,
            to_m: to * radius_m,
            half_m: radius_m * (0.025 + 0.055 * unit(key, 25) * unit(key, 26)),
            thick_m: height_m * (0.008 + 0.012 * unit(key, 27)),
            fills: unit(key, 28).sqrt(),
            key,
        }
    }

    /// Returns the thickness, and the fraction of gullies that is filled, at an angle and distance from the centre.
    pub fn at(&self, angle: f64, distance_m: f64) -> [f64; 2] {
        if distance_m < self.from_m || distance_m > self.to_m {
            return [0.0; 2];
        }
        let away = (angle - self.angle + PI).rem_euclid(TAU) - PI;
        if (away * distance_m).abs() > 4.0 * self.half_m {
            return [0.0; 2];
        }
        let bend = 1.3 * along(distance_m / (9.0 * self.half_m), self.key ^ 2);
        let across_m = away * distance_m - bend * self.half_m;
        let t = (distance_m - self.from_m) / (self.to_m - self.from_m);
        let edge = if across_m > 0.0 { self.key ^ 5 } else { self.key ^ 6 };
        let ragged = 1.0
            + 0.3 * along(distance_m / (1.5 * self.half_m), edge)
            + 0.15 * along(distance_m / (0.5 * self.half_m), edge ^ 64);
        // narrow at the vent, and round at the front
        let left = ((self.to_m - distance_m) / (1.6 * self.half_m)).min(1.0);
        let wide_m = self.half_m * (0.35 + 0.65 * t) * ragged * (left * (2.0 - left)).sqrt();
        let x = across_m.abs() / wide_m.max(1e-3);
        if x >= 1.0 {
            return [0.0; 2];
        }
        let side = 1.0 - x * x * x * x;
        let channel = (1.0 - smoothstep(x / 0.7)) * (0.55 - 0.45 * t);
        let swell = 1.0 + 0.18 * along(distance_m / (0.7 * self.half_m) + 2.0 * x * x, self.key ^ 9);
        let start = smoothstep(t / 0.12);
        let thick_m = self.thick_m * (0.5 + 0.5 * t) * start * swell * (side - channel).max(0.0);
        [thick_m, self.fills * start * smoothstep((1.0 - x) / 0.4)]
    }
}

/// A cone at a vent on the flank.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scoria {
    /// Place relative to the centre of the volcano.
    pub at_m: [f64; 2],
    /// Width of its base.
    pub wide_m: f64,
    /// Elevation of the flank under it.
    pub ground_m: f64,
    /// True if its crater is open downslope.
    open: bool,
    key: u32,
}

impl Scoria {
    /// Creates a cone at the flank; `rift` is the direction of the zone, across the volcano, along which most lie.
    pub fn new(key: u32, radius_m: f64, rift: f64, ground_m: impl Fn(f64, f64) -> f64) -> Self {
        let scattered = unit(key, 31) < 0.3;
        let (side, spread) = (if unit(key, 32) < 0.5 { 0.0 } else { PI }, unit(key, 33) + unit(key, 34) - 1.0);
        let angle = if scattered { TAU * unit(key, 33) } else { rift + side + 0.45 * spread };
        let distance_m = radius_m * (0.26 + 0.72 * unit(key, 35));
        let size = unit(key, 36);
        Self {
            at_m: [distance_m * math::sin(angle), -distance_m * math::cos(angle)],
            wide_m: radius_m * (0.03 + 0.065 * size * size),
            ground_m: ground_m(angle, distance_m),
            open: unit(key, 37) < 0.45,
            key,
        }
    }

    /// Returns the elevation with the cone, at a place relative to the centre of the volcano.
    pub fn on(&self, height_m: f64, [x, y]: [f64; 2]) -> f64 {
        let (dx, dy) = (x - self.at_m[0], y - self.at_m[1]);
        let square = dx * dx + dy * dy;
        if square > self.wide_m * self.wide_m {
            return height_m;
        }
        let out = math::hypot(self.at_m[0], self.at_m[1]).max(1e-9);
        // direction from the vent relative to downslope
        let turn = math::atan2(dx * self.at_m[1] - dy * self.at_m[0], dx * self.at_m[0] + dy * self.at_m[1]) / PI;
        let uneven = 1.0
            + 0.22 * place::at([2.2 * dx / self.wide_m, 2.2 * dy / self.wide_m], self.key)
            + 0.08 * place::at([7.0 * dx / self.wide_m, 7.0 * dy / self.wide_m], self.key);
        let (r, high_m) = (square.sqrt() * uneven, SCORIA[0] * self.wide_m);
        let rim_m = 0.5 * SCORIA[1] * self.wide_m;
        let slope = high_m / (0.5 * self.wide_m - rim_m);
        let top_m = self.ground_m + high_m;
        let gap = if self.open { 1.0 - smoothstep((turn.abs() - 0.08) / 0.14) } else { 0.0 };
        let cone_m = if r > rim_m {
            top_m - slope * (r - rim_m)
        } else {
            let bowl = r / rim_m;
            top_m - 0.55 * high_m * (1.0 - bowl * bowl)
        };
        let open_m = self.ground_m + 0.45 * high_m - 0.25 * (r * (1.0 - turn.abs())).min(out);
        // the foot is talus, gentler than the flank
        smooth_max(height_m, cone_m + gap * (open_m - cone_m).min(0.0), 0.35 * high_m)
    }
}
