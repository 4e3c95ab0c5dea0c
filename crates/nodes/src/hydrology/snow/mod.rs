//! Snow: where it falls, melts and slides to.
//!
//! M. Bernhardt and K. Schulz (2010) for slides, G. E. Liston and K. Elder (2006) for wind, R. Hock (1999) for melt by
//! temperature and sun. The node's manual page has the equations and lists the differences.

mod pack;
mod slide;
#[cfg(test)]
mod tests;
mod weather;

use self::pack::Pack;
use crate::{
    numerics::{
        horizon::Rays,
        math, par,
        sunlight::{around, growth},
    },
    prelude::*,
};

choice! {
    /// How much snow a slope holds.
    pub enum Law {
        /// 145 m e^(−0.14 β), with the slope β in degrees: steep faces are nearly bare.
        Exponential = "exponential",
        /// 3178.4 m β^(−1.998): steep faces keep some snow.
        Power = "power",
    }
}

params! {
    /// Time for which snow falls and melts, from bare ground.
    duration: f64 = 0.55, Years, 0.0..=5.0, soft 0..=2;
    /// Day of the year at the end: 105 is the middle of April.
    day: i64 = 105, Count, 1..=366;
    /// Number of time steps, each with the sun of its middle day.
    steps: i64 = 8, Count, 1..=36, soft 4..=24;
    /// Difference between the mean temperature of the warmest day and the annual mean.
    seasonality: f64 = 8.0, Celsius, 0.0..=40.0, soft 0..=15;
    /// Lapse rate: cooling of the air with height.
    lapse_rate: f64 = 6.5, KelvinsPerKilometre, 0.0..=15.0, soft 4..=10;
    /// Effect of the wind on where snow falls: at 1 the most exposed places get none and the most sheltered twice the mean.
    wind: f64 = 0.4, One, 0.0..=1.0;
    /// Azimuth from which the wind blows, clockwise from north.
    wind_azimuth: f64 = 270.0, Degrees, 0.0..=360.0;
    /// Distance over which the slope and curvature that change the wind are measured: about half that between ridges.
    wind_length: f64 = 300.0, Metres, 0.0..=1e5, soft 50..=2000;
    /// How much snow a slope holds.
    law: Law = Law::Exponential, One, ..;
    /// Depth that stays on the steepest slopes.
    least: f64 = 0.05, Metres, 0.001..=10.0, soft 0.01..=0.5;
    /// Number of sliding passes in each step; 0 for no slides.
    slides: i64 = 2, Count, 0..=6;
    /// Density of the snow on the ground in kg/m³.
    density: f64 = 350.0, One, 30.0..=917.0, soft 100..=600;
    /// Melt per day and kelvin above 0 °C without sun, in millimetres of water.
    melt_factor: f64 = 1.8, One, 0.0..=30.0, soft 0..=8;
    /// Melt per day, kelvin and W/m² of direct sunlight, in millimetres of water.
    radiation_factor: f64 = 0.0192, One, 0.0..=1.0, soft 0..=0.05;
    /// Latitude of the terrain, north positive.
    latitude: f64 = 45.0, Degrees, -90.0..=90.0;
    /// Distance over which terrain casts shadows.
    distance: f64 = 5000.0, Metres, 0.0..=1e6, soft 100..=20_000;
    /// Number of directions in which the horizon is computed.
    azimuths: i64 = 24, Count, 8..=64;
    /// Fraction of the sun's beam that the atmosphere transmits when the sun is at the zenith.
    transmittance: f64 = 0.7, One, 0.0..=1.0, soft 0.4..=0.8;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Mean annual temperature at height 0.
    temperature: Scalar(Celsius) = 6.0, -80.0..=60.0, soft -10.0..=20.0;
    /// Precipitation as water, the same all year.
    precipitation: Scalar(MetresPerYear) = 1.5, 0.0..=100.0, soft 0.0..=4.0;
}

