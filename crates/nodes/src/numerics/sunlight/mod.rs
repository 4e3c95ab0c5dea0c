//! Direct sunlight on terrain over the sun's path, with cast shadows.

pub mod device;
pub mod path;

use orograph_graph::{Job, NodeError};

use self::path::Arc;
use super::{cells::BLOCK, gradient::Surface, horizon::Horizon, par, simd::simd};

/// Growth of the sampling steps along a direction: slightly finer than the spacing of the directions.
#[must_use]
pub fn growth(azimuths: i64) -> f64 {
    2.5 / azimuths as f64
}

/// Returns that many azimuths in degrees, evenly spaced.
pub fn around(azimuths: i64) -> impl Iterator<Item = f64> {
    (0..azimuths).map(move |k| 360.0 * k as f64 / azimuths as f64)
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

/// Returns the sunshine on each cell over all arcs: alternating rows of seconds in which it is lit and of joules per
/// square metre. `share` is the start and end of this part of the job's progress.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn sums(
    job: &Job<'_>,
    share: [f32; 2],
    horizon: &Horizon<'_>,
    surface: &Surface<'_>,
    arcs: &[Arc],
) -> Result<Vec<f32>, NodeError> {
    let ways: Vec<Way> = arcs.iter().map(|arc| Way::new(arc, horizon.rays())).collect();
    // azimuths that are used at some time
    let mut rays: Vec<usize> = ways.iter().flat_map(|way| &way.moments).flat_map(|moment| moment.rays).collect();
    rays.sort_unstable();
    rays.dedup();
    let (nx, len) = (job.window().nx(), job.window().len());
    let mut sums = vec![0.0; 2 * len];
    par::bands_within(job, share, 2 * BAND, &mut sums, |first, rows| {
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
            row(first / 2 + k, horizon, &rays, surface, &ways, &mut scratch, [lit, energy]);
        }
        Ok(())
    })?;
    Ok(sums)
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
