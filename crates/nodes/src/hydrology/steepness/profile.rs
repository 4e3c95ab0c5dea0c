//! The report of `Steepness`: its quantiles, and the profile of the largest river.

use orograph_graph::{Axis, Report, Series};

use super::{Channels, NONE};
use crate::numerics::{distribution::quantiles, routing::code::has_receiver};

/// Points of a profile, at most: more of them do not show.
const POINTS: usize = 1000;

/// A point of a river.
#[derive(Clone, Copy)]
struct Point {
    distance_m: f64,
    level_m: f64,
    chi_m: f64,
}

/// Returns the report. `steepness` is that of each channel cell.
pub(super) fn report(channels: &Channels<'_>, donors: &[u32], steepness: &[f32], base_m: f64) -> Report {
    let mut report = Report::default();
    let cells = (0..steepness.len()).filter(|&cell| channels.has(cell));
    let (mut length_m, mut values) = (0.0, Vec::new());
    for cell in cells {
        let code = channels.codes[cell];
        length_m += if has_receiver(code) { channels.length_m(code) } else { 0.0 };
        values.push(steepness[cell]);
    }
    report.measure("channels_length", length_m, "m");
    let names = ["steepness_p5", "steepness_p50", "steepness_p95"];
    for (name, value) in names.into_iter().zip(quantiles(&values, &[0.05, 0.5, 0.95])) {
        report.measure(name, value, "");
    }
    let river = largest(channels, donors, base_m);
    let (Some(low), Some(high)) = (river.first(), river.last()) else {
        report.notes.push("no channel ends in this world".to_owned());
        return report;
    };
    report.measure("river_length", high.distance_m, "m");
    report.measure("river_relief", high.level_m - low.level_m, "m");
    report.measure("river_chi", high.chi_m, "m");
    let step = river.len().div_ceil(POINTS);
    // both ends, and every so many points between
    let thinned: Vec<Point> = river[..river.len() - 1].iter().step_by(step).chain([high]).copied().collect();
    let of = |value: fn(&Point) -> f64| thinned.iter().map(value).collect::<Vec<f64>>();
    let elevation = || Axis::new("elevation", "m", of(|point| point.level_m));
    let distance = Axis::new("distance from the end of the largest river", "m", of(|point| point.distance_m));
    let chi = Axis::new("chi of the largest river", "m", of(|point| point.chi_m));
    report.series.push(Series::new("profile", distance, elevation()));
    report.series.push(Series::new("chi_profile", chi, elevation()));
    report
}

/// The river with the largest drainage area from its end upwards, along the largest tributaries; of equal ones the first,
/// row by row.
fn largest(channels: &Channels<'_>, donors: &[u32], base_m: f64) -> Vec<Point> {
    let area = |cell: usize| channels.drained.area_m2[cell];
    let ends = (0..donors.len()).filter(|&cell| channels.has(cell) && !has_receiver(channels.codes[cell]));
    let Some(end) = ends.reduce(|most, cell| if area(cell) > area(most) { cell } else { most }) else {
        return Vec::new();
    };
    let level = |cell: usize| f64::from(channels.drained.level_m[cell]);
    let mut point = Point { distance_m: 0.0, level_m: level(end), chi_m: 0.0 };
    let (mut cell, mut river) = (end, vec![point]);
    while donors[cell] != NONE {
        cell = donors[cell] as usize;
        let link_m = channels.length_m(channels.codes[cell]);
        point.distance_m += link_m;
        point.level_m = level(cell);
        if point.level_m > base_m {
            point.chi_m += link_m * f64::from(channels.weights[cell]);
        }
        river.push(point);
    }
    river
}
