//! The map: the terrain from above.

use egui::{
    Align2, Color32, CursorIcon, Event, FontId, PointerButton, Pos2, Rect, Sense, Stroke, TextureHandle, Vec2, pos2,
    vec2,
};
use orograph_graph::{Field, PortType, Unit, Window};

use super::{
    Shown,
    camera::Camera,
    draw::Projection,
    lines, scale,
    split::{self, Split},
};
use crate::editor::{session::View, window::names::Named as _};

/// A line between two positions in metres.
pub(super) type Line = [[f64; 2]; 2];

/// The pointer in the viewport.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Pointer {
    /// Its position, in metres of the world.
    pub(super) place: Option<[f64; 2]>,
    /// True if the primary button is pressed and belongs to a tool.
    pub(super) pressed: bool,
    /// Its path with the button pressed since the last frame, up to the release.
    pub(super) path: Vec<[f64; 2]>,
}

/// The path of the pointer with the primary button pressed since the last frame. Events are read because one frame can
/// have several.
pub(super) fn travelled(ui: &egui::Ui, response: &egui::Response) -> Vec<Pos2> {
    let id = response.id.with("held");
    let was = ui.data(|data| data.get_temp(id)).unwrap_or(false);
    if !(was || response.is_pointer_button_down_on() || response.drag_stopped() || response.clicked()) {
        return Vec::new();
    }
    let (mut held, mut path) = (was, Vec::new());
    ui.input(|input| {
        for event in &input.events {
            match *event {
                Event::PointerMoved(at) if held => path.push(at),
                Event::PointerButton { pos, button: PointerButton::Primary, pressed, .. } if held || pressed => {
                    path.push(pos);
                    held = pressed;
                }
                _ => {}
            }
        }
    });
    ui.data_mut(|data| data.insert_temp(id, held));
    path
}

/// Draws over the terrain, and lets its handles be moved.
pub(super) type Over<'a> = &'a mut dyn FnMut(&egui::Ui, (&egui::Response, &egui::Painter), &Projection<'_>);

/// Marks drawn over the terrain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Marks {
    /// The measured line.
    pub(super) line: Option<Line>,
    /// Radius of the brush in metres.
    pub(super) ring: Option<f64>,
    /// Height of what covers the top of the picture, in points.
    pub(super) covered: f32,
}

impl Marks {
    /// The part of a pane that nothing covers.
    pub(super) fn rest(&self, pane: Rect) -> Rect {
        Rect::from_min_max(pos2(pane.left(), pane.top() + self.covered), pane.max)
    }
}

/// The map's camera.
#[derive(Debug, Default)]
pub(super) struct Map {
    camera: Option<Camera>,
    /// The extent of the world for which the camera was placed.
    size: [f64; 2],
    split: Split,
    /// The visible part of the world in the last frame.
    view: Option<View>,
    /// The pane in the last frame.
    pane: Option<Rect>,
}

/// The finer part of an output.
#[derive(Clone, Copy, Default)]
pub(super) struct Finer<'a> {
    /// Its samples, once they are built.
    pub(super) shown: Option<&'a Shown>,
    /// Its picture, once it is drawn, and the window that the picture covers.
    pub(super) picture: Option<(&'a TextureHandle, &'a Window)>,
}

impl Map {
    /// The visible part of the world in the last frame.
    pub(super) const fn view(&self) -> Option<View> {
        self.view
    }

    /// Shows the whole world.
    pub(super) const fn fit(&mut self) {
        self.camera = None;
    }

    /// Pans as a drag by points of the screen does.
    pub(super) fn drag(&mut self, by: Vec2) {
        let Some(pane) = self.pane else { return };
        self.camera.get_or_insert_with(|| Camera::fit(self.size, pane)).drag(by);
    }

    /// Zooms around the centre by a factor.
    pub(super) fn zoom(&mut self, factor: f64) {
        let Some(pane) = self.pane else { return };
        let size = self.size;
        self.camera.get_or_insert_with(|| Camera::fit(size, pane)).zoom(pane, pane.center(), factor, size);
    }

    /// Moves the divider of a comparison by a fraction of the width.
    pub(super) fn move_divider(&mut self, by: f32) {
        self.split.step(by);
    }

