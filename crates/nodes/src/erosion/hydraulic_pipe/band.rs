//! A band of rows with copies of its neighbours' rows, swept once per step.
//!
//! All stages of a step run in one sweep down the rows, each a row or two behind the one before, so that what they hand
//! on is still in the cache. A band needs nothing from others during a step: it computes what happens in its halo
//! itself, from the same numbers and so with the same result.

use std::ops::Range;

use orograph_graph::{Boundary, Edge, Job, Lane, NodeError};

use super::{
    bed, flow,
    physics::{Pace, Physics, Transport},
    ring::Ring,
    slip::Slip,
    transport,
};

/// Rows beyond a band that a step of it depends on.
pub(super) const HALO: usize = 5;
/// Bed slope taken beyond an open side where the land does not fall towards it.
const LEAST_OUTFLOW_SLOPE: f32 = 1e-3;
/// Rows between questions whether to go on.
const ROWS_PER_CHECK: isize = 64;

/// What a run reads and never changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene<'a> {
    pub cells: [usize; 2],
    pub boundary: Boundary,
    pub land: &'a [f32],
    pub rain: Lane<'a>,
    pub erodibility: Lane<'a>,
    pub physics: Physics,
}

impl Scene<'_> {
    pub fn joined(&self) -> [bool; 2] {
        [self.boundary.west == Edge::Periodic, self.boundary.north == Edge::Periodic]
    }
}

/// The state of a run, per cell: names of the rasters of [`Band`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum State {
    /// What the bed has gained, m.
    Change,
    /// Loose ground, m.
    Loose,
    /// Depth of water, m.
    Water,
    /// Suspended sediment, metres of solid.
    Sediment,
    /// Discharge through the west face, m²/s; one more than cells in a row.
    West,
    /// Discharge through the north face, m²/s; one more row than cells.
    North,
}

/// Rasters that neighbours exchange.
pub(super) const STATES: [State; 6] =
    [State::Change, State::Loose, State::Water, State::Sediment, State::West, State::North];

/// Rows in which the stages of a sweep hand on their results.
#[derive(Debug)]
struct Rings {
    bed: Ring,
    water: Ring,
    /// Discharge eastward and southward before the step, in the middle of cells.
    before: [Ring; 2],
    /// Half the fall of the water surface across cells, eastward and southward.
    fall: [Ring; 2],
    share: Ring,
    capacity: Ring,
    load: Ring,
    /// Concentrations, or the traced load of MacCormack's first pass.
    part: Ring,
    way: [Ring; 2],
}

/// Water and suspended solids that left a row, in metres over one cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Left {
    /// Water across the world's edge.
    pub water: f64,
    /// Solids across the world's edge.
    pub solid: f64,
    /// Water into the air and the ground.
    pub lost: f64,
}

/// Some rows of the world.
#[derive(Debug)]
pub(super) struct Band {
    /// First row in the world, and number of rows.
    pub first: usize,
    pub rows: usize,
    stride: usize,
    pub nx: usize,
    pub states: [Vec<f32>; 6],
    /// Discharge summed over time, m², own rows only.
    flow: Vec<f32>,
    rings: Rings,
    rain: Vec<f32>,
    mobile: Vec<f32>,
    pub left: Vec<Left>,
    pub deepest_m: f32,
    pub slip: Slip,
}

impl Band {
    pub fn new(scene: &Scene<'_>, rows: Range<usize>, loose: Lane<'_>) -> Self {
        let nx = scene.cells[0];
        let stride = (nx + 1).next_multiple_of(16);
        let count = rows.len() + 2 * HALO + 1;
        let ring = || Ring::new(nx);
        let mut band = Self {
            first: rows.start,
            rows: rows.len(),
            stride,
            nx,
            states: std::array::from_fn(|_| vec![0.0; count * stride]),
            flow: vec![0.0; rows.len() * nx],
            rings: Rings {
                bed: ring(),
                water: ring(),
                before: [ring(), ring()],
                fall: [ring(), ring()],
                share: ring(),
                capacity: ring(),
                load: ring(),
                part: ring(),
                way: [ring(), ring()],
            },
            rain: vec![0.0; nx],
            mobile: vec![0.0; nx],
            left: vec![Left::default(); rows.len()],
            deepest_m: 0.0,
            slip: Slip::new(nx),
        };
        for y in rows.clone() {
            let row = band.row_mut(State::Loose, (y - rows.start) as isize);
            for (i, thickness) in row[..nx].iter_mut().enumerate() {
                *thickness = loose.at(y * nx + i).max(0.0);
            }
        }
        band
    }

