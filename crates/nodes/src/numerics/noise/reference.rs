//! Reference: noise sample by sample, which the sheets must equal bit for bit.

use super::{
    Basis, Octave,
    basis::{Draw, Draws},
    lattice::{Axis, hash, hash_row},
};

/// Returns the noise of one octave at a cell of the world, times `scale`, in the defining order of operations.
pub(crate) fn sample(octave: &Octave, basis: Basis, scale: f32, cell: [u32; 2]) -> f32 {
    let [s, t] = place(octave, cell).map(|place| basis.weights(place));
    let [a, b, c, d] = corners(octave, basis, scale, cell);
    let along = |[near, far]: [Draw; 2]| {
        (
            (near[0] * s[0] + near[1] * s[1]) + (far[0] * s[2] + far[1] * s[3]),
            (near[2] * s[0] + near[3] * s[1]) + (far[2] * s[2] + far[3] * s[3]),
        )
    };
    let ((above_phi, above_psi), (below_phi, below_psi)) = (along([a, b]), along([c, d]));
    (above_phi * t[0] + above_psi * t[1]) + (below_phi * t[2] + below_psi * t[3])
}

/// Returns the position of a cell in its lattice cell.
fn place(octave: &Octave, [x, y]: [u32; 2]) -> [f32; 2] {
    let [along, down] = octave.axes;
    [Axis::fraction(along.at(x)), Axis::fraction(down.at(y))]
}

/// Returns the draws at the corners (0, 0), (1, 0), (0, 1) and (1, 1) of a cell's lattice cell.
fn corners(octave: &Octave, basis: Basis, scale: f32, [x, y]: [u32; 2]) -> [Draw; 4] {
    let [along, down] = octave.axes;
    let draws = Draws::new(basis, scale);
    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
        let row = hash_row(down.wrap(Axis::cell(down.at(y)) + j), octave.seed);
        draws.at(hash(along.wrap(Axis::cell(along.at(x)) + i), row))
    })
}

/// Returns Perlin's noise of 2002 at a cell of the world in double precision, in its textbook form.
pub(crate) fn textbook_at(octave: &Octave, cell: [u32; 2]) -> f64 {
    let corners = corners(octave, Basis::Classic, 1.0, cell).map(|[_, x, y, _]| [f64::from(x), f64::from(y)]);
    textbook(corners, place(octave, cell).map(f64::from))
}

/// Perlin's noise of 2002: the dot products at the four corners, interpolated. `corners` are the gradients at (0, 0),
/// (1, 0), (0, 1) and (1, 1).
fn textbook(corners: [[f64; 2]; 4], [s, t]: [f64; 2]) -> f64 {
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let [g00, g10, g01, g11] = corners;
    let dot = |g: [f64; 2], x: f64, y: f64| g[0] * x + g[1] * y;
    let (a, b, c, d) = (dot(g00, s, t), dot(g10, s - 1.0, t), dot(g01, s, t - 1.0), dot(g11, s - 1.0, t - 1.0));
    let (u, v) = (fade(s), fade(t));
    a + u * (b - a) + v * (c - a) + u * v * (a - b - c + d)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::noise::Fractal;

    /// An octave of 64 cells per wavelength without a shift: every 64th cell is a lattice point.
    fn octave() -> Octave {
        let fractal = Fractal { wavelength_m: 64.0, octaves: 1, lacunarity: 2.0, gain: 0.5, tileable: false, seed: 11 };
        let axes = [Axis { base: 0, step: 1 << 26, period: 0 }; 2];
        Octave { axes, ..fractal.octaves(&crate::testing::world(100, 100, 1.0))[0] }
    }

    /// At lattice points the noise is their value, which is 0 for `Classic`. A long search comes close to the bound and
    /// does not exceed it.
    #[test]
    fn noise_has_its_values_at_lattice_points_and_is_within_one() {
        for (basis, near) in [(Basis::Bell, 0.7), (Basis::Classic, 0.9), (Basis::Value, 0.99)] {
            let octave = octave();
            for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (64 * i, 64 * j))) {
                assert_eq!(sample(&octave, basis, 1.0, [i, j]), corners(&octave, basis, 1.0, [i, j])[0][0]);
                assert!(basis != Basis::Classic || sample(&octave, basis, 1.0, [i, j]) == 0.0);
            }
            let places = (0..1024 * 1024).map(|k| [5 * (k % 1024), 5 * (k / 1024)]);
            let extreme = places.map(|cell| sample(&octave, basis, basis.scale(), cell).abs()).fold(0.0, f32::max);
            assert!(extreme > near && extreme <= 1.0 + 1e-6, "{basis:?}: {extreme}");
        }
    }

    /// The maximum of noise at a place is the largest sum of draws there; over a grid of places it is 1.
    #[test]
    fn the_scale_is_the_bound() {
        let basis = Basis::Bell;
        let [value, x, y, twist] = Draws::new(basis, basis.scale()).at(u32::MAX);
        let length = (x * x + y * y).sqrt();
        let mut most = 0.0_f32;
        for (s, t) in (0..=64).flat_map(|i| (0..=64).map(move |j| (i as f32 / 64.0, j as f32 / 64.0))) {
            let (s, t) = (basis.weights(s), basis.weights(t));
            let corner = |i: usize, j: usize| {
                let [x, y] = [s[i + 1] * t[j], s[i] * t[j + 1]];
                value.abs() * s[i] * t[j] + length * (x * x + y * y).sqrt() + (twist * s[i + 1] * t[j + 1]).abs()
            };
            most = most.max(corner(0, 0) + corner(2, 0) + corner(0, 2) + corner(2, 2));
        }
        assert!(most > 0.999 && most <= 1.000_1, "{most}");
    }

    /// The windows and their first two derivatives are continuous across lattice lines, so the noise is twice
    /// continuously differentiable: at the ends they and their differences vanish, in the middle both sides agree.
    #[test]
    fn windows_are_smooth_at_lattice_lines() {
        let h = 1e-2_f32;
        for basis in [Basis::Bell, Basis::Classic, Basis::Value] {
            let [phi, psi, after_phi, after_psi] = basis.weights(1.0 - h);
            // (1 − s²)³ and the fade decrease like h³ at the end: below 20 h³ with their factors
            assert!(phi.abs() < 20.0 * h * h * h && psi.abs() < 20.0 * h * h * h, "{basis:?} {phi} {psi}");
            let [before_phi, before_psi, ..] = basis.weights(h);
            assert!((before_phi - after_phi).abs() < 1e-6 && (before_psi + after_psi).abs() < 1e-6);
            assert_eq!(basis.weights(0.0)[..2], [1.0, 0.0]);
        }
    }
}
