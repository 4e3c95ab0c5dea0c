//! Numbers that are fitted.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::{AROUND_HEADS, Args, digits};
use crate::{
    build::{
        fit::{AROUND, Fit, Fitted, Parameter, Trial},
        request::Request,
    },
    report::{
        failure::Failure,
        terminal::{self, Align, Page, Table, counted},
    },
};

/// The usual number of evaluations.
const EVALUATIONS: usize = 200;

/// Fits the numbers, and writes and prints the result.
pub(super) fn run(args: &Args, request: &Request) -> Result<(), Failure> {
    let parameters = args.vary.iter().map(|vary| Parameter::of(&request.document, vary));
    let parameters = parameters.collect::<Result<Vec<_>, _>>()?;
    let target = args.target()?;
    let (builder, cancel) = args.builder()?;
    let fit = Fit::new(request, &builder, &target, parameters, &cancel)?;
    let tell = |number: usize, trial: &Trial| {
        if !args.json {
            terminal::remark(&line(number, trial, &fit.parameters));
        }
    };
    let fitted = fit.run(args.evaluations(EVALUATIONS), &tell)?;
    // layout and comments stay
    let mut document = request.document.clone();
    for (parameter, value) in fit.parameters.iter().zip(&fitted.best.values) {
        parameter.setting(*value).apply(&mut document, "--vary")?;
    }
    document.move_to(&args.out);
    args.save(&document)?;
    args.print(|| as_json(args, &fit, &fitted), |page| as_text(&fit, &fitted, &args.out, page))?;
    args.ended(fitted.stopped, fitted.trials.len())
}

fn as_json(args: &Args, fit: &Fit<'_>, fitted: &Fitted) -> Value {
    let values = |trial: &Trial| -> Map<String, Value> {
        fit.parameters
            .iter()
            .zip(&trial.values)
            .map(|(parameter, value)| (parameter.place.clone(), json!(value)))
            .collect()
    };
    let parameter = |(at, parameter): (usize, &Parameter)| {
        let around = fitted.around.get(at).map(|losses| {
            AROUND
                .iter()
                .zip(losses)
                .map(|(factor, loss)| json!({ "factor": factor, "loss": loss }))
                .collect::<Vec<_>>()
        });
        json!({
            "name": parameter.place, "unit": parameter.unit.symbol(), "range": parameter.range,
            "logarithmic": parameter.is_logarithmic(), "start": fitted.trials[0].values[at],
            "fitted": fitted.best.values[at], "around": around,
        })
    };
    let own = json!({
        "measures": fit.measures(),
        "parameters": fit.parameters.iter().enumerate().map(parameter).collect::<Vec<_>>(),
        "evaluations": fitted.trials.iter().map(|trial| json!({ "loss": trial.loss, "values": values(trial) })).collect::<Vec<_>>(),
    });
    args.result([fitted.trials[0].loss, fitted.best.loss], fitted.stopped, own)
}

/// The progress of the search: an evaluation in one line.
fn line(number: usize, trial: &Trial, parameters: &[Parameter]) -> String {
    let value =
        |(parameter, value): (&Parameter, &f64)| format!("{} {}", parameter.place, parameter.unit.display(*value));
    let values: Vec<String> = parameters.iter().zip(&trial.values).map(value).collect();
    format!("{number:4}  loss {:<8} {}\n", digits(trial.loss), values.join(", "))
}

/// The result as a table.
fn as_text(fit: &Fit<'_>, fitted: &Fitted, out: &Path, page: Page) -> String {
    let mut columns = vec![("parameter", Align::Left), ("start", Align::Right), ("fitted", Align::Right)];
    if !fitted.around.is_empty() {
        columns.extend(AROUND_HEADS.map(|head| (head, Align::Right)));
    }
    let mut table = Table::new(&columns);
    for (at, parameter) in fit.parameters.iter().enumerate() {
        let text = |value: f64| parameter.unit.display(value);
        let mut row = vec![
            page.name(&parameter.place),
            text(fitted.trials[0].values[at]),
            page.bold(&text(fitted.best.values[at])),
        ];
        row.extend(fitted.around.get(at).into_iter().flatten().map(|loss| digits(*loss)));
        table.row(row);
    }
    let note = if fitted.around.is_empty() {
        ""
    } else {
        "\nat the right, the loss when one fitted value changes by that much"
    };
    format!(
        "{}{}\n{} {}  loss {} {}\n",
        table.render(page, 0),
        page.dim(note),
        page.good("fitted"),
        page.name(&out.display().to_string()),
        page.bold(&digits(fitted.best.loss)),
        page.dim(&format!(
            "(from {}; {}, {})",
            digits(fitted.trials[0].loss),
            counted(fit.measures(), "measure"),
            counted(fitted.trials.len(), "evaluation")
        )),
    )
}
