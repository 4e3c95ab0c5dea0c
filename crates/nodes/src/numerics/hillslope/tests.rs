//! Tests of creep: closed forms, a plain reference, bounds, and land at the edge of sense.

use orograph_graph::{Boundary, Edge, World, mix};

use super::{Hillslope, reference};
use crate::{erosion::creep::NODE, numerics::math, prelude::*, testing};

fn white(x: f64, y: f64) -> f64 {
    f64::from(mix((x * 8.0) as u32 ^ mix((y * 8.0) as u32))) / 4_294_967_296.0
}

fn walled(nx: u32, ny: u32, cell_m: f64) -> World {
    World { boundary: Boundary::all(Edge::Wall), ..testing::world(nx, ny, cell_m) }
}

/// Height and what has moved, with a diffusivity everywhere.
fn creep(height: &Field, diffusivity: f64, changes: &str) -> [Vec<f32>; 2] {
    let diffusivity = Field::constant(*height.window(), diffusivity as f32);
    creep_where(height, &diffusivity, changes)
}

fn creep_where(height: &Field, diffusivity: &Field, changes: &str) -> [Vec<f32>; 2] {
    let fields = [("height", height), ("diffusivity", diffusivity)];
    let params = testing::with_params(&NODE, changes);
    ["height", "moved"].map(|output| testing::run(&NODE, &params, &fields, output).into_samples())
}

fn total(samples: &[f32]) -> f64 {
    samples.iter().map(|&h| f64::from(h)).sum()
}

/// One step of the engine, with a map of channels: `[height, lost]`.
fn step(height: &Field, channel: &Field, diffusivity: f64, critical: f64, duration: f64) -> [Vec<f64>; 2] {
    inputs! {
        /// Terrain height.
        height: Height;
        /// The coefficient of creep.
        diffusivity: Scalar(SquareMetresPerYear) = 0.01, 0.0..=1e3;
        /// Channels.
        channel: Mask = 1.0, 0.0..=1.0;
    }
    static STEP: Node = Node {
        id: "Step",
        inputs: Inputs::PORTS,
        params: NODE.params,
        cpu: |job| {
            let Inputs { height, diffusivity, channel } = Inputs::read(job)?;
            let slope = Hillslope::new(&job.window(), diffusivity, job.params.read("critical_slope"));
            let mut heights: Vec<f64> = height.samples().iter().map(|&h| f64::from(h)).collect();
            let mut lost = vec![0.0; heights.len()];
            let is_channel = |cell: usize| channel.at(cell) > 0.5;
            slope.creep(job, &mut heights, job.params.read("duration"), 0..1, &is_channel, Some(&mut lost))?;
            // Samples are single precision: the rest of each beside it.
            let parts = |values: Vec<f64>| {
                let high: Vec<f32> = values.iter().map(|&v| v as f32).collect();
                let low = values.iter().zip(&high).map(|(v, &h)| (v - f64::from(h)) as f32).collect();
                [Field::new(job.window(), high), Field::new(job.window(), low)]
            };
            let ([a, b], [c, d]) = (parts(heights), parts(lost));
            Ok(Outputs::one("height", a).with("height_rest", b).with("lost", c).with("lost_rest", d))
        },
        ..Node::DEFAULT
    };
    let params = testing::with_params(&NODE, &format!("critical_slope={critical},duration={duration}"));
    let diffusivity = Field::constant(*height.window(), diffusivity as f32);
    let fields = [("height", height), ("diffusivity", &diffusivity), ("channel", channel)];
    let mut found = testing::outputs(&STEP, &params, &fields).expect("a result");
    let mut take =
        |name: &str| found.take(name).expect("an output").as_field().expect("a field").clone().into_samples();
    [["height", "height_rest"], ["lost", "lost_rest"]]
        .map(|[high, low]| take(high).iter().zip(take(low)).map(|(&h, l)| f64::from(h) + f64::from(l)).collect())
}

