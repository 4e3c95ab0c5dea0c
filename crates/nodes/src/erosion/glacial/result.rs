//! The outputs, on the cells of the world.

use orograph_graph::memory::zeroed;

use super::{Given, Inputs, Wants, glacier::Glacier, march::Ledger};
use crate::{
    numerics::{math, par, voids},
    prelude::*,
};

/// Thickness of moraine that the mask shows as 1.
const MORAINE_M: f32 = 3.0;

/// The outputs of a run as it is.
///
/// # Errors
/// [`NodeError::Cancelled`], or not enough memory.
pub(super) fn outputs(glacier: &Glacier, job: &Job<'_>, wants: Wants) -> Result<Outputs, NodeError> {
    let window = job.window();
    let height = Inputs::read(job)?.height;
    let progress = glacier.fraction();
    let cells = |value: &(dyn Fn(usize) -> f32 + Sync)| -> Result<Vec<f32>, NodeError> {
        let mut out = zeroed(glacier.grid.len())?;
        par::all(out.chunks_mut(1 << 12), |part, out| {
            out.iter_mut().enumerate().for_each(|(k, out)| *out = value((part << 12) + k));
        });
        Ok(out)
    };
    if glacier.done == 0 {
        let zero = |wanted: bool| wanted.then(|| Field::constant(window, 0.0));
        return Ok(Given {
            height: wants.height.then(|| height.clone()),
            ice: zero(wants.ice),
            velocity: wants
                .velocity
                .then(|| zeroed(2 * window.len()))
                .transpose()?
                .map(|zeros| Field::with_planes(window, 2, zeros)),
            till: zero(wants.till),
            moraine: zero(wants.moraine),
            erosion: zero(wants.erosion),
            report: wants.report.then(|| report(glacier)),
        }
        .into());
    }
    let field = |samples: Vec<f32>| Field::new(window, samples);
    let positive =
        |value: &(dyn Fn(usize) -> f32 + Sync)| glacier.transfer.spread_positive(job, progress, &cells(value)?);

    let before =
        if wants.height || wants.erosion || wants.ice { Some(voids::filled(job, height.samples())?) } else { None };
    let eroded = match &before {
        Some(before) => Some(erosion(glacier, job, before)?),
        None => None,
    };
    let till =
        if wants.height || wants.till || wants.ice { Some(positive(&|cell| glacier.till[cell] as f32)?) } else { None };
    let ground = match (&before, &eroded, &till) {
        (Some(before), Some(eroded), Some(till)) => {
            let mut ground = orograph_graph::memory::copied(before)?;
            let size = window.nx().max(1);
            par::all(
                ground.chunks_mut(size).zip(eroded.chunks(size)).zip(till.chunks(size)),
                |_, ((ground, eroded), till)| {
                    ground
                        .iter_mut()
                        .zip(eroded)
                        .zip(till)
                        .for_each(|((ground, eroded), till)| *ground = *ground - eroded + till);
                },
            );
            Some(ground)
        }
        _ => None,
    };
    let ice = wants.ice.then(|| thickness(glacier, job, ground.as_deref().unwrap_or_default())).transpose()?;
    let velocity = || -> Result<Field, NodeError> {
        let [east, south] = &glacier.ice.velocity;
        let mut both =
            glacier.transfer.coarse.spread(job, [progress; 2], east, crate::numerics::coarse::Between::Linear)?;
        both.extend(glacier.transfer.coarse.spread(
            job,
            [progress; 2],
            south,
            crate::numerics::coarse::Between::Linear,
        )?);
        Ok(Field::with_planes(window, 2, both))
    };
    let moraine = || -> Result<Field, NodeError> {
        let mut mask = positive(&|cell| glacier.moraine[cell].min(glacier.till[cell] as f32))?;
        par::change(&mut mask, |mask| *mask = (*mask / MORAINE_M).clamp(0.0, 1.0));
        Ok(field(mask))
    };
    Ok(Given {
        velocity: wants.velocity.then(velocity).transpose()?,
        moraine: wants.moraine.then(moraine).transpose()?,
        height: ground.filter(|_| wants.height).map(field),
        ice: ice.map(field),
        till: till.filter(|_| wants.till).map(field),
        erosion: eroded.filter(|_| wants.erosion).map(field),
        report: wants.report.then(|| report(glacier)),
    }
    .into())
}

