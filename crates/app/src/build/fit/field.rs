//! Fitting an input of a node as a field: a coarse grid of values, which is corrected where the terrain differs from the
//! target.
//!
//! The terrain answers locally to uplift and rock: a young range by its height, one in balance by its slope. So each
//! value is corrected by the differences of height and slope around it, each weighted by how much it answered when all
//! values were changed together (Gauss-Newton with the diagonal of the response). Dozens of values need some fifteen
//! builds.

use std::path::Path;

use orograph_graph::{Cancel, Document, Edit, Fallback, Field, OutputDecl, Port, Unit, Window};
use orograph_nodes::{
    combine::remap::quantity_of,
    measure::compare::Reference,
    numerics::math,
    raster::{self, GridAxis, resample},
};

use super::{
    AROUND, failure,
    grid::{Grid, slopes},
    height_output, loss, place,
    place::Vary,
};
use crate::{
    build::{Builder, request::Request},
    report::{
        failure::{Exit, Failure},
        progress::Quiet,
    },
};

/// The fewest cells of the world along the wavelength.
const CELLS: f64 = 4.0;
/// The least number of builds: one of the start, one for the response, one of a correction.
pub const LEAST: usize = 3;
/// By how much all values are changed to see the response: by a factor of e to the power of this, or by this share of
/// the range.
const CHANGE: [f64; 2] = [0.2, 0.05];
/// The largest correction at once, likewise.
const FAR: [f64; 2] = [1.0, 0.25];
/// The share of a correction that is made, as neighbours correct the same difference.
const SHARE: f64 = 0.7;
/// Corrections after which the share falls, so that the search ends where rivers change their courses.
const WHOLE: usize = 6;
/// Where the terrain answers less than this share of the median, it counts as if it answered as much.
const ANSWER: f64 = 0.2;
/// Corrections in a row without a gain of a hundredth that end the search.
const PATIENCE: usize = 5;

/// An input of a node that is fitted as a field.
#[derive(Clone, Debug)]
pub struct FieldInput {
    /// `NODE.INPUT`.
    pub place: String,
    /// Its unit.
    pub unit: Unit,
    /// The range of the search.
    pub range: [f64; 2],
    /// The shortest wavelength in metres.
    pub wavelength_m: f64,
    node: String,
    input: &'static str,
    /// What `Import` or `Remap` call its quantity.
    quantity: &'static str,
    start: Start,
    grid: Grid,
}

/// What an input has at the start.
#[derive(Clone, Copy, Debug)]
enum Start {
    Wired(Port),
    Number(f64),
}

impl FieldInput {
    /// Finds the input in the document of a request.
    ///
    /// # Errors
    /// When there is no such input, it takes no numbers, or the range or the wavelength make no sense.
    pub fn of(request: &Request, vary: &Vary) -> Result<Self, Failure> {
        let (name, document) = (&vary.place, &request.document);
        let wrong = |what: &str| Failure::wrong(format!("`--vary {name}`: {what}"));
        let wavelength_m = vary.wavelength_m.unwrap_or_default();
        let Some((node, input)) = name.split_once('.') else {
            return Err(wrong("a field belongs to the input of a node").hint("write `--vary NODE.INPUT@WAVELENGTH`"));
        };
        let index = place::node(document, node, &wrong)?;
        let instance = document.graph().instance(index);
        let inputs = instance.node.inputs;
        let numbers = inputs.iter().filter(|input| quantity_of(input.ty).is_some());
        let all: Vec<&str> = numbers.map(|input| input.name).collect();
        let at = inputs.iter().position(|known| known.name == input);
        let Some((at, quantity)) = at.and_then(|at| Some((at, quantity_of(inputs[at].ty)?))) else {
            let hint = match orograph_graph::closest(input, all.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None if all.is_empty() => format!("no input of `{node}` does"),
                None => format!("those of `{node}` that do are {}", all.join(", ")),
            };
            return Err(wrong("it is no input that takes a field of numbers").hint(hint));
        };
        let Fallback::Constant { default, hard, soft } = inputs[at].fallback else {
            return Err(wrong("it has no range of values").hint(format!("fit another input: {}", all.join(", "))));
        };
        let unit = inputs[at].ty.unit();
        let range = match &vary.range {
            Some(text) => place::typed(text, unit).map_err(|why| wrong(&why).hint("write `=LO..HI`"))?,
            None => soft,
        };
        place::check_range(range, hard, unit, &wrong)?;
        let (size, cell_m) = (request.world.size, request.world.cell_m());
        let [least, most] = [CELLS * cell_m, size[0].max(size[1])];
        if !(least..=most).contains(&wavelength_m) {
            let shown = [wavelength_m, least, most].map(|length| Unit::Metres.display(length));
            let what = format!("a wavelength of {} does not fit the world and its cells", shown[0]);
            return Err(wrong(&what).hint(format!("choose one from {} to {}, or more `--cells`", shown[1], shown[2])));
        }
        let start = match document.graph().source(index, at) {
            Some(port) => Start::Wired(
                document
                    .expand()
                    .port(port)
                    .ok_or_else(|| wrong("what is wired to it is not built").hint("unmute the node that it reads"))?,
            ),
            None => Start::Number(instance.constants[at].unwrap_or(default)),
        };
        let (place, node) = (name.clone(), node.to_owned());
        let grid = Grid::new(size, wavelength_m);
        Ok(Self { place, unit, range, wavelength_m, node, input: inputs[at].name, quantity, start, grid })
    }

