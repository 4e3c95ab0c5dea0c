//! The handles by keyboard: Tab reaches them, the arrow keys move them, and Enter opens fields for their numbers.

use egui::{Event, EventFilter, Id, Key, Modifiers, Pos2, Response, Ui, Vec2, vec2};
use orograph_graph::{Edit, Unit};

use super::{Draw, Projection, arm::Arm, edit, handles::Grip, numbers::Numbers, shape::Shape};
use crate::editor::{Session, viewport::scale};

/// Upper bound of the length on the screen of a step by an arrow key, in points.
const STEP: f64 = 12.0;
/// Times as far that a step is with Shift.
const FAR: f64 = 10.0;

/// Where the handle with the keyboard is stored, for other panes.
fn focus_id() -> Id {
    Id::new("the handle with the keyboard")
}

/// Returns true if a handle has the keyboard.
pub(in crate::editor) fn has_keyboard(context: &egui::Context) -> bool {
    let focused = context.memory(egui::Memory::focused);
    focused.is_some() && context.data(|data| data.get_temp::<Id>(focus_id())) == focused
}

/// The direction of an arrow key on the screen.
const fn arrow(key: Key) -> Option<Vec2> {
    match key {
        Key::ArrowLeft => Some(vec2(-1.0, 0.0)),
        Key::ArrowRight => Some(vec2(1.0, 0.0)),
        Key::ArrowUp => Some(vec2(0.0, -1.0)),
        Key::ArrowDown => Some(vec2(0.0, 1.0)),
        _ => None,
    }
}

/// The axis of the world and the sign of a step that leads in a direction of the screen, as nearly as the view allows.
fn along(direction: Vec2, from: [f64; 2], step_m: f64, projection: &Projection<'_>) -> (usize, f64) {
    let level = if direction.x == 0.0 { (1, f64::from(direction.y)) } else { (0, f64::from(direction.x)) };
    let Some(start) = (projection.to_screen)(from) else { return level };
    let steps = [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)];
    let ways = steps.into_iter().filter_map(|(axis, sign)| {
        let mut to = from;
        to[axis] += sign * step_m;
        let way = (projection.to_screen)(to)? - start;
        Some((way.normalized().dot(direction), (axis, sign)))
    });
    ways.max_by(|(a, _), (b, _)| a.total_cmp(b)).map_or(level, |(_, step)| step)
}

/// A handle that is moved by an arrow key while the key is held down, which is one undo step.
#[derive(Debug, PartialEq)]
pub(super) struct Nudged {
    node: String,
    grip: Grip,
    key: Key,
}

impl Draw {
    /// Moves the keyboard to the next or the previous handle when the viewport is drawn next; None takes this back.
    pub(in crate::editor::viewport) const fn step(&mut self, forward: Option<bool>) {
        self.stepping = forward;
    }

    /// Carries out [`Self::step`], once the handles are drawn.
    pub(super) fn stepped(&mut self, ui: &Ui, session: &mut Session) {
        let Some(forward) = self.stepping.take() else { return };
        let now = self.handles.focused(ui.ctx());
        match self.handles.beside(ui.clip_rect(), now.as_ref(), forward) {
            Some(grip) => focus(ui, &grip),
            None => session.note("the selected node has no handles", true),
        }
    }

