//! The graph files of the program: each is in canonical form, has no problems, builds, and gives the same bytes on one
//! and on two threads.

use std::{num::NonZero, ops::RangeInclusive, path::PathBuf};

use orograph::report::measure::measure;
use orograph_graph::{Cancel, Document, Evaluator, EvaluatorOptions, Field, Port, Value, Window, World, format_source};
use orograph_nodes::{numerics::math, registry};
use orograph_tests::{Look, relief, root, validation_hash};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../graphs")
}

fn files() -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder()).expect("the folder of graphs");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "ron"));
    files.sort();
    assert!(files.len() >= 5, "hello, ridges, alps, carve_dem and rivers_dem at least");
    files
}

/// All outputs, at this number of cells along the world's longer side.
fn build(document: &Document, longer: f64, threads: usize) -> Vec<Value> {
    let world = document.world();
    let longest = f64::from(world.cells[0].max(world.cells[1]));
    let cells = world.cells.map(|n| (longer * f64::from(n) / longest).round() as u32);
    let window = Window::whole(World { cells, ..world });
    let expanded = document.expand();
    let ports: Vec<Port> = expanded.outputs.iter().map(|output| output.port).collect();
    let evaluator = Evaluator::new(EvaluatorOptions { threads: NonZero::new(threads), ..EvaluatorOptions::default() })
        .expect("an evaluator");
    evaluator.values(&expanded.graph, &folder(), &ports, window).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_graph_is_sound_and_in_canonical_form() {
    for path in files() {
        let source = std::fs::read_to_string(&path).expect("a graph file");
        let document = Document::parse_at(source.clone(), &path, &registry());
        let problems: Vec<&str> = document.problems().iter().map(|problem| problem.message.as_str()).collect();
        assert!(problems.is_empty(), "{}: {problems:?}", path.display());
        assert_eq!(document.source(), source, "{}: a load and a save change nothing", path.display());
        let canonical = format_source(&source).expect("no syntax errors");
        assert_eq!(canonical, source, "{}: run `orograph fmt` on it", path.display());
    }
}

#[test]
fn every_graph_builds_to_the_same_bytes_on_one_and_two_threads() {
    for path in files() {
        let document = Document::load(&path, &registry()).expect("a graph file");
        // the same terrain at a low resolution, which is faster
        let one = build(&document, 96.0, 1);
        assert_eq!(one.len(), document.outputs().len());
        assert!(one == build(&document, 96.0, 2), "{}: other bytes on two threads", path.display());
    }
}

/// The output `height` of a graph, with this number of cells along the x axis.
fn land(graph: &str, cells: u32) -> Field {
    let document = Document::load(folder().join(format!("{graph}.ron")), &registry()).expect("a graph file");
    relief::built(&document, &folder(), cells).expect("the land")
}

/// A node of noise wired to `StreamPower`, all at their defaults but for `changes`.
fn on_noise(noise: &str, changes: &str) -> Document {
    let registry = registry();
    let node = |id: &str, arguments: &str| registry.get(id).expect("a node").written(arguments);
    let text = format!(
        "(world: (size: \"16 km\", cells: 320, seed: 3, boundary: inland), nodes: {{ \"base\": {}, \"rivers\": {} }}, \
         outputs: {{ \"height\": \"rivers\", \"area\": \"rivers.area\", \"rate\": \"rivers.erosion_rate\" }})",
        node(noise, ""),
        node("StreamPower", &format!("height: \"base\"{changes}")),
    );
    Document::parse(text, &registry)
}

/// The cells of a terrain that are on no side of it.
fn inner(land: &Field) -> impl Iterator<Item = usize> + use<> {
    let (nx, ny) = (land.window().nx(), land.window().ny());
    (nx..nx * (ny - 1)).filter(move |cell| (1..nx - 1).contains(&(cell % nx)))
}

/// The gradient of an inner cell, to the east and to the south.
fn gradient(land: &Field, cell: usize) -> [f64; 2] {
    let (z, step_m) = (land.samples(), 2.0 * land.window().cell_m());
    [1, land.window().nx()].map(|by| (f64::from(z[cell + by]) - f64::from(z[cell - by])) / step_m)
}

fn slope(land: &Field, cell: usize) -> f64 {
    let [east, south] = gradient(land, cell);
    math::hypot(east, south)
}

/// The median; 0 of no numbers.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// The fraction of nearly level ground, below 2°, where a node of noise is wired to `StreamPower`.
fn level_ground(noise: &str, changes: &str) -> f64 {
    let land = relief::built(&on_noise(noise, changes), &folder(), 200).expect("the land");
    inner(&land).filter(|cell| slope(&land, *cell) < 0.035).count() as f64 / inner(&land).count() as f64
}

/// Without an uplift, half of the terrain and more becomes a plain in the same time.
#[test]
fn noise_becomes_mountains_at_the_defaults() {
    for noise in ["Perlin", "Ridged", "Noise"] {
        let [rising, worn] = ["", ", uplift: 0"].map(|uplift| level_ground(noise, uplift));
        println!("{noise}: {rising:.3} of the ground is level, {worn:.3} without uplift");
        assert!(rising < 0.2 && worn > 2.0 * rising, "{noise}: {rising} {worn}");
    }
}

/// The mean slope of the next eight cells along the steepest descent, from each cell that drains 0.8 to 1.25 km².
fn channel_slopes(height: &Field, area: &Field) -> Vec<f64> {
    let window = height.window();
    let (nx, ny, cell_m, z) = (window.nx(), window.ny(), window.cell_m(), height.samples());
    let next = |cell: usize| {
        let around = [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)].into_iter();
        let beside = around.filter_map(|(dx, dy): (isize, isize)| {
            let (x, y) = ((cell % nx).checked_add_signed(dx)?, (cell / nx).checked_add_signed(dy)?);
            let length_m = cell_m * math::hypot(dx as f64, dy as f64);
            (x < nx && y < ny).then(|| (y * nx + x, length_m, f64::from(z[cell] - z[y * nx + x]) / length_m))
        });
        beside.max_by(|a, b| a.2.total_cmp(&b.2)).filter(|way| way.2 > 0.0)
    };
    let slope = |first: usize| {
        let (mut cell, mut way_m) = (first, 0.0);
        for _ in 0..8 {
            let (below, length_m, _) = next(cell)?;
            (cell, way_m) = (below, way_m + length_m);
        }
        Some(f64::from(z[first] - z[cell]) / way_m)
    };
    (0..z.len()).filter(|cell| (0.8e6..1.25e6).contains(&area.samples()[*cell])).filter_map(slope).collect()
}

