//! Shallow ice: how thickness changes over a step of time.
//!
//! ∂H/∂t = m − ∇·q with q = −H⁴ (Γ H + Σ) |∇s|² ∇s, the shallow-ice flux of Glen's law with n = 3 and sliding u = A τ³:
//! Γ = 2 A (ρ g)³ / 5 and Σ = Aₛ (ρ g)³. The stress τ = ρ g H |∇s| in |∇s|² is at most the yield stress.
//!
//! **Faces.** The thickness at a face is that of the upper cell plus half of van Leer's limited slope, so that a face
//! never takes ice from a cell that has none: mass is conserved where the bed is steeper than the ice is thick
//! (Jarosch, Schoof and Anslow 2013). The slope along the face is the mean of the cells on either side, from
//! differences that are at most the thickness of the higher cell: walls above the ice count for nothing.
//!
//! **Steps** are linearly implicit and factored by direction: (1 − Δt Jₓ)(1 − Δt Jᵧ) δ = Δt R, a tridiagonal system per
//! row and then per column. J is the derivative of the fluxes with the upwind part of the thickness, an M-matrix. What
//! is added to the cells are the divergences of the fluxes qₓ + Jₓ δ*, qᵧ + Jᵧ δ, where δ* solves the first factor:
//! these add up to δ, so that ice is conserved to rounding. A cell that would give more than it has and gets gives
//! less. A steady state does not depend on the step.

use std::convert::Infallible;

use orograph_graph::{
    Edge,
    memory::{OutOfMemory, filled, zeroed},
};

use super::{
    grid::Grid,
    kernels::{LANES, Lines, Rheology, faces, tilts},
};
use crate::numerics::par;

/// Rows of a part of a parallel loop. Does not affect the result.
const ROWS: usize = 16;
/// Rounds in which overdrawn cells are made to give less.
pub(super) const ROUNDS: usize = 6;

/// A row without ice.
const NONE: [u32; 2] = [u32::MAX, 0];

/// The columns of either row.
const fn either(a: [u32; 2], b: [u32; 2]) -> [u32; 2] {
    [if a[0] < b[0] { a[0] } else { b[0] }, if a[1] > b[1] { a[1] } else { b[1] }]
}

/// Cells of a line whose systems are solved: those with ice and their neighbours, or the whole line if it `wraps`. None
/// without ice: nothing flows there.
fn beside([first, end]: [u32; 2], count: usize, wraps: bool) -> Option<[usize; 2]> {
    match (first < end, wraps) {
        (false, _) => None,
        (true, true) => Some([0, count]),
        (true, false) => Some([(first as usize).saturating_sub(1), (end as usize + 1).min(count)]),
    }
}

/// The derivatives of the flux through an open side: what lies beyond it rises and falls with the border, so that only
/// the part that follows from thickness stays.
fn moved(gain: f64, loss: f64) -> (f64, f64) {
    ((gain - loss).max(0.0), (loss - gain).max(0.0))
}

/// Ice on a bed.
pub(super) struct Sheet {
    pub grid: Grid,
    pub rheology: Rheology,
    /// Padded: level of the ground, thickness of the ice, and their sum, all in metres.
    pub bed: Vec<f64>,
    pub thickness: Vec<f64>,
    pub surface: Vec<f64>,
    next: Vec<f64>,
    /// Flux through the west face of each cell, and of one more per row, in m²/yr; positive eastwards.
    pub east: Vec<f64>,
    /// Flux through the north face of each cell, and of one more row; positive southwards.
    pub south: Vec<f64>,
    gain_x: Vec<f64>,
    loss_x: Vec<f64>,
    gain_y: Vec<f64>,
    loss_y: Vec<f64>,
    delta: Vec<f64>,
    strips: Vec<f64>,
    /// Columns from the first to behind the last with ice, of each row.
    icy: Vec<[u32; 2]>,
}

/// Eight lines at work.
struct Room {
    lines: Lines,
    gains: Vec<[f64; LANES]>,
    losses: Vec<[f64; LANES]>,
}

