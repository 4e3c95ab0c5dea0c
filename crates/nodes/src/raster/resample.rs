//! Resamples one grid of cells onto another, axis by axis.
//!
//! Cells are areas. Where target cells are larger, each is the mean of the area it covers (conservative: the volume of
//! the terrain is preserved). Where they are smaller, values are interpolated by the Catmull-Rom cubic (E. Catmull, R.
//! Rom, 1974, "A class of local interpolating splines"), clamped to the two neighbouring samples, so that no new
//! summits or pits appear. Where the grids coincide, samples are copied bit for bit.

use std::ops::Range;

use orograph_graph::{
    NodeError,
    memory::{OutOfMemory, zeroed},
};

use crate::numerics::par;

/// Mapping of target cells to source cells along one axis: target cell i covers `offset + i * step` to `offset + (i +
/// 1) * step`, in source cells from the first one's edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridAxis {
    /// Number of source cells.
    pub source: usize,
    /// Position where target cell 0 begins.
    pub offset: f64,
    /// Source cells per target cell.
    pub step: f64,
}

/// Tolerance for a step of one and a whole offset, which covers rounding.
const SNAP: f64 = 1e-6;

/// The weights of source cells for a target cell along an axis, which sum to one.
struct Taps {
    first: usize,
    weights: Vec<f64>,
    /// The two cells between which an interpolated value must stay.
    between: Option<[usize; 2]>,
    /// True if the centre of the target cell is on the source grid.
    inside: bool,
}

impl GridAxis {
    /// Snaps a step close to one, with an offset close to whole cells, to exact values.
    ///
    /// A step of one with an offset of half a cell, which results from centring an odd number in an even one, becomes a
    /// whole offset: a shift of half a cell in exchange for unchanged samples.
    #[must_use]
    pub fn snapped(mut self) -> Self {
        let whole = (self.offset + SNAP).floor();
        if (self.step - 1.0).abs() * self.source as f64 <= SNAP {
            self.step = 1.0;
            let rest = self.offset - whole;
            if rest.abs() <= SNAP || (rest - 0.5).abs() <= SNAP {
                self.offset = whole;
            }
        }
        self
    }

    /// As [`Self::snapped`], but never moves the raster by half a cell.
    #[must_use]
    pub fn snapped_to_cells(self) -> Self {
        let whole = (self.offset + SNAP).floor();
        if (self.offset - whole).abs() <= SNAP { self.snapped() } else { self }
    }

    /// Returns the number of target cells from the beginning that cover the source, if the offset is 0.
    #[must_use]
    pub fn cells(&self) -> usize {
        ((self.source as f64 / self.step).ceil() as usize).max(1)
    }

    fn taps(&self, target: usize) -> Taps {
        let last = self.source - 1;
        let cell = |at: f64| (at.max(0.0) as usize).min(last);
        let lo = self.offset + target as f64 * self.step;
        let hi = self.offset + (target + 1) as f64 * self.step;
        let centre = 0.5 * (lo + hi);
        let inside = centre >= 0.0 && centre <= self.source as f64;
        let single = |first| Taps { first, weights: vec![1.0], between: None, inside };
        if self.step > 1.0 {
            let (lo, hi) = (lo.max(0.0), hi.min(self.source as f64));
            if lo >= hi {
                return single(cell(centre.floor()));
            }
            let (first, end) = (cell(lo.floor()), cell(hi.ceil() - 1.0));
            let weights = (first..=end)
                .map(|at| ((at as f64 + 1.0).min(hi) - (at as f64).max(lo)).max(0.0) / (hi - lo))
                .collect();
            return Taps { first, weights, between: None, inside };
        }
        let at = centre - 0.5;
        let left = at.floor();
        let t = at - left;
        if t == 0.0 || last == 0 {
            return single(cell(left));
        }
        let (t2, t3) = (t * t, t * t * t);
        let cubic = [
            0.5 * (2.0 * t2 - t3 - t),
            0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
            0.5 * (4.0 * t2 - 3.0 * t3 + t),
            0.5 * (t3 - t2),
        ];
        // beyond the edge the outermost sample is repeated; its weights are summed in one tap
        let places = [cell(left - 1.0), cell(left), cell(left + 1.0), cell(left + 2.0)];
        let mut weights = vec![0.0; places[3] - places[0] + 1];
        for (place, weight) in places.into_iter().zip(cubic) {
            weights[place - places[0]] += weight;
        }
        Taps { first: places[0], weights, between: Some([places[1], places[2]]), inside }
    }
}

