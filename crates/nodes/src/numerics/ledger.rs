//! Sums over cells for the balances of processes.

use super::par;

/// Cells whose sum is a part of a sum from a device. Parts are added in their order, whatever thread computes them.
const PART: usize = 1 << 16;

/// What a change adds to gains and to losses, both positive; nothing if it is not finite.
#[must_use]
pub fn gain_and_loss(change: f64) -> [f64; 2] {
    if change.is_finite() { [change.max(0.0), (-change).max(0.0)] } else { [0.0; 2] }
}

/// What cells gained and what cells lost: the sums of the positive and of the negative changes, both positive.
#[must_use]
pub fn gains_and_losses(changes: impl Iterator<Item = f64>) -> [f64; 2] {
    changes.map(gain_and_loss).fold([0.0; 2], |[gains, losses], [gain, loss]| [gains + gain, losses + loss])
}

/// The sum of finite values.
#[must_use]
pub fn total(values: &[f32]) -> f64 {
    values.iter().filter(|value| value.is_finite()).map(|&value| f64::from(value)).sum()
}

/// Sums of numbers that a device has computed, read as words: of what each number adds to each sum.
#[must_use]
pub fn sums<const N: usize>(words: &[u32], adds: impl Fn(f64) -> [f64; N] + Sync) -> [f64; N] {
    let add = |sums: [f64; N], added: [f64; N]| std::array::from_fn(|at| sums[at] + added[at]);
    let number = |bits: &u32| f64::from(f32::from_bits(*bits));
    let part = |_, words: &[u32]| words.iter().fold([0.0; N], |sums, bits| add(sums, adds(number(bits))));
    par::collect_all(words.chunks(PART), part).into_iter().fold([0.0; N], add)
}
