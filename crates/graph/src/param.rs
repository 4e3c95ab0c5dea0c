//! Parameters: their declaration as data, their values, and the macros that declare them once.

mod layer;
#[macro_use]
mod macros;
mod stroke;
mod types;
mod waypoint;

use std::fmt;

pub use layer::{Layer, LayerTable};
pub use stroke::{Stroke, Strokes, TimedStrokes, Tool};
pub use types::{ColourStops, CurvePoints, FileName, OutlinePoints, ParamType, PathPoints, Position, Seed, StepPoints};
pub use waypoint::{Waypoint, Waypoints};

use crate::{
    colour::Stop,
    unit::{Unit, plain},
};

/// One parameter of a node as data: the loader checks it, the inspector shows it and the manual prints it.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamSpec {
    /// Name in a file, in snake case.
    pub name: &'static str,
    /// Documentation; the first line is a sentence.
    pub doc: &'static str,
    /// Unit of its numbers.
    pub unit: Unit,
    /// Kind, default and range.
    pub kind: Kind,
    /// What it depends on: it has an effect only if all of these hold. Most parameters have none.
    pub when: &'static [When],
}

impl ParamSpec {
    /// The condition that does not hold, so that the parameter has no effect, if any. `is_wired` tells whether an input
    /// of the node is wired.
    #[must_use]
    pub fn idle(&self, values: &ParamValues, is_wired: impl Fn(&str) -> bool) -> Option<&'static When> {
        self.when.iter().find(|when| !when.holds(values, &is_wired))
    }
}

/// A condition of a parameter on its node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// A choice or a switch has one of some values.
    Setting {
        /// The choice or switch.
        param: &'static str,
        /// The values, as written in a file.
        is: &'static [&'static str],
    },
    /// A number is not 0.
    NonZero(&'static str),
    /// A table or a list has no entries.
    Empty(&'static str),
    /// The input that the parameter belongs to is wired.
    Wired(&'static str),
    /// The input that would replace the parameter is not wired.
    Unwired(&'static str),
}

impl When {
    /// Returns true if it holds for a node with these values; `is_wired` tells whether an input is wired.
    #[must_use]
    pub fn holds(&self, values: &ParamValues, is_wired: impl Fn(&str) -> bool) -> bool {
        match self {
            Self::Setting { param, is } => {
                values.get(param).is_none_or(|value| is.contains(&value.to_string().as_str()))
            }
            Self::NonZero(param) => !matches!(values.get(param), Some(ParamValue::Float(0.0) | ParamValue::Int(0))),
            Self::Empty(param) => values.get(param).is_none_or(ParamValue::is_empty),
            Self::Wired(input) => is_wired(input),
            Self::Unwired(input) => !is_wired(input),
        }
    }
}

impl fmt::Display for When {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Setting { param, is } => {
                let names: Vec<String> = is.iter().map(|name| format!("`{name}`")).collect();
                write!(f, "`{param}` is {}", names.join(" or "))
            }
            Self::NonZero(param) => write!(f, "`{param}` is not 0"),
            Self::Empty(param) => write!(f, "`{param}` is empty"),
            Self::Wired(input) => write!(f, "`{input}` is wired"),
            Self::Unwired(input) => write!(f, "`{input}` is not wired"),
        }
    }
}

/// The kind of a parameter, with its default and its ranges.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// A real number.
    Float {
        /// Default value.
        default: f64,
        /// Range that a file may use.
        hard: [f64; 2],
        /// Range of the slider.
        soft: [f64; 2],
    },
    /// An integer.
    Int {
        /// Default value.
        default: i64,
        /// Range that a file may use.
        hard: [i64; 2],
        /// Range of the slider.
        soft: [i64; 2],
    },
    /// A boolean.
    Bool {
        /// Default value.
        default: bool,
    },
    /// One of a few names.
    Choice {
        /// Default value.
        default: &'static str,
        /// Names in a file with their documentation.
        options: &'static [(&'static str, &'static str)],
    },
    /// A seed, combined with the world's seed.
    Seed {
        /// Default value.
        default: u32,
    },
    /// A pair of numbers: a position in the world, a size, or the ends of a range.
    Point {
        /// Default value.
        default: [f64; 2],
        /// Range that a file may use, for each component.
        hard: [f64; 2],
        /// True for a position in the world.
        place: bool,
    },
    /// A curve through points with increasing x.
    Curve {
        /// Default value.
        default: Vec<[f64; 2]>,
        /// True if y is constant from each point to the next; otherwise a monotone cubic interpolates the points.
        steps: bool,
    },
    /// A path through points in the world, in order, with straight segments.
    Path {
        /// Default value.
        default: Vec<[f64; 2]>,
        /// Range that a file may use, for each component.
        hard: [f64; 2],
        /// True if it is an outline: the last point is joined to the first.
        closed: bool,
    },
    /// A path through points in the world that can have heights and widths.
    Waypoints {
        /// Default value.
        default: Vec<Waypoint>,
        /// Range that a file may use, for each component of a position.
        hard: [f64; 2],
    },
    /// A colour gradient: colours at increasing values.
    Stops {
        /// Default value.
        default: Vec<Stop>,
    },
    /// Layers of rock, from the top down.
    Layers {
        /// Default value.
        default: Vec<Layer>,
    },
    /// Brush strokes on the world, in the order they were painted. Empty by default.
    Strokes {
        /// Range of the points, for each component.
        hard: [f64; 2],
        /// True if each stroke acts at a given time.
        timed: bool,
    },
    /// A file, relative to the graph file.
    File,
}

