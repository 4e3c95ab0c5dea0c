//! Variations: the shown output with other seeds, as a grid of pictures; a click keeps one.
//!
//! The seed is that of the selected node, or of the world if the node has none. Pictures are built with few cells on
//! another thread, one after the other, with the results that the editor has already.

use std::{
    path::PathBuf,
    sync::{
        Arc,
        mpsc::{Receiver, TryRecvError, channel},
    },
    thread,
};

use egui::{Color32, Context, Id, Label, Rect, RichText, Sense, Stroke, StrokeKind, Ui, pos2, vec2};
use orograph_graph::{
    Cancel, Document, Edit, Evaluation, Evaluator, Graph, Kind, ParamValue, Port, PortType, Request, Value, Window,
    World,
};

use crate::editor::{Session, canvas::thumbnail, session::worker::coarser, window::theme};

/// Pictures in a row, rows, side of a picture in points, and cells along the longer side of what is built.
const GRID: [usize; 2] = [4, 3];
const SIDE: f32 = 128.0;
const CELLS: u32 = 128;

/// The dialog.
pub(crate) struct Variations {
    subject: Subject,
    /// The shown output, as `node.port`, and its type.
    port: String,
    ty: PortType,
    seeds: Vec<u32>,
    pictures: Vec<Picture>,
    built: Receiver<(usize, Result<Value, String>)>,
    cancel: Cancel,
}

