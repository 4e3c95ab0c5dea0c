//! The 3D view in the viewport.

use std::sync::{
    Arc,
    mpsc::{Receiver, TryRecvError, channel},
};

use eframe::{egui_wgpu::RenderState, wgpu};
use egui::{Align2, Color32, CursorIcon, Pos2, Rect, Sense, Stroke, TextureId, Vec2, pos2, vec2};

use orograph_graph::Window;

use super::{
    Shown,
    draw::Projection,
    hands::{Hands, Navigation, move_eye},
    look::Look,
    map::{Marks, Over, Pointer, cell, label, readout, travelled},
    near::Near,
    scale,
    split::Split,
    surface::{Colour, Key, Surface},
};
use crate::{
    editor::{session::View, window::names::Named as _},
    export::picture,
    view::{self, Camera, Cover, Fly, Orbit, Ray, Renderer, Scene, Terrain, ViewError},
};

/// The texture holds sRGB codes in a linear format, as egui expects.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// The 3D view, with its camera.
pub(super) struct Landscape {
    state: RenderState,
    sides: [Side; 2],
    eye: Option<Navigation>,
    /// True once you have moved the camera.
    moved: bool,
    /// The extent of the terrain for which the camera was placed.
    size_m: [f64; 2],
    split: Split,
    /// Pixels per point in the last frame.
    scale: f32,
    /// The visible part of the world in the last frame.
    view: Option<View>,
}

/// One of the two terrains of a comparison.
struct Side {
    renderer: Renderer,
    /// The terrain that the renderer has.
    has: Option<Key>,
    /// A terrain that is being prepared on another thread.
    work: Option<(Key, Receiver<Result<Terrain, ViewError>>)>,
    /// Its finer part.
    near: Near,
    target: Option<Target>,
    /// The content of the texture.
    drawn: Option<Drawn>,
    trouble: Option<ViewError>,
}

/// The content of a texture; an equal one need not be drawn again.
#[derive(PartialEq)]
struct Drawn {
    terrain: Key,
    /// The window of the finer part.
    finer: Option<Window>,
    scene: Scene,
}

/// What the view draws: one output, or two side by side.
pub(super) struct Drawables<'a> {
    /// The samples of the outputs.
    pub(super) shown: [&'a Shown; 2],
    /// Their terrains.
    pub(super) surfaces: [Option<Surface>; 2],
    /// The finer parts near the camera.
    pub(super) finer: [Option<Surface>; 2],
    /// The finer samples of the first output.
    pub(super) near: Option<&'a Shown>,
}

/// A render texture that is registered with egui.
struct Target {
    size: [u32; 2],
    view: wgpu::TextureView,
    id: TextureId,
}

impl Landscape {
    /// A 3D view on the window's device.
    pub(super) fn new(state: &RenderState) -> Result<Self, ViewError> {
        let first = Renderer::new(&state.device, &state.queue, FORMAT)?;
        let second = first.sibling()?;
        let side = |renderer| Side {
            renderer,
            has: None,
            work: None,
            near: Near::default(),
            target: None,
            drawn: None,
            trouble: None,
        };
        Ok(Self {
            state: state.clone(),
            sides: [side(first), side(second)],
            eye: None,
            moved: false,
            size_m: [0.0; 2],
            split: Split::default(),
            scale: 1.0,
            view: None,
        })
    }

    /// The visible part of the world in the last frame.
    pub(super) const fn view(&self) -> Option<View> {
        self.view
    }

    /// The state of the document that is drawn, and its cells along the longer side.
    pub(super) fn seen(&self) -> Option<(u64, u32)> {
        self.sides[0].drawn.as_ref().and_then(|drawn| drawn.terrain.age())
    }

    /// Returns true if a side does not draw this terrain, and can draw it.
    pub(super) fn lacks(&self, side: usize, key: &Key) -> bool {
        let Side { drawn, trouble, .. } = &self.sides[side];
        trouble.is_none() && drawn.as_ref().is_none_or(|drawn| drawn.terrain != *key)
    }

    /// The window of the finer part, if the drawn terrain has this state of the document.
    pub(super) fn finer(&self, revision: u64) -> Option<Window> {
        let drawn = self.sides[0].drawn.as_ref()?;
        drawn.finer.filter(|_| drawn.terrain.age().is_some_and(|(of, _)| of == revision))
    }

