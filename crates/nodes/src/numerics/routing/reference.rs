//! Reference implementations for tests of flow routing: the simplest form of each algorithm, cell by cell.

use std::{cmp::Reverse, collections::BinaryHeap};

use super::code::STEPS;

/// Returns the neighbours inside a raster of `nx` columns, with their directions, without wrapping.
pub fn neighbours(nx: usize, len: usize, cell: usize) -> impl Iterator<Item = (usize, usize)> {
    STEPS.iter().enumerate().filter_map(move |(direction, &(dx, dy))| {
        let (x, y) = ((cell % nx) as i32 + dx, (cell / nx) as i32 + dy);
        let inside = x >= 0 && y >= 0 && x < nx as i32 && y < (len / nx) as i32;
        inside.then(|| (direction, y as usize * nx + x as usize))
    })
}

/// Returns true if a cell is on the border.
pub fn on_border(nx: usize, len: usize, cell: usize) -> bool {
    neighbours(nx, len, cell).count() < 8
}

/// Returns the surface filled by the priority flood (Barnes, Lehman and Mulla 2014) from the cells of `outlet`. Heights
/// must not be negative, so that their bits have the same order.
pub fn priority_flood(nx: usize, heights: &[f32], outlet: impl Fn(usize) -> bool) -> Vec<f32> {
    let mut filled = vec![f32::NAN; heights.len()];
    let mut queue = BinaryHeap::new();
    for cell in (0..heights.len()).filter(|&cell| outlet(cell)) {
        filled[cell] = heights[cell];
        queue.push(Reverse((heights[cell].to_bits(), cell)));
    }
    while let Some(Reverse((level, cell))) = queue.pop() {
        for (_, next) in neighbours(nx, heights.len(), cell) {
            if filled[next].is_nan() {
                filled[next] = heights[next].max(f32::from_bits(level));
                queue.push(Reverse((filled[next].to_bits(), next)));
            }
        }
    }
    filled
}

/// Returns the drainage area of each cell in cells, given its `receiver`. Returns None if receivers form a cycle.
pub fn accumulate(receiver: &[Option<usize>]) -> Option<Vec<u32>> {
    let mut cells = vec![0; receiver.len()];
    for source in 0..receiver.len() {
        let mut at = Some(source);
        for _ in 0..=receiver.len() {
            let Some(cell) = at else { break };
            cells[cell] += 1;
            at = receiver[cell];
        }
        if at.is_some() {
            return None;
        }
    }
    Some(cells)
}
