//! The node: what glaciers make of valleys and niches, balances, unusual inputs.

#![expect(
    clippy::disallowed_methods,
    reason = "test terrain and closed forms are computed independently of the kernel"
)]

use orograph_graph::{Boundary, Cancel, Edge, InputValue, Value, Wanted, World};

use super::{NODE, Params, climate};
use crate::{
    prelude::*,
    testing::{at_every_level, field, outputs, outputs_and_warnings, outputs_on, run_in, with_params, world},
};

fn with_edges(field: &Field, boundary: Boundary) -> Field {
    let window = *field.window();
    Field::new(Window { world: World { boundary, ..window.world }, ..window }, field.samples().to_vec())
}

fn sum(field: &Field) -> f64 {
    field.samples().iter().map(|&v| f64::from(v)).sum()
}

fn samples(outputs: &mut Outputs, name: &str) -> Field {
    outputs.take(name).expect("declared").as_field().expect("a raster").clone()
}

fn measure(outputs: &mut Outputs, name: &str) -> f64 {
    let report = outputs.clone().take("report").expect("declared");
    report.as_report().expect("a report").get(name).expect("measured")
}

/// Mountains with valleys of several kilometres between 200 and 1400 m.
fn mountains(cells: u32, size_m: f64) -> Field {
    field(world(cells, cells, size_m / f64::from(cells)), |x, y| {
        let (u, v) = (x / 1900.0, y / 2300.0);
        800.0 + 350.0 * (u.sin() * v.cos()) + 180.0 * (1.7 * u + 0.9 * v).sin() + 70.0 * (3.1 * v - 2.3 * u).cos()
    })
}

fn at_ela(height: &Field, ela_m: f64, changes: &str) -> (Outputs, Vec<String>) {
    let ela = Field::constant(*height.window(), ela_m as f32);
    let params = with_params(&NODE, changes);
    let fields = [("height", height), ("ela", &ela)];
    let (found, warnings) = outputs_and_warnings(&Cancel::default(), *height.window(), &NODE, &params, &fields);
    (found.expect("runs"), warnings)
}

/// The exponent p of a valley's section, h = a |x|^p: the slope of the regression of ln h on ln |x|, between 10 and 120
/// m above the floor.
fn exponent(section: &[f64], cell_m: f64) -> f64 {
    let (low, floor) =
        section.iter().enumerate().fold((0, f64::MAX), |best, (i, &z)| if z < best.1 { (i, z) } else { best });
    let points: Vec<(f64, f64)> = section
        .iter()
        .enumerate()
        .filter(|(i, z)| *i != low && (10.0..120.0).contains(&(**z - floor)))
        .map(|(i, z)| (((i as f64 - low as f64).abs() * cell_m).ln(), (z - floor).ln()))
        .collect();
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let up: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    up / points.iter().map(|p| (p.0 - mx) * (p.0 - mx)).sum::<f64>()
}

/// A V-shaped valley, of exponent 1, becomes a trough with a section near a parabola: found are 1.64, 1.69 and 1.74 on
/// ice cells of 100, 75 and 50 m, where glacial valleys have 1.5 to 2.1. Without the cross-section law it stays nearer
/// to a V.
#[test]
fn a_v_becomes_a_u_at_three_cell_sizes() {
    let edges = Boundary { west: Edge::Wall, east: Edge::Wall, north: Edge::Wall, south: Edge::Open };
    let trough = |ice_cell: f64, changes: &str| {
        let valley = field(world(100, 140, 50.0), |x, y| 1600.0 - 0.06 * y + 0.45 * (x - 2500.0).abs());
        let valley = with_edges(&valley, edges);
        let changes = format!("ice_cell={ice_cell},warming=0,duration=300000,steps=60,relaxation=20,{changes}");
        let height = samples(&mut at_ela(&valley, 1500.0, &changes).0, "height");
        // mean of the sections of a kilometre, each against its own floor
        let sections = (60..80).map(|j| {
            let row = &height.samples()[j * 100..(j + 1) * 100];
            exponent(&row.iter().map(|&z| f64::from(z)).collect::<Vec<_>>(), 50.0)
        });
        sections.sum::<f64>() / 20.0
    };
    let found = [100.0, 75.0, 50.0].map(|ice_cell| trough(ice_cell, ""));
    let without = trough(75.0, "cross_section=0");
    println!("exponents {found:?}, without the law {without:.2}");
    assert!(found.iter().all(|p| (1.6..2.4).contains(p)), "{found:?}");
    let spread = found.iter().fold(0.0, |most: f64, p| most.max((p - found[2]).abs()));
    assert!(spread < 0.15, "{found:?}");
    assert!(without < found[1] - 0.2, "{without}");
}