/// The value of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum ParamValue {
    /// Of [`Kind::Float`].
    Float(f64),
    /// Of [`Kind::Int`].
    Int(i64),
    /// Of [`Kind::Bool`].
    Bool(bool),
    /// Of [`Kind::Choice`].
    Choice(&'static str),
    /// Of [`Kind::Seed`].
    Seed(u32),
    /// Of [`Kind::Point`].
    Point([f64; 2]),
    /// Of [`Kind::Curve`].
    Curve(Vec<[f64; 2]>),
    /// Of [`Kind::Path`].
    Path(Vec<[f64; 2]>),
    /// Of [`Kind::Waypoints`].
    Waypoints(Vec<Waypoint>),
    /// Of [`Kind::Stops`].
    Stops(Vec<Stop>),
    /// Of [`Kind::Layers`].
    Layers(Vec<Layer>),
    /// Of [`Kind::Strokes`].
    Strokes(Vec<Stroke>),
    /// Of [`Kind::File`]; empty when there is no file.
    File(String),
}

impl ParamValue {
    /// Returns true for a list, a table or a name without content.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Curve(points) | Self::Path(points) => points.is_empty(),
            Self::Waypoints(points) => points.is_empty(),
            Self::Stops(stops) => stops.is_empty(),
            Self::Layers(layers) => layers.is_empty(),
            Self::Strokes(strokes) => strokes.is_empty(),
            Self::File(name) => name.is_empty(),
            Self::Float(_) | Self::Int(_) | Self::Bool(_) | Self::Choice(_) | Self::Seed(_) | Self::Point(_) => false,
        }
    }
}

impl Kind {
    /// The same kind with another default, or unchanged if the value is of another kind. Files and strokes have no
    /// default.
    #[must_use]
    pub fn with_default(mut self, value: &ParamValue) -> Self {
        match (&mut self, value) {
            (Self::Float { default, .. }, ParamValue::Float(v)) => *default = *v,
            (Self::Int { default, .. }, ParamValue::Int(v)) => *default = *v,
            (Self::Bool { default }, ParamValue::Bool(v)) => *default = *v,
            (Self::Choice { default, .. }, ParamValue::Choice(v)) => *default = v,
            (Self::Seed { default }, ParamValue::Seed(v)) => *default = *v,
            (Self::Point { default, .. }, ParamValue::Point(v)) => *default = *v,
            (Self::Curve { default, .. }, ParamValue::Curve(v)) | (Self::Path { default, .. }, ParamValue::Path(v)) => {
                default.clone_from(v);
            }
            (Self::Waypoints { default, .. }, ParamValue::Waypoints(v)) => default.clone_from(v),
            (Self::Stops { default }, ParamValue::Stops(v)) => default.clone_from(v),
            (Self::Layers { default }, ParamValue::Layers(v)) => default.clone_from(v),
            _ => {}
        }
        self
    }

    /// The default as a value.
    #[must_use]
    pub fn default_value(&self) -> ParamValue {
        match self {
            Self::Float { default, .. } => ParamValue::Float(*default),
            Self::Int { default, .. } => ParamValue::Int(*default),
            Self::Bool { default } => ParamValue::Bool(*default),
            Self::Choice { default, .. } => ParamValue::Choice(default),
            Self::Seed { default } => ParamValue::Seed(*default),
            Self::Point { default, .. } => ParamValue::Point(*default),
            Self::Curve { default, .. } => ParamValue::Curve(default.clone()),
            Self::Path { default, .. } => ParamValue::Path(default.clone()),
            Self::Waypoints { default, .. } => ParamValue::Waypoints(default.clone()),
            Self::Stops { default } => ParamValue::Stops(default.clone()),
            Self::Layers { default } => ParamValue::Layers(default.clone()),
            Self::Strokes { .. } => ParamValue::Strokes(Vec::new()),
            Self::File => ParamValue::File(String::new()),
        }
    }

