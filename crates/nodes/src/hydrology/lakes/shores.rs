//! The shores of lakes as rings along the edges of cells.
//!
//! A walk along a shore has the water on its left and turns left at a corner where two wet cells touch, so that it
//! stays with the cells that share edges. A walk that passes a corner twice is cut there into rings that pass every
//! point once. Each part of a lake whose cells share edges then has one outer ring, counter-clockwise with north up,
//! and a clockwise ring around each island: the polygons of the Simple Features and GeoJSON standards. Lakes across a
//! periodic side are cut at that side.

use std::collections::HashMap;

use orograph_graph::{Area, Job, Line, Lines, NodeError, Vertex, memory::zeroed};

use super::find::Lakes;
use crate::numerics::routing::Grid;

/// Steps along edges, counter-clockwise from east, in columns and rows of corners.
const EDGES: [[i64; 2]; 4] = [[1, 0], [0, -1], [-1, 0], [0, 1]];
const NORTH: usize = 1;
const SOUTH: usize = 3;

/// A corner of cells: column and row.
type Corner = [i64; 2];

/// A walk along a shore.
struct Walk {
    /// The first wet cell, row by row from the north-west.
    first: [i64; 2],
    /// Rings, each without its last corner, which is its first.
    rings: Vec<Vec<Corner>>,
    /// The westernmost wet cell with land to the east on this walk; None if there is none.
    west: Option<[i64; 2]>,
}

/// Returns the shores of all lakes, with the data of each lake.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub(super) fn outlines(job: &Job<'_>, grid: &Grid, lakes: &Lakes) -> Result<Lines, NodeError> {
    let (nx, ny) = (grid.nx as i64, grid.ny as i64);
    let is_wet = |[x, y]: [i64; 2]| (0..nx).contains(&x) && (0..ny).contains(&y) && lakes.of[(y * nx + x) as usize] > 0;
    // the walk along the west edge of each cell, from 1
    let mut passed: Vec<u32> = zeroed(grid.cells())?;
    let mut walks = Vec::new();
    for y in 0..ny {
        job.check()?;
        for x in 0..nx {
            if is_wet([x, y]) && !is_wet([x - 1, y]) && passed[(y * nx + x) as usize] == 0 {
                let number = walks.len() as u32 + 1;
                walks.push(walk([x, y], &is_wet, &mut |[x, y]| passed[(y * nx + x) as usize] = number));
            }
        }
    }

    // the part of its lake that each walk belongs to, as the number of the walk with the outer ring: that of a shore
    // around an island is found to the west of it, so walks are taken from west to east
    let has_outer = |walk: &Walk| walk.rings.iter().any(|ring| doubled_area(ring) > 0);
    let mut parts: Vec<usize> = (0..walks.len()).collect();
    let mut inner: Vec<usize> = (0..walks.len()).filter(|&walk| !has_outer(&walks[walk])).collect();
    inner.sort_by_key(|&walk| walks[walk].west);
    for walk in inner {
        let Some([mut x, y]) = walks[walk].west else { continue };
        while is_wet([x - 1, y]) {
            x -= 1;
        }
        parts[walk] = parts[passed[(y * nx + x) as usize] as usize - 1];
    }
    drop(passed);
    let mut rings_of: Vec<Vec<Vec<Corner>>> = walks.iter().map(|_| Vec::new()).collect();
    for (part, walk) in parts.into_iter().zip(&mut walks) {
        rings_of[part].append(&mut walk.rings);
    }

    // parts by lake; walks and lakes are numbered by their first cells, so that each lake's parts are in order
    let mut of_lakes: Vec<Vec<Line>> = lakes.all.iter().map(|_| Vec::new()).collect();
    for (walk, mut rings) in walks.iter().zip(rings_of) {
        job.check()?;
        // the outer ring first
        rings.sort_by_key(|ring| doubled_area(ring) < 0);
        let number = lakes.of[(walk.first[1] * nx + walk.first[0]) as usize] as usize - 1;
        let level_m = f64::from(lakes.all[number].level_m);
        of_lakes[number].extend(rings.iter().map(|ring| line(ring, job.cell_m(), level_m)));
    }
    let cell_m2 = job.cell_m() * job.cell_m();
    let areas = lakes.all.iter().zip(&of_lakes).map(|(lake, rings)| Area {
        rings: rings.len() as u32,
        level_m: f64::from(lake.level_m),
        depth_m: f64::from(lake.depth_m),
        area_m2: cell_m2 * f64::from(lake.cells),
        volume_m3: cell_m2 * lake.depths_m,
        spill_m: job.window().centre_m(lake.sill as usize % grid.nx, lake.sill as usize / grid.nx),
    });
    Ok(Lines { areas: areas.collect(), ..Lines::open(of_lakes.into_iter().flatten().collect()) })
}