/// Resamples a row-major raster without NaN to `cells` target cells from `origin`, along x and y.
///
/// Target cells whose centre is outside the source get `beyond` or, if it is `None`, the nearest value at the edge.
/// Sums are computed in f64 in a fixed order, so the result depends neither on threads nor on the requested part.
/// `check` is called once per row, and its error stops the work.
///
/// # Errors
/// The error of `check`.
///
/// # Panics
/// If the number of samples is 0 or differs from that of the axes.
pub fn resample(
    samples: &[f32],
    axes: [GridAxis; 2],
    origin: [u32; 2],
    cells: [u32; 2],
    beyond: Option<f32>,
    check: &(dyn Fn() -> Result<(), NodeError> + Sync),
) -> Result<Vec<f32>, NodeError> {
    let count = axes[0].source * axes[1].source;
    assert!(!samples.is_empty() && samples.len() == count, "samples do not fill the raster");
    let mut resampler = Resampler::new(axes, origin, cells, beyond)?;
    resampler.take(0, samples, check)?;
    Ok(resampler.into_samples())
}

/// Resamples a raster whose rows come one after another; the same as [`resample`], bit for bit.
///
/// In memory are the result and, narrowed to its columns, the rows that were given last.
pub struct Resampler {
    across: Vec<Taps>,
    down: Vec<Taps>,
    /// True if target cells are larger than source cells along y.
    is_mean: bool,
    beyond: Option<f32>,
    /// The source's columns and rows that are needed.
    needed: [Range<usize>; 2],
    columns: usize,
    /// Rows from `first` on, resampled along x.
    narrowed: Vec<f32>,
    first: usize,
    /// For the next target row, the sum over the source rows before `first`.
    sums: Vec<f64>,
    out: Vec<f32>,
    /// The number of target rows that are complete.
    done: usize,
}

impl Resampler {
    /// Begins a raster of `cells` target cells from `origin`. For `beyond` see [`resample`].
    ///
    /// # Errors
    /// [`OutOfMemory`].
    pub fn new(
        axes: [GridAxis; 2],
        origin: [u32; 2],
        cells: [u32; 2],
        beyond: Option<f32>,
    ) -> Result<Self, OutOfMemory> {
        let taps = |axis: usize| -> Vec<Taps> {
            let first = origin[axis] as usize;
            (first..first + cells[axis] as usize).map(|target| axes[axis].taps(target)).collect()
        };
        let (across, down) = (taps(0), taps(1));
        let needed = [&across, &down].map(|taps| {
            let first = taps.iter().map(|t| t.first).min().unwrap_or(0);
            first..taps.iter().map(|t| t.first + t.weights.len()).max().unwrap_or(0)
        });
        Ok(Self {
            is_mean: axes[1].step > 1.0,
            beyond,
            columns: axes[0].source,
            narrowed: Vec::new(),
            first: needed[1].start,
            needed,
            sums: zeroed(across.len())?,
            out: zeroed(across.len() * down.len())?,
            done: 0,
            across,
            down,
        })
    }

