//! Geomorphons: ten forms of ground by what is seen in eight directions (Jasiewicz and Stepinski 2013).

use super::{Land, put};
use crate::{
    numerics::{par, routing::code::STEPS, simd::simd},
    prelude::*,
};

/// How far is looked, in metres and at least in cells.
const LOOK_M: f64 = 1000.0;
const LEAST: usize = 3;
/// Tangent of the angle, 1°, within which ground counts as level.
const LEVEL: f64 = 0.017_455_064_928_217_585;
/// Names of the forms in the order of [`FORMS`].
const NAMES: [&str; 10] = [
    "forms.flat",
    "forms.peak",
    "forms.ridge",
    "forms.shoulder",
    "forms.spur",
    "forms.slope",
    "forms.hollow",
    "forms.footslope",
    "forms.valley",
    "forms.pit",
];
const NONE: u8 = 10;
/// The form by the number of directions in which ground is lower (rows) and higher (columns).
const FORMS: [[u8; 9]; 9] = {
    const X: u8 = NONE;
    [
        [0, 0, 0, 7, 7, 8, 8, 8, 9],
        [0, 0, 7, 7, 7, 8, 8, 8, X],
        [0, 3, 5, 5, 6, 6, 8, X, X],
        [3, 3, 5, 5, 5, 6, X, X, X],
        [3, 3, 4, 5, 5, X, X, X, X],
        [2, 2, 4, 4, X, X, X, X, X],
        [2, 2, 2, X, X, X, X, X, X],
        [2, 2, X, X, X, X, X, X, X],
        [1, X, X, X, X, X, X, X, X],
    ]
};

/// Distances in cells up to `reach` at which the ground is looked at: all up to eight, then a quarter farther each.
fn distances(reach: usize) -> Vec<usize> {
    let mut distances: Vec<usize> = (1..=reach.min(8)).collect();
    while let Some(&last) = distances.last().filter(|last| **last < reach) {
        distances.push((last + last / 4).min(reach));
    }
    distances
}

simd! {
    /// Raises the steepest rise and fall in one direction, as tangents, by the heights at a distance.
    fn look(own: &[f32], far: &[f32], per_m: f32, rise: &mut [f32], fall: &mut [f32]) {
        let n = own.len();
        let (far, rise, fall) = (&far[..n], &mut rise[..n], &mut fall[..n]);
        for i in 0..n {
            let slope = (far[i] - own[i]) * per_m;
            rise[i] = if slope > rise[i] { slope } else { rise[i] };
            fall[i] = if -slope > fall[i] { -slope } else { fall[i] };
        }
    }
}

simd! {
    /// Counts directions in which the ground is higher and lower: the angle up to the horizon exceeds that down by
    /// more than the level angle, compared by the tangent of their difference.
    fn count(rise: &[f32], fall: &[f32], level: f32, higher: &mut [f32], lower: &mut [f32]) {
        let n = rise.len();
        let (fall, higher, lower) = (&fall[..n], &mut higher[..n], &mut lower[..n]);
        for i in 0..n {
            let difference = rise[i] - fall[i];
            let least = level * (1.0 + rise[i] * fall[i]).abs();
            higher[i] += if difference > least { 1.0 } else { 0.0 };
            lower[i] += if -difference > least { 1.0 } else { 0.0 };
        }
    }
}

/// Shares of the forms among cells whose surroundings lie within the terrain.
pub(super) fn measure(land: &Land<'_>, report: &mut Report) {
    let (nx, ny) = (land.nx(), land.ny());
    let reach = ((LOOK_M / land.cell_m()) as usize).clamp(LEAST, (nx.min(ny) / 4).max(LEAST));
    let counts = if nx > 2 * reach && ny > 2 * reach { counts(land, reach) } else { [0; 10] };
    let all: u64 = counts.iter().sum();
    for (name, count) in NAMES.into_iter().zip(counts) {
        put(report, name, count as f64 / all as f64);
    }
}

fn counts(land: &Land<'_>, reach: usize) -> [u64; 10] {
    let (nx, ny) = (land.nx(), land.ny());
    let heights = land.height.plane(0);
    let distances = distances(reach);
    let width = nx - 2 * reach;
    let rows = par::collect_all(reach..ny - reach, |_, j| {
        let own = &heights[j * nx + reach..][..width];
        let [mut higher, mut lower] = [vec![0.0_f32; width], vec![0.0_f32; width]];
        for (direction, (dx, dy)) in STEPS.iter().enumerate() {
            let [mut rise, mut fall] = [vec![f32::MIN; width], vec![f32::MIN; width]];
            let link = land.cell_m() * if direction % 2 == 1 { std::f64::consts::SQRT_2 } else { 1.0 };
            for &cells in &distances {
                let start = (j as isize + *dy as isize * cells as isize) * nx as isize
                    + reach as isize
                    + *dx as isize * cells as isize;
                let far = &heights[start as usize..][..width];
                look(own, far, (1.0 / (link * cells as f64)) as f32, &mut rise, &mut fall);
            }
            count(&rise, &fall, LEVEL as f32, &mut higher, &mut lower);
        }
        let mut counts = [0_u64; 10];
        let measured = &land.samples()[j * nx + reach..][..width];
        for i in 0..width {
            let form = FORMS[lower[i] as usize][higher[i] as usize];
            // beside a void, comparisons fail and the cell would look level
            if measured[i].is_finite() && form != NONE {
                counts[usize::from(form)] += 1;
            }
        }
        counts
    });
    rows.iter().fold([0; 10], |sums, row| std::array::from_fn(|form| sums[form] + row[form]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        numerics::math,
        testing::{field, world},
    };

    /// Shares of the forms of a function of place, in the order of the names.
    fn shares(form: impl Fn(f64, f64) -> f64 + Sync) -> [f64; 10] {
        let land = field(world(120, 120, 100.0), form);
        let mut report = Report::default();
        measure(&Land::of(&land, None), &mut report);
        NAMES.map(|name| report.get(name).expect("a share"))
    }

    #[test]
    fn planes_roofs_and_gutters_have_their_forms() {
        assert_eq!(shares(|_, _| 3.0)[0], 1.0);
        assert_eq!(shares(|x, _| 0.3 * x)[5], 1.0);
        // within 20 cells of the crest of a roof along y, a direction across it falls on both sides
        let roof = shares(|x, _| -(x - 6000.0).abs());
        assert!(roof[2] > 0.01 && roof[8] == 0.0 && roof[5] > 0.9, "{roof:?}");
        let gutter = shares(|x, _| (x - 6000.0).abs());
        assert!(gutter[8] > 0.01 && gutter[2] == 0.0, "{gutter:?}");
        let cone = shares(|x, y| -math::hypot(x - 6050.0, y - 6050.0));
        assert!(cone[1] > 0.0 && cone[9] == 0.0, "{cone:?}");
    }

    #[test]
    fn distances_end_at_the_reach() {
        assert_eq!(distances(3), [1, 2, 3]);
        assert_eq!(distances(20), [1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 15, 18, 20]);
    }
}
