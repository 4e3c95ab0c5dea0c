//! `orograph watch`: builds a graph again whenever it, or a file it reads, is saved.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use orograph_graph::{Cancel, Document};
use orograph_nodes::raster;

use crate::{
    build::Builder,
    cli::{
        asked::Asked,
        run::{REMEMBERED, summary},
    },
    failure::{Exit, Failure, reason},
    progress, stop,
    terminal::{self, Page},
    watch::Watch,
};

/// How often Ctrl-C is looked for while nothing happens.
const LOOK: Duration = Duration::from_millis(100);

/// Builds a graph file, and again at every save of it or of a file it reads
///
/// Results are remembered, so that only what has changed is computed; a save during a build starts it anew. Problems are
/// shown, and watching goes on; the files of the last build that succeeded stay. Ctrl-C ends it.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    asked: Asked,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        if !self.asked.file.is_file() {
            return Err(Failure::wrong(format!("there is no file `{}` to watch", self.asked.file.display())));
        }
        let builder = Builder::new(&self.asked.means, REMEMBERED)?;
        let cancel = stop::on_interrupt()?;
        let mut watch = Watch::new(|| {})?;
        watch.add(&self.asked.file)?;
        loop {
            let (read, overtaken) = self.build_watching(&builder, &watch, &cancel)?;
            if cancel.is_cancelled() {
                return Ok(());
            }
            read.iter().try_for_each(|file| watch.add(file))?;
            let page = Page::stdout();
            let changed = match overtaken {
                Some(changed) => changed,
                None => {
                    terminal::print(&page.dim(&format!("watching {}\n", self.asked.file.display())))?;
                    let Some(changed) = next(&watch, &cancel)? else { return Ok(()) };
                    changed
                }
            };
            terminal::print(&format!("{} changed\n", page.name(&changed)))?;
        }
    }

    /// Builds once, and stops as soon as a file changes, since the result is out of date then.
    fn build_watching(&self, builder: &Builder, watch: &Watch, cancel: &Cancel) -> Result<Overtaken, Failure> {
        let stop = cancel.child();
        std::thread::scope(|scope| {
            let worker = std::thread::Builder::new()
                .name("build".to_owned())
                .spawn_scoped(scope, || self.build(builder, &stop))
                .map_err(|error| Failure::unable(format!("cannot start a thread: {}", reason(&error))))?;
            let mut changed = None;
            while !worker.is_finished() {
                // The scope waits for the worker, also on the way out.
                if let Some(file) = watch.poll(LOOK).inspect_err(|_| stop.cancel())? {
                    stop.cancel();
                    changed = Some(name(&file));
                }
            }
            let read = worker.join().unwrap_or_else(|_| {
                terminal::complain(&Failure::unable("the build ended with an internal fault"));
                Vec::new()
            });
            Ok((read, changed))
        })
    }

    /// Builds once; returns the files that the graph reads, whose changes matter from then on.
    fn build(&self, builder: &Builder, stop: &Cancel) -> Vec<PathBuf> {
        let asked = &self.asked;
        let read = Document::load(&asked.file, &orograph_nodes::registry()).map(|document| files_read(&document));
        let built = asked.request(true).and_then(|request| {
            let built = builder.build(&request, &asked.out, &asked.form, stop, &*progress::for_people())?;
            terminal::print(&summary(&request, &built, Page::stdout()))
        });
        match built {
            // A build that a save has overtaken says nothing.
            Err(failure) if failure.exit != Exit::Stopped => terminal::complain(&failure),
            _ => {}
        }
        read.unwrap_or_default()
    }
}

/// The files that a build read, and the file that changed before it was done.
type Overtaken = (Vec<PathBuf>, Option<String>);

/// The files that the graph reads, with what may lie beside them. Also those of a graph with problems: they may be what is
/// wrong.
fn files_read(document: &Document) -> Vec<PathBuf> {
    document.files().into_iter().flat_map(|file| [raster::sidecar_path(&file), file]).collect()
}

/// Waits until a file has changed, and returns its name; `None` when it is time to end.
fn next(watch: &Watch, cancel: &Cancel) -> Result<Option<String>, Failure> {
    while !cancel.is_cancelled() {
        if let Some(changed) = watch.poll(LOOK)? {
            return Ok(Some(name(&changed)));
        }
    }
    Ok(None)
}

fn name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
