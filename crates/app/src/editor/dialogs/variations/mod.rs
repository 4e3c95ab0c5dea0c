//! Variations: the shown output with other seeds, or with other values of two parameters, as a grid of pictures; a
//! click keeps one.
//!
//! The seed is that of the selected node, or of the world if the node has none.

mod axis;
mod pictures;

use egui::{Context, Id, Label, RichText, Ui};
use orograph_graph::{Edit, Kind, ParamValue, PortType, World};

use self::{
    axis::{Axis, Subject},
    pictures::Pictures,
};
use crate::editor::{Session, window::theme};

/// Seeds in a row, and rows of seeds.
const SEEDS: [usize; 2] = [4, 3];
/// Values of each of two parameters.
const STEPS: [usize; 3] = [3, 4, 5];
/// Largest and smallest side of a picture, in points.
const SIDE: [f32; 2] = [128.0, 56.0];

/// The dialog.
pub(crate) struct Variations {
    /// The shown output, as `node.port`, and its type.
    port: String,
    ty: PortType,
    seed: Seed,
    seeds: Vec<u32>,
    plane: Option<Plane>,
    /// True if two parameters are varied instead of the seed.
    by_parameters: bool,
    /// The pictures; None while the ranges cannot be used.
    pictures: Option<Pictures>,
}

