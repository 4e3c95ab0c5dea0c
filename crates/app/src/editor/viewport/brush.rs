//! The brush: strokes painted on the terrain, stored as a parameter of a node.
//!
//! You can paint on any node with a parameter of kind `Strokes`; no node type is named here. One stroke is one undo
//! step.

use egui::Key;
use orograph_graph::{Edit, Kind, ParamValue, PortType, Stroke, Tool, Unit};

use super::{
    insert::{self, New},
    look::Over,
    map::Pointer,
};
use crate::editor::{Session, arithmetic::typed, window::names::Named as _};

/// The name of a tool, and its tooltip.
const fn describe(tool: Tool, timed: bool) -> (&'static str, &'static str) {
    match tool {
        Tool::Raise => ("Raise", "Raise the terrain"),
        Tool::Lower => ("Lower", "Lower the terrain"),
        Tool::Smooth => ("Smooth", "Smooth the terrain"),
        Tool::Mask => ("Mask", "Add to the mask"),
        Tool::Erase if timed => ("Remove rain", "Remove painted rain"),
        Tool::Erase => ("Erase", "Remove from the mask"),
        Tool::Rain => ("Rain", "Add rain from this time on"),
    }
}

/// The brush settings, and the current stroke.
#[derive(Debug)]
pub(super) struct Brush {
    tool: Tool,
    /// In metres. None until you set it; until then it follows from the size of the world.
    radius: Option<f64>,
    /// Height of a raising or lowering stroke in metres. None for a fraction of the radius.
    metres: Option<f64>,
    /// Strength of rain in millimetres per hour.
    rain: f64,
    /// Strength of the other tools, 0 to 1.
    part: f64,
    hardness: f64,
    stroke: Option<Painting>,
    /// The mask that is shown while its tool is in the hand, and what it hides.
    revealed: Option<(String, Hidden)>,
}

/// What was shown before a mask.
#[derive(Debug)]
enum Hidden {
    /// In 3D: the colours of the terrain.
    Colours(Over),
    /// On the map: the pinned output.
    Pinned(Option<String>),
}

/// The stroke being painted.
#[derive(Debug)]
struct Painting {
    /// The parameter that it is added to.
    canvas: Canvas,
    points: Vec<[f64; 2]>,
    /// True if the document has all of its points.
    laid: bool,
}

impl Default for Brush {
    fn default() -> Self {
        Self {
            tool: Tool::Raise,
            radius: None,
            metres: None,
            rain: Tool::Rain.usual_strength(),
            part: 1.0,
            hardness: Stroke::USUAL_HARDNESS,
            stroke: None,
            revealed: None,
        }
    }
}

/// A parameter that stores strokes, and its node.
#[derive(Debug)]
struct Canvas {
    node: String,
    param: &'static str,
    /// True if each stroke acts at a time of the simulation.
    timed: bool,
    /// The strokes already in the document.
    strokes: Vec<Stroke>,
}

impl Canvas {
    /// The parameter of the selected node, otherwise that of the node that runs live.
    fn of(session: &Session) -> Option<Self> {
        let of_node = |node: &str| Self::of_node(session, node);
        let running = || session.simulation().and_then(|simulation| of_node(simulation.node()));
        session.selected().and_then(of_node).or_else(running)
    }

    fn of_node(session: &Session, node: &str) -> Option<Self> {
        let graph = session.document().graph();
        let instance = graph.instance(graph.find(node).ok()?);
        let mut specs = instance.node.specs().into_iter();
        let (spec, timed) = specs.find_map(|spec| match spec.kind {
            Kind::Strokes { timed, .. } => Some((spec, timed)),
            _ => None,
        })?;
        let strokes = match instance.params.get(spec.name) {
            Some(ParamValue::Strokes(strokes)) => strokes.clone(),
            _ => Vec::new(),
        };
        Some(Self { node: instance.name.clone(), param: spec.name, timed, strokes })
    }
}

impl Brush {
    /// Radius of the brush in metres.
    pub(super) fn radius(&self, session: &Session) -> f64 {
        let [width, height] = session.document().world().size;
        self.radius.unwrap_or_else(|| super::scale::round_below(0.04 * width.max(height)))
    }

