//! One sweep of a slide over a tile of cells.

use crate::numerics::simd::simd;

/// Rows and columns of the tiles that are skipped while nothing moves around them.
pub const TILE: [usize; 2] = [256, 16];

/// The most of its loose layer that a cell gives along the slope at a corner, and over a face, in a sweep. Four corners,
/// whose flows are at most √½ of this, and four faces take less than the whole of it.
const GIVEN: [f32; 2] = [0.25, 0.0625];

/// The least flow of a loose layer that counts as moving, as a share of the rise at repose: 1 cm in a sweep on
/// cells of 10 m. What is thinner runs on, but is not waited for.
const FILM: f32 = 1.5e-3;

/// What a sweep reads. Rasters have a ring of one cell around them.
pub struct Ground<'a> {
    pub height: &'a [f32],
    /// Rise at repose between neighbours, in metres; infinite where closed.
    pub rise: &'a [f32],
    /// Thickness of what was loose before anything moved; empty where everything is.
    pub loose: &'a [f32],
    pub moved: &'a [f32],
    pub stride: usize,
    pub step: f32,
    /// Excess over repose that is tolerated, as a fraction of repose.
    pub tolerance: f32,
    /// Flows of a loose layer are whole multiples of this, in metres.
    pub quantum: f32,
}

impl Ground<'_> {
    /// A flow without what is less than a quantum, and at most half of one more.
    ///
    /// What cells have moved are then whole multiples too and add without rounding, so that a layer thins to nothing
    /// without a trace of it being lost in a deep pile below. Nothing grows, since that might be more than there is.
    #[inline(always)]
    fn whole(&self, flow: f32) -> f32 {
        // one and a half times 2^23: numbers around it have no digits below one
        let digits = 12_582_912.0 * self.quantum;
        ((flow.abs() - 0.5 * self.quantum + digits) - digits).copysign(flow)
    }
}

/// What a sweep found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sweep {
    pub changed: bool,
    /// Whether any slope exceeds its repose by more than the tolerance and has something loose on it.
    pub steep: bool,
}

/// Sweeps the columns of a strip of rows that begins at row `first`; `out` is the strip, rings included.
pub fn tile(ground: &Ground<'_>, first: usize, columns: [usize; 2], out: &mut [f32]) -> Sweep {
    if ground.loose.is_empty() { all_loose(ground, first, columns, out) } else { layered(ground, first, columns, out) }
}

simd! {
    /// A sweep of ground that is loose all the way down.
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

/// Widest row of a tile with its ring.
const WIDE: usize = TILE[0] + 2;

/// A row of cells and what is worked out along it.
struct Row<'a> {
    height: &'a [f32],
    rise: &'a [f32],
    moved: &'a [f32],
    /// Rise from each cell to the next.
    east: [f32; WIDE],
    /// Thickness of what is loose.
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

/// What flows between two rows, where positive is to the north and, across corners, from east to west.
struct Between {
    /// Over the face between each cell and that to the south.
    south: [f32; WIDE],
    /// From south-east to north-west across each corner.
    falling: [f32; WIDE],
    /// From north-east to south-west across each corner.
    rising: [f32; WIDE],
    /// Rise of the plane at each corner; 0 where closed.
    lean: [[f32; WIDE]; 2],
}

/// 1 / √x to 5e-6, the same on every machine: halved exponent and two steps of Newton's method.
#[inline(always)]
fn inverse_root(x: f32) -> f32 {
    let mut y = f32::from_bits(0x5f37_59df - (x.to_bits() >> 1));
    let half = 0.5 * x;
    y *= 1.5 - half * y * y;
    y * (1.5 - half * y * y)
}

/// The part of a rise that is above repose.
#[inline(always)]
fn above(rise: f32, repose: f32) -> f32 {
    rise - rise.max(-repose).min(repose)
}

/// How far the sides of a diagonal count above it, in rises at repose: more than on any slope about at repose.
const WALL: f32 = 1.5;

/// Two cells across a corner, and how far the other two stand above the first of them, in metres.
#[derive(Clone, Copy)]
struct Diagonal {
    /// How far the second stands above the first.
    over: f32,
    sides: [f32; 2],
}

impl Diagonal {
    #[inline(always)]
    fn flow(self) -> f32 {
        0.5 * self.over
    }

    /// The share of the flow that is above repose, and one over the steepness. Both sides count up to one height above the
    /// two, so that walls of bare rock beside a gully do not push what lies there: debris rests in it as on a slope.
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

    /// Fills the flows between two rows; not 0 if anything is too steep.
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

/// What flows over a face with a rise across it, between layers before and behind it, and 1 if it is too steep, else 0.
/// `lean` is the sum of the rises that the corners at its ends see in that direction, and act on.
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
    // index of the cell north-west of the strip's first
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
