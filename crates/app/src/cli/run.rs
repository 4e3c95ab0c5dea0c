//! `orograph run`: builds every output of a graph file.

use orograph_graph::{Origin, Unit, bytes};
use orograph_nodes::numerics::memory::return_rasters;

use crate::{
    build::{Builder, Built, Timing, request::Request, supersample::finer},
    cli::{
        build_args::BuildArgs,
        cube::{self, CubeArgs},
        sweep::{self, Sweep},
    },
    export::outputs::{Import, Written},
    machine, memory,
    report::{
        failure::Failure,
        progress::{self, JsonLines, Progress, Quiet, seconds},
        reading,
        terminal::{self, Align, Page, Table, counted},
    },
    stop,
};

/// Bytes of results that a sweep keeps in memory, so that only nodes that a value changes are computed again.
pub(super) const REMEMBERED: usize = 2 << 30;

/// Rasters of the size of what is computed that a cube keeps in memory.
const KEPT_RASTERS: usize = 16;

/// Builds every output of a graph file
///
/// Heights, masks and other scalars become OpenEXR files (or another `--format`), each with a JSON file that states
/// size, cell size, range, unit, seed and a hash of everything they depend on. Colours become PNG, reports JSON. Each
/// height also gets a shaded picture, NAME.preview.png, of at most 2048 pixels per side.
///
/// All files are complete before the first appears under its name: a failure or Ctrl-C leaves earlier files unchanged.
/// If the program is killed while it replaces them, files are missing, but never mixed, until the next run completes
/// it.
///
/// If the file states what must hold (`expect`), the terrain is measured after all files are written. Each expectation
/// is printed with its figure, and a miss exits with 1.
#[derive(Debug, clap::Args)]
#[command(after_long_help = progress::JSON_HELP)]
pub struct Args {
    #[command(flatten)]
    args: BuildArgs,
    /// Build once for each value of a parameter of the file or of a node, or of `seed`; can be given several times
    ///
    /// Values are `1..20` (both ends included), `0.5..2/0.5` (by steps), `1..3/0.5 Myr`, or a list `a,b,c` with a unit
    /// after each number. Several sweeps build every combination. Name the folder by the values: `-o out/{seed}`. Nodes
    /// that no value changes are computed once.
    #[arg(long, value_name = "NAME=VALUES")]
    sweep: Vec<Sweep>,
    #[command(flatten)]
    cube: CubeArgs,
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
        if !self.json {
            return self.build();
        }
        memory::writes_json_lines();
        self.build().and_then(|()| JsonLines::complete())
    }

    fn build(self) -> Result<(), Failure> {
        let progress: Box<dyn Progress> = match (self.json, self.quiet) {
            (true, _) => Box::new(JsonLines),
            (_, true) => Box::new(Quiet),
            _ => progress::for_people(),
        };
        let request = self.args.request(!self.quiet).inspect_err(|failure| {
            if self.json {
                JsonLines::refused(failure, &self.args.file);
            }
        })?;
        if self.json {
            JsonLines::problems(&request.document, request.source());
        }
        if self.cube.cube {
            return self.run_cube(&request, &*progress);
        }
        if !self.sweep.is_empty() {
            return self.run_sweep(&request, &*progress);
        }
        // A single run needs no result twice, so memory caches nothing.
        let begin = || {
            sweep::check_without_sweep(&request, &self.args.out)?;
            Ok((Builder::new(&self.args.means, 0)?, stop::on_interrupt()?))
        };
        let (builder, cancel) = begin().inspect_err(|failure| progress.failed(failure))?;
        let built = builder.build(&request, &self.args.out, &self.args.options, &cancel, &*progress)?;
        self.tell(&request, &built)?;
        let missed = built.expected.failure();
        missed.map_or(Ok(()), |missed| {
            progress.failed(&missed);
            Err(missed)
        })
    }

    /// Builds all variants into one Zarr store.
    fn run_cube(&self, request: &Request, progress: &dyn Progress) -> Result<(), Failure> {
        return_rasters();
        // so many rasters of a terrain are kept for the next ones, however many there are
        let memory = KEPT_RASTERS
            .saturating_mul(size_of::<f32>() * finer(request.window(), request.supersample()).len())
            .min(REMEMBERED);
        let begin = || {
            sweep::check_of_cube(request, &self.sweep, &self.args.out)?;
            Ok((Builder::new(&self.args.means, memory)?, stop::on_interrupt()?))
        };
        let (builder, cancel) = begin().inspect_err(|failure| progress.failed(failure))?;
        let BuildArgs { changes, out, .. } = &self.args;
        let (sweeps, args, backend, is_quiet) = (&self.sweep[..], &self.cube, self.args.means.backend, self.quiet);
        let job = cube::Job { request, changes, sweeps, out, args, backend, is_quiet };
        job.run(&builder, &cancel, progress)
    }

    /// Builds all variants with one store, so that shared results are computed once.
    fn run_sweep(&self, request: &Request, progress: &dyn Progress) -> Result<(), Failure> {
        let begin = || {
            let variants = sweep::variants(request, &self.args.changes, &self.sweep, &self.args.out)?;
            Ok((variants, Builder::new(&self.args.means, REMEMBERED)?, stop::on_interrupt()?))
        };
        let (variants, builder, cancel) = begin().inspect_err(|failure| progress.failed(failure))?;
        let (count, mut missed) = (variants.len(), 0);
        for (at, variant) in variants.iter().enumerate() {
            let label = variant.label();
            if self.json {
                JsonLines::variant(at + 1, count, &variant.values, &variant.folder);
            } else if !self.quiet {
                terminal::remark(&format!("{} of {count}: {label}\n", at + 1));
            }
            let options = &self.args.options;
            let built =
                builder.build(&variant.request, &variant.folder, options, &cancel, progress).map_err(|failure| {
                    let done = if at == 0 { String::new() } else { format!("; the {at} before it were written") };
                    match failure.message.as_str() {
                        "" => failure,
                        message => Failure { message: format!("{label}: {message}{done}"), ..failure },
                    }
                })?;
            self.tell(&variant.request, &built)?;
            if let Some(what) = built.expected.missed() {
                missed += 1;
                terminal::remark(&format!("{} {label}: {what}\n", Page::stderr().bad("missed:")));
            }
        }
        if missed == 0 {
            return Ok(());
        }
        let missed = Failure::wrong(format!("{missed} of {} missed an expectation", counted(count, "terrain")))
            .hint("all files are written");
        progress.failed(&missed);
        Err(missed)
    }

    /// Prints the result of a build.
    fn tell(&self, request: &Request, built: &Built) -> Result<(), Failure> {
        if self.timings {
            let text = timings(built, if self.json { Page::stderr() } else { Page::stdout() });
            if self.json { terminal::remark(&text) } else { terminal::print(&text)? }
        }
        if self.json || self.quiet { Ok(()) } else { terminal::print(&summary(request, built, Page::stdout())) }
    }
}

