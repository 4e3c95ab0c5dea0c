//! Smears a field along a direction.

use orograph_graph::memory::zeroed;

use super::mix;
use crate::numerics::{
    coarse::{Between, Coarse},
    lines::Ends,
    par,
};
use crate::{
    numerics::{math, simd::simd},
    prelude::*,
};

choice! {
    /// Direction of the smear.
    pub enum Side {
        /// To both sides equally.
        Both = "both",
        /// In the direction of `azimuth`.
        Ahead = "ahead",
    }
}

params! {
    /// Direction, clockwise from north.
    azimuth: f64 = 90.0, Degrees, -360.0..=360.0, soft 0..=360;
    /// Length over which a value is smeared; with `both`, half of it to either side.
    length: f64 = 400.0, Metres, 0.0..=1e6, soft 0..=5000;
    /// Direction of the smear.
    side: Side = Side::Both, One, ..;
}

inputs! {
    /// Field to smear.
    value: AnyScalar;
    /// Strength of the smear: full at 1, none at 0.
    mask: Mask = 1.0, 0.0..=1.0;
}

outputs! {
    /// The smeared values, with the meaning of the input.
    value: SameAs(value);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Smear",
    category: "filter",
    summary: "Smears a field along a direction over a length in metres.",
    doc: include_str!("smear.md"),
    sources: &[
        "B. Cabral and L. C. Leedom (1993), Imaging vector fields using line integral convolution, SIGGRAPH 93, 263-270",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::Metres(|params, cell_m| {
        let length_m = Params::read(params).length;
        // coarse cells are at most a 170th of the length
        if length_m < cell_m { 0.0 } else { 1.1 * length_m + 2.0 * cell_m }
    }),
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "value: \"base\", azimuth: 30, length: 3000",
    ..Node::DEFAULT
};

/// Maximum length of the line, in cells.
const MOST: f64 = 256.0;

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    let length = params.length / sizing.window.cell_m();
    if length < 1.0 {
        return 0;
    }
    let across = math::sin(params.azimuth.to_radians()).abs();
    let reach = if params.side == Side::Both { 0.5 } else { 1.0 };
    let coarser = (length / MOST).max(1.0);
    // rows with their halo; for coarser cells the means and their result
    let wide = 1.0 + 2.0 * reach * across * length / sizing.window.nx() as f64;
    let held = if coarser > 1.0 { 8.0_f64.max(4.0 + 4.0 * wide) } else { 4.0 * wide };
    sizing.cells(held / (coarser * coarser))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { value, mask } = Inputs::read(job)?;
    let params = Params::read(job.params);
    let window = job.window();
    let length = params.length / job.cell_m();
    if length < 1.0 {
        return Ok(Given { value: Some(value.clone()) }.into());
    }
    let ends = [0, 1].map(|axis| Ends::of(&window, axis));
    let mut out = if length <= MOST {
        let cells = [window.nx(), window.ny()];
        smeared(job, value.samples(), cells, ends, &taps(&params, [length; 2]))?
    } else {
        let coarse = Coarse::new(&window, length / MOST);
        let means = coarse.means(job, value.samples())?;
        let lengths = coarse.steps().map(|step| (length / step).min(2.0 * MOST));
        let smeared = smeared(job, &means, coarse.cells(), ends, &taps(&params, lengths))?;
        coarse.spread(job, [0.9; 2], &smeared, Between::Cubic)?
    };
    mix(job, value.samples(), &mut out, mask)?;
    Ok(Given { value: Some(Field::new(window, out)) }.into())
}

/// A cell of the kernel: its offset to the east and to the south, and its weight.
#[derive(Clone, Copy, Debug)]
struct Tap {
    east: i64,
    south: i64,
    weight: f32,
}

