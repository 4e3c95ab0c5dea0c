//! The Gaussian filter of a standard deviation in metres, whose cost does not depend on the width.
//!
//! Below four cells the weights are those of the discrete Gaussian, e^(−t) Iₖ(t) with the modified Bessel functions I
//! and t the variance in cells² (T. Lindeberg, 1990, Scale-space for discrete signals), whose variance is exact at any
//! width. From four cells on, four extended box filters are applied, boxes with a fraction of a cell at each end, whose
//! variances add up to that of the Gaussian (P. Gwosdek, S. Grewenig, A. Bruhn, J. Weickert, 2011, Theoretical
//! foundations of Gaussian convolution by extended box filtering); the largest error of a weight is 3.6 % of the
//! largest weight.
//!
//! Differences from the source: boxes are not running sums, whose rounding depends on their starting point. Lines are
//! divided at multiples of the box's length, counted from the world's edge. A box is the end of one division and the
//! beginning of the next, whose partial sums are computed once. A cell thus gets the same bits in every window, and
//! errors do not accumulate along a line.
//!
//! Lines repeat beyond the world: there and back if they are mirrored, in a period if they wrap around. A box that is
//! longer than twice the world is therefore a number of whole periods and a rest, whose sum is the difference of two
//! sums from the start of the line. So the table of a box never exceeds the world, however wide the Gaussian is; the
//! result is that of the whole box, except for rounding.

use super::lines::{Ends, LANES, Lanes, LineFilter};
use super::simd::simd;

/// A Gaussian filter for lines.
#[derive(Clone, Debug)]
pub enum Gaussian {
    /// Weights of the central cell and of the cells on either side.
    Weights(Vec<f64>),
    /// Extended boxes, applied in sequence.
    Boxes(Extended),
}

/// A box of `2 radius + 1` cells with a fraction of the next cell at each end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extended {
    radius: usize,
    share: f64,
}

/// Number of box passes.
const PASSES: usize = 4;

/// Standard deviation in cells from which boxes are used.
const WIDE: f64 = 4.0;

impl Gaussian {
    /// Creates a filter with a standard deviation in cells.
    #[must_use]
    pub fn new(sigma_cells: f64) -> Self {
        let variance = sigma_cells * sigma_cells;
        if sigma_cells < WIDE {
            Self::Weights(discrete(variance))
        } else {
            Self::Boxes(Extended::new(variance / PASSES as f64))
        }
    }

    /// Returns the bytes that [`separable`](super::lines::separable) needs in addition to its result, on one thread:
    /// strips of columns, and lines with the halo of the filter.
    #[must_use]
    pub fn bytes(sigma_m: f64, window: &orograph_graph::Window) -> u64 {
        let filter = Self::new(sigma_m / window.cell_m());
        let cells = |axis: usize| {
            let n = window.cells[axis] as usize;
            match &filter {
                _ if filter.exceeds(window.world.cells[axis] as usize) => 3 * Ends::of(window, axis).period(n) + 1,
                Self::Weights(_) => n + 2 * filter.reach(),
                Self::Boxes(extended) => n + 2 * filter.reach() + 2 * extended.radius + 1,
            }
        };
        let strips = window.nx().div_ceil(LANES) * window.ny() * size_of::<&mut [f32]>();
        (cells(0).max(cells(1)) * size_of::<Lanes>() + strips) as u64
    }

    /// Returns the distance around a cell in metres that is read, for cells of `cell_m`.
    #[must_use]
    pub fn reach_m(sigma_m: f64, cell_m: f64) -> f64 {
        Self::new(sigma_m / cell_m).reach() as f64 * cell_m
    }
}

impl LineFilter for Gaussian {
    fn reach(&self) -> usize {
        match self {
            Self::Weights(weights) => weights.len() - 1,
            Self::Boxes(extended) => PASSES * (extended.radius + 1),
        }
    }

