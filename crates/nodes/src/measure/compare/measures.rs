//! The measures that Compare reports.

use orograph_graph::MeasureSpec;

/// Declares the distances of measures of Metrics after the scores and the distances of distributions.
macro_rules! measures {
    ($($name:literal),+ $(,)?) => {
        /// The measures of Metrics that say something about the form of a terrain: no settings, extents or counts that
        /// grow with the terrain.
        pub(super) const COMPARED: &[&str] = &[$($name),+];

        /// In the order of the report.
        pub static MEASURES: &[MeasureSpec] = &[
            measure("score", "Realism: the least of its three parts. Real land scores about 1."),
            measure("score.texture", "Realism of slopes, roughness, spectrum and forms."),
            measure("score.drainage", "Realism of rivers, basins and valleys."),
            measure("score.marks", "Absence of computational artefacts: planar slopes, straight rivers, combs."),
            measure("elevation_distance", "Wasserstein distance of elevations, in interquartile ranges of the reference."),
            measure("slope_distance", "Wasserstein distance of slopes, in interquartile ranges of the reference."),
            measure("hypsometry_distance", "Mean difference of the hypsometric curves."),
            $(measure(concat!("distance.", $name), concat!("Distance of `", $name, "` in natural spreads."))),+
        ];
    };
}

const fn measure(name: &'static str, doc: &'static str) -> MeasureSpec {
    MeasureSpec { name, unit: "", doc }
}

measures! {
    "elevation.std",
    "relief",
    "relief_ratio",
    "hypsometric_integral",
    "local_relief.mean",
    "local_relief.max",
    "local_relief.ratio",
    "slope.mean",
    "slope.p5",
    "slope.p25",
    "slope.p50",
    "slope.p75",
    "slope.p95",
    "slope.p99",
    "slope.p95_to_p50",
    "slope.fullest_5_degrees",
    "slope.below_3_degrees",
    "slope.above_45_degrees",
    "aspect.four_fold",
    "aspect.eight_fold",
    "roughness.two_cells",
    "roughness.ruggedness",
    "roughness.vectors",
    "roughness.laplacian_skew",
    "planar_share",
    "position.rms",
    "spectrum.beta",
    "spectrum.beta_8_to_24_cells",
    "spectrum.beta_4_to_8_cells",
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
    "peaks.density",
    "pits.share",
    "pits.deeper_than_1_m",
    "drainage_density",
    "drainage_density.by_slope",
    "channels.straight",
    "channels.eight_fold",
    "channels.sinuosity",
    "border.comb",
    "basin.relief",
    "basin.relief_ratio",
    "basins.hypsometric_integral",
    "streams.bifurcation_ratio",
    "streams.length_ratio",
    "streams.area_ratio",
    "hack_exponent",
    "concavity",
    "concavity.r2",
    "concavity.scatter",
    "steepness.p50",
    "steepness.p95",
    "chi.concavity",
    "chi.r2",
    "valleys.v_index",
    "valleys.exponent",
    "valleys.floor",
}
