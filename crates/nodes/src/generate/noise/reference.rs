//! One sample at a time: the reference that the row-coherent evaluation must equal to the last bit.

use super::{
    Fractal, Octave,
    lattice::{fade, gradient, hash, hash_row},
};

/// Gradient noise of one octave at a cell of the world, times `scale`, in the order of operations that defines it.
pub(crate) fn sample(octave: &Octave, fractal: &Fractal, scale: f32, [x, y]: [u32; 2]) -> f32 {
    let ((column, s), (row, t)) = (octave.axes[0].at(x), octave.axes[1].at(y));
    let (u, v) = (fade(s), fade(t));
    let [[p0, q0], [p1, q1]] = [row, row + 1].map(|row| {
        let [[x0, y0], [x1, y1]] = [column, column + 1].map(|column| {
            let [x, y] = gradient(fractal.gradients.table(), hash(column, hash_row(row, octave.seed)));
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
    let lerp = |k: usize| g00[k] + u * (g10[k] - g00[k]) + v * (g01[k] - g00[k])
        + u * v * (g00[k] - g10[k] - g01[k] + g11[k]);
    (
        a + u * (b - a) + v * (c - a) + u * v * cross,
        [lerp(0) + slope(s) * (b - a + v * cross), lerp(1) + slope(t) * (c - a + u * cross)],
    )
}
