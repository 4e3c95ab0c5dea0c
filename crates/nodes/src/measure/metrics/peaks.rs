//! Peaks and their prominence: how far the ground falls before it rises to a higher peak.

use super::{Land, Params, network::Neighbours, put};
use crate::prelude::*;
use orograph_graph::{Axis, Series};

/// A summit.
struct Peak {
    cell: u32,
    elevation: f32,
    /// Elevation of the highest pass to a higher summit; that of the lowest ground for the highest of all.
    pass: f32,
}

/// Measures peaks; `order` has the cells with a height from the highest.
pub(super) fn measure(
    land: &Land<'_>,
    order: &[u32],
    params: &Params,
    report: &mut Report,
    check: &dyn Fn() -> Result<(), NodeError>,
) -> Result<(), NodeError> {
    let mut peaks = peaks(land, order, check)?;
    peaks.retain(|peak| f64::from(peak.elevation) - f64::from(peak.pass) >= params.prominence);
    let elevations = peaks.iter().map(|peak| f64::from(peak.elevation));
    let (count, most) = (peaks.len() as f64, elevations.clone().fold(f64::NAN, f64::max));
    let area_km2 = land.cells() as f64 * land.cell_m() * land.cell_m() * 1e-6;
    put(report, "peaks.prominence", params.prominence);
    put(report, "peaks.count", count);
    put(report, "peaks.density", 100.0 * count / area_km2);
    put(report, "peaks.max", most);
    put(report, "peaks.mean", elevations.sum::<f64>() / count);
    let mut prominences: Vec<f64> = peaks.iter().map(|peak| f64::from(peak.elevation) - f64::from(peak.pass)).collect();
    prominences.sort_unstable_by(|a, b| b.total_cmp(a));
    report.series.push(Series::new(
        "prominences",
        Axis::new("rank of the peak", "", (1..=prominences.len()).map(|rank| rank as f64).collect()),
        Axis::new("prominence", "m", prominences),
    ));
    Ok(())
}

/// All summits, from the highest, by joining cells from the top down. `area` of a plateau counts as one summit.
fn peaks(land: &Land<'_>, order: &[u32], check: &dyn Fn() -> Result<(), NodeError>) -> Result<Vec<Peak>, NodeError> {
    const NONE: u32 = u32::MAX;
    let (neighbours, heights) = (Neighbours::new(land.nx(), land.ny()), land.samples());
    let mut peaks: Vec<Peak> = Vec::new();
    // the summit of each cell that is above water, and the higher summit that each summit is joined to
    let mut summit = vec![NONE; heights.len()];
    let mut joined: Vec<u32> = Vec::new();
    let find = |joined: &mut [u32], mut peak: u32| {
        while joined[peak as usize] != peak {
            joined[peak as usize] = joined[joined[peak as usize] as usize];
            peak = joined[peak as usize];
        }
        peak
    };
    let mut lowest = f32::NAN;
    for (done, &cell) in order.iter().enumerate() {
        if done.is_multiple_of(1 << 18) {
            check()?;
        }
        let elevation = heights[cell as usize];
        if elevation.is_nan() {
            continue;
        }
        lowest = elevation;
        let (mut own, mut last) = (NONE, NONE);
        for next in neighbours.of(cell as usize) {
            // most neighbours belong to one summit
            if summit[next] == NONE || summit[next] == last {
                continue;
            }
            last = summit[next];
            let other = find(&mut joined, last);
            if own == NONE || own == other {
                own = other;
                continue;
            }
            // summits are numbered from the highest
            let (high, low) = (own.min(other), own.max(other));
            peaks[low as usize].pass = elevation;
            joined[low as usize] = high;
            own = high;
        }
        if own == NONE {
            own = peaks.len() as u32;
            joined.push(own);
            peaks.push(Peak { cell, elevation, pass: f32::NAN });
        }
        summit[cell as usize] = own;
    }
    peaks.iter_mut().filter(|peak| peak.pass.is_nan()).for_each(|peak| peak.pass = lowest);
    // on level ground, a summit is no higher than its pass
    let has = land.has();
    peaks.retain(|peak| peak.elevation > peak.pass && has(peak.cell as usize));
    Ok(peaks)
}

#[cfg(test)]
mod tests {
    use super::{super::order, *};
    use crate::testing::{field, world};

    /// Two cones of 1000 m and 700 m, 10 km apart, with slopes of 0.1: their pass lies at 350 m.
    #[test]
    fn a_lower_cone_is_prominent_above_the_pass() {
        let cone =
            |x: f64, y: f64, at: f64, top: f64| top - 0.1 * ((x - at) * (x - at) + (y - 5050.0) * (y - 5050.0)).sqrt();
        let land = field(world(200, 101, 100.0), |x, y| cone(x, y, 5050.0, 1000.0).max(cone(x, y, 15050.0, 700.0)));
        let found = peaks(&Land::of(&land, None), &order::from_the_top(land.plane(0)), &|| Ok(())).expect("peaks");
        assert_eq!(found.len(), 2);
        let prominences = [0, 1].map(|k| found[k].elevation - found[k].pass);
        assert_eq!([found[0].elevation, found[1].elevation], [1000.0, 700.0]);
        assert!((prominences[1] - 350.0).abs() <= 5.0, "{prominences:?}");
    }
}
