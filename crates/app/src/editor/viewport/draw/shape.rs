//! A parameter of the selected node that can be drawn: a position, a path, or an outline.

use orograph_graph::{Kind, Node, ParamSpec, ParamValue, Waypoint};

use super::handles::Grip;
use crate::editor::Session;

/// A drawable parameter, and its value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Shape {
    pub(super) node: String,
    pub(super) param: &'static str,
    /// Range of each coordinate in metres.
    hard: [f64; 2],
    /// True if the last point is joined to the first.
    pub(super) closed: bool,
    /// False if it has the default value, which nobody has drawn.
    pub(super) is_set: bool,
    value: ParamValue,
}

/// The range of a drawable kind and whether it is closed. Returns None for other kinds.
const fn drawable(kind: &Kind) -> Option<([f64; 2], bool)> {
    match kind {
        Kind::Point { hard, place: true, .. } | Kind::Waypoints { hard, .. } => Some((*hard, false)),
        Kind::Path { hard, closed, .. } => Some((*hard, *closed)),
        _ => None,
    }
}

/// Returns true if a node has a path or an outline.
pub(super) fn has_line(node: &Node) -> bool {
    node.specs().iter().any(|spec| matches!(spec.kind, Kind::Path { .. } | Kind::Waypoints { .. }))
}

impl Shape {
    /// Those of the selected node.
    pub(super) fn of_selection(session: &Session) -> Vec<Self> {
        session.selected().map(|node| Self::of(session, node)).unwrap_or_default()
    }

    /// The drawable parameters of a node that have an effect with its settings.
    pub(super) fn of(session: &Session, node: &str) -> Vec<Self> {
        let graph = session.document().graph();
        let Ok(index) = graph.find(node) else { return Vec::new() };
        let (instance, is_wired) = (graph.instance(index), |input: &str| graph.is_wired(index, input));
        let shape = |spec: ParamSpec| {
            let (hard, closed) = drawable(&spec.kind)?;
            let value = instance.params.get(spec.name).filter(|_| spec.idle(&instance.params, is_wired).is_none())?;
            let is_set = *value != spec.kind.default_value();
            Some(Self { node: instance.name.clone(), param: spec.name, hard, closed, is_set, value: value.clone() })
        };
        instance.node.specs().into_iter().filter_map(shape).collect()
    }

    /// Returns true if a handle is one of its points, or the middle of one of its segments.
    pub(super) fn has(&self, grip: &Grip) -> bool {
        self.param == grip.param && grip.point < self.places().len() + usize::from(grip.is_middle)
    }

    pub(super) const fn is_point(&self) -> bool {
        matches!(self.value, ParamValue::Point(_))
    }

    /// The positions of its points.
    pub(super) fn places(&self) -> Vec<[f64; 2]> {
        match &self.value {
            ParamValue::Point(at) => vec![*at],
            ParamValue::Path(points) => points.clone(),
            ParamValue::Waypoints(points) => points.iter().map(|point| point.at).collect(),
            _ => Vec::new(),
        }
    }

    /// Its value.
    pub(super) const fn value(&self) -> &ParamValue {
        &self.value
    }

    fn within(&self, at: [f64; 2]) -> [f64; 2] {
        at.map(|metres| metres.clamp(self.hard[0], self.hard[1]))
    }

    /// The shape with a point at another position.
    pub(super) fn moved(&self, point: usize, to: [f64; 2]) -> Self {
        let to = self.within(to);
        let mut value = self.value.clone();
        match &mut value {
            ParamValue::Point(at) => *at = to,
            ParamValue::Path(points) => points[point] = to,
            ParamValue::Waypoints(points) => points[point].at = to,
            _ => {}
        }
        Self { value, ..self.clone() }
    }

    /// The shape with one more point, before the point with this index.
    pub(super) fn inserted(&self, before: usize, at: [f64; 2]) -> Self {
        let at = self.within(at);
        let mut value = self.value.clone();
        match &mut value {
            ParamValue::Path(points) => points.insert(before, at),
            ParamValue::Waypoints(points) => points.insert(before, Waypoint::new(at)),
            _ => {}
        }
        Self { value, ..self.clone() }
    }

    /// The shape without a point. Returns None when too few would be left.
    pub(super) fn removed(&self, point: usize) -> Option<Self> {
        let least = if self.closed { 3 } else { 2 };
        let mut value = self.value.clone();
        match &mut value {
            ParamValue::Path(points) if points.len() > least => _ = points.remove(point),
            ParamValue::Waypoints(points) if points.len() > least => _ = points.remove(point),
            _ => return None,
        }
        Some(Self { value, ..self.clone() })
    }

    /// The shape through new positions. Returns None when they are too few for it.
    pub(super) fn through(&self, places: &[[f64; 2]]) -> Option<Self> {
        let places: Vec<[f64; 2]> = places.iter().map(|at| self.within(*at)).collect();
        let value = match self.value {
            ParamValue::Point(_) => ParamValue::Point(*places.last()?),
            ParamValue::Path(_) if places.len() > 1 => ParamValue::Path(places),
            ParamValue::Waypoints(_) if places.len() > 1 => {
                ParamValue::Waypoints(places.into_iter().map(Waypoint::new).collect())
            }
            _ => return None,
        };
        Some(Self { value, ..self.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(value: ParamValue, closed: bool) -> Shape {
        let (node, hard) = ("road".to_owned(), [-1e7, 1e7]);
        Shape { node, param: "path", hard, closed, is_set: true, value }
    }

    #[test]
    fn points_are_moved_inserted_and_removed() {
        let line = shape(ParamValue::Path(vec![[0.0, 0.0], [10.0, 0.0]]), false);
        let longer = line.inserted(1, [5.0, 4.0]);
        assert_eq!(longer.places(), [[0.0, 0.0], [5.0, 4.0], [10.0, 0.0]]);
        assert_eq!(longer.moved(2, [2e7, 1.0]).places()[2], [1e7, 1.0], "in the range of the parameter");
        assert_eq!(longer.removed(1), Some(line.clone()));
        assert_eq!(line.removed(0), None);
        assert_eq!(shape(longer.value().clone(), true).removed(0), None, "an outline keeps three points");
    }

    #[test]
    fn moving_a_point_keeps_its_height_and_width() {
        let high = Waypoint { at: [1.0, 2.0], height: Some(120.0), width: Some(8.0) };
        let road = shape(ParamValue::Waypoints(vec![high, Waypoint::new([5.0, 5.0])]), false);
        let ParamValue::Waypoints(points) = road.moved(0, [3.0, 3.0]).value().clone() else { panic!("waypoints") };
        assert_eq!(points[0], Waypoint { at: [3.0, 3.0], ..high });
        assert_eq!(road.through(&[[0.0, 0.0]]), None);
        assert_eq!(road.through(&[[0.0, 0.0], [1.0, 1.0]]).map(|road| road.places().len()), Some(2));
        let centre = shape(ParamValue::Point([0.0, 0.0]), false);
        assert_eq!(centre.through(&[[7.0, 8.0]]).map(|centre| centre.places()), Some(vec![[7.0, 8.0]]));
    }
}
