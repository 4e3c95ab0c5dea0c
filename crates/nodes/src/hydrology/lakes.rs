//! Lakes as objects: which cells are one body of water.

use orograph_graph::{Job, NodeError};

use super::engine::Grid;

/// Directions to half of a cell's neighbours; the others have this cell among theirs.
const FORWARD: [usize; 4] = [0, 5, 6, 7];

/// The number of the lake that each cell is under, 0 on dry land. Cells under water that touch, across a corner too, are
/// one lake; lakes are numbered from 1 by their first cells, row by row from the north-west corner.
///
/// Numbers are exact up to 2^24, the whole numbers that a sample holds.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn numbers(job: &Job<'_>, grid: &Grid, depth: &[f32]) -> Result<Vec<f32>, NodeError> {
    // Every tree of cells has its first cell as its root.
    let mut above: Vec<u32> = (0..depth.len() as u32).collect();
    for y in 0..grid.ny {
        job.check()?;
        for cell in y * grid.nx..(y + 1) * grid.nx {
            if depth[cell] <= 0.0 {
                continue;
            }
            for direction in FORWARD {
                let next = grid.neighbour(cell as u32, direction);
                if let Some(next) = next.filter(|next| depth[*next as usize] > 0.0) {
                    let [a, b] = [cell as u32, next].map(|cell| root(&mut above, cell));
                    above[a.max(b) as usize] = a.min(b);
                }
            }
        }
    }
    let mut count = 0;
    let mut numbers = vec![0.0; depth.len()];
    for cell in 0..depth.len() {
        if cell.is_multiple_of(1 << 16) {
            job.check()?;
        }
        if depth[cell] > 0.0 {
            let first = root(&mut above, cell as u32) as usize;
            if first == cell {
                count += 1;
                numbers[cell] = count as f32;
            } else {
                numbers[cell] = numbers[first];
            }
        }
    }
    Ok(numbers)
}

/// The first cell of a tree, with path halving.
fn root(above: &mut [u32], mut cell: u32) -> u32 {
    while above[cell as usize] != cell {
        let next = above[above[cell as usize] as usize];
        above[cell as usize] = next;
        cell = next;
    }
    cell
}
