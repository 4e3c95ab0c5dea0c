//! The volcano as a function of place: its cone, gullied, with lava flows, scoria cones and a crater.

use super::{
    cone::Cone,
    flows::{LavaFlow, Scoria},
    gullies::Gullies,
};
use crate::numerics::{
    math::{self, smoothstep},
    noise::place::{self, Octaves, unit},
};

/// Slope of a crater's walls if they are even: tan 60°.
const WALL: f64 = 1.732_050_807_568_877_2;

/// What a volcano is made of.
#[derive(Clone, Debug)]
pub(super) struct Volcano {
    pub cone: Cone,
    pub height_m: f64,
    pub radius_m: f64,
    /// Radius of the crater's rim, and depth of its floor below it.
    pub crater_m: [f64; 2],
    /// Fraction of the crater's depth to which its wall is open, and the direction of the gap in radians.
    pub breach: [f64; 2],
    /// How uneven outline, flanks and rim are, 0 to 1.
    pub irregularity: f64,
    pub gullies: Gullies,
    pub flows: Vec<LavaFlow>,
    pub scoria: Vec<Scoria>,
    pub cell_m: f64,
    pub seed: u32,
}

impl Volcano {
    /// Adds flows and scoria cones.
    pub fn furnish(&mut self, flows: i64, cones: i64) {
        let flow = |k: i64| LavaFlow::new(place::key(self.seed ^ 0x51, k), self.height_m, self.radius_m);
        let flows: Vec<LavaFlow> = (0..flows).map(flow).collect();
        let rift = std::f64::consts::TAU * unit(self.seed, 41);
        let scoria = |k: i64| {
            let key = place::key(self.seed ^ 0x52, k);
            Scoria::new(key, self.radius_m, rift, |angle, distance_m| {
                let place = [math::sin(angle) * distance_m, -math::cos(angle) * distance_m];
                self.cone.height(self.bent(angle, distance_m, place)[1])
            })
        };
        let scoria: Vec<Scoria> = (0..cones).map(scoria).collect();
        (self.flows, self.scoria) = (flows, scoria);
    }

    /// Returns the angle and the distance from the centre at which the even volcano is looked up.
    fn bent(&self, angle: f64, distance_m: f64, place_m: [f64; 2]) -> [f64; 2] {
        if self.irregularity == 0.0 {
            return [angle, distance_m];
        }
        let [x, y] = place_m.map(|metres| metres / self.radius_m);
        let wide = place::at([1.1 * x, 1.1 * y], self.seed ^ 0x61);
        let lobes = place::at([3.1 * x, 3.1 * y], self.seed ^ 0x62);
        let turn = place::at([1.7 * x + 5.0, 1.7 * y], self.seed ^ 0x63);
        let share = smoothstep(distance_m / (0.8 * self.radius_m));
        [
            angle + 0.35 * self.irregularity * turn,
            distance_m * (1.0 + self.irregularity * (0.26 * wide * share.sqrt() + 0.12 * lobes * share)),
        ]
    }

    /// Returns the height at a place relative to the centre, x to the east and y to the south.
    pub fn height(&self, [x, y]: [f64; 2]) -> f64 {
        let distance_m = (x * x + y * y).sqrt();
        if distance_m > 1.6 * self.radius_m {
            return 0.0;
        }
        // clockwise from north, as an azimuth
        let angle = math::atan2(x, -y);
        let [bent, away_m] = self.bent(angle, distance_m, [x, y]);
        let cone = self.cone.height(away_m);
        let mut cut = self.gullies.cut(bent, away_m);
        let (mut lava, mut keep) = (0.0_f64, 1.0_f64);
        for flow in &self.flows {
            let [thick, fills] = flow.at(bent, away_m);
            // a flow on another is thinner than both
            lava = lava.max(thick) + 0.4 * lava.min(thick);
            keep = keep.min(1.0 - fills);
        }
        cut *= 0.12 + 0.88 * keep;
        // the cut ends where the apron meets the plain
        let rough = self.rough([x, y], cone);
        let mut value =
            (cone - cut.min(0.85 * cone) + lava * smoothstep(cone / (0.02 * self.height_m + 1e-9)) + rough).max(0.0);
        for scoria in &self.scoria {
            value = scoria.on(value, [x, y]);
        }
        self.crater(value, angle, distance_m, [x, y])
    }

