//! Measures of the look of the land at small sizes: how slopes are spread, how much of the land is plane, how wide
//! floors are. Real mountains at cells of 80 m have a ratio of the 95 % slope to the median of 1.6 to 2.4, at most a
//! quarter of their area in one bin of 5 degrees, and no planes of five by five cells.

use orograph_graph::{Boundary, Edge, ParamValues, Window, World};

use super::NODE;
use crate::{measure::metrics, numerics::math, prelude::*, testing};

const SIDE: usize = 160;
const CELL_M: f64 = 80.0;

/// The land as it was before debris flows, floors, rounding and long waves of rock: rivers and one angle of repose.
const RIVERS: &str = "schedule=full,headwater_area=0,critical_area=2e4,valley_width=0,rounding=0,winding=0,variation=0.3,\
                      variation_size=0,repose_variation=0";

struct Look {
    /// The 95 % slope over the median, in degrees, of land steeper than 5°.
    ratio: f64,
    /// The largest share of that land in one bin of 5°.
    fullest_bin: f64,
    /// Share of windows of 5 × 5 cells steeper than 15° that are plane to 1 % of their drop.
    planar: f64,
    /// The land itself, in metres.
    heights: Vec<f32>,
}

fn look(changes: &str) -> Look {
    measure(output(changes, "height"))
}

fn output(changes: &str, name: &str) -> Vec<f32> {
    output_on(SIDE, CELL_M, changes, name)
}

fn output_on(side: usize, cell_m: f64, changes: &str, name: &str) -> Vec<f32> {
    output_of_seed(3, side, cell_m, changes, name)
}

fn output_of_seed(seed: u32, side: usize, cell_m: f64, changes: &str, name: &str) -> Vec<f32> {
    let boundary = Boundary::all(Edge::Inland);
    let world = World { boundary, seed, ..testing::world(side as u32, side as u32, cell_m) };
    let height = testing::field(world, |x, y| {
        150.0 * (math::sin(x / 900.0) * math::cos(y / 700.0) + math::sin((x + y) / 1300.0))
    });
    let [uplift, erodibility] = [0.002, 4e-6].map(|value| Field::constant(*height.window(), value));
    let fields = [("height", &height), ("uplift", &uplift), ("erodibility", &erodibility)];
    let params = testing::with_params(&NODE, &format!("duration=1.5e6,{changes}"));
    testing::run(&NODE, &params, &fields, name).into_samples()
}

fn measure(heights: Vec<f32>) -> Look {
    let at = |x: usize, y: usize| f64::from(heights[y * SIDE + x]);
    let mut slopes = Vec::new();
    let (mut steep, mut planes) = (0, 0);
    for (x, y) in (0..SIDE * SIDE).map(|cell| (cell % SIDE, cell / SIDE)) {
        if !(2..SIDE - 2).contains(&x) || !(2..SIDE - 2).contains(&y) {
            continue;
        }
        let (east, south) = (at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1));
        let degrees = math::atan(math::hypot(east, south) / (2.0 * CELL_M)).to_degrees();
        if degrees > 5.0 {
            slopes.push(degrees);
        }
        if degrees > 15.0 {
            steep += 1;
            planes += u32::from(is_plane(|dx, dy| at(x + dx - 2, y + dy - 2)));
        }
    }
    slopes.sort_unstable_by(f64::total_cmp);
    let mut bins = [0.0; 18];
    slopes.iter().for_each(|slope| bins[(slope / 5.0) as usize] += 1.0 / slopes.len() as f64);
    let of = |share: f64| slopes[(share * (slopes.len() - 1) as f64) as usize];
    let (ratio, planar) = (of(0.95) / of(0.5), f64::from(planes) / f64::from(steep.max(1)));
    Look { ratio, fullest_bin: bins.into_iter().fold(0.0, f64::max), planar, heights }
}