    /// The allowed values as text: "a number from 1 m to 1000 km".
    #[must_use]
    pub fn describe(&self, unit: Unit) -> String {
        match self {
            Self::Float { hard, .. } => format!("{}{}", unit.describe(), range_text(*hard, unit)),
            Self::Int { hard, .. } => format!("a whole number from {} to {}", hard[0], hard[1]),
            Self::Bool { .. } => "`true` or `false`".to_owned(),
            Self::Choice { options, .. } => {
                let names: Vec<String> = options.iter().map(|(name, _)| format!("`{name}`")).collect();
                format!("one of {}", names.join(", "))
            }
            Self::Seed { .. } => "a whole number from 0 to 4294967295".to_owned(),
            Self::Point { hard, .. } => format!("a pair `(x, y)`, each {}{}", unit.describe(), range_text(*hard, unit)),
            Self::Curve { .. } => "a list of points `[(x, y), ...]` with x rising".to_owned(),
            Self::Path { hard, .. } => {
                format!("a list of places `[(x, y), ...]`, each {}{}", unit.describe(), range_text(*hard, unit))
            }
            Self::Waypoints { hard, .. } => {
                let range = range_text(*hard, unit);
                format!(
                    "a list of places `[(x, y), (at: (x, y), height: 120, width: 8), ...]`, each x and y {}{range}",
                    unit.describe()
                )
            }
            Self::Stops { .. } => {
                "a list of values and their colours `[(0, \"#7a9e77\"), ...]`, the values rising".to_owned()
            }
            Self::Layers { .. } => {
                "a list of layers from the top down `[(thickness: 120, hardness: 4, repose: 60, colour: \
                                    \"#b08050\"), ...]`"
                    .to_owned()
            }
            Self::Strokes { timed, .. } => {
                let time = if *timed { "time: 600, " } else { "" };
                format!(
                    "a list of strokes `[(tool: raise, radius: 200, strength: 30, {time}points: [(x, y), ...]), ...]`"
                )
            }
            Self::File => "a file name in quotes, relative to the graph file".to_owned(),
        }
    }
}

/// ` from A to B`; an infinite end is left out.
#[must_use]
pub fn range_text(range: [f64; 2], unit: Unit) -> String {
    let [lo, hi] = range;
    match (lo.is_finite(), hi.is_finite()) {
        (true, true) => format!(" from {} to {}", unit.display(lo), unit.display(hi)),
        (true, false) => format!(" from {} up", unit.display(lo)),
        (false, true) => format!(" up to {}", unit.display(hi)),
        (false, false) => String::new(),
    }
}

impl fmt::Display for ParamValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Float(v) => f.write_str(&plain(*v)),
            Self::Int(v) => write!(f, "{v}"),
            Self::Bool(v) => write!(f, "{v}"),
            Self::Choice(v) => f.write_str(v),
            Self::Seed(v) => write!(f, "{v}"),
            Self::Point([x, y]) => write!(f, "({}, {})", plain(*x), plain(*y)),
            Self::Curve(points) | Self::Path(points) => {
                let points: Vec<String> =
                    points.iter().map(|[x, y]| format!("({}, {})", plain(*x), plain(*y))).collect();
                write!(f, "[{}]", points.join(", "))
            }
            Self::Waypoints(points) => {
                write!(f, "[{}]", points.iter().map(Waypoint::to_string).collect::<Vec<_>>().join(", "))
            }
            Self::Stops(stops) => {
                write!(f, "[{}]", stops.iter().map(Stop::to_string).collect::<Vec<_>>().join(", "))
            }
            Self::Layers(layers) => {
                write!(f, "[{}]", layers.iter().map(Layer::to_string).collect::<Vec<_>>().join(", "))
            }
            Self::Strokes(strokes) => {
                let points: usize = strokes.iter().map(|stroke| stroke.points.len()).sum();
                write!(f, "{} strokes of {points} points", strokes.len())
            }
            Self::File(name) => write!(f, "{name:?}"),
        }
    }
}

/// The checked values of all parameters of a node; those that a file leaves out have their defaults.
///
/// Sorted by name: a node has about a dozen, and each edit of a document makes those of all its nodes again.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParamValues(Vec<(&'static str, ParamValue)>);