/// Returns the kernel of a line with the given lengths in cells along x and y: two adjacent cells for each step along
/// the line.
fn taps(params: &Params, lengths: [f64; 2]) -> Vec<Tap> {
    let angle = params.azimuth.to_radians();
    // from a cell towards the cells that it averages
    let [x, y] = [-math::sin(angle) * lengths[0], math::cos(angle) * lengths[1]];
    let long = x.abs().max(y.abs());
    let (low, high) = if params.side == Side::Both { (-0.5, 0.5) } else { (0.0, 1.0) };
    let count = (long * high).ceil() as i64;
    let mut taps = Vec::new();
    for k in if params.side == Side::Both { -count } else { 0 }..=count {
        let t = k as f64 / long;
        if t <= low - 1e-9 || t >= high {
            continue;
        }
        let cosine =
            math::cos(std::f64::consts::PI * t / (high - low) * if params.side == Side::Both { 1.0 } else { 0.5 });
        let weight = cosine * cosine;
        let [x, y] = [x * t, y * t];
        let across = if x.abs() >= y.abs() { y } else { x };
        // offsets that are whole cells except for rounding
        let across = (across * 1e9).round() / 1e9;
        let (first, rest) = (across.floor(), across - across.floor());
        for (cell, share) in [(first, 1.0 - rest), (first + 1.0, rest)] {
            let [east, south] = if x.abs() >= y.abs() { [x.round(), cell] } else { [cell, y.round()] };
            taps.push(Tap { east: east as i64, south: south as i64, weight: (weight * share) as f32 });
        }
    }
    taps.retain(|tap| tap.weight > 0.0);
    let sum: f32 = taps.iter().map(|tap| tap.weight).sum();
    taps.iter_mut().for_each(|tap| tap.weight /= sum);
    taps
}

/// Applies the kernel.
fn smeared(
    job: &Job<'_>,
    samples: &[f32],
    [nx, ny]: [usize; 2],
    ends: [Ends; 2],
    taps: &[Tap],
) -> Result<Vec<f32>, NodeError> {
    let margin = taps.iter().map(|tap| tap.east.unsigned_abs() as usize).max().unwrap_or(0);
    let width = nx + 2 * margin;
    let mut wide = zeroed(width * ny)?;
    par::all(wide.chunks_mut(width).zip(samples.chunks(nx)), |_, (out, row)| {
        for (i, out) in out.iter_mut().enumerate() {
            *out = row[ends[0].index(i as i64 - margin as i64, nx)];
        }
    });
    let mut out = zeroed(nx * ny)?;
    par::each(out.chunks_mut(nx), |j, row| {
        job.check()?;
        for tap in taps {
            let from = ends[1].index(j as i64 + tap.south, ny) * width;
            let first = from + (margin as i64 + tap.east) as usize;
            add(row, &samples[j * nx..][..nx], &wide[first..][..nx], tap.weight);
        }
        for (out, sample) in row.iter_mut().zip(&samples[j * nx..]) {
            *out += sample;
        }
        Ok::<_, NodeError>(())
    })?;
    job.advance(0.9)?;
    Ok(out)
}

