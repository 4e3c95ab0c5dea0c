//! Outlines of numbered regions as rings along the edges of cells.
//!
//! A walk along an outline has its region on the left and turns left at a corner where two of its cells touch, so that
//! it stays with the cells that share edges. A walk that passes a corner twice is cut there into rings that pass every
//! point once. Each part of a region whose cells share edges then has one outer ring, counter-clockwise with north up,
//! and a clockwise ring around each hole: the polygons of the Simple Features and GeoJSON standards. Regions across a
//! periodic side are cut at that side.

use std::collections::HashMap;

use orograph_graph::{Job, Line, NodeError, Vertex, memory::zeroed};

/// Steps along edges, counter-clockwise from east, in columns and rows of corners.
const EDGES: [[i64; 2]; 4] = [[1, 0], [0, -1], [-1, 0], [0, 1]];
const NORTH: usize = 1;
const SOUTH: usize = 3;

/// A corner of cells: column and row.
pub type Corner = [i64; 2];

/// Cells of a region that are connected by edges.
pub struct Part {
    /// The number of the region.
    pub region: u32,
    /// The outer ring, then those of the holes, each without its last corner, which is its first.
    pub rings: Vec<Vec<Corner>>,
}

/// A walk along an outline.
struct Walk {
    /// The first cell inside, row by row from the north-west.
    first: [i64; 2],
    rings: Vec<Vec<Corner>>,
    /// The westernmost cell inside with another region to the east on this walk; None if there is none.
    west: Option<[i64; 2]>,
}

/// Returns the parts of all regions but 0, in the order of their first cells, row by row from the north-west. `of` is the
/// region of each cell in rows of `nx`.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub fn parts(job: &Job<'_>, nx: usize, of: &[u32]) -> Result<Vec<Part>, NodeError> {
    let (nx, ny) = (nx as i64, (of.len() / nx) as i64);
    let region = |[x, y]: [i64; 2]| {
        let is_in_world = (0..nx).contains(&x) && (0..ny).contains(&y);
        if is_in_world { of[(y * nx + x) as usize] } else { 0 }
    };
    // the walk along the west edge of each cell, from 1
    let mut passed: Vec<u32> = zeroed(of.len())?;
    let mut walks = Vec::new();
    for y in 0..ny {
        job.check()?;
        for x in 0..nx {
            let inside = region([x, y]);
            if inside > 0 && region([x - 1, y]) != inside && passed[(y * nx + x) as usize] == 0 {
                let number = walks.len() as u32 + 1;
                let is_inside = |at| region(at) == inside;
                walks.push(walk([x, y], &is_inside, &mut |[x, y]| passed[(y * nx + x) as usize] = number));
            }
        }
    }

    // the part that each walk belongs to, as the number of the walk with the outer ring: that of an outline around a
    // hole is found to the west of it, so walks are taken from west to east
    let has_outer = |walk: &Walk| walk.rings.iter().any(|ring| doubled_area(ring) > 0);
    let mut outer: Vec<usize> = (0..walks.len()).collect();
    let mut inner: Vec<usize> = (0..walks.len()).filter(|&walk| !has_outer(&walks[walk])).collect();
    inner.sort_by_key(|&walk| walks[walk].west);
    for walk in inner {
        let Some([mut x, y]) = walks[walk].west else { continue };
        let inside = region([x, y]);
        while region([x - 1, y]) == inside {
            x -= 1;
        }
        outer[walk] = outer[passed[(y * nx + x) as usize] as usize - 1];
    }
    drop(passed);
    let mut rings: Vec<Vec<Vec<Corner>>> = walks.iter().map(|_| Vec::new()).collect();
    for (part, walk) in outer.into_iter().zip(&mut walks) {
        rings[part].append(&mut walk.rings);
    }
    let parts = walks.iter().zip(rings).filter(|(_, rings)| !rings.is_empty());
    Ok(parts
        .map(|(walk, mut rings)| {
            rings.sort_by_key(|ring| doubled_area(ring) < 0);
            Part { region: region(walk.first), rings }
        })
        .collect())
}

/// Walks along an outline from the west edge of a cell, southwards. `pass` is called with each cell whose west edge is
/// part of it.
fn walk(start: [i64; 2], is_inside: &impl Fn([i64; 2]) -> bool, pass: &mut impl FnMut([i64; 2])) -> Walk {
    let mut walk = Walk { first: start, rings: Vec::new(), west: None };
    let (mut at, mut heading) = (start, SOUTH);
    // corners at which the walk has turned, and the place of each among them
    let mut turns: Vec<Corner> = vec![at];
    let mut places: HashMap<Corner, usize> = HashMap::from([(at, 0)]);
    loop {
        // the cell inside is to the left of the edge
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
        let next = turn(at, heading, is_inside);
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

/// Returns the heading after a corner: to the left if there is an outline, else ahead, else to the right.
fn turn([x, y]: Corner, heading: usize, is_inside: &impl Fn([i64; 2]) -> bool) -> usize {
    // cells around the corner, counter-clockwise from the north-east: after heading h, cell h is ahead on the right
    let ahead = |turned: usize| match (heading + turned) % 4 {
        0 => [x, y - 1],
        1 => [x - 1, y - 1],
        2 => [x - 1, y],
        _ => [x, y],
    };
    let (left, right) = (is_inside(ahead(0)), is_inside(ahead(3)));
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

/// Returns the closed line of a ring, with an elevation for each corner.
#[must_use]
pub fn line(ring: &[Corner], cell_m: f64, order: u32, elevation_m: impl Fn(Corner) -> f64) -> Line {
    let vertex = |corner: &Corner| Vertex {
        position_m: corner.map(|at| at as f64 * cell_m),
        elevation_m: elevation_m(*corner),
        ..Vertex::default()
    };
    let vertices = ring.iter().chain(ring.first()).map(vertex);
    Line { order, downstream: None, vertices: vertices.collect() }
}