    /// Returns the needed part of the given rows: of each, the columns that are read.
    pub fn needed<'s>(&self, first: usize, samples: &'s [f32]) -> impl Iterator<Item = &'s [f32]> {
        let [columns, rows] = self.needed.clone();
        let rows_given = samples.chunks(self.columns).zip(first..);
        rows_given.filter(move |(_, at)| rows.contains(at)).map(move |(row, _)| &row[columns.clone()])
    }

    /// Takes the next rows of the source. `check` is called once per row, and its error stops the work.
    ///
    /// # Errors
    /// The error of `check`, or [`OutOfMemory`].
    ///
    /// # Panics
    /// If rows are missing before them.
    pub fn take(
        &mut self,
        first: usize,
        samples: &[f32],
        check: &(dyn Fn() -> Result<(), NodeError> + Sync),
    ) -> Result<(), NodeError> {
        let (nx, rows) = (self.across.len(), &self.needed[1]);
        let (from, end) = (first.max(rows.start), (first + samples.len() / self.columns).min(rows.end));
        if from >= end {
            return Ok(());
        }
        let known = self.narrowed.len();
        assert_eq!(self.first + known / nx, from, "rows come in order");
        // source rows are resampled along x first, only those that are needed
        let mut narrowed = zeroed::<f32>(known + nx * (end - from))?;
        narrowed[..known].copy_from_slice(&self.narrowed);
        let across = &self.across;
        let given = samples[(from - first) * self.columns..].chunks(self.columns);
        par::each(narrowed[known..].chunks_mut(nx).zip(given), |_, (out, row)| {
            for (out, taps) in out.iter_mut().zip(across) {
                let reach = &row[taps.first..taps.first + taps.weights.len()];
                let sum: f64 = reach.iter().zip(&taps.weights).map(|(v, w)| f64::from(*v) * w).sum();
                *out = taps.between.map_or(sum as f32, |[a, b]| between(sum as f32, row[a], row[b]));
            }
            check()
        })?;
        self.narrowed = narrowed;
        self.complete(end, check)?;
        self.forget(end);
        Ok(())
    }

    /// Makes the target rows that need no source rows from `end` on.
    fn complete(&mut self, end: usize, check: &(dyn Fn() -> Result<(), NodeError> + Sync)) -> Result<(), NodeError> {
        let Self { across, down, beyond, narrowed, first, sums: before, out, done, .. } = self;
        let (nx, first) = (across.len(), *first);
        let ready = down[*done..].iter().take_while(|taps| taps.first + taps.weights.len() <= end).count();
        let rows = out[*done * nx..(*done + ready) * nx].chunks_mut(nx).zip(&down[*done..]);
        par::each_with(
            rows,
            || vec![0.0_f64; nx],
            |sums, k, (out, taps)| {
                let row = |at: usize| &narrowed[(at - first) * nx..(at - first + 1) * nx];
                if k == 0 {
                    sums.copy_from_slice(before)
                } else {
                    sums.fill(0.0)
                }
                add(sums, taps, first..end, row);
                match taps.between {
                    None => out.iter_mut().zip(sums.iter()).for_each(|(out, sum)| *out = *sum as f32),
                    Some([a, b]) => {
                        for (((out, sum), a), b) in out.iter_mut().zip(sums.iter()).zip(row(a)).zip(row(b)) {
                            *out = between(*sum as f32, *a, *b);
                        }
                    }
                }
                if let Some(level) = *beyond {
                    for (out, across) in out.iter_mut().zip(&*across) {
                        if !(across.inside && taps.inside) {
                            *out = level;
                        }
                    }
                }
                check()
            },
        )?;
        if ready > 0 {
            before.fill(0.0);
        }
        *done += ready;
        Ok(())
    }

    /// Drops the rows before `end` that no later target row needs.
    fn forget(&mut self, end: usize) {
        let Self { across, down, narrowed, first, sums, done, .. } = self;
        let nx = across.len();
        let kept = match down.get(*done) {
            None => end,
            Some(taps) if self.is_mean => {
                add(sums, taps, *first..end, |at| &narrowed[(at - *first) * nx..(at - *first + 1) * nx]);
                end
            }
            // a position on a cell needs that cell only, and the position after it also the cell before
            Some(taps) => taps.first.saturating_sub(1).clamp(*first, end),
        };
        narrowed.drain(..(kept - *first) * nx);
        *first = kept;
    }

    /// Returns the result.
    ///
    /// # Panics
    /// If rows are missing.
    #[must_use]
    pub fn into_samples(self) -> Vec<f32> {
        assert_eq!(self.done, self.down.len(), "all rows were given");
        self.out
    }
}

/// Adds the weighted source rows of a target row that are among the given ones.
fn add<'r>(sums: &mut [f64], taps: &Taps, given: Range<usize>, row: impl Fn(usize) -> &'r [f32]) {
    for (at, weight) in (taps.first..).zip(&taps.weights).filter(|(at, _)| given.contains(at)) {
        for (sum, v) in sums.iter_mut().zip(row(at)) {
            *sum += f64::from(*v) * weight;
        }
    }
}

