//! Measures of terrain: elevations, hypsometry, slopes, local relief, drainage density.

use orograph_graph::{Axis, Series};

use crate::numerics::distribution::{quantiles, wasserstein};
use crate::{
    numerics::{
        gradient::{Method, Surface, slope_degrees},
        par,
        routing::{Depressions, Drainage, Grid, code, receivers},
    },
    prelude::*,
};

params! {
    /// Drainage area from which a cell counts as a channel.
    channel_area: f64 = 1e5, SquareMetres, 1.0..=1e12, soft 1e4..=1e7;
    /// Side of the windows in which local relief is measured.
    local_window: f64 = 2500.0, Metres, 1.0..=1e6, soft 500.0..=10000.0;
}

inputs! {
    /// Terrain height.
    height: Height;
}

outputs! {
    /// Measures, hypsometric curve and slope histogram.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Metrics",
    category: "measure",
    summary: "Measures of a landscape: hypsometry, relief, slopes, drainage density.",
    doc: include_str!("metrics.md"),
    sources: &[
        "A. N. Strahler, 1952, Hypsometric (area-altitude) analysis of erosional topography, GSA Bulletin 63, 1117-1142",
        "R. J. Pike, S. E. Wilson, 1971, Elevation-relief ratio, hypsometric integral, and geomorphic area-altitude \
         analysis, GSA Bulletin 82, 1079-1084",
        "R. E. Horton, 1945, Erosional development of streams and their drainage basins, GSA Bulletin 56, 275-370",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    reads_sea: true,
    scratch: Scratch::PerCell(16.5),
    cpu: run,
    resolution: Resolution::Cells("slopes and channels are measured between cells"),
    example: "height: \"base\", channel_area: 500000",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    Ok(Given { report: Some(metrics(job, Inputs::read(job)?.height, &Params::read(job.params))?) }.into())
}

/// Measures a heightfield over the job's window.
///
/// # Errors
/// [`NodeError::Cancelled`].
pub fn metrics(job: &Job<'_>, height: &Field, params: &Params) -> Result<Report, NodeError> {
    let window = *height.window();
    let mut report = Report::default();
    report.measure("cell_size", window.cell_m(), "m");
    let land = Land::of(height);
    land.share(&mut report);
    elevations(job, &land, &mut report)?;
    job.advance(0.2)?;
    local_relief(&land.field, params.local_window, &mut report);
    job.advance(0.3)?;
    let steepness = interior_slopes(height, &land, &|| job.check())?;
    job.advance(0.4)?;
    slopes(job, &steepness, &mut report)?;
    drop(steepness);
    job.advance(0.5)?;
    drainage(job, height, &land, params.channel_area, &mut report)?;
    Ok(report)
}

/// The part of a field above the sea level of its world.
struct Land {
    /// The field, with the cells of the sea as voids.
    field: Field,
    sea_m: Option<f64>,
    sea_cells: u64,
}

impl Land {
    fn of(height: &Field) -> Self {
        let Some(sea_m) = height.window().world.sea_level else {
            return Self { field: height.clone(), sea_m: None, sea_cells: 0 };
        };
        let is_sea = |z: f32| f64::from(z) < sea_m;
        let dry = par::map_of(height.plane(0), |&z| if is_sea(z) { f32::NAN } else { z });
        let sea_cells = par::count(height.plane(0), |&z| is_sea(z)) as u64;
        Self { field: Field::new(*height.window(), dry), sea_m: Some(sea_m), sea_cells }
    }

    /// Returns the number of land cells, including voids.
    fn cells(&self) -> u64 {
        self.field.window().len() as u64 - self.sea_cells
    }

    fn share(&self, report: &mut Report) {
        let Some(sea_m) = self.sea_m else { return };
        report.measure("sea_level", sea_m, "m");
        report.measure("land_share", self.cells() as f64 / self.field.window().len() as f64, "");
        if self.cells() == 0 {
            report.notes.push("all of it lies below the sea".to_owned());
        }
    }
}

/// Compares a terrain with a reference: Wasserstein-1 distances of slope and elevation divided by the reference's
/// interquartile range, and the mean difference of the hypsometric curves. 0 means equal distributions.
#[must_use]
pub fn compare(field: &Field, reference: &Field) -> Report {
    let mut report = Report::default();
    let mut distance = |name: &str, a: &[f32], b: &[f32]| {
        let quartiles = quantiles(b, &[0.25, 0.75]);
        report.measure(name, wasserstein(a, b) / (quartiles[1] - quartiles[0]), "");
    };
    let lands = [field, reference].map(Land::of);
    let [a, b] = lands.each_ref().map(|land| finite(&land.field));
    distance("elevation_distance", &a, &b);
    let slopes = |field, land: &Land| interior_slopes(field, land, &|| Ok(())).unwrap_or_default();
    distance("slope_distance", &slopes(field, &lands[0]), &slopes(reference, &lands[1]));
    let curves = lands.each_ref().map(|land| Elevations::of(&land.field).curve(&land.field));
    let difference: f64 = curves[0].iter().zip(&curves[1]).map(|(a, b)| (a - b).abs()).sum();
    report.measure("hypsometry_distance", difference / curves[0].len() as f64, "");
    let [a, b] = [field, reference].map(|field| field.window().cell_m());
    if (a / b - 1.0).abs() > 1e-3 {
        report.notes.push(format!("cells of {a} m are compared with cells of {b} m; slopes depend on the cell size"));
    }
    report
}

/// Returns the sum over the finite samples, row by row, so that it is the same for any number of threads.
fn sum(field: &Field, value: impl Fn(f64) -> f64 + Sync) -> f64 {
    let row = |_, row: &[f32]| row.iter().filter(|z| z.is_finite()).map(|&z| value(f64::from(z))).sum::<f64>();
    par::collect_all(field.plane(0).chunks(field.window().nx()), row).iter().sum()
}

fn finite(field: &Field) -> Vec<f32> {
    field.plane(0).iter().copied().filter(|z| z.is_finite()).collect()
}

/// Elevations of a field in metres; NaN if it has none.
#[derive(Clone, Copy, Debug)]
struct Elevations {
    count: f64,
    min: f64,
    max: f64,
    mean: f64,
    std: f64,
}

/// Steps of the hypsometric curve.
const STEPS: usize = 100;

impl Elevations {
    fn of(field: &Field) -> Self {
        let count = sum(field, |_| 1.0);
        let (min, max) = field.range(0).map_or((f64::NAN, f64::NAN), |(a, b)| (f64::from(a), f64::from(b)));
        let mean = sum(field, |z| z) / count;
        let std = (sum(field, |z| (z - mean) * (z - mean)) / count).sqrt();
        Self { count, min, max, mean, std }
    }

    /// Returns the fraction of the area at or above each of the relative heights 0, 1/100, ... 1.
    fn curve(&self, field: &Field) -> Vec<f64> {
        let level = |step: usize| self.min + step as f64 / STEPS as f64 * (self.max - self.min);
        let step_of = |z: f64| {
            let guess = (z - self.min) / (self.max - self.min) * STEPS as f64;
            let mut step = (guess.max(0.0) as usize).min(STEPS);
            while step > 0 && level(step) > z {
                step -= 1;
            }
            while step < STEPS && level(step + 1) <= z {
                step += 1;
            }
            step
        };
        let at_step = histogram(field.plane(0), STEPS + 1, |z| z.is_finite().then(|| step_of(f64::from(z))));
        let mut above = 0;
        let mut curve: Vec<f64> = at_step
            .iter()
            .rev()
            .map(|count| {
                above += count;
                above as f64 / self.count
            })
            .collect();
        curve.reverse();
        curve
    }
}

/// Returns a histogram of the samples; those for which `bin` returns None are not counted.
fn histogram(samples: &[f32], bins: usize, bin: impl Fn(f32) -> Option<usize> + Sync) -> Vec<u64> {
    let count = |_, part: &[f32]| {
        let mut counts = vec![0_u64; bins];
        part.iter().filter_map(|&sample| bin(sample)).for_each(|bin| counts[bin] += 1);
        counts
    };
    let parts = par::collect_all(samples.chunks(1 << 16), count);
    (0..bins).map(|bin| parts.iter().map(|counts| counts[bin]).sum()).collect()
}

fn axis(label: &str, unit: &str, values: Vec<f64>) -> Axis {
    Axis { label: label.to_owned(), unit: unit.to_owned(), values }
}

fn elevations(job: &Job<'_>, land: &Land, report: &mut Report) -> Result<(), NodeError> {
    let height = &land.field;
    let found = Elevations::of(height);
    job.advance(0.1)?;
    let relief = found.max - found.min;
    report.measure("elevation_min", found.min, "m");
    report.measure("elevation_max", found.max, "m");
    report.measure("elevation_mean", found.mean, "m");
    report.measure("elevation_std", found.std, "m");
    report.measure("relief", relief, "m");
    report.measure("hypsometric_integral", (found.mean - found.min) / relief, "");
    let holes = land.cells() as f64 - found.count;
    if holes > 0.0 {
        report.notes.push(format!("{holes} cells without a height are left out"));
    }
    report.series.push(Series {
        name: "hypsometric_curve".to_owned(),
        x: axis("share of the area at or above", "", found.curve(height)),
        y: axis("relative height", "", (0..=STEPS).map(|step| step as f64 / STEPS as f64).collect()),
    });
    Ok(())
}

fn local_relief(height: &Field, window_m: f64, report: &mut Report) {
    let window = height.window();
    let side = ((window_m / window.cell_m()).round().max(1.0) as usize).max(1);
    let (columns, rows) = (window.nx() / side, window.ny() / side);
    let relief = |at: usize| {
        let (i, j) = (at % columns * side, at / columns * side);
        let cells = (j..j + side).flat_map(|j| &height.plane(0)[j * window.nx() + i..][..side]);
        let (min, max) = cells
            .filter(|z| z.is_finite())
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(min, max), &z| (min.min(z), max.max(z)));
        if min <= max { f64::from(max) - f64::from(min) } else { f64::NAN }
    };
    let mut reliefs = par::map(columns * rows, relief);
    reliefs.retain(|relief| !relief.is_nan());
    if reliefs.is_empty() {
        report.notes.push(format!("the terrain is smaller than a window of {window_m} m: no local relief"));
    }
    report.measure("local_window", side as f64 * window.cell_m(), "m");
    report.measure("local_relief_mean", reliefs.iter().sum::<f64>() / reliefs.len() as f64, "m");
    report.measure("local_relief_max", reliefs.iter().copied().fold(f64::NAN, f64::max), "m");
}