impl ParamValues {
    /// The defaults of a declaration.
    #[must_use]
    pub fn defaults(specs: &[ParamSpec]) -> Self {
        let mut values: Vec<_> = specs.iter().map(|spec| (spec.name, spec.kind.default_value())).collect();
        values.sort_unstable_by_key(|(name, _)| *name);
        Self(values)
    }

    /// Replaces a value. It must have been checked with [`check_value`].
    pub fn set(&mut self, name: &'static str, value: ParamValue) {
        match self.place(name) {
            Ok(at) => self.0[at].1 = value,
            Err(at) => self.0.insert(at, (name, value)),
        }
    }

    /// The value of a parameter.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&ParamValue> {
        self.place(name).ok().map(|at| &self.0[at].1)
    }

    /// Where a name is, or where it would be.
    fn place(&self, name: &str) -> Result<usize, usize> {
        self.0.binary_search_by_key(&name, |(name, _)| *name)
    }

    /// Names and values, sorted by name.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &ParamValue)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }

    /// Reads a parameter as its declared type.
    ///
    /// # Panics
    /// When the parameter is not declared with that type: a mistake in the node's source, which the registry's
    /// self-check and every test of the node detect.
    #[must_use]
    pub fn read<T: ParamType>(&self, name: &str) -> T {
        self.get(name)
            .and_then(T::from_value)
            .unwrap_or_else(|| panic!("parameter `{name}` is not declared with the type it is read as"))
    }
}

/// Checks a value against its declaration: kind, hard range, finite numbers, increasing curve, path without repeated
/// points.
///
/// # Errors
/// A message with the problem and the allowed values.
pub fn check_value(spec: &ParamSpec, value: &ParamValue) -> Result<(), String> {
    let allowed = || format!("but must be {}", spec.kind.describe(spec.unit));
    let number = |v: f64, [lo, hi]: [f64; 2]| {
        if v.is_finite() && v >= lo && v <= hi {
            Ok(())
        } else {
            Err(format!("`{}` is {}, {}", spec.name, spec.unit.display(v), allowed()))
        }
    };
    match (&spec.kind, value) {
        (Kind::Float { hard, .. }, ParamValue::Float(v)) => number(*v, *hard),
        (Kind::Int { hard, .. }, ParamValue::Int(v)) if (hard[0]..=hard[1]).contains(v) => Ok(()),
        (Kind::Int { .. }, ParamValue::Int(v)) => Err(format!("`{}` is {v}, {}", spec.name, allowed())),
        (Kind::Point { hard, .. }, ParamValue::Point(p)) => p.iter().try_for_each(|v| number(*v, *hard)),
        (Kind::Choice { options, .. }, ParamValue::Choice(name)) if options.iter().any(|(n, _)| n == name) => Ok(()),
        (Kind::Curve { .. }, ParamValue::Curve(points)) => {
            if points.len() < 2 {
                return Err(format!("`{}` has {} points, at least 2 are needed", spec.name, points.len()));
            }
            if points.iter().flatten().any(|v| !v.is_finite()) {
                return Err(format!("`{}` has a point that is not finite", spec.name));
            }
            match points.windows(2).find(|pair| pair[1][0] <= pair[0][0]) {
                Some(pair) => {
                    Err(format!("the points of `{}` must rise in x: {} follows {}", spec.name, pair[1][0], pair[0][0]))
                }
                None => Ok(()),
            }
        }
        (Kind::Path { hard, .. }, ParamValue::Path(points)) => {
            waypoint::check_places(spec.name, points)?;
            points.as_flattened().iter().try_for_each(|v| number(*v, *hard))
        }
        (Kind::Waypoints { hard, .. }, ParamValue::Waypoints(points)) => {
            waypoint::check(spec.name, points)?;
            points.iter().flat_map(|point| point.at).try_for_each(|v| number(v, *hard))
        }
        (Kind::Stops { .. }, ParamValue::Stops(stops)) => {
            if stops.is_empty() {
                return Err(format!("`{}` has no colours, at least one is needed", spec.name));
            }
            if stops.iter().any(|stop| !stop.at.is_finite()) {
                return Err(format!("`{}` has a value that is not finite", spec.name));
            }
            match stops.windows(2).find(|pair| pair[1].at <= pair[0].at) {
                Some(pair) => {
                    Err(format!("the values of `{}` must rise: {} follows {}", spec.name, pair[1].at, pair[0].at))
                }
                None => Ok(()),
            }
        }
        (Kind::Layers { .. }, ParamValue::Layers(layers)) => layer::check(spec.name, layers),
        (Kind::Strokes { hard, timed }, ParamValue::Strokes(strokes)) => stroke::check(strokes, *hard, *timed)
            .map_err(|(number, wrong)| format!("stroke {number} of `{}`: {wrong}", spec.name)),
        (Kind::Bool { .. }, ParamValue::Bool(_))
        | (Kind::Seed { .. }, ParamValue::Seed(_))
        | (Kind::File, ParamValue::File(_)) => Ok(()),
        _ => Err(format!("`{}` is `{value}`, {}", spec.name, allowed())),
    }
}