/// A hollow in a mountain side above the equilibrium line, open below, becomes a cirque: it is cut deeper than the
/// slope beside it, and a closed basin lies below a headwall as steep as before.
#[test]
fn a_niche_becomes_a_cirque() {
    let niche = |x: f64, y: f64| {
        let r = (x - 2500.0).hypot(y - 2000.0) / 450.0;
        -90.0 * (-r * r).exp()
    };
    let slope = field(world(125, 125, 40.0), |x, y| 1900.0 - 0.35 * y + niche(x, y));
    let slope = with_edges(&slope, Boundary { north: Edge::Wall, ..Boundary::all(Edge::Open) });
    let (mut found, _) =
        at_ela(&slope, 1350.0, "ice_cell=60,warming=2000,duration=400000,steps=60,max_accumulation=0.5");
    let height = samples(&mut found, "height");
    let z = |field: &Field, x: f64, y: f64| f64::from(field.samples()[(y / 40.0) as usize * 125 + (x / 40.0) as usize]);
    let lowered = |x: f64, y: f64| z(&slope, x, y) - z(&height, x, y);
    let floor = (1500..2600).step_by(40).map(|y| lowered(2500.0, f64::from(y))).fold(0.0, f64::max);
    let beside = (1500..2600).step_by(40).map(|y| lowered(4200.0, f64::from(y))).fold(0.0, f64::max);
    let steepest = |field: &Field| {
        (600..2200)
            .step_by(40)
            .map(|y| (z(field, 2500.0, f64::from(y)) - z(field, 2500.0, f64::from(y) + 80.0)) / 80.0)
            .fold(0.0, f64::max)
    };
    assert!(
        !(1400..3600).step_by(40).any(|y| z(&slope, 2500.0, f64::from(y)) < z(&slope, 2500.0, f64::from(y) + 40.0)),
        "open"
    );
    // how far the floor lies below its lip
    let along: Vec<f64> = (1400..3600).step_by(40).map(|y| z(&height, 2500.0, f64::from(y))).collect();
    let basin = (0..along.len())
        .map(|k| along[k..].iter().fold(f64::MIN, |most, z| most.max(*z)) - along[k])
        .fold(0.0, f64::max);
    println!(
        "niche {floor:.0} m, beside {beside:.0} m, headwall {:.2} from {:.2}, basin {basin:.1} m",
        steepest(&height),
        steepest(&slope)
    );
    assert!(floor > 40.0 && floor > 1.3 * beside, "{floor} {beside}");
    assert!(steepest(&height) > 0.98 * steepest(&slope), "{}", steepest(&height));
    assert!(basin > 10.0, "{basin}");
}

/// Ice and debris are conserved to rounding on the ice grid, and till between the grids; erosion to 0.1 %, because
/// forms finer than ice cells wear down too.
#[test]
fn ice_and_till_are_conserved() {
    let land = mountains(128, 9600.0);
    for (method, edges) in [("full", Edge::Open), ("full", Edge::Wall), ("fast", Edge::Open)] {
        let land = with_edges(&land, Boundary { south: Edge::Base, ..Boundary::all(edges) });
        let (mut found, _) =
            at_ela(&land, 900.0, &format!("method={method},steps=30,warming=500,debris=1,cycles=2,ice_cell=110"));
        let report = found.take("report").expect("declared");
        let balance = |of: &str| report.as_report().expect("a report").balance_of(of);
        assert_eq!(balance("ice").is_some(), method == "full");
        assert!(balance("ice").is_none_or(|ice| ice.error.abs() < 1e-9), "{report:?}");
        let till = balance("till").expect("a balance");
        // smeared in single precision
        assert!(till.error.abs() < 1e-6, "{}", till.error);
        let (till, eroded) = (till.end, till.get("eroded_rock").expect("a volume"));
        let [height, deposit, erosion] = ["height", "till", "erosion"].map(|name| samples(&mut found, name));
        let area = land.window().cell_m() * land.window().cell_m();
        assert!(eroded > 1e7 && till > 0.1 * eroded, "{eroded} {till}");
        let balance = sum(&height) - sum(&land) + sum(&erosion) - sum(&deposit);
        assert!((balance * area / eroded).abs() < 1e-4, "{balance}");
        assert!((area * sum(&deposit) / till - 1.0).abs() < 1e-5, "{} {till}", area * sum(&deposit));
        assert!((area * sum(&erosion) / eroded - 1.0).abs() < 1e-3, "{} {eroded}", area * sum(&erosion));
    }
}

