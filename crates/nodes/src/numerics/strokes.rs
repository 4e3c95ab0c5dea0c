//! Brush strokes on the world, in metres.
//!
//! A stroke is a centripetal Catmull-Rom spline through its points, which neither overshoots nor loops between close
//! points. Its effect depends only on the distance to that curve, not on the number of its points or the resolution.

use orograph_graph::{Edge, Stroke, Tool, World};

use super::{along::distance, math::smoothstep, par::rows_within};
use crate::prelude::*;

/// Length of a line segment of a curve, as a fraction of the brush radius.
const PIECE: f64 = 0.25;
/// Maximum number of segments between two points.
const MAX_PIECES: f64 = 32.0;

/// Applies strokes to values, one after the other: `change` receives the stroke, the value and the strength there.
pub(crate) fn act(
    job: &Job<'_>,
    share: [f32; 2],
    paths: &[&Path],
    out: &mut [f32],
    change: impl Fn(&Path, f32, f32) -> f32 + Sync,
) -> Result<(), NodeError> {
    let window = job.window();
    let (cell_m, first) = (job.cell_m(), window.centre_m(0, 0)[0]);
    rows_within(job, share, out, |j, row| {
        let y = window.centre_m(0, j)[1];
        let mut squares = Vec::new();
        for path in paths.iter().filter(|path| path.rows[0] <= y && y <= path.rows[1]) {
            squares.clear();
            squares.resize(row.len(), f64::INFINITY);
            let (mut least, mut most) = (row.len(), 0);
            for piece in &path.pieces {
                let Some([from, to]) = piece.columns(y, path.radius_m) else { continue };
                // cells whose centres are within reach, and one more on each side against rounding
                let from = (((from - first) / cell_m).floor().max(0.0) as usize).min(row.len());
                let to = (((to - first) / cell_m).ceil() + 1.0).clamp(0.0, row.len() as f64) as usize;
                (least, most) = (least.min(from), most.max(to));
                for (i, square) in squares.iter_mut().enumerate().take(to).skip(from) {
                    *square = square.min(piece.square([window.centre_m(i, j)[0], y]));
                }
            }
            for (value, square) in row.iter_mut().zip(&squares).take(most).skip(least) {
                let weight = path.weight(*square);
                if weight > 0.0 {
                    *value = change(path, *value, (path.strength * weight) as f32);
                }
            }
        }
    })
}

/// A stroke as line segments.
pub(crate) struct Path {
    pub tool: Tool,
    pub radius_m: f64,
    strength: f64,
    hardness: f64,
    pieces: Vec<Piece>,
    /// Extent to the north and south.
    rows: [f64; 2],
}

impl Path {
    pub fn new(stroke: &Stroke, world: &World) -> Self {
        let curve = curve(&stroke.points, stroke.radius);
        let sides = world.boundary;
        let shifts = |periodic: bool, side_m: f64| if periodic { vec![0.0, -side_m, side_m] } else { vec![0.0] };
        let across = shifts(sides.west == Edge::Periodic, world.size[0]);
        let along = shifts(sides.north == Edge::Periodic, world.size[1]);
        let mut pieces = Vec::new();
        for (dx, dy) in across.iter().flat_map(|dx| along.iter().map(move |dy| (dx, dy))) {
            let moved = |[x, y]: [f64; 2]| [x + dx, y + dy];
            let whole = curve.windows(2).map(|ends| [ends[0], ends[1]]);
            let dot = curve.first().filter(|_| curve.len() == 1).map(|point| [*point; 2]);
            pieces.extend(whole.chain(dot).map(|[from, to]| Piece { from: moved(from), to: moved(to) }));
        }
        let ends = || pieces.iter().flat_map(|piece| [piece.from[1], piece.to[1]]);
        let rows = [
            ends().fold(f64::INFINITY, f64::min) - stroke.radius,
            ends().fold(f64::NEG_INFINITY, f64::max) + stroke.radius,
        ];
        let Stroke { tool, radius: radius_m, strength, hardness, .. } = *stroke;
        Self { tool, radius_m, strength, hardness, pieces, rows }
    }

    /// Returns the weight of the brush at a distance, given its square.
    fn weight(&self, square: f64) -> f64 {
        let part = square.sqrt() / self.radius_m;
        if part >= 1.0 {
            0.0
        } else if part <= self.hardness {
            1.0
        } else {
            1.0 - smoothstep((part - self.hardness) / (1.0 - self.hardness))
        }
    }
}

/// A line segment, in metres.
struct Piece {
    from: [f64; 2],
    to: [f64; 2],
}

impl Piece {
    /// Returns the range along x that may be within a distance of a row. Returns None if there is none.
    fn columns(&self, y: f64, radius_m: f64) -> Option<[f64; 2]> {
        let [from, to] = [self.from, self.to];
        let near = from[1].min(to[1]) - radius_m <= y && y <= from[1].max(to[1]) + radius_m;
        near.then(|| [from[0].min(to[0]) - radius_m, from[0].max(to[0]) + radius_m])
    }

    /// Returns the squared distance to a point.
    fn square(&self, [x, y]: [f64; 2]) -> f64 {
        let [ex, ey] = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        let [dx, dy] = [x - self.from[0], y - self.from[1]];
        let length = ex * ex + ey * ey;
        let t = if length > 0.0 { ((dx * ex + dy * ey) / length).clamp(0.0, 1.0) } else { 0.0 };
        let (px, py) = (dx - t * ex, dy - t * ey);
        px * px + py * py
    }
}

/// Returns the vertices of the curve through points.
pub(crate) fn curve(points: &[[f64; 2]], radius_m: f64) -> Vec<[f64; 2]> {
    let mut points = points.to_vec();
    points.dedup();
    let (&[first, .., last], count) = (&points[..], points.len()) else { return points };
    // beyond its ends it continues straight
    let beyond = |end: [f64; 2], before: [f64; 2]| [2.0 * end[0] - before[0], 2.0 * end[1] - before[1]];
    let mut through = vec![beyond(first, points[1])];
    through.extend(&points);
    through.push(beyond(last, points[count - 2]));
    let mut corners = vec![first];
    for ends in through.windows(4) {
        let length = distance(ends[1], ends[2]);
        let pieces = (length / (PIECE * radius_m)).ceil().clamp(1.0, MAX_PIECES) as usize;
        corners.extend((1..pieces).map(|k| between(ends, k as f64 / pieces as f64)));
        corners.push(ends[2]);
    }
    corners
}

/// Returns the point at `part` of a centripetal Catmull-Rom spline between the second and third of four points, by the
/// algorithm of Barry and Goldman.
fn between(ends: &[[f64; 2]], part: f64) -> [f64; 2] {
    let mut knots = [0.0; 4];
    for k in 0..3 {
        knots[k + 1] = knots[k] + distance(ends[k], ends[k + 1]).sqrt();
    }
    let t = knots[1] + part * (knots[2] - knots[1]);
    let mix = |a: [f64; 2], b: [f64; 2], from: f64, to: f64| {
        let share = (t - from) / (to - from);
        [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share]
    };
    let a = [0, 1, 2].map(|k| mix(ends[k], ends[k + 1], knots[k], knots[k + 1]));
    let b = [0, 1].map(|k| mix(a[k], a[k + 1], knots[k], knots[k + 2]));
    mix(b[0], b[1], knots[1], knots[2])
}
