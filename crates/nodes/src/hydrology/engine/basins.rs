//! Depressions: how high they fill, and how their water gets out.
//!
//! The method of Cordonnier, Bovy and Braun (2019), "A versatile, linear complexity algorithm for flow routing in
//! topographies with depressions": cells that drain to the same pit are a basin; basins are linked by the lowest pass
//! between them; the minimum spanning tree of that graph, rooted outside, says through which pass each basin spills.
//! The highest pass on the way out is the basin's fill level, so that `max(height, level)` is the surface of the
//! priority flood (Barnes, Lehman and Mulla 2014), to the last bit. Heights are never changed.
//!
//! What differs from the paper: only cells of inner basins are ever visited (found upstream from the pits), so that a
//! landscape with few pits costs next to nothing; the tree is Borůvka's; passes of equal height are ordered by the
//! number of their link, which makes the tree unique.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use orograph_graph::{Job, NodeError};
use rayon::prelude::*;

use super::{
    Elevation, Grid, Outlet,
    code::{BORDER, LINK, OUTLET, PIT, TURNED, direction, opposite},
};

/// Label of the cells whose water leaves the world without crossing a depression.
const OUTSIDE: u32 = 0;
/// Directions that number the links of a cell; the other four belong to its neighbours.
const FORWARD: [usize; 4] = [0, 5, 6, 7];
/// Number, beside those of [`FORWARD`], of the link from a cell on an open side out of the world.
const LEAVES: u32 = 4;

/// The basins of a surface and where they spill. Its buffers are kept between uses.
#[derive(Debug)]
pub struct Depressions<T: Elevation> {
    labels: Vec<AtomicU32>,
    groups: Vec<Group>,
    spills: Vec<Spill<T>>,
}

/// Basins that are neighbours in the order of their pits, and their cells.
#[derive(Debug, Default)]
struct Group {
    /// Label of the first basin.
    first: u32,
    /// Cells, basin after basin, each from its pit upstream.
    cells: Vec<u32>,
    /// Where each basin's cells start, and where the last one's end.
    starts: Vec<usize>,
}

/// Where a basin spills.
#[derive(Clone, Copy, Debug)]
struct Spill<T> {
    level: T,
    /// The pass: number of the link.
    link: u32,
}

/// The lowest pass between two basins.
#[derive(Clone, Copy, Debug)]
struct Edge<P> {
    basins: [u32; 2],
    pass: P,
}

impl<T: Elevation> Default for Depressions<T> {
    fn default() -> Self {
        Self { labels: Vec::new(), groups: Vec::new(), spills: Vec::new() }
    }
}

