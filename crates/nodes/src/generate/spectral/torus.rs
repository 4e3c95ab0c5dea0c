//! Sums of random waves on a torus that contains the world.
//!
//! A wave is identified by its wavenumbers on the torus, and its random draw is a hash of these two integers. The waves
//! of a coarse raster are therefore exactly among those of a fine one. Waves are summed by Fourier transforms, first
//! down the world's columns and then along its rows, each restricted to the world.
//!
//! Sixteen waves are drawn at once and stay adjacent: strips of sixteen columns of waves become strips of rows, which
//! are transformed two per lane. Everything is in single precision, with an error of 1e-7 of the heights.

use orograph_graph::{Job, NodeError, Window, World, mix};

use crate::numerics::{
    fourier::{Batch, LANES, Plan},
    math::lane,
    par,
    simd::simd,
};

/// The plane on which waves repeat: the world, or a whole number of copies of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Torus {
    size_m: [f64; 2],
    /// Copies of the world along x and y.
    copies: [usize; 2],
}

/// Amplitude spectrum: the root of the power spectral density in m² per (1/m)², and so in m².
pub(crate) trait Spectrum: Sync {
    /// Returns the root at wavenumbers `east` and `south`, in waves per metre.
    fn roots(&self, east: &[f32; LANES], south: f32) -> [f32; LANES];

    /// Returns the waves per metre above which the spectrum is 0.
    fn end(&self) -> f64;
}

/// How wave amplitudes are drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draw {
    /// The seed of the run.
    pub seed: u32,
    /// True if amplitudes equal the spectrum and only phases are random.
    pub even: bool,
}

/// Waves per cell at which waves begin to fade, and at which they end: two cells per wave. The fade is linear in their
/// squares.
pub(super) const FADE: [f64; 2] = [0.25, 0.5];

/// Rows that are summed at once: two in each lane.
const ROWS: usize = 2 * LANES;

/// Columns that are written at once.
const WIDE: usize = 8 * LANES;

/// A square block of numbers, row by row.
type Square = [f32; LANES * LANES];

impl Torus {
    /// The world itself, so that its opposite sides match.
    pub fn tiled(world: &World) -> Self {
        Self { size_m: world.size, copies: [1, 1] }
    }

    /// A square of twice the longer side of the world, so that opposite sides of the world are independent. Along the
    /// shorter side twice the longest wave is sufficient.
    pub fn around(world: &World, longest_m: f64) -> Self {
        let longer = world.size[0].max(world.size[1]);
        let copies = world.size.map(|side_m| {
            let enough = (2.0 * longest_m.min(longer) / side_m).ceil();
            // bounded by the ratio of the longest possible world
            enough.max(2.0) as usize
        });
        Self { size_m: [world.size[0] * copies[0] as f64, world.size[1] * copies[1] as f64], copies }
    }

    /// Returns the heights of all cells of the world, which must be the job's window, in metres, row by row.
    pub fn sum(&self, job: &Job<'_>, draw: Draw, spectrum: &impl Spectrum) -> Result<Vec<f32>, NodeError> {
        let (nx, ny) = (job.window().nx(), job.window().ny());
        let waves = self.waves([nx, ny], draw, spectrum);
        let [along, down] = waves.cells.map(Plan::<f32>::new);
        let strips = par::collect_with(
            0..waves.strips(),
            || down.room(),
            |batch, _, strip| {
                job.check()?;
                draw_strip(&waves, strip, batch, down.places());
                down.transform_placed(batch, ny);
                Ok::<_, NodeError>(batch[..ny].to_vec())
            },
        )?;
        job.advance(0.6)?;
        let mut out = vec![0.0; nx * ny];
        par::each_with(
            out.chunks_mut(ROWS * nx),
            || along.room(),
            |batch, chunk, out| {
                job.check()?;
                let rows = chunk * ROWS..ny.min((chunk + 1) * ROWS);
                // no waves shorter than two cells or than the spectrum's shortest
                let waves = along.places().len();
                let none = (strips.len() * LANES).min(waves.div_ceil(2));
                for &place in &along.places()[none..=waves - none] {
                    batch[place as usize] = Batch::ZERO;
                }
                for (strip, waves) in strips.iter().enumerate() {
                    beside(batch, along.places(), &waves[rows.clone()], strip * LANES);
                }
                along.transform_placed(batch, nx);
                apart(out, &batch[..nx]);
                Ok::<_, NodeError>(())
            },
        )?;
        job.advance(1.0)?;
        Ok(out)
    }