/// The node and its parameter with the seed; None for the seed of the world.
type Seed = Option<(String, &'static str)>;

/// Two parameters, and a grid of their values.
struct Plane {
    subjects: Vec<Subject>,
    across: Axis,
    down: Axis,
    steps: usize,
    /// The values across and down, or why there are none.
    values: Result<[Vec<f64>; 2], String>,
}

impl Plane {
    /// The first two numbers that the output depends on. Returns None when it depends on fewer.
    fn new(subjects: Vec<Subject>) -> Option<Self> {
        let (across, down) = (Axis::new(subjects.first()?.clone()), Axis::new(subjects.get(1)?.clone()));
        let mut new = Self { subjects, across, down, steps: STEPS[0], values: Err(String::new()) };
        new.read();
        Some(new)
    }

    /// Reads the ranges.
    fn read(&mut self) {
        let read = |axis: &Axis| axis.values(self.steps);
        self.values = read(&self.across).and_then(|across| Ok([across, read(&self.down)?]));
    }

    /// The edits of all pictures, row by row.
    fn edits(&self) -> Vec<Edit> {
        let Ok([across, down]) = &self.values else { return Vec::new() };
        let of = |y: &f64| {
            let edit = |x: &f64| Edit::All(vec![self.across.subject.edit(*x), self.down.subject.edit(*y)]);
            across.iter().map(edit).collect::<Vec<_>>()
        };
        down.iter().flat_map(of).collect()
    }

    /// The parameters and their ranges. Returns true if other values are wanted.
    fn ui(&mut self, ui: &mut Ui) -> bool {
        let state = |plane: &Self| (plane.across.subject.label(), plane.down.subject.label(), plane.values.clone());
        let before = state(self);
        let mut changed = self.across.ui(ui, "Across", &self.subjects, &self.down.subject);
        changed |= self.down.ui(ui, "Down", &self.subjects, &self.across.subject);
        ui.horizontal(|ui| {
            for steps in STEPS {
                changed |= ui.selectable_value(&mut self.steps, steps, format!("{steps} x {steps}")).changed();
            }
        });
        if changed {
            self.read();
        }
        if let Err(reason) = &self.values {
            ui.label(RichText::new(reason).color(ui.visuals().error_fg_color));
        }
        changed && state(self) != before
    }

    /// The pictures, with the values at their edges; returns the position of the one that was clicked.
    fn grid(&self, ui: &mut Ui, pictures: &Pictures, side: f32) -> Option<usize> {
        let Ok([across, down]) = &self.values else { return None };
        let (x, y) = (&self.across.subject, &self.down.subject);
        let mut clicked = None;
        egui::Grid::new("two parameters").spacing([6.0, 6.0]).show(ui, |ui| {
            ui.label("");
            for value in across {
                ui.vertical_centered(|ui| ui.label(RichText::new(x.text(*value)).small()));
            }
            ui.end_row();
            for (row, down) in down.iter().enumerate() {
                ui.label(RichText::new(y.text(*down)).small());
                for (column, value) in across.iter().enumerate() {
                    let at = row * across.len() + column;
                    let name = format!("{} {}, {} {}", x.label(), x.text(*value), y.label(), y.text(*down));
                    if pictures.cell(ui, at, side, &name, "") {
                        clicked = Some(at);
                    }
                }
                ui.end_row();
            }
        });
        clicked
    }
}

impl Variations {
    /// Starts to build variations of the shown output. Returns None after a note when there is nothing to vary.
    pub(crate) fn start(context: &Context, session: &mut Session) -> Option<Self> {
        let found = Self::found(session);
        if found.is_none() {
            session.note("nothing is shown that could be varied: select a node, or add an output", true);
        }
        let (seed, now, port, ty) = found?;
        let count = SEEDS[0] * SEEDS[1];
        let seeds: Vec<u32> = (0..count as u32).map(|at| now.wrapping_add(at)).collect();
        let plane = session.document().graph().port(&port).ok();
        let plane = plane.and_then(|port| Plane::new(Subject::all(session, port)));
        let mut new = Self { port, ty, seed, seeds, plane, by_parameters: false, pictures: None };
        new.build(context, session);
        Some(new)
    }

    /// The seed to vary and its value, and the shown output.
    fn found(session: &Session) -> Option<(Seed, u32, String, PortType)> {
        let graph = session.document().graph();
        let port = session.shown()?;
        let ty = graph.output_type(graph.port(&port).ok()?);
        ty.planes()?;
        let of_node = || {
            let instance = graph.instance(graph.find(session.selected()?).ok()?);
            let spec = instance.node.specs().into_iter().find(|spec| matches!(spec.kind, Kind::Seed { .. }))?;
            match instance.params.get(spec.name) {
                Some(ParamValue::Seed(seed)) => Some((instance.name.clone(), spec.name, *seed)),
                _ => None,
            }
        };
        Some(match of_node() {
            Some((node, param, seed)) => (Some((node, param)), seed, port, ty),
            None => (None, session.document().world().seed, port, ty),
        })
    }

    /// The edits of all pictures.
    fn edits(&self, world: World) -> Vec<Edit> {
        match &self.plane {
            Some(plane) if self.by_parameters => plane.edits(),
            _ => self.seeds.iter().map(|seed| edit(self.seed.as_ref(), *seed, world)).collect(),
        }
    }

    /// Starts to build the pictures.
    fn build(&mut self, context: &Context, session: &Session) {
        let edits = self.edits(session.document().world());
        self.pictures = (!edits.is_empty()).then(|| Pictures::start(context, session, &self.port, self.ty, &edits));
    }

    /// Shows the dialog. Returns false once it is closed.
    pub(crate) fn ui(&mut self, context: &Context, session: &mut Session) -> bool {
        if let Some(pictures) = &mut self.pictures {
            pictures.take(context);
        }
        let (mut kept, mut rebuild) = (None, false);
        let modal = theme::modal(context, Id::new("variations")).show(context, |ui| {
            let room = ui.ctx().content_rect().size();
            ui.heading("Variations");
            ui.horizontal(|ui| {
                rebuild |= ui.selectable_value(&mut self.by_parameters, false, "Seeds").changed();
                ui.add_enabled_ui(self.plane.is_some(), |ui| {
                    let response = ui.selectable_value(&mut self.by_parameters, true, "Two parameters");
                    let response = response.on_disabled_hover_text("The output depends on fewer than two numbers");
                    rebuild |= response.changed();
                });
            });
            let plane = self.plane.as_mut().filter(|_| self.by_parameters);
            let of = self.seed.as_ref().map_or("the world".to_owned(), |(node, param)| format!("{node}.{param}"));
            let what = if plane.is_some() {
                "other values of two parameters".to_owned()
            } else {
                format!("other seeds of {of}")
            };
            let text = format!("{} with {what}; click one to keep it.", self.port);
            ui.add(Label::new(RichText::new(text).weak()).wrap());
            if let Some(plane) = plane {
                rebuild |= plane.ui(ui);
            }
            egui::ScrollArea::vertical().max_height((room.y - 150.0).max(80.0)).show(ui, |ui| {
                kept = self.grid(ui, room);
            });
            ui.horizontal(|ui| {
                if !self.by_parameters && ui.button("More").on_hover_text("Other seeds").clicked() {
                    let last = self.seeds.last().copied().unwrap_or_default();
                    let others = (1..self.seeds.len() as u32).map(|at| last.wrapping_add(at));
                    self.seeds = std::iter::once(self.seeds[0]).chain(others).collect();
                    rebuild = true;
                }
                if ui.button("Cancel").clicked() {
                    ui.close();
                }
            });
        });
        if let Some(edit) = kept.and_then(|at| self.edits(session.document().world()).into_iter().nth(at)) {
            session.apply(&edit);
            return false;
        }
        if rebuild {
            self.build(context, session);
        }
        !modal.should_close()
    }

    /// The pictures; returns the position of the one that was clicked.
    fn grid(&self, ui: &mut Ui, room: egui::Vec2) -> Option<usize> {
        let pictures = self.pictures.as_ref()?;
        if let Some(plane) = self.plane.as_ref().filter(|_| self.by_parameters) {
            let fits = (room - egui::vec2(180.0, 280.0)) / plane.steps as f32;
            let side = fits.min_elem().clamp(SIDE[1], SIDE[0]);
            return plane.grid(ui, pictures, side);
        }
        let columns = ((room.x - 60.0) / (SIDE[0] + 8.0)).floor().clamp(1.0, SEEDS[0] as f32) as usize;
        let mut clicked = None;
        egui::Grid::new("seeds").spacing([8.0, 8.0]).show(ui, |ui| {
            for (at, seed) in self.seeds.iter().enumerate() {
                let name = format!("seed {seed}");
                let caption = if at == 0 { format!("{name} (now)") } else { name.clone() };
                if pictures.cell(ui, at, SIDE[0], &name, &caption) {
                    clicked = Some(at);
                }
                if (at + 1) % columns == 0 {
                    ui.end_row();
                }
            }
        });
        clicked
    }
}

/// The edit that sets the seed.
fn edit(subject: Option<&(String, &'static str)>, seed: u32, world: World) -> Edit {
    match subject {
        Some((node, param)) => {
            Edit::SetParam { node: node.clone(), param: (*param).to_owned(), value: ParamValue::Seed(seed) }
        }
        None => Edit::SetWorld(World { seed, ..world }),
    }
}
