//! Straight lines through points.

use crate::numerics::math;

/// A line by least squares.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub slope: f64,
    pub intercept: f64,
    /// Standard error of the slope.
    pub error: f64,
    /// Share of the variance of y that the line explains.
    pub r2: f64,
}

/// Fits y over x. The values are NaN for fewer than two different x.
pub(super) fn line(points: &[[f64; 2]]) -> Line {
    let count = points.len() as f64;
    let mean = [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / count);
    let product =
        |a: usize, b: usize| -> f64 { points.iter().map(|point| (point[a] - mean[a]) * (point[b] - mean[b])).sum() };
    let (xx, xy, yy) = (product(0, 0), product(0, 1), product(1, 1));
    let slope = if xx > 0.0 { xy / xx } else { f64::NAN };
    let rest = (yy - slope * xy).max(0.0);
    let error = (rest / (count - 2.0) / xx).sqrt();
    Line { slope, intercept: mean[1] - slope * mean[0], error, r2: xy * xy / (xx * yy) }
}

/// Factor of the standard error on each side of a slope that contains it with 95 % probability: the quantile of
/// Student's distribution for `points` points, by the expansion of Abramowitz and Stegun (1964, 26.7.5).
pub(super) fn confidence(points: usize) -> f64 {
    let Some(free) = points.checked_sub(2).filter(|free| *free > 0) else { return f64::NAN };
    let (z, n) = (1.959_963_984_540_054_f64, free as f64);
    let terms = [
        (z * z * z + z) / 4.0,
        (5.0 * math::pow(z, 5.0) + 16.0 * z * z * z + 3.0 * z) / 96.0,
        (3.0 * math::pow(z, 7.0) + 19.0 * math::pow(z, 5.0) + 17.0 * z * z * z - 15.0 * z) / 384.0,
    ];
    z + terms[0] / n + terms[1] / (n * n) + terms[2] / (n * n * n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_with_its_error() {
        let exact = line(&[[0.0, 1.0], [1.0, 3.0], [2.0, 5.0]]);
        assert_eq!([exact.slope, exact.intercept, exact.error, exact.r2], [2.0, 1.0, 0.0, 1.0]);
        // scipy.stats.linregress
        let rough = line(&[[0.0, 0.0], [1.0, 2.0], [2.0, 1.0], [3.0, 4.0]]);
        assert!((rough.slope - 1.1).abs() < 1e-12 && (rough.error - 0.519_615_242_270_663_1).abs() < 1e-12);
        assert!(line(&[[1.0, 2.0]]).slope.is_nan());
    }

    #[test]
    fn the_confidence_is_that_of_tables() {
        for (points, factor) in [(12, 2.228), (22, 2.086), (102, 1.984)] {
            assert!((confidence(points) - factor).abs() < 1e-3, "{points}");
        }
        assert!(confidence(2).is_nan());
    }
}
