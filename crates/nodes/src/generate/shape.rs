//! Discs, rectangles, ellipses and polygons, by their signed distance.
//!
//! Distances to rectangles and polygons are those to their sides; for an ellipse the equation of the nearest point is
//! solved (D. Eberly, 2013, "Distance from a Point to an Ellipse"). All are loops over rows in double precision.

use orograph_graph::memory::zeroed;

use crate::{
    numerics::{math, par, simd::simd},
    prelude::*,
    wgsl,
};

choice! {
    /// Kind of shape.
    pub enum Figure {
        /// A disc whose diameter is the smaller of `size`.
        Disc = "disc",
        /// A rectangle of `size`.
        Rectangle = "rectangle",
        /// An ellipse with the width and length of `size`.
        Ellipse = "ellipse",
        /// A polygon with its corners along `path`, closed from the last to the first.
        Polygon = "polygon",
    }
}

params! {
    /// Kind of shape.
    figure: Figure = Figure::Disc, One, ..;
    /// Centre of the shape, from the world's north-west corner; not used by polygons, which lie where their path is.
    centre: Position = Position([8192.0, 8192.0]), Metres, -1e7..=1e7, when figure = "disc" | "rectangle" | "ellipse";
    /// Width across `azimuth` and length along it.
    size: [f64; 2] = [8000.0, 8000.0], Metres, 0.01..=1e7, when figure = "disc" | "rectangle" | "ellipse";
    /// Direction of the shape's length, clockwise from north.
    azimuth: f64 = 0.0, Degrees, -360.0..=360.0, soft 0..=180, when figure = "rectangle" | "ellipse";
    /// Corners of a polygon.
    path: OutlinePoints = OutlinePoints(vec![[3000.0, 12000.0], [6000.0, 3000.0], [13000.0, 5000.0], [12000.0, 13000.0]]), Metres, -1e7..=1e7, when figure = "polygon";
    /// Radius of the corners: a rectangle's corners are cut by it, a polygon grows by it.
    rounding: f64 = 0.0, Metres, 0.0..=1e7, soft 0..=2000, when figure = "rectangle" | "polygon";
    /// Width over which the mask falls from 1 to 0, half of it on each side of the outline; at least one cell.
    softness: f64 = 1000.0, Metres, 0.0..=1e7, soft 0..=5000;
}

outputs! {
    /// 1 inside and 0 outside, with a soft edge.
    mask: Mask;
    /// Distance to the outline, negative inside.
    distance: Scalar(Metres);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Shape",
    category: "generate",
    summary: "A disc, rectangle, ellipse or polygon: its mask and the distance to its outline.",
    doc: include_str!("shape.md"),
    sources: &[
        "D. Eberly (2013), Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid",
        "J. J. Moré and D. C. Sorensen (1983), Computing a trust region step, SIAM Journal on Scientific and Statistical \
         Computing 4 (3), 553-572",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    gpu: Some(&GPU),
    example: "figure: ellipse, size: (6000, 10000), azimuth: 30",
    ..Node::DEFAULT
};

static SHADER: Shader = Shader {
    name: "generate/shape",
    source: wgsl!("generate/shape"),
    library: &[wgsl::MATH],
    values: &[
        ("from_centre_x", Number::F32),
        ("from_centre_y", Number::F32),
        ("sine", Number::F32),
        ("cosine", Number::F32),
        ("inner_x", Number::F32),
        ("inner_y", Number::F32),
        ("cut", Number::F32),
        ("radius", Number::F32),
        ("per_softness", Number::F32),
        ("corners", Number::U32),
    ],
    slots: &[Slot::words("path_of", "f32"), Slot::output("mask"), Slot::output("distance")],
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&SHADER],
    passes: Passes::Recorded(record),
    // positions in single precision: near the world; the point of an ellipse needs more
    covers: |params| {
        let params = Params::read(params);
        let points = params.path.0.iter().chain([&params.centre, &params.size]);
        let near = points.flatten().all(|v| v.abs() <= 1e5) && params.rounding <= 1e5;
        near && (params.figure != Figure::Ellipse || params.size[0] == params.size[1])
    },
    tolerance: &[Tolerance::absolute(2e-3), Tolerance::relative(2e-6)],
    ..GpuKernel::DEFAULT
};