/// Returns the slopes in degrees of all land cells except the outermost and voids. `check` is called at each row and
/// may cancel.
fn interior_slopes(
    height: &Field,
    land: &Land,
    check: &(dyn Fn() -> Result<(), NodeError> + Sync),
) -> Result<Vec<f32>, NodeError> {
    let (nx, ny) = (height.window().nx(), height.window().ny());
    if nx < 3 || ny < 3 {
        return Ok(Vec::new());
    }
    let surface = Surface::new(height, Method::Horn);
    let mut slopes = vec![0.0; (nx - 2) * (ny - 2)];
    par::each_with(
        slopes.chunks_mut(nx - 2),
        || vec![0.0; nx],
        |whole, j, row| {
            surface.row(j + 1, |start, east, south| slope_degrees(east, south, &mut whole[start..start + east.len()]));
            row.copy_from_slice(&whole[1..nx - 1]);
            if land.sea_cells > 0 {
                let heights = &land.field.plane(0)[(j + 1) * nx + 1..][..nx - 2];
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

fn slopes(job: &Job<'_>, slopes: &[f32], report: &mut Report) -> Result<(), NodeError> {
    if slopes.is_empty() {
        report.notes.push("fewer than 3 x 3 cells with heights: no slopes".to_owned());
    }
    let sums = par::collect_all(slopes.chunks(4096), |_, part| part.iter().map(|&s| f64::from(s)).sum::<f64>());
    report.measure("slope_mean", sums.iter().sum::<f64>() / slopes.len() as f64, "°");
    let names = ["slope_p5", "slope_p25", "slope_p50", "slope_p75", "slope_p95"];
    for (name, value) in names.into_iter().zip(quantiles(slopes, &[0.05, 0.25, 0.5, 0.75, 0.95])) {
        report.measure(name, value, "°");
    }
    job.check()?;
    let counts = histogram(slopes, 90, |slope| Some((slope as usize).min(89)));
    report.series.push(Series {
        name: "slope_histogram".to_owned(),
        x: axis("slope from", "°", (0..90).map(f64::from).collect()),
        y: axis("share of the area", "", counts.iter().map(|&n| n as f64 / slopes.len() as f64).collect()),
    });
    Ok(())
}

fn drainage(
    job: &Job<'_>,
    height: &Field,
    land: &Land,
    channel_area_m2: f64,
    report: &mut Report,
) -> Result<(), NodeError> {
    report.measure("channel_area", channel_area_m2, "m²");
    let density = match channel_cells(job, height, land.sea_m, channel_area_m2) {
        Ok([straight, diagonal]) => {
            let cells = straight as f64 + diagonal as f64 * std::f64::consts::SQRT_2;
            // m/m² to km/km²
            1e3 * cells / (land.cells() as f64 * height.window().cell_m())
        }
        Err(error @ (NodeError::Cancelled | NodeError::OutOfMemory(_))) => return Err(error),
        Err(NodeError::Failed { message, .. }) => {
            report.notes.push(format!("drainage density is not measured: {message}"));
            f64::NAN
        }
    };
    report.measure("drainage_density", density, "km/km²");
    Ok(())
}

/// Counts channel cells that drain across a side and across a corner.
fn channel_cells(
    job: &Job<'_>,
    height: &Field,
    sea_m: Option<f64>,
    channel_area_m2: f64,
) -> Result<[u64; 2], NodeError> {
    let heights = height.plane(0);
    if par::any(heights, |z| !z.is_finite()) {
        return Err(NodeError::failed("there are cells without a height"));
    }
    let grid = Grid::new(height.window())?;
    let mut codes = vec![0; grid.cells()];
    receivers::d8(job, &grid, heights, &mut codes)?;
    if let Some(level) = sea_m {
        receivers::end_at_sea(heights, level, &mut codes);
    }
    let mut depressions = Depressions::default();
    depressions.find(job, &grid, heights, &codes)?;
    depressions.carve(job, &grid, &mut codes)?;
    job.advance(0.8)?;
    let mut cells = vec![1_u32; grid.cells()];
    Drainage::default().accumulate(job, &grid, &codes, &mut cells)?;
    let cell_m2 = height.window().cell_m() * height.window().cell_m();
    let links = |code: u8, cells: u32| {
        let channel = code::has_receiver(code) && f64::from(cells) * cell_m2 >= channel_area_m2;
        let diagonal = code::is_diagonal(code::direction(code));
        [u64::from(channel && !diagonal), u64::from(channel && diagonal)]
    };
    let add = |a: [u64; 2], b: [u64; 2]| [a[0] + b[0], a[1] + b[1]];
    let part = |_, (codes, cells): (&[u8], &[u32])| {
        codes.iter().zip(cells).map(|(&code, &cells)| links(code, cells)).fold([0; 2], add)
    };
    Ok(par::collect_all(codes.chunks(1 << 14).zip(cells.chunks(1 << 14)), part).into_iter().fold([0; 2], add))
}

#[cfg(test)]
mod tests;
