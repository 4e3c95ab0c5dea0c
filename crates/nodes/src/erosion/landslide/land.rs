//! The ground through time: rock, soil and debris in double precision.

use orograph_graph::{
    Edge, NodeError, Window, World,
    memory::{OutOfMemory, zeroed},
};

use crate::numerics::{
    joins::{Joins, Weights},
    math,
    routing::code::STEPS,
};

/// Thicknesses of rock below this are rounding errors of heights.
pub(super) const ROUNDING_M: f64 = 1e-9;

/// The ground of a world.
pub(super) struct Land {
    pub nx: usize,
    pub ny: usize,
    pub cell_m: f64,
    world: World,
    wraps: [bool; 2],
    /// West, east, north, south.
    sides: [Edge; 4],
    /// Present heights.
    pub ground: Vec<f64>,
    /// Thickness of soil that is in its place; empty without soil.
    pub soil: Vec<f64>,
    /// Thickness of debris.
    pub debris: Vec<f64>,
    /// Depth that slides have removed.
    pub scars: Vec<f64>,
    /// Volumes in m³.
    pub ledger: Ledger,
}

/// Volumes in m³ that slides have moved.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ledger {
    /// Rock that has been broken, as rock.
    pub rock: f64,
    /// Soil that has become debris.
    pub soil: f64,
    /// Debris of earlier slides that has moved again.
    pub again: f64,
    /// Debris that has left the world.
    pub left: f64,
}

/// How debris leaves the world at a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Exit {
    No,
    /// Everything that arrives leaves.
    Always,
    /// What cannot go down inside the world leaves.
    IfLowest,
}

impl Land {
    /// Where noise whose longest features are so far apart goes on across joined sides.
    pub fn joins(&self, longest_m: f64) -> Option<Joins> {
        Joins::of(&self.world, longest_m, Weights::Random { longest_m })
    }

    /// # Errors
    /// If one of two opposite sides is periodic and the other is not, or not enough memory.
    pub fn new(window: &Window, heights: &[f32], soil: Vec<f64>) -> Result<Self, NodeError> {
        let boundary = window.world.boundary;
        let sides = [boundary.west, boundary.east, boundary.north, boundary.south];
        let wraps = [[sides[0], sides[1]], [sides[2], sides[3]]].map(|pair| pair.map(|side| side == Edge::Periodic));
        if wraps.iter().any(|[one, other]| one != other) {
            return Err(NodeError::failed_with_hint(
                "of two opposite sides one is periodic and the other is not",
                "make both `periodic`, or neither, in the world's `boundary`",
            ));
        }
        let mut ground = zeroed(heights.len())?;
        ground.iter_mut().zip(heights).for_each(|(ground, height)| *ground = f64::from(*height));
        Ok(Self {
            nx: window.nx(),
            ny: window.ny(),
            cell_m: window.cell_m(),
            world: window.world,
            wraps: wraps.map(|[one, _]| one),
            sides,
            debris: zeroed(ground.len())?,
            scars: zeroed(ground.len())?,
            ground,
            soil,
            ledger: Ledger::default(),
        })
    }

    /// Area of a cell.
    pub fn cell_m2(&self) -> f64 {
        self.cell_m * self.cell_m
    }

    /// Returns the neighbour of a cell. Returns None when there is none.
    #[inline]
    pub fn neighbour(&self, cell: usize, way: usize) -> Option<usize> {
        let (dx, dy) = STEPS[way];
        let (x, y) = (cell % self.nx, cell / self.nx);
        let along = |at: usize, step: i32, count: usize, wraps: bool| {
            let to = at as i64 + i64::from(step);
            if (0..count as i64).contains(&to) {
                Some(to as usize)
            } else if wraps && count > 1 {
                Some(to.rem_euclid(count as i64) as usize)
            } else {
                None
            }
        };
        let x = along(x, dx, self.nx, self.wraps[0])?;
        let y = along(y, dy, self.ny, self.wraps[1])?;
        Some(y * self.nx + x)
    }

    /// Returns the distance to a neighbour in metres.
    #[inline]
    pub fn length_m(&self, way: usize) -> f64 {
        let (dx, dy) = STEPS[way];
        if dx != 0 && dy != 0 { self.cell_m * std::f64::consts::SQRT_2 } else { self.cell_m }
    }

    /// Returns how debris leaves the world at a cell.
    pub fn exit(&self, cell: usize) -> Exit {
        let (x, y) = (cell % self.nx, cell / self.nx);
        let at = [x == 0, x + 1 == self.nx, y == 0, y + 1 == self.ny];
        let touches = |edges: &[Edge]| at.iter().zip(&self.sides).any(|(at, side)| *at && edges.contains(side));
        if touches(&[Edge::Base]) {
            Exit::Always
        } else if touches(&[Edge::Open, Edge::Inland]) {
            Exit::IfLowest
        } else {
            Exit::No
        }
    }