/// Where 1 km² drains, rivers of real mountains fall by 15 to 25 %, and no mountains are in balance everywhere.
#[test]
fn default_rivers_are_as_steep_as_real_ones_and_not_in_balance() {
    for noise in ["Perlin", "Ridged", "Noise"] {
        let outputs = ["height", "area", "rate"];
        let rasters = relief::built_outputs(&on_noise(noise, ""), &folder(), 320, outputs);
        let [height, area, rate] = rasters.expect("three rasters");
        let slope = median(channel_slopes(&height, &area));
        // the uplift is 1 mm/yr
        let off = rate.samples().iter().filter(|rate| (**rate / 1e-3 - 1.0).abs() > 0.2).count();
        let off = off as f64 / rate.samples().len() as f64;
        println!("{noise}: {slope:.3} where 1 km² drains; {off:.2} erode a fifth faster or slower than they rise");
        assert!((0.15..0.25).contains(&slope), "{noise}: {slope}");
        assert!(off > 0.2, "{noise}: {off}");
    }
}

/// How much of the slopes of a terrain face across a strike of 60°, within 30°; and the mean slopes of those that fall
/// against a dip to its right, and of those that fall with it.
fn grain(land: &Field) -> (f64, [f64; 2]) {
    // down the dip; x to the east, y to the south
    let across = [math::cos(60_f64.to_radians()), math::sin(60_f64.to_radians())];
    let [mut facing, mut sums, mut counts] = [[0.0; 2]; 3];
    for cell in inner(land) {
        let ([east, south], slope) = (gradient(land, cell), slope(land, cell));
        if slope > 0.1 {
            let up = (east * across[0] + south * across[1]) / slope;
            facing[usize::from(up.abs() > 0.866)] += 1.0;
            if up.abs() > 0.7 {
                let side = usize::from(up < 0.0);
                (sums[side], counts[side]) = (sums[side] + slope, counts[side] + 1.0);
            }
        }
    }
    (facing[1] / (facing[0] + facing[1]), [sums[0] / counts[0], sums[1] / counts[1]])
}