    /// Height by which one stroke raises or lowers, in metres.
    fn metres(&self, session: &Session) -> f64 {
        self.metres.unwrap_or_else(|| super::scale::round_below(0.2 * self.radius(session)))
    }

    /// The mask output that strokes change, as `node.port`.
    fn mask(&self, session: &Session) -> Option<String> {
        let canvas =
            Canvas::of(session).filter(|canvas| !canvas.timed && matches!(self.tool, Tool::Mask | Tool::Erase))?;
        let graph = session.document().graph();
        let index = graph.find(&canvas.node).ok()?;
        let mut names =
            graph.instance(index).node.outputs.iter().map(|output| format!("{}.{}", canvas.node, output.name));
        names.find(|name| graph.port(name).is_ok_and(|port| graph.output_type(port) == PortType::Mask))
    }

    /// Shows the mask while the brush is on and has a tool of masks, over the terrain or as the map. Afterwards shows what
    /// was shown before, unless something else was chosen meanwhile.
    pub(super) fn reveal(&mut self, session: &mut Session, over: &mut Over, in_3d: bool, is_on: bool) {
        let mask = self.mask(session).filter(|_| is_on);
        let is_same = match &self.revealed {
            Some((now, hidden)) => mask.as_ref() == Some(now) && in_3d == matches!(hidden, Hidden::Colours(_)),
            None => mask.is_none(),
        };
        if is_same {
            return;
        }
        match self.revealed.take() {
            Some((mask, Hidden::Colours(before))) if *over == Over::Output(mask.clone()) => *over = before,
            Some((mask, Hidden::Pinned(before))) if session.pinned() == Some(mask.as_str()) => session.pin(before),
            _ => {}
        }
        self.revealed = mask.map(|mask| {
            let hidden = if in_3d {
                Hidden::Colours(std::mem::replace(over, Over::Output(mask.clone())))
            } else {
                let before = session.pinned().map(str::to_owned);
                session.pin(Some(mask.clone()));
                Hidden::Pinned(before)
            };
            (mask, hidden)
        });
    }

    /// The tool bar of the brush.
    pub(super) fn bar(&mut self, ui: &mut egui::Ui, session: &mut Session) {
        ui.horizontal_wrapped(|ui| {
            let Some(canvas) = Canvas::of(session) else {
                ui.label("Select a Paint node, or");
                let shown = session.shown();
                let add = egui::Button::new("Add a Paint node here");
                if ui.add_enabled(shown.is_some(), add).clicked()
                    && let Some(shown) = shown
                {
                    lay(session, &shown);
                }
                return;
            };
            let tools = Tool::all(canvas.timed);
            if !tools.contains(&self.tool) {
                self.tool = Tool::Raise;
            }
            for tool in tools {
                let (name, what) = describe(*tool, canvas.timed);
                ui.selectable_value(&mut self.tool, *tool, name).on_hover_text(what);
            }
            ui.separator();
            let mut radius = self.radius(session);
            ui.label("Radius");
            let [least, most] = Stroke::RADII;
            let speed = radius * 0.01;
            let value = egui::DragValue::new(&mut radius).range(least..=most).speed(speed);
            if ui
                .add(typed(value, Unit::Metres).custom_formatter(|metres, _| Unit::Metres.display(metres)))
                .named("radius of the brush")
                .on_hover_text("Shortcuts: [ and ]")
                .changed()
            {
                self.radius = Some(radius);
            }
            ui.label("Strength");
            let strength = match self.tool.unit() {
                Unit::Metres => {
                    let mut metres = self.metres(session);
                    let value = egui::DragValue::new(&mut metres).range(0.0..=10_000.0).speed(1.0).suffix(" m");
                    let response = ui.add(typed(value, Unit::Metres));
                    if response.changed() {
                        self.metres = Some(metres);
                    }
                    response
                }
                Unit::MillimetresPerHour => {
                    let value = egui::DragValue::new(&mut self.rain).range(0.0..=100_000.0).speed(5.0).suffix(" mm/h");
                    ui.add(typed(value, Unit::MillimetresPerHour))
                }
                _ => ui.add(typed(egui::DragValue::new(&mut self.part).range(0.0..=1.0).speed(0.01), Unit::One)),
            };
            let _ = strength.named("strength of the brush");
            ui.label("Hardness");
            let hardness = egui::DragValue::new(&mut self.hardness).range(0.0..=1.0).speed(0.01);
            let _ = ui.add(typed(hardness, Unit::One)).named("hardness of the brush");
            if ui.button("Clear").named("Clear strokes").on_hover_text("Remove all strokes").clicked() {
                session.apply(&Edit::Reset { node: canvas.node, name: canvas.param.to_owned() });
            }
        });
        if ui.ctx().memory(|memory| memory.focused().is_none()) {
            let (smaller, larger) =
                ui.input(|input| (input.key_pressed(Key::OpenBracket), input.key_pressed(Key::CloseBracket)));
            let factor = if smaller { 0.8 } else { 1.25 };
            if smaller || larger {
                let [least, most] = Stroke::RADII;
                self.radius = Some((self.radius(session) * factor).clamp(least, most));
            }
        }
    }

