//! Pictures of outputs, made on another thread, so that a large one does not delay a frame.

use std::sync::mpsc::{Receiver, channel};

use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use orograph_graph::{Field, PortType, Window};
use orograph_nodes::raster::srgb_bytes;

use super::{
    Shown,
    scale::contour_step,
    surroundings::{Age, Surroundings},
};
use crate::export::picture;

/// The content of a picture.
#[derive(Clone, Debug, PartialEq)]
struct Key {
    port: String,
    revision: u64,
    step: u64,
    window: Window,
    contours: bool,
    /// Cells of the whole output, which gives the range of the tints.
    whole: [u32; 2],
    /// What else the picture depends on.
    around: [Option<Age>; 2],
}

impl Key {
    fn of(shown: &Shown, whole: Option<&Field>, around: &Surroundings, contours: bool) -> Self {
        Self {
            around: around.ages(),
            port: shown.port.clone(),
            revision: shown.revision,
            step: shown.step,
            window: *shown.field.window(),
            contours: contours && shown.ty == PortType::Height,
            whole: whole.unwrap_or(&shown.field).window().cells,
        }
    }
}

/// Makes the picture of one output and keeps it.
#[derive(Default)]
pub(super) struct Painter {
    texture: Option<(Key, TextureHandle)>,
    work: Option<(Key, Receiver<ColorImage>)>,
}

impl Painter {
    /// Requests the picture of an output; the previous one stays until it is ready.
    pub(super) fn want(&mut self, context: &Context, shown: &Shown, around: &Surroundings, contours: bool) {
        self.want_in_tints(context, shown, (None, around), contours);
    }

    /// Returns true if the picture of an output is not made yet.
    pub(super) fn lacks(&self, shown: &Shown, around: &Surroundings, contours: bool) -> bool {
        let key = Key::of(shown, None, around, contours);
        self.texture.as_ref().is_none_or(|(made, _)| *made != key)
    }

    /// Requests the picture of a part of an output, with the tints of the whole output.
    pub(super) fn want_part(
        &mut self,
        context: &Context,
        part: &Shown,
        (whole, around): (&Shown, &Surroundings),
        contours: bool,
    ) {
        self.want_in_tints(context, part, (Some(&whole.field), around), contours);
    }

    fn want_in_tints(
        &mut self,
        context: &Context,
        shown: &Shown,
        (whole, around): (Option<&Field>, &Surroundings),
        contours: bool,
    ) {
        let key = Key::of(shown, whole, around, contours);
        if let Some((made, image)) = self.work.take() {
            match image.try_recv() {
                Ok(image) => {
                    let name = format!("picture of {}", made.port);
                    let texture = context.load_texture(name, image, options());
                    self.texture = Some((made, texture));
                }
                // A failed picture is requested again after the next change.
                Err(std::sync::mpsc::TryRecvError::Disconnected) => {}
                Err(std::sync::mpsc::TryRecvError::Empty) => self.work = Some((made, image)),
            }
        }
        let is_there = self.texture.as_ref().is_some_and(|(made, _)| *made == key);
        if self.work.is_some() || is_there {
            return;
        }
        let (outbox, inbox) = channel();
        let (context, field, whole, ty) = (context.clone(), shown.field.clone(), whole.cloned(), shown.ty);
        let around = around.clone();
        let contours = key.contours;
        let most = context.input(|input| input.max_texture_side) as u32;
        rayon::spawn(move || {
            let field = picture::shrunk(&field, most);
            let whole = whole.map_or_else(|| field.clone(), |whole| picture::shrunk(&whole, most));
            // Ignored: the receiver is gone once the window is closed.
            let _ = outbox.send(image(&field, around.fields(&whole), ty, contours));
            context.request_repaint();
        });
        self.work = Some((key, inbox));
    }

    /// The state of the document of the newest picture, and its cells along the longer side. Returns None while an
    /// intermediate result is shown.
    pub(super) fn seen(&self) -> Option<(u64, u32)> {
        let key = self.texture.as_ref().map(|(key, _)| key).filter(|key| key.step == 0);
        key.map(|key| (key.revision, key.window.world.cells[0].max(key.window.world.cells[1])))
    }

    /// The newest picture, if it shows this output at this state of the document, and the window that it covers.
    pub(super) fn part(&self, port: &str, revision: u64) -> Option<(&TextureHandle, &Window)> {
        let (key, texture) = self.texture.as_ref()?;
        (key.port == port && key.revision == revision).then_some((texture, &key.window))
    }

    /// As [`Self::part`], if the picture also has these surroundings.
    pub(super) fn part_in(&self, shown: &Shown, around: &Surroundings) -> Option<(&TextureHandle, &Window)> {
        let is_present = self.texture.as_ref().is_some_and(|(key, _)| key.around == around.ages());
        self.part(&shown.port, shown.revision).filter(|_| is_present)
    }

    /// The newest picture.
    pub(super) fn texture(&self) -> Option<&TextureHandle> {
        self.texture.as_ref().map(|(_, texture)| texture)
    }
}

/// Large cells are drawn as squares, small ones are averaged.
const fn options() -> TextureOptions {
    TextureOptions {
        magnification: egui::TextureFilter::Nearest,
        minification: egui::TextureFilter::Linear,
        wrap_mode: egui::TextureWrapMode::ClampToEdge,
        mipmap_mode: Some(egui::TextureFilter::Linear),
    }
}

/// A picture of an output for the screen.
fn image(field: &Field, around: picture::Around<'_>, ty: PortType, contours: bool) -> ColorImage {
    let mut bytes = srgb_bytes(&picture::of_part(field, ty, around));
    if contours {
        let (low, high) = around.whole.range(0).unwrap_or_default();
        draw_contours(&mut bytes, field, contour_step(f64::from(high - low)));
    }
    let window = field.window();
    ColorImage::from_rgb([window.nx(), window.ny()], &bytes)
}

/// Darkens each cell with a multiple of `step` between it and its neighbour to the east or to the south; every fifth
/// line is darker.
fn draw_contours(bytes: &mut [u8], field: &Field, step: f64) {
    let (nx, ny, z) = (field.window().nx(), field.window().ny(), field.plane(0));
    let level = |at: usize| (f64::from(z[at]) / step).floor();
    for j in 0..ny {
        for i in 0..nx {
            let at = j * nx + i;
            let own = level(at);
            let east = if i + 1 < nx { level(at + 1) } else { own };
            let south = if j + 1 < ny { level(at + nx) } else { own };
            let crossed = own.max(east).max(south);
            if own != east || own != south {
                let share = if crossed.rem_euclid(5.0) == 0.0 { 0.35 } else { 0.65 };
                for byte in &mut bytes[3 * at..3 * at + 3] {
                    *byte = (f32::from(*byte) * share) as u8;
                }
            }
        }
    }
}
