//! `orograph fit`: parameters of a graph, or a field that it reads, fitted to a target.

mod field;
mod numbers;

use std::{
    num::NonZero,
    path::{Path, PathBuf},
};

use orograph_graph::{Cancel, Document, Field, plain};
use serde_json::{Value, json};

use crate::{
    build::{
        Builder,
        fit::Vary,
        request::{Cells, Changes, Means, Request, same_value},
    },
    cli::run::REMEMBERED,
    files::{
        archive,
        heightfile::{self, FILLED, Scale},
    },
    files::{read_by, refuse_over},
    report::{
        failure::{Failure, reason},
        terminal::{self, Page, counted},
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
/// those of the target, in units of the spread among the target's quarters. Each distance is limited to 5, so that no
/// single measure dominates the loss; a measure that is undefined for the terrain counts as 5. A loss of 0 means equal
/// measures; below 1, the terrain differs from the target less than the target's quarters from each other.
///
/// The search (Nelder-Mead) finds the least loss near the start, not everywhere: start from plausible values.
///
/// With `--vary NODE.INPUT@WAVELENGTH`, an input such as the uplift is fitted as a field instead: a coarse grid of
/// values, two to the wavelength, which is corrected where the terrain differs from the target. The target must then
/// cover the same area as the world. OUT.ron reads the field from a raster beside it.
///
/// The same command gives the same file on any number of threads. Ctrl-C stops the search, writes the best values so
/// far and exits with 130.
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
    /// (`orograph nodes NODE`). A positive range that spans more than a factor of 30 is searched by factors. With a
    /// wavelength, such as `--vary rivers.uplift@"5 km"`, an input is fitted as a field.
    #[arg(long, value_name = "NAME|NODE.PARAM[@WAVELENGTH][=LO..HI]")]
    vary: Vec<Vary>,
    /// Graph file to write: the graph with the fitted values
    #[arg(short, long, value_name = "OUT.ron")]
    out: PathBuf,
    /// Cells along the world's longer side, or along both (`2048x1024`). Cells stay square: along the shorter side, the world
    /// may change by half a cell
    #[arg(long, value_name = "N|WxH")]
    cells: Option<Cells>,
    /// Maximum number of evaluations of the search, 200 by default, 20 for a field; the loss around the result takes four
    /// more per parameter
    #[arg(long, value_name = "N", value_parser = evaluations)]
    evaluations: Option<NonZero<usize>>,
    #[command(flatten)]
    scale: Scale,
    #[command(flatten)]
    means: Means,
    /// Print the result as JSON, with all evaluations
    #[arg(long)]
    json: bool,
}

fn evaluations(text: &str) -> Result<NonZero<usize>, String> {
    text.parse().map_err(|_| "it is not a whole number above 0".to_owned())
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        self.check()?;
        let changes = Changes { cells: self.cells, ..Changes::default() };
        let request = Request::new(&self.file, &changes, &orograph_nodes::registry(), true)?;
        refuse_over(&self.out, read_by(&request.document))?;
        for (at, vary) in self.vary.iter().enumerate() {
            let same = |other: &&Vary| same_value(&request.document, other.place(), vary.place());
            if let Some(other) = self.vary[..at].iter().find(same) {
                let what = match other.place() == vary.place() {
                    true => format!("`{}` is varied twice", vary.place()),
                    false => format!("`{}` and `{}` vary the same value", other.place(), vary.place()),
                };
                return Err(Failure::wrong(what).hint("remove one of them"));
            }
        }
        let is_field = self.vary[0].is_field();
        if is_field { field::run(&self, &request) } else { numbers::run(&self, &request) }
    }

    /// The number of evaluations; without one on the command line, the usual one.
    fn evaluations(&self, usual: usize) -> usize {
        self.evaluations.map_or(usual, NonZero::get)
    }

    /// The target, whose voids are filled.
    fn target(&self) -> Result<Field, Failure> {
        Ok(heightfile::read(&self.target, &self.scale, FILLED)?.field)
    }

    /// What builds the terrain, and what Ctrl-C sets.
    fn builder(&self) -> Result<(Builder, Cancel), Failure> {
        Ok((Builder::new(&self.means, REMEMBERED)?, stop::on_interrupt()?))
    }

    /// What the results of both searches state, with what is their own.
    fn result(&self, loss: [f64; 2], stopped: bool, own: Value) -> Value {
        let mut result = json!({
            "graph": self.file.display().to_string(),
            "target": self.target.display().to_string(),
            "out": self.out.display().to_string(),
            "loss_at_start": loss[0],
            "loss": loss[1],
            "stopped": stopped,
        });
        if let (Some(result), Value::Object(own)) = (result.as_object_mut(), own) {
            result.extend(own);
        }
        result
    }

    /// Prints the result, as JSON or as text.
    fn print(&self, json: impl FnOnce() -> Value, text: impl FnOnce(Page) -> String) -> Result<(), Failure> {
        let printed = if self.json { format!("{:#}\n", json()) } else { text(Page::stdout()) };
        terminal::print(&printed)
    }

    /// The end of a search: if it was stopped, what is written is not the final result.
    fn ended(&self, stopped: bool, evaluations: usize) -> Result<(), Failure> {
        if !stopped {
            return Ok(());
        }
        let done = counted(evaluations, "evaluation");
        let message = format!("stopped after {done}; the best values so far are in `{}`", self.out.display());
        Err(Failure { message, ..Failure::stopped() })
    }

    /// Refuses a request that makes no sense, before anything is read.
    fn check(&self) -> Result<(), Failure> {
        if self.vary.is_empty() {
            return Err(Failure::wrong("there is nothing to fit: no parameter is varied")
                .hint("name one or several: `--vary NODE.PARAM` or `--vary NODE.PARAM=LO..HI`"));
        }
        if self.vary.len() > 1 && self.vary.iter().any(Vary::is_field) {
            return Err(Failure::wrong("a field is fitted alone, without other parameters")
                .hint("fit the numbers first, then the field in the graph that this writes"));
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

    /// Writes a document as the result.
    fn save(&self, document: &Document) -> Result<(), Failure> {
        document.save(&self.out).map_err(|error| {
            Failure::unable(format!("cannot write `{}`: {}", self.out.display(), reason(&error)))
                .hint("name a file in a folder that exists")
        })
    }
}

/// The losses around a result, as columns of a table.
const AROUND_HEADS: [&str; 4] = ["-10 %", "-5 %", "+5 %", "+10 %"];

/// Four digits; a dash for no value.
fn digits(value: f64) -> String {
    if value.is_finite() { plain((value * 1e4).round() / 1e4) } else { "–".to_owned() }
}
