//! Estimates the memory of a plan before anything runs.

use super::{
    error::EvalError,
    needs::{Needs, Slot},
    plan::Plan,
    stages::{Stage, Stages},
};
use crate::{machine, memory::with_capacity};

/// Estimates the memory of a plan whose steps run one after another; returns its peak in bytes.
///
/// # Errors
/// The step at which the plan exceeds the limit or, without a limit, the memory that the machine has available.
pub(super) fn check(plan: &Plan<'_>, needs: &Needs, limit: Option<u64>) -> Result<u64, (usize, EvalError)> {
    let estimate = estimate(plan, needs);
    let refuse = |(needs, step): (u64, usize), available| {
        (step, EvalError::TooLarge { node: plan.steps[step].instance.name.clone(), needs, available })
    };
    let available = limit.or_else(|| Some(machine::available()? + estimate.held));
    if let Some(available) = available
        && estimate.peak.0 > available
    {
        return Err(refuse(estimate.peak, Some(available)));
    }
    if !can_allocate(estimate.largest.0) {
        return Err(refuse(estimate.largest, None));
    }
    Ok(estimate.peak.0)
}

/// Estimates the memory of a build in stages.
///
/// # Errors
/// When it would exceed the limit or, without a limit, the memory that the machine has available.
pub(super) fn check_stages(plan: &Plan<'_>, stages: &Stages, limit: Option<u64>) -> Result<(), EvalError> {
    let mut peak = (0, 0);
    for (at, stage) in stages.all.iter().enumerate() {
        // Results of earlier stages that this or a later stage reads.
        let read = |result: &(usize, usize)| stages.all[at..].iter().any(|stage| stage.reads.contains(result));
        let held = stages.all[..at].iter().flat_map(|stage| stage.results.iter().map(move |result| (stage, result)));
        let held: u64 =
            held.filter(|(_, result)| read(result)).map(|(stage, result)| bytes(plan, stage, *result)).sum();
        let put_together = stage.results.iter().zip(&stage.streamed).filter(|(_, streamed)| streamed.is_none());
        let given: u64 = put_together.map(|(result, _)| bytes(plan, stage, *result)).sum();
        let step = stage.steps.last().or(stage.results.first().map(|(step, _)| step)).copied().unwrap_or(0);
        peak = peak.max((held + given + stage.bytes, step));
    }
    let (needs, step) = peak;
    let available = limit.or_else(machine::available);
    match available {
        Some(most) if needs > most => {
            Err(EvalError::TooLarge { node: plan.steps[step].instance.name.clone(), needs, available })
        }
        _ => Ok(()),
    }
}

fn bytes(plan: &Plan<'_>, stage: &Stage, (step, output): (usize, usize)) -> u64 {
    plan.steps[step].output_bytes(output, &stage.window)
}

/// Bytes, and the step that needs them.
#[derive(Debug, Default, PartialEq)]
struct Estimate {
    /// Size of the values found in memory.
    held: u64,
    /// All values alive at the same time, with the kernel's scratch memory.
    peak: (u64, usize),
    /// The largest allocation of one kernel.
    largest: (u64, usize),
}

fn estimate(plan: &Plan<'_>, needs: &Needs) -> Estimate {
    let held = needs.found.iter().flatten().map(Slot::bytes).sum();
    let mut estimate = Estimate { held, ..Estimate::default() };
    let mut readers = needs.readers.clone();
    for target in plan.targets.iter().flatten() {
        // A request takes its value as soon as it is available.
        readers[target.step][target.output] = readers[target.step][target.output].saturating_sub(1);
    }
    let mut alive: u64 = held;
    // Values found on disk are read when they are first needed.
    let mut loaded: Vec<Vec<bool>> =
        needs.found.iter().map(|slots| slots.iter().map(|slot| !matches!(slot, Slot::Stored(_))).collect()).collect();
    for (at, step) in plan.steps.iter().enumerate().filter(|(at, _)| needs.computes(*at)) {
        for (source, output) in step.wires(needs.wanted[at]) {
            if !std::mem::replace(&mut loaded[source][output], true) {
                alive += plan.steps[source].output_bytes(output, &plan.steps[source].wanted);
            }
        }
        let wanted = needs.wanted[at];
        let takes = step.kernel_bytes(wanted, &plan.steps);
        estimate.largest = estimate.largest.max((takes, at));
        estimate.peak = estimate.peak.max((alive + takes, at));

        let kept = (0..step.outputs()).filter(|output| wanted.contains(*output) && readers[at][*output] > 0);
        alive += kept.map(|output| step.output_bytes(output, &step.wanted)).sum::<u64>();
        for (source, output) in step.wires(needs.wanted[at]) {
            readers[source][output] -= 1;
            if readers[source][output] == 0 {
                let bytes = plan.steps[source].output_bytes(output, &plan.steps[source].wanted);
                alive = alive.saturating_sub(bytes);
            }
        }
    }
    estimate
}

/// Reserves that much address space and releases it untouched.
fn can_allocate(bytes: u64) -> bool {
    usize::try_from(bytes).is_ok_and(|bytes| with_capacity::<u8>(bytes).is_ok())
}
