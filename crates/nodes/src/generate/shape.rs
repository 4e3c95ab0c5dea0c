//! Discs, rectangles, ellipses and polygons, by their signed distance.
//!
//! Distances to rectangles and polygons are those of their sides; that to an ellipse is found by bisection of the one equation
//! that the nearest point solves (D. Eberly, 2013, "Distance from a Point to an Ellipse").

use crate::{math, par, prelude::*};

choice! {
    /// What shape it is.
    pub enum Figure {
        /// A disc of the diameter that is the smaller of `size`.
        Disc = "disc",
        /// A rectangle of `size`.
        Rectangle = "rectangle",
        /// An ellipse as wide and long as `size`.
        Ellipse = "ellipse",
        /// A polygon with its corners along `path`, closed from the last to the first.
        Polygon = "polygon",
    }
}

params! {
    /// What shape it is.
    figure: Figure = Figure::Disc, One, ..;
    /// Middle of the shape, from the world's north-west corner; a polygon is where its path is.
    centre: [f64; 2] = [8192.0, 8192.0], Metres, -1e7..=1e7;
    /// Width across `azimuth` and length along it.
    size: [f64; 2] = [8000.0, 8000.0], Metres, 0.01..=1e7;
    /// Direction of the shape's length, clockwise from north.
    azimuth: f64 = 0.0, Degrees, -360.0..=360.0, soft 0..=180;
    /// Corners of a polygon.
    path: PathPoints = PathPoints(vec![[3000.0, 12000.0], [6000.0, 3000.0], [13000.0, 5000.0], [12000.0, 13000.0]]), Metres, -1e7..=1e7;
    /// Radius of the corners: a rectangle is cut by it, a polygon grows by it.
    rounding: f64 = 0.0, Metres, 0.0..=1e7, soft 0..=2000;
    /// Width over which the mask goes from 1 to 0, half of it on each side of the outline; a cell at least.
    softness: f64 = 1000.0, Metres, 0.0..=1e7, soft 0..=5000;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Shape",
    category: "generate",
    summary: "A disc, rectangle, ellipse or polygon: its mask and the distance to its outline.",
    doc: "`mask` selects the inside with an edge as soft as `softness` says, for islands, plains and whatever a node should be \
          limited to. `distance` is that to the outline in metres, below 0 inside; with `Curve` it becomes any profile: a \
          plateau with cliffs, a rampart, a moat.\n\n\
          A polygon may cross itself: what its outline goes around an odd number of times is inside.",
    sources: &["D. Eberly (2013), Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid"],
    outputs: &[
        Output::gives("mask", PortType::Mask, "1 inside and 0 outside, softly."),
        Output::gives("distance", PortType::Scalar(Unit::Metres), "Distance to the outline, below 0 inside."),
    ],
    params: Params::specs,
    cpu: run,
    example: "figure: ellipse, size: (6000, 10000), azimuth: 30",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let outline = Outline::new(&params);
    let window = job.window();
    let azimuth = params.azimuth.to_radians();
    let (cos, sin) = (math::cos(azimuth), math::sin(azimuth));
    let mut distance = vec![0.0; window.len()];
    par::rows_within(job, [0.0, 0.9], &mut distance, |j, row| {
        for (i, distance) in row.iter_mut().enumerate() {
            let [x, y] = window.centre_m(i, j);
            let (dx, dy) = (x - params.centre[0], y - params.centre[1]);
            *distance = outline.distance([x, y], [dx * cos + dy * sin, dx * sin - dy * cos]) as f32;
        }
    })?;
    let per_softness = (1.0 / params.softness.max(job.cell_m())) as f32;
    let mut mask = vec![0.0; window.len()];
    par::rows_within(job, [0.9, 1.0], &mut mask, |j, row| {
        for (mask, distance) in row.iter_mut().zip(&distance[j * window.nx()..]) {
            *mask = math::lane::smoothstep(0.5 - distance * per_softness);
        }
    })?;
    Ok(Outputs::one("mask", Field::new(window, mask)).with("distance", Field::new(window, distance)))
}