/// Beds at the surface turn slopes across their strike. Beds at depth make scarps steeper than dip slopes.
#[test]
fn beds_give_mountains_a_grain_and_scarps() {
    let layers =
        "layers: [(thickness: \"200 m\", hardness: 0.5, repose: 34), (thickness: \"120 m\", hardness: 3, repose: 42)]";
    let text = format!(
        "(world: (size: \"24 km\", cells: 240, seed: 3, boundary: inland), nodes: {{
        \"base\": Perlin(wavelength: \"8 km\", amplitude: \"200 m\"),
        \"beds\": Rock(height: \"base\", strike: 60, fold_height: 0, dip: 20, beds: 1, broken: 0),
        \"even\": Rock(height: \"base\", strike: 60, beds: 0, broken: 0),
        \"right\": Stratify(height: \"base\", strike: 60, dip: 20, {layers}),
        \"left\": Stratify(height: \"base\", strike: 60, dip: -20, {layers}),
        \"grained\": StreamPower(version: 20, height: \"base\", reference_rate: \"beds.rate\", repose: \"beds.repose\",
            variation: 0, repose_variation: 0),
        \"plain\": StreamPower(version: 20, height: \"base\", reference_rate: \"even.rate\", repose: \"even.repose\",
            variation: 0, repose_variation: 0),
        \"to_right\": StreamPower(version: 20, height: \"base\", strata: \"right.strata\"),
        \"to_left\": StreamPower(version: 20, height: \"base\", strata: \"left.strata\"),
    }}, outputs: {{ \"grained\": \"grained\", \"plain\": \"plain\", \"right\": \"to_right\", \"left\": \"to_left\" }})"
    );
    let document = Document::parse(text, &registry());
    let lands = relief::built_outputs(&document, &folder(), 240, ["grained", "plain", "right", "left"]);
    let [grained, plain, right, left] = lands.expect("four rasters").map(|land| grain(&land));
    println!("across the strike: {:.2} with beds, {:.2} without; dips {right:.3?}, {left:.3?}", grained.0, plain.0);
    // a third if slopes faced all ways alike
    assert!(grained.0 > 0.55 && plain.0 < 0.45, "{} {}", grained.0, plain.0);
    let ratio = |scarps: f64, dip_slopes: f64| scarps / dip_slopes;
    let ratios = [ratio(right.1[0], right.1[1]), ratio(left.1[1], left.1[0])];
    assert!(ratios.iter().all(|ratio| *ratio > 1.1), "{ratios:?}");
}

/// Measures of drainage and of small forms, and the windows of real mountains.
const FORMS: [(&str, RangeInclusive<f64>); 7] = [
    ("roughness.laplacian_skew", -1.0..=1.0),
    ("concavity", 0.3..=0.6),
    ("hack_exponent", 0.48..=0.6),
    ("border.comb", 0.0..=0.25),
    ("pits.deeper_than_1_m", 0.0..=0.05),
    ("valleys.exponent", 1.15..=2.0),
    ("valleys.floor", 0.12..=0.5),
];

