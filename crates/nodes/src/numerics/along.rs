//! Values along a line: averages, and profiles without steep parts.

/// Returns the moving average of each value and `side` values on either side, of fewer near the ends, which do not
/// change.
pub fn averaged(values: &[f64], side: usize) -> Vec<f64> {
    let mut sums = vec![0.0];
    for value in values {
        // relative to the first value, so that a constant line stays constant
        sums.push(sums[sums.len() - 1] + (value - values[0]));
    }
    let mean = |at: usize| {
        let side = side.min(at).min(values.len() - 1 - at);
        if side == 0 {
            return values[at];
        }
        values[0] + (sums[at + side + 1] - sums[at - side]) / (2 * side + 1) as f64
    };
    (0..values.len()).map(mean).collect()
}

/// Returns the profile nearest to the values whose rise over run is nowhere more than `grade`: halfway between the
/// highest such profile that is nowhere above the values and the lowest that is nowhere below them. Its largest distance
/// from the values is the least possible, and cuts are as deep as fills are high. `lengths` are those between values.
pub fn graded(values: &[f64], lengths: &[f64], grade: f64) -> Vec<f64> {
    let bound = |sign: f64| {
        // the lowest of all values plus the grade times the way from there
        let mut bound: Vec<f64> = values.iter().map(|value| sign * value).collect();
        for at in 1..bound.len() {
            bound[at] = bound[at].min(bound[at - 1] + grade * lengths[at - 1]);
        }
        for at in (1..bound.len()).rev() {
            bound[at - 1] = bound[at - 1].min(bound[at] + grade * lengths[at - 1]);
        }
        bound
    };
    let (below, above) = (bound(1.0), bound(-1.0));
    below.into_iter().zip(above).map(|(below, above)| 0.5 * (below - above)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_graded_profile_shares_a_step_between_cut_and_fill() {
        let values: Vec<f64> = (0..40).map(|at| if at < 20 { 0.0 } else { 40.0 }).collect();
        let lengths = vec![10.0; 39];
        let profile = graded(&values, &lengths, 0.1);
        assert!(profile.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= 1.0 + 1e-9));
        let off: Vec<f64> = profile.iter().zip(&values).map(|(a, b)| a - b).collect();
        let [cut, fill] = [-1.0, 1.0].map(|sign| off.iter().map(|off| sign * off).fold(0.0, f64::max));
        // the step of 40 m has to be overcome within 1 m per piece: 19.5 m on either side
        assert!((cut - 19.5).abs() < 1e-9 && (fill - 19.5).abs() < 1e-9, "{cut} {fill}");
        let gentle: Vec<f64> = (0..40).map(|at| f64::from(at) * 0.7).collect();
        let same = graded(&gentle, &lengths, 0.1);
        assert!(same.iter().zip(&gentle).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
