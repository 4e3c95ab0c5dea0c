//! One sample at a time: the reference that the evaluation by runs must equal to the last bit.

use super::{
    Octave,
    lattice::{fraction, gradient, hash, hash_row, value},
    runs::{STRIP, Terms},
};

/// Gradient noise of one octave at a cell of the world, times `scale`, in the order of operations that defines it.
pub(crate) fn sample(octave: &Octave, scale: f32, [x, y]: [u32; 2]) -> f32 {
    let lattice = octave.lattice;
    let cell = |x: u32| lattice.at([x, y]).map(|position| (position >> 32) as i32);
    let mut start = x;
    while start % STRIP as u32 > 0 && cell(start - 1) == cell(x) {
        start -= 1;
    }
    let place = lattice.at([start, y]).map(|position| fraction(position as u32));
    let terms = Terms::new(corners(octave, cell(x)).map(|g| g.map(|g| g * scale)), place, lattice.steps());
    terms.at((x - start) as f32, lattice.steps())
}

/// The gradients and values at the corners (0, 0), (1, 0), (0, 1) and (1, 1) of a lattice cell.
fn corners(octave: &Octave, [column, row]: [i32; 2]) -> [[f32; 3]; 4] {
    [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
        let hash = hash(column + i, hash_row(row + j, octave.seed));
        let [x, y] = gradient(octave.gradients.table(), hash);
        [x, y, value(hash)]
    })
}

/// Gradient noise and its gradient in units of the wavelength, in double precision, as textbooks write it: the dot
/// products at the four corners plus their values, interpolated. `corners` are the gradients and values at (0, 0), (1, 0),
/// (0, 1) and (1, 1).
pub(crate) fn textbook(corners: [[f64; 3]; 4], [s, t]: [f64; 2]) -> (f64, [f64; 2]) {
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let slope = |t: f64| 30.0 * t * t * (t - 1.0) * (t - 1.0);
    let [g00, g10, g01, g11] = corners;
    let dot = |g: [f64; 3], x: f64, y: f64| g[0] * x + g[1] * y + g[2];
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
    use super::{super::lattice::Lattice, *};
    use crate::generate::noise::{Fractal, Gradients, NOISE_SCALE};

    const FRACTAL: Fractal =
        Fractal { wavelength_m: 100.0, octaves: 1, lacunarity: 2.0, gain: 0.5, gradients: Gradients::Even, seed: 11 };

    /// An octave of 64 cells a wavelength without a turn or a shift: every 64th cell is a lattice point.
    fn octave() -> Octave {
        let lattice = Lattice { base: [0; 2], along: [1 << 26, 0], across: [0, 1 << 26] };
        Octave { lattice, ..FRACTAL.octaves(1.0)[0] }
    }

    fn corners(octave: &Octave, cell: [i32; 2]) -> [[f64; 3]; 4] {
        super::corners(octave, cell).map(|g| g.map(f64::from))
    }

    /// At lattice points the noise is their value, to two roundings; a long look comes near the largest there can be.
    #[test]
    fn noise_has_its_values_at_lattice_points_and_is_within_one() {
        let octave = octave();
        for (i, j) in (0..9).flat_map(|i| (0..9).map(move |j| (i, j))) {
            let value = corners(&octave, [i as i32, j as i32])[0][2];
            let noise = f64::from(sample(&octave, 1.0, [64 * i, 64 * j]));
            assert!((noise - value).abs() < 3e-7, "{noise} {value}");
        }
        let extreme =
            (0..512 * 512).map(|k| sample(&octave, NOISE_SCALE, [k % 512, k / 512]).abs()).fold(0.0, f32::max);
        assert!(extreme > 0.5 && extreme <= 1.0 + 1e-6, "{extreme}");
    }

    /// The order of operations differs from the textbook's, the value only by roundings: some ten of them, each at most
    /// 6e-8 of terms below 1.
    #[test]
    fn the_factored_form_is_gradient_noise() {
        for octave in [octave(), FRACTAL.octaves(1.0)[0], FRACTAL.octaves(30.0)[0]] {
            for k in 0..256 * 256_u32 {
                let cell = [k % 256, k / 256];
                let position = octave.lattice.at(cell);
                let place = position.map(|p| f64::from(p as u32) / 4_294_967_296.0);
                let (expected, _) = textbook(corners(&octave, position.map(|p| (p >> 32) as i32)), place);
                let got = f64::from(sample(&octave, 1.0, cell));
                assert!((got - expected).abs() < 6e-7, "{cell:?}: {got} {expected}");
            }
        }
    }

    /// Differences over a thousandth of a wavelength agree with the analytic gradient, across lattice lines too, where
    /// the noise is twice continuously differentiable.
    #[test]
    fn differences_agree_with_the_gradient_across_lattice_lines() {
        let octave = octave();
        let at = |x: f64, y: f64| {
            let corners = corners(&octave, [x.floor() as i32, y.floor() as i32]);
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