/// The measures of a terrain that are outside the windows.
fn forms_outside(land: &Field) -> Vec<String> {
    let report = measure(land, &registry(), &Cancel::default()).expect("measures");
    let outside = |(name, window): &(&str, RangeInclusive<f64>)| {
        let value = report.get(name).expect("a measure");
        (!window.contains(&value)).then(|| format!("{name} is {value:.3}, not in {window:?}"))
    };
    FORMS.iter().filter_map(outside).collect()
}

/// Mountains do not look like folded paper: slopes have many angles, there are no planes, and valleys have the form, the
/// length and the profile of real ones. Cells are at most 100 m.
#[test]
fn mountains_have_slopes_of_many_angles_and_real_valleys() {
    let mut faults = Vec::new();
    for (graph, cells) in relief::MOUNTAINS {
        let land = land(graph, cells);
        let look = Look::of(&land).expect("slopes");
        println!("{graph}: {look:.3?}");
        faults.extend(look.faults().map(|fault| format!("{graph}: {fault}")));
        faults.extend(forms_outside(&land).into_iter().map(|fault| format!("{graph}: {fault}")));
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

/// Erosion keeps at least nine tenths of the ratio of slopes of a real model.
#[test]
fn erosion_keeps_the_slopes_of_a_real_model() {
    let source = std::fs::read_to_string(folder().join("carve_dem.ron")).expect("a graph file");
    let source = source.replace("outputs: {", "outputs: { \"model\": \"today\",");
    let document = Document::parse_at(source, folder().join("carve_dem.ron"), &registry());
    let lands = relief::built_outputs(&document, &folder(), 512, ["model", "height"]).expect("two rasters");
    let [before, after] = lands.map(|land| Look::of(&land).expect("slopes").ratio);
    println!("the ratio was {before:.2} and is {after:.2}");
    assert!((1.6..1.8).contains(&before) && after >= 0.9 * before, "{before} {after}");
}

/// The median slope of cells by the area that they drain, in quarters of a power of ten from 10^3.75 m².
fn slopes_by_area(height: &Field, area: &Field) -> Vec<f64> {
    let mut bins = vec![Vec::new(); 12];
    for cell in inner(height) {
        let bin = (math::ln(f64::from(area.samples()[cell])) / std::f64::consts::LN_10 - 3.75) * 4.0;
        if let Some(bin) = bins.get_mut(bin.max(0.0) as usize) {
            bin.push(slope(height, cell));
        }
    }
    bins.into_iter().map(median).collect()
}

/// Measures of the Alps with cells of 80 m: relief, slopes and hypsometric integral of an area 30 km wide. Slopes are
/// steepest where some 10^4 m² drain, and gentler both on ridges and along rivers.
#[test]
fn the_alps_are_alpine() {
    let document = Document::load(folder().join("alps.ron"), &registry()).expect("a graph file");
    let [land, area] =
        relief::built_outputs(&document, &folder(), relief::ALPS.1, ["height", "area"]).expect("two rasters");
    let slopes = slopes_by_area(&land, &area);
    let steepest = slopes.iter().copied().fold(0.0, f64::max);
    let at = slopes.iter().position(|slope| *slope == steepest).unwrap_or(0);
    println!("median slopes from 10^3.75 m²: {slopes:.3?}");
    assert!((0..=3).contains(&at), "steepest in bin {at}");
    assert!(slopes[0] < 0.99 * steepest && slopes[9] < 0.8 * steepest, "{slopes:?}");
    assert_eq!(Look::of(&land).expect("slopes").faults(), None);
    assert_eq!(forms_outside(&land), [""; 0]);
    let height = |x: usize, y: usize| f64::from(land.samples()[y * 750 + x]);
    let middle = || (188..562).flat_map(|y| (188..562).map(move |x| (x, y)));
    let heights: Vec<f64> = middle().map(|(x, y)| height(x, y)).collect();
    let (low, high) = heights.iter().fold((f64::MAX, f64::MIN), |(low, high), &h| (low.min(h), high.max(h)));
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    let slope = |(x, y): (usize, usize)| {
        let (east, south) = (height(x + 1, y) - height(x - 1, y), height(x, y + 1) - height(x, y - 1));
        orograph_nodes::numerics::math::atan((east * east + south * south).sqrt() / 160.0).to_degrees()
    };
    let mut slopes: Vec<f64> = middle().map(slope).collect();
    slopes.sort_unstable_by(f64::total_cmp);
    let [half, steep] = [0.5, 0.95].map(|share| slopes[(share * (slopes.len() - 1) as f64) as usize]);
    for (name, value, range) in [
        ("relief", high - low, 2000.0..3500.0),
        ("hypsometric integral", (mean - low) / (high - low), 0.47..0.68),
        ("median slope", half, 23.0..32.0),
        ("slope that 5 % exceed", steep, 37.0..48.0),
        ("ratio of the two", steep / half, 1.4..1.8),
    ] {
        assert!(range.contains(&value), "{name}: {value} is not in {range:?}");
    }
}

/// A very high range: relief and slopes are those of tiles of the Himalaya, 20 to 40 km across with cells of 80 to 100
/// m.
#[test]
fn the_himalaya_is_high_and_steep() {
    let land = land("himalaya", 300);
    assert_eq!(Look::of(&land).expect("slopes").faults(), None);
    let (low, high) = land.range(0).expect("heights");
    assert!((3600.0..6000.0).contains(&(high - low)), "{low} to {high}");
}

/// Glaciers leave troughs and rivers in layered rock narrow valleys. Windows are those of elevation models of British
/// glaciers and, for the canyon, of rivers; that of fjords is the range of exponents of glacial valleys.
#[test]
fn valleys_have_the_form_of_what_cut_them() {
    for (graph, cells, indices, exponents) in [
        ("glen", 400, 0.06..=0.25, 1.35..=2.3),
        ("fjords", 300, 0.06..=0.4, 1.5..=2.2),
        ("canyon", 600, -0.25..=0.25, 1.0..=1.5),
    ] {
        let report = measure(&land(graph, cells), &registry(), &Cancel::default()).expect("measures");
        let [index, exponent] =
            ["valleys.v_index", "valleys.exponent"].map(|name| report.get(name).expect("a measure"));
        println!("{graph}: index {index:.3}, exponent {exponent:.3}");
        assert!(indices.contains(&index) && exponents.contains(&exponent), "{graph}: {index} {exponent}");
    }
}

/// In the glen, water stands in a basin that the ice has deepened, equally deep at two cell counts, and moraines lie along
/// its valleys.
#[test]
fn the_glen_has_a_loch_and_moraines() {
    let document = Document::load(folder().join("glen.ron"), &registry()).expect("a graph file");
    let share = |field: &Field, above: f32| {
        field.samples().iter().filter(|value| **value > above).count() as f64 / field.samples().len() as f64
    };
    let depths = [320, 480].map(|cells| {
        let [loch, moraine] =
            relief::built_outputs(&document, &folder(), cells, ["loch", "moraine"]).expect("both are built");
        let depth = loch.samples().iter().copied().fold(0.0, f32::max);
        let (water, moraines) = (share(&loch, 10.0), share(&moraine, 0.5));
        println!(
            "{cells} cells: the loch is {depth:.0} m deep, deeper than 10 m over {water:.4} of the world; moraines cover \
             {moraines:.3}"
        );
        // Lochs of the Highlands are up to 310 m deep (Morar); a square kilometre is 0.0017 of the world.
        assert!((50.0..=310.0).contains(&depth) && (0.0017..=0.05).contains(&water), "{depth} m, {water}");
        assert!((0.02..=0.25).contains(&moraines), "{moraines}");
        depth
    });
    // A few metres of difference in the terrain before the ice change a basin by a tenth; with steps of 8 kyr instead of
    // 2.7 kyr, the depths were 77 and 347 m.
    assert!((0.75..=1.33).contains(&(depths[0] / depths[1])), "{depths:?}");
}

/// Below the cliffs of the canyon lie aprons of debris, as steep as it stands.
#[test]
fn the_canyon_has_aprons_of_debris() {
    let document = Document::load(folder().join("canyon.ron"), &registry()).expect("a graph file");
    let [land, debris] =
        relief::built_outputs(&document, &folder(), 512, ["height", "debris"]).expect("both are built");
    let degrees = |cell: usize| math::atan(slope(&land, cell)).to_degrees();
    let slopes: Vec<f64> = inner(&land).filter(|cell| debris.samples()[*cell] > 10.0).map(degrees).collect();
    let (share, median) = (slopes.len() as f64 / land.samples().len() as f64, median(slopes));
    println!(
        "aprons of more than 10 m cover {share:.3} of the world; half of them are steeper than {median:.1} degrees"
    );
    assert!((0.01..0.15).contains(&share) && (26.0..36.0).contains(&median), "{share} {median}");
}

/// A short run on a real model keeps the model: 100 kyr on levels and on a single grid differ by less than a tenth of what
/// they erode, with gullies by less than 13 %.
#[test]
fn short_runs_on_levels_change_a_model_as_single_grids_do() {
    let heights = |sides: &str, changes: &str, schedule: &str| -> Vec<f64> {
        let source = format!(
            "(format: 1, world: (size: (15360, 15360), cells: (256, 256), seed: 5, boundary: {sides}), nodes: {{
                \"today\": Import(file: \"data/bigtujunga_512_30m.tif\"),
                \"rivers\": StreamPower(version: 20, height: \"today\", uplift: \"1 mm/yr\", duration: \"100 kyr\",
                    {changes} schedule: {schedule}),
            }}, outputs: {{ \"before\": \"today\", \"height\": \"rivers\" }})"
        );
        let document = Document::parse_at(source, folder().join("short.ron"), &registry());
        assert!(document.problems().is_empty(), "{:?}", document.problems());
        let built = build(&document, 256.0, 2);
        let [before, after] = [0, 1].map(|at| built[at].as_field().expect("heights").samples());
        before.iter().zip(after).map(|(before, after)| f64::from(*after) - f64::from(*before) - 100.0).collect()
    };
    let size = |heights: &mut dyn Iterator<Item = f64>| heights.map(|height| height * height).sum::<f64>().sqrt();
    for (sides, changes, most) in [
        ("open", "gullies: 0, roughness: 0, winding: 0,", 0.1),
        ("open", "gullies: 0,", 0.1),
        ("inland", "gullies: 0,", 0.1),
        // on the coarsest level, the cells are larger than gullies
        ("inland", "", 0.13),
    ] {
        let [levels, single] = ["coarse_to_fine", "full"].map(|schedule| heights(sides, changes, schedule));
        let apart = size(&mut levels.iter().zip(&single).map(|(levels, single)| levels - single));
        let ratio = apart / size(&mut single.iter().copied());
        println!("{sides} {changes} {ratio:.3}");
        // levels take other steps than the single grid
        assert!((0.01..most).contains(&ratio), "{sides} {changes} {ratio}");
    }
}

/// `docs/validation.md` is of the present models, measures, presets and kernels.
#[test]
fn the_page_of_validation_is_current() {
    let page = std::fs::read_to_string(root().join("docs/validation.md")).expect("the page of validation");
    let hash = validation_hash();
    assert!(page.contains(&hash), "run `tests/validation/run.sh`: the inputs are now {hash}");
    assert!(!page.contains("**no**"), "a preset misses a window");
}