/// The result of a build, as text.
pub(super) fn summary(request: &Request, built: &Built, page: Page) -> String {
    let world = request.world;
    let window = request.window();
    let extent = |count: u32| Unit::Metres.display(f64::from(count) * world.cell_m());
    let [width, height] =
        if window.is_whole() { world.size.map(|v| Unit::Metres.display(v)) } else { window.cells.map(extent) };
    let [x, y] = window.origin.map(extent);
    let place = if window.is_whole() { String::new() } else { format!(" from ({x}, {y})") };
    let cell = reading::significant(world.cell_m());
    let mut table = Table::new(&[("", Align::Left), ("", Align::Left), ("", Align::Right), ("", Align::Left)]);
    for file in &built.files {
        table.row([
            page.name(&file.path.display().to_string()),
            file.what.to_owned(),
            page.dim(&bytes(file.bytes)),
            range(file),
        ]);
    }
    let mut imports = String::new();
    for (file, import, lines) in Import::of(&built.files) {
        imports += &format!("\n{} in {}\n", page.name(&file.path.display().to_string()), import.engine.title());
        let mut settings = Table::new(&[("", Align::Left), ("", Align::Left)]);
        for (name, value) in lines {
            settings.row([name.to_owned(), value]);
        }
        imports += &settings.render(page, 2);
    }
    let mut reports = String::new();
    for file in &built.files {
        if let Some(report) = &file.report {
            reports += &format!("\n{}\n{}\n", page.name(&file.output), reading::text(report, page));
        }
    }
    let finer = match request.supersample() {
        1 => String::new(),
        factor => format!(", each from {factor} x {factor} finer ones"),
    };
    let computed = built.timings.iter().filter(|timing| timing.origin == Origin::Computed).count();
    let nodes = match built.timings.len() - computed {
        0 => counted(computed, "node"),
        kept => format!("{}, {kept} from the cache", counted(computed, "node")),
    };
    format!(
        "{}{imports}{reports}{}{} {} in {} {}\n",
        table.render(page, 0),
        built.expected.render(page),
        page.good("built"),
        counted(built.files.len(), "file"),
        seconds(built.time),
        page.dim(&format!(
            "({nodes}; {width} x {height}{place}, {} x {} cells of {cell} m{finer}, seed {})",
            window.cells[0], window.cells[1], world.seed
        )),
    )
}

fn range(file: &Written) -> String {
    match file.range {
        Some([lo, hi]) => {
            format!("{} to {} {}", reading::significant(lo), reading::significant(hi), file.unit).trim_end().to_owned()
        }
        None => String::new(),
    }
}

/// Time, memory and origin of each node's result, and in all.
fn timings(built: &Built, page: Page) -> String {
    let mut table = Table::new(&[
        ("node", Align::Left),
        ("kind", Align::Left),
        ("time", Align::Right),
        ("memory", Align::Right),
        ("from", Align::Left),
    ]);
    for Timing { name, kind, time, bytes: size, origin, backend } in &built.timings {
        let origin = match origin {
            Origin::Computed => *backend,
            Origin::Memory => "in memory",
            Origin::Disk => "on disk",
        };
        table.row([page.name(name), page.dim(kind), seconds(*time), bytes(*size as u64), page.dim(origin)]);
    }
    let peak = machine::peak_memory().map_or_else(String::new, bytes);
    let what = if peak.is_empty() { "" } else { "with writing; peak memory" };
    table.row([page.bold("total"), String::new(), page.bold(&seconds(built.time)), page.bold(&peak), page.dim(what)]);
    table.render(page, 0)
}
