//! Points in a plane that can be dragged, added and removed: curves, and paths in the world.

use egui::{Align2, Color32, FontId, Pos2, Rect, Sense, Stroke, StrokeKind, Ui, emath::RectTransform, pos2, vec2};
use orograph_graph::{ParamValue, Unit};
use orograph_nodes::combine::curve::slopes;

use super::{
    form::FormState,
    number,
    value::{Place, ValueChange, point},
};
use crate::editor::window::names::Named as _;

/// The line through the points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// A monotone cubic.
    Smooth,
    /// Steps: y is constant from each point to the next.
    Steps,
    /// Straight lines in the world.
    Straight,
}

impl Way {
    /// Points along the line, dense enough to be joined by segments.
    fn through(self, points: &[[f64; 2]]) -> Vec<[f64; 2]> {
        const PIECES: usize = 24;
        if points.len() < 2 || self == Self::Straight {
            return points.to_vec();
        }
        let last = points[points.len() - 1];
        let pieces = points.windows(2);
        if self == Self::Steps {
            return pieces.flat_map(|ends| [ends[0], [ends[1][0], ends[0][1]]]).chain([last]).collect();
        }
        let slopes = slopes(points);
        let piece = |(ends, slopes): (&[[f64; 2]], &[f64])| {
            let ([x0, y0], [x1, y1], [from, to]) = (ends[0], ends[1], [slopes[0], slopes[1]]);
            (0..PIECES).map(move |k| k as f64 / PIECES as f64).map(move |t| {
                let (width, rest) = (x1 - x0, 1.0 - t);
                // Hermite's form of the cubic
                let y = y0 * rest * rest * (1.0 + 2.0 * t) + y1 * t * t * (3.0 - 2.0 * t);
                [x0 + t * width, y + width * t * rest * (from * rest - to * t)]
            })
        };
        pieces.zip(slopes.windows(2)).flat_map(piece).chain([last]).collect()
    }
}

/// The points of a curve, x increasing.
pub(super) fn curve(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    (unit, way): (Unit, Way),
    points: &[[f64; 2]],
) -> Option<ValueChange> {
    let pad = Pad { bounds: around(points), way, unit, height: 150.0 };
    let asked = pad.show(ui, place, points);
    let asked = asked.or_else(|| table(ui, form, place, unit, points, 2));
    asked.map(|asked| asked.map_or_else(ValueChange::Wrong, |(points, drag)| made(ParamValue::Curve(points), drag)))
}

/// Positions in the world, in order; the pad shows the world from above, north up.
pub(super) fn path(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    unit: Unit,
    points: &[[f64; 2]],
) -> Option<ValueChange> {
    let asked = world(ui, place, unit, points);
    let asked = asked.or_else(|| table(ui, form, place, unit, points, 2));
    asked.map(|asked| asked.map_or_else(ValueChange::Wrong, |(points, drag)| made(ParamValue::Path(points), drag)))
}

/// The pad of positions in the world, without a table.
pub(super) fn world(ui: &mut Ui, place: Place<'_>, unit: Unit, points: &[[f64; 2]]) -> Option<Moved> {
    let size = place.world.size;
    let ratio = (size[1] / size[0]) as f32;
    let height = (ui.available_width() * ratio).clamp(60.0, 260.0);
    let pad = Pad { bounds: [[0.0, 0.0], size], way: Way::Straight, unit, height };
    pad.show(ui, place, points)
}

const fn made(value: ParamValue, drag: bool) -> ValueChange {
    if drag { ValueChange::Drag(value) } else { ValueChange::Set(value) }
}

/// The points, and whether they are being dragged; or why they are invalid.
pub(super) type Moved = Result<(Vec<[f64; 2]>, bool), String>;

