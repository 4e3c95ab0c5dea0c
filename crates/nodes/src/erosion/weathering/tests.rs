//! Tests of weathering: closed forms, the balance of debris, scree below a cliff, bad inputs.

use super::*;
use crate::testing::{field, outputs, run_in, with_params, world};

fn fields(changes: &str, inputs: &[(&str, &Field)]) -> [Field; 3] {
    let mut outputs = outputs(&NODE, &with_params(&NODE, changes), inputs).expect("a result");
    ["height", "debris", "weathered"]
        .map(|name| outputs.take(name).expect("an output").as_field().expect("a field").clone())
}

fn total(field: &Field) -> f64 {
    field.samples().iter().map(|&v| f64::from(v)).sum()
}

/// A plateau with a winding cliff of 120 m.
fn cliff() -> Field {
    field(world(96, 72, 10.0), |x, y| if x + 30.0 * libm::sin(y / 60.0) < 480.0 { 2620.0 } else { 2500.0 })
}

/// A flat bench at 2000 m produces debris according to the closed form r0 ln(1 + β P t / r0), with P at its
/// temperature of −1 °C: Hales and Roering 2007, Heimsath and others 1997. Single precision, over about 16 rounds.
#[test]
fn a_flat_bench_weathers_by_the_closed_form() {
    let bench = field(world(20, 12, 10.0), |_, _| 2000.0);
    let [height, debris, weathered] = fields("duration=30000", &[("height", &bench)]);
    let rate = 5e-4 * libm::exp(-0.5 * (4.0 / 3.0) * (4.0 / 3.0)) + 1e-4;
    let expected = 0.5 * libm::log(1.0 + 1.3 * rate * 30_000.0 / 0.5);
    for ((r, w), h) in debris.samples().iter().zip(weathered.samples()).zip(height.samples()) {
        assert!((f64::from(*r) / expected - 1.0).abs() < 1e-4, "{r} {expected}");
        assert!((f64::from(*w) * 1.3 / expected - 1.0).abs() < 1e-4);
        assert!((f64::from(h - 2000.0) - 0.3 / 1.3 * expected).abs() < 1e-3);
    }
}

/// A cliff retreats, scree rests below it at repose, and debris has `bulking` times the volume of the lost rock.
#[test]
fn scree_gathers_below_a_cliff() {
    let land = cliff();
    let [height, debris, weathered] = fields("duration=20000", &[("height", &land)]);
    assert!((total(&debris) / (1.3 * total(&weathered)) - 1.0).abs() < 1e-6);
    let gained: f64 = height.samples().iter().zip(land.samples()).map(|(a, b)| f64::from(a - b)).sum();
    // heights of 2600 m in single precision
    assert!((gained - 0.3 * total(&weathered)).abs() < 1e-4 * 6912.0, "{gained}");
    let (most, edge) = (debris.range(0).expect("values").1, weathered.range(0).expect("values").1);
    assert!(most > 15.0 && edge > 10.0, "{most} of scree, {edge} lost");
    // 2 % of tolerance, more where debris leans against a wall
    for (at, pair) in height.samples().windows(2).enumerate() {
        let [a, b] = [at, at + 1].map(|at| debris.samples()[at]);
        if (at + 1) % 96 > 0 && a > 1.0 && b > 1.0 {
            assert!((pair[0] - pair[1]).abs() < 10.0 * 0.7002 * 1.08, "{at}: {pair:?}");
        }
    }
}

/// Rounds of half the duration give nearly the same scree.
#[test]
fn the_result_does_not_depend_on_rounds() {
    let land = cliff();
    let [_, coarse, _] = fields("duration=20000", &[("height", &land)]);
    let [half, _, _] = fields("duration=10000", &[("height", &land)]);
    let [_, debris, _] = fields("duration=10000", &[("height", &land)]);
    let [_, fine, _] = fields("duration=10000", &[("height", &half), ("debris", &debris)]);
    let off =
        coarse.samples().iter().zip(fine.samples()).map(|(a, b)| f64::from(a - b) * f64::from(a - b)).sum::<f64>();
    let rms = (off / coarse.samples().iter().map(|a| f64::from(a * a)).sum::<f64>()).sqrt();
    assert!(rms < 0.1, "{rms}");
    assert!((total(&coarse) / total(&fine) - 1.0).abs() < 0.03);
}

#[test]
fn hostile_inputs_give_the_obvious() {
    let land = cliff();
    for changes in ["duration=0", "frost=0,soil=0"] {
        assert_eq!(fields(changes, &[("height", &land)])[0], land);
    }
    let nothing = field(land.window().world, |_, _| 0.0);
    for name in ["mask", "exposure"] {
        assert_eq!(fields("", &[("height", &land), (name, &nothing)])[0], land);
    }
    for (nx, ny) in [(1, 1), (1, 9), (9, 1), (2, 2)] {
        let height = field(world(nx, ny, 1.0), |x, _| if x > 3.0 { f64::NAN } else { 1e4 * x });
        let [after, debris, weathered] = fields("duration=1000", &[("height", &height)]);
        assert!(debris.samples().iter().chain(weathered.samples()).all(|v| v.is_finite() && *v >= 0.0));
        let holes = |f: &Field| f.samples().iter().map(|v| v.is_nan()).collect::<Vec<_>>();
        assert_eq!(holes(&after), holes(&height));
    }
    let inputs = [("height", &land)];
    assert_eq!(run_in(1, &NODE, &with_params(&NODE, ""), &inputs), run_in(3, &NODE, &with_params(&NODE, ""), &inputs));
}