    /// Returns whether the volcano is a body of revolution.
    pub fn is_even(&self) -> bool {
        let smooth = !self.gullies.any() && self.irregularity == 0.0 && self.breach[0] == 0.0;
        smooth && self.flows.is_empty() && self.scoria.is_empty()
    }

    /// Returns the height of a body of revolution at a distance from its axis.
    pub fn even_height(&self, distance_m: f64) -> f64 {
        let cone = self.cone.height(distance_m);
        let [rim_m, depth_m] = self.crater_m;
        if distance_m >= rim_m {
            return cone;
        }
        let rim = self.cone.height(rim_m);
        cone.min((rim - WALL * (rim_m - distance_m)).max(rim - depth_m))
    }

    /// Returns the small unevenness of ash and blocks.
    fn rough(&self, place_m: [f64; 2], cone: f64) -> f64 {
        if self.irregularity == 0.0 {
            return 0.0;
        }
        let octaves = Octaves {
            wavelength_m: 0.11 * self.radius_m,
            count: 5,
            gain: 0.55,
            cell_m: self.cell_m,
            seed: self.seed ^ 0x71,
        };
        self.irregularity * 0.012 * self.height_m * octaves.at(place_m) * smoothstep(cone / (0.1 * self.height_m))
    }

    /// Returns the height with the crater and its gap.
    fn crater(&self, value: f64, angle: f64, distance_m: f64, [x, y]: [f64; 2]) -> f64 {
        let [rim_m, depth_m] = self.crater_m;
        if rim_m == 0.0 || distance_m > 7.0 * rim_m {
            return value;
        }
        let rim = self.cone.height(rim_m);
        let distance_m = distance_m.max(1e-9);
        let near = place::at([0.8 * x / rim_m, 0.8 * y / rim_m], self.seed ^ 0x81);
        let fine = place::at([2.6 * x / rim_m, 2.6 * y / rim_m], self.seed ^ 0x82);
        let uneven = self.irregularity * (0.38 * near + 0.12 * fine);
        let out_m = distance_m * (1.0 + uneven);
        let mut value = value;
        // a rim of different heights
        let worn = self.irregularity
            * depth_m
            * (0.9 * place::at([0.9 * x / distance_m, 0.9 * y / distance_m], self.seed ^ 0x83).abs() + 0.15 * near);
        value -= worn * (1.0 - smoothstep((out_m / rim_m - 1.0) / 1.2)).max(0.0);
        if out_m < rim_m {
            let steep = WALL * (1.0 - 0.35 * self.irregularity * (0.6 + fine));
            let wall = rim - steep * (rim_m - out_m);
            let floor = rim - depth_m;
            let pit = smoothstep((0.5 - math::hypot(x / rim_m - 0.15, y / rim_m + 0.1)) / 0.25);
            let floor = floor + self.irregularity * depth_m * (0.12 * near + 0.05 * fine - 0.22 * pit);
            let talus = self.irregularity * 0.25 * depth_m;
            value = value.min(smooth_max(wall, floor, talus));
        }
        if self.breach[0] > 0.0 {
            let turn = angle - self.breach[1] + self.irregularity * 0.25 * near;
            let (s, c) = (math::sin(turn), math::cos(turn));
            if c > 0.0 || distance_m < 0.4 * rim_m {
                let across = (distance_m * s).abs();
                let half_m = (0.5 * rim_m + 0.12 * distance_m) * (1.0 + 0.25 * fine + 0.3 * near);
                let floor = rim - self.breach[0] * depth_m - 0.3 * distance_m * c + 0.15 * depth_m * near;
                let sides = 0.8 * across * across / half_m;
                value = -smooth_max(-value, -(floor + sides), 0.12 * depth_m);
            }
        }
        value
    }
}

/// Returns the larger of two heights, rounded off where they differ by less than `radius`.
pub(super) fn smooth_max(a: f64, b: f64, radius: f64) -> f64 {
    if radius <= 0.0 {
        return a.max(b);
    }
    let h = (1.0 - (a - b).abs() / radius).max(0.0);
    a.max(b) + 0.25 * h * h * radius
}