    fn apply(&self, lines: &mut [Lanes], scratch: &mut Vec<Lanes>, first: i64) {
        match self {
            Self::Weights(weights) => weigh(lines, weights),
            Self::Boxes(extended) => {
                scratch.resize(2 * extended.radius + 1, [0.0; LANES]);
                let (mut len, mut first) = (lines.len(), first);
                for _ in 0..PASSES {
                    extended.apply(&mut lines[..len], scratch, first);
                    len -= 2 * (extended.radius + 1);
                    first += extended.radius as i64 + 1;
                }
            }
        }
    }

    fn exceeds(&self, cells: usize) -> bool {
        match self {
            Self::Weights(_) => false,
            Self::Boxes(extended) => extended.radius >= cells,
        }
    }

    fn apply_to_period(&self, period: &mut [Lanes], scratch: &mut Vec<Lanes>) {
        if let Self::Boxes(extended) = self {
            (0..PASSES).for_each(|_| extended.apply_to_period(period, scratch));
        }
    }
}

/// Returns the weights of the discrete Gaussian of that variance, from the centre to where they fall below 1e-8.
fn discrete(variance: f64) -> Vec<f64> {
    if variance < 1e-12 {
        return vec![1.0];
    }
    // downward recurrence I(k−1) = I(k+1) + (2k / t) I(k), which is stable for any small starting value (J. C. P.
    // Miller)
    let count = (6.0 * variance.sqrt() + 14.0) as usize;
    let mut bessel = vec![0.0; count + 2];
    bessel[count] = 1e-280;
    for k in (1..=count).rev() {
        bessel[k - 1] = bessel[k + 1] + 2.0 * k as f64 / variance * bessel[k];
        if bessel[k - 1] > 1e200 {
            bessel.iter_mut().for_each(|value| *value *= 1e-200);
        }
    }
    let sum = bessel[0] + 2.0 * bessel[1..].iter().rev().sum::<f64>();
    let mut weights: Vec<f64> = bessel.iter().map(|value| value / sum).collect();
    let end = weights.iter().rposition(|weight| *weight > 1e-8).unwrap_or(0);
    weights.truncate(end + 1);
    // the omitted weights are added to the centre
    weights[0] = 1.0 - 2.0 * weights[1..].iter().rev().sum::<f64>();
    weights
}

simd! {
    fn weigh(lines: &mut [Lanes], weights: &[f64]) {
        let reach = weights.len() - 1;
        for i in 0..lines.len() - 2 * reach {
            let mut sum = lines[i + reach].map(|value| value * weights[0]);
            for (k, &weight) in weights.iter().enumerate().skip(1) {
                let (before, after) = (&lines[i + reach - k], &lines[i + reach + k]);
                for lane in 0..LANES {
                    sum[lane] += weight * (before[lane] + after[lane]);
                }
            }
            lines[i] = sum;
        }
    }
}

impl Extended {
    /// Creates the box of that variance in cells².
    fn new(variance: f64) -> Self {
        let radius = (0.5 * ((12.0 * variance + 1.0).sqrt() - 1.0)).floor();
        let next = (radius + 1.0) * (radius + 1.0);
        let share = (2.0 * radius + 1.0) * (radius * (radius + 1.0) - 3.0 * variance) / (6.0 * (variance - next));
        Self { radius: radius as usize, share }
    }

    fn apply(self, lines: &mut [Lanes], tails: &mut [Lanes], first: i64) {
        boxes(lines, tails, first, self.radius, self.share);
    }

