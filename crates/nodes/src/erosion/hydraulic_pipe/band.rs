//! A band of rows with copies of its neighbours' rows, swept once per step.
//!
//! All stages of a step run in one sweep down the rows, each a row or two behind the one before, so that their
//! results are still in the cache. A band needs nothing from others during a step: it computes its halo itself, from
//! the same numbers and therefore with the same result.

use std::ops::Range;

use orograph_graph::{Boundary, Edge, Job, Lane, NodeError};

use super::{
    bed,
    contacts::Contacts,
    flow,
    physics::{Pace, Physics, Scheme, Transport},
    ring::{Ring, Rows},
    slip::Slip,
    transport,
};
use crate::numerics::beds::Ground;

/// Steps of one sweep, each some rows behind the one before: the result of one step is still in the cache for the
/// next.
pub(super) const STEPS_PER_SWEEP: usize = 4;
/// Rows beyond its output that a step depends on.
const REACH: isize = 6;
/// Rows beyond a band that a sweep of it depends on.
pub(super) const HALO: usize = STEPS_PER_SWEEP * REACH as usize + 1;
/// Rows by which a step of a sweep lags the one before: at least one more than the lag between its stages.
const LAG: isize = 7;
/// Bed slope assumed beyond an open side where the terrain does not fall towards it.
const LEAST_OUTFLOW_SLOPE: f32 = 1e-3;
/// Rows between checks for cancellation.
const ROWS_PER_CHECK: isize = 64;

/// The constant inputs of a run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scene<'a> {
    pub cells: [usize; 2],
    pub boundary: Boundary,
    pub land: &'a [f32],
    pub rain: Lane<'a>,
    pub erodibility: Lane<'a>,
    /// Layers of rock, where there are any.
    pub ground: Option<Ground<'a>>,
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
    /// Change of the bed, m.
    Change,
    /// Loose ground, m.
    Loose,
    /// Material that water has eroded since the last spread, m.
    Taken,
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
pub(super) const STATES: [State; 7] =
    [State::Change, State::Loose, State::Taken, State::Water, State::Sediment, State::West, State::North];

/// Rows through which the stages of a step pass their results.
#[derive(Debug)]
struct Rings {
    bed: Ring,
    wet: Ring,
    /// Discharge before friction, eastward through west faces and southward through north faces.
    driven: [Ring; 2],
    /// By how much more water is deeper at the east and the south face of a cell, as a fraction.
    lean: [Ring; 2],
    share: Ring,
    load: Ring,
    /// Concentrations, or the traced load of MacCormack's first pass.
    part: Ring,
    way: [Ring; 2],
}

impl Rings {
    /// Those of the `step` of a sweep.
    fn new(nx: usize, step: usize) -> Self {
        let mut place = STATES.len() + 11 * step;
        let mut ring = || {
            place += 1;
            Ring::new(nx, place)
        };
        Self {
            bed: ring(),
            wet: ring(),
            driven: [ring(), ring()],
            lean: [ring(), ring()],
            share: ring(),
            load: ring(),
            part: ring(),
            way: [ring(), ring()],
        }
    }
}

/// The rows that the stages of a step process, from those whose state is known.
#[derive(Clone, Debug)]
struct Span {
    known: Range<isize>,
    /// With a ghost row where the world ends; otherwise the outermost row of the halo serves as one.
    loaded: Range<isize>,
    shared: Range<isize>,
    exchanged: Range<isize>,
    /// True where the world ends above and below.
    ends: [bool; 2],
}

impl Span {
    fn new(known: Range<isize>, rows: isize) -> Self {
        let ends = [known.start == 0, known.end == rows];
        let (first, last) = (known.start, known.end);
        Self {
            loaded: if ends[0] { -1 } else { first }..if ends[1] { rows + 1 } else { last },
            shared: if ends[0] { 0 } else { first + 2 }..if ends[1] { rows } else { last - 2 },
            exchanged: if ends[0] { 0 } else { first + 3 }..if ends[1] { rows } else { last - 3 },
            known,
            ends,
        }
    }

