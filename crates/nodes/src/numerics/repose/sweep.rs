//! One sweep over a tile of cells.

use crate::numerics::simd::simd;

/// Columns and rows of the tiles, which are skipped while they and their neighbours are at rest. The corners of a row
/// of cells, one more than the columns, fill vectors of any width.
pub const TILE: [usize; 2] = [127, 8];

/// Maximum fraction of its loose layer that a cell gives in a sweep along the slope at a corner, and over a face. The
/// flows of four corners, each at most √½ of the limit, and of four faces take less than the whole layer.
pub const GIVEN: [f32; 2] = [0.25, 0.0625];

/// Smallest flow of a loose layer that counts as movement, as a fraction of the rise at repose: 1 cm in a sweep on
/// cells of 10 m. Thinner films keep flowing, but the iteration does not continue for them.
pub const FILM: f32 = 1.5e-3;

/// Inputs of a sweep. Rasters have a halo of one cell, and room for [`WIDE`] cells after the last row.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    pub height: &'a [f32],
    /// Rise at repose between neighbours, in metres; infinite where closed.
    pub rise: &'a [f32],
    /// Initial thickness of the loose layer; empty if everything is loose.
    pub loose: &'a [f32],
    pub moved: &'a [f32],
    pub stride: usize,
    pub step: f32,
    /// Excess over repose that is tolerated, as a fraction of repose.
    pub tolerance: f32,
    /// Flows of a loose layer are multiples of this, in metres.
    pub quantum: f32,
    /// The rise at repose of the tile and its halo, if it is the same in all cells.
    pub even: Option<f32>,
}

impl Ground<'_> {
    /// Rounds the magnitude of a flow down to a multiple of the quantum.
    ///
    /// The gains of cells are then multiples too and add without rounding, so that a layer thins to exactly zero and
    /// its last film is not lost to rounding in a deep pile below. Flows are never rounded up: a donor might not have
    /// as much.
    #[inline(always)]
    fn whole(&self, flow: f32) -> f32 {
        // 1.5 · 2^23 quanta: numbers of that size are one quantum apart
        let digits = 12_582_912.0 * self.quantum;
        ((flow.abs() - 0.5 * self.quantum + digits) - digits).copysign(flow)
    }
}

/// The result of a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sweep {
    pub changed: bool,
    /// True if a slope with loose material exceeds repose by more than the tolerance.
    pub steep: bool,
}

/// Sweeps the columns of a strip of rows that begins at row `first`; `out` is the strip, including its halo.
pub fn tile(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
    let is_narrow = columns[1] - columns[0] < NARROW;
    match (ground.loose.is_empty(), is_narrow) {
        (true, _) if ground.even.is_some() => all_loose_even(ground, first, columns, out),
        (true, false) => all_loose(ground, first, columns, out),
        (true, true) => all_loose_narrow(ground, first, columns, out),
        (false, false) => layered(ground, first, columns, out),
        (false, true) => layered_narrow(ground, first, columns, out),
    }
}

simd! {
    /// A sweep with everything loose.
    fn all_loose(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
        sweep::<false, false, LANES>(ground, first, columns, out)
    }
}

simd! {
    /// A sweep with everything loose over fewer columns than [`NARROW`].
    fn all_loose_narrow(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
        sweep::<false, false, NARROW>(ground, first, columns, out)
    }
}

simd! {
    /// A sweep with everything loose and the same repose everywhere.
    fn all_loose_even(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
        sweep::<false, true, LANES>(ground, first, columns, out)
    }
}

simd! {
    /// A sweep of a loose layer.
    fn layered(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
        sweep::<true, false, LANES>(ground, first, columns, out)
    }
}

simd! {
    /// A sweep of a loose layer over fewer columns than [`NARROW`].
    fn layered_narrow(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
        sweep::<true, false, NARROW>(ground, first, columns, out)
    }
}

/// Width of a tile's row, including its halo.
pub const WIDE: usize = TILE[0] + 2;

