//! The surface of a fan: its height falls with the distance from the apex over the fan, around obstacles.
//!
//! The distance T solves |∇T| = 1 with the upwind scheme of Sethian (1996), nearest cells first; close to the apex, where
//! that scheme is least exact, it is the straight line where nothing is between. Chen and Capart find the same distances
//! with a visibility polygon.

use std::{cmp::Reverse, collections::BinaryHeap};

use orograph_graph::{Job, NodeError};

use super::mouths::{Mouth, Streams};
use crate::numerics::{
    eikonal::upwind,
    routing::{
        Grid, Outlet,
        code::{STEPS, length},
    },
};

/// How far the apex may be upstream of the mouth, in radii of the fan.
const FARTHEST_APEX: f64 = 1.5;
/// How far cells of the fan may be from the mouth, in radii.
const FARTHEST: f64 = 2.0;
/// Upstream of the apex a stream must keep this share of its catchment.
const LEAST_CATCHMENT: f64 = 0.4;
/// How far from the apex distances are straight lines, in cells.
const CLOSE: i32 = 5;
/// Places per radius at which apexes are tried.
const STRIDES: f64 = 6.0;
/// Halvings of the height of the apex between two cells of the stream.
const HALVINGS: u32 = 6;

/// Columns and rows of a block of places.
const BLOCK: usize = 1 << BLOCK_BITS;
const BLOCK_BITS: u32 = 4;

/// The cells of a fan and the height of its surface there.
pub(super) type Surface = Vec<(u32, f32)>;

/// A cell that a fan may reach.
#[derive(Clone, Copy, Default)]
struct Place {
    /// The last search that has reached it, and the last one that has covered it.
    seen: u32,
    covered: u32,
    distance: f32,
}

/// Room for the surroundings of a mouth, in blocks that are added where a fan comes. Distances are in cells.
#[derive(Default)]
pub(super) struct Room {
    /// Column and row of the mouth.
    mouth: [i32; 2],
    /// The farthest columns and rows from the mouth.
    half: [i32; 2],
    /// Places of a row are numbered with so many bits.
    bits: u32,
    /// The number of each block from 1, or 0.
    blocks: Vec<u32>,
    places: Vec<Place>,
    search: u32,
    queue: BinaryHeap<Reverse<(u32, u32)>>,
    surface: Surface,
}

/// A cell of a stream, and its columns and rows from the mouth.
type OnStream = (u32, [i32; 2]);

/// The cells of the main stream from its mouth up, over a length in cells.
fn upstream(streams: &Streams, mouth: u32, most: f64) -> Vec<OnStream> {
    let least = LEAST_CATCHMENT * f64::from(streams.cells[mouth as usize]);
    let (mut stream, mut passed) = (vec![(mouth, [0; 2])], 0.0);
    while let Some(&(cell, [x, y])) = stream.last()
        && let Some((way, above)) = streams.above(cell)
        && f64::from(streams.cells[above as usize]) >= least
        && passed + length(way as u8) <= most
    {
        passed += length(way as u8);
        stream.push((above, [x + STEPS[way].0, y + STEPS[way].1]));
    }
    stream
}

