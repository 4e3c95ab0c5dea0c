//! One sample at a time: the reference that the row-coherent evaluation must equal to the last bit.

use super::{
    Gradients, Octave,
    lattice::{fade, gradient, hash, hash_row},
};

/// Gradient noise of one octave at a cell of the world, times `scale`, in the order of operations that defines it.
pub(crate) fn sample(octave: &Octave, gradients: Gradients, scale: f32, [x, y]: [u32; 2]) -> f32 {
    let ((column, s), (row, t)) = (octave.axes[0].at(x), octave.axes[1].at(y));
    let (u, v) = (fade(s), fade(t));
    let [[p0, q0], [p1, q1]] = [row, row + 1].map(|row| {
        let [[x0, y0], [x1, y1]] = [column, column + 1].map(|column| {
            let [x, y] = gradient(gradients.table(), hash(column, hash_row(row, octave.seed)));
            [x * scale, y * scale]
        });
        let (left, right) = (x0 * s, x1 * (s - 1.0));
        [left + u * (right - left), y0 + u * (y1 - y0)]
    });
    let (e, f) = ((p1 - q1) - p0, q1 - q0);
    p0 + t * q0 + v * (e + t * f)
}

/// Gradient noise and its gradient in units of the wavelength, in double precision, as textbooks write it: the dot
/// products at the four corners, interpolated. `gradients` are those at (0, 0), (1, 0), (0, 1) and (1, 1).
pub(crate) fn textbook(gradients: [[f64; 2]; 4], [s, t]: [f64; 2]) -> (f64, [f64; 2]) {
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let slope = |t: f64| 30.0 * t * t * (t - 1.0) * (t - 1.0);
    let [g00, g10, g01, g11] = gradients;
    let dot = |g: [f64; 2], x: f64, y: f64| g[0] * x + g[1] * y;
    let (a, b, c, d) = (dot(g00, s, t), dot(g10, s - 1.0, t), dot(g01, s, t - 1.0), dot(g11, s - 1.0, t - 1.0));
    let (u, v) = (fade(s), fade(t));
    let cross = a - b - c + d;
    let lerp =
        |k: usize| g00[k] + u * (g10[k] - g00[k]) + v * (g01[k] - g00[k]) + u * v * (g00[k] - g10[k] - g01[k] + g11[k]);
    (
        a + u * (b - a) + v * (c - a) + u * v * cross,
        [lerp(0) + slope(s) * (b - a + v * cross), lerp(1) + slope(t) * (c - a + u * cross)],
    )
}

#[cfg(test)]
mod tests {
    use super::{super::lattice::Axis, *};
    use crate::generate::noise::{Fractal, NOISE_SCALE};

    const FRACTAL: Fractal = Fractal { wavelength_m: 100.0, octaves: 1, lacunarity: 2.0, gain: 0.5, seed: 11 };

    /// An octave of 64 cells a wavelength without a shift: every 64th cell is a lattice point.
    fn octave() -> Octave {
        let axis = Axis { base: 0, step: 1 << 26 };
        Octave { axes: [axis; 2], ..FRACTAL.octaves(1.0)[0] }
    }

    fn corners(octave: &Octave, column: i32, row: i32) -> [[f64; 2]; 4] {
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
            let hash = hash(column + i, hash_row(row + j, octave.seed));
            gradient(Gradients::Even.table(), hash).map(f64::from)
        })
    }

    #[test]
    fn noise_is_zero_at_lattice_points_and_within_one() {
        let octave = octave();
        for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
            assert_eq!(sample(&octave, Gradients::Even, 1.0, [64 * i, 64 * j]), 0.0);
        }
        let extreme = (0..512 * 512)
            .map(|k| sample(&octave, Gradients::Even, NOISE_SCALE, [k % 512, k / 512]).abs())
            .fold(0.0, f32::max);
        assert!(extreme > 0.5 && extreme <= 1.0 + 1e-6, "{extreme}");
    }

    /// The order of operations differs from the textbook's, the value only by roundings: some ten of them, each at most
    /// 6e-8 of terms below 1.
    #[test]
    fn the_factored_form_is_gradient_noise() {
        let octave = octave();
        for k in 0..256 * 256_u32 {
            let [x, y] = [k % 256, k / 256];
            let place = [f64::from(x % 64) / 64.0, f64::from(y % 64) / 64.0];
            let (expected, _) = textbook(corners(&octave, (x / 64) as i32, (y / 64) as i32), place);
            let got = f64::from(sample(&octave, Gradients::Even, 1.0, [x, y]));
            assert!((got - expected).abs() < 6e-7, "({x}, {y}): {got} {expected}");
        }
    }

    /// Differences over a thousandth of a wavelength agree with the analytic gradient, across lattice lines too, where
    /// the noise is twice continuously differentiable.
    #[test]
    fn differences_agree_with_the_gradient_across_lattice_lines() {
        let octave = octave();
        let at = |x: f64, y: f64| {
            let corners = corners(&octave, x.floor() as i32, y.floor() as i32);
            textbook(corners, [x - x.floor(), y - y.floor()])
        };
        let h = 1e-3;
        for k in 0..4000 {
            let (x, y) = (f64::from(k) * 0.01, 3.0 + f64::from(k) * 0.0037);
            let (_, [east, south]) = at(x, y);
            assert!(((at(x + h, y).0 - at(x - h, y).0) / (2.0 * h) - east).abs() < 1e-3);
            assert!(((at(x, y + h).0 - at(x, y - h).0) / (2.0 * h) - south).abs() < 1e-3);
        }
        for row in 0..50 {
            // the second derivative from the left and from the right of a lattice line
            let y = f64::from(row) * 0.13;
            let bend = |x: f64, side: f64| (at(x + side * h, y).1[0] - at(x, y).1[0]) / (side * h);
            assert!((bend(2.0 - 1e-9, -1.0) - bend(2.0, 1.0)).abs() < 0.2, "{}", bend(2.0, 1.0));
        }
    }
}
