//! Layers of rock as data: the rows of a geologist's column, from the top down.

use std::fmt;

use super::{Kind, ParamType, ParamValue, range_text};
use crate::{
    colour::Srgb,
    unit::{Unit, plain},
};

/// One layer of rock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Thickness in metres.
    pub thickness: f64,
    /// How many times more slowly it erodes than rock of hardness 1.
    pub hardness: f64,
    /// Steepest stable slope, in degrees.
    pub repose: f64,
    /// Its colour in pictures.
    pub colour: Srgb,
}

impl Layer {
    /// Rock of hardness 1; a field that a file leaves out has this value.
    pub const USUAL: Self = Self { thickness: 100.0, hardness: 1.0, repose: 38.0, colour: Srgb::hex(0xb0_a0_8c) };
    /// The allowed range of the thickness, in metres.
    pub const THICKNESSES: [f64; 2] = [0.01, 1e5];
    /// The allowed range of the hardness.
    pub const HARDNESSES: [f64; 2] = [0.01, 1e3];
    /// The allowed range of the steepest slope, in degrees.
    pub const REPOSES: [f64; 2] = [1.0, 90.0];
    /// The largest number of layers of a table.
    pub const MOST: usize = 10_000;
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { thickness, hardness, repose, colour } = self;
        let [thickness, hardness, repose] = [thickness, hardness, repose].map(|value| plain(*value));
        write!(f, "(thickness: {thickness}, hardness: {hardness}, repose: {repose}, colour: \"{colour}\")")
    }
}

/// A parameter of layers from the top down; empty by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerTable(pub Vec<Layer>);

impl ParamType for LayerTable {
    type Range = std::ops::RangeFull;

    fn kind(default: Self, _: Self::Range) -> Kind {
        Kind::Layers { default: default.0 }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Layers(layers) => Some(Self(layers.clone())),
            _ => None,
        }
    }
}

/// The problem with a table, if any.
pub(super) fn check(name: &str, layers: &[Layer]) -> Result<(), String> {
    if layers.len() > Layer::MOST {
        return Err(format!("`{name}` has {} layers, at most {} are allowed", layers.len(), Layer::MOST));
    }
    layers.iter().enumerate().try_for_each(|(at, layer)| {
        let number = |field: &str, value: f64, range: [f64; 2], unit: Unit| {
            if value >= range[0] && value <= range[1] {
                return Ok(());
            }
            let allowed = format!("{}{}", unit.describe(), range_text(range, unit));
            Err(format!("layer {} of `{name}`: `{field}` is {}, but must be {allowed}", at + 1, plain(value)))
        };
        number("thickness", layer.thickness, Layer::THICKNESSES, Unit::Metres)?;
        number("hardness", layer.hardness, Layer::HARDNESSES, Unit::One)?;
        number("repose", layer.repose, Layer::REPOSES, Unit::Degrees)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_without_thickness_and_too_many_are_refused() {
        let of = |thickness: f64| [Layer::USUAL, Layer { thickness, ..Layer::USUAL }];
        for thickness in [0.0, -5.0, f64::NAN, 1e6] {
            let refused = check("layers", &of(thickness)).expect_err("no thickness");
            let says = format!("layer 2 of `layers`: `thickness` is {}, but must be", plain(thickness));
            assert!(refused.starts_with(&says) && refused.contains("0.01"), "{refused}");
        }
        assert_eq!(check("layers", &of(0.01)), Ok(()));
        assert_eq!(check("layers", &vec![Layer::USUAL; Layer::MOST]), Ok(()));
        let refused = check("layers", &vec![Layer::USUAL; Layer::MOST + 1]).expect_err("too many");
        assert!(refused.contains("10001 layers, at most 10000"), "{refused}");
    }
}