/// Rock removed from each cell of the world. Forms that are finer than ice cells wear down with it: by e for each
/// `smoothing` metres.
fn erosion(glacier: &Glacier, job: &Job<'_>, before: &[f32]) -> Result<Vec<f32>, NodeError> {
    let mut lowered: Vec<f32> = zeroed(glacier.grid.len())?;
    lowered
        .iter_mut()
        .zip(glacier.start.iter().zip(&glacier.rock))
        .for_each(|(out, (start, rock))| *out = (start - rock) as f32);
    let mut lowered = glacier.transfer.spread(job, glacier.fraction(), &lowered)?;
    if !glacier.transfer.is_same {
        let means = glacier.transfer.coarse.means(job, before)?;
        let coarse = glacier.transfer.spread(job, glacier.fraction(), &means)?;
        let length = glacier.params.smoothing.max(1e-3);
        let nx = job.window().nx().max(1);
        par::all(
            lowered.chunks_mut(nx).zip(before.chunks(nx)).zip(coarse.chunks(nx)),
            |_, ((lowered, before), coarse)| {
                for ((lowered, before), coarse) in lowered.iter_mut().zip(before).zip(coarse) {
                    let worn = 1.0 - math::exp(-f64::from(lowered.max(0.0)) / length);
                    *lowered += worn as f32 * (before - coarse);
                }
            },
        );
    }
    Ok(lowered)
}

/// Thickness of the ice over the final ground: the level of its surface between ice cells, less the ground.
fn thickness(glacier: &Glacier, job: &Job<'_>, ground: &[f32]) -> Result<Vec<f32>, NodeError> {
    let mut depths = glacier.transfer.spread_positive(job, glacier.fraction(), &glacier.ice.depth)?;
    if !glacier.transfer.is_same {
        let means = glacier.transfer.coarse.means(job, ground)?;
        let smooth = glacier.transfer.spread(job, glacier.fraction(), &means)?;
        let nx = job.window().nx().max(1);
        par::all(
            depths.chunks_mut(nx).zip(ground.chunks(nx)).zip(smooth.chunks(nx)),
            |_, ((depths, ground), smooth)| {
                for ((depth, ground), smooth) in depths.iter_mut().zip(ground).zip(smooth) {
                    *depth = if *depth > 0.0 { (*depth + smooth - ground).max(0.0) } else { 0.0 };
                }
            },
        );
    }
    Ok(depths)
}

/// Volumes, extents and balances.
fn report(glacier: &Glacier) -> Report {
    let area_m2 = glacier.grid.area_m2();
    let sum = |values: &[f32]| area_m2 * values.iter().map(|&value| f64::from(value)).sum::<f64>();
    let volumes = &glacier.volumes;
    let till = area_m2 * glacier.till.iter().sum::<f64>();
    let covered = glacier.ice.depth.iter().filter(|depth| **depth > 1.0).count() as f64;
    let mut report = Report::default();
    report.measure("ice_volume", sum(&glacier.ice.depth), "m³");
    report.measure("ice_area", area_m2 * covered, "m²");
    report.measure("ice_thickest_ever", glacier.deepest_m, "m");
    report.measure("ice_steps", glacier.ledger.steps as f64, "");
    if let Some(ice_m) = glacier.ice_total_m() {
        let Ledger { gained_m, melted_m, left_m, .. } = glacier.ledger;
        let volume = |metres: f64| area_m2 * metres;
        report.balance(Balance::new(
            "ice",
            0.0,
            &[("snow", volume(gained_m))],
            &[("melted", volume(melted_m)), ("left_the_world", volume(left_m))],
            volume(ice_m),
        ));
    }
    report.balance(Balance::new(
        "till",
        0.0,
        &[("eroded_rock", volumes.eroded)],
        &[("rock_flour", volumes.flour), ("meltwater", volumes.washed), ("left_the_world", volumes.left)],
        till,
    ));
    report
}
