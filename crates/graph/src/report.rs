//! Reports: the results of measuring nodes.

use serde::{Deserialize, Serialize};

/// Measures, curves and notes, in the order they were written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// One line per measure.
    pub measures: Vec<Measure>,
    /// Curves and histograms.
    pub series: Vec<Series>,
    /// What a process moved, one balance per material.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ledger: Vec<Balance>,
    /// Notes on the measurement, such as "hillslopes are not resolved at this cell size".
    pub notes: Vec<String>,
}

/// A named number. Two undefined values are equal.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Measure {
    /// Name in snake case, such as `hypsometric_integral`.
    pub name: String,
    /// The value; not finite where it is undefined (written as null in JSON).
    pub value: f64,
    /// Symbol of the unit, empty for pure numbers.
    pub unit: String,
}

impl PartialEq for Measure {
    fn eq(&self, other: &Self) -> bool {
        let same = self.value == other.value || self.value.is_nan() && other.value.is_nan();
        same && self.name == other.name && self.unit == other.unit
    }
}

/// The volumes of a material in a process, in m³: what was there, came, went and remained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Balance {
    /// The material: `rock`, `soil`, `debris`, `till`, `sediment`, `ice`, `snow` or `water`.
    pub material: String,
    /// What was there at the start.
    pub start: f64,
    /// What came.
    pub gained: Vec<Amount>,
    /// What went.
    pub lost: Vec<Amount>,
    /// What is there at the end.
    pub end: f64,
    /// What is unaccounted for, as a fraction of what moved; of the start where nothing moved.
    pub error: f64,
}

/// A named volume of a balance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Amount {
    /// Name in snake case, such as `left_the_world`.
    pub name: String,
    /// The volume in m³; negative where it is the opposite of its name.
    pub volume: f64,
}

/// A curve: y over x, or a histogram.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Name in snake case, such as `spectrum`; that of a histogram ends in `_histogram`.
    pub name: String,
    /// Abscissa, with its unit.
    pub x: Axis,
    /// Ordinate, with its unit.
    pub y: Axis,
    /// The reference whose curve it is. None for what the report measures. Curves of one name belong in one plot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
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
    /// True if it is drawn with a logarithmic scale.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub log: bool,
}

impl Axis {
    /// A linear axis.
    #[must_use]
    pub fn new(label: &str, unit: &str, values: Vec<f64>) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), values, log: false }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn logarithmic(label: &str, unit: &str, values: Vec<f64>) -> Self {
        Self { log: true, ..Self::new(label, unit, values) }
    }
}

impl Series {
    /// A curve of what the report measures.
    #[must_use]
    pub fn new(name: &str, x: Axis, y: Axis) -> Self {
        Self { name: name.to_owned(), x, y, of: None }
    }

    /// The curve as that of a reference.
    #[must_use]
    pub fn of(self, reference: &str) -> Self {
        Self { of: Some(reference.to_owned()), ..self }
    }

    /// The bars of a histogram: where each begins and ends, and its height. Returns None for a curve.
    ///
    /// Bars are equally wide. They begin at their abscissas if the label of the axis ends in `from`; otherwise the
    /// abscissas are their centres.
    #[must_use]
    pub fn bars(&self) -> Option<Vec<[f64; 3]>> {
        let &[first, second, ..] = self.x.values.as_slice() else { return None };
        if self.x.log || !self.name.ends_with("_histogram") {
            return None;
        }
        let width = second - first;
        let before = if self.x.label.ends_with(" from") { 0.0 } else { 0.5 * width };
        let pairs = self.x.values.iter().zip(&self.y.values);
        Some(pairs.map(|(x, y)| [x - before, x - before + width, *y]).collect())
    }
}

impl Report {
    /// A message on a curve whose axes differ in length. Returns None when there is none.
    pub(crate) fn fault(&self) -> Option<String> {
        let odd = self.series.iter().find(|series| series.x.values.len() != series.y.values.len())?;
        let [x, y] = [&odd.x, &odd.y].map(|axis| axis.values.len());
        Some(format!("returned the curve `{}` with {x} abscissas and {y} ordinates", odd.name))
    }

    /// Adds a number.
    pub fn measure(&mut self, name: &str, value: f64, unit: &str) {
        self.measures.push(Measure { name: name.to_owned(), value, unit: unit.to_owned() });
    }

    /// Adds the balance of a material.
    pub fn balance(&mut self, balance: Balance) {
        self.ledger.push(balance);
    }

    /// Looks the balance of a material up.
    #[must_use]
    pub fn balance_of(&self, material: &str) -> Option<&Balance> {
        self.ledger.iter().find(|balance| balance.material == material)
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
        let amounts: usize = self.ledger.iter().map(|b| 64 * (1 + b.gained.len() + b.lost.len())).sum();
        64 * self.measures.len() + amounts + series + self.notes.iter().map(String::len).sum::<usize>()
    }
}

impl Balance {
    /// Closes the balance of a material. What moved is the larger of what came and what went.
    #[must_use]
    pub fn new(material: &str, start: f64, gained: &[(&str, f64)], lost: &[(&str, f64)], end: f64) -> Self {
        let total = |amounts: &[(&str, f64)]| amounts.iter().map(|(_, volume)| volume).sum::<f64>();
        let size = |amounts: &[(&str, f64)]| amounts.iter().map(|(_, volume)| volume.abs()).sum::<f64>();
        let missing = start + total(gained) - total(lost) - end;
        let moved = size(gained).max(size(lost));
        let whole = if moved > 0.0 { moved } else { start.abs() };
        let named = |amounts: &[(&str, f64)]| {
            amounts.iter().map(|&(name, volume)| Amount { name: name.to_owned(), volume }).collect()
        };
        Self {
            material: material.to_owned(),
            start,
            gained: named(gained),
            lost: named(lost),
            end,
            error: if whole > 0.0 { missing / whole } else { missing },
        }
    }

    /// Looks a volume that came or went up by name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<f64> {
        self.gained.iter().chain(&self.lost).find(|amount| amount.name == name).map(|amount| amount.volume)
    }
}

#[cfg(test)]
mod tests {
    use super::{Axis, Balance, Series};

    #[test]
    fn only_a_histogram_has_bars() {
        let series = |name: &str, label: &str| {
            Series::new(name, Axis::new(label, "°", vec![0.0, 10.0, 20.0]), Axis::new("share", "", vec![0.5, 0.3, 0.2]))
        };
        let from = series("slope_histogram", "slope from").bars().expect("bars");
        assert_eq!(from, [[0.0, 10.0, 0.5], [10.0, 20.0, 0.3], [20.0, 30.0, 0.2]]);
        let around = series("aspect_histogram", "facing").bars().expect("bars");
        assert_eq!(around[1], [5.0, 15.0, 0.3]);
        assert_eq!(series("spectrum", "slope from").bars(), None);
    }

    #[test]
    fn a_balance_states_what_is_missing_as_a_fraction_of_what_moved() {
        let water =
            |out: f64, end: f64| Balance::new("water", 10.0, &[("rain", 90.0)], &[("left_the_world", out)], end);
        assert_eq!(water(75.0, 25.0).error, 0.0);
        assert_eq!(water(30.0, 61.0).error, 0.1);
        assert_eq!(water(30.0, 61.0).get("rain"), Some(90.0));
        assert_eq!(Balance::new("ice", 0.0, &[], &[], 0.0).error, 0.0);
        assert_eq!(Balance::new("ice", 8.0, &[], &[], 6.0).error, 0.25);
        assert_eq!(Balance::new("ice", 0.0, &[], &[], 6.0).error, -6.0);
    }
}
