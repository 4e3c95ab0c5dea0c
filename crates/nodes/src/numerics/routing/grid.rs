//! Topology of the raster: neighbours and outlets.

use orograph_graph::{Edge, NodeError, Window};

use super::code::{BORDER, STEPS, direction};

/// How water leaves the world at a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outlet {
    /// Water does not leave.
    No,
    /// Water always leaves: the cell is at base level and has no receiver.
    Base,
    /// Water leaves where no neighbour is lower, or where a depression overflows.
    Open,
}

/// Columns, rows, and how the sides are connected.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Columns.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
    wrap: [bool; 2],
    west: Outlet,
    east: Outlet,
    north: Outlet,
    south: Outlet,
    offsets: [u32; 8],
    /// Border cells that are at base level whatever the type of their side, in ascending order.
    gates: Vec<u32>,
}

impl Grid {
    /// Maximum number of cells for routing: a link between two cells is numbered in 32 bits, eight per cell.
    pub const MAX_CELLS: usize = 1 << 29;

    /// Creates the grid of a whole world.
    ///
    /// # Errors
    /// If no side is open or at base level, if a periodic side faces one that is not, or if there are more than
    /// [`Self::MAX_CELLS`].
    pub fn new(window: &Window) -> Result<Self, NodeError> {
        let sides = window.world.boundary;
        let wrap = |one: Edge, other: Edge, names: [&str; 2]| match (one, other) {
            (Edge::Periodic, Edge::Periodic) => Ok(true),
            (Edge::Periodic, _) | (_, Edge::Periodic) => Err(NodeError::failed_with_hint(
                format!("of the sides {} and {} one is periodic and the other is not", names[0], names[1]),
                "make both `periodic`, or neither, in the world's `boundary`",
            )),
            _ => Ok(false),
        };
        let outlet = |edge: Edge| match edge {
            Edge::Base => Outlet::Base,
            Edge::Open | Edge::Inland => Outlet::Open,
            Edge::Wall | Edge::Periodic => Outlet::No,
        };
        let (nx, ny) = (window.nx(), window.ny());
        if window.len() > Self::MAX_CELLS {
            return Err(NodeError::failed_with_hint(
                format!("flow cannot be routed over {} cells; the most is {}", window.len(), Self::MAX_CELLS),
                "choose fewer `cells`",
            ));
        }
        let grid = Self {
            nx,
            ny,
            wrap: [
                wrap(sides.west, sides.east, ["west", "east"])?,
                wrap(sides.north, sides.south, ["north", "south"])?,
            ],
            west: outlet(sides.west),
            east: outlet(sides.east),
            north: outlet(sides.north),
            south: outlet(sides.south),
            offsets: STEPS.map(|(dx, dy)| (dy * nx as i32 + dx) as u32),
            gates: Vec::new(),
        };
        if [grid.west, grid.east, grid.north, grid.south] == [Outlet::No; 4] {
            return Err(NodeError::failed_with_hint(
                "no side of the world lets water out",
                "set a side of the world's `boundary` to `base` or `open`",
            ));
        }
        Ok(grid)
    }

    /// Returns the grid with base level at the cells `gates`, in ascending order, of `inland` sides, and the rest of
    /// these sides closed. Without gates nothing changes.
    #[must_use]
    pub fn with_gates(mut self, gates: Vec<u32>, inland: [bool; 4]) -> Self {
        if !gates.is_empty() {
            for (outlet, is_inland) in
                [&mut self.west, &mut self.east, &mut self.north, &mut self.south].into_iter().zip(inland)
            {
                if is_inland {
                    *outlet = Outlet::No;
                }
            }
        }
        Self { gates, ..self }
    }

    /// Number of cells.
    #[must_use]
    pub const fn cells(&self) -> usize {
        self.nx * self.ny
    }

    /// Returns how water leaves at column `x` of row `y`. A corner cell is at base level if one of its sides is.
    #[must_use]
    pub fn outlet(&self, x: usize, y: usize) -> Outlet {
        let sides =
            [(x == 0, self.west), (x + 1 == self.nx, self.east), (y == 0, self.north), (y + 1 == self.ny, self.south)];
        let touches = |outlet| sides.contains(&(true, outlet));
        let is_gate = || self.gates.binary_search(&((y * self.nx + x) as u32)).is_ok();
        if touches(Outlet::Base) || is_gate() {
            Outlet::Base
        } else if touches(Outlet::Open) {
            Outlet::Open
        } else {
            Outlet::No
        }
    }

