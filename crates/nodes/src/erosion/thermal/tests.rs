//! Slides: closed forms, conservation and every kind of input.

use orograph_graph::{Boundary, Cancel, Edge, World};

use super::*;
use crate::testing::{at_every_level, field, outputs_and_warnings, outputs_until, run, run_in, with_params, world};

const REPOSE: f64 = 0.700_207_538_209_709_7; // tan 35°

fn rest(params: &ParamValues, height: &Field) -> [Field; 2] {
    ["height", "moved"].map(|output| run(&NODE, params, &[("height", height)], output))
}

fn defaults() -> ParamValues {
    ParamValues::defaults(&NODE.specs())
}

/// Steepest rise between any two of a cell's eight neighbours, in m/m.
fn steepest(field: &Field) -> f64 {
    let (nx, ny, d) = (field.window().nx(), field.window().ny(), field.window().cell_m());
    let z = |i: usize, j: usize| f64::from(field.samples()[j * nx + i]);
    let mut most = 0.0_f64;
    for j in 0..ny - 1 {
        for i in 0..nx - 1 {
            let diagonal = d * 2.0_f64.sqrt();
            most = most
                .max((z(i + 1, j) - z(i, j)).abs() / d)
                .max((z(i, j + 1) - z(i, j)).abs() / d)
                .max((z(i + 1, j + 1) - z(i, j)).abs() / diagonal)
                .max((z(i + 1, j) - z(i, j + 1)).abs() / diagonal);
        }
    }
    most
}

fn total(field: &Field) -> f64 {
    field.samples().iter().map(|&v| f64::from(v)).sum()
}

/// A step of 60 m becomes a straight ramp at repose, centred on the step, with nothing lost (Musgrave et al. 1989).
#[test]
fn a_step_becomes_a_ramp_at_repose() {
    let step = field(world(256, 128, 1.0), |x, _| if x < 128.0 { 60.0 } else { 0.0 });
    let [height, moved] = rest(&with_params(&NODE, "tolerance=0.0005"), &step);
    assert!(steepest(&height) <= REPOSE * 1.001, "{}", steepest(&height) / REPOSE);
    assert!((total(&height) / total(&step) - 1.0).abs() < 1e-6);
    let row = &height.samples()[64 * 256..65 * 256];
    assert!((f64::from(row[127] + row[128]) / 2.0 - 30.0).abs() < 0.05);
    // horizontal distance over which the middle of the ramp, extended, joins the two levels
    let slope = f64::from(row[118] - row[137]) / 19.0;
    assert!((30.0 / slope / 42.844_440_202_263_44 - 1.0).abs() < 0.01, "{}", 30.0 / slope);
    let first = (row.iter().position(|&z| z < 59.0).expect("the ramp") as f64) - 128.0;
    assert!((first + 41.416).abs() < 2.0, "{first}");
    assert_eq!(moved.samples()[64 * 256], 0.0);
}
/// Slopes along rows, columns and diagonals are within the tolerance on a scarp and on a cone of every direction;
/// 1e-5 is the rounding of heights of 250 m.
#[test]
fn no_direction_stays_steeper_than_repose() {
    let n = 128;
    for tolerance in [0.02, 0.004, 0.001] {
        let params = with_params(&NODE, &format!("tolerance={tolerance}"));
        for shape in [|x: f64, y: f64| x + y < 640.0, |x: f64, y: f64| libm::hypot(x - 320.0, y - 320.0) < 80.0] {
            let start = field(world(n, n, 5.0), |x, y| if shape(x, y) { 250.0 } else { 0.0 });
            let [rested, _] = rest(&params, &start);
            let steepest = steepest(&rested) / REPOSE;
            assert!(steepest <= 1.0 + tolerance + 1e-5, "{tolerance}: {steepest}");
        }
    }
}

