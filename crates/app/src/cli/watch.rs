//! `orograph watch`: rebuilds a graph whenever it or a file that it reads is saved.

use std::{collections::BTreeSet, path::PathBuf, time::Duration};

use orograph_graph::{Cancel, Document, input};

use crate::{
    build::Builder,
    cli::{
        build_args::BuildArgs,
        run::{REMEMBERED, summary},
    },
    files::{read_by, watch::Watch},
    memory,
    report::{
        failure::{Exit, Failure, reason},
        progress::{self, JsonLines, Progress},
        terminal::{self, Page},
    },
    stop,
};

/// Interval of checks for Ctrl-C while nothing changes.
const LOOK: Duration = Duration::from_millis(100);

/// Builds a graph file, and rebuilds it whenever it or a file that it reads is saved
///
/// Results are cached, so that only changed nodes are computed; a save during a build restarts it. Problems are
/// printed, and watching continues; the files of the last successful build stay. Ctrl-C ends it.
#[derive(Debug, clap::Args)]
#[command(after_long_help = progress::JSON_HELP)]
pub struct Args {
    #[command(flatten)]
    args: BuildArgs,
    /// Print progress and results as lines of JSON
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        if !self.json {
            return self.watch();
        }
        memory::writes_json_lines();
        let watched = self.watch().inspect_err(|failure| JsonLines::refused(failure, &self.args.file));
        watched.and_then(|()| JsonLines::complete())
    }

    fn watch(&self) -> Result<(), Failure> {
        input::open(&self.args.file).map_err(|error| {
            let failure =
                Failure::wrong(format!("`{}` cannot be watched: {}", self.args.file.display(), reason(&error)));
            Failure { code: "missing-file", ..failure }
        })?;
        let builder = Builder::new(&self.args.means, REMEMBERED)?;
        let cancel = stop::on_interrupt()?;
        let mut watch = Watch::new(|| {})?;
        watch.add(&self.args.file)?;
        loop {
            // a save while the graph is built for the first time restarts it too
            if let Ok(document) = Document::load(&self.args.file, &orograph_nodes::registry()) {
                read_by(&document).iter().try_for_each(|file| watch.add(file))?;
            }
            let (read, overtaken) = self.build_watching(&builder, &mut watch, &cancel)?;
            if cancel.is_cancelled() {
                return Ok(());
            }
            read.iter().try_for_each(|file| watch.add(file))?;
            let page = Page::stdout();
            let changed = match overtaken {
                Some(changed) => changed,
                None => {
                    match self.json {
                        true => JsonLines::watching(&self.args.file),
                        false => terminal::print(&page.dim(&format!("watching {}\n", self.args.file.display())))?,
                    }
                    let Some(changed) = next(&mut watch, &cancel)? else { return Ok(()) };
                    changed
                }
            };
            match self.json {
                true => JsonLines::changed(&changed),
                false => terminal::print(&format!("{} changed\n", page.name(&changed)))?,
            }
        }
    }

    /// Builds once, and stops as soon as a file changes, because the result is then out of date.
    fn build_watching(&self, builder: &Builder, watch: &mut Watch, cancel: &Cancel) -> Result<Overtaken, Failure> {
        let stop = cancel.child();
        std::thread::scope(|scope| {
            let worker = std::thread::Builder::new()
                .name("build".to_owned())
                .spawn_scoped(scope, || self.build(builder, &stop))
                .map_err(|error| Failure::unable(format!("cannot start a thread: {}", reason(&error))))?;
            let mut changed = None;
            while !worker.is_finished() {
                // The scope waits for the worker, on an early return too.
                let files = watch.poll(LOOK).inspect_err(|_| stop.cancel())?;
                if !files.is_empty() {
                    stop.cancel();
                    changed = Some(names(&files));
                }
            }
            let read = worker.join().unwrap_or_else(|_| {
                terminal::complain(&Failure::unable("the build ended with an internal error"));
                Vec::new()
            });
            Ok((read, changed))
        })
    }

    /// Builds once; returns the files that the graph reads, which are watched from then on.
    fn build(&self, builder: &Builder, stop: &Cancel) -> Vec<PathBuf> {
        let args = &self.args;
        let read = Document::load(&args.file, &orograph_nodes::registry())
            .map(|document| read_by(&document).into_iter().collect());
        let progress: Box<dyn Progress> = if self.json { Box::new(JsonLines) } else { progress::for_people() };
        let request = args.request(true).inspect_err(|failure| {
            if self.json {
                JsonLines::refused(failure, &args.file);
            }
        });
        let built = request.and_then(|request| {
            if self.json {
                JsonLines::problems(&request.document, request.source());
            }
            let built = builder.build(&request, &args.out, &args.options, stop, &*progress)?;
            if self.json { Ok(()) } else { terminal::print(&summary(&request, &built, Page::stdout())) }
        });
        match built {
            // A build that a save has interrupted prints nothing.
            Err(failure) if failure.exit != Exit::Stopped => terminal::complain(&failure),
            _ => {}
        }
        read.unwrap_or_default()
    }
}

/// The files that a build read, and the names of those that changed before it ended.
type Overtaken = (Vec<PathBuf>, Option<String>);

/// Waits until files change, and returns their names. Returns None when the program must end.
fn next(watch: &mut Watch, cancel: &Cancel) -> Result<Option<String>, Failure> {
    while !cancel.is_cancelled() {
        let changed = watch.poll(LOOK)?;
        if !changed.is_empty() {
            return Ok(Some(names(&changed)));
        }
    }
    Ok(None)
}

fn names(files: &BTreeSet<PathBuf>) -> String {
    let name = |file: &PathBuf| file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    files.iter().map(name).collect::<Vec<_>>().join(", ")
}
