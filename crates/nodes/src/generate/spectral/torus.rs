//! Sums of random waves on a torus around the world.
//!
//! A wave is known by how often it goes around the torus, and its draw by a hash of these two whole numbers; so the waves
//! of a coarse raster are among those of a fine one, to the last bit. Waves are summed by Fourier transforms, along the
//! world's rows first and then along its columns, each cut to the world.

use orograph_graph::{Job, NodeError, World, mix};
use rayon::prelude::*;

use crate::{
    fourier::{Batch, Complex, LANES, Plan, turn},
    math,
};

/// The plane in which waves repeat: the world, or whole copies of it side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Torus {
    size_m: [f64; 2],
    /// Copies of the world along x and y.
    copies: [usize; 2],
}

/// How much of it there is of a wave of so many waves a metre east and south: the root of the power spectral density in
/// m² per (1/m)², and so in m².
pub(crate) trait Spectrum: Sync {
    /// The root of the power spectral density.
    fn amplitude(&self, waves_per_m: [f64; 2]) -> f64;
}

impl<F: Fn([f64; 2]) -> f64 + Sync> Spectrum for F {
    fn amplitude(&self, waves_per_m: [f64; 2]) -> f64 {
        self(waves_per_m)
    }
}

/// How waves are drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw {
    /// The seed of the run.
    pub seed: u32,
    /// Whether heights of waves are those of the spectrum exactly, and only their phases random.
    pub even: bool,
}

/// Waves a cell from which on waves fade, and at which they are gone: two cells a wave.
const FADE: [f64; 2] = [0.25, 0.5];

impl Torus {
    /// The world itself, so that its opposite sides fit together.
    pub fn tiled(world: &World) -> Self {
        Self { size_m: world.size, copies: [1, 1] }
    }

    /// A square of twice the longer side of the world, so that opposite sides of the world are strangers. Along the shorter
    /// side twice the longest wave is enough.
    pub fn around(world: &World, longest_m: f64) -> Self {
        let longer = world.size[0].max(world.size[1]);
        let copies = world.size.map(|side_m| {
            let enough = (2.0 * longest_m.min(longer) / side_m).ceil();
            // the ratio is at most that of the longest world there can be
            enough.max(2.0) as usize
        });
        Self { size_m: [world.size[0] * copies[0] as f64, world.size[1] * copies[1] as f64], copies }
    }

    /// The waves of all cells of the world, which must be the job's window; metres, row by row.
    pub fn sum(&self, job: &Job<'_>, draw: Draw, spectrum: &impl Spectrum) -> Result<Vec<f32>, NodeError> {
        let window = job.window();
        let (nx, ny) = (window.nx(), window.ny());
        let cells = [nx * self.copies[0], ny * self.copies[1]];
        let waves = Waves { torus: self, draw, spectrum, cell_m: job.cell_m() };
        // the most times that a wave of two cells goes around
        let most = cells.map(|n| (n - 1) / 2);
        let rows = most[1] + 1;
        let along = Along::new(cells[0]);
        let mut rows_of_waves = vec![[0.0_f32; 2]; rows * nx];
        rows_of_waves.par_chunks_mut(nx * LANES).enumerate().try_for_each_init(
            || along.plan.room(),
            |batch, (chunk, out)| {
                job.check()?;
                batch.fill(Batch::ZERO);
                for (lane, _) in out.chunks_exact(nx).enumerate() {
                    waves.row(chunk * LANES + lane, most[0], |at, [re, im]| {
                        let [cos, sin] = along.shift(at);
                        let at = at.rem_euclid(cells[0] as i64) as usize;
                        batch[at].re[lane] = re * cos - im * sin;
                        batch[at].im[lane] = re * sin + im * cos;
                    });
                }
                along.plan.transform(batch);
                for (lane, row) in out.chunks_exact_mut(nx).enumerate() {
                    for (value, batch) in row.iter_mut().zip(batch.iter()) {
                        *value = [batch.re[lane] as f32, batch.im[lane] as f32];
                    }
                }
                Ok::<_, NodeError>(())
            },
        )?;
        job.advance(0.6)?;
        let down = Along::new(cells[1]);
        let strips = nx.div_ceil(2 * LANES);
        let columns: Vec<Vec<f32>> = (0..strips)
            .into_par_iter()
            .map_init(
                || down.plan.room(),
                |batch, strip| {
                    job.check()?;
                    let first = strip * 2 * LANES;
                    down.columns(batch, &rows_of_waves, nx, first, cells[1]);
                    let width = (nx - first).min(2 * LANES);
                    let mut out = vec![0.0; ny * width];
                    for (row, batch) in out.chunks_exact_mut(width).zip(batch.iter()) {
                        for (i, value) in row.iter_mut().enumerate() {
                            *value = (if i % 2 == 0 { batch.re[i / 2] } else { batch.im[i / 2] }) as f32;
                        }
                    }
                    Ok::<_, NodeError>(out)
                },
            )
            .collect::<Result<_, _>>()?;
        drop(rows_of_waves);
        let mut out = vec![0.0; nx * ny];
        out.par_chunks_mut(nx).enumerate().for_each(|(j, row)| {
            for (cells, strip) in row.chunks_mut(2 * LANES).zip(&columns) {
                cells.copy_from_slice(&strip[j * cells.len()..][..cells.len()]);
            }
        });
        job.advance(1.0)?;
        Ok(out)
    }
}

