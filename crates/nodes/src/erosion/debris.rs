//! Debris on rock: only what is loose moves.
//!
//! Rock steeper than its own angle crumbles where it stands, and what is loose slides as in [`super::repose`]: down the
//! excess of the rise over repose, at the corners between four cells and over the faces between two. Here each of these
//! flows has a donor, and the flows out of a cell are cut in proportion where together they would take more than lies
//! there (as outflows of water are in the virtual pipes of X. Mei, P. Decaudin and B. Hu, 2007). What leaves one cell
//! enters another, so that loose material is conserved to rounding.

use orograph_graph::{Job, NodeError};
use rayon::prelude::*;

/// Loose material on rock. Rasters have a ring of one cell around them, closed or wrapped.
pub struct Debris {
    cells: [usize; 2],
    wraps: [bool; 2],
    rock: Vec<f32>,
    loose: Vec<f32>,
    /// Rise at repose between neighbours, in metres; infinite where closed.
    rise: Vec<f32>,
}

/// What flows over the faces and the corner to the south-east of each cell in a sweep, in metres.
#[derive(Clone, Copy, Default)]
struct Flows {
    /// From the cell to the east.
    east: f32,
    /// From the cell to the south.
    south: f32,
    /// From the cell to the south-east.
    falling: f32,
    /// From the cell to the east to that to the south.
    rising: f32,
}

/// Thinnest layer that counts as able to move, as a share of the rise at repose.
const FILM: f32 = 1e-4;

impl Debris {
    /// `cells` columns and rows of rock and of what lies on it, in metres, with rises at repose between neighbours (m,
    /// infinite where nothing may move and the rock means nothing), row-major.
    pub fn new([nx, ny]: [usize; 2], rock: &[f32], loose: &[f32], rise: &[f32], wraps: [bool; 2]) -> Self {
        let ringed = |from: &[f32], ring: f32| {
            let mut to = vec![ring; (nx + 2) * (ny + 2)];
            for (row, from) in to[nx + 2..].chunks_exact_mut(nx + 2).zip(from.chunks_exact(nx)) {
                row[1..=nx].copy_from_slice(from);
            }
            to
        };
        let mut debris = Self {
            cells: [nx, ny],
            wraps,
            rock: ringed(rock, 0.0),
            loose: ringed(loose, 0.0),
            rise: ringed(rise, f32::INFINITY),
        };
        for ((rock, loose), rise) in debris.rock.iter_mut().zip(&mut debris.loose).zip(&debris.rise) {
            if rise.is_infinite() && !(rock.is_finite() && loose.is_finite()) {
                (*rock, *loose) = (0.0, 0.0);
            }
        }
        debris.wrap();
        debris
    }

    fn wrap(&mut self) {
        let [nx, ny] = self.cells;
        for raster in [&mut self.rock, &mut self.loose, &mut self.rise] {
            super::repose::wrap(raster, nx, ny, self.wraps);
        }
    }

