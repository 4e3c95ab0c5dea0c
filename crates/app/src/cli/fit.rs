//! `orograph fit`: parameters of a graph fitted to a target.

use std::{
    num::NonZero,
    path::{Path, PathBuf},
};

use orograph_graph::plain;
use serde_json::{Map, Value, json};

use super::run::REMEMBERED;
use crate::{
    build::{
        Builder,
        fit::{AROUND, Fit, Fitted, Parameter, Trial, Vary},
        request::{Cells, Changes, Means, Request},
    },
    files::{
        archive,
        heightfile::{self, FILLED, Scale},
    },
    report::{
        failure::{Failure, reason},
        terminal::{self, Align, Page, Table, counted},
    },
    stop,
};

/// Fits parameters of a graph so that its height comes closest to a target
///
/// Searches the values of the varied parameters for which the output `height` (or the only height) has the least loss,
/// starting from the values of the file, and writes the graph with the best ones. The target may be another place of
/// another size: measures are compared, not heights cell by cell.
///
/// The loss is the root mean square of the distances of `Compare` (see the manual): measures at cells of 90 m, less
/// those of the target, in units of the spread among the target's quarters. Each distance is limited to 5, so that one
/// measure cannot rule the loss; a measure that is undefined for the terrain counts as 5. A loss of 0 means equal
/// measures; below 1, the terrain differs from the target less than the target's quarters from each other.
///
/// The search (Nelder-Mead) finds the least loss near the start, not everywhere: start from plausible values. The same
/// command gives the same file on any number of threads. Ctrl-C stops the search, writes the best values so far and
/// exits with 130.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Graph file
    #[arg(value_name = "GRAPH.ron")]
    file: PathBuf,
    /// Height file to come close to
    #[arg(long, value_name = "HEIGHT")]
    target: PathBuf,
    /// Number to vary: a parameter of the file, or a parameter or unwired input of a node; can be given several times
    ///
    /// For example `--vary rivers.duration="200 kyr..5 Myr"`. Without a range, that of the editor's slider is searched
    /// (`orograph nodes NODE`). A positive range that spans more than a factor of 30 is searched by factors.
    #[arg(long, value_name = "NAME|NODE.PARAM[=LO..HI]")]
    vary: Vec<Vary>,
    /// Graph file to write: the graph with the fitted values
    #[arg(short, long, value_name = "OUT.ron")]
    out: PathBuf,
    /// Cells along the world's longer side, or along both (`2048x1024`); cells stay square
    #[arg(long, value_name = "N|WxH")]
    cells: Option<Cells>,
    /// Maximum number of evaluations of the search; the loss around the result takes four more per parameter
    #[arg(long, value_name = "N", default_value = "200")]
    evaluations: NonZero<usize>,
    #[command(flatten)]
    scale: Scale,
    #[command(flatten)]
    means: Means,
    /// Print the result as JSON, with all evaluations
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        self.check()?;
        let changes = Changes { cells: self.cells, ..Changes::default() };
        let request = Request::new(&self.file, &changes, &orograph_nodes::registry(), true)?;
        let parameters = self.vary.iter().map(|vary| Parameter::of(&request.document, vary));
        let parameters = parameters.collect::<Result<Vec<_>, _>>()?;
        let target = heightfile::read(&self.target, &self.scale, FILLED)?.field;
        let (builder, cancel) = (Builder::new(&self.means, REMEMBERED)?, stop::on_interrupt()?);
        let fit = Fit::new(&request, &builder, &target, parameters, &cancel)?;
        let tell = |number: usize, trial: &Trial| {
            if !self.json {
                terminal::remark(&line(number, trial, &fit.parameters));
            }
        };
        let fitted = fit.run(self.evaluations.get(), &tell)?;
        self.write(&request, &fit.parameters, &fitted.best)?;
        if self.json {
            terminal::print(&format!("{:#}\n", self.as_json(&fit, &fitted)))?;
        } else {
            terminal::print(&as_text(&fit, &fitted, &self.out, Page::stdout()))?;
        }
        if !fitted.stopped {
            return Ok(());
        }
        let done = counted(fitted.trials.len(), "evaluation");
        let message = format!("stopped after {done}; the best values so far are in `{}`", self.out.display());
        Err(Failure { message, ..Failure::stopped() })
    }

    /// Refuses a request that makes no sense, before anything is read.
    fn check(&self) -> Result<(), Failure> {
        if self.vary.is_empty() {
            return Err(Failure::wrong("there is nothing to fit: no parameter is varied")
                .hint("name one or several: `--vary NODE.PARAM` or `--vary NODE.PARAM=LO..HI`"));
        }
        for (at, vary) in self.vary.iter().enumerate() {
            if self.vary[..at].iter().any(|other| other.place() == vary.place()) {
                return Err(Failure::wrong(format!("`{}` is varied twice", vary.place())).hint("remove one of them"));
            }
        }
        if archive::is_archive(&self.file) {
            return Err(Failure::wrong(format!("`{}` is an archive", self.file.display()))
                .hint("`orograph unpack` extracts the graph into a folder"));
        }
        let same = |a: &Path, b: &Path| a.canonicalize().ok().is_some_and(|path| b.canonicalize().ok() == Some(path));
        if same(&self.file, &self.out) || same(&self.target, &self.out) {
            let out = self.out.display();
            let what = if same(&self.file, &self.out) { "graph" } else { "target" };
            return Err(Failure::wrong(format!("`{out}` is the {what} itself"))
                .hint("write to another file; `orograph diff` then describes what has changed"));
        }
        if self.out.is_dir() {
            return Err(Failure::wrong(format!("`{}` is a folder", self.out.display())).hint("name the file to write"));
        }
        let folder = self.out.parent().filter(|folder| !folder.as_os_str().is_empty() && !folder.is_dir());
        if let Some(folder) = folder {
            let what = format!("there is no folder `{}` to write to", folder.display());
            return Err(Failure::wrong(what).hint("create it first"));
        }
        Ok(())
    }

    /// Writes the graph with the best values; its layout and comments stay.
    fn write(&self, request: &Request, parameters: &[Parameter], best: &Trial) -> Result<(), Failure> {
        let mut document = request.document.clone();
        for (parameter, value) in parameters.iter().zip(&best.values) {
            parameter.setting(*value).apply(&mut document, "--vary")?;
        }
        document.move_to(&self.out);
        document.save(&self.out).map_err(|error| {
            Failure::unable(format!("cannot write `{}`: {}", self.out.display(), reason(&error)))
                .hint("name a file in a folder that exists")
        })
    }

    fn as_json(&self, fit: &Fit<'_>, fitted: &Fitted) -> Value {
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
        json!({
            "graph": self.file.display().to_string(),
            "target": self.target.display().to_string(),
            "out": self.out.display().to_string(),
            "measures": fit.measures(),
            "loss_at_start": fitted.trials[0].loss,
            "loss": fitted.best.loss,
            "stopped": fitted.stopped,
            "parameters": fit.parameters.iter().enumerate().map(parameter).collect::<Vec<_>>(),
            "evaluations": fitted.trials.iter().map(|trial| json!({ "loss": trial.loss, "values": values(trial) })).collect::<Vec<_>>(),
        })
    }
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
    let heads = ["-10 %", "-5 %", "+5 %", "+10 %"];
    let mut columns = vec![("parameter", Align::Left), ("start", Align::Right), ("fitted", Align::Right)];
    if !fitted.around.is_empty() {
        columns.extend(heads.map(|head| (head, Align::Right)));
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

/// Four digits; a dash for no value.
fn digits(value: f64) -> String {
    if value.is_finite() { plain((value * 1e4).round() / 1e4) } else { "–".to_owned() }
}
