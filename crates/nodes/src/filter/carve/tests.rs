//! Tests of beds with closed forms.

use orograph_graph::{Boundary, Cancel, Edge, InputValue, Line, Lines, ParamValue, Value, Vertex, Warnings, World};

use super::*;
use crate::numerics::{along, math};
use crate::testing::{field, run as result, run_in, run_with, with_params, world};

/// Changes that keep a bed straight and its banks parallel.
const EVEN: &str = "curve=0,wander=0,widening=0,raggedness=0,detail=0";

fn along(points: &[[f64; 2]], changes: &str) -> ParamValues {
    let mut params = with_params(&NODE, &format!("{EVEN},{changes}"));
    params.set("path", ParamValue::Path(points.to_vec()));
    params
}

fn bed(land: &Field, points: &[[f64; 2]], changes: &str) -> Field {
    result(&NODE, &along(points, changes), &[("height", land)], "height")
}

fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// On level terrain the cross-section is the profile and the bank, on cells of any size.
#[test]
fn cross_sections_are_the_profile() {
    for cell_m in [10.0, 5.0] {
        let land = field(world((1000.0 / cell_m) as u32, (600.0 / cell_m) as u32, cell_m), |_, _| 200.0);
        for (profile, rise) in [("flat", 0_i32), ("round", 2), ("sharp", 1)] {
            let changes = format!("profile={profile},width=80,depth=30,bank=60");
            let found = bed(&land, &[[-500.0, 300.0], [1500.0, 300.0]], &changes);
            for (at, &found) in found.samples().iter().enumerate() {
                let [_, y] = land.window().centre_m(at % land.window().nx(), at / land.window().nx());
                let d = (y - 300.0).abs();
                let x = (d / 40.0).min(1.0);
                let bottom = 170.0 + if rise == 0 { 0.0 } else { 30.0 * if rise == 1 { x } else { x * x } };
                let away = smooth((d - 40.0) / 60.0);
                let expected = bottom * (1.0 - away) + 200.0 * away;
                assert!((f64::from(found) - expected).abs() < 1e-4, "{profile} {d}: {found} {expected}");
                assert!(d < 100.0 || found == 200.0);
            }
        }
    }
}

/// Banks are nearly as rough as the terrain around them, the bed is smoother, and neither is moved on the whole.
#[test]
fn banks_keep_the_roughness_of_the_terrain() {
    let bumps = |x: f64, y: f64| 3.0 * (math::sin(0.31 * x + 0.11 * y) + math::cos(0.17 * x - 0.29 * y));
    let land = field(world(200, 160, 5.0), bumps);
    let path = [[-500.0, 400.0], [1500.0, 400.0]];
    let of = |detail: &str| bed(&land, &path, &format!("mode=grade,width=100,depth=40,bank=150,detail={detail}"));
    let (smooth, rough) = (of("0"), of("1"));
    // how far cells stand out from their neighbours, in rows so far from the line
    let roughness = |field: &Field, [from, to]: [f64; 2]| {
        let rows = (1..159).filter(|j| (from..to).contains(&(5.0 * (f64::from(*j as u32) + 0.5) - 400.0).abs()));
        let cells: Vec<usize> = rows.flat_map(|j| (1..199).map(move |i| j * 200 + i)).collect();
        let out = |at: &usize| {
            let h = |at: usize| f64::from(field.samples()[at]);
            h(*at) - 0.25 * (h(at - 1) + h(at + 1) + h(at - 200) + h(at + 200))
        };
        (cells.iter().map(|at| out(at) * out(at)).sum::<f64>() / cells.len() as f64).sqrt()
    };
    let all = roughness(&land, [250.0, 390.0]);
    assert!(roughness(&smooth, [60.0, 110.0]) < 0.35 * all);
    assert!((0.8..1.1).contains(&(roughness(&rough, [110.0, 190.0]) / all)));
    // and the curve of the bed
    assert!(roughness(&rough, [0.0, 30.0]) < 0.25 * all);
    let moved = smooth.samples().iter().zip(rough.samples()).map(|(a, b)| f64::from(b - a));
    assert!((moved.sum::<f64>() / 32_000.0).abs() < 0.3);
}

