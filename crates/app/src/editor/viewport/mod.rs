//! The viewport: the shown output as a map or in 3D, with the value under the pointer.

mod brush;
mod camera;
mod draw;
mod hands;
mod insert;
mod landscape;
mod layers;
mod legend;
mod lines;
mod live;
mod look;
mod map;
mod near;
mod painter;
mod profile;
mod scale;
mod shown;
mod split;
mod surface;
mod surroundings;
mod tool_bar;
mod views;

use std::path::Path;

use egui::{
    PopupCloseBehavior, Vec2,
    containers::menu::{MenuButton, MenuConfig},
};
use orograph_graph::Window;
use orograph_nodes::raster;

use self::{
    brush::Brush,
    draw::{Draw, Projection},
    hands::Hands,
    landscape::Landscape,
    legend::Legend,
    look::Look,
    map::{Map, Marks},
    painter::Painter,
    profile::Profile,
    shown::{Shown, counterpart, finer, measured, ports, shown},
    surface::{Parts, Surface},
    surroundings::Surroundings,
    tool_bar::ToolBar,
    views::{Chosen, Views},
};
pub(super) use self::{draw::has_keyboard, map::label};
use super::{
    Session,
    window::{
        actions::{self, Action, Part, Status},
        names::Named as _,
        state,
    },
};
use crate::view::ViewError;

/// The stored choice of the navigation, and its text for that of Blender.
const NAVIGATION: &str = "navigation";
const BLENDER: &str = "blender";

/// Returns true for keys that other widgets use too.
const fn moves_camera(action: Action) -> bool {
    matches!(action, Action::Turn(_) | Action::Pan(_) | Action::Closer | Action::Farther)
}

/// Points that an arrow key moves the camera or the map by.
const STEP: f32 = 24.0;

/// Minimum width of a saved picture in pixels.
const PICTURE_WIDTH: u32 = 1920;

/// The display mode of the viewport.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// The 3D view.
    Terrain,
    /// The map, with elevation tints and light from the north-west.
    Map,
}

/// The function of a click or a drag in the viewport.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tool {
    /// Moves the camera.
    Look,
    /// Measures along a line.
    Measure,
    /// Paints.
    Brush,
    /// Draws points of the selected node.
    Draw,
}

/// The viewport.
pub(super) struct Viewport {
    mode: Mode,
    tool: Tool,
    /// True if contour lines are drawn.
    contours: bool,
    look: Look,
    /// The 3D view, or why there is none.
    landscape: Result<Landscape, ViewError>,
    map: Map,
    other: Painter,
    painter: Painter,
    /// The pictures of the finer parts, of each side.
    finer: [Painter; 2],
    legends: [Legend; 2],
    profile: Profile,
    brush: Brush,
    draw: Draw,
    live: live::Bar,
    views: Views,
    /// True if the camera is moved as in Blender.
    blender: bool,
    tool_bar: ToolBar,
}

impl Viewport {
    /// A viewport that draws with the window's device. Without a device it shows maps only.
    pub(super) fn new(state: Option<&eframe::egui_wgpu::RenderState>) -> Self {
        let landscape = state.ok_or(ViewError::NoAdapter).and_then(Landscape::new);
        Self {
            mode: if landscape.is_ok() { Mode::Terrain } else { Mode::Map },
            tool: Tool::Look,
            contours: false,
            look: Look::default(),
            landscape,
            map: Map::default(),
            other: Painter::default(),
            painter: Painter::default(),
            finer: <[Painter; 2]>::default(),
            legends: <[Legend; 2]>::default(),
            profile: Profile::default(),
            brush: Brush::default(),
            draw: Draw::default(),
            live: live::Bar::default(),
            views: Views::default(),
            blender: state::read(NAVIGATION).is_some_and(|text| text.trim() == BLENDER),
            tool_bar: ToolBar::default(),
        }
    }

