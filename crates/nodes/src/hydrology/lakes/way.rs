//! The direction in which water moves: on lakes along the shortest way over the water to the spill point.
//!
//! The length T of that way solves the eikonal equation |∇T| = 1 from the sill inwards. Cells are ordered by their
//! chamfer distance (Borgefors 1986) in bucket queues, and updated twice in that order with the upwind scheme of
//! Sethian (1996), or across a corner, where only that leads on. Both are O(N). The direction is −∇T, by the same
//! differences.

use orograph_graph::{
    Job, NodeError,
    memory::{filled, zeroed},
};

use super::find::Lakes;
use crate::numerics::{
    eikonal::upwind,
    par,
    routing::{
        Grid,
        code::{STEPS, direction, has_receiver, is_diagonal},
    },
};

/// Lengths of steps across a side and a corner in the chamfer distance, and a number of queues above the longer one.
const CHAMFER: [usize; 2] = [5, 7];
const QUEUES: usize = 8;

/// Returns the unit vectors to the east of all cells, then those to the south.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub(super) fn directions(job: &Job<'_>, grid: &Grid, lakes: &Lakes, codes: &[u8]) -> Result<Vec<f32>, NodeError> {
    let order = order(job, grid, lakes)?;
    let mut lengths = filled(grid.cells(), f32::INFINITY)?;
    for _ in 0..2 {
        for cells in order.chunks(1 << 14) {
            job.check()?;
            for &cell in cells {
                let (length, _) = Upwind::new(grid, lakes, &lengths, cell).solve();
                let own = &mut lengths[cell as usize];
                *own = own.min(length);
            }
        }
    }
    drop(order);
    let mut out: Vec<f32> = zeroed(2 * grid.cells())?;
    let (east, south) = out.split_at_mut(grid.cells());
    par::each(east.chunks_mut(grid.nx).zip(south.chunks_mut(grid.nx)), |j, (east, south)| {
        job.check()?;
        for (i, (east, south)) in east.iter_mut().zip(south).enumerate() {
            let cell = j * grid.nx + i;
            let towards = match lakes.at(cell) {
                Some(_) => Upwind::new(grid, lakes, &lengths, cell as u32).solve().1,
                None if has_receiver(codes[cell]) => unit(STEPS[direction(codes[cell])]),
                None => [0.0; 2],
            };
            [*east, *south] = towards;
        }
        Ok::<_, NodeError>(())
    })?;
    Ok(out)
}

/// Returns the cells of all lakes, those of each lake by distance from its sill.
fn order(job: &Job<'_>, grid: &Grid, lakes: &Lakes) -> Result<Vec<u32>, NodeError> {
    let mut distances = filled(grid.cells(), u32::MAX)?;
    let mut queues: [Vec<u32>; QUEUES] = Default::default();
    let mut order = Vec::new();
    let reach = |from: u32, number: u32, reached: usize, distances: &mut [u32], queues: &mut [Vec<u32>; QUEUES]| {
        for way in 0..STEPS.len() {
            let Some(next) = grid.neighbour(from, way) else { continue };
            let there = reached + CHAMFER[usize::from(is_diagonal(way))];
            if lakes.of[next as usize] == number && (there as u32) < distances[next as usize] {
                distances[next as usize] = there as u32;
                queues[there % QUEUES].push(next);
            }
        }
    };
    for (number, lake) in (1..).zip(&lakes.all) {
        reach(lake.sill, number, 0, &mut distances, &mut queues);
    }
    let mut reached = 0;
    while queues.iter().any(|queue| !queue.is_empty()) {
        job.check()?;
        for cell in std::mem::take(&mut queues[reached % QUEUES]) {
            if distances[cell as usize] as usize == reached {
                order.push(cell);
                reach(cell, lakes.of[cell as usize], reached, &mut distances, &mut queues);
            }
        }
        reached += 1;
    }
    Ok(order)
}

/// The lengths around a cell of a lake, in cells: for each axis and for the corners the least one, with its direction.
struct Upwind {
    sides: [(f32, usize); 2],
    corner: (f32, usize),
}

impl Upwind {
    fn new(grid: &Grid, lakes: &Lakes, lengths: &[f32], cell: u32) -> Self {
        let number = lakes.of[cell as usize];
        let sill = lakes.at(cell as usize).map(|lake| lake.sill);
        let mut around = Self { sides: [(f32::INFINITY, 0); 2], corner: (f32::INFINITY, 0) };
        for way in 0..STEPS.len() {
            let length = match grid.neighbour(cell, way) {
                Some(next) if Some(next) == sill => 0.0,
                Some(next) if lakes.of[next as usize] == number => lengths[next as usize],
                _ => continue,
            };
            let least = if is_diagonal(way) { &mut around.corner } else { &mut around.sides[way / 2 % 2] };
            if length < least.0 {
                *least = (length, way);
            }
        }
        around
    }

    /// Returns the length of the way from the cell, and its direction.
    fn solve(&self) -> (f32, [f32; 2]) {
        let [(one, way), (other, _)] = self.sides;
        let across = self.corner.0 + std::f32::consts::SQRT_2;
        let (least, way) = if one <= other { (one, way) } else { self.sides[1] };
        if least == f32::INFINITY && across == f32::INFINITY {
            return (f32::INFINITY, [0.0; 2]);
        }
        let length = upwind(one, other);
        if across < length {
            return (across, unit(STEPS[self.corner.1]));
        }
        if (one - other).abs() >= 1.0 {
            return (length, unit(STEPS[way]));
        }
        let mut towards = [0.0; 2];
        for (length_there, way) in self.sides {
            let (east, south) = STEPS[way];
            let fall = length - length_there;
            towards[0] += fall * east as f32;
            towards[1] += fall * south as f32;
        }
        let norm = (towards[0] * towards[0] + towards[1] * towards[1]).sqrt();
        (length, towards.map(|v| v / norm))
    }
}

/// Returns the unit vector of a step.
fn unit((east, south): (i32, i32)) -> [f32; 2] {
    let scale = if east != 0 && south != 0 { std::f32::consts::FRAC_1_SQRT_2 } else { 1.0 };
    [scale * east as f32, scale * south as f32]
}
