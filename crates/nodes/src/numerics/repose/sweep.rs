//! One sweep over a tile of cells.

use crate::numerics::simd::simd;

/// Rows and columns of the tiles, which are skipped while they and their neighbours are at rest.
pub const TILE: [usize; 2] = [256, 16];

/// Maximum fraction of its loose layer that a cell gives in a sweep along the slope at a corner, and over a face. The
/// flows of four corners, each at most √½ of the limit, and of four faces take less than the whole layer.
const GIVEN: [f32; 2] = [0.25, 0.0625];

/// Smallest flow of a loose layer that counts as movement, as a fraction of the rise at repose: 1 cm in a sweep on
/// cells of 10 m. Thinner films keep flowing, but the iteration does not continue for them.
const FILM: f32 = 1.5e-3;

/// Inputs of a sweep. Rasters have a halo of one cell.
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
    if ground.loose.is_empty() { all_loose(ground, first, columns, out) } else { layered(ground, first, columns, out) }
}

simd! {
    /// A sweep with everything loose.
    fn all_loose(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
        sweep::<false>(ground, first, columns, out)
    }
}

simd! {
    /// A sweep of a loose layer.
    fn layered(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
        sweep::<true>(ground, first, columns, out)
    }
}

/// Width of the widest row of a tile, including its halo.
const WIDE: usize = TILE[0] + 2;

/// A row of cells and the values derived along it.
struct Row<'a> {
    height: &'a [f32],
    rise: &'a [f32],
    moved: &'a [f32],
    /// Rise from each cell to the next.
    east: [f32; WIDE],
    /// Thickness of the loose layer.
    layer: [f32; WIDE],
}

impl<'a> Row<'a> {
    #[inline(always)]
    fn new<const LAYERED: bool>(ground: &Ground<'a>, at: usize, wide: usize) -> Self {
        let part = |of: &'a [f32]| &of[at..][..wide];
        let (height, rise, moved) = (part(ground.height), part(ground.rise), part(ground.moved));
        let (mut east, mut layer) = ([0.0; WIDE], [0.0; WIDE]);
        for (i, east) in east[..wide - 1].iter_mut().enumerate() {
            *east = (height[i + 1] - height[i]) + (moved[i + 1] - moved[i]);
        }
        if LAYERED {
            for ((layer, loose), moved) in layer[..wide].iter_mut().zip(part(ground.loose)).zip(moved) {
                *layer = (loose + moved).max(0.0);
            }
        }
        Self { height, rise, moved, east, layer }
    }
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
const WALL: f32 = 1.5;

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