    /// The state of the document of the drawn terrain, and its cells along the longer side. Returns None while an
    /// intermediate result is drawn.
    pub(super) fn seen(&self) -> Option<(u64, u32)> {
        match (self.mode, &self.landscape) {
            (Mode::Terrain, Ok(landscape)) => landscape.seen(),
            _ => self.painter.seen(),
        }
    }

    /// The window of the finer part, of the current state of the document, that is drawn over the shown output.
    pub(super) fn finer(&self, session: &Session) -> Option<Window> {
        if let (Mode::Terrain, Ok(landscape)) = (self.mode, &self.landscape) {
            return landscape.finer(session.revision());
        }
        self.finer[0].part(&session.shown()?, session.revision()).map(|(_, window)| *window)
    }

    /// Returns true while the newest result of a shown output is not drawn yet.
    pub(super) fn is_drawing(&self, session: &Session) -> bool {
        let shown_port = session.shown();
        let ports = [shown_port.as_deref(), session.compared()];
        let both = ports.map(|port| port.and_then(|port| Some((port, shown(session, port)?))));
        let sides = both.iter().zip([&self.painter, &self.other]);
        sides.enumerate().any(|(side, (shown, painter))| {
            let Some((port, shown)) = shown else { return false };
            let other = both[1 - side].as_ref().map(|(_, other)| other);
            match (self.mode, &self.landscape) {
                (Mode::Terrain, Ok(landscape)) => {
                    let surface = Surface::of(session, &Parts::of(session, port, &self.look));
                    surface.is_some_and(|surface| landscape.lacks(side, &surface.key))
                }
                _ => painter.lacks(shown, &Surroundings::of(session, &self.look, shown, other), self.contours),
            }
        })
    }

    pub(super) fn ui(&mut self, ui: &mut egui::Ui, session: &mut Session) {
        let was_close = session.detail().is_some();
        self.keys(ui, session);
        let mut drawn = self.terrain(ui, session);
        // snapshots and level ground have no finer part
        let graph = session.document().graph();
        drawn.iter_mut().for_each(|names| names.retain(|name| graph.port(name).is_ok()));
        let view = match (self.mode, &self.landscape) {
            (Mode::Terrain, Ok(landscape)) => landscape.view(),
            _ => self.map.view(),
        };
        if let Some(wait) = session.look_at(view, &drawn) {
            ui.ctx().request_repaint_after(wait);
        }
        if session.detail().is_some() != was_close {
            ui.ctx().request_repaint();
        }
    }

    /// Carries out the keys of the viewport, if the pointer is over it and no text is typed. Flying has its own keys.
    fn keys(&mut self, ui: &egui::Ui, session: &mut Session) {
        let is_over = ui.rect_contains_pointer(ui.max_rect());
        if !is_over || ui.ctx().text_edit_focused() || egui::Popup::is_any_open(ui.ctx()) {
            return;
        }
        for event in ui.input(|input| input.events.clone()) {
            if let Some(action) = actions::asked_by(Part::Viewport, &event, egui::Modifiers::NONE)
                && self.status(session, action).enabled
                // with them, sliders and handles are moved that have the keyboard
                && !(moves_camera(action) && ui.ctx().memory(|memory| memory.focused().is_some()))
            {
                self.carry_out(action, session);
            }
        }
    }