impl Room {
    /// The fan at a mouth: with its apex so far up the stream that it has the area that the catchment calls for.
    /// None where the stream is too short or too gentle for that, or ends too high above the valley.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn fit(
        &mut self,
        job: &Job<'_>,
        streams: &Streams,
        land: &[f32],
        mouth: &Mouth,
    ) -> Result<Option<Surface>, NodeError> {
        let cell_m = job.cell_m();
        let radius = mouth.shape.radius_m / cell_m;
        let most = (mouth.shape.area_m2 / (cell_m * cell_m)).round() as usize;
        self.clear(&streams.grid, mouth.cell, (FARTHEST * radius).ceil() as i32);
        let height = |(cell, _): OnStream| f64::from(streams.level_m[cell as usize]);
        let stream = upstream(streams, mouth.cell, FARTHEST_APEX * radius);
        // the surface of the last fan that was not too large
        let mut kept = Surface::new();
        let mut is_large = |(_, apex): OnStream, top_m: f64| {
            job.check()?;
            let is_large = self.spread(&streams.grid, land, mouth, cell_m, (apex, top_m), most) >= most;
            if !is_large {
                std::mem::swap(&mut kept, &mut self.surface);
            }
            Ok::<_, NodeError>(is_large)
        };
        if is_large(stream[0], height(stream[0]))? {
            return Ok(None);
        }
        // the first apex upstream with a large enough fan, and one below it with too small a fan
        let stride = ((radius / STRIDES) as usize).max(1);
        let (mut small, mut large) = (0, 0);
        loop {
            large = (large + stride).min(stream.len() - 1);
            if large == small {
                return Ok(None);
            }
            if is_large(stream[large], height(stream[large]))? {
                break;
            }
            small = large;
        }
        while small + 1 < large {
            let middle = usize::midpoint(small, large);
            if is_large(stream[middle], height(stream[middle]))? {
                large = middle;
            } else {
                small = middle;
            }
        }
        let apex = stream[small];
        let (mut low_m, mut high_m) = (height(apex), height(stream[large]));
        for _ in 0..HALVINGS {
            let middle_m = 0.5 * (low_m + high_m);
            if is_large(apex, middle_m)? {
                high_m = middle_m;
            } else {
                low_m = middle_m;
            }
        }
        Ok(Some(kept))
    }

    /// Prepares the surroundings of another mouth.
    fn clear(&mut self, grid: &Grid, mouth: u32, half: i32) {
        self.mouth = [mouth as usize % grid.nx, mouth as usize / grid.nx].map(|at| at as i32);
        self.half = grid.farthest().map(|farthest| half.min(i32::try_from(farthest).unwrap_or(i32::MAX)));
        let [columns, rows] = self.half.map(|half| 2 * half as usize + 1);
        self.bits = columns.max(BLOCK).next_power_of_two().ilog2();
        self.blocks.clear();
        self.blocks.resize(rows.div_ceil(BLOCK) << (self.bits - BLOCK_BITS), 0);
        self.places.clear();
        self.search = 0;
    }

    /// Column and row of a place, from 0.
    const fn column_and_row(&self, place: u32) -> (usize, usize) {
        (place as usize & ((1 << self.bits) - 1), place as usize >> self.bits)
    }

    /// Columns and rows of a place from the mouth.
    const fn offset(&self, place: u32) -> [i32; 2] {
        let (column, row) = self.column_and_row(place);
        [column as i32 - self.half[0], row as i32 - self.half[1]]
    }

    fn place(&self, [dx, dy]: [i32; 2]) -> Option<u32> {
        let is_near = dx.abs() <= self.half[0] && dy.abs() <= self.half[1];
        is_near.then(|| ((dy + self.half[1]) as u32) << self.bits | (dx + self.half[0]) as u32)
    }

    /// The block of a place, and where the place is in a block.
    const fn block(&self, place: u32) -> (usize, usize) {
        let (column, row) = self.column_and_row(place);
        let block = (row >> BLOCK_BITS) << (self.bits - BLOCK_BITS) | column >> BLOCK_BITS;
        (block, (row & (BLOCK - 1)) << BLOCK_BITS | column & (BLOCK - 1))
    }

    fn at(&self, place: u32) -> Place {
        let (block, within) = self.block(place);
        match self.blocks[block] as usize {
            0 => Place::default(),
            number => self.places[(number - 1) * BLOCK * BLOCK + within],
        }
    }

    fn at_mut(&mut self, place: u32) -> &mut Place {
        let (block, within) = self.block(place);
        if self.blocks[block] == 0 {
            self.places.resize(self.places.len() + BLOCK * BLOCK, Place::default());
            self.blocks[block] = (self.places.len() / (BLOCK * BLOCK)) as u32;
        }
        &mut self.places[(self.blocks[block] as usize - 1) * BLOCK * BLOCK + within]
    }

    /// Covers the cells of a fan with this apex, nearest first, and stops at `most`. Returns their number, with those
    /// beyond the sides of the world; the largest number for a fan that is too long.
    fn spread(
        &mut self,
        grid: &Grid,
        land: &[f32],
        mouth: &Mouth,
        cell_m: f64,
        (apex, top_m): ([i32; 2], f64),
        most: usize,
    ) -> usize {
        self.search += 1;
        self.queue.clear();
        self.surface.clear();
        let Some(start) = self.place(apex) else { return 0 };
        self.reach(start, 0.0);
        let mut count = 0;
        while let Some(Reverse((_, place))) = self.queue.pop() {
            let Place { covered, distance, .. } = self.at(place);
            let offset = self.offset(place);
            // beyond the sides, the ground is that at the side
            let ([x, y], is_within) = grid.nearest([self.mouth[0] + offset[0], self.mouth[1] + offset[1]]);
            let cell = y * grid.nx + x;
            let top_m = (top_m - mouth.shape.fall_m(f64::from(distance) * cell_m)) as f32;
            let is_lower = top_m <= land[cell] && place != start;
            if covered == self.search || is_lower || grid.outlet(x, y) == Outlet::Base {
                continue;
            }
            self.at_mut(place).covered = self.search;
            count += 1;
            if is_within {
                self.surface.push((cell as u32, top_m));
            }
            if count >= most {
                break;
            }
            for step in STEPS {
                let there = [offset[0] + step.0, offset[1] + step.1];
                // a fan as long as that goes on down the valley
                let Some(next) = self.place(there) else { return usize::MAX };
                let known = self.at(next);
                let is_known = known.seen == self.search;
                if is_known && known.covered == self.search {
                    continue;
                }
                let found = self.distance(apex, there, step, distance);
                if !is_known || found < known.distance {
                    self.reach(next, found);
                }
            }
        }
        count
    }

    /// The distance of a place from the apex by way of a covered one beside it, whose own distance is given.
    fn distance(&self, apex: [i32; 2], [x, y]: [i32; 2], step: (i32, i32), beside: f32) -> f32 {
        let [dx, dy] = [x - apex[0], y - apex[1]];
        if dx.abs().max(dy.abs()) <= CLOSE && self.sees(apex, [x, y]) {
            return ((dx * dx + dy * dy) as f32).sqrt();
        }
        if step.0 != 0 && step.1 != 0 {
            return beside + std::f32::consts::SQRT_2;
        }
        // the places to the left and right of the step
        let aside = [[x - step.1, y - step.0], [x + step.1, y + step.0]].map(|offset| self.covered(offset));
        let across = aside.into_iter().flatten().fold(f32::INFINITY, f32::min);
        upwind(beside, across)
    }

    /// The distance of a place from the apex, if the fan covers it.
    fn covered(&self, offset: [i32; 2]) -> Option<f32> {
        let place = self.at(self.place(offset)?);
        (place.covered == self.search).then_some(place.distance)
    }

    fn reach(&mut self, place: u32, distance: f32) {
        let seen = self.search;
        let known = self.at_mut(place);
        *known = Place { seen, covered: known.covered, distance };
        // distances are not negative, so that their bits have the same order
        self.queue.push(Reverse((distance.to_bits(), place)));
    }

    /// Whether the cells on the straight line between two offsets are covered.
    fn sees(&self, from: [i32; 2], to: [i32; 2]) -> bool {
        let apart = [to[0] - from[0], to[1] - from[1]];
        let steps = apart[0].abs().max(apart[1].abs());
        (1..steps).all(|step| {
            let along = |axis: usize| from[axis] + (2 * apart[axis] * step + steps).div_euclid(2 * steps);
            self.covered([along(0), along(1)]).is_some()
        })
    }
}
