//! The constants of a run, and those of one of its steps.

use crate::prelude::*;

choice! {
    /// Scheme of the water flow.
    pub enum Scheme {
        /// Local inertia and Manning's friction: water flows as fast as in real rivers.
        Inertial = "inertial",
        /// Virtual pipes without friction: water sloshes.
        Pipes = "pipes",
    }
}

choice! {
    /// Scheme of the transport of suspended sediment.
    pub enum Transport {
        /// Carried by the water through the faces of cells: nothing is lost.
        Upwind = "upwind",
        /// Traced back along the flow and interpolated: sharper, but not conservative.
        SemiLagrangian = "semi_lagrangian",
        /// Traced back and forth to correct the interpolation, limited to the range of its neighbours: sharpest.
        MacCormack = "maccormack",
    }
}

choice! {
    /// Law of erosion and deposition: how much sediment water carries, and how fast it erodes and deposits.
    pub enum Law {
        /// Unit stream power, settling and entrainment, with the parameters below.
        StreamPower = "stream_power",
        /// The same, but erosion begins where the shear stress on the bed exceeds `critical_shear`, and grows with
        /// the excess.
        ExcessShear = "excess_shear",
        /// The constants of WebGL-Erosion, for pipes of constant cross-section: `capacity`, `settling`, `entrainment`,
        /// `critical_shear`, `roughness`, `scheme`, `damping`, `evaporation`, `film`, `deep` and `width` are not used.
        WebglErosion = "webgl_erosion",
    }
}

/// The measure of transport capacity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Capacity {
    /// Unit stream power: a concentration.
    UnitPower,
    /// The same, and entrainment grows with the shear stress on the bed above a critical one.
    Shear,
    /// Speed: a depth of sediment.
    Speed,
}

/// Acceleration by gravity, m/s².
pub(super) const GRAVITY: f64 = 9.81;
/// Density of water.
const WATER_KG_M3: f64 = 1000.0;
/// Minimum depth of water that limits the step, in metres.
const SHALLOW_M: f32 = 0.05;
/// Largest slope of the water surface that drives it, in m/m; steeper faces are waterfalls.
const STEEPEST: f64 = 2.0;
/// Largest concentration by volume: beyond it water is mud, which flows differently.
const THICKEST: f64 = 0.3;
/// Fastest change of the bed under water of no depth, m/s, and more per metre of depth: the water has to follow the
/// bed. It is a speed, not a change per step, so that shorter steps on smaller cells do not cut more.
const BITE: [f64; 2] = [0.005, 0.05];
/// The laws of WebGL-Erosion count in steps: each changes the bed by at most what others do in this time.
const SEED_BITE_S: f64 = 2.0;
/// WebGL-Erosion's gravity in cells per time unit², which defines its unit of time, and A/l of its pipes in cells.
const SEED_GRAVITY: f64 = 0.8;
const SEED_SECTION: f64 = 0.75;
/// Its capacity in cells per (cell per time unit), and rates per time unit of 20 steps of 0.05: −20 ln(1 − rate).
const SEED_CAPACITY: f64 = 0.06;
const SEED_ENTRAINMENT: f64 = 0.733_279_7;
const SEED_SETTLING: f64 = 0.120_361_45;
const SEED_EVAPORATION: f64 = 0.060_090_18;

/// Equal steps, between which the time step does not change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sweep {
    pub steps: usize,
    pub dt_s: f64,
    /// Time that remains after it.
    pub left_s: f64,
}

/// The constants of a whole run, in metres and seconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Physics {
    pub scheme: Scheme,
    pub transport: Transport,
    pub cell_m: f64,
    pub courant: f64,
    pub roughness: f64,
    pub damping: f64,
    /// Height of pipes, 0 where it is the depth of water.
    pub section_m: f64,
    pub film_m: f64,
    pub deep_m: f64,
    /// Width of the smallest channel, 0 for that of a cell.
    pub width_m: f64,
    /// Capacity per slope and speed: as a concentration for unit stream power, as a depth of sediment else.
    pub capacity: f64,
    pub law: Capacity,
    /// Weight of water over the critical shear stress, 1/m.
    pub shear: f64,
    pub tilt_floor: f64,
    /// Settling as a speed for unit stream power, as a rate else.
    pub settling: f64,
    pub entrainment: f64,
    pub rock: f64,
    pub acceleration: f64,
    pub evaporation: f64,
    pub infiltration_mm_h: f64,
    pub talus: f64,
}

impl Physics {
    pub fn new(params: &super::Params, cell_m: f64) -> Self {
        let physics = Self {
            scheme: params.scheme,
            transport: params.transport,
            cell_m,
            courant: params.courant,
            roughness: params.roughness,
            damping: params.damping,
            section_m: 0.0,
            film_m: params.film,
            deep_m: params.deep,
            width_m: params.width,
            capacity: params.capacity / params.settling,
            law: if params.law == Law::ExcessShear { Capacity::Shear } else { Capacity::UnitPower },
            shear: WATER_KG_M3 * GRAVITY / params.critical_shear,
            tilt_floor: 0.0,
            settling: params.settling,
            entrainment: params.entrainment,
            rock: params.rock,
            acceleration: params.acceleration,
            evaporation: params.evaporation,
            infiltration_mm_h: params.infiltration,
            talus: crate::numerics::math::tan(params.talus.to_radians()),
        };
        match params.law {
            Law::StreamPower | Law::ExcessShear => physics,
            Law::WebglErosion => {
                let unit_s = (SEED_GRAVITY * cell_m / GRAVITY).sqrt();
                Self {
                    scheme: Scheme::Pipes,
                    damping: 0.0,
                    section_m: SEED_SECTION * cell_m,
                    film_m: 0.01 * cell_m,
                    deep_m: f64::INFINITY,
                    width_m: 0.0,
                    capacity: SEED_CAPACITY * unit_s,
                    law: Capacity::Speed,
                    tilt_floor: 0.1,
                    settling: SEED_SETTLING / unit_s,
                    entrainment: SEED_ENTRAINMENT / unit_s,
                    evaporation: SEED_EVAPORATION / unit_s,
                    ..physics
                }
            }
        }
    }

