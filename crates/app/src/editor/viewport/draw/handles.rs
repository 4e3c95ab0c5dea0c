//! The handles of shapes on the screen.

use egui::{
    Align2, Color32, Context, Id, Painter, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2, WidgetInfo, WidgetType, vec2,
};
use orograph_graph::Unit;

use super::{arm::Arm, shape::Shape};
use crate::editor::viewport::map::label;

/// Distance at which the pointer takes hold of a handle, in points of the screen.
const NEAR: f32 = 10.0;
/// The least distance of drawn handles, and that of the ends of a segment with a handle in its middle.
const APART: [f32; 2] = [7.0, 44.0];
/// Radius of the ring around the handle with the keyboard.
const RING: f32 = 10.0;
/// Pieces of a segment, so that it follows the terrain, and of a whole line.
const PIECES: [usize; 2] = [24, 2000];

/// The largest number of handles that are exposed to accessibility tools.
const MAX_EXPOSED: usize = 256;

const LINE: Color32 = Color32::from_rgb(255, 214, 64);
const FILL: Color32 = Color32::from_rgb(30, 34, 38);
const SHADE: Color32 = Color32::from_black_alpha(160);

/// The view: converts positions of the world to points of the screen and back.
pub(in crate::editor::viewport) struct Projection<'a> {
    pub(in crate::editor::viewport) to_screen: &'a dyn Fn([f64; 2]) -> Option<Pos2>,
    pub(in crate::editor::viewport) to_world: &'a dyn Fn(Pos2) -> Option<[f64; 2]>,
    /// Metres per point of the screen.
    pub(in crate::editor::viewport) metres: f64,
}

impl Projection<'_> {
    pub(super) fn to_world(&self, at: Pos2) -> Option<[f64; 2]> {
        (self.to_world)(at)
    }

    /// A position with the digits that the view can show.
    pub(super) fn rounded(&self, place: [f64; 2]) -> [f64; 2] {
        let power = self.metres.max(1e-9).log10().floor() as i32;
        place.map(|metres| {
            let step = 10_f64.powi(power.abs());
            if power >= 0 { (metres / step).round() * step } else { (metres * step).round() / step }
        })
    }
}

/// A handle; an arm has no parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Grip {
    pub(super) param: &'static str,
    /// The point; for the middle of a segment, the point at its end, or the number of points for the segment that closes
    /// an outline.
    pub(super) point: usize,
    pub(super) is_middle: bool,
}

impl Grip {
    /// The handle of an arm, by its position among those of the node.
    pub(super) const fn arm(at: usize) -> Self {
        Self { param: "", point: at, is_middle: false }
    }

    /// Its widget, which can have the keyboard.
    pub(super) fn id(&self) -> Id {
        Id::new("handle").with((self.param, self.point, self.is_middle))
    }

    /// The arm that it belongs to. Returns None for the points of shapes.
    pub(super) fn as_arm(&self) -> Option<usize> {
        self.param.is_empty().then_some(self.point)
    }
}

/// What is drawn: shapes, except one that new points replace, and arms.
pub(super) struct Drawn<'a> {
    pub(super) shapes: &'a [Shape],
    /// The parameter of the shape that is replaced, and the new points.
    pub(super) fresh: (Option<&'a str>, &'a [[f64; 2]]),
    pub(super) arms: &'a [Arm],
    /// The picked and the held handle, and the one with the keyboard.
    pub(super) picked: Option<&'a Grip>,
    pub(super) held: Option<&'a Grip>,
    pub(super) focused: Option<Id>,
}

/// The handles that were drawn last, those out of view as well.
#[derive(Debug, Default)]
pub(super) struct Handles {
    drawn: Vec<(Grip, Pos2, [f64; 2])>,
}

impl Handles {
    /// The handle at a point of the screen; points go before arms, and arms before middles.
    pub(super) fn near(&self, at: Pos2) -> Option<Grip> {
        let near = self.drawn.iter().filter(|(_, place, _)| place.distance(at) <= NEAR);
        let kind = |grip: &Grip| if grip.is_middle { 2 } else { u8::from(grip.as_arm().is_some()) };
        let rank = |grip: &Grip, place: &Pos2| (kind(grip), place.distance(at));
        near.min_by(|(a, p, _), (b, q, _)| {
            let ((kind, far), (other, farther)) = (rank(a, p), rank(b, q));
            kind.cmp(&other).then(far.total_cmp(&farther))
        })
        .map(|(grip, ..)| grip.clone())
    }

