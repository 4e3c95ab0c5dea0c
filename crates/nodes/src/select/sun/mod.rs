//! How long and how strongly the sun shines on the ground, with the shadows that land casts.

mod path;

use orograph_graph::World;
use rayon::prelude::*;

use self::path::{Arc, DAY_S};
use super::occlusion::{around, growth};
use crate::{
    cells::BLOCK,
    gradient::{Method, Surface},
    horizon::{Horizon, Rays},
    par,
    prelude::*,
    simd::simd,
};

choice! {
    /// Which suns shine.
    pub enum Period {
        /// One day from sunrise to sunset.
        Day = "day",
        /// The year: the mean of a day in each month.
        Year = "year",
        /// One sun that stands still: cast shadows for a picture.
        Fixed = "fixed",
    }
}

params! {
    /// Which suns shine.
    period: Period = Period::Day, One, ..;
    /// Where on earth the land lies, north positive.
    latitude: f64 = 45.0, Degrees, -90.0..=90.0, when period = "day" | "year";
    /// Day of the year: 80 and 266 are the equinoxes, 172 and 355 the solstices.
    day: i64 = 80, Count, 1..=366, when period = "day";
    /// Where the sun stands, clockwise from north.
    azimuth: f64 = 225.0, Degrees, 0.0..=360.0, when period = "fixed";
    /// How high it stands above the level.
    altitude: f64 = 30.0, Degrees, 1.0..=90.0, soft 5..=80, when period = "fixed";
    /// How far land casts shadows.
    distance: f64 = 5000.0, Metres, 0.0..=1e6, soft 100..=20_000;
    /// Directions in which the horizon is taken.
    azimuths: i64 = 48, Count, 8..=128, when period = "day" | "year";
    /// Share of the beam that comes through the air from the zenith; 1 is no air.
    transmittance: f64 = 0.7, One, 0.0..=1.0, soft 0.4..=0.8;
}

inputs! {
    /// The land.
    height: Height;
}

outputs! {
    /// The beam as a share of that on a surface that faces the sun.
    exposure: Mask;
    /// The share of the time from sunrise to sunset that is sunny.
    sunlit: Mask;
    /// Time in the sun of a day.
    duration: Scalar(Seconds);
    /// Mean flux of the beam over a day.
    irradiance: Scalar(WattsPerSquareMetre);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Sun",
    category: "select",
    summary: "How long and how strongly the sun shines on the ground, with cast shadows.",
    doc: "The beam of the sun on a slope, summed over its way: its flux times the cosine of the angle between sun and normal, while \
          the sun stands above the horizon that the land makes. `exposure` is the sum as a share of what a surface that always faced \
          the sun would get; `sunlit` is the share of the time from sunrise to sunset of level land in which the place is lit; \
          `duration` the time itself and `irradiance` the mean flux, both over a day of 24 h. Light of the sky is not counted: that \
          is `Occlusion`.\n\n\
          The sun's way follows from `latitude` and `day`: declination and distance by Spencer's series, hour angles in 48 steps \
          from sunrise to sunset (24 for each day of the year). Between two steps the moment at which it rises above or sinks below \
          the horizon is interpolated. Through the air the beam loses strength by `transmittance` to the power of the relative \
          length of its way (Kasten and Young 1989). North is up, towards row 0.\n\n\
          `fixed` is one sun that stands still all day; its shadows fade over its disc of half a degree. Horizons are taken as in \
          `Occlusion`, in `azimuths` directions, and interpolated between them.\n\n\
          **Advice.** Snow lies longest and forests are densest where `exposure` is low; vineyards and dry grass want it high. Mix \
          `year` with heights for belts of plants that differ from slope to slope.",
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
    resolution: Resolution::Cells("slopes are those between neighbouring cells: larger cells are gentler"),
    example: "height: \"base\", day: 355",
    ..Node::DEFAULT
};

/// How fast looks grow towards a single sun: crisp shadows.
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

    /// The ways of the sun, and of how many days.
    fn arcs(&self) -> (Vec<Arc>, f64) {
        let day = |day: f64, steps: u32| path::day(day, self.latitude, steps, self.transmittance);
        match self.period {
            Period::Day => (day(self.day as f64, 48).into_iter().collect(), 1.0),
            Period::Year => (path::MONTHS.iter().filter_map(|&month| day(month, 24)).collect(), 12.0),
            Period::Fixed => (vec![path::fixed(self.azimuth, self.altitude, self.transmittance)], 1.0),
        }
    }
}

