//! Pictures of an output after different edits, parsed and built with few cells on another thread, one after the other,
//! with the results that the editor has already.

use std::{
    path::PathBuf,
    sync::{
        Arc,
        mpsc::{Receiver, TryRecvError, channel},
    },
    thread,
};

use egui::{Color32, Context, Rect, Sense, Stroke, StrokeKind, Ui, pos2, vec2};
use orograph_graph::{
    Cancel, Document, Edit, Evaluation, Evaluator, Field, Graph, Port, PortType, Request, Value, Window, World,
};

use crate::editor::{
    Session,
    canvas::thumbnails,
    session::{Preferred, worker::coarser},
};

/// Cells along the longer side of what is built.
const CELLS: u32 = 128;

/// The pictures; dropping them cancels what is not built yet.
pub(super) struct Pictures {
    ty: PortType,
    pictures: Vec<Picture>,
    built: Receiver<(usize, Result<Value, String>)>,
    cancel: Cancel,
}

enum Picture {
    Waiting,
    Shown(Field, egui::TextureHandle),
    Failed(String),
}

/// A graph after an edit, and what is built of it.
struct Variation {
    graph: Arc<Graph>,
    port: Port,
    world: World,
}

impl Pictures {
    /// Starts to build an output, given as `node.port`, after each of the edits.
    pub(super) fn start(context: &Context, session: &Session, port: &str, ty: PortType, edits: &[Edit]) -> Self {
        let document = session.document();
        let (source, folder) = (document.source().to_owned(), document.folder().to_owned());
        let (registry, evaluator) = (document.registry().clone(), Arc::clone(session.evaluator()));
        let preferred = session.preferences().clone();
        let (outbox, built) = channel();
        let cancel = Cancel::default();
        let (context, stop) = (context.clone(), cancel.clone());
        let (port, varied) = (port.to_owned(), edits.to_vec());
        thread::spawn(move || {
            let document = Document::parse_in(source, &folder, &registry);
            for (at, edit) in varied.iter().enumerate() {
                if stop.is_cancelled() {
                    return;
                }
                let variation = variation(&document, &port, edit, &preferred);
                let value = variation.and_then(|variation| build(&evaluator, &folder, &variation, &stop));
                // The receiver is gone once the dialog is closed.
                if outbox.send((at, value)).is_err() {
                    return;
                }
                context.request_repaint();
            }
        });
        let pictures = edits.iter().map(|_| Picture::Waiting).collect();
        Self { ty, pictures, built, cancel }
    }

    /// Takes what has been built. Pictures are drawn again when another arrives, as they share a scale.
    pub(super) fn take(&mut self, context: &Context) {
        let mut is_new = false;
        loop {
            match self.built.try_recv() {
                Ok((at, Ok(value))) => {
                    if let Some(field) = value.as_field() {
                        let image = egui::ColorImage::filled([1, 1], Color32::TRANSPARENT);
                        let texture =
                            context.load_texture(format!("variation {at}"), image, egui::TextureOptions::LINEAR);
                        self.pictures[at] = Picture::Shown(field.clone(), texture);
                        is_new = true;
                    }
                }
                Ok((at, Err(reason))) => self.pictures[at] = Picture::Failed(reason),
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => break,
            }
        }
        if is_new {
            self.draw();
        }
    }

    fn draw(&mut self) {
        let shown = self.pictures.iter_mut().filter_map(|picture| match picture {
            Picture::Shown(field, texture) => Some((&*field, texture)),
            _ => None,
        });
        let (fields, textures): (Vec<&Field>, Vec<&mut egui::TextureHandle>) = shown.unzip();
        for (texture, image) in textures.into_iter().zip(thumbnails(&fields, self.ty)) {
            texture.set(image, egui::TextureOptions::LINEAR);
        }
    }

    /// A picture with a name, and a caption on it. Returns true if it was clicked.
    pub(super) fn cell(&self, ui: &mut Ui, at: usize, side: f32, name: &str, caption: &str) -> bool {
        let size = vec2(side, side);
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, name));
        let painter = ui.painter();
        painter.rect_filled(rect, 4.0, ui.visuals().extreme_bg_color);
        match self.pictures.get(at) {
            Some(Picture::Shown(_, texture)) => {
                let shape = texture.size_vec2() / texture.size_vec2().max_elem();
                let place = Rect::from_center_size(rect.center(), size * shape);
                painter.image(texture.id(), place, Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0)), Color32::WHITE);
            }
            Some(Picture::Failed(reason)) => {
                let colour = ui.visuals().error_fg_color;
                painter.text(rect.center(), egui::Align2::CENTER_CENTER, "✖", egui::FontId::proportional(20.0), colour);
                response.clone().on_hover_text(reason);
            }
            Some(Picture::Waiting) | None => {
                egui::Spinner::new().paint_at(ui, Rect::from_center_size(rect.center(), vec2(20.0, 20.0)));
            }
        }
        if !caption.is_empty() {
            let corner = rect.left_bottom() + vec2(8.0, -8.0);
            crate::editor::viewport::label(ui.painter(), corner, egui::Align2::LEFT_BOTTOM, caption);
        }
        if response.hovered() || response.has_focus() {
            let stroke = Stroke::new(2.0, ui.visuals().hyperlink_color);
            ui.painter().rect_stroke(rect, 4.0, stroke, StrokeKind::Outside);
        }
        response.clicked()
    }
}

impl Drop for Pictures {
    fn drop(&mut self) {
        self.cancel.cancel();
    }
}

/// The graph after an edit, with few cells.
fn variation(document: &Document, port: &str, edit: &Edit, preferred: &Preferred) -> Result<Variation, String> {
    let mut varied = document.clone();
    varied.apply(edit).map_err(|error| error.to_string())?;
    let expanded = varied.expand();
    let port = varied.graph().port(port).ok().and_then(|port| expanded.port(port));
    let port = port.ok_or_else(|| "its node is muted".to_owned())?;
    Ok(Variation { graph: preferred.applied(expanded.graph), port, world: coarser(varied.world(), CELLS) })
}

fn build(evaluator: &Evaluator, folder: &PathBuf, variation: &Variation, cancel: &Cancel) -> Result<Value, String> {
    let Variation { graph, port, world } = variation;
    let requests = [Request { port: *port, window: Window::whole(*world) }];
    let evaluation = Evaluation { graph, folder, requests: &requests, byproducts: &[] };
    let mut values = evaluator.evaluate(&evaluation, cancel, &|_| {});
    values.pop().ok_or_else(|| "there is no result".to_owned())?.map_err(|error| error.to_string())
}
