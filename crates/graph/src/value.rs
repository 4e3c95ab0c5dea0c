//! The values that wires carry, and their meaning.

use std::{fmt, sync::Arc};

use crate::{
    device::DeviceError, field::Field, lines::Lines, report::Report, state::State, strata::Strata, unit::Unit,
};

/// The meaning of a value; ports are typed by it, so that a slope cannot be wired to an input for a height.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PortType {
    /// Elevation in metres, one plane.
    Height,
    /// A mask from 0 to 1, one plane.
    Mask,
    /// Any other scalar, with its unit, one plane.
    Scalar(Unit),
    /// A vector per cell (x east, y south), two planes.
    Vector(Unit),
    /// Linear RGB, three planes, 0 to 1.
    Colour,
    /// Surface normals as in a normal map: red, green and blue from -1 to 1.
    Normal,
    /// Weights of four layers in each cell, with a sum of one (a splat map).
    Weights,
    /// Flow directions: four planes, written and read by hydrology nodes. Only wires carry it; files cannot.
    Flow,
    /// Rock at depth. Only wires carry it; files cannot.
    Strata,
    /// Lines in the world, such as rivers.
    Lines,
    /// Measures and curves.
    Report,
    /// On an input only: a height, a mask or any scalar.
    AnyScalar,
}

impl PortType {
    /// Returns true if an output of type `from` may be wired to an input of this type.
    ///
    /// A mask is also accepted as a plain number and a height as a length; all other types must be equal.
    #[must_use]
    pub fn accepts(self, from: Self) -> bool {
        self == from
            || match self {
                Self::AnyScalar => matches!(from, Self::Height | Self::Mask | Self::Scalar(_)),
                Self::Scalar(Unit::One) => from == Self::Mask,
                Self::Scalar(Unit::Metres) => from == Self::Height,
                _ => false,
            }
    }

    /// The unit of its numbers.
    #[must_use]
    pub const fn unit(self) -> Unit {
        match self {
            Self::Height => Unit::Metres,
            Self::Scalar(unit) | Self::Vector(unit) => unit,
            Self::Mask
            | Self::Colour
            | Self::Normal
            | Self::Weights
            | Self::Flow
            | Self::Strata
            | Self::Lines
            | Self::Report
            | Self::AnyScalar => Unit::One,
        }
    }

    /// Number of planes of a field of this type. Returns None when values of the type are not fields.
    #[must_use]
    pub const fn planes(self) -> Option<usize> {
        match self {
            Self::Height | Self::Mask | Self::Scalar(_) | Self::AnyScalar => Some(1),
            Self::Vector(_) => Some(2),
            Self::Colour | Self::Normal => Some(3),
            Self::Weights | Self::Flow => Some(4),
            Self::Strata | Self::Lines | Self::Report => None,
        }
    }

    /// Returns true if a value of this type can be written to a file. Flow and strata cannot: their parts are separate
    /// outputs.
    #[must_use]
    pub const fn is_writable(self) -> bool {
        !matches!(self, Self::Flow | Self::Strata)
    }
}

impl PortType {
    /// Its name with an article, where it takes one.
    #[must_use]
    pub fn one(self) -> String {
        match self {
            Self::Weights | Self::Strata | Self::Lines => self.to_string(),
            _ => format!("a {self}"),
        }
    }
}

impl fmt::Display for PortType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Height => f.write_str("height (m)"),
            Self::Mask => f.write_str("mask"),
            Self::Scalar(unit) if unit.symbol().is_empty() => f.write_str("scalar"),
            Self::Scalar(unit) => write!(f, "scalar ({unit})"),
            Self::Vector(unit) if unit.symbol().is_empty() => f.write_str("vector"),
            Self::Vector(unit) => write!(f, "vector ({unit})"),
            Self::Colour => f.write_str("colour"),
            Self::Normal => f.write_str("normal"),
            Self::Weights => f.write_str("weights"),
            Self::Flow => f.write_str("flow"),
            Self::Strata => f.write_str("strata"),
            Self::Lines => f.write_str("lines"),
            Self::Report => f.write_str("report"),
            Self::AnyScalar => f.write_str("height, mask or scalar"),
        }
    }
}

