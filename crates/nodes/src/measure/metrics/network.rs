//! The way of water over the measured land.
//!
//! Depressions are filled by a priority flood whose surface rises by a small step from cell to cell (R. Barnes, C.
//! Lehman, D. Mulla, 2014, "Priority-flood", Computers & Geosciences 62), so that water crosses flats and lakes on the
//! shortest way to their outlet. Each cell then drains to the neighbour of steepest descent (O'Callaghan and Mark
//! 1984). Water leaves at all borders, at voids and in the sea, whatever the boundary of the world. The flood visits
//! cells from the outlets upwards, which is the order in which everything else is computed. Cells that it reaches at
//! their own height come in the order of heights; the levels of those that it lifts never fall, as they are one step
//! above cells that it has visited, so that these need no heap.

use std::{collections::VecDeque, iter::Peekable};

use super::{Land, order::from_the_bottom};
use crate::{
    numerics::{par, routing::code::STEPS},
    prelude::*,
};

/// Largest step of the flooded surface in metres, and the largest as a fraction of the relief.
const STEP: [f64; 2] = [1e-4, 1e-7];
/// Marks cells that no water reaches.
const NOWHERE: u32 = u32::MAX;

/// The receivers of all cells with a height, and their drainage areas.
pub(super) struct Network {
    pub nx: usize,
    pub ny: usize,
    pub cell_m: f64,
    /// The flooded surface, which falls along every link; NaN in voids.
    pub level: Vec<f64>,
    /// The cell that a cell drains to; itself where water leaves.
    pub receiver: Vec<u32>,
    /// Cells with a height from the outlets upwards.
    pub order: Vec<u32>,
    /// Drainage area in cells, with the cell itself.
    pub area: Vec<u32>,
    /// Cells below the surface of still water, and those more than a metre below.
    pub flooded: [usize; 2],
}

impl Network {
    /// Floods the land; `order` has all cells with a height from the highest.
    pub fn of(
        land: &Land<'_>,
        order: &[u32],
        check: &(dyn Fn() -> Result<(), NodeError> + Sync),
    ) -> Result<Self, NodeError> {
        let (nx, ny) = (land.nx(), land.ny());
        let heights = land.height.plane(0);
        let neighbours = Neighbours::new(nx, ny);
        let is_sea = |cell: usize| land.sea_m.is_some_and(|sea_m| f64::from(heights[cell]) < sea_m);
        let mut flood = Flood::new(land);
        // where water leaves: the border, cells beside voids, the sea
        let leaves = par::map(nx * ny, |cell| {
            let (x, y) = (cell % nx, cell / nx);
            let border = x == 0 || y == 0 || x + 1 == nx || y + 1 == ny;
            heights[cell].is_finite()
                && (border || is_sea(cell) || neighbours.of(cell).any(|next| heights[next].is_nan()))
        });
        (0..nx * ny).filter(|&cell| leaves[cell]).for_each(|cell| flood.begin(cell));
        flood.run(order, check)?;
        let Flood { level, order, flooded, .. } = flood;
        let receiver = par::map(nx * ny, |cell| {
            if leaves[cell] || level[cell].is_nan() { cell as u32 } else { steepest(&level, nx, cell) }
        });
        check()?;
        let mut area = vec![1_u32; nx * ny];
        for &cell in order.iter().rev() {
            let below = receiver[cell as usize];
            if below != cell {
                area[below as usize] += area[cell as usize];
            }
        }
        Ok(Self { nx, ny, cell_m: land.cell_m(), level, receiver, order, area, flooded })
    }

    /// The cell downstream. Returns None where water leaves.
    pub fn below(&self, cell: usize) -> Option<usize> {
        let below = self.receiver[cell] as usize;
        (below != cell).then_some(below)
    }

    /// Drainage area in m².
    pub fn area_m2(&self, cell: usize) -> f64 {
        f64::from(self.area[cell]) * self.cell_m * self.cell_m
    }

    /// Column and row of a cell.
    pub fn place(&self, cell: usize) -> [f64; 2] {
        [(cell % self.nx) as f64, (cell / self.nx) as f64]
    }

