//! Sums over cells for the balances of processes.

/// What cells gained and what cells lost: the sums of the positive and of the negative changes, both positive.
#[must_use]
pub fn gains_and_losses(changes: impl Iterator<Item = f64>) -> [f64; 2] {
    changes.filter(|change| change.is_finite()).fold([0.0; 2], |[gains, losses], change| {
        if change > 0.0 { [gains + change, losses] } else { [gains, losses - change] }
    })
}

/// The sum of finite values.
#[must_use]
pub fn total(values: &[f32]) -> f64 {
    values.iter().filter(|value| value.is_finite()).map(|&value| f64::from(value)).sum()
}
