//! Measures of a height field: the reports of all nodes of the category `measure`, and the differences between two
//! fields.

use std::path::PathBuf;

use orograph_graph::{
    Cancel, Fallback, Field, InputValue, Job, Measure, Node, NodeError, ParamValue, ParamValues, PortType, Registry,
    Report, Value, Warnings, Window, World, memory::REMEDY,
};
use orograph_nodes::measure::compare::{self, Kind};
use serde::Serialize;

use super::failure::Failure;

/// Runs every measuring node that needs only a height, with its defaults, and joins the reports. Cells without a height
/// (NaN) are not measured, and water leaves there.
///
/// # Errors
/// When a node cannot measure the field, or it is cancelled.
pub fn measure(height: &Field, registry: &Registry, cancel: &Cancel) -> Result<Report, Failure> {
    let mut joined = Report::default();
    for node in registry.nodes().iter().filter(|node| node.measures_height()) {
        let Some(inputs) = inputs(node, height) else { continue };
        let report = report(node, &ParamValues::defaults(&node.specs()), inputs, cancel)?;
        joined.measures.extend(report.measures);
        joined.series.extend(report.series);
        joined.notes.extend(report.notes);
    }
    Ok(joined)
}

/// What a terrain is compared with.
#[derive(Clone, Copy, Debug)]
pub enum Against<'a> {
    /// Another heightfield.
    Field(&'a Field),
    /// A kind of real terrain.
    Kind(Kind),
}

/// The report of Compare: the realism score, and the distance of each measure in natural spreads.
///
/// # Errors
/// When it is cancelled, or there is not enough memory.
pub fn compare(height: &Field, against: Against<'_>, cancel: &Cancel) -> Result<Report, Failure> {
    let wired = |field: &Field| InputValue::Value(Value::Field(field.clone()));
    let mut params = ParamValues::defaults(&compare::NODE.specs());
    let reference = match against {
        Against::Field(field) => wired(field),
        Against::Kind(kind) => {
            params.set("kind", ParamValue::Choice(kind.name()));
            InputValue::Absent
        }
    };
    report(&compare::NODE, &params, vec![wired(height), reference], cancel)
}

/// The report of one node.
fn report(node: &Node, params: &ParamValues, inputs: Vec<InputValue>, cancel: &Cancel) -> Result<Report, Failure> {
    let window = inputs.iter().find_map(|input| match input {
        InputValue::Value(Value::Field(field)) => Some(*field.window()),
        _ => None,
    });
    let job = Job {
        node,
        params,
        inputs,
        window: window.unwrap_or_else(|| Window::whole(World::default())),
        wanted: orograph_graph::Wanted::ALL,
        folder: PathBuf::new(),
        cancel: cancel.clone(),
        progress: &|_| {},
        level: orograph_graph::LevelJob::default(),
        warnings: Warnings::default(),
        glimpses: None,
    };
    let mut outputs = (node.cpu)(&job).map_err(|error| failure(node, error))?;
    let mut joined = Report::default();
    for output in node.outputs {
        if let Some(Value::Report(report)) = outputs.take(output.name) {
            joined.measures.extend_from_slice(&report.measures);
            joined.series.extend_from_slice(&report.series);
            joined.notes.extend_from_slice(&report.notes);
        }
    }
    Ok(joined)
}

/// The height for every required input. Returns None when another input is required too.
fn inputs(node: &Node, height: &Field) -> Option<Vec<InputValue>> {
    let stand_in = |fallback| match fallback {
        Fallback::Required => None,
        Fallback::None => Some(InputValue::Absent),
        Fallback::Constant { default, .. } => Some(InputValue::Constant(default)),
    };
    let value = InputValue::Value(Value::Field(height.clone()));
    let inputs = node.inputs.iter().map(|input| match (input.ty, input.fallback) {
        (PortType::Height | PortType::AnyScalar, Fallback::Required) => Some(value.clone()),
        (_, fallback) => stand_in(fallback),
    });
    inputs.collect()
}