simd! {
    /// Adds the weighted differences between two rows of cells.
    fn add(sums: &mut [f32], here: &[f32], there: &[f32], weight: f32) {
        for ((sum, &here), &there) in sums.iter_mut().zip(here).zip(there) {
            *sum += weight * (there - here);
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::*;
    use crate::testing::{at_every_level, field, reach_m, run as result, run_in, with_params, world};

    /// A wave along the direction is attenuated by the transform of cos², sin(πa) / (πa (1 − a²)) at a waves per
    /// length; a wave across it is unchanged.
    #[test]
    fn waves_along_fall_and_waves_across_stay() {
        for (n, cell_m) in [(96_u32, 10.0), (192, 5.0)] {
            let world = World { boundary: Boundary::all(Edge::Periodic), ..world(n, n, cell_m) };
            let turn = std::f64::consts::TAU / 960.0;
            for (azimuth, east, south) in
                [(90.0, 1.0, 0.0), (45.0, 2.0, -2.0), (0.0, 0.0, 3.0), (26.565_051_177, 2.0, -4.0)]
            {
                let wave = |east: f64, south: f64| {
                    field(world, move |x, y| 100.0 * libm::sin((east * x + south * y) * turn) + 500.0)
                };
                let params = with_params(&NODE, &format!("azimuth={azimuth},length=200"));
                let along = wave(east, south);
                let smeared = result(&NODE, &params, &[("value", &along)], "value");
                let a = libm::hypot(east, south) * 200.0 / 960.0;
                let kept = libm::sin(std::f64::consts::PI * a) / (std::f64::consts::PI * a * (1.0 - a * a));
                for (found, before) in smeared.samples().iter().zip(along.samples()) {
                    let expected = 500.0 + kept * (f64::from(*before) - 500.0);
                    // sums over cells instead of integrals, and linear interpolation across
                    assert!((f64::from(*found) - expected).abs() < 1.5, "{azimuth} {cell_m}: {found} {expected}");
                }
                let across = wave(-south, east);
                let smeared = result(&NODE, &params, &[("value", &across)], "value");
                for (found, before) in smeared.samples().iter().zip(across.samples()) {
                    assert!((found - before).abs() < 1.5, "{azimuth} {cell_m}: {found} {before}");
                }
            }
        }
    }

    /// A single cell is smeared towards the azimuth, and not beyond the length.
    #[test]
    fn smeared_ahead_is_ahead() {
        let point =
            field(world(61, 61, 10.0), |x, y| if (x - 305.0).abs() + (y - 305.0).abs() < 1.0 { 1000.0 } else { 0.0 });
        for (azimuth, [east, south]) in [(0.0, [0, -1]), (90.0, [1, 0]), (180.0, [0, 1]), (270.0, [-1, 0])] {
            let params = with_params(&NODE, &format!("azimuth={azimuth},length=100,side=ahead"));
            let found = result(&NODE, &params, &[("value", &point)], "value");
            let along: Vec<f32> =
                (-1..=11).map(|k: i64| found.samples()[((30 + k * south) * 61 + 30 + k * east) as usize]).collect();
            assert!(
                along[0] == 0.0 && along[1] > along[2] && along[10] > 0.0 && along[11] == 0.0,
                "{azimuth} {along:?}"
            );
            assert!((found.samples().iter().sum::<f32>() - 1000.0).abs() < 0.01);
        }
    }

    #[test]
    fn nothing_changes_below_a_cell_on_level_ground_or_without_a_mask() {
        let hills = field(world(40, 9, 5.0), |x, y| libm::sin(x * y));
        assert_eq!(result(&NODE, &with_params(&NODE, "length=4"), &[("value", &hills)], "value"), hills);
        let nowhere = field(world(40, 9, 5.0), |_, _| 0.0);
        assert_eq!(result(&NODE, &with_params(&NODE, ""), &[("value", &hills), ("mask", &nowhere)], "value"), hills);
        let level = field(world(40, 9, 5.0), |_, _| 812.3);
        assert_eq!(result(&NODE, &with_params(&NODE, "azimuth=17"), &[("value", &level)], "value"), level);
    }

    #[test]
    fn windows_and_widths_of_vectors_give_the_same_bits() {
        let hills = field(world(250, 240, 5.0), |x, y| 300.0 * libm::sin(x * 0.05 + y * 0.02) * libm::cos(y * 0.3));
        for changes in ["azimuth=33,length=70", "azimuth=200,length=90,side=ahead", "azimuth=80,length=1400"] {
            let params = with_params(&NODE, changes);
            let whole = result(&NODE, &params, &[("value", &hills)], "value");
            let part = Window { origin: [143, 137], cells: [40, 30], ..*hills.window() };
            let grown = hills.crop(&part.grown(reach_m(&NODE, &params, 5.0)));
            assert_eq!(
                result(&NODE, &params, &[("value", &grown)], "value").crop(&part),
                whole.crop(&part),
                "{changes}"
            );
            at_every_level(|| run_in(2, &NODE, &params, &[("value", &hills)]));
        }
    }
}