/// The node and its parameter with the seed; None for the seed of the world.
type Subject = Option<(String, &'static str)>;

enum Picture {
    Waiting,
    Shown(egui::TextureHandle),
    Failed(String),
}

/// A graph with a seed, and what is built of it.
struct Variation {
    graph: Arc<Graph>,
    port: Port,
    world: World,
}

impl Variations {
    /// Starts to build variations of the shown output. Returns None after a note when there is nothing to vary.
    pub(crate) fn start(context: &Context, session: &mut Session) -> Option<Self> {
        let found = Self::found(session);
        if found.is_none() {
            session.note("nothing is shown that could be varied: select a node, or add an output", true);
        }
        let (subject, now, port, ty) = found?;
        let count = GRID[0] * GRID[1];
        let seeds: Vec<u32> = (0..count as u32).map(|at| now.wrapping_add(at)).collect();
        Some(Self::of(context, session, (subject, port, ty), seeds))
    }

    /// The seed to vary and its value, and the shown output.
    fn found(session: &Session) -> Option<(Subject, u32, String, PortType)> {
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

    fn of(
        context: &Context,
        session: &Session,
        (subject, port, ty): (Subject, String, PortType),
        seeds: Vec<u32>,
    ) -> Self {
        let document = session.document();
        let varied: Vec<Result<Variation, String>> = seeds
            .iter()
            .map(|seed| variation(document, &port, &edit(subject.as_ref(), *seed, document.world())))
            .collect();
        let (outbox, built) = channel();
        let cancel = Cancel::default();
        let (evaluator, folder) = (Arc::clone(session.evaluator()), document.folder().to_owned());
        let (context, stop) = (context.clone(), cancel.clone());
        thread::spawn(move || {
            for (at, variation) in varied.into_iter().enumerate() {
                if stop.is_cancelled() {
                    return;
                }
                let value = variation.and_then(|variation| build(&evaluator, &folder, &variation, &stop));
                // The receiver is gone once the dialog is closed.
                if outbox.send((at, value)).is_err() {
                    return;
                }
                context.request_repaint();
            }
        });
        let pictures = seeds.iter().map(|_| Picture::Waiting).collect();
        Self { subject, port, ty, seeds, pictures, built, cancel }
    }

    /// Shows the dialog. Returns false once it is closed.
    pub(crate) fn ui(&mut self, context: &Context, session: &mut Session) -> bool {
        self.take(context);
        let (mut kept, mut more) = (None, false);
        let modal = theme::modal(context, Id::new("variations")).show(context, |ui| {
            let room = ui.ctx().content_rect().size();
            let columns = ((room.x - 60.0) / (SIDE + 8.0)).floor().clamp(1.0, GRID[0] as f32) as usize;
            ui.heading("Variations");
            let of = self.subject.as_ref().map_or("the world".to_owned(), |(node, param)| format!("{node}.{param}"));
            ui.add(
                Label::new(
                    RichText::new(format!("{} with other seeds of {of}; click one to keep it.", self.port)).weak(),
                )
                .wrap(),
            );
            egui::ScrollArea::vertical().max_height((room.y - 150.0).max(80.0)).show(ui, |ui| {
                egui::Grid::new("seeds").spacing([8.0, 8.0]).show(ui, |ui| {
                    for (at, (seed, picture)) in self.seeds.iter().zip(&self.pictures).enumerate() {
                        if cell(ui, *seed, picture, at == 0) {
                            kept = Some(*seed);
                        }
                        if (at + 1) % columns == 0 {
                            ui.end_row();
                        }
                    }
                });
            });
            ui.horizontal(|ui| {
                more = ui.button("More").on_hover_text("Other seeds").clicked();
                if ui.button("Cancel").clicked() {
                    ui.close();
                }
            });
        });
        if let Some(seed) = kept {
            session.apply(&edit(self.subject.as_ref(), seed, session.document().world()));
            return false;
        }
        if more {
            self.cancel.cancel();
            let last = self.seeds.last().copied().unwrap_or_default();
            let first = self.seeds[0];
            let others = (1..self.seeds.len() as u32).map(|at| last.wrapping_add(at));
            let seeds = std::iter::once(first).chain(others).collect();
            *self = Self::of(context, session, (self.subject.clone(), self.port.clone(), self.ty), seeds);
        }
        !modal.should_close()
    }

    /// Takes what has been built.
    fn take(&mut self, context: &Context) {
        loop {
            match self.built.try_recv() {
                Ok((at, Ok(value))) => {
                    if let Some(field) = value.as_field() {
                        let name = format!("variation {}", self.seeds[at]);
                        let image = thumbnail(field, self.ty);
                        self.pictures[at] =
                            Picture::Shown(context.load_texture(name, image, egui::TextureOptions::LINEAR));
                    }
                }
                Ok((at, Err(reason))) => self.pictures[at] = Picture::Failed(reason),
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => return,
            }
        }
    }
}

impl Drop for Variations {
    fn drop(&mut self) {
        self.cancel.cancel();
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

/// The graph after an edit, with few cells.
fn variation(document: &Document, port: &str, edit: &Edit) -> Result<Variation, String> {
    let mut varied = Document::parse_in(document.source(), document.folder(), document.registry());
    varied.apply(edit).map_err(|error| error.to_string())?;
    let expanded = varied.expand();
    let port = varied.graph().port(port).ok().and_then(|port| expanded.port(port));
    let port = port.ok_or_else(|| "its node is muted".to_owned())?;
    Ok(Variation { graph: expanded.graph, port, world: coarser(varied.world(), CELLS) })
}

fn build(evaluator: &Evaluator, folder: &PathBuf, variation: &Variation, cancel: &Cancel) -> Result<Value, String> {
    let Variation { graph, port, world } = variation;
    let requests = [Request { port: *port, window: Window::whole(*world) }];
    let evaluation = Evaluation { graph, folder, requests: &requests, byproducts: &[] };
    let mut values = evaluator.evaluate(&evaluation, cancel, &|_| {});
    values.pop().ok_or_else(|| "there is no result".to_owned())?.map_err(|error| error.to_string())
}

/// A picture with its seed. Returns true if it was clicked.
fn cell(ui: &mut Ui, seed: u32, picture: &Picture, is_present: bool) -> bool {
    let size = vec2(SIDE, SIDE);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let name = format!("seed {seed}");
    response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, &name));
    let painter = ui.painter();
    painter.rect_filled(rect, 4.0, ui.visuals().extreme_bg_color);
    match picture {
        Picture::Waiting => {
            egui::Spinner::new().paint_at(ui, Rect::from_center_size(rect.center(), vec2(20.0, 20.0)));
        }
        Picture::Shown(texture) => {
            let shape = texture.size_vec2() / texture.size_vec2().max_elem();
            let place = Rect::from_center_size(rect.center(), size * shape);
            painter.image(texture.id(), place, Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)), Color32::WHITE);
        }
        Picture::Failed(reason) => {
            let colour = ui.visuals().error_fg_color;
            painter.text(rect.center(), egui::Align2::CENTER_CENTER, "✖", egui::FontId::proportional(20.0), colour);
            response.clone().on_hover_text(reason);
        }
    }
    let caption = if is_present { format!("{name} (now)") } else { name };
    crate::editor::viewport::label(
        ui.painter(),
        rect.left_bottom() + vec2(8.0, -8.0),
        egui::Align2::LEFT_BOTTOM,
        &caption,
    );
    if response.hovered() {
        let stroke = Stroke::new(2.0, ui.visuals().hyperlink_color);
        ui.painter().rect_stroke(rect, 4.0, stroke, StrokeKind::Outside);
    }
    response.clicked()
}
