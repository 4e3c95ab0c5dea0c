//! Drawing: the points of the selected node's paths, outlines and positions as handles on the terrain.
//!
//! The handles of any node whose parameters are declared as such are shown and can be dragged; no node type is named
//! here. With the drawing tool, clicks add points. Each drag and each added point is one undo step.

mod arm;
mod handles;
mod keys;
mod numbers;
mod recipes;
mod shape;

use egui::{CursorIcon, Event, Key, Modifiers, PointerButton, Pos2, Response, Ui};
use orograph_graph::Edit;

pub(super) use self::handles::Projection;
pub(in crate::editor) use self::keys::has_keyboard;
use self::{
    arm::Arm,
    handles::{Drawn, Grip, Handles},
    keys::Nudged,
    numbers::Numbers,
    shape::Shape,
};
use super::{
    insert::{self, New},
    scale,
};
use crate::editor::Session;

/// How far the pointer moves, in points of the screen, until a click becomes a drag.
const STILL: f32 = 3.0;

/// The drawing tool.
#[derive(Debug, Default)]
pub(super) struct Draw {
    handles: Handles,
    held: Option<Held>,
    /// The arm that is being dragged, by its position among those of the node.
    turned: Option<(usize, Turned)>,
    /// The point that the Delete key removes.
    picked: Option<(String, Grip)>,
    /// The parameter that new points go to, if it is not the first one.
    chosen: Option<(String, &'static str)>,
    /// Points of a new line, which replaces the shape once it has enough of them.
    fresh: Option<Vec<[f64; 2]>>,
    /// True if the pointer is over a handle, or holds one.
    hot: bool,
    /// Set while the keyboard is to go to the next handle (true) or the previous one.
    stepping: Option<bool>,
    /// The handle that a held arrow key moves.
    nudged: Option<Nudged>,
    /// The open fields for the numbers of a handle.
    numbers: Option<Numbers>,
}

/// A point that is being dragged.
#[derive(Debug)]
struct Held {
    /// The shape without the drag; None for the only point of a new line.
    shape: Option<Shape>,
    point: usize,
    /// Where the button was pressed, and from there to the point, in metres.
    from: Pos2,
    offset: [f64; 2],
    /// True once the pointer has left the place where the button was pressed.
    moved: bool,
}

/// An arm that is being dragged.
#[derive(Debug)]
struct Turned {
    /// The arm without the drag.
    arm: Arm,
    /// Where the button was pressed, and from there to its end, in metres.
    from: Pos2,
    offset: [f64; 2],
    /// True once the pointer has left the place where the button was pressed.
    moved: bool,
}

/// A change of the pointer.
enum Touch {
    Press(Pos2),
    Move(Pos2),
    Release(Pos2),
}

impl Draw {
    /// Returns true if the primary button belongs to a handle in this frame. Call before the camera is moved.
    pub(super) fn takes(&mut self, ui: &Ui) -> bool {
        let over = |at: Pos2| self.handles.near(at).is_some();
        let pressed = |event: &Event| matches!(event, Event::PointerButton { pos, pressed: true, button: PointerButton::Primary, .. } if over(*pos));
        let (hovers, presses) = ui.input(|input| {
            let free = !input.pointer.any_down();
            (free && input.pointer.hover_pos().is_some_and(over), input.events.iter().any(pressed))
        });
        self.hot = self.is_held() || hovers || presses;
        self.hot
    }

    /// Returns true while a handle is held.
    const fn is_held(&self) -> bool {
        self.held.is_some() || self.turned.is_some()
    }

    /// Forgets what is being drawn, and ends the undo step of a handle that a key moves.
    pub(super) fn end(&mut self, session: &mut Session) {
        (self.fresh, self.picked, self.numbers) = (None, None, None);
        (self.held, self.turned) = (None, None);
        self.end_nudge(session);
    }

    /// The tool bar.
    pub(super) fn bar(&mut self, ui: &mut Ui, session: &mut Session) {
        ui.horizontal_wrapped(|ui| {
            let shapes = Shape::of_selection(session);
            if shapes.is_empty() {
                ui.label("Select a node with a path or a position, or add one:");
                new_line(ui, session);
                return;
            }
            let now = self.target(&shapes).map(|shape| shape.param);
            for shape in &shapes {
                let name = shape.param.replace('_', " ");
                let label = ui.selectable_label(now == Some(shape.param), name);
                if label.on_hover_text("Clicks draw this parameter").clicked() {
                    (self.chosen, self.fresh) = (Some((shape.node.clone(), shape.param)), None);
                }
            }
            let is_line = self.target(&shapes).is_some_and(|shape| !shape.is_point());
            let restart = ui.add_enabled(is_line, egui::Button::new("Redraw"));
            if restart.on_hover_text("Draw a new line that replaces this one").clicked() {
                self.fresh = Some(Vec::new());
            }
            new_line(ui, session);
            ui.separator();
            ui.weak("Click: add a point. Drag: move it. Delete: remove it. Ctrl: snap. Escape: end.");
        });
    }

