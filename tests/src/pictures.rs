//! The small picture of each node in the manual: the first output of its example on a range cut by rivers, or on
//! terrain that suits it. A node that changes terrain has the terrain before it on the left.

use std::{io::Cursor, path::PathBuf};

use image::{ImageFormat, Rgb, RgbImage};
use orograph::export::picture::{self, View};
use orograph_graph::{Field, Node, Port, PortType, Srgb, Value, Window, World};
use orograph_nodes::{
    numerics::{light, math, palettes::Palette},
    render::hillshade,
};

use crate::{
    Case, evaluate, pictured,
    subjects::{COVERS, Cover},
    world,
};

/// Cells and pixels per side.
const SIDE: u32 = 112;

/// Levels of each colour: few enough for small pictures, too many for visible banding.
const LEVELS: f32 = 32.0;

/// The folder of the manual's pictures.
#[must_use]
pub fn pictures_folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/nodes/pictures")
}

/// Pixels between two pictures.
const GAP: usize = 4;

/// The picture of a node as a PNG: heights as a map, masks in grey, colours unchanged, other numbers in false colours.
/// A node that makes terrain from terrain shows both, in the colours of the result. Returns None when the node's first
/// output is not a raster.
///
/// # Panics
/// When the example fails.
#[must_use]
pub fn picture(node: &'static Node) -> Option<Vec<u8>> {
    if node.is_subgraph() {
        return None;
    }
    let (case, side_m) = pictured(node);
    let ty = case.graph.output_type(Port { node: case.node, output: 0 });
    ty.planes()?;
    // A node that makes a coast is drawn with its sea.
    let instance = case.graph.instance(case.node);
    let sea_level = instance.params.get("sea").map(|_| instance.params.read::<f64>("sea"));
    let world = World { sea_level, size: [side_m; 2], ..world(SIDE) };
    let values_of = |case: &Case| evaluate(case, world, 2).expect("an example evaluates");
    let values = values_of(&case);
    let field = values.first().and_then(Value::as_field)?;
    let before = case
        .graph
        .source(case.node, 0)
        .filter(|port| ty == PortType::Height && case.graph.output_type(*port) == PortType::Height);
    let seen = match ty {
        // from black at 0 to white at 1 in perceived brightness
        PortType::Mask => {
            let level: Vec<f32> = field.plane(0).iter().map(|v| math::f32::pow(v.clamp(0.0, 1.0), 2.2)).collect();
            Field::with_planes(*field.window(), 3, level.repeat(3))
        }
        PortType::Scalar(_) | PortType::Flow | PortType::Vector(_) => false_colours(field),
        PortType::Height => {
            let light = hillshade::Params::fitted(field).casting(field);
            let map = |height: &Field| {
                let [_, colour] = hillshade::relief(height, &light);
                colour
            };
            let cover = COVERS.iter().find(|cover| cover.id == node.id);
            let after = match cover {
                Some(cover) => {
                    let output = node.outputs.iter().position(|port| port.name == cover.output).expect("an output");
                    covered(hillshade::relief(field, &light), values.get(output).and_then(Value::as_field)?, cover)
                }
                None => map(field),
            };
            match before {
                Some(port) => {
                    let before = Case { name: case.name.clone(), graph: case.graph.clone(), node: port.node };
                    let values = values_of(&before);
                    beside(&map(values.get(port.output).and_then(Value::as_field)?), &after)
                }
                None => after,
            }
        }
        _ => picture::of_field(field, ty, View::Map),
    };
    Some(png(&seen))
}

/// A shaded relief with what a node lays on it.
fn covered([shade, colour]: [Field; 2], amount: &Field, cover: &Cover) -> Field {
    let window = *colour.window();
    let tint = light::linear(Srgb::hex(cover.colour));
    let brightest = shade.samples().iter().copied().fold(0.0, f32::max);
    let mut samples = colour.into_samples();
    for (plane, tint) in tint.into_iter().enumerate() {
        let plane = &mut samples[plane * window.len()..][..window.len()];
        for ((colour, shade), amount) in plane.iter_mut().zip(shade.samples()).zip(amount.samples()) {
            let share = (amount / cover.full).clamp(0.0, 1.0);
            let lit = tint as f32 * (0.3 + 0.7 * shade / brightest);
            *colour += share * (lit - *colour);
        }
    }
    Field::with_planes(window, 3, samples)
}

