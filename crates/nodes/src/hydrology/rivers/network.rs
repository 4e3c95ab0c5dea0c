//! Channel cells and their Strahler order.

use orograph_graph::{Job, NodeError};

use super::{Heads, Params};
use crate::numerics::{
    drained::Drained,
    par,
    routing::{
        Drainage, Grid,
        code::{direction, has_receiver, is_diagonal},
        donors,
        drainage::Amount,
    },
};

/// The channels of a landscape.
pub struct Network {
    /// Receivers of all cells.
    pub codes: Vec<u8>,
    /// Strahler order; 0 where there is no channel.
    pub orders: Vec<u8>,
}

/// True if a channel has begun here or upstream.
#[derive(Clone, Copy, Default)]
struct Begun(bool);

impl Amount for Begun {
    fn plus(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// The highest order among the inflowing channels; `twice` is true if at least two have it.
#[derive(Clone, Copy, Default)]
struct Inflow {
    highest: u8,
    twice: bool,
}

impl Amount for Inflow {
    fn plus(self, other: Self) -> Self {
        match self.highest.cmp(&other.highest) {
            std::cmp::Ordering::Greater => self,
            std::cmp::Ordering::Less => other,
            std::cmp::Ordering::Equal => Self { highest: self.highest, twice: self.highest > 0 },
        }
    }
}

impl Inflow {
    /// Returns the Strahler order of the channel below this inflow.
    const fn order(self) -> u8 {
        match (self.highest, self.twice) {
            (0, _) => 1,
            (highest, twice) => highest + twice as u8,
        }
    }
}

impl Network {
    /// Finds the channels: they begin where the threshold is exceeded, and always continue downstream.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn find(job: &Job<'_>, grid: &Grid, drained: &Drained<'_>, params: &Params) -> Result<Self, NodeError> {
        let codes = drained.codes(grid);
        let mut begun = par::map(grid.cells(), |cell| Begun(begins(job, grid, drained, &codes, params, cell)));
        let mut drainage = Drainage::default();
        drainage.accumulate(job, grid, &codes, &mut begun)?;
        let mut inflow = vec![Inflow::default(); grid.cells()];
        drainage.downstream(job, grid, &codes, &mut inflow, |cell, _, own| {
            if begun[cell].0 { Inflow { highest: own.order(), twice: false } } else { Inflow::default() }
        })?;
        let orders = par::map(grid.cells(), |cell| if begun[cell].0 { inflow[cell].order() } else { 0 });
        Ok(Self { codes, orders })
    }

    /// Returns the number of channels that flow into each channel cell; 0 in other cells.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn inflows(&self, job: &Job<'_>, grid: &Grid) -> Result<Vec<u8>, NodeError> {
        let Self { codes, orders } = self;
        let mut inflows = vec![0; grid.cells()];
        par::each(inflows.chunks_mut(grid.nx), |y, inflows| {
            job.check()?;
            for (x, inflows) in inflows.iter_mut().enumerate() {
                let cell = y * grid.nx + x;
                if orders[cell] > 0 {
                    let channels = donors::of(grid, codes, cell as u32).filter(|&(_, from)| orders[from as usize] > 0);
                    *inflows = channels.count() as u8;
                }
            }
            Ok::<_, NodeError>(())
        })?;
        Ok(inflows)
    }
}

/// Returns true if a cell exceeds the threshold for channel heads.
fn begins(job: &Job<'_>, grid: &Grid, drained: &Drained<'_>, codes: &[u8], params: &Params, cell: usize) -> bool {
    let area_m2 = f64::from(drained.area_m2[cell]);
    match params.heads {
        Heads::Area => area_m2 > params.channel_area,
        Heads::SlopeArea => {
            let code = codes[cell];
            if !has_receiver(code) {
                return false;
            }
            let below = grid.receiver(cell as u32, code) as usize;
            let drop_m = f64::from(drained.level_m[cell]) - f64::from(drained.level_m[below]);
            let square_m2 = job.cell_m() * job.cell_m() * if is_diagonal(direction(code)) { 2.0 } else { 1.0 };
            drop_m > 0.0 && area_m2 * drop_m * drop_m / square_m2 > params.channel_constant
        }
    }
}
