//! Scree: slopes steeper than the angle of repose shed their material.

mod device;
#[cfg(test)]
mod tests;

use crate::{
    numerics::{
        beds::{Beds, Ground},
        ledger, math, par,
        repose::{Land, SWEEPS, Slump, capped, relaxed, rises, wraps},
    },
    prelude::*,
};

choice! {
    /// How long slopes relax.
    pub enum Until {
        /// Until no slope is above repose.
        Equilibrium = "equilibrium",
        /// For the time `duration`, even if equilibrium is not reached.
        Duration = "duration",
    }
}

params! {
    /// Relaxes slopes to equilibrium, or for a given time.
    until: Until = Until::Equilibrium, One, ..;
    /// Time for which slopes relax.
    duration: f64 = 100.0, Years, 0.0..=1e6, soft 0.0..=1000.0, when until = "duration";
    /// Rate at which the excess of a slope over repose decays.
    relaxation: f64 = 0.01, PerYear, 0.0..=10.0, soft 0.0001..=1.0, when until = "duration";
    /// Excess over repose that is tolerated, as a fraction of repose.
    tolerance: f64 = 0.02, One, 0.0001..=0.2, soft 0.001..=0.05;
    /// Volume of debris per volume of rock.
    bulking: f64 = 1.3, One, 1.0..=2.0, soft 1.0..=1.6, with debris;
}

inputs! {
    /// Terrain height.
    height: Height;
    /// Angle of repose, per cell if wired.
    talus: Scalar(Degrees) = 35.0, 5.0..=80.0, soft 20.0..=60.0;
    /// Where the node acts: 0 keeps the ground in place.
    mask: Mask = 1.0, 0.0..=1.0;
    /// Thickness of loose material; if not wired, everything is loose.
    debris: Option<Scalar(Metres)>;
    /// Steepest stable angle of rock, per cell if wired; used only if `debris` is wired.
    rock: Scalar(Degrees) = 60.0, 20.0..=85.0, soft 45.0..=75.0;
    /// Rock at depth, from `Stratify`: its layers have their own angles.
    ///
    /// They replace `rock`, and are used only if `debris` is wired.
    strata: Option<Strata>;
}

outputs! {
    /// Terrain at rest.
    height: Height;
    /// Change in height of each cell; negative where it has lost material.
    moved: Scalar(Metres);
    /// Thickness of loose material; if the input is not wired, the material gained.
    debris: Scalar(Metres);
    /// Thickness of rock that has become debris.
    crumbled: Scalar(Metres);
    /// Volumes of debris that was there, came from rock, was shed, and settled, with the error of the balance.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Thermal",
    category: "erosion",
    summary: "Slopes steeper than the angle of repose shed material, which comes to rest below as scree.",
    doc: include_str!("page.md"),
    sources: &[
        "F. K. Musgrave, C. E. Kolb, R. S. Mace, 1989, The synthesis and rendering of eroded fractal terrains, SIGGRAPH",
        "B. Beneš, R. Forsbach, 2001, Layered data representation for visual simulation of terrain erosion, SCCG",
        "J. N. Tsitsiklis, 1995, Efficient algorithms for globally optimal trajectories, IEEE Trans. Autom. Control 40",
    ],
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    reach: Reach::World,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    gpu: Some(&device::GPU),
    // the slopes of cells decide what fails: coarser cells have fewer steep places
    resolution: Resolution::Within(0.1),
    example: "height: \"base\", talus: 22",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let wants = Wants::among(sizing.wanted);
    let given = 4.0 * (wants.count() - usize::from(wants.report)) as f64;
    let params = Params::read(sizing.params);
    if params.until == Until::Duration && params.relaxation * params.duration == 0.0 {
        return 0;
    }
    // per grid of the pyramid (each a quarter of the one before): ground, rise, two buffers of gains and, with debris,
    // the loose layer; then the final gains and the stable rises
    let loose = sizing.is_wired(Inputs::PORTS, "debris");
    let slump = if loose { 20.0 } else { 16.0 } * 4.0 / 3.0 + 4.0 + 4.0;
    // crumbled and swelled rock, loose material, and the ground with the swelling
    let layers = if loose { 16.0 } else { 0.0 };
    sizing.cells((slump + layers - given).max(0.0))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let inputs = Inputs::read(job)?;
    let params = Params::read(job.params);
    let window = job.window();
    let height = inputs.height.samples();
    let wants = Wants::of(job);
    let field = |samples| Field::new(window, samples);
    let still = |wanted: bool| wanted.then(|| Field::constant(window, 0.0));
    if left_of(&params) == 1.0 {
        let lying = inputs.debris.map(thickness);
        return Ok(Given {
            report: wants.report.then(|| {
                let lying_m = ledger::total(lying.as_deref().unwrap_or_default());
                report(job, params.bulking, Sums { thickness_m: lying_m, end_m: lying_m, ..Sums::default() })
            }),
            height: wants.height.then(|| inputs.height.clone()),
            moved: still(wants.moved),
            debris: wants.debris.then(|| lying.map(field).unwrap_or_else(|| Field::constant(window, 0.0))),
            crumbled: still(wants.crumbled),
        }
        .into());
    }
    let Start { rise, layer } = Start::new(job, &inputs, &params)?;
    let land = land(&window, height, &rise);
    let Some(Layer { crumbled, swelled, loose, ground, sums }) = layer else {
        let moved = slide(&land, &params, job)?;
        return Ok(Given {
            report: wants.report.then(|| report(job, params.bulking, Sums::default().slid(&moved))),
            height: wants.height.then(|| field(sum(height, &moved))),
            debris: wants.debris.then(|| field(moved.iter().map(|moved| moved.max(0.0)).collect())),
            moved: wants.moved.then(|| field(moved)),
            crumbled: still(wants.crumbled),
        }
        .into());
    };
    let slid = slide(&Land { height: &ground, loose: Some(&loose), ..land }, &params, job)?;
    let debris = || loose.iter().zip(&slid).map(|(loose, slid)| (loose + slid).max(0.0));
    let end_m = || debris().filter(|thickness| thickness.is_finite()).map(f64::from).sum();
    let moved = || swelled.iter().zip(&slid).map(|(swelled, slid)| swelled + slid).collect();
    Ok(Given {
        report: wants.report.then(|| report(job, params.bulking, Sums { end_m: end_m(), ..sums }.slid(&slid))),
        height: wants.height.then(|| field(sum(&ground, &slid))),
        moved: wants.moved.then(|| field(moved())),
        debris: wants.debris.then(|| field(debris().collect())),
        crumbled: wants.crumbled.then(|| field(crumbled)),
    }
    .into())
}

