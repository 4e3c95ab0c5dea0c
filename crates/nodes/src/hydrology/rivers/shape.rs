//! Simplifies and smooths lines. Their ends do not move.

use std::{cmp::Reverse, collections::BinaryHeap};

use orograph_graph::Vertex;

/// Maximum rounds of corner cutting: each doubles the vertices.
const MOST_ROUNDS: u32 = 5;

/// Returns the area of the triangle of three vertices on the map, in square metres.
fn triangle_m2([a, b, c]: [&Vertex; 3]) -> f64 {
    let from_a = |to: &Vertex| [0, 1].map(|axis| to.position_m[axis] - a.position_m[axis]);
    let ([bx, by], [cx, cy]) = (from_a(b), from_a(c));
    0.5 * (bx * cy - by * cx).abs()
}

/// Removes vertices whose triangle with their neighbours is smaller than the square of `length_m`, the smallest first
/// (Visvalingam and Whyatt 1993); among equal ones the first.
pub fn simplified(vertices: Vec<Vertex>, length_m: f64) -> Vec<Vertex> {
    let least_m2 = length_m * length_m;
    if least_m2 <= 0.0 || vertices.len() < 3 {
        return vertices;
    }
    let end = vertices.len() - 1;
    let mut before: Vec<usize> = (0..=end).map(|at| at.saturating_sub(1)).collect();
    let mut after: Vec<usize> = (1..=end + 1).collect();
    // areas are not negative, so that their bits have the same order
    let area = |before: &[usize], after: &[usize], at: usize| {
        triangle_m2([before[at], at, after[at]].map(|at| &vertices[at])).to_bits()
    };
    let mut current: Vec<u64> =
        (0..=end).map(|at| if at == 0 || at == end { u64::MAX } else { area(&before, &after, at) }).collect();
    let mut queue: BinaryHeap<Reverse<(u64, usize)>> = (1..end).map(|at| Reverse((current[at], at))).collect();
    let mut kept = vec![true; vertices.len()];
    while let Some(Reverse((bits, at))) = queue.pop() {
        if !kept[at] || bits != current[at] {
            continue;
        }
        if f64::from_bits(bits) >= least_m2 {
            break;
        }
        kept[at] = false;
        let (left, right) = (before[at], after[at]);
        after[left] = right;
        before[right] = left;
        for next in [left, right].into_iter().filter(|&next| next != 0 && next != end) {
            current[next] = area(&before, &after, next);
            queue.push(Reverse((current[next], next)));
        }
    }
    vertices.into_iter().zip(kept).filter(|(_, kept)| *kept).map(|(vertex, _)| vertex).collect()
}

/// Cuts corners at a quarter and three quarters of each segment (Chaikin 1974) until none is longer than `length_m`.
/// All values of vertices are interpolated linearly, so values that decrease along the line still do.
pub fn smoothed(mut vertices: Vec<Vertex>, length_m: f64) -> Vec<Vertex> {
    if length_m <= 0.0 || vertices.len() < 3 {
        return vertices;
    }
    let square = |pair: &[Vertex]| {
        let [x, y] = [0, 1].map(|axis| pair[1].position_m[axis] - pair[0].position_m[axis]);
        x * x + y * y
    };
    let mut longest_m = vertices.windows(2).map(square).fold(0.0, f64::max).sqrt();
    for _ in 0..MOST_ROUNDS {
        if longest_m <= length_m {
            break;
        }
        longest_m *= 0.5;
        let pieces = vertices.len() - 1;
        let mut cut = Vec::with_capacity(2 * vertices.len());
        for (at, pair) in vertices.windows(2).enumerate() {
            cut.push(if at == 0 { pair[0] } else { pair[0].towards(&pair[1], 0.25) });
            cut.push(if at + 1 == pieces { pair[1] } else { pair[0].towards(&pair[1], 0.75) });
        }
        vertices = cut;
    }
    vertices
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[(f64, f64)]) -> Vec<Vertex> {
        let vertex = |(at, &(x, y)): (usize, &(f64, f64))| Vertex {
            position_m: [x, y],
            elevation_m: -(at as f64),
            ..Vertex::default()
        };
        points.iter().enumerate().map(vertex).collect()
    }

    fn points(line: &[Vertex]) -> Vec<(f64, f64)> {
        line.iter().map(|vertex| (vertex.position_m[0], vertex.position_m[1])).collect()
    }

    /// Reference for Visvalingam: recomputes all areas after each removed vertex.
    fn plainly_simplified(mut vertices: Vec<Vertex>, length_m: f64) -> Vec<Vertex> {
        loop {
            let areas = vertices.windows(3).map(|three| triangle_m2([&three[0], &three[1], &three[2]]));
            let least = areas.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b));
            match least {
                Some((at, area)) if area < length_m * length_m => vertices.remove(at + 1),
                _ => return vertices,
            };
        }
    }

    #[test]
    fn small_triangles_go_first() {
        let steps = line(&[(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 1.0), (4.0, 2.0), (5.0, 9.0), (6.0, 2.0)]);
        assert_eq!(
            points(&simplified(steps.clone(), 0.9)),
            [(0.0, 0.0), (3.0, 1.0), (4.0, 2.0), (5.0, 9.0), (6.0, 2.0)]
        );
        assert_eq!(simplified(steps.clone(), 0.0), steps);
        assert_eq!(points(&simplified(steps, 100.0)), [(0.0, 0.0), (6.0, 2.0)]);
        for seed in 0..20_u32 {
            let draw = |at: u32| f64::from(orograph_graph::mix(seed * 977 + at)) * 1e-8;
            let wander: Vec<(f64, f64)> = (0..60).map(|at| (f64::from(at) * 10.0 + draw(at), draw(at + 500))).collect();
            for length_m in [3.0, 10.0, 30.0] {
                assert_eq!(simplified(line(&wander), length_m), plainly_simplified(line(&wander), length_m));
            }
        }
    }

    #[test]
    fn corners_are_cut_at_quarters_and_ends_stay() {
        let corner = line(&[(0.0, 0.0), (8.0, 0.0), (8.0, 8.0)]);
        assert_eq!(points(&smoothed(corner.clone(), 4.0)), [(0.0, 0.0), (6.0, 0.0), (8.0, 2.0), (8.0, 8.0)]);
        assert_eq!(smoothed(corner.clone(), 8.0), corner);
        assert_eq!(smoothed(corner.clone(), 0.0), corner);
        let round = smoothed(corner.clone(), 1e-3);
        assert_eq!(round.len(), 34, "five rounds: each doubles the vertices and takes two away");
        assert_eq!((round[0], round[33]), (corner[0], corner[2]));
        assert!(round.windows(2).all(|pair| pair[1].elevation_m <= pair[0].elevation_m));
    }
}