    /// Values of the grid along x and y.
    #[must_use]
    pub const fn values(&self) -> [usize; 2] {
        self.grid.values
    }

    /// The text of a raster file with these values.
    #[must_use]
    pub fn as_text(&self, values: &[f32]) -> String {
        self.grid.as_text(values)
    }

    /// The end of the name of the raster file.
    #[must_use]
    pub fn suffix(&self) -> String {
        format!("{}_{}", self.node, self.input)
    }

    /// Wires a raster file to the input, instead of what it had.
    ///
    /// # Errors
    /// When the document does not take it.
    pub fn wire(&self, document: &mut Document, file: &str) -> Result<(), Failure> {
        let is_free = |name: &String| document.node(name).is_none();
        let free = |stem: String| {
            let more = (2..).map(|number| format!("{stem}_{number}"));
            std::iter::once(stem.clone()).chain(more).find(is_free).unwrap_or(stem)
        };
        let direct = ["height", "mask", "scalar"].contains(&self.quantity);
        let stem = self.suffix();
        let own = free(if direct { stem.clone() } else { format!("{stem}_map") });
        let quoted = serde_json::Value::from(file);
        let quantity = if direct { self.quantity } else { "scalar" };
        let text = format!("Import(version: 2, file: {quoted}, quantity: {quantity}, placement: stretch)");
        let mut edits = vec![Edit::AddWritten { name: own.clone(), text, at: None }];
        let mut from = own.clone();
        if !direct {
            from = free(stem);
            let text = format!("Remap(value: \"{own}\", quantity: {}, clamp: false)", self.quantity);
            edits.push(Edit::AddWritten { name: from.clone(), text, at: None });
        }
        edits.push(Edit::Connect { from, to: self.node.clone(), input: self.input.to_owned() });
        let wrong = |error: orograph_graph::EditError| Failure::wrong(format!("`--vary {}`: {error}", self.place));
        document.apply(&Edit::All(edits)).map_err(wrong)
    }
}

/// A build of a search: the values, and how far the terrain is from the target.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldTrial {
    /// The values of the grid, rows from the north.
    pub values: Vec<f32>,
    /// Root mean square of the differences in height and slope around the values, in units of the target's standard
    /// deviations.
    pub loss: f64,
}

/// The result of a search.
#[derive(Clone, Debug)]
pub struct FittedField {
    /// All builds in order; the first has the values of the file.
    pub trials: Vec<FieldTrial>,
    /// The one with the least loss.
    pub best: FieldTrial,
    /// The loss by the measures of `Compare` at the start and at the end; None if the target is too small for them.
    pub measures: Option<[f64; 2]>,
    /// The loss when all values are multiplied by [`AROUND`]; NaN outside of the range. Empty if stopped.
    pub around: Vec<f64>,
    /// True if it was stopped before its end.
    pub stopped: bool,
}