    /// Returns the vector from a place to the centre of a cell, the shortest one in a periodic world.
    pub fn offset_m(&self, from: [f64; 2], cell: usize) -> [f64; 2] {
        let at = [cell % self.nx, cell / self.nx];
        let counts = [self.nx, self.ny];
        [0, 1].map(|axis| {
            let offset = (at[axis] as f64 + 0.5) * self.cell_m - from[axis];
            let size = counts[axis] as f64 * self.cell_m;
            if self.wraps[axis] { offset - size * (offset / size).round() } else { offset }
        })
    }

    /// Returns the horizontal distance of two cells in metres.
    pub fn distance_m(&self, one: usize, other: usize) -> f64 {
        let [x, y] = self.offset_m(self.centre_m(one), other);
        math::hypot(x, y)
    }

    /// Returns the centre of a cell in metres.
    pub fn centre_m(&self, cell: usize) -> [f64; 2] {
        [cell % self.nx, cell / self.nx].map(|at| (at as f64 + 0.5) * self.cell_m)
    }

    /// Returns the cell at a place; the nearest one outside of the world.
    pub fn cell_at(&self, place_m: [f64; 2]) -> usize {
        let counts = [self.nx, self.ny];
        let [x, y] = [0, 1].map(|axis| {
            let at = (place_m[axis] / self.cell_m).floor() as i64;
            let count = counts[axis] as i64;
            if self.wraps[axis] { at.rem_euclid(count) as usize } else { at.clamp(0, count - 1) as usize }
        });
        y * self.nx + x
    }

    /// Returns the height at a place, bilinear between the centres of cells.
    pub fn height_m(&self, place_m: [f64; 2]) -> f64 {
        self.between(place_m, |cell| self.ground[cell])
    }

    /// Returns a value of cells at a place, bilinear between their centres.
    pub fn between(&self, place_m: [f64; 2], value: impl Fn(usize) -> f64) -> f64 {
        let counts = [self.nx, self.ny];
        let [(x0, x1, u), (y0, y1, v)] = [0, 1].map(|axis| {
            let at = place_m[axis] / self.cell_m - 0.5;
            let (first, count) = (at.floor(), counts[axis] as i64);
            let index = |k: i64| (if self.wraps[axis] { k.rem_euclid(count) } else { k.clamp(0, count - 1) }) as usize;
            (index(first as i64), index(first as i64 + 1), at - first)
        });
        let at = |x: usize, y: usize| value(y * self.nx + x);
        (1.0 - v) * ((1.0 - u) * at(x0, y0) + u * at(x1, y0)) + v * ((1.0 - u) * at(x0, y1) + u * at(x1, y1))
    }

    /// Returns true if a place is in the world, or in a periodic one.
    pub fn holds(&self, place_m: [f64; 2]) -> bool {
        let counts = [self.nx, self.ny];
        [0, 1]
            .iter()
            .all(|&axis| self.wraps[axis] || (0.0..=counts[axis] as f64 * self.cell_m).contains(&place_m[axis]))
    }

    /// Removes a depth from a cell: debris first, then soil, then rock. Returns the volume that moves, in which rock
    /// has become `bulking` times as much.
    pub fn remove(&mut self, cell: usize, depth_m: f64, bulking: f64) -> f64 {
        let debris = depth_m.min(self.debris[cell]);
        self.debris[cell] -= debris;
        let mut soil = 0.0;
        if let Some(lies) = self.soil.get_mut(cell) {
            soil = (depth_m - debris).min(*lies);
            *lies -= soil;
        }
        let rock = depth_m - debris - soil;
        let rock = if rock > ROUNDING_M { rock } else { 0.0 };
        self.ground[cell] -= depth_m;
        self.scars[cell] += depth_m;
        self.ledger.again += debris * self.cell_m2();
        self.ledger.soil += soil * self.cell_m2();
        self.ledger.rock += rock * self.cell_m2();
        (debris + soil + bulking * rock) * self.cell_m2()
    }

    /// Moves debris from a cell to another.
    pub fn shift(&mut self, from: usize, to: usize, depth_m: f64) {
        self.ground[from] -= depth_m;
        self.debris[from] -= depth_m;
        self.ground[to] += depth_m;
        self.debris[to] += depth_m;
    }

    /// Adds debris to a cell.
    pub fn settle(&mut self, cell: usize, depth_m: f64) {
        self.ground[cell] += depth_m;
        self.debris[cell] += depth_m;
    }
}

/// The buffers of an event: empty between events.
pub(super) struct Room {
    /// True for cells that the flood of an event has visited.
    pub seen: Vec<bool>,
    /// Thickness of moving debris in each cell.
    pub moving: Vec<f64>,
    /// The highest surface from which debris has come to a cell: it does not rise above it.
    pub from_m: Vec<f64>,
    /// Thickness of moving debris times the elevation of its energy line.
    pub energy: Vec<f64>,
    /// Thickness that has settled in a cell.
    pub laid: Vec<f64>,
}

impl Room {
    /// # Errors
    /// [`OutOfMemory`].
    pub fn new(cells: usize) -> Result<Self, OutOfMemory> {
        let mut from_m: Vec<f64> = zeroed(cells)?;
        from_m.fill(f64::NEG_INFINITY);
        Ok(Self { seen: zeroed(cells)?, moving: zeroed(cells)?, from_m, energy: zeroed(cells)?, laid: zeroed(cells)? })
    }
}
