//! Tests of the levels: one terrain on any cells, and inputs at the edge of sense.

use std::{
    path::Path,
    sync::{Arc, Mutex},
    time::Duration,
};

use orograph_graph::{
    Boundary, Document, Edge, Evaluator, EvaluatorOptions, Registry, Store, StoreFolder, Strata, Trust, Value, World,
};

use crate::{
    erosion::stream_power::{NODE, tests::white},
    numerics::math,
    prelude::*,
    testing,
};

/// A range that rises from rough land of 16 km.
fn land(cells: u32, sides: &str, changes: &str) -> Field {
    let text = format!(
        "(format: 1, world: (size: \"16 km\", cells: {cells}, seed: 3, boundary: {sides}), nodes: {{ \
         \"hills\": Ridged(wavelength: \"4 km\", amplitude: \"200 m\"), \
         \"rise\": Uplift(centre: (\"8 km\", \"8 km\"), radius: \"9 km\", rate: \"2 mm/yr\"), \
         \"rivers\": StreamPower(version: 5, height: \"hills\", uplift: \"rise\", erodibility: 4e-6, duration: \"1.5 Myr\"{changes}), \
         }}, outputs: {{ \"height\": \"rivers\" }})"
    );
    let document = Document::parse(text, &crate::registry());
    let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("an evaluator");
    let (port, window) = (document.outputs()[0].port, Window::whole(document.world()));
    let found = evaluator.values(document.graph(), Path::new("."), &[port], window).expect("heights");
    found[0].as_field().expect("a field").clone()
}

/// The root mean square difference over the standard deviation, on the coarser cells.
fn apart(coarse: &Field, fine: &Field) -> f64 {
    let fine = super::resample::resampled(fine, *coarse.window(), false).expect("memory");
    let difference: Vec<f32> = fine.samples().iter().zip(coarse.samples()).map(|(a, b)| a - b).collect();
    let ((mean, deviation), (_, whole)) = (testing::moments(&difference), testing::moments(fine.samples()));
    math::hypot(mean, deviation) / whole
}

#[test]
fn a_land_is_the_same_on_any_cells() {
    for sides in ["inland", "base"] {
        let many = land(512, sides, "");
        // the coarsest level, the next one, and cells between two
        let found = [128, 256, 300].map(|cells| apart(&land(cells, sides, ""), &many));
        assert!(found.iter().all(|apart| *apart < 0.05), "{found:?}");
    }
    let single = apart(&land(256, "inland", ", schedule: full"), &land(512, "inland", ", schedule: full"));
    assert!(single > 0.1, "{single}");
}

#[test]
fn the_analytical_method_has_the_same_levels() {
    let changes = ", method: analytical, diffusivity: 0";
    let many = land(512, "base", changes);
    let found = [128, 256].map(|cells| apart(&land(cells, "base", changes), &many));
    assert!(found.iter().all(|apart| *apart < 0.05), "{found:?}");
    let stepped = land(128, "base", ", method: analytical, diffusivity: 0, time_step: \"200 kyr\"");
    assert!(stepped == land(128, "base", changes), "it has no time step");
    let single = apart(&land(256, "base", ", method: analytical, schedule: full"), &many);
    assert!(single > 0.2, "{single}");
}

/// Soil creeps after each leap of the analytical method as it does in steps: 0.05 m²/yr take as much of the roughness.
#[test]
fn the_analytical_method_has_creep() {
    let roughness = |changes: &str| {
        let land = land(256, "base", changes);
        let (heights, nx) = (land.samples(), 256);
        let bend =
            |at: usize| heights[at - 1] + heights[at + 1] + heights[at - nx] + heights[at + nx] - 4.0 * heights[at];
        let bends: Vec<f32> = (nx + 1..nx * 255 - 1).filter(|at| (1..255).contains(&(at % nx))).map(bend).collect();
        testing::moments(&bends).1
    };
    let [smooth, steps] =
        ["analytical", "implicit"].map(|method| roughness(&format!(", method: {method}, diffusivity: 0.05")));
    let rough = roughness(", method: analytical, diffusivity: 0");
    assert!(smooth < 0.6 * rough && (smooth / steps - 1.0).abs() < 0.15, "{smooth} {steps} {rough}");
}

