//! Mean, quantiles and probabilities of each cell over all members of a cube.
//!
//! A block of rows of all members is read at a time, so that the memory does not depend on their number. Cells without
//! a number in a member are left out there.

use std::{
    fs::File,
    io::{self, Read as _, Seek as _, SeekFrom},
    path::{Path, PathBuf},
};

use orograph_nodes::numerics::par;

/// Bytes of all members that are in memory at a time.
const BLOCK: usize = 8 << 20;
/// Cells that one thread takes at a time.
const PART: usize = 4096;

/// Receives numbers of a statistic.
pub(super) type Take<'t, E> = dyn FnMut(usize, &[f32]) -> Result<(), E> + 't;

/// What is computed for each cell.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Wanted {
    /// Fractions of the members, from 0 to 1.
    pub(super) quantiles: Vec<f64>,
    /// Values to be exceeded.
    pub(super) thresholds: Vec<f64>,
}

impl Wanted {
    /// Numbers per cell: the mean, the quantiles, and the probability of exceeding each threshold.
    pub(super) fn count(&self) -> usize {
        1 + self.quantiles.len() + self.thresholds.len()
    }

    /// Appends the numbers of a cell, from those of the members in their order; NaN if there are none.
    fn of(&self, values: &mut Vec<f32>, out: &mut Vec<f32>) {
        values.retain(|value| !value.is_nan());
        // the mean adds the members in their order
        let count = values.len() as f64;
        let sum: f64 = values.iter().map(|value| f64::from(*value)).sum();
        let share = |number: f64| if values.is_empty() { f32::NAN } else { number as f32 };
        out.push(share(sum / count));
        let above: Vec<f32> = self
            .thresholds
            .iter()
            .map(|least| share(values.iter().filter(|value| f64::from(**value) > *least).count() as f64 / count))
            .collect();
        values.sort_unstable_by(f32::total_cmp);
        for quantile in &self.quantiles {
            out.push(interpolated(values, *quantile));
        }
        out.extend(above);
    }
}

/// A quantile of sorted numbers, interpolated between neighbours.
fn interpolated(sorted: &[f32], quantile: f64) -> f32 {
    let Some(last) = sorted.len().checked_sub(1) else { return f32::NAN };
    let at = quantile * last as f64;
    let low = at.floor() as usize;
    let [a, b] = [low, (low + 1).min(last)].map(|at| f64::from(sorted[at]));
    (a + (b - a) * (at - low as f64)) as f32
}

/// Computes the statistics of a chunk of so many cells, which each member has in a file of its own, and passes them on
/// in blocks of cells: each statistic by its number, for the same cells.
///
/// # Errors
/// Those of the system, as `failed` makes them, or of `take`.
pub(super) fn of_chunk<E>(
    members: &[PathBuf],
    cells: usize,
    wanted: &Wanted,
    failed: &dyn Fn(&Path, io::Error) -> E,
    take: &mut Take<'_, E>,
) -> Result<(), E> {
    let most = (BLOCK / (size_of::<f32>() * members.len().max(1))).clamp(1, cells);
    let mut bytes = vec![0; size_of::<f32>() * most];
    let mut all = vec![0.0_f32; most * members.len()];
    let mut from = 0;
    while from < cells {
        let count = most.min(cells - from);
        for (member, path) in members.iter().enumerate() {
            let bytes = &mut bytes[..size_of::<f32>() * count];
            read(path, (size_of::<f32>() * from) as u64, bytes).map_err(|error| failed(path, error))?;
            for (value, bytes) in all[member * count..].iter_mut().zip(bytes.chunks_exact(size_of::<f32>())) {
                *value = f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            }
        }
        let parts = (0..count).step_by(PART).map(|first| first..count.min(first + PART));
        let done = par::collect_all(parts, |_, part| {
            let (mut values, mut out) = (Vec::with_capacity(members.len()), Vec::new());
            for cell in part {
                values.clear();
                values.extend((0..members.len()).map(|member| all[member * count + cell]));
                wanted.of(&mut values, &mut out);
            }
            out
        });
        let per_cell = wanted.count();
        for statistic in 0..per_cell {
            let numbers: Vec<f32> =
                done.iter().flat_map(|part| part.iter().skip(statistic).step_by(per_cell)).copied().collect();
            take(statistic, &numbers)?;
        }
        from += count;
    }
    Ok(())
}

/// Reads a part of a file.
fn read(path: &Path, at: u64, bytes: &mut [u8]) -> io::Result<()> {
    let mut file = File::open(path)?;
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_are_those_of_numpy() {
        let wanted = Wanted { quantiles: vec![0.0, 0.25, 0.5, 1.0], thresholds: vec![2.0, 2.5] };
        let of = |values: &[f32]| {
            let mut out = Vec::new();
            wanted.of(&mut values.to_vec(), &mut out);
            out
        };
        // np.mean, np.quantile and (a > t).mean
        assert_eq!(of(&[4.0, 1.0, 2.0, 3.0]), [2.5, 1.0, 1.75, 2.5, 4.0, 0.5, 0.5]);
        assert_eq!(of(&[f32::NAN, 3.0]), [3.0, 3.0, 3.0, 3.0, 3.0, 1.0, 1.0]);
        assert!(of(&[f32::NAN]).iter().all(|v| v.is_nan()));
    }
}