/// The sun at one moment as the kernel needs it.
#[derive(Clone, Copy)]
struct Moment {
    /// The directions beside it, and where between them it is.
    rays: [usize; 2],
    share: f32,
    tangent: f32,
    /// Towards it, times the flux: east, south, up.
    beam: [f32; 3],
}

/// Moments of an arc and the seconds between them.
struct Way {
    moments: Vec<Moment>,
    step_s: f32,
}

impl Way {
    fn new(arc: &Arc, rays: usize) -> Self {
        let moments = arc.positions.iter().map(|position| {
            let place = position.azimuth / 360.0 * rays as f64;
            let first = place.floor();
            Moment {
                rays: [first as usize % rays, (first as usize + 1) % rays],
                share: (place - first) as f32,
                tangent: position.tangent as f32,
                beam: position.towards.map(|v| (v * position.beam) as f32),
            }
        });
        Self { moments: moments.collect(), step_s: arc.step_s as f32 }
    }
}

/// What a block of cells has at one moment.
#[derive(Clone)]
struct Sight {
    /// How far the sun stands above the horizon, as a difference of tangents.
    above: [f32; BLOCK],
    /// Flux on the ground without shadows.
    flux: [f32; BLOCK],
}

/// Working space of a thread.
struct Scratch {
    tangents: Vec<f32>,
    slopes: [Vec<f32>; 2],
    /// Cosine of the slope.
    upright: Vec<f32>,
    sights: Box<[Sight; 2]>,
}

/// Rows that share a working space.
const BAND: usize = 16;

/// What the kernel holds beside its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    // seconds in the sun and joules, and pieces of an output before they are one, beside the smoothed land
    sizing.cells(12.0) + Params::read(sizing.params).rays(&sizing.window.world).bytes(&sizing.window)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let height = Inputs::read(job)?.height;
    let (arcs, days) = params.arcs();
    let horizon = Horizon::new(job, [0.0, 0.2], height, params.rays(job.world()))?;
    let surface = Surface::new(height, Method::Horn);
    let ways: Vec<Way> = arcs.iter().map(|arc| Way::new(arc, horizon.rays())).collect();
    // directions in which the sun stands at some time
    let mut rays: Vec<usize> = ways.iter().flat_map(|way| &way.moments).flat_map(|moment| moment.rays).collect();
    rays.sort_unstable();
    rays.dedup();
    let (nx, len) = (job.window().nx(), job.window().len());
    // a row of seconds in the sun and one of joules per square metre, by turns
    let mut sums = vec![0.0; 2 * len];
    par::bands_within(job, [0.2, 0.9], 2 * BAND, &mut sums, |first, rows| {
        let empty = Sight { above: [0.0; BLOCK], flux: [0.0; BLOCK] };
        let mut scratch = Scratch {
            tangents: vec![0.0; BLOCK * horizon.rays()],
            slopes: [vec![0.0; nx], vec![0.0; nx]],
            upright: vec![0.0; nx],
            sights: Box::new([empty.clone(), empty]),
        };
        for (k, rows) in rows.chunks_mut(2 * nx).enumerate() {
            job.check()?;
            let (lit, energy) = rows.split_at_mut(nx);
            row(first / 2 + k, &horizon, &rays, &surface, &ways, &mut scratch, [lit, energy]);
        }
        Ok(())
    })?;

    let steps = |arc: &Arc| arc.step_s * (arc.positions.len() - 1) as f64;
    let time_s: f64 = arcs.iter().map(steps).sum();
    let facing: f64 = arcs
        .iter()
        .flat_map(|arc| arc.positions.windows(2).map(|pair| 0.5 * (pair[0].beam + pair[1].beam) * arc.step_s))
        .sum();
    let field = |of: usize, scale: f64, most: f32| {
        let rows = sums.par_chunks(2 * nx).flat_map_iter(|rows| &rows[of * nx..][..nx]);
        Field::new(job.window(), rows.map(|sum| (sum * scale as f32).min(most)).collect())
    };
    let share = |of: f64| if of > 0.0 { 1.0 / of } else { 0.0 };
    let wants = Wants::of(job);
    Ok(Given {
        exposure: wants.exposure.then(|| field(1, share(facing), 1.0)),
        sunlit: wants.sunlit.then(|| field(0, share(time_s), 1.0)),
        duration: wants.duration.then(|| field(0, 1.0 / days, DAY_S as f32)),
        irradiance: wants.irradiance.then(|| field(1, 1.0 / (days * DAY_S), f32::MAX)),
    }
    .into())
}