#[test]
fn fewer_cells_than_the_coarsest_level_are_its_means() {
    let found = apart(&land(50, "base", ""), &land(512, "base", ""));
    assert!(found < 0.12, "{found}");
}

#[test]
fn nothing_erodes_where_rock_does_not() {
    let height = testing::field(testing::world(200, 150, 40.0), |x, y| 300.0 * white(x, y));
    let [uplift, none, repose] = [0.001, 0.0, 90.0].map(|value| Field::constant(*height.window(), value));
    let fields = [("height", &height), ("uplift", &uplift), ("erodibility", &none), ("repose", &repose)];
    let params = testing::with_params(&NODE, "duration=1e6,rounding=0");
    let found = testing::run(&NODE, &params, &fields, "height");
    for (cell, (after, before)) in found.samples().iter().zip(height.samples()).enumerate() {
        let (x, y) = (cell % 200, cell / 200);
        let base = x == 0 || y == 0 || x == 199 || y == 149;
        let risen = if base { 0.0 } else { 1000.0 };
        assert!((after - before - risen).abs() < 2e-3, "{cell}: {before} {after}");
    }
}

/// Runs of a day and of a billion years from cliffs, level ground and the bottom of the sea, with the defaults.
#[test]
fn runs_of_any_length_give_heights() {
    let world = World { boundary: Boundary::all(Edge::Inland), ..testing::world(120, 90, 60.0) };
    let cliffs = testing::field(world, |x, y| 20_000.0 * white(x, y));
    let level = Field::constant(Window::whole(world), 12.0);
    let drowned = testing::at_sea(&level, 500.0);
    for (years, most_m) in [("0.0027", 20_000.0), ("1e9", 5000.0)] {
        for height in [&cliffs, &level, &drowned] {
            let uplift = Field::constant(*height.window(), 0.001);
            let params = testing::with_params(&NODE, &format!("duration={years}"));
            let found = testing::run(&NODE, &params, &[("height", height), ("uplift", &uplift)], "height");
            let (low, high) = found.range(0).expect("numbers");
            assert!(found.samples().iter().all(|v| v.is_finite()), "{years}");
            assert!(high - low <= most_m, "{years}: {low} to {high}");
        }
    }
}

#[test]
fn any_world_gives_heights() {
    let periodic = Boundary { west: Edge::Periodic, east: Edge::Periodic, ..Boundary::default() };
    let mixed = Boundary { west: Edge::Wall, east: Edge::Open, north: Edge::Inland, south: Edge::Base };
    let boundaries =
        [Boundary::all(Edge::Base), Boundary::all(Edge::Inland), Boundary::all(Edge::Open), periodic, mixed];
    let runs =
        [("duration=1e6", None), ("duration=1e5,time_step=1e5", Some(100.0)), ("duration=0", None), ("", Some(900.0))];
    for (b, boundary) in boundaries.into_iter().enumerate() {
        for (s, (nx, ny)) in [(1, 1), (1, 40), (300, 1), (5, 3), (150, 140)].into_iter().enumerate() {
            let world = World { boundary, ..testing::world(nx, ny, 30.0) };
            let height = testing::field(world, |x, y| 500.0 * white(x, y));
            // every pair of boundary, size and run
            let (changes, sea) = runs[(b + s) % runs.len()];
            let height = sea.map_or_else(|| height.clone(), |sea| testing::at_sea(&height, sea));
            let deposition = Field::constant(*height.window(), 0.5);
            let fields = [("height", &height), ("deposition", &deposition)];
            let changes = format!("time_step=2e5,{changes}");
            let mut found = testing::outputs(&NODE, &testing::with_params(&NODE, &changes), &fields).expect("a result");
            for output in NODE.outputs {
                let value = found.take(output.name).expect("an output");
                let Some(field) = value.as_strata().map(Strata::offset).or(value.as_field()) else {
                    assert!(value.as_report().is_some(), "{}", output.name);
                    continue;
                };
                assert_eq!(field.window(), height.window());
                assert!(field.samples().iter().all(|v| v.is_finite()), "{nx} {ny} {changes}: {}", output.name);
            }
        }
    }
}