/// A wave of wavenumber k fades as exp(−D k² t), along rows, columns and between.
#[test]
fn a_cosine_fades_at_its_rate() {
    let world = World { boundary: Boundary::all(Edge::Periodic), ..testing::world(64, 64, 10.0) };
    let wave = |x: f64, y: f64, [a, b]: [f64; 2]| math::cos(std::f64::consts::TAU * (a * x + b * y) / 640.0);
    for along in [[1.0, 0.0], [0.0, 1.0], [1.0, 2.0]] {
        let height = testing::field(world, |x, y| 100.0 * wave(x, y, along));
        let k = std::f64::consts::TAU * math::hypot(along[0], along[1]) / 640.0;
        for exponent in [0.1, 0.5, 1.0] {
            let duration = exponent / (0.01 * k * k);
            let [after, _] = creep(&height, 0.01, &format!("duration={duration}"));
            let amplitude = after.iter().zip(height.samples()).map(|(a, b)| f64::from(a * b)).sum::<f64>()
                / height.samples().iter().map(|&b| f64::from(b * b)).sum::<f64>();
            let expected = math::exp(-exponent);
            // 1 %: the errors of 64 steps and of 29 cells to a wave.
            assert!((amplitude / expected - 1.0).abs() < 0.01, "{along:?} {exponent}: {amplitude} {expected}");
        }
    }
}

/// Z = Q / (4πDt) exp(−r² / (4Dt)) spreads as it should, stays round, and keeps its volume.
#[test]
fn a_hill_spreads_as_heat() {
    let hill = |x: f64, y: f64, t: f64| {
        let (x, y) = (x - 505.0, y - 505.0);
        1e5 / (4.0 * std::f64::consts::PI * 0.01 * t) * math::exp(-(x * x + y * y) / (0.04 * t))
    };
    let world = walled(101, 101, 10.0);
    let height = testing::field(world, |x, y| hill(x, y, 2e5));
    let [after, moved] = creep(&height, 0.01, "duration=1e5");
    let exact = testing::field(world, |x, y| hill(x, y, 3e5));
    let errors = || after.iter().zip(exact.samples()).map(|(a, b)| f64::from(a - b) / 2.652_582_384_864_922);
    // An explicit solution with 100 steps has errors of 3e-4 and 3e-5.
    assert!(errors().fold(0.0, |most: f64, e| most.max(e.abs())) < 5e-5);
    assert!((errors().map(|e| e * e).sum::<f64>() / 10_201.0).sqrt() < 5e-6);
    // Single precision.
    assert!((total(&after) / total(height.samples()) - 1.0).abs() < 1e-6 && total(&moved).abs() < 1e-2);
}

/// A point of a step much longer than the cells allow an explicit one is round to 1 % at half its height.
#[test]
fn a_point_spreads_in_circles() {
    for spread in [10.0_f64, 100.0] {
        let height = testing::field(walled(201, 201, 1.0), |x, y| if x == 100.5 && y == 100.5 { 1e4 } else { 0.0 });
        let [after, _] = creep(&height, 0.01, &format!("duration={}", spread * 100.0));
        let at = |x: usize, y: usize| f64::from(after[y * 201 + x]);
        let radius = (2.0 * spread).sqrt();
        // Along a row, and between rows and columns, one standard deviation away.
        let straight = at(100, 100) * math::exp(-0.5);
        let (along, between) = (interpolate(&|r| at(100 + r, 100), radius), {
            let diagonal = radius / 2.0_f64.sqrt();
            interpolate(&|r| at(100 + r, 100 + r), diagonal)
        });
        // 3 %: 32 cells² need 64 steps; beyond, the errors of longer ones.
        assert!((along / straight - 1.0).abs() < 0.03, "{spread}: {along} {straight}");
        assert!((between / along - 1.0).abs() < 0.01, "{spread}: {between} {along}");
    }
}

/// Between whole numbers, along a parabola of the logarithm.
fn interpolate(at: &dyn Fn(usize) -> f64, r: f64) -> f64 {
    let (low, share) = (r as usize, r.fract());
    let (a, b) = (math::ln(at(low)), math::ln(at(low + 1)));
    let bend = math::ln(at(low + 2)) - 2.0 * b + a;
    math::exp(a + (b - a) * share - 0.5 * bend * share * (1.0 - share))
}

#[test]
fn it_is_the_plain_reference() {
    let world = walled(24, 20, 10.0);
    let height = testing::field(world, |x, y| 30.0 * math::sin(x / 40.0) * math::cos(y / 30.0) + 10.0 * white(x, y));
    let diffusivity = testing::field(world, |x, y| if x < 80.0 && y > 60.0 { 0.0 } else { 0.005 + 1e-4 * x });
    let start: Vec<f64> = height.samples().iter().map(|&h| f64::from(h)).collect();
    for (critical, duration, within) in [(0.0, 2e4, 0.01), (0.0, 1e5, 0.005), (1.2, 2e4, 0.02), (0.8, 1e5, 0.01)] {
        let d = |cell: usize| f64::from(diffusivity.samples()[cell]);
        let expected = reference::creep(24, 10.0, &start, d, critical, duration, |_| false);
        let [after, _] = creep_where(&height, &diffusivity, &format!("critical_slope={critical},duration={duration}"));
        let worst = after.iter().zip(&expected).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
        let moved = start.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // As a share of the largest change: waves of two cells fade differently, and few steps are made.
        assert!(worst < within * moved, "{critical} {duration}: {worst} of {moved}");
    }
}