/// The thickness of a layer of debris.
fn thickness(debris: &Field) -> Vec<f32> {
    debris.samples().iter().map(|thickness| thickness.max(0.0)).collect()
}

/// The surface of a window, all of it loose.
fn land<'a>(window: &Window, height: &'a [f32], rise: &'a [f32]) -> Land<'a> {
    let wraps = if window.is_whole() { wraps(&window.world.boundary) } else { [false; 2] };
    Land { cells: [window.nx(), window.ny()], wraps, height, rise, loose: None }
}

/// What slides.
struct Start {
    /// The stable rises at the end, in metres.
    rise: Vec<f32>,
    /// The loose layer; None if all of the terrain is loose.
    layer: Option<Layer>,
}

/// The debris on rock that has failed.
struct Layer {
    /// Thickness of rock that has become debris.
    crumbled: Vec<f32>,
    /// What cells have risen by because debris takes more room than its rock.
    swelled: Vec<f32>,
    /// Thickness of the loose layer.
    loose: Vec<f32>,
    /// Height with the swelling.
    ground: Vec<f32>,
    /// The debris that was there, and the rock.
    sums: Sums,
}

impl Start {
    fn new(job: &Job<'_>, inputs: &Inputs<'_>, params: &Params) -> Result<Self, NodeError> {
        let (window, height, left) = (job.window(), inputs.height.samples(), left_of(params));
        let rise = rises(job, height, inputs.talus, inputs.mask)?;
        let land = land(&window, height, &rise);
        let Some(debris) = inputs.debris else {
            if inputs.strata.is_some() {
                warn_of_loose(job);
            }
            return Ok(Self { rise: relaxed(&land, left, job)?, layer: None });
        };
        let thickness = thickness(debris);
        let crumbled = crumble(&land, inputs, &thickness, left, job)?;
        let bulking = params.bulking as f32;
        let swelled: Vec<f32> = crumbled.iter().map(|crumbled| (bulking - 1.0) * crumbled).collect();
        let loose: Vec<f32> = thickness.iter().zip(&crumbled).map(|(r, crumbled)| r + bulking * crumbled).collect();
        let ground = sum(height, &swelled);
        let rise = relaxed(&Land { height: &ground, loose: Some(&loose), ..land }, left, job)?;
        let sums =
            Sums { thickness_m: ledger::total(&thickness), crumbled_m: ledger::total(&crumbled), ..Sums::default() };
        Ok(Self { rise, layer: Some(Layer { crumbled, swelled, loose, ground, sums }) })
    }
}