#[test]
fn the_same_for_any_thread_count_and_simd_level() {
    let world = World { boundary: Boundary::all(Edge::Inland), ..testing::world(300, 280, 50.0) };
    let height = testing::field(world, |x, y| 300.0 * white(x, y));
    let deposition = Field::constant(Window::whole(world), 0.5);
    for (n, more) in [("1", None), ("1.2", Some(("deposition", &deposition)))] {
        let params = testing::with_params(&NODE, &format!("duration=1e6,time_step=1e5,n={n}"));
        let fields: Vec<_> = [("height", &height)].into_iter().chain(more).collect();
        assert!(testing::run_in(1, &NODE, &params, &fields) == testing::run_in(7, &NODE, &params, &fields));
        testing::at_every_level(|| testing::outputs(&NODE, &params, &fields));
    }
}

/// The cells of the runs of [`COUNTED`], and whether they gave outputs and a state.
static RUNS: Mutex<Vec<(u32, bool, bool)>> = Mutex::new(Vec::new());

static COUNTED: Node = Node {
    cpu: |job| {
        let gives = (super::Wants::of(job).count() > 0, job.level.gives_state);
        RUNS.lock().expect("no panic").push((job.window().cells[0], gives.0, gives.1));
        (NODE.cpu)(job)
    },
    ..NODE
};

fn runs() -> Vec<(u32, bool, bool)> {
    std::mem::take(&mut *RUNS.lock().expect("no panic"))
}

#[test]
fn finer_cells_pass_the_last_level_only() {
    let all = crate::registry();
    let nodes = all.nodes().iter().copied().filter(|node| node.id != NODE.id);
    let registry = Registry::new(nodes.chain([&COUNTED]));
    let text = "(format: 1, world: (size: \"16 km\", cells: 128, seed: 3, boundary: inland), nodes: { \
         \"hills\": Ridged(wavelength: \"4 km\", amplitude: \"200 m\"), \
         \"rivers\": StreamPower(version: 5, height: \"hills\", uplift: 0.001, deposition: 0.4, duration: \"1 Myr\", \
         time_step: 5e4), }, outputs: { \"height\": \"rivers\", \"sediment\": \"rivers.sediment\" })";
    let document = Document::parse(text.to_owned(), &registry);
    let ports: Vec<_> = document.outputs().iter().map(|output| output.port).collect();
    let on = |evaluator: &Evaluator, count: usize, cells: u32| -> Vec<Value> {
        let window = Window::whole(World { cells: [cells; 2], ..document.world() });
        evaluator.values(document.graph(), Path::new("."), &ports[..count], window).expect("heights")
    };
    let with = |budget: usize, folder: Option<StoreFolder>| {
        let options = EvaluatorOptions { store: Arc::new(Store::new(budget, folder)), ..EvaluatorOptions::default() };
        Evaluator::new(options).expect("an evaluator")
    };
    let whole = |budget: usize| with(budget, None);
    let expected = on(&whole(1 << 30), 2, 512);
    assert_eq!(runs(), [(128, false, true), (256, false, true), (512, true, true)]);

    let keeping = whole(1 << 30);
    assert!(on(&keeping, 1, 256).len() == 1 && runs().len() == 2);
    assert!(on(&keeping, 2, 512) == expected);
    assert_eq!(runs(), [(512, true, true)]);
    // between two levels, and fewer than the coarsest has
    on(&keeping, 1, 300);
    assert_eq!(runs(), [(300, true, false)]);
    on(&keeping, 1, 50);
    assert_eq!(runs(), [(128, true, false), (50, true, false)]);

    // without room in memory, from disk
    let folder = tempfile::tempdir().expect("a folder");
    let place =
        StoreFolder { folder: folder.path().to_owned(), budget: 1 << 30, worth: Duration::ZERO, trust: Trust::Own };
    on(&with(0, Some(place.clone())), 1, 256);
    runs();
    assert!(on(&with(0, Some(place)), 2, 512) == expected);
    assert_eq!(runs(), [(512, true, true)]);
    // nothing is kept
    let forgetful = whole(0);
    on(&forgetful, 1, 256);
    runs();
    assert!(on(&forgetful, 2, 512) == expected);
    assert_eq!(runs().len(), 3);
}
