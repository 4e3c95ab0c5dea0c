//! Scree: slopes steeper than the angle of repose shed their material.

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
    /// Volume of debris per volume of rock; used only if `debris` is wired.
    bulking: f64 = 1.3, One, 1.0..=2.0, soft 1.0..=1.6;
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
    /// Rock in depth, from `Stratify`: its layers have their own angles.
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
    /// The debris that was there, came from rock, was shed and settled, with the error of the balance.
    report: Report;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Thermal",
    category: "erosion",
    summary: "Slopes steeper than the angle of repose shed material, which comes to rest below as scree.",
    doc: include_str!("thermal.md"),
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
    // the loose layer; then the final gains, the rise, and the rise after relaxation
    let loose = sizing.is_wired(Inputs::PORTS, "debris");
    let slump = if loose { 20.0 } else { 16.0 } * 4.0 / 3.0 + 4.0 + 8.0;
    // thickness, crumbled and swelled rock, loose material, and the ground with the swelling
    let layers = if loose { 20.0 } else { 0.0 };
    sizing.cells((slump + layers - given).max(0.0))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let inputs = Inputs::read(job)?;
    let params = Params::read(job.params);
    let window = job.window();
    let height = inputs.height.samples();
    let left = match params.until {
        Until::Equilibrium => 0.0,
        Until::Duration => math::exp(-params.relaxation * params.duration) as f32,
    };
    let wants = Wants::of(job);
    let field = |samples| Field::new(window, samples);
    let still = |wanted: bool| wanted.then(|| Field::constant(window, 0.0));
    let thickness: Option<Vec<f32>> =
        inputs.debris.map(|debris| debris.samples().iter().map(|thickness| thickness.max(0.0)).collect());
    if left == 1.0 {
        let lying = thickness.as_deref().unwrap_or_default();
        return Ok(Given {
            report: wants.report.then(|| report(job, params.bulking, [lying, &[], &[]], ledger::total(lying))),
            height: wants.height.then(|| inputs.height.clone()),
            moved: still(wants.moved),
            debris: wants.debris.then(|| thickness.map(field).unwrap_or_else(|| Field::constant(window, 0.0))),
            crumbled: still(wants.crumbled),
        }
        .into());
    }
    let rise = rises(job, height, inputs.talus, inputs.mask)?;
    let wraps = if window.is_whole() { wraps(&job.world().boundary) } else { [false; 2] };
    let land = Land { cells: [window.nx(), window.ny()], wraps, height, rise: &rise, loose: None };
    let Some(thickness) = thickness else {
        if inputs.strata.is_some() {
            job.warn(
                "all of the terrain is loose, so that `strata` has no effect; wire `debris`, such as a `Constant` of 0",
            );
        }
        let moved = slide(&land, left, &params, job)?;
        return Ok(Given {
            report: wants.report.then(|| report(job, params.bulking, [&[], &[], &moved], 0.0)),
            height: wants.height.then(|| field(sum(height, &moved))),
            debris: wants.debris.then(|| field(moved.iter().map(|moved| moved.max(0.0)).collect())),
            moved: wants.moved.then(|| field(moved)),
            crumbled: still(wants.crumbled),
        }
        .into());
    };
    let crumbled = crumble(&land, &inputs, &thickness, left, job)?;
    let bulking = params.bulking as f32;
    let swelled: Vec<f32> = crumbled.iter().map(|crumbled| (bulking - 1.0) * crumbled).collect();
    let loose: Vec<f32> = thickness.iter().zip(&crumbled).map(|(r, crumbled)| r + bulking * crumbled).collect();
    let ground = sum(height, &swelled);
    let slid = slide(&Land { height: &ground, loose: Some(&loose), ..land }, left, &params, job)?;
    let debris = || loose.iter().zip(&slid).map(|(loose, slid)| (loose + slid).max(0.0));
    let lying_m = || debris().filter(|thickness| thickness.is_finite()).map(f64::from).sum();
    let moved = || swelled.iter().zip(&slid).map(|(swelled, slid)| swelled + slid).collect();
    Ok(Given {
        report: wants.report.then(|| report(job, params.bulking, [&thickness, &crumbled, &slid], lying_m())),
        height: wants.height.then(|| field(sum(&ground, &slid))),
        moved: wants.moved.then(|| field(moved())),
        debris: wants.debris.then(|| field(debris().collect())),
        crumbled: wants.crumbled.then(|| field(crumbled)),
    }
    .into())
}

