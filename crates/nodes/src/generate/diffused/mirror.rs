//! Filters a raster that is mirrored at its sides, in its cosine transform.
//!
//! A symmetric kernel on a raster mirrored half a cell beyond its last cells multiplies each wave `cos(π p (i + ½) / w)
//! cos(π q (j + ½) / h)` by a number, so the cost does not depend on the number of passes. The cosine transform is that
//! of J. Makhoul (1980), "A fast cosine transform in one and two dimensions", with two rows in one complex row.

use orograph_graph::{Job, NodeError};

use crate::numerics::{
    fourier::{Batch, Complex, LANES, Plan, turn},
    par,
};

/// Rows of a block that is transposed at once.
const BLOCK: usize = 16;

/// Multiplies the waves of a raster with `width` cells per row by `response(x, y)`, where x and y are the cosines of
/// a wave's phase step from cell to cell.
pub(super) fn filter(
    job: &Job<'_>,
    values: Vec<f64>,
    width: usize,
    response: impl Fn(f64, f64) -> f64 + Sync,
) -> Result<Vec<f64>, NodeError> {
    let height = values.len() / width;
    let (along, down) = (Cosines::new(width), Cosines::new(height));
    let (xs, ys) = (turns(width), turns(height));
    let mut waves = values;
    along.rows(job, &mut waves, |_, batch| along.to_waves(batch))?;
    job.advance(0.3)?;
    let mut columns = transposed(&waves, width);
    drop(waves);
    down.rows(job, &mut columns, |first, batch| {
        down.to_waves(batch);
        for (batch, &y) in batch.iter_mut().zip(&ys) {
            for (lane, xs) in xs[first..].chunks(2).take(LANES).enumerate() {
                batch.re[lane] *= response(xs[0], y);
                batch.im[lane] *= xs.get(1).map_or(0.0, |&x| response(x, y));
            }
        }
        down.to_values(batch);
    })?;
    job.advance(0.7)?;
    let mut values = transposed(&columns, height);
    drop(columns);
    along.rows(job, &mut values, |_, batch| along.to_values(batch))?;
    Ok(values)
}

/// Returns the mean square of a response over all waves: the fraction of white noise's variance that the filter
/// keeps.
pub(super) fn variance(
    job: &Job<'_>,
    [width, height]: [usize; 2],
    response: impl Fn(f64, f64) -> f64 + Sync,
) -> Result<f64, NodeError> {
    let (xs, ys) = (turns(width), turns(height));
    let rows = par::collect(ys, |_, y| {
        job.check()?;
        let squares = xs.iter().map(|&x| {
            let kept = response(x, y);
            kept * kept
        });
        Ok::<_, NodeError>(squares.sum::<f64>())
    })?;
    Ok(rows.iter().sum::<f64>() / (width as f64 * height as f64))
}

/// Returns the cosines of the phase steps from cell to cell, for all waves along `cells` cells.
fn turns(cells: usize) -> Vec<f64> {
    (0..cells).map(|p| turn(0.5 * p as f64 / cells as f64)[0]).collect()
}

/// Transposes a raster.
fn transposed(from: &[f64], width: usize) -> Vec<f64> {
    let height = from.len() / width;
    let mut to = vec![0.0; from.len()];
    par::all(to.chunks_mut(height * BLOCK), |block, rows| {
        for (j, from) in from.chunks_exact(width).enumerate() {
            for (i, row) in rows.chunks_exact_mut(height).enumerate() {
                row[j] = from[block * BLOCK + i];
            }
        }
    });
    to
}

/// Cosine transform of rows of one length.
struct Cosines {
    length: usize,
    plan: Plan<f64>,
    /// e^(−πi k / 2 length).
    quarters: Vec<Complex>,
}

impl Cosines {
    fn new(length: usize) -> Self {
        let quarters = (0..length).map(|k| turn(-0.25 * k as f64 / length as f64)).collect();
        Self { length, plan: Plan::new(length), quarters }
    }

