//! The form of valley sections, which distinguishes troughs of glaciers from valleys of rivers.
//!
//! Sections of 5 km cross the largest valleys at right angles, one every 700 m or more. Each is cut at nine tenths of
//! the height of its lower ridge. The V-index is the area below that line over that of a V, less one (Zimmer and Gabet
//! 2018): 0 for a V, 0.33 for a parabola. The exponent is that of height over distance from the floor (Svensson 1959):
//! 1 for a V, 2 for a parabola.

use super::{Land, Network, fit::line, put};
use crate::{
    numerics::{distribution::quantiles, math},
    prelude::*,
};

/// Drainage area of a valley, and of one where no area is four times as large, in m².
const AREAS_M2: [f64; 2] = [1e7, 2e6];
/// Half of a section in metres.
const HALF_M: f64 = 2500.0;
/// Distance between sections in metres.
const APART_M: f64 = 700.0;
/// Length of a valley that gives its direction, up and down from the section, in metres.
const ALONG_M: f64 = 1000.0;
/// The least height of a section in metres, where the relief is above that in the third place, and elsewhere.
const LEAST_M: [f64; 3] = [150.0, 10.0, 400.0];
/// Side of a world in metres below which all of these lengths shrink in proportion, and areas with their square.
const SMALL_M: f64 = 10_000.0;
/// The fewest sections whose medians are reported.
const ENOUGH: usize = 5;

/// The form of one section.
struct Section {
    v_index: f64,
    exponent: f64,
    /// Width at a tenth of the height over that at the height.
    floor: f64,
}

pub(super) fn measure(land: &Land<'_>, network: &Network, trunks: &[u32], report: &mut Report) {
    let (low, high) = land.field.range(0).unwrap_or_default();
    let least_m = if f64::from(high - low) > LEAST_M[2] { LEAST_M[0] } else { LEAST_M[1] };
    let side_m = network.nx.min(network.ny) as f64 * network.cell_m;
    let scale = (side_m / SMALL_M).min(1.0);
    let found: Vec<Section> = sections(land, network, trunks, scale)
        .into_iter()
        .filter_map(|places| {
            let heights: Option<Vec<f64>> = places.into_iter().map(|place| bilinear(land, place)).collect();
            section(&heights?, network.cell_m, least_m * scale)
        })
        .collect();
    put(report, "valleys.sections", found.len() as f64);
    let median = |value: &dyn Fn(&Section) -> f64| {
        let values: Vec<f32> = found.iter().map(|section| value(section) as f32).collect();
        if found.len() < ENOUGH { f64::NAN } else { quantiles(&values, &[0.5])[0] }
    };
    put(report, "valleys.v_index", median(&|section| section.v_index));
    put(report, "valleys.exponent", median(&|section| section.exponent));
    put(report, "valleys.floor", median(&|section| section.floor));
    if found.len() < ENOUGH {
        report.notes.push("fewer than 5 valleys whose sections fit: no form of valleys".to_owned());
    }
}

/// The places of sections in cells, from the largest valley down.
fn sections(land: &Land<'_>, network: &Network, trunks: &[u32], scale: f64) -> Vec<Vec<[f64; 2]>> {
    let (nx, ny, cell_m) = (network.nx, network.ny, network.cell_m / scale);
    let area_m2 = |cell: usize| network.area_m2(cell) / (scale * scale);
    let largest = (0..nx * ny).map(area_m2).fold(0.0, f64::max);
    let least = if largest < 4.0 * AREAS_M2[0] { AREAS_M2[1] } else { AREAS_M2[0] };
    let has = land.has();
    let mut cells: Vec<usize> = (0..nx * ny).filter(|&cell| area_m2(cell) >= least && has(cell)).collect();
    cells.sort_unstable_by_key(|&cell| (std::cmp::Reverse(network.area[cell]), cell));
    let steps = ((ALONG_M / cell_m).round() as usize).max(5);
    let (half, apart) = ((HALF_M / cell_m) as i64, (APART_M / cell_m) as usize);
    let mut used = vec![false; nx * ny];
    let mut sections = Vec::new();
    for cell in cells {
        if used[cell] {
            continue;
        }
        let below = (0..steps).fold(cell, |at, _| network.receiver[at] as usize);
        let above = (0..steps).fold(cell, |at, _| trunks[at] as usize);
        let along = network.step(above, below).map(|cells| cells as f64);
        let length = math::hypot(along[0], along[1]);
        if length < steps as f64 {
            continue;
        }
        let across = [-along[1] / length, along[0] / length];
        let centre = network.place(cell);
        let places: Vec<[f64; 2]> =
            (-half..=half).map(|t| [0, 1].map(|axis| centre[axis] + across[axis] * t as f64)).collect();
        let limits = [(nx - 1) as f64, (ny - 1) as f64];
        if places.iter().any(|place| (0..2).any(|axis| place[axis] < 0.0 || place[axis] > limits[axis])) {
            continue;
        }
        let (x, y) = (cell % nx, cell / nx);
        for y in y.saturating_sub(apart)..=(y + apart).min(ny - 1) {
            used[y * nx + x.saturating_sub(apart)..=y * nx + (x + apart).min(nx - 1)].fill(true);
        }
        sections.push(places);
    }
    sections
}

