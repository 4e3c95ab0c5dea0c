//! Whether there is memory for a plan, asked before anything runs.

use super::{error::EvalError, needs::Needs, plan::Plan};
use crate::{machine, memory::with_capacity};

/// Refuses a plan whose values would take more than the limit or, without one, more than the machine has to give. The
/// estimate is of samples alive at once when steps run one after another; what kernels use beside their inputs and
/// outputs is not known.
pub(super) fn check(plan: &Plan<'_>, needs: &Needs, limit: Option<u64>) -> Result<(), EvalError> {
    let estimate = estimate(plan, needs);
    let refuse = |(needs, step): (u64, usize), available| EvalError::TooLarge {
        node: plan.steps[step].instance.name.clone(),
        needs,
        available,
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
    Ok(())
}

/// Bytes, and the step at which they are needed.
#[derive(Debug, Default, PartialEq)]
struct Estimate {
    /// What the values found in a cache take already.
    held: u64,
    /// All values alive at once.
    peak: (u64, usize),
    /// What one step reads for itself and gives.
    largest: (u64, usize),
}

fn estimate(plan: &Plan<'_>, needs: &Needs) -> Estimate {
    let held = needs.found.iter().flatten().flatten().map(|value| value.bytes() as u64).sum();
    let mut estimate = Estimate { held, ..Estimate::default() };
    let mut readers = needs.readers.clone();
    let mut alive = held;
    for (at, step) in plan.steps.iter().enumerate().filter(|(at, _)| needs.compute[*at]) {
        let cuts = step.wires().filter(|(source, _)| plan.steps[*source].wanted != step.window);
        let cuts: u64 = cuts.map(|(source, output)| plan.steps[source].output_bytes(output, &step.window)).sum();
        let given: u64 = (0..step.types.len()).map(|output| step.output_bytes(output, &step.window)).sum();
        estimate.largest = estimate.largest.max((cuts + given, at));
        estimate.peak = estimate.peak.max((alive + cuts + given, at));

        let kept = (0..step.types.len()).filter(|output| readers[at][*output] > 0);
        alive += kept.map(|output| step.output_bytes(output, &step.wanted)).sum::<u64>();
        for (source, output) in step.wires() {
            readers[source][output] -= 1;
            if readers[source][output] == 0 {
                let bytes = plan.steps[source].output_bytes(output, &plan.steps[source].wanted);
                alive = alive.saturating_sub(bytes);
            }
        }
    }
    estimate
}

/// Asks the system for so much address space and gives it back untouched.
fn can_allocate(bytes: u64) -> bool {
    usize::try_from(bytes).is_ok_and(|bytes| with_capacity::<u8>(bytes).is_ok())
}
