//! The Rust types of parameters in a kernel.

use std::ops::{RangeFull, RangeInclusive};

use super::{Kind, ParamValue};
use crate::colour::Stop;

/// A Rust type that a parameter can have.
pub trait ParamType: Sized {
    /// The type of its hard range in [`params!`](crate::params): a range, or `..` when there is none.
    type Range;

    /// The declaration of a parameter of this type.
    fn kind(default: Self, hard: Self::Range) -> Kind;

    /// The value as this type. Returns None when it is of another kind.
    fn from_value(value: &ParamValue) -> Option<Self>;
}

impl ParamType for f64 {
    type Range = RangeInclusive<Self>;

    fn kind(default: Self, hard: Self::Range) -> Kind {
        let hard = [*hard.start(), *hard.end()];
        Kind::Float { default, hard, soft: hard }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Float(v) => Some(*v),
            _ => None,
        }
    }
}

impl ParamType for i64 {
    type Range = RangeInclusive<Self>;

    fn kind(default: Self, hard: Self::Range) -> Kind {
        let hard = [*hard.start(), *hard.end()];
        Kind::Int { default, hard, soft: hard }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Int(v) => Some(*v),
            _ => None,
        }
    }
}

impl ParamType for bool {
    type Range = RangeFull;

    fn kind(default: Self, _: RangeFull) -> Kind {
        Kind::Bool { default }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Bool(v) => Some(*v),
            _ => None,
        }
    }
}

/// A seed parameter, combined with the world's seed; see [`crate::Job::seed`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seed(pub u32);

impl ParamType for Seed {
    type Range = RangeFull;

    fn kind(default: Self, _: RangeFull) -> Kind {
        Kind::Seed { default: default.0 }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Seed(v) => Some(Self(*v)),
            _ => None,
        }
    }
}

impl ParamType for [f64; 2] {
    type Range = RangeInclusive<f64>;

    fn kind(default: Self, hard: Self::Range) -> Kind {
        Kind::Point { default, hard: [*hard.start(), *hard.end()], place: false }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Point(v) => Some(*v),
            _ => None,
        }
    }
}

/// A parameter that is a position in the world: metres to the east and to the south of its north-west corner.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Position(pub [f64; 2]);

impl std::ops::Deref for Position {
    type Target = [f64; 2];

    fn deref(&self) -> &[f64; 2] {
        &self.0
    }
}

impl ParamType for Position {
    type Range = RangeInclusive<f64>;

    fn kind(default: Self, hard: Self::Range) -> Kind {
        Kind::Point { default: default.0, hard: [*hard.start(), *hard.end()], place: true }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        <[f64; 2]>::from_value(value).map(Self)
    }
}

/// A curve parameter: points with increasing x; the node defines the interpolation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurvePoints(pub Vec<[f64; 2]>);

impl ParamType for CurvePoints {
    type Range = RangeFull;

    fn kind(default: Self, _: RangeFull) -> Kind {
        Kind::Curve { default: default.0, steps: false }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Curve(points) => Some(Self(points.clone())),
            _ => None,
        }
    }
}

/// A curve parameter whose y is constant from each point to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepPoints(pub Vec<[f64; 2]>);

impl ParamType for StepPoints {
    type Range = RangeFull;

    fn kind(default: Self, _: RangeFull) -> Kind {
        Kind::Curve { default: default.0, steps: true }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        CurvePoints::from_value(value).map(|CurvePoints(points)| Self(points))
    }
}

/// A path parameter: at least two points in the world, each different from the one before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathPoints(pub Vec<[f64; 2]>);

impl ParamType for PathPoints {
    type Range = RangeInclusive<f64>;

    fn kind(default: Self, hard: Self::Range) -> Kind {
        Kind::Path { default: default.0, hard: [*hard.start(), *hard.end()], closed: false }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Path(points) => Some(Self(points.clone())),
            _ => None,
        }
    }
}

/// A path parameter that is an outline: its last point is joined to the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OutlinePoints(pub Vec<[f64; 2]>);

impl ParamType for OutlinePoints {
    type Range = RangeInclusive<f64>;

    fn kind(default: Self, hard: Self::Range) -> Kind {
        Kind::Path { default: default.0, hard: [*hard.start(), *hard.end()], closed: true }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        PathPoints::from_value(value).map(|PathPoints(points)| Self(points))
    }
}

/// A parameter of colour stops; the node defines the interpolation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColourStops(pub Vec<Stop>);

impl ParamType for ColourStops {
    type Range = RangeFull;

    fn kind(default: Self, _: RangeFull) -> Kind {
        Kind::Stops { default: default.0 }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Stops(stops) => Some(Self(stops.clone())),
            _ => None,
        }
    }
}

/// A file parameter: a name relative to the graph's folder; resolve it with [`crate::Job::file`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FileName(pub String);

impl ParamType for FileName {
    type Range = RangeFull;

    fn kind(_: Self, _: RangeFull) -> Kind {
        Kind::File
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::File(name) => Some(Self(name.clone())),
            _ => None,
        }
    }
}