/// With the roughness of the terrain, no cell of the middle of a bed rises above the one before it.
#[test]
fn water_still_runs_in_a_rough_bed() {
    let bumps =
        |x: f64, y: f64| 300.0 - 0.02 * x + 10.0 * (math::sin(0.06 * x + 0.02 * y) + math::cos(0.03 * x - 0.05 * y));
    let land = field(world(200, 80, 5.0), bumps);
    let path = [[-500.0, 202.5], [1500.0, 202.5]];
    let found = bed(&land, &path, "width=60,depth=20,bank=150,detail=1,raggedness=0.6");
    let row = &found.samples()[40 * 200..][..200];
    assert!(row.windows(2).all(|pair| pair[1] <= pair[0]), "{row:?}");
    let crest = bed(&land, &path, "mode=fill,course=straight,width=40,depth=-60,profile=flat,bank=80,detail=1");
    let row = &crest.samples()[40 * 200..][..200];
    let bend = row.windows(3).map(|at| (at[0] - 2.0 * at[1] + at[2]).abs()).fold(0.0, f32::max);
    assert!(bend < 1e-3, "{bend}");
}

/// The bed never rises downstream, over hills and hollows, and the terrain is never raised.
#[test]
fn a_bed_runs_downhill() {
    let land =
        field(world(120, 60, 10.0), |x, y| 300.0 - 0.1 * x + 40.0 * libm::sin(x * 0.02) + 10.0 * libm::cos(y * 0.05));
    let path = [[100.0, 300.0], [600.0, 320.0], [1150.0, 250.0]];
    let found = bed(&land, &path, "width=60,depth=15,bank=80,easing=100");
    let params = Params::read(&along(&path, "width=60,depth=15,bank=80,easing=100"));
    let places = Way::of_path(&params, &land, 0).places;
    assert!(places.windows(2).all(|pair| pair[1].elevation_m <= pair[0].elevation_m));
    assert!(found.samples().iter().zip(land.samples()).all(|(after, before)| after <= before));
    for place in &places[5..places.len() - 5] {
        let [i, j] = place.at_m.map(|metres| (metres / 10.0) as usize);
        let found = f64::from(found.samples()[j * 120 + i]);
        // the cell's centre is up to 7 m away, where the parabola is 0.8 m higher and the bed, at a slope of 0.9, up to
        // 6.3 m
        assert!(found < place.elevation_m + 7.1, "{:?}: {found} {}", place.at_m, place.elevation_m);
    }
    let straight = bed(&land, &path, "course=straight,mode=grade,profile=flat,width=60,depth=0,easing=0");
    let ends = [[100, 300], [1140, 250]].map(|[x, y]| straight.samples()[y / 10 * 120 + x / 10]);
    let middle = straight.samples()[32 * 120 + 60];
    let share = 500.4 / (500.4 + libm::hypot(550.0, 70.0)) as f32;
    assert!((middle - (ends[0] * (1.0 - share) + ends[1] * share)).abs() < 2.0, "{ends:?} {middle}");
}

#[test]
fn dams_fill_and_roads_do_both() {
    let land = field(world(100, 60, 10.0), |x, _| if x < 500.0 { 0.0 } else { 100.0 });
    let path = [[50.0, 305.0], [950.0, 305.0]];
    for (mode, before, behind) in [("carve", 0.0, 50.6), ("fill", 49.4, 100.0), ("grade", 49.4, 50.6)] {
        let changes = format!("mode={mode},course=straight,profile=flat,width=60,depth=0,bank=0,easing=0");
        let found = bed(&land, &path, &changes);
        let row = &found.samples()[30 * 100..31 * 100];
        assert!((row[49] - before).abs() < 0.1 && (row[50] - behind).abs() < 0.1, "{mode} {} {}", row[49], row[50]);
        assert_eq!(found.samples()[10 * 100 + 20], 0.0);
    }
}