/// Number of corners along a row. Loops run over so many lanes; those beyond the cells of a tile are ignored.
const LANES: usize = TILE[0] + 1;

/// Number of corners along a row of a narrow tile, such as the last tile of each row in rasters of 256, 512 or 1024
/// columns.
const NARROW: usize = 16;

/// A row of cells and the values derived along it.
struct Row<'a> {
    height: &'a [f32; WIDE],
    rise: &'a [f32; WIDE],
    moved: &'a [f32; WIDE],
    /// Rise from each cell to the next.
    east: [f32; LANES],
    /// Thickness of the loose layer.
    layer: [f32; WIDE],
}

impl<'a> Row<'a> {
    const NONE: Self =
        Self { height: &[0.0; WIDE], rise: &[0.0; WIDE], moved: &[0.0; WIDE], east: [0.0; LANES], layer: [0.0; WIDE] };

    /// Reads the row that begins at the cell `at`.
    #[inline(always)]
    fn read<const LAYERED: bool, const N: usize>(&mut self, ground: &Ground<'a>, at: usize) {
        self.height = wide(ground.height, at);
        self.rise = wide(ground.rise, at);
        self.moved = wide(ground.moved, at);
        let (height, moved) = (self.height, self.moved);
        for i in 0..N {
            self.east[i] = (height[i + 1] - height[i]) + (moved[i + 1] - moved[i]);
        }
        if LAYERED {
            let loose = wide(ground.loose, at);
            for i in 0..=N {
                self.layer[i] = (loose[i] + moved[i]).max(0.0);
            }
        }
    }
}

/// Returns the row of a tile that begins at a cell.
#[inline(always)]
fn wide(raster: &[f32], at: usize) -> &[f32; WIDE] {
    raster[at..].first_chunk().expect("there is room for a row after the last one")
}

/// Flows between two rows, positive to the north and, across corners, from east to west.
struct Between {
    /// Over the face between each cell and its southern neighbour.
    south: [f32; WIDE],
    /// From south-east to north-west across each corner.
    falling: [f32; WIDE],
    /// From north-east to south-west across each corner.
    rising: [f32; WIDE],
    /// Gradient of the plane at each corner; 0 where closed.
    lean: [[f32; WIDE]; 2],
}

/// 1 / √x to 5e-6, the same on every machine: an estimate from the halved exponent and two Newton steps.
#[inline(always)]
fn inverse_root(x: f32) -> f32 {
    let mut y = f32::from_bits(0x5f37_59df - (x.to_bits() >> 1));
    let half = 0.5 * x;
    y *= 1.5 - half * y * y;
    y * (1.5 - half * y * y)
}

/// Returns the part of a rise that exceeds repose.
#[inline(always)]
fn above(rise: f32, repose: f32) -> f32 {
    rise - rise.max(-repose).min(repose)
}

/// Limit on the height of the side cells above a diagonal, in rises at repose; slopes near repose stay below it.
pub const WALL: f32 = 1.5;

/// Two opposite cells of a corner, and the heights of the other two above the first of them, in metres.
#[derive(Clone, Copy)]
struct Diagonal {
    /// Height of the second cell above the first.
    over: f32,
    sides: [f32; 2],
}

impl Diagonal {
    #[inline(always)]
    fn flow(self) -> f32 {
        0.5 * self.over
    }

    /// Returns the fraction of the flow that exceeds repose, and the reciprocal of the slope. The height of the side
    /// cells above the two is limited, so that walls of bare rock next to a gully do not push the debris in it, which
    /// rests there as on a slope.
    #[inline(always)]
    fn share(self, repose: f32) -> (f32, f32) {
        let top = self.over.max(0.0) + WALL * repose;
        let [a, b] = self.sides.map(|side| side.min(top));
        let (x, y) = (0.5 * (self.over + (a - b)), 0.5 * (self.over - (a - b)));
        let square = x * x + y * y;
        let root = inverse_root(square);
        let over = (1.0 - repose * root).max(0.0);
        (if square > repose * repose { over } else { 0.0 }, root)
    }
}

