//! Handles of sizes and directions: an arm from the centre of the selected node, such as the radius of a crater or the
//! azimuth of a gradient.
//!
//! An arm belongs to a position named `centre`. Its length is a parameter in metres named `radius`, `diameter`, `length`
//! or `size`; its direction is one named `azimuth`, clockwise from north. Without a centre, a direction applies to the
//! whole world and its arm starts in the middle of it; a size has no arm then, since a circle would look like a place.
//! No node type is named here.

use orograph_graph::{Edit, Instance, Kind, ParamSpec, ParamValue, Unit};

use super::Projection;
use crate::editor::{Session, viewport::scale};

/// The lengths, each with the share of it that an arm has: without and with an azimuth. A length with a direction lies
/// half on each side of the centre.
const LENGTHS: [(&str, [f64; 2]); 3] = [("radius", [1.0, 1.0]), ("diameter", [0.5, 0.5]), ("length", [1.0, 0.5])];
/// The names of directions.
const DIRECTIONS: [&str; 3] = ["azimuth", "strike", "wind_azimuth"];
/// The length on the screen of an arm that is a direction only, in points.
const DIRECTION: f64 = 70.0;
/// The direction of an arm without an azimuth: east.
const EAST: f64 = 90.0;
/// Steps of an azimuth in degrees; the second one with Ctrl.
const TURNS: [f64; 2] = [0.5, 15.0];
/// The same for keys; the second one with Shift.
const KEY_TURNS: [f64; 2] = [1.0, 15.0];

/// The length of an arm.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Length {
    param: &'static str,
    part: Part,
    /// The share of the value that the arm has.
    share: f64,
    value: f64,
    hard: [f64; 2],
}

/// What a length is of its parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// The only value.
    Whole,
    /// A component of a pair: the width or the length of a figure.
    Component(usize),
    /// Both components, which are equal: the diameter of a disc.
    Both,
}

/// An arm of the selected node.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Arm {
    node: String,
    pub(super) centre: [f64; 2],
    length: Option<Length>,
    /// The direction in degrees, clockwise from north.
    direction: f64,
    /// The parameter of the direction, if dragging sets it.
    turns: Option<&'static str>,
    /// The pair that the length belongs to.
    pair: [f64; 2],
}

impl Arm {
    /// Those of the selected node.
    pub(super) fn of_selection(session: &Session) -> Vec<Self> {
        session.selected().map(|node| Self::of(session, node)).unwrap_or_default()
    }

    /// The arms of a node that have an effect with its settings.
    pub(super) fn of(session: &Session, node: &str) -> Vec<Self> {
        let graph = session.document().graph();
        let middle = session.document().world().size.map(|metres| 0.5 * metres);
        let arms = |index| Self::of_node(graph.instance(index), |input| graph.is_wired(index, input), middle);
        graph.find(node).map(arms).unwrap_or_default()
    }