fn record(job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    let params = Params::read(job.params);
    let [x, y] = job.window().centre_m(0, 0);
    let corners = params.path.0.iter().flat_map(|[east, south]| [east - x, south - y].map(|v| (v as f32).to_bits()));
    let path_of = recorder.table(&corners.collect::<Vec<u32>>())?;
    let half = params.size.map(|size_m| 0.5 * size_m);
    let least = half[0].min(half[1]);
    let rounding_m = params.rounding.min(least);
    let turn = Turn::new(params.centre.0, params.azimuth);
    let numbers = [
        ("from_centre_x", x - params.centre[0]),
        ("from_centre_y", y - params.centre[1]),
        ("sine", turn.sin),
        ("cosine", turn.cos),
        ("inner_x", half[0] - rounding_m),
        ("inner_y", half[1] - rounding_m),
        ("cut", rounding_m),
        ("radius", least),
        ("per_softness", 1.0 / params.softness.max(job.cell_m())),
    ];
    let mut values = numbers.map(|(name, value)| (name, Scalar::F32(value as f32))).to_vec();
    values.push(("corners", Scalar::U32(params.path.0.len() as u32)));
    recorder.pass(&Pass {
        shader: &SHADER,
        entry: "main",
        bind: &[("path_of", Bind::Scratch(path_of))],
        values: &values,
        over: Over::Cells(Rows::Around(0)),
    })
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let window = job.window();
    let xs: Vec<f64> = (0..window.nx()).map(|i| window.centre_m(i, 0)[0]).collect();
    let half = params.size.map(|size_m| 0.5 * size_m);
    let least = half[0].min(half[1]);
    let turn = Turn::new(params.centre.0, params.azimuth);
    let rounding_m = params.rounding.min(least);
    let inner = half.map(|half_m| half_m - rounding_m);
    let mut distance = zeroed(window.len())?;
    par::rows_within(job, [0.0, 0.9], &mut distance, |j, row| {
        let y = window.centre_m(0, j)[1];
        match params.figure {
            Figure::Disc => along(row, &xs, y, &turn, &Disc(least)),
            Figure::Rectangle => along(row, &xs, y, &turn, &Rectangle { inner, rounding_m }),
            Figure::Ellipse if half[0] == half[1] => along(row, &xs, y, &turn, &Disc(least)),
            Figure::Ellipse => along(row, &xs, y, &turn, &Ellipse(half)),
            Figure::Polygon => to_polygon(row, &xs, y, &params.path.0, params.rounding),
        }
    })?;
    let per_softness = (1.0 / params.softness.max(job.cell_m())) as f32;
    let wants = Wants::of(job);
    let mask = |_, row: &mut [f32]| soften(row, per_softness);
    let field = |samples| Field::new(window, samples);
    Ok(Given {
        mask: wants
            .mask
            .then(|| par::rows_from(job, [0.9, 1.0], &mut distance, wants.distance, mask))
            .transpose()?
            .map(field),
        distance: wants.distance.then(|| field(distance)),
    }
    .into())
}

simd! {
    /// Converts distances to a mask.
    fn soften(distances: &mut [f32], per_softness: f32) {
        for distance in distances {
            *distance = math::lane::smoothstep(0.5 - *distance * per_softness);
        }
    }
}

/// Transforms places of the world to the axes of a figure: across its length and along it, from its centre.
struct Turn {
    centre: [f64; 2],
    cos: f64,
    sin: f64,
}