/// A pillar becomes a cone as round as the grid can show, at repose, of the same volume.
#[test]
fn a_pillar_becomes_a_round_cone() {
    let n = 192;
    let pillar = field(world(n, n, 5.0), |x, y| if libm::hypot(x - 480.0, y - 480.0) < 100.0 { 250.0 } else { 0.0 });
    let [cone, _] = rest(&defaults(), &pillar);
    assert!((total(&cone) / total(&pillar) - 1.0).abs() < 1e-6);
    assert!(steepest(&cone) <= REPOSE * 1.02 + 1e-6);
    assert!(cone.range(0).expect("finite").0 > -1e-5);
    // radius of the 60 m contour at 32 azimuths, by bilinear interpolation
    let z = |x: f64, y: f64| {
        let (i, j) = ((x / 5.0 - 0.5) as usize, (y / 5.0 - 0.5) as usize);
        let (u, v) = (x / 5.0 - 0.5 - i as f64, y / 5.0 - 0.5 - j as f64);
        let at = |i: usize, j: usize| f64::from(cone.samples()[j * n as usize + i]);
        (at(i, j) * (1.0 - u) + at(i + 1, j) * u) * (1.0 - v) + (at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u) * v
    };
    let radii: Vec<f64> = (0..32)
        .map(|k| {
            let angle = std::f64::consts::TAU * f64::from(k) / 32.0;
            let along = |r: f64| z(480.0 + r * libm::cos(angle), 480.0 + r * libm::sin(angle));
            (0..4000).map(|step| f64::from(step) * 0.1).find(|&r| along(r) < 60.0).expect("the contour")
        })
        .collect();
    let (least, most) = radii.iter().fold((f64::MAX, 0.0_f64), |(a, b), &r| (a.min(r), b.max(r)));
    // one cell is 5 m of 135 m; flow over eight neighbours alone would give 8 %
    assert!(most / least < 1.015, "{least} to {most}");
}

#[test]
fn gentle_ground_keeps_its_bits() {
    let gentle = field(world(150, 131, 10.0), |x, y| 100.0 * libm::sin(x / 200.0) * libm::cos(y / 230.0) + 2000.1);
    let [height, moved] = rest(&defaults(), &gentle);
    assert_eq!(height, gentle);
    assert!(moved.samples().iter().all(|&d| d == 0.0));
}

#[test]
fn masked_ground_stays_and_the_rest_conserves() {
    let step = field(world(160, 160, 2.0), |x, y| if x + 0.3 * y < 200.0 { 80.0 } else { 0.0 });
    let mask = field(step.window().world, |_, y| if y < 150.0 { 1.0 } else { 0.0 });
    let height = run(&NODE, &defaults(), &[("height", &step), ("mask", &mask)], "height");
    for ((after, before), mask) in height.samples().iter().zip(step.samples()).zip(mask.samples()) {
        assert!(*mask > 0.0 || after == before);
    }
    assert_ne!(height, step);
    assert!((total(&height) / total(&step) - 1.0).abs() < 1e-6);
}

/// A wired angle applies per cell: the same cliff lies at 25° in sand and 50° in rock.
#[test]
fn the_angle_may_differ_from_place_to_place() {
    let step = field(world(128, 256, 1.0), |x, _| if x < 64.0 { 40.0 } else { 0.0 });
    let talus = field(step.window().world, |_, y| if y < 128.0 { 25.0 } else { 50.0 });
    let height = run(&NODE, &defaults(), &[("height", &step), ("talus", &talus)], "height");
    for (row, degrees) in [(30, 25.0_f64), (225, 50.0)] {
        let slope = f64::from(height.samples()[row * 128 + 60] - height.samples()[row * 128 + 67]) / 7.0;
        assert!((slope / libm::tan(degrees.to_radians()) - 1.0).abs() < 0.03, "{degrees}: {slope}");
    }
}

/// A 51° wall of rock becomes bare above the scree of its loose cover; volume is conserved, and only loose material
/// moves.
#[test]
fn loose_cover_slides_off_rock_that_stays() {
    let wall = field(world(160, 64, 5.0), |x, _| 10.0 + 1.25 * (x - 200.0).clamp(0.0, 200.0));
    let cover = field(wall.window().world, |x, _| if x > 250.0 && x < 400.0 { 6.0 } else { 0.0 });
    let rock = field(wall.window().world, |_, _| 75.0);
    let inputs = [("height", &wall), ("debris", &cover), ("rock", &rock)];
    let [height, moved, debris] = ["height", "moved", "debris"].map(|name| run(&NODE, &defaults(), &inputs, name));
    assert!((total(&debris) / total(&cover) - 1.0).abs() < 1e-6, "{}", total(&debris) / total(&cover) - 1.0);
    assert!((total(&height) / total(&wall) - 1.0).abs() < 1e-6);
    let row = 32 * 160..33 * 160;
    let (mut bare, mut scree) = (0, 0);
    for at in row {
        let rock = f64::from(wall.samples()[at] - cover.samples()[at]);
        let thickness = f64::from(debris.samples()[at]);
        assert!((f64::from(height.samples()[at]) - thickness - rock).abs() < 1e-4);
        assert!(thickness >= 0.0);
        let x = (at % 160) as f64 * 5.0;
        if (300.0..390.0).contains(&x) && thickness < 0.01 {
            bare += 1;
        } else if thickness > 1.0 {
            scree += 1;
            if x < 240.0 {
                // the toe is below repose, the scree above it at most at repose
                let slope = f64::from(height.samples()[at + 1] - height.samples()[at]) / 5.0;
                assert!(slope <= REPOSE * 1.03, "{x}: {slope}");
            }
        }
    }
    assert!(bare > 12 && scree > 12, "{bare} bare, {scree} scree");
    assert!(moved.range(0).is_some_and(|(lo, _)| lo >= -6.0));
}

