//! Thumbnails of results, as textures.

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use egui::{Color32, ColorImage, Context, TextureHandle, TextureOptions, Vec2, vec2};
use orograph_graph::{Field, Layer, Lines, PortType, Value, World, plain};
use orograph_nodes::{numerics::math, raster};

use super::{super::Session, look::Look, model::Model};
use crate::export::picture;

/// Time per frame for making thumbnails.
const BUDGET: Duration = Duration::from_millis(4);
/// Pixels along the longer side of a thumbnail of lines.
const DRAWN: usize = 128;

/// A thumbnail of a result.
pub(super) struct Thumb {
    /// The value it shows; kept alive so that no other value gets the same address.
    value: Value,
    pub(super) texture: Option<TextureHandle>,
    /// Width and height as fractions of the square.
    pub(super) shape: Vec2,
    /// The text beside it, from the top: maximum and minimum, or measures.
    pub(super) lines: Vec<String>,
    dark: bool,
}

/// The thumbnails, by `node.port`.
#[derive(Default)]
pub(super) struct Thumbs {
    by_port: BTreeMap<String, Thumb>,
}

impl std::fmt::Debug for Thumbs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Thumbs").field("count", &self.by_port.len()).finish()
    }
}

impl Thumbs {
    pub(super) fn get(&self, port: &str) -> Option<&Thumb> {
        self.by_port.get(port)
    }

    /// Makes thumbnails of changed results of some cards, as many as the time allows. Returns true if all are made.
    pub(super) fn renew(
        &mut self,
        context: &Context,
        session: &Session,
        model: &Model,
        cards: &[usize],
        look: &Look,
    ) -> bool {
        let start = now();
        for card in cards.iter().map(|card| &model.cards[*card]) {
            let Some(output) = card.outputs.first() else { continue };
            let port = format!("{}.{}", card.name, output.name);
            let Some(built) = session.small(&port) else { continue };
            let known = self.by_port.get(&port);
            if known.is_some_and(|thumb| same(&thumb.value, &built.value) && thumb.dark == look.dark) {
                continue;
            }
            let thumb = make(context, &port, &built.value, output.ty, session.document().world(), look, known);
            self.by_port.insert(port, thumb);
            if now().duration_since(start) > BUDGET {
                return false;
            }
        }
        true
    }

    /// Removes thumbnails of nodes that are gone.
    pub(super) fn keep(&mut self, model: &Model) {
        let there = |port: &String| port.split_once('.').is_some_and(|(node, _)| model.find(node).is_some());
        self.by_port.retain(|port, _| there(port));
    }
}

#[expect(clippy::disallowed_methods, reason = "pictures may only take a share of a frame")]
fn now() -> Instant {
    Instant::now()
}

/// Returns true if two values share their contents, in the same world.
fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Field(a), Value::Field(b)) => a.window() == b.window() && std::ptr::eq(a.samples(), b.samples()),
        (Value::Strata(a), Value::Strata(b)) => Arc::ptr_eq(a, b),
        (Value::Lines(a), Value::Lines(b)) => Arc::ptr_eq(a, b),
        (Value::Report(a), Value::Report(b)) => Arc::ptr_eq(a, b),
        _ => false,
    }
}

fn make(
    context: &Context,
    port: &str,
    value: &Value,
    ty: PortType,
    world: World,
    look: &Look,
    known: Option<&Thumb>,
) -> Thumb {
    let (image, lines) = match value {
        Value::Field(field) => (Some(of_field(field, ty)), extremes(field, ty)),
        Value::Strata(strata) => {
            let layers = &strata.column().layers;
            (Some(of_layers(layers)), vec![counted(layers.len(), "layer")])
        }
        Value::Lines(lines) => (Some(of_lines(lines, world, look)), vec![counted(lines.lines.len(), "line")]),
        Value::Report(report) => {
            let measure = |measure: &orograph_graph::Measure| {
                format!("{} {} {}", measure.name, short(measure.value), measure.unit).trim_end().to_owned()
            };
            (None, report.measures.iter().map(measure).collect())
        }
        // never delivered
        Value::State(_) => (None, Vec::new()),
    };
    let shape = image.as_ref().map_or(Vec2::ZERO, |image| {
        let size = vec2(image.size[0] as f32, image.size[1] as f32);
        size / size.max_elem().max(1.0)
    });
    let texture = image.map(|image| match known.and_then(|thumb| thumb.texture.clone()) {
        Some(mut texture) => {
            texture.set(image, TextureOptions::LINEAR);
            texture
        }
        None => context.load_texture(port, image, TextureOptions::LINEAR),
    });
    Thumb { value: value.clone(), texture, shape, lines, dark: look.dark }
}

