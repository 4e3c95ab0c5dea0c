//! `orograph render`: a picture of a graph's output or of a height file.

use std::path::{Path, PathBuf};

use orograph_graph::{Cancel, Field, OutputDecl, PortType, closest};
use orograph_nodes::raster::{self, Problem};

use crate::{
    archive::is_archive,
    build::Builder,
    failure::{Failure, reason},
    heightfile::{self, Scale},
    picture::{self, View},
    progress::{self, Progress, Quiet},
    request::{Changes, Means, Request},
    stop,
    terminal::{self, Page},
};

/// A picture of a graph's output, or of a height file
///
/// Of a graph the first height is shown, or the output that `--output` names: heights as `--view` says, colours as they
/// are, other numbers from black to white. A height file may be GeoTIFF, grey PNG, OpenEXR, ESRI ASCII, SRTM (.hgt), .r16
/// or .r32.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Graph file or height file
    #[arg(value_name = "GRAPH.ron|HEIGHT")]
    file: PathBuf,
    /// Picture to write
    #[arg(short, long, value_name = "PNG")]
    out: PathBuf,
    /// How land is shown
    #[arg(long, value_enum, default_value_t = View::Map)]
    view: View,
    /// Output of the graph to show
    #[arg(long, value_name = "NAME")]
    output: Option<String>,
    #[command(flatten)]
    changes: Changes,
    #[command(flatten)]
    means: Means,
    #[command(flatten)]
    scale: Scale,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        if !self.out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
            return Err(Failure::wrong(format!("`{}` does not end with .png", self.out.display()))
                .hint("pictures are PNG files: `-o picture.png`"));
        }
        let cancel = stop::on_interrupt()?;
        let picture = if self.file.extension().is_some_and(|extension| extension == "ron") || is_archive(&self.file) {
            self.of_graph(&cancel)?
        } else {
            self.of_file()?
        };
        raster::write_colour(&self.out, &picture, &|| !cancel.is_cancelled()).map_err(|error| {
            match &error.problem {
                Problem::Unwritable(error) => {
                    Failure::unable(format!("cannot write `{}`: {}", self.out.display(), reason(error)))
                        .hint("an earlier file is as it was; make room, or name another place with `-o`")
                }
                Problem::Stopped => Failure::stopped(),
                _ => Failure::unable(error.to_string()).hint(error.remedy()),
            }
        })?;
        if self.quiet {
            return Ok(());
        }
        let (page, [nx, ny]) = (Page::stdout(), picture.window().cells);
        let name = page.name(&self.out.display().to_string());
        terminal::print(&format!("{name}  {}\n", page.dim(&format!("{nx} x {ny} pixels"))))
    }

    fn of_file(&self) -> Result<Field, Failure> {
        let changes = &self.changes;
        let option = [
            ("--output", self.output.is_some()),
            ("--cells", changes.cells.is_some()),
            ("--seed", changes.seed.is_some()),
            ("--set", !changes.set.is_empty()),
            ("--cache", self.means.cache.is_some()),
            ("--threads", self.means.threads.is_some()),
        ];
        if let Some((option, _)) = option.into_iter().find(|(_, given)| *given) {
            return Err(Failure::wrong(format!(
                "`{option}` is for graph files, `{}` is read as it is",
                self.file.display()
            )));
        }
        self.means.backend.check()?;
        Ok(picture::of_height(&heightfile::read(&self.file, &self.scale)?, self.view))
    }

    fn of_graph(&self, cancel: &Cancel) -> Result<Field, Failure> {
        if let Some(option) = self.scale.given() {
            return Err(Failure::wrong(format!("`{option}` is for height files; a graph states its world")));
        }
        let mut request = Request::new(&self.file, &self.changes, &orograph_nodes::registry(), !self.quiet)?;
        let output = chosen(&self.file, &request.outputs, self.output.as_deref())?.clone();
        request.outputs = vec![output.clone()];
        let progress: Box<dyn Progress> = if self.quiet { Box::new(Quiet) } else { progress::for_people() };
        let builder = Builder::new(&self.means, 0)?;
        let values = builder.evaluate(&request, &[output.port], cancel, &*progress);
        progress.ended();
        let (values, _) = values?;
        match values.first().and_then(|value| value.as_field()) {
            Some(field) => Ok(picture::of_field(field, output.ty, self.view)),
            None => Err(Failure::wrong(format!("`{}` is a {}, which has no picture", output.name, output.ty))),
        }
    }
}

/// The output of that name, else the first height, else the first that can be shown.
fn chosen<'a>(file: &Path, outputs: &'a [OutputDecl], name: Option<&str>) -> Result<&'a OutputDecl, Failure> {
    match name {
        Some(name) => outputs.iter().find(|output| output.name == name).ok_or_else(|| {
            let failure = Failure::wrong(format!("`{}` has no output `{name}`", file.display()));
            match closest(name, outputs.iter().map(|output| output.name.as_str())) {
                Some(near) => failure.hint(format!("did you mean `{near}`?")),
                None => failure,
            }
        }),
        None => {
            let height = outputs.iter().find(|output| output.ty == PortType::Height);
            height.or_else(|| outputs.iter().find(|output| output.ty.planes().is_some())).ok_or_else(|| {
                Failure::wrong(format!("`{}` has no output that can be shown", file.display()))
                    .hint("add one, such as `outputs: { \"height\": \"NODE\" }`")
            })
        }
    }
}
