//! What the laws of erosion read of the ice: thickness, velocity, and where debris goes.

use orograph_graph::memory::{OutOfMemory, zeroed};

use super::{grid::Grid, sheet::Sheet};
use crate::numerics::par;

/// Thickness from which a cell counts as glacier, in metres.
pub(super) const THIN_M: f64 = 1.0;

/// Ice on the ice grid, per cell.
pub(super) struct Ice {
    /// Thickness, in metres.
    pub depth: Vec<f32>,
    /// Mean velocity over the thickness, eastwards and southwards, in m/yr.
    pub velocity: [Vec<f32>; 2],
    /// Speed at the bed, in m/yr.
    pub sliding: Vec<f32>,
}

impl Ice {
    pub fn new(grid: &Grid) -> Result<Self, OutOfMemory> {
        Ok(Self {
            depth: zeroed(grid.len())?,
            velocity: [zeroed(grid.len())?, zeroed(grid.len())?],
            sliding: zeroed(grid.len())?,
        })
    }

    /// Reads a sheet. The velocity is the mean of the fluxes through opposite faces over the thickness of the cells
    /// that give them, at most `fastest` m/yr.
    pub fn read(&mut self, sheet: &Sheet, fastest: f64) {
        let grid = sheet.grid;
        let nx = grid.nx;
        let [east, south] = &mut self.velocity;
        let rows = self
            .depth
            .chunks_mut(nx)
            .zip(self.sliding.chunks_mut(nx))
            .zip(east.chunks_mut(nx).zip(south.chunks_mut(nx)));
        par::all(rows, |j, ((depth, sliding), (east, south))| {
            let row = |dj: isize| grid.row(&sheet.thickness, -1, j as isize + dj, nx + 2);
            let (above, here, below) = (row(-1), row(0), row(1));
            let speed = |flux: f64, before: f64, after: f64| {
                let giver = if flux > 0.0 { before } else { after };
                if giver > THIN_M { flux / giver } else { 0.0 }
            };
            for i in 0..nx {
                let h = here[i + 1];
                let through = j * (nx + 1) + i;
                let x = 0.5 * (speed(sheet.east[through], here[i], h) + speed(sheet.east[through + 1], h, here[i + 2]));
                let lid = j * nx + i;
                let y =
                    0.5 * (speed(sheet.south[lid], above[i + 1], h) + speed(sheet.south[lid + nx], h, below[i + 1]));
                let fast = (x * x + y * y).sqrt();
                let scale = if h <= THIN_M {
                    0.0
                } else if fast > fastest {
                    fastest / fast
                } else {
                    1.0
                };
                let slides =
                    sheet.rheology.sliding / (sheet.rheology.deformation * h + sheet.rheology.sliding).max(1e-30);
                depth[i] = h as f32;
                east[i] = (scale * x) as f32;
                south[i] = (scale * y) as f32;
                sliding[i] = (scale * fast * slides) as f32;
            }
        });
    }
}
