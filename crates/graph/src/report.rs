//! Reports: the results of measuring nodes.

use serde::{Deserialize, Serialize};

/// Measures, curves and notes, in the order they were written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// One line per measure.
    pub measures: Vec<Measure>,
    /// Curves and histograms.
    pub series: Vec<Series>,
    /// Notes on the measurement, such as "hillslopes are not resolved at this cell size".
    pub notes: Vec<String>,
}

/// A named number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    /// Name in snake case, such as `hypsometric_integral`.
    pub name: String,
    /// The value; not finite where it is undefined (written as null in JSON).
    pub value: f64,
    /// Symbol of the unit, empty for pure numbers.
    pub unit: String,
}

/// A curve: y over x.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Name in snake case, such as `slope_histogram`.
    pub name: String,
    /// Abscissa, with its unit.
    pub x: Axis,
    /// Ordinate, with its unit.
    pub y: Axis,
}

/// One axis of a curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Label of the axis.
    pub label: String,
    /// Symbol of the unit, empty for pure numbers.
    pub unit: String,
    /// The values.
    pub values: Vec<f64>,
}

impl Report {
    /// Adds a number.
    pub fn measure(&mut self, name: &str, value: f64, unit: &str) {
        self.measures.push(Measure { name: name.to_owned(), value, unit: unit.to_owned() });
    }

    /// Looks a number up by name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        self.measures.iter().find(|m| m.name == name).map(|m| m.value)
    }

    /// Approximate size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let series: usize = self.series.iter().map(|s| 64 + 8 * (s.x.values.len() + s.y.values.len())).sum();
        64 * self.measures.len() + series + self.notes.iter().map(String::len).sum::<usize>()
    }
}