/// Whether 5 × 5 heights lie on the plane that fits them best, within 1 % of its drop over them.
fn is_plane(height: impl Fn(usize, usize) -> f64) -> bool {
    let cells = || (0..25).map(|k| (k % 5, k / 5));
    let mean = cells().map(|(x, y)| height(x, y)).sum::<f64>() / 25.0;
    let along =
        |of: &dyn Fn((usize, usize)) -> f64| cells().map(|cell| of(cell) * height(cell.0, cell.1)).sum::<f64>() / 50.0;
    let (east, south) = (along(&|(x, _)| x as f64 - 2.0), along(&|(_, y)| y as f64 - 2.0));
    let left = |(x, y): (usize, usize)| height(x, y) - mean - east * (x as f64 - 2.0) - south * (y as f64 - 2.0);
    let rms = (cells().map(|cell| left(cell) * left(cell)).sum::<f64>() / 25.0).sqrt();
    rms < 0.01 * 4.0 * math::hypot(east, south)
}

#[test]
fn mountains_are_no_folded_paper() {
    let found = look("");
    assert!(found.ratio > 1.4, "ratio {}", found.ratio);
    assert!(found.fullest_bin < 0.28, "fullest bin {}", found.fullest_bin);
    assert!(found.planar < 0.005, "planar {}", found.planar);
}

/// The measures tell the land that they are about: without the new parts every one of them fails.
#[test]
fn rivers_and_one_angle_alone_are_folded_paper() {
    let found = look(RIVERS);
    assert!(found.ratio < 1.25, "ratio {}", found.ratio);
    assert!(found.fullest_bin > 0.35, "fullest bin {}", found.fullest_bin);
    assert!(found.planar > 0.01, "planar {}", found.planar);
}

/// With debris flows alone, land in balance has the slope S₀ where hardly anything drains.
#[test]
fn hillslopes_in_balance_have_the_headwater_slope() {
    let boundary = Boundary { east: Edge::Base, ..Boundary::all(Edge::Wall) };
    let height = testing::field(World { boundary, ..testing::world(41, 1, 20.0) }, |_, _| 0.0);
    let values = [("uplift", 0.002), ("erodibility", 4e-6), ("repose", 90.0)];
    let given = values.map(|(name, value)| (name, Field::constant(*height.window(), value)));
    let mut fields: Vec<(&str, &Field)> = given.iter().map(|(name, field)| (*name, field)).collect();
    fields.push(("height", &height));
    let plain = "schedule=full,headwater_area=1e6,headwater_variation=0,valley_width=0,roughness=0,irregularity=0,rounding=0,winding=0,\
                 variation=0,repose_variation=0,receivers=d8";
    let params = testing::with_params(&NODE, &format!("{plain},duration=5e6,time_step=1e5"));
    let found = testing::run(&NODE, &params, &fields, "height").into_samples();
    for cell in 0..40 {
        let slope = f64::from(found[cell] - found[cell + 1]) / 20.0;
        let expected = 0.002 / (4e-6 * (1000.0 + ((cell + 1) as f64 * 400.0).sqrt()));
        // 1e-5: heights in single precision
        assert!((slope / expected - 1.0).abs() < 1e-5, "{cell}: {slope} {expected}");
    }
}

/// Floors are as wide as the parameter says: land beside trunk rivers is lower with them than without.
#[test]
fn rivers_cut_floors() {
    let [with, without] = ["valley_width=300", "valley_width=0"].map(look);
    let low = |look: &Look| {
        let lowest = look.heights.iter().copied().fold(f32::INFINITY, f32::min);
        let highest = look.heights.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let below = lowest + 0.1 * (highest - lowest);
        look.heights.iter().filter(|height| **height < below).count()
    };
    assert!(low(&with) > low(&without) * 5 / 4, "{} {}", low(&with), low(&without));
}

