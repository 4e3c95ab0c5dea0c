//! Distributions of samples: exact order statistics, quantiles, the distance between two distributions.

use std::sync::{Mutex, PoisonError};

use super::par;

/// Samples per task.
const CHUNK: usize = 1 << 18;

/// Mean and standard deviation of the samples of rows of `nx`. The sum of each row is added up on its own, so that they
/// are the same for any number of threads.
pub fn moments(samples: &[f32], nx: usize) -> (f64, f64) {
    let mean_of = |of: &(dyn Fn(f64) -> f64 + Sync)| {
        let row = |_, row: &[f32]| row.iter().map(|&x| of(f64::from(x))).sum::<f64>();
        par::collect_all(samples.chunks(nx), row).iter().sum::<f64>() / samples.len() as f64
    };
    let mean = mean_of(&|x| x);
    (mean, mean_of(&|x| (x - mean) * (x - mean)).sqrt())
}

/// Returns the order-preserving unsigned integer of a float.
fn key(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 0 { bits | 0x8000_0000 } else { !bits }
}

/// Returns the order statistics at the given places without sorting all samples: counts the upper halves of their bits,
/// then sorts only the samples that share an upper half with a requested place.
///
/// # Panics
/// If a place is not below the number of samples.
fn order_statistics(samples: &[f32], places: &[usize]) -> Vec<f32> {
    let count = |chunk: &[f32]| -> Vec<usize> {
        let mut counts = vec![0_usize; 1 << 16];
        for &sample in chunk {
            counts[(key(sample) >> 16) as usize] += 1;
        }
        counts
    };
    let counts = Mutex::new(vec![0; 1 << 16]);
    par::all(samples.chunks(CHUNK), |_, chunk| {
        let more = count(chunk);
        let mut counts = counts.lock().unwrap_or_else(PoisonError::into_inner);
        counts.iter_mut().zip(more).for_each(|(count, more)| *count += more);
    });
    let counts = counts.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut first = 0;
    let starts: Vec<usize> = counts
        .iter()
        .map(|count| {
            first += count;
            first - count
        })
        .collect();
    let bucket_of = |place: usize| starts.partition_point(|&start| start <= place) - 1;
    let mut slots = vec![usize::MAX; 1 << 16];
    let mut members: Vec<Vec<f32>> = Vec::new();
    for &place in places {
        let slot = &mut slots[bucket_of(place)];
        if *slot == usize::MAX {
            *slot = members.len();
            members.push(Vec::new());
        }
    }
    let wanted = |sample: &f32| slots[(key(*sample) >> 16) as usize] != usize::MAX;
    let of_chunk = |_, chunk: &[f32]| chunk.iter().copied().filter(wanted).collect::<Vec<f32>>();
    for sample in par::collect_all(samples.chunks(CHUNK), of_chunk).into_iter().flatten() {
        members[slots[(key(sample) >> 16) as usize]].push(sample);
    }
    par::all(&mut members, |_, members| members.sort_unstable_by(f32::total_cmp));
    places.iter().map(|&place| members[slots[bucket_of(place)]][place - starts[bucket_of(place)]]).collect()
}

/// Returns quantiles at the given levels, 0 to 1, interpolated linearly between the two nearest samples; NaN if there
/// are no samples.
#[must_use]
pub fn quantiles(samples: &[f32], levels: &[f64]) -> Vec<f64> {
    if samples.is_empty() {
        return vec![f64::NAN; levels.len()];
    }
    let last = samples.len() - 1;
    let places: Vec<f64> = levels.iter().map(|level| level.clamp(0.0, 1.0) * last as f64).collect();
    let around: Vec<usize> = places.iter().flat_map(|&p| [p as usize, (p as usize + 1).min(last)]).collect();
    let values = order_statistics(samples, &around);
    places
        .iter()
        .zip(values.chunks_exact(2))
        .map(|(place, pair)| {
            let (low, high) = (f64::from(pair[0]), f64::from(pair[1]));
            low + (high - low) * (place - place.floor())
        })
        .collect()
}

/// Returns the Wasserstein-1 distance `∫ |F⁻¹(u) − G⁻¹(u)| du` between two sets of samples, in their unit: the mean
/// distance by which samples must move to turn one distribution into the other. NaN if a set is empty.
#[must_use]
pub fn wasserstein(a: &[f32], b: &[f32]) -> f64 {
    if a.is_empty() || b.is_empty() {
        return f64::NAN;
    }
    let sorted = |samples: &[f32]| {
        let mut samples = samples.to_vec();
        par::sort(&mut samples);
        samples
    };
    let (a, b) = (sorted(a), sorted(b));
    let (n, m) = (a.len() as u128, b.len() as u128);
    // both quantile functions step at multiples of 1 / (n m)
    let (mut i, mut j, mut level, mut sum) = (0, 0, 0_u128, 0.0);
    while i < a.len() && j < b.len() {
        let (next_a, next_b) = ((i as u128 + 1) * m, (j as u128 + 1) * n);
        let next = next_a.min(next_b);
        sum += (f64::from(a[i]) - f64::from(b[j])).abs() * (next - level) as f64;
        level = next;
        i += usize::from(next_a == next);
        j += usize::from(next_b == next);
    }
    sum / (n * m) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_statistics_are_those_of_a_sort() {
        let samples: Vec<f32> =
            (0..5000_u32).map(|i| (f64::from(orograph_graph::mix(i)) / 1e6 - 2000.0) as f32 * 0.1).collect();
        let mut sorted = samples.clone();
        sorted.sort_by(f32::total_cmp);
        let places: Vec<usize> = (0..5000).collect();
        assert_eq!(order_statistics(&samples, &places), sorted);
        assert_eq!(order_statistics(&[2.0; 9], &[0, 8]), [2.0, 2.0]);
    }

    #[test]
    fn quantiles_lie_between_samples() {
        assert_eq!(quantiles(&[4.0, 1.0, 3.0, 2.0], &[0.0, 0.5, 1.0]), [1.0, 2.5, 4.0]);
        assert_eq!(quantiles(&[7.0], &[0.3]), [7.0]);
        assert!(quantiles(&[], &[0.5])[0].is_nan());
    }

    #[test]
    fn the_distance_of_shifted_samples_is_the_shift() {
        let a: Vec<f32> = (0..100).map(|i| i as f32).collect();
        let b: Vec<f32> = a.iter().map(|v| v + 2.5).collect();
        assert_eq!(wasserstein(&a, &b), 2.5);
        assert_eq!(wasserstein(&a, &a), 0.0);
        // two of 0 and 1 against three of 0, 0 and 1: a sixth of the mass moves by one
        assert!((wasserstein(&[0.0, 1.0], &[0.0, 0.0, 1.0]) - 1.0 / 6.0).abs() < 1e-15);
        assert!(wasserstein(&a, &[]).is_nan());
    }
}