outputs! {
    /// Terrain with the snow on it.
    height: Height;
    /// Depth of the snow.
    depth: Scalar(Metres);
    /// How much of the ground the snow covers: 0 up to a depth of 5 cm, 1 from 20 cm.
    mask: Mask;
    /// Water that has melted.
    melt: Scalar(Metres);
    /// Volumes of water that fell, melted, slid off the world, and remain, with the error of the balance.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Snow",
    category: "hydrology",
    summary: "Snow falls where temperature and wind allow, slides off steep slopes, and melts in the sun.",
    doc: include_str!("page.md"),
    sources: &[
        "M. Bernhardt and K. Schulz (2010), SnowSlide: A simple routine for calculating gravitational snow transport, \
         Geophysical Research Letters 37, L11502",
        "G. E. Liston and K. Elder (2006), A meteorological distribution system for high-resolution terrestrial modeling \
         (MicroMet), Journal of Hydrometeorology 7, 217-234",
        "R. Hock (1999), A distributed temperature-index ice- and snowmelt model including potential direct solar \
         radiation, Journal of Glaciology 45, 101-111",
        "T. G. Freeman (1991), Calculating catchment area with divergent flow based on a regular grid, Computers & \
         Geosciences 17, 413-422",
        "C. B. Marsh, J. W. Pomeroy and H. S. Wheater (2020), The Canadian Hydrological Model (CHM) v1.0, Geoscientific \
         Model Development 13, 225-247",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    reads_sea: true,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    resolution: Resolution::Cells("slopes between smaller cells are steeper, and hold less snow"),
    example: "height: \"base\", temperature: 5, precipitation: 2",
    ..Node::DEFAULT
};

impl Params {
    fn rays(&self, world: &orograph_graph::World) -> Rays {
        Rays::new(around(self.azimuths), self.distance, world, growth(self.azimuths))
    }

    /// Returns the number of steps that are taken.
    fn count(&self) -> usize {
        if self.duration > 0.0 { self.steps as usize } else { 0 }
    }
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let (params, wants) = (Params::read(sizing.params), Wants::among(sizing.wanted));
    let when = |is: bool, bytes: f64| if is { bytes } else { 0.0 };
    // snow, what has melted, the effect of the wind
    let held = 8.0 + when(wants.melt, 8.0) + when(params.wind > 0.0, 4.0);
    let given = 4.0 * (wants.count() - usize::from(wants.report)) as f64;
    if params.count() == 0 {
        return sizing.cells((held - when(params.wind > 0.0, 4.0)).max(0.0));
    }
    let shadows = params.rays(&sizing.window.world).bytes(&sizing.window);
    // surface, codes, holding depths, fractions, what slides; or sunshine, with the horizon that stays
    let slides = when(params.slides > 0, 4.0 + 1.0 + 4.0 + 34.0 + 8.0);
    let melts = 8.0;
    (sizing.cells(held + slides.max(melts)) + shadows).saturating_sub(sizing.cells(given))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (params, wants) = (Params::read(job.params), Wants::of(job));
    let pack = Pack::grow(job, &params, wants.melt)?;
    let to_depth = 1000.0 / params.density;
    let cells = |value: &(dyn Fn(usize) -> f64 + Sync)| par::field(job, [0.95, 1.0], &|cell| value(cell) as f32);
    let depth = |cell: usize| pack.snow[cell] * to_depth;
    Ok(Given {
        height: wants.height.then(|| cells(&|cell| f64::from(pack.land[cell]) + depth(cell))).transpose()?,
        depth: wants.depth.then(|| cells(&depth)).transpose()?,
        mask: wants.mask.then(|| cells(&|cell| math::smoothstep((depth(cell) - 0.05) / 0.15))).transpose()?,
        melt: wants.melt.then(|| cells(&|cell| pack.melted[cell])).transpose()?,
        report: wants.report.then(|| pack.report(&params, job.cell_m() * job.cell_m())),
    }
    .into())
}