impl<T: Elevation> Depressions<T> {
    /// Finds the basins of `heights`, whose receivers are `codes`, and where they spill.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn find(&mut self, job: &Job<'_>, grid: &Grid, heights: &[T], codes: &[u8]) -> Result<(), NodeError> {
        self.forget(grid);
        let pits = pits(job, grid, codes)?;
        if pits.is_empty() {
            return Ok(());
        }
        self.label(job, grid, codes, &pits)?;
        let edges = self.edges(job, grid, heights, codes)?;
        let tree = spanning_tree(job, pits.len() + 1, edges)?;
        self.spills = spills(pits.len() + 1, &tree);
        Ok(())
    }

    /// Number of depressions.
    #[must_use]
    pub fn count(&self) -> usize {
        self.spills.len().saturating_sub(1)
    }

    /// Turns the receivers of every basin's path from its pit to its pass around, so that water leaves through the
    /// pass: the course of a gorge that the spilling water would cut.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn carve(&self, job: &Job<'_>, grid: &Grid, codes: &mut [u8]) -> Result<(), NodeError> {
        for (basin, spill) in self.spills.iter().enumerate().skip(1) {
            if basin % 4096 == 0 {
                job.check()?;
            }
            let (cell, way) = (spill.link >> 3, spill.link & 7);
            let ends = if way == LEAVES {
                Some((cell, None))
            } else {
                let forward = FORWARD[way as usize];
                grid.neighbour(cell, forward).map(|far| {
                    if self.label_of(cell) == basin as u32 {
                        (cell, Some(forward))
                    } else {
                        (far, Some(opposite(forward)))
                    }
                })
            };
            let Some((mut cell, mut to)) = ends else { continue };
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

    /// Raises `heights` to the surface of standing water: the lowest surface above them from which every cell drains.
    pub fn fill(&self, heights: &mut [T]) {
        for group in &self.groups {
            for (at, span) in group.starts.windows(2).enumerate() {
                let level = self.spills[group.first as usize + at].level;
                for &cell in &group.cells[span[0]..span[1]] {
                    let height = &mut heights[cell as usize];
                    if *height < level {
                        *height = level;
                    }
                }
            }
        }
    }

    fn label_of(&self, cell: u32) -> u32 {
        self.labels[cell as usize].load(Relaxed)
    }

    /// Makes every cell's label [`OUTSIDE`].
    fn forget(&mut self, grid: &Grid) {
        if self.labels.len() == grid.cells() {
            self.groups.par_iter().flat_map_iter(|group| &group.cells).for_each(|&cell| {
                self.labels[cell as usize].store(OUTSIDE, Relaxed);
            });
        } else {
            self.labels = std::iter::repeat_with(|| AtomicU32::new(OUTSIDE)).take(grid.cells()).collect();
        }
        self.groups.clear();
        self.spills.clear();
    }

    /// Labels the cells that drain to each pit, upstream from it. A basin's label is the place of its pit, from 1.
    fn label(&mut self, job: &Job<'_>, grid: &Grid, codes: &[u8], pits: &[u32]) -> Result<(), NodeError> {
        let labels = &self.labels;
        let per_group = pits.len().div_ceil(64).max(32);
        self.groups = pits
            .par_chunks(per_group)
            .enumerate()
            .map(|(at, pits)| {
                let first = (at * per_group + 1) as u32;
                let mut group = Group { first, cells: Vec::new(), starts: vec![0] };
                for (basin, &pit) in (first..).zip(pits) {
                    let mut next = group.cells.len();
                    group.cells.push(pit);
                    while let Some(&cell) = group.cells.get(next) {
                        if next.is_multiple_of(8192) {
                            job.check()?;
                        }
                        next += 1;
                        labels[cell as usize].store(basin, Relaxed);
                        let code = codes[cell as usize];
                        for direction in 0..8 {
                            if let Some(donor) = grid.beside(cell, code, direction)
                                && codes[donor as usize] & LINK == opposite(direction) as u8
                            {
                                group.cells.push(donor);
                            }
                        }
                    }
                    group.starts.push(next);
                }
                Ok(group)
            })
            .collect::<Result<_, NodeError>>()?;
        Ok(())
    }

    /// The lowest pass between each two basins that touch.
    fn edges(&self, job: &Job<'_>, grid: &Grid, heights: &[T], codes: &[u8]) -> Result<Vec<Edge<T::Pass>>, NodeError> {
        let basins = self.groups.iter().map(|group| group.starts.len() - 1).sum::<usize>() + 1;
        let open = grid.has_open_side();
        let per_group: Vec<Vec<Edge<T::Pass>>> = self
            .groups
            .par_iter()
            .map_init(
                || vec![0_u32; basins],
                |slots, group| {
                    let mut edges: Vec<Edge<T::Pass>> = Vec::new();
                    for (basin, span) in (group.first..).zip(group.starts.windows(2)) {
                        job.check()?;
                        let start = edges.len();
                        // The edge to another basin, if this one has it yet: a slot of an older basin fails the check.
                        let mut meet = |other: u32, pass: T::Pass| {
                            let slot = start + slots[other as usize] as usize;
                            match edges.get_mut(slot) {
                                Some(edge) if edge.basins[1] == other => edge.pass = edge.pass.min(pass),
                                _ => {
                                    slots[other as usize] = (edges.len() - start) as u32;
                                    edges.push(Edge { basins: [basin, other], pass });
                                }
                            }
                        };
                        for &cell in &group.cells[span[0]..span[1]] {
                            let code = codes[cell as usize];
                            let height = heights[cell as usize];
                            for direction in 0..8 {
                                let Some(other) = grid.beside(cell, code, direction) else { continue };
                                let label = self.label_of(other);
                                if label < basin {
                                    let link = link(cell, other, direction);
                                    meet(label, height.pass(heights[other as usize], link));
                                }
                            }
                            if open && code & BORDER != 0 {
                                let (x, y) = (cell as usize % grid.nx, cell as usize / grid.nx);
                                if grid.outlet(x, y) == Outlet::Open {
                                    meet(OUTSIDE, height.pass(height, cell << 3 | LEAVES));
                                }
                            }
                        }
                    }
                    Ok(edges)
                },
            )
            .collect::<Result<_, NodeError>>()?;
        Ok(per_group.concat())
    }
}

/// The number of the link between two neighbours, the same from both sides.
#[inline(always)]
fn link(cell: u32, other: u32, way: usize) -> u32 {
    const NUMBER: [u32; 8] = [0, 1, 2, 3, 0, 1, 2, 3];
    let backward = (1..5).contains(&way);
    (if backward { other } else { cell }) << 3 | NUMBER[way]
}

/// The pits in the order of their cells.
fn pits(job: &Job<'_>, grid: &Grid, codes: &[u8]) -> Result<Vec<u32>, NodeError> {
    let rows: Vec<Vec<u32>> = codes
        .par_chunks(grid.nx * 8)
        .enumerate()
        .map(|(block, codes)| {
            job.check()?;
            let first = (block * grid.nx * 8) as u32;
            Ok((first..).zip(codes).filter(|(_, code)| *code & PIT != 0).map(|(cell, _)| cell).collect())
        })
        .collect::<Result<_, NodeError>>()?;
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

/// The representative of a basin's component, with path halving.
fn root(component: &mut [u32], mut basin: u32) -> u32 {
    while component[basin as usize] != basin {
        let above = component[basin as usize];
        component[basin as usize] = component[above as usize];
        basin = above;
    }
    basin
}

/// Walks the tree from the outside: through which pass each basin spills, and at which level.
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
    // Cells of a raster are connected, so that only the outside is left without a level.
    spills.iter().map(|spill| Spill { level: spill.level.unwrap_or(T::TOP), link: spill.link }).collect()
}
