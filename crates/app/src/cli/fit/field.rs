//! An input that is fitted as a field.

use std::path::Path;

use orograph_graph::Unit;
use serde_json::{Value, json};

use super::{AROUND_HEADS, Args, digits};
use crate::{
    build::{
        fit::{AROUND, FieldFit, FieldInput, FieldTrial, FittedField, LEAST, write},
        request::Request,
    },
    report::{
        failure::Failure,
        terminal::{self, Align, Page, Table, counted},
    },
};

/// The usual number of evaluations.
const EVALUATIONS: usize = 20;

/// Fits the field, and writes and prints the result.
pub(super) fn run(args: &Args, request: &Request) -> Result<(), Failure> {
    let evaluations = args.evaluations(EVALUATIONS);
    if evaluations < LEAST {
        return Err(Failure::wrong(format!("{} cannot fit a field", counted(evaluations, "evaluation")))
            .hint(format!("allow at least {LEAST}: `--evaluations {EVALUATIONS}`")));
    }
    let input = FieldInput::of(request, &args.vary[0])?;
    let raster = args.out.with_extension(format!("{}.asc", input.suffix()));
    let same = |path: &Path| raster.canonicalize().ok().is_some_and(|own| path.canonicalize().ok() == Some(own));
    if same(&args.target) || request.document.files().iter().any(|file| same(file)) {
        let raster = raster.display();
        return Err(Failure::wrong(format!("the field would replace `{raster}`, which is read"))
            .hint("write to a graph file of another name"));
    }
    let target = args.target()?;
    let (builder, cancel) = args.builder()?;
    let fit = FieldFit::new(request, &builder, &target, input, &cancel)?;
    let unit = fit.input.unit;
    let tell = |number: usize, trial: &FieldTrial| {
        if !args.json {
            let [low, mean, high] = summary(trial).map(|value| shown(unit, value));
            let loss = digits(trial.loss);
            terminal::remark(&format!("{number:4}  loss {loss:<8} {} {mean} ({low} to {high})\n", fit.input.place));
        }
    };
    let fitted = fit.run(evaluations, &tell)?;
    // first the raster, so that the graph never names one that is not there
    write(&raster, &fit.input.as_text(&fitted.best.values))?;
    let mut document = request.document.clone();
    document.move_to(&args.out);
    let name = raster.file_name().unwrap_or_default().to_string_lossy();
    fit.input.wire(&mut document, &name)?;
    args.save(&document)?;
    args.print(|| as_json(args, &raster, &fit, &fitted), |page| as_text(args, &raster, &fit, &fitted, page))?;
    args.ended(fitted.stopped, fitted.trials.len())
}

/// The lowest, the mean and the highest value of a field.
fn summary(trial: &FieldTrial) -> [f64; 3] {
    let values = || trial.values.iter().map(|value| f64::from(*value));
    [
        values().fold(f64::INFINITY, f64::min),
        values().sum::<f64>() / trial.values.len() as f64,
        values().fold(f64::NEG_INFINITY, f64::max),
    ]
}

/// A value with four digits and its unit.
fn shown(unit: Unit, value: f64) -> String {
    unit.display(format!("{value:.3e}").parse().unwrap_or(value))
}

fn as_json(args: &Args, raster: &Path, fit: &FieldFit<'_>, fitted: &FittedField) -> Value {
    let around = AROUND.iter().zip(&fitted.around).map(|(factor, loss)| json!({ "factor": factor, "loss": loss }));
    let own = json!({
        "raster": raster.display().to_string(),
        "input": fit.input.place, "unit": fit.input.unit.symbol(), "range": fit.input.range,
        "wavelength_m": fit.input.wavelength_m, "grid": fit.input.values(),
        "measures_loss_at_start": fitted.measures.map(|[start, _]| start),
        "measures_loss": fitted.measures.map(|[_, end]| end),
        "values": fitted.best.values,
        "around": around.collect::<Vec<_>>(),
        "evaluations": fitted.trials.iter().map(|trial| json!({ "loss": trial.loss })).collect::<Vec<_>>(),
    });
    args.result([fitted.trials[0].loss, fitted.best.loss], fitted.stopped, own)
}

/// The result as a table.
fn as_text(args: &Args, raster: &Path, fit: &FieldFit<'_>, fitted: &FittedField, page: Page) -> String {
    let mut columns = vec![("field", Align::Left), ("", Align::Left)];
    columns.extend(["lowest", "mean", "highest"].map(|head| (head, Align::Right)));
    if !fitted.around.is_empty() {
        columns.extend(AROUND_HEADS.map(|head| (head, Align::Right)));
    }
    let mut table = Table::new(&columns);
    for (name, trial) in [("start", &fitted.trials[0]), ("fitted", &fitted.best)] {
        let is_fitted = name == "fitted";
        let place = if is_fitted { String::new() } else { page.name(&fit.input.place) };
        let mut row = vec![place, page.dim(name)];
        row.extend(summary(trial).map(|value| shown(fit.input.unit, value)));
        row.extend(fitted.around.iter().map(|loss| if is_fitted { digits(*loss) } else { String::new() }));
        table.row(row);
    }
    let note = match fitted.around.is_empty() {
        true => "",
        false => "\nat the right, the loss when the whole fitted field changes by that much",
    };
    let measures = fitted.measures.map_or_else(String::new, |[start, end]| {
        format!("\n{}", page.dim(&format!("loss by measures {}, from {}", digits(end), digits(start))))
    });
    let [columns, rows] = fit.input.values();
    format!(
        "{}{}\n{} {} and {}  loss {} {}{measures}\n",
        table.render(page, 0),
        page.dim(note),
        page.good("fitted"),
        page.name(&args.out.display().to_string()),
        page.name(&raster.display().to_string()),
        page.bold(&digits(fitted.best.loss)),
        page.dim(&format!(
            "(from {}; {columns} x {rows} values, {})",
            digits(fitted.trials[0].loss),
            counted(fitted.trials.len(), "evaluation")
        )),
    )
}
