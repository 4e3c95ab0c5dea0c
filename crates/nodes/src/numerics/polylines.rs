//! Distance to the edge of lines with widths.
//!
//! The world is processed in blocks of rows and columns. A segment can only be the nearest of a cell if it is no farther
//! from the block's centre than the nearest segment plus twice the block's radius, so most segments of long lines are
//! skipped, and the work does not depend on how far distances reach.

use orograph_graph::{Edge, Job, Lines, NodeError, Window};

use super::par;

/// Cells along a block.
const BLOCK: usize = 16;

/// A piece of a line: its ends, and half of its width at each.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from: [f64; 2],
    along: [f64; 2],
    /// Reciprocal of its squared length.
    per_square: f64,
    half_m: [f64; 2],
}

impl Piece {
    /// Distance of a place from the edge of the line in metres; negative within its width.
    fn distance(&self, at: [f64; 2]) -> f64 {
        let off = [0, 1].map(|axis| at[axis] - self.from[axis]);
        let t = ((off[0] * self.along[0] + off[1] * self.along[1]) * self.per_square).clamp(0.0, 1.0);
        let [x, y] = [0, 1].map(|axis| off[axis] - t * self.along[axis]);
        (x * x + y * y).sqrt() - (self.half_m[0] + (self.half_m[1] - self.half_m[0]) * t)
    }

    /// How much the half width changes along the piece: a bound on how far [`Self::distance`] can jump.
    fn spread(&self) -> f64 {
        (self.half_m[1] - self.half_m[0]).abs()
    }
}

/// Lowers each sample of the job's window to the distance from the edge of the nearest line, in metres, negative within
/// its width. Lines continue across periodic sides of the world.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn approach(job: &Job<'_>, lines: &Lines, distances: &mut [f32]) -> Result<(), NodeError> {
    let window = job.window();
    let pieces = pieces(&window, lines);
    if pieces.is_empty() {
        return Ok(());
    }
    let nx = window.nx();
    par::each(distances.chunks_mut(nx * BLOCK), |band, rows| {
        job.check()?;
        let first = band * BLOCK;
        let ny = rows.len() / nx;
        let mut near = Vec::new();
        for left in (0..nx).step_by(BLOCK) {
            let right = nx.min(left + BLOCK);
            nearest(&pieces, &window, [left, right], [first, first + ny], &mut near);
            for j in 0..ny {
                for i in left..right {
                    let at = window.centre_m(i, first + j);
                    let least = near.iter().map(|piece| piece.distance(at)).fold(f64::INFINITY, f64::min);
                    let sample = &mut rows[j * nx + i];
                    *sample = sample.min(least as f32);
                }
            }
        }
        Ok(())
    })
}

/// Collects the pieces that can be the nearest of a cell of a block.
fn nearest(pieces: &[Piece], window: &Window, columns: [usize; 2], rows: [usize; 2], near: &mut Vec<Piece>) {
    let corners = [window.centre_m(columns[0], rows[0]), window.centre_m(columns[1] - 1, rows[1] - 1)];
    let centre = [0, 1].map(|axis| 0.5 * (corners[0][axis] + corners[1][axis]));
    let half = [0, 1].map(|axis| 0.5 * (corners[1][axis] - corners[0][axis]));
    // widened by a millionth of the distance for rounding
    let radius = (half[0] * half[0] + half[1] * half[1]).sqrt();
    let most = |piece: &Piece| {
        let distance = piece.distance(centre);
        distance + piece.spread() + radius + 1e-6 * distance.abs()
    };
    let bound = pieces.iter().map(most).fold(f64::INFINITY, f64::min);
    near.clear();
    near.extend(pieces.iter().filter(|piece| {
        let distance = piece.distance(centre);
        distance - piece.spread() - radius - 1e-6 * distance.abs() <= bound
    }));
}

/// The pieces of lines, repeated across periodic sides.
fn pieces(window: &Window, lines: &Lines) -> Vec<Piece> {
    let sides = window.world.boundary;
    let wraps = [[sides.west, sides.east], [sides.north, sides.south]].map(|pair| pair.contains(&Edge::Periodic));
    let [across, down] = wraps.map(|wraps| if wraps { -1..=1 } else { 0..=0 });
    let shifts: Vec<[f64; 2]> = down
        .flat_map(|down| across.clone().map(move |across| [f64::from(across), f64::from(down)]))
        .map(|shift| [0, 1].map(|axis| shift[axis] * window.world.size[axis]))
        .collect();
    let pairs = lines.lines.iter().flat_map(|line| line.vertices.windows(2));
    pairs
        .flat_map(|pair| {
            let [from, to] = [pair[0].position_m, pair[1].position_m];
            let along = [to[0] - from[0], to[1] - from[1]];
            let square = along[0] * along[0] + along[1] * along[1];
            let per_square = if square > 0.0 { 1.0 / square } else { 0.0 };
            let half_m = [0.5 * pair[0].width_m, 0.5 * pair[1].width_m];
            shifts.iter().map(move |shift| Piece {
                from: [from[0] + shift[0], from[1] + shift[1]],
                along,
                per_square,
                half_m,
            })
        })
        .collect()
}
