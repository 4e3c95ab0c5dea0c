//! Selects the level of detail of each part of the terrain: a quadtree with continuous levels (CDLOD).
//!
//! F. Strugar, 2010, Continuous distance-dependent level of detail for rendering heightmaps. A tile of level `l` has 16
//! x 16 squares of `2^l` patches of the surface. Level `l` is used up to the distance `r_l = r_0 2^l`. Over the last
//! part of this range the odd vertices of a tile slide to their even neighbours, so that at `r_l` it equals the tile of
//! the next level; there are neither cracks nor jumps.
//!
//! Differences from the paper: distances are horizontal, with the height of the camera above the highest terrain as the
//! third coordinate, the same for tiles and vertices. The paper's condition on the ranges (a tile must not cross a
//! whole band) then depends on horizontal lengths only, so that steep or exaggerated terrain cannot violate it.
//!
//! If part of the terrain has finer cells ([`super::inset`]), grid lines are denser by the same factor everywhere. The
//! levels below the coarse ones are only used near the camera, so that one mesh covers both and has no cracks along the
//! edge of the inset.

use glam::DVec3;

use super::{
    bounds::{Bounds, LEAF},
    camera::Camera,
};

/// Squares along the side of a tile.
pub(super) const TILE: u32 = 16;
/// Patches along the side of a quadtree node of level 0: two tiles.
const NODE: u32 = 2 * TILE;
/// Level of the bounds pyramid that corresponds to a node of level 0.
const NODE_BOUNDS: u32 = NODE.ilog2() - LEAF;
/// Level of the bounds pyramid that corresponds to a tile of level 0.
const TILE_BOUNDS: u32 = TILE.ilog2() - LEAF;
/// Start and end of sliding, as fractions of a level's range. The end is below 1, so that in spite of rounding a vertex
/// has arrived wherever its neighbour is of the next level.
const SLIDE: [f64; 2] = [0.7, 0.98];
/// Minimum range of level 0 in patches: the diagonal of a node must fit between the end of a level and the start of
/// sliding in the next, `r_0 + 32 √2 <= 0.7 · 2 r_0`.
const LEAST_RANGE: f64 = 120.0;

/// A tile to draw.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(super) struct Tile {
    /// First grid line along x and y.
    pub(super) origin: [u32; 2],
    /// Level of detail.
    pub(super) level: u32,
    /// For a wall, the side of the terrain: 0 west, 1 east, 2 north, 3 south.
    pub(super) side: u32,
    /// Distance at which vertices begin to slide, and the progress (0 to 1) per metre beyond it.
    pub(super) slide: [f32; 2],
}

/// The tiles and walls to draw.
#[derive(Clone, Debug, Default)]
pub(super) struct Selection {
    /// Tiles of the surface.
    pub(super) tiles: Vec<Tile>,
    /// Tiles at the edge of the terrain, one entry for each side of it.
    pub(super) walls: Vec<Tile>,
}

/// The terrain, as needed for the selection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ground<'a> {
    /// Bounds of heights.
    pub(super) bounds: &'a Bounds,
    /// Cells along x and y.
    pub(super) cells: [u32; 2],
    /// Side of a cell in metres.
    pub(super) cell_m: f64,
    /// Grid lines per cell, as a power of two.
    pub(super) finer: u32,
    /// Vertical exaggeration.
    pub(super) exaggeration: f64,
    /// Exaggerated elevation of the bottom of the walls.
    pub(super) base: f64,
    /// Elevation of the sea: except for walls, nothing below it is drawn.
    pub(super) sea_level: Option<f64>,
}

/// The height of the camera above the highest terrain, the third coordinate of every distance. Never negative.
pub(super) fn eye_above(ground: &Ground<'_>, camera: &Camera) -> f64 {
    let [_, high] = ground.heights(ground.bounds.top() + ground.finer, 0, 0).unwrap_or([0.0; 2]);
    (camera.eye.y - high).max(0.0)
}