    /// The shape that new points go to.
    fn target<'a>(&self, shapes: &'a [Shape]) -> Option<&'a Shape> {
        let chosen = self.chosen.as_ref();
        let is_chosen =
            |shape: &&Shape| chosen.is_some_and(|(node, param)| shape.node == *node && shape.param == *param);
        shapes.iter().find(is_chosen).or_else(|| shapes.first())
    }

    /// Shows the handles and moves them with the pointer. `drawing` is true while clicks add points. Returns true if the
    /// drawing has ended.
    pub(super) fn ui(
        &mut self,
        ui: &Ui,
        (response, painter): (&Response, &egui::Painter),
        projection: &Projection<'_>,
        session: &mut Session,
        drawing: bool,
    ) -> bool {
        let mut shapes = Shape::of_selection(session);
        let node = shapes.first().map(|shape| shape.node.as_str());
        if self.picked.as_ref().is_some_and(|(of, _)| Some(of.as_str()) != node) {
            self.picked = None;
        }
        for touch in self.touches(ui, response) {
            let edits = match touch {
                Touch::Press(at) => self.press(at, &shapes, projection, session, drawing),
                Touch::Move(at) => self.drag(at, ui, projection, session),
                Touch::Release(at) => {
                    let edits = self.drag(at, ui, projection, session);
                    (self.held, self.turned) = (None, None);
                    session.end_gesture();
                    edits
                }
            };
            if edits {
                shapes = Shape::of_selection(session);
            }
        }
        if self.nudges(ui, response, projection, session) {
            shapes = Shape::of_selection(session);
        }
        let ended = self.keys(ui, response, &shapes, session, drawing);
        if ended {
            self.end(session);
        }
        let shapes = Shape::of_selection(session);
        if self.hot && response.hovered() {
            response.clone().on_hover_cursor(CursorIcon::Grab);
        }
        let picked = self.picked.as_ref().map(|(_, grip)| grip);
        let arm = self.turned.as_ref().map(|(at, _)| Grip::arm(*at));
        let held = self.held.as_ref().and(picked).or(arm.as_ref());
        let hidden = self.fresh.as_ref().and_then(|_| self.target(&shapes)).map(|shape| shape.param);
        let fresh = (hidden, self.fresh.as_deref().unwrap_or_default());
        let arms = Arm::of_selection(session);
        let focused = ui.memory(egui::Memory::focused);
        let drawn = Drawn { shapes: &shapes, fresh, arms: &arms, picked, held, focused };
        self.handles.draw((painter, response), projection, &drawn);
        self.handles.expose(ui, &drawn);
        self.stepped(ui, session);
        self.fields(ui, response, session);
        ended
    }

    /// What the pointer did since the last frame, if it is this widget's. One frame can have several events.
    fn touches(&self, ui: &Ui, response: &Response) -> Vec<Touch> {
        let mut held = self.is_held();
        if !(held || response.is_pointer_button_down_on() || response.drag_stopped() || response.clicked()) {
            return Vec::new();
        }
        let mut touches = Vec::new();
        ui.input(|input| {
            for event in &input.events {
                match *event {
                    Event::PointerMoved(at) if held => touches.push(Touch::Move(at)),
                    Event::PointerButton { pos, button: PointerButton::Primary, pressed, .. } if pressed != held => {
                        touches.push(if pressed { Touch::Press(pos) } else { Touch::Release(pos) });
                        held = pressed;
                    }
                    _ => {}
                }
            }
        });
        touches
    }

    /// The button is pressed: takes hold of a handle, or adds a point. Returns true if the document has changed.
    fn press(
        &mut self,
        at: Pos2,
        shapes: &[Shape],
        projection: &Projection<'_>,
        session: &mut Session,
        drawing: bool,
    ) -> bool {
        let Some(place) = projection.to_world(at) else { return false };
        let offset = |to: [f64; 2]| [0, 1].map(|axis| to[axis] - place[axis]);
        if let Some(grip) = self.handles.near(at) {
            if let Some(index) = grip.as_arm() {
                let arm = Arm::of_selection(session).into_iter().nth(index);
                let end = self.handles.place(&grip).unwrap_or(place);
                self.turned = arm.map(|arm| (index, Turned { arm, from: at, offset: offset(end), moved: false }));
                return false;
            }
            let Some(shape) = shapes.iter().find(|shape| shape.has(&grip)) else { return false };
            let (shape, to) = if grip.is_middle {
                let to = self.handles.place(&grip).unwrap_or(place);
                (shape.inserted(grip.point, to), to)
            } else {
                (shape.clone(), shape.places()[grip.point])
            };
            let point = grip.point;
            self.picked = Some((shape.node.clone(), Grip { is_middle: false, ..grip }));
            self.held = Some(Held { shape: Some(shape), point, from: at, offset: offset(to), moved: false });
            return false;
        }
        if !drawing {
            return false;
        }
        let Some(shape) = self.target(shapes) else { return false };
        let place = projection.rounded(place);
        if shape.is_point() {
            let shape = shape.moved(0, place);
            return self.begin(shape, 0, at, session);
        }
        if self.fresh.is_none() && !shape.is_set {
            self.fresh = Some(Vec::new());
        }
        if let Some(fresh) = &mut self.fresh {
            if fresh.last() == Some(&place) {
                return false;
            }
            fresh.push(place);
            let point = fresh.len() - 1;
            let Some(shape) = shape.through(fresh) else {
                self.held = Some(Held { shape: None, point, from: at, offset: [0.0; 2], moved: false });
                return false;
            };
            self.fresh = None;
            return self.begin(shape, point, at, session);
        }
        let places = shape.places();
        let is_first = self.picked.as_ref().is_some_and(|(_, grip)| grip.param == shape.param && grip.point == 0);
        let point = if is_first && !shape.closed { 0 } else { places.len() };
        if places.get(point.saturating_sub(1)) == Some(&place) {
            return false;
        }
        let shape = shape.inserted(point, place);
        self.begin(shape, point, at, session)
    }

    /// Writes a shape with a new point, which the pointer holds from then on.
    fn begin(&mut self, shape: Shape, point: usize, from: Pos2, session: &mut Session) -> bool {
        let made = session.gesture(&edit(&shape));
        if made {
            self.picked = Some((shape.node.clone(), Grip { param: shape.param, point, is_middle: false }));
            self.held = Some(Held { shape: Some(shape), point, from, offset: [0.0; 2], moved: false });
        }
        made
    }

    /// Moves the held point to the pointer. Returns true if the document has changed.
    fn drag(&mut self, at: Pos2, ui: &Ui, projection: &Projection<'_>, session: &mut Session) -> bool {
        let modifiers = ui.input(|input| input.modifiers);
        if let Some((_, turned)) = &mut self.turned {
            turned.moved |= turned.from.distance(at) > STILL;
            let Some(place) = projection.to_world(at).filter(|_| turned.moved) else { return false };
            let place = [0, 1].map(|axis| place[axis] + turned.offset[axis]);
            return session.gesture(&turned.arm.moved(place, modifiers.command, projection).edit());
        }
        let Some(held) = &mut self.held else { return false };
        held.moved |= held.from.distance(at) > STILL;
        let Some(place) = projection.to_world(at).filter(|_| held.moved) else { return false };
        let place = [0, 1].map(|axis| place[axis] + held.offset[axis]);
        let place = snapped(modifiers, place, projection, session);
        match (&held.shape, &mut self.fresh) {
            (Some(shape), _) => session.gesture(&edit(&shape.moved(held.point, place))),
            (None, Some(fresh)) => {
                if let Some(point) = fresh.get_mut(held.point) {
                    *point = place;
                }
                false
            }
            (None, None) => false,
        }
    }

    /// Delete removes the picked point, Escape ends the drawing. Returns true if it has ended.
    fn keys(&mut self, ui: &Ui, response: &Response, shapes: &[Shape], session: &mut Session, drawing: bool) -> bool {
        if !response.contains_pointer() || ui.ctx().text_edit_focused() || self.is_held() {
            return false;
        }
        let pressed = |key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        if let Some((_, grip)) = self.picked.clone()
            && let Some(shape) = shapes.iter().find(|shape| shape.has(&grip))
            && !shape.is_point()
            && (pressed(Key::Delete) || pressed(Key::Backspace))
        {
            match shape.removed(grip.point) {
                Some(shorter) => {
                    session.apply(&edit(&shorter));
                }
                None => session.note("the line needs its last points; Redraw replaces it", true),
            }
            self.picked = None;
        }
        drawing && (pressed(Key::Escape) || pressed(Key::Enter))
    }
}