/// A value on a wire. Copies share their contents.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A raster.
    Field(Field),
    /// Rock at depth.
    Strata(Arc<Strata>),
    /// Lines in the world.
    Lines(Arc<Lines>),
    /// Measures and curves.
    Report(Arc<Report>),
    /// What a node keeps for its run on finer cells. Never on a wire, and never delivered.
    State(Arc<State>),
}

impl Value {
    /// The raster. Returns None when the value is not a field.
    #[must_use]
    pub const fn as_field(&self) -> Option<&Field> {
        match self {
            Self::Field(field) => Some(field),
            Self::Strata(_) | Self::Lines(_) | Self::Report(_) | Self::State(_) => None,
        }
    }

    /// The rock at depth. Returns None when the value is of another type.
    #[must_use]
    pub fn as_strata(&self) -> Option<&Strata> {
        match self {
            Self::Strata(strata) => Some(strata),
            Self::Field(_) | Self::Lines(_) | Self::Report(_) | Self::State(_) => None,
        }
    }

    /// The lines. Returns None when the value is of another type.
    #[must_use]
    pub fn as_lines(&self) -> Option<&Lines> {
        match self {
            Self::Lines(lines) => Some(lines),
            Self::Field(_) | Self::Strata(_) | Self::Report(_) | Self::State(_) => None,
        }
    }

    /// The report. Returns None when the value is of another type.
    #[must_use]
    pub fn as_report(&self) -> Option<&Report> {
        match self {
            Self::Report(report) => Some(report),
            Self::Field(_) | Self::Strata(_) | Self::Lines(_) | Self::State(_) => None,
        }
    }

    /// Brings the samples of a raster to the host, if they are on a device.
    ///
    /// # Errors
    /// When the device does not give them back.
    pub fn fetch(&self) -> Result<(), DeviceError> {
        self.as_field().map_or(Ok(()), Field::fetch)
    }

    /// A message on what no node may return, such as a number that is not finite. Returns None when there is nothing.
    /// A raster on a device is not read: the device has checked its samples, and brought those with a fault back.
    pub(crate) fn fault(&self) -> Option<String> {
        match self {
            Self::Field(field) => field.host().and_then(|_| field.fault()),
            Self::Strata(strata) => strata.column().fault().or_else(|| strata.offset().fault()),
            Self::Lines(lines) => lines.fault(),
            Self::Report(report) => report.fault(),
            Self::State(state) => (!state.is_valid()).then(|| "has a number that is not finite".to_owned()),
        }
    }

    /// Size of its contents in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match self {
            Self::Field(field) => field.bytes(),
            Self::Strata(strata) => strata.bytes(),
            Self::Lines(lines) => lines.bytes(),
            Self::Report(report) => report.bytes(),
            Self::State(state) => state.bytes(),
        }
    }
}

impl From<Field> for Value {
    fn from(field: Field) -> Self {
        Self::Field(field)
    }
}

impl From<Strata> for Value {
    fn from(strata: Strata) -> Self {
        Self::Strata(Arc::new(strata))
    }
}

impl From<Lines> for Value {
    fn from(lines: Lines) -> Self {
        Self::Lines(Arc::new(lines))
    }
}

impl From<Report> for Value {
    fn from(report: Report) -> Self {
        Self::Report(Arc::new(report))
    }
}

impl From<State> for Value {
    fn from(state: State) -> Self {
        Self::State(Arc::new(state))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_meanings_that_fit_are_accepted() {
        assert!(PortType::Height.accepts(PortType::Height));
        assert!(!PortType::Height.accepts(PortType::Scalar(Unit::Degrees)));
        assert!(!PortType::Height.accepts(PortType::Scalar(Unit::Metres)));
        assert!(PortType::Scalar(Unit::Metres).accepts(PortType::Height));
        assert!(PortType::Scalar(Unit::One).accepts(PortType::Mask));
        assert!(!PortType::Mask.accepts(PortType::Height));
        assert!(PortType::AnyScalar.accepts(PortType::Scalar(Unit::Years)));
        assert!(!PortType::AnyScalar.accepts(PortType::Colour));
        assert!(PortType::Flow.accepts(PortType::Flow) && !PortType::AnyScalar.accepts(PortType::Flow));
    }
}