impl Room {
    fn new(count: usize) -> Self {
        let zeros = |count| vec![[0.0; LANES]; count];
        Self { lines: Lines::new(count), gains: zeros(count + 1), losses: zeros(count + 1) }
    }
}

/// What a step has done.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Change {
    /// The largest change in thickness, in metres.
    pub most_m: f64,
    /// Sum of thickness that overdrawn cells were given, in metres.
    pub created_m: f64,
    /// Sum of thickness that snow has added, in metres.
    pub gained_m: f64,
    /// Sum of thickness that has melted, in metres: not more than there was.
    pub melted_m: f64,
    /// Sum of thickness that has flowed out of the world, in metres.
    pub left_m: f64,
}

impl Sheet {
    /// Bare ground of zeros.
    pub fn new(grid: Grid, rheology: Rheology) -> Result<Self, OutOfMemory> {
        let faces = (grid.nx + 1) * grid.ny;
        let lids = grid.nx * (grid.ny + 1);
        Ok(Self {
            grid,
            rheology,
            bed: grid.padded()?,
            thickness: grid.padded()?,
            surface: grid.padded()?,
            next: grid.padded()?,
            east: zeroed(faces)?,
            south: zeroed(lids)?,
            gain_x: zeroed(faces)?,
            loss_x: zeroed(faces)?,
            gain_y: zeroed(lids)?,
            loss_y: zeroed(lids)?,
            delta: zeroed(grid.len())?,
            strips: zeroed(grid.nx.div_ceil(LANES) * LANES * grid.ny)?,
            icy: filled(grid.ny, NONE)?,
        })
    }

    /// Sets the ground. Ice stays as thick as it is.
    pub fn set_bed(&mut self, bed: impl Fn(usize) -> f64 + Sync) {
        let grid = self.grid;
        let inside = &mut self.bed[super::grid::PAD * grid.stride()..][..grid.ny * grid.stride()];
        par::all(inside.chunks_mut(grid.stride()), |j, row| {
            let row = &mut row[super::grid::PAD..][..grid.nx];
            row.iter_mut().enumerate().for_each(|(i, level)| *level = bed(j * grid.nx + i));
        });
        grid.extend(&mut self.bed);
        self.resurface();
    }

    /// Updates the surface and what lies beyond the sides.
    pub fn resurface(&mut self) {
        let stride = self.grid.stride();
        let (bed, thickness) = (&self.bed, &self.thickness);
        par::all(self.surface.chunks_mut(stride * ROWS), |part, surface| {
            let first = part * stride * ROWS;
            let ground = bed[first..].iter().zip(&thickness[first..]);
            surface.iter_mut().zip(ground).for_each(|(surface, (bed, thickness))| *surface = bed + thickness);
        });
        self.grid.surround(&self.bed, &mut self.thickness, &mut self.surface);
        let (grid, thickness) = (self.grid, &self.thickness);
        par::all(self.icy.chunks_mut(ROWS), |part, icy| {
            for (k, icy) in icy.iter_mut().enumerate() {
                let depths = grid.row(thickness, 0, (part * ROWS + k) as isize, grid.nx);
                let first = depths.iter().position(|depth| *depth > 0.0);
                let last = depths.iter().rposition(|depth| *depth > 0.0);
                *icy = first.zip(last).map_or(NONE, |(first, last)| [first as u32, last as u32 + 1]);
            }
        });
    }

    /// The columns with ice of a row; of those beyond the sides, all columns if there is any ice in them.
    fn icy(&self, row: isize) -> [u32; 2] {
        match usize::try_from(row).ok().and_then(|row| self.icy.get(row)) {
            Some(icy) => *icy,
            None if self.grid.row(&self.thickness, 0, row, self.grid.nx).iter().any(|depth| *depth > 0.0) => {
                [0, self.grid.nx as u32]
            }
            None => NONE,
        }
    }

