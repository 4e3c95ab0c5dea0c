//! The labelled dimensions of a cube: what is swept.

use serde_json::{Map, Value, json};

/// A swept parameter and its values as they were typed, or the seed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Axis {
    /// The parameter.
    pub name: String,
    /// Its values, in the order of the members.
    pub values: Vec<String>,
}

impl Axis {
    /// The name of the dimension: letters, digits and `_`, as CF asks for.
    #[must_use]
    pub fn dimension(&self) -> String {
        self.name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect()
    }

    /// Its coordinates, with the attributes that explain them: numbers with their unit, or else the positions of words.
    #[must_use]
    pub fn coordinates(&self) -> (Vec<f64>, Map<String, Value>) {
        let mut attributes = Map::new();
        attributes.insert("long_name".to_owned(), json!(self.name));
        if let Some((numbers, unit)) = numbers(&self.values) {
            if !unit.is_empty() {
                attributes.insert("units".to_owned(), json!(unit));
            }
            return (numbers, attributes);
        }
        let positions: Vec<f64> = (0..self.values.len()).map(|at| at as f64).collect();
        let words = self.values.iter().map(|value| value.split_whitespace().collect::<Vec<_>>().join("_"));
        attributes.insert("flag_values".to_owned(), json!(positions));
        attributes.insert("flag_meanings".to_owned(), json!(words.collect::<Vec<_>>().join(" ")));
        (positions, attributes)
    }
}

/// Numbers that all have the same unit, and this unit.
fn numbers(values: &[String]) -> Option<(Vec<f64>, String)> {
    let parsed = values.iter().map(|value| {
        let (number, unit) = value.trim().split_once(' ').unwrap_or((value.trim(), ""));
        number.parse::<f64>().ok().filter(|number| number.is_finite()).map(|number| (number, unit.trim()))
    });
    let parsed: Vec<(f64, &str)> = parsed.collect::<Option<_>>()?;
    let unit = parsed.first()?.1;
    let is_same = parsed.iter().all(|(_, other)| *other == unit);
    is_same.then(|| (parsed.iter().map(|(number, _)| *number).collect(), unit.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(name: &str, values: &[&str]) -> Axis {
        Axis { name: name.to_owned(), values: values.iter().map(|value| (*value).to_owned()).collect() }
    }

    #[test]
    fn values_are_numbers_with_a_unit_or_words() {
        let (numbers, attributes) = axis("rivers.duration", &["1 Myr", "1.5 Myr"]).coordinates();
        assert_eq!((numbers, &attributes["units"]), (vec![1.0, 1.5], &json!("Myr")));
        let (seeds, attributes) = axis("seed", &["3", "4"]).coordinates();
        assert_eq!((seeds, attributes.get("units")), (vec![3.0, 4.0], None));
        for words in [["1 Myr", "500 kyr"], ["add", "max"], ["(1, 2)", "(3, 4)"]] {
            let (positions, attributes) = axis("mode", &words).coordinates();
            assert_eq!(positions, [0.0, 1.0]);
            assert_eq!(attributes["flag_meanings"].as_str().expect("words").split(' ').count(), 2, "{attributes:?}");
        }
        assert_eq!(axis("rivers.duration", &["1"]).dimension(), "rivers_duration");
    }
}