fn counted(count: usize, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

/// The picture of a field.
fn of_field(field: &Field, ty: PortType) -> ColorImage {
    let cells = field.window().cells.map(|count| count as usize);
    let grey = |level: &dyn Fn(usize) -> f32| {
        let count = cells[0] * cells[1];
        let bytes: Vec<u8> = (0..count).map(|cell| (level(cell).clamp(0.0, 1.0) * 255.0) as u8).collect();
        ColorImage::from_gray(cells, &bytes)
    };
    match ty {
        PortType::Mask => grey(&|cell| field.plane(0)[cell]),
        PortType::Vector(_) => {
            let (x, y) = (field.plane(0), field.plane(1));
            let length = |cell: usize| (x[cell] * x[cell] + y[cell] * y[cell]).sqrt();
            let most = (0..x.len()).map(length).fold(f32::MIN_POSITIVE, f32::max);
            grey(&|cell| length(cell) / most)
        }
        PortType::Flow => {
            let area = field.plane(1);
            let most = math::f32::ln(area.iter().copied().fold(1.0, f32::max) + 1.0);
            grey(&|cell| math::f32::ln(area[cell].max(0.0) + 1.0) / most)
        }
        _ => of_colours(&picture::of_field(field, ty, picture::View::Map)),
    }
}

/// The pictures of fields that are compared: heights and numbers have the scale of all of them.
pub(in crate::editor) fn of_fields(fields: &[&Field], ty: PortType) -> Vec<ColorImage> {
    if !matches!(ty, PortType::Height | PortType::Scalar(_)) {
        return fields.iter().map(|field| of_field(field, ty)).collect();
    }
    picture::together(fields, ty).iter().map(of_colours).collect()
}

fn of_colours(picture: &Field) -> ColorImage {
    ColorImage::from_rgb(picture.window().cells.map(|count| count as usize), &raster::srgb_bytes(picture))
}

/// The maximum and the minimum, if they are informative.
fn extremes(field: &Field, ty: PortType) -> Vec<String> {
    if !matches!(ty, PortType::Height | PortType::Mask | PortType::Scalar(_)) {
        return Vec::new();
    }
    let shown = |v: f32| {
        let text = ty.unit().display(format!("{v:.2e}").parse().unwrap_or(f64::from(v)));
        if ty.unit() == orograph_graph::Unit::One { short(f64::from(v)) } else { text }
    };
    field.range(0).map_or_else(Vec::new, |(lo, hi)| vec![shown(hi), shown(lo)])
}

/// A number with three digits.
fn short(value: f64) -> String {
    plain(format!("{value:.2e}").parse().unwrap_or(value))
}

/// Layers to scale, from the top down.
fn of_layers(layers: &[Layer]) -> ColorImage {
    let total: f64 = layers.iter().map(|layer| layer.thickness).sum();
    let mut image = ColorImage::filled([DRAWN, DRAWN], Color32::BLACK);
    let (mut at, mut base) = (0, layers[0].thickness);
    for (y, row) in image.pixels.chunks_exact_mut(DRAWN).enumerate() {
        let depth = (y as f64 + 0.5) / DRAWN as f64 * total;
        while depth > base && at + 1 < layers.len() {
            at += 1;
            base += layers[at].thickness;
        }
        let [red, green, blue] = layers[at].colour.0;
        row.fill(Color32::from_rgb(red, green, blue));
    }
    image
}

/// Lines seen from above, wider and brighter with higher order.
fn of_lines(lines: &Lines, world: World, look: &Look) -> ColorImage {
    let scale = DRAWN as f64 / world.size[0].max(world.size[1]);
    let size = world.size.map(|size| ((size * scale) as usize).clamp(1, DRAWN));
    let mut image = ColorImage::filled(size, look.well);
    let most = lines.lines.iter().map(|line| line.order).max().unwrap_or(1) as f32;
    for line in &lines.lines {
        let colour = look.port(PortType::Lines);
        let colour = look.well.lerp_to_gamma(colour, 0.35 + 0.65 * line.order as f32 / most);
        for pair in line.vertices.windows(2) {
            segment(&mut image, pair[0].position_m.map(|m| m * scale), pair[1].position_m.map(|m| m * scale), colour);
        }
    }
    image
}

fn segment(image: &mut ColorImage, from: [f64; 2], to: [f64; 2], colour: Color32) {
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let steps = dx.abs().max(dy.abs()).ceil().clamp(1.0, 4.0 * DRAWN as f64) as usize;
    for step in 0..=steps {
        let t = step as f64 / steps as f64;
        let (x, y) = (from[0] + t * dx, from[1] + t * dy);
        if x >= 0.0 && y >= 0.0 && x < image.size[0] as f64 && y < image.size[1] as f64 {
            image[(x as usize, y as usize)] = colour;
        }
    }
}
