//! A monotone piecewise cubic.

use crate::numerics::simd::simd;

/// Samples per SIMD block.
const LANES: usize = 16;

/// A cubic from x on: `y + t (a + t (b + t c))` with t = value − x.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    x: f32,
    y: f32,
    a: f32,
    b: f32,
    c: f32,
}

/// The monotone cubic through points, continued as straight lines or as constants.
#[derive(Clone, Debug)]
pub(super) struct Spline {
    /// The part before the first point.
    before: Piece,
    /// One piece per point, from left to right: the cubic to the next point, or the continuation after the last point.
    pieces: Vec<Piece>,
}

/// Words of a piece in a table for shaders.
pub(super) const WORDS: usize = 5;

impl Spline {
    /// Returns the pieces as a table for shaders, from left to right: the one before the first point first.
    pub fn words(&self) -> Vec<u32> {
        let pieces = std::iter::once(&self.before).chain(&self.pieces);
        pieces.flat_map(|Piece { x, y, a, b, c }| [x, y, a, b, c].map(|v| v.to_bits())).collect()
    }

    /// Creates the curve through at least two points with ascending x.
    pub fn new(points: &[[f64; 2]], clamp: bool) -> Self {
        let slopes = slopes(points);
        let straight = |[x, y]: [f64; 2], slope: f64| Piece {
            x: x as f32,
            y: y as f32,
            a: if clamp { 0.0 } else { slope as f32 },
            b: 0.0,
            c: 0.0,
        };
        let cubics = points.windows(2).zip(slopes.windows(2)).map(|(point, slope)| {
            let ([x0, y0], [x1, y1]) = (point[0], point[1]);
            let width = x1 - x0;
            let secant = (y1 - y0) / width;
            Piece {
                x: x0 as f32,
                y: y0 as f32,
                a: slope[0] as f32,
                b: ((3.0 * secant - 2.0 * slope[0] - slope[1]) / width) as f32,
                c: ((slope[0] + slope[1] - 2.0 * secant) / (width * width)) as f32,
            }
        });
        let mut pieces: Vec<Piece> = cubics.collect();
        let (last, end) = (points.len() - 1, slopes[points.len() - 1]);
        pieces.push(straight(points[last], end));
        Self { before: straight(points[0], slopes[0]), pieces }
    }

    /// Replaces each value by the value of the curve.
    pub fn apply(&self, values: &mut [f32]) {
        let mut chunks = values.chunks_exact_mut(LANES);
        for chunk in &mut chunks {
            if let Some(chunk) = chunk.first_chunk_mut() {
                evaluate(chunk, &self.before, &self.pieces);
            }
        }
        let rest = chunks.into_remainder();
        let mut padded = [0.0; LANES];
        padded[..rest.len()].copy_from_slice(rest);
        evaluate(&mut padded, &self.before, &self.pieces);
        rest.copy_from_slice(&padded[..rest.len()]);
    }
}

/// Returns the slope of the curve at each point, after Fritsch and Carlson: the mean of the secants on both sides, 0 at
/// a local extreme. Slopes are limited so that (slope / secant) at both ends of a piece lies within a circle of radius
/// 3, which keeps the piece monotone. At the first and last point it is the secant.
pub fn slopes(points: &[[f64; 2]]) -> Vec<f64> {
    let secants: Vec<f64> = points.windows(2).map(|p| (p[1][1] - p[0][1]) / (p[1][0] - p[0][0])).collect();
    let mut slopes = vec![secants[0]];
    slopes.extend(secants.windows(2).map(|s| if s[0] * s[1] > 0.0 { (s[0] + s[1]) / 2.0 } else { 0.0 }));
    slopes.push(secants[secants.len() - 1]);
    for (k, &secant) in secants.iter().enumerate() {
        if secant == 0.0 {
            (slopes[k], slopes[k + 1]) = (0.0, 0.0);
            continue;
        }
        let (left, right) = (slopes[k] / secant, slopes[k + 1] / secant);
        let radius = (left * left + right * right).sqrt();
        if radius > 3.0 {
            slopes[k] = 3.0 / radius * left * secant;
            slopes[k + 1] = 3.0 / radius * right * secant;
        }
    }
    slopes
}

simd! {
    fn evaluate(values: &mut [f32; LANES], before: &Piece, pieces: &[Piece]) {
        let mut lanes = [[before.x; LANES], [before.y; LANES], [before.a; LANES], [before.b; LANES], [before.c; LANES]];
        for piece in pieces {
            for l in 0..LANES {
                let here = values[l] >= piece.x;
                lanes[0][l] = if here { piece.x } else { lanes[0][l] };
                lanes[1][l] = if here { piece.y } else { lanes[1][l] };
                lanes[2][l] = if here { piece.a } else { lanes[2][l] };
                lanes[3][l] = if here { piece.b } else { lanes[3][l] };
                lanes[4][l] = if here { piece.c } else { lanes[4][l] };
            }
        }
        let [x, y, a, b, c] = lanes;
        for l in 0..LANES {
            let t = values[l] - x[l];
            values[l] = y[l] + t * (a[l] + t * (b[l] + t * c[l]));
        }
    }
}