/// The waves of a torus.
struct Waves<'a, S> {
    torus: &'a Torus,
    draw: Draw,
    spectrum: &'a S,
    cell_m: f64,
}

impl<S: Spectrum> Waves<'_, S> {
    /// Calls `each(east, wave)` for all waves that go so often around southwards and up to `most` times eastwards or
    /// westwards. Of two waves that are each other's mirror image only one is among them, at twice its height.
    fn row(&self, south: usize, most: usize, mut each: impl FnMut(i64, Complex)) {
        let most = most as i64;
        let draws = Draws::of_row(self.draw, south as i64);
        for east in if south == 0 { 1 } else { -most }..=most {
            if let Some(wave) = self.wave(&draws, east, south as i64) {
                each(east, wave);
            }
        }
    }

    /// A wave with its mirror image, if cells can hold it.
    fn wave(&self, draws: &Draws, east: i64, south: i64) -> Option<Complex> {
        let [width_m, height_m] = self.torus.size_m;
        let waves_per_m = [east as f64 / width_m, south as f64 / height_m];
        let waves_per_cell = (waves_per_m[0] * waves_per_m[0] + waves_per_m[1] * waves_per_m[1]).sqrt() * self.cell_m;
        if waves_per_cell >= FADE[1] {
            return None;
        }
        let amplitude = self.spectrum.amplitude(waves_per_m) / (width_m * height_m).sqrt();
        if amplitude == 0.0 {
            return None;
        }
        let kept = math::smoothstep((FADE[1] - waves_per_cell) / (FADE[1] - FADE[0]));
        let height = 2.0 * amplitude * kept;
        Some(draws.of(east).map(|part| height * part))
    }
}

/// Complex numbers of a row of waves, of mean square 1.
struct Draws {
    draw: Draw,
    row: u32,
}

impl Draws {
    fn of_row(draw: Draw, south: i64) -> Self {
        Self { draw, row: mix((south as u32).wrapping_mul(0xd816_3841).wrapping_add(draw.seed)) }
    }

    /// Circular Gaussian, by G. E. P. Box and M. E. Muller (1958); or of modulus 1.
    fn of(&self, east: i64) -> Complex {
        let key = mix((east as u32).wrapping_mul(0x8da6_b343).wrapping_add(self.row));
        let phase = (mix(key ^ 0x9e37_79b9) >> 8) as f32 * (std::f32::consts::TAU / 16_777_216.0);
        let modulus = if self.draw.even {
            1.0
        } else {
            (-math::f32::ln(((f64::from(key >> 8) + 0.5) / 16_777_216.0) as f32)).sqrt()
        };
        [f64::from(modulus * math::f32::cos(phase)), f64::from(modulus * math::f32::sin(phase))]
    }
}

/// Transforms along one axis of the torus.
struct Along {
    plan: Plan,
    /// e^(−πi k / cells): half a cell, from the torus's corner to the centre of its first cell.
    shifts: Vec<Complex>,
}

impl Along {
    fn new(cells: usize) -> Self {
        let shifts = (0..=cells / 2).map(|k| turn(-0.5 * k as f64 / cells as f64)).collect();
        Self { plan: Plan::new(cells), shifts }
    }

    /// What brings a wave that goes around so often to the centre of the first cell.
    fn shift(&self, waves: i64) -> Complex {
        let [cos, sin] = self.shifts[waves.unsigned_abs() as usize];
        if waves < 0 { [cos, -sin] } else { [cos, sin] }
    }