/// The edit that writes a shape.
fn edit(shape: &Shape) -> Edit {
    Edit::SetParam { node: shape.node.clone(), param: shape.param.to_owned(), value: shape.value().clone() }
}

/// A position rounded to what the view shows; with Ctrl, to a grid that it shows, and with Shift as well, to the centre
/// of a cell of the world.
fn snapped(modifiers: Modifiers, place: [f64; 2], projection: &Projection<'_>, session: &Session) -> [f64; 2] {
    if modifiers.command && modifiers.shift {
        let world = session.document().world();
        return [0, 1].map(|axis| {
            let cell_m = world.size[axis] / f64::from(world.cells[axis]);
            ((place[axis] / cell_m).floor() + 0.5) * cell_m
        });
    }
    if modifiers.command {
        let grid_m = scale::round_below(24.0 * projection.metres);
        return place.map(|metres| (metres / grid_m).round() * grid_m);
    }
    projection.rounded(place)
}

/// The menu of nodes with a line, which are added after the shown terrain or beside the graph.
fn new_line(ui: &mut Ui, session: &mut Session) {
    ui.menu_button("New ⏷", |ui| {
        let kinds: Vec<_> = session.document().registry().listed().filter(|node| shape::has_line(node)).collect();
        for kind in kinds {
            let plain = std::iter::once((New::of(kind), kind.summary));
            for (new, what) in plain.chain(recipes::of(kind)) {
                if ui.button(new.name).on_hover_text(what).clicked() {
                    insert::add(session, new);
                    ui.close();
                }
            }
        }
    })
    .response
    .on_hover_text("Add a node with a line to draw");
}
