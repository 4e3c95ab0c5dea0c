//! Where debris goes.

use super::{super::runout::reach, *};

/// A slope of 42° above a plain of 3°.
fn slope_above_a_plain() -> Field {
    let world = World { boundary: Boundary::all(Edge::Wall), ..testing::world(600, 300, 10.0) };
    testing::field(world, |x, _| 0.9 * (1500.0 - x).max(0.0) + 0.05 * (6000.0 - x).min(4500.0))
}

/// A deposit covers `spread` V^(2/3) if nothing else stops it, and has no spikes.
#[test]
fn deposits_cover_the_published_area() {
    let slope = slope_above_a_plain();
    for spread in [20.0, 60.0] {
        // one slide
        let changes = format!("rate=0.4,duration=1e3,smallest=400,largest=401,cohesion=0,reach=0,spread={spread}");
        let found = slide(&changes, &[("height", &slope)]);
        let count = found.slides();
        let volume = 1.25 * found.rock() / count;
        let covered = found.deposit.iter().filter(|deposit| **deposit > 0.05).count() as f64 * 100.0 / count;
        let expected = spread * math::pow(volume, 2.0 / 3.0);
        let most = found.deposit.iter().fold(0.0_f32, |most, deposit| most.max(*deposit));
        let sheet = math::pow(volume, 1.0 / 3.0) / spread;
        assert!(count > 0.0 && (0.5..2.0).contains(&(covered / expected)), "{covered} of {expected}");
        assert!(f64::from(most) < 6.0 * sheet, "{most} m of {sheet} m");
        assert!(found.column("runouts", false).iter().any(|runout| *runout > 1000.0));
    }
}

/// Slides onto a plain fall 0.9 V^(-0.085) times their runout, as Corominas (1996) finds.
#[test]
fn slides_stop_at_the_angle_of_reach() {
    assert!((reach(0.9, 1e6) - 0.9 * math::exp(-0.085 * math::ln(1e6))).abs() < 1e-12);
    assert_eq!([reach(0.9, 1.0), reach(0.9, 0.0), reach(0.0, 1e6)], [0.9, 0.9, 0.0]);
    let slope = slope_above_a_plain();
    let run =
        |changes: &str| slide(&format!("rate=4,duration=4e3,smallest=100,cohesion=0,{changes}"), &[("height", &slope)]);
    // slides that are not stopped by the angle of reach are stopped by their area, and fall more
    for (of_one, most) in [(0.9, 2.5), (1.4, 1.3)] {
        let found = run(&format!("reach={of_one}"));
        let [runouts, drops] = [false, true].map(|of_y| found.column("runouts", of_y));
        let mut ratios: Vec<f64> = (0..runouts.len())
            .map(|event| drops[event] / runouts[event] / reach(of_one, 1.25 * found.column("sizes", true)[event]))
            .collect();
        ratios.sort_unstable_by(f64::total_cmp);
        let [low, median, high] = [0.1, 0.5, 0.9].map(|part| ratios[(part * ratios.len() as f64) as usize]);
        assert!(ratios.len() > 40 && low > 0.75 && (0.9..most).contains(&median), "{low} {median} {high}");
    }
}

/// Debris in a valley has a smooth surface: heights along its middle differ from their neighbours' mean by little. It
/// stops where it has no energy left.
#[test]
fn debris_in_valleys_is_smooth_and_stops() {
    let world = World { boundary: OPEN, ..testing::world(400, 60, 20.0) };
    let valley = testing::field(world, |x, y| 0.8 * (y - 610.0).abs() + 0.15 * (8000.0 - x));
    let run = |changes: &str| {
        slide(&format!("rate=4,duration=4e3,smallest=100,largest=400,cohesion=0,{changes}"), &[("height", &valley)])
    };
    let runout = |changes: &str| {
        let found = run(changes);
        let runouts = found.column("runouts", false);
        runouts.iter().sum::<f64>() / runouts.len() as f64
    };
    let [far, usual, near] = ["spread=60,reach=0", "spread=60", "spread=60,reach=1.4"].map(runout);
    assert!(far > 1.1 * usual && usual > 1.1 * near, "{far} m, {usual} m, {near} m");
    let found = run("");
    let middle = |x: usize| [&found.height, &found.deposit].map(|field| f64::from(field[30 * 400 + x]));
    let filled: Vec<[f64; 2]> = (1..399)
        .filter(|x| [x - 1, *x, x + 1].into_iter().all(|x| middle(x)[1] > 2.0))
        .map(|x| {
            let [before, [height, deposit], after] = [x - 1, x, x + 1].map(middle);
            [(height - 0.5 * (before[0] + after[0])).abs(), deposit]
        })
        .collect();
    let mean = |k: usize| filled.iter().map(|cell| cell[k]).sum::<f64>() / filled.len() as f64;
    assert!(filled.len() > 40 && mean(0) < 0.03 * mean(1), "{} m of {} m in {} cells", mean(0), mean(1), filled.len());
}

#[test]
fn the_balance_closes_for_all_kinds_of_sides_and_materials() {
    for edge in [Edge::Base, Edge::Open, Edge::Inland, Edge::Wall, Edge::Periodic] {
        let land = mountains([120, 90], 25.0, Boundary::all(edge));
        let [soil, wet] = [2.0, 1.0].map(|value| everywhere(&land, value));
        for changes in ["bulking=1", "", "bulking=2,spread=2,shaking=0.4", "spread=500,deposit_slope=3"] {
            let found = slide(&format!("rate=6,{changes}"), &[("height", &land), ("soil", &soil), ("wetness", &wet)]);
            let (rock, soil) = (found.rock(), found.volume("soil", "became_debris"));
            let left = found.volume("debris", "left_the_world");
            let lies = found.report.balance_of("debris").expect("debris").end;
            assert!(found.measure("rock_slides") > 5.0 && found.measure("soil_slides") > 20.0, "{edge:?}");
            assert!(rock > 0.0 && soil > 0.0 && lies > 0.0);
            assert!(left > 0.0 || matches!(edge, Edge::Wall | Edge::Periodic));
            assert!(left == 0.0 || !matches!(edge, Edge::Wall | Edge::Periodic), "{edge:?}: {left} m³");
            // the rasters say the same, in single precision
            let sum = |of: &[f32]| of.iter().map(|value| f64::from(*value)).sum::<f64>() * 625.0;
            assert!((sum(&found.scars) / (rock + soil + found.measure("debris_moved_again")) - 1.0).abs() < 1e-5);
            assert!((sum(&found.deposit) / lies - 1.0).abs() < 1e-5);
            let change = sum(&found.height) - sum(land.samples());
            assert!((change - (lies - rock - soil)).abs() < 1e-3 * lies, "{change}");
        }
    }
}