/// Where the roughness varies, some ground is rougher and some smoother than where it does not, by the curvature of squares
/// of ten cells.
#[test]
fn smooth_slopes_stand_beside_rough_ones() {
    let spread = |changes: &str| {
        let heights = output(changes, "height");
        let bend = |x: usize, y: usize| {
            let at = |dx: isize| f64::from(heights[(y * SIDE + x).wrapping_add_signed(dx)]);
            let [along, across] = [1, SIDE as isize].map(|step| at(step) + at(-step) - 2.0 * at(0));
            along * along + across * across
        };
        let square = |at: usize| {
            let [x, y] = [at % 15, at / 15].map(|at| 5 + 10 * at);
            math::ln((0..100).map(|cell| bend(x + cell % 10, y + cell / 10)).sum::<f64>())
        };
        let squares: Vec<f64> = (0..225).map(square).collect();
        let mean = squares.iter().sum::<f64>() / 225.0;
        (squares.iter().map(|square| (square - mean) * (square - mean)).sum::<f64>() / 225.0).sqrt()
    };
    let still = "irregularity=0,rounding=0.08,roughness=0.25,variation=0,repose_variation=0,headwater_variation=0,valley_width=0";
    let [even, varied] = ["", ",roughness_variation=2"].map(|changes| spread(&format!("{still}{changes}")));
    assert!(varied > 1.2 * even, "{even} {varied}");
}

/// Valleys have rounded bottoms, as in real elevation models: the ground next to a river is a smaller part of the rise to
/// three cells away than in a sharp valley.
#[test]
fn slopes_have_a_foot_beside_rivers() {
    let sharpness = |changes: &str| {
        let (heights, areas) = (output(changes, "height"), output(changes, "area"));
        let ring = |cell: usize, far: isize| {
            let steps = [(1, 0), (-1, 0), (0, 1), (0, -1)].map(|(dx, dy)| far * (dx + dy * SIDE as isize));
            let around = steps.map(|step| f64::from(heights[cell.wrapping_add_signed(step)]));
            around.into_iter().sum::<f64>() / 4.0 - f64::from(heights[cell])
        };
        let inner =
            (0..SIDE * SIDE).filter(|cell| [cell % SIDE, cell / SIDE].iter().all(|at| (4..SIDE - 4).contains(at)));
        let rivers: Vec<usize> = inner.filter(|&cell| areas[cell] > 1e6).collect();
        assert!(rivers.len() > 500, "{}", rivers.len());
        let mean = |far: isize| rivers.iter().map(|&cell| ring(cell, far)).sum::<f64>();
        mean(1) / mean(3)
    };
    let [with, without] =
        ["", ",valley_width=0"].map(|changes| sharpness(&format!("irregularity=0,rounding=0.08{changes}")));
    assert!(with < 0.8 * without, "{with} {without}");
}

/// Ground is rough along the way downhill, not only across it, and neither higher nor lower for it.
#[test]
fn hillslopes_are_rough_and_as_high_as_smooth_ones() {
    let along = |heights: &[f32]| {
        let at = |x: usize, y: usize| f64::from(heights[y * SIDE + x]);
        let cells = (2..SIDE - 2).flat_map(|y| (2..SIDE - 2).map(move |x| (x, y)));
        let mut found: Vec<f64> = cells
            .filter_map(|(x, y)| {
                let (east, south) = (at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1));
                let (rise, middle) = (0.5 * math::hypot(east, south), 2.0 * at(x, y));
                let (u, v) = (0.5 * east / rise, 0.5 * south / rise);
                let twisted = at(x + 1, y + 1) + at(x - 1, y - 1) - at(x + 1, y - 1) - at(x - 1, y + 1);
                let bent = u * u * (at(x + 1, y) + at(x - 1, y) - middle)
                    + v * v * (at(x, y + 1) + at(x, y - 1) - middle)
                    + 0.5 * u * v * twisted;
                (rise > 0.1 * CELL_M).then(|| bent.abs() / rise)
            })
            .collect();
        found.sort_unstable_by(f64::total_cmp);
        found[found.len() / 2]
    };
    let mean = |heights: &[f32]| heights.iter().map(|height| f64::from(*height)).sum::<f64>() / heights.len() as f64;
    // with feet in all, without gullies, and with hillslopes of one length, to which the lengths of knolls are fitted
    let [rough, smooth, ribbed] =
        ["ribs=0,roughness=0.25", "ribs=0,roughness=0.001", "ribs=1,roughness=0.25"].map(|changes| {
            output(&format!("irregularity=0,headwater_variation=0,gullies=0,rounding=0.1,{changes}"), "height")
        });
    // real mountains with cells of 30 to 90 m: 0.22 to 0.31
    let [rough_along, smooth_along, ribbed_along] = [&rough, &smooth, &ribbed].map(|heights| along(heights));
    assert!(rough_along > 0.15 && rough_along > 1.3 * smooth_along, "{rough_along} {smooth_along}");
    // ribs run down the slope, which is smoother along them
    assert!(ribbed_along < 0.85 * rough_along, "{rough_along} {ribbed_along}");
    for heights in [&rough, &ribbed] {
        let ratio = mean(heights) / mean(&smooth);
        assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    }
}