/// However long the step, nothing rises above or sinks below what is around it, and nothing is lost.
#[test]
fn no_step_overshoots_or_loses() {
    let sides = [Edge::Base, Edge::Open, Edge::Wall, Edge::Periodic];
    for (case, (nx, ny)) in [(33, 40), (16, 5), (1, 9), (9, 1), (2, 2), (50, 3), (1, 1)].into_iter().enumerate() {
        for side in sides {
            let world = World { boundary: Boundary::all(side), ..testing::world(nx, ny, 10.0) };
            let height = testing::field(world, |x, y| 300.0 * white(x + case as f64, y) - 100.0);
            let (low, high) = height.range(0).expect("heights");
            for (seed, share) in [(0.0, 0.0), (7.0, 0.1), (9.0, 0.5)] {
                let channel = testing::field(world, |x, y| if white(x + seed, y) < share { 1.0 } else { 0.0 });
                for spread in [0.01, 1.0, 100.0, 1e5] {
                    for critical in [0.0, 1.2] {
                        let [after, lost] = step(&height, &channel, 0.01, critical, spread * 1e4);
                        let start = height.samples().iter().map(|&h| f64::from(h));
                        let budget = after.iter().zip(start).zip(&lost).map(|((a, b), l)| a - b + l).sum::<f64>();
                        // 1e-8: sums of numbers below 300 in double precision, times what each metre passes on.
                        assert!(
                            budget.abs() < 1e-8 * spread.max(1.0) * after.len() as f64,
                            "{nx}x{ny} {side:?} {spread}: {budget}"
                        );
                        for (cell, &a) in after.iter().enumerate() {
                            assert!(
                                a >= f64::from(low) - 1e-6 && a <= f64::from(high) + 1e-6,
                                "{nx}x{ny} {spread}: {a}"
                            );
                            let kept = channel.samples()[cell] > 0.5;
                            assert!(!kept || lost[cell] > -1e-6 || side == Edge::Base, "{}", lost[cell]);
                        }
                    }
                }
            }
        }
    }
}

/// Slopes stay straight at the critical slope however much comes down.
#[test]
fn steep_land_becomes_straight() {
    let boundary = Boundary { east: Edge::Base, ..Boundary::all(Edge::Wall) };
    let world = World { boundary, ..testing::world(64, 3, 5.0) };
    let height = testing::field(world, |x, _| if x < 200.0 { 150.0 } else { 0.0 });
    let [after, _] = creep(&height, 0.01, "duration=1e6,critical_slope=1.2");
    let slopes: Vec<f32> = (0..63).map(|x| (after[64 + x] - after[65 + x]) / 5.0).collect();
    // Falls all the way, without ripples.
    assert!(slopes.iter().all(|&slope| (-1e-4..1.2).contains(&slope)), "{slopes:?}");
    let bends = slopes.windows(3).filter(|s| s[1] < s[0].min(s[2]) - 1e-3 || s[1] > s[0].max(s[2]) + 1e-3).count();
    assert!(bends <= 1, "{slopes:?}");
}

/// Between two rivers a hill that rises is a parabola, at every size of the cells: rivers take what comes without
/// rising.
#[test]
fn rivers_take_what_creeps_into_them() {
    for cells in [33, 65, 129] {
        let cell_m = 100.0 / f64::from(cells - 1);
        let world = walled(cells, 3, cell_m);
        // One step of 1000 yr from the parabola lifted by 1000 yr of uplift gives the parabola back.
        let parabola = |x: f64| 1e-4 / 0.02 * (50.0 * 50.0 - (x - 50.0 - 0.5 * cell_m) * (x - 50.0 - 0.5 * cell_m));
        let at_river = |x: f64| (x - 50.0 - 0.5 * cell_m).abs() > 50.0 - 0.1 * cell_m;
        let river = testing::field(world, |x, _| f64::from(u8::from(at_river(x))));
        let height = testing::field(world, |x, _| if at_river(x) { 0.0 } else { parabola(x) + 0.1 });
        let [after, lost] = step(&height, &river, 0.01, 0.0, 1e3);
        for i in 0..cells as usize {
            let x = (i as f64 + 0.5) * cell_m;
            let expected = if at_river(x) { 0.0 } else { parabola(x) };
            // 0.01 m of the 0.1 m that rose: the step begins with all of the rise in place.
            assert!(
                (after[cells as usize + i] - expected).abs() < 0.03,
                "{cells} {i}: {} {expected}",
                after[cells as usize + i]
            );
        }
        // A river gets half of what rises, over a cell: 50 m of 0.1 m, but for half a cell at each end.
        let got = lost[cells as usize] * cell_m;
        assert!((got / (0.1 * (50.0 - 0.5 * cell_m)) - 1.0).abs() < 0.05, "{cells}: {got}");
    }
}