    /// Returns the bytes that [`Self::sum`] needs in addition to its result.
    pub fn bytes(&self, window: &Window, spectrum: &impl Spectrum) -> u64 {
        let waves = self.waves([window.nx(), window.ny()], Draw { seed: 0, even: false }, spectrum);
        (waves.strips() * window.ny() * size_of::<Batch<f32>>()) as u64
    }

    /// Returns the waves for a world of that many cells.
    pub(super) fn waves<'a, S: Spectrum>(&self, cells: [usize; 2], draw: Draw, spectrum: &'a S) -> Waves<'a, S> {
        let [width_m, height_m] = self.size_m;
        Waves {
            cells: [cells[0] * self.copies[0], cells[1] * self.copies[1]],
            per_m: [1.0 / width_m, 1.0 / height_m],
            scale: (1.0 / (width_m * height_m).sqrt()) as f32,
            draw,
            spectrum,
        }
    }
}

/// The waves of a torus.
pub(super) struct Waves<'a, S> {
    /// Cells along the sides of the torus.
    pub(super) cells: [usize; 2],
    /// Waves per metre at wavenumber 1.
    pub(super) per_m: [f64; 2],
    /// 1 / root of the torus's area.
    pub(super) scale: f32,
    draw: Draw,
    spectrum: &'a S,
}

impl<S: Spectrum> Waves<'_, S> {
    /// Returns the largest wavenumber along an axis.
    pub(super) fn most(&self, axis: usize) -> usize {
        let by_spectrum = self.spectrum.end() / self.per_m[axis];
        // the smallest wavenumber that two cells per wave cannot represent is half the number of cells
        ((self.cells[axis] - 1) / 2).min(by_spectrum as usize)
    }

    /// Returns the number of strips of sixteen eastward wavenumbers, starting at 0.
    fn strips(&self) -> usize {
        self.most(0) / LANES + 1
    }

    /// Returns the largest southward or northward wavenumber of a strip.
    fn most_south(&self, strip: usize) -> usize {
        let share = (strip * LANES) as f64 / self.cells[0] as f64;
        let longest = self.cells[1] as f64 * (FADE[1] * FADE[1] - share * share).max(0.0).sqrt();
        self.most(1).min(longest as usize)
    }
}

simd! {
    /// Draws the waves of a strip, each at the position that a transform down the columns expects. Of two waves that
    /// are mirror images only one is included, with half the amplitude of both.
    fn draw_strip<S: Spectrum>(waves: &Waves<'_, S>, strip: usize, batch: &mut [Batch<f32>], places: &[u32]) {
        let most = waves.most_south(strip) as i64;
        let fade = waves.cells.map(|cells| (1.0 / cells as f64) as f32);
        let (mut east_per_m, mut across) = ([0.0; LANES], [0.0; LANES]);
        let (mut keys, mut turns) = ([0_u32; LANES], [0_u32; LANES]);
        for lane in 0..LANES {
            let east = strip * LANES + lane;
            east_per_m[lane] = (east as f64 * waves.per_m[0]) as f32;
            across[lane] = east as f32 * fade[0];
            keys[lane] = (east as u32).wrapping_mul(0x8da6_b343);
            turns[lane] = to_first_cell(east as i64, waves.cells[0]);
        }
        let cells = waves.cells[1] as i64;
        for south in most + 1..cells - most {
            batch[places[south as usize] as usize] = Batch::ZERO;
        }
        for south in -most..=most {
            let roots = waves.spectrum.roots(&east_per_m, (south as f64 * waves.per_m[1]) as f32);
            let row = mix((south as u32).wrapping_mul(0xd816_3841).wrapping_add(waves.draw.seed));
            let turn = to_first_cell(south, waves.cells[1]);
            let down = south as f32 * fade[1];
            let mut drawn = Batch::ZERO;
            for lane in 0..LANES {
                let below = (FADE[1] * FADE[1]) as f32 - (across[lane] * across[lane] + down * down);
                let kept = lane::smoothstep(below * (1.0 / (FADE[1] * FADE[1] - FADE[0] * FADE[0])) as f32);
                let height = waves.scale * roots[lane] * kept;
                let [re, im] = of_key(mix(keys[lane].wrapping_add(row)), turns[lane].wrapping_add(turn), waves.draw.even);
                drawn.re[lane] = height * re;
                drawn.im[lane] = height * im;
            }
            if strip == 0 && south <= 0 {
                (drawn.re[0], drawn.im[0]) = (0.0, 0.0);
            }
            batch[places[south.rem_euclid(cells) as usize] as usize] = drawn;
        }
    }
}

