//! How a rate changes in the course of a run: a smooth curve through points, and its exact integral.
//!
//! The curve is the monotone cubic of the node `Curve` (Fritsch and Carlson 1980), level beyond its ends. A step takes
//! its mean over the time it covers, so that what a run adds up to does not depend on the steps.

use crate::{combine::curve::spline, prelude::*};

/// A factor over the share of a run that has passed, 0 to 1.
#[derive(Debug)]
pub struct Course {
    /// From left to right; the first begins before all, the last has no end.
    pieces: Vec<Piece>,
}

/// From x on: `c₀ + c₁ t + c₂ t² + c₃ t³`, t = place − x.
#[derive(Debug)]
struct Piece {
    x: f64,
    c: [f64; 4],
}

impl Piece {
    /// The integral from the place where the piece begins.
    fn integral(&self, t: f64) -> f64 {
        let [c0, c1, c2, c3] = self.c;
        t * (c0 + t * (c1 / 2.0 + t * (c2 / 3.0 + t * (c3 / 4.0))))
    }
}

impl Course {
    /// The curve through points with x rising, of which there are at least two.
    #[must_use]
    pub fn new(points: &CurvePoints) -> Self {
        let points = &points.0;
        let level = |[x, y]: [f64; 2]| Piece { x, c: [y, 0.0, 0.0, 0.0] };
        let (first, last) = (points[0], points[points.len() - 1]);
        if points.iter().all(|[_, y]| *y == first[1]) {
            return Self { pieces: vec![level(first)] };
        }
        let slopes = spline::slopes(points);
        let cubics = points.windows(2).zip(slopes.windows(2)).map(|(point, slope)| {
            let ([x, y], width) = (point[0], point[1][0] - point[0][0]);
            let secant = (point[1][1] - y) / width;
            let c2 = (3.0 * secant - 2.0 * slope[0] - slope[1]) / width;
            let c3 = (slope[0] + slope[1] - 2.0 * secant) / (width * width);
            Piece { x, c: [y, slope[0], c2, c3] }
        });
        let before = Piece { x: f64::NEG_INFINITY, ..level(first) };
        Self { pieces: std::iter::once(before).chain(cubics).chain([level(last)]).collect() }
    }

    /// The factor, if it is always the same.
    #[must_use]
    pub fn constant(&self) -> Option<f64> {
        match &self.pieces[..] {
            [only] => Some(only.c[0]),
            _ => None,
        }
    }

    /// The mean of the factor from one share of the run to a later one.
    #[must_use]
    pub fn mean(&self, from: f64, to: f64) -> f64 {
        if let Some(factor) = self.constant() {
            return factor;
        }
        let ends = self.pieces[1..].iter().map(|next| next.x).chain([f64::INFINITY]);
        let parts = self.pieces.iter().zip(ends).map(|(piece, end)| {
            let (lo, hi) = (from.max(piece.x), to.min(end));
            let begins = if piece.x.is_finite() { piece.x } else { lo };
            if lo < hi { piece.integral(hi - begins) - piece.integral(lo - begins) } else { 0.0 }
        });
        parts.sum::<f64>() / (to - from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_the_integral_and_adds_up() {
        let pulse = Course::new(&CurvePoints(vec![[0.1, 0.0], [0.3, 2.0], [0.5, 2.0], [0.9, 0.5]]));
        // The Riemann sum of many values, each the mean over a tiny span.
        let count = 20_000;
        let place = |at: i32| f64::from(at) / f64::from(count) * 1.4 - 0.2;
        let values: Vec<f64> = (0..count).map(|at| pulse.mean(place(at), place(at + 1))).collect();
        let whole = values.iter().sum::<f64>() / f64::from(count);
        assert!((whole - pulse.mean(-0.2, 1.2)).abs() < 1e-12, "{whole}");
        // Level before and after, through its points, symmetric between 0.1 and 0.3.
        assert_eq!([pulse.mean(-0.2, 0.1), pulse.mean(0.3, 0.5), pulse.mean(0.9, 1.2)], [0.0, 2.0, 0.5]);
        assert!((pulse.mean(0.899, 0.901) - 0.5).abs() < 1e-3);
        let monotone = values.windows(2).take(count as usize / 3).all(|pair| pair[1] >= pair[0] - 1e-9);
        assert!(monotone, "rises to the plateau");
    }

    /// From (0, 0) to (1, 1) alone the cubic is the straight line, whose mean from a to b is (a + b) / 2.
    #[test]
    fn a_line_has_the_mean_of_its_ends() {
        let line = Course::new(&CurvePoints(vec![[0.0, 0.0], [1.0, 1.0]]));
        assert!((line.mean(0.25, 0.5) - 0.375).abs() < 1e-15 && line.constant().is_none());
        let even = Course::new(&CurvePoints(vec![[0.0, 1.0], [1.0, 1.0]]));
        assert_eq!((even.mean(0.1, 0.3), even.constant()), (1.0, Some(1.0)));
    }
}