    /// Returns the position of a cell in the transformed row: even cells first, then odd ones from the end.
    fn place(&self, cell: usize) -> usize {
        if cell.is_multiple_of(2) { cell / 2 } else { self.length - 1 - cell / 2 }
    }

    /// Calls `each(first, rows)` for each group of rows that is transformed at once, two per lane.
    fn rows(
        &self,
        job: &Job<'_>,
        values: &mut [f64],
        each: impl Fn(usize, &mut [Batch<f64>]) + Sync,
    ) -> Result<(), NodeError> {
        par::each_with(
            values.chunks_mut(self.length * 2 * LANES),
            || self.plan.room(),
            |batch, chunk, rows| {
                job.check()?;
                batch.fill(Batch::ZERO);
                for (at, row) in rows.chunks_exact(self.length).enumerate() {
                    for (cell, value) in row.iter().enumerate() {
                        let part = if at % 2 == 0 { &mut batch[cell].re } else { &mut batch[cell].im };
                        part[at / 2] = *value;
                    }
                }
                each(chunk * 2 * LANES, batch);
                for (at, row) in rows.chunks_exact_mut(self.length).enumerate() {
                    for (batch, value) in batch.iter().zip(row) {
                        *value = if at % 2 == 0 { batch.re[at / 2] } else { batch.im[at / 2] };
                    }
                }
                Ok(())
            },
        )
    }

    /// Transforms cells into `Σ xₙ cos(πk (n + ½) / length)`.
    fn to_waves(&self, batch: &mut [Batch<f64>]) {
        let n = self.length;
        let cells = batch[..n].to_vec();
        for (cell, value) in cells.into_iter().enumerate() {
            batch[self.place(cell)] = value;
        }
        self.plan.transform(batch);
        for k in 0..=n / 2 {
            let m = (n - k) % n;
            let (here, there) = (batch[k], batch[m]);
            let (at_k, at_m) = (self.quarters[k], self.quarters[m]);
            for lane in 0..LANES {
                // the transforms of the two rows, whose values at m are the conjugates of those at k
                let a = [0.5 * (here.re[lane] + there.re[lane]), 0.5 * (here.im[lane] - there.im[lane])];
                let b = [0.5 * (here.im[lane] + there.im[lane]), 0.5 * (there.re[lane] - here.re[lane])];
                batch[m].re[lane] = at_m[0] * a[0] + at_m[1] * a[1];
                batch[m].im[lane] = at_m[0] * b[0] + at_m[1] * b[1];
                batch[k].re[lane] = at_k[0] * a[0] - at_k[1] * a[1];
                batch[k].im[lane] = at_k[0] * b[0] - at_k[1] * b[1];
            }
        }
    }

    /// The inverse of [`Self::to_waves`].
    fn to_values(&self, batch: &mut [Batch<f64>]) {
        let n = self.length;
        for k in 0..=n / 2 {
            let m = (n - k) % n;
            let (here, there) = (batch[k], if k == 0 { Batch::ZERO } else { batch[m] });
            let turned = |[c, s]: Complex, re: f64, im: f64| [re * c - im * s, re * s + im * c];
            for lane in 0..LANES {
                // the conjugate of the transform of both rows
                let at_m = turned(self.quarters[m], there.re[lane] + here.im[lane], here.re[lane] - there.im[lane]);
                let at_k = turned(self.quarters[k], here.re[lane] + there.im[lane], there.re[lane] - here.im[lane]);
                [batch[m].re[lane], batch[m].im[lane]] = at_m;
                [batch[k].re[lane], batch[k].im[lane]] = at_k;
            }
        }
        self.plan.transform(batch);
        let scale = 1.0 / n as f64;
        let placed = batch[..n].to_vec();
        for (cell, batch) in batch[..n].iter_mut().enumerate() {
            let value = placed[self.place(cell)];
            batch.re = value.re.map(|re| re * scale);
            batch.im = value.im.map(|im| -im * scale);
        }
    }
}
