//! The picture of each node in the manual: its first raster on terrain that suits it. A node that changes what it is
//! given has that on the left.

use std::{
    io::Cursor,
    path::{Path, PathBuf},
};

use image::{DynamicImage, Rgb, RgbImage, codecs::jpeg::JpegEncoder};
use orograph::export::picture::{self, Around, Beside, View};
use orograph_graph::{
    Boundary, Document, Edge, Evaluator, EvaluatorOptions, Field, Graph, Node, Port, PortType, Srgb, Unit, Value,
    Window, World,
};
use orograph_nodes::{
    numerics::{light, math, palettes::Palette},
    registry,
    render::hillshade,
};

use crate::land::world;

mod lands;
mod subjects;

use subjects::{COVERS, Cover, SUBJECTS, Subject};

/// Pixels per side.
const SIDE: usize = 240;

/// Cells along a side of a pixel.
const FINER: usize = 2;

/// Pixels between two pictures.
const GAP: usize = 4;

/// Quality of the pictures, of 100.
const QUALITY: u8 = 85;

/// Largest share of a cover: the ground below it shows through.
const MOST_COVER: f32 = 0.85;

/// Nodes whose pictures have their own light.
const LIT: [&str; 4] = ["Hillshade", "Occlusion", "Slope", "Sun"];

/// The folder of the manual's pictures.
#[must_use]
pub fn pictures_folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/nodes/pictures")
}

/// The picture of a node as a JPEG: heights as a map, and what is measured on terrain as the viewport shows it there. A
/// node that makes terrain from terrain, or a mask from a mask, shows both. Returns None when the node gives no
/// raster.
///
/// # Panics
/// When the node has no subject, or its graph fails.
#[must_use]
pub fn picture(node: &'static Node) -> Option<Vec<u8>> {
    if node.is_subgraph() {
        return None;
    }
    let subject = SUBJECTS.iter().find(|subject| subject.id == node.id)?;
    let drawing = Drawing::new(subject);
    let drawn = |port: &Port| subject.output.is_none_or(|name| node.outputs[port.output].name == name);
    let raster = |port: &Port| drawing.graph.output_type(*port).planes().is_some();
    let port =
        (0..node.outputs.len()).map(|output| drawing.port("node", output)).find(|port| raster(port) && drawn(port))?;
    let ty = drawing.graph.output_type(port);
    let field = drawing.field(port)?;
    let before = drawing
        .graph
        .source(port.node, 0)
        .filter(|port| drawing.graph.output_type(*port) == ty && matches!(ty, PortType::Height | PortType::Mask));
    let before = before.and_then(|port| drawing.field(port));
    let ground = subject.has_base().then(|| drawing.field(drawing.port("base", 0))).flatten();
    let ground = ground.filter(|_| drawing.graph.output_type(drawing.port("base", 0)) == PortType::Height);
    let (before, after) = match ty {
        PortType::Height => {
            let light = hillshade::Params::fitted(&field).casting(&field);
            let after = match COVERS.iter().find(|cover| cover.id == node.id) {
                Some(cover) => covered(&field, &drawing.output(cover.output)?, &light, cover),
                None => relief(&field, &light, subject.palette),
            };
            (before.map(|before| relief(&before, &light, subject.palette)), after)
        }
        _ => match (COVERS.iter().find(|cover| cover.id == node.id), &ground) {
            (Some(cover), Some(ground)) => {
                let light = hillshade::Params::fitted(ground).casting(ground);
                (None, covered(ground, &drawing.output(cover.output)?, &light, cover))
            }
            _ => {
                let light = ground.as_ref().filter(|_| before.is_none() && !LIT.contains(&node.id));
                (before.map(|before| measured(&before, ty, None)), measured(&field, ty, light))
            }
        },
    };
    let [before, after] = [before, Some(after)].map(|picture| {
        let picture = shrunk(&picture?);
        Some(if node.id == "Tile" { tiled(&picture) } else { picture })
    });
    let after = after?;
    Some(match before {
        Some(before) => jpeg(&beside(&before, &after)),
        None => jpeg(&after),
    })
}

/// The graph of a picture.
struct Drawing {
    graph: Graph,
    world: World,
    evaluator: Evaluator,
}