    /// The longest stable step where water is at most `deepest_m` deep (Bates, Horritt and Fewtrell 2010): waves cross
    /// `courant` of a cell.
    pub fn step_s(&self, deepest_m: f32) -> f64 {
        let depth_m = if self.section_m > 0.0 { self.section_m } else { f64::from(deepest_m.max(SHALLOW_M)) };
        self.courant * self.cell_m / (GRAVITY * depth_m).sqrt()
    }

    /// The next sweep of a run with so much time left, of at most `most` steps: those of the last one divide that time.
    pub fn sweep(&self, deepest_m: f32, left_s: f64, most: usize) -> Sweep {
        let longest_s = self.step_s(deepest_m);
        let last = left_s <= most as f64 * longest_s;
        let steps = if last { (left_s / longest_s).ceil().max(1.0) } else { most as f64 };
        let dt_s = if last { left_s / steps } else { longest_s };
        Sweep { steps: steps as usize, dt_s, left_s: if last { 0.0 } else { left_s - steps * dt_s } }
    }

    /// The constants of a step.
    pub fn pace(&self, dt_s: f64) -> Pace {
        let acceleration = self.acceleration.max(1e-20) as f32;
        let step = dt_s / self.cell_m;
        let friction = 4.0 * GRAVITY * dt_s * self.roughness * self.roughness;
        Pace {
            scheme: self.scheme,
            law: self.law,
            dt_s: dt_s as f32,
            step: step as f32,
            rain_m: (dt_s / 3.6e6) as f32,
            push: (GRAVITY * dt_s / self.cell_m) as f32,
            steepest_m: (STEEPEST * self.cell_m) as f32,
            friction: friction as f32,
            critical: GRAVITY.sqrt() as f32,
            section_m: self.section_m as f32,
            damping: crate::numerics::math::exp(-self.damping * dt_s) as f32,
            per_film: (1.0 / self.film_m) as f32,
            per_deep: (1.0 / self.deep_m) as f32,
            tilt: (0.5 / self.cell_m) as f32,
            tilt_floor: (self.tilt_floor * self.tilt_floor) as f32,
            shear: self.shear as f32,
            capacity: self.capacity as f32,
            thickest: THICKEST as f32,
            settling: (self.settling * dt_s) as f32,
            entrainment: (self.entrainment * dt_s) as f32,
            rock: self.rock as f32,
            acceleration,
            per_acceleration: 1.0 / acceleration,
            most_m: (0.05 * self.cell_m) as f32,
            bite_m: BITE.map(|bite| (bite * if self.law == Capacity::Speed { SEED_BITE_S } else { dt_s }) as f32),
            evaporation: crate::numerics::math::exp(-self.evaporation * dt_s) as f32,
            infiltration_m: (self.infiltration_mm_h * dt_s / 3.6e6) as f32,
        }
    }
}

/// The constants of a step, as row kernels use them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pace {
    pub scheme: Scheme,
    pub law: Capacity,
    pub dt_s: f32,
    /// dt / dx, s/m.
    pub step: f32,
    /// Metres of rain per mm/h.
    pub rain_m: f32,
    /// g dt / dx, m/s per metre of fall and metre of depth.
    pub push: f32,
    /// Largest fall between cells that drives water.
    pub steepest_m: f32,
    /// 4 g dt n².
    pub friction: f32,
    /// √g.
    pub critical: f32,
    pub section_m: f32,
    /// Fraction of its discharge that a pipe keeps.
    pub damping: f32,
    /// 1 / depth of the film.
    pub per_film: f32,
    /// 1 / (depth from which water does not erode).
    pub per_deep: f32,
    /// 1 / (2 dx).
    pub tilt: f32,
    /// Square of the smallest tilt.
    pub tilt_floor: f32,
    /// Weight of water over the critical shear stress, 1/m.
    pub shear: f32,
    pub capacity: f32,
    pub thickest: f32,
    /// Metres settled, or the fraction if capacity is a depth of sediment.
    pub settling: f32,
    /// Decay exponent of entrainment.
    pub entrainment: f32,
    /// Rate of rock as a fraction of that of loose ground.
    pub rock: f32,
    pub acceleration: f32,
    pub per_acceleration: f32,
    /// Maximum change of the bed in a step.
    pub most_m: f32,
    /// The same for water of no depth, and more per metre of depth.
    pub bite_m: [f32; 2],
    /// Fraction of the water that remains after evaporation.
    pub evaporation: f32,
    pub infiltration_m: f32,
}

impl Pace {
    /// Returns true if water is lost to the air or the ground.
    pub fn dries(&self) -> bool {
        self.evaporation < 1.0 || self.infiltration_m > 0.0
    }
}