    /// Computes the flows between two rows. Returns a nonzero number if a slope is too steep.
    #[inline(always)]
    fn fill<const LAYERED: bool>(&mut self, north: &Row<'_>, south: &Row<'_>, ground: &Ground<'_>, wide: usize) -> u32 {
        let corners = wide - 1;
        let given = GIVEN[0] / ground.step;
        let mut rises = [0.0; WIDE];
        {
            let rises = &mut rises[..wide];
            let (h, hs, d, ds) =
                (&north.height[..wide], &south.height[..wide], &north.moved[..wide], &south.moved[..wide]);
            for i in 0..wide {
                rises[i] = (hs[i] - h[i]) + (ds[i] - d[i]);
            }
        }
        let mut steep = 0;
        {
            let (r, rs) = (&north.rise[..wide], &south.rise[..wide]);
            let (above_layer, below_layer) = (&north.layer[..wide], &south.layer[..wide]);
            let (x, xs, rises) = (&north.east[..corners], &south.east[..corners], &rises[..wide]);
            let (falling, rising) = (&mut self.falling[..corners], &mut self.rising[..corners]);
            let [lean_x, lean_y] = &mut self.lean;
            let (lean_x, lean_y) = (&mut lean_x[..corners], &mut lean_y[..corners]);
            for i in 0..corners {
                let repose = 0.25 * ((r[i] + r[i + 1]) + (rs[i] + rs[i + 1]));
                let (gx, gy) = (0.5 * (x[i] + xs[i]), 0.5 * (rises[i] + rises[i + 1]));
                let open = repose < f32::INFINITY;
                lean_x[i] = if open { gx } else { 0.0 };
                lean_y[i] = if open { gy } else { 0.0 };
                let square = gx * gx + gy * gy;
                let (fall, climb) = (0.5 * (gx + gy), 0.5 * (gx - gy));
                if LAYERED {
                    let slow = 0.5 * ground.tolerance * repose;
                    let gives = |along: Diagonal, donor: f32| {
                        let (share, root) = along.share(repose);
                        let flow = ground.whole(along.flow() * share.min(given * donor * root));
                        let moves =
                            u32::from((share * along.flow()).abs() > slow) & u32::from(flow.abs() > FILM * repose);
                        (flow, moves)
                    };
                    let to_northwest = Diagonal { over: 2.0 * fall, sides: [x[i], rises[i]] };
                    let to_southwest = Diagonal { over: 2.0 * climb, sides: [-rises[i], xs[i]] };
                    let (fallen, falls) =
                        gives(to_northwest, if fall > 0.0 { below_layer[i + 1] } else { above_layer[i] });
                    let (climbed, climbs) =
                        gives(to_southwest, if climb > 0.0 { above_layer[i + 1] } else { below_layer[i] });
                    (falling[i], rising[i]) = (fallen, climbed);
                    steep |= falls | climbs;
                } else {
                    let over = (1.0 - repose * inverse_root(square)).max(0.0);
                    let share = if square > repose * repose { over } else { 0.0 };
                    let limit = repose * (1.0 + ground.tolerance);
                    steep |= u32::from(square > limit * limit);
                    falling[i] = share * fall;
                    rising[i] = share * climb;
                }
            }
        }
        let cells = wide - 2;
        let (r, rs, rises) = (&north.rise[1..=cells], &south.rise[1..=cells], &rises[1..=cells]);
        let (from, to) = (&south.layer[1..=cells], &north.layer[1..=cells]);
        let lean = &self.lean[1][..=cells];
        let out = &mut self.south[..cells];
        for i in 0..cells {
            let repose = 0.5 * (r[i] + rs[i]);
            let (flow, moves) = face::<LAYERED>(rises[i], repose, ground, [to[i], from[i]], lean[i] + lean[i + 1]);
            out[i] = flow;
            steep |= moves;
        }
        steep
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

#[inline(always)]
fn sweep<const LAYERED: bool>(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
    let stride = ground.stride;
    let n = columns[1] - columns[0];
    let wide = n + 2;
    // index of the cell north-west of the strip's first cell
    let mut at = first * stride + columns[0];
    let above = Row::new::<LAYERED>(ground, at, wide);
    at += stride;
    let mut row = Row::new::<LAYERED>(ground, at, wide);
    let (mut north, mut south) = (Between::NONE, Between::NONE);
    let mut steep = north.fill::<LAYERED>(&above, &row, ground, wide);
    let mut east = [0.0; WIDE];
    let mut changed = 0;
    for out in out.chunks_exact_mut(stride) {
        at += stride;
        let lower = Row::new::<LAYERED>(ground, at, wide);
        steep |= south.fill::<LAYERED>(&row, &lower, ground, wide);
        {
            let (r, x, layer) = (&row.rise[..wide], &row.east[..n + 1], &row.layer[..wide]);
            let (a, b, east) = (&north.lean[0][..n + 1], &south.lean[0][..n + 1], &mut east[..n + 1]);
            for i in 0..=n {
                let repose = 0.5 * (r[i] + r[i + 1]);
                let (flow, moves) = face::<LAYERED>(x[i], repose, ground, [layer[i], layer[i + 1]], a[i] + b[i]);
                east[i] = flow;
                steep |= moves;
            }
        }
        let moved = &row.moved[1..=n];
        let out = &mut out[columns[0] + 1..][..n];
        let (up, down, east) = (&north.south[..n], &south.south[..n], &east[..n + 1]);
        let (northwest, northeast) = (&north.falling[..n + 1], &north.rising[..n + 1]);
        let (southeast, southwest) = (&south.falling[..n + 1], &south.rising[..n + 1]);
        for i in 0..n {
            let faces = (east[i + 1] - east[i]) + (down[i] - up[i]);
            let corners = (southeast[i + 1] - northwest[i]) + (northeast[i + 1] - southwest[i]);
            out[i] = moved[i] + ground.step * (faces + corners);
            changed |= u32::from(out[i] != moved[i]);
        }
        row = lower;
        std::mem::swap(&mut north, &mut south);
    }
    Sweep { changed: changed > 0, steep: steep > 0 }
}
