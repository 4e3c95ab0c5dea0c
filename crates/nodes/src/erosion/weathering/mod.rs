//! Weathering: frost and soil production turn rock into debris, which falls and comes to rest.

mod rock;

use self::rock::{Row, Weather, lose};
use crate::{
    numerics::{
        beds::{Beds, Ground},
        ledger,
        math::lane,
        par,
        repose::{Land, SWEEPS, Slump, beside, rises, wraps},
    },
    prelude::*,
};

params! {
    /// Simulated time.
    duration: f64 = 10_000.0, Years, 0.0..=1e6, soft 0.0..=50_000.0;
    /// Rate at which frost shatters bare rock where it cracks most, at −5 °C.
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
    /// Mean annual temperature at height 0.
    temperature: Scalar(Celsius) = 12.0, -40.0..=40.0, soft -10.0..=30.0;
    /// Angle of repose of debris.
    talus: Scalar(Degrees) = 35.0, 5.0..=80.0, soft 20.0..=60.0;
    /// Where the node acts: 0 keeps the ground as it is.
    mask: Mask = 1.0, 0.0..=1.0;
    /// Thickness of debris on the rock at the start.
    debris: Option<Scalar(Metres)>;
    /// Rock at depth, from `Stratify`: hard layers weather more slowly.
    strata: Option<Strata>;
}

outputs! {
    /// Terrain at the end.
    height: Height;
    /// Thickness of debris.
    debris: Scalar(Metres);
    /// Thickness of rock that has become debris.
    weathered: Scalar(Metres);
    /// Volumes of debris that was there, that came from rock, and that remains, with the error of the balance.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Weathering",
    category: "erosion",
    summary: "Over time, frost and soil production turn rock into debris, which comes to rest below as scree.",
    doc: include_str!("page.md"),
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
const PASSING: usize = 12;

/// Bytes per cell of rise, rate, thickness and rock; debris, weathered rock, surface and the loss of a round.
const FIELDS: f64 = 32.0;

/// The number of wanted outputs with a value per cell.
fn rasters(sizing: &Sizing<'_>) -> f64 {
    let wants = Wants::among(sizing.wanted);
    (wants.count() - usize::from(wants.report)) as f64
}

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let given = 4.0 * rasters(sizing);
    if Params::read(sizing.params).duration == 0.0 {
        return sizing.cells(FIELDS - given);
    }
    // per grid of the pyramid (each a quarter of the one before) ground, rise, loose layer and two buffers of gains;
    // the final gains
    sizing.cells(FIELDS + 20.0 * 4.0 / 3.0 + 4.0 - given)
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
        let cracking = lane::exp(-0.5 * from_worst * from_worst);
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
    let mut lost = vec![0.0; height.len()];
    let beds = inputs.strata.map(|strata| (Beds::of_rock(strata.column()), strata.offset().samples()));
    let ground_below = beds.as_ref().map(|(beds, offset)| Ground { beds, offset });
    let bulking = params.bulking as f32;
    let weather = Weather {
        cell_m: job.cell_m() as f32,
        bulking,
        cover_m: params.cover as f32,
        round_yr: (params.duration / f64::from(rounds.max(1))) as f32,
    };
    let [nx, ny] = [window.nx(), window.ny()];
    let mut slump: Option<Slump> = None;
    let mut at_rest = true;
    for round in 0..rounds {
        par::rows_within(job, [0.0, 0.0], &mut lost, |j, lost| {
            let own = j * nx..(j + 1) * nx;
            let near = beside(j, ny, land.wraps[1]);
            let level = |at: usize| f64::from(rock[at] - weathered[at]);
            let weaker: Option<Vec<f32>> = ground_below
                .map(|ground| own.clone().map(|at| rate[at] * ground.weakness(at, level(at)) as f32).collect());
            let row = Row {
                surface: near.map(|j| &surface[j * nx..][..nx]),
                rise: near.map(|j| &rise[j * nx..][..nx]),
                rock: [&rock[own.clone()], &weathered[own.clone()]],
                debris: &debris[own.clone()],
                rate: weaker.as_deref().unwrap_or(&rate[own.clone()]),
                wraps: land.wraps[0],
            };
            lose(&weather, &row, lost);
        })?;
        let rows = weathered.chunks_mut(nx).zip(debris.chunks_mut(nx)).zip(surface.chunks_mut(nx));
        par::all(rows.zip(lost.chunks(nx)), |_, (((weathered, debris), surface), lost)| {
            for i in 0..lost.len() {
                weathered[i] += lost[i];
                debris[i] += bulking * lost[i];
                surface[i] += (bulking - 1.0) * lost[i];
            }
        });
        let slump = match &mut slump {
            Some(slump) => {
                slump.load(&surface, Some(&debris));
                slump
            }
            None => slump
                .insert(Slump::new(&Land { height: &surface, loose: Some(&debris), ..land }, params.tolerance as f32)?),
        };
        let share = [round, round + 1].map(|round| round as f32 / rounds as f32);
        let last = round + 1 == rounds;
        at_rest = slump.settle(if last { SWEEPS } else { PASSING }, share, job)?;
        let slid = slump.moved()?;
        let rows = debris.chunks_mut(nx).zip(surface.chunks_mut(nx)).zip(slid.chunks(nx));
        par::all(rows, |j, ((debris, surface), slid)| {
            let own = j * nx..(j + 1) * nx;
            let (height, thickness, weathered) = (&height[own.clone()], &thickness[own.clone()], &weathered[own]);
            for i in 0..slid.len() {
                if slid[i] != 0.0 {
                    debris[i] = (debris[i] + slid[i]).max(0.0);
                }
                // added to the initial heights, so that they are rounded only once
                let gained = (debris[i] - thickness[i]) - weathered[i];
                surface[i] = if gained == 0.0 { height[i] } else { height[i] + gained };
            }
        });
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
mod tests;
