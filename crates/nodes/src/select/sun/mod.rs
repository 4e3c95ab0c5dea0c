//! Sunshine duration and irradiance of terrain, with cast shadows.

use orograph_graph::World;

use crate::{
    numerics::{
        gradient::{Method, Surface},
        horizon::{self, Horizon, Rays},
        par, smooth,
        sunlight::{
            self, around, growth,
            path::{self, Arc, DAY_S},
        },
    },
    prelude::*,
};

choice! {
    /// Period over which sunlight is summed.
    pub enum Period {
        /// One day from sunrise to sunset.
        Day = "day",
        /// The year: the mean of a day in each month.
        Year = "year",
        /// One sun in a fixed position: cast shadows for a picture.
        Fixed = "fixed",
    }
}

params! {
    /// Period over which sunlight is summed.
    period: Period = Period::Day, One, ..;
    /// Latitude of the terrain, north positive.
    latitude: f64 = 45.0, Degrees, -90.0..=90.0, when period = "day" | "year";
    /// Day of the year: 80 and 266 are the equinoxes, 172 and 355 the solstices.
    day: i64 = 80, Count, 1..=366, when period = "day";
    /// Azimuth of the sun, clockwise from north.
    azimuth: f64 = 225.0, Degrees, 0.0..=360.0, when period = "fixed";
    /// Altitude of the sun above the horizon.
    altitude: f64 = 30.0, Degrees, 1.0..=90.0, soft 5..=80, when period = "fixed";
    /// Distance over which terrain casts shadows.
    distance: f64 = 5000.0, Metres, 0.0..=1e6, soft 100..=20_000;
    /// Number of directions in which the horizon is computed.
    azimuths: i64 = 48, Count, 8..=128, when period = "day" | "year";
    /// Fraction of the beam that passes through the atmosphere from the zenith; 1 without an atmosphere.
    transmittance: f64 = 0.7, One, 0.0..=1.0, soft 0.4..=0.8;
}

inputs! {
    /// Terrain height.
    height: Height;
}

outputs! {
    /// Direct sunlight as a fraction of that on a surface that faces the sun.
    exposure: Mask;
    /// Fraction of the time from sunrise to sunset in which the place is lit.
    sunlit: Mask;
    /// Time per day in which the place is lit.
    duration: Scalar(Seconds);
    /// Mean flux of the beam over a day.
    irradiance: Scalar(WattsPerSquareMetre);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Sun",
    category: "select",
    summary: "How long and how strongly the sun shines on the ground, with cast shadows.",
    doc: include_str!("page.md"),
    sources: &[
        "J. W. Spencer (1971), Fourier series representation of the position of the sun, Search 2(5), 172",
        "F. Kasten and A. T. Young (1989), Revised optical air mass tables and approximation formula, Applied Optics 28, 4735-4738",
        "L. Kumar, A. K. Skidmore and E. Knowles (1997), Modelling topographic variation in solar radiation in a GIS environment, \
         International Journal of Geographical Information Science 11, 475-497",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| {
        let params = Params::read(params);
        Rays::reach_m(params.distance, cell_m, params.growth()).max(cell_m)
    }),
    scratch: orograph_graph::Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&GPU),
    resolution: Resolution::Cells("slopes are those between neighbouring cells: larger cells are gentler"),
    example: "height: \"base\", day: 355",
    ..Node::DEFAULT
};

/// Growth of the sampling steps towards a single sun, for sharp shadows.
const FINE: f64 = 0.02;

impl Params {
    fn growth(&self) -> f64 {
        if self.period == Period::Fixed { FINE } else { growth(self.azimuths) }
    }

    fn rays(&self, world: &World) -> Rays {
        match self.period {
            Period::Fixed => Rays::new([self.azimuth], self.distance, world, FINE),
            _ => Rays::new(around(self.azimuths), self.distance, world, self.growth()),
        }
    }

    /// Returns the arcs of the sun, and the number of days they represent.
    fn arcs(&self) -> (Vec<Arc>, f64) {
        let day = |day: f64, steps: u32| path::day(day, self.latitude, steps, self.transmittance);
        match self.period {
            Period::Day => (day(self.day as f64, 48).into_iter().collect(), 1.0),
            Period::Year => (path::MONTHS.iter().filter_map(|&month| day(month, 24)).collect(), 12.0),
            Period::Fixed => (vec![path::fixed(self.azimuth, self.altitude, self.transmittance)], 1.0),
        }
    }
}

