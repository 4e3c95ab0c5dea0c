//! Weathering: frost and soil production turn rock into debris, which falls and comes to rest.

use crate::numerics::{
    beds::{Beds, Ground},
    ledger, par,
    repose::{Land, SWEEPS, Slump, rises, wraps},
};
use crate::{numerics::math, prelude::*};

params! {
    /// Simulated time.
    duration: f64 = 10_000.0, Years, 0.0..=1e6, soft 0.0..=50_000.0;
    /// Rate at which frost shatters bare rock where frost is strongest.
    frost: f64 = 5e-4, MetresPerYear, 0.0..=5e-3, soft 0.0..=2e-3;
    /// Rate at which bare rock turns to soil.
    soil: f64 = 1e-4, MetresPerYear, 0.0..=1e-3, soft 2e-5..=3e-4;
    /// Thickness of debris under which weathering falls to 37 %.
    cover: f64 = 0.5, Metres, 0.05..=5.0, soft 0.2..=1.0;
    /// Lapse rate: cooling of the air with height.
    lapse: f64 = 6.5, KelvinsPerKilometre, 0.0..=15.0, soft 4.0..=10.0;
    /// Volume of debris per volume of rock.
    bulking: f64 = 1.3, One, 1.0..=2.0, soft 1.0..=1.6;
    /// Excess over repose that is tolerated, as a fraction of repose.
    tolerance: f64 = 0.02, One, 0.001..=0.2, soft 0.005..=0.05;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Exposure of the rock to weather.
    exposure: Mask = 1.0, 0.0..=1.0;
    /// Mean annual temperature at sea level.
    temperature: Scalar(Celsius) = 12.0, -40.0..=40.0, soft -10.0..=30.0;
    /// Angle of repose of debris.
    talus: Scalar(Degrees) = 35.0, 5.0..=80.0, soft 20.0..=60.0;
    /// Where the node acts: 0 keeps the ground as it is.
    mask: Mask = 1.0, 0.0..=1.0;
    /// Thickness of debris on the rock at the start.
    debris: Option<Scalar(Metres)>;
    /// Rock in depth, from `Stratify`: hard layers weather more slowly.
    strata: Option<Strata>;
}

