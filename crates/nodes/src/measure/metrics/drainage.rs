//! Drainage density, basins, and the marks that a computation leaves on channels.

use super::{Land, Network, Params, put};
use crate::{
    numerics::{distribution::quantiles, math, par},
    prelude::*,
};
use orograph_graph::{Axis, Series};

/// Length of the reach whose sinuosity is measured, in metres.
const REACH_M: f64 = 3000.0;
/// Links over which the direction of a channel is measured, and cells that make its harmonics certain.
const LINKS: usize = 12;
const ENOUGH: usize = 500;
/// Width of the ring at the border in which combs are looked for, in metres, and its outermost cells left out.
const RING_M: f64 = 2000.0;
const RIM: usize = 10;
/// Drainage areas of the channels of a comb, in m², and links over which their direction is measured.
const COMB_M2: [f64; 2] = [3e5, 1e7];
const COMB_LINKS: usize = 6;
/// Cosine of 30°.
const NARROW: f64 = 0.866_025_403_784_438_6;

/// The density of channels that begin by area, and of those that begin by area and slope.
pub(super) fn density(land: &Land<'_>, network: &Network, params: &Params, report: &mut Report) {
    let (mut by_area, mut by_slope) = (0.0, 0.0);
    let mut channel = vec![false; network.receiver.len()];
    let has = land.has();
    for &cell in network.order.iter().rev() {
        let cell = cell as usize;
        let Some(below) = network.below(cell) else { continue };
        let (length, area) = (network.length_m(cell), network.area_m2(cell));
        let slope = (network.level[cell] - network.level[below]) / length;
        let heads = channel[cell] || area * slope * slope >= params.channel_constant;
        if heads {
            channel[below] = true;
        }
        if has(cell) {
            by_area += if area >= params.channel_area { length } else { 0.0 };
            by_slope += if heads { length } else { 0.0 };
        }
    }
    // m/m² to km/km²
    let density = |length: f64| 1e3 * length / (land.cells() as f64 * land.cell_m() * land.cell_m());
    put(report, "channel_area", params.channel_area);
    put(report, "drainage_density", density(by_area));
    put(report, "channel_constant", params.channel_constant);
    put(report, "drainage_density.by_slope", density(by_slope));
}

/// The share of the land in closed depressions.
pub(super) fn pits(land: &Land<'_>, network: &Network, report: &mut Report) {
    let cells = network.order.len() as f64;
    put(report, "pits.share", network.flooded[0] as f64 / cells);
    put(report, "pits.deeper_than_1_m", network.flooded[1] as f64 / cells);
    if land.masked > 0 && network.flooded[0] > 0 {
        report.notes.push("pits are counted outside of the mask too".to_owned());
    }
}

/// The largest basin, and the hypsometric integral of basins.
pub(super) fn basins(land: &Land<'_>, network: &Network, orders: &[u8], report: &mut Report) {
    let outlets = network.outlets();
    let largest = network.order.iter().copied().filter(|&cell| network.below(cell as usize).is_none());
    let largest = largest.max_by_key(|&cell| (network.area[cell as usize], std::cmp::Reverse(cell)));
    let Some(outlet) = largest else {
        for name in ["area", "relief", "length", "relief_ratio"] {
            put(report, &format!("basin.{name}"), f64::NAN);
        }
        put(report, "basins.hypsometric_integral", f64::NAN);
        return;
    };
    // lengths of the paths from the outlets
    let mut length = vec![0.0_f32; network.receiver.len()];
    let heights = land.height.plane(0);
    let (mut top, mut farthest) = (f32::NEG_INFINITY, outlet as usize);
    for &cell in &network.order {
        let cell = cell as usize;
        if let Some(below) = network.below(cell) {
            length[cell] = length[below] + network.length_m(cell) as f32;
        }
        if outlets[cell] == outlet {
            top = top.max(heights[cell]);
            farthest = if length[cell] > length[farthest] { cell } else { farthest };
        }
    }
    let [dx, dy] = network.step(farthest, outlet as usize);
    let straight = math::hypot(dx as f64, dy as f64) * network.cell_m;
    let relief = f64::from(top) - f64::from(heights[outlet as usize]);
    put(report, "basin.area", network.area_m2(outlet as usize));
    put(report, "basin.relief", relief);
    put(report, "basin.length", straight);
    put(report, "basin.relief_ratio", relief / straight);
    put(report, "basins.hypsometric_integral", integral(land, network, orders, outlets));
}

/// The mean of the hypsometric integrals of basins of the third order or more, weighted by their areas. Takes the outlet
/// of each cell.
fn integral(land: &Land<'_>, network: &Network, orders: &[u8], mut basins: Vec<u32>) -> f64 {
    const NONE: u32 = u32::MAX;
    let outlets = (0..basins.len()).filter(|&cell| network.below(cell).is_none() && orders[cell] >= 3);
    let large: Vec<usize> = outlets.collect();
    let number = |outlet: u32| large.binary_search(&(outlet as usize)).map_or(NONE, |basin| basin as u32);
    par::change(&mut basins, |basin| *basin = number(*basin));
    let mut sums = vec![(0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY); large.len()];
    let measured = land.samples();
    for &cell in &network.order {
        let (basin, z) = (basins[cell as usize], measured[cell as usize]);
        if basin != NONE && z.is_finite() {
            let (z, basin) = (f64::from(z), &mut sums[basin as usize]);
            *basin = (basin.0 + 1.0, basin.1 + z, basin.2.min(z), basin.3.max(z));
        }
    }
    let (mut weighted, mut weight) = (0.0, 0.0);
    for (cells, sum, low, high) in sums.into_iter().filter(|basin| basin.3 > basin.2) {
        weighted += cells * (sum / cells - low) / (high - low);
        weight += cells;
    }
    weighted / weight
}