    /// Lowers rock until no cell stands above any of its eight neighbours by more than `rise`, its own rise at the rock's
    /// angle (m, infinite where it holds), and lays `bulking` times what was taken on it.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn crumble(&mut self, rise: &[f32], bulking: f32, job: &Job<'_>) -> Result<(), NodeError> {
        let [nx, ny] = self.cells;
        let stride = nx + 2;
        // what is closed to the slide holds nothing up and takes nothing down
        let closed = |at: usize| self.rise[at].is_infinite();
        let mut from: Vec<f32> =
            (0..self.rock.len()).map(|at| if closed(at) { f32::INFINITY } else { self.rock[at] }).collect();
        let mut to = from.clone();
        loop {
            let lowered = to[stride..stride * (ny + 1)]
                .par_chunks_mut(stride)
                .enumerate()
                .map(|(j, row)| {
                    job.check()?;
                    let mut lowered = false;
                    for i in 0..nx {
                        let at = (j + 1) * stride + i + 1;
                        let beside = from[at - 1].min(from[at + 1]).min(from[at - stride]).min(from[at + stride]);
                        let across = from[at - stride - 1]
                            .min(from[at - stride + 1])
                            .min(from[at + stride - 1])
                            .min(from[at + stride + 1]);
                        let rise = rise[j * nx + i];
                        let most = (beside + rise).min(across + std::f32::consts::SQRT_2 * rise);
                        row[i + 1] = from[at].min(most);
                        lowered |= most < from[at] && from[at] < f32::INFINITY;
                    }
                    Ok::<_, NodeError>(lowered)
                })
                .try_reduce(|| false, |a, b| Ok(a | b))?;
            std::mem::swap(&mut from, &mut to);
            super::repose::wrap(&mut from, nx, ny, self.wraps);
            if !lowered {
                break;
            }
        }
        for ((rock, loose), left) in self.rock.iter_mut().zip(&mut self.loose).zip(&from) {
            if left < rock {
                *loose += bulking * (*rock - left);
                *rock = *left;
            }
        }
        self.wrap();
        Ok(())
    }

    /// Sweeps that many times with a given step, at most [`super::repose::STEP`], or until nothing loose exceeds repose
    /// by more than `tolerance`, as a share of it: whether it came to rest.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn slide(&mut self, sweeps: u64, step: f32, tolerance: f32, job: &Job<'_>) -> Result<bool, NodeError> {
        let len = self.rock.len();
        let (mut surface, mut lean, mut flows) = (vec![0.0; len], vec![[0.0; 2]; len], vec![Flows::default(); len]);
        let mut share = vec![0.0; len];
        for sweep in 0..sweeps {
            surface.par_iter_mut().enumerate().for_each(|(at, surface)| *surface = self.rock[at] + self.loose[at]);
            self.corners(&surface, step, &mut lean, &mut flows);
            self.faces(&surface, step, &lean, &mut flows);
            job.check()?;
            if !self.limit(&flows, step * tolerance, &mut share) {
                return Ok(true);
            }
            self.pass_on(&flows, &share);
            job.advance(sweep as f32 / sweeps as f32)?;
        }
        Ok(false)
    }

    /// The rise of the plane at each corner, and what flows across it.
    fn corners(&self, surface: &[f32], step: f32, lean: &mut [[f32; 2]], flows: &mut [Flows]) {
        let [nx, ny] = self.cells;
        let stride = nx + 2;
        let rows = lean.par_chunks_mut(stride).zip(flows.par_chunks_mut(stride)).take(ny + 1).enumerate();
        rows.for_each(|(j, (lean, flows))| {
            let [h, hs, r, rs] = self.pairs(surface, j);
            for i in 0..=nx {
                let repose = 0.25 * ((r[i] + r[i + 1]) + (rs[i] + rs[i + 1]));
                let open = repose < f32::INFINITY;
                let x = 0.5 * ((h[i + 1] - h[i]) + (hs[i + 1] - hs[i]));
                let y = 0.5 * ((hs[i] - h[i]) + (hs[i + 1] - h[i + 1]));
                lean[i] = if open { [x, y] } else { [0.0; 2] };
                let half = 0.5 * step * excess(lean[i], repose);
                flows[i].falling = half * (lean[i][0] + lean[i][1]);
                flows[i].rising = half * (lean[i][0] - lean[i][1]);
            }
        });
    }

    /// What flows over the faces, down the rise over each with that of the corners along it.
    fn faces(&self, surface: &[f32], step: f32, lean: &[[f32; 2]], flows: &mut [Flows]) {
        let [nx, ny] = self.cells;
        let stride = nx + 2;
        flows.par_chunks_mut(stride).take(ny + 1).enumerate().for_each(|(j, flows)| {
            let [h, hs, r, rs] = self.pairs(surface, j);
            let own = &lean[j * stride..][..stride];
            let north = if j > 0 { &lean[(j - 1) * stride..][..stride] } else { own };
            for i in 0..=nx {
                let west = own[i.saturating_sub(1)];
                let (east, south) = (h[i + 1] - h[i], hs[i] - h[i]);
                let along = [0.5 * (west[0] + own[i][0]), 0.5 * (north[i][1] + own[i][1])];
                flows[i].east = step * excess([east, along[1]], 0.5 * (r[i] + r[i + 1])) * east;
                flows[i].south = step * excess([along[0], south], 0.5 * (r[i] + rs[i])) * south;
            }
        });
    }

    /// A row of the surface and the next, a row of rises and the next.
    fn pairs<'a>(&'a self, surface: &'a [f32], j: usize) -> [&'a [f32]; 4] {
        let stride = self.cells[0] + 2;
        let row = |of: &'a [f32], j: usize| &of[j * stride..][..stride];
        [row(surface, j), row(surface, j + 1), row(&self.rise, j), row(&self.rise, j + 1)]
    }

    /// The share of the flows out of each cell that its layer allows; whether any layer that is more than a film flows
    /// faster than `slow`, as a share of the rise at repose.
    fn limit(&self, flows: &[Flows], slow: f32, share: &mut [f32]) -> bool {
        let [nx, ny] = self.cells;
        let stride = nx + 2;
        let interior = share[stride..stride * (ny + 1)].par_chunks_mut(stride).enumerate();
        let moving = interior
            .map(|(j, share)| {
                let mut moving = false;
                for (i, share) in share[1..=nx].iter_mut().enumerate() {
                    let at = (j + 1) * stride + i + 1;
                    let gains = gains(flows, at, stride);
                    let (loss, most) = gains.iter().fold((0.0, 0.0_f32), |(sum, most), gain| {
                        let loss = (-gain).max(0.0);
                        (sum + loss, most.max(loss))
                    });
                    *share = if loss > self.loose[at] { self.loose[at] / loss } else { 1.0 };
                    // closed cells lose nothing
                    moving |= self.loose[at] > FILM * self.rise[at] && most > 0.5 * slow * self.rise[at];
                }
                moving
            })
            .reduce(|| false, |a, b| a | b);
        super::repose::wrap(share, nx, ny, self.wraps);
        moving
    }

    /// Moves what flows.
    fn pass_on(&mut self, flows: &[Flows], share: &[f32]) {
        let [nx, ny] = self.cells;
        let stride = nx + 2;
        self.loose[stride..stride * (ny + 1)].par_chunks_mut(stride).enumerate().for_each(|(j, loose)| {
            for (i, loose) in loose[1..=nx].iter_mut().enumerate() {
                let at = (j + 1) * stride + i + 1;
                let gains = gains(flows, at, stride);
                let donors = around(at, stride);
                let (mut gain, mut loss) = (0.0, 0.0);
                for k in 0..8 {
                    gain += gains[k].max(0.0) * share[donors[k]];
                    loss += (-gains[k]).max(0.0);
                }
                // a loss of more than there is was cut to all there is
                *loose = (*loose - loss.min(*loose)) + gain;
            }
        });
        super::repose::wrap(&mut self.loose, nx, ny, self.wraps);
    }

    /// Rock and what lies on it, row-major.
    #[must_use]
    pub fn layers(&self) -> [Vec<f32>; 2] {
        let [nx, ny] = self.cells;
        [&self.rock, &self.loose]
            .map(|raster| (1..=ny).flat_map(|j| &raster[j * (nx + 2) + 1..][..nx]).copied().collect())
    }
}

/// The eight cells around a cell.
fn around(at: usize, stride: usize) -> [usize; 8] {
    [at + 1, at - 1, at + stride, at - stride, at + stride + 1, at - stride - 1, at - stride + 1, at + stride - 1]
}

/// What a cell gains from each of the cells [`around`] it; below 0 where it loses.
fn gains(flows: &[Flows], at: usize, stride: usize) -> [f32; 8] {
    let (own, west, north) = (flows[at], flows[at - 1], flows[at - stride]);
    let northwest = flows[at - stride - 1];
    [own.east, -west.east, own.south, -north.south, own.falling, -northwest.falling, north.rising, -west.rising]
}

/// The share of a rise that is above repose.
fn excess([x, y]: [f32; 2], repose: f32) -> f32 {
    let steepness = (x * x + y * y).sqrt();
    if steepness > repose { 1.0 - repose / steepness } else { 0.0 }
}