    /// Sums rows of waves to the real values of columns, from `first` on: two columns a lane, as the real and the imaginary
    /// part of one transform.
    fn columns(&self, batch: &mut [Batch], rows: &[[f32; 2]], nx: usize, first: usize, cells: usize) {
        batch.fill(Batch::ZERO);
        let width = (nx - first).min(2 * LANES);
        for (k, row) in rows.chunks_exact(nx).enumerate() {
            let [cos, sin] = self.shift(k as i64);
            let turned = |[re, im]: [f32; 2]| {
                let (re, im) = (f64::from(re), f64::from(im));
                [re * cos - im * sin, re * sin + im * cos]
            };
            for (lane, pair) in row[first..first + width].chunks(2).enumerate() {
                let a = turned(pair[0]);
                let b = pair.get(1).map_or([0.0; 2], |b| turned(*b));
                if k == 0 {
                    (batch[0].re[lane], batch[0].im[lane]) = (a[0], b[0]);
                } else {
                    // half each for the wave and its mirror image
                    let (here, there) = (k, cells - k);
                    batch[here].re[lane] = 0.5 * (a[0] - b[1]);
                    batch[here].im[lane] = 0.5 * (a[1] + b[0]);
                    batch[there].re[lane] = 0.5 * (a[0] + b[1]);
                    batch[there].im[lane] = 0.5 * (b[0] - a[1]);
                }
            }
        }
        self.plan.transform(batch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::world;

    impl Torus {
        /// Heights of all cells of the world, wave by wave.
        pub(crate) fn by_definition(&self, world: &World, draw: Draw, spectrum: &impl Spectrum) -> Vec<f64> {
            let waves = Waves { torus: self, draw, spectrum, cell_m: world.cell_m() };
            let [nx, ny] = world.cells.map(|n| n as usize);
            let mut out = vec![0.0; nx * ny];
            for south in 0..=ny * self.copies[1] / 2 {
                waves.row(south, nx * self.copies[0] / 2, |east, [re, im]| {
                    for (at, value) in out.iter_mut().enumerate() {
                        let [x, y] = [at % nx, at / nx].map(|i| (i as f64 + 0.5) * world.cell_m());
                        let turns = east as f64 * x / self.size_m[0] + south as f64 * y / self.size_m[1];
                        let [cos, sin] = turn(-turns);
                        *value += re * cos - im * sin;
                    }
                });
            }
            out
        }
    }

    fn draws(world: &World, most: usize, draw: Draw) -> Vec<(usize, i64, Complex)> {
        let torus = Torus::around(world, 1e9);
        let spectrum = |[east, south]: [f64; 2]| 1.0 / (east * east + south * south);
        let waves = Waves { torus: &torus, draw, spectrum: &spectrum, cell_m: world.cell_m() };
        let mut all = Vec::new();
        for south in 0..=most {
            waves.row(south, most, |east, wave| all.push((south, east, wave)));
        }
        all
    }

    /// Halving the cells adds waves and leaves those that were there as they were, up to where they fade.
    #[test]
    fn the_waves_of_coarse_cells_are_among_those_of_fine_ones() {
        for even in [false, true] {
            let draw = Draw { seed: 5, even };
            let coarse = draws(&world(64, 64, 10.0), 32, draw);
            let fine = draws(&world(128, 128, 5.0), 32, draw);
            assert_eq!(coarse.len(), 32 + 32 * 65);
            for (coarse, fine) in coarse.iter().zip(&fine) {
                let (south, east, _) = *coarse;
                // four cells a wave
                let fades = south * south + (east * east) as usize > 32 * 32;
                assert_eq!(coarse == fine, !fades, "{coarse:?} {fine:?}");
            }
        }
    }

    #[test]
    fn draws_are_circular_gaussian() {
        let draws: Vec<Complex> = (0..400)
            .flat_map(|south| {
                let row = Draws::of_row(Draw { seed: 1, even: false }, south);
                (-250..250).map(move |east| row.of(east))
            })
            .collect();
        let mean = |of: &dyn Fn(&Complex) -> f64| draws.iter().map(of).sum::<f64>() / draws.len() as f64;
        // four standard errors of 200 000 draws of variance ½ a part
        assert!(mean(&|d| d[0]).abs() < 6.4e-3 && mean(&|d| d[1]).abs() < 6.4e-3);
        assert!((mean(&|d| d[0] * d[0]) - 0.5).abs() < 6.4e-3 && (mean(&|d| d[1] * d[1]) - 0.5).abs() < 6.4e-3);
        assert!(mean(&|d| d[0] * d[1]).abs() < 4.5e-3);
        // of a normal variable of variance ½: E x⁴ = 3/4
        assert!((mean(&|d| d[0] * d[0] * d[0] * d[0]) - 0.75).abs() < 0.03);
    }
}