/// The bounding rectangle of some points with a margin, as its lowest and highest corner.
fn around(points: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let along = |axis: usize| {
        let values = points.iter().map(|point| point[axis]);
        let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        let margin = if high > low { 0.1 * (high - low) } else { 0.5 * low.abs().max(1.0) };
        [low - margin, high + margin]
    };
    let ([left, right], [bottom, top]) = (along(0), along(1));
    [[left, bottom], [right, top]]
}

/// A plane with points.
struct Pad {
    /// The visible range: the lowest and the highest corner.
    bounds: [[f64; 2]; 2],
    /// The line through its points. On a curve x increases from point to point and y points up; otherwise it is a map.
    way: Way,
    unit: Unit,
    height: f32,
}

/// The dragged point, and the visible range during the drag.
#[derive(Clone, Copy, Debug)]
struct Held {
    point: usize,
    bounds: [[f64; 2]; 2],
}

/// Grab distance of a point, in points of the screen.
const NEAR: f32 = 11.0;

impl Pad {
    fn is_curve(&self) -> bool {
        self.way != Way::Straight
    }

    fn show(&self, ui: &mut Ui, place: Place<'_>, points: &[[f64; 2]]) -> Option<Moved> {
        let id = place.line.with("pad");
        let held: Option<Held> = ui.data(|data| data.get_temp(id));
        let bounds = held.map_or(self.bounds, |held| held.bounds);
        let mut size = vec2(ui.available_width(), self.height);
        if !self.is_curve() {
            // a map keeps its aspect ratio
            let ratio = ((bounds[1][0] - bounds[0][0]) / (bounds[1][1] - bounds[0][1])) as f32;
            size.x = size.x.min(self.height * ratio);
        }
        let (response, painter) = ui.allocate_painter(size, Sense::click_and_drag());
        let what = if self.is_curve() { "curve" } else { "map" };
        let response = response.named(format!("{what} of {}", place.name));
        let rect = response.rect;
        let map = self.transform(bounds, rect);
        let places: Vec<Pos2> = points.iter().map(|point| map.forth(*point)).collect();
        let near = |pointer: Pos2| {
            let nearest = places
                .iter()
                .enumerate()
                .min_by(|(_, a), (_, b)| a.distance_sq(pointer).total_cmp(&b.distance_sq(pointer)));
            nearest.filter(|(_, at)| at.distance(pointer) <= NEAR).map(|(index, _)| index)
        };
        let hovered = response.hover_pos().and_then(near);
        let way: Vec<Pos2> = self.way.through(points).into_iter().map(|place| map.forth(place)).collect();
        self.paint(ui, (&painter, rect), bounds, [&places, &way], held.map(|held| held.point).or(hovered));

        let pointer = response.interact_pointer_pos();
        if response.drag_started()
            && let Some(point) = ui.input(|input| input.pointer.press_origin()).and_then(near)
        {
            ui.data_mut(|data| data.insert_temp(id, Held { point, bounds }));
        }
        if !response.dragged() && held.is_some() {
            ui.data_mut(|data| data.remove::<Held>(id));
        }
        let mut changed = points.to_vec();
        if let (Some(Held { point, .. }), true, Some(pointer)) = (held, response.dragged(), pointer)
            && point < points.len()
        {
            changed[point] = self.allowed(points, point, map.back(pointer), bounds);
            return (changed != points).then_some(Ok((changed, true)));
        }
        if response.double_clicked()
            && hovered.is_none()
            && let Some(pointer) = pointer
        {
            let new = rounded(map.back(pointer), bounds);
            let at = if self.is_curve() {
                changed.partition_point(|point| point[0] < new[0])
            } else {
                after(&places, pointer)
            };
            changed.insert(at, new);
            return Some(Ok((changed, false)));
        }
        if response.secondary_clicked()
            && let Some(point) = pointer.and_then(near)
            && points.len() > 2
        {
            changed.remove(point);
            return Some(Ok((changed, false)));
        }
        let hint = "Drag a point; double-click to add one; right-click one to remove it";
        response.on_hover_text_at_pointer(hint);
        None
    }