    /// Applies the box to lines that repeat after the cells of `period`.
    fn apply_to_period(self, period: &mut [Lanes], scratch: &mut Vec<Lanes>) {
        let cells = period.len();
        scratch.clear();
        scratch.reserve_exact(2 * cells + 1);
        scratch.extend_from_slice(period);
        // sums of the cells before each cell, and of all
        scratch.push([0.0; LANES]);
        let mut sum = [0.0; LANES];
        for cell in &*period {
            add(&mut sum, cell);
            scratch.push(sum);
        }
        let (before, sums) = scratch.split_at(cells);
        let length = 2 * self.radius + 1;
        let (whole, rest) = ((length / cells) as f64, length % cells);
        let scale = 1.0 / (length as f64 + 2.0 * self.share);
        // the first cell of the box around the first cell
        let shift = cells - self.radius % cells;
        for (at, out) in period.iter_mut().enumerate() {
            let start = (at + shift) % cells;
            let end = (start + rest) % cells;
            let around = if start + rest < cells { &[0.0; LANES] } else { &sum };
            let (left, right) = (&before[(start + cells - 1) % cells], &before[end]);
            for lane in 0..LANES {
                let part = sums[end][lane] - sums[start][lane] + around[lane];
                out[lane] = (whole * sum[lane] + part + self.share * (left[lane] + right[lane])) * scale;
            }
        }
    }
}

simd! {
    /// Applies one extended box along lines whose first cell is at `first` in the world. `tails` is scratch space for
    /// `2 radius + 1` cells.
    fn boxes(lines: &mut [Lanes], tails: &mut [Lanes], first: i64, radius: usize, share: f64) {
        let length = 2 * radius + 1;
        let scale = 1.0 / (length as f64 + 2.0 * share);
        // cells of the first division that lie before the lines
        let mut missing = first.rem_euclid(length as i64) as usize;
        // first available cell of the division
        let mut part = 0;
        while part + length < lines.len() + missing {
            // sums from a cell to the end of its division; a last division that is cut short has no box
            let mut tail = [0.0; LANES];
            let cells = lines[part..].iter().take(length - missing);
            for (cell, sum) in cells.zip(&mut tails[missing..length]).rev() {
                add(&mut tail, cell);
                *sum = tail;
            }
            // boxes that begin at `place` of the division end in the next one
            let mut head = [0.0; LANES];
            for (place, tail) in tails[..length].iter().enumerate() {
                let end = part + length - 1 + place - missing;
                if end + 1 >= lines.len() {
                    return;
                }
                if place > 0 {
                    add(&mut head, &lines[end]);
                }
                // the cell before the box, which must be available too
                if let Some(i) = (part + place).checked_sub(missing + 1) {
                    let (before, after) = (lines[i], lines[end + 1]);
                    for lane in 0..LANES {
                        lines[i][lane] = (tail[lane] + head[lane] + share * (before[lane] + after[lane])) * scale;
                    }
                }
            }
            part += length - missing;
            missing = 0;
        }
    }
}