/// What is compared of a terrain, around each value of the grid: the means of height and slope.
type Seen = [Vec<f64>; 2];

/// A search for the values of a field.
pub struct FieldFit<'a> {
    request: &'a Request,
    builder: &'a Builder,
    output: OutputDecl,
    /// The input.
    pub input: FieldInput,
    target: Seen,
    /// One over the variance of the target's heights and slopes.
    weights: [f64; 2],
    reference: Reference,
    folder: tempfile::TempDir,
    cancel: &'a Cancel,
    /// The values at the start.
    start: Vec<f64>,
    /// True if values are changed by factors, and not by sums: if all are positive at the start.
    by_factors: bool,
}

impl<'a> FieldFit<'a> {
    /// Prepares a fit: finds the input, and measures the target.
    ///
    /// # Errors
    /// When the input or the target cannot be used, or it is cancelled.
    pub fn new(
        request: &'a Request,
        builder: &'a Builder,
        target: &Field,
        input: FieldInput,
        cancel: &'a Cancel,
    ) -> Result<Self, Failure> {
        let output = height_output(request)?;
        let (own, other) = (&request.world, target.window());
        let size = other.world.size;
        if (0..2).any(|axis| (own.size[axis] - size[axis]).abs() > own.cell_m().max(other.cell_m())) {
            let [a, b] = [size, own.size].map(|size| size.map(|side| Unit::Metres.display(side)).join(" x "));
            return Err(Failure::wrong(format!("the target covers {a}, but the world {b}")).hint(
                "a field is fitted at its place: cut the target, or set the size of the world to that of the target",
            ));
        }
        let check = || if cancel.is_cancelled() { Err(orograph_graph::NodeError::Cancelled) } else { Ok(()) };
        let source = [other.nx(), other.ny()];
        let axis = |axis: usize| {
            GridAxis { source: source[axis], offset: 0.0, step: source[axis] as f64 / f64::from(own.cells[axis]) }
                .snapped()
        };
        let heights =
            resample(target.plane(0), [axis(0), axis(1)], [0, 0], own.cells, None, &check).map_err(failure)?;
        let target_seen = seen(&input.grid, &Field::new(Window::whole(*own), heights));
        let weights = [0, 1].map(|at| 1.0 / variance(&target_seen[at]));
        if !weights.iter().all(|weight| weight.is_finite()) {
            return Err(Failure::wrong("the target has the same height or slope everywhere at this wavelength")
                .hint("use a target with relief, or a shorter wavelength"));
        }
        let reference = Reference::of(target, cancel).map_err(failure)?;
        let folder = tempfile::tempdir().map_err(|error| {
            Failure::unable(format!("cannot make a temporary folder: {error}")).hint("free space for temporary files")
        })?;
        let start = start(request, builder, &input, cancel)?;
        let by_factors = start.iter().all(|value| *value > 0.0);
        let target = target_seen;
        Ok(Self { request, builder, output, input, target, weights, reference, folder, cancel, start, by_factors })
    }

    /// Searches with at most this many builds, at least [`LEAST`]; `tell` receives each with its number. The loss around
    /// the result takes four more.
    ///
    /// When it is cancelled, the result is the best so far.
    ///
    /// # Errors
    /// When a terrain cannot be built, the height does not depend on the input, or it is cancelled before the first
    /// build has ended.
    pub fn run(&self, builds: usize, tell: &dyn Fn(usize, &FieldTrial)) -> Result<FittedField, Failure> {
        let mut trials = Vec::new();
        let mut stopped = false;
        match self.search(builds, &mut trials, tell) {
            Err(failure) if failure.exit == Exit::Stopped && !trials.is_empty() => stopped = true,
            other => other?,
        }
        let least = trials.iter().min_by(|a, b| a.loss.total_cmp(&b.loss));
        let best = least.cloned().ok_or_else(Failure::stopped)?;
        let (mut around, mut measures) = (Vec::new(), None);
        if !stopped {
            match self.finish(&trials[0], &best) {
                Err(failure) if failure.exit == Exit::Stopped => stopped = true,
                other => (around, measures) = other?,
            }
        }
        Ok(FittedField { trials, best, measures, around, stopped })
    }