#[test]
fn without_ice_nothing_changes_and_a_warning_says_so() {
    let land = mountains(64, 9600.0);
    for method in ["full", "fast"] {
        let (mut found, warnings) = at_ela(&land, 9000.0, &format!("method={method},steps=5"));
        assert!(warnings.iter().any(|warning| warning.contains("no ice forms")), "{warnings:?}");
        assert_eq!(samples(&mut found, "height").samples(), land.samples());
        assert_eq!(samples(&mut found, "ice").range(0), Some((0.0, 0.0)));
    }
}

/// A cell that reaches the limit of a step is none to warn of; a run that is cut short is.
#[test]
fn a_warning_says_what_the_limits_of_steps_prevent() {
    let land = mountains(48, 9600.0);
    let limits = |changes: &str| {
        let (_, warnings) = at_ela(&land, 600.0, changes);
        warnings.into_iter().filter(|warning| warning.contains("limits on the erosion")).collect::<Vec<_>>()
    };
    assert_eq!(limits("steps=20,duration=20000"), Vec::<String>::new());
    let warned = limits("steps=5,duration=1000000");
    assert!(matches!(&warned[..], [one] if one.contains(" % of it; raise `steps`")), "{warned:?}");
}

#[test]
fn no_time_changes_nothing() {
    let land = mountains(48, 9600.0);
    let (mut found, warnings) = at_ela(&land, 600.0, "duration=0");
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!(samples(&mut found, "height").samples(), land.samples());
    assert_eq!(samples(&mut found, "till").range(0), Some((0.0, 0.0)));
}

#[test]
fn ice_everywhere_stays_finite_at_every_kind_of_side() {
    for edges in [
        Boundary::all(Edge::Wall),
        Boundary::all(Edge::Open),
        Boundary::all(Edge::Base),
        Boundary::all(Edge::Inland),
        Boundary { north: Edge::Base, south: Edge::Base, ..Boundary::all(Edge::Periodic) },
    ] {
        let land = with_edges(&mountains(48, 9600.0), edges);
        let (mut found, _) = at_ela(&land, -3000.0, "steps=10,warming=0,relaxation=50");
        let ice = samples(&mut found, "ice");
        assert!(ice.samples().iter().all(|depth| depth.is_finite()), "{edges:?}");
        assert!(measure(&mut found, "ice_area") > 0.9 * 9600.0 * 9600.0, "{edges:?}");
        assert!(samples(&mut found, "height").samples().iter().all(|z| z.is_finite() && (-500.0..2000.0).contains(z)));
    }
}

#[test]
fn unusual_worlds_and_maps_run() {
    let run = |land: &Field, changes: &str| at_ela(land, 700.0, &format!("steps=6,relaxation=20,{changes}"));
    // one row, one column, one cell, and ice cells longer than the world
    for (nx, ny) in [(64, 1), (1, 64), (1, 1), (3, 2)] {
        for method in ["full", "fast"] {
            let land = field(world(nx, ny, 100.0), |x, y| 1200.0 - 0.1 * (x + y));
            let (mut found, _) = run(&land, &format!("method={method}"));
            assert!(samples(&mut found, "height").samples().iter().all(|z| z.is_finite()), "{nx} x {ny} {method}");
        }
    }
    let land = mountains(40, 9600.0);
    let (mut found, _) = run(&land, "ice_cell=100000");
    assert!(samples(&mut found, "height").samples().iter().all(|z| z.is_finite()));
    // a height and climate maps with voids
    let mut holes = land.samples().to_vec();
    holes[40 * 20 + 11..40 * 20 + 17].fill(f32::NAN);
    let holes = Field::new(*land.window(), holes);
    let climate = with_params(&NODE, "climate=temperature,steps=6");
    let mut cold = vec![-2.0_f32; 1600];
    cold[700..720].fill(f32::NAN);
    let cold = Field::new(*land.window(), cold);
    let rain = Field::new(*land.window(), (0..1600).map(|k| if k % 40 < 20 { -1.0 } else { 2.0 }).collect());
    let fields = [("height", &holes), ("temperature", &cold), ("precipitation", &rain)];
    let (found, warnings) = outputs_and_warnings(&Cancel::default(), *land.window(), &NODE, &climate, &fields);
    let mut found = found.expect("runs");
    assert!(warnings.iter().any(|warning| warning.contains("negative")), "{warnings:?}");
    assert!(samples(&mut found, "height").samples().iter().all(|z| z.is_finite()));
    assert!(measure(&mut found, "ice_thickest_ever") > 5.0);
}

