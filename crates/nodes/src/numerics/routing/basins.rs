//! Depressions: their fill levels and outlets.
//!
//! The method of Cordonnier, Bovy and Braun (2019), "A versatile, linear complexity algorithm for flow routing in
//! topographies with depressions": cells that drain to the same pit form a basin; basins are linked by the lowest pass
//! between them; the minimum spanning tree of that graph, rooted at the cells that drain out of the world, gives the
//! pass through which each basin spills. The highest pass on the way out is the basin's fill level, so that
//! `max(height, level)` equals the surface of the priority flood (Barnes, Lehman and Mulla 2014) bit for bit. Heights
//! are never changed.
//!
//! Differences from the paper: basins are labelled upstream from the pits; a local test drops most links (see the
//! module `passes`), so that terrain with few pits costs little; the tree is Borůvka's; passes of equal height are
//! ordered by the number of their link, which makes the tree unique.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use orograph_graph::{Job, NodeError};

use super::{
    Elevation, Grid,
    code::{BORDER, OUTLET, PIT, TURNED, direction, opposite},
    donors,
    passes::{self, Edge, FORWARD, LEAVES},
};
use crate::numerics::par;

/// Label of cells that drain out of the world without crossing a depression.
pub const OUTSIDE: u32 = 0;

/// The basins of a surface and their outlets. Buffers are reused between calls.
#[derive(Debug)]
pub struct Depressions<T: Elevation> {
    /// The basin of each cell: the index of its pit, from 1, or [`OUTSIDE`]. Undefined if there are no pits.
    pub(super) labels: Vec<u32>,
    /// The donors of each cell, as a set of directions.
    pub(super) donors: Vec<u8>,
    /// The pit of each basin, without the outside.
    pub(super) pits: Vec<u32>,
    pub(super) spills: Vec<Spill<T>>,
}

/// The outlet of a basin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spill<T> {
    pub(super) level: T,
    /// Number of the link that is the pass.
    pub(super) link: u32,
}

impl<T: Elevation> Default for Depressions<T> {
    fn default() -> Self {
        Self { labels: Vec::new(), donors: Vec::new(), pits: Vec::new(), spills: Vec::new() }
    }
}

impl<T: Elevation> Depressions<T> {
    /// Finds the basins of `heights` and their outlets. `codes` are the receivers.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn find(&mut self, job: &Job<'_>, grid: &Grid, heights: &[T], codes: &[u8]) -> Result<(), NodeError> {
        self.spills.clear();
        self.pits.clear();
        let pits = pits(job, grid, codes)?;
        if pits.is_empty() {
            return Ok(());
        }
        self.label(job, grid, codes, &pits)?;
        let edges = passes::find(job, grid, heights, &self.labels)?;
        let tree = spanning_tree(job, pits.len() + 1, edges)?;
        self.spills = spills(pits.len() + 1, &tree);
        self.pits = pits;
        Ok(())
    }

    /// Number of depressions.
    #[must_use]
    pub fn count(&self) -> usize {
        self.spills.len().saturating_sub(1)
    }

    /// Reverses the receivers along the path from each basin's pit to its pass, so that water leaves through the pass,
    /// along the course of the gorge that spilling water would cut.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn carve(&self, job: &Job<'_>, grid: &Grid, codes: &mut [u8]) -> Result<(), NodeError> {
        for (basin, spill) in self.spills.iter().enumerate().skip(1) {
            if basin % 4096 == 0 {
                job.check()?;
            }
            let Some((mut cell, mut to)) = self.pass(grid, basin, spill.link) else { continue };
            loop {
                let code = codes[cell as usize];
                let next = (code & PIT == 0).then(|| (grid.receiver(cell, code), opposite(direction(code))));
                codes[cell as usize] = code & BORDER | to.map_or(OUTLET, |way| way as u8 | TURNED);
                let Some((downstream, back)) = next else { break };
                (cell, to) = (downstream, Some(back));
            }
        }
        Ok(())
    }

    /// Returns the last cell of a basin before the link through which it drains, and the direction from there, which is
    /// None where water leaves the world.
    pub(super) fn pass(&self, grid: &Grid, basin: usize, link: u32) -> Option<(u32, Option<usize>)> {
        let (cell, way) = (link >> 3, link & 7);
        if way == LEAVES {
            return Some((cell, None));
        }
        let forward = FORWARD[way as usize];
        let far = grid.neighbour(cell, forward)?;
        let inside = self.labels[cell as usize] == basin as u32;
        Some(if inside { (cell, Some(forward)) } else { (far, Some(opposite(forward))) })
    }

    /// Raises `heights` to the surface of standing water: the lowest surface above them from which every cell drains.
    pub fn fill(&self, heights: &mut [T]) {
        if self.spills.is_empty() {
            return;
        }
        par::change_with(heights, &self.labels, |height, &label| {
            let level = self.spills[label as usize].level;
            if label != OUTSIDE && *height < level {
                *height = level;
            }
        });
    }

    /// Labels all cells upstream of each pit.
    fn label(&mut self, job: &Job<'_>, grid: &Grid, codes: &[u8], pits: &[u32]) -> Result<(), NodeError> {
        self.donors.resize(grid.cells(), 0);
        donors::sums(job, grid, codes, donors::BITS, &mut self.donors)?;
        self.labels.clear();
        self.labels.resize(grid.cells(), OUTSIDE);
        // basins are disjoint, so the order of the stores does not matter
        let labels: Vec<AtomicU32> = std::mem::take(&mut self.labels).into_iter().map(AtomicU32::new).collect();
        let per_group = pits.len().div_ceil(64).max(32);
        let done = par::each(pits.chunks(per_group), |group, pits| {
            // first in, first out, so that a cell does not depend on the loads of the one before it
            let mut queue = vec![0_u32; 64];
            for (basin, &pit) in ((group * per_group + 1) as u32..).zip(pits) {
                queue[0] = pit;
                let (mut next, mut end) = (0, 1);
                while next < end {
                    let cell = queue[next];
                    next += 1;
                    if next.is_multiple_of(8192) {
                        job.check()?;
                    }
                    if end + 8 > queue.len() {
                        queue.resize(2 * queue.len(), 0);
                    }
                    labels[cell as usize].store(basin, Relaxed);
                    let code = codes[cell as usize];
                    let from = self.donors[cell as usize];
                    // branch-free: every neighbour is written, and the next one overwrites those that are not donors
                    for direction in 0..8 {
                        if let Some(donor) = grid.beside(cell, code, direction) {
                            queue[end] = donor;
                            end += usize::from(from >> direction & 1);
                        }
                    }
                }
            }
            Ok(())
        });
        self.labels = labels.into_iter().map(AtomicU32::into_inner).collect();
        done
    }
}

