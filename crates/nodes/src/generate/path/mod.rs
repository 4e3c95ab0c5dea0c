//! A path that is drawn or read from a file, as lines.

#[cfg(test)]
mod tests;

use orograph_graph::{Line, Lines, Vertex, Waypoint};

use crate::{
    numerics::{
        cover,
        spline::{hermite, tangent},
    },
    prelude::*,
    vector::{self, Polyline},
};

params! {
    /// Points along the path; not used if a `file` is given.
    ///
    /// A point is a position, or a position with a height, a width or both: `(at: (2000, 3500), height: 420, width: 12)`.
    points: Waypoints = Waypoints::through(&[[1500.0, 3000.0], [4500.0, 4500.0], [6500.0, 8000.0], [10000.0, 9000.0], [14500.0, 14000.0]]), Metres, -1e7..=1e7;
    /// A GeoJSON or SVG file whose lines are used instead, relative to the graph's folder.
    file: FileName = FileName::default(), One, ..;
    /// How round the path is at its points: 0 for straight stretches with corners.
    curve: f64 = 1.0, One, 0.0..=1.0;
    /// Whether the last point is joined to the first.
    closed: bool = false, One, ..;
    /// Width of a path whose points have none.
    width: f64 = 20.0, Metres, 0.0..=1e6, soft 0..=500;
}

outputs! {
    /// The path, or each line of the file.
    lines: Lines;
    /// Fraction of each cell that the path covers with its width.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Path",
    category: "generate",
    summary: "A path drawn by hand or read from GeoJSON or SVG: the line of a river, a road, a ridge.",
    doc: include_str!("page.md"),
    sources: &[
        "H. Butler et al. (2016), The GeoJSON format, RFC 7946, Internet Engineering Task Force",
        "E. Catmull and R. Rom (1974), A class of local interpolating splines, Computer Aided Geometric Design, 317-326",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    reads_place: true,
    cpu: run,
    example: "points: [(1500, 3000), (at: (8000, 9000), width: 900), (14500, 12000)], width: 300",
    ..Node::DEFAULT
};

/// Straight pieces between two points of a round path, and of all points together.
const PIECES: usize = 16;
const MOST: usize = 400_000;

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let drawn = if params.file.0.is_empty() {
        vec![Polyline { points: params.points.0.clone(), closed: params.closed }]
    } else {
        let drawing = vector::read(&job.file("file")?, job.world())?;
        if drawing.skipped > 0 {
            job.warn(format!(
                "{} points, texts or pictures of the file are not lines and are left out",
                drawing.skipped
            ));
        }
        drawing.lines.into_iter().map(|line| Polyline { closed: line.closed || params.closed, ..line }).collect()
    };
    let size = job.world().size;
    let is_inside = |point: &Waypoint| (0..2).all(|axis| (0.0..=size[axis]).contains(&point.at[axis]));
    if !drawn.iter().flat_map(|line| &line.points).any(is_inside) {
        job.warn("no point of the path is in the world; move the points, or check the coordinates of the file");
    }
    let count: usize = drawn.iter().map(|line| line.points.len()).sum();
    let pieces = if params.curve > 0.0 { (MOST / count.max(1)).clamp(1, PIECES) } else { 1 };
    let draped = drawn.iter().flat_map(|line| &line.points).all(|point| point.height.is_none());
    let lines = drawn.iter().map(|line| params.line(line, pieces)).collect();
    let lines = Lines { draped, ..Lines::open(lines) };
    let wants = Wants::of(job);
    let mask = wants.mask.then(|| cover::draw(job, &lines)).transpose()?;
    Ok(Given { lines: wants.lines.then_some(lines), mask: mask.map(|mask| Field::new(job.window(), mask)) }.into())
}

impl Params {
    /// The line through points, with straight pieces between them.
    fn line(&self, Polyline { points, closed }: &Polyline, pieces: usize) -> Line {
        let mut places: Vec<[f64; 2]> = points.iter().map(|point| point.at).collect();
        let mut heights: Vec<Option<f64>> = points.iter().map(|point| point.height).collect();
        let mut widths: Vec<Option<f64>> = points.iter().map(|point| point.width).collect();
        let closed = *closed && places.len() > 2;
        if closed {
            places.push(places[0]);
            heights.push(heights[0]);
            widths.push(widths[0]);
        }
        let ways = ways(&places);
        let heights = between(&ways, &heights, 0.0);
        let widths = between(&ways, &widths, self.width);
        let vertex = |at: usize| Vertex {
            position_m: places[at],
            elevation_m: heights[at],
            width_m: widths[at],
            ..Vertex::default()
        };
        let mut vertices = vec![vertex(0)];
        for at in 1..places.len() {
            let [from, to] = [vertex(at - 1), vertex(at)];
            let around = |at: usize| self.direction(&places, at, closed);
            let length = ways[at] - ways[at - 1];
            let slopes = [around(at - 1), around(at)].map(|unit| unit.map(|part| self.curve * length * part));
            vertices.extend((1..pieces).map(|k| {
                let t = k as f64 / pieces as f64;
                let [position_m, _] = hermite([from.position_m, to.position_m], slopes, t);
                Vertex { position_m, ..from.towards(&to, t) }
            }));
            vertices.push(to);
        }
        Line { order: 1, downstream: None, vertices }
    }

    /// The direction of a round path at a point: from its neighbour before to the one after it.
    fn direction(&self, places: &[[f64; 2]], at: usize, closed: bool) -> [f64; 2] {
        let last = places.len() - 1;
        let (before, after) = match at {
            0 if closed => (last - 1, 1),
            _ if at == last && closed => (last - 1, 1),
            _ => (at.saturating_sub(1), last.min(at + 1)),
        };
        tangent(places[before], places[after])
    }
}

/// The length of the path up to each point.
fn ways(places: &[[f64; 2]]) -> Vec<f64> {
    let mut way = 0.0;
    let steps = places.windows(2).map(|pair| {
        let [x, y] = [0, 1].map(|axis| pair[1][axis] - pair[0][axis]);
        way += (x * x + y * y).sqrt();
        way
    });
    std::iter::once(0.0).chain(steps).collect()
}

/// A number for each point: what is missing lies between the numbers of the points before and after it, in proportion to
/// the way; before the first and after the last it is theirs, and `other` if there are none.
fn between(ways: &[f64], numbers: &[Option<f64>], other: f64) -> Vec<f64> {
    let known: Vec<(f64, f64)> =
        ways.iter().zip(numbers).filter_map(|(way, number)| Some((*way, (*number)?))).collect();
    let (Some(first), Some(last)) = (known.first(), known.last()) else { return vec![other; ways.len()] };
    let mut next = 0_usize;
    let number = |(way, number): (&f64, &Option<f64>)| {
        if let Some(number) = number {
            next += 1;
            return *number;
        }
        match (next.checked_sub(1).map(|before| known[before]), known.get(next)) {
            (Some((start, from)), Some((end, to))) if *end > start => {
                from + (to - from) * (way - start) / (end - start)
            }
            // points so close that the way between them is lost in rounding
            (Some((_, from)), Some(_)) => from,
            (None, _) => first.1,
            (_, None) => last.1,
        }
    };
    ways.iter().zip(numbers).map(number).collect()
}