fn failure(node: &Node, error: NodeError) -> Failure {
    match error {
        NodeError::Cancelled => Failure::stopped(),
        NodeError::OutOfMemory(refused) => Failure::unable(format!("{}: {refused}", node.id)).hint(REMEDY),
        NodeError::Failed { message, hint } => Failure { hint, ..Failure::wrong(format!("{}: {message}", node.id)) },
    }
}

/// The difference of a field from a reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Distance {
    /// Each measure of the field minus that of the reference.
    pub measures: Vec<Measure>,
    /// The report of [`compare()`].
    pub compared: Report,
    /// Of heights cell by cell; None when the two have different cells, or for a kind of terrain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heights: Option<HeightDistance>,
}

/// Differences of heights, cell by cell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HeightDistance {
    /// Mean difference in metres: above zero where the field is higher than the reference.
    pub mean_m: f64,
    /// Root of the mean squared difference in metres.
    pub root_mean_square_m: f64,
    /// Largest absolute difference in metres.
    pub largest_m: f64,
}

/// The difference of a field from a reference, from the measures of both. Heights are compared where both are known.
///
/// # Errors
/// Those of [`compare()`].
pub fn distance(field: (&Field, &Report), reference: (&Field, &Report), cancel: &Cancel) -> Result<Distance, Failure> {
    let (a, b) = (field.1, reference.1);
    let measures = a.measures.iter().filter_map(|measure| {
        b.get(&measure.name).map(|other| Measure { value: measure.value - other, ..measure.clone() })
    });
    Ok(Distance {
        measures: measures.collect(),
        compared: compare(field.0, Against::Field(reference.0), cancel)?,
        heights: heights(field.0, reference.0),
    })
}

fn heights(field: &Field, reference: &Field) -> Option<HeightDistance> {
    let same_cells = field.window().cells == reference.window().cells;
    let same_size = (field.window().cell_m() / reference.window().cell_m() - 1.0).abs() < 1e-6;
    if !same_cells || !same_size {
        return None;
    }
    let (mut count, mut sum, mut squares, mut largest) = (0.0, 0.0, 0.0, 0f64);
    let differences = field.samples().iter().zip(reference.samples()).map(|(a, b)| f64::from(*a) - f64::from(*b));
    for difference in differences.filter(|difference| !difference.is_nan()) {
        count += 1.0;
        sum += difference;
        squares += difference * difference;
        largest = largest.max(difference.abs());
    }
    (count > 0.0).then(|| HeightDistance {
        mean_m: sum / count,
        root_mean_square_m: (squares / count).sqrt(),
        largest_m: largest,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_cover_measures_distributions_and_cells() {
        let world = World { size: [360.0, 360.0], cells: [4, 4], ..World::default() };
        let field = |lift: f32| Field::new(Window::whole(world), (0..16).map(|v| (v * v) as f32 + lift).collect());
        let report = |relief: f64| {
            let mut report = Report::default();
            report.measure("relief", relief, "m");
            report
        };
        let cancel = Cancel::default();
        let differ = |a: (&Field, &Report), b: (&Field, &Report)| distance(a, b, &cancel).expect("a distance");
        let found = differ((&field(3.0), &report(5.0)), (&field(0.0), &report(2.0)));
        assert_eq!(found.measures[0].value, 3.0);
        assert_eq!(found.compared.get("slope_distance"), Some(0.0));
        let heights = found.heights.expect("the same cells");
        assert_eq!((heights.mean_m, heights.root_mean_square_m, heights.largest_m), (3.0, 3.0, 3.0));
        let other = Field::constant(Window::whole(World { cells: [8, 8], ..world }), 0.0);
        assert_eq!(differ((&other, &report(1.0)), (&field(0.0), &report(1.0))).heights, None);
    }
}