/// Land that is moved by half a periodic world gives the same moved: joined sides are like any other place. The systems
/// of lines are solved from another beginning, so thickness differs by rounding, which grows over the steps to 1 mm.
#[test]
fn joined_sides_are_like_any_other_place() {
    let (n, d) = (48, 150.0);
    let edges = Boundary { north: Edge::Wall, south: Edge::Wall, ..Boundary::all(Edge::Periodic) };
    let land = |shift: f64| {
        let wave = std::f64::consts::TAU / (f64::from(n) * d);
        let height = field(world(n, n, d), |x, y| {
            900.0
                + 300.0 * (wave * (x + shift)).sin() * (wave * y).cos()
                + 150.0 * (2.0 * wave * (x + shift) + 1.0).cos()
        });
        with_edges(&height, edges)
    };
    let run = |shift: f64, changes: &str, output: &str| {
        samples(&mut at_ela(&land(shift), 850.0, &format!("ice_cell=150,warming=0,{changes}")).0, output)
    };
    let worst = |changes: &str, output: &str| {
        let (one, other) = (run(0.0, changes, output), run(24.0 * d, changes, output));
        let moved = |k: usize| other.samples()[k / 48 * 48 + (k % 48 + 24) % 48];
        let most = one.samples().iter().fold(0.0_f32, |most, v| most.max(*v));
        (most, (0..48 * 48).map(|k| (one.samples()[k] - moved(k)).abs()).fold(0.0, f32::max))
    };
    let (thickest, ice) = worst("steps=4,duration=1", "ice");
    let (deepest, erosion) = worst("steps=2,duration=2000", "erosion");
    println!("ice {ice} of {thickest}, erosion {erosion} of {deepest}");
    assert!(thickest > 50.0 && ice < 1e-3, "{ice} of {thickest}");
    assert!(deepest > 0.1 && erosion < 1e-3, "{erosion} of {deepest}");
}

#[test]
fn with_an_exponent_of_zero_the_second_law_is_the_first() {
    let land = mountains(48, 9600.0);
    let run = |changes: &str| samples(&mut at_ela(&land, 900.0, &format!("steps=8,{changes}")).0, "height");
    for method in ["full", "fast"] {
        let first = run(&format!("method={method}"));
        assert!(first == run(&format!("method={method},law=area,area_exponent=0")), "{method}");
        assert!(first != run(&format!("method={method},law=area,area_exponent=0.5")), "{method}");
    }
}

/// Ice has cells of its own, so that a preview has the ice of the final build: area and volume of ice at the maximum,
/// and volumes of erosion and till after it, on cells of 56 and 225 m. The rest is what the means of small cells over
/// an ice cell keep of the terrain.
#[test]
fn a_preview_has_the_ice_of_the_final_build() {
    let [coarse, fine] = [64, 256].map(|cells| {
        let land = mountains(cells, 14_400.0);
        let ice = |warming: f64| {
            let changes = format!("steps=30,duration=30000,warming={warming},ice_cell=225");
            at_ela(&land, 900.0, &changes).0
        };
        let (mut cold, mut warm) = (ice(0.0), ice(600.0));
        let area_m2 = land.window().cell_m() * land.window().cell_m();
        let depth = samples(&mut cold, "ice");
        let covered = depth.samples().iter().filter(|depth| **depth > 5.0).count() as f64;
        let [erosion, till] = ["erosion", "till"].map(|name| sum(&samples(&mut warm, name)));
        [covered, sum(&depth), erosion, till].map(|cells| cells * area_m2)
    });
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        println!("{coarse:.4e} {fine:.4e} {:+.2} %", 100.0 * (coarse / fine - 1.0));
        assert!((coarse / fine - 1.0).abs() < 0.03, "{coarse} {fine}");
    }
}