/// Selects the visible tiles. `detail_px` is the target length of a triangle's side in pixels.
pub(super) fn select(ground: &Ground<'_>, camera: &Camera, size: [u32; 2], detail_px: f64) -> Selection {
    let patches = ground.last_line(0).max(ground.last_line(1));
    let top = patches.div_ceil(NODE).next_power_of_two().ilog2();
    let focal_px = f64::from(size[1].max(1)) * 0.5 / camera.half_extent(size)[1];
    // a level begins at half its range, where its triangles are largest on the screen
    let step_m = ground.cell_m / f64::from(1_u32 << ground.finer);
    let least_m = LEAST_RANGE * step_m;
    let range_m = (2.0 * step_m * focal_px / detail_px.max(0.25)).max(least_m);
    let mut walk = Walk {
        ground,
        range_m,
        top,
        above: eye_above(ground, camera),
        eye: camera.eye,
        planes: planes(camera, size),
        out: Selection::default(),
    };
    walk.node(top, 0, 0);
    walk.out
}

impl Ground<'_> {
    /// Lowest and highest height of a square of a level, counted from the finest grid lines.
    fn heights(&self, level: u32, i: u32, j: u32) -> Option<[f64; 2]> {
        // squares smaller than those of the pyramid get the bounds of its smallest
        let up = self.finer.saturating_sub(level);
        let range = self.bounds.range(level.saturating_sub(self.finer), i >> up, j >> up)?;
        let sea = self.sea_level.unwrap_or(f64::NEG_INFINITY);
        Some(range.map(|height| f64::from(height).max(sea) * self.exaggeration))
    }

    /// The first grid line on the far edge of the terrain; all later lines lie on it too.
    pub(super) fn last_line(&self, axis: usize) -> u32 {
        (self.cells[axis] << self.finer) + ((1 << self.finer) / 2).max(1)
    }

    /// Returns true if a tile overlaps a rectangle: west, north, east and south side in metres.
    pub(super) fn meets(&self, tile: &Tile, [west, north, east, south]: [f64; 4]) -> bool {
        let [[x0, x1], [y0, y1]] = self.sides(tile);
        x1 >= west && x0 <= east && y1 >= north && y0 <= south
    }

    /// Returns true if a tile lies within a rectangle, however far its odd vertices have slid.
    pub(super) fn lies_in(&self, tile: &Tile, [west, north, east, south]: [f64; 4]) -> bool {
        let [[x0, x1], [y0, y1]] = self.sides(tile);
        x0 > west && x1 < east && y0 > north && y1 < south
    }

    /// The sides of a tile in metres: west and east, then north and south.
    fn sides(&self, tile: &Tile) -> [[f64; 2]; 2] {
        [0, 1].map(|axis| [0, TILE << tile.level].map(|after| self.line_m(axis, tile.origin[axis] + after)))
    }

    /// Position of a grid line in metres.
    pub(super) fn line_m(&self, axis: usize, line: u32) -> f64 {
        let line = f64::from(line) / f64::from(1_u32 << self.finer);
        (line - 0.5).clamp(0.0, f64::from(self.cells[axis])) * self.cell_m
    }
}

struct Walk<'a> {
    ground: &'a Ground<'a>,
    range_m: f64,
    top: u32,
    above: f64,
    eye: DVec3,
    /// Inward normals of the sides of the view frustum.
    planes: [DVec3; 4],
    out: Selection,
}