impl Turn {
    fn new(centre: [f64; 2], azimuth: f64) -> Self {
        let azimuth = azimuth.to_radians();
        Self { centre, cos: math::cos(azimuth), sin: math::sin(azimuth) }
    }
}

/// Places of a row that are computed in parallel.
const LANES: usize = 16;

/// A figure with two axes of symmetry, across its length and along it; half sizes in metres.
trait Figured {
    /// Returns the signed distances at the offsets `across` and `along` from the centre, both at least 0.
    fn distances(&self, across: &[f64; LANES], along: &[f64; LANES]) -> [f64; LANES];
}

struct Disc(f64);

impl Figured for Disc {
    #[inline(always)]
    fn distances(&self, across: &[f64; LANES], along: &[f64; LANES]) -> [f64; LANES] {
        let mut distances = [0.0; LANES];
        for lane in 0..LANES {
            let (x, y) = (across[lane], along[lane]);
            distances[lane] = (x * x + y * y).sqrt() - self.0;
        }
        distances
    }
}

struct Rectangle {
    inner: [f64; 2],
    rounding_m: f64,
}

impl Figured for Rectangle {
    #[inline(always)]
    fn distances(&self, across: &[f64; LANES], along: &[f64; LANES]) -> [f64; LANES] {
        let mut distances = [0.0; LANES];
        for lane in 0..LANES {
            let (x, y) = (across[lane] - self.inner[0], along[lane] - self.inner[1]);
            let (out_x, out_y) = (x.max(0.0), y.max(0.0));
            distances[lane] = (out_x * out_x + out_y * out_y).sqrt() + x.max(y).min(0.0) - self.rounding_m;
        }
        distances
    }
}

struct Ellipse([f64; 2]);

/// Newton steps towards the nearest point of an ellipse.
const STEPS: usize = 14;

impl Figured for Ellipse {
    /// The nearest point of an ellipse with half axes `a > b` is `(p, q) = (a² x / (a² + t), b² y / (b² + t))`, where t
    /// is above −b² and the root of `G(t) = (p / a)² + (q / b)² = 1`. `1 / √G` is nearly linear, and Newton's method
    /// for it, started at a t below the root, never overshoots (Moré and Sorensen, 1983). Convergence is slowest at the
    /// centres of curvature of the vertices on the long axis, where the nearest point is nearly degenerate: there the
    /// error is 10⁻⁸ of the longer axis.
    #[inline(always)]
    fn distances(&self, across: &[f64; LANES], along: &[f64; LANES]) -> [f64; LANES] {
        let wide = self.0[0] > self.0[1];
        let (a, b) = if wide { (self.0[0], self.0[1]) } else { (self.0[1], self.0[0]) };
        let (xs, ys) = if wide { (across, along) } else { (along, across) };
        let (mut axs, mut bys, mut ts) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let (ax, by) = (a * xs[lane], b * ys[lane].max(1e-12 * b));
            (axs[lane], bys[lane], ts[lane]) = (ax, by, (by - b * b).max(ax - a * a));
        }
        for _ in 0..STEPS {
            for lane in 0..LANES {
                let (u, v) = (a * a + ts[lane], b * b + ts[lane]);
                let both = 1.0 / (u * v);
                let (per_u, per_v) = (v * both, u * both);
                let (p, q) = (axs[lane] * per_u, bys[lane] * per_v);
                let (pp, qq) = (p * p, q * q);
                let g = pp + qq;
                ts[lane] += (g * (g.sqrt() - 1.0)).max(0.0) / (pp * per_u + qq * per_v);
            }
        }
        let mut distances = [0.0; LANES];
        for lane in 0..LANES {
            let (x, y) = (xs[lane], ys[lane]);
            let share = (axs[lane] / (a * a + ts[lane])).min(1.0);
            // close to the long axis the second component is 0/0; the equation of the ellipse gives it there
            let (dx, dy) = (x - a * share, y - b * (1.0 - share * share).max(0.0).sqrt());
            let distance = (dx * dx + dy * dy).sqrt();
            let (u, v) = (x / a, y / b);
            distances[lane] = if u * u + v * v < 1.0 { -distance } else { distance };
        }
        distances
    }
}

