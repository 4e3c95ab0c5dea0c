//! Slope and drainage area along rivers: concavity, steepness, chi.

use super::{
    Land, Network,
    fit::{confidence, line},
    put,
};
use crate::{
    numerics::{distribution::quantiles, math, par},
    prelude::*,
};
use orograph_graph::{Axis, Series};

/// Links of a reach over which slope is measured, and the least slope.
const REACH: usize = 10;
const LEAST: f64 = 1e-5;
/// Width of the bins of drainage area in powers of ten, and the reaches that a bin needs.
const BIN: f64 = 0.2;
const REACHES: usize = 30;
/// Reference concavity of steepness and chi.
const REFERENCE: f64 = 0.45;
/// Reference area of chi in m².
const CHI_M2: f64 = 1e6;
/// Basins in which the concavity of chi is sought, and the fewest and most river cells of a basin: of larger ones, the
/// cells with the largest areas.
const BASINS: usize = 8;
const CELLS: usize = 300;
const MOST: usize = 5000;

fn power_of_ten(exponent: f64) -> f64 {
    math::exp(exponent * std::f64::consts::LN_10)
}

/// Logarithms to base ten of slope and of mean drainage area of each reach.
fn reaches(land: &Land<'_>, network: &Network, river_m2: f64) -> Vec<[f64; 2]> {
    let logs: Vec<f32> = par::map(network.area.len(), |cell| {
        let area = network.area_m2(cell);
        if area >= river_m2 { math::log10(area) as f32 } else { 0.0 }
    });
    let reach = |start: usize| {
        let (mut at, mut length, mut weighted) = (start, 0.0, 0.0);
        for _ in 0..REACH {
            let link = network.length_m(at);
            length += link;
            weighted += link * f64::from(logs[at]);
            at = network.below(at)?;
        }
        let slope = (network.level[start] - network.level[at]) / length;
        (slope > LEAST).then(|| [weighted / length, math::log10(slope)])
    };
    let (cells, has) = (0..network.area.len(), land.has());
    cells.filter(|&cell| logs[cell] > 0.0 && has(cell)).filter_map(reach).collect()
}

pub(super) fn measure(land: &Land<'_>, network: &Network, river_m2: f64, report: &mut Report) {
    let reaches = reaches(land, network, river_m2);
    let lowest = reaches.iter().map(|reach| reach[0]).fold(f64::INFINITY, f64::min);
    let first = (lowest / BIN).floor() * BIN;
    let mut bins: Vec<(usize, f64, f64)> = Vec::new();
    for [x, y] in &reaches {
        let bin = ((x - first) / BIN) as usize;
        if bins.len() <= bin {
            bins.resize(bin + 1, (0, 0.0, 0.0));
        }
        let sums = &mut bins[bin];
        *sums = (sums.0 + 1, sums.1 + x, sums.2 + y);
    }
    let points: Vec<[f64; 2]> =
        bins.iter().filter(|bin| bin.0 >= REACHES).map(|bin| [bin.1, bin.2].map(|sum| sum / bin.0 as f64)).collect();
    let enough = reaches.len() >= 200 && points.len() >= 4;
    let fitted = line(if enough { &points } else { &[] });
    put(report, "concavity", -fitted.slope);
    put(report, "concavity.error", confidence(points.len()) * fitted.error);
    put(report, "concavity.r2", fitted.r2);
    let rest = |[x, y]: &[f64; 2]| y - fitted.intercept - fitted.slope * x;
    let mean = reaches.iter().map(rest).sum::<f64>() / reaches.len() as f64;
    let square: f64 = reaches.iter().map(|reach| (rest(reach) - mean) * (rest(reach) - mean)).sum();
    put(report, "concavity.scatter", (square / reaches.len() as f64).sqrt());
    let steepness: Vec<f32> = reaches.iter().map(|[x, y]| power_of_ten(y + REFERENCE * x) as f32).collect();
    for (name, value) in ["steepness.p50", "steepness.p95"].into_iter().zip(quantiles(&steepness, &[0.5, 0.95])) {
        put(report, name, if enough { value } else { f64::NAN });
    }
    if enough {
        report.series.push(Series::new(
            "slope_area",
            Axis::logarithmic("drainage area", "m²", points.iter().map(|point| power_of_ten(point[0])).collect()),
            Axis::logarithmic("slope of rivers", "", points.iter().map(|point| power_of_ten(point[1])).collect()),
        ));
    } else {
        report.notes.push("too few rivers for their concavity".to_owned());
    }
}

