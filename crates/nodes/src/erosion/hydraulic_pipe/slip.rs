//! Slippage: loose ground steeper than its angle of repose slides to its eight neighbours.
//!
//! The limit on the rise between two cells, the flux above it, and its application are steps 6 to 8 of WebGL-Erosion;
//! the excess above the limit moves by fluxes between pairs of cells, so that nothing is lost (Musgrave, Kolb and
//! Mace 1989; Št'ava et al. 2008).

use orograph_graph::{Edge, Job, NodeError};

use super::{
    band::{Band, Scene, State, at},
    flow,
    ring::Ring,
};
use crate::numerics::simd::simd;

/// Fraction of the excess that moves between neighbours in one pass. Eight neighbours, diagonals at half weight, are
/// stable up to 1/12.
const RATE: f32 = 1.0 / 12.0;
/// Rows in use of the slippage pass.
#[derive(Debug)]
pub(super) struct Slip {
    bed: Ring,
    share: Ring,
    /// To the east (or from the west), south, south-east and south-west, m per pass. Those along rows and diagonals are
    /// numbered by the joint between columns.
    flux: [Ring; 4],
}

impl Slip {
    pub fn new(nx: usize) -> Self {
        Self { bed: Ring::new(nx, 2), share: Ring::new(nx, 3), flux: std::array::from_fn(|k| Ring::new(nx, 4 + k)) }
    }
}

/// Fluxes out of and into the cells of a row: to the east, from the west, to the south, from the north, to the
/// south-east and south-west, from the north-west and north-east.
fn around(flux: &[Ring; 4], y: isize, nx: usize) -> [&[f32]; 8] {
    let [east, south, south_east, south_west] = flux;
    [
        &east.whole(y)[1..=nx],
        &east.whole(y)[..nx],
        &south.whole(y)[..nx],
        &south.whole(y - 1)[..nx],
        &south_east.whole(y)[1..=nx],
        &south_west.whole(y)[..nx],
        &south_east.whole(y - 1)[..nx],
        &south_west.whole(y - 1)[1..=nx],
    ]
}

simd! {
    /// Computes the flux from cells `a` to cells `b` in a pass, negative the other way; 0 to or from cells outside
    /// the terrain.
    fn slide(flux: &mut [f32], a: &[f32], b: &[f32], limit_m: f32, rate: f32) {
        let n = flux.len();
        let (a, b) = (&a[..n], &b[..n]);
        for i in 0..n {
            let fall = a[i] - b[i];
            let excess = fall.abs() - limit_m;
            let moved = if excess > 0.0 { rate * excess } else { 0.0 };
            flux[i] = if fall > 0.0 { moved } else { -moved };
        }
    }
}

/// Returns the flux that leaves (`sign` +1) or enters (-1) a cell. In the order of [`around`].
#[inline(always)]
fn sum(flux: &[&[f32]; 8], i: usize, sign: f32) -> f32 {
    let gain = |k: usize, sign: f32| {
        let flux = sign * flux[k][i];
        if flux > 0.0 { flux } else { 0.0 }
    };
    ((gain(0, sign) + gain(1, -sign)) + (gain(2, sign) + gain(3, -sign)))
        + ((gain(4, sign) + gain(5, sign)) + (gain(6, -sign) + gain(7, -sign)))
}

simd! {
    /// Computes the fraction of a cell's outgoing flux that is loose.
    fn shares(share: &mut [f32], flux: [&[f32]; 8], loose: &[f32]) {
        let n = share.len();
        let (flux, loose) = (flux.map(|row| &row[..n]), &loose[..n]);
        for i in 0..n {
            let out = sum(&flux, i, 1.0);
            share[i] = if out > loose[i] { loose[i] / out } else { 1.0 };
        }
    }
}

simd! {
    /// Applies the fluxes.
    fn apply(change: &mut [f32], loose: &mut [f32], flux: [&[f32]; 8]) {
        let n = change.len();
        let (loose, flux) = (&mut loose[..n], flux.map(|row| &row[..n]));
        for i in 0..n {
            let gain = sum(&flux, i, -1.0) - sum(&flux, i, 1.0);
            change[i] += gain;
            let left = loose[i] + gain;
            loose[i] = if left > 0.0 { left } else { 0.0 };
        }
    }
}