    /// The rows of the world it holds.
    pub fn world_rows(&self) -> Range<usize> {
        self.first..self.first + self.rows
    }

    /// Where a row begins in each of the states.
    pub fn at(&self, y: isize) -> usize {
        (y + HALO as isize) as usize * self.stride
    }

    /// A row of a state, from -[`HALO`] to as many below the last.
    pub fn row(&self, state: State, y: isize) -> &[f32] {
        &self.states[state as usize][self.at(y)..][..self.nx + 1]
    }

    /// The same, to be written.
    pub fn row_mut(&mut self, state: State, y: isize) -> &mut [f32] {
        let at = self.at(y);
        &mut self.states[state as usize][at..][..self.nx + 1]
    }

    /// The time integral of discharge in a row, m².
    pub fn flow(&self, y: usize) -> &[f32] {
        &self.flow[y * self.nx..][..self.nx]
    }

    /// The row of the world of a row of the band, around the joint where there is one.
    pub fn world_row(&self, scene: &Scene<'_>, y: isize) -> usize {
        (self.first as isize + y).rem_euclid(scene.cells[1] as isize) as usize
    }

    /// Rows whose cells are known: into the halo where there is a neighbour, one ghost where the world ends.
    fn known(&self, scene: &Scene<'_>) -> Range<isize> {
        let joined = scene.joined()[1];
        let halo = HALO as isize;
        let first = if self.first > 0 || joined { -halo } else { 0 };
        let more = if self.first + self.rows < scene.cells[1] || joined { halo } else { 0 };
        first..self.rows as isize + more
    }

    /// One step of all processes but slippage.
    pub fn step(&mut self, scene: &Scene<'_>, pace: &Pace, job: &Job<'_>) -> Result<(), NodeError> {
        let known = self.known(scene);
        let rows = self.rows as isize;
        let (top, bottom) = (known.start == 0, known.end == rows);
        // a ghost row where the world ends; else the outermost row of the halo serves as one
        let loaded = if top { -1 } else { known.start }..if bottom { rows + 1 } else { known.end };
        let shared = loaded.start + 1..loaded.end - 1;
        let limited = if top { 0 } else { shared.start + 1 }..if bottom { rows + 1 } else { shared.end };
        let exchanged = if top { 0 } else { limited.start }..if bottom { rows } else { limited.end - 1 };
        self.deepest_m = 0.0;
        for y in loaded.start..loaded.end + 4 {
            if y % ROWS_PER_CHECK == 0 {
                job.check()?;
            }
            if loaded.contains(&y) {
                self.load(scene, pace, y, known.clone());
                if y > loaded.start {
                    self.north_faces(pace, y);
                }
                if y > loaded.start + 1 {
                    self.west_faces(scene, pace, y - 1);
                }
            }
            self.share(scene, pace, y - 1, &shared, &known);
            if limited.contains(&(y - 1)) {
                self.limit(y - 1, known.contains(&(y - 1)));
            }
            if exchanged.contains(&(y - 2)) {
                self.exchange(scene, pace, y - 2);
                if top && y - 2 == 0 {
                    self.ghost_load(0, -1);
                }
                if bottom && y - 2 == rows - 1 {
                    self.ghost_load(rows - 1, rows);
                }
            }
            self.carry(scene, pace, y, &exchanged, [top, bottom]);
        }
        Ok(())
    }