    /// Takes over ice and fluxes that were found in single precision. `thickness` is padded.
    pub fn take(&mut self, [thickness, east, south]: [&[u32]; 3]) {
        for (mine, found) in [(&mut self.thickness, thickness), (&mut self.east, east), (&mut self.south, south)] {
            par::change_with(mine, found, |mine, bits| *mine = f64::from(f32::from_bits(*bits)));
        }
        self.resurface();
    }

    /// Thickness of a cell.
    pub fn depth(&self, cell: usize) -> f64 {
        self.thickness[self.grid.at(cell % self.grid.nx, cell / self.grid.nx)]
    }

    /// Surface of a cell.
    pub fn level(&self, cell: usize) -> f64 {
        self.surface[self.grid.at(cell % self.grid.nx, cell / self.grid.nx)]
    }

    /// Sum of thickness over all cells, in metres.
    pub fn total_m(&self) -> f64 {
        (0..self.grid.ny).map(|j| self.grid.row(&self.thickness, 0, j as isize, self.grid.nx).iter().sum::<f64>()).sum()
    }

    /// Computes the ice after `dt_yr` years with `balance` metres of ice per year on each cell, without taking it over:
    /// see [`Self::accept`]. The fluxes are those of the step.
    pub fn attempt(&mut self, dt_yr: f64, balance: &[f64]) -> Change {
        self.southward();
        self.eastward();
        self.right(dt_yr, balance);
        self.rows(dt_yr);
        self.columns(dt_yr);
        self.correct();
        self.seal();
        let mut change = self.apply(dt_yr, balance);
        for round in 1..=ROUNDS {
            if change.created_m <= 0.0 {
                break;
            }
            self.limit(dt_yr, balance, round == ROUNDS);
            change = self.apply(dt_yr, balance);
        }
        change
    }

    /// Takes over the last attempt.
    pub fn accept(&mut self) {
        std::mem::swap(&mut self.thickness, &mut self.next);
        self.resurface();
    }

    /// Fluxes through north faces and their derivatives.
    fn southward(&mut self) {
        let grid = self.grid;
        let (nx, [dx, dy]) = (grid.nx, grid.cell_m);
        let columns: Vec<[u32; 2]> = (0..=grid.ny as isize).map(|j| either(self.icy(j - 1), self.icy(j))).collect();
        let (thickness, surface, rheology) = (&self.thickness, &self.surface, &self.rheology);
        let size = nx * ROWS;
        let parts = self.south.chunks_mut(size).zip(self.gain_y.chunks_mut(size)).zip(self.loss_y.chunks_mut(size));
        par::all(parts, |part, ((south, gain), loss)| {
            let mut tilted = [vec![0.0; nx], vec![0.0; nx]];
            for out in [&mut *south, &mut *gain, &mut *loss] {
                out.fill(0.0);
            }
            let rows = south.chunks_mut(nx).zip(gain.chunks_mut(nx)).zip(loss.chunks_mut(nx));
            for (k, ((south, gain), loss)) in rows.enumerate() {
                let j = (part * ROWS + k) as isize;
                let is_wall =
                    j == 0 && grid.edges[2] == Edge::Wall || j == grid.ny as isize && grid.edges[3] == Edge::Wall;
                let [first, end] = columns[j as usize].map(|column| column as usize);
                if first >= end || is_wall {
                    continue;
                }
                let count = end - first;
                let row = |raster, di: isize, dj: isize| grid.row(raster, first as isize + di, j + dj, count);
                for (dj, tilted) in [-1, 0].into_iter().zip(&mut tilted) {
                    let along = |raster| [-1, 0, 1].map(|di| row(raster, di, dj));
                    tilts(along(surface), along(thickness), 0.5 / dx, &mut tilted[..count]);
                }
                let depths = [-2, -1, 0, 1].map(|dj| row(thickness, 0, dj));
                let levels = [-1, 0].map(|dj| row(surface, 0, dj));
                let across = [&tilted[0][..count], &tilted[1][..count]];
                let out = [&mut south[first..end], &mut gain[first..end], &mut loss[first..end]];
                faces(rheology, depths, levels, across, 1.0 / dy, out);
                let edge = if j == 0 { grid.edges[2] } else { grid.edges[3] };
                if (j == 0 || j == grid.ny as isize) && matches!(edge, Edge::Open | Edge::Inland) {
                    for (gain, loss) in gain[first..end].iter_mut().zip(&mut loss[first..end]) {
                        (*gain, *loss) = moved(*gain, *loss);
                    }
                }
            }
        });
        // two cells that are joined twice have no tridiagonal system
        if grid.wraps(1) && grid.ny < 3 {
            self.gain_y.fill(0.0);
            self.loss_y.fill(0.0);
        }
    }

