//! Brush strokes as data, in metres of the world, so that they mean the same at any number of cells.

use std::ops::RangeInclusive;

use super::{Kind, ParamType, ParamValue, range_text};
use crate::unit::{Unit, plain};

crate::choice! {
    /// The effect of a stroke.
    pub enum Tool {
        /// Raises the terrain.
        Raise = "raise",
        /// Lowers the terrain.
        Lower = "lower",
        /// Smooths the terrain.
        Smooth = "smooth",
        /// Adds to the mask.
        Mask = "mask",
        /// Removes from the mask, or from painted rain.
        Erase = "erase",
        /// Adds rain.
        Rain = "rain",
    }
}

impl Tool {
    /// The tools for static terrain.
    const STILL: &[Self] = &[Self::Raise, Self::Lower, Self::Smooth, Self::Mask, Self::Erase];
    /// The tools for a process in time.
    const TIMED: &[Self] = &[Self::Raise, Self::Lower, Self::Rain, Self::Erase];

    /// The tools of timed strokes, or of strokes without a time.
    #[must_use]
    pub const fn all(timed: bool) -> &'static [Self] {
        if timed { Self::TIMED } else { Self::STILL }
    }

    /// The tool of that name among those.
    #[must_use]
    pub fn named(name: &str, timed: bool) -> Option<Self> {
        Self::all(timed).iter().copied().find(|tool| tool.name() == name)
    }

    /// The default strength of a stroke, which is also the maximum for tools whose strength is a fraction.
    #[must_use]
    pub const fn usual_strength(self) -> f64 {
        match self {
            Self::Raise | Self::Lower => 10.0,
            Self::Smooth | Self::Mask | Self::Erase => 1.0,
            Self::Rain => 200.0,
        }
    }

    /// The allowed range of the strength.
    #[must_use]
    pub const fn strengths(self) -> [f64; 2] {
        match self {
            Self::Raise | Self::Lower => [0.0, 10_000.0],
            Self::Smooth | Self::Mask | Self::Erase => [0.0, 1.0],
            Self::Rain => [0.0, 1e5],
        }
    }

    /// The unit of the strength.
    #[must_use]
    pub const fn unit(self) -> Unit {
        match self {
            Self::Raise | Self::Lower => Unit::Metres,
            Self::Smooth | Self::Mask | Self::Erase => Unit::One,
            Self::Rain => Unit::MillimetresPerHour,
        }
    }
}

/// One movement of the brush, from pressing to releasing it.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// Its effect.
    pub tool: Tool,
    /// Radius of the brush, in metres.
    pub radius: f64,
    /// Strength along its centre line, in the [unit](Tool::unit) of its tool.
    pub strength: f64,
    /// The fraction of the radius with full strength, 0 to 1.
    pub hardness: f64,
    /// When it acts, in seconds from the start of the process; 0 for strokes without a time.
    pub time: f64,
    /// Its path, in metres of the world; at least one point.
    pub points: Vec<[f64; 2]>,
}

impl Stroke {
    /// The default hardness of a stroke.
    pub const USUAL_HARDNESS: f64 = 0.5;
    /// The allowed range of the radius, in metres.
    pub const RADII: [f64; 2] = [0.01, 1e6];
    /// The allowed range of the time, in seconds.
    pub const TIMES: [f64; 2] = [0.0, 1e10];
}

/// A parameter of strokes; the node defines what they do to the terrain.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Strokes(pub Vec<Stroke>);

impl ParamType for Strokes {
    type Range = RangeInclusive<f64>;

    fn kind(_: Self, hard: Self::Range) -> Kind {
        Kind::Strokes { hard: [*hard.start(), *hard.end()], timed: false }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Strokes(strokes) => Some(Self(strokes.clone())),
            _ => None,
        }
    }
}

/// A parameter of strokes that each act at a time, on a running process; the node defines what they do to it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TimedStrokes(pub Vec<Stroke>);

impl ParamType for TimedStrokes {
    type Range = RangeInclusive<f64>;

    fn kind(_: Self, hard: Self::Range) -> Kind {
        Kind::Strokes { hard: [*hard.start(), *hard.end()], timed: true }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        Strokes::from_value(value).map(|Strokes(strokes)| Self(strokes))
    }
}

/// The problem with a list of strokes, if any: the number of the first invalid one, counted from 1, and the reason.
pub(super) fn check(strokes: &[Stroke], hard: [f64; 2], timed: bool) -> Result<(), (usize, String)> {
    let check = |(at, stroke)| check_one(stroke, hard, timed).map_err(|wrong| (at + 1, wrong));
    strokes.iter().enumerate().try_for_each(check)
}

fn check_one(stroke: &Stroke, hard: [f64; 2], timed: bool) -> Result<(), String> {
    if !Tool::all(timed).contains(&stroke.tool) {
        return Err(format!("it has the tool `{}`, which does nothing here", stroke.tool.name()));
    }
    let number = |name: &str, value: f64, range: [f64; 2], unit: Unit| {
        if value >= range[0] && value <= range[1] {
            return Ok(());
        }
        Err(format!("`{name}` is {}, but must be {}{}", plain(value), unit.describe(), range_text(range, unit)))
    };
    number("radius", stroke.radius, Stroke::RADII, Unit::Metres)?;
    number("strength", stroke.strength, stroke.tool.strengths(), stroke.tool.unit())?;
    number("hardness", stroke.hardness, [0.0, 1.0], Unit::One)?;
    number("time", stroke.time, if timed { Stroke::TIMES } else { [0.0; 2] }, Unit::Seconds)?;
    if stroke.points.is_empty() {
        return Err("it has no points, at least one is needed".to_owned());
    }
    stroke.points.as_flattened().iter().try_for_each(|v| number("points", *v, hard, Unit::Metres))
}
