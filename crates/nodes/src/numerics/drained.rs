//! The flow that hydrology nodes exchange: directions, areas, discharge and water level.
//!
//! [`PortType::Flow`](orograph_graph::PortType::Flow) is a raster of four planes, so that it is cached, cropped and
//! stored on disk like any other. Only this module knows the meaning of the planes.

use orograph_graph::{Field, Window};

use super::routing::{
    Grid, Outlet,
    code::{BORDER, OUTLET, PIT},
};
use crate::numerics::par;

/// The planes of a flow, row-major, one sample per cell.
#[derive(Clone, Copy, Debug)]
pub struct Drained<'a> {
    /// Direction of the receiver, 0 to 7 counter-clockwise from east; negative if there is none.
    pub direction: &'a [f32],
    /// Drainage area in square metres.
    pub area_m2: &'a [f32],
    /// Mean discharge in cubic metres per second.
    pub discharge_m3_per_s: &'a [f32],
    /// Height of the terrain, or of standing water on it, in metres. It never rises along `direction`.
    pub level_m: &'a [f32],
}

impl<'a> Drained<'a> {
    /// Returns the planes of a flow.
    ///
    /// # Panics
    /// If the field does not have the planes of a flow, which is a mistake in a node's declaration.
    #[must_use]
    pub fn read(flow: &'a Field) -> Self {
        let [direction, area_m2, discharge_m3_per_s, level_m] = [0, 1, 2, 3].map(|plane| flow.plane(plane));
        Self { direction, area_m2, discharge_m3_per_s, level_m }
    }

    /// Returns a field with these planes.
    ///
    /// # Panics
    /// If the planes do not fill the window.
    #[must_use]
    pub fn field(&self, window: Window) -> Field {
        let planes = [self.direction, self.area_m2, self.discharge_m3_per_s, self.level_m];
        Field::with_planes(window, planes.len(), planes.concat())
    }

    /// Returns the direction of a cell's receiver. Returns None if it has none.
    #[must_use]
    #[inline]
    pub fn way(&self, cell: usize) -> Option<usize> {
        let direction = self.direction[cell];
        (0.0..8.0).contains(&direction).then_some(direction as usize)
    }

    /// Returns the receivers as codes of [`crate::numerics::routing::code`].
    #[must_use]
    pub fn codes(&self, grid: &Grid) -> Vec<u8> {
        let mut codes = vec![0; grid.cells()];
        par::all(codes.chunks_mut(grid.nx), |y, codes| {
            for (x, code) in codes.iter_mut().enumerate() {
                let cell = y * grid.nx + x;
                let border = x == 0 || x + 1 == grid.nx || grid.is_border_row(y);
                let way = self.way(cell).filter(|&way| !border || grid.neighbour(cell as u32, way).is_some());
                *code = match way {
                    Some(way) => way as u8,
                    None if grid.outlet(x, y) == Outlet::No => PIT,
                    None => OUTLET,
                } | if border { BORDER } else { 0 };
            }
        });
        codes
    }
}
