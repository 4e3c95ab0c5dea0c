//! Places and values along a line: averages, and profiles without steep parts.

/// Returns the distance between two points.
#[must_use]
pub fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let [x, y] = [b[0] - a[0], b[1] - a[1]];
    (x * x + y * y).sqrt()
}

/// A place along a polyline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The piece between two points.
    pub piece: usize,
    /// The place on it from 0 to 1.
    pub t: f64,
    /// Distance along the line from its start.
    pub way_m: f64,
}

/// Returns the ends of `count` stretches of equal length that a polyline consists of: `count` + 1 places, from its start
/// to its end. `lengths` are those of its pieces, at least one.
pub fn evenly(lengths: &[f64], count: usize) -> impl Iterator<Item = Place> {
    let whole: f64 = lengths.iter().sum();
    let (mut piece, mut before) = (0, 0.0);
    (0..=count).map(move |k| {
        let way_m = whole * k as f64 / count as f64;
        while piece + 1 < lengths.len() && way_m > before + lengths[piece] {
            before += lengths[piece];
            piece += 1;
        }
        let length = lengths[piece];
        let t = if length > 0.0 { ((way_m - before) / length).clamp(0.0, 1.0) } else { 0.0 };
        Place { piece, t, way_m }
    })
}

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
    fn places_are_even_across_pieces() {
        // the piece without length is passed over
        let places: Vec<Place> = evenly(&[1.0, 0.0, 3.0, 4.0], 4).collect();
        let expected = [(0, 0.0, 0.0), (2, 1.0 / 3.0, 2.0), (2, 1.0, 4.0), (3, 0.5, 6.0), (3, 1.0, 8.0)];
        assert_eq!(places, expected.map(|(piece, t, way_m)| Place { piece, t, way_m }));
        assert_eq!(evenly(&[0.0], 1).map(|place| place.t).collect::<Vec<_>>(), [0.0, 0.0]);
    }

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
