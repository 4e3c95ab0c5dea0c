//! The rock that becomes debris in a round, a row of cells at a time.

use crate::numerics::{math::lane, simd::simd};

/// How rock weathers in a round.
#[derive(Clone, Copy)]
pub(super) struct Weather {
    pub cell_m: f32,
    /// Volume of debris per volume of rock.
    pub bulking: f32,
    /// Thickness of debris under which weathering falls to 37 %.
    pub cover_m: f32,
    pub round_yr: f32,
}

/// A row of cells. The three rows of a raster are those to the north, the row itself and that to the south; beyond a
/// side that is not joined, the row itself stands for its neighbour.
pub(super) struct Row<'a> {
    /// Elevation of the surface.
    pub surface: [&'a [f32]; 3],
    /// Rise at repose between neighbours, in metres; infinite in closed cells.
    pub rise: [&'a [f32]; 3],
    /// Elevation of the rock at the start, and thickness of rock lost since.
    pub rock: [&'a [f32]; 2],
    pub debris: &'a [f32],
    /// Rate at which bare rock weathers, in metres per year; 0 in closed cells.
    pub rate: &'a [f32],
    /// Whether the row's ends are joined.
    pub wraps: bool,
}

/// One cell: its level, rise at repose, debris and rate.
#[derive(Clone, Copy)]
struct Cell {
    level: f32,
    rise: f32,
    debris: f32,
    rate: f32,
}

impl Weather {
    /// Returns the thickness of rock that a cell loses. `beside` has surface and rise of its neighbours to the west,
    /// east, north and south.
    #[inline(always)]
    fn lost(&self, cell: Cell, beside: [[f32; 2]; 4]) -> f32 {
        // the upwind gradient, with which a wall retreats into its plateau and the plateau does not grow outwards
        let [west, east, north, south] =
            beside.map(|[surface, rise]| if rise < f32::INFINITY { cell.level - surface } else { 0.0 });
        let (x, y) = (west.max(east).max(0.0), north.max(south).max(0.0));
        let square = x * x + y * y;
        let area = (1.0 + square / (self.cell_m * self.cell_m)).sqrt();
        let shielded = lane::exp(-cell.debris / self.cover_m);
        let made = self.bulking * cell.rate * self.round_yr * area * shielded;
        // debris that stays where it is produced shields the rock below it: cover ln(1 + made / cover), with the ratio
        // that undoes the rounding of 1 + made / cover
        let share = made / self.cover_m;
        let one_more = 1.0 + share;
        let ln = lane::log2(one_more) * std::f32::consts::LN_2;
        let exact = if one_more > 1.0 { ln * (share / (one_more - 1.0)) } else { share };
        let made = if square <= cell.rise * cell.rise { self.cover_m * exact } else { made };
        if cell.rate == 0.0 { 0.0 } else { made / self.bulking }
    }
}

simd! {
    /// Computes the thickness of rock that each cell of a row loses.
    pub(super) fn lose(weather: &Weather, row: &Row<'_>, out: &mut [f32]) {
        let n = out.len();
        let ([north, own, south], [north_rise, rise, south_rise]) =
            (row.surface.map(|row| &row[..n]), row.rise.map(|row| &row[..n]));
        let [rock, weathered] = row.rock.map(|row| &row[..n]);
        let (debris, rate) = (&row.debris[..n], &row.rate[..n]);
        for i in 1..n.saturating_sub(1) {
            let cell = Cell { level: rock[i] - weathered[i], rise: rise[i], debris: debris[i], rate: rate[i] };
            let beside = [
                [own[i - 1], rise[i - 1]],
                [own[i + 1], rise[i + 1]],
                [north[i], north_rise[i]],
                [south[i], south_rise[i]],
            ];
            out[i] = weather.lost(cell, beside);
        }
        for i in [0, n - 1] {
            let (west, east) = if row.wraps {
                ((i + n - 1) % n, (i + 1) % n)
            } else {
                (i.saturating_sub(1), (i + 1).min(n - 1))
            };
            let cell = Cell { level: rock[i] - weathered[i], rise: rise[i], debris: debris[i], rate: rate[i] };
            let beside = [
                [own[west], rise[west]],
                [own[east], rise[east]],
                [north[i], north_rise[i]],
                [south[i], south_rise[i]],
            ];
            out[i] = weather.lost(cell, beside);
        }
    }
}