outputs! {
    /// Terrain at the end.
    height: Height;
    /// Thickness of debris.
    debris: Scalar(Metres);
    /// Thickness of rock that has become debris.
    weathered: Scalar(Metres);
    /// The debris that was there, came from rock and remains, with the error of the balance.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Weathering",
    category: "erosion",
    summary: "Over time, frost and soil production turn rock into debris, which comes to rest below as scree.",
    doc: include_str!("weathering.md"),
    sources: &[
        "T. C. Hales, J. J. Roering, 2007, Climatic controls on frost cracking and implications for the evolution of \
         bedrock landscapes, J. Geophys. Res. 112",
        "A. M. Heimsath, W. E. Dietrich, K. Nishiizumi, R. C. Finkel, 1997, The soil production function and landscape \
         equilibrium, Nature 388",
        "O. Fisher, 1866, On the disintegration of a chalk cliff, Geol. Mag. 3",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    // the slopes of cells decide where debris comes to rest
    resolution: Resolution::Within(0.1),
    example: "height: \"base\", temperature: 2, duration: 20000",
    ..Node::DEFAULT
};

/// Minimum number of rounds if the total debris is many times as thick as `cover`.
const ROUNDS: f64 = 16.0;

/// Maximum sweeps over a grid in all rounds but the last: material that still moves continues in the next round.
const PASSING: usize = 64;

/// The number of wanted outputs with a value per cell.
fn rasters(sizing: &Sizing<'_>) -> f64 {
    let wants = Wants::among(sizing.wanted);
    (wants.count() - usize::from(wants.report)) as f64
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let given = 4.0 * rasters(sizing);
    if Params::read(sizing.params).duration == 0.0 {
        // without rounds: rise, rate, thickness, rock, debris, weathered rock and surface
        return sizing.cells(28.0 - given);
    }
    // rise, rate, thickness and rock; debris, weathered rock, surface and the loss of a round; per grid of the pyramid
    // (each a quarter of the one before) ground, rise, loose layer and two buffers of gains; the final gains
    sizing.cells(32.0 + 20.0 * 4.0 / 3.0 + 4.0 - given)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let inputs = Inputs::read(job)?;
    let params = Params::read(job.params);
    let height = inputs.height.samples();
    let rise = rises(job, height, inputs.talus, inputs.mask)?;
    let (exposure, temperature) = (inputs.exposure, inputs.temperature);
    let rate = par::map(height.len(), |at| {
        let celsius = temperature.at(at) - 1e-3 * params.lapse as f32 * height[at];
        let from_worst = (celsius + 5.0) / 3.0;
        let cracking = math::f32::exp(-0.5 * from_worst * from_worst);
        let rate = exposure.at(at).clamp(0.0, 1.0) * (params.frost as f32 * cracking + params.soil as f32);
        if rise[at].is_finite() { rate } else { 0.0 }
    });
    let weakest = inputs.strata.map_or(1.0, |strata| Beds::of_rock(strata.column()).weakest());
    let most = params.duration * weakest * f64::from(rate.iter().copied().fold(0.0, f32::max));
    let cover = (4.0 * params.bulking * most / params.cover).min(ROUNDS);
    let rounds = cover.max(2.0 * most / job.cell_m()).ceil();
    weather(job, &params, &inputs, [&rise, &rate], rounds as u32)
}

/// Weathers rock and lets debris slide, in rounds.
fn weather(
    job: &Job<'_>,
    params: &Params,
    inputs: &Inputs<'_>,
    [rise, rate]: [&[f32]; 2],
    rounds: u32,
) -> Result<Outputs, NodeError> {
    let window = job.window();
    let height = inputs.height.samples();
    let thickness: Vec<f32> = match inputs.debris {
        Some(debris) => debris.samples().iter().map(|thickness| thickness.max(0.0)).collect(),
        None => vec![0.0; height.len()],
    };
    let wraps = if window.is_whole() { wraps(&job.world().boundary) } else { [false; 2] };
    let land = Land { cells: [window.nx(), window.ny()], wraps, height, rise, loose: None };
    let rock: Vec<f32> = height.iter().zip(&thickness).map(|(h, r)| h - r).collect();
    let (mut debris, mut weathered, mut surface) = (thickness.clone(), vec![0.0; height.len()], height.to_vec());
    let (bulking, cover) = (params.bulking as f32, params.cover as f32);
    let round_yr = (params.duration / f64::from(rounds.max(1))) as f32;
    let cell_m = job.cell_m() as f32;
    let beds = inputs.strata.map(|strata| (Beds::of_rock(strata.column()), strata.offset().samples()));
    let ground_below = beds.as_ref().map(|(beds, offset)| Ground { beds, offset });
    let mut at_rest = true;
    for round in 0..rounds {
        job.check()?;
        let ground = Land { height: &surface, ..land };
        let lost = par::map(height.len(), |at| {
            if rate[at] == 0.0 {
                return 0.0;
            }
            let level = rock[at] - weathered[at];
            let weakness = ground_below.map_or(1.0, |ground| ground.weakness(at, f64::from(level)) as f32);
            let free = ground.drop_from(level, at);
            let area = (1.0 + (free / cell_m) * (free / cell_m)).sqrt();
            let made = bulking * rate[at] * weakness * round_yr * area * math::f32::exp(-debris[at] / cover);
            // debris that stays where it is produced shields the rock below it
            let stays = free <= rise[at];
            (if stays { cover * math::ln(1.0 + f64::from(made / cover)) as f32 } else { made }) / bulking
        });
        for at in 0..height.len() {
            weathered[at] += lost[at];
            debris[at] += bulking * lost[at];
            surface[at] += (bulking - 1.0) * lost[at];
        }
        let mut slump = Slump::new(&Land { height: &surface, loose: Some(&debris), ..land }, params.tolerance as f32)?;
        let share = [round, round + 1].map(|round| round as f32 / rounds as f32);
        let last = round + 1 == rounds;
        at_rest = slump.settle(if last { SWEEPS } else { PASSING }, share, job)?;
        for (debris, slid) in debris.iter_mut().zip(slump.moved()?) {
            if slid != 0.0 {
                *debris = (*debris + slid).max(0.0);
            }
        }
        // added to the initial heights, so that they are rounded only once
        for at in 0..height.len() {
            let gained = (debris[at] - thickness[at]) - weathered[at];
            surface[at] = if gained == 0.0 { height[at] } else { height[at] + gained };
        }
    }
    if !at_rest {
        job.warn("some debris still slides; raise `tolerance`, or give the world larger cells");
    }
    let wants = Wants::of(job);
    let report = || {
        let volume = |metres: f64| job.cell_m() * job.cell_m() * metres;
        let rock = volume(ledger::total(&weathered));
        let mut report = Report::default();
        report.measure("weathered_rock", rock, "m³");
        report.balance(Balance::new(
            "debris",
            volume(ledger::total(&thickness)),
            &[("weathered_rock_and_pores", params.bulking * rock)],
            &[],
            volume(ledger::total(&debris)),
        ));
        report
    };
    Ok(Given {
        report: wants.report.then(report),
        height: wants.height.then(|| Field::new(window, surface)),
        debris: wants.debris.then(|| Field::new(window, debris)),
        weathered: wants.weathered.then(|| Field::new(window, weathered)),
    }
    .into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{field, outputs, run_in, with_params, world};

    fn fields(changes: &str, inputs: &[(&str, &Field)]) -> [Field; 3] {
        let mut outputs = outputs(&NODE, &with_params(&NODE, changes), inputs).expect("a result");
        ["height", "debris", "weathered"].map(|name| outputs.take(name).unwrap().as_field().unwrap().clone())
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
        let (most, edge) = (debris.range(0).unwrap().1, weathered.range(0).unwrap().1);
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
        assert_eq!(
            run_in(1, &NODE, &with_params(&NODE, ""), &inputs),
            run_in(3, &NODE, &with_params(&NODE, ""), &inputs)
        );
    }
}
