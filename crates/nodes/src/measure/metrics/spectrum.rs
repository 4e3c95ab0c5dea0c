//! The slope of the power spectrum by bands of wavelength.

use super::{Land, fit::line, put};
use crate::{
    numerics::{
        fourier::{Batch, LANES, Plan},
        math, par,
    },
    prelude::*,
};
use orograph_graph::{Axis, Series};

/// The fewest cells per side.
const LEAST: usize = 32;

/// A band of wavelengths whose slope is reported.
struct Band {
    name: &'static str,
    /// The shortest wavelength in cells, and the longest; 0 for a quarter of the side.
    cells: [f64; 2],
    bins: usize,
}

const BANDS: [Band; 3] = [
    Band { name: "spectrum.beta", cells: [8.0, 0.0], bins: 20 },
    Band { name: "spectrum.beta_8_to_24_cells", cells: [8.0, 24.0], bins: 10 },
    Band { name: "spectrum.beta_4_to_8_cells", cells: [4.0, 8.0], bins: 8 },
];

/// Measures the largest centred square, without its mean plane, in a Hann window.
pub(super) fn measure(land: &Land<'_>, report: &mut Report) {
    let side = land.nx().min(land.ny());
    let power = if side >= LEAST && land.is_whole() { power(land, side) } else { Vec::new() };
    if power.is_empty() {
        BANDS.iter().for_each(|band| put(report, band.name, f64::NAN));
        report.notes.push("the spectrum needs 32 x 32 cells without voids, sea or mask".to_owned());
        return;
    }
    let waves = waves(side);
    for band in &BANDS {
        let lowest = if band.cells[1] == 0.0 { 4.0 } else { side as f64 / band.cells[1] };
        let curve = bins(&power, &waves, side, [lowest, side as f64 / band.cells[0]], band.bins);
        let points: Vec<[f64; 2]> = curve.iter().map(|point| point.map(math::log10)).collect();
        put(report, band.name, if points.len() < 3 { f64::NAN } else { -line(&points).slope });
    }
    let curve = bins(&power, &waves, side, [1.0, side as f64 / 2.0], 32);
    let length_m = side as f64 * land.cell_m();
    report.series.push(Series::new(
        "spectrum",
        Axis::logarithmic("wavelength", "m", curve.iter().map(|point| length_m / point[0]).collect()),
        Axis::logarithmic(
            "power density",
            "m⁴",
            curve.iter().map(|point| point[1] * land.cell_m() * land.cell_m()).collect(),
        ),
    ));
}

/// The waves per side of each place in the first half of the spectrum's rows, and their logarithm. The second half
/// mirrors the first.
fn waves(side: usize) -> Vec<[f64; 2]> {
    let half = side / 2 + 1;
    par::map(half * half, |at| {
        let waves = math::hypot((at % half) as f64, (at / half) as f64);
        [waves, math::ln(waves)]
    })
}

/// Mean power in logarithmic bins of wavenumber, in waves per side: the bin's geometric middle and the mean.
fn bins(power: &[f64], waves: &[[f64; 2]], side: usize, [low, high]: [f64; 2], bins: usize) -> Vec<[f64; 2]> {
    let half = side / 2 + 1;
    let (from, width) = (math::ln(low), math::ln(high / low) / bins as f64);
    let mut sums = vec![[0.0; 2]; bins];
    for (at, power) in power.iter().enumerate() {
        let (m, n) = (at % half, at / half);
        let [waves, ln_waves] = waves[n.min(side - n) * half + m];
        if waves < low || waves >= high {
            continue;
        }
        let bin = (((ln_waves - from) / width) as usize).min(bins - 1);
        // every column but the first and, for even sides, the last stands for two
        let weight = if m == 0 || 2 * m == side { 1.0 } else { 2.0 };
        sums[bin] = [sums[bin][0] + weight, sums[bin][1] + weight * power];
    }
    let middle = |bin: usize| math::exp(from + (bin as f64 + 0.5) * width);
    let points = sums.iter().enumerate().filter(|(_, sum)| sum[0] > 0.0 && sum[1] > 0.0);
    points.map(|(bin, sum)| [middle(bin), sum[1] / sum[0]]).collect()
}

/// The squared transform of the windowed heights over the sum of the squared window, `side / 2 + 1` columns of `side`
/// rows.
fn power(land: &Land<'_>, side: usize) -> Vec<f64> {
    let [x0, y0] = [(land.nx() - side) / 2, (land.ny() - side) / 2];
    let row = |j: usize| &land.samples()[(y0 + j) * land.nx() + x0..][..side];
    let centre = 0.5 * (side as f64 - 1.0);
    // the mean plane: the coordinates of a grid are orthogonal
    let sums = par::collect_all(0..side, |_, j| {
        let (mut sum, mut along) = (0.0, 0.0);
        for (i, &z) in row(j).iter().enumerate() {
            sum += f64::from(z);
            along += f64::from(z) * (i as f64 - centre);
        }
        [sum, along, sum * (j as f64 - centre)]
    });
    let total = sums.iter().fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
    let count = (side * side) as f64;
    let square = count * (side as f64 * side as f64 - 1.0) / 12.0;
    let [mean, east, south] = [total[0] / count, total[1] / square, total[2] / square];
    let hann: Vec<f64> =
        (0..side).map(|i| 0.5 - 0.5 * math::cos(2.0 * std::f64::consts::PI * i as f64 / (side as f64 - 1.0))).collect();
    let plan = Plan::<f64>::new(side);
    let half = side / 2 + 1;
    // rows, LANES at a time; what remains is transposed: columns of the half spectrum
    let groups = par::collect_all(0..side.div_ceil(LANES), |_, group| {
        let mut rows = plan.room();
        for lane in 0..LANES.min(side - group * LANES) {
            let j = group * LANES + lane;
            for (i, &z) in row(j).iter().enumerate() {
                let plane = mean + east * (i as f64 - centre) + south * (j as f64 - centre);
                rows[i].re[lane] = (f64::from(z) - plane) * hann[i] * hann[j];
            }
        }
        plan.transform(&mut rows);
        rows.truncate(half);
        rows
    });
    let weight: f64 = hann.iter().map(|w| w * w).sum();
    let scale = 1.0 / (weight * weight);
    let columns = par::collect_all(0..half.div_ceil(LANES), |_, first| {
        let mut columns = plan.room();
        for (j, place) in columns.iter_mut().enumerate().take(side) {
            for lane in 0..LANES.min(half - first * LANES) {
                let value = &groups[j / LANES][first * LANES + lane];
                (place.re[lane], place.im[lane]) = (value.re[j % LANES], value.im[j % LANES]);
            }
        }
        plan.transform(&mut columns);
        columns.truncate(side);
        let square = |value: &Batch<f64>, lane: usize| {
            (value.re[lane] * value.re[lane] + value.im[lane] * value.im[lane]) * scale
        };
        columns.iter().map(|value| std::array::from_fn(|lane| square(value, lane))).collect::<Vec<[f64; LANES]>>()
    });
    par::map(side * half, |at| columns[at % half / LANES][at / half][at % half % LANES])
}