    /// The position of a handle in the world.
    pub(super) fn place(&self, grip: &Grip) -> Option<[f64; 2]> {
        self.drawn.iter().find(|(drawn, ..)| drawn == grip).map(|(.., place)| *place)
    }

    /// Notes the position of a handle that has just been moved, until it is drawn again.
    pub(super) fn set_place(&mut self, grip: &Grip, to: [f64; 2]) {
        match self.drawn.iter_mut().find(|(drawn, ..)| drawn == grip) {
            Some((.., place)) => *place = to,
            None => self.drawn.push((grip.clone(), Pos2::ZERO, to)),
        }
    }

    /// Draws shapes and arms with their handles. The picked and the held one are highlighted, and the held one shows
    /// its values.
    pub(super) fn draw(
        &mut self,
        (painter, response): (&Painter, &Response),
        projection: &Projection<'_>,
        Drawn { shapes, fresh: (hidden, fresh), arms, picked, held, focused }: &Drawn<'_>,
    ) {
        self.drawn.clear();
        let pointer = response.hover_pos();
        for (at, arm) in arms.iter().enumerate() {
            self.arm(painter, projection, at, arm);
        }
        for shape in shapes.iter().filter(|shape| Some(shape.param) != *hidden) {
            self.shape(painter, projection, shape);
        }
        line(painter, projection, fresh, false);
        for at in fresh.iter().filter_map(|place| (projection.to_screen)(*place)) {
            point(painter, at, true);
        }
        let hot = pointer.and_then(|at| self.near(at));
        let clip = painter.clip_rect().expand(NEAR);
        for (grip, at, place) in self.drawn.iter().filter(|(_, at, _)| clip.contains(*at)) {
            let is_focused = *focused == Some(grip.id());
            if is_focused {
                painter.circle_stroke(*at, RING, Stroke::new(4.0, SHADE));
                painter.circle_stroke(*at, RING, Stroke::new(2.0, Color32::WHITE));
            }
            if grip.is_middle {
                painter.circle(*at, 3.0, LINE.gamma_multiply(0.8), Stroke::new(1.0, FILL));
            } else {
                let is_picked = [picked, held].contains(&&Some(grip));
                point(painter, *at, is_picked || is_focused || hot.as_ref() == Some(grip));
            }
            if is_focused || *held == Some(grip) {
                let arm = grip.as_arm().and_then(|arm| arms.get(arm));
                let [x, y] = place.map(|metres| Unit::Metres.display(metres));
                let text = arm.map_or_else(|| format!("x {x}  y {y}"), |arm| format!("{} {}", arm.name(), arm.text()));
                label(painter, *at + vec2(12.0, -12.0), Align2::LEFT_BOTTOM, &text);
            }
        }
    }

    /// The handles that Tab reaches: those in view first.
    fn exposed(&self, clip: Rect) -> impl Iterator<Item = &(Grip, Pos2, [f64; 2])> {
        let in_view = move |is: bool| self.drawn.iter().filter(move |(_, at, _)| clip.contains(*at) == is);
        in_view(true).chain(in_view(false)).take(MAX_EXPOSED)
    }

    /// The handle with the keyboard.
    pub(super) fn focused(&self, context: &Context) -> Option<Grip> {
        let focused = context.memory(egui::Memory::focused)?;
        self.drawn.iter().map(|(grip, ..)| grip).find(|grip| grip.id() == focused).cloned()
    }

    /// The handle after or before one; the first or the last if there is none.
    pub(super) fn beside(&self, clip: Rect, grip: Option<&Grip>, forward: bool) -> Option<Grip> {
        let all: Vec<&Grip> = self.exposed(clip).map(|(grip, ..)| grip).collect();
        let count = all.len().max(1);
        let now = grip.and_then(|grip| all.iter().position(|other| *other == grip));
        let next = match (now, forward) {
            (Some(now), true) => (now + 1) % count,
            (Some(now), false) => (now + count - 1) % count,
            (None, true) => 0,
            (None, false) => count - 1,
        };
        all.get(next).map(|grip| (*grip).clone())
    }

    /// The point of the screen with a handle.
    pub(super) fn on_screen(&self, grip: &Grip) -> Option<Pos2> {
        self.drawn.iter().find(|(drawn, ..)| drawn == grip).map(|(_, at, _)| *at)
    }