impl Drawing {
    fn new(subject: &Subject) -> Self {
        let registry = registry();
        let kind = |id: &str| registry.get(id).expect("a node of the registry");
        let mut nodes: Vec<String> = subject
            .land
            .iter()
            .map(|(name, id, arguments)| format!("{name:?}: {}", kind(id).written(arguments)))
            .collect();
        nodes.push(format!("\"path\": {}", kind("Path").written("width: 200")));
        if subject.has_base() {
            for (name, id, arguments) in [
                ("flow", "Flow", r#"height: "base""#),
                ("streams", "Rivers", r#"flow: "flow.flow", channel_area: 4e6"#),
                ("strata", "Stratify", r#"height: "base", dip: 5"#),
                ("tint", "Ramp", r#"value: "base""#),
                ("relief", "Hillshade", r#"height: "base", tints: false"#),
            ] {
                nodes.push(format!("{name:?}: {}", kind(id).written(arguments)));
            }
        }
        nodes.push(format!("\"node\": {}", kind(subject.id).written(subject.arguments)));
        let text = format!("(nodes: {{ {} }}, outputs: {{ \"node\": \"node\" }})", nodes.join(",\n"));
        let document = Document::parse(text, &registry);
        let problems: Vec<&str> = document.problems().iter().map(|problem| problem.message.as_str()).collect();
        assert!(problems.is_empty(), "the subject of {} has problems: {problems:?}", subject.id);
        let graph = document.graph().clone();
        // a node that makes a coast is drawn with its sea
        let params = &graph.instance(graph.find("node").expect("just written")).params;
        let sea_level = params.get("sea").map(|_| params.read::<f64>("sea"));
        // the sides of a new file
        let boundary = Boundary::all(Edge::Inland);
        let world = World { sea_level, size: [subject.side_m; 2], boundary, ..world((SIDE * FINER) as u32) };
        let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("an evaluator");
        Self { graph, world, evaluator }
    }

    fn port(&self, name: &str, output: usize) -> Port {
        Port { node: self.graph.find(name).expect("a node of every picture"), output }
    }

    /// An output of the node.
    fn output(&self, name: &str) -> Option<Field> {
        let first = self.port("node", 0);
        let outputs = self.graph.instance(first.node).node.outputs;
        let output = outputs.iter().position(|port| port.name == name).expect("an output");
        self.field(Port { output, ..first })
    }

    fn field(&self, port: Port) -> Option<Field> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../graphs");
        let values = self.evaluator.values(&self.graph, &folder, &[port], Window::whole(self.world));
        values.expect("the graph of a picture").first().and_then(Value::as_field).cloned()
    }
}

/// A shaded relief in the colours of a map, or of a palette from the lowest to the highest place.
fn relief(height: &Field, light: &hillshade::Params, palette: Option<Palette>) -> Field {
    let [shade, colour] = hillshade::relief(height, light);
    let Some(palette) = palette else { return colour };
    let (low, high) = height.range(0).unwrap_or((0.0, 1.0));
    let stops: Vec<(f64, [f64; 3])> =
        palette.stops(0.0, 1.0).iter().map(|stop| (stop.at, light::linear(stop.colour))).collect();
    let tint = |v: f32, plane: usize| {
        let at = f64::from((v - low) / (high - low).max(1e-6));
        let next = stops.iter().position(|stop| stop.0 >= at).unwrap_or(stops.len() - 1).max(1);
        let ((from, a), (to, b)) = (stops[next - 1], stops[next]);
        (a[plane] + (b[plane] - a[plane]) * (at - from) / (to - from)) as f32
    };
    lit(height.window(), &shade, |cell, plane| tint(height.plane(0)[cell], plane))
}

/// Colours in the light on terrain.
fn lit(window: &Window, shade: &Field, colour: impl Fn(usize, usize) -> f32) -> Field {
    let planes = (0..3).flat_map(|plane| {
        let colour = &colour;
        shade.plane(0).iter().enumerate().map(move |(cell, shade)| colour(cell, plane) * (0.25 + 1.1 * shade))
    });
    Field::with_planes(*window, 3, planes.collect())
}

/// What is not a height: on the terrain it was measured on, if there is one.
fn measured(field: &Field, ty: PortType, ground: Option<&Field>) -> Field {
    let field = &within(field, ty);
    let below = |ground| Around { whole: field, beside: Beside::Ground { part: ground, whole: ground }, water: None };
    match (ty, ground) {
        (PortType::Colour, Some(ground)) => {
            let [shade, _] = hillshade::relief(ground, &hillshade::Params::fitted(ground));
            lit(field.window(), &shade, |cell, plane| field.plane(plane)[cell])
        }
        (PortType::Mask | PortType::Scalar(_), Some(ground)) => picture::of_part(field, ty, below(ground)),
        (PortType::Scalar(_), None) => picture::of_part(field, ty, Around::whole(field)),
        (PortType::Flow | PortType::Vector(_), _) => {
            let ty = PortType::Scalar(Unit::SquareMetres);
            match ground {
                Some(ground) => picture::of_part(field, ty, below(ground)),
                None => picture::of_part(field, ty, Around::whole(field)),
            }
        }
        _ => picture::of_field(field, ty, View::Map),
    }
}

/// Numbers between their 1st and 99th percentile, so that a few do not take all colours. Directions and numbers that
/// span more than three orders of magnitude keep all.
fn within(field: &Field, ty: PortType) -> Field {
    if !matches!(ty, PortType::Scalar(unit) if !matches!(unit, Unit::Azimuth | Unit::SquareMetres)) {
        return field.clone();
    }
    let mut sorted = field.plane(0).to_vec();
    sorted.sort_by(f32::total_cmp);
    let at = |share: f64| sorted[(share * (sorted.len() - 1) as f64) as usize];
    let (low, high) = (at(0.01), at(0.99));
    if low < high {
        Field::new(*field.window(), field.plane(0).iter().map(|v| v.clamp(low, high)).collect())
    } else {
        field.clone()
    }
}

/// A shaded relief with what a node lays on it.
fn covered(height: &Field, amount: &Field, params: &hillshade::Params, cover: &Cover) -> Field {
    let [shade, colour] = hillshade::relief(height, params);
    let window = *colour.window();
    let tint = light::linear(Srgb::hex(cover.colour));
    let brightest = shade.samples().iter().copied().fold(0.0, f32::max);
    let mut samples = colour.into_samples();
    for (plane, tint) in tint.into_iter().enumerate() {
        let plane = &mut samples[plane * window.len()..][..window.len()];
        for ((colour, shade), amount) in plane.iter_mut().zip(shade.samples()).zip(amount.samples()) {
            let share = MOST_COVER * (amount / cover.full).clamp(0.0, 1.0);
            let lit = tint as f32 * (0.3 + 0.7 * shade / brightest);
            *colour += share * (lit - *colour);
        }
    }
    Field::with_planes(window, 3, samples)
}

/// The means of cells in each pixel.
fn shrunk(colour: &Field) -> Field {
    let nx = colour.window().nx();
    let world = World { size: [SIDE as f64; 2], cells: [SIDE as u32; 2], ..World::default() };
    let mean = |plane: &[f32], pixel: usize| {
        let corner = pixel / SIDE * FINER * nx + pixel % SIDE * FINER;
        let rows = (0..FINER).map(|row| plane[corner + row * nx..][..FINER].iter().sum::<f32>());
        rows.sum::<f32>() / (FINER * FINER) as f32
    };
    let pixels = (0..3).flat_map(|plane| (0..SIDE * SIDE).map(move |pixel| mean(colour.plane(plane), pixel)));
    Field::with_planes(Window::whole(world), 3, pixels.collect())
}

/// Four copies of a picture at half its size, side by side.
fn tiled(picture: &Field) -> Field {
    let pixel = |plane: usize, pixel: usize| {
        let [i, j] = [pixel % SIDE, pixel / SIDE].map(|at| at * 2 % SIDE);
        let at = |i: usize, j: usize| picture.plane(plane)[j * SIDE + i];
        0.25 * (at(i, j) + at(i + 1, j) + at(i, j + 1) + at(i + 1, j + 1))
    };
    let pixel = &pixel;
    let pixels = (0..3).flat_map(|plane| (0..SIDE * SIDE).map(move |at| pixel(plane, at)));
    Field::with_planes(*picture.window(), 3, pixels.collect())
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

/// Linear light as a JPEG.
fn jpeg(colour: &Field) -> Vec<u8> {
    let code = |linear: f32| {
        let v = linear.clamp(0.0, 1.0);
        let code = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * math::f32::pow(v, 1.0 / 2.4) - 0.055 };
        (code * 255.0).round() as u8
    };
    let [nx, ny] = colour.window().cells;
    let image = RgbImage::from_fn(nx, ny, |i, j| {
        let at = j as usize * nx as usize + i as usize;
        Rgb([0, 1, 2].map(|plane| code(colour.plane(plane)[at])))
    });
    let mut image = DynamicImage::ImageRgb8(image);
    if image.as_rgb8().is_some_and(|image| image.pixels().all(|Rgb([r, g, b])| r == g && g == b)) {
        image = DynamicImage::ImageLuma8(image.into_luma8());
    }
    let mut bytes = Cursor::new(Vec::new());
    image.write_with_encoder(JpegEncoder::new_with_quality(&mut bytes, QUALITY)).expect("a picture in memory");
    bytes.into_inner()
}
