//! The value of a rank by a sorting network.

use orograph_graph::{Job, NodeError};

use super::Padded;
use crate::numerics::{par, simd::simd};

/// Places per SIMD block.
const LANES: usize = 32;

/// Returns the value of a rank among the cells at these offsets along x and y from each cell.
pub fn sorted(job: &Job<'_>, land: &Padded, around: &[[i64; 2]], rank: usize) -> Result<Vec<f32>, NodeError> {
    let [nx, ny] = land.cells;
    let exchanges = wanted(network(around.len()), around.len(), rank);
    let mut out = vec![0.0; nx * ny];
    par::each(out.chunks_mut(nx), |j, row| {
        job.check()?;
        let mut values = vec![[0.0; LANES]; around.len()];
        for (k, out) in row.chunks_mut(LANES).enumerate() {
            let first = (j + land.margin) * land.width + land.margin + k * LANES;
            for (values, [x, y]) in values.iter_mut().zip(around) {
                let from = (first as i64 + y * land.width as i64 + x) as usize;
                values[..out.len()].copy_from_slice(&land.samples[from..from + out.len()]);
            }
            exchange(&mut values, &exchanges);
            out.copy_from_slice(&values[rank][..out.len()]);
        }
        Ok::<_, NodeError>(())
    })?;
    Ok(out)
}

/// Returns the pairs of places to compare and swap, in order, to sort that many values.
fn network(count: usize) -> Vec<[usize; 2]> {
    let mut pairs = Vec::new();
    let top = count.next_power_of_two() / 2;
    let mut p = top;
    while p > 0 {
        let (mut q, mut rest, mut distance) = (top, 0, p);
        loop {
            pairs.extend((0..count - distance).filter(|i| i & p == rest).map(|i| [i, i + distance]));
            if q == p {
                break;
            }
            (distance, rest, q) = (q - p, p, q / 2);
        }
        p /= 2;
    }
    pairs
}

/// Returns the pairs that affect the value at one place.
fn wanted(mut pairs: Vec<[usize; 2]>, count: usize, place: usize) -> Vec<[usize; 2]> {
    let mut wanted = vec![false; count];
    wanted[place] = true;
    pairs.reverse();
    pairs.retain(|&[low, high]| {
        let part = wanted[low] || wanted[high];
        wanted[low] |= part;
        wanted[high] |= part;
        part
    });
    pairs.reverse();
    pairs
}

simd! {
    fn exchange(values: &mut [[f32; LANES]], pairs: &[[usize; 2]]) {
        for &[low, high] in pairs {
            let (mut a, mut b) = (values[low], values[high]);
            for lane in 0..LANES {
                let (x, y) = (a[lane], b[lane]);
                a[lane] = if y < x { y } else { x };
                b[lane] = if y < x { x } else { y };
            }
            (values[low], values[high]) = (a, b);
        }
    }
}
