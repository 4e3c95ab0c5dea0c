//! Rasters of one world on other cells: area means on larger cells, linear interpolation on smaller ones.

use std::convert::Infallible;

use orograph_graph::{
    Edge, Field, Window,
    memory::{OutOfMemory, copied, zeroed},
};

use crate::numerics::par;

/// The samples along one axis that make one of the other cells, and their weights.
type Taps = Vec<(usize, f64)>;

/// A field on the cells of another window of the same world. `keep_base` makes cells at base sides from samples at the
/// side alone: they say how high the base level is.
///
/// # Errors
/// [`OutOfMemory`].
pub fn resampled(field: &Field, to: Window, keep_base: bool) -> Result<Field, OutOfMemory> {
    let from = field.window();
    if from.cells == to.cells {
        return Ok(Field::new(to, copied(field.samples())?));
    }
    let sides = to.world.boundary;
    let base = |edge: Edge| keep_base && edge == Edge::Base;
    let columns = taps(from.nx(), to.nx(), sides.west == Edge::Periodic, [base(sides.west), base(sides.east)]);
    let rows = taps(from.ny(), to.ny(), sides.north == Edge::Periodic, [base(sides.north), base(sides.south)]);
    let (nx, samples) = (from.nx(), field.samples());
    let mut found = zeroed(to.len())?;
    let room = || vec![0.0_f64; nx];
    let Ok(()) = par::each_with(found.chunks_mut(to.nx()).zip(&rows), room, |along, _, (found, row)| {
        along.fill(0.0);
        for &(y, weight) in row {
            along.iter_mut().zip(&samples[y * nx..]).for_each(|(sum, sample)| *sum += weight * f64::from(*sample));
        }
        for (found, taps) in found.iter_mut().zip(&columns) {
            *found = taps.iter().map(|&(x, weight)| weight * along[x]).sum::<f64>() as f32;
        }
        Ok::<_, Infallible>(())
    });
    Ok(Field::new(to, found))
}

/// The largest sample under each cell of a window with larger cells.
///
/// # Errors
/// [`OutOfMemory`].
pub fn largest(field: &Field, to: Window) -> Result<Field, OutOfMemory> {
    let from = field.window();
    let under = |at: usize, from: usize, to: usize| (at * from / to)..((at + 1) * from).div_ceil(to);
    let mut found = zeroed(to.len())?;
    par::all(found.chunks_mut(to.nx()), |y, row| {
        for (x, found) in row.iter_mut().enumerate() {
            let rows = under(y, from.ny(), to.ny()).map(|y| &field.samples()[y * from.nx()..]);
            let cells = rows.flat_map(|row| &row[under(x, from.nx(), to.nx())]);
            *found = cells.copied().fold(f32::NEG_INFINITY, f32::max);
        }
    });
    Ok(Field::new(to, found))
}

fn taps(from: usize, to: usize, periodic: bool, at_side: [bool; 2]) -> Vec<Taps> {
    let ratio = from as f64 / to as f64;
    let place = |at: isize| {
        if periodic { at.rem_euclid(from as isize) as usize } else { at.clamp(0, from as isize - 1) as usize }
    };
    let mut taps: Vec<Taps> = (0..to)
        .map(|at| {
            if ratio <= 1.0 {
                let middle = (at as f64 + 0.5) * ratio - 0.5;
                let first = middle.floor();
                let share = middle - first;
                return vec![(place(first as isize), 1.0 - share), (place(first as isize + 1), share)];
            }
            let (low, high) = (at as f64 * ratio, (at + 1) as f64 * ratio);
            let covered = |k: usize| (high.min((k + 1) as f64) - low.max(k as f64)) / ratio;
            (low as usize..from.min(high.ceil() as usize)).map(|k| (k, covered(k))).filter(|tap| tap.1 > 1e-9).collect()
        })
        .collect();
    if at_side[0] {
        taps[0] = vec![(0, 1.0)];
    }
    if at_side[1] {
        taps[to - 1] = vec![(from - 1, 1.0)];
    }
    taps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn means_and_planes_stay() {
        let plane =
            |cells: u32| testing::field(testing::world(cells, cells, 960.0 / f64::from(cells)), |x, y| 3.0 * x - y);
        for (from, to) in [(96, 48), (96, 60), (100, 37)] {
            let found = resampled(&plane(from), *plane(to).window(), false).expect("memory");
            // the samples stand for whole cells: parts of them are up to a quarter of one off their places
            let tolerance = if from % to == 0 { 0.01 } else { 4.0 * 0.25 * 960.0 / from as f32 };
            for (found, expected) in found.samples().iter().zip(plane(to).samples()) {
                assert!((found - expected).abs() < tolerance, "{from} {to}: {found} {expected}");
            }
        }
        let up = resampled(&plane(40), *plane(96).window(), false).expect("memory");
        for (cell, (found, expected)) in up.samples().iter().zip(plane(96).samples()).enumerate() {
            let inside = [cell % 96, cell / 96].iter().all(|at| (2..94).contains(at));
            assert!(!inside || (found - expected).abs() < 0.01, "{cell}: {found} {expected}");
        }
        let base = resampled(&plane(96), *plane(48).window(), true).expect("memory");
        assert_eq!(base.samples()[0], plane(96).samples()[0]);
        assert_eq!(largest(&plane(96), *plane(48).window()).expect("memory").samples()[0], plane(96).samples()[1]);
    }
}