/// A rock cliff without debris fails back to the angle of rock, and the debris has 1.3 times the volume of the lost
/// rock.
#[test]
fn rock_above_its_angle_becomes_debris() {
    let cliff = field(world(120, 64, 5.0), |x, _| if x > 300.0 { 200.0 } else { 0.0 });
    let none = field(cliff.window().world, |_, _| 0.0);
    let [height, debris] =
        ["height", "debris"].map(|name| run(&NODE, &defaults(), &[("height", &cliff), ("debris", &none)], name));
    let rock: Vec<f64> = height.samples().iter().zip(debris.samples()).map(|(h, r)| f64::from(h - r)).collect();
    let lost = total(&cliff) - rock.iter().sum::<f64>();
    assert!(lost > 0.0 && (total(&debris) / (1.3 * lost) - 1.0).abs() < 1e-5);
    // tan 60° over cells of 5 m from the foot upwards, and the rounding of 200 m in single precision
    for i in 60..120 {
        let expected = (f64::from(i - 59) * 5.0 * 3.0_f64.sqrt()).min(200.0);
        assert!((rock[32 * 120 + i as usize] - expected).abs() < 1e-3, "{i}");
    }
    let gentle = field(world(120, 64, 5.0), |x, y| 0.3 * x + 0.2 * y);
    let [same, still] =
        ["height", "debris"].map(|name| run(&NODE, &defaults(), &[("height", &gentle), ("debris", &none)], name));
    assert_eq!(same, gentle);
    assert!(still.samples().iter().all(|&r| r == 0.0));
}

/// With deep debris everywhere the result is the same as without layers; also in a periodic world and on any number
/// of threads.
#[test]
fn deep_debris_is_all_loose() {
    let hill = field(world(96, 80, 5.0), |x, y| if libm::hypot(x - 240.0, y - 200.0) < 60.0 { 150.0 } else { 0.0 });
    let deep = Field::new(*hill.window(), hill.samples().iter().map(|h| h + 100.0).collect());
    let inputs = [("height", &hill), ("debris", &deep)];
    let layered = run(&NODE, &defaults(), &inputs, "height");
    let single = run(&NODE, &defaults(), &[("height", &hill)], "height");
    assert!((total(&layered) / total(&hill) - 1.0).abs() < 1e-5);
    // both stop within 2 % of repose, and the toe may be one cell off: 5 % of the gains
    let rms = |other: &Field| {
        let squares = single.samples().iter().zip(other.samples()).map(|(a, b)| f64::from(a - b) * f64::from(a - b));
        squares.sum::<f64>().sqrt()
    };
    assert!(rms(&layered) < 0.05 * rms(&hill), "{} of {}", rms(&layered), rms(&hill));
    let (peak, expected) = (layered.range(0).expect("finite").1, single.range(0).expect("finite").1);
    assert!((peak / expected - 1.0).abs() < 0.02, "{peak} {expected}");
    assert_eq!(run_in(1, &NODE, &defaults(), &inputs), run_in(3, &NODE, &defaults(), &inputs));
}

/// In a periodic world, shifting the input by whole cells of the coarsest grid shifts the result.
#[test]
fn periodic_sides_are_joined() {
    let joined = World { boundary: Boundary::all(Edge::Periodic), ..world(256, 128, 4.0) };
    let block = |x0: f64, y0: f64| {
        field(joined, move |x, y| {
            let (x, y) = ((x - x0).rem_euclid(1024.0), (y - y0).rem_euclid(512.0));
            if x < 200.0 && y < 150.0 { 120.0 } else { 3.0 }
        })
    };
    let [inside, _] = rest(&defaults(), &block(300.0, 200.0));
    let [across, _] = rest(&defaults(), &block(300.0 - 512.0, 200.0 - 256.0));
    for (at, &z) in inside.samples().iter().enumerate() {
        let (i, j) = (at % 256, at / 256);
        assert_eq!(z, across.samples()[(j + 64) % 128 * 256 + (i + 128) % 256]);
    }
}