#[inline(always)]
fn add(sum: &mut Lanes, cell: &Lanes) {
    for lane in 0..LANES {
        sum[lane] += cell[lane];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the response to a unit impulse, and the index of its centre.
    fn response(sigma_cells: f64) -> (Vec<f64>, usize) {
        let filter = Gaussian::new(sigma_cells);
        let middle = 2 * filter.reach() + 1;
        let mut lines = vec![[0.0; LANES]; 2 * middle + 1];
        lines[middle] = [1.0; LANES];
        filter.apply(&mut lines, &mut Vec::new(), -7);
        lines.truncate(2 * middle + 1 - 2 * filter.reach());
        (lines.iter().map(|cell| cell[0]).collect(), middle - filter.reach())
    }

    #[test]
    fn weights_sum_to_one_and_have_the_variance_asked_for() {
        for sigma in [0.1, 0.4, 1.0, 2.5, 3.99, 4.0, 7.3, 25.0, 140.7] {
            let (weights, middle) = response(sigma);
            let sum: f64 = weights.iter().sum();
            let variance: f64 = weights
                .iter()
                .enumerate()
                .map(|(k, w)| w * (k as f64 - middle as f64) * (k as f64 - middle as f64))
                .sum();
            // rounding, and omitted weights below 1e-8
            assert!(
                (sum - 1.0).abs() < 1e-12 && (variance / (sigma * sigma) - 1.0).abs() < 1e-5,
                "{sigma}: {sum} {variance}"
            );
            assert!(weights.iter().all(|weight| *weight >= 0.0));
            assert!((0..=middle).all(|k| (weights[middle - k] - weights[middle + k]).abs() < 1e-15), "{sigma}");
        }
    }

    #[test]
    fn boxes_are_near_the_gaussian() {
        for sigma in [4.0, 11.0, 60.0] {
            let (weights, middle) = response(sigma);
            let top = 1.0 / (sigma * std::f64::consts::TAU.sqrt());
            let exact = |k: f64| top * libm::exp(-0.5 * (k / sigma) * (k / sigma));
            let error = weights.iter().enumerate().map(|(k, w)| (w - exact(k as f64 - middle as f64)).abs());
            let worst = error.fold(0.0, f64::max) / top;
            assert!(worst < 0.036, "{sigma}: {worst}");
        }
    }

    /// Lines whose boxes are longer than the world are what they are when every cell of the box is summed.
    #[test]
    fn wide_boxes_are_folded() {
        for (ends, n) in [(Ends::Mirror, 1), (Ends::Mirror, 7), (Ends::Wrap, 1), (Ends::Wrap, 10)] {
            for sigma in [4.1, 12.0, 33.3, 700.0] {
                let filter = Gaussian::new(sigma);
                if !filter.exceeds(n) {
                    continue;
                }
                let cell = |at: usize| [libm::sin(at as f64 * 1.3) * 100.0 + 5.0; LANES];
                let reach = filter.reach();
                let index = |at: usize| ends.index(at as i64 - reach as i64, n);
                let mut lines: Vec<Lanes> = (0..n + 2 * reach).map(|at| cell(index(at))).collect();
                filter.apply(&mut lines, &mut Vec::new(), 0);
                let mut period: Vec<Lanes> = (0..ends.period(n)).map(|at| cell(ends.index(at as i64, n))).collect();
                filter.apply_to_period(&mut period, &mut Vec::new());
                for at in 0..n {
                    assert!((lines[at][3] - period[at][3]).abs() < 1e-10, "{ends:?} {n} {sigma}");
                }
            }
        }
    }

    /// The mean of everything is what remains far beyond the world, at no cost.
    #[test]
    fn the_widest_is_the_mean() {
        let filter = Gaussian::new(1e12);
        let mut period: Vec<Lanes> = (0..8).map(|at| [f64::from(at); LANES]).collect();
        filter.apply_to_period(&mut period, &mut Vec::new());
        assert!(period.iter().all(|cell| (cell[0] - 3.5).abs() < 1e-9), "{period:?}");
    }

    /// Reference: plain sums over every box.
    #[test]
    fn boxes_are_sums_wherever_lines_begin() {
        let values: Vec<f64> = (0..90).map(|k| libm::sin(f64::from(k) * 1.3) * 100.0 + 5.0).collect();
        for (radius, share) in [(0, 0.3), (1, 0.0), (3, 0.77), (20, 0.5)] {
            let extended = Extended { radius, share };
            let scale = 1.0 / ((2 * radius + 1) as f64 + 2.0 * share);
            for first in [-100, -3, 0, 1, 2, 8, 1000] {
                let mut lines: Vec<Lanes> = values.iter().map(|value| [*value; LANES]).collect();
                extended.apply(&mut lines, &mut vec![[0.0; LANES]; 2 * radius + 1], first);
                for i in 0..90 - 2 * (radius + 1) {
                    let inner: f64 = values[i + 1..=i + 1 + 2 * radius].iter().sum();
                    let expected = (inner + share * (values[i] + values[i + 2 * radius + 2])) * scale;
                    assert!((lines[i][5] - expected).abs() < 1e-12 * 100.0, "{radius} {first} {i}");
                }
            }
        }
    }
}
