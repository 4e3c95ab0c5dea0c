//! Fitting: the parameters of a graph, or a field that it reads, for which its heightfield comes closest to a target.

mod field;
mod grid;
mod parameter;
mod place;
mod simplex;

use std::cell::RefCell;

use orograph_graph::{Cancel, Field, NodeError, OutputDecl, PortType, memory::REMEDY};
use orograph_nodes::measure::compare::Reference;

use self::parameter::FIRST;
pub use self::{
    field::{FieldFit, FieldInput, FieldTrial, FittedField, LEAST, write},
    parameter::Parameter,
    place::Vary,
};
use super::{Builder, request::Request};
use crate::report::{
    failure::{Exit, Failure},
    progress::Quiet,
};

/// The largest distance that counts, in natural spreads, so that one measure cannot rule the loss.
pub const LIMIT: f64 = 5.0;

/// The side of the simplex at which the search ends, as a share of the ranges.
const LAST: f64 = 0.005;

/// A search that lowers the loss by less than this share is followed by one with a smaller simplex.
const WORTH: f64 = 0.03;

/// The side of the simplex over that of the next smaller one.
const SMALLER: f64 = 2.5;

/// Positions of a search lie on a grid with this many lines to a side of its simplex. Values are evaluated
/// once, so a simplex smaller than the grid costs nothing.
const GRID: f64 = 16.0;

/// Factors of fitted values at which the loss around it is evaluated.
pub const AROUND: [f64; 4] = [0.9, 0.95, 1.05, 1.1];

/// Values of the parameters, with the loss of the terrain that they build.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// In the order of the parameters.
    pub values: Vec<f64>,
    /// Root mean square of the limited distances.
    pub loss: f64,
}

/// A search for the values of parameters.
pub struct Fit<'a> {
    request: &'a Request,
    output: OutputDecl,
    builder: &'a Builder,
    target: Reference,
    /// The parameters.
    pub parameters: Vec<Parameter>,
    cancel: &'a Cancel,
    /// All evaluations of the search, in order.
    trials: RefCell<Vec<Trial>>,
    /// Why the search ends early.
    failure: RefCell<Option<Failure>>,
}

/// The result of a search.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The evaluations of the search, in order; the first one has the values of the file.
    pub trials: Vec<Trial>,
    /// The one with the least loss.
    pub best: Trial,
    /// Per parameter, the loss at the factors of [`AROUND`]; NaN outside of the declared range. Empty if stopped.
    pub around: Vec<[f64; 4]>,
    /// True if it was stopped before its end.
    pub stopped: bool,
}

impl<'a> Fit<'a> {
    /// Prepares a fit: measures the target and its quarters.
    ///
    /// # Errors
    /// When the graph builds no height, the target has nothing to compare, or it is cancelled.
    pub fn new(
        request: &'a Request,
        builder: &'a Builder,
        target: &Field,
        parameters: Vec<Parameter>,
        cancel: &'a Cancel,
    ) -> Result<Self, Failure> {
        let output = height_output(request)?;
        let target = Reference::of(target, cancel).map_err(failure)?;
        if target.measures().next().is_none() {
            return Err(Failure::wrong("the target has no measure whose spread among its quarters is known")
                .hint("use a target of at least some 60 cells of 90 m per side, with relief"));
        }
        let (trials, failure) = (RefCell::default(), RefCell::default());
        Ok(Self { request, output, builder, target, parameters, cancel, trials, failure })
    }

    /// The number of measures that are compared.
    #[must_use]
    pub fn measures(&self) -> usize {
        self.target.measures().count()
    }

    /// Searches with at most this many evaluations; `tell` receives each evaluation with its number. The loss around
    /// the result takes four more per parameter.
    ///
    /// When it is cancelled, the result is the best so far.
    ///
    /// # Errors
    /// When the terrain of the file cannot be built, memory or disk do not suffice, or it is cancelled before the first
    /// evaluation has ended.
    pub fn run(&self, evaluations: usize, tell: &dyn Fn(usize, &Trial)) -> Result<Fitted, Failure> {
        let start: Vec<f64> = self.parameters.iter().map(|parameter| parameter.start).collect();
        let first = Trial { loss: self.loss(&start)?, values: start };
        tell(1, &first);
        self.trials.borrow_mut().push(first);
        let mut turn = 1.0;
        loop {
            let before = self.best().loss;
            let mut side = FIRST;
            while side > LAST && !self.is_over(evaluations) {
                let best = self.best();
                self.search(&best, turn * side, evaluations, tell);
                // a loss of 0 cannot fall
                if self.best().loss >= (1.0 - WORTH) * best.loss {
                    side /= SMALLER;
                }
                turn = -turn;
            }
            if self.is_over(evaluations) || self.best().loss >= (1.0 - WORTH) * before {
                break;
            }
        }
        let failed = self.failure.borrow_mut().take();
        let mut stopped = match failed {
            Some(failure) if failure.exit != Exit::Stopped => return Err(failure),
            other => other.is_some(),
        };
        let best = self.best();
        let mut around = Vec::new();
        if !stopped {
            around = match self.around(&best) {
                Err(failure) if failure.exit == Exit::Stopped => Vec::new(),
                found => found?,
            };
            stopped = around.is_empty();
        }
        Ok(Fitted { trials: self.trials.borrow().clone(), best, around, stopped })
    }

    /// True if no further evaluation may begin.
    fn is_over(&self, evaluations: usize) -> bool {
        self.trials.borrow().len() >= evaluations || self.failure.borrow().is_some() || self.cancel.is_cancelled()
    }

