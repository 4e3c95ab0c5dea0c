//! PNG filters: each byte minus its prediction from neighbours.
//!
//! Source: W3C, "Portable Network Graphics (PNG) Specification (Third Edition)" (2025), 9. Each row uses the filter
//! with the smallest sum of residuals among `Sub` (west), `Up` (north) and `Paeth`, as the specification advises.
//! `None` and `Average` are omitted: they are hardly ever best on terrain.

use crate::numerics::{par, simd::simd};

/// Codes of the filters in the file, in the order in which they are tried.
const SUB: u8 = 1;
const UP: u8 = 2;
const PAETH: u8 = 4;

/// Minimum number of bytes per task.
const TURN: usize = 1 << 14;

/// Filters rows of `length` bytes with `step` bytes per cell. The first row of `bytes` precedes those to filter. Each
/// filtered row goes into `lines` after the code of its filter.
pub(super) fn filter(lines: &mut [u8], bytes: &[u8], length: usize, step: usize) {
    let rows = TURN / length + 1;
    par::all(lines.chunks_mut(rows * (length + 1)), |part, lines| {
        let (mut rests, mut best) = (vec![0; length], vec![0; length]);
        for (j, line) in (part * rows..).zip(lines.chunks_mut(length + 1)) {
            let (north, row) = bytes[j * length..(j + 2) * length].split_at(length);
            let mut least = u64::MAX;
            for filter in [PAETH, UP, SUB] {
                match filter {
                    PAETH => paeth(&mut rests, row, north, step),
                    UP => up(&mut rests, row, north),
                    _ => sub(&mut rests, row, step),
                }
                let sum = sum(&rests);
                if sum < least {
                    (least, line[0]) = (sum, filter);
                    std::mem::swap(&mut rests, &mut best);
                }
            }
            line[1..].copy_from_slice(&best);
        }
    });
}

simd! {
    fn sub(out: &mut [u8], row: &[u8], step: usize) {
        out[..step].copy_from_slice(&row[..step]);
        for ((out, v), west) in out[step..].iter_mut().zip(&row[step..]).zip(row) {
            *out = v.wrapping_sub(*west);
        }
    }
}

simd! {
    fn up(out: &mut [u8], row: &[u8], north: &[u8]) {
        for ((out, v), north) in out.iter_mut().zip(row).zip(north) {
            *out = v.wrapping_sub(*north);
        }
    }
}

simd! {
    /// Applies the Paeth predictor: the one of west, north and north-west that is nearest to west + north - north-west;
    /// ties are resolved in this order.
    fn paeth(out: &mut [u8], row: &[u8], north: &[u8], step: usize) {
        for ((out, v), north) in out[..step].iter_mut().zip(row).zip(north) {
            *out = v.wrapping_sub(*north);
        }
        let places = out[step..].iter_mut().zip(&row[step..]).zip(row).zip(&north[step..]).zip(north);
        for ((((out, v), west), north), corner) in places {
            let [a, b, c] = [*west, *north, *corner].map(i16::from);
            let (of_west, of_north) = (b - c, a - c);
            let [pa, pb, pc] = [of_west, of_north, of_west + of_north].map(i16::abs);
            let other = if pb <= pc { *north } else { *corner };
            *out = v.wrapping_sub(if pa <= pb && pa <= pc { *west } else { other });
        }
    }
}

simd! {
    /// Returns the sum of absolute residuals, modulo 256.
    fn sum(rests: &[u8]) -> u64 {
        let mut all = 0;
        for part in rests.chunks(1 << 12) {
            let mut sum = 0_u32;
            for rest in part {
                sum += u32::from(rest.cast_signed().unsigned_abs());
            }
            all += u64::from(sum);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::mix;

    use super::*;
    use crate::testing::at_every_level;

    /// Reference decoder: undoes the filters byte by byte, as in the specification.
    fn unfiltered(filtered: &[u8], length: usize, step: usize) -> Vec<u8> {
        let mut rows: Vec<Vec<u8>> = vec![vec![0; length]];
        for line in filtered.chunks(length + 1) {
            let north = rows.last().cloned().unwrap_or_default();
            let mut row = vec![0_u8; length];
            for i in 0..length {
                let [a, c] = if i < step { [0, 0] } else { [row[i - step], north[i - step]] };
                let b = north[i];
                let p = i32::from(a) + i32::from(b) - i32::from(c);
                let away = |v: u8| (p - i32::from(v)).abs();
                let foretold = match line[0] {
                    SUB => a,
                    UP => b,
                    PAETH if away(a) <= away(b) && away(a) <= away(c) => a,
                    PAETH if away(b) <= away(c) => b,
                    PAETH => c,
                    other => panic!("no filter {other}"),
                };
                row[i] = line[1 + i].wrapping_add(foretold);
            }
            rows.push(row);
        }
        rows[1..].concat()
    }

    /// Filters all rows of a picture; the row before the first is zero.
    fn filtered(bytes: &[u8], length: usize, step: usize) -> Vec<u8> {
        let mut lines = vec![0; bytes.len() / length * (length + 1)];
        filter(&mut lines, &[&vec![0; length], bytes].concat(), length, step);
        lines
    }

    #[test]
    fn filters_are_undone() {
        for (step, length) in [(1, 70), (2, 64), (3, 99), (4, 4), (6, 132), (2, 2), (1, 1)] {
            let bytes: Vec<u8> = (0..length * 23)
                .map(|at| match at / length % 3 {
                    0 => mix(at as u32) as u8,
                    1 => (at * 3 / step) as u8,
                    _ => 200,
                })
                .collect();
            let lines = filtered(&bytes, length, step);
            assert_eq!(lines.len(), 23 * (length + 1));
            assert!(unfiltered(&lines, length, step) == bytes, "{step} {length}");
            at_every_level(|| filtered(&bytes, length, step));
        }
    }

    #[test]
    fn each_row_takes_the_filter_that_leaves_least() {
        // noise, the same noise slightly higher, and an unrelated ramp
        let noise = |up: u8| (0..400).map(move |i| (mix(i) as u8).wrapping_add(up));
        let ramp = (0..400).map(|i| (i * 3) as u8);
        let bytes: Vec<u8> = noise(0).chain(noise(2)).chain(ramp).collect();
        let lines = filtered(&bytes, 400, 1);
        assert_eq!([lines[401], lines[802]], [UP, SUB]);
        assert!(lines[402..802].iter().all(|rest| *rest == 2));
        assert!(lines[804..].iter().all(|rest| *rest == 3));
    }
}