    /// Fits the whole terrain into the view.
    pub(super) fn fit(&mut self) {
        (self.eye, self.moved) = (None, false);
    }

    /// Draws the current view again, at least `width` pixels wide. Returns sRGB codes and the size in pixels.
    pub(super) fn picture(&mut self, width: u32) -> Result<(Vec<u8>, [u32; 2]), String> {
        let side = &mut self.sides[0];
        let (Some(Drawn { scene, .. }), Some(target)) = (&side.drawn, &side.target) else {
            return Err("no terrain is shown".to_owned());
        };
        let most = self.state.device.limits().max_texture_dimension_2d;
        let longest = target.size.into_iter().max().unwrap_or(1);
        let factor = (f64::from(width) / f64::from(target.size[0])).clamp(1.0, f64::from(most) / f64::from(longest));
        let size = target.size.map(|pixels| (f64::from(pixels) * factor).round().max(1.0) as u32);
        let drawn = view::drawn(&self.state.device, &self.state.queue, FORMAT, &mut side.renderer, scene, size);
        drawn.map(|(codes, _)| (codes, size)).map_err(|trouble| explain(&trouble))
    }

    /// The size of the picture in pixels, before the first one 1 by 1.
    fn size(&self) -> [u32; 2] {
        self.sides[0].target.as_ref().map_or([1, 1], |target| target.size)
    }

    /// The current view, around the point in its centre. Returns None without a terrain.
    pub(super) fn orbit(&self, exaggeration: f64) -> Option<Orbit> {
        let terrain = self.sides[0].renderer.terrain()?;
        let size = self.size();
        Some(match &self.eye {
            Some(Navigation::Orbit(orbit)) => *orbit,
            Some(Navigation::Fly(fly)) => fly.orbit(terrain, exaggeration),
            None => Orbit::framing(terrain, exaggeration, size),
        })
    }

    /// Goes to a view.
    pub(super) fn look_from(&mut self, orbit: Orbit) {
        (self.eye, self.moved) = (Some(Navigation::Orbit(orbit)), true);
    }

    /// Shows the whole terrain from a direction: azimuth and elevation of the camera in degrees.
    pub(super) fn look_towards(&mut self, [azimuth_deg, elevation_deg]: [f64; 2], exaggeration: f64) {
        let Some(terrain) = self.sides[0].renderer.terrain() else { return };
        let size = self.size();
        let start = Orbit::framing(terrain, exaggeration, size);
        let orbit = Orbit { azimuth_deg, elevation_deg, ..start }.framed(terrain, exaggeration, size);
        self.look_from(orbit);
    }

    /// Turns, pans, and moves closer by notches of a wheel, as a drag by so many points would.
    pub(super) fn step(&mut self, turn: Vec2, pan: Vec2, notches: f64, exaggeration: f64) {
        let Some(mut orbit) = self.orbit(exaggeration).filter(|_| !self.is_flying()) else { return };
        let size = self.size();
        let pixels = |points: Vec2| [points.x, points.y].map(|points| f64::from(points * self.scale));
        orbit.drag(pixels(turn), size);
        orbit.pan(pixels(pan), size);
        orbit.scroll(notches, None);
        if let Some(terrain) = self.sides[0].renderer.terrain() {
            orbit.limit(terrain, exaggeration);
        }
        self.look_from(orbit);
    }

    /// Moves the divider of a comparison by a fraction of the width.
    pub(super) fn move_divider(&mut self, by: f32) {
        self.split.step(by);
    }

    /// Returns true in fly mode.
    pub(super) const fn is_flying(&self) -> bool {
        matches!(self.eye, Some(Navigation::Fly(_)))
    }

    /// Switches to fly mode, or back to orbiting the point in the centre of the view.
    pub(super) fn fly(&mut self, fly: bool, exaggeration: f64) {
        let Some(terrain) = self.sides[0].renderer.terrain() else { return };
        let size = self.size();
        let eye = self.eye.take().unwrap_or_else(|| Navigation::Orbit(Orbit::framing(terrain, exaggeration, size)));
        self.moved = true;
        self.eye = match Some(eye) {
            Some(Navigation::Orbit(orbit)) if fly => Some(Navigation::Fly(Fly::from_orbit(&orbit))),
            Some(Navigation::Fly(fly_eye)) if !fly => Some(Navigation::Orbit(fly_eye.orbit(terrain, exaggeration))),
            eye => eye,
        };
    }