/// The fast mode has ice where the full one has, within a fifth of its area, and half to twice its volume: it is a
/// preview.
#[test]
fn the_fast_mode_has_ice_where_the_full_one_has() {
    let land = mountains(96, 14_400.0);
    let ice = |method: &str| {
        let (mut found, _) =
            at_ela(&land, 900.0, &format!("method={method},steps=40,relaxation=100,warming=0,duration=1000"));
        samples(&mut found, "ice")
    };
    let (full, fast) = (ice("full"), ice("fast"));
    let covered = |ice: &Field| ice.samples().iter().filter(|depth| **depth > 5.0).count() as f64;
    let both = full.samples().iter().zip(fast.samples()).filter(|(a, b)| **a > 5.0 && **b > 5.0).count() as f64;
    let volume = sum(&fast) / sum(&full);
    println!("area {:.2}, shared {:.2}, volume {volume:.2}", covered(&fast) / covered(&full), both / covered(&full));
    assert!((covered(&fast) / covered(&full) - 1.0).abs() < 0.25);
    assert!(both / covered(&full) > 0.75);
    assert!((0.5..2.0).contains(&volume), "{volume}");
}

/// Calov and Greve (2005): at a mean of 0 °C the melt is the degree-day factor times 365.25 σ / √(2π) days and kelvins,
/// far above 0 °C it is that of the mean, and all precipitation is snow far below.
#[test]
fn melt_and_snow_have_their_closed_forms() {
    let window = *mountains(8, 800.0).window();
    crate::testing::with_job(window, |job| {
        let params = Params::read(&with_params(&NODE, "climate=temperature,degree_day=4,variability=5"));
        let inputs = climate::Inputs {
            ela: Lane::Constant(0.0),
            temperature: Lane::Constant(20.0),
            precipitation: Lane::Constant(1.5),
            lapse_rate: Lane::Constant(10.0),
        };
        let coarse = crate::numerics::coarse::Coarse::new(&window, 1.0);
        let climate = climate::Climate::new(job, &coarse, &params, &inputs).expect("a climate");
        let at = |temperature: f64| climate.balance(3, (20.0 - temperature) * 100.0, 0.0) * 0.91;
        let melt = 4e-3 * 365.25 * 5.0 / (2.0 * std::f64::consts::PI).sqrt();
        // Φ(1 / 5) of the precipitation falls below 1 °C
        assert!((at(0.0) - (1.5 * 0.579_259_7 - melt)).abs() < 1e-3, "{}", at(0.0));
        assert!((at(25.0) + 4e-3 * 365.25 * 25.0).abs() < 1e-3, "{}", at(25.0));
        assert!((at(-40.0) - 1.5).abs() < 1e-6, "{}", at(-40.0));
    });
}

#[test]
fn a_cycle_cools_stays_and_warms_in_stages() {
    let params = Params::read(&with_params(&NODE, "warming=900,stages=3,cycles=2"));
    let shift = |t: f64| climate::shift_m(&params, t).round();
    assert_eq!([0.0, 0.075, 0.15, 0.3, 0.39].map(shift), [900.0, 450.0, 0.0, 0.0, 0.0]);
    assert_eq!([0.41, 0.45, 0.49, 0.5, 0.65, 0.99].map(shift), [300.0, 600.0, 900.0, 900.0, 0.0, 900.0]);
}

#[test]
fn threads_and_widths_of_vectors_give_the_same_bits() {
    let land = mountains(90, 9600.0);
    for method in ["full", "fast"] {
        let params = with_params(&NODE, &format!("method={method},steps=8,ice_cell=107"));
        assert_eq!(run_in(1, &NODE, &params, &[("height", &land)]), run_in(3, &NODE, &params, &[("height", &land)]));
        at_every_level(|| run_in(2, &NODE, &params, &[("height", &land)]));
    }
}

/// Step by step the process gives what the kernel gives, and a time in years as seconds.
#[test]
fn step_by_step_it_is_the_run() {
    let land = mountains(48, 9600.0);
    for method in ["full", "fast"] {
        let params = with_params(&NODE, &format!("method={method},steps=10,duration=50000"));
        let input = |input: &orograph_graph::Input| match (input.name, input.fallback) {
            ("height", _) => InputValue::Value(Value::Field(land.clone())),
            (_, orograph_graph::Fallback::Constant { default, .. }) => InputValue::Constant(default),
            _ => InputValue::Absent,
        };
        let job = Job {
            node: &NODE,
            params: &params,
            inputs: NODE.inputs.iter().map(input).collect(),
            window: *land.window(),
            wanted: Wanted::ALL,
            folder: std::path::PathBuf::new(),
            cancel: Cancel::default(),
            progress: &|fraction| assert!((0.0..=1.0).contains(&fraction)),
            level: orograph_graph::LevelJob::default(),
            warnings: orograph_graph::Warnings::default(),
            glimpses: None,
        };
        let mut process = super::begin(&job).expect("begins");
        let end = process.moment().end;
        assert!((end / (50_000.0 * 365.25 * 86_400.0) - 1.0).abs() < 1e-12);
        while !process.moment().is_over() {
            process.step(&job).expect("goes on");
        }
        assert!(process.take(&params) && !process.take(&with_params(&NODE, "steps=11")));
        let stepped = process.outputs(&job).expect("there");
        assert_eq!(stepped, outputs(&NODE, &params, &[("height", &land)]).expect("runs"));
    }
}