impl Between {
    const NONE: Self = Self { south: [0.0; WIDE], falling: [0.0; WIDE], rising: [0.0; WIDE], lean: [[0.0; WIDE]; 2] };

    /// Computes the flows between two rows, and marks lanes where a slope is too steep: corners and faces.
    #[inline(always)]
    fn fill<const LAYERED: bool, const EVEN: bool, const N: usize>(
        &mut self,
        [north, south]: [&Row<'_>; 2],
        ground: &Ground<'_>,
        marks: &mut Marks,
    ) {
        let given = GIVEN[0] / ground.step;
        let even = ground.even.unwrap_or_default();
        let mut rises = [0.0; WIDE];
        for (i, rise) in rises.iter_mut().enumerate().take(N + 1) {
            *rise = (south.height[i] - north.height[i]) + (south.moved[i] - north.moved[i]);
        }
        let (r, rs) = (north.rise, south.rise);
        let (x, xs) = (&north.east, &south.east);
        for i in 0..N {
            let repose = if EVEN { even } else { 0.25 * ((r[i] + r[i + 1]) + (rs[i] + rs[i + 1])) };
            let (gx, gy) = (0.5 * (x[i] + xs[i]), 0.5 * (rises[i] + rises[i + 1]));
            let open = EVEN || repose < f32::INFINITY;
            self.lean[0][i] = if open { gx } else { 0.0 };
            self.lean[1][i] = if open { gy } else { 0.0 };
            let square = gx * gx + gy * gy;
            let (fall, climb) = (0.5 * (gx + gy), 0.5 * (gx - gy));
            if LAYERED {
                let slow = 0.5 * ground.tolerance * repose;
                let gives = |along: Diagonal, donor: f32| {
                    let (share, root) = along.share(repose);
                    let flow = ground.whole(along.flow() * share.min(given * donor * root));
                    let moves = u32::from((share * along.flow()).abs() > slow) & u32::from(flow.abs() > FILM * repose);
                    (flow, moves)
                };
                let to_northwest = Diagonal { over: 2.0 * fall, sides: [x[i], rises[i]] };
                let to_southwest = Diagonal { over: 2.0 * climb, sides: [-rises[i], xs[i]] };
                // all four are read before one is chosen, which vectors do without gathering
                let [northwest, northeast] = [north.layer[i], north.layer[i + 1]];
                let [southwest, southeast] = [south.layer[i], south.layer[i + 1]];
                let (fallen, falls) = gives(to_northwest, if fall > 0.0 { southeast } else { northwest });
                let (climbed, climbs) = gives(to_southwest, if climb > 0.0 { northeast } else { southwest });
                (self.falling[i], self.rising[i]) = (fallen, climbed);
                marks.corners[i] |= falls | climbs;
            } else {
                let over = (1.0 - repose * inverse_root(square)).max(0.0);
                let share = if square > repose * repose { over } else { 0.0 };
                let limit = repose * (1.0 + ground.tolerance);
                marks.corners[i] |= u32::from(square > limit * limit);
                self.falling[i] = share * fall;
                self.rising[i] = share * climb;
            }
        }
        for i in 0..N {
            let repose = if EVEN { even } else { 0.5 * (r[i + 1] + rs[i + 1]) };
            let layers = [north.layer[i + 1], south.layer[i + 1]];
            let lean = self.lean[1][i] + self.lean[1][i + 1];
            let (flow, moves) = face::<LAYERED>(rises[i + 1], repose, ground, layers, lean);
            self.south[i] = flow;
            marks.faces[i] |= moves;
        }
    }
}

/// Returns the flow over a face, given the rise across it and the layers on both sides, and 1 if it is too steep,
/// otherwise 0. `lean` is the sum of the rises in this direction at the corners of its two ends, whose flows already
/// act on them.
#[inline(always)]
fn face<const LAYERED: bool>(
    rise: f32,
    repose: f32,
    ground: &Ground<'_>,
    [low, high]: [f32; 2],
    lean: f32,
) -> (f32, u32) {
    let flow = 0.5 * above(rise, repose.max(0.5 * lean.abs()));
    let moves = u32::from(rise.abs() > (1.0 + ground.tolerance) * repose);
    if LAYERED {
        let given = GIVEN[1] / ground.step;
        let limited = ground.whole(flow.max(-(given * low)).min(given * high));
        let moves = u32::from(flow.abs() > 0.5 * ground.tolerance * repose) & u32::from(limited.abs() > FILM * repose);
        (limited, moves)
    } else {
        (flow, moves)
    }
}

/// What a sweep found, by lane: corners and faces that are too steep, and cells that changed.
struct Marks {
    corners: [u32; LANES],
    faces: [u32; LANES],
    changed: [u32; LANES],
}

#[inline(always)]
fn sweep<const LAYERED: bool, const EVEN: bool, const N: usize>(
    ground: &Ground<'_>,
    first: usize,
    columns: [usize; 2],
    out: &mut [f32],
) -> Sweep {
    let stride = ground.stride;
    let n = columns[1] - columns[0];
    // index of the cell north-west of the strip's first cell
    let start = first * stride + columns[0];
    let (mut a, mut b) = (Row::NONE, Row::NONE);
    let (mut c, mut d) = (Between::NONE, Between::NONE);
    let mut marks = Marks { corners: [0; LANES], faces: [0; LANES], changed: [0; LANES] };
    b.read::<LAYERED, N>(ground, start);
    a.read::<LAYERED, N>(ground, start + stride);
    c.fill::<LAYERED, EVEN, N>([&b, &a], ground, &mut marks);
    for (j, out) in out.chunks_exact_mut(stride).enumerate() {
        let below = start + (j + 2) * stride;
        // rows and the flows between them take turns, which copies nothing and tells vectors that they are apart
        let gains = if j % 2 == 0 {
            line::<LAYERED, EVEN, N>(ground, below, &a, &mut b, &c, &mut d, &mut marks)
        } else {
            line::<LAYERED, EVEN, N>(ground, below, &b, &mut a, &d, &mut c, &mut marks)
        };
        out[columns[0] + 1..][..n].copy_from_slice(&gains[..n]);
    }
    let any = |lanes: &[u32]| lanes.iter().fold(0, |any, lane| any | lane) > 0;
    Sweep { changed: any(&marks.changed[..n]), steep: any(&marks.corners[..=n]) | any(&marks.faces[..n]) }
}

/// Returns the gains of the cells of a row, given the flows to its north, and reads the row below it at `at`.
#[inline(always)]
fn line<'a, const LAYERED: bool, const EVEN: bool, const N: usize>(
    ground: &Ground<'a>,
    at: usize,
    row: &Row<'a>,
    below: &mut Row<'a>,
    north: &Between,
    south: &mut Between,
    marks: &mut Marks,
) -> [f32; LANES] {
    below.read::<LAYERED, N>(ground, at);
    south.fill::<LAYERED, EVEN, N>([row, below], ground, marks);
    let (mut east, mut gains) = ([0.0; WIDE], [0.0; LANES]);
    let (rise, moved) = (row.rise, row.moved);
    let even = ground.even.unwrap_or_default();
    for i in 0..N {
        let repose = if EVEN { even } else { 0.5 * (rise[i] + rise[i + 1]) };
        let layers = [row.layer[i], row.layer[i + 1]];
        let lean = north.lean[0][i] + south.lean[0][i];
        let (flow, moves) = face::<LAYERED>(row.east[i], repose, ground, layers, lean);
        east[i] = flow;
        marks.corners[i] |= moves;
    }
    for i in 0..N {
        let faces = (east[i + 1] - east[i]) + (south.south[i] - north.south[i]);
        let corners = (south.falling[i + 1] - north.falling[i]) + (north.rising[i + 1] - south.rising[i]);
        let before = moved[i + 1];
        gains[i] = before + ground.step * (faces + corners);
        marks.changed[i] |= u32::from(gains[i] != before);
    }
    gains
}