    /// Fluxes through west faces and their derivatives.
    fn eastward(&mut self) {
        let grid = self.grid;
        let (nx, [dx, dy]) = (grid.nx, grid.cell_m);
        let (thickness, surface, rheology, icy) = (&self.thickness, &self.surface, &self.rheology, &self.icy);
        let size = (nx + 1) * ROWS;
        let parts = self.east.chunks_mut(size).zip(self.gain_x.chunks_mut(size)).zip(self.loss_x.chunks_mut(size));
        par::all(parts, |part, ((east, gain), loss)| {
            let mut tilted = vec![0.0; nx + 2];
            for out in [&mut *east, &mut *gain, &mut *loss] {
                out.fill(0.0);
            }
            let rows = east.chunks_mut(nx + 1).zip(gain.chunks_mut(nx + 1)).zip(loss.chunks_mut(nx + 1));
            for (k, ((east, gain), loss)) in rows.enumerate() {
                let j = (part * ROWS + k) as isize;
                let [mut first, mut end] = icy[j as usize].map(|column| column as usize);
                if first >= end {
                    continue;
                }
                if grid.wraps(0) {
                    (first, end) = (0, nx);
                }
                let count = end - first + 1;
                let row = |raster, di: isize, dj: isize, count| grid.row(raster, first as isize + di, j + dj, count);
                let around = |raster| [-1, 0, 1].map(|dj| row(raster, -1, dj, count + 1));
                tilts(around(surface), around(thickness), 0.5 / dy, &mut tilted[..=count]);
                let depths = [-2, -1, 0, 1].map(|di| row(thickness, di, 0, count));
                let levels = [-1, 0].map(|di| row(surface, di, 0, count));
                let across = [&tilted[..count], &tilted[1..=count]];
                let out = [&mut east[first..=end], &mut gain[first..=end], &mut loss[first..=end]];
                faces(rheology, depths, levels, across, 1.0 / dx, out);
                for (edge, face) in [(grid.edges[0], 0), (grid.edges[1], nx)] {
                    match edge {
                        Edge::Wall => (east[face], gain[face], loss[face]) = (0.0, 0.0, 0.0),
                        Edge::Open | Edge::Inland => (gain[face], loss[face]) = moved(gain[face], loss[face]),
                        _ => {}
                    }
                }
                if grid.wraps(0) && nx < 3 {
                    gain.fill(0.0);
                    loss.fill(0.0);
                }
            }
        });
    }

    /// What the fluxes and the balance would add in a step; no more melts than there is.
    fn right(&mut self, dt_yr: f64, balance: &[f64]) {
        let grid = self.grid;
        let nx = grid.nx;
        let [over_x, over_y] = grid.cell_m.map(|cell_m| dt_yr / cell_m);
        let (east, south, thickness) = (&self.east, &self.south, &self.thickness);
        par::all(self.delta.chunks_mut(nx * ROWS), |part, rows| {
            for (k, right) in rows.chunks_mut(nx).enumerate() {
                let j = part * ROWS + k;
                let (east, balance) = (&east[j * (nx + 1)..][..=nx], &balance[j * nx..][..nx]);
                let (north, below) = (&south[j * nx..][..nx], &south[(j + 1) * nx..][..nx]);
                let depths = &grid.row(thickness, 0, j as isize, nx)[..nx];
                for i in 0..nx {
                    let out = over_x * (east[i + 1] - east[i]) + over_y * (below[i] - north[i]);
                    let (gains, melts) = (dt_yr * balance[i].max(0.0), -dt_yr * balance[i].min(0.0));
                    let has = (depths[i] + gains - out).max(0.0);
                    right[i] = gains - out - if has < melts { has } else { melts };
                }
            }
        });
    }