    /// Bed and water of a row, or of the ghost row beyond an edge of the world.
    fn load(&mut self, scene: &Scene<'_>, pace: &Pace, y: isize, known: Range<isize>) {
        if !known.contains(&y) {
            if y < 0 {
                self.load_row(scene, pace, 0);
                self.load_row(scene, pace, 1.min(self.rows as isize - 1));
            }
            let (edge, near) = if y < 0 { (scene.boundary.north, 0) } else { (scene.boundary.south, y - 1) };
            let second = (2 * near - y).clamp(0, self.rows as isize - 1);
            for i in 0..self.nx + 2 {
                let bed = [near, second].map(|row| self.rings.bed.whole(row)[i]);
                let water = self.rings.water.whole(near)[i];
                let (bed, water) = beyond(edge, bed, water, scene.physics.cell_m as f32);
                self.rings.bed.whole_mut(y)[i] = bed;
                self.rings.water.whole_mut(y)[i] = water;
            }
            let Rings { before, fall: [east, _], .. } = &mut self.rings;
            before.iter_mut().chain([east]).for_each(|ring| ring.copy(near, y));
            return;
        }
        self.load_row(scene, pace, y);
    }

    fn load_row(&mut self, scene: &Scene<'_>, pace: &Pace, y: isize) {
        let (nx, start) = (self.nx, self.world_row(scene, y) * self.nx);
        let at = self.at(y);
        let [change, _, water, _, west, north] = &self.states;
        let [east, south] = &mut self.rings.before;
        flow::middle(east.cells_mut(y), [&west[at..], &west[at + 1..]]);
        flow::middle(south.cells_mut(y), [&north[at..], &north[at + self.stride..]]);
        east.close(y, scene.joined()[0]);
        south.close(y, scene.joined()[0]);
        flow::bed(self.rings.bed.cells_mut(y), &scene.land[start..][..nx], &change[at..][..nx]);
        let rain = lane_row(&mut self.rain, scene.rain, start);
        flow::rain(self.rings.water.cells_mut(y), &water[at..][..nx], rain, self.rings.bed.cells(y), pace);
        let (bed, water) = (self.rings.bed.whole_mut(y), self.rings.water.whole_mut(y));
        for (edge, ghost, near, second, far) in
            [(scene.boundary.west, 0, 1, 2.min(nx), nx), (scene.boundary.east, nx + 1, nx, (nx - 1).max(1), 1)]
        {
            (bed[ghost], water[ghost]) = if edge == Edge::Periodic {
                (bed[far], water[far])
            } else {
                beyond(edge, [bed[near], bed[second]], water[near], scene.physics.cell_m as f32)
            };
        }
        let (bed, water) = (self.rings.bed.whole(y), self.rings.water.whole(y));
        flow::fall(self.rings.fall[0].cells_mut(y), [bed, &bed[2..]], [water, &water[2..]]);
    }

    /// Discharge through the faces north of a row.
    fn north_faces(&mut self, pace: &Pace, y: isize) {
        let (at, nx) = (self.at(y), self.nx);
        let Rings { bed, water, before: [flowing, _], fall: [falling, _], .. } = &self.rings;
        let [bed, water, flowing, falling] =
            [bed, water, flowing, falling].map(|ring| [ring.cells(y - 1), ring.cells(y)]);
        let [.., north] = &mut self.states;
        flow::faces(&mut north[at..][..nx], [flowing, falling], bed, water, pace);
    }

    /// Discharge through the faces within a row whose neighbours are known.
    fn west_faces(&mut self, scene: &Scene<'_>, pace: &Pace, y: isize) {
        let (at, nx) = (self.at(y), self.nx);
        let Rings { bed, water, before: [_, flowing], fall: [_, falling], .. } = &mut self.rings;
        let [beds, waters] = [&*bed, &*water].map(|ring| [ring.cells(y - 1), ring.cells(y + 1)]);
        flow::fall(falling.cells_mut(y), beds, waters);
        falling.close(y, scene.joined()[0]);
        let [.., west, _] = &mut self.states;
        let [bed, water, flowing, falling] = [&*bed, &*water, &*flowing, &*falling].map(|ring| {
            let row = ring.whole(y);
            [row, &row[1..]]
        });
        flow::faces(&mut west[at..][..nx + 1], [flowing, falling], bed, water, pace);
    }

    /// What share of its outflow each cell of a row can give.
    fn share(&mut self, scene: &Scene<'_>, pace: &Pace, y: isize, shared: &Range<isize>, known: &Range<isize>) {
        if !known.contains(&y) {
            self.rings.share.whole_mut(y).fill(1.0);
        } else if shared.contains(&y) {
            let faces = faces_of(&self.states, [self.at(y), self.at(y + 1)], self.nx);
            flow::shares(self.rings.share.cells_mut(y), self.rings.water.cells(y), faces, pace);
            self.rings.share.close(y, scene.joined()[0]);
        }
    }