/// Returns the phase, in 2³²nds of a turn, by which a wave of wavenumber `around` advances from the torus's corner to
/// the centre of the first cell.
pub(super) fn to_first_cell(around: i64, cells: usize) -> u32 {
    (around as f64 * (-2_147_483_648.0 / cells as f64)) as i64 as u32
}

/// Returns a complex number of mean square 1, rotated by an angle in 2³²nds of a turn: circular Gaussian, by G. E. P.
/// Box and M. E. Muller (1958), or of modulus 1.
#[inline(always)]
fn of_key(key: u32, turned: u32, even: bool) -> [f32; 2] {
    let [cos, sin] = lane::turn(mix(key ^ 0x9e37_79b9).wrapping_add(turned));
    let share = ((key >> 8) as i32 as f32 + 0.5) * (1.0 / 16_777_216.0);
    let square = -std::f32::consts::LN_2 * lane::log2(share);
    let modulus = if even { 1.0 } else { square * lane::inverse_root(square) };
    [modulus * cos, modulus * sin]
}

simd! {
    /// Interleaves rows of a strip of waves, each wave at the position that a transform along the rows expects: the
    /// first sixteen rows become the real part of the result, the others the imaginary part.
    fn beside(batch: &mut [Batch<f32>], places: &[u32], strip: &[Batch<f32>], first: usize) {
        let [mut re, mut im, mut mirrored_re, mut mirrored_im] = [[0.0; LANES * LANES]; 4];
        for (row, a) in strip.iter().take(LANES).enumerate() {
            let b = strip.get(row + LANES).unwrap_or(&Batch::ZERO);
            let at = row * LANES;
            for k in 0..LANES {
                re[at + k] = a.re[k] - b.im[k];
                im[at + k] = a.im[k] + b.re[k];
                mirrored_re[at + k] = a.re[k] + b.im[k];
                mirrored_im[at + k] = b.re[k] - a.im[k];
            }
        }
        for square in [&mut re, &mut im, &mut mirrored_re, &mut mirrored_im] {
            transpose(square);
        }
        for k in 0..LANES {
            let (here, there) = (first + k, places.len().saturating_sub(first + k));
            let (mut value, mut mirrored) = (Batch::ZERO, Batch::ZERO);
            for lane in 0..LANES {
                value.re[lane] = re[k * LANES + lane];
                value.im[lane] = im[k * LANES + lane];
                mirrored.re[lane] = mirrored_re[k * LANES + lane];
                mirrored.im[lane] = mirrored_im[k * LANES + lane];
            }
            if here == 0 {
                let both = &mut batch[places[0] as usize];
                for lane in 0..LANES {
                    both.re[lane] = value.re[lane] + mirrored.re[lane];
                    both.im[lane] = value.im[lane] + mirrored.im[lane];
                }
            } else if here < there {
                batch[places[here] as usize] = value;
                batch[places[there] as usize] = mirrored;
            }
        }
    }
}