fn between(v: f32, a: f32, b: f32) -> f32 {
    v.clamp(a.min(b), a.max(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(source: &[f32], offset: f64, step: f64, cells: u32, beyond: Option<f32>) -> Vec<f32> {
        let along = GridAxis { source: source.len(), offset, step };
        let across = GridAxis { source: 1, offset: 0.0, step: 1.0 };
        let row = resample(source, [along, across], [0, 0], [cells, 1], beyond, &|| Ok(())).unwrap();
        let column = resample(source, [across, along], [0, 0], [1, cells], beyond, &|| Ok(())).unwrap();
        assert_eq!(row, column, "both axes are alike");
        row
    }

    #[test]
    fn coinciding_cells_are_copied() {
        let source = [0.1, -7.3, 1e-20, 5e7, 3.3];
        assert_eq!(line(&source, 0.0, 1.0, 5, None), source);
        assert_eq!(line(&source, 2.0, 1.0, 2, None), source[2..4]);
        assert_eq!(line(&source, -1.0, 1.0, 3, Some(9.0)), [9.0, 0.1, -7.3]);
        let snapped = GridAxis { source: 5, offset: 1.5, step: 1.0 + 1e-12 }.snapped();
        assert_eq!((snapped.offset, snapped.step), (1.0, 1.0));
    }

    #[test]
    fn larger_cells_take_the_mean_of_what_they_cover() {
        let source = [1.0, 3.0, 5.0, 11.0];
        assert_eq!(line(&source, 0.0, 2.0, 2, None), [2.0, 8.0]);
        // 1.5 cells each: (1 + 0.5 * 3) / 1.5 and (0.5 * 3 + 5) / 1.5; the tolerance is the rounding of f32
        let out = line(&source, 0.0, 1.5, 2, None);
        assert!((out[0] - 5.0 / 3.0).abs() < 1e-6 && (out[1] - 13.0 / 3.0).abs() < 1e-6, "{out:?}");
        // half outside: only the inner part counts
        assert_eq!(line(&source, -1.0, 2.0, 1, None), [1.0]);
        assert_eq!(line(&source, -4.0, 2.0, 1, None), [1.0]);
        assert_eq!(line(&source, -4.0, 2.0, 1, Some(7.0)), [7.0]);
    }

    #[test]
    fn smaller_cells_are_interpolated_without_overshoot() {
        let ramp: Vec<f32> = (0..8).map(|v| v as f32).collect();
        let fine = line(&ramp, 0.0, 0.25, 32, None);
        for (at, v) in fine.iter().enumerate().skip(6).take(20) {
            // the cubic reproduces straight lines; the tolerance is the rounding of f32
            let expected = (at as f32 + 0.5) * 0.25 - 0.5;
            assert!((v - expected).abs() < 1e-6, "{at}: {v} instead of {expected}");
        }
        let step = line(&[0.0, 0.0, 0.0, 10.0, 10.0, 10.0], 0.0, 0.125, 48, None);
        assert!(step.windows(2).all(|w| w[0] <= w[1]) && step[0] == 0.0 && step[47] == 10.0, "{step:?}");
    }

    /// In blocks of any number of rows, for means, copies and interpolation, partly beyond the raster.
    #[test]
    fn rows_that_come_in_blocks_give_the_same_bits() {
        let (columns, rows) = (31, 97);
        let source: Vec<f32> = (0..columns * rows).map(|v| ((v * 7919) % 1009) as f32 * 0.37).collect();
        for (step, offset) in [(0.13, -2.0), (0.5, 0.25), (0.5, 0.0), (1.0, 3.0), (1.0, 0.4), (2.6, -9.0), (40.0, -1.0)]
        {
            let axes = [columns, rows].map(|source| GridAxis { source, offset, step });
            let cells = [9, (110.0 / step) as u32];
            for beyond in [None, Some(-1.0)] {
                let whole = resample(&source, axes, [1, 0], cells, beyond, &|| Ok(())).unwrap();
                for block in [1, 2, 5, 96] {
                    let mut resampler = Resampler::new(axes, [1, 0], cells, beyond).unwrap();
                    for (k, part) in source.chunks(block * columns).enumerate() {
                        resampler.take(k * block, part, &|| Ok(())).unwrap();
                    }
                    assert_eq!(resampler.into_samples(), whole, "{step} {offset} {block}");
                }
            }
        }
    }

    #[test]
    fn a_part_equals_the_same_part_of_the_whole() {
        let source: Vec<f32> = (0..20 * 15).map(|v| ((v * 7919) % 101) as f32).collect();
        for step in [0.37, 1.0, 2.3] {
            let axes = [GridAxis { source: 20, offset: -1.3, step }, GridAxis { source: 15, offset: 0.7, step }];
            let whole = resample(&source, axes, [0, 0], [24, 18], Some(-1.0), &|| Ok(())).unwrap();
            let part = resample(&source, axes, [5, 3], [9, 8], Some(-1.0), &|| Ok(())).unwrap();
            for j in 0..8 {
                assert_eq!(part[j * 9..(j + 1) * 9], whole[(j + 3) * 24 + 5..(j + 3) * 24 + 14]);
            }
        }
    }
}
