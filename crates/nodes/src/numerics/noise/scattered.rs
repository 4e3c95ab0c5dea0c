//! An octave at places displaced from the samples, each by its own shift.
//!
//! Rows and columns share no work then: every sample draws its own four lattice points. It takes about ten times the
//! work of [`super::sheet::Sheets`]; with shifts of 0 it gives the same noise, to rounding.

use super::{
    Octave,
    basis::{Basis, Draws},
    lattice::{Axis, hash, hash_row},
    raster::{Combine, LANES, Layer, Noise},
};
use crate::numerics::simd::simd;

/// Maximum shift in wavelengths.
const FARTHEST: f32 = 1_048_576.0;

/// See the module.
pub(crate) struct Scattered {
    octave: Octave,
    basis: Basis,
    draws: Draws,
    /// First row of samples in the world.
    top: u32,
}

impl Scattered {
    /// Creates an octave of a kind of noise with a scale.
    pub fn new(octave: Octave, basis: Basis, scale: f32) -> Self {
        Self { draws: Draws::new(basis, scale), octave, basis, top: 0 }
    }

    /// Creates octaves of a kind of noise with the same scale.
    pub fn all(octaves: &[Octave], basis: Basis, scale: f32) -> Vec<Self> {
        octaves.iter().map(|octave| Self::new(*octave, basis, scale)).collect()
    }
}

impl Layer for Scattered {
    fn lay(&mut self, origin: [u32; 2], _: [usize; 2]) {
        self.top = origin[1];
    }

    fn add<C: Combine>(&mut self, combine: &C, octave: usize, x: u32, states: &mut [C::State]) {
        scatter(self, combine, octave, x, states);
    }
}

/// Converts a whole number below 2²² to an integer, without the branches of a general conversion.
#[inline(always)]
fn integer(whole: f32) -> i32 {
    (whole + 12_582_912.0).to_bits() as i32 - 0x4b40_0000
}

/// Positions of samples along one axis: lattice cells and fractions in them.
struct Places {
    cells: [i32; LANES],
    fractions: [f32; LANES],
}

impl Places {
    /// Returns positions on the lattice, displaced by shifts in wavelengths.
    #[inline(always)]
    fn new(positions: &[i64; LANES], shifts: &[f32; LANES]) -> Self {
        let mut places = Self { cells: [0; LANES], fractions: [0.0; LANES] };
        for lane in 0..LANES {
            let shift = if shifts[lane] > -FARTHEST { shifts[lane] } else { -FARTHEST };
            let shift = if shift < FARTHEST { shift } else { FARTHEST };
            let whole = shift.floor();
            // 24 bits of the fraction, in two parts
            let part = (shift - whole) * 4096.0;
            let (high, low) = (part.floor(), ((part - part.floor()) * 4096.0).floor());
            let moved = positions[lane]
                + (i64::from(integer(whole)) << 32)
                + (i64::from(integer(high)) << 20)
                + (i64::from(integer(low)) << 8);
            places.cells[lane] = Axis::cell(moved);
            places.fractions[lane] = Axis::fraction(moved);
        }
        places
    }

    /// Returns the indices of the lattice lines before and after each sample.
    #[inline(always)]
    fn lines(&self, axis: Axis) -> [[i32; LANES]; 2] {
        let mut lines = [self.cells; 2];
        for line in &mut lines[1] {
            *line = line.wrapping_add(1);
        }
        if axis.period != 0 {
            lines.iter_mut().flatten().for_each(|line| *line = axis.wrap(*line));
        }
        lines
    }
}

simd! {
    /// Evaluates one octave for each row of samples.
    fn scatter<C: Combine>(layer: &Scattered, combine: &C, octave: usize, x: u32, states: &mut [C::State]) {
        let constants = combine.layer(octave);
        let [along, down] = layer.octave.axes;
        let mut columns = [0; LANES];
        for (lane, column) in (0..).zip(&mut columns) {
            *column = along.at(x.wrapping_add(lane));
        }
        for (y, state) in (layer.top..).zip(states) {
            let [shift_x, shift_y] = C::shift(&constants, state);
            let across = Places::new(&columns, &shift_x);
            let below = Places::new(&[down.at(y); LANES], &shift_y);
            C::octave(&constants, &noise(layer, &across, &below), state);
        }
    }
}

