//! Closed forms, invariants and hostile input.

use orograph_graph::{Boundary, Edge, World};

use super::*;
use crate::testing::{at_every_level, field, outputs, run as output, run_in, with_params, world};

/// All sides alike.
fn sides(world: World, edge: Edge) -> World {
    World { boundary: Boundary::all(edge), ..world }
}

/// Land with valleys, ridges and pits.
fn rough(world: World) -> Field {
    field(world, |x, y| {
        900.0 + 0.02 * x + 60.0 * libm::sin(x / 170.0) * libm::cos(y / 130.0) + 9.0 * libm::sin(x / 31.0 + y / 23.0)
    })
}

fn outcome(changes: &str, fields: &[(&str, &Field)]) -> (Field, Report) {
    let mut outputs = outputs(&NODE, &with_params(&NODE, changes), fields).expect("a result");
    let height = outputs.take("height").unwrap().as_field().unwrap().clone();
    let report = outputs.take("report").unwrap().as_report().unwrap().clone();
    (height, report)
}

#[test]
fn nothing_happens_in_no_time() {
    let land = field(world(50, 40, 10.0), |x, y| if x < 20.0 { -0.0 } else { x * y });
    assert_eq!(outcome("duration=0", &[("height", &land)]).0, land);
}

/// Water and solids over 2000 steps: 1e-5, some hundred roundings of what is turned over.
#[test]
fn water_and_ground_are_conserved() {
    for (edge, changes) in [
        (Edge::Wall, "duration=2000, courant=0.3"),
        (Edge::Base, "duration=2000, courant=0.3"),
        (Edge::Open, "duration=2000, courant=0.3, scheme=pipes, damping=0.1"),
        (Edge::Periodic, "duration=2000, courant=0.3, infiltration=10, evaporation=0.0001"),
    ] {
        let land = rough(sides(world(96, 80, 5.0), edge));
        let (_, report) = outcome(changes, &[("height", &land)]);
        println!("{edge:?} {report:?}");
        assert!(report.get("steps").unwrap() > 2000.0);
        assert!(report.get("eroded").unwrap() > 100.0);
        for error in ["water_error", "solid_error"] {
            assert!(report.get(error).unwrap().abs() < 1e-5, "{edge:?} {error}");
        }
        assert_eq!(report.get("water_out").unwrap() > 0.0, edge == Edge::Base || edge == Edge::Open);
    }
}

#[test]
fn threads_and_simd_levels_give_the_same_bits() {
    for (edge, changes) in [
        (Edge::Base, "duration=600"),
        (Edge::Periodic, "duration=600, transport=semi_lagrangian"),
        (Edge::Open, "duration=600, transport=maccormack, scheme=pipes"),
    ] {
        let land = rough(sides(world(150, 131, 10.0), edge));
        let params = with_params(&NODE, changes);
        let one = run_in(1, &NODE, &params, &[("height", &land)]);
        for threads in [2, 4] {
            assert_eq!(one, run_in(threads, &NODE, &params, &[("height", &land)]));
        }
        at_every_level(|| run_in(2, &NODE, &params, &[("height", &land)]));
    }
}

/// Rain on a sealed basin stays: 100 mm/h for 2 hours are 0.2 m.
#[test]
fn a_sealed_basin_fills() {
    let bowl = field(sides(world(40, 40, 10.0), Edge::Wall), |x, y| 0.001 * ((x - 200.0) * (x - 200.0) + y * y));
    let rain = Field::constant(*bowl.window(), 100.0);
    let params = with_params(&NODE, "acceleration=1");
    let water = output(&NODE, &params, &[("height", &bowl), ("rain", &rain)], "water");
    let mean: f64 = water.samples().iter().map(|&d| f64::from(d)).sum::<f64>() / 1600.0;
    assert!((mean - 0.2).abs() < 1e-5 * 0.2, "{mean}");
}

#[test]
fn any_land_and_any_number_stay_finite() {
    let hostile: [&dyn Fn(f64, f64) -> f64; 5] = [
        &|_, _| 7.0,
        &|x, _| 1e9 * x,
        &|x, y| if x > y { 1e30 } else { -1e30 },
        &|x, _| if x > 2.0 { f64::NAN } else { x },
        &|x, y| 3000.0 * libm::sin(x * 7.0 + y),
    ];
    for (nx, ny) in [(1, 1), (1, 9), (9, 1), (2, 2), (67, 33)] {
        for land in hostile {
            for edge in [Edge::Base, Edge::Open, Edge::Wall, Edge::Periodic] {
                let height = field(sides(world(nx, ny, 1.0), edge), land);
                for changes in [
                    "duration=20",
                    "duration=20, entrainment=100, capacity=10, acceleration=100000, rock=1",
                    "duration=20, law=webgl_erosion, transport=maccormack, river=100, river_radius=0",
                ] {
                    let mut outputs = outputs(&NODE, &with_params(&NODE, changes), &[("height", &height)]).unwrap();
                    for name in ["water", "velocity", "sediment", "deposition", "flow"] {
                        let value = outputs.take(name).unwrap();
                        let all = value.as_field().unwrap().samples().iter().all(|v| v.is_finite());
                        assert!(all, "{name} of {nx} x {ny}, {edge:?}, {changes}");
                    }
                    let after = outputs.take("height").unwrap();
                    let holes = |f: &Field| f.samples().iter().map(|v| v.is_nan()).collect::<Vec<_>>();
                    assert_eq!(holes(after.as_field().unwrap()), holes(&height));
                }
            }
        }
    }
}

/// On a plane, discharge is the rain uphill, and depth is Manning's (q n / √S)^(3/5), within 2 %.
#[test]
fn a_plane_runs_at_normal_depth() {
    let walls = Boundary { east: Edge::Open, ..Boundary::all(Edge::Wall) };
    let plane = field(World { boundary: walls, ..world(100, 3, 10.0) }, |x, _| 500.0 - 0.01 * x);
    let rain = Field::constant(*plane.window(), 100.0);
    let params = with_params(&NODE, "duration=14400, capacity=0, acceleration=0");
    let fields = [("height", &plane), ("rain", &rain)];
    let depth = output(&NODE, &params, &fields, "water");
    for i in [30, 50, 70, 90] {
        let q = 100.0 / 3.6e6 * 10.0 * (i as f64 + 0.5);
        let expected = libm::pow(q * 0.05 / 0.1, 0.6);
        let found = f64::from(depth.samples()[100 + i]);
        assert!((found / expected - 1.0).abs() < 0.02, "{i}: {found} {expected}");
    }
}