    /// Continues a stroke with the pointer, or ends it.
    pub(super) fn drag(&mut self, pointer: &Pointer, session: &mut Session) {
        let here = pointer.place.filter(|_| pointer.pressed);
        let count = pointer.path.len() + usize::from(here.is_some());
        let radius = self.radius(session);
        for (index, place) in pointer.path.iter().copied().chain(here).enumerate() {
            if self.stroke.is_none() {
                let begin = |canvas| Painting { canvas, points: Vec::new(), laid: true };
                self.stroke = Canvas::of(session).map(begin);
            }
            let Some(Painting { points, laid, .. }) = &mut self.stroke else { return };
            // Points keep a minimum distance; the last one is where the button was released.
            let ends = !pointer.pressed && index + 1 == count;
            let apart = if ends { 0.02 * radius } else { 0.2 * radius };
            let far = |last: &[f64; 2]| (place[0] - last[0]).hypot(place[1] - last[1]) >= apart;
            if points.last().is_none_or(far) {
                points.push(place.map(|metres| (metres * 10.0).round() / 10.0));
                *laid = false;
            }
        }
        self.lay(session);
        if !pointer.pressed && self.stroke.take_if(|stroke| stroke.laid).is_some() {
            session.end_gesture();
            session.release_simulation();
        }
    }

    /// Writes the stroke to the document. First asks a live run to pause; until it has, writes nothing.
    fn lay(&mut self, session: &mut Session) {
        let radius = self.radius(session);
        let strength = match self.tool.unit() {
            Unit::Metres => self.metres(session),
            Unit::MillimetresPerHour => self.rain,
            _ => self.part,
        };
        let Some(Painting { canvas, points, laid: laid @ false }) = &mut self.stroke else { return };
        let Some(time) = session.time_of_stroke(&canvas.node) else { return };
        let (tool, hardness, points) = (self.tool, self.hardness, points.clone());
        let stroke = Stroke { tool, radius, strength, hardness, time, points };
        let strokes = canvas.strokes.iter().cloned().chain([stroke]).collect();
        let (node, param) = (canvas.node.clone(), canvas.param.to_owned());
        session.gesture(&Edit::SetParam { node, param, value: ParamValue::Strokes(strokes) });
        *laid = true;
    }
}

/// Inserts a paintable node after an output: it reads the output, and the readers of the output read it.
fn lay(session: &mut Session, shown: &str) {
    let document = session.document();
    let has_strokes = |node: &&'static orograph_graph::Node| {
        let specs = node.specs();
        let paints = specs.iter().any(|spec| matches!(spec.kind, Kind::Strokes { timed: false, .. }));
        paints && node.inputs.iter().any(|input| input.ty == PortType::Height)
    };
    let Some(kind) = document.registry().nodes().iter().copied().find(has_strokes) else {
        session.note("no node type can be painted on", true);
        return;
    };
    let graph = document.graph();
    let Ok(port) = graph.port(shown) else { return };
    if graph.output_type(port) != PortType::Height {
        session.note("only heightfields can be painted on; show one first", true);
        return;
    }
    insert::after(session, New::of(kind), shown);
}
