//! The shape of one crater: its even profile, and what makes it uneven.
//!
//! Rims of fresh lunar craters leave a circle by some percent of the radius. Walls of complex craters slump along arcs,
//! so that terraces end and overlap; central peaks are clusters of hills; ejecta lie in hummocks near the rim and in
//! radial ridges beyond (H. J. Melosh, 1989, "Impact Cratering").

use crate::numerics::{
    math::{self, smoothstep},
    noise::place,
};

/// Distances from the centre, in radii, at which the ejecta begin to fade and at which they end.
pub(super) const EJECTA: [f64; 2] = [2.0, 3.0];
/// Number of terraces on a complex crater's wall.
const TERRACES: f64 = 3.0;
/// Height of a central peak as a fraction of the diameter, and its radius as a fraction of the crater's.
const PEAK: [f64; 2] = [0.02, 0.2];

/// Shape of craters.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    /// Depth and rim height of simple craters, as fractions of the diameter.
    pub depth: f64,
    pub rim: f64,
    /// Diameter above which craters are complex.
    pub transition_m: f64,
    /// How uneven rim, walls and floor are, and how rough the ejecta, 0 to 1.
    pub irregularity: f64,
    pub ejecta: f64,
}

/// Shape of craters of one diameter.
#[derive(Clone, Copy)]
pub(super) struct Form {
    simple: Shape,
    /// Weight of the complex shape.
    complex: f64,
    /// Of the complex shape: depth as a fraction of the diameter, and floor radius as a fraction of the radius.
    shallow: f64,
    floor: f64,
}

/// What distinguishes craters of one size.
#[derive(Clone, Copy)]
pub(super) struct Own {
    /// Remaining fraction of the depth.
    pub fresh: f64,
    pub key: u32,
    /// Side of a cell in radii: finer features are left out.
    pub cell: f64,
}

impl Own {
    /// Returns how much of the unevenness shows: none of it if the crater is too small to be more than a bowl.
    fn seen(&self) -> f64 {
        smoothstep((0.25 / self.cell - 1.0) / 2.0)
    }
}

impl Shape {
    pub fn of(self, diameter_m: f64) -> Form {
        let ratio = (diameter_m / self.transition_m).max(1.0);
        Form {
            simple: self,
            complex: smoothstep(ratio - 1.0),
            shallow: self.depth * math::pow(ratio, -0.7),
            floor: (0.37 * math::pow(ratio, 0.25)).min(0.75),
        }
    }
}

impl Form {
    /// Returns whether the crater is a body of revolution, because it is to be one or is too small to show more.
    pub fn is_even(&self, own: &Own) -> bool {
        own.seen() == 0.0 || self.simple.irregularity == 0.0 && self.simple.ejecta == 0.0
    }

    /// Returns the height of an uneven crater at a place in radii from the centre, as a fraction of the diameter.
    pub fn height(&self, [x, y]: [f64; 2], own: &Own) -> f64 {
        let radii = (x * x + y * y).sqrt();
        let Shape { irregularity, ejecta, .. } = self.simple;
        let seen = own.seen();
        let inverse = 1.0 / radii.max(1e-9);
        let (east, south) = (x * inverse, y * inverse);
        let around = |waves: f64, salt: u32| place::at([waves * east, waves * south], own.key ^ salt);
        // unevenness of the rim fades towards the centre, where directions meet, and outwards
        let amount = seen * irregularity;
        let bends = amount * smoothstep(1.6 * radii) * smoothstep((2.0 - radii) / 0.6);
        let wide = if bends > 0.0 { around(1.4, 1) } else { 0.0 };
        let bend = if bends > 0.0 { bends * (0.13 * wide + 0.05 * around(4.5, 2)) } else { 0.0 };
        let out = radii * (1.0 + bend);
        let value = if out > 1.25 { self.even(out) } else { self.uneven(out, amount, [x, y], own) };
        let mut value = value * (1.0 - 0.5 * bends * wide * smoothstep(2.0 * out - 1.0));
        if ejecta > 0.0 && out > 0.85 && out < EJECTA[1] {
            // hummocks give way to radial ridges
            let radial = smoothstep((out - 1.1) / 0.7);
            let mut rough = 0.0;
            if radial > 0.0 {
                let fine = place::at([7.0 * east + 0.6 * x, 7.0 * south + 0.6 * y], own.key ^ 7);
                rough += radial * (around(5.0, 5) + 0.5 * fine);
            }
            if radial < 1.0 {
                let fine = place::at([7.3 * x, 7.3 * y], own.key ^ 8);
                rough += 0.8 * (1.0 - radial) * (place::at([3.2 * x, 3.2 * y], own.key ^ 6) + 0.5 * fine);
            }
            let thick = smoothstep((out - 0.85) / 0.25) * smoothstep((EJECTA[1] - out) / 1.6) / (out * out);
            value += seen * ejecta * self.simple.rim * thick * rough;
        }
        value * own.fresh
    }