    fn search(
        &self,
        builds: usize,
        trials: &mut Vec<FieldTrial>,
        tell: &dyn Fn(usize, &FieldTrial),
    ) -> Result<(), Failure> {
        let mut build = |positions: &[f64]| -> Result<(Seen, f64), Failure> {
            let values: Vec<f32> = positions.iter().map(|at| self.value(*at) as f32).collect();
            let (seen, loss) = self.compare(&self.height(&values, trials.len())?);
            trials.push(FieldTrial { values, loss });
            tell(trials.len(), &trials[trials.len() - 1]);
            Ok((seen, loss))
        };
        let mut positions: Vec<f64> = self.start.iter().map(|value| self.position(*value)).collect();
        let (mut now, mut least) = build(&positions)?;
        let change = CHANGE[usize::from(!self.by_factors)] * self.unit();
        let (changed, _) = build(&positions.iter().map(|at| at + change).collect::<Vec<_>>())?;
        let answers = self.answers(&now, &changed, change)?;
        let far = FAR[usize::from(!self.by_factors)] * self.unit();
        let mut waited = 0;
        for round in 0..builds.saturating_sub(2) {
            let share = SHARE * (WHOLE as f64 / (round + 1) as f64).min(1.0);
            for (at, position) in positions.iter_mut().enumerate() {
                let rise: f64 = (0..2).map(|k| answers[k][at] * (self.target[k][at] - now[k][at])).sum();
                *position = self.inside(*position + share * rise.clamp(-far, far));
            }
            let loss;
            (now, loss) = build(&positions)?;
            waited = if loss < 0.99 * least { 0 } else { waited + 1 };
            least = least.min(loss);
            if waited == PATIENCE {
                break;
            }
        }
        Ok(())
    }

    /// By how much each value is corrected for a difference of one metre in height, and of one in slope.
    fn answers(&self, before: &Seen, after: &Seen, change: f64) -> Result<Seen, Failure> {
        let mut answers =
            [0, 1].map(|k| before[k].iter().zip(&after[k]).map(|(a, b)| (b - a) / change).collect::<Vec<_>>());
        for answer in &mut answers {
            // where a river has moved, a place may answer the other way round
            let usual = median(answer);
            answer.iter_mut().filter(|value| **value * usual <= 0.0).for_each(|value| *value = 0.0);
        }
        let square = |at: usize| (0..2).map(|k| self.weights[k] * answers[k][at] * answers[k][at]).sum::<f64>();
        let squares: Vec<f64> = (0..self.input.grid.len()).map(square).collect();
        let least = ANSWER * median(&squares);
        if least.is_nan() || least <= 0.0 {
            let what = format!("`--vary {}`: the height does not depend on it", self.input.place);
            return Err(Failure::wrong(what).hint("vary an input of a node that shapes the output"));
        }
        Ok([0, 1].map(|k| {
            answers[k].iter().zip(&squares).map(|(value, square)| self.weights[k] * value / square.max(least)).collect()
        }))
    }

    /// The loss around the best values, and by the measures at the start and at the end.
    fn finish(&self, first: &FieldTrial, best: &FieldTrial) -> Result<(Vec<f64>, Option<[f64; 2]>), Failure> {
        let [lo, hi] = self.input.range;
        let mut around = Vec::with_capacity(AROUND.len());
        for (at, factor) in AROUND.into_iter().enumerate() {
            let values: Vec<f32> = best.values.iter().map(|value| (factor * f64::from(*value)) as f32).collect();
            let is_inside = values.iter().all(|value| (lo..=hi).contains(&f64::from(*value)));
            let name = usize::MAX - at;
            around.push(if is_inside { self.compare(&self.height(&values, name)?).1 } else { f64::NAN });
        }
        if self.reference.measures().next().is_none() {
            return Ok((around, None));
        }
        let mut measures = [f64::NAN; 2];
        for (at, trial) in [first, best].into_iter().enumerate() {
            let height = self.height(&trial.values, usize::MAX - AROUND.len() - at)?;
            let distances = self.reference.distances(&height, self.cancel).map_err(failure)?;
            measures[at] = loss(distances.iter().map(|(_, distance)| *distance));
        }
        Ok((around, Some(measures)))
    }