    fn transform(&self, bounds: [[f64; 2]; 2], rect: Rect) -> Map {
        // Numbers of any size are mapped to the unit square in double precision.
        let unit = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        let screen = match self.is_curve() {
            true => Rect::from_min_max(rect.left_bottom(), rect.right_top()),
            false => rect,
        };
        Map { bounds, screen: RectTransform::from_to(unit, screen) }
    }

    /// Where a point may be: in the pad, and on a curve between its neighbours.
    fn allowed(&self, points: &[[f64; 2]], at: usize, wanted: [f64; 2], bounds: [[f64; 2]; 2]) -> [f64; 2] {
        let mut place = [0, 1].map(|axis| wanted[axis].clamp(bounds[0][axis], bounds[1][axis]));
        place = rounded(place, bounds);
        if self.is_curve() {
            let least = (bounds[1][0] - bounds[0][0]) * 0.005;
            let low = at.checked_sub(1).map_or(f64::NEG_INFINITY, |before| points[before][0] + least);
            let high = points.get(at + 1).map_or(f64::INFINITY, |after| after[0] - least);
            place[0] = if low <= high { place[0].clamp(low, high) } else { points[at][0] };
        }
        place
    }

    fn paint(
        &self,
        ui: &Ui,
        (painter, rect): (&egui::Painter, Rect),
        bounds: [[f64; 2]; 2],
        [places, way]: [&[Pos2]; 2],
        bright: Option<usize>,
    ) {
        let visuals = ui.visuals();
        painter.rect(
            rect,
            visuals.widgets.inactive.corner_radius,
            visuals.extreme_bg_color,
            visuals.widgets.noninteractive.bg_stroke,
            StrokeKind::Inside,
        );
        let grid = Stroke::new(1.0, visuals.widgets.noninteractive.bg_stroke.color.gamma_multiply(0.5));
        for share in [0.25, 0.5, 0.75] {
            painter.hline(rect.x_range(), rect.lerp_inside(vec2(0.5, share)).y, grid);
            painter.vline(rect.lerp_inside(vec2(share, 0.5)).x, rect.y_range(), grid);
        }
        let accent = visuals.hyperlink_color;
        let clipped = painter.with_clip_rect(rect.intersect(ui.clip_rect()));
        clipped.line(way.to_vec(), Stroke::new(2.0, accent));
        for (index, at) in places.iter().enumerate() {
            let radius = if bright == Some(index) { 6.0 } else { 4.5 };
            clipped.circle(*at, radius, accent, Stroke::new(1.5, visuals.strong_text_color()));
        }
        let weak: Color32 = visuals.weak_text_color();
        let font = FontId::proportional(10.0);
        let corner = |value: f64| self.unit.display(value);
        let inside = rect.shrink(4.0);
        let [low, high] = bounds;
        let (top, bottom) = if self.is_curve() { (high[1], low[1]) } else { (low[1], high[1]) };
        painter.text(inside.left_top(), Align2::LEFT_TOP, corner(top), font.clone(), weak);
        painter.text(inside.left_bottom() - vec2(0.0, 11.0), Align2::LEFT_BOTTOM, corner(bottom), font.clone(), weak);
        painter.text(inside.left_bottom(), Align2::LEFT_BOTTOM, corner(low[0]), font.clone(), weak);
        painter.text(inside.right_bottom(), Align2::RIGHT_BOTTOM, corner(high[0]), font, weak);
    }
}

/// Converts between numbers and the screen.
struct Map {
    bounds: [[f64; 2]; 2],
    screen: RectTransform,
}

impl Map {
    fn forth(&self, point: [f64; 2]) -> Pos2 {
        let [low, high] = self.bounds;
        let [x, y] = [0, 1].map(|axis| ((point[axis] - low[axis]) / (high[axis] - low[axis])) as f32);
        self.screen.transform_pos(pos2(x, y))
    }