    /// The first factor: systems of rows, and what they change of the fluxes through west faces. Without ice on either
    /// side of a face, nothing changes.
    fn rows(&mut self, dt_yr: f64) {
        let grid = self.grid;
        let (nx, wraps, scale) = (grid.nx, grid.wraps(0), dt_yr / grid.cell_m[0]);
        let (gain_x, loss_x, icy) = (&self.gain_x, &self.loss_x, &self.icy);
        let parts = self.delta.chunks_mut(nx * LANES).zip(self.east.chunks_mut((nx + 1) * LANES));
        let solved: Result<(), Infallible> = par::each_with(
            parts,
            || Room::new(nx),
            |room, part, (delta, east)| {
                let rows = icy[part * LANES..].iter().take(LANES);
                let Some([start, end]) = beside(rows.fold(NONE, |a, b| either(a, *b)), nx, wraps) else {
                    return Ok(());
                };
                let count = end - start;
                let Room { lines, gains, losses } = room;
                for (lane, delta) in delta.chunks(nx).enumerate() {
                    let faces = (part * LANES + lane) * (nx + 1);
                    let (gain, loss) = (&gain_x[faces + start..=faces + end], &loss_x[faces + start..=faces + end]);
                    gains.iter_mut().zip(gain).for_each(|(gains, gain)| gains[lane] = *gain);
                    losses.iter_mut().zip(loss).for_each(|(losses, loss)| losses[lane] = *loss);
                    lines.right.iter_mut().zip(&delta[start..end]).for_each(|(right, delta)| right[lane] = *delta);
                }
                lines.solve(count, [gains, losses], scale, wraps);
                for (lane, (delta, east)) in delta.chunks_mut(nx).zip(east.chunks_mut(nx + 1)).enumerate() {
                    let (delta, east) = (&mut delta[start..end], &mut east[start..=end]);
                    delta.iter_mut().zip(&lines.right).for_each(|(delta, solved)| *delta = solved[lane]);
                    let [first, last] = [0, count - 1].map(|i| if wraps { delta[i] } else { 0.0 });
                    east[0] += gains[0][lane] * last - losses[0][lane] * delta[0];
                    for face in 1..count {
                        east[face] += gains[face][lane] * delta[face - 1] - losses[face][lane] * delta[face];
                    }
                    east[count] += gains[count][lane] * delta[count - 1] - losses[count][lane] * first;
                }
                Ok(())
            },
        );
        let Ok(()) = solved;
    }

    /// The second factor: systems of columns. `strips` gets their solutions in strips of eight columns, where there is ice on
    /// either side of a face.
    fn columns(&mut self, dt_yr: f64) {
        let grid = self.grid;
        let (nx, ny, wraps, scale) = (grid.nx, grid.ny, grid.wraps(1), dt_yr / grid.cell_m[1]);
        let (gain, loss, delta, icy) = (&self.gain_y, &self.loss_y, &self.delta, &self.icy);
        let strips = self.strips.chunks_mut(ny * LANES);
        let solved: Result<(), Infallible> = par::each_with(
            strips,
            || Room::new(ny),
            |room, part, strip| {
                let Room { lines, gains, losses } = room;
                let first = part * LANES;
                let width = LANES.min(nx - first);
                let has = |row: &[u32; 2]| (row[0] as usize) < first + width && row[1] as usize > first;
                let found = icy.iter().position(has).zip(icy.iter().rposition(has));
                let found = found.map_or(NONE, |(first, last)| [first as u32, last as u32 + 1]);
                let Some([start, end]) = beside(found, ny, wraps) else { return Ok(()) };
                let count = end - start;
                for j in 0..=count {
                    let row = (start + j) * nx + first;
                    gains[j][..width].copy_from_slice(&gain[row..][..width]);
                    losses[j][..width].copy_from_slice(&loss[row..][..width]);
                }
                for j in 0..count {
                    lines.right[j][..width].copy_from_slice(&delta[(start + j) * nx + first..][..width]);
                }
                lines.solve(count, [gains, losses], scale, wraps);
                let strip = &mut strip[start * LANES..end * LANES];
                strip.chunks_mut(LANES).zip(&lines.right).for_each(|(strip, solved)| strip.copy_from_slice(solved));
                Ok(())
            },
        );
        let Ok(()) = solved;
    }