    /// Length of the link to the receiver in metres; 0 where water leaves.
    pub fn length_m(&self, cell: usize) -> f64 {
        let Some(below) = self.below(cell) else { return 0.0 };
        // with three columns, cells whose numbers differ by one are in one row
        let apart = cell.abs_diff(below);
        let is_straight = match self.nx {
            ..3 => self.step(cell, below).contains(&0),
            nx => apart == 1 || apart == nx,
        };
        self.cell_m * if is_straight { 1.0 } else { std::f64::consts::SQRT_2 }
    }

    /// Columns and rows from a cell to another.
    pub fn step(&self, from: usize, to: usize) -> [i64; 2] {
        let nx = self.nx;
        [(to % nx) as i64 - (from % nx) as i64, (to / nx) as i64 - (from / nx) as i64]
    }

    /// The cell that is `steps` downstream. Returns None when water leaves before.
    pub fn after(&self, cell: usize, steps: usize) -> Option<usize> {
        (0..steps).try_fold(cell, |cell, _| self.below(cell))
    }

    /// The donor with the largest area of each cell; the cell itself where there is none.
    pub fn trunks(&self) -> Vec<u32> {
        let mut up: Vec<u32> = (0..self.receiver.len() as u32).collect();
        for cell in 0..self.receiver.len() {
            let Some(below) = self.below(cell) else { continue };
            let now = up[below] as usize;
            if now == below || self.area[cell] > self.area[now] {
                up[below] = cell as u32;
            }
        }
        up
    }
}

/// The neighbours of cells of a raster.
pub(super) struct Neighbours {
    nx: u32,
    ny: u32,
    /// How far the neighbours of a cell are from it in a raster.
    offsets: [i32; 8],
}

impl Neighbours {
    pub fn new(nx: usize, ny: usize) -> Self {
        let offsets = STEPS.map(|(dx, dy)| dy * nx as i32 + dx);
        Self { nx: nx as u32, ny: ny as u32, offsets }
    }

    /// The neighbours of a cell in the order E, NE, N, NW, W, SW, S, SE.
    pub fn of(&self, cell: usize) -> impl Iterator<Item = usize> {
        // divisions of 32 bits are faster
        let (x, y) = (cell as u32 % self.nx, cell as u32 / self.nx);
        let is_inside = x > 0 && y > 0 && x + 1 < self.nx && y + 1 < self.ny;
        (0..8).filter_map(move |k| {
            let is_there = is_inside || {
                let (dx, dy) = STEPS[k];
                x.wrapping_add_signed(dx) < self.nx && y.wrapping_add_signed(dy) < self.ny
            };
            is_there.then(|| cell.wrapping_add_signed(self.offsets[k] as isize))
        })
    }
}

/// The neighbour of steepest descent of a cell that is not on the border; the cell itself if none is lower.
fn steepest(level: &[f64], nx: usize, cell: usize) -> u32 {
    let (mut best, mut receiver) = (0.0, cell);
    for (direction, (dx, dy)) in STEPS.iter().enumerate() {
        let next = (cell as isize + *dx as isize + *dy as isize * nx as isize) as usize;
        let drop = level[cell] - level[next];
        let slope = if direction % 2 == 1 { drop * std::f64::consts::FRAC_1_SQRT_2 } else { drop };
        if slope > best {
            (best, receiver) = (slope, next);
        }
    }
    receiver as u32
}

/// The state of a priority flood.
struct Flood<'a> {
    heights: &'a [f32],
    nx: usize,
    ny: usize,
    step: f64,
    level: Vec<f64>,
    /// The surface of still water, without steps.
    still: Vec<f32>,
    order: Vec<u32>,
    flooded: [usize; 2],
    /// Cells that water lifts, by level, and those of the lowest level, by number from the end.
    lifted: VecDeque<u32>,
    lowest: Vec<u32>,
}

/// The order-preserving number of a level.
fn ordered(level: f64) -> u64 {
    let bits = level.to_bits();
    if bits >> 63 == 0 { bits | 1 << 63 } else { !bits }
}

