//! The view of the graph: the visible part and its zoom.

use egui::{Color32, Pos2, Rect, Stroke, Vec2, epaint::CubicBezierShape, vec2};

use super::overview;

/// The smallest and the largest zoom.
const ZOOM: [f32; 2] = [0.08, 2.5];
/// The smallest zoom at which node names are readable.
const LEGIBLE: f32 = 0.45;
/// Margin around fitted content, in points of the window.
const MARGIN: f32 = 24.0;

/// Converts between graph coordinates and points of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lens {
    /// The pane, in points of the window.
    pub(super) rect: Rect,
    /// The graph position in the centre of the pane.
    pub(super) centre: Pos2,
    /// Points of the window per unit of the graph.
    pub(super) zoom: f32,
}

impl Lens {
    /// A view that shows all of `bounds` in a pane, at a zoom of at most 1.
    pub(super) fn fitted(rect: Rect, bounds: Rect) -> Self {
        if !bounds.is_positive() {
            return Self { rect, centre: Pos2::ZERO, zoom: 1.0 };
        }
        let room = (rect.size() - Vec2::splat(2.0 * MARGIN)).max(Vec2::splat(40.0));
        let zoom = (room.x / bounds.width()).min(room.y / bounds.height()).min(1.0);
        Self { rect, centre: bounds.center(), zoom: zoom.clamp(ZOOM[0], ZOOM[1]) }
    }

    /// The view of a newly opened graph: all of it if the names are readable then; otherwise as much as leaves them
    /// readable, around `focus`.
    pub(super) fn opening(rect: Rect, bounds: Rect, focus: Pos2) -> Self {
        let all = Self::fitted(rect, bounds);
        if all.zoom >= LEGIBLE {
            return all;
        }
        let half = rect.size() / LEGIBLE / 2.0;
        // The overview is beside the end of the graph, not over it.
        let mut least = bounds.expand(MARGIN / LEGIBLE).shrink2(half);
        least.max.x += (overview::SIZE.x + overview::MARGIN) / LEGIBLE;
        // Along an axis where everything fits, the graph is centred; otherwise the pane shows no empty space that
        // content could fill.
        let along = |axis: usize| match least.min[axis] > least.max[axis] {
            true => bounds.center()[axis],
            false => focus[axis].clamp(least.min[axis], least.max[axis]),
        };
        Self { rect, centre: Pos2::new(along(0), along(1)), zoom: LEGIBLE }
    }

    pub(super) fn to_screen(self, place: Pos2) -> Pos2 {
        self.rect.center() + (place - self.centre) * self.zoom
    }

    pub(super) fn to_graph(self, point: Pos2) -> Pos2 {
        self.centre + (point - self.rect.center()) / self.zoom
    }

    pub(super) fn rect_to_screen(self, rect: Rect) -> Rect {
        Rect::from_min_max(self.to_screen(rect.min), self.to_screen(rect.max))
    }

    /// The visible part of the graph.
    pub(super) fn seen(self) -> Rect {
        Rect::from_min_max(self.to_graph(self.rect.min), self.to_graph(self.rect.max))
    }

    /// The curves, in the window, of a wire along its route points, from its beginning to its end.
    ///
    /// At both ends the wire is horizontal; at a route point its direction is that from the previous point to the next.
    pub(super) fn way(self, places: &[Pos2]) -> Vec<[Pos2; 4]> {
        if let [from, to] = places {
            return vec![self.curve(*from, *to)];
        }
        let last = places.len().saturating_sub(1);
        let along = |at: usize| match at {
            0 => vec2(1.0, 0.0),
            at if at == last => vec2(1.0, 0.0),
            at => (places[at + 1] - places[at - 1]).normalized(),
        };
        let piece = |at: usize| {
            let [from, to] = [places[at], places[at + 1]];
            let reach = from.distance(to) * 0.35;
            [from, from + along(at) * reach, to - along(at + 1) * reach, to].map(|place| self.to_screen(place))
        };
        (0..last).map(piece).collect()
    }

    /// The four control points, in the window, of a wire between two positions of the graph.
    fn curve(self, from: Pos2, to: Pos2) -> [Pos2; 4] {
        let [from, to] = [self.to_screen(from), self.to_screen(to)];
        let (dx, dy) = (to.x - from.x, (to.y - from.y).abs());
        let [side, rise] = [160.0, 80.0].map(|most| most * self.zoom);
        let reach = if dx >= 0.0 { dx * 0.5 } else { (-dx).min(side) * 0.6 + dy.min(rise) };
        let handle = vec2(reach.max(18.0 * self.zoom), 0.0);
        [from, from + handle, to - handle, to]
    }

