//! The ice grid: cells of a length in metres, with two rows and columns beyond each side.
//!
//! Rasters on it are padded. What lies beyond a side follows from the side's kind:
//!
//! - `wall`: the mirror image, so that nothing flows.
//! - `base`: ground at the level of the border without ice; what flows there has left.
//! - `open` and `inland`: the surface goes on as it fell to the border, where it falls outwards; nothing comes in.
//! - `periodic`: the opposite side.

use orograph_graph::{Edge, NodeError, Window, memory::OutOfMemory, memory::zeroed};

use crate::numerics::coarse::Coarse;

/// Rows and columns beyond each side.
pub(super) const PAD: usize = 2;

/// Cells of the ice grid and its sides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    pub nx: usize,
    pub ny: usize,
    /// Lengths of a cell along x and y.
    pub cell_m: [f64; 2],
    /// West, east, north, south.
    pub edges: [Edge; 4],
}

impl Grid {
    /// The cells of a coarse raster over the world of a window.
    ///
    /// # Errors
    /// When a periodic side faces one that is not.
    pub fn new(window: &Window, coarse: &Coarse) -> Result<Self, NodeError> {
        let boundary = window.world.boundary;
        for (one, other, names) in
            [(boundary.west, boundary.east, "west and east"), (boundary.north, boundary.south, "north and south")]
        {
            if (one == Edge::Periodic) != (other == Edge::Periodic) {
                return Err(NodeError::failed_with_hint(
                    format!("of the sides {names} one is periodic and the other is not"),
                    "make both `periodic`, or neither, in the world's `boundary`",
                ));
            }
        }
        let [nx, ny] = coarse.cells();
        Ok(Self {
            nx,
            ny,
            cell_m: coarse.steps().map(|step| step * window.cell_m()),
            edges: [boundary.west, boundary.east, boundary.north, boundary.south],
        })
    }

    /// Number of cells, without those beyond the sides.
    pub const fn len(&self) -> usize {
        self.nx * self.ny
    }

    /// Area of a cell in m².
    pub fn area_m2(&self) -> f64 {
        self.cell_m[0] * self.cell_m[1]
    }

    /// Cells from one row of a padded raster to the next.
    pub const fn stride(&self) -> usize {
        self.nx + 2 * PAD
    }

    /// Place of a cell in a padded raster.
    pub const fn at(&self, i: usize, j: usize) -> usize {
        (j + PAD) * self.stride() + i + PAD
    }

    /// Returns true if the sides of that axis are joined.
    pub fn wraps(&self, axis: usize) -> bool {
        self.edges[2 * axis] == Edge::Periodic
    }

    /// Number of cells of a padded raster.
    pub const fn padded_len(&self) -> usize {
        self.stride() * (self.ny + 2 * PAD)
    }

    /// A padded raster of zeros.
    pub fn padded(&self) -> Result<Vec<f64>, OutOfMemory> {
        zeroed(self.padded_len())
    }

    /// Continues a padded raster beyond the sides: with its border, or with the opposite side where sides are joined.
    pub fn extend(&self, raster: &mut [f64]) {
        let (nx, ny) = (self.nx as isize, self.ny as isize);
        let pad = PAD as isize;
        let inside = |at: isize, count: isize, wraps: bool| {
            (if wraps { at.rem_euclid(count) } else { at.clamp(0, count - 1) }) as usize
        };
        for j in -pad..ny + pad {
            for i in -pad..nx + pad {
                if !(0..nx).contains(&i) || !(0..ny).contains(&j) {
                    let from = self.at(inside(i, nx, self.wraps(0)), inside(j, ny, self.wraps(1)));
                    raster[((j + pad) * self.stride() as isize + i + pad) as usize] = raster[from];
                }
            }
        }
    }

    /// Sets thickness and surface beyond the sides, from the bed and those inside.
    pub fn surround(&self, bed: &[f64], thickness: &mut [f64], surface: &mut [f64]) {
        let stride = self.stride();
        for j in 0..self.ny {
            let line = Line { first: self.at(0, j), step: 1, count: self.nx };
            line.surround([self.edges[0], self.edges[1]], bed, thickness, surface);
        }
        for x in 0..stride {
            let line = Line { first: PAD * stride + x, step: stride, count: self.ny };
            line.surround([self.edges[2], self.edges[3]], bed, thickness, surface);
        }
    }

    /// The row `j` of a padded raster, from the column `i` on.
    pub fn row<'a>(&self, raster: &'a [f64], i: isize, j: isize, count: usize) -> &'a [f64] {
        let first = (j + PAD as isize) * self.stride() as isize + i + PAD as isize;
        &raster[first as usize..][..count]
    }

    /// Neighbours of a cell across its west, east, north and south sides. Returns None beyond the world.
    pub fn beside(&self, i: usize, j: usize) -> [Option<usize>; 4] {
        let along = |at: usize, count: usize, back: bool, wraps: bool| match (back, wraps) {
            (true, _) if at > 0 => Some(at - 1),
            (true, true) => Some(count - 1),
            (false, _) if at + 1 < count => Some(at + 1),
            (false, true) => Some(0),
            _ => None,
        };
        let (wrap_x, wrap_y) = (self.wraps(0), self.wraps(1));
        [
            along(i, self.nx, true, wrap_x).map(|i| j * self.nx + i),
            along(i, self.nx, false, wrap_x).map(|i| j * self.nx + i),
            along(j, self.ny, true, wrap_y).map(|j| j * self.nx + i),
            along(j, self.ny, false, wrap_y).map(|j| j * self.nx + i),
        ]
    }
}

/// A row or a column of a padded raster.
struct Line {
    first: usize,
    step: usize,
    count: usize,
}

impl Line {
    fn surround(&self, edges: [Edge; 2], bed: &[f64], thickness: &mut [f64], surface: &mut [f64]) {
        let cell = |k: usize| self.first + k * self.step;
        let last = self.count - 1;
        for out in 1..=PAD {
            let inner = (out - 1).min(last);
            let sides = [
                (
                    edges[0],
                    self.first - out * self.step,
                    cell(0),
                    cell(inner),
                    cell(1.min(last)),
                    cell((self.count * PAD - out) % self.count),
                ),
                (
                    edges[1],
                    cell(last + out),
                    cell(last),
                    cell(last - inner),
                    cell(last - 1.min(last)),
                    cell((out - 1) % self.count),
                ),
            ];
            for (edge, ghost, border, mirror, next, opposite) in sides {
                (thickness[ghost], surface[ghost]) = match edge {
                    Edge::Wall => (thickness[mirror], surface[mirror]),
                    Edge::Base => (0.0, bed[border]),
                    Edge::Open | Edge::Inland => {
                        let fall = (surface[next] - surface[border]).max(0.0);
                        (thickness[border], surface[border] - out as f64 * fall)
                    }
                    Edge::Periodic => (thickness[opposite], surface[opposite]),
                };
            }
        }
    }
}