impl<'a> Flood<'a> {
    fn new(land: &Land<'a>) -> Self {
        let (nx, ny) = (land.nx(), land.ny());
        let relief = land.height.range(0).map_or(0.0, |(low, high)| f64::from(high) - f64::from(low));
        let step = if relief > 0.0 { STEP[0].min(STEP[1] * relief) } else { STEP[0] };
        Self {
            heights: land.height.plane(0),
            nx,
            ny,
            step,
            level: vec![f64::NAN; nx * ny],
            still: vec![f32::NAN; nx * ny],
            order: Vec::with_capacity(nx * ny),
            flooded: [0; 2],
            lifted: VecDeque::new(),
            lowest: Vec::new(),
        }
    }

    fn begin(&mut self, cell: usize) {
        self.level[cell] = f64::from(self.heights[cell]);
        self.still[cell] = self.heights[cell];
    }

    fn run(&mut self, order: &[u32], check: &(dyn Fn() -> Result<(), NodeError> + Sync)) -> Result<(), NodeError> {
        let neighbours = Neighbours::new(self.nx, self.ny);
        let mut rising = from_the_bottom(self.heights, order).peekable();
        while let Some(cell) = self.next(&mut rising) {
            if self.order.len().is_multiple_of(1 << 16) {
                check()?;
            }
            self.order.push(cell);
            let (level, still) = (self.level[cell as usize] + self.step, self.still[cell as usize]);
            for next in neighbours.of(cell as usize) {
                let height = self.heights[next];
                if !self.level[next].is_nan() || height.is_nan() {
                    continue;
                }
                self.level[next] = level.max(f64::from(height));
                self.still[next] = still.max(height);
                self.flooded[0] += usize::from(still > height);
                self.flooded[1] += usize::from(still - height > 1.0);
                if !self.is_dry(next) {
                    self.lifted.push_back(next as u32);
                }
            }
        }
        Ok(())
    }

    /// Whether water reaches a cell at its own height.
    fn is_dry(&self, cell: usize) -> bool {
        self.level[cell].to_bits() == f64::from(self.heights[cell]).to_bits()
    }

    /// The next cell by level, then by number. Cells that come in the order of heights before water reaches them are
    /// passed over: it lifts them later.
    fn next(&mut self, rising: &mut Peekable<impl Iterator<Item = u32>>) -> Option<u32> {
        loop {
            let lifted = self.lowest.last().or(self.lifted.front()).map(|&cell| ordered(self.level[cell as usize]));
            let dry = rising.peek().map(|&cell| (ordered(f64::from(self.heights[cell as usize])), cell));
            let is_dry_first = match (dry, lifted) {
                (Some((level, _)), Some(lifted)) if level > lifted => false,
                (Some((level, cell)), Some(lifted)) if level == lifted => cell < self.lowest(lifted),
                (Some(_), _) => true,
                (None, Some(_)) => false,
                (None, None) => return None,
            };
            if !is_dry_first {
                self.lowest(lifted?);
                return self.lowest.pop();
            }
            let cell = rising.next()?;
            if self.is_dry(cell as usize) {
                return Some(cell);
            }
        }
    }

    /// The first cell of the lowest level of those that water lifts. All of that level are known.
    fn lowest(&mut self, level: u64) -> u32 {
        if self.lowest.is_empty() {
            while let Some(cell) = self.lifted.pop_front_if(|cell| ordered(self.level[*cell as usize]) == level) {
                self.lowest.push(cell);
            }
            self.lowest.sort_unstable_by_key(|&cell| std::cmp::Reverse(cell));
        }
        self.lowest.last().copied().unwrap_or(u32::MAX)
    }
}

impl Network {
    /// The outlet of each cell; [`NOWHERE`] in voids.
    pub fn outlets(&self) -> Vec<u32> {
        let mut outlet = vec![NOWHERE; self.receiver.len()];
        for &cell in &self.order {
            let below = self.receiver[cell as usize];
            outlet[cell as usize] = if below == cell { cell } else { outlet[below as usize] };
        }
        outlet
    }
}