/// The river cells of a basin from its outlet upwards.
struct Tree {
    /// The place in the list of the cell downstream.
    below: Vec<u32>,
    length_m: Vec<f64>,
    /// Logarithm of the reference area over the drainage area.
    ln_share: Vec<f64>,
    level: Vec<f64>,
}

impl Tree {
    fn chi(&self, concavity: f64) -> Vec<f64> {
        let mut chi = vec![0.0; self.below.len()];
        for cell in 1..chi.len() {
            let step = self.length_m[cell] * math::exp(concavity * self.ln_share[cell]);
            chi[cell] = chi[self.below[cell] as usize] + step;
        }
        chi
    }

    /// How far elevations are from one function of chi: the sum of their differences in the order of chi, less the
    /// relief, over the relief (Goren et al. 2014, Hergarten et al. 2016).
    fn disorder(&self, concavity: f64) -> f64 {
        let order = ranked(&self.chi(concavity));
        let level = |place: usize| self.level[order[place] as usize];
        let total: f64 = (1..order.len()).map(|place| (level(place) - level(place - 1)).abs()).sum();
        let low = self.level.iter().copied().fold(f64::INFINITY, f64::min);
        let high = self.level.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        (total - (high - low)) / (high - low)
    }

    /// The cells with the largest areas, at most [`MOST`]: they are connected, as areas fall upstream.
    fn limited(self) -> Self {
        if self.below.len() <= MOST {
            return self;
        }
        let mut shares = self.ln_share.clone();
        let (_, &mut most, _) = shares.select_nth_unstable_by(MOST - 1, f64::total_cmp);
        let mut place = vec![0; self.below.len()];
        let mut kept = Self { below: Vec::new(), length_m: Vec::new(), ln_share: Vec::new(), level: Vec::new() };
        for cell in (0..self.below.len()).filter(|&cell| self.ln_share[cell] <= most) {
            place[cell] = kept.below.len() as u32;
            kept.below.push(place[self.below[cell] as usize]);
            kept.length_m.push(self.length_m[cell]);
            kept.ln_share.push(self.ln_share[cell]);
            kept.level.push(self.level[cell]);
        }
        kept
    }

    /// The concavity with the least disorder, to 0.025.
    fn concavity(&self) -> f64 {
        let tried: Vec<f64> = (2..40).map(|step| 0.025 * f64::from(step)).collect();
        let disorder = par::collect_all(&tried, |_, concavity| self.disorder(*concavity));
        let best = disorder.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1));
        best.map_or(f64::NAN, |(at, _)| tried[at])
    }
}

/// The cells in the order of chi, equal ones by number. There are as many bins as cells, each of which is sorted.
fn ranked(chi: &[f64]) -> Vec<u32> {
    let most = chi.iter().copied().fold(0.0, f64::max);
    let last = chi.len().saturating_sub(1);
    let per_chi = if most > 0.0 { chi.len() as f64 / most } else { 0.0 };
    let bin = |chi: f64| ((chi * per_chi) as usize).min(last);
    let mut ends = vec![0_usize; chi.len()];
    chi.iter().for_each(|&chi| ends[bin(chi)] += 1);
    (1..ends.len()).for_each(|at| ends[at] += ends[at - 1]);
    let mut order = vec![0_u32; chi.len()];
    let mut starts = ends.clone();
    for (cell, &chi) in chi.iter().enumerate().rev() {
        let place = &mut starts[bin(chi)];
        *place -= 1;
        order[*place] = cell as u32;
    }
    for (start, end) in starts.into_iter().zip(ends).filter(|(start, end)| end - start > 1) {
        order[start..end].sort_by(|&a, &b| chi[a as usize].total_cmp(&chi[b as usize]));
    }
    order
}

