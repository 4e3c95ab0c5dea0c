//! A pyramid of the lowest and highest heights over squares of the surface.
//!
//! The surface is bilinear between cell centres and level from the outermost centres to the edge of the terrain. In
//! grid coordinates, `u = x / cell + 1/2`, its patches are the unit squares from 0 to the number of cells on each axis;
//! patch `i` lies between samples `i - 1` and `i`, clamped to existing ones.

use rayon::prelude::*;

/// Patches along the side of the smallest squares, as a power of two.
pub(super) const LEAF: u32 = 3;

/// The pyramid. Squares of level 0 have 8 x 8 patches; those of each further level are twice as wide.
#[derive(Clone, Debug)]
pub(super) struct Bounds {
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    nx: usize,
    ny: usize,
    range: Vec<[f32; 2]>,
}

impl Bounds {
    /// Builds the pyramid over `nx` x `ny` samples.
    pub(super) fn new([nx, ny]: [usize; 2], sample: impl Fn(usize, usize) -> f32 + Sync) -> Self {
        let side = 1 << LEAF;
        let (bx, by) = ((nx + 1).div_ceil(side), (ny + 1).div_ceil(side));
        let range = (0..by).into_par_iter().flat_map_iter(|j| {
            let rows = (j * side).saturating_sub(1)..((j + 1) * side).min(ny);
            let sample = &sample;
            (0..bx).map(move |i| {
                let columns = (i * side).saturating_sub(1)..((i + 1) * side).min(nx);
                let cells = rows.clone().flat_map(|y| columns.clone().map(move |x| (x, y)));
                cells.fold([f32::INFINITY, f32::NEG_INFINITY], |[lo, hi], (x, y)| {
                    let v = sample(x, y);
                    [lo.min(v), hi.max(v)]
                })
            })
        });
        Self::above(Level { nx: bx, ny: by, range: range.collect() })
    }

    /// A copy with wider ranges in the smallest squares: `more` returns a range to include in square (i, j).
    pub(super) fn widened(&self, more: impl Fn(usize, usize) -> Option<[f32; 2]> + Sync) -> Self {
        let leaves = &self.levels[0];
        let nx = leaves.nx;
        let range = leaves.range.par_iter().enumerate().map(|(at, [lo, hi])| {
            let [l, h] = more(at % nx, at / nx).unwrap_or([*lo, *hi]);
            [lo.min(l), hi.max(h)]
        });
        Self::above(Level { nx, ny: leaves.ny, range: range.collect() })
    }

    /// Builds the pyramid above its smallest squares.
    fn above(leaves: Level) -> Self {
        let mut levels = vec![leaves];
        while let Some(finer) = levels.last().filter(|level| level.nx > 1 || level.ny > 1) {
            let (nx, ny) = (finer.nx.div_ceil(2), finer.ny.div_ceil(2));
            let range = (0..nx * ny).map(|at| {
                let (i, j) = (2 * (at % nx), 2 * (at / nx));
                let parts = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)];
                let parts = parts.into_iter().filter(|(i, j)| *i < finer.nx && *j < finer.ny);
                parts
                    .map(|(i, j)| finer.range[j * finer.nx + i])
                    .fold([f32::INFINITY, f32::NEG_INFINITY], |[lo, hi], [l, h]| [lo.min(l), hi.max(h)])
            });
            levels.push(Level { nx, ny, range: range.collect() });
        }
        Self { levels }
    }

    /// The top level, which has one square.
    pub(super) fn top(&self) -> u32 {
        self.levels.len() as u32 - 1
    }

    /// Lowest and highest height of square (i, j) of a level. Returns None outside the terrain. Levels above the top
    /// have one square, the whole.
    pub(super) fn range(&self, level: u32, i: u32, j: u32) -> Option<[f32; 2]> {
        let level = &self.levels[level.min(self.top()) as usize];
        let (i, j) = (i as usize, j as usize);
        (i < level.nx && j < level.ny).then(|| level.range[j * level.nx + i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_hold_their_corners() {
        let (nx, ny) = (37, 20);
        let height = |x: usize, y: usize| ((x * 31 + y * 17) % 101) as f32;
        let bounds = Bounds::new([nx, ny], height);
        let clamped = |x: i64, y: i64| height(x.clamp(0, 36) as usize, y.clamp(0, 19) as usize);
        for level in 0..=bounds.top() {
            let side = 8_i64 << level;
            for (i, j) in (0..5).flat_map(|i| (0..3).map(move |j| (i, j))) {
                let Some([lo, hi]) = bounds.range(level, i, j) else { continue };
                let (x0, y0) = (i64::from(i) * side, i64::from(j) * side);
                let all = (x0 - 1..=(x0 + side - 1).min(36))
                    .flat_map(|x| (y0 - 1..=(y0 + side - 1).min(19)).map(move |y| (x, y)));
                let (least, most) =
                    all.map(|(x, y)| clamped(x, y)).fold((f32::MAX, f32::MIN), |(l, m), v| (l.min(v), m.max(v)));
                assert!(lo == least && hi == most, "level {level} square {i} {j}");
            }
        }
        assert_eq!(bounds.range(bounds.top(), 0, 0), Some([0.0, 100.0]));
        assert_eq!(bounds.range(0, 5, 0), None);
        assert_eq!(Bounds::new([1, 1], |_, _| 4.0).range(7, 0, 0), Some([4.0, 4.0]));
    }
}
