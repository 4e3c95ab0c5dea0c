//! "Did you mean": the most similar of a few known names.

/// The most similar known name, if it is close enough to be a slip: a distance of at most a third of the letters of
/// `word`.
pub fn closest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = word.chars().count();
    let (most, word) = ((length / 3).max(1), word.to_lowercase());
    known
        .into_iter()
        .filter(|name| name.chars().take(length + most + 1).count().abs_diff(length) <= most)
        .map(|name| (distance(&word, &name.to_lowercase()), name))
        .filter(|(d, _)| *d <= most)
        .min_by_key(|(d, _)| *d)
        .map(|(_, name)| name)
}

/// Optimal string alignment distance: insertions, deletions, substitutions and swaps of neighbours.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().take(64).collect(), b.chars().take(64).collect());
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for (i, row) in rows.iter_mut().enumerate() {
        row[0] = i;
    }
    rows[0] = (0..=b.len()).collect();
    for i in 1..=a.len() {
        for j in 1..=b.len() {
            let swap = usize::from(a[i - 1] != b[j - 1]);
            let mut best = (rows[i - 1][j] + 1).min(rows[i][j - 1] + 1).min(rows[i - 1][j - 1] + swap);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                best = best.min(rows[i - 2][j - 2] + 1);
            }
            rows[i][j] = best;
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_recognised_and_strangers_are_not() {
        let known = ["StreamPower", "Thermal", "Ridged"];
        assert_eq!(closest("Streampower", known), Some("StreamPower"));
        assert_eq!(closest("Termal", known), Some("Thermal"));
        assert_eq!(closest("Rigded", known), Some("Ridged"));
        assert_eq!(closest("Volcano", known), None);
        assert_eq!(closest("", known), None);
    }
}