simd! {
    /// Writes sums as consecutive rows: the inverse of [`beside`].
    fn apart(out: &mut [f32], batch: &[Batch<f32>]) {
        let nx = batch.len();
        // a few columns of all rows at a time, because whole rows evict each other from the cache
        let mut rows = [[0.0; WIDE]; ROWS];
        for (k, sums) in batch.chunks(WIDE).enumerate() {
            for (block, sums) in sums.chunks(LANES).enumerate() {
                let [mut re, mut im] = [[0.0; LANES * LANES]; 2];
                for (k, sum) in sums.iter().enumerate() {
                    re[k * LANES..][..LANES].copy_from_slice(&sum.re);
                    im[k * LANES..][..LANES].copy_from_slice(&sum.im);
                }
                transpose(&mut re);
                transpose(&mut im);
                for (row, values) in rows.iter_mut().zip(re.chunks_exact(LANES).chain(im.chunks_exact(LANES))) {
                    row[block * LANES..][..LANES].copy_from_slice(values);
                }
            }
            for (out, row) in out.chunks_exact_mut(nx).zip(&rows) {
                out[k * WIDE..][..sums.len()].copy_from_slice(&row[..sums.len()]);
            }
        }
    }
}

/// Transposes the square: interleaves its first half with the second, four times.
#[inline(always)]
fn transpose(square: &mut Square) {
    let mut other = [0.0; LANES * LANES];
    for _ in 0..2 {
        interleave(square, &mut other);
        interleave(&other, square);
    }
}

