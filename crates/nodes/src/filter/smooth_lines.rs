//! Lines with rounder bends and more even profiles.

use orograph_graph::{Line, Lines, Vertex};

use crate::{
    numerics::{
        along::{averaged, distance, evenly},
        cover,
    },
    prelude::*,
};

params! {
    /// Length over which bends are rounded; 0 keeps the course.
    course: f64 = 300.0, Metres, 0.0..=1e6, soft 0..=2000;
    /// Length along the line over which elevations, widths and depths are averaged; 0 keeps them.
    profile: f64 = 500.0, Metres, 0.0..=1e6, soft 0..=5000;
}

inputs! {
    /// The lines.
    lines: Lines;
}

outputs! {
    /// The smoothed lines, in the same order.
    lines: Lines;
    /// Fraction of each cell that they cover with their widths.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "SmoothLines",
    category: "filter",
    summary: "Rounds the bends of lines and evens their profiles: rivers, roads.",
    doc: include_str!("smooth_lines.md"),
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    example: "lines: \"path.lines\", course: 4000, profile: 4000",
    ..Node::DEFAULT
};

/// Points over the length of a kernel.
const FINE: f64 = 16.0;
/// The reach to either side of each of two box filters, as a fraction of that length: together they are a triangle.
const SIDE: f64 = 0.25;
/// The least number of points of a line.
const LEAST: f64 = 64.0;
/// The largest number of points of all lines.
const MOST: f64 = 400_000.0;

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let (Inputs { lines }, wants) = (Inputs::read(job)?, Wants::of(job));
    let params = Params::read(job.params);
    let whole: f64 = lines.lines.iter().map(|line| length(&line.vertices)).sum();
    let smoothed = lines.lines.iter().map(|line| {
        job.check()?;
        Ok(params.smoothed(line, whole / MOST))
    });
    let smoothed = smoothed.collect::<Result<_, NodeError>>()?;
    // areas are those of the water surfaces, which do not change with how finely their shores are drawn
    let smoothed = Lines { lines: smoothed, areas: lines.areas.clone(), draped: lines.draped };
    let mask = wants.mask.then(|| cover::draw(job, &smoothed)).transpose()?;
    Ok(Given { lines: wants.lines.then_some(smoothed), mask: mask.map(|mask| Field::new(job.window(), mask)) }.into())
}

/// The length of a line in metres.
fn length(vertices: &[Vertex]) -> f64 {
    lengths(vertices).sum()
}

/// The lengths of its pieces in metres.
fn lengths(vertices: &[Vertex]) -> impl Iterator<Item = f64> {
    vertices.windows(2).map(|pair| distance(pair[0].position_m, pair[1].position_m))
}

impl Params {
    /// A smoothed line. Its points are at least `least_m` apart.
    fn smoothed(&self, line: &Line, least_m: f64) -> Line {
        let whole = length(&line.vertices);
        let closed = line.vertices.first().map(|v| v.position_m) == line.vertices.last().map(|v| v.position_m);
        let resampled = |kernel_m: f64| -> Option<(Vec<Vertex>, usize)> {
            let spacing_m = (kernel_m / FINE).min(whole / LEAST).max(least_m);
            let count = (whole / spacing_m).ceil();
            let side = (SIDE * kernel_m * count / whole).round();
            // a line without length has no count
            (side >= 1.0).then(|| (even(&line.vertices, count as usize), side as usize))
        };
        let mut vertices = line.vertices.clone();
        if let Some((even, side)) = resampled(self.course) {
            vertices = even;
            for axis in [0, 1] {
                smooth(&mut vertices, |vertex| &mut vertex.position_m[axis], side, closed);
            }
        }
        if let Some((mut even, side)) = resampled(self.profile) {
            let parts: [fn(&mut Vertex) -> &mut f64; 4] = [
                |vertex| &mut vertex.elevation_m,
                |vertex| &mut vertex.width_m,
                |vertex| &mut vertex.depth_m,
                |vertex| &mut vertex.area_m2,
            ];
            for part in parts {
                smooth(&mut even, part, side, closed);
            }
            // the new numbers at the same shares of the line
            let shares = shares(&vertices);
            for (vertex, share) in vertices.iter_mut().zip(shares) {
                let at = share * (even.len() - 1) as f64;
                let before = (at as usize).min(even.len() - 2);
                *vertex = Vertex {
                    position_m: vertex.position_m,
                    ..even[before].towards(&even[before + 1], at - before as f64)
                };
            }
        }
        Line { order: line.order, downstream: line.downstream, vertices }
    }
}

/// The fraction of a line's length up to each vertex.
fn shares(vertices: &[Vertex]) -> Vec<f64> {
    let whole = length(vertices);
    let mut way = 0.0;
    let steps = lengths(vertices).map(|length| {
        way += length;
        if whole > 0.0 { (way / whole).min(1.0) } else { 0.0 }
    });
    std::iter::once(0.0).chain(steps).collect()
}

/// Brings a line to `count` pieces of the same length.
fn even(vertices: &[Vertex], count: usize) -> Vec<Vertex> {
    let lengths: Vec<f64> = lengths(vertices).collect();
    let places = evenly(&lengths, count).take(count);
    let even = places.map(|place| vertices[place.piece].towards(&vertices[place.piece + 1], place.t));
    even.chain(vertices.last().copied()).collect()
}

