//! `orograph run`: builds every output of a graph file.

use orograph_graph::{Document, Origin, Unit, bytes, plain};

use crate::{
    build::{Builder, Built, Timing},
    cli::asked::Asked,
    failure::Failure,
    machine,
    outputs::Written,
    problems,
    progress::{self, JsonLines, Progress, Quiet, seconds},
    request::Request,
    stop,
    terminal::{self, Align, Page, Table, counted},
};

/// Builds every output of a graph file
///
/// Heights, masks and other scalars become OpenEXR files (or another `--format`) with a JSON file beside each that states
/// size, cell, range, unit, seed and a hash of all they come from; colours become PNG, reports JSON. Of each height there
/// is also a shaded picture, NAME.preview.png, of at most 2048 pixels a side.
///
/// All files are complete before the first appears under its name: a failure or Ctrl-C leaves earlier ones as they were.
#[derive(Debug, clap::Args)]
#[command(after_long_help = progress::JSON_HELP)]
pub struct Args {
    #[command(flatten)]
    asked: Asked,
    /// Print progress and results as lines of JSON
    #[arg(long)]
    json: bool,
    /// Print nothing but errors
    #[arg(short, long, conflicts_with = "json")]
    quiet: bool,
    /// Print time, memory and origin of each node's result
    #[arg(long)]
    timings: bool,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        let progress: Box<dyn Progress> = match (self.json, self.quiet) {
            (true, _) => Box::new(JsonLines),
            (_, true) => Box::new(Quiet),
            _ => progress::for_people(),
        };
        let request = self.asked.request(!self.quiet).inspect_err(|failure| {
            if self.json {
                let problems = if failure.message.is_empty() { self.problems() } else { Vec::new() };
                JsonLines::refused(failure, &problems);
            }
        })?;
        // Nothing is asked for twice in one run, so nothing is remembered in memory.
        let begin = || Ok((Builder::new(&self.asked.means, 0)?, stop::on_interrupt()?));
        let (builder, cancel) = begin().inspect_err(|failure| progress.failed(failure))?;
        let built = builder.build(&request, &self.asked.out, &self.asked.form, &cancel, &*progress)?;
        if self.timings {
            let text = timings(&built, if self.json { Page::stderr() } else { Page::stdout() });
            if self.json { terminal::remark(&text) } else { terminal::print(&text)? }
        }
        if self.json || self.quiet { Ok(()) } else { terminal::print(&summary(&request, &built, Page::stdout())) }
    }

    /// The problems of the file, which people have been shown already.
    fn problems(&self) -> Vec<serde_json::Value> {
        let document = Document::load(&self.asked.file, &orograph_nodes::registry());
        document.map_or_else(|_| Vec::new(), |document| problems::as_json(&document, &self.asked.file))
    }
}

/// What was built, for people.
pub(super) fn summary(request: &Request, built: &Built, page: Page) -> String {
    let world = request.world;
    let [width, height] = world.size.map(|metres| Unit::Metres.display(metres));
    let cell = significant(world.cell_m());
    let mut table = Table::new(&[("", Align::Left), ("", Align::Left), ("", Align::Right), ("", Align::Left)]);
    for file in &built.files {
        table.row([
            page.name(&file.path.display().to_string()),
            file.what.to_owned(),
            page.dim(&bytes(file.bytes)),
            range(file),
        ]);
    }
    let computed = built.timings.iter().filter(|timing| timing.origin == Origin::Computed).count();
    let nodes = match built.timings.len() - computed {
        0 => counted(computed, "node"),
        kept => format!("{}, {kept} from the cache", counted(computed, "node")),
    };
    format!(
        "{}{} {} in {} {}\n",
        table.render(page, 0),
        page.good("built"),
        counted(built.files.len(), "file"),
        seconds(built.time),
        page.dim(&format!(
            "({nodes}; {width} x {height}, {} x {} cells of {cell} m, seed {})",
            world.cells[0], world.cells[1], world.seed
        )),
    )
}

fn range(file: &Written) -> String {
    match file.range {
        Some([lo, hi]) => format!("{} to {} {}", significant(lo), significant(hi), file.unit).trim_end().to_owned(),
        None => String::new(),
    }
}

/// A number with four significant digits.
fn significant(value: f64) -> String {
    plain(format!("{value:.3e}").parse().unwrap_or(value))
}

/// Time, memory and origin of each node's result, and in all.
fn timings(built: &Built, page: Page) -> String {
    let mut table = Table::new(&[
        ("node", Align::Left),
        ("kind", Align::Left),
        ("time", Align::Right),
        ("memory", Align::Right),
        ("result", Align::Left),
    ]);
    for Timing { name, kind, time, bytes: size, origin } in &built.timings {
        let origin = match origin {
            Origin::Computed => "computed",
            Origin::Memory => "in memory",
            Origin::Disk => "on disk",
        };
        table.row([page.name(name), page.dim(kind), seconds(*time), bytes(*size as u64), page.dim(origin)]);
    }
    let peak = machine::peak_memory().map_or_else(String::new, bytes);
    let what = if peak.is_empty() { "" } else { "with writing; most memory at once" };
    table.row([page.bold("total"), String::new(), page.bold(&seconds(built.time)), page.bold(&peak), page.dim(what)]);
    table.render(page, 0)
}
