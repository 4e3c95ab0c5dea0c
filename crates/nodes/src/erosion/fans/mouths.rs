//! Where fans begin: where a stream joins a much larger river, or leaves the mountains, and the ground below is flat.

use orograph_graph::{
    Job, Lane, NodeError,
    memory::{copied, filled, zeroed},
};

use super::{FEWEST_CELLS, Params, Shape};
use crate::numerics::{
    par,
    routing::{
        Depressions, Drainage, Grid,
        code::{direction, has_receiver, length},
        donors, receivers,
    },
};

/// A river is much larger than a stream if it drains so many times the area.
const LARGER: u32 = 3;
/// A fan is at most so steep, as a share of the slope of the stream that feeds it.
const GENTLER: f64 = 0.7;
/// The ground below a fan is at most so steep, as a share of the fan's slope.
const FLAT: f64 = 0.5;

/// The mouth of a stream.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mouth {
    /// The last cell of the stream.
    pub cell: u32,
    pub catchment_m2: f64,
    pub shape: Shape,
}

/// The streams of a landscape.
pub(super) struct Streams {
    pub grid: Grid,
    /// Receivers.
    pub codes: Vec<u8>,
    /// Height of the ground, or of water that stands on it.
    pub level_m: Vec<f32>,
    /// Cells of catchments.
    pub cells: Vec<u32>,
    /// Room for basins.
    pub depressions: Depressions<f32>,
}

impl Streams {
    /// # Errors
    /// Sides that do not match, [`NodeError::Cancelled`], or not enough memory.
    pub fn find(job: &Job<'_>, land: &[f32]) -> Result<Self, NodeError> {
        let grid = Grid::new(&job.window())?;
        let mut codes = zeroed(grid.cells())?;
        let mut level_m = copied(land)?;
        let mut depressions = Depressions::default();
        receivers::d8(job, &grid, land, &mut codes)?;
        Self::lead_out(job, &grid, land, &mut codes, &mut depressions)?;
        depressions.fill(&mut level_m);
        let mut cells = filled(grid.cells(), 1)?;
        let mut drainage = Drainage::default();
        drainage.exchange_room(&mut depressions);
        drainage.accumulate(job, &grid, &codes, &mut cells)?;
        drainage.exchange_room(&mut depressions);
        Ok(Self { grid, codes, level_m, cells, depressions })
    }

    /// Leads receivers out of depressions, and ends them at the sea.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`], or not enough memory.
    pub fn lead_out(
        job: &Job<'_>,
        grid: &Grid,
        land: &[f32],
        codes: &mut [u8],
        depressions: &mut Depressions<f32>,
    ) -> Result<(), NodeError> {
        if let Some(level) = job.sea_level() {
            receivers::end_at_sea(land, level, codes);
        }
        depressions.find(job, grid, land, codes)?;
        depressions.carve(job, grid, codes)
    }

    /// The direction and the cell in which a stream goes on.
    pub fn below(&self, cell: u32) -> Option<(usize, u32)> {
        let code = self.codes[cell as usize];
        has_receiver(code).then(|| (direction(code), self.grid.receiver(cell, code)))
    }

    /// The direction and the cell from which the largest stream comes.
    pub fn above(&self, cell: u32) -> Option<(usize, u32)> {
        donors::of(&self.grid, &self.codes, cell)
            .max_by_key(|(_, donor)| (self.cells[*donor as usize], std::cmp::Reverse(*donor)))
    }

    /// The tangent of the mean slope from a cell on, over a length in cells or to the end of the stream.
    fn slope(&self, from: u32, cells: f64, cell_m: f64, next: impl Fn(u32) -> Option<(usize, u32)>) -> Option<f64> {
        let (mut cell, mut passed) = (from, 0.0);
        while passed < cells
            && let Some((way, there)) = next(cell)
        {
            (cell, passed) = (there, passed + length(way as u8));
        }
        let drop_m = f64::from(self.level_m[from as usize]) - f64::from(self.level_m[cell as usize]);
        (passed > 0.0).then(|| drop_m.abs() / (passed * cell_m))
    }

    /// The mouths of all streams that may have fans, in the order of their cells.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn mouths(&self, job: &Job<'_>, params: &Params, size: &Lane<'_>) -> Result<Vec<Mouth>, NodeError> {
        let rows = par::collect(self.cells.chunks(self.grid.nx), |row, cells| {
            job.check()?;
            let first = row * self.grid.nx;
            Ok::<_, NodeError>(
                (first..first + cells.len()).filter_map(|cell| self.mouth(job, params, size, cell)).collect(),
            )
        })?;
        Ok(rows.into_iter().flat_map(|row: Vec<Mouth>| row).collect())
    }

    fn mouth(&self, job: &Job<'_>, params: &Params, size: &Lane<'_>, cell: usize) -> Option<Mouth> {
        let cell_m = job.cell_m();
        let catchment_m2 = f64::from(self.cells[cell]) * cell_m * cell_m;
        if !(params.smallest..=params.largest).contains(&catchment_m2) {
            return None;
        }
        let size = f64::from(size.at(cell));
        let mut shape = Shape::of(catchment_m2, if size.is_finite() { size.max(0.0) } else { 0.0 }, params);
        if shape.area_m2 < FEWEST_CELLS * cell_m * cell_m {
            return None;
        }
        let cell = cell as u32;
        let (_, below) = self.below(cell)?;
        let radius = shape.radius_m / cell_m;
        shape.slope = shape.slope.min(GENTLER * self.slope(cell, radius, cell_m, |cell| self.above(cell))?);
        let flat = FLAT * shape.slope;
        if self.slope(below, radius, cell_m, |cell| self.below(cell))? > flat {
            return None;
        }
        let joins = self.cells[below as usize] / LARGER >= self.cells[cell as usize];
        // the first cell below which it is flat
        let leaves_mountains = || self.slope(cell, radius, cell_m, |cell| self.below(cell)) > Some(flat);
        (joins || leaves_mountains()).then_some(Mouth { cell, catchment_m2, shape })
    }
}