    /// Draws the shown output. Returns the drawn outputs that can have a finer part, of each side.
    fn terrain(&mut self, ui: &mut egui::Ui, session: &mut Session) -> Vec<Vec<String>> {
        self.bar(ui, session);
        let (in_3d, is_on) = (self.mode == Mode::Terrain, self.tool == Tool::Brush);
        self.brush.reveal(session, &mut self.look.over, in_3d, is_on);
        let port = session.shown();
        let compared = session.compared().map(str::to_owned);
        let parts = [&port, &compared].map(|port| {
            let parts = port.as_deref().map(|port| match self.mode {
                Mode::Terrain => Parts::of(session, port, &self.look),
                Mode::Map => Parts::of_map(session, port, &self.look),
            });
            parts.unwrap_or_default()
        });
        session.also_show(parts.iter().flat_map(Parts::names).collect());
        let Some(shown) = port.as_deref().and_then(|port| shown(session, port)) else {
            let node = port.as_deref().and_then(|port| port.split_once('.')).map(|(node, _)| node);
            let lacks = node.and_then(|node| Some(format!("{node}\n{}", session.node(node).state.lacks()?)));
            let text = match (port, session.is_busy()) {
                _ if lacks.is_some() => lacks.unwrap_or_default(),
                (None, _) => "Add a node to see its terrain here: press Space over the graph.".to_owned(),
                (Some(port), true) => format!("building {port} …"),
                (Some(port), false) => format!("{port} cannot be previewed"),
            };
            let pane = ui.available_rect_before_wrap();
            ui.centered_and_justified(|ui| ui.weak(text));
            self.tool_bar(ui, session, pane);
            self.draw.step(None);
            return Vec::new();
        };
        let compared = compared.and_then(|port| self::shown(session, &port));
        let measured = [Some(&shown), compared.as_ref()].map(|shown| shown.map(|shown| measured(session, shown)));
        let [own, other] = &measured;
        self.profile.panel(ui, own.as_ref().unwrap_or(&shown), other.as_ref());
        let handles = matches!(self.tool, Tool::Look | Tool::Draw);
        let on_handle = handles && self.draw.takes(ui);
        let tool = self.tool != Tool::Look || on_handle;
        let ring = (self.tool == Tool::Brush).then(|| self.brush.radius(session));
        let marks = Marks { line: self.profile.line(), ring, covered: self.tool_bar.height() };
        let sides = [&shown, compared.as_ref().unwrap_or(&shown)];
        let (draw, drawing) = (&mut self.draw, self.tool == Tool::Draw);
        let mut ended = false;
        let pane = ui.available_rect_before_wrap();
        let (pointer, drawn) = match (self.mode, &mut self.landscape) {
            (Mode::Terrain, Ok(landscape)) => {
                let [first, second] = &parts;
                let other = compared.as_ref().and_then(|_| Surface::of(session, second));
                let surface = Surface::of(session, first);
                let near = |surface: &Option<Surface>, parts| surface.as_ref()?.finer(session, parts);
                let parts = [near(&surface, first), near(&other, second)];
                let near = finer(session, &shown);
                let drawables = landscape::Drawables {
                    shown: sides,
                    surfaces: [surface, other],
                    finer: parts,
                    near: near.as_ref(),
                };
                let sea_level = session.document().world().sea_level;
                let how = (&self.look, self.contours, sea_level, Hands { tool, blender: self.blender });
                let mut over = |ui: &egui::Ui, on: (&egui::Response, &egui::Painter), projection: &Projection<'_>| {
                    ended = handles && draw.ui(ui, on, projection, session, drawing);
                    layers::show(ui, on, projection, session, sides[0]);
                };
                let pointer = landscape.ui(ui, drawables, how, marks, &mut over);
                (pointer, vec![first.drawn(), second.drawn()])
            }
            _ => {
                let first = &shown;
                let shown: Vec<&Shown> = std::iter::once(first).chain(&compared).collect();
                let near: Vec<Option<Shown>> = shown.iter().map(|shown| finer(session, shown)).collect();
                let around: Vec<Surroundings> = (0..shown.len())
                    .map(|side| Surroundings::of(session, &self.look, shown[side], shown.get(1 - side).copied()))
                    .collect();
                let mut parts = [map::Finer::default(); 2];
                let painters = [&mut self.painter, &mut self.other].into_iter().zip(&mut self.finer).zip(&mut parts);
                for (side, ((painter, of_part), part)) in painters.take(shown.len()).enumerate() {
                    painter.want(ui.ctx(), shown[side], &around[side], self.contours);
                    let finer = around[side].finer(session);
                    if let Some(near) = near[side].as_ref().filter(|near| near.fresh) {
                        of_part.want_part(ui.ctx(), near, (shown[side], &finer), self.contours);
                    }
                    let picture = of_part.part_in(shown[side], &finer);
                    *part = map::Finer { shown: near[side].as_ref(), picture };
                }
                let pictures = [self.painter.texture(), compared.as_ref().and_then(|_| self.other.texture())];
                // each on its own: if one needs the whole world, the others have finer parts
                let below = around.iter().flat_map(Surroundings::names).map(|port| vec![port]);
                let drawn = shown.iter().map(|shown| vec![shown.port.clone()]).chain(below).collect();
                let mut over = |ui: &egui::Ui, on: (&egui::Response, &egui::Painter), projection: &Projection<'_>| {
                    ended = handles && draw.ui(ui, on, projection, session, drawing);
                    layers::show(ui, on, projection, session, first);
                };
                (self.map.ui(ui, sides, pictures, parts, (tool, marks), &mut over), drawn)
            }
        };
        let mut rest = marks.rest(pane);
        for (legend, shown) in self.legends.iter_mut().zip(std::iter::once(&shown).chain(&compared)) {
            rest.min.y = legend.ui(ui, rest, shown);
        }
        match self.tool {
            Tool::Draw if ended => self.tool = Tool::Look,
            Tool::Look | Tool::Draw => {}
            Tool::Measure => self.profile.drag(&pointer),
            Tool::Brush => self.brush.drag(&pointer, session),
        }
        self.tool_bar(ui, session, pane);
        drawn
    }

    /// The bar of the tool, on the top of the picture.
    fn tool_bar(&mut self, ui: &mut egui::Ui, session: &mut Session, pane: egui::Rect) {
        match self.tool {
            Tool::Draw => self.tool_bar.show(ui, pane, |ui| self.draw.bar(ui, session)),
            Tool::Brush => self.tool_bar.show(ui, pane, |ui| self.brush.bar(ui, session)),
            Tool::Look | Tool::Measure => self.tool_bar.hide(),
        }
    }

    /// Saves a picture of the 3D view, and reports the result.
    pub(super) fn save_picture(&mut self, session: &mut Session, path: &Path) {
        match self.picture(path) {
            Ok([width, height]) => {
                session.note(format!("saved the picture {}, {width} x {height} pixels", path.display()), false);
            }
            Err(why) => session.note(format!("cannot save the picture: {why}"), true),
        }
    }

    fn picture(&mut self, path: &Path) -> Result<[u32; 2], String> {
        let landscape = self.landscape.as_mut().map_err(|trouble| landscape::explain(trouble))?;
        if self.mode != Mode::Terrain {
            return Err("a picture shows the 3D view; switch the viewport to 3D first".to_owned());
        }
        let (codes, size) = landscape.picture(PICTURE_WIDTH)?;
        let picture = crate::export::picture::of_codes(&codes, size);
        raster::write_colour(path, &picture, &|| true).map_err(|error| error.to_string())?;
        Ok(size)
    }

    /// Moves the keyboard to the next or the previous handle of the selected node.
    pub(super) fn step_handle(&mut self, forward: bool) {
        if matches!(self.tool, Tool::Measure | Tool::Brush) {
            self.tool = Tool::Look;
        }
        self.draw.step(Some(forward));
    }

    /// Whether an action is available, and whether it is on.
    pub(super) fn status(&self, session: &Session, action: Action) -> Status {
        let terrain = self.landscape.as_ref().ok().filter(|_| self.mode == Mode::Terrain);
        let in_3d = |on| Status::switch(terrain.is_some(), on);
        match action {
            Action::View3d => Status::switch(self.landscape.is_ok(), self.mode == Mode::Terrain),
            Action::Map => Status::switch(true, self.mode == Mode::Map),
            Action::Fly => in_3d(terrain.is_some_and(Landscape::is_flying)),
            Action::Contours => Status::switch(true, self.contours),
            Action::Measure => Status::switch(true, self.tool == Tool::Measure),
            Action::Brush => Status::switch(true, self.tool == Tool::Brush),
            Action::Draw => Status::switch(true, self.tool == Tool::Draw),
            Action::Blender => Status::switch(true, self.blender),
            Action::Compare => {
                let on = session.compared().is_some();
                Status::switch(on || !session.document().nodes().is_empty(), on)
            }
            // with the brush, these keys change its radius
            Action::DividerLeft | Action::DividerRight => {
                Status::can(session.compared().is_some() && self.tool != Tool::Brush)
            }
            Action::Turn(_) | Action::Pan(_) | Action::Closer | Action::Farther => {
                Status::can(session.shown().is_some() && !terrain.is_some_and(Landscape::is_flying))
            }
            Action::Sea if session.document().world().sea_level.is_none() => Status::switch(false, false),
            // the map has water too
            Action::Water => Status::switch(session.shown().is_some(), self.look.switched(action).unwrap_or(false)),
            _ => self.look.switched(action).map_or(Status::can(session.shown().is_some()), in_3d),
        }
    }

    /// Carries out an action.
    pub(super) fn carry_out(&mut self, action: Action, session: &mut Session) {
        let on = !self.status(session, action).on.unwrap_or(false);
        match action {
            Action::View3d if self.landscape.is_ok() => self.mode = Mode::Terrain,
            Action::Map => self.mode = Mode::Map,
            Action::FitView => {
                self.map.fit();
                if let Ok(landscape) = &mut self.landscape {
                    landscape.fit();
                }
            }
            Action::Turn(way) => self.step(-STEP * way.vector(), Vec2::ZERO, 0.0),
            Action::Pan(way) => self.step(Vec2::ZERO, -STEP * way.vector(), 0.0),
            Action::Closer => self.step(Vec2::ZERO, Vec2::ZERO, 1.0),
            Action::Farther => self.step(Vec2::ZERO, Vec2::ZERO, -1.0),
            Action::DividerLeft | Action::DividerRight => {
                let by = if action == Action::DividerLeft { -0.02 } else { 0.02 };
                match (self.mode, &mut self.landscape) {
                    (Mode::Terrain, Ok(landscape)) => landscape.move_divider(by),
                    _ => self.map.move_divider(by),
                }
            }
            Action::Fly => {
                if let Ok(landscape) = &mut self.landscape {
                    landscape.fly(on, self.look.exaggeration());
                }
            }
            Action::Contours => self.contours = on,
            Action::Blender => {
                self.blender = on;
                state::write(NAVIGATION, if on { BLENDER } else { "orograph" });
            }
            Action::Measure | Action::Brush | Action::Draw => {
                let tool = match action {
                    Action::Brush => Tool::Brush,
                    Action::Draw => Tool::Draw,
                    _ => Tool::Measure,
                };
                self.tool = if on { tool } else { Tool::Look };
                self.profile.clear();
                // a drag with the tool that is left ends here, or the next one would replace it
                session.end_gesture();
                self.draw.end(session);
            }
            Action::Compare => {
                let own = session.shown();
                let other = own.as_deref().filter(|_| on).and_then(|own| counterpart(session, own));
                session.compare(other);
            }
            _ => self.look.switch(action),
        }
    }

    /// Moves the camera, or the map, as a drag by so many points and so many notches of the wheel would.
    fn step(&mut self, turn: Vec2, pan: Vec2, notches: f64) {
        match (self.mode, &mut self.landscape) {
            (Mode::Terrain, Ok(landscape)) => landscape.step(turn, pan, notches, self.look.exaggeration()),
            _ => {
                self.map.drag(turn + pan);
                self.map.zoom((0.25 * notches).exp2());
            }
        }
    }

    /// A button that switches an action on or off.
    fn toggle(&mut self, ui: &mut egui::Ui, session: &mut Session, action: Action, name: &str) {
        let mut on = self.status(session, action).on.unwrap_or(false);
        if ui.toggle_value(&mut on, name).on_hover_text(action.what()).changed() {
            self.carry_out(action, session);
        }
    }

    /// The menu of saved views.
    fn views(&mut self, ui: &mut egui::Ui, session: &Session) {
        let Ok(landscape) = &mut self.landscape else { return };
        let exaggeration = self.look.exaggeration();
        let now = landscape.orbit(exaggeration);
        let chosen = ui.menu_button("Views", |ui| self.views.menu(ui, session, now)).inner.flatten();
        match chosen {
            Some(Chosen::Towards(direction)) => landscape.look_towards(direction, exaggeration),
            Some(Chosen::View(orbit)) => landscape.look_from(orbit),
            None => {}
        }
    }

    /// The tool bar above the terrain.
    fn bar(&mut self, ui: &mut egui::Ui, session: &mut Session) {
        ui.horizontal_wrapped(|ui| {
            ui.add_enabled_ui(self.landscape.is_ok(), |ui| ui.selectable_value(&mut self.mode, Mode::Terrain, "3D"));
            ui.selectable_value(&mut self.mode, Mode::Map, "Map");
            ui.separator();
            outputs(ui, session);
            ui.separator();
            for action in [Action::Contours, Action::Measure, Action::Brush, Action::Draw] {
                self.toggle(ui, session, action, action.name());
            }
            self.toggle(ui, session, Action::Compare, "A|B");
            compared(ui, session);
            live::toggle(ui, session);
            if ui.button(Action::FitView.name()).on_hover_text(Action::FitView.what()).clicked() {
                self.carry_out(Action::FitView, session);
            }
            if self.mode == Mode::Terrain && self.landscape.is_ok() {
                self.toggle(ui, session, Action::Fly, Action::Fly.name());
                let stays = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
                MenuButton::new("Look").config(stays).ui(ui, |ui| self.look.menu(ui, session));
                self.views(ui, session);
            }
        });
        if let Err(trouble) = &self.landscape {
            let why = egui::RichText::new(format!("No 3D view: {}", landscape::explain(trouble)));
            ui.add(egui::Label::new(why.small().color(ui.visuals().warn_fg_color)).wrap());
        }
        self.live.bar(ui, session);
    }
}