/// What tells computed channels from real ones: runs of one direction, preferred directions, combs at the border.
pub(super) fn marks(land: &Land<'_>, network: &Network, river_m2: f64, report: &mut Report) {
    let has = land.has();
    let cells = network.order.iter().map(|&cell| cell as usize).filter(|&cell| has(cell));
    let channels: Vec<usize> =
        cells.filter(|&cell| network.area_m2(cell) >= river_m2 && network.below(cell).is_some()).collect();
    let direction = |cell: usize| network.below(cell).map(|below| network.step(cell, below));
    let same = |cell: usize| network.below(cell).is_some_and(|below| direction(below) == direction(cell));
    let enough = channels.len() >= ENOUGH;
    let or_nan = |value: f64| if enough { value } else { f64::NAN };
    let straight = channels.iter().filter(|&&cell| same(cell)).count() as f64 / channels.len() as f64;
    put(report, "channels.straight", or_nan(straight));
    let (mut ways, mut sums) = (0.0, [0.0; 2]);
    for &cell in &channels {
        let Some(far) = network.after(cell, LINKS) else { continue };
        let [dx, dy] = network.step(cell, far).map(|cells| cells as f64);
        let square = dx * dx + dy * dy;
        if square > 0.0 {
            let cos_2 = (dx * dx - dy * dy) / square;
            let (cos_4, sin_4) = (2.0 * cos_2 * cos_2 - 1.0, 4.0 * cos_2 * dx * dy / square);
            sums = [sums[0] + 2.0 * cos_4 * cos_4 - 1.0, sums[1] + sin_4];
            ways += 1.0;
        }
    }
    put(report, "channels.eight_fold", or_nan(sums[0] / ways));
    let links = (REACH_M / network.cell_m) as usize;
    let sinuosities: Vec<f32> = if links < 6 { Vec::new() } else { sinuosities(network, &channels, links) };
    put(report, "channels.sinuosity", or_nan(quantiles(&sinuosities, &[0.5])[0]));
    put(report, "border.comb", comb(land, network));
}

/// Lengths of reaches of `links` over the straight distance.
fn sinuosities(network: &Network, channels: &[usize], links: usize) -> Vec<f32> {
    // every fourth channel cell: reaches overlap
    let reach = |&cell: &usize| {
        let (mut at, mut length) = (cell, 0.0);
        for _ in 0..links {
            length += network.length_m(at);
            at = network.below(at)?;
        }
        let [dx, dy] = network.step(cell, at).map(|cells| cells as f64);
        Some((length / (math::hypot(dx, dy) * network.cell_m).max(network.cell_m)) as f32)
    };
    channels.iter().step_by(4).filter_map(reach).collect()
}

/// The share of small channels in a ring along the border that run within 30° of straight out: a sixth where none is
/// preferred.
fn comb(land: &Land<'_>, network: &Network) -> f64 {
    let (nx, ny) = (network.nx, network.ny);
    let ring = (RING_M / network.cell_m) as usize;
    let (mut out, mut all) = (0.0, 0.0);
    if ring <= RIM || nx < 6 * ring || ny < 6 * ring {
        return f64::NAN;
    }
    let has = land.has();
    for &cell in &network.order {
        let cell = cell as usize;
        let area = network.area_m2(cell);
        if area <= COMB_M2[0] || area >= COMB_M2[1] || !has(cell) {
            continue;
        }
        let (x, y) = (cell % nx, cell / nx);
        let near = |at: usize, cells: usize| -> Option<f64> {
            if (RIM..ring).contains(&at) {
                return Some(-1.0);
            }
            (RIM..ring).contains(&(cells - 1 - at)).then_some(1.0)
        };
        let between = |at: usize, cells: usize| at > 2 * ring && at + 2 * ring < cells;
        let normal = match (near(x, nx), near(y, ny)) {
            (Some(sign), None) if between(y, ny) => [sign, 0.0],
            (None, Some(sign)) if between(x, nx) => [0.0, sign],
            _ => continue,
        };
        let Some(far) = network.after(cell, COMB_LINKS) else { continue };
        let [dx, dy] = network.step(cell, far).map(|cells| cells as f64);
        all += 1.0;
        out += f64::from(u8::from(dx * normal[0] + dy * normal[1] > NARROW * math::hypot(dx, dy)));
    }
    if all >= 100.0 { out / all } else { f64::NAN }
}

/// The elevation of the largest river along its length, upstream from its outlet.
pub(super) fn profile(land: &Land<'_>, network: &Network, trunks: &[u32], river_m2: f64, report: &mut Report) {
    let outlet = network.order.iter().copied().filter(|&cell| network.below(cell as usize).is_none());
    let Some(outlet) = outlet.max_by_key(|&cell| (network.area[cell as usize], std::cmp::Reverse(cell))) else {
        return;
    };
    let mut points = vec![(0.0, outlet as usize)];
    let (mut length, mut cell) = (0.0, outlet as usize);
    while trunks[cell] as usize != cell && network.area_m2(trunks[cell] as usize) >= river_m2 {
        cell = trunks[cell] as usize;
        length += network.length_m(cell);
        points.push((length, cell));
    }
    if points.len() < 2 {
        return;
    }
    report.series.push(Series::new(
        "river_profile",
        Axis::new("distance from the outlet of the largest river", "m", points.iter().map(|point| point.0).collect()),
        Axis::new("elevation", "m", points.iter().map(|point| f64::from(land.height.plane(0)[point.1])).collect()),
    ));
}