/// Replaces a number of each point of a line by its average. The ends of an open line do not change.
fn smooth(points: &mut [Vertex], number: impl Fn(&mut Vertex) -> &mut f64, side: usize, closed: bool) {
    let values: Vec<f64> = points.iter_mut().map(|point| *number(point)).collect();
    let smoothed = if closed { around(&values, side) } else { averaged(&averaged(&values, side), side) };
    points.iter_mut().zip(smoothed).for_each(|(point, value)| *number(point) = value);
}

/// The averages of numbers along a ring, whose first is also its last.
fn around(values: &[f64], side: usize) -> Vec<f64> {
    // both filters reach around the ring
    let (count, pad) = (values.len() - 1, 2 * side.min(values.len()));
    let at = |at: usize| values[(at + count * pad.div_ceil(count) - pad) % count];
    let ring: Vec<f64> = (0..=count + 2 * pad).map(at).collect();
    let side = pad / 2;
    let mut round = averaged(&averaged(&ring, side), side)[pad..=pad + count].to_vec();
    // without a difference of rounding
    round[count] = round[0];
    round
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Cancel, Value, Wanted};

    use super::*;
    use crate::testing::{run_with, with_params, world};

    fn smoothed(changes: &str, lines: &Lines) -> Lines {
        let window = Window::whole(world(32, 32, 100.0));
        let value = |_: &str| Some(Value::from(lines.clone()));
        let params = with_params(&NODE, changes);
        let (outputs, _) = run_with(Wanted::ALL, &Cancel::default(), window, &NODE, &params, &value);
        outputs.expect("a result").take("lines").expect("an output").as_lines().expect("lines").clone()
    }

    /// A line along x with elevations, one vertex every 10 m.
    fn line(vertex: impl Fn(f64) -> ([f64; 2], f64)) -> Lines {
        let vertices = (0..=100).map(|k| {
            let (position_m, elevation_m) = vertex(10.0 * f64::from(k));
            Vertex { position_m, elevation_m, width_m: 8.0, ..Vertex::default() }
        });
        Lines::open(vec![Line { order: 3, downstream: None, vertices: vertices.collect() }])
    }

    #[test]
    fn short_bends_are_rounded_and_ends_stay() {
        // a zigzag of 40 m on a bend of 2 km
        let zigzag = line(|x| ([x, 500.0 + 10.0 * ((x / 10.0) % 2.0)], 0.0));
        let round = smoothed("course=200", &zigzag);
        let (first, last) = (round.lines[0].vertices.first(), round.lines[0].vertices.last());
        assert_eq!(
            (first.map(|v| v.position_m), last.map(|v| v.position_m)),
            (Some([0.0, 500.0]), Some([1000.0, 500.0]))
        );
        let middle = round.lines[0].vertices.iter().filter(|v| (150.0..850.0).contains(&v.position_m[0]));
        let ys: Vec<f64> = middle.map(|v| v.position_m[1]).collect();
        assert!(ys.len() > 40 && ys.iter().all(|y| (y - 505.0).abs() < 0.6), "{ys:?}");
        assert!((length(&round.lines[0].vertices) - 1000.0).abs() < 15.0);
        assert_eq!((round.lines[0].order, smoothed("course=0,profile=0", &zigzag)), (3, zigzag));
    }

    #[test]
    fn a_profile_without_rises_keeps_flowing_down() {
        let steps = line(|x| ([x, 300.0], 100.0 - 20.0 * (x / 300.0).floor()));
        let even = smoothed("course=0,profile=300", &steps);
        let heights: Vec<f64> = even.lines[0].vertices.iter().map(|v| v.elevation_m).collect();
        assert!(heights.windows(2).all(|pair| pair[1] <= pair[0] + 1e-9), "{heights:?}");
        let steepest = heights.windows(2).map(|pair| pair[0] - pair[1]).fold(0.0, f64::max);
        assert!(steepest < 3.0, "{steepest}");
        assert_eq!((heights[0], heights[100]), (100.0, 40.0));
        assert!(even.lines[0].vertices.iter().all(|v| v.width_m == 8.0 && v.position_m[1] == 300.0));
    }

    #[test]
    fn a_ring_stays_closed_and_round() {
        let corners = [[200.0, 200.0], [800.0, 200.0], [800.0, 800.0], [200.0, 800.0], [200.0, 200.0]];
        let vertices = corners.map(|position_m| Vertex { position_m, ..Vertex::default() }).to_vec();
        let ring = Lines { draped: true, ..Lines::open(vec![Line { order: 1, downstream: None, vertices }]) };
        let round = smoothed("course=400", &ring);
        let vertices = &round.lines[0].vertices;
        assert_eq!(vertices.first().map(|v| v.position_m), vertices.last().map(|v| v.position_m));
        // each corner is cut alike, the first one too
        let nearest =
            |corner: &[f64; 2]| vertices.iter().map(|v| distance(v.position_m, *corner)).fold(f64::INFINITY, f64::min);
        let cuts: Vec<f64> = corners.iter().map(nearest).collect();
        assert!(cuts.iter().all(|cut| *cut > 30.0 && (cut - cuts[0]).abs() < 4.0), "{cuts:?}");
        assert!(round.draped);
        // longer than the ring, and a ring without length
        assert!(
            smoothed("course=1e6,profile=1e6", &ring).lines[0].vertices.iter().all(|v| v.position_m[0].is_finite())
        );
        let point = line(|_| ([500.0, 500.0], 3.0));
        assert_eq!(smoothed("course=100", &point), point);
    }
}