    /// Draws the terrain of one output, or of two side by side, each with its finer part.
    pub(super) fn ui(
        &mut self,
        ui: &mut egui::Ui,
        Drawables { shown, surfaces, finer, near }: Drawables<'_>,
        (look, contours, sea_level, hands): (&Look, bool, Option<f64>, Hands),
        marks: Marks,
        over: Over<'_>,
    ) -> Pointer {
        let (response, painter) = ui.allocate_painter(ui.available_size(), Sense::click_and_drag());
        let response = response.named("view of the terrain");
        let pane = response.rect;
        let scale = ui.ctx().pixels_per_point();
        self.scale = scale;
        let size = [pane.width(), pane.height()].map(|points| (points * scale).round().max(1.0) as u32);
        let both = surfaces[1].is_some();
        for (side, surface) in self.sides.iter_mut().zip(surfaces) {
            if let Some(surface) = surface {
                side.want(ui.ctx(), surface);
            }
        }
        for (side, surface) in self.sides.iter_mut().zip(finer) {
            side.want_finer(ui.ctx(), surface);
        }
        let Some(terrain) = self.sides[0].renderer.terrain().cloned() else {
            let text = self.sides[0].trouble.as_ref().map_or_else(|| "…".to_owned(), ToString::to_string);
            painter.text(
                pane.center(),
                Align2::CENTER_CENTER,
                text,
                egui::FontId::proportional(13.0),
                ui.visuals().weak_text_color(),
            );
            return Pointer::default();
        };
        let exaggeration = look.exaggeration();
        if self.size_m != terrain.size_m() {
            (self.size_m, self.eye, self.moved) = (terrain.size_m(), None, false);
        }
        let start = || Navigation::Orbit(Orbit::framing(&terrain, exaggeration, size));
        let mut eye = self.eye.take().unwrap_or_else(start);
        let edge = both.then(|| self.split.ui(ui, pane));
        let before = eye.camera();
        move_eye(ui, &response, &mut eye, &terrain, exaggeration, (size, scale, hands));
        let tool = hands.tool;
        let camera = eye.camera();
        self.view = in_view(&terrain, &eye, exaggeration, size);
        // Until you move the camera or use a tool, a resize of the window or a change of the terrain fits the whole terrain
        // into the view again.
        self.eye = Some(eye).filter(|eye| self.moved || tool || camera != before || matches!(eye, Navigation::Fly(_)));
        self.moved = self.eye.is_some();

        for side in 0..if both { 2 } else { 1 } {
            let Some(drawn) = self.sides[side].renderer.terrain() else { continue };
            let scene = look.scene(camera, drawn, contours, sea_level);
            self.sides[side].draw(&self.state, size, &scene);
            let Some(target) = &self.sides[side].target else { continue };
            let clip = super::split::half(pane, edge, side);
            let unit = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            painter.with_clip_rect(clip).image(target.id, pane, unit, Color32::WHITE);
        }
        if let Some(x) = edge {
            super::split::draw(&painter, marks.rest(pane), x, shown.map(Shown::name));
        }
        if let Some(trouble) = self.sides.iter().find_map(|side| side.trouble.as_ref()) {
            label(
                &painter,
                marks.rest(pane).left_top() + vec2(10.0, 10.0),
                Align2::LEFT_TOP,
                &format!("{trouble}: {}", trouble.remedy()),
            );
        }

        let to_pixel = |at: Pos2| [f64::from((at.x - pane.left()) * scale), f64::from((at.y - pane.top()) * scale)];
        let inset = self.sides[0].renderer.inset();
        let cast = |ray: Ray| match inset {
            Some(inset) => inset.cast(&terrain, &ray, exaggeration),
            None => terrain.cast(&ray, exaggeration),
        };
        let hit = |at: Pos2| cast(camera.ray(to_pixel(at), size));
        let held = response.is_pointer_button_down_on() && ui.input(|input| input.pointer.primary_down());
        let pressed = tool && held;
        let at = response.interact_pointer_pos().filter(|_| pressed).or_else(|| response.hover_pos());
        let place = at.and_then(hit).map(|hit| hit.place);
        let mut path = Vec::new();
        if tool {
            path = travelled(ui, &response).into_iter().filter_map(hit).map(|hit| hit.place).collect();
            response.clone().on_hover_cursor(CursorIcon::Crosshair);
        }
        let on_screen = |[x, y]: [f64; 2]| {
            let up = inset.map_or_else(|| terrain.height_at([x, y]), |inset| inset.height_at(&terrain, [x, y]))
                * exaggeration;
            let [px, py] = camera.pixel(glam::DVec3::new(x, up, y), size)?;
            Some(pane.min + vec2(px as f32, py as f32) / scale)
        };
        let projection = Projection {
            to_screen: &on_screen,
            to_world: &|at| hit(at).map(|hit| hit.place),
            metres: self.view.map_or(1.0, |view| view.pixel_m * f64::from(scale)),
        };
        over(ui, (&response, &painter), &projection);
        if let Some([a, b]) = marks.line {
            let place = |share: f64| on_screen([0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis])));
            let points: Vec<Pos2> = (0..=120).filter_map(|step| place(f64::from(step) / 120.0)).collect();
            painter.line(points.clone(), Stroke::new(3.0, Color32::from_black_alpha(160)));
            painter.line(points, Stroke::new(1.5, Color32::from_rgb(255, 214, 64)));
        }
        if let (Some(radius), Some([x, y])) = (marks.ring, place) {
            let place = |turn: f64| on_screen([x + radius * turn.cos(), y + radius * turn.sin()]);
            let points: Vec<Pos2> =
                (0..=64).filter_map(|step| place(f64::from(step) * std::f64::consts::TAU / 64.0)).collect();
            painter.line(points, Stroke::new(1.5, Color32::WHITE));
        }
        if let Some(place) = place {
            let near = near.filter(|near| inset.is_some() && cell(near, place).is_some());
            let text = readout(near.unwrap_or(shown[0]), place);
            label(&painter, pane.right_bottom() - vec2(10.0, 10.0), Align2::RIGHT_BOTTOM, &text);
        }
        compass(&painter, pane, &camera);
        if let Some(view) = self.view.filter(|_| pane.width() >= 320.0 && pane.height() >= 120.0) {
            let beside = Rect::from_min_max(pane.min + vec2(58.0, 0.0), pane.max);
            scale::bar(&painter, beside, view.pixel_m * f64::from(scale), " in the centre");
        }
        if !shown[0].fresh {
            let corner = Rect::from_min_size(marks.rest(pane).right_top() + vec2(-30.0, 10.0), vec2(20.0, 20.0));
            ui.put(corner, egui::Spinner::new().size(18.0));
        }
        Pointer { place, pressed, path }
    }
}