    /// Returns how water leaves across the sides: west, east, north, south.
    #[must_use]
    pub const fn sides(&self) -> [Outlet; 4] {
        [self.west, self.east, self.north, self.south]
    }

    /// Returns true along each axis if its two sides are joined.
    #[must_use]
    pub const fn wraps(&self) -> [bool; 2] {
        self.wrap
    }

    /// Returns true if a side of the world is open.
    #[must_use]
    pub fn has_open_side(&self) -> bool {
        [self.west, self.east, self.north, self.south].contains(&Outlet::Open)
    }

    /// Returns true if a row is the first or the last.
    #[must_use]
    pub const fn is_border_row(&self, y: usize) -> bool {
        y == 0 || y + 1 == self.ny
    }

    /// Returns the row to the north. Returns None when there is none.
    #[must_use]
    pub const fn row_above(&self, y: usize) -> Option<usize> {
        match (y, self.wrap[1]) {
            (0, false) => None,
            (0, true) => Some(self.ny - 1),
            _ => Some(y - 1),
        }
    }

    /// Returns the row to the south. Returns None when there is none.
    #[must_use]
    pub const fn row_below(&self, y: usize) -> Option<usize> {
        if y + 1 < self.ny {
            Some(y + 1)
        } else if self.wrap[1] {
            Some(0)
        } else {
            None
        }
    }

    /// Returns the column to the west. Returns None when there is none.
    #[must_use]
    #[inline(always)]
    pub const fn column_before(&self, x: usize) -> Option<usize> {
        match (x, self.wrap[0]) {
            (0, false) => None,
            (0, true) => Some(self.nx - 1),
            _ => Some(x - 1),
        }
    }

    /// Returns the column to the east. Returns None when there is none.
    #[must_use]
    #[inline(always)]
    pub const fn column_after(&self, x: usize) -> Option<usize> {
        if x + 1 < self.nx {
            Some(x + 1)
        } else if self.wrap[0] {
            Some(0)
        } else {
            None
        }
    }

    /// Returns the cell next to any cell. Returns None when there is none.
    #[must_use]
    pub fn neighbour(&self, cell: u32, direction: usize) -> Option<u32> {
        let (dx, dy) = STEPS[direction];
        let at = [(cell as usize % self.nx) as i32 + dx, (cell as usize / self.nx) as i32 + dy];
        let ([x, y], is_within) = self.nearest(at);
        is_within.then(|| (y * self.nx + x) as u32)
    }

    /// Returns the cell at a column and a row, or the last one before the side of the world, and whether it is within
    /// the world. Columns and rows go on beyond periodic sides.
    #[must_use]
    #[inline]
    pub fn nearest(&self, at: [i32; 2]) -> ([usize; 2], bool) {
        let along = |at: i32, count: usize, wrap: bool| {
            let count = count as i32;
            if (0..count).contains(&at) {
                (at as usize, true)
            } else if wrap {
                (at.rem_euclid(count) as usize, true)
            } else {
                (at.clamp(0, count - 1) as usize, false)
            }
        };
        let (x, is_column) = along(at[0], self.nx, self.wrap[0]);
        let (y, is_row) = along(at[1], self.ny, self.wrap[1]);
        ([x, y], is_column && is_row)
    }

    /// How many columns and rows away a cell may be from another, so that no cell is reached in two ways.
    #[must_use]
    pub fn farthest(&self) -> [usize; 2] {
        let along = |count: usize, wrap: bool| if wrap { (count - 1) / 2 } else { count };
        [along(self.nx, self.wrap[0]), along(self.ny, self.wrap[1])]
    }

    /// Returns the neighbour of a cell that is not on the border.
    #[must_use]
    #[inline(always)]
    pub const fn inner_neighbour(&self, cell: u32, direction: usize) -> u32 {
        cell.wrapping_add(self.offsets[direction])
    }

    /// Returns the neighbour of a cell of the given code. Returns None when there is none.
    #[must_use]
    #[inline(always)]
    pub fn beside(&self, cell: u32, code: u8, direction: usize) -> Option<u32> {
        if code & BORDER == 0 { Some(self.inner_neighbour(cell, direction)) } else { self.neighbour(cell, direction) }
    }

    /// Returns the receiver of a cell whose code has one.
    #[must_use]
    #[inline(always)]
    pub fn receiver(&self, cell: u32, code: u8) -> u32 {
        let direction = direction(code);
        if code & BORDER != 0 && (self.wrap[0] || self.wrap[1]) {
            self.neighbour(cell, direction).unwrap_or(cell)
        } else {
            self.inner_neighbour(cell, direction)
        }
    }
}