/// Returns the noise and its slopes at places.
#[inline(always)]
fn noise(layer: &Scattered, across: &Places, below: &Places) -> Noise {
    let [along, down] = layer.octave.axes;
    let (columns, rows) = (across.lines(along), below.lines(down));
    let (mut s, mut ds) = ([[0.0; LANES]; 4], [[0.0; LANES]; 4]);
    let (mut t, mut dt) = ([[0.0; LANES]; 4], [[0.0; LANES]; 4]);
    for lane in 0..LANES {
        let [weights_s, rates_s] =
            [layer.basis.weights(across.fractions[lane]), layer.basis.rates(across.fractions[lane])];
        let [weights_t, rates_t] =
            [layer.basis.weights(below.fractions[lane]), layer.basis.rates(below.fractions[lane])];
        for part in 0..4 {
            s[part][lane] = weights_s[part];
            ds[part][lane] = rates_s[part];
            t[part][lane] = weights_t[part];
            dt[part][lane] = rates_t[part];
        }
    }
    let mut noise = Noise::level([0.0; LANES]);
    for j in 0..2 {
        let mut row_hashes = [0; LANES];
        for lane in 0..LANES {
            row_hashes[lane] = hash_row(rows[j][lane], layer.octave.seed);
        }
        for i in 0..2 {
            let mut draws = [[0.0; LANES]; 4];
            for lane in 0..LANES {
                let draw = layer.draws.at(hash(columns[i][lane], row_hashes[lane]));
                for part in 0..4 {
                    draws[part][lane] = draw[part];
                }
            }
            let [value, x, y, twist] = &draws;
            for lane in 0..LANES {
                let phi = value[lane] * s[2 * i][lane] + x[lane] * s[2 * i + 1][lane];
                let psi = y[lane] * s[2 * i][lane] + twist[lane] * s[2 * i + 1][lane];
                let phi_x = value[lane] * ds[2 * i][lane] + x[lane] * ds[2 * i + 1][lane];
                let psi_x = y[lane] * ds[2 * i][lane] + twist[lane] * ds[2 * i + 1][lane];
                noise.value[lane] += phi * t[2 * j][lane] + psi * t[2 * j + 1][lane];
                noise.slope[0][lane] += phi_x * t[2 * j][lane] + psi_x * t[2 * j + 1][lane];
                noise.slope[1][lane] += phi * dt[2 * j][lane] + psi * dt[2 * j + 1][lane];
            }
        }
    }
    noise
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        numerics::noise::{
            Fractal,
            raster::{Lanes, Patch, Stack, moments},
            sheet::Sheets,
        },
        testing::world,
    };

    const FRACTAL: Fractal =
        Fractal { wavelength_m: 700.0, octaves: 1, lacunarity: 2.0, gain: 0.5, tileable: false, seed: 3 };

    /// One component of the noise, its value or a slope, at a shift in wavelengths.
    struct Part<const WHICH: usize> {
        shift: [f32; 2],
    }

    impl<const WHICH: usize> Combine for Part<WHICH> {
        type State = Lanes;
        type Layer = [f32; 2];
        const SLOPES: bool = true;

        fn layer(&self, _: usize) -> [f32; 2] {
            self.shift
        }

        fn start(&self) -> Lanes {
            Lanes::splat(0.0)
        }

        #[inline(always)]
        fn octave(_: &[f32; 2], noise: &Noise, state: &mut Lanes) {
            state.0 = [noise.value, noise.slope[0], noise.slope[1]][WHICH];
        }

        #[inline(always)]
        fn shift(layer: &[f32; 2], _: &Lanes) -> [[f32; LANES]; 2] {
            layer.map(|shift| [shift; LANES])
        }

        #[inline(always)]
        fn finish(&self, state: &Lanes) -> Lanes {
            *state
        }
    }

    /// Returns 128 x 128 samples from a place on.
    fn samples<const WHICH: usize>(mut stack: impl Stack, origin: [u32; 2], shift: [f32; 2]) -> Vec<f32> {
        let mut out = vec![0.0; 128 * 128];
        stack.strip(&Part::<WHICH> { shift }, origin, &mut Patch::new(&mut out, 128, 0..128));
        out
    }

    fn sheets(octave: Octave, basis: Basis) -> Sheets {
        Sheets::sloped(&[octave], basis, |_| 1.0)
    }

    fn close(a: &[f32], b: &[f32], tolerance: f32) {
        let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < tolerance, "{worst}");
    }

    /// To the rounding of numbers of about 1, of slopes of about 5.
    #[test]
    fn noise_where_the_samples_are_is_that_of_the_sheet() {
        let tileable = Fractal { tileable: true, ..FRACTAL };
        for (basis, fractal) in
            [(Basis::Bell, FRACTAL), (Basis::Classic, FRACTAL), (Basis::Value, FRACTAL), (Basis::Bell, tileable)]
        {
            let octave = fractal.octaves(&world(300, 300, 25.0))[0];
            let pair = || (sheets(octave, basis), Scattered::all(&[octave], basis, 1.0));
            let (sheet, scattered) = pair();
            close(&samples::<0>(sheet, [150, 99], [0.0; 2]), &samples::<0>(scattered, [150, 99], [0.0; 2]), 2e-6);
            let (sheet, scattered) = pair();
            close(&samples::<1>(sheet, [150, 99], [0.0; 2]), &samples::<1>(scattered, [150, 99], [0.0; 2]), 1e-5);
            let (sheet, scattered) = pair();
            close(&samples::<2>(sheet, [150, 99], [0.0; 2]), &samples::<2>(scattered, [150, 99], [0.0; 2]), 1e-5);
        }
    }

    /// A shift by whole cells gives the noise of those cells; 25 m are 1/28 of a wavelength, to 24 bits.
    #[test]
    fn a_shift_takes_the_noise_from_there() {
        let octave = FRACTAL.octaves(&world(9000, 9000, 25.0))[0];
        let new = || Scattered::all(&[octave], Basis::Bell, 1.0);
        let (there, moved) = (samples::<0>(new(), [520, 30], [0.0; 2]), samples::<0>(new(), [100, 100], [15.0, -2.5]));
        close(&there, &moved, 1e-5);
        // shifts beyond the limit and shifts that are not finite
        for shift in [f32::MAX, f32::MIN, f32::INFINITY, f32::NAN] {
            assert!(samples::<0>(new(), [100, 100], [shift; 2]).iter().all(|n| n.abs() <= 1.6));
        }
    }

    /// Slopes equal central differences over 1/2048 of a wavelength, whose error is some 1e-6; rounding adds 3e-7 ·
    /// 1024.
    #[test]
    fn slopes_are_the_differences_of_the_noise() {
        for basis in [Basis::Bell, Basis::Classic, Basis::Value] {
            let octave = Fractal { wavelength_m: 2048.0, ..FRACTAL }.octaves(&world(9000, 9000, 1.0))[0];
            for origin in [[0, 0], [3000, 7000], [2048, 900]] {
                let [noise, along, down] = [
                    samples::<0>(sheets(octave, basis), origin, [0.0; 2]),
                    samples::<1>(sheets(octave, basis), origin, [0.0; 2]),
                    samples::<2>(sheets(octave, basis), origin, [0.0; 2]),
                ];
                for (i, j) in (1..127).flat_map(|i| (1..127).map(move |j| (i, j))) {
                    let at = 128 * j + i;
                    let (dx, dy) =
                        (1024.0 * (noise[at + 1] - noise[at - 1]), 1024.0 * (noise[at + 128] - noise[at - 128]));
                    assert!((dx - along[at]).abs() < 1e-3 && (dy - down[at]).abs() < 1e-3, "{basis:?} {i} {j}");
                }
            }
        }
    }

    /// At spread places an octave has its mean of 0 and its standard deviation, to the sampling error of about 9000
    /// cells.
    #[test]
    fn spread_places_give_the_moments() {
        let mut sheets = sheets(FRACTAL.spread()[0], Basis::Classic);
        let (mean, std) = moments(&mut sheets, &Part::<0> { shift: [0.0; 2] }, 256);
        assert!(mean.abs() < 0.005 && (std / 0.2156 - 1.0).abs() < 0.015, "{mean} {std}");
        // published slope of Perlin's noise: 0.625 per wavelength along each axis
        let (mean, std) = moments(&mut sheets, &Part::<1> { shift: [0.0; 2] }, 256);
        assert!(mean.abs() < 0.01 && (std / 0.625 - 1.0).abs() < 0.015, "{mean} {std}");
    }
}
