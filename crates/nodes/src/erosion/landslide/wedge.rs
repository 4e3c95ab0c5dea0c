//! Wedges of rock that fail on a plane.
//!
//! C. Culmann (1875): a slope of the angle β, in rock with the cohesion c, the unit weight γ and the angle of friction
//! φ, fails on a plane of the dip (β + φ) / 2 when it is higher than H꜀ = (4 c / γ) sin β cos φ / (1 − cos(β − φ)). A.
//! L. Densmore, M. A. Ellis and R. S. Anderson (1998) draw failures from H / H꜀.

use orograph_graph::Lane;

use super::{
    Params,
    draw::{Draw, Test},
    land::Land,
    scar::Scar,
};
use crate::numerics::{beds::Ground, math};

/// Acceleration of gravity in m/s².
pub(super) const GRAVITY: f64 = 9.81;
/// Directions in which the slope around a place is measured.
const DIRECTIONS: usize = 24;
/// Parts of the length over which the height of a slope is measured.
const REACHES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];
/// Length in metres of the weak zones whose thickness is given, and how the thickness goes with the length.
const THICKNESS_LENGTH_M: f64 = 100.0;
const THICKNESS_POWER: f64 = 0.7;
/// Power of H / H꜀ in the probability of a failure.
const CHANCE_POWER: f64 = 3.0;
/// Smallest angle between a slope and the plane on which it fails, in radians.
const LEAST_ANGLE: f64 = 0.02;

/// Returns Culmann's critical height in metres, for angles in radians, a cohesion in Pa and a unit weight in N/m³. It
/// is infinite for slopes that friction alone holds.
pub(super) fn critical_m(cohesion: f64, unit_weight: f64, slope: f64, friction: f64) -> f64 {
    if slope <= friction {
        return f64::INFINITY;
    }
    // 1 − cos x without cancellation
    let half = math::sin(0.5 * (slope - friction));
    4.0 * cohesion / unit_weight * math::sin(slope) * math::cos(friction) / (2.0 * half * half)
}

/// The strength of the rock under every cell.
pub(super) struct Strength<'a> {
    /// Tangent of the steepest slope of a cell; relative to that of its layer with layers.
    pub steepest: Lane<'a>,
    pub layers: Option<Ground<'a>>,
    /// How far harder rock stands above the slopes that are tested, in metres; empty on even ground.
    pub knolls: &'a [f32],
    /// Angle by which shaking lowers the angle of friction, in radians.
    pub shaken: f64,
    pub cohesion: f64,
    pub unit_weight: f64,
}

impl Strength<'_> {
    /// Returns the tangent of the steepest slope of a cell at an elevation.
    pub fn tangent(&self, cell: usize, elevation_m: f64) -> f64 {
        let steepest = f64::from(self.steepest.at(cell));
        self.layers.as_ref().map_or(steepest, |layers| steepest * layers.tangent(cell, elevation_m))
    }

    /// Returns the angle of friction in radians and the cohesion of a cell at an elevation.
    fn at(&self, cell: usize, elevation_m: f64) -> [f64; 2] {
        let weakness = self.layers.as_ref().map_or(1.0, |layers| layers.weakness(cell, elevation_m).max(1e-6));
        let friction = math::atan(self.tangent(cell, elevation_m)) - self.shaken;
        [friction.max(0.0), self.cohesion * (1.0 / weakness)]
    }
}

/// Returns the scar of a test. Returns None when the slope holds.
pub(super) fn fails(land: &Land, strength: &Strength<'_>, test: &Test, params: &Params) -> Option<Scar> {
    let (toe_m, length_m) = (test.place_m(), test.length_m(params));
    let z = land.height_m(toe_m);
    // the direction of the land that is higher, at the scale of the scar
    let mut towards = [0.0; 2];
    for k in 0..DIRECTIONS {
        let angle = k as f64 * (std::f64::consts::TAU / DIRECTIONS as f64);
        let ray = [math::cos(angle), math::sin(angle)];
        let place = [0, 1].map(|axis| toe_m[axis] + length_m * ray[axis]);
        let rise = if land.holds(place) { (land.height_m(place) - z).max(0.0) } else { 0.0 };
        towards = [0, 1].map(|axis| towards[axis] + rise * rise * ray[axis]);
    }
    if towards[0] * towards[0] + towards[1] * towards[1] <= 0.0 {
        return None;
    }
    let scatter = params.scatter.to_radians();
    let turned = |draw: Draw| scatter * (2.0 * test.unit(draw) - 1.0);
    let azimuth = math::atan2(towards[1], towards[0]) + turned(Draw::Strike);
    let up = [math::cos(azimuth), math::sin(azimuth)];
    let [friction, cohesion] = strength.at(land.cell_at(toe_m), z);
    let knoll_m = |place: [f64; 2]| match strength.knolls {
        [] => 0.0,
        knolls => land.between(place, |cell| f64::from(knolls[cell])),
    };
    let even_z = z - knoll_m(toe_m);
    let (mut most, mut slope) = (0.0, 0.0);
    for part in REACHES {
        let run = part * length_m;
        let place = [0, 1].map(|axis| toe_m[axis] + run * up[axis]);
        let high = if land.holds(place) { land.height_m(place) - knoll_m(place) - even_z } else { 0.0 };
        let angle = math::atan(high / run);
        let ratio = high / critical_m(cohesion, strength.unit_weight, angle, friction);
        if ratio > most {
            (most, slope) = (ratio, angle);
        }
    }
    if math::pow(most, CHANCE_POWER) <= test.unit(Draw::Chance) {
        return None;
    }
    let dip = (0.5 * (slope + friction) + turned(Draw::Dip)).clamp(0.0, (slope - LEAST_ANGLE).max(0.0));
    Some(Scar {
        toe_m,
        toe_height_m: z,
        up,
        dip: math::tan(dip),
        thickness_m: params.thickness * math::pow(length_m / THICKNESS_LENGTH_M, THICKNESS_POWER),
        length_m,
        width_m: length_m * (0.4 + 0.6 * test.unit(Draw::Width)),
        roughness: params.roughness,
        outline: test.hash(Draw::Outline),
    })
}
