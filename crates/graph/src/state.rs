//! What a run on some cells leaves to the run on finer ones.

/// The state of a node's run on one [level](crate::Levels), for its run on the next finer one. Only its node knows what
/// the numbers mean; no wire carries it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Numbers per cell.
    pub rasters: Vec<Vec<f32>>,
    /// Other numbers.
    pub numbers: Vec<f64>,
}

impl State {
    /// Size of its contents in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let samples: usize = self.rasters.iter().map(Vec::len).sum();
        samples * size_of::<f32>() + self.numbers.len() * size_of::<f64>()
    }

    /// Whether all numbers per cell are finite, and the others are numbers or infinite.
    pub(crate) fn is_valid(&self) -> bool {
        // without an early exit inside a raster the loop is vectorised
        let finite = |samples: &Vec<f32>| !samples.iter().fold(false, |bad, v| bad | !v.is_finite());
        self.rasters.iter().all(finite) && !self.numbers.iter().any(|v| v.is_nan())
    }
}
