//! The maximum and the minimum within a disc around every cell.
//!
//! A disc of cells is a stack of lines, one per row. The maximum of a line of any length is that of two overlapping
//! lines whose length is a power of two, and those follow by doubling. Each row of the disc therefore costs two loads
//! per cell, whatever its length, and a row of cells is a loop over vectors. If there are only two values, as in a mask
//! of 0 and 1, the result is the higher one wherever its nearest cell is within the radius, so wide discs cost no more
//! than [`crate::numerics::distance`].

use orograph_graph::{
    Job, NodeError,
    memory::{copied, filled},
};

use super::lines::Ends;
use super::{
    distance::{self, FAR, MOST_CELLS},
    simd::simd,
};
use crate::numerics::par;

/// Radius in cells from which the distance transform is faster than rows, if there are two values.
const WIDE: f64 = 20.0;

/// Returns the maximum over the cells whose centres are within a radius in cells. Only cells of the world count, also
/// across the joined sides of a periodic one. `share` is the part of the job's progress.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn highest(job: &Job<'_>, share: [f32; 2], samples: &[f32], radius_cells: f64) -> Result<Vec<f32>, NodeError> {
    if (WIDE..=f64::from(MOST_CELLS)).contains(&radius_cells)
        && let Some([low, high]) = two_values(samples)
    {
        let limit = distance::cells(radius_cells, 1.0);
        let squared = distance::squared(job, share, limit, |at| samples[at] == high)?;
        let within = square(radius_cells);
        let value = |squared: u32| if squared != FAR && f64::from(squared) <= within { high } else { low };
        return Ok(par::map_of(&squared, |&squared| value(squared)));
    }
    let window = job.window();
    let (nx, ny) = (window.nx(), window.ny());
    let ends = [0, 1].map(|axis| Ends::of(&window, axis));
    let rows = disc(radius_cells, nx, ny);
    let reach = rows.iter().map(|(_, half)| *half).max().unwrap_or(0);
    let width = nx + 2 * reach;
    // rows with their halo; each place becomes the maximum of itself and the next `span - 1`
    let mut lines = filled(width * ny, f32::NEG_INFINITY)?;
    par::all(lines.chunks_mut(width).zip(samples.chunks(nx)), |_, (line, row)| {
        line[reach..reach + nx].copy_from_slice(row);
        if ends[0] == Ends::Wrap {
            for k in 1..=reach {
                line[reach - k] = row[ends[0].index(-(k as i64), nx)];
                line[reach + nx - 1 + k] = row[ends[0].index((nx - 1 + k) as i64, nx)];
            }
        }
    });
    let mut out = copied(samples)?;
    let mut span = 1;
    loop {
        let part = span as f32 / (2 * reach + 1) as f32;
        job.advance(share[0] + (share[1] - share[0]) * part.min(1.0))?;
        let group: Vec<_> = rows.iter().filter(|(_, half)| (span..2 * span).contains(&(2 * half + 1))).collect();
        par::each(out.chunks_mut(nx), |j, out| {
            for (shift, half) in &group {
                let row = j as i64 + shift;
                let row = if ends[1] == Ends::Wrap { row.rem_euclid(ny as i64) } else { row };
                if (0..ny as i64).contains(&row) {
                    let line = &lines[row as usize * width..][..width];
                    raise(out, &line[reach - half..][..nx], &line[reach + half + 1 - span..][..nx]);
                }
            }
            job.check()
        })?;
        if 2 * span > 2 * reach + 1 {
            return Ok(out);
        }
        par::all(lines.chunks_mut(width), |_, line| double(line, span));
        span *= 2;
    }
}

/// Returns the minimum, as [`highest`] does the maximum.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn lowest(job: &Job<'_>, share: [f32; 2], samples: &[f32], radius_cells: f64) -> Result<Vec<f32>, NodeError> {
    let turned = par::map_of(samples, |value| -value);
    let mut out = highest(job, share, &turned, radius_cells)?;
    par::change(&mut out, |value| *value = -*value);
    Ok(out)
}