    /// Adds to the fluxes through north faces what the second factor changes.
    fn correct(&mut self) {
        let grid = self.grid;
        let (nx, ny, wraps) = (grid.nx, grid.ny, grid.wraps(1));
        let (gain, loss, strips) = (&self.gain_y, &self.loss_y, &self.strips);
        par::all(self.south.chunks_mut(nx * ROWS), |chunk, rows| {
            rows.chunks_mut(nx).enumerate().for_each(|(k, south)| {
                let j = chunk * ROWS + k;
                let before = if j > 0 { Some(j - 1) } else { wraps.then_some(ny - 1) };
                let after = if j < ny { Some(j) } else { wraps.then_some(0) };
                for (part, south) in south.chunks_mut(LANES).enumerate() {
                    let strip = &strips[part * LANES * ny..][..LANES * ny];
                    let first = j * nx + part * LANES;
                    let (gain, loss) = (&gain[first..][..south.len()], &loss[first..][..south.len()]);
                    if let Some(before) = before {
                        let solved = &strip[before * LANES..];
                        south
                            .iter_mut()
                            .zip(gain)
                            .zip(solved)
                            .for_each(|((south, gain), solved)| *south += gain * solved);
                    }
                    if let Some(after) = after {
                        let solved = &strip[after * LANES..];
                        south
                            .iter_mut()
                            .zip(loss)
                            .zip(solved)
                            .for_each(|((south, loss), solved)| *south -= loss * solved);
                    }
                }
            })
        });
    }

    /// Stops what would come in through sides: where a cell at a side thins much in a step, the linear flux outwards
    /// passes zero, and beyond the side there is no cell that would have to give the ice.
    fn seal(&mut self) {
        let Grid { nx, ny, .. } = self.grid;
        if !self.grid.wraps(0) {
            for east in self.east.chunks_mut(nx + 1) {
                east[0] = east[0].min(0.0);
                east[nx] = east[nx].max(0.0);
            }
        }
        if !self.grid.wraps(1) {
            self.south[..nx].iter_mut().for_each(|flux| *flux = flux.min(0.0));
            self.south[nx * ny..].iter_mut().for_each(|flux| *flux = flux.max(0.0));
        }
    }