/// On a long slope, the excess over repose decays as `exp(-k t)`, and two runs equal one of twice the duration. A
/// duration of 0 changes nothing, and a long one reaches equilibrium.
#[test]
fn excess_decays_with_time() {
    let slope = |x: f64| 0.9 * (x - 120.0).clamp(0.0, 120.0);
    let wall = field(world(96, 8, 4.0), |x, _| slope(x));
    let after = |height: &Field, duration: f64| {
        let params = format!("until=duration, duration={duration}, relaxation=0.02, tolerance=0.004");
        rest(&with_params(&NODE, &params), height)[0].clone()
    };
    assert_eq!(after(&wall, 0.0), wall);
    for duration in [10.0, 50.0, 150.0] {
        let relaxed = after(&wall, duration);
        let middle = &relaxed.samples()[4 * 96 + 43..];
        let found = f64::from(middle[4] - middle[0]) / 16.0;
        let expected = REPOSE + (0.9 - REPOSE) * libm::exp(-0.02 * duration);
        assert!((found / expected - 1.0).abs() < 0.01, "{duration}: {found} {expected}");
        let (twice, once) = (after(&relaxed, duration), after(&wall, 2.0 * duration));
        // the rise between cells is 2.8 m at repose
        for (a, b) in twice.samples().iter().zip(once.samples()) {
            assert!((a - b).abs() < 0.3, "{duration}: {a} {b}");
        }
    }
    let [rested, _] = rest(&with_params(&NODE, "tolerance=0.004"), &wall);
    for (a, b) in after(&wall, 1e6).samples().iter().zip(rested.samples()) {
        assert_eq!(a, b);
    }
}

/// Single precision cannot resolve metres at a height of a million kilometres: a warning reports that slopes remain
/// above repose.
#[test]
fn land_that_cannot_rest_warns() {
    for (top, expected) in [(1e9, 1), (50.0, 0)] {
        let cliff = field(world(64, 64, 1.0), |x, _| if x < 32.0 { top } else { 0.0 });
        let told =
            outputs_and_warnings(&Cancel::default(), *cliff.window(), &NODE, &defaults(), &[("height", &cliff)]).1;
        assert_eq!(told.len(), expected, "{told:?}");
    }
}

#[test]
fn threads_and_simd_levels_give_the_same_bits() {
    let rough = field(world(300, 150, 10.0), |x, y| 400.0 * libm::sin(x / 80.0) * libm::cos(y / 60.0));
    let one = run_in(1, &NODE, &defaults(), &[("height", &rough)]);
    assert_eq!(one, run_in(4, &NODE, &defaults(), &[("height", &rough)]));
    at_every_level(|| run_in(2, &NODE, &defaults(), &[("height", &rough)]));
}

#[test]
fn any_land_comes_to_rest() {
    let hostile: [&dyn Fn(f64, f64) -> f64; 4] =
        [&|_, _| 7.0, &|x, _| 1e9 * x, &|x, y| if x > y { 1e30 } else { -1e30 }, &|x, _| {
            if x > 2.0 { f64::NAN } else { x }
        }];
    for (nx, ny) in [(1, 1), (1, 9), (9, 1), (2, 2), (67, 33)] {
        for land in hostile {
            let height = field(world(nx, ny, 1.0), land);
            for changes in ["tolerance=0.2", "until=duration, duration=100"] {
                let params = with_params(&NODE, changes);
                let [after, moved] = rest(&params, &height);
                assert!(moved.samples().iter().all(|d| d.is_finite()));
                let holes = |f: &Field| f.samples().iter().map(|v| v.is_nan()).collect::<Vec<_>>();
                assert_eq!(holes(&after), holes(&height));
            }
        }
    }
}

#[test]
fn a_cancelled_slide_stops() {
    let rough = field(world(64, 64, 10.0), |x, _| 100.0 * libm::sin(x));
    let cancel = Cancel::default();
    cancel.cancel();
    assert_eq!(
        outputs_until(&cancel, *rough.window(), &NODE, &defaults(), &[("height", &rough)]),
        Err(NodeError::Cancelled)
    );
}