    /// Builds the terrain of these values, from a file with this number.
    fn height(&self, values: &[f32], number: usize) -> Result<Field, Failure> {
        let path = self.folder.path().join(format!("{number}.asc"));
        write(&path, &self.input.as_text(values))?;
        let mut document = self.request.document.clone();
        self.input.wire(&mut document, &path.to_string_lossy())?;
        let request = self.request.edited(document);
        let output = request.outputs.iter().find(|output| output.name == self.output.name).unwrap_or(&self.output);
        let (built, _) = self.builder.evaluate(&request, &[output.port], self.cancel, &Quiet)?;
        let height = built.first().and_then(|value| value.as_field());
        height.cloned().ok_or_else(|| Failure::unable(format!("`{}` was not built", self.output.name)))
    }

    /// What is seen of a terrain, and its loss.
    fn compare(&self, height: &Field) -> (Seen, f64) {
        let seen = seen(&self.input.grid, height);
        let square = |k: usize| -> f64 {
            let pairs = self.target[k].iter().zip(&seen[k]);
            self.weights[k] * pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>() / seen[k].len() as f64
        };
        let loss = (0.5 * (square(0) + square(1))).sqrt();
        (seen, loss)
    }

    /// The unit of positions: that of logarithms, or the width of the range.
    const fn unit(&self) -> f64 {
        if self.by_factors { 1.0 } else { self.input.range[1] - self.input.range[0] }
    }

    fn position(&self, value: f64) -> f64 {
        if self.by_factors { math::ln(value) } else { value }
    }

    fn value(&self, position: f64) -> f64 {
        let [lo, hi] = self.input.range;
        (if self.by_factors { math::exp(position) } else { position }).clamp(lo, hi)
    }

    /// A position within the range; with factors, a lower end of 0 is never reached.
    fn inside(&self, position: f64) -> f64 {
        let [lo, hi] = self.input.range;
        let lo = if self.by_factors { math::ln(lo.max(1e-6 * hi)) } else { lo };
        position.clamp(lo, self.position(hi))
    }
}

/// The values at the start: those of the file, averaged around each value of the grid.
fn start(request: &Request, builder: &Builder, input: &FieldInput, cancel: &Cancel) -> Result<Vec<f64>, Failure> {
    let [lo, hi] = input.range;
    let values = match input.start {
        Start::Number(number) => vec![number; input.grid.len()],
        Start::Wired(port) => {
            let (built, _) = builder.evaluate(request, &[port], cancel, &Quiet)?;
            let field = built.first().and_then(|value| value.as_field());
            let field = field.ok_or_else(|| Failure::unable(format!("`{}` was not built", input.place)))?;
            input.grid.means(field.plane(0), [field.window().nx(), field.window().ny()])
        }
    };
    Ok(values.iter().map(|value| value.clamp(lo, hi)).collect())
}

/// Writes a raster file as a whole.
///
/// # Errors
/// When it cannot be written.
pub fn write(path: &Path, text: &str) -> Result<(), Failure> {
    raster::replace(path, |file| file.write_all(text.as_bytes())).map_err(|error| {
        let remedy = error.remedy();
        Failure::unable(error.to_string()).hint(remedy)
    })
}

fn seen(grid: &Grid, height: &Field) -> Seen {
    let cells = [height.window().nx(), height.window().ny()];
    [grid.means(height.plane(0), cells), grid.means(&slopes(height), cells)]
}

fn variance(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