/// The balance of debris, from its thickness, the rock that has become debris and what slid, to its sum at the end.
fn report(job: &Job<'_>, bulking: f64, [thickness, crumbled, slid]: [&[f32]; 3], end_m: f64) -> Report {
    let volume = |metres: f64| job.cell_m() * job.cell_m() * metres;
    let [settled, shed] = ledger::gains_and_losses(slid.iter().map(|&slid| f64::from(slid))).map(volume);
    let crumbled = volume(ledger::total(crumbled));
    let mut report = Report::default();
    report.measure("crumbled_rock", crumbled, "m³");
    report.balance(Balance::new(
        "debris",
        volume(ledger::total(thickness)),
        &[("crumbled_rock_and_pores", bulking * crumbled), ("settled", settled)],
        &[("shed", shed)],
        volume(end_m),
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

/// Returns the gain of each cell as slopes relax until only the fraction `left` of the excess over repose remains.
fn slide(land: &Land<'_>, left: f32, params: &Params, job: &Job<'_>) -> Result<Vec<f32>, NodeError> {
    let rise = relaxed(land, left, job)?;
    let mut slump = Slump::new(&Land { rise: &rise, ..*land }, params.tolerance as f32)?;
    if !slump.settle(SWEEPS, [0.0, 1.0], job)? {
        job.warn(format!(
            "some slopes are still steeper than repose by more than {}; raise `tolerance`, or give the world larger \
             cells",
            params.tolerance
        ));
    }
    Ok(slump.moved()?)
}

#[cfg(test)]
mod tests {
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
        let first = (row.iter().position(|&z| z < 59.0).unwrap() as f64) - 128.0;
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
        let pillar =
            field(world(n, n, 5.0), |x, y| if libm::hypot(x - 480.0, y - 480.0) < 100.0 { 250.0 } else { 0.0 });
        let [cone, _] = rest(&defaults(), &pillar);
        assert!((total(&cone) / total(&pillar) - 1.0).abs() < 1e-6);
        assert!(steepest(&cone) <= REPOSE * 1.02 + 1e-6);
        assert!(cone.range(0).unwrap().0 > -1e-5);
        // radius of the 60 m contour at 32 azimuths, by bilinear interpolation
        let z = |x: f64, y: f64| {
            let (i, j) = ((x / 5.0 - 0.5) as usize, (y / 5.0 - 0.5) as usize);
            let (u, v) = (x / 5.0 - 0.5 - i as f64, y / 5.0 - 0.5 - j as f64);
            let at = |i: usize, j: usize| f64::from(cone.samples()[j * n as usize + i]);
            (at(i, j) * (1.0 - u) + at(i + 1, j) * u) * (1.0 - v)
                + (at(i, j + 1) * (1.0 - u) + at(i + 1, j + 1) * u) * v
        };
        let radii: Vec<f64> = (0..32)
            .map(|k| {
                let angle = std::f64::consts::TAU * f64::from(k) / 32.0;
                let along = |r: f64| z(480.0 + r * libm::cos(angle), 480.0 + r * libm::sin(angle));
                (0..4000).map(|step| f64::from(step) * 0.1).find(|&r| along(r) < 60.0).unwrap()
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
            let squares =
                single.samples().iter().zip(other.samples()).map(|(a, b)| f64::from(a - b) * f64::from(a - b));
            squares.sum::<f64>().sqrt()
        };
        assert!(rms(&layered) < 0.05 * rms(&hill), "{} of {}", rms(&layered), rms(&hill));
        let (peak, expected) = (layered.range(0).unwrap().1, single.range(0).unwrap().1);
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
}