/// Returns the pits in ascending order of their cells.
fn pits(job: &Job<'_>, grid: &Grid, codes: &[u8]) -> Result<Vec<u32>, NodeError> {
    let rows = par::collect(codes.chunks(grid.nx * 8), |block, codes| {
        job.check()?;
        let first = (block * grid.nx * 8) as u32;
        let pits = (first..).zip(codes).filter(|(_, code)| *code & PIT != 0).map(|(cell, _)| cell);
        Ok::<_, NodeError>(pits.collect::<Vec<u32>>())
    })?;
    Ok(rows.concat())
}

/// Borůvka's minimum spanning tree: every component takes its lowest edge until there is one component.
fn spanning_tree<P: Copy + Ord>(
    job: &Job<'_>,
    basins: usize,
    mut edges: Vec<Edge<P>>,
) -> Result<Vec<Edge<P>>, NodeError> {
    let mut tree = Vec::with_capacity(basins - 1);
    let mut component: Vec<u32> = (0..basins as u32).collect();
    let mut lowest: Vec<Option<(P, u32)>> = vec![None; basins];
    while !edges.is_empty() {
        job.check()?;
        for (at, edge) in edges.iter().enumerate() {
            for basin in edge.basins {
                let best = &mut lowest[component[basin as usize] as usize];
                if best.is_none_or(|(pass, _)| edge.pass < pass) {
                    *best = Some((edge.pass, at as u32));
                }
            }
        }
        for best in &mut lowest {
            let Some((_, at)) = best.take() else { continue };
            let edge = edges[at as usize];
            let [a, b] = edge.basins.map(|basin| root(&mut component, basin));
            if a != b {
                component[a.max(b) as usize] = a.min(b);
                tree.push(edge);
            }
        }
        for basin in 0..basins as u32 {
            component[basin as usize] = root(&mut component, basin);
        }
        edges.retain(|edge| component[edge.basins[0] as usize] != component[edge.basins[1] as usize]);
    }
    Ok(tree)
}

/// Returns the representative of a basin's component, with path halving.
fn root(component: &mut [u32], mut basin: u32) -> u32 {
    while component[basin as usize] != basin {
        let above = component[basin as usize];
        component[basin as usize] = component[above as usize];
        basin = above;
    }
    basin
}

/// Traverses the tree from the outside. Returns the pass and the level at which each basin spills.
fn spills<T: Elevation>(basins: usize, tree: &[Edge<T::Pass>]) -> Vec<Spill<T>> {
    let mut starts = vec![0_u32; basins + 1];
    for edge in tree {
        edge.basins.iter().for_each(|&basin| starts[basin as usize + 1] += 1);
    }
    for basin in 0..basins {
        starts[basin + 1] += starts[basin];
    }
    let mut free = starts.clone();
    let mut links = vec![0_u32; 2 * tree.len()];
    for (at, edge) in tree.iter().enumerate() {
        for basin in edge.basins {
            links[free[basin as usize] as usize] = at as u32;
            free[basin as usize] += 1;
        }
    }
    let outside = Spill { level: None, link: 0 };
    let mut spills: Vec<Spill<Option<T>>> = vec![outside; basins];
    let mut reached = vec![OUTSIDE];
    let mut next = 0;
    while let Some(&basin) = reached.get(next) {
        next += 1;
        let level = spills[basin as usize].level;
        for &at in &links[starts[basin as usize] as usize..starts[basin as usize + 1] as usize] {
            let edge = &tree[at as usize];
            let other = if edge.basins[0] == basin { edge.basins[1] } else { edge.basins[0] };
            if other == OUTSIDE || spills[other as usize].level.is_some() {
                continue;
            }
            let pass = T::pass_height(edge.pass);
            let level = level.map_or(pass, |level| if level > pass { level } else { pass });
            spills[other as usize] = Spill { level: Some(level), link: T::pass_link(edge.pass) };
            reached.push(other);
        }
    }
    // the cells of a raster are connected, so that only the outside has no level
    spills.iter().map(|spill| Spill { level: spill.level.unwrap_or(T::TOP), link: spill.link }).collect()
}