    /// Exposes the handles to the keyboard, to accessibility tools and to the tests.
    pub(super) fn expose(&self, ui: &Ui, Drawn { arms, .. }: &Drawn<'_>) {
        for (grip, at, place) in self.exposed(ui.clip_rect()) {
            let rect = Rect::from_center_size(*at, Vec2::splat(10.0));
            let response = ui.interact(rect, grip.id(), Sense::focusable_noninteractive());
            let [x, y] = place.map(|metres| Unit::Metres.display(metres));
            let name = grip.param.replace('_', " ");
            let text = match grip.as_arm().and_then(|arm| arms.get(arm)) {
                Some(arm) => format!("{}: {}", arm.name(), arm.text()),
                None if grip.is_middle => format!("middle of {name}, before point {}: x {x}, y {y}", grip.point + 1),
                None => format!("point {} of {name}: x {x}, y {y}", grip.point + 1),
            };
            response.widget_info(|| WidgetInfo::labeled(WidgetType::Other, true, &text));
        }
    }

    fn arm(&mut self, painter: &Painter, projection: &Projection<'_>, at: usize, arm: &Arm) {
        let end = arm.end(projection);
        line(painter, projection, &[arm.centre, end], false);
        if arm.is_circle() {
            line(painter, projection, &arm.circle(projection), true);
        }
        // The handle of the centre would cover one nearer than this.
        let centre = (projection.to_screen)(arm.centre);
        let is_apart = |at: &Pos2| centre.is_none_or(|centre| centre.distance(*at) > NEAR);
        if let Some(place) = (projection.to_screen)(end).filter(is_apart) {
            self.drawn.push((Grip::arm(at), place, end));
        }
    }

    fn shape(&mut self, painter: &Painter, projection: &Projection<'_>, shape: &Shape) {
        let places = shape.places();
        line(painter, projection, &places, shape.closed);
        let mut last: Option<Pos2> = None;
        let ends = places.len() - 1;
        for (index, place) in places.iter().enumerate() {
            let Some(at) = (projection.to_screen)(*place) else { continue };
            let is_end = index == 0 || index == ends;
            if is_end || last.is_none_or(|last| last.distance(at) >= APART[0]) {
                let grip = Grip { param: shape.param, point: index, is_middle: false };
                self.drawn.push((grip, at, *place));
                last = Some(at);
            }
        }
        if shape.is_point() {
            return;
        }
        let closing = shape.closed.then(|| (places.len(), [places[ends], places[0]]));
        let segments =
            places.windows(2).enumerate().map(|(index, pair)| (index + 1, [pair[0], pair[1]])).chain(closing);
        for (index, [a, b]) in segments {
            let middle = [0, 1].map(|axis| 0.5 * (a[axis] + b[axis]));
            let (Some(from), Some(to)) = ((projection.to_screen)(a), (projection.to_screen)(b)) else { continue };
            if let Some(at) = (projection.to_screen)(middle).filter(|_| from.distance(to) >= APART[1]) {
                self.drawn.push((Grip { param: shape.param, point: index, is_middle: true }, at, middle));
            }
        }
    }
}

/// Draws a line that follows the terrain.
fn line(painter: &Painter, projection: &Projection<'_>, places: &[[f64; 2]], closed: bool) {
    if places.len() < 2 {
        return;
    }
    let pieces = (PIECES[1] / places.len()).clamp(1, PIECES[0]);
    let closing = closed.then(|| [places[places.len() - 1], places[0]]);
    let pairs = places.windows(2).map(|pair| [pair[0], pair[1]]).chain(closing);
    let between = |[a, b]: [[f64; 2]; 2]| {
        (0..=pieces)
            .map(move |k| k as f64 / pieces as f64)
            .map(move |t| [0, 1].map(|axis| a[axis] + t * (b[axis] - a[axis])))
    };
    let points: Vec<Pos2> = pairs.flat_map(between).filter_map(|place| (projection.to_screen)(place)).collect();
    painter.line(points.clone(), Stroke::new(4.0, SHADE));
    painter.line(points, Stroke::new(2.0, LINE));
}

fn point(painter: &Painter, at: Pos2, bright: bool) {
    let radius = if bright { 6.5 } else { 5.0 };
    painter.circle(at, radius, if bright { Color32::WHITE } else { LINE }, Stroke::new(1.5, FILL));
}
