//! Conversion of numbers to integer codes over a range.

use orograph_graph::{Window, mix};

use super::Problem;
use crate::numerics::{par, simd::simd};

/// Maps a range of numbers to codes from 0 to `full`.
#[derive(Clone, Copy)]
pub(super) struct Codes {
    pub(super) range: [f64; 2],
    pub(super) full: u16,
    pub(super) dither: bool,
}

/// Buffers for a row of codes.
pub(super) struct Room {
    up: Vec<f64>,
    codes: Vec<u16>,
}

impl Room {
    pub(super) fn new(nx: usize) -> Self {
        Self { up: vec![0.5; nx], codes: vec![0; nx] }
    }
}

impl Codes {
    /// Returns the codes of row `j` of a window, rounded to the nearest or, with `dither`, at random to one of the two
    /// nearest. Values that equal a code get that code in either case.
    pub(super) fn row<'a>(self, samples: &[f32], window: &Window, j: usize, room: &'a mut Room) -> &'a [u16] {
        let [lo, hi] = self.range;
        // the range of a constant raster is empty; all its codes are 0
        let per_unit = if hi > lo { f64::from(self.full) / (hi - lo) } else { 0.0 };
        let Room { up, codes } = room;
        if self.dither {
            let [column, row] = window.origin;
            let row = mix(row + j as u32);
            for (i, up) in up.iter_mut().enumerate() {
                *up = f64::from(mix(row ^ (column + i as u32))) / 4_294_967_296.0;
            }
        }
        encode(codes, samples, up, lo, per_unit, f64::from(self.full));
        codes
    }
}

/// Rejects values that have no code.
pub(super) fn check_finite(samples: &[f32]) -> Result<(), Problem> {
    match par::count(samples, |v| !v.is_finite()) {
        0 => Ok(()),
        count => Err(Problem::NotFinite { count }),
    }
}

simd! {
    /// Computes the codes of finite samples: steps above `lo`, plus the fraction `up` of a step, rounded down.
    fn encode(codes: &mut [u16], samples: &[f32], up: &[f64], lo: f64, per_unit: f64, full: f64) {
        // from here on double precision represents integers only, and the last bits are the integer
        const WHOLE: f64 = 4_503_599_627_370_496.0;
        for ((code, v), up) in codes.iter_mut().zip(samples).zip(up) {
            let at = ((f64::from(*v) - lo) * per_unit + up).max(0.0).min(full);
            let near = (at + WHOLE) - WHOLE;
            let down = if near > at { near - 1.0 } else { near };
            *code = (down + WHOLE).to_bits() as u16;
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Field, World};

    use super::*;
    use crate::testing::at_every_level;

    fn level(value: f32) -> Field {
        let world = World { size: [200.0, 100.0], cells: [200, 100], ..World::default() };
        Field::constant(Window::whole(world), value)
    }

    /// Encodes a range of 0 to 65535 as codes from 0 to 65535.
    fn codes(field: &Field, dither: bool) -> Vec<u16> {
        let coding = Codes { range: [0.0, 65_535.0], full: u16::MAX, dither };
        let (window, mut room) = (field.window(), Room::new(field.window().nx()));
        let rows = field.samples().chunks(window.nx()).enumerate();
        rows.flat_map(|(j, row)| coding.row(row, window, j, &mut room).to_vec()).collect()
    }

    #[test]
    fn dither_keeps_the_mean_and_whole_codes() {
        let drawn = codes(&level(100.3), true);
        assert!(drawn.iter().all(|code| *code == 100 || *code == 101));
        let mean = drawn.iter().map(|code| f64::from(*code)).sum::<f64>() / drawn.len() as f64;
        // 20000 draws: the standard error of the mean is 0.0032
        assert!((mean - 100.3).abs() < 0.013, "{mean}");
        for value in [0.0, 777.0, 65_535.0] {
            assert!(codes(&level(value), true).iter().all(|code| f32::from(*code) == value));
        }
        assert!(codes(&level(100.5), false).iter().all(|code| *code == 101));
    }

    /// Rounding by the bits of large numbers equals rounding down after adding a half, in every case and at every SIMD
    /// level.
    #[test]
    fn codes_are_the_nearest() {
        let window = *level(0.0).window();
        let draw = |cell: u32| match cell % 5 {
            0 => (mix(cell) % 65_536) as f32,
            1 => (mix(cell) % 65_536) as f32 + 0.5,
            2 => (mix(cell) % 70_000) as f32 - 2000.25,
            3 => mix(cell) as f32 / 65_536.0,
            _ => [f32::MAX, f32::MIN, -0.0, 1e-40, 65_534.5, 65_535.5][cell as usize / 5 % 6],
        };
        let field = Field::new(window, (0..20_000).map(draw).collect());
        let expected = |v: &f32| (f64::from(*v) + 0.5).clamp(0.0, 65_535.0) as u16;
        let expected: Vec<u16> = field.samples().iter().map(expected).collect();
        assert!(codes(&field, false) == expected);
        at_every_level(|| codes(&field, false));
    }

    #[test]
    fn dither_belongs_to_the_place() {
        let field = level(7.5);
        let whole = codes(&field, true);
        let part = Window { origin: [50, 20], cells: [40, 30], ..*field.window() };
        for (j, row) in codes(&field.crop(&part), true).chunks(40).enumerate() {
            assert_eq!(row, &whole[(20 + j) * 200 + 50..][..40]);
        }
    }
}