#[test]
fn a_periodic_side_needs_its_opposite() {
    let land = with_edges(&mountains(16, 1600.0), Boundary { west: Edge::Periodic, ..Boundary::all(Edge::Open) });
    let refused = outputs_on(*land.window(), &NODE, &with_params(&NODE, "steps=2"), &[("height", &land)]);
    assert!(matches!(refused, Err(NodeError::Failed { hint: Some(_), .. })), "{refused:?}");
}

#[test]
fn a_cancelled_run_stops() {
    let land = mountains(32, 9600.0);
    let cancel = Cancel::default();
    cancel.cancel();
    let stopped =
        crate::testing::outputs_until(&cancel, *land.window(), &NODE, &with_params(&NODE, ""), &[("height", &land)]);
    assert!(matches!(stopped, Err(NodeError::Cancelled)));
}

/// Ice of kilometres that shoots over rough ground in a small world, on a bed where it slides a hundred times as fast
/// as usual: the fluxes of neighbours differ by more than the digits of a number.
#[test]
fn ice_out_of_all_proportion_is_conserved() {
    let land = field(world(48, 48, 4000.0 / 48.0), |x, y| {
        let (u, v) = (x / 190.0, y / 230.0);
        1500.0 + 900.0 * (u.sin() * v.cos()) + 280.0 * (1.7 * u + 0.9 * v).sin() + 170.0 * (3.1 * v - 2.3 * u).cos()
    });
    let land = with_edges(&land, Boundary::all(Edge::Base));
    let (mut found, _) = at_ela(
        &land,
        1000.0,
        "ice_cell=5,exponent=2,cycles=1,stages=7,steps=3,duration=200000,yield_stress=1e7,rate_factor=1.9e-16,\
         sliding=1.275e-14,smoothing=15,relaxation=150,max_accumulation=2.8,ablation_gradient=0.0046,\
         accumulation_gradient=0.004,warming=1093",
    );
    let report = found.take("report").expect("declared");
    let ice = report.as_report().expect("a report").balance_of("ice").expect("a balance").clone();
    assert!(ice.error.abs() < 1e-9, "{ice:?}");
}

/// Ice that cuts kilometres into broad flat ground leaves even beds: till is no thicker than some tens of metres, and
/// neighbours do not take turns at being high.
#[test]
fn broad_beds_stay_even() {
    const N: u32 = 96;
    let land = field(world(N, N, 75.0), |x, y| 300.0 + 0.05 * x + 25.0 * (x / 610.0).sin() * (y / 470.0).cos());
    let land = with_edges(&land, Boundary::all(Edge::Open));
    let changes = "warming=1200,duration=600000,steps=80,abrasion=8e-6";
    let (mut found, _) = at_ela(&land, 0.0, changes);
    let (height, till) = (samples(&mut found, "height"), samples(&mut found, "till"));
    let (thickest, lowest) = (till.range(0).expect("numbers").1, height.range(0).expect("numbers").0);
    let z = |i: usize, j: usize| f64::from(height.samples()[j * N as usize + i]);
    let turns = |i: usize, j: usize| 0.25 * (z(i, j) - z(i + 1, j) - z(i, j + 1) + z(i + 1, j + 1));
    let inside = || (4..90).flat_map(|j| (4..90).map(move |i| (i, j)));
    let mean = (inside().map(|(i, j)| turns(i, j).powi(2)).sum::<f64>() / inside().count() as f64).sqrt();
    println!("till {thickest:.0} m, lowest {lowest:.0} m, turns {mean:.2} m");
    assert!(lowest < -200.0 && thickest < 120.0 && mean < 2.0, "{lowest} {thickest} {mean}");
}
