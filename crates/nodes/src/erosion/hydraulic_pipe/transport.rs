//! Transport of sediment by the water.

use super::{flow::origin, physics::Pace};
use crate::numerics::simd::simd;

simd! {
    /// Conservative upwind transport: each face carries its discharge times the concentration where it comes from.
    ///
    /// `parts` are concentrations with ghosts on the north, here and on the south; `faces` are those on the west, east,
    /// north and south of each cell.
    pub fn upwind(sediment: &mut [f32], load: &[f32], parts: [&[f32]; 3], faces: [&[f32]; 4], pace: &Pace) {
        let n = sediment.len();
        let (load, [west, east, north, south]) = (&load[..n], faces.map(|row| &row[..n]));
        let [above, row, below] = parts;
        let (above, below) = (&above[1..=n], &below[1..=n]);
        let (before, here, after) = (&row[..n], &row[1..=n], &row[2..n + 2]);
        for i in 0..n {
            let from_west = west[i] * origin(west[i], before[i], here[i]);
            let to_east = east[i] * origin(east[i], here[i], after[i]);
            let from_north = north[i] * origin(north[i], above[i], here[i]);
            let to_south = south[i] * origin(south[i], here[i], below[i]);
            let moved = load[i] + pace.step * ((from_west - to_east) + (from_north - to_south));
            sediment[i] = if moved > 0.0 { moved } else { 0.0 };
        }
    }
}

simd! {
    /// Computes the distance that water moves in a step, in cells, at most one on each axis. `faces` as in
    /// [`upwind`].
    pub fn way(east: &mut [f32], south: &mut [f32], depth: [&[f32]; 2], faces: [&[f32]; 4], pace: &Pace) {
        let n = east.len();
        let (south, [before, after]) = (&mut south[..n], depth.map(|row| &row[..n]));
        let faces = faces.map(|row| &row[..n]);
        for i in 0..n {
            let mean = 0.5 * (before[i] + after[i]);
            let scale = 0.5 * pace.step * super::flow::film(mean, pace) / if mean > 1e-6 { mean } else { 1e-6 };
            east[i] = ((faces[0][i] + faces[1][i]) * scale).clamp(-1.0, 1.0);
            south[i] = ((faces[2][i] + faces[3][i]) * scale).clamp(-1.0, 1.0);
        }
    }
}

/// Bilinear value at (x, y) cells, at most 1 each, from the middle of nine.
#[inline(always)]
fn at(rows: [[f32; 3]; 3], x: f32, y: f32) -> f32 {
    let weights = |t: f32| [if t < 0.0 { -t } else { 0.0 }, 1.0 - t.abs(), if t > 0.0 { t } else { 0.0 }];
    let (wx, wy) = (weights(x), weights(y));
    let along = |row: [f32; 3]| row[1] * wx[1] + (row[0] * wx[0] + row[2] * wx[2]);
    along(rows[1]) * wy[1] + (along(rows[0]) * wy[0] + along(rows[2]) * wy[2])
}

/// The nine samples around cell i of three rows with ghosts.
#[inline(always)]
fn nine(rows: [&[f32]; 3], i: usize) -> [[f32; 3]; 3] {
    rows.map(|row| [row[i], row[i + 1], row[i + 2]])
}

simd! {
    /// Semi-Lagrangian transport: the value where the water comes from (`sign` -1) or goes to (+1).
    ///
    /// `parts` are three rows of the load with ghosts; `way` is that of [`way`].
    pub fn traced(out: &mut [f32], parts: [&[f32]; 3], way: [&[f32]; 2], sign: f32) {
        let n = out.len();
        let (parts, way) = (parts.map(|row| &row[..n + 2]), way.map(|row| &row[..n]));
        for i in 0..n {
            out[i] = at(nine(parts, i), sign * way[0][i], sign * way[1][i]);
        }
    }
}

simd! {
    /// MacCormack's correction (Selle et al. 2008): traces the traced field back again, subtracts half the error, and
    /// limits the result to the range of the four samples that the first trace was interpolated from.
    pub fn corrected(out: &mut [f32], load: [&[f32]; 3], traced: [&[f32]; 3], way: [&[f32]; 2]) {
        let n = out.len();
        let (load, traced) = (load.map(|row| &row[..n + 2]), traced.map(|row| &row[..n + 2]));
        let way = way.map(|row| &row[..n]);
        for i in 0..n {
            let (x, y) = (way[0][i], way[1][i]);
            let (source, image) = (nine(load, i), nine(traced, i));
            let value = image[1][1] + 0.5 * (source[1][1] - at(image, x, y));
            let pair = |row: [f32; 3]| [row[1], if x > 0.0 { row[0] } else { row[2] }];
            let (a, b) = (pair(source[1]), pair(if y > 0.0 { source[0] } else { source[2] }));
            let less = |a: f32, b: f32| if a < b { a } else { b };
            let more = |a: f32, b: f32| if a > b { a } else { b };
            let low = less(less(a[0], a[1]), less(b[0], b[1]));
            let high = more(more(a[0], a[1]), more(b[0], b[1]));
            out[i] = less(more(value, low), high);
        }
    }
}