/// Where hillslopes are long the ground is smooth, where they are short it is bent more: from tile to tile of 3 km, the
/// mean curvature differs more than with hillslopes of one length. Land is as high, within some percent.
#[test]
fn hillslopes_have_many_lengths() {
    const SIDE: usize = 320;
    const TILE: usize = 40;
    let [one, many] = ["0", "1.5"].map(|variation| {
        // gullies bend slopes of every length
        let changes = format!("irregularity=0,variation_size=3e3,gullies=0,headwater_variation={variation}");
        let heights = output_on(SIDE, CELL_M, &changes, "height");
        let at = |x: usize, y: usize| f64::from(heights[y * SIDE + x]);
        let bent =
            |x: usize, y: usize| (at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1) - 4.0 * at(x, y)).abs();
        let tile = |x: usize, y: usize| {
            let cells = (y + 1..y + TILE - 1).flat_map(|y| (x + 1..x + TILE - 1).map(move |x| (x, y)));
            cells.map(|(x, y)| bent(x, y)).sum::<f64>()
        };
        let corners = || (0..SIDE).step_by(TILE);
        let tiles: Vec<f64> = corners().flat_map(|y| corners().map(move |x| tile(x, y))).collect();
        let mean = tiles.iter().sum::<f64>() / tiles.len() as f64;
        let variance = tiles.iter().map(|tile| (tile - mean) * (tile - mean)).sum::<f64>() / tiles.len() as f64;
        [variance.sqrt() / mean, heights.iter().map(|height| f64::from(*height)).sum()]
    });
    assert!(many[0] > 1.3 * one[0], "{one:?} {many:?}");
    assert!((many[1] / one[1] - 1.0).abs() < 0.05, "{one:?} {many:?}");
}

/// On small cells, steep rough ground has no walls along rows or columns: few cells are bent across a row or a column by
/// much more than the others. With slides by the direction of flow, the 99.9th percentile was 9.0 medians instead of 7.8.
/// Ribs smooth most of the ground and leave its edges, which lie along rows and columns no more than along diagonals: the
/// percentile is 1.03 times as large across them, without ribs 1.05 times. Both bounds belong to this terrain: a sharp
/// crest that happens to lie along a row counts up to 1.4 times as much as one along a diagonal. Gullies, whose beds and
/// spurs are bends too, hardly change that.
#[test]
fn steep_rough_ground_has_no_walls_along_rows_or_columns() {
    const CELLS: usize = 256;
    let bent = |seed: u32, changes: &str| {
        let heights = output_of_seed(seed, CELLS, 6.25, changes, "height");
        let at = |x: usize, y: usize| f64::from(heights[y * CELLS + x]);
        let inner = || 4..CELLS - 4;
        // per cell and square of the distance to the neighbours, which is twice as large along diagonals
        let bends = |x: usize, y: usize| {
            let (twice, [west, east, north, south]) = (2.0 * at(x, y), [x - 1, x + 1, y - 1, y + 1]);
            let straight = [at(west, y) + at(east, y) - twice, at(x, north) + at(x, south) - twice];
            let diagonal = [at(west, north) + at(east, south) - twice, at(east, north) + at(west, south) - twice];
            [straight, diagonal.map(|bend| 0.5 * bend)]
        };
        let cells = || inner().flat_map(|y| inner().map(move |x| (x, y)));
        [0, 1].map(|way| {
            let mut all: Vec<f64> = cells().flat_map(|(x, y)| bends(x, y)[way].map(f64::abs)).collect();
            all.sort_unstable_by(f64::total_cmp);
            [0.5, 0.999].map(|part| all[(part * all.len() as f64) as usize])
        })
    };
    let old = "irregularity=0,headwater_variation=1.5,roughness=0.22,rounding=0.05,variation_size=3e3";
    let [[median, most], [_, most_diagonal]] = bent(3, &format!("{old},gullies=0,ribs=0"));
    assert!(most < 8.2 * median && most < 1.1 * most_diagonal, "{most} {median} {most_diagonal}");
    // over several terrains, as the crests of each count: 1.12 without gullies, 1.18 with them
    let [plain, gullied] = ["0", "0.3"].map(|gullies| {
        let changes = format!("{old},ribs=0.7,gullies={gullies}");
        [3, 4, 5, 6].map(|seed| bent(seed, &changes)).map(|[[_, most], [_, most_diagonal]]| most / most_diagonal)
    });
    assert!(plain[0] < 1.1, "{plain:?}");
    let [plain, gullied] = [plain, gullied].map(|ratios| ratios.iter().sum::<f64>());
    assert!(gullied < 1.1 * plain, "{gullied} {plain}");
}

