//! A flow as passed between nodes: directions, areas, discharge and level of water.
//!
//! [`PortType::Flow`](orograph_graph::PortType::Flow) is a raster of four planes, so that it is cached, cropped and
//! stored on disk like any other. Only this module knows the meaning of the planes.

use orograph_graph::{Field, Window};

use super::routing::{
    Grid, Outlet,
    code::{BORDER, OUTLET, PIT},
};
use crate::numerics::par;

/// The planes of a flow, row-major, one sample a cell.
#[derive(Clone, Copy, Debug)]
pub struct Drained<'a> {
    /// The neighbour that a cell passes its water to, 0 to 7 from east counter-clockwise; negative where there is none.
    pub direction: &'a [f32],
    /// Drainage area in square metres.
    pub area_m2: &'a [f32],
    /// Mean discharge in cubic metres per second.
    pub discharge_m3_per_s: &'a [f32],
    /// Height of the terrain, or of the standing water on it, in metres. It nowhere rises along `direction`.
    pub level_m: &'a [f32],
}

impl<'a> Drained<'a> {
    /// The parts of a flow.
    ///
    /// # Panics
    /// When the field has not the planes of a flow: a mistake in a node's declaration.
    #[must_use]
    pub fn read(flow: &'a Field) -> Self {
        let [direction, area_m2, discharge_m3_per_s, level_m] = [0, 1, 2, 3].map(|plane| flow.plane(plane));
        Self { direction, area_m2, discharge_m3_per_s, level_m }
    }

    /// The flow of these parts.
    ///
    /// # Panics
    /// When the parts do not fill the window.
    #[must_use]
    pub fn field(&self, window: Window) -> Field {
        let planes = [self.direction, self.area_m2, self.discharge_m3_per_s, self.level_m];
        Field::with_planes(window, planes.len(), planes.concat())
    }

    /// Returns the direction of a cell's water. Returns None when it does not flow to a neighbour.
    #[must_use]
    #[inline]
    pub fn way(&self, cell: usize) -> Option<usize> {
        let direction = self.direction[cell];
        (0.0..8.0).contains(&direction).then_some(direction as usize)
    }

    /// The receivers as codes of the engine.
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
