//! Strokes of a brush, as data: in metres of the world, so that they mean the same at any number of cells.

use std::ops::RangeInclusive;

use super::{Kind, ParamType, ParamValue, range_text};
use crate::unit::{Unit, plain};

crate::choice! {
    /// What a stroke does.
    pub enum Tool {
        /// Lifts the land.
        Raise = "raise",
        /// Lowers the land.
        Lower = "lower",
        /// Evens out the land.
        Smooth = "smooth",
        /// Adds to the mask.
        Mask = "mask",
        /// Takes from the mask, or from painted rain.
        Erase = "erase",
        /// Lets more rain fall.
        Rain = "rain",
    }
}

impl Tool {
    /// The tools for land that stands still.
    const STILL: &[Self] = &[Self::Raise, Self::Lower, Self::Smooth, Self::Mask, Self::Erase];
    /// The tools for what goes on in time.
    const TIMED: &[Self] = &[Self::Raise, Self::Lower, Self::Rain, Self::Erase];

    /// The tools of strokes that act at a time, or of those that do not.
    #[must_use]
    pub const fn all(timed: bool) -> &'static [Self] {
        if timed { Self::TIMED } else { Self::STILL }
    }

    /// The tool of that name among those.
    #[must_use]
    pub fn named(name: &str, timed: bool) -> Option<Self> {
        Self::all(timed).iter().copied().find(|tool| tool.name() == name)
    }

    /// The strength of a stroke that says none, which is also the most for those that take a part.
    #[must_use]
    pub const fn usual_strength(self) -> f64 {
        match self {
            Self::Raise | Self::Lower => 10.0,
            Self::Smooth | Self::Mask | Self::Erase => 1.0,
            Self::Rain => 200.0,
        }
    }

    /// What a file may say of the strength.
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

/// One movement of the brush, from where it was put down to where it was lifted.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// What it does.
    pub tool: Tool,
    /// Half the width of the brush, in metres.
    pub radius: f64,
    /// How much it does along its middle, in the [unit](Tool::unit) of its tool.
    pub strength: f64,
    /// The part of the radius within which it does all of that, 0 to 1.
    pub hardness: f64,
    /// When it acts, in seconds from the start of what goes on in time; 0 elsewhere.
    pub time: f64,
    /// Where it went, in metres of the world; at least one place.
    pub points: Vec<[f64; 2]>,
}

impl Stroke {
    /// The hardness of a stroke that says none.
    pub const USUAL_HARDNESS: f64 = 0.5;
    /// What a file may say of the radius, in metres.
    pub const RADII: [f64; 2] = [0.01, 1e6];
    /// What a file may say of the time, in seconds.
    pub const TIMES: [f64; 2] = [0.0, 1e10];
}

/// A parameter of strokes; what they do to land is the node's to say.
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

/// A parameter of strokes that act at a time each, on something that goes on; what they do to it is the node's to say.
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

/// What is wrong with strokes: the number of the first one that is, counted from 1, and why.
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
        Err(format!("`{name}` is {}, allowed is {}{}", plain(value), unit.describe(), range_text(range, unit)))
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