    fn limit(&mut self, y: isize, own: bool) {
        let (at, nx) = (self.at(y), self.nx);
        let [.., west, north] = &mut self.states;
        let share = &self.rings.share;
        flow::limit(&mut north[at..][..nx], [share.cells(y - 1), share.cells(y)]);
        if own {
            let share = share.whole(y);
            flow::limit(&mut west[at..][..nx + 1], [share, &share[1..]]);
        }
    }

    /// Depth, speed, erosion and deposition of a row.
    fn exchange(&mut self, scene: &Scene<'_>, pace: &Pace, y: isize) {
        let (at, below, nx) = (self.at(y), self.at(y + 1), self.nx);
        let own = (0..self.rows as isize).contains(&y);
        let Rings { bed, water, share, capacity, load, part, way, .. } = &mut self.rings;
        let [change, loose, depth, sediment, west, north] = &mut self.states;
        let faces = [&west[at..][..nx], &west[at + 1..][..nx], &north[at..][..nx], &north[below..][..nx]];
        // the shares of this row have been used: what flowed in the halo is not asked for and goes in their place
        let flowed = if own { &mut self.flow[y as usize * nx..][..nx] } else { share.cells_mut(y) };
        let depth = &mut depth[at..][..nx];
        let deepest = flow::water(depth, flowed, capacity.cells_mut(y), water.cells(y), faces, pace);
        if own {
            self.deepest_m = self.deepest_m.max(deepest);
        }

        let beds = [bed.cells(y), &bed.whole(y)[..nx], &bed.whole(y)[2..], bed.cells(y - 1), bed.cells(y + 1)];
        bed::capacity(capacity.cells_mut(y), beds, water.cells(y), depth, pace);
        let world_row = (self.first as isize + y).rem_euclid(scene.cells[1] as isize) as usize;
        let mobile = mobility(&mut self.mobile, scene, world_row);
        let sediment = &sediment[at..][..nx];
        let row = [capacity.cells(y), mobile, water.cells(y), depth];
        bed::exchange(&mut change[at..][..nx], &mut loose[at..][..nx], load.cells_mut(y), sediment, row, pace);
        let joined = scene.joined()[0];
        load.close(y, joined);
        if scene.physics.transport == Transport::Upwind {
            transport::concentration(part.cells_mut(y), load.cells(y), water.cells(y));
            part.close(y, joined);
        } else {
            let [east, south] = way;
            transport::way(east.cells_mut(y), south.cells_mut(y), [water.cells(y), depth], faces, pace);
        }
        if own {
            let left = &mut self.left[y as usize];
            let mut leave = |discharge: f32, at: usize| {
                let discharge = f64::from(discharge) * f64::from(pace.step);
                let water = f64::from(water.cells(y)[at]);
                left.water += discharge;
                left.solid += if water > 0.0 { discharge * f64::from(load.cells(y)[at]) / water } else { 0.0 };
            };
            if !joined {
                leave(-faces[0][0], 0);
                leave(faces[1][nx - 1], nx - 1);
            }
            if !scene.joined()[1] {
                if world_row == 0 {
                    (0..nx).for_each(|i| leave(-faces[2][i], i));
                }
                if world_row + 1 == scene.cells[1] {
                    (0..nx).for_each(|i| leave(faces[3][i], i));
                }
            }
            if pace.dries() {
                let sum = |row: &[f32]| row.iter().map(|&depth| f64::from(depth)).sum::<f64>();
                let wet = sum(depth);
                flow::dry(depth, pace);
                left.lost += wet - sum(depth);
            }
        } else if pace.dries() {
            flow::dry(depth, pace);
        }
    }

    /// The ghost row of the load beyond an edge of the world: the same as the last.
    fn ghost_load(&mut self, from: isize, to: isize) {
        self.rings.load.copy(from, to);
        self.rings.part.copy(from, to);
    }

