//! Linear diffusion along lines whose cells all have the same mobility and, except for the first and the last, are free to
//! change their heights.
//!
//! The elimination differs between such lines only by the state of their first cell. Its coefficients are computed once for
//! all lines, so that a step contains no division and reads nothing but heights. It gives the same bits as the general
//! solution.

use super::bundle::{LANES, Lanes, explicit, harmonic, moves};
use crate::numerics::simd::simd;

/// The elimination along lines whose first cell is free, and along those whose first cell keeps its height.
#[derive(Debug, Default)]
pub struct Even {
    /// The mobility for which this was computed.
    mobility: f64,
    /// What crosses a face per metre that the old height before it is above that behind it.
    pub explicit: f64,
    /// The same for the new height.
    pub implicit: f64,
    /// By cell: the reciprocal pivot, and the share of what the cell takes over from the one behind it.
    cells: [Vec<[f64; 2]>; 2],
    /// What the last cell but one has kept of its height.
    kept: [f64; 2],
}

impl Even {
    /// Computes the elimination along two or more cells of that mobility, if it is not known yet.
    pub fn prepare(&mut self, mobility: f64, cells: usize) {
        if self.mobility == mobility && self.cells[0].len() == cells - 1 {
            return;
        }
        let c = harmonic(mobility, mobility);
        self.mobility = mobility;
        self.explicit = explicit(c);
        self.implicit = c - self.explicit;
        for ((moves, ratios), last) in [1.0, 0.0].into_iter().zip(&mut self.cells).zip(&mut self.kept) {
            let pivot = 1.0 / (1.0 + moves * self.implicit);
            let mut kept = pivot;
            ratios.clear();
            ratios.push([pivot, moves * self.implicit * pivot]);
            ratios.resize_with(cells - 1, || {
                let stays = 1.0 + self.implicit * kept;
                let pivot = 1.0 / (stays + self.implicit);
                kept = stays * pivot;
                [pivot, self.implicit * pivot]
            });
            *last = kept;
        }
    }

    /// Solves for the heights at the end. `ends` are the states of the first and the last cells.
    pub fn solve(&self, start: &[Lanes], ends: [&Lanes; 2], end: &mut [Lanes]) {
        solve(self, start, ends, end);
    }
}

simd! {
    fn solve(even: &Even, start: &[Lanes], ends: [&Lanes; 2], end: &mut [Lanes]) {
        let last = start.len() - 1;
        let ends = ends.map(|ends| ends.map(moves));
        let [free, held] = [&even.cells[0][..last], &even.cells[1][..last]];
        let (mut given, mut solved) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let moves = ends[0][lane];
            given[lane] = even.explicit * (start[0][lane] - start[1][lane]);
            let rhs = start[0][lane] + moves * (0.0 - given[lane]);
            solved[lane] = (rhs + 0.0) * if moves == 1.0 { free[0][0] } else { held[0][0] };
        }
        end[0] = solved;
        for i in 1..last {
            let (here, behind, end) = (&start[i], &start[i + 1], &mut end[i]);
            // loaded before: with loads in the branches, the compiler gathers from addresses
            let (free, held) = (free[i][0], held[i][0]);
            for lane in 0..LANES {
                let pivot = if ends[0][lane] == 1.0 { free } else { held };
                let before = given[lane];
                given[lane] = even.explicit * (here[lane] - behind[lane]);
                let rhs = here[lane] + (before - given[lane]);
                solved[lane] = (rhs + even.implicit * solved[lane]) * pivot;
                end[lane] = solved[lane];
            }
        }
        let mut behind = [0.0; LANES];
        for lane in 0..LANES {
            let (first, moves) = (ends[0][lane], ends[1][lane]);
            let before = moves * even.implicit;
            let rhs = start[last][lane] + moves * (given[lane] - 0.0);
            let stays = 1.0 + before * if first == 1.0 { even.kept[0] } else { even.kept[1] };
            let pivot = 1.0 / (stays + 0.0);
            behind[lane] = (rhs + before * solved[lane]) * pivot + 0.0;
        }
        end[last] = behind;
        for i in (0..last).rev() {
            let (end, free, held) = (&mut end[i], free[i][1], held[i][1]);
            for lane in 0..LANES {
                let ratio = if ends[0][lane] == 1.0 { free } else { held };
                behind[lane] = end[lane] + ratio * behind[lane];
            }
            *end = behind;
        }
    }
}