/// The fraction of the excess over repose that is left at the end.
fn left_of(params: &Params) -> f32 {
    match params.until {
        Until::Equilibrium => 0.0,
        Until::Duration => math::exp(-params.relaxation * params.duration) as f32,
    }
}

/// Sums over all cells, in metres.
#[derive(Clone, Copy)]
struct Sums {
    /// Thickness of debris at the start.
    thickness_m: f64,
    /// Rock that has become debris.
    crumbled_m: f64,
    /// What slid: gained, lost.
    slid_m: [f64; 2],
    /// Thickness of debris at the end.
    end_m: f64,
}

impl Default for Sums {
    /// Sums over no cells: -0, as the sum of no numbers is, in the bytes of all reports so far.
    fn default() -> Self {
        let none = ledger::total(&[]);
        Self { thickness_m: none, crumbled_m: none, slid_m: [0.0; 2], end_m: 0.0 }
    }
}

impl Sums {
    /// The same, with what has slid.
    fn slid(self, slid: &[f32]) -> Self {
        Self { slid_m: ledger::gains_and_losses(slid.iter().map(|&slid| f64::from(slid))), ..self }
    }
}

/// The balance of debris.
fn report(job: &Job<'_>, bulking: f64, sums: Sums) -> Report {
    let volume = |metres: f64| job.cell_m() * job.cell_m() * metres;
    let [settled, shed] = sums.slid_m.map(volume);
    let crumbled = volume(sums.crumbled_m);
    let mut report = Report::default();
    report.measure("crumbled_rock", crumbled, "m³");
    report.balance(Balance::new(
        "debris",
        volume(sums.thickness_m),
        &[("crumbled_rock_and_pores", bulking * crumbled), ("settled", settled)],
        &[("shed", shed)],
        volume(sums.end_m),
    ));
    report
}

/// Adds gains to heights; bit for bit the same where the gain is 0.
fn sum(height: &[f32], gained: &[f32]) -> Vec<f32> {
    height.iter().zip(gained).map(|(h, d)| if *d == 0.0 { *h } else { h + d }).collect()
}

/// Returns the thickness of rock below the debris that fails because it is too steep. `thickness` is that of the
/// debris.
fn crumble(
    land: &Land<'_>,
    inputs: &Inputs<'_>,
    thickness: &[f32],
    left: f32,
    job: &Job<'_>,
) -> Result<Vec<f32>, NodeError> {
    let rock: Vec<f32> = land.height.iter().zip(thickness).map(|(h, r)| h - r).collect();
    let layered = inputs.strata.map(|strata| (Beds::of_rock(strata.column()), strata.offset().samples()));
    let held = match &layered {
        None => {
            let rise = rises(job, land.height, inputs.rock, inputs.mask)?;
            let rock = Land { height: &rock, rise: &rise, ..*land };
            capped(&Land { rise: &relaxed(&rock, left, job)?, ..rock }, None, job)?
        }
        Some((beds, offset)) => {
            let layers = Ground { beds, offset };
            let mut rise = rises(job, land.height, Lane::Constant(45.0), inputs.mask)?;
            if left > 0.0 {
                // what is left of the excess over the layer that a slope begins in
                let tangents = par::map(rock.len(), |cell| layers.tangent(cell, f64::from(rock[cell])) as f32);
                rise.iter_mut().zip(tangents).for_each(|(rise, tangent)| *rise *= tangent);
                let rock = Land { height: &rock, rise: &rise, ..*land };
                capped(&Land { rise: &relaxed(&rock, left, job)?, ..rock }, None, job)?
            } else {
                capped(&Land { height: &rock, rise: &rise, ..*land }, Some(&layers), job)?
            }
        }
    };
    Ok(rock.iter().zip(&held).map(|(rock, held)| if held < rock { rock - held } else { 0.0 }).collect())
}

/// Returns the gain of each cell as slopes slide to the rises of the land.
fn slide(land: &Land<'_>, params: &Params, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
    let mut slump = Slump::new(land, params.tolerance as f32)?;
    if !slump.settle(SWEEPS, [0.0, 1.0], job)? {
        warn_of_steep(job, params);
    }
    Ok(slump.moved()?)
}

/// Warns that there is no rock for layers to be in.
fn warn_of_loose(job: &Job<'_>) {
    job.warn("all of the terrain is loose, so that `strata` has no effect; wire `debris`, such as a `Constant` of 0");
}

/// Warns that sweeps have ended before all slopes rest.
fn warn_of_steep(job: &Job<'_>, params: &Params) {
    job.warn(format!(
        "some slopes are still steeper than repose by more than {}; raise `tolerance`, or give the world larger cells",
        params.tolerance
    ));
}
