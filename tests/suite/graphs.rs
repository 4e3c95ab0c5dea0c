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

/// The fraction of nearly level ground, below 2°, where a node of noise is wired to `StreamPower`, all at their defaults.
fn level_ground(noise: &str, uplift: &str) -> f64 {
    let registry = registry();
    let node = |id: &str, arguments: &str| registry.get(id).expect("a node").written(arguments);
    let text = format!(
        "(world: (size: \"16 km\", cells: 200, seed: 3, boundary: inland), nodes: {{ \"base\": {}, \"rivers\": {} }}, \
         outputs: {{ \"height\": \"rivers\" }})",
        node(noise, ""),
        node("StreamPower", &format!("height: \"base\"{uplift}")),
    );
    let land = relief::built(&Document::parse(text, &registry), &folder(), 200).expect("the land");
    let (nx, z, step_m) = (200, land.samples(), 2.0 * land.window().cell_m());
    let slope = |cell: usize| {
        let along = |by: usize| (f64::from(z[cell + by]) - f64::from(z[cell - by])) / step_m;
        math::hypot(along(1), along(nx))
    };
    let inner: Vec<usize> = (nx..nx * (nx - 1)).filter(|cell| (1..nx - 1).contains(&(cell % nx))).collect();
    inner.iter().filter(|cell| slope(**cell) < 0.035).count() as f64 / inner.len() as f64
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

/// Measures of the Alps with cells of 80 m: relief, slopes and hypsometric integral of an area 30 km wide.
#[test]
fn the_alps_are_alpine() {
    let land = land(relief::ALPS.0, relief::ALPS.1);
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

/// In the glen, water stands in a basin that the ice has deepened, and moraines lie along its valleys.
#[test]
fn the_glen_has_a_loch_and_moraines() {
    let document = Document::load(folder().join("glen.ron"), &registry()).expect("a graph file");
    let [loch, moraine] =
        relief::built_outputs(&document, &folder(), 400, ["loch", "moraine"]).expect("both are built");
    let share = |field: &Field, above: f32| {
        field.samples().iter().filter(|value| **value > above).count() as f64 / field.samples().len() as f64
    };
    let depth = loch.samples().iter().copied().fold(0.0, f32::max);
    let (water, moraines) = (share(&loch, 10.0), share(&moraine, 0.5));
    println!(
        "the loch is {depth:.0} m deep, deeper than 10 m over {water:.4} of the world; moraines cover {moraines:.3}"
    );
    // Lochs of the Highlands are up to 310 m deep (Morar); a square kilometre is 0.0017 of the world.
    assert!((50.0..=310.0).contains(&depth) && (0.0017..=0.05).contains(&water), "{depth} m, {water}");
    assert!((0.02..=0.25).contains(&moraines), "{moraines}");
}

/// A short run on a real model keeps the model: 100 kyr on levels and on a single grid differ by less than a tenth of what
/// they erode, with gullies by less than 13 %.
#[test]
fn short_runs_on_levels_change_a_model_as_single_grids_do() {
    let heights = |sides: &str, changes: &str, schedule: &str| -> Vec<f64> {
        let source = format!(
            "(format: 1, world: (size: (15360, 15360), cells: (256, 256), seed: 5, boundary: {sides}), nodes: {{
                \"today\": Import(file: \"data/bigtujunga_512_30m.tif\"),
                \"rivers\": StreamPower(version: 19, height: \"today\", uplift: \"1 mm/yr\", duration: \"100 kyr\",
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