    /// The distance of a point of the window from a wire, in points of the window, and the nearest of its curves.
    pub(super) fn distance_to_way(self, point: Pos2, places: &[Pos2]) -> (f32, usize) {
        let distances =
            self.way(places).into_iter().enumerate().map(|(at, curve)| (distance_to_curve(point, curve), at));
        distances.min_by(|(a, _), (b, _)| a.total_cmp(b)).unwrap_or((f32::INFINITY, 0))
    }

    /// Zooms by a factor around `point`.
    pub(super) fn zoom_at(&mut self, point: Pos2, factor: f32) {
        let under = self.to_graph(point);
        self.zoom = (self.zoom * factor).clamp(ZOOM[0], ZOOM[1]);
        self.centre += under - self.to_graph(point);
    }

    /// Pans the view by points of the window.
    pub(super) fn pan(&mut self, by: Vec2) {
        self.centre -= by / self.zoom;
    }
}

/// The distance of a point from a curve.
fn distance_to_curve(point: Pos2, curve: [Pos2; 4]) -> f32 {
    const PIECES: usize = 24;
    if !Rect::from_points(&curve).expand(16.0).contains(point) {
        return f32::INFINITY;
    }
    let shape = CubicBezierShape::from_points_stroke(curve, false, Color32::TRANSPARENT, Stroke::NONE);
    let mut nearest = f32::INFINITY;
    let mut last = curve[0];
    for piece in 1..=PIECES {
        let next = shape.sample(piece as f32 / PIECES as f32);
        let (along, way) = (next - last, point - last);
        let t = (way.dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
        nearest = nearest.min((way - along * t).length());
        last = next;
    }
    nearest
}

#[cfg(test)]
mod tests {
    use egui::pos2;

    use super::*;

    #[test]
    fn zooming_keeps_what_is_under_the_pointer() {
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(400.0, 300.0));
        let mut lens = Lens::fitted(rect, Rect::from_min_size(pos2(-50.0, 0.0), vec2(1000.0, 200.0)));
        assert!((lens.zoom - 0.352).abs() < 1e-6, "{}", lens.zoom);
        let point = pos2(100.0, 250.0);
        let under = lens.to_graph(point);
        lens.zoom_at(point, 1.7);
        assert!((lens.to_graph(point) - under).length() < 1e-3);
        assert!((lens.to_screen(under) - point).length() < 1e-3);
        lens.zoom_at(point, 1e9);
        assert_eq!(lens.zoom, ZOOM[1]);
    }

    #[test]
    fn a_wire_passes_its_route_points() {
        let lens = Lens::fitted(Rect::from_min_size(Pos2::ZERO, vec2(400.0, 300.0)), Rect::NOTHING);
        let places = [pos2(0.0, 0.0), pos2(60.0, 90.0), pos2(-40.0, 20.0), pos2(100.0, 10.0)];
        let way = lens.way(&places);
        assert_eq!(way.len(), 3);
        for (curve, ends) in way.iter().zip(places.windows(2)) {
            assert_eq!([curve[0], curve[3]], [ends[0], ends[1]].map(|place| lens.to_screen(place)));
        }
        for (at, place) in places[1..3].iter().enumerate() {
            let (distance, curve) = lens.distance_to_way(lens.to_screen(*place), &places);
            assert!(distance < 1e-3 && (at..=at + 1).contains(&curve), "{distance} {curve}");
        }
        assert_eq!(lens.distance_to_way(pos2(900.0, 900.0), &places).0, f32::INFINITY);
    }

    #[test]
    fn a_large_graph_is_opened_where_it_can_be_read() {
        let rect = Rect::from_min_size(pos2(10.0, 20.0), vec2(900.0, 300.0));
        let small = Rect::from_min_size(Pos2::ZERO, vec2(1200.0, 500.0));
        assert_eq!(Lens::opening(rect, small, pos2(1000.0, 400.0)), Lens::fitted(rect, small));
        let large = Rect::from_min_size(Pos2::ZERO, vec2(9000.0, 500.0));
        let end = Lens::opening(rect, large, pos2(8900.0, 10.0));
        assert_eq!((end.zoom, end.centre.y), (LEGIBLE, 250.0));
        let beside = (MARGIN + overview::SIZE.x + overview::MARGIN) / LEGIBLE;
        assert!((end.seen().max.x - 9000.0 - beside).abs() < 0.1, "{}", end.seen());
        let middle = Lens::opening(rect, large, pos2(4000.0, 10.0));
        assert_eq!(middle.centre, pos2(4000.0, 250.0));
    }

    #[test]
    fn an_empty_graph_is_shown_at_full_size() {
        let rect = Rect::from_min_size(Pos2::ZERO, vec2(400.0, 300.0));
        assert_eq!(Lens::fitted(rect, Rect::NOTHING).zoom, 1.0);
    }
}
