//! A reference terrain that is measured once and compared with many others.

use orograph_graph::Cancel;

use super::{COMPARED, averaged, measures, quarters, real::spread, score};
use crate::prelude::*;

/// A terrain with its measures and those of its quarters, whose spread is the unit of distances.
#[derive(Clone, Debug)]
pub struct Reference {
    /// The terrain at the cells on which it is compared.
    pub(super) land: Field,
    /// A remark on its cells.
    pub(super) note: Option<String>,
    pub(super) own: Report,
    quarters: Vec<Report>,
}

impl Reference {
    /// Measures a heightfield and its quarters.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`], or when there is not enough memory.
    pub fn of(height: &Field, cancel: &Cancel) -> Result<Self, NodeError> {
        let (land, note) = averaged(height, &|| check(cancel))?;
        let own = measures(&land, cancel)?;
        let quarters = quarters(&land).iter().map(|quarter| measures(quarter, cancel)).collect::<Result<_, _>>()?;
        Ok(Self { land, note, own, quarters })
    }

    /// The value of a measure and its natural spread, the standard deviation among the quarters. Returns None if fewer
    /// than three quarters have the measure, or all have the same.
    #[must_use]
    pub fn natural(&self, name: &str) -> Option<[f64; 2]> {
        let values = self.quarters.iter().filter_map(|quarter| quarter.get(name));
        let known: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        let [_, spread] = spread(&known);
        self.own.get(name).filter(|_| known.len() >= 3 && spread > 0.0).map(|middle| [middle, spread])
    }

    /// The distances of a heightfield: each measure that the reference has, in natural spreads. A measure that is
    /// undefined for the heightfield has a NaN.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`], or when there is not enough memory.
    pub fn distances(&self, height: &Field, cancel: &Cancel) -> Result<Vec<(&'static str, f64)>, NodeError> {
        let measured = measures(&averaged(height, &|| check(cancel))?.0, cancel)?;
        let distance = |(name, [middle, spread]): (&'static str, [f64; 2])| {
            (name, (measured.get(name).unwrap_or(f64::NAN) - middle) / spread.max(score::least(name)))
        };
        Ok(self.measures().map(distance).collect())
    }

    /// The measures that distances have, with their values and natural spreads.
    pub fn measures(&self) -> impl Iterator<Item = (&'static str, [f64; 2])> {
        let natural = |name: &&'static str| Some((*name, self.natural(name).filter(|[middle, _]| middle.is_finite())?));
        COMPARED.iter().filter_map(natural)
    }
}

fn check(cancel: &Cancel) -> Result<(), NodeError> {
    if cancel.is_cancelled() { Err(NodeError::Cancelled) } else { Ok(()) }
}