    /// Sediment of the rows whose neighbours are now known.
    fn carry(&mut self, scene: &Scene<'_>, pace: &Pace, y: isize, exchanged: &Range<isize>, ends: [bool; 2]) {
        let nx = self.nx;
        let own = 0..self.rows as isize;
        if scene.physics.transport == Transport::MacCormack {
            let t = y - 3;
            let [top, bottom] = ends;
            let traced = if top { 0 } else { exchanged.start + 1 }..if bottom { own.end } else { exchanged.end - 1 };
            if traced.contains(&t) {
                let Rings { load, part, way: [east, south], .. } = &mut self.rings;
                let rows = [load.whole(t - 1), load.whole(t), load.whole(t + 1)];
                transport::traced(part.cells_mut(t), rows, [east.cells(t), south.cells(t)], -1.0);
                part.close(t, scene.joined()[0]);
                if top && t == 0 {
                    part.copy(0, -1);
                }
                if bottom && t == own.end - 1 {
                    part.copy(t, t + 1);
                }
            }
        }
        let t = if scene.physics.transport == Transport::MacCormack { y - 4 } else { y - 3 };
        if !own.contains(&t) {
            return;
        }
        let (at, below) = (self.at(t), self.at(t + 1));
        let Rings { load, part, way: [east, south], .. } = &self.rings;
        let [.., sediment, west, north] = &mut self.states;
        let sediment = &mut sediment[at..][..nx];
        let way = [east.cells(t), south.cells(t)];
        let loads = [load.whole(t - 1), load.whole(t), load.whole(t + 1)];
        let parts = [part.whole(t - 1), part.whole(t), part.whole(t + 1)];
        match scene.physics.transport {
            Transport::Upwind => {
                let faces = [&west[at..][..nx], &west[at + 1..][..nx], &north[at..][..nx], &north[below..][..nx]];
                transport::upwind(sediment, load.cells(t), parts, faces, pace);
            }
            Transport::SemiLagrangian => transport::traced(sediment, loads, way, -1.0),
            Transport::MacCormack => transport::corrected(sediment, loads, parts, way),
        }
    }
}

/// The discharge through the faces of a row of cells: west, east, north, south.
fn faces_of(states: &[Vec<f32>; 6], [at, below]: [usize; 2], nx: usize) -> [&[f32]; 4] {
    let [.., west, north] = states;
    [&west[at..][..nx], &west[at + 1..][..nx], &north[at..][..nx], &north[below..][..nx]]
}

/// Bed and water beyond a side of the world, from the two cells nearest to it and the water of the first.
fn beyond(edge: Edge, [near, second]: [f32; 2], water: f32, cell_m: f32) -> (f32, f32) {
    let drop = (second - near).max(LEAST_OUTFLOW_SLOPE * cell_m);
    match edge {
        Edge::Base => (near - drop, 0.0),
        Edge::Open => (near - drop, water),
        Edge::Wall | Edge::Periodic => (f32::NAN, 0.0),
    }
}

/// A row of an input; constants fill `buffer`.
fn lane_row<'a>(buffer: &'a mut [f32], lane: Lane<'a>, start: usize) -> &'a [f32] {
    match lane {
        Lane::Constant(value) => {
            buffer.fill(value);
            buffer
        }
        Lane::Samples(samples) => &samples[start..][..buffer.len()],
    }
}

/// How readily the bed of a row gives way; below 0 on sides at base level, whose bed stays.
fn mobility<'a>(buffer: &'a mut [f32], scene: &Scene<'_>, row: usize) -> &'a [f32] {
    let nx = buffer.len();
    let boundary = &scene.boundary;
    let held = row == 0 && boundary.north == Edge::Base || row + 1 == scene.cells[1] && boundary.south == Edge::Base;
    if held {
        buffer.fill(-1.0);
        return buffer;
    }
    match scene.erodibility {
        Lane::Constant(value) => buffer.fill(value.max(0.0)),
        Lane::Samples(samples) => {
            buffer.iter_mut().zip(&samples[row * nx..][..nx]).for_each(|(out, value)| *out = value.max(0.0));
        }
    }
    if boundary.west == Edge::Base {
        buffer[0] = -1.0;
    }
    if boundary.east == Edge::Base {
        buffer[nx - 1] = -1.0;
    }
    buffer
}