/// An outline; half sizes in metres.
enum Outline<'a> {
    Disc(f64),
    Rectangle { inner: [f64; 2], rounding_m: f64 },
    Ellipse([f64; 2]),
    Polygon { corners: &'a [[f64; 2]], rounding_m: f64 },
}

impl<'a> Outline<'a> {
    fn new(params: &'a Params) -> Self {
        let half = params.size.map(|size_m| 0.5 * size_m);
        let least = half[0].min(half[1]);
        match params.figure {
            Figure::Disc => Self::Disc(least),
            Figure::Rectangle => {
                let rounding_m = params.rounding.min(least);
                Self::Rectangle { inner: half.map(|half_m| half_m - rounding_m), rounding_m }
            }
            Figure::Ellipse if half[0] == half[1] => Self::Disc(least),
            Figure::Ellipse => Self::Ellipse(half),
            Figure::Polygon => Self::Polygon { corners: &params.path.0, rounding_m: params.rounding },
        }
    }

    /// The signed distance of a place in the world, which is so far across and along from the middle.
    fn distance(&self, place: [f64; 2], from_middle: [f64; 2]) -> f64 {
        let [across, along] = from_middle.map(f64::abs);
        match self {
            Self::Disc(radius_m) => (across * across + along * along).sqrt() - radius_m,
            Self::Rectangle { inner, rounding_m } => {
                let beyond = [across - inner[0], along - inner[1]];
                let out = beyond.map(|beyond_m| beyond_m.max(0.0));
                (out[0] * out[0] + out[1] * out[1]).sqrt() + beyond[0].max(beyond[1]).min(0.0) - rounding_m
            }
            Self::Ellipse(half) => {
                if half[0] > half[1] {
                    to_ellipse(*half, [across, along])
                } else {
                    to_ellipse([half[1], half[0]], [along, across])
                }
            }
            Self::Polygon { corners, rounding_m } => to_polygon(corners, place) - rounding_m,
        }
    }
}

/// The signed distance to an ellipse of half axes `a > b` of a place in the first quarter.
fn to_ellipse([a, b]: [f64; 2], [x, y]: [f64; 2]) -> f64 {
    let (u, v) = (x / a, y / b);
    let inside = u * u + v * v < 1.0;
    // the nearest point is (a² x / (a² + t), b² y / (b² + t)), t above −b², where it lies on the ellipse
    let on = |t: f64| {
        let (p, q) = (a * x / (a * a + t), b * y / (b * b + t));
        p * p + q * q - 1.0
    };
    let (mut low, mut high) = (-b * b + b * y, -b * b + (a * a * x * x + b * b * y * y).sqrt());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if on(middle) > 0.0 { low = middle } else { high = middle }
    }
    let p = a * a * x / (a * a + high);
    // close to the long axis the second part is 0/0; being on the ellipse says it as well
    let q = b * (1.0 - (p / a) * (p / a)).max(0.0).sqrt();
    let distance = ((x - p) * (x - p) + (y - q) * (y - q)).sqrt();
    if inside { -distance } else { distance }
}

/// The signed distance to a closed polygon.
fn to_polygon(corners: &[[f64; 2]], [x, y]: [f64; 2]) -> f64 {
    let (mut nearest, mut inside) = (f64::INFINITY, false);
    let ends = corners.iter().cycle().skip(1);
    for (&[x0, y0], &[x1, y1]) in corners.iter().zip(ends) {
        let (ex, ey, dx, dy) = (x1 - x0, y1 - y0, x - x0, y - y0);
        let square = ex * ex + ey * ey;
        // a path may end where it began
        let t = if square > 0.0 { ((dx * ex + dy * ey) / square).clamp(0.0, 1.0) } else { 0.0 };
        let (px, py) = (dx - t * ex, dy - t * ey);
        nearest = nearest.min(px * px + py * py);
        if (y0 > y) != (y1 > y) && x < x0 + (y - y0) / ey * ex {
            inside = !inside;
        }
    }
    if inside { -nearest.sqrt() } else { nearest.sqrt() }
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

    /// Every distance against that to points close together along the outline.
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
        // five metres from the middle, 200 m inside, where the edge is no more
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