/// Two pictures of the same size, with a white gap between them.
fn beside(left: &Field, right: &Field) -> Field {
    let (nx, ny) = (left.window().nx(), left.window().ny());
    let cells = [2 * nx + GAP, ny];
    let mut samples = Vec::with_capacity(3 * cells[0] * cells[1]);
    for plane in 0..3 {
        for (left, right) in left.plane(plane).chunks(nx).zip(right.plane(plane).chunks(nx)) {
            samples.extend_from_slice(left);
            samples.extend([1.0; GAP]);
            samples.extend_from_slice(right);
        }
    }
    let cells = cells.map(|count| count as u32);
    let world = World { size: cells.map(f64::from), cells, ..World::default() };
    Field::with_planes(Window::whole(world), 3, samples)
}

/// Numbers in the colours of viridis: from the 1st to the 99th percentile, by order of magnitude if these span more
/// than three orders.
fn false_colours(field: &Field) -> Field {
    let at = |sorted: &[f32], share: f64| sorted[(share * (sorted.len() - 1) as f64) as usize];
    let mut sorted = field.plane(0).to_vec();
    sorted.sort_by(f32::total_cmp);
    let (low, middle, high) = (at(&sorted, 0.01), at(&sorted, 0.5), at(&sorted, 0.999));
    let skewed = low > 0.0 && high > 1000.0 * low && high > 20.0 * middle;
    let order = |v: f32| if skewed { math::f32::log10(v.max(low)) } else { v };
    let (low, high) = if skewed { (order(low), order(high)) } else { (low, at(&sorted, 0.99)) };
    let (low, high) = if low < high { (low, high) } else { (sorted[0], sorted[sorted.len() - 1] + 1e-3) };
    let stops: Vec<[f64; 3]> = Palette::Viridis.stops(0.0, 1.0).iter().map(|stop| light::linear(stop.colour)).collect();
    let mut planes = vec![0.0; 3 * field.window().len()];
    for (cell, value) in field.plane(0).iter().enumerate() {
        let place = f64::from(((order(*value) - low) / (high - low)).clamp(0.0, 1.0)) * (stops.len() - 1) as f64;
        let (below, above) = (stops[place as usize], stops[(place as usize + 1).min(stops.len() - 1)]);
        for colour in 0..3 {
            let mixed = below[colour] + (above[colour] - below[colour]) * place.fract();
            planes[colour * field.window().len() + cell] = mixed as f32;
        }
    }
    Field::with_planes(*field.window(), 3, planes)
}

/// Linear light as an 8-bit PNG with few levels.
fn png(colour: &Field) -> Vec<u8> {
    let code = |linear: f32| {
        let v = linear.clamp(0.0, 1.0);
        let code = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * math::f32::pow(v, 1.0 / 2.4) - 0.055 };
        ((code * LEVELS).round() / LEVELS * 255.0).round() as u8
    };
    let [nx, ny] = colour.window().cells;
    let image = RgbImage::from_fn(nx, ny, |i, j| {
        let at = j as usize * nx as usize + i as usize;
        Rgb([0, 1, 2].map(|plane| code(colour.plane(plane)[at])))
    });
    let mut bytes = Cursor::new(Vec::new());
    let grey = image.pixels().all(|Rgb([r, g, b])| r == g && g == b);
    if grey {
        let image = image::DynamicImage::ImageRgb8(image).into_luma8();
        image.write_to(&mut bytes, ImageFormat::Png).expect("a picture in memory");
    } else {
        image.write_to(&mut bytes, ImageFormat::Png).expect("a picture in memory");
    }
    bytes.into_inner()
}
