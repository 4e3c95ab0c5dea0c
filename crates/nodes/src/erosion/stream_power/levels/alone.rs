//! Other cells than those of a job: levels that the caller has not run, and results on the cells of the coarsest level
//! and on fewer.

use std::sync::Arc;

use orograph_graph::{
    Coarser, InputValue, LevelJob, OutputType, State, Value, Wanted, Warnings, Window, World, memory::OutOfMemory,
};

use super::{Ladder, resample, run};
use crate::{
    erosion::stream_power::{Params, inland::Inland},
    prelude::*,
};

/// The state of the level on the cells of a world, of a job that came without: from resampled inputs.
pub fn state(job: &Job<'_>, params: &Params, world: World) -> Result<State, NodeError> {
    let below = on_cells(job, world, Wanted::NONE, LevelJob { below: Coarser::Nothing, gives_state: true })?;
    run(&below, params)?.take_state().ok_or_else(|| NodeError::failed("the level below gave no state"))
}

/// The outputs on fewer cells than those of a world: its means, and of rivers the largest in each cell.
pub fn means(job: &Job<'_>, params: &Params, world: World) -> Result<Outputs, NodeError> {
    let outputs = match &job.level.below {
        Coarser::Results(outputs) => outputs.clone(),
        Coarser::Nothing | Coarser::State(_) => {
            // the inputs are those of the coarsest level, and only those of the next one are interpolated
            let is_coarsest = Ladder::new(job.window(), params).is_coarsest();
            let below = match is_coarsest.then(|| state(job, params, job.window().world)).transpose()? {
                Some(state) => Coarser::State(Arc::new(state)),
                None => Coarser::Nothing,
            };
            let finer = on_cells(job, world, job.wanted, LevelJob { below, gives_state: false })?;
            let outputs = run(&finer, params)?;
            Inland::forward_warnings(&finer, job);
            outputs
        }
    };
    averaged(outputs, job)
}

/// Outputs on larger cells: their means, and of rivers the largest in each cell.
fn averaged(outputs: Outputs, job: &Job<'_>) -> Result<Outputs, NodeError> {
    let asked = job.window();
    let node = job.node;
    let is_largest = |name: &str| {
        let at = node.output_index(name);
        at.is_some_and(
            |at| matches!(node.outputs[at].ty, OutputType::Fixed(ty) if node.averaging(at, ty) == Averaging::Largest),
        )
    };
    outputs.into_iter_named().try_fold(Outputs::default(), |given, (name, value)| {
        Ok(match value {
            Value::Field(field) if is_largest(name) => given.with(name, resample::largest(&field, asked)?),
            Value::Field(field) => given.with(name, resample::resampled(&field, asked, false)?),
            Value::Strata(strata) => given.with(name, strata.on(resample::resampled(strata.offset(), asked, false)?)),
            other => given.with(name, other),
        })
    })
}

/// The same job on other cells, with resampled inputs. Its progress is not reported.
fn on_cells<'a>(job: &'a Job<'_>, world: World, wanted: Wanted, level: LevelJob) -> Result<Job<'a>, OutOfMemory> {
    let window = Window::whole(world);
    let inputs = job.node.inputs.iter().zip(&job.inputs).map(|(input, value)| {
        Ok(match value {
            InputValue::Value(Value::Field(field)) => {
                let field = resample::resampled(field, window, input.name == "height")?;
                InputValue::Value(Value::Field(field))
            }
            InputValue::Value(Value::Strata(strata)) => {
                let offset = resample::resampled(strata.offset(), window, false)?;
                InputValue::Value(strata.on(offset).into())
            }
            other => other.clone(),
        })
    });
    Ok(Job {
        node: job.node,
        params: job.params,
        inputs: inputs.collect::<Result<_, OutOfMemory>>()?,
        level,
        window,
        wanted,
        folder: job.folder.clone(),
        cancel: job.cancel.clone(),
        progress: &|_| {},
        warnings: Warnings::default(),
        glimpses: None,
    })
}