#[test]
fn no_time_or_no_mobility_keeps_all_bits() {
    let height = testing::field(testing::world(40, 30, 10.0), |x, y| 1000.0 * white(x, y));
    for (diffusivity, changes) in [(0.01, "duration=0"), (0.0, "duration=1e6"), (-1.0, "duration=1e6,critical_slope=1")]
    {
        let [after, moved] = creep(&height, diffusivity, changes);
        assert!(after == height.samples() && moved.iter().all(|&m| m == 0.0));
    }
}

#[test]
fn holes_stay_and_hold_nothing_up() {
    let height = testing::field(walled(40, 40, 10.0), |x, y| match (x as u32 / 10, y as u32 / 10) {
        (5, 7) => f64::NAN,
        (20..23, 20..23) => 1e30,
        _ => 50.0 * white(x, y),
    });
    for changes in ["duration=1e5", "duration=1e5,critical_slope=1"] {
        let [after, moved] = creep(&height, 0.01, changes);
        for ((a, b), m) in after.iter().zip(height.samples()).zip(&moved) {
            assert!(if b.abs() < 100.0 { (0.0..=50.0).contains(a) } else { a.to_bits() == b.to_bits() });
            assert!(m.abs() < 50.0);
        }
        assert!(total(&moved).abs() < 1e-3);
    }
    let uneven =
        testing::field(height.window().world, |x, _| [f64::NAN, f64::INFINITY, -1.0, 1e30][x as usize / 10 % 4]);
    let [after, _] = creep_where(&height, &uneven, "duration=1e9");
    assert!(after.iter().zip(height.samples()).all(|(a, b)| a.is_finite() || a.to_bits() == b.to_bits()));
}

#[test]
fn threads_and_simd_levels_give_the_same_bits() {
    let height = testing::field(testing::world(70, 90, 10.0), |x, y| 100.0 * white(x, y));
    let diffusivity = testing::field(height.window().world, |x, _| 1e-4 * x);
    let fields = [("height", &height), ("diffusivity", &diffusivity)];
    for critical in [0.0, 1.0] {
        let params = testing::with_params(&NODE, &format!("critical_slope={critical}"));
        assert!(testing::run_in(1, &NODE, &params, &fields) == testing::run_in(5, &NODE, &params, &fields));
        testing::at_every_level(|| testing::outputs(&NODE, &params, &fields));
    }
}

#[test]
fn it_can_be_cancelled() {
    let cancel = orograph_graph::Cancel::default();
    cancel.cancel();
    let height = testing::field(testing::world(20, 20, 10.0), white);
    let params = ParamValues::defaults(&NODE.specs());
    let found = testing::outputs_until(&cancel, *height.window(), &NODE, &params, &[("height", &height)]);
    assert_eq!(found, Err(NodeError::Cancelled));
}

/// Ground of one diffusivity, whose lines share the ratios of their solution, gives the bits of a map of it.
#[test]
fn even_ground_gives_the_bits_of_a_map() {
    for side in [Edge::Wall, Edge::Base, Edge::Open, Edge::Periodic] {
        for (nx, ny) in [(70, 48), (32, 33), (2, 16), (1, 9)] {
            let world = World { boundary: Boundary::all(side), ..testing::world(nx, ny, 10.0) };
            let height = testing::field(world, |x, y| 300.0 * white(x, y) - 100.0);
            let map = Field::new(*height.window(), vec![0.01; height.samples().len()]);
            for changes in ["duration=1e3", "duration=1e6"] {
                let params = testing::with_params(&NODE, changes);
                let even = ["height", "moved"]
                    .map(|output| testing::run(&NODE, &params, &[("height", &height)], output).into_samples());
                let mapped = creep_where(&height, &map, changes);
                let mut pairs = even.iter().flatten().zip(mapped.iter().flatten());
                assert!(pairs.all(|(a, b)| a.to_bits() == b.to_bits()), "{side:?} {nx}x{ny} {changes}");
            }
        }
    }
}