    /// The thickness that the fluxes and the balance give.
    fn apply(&mut self, dt_yr: f64, balance: &[f64]) -> Change {
        let grid = self.grid;
        let (nx, stride) = (grid.nx, grid.stride());
        let [over_x, over_y] = grid.cell_m.map(|cell_m| dt_yr / cell_m);
        let (east, south, thickness) = (&self.east, &self.south, &self.thickness);
        let inside = &mut self.next[super::grid::PAD * stride..][..grid.ny * stride];
        let changes = par::collect_all(inside.chunks_mut(stride * ROWS), |part, rows| {
            let mut change = Change::default();
            for (k, next) in rows.chunks_mut(stride).enumerate() {
                let j = part * ROWS + k;
                let depths = grid.row(thickness, 0, j as isize, nx);
                let (east, balance) = (&east[j * (nx + 1)..][..=nx], &balance[j * nx..][..nx]);
                let (north, below) = (&south[j * nx..][..nx], &south[(j + 1) * nx..][..nx]);
                let next = &mut next[super::grid::PAD..][..nx];
                for i in 0..nx {
                    let out = over_x * (east[i + 1] - east[i]) + over_y * (below[i] - north[i]);
                    let snow = dt_yr * balance[i].max(0.0);
                    let flowed = depths[i] - out + snow;
                    change.created_m += if flowed < -1e-9 { -flowed } else { 0.0 };
                    let has = flowed.max(0.0);
                    let depth = (has + dt_yr * balance[i].min(0.0)).max(0.0);
                    change.gained_m += snow;
                    change.melted_m += has - depth;
                    next[i] = depth;
                    let moved = (depth - depths[i]).abs();
                    change.most_m = if moved > change.most_m { moved } else { change.most_m };
                }
            }
            change
        });
        let left_m = dt_yr * self.outflow();
        changes.iter().fold(Change { left_m, ..Change::default() }, |sum, change| Change {
            most_m: sum.most_m.max(change.most_m),
            created_m: sum.created_m + change.created_m,
            gained_m: sum.gained_m + change.gained_m,
            melted_m: sum.melted_m + change.melted_m,
            left_m,
        })
    }

    /// Ice that leaves the world, as thickness of one cell per year.
    fn outflow(&self) -> f64 {
        let Grid { nx, ny, cell_m: [dx, dy], .. } = self.grid;
        let rows = self.east.chunks(nx + 1).map(|east| (east[nx] - east[0]) / dx).sum::<f64>();
        let (first, last) = (&self.south[..nx], &self.south[nx * ny..]);
        rows + last.iter().zip(first).map(|(last, first)| (last - first) / dy).sum::<f64>()
    }

    /// Reduces what overdrawn cells give, in proportion, to what they have and get; for the `last` time all cells, to
    /// what they have, so that none is overdrawn because another gives less.
    fn limit(&mut self, dt_yr: f64, balance: &[f64], last: bool) {
        let grid = self.grid;
        let nx = grid.nx;
        let [over_x, over_y] = grid.cell_m.map(|cell_m| dt_yr / cell_m);
        let (east, south, thickness) = (&self.east, &self.south, &self.thickness);
        let delta = &mut self.delta;
        par::all(delta.chunks_mut(nx), |j, shares| {
            for (i, share) in shares.iter_mut().enumerate() {
                let through = [
                    -over_x * east[j * (nx + 1) + i],
                    over_x * east[j * (nx + 1) + i + 1],
                    -over_y * south[j * nx + i],
                    over_y * south[(j + 1) * nx + i],
                ];
                let out: f64 = through.iter().map(|flux| flux.max(0.0)).sum();
                let gets: f64 = if last { 0.0 } else { through.iter().map(|flux| (-flux).max(0.0)).sum() };
                let has = thickness[grid.at(i, j)] + dt_yr * balance[j * nx + i].max(0.0) + gets;
                *share = if out > has { has.max(0.0) / out } else { 1.0 };
            }
        });
        let (delta, (wrap_x, wrap_y)) = (&self.delta, (grid.wraps(0), grid.wraps(1)));
        par::all(self.east.chunks_mut(nx + 1), |j, east| {
            for (face, flux) in east.iter_mut().enumerate() {
                let giver = if *flux > 0.0 {
                    face.checked_sub(1).or(wrap_x.then_some(nx - 1))
                } else {
                    (face < nx).then_some(face).or(wrap_x.then_some(0))
                };
                *flux *= giver.map_or(1.0, |i| delta[j * nx + i]);
            }
        });
        par::all(self.south.chunks_mut(nx), |j, south| {
            for (i, flux) in south.iter_mut().enumerate() {
                let giver = if *flux > 0.0 {
                    j.checked_sub(1).or(wrap_y.then_some(grid.ny - 1))
                } else {
                    (j < grid.ny).then_some(j).or(wrap_y.then_some(0))
                };
                *flux *= giver.map_or(1.0, |j| delta[j * nx + i]);
            }
        });
    }
}