    fn back(&self, at: Pos2) -> [f64; 2] {
        let at = self.screen.inverse().transform_pos(at);
        let [low, high] = self.bounds;
        let shares = [f64::from(at.x), f64::from(at.y)];
        [0, 1].map(|axis| low[axis] + shares[axis] * (high[axis] - low[axis]))
    }
}

/// A position rounded to digits finer than a point of the screen.
fn rounded(place: [f64; 2], bounds: [[f64; 2]; 2]) -> [f64; 2] {
    [0, 1].map(|axis| number::short(place[axis], bounds[1][axis] - bounds[0][axis]))
}

/// Where to insert a new position in a path: in the nearest segment, or at an end.
fn after(places: &[Pos2], pointer: Pos2) -> usize {
    let distance = |pair: &[Pos2]| {
        let along = pair[1] - pair[0];
        let share = ((pointer - pair[0]).dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
        (pair[0] + along * share).distance(pointer)
    };
    let pieces = places.windows(2).enumerate();
    let nearest = pieces.map(|(at, pair)| (at + 1, distance(pair))).min_by(|a, b| a.1.total_cmp(&b.1));
    let to_end = |end: Option<&Pos2>| end.map_or(f32::INFINITY, |end| end.distance(pointer));
    match nearest {
        // beyond the last segment, the end of the path is as close as the segment
        Some((_, piece)) if to_end(places.last()) <= piece => places.len(),
        Some((_, piece)) if to_end(places.first()) <= piece => 0,
        Some((at, _)) => at,
        None => places.len(),
    }
}

/// The numbers of all points, which can be typed, added and removed.
fn table(
    ui: &mut Ui,
    form: &mut FormState,
    place: Place<'_>,
    unit: Unit,
    points: &[[f64; 2]],
    fewest: usize,
) -> Option<Moved> {
    let mut moved = None;
    egui::CollapsingHeader::new(format!("{} points", points.len())).id_salt(place.line.with("points")).show(ui, |ui| {
        for (at, now) in points.iter().enumerate() {
            ui.horizontal(|ui| {
                let remove = ui.add_enabled(points.len() > fewest, egui::Button::new("✖").small().frame(false));
                let remove = remove.named(format!("remove point {}", at + 1));
                if remove.on_hover_text("Remove the point").clicked() {
                    let mut changed = points.to_vec();
                    changed.remove(at);
                    moved = Some(Ok((changed, false)));
                }
                if let Some(typed) = point(ui, form, place, unit, *now, Some(at)) {
                    moved = Some(typed.map(|point| {
                        let mut changed = points.to_vec();
                        changed[at] = point;
                        (changed, false)
                    }));
                }
            });
        }
        if ui.small_button("➕ point").clicked() {
            moved = Some(Ok((with_one_more(points), false)));
        }
    });
    moved
}

/// The points with one more, as far beyond the last as that is from the one before.
fn with_one_more(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut more = points.to_vec();
    match points {
        [.., [x0, y0], [x1, y1]] => more.push([2.0 * x1 - x0, 2.0 * y1 - y0]),
        [[x, y]] => more.push([x + 1.0, *y]),
        [] => more.push([0.0, 0.0]),
    }
    more
}

#[cfg(test)]
mod tests {
    use orograph_graph::{
        Cancel, Fallback, Field, Input, InputValue, Job, ParamValues, Value, Warnings, Window, World,
    };

    use super::*;

    #[test]
    fn points_stay_in_order_and_at_round_numbers() {
        let pad = Pad { bounds: [[0.0, 0.0], [1.0, 1.0]], way: Way::Smooth, unit: Unit::One, height: 100.0 };
        let points = [[0.0, 0.0], [0.5, 0.5], [1.0, 1.0]];
        assert_eq!(pad.allowed(&points, 1, [0.7128, 0.31], pad.bounds), [0.713, 0.31]);
        assert_eq!(pad.allowed(&points, 1, [2.0, -1.0], pad.bounds), [0.995, 0.0]);
        assert_eq!(rounded([7312.4, 0.0], [[0.0, 0.0], [24_000.0, 1.0]]), [7310.0, 0.0]);
    }

    /// The drawn curve equals the output of the node `Curve`, within the rounding of its single precision.
    #[test]
    fn a_curve_is_drawn_as_it_is_evaluated() {
        let points = vec![[0.0, 0.0], [100.0, 40.0], [130.0, 300.0], [400.0, 320.0], [500.0, 100.0]];
        let drawn = Way::Smooth.through(&points);
        assert!(points.iter().all(|point| drawn.contains(point)));
        let cells = drawn.len() as u32;
        let world = World { size: [f64::from(cells), 1.0], cells: [cells, 1], ..World::default() };
        let window = Window::whole(world);
        let heights = Field::new(window, drawn.iter().map(|[x, _]| *x as f32).collect());
        let node = orograph_nodes::registry().get("Curve").expect("there is one");
        let mut params = ParamValues::defaults(&node.specs());
        params.set("points", ParamValue::Curve(points.clone()));
        let input = |input: &Input| match (input.ty, input.fallback) {
            (_, Fallback::Constant { default, .. }) => InputValue::Constant(default),
            (_, Fallback::Required) => InputValue::Value(Value::Field(heights.clone())),
            (_, Fallback::None) => InputValue::Absent,
        };
        let job = Job {
            node,
            params: &params,
            inputs: node.inputs.iter().map(input).collect(),
            window,
            wanted: orograph_graph::Wanted::ALL,
            folder: std::path::PathBuf::new(),
            cancel: Cancel::default(),
            progress: &|_| {},
            level: orograph_graph::LevelJob::default(),
            warnings: Warnings::default(),
            glimpses: None,
        };
        let value = (node.cpu)(&job).expect("runs").take(node.outputs[0].name).expect("declared");
        let field = value.as_field().expect("a field");
        for ([x, y], given) in drawn.iter().zip(field.samples()) {
            assert!((y - f64::from(*given)).abs() < 1e-3, "{x}: {y} {given}");
        }
        assert_eq!(
            Way::Steps.through(&points[..3]),
            [[0.0, 0.0], [100.0, 0.0], [100.0, 40.0], [130.0, 40.0], [130.0, 300.0]]
        );
    }

    #[test]
    fn a_new_position_is_inserted_in_the_nearest_segment() {
        let way = [pos2(0.0, 0.0), pos2(10.0, 0.0), pos2(20.0, 0.0)];
        assert_eq!(after(&way, pos2(4.0, 3.0)), 1);
        assert_eq!(after(&way, pos2(14.0, 3.0)), 2);
        assert_eq!(after(&way, pos2(30.0, 3.0)), 3);
        assert_eq!(after(&way, pos2(-5.0, 1.0)), 0);
        assert_eq!(with_one_more(&[[0.0, 1.0], [2.0, 1.5]]), [[0.0, 1.0], [2.0, 1.5], [4.0, 2.0]]);
    }

    #[test]
    fn screen_and_number_transforms_are_inverse() {
        let pad = Pad { bounds: [[-5.0, 1e6], [5.0, 2e6]], way: Way::Smooth, unit: Unit::One, height: 100.0 };
        let map = pad.transform(pad.bounds, Rect::from_min_size(pos2(10.0, 20.0), vec2(200.0, 100.0)));
        assert_eq!(map.forth([-5.0, 1e6]), pos2(10.0, 120.0));
        let [x, y] = map.back(map.forth([2.5, 1.25e6]));
        // positions on the screen are in single precision
        assert!((x - 2.5).abs() < 1e-4 && (y - 1.25e6).abs() < 10.0, "{x} {y}");
    }
}