simd! {
    /// Computes the signed distances of a row.
    fn along<F: Figured>(row: &mut [f32], xs: &[f64], y: f64, turn: &Turn, figure: &F) {
        let dy = y - turn.centre[1];
        for (row, xs) in row.chunks_mut(LANES).zip(xs.chunks(LANES)) {
            let mut places = [0.0; LANES];
            places[..xs.len()].copy_from_slice(xs);
            let (mut across, mut along) = ([0.0; LANES], [0.0; LANES]);
            for lane in 0..LANES {
                let dx = places[lane] - turn.centre[0];
                across[lane] = (dx * turn.cos + dy * turn.sin).abs();
                along[lane] = (dx * turn.sin - dy * turn.cos).abs();
            }
            let distances = figure.distances(&across, &along);
            for (out, distance) in row.iter_mut().zip(distances) {
                *out = distance as f32;
            }
        }
    }
}

/// Computes the signed distances of a row to a closed polygon that is expanded by a length.
fn to_polygon(row: &mut [f32], xs: &[f64], y: f64, corners: &[[f64; 2]], grown_m: f64) {
    let (mut nearest, mut signs) = (vec![f64::INFINITY; row.len()], vec![1.0; row.len()]);
    let ends = corners.iter().cycle().skip(1);
    for (&from, &to) in corners.iter().zip(ends) {
        side(&mut nearest, &mut signs, xs, y, [from, to]);
    }
    for ((distance, nearest), sign) in row.iter_mut().zip(nearest).zip(signs) {
        *distance = (sign * nearest.sqrt() - grown_m) as f32;
    }
}