#[test]
fn nothing_changes_without_a_width_or_a_mask_or_far_away() {
    let land = field(world(40, 30, 5.0), |x, y| 900.0 * libm::sin(x * y));
    let path = [[10.0, 20.0], [150.0, 90.0]];
    assert_eq!(bed(&land, &path, "width=0"), land);
    assert_eq!(bed(&land, &[[1e6, 1e6], [1e7, -1e7]], ""), land);
    let nowhere = field(land.window().world, |_, _| 0.0);
    let fields = [("height", &land), ("mask", &nowhere)];
    assert_eq!(result(&NODE, &along(&path, ""), &fields, "height"), land);
    let params = along(&path, "width=20,bank=10");
    assert_eq!(run_in(1, &NODE, &params, &[("height", &land)]), run_in(3, &NODE, &params, &[("height", &land)]));
}

/// Lines keep their own widths, depths and elevations; in a periodic world they continue across its sides.
#[test]
fn lines_are_carved_as_they_are() {
    let periodic = World { boundary: Boundary::all(Edge::Periodic), ..world(60, 40, 10.0) };
    let land = field(periodic, |_, _| 100.0);
    let vertex = |x: f64, elevation_m: f64| Vertex {
        position_m: [x, 205.0],
        elevation_m,
        width_m: 50.0,
        depth_m: 8.0,
        ..Vertex::default()
    };
    let line = |vertices: Vec<Vertex>| Line { order: 1, downstream: None, vertices };
    let lines = Lines::open(vec![line(vec![vertex(400.0, 100.0), vertex(700.0, 85.0)])]);
    let params = with_params(&NODE, "profile=flat,width=20,depth=5,bank=20,raggedness=0");
    let job = Job {
        node: &NODE,
        params: &params,
        inputs: vec![
            InputValue::Value(Value::Field(land.clone())),
            InputValue::Value(lines.into()),
            InputValue::Constant(1.0),
        ],
        window: *land.window(),
        wanted: orograph_graph::Wanted::ALL,
        folder: std::path::PathBuf::new(),
        cancel: Cancel::default(),
        progress: &|_| (),
        level: orograph_graph::LevelJob::default(),
        warnings: Warnings::default(),
        glimpses: None,
    };
    let found = run(&job).expect("a result").take("height").expect("heights");
    let found = found.as_field().expect("a field");
    let at = |i: usize, j: usize| found.samples()[j * 60 + i];
    for (i, x) in [(42_usize, 425.0_f32), (55, 555.0), (3, 635.0)] {
        let expected = 100.0 - (x - 400.0) / 20.0 - 8.0;
        assert!(
            (at(i, 20) - expected).abs() < 0.3 && (at(i, 22) - expected).abs() < 0.3,
            "{x}: {} {expected}",
            at(i, 20)
        );
        assert_eq!(at(i, 26), 100.0);
    }
    assert_eq!(at(25, 20), 100.0);
}

/// A line without elevations is carved like a path through the same points, whose `path` is not used; a line that is
/// wider than `width` has its own width.
#[test]
fn draped_lines_follow_the_terrain() {
    let land = field(world(80, 60, 10.0), |x, y| 100.0 + 20.0 * libm::sin(x / 90.0) + y / 15.0);
    let points = [[50.0, 80.0], [400.0, 300.0], [750.0, 500.0]];
    let carved = |width_m: f64, changes: &str| {
        let vertex = |position_m: [f64; 2]| Vertex { position_m, width_m, ..Vertex::default() };
        let line = Line { order: 1, downstream: None, vertices: points.map(vertex).to_vec() };
        let lines = Lines { draped: true, ..Lines::open(vec![line]) };
        let value = |name: &str| match name {
            "height" => Some(Value::Field(land.clone())),
            "lines" => Some(lines.clone().into()),
            _ => None,
        };
        let params = with_params(&NODE, changes);
        let wanted = orograph_graph::Wanted::ALL;
        let (outputs, _) = run_with(wanted, &Cancel::default(), *land.window(), &NODE, &params, &value);
        outputs.expect("a result").take("height").expect("heights").as_field().expect("a field").clone()
    };
    let even = "curve=0,wander=0,widening=0,raggedness=0,detail=0,course=land,depth=8,bank=30";
    let path = bed(&land, &points, &format!("{even},width=60"));
    assert_eq!(carved(60.0, &format!("{even},width=20")), path);
    assert_eq!(carved(20.0, &format!("{even},width=60")), path);
    assert_ne!(path, land);
}