/// The height between cells. Returns None beside a void.
fn bilinear(land: &Land<'_>, [x, y]: [f64; 2]) -> Option<f64> {
    let (nx, ny) = (land.nx(), land.ny());
    let (i, j) = ((x as usize).min(nx - 2), (y as usize).min(ny - 2));
    let (u, v) = (x - i as f64, y - j as f64);
    let at = |i: usize, j: usize| f64::from(land.height.plane(0)[j * nx + i]);
    let z =
        (at(i, j) * (1.0 - u) + at(i + 1, j) * u) * (1.0 - v) + (at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u) * v;
    z.is_finite().then_some(z)
}

/// Measures a section. Returns None where it is no valley.
fn section(heights: &[f64], cell_m: f64, least_m: f64) -> Option<Section> {
    let middle = heights.len() / 2;
    let floor = (middle.checked_sub(2)?..=middle + 2).min_by(|&a, &b| heights[a].total_cmp(&heights[b]))?;
    let above = |place: usize| heights[place] - heights[floor];
    let sides: [Vec<f64>; 2] = [(0..=floor).rev().map(above).collect(), (floor..heights.len()).map(above).collect()];
    let ridges = [ridge(&sides[0]), ridge(&sides[1])];
    let height = 0.9 * ridges[0].1.min(ridges[1].1);
    if height < least_m || ridges.iter().any(|(cells, _)| *cells < 4) {
        return None;
    }
    let (mut width, mut narrow, mut area, mut exponents) = (0.0, 0.0, 0.0, Vec::new());
    for side in &sides {
        let (after, end) = reaches(side, height)?;
        narrow += reaches(side, 0.1 * height)?.1;
        // trapezoids of what lies between the line and the ground
        let free = |place: usize| height - side[place].min(height);
        area += (1..after).map(|place| 0.5 * (free(place - 1) + free(place))).sum::<f64>();
        area += 0.5 * free(after - 1) * (end - (after - 1) as f64);
        width += end;
        let points: Vec<[f64; 2]> = (1..=end as usize)
            .filter(|&place| side[place] > 0.0)
            .map(|place| [math::ln(place as f64 * cell_m), math::ln(side[place])])
            .collect();
        if points.len() >= 4 {
            exponents.push(line(&points).slope);
        }
    }
    let exponent = exponents.iter().sum::<f64>() / exponents.len() as f64;
    let v_index = area / (0.5 * width * height) - 1.0;
    exponent.is_finite().then_some(Section { v_index, exponent, floor: narrow / width })
}

/// The first place at or above a height, and the distance in cells at which the ground reaches it.
fn reaches(side: &[f64], height: f64) -> Option<(usize, f64)> {
    let after = side.iter().position(|&above| above >= height).filter(|after| *after > 0)?;
    Some((after, after as f64 - (side[after] - height) / (side[after] - side[after - 1])))
}

/// The cells to a ridge and its height: the highest place before the ground falls by a quarter of its height, or 30 m.
fn ridge(side: &[f64]) -> (usize, f64) {
    let mut highest = (0, 0.0);
    for (cells, &above) in side.iter().enumerate().skip(1) {
        if above > highest.1 {
            highest = (cells, above);
        } else if highest.1 - above > (0.25 * highest.1).max(30.0) {
            break;
        }
    }
    highest
}