/// Returns the lower and the higher value. Returns None if there are other values.
fn two_values(samples: &[f32]) -> Option<[f32; 2]> {
    let first = *samples.first()?;
    let other = *samples.iter().find(|value| value.to_bits() != first.to_bits())?;
    // compares bits, so that −0 and +0 stay distinct
    let only = |value: &f32| (value.to_bits() == first.to_bits()) | (value.to_bits() == other.to_bits());
    let two = first != other && samples.chunks(4096).all(|part| part.iter().fold(true, |all, value| all & only(value)));
    two.then(|| [first.min(other), first.max(other)])
}

/// Returns the square of a radius, with a margin for rounding.
fn square(radius_cells: f64) -> f64 {
    radius_cells * radius_cells + 1e-6
}

/// Returns the rows of a disc: the distance of each from the middle, and its number of cells on either side, limited
/// to the size of the world.
pub fn disc(radius_cells: f64, nx: usize, ny: usize) -> Vec<(i64, usize)> {
    let square = square(radius_cells);
    let rows = (square.sqrt() as i64).min(ny as i64);
    let half = |row: i64| ((square - (row * row) as f64).max(0.0).sqrt() as usize).min(nx);
    (-rows..=rows).map(|row| (row, half(row))).collect()
}

simd! {
    fn raise(out: &mut [f32], first: &[f32], second: &[f32]) {
        for ((out, &a), &b) in out.iter_mut().zip(first).zip(second) {
            let high = if a > b { a } else { b };
            *out = if high > *out { high } else { *out };
        }
    }
}

simd! {
    /// Doubles the length of lines: takes the maximum of each place and the one `span` places further.
    fn double(line: &mut [f32], span: usize) {
        for i in 0..line.len().saturating_sub(span) {
            let next = line[i + span];
            line[i] = if next > line[i] { next } else { line[i] };
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, Window, World, mix};

    use super::*;
    use crate::testing::{with_job, world};

    #[test]
    fn the_highest_in_a_disc_is_that_of_every_pair() {
        for (nx, ny) in [(40, 33), (1, 30), (29, 1), (5, 61)] {
            for (edge, radius, two) in [
                (Edge::Base, 0.4, false),
                (Edge::Base, 1.0, false),
                (Edge::Base, 4.7, true),
                (Edge::Base, 90.0, false),
                (Edge::Base, 21.6, true),
                (Edge::Base, 25.0, true),
                (Edge::Periodic, 3.2, false),
                (Edge::Periodic, 20.0, true),
            ] {
                let window = Window::whole(World { boundary: Boundary::all(edge), ..world(nx, ny, 1.0) });
                let value = |at: u32| match two {
                    true => f32::from(mix(at).is_multiple_of(50)) - 0.75,
                    false => mix(at) as f32 * 1e-6 - 2000.0,
                };
                let samples: Vec<f32> = (0..nx * ny).map(value).collect();
                let found = with_job(window, |job| highest(job, [0.0, 1.0], &samples, radius)).expect("a result");
                let least = with_job(window, |job| lowest(job, [0.0, 1.0], &samples, radius)).expect("a result");
                let apart = |a: u32, b: u32, n: u32| {
                    let d = a.abs_diff(b);
                    if edge == Edge::Periodic { d.min(n - d) } else { d }
                };
                for at in 0..nx * ny {
                    let inside = (0..nx * ny).filter(|other| {
                        let (dx, dy) = (apart(at % nx, other % nx, nx), apart(at / nx, other / nx, ny));
                        f64::from(dx * dx + dy * dy) <= radius * radius
                    });
                    let values: Vec<f32> = inside.map(|other| samples[other as usize]).collect();
                    let (low, high) = values.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
                    assert_eq!(
                        (least[at as usize], found[at as usize]),
                        (low, high),
                        "{nx} x {ny} {edge:?} {radius} {at}"
                    );
                }
            }
        }
    }
}