    /// The arms of a node in a world with this middle.
    fn of_node(instance: &Instance, is_wired: impl Fn(&str) -> bool, middle: [f64; 2]) -> Vec<Self> {
        let specs = instance.node.specs();
        let find = |name: &str| -> Option<(&ParamSpec, &ParamValue)> {
            let spec =
                specs.iter().find(|spec| spec.name == name && spec.idle(&instance.params, &is_wired).is_none())?;
            Some((spec, instance.params.get(name)?))
        };
        let centre = match find("centre") {
            Some((ParamSpec { kind: Kind::Point { place: true, .. }, .. }, ParamValue::Point(at))) => Some(*at),
            _ => None,
        };
        let mut directions = DIRECTIONS.into_iter().filter_map(|name| match find(name) {
            Some((ParamSpec { unit: Unit::Degrees, name, .. }, ParamValue::Float(degrees))) => Some((*name, *degrees)),
            _ => None,
        });
        let direction = directions.next();
        let (turns, azimuth) = (direction.map(|(name, _)| name), direction.map(|(_, degrees)| degrees));
        let arm = |length: Option<Length>, direction: f64, turns: Option<&'static str>, pair: [f64; 2]| Self {
            node: instance.name.clone(),
            centre: centre.unwrap_or(middle),
            length,
            direction,
            turns,
            pair,
        };
        let mut arms = Vec::new();
        let lengths = if centre.is_some() { &LENGTHS[..] } else { &[] };
        for &(name, share) in lengths {
            if let Some((spec, ParamValue::Float(value))) = find(name)
                && let Kind::Float { hard, .. } = spec.kind
                && spec.unit == Unit::Metres
            {
                let share = share[usize::from(azimuth.is_some())];
                let length = Length { param: spec.name, part: Part::Whole, share, value: *value, hard };
                arms.push(arm(Some(length), azimuth.unwrap_or(EAST), turns, [0.0; 2]));
            }
        }
        if centre.is_some()
            && let Some((spec, ParamValue::Point(size))) = find("size")
            && let Kind::Point { place: false, hard, .. } = spec.kind
            && spec.unit == Unit::Metres
        {
            let length = |part, value| Length { param: spec.name, part, share: 0.5, value, hard };
            if azimuth.is_none() && specs.iter().any(|spec| spec.name == "azimuth") {
                // A figure whose direction has no effect is a disc, as wide as the smaller component.
                arms.push(arm(Some(length(Part::Both, size[0].min(size[1]))), EAST, None, *size));
            } else {
                // The second component lies along the azimuth, the first one across it.
                for (axis, turn) in [(1, 0.0), (0, EAST)] {
                    let length = length(Part::Component(axis), size[axis]);
                    let direction = azimuth.unwrap_or_default() + turn;
                    arms.push(arm(Some(length), direction, turns.filter(|_| axis == 1), *size));
                }
            }
        }
        if arms.is_empty()
            && let Some(azimuth) = azimuth
        {
            arms.push(arm(None, azimuth, turns, [0.0; 2]));
        }
        arms
    }

    /// Its values with their names and units: the length, the direction, or both.
    pub(super) fn numbers(&self) -> Vec<(String, Unit, f64)> {
        let length = self.length.map(|length| {
            let name = match length.part {
                Part::Component(axis) => ["width", "length"][axis],
                Part::Both => "diameter",
                Part::Whole => length.param,
            };
            (name.to_owned(), Unit::Metres, length.value)
        });
        let direction = self.turns.map(|param| (param.replace('_', " "), Unit::Degrees, self.direction));
        length.into_iter().chain(direction).collect()
    }

    /// The names of its values.
    pub(super) fn name(&self) -> String {
        self.numbers().into_iter().map(|(name, ..)| name).collect::<Vec<_>>().join(" and ")
    }

    /// Its values as text.
    pub(super) fn text(&self) -> String {
        let values = self.numbers().into_iter().map(|(_, unit, value)| unit.display(value));
        values.collect::<Vec<_>>().join(", ")
    }

    /// The arm with other values, in the order of its numbers.
    pub(super) fn with(&self, numbers: &[f64]) -> Self {
        let mut changed = self.clone();
        let mut numbers = numbers.iter();
        if self.length.is_some()
            && let Some(metres) = numbers.next()
        {
            changed.lengthen(*metres);
        }
        if self.turns.is_some()
            && let Some(degrees) = numbers.next()
        {
            changed.direction = *degrees;
        }
        changed
    }

    /// Sets the length to a value of its parameter.
    fn lengthen(&mut self, metres: f64) {
        let Some(length) = &mut self.length else { return };
        length.value = metres;
        match length.part {
            Part::Whole => {}
            Part::Component(axis) => self.pair[axis] = length.value,
            Part::Both => self.pair = [length.value; 2],
        }
    }

    /// The arm after an arrow key, by `step_m` metres, or by a degree; `far` is ten times as far, or 15°. Up lengthens an
    /// arm and right turns it clockwise; with only one of these, both keys do it.
    pub(super) fn nudged(&self, [right, up]: [f64; 2], step_m: f64, far: bool) -> Self {
        let mut nudged = self.clone();
        let (both, turns) = (right + up, self.turns.is_some());
        if let Some(length) = self.length {
            let by_m = if turns { up } else { both } * step_m * if far { 10.0 } else { 1.0 };
            nudged.lengthen((length.value + by_m).clamp(length.hard[0], length.hard[1]));
        }
        if turns {
            let by = if self.length.is_some() { right } else { both };
            nudged.direction = (self.direction + by * KEY_TURNS[usize::from(far)]).rem_euclid(360.0);
        }
        nudged
    }

    /// Returns true if it is the radius of a circle.
    pub(super) fn is_circle(&self) -> bool {
        self.turns.is_none() && self.length.is_some_and(|length| !matches!(length.part, Part::Component(_)))
    }

    /// Its length in metres.
    fn metres(&self, projection: &Projection<'_>) -> f64 {
        self.length.map_or(DIRECTION * projection.metres, |length| length.share * length.value)
    }

    /// The position of its end.
    pub(super) fn end(&self, projection: &Projection<'_>) -> [f64; 2] {
        self.at(self.metres(projection), self.direction)
    }

    /// The circle around the centre through its end.
    pub(super) fn circle(&self, projection: &Projection<'_>) -> Vec<[f64; 2]> {
        let metres = self.metres(projection);
        (0..48).map(|step| self.at(metres, f64::from(step) * 7.5)).collect()
    }

    /// The position at a distance in a direction.
    fn at(&self, metres: f64, degrees: f64) -> [f64; 2] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        [self.centre[0] + metres * sin, self.centre[1] - metres * cos]
    }

    /// The arm with its end at a position. With Ctrl, the length snaps to round numbers and the azimuth to 15°.
    pub(super) fn moved(&self, to: [f64; 2], snaps: bool, projection: &Projection<'_>) -> Self {
        let [east, south] = [0, 1].map(|axis| to[axis] - self.centre[axis]);
        let mut moved = self.clone();
        let mut metres = (east * east + south * south).sqrt();
        if self.turns.is_some() && metres > 0.0 {
            let step = TURNS[usize::from(snaps)];
            moved.direction = ((east.atan2(-south).to_degrees() / step).round() * step).rem_euclid(360.0);
        } else if self.length.is_some_and(|length| matches!(length.part, Part::Component(_))) {
            let (sin, cos) = self.direction.to_radians().sin_cos();
            metres = (east * sin - south * cos).abs();
        }
        if let Some(length) = self.length {
            let value = metres / length.share;
            let value = if snaps {
                let grid_m = scale::round_below(24.0 * projection.metres);
                (value / grid_m).round() * grid_m
            } else {
                projection.rounded([value, 0.0])[0]
            };
            moved.lengthen(value.clamp(length.hard[0], length.hard[1]));
        }
        moved
    }

    /// The edit that writes it.
    pub(super) fn edit(&self) -> Edit {
        let set = |param: &str, value| Edit::SetParam { node: self.node.clone(), param: param.to_owned(), value };
        let length = self.length.map(|length| {
            let is_value = length.part == Part::Whole;
            set(length.param, if is_value { ParamValue::Float(length.value) } else { ParamValue::Point(self.pair) })
        });
        let direction = self.turns.map(|param| set(param, ParamValue::Float(self.direction)));
        Edit::All(length.into_iter().chain(direction).collect())
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::Document;

    use super::*;

    /// The arms of a node, of which there are `N`.
    fn arms<const N: usize>(text: &str) -> [Arm; N] {
        let document = Document::parse(format!("(nodes: {{ \"a\": {text} }})"), &orograph_nodes::registry());
        let graph = document.graph();
        let found = Arm::of_node(graph.instance(graph.find("a").expect("a node")), |_| false, [500.0, 300.0]);
        found.try_into().expect("so many arms")
    }

    fn projection() -> Projection<'static> {
        Projection { to_screen: &|_| None, to_world: &|_| None, metres: 1.0 }
    }

    #[test]
    fn an_arm_ends_where_its_values_say() {
        let view = projection();
        let [crater] = arms("Crater(version: 2, pattern: one, centre: (100, 200), diameter: 80)");
        assert!(crater.is_circle());
        let [x, y] = crater.end(&view);
        assert!((x - 140.0).abs() < 1e-9 && (y - 200.0).abs() < 1e-9);
        let wider = crater.moved([100.0, 260.0], false, &view);
        assert_eq!((wider.name().as_str(), wider.text().as_str()), ("diameter", "120 m"));
        let [linear] = arms("Gradient(centre: (100, 200), azimuth: 90, length: 60)");
        assert_eq!(linear.end(&view).map(f64::round), [130.0, 200.0]);
        let turned = linear.moved([100.0, 150.0], false, &view);
        assert_eq!(turned.text(), "100 m, 0°");
        assert_eq!(turned.end(&view).map(f64::round), [100.0, 150.0]);
        // In south and west, and snapped.
        assert_eq!(linear.moved([60.0, 238.0], true, &view).text(), "120 m, 225°");
    }

    #[test]
    fn a_figure_has_two_arms_and_a_direction_one() {
        let view = projection();
        let [along, across] = arms("Shape(figure: ellipse, centre: (0, 0), size: (40, 100), azimuth: 90)");
        assert_eq!((along.end(&view).map(f64::round), across.end(&view).map(f64::round)), ([50.0, 0.0], [0.0, 20.0]));
        let wider = across.moved([300.0, 35.0], false, &view);
        assert_eq!((wider.text().as_str(), wider.pair), ("70 m", [70.0, 100.0]));
        let [disc] = arms("Shape(figure: disc, centre: (0, 0), size: (40, 100))");
        assert_eq!((disc.name().as_str(), disc.text().as_str(), disc.is_circle()), ("diameter", "40 m", true));
        assert_eq!(disc.moved([30.0, 40.0], false, &view).pair, [100.0, 100.0]);
        let [turn] = arms("Gradient(form: angular, centre: (0, 0), azimuth: 0)");
        assert_eq!((turn.name().as_str(), turn.end(&view)), ("azimuth", [0.0, -70.0]));
        let [wind] = arms("Dunes(azimuth: 90)");
        assert_eq!((wind.name().as_str(), wind.end(&view).map(f64::round)), ("azimuth", [570.0, 300.0]));
        assert_eq!(wind.moved([500.0, 900.0], false, &view).text(), "180°");
        let [snow] = arms("Snow(height: \"b\")");
        assert_eq!(snow.name(), "wind azimuth");
        let [] = arms("Ridged()");
        let [] = arms("Blur(input: \"b\")");
        let [] = arms("Island(form: edges)");
    }

    #[test]
    fn keys_lengthen_and_turn() {
        let [linear] = arms("Gradient(centre: (100, 200), azimuth: 350, length: 60)");
        assert_eq!(linear.nudged([0.0, 1.0], 5.0, false).text(), "65 m, 350°");
        assert_eq!(linear.nudged([1.0, 0.0], 5.0, true).text(), "60 m, 5°");
        assert_eq!(linear.with(&[80.0, 45.0]).text(), "80 m, 45°");
        let [crater] = arms("Crater(version: 2, pattern: one, centre: (100, 200), diameter: 80)");
        assert_eq!(crater.nudged([-1.0, 0.0], 5.0, false).text(), "75 m");
        assert_eq!(crater.nudged([0.0, -1.0], 5.0, true).text(), "30 m");
        let [turn] = arms("Gradient(form: angular, centre: (0, 0), azimuth: 0)");
        assert_eq!(turn.nudged([0.0, -1.0], 5.0, false).text(), "359°");
    }
}
