//! Distances between whole distributions: elevations, slopes, hypsometric curves.

use crate::{
    measure::metrics::{Elevations, Land, slopes},
    numerics::distribution::{quantiles, wasserstein},
    prelude::*,
};

/// Wasserstein-1 distances of slope and elevation divided by the reference's interquartile range, and the mean
/// difference of the hypsometric curves. 0 means equal distributions.
pub(super) fn measure(land: &Land<'_>, reference: &Land<'_>, report: &mut Report) {
    let mut distance = |name: &str, a: &[f32], b: &[f32]| {
        let quartiles = quantiles(b, &[0.25, 0.75]);
        report.measure(name, wasserstein(a, b) / (quartiles[1] - quartiles[0]), "");
    };
    let lands = [land, reference];
    let finite = |land: &Land<'_>| land.samples().iter().copied().filter(|z| z.is_finite()).collect::<Vec<f32>>();
    let [a, b] = lands.map(finite);
    distance("elevation_distance", &a, &b);
    let [a, b] = lands.map(|land| slopes(land, &|| Ok(())).unwrap_or_default());
    distance("slope_distance", &a, &b);
    let curves = lands.map(|land| Elevations::of(&land.field).curve(&land.field));
    let difference: f64 = curves[0].iter().zip(&curves[1]).map(|(a, b)| (a - b).abs()).sum();
    report.measure("hypsometry_distance", difference / curves[0].len() as f64, "");
}