/// A square part of the world around the terrain in the centre of the picture, as wide as the picture is there. If the
/// centre shows the sky in fly mode, the search continues below the centre.
fn in_view(terrain: &Terrain, eye: &Navigation, exaggeration: f64, size: [u32; 2]) -> Option<View> {
    let camera = eye.camera();
    let middle = size.map(|pixels| f64::from(pixels) / 2.0);
    let below = [1.0, 1.25, 1.5, 1.75].map(|down| [middle[0], middle[1] * down]);
    let places = if matches!(eye, Navigation::Fly(_)) { &below[..] } else { &below[..1] };
    let hit = places.iter().find_map(|pixel| terrain.cast(&camera.ray(*pixel, size), exaggeration))?;
    let half = camera.half_extent(size).map(|extent| extent * hit.distance);
    let half_m = half[0].max(half[1]);
    let part = [-half_m, half_m].map(|by| hit.place.map(|place| place + by));
    Some(View { part, pixel_m: half[1] / middle[1] })
}

/// The error and its remedy, as one message.
pub(super) fn explain(trouble: &ViewError) -> String {
    format!("{trouble}; {}", trouble.remedy())
}

/// Draws an arrow to the north.
fn compass(painter: &egui::Painter, pane: Rect, camera: &Camera) {
    let north = glam::DVec3::NEG_Z;
    let flat = glam::DVec2::new(north.dot(camera.right()), north.dot(camera.up()) + north.dot(camera.forward) * 0.5);
    if pane.width() < 160.0 || pane.height() < 120.0 {
        return;
    }
    let way = flat.normalize_or_zero() * 16.0;
    let centre = pane.left_bottom() + vec2(32.0, -32.0);
    painter.circle_filled(centre, 22.0, Color32::from_black_alpha(110));
    let tip = vec2(way.x as f32, -way.y as f32);
    painter.arrow(centre - tip * 0.7, tip * 1.4, Stroke::new(1.5, Color32::from_rgb(230, 90, 70)));
    painter.text(centre + tip * 1.05, Align2::CENTER_CENTER, "N", egui::FontId::proportional(11.0), Color32::WHITE);
}

