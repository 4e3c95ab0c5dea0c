//! Sunshine duration and irradiance of terrain, with cast shadows.

mod path;

use orograph_graph::World;

use self::path::{Arc, DAY_S};
use super::occlusion::{around, growth};
use crate::{
    numerics::{
        cells::BLOCK,
        gradient::{Method, Surface},
        horizon::{Horizon, Rays},
        par,
        simd::simd,
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

/// The position of the sun at one moment, in the form that the kernel uses.
#[derive(Clone, Copy)]
struct Moment {
    /// The two neighbouring azimuths, and the position between them.
    rays: [usize; 2],
    share: f32,
    tangent: f32,
    /// Unit vector towards the sun, times the flux: east, south, up.
    beam: [f32; 3],
}

/// Moments of an arc, and the time step in seconds.
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

/// State of a block of cells at one moment.
#[derive(Clone)]
struct Sight {
    /// Height of the sun above the horizon, as a difference of tangents.
    above: [f32; BLOCK],
    /// Flux on the ground without shadows.
    flux: [f32; BLOCK],
}

/// Buffers of a thread.
struct Scratch {
    tangents: Vec<f32>,
    slopes: [Vec<f32>; 2],
    /// Cosine of the slope.
    upright: Vec<f32>,
    sights: Box<[Sight; 2]>,
}

/// Rows that share buffers.
const BAND: usize = 16;

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
    let ways: Vec<Way> = arcs.iter().map(|arc| Way::new(arc, horizon.rays())).collect();
    // azimuths that are used at some time
    let mut rays: Vec<usize> = ways.iter().flat_map(|way| &way.moments).flat_map(|moment| moment.rays).collect();
    rays.sort_unstable();
    rays.dedup();
    let (nx, len) = (job.window().nx(), job.window().len());
    // alternating rows of sunshine seconds and of joules per square metre
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
        let mut samples = vec![0.0; sums.len() / 2];
        par::all(samples.chunks_mut(nx).zip(sums.chunks(2 * nx)), |_, (row, sums)| {
            for (sample, sum) in row.iter_mut().zip(&sums[of * nx..]) {
                *sample = (sum * scale as f32).min(most);
            }
        });
        Field::new(job.window(), samples)
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

/// Sums one row: sunshine seconds and joules per square metre.
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
    /// Computes the sunlight on cells at a moment, from the components of slope and its cosine.
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
    /// Integrates the sunlight between two moments, with the sun's height above the horizon and the flux interpolated
    /// linearly.
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