/// Adds up one row: seconds in the sun and joules per square metre.
fn row(
    j: usize,
    horizon: &Horizon<'_>,
    rays: &[usize],
    surface: &Surface<'_>,
    ways: &[Way],
    scratch: &mut Scratch,
    sums: [&mut [f32]; 2],
) {
    let Scratch { tangents, slopes: [east, south], upright, sights } = scratch;
    let [lit, energy] = sums;
    surface.row(j, |start, p, q| {
        east[start..start + p.len()].copy_from_slice(p);
        south[start..start + q.len()].copy_from_slice(q);
    });
    cosines(upright, east, south);
    for start in (0..lit.len()).step_by(BLOCK) {
        let columns = start..lit.len().min(start + BLOCK);
        for &ray in rays {
            horizon.tangents(ray, j, columns.clone(), &mut tangents[ray * BLOCK..][..BLOCK]);
        }
        let slopes = [&east[columns.clone()], &south[columns.clone()], &upright[columns.clone()]];
        for way in ways {
            for (at, moment) in way.moments.iter().enumerate() {
                let [even, odd] = &mut **sights;
                let (before, now) = if at % 2 == 0 { (odd, even) } else { (even, odd) };
                let [first, second] = moment.rays.map(|ray| &tangents[ray * BLOCK..][..columns.len()]);
                look(now, slopes, [first, second], moment);
                if at > 0 {
                    shine(&mut lit[columns.clone()], &mut energy[columns.clone()], before, now, way.step_s);
                }
            }
        }
    }
}

simd! {
    /// Cosines of slopes.
    fn cosines(cosines: &mut [f32], east: &[f32], south: &[f32]) {
        for ((cosine, p), q) in cosines.iter_mut().zip(east).zip(south) {
            *cosine = 1.0 / (1.0 + (p * p + q * q)).sqrt();
        }
    }
}

simd! {
    /// What cells see of the sun at a moment; of slopes the components and the cosine.
    fn look(sight: &mut Sight, slopes: [&[f32]; 3], tangents: [&[f32]; 2], moment: &Moment) {
        let cells = slopes[0].iter().zip(slopes[1]).zip(slopes[2]).zip(tangents[0].iter().zip(tangents[1]));
        let out = sight.above.iter_mut().zip(&mut sight.flux);
        let [east, south, up] = moment.beam;
        for ((above, flux), (((&p, &q), &cosine), (&first, &second))) in out.zip(cells) {
            *above = moment.tangent - (first + (second - first) * moment.share);
            let facing = (up - (p * east + q * south)) * cosine;
            *flux = if facing > 0.0 { facing } else { 0.0 };
        }
    }
}

simd! {
    /// Adds what arrives between two moments: both the height above the horizon and the flux run straight between them.
    fn shine(lit: &mut [f32], energy: &mut [f32], before: &Sight, now: &Sight, step_s: f32) {
        let then = before.above.iter().zip(&before.flux);
        let now = now.above.iter().zip(&now.flux);
        for ((lit, energy), ((&a, &e), (&b, &f))) in lit.iter_mut().zip(energy).zip(then.zip(now)) {
            let high = if a > b { a } else { b };
            let low = if a > b { b } else { a };
            let share = high / (high - low);
            let share = if low >= 0.0 { 1.0 } else { share };
            let share = if high > 0.0 { share } else { 0.0 };
            let time = share * step_s;
            *lit += time;
            *energy += time * 0.5 * (e + f);
        }
    }
}

#[cfg(test)]
mod tests;
