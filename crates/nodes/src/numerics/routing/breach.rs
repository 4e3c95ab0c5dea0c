//! Breaches depressions where the cut is small, and fills the others.
//!
//! Lindsay (2016), "Efficient hybrid breaching-filling sink removal methods for flow path enforcement in digital
//! elevation models": from a pit, the flow path is followed to the first ground that is not higher, and the cells
//! between are lowered to a straight line if the cut is neither too deep nor too long. The path follows the carved
//! receivers: over the lowest pass, then downhill.
//!
//! Differences from the paper: depressions are processed from the outside in along the tree of passes instead of a
//! priority flood, so that nothing is sorted; a cut passes neither through a filled lake nor its sill; the border of
//! the world is never cut, since it is base level. Paths longer than the longest cut are abandoned, so the work is
//! bounded by the number of pits times that length.

use orograph_graph::{Job, NodeError};

use super::{
    Depressions, Grid,
    code::{self, has_receiver},
    exits::Exit,
};
use crate::numerics::par;

/// Limits of cuts.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Maximum lowering of a cell, in metres.
    pub depth_m: f64,
    /// The longest cut from a pit to lower ground, in metres.
    pub length_m: f64,
    /// Side of a cell in metres.
    pub cell_m: f64,
}

/// The terrain during breaching and filling.
struct Ground<'a> {
    labels: &'a [u32],
    heights: &'a [f32],
    /// Heights after cutting.
    bed: Vec<f32>,
    /// Level of each filled basin; −∞ for the others.
    levels: Vec<f32>,
    /// True for the sills of filled lakes.
    sills: Vec<bool>,
}

impl Ground<'_> {
    /// Height of terrain or standing water. Cuts end at standing water, so that they never drain it.
    fn surface(&self, cell: u32) -> f32 {
        let (bed, level) = (self.bed[cell as usize], self.levels[self.labels[cell as usize] as usize]);
        if bed < level { level } else { bed }
    }
}

impl Depressions<f32> {
    /// Returns `heights` with depressions breached within limits and otherwise filled. The result never rises along
    /// `codes`, the carved receivers.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn breach(
        &self,
        job: &Job<'_>,
        grid: &Grid,
        heights: &[f32],
        codes: &[u8],
        limits: Limits,
    ) -> Result<Vec<f32>, NodeError> {
        if self.pits.is_empty() {
            return Ok(heights.to_vec());
        }
        let mut ground = Ground {
            labels: &self.labels,
            heights,
            bed: heights.to_vec(),
            levels: vec![f32::NEG_INFINITY; self.spills.len()],
            sills: vec![false; heights.len()],
        };
        let exits = self.exits(grid);
        let mut way = Vec::new();
        for (done, basin) in self.outside_in(&exits).into_iter().enumerate() {
            if done.is_multiple_of(256) {
                job.check()?;
            }
            let pit = self.pits[basin as usize - 1];
            if !cut(&mut ground, grid, codes, pit, limits, &mut way) {
                let Exit { near, far, .. } = exits[basin as usize - 1];
                let sill = far.filter(|far| ground.surface(*far) > ground.surface(near)).unwrap_or(near);
                ground.levels[basin as usize] = ground.surface(sill);
                ground.sills[sill as usize] = true;
            }
        }
        Ok(par::map(heights.len(), |cell| ground.surface(cell as u32)))
    }
}

/// Cuts the path from a pit to ground that is not higher. Returns true if the cut is within the limits; otherwise
/// nothing changes.
fn cut(
    ground: &mut Ground<'_>,
    grid: &Grid,
    codes: &[u8],
    pit: u32,
    limits: Limits,
    way: &mut Vec<(u32, f64)>,
) -> bool {
    let from = ground.bed[pit as usize];
    let deepest = f64::from(from) + limits.depth_m;
    way.clear();
    let (mut cell, mut length) = (pit, 0.0);
    let to = loop {
        let code = codes[cell as usize];
        if !has_receiver(code) {
            return false;
        }
        length += limits.cell_m * code::length(code);
        cell = grid.receiver(cell, code);
        let surface = ground.surface(cell);
        if surface <= from {
            break surface;
        }
        let too_much = length > limits.length_m || f64::from(ground.heights[cell as usize]) > deepest;
        if too_much || surface > ground.bed[cell as usize] || ground.sills[cell as usize] {
            return false;
        }
        way.push((cell, length));
    };
    if length > limits.length_m {
        return false;
    }
    let drop = f64::from(to) - f64::from(from);
    let line = |at: f64| (f64::from(from) + drop * (at / length)) as f32;
    let too_deep =
        |&(cell, at): &(u32, f64)| f64::from(ground.heights[cell as usize]) - f64::from(line(at)) > limits.depth_m;
    if way.iter().any(too_deep) {
        return false;
    }
    for &(cell, at) in way.iter() {
        ground.bed[cell as usize] = line(at);
    }
    true
}