/// A winding path keeps its ends, has no corners, is longer than its points are apart, and stays within its bound.
#[test]
fn a_course_winds_without_corners() {
    let points = [[0.0, 0.0], [4000.0, 3000.0], [8000.0, 0.0]];
    let params = Params::read(&along(&points, "curve=1,wander=0.6,width=100,bank=200"));
    let line = course::course(&params, 5);
    assert_eq!((line[0], line[line.len() - 1]), (points[0], points[2]));
    let long: f64 = line.windows(2).map(|pair| along::distance(pair[0], pair[1])).sum();
    // real rivers: 1.2 to 1.4 with their bends of all sizes
    assert!((1.03..1.6).contains(&(long / 10_000.0)), "{long}");
    let turn = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        let heading = |a: [f64; 2], b: [f64; 2]| libm::atan2(b[1] - a[1], b[0] - a[0]);
        libm::remainder(heading(b, c) - heading(a, b), std::f64::consts::TAU).abs().to_degrees()
    };
    let sharpest = line.windows(3).map(|p| turn(p[0], p[1], p[2])).fold(0.0, f64::max);
    assert!(sharpest < 35.0, "{sharpest}");
    assert_ne!(line, course::course(&params, 6));
    let straight = Params::read(&along(&points, ""));
    assert_eq!(course::course(&straight, 5), points);
    let doubled = Params::read(&along(&[[0.0, 0.0], [0.0, 0.0], [50.0, 0.0], [50.0, 0.0]], "curve=1,wander=1"));
    assert!(course::course(&doubled, 1).iter().flatten().all(|part| part.is_finite()));
    let nowhere = field(world(40, 30, 5.0), |x, _| x);
    assert!(bed(&nowhere, &[[9.0, 9.0], [9.0, 9.0]], "curve=1,wander=1").samples().iter().all(|h| h.is_finite()));
}

/// The bed of a stream is five times as wide at its end as at its start if 0.8 of its width is gained on the way, and
/// its banks are not parallel: their width varies along each side by at least a tenth.
#[test]
fn a_bed_widens_and_its_banks_vary() {
    let land = field(world(400, 100, 20.0), |_, _| 500.0);
    let path = [[100.0, 1000.0], [7900.0, 1000.0]];
    let changes = "profile=flat,width=400,depth=50,bank=200,widening=0.8,raggedness=0";
    let mask = |changes: &str| result(&NODE, &along(&path, changes), &[("height", &land)], "bed");
    let widths = |mask: &Field, least: f32| -> Vec<f64> {
        let wide = |i: usize| (0..100).filter(|j| mask.samples()[j * 400 + i] >= least).count();
        (0..400).map(|i| 20.0 * wide(i) as f64).collect()
    };
    let even = widths(&mask(changes), 1.0);
    for (i, share) in [(50, 0.118_f64), (200, 0.503), (380, 0.964)] {
        let expected = 400.0 * (0.2 + 0.8 * libm::pow(share, 0.85));
        assert!((even[i] - expected).abs() <= 40.0, "{i}: {} {expected}", even[i]);
    }
    let ragged = widths(&mask("profile=flat,width=400,depth=50,bank=200,raggedness=0.6"), 0.5);
    let middle = &ragged[50..350];
    let mean = middle.iter().sum::<f64>() / 300.0;
    let spread = (middle.iter().map(|w| (w - mean) * (w - mean)).sum::<f64>() / 300.0).sqrt();
    // 400 m of bed and 100 m of each bank, up to where it is half
    assert!((mean - 600.0).abs() < 80.0 && spread > 20.0, "{mean} {spread}");
    crate::testing::at_every_level(|| mask("wander=1,curve=1,widening=0.5,raggedness=1"));
}