    /// Moves the handle with the keyboard. Returns true if the document has changed.
    pub(super) fn nudges(
        &mut self,
        ui: &Ui,
        response: &Response,
        projection: &Projection<'_>,
        session: &mut Session,
    ) -> bool {
        let focused = self.handles.focused(ui.ctx()).filter(|_| !self.is_held());
        let goes_on = |nudged: &Nudged| {
            let same = session.selected() == Some(nudged.node.as_str()) && focused.as_ref() == Some(&nudged.grip);
            same && ui.input(|input| input.key_down(nudged.key))
        };
        if self.nudged.as_ref().is_some_and(|nudged| !goes_on(nudged)) {
            self.end_nudge(session);
        }
        ui.data_mut(|data| data.insert_temp(focus_id(), focused.as_ref().map_or(Id::NULL, Grip::id)));
        let Some(mut grip) = focused else { return false };
        let arrows = EventFilter { horizontal_arrows: true, vertical_arrows: true, tab: false, escape: false };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(grip.id(), arrows));
        let mut pressed = Vec::new();
        ui.input_mut(|input| {
            input.events.retain(|event| match event {
                Event::Key { key, pressed: true, modifiers, repeat, .. } if is_own(*key, *modifiers) => {
                    pressed.push((*key, *modifiers, *repeat));
                    false
                }
                _ => true,
            });
        });
        let mut changed = false;
        for (key, modifiers, repeats) in pressed {
            let goes_on = |nudged: &Nudged| repeats && nudged.key == key;
            if self.nudged.as_ref().is_some_and(|nudged| !goes_on(nudged)) {
                self.end_nudge(session);
            }
            let made = match (key, arrow(key)) {
                (_, Some(direction)) => {
                    let made = self.nudge(&grip, (direction, modifiers), projection, session);
                    let (node, grip) = (session.selected(), made.as_ref().unwrap_or(&grip).clone());
                    self.nudged = node.map(|node| Nudged { node: node.to_owned(), grip, key });
                    made
                }
                (Key::Space, _) => {
                    let centre = projection.to_world(response.rect.center());
                    centre.and_then(|centre| self.place(&grip, projection.rounded(centre), session, Session::apply))
                }
                (Key::Insert, _) => self.extend(&grip, session),
                (Key::Enter, _) => {
                    self.numbers = Numbers::of(&grip, session);
                    None
                }
                _ => self.remove(&grip, session),
            };
            if let Some(next) = made {
                // asked for again, the focus would forget that the arrow keys are its own
                if next != grip {
                    focus(ui, &next);
                }
                (grip, changed) = (next, true);
            }
        }
        changed
    }

    /// Ends the undo step of a handle that an arrow key moves.
    pub(super) fn end_nudge(&mut self, session: &mut Session) {
        if self.nudged.take().is_some() {
            session.end_gesture();
        }
    }

    /// Moves a handle by an arrow key, as a part of a gesture. Returns the handle that it has become.
    fn nudge(
        &mut self,
        grip: &Grip,
        (direction, modifiers): (Vec2, Modifiers),
        projection: &Projection<'_>,
        session: &mut Session,
    ) -> Option<Grip> {
        let step_m = scale::round_below(STEP * projection.metres);
        if let Some(arm) = grip.as_arm() {
            let arm = Arm::of_selection(session).into_iter().nth(arm)?;
            let keys = [f64::from(direction.x), f64::from(-direction.y)];
            return session.gesture(&arm.nudged(keys, step_m, modifiers.shift).edit()).then(|| grip.clone());
        }
        let from = self.handles.place(grip)?;
        let (axis, sign) = along(direction, from, step_m, projection);
        let mut to = from;
        to[axis] += sign
            * if modifiers.command {
                let world = session.document().world();
                world.size[axis] / f64::from(world.cells[axis])
            } else {
                step_m * if modifiers.shift { FAR } else { 1.0 }
            };
        if !modifiers.command {
            // 0.1 + 0.2 is 0.3
            to[axis] = projection.rounded(to)[axis];
        }
        self.place(grip, to, session, Session::gesture)
    }

    /// Puts a point at a position; the middle of a segment becomes a point. Returns None for arms and refused edits.
    fn place(
        &mut self,
        grip: &Grip,
        to: [f64; 2],
        session: &mut Session,
        make: fn(&mut Session, &Edit) -> bool,
    ) -> Option<Grip> {
        let shape = shape(session.selected()?, grip, session)?;
        let moved = if grip.is_middle { shape.inserted(grip.point, to) } else { shape.moved(grip.point, to) };
        make(session, &edit(&moved)).then(|| {
            let grip = Grip { is_middle: false, ..grip.clone() };
            self.handles.set_place(&grip, moved.places()[grip.point]);
            grip
        })
    }

    /// Adds a point: in the middle of a segment, beyond the end of a line, or halfway to the next point.
    fn extend(&mut self, grip: &Grip, session: &mut Session) -> Option<Grip> {
        let shape = shape(session.selected()?, grip, session).filter(|shape| !shape.is_point())?;
        let places = shape.places();
        let count = places.len();
        let between = |a: [f64; 2], b: [f64; 2], t: f64| [0, 1].map(|axis| a[axis] + t * (b[axis] - a[axis]));
        let at = grip.point;
        let (before, place) = match at {
            _ if grip.is_middle => (at, between(places[at - 1], places[at % count], 0.5)),
            _ if shape.closed || (at > 0 && at + 1 < count) => {
                (at + 1, between(places[at], places[(at + 1) % count], 0.5))
            }
            0 => (0, between(places[1], places[0], 2.0)),
            _ => (count, between(places[at - 1], places[at], 2.0)),
        };
        let made = session.apply(&edit(&shape.inserted(before, place)));
        made.then_some(Grip { param: grip.param, point: before, is_middle: false })
    }

    /// Removes a point. Returns the handle before it.
    fn remove(&mut self, grip: &Grip, session: &mut Session) -> Option<Grip> {
        let shape = shape(session.selected()?, grip, session).filter(|shape| !shape.is_point() && !grip.is_middle)?;
        let Some(shorter) = shape.removed(grip.point) else {
            session.note("the line needs its last points; Redraw replaces it", true);
            return None;
        };
        self.picked = None;
        session.apply(&edit(&shorter)).then(|| Grip { point: grip.point.saturating_sub(1), ..grip.clone() })
    }

    /// The fields for the numbers of a handle, while they are open.
    pub(super) fn fields(&mut self, ui: &Ui, response: &Response, session: &mut Session) {
        let Some(numbers) = &mut self.numbers else { return };
        let at: Pos2 = self.handles.on_screen(&numbers.grip).unwrap_or_else(|| response.rect.center());
        let at = response.rect.shrink(20.0).clamp(at) + vec2(14.0, 14.0);
        if let Some(again) = numbers.ui(ui, at, session) {
            if again {
                focus(ui, &numbers.grip);
            }
            self.numbers = None;
        }
    }
}