/// Walks along a shore from the west edge of a cell, southwards. `pass` is called with each cell whose west edge is
/// part of it.
fn walk(start: [i64; 2], is_wet: &impl Fn([i64; 2]) -> bool, pass: &mut impl FnMut([i64; 2])) -> Walk {
    let mut walk = Walk { first: start, rings: Vec::new(), west: None };
    let (mut at, mut heading) = (start, SOUTH);
    // corners at which the walk has turned, and the place of each among them
    let mut turns: Vec<Corner> = vec![at];
    let mut places: HashMap<Corner, usize> = HashMap::from([(at, 0)]);
    loop {
        // the wet cell is to the left of the edge
        match heading {
            SOUTH => pass(at),
            NORTH => {
                let cell = [at[0] - 1, at[1] - 1];
                if walk.west.is_none_or(|west| cell < west) {
                    walk.west = Some(cell);
                }
            }
            _ => {}
        }
        let [east, south] = EDGES[heading];
        at = [at[0] + east, at[1] + south];
        let next = turn(at, heading, is_wet);
        if at == start && next == SOUTH {
            walk.rings.push(turns);
            return walk;
        }
        if next != heading {
            if let Some(&place) = places.get(&at) {
                let ring = turns.split_off(place);
                ring.iter().for_each(|corner| _ = places.remove(corner));
                walk.rings.push(ring);
            }
            places.insert(at, turns.len());
            turns.push(at);
        }
        heading = next;
    }
}

/// Returns the heading after a corner: to the left if there is a shore, else ahead, else to the right.
fn turn([x, y]: Corner, heading: usize, is_wet: &impl Fn([i64; 2]) -> bool) -> usize {
    // cells around the corner, counter-clockwise from the north-east: after heading h, cell h is ahead on the right
    let ahead = |turned: usize| match (heading + turned) % 4 {
        0 => [x, y - 1],
        1 => [x - 1, y - 1],
        2 => [x - 1, y],
        _ => [x, y],
    };
    let (left, right) = (is_wet(ahead(0)), is_wet(ahead(3)));
    match (left, right) {
        (false, _) => (heading + 1) % 4,
        (true, false) => heading,
        (true, true) => (heading + 3) % 4,
    }
}

/// Returns twice the area inside a ring, in cells: positive if it runs counter-clockwise with north up.
fn doubled_area(ring: &[Corner]) -> i64 {
    let next = ring.iter().cycle().skip(1);
    // rows run south, which turns the sign
    ring.iter().zip(next).map(|([x0, y0], [x1, y1])| x1 * y0 - x0 * y1).sum()
}

/// Returns the closed line of a ring.
fn line(ring: &[Corner], cell_m: f64, level_m: f64) -> Line {
    let vertex = |corner: &Corner| Vertex {
        position_m: corner.map(|at| at as f64 * cell_m),
        elevation_m: level_m,
        ..Vertex::default()
    };
    let vertices = ring.iter().chain(ring.first()).map(vertex);
    Line { order: 1, downstream: None, vertices: vertices.collect() }
}