static SHADER: Shader = Shader {
    name: "select/sun",
    source: wgsl!("select/sun"),
    library: &[],
    values: &[
        ("k_per_facing", Number::F32),
        ("k_per_time", Number::F32),
        ("k_per_days", Number::F32),
        ("k_per_second", Number::F32),
        ("k_day_s", Number::F32),
    ],
    slots: &[
        Slot::cells("lit", "f32"),
        Slot::cells("energy", "f32"),
        Slot::output("exposure"),
        Slot::output("sunlit"),
        Slot::output("duration"),
        Slot::output("irradiance"),
    ],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&smooth::SHADER, &horizon::device::SHADER, &sunlight::device::SHADER, &SHADER],
    passes: Passes::Recorded(record),
    // sums over the day in another order: 1e-5 of a day and of the sun
    tolerance: &[
        Tolerance::absolute(1e-5),
        Tolerance::absolute(1e-5),
        Tolerance::absolute(1.0),
        Tolerance::absolute(0.01),
    ],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let params = Params::read(job.params);
    let (arcs, days) = params.arcs();
    let horizons = horizon::device::Horizons::new(job, recorder, [0.0, 0.2], &params.rays(job.world()))?;
    let [lit, energy] = sunlight::device::record(job, recorder, [0.2, 0.9], &horizons, &arcs)?;
    let scales = Scales::new(&arcs, days);
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("lit", Bind::Scratch(lit)), ("energy", Bind::Scratch(energy))],
        values: &[
            ("k_per_facing", Scalar::F32(scales.exposure)),
            ("k_per_time", Scalar::F32(scales.sunlit)),
            ("k_per_days", Scalar::F32(scales.duration)),
            ("k_per_second", Scalar::F32(scales.irradiance)),
            ("k_day_s", Scalar::F32(DAY_S as f32)),
        ],
        over: Over::Cells(Rows::Around(0)),
    })
}

/// Factors from sums over time to outputs.
struct Scales {
    exposure: f32,
    sunlit: f32,
    duration: f32,
    irradiance: f32,
}

impl Scales {
    fn new(arcs: &[Arc], days: f64) -> Self {
        let steps = |arc: &Arc| arc.step_s * (arc.positions.len() - 1) as f64;
        let time_s: f64 = arcs.iter().map(steps).sum();
        let facing: f64 = arcs
            .iter()
            .flat_map(|arc| arc.positions.windows(2).map(|pair| 0.5 * (pair[0].beam + pair[1].beam) * arc.step_s))
            .sum();
        let share = |of: f64| if of > 0.0 { (1.0 / of) as f32 } else { 0.0 };
        let [duration, irradiance] = [1.0 / days, 1.0 / (days * DAY_S)].map(|scale| scale as f32);
        Self { exposure: share(facing), sunlit: share(time_s), duration, irradiance }
    }
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // sunshine seconds and joules, and the rows in progress, in addition to the smoothed terrain
    sizing.cells(9.0) + Params::read(sizing.params).rays(&sizing.window.world).bytes(&sizing.window)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let height = Inputs::read(job)?.height;
    let (arcs, days) = params.arcs();
    let horizon = Horizon::new(job, [0.0, 0.2], height, params.rays(job.world()))?;
    let surface = Surface::new(height, Method::Horn);
    let nx = job.window().nx();
    let sums = sunlight::sums(job, [0.2, 0.9], &horizon, &surface, &arcs)?;

    let scales = Scales::new(&arcs, days);
    let field = |of: usize, scale: f32, most: f32| {
        let mut samples = vec![0.0; sums.len() / 2];
        par::all(samples.chunks_mut(nx).zip(sums.chunks(2 * nx)), |_, (row, sums)| {
            for (sample, sum) in row.iter_mut().zip(&sums[of * nx..]) {
                *sample = (sum * scale).min(most);
            }
        });
        Field::new(job.window(), samples)
    };
    let wants = Wants::of(job);
    Ok(Given {
        exposure: wants.exposure.then(|| field(1, scales.exposure, 1.0)),
        sunlit: wants.sunlit.then(|| field(0, scales.sunlit, 1.0)),
        duration: wants.duration.then(|| field(0, scales.duration, DAY_S as f32)),
        irradiance: wants.irradiance.then(|| field(1, scales.irradiance, f32::MAX)),
    }
    .into())
}

#[cfg(test)]
mod tests;
