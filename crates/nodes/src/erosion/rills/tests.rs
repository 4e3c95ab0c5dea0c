//! Rills on a real terrain: means, pits, rivers, slopes and other cell sizes; inputs on which no rills form.

use orograph_graph::{Boundary, Cancel, Edge, World, mix};

use super::NODE;
use crate::{
    numerics::{
        math,
        routing::{Depressions, Drainage, Grid, receivers},
    },
    prelude::*,
    testing::{self, block_means, moments, outputs_and_warnings, with_job, with_params},
};

/// Cells per side of the real terrain, and its cell size in metres.
const SIDE: usize = 256;
const CELL_M: f64 = 30.0;
/// Cells of the terrain per cell of the model, along a side.
const STEP: usize = 8;
const RILLS: &str = "coarse=240,spacing=240";

fn square(cells: usize, cell_m: f64) -> World {
    World { boundary: Boundary::all(Edge::Open), ..testing::world(cells as u32, cells as u32, cell_m) }
}

/// Big Tujunga on cells of 30 m.
fn real() -> Field {
    let bytes = include_bytes!("../../../../../tests/data/bigtujunga_drained_256.f32");
    let samples = bytes.chunks_exact(4).map(|bytes| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
    Field::new(Window::whole(square(SIDE, CELL_M)), samples.collect())
}

/// Means of the real terrain over 240 m, interpolated linearly between the centres of these cells, with `finer` cells
/// per side of each.
fn model(finer: usize) -> Field {
    let (means, across) = (block_means(&real(), STEP), SIDE / STEP);
    let cells = across * finer;
    let taps = |cell: usize| {
        let place = ((cell as f64 + 0.5) / finer as f64 - 0.5).clamp(0.0, (across - 1) as f64);
        let left = (place as usize).min(across - 2);
        (left, (place - left as f64) as f32)
    };
    let sample = |cell: usize| {
        let ((i, s), (j, t)) = (taps(cell % cells), taps(cell / cells));
        let row = |j: usize| means[j * across + i] * (1.0 - s) + means[j * across + i + 1] * s;
        row(j) * (1.0 - t) + row(j + 1) * t
    };
    Field::new(
        Window::whole(square(cells, CELL_M * STEP as f64 / finer as f64)),
        (0..cells * cells).map(sample).collect(),
    )
}

fn rills(model: &Field, changes: &str) -> Field {
    testing::run(&NODE, &with_params(&NODE, changes), &[("height", model)], "height")
}

fn difference(one: &[f32], other: &[f32]) -> Vec<f32> {
    one.iter().zip(other).map(|(one, other)| one - other).collect()
}

/// Returns which cells are under more than a millimetre of standing water, and the drainage area of each cell in cells.
fn drained(land: &Field) -> (Vec<bool>, Vec<u32>) {
    with_job(*land.window(), |job| {
        let grid = Grid::new(&job.window()).expect("a grid");
        let heights: Vec<f64> = land.samples().iter().map(|&height| f64::from(height)).collect();
        let mut codes = vec![0; heights.len()];
        receivers::d8(job, &grid, &heights, &mut codes).expect("receivers");
        let mut depressions = Depressions::default();
        depressions.find(job, &grid, &heights, &codes).expect("depressions");
        let mut filled = heights.clone();
        depressions.fill(&mut filled);
        depressions.carve(job, &grid, &mut codes).expect("ways out");
        let mut cells = vec![1_u32; heights.len()];
        Drainage::default().accumulate(job, &grid, &codes, &mut cells).expect("areas");
        (filled.iter().zip(&heights).map(|(filled, height)| filled - height > 1e-3).collect(), cells)
    })
}

/// Returns the slopes of inner cells in degrees, in ascending order.
fn slopes(land: &Field) -> Vec<f64> {
    let (nx, ny) = (land.window().nx(), land.window().ny());
    let at = |x: usize, y: usize| f64::from(land.samples()[y * nx + x]);
    let slope = |x: usize, y: usize| {
        let (east, south) = (at(x + 1, y) - at(x - 1, y), at(x, y + 1) - at(x, y - 1));
        math::atan(math::hypot(east, south) / (2.0 * land.window().cell_m())).to_degrees()
    };
    let mut slopes: Vec<f64> = (STEP..ny - STEP).flat_map(|y| (STEP..nx - STEP).map(move |x| slope(x, y))).collect();
    slopes.sort_unstable_by(f64::total_cmp);
    slopes
}

/// Returns the root mean square difference of a cell from the mean of its 3 × 3 cells, in metres.
fn roughness(land: &Field) -> f64 {
    let nx = land.window().nx();
    let inside = || (1..nx - 1).flat_map(|y| (1..nx - 1).map(move |x| (x, y)));
    let above = |(x, y): (usize, usize)| {
        let around: f32 = (0..9).map(|k| land.samples()[(y + k / 3 - 1) * nx + x + k % 3 - 1]).sum();
        f64::from(land.samples()[y * nx + x] - around / 9.0)
    };
    (inside().map(|cell| above(cell) * above(cell)).sum::<f64>() / inside().count() as f64).sqrt()
}

/// Heights change by about 7 m, but the means of the model's cells by less than half a metre.
#[test]
fn means_are_the_models() {
    let model = model(STEP);
    let found = rills(&model, RILLS);
    let changed = moments(&difference(found.samples(), model.samples())).1;
    let means = moments(&difference(&block_means(&found, STEP), &block_means(&model, STEP))).1;
    assert!(changed > 6.0, "{changed}");
    assert!(means < 0.05 * changed, "{means} of {changed}");
}

#[test]
fn there_are_no_pits_but_those_of_the_model() {
    let model = model(STEP);
    let found = rills(&model, RILLS);
    let [before, after] = [&model, &found].map(|land| drained(land).0);
    let outside = after.iter().zip(&before).filter(|(after, before)| **after && !**before).count();
    let count = |wet: &[bool]| wet.iter().filter(|wet| **wet).count();
    // a lake at the model's level becomes deeper where a rill enters it, and extends into that rill
    assert!(count(&after) <= count(&before) + count(&before) / 4, "{} {}", count(&after), count(&before));
    assert!(outside <= count(&before) / 2, "{outside} outside of {}", count(&before));
}

/// Each river of the model with a drainage area of 2 km² or more has a river of the result within one model cell.
#[test]
fn trunk_rivers_stay() {
    let model = model(STEP);
    let trunk = |land: &Field| -> Vec<bool> { drained(land).1.iter().map(|&cells| cells > 2200).collect() };
    let (before, after) = (trunk(&model), trunk(&rills(&model, RILLS)));
    let near = |cell: usize| {
        let (x, y) = (cell % SIDE, cell / SIDE);
        let rows = y.saturating_sub(STEP)..(y + STEP + 1).min(SIDE);
        rows.flat_map(|y| (x.saturating_sub(STEP)..(x + STEP + 1).min(SIDE)).map(move |x| y * SIDE + x))
            .any(|at| after[at])
    };
    let rivers: Vec<usize> = (0..SIDE * SIDE).filter(|&cell| before[cell]).collect();
    let kept = rivers.iter().filter(|&&cell| near(cell)).count();
    assert!(rivers.len() > 500 && kept * 100 >= rivers.len() * 97, "{kept} of {}", rivers.len());
}

/// Cells at `base` sides stay, but for cuts through which depressions drain, and beside them the terrain changes no more
/// than elsewhere.
#[test]
fn base_sides_have_no_rim() {
    let open = model(STEP);
    let world = World { boundary: Boundary::all(Edge::Base), ..open.window().world };
    let model = Field::new(Window::whole(world), open.samples().to_vec());
    let changes = difference(rills(&model, RILLS).samples(), model.samples());
    let side = |cell: usize| {
        let place = [cell % SIDE, cell / SIDE].map(|at| at.min(SIDE - 1 - at));
        place[0].min(place[1])
    };
    let most = |near: &dyn Fn(usize) -> bool| {
        let changes = changes.iter().enumerate().filter(|(cell, _)| near(side(*cell)));
        changes.fold(0.0_f32, |most, (_, change)| most.max(change.abs()))
    };
    let [at, beside, inside] = [most(&|side| side == 0), most(&|side| (1..8).contains(&side)), most(&|side| side >= 8)];
    assert!(at < 1.0 && beside <= inside, "{at} {beside} {inside}");
}

/// Slopes of a 240 m model with rills on 30 m are closer to those of the real terrain than without rills.
#[test]
fn slopes_are_nearer_to_the_real_ones() {
    let (real, model) = (real(), model(STEP));
    let found = rills(&model, RILLS);
    let of = |slopes: &[f64], share: f64| slopes[(share * (slopes.len() - 1) as f64) as usize];
    let bin = |slopes: &[f64]| {
        let mut bins = [0.0_f64; 18];
        slopes.iter().for_each(|slope| bins[(slope / 5.0) as usize] += 1.0 / slopes.len() as f64);
        bins.into_iter().fold(0.0, f64::max)
    };
    let measures = [&real, &model, &found].map(|land| {
        let slopes = slopes(land);
        [of(&slopes, 0.5), of(&slopes, 0.95), bin(&slopes), roughness(land)]
    });
    println!("{measures:.3?}");
    for (at, name) in ["median", "95 %", "fullest bin", "roughness"].into_iter().enumerate() {
        let [real, model, found] = measures.map(|measures| measures[at]);
        assert!(
            (found - real).abs() < 0.75 * (model - real).abs(),
            "{name}: real {real}, model {model}, rills {found}"
        );
    }
}

/// Smooth slopes lie beside slopes with deep rills: over squares of 960 m, changes differ in size more than without
/// variation.
#[test]
fn the_depth_varies() {
    let model = model(STEP);
    let spread = |changes: &str| {
        let change = difference(rills(&model, &format!("{RILLS},{changes}")).samples(), model.samples());
        let squares = change.iter().map(|change| change * change).collect();
        let sizes: Vec<f32> = block_means(&Field::new(*model.window(), squares), 32).iter().map(|m| m.sqrt()).collect();
        let (mean, deviation) = moments(&sizes);
        deviation / mean
    };
    let [even, varied] = ["variation=0", "variation=0.8"].map(spread);
    assert!(varied > 1.15 * even, "{even} {varied}");
}

/// Rills on cells of 15 m, 20 m and 30 m are the same: their changes correlate in means over 120 m. On cells of 40 m, a
/// sixth of the spacing, they begin to differ.
#[test]
fn other_cells_have_the_same_rills() {
    let changes = [6, 8, 12, 16].map(|finer| {
        let model = model(finer);
        let change = difference(rills(&model, RILLS).samples(), model.samples());
        block_means(&Field::new(*model.window(), change), finer / 2)
    });
    for (one, other, least) in [(1, 2, 0.8), (2, 3, 0.8), (1, 3, 0.8), (0, 1, 0.65)] {
        let [a, b] = [&changes[one], &changes[other]];
        let together: f64 = a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>() / a.len() as f64;
        let correlation = together / (moments(a).1 * moments(b).1);
        println!("{one} {other}: {correlation:.3}");
        assert!(correlation > least, "{one} {other}: {correlation}");
    }
}

#[test]
fn nothing_changes_without_depth_or_mask_or_on_coarse_cells() {
    let model = model(STEP);
    let warnings = |changes: &str| {
        let (outputs, warnings) = outputs_and_warnings(
            &Cancel::default(),
            *model.window(),
            &NODE,
            &with_params(&NODE, changes),
            &[("height", &model)],
        );
        let same = outputs.expect("a result").take("height").expect("a height").as_field() == Some(&model);
        assert!(same, "{changes}");
        warnings.len()
    };
    assert_eq!(warnings("depth=0"), 0);
    // rills narrower than three cells; a model finer than the cells
    assert_eq!(warnings("coarse=240,spacing=90"), 1);
    assert_eq!(warnings("coarse=30,spacing=240"), 1);
    let mask = Field::constant(*model.window(), 0.0);
    let fields = [("height", &model), ("mask", &mask)];
    assert_eq!(testing::run(&NODE, &with_params(&NODE, RILLS), &fields, "height"), model);
    let level = Field::constant(*model.window(), 812.5);
    assert_eq!(rills(&level, RILLS), level);
}

#[test]
fn voids_walls_and_single_rows_do_no_harm() {
    let mut holes = model(STEP).into_samples();
    for (cell, height) in holes.iter_mut().enumerate() {
        if mix(cell as u32 / 19).is_multiple_of(11) {
            *height = [f32::NAN, f32::INFINITY][cell % 2];
        }
    }
    let holes = Field::new(*model(STEP).window(), holes);
    let found = rills(&holes, RILLS);
    for (found, before) in found.samples().iter().zip(holes.samples()) {
        assert!(found.is_finite() == before.is_finite() && !(before.is_finite() && (found - before).abs() > 300.0));
    }
    let all_void = Field::new(*holes.window(), vec![f32::NAN; SIDE * SIDE]);
    assert!(rills(&all_void, RILLS).samples().iter().all(|height| height.is_nan()));
    // 89° is 57 m per metre; changes are bounded, and breaches are not cut below the lowest terrain
    let wall = testing::field(square(96, 10.0), |x, y| (x - 480.0).clamp(-60.0, 60.0) * 57.29 + 0.1 * y);
    let [low, high] = [-60.0 * 57.29, 60.0 * 57.29 + 96.0];
    let bounds = low - 109.0..high + 109.0;
    assert!(rills(&wall, "").samples().iter().all(|&height| bounds.contains(&f64::from(height))));
    for (nx, ny) in [(200, 1), (1, 200), (1, 1), (2, 3)] {
        let world = World { boundary: Boundary::all(Edge::Open), ..testing::world(nx, ny, 10.0) };
        let land = testing::field(world, |x, y| 0.3 * (x + y) + 5.0 * math::sin(0.05 * (x - y)));
        for changes in ["", "coarse=1e6,spacing=1e6,depth=4,rounding=10,irregularity=1", "rounding=0,depth=4"] {
            assert!(rills(&land, changes).samples().iter().all(|height| height.is_finite()), "{nx} {ny} {changes}");
        }
    }
}