/// Chi of the largest basins (Perron and Royden 2013).
pub(super) fn chi(network: &Network, river_m2: f64, report: &mut Report) {
    let mut outlets: Vec<u32> = network.order.clone();
    outlets.retain(|&cell| network.below(cell as usize).is_none() && network.area_m2(cell as usize) >= river_m2);
    outlets.sort_by_key(|&cell| (std::cmp::Reverse(network.area[cell as usize]), cell));
    outlets.truncate(BASINS);
    // basin and place of the river cells
    let mut basins: Vec<Tree> = outlets
        .iter()
        .map(|_| Tree { below: Vec::new(), length_m: Vec::new(), ln_share: Vec::new(), level: Vec::new() })
        .collect();
    let mut places = std::collections::HashMap::new();
    for &cell in &network.order {
        let at = cell as usize;
        let area_m2 = network.area_m2(at);
        if area_m2 < river_m2 {
            continue;
        }
        let found = match network.below(at) {
            None => outlets.iter().position(|&outlet| outlet == cell).map(|basin| (basin, 0)),
            Some(below) => places.get(&(below as u32)).copied(),
        };
        let Some((basin, below)) = found else { continue };
        let tree: &mut Tree = &mut basins[basin];
        places.insert(cell, (basin, tree.below.len() as u32));
        tree.below.push(below);
        tree.length_m.push(network.length_m(at));
        tree.ln_share.push(math::ln(CHI_M2 / area_m2));
        tree.level.push(network.level[at]);
    }
    let large: Vec<Tree> = basins.into_iter().filter(|tree| tree.below.len() >= CELLS).map(Tree::limited).collect();
    let concavities: Vec<f32> = large.iter().map(|tree| tree.concavity() as f32).collect();
    put(report, "chi.concavity", quantiles(&concavities, &[0.5])[0]);
    let Some(tree) = large.first() else {
        put(report, "chi.r2", f64::NAN);
        return;
    };
    let chi = tree.chi(REFERENCE);
    let points: Vec<[f64; 2]> = chi.iter().zip(&tree.level).map(|(chi, level)| [*chi, *level]).collect();
    put(report, "chi.r2", line(&points).r2);
    report.series.push(curve(&points));
}

/// Mean elevation in forty bins of chi.
fn curve(points: &[[f64; 2]]) -> Series {
    let most = points.iter().map(|point| point[0]).fold(0.0, f64::max);
    let mut bins = vec![(0.0, 0.0, 0.0); 40];
    for [chi, level] in points {
        let bin = &mut bins[((chi / most * 40.0) as usize).min(39)];
        *bin = (bin.0 + 1.0, bin.1 + chi, bin.2 + level);
    }
    bins.retain(|bin| bin.0 > 0.0);
    Series::new(
        "chi_profile",
        Axis::new(
            "chi of the largest basin at concavity 0.45 and 1 km²",
            "m",
            bins.iter().map(|b| b.1 / b.0).collect(),
        ),
        Axis::new("elevation", "m", bins.iter().map(|b| b.2 / b.0).collect()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trunk of 40 cells with a tributary of a tenth of the area from its tenth cell, in balance at a concavity.
    #[test]
    fn a_basin_in_balance_has_its_concavity() {
        for concavity in [0.3, 0.45, 0.6] {
            let mut tree =
                Tree { below: vec![0], length_m: vec![0.0], ln_share: vec![math::ln(CHI_M2 / 5e8)], level: vec![0.0] };
            for cell in 1..40_u32 {
                tree.below.push(cell - 1);
                tree.ln_share.push(math::ln(CHI_M2 / (5e8 - 1.2e7 * f64::from(cell))));
            }
            for cell in 40..70_u32 {
                tree.below.push(if cell == 40 { 10 } else { cell - 1 });
                tree.ln_share.push(math::ln(CHI_M2 / (5e7 - 1.6e6 * f64::from(cell - 40))));
            }
            tree.length_m.resize(70, 1000.0);
            tree.level = tree.chi(concavity).iter().map(|chi| 0.07 * chi).collect();
            assert!((tree.concavity() - concavity).abs() < 1e-9, "{concavity}: {}", tree.concavity());
        }
    }
}