    /// Runs the simplex method once, from the given values.
    fn search(&self, from: &Trial, side: f64, evaluations: usize, tell: &dyn Fn(usize, &Trial)) {
        let steps: Vec<f64> = self.parameters.iter().map(|parameter| parameter.step(side)).collect();
        let values = self.parameters.iter().zip(&from.values);
        let start: Vec<f64> = values.map(|(parameter, value)| parameter.position(*value)).collect();
        let cost = |position: &[f64]| {
            // the grid has its origin at the start, which need not be evaluated again
            let axes = position.iter().zip(&start).zip(&steps);
            let snapped = axes.map(|((x, origin), step)| origin + ((x - origin) / step * GRID).round() * step / GRID);
            self.cost(&snapped.collect::<Vec<f64>>(), evaluations, tell)
        };
        simplex::minimise(&cost, &start, &steps, evaluations as u64);
    }

    /// The evaluation with the least loss; the earliest of several.
    fn best(&self) -> Trial {
        let trials = self.trials.borrow();
        let least = trials.iter().min_by(|a, b| a.loss.total_cmp(&b.loss));
        least.cloned().unwrap_or(Trial { values: Vec::new(), loss: f64::NAN })
    }

    /// The loss at a position of the search. Values that were evaluated before are not evaluated again.
    fn cost(&self, position: &[f64], evaluations: usize, tell: &dyn Fn(usize, &Trial)) -> f64 {
        let values: Vec<f64> =
            self.parameters.iter().zip(position).map(|(parameter, at)| parameter.value(*at)).collect();
        let known = self.trials.borrow().iter().find(|trial| trial.values == values).map(|trial| trial.loss);
        let count = self.trials.borrow().len();
        if let Some(loss) = known {
            return loss;
        }
        if self.is_over(evaluations) {
            return LIMIT;
        }
        let loss = match self.loss(&values) {
            Ok(loss) => loss,
            // A node that refuses these values
            Err(failure) if failure.exit == Exit::Wrong => LIMIT,
            Err(failure) => {
                *self.failure.borrow_mut() = Some(failure);
                return LIMIT;
            }
        };
        let trial = Trial { values, loss };
        tell(count + 1, &trial);
        self.trials.borrow_mut().push(trial);
        loss
    }

    /// Builds the terrain of these values and compares it with the target.
    fn loss(&self, values: &[f64]) -> Result<f64, Failure> {
        let settings: Vec<_> =
            self.parameters.iter().zip(values).map(|(parameter, value)| parameter.setting(*value)).collect();
        let request = self.request.with(&settings, None, "--vary")?;
        let output = request.outputs.iter().find(|output| output.name == self.output.name).unwrap_or(&self.output);
        let (built, _) = self.builder.evaluate(&request, &[output.port], self.cancel, &Quiet)?;
        let Some(height) = built.first().and_then(|value| value.as_field()) else {
            return Err(Failure::unable(format!("`{}` was not built", self.output.name)));
        };
        let distances = self.target.distances(height, self.cancel).map_err(failure)?;
        Ok(loss(distances.iter().map(|(_, distance)| *distance)))
    }

    /// The loss around a result.
    fn around(&self, best: &Trial) -> Result<Vec<[f64; 4]>, Failure> {
        let mut all = Vec::with_capacity(self.parameters.len());
        for (at, parameter) in self.parameters.iter().enumerate() {
            let mut losses = [f64::NAN; 4];
            for (loss, factor) in losses.iter_mut().zip(AROUND) {
                let mut values = best.values.clone();
                values[at] = parameter.stated(factor * best.values[at]);
                let is_allowed = (parameter.hard[0]..=parameter.hard[1]).contains(&values[at]);
                if is_allowed && values[at] != best.values[at] {
                    *loss = match self.loss(&values) {
                        Err(failure) if failure.exit == Exit::Wrong => f64::NAN,
                        found => found?,
                    };
                }
            }
            all.push(losses);
        }
        Ok(all)
    }
}

/// Root mean square of distances, each limited; an undefined distance counts as the limit.
fn loss(distances: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for distance in distances {
        let limited = if distance.is_nan() { LIMIT } else { distance.abs().min(LIMIT) };
        sum += limited * limited;
        count += 1.0;
    }
    f64::sqrt(sum / count)
}

/// The output `height`, or else the only output that is a height.
fn height_output(request: &Request) -> Result<OutputDecl, Failure> {
    let heights: Vec<&OutputDecl> = request.outputs.iter().filter(|output| output.ty == PortType::Height).collect();
    let file = request.path.display();
    match heights.as_slice() {
        [only] => Ok((*only).clone()),
        [] => Err(Failure::wrong(format!("`{file}` has no height among its outputs"))
            .hint("add the height to `outputs`, such as `outputs: { \"height\": \"NODE\" }`")),
        several => {
            several.iter().find(|output| output.name == "height").map(|output| (*output).clone()).ok_or_else(|| {
                let names: Vec<String> = several.iter().map(|output| format!("`{}`", output.name)).collect();
                Failure::wrong(format!("any of the outputs {} of `{file}` may be the one to fit", names.join(", ")))
                    .hint("name the output to fit `height`")
            })
        }
    }
}

/// Why heights could not be measured.
fn failure(error: NodeError) -> Failure {
    match error {
        NodeError::Cancelled => Failure::stopped(),
        NodeError::OutOfMemory(refused) => Failure::unable(format!("cannot measure heights: {refused}")).hint(REMEDY),
        NodeError::Failed { message, hint } => Failure { hint, ..Failure::wrong(message) },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_distance_does_not_rule_the_loss() {
        assert_eq!(loss([3.0, -4.0].into_iter()), f64::sqrt(12.5));
        assert_eq!(loss([1e9, 0.0].into_iter()), loss([-LIMIT, 0.0].into_iter()));
        assert_eq!(loss([f64::NAN, f64::INFINITY].into_iter()), LIMIT);
    }
}