simd! {
    /// Takes the minimum of squared distances with those to a side of a polygon, and flips the signs of places west of
    /// the side.
    fn side(nearest: &mut [f64], signs: &mut [f64], xs: &[f64], y: f64, ends: [[f64; 2]; 2]) {
        let [[x0, y0], [x1, y1]] = ends;
        let (ex, ey, dy) = (x1 - x0, y1 - y0, y - y0);
        let square = ex * ex + ey * ey;
        // a path may end at its first point
        let per_square = if square > 0.0 { 1.0 / square } else { 0.0 };
        let crossing = if (y0 > y) != (y1 > y) { x0 + dy / ey * ex } else { f64::NEG_INFINITY };
        for ((nearest, sign), &x) in nearest.iter_mut().zip(signs).zip(xs) {
            let dx = x - x0;
            let t = ((dx * ex + dy * ey) * per_square).clamp(0.0, 1.0);
            let (px, py) = (dx - t * ex, dy - t * ey);
            let here = px * px + py * py;
            *nearest = if here < *nearest { here } else { *nearest };
            *sign = if x < crossing { -*sign } else { *sign };
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::ParamValue;

    use super::*;
    use crate::testing::{outputs_on, with_params, world};

    fn shape(changes: &str, size: [f64; 2], path: Option<&[[f64; 2]]>) -> [Field; 2] {
        let mut params = with_params(&NODE, changes);
        params.set("centre", ParamValue::Point([500.0, 600.0]));
        params.set("size", ParamValue::Point(size));
        if let Some(path) = path {
            params.set("path", ParamValue::Path(path.to_vec()));
        }
        let mut outputs = outputs_on(Window::whole(world(100, 120, 10.0)), &NODE, &params, &[]).expect("a result");
        ["mask", "distance"].map(|name| outputs.take(name).expect("an output").as_field().expect("a field").clone())
    }

    /// Compares every distance with that to closely spaced points on the outline.
    fn assert_distances(distance: &Field, outline: impl Fn(f64) -> [f64; 2], inside: impl Fn(f64, f64) -> bool) {
        let points: Vec<[f64; 2]> = (0..20_000).map(|k| outline(f64::from(k) / 20_000.0)).collect();
        for at in (0..12_000).step_by(37) {
            let [x, y] = distance.window().centre_m(at % 100, at / 100);
            let nearest = points.iter().map(|[px, py]| math::hypot(x - px, y - py)).fold(f64::INFINITY, f64::min);
            let expected = if inside(x, y) { -nearest } else { nearest };
            // points are 0.2 m apart
            assert!((f64::from(distance.samples()[at]) - expected).abs() < 0.12, "({x}, {y}): {expected}");
        }
    }

    #[test]
    fn an_ellipse_is_as_far_as_its_nearest_point() {
        for (size, azimuth) in
            [([300.0, 800.0], 0.0), ([300.0, 800.0], 30.0), ([700.0, 100.0], 90.0), ([400.0, 400.0], 10.0)]
        {
            let [_, distance] = shape(&format!("figure=ellipse,azimuth={azimuth}"), size, None);
            let (cos, sin) = (math::cos(f64::to_radians(azimuth)), math::sin(f64::to_radians(azimuth)));
            let outline = |t: f64| {
                let angle = std::f64::consts::TAU * t;
                let (across, along) = (0.5 * size[0] * math::cos(angle), 0.5 * size[1] * math::sin(angle));
                [500.0 + across * cos + along * sin, 600.0 + across * sin - along * cos]
            };
            assert_distances(&distance, outline, |x, y| {
                let (dx, dy) = (x - 500.0, y - 600.0);
                let (across, along) = (2.0 * (dx * cos + dy * sin) / size[0], 2.0 * (dx * sin - dy * cos) / size[1]);
                across * across + along * along < 1.0
            });
        }
    }

    /// A rectangle, and the same rectangle as a polygon.
    #[test]
    fn a_rectangle_is_the_polygon_of_its_corners() {
        let corners = [[300.0, 350.0], [700.0, 350.0], [700.0, 850.0], [300.0, 850.0]];
        let closed = [corners[0], corners[1], corners[2], corners[3], corners[0]];
        let [mask, rectangle] = shape("figure=rectangle,softness=300", [400.0, 500.0], None);
        for path in [&corners[..], &closed[..]] {
            let [_, polygon] = shape("figure=polygon", [1.0, 1.0], Some(path));
            assert!(rectangle.samples().iter().zip(polygon.samples()).all(|(a, b)| (a - b).abs() < 1e-3));
        }
        let [_, larger] = shape("figure=polygon,rounding=50", [1.0, 1.0], Some(&corners));
        let [_, rounded] = shape("figure=rectangle,rounding=50", [500.0, 600.0], None);
        let outside = larger.samples().iter().zip(rounded.samples()).filter(|(_, distance)| **distance > -50.0);
        assert!(outside.into_iter().all(|(a, b)| (a - b).abs() < 1e-3));
        // five metres from the centre, 200 m inside, away from the soft edge
        assert_eq!(mask.samples()[60 * 100 + 50], 1.0);
        assert!((rectangle.samples()[60 * 100 + 50] + 195.0).abs() < 1e-3);
    }

    #[test]
    fn a_disc_has_an_edge_as_soft_as_asked_and_a_cell_at_least() {
        let [soft, distance] = shape("softness=200", [400.0, 600.0], None);
        for (mask, distance) in soft.samples().iter().zip(distance.samples()) {
            let t = (0.5 - f64::from(*distance) / 200.0).clamp(0.0, 1.0);
            assert!((f64::from(*mask) - t * t * (3.0 - 2.0 * t)).abs() < 1e-6);
        }
        let [hard, _] = shape("softness=0", [400.0, 600.0], None);
        let area = hard.samples().iter().map(|v| f64::from(*v)).sum::<f64>() * 100.0;
        assert!((area / (std::f64::consts::PI * 200.0 * 200.0) - 1.0).abs() < 2e-3, "{area}");
    }
}