/// The list of outputs to show.
fn outputs(ui: &mut egui::Ui, session: &mut Session) {
    let shown = session.shown();
    let mut pinned = session.pinned().is_some();
    let mut chosen = None;
    let list =
        egui::ComboBox::from_id_salt("shown").selected_text(shown.as_deref().unwrap_or("No output")).width(140.0);
    let list = list.show_ui(ui, |ui| {
        for (port, _) in ports(session) {
            if ui.selectable_label(shown.as_ref() == Some(&port), &port).clicked() {
                chosen = Some(port);
            }
        }
    });
    let _ = list.response.named("shown output");
    if let Some(port) = chosen {
        session.pin(Some(port));
    } else if ui
        .toggle_value(&mut pinned, "Pin")
        .on_hover_text("Pin to viewport: keep showing this output whatever is selected")
        .changed()
    {
        session.pin(shown.filter(|_| pinned));
    }
}

/// The list of outputs to compare with.
fn compared(ui: &mut egui::Ui, session: &mut Session) {
    if let Some(mut port) = session.compared().map(str::to_owned) {
        let before = port.clone();
        let list = egui::ComboBox::from_id_salt("compared").selected_text(&port).width(120.0).show_ui(ui, |ui| {
            let kept = session.snapshots().iter().map(|snapshot| snapshot.name().to_owned());
            for other in ports(session).into_iter().map(|(other, _)| other).chain(kept) {
                let name = other.clone();
                ui.selectable_value(&mut port, other, name);
            }
        });
        let _ = list.response.named("compared output");
        if port != before {
            session.compare(Some(port));
        }
    }
}
