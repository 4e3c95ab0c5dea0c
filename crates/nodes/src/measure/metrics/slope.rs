//! Distributions of slope and aspect.

use super::{Land, histogram, put};
use crate::{
    numerics::{
        distribution::quantiles,
        gradient::{Method, Surface, slope_degrees},
        math, par,
    },
    prelude::*,
};
use orograph_graph::{Axis, Series};

/// The percentiles that are reported.
const PERCENTILES: [(&str, f64); 6] = [
    ("slope.p5", 0.05),
    ("slope.p25", 0.25),
    ("slope.p50", 0.5),
    ("slope.p75", 0.75),
    ("slope.p95", 0.95),
    ("slope.p99", 0.99),
];
/// Sectors of the aspect histogram.
const SECTORS: usize = 16;
/// Tangent of the slope, 15°, from which a cell has an aspect.
const STEEP: f64 = 0.267_949_192_431_122_7;
/// Cells with an aspect from which its harmonics are reported.
const ENOUGH: f64 = 1000.0;

/// Returns the slopes in degrees of all measured cells except the outermost. `check` is called at each row and may
/// cancel.
pub(in crate::measure) fn slopes(
    land: &Land<'_>,
    check: &(dyn Fn() -> Result<(), NodeError> + Sync),
) -> Result<Vec<f32>, NodeError> {
    let (nx, ny) = (land.nx(), land.ny());
    if nx < 3 || ny < 3 {
        return Ok(Vec::new());
    }
    let surface = Surface::new(land.height, Method::Horn);
    let mut slopes = vec![0.0; (nx - 2) * (ny - 2)];
    par::each_with(
        slopes.chunks_mut(nx - 2),
        || vec![0.0; nx],
        |whole, j, row| {
            surface.row(j + 1, |start, east, south| slope_degrees(east, south, &mut whole[start..start + east.len()]));
            row.copy_from_slice(&whole[1..nx - 1]);
            if land.sea_cells + land.masked > 0 {
                let heights = &land.samples()[(j + 1) * nx + 1..][..nx - 2];
                row.iter_mut().zip(heights).filter(|(_, z)| z.is_nan()).for_each(|(slope, _)| *slope = f32::NAN);
            }
            check()
        },
    )?;
    if par::any(&slopes, |s| !s.is_finite()) {
        slopes.retain(|s| s.is_finite());
    }
    Ok(slopes)
}

pub(super) fn measure(slopes: &[f32], report: &mut Report) {
    if slopes.is_empty() {
        report.notes.push("fewer than 3 x 3 cells with heights: no slopes".to_owned());
    }
    let count = slopes.len() as f64;
    let sums = par::collect_all(slopes.chunks(4096), |_, part| part.iter().map(|&s| f64::from(s)).sum::<f64>());
    put(report, "slope.mean", sums.iter().sum::<f64>() / count);
    let values = quantiles(slopes, &PERCENTILES.map(|(_, level)| level));
    for ((name, _), value) in PERCENTILES.iter().zip(&values) {
        put(report, name, *value);
    }
    put(report, "slope.p95_to_p50", values[4] / values[2]);
    let counts = histogram(slopes, 90, |slope| Some((slope as usize).min(89)));
    let share = |cells: u64| cells as f64 / count;
    put(report, "slope.fullest_5_degrees", share(counts.chunks(5).map(|bins| bins.iter().sum()).max().unwrap_or(0)));
    put(report, "slope.below_3_degrees", share(counts[..3].iter().sum()));
    put(report, "slope.above_45_degrees", share(counts[45..].iter().sum()));
    report.series.push(Series::new(
        "slope_histogram",
        Axis::new("slope from", "°", (0..90).map(f64::from).collect()),
        Axis::new("share of the area", "", counts.iter().map(|&cells| share(cells)).collect()),
    ));
}

/// Sums over cells with an aspect.
#[derive(Clone, Copy, Default)]
struct Aspects {
    cells: f64,
    /// cos 4a and cos 8a of the aspect a.
    harmonics: [f64; 2],
    sectors: [f64; SECTORS],
}

impl Aspects {
    fn add(&mut self, east: f64, south: f64) {
        let square = east * east + south * south;
        if square <= STEEP * STEEP {
            return;
        }
        let cos_2 = (east * east - south * south) / square;
        let cos_4 = 2.0 * cos_2 * cos_2 - 1.0;
        self.cells += 1.0;
        self.harmonics[0] += cos_4;
        self.harmonics[1] += 2.0 * cos_4 * cos_4 - 1.0;
        // downhill, clockwise from north
        let turn = math::atan2(-east, south) / (2.0 * std::f64::consts::PI);
        let sector = ((turn + 1.0) * SECTORS as f64 + 0.5) as usize % SECTORS;
        self.sectors[sector] += 1.0;
    }

    fn plus(mut self, other: &Self) -> Self {
        self.cells += other.cells;
        (0..2).for_each(|k| self.harmonics[k] += other.harmonics[k]);
        (0..SECTORS).for_each(|k| self.sectors[k] += other.sectors[k]);
        self
    }
}

/// The directions in which steep cells face.
pub(super) fn aspects(land: &Land<'_>, report: &mut Report) {
    let (nx, ny) = (land.nx(), land.ny());
    let surface = Surface::new(land.height, Method::Horn);
    let rows: Vec<usize> = (1..ny.max(1) - usize::from(ny > 1)).collect();
    let has = land.has();
    let found = par::collect_all(rows, |_, j| {
        let mut sums = Aspects::default();
        surface.row(j, |start, east, south| {
            for (at, (east, south)) in east.iter().zip(south).enumerate() {
                let i = start + at;
                if i > 0 && i + 1 < nx && has(j * nx + i) {
                    sums.add(f64::from(*east), f64::from(*south));
                }
            }
        });
        sums
    });
    let sums = found.iter().fold(Aspects::default(), Aspects::plus);
    let enough = sums.cells >= ENOUGH;
    let mean = |sum: f64| if enough { sum / sums.cells } else { f64::NAN };
    put(report, "aspect.four_fold", mean(sums.harmonics[0]));
    put(report, "aspect.eight_fold", mean(sums.harmonics[1]));
    if enough {
        report.series.push(Series::new(
            "aspect_histogram",
            Axis::new("facing", "°", (0..SECTORS).map(|k| k as f64 * 360.0 / SECTORS as f64).collect()),
            Axis::new("share of the slopes above 15°", "", sums.sectors.iter().map(|n| n / sums.cells).collect()),
        ));
    }
}
