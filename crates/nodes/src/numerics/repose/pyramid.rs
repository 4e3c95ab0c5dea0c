//! Transfer between the grids of the pyramid: restriction of means, prolongation of gains.

use super::Level;
use crate::numerics::par;

/// Computes the means of 2 x 2 cells of a grid of `nx` by `ny` cells.
pub fn restrict(fine: &[f32], nx: usize, ny: usize, coarse: &mut [f32]) {
    let (from, to) = (nx + 2, nx / 2 + 2);
    let rows = fine[from..from * (ny + 1)].chunks_exact(2 * from);
    for (pair, out) in rows.zip(coarse[to..].chunks_exact_mut(to)) {
        let (north, south) = (pair[1..=nx].chunks_exact(2), pair[from + 1..][..nx].chunks_exact(2));
        for ((a, b), out) in north.zip(south).zip(&mut out[1..]) {
            *out = 0.25 * ((a[0] + a[1]) + (b[0] + b[1]));
        }
    }
}

/// Adds the gains of a coarse grid since `before` to the finer one.
///
/// A coarse cell that moved gives its four fine cells its gain, tilted by the gradient of the gain. If they are then
/// steeper than repose among themselves, as at a cliff that debris has buried, they are flattened about their mean and
/// tilted like the coarse surface. Cells that would lose more than their loose layer become bare, and the others give
/// the rest. Every step keeps the mean of the four, so material is conserved cell by cell; coarse cells that did not
/// move change nothing.
pub fn prolong(coarse: &Level, before: &[f32], fine: &mut Level) {
    let gain = |at: usize| coarse.moved[at] - before[at];
    let surface = |at: usize| coarse.height[at] + coarse.moved[at];
    // an eighth of the difference over two coarse cells: fine centres are a quarter of a coarse cell off
    let lean = |of: &dyn Fn(usize) -> f32, at: usize| {
        let near = |beside: usize| if coarse.rise[beside].is_finite() { of(beside) } else { of(at) };
        let row = coarse.nx + 2;
        [0.125 * (near(at + 1) - near(at - 1)), 0.125 * (near(at + row) - near(at - row))]
    };
    let stride = fine.nx + 2;
    let Level { height, rise, loose, moved, quantum, .. } = fine;
    par::all(moved[stride..stride * (fine.ny + 1)].chunks_mut(2 * stride), |j, rows| {
        for i in 0..coarse.nx {
            let at = coarse.at(i, j);
            let own = gain(at);
            if own == 0.0 {
                continue;
            }
            let first = 2 * i + 1;
            let cells = [first, first + 1, first + stride, first + stride + 1];
            let above = (2 * j + 1) * stride;
            let [east, south] = lean(&gain, at);
            // limits the gradient at the end of a gain, so that it does not become a loss
            let most = (east.abs() + south.abs()).max(f32::MIN_POSITIVE);
            let share = (own.abs() / most).min(1.0);
            let gains = tilted(share * east, share * south).map(|tilt| own + tilt);
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| height[above + cells[k]] + (rows[cells[k]] + gains[k]));
            let repose = 0.25 * cells.iter().map(|&cell| rise[above + cell]).sum::<f32>();
            let (x, y) = (0.5 * ((b - a) + (d - c)), 0.5 * ((c - a) + (d - b)));
            let steepest =
                [b - a, d - c, c - a, d - b].iter().fold((x * x + y * y).sqrt(), |most, v| most.max(v.abs()));
            let mut settle = [0.0; 4];
            if steepest > repose {
                let kept = repose / steepest;
                let [east, south] = lean(&surface, at).map(|lean| lean * (1.0 - kept));
                let mean = 0.25 * ((a + b) + (c + d));
                let tilts = tilted(east, south);
                settle = [0, 1, 2, 3].map(|k| tilts[k] - (1.0 - kept * kept) * ([a, b, c, d][k] - mean));
            }
            let after = [0, 1, 2, 3].map(|k| rows[cells[k]] + gains[k] + settle[k]);
            let after = if loose.is_empty() {
                after
            } else {
                let whole = 4.0 * own + cells.iter().map(|&cell| rows[cell]).sum::<f32>();
                given_by_what_is_there(after, cells.map(|cell| loose[above + cell]), whole, *quantum)
            };
            for k in 0..4 {
                rows[cells[k]] = after[k];
            }
        }
    });
}

/// Returns the heights of the four fine cells on a plane through their middle: north-west, north-east, south-west,
/// south-east.
fn tilted(east: f32, south: f32) -> [f32; 4] {
    [-east - south, east - south, south - east, east + south]
}

/// Changes the gains of four cells so that none loses more than its layer. The gains become multiples of `quantum` and
/// still sum to `whole`.
fn given_by_what_is_there(moved: [f32; 4], layers: [f32; 4], whole: f32, quantum: f32) -> [f32; 4] {
    let each = [0, 1, 2, 3];
    let mut left = each.map(|k| layers[k] + moved[k]);
    if left.iter().any(|&left| left < 0.0) {
        let present = left.map(|left| left.max(0.0));
        let (sum, rest) = (present.iter().sum::<f32>(), left.iter().sum::<f32>().max(0.0));
        left = present.map(|present| if sum > 0.0 { present * (rest / sum) } else { 0.0 });
    }
    let mut after = each.map(|k| ((left[k] - layers[k]) / quantum).ceil() * quantum);
    // the cell with the thickest layer absorbs the rounding of the others
    let thickest = each.into_iter().fold(0, |most, k| if left[k] > left[most] { k } else { most });
    after[thickest] = 0.0;
    after[thickest] = whole - after.iter().sum::<f32>();
    after
}