impl Walk<'_> {
    /// Selects the tiles below a node.
    fn node(&mut self, level: u32, i: u32, j: u32) {
        let Some((low, high)) = self.extent(level, NODE, NODE_BOUNDS, i, j) else { return };
        if !self.seen(low, high) {
            return;
        }
        for (di, dj) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (ci, cj) = (2 * i + di, 2 * j + dj);
            // a quadrant of a node is a tile of its level and a node of the next finer level
            if level > 0 && self.within(level - 1, ci, cj) {
                self.node(level - 1, ci, cj);
            } else {
                self.tile(level, ci, cj);
            }
        }
    }

    fn tile(&mut self, level: u32, i: u32, j: u32) {
        let Some((low, high)) = self.extent(level, TILE, TILE_BOUNDS, i, j) else { return };
        if !self.seen(low, high) {
            return;
        }
        let slide = if level >= self.top {
            [f32::MAX, 0.0]
        } else {
            let range = self.range_m * f64::from(1_u32 << level);
            [SLIDE[0] * range, 1.0 / ((SLIDE[1] - SLIDE[0]) * range)].map(|v| v as f32)
        };
        let span = TILE << level;
        let tile = Tile { origin: [i * span, j * span], level, side: 0, slide };
        self.out.tiles.push(tile);
        let at_last = |axis: usize| tile.origin[axis] + span >= self.ground.last_line(axis);
        let at_edge = [i == 0, at_last(0), j == 0, at_last(1)];
        for (side, _) in (0..).zip(at_edge).filter(|(_, at)| *at) {
            self.out.walls.push(Tile { side, ..tile });
        }
    }

    /// Returns true if a node is closer than the range of its level.
    fn within(&self, level: u32, i: u32, j: u32) -> bool {
        let Some((low, high)) = self.extent(level, NODE, NODE_BOUNDS, i, j) else { return false };
        let away = (low - self.eye).max(self.eye - high).max(DVec3::ZERO);
        let square = away.x * away.x + away.z * away.z + self.above * self.above;
        let range = self.range_m * f64::from(1_u32 << level);
        square <= range * range
    }

    /// The bounding box of a square of the terrain, down to the base if it has walls.
    fn extent(&self, level: u32, side: u32, bounds: u32, i: u32, j: u32) -> Option<(DVec3, DVec3)> {
        let ground = self.ground;
        let span = u64::from(side) << level;
        let first = [u64::from(i) * span, u64::from(j) * span];
        let end = [0, 1].map(|axis| u64::from(ground.last_line(axis)));
        if first[0] >= end[0] || first[1] >= end[1] {
            return None;
        }
        let [low, high] = ground.heights(level + bounds, i, j)?;
        let last = [0, 1].map(|axis| (first[axis] + span).min(end[axis]) as u32);
        let first = first.map(|line| line as u32);
        let edge = (0..2).any(|axis| first[axis] == 0 || u64::from(last[axis]) == end[axis]);
        let low = if edge { low.min(ground.base) } else { low };
        Some((
            DVec3::new(ground.line_m(0, first[0]), low, ground.line_m(1, first[1])),
            DVec3::new(ground.line_m(0, last[0]), high, ground.line_m(1, last[1])),
        ))
    }

    /// Returns true if a box may be visible.
    fn seen(&self, low: DVec3, high: DVec3) -> bool {
        let (low, high) = (low - self.eye, high - self.eye);
        self.planes.iter().all(|normal| {
            let pick = |n: f64, l: f64, h: f64| if n > 0.0 { h } else { l };
            let corner =
                DVec3::new(pick(normal.x, low.x, high.x), pick(normal.y, low.y, high.y), pick(normal.z, low.z, high.z));
            normal.dot(corner) >= 0.0
        })
    }
}

