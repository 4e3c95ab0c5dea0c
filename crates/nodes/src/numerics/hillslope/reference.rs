//! Creep by small explicit steps, one cell after the other.

/// Heights of a row-major raster of `nx` columns with walls after `duration` yr, `d` being the diffusivity of a cell
/// and `critical` the critical slope. Cells where `fixed` keep their height.
pub fn creep(
    nx: usize,
    cell_m: f64,
    heights: &[f64],
    d: impl Fn(usize) -> f64,
    critical: f64,
    duration: f64,
    fixed: impl Fn(usize) -> bool,
) -> Vec<f64> {
    let ny = heights.len() / nx;
    let most = (0..heights.len()).map(&d).fold(0.0, f64::max) * if critical > 0.0 { 20.0 } else { 1.0 };
    let steps = (most * duration / (cell_m * cell_m) / 0.2).ceil().max(1.0);
    let step_m2 = duration / steps / (cell_m * cell_m);
    let mut heights = heights.to_vec();
    for _ in 0..steps as usize {
        let before = heights.clone();
        let at = |x: usize, y: usize| before[y * nx + x];
        // Central differences, one-sided at walls.
        let rise = |low: f64, high: f64, apart: usize| if apart == 0 { 0.0 } else { (high - low) / apart as f64 };
        let east = |x: usize, y: usize| {
            let (w, e) = (x.saturating_sub(1), (x + 1).min(nx - 1));
            rise(at(w, y), at(e, y), e - w) / cell_m
        };
        let south = |x: usize, y: usize| {
            let (n, s) = (y.saturating_sub(1), (y + 1).min(ny - 1));
            rise(at(x, n), at(x, s), s - n) / cell_m
        };
        let mut pass = |from: usize, to: usize, across: f64| {
            let harmonic = 2.0 * d(from) * d(to) / (d(from) + d(to)).max(f64::MIN_POSITIVE);
            let along = (before[to] - before[from]) / cell_m;
            let square = if critical > 0.0 { (along * along + across * across) / (critical * critical) } else { 0.0 };
            let passed = step_m2 * harmonic / (1.0 - square.min(0.95)) * (before[from] - before[to]);
            heights[from] -= if fixed(from) { 0.0 } else { passed };
            heights[to] += if fixed(to) { 0.0 } else { passed };
        };
        for y in 0..ny {
            for x in 0..nx {
                let cell = y * nx + x;
                if x + 1 < nx {
                    pass(cell, cell + 1, 0.5 * (south(x, y) + south(x + 1, y)));
                }
                if y + 1 < ny {
                    pass(cell, cell + nx, 0.5 * (east(x, y) + east(x, y + 1)));
                }
            }
        }
    }
    heights
}
