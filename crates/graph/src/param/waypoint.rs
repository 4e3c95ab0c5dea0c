//! Points of a path as data: positions with optional heights and widths.

use std::fmt;

use super::{Kind, ParamType, ParamValue, range_text};
use crate::unit::{Unit, plain};

/// A point of a path. What it leaves out follows from the points around it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Waypoint {
    /// Metres to the east and to the south of the world's north-west corner.
    pub at: [f64; 2],
    /// Elevation in metres.
    pub height: Option<f64>,
    /// Width across the path in metres.
    pub width: Option<f64>,
}

impl Waypoint {
    /// The allowed range of heights, in metres.
    pub const HEIGHTS: [f64; 2] = [-1e5, 1e5];
    /// The allowed range of widths, in metres.
    pub const WIDTHS: [f64; 2] = [0.0, 1e6];
    /// The largest number of points of a path.
    pub const MOST: usize = 100_000;

    /// A point without height and width.
    #[must_use]
    pub const fn new(at: [f64; 2]) -> Self {
        Self { at, height: None, width: None }
    }
}

impl fmt::Display for Waypoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.at.map(plain);
        if self.height.is_none() && self.width.is_none() {
            return write!(f, "({x}, {y})");
        }
        write!(f, "(at: ({x}, {y})")?;
        for (name, value) in [("height", self.height), ("width", self.width)] {
            if let Some(value) = value {
                write!(f, ", {name}: {}", plain(value))?;
            }
        }
        f.write_str(")")
    }
}

/// A parameter of a path whose points can have heights and widths: at least two, each different from the one before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Waypoints(pub Vec<Waypoint>);

impl Waypoints {
    /// A path through positions.
    #[must_use]
    pub fn through(places: &[[f64; 2]]) -> Self {
        Self(places.iter().map(|at| Waypoint::new(*at)).collect())
    }
}

impl ParamType for Waypoints {
    type Range = std::ops::RangeInclusive<f64>;

    fn kind(default: Self, hard: Self::Range) -> Kind {
        Kind::Waypoints { default: default.0, hard: [*hard.start(), *hard.end()] }
    }

    fn from_value(value: &ParamValue) -> Option<Self> {
        match value {
            ParamValue::Waypoints(points) => Some(Self(points.clone())),
            _ => None,
        }
    }
}

/// The problem with the positions of a path, if any.
pub(super) fn check_places(name: &str, places: &[[f64; 2]]) -> Result<(), String> {
    if places.len() < 2 {
        return Err(format!("`{name}` has {} places, at least 2 are needed", places.len()));
    }
    if let Some(pair) = places.windows(2).find(|pair| pair[0] == pair[1]) {
        let [x, y] = pair[0].map(plain);
        return Err(format!("`{name}` has the same place twice in a row: ({x}, {y})"));
    }
    Ok(())
}

/// The problem with the points of a path, if any, apart from the range of their positions.
pub(super) fn check(name: &str, points: &[Waypoint]) -> Result<(), String> {
    if points.len() > Waypoint::MOST {
        return Err(format!("`{name}` has {} places, at most {} are allowed", points.len(), Waypoint::MOST));
    }
    let places: Vec<[f64; 2]> = points.iter().map(|point| point.at).collect();
    check_places(name, &places)?;
    points.iter().enumerate().try_for_each(|(at, point)| {
        let number = |field: &str, value: Option<f64>, range: [f64; 2]| match value {
            Some(value) if !(value >= range[0] && value <= range[1]) => {
                let (unit, range) = (Unit::Metres.describe(), range_text(range, Unit::Metres));
                Err(format!("point {} of `{name}`: `{field}` is {}, but must be {unit}{range}", at + 1, plain(value)))
            }
            _ => Ok(()),
        };
        number("height", point.height, Waypoint::HEIGHTS)?;
        number("width", point.width, Waypoint::WIDTHS)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_named_by_their_point() {
        let at = |x: f64| Waypoint::new([x, 0.0]);
        assert_eq!(check("points", &[at(0.0), at(1.0), at(0.0)]), Ok(()));
        assert!(check("points", &[at(0.0)]).expect_err("too few").contains("at least 2"));
        assert!(check("points", &[at(0.0), at(0.0)]).expect_err("no way").contains("same place twice"));
        let wide = Waypoint { width: Some(-1.0), ..at(2.0) };
        let error = check("points", &[at(0.0), wide]).expect_err("too narrow");
        assert!(error.starts_with("point 2 of `points`: `width` is -1"), "{error}");
        let odd = Waypoint { height: Some(f64::NAN), ..at(2.0) };
        assert!(check("points", &[at(0.0), odd]).is_err());
        assert!(check("points", &vec![at(0.0); Waypoint::MOST + 1]).expect_err("too many").contains("at most"));
    }

    #[test]
    fn points_are_shown_as_they_are_written() {
        let full = Waypoint { at: [1.0, 2.5], height: Some(120.0), width: Some(8.0) };
        assert_eq!(full.to_string(), "(at: (1, 2.5), height: 120, width: 8)");
        assert_eq!(Waypoint { height: None, ..full }.to_string(), "(at: (1, 2.5), width: 8)");
        assert_eq!(Waypoint::new([1.0, 2.5]).to_string(), "(1, 2.5)");
    }
}