    /// Draws the map: the first picture, and right of the divider the second, if there are two, each with its finer
    /// part. `tool` is true if the primary button belongs to a tool.
    pub(super) fn ui(
        &mut self,
        ui: &mut egui::Ui,
        shown: [&Shown; 2],
        pictures: [Option<&TextureHandle>; 2],
        finer: [Finer<'_>; 2],
        (tool, marks): (bool, Marks),
        over: Over<'_>,
    ) -> Pointer {
        let (response, painter) = ui.allocate_painter(ui.available_size(), Sense::click_and_drag());
        let response = response.named("map of the terrain");
        let pane = response.rect;
        self.pane = Some(pane);
        let size = shown[0].field.window().world.size;
        if self.size != size {
            (self.size, self.camera) = (size, None);
        }
        let mut camera = self.camera.unwrap_or_else(|| Camera::fit(size, pane));
        painter.rect_filled(pane, 0.0, ui.visuals().extreme_bg_color);
        let edge = pictures[1].map(|_| self.split.ui(ui, pane));

        // The wheel zooms; a drag pans or uses the tool.
        if let Some(at) = response.hover_pos() {
            let (scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            let factor = f64::from((scroll / 240.0).exp2() * pinch);
            if (factor - 1.0).abs() > 1e-6 {
                camera.zoom(pane, at, factor, size);
                self.camera = Some(camera);
            }
        }
        let mut pointer = Pointer::default();
        if tool {
            pointer.pressed = response.is_pointer_button_down_on() && ui.input(|input| input.pointer.primary_down());
            let at = response.interact_pointer_pos().filter(|_| pointer.pressed).or_else(|| response.hover_pos());
            pointer.place = at.map(|at| camera.to_world(pane, at));
            pointer.path = travelled(ui, &response).into_iter().map(|at| camera.to_world(pane, at)).collect();
            response.clone().on_hover_cursor(CursorIcon::Crosshair);
        }
        if response.dragged() && !pointer.pressed {
            camera.drag(response.drag_delta());
            self.camera = Some(camera);
        }
        if response.double_clicked() && !tool {
            self.camera = None;
        }

        let world = camera.world(pane, size);
        for (side, picture) in pictures.into_iter().enumerate() {
            let Some(picture) = picture else { continue };
            let clip = split::half(pane, edge, side);
            let unit = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            painter.with_clip_rect(clip).image(picture.id(), world, unit, Color32::WHITE);
            if let Some((picture, window)) = finer[side].picture {
                let place = camera.window(pane, window);
                painter.with_clip_rect(clip).image(picture.id(), place, unit, Color32::WHITE);
            }
            if let Some((_, lines)) = &shown[side].lines {
                lines::draw(&painter.with_clip_rect(clip.intersect(world)), camera, pane, lines);
            }
        }
        let pixel_m = camera.metres / f64::from(ui.ctx().pixels_per_point());
        let part = [pane.min, pane.max].map(|corner| camera.to_world(pane, corner));
        self.view = Some(View { part, pixel_m });
        if let Some(x) = edge {
            split::draw(&painter, marks.rest(pane), x, shown.map(Shown::name));
        }
        let projection = Projection {
            to_screen: &|place| Some(camera.to_screen(pane, place)),
            to_world: &|at| Some(camera.to_world(pane, at)),
            metres: camera.metres,
        };
        over(ui, (&response, &painter), &projection);
        if let Some([a, b]) = marks.line {
            let ends = [camera.to_screen(pane, a), camera.to_screen(pane, b)];
            painter.line_segment(ends, Stroke::new(3.0, Color32::from_black_alpha(160)));
            painter.line_segment(ends, Stroke::new(1.5, Color32::from_rgb(255, 214, 64)));
            for end in ends {
                painter.circle(end, 4.0, Color32::from_rgb(255, 214, 64), Stroke::new(1.0, Color32::BLACK));
            }
        }
        if let (Some(radius), Some(place)) = (marks.ring, pointer.place) {
            let radius = (radius / camera.metres) as f32;
            painter.circle_stroke(camera.to_screen(pane, place), radius, Stroke::new(1.5, Color32::WHITE));
        }
        scale::bar(&painter, pane, camera.metres, "");
        if let Some(at) = response.hover_pos() {
            let side = usize::from(edge.is_some_and(|x| at.x > x));
            let place = camera.to_world(pane, at);
            let finer = finer[side].shown.filter(|finer| cell(finer, place).is_some());
            let text = readout(finer.unwrap_or(shown[side]), place);
            label(&painter, pane.right_bottom() - vec2(10.0, 10.0), Align2::RIGHT_BOTTOM, &text);
        }
        if !shown[0].fresh {
            let corner = Rect::from_min_size(marks.rest(pane).right_top() + vec2(-30.0, 10.0), vec2(20.0, 20.0));
            ui.put(corner, egui::Spinner::new().size(18.0));
        }
        pointer
    }
}

/// Text on a dark background, over a picture; returns the rectangle of the text.
pub(in crate::editor) fn label(painter: &egui::Painter, at: egui::Pos2, align: Align2, text: &str) -> Rect {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), Color32::WHITE);
    let rect = align.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand2(vec2(6.0, 3.0)), 3.0, Color32::from_black_alpha(150));
    painter.galley(rect.min, galley, Color32::WHITE);
    rect
}

/// The value at a position, as text.
pub(super) fn readout(shown: &Shown, at: [f64; 2]) -> String {
    let [x, y] = at.map(|along| position(shown.field.window().world.size, along));
    let place = format!("x {x}  y {y}");
    match value(shown.ty, &shown.field, at) {
        None => place,
        Some(value) => format!("{place}   {value}"),
    }
}

/// The value of a field at a position, as text. Returns None outside of its window.
pub(super) fn value(ty: PortType, field: &Field, place: [f64; 2]) -> Option<String> {
    let at = cell_at(field, place)?;
    let number = |plane: usize| f64::from(field.plane(plane)[at]);
    Some(match ty {
        PortType::Height | PortType::Mask | PortType::Scalar(_) => short(ty.unit(), number(0)),
        _ => (0..field.planes()).map(|plane| format!("{:.2}", number(plane))).collect::<Vec<_>>().join(" "),
    })
}

/// A number with its unit and four digits.
pub(super) fn short(unit: Unit, value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return unit.display(value);
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    let power = 10_f64.powi(digits);
    let rounded = (value * power).round() / power;
    unit.display(if rounded.is_finite() { rounded } else { value })
}

/// A position along a side of a world, with the same digits everywhere, so that a moving text keeps its width.
fn position(size: [f64; 2], along: f64) -> String {
    match size[0].max(size[1]) {
        10_000.0.. => format!("{:.3} km", along / 1000.0),
        100.0.. => format!("{along:.1} m"),
        _ => format!("{along:.3} m"),
    }
}

/// The index of the cell at a position. Returns None outside the window.
pub(super) fn cell(shown: &Shown, place: [f64; 2]) -> Option<usize> {
    cell_at(&shown.field, place)
}

fn cell_at(field: &Field, place: [f64; 2]) -> Option<usize> {
    let window = field.window();
    window.cell_at(place).map(|[i, j]| j * window.nx() + i)
}