    /// The rows known after the step.
    fn after(&self) -> Range<isize> {
        let [top, bottom] = self.ends;
        self.known.start + if top { 0 } else { REACH }..self.known.end - if bottom { 0 } else { REACH }
    }
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
    pub nx: usize,
    pub states: [Rows; 7],
    /// Discharge summed over time, m², own rows only.
    flow: Vec<f32>,
    /// Those of each step of a sweep.
    rings: Vec<Rings>,
    rain: Vec<f32>,
    pub mobile: Vec<f32>,
    /// The hardness of the rock, where there are layers.
    contacts: Option<Contacts>,
    /// A row of rock without layers: one over its hardness.
    uniform: Vec<f32>,
    /// Sink for the unused flow in the halo.
    elsewhere: Vec<f32>,
    pub left: Vec<Left>,
    pub deepest_m: f32,
    pub slip: Slip,
}

impl Band {
    pub fn new(scene: &Scene<'_>, rows: Range<usize>, loose: Lane<'_>) -> Self {
        let nx = scene.cells[0];
        let count = rows.len() + 2 * HALO + 1;
        let mut band = Self {
            first: rows.start,
            rows: rows.len(),
            nx,
            states: std::array::from_fn(|place| Rows::new(nx, count, place)),
            flow: vec![0.0; rows.len() * nx],
            rings: (0..STEPS_PER_SWEEP).map(|step| Rings::new(nx, step)).collect(),
            rain: vec![0.0; nx],
            mobile: vec![0.0; nx],
            contacts: scene.ground.map(|_| Contacts::new(nx, count)),
            uniform: vec![1.0; nx],
            elsewhere: vec![0.0; nx],
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

    /// Returns the rows of the world in this band.
    pub fn world_rows(&self) -> Range<usize> {
        self.first..self.first + self.rows
    }

    /// A row of a state and one sample more, from -[`HALO`] to as many below the last.
    pub fn row(&self, state: State, y: isize) -> &[f32] {
        self.states[state as usize].faces(at(y))
    }

    /// The same, to be written.
    pub fn row_mut(&mut self, state: State, y: isize) -> &mut [f32] {
        self.states[state as usize].faces_mut(at(y))
    }

    /// The time integral of discharge in a row, m².
    pub fn flow(&self, y: usize) -> &[f32] {
        &self.flow[y * self.nx..][..self.nx]
    }

    /// Returns the world row of a band row, wrapped in a periodic world.
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

    /// `steps` steps of all processes but slippage, at most [`STEPS_PER_SWEEP`].
    pub fn sweep(&mut self, scene: &Scene<'_>, pace: &Pace, steps: usize, job: &Job<'_>) -> Result<(), NodeError> {
        let rows = self.rows as isize;
        let mut known = self.known(scene);
        let spans: Vec<Span> = (0..steps)
            .map(|_| {
                let span = Span::new(known.clone(), rows);
                known = span.after();
                span
            })
            .collect();
        let Some(first) = spans.first().map(|span| span.loaded.clone()) else { return Ok(()) };
        self.deepest_m = 0.0;
        for y in first.start..first.end + LAG * steps as isize {
            if y % ROWS_PER_CHECK == 0 {
                job.check()?;
            }
            for (step, span) in spans.iter().enumerate() {
                self.stages(scene, pace, step, span, y - LAG * step as isize);
            }
        }
        Ok(())
    }

    /// Runs all stages that are possible once row y of the state before a step is known: each stage a row or two
    /// behind the one before.
    fn stages(&mut self, scene: &Scene<'_>, pace: &Pace, step: usize, span: &Span, y: isize) {
        if span.loaded.contains(&y) {
            self.load(scene, pace, step, span, y);
        }
        let t = y - 1;
        if span.loaded.contains(&t) {
            if pace.scheme == Scheme::Inertial {
                self.lean(step, span, t);
            }
            if t > span.loaded.start {
                self.north_faces(scene, pace, step, t);
            }
            if t > span.loaded.start + 1 {
                self.west_faces(pace, step, t - 1);
            }
        }
        self.share(scene, pace, step, span, y - 2);
        if span.exchanged.contains(&(y - 3)) {
            self.exchange(scene, pace, step, span, y - 3);
            if span.ends[0] && y - 3 == 0 {
                self.ghost_load(step, 0, -1);
            }
            if span.ends[1] && y - 2 == self.rows as isize {
                self.ghost_load(step, y - 3, y - 2);
            }
        }
        self.carry(scene, pace, step, span, y);
    }

    /// Bed and water of a row, or of the ghost row beyond an edge of the world.
    fn load(&mut self, scene: &Scene<'_>, pace: &Pace, step: usize, span: &Span, y: isize) {
        if span.known.contains(&y) {
            self.load_row(scene, pace, step, y);
            return;
        }
        let last = self.rows as isize - 1;
        if y < 0 {
            self.load_row(scene, pace, step, 0);
            self.load_row(scene, pace, step, 1.min(last));
        }
        let (edge, near) = if y < 0 { (scene.boundary.north, 0) } else { (scene.boundary.south, y - 1) };
        let second = (2 * near - y).clamp(0, last);
        let Rings { bed, wet, driven: [east, _], .. } = &mut self.rings[step];
        let lands = [near, second].map(|row| &scene.land[self.first.wrapping_add_signed(row) * self.nx..][..self.nx]);
        for i in 0..self.nx + 2 {
            let column = i.clamp(1, self.nx) - 1;
            let (here, depth) = (bed.whole(near)[i], wet.whole(near)[i]);
            let (height, depth) =
                beyond(edge, lands.map(|land| land[column]), here, depth, scene.physics.cell_m as f32);
            bed.whole_mut(y)[i] = height;
            wet.whole_mut(y)[i] = depth;
        }
        east.copy(near, y);
    }

    fn load_row(&mut self, scene: &Scene<'_>, pace: &Pace, step: usize, y: isize) {
        let (nx, start) = (self.nx, self.world_row(scene, y) * self.nx);
        let [change, _, _, water, _, west, _] = &self.states;
        let Rings { bed, wet, driven: [east, _], lean: [lean, _], .. } = &mut self.rings[step];
        let rain = lane_row(&mut self.rain, scene.rain, start);
        let (land, water) = ([&scene.land[start..], change.cells(at(y))], [water.cells(at(y)), rain]);
        flow::load(bed.cells_mut(y), wet.cells_mut(y), land, water, pace);
        let (height, depth) = (bed.whole_mut(y), wet.whole_mut(y));
        for (edge, ghost, near, second, far) in
            [(scene.boundary.west, 0, 1, 2.min(nx), nx), (scene.boundary.east, nx + 1, nx, (nx - 1).max(1), 1)]
        {
            (height[ghost], depth[ghost]) = if edge == Edge::Periodic {
                (height[far], depth[far])
            } else {
                let lands = [near, second].map(|i| scene.land[start + i - 1]);
                beyond(edge, lands, height[near], depth[near], scene.physics.cell_m as f32)
            };
        }
        if pace.scheme == Scheme::Inertial {
            let (bed, wet) = (bed.whole(y), wet.whole(y));
            flow::lean(lean.cells_mut(y), [wet, &wet[1..], &wet[2..]]);
            if scene.joined()[0] {
                lean.close(y, true);
            } else {
                let row = lean.whole_mut(y);
                [row[0], row[1], row[nx], row[nx + 1]] = [0.0; 4];
            }
            let lean = lean.whole(y);
            let (wet, lean) = ([wet, &wet[1..]], [lean, &lean[1..]]);
            flow::drive(east.faces_mut(y), west.faces(at(y)), [bed, &bed[1..]], wet, lean, pace);
        }
    }

    /// Lean of the water along columns in a row, 0 at sides of the world and where a neighbour is not known.
    fn lean(&mut self, step: usize, span: &Span, y: isize) {
        let Rings { wet, lean: [_, south], .. } = &mut self.rings[step];
        let side = span.ends[0] && y <= 0 || span.ends[1] && y + 1 >= self.rows as isize;
        if side || y == span.loaded.start || y + 1 == span.loaded.end {
            south.whole_mut(y).fill(0.0);
        } else {
            flow::lean(south.cells_mut(y), [y - 1, y, y + 1].map(|row| wet.cells(row)));
        }
    }

    /// Discharge through the faces north of a row.
    fn north_faces(&mut self, scene: &Scene<'_>, pace: &Pace, step: usize, y: isize) {
        let Rings { bed, wet, driven: [east, south], lean: [_, lean], .. } = &mut self.rings[step];
        let lean = [lean.cells(y - 1), lean.cells(y)];
        let [.., north] = &mut self.states;
        let north = north.cells_mut(at(y));
        let [bed, wet] = [&*bed, &*wet].map(|ring| [ring.cells(y - 1), ring.cells(y)]);
        match pace.scheme {
            Scheme::Inertial => {
                flow::drive(south.cells_mut(y), north, bed, wet, lean, pace);
                south.close(y, scene.joined()[0]);
                let (above, below) = (east.faces(y - 1), east.faces(y));
                flow::rub(north, south.cells(y), [above, &above[1..], below, &below[1..]], bed, wet, lean, pace);
            }
            Scheme::Pipes => flow::pipes(north, bed, wet, pace),
        }
    }

    /// Discharge through the faces within a row whose neighbours are known.
    fn west_faces(&mut self, pace: &Pace, step: usize, y: isize) {
        let Rings { bed, wet, driven: [east, south], lean: [lean, _], .. } = &self.rings[step];
        let lean = [lean.whole(y), &lean.whole(y)[1..]];
        let [.., west, _] = &mut self.states;
        let west = west.faces_mut(at(y));
        let [bed, wet] = [bed, wet].map(|ring| [ring.whole(y), &ring.whole(y)[1..]]);
        match pace.scheme {
            Scheme::Inertial => {
                let (above, below) = (south.whole(y), south.whole(y + 1));
                flow::rub(west, east.faces(y), [above, below, &above[1..], &below[1..]], bed, wet, lean, pace);
            }
            Scheme::Pipes => flow::pipes(west, bed, wet, pace),
        }
    }

    /// Computes the fraction of its outflow that each cell of a row can supply.
    fn share(&mut self, scene: &Scene<'_>, pace: &Pace, step: usize, span: &Span, y: isize) {
        let Rings { share, wet, .. } = &mut self.rings[step];
        if !span.known.contains(&y) {
            share.whole_mut(y).fill(1.0);
        } else if span.shared.contains(&y) {
            let [.., west, north] = &self.states;
            let faces = [west.cells(at(y)), &west.faces(at(y))[1..], north.cells(at(y)), north.cells(at(y + 1))];
            flow::shares(share.cells_mut(y), wet.cells(y), faces, pace);
            share.close(y, scene.joined()[0]);
        }
    }

    /// Depth, speed, erosion and deposition of a row.
    fn exchange(&mut self, scene: &Scene<'_>, pace: &Pace, step: usize, span: &Span, y: isize) {
        let nx = self.nx;
        let world_row = self.world_row(scene, y);
        let own = (0..self.rows as isize).contains(&y);
        let joined = scene.joined();
        let Rings { bed, wet, share, load, part, way, .. } = &mut self.rings[step];
        let [change, loose, taken, depth, sediment, west, north] = &mut self.states;
        if y == span.exchanged.start {
            flow::limit(north.cells_mut(at(y)), [share.cells(y - 1), share.cells(y)]);
        }
        flow::limit(north.cells_mut(at(y + 1)), [share.cells(y), share.cells(y + 1)]);
        flow::limit(west.faces_mut(at(y)), [share.whole(y), &share.whole(y)[1..]]);
        let (west, depth) = (west.faces(at(y)), depth.cells_mut(at(y)));
        let faces = [&west[..nx], &west[1..], north.cells(at(y)), north.cells(at(y + 1))];
        let loose = loose.cells_mut(at(y));
        let weakness = match (&mut self.contacts, &scene.ground) {
            (Some(contacts), Some(ground)) => contacts.weakness(at(y), world_row, ground, bed.cells(y), loose),
            _ => &self.uniform,
        };
        let row = bed::Row {
            faces,
            wets: [y - 1, y, y + 1].map(|row| wet.whole(row)),
            beds: [y - 1, y, y + 1].map(|row| bed.whole(row)),
            sediment: sediment.cells(at(y)),
            mobile: mobility(&mut self.mobile, scene, world_row),
            weakness,
        };
        let flow = if own { &mut self.flow[y as usize * nx..][..nx] } else { &mut self.elsewhere[..] };
        let (change, taken) = (change.cells_mut(at(y)), taken.cells_mut(at(y)));
        let (load_row, part_row) = (load.cells_mut(y), part.cells_mut(y));
        let deepest = bed::exchange(depth, flow, change, loose, taken, load_row, part_row, &row, pace);
        load.close(y, joined[0]);
        part.close(y, joined[0]);
        if scene.physics.transport != Transport::Upwind {
            let [east, south] = way;
            transport::way(east.cells_mut(y), south.cells_mut(y), [wet.cells(y), depth], faces, pace);
        }
        if own {
            self.deepest_m = self.deepest_m.max(deepest);
            let left = &mut self.left[y as usize];
            let part = part.cells(y);
            let mut leave = |discharge: f32, at: usize| {
                let gone = f64::from(discharge) * f64::from(pace.step);
                left.water += gone;
                left.solid += gone * f64::from(part[at]);
            };
            if !joined[0] {
                leave(-faces[0][0], 0);
                leave(faces[1][nx - 1], nx - 1);
            }
            if !joined[1] && world_row == 0 {
                (0..nx).for_each(|i| leave(-faces[2][i], i));
            }
            if !joined[1] && world_row + 1 == scene.cells[1] {
                (0..nx).for_each(|i| leave(faces[3][i], i));
            }
        }
        if pace.dries() {
            let sum = |row: &[f32]| row.iter().map(|&depth| f64::from(depth)).sum::<f64>();
            let before = if own { sum(depth) } else { 0.0 };
            flow::dry(depth, pace);
            if own {
                self.left[y as usize].lost += before - sum(depth);
            }
        }
    }

    /// The ghost row of the load beyond an edge of the world: the same as the last.
    fn ghost_load(&mut self, step: usize, from: isize, to: isize) {
        let Rings { load, part, .. } = &mut self.rings[step];
        load.copy(from, to);
        part.copy(from, to);
    }

    /// Sediment of the rows whose neighbours are now known.
    fn carry(&mut self, scene: &Scene<'_>, pace: &Pace, step: usize, span: &Span, y: isize) {
        let transport = scene.physics.transport;
        let [top, bottom] = span.ends;
        let Rings { load, part, way: [east, south], .. } = &mut self.rings[step];
        let inside = span.exchanged.start + isize::from(!top)..span.exchanged.end - isize::from(!bottom);
        let t = y - 4;
        if transport == Transport::MacCormack && inside.contains(&t) {
            let rows = [load.whole(t - 1), load.whole(t), load.whole(t + 1)];
            transport::traced(part.cells_mut(t), rows, [east.cells(t), south.cells(t)], -1.0);
            part.close(t, scene.joined()[0]);
            if top && t == 0 {
                part.copy(0, -1);
            }
            if bottom && t + 1 == inside.end {
                part.copy(t, t + 1);
            }
        }
        let (t, carried) = match transport {
            Transport::MacCormack => (y - 5, span.after()),
            Transport::Upwind | Transport::SemiLagrangian => (y - 4, inside),
        };
        if !carried.contains(&t) {
            return;
        }
        let [.., sediment, west, north] = &mut self.states;
        let sediment = sediment.cells_mut(at(t));
        let way = [east.cells(t), south.cells(t)];
        let loads = [load.whole(t - 1), load.whole(t), load.whole(t + 1)];
        let parts = [part.whole(t - 1), part.whole(t), part.whole(t + 1)];
        match transport {
            Transport::Upwind => {
                let faces = [west.cells(at(t)), &west.faces(at(t))[1..], north.cells(at(t)), north.cells(at(t + 1))];
                transport::upwind(sediment, load.cells(t), parts, faces, pace);
            }
            Transport::SemiLagrangian => transport::traced(sediment, loads, way, -1.0),
            Transport::MacCormack => transport::corrected(sediment, loads, parts, way),
        }
    }
}

/// Returns the index of a band row in its rasters.
pub(super) fn at(y: isize) -> usize {
    (y + HALO as isize) as usize
}

/// Bed and water beyond a side of the world, from the land of the two cells nearest to it at the start, and the bed and
/// water of the first.
///
/// The land beyond goes on at the slope that it has at the start: with that of the eroded bed, a cut at the side would
/// make the water beyond it steeper, which would cut the deeper.
fn beyond(edge: Edge, [near, second]: [f32; 2], bed: f32, water: f32, cell_m: f32) -> (f32, f32) {
    let drop = (second - near).max(LEAST_OUTFLOW_SLOPE * cell_m);
    match edge {
        Edge::Base => (bed - drop, 0.0),
        Edge::Open | Edge::Inland => (bed - drop, water),
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

/// Returns how readily the bed of a row erodes; negative on sides at base level, whose bed is fixed.
pub(super) fn mobility<'a>(buffer: &'a mut [f32], scene: &Scene<'_>, row: usize) -> &'a [f32] {
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