/// Inward normals of the four side planes of the view frustum.
fn planes(camera: &Camera, size: [u32; 2]) -> [DVec3; 4] {
    let [tx, ty] = camera.half_extent(size);
    let (right, up, forward) = (camera.right(), camera.up(), camera.forward);
    [forward * tx + right, forward * tx - right, forward * ty + up, forward * ty - up]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCREEN: [u32; 2] = [1920, 1080];

    fn bounds(cells: [usize; 2]) -> Bounds {
        Bounds::new(cells, |x, y| ((x / 64) % 7) as f32 * 300.0 + ((y / 32) % 5) as f32 * 100.0)
    }

    fn ground(bounds: &Bounds, cells: [u32; 2]) -> Ground<'_> {
        Ground { bounds, cells, cell_m: 10.0, finer: 0, exaggeration: 1.0, base: -500.0, sea_level: None }
    }

    /// Cameras far above, in the middle of the terrain, in a corner, and near the ground.
    fn cameras(side_m: f64) -> Vec<Camera> {
        let middle = DVec3::new(0.5 * side_m, 1000.0, 0.5 * side_m);
        [
            DVec3::new(0.5 * side_m, 3.0 * side_m, 0.6 * side_m),
            DVec3::new(0.5 * side_m, 2500.0, 1.8 * side_m),
            DVec3::new(-0.2 * side_m, 6000.0, -0.3 * side_m),
            DVec3::new(0.3 * side_m, 2300.0, 0.8 * side_m),
            DVec3::new(0.45 * side_m, 2220.0, 0.55 * side_m),
        ]
        .map(|eye| Camera::looking_at(eye, middle, 0.7))
        .to_vec()
    }

    #[test]
    fn large_land_keeps_within_its_triangles() {
        let cells = [4096, 4096];
        let bounds = bounds([4096, 4096]);
        let triangles = |camera: &Camera| {
            let selection = select(&ground(&bounds, cells), camera, SCREEN, 4.0);
            selection.tiles.len() * 2 * (TILE * TILE) as usize
        };
        let counts: Vec<usize> = cameras(40_960.0).iter().map(triangles).collect();
        // full detail would be 33 million
        assert!(counts.iter().all(|count| (10_000..2_500_000).contains(count)), "{counts:?}");
    }

    #[test]
    fn tiles_cover_what_is_seen_once() {
        for cells in [[100, 100], [33, 700], [1, 1], [511, 512]] {
            let bounds = bounds(cells.map(|n: u32| n as usize));
            let ground = ground(&bounds, cells);
            // high enough above to see everything
            let middle = DVec3::new(f64::from(cells[0]) * 5.0, 0.0, f64::from(cells[1]) * 5.0);
            let camera = Camera::looking_at(middle + DVec3::new(0.0, 90_000.0, 10.0), middle, 0.7);
            for detail_px in [0.25, 4.0] {
                let selection = select(&ground, &camera, SCREEN, detail_px);
                let mut covered = vec![0_u8; ((cells[0] + 1) * (cells[1] + 1)) as usize];
                for tile in &selection.tiles {
                    let span = TILE << tile.level;
                    for y in tile.origin[1]..(tile.origin[1] + span).min(cells[1] + 1) {
                        for x in tile.origin[0]..(tile.origin[0] + span).min(cells[0] + 1) {
                            covered[(y * (cells[0] + 1) + x) as usize] += 1;
                        }
                    }
                }
                assert!(covered.iter().all(|times| *times == 1), "{cells:?}");
                assert!((0..4).all(|side| selection.walls.iter().any(|wall| wall.side == side)));
            }
        }
    }

    #[test]
    fn neighbours_differ_by_one_level_and_meet_where_both_agree() {
        let cells = [2048, 2048];
        let bounds = bounds([2048, 2048]);
        for (finer, camera) in cameras(20_480.0).into_iter().flat_map(|camera| [0, 3].map(|finer| (finer, camera))) {
            let ground = Ground { finer, ..ground(&bounds, cells) };
            let selection = select(&ground, &camera, [800, 600], 6.0);
            let above = eye_above(&ground, &camera);
            let mut level_of = std::collections::BTreeMap::new();
            for tile in &selection.tiles {
                let span = 1 << tile.level;
                for (a, b) in (0..span).flat_map(|a| (0..span).map(move |b| (a, b))) {
                    level_of.insert((tile.origin[0] / TILE + a, tile.origin[1] / TILE + b), tile);
                }
            }
            for ((i, j), tile) in &level_of {
                for (along, neighbour) in [(true, level_of.get(&(i + 1, *j))), (false, level_of.get(&(*i, j + 1)))] {
                    let Some(neighbour) = neighbour.filter(|neighbour| neighbour.level != tile.level) else { continue };
                    assert_eq!(neighbour.level.abs_diff(tile.level), 1);
                    let (fine, coarse) =
                        if tile.level < neighbour.level { (tile, neighbour) } else { (neighbour, tile) };
                    // the common edge, in grid lines
                    for step in 0..=TILE {
                        let line =
                            if along { [(i + 1) * TILE, j * TILE + step] } else { [i * TILE + step, (j + 1) * TILE] };
                        let x = ground.line_m(0, line[0]) - camera.eye.x;
                        let z = ground.line_m(1, line[1]) - camera.eye.z;
                        let distance = (x * x + z * z + above * above).sqrt();
                        let way = |tile: &Tile| (distance - f64::from(tile.slide[0])) * f64::from(tile.slide[1]);
                        assert!(way(fine) >= 1.0, "the fine side has not arrived");
                        assert!(way(coarse) <= 0.0, "the coarse side has set out");
                    }
                }
            }
        }
    }
}