impl Side {
    /// Requests a terrain; the previous one stays until it is ready.
    fn want(&mut self, context: &egui::Context, surface: Surface) {
        if let Some((key, terrain)) = self.work.take() {
            match terrain.try_recv() {
                Ok(terrain) => {
                    let set = terrain.and_then(|terrain| self.renderer.set_terrain(Arc::new(terrain)));
                    self.trouble = set.err();
                    self.has = Some(key);
                    self.near.forget();
                }
                Err(TryRecvError::Empty) => self.work = Some((key, terrain)),
                Err(TryRecvError::Disconnected) => {}
            }
        }
        if self.work.is_some() || self.has.as_ref() == Some(&surface.key) {
            return;
        }
        let (outbox, inbox) = channel();
        let (context, key) = (context.clone(), surface.key.clone());
        rayon::spawn(move || {
            // Ignored: the receiver is gone once the window is closed.
            let _ = outbox.send(terrain(&surface));
            context.request_repaint();
        });
        self.work = Some((key, inbox));
    }

    /// Requests the finer part of the terrain; None removes it.
    fn want_finer(&mut self, context: &egui::Context, surface: Option<Surface>) {
        let surface = surface.filter(|surface| self.has.as_ref() == Some(&surface.key));
        if let Err(trouble) = self.near.want(context, &mut self.renderer, surface) {
            self.trouble = Some(trouble);
        }
    }

    /// Draws the terrain if the content of the texture has changed.
    fn draw(&mut self, state: &RenderState, size: [u32; 2], scene: &Scene) {
        let Some(terrain) = self.has.clone() else { return };
        let now = Drawn { terrain, finer: self.near.window(), scene: scene.clone() };
        let fits = self.target.as_ref().is_some_and(|target| target.size == size);
        if fits && self.drawn.as_ref() == Some(&now) {
            return;
        }
        if !fits {
            self.target = Some(Target::new(state, size, self.target.take()));
        }
        let Some(target) = &self.target else { return };
        let mut encoder = state.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("land") });
        match self.renderer.draw(&mut encoder, &target.view, size, scene) {
            Ok(_) => {
                state.queue.submit([encoder.finish()]);
                self.drawn = Some(now);
            }
            Err(trouble) => self.trouble = Some(trouble),
        }
    }
}

impl Target {
    fn new(state: &RenderState, [width, height]: [u32; 2], before: Option<Self>) -> Self {
        let texture = state.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("land"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut renderer = state.renderer.write();
        let filter = wgpu::FilterMode::Linear;
        let id = match before {
            Some(before) => {
                renderer.update_egui_texture_from_wgpu_texture(&state.device, &view, filter, before.id);
                before.id
            }
            None => renderer.register_native_texture(&state.device, &view, filter),
        };
        Self { size: [width, height], view, id }
    }
}

/// Prepares a terrain for drawing.
pub(super) fn terrain(surface: &Surface) -> Result<Terrain, ViewError> {
    let colour = surface
        .colour
        .as_ref()
        .map(|Colour { field, ty, whole }| picture::of_part(field, *ty, picture::Around::whole(whole)));
    let lines = surface.lines.as_ref().map(|lines| view::coverage(lines, surface.height.window()));
    let cover = Cover {
        colour: colour.as_ref(),
        water: surface.water.as_ref(),
        mask: surface.mask.as_ref(),
        lines: lines.as_ref(),
    };
    Terrain::new(&surface.height)?.covered(cover)
}
