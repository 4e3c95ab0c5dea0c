//! Orders of streams, Horton's ratios and Hack's exponent.

use super::{Land, Network, fit::line, put};
use crate::{numerics::math, prelude::*};

/// Width of the bins of drainage area in powers of ten, and the cells that a bin needs.
const BIN: f64 = 0.2;
const CELLS: usize = 20;

/// Strahler's order of each cell; 0 off the rivers.
pub(super) fn orders(network: &Network, river_m2: f64) -> Vec<u8> {
    let mut orders = vec![0_u8; network.receiver.len()];
    // the highest order of a cell's donors, doubled, plus 1 if two have it
    let mut donors = vec![0_u8; network.receiver.len()];
    for &cell in network.order.iter().rev() {
        let cell = cell as usize;
        if network.area_m2(cell) < river_m2 {
            continue;
        }
        let (highest, two) = (donors[cell] / 2, donors[cell] % 2);
        orders[cell] = (highest + two).max(1);
        if let Some(below) = network.below(cell) {
            let now = donors[below] / 2;
            if orders[cell] > now {
                donors[below] = 2 * orders[cell];
            } else if orders[cell] == now {
                donors[below] |= 1;
            }
        }
    }
    orders
}

/// Streams of an order: their number, total length and total area.
#[derive(Clone, Copy, Default)]
struct Streams {
    count: f64,
    length: f64,
    area: f64,
}

/// Ratios of number, length and area of the streams of successive orders (Horton 1945, Schumm 1956).
pub(super) fn horton(land: &Land<'_>, network: &Network, orders: &[u8], report: &mut Report) {
    let mut streams: Vec<Streams> = Vec::new();
    let has = land.has();
    for &cell in &network.order {
        let cell = cell as usize;
        let order = usize::from(orders[cell]);
        if order == 0 || !has(cell) {
            continue;
        }
        if streams.len() < order {
            streams.resize(order, Streams::default());
        }
        let streams = &mut streams[order - 1];
        streams.length += network.length_m(cell);
        // a stream ends where the order rises, or where water leaves
        if network.below(cell).is_none_or(|below| orders[below] != orders[cell]) {
            streams.count += 1.0;
            streams.area += network.area_m2(cell);
        }
    }
    put(report, "streams.order", streams.len() as f64);
    let ratio = |value: &dyn Fn(&Streams) -> f64, skip_last: bool| {
        let kept = streams.len() - usize::from(skip_last && streams.len() > 3);
        let points: Vec<[f64; 2]> = streams[..kept]
            .iter()
            .enumerate()
            .filter(|(_, streams)| streams.count > 0.0)
            .map(|(order, streams)| [order as f64, math::ln(value(streams))])
            .collect();
        if streams.len() < 3 { f64::NAN } else { math::exp(line(&points).slope) }
    };
    put(report, "streams.bifurcation_ratio", 1.0 / ratio(&|streams| streams.count, false));
    // the stream of the highest order is cut off at the border
    put(report, "streams.length_ratio", ratio(&|streams| streams.length / streams.count, true));
    put(report, "streams.area_ratio", ratio(&|streams| streams.area / streams.count, true));
}

/// The exponent of the length of the longest stream above a cell over its drainage area (Hack 1957).
pub(super) fn hack(land: &Land<'_>, network: &Network, river_m2: f64, report: &mut Report) {
    let mut longest = vec![0.0_f32; network.receiver.len()];
    let mut bins: Vec<(usize, f64, f64)> = Vec::new();
    let first = math::log10(4.0 * river_m2);
    let has = land.has();
    for &cell in network.order.iter().rev() {
        let cell = cell as usize;
        let Some(below) = network.below(cell) else { continue };
        let length = longest[cell];
        longest[below] = longest[below].max(length + network.length_m(cell) as f32);
        let area = network.area_m2(cell);
        if area > 4.0 * river_m2 && length > 0.0 && has(cell) {
            let x = math::log10(area);
            let bin = ((x - first) / BIN) as usize;
            if bins.len() <= bin {
                bins.resize(bin + 1, (0, 0.0, 0.0));
            }
            let sums = &mut bins[bin];
            *sums = (sums.0 + 1, sums.1 + x, sums.2 + math::log10(f64::from(length)));
        }
    }
    let points: Vec<[f64; 2]> =
        bins.iter().filter(|bin| bin.0 >= CELLS).map(|bin| [bin.1, bin.2].map(|sum| sum / bin.0 as f64)).collect();
    put(report, "hack_exponent", if points.len() > 3 { line(&points).slope } else { f64::NAN });
}