impl Kind {
    /// The same kind with a slider range narrower than the hard range; numbers only.
    #[must_use]
    pub fn with_soft(mut self, lo: f64, hi: f64) -> Self {
        match &mut self {
            Self::Float { soft, .. } => *soft = [lo, hi],
            Self::Int { soft, .. } => *soft = [lo as i64, hi as i64],
            _ => {}
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Srgb;

    choice! {
        /// A choice.
        pub enum Mode {
            /// One.
            First = "first",
            /// Two.
            Second = "second",
        }
    }

    params! {
        /// A length.
        length: f64 = 10.0, Metres, 1.0..=100.0, soft 5.0..=50.0;
        /// A count.
        count: i64 = 3, Count, 0..=9;
        /// A mode.
        mode: Mode = Mode::Second, One, ..;
        /// A seed.
        seed: Seed = Seed(0), Count, ..;
        /// A place.
        place: [f64; 2] = [1.0, 2.0], Metres, -1e6..=1e6;
        /// A curve.
        curve: CurvePoints = CurvePoints(vec![[0.0, 0.0], [1.0, 1.0]]), One, ..;
        /// A way.
        way: PathPoints = PathPoints(vec![[5.0, 0.0], [1.0, 1.0]]), Metres, -10.0..=10.0;
        /// Colours.
        tints: ColourStops = ColourStops(vec![Stop { at: 0.0, colour: Srgb::hex(0x7a_9e_77) }]), Metres, ..;
    }

    #[test]
    fn a_declaration_becomes_data_and_reads_back() {
        let specs = Params::specs();
        assert_eq!(
            specs.iter().map(|s| s.name).collect::<Vec<_>>(),
            ["length", "count", "mode", "seed", "place", "curve", "way", "tints"]
        );
        assert_eq!(specs[0].doc, "A length.");
        assert_eq!(specs[0].kind, Kind::Float { default: 10.0, hard: [1.0, 100.0], soft: [5.0, 50.0] });
        let mut values = ParamValues::defaults(&specs);
        values.set("mode", ParamValue::Choice("first"));
        let params = Params::read(&values);
        assert_eq!((params.mode, params.count, params.place), (Mode::First, 3, [1.0, 2.0]));
        assert_eq!(Mode::OPTIONS[1], ("second", "Two."));
    }

    #[test]
    fn values_out_of_range_are_named_with_what_is_allowed() {
        let specs = Params::specs();
        let error = check_value(&specs[0], &ParamValue::Float(5000.0)).expect_err("too long");
        assert!(error.contains("5 km") && error.contains("from 1 m to 100 m"), "{error}");
        assert!(check_value(&specs[0], &ParamValue::Float(f64::NAN)).is_err());
        assert!(check_value(&specs[0], &ParamValue::Int(3)).is_err());
        assert!(check_value(&specs[1], &ParamValue::Int(10)).is_err());
        assert!(check_value(&specs[5], &ParamValue::Curve(vec![[0.0, 0.0], [0.0, 1.0]])).is_err());
        let way = |points: &[[f64; 2]]| check_value(&specs[6], &ParamValue::Path(points.to_vec()));
        assert_eq!(way(&[[3.0, 0.0], [-3.0, 0.0], [3.0, 0.0]]), Ok(()));
        assert!(way(&[[3.0, 0.0]]).expect_err("a place").contains("at least 2"));
        assert!(way(&[[3.0, 0.0], [3.0, 0.0]]).expect_err("no way").contains("same place"));
        assert!(way(&[[3.0, 0.0], [3.0, 11.0]]).expect_err("too far").contains("from -10 m to 10 m"));
        let tints = |at: &[f64]| {
            let stops = at.iter().map(|at| Stop { at: *at, colour: Srgb::hex(0) }).collect();
            check_value(&specs[7], &ParamValue::Stops(stops))
        };
        assert_eq!(tints(&[-1.0, 0.5]), Ok(()));
        assert!(tints(&[]).expect_err("nothing").contains("at least one"));
        assert!(tints(&[1.0, 1.0]).expect_err("level").contains("must rise"));
        assert!(tints(&[f64::INFINITY]).expect_err("endless").contains("not finite"));
        assert!(specs.iter().all(|spec| check_value(spec, &spec.kind.default_value()).is_ok()));
    }
}
