//! Reference for the kernels: the slide in double precision, cell by cell, on one grid.

use super::{Land, STEP};

/// One sweep. Returns the gains of all cells after it, given those before it, and the largest flow relative to repose.
pub fn sweep(land: &Land<'_>, moved: &[f64]) -> (Vec<f64>, f64) {
    let [nx, ny] = land.cells.map(|n| n as isize);
    let inside = |i: isize, n: isize, wraps: bool| {
        if wraps { Some(i.rem_euclid(n)) } else { Some(i).filter(|i| (0..n).contains(i)) }
    };
    let cell = |i: isize, j: isize| {
        let at = (inside(j, ny, land.wraps[1])? * nx + inside(i, nx, land.wraps[0])?) as usize;
        land.rise[at].is_finite().then_some(at)
    };
    let surface = |at: usize| f64::from(land.height[at]) + moved[at];
    let repose = |at: &[usize]| at.iter().map(|&at| f64::from(land.rise[at])).sum::<f64>() / at.len() as f64;
    // cells and gradient of the plane at the corner south-east of a cell; None if any of them is closed
    let corner = |i: isize, j: isize| {
        let four = [cell(i, j)?, cell(i + 1, j)?, cell(i, j + 1)?, cell(i + 1, j + 1)?];
        let [a, b, c, d] = four.map(surface);
        let (x, y) = ((b - a + d - c) / 2.0, (c - a + d - b) / 2.0);
        Some((four, x, y))
    };
    let given = |from: usize| land.loose.map_or(f64::INFINITY, |loose| (f64::from(loose[from]) + moved[from]).max(0.0));
    let (mut after, mut most) = (moved.to_vec(), 0.0_f64);
    let mut pass = |from: usize, to: usize, wanted: f64, allowed: f64, repose: f64| {
        let flow = wanted.min(allowed);
        after[from] -= flow;
        after[to] += flow;
        most = most.max(flow / repose);
    };
    for j in 0..ny {
        for i in 0..nx {
            if let Some((four, ..)) = corner(i, j) {
                let repose = repose(&four);
                let [a, b, c, d] = four;
                for (low, high, sides) in [(a, d, [b, c]), (c, b, [a, d])] {
                    let along = surface(high) - surface(low);
                    // bare walls next to a gully do not push the debris in it
                    let top = if land.loose.is_some() { along.max(0.0) + 1.5 * repose } else { f64::INFINITY };
                    let [p, q] = sides.map(|side| (surface(side) - surface(low)).min(top));
                    let steepness = libm::hypot((along + p - q) / 2.0, (along - p + q) / 2.0);
                    let share = (1.0 - repose / steepness).max(0.0) * f64::from(STEP);
                    let (from, to) = if along > 0.0 { (high, low) } else { (low, high) };
                    let flow = 0.5 * along.abs();
                    pass(from, to, share * flow, 0.25 * given(from) * flow / steepness.max(1e-12), repose);
                }
            }
            for (other, ends, along_x) in
                [((i + 1, j), [(i, j - 1), (i, j)], true), ((i, j + 1), [(i - 1, j), (i, j)], false)]
            {
                let (Some(near), Some(far)) = (cell(i, j), cell(other.0, other.1)) else { continue };
                let rise = surface(far) - surface(near);
                let repose = repose(&[near, far]);
                let lean =
                    ends.map(|(i, j)| corner(i, j).map_or(0.0, |corner| if along_x { corner.1 } else { corner.2 }));
                let seen = repose.max(0.5 * (lean[0] + lean[1]).abs());
                let (from, to) = if rise > 0.0 { (far, near) } else { (near, far) };
                pass(from, to, 0.5 * (rise.abs() - seen).max(0.0) * f64::from(STEP), 0.0625 * given(from), repose);
            }
        }
    }
    (after, most)
}

/// Sweeps until no flow exceeds that of an excess of 1 % over repose. Returns the gains of all cells.
pub fn rest(land: &Land<'_>) -> Vec<f64> {
    let mut moved = vec![0.0; land.height.len()];
    for _ in 0..100_000 {
        let (after, most) = sweep(land, &moved);
        moved = after;
        if most < 0.01 * f64::from(STEP) {
            return moved;
        }
    }
    panic!("no rest");
}