#[inline(always)]
fn interleave(from: &Square, to: &mut Square) {
    for k in 0..LANES * LANES / 2 {
        to[2 * k] = from[k];
        to[2 * k + 1] = from[k + LANES * LANES / 2];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{numerics::fourier::turn, testing::world};

    impl<S: Spectrum> Waves<'_, S> {
        /// Returns the wavenumbers of each wave to the east and south, and its complex amplitude at the first cell,
        /// half of its height.
        fn all(&self) -> Vec<([i64; 2], [f32; 2])> {
            let cells = self.cells[1];
            let places: Vec<u32> = (0..cells as u32).collect();
            let mut batch = vec![Batch::ZERO; cells];
            let mut all = Vec::new();
            for strip in 0..self.strips() {
                draw_strip(self, strip, &mut batch, &places);
                for (at, drawn) in batch.iter().enumerate() {
                    let south = if 2 * at > cells { at as i64 - cells as i64 } else { at as i64 };
                    let lanes = drawn.re.iter().zip(&drawn.im).enumerate();
                    let waves = lanes.map(|(lane, (&re, &im))| ([(strip * LANES + lane) as i64, south], [re, im]));
                    all.extend(waves.filter(|(_, wave)| *wave != [0.0, 0.0]));
                }
            }
            all
        }
    }

    impl Torus {
        /// Returns the heights of all cells of the world, summed wave by wave.
        pub(crate) fn by_definition(&self, world: &World, draw: Draw, spectrum: &impl Spectrum) -> Vec<f64> {
            let [nx, ny] = world.cells.map(|n| n as usize);
            let waves = self.waves([nx, ny], draw, spectrum);
            let mut out = vec![0.0; nx * ny];
            for ([east, south], wave) in waves.all() {
                let [re, im] = wave.map(f64::from);
                for (at, value) in out.iter_mut().enumerate() {
                    let [i, j] = [at % nx, at / nx].map(|at| at as f64);
                    let [cos, sin] =
                        turn(-(east as f64 * i / waves.cells[0] as f64 + south as f64 * j / waves.cells[1] as f64));
                    *value += 2.0 * (re * cos - im * sin);
                }
            }
            out
        }
    }

    /// A white spectrum with a cutoff.
    struct White(f64);

    impl Spectrum for White {
        #[inline(always)]
        fn roots(&self, _: &[f32; LANES], _: f32) -> [f32; LANES] {
            [1e5; LANES]
        }

        fn end(&self) -> f64 {
            self.0
        }
    }

    /// Halving the cell size adds waves and leaves existing ones unchanged up to the fade, except for the phase at the
    /// first cell.
    #[test]
    fn the_waves_of_coarse_cells_are_among_those_of_fine_ones() {
        for even in [false, true] {
            let draws = |cells: u32| {
                let world = world(cells, cells, 640.0 / f64::from(cells));
                let torus = Torus::around(&world, 1e9);
                let waves = torus.waves([cells as usize; 2], Draw { seed: 5, even }, &White(1e9));
                let turned = waves.all().into_iter().map(|([east, south], [re, im])| {
                    let [cos, sin] = turn(0.5 * (east + south) as f64 / waves.cells[0] as f64);
                    let (re, im) = (f64::from(re), f64::from(im));
                    ([east, south], [re * cos - im * sin, re * sin + im * cos])
                });
                turned.collect::<std::collections::BTreeMap<_, _>>()
            };
            let (coarse, fine) = (draws(64), draws(128));
            let mut kept = 0;
            for (around @ [east, south], wave) in &coarse {
                // four cells per wave
                if east * east + south * south <= 32 * 32 {
                    let same = fine[around];
                    let apart = (wave[0] - same[0]).abs() + (wave[1] - same[1]).abs();
                    // single precision of about a hundred metres
                    assert!(apart < 1e-4, "{around:?}: {wave:?} {same:?}");
                    kept += 1;
                }
            }
            // half of the integer points in a disc
            assert!((f64::from(kept) - 0.5 * std::f64::consts::PI * 1024.0).abs() < 20.0, "{kept}");
        }
    }

    #[test]
    fn draws_are_circular_gaussian() {
        let draws: Vec<[f64; 2]> =
            (0..200_000_u32).map(|key| of_key(mix(key), key.wrapping_mul(77_777), false).map(f64::from)).collect();
        let mean = |of: &dyn Fn(&[f64; 2]) -> f64| draws.iter().map(of).sum::<f64>() / draws.len() as f64;
        // four standard errors of 200 000 draws with a variance of ½ per component
        assert!(mean(&|d| d[0]).abs() < 6.4e-3 && mean(&|d| d[1]).abs() < 6.4e-3);
        assert!((mean(&|d| d[0] * d[0]) - 0.5).abs() < 6.4e-3 && (mean(&|d| d[1] * d[1]) - 0.5).abs() < 6.4e-3);
        assert!(mean(&|d| d[0] * d[1]).abs() < 4.5e-3);
        // a normal variable of variance ½: E x⁴ = 3/4
        assert!((mean(&|d| d[0] * d[0] * d[0] * d[0]) - 0.75).abs() < 0.03);
        let [re, im] = of_key(7, 9, true).map(f64::from);
        assert!((re * re + im * im - 1.0).abs() < 1e-6);
    }

    /// Waves that end before two cells per wave leave the rest of a transform zero, whatever it contained before.
    #[test]
    fn a_spectrum_that_ends_early_is_the_sum_of_its_waves() {
        for (nx, ny) in [(64, 40), (40, 75)] {
            let world = world(nx, ny, 10.0);
            for torus in [Torus::tiled(&world), Torus::around(&world, 200.0)] {
                let spectrum = White(0.02);
                let draw = Draw { seed: 3, even: false };
                let job_params = orograph_graph::ParamValues::defaults(&[]);
                let job = Job {
                    node: &orograph_graph::Node::DEFAULT,
                    params: &job_params,
                    inputs: Vec::new(),
                    window: orograph_graph::Window::whole(world),
                    wanted: orograph_graph::Wanted::ALL,
                    folder: std::path::PathBuf::new(),
                    cancel: orograph_graph::Cancel::default(),
                    progress: &|_| (),
                    warnings: orograph_graph::Warnings::default(),
                    level: orograph_graph::LevelJob::default(),
                    glimpses: None,
                };
                let found = torus.sum(&job, draw, &spectrum).expect("a result");
                let expected = torus.by_definition(&world, draw, &spectrum);
                let largest = expected.iter().fold(0.0_f64, |most, height| most.max(height.abs()));
                for (found, expected) in found.iter().zip(&expected) {
                    assert!((f64::from(*found) - expected).abs() < 1e-6 * largest, "{nx} x {ny}: {found} {expected}");
                }
            }
        }
    }
}