    /// Returns the height of a crater whose rim is rounded off by age and whose wall, floor and peak are uneven.
    fn uneven(&self, out: f64, amount: f64, [x, y]: [f64; 2], own: &Own) -> f64 {
        let Shape { depth, rim, .. } = self.simple;
        let worn = 1.0 - own.fresh;
        let beyond = rim / (out * out * out).max(0.2);
        let deep = depth + rim;
        let coarse = place::at([2.3 * x, 2.3 * y], own.key ^ 3);
        let fine = place::at([6.1 * x, 6.1 * y], own.key ^ 4);
        let wall = smoothstep(2.0 * out - 0.4);
        // blocks and chutes on the wall, slumps on the floor
        let bowl = deep * out * out - depth + amount * deep * (0.05 * fine * wall + 0.05 * coarse * (1.0 - wall));
        let mut inside = bowl;
        if self.complex > 0.0 {
            let complex = self.slumped(out, amount, [x, y], [coarse, fine], own);
            inside += self.complex * (complex - bowl);
        }
        // the crest is a cusp only while it is fresh
        -smooth_max(-inside, -beyond, amount * (0.01 + 0.10 * worn) * deep)
    }

    /// Returns the height inside a complex crater: arcs of terraces that end, hills on the floor, a broken peak.
    fn slumped(&self, out: f64, amount: f64, [x, y]: [f64; 2], [coarse, fine]: [f64; 2], own: &Own) -> f64 {
        let inverse = 1.0 / out.max(1e-9);
        let arcs = |waves: f64, salt: u32| place::at([waves * x * inverse, waves * y * inverse], own.key ^ salt);
        let floor = self.floor * (1.0 + 0.2 * amount * arcs(1.8, 21));
        let up = ((out - floor) / (1.0 - floor)).max(0.0);
        let turns = std::f64::consts::TAU * TERRACES;
        // the phase drifts along the wall, so that arcs begin and end, and their height differs
        let drift = amount * (1.5 * arcs(1.7, 22) + 0.3 * coarse) * smoothstep(4.0 * up) * smoothstep(3.0 * (1.0 - up));
        let strong = 0.85 * (1.0 + amount * (2.4 * arcs(2.6, 23) + 0.8 * fine)).clamp(0.0, 1.5);
        let stepped = up - strong * math::sin(turns * up + std::f64::consts::TAU * drift) / turns;
        let concave = stepped * (1.0 - 0.25 * amount * (1.0 - stepped));
        let (px, py) = (x - 0.05 * amount * coarse, y + 0.04 * amount * fine);
        let from_peak = ((px * px + py * py).sqrt() * (1.0 + 0.7 * amount * fine) / PEAK[1]).min(1.0);
        let peak = PEAK[0].min(0.8 * self.shallow) * (1.0 - from_peak * from_peak) * (1.0 - from_peak * from_peak);
        let hills = place::at([14.0 * x, 14.0 * y], own.key ^ 24);
        let peak = peak * (1.0 + amount * (1.2 * hills + 0.5 * fine));
        let level = amount * self.shallow * (0.04 * coarse + 0.025 * hills.max(0.0)) * (1.0 - smoothstep(2.0 * up));
        (self.shallow + self.simple.rim) * concave - self.shallow + peak + level
    }

    /// Returns the height of an even crater at a distance of `radii` from the centre, as a fraction of the diameter.
    pub fn even(&self, radii: f64) -> f64 {
        let Shape { depth, rim, .. } = self.simple;
        if radii > 1.0 {
            let fade = smoothstep((EJECTA[1] - radii) / (EJECTA[1] - EJECTA[0]));
            return rim / (radii * radii * radii) * fade;
        }
        let simple = (depth + rim) * radii * radii - depth;
        if self.complex == 0.0 {
            return simple;
        }
        let up = ((radii - self.floor) / (1.0 - self.floor)).max(0.0);
        let turns = std::f64::consts::TAU * TERRACES;
        let wall = up - 0.8 * math::sin(turns * up) / turns;
        let from_peak = (radii / PEAK[1]).min(1.0);
        let peak = PEAK[0].min(0.8 * self.shallow) * (1.0 - from_peak * from_peak) * (1.0 - from_peak * from_peak);
        let complex = (self.shallow + rim) * wall - self.shallow + peak;
        simple + self.complex * (complex - simple)
    }
}

/// Returns the larger of two heights, rounded off where they differ by less than `radius`.
fn smooth_max(a: f64, b: f64, radius: f64) -> f64 {
    if radius <= 0.0 {
        return a.max(b);
    }
    let h = (1.0 - (a - b).abs() / radius).max(0.0);
    a.max(b) + 0.25 * h * h * radius
}