/// Hollows of steep slopes, where water gathers, stand less steep than the ground between them.
#[test]
fn gullies_cut_steep_slopes() {
    const SIDE: usize = 256;
    const CELL_M: f64 = 30.0;
    let found = [0.0, 0.15, 0.3].map(|gullies| {
        let changes = format!("headwater_area=2e5,gullies={gullies}");
        let [heights, areas] = ["height", "area"].map(|name| output_on(SIDE, CELL_M, &changes, name));
        let at = |x: usize, y: usize| f64::from(heights[y * SIDE + x]);
        let inner = || 1..SIDE - 1;
        let (mut dry, mut saturated) = (Vec::new(), Vec::new());
        for (x, y) in inner().flat_map(|y| inner().map(move |x| (x, y))) {
            let slope = math::hypot(at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1)) / (2.0 * CELL_M);
            let area_m2 = f64::from(areas[y * SIDE + x]);
            // single cells, and hollows that drain less than a river
            if area_m2 < 2.0 * CELL_M * CELL_M {
                dry.push(slope);
            } else if (2e4..1e5).contains(&area_m2) {
                saturated.push(slope);
            }
        }
        let median = |slopes: &mut Vec<f64>| {
            slopes.sort_unstable_by(f64::total_cmp);
            slopes[slopes.len() / 2]
        };
        median(&mut saturated) / median(&mut dry)
    });
    assert!(found[1] < 0.97 * found[0] && found[2] < 0.97 * found[1], "{found:?}");
}

/// Beds that differ from cell to cell bend rivers, and relief stays the same. Channels of real models go on in the
/// direction of the cell above for 0.47 to 0.58 of their cells.
#[test]
fn rivers_wind_and_relief_stays() {
    const SIDE: usize = 320;
    let found = |winding: f64| {
        let heights = output_on(SIDE, CELL_M, &format!("irregularity=0,winding={winding}"), "height");
        let mean = heights.iter().map(|height| f64::from(*height)).sum::<f64>() / heights.len() as f64;
        let height = Field::new(Window::whole(testing::world(SIDE as u32, SIDE as u32, CELL_M)), heights);
        let params = ParamValues::defaults(&metrics::NODE.specs());
        let mut outputs = testing::outputs(&metrics::NODE, &params, &[("height", &height)]).expect("measures");
        let report = outputs.take("report").expect("a report");
        [report.as_report().and_then(|report| report.get("channels.straight")).expect("a measure"), mean]
    };
    let [straight, winding, more] = [0.0, 0.5, 1.0].map(found);
    println!("{straight:?} {winding:?} {more:?}");
    assert!(winding[0] < straight[0] - 0.01 && more[0] < winding[0] - 0.02, "{straight:?} {winding:?} {more:?}");
    // The offset of the softer beds that rivers find is fitted to several graphs, to some percent of the mean height.
    assert!((winding[1] / straight[1] - 1.0).abs() < 0.05, "{straight:?} {winding:?}");
}
