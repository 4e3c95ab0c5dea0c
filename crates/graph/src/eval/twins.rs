//! Equal nodes of a plan: each is computed once, whatever the store keeps.

use std::collections::HashMap;

use super::{
    Key,
    key::Origins,
    plan::{Coarser, Plan, Source, Step},
};
use crate::job::Wanted;

impl<'g> Plan<'g> {
    /// Has equal nodes computed once: what reads a step with the key and the world of an earlier one reads the earlier
    /// one, if its window covers what is read. Nothing needs the other then.
    pub(super) fn share(&mut self, origins: &[Option<Origins>]) {
        let mut known: HashMap<Key, Vec<usize>> = HashMap::new();
        let mut instead: Vec<usize> = (0..self.steps.len()).collect();
        for (at, origins) in origins.iter().enumerate() {
            let step = &mut self.steps[at];
            for input in &mut step.inputs {
                if let Source::Wire { step, .. } = input {
                    *step = instead[*step];
                }
            }
            if let Coarser::State(below) | Coarser::Results(below) = &mut step.below {
                *below = instead[*below];
            }
            let Some(origins) = origins else { continue };
            let step = &self.steps[at];
            let earlier = known.entry(origins.key).or_default();
            let equal = earlier.iter().copied().find(|first| {
                let first = &self.steps[*first];
                first.level == step.level
                    && first.below == step.below
                    && first.has_state == step.has_state
                    && first.wanted.contains(&step.wanted)
            });
            match equal {
                Some(first) => {
                    instead[at] = first;
                    let byproducts = step.byproducts;
                    let all = (0..step.outputs()).filter(|output| byproducts.contains(*output));
                    self.steps[first].byproducts = all.fold(self.steps[first].byproducts, Wanted::with);
                    self.twins.push((first, at));
                }
                None => earlier.push(at),
            }
        }
        for target in self.targets.iter_mut().flatten() {
            target.step = instead[target.step];
        }
    }

    /// The steps in whose place a step is read.
    pub(super) fn twins(&self, of: usize) -> impl Iterator<Item = &Step<'g>> {
        self.twins.iter().filter(move |(first, _)| *first == of).map(|(_, twin)| &self.steps[*twin])
    }
}
