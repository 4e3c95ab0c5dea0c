//! The curves of real terrain, which are drawn beside those of a terrain that is compared with a kind.

use std::{collections::BTreeMap, sync::LazyLock};

use orograph_graph::Series;

/// The curves of each model, whole and at cells of 80 to 100 m.
static TABLE: &str = include_str!("curves.json");

/// Points of a curve.
pub const POINTS: usize = 100;

/// The curves of a model; none for another name.
pub(super) fn of(model: &str) -> &'static [Series] {
    static READ: LazyLock<BTreeMap<String, Vec<Series>>> =
        LazyLock::new(|| serde_json::from_str(TABLE).unwrap_or_default());
    READ.get(model).map_or(&[], Vec::as_slice)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::compare::Kind;

    #[test]
    fn every_kind_has_curves_that_fit_their_axes() {
        for kind in Kind::ALL.iter().filter(|kind| **kind != Kind::None) {
            assert!(!kind.beside().is_empty(), "{}", kind.name());
            for model in kind.beside() {
                let curves = of(model);
                assert!(curves.iter().any(|curve| curve.name == "slope_histogram"), "{model}");
                assert!(curves.iter().all(|curve| curve.x.values.len() == curve.y.values.len()), "{model}");
                assert!(curves.iter().all(|curve| curve.x.values.len() <= POINTS + 1), "{model}");
            }
        }
    }
}