/// Returns true for the keys of a handle.
fn is_own(key: Key, modifiers: Modifiers) -> bool {
    let plain = matches!(key, Key::Enter | Key::Space | Key::Insert | Key::Delete | Key::Backspace);
    !modifiers.alt && (arrow(key).is_some() || plain && modifiers == Modifiers::NONE)
}

/// Gives the keyboard to a handle.
fn focus(ui: &Ui, grip: &Grip) {
    ui.memory_mut(|memory| memory.request_focus(grip.id()));
    ui.data_mut(|data| data.insert_temp(focus_id(), grip.id()));
}

/// The shape of a node that a handle belongs to. Returns None when it has no longer such a point.
fn shape(node: &str, grip: &Grip, session: &Session) -> Option<Shape> {
    Shape::of(session, node).into_iter().find(|shape| shape.has(grip))
}

/// The numbers of a handle of a node, with their names and units.
pub(super) fn numbers(node: &str, grip: &Grip, session: &Session) -> Option<Vec<(String, Unit, f64)>> {
    if let Some(arm) = grip.as_arm() {
        return Some(Arm::of(session, node).get(arm)?.numbers());
    }
    let at = *shape(node, grip, session)?.places().get(grip.point).filter(|_| !grip.is_middle)?;
    Some(vec![("x".to_owned(), Unit::Metres, at[0]), ("y".to_owned(), Unit::Metres, at[1])])
}

/// Sets the numbers of a handle of a node. Returns false if the document refuses them.
pub(super) fn set_numbers(node: &str, grip: &Grip, numbers: &[f64], session: &mut Session) -> bool {
    if let Some(at) = grip.as_arm() {
        let arm = Arm::of(session, node).into_iter().nth(at);
        return arm.is_some_and(|arm| session.apply(&arm.with(numbers).edit()));
    }
    match (shape(node, grip, session), numbers) {
        (Some(shape), [x, y]) => session.apply(&edit(&shape.moved(grip.point, [*x, *y]))),
        _ => false,
    }
}