impl Band {
    /// One pass of slippage. Nothing slides across the edge of the world, nor to or from sides at base level.
    pub fn slip(&mut self, scene: &Scene<'_>, job: &Job<'_>) -> Result<(), NodeError> {
        let rows = self.rows as isize;
        let nx = self.nx;
        let limit_m = (scene.physics.talus * scene.physics.cell_m) as f32;
        let diagonal_m = limit_m * std::f32::consts::SQRT_2;
        for y in -2..rows + 4 {
            if y % 64 == 0 {
                job.check()?;
            }
            if y < rows + 2 {
                self.slip_bed(scene, y);
                let Slip { bed, flux: [east, south, south_east, south_west], .. } = &mut self.slip;
                let (row, above) = (bed.whole(y), bed.whole(y - 1));
                slide(&mut east.whole_mut(y)[..=nx], row, &row[1..], limit_m, RATE);
                slide(&mut south.whole_mut(y - 1)[..nx], &above[1..], &row[1..], limit_m, RATE);
                slide(&mut south_east.whole_mut(y - 1)[..=nx], above, &row[1..], diagonal_m, 0.5 * RATE);
                slide(&mut south_west.whole_mut(y - 1)[..=nx], &above[1..], row, diagonal_m, 0.5 * RATE);
            }
            if (-1..=rows).contains(&(y - 1)) {
                self.slip_share(scene, y - 1);
            }
            if (0..=rows).contains(&(y - 1)) {
                let share = &self.slip.share;
                let (row, above) = (share.whole(y - 1), share.whole(y - 2));
                let [east, south, south_east, south_west] = &mut self.slip.flux;
                flow::limit(&mut east.whole_mut(y - 1)[..=nx], [row, &row[1..]]);
                flow::limit(&mut south.whole_mut(y - 2)[..nx], [&above[1..], &row[1..]]);
                flow::limit(&mut south_east.whole_mut(y - 2)[..=nx], [above, &row[1..]]);
                flow::limit(&mut south_west.whole_mut(y - 2)[..=nx], [&above[1..], row]);
            }
            if (0..rows).contains(&(y - 2)) {
                let [change, loose, ..] = &mut self.states;
                let row = at(y - 2);
                apply(change.cells_mut(row), loose.cells_mut(row), around(&self.slip.flux, y - 2, nx));
            }
        }
        Ok(())
    }

    /// Computes the bed of a row, with NaN where nothing slides.
    fn slip_bed(&mut self, scene: &Scene<'_>, y: isize) {
        let nx = self.nx;
        let boundary = &scene.boundary;
        let inside = (0..scene.cells[1] as isize).contains(&(self.first as isize + y)) || scene.joined()[1];
        let row = self.world_row(scene, y);
        let held =
            row == 0 && boundary.north == Edge::Base || row + 1 == scene.cells[1] && boundary.south == Edge::Base;
        if !inside || held {
            self.slip.bed.whole_mut(y).fill(f32::NAN);
            return;
        }
        let bed = self.slip.bed.cells_mut(y);
        flow::bed(bed, &scene.land[row * nx..][..nx], self.states[State::Change as usize].cells(at(y)));
        if boundary.west == Edge::Base {
            bed[0] = f32::NAN;
        }
        if boundary.east == Edge::Base {
            bed[nx - 1] = f32::NAN;
        }
        self.slip.bed.close(y, true);
        if !scene.joined()[0] {
            let bed = self.slip.bed.whole_mut(y);
            (bed[0], bed[nx + 1]) = (f32::NAN, f32::NAN);
        }
    }

    fn slip_share(&mut self, scene: &Scene<'_>, y: isize) {
        let nx = self.nx;
        let Slip { share, flux, .. } = &mut self.slip;
        let loose = self.states[State::Loose as usize].cells(at(y));
        shares(share.cells_mut(y), around(flux, y, nx), loose);
        share.close(y, scene.joined()[0]);
    }
}
