//! `orograph render`: a picture of a graph's output or of a height file.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use orograph_graph::{Cancel, Field, OutputDecl, PortType, Value, closest};
use orograph_nodes::raster::{self, Problem};

use super::{
    perspective::{Perspective, Seen},
    sea::Sea,
};
use crate::{
    build::{
        Builder,
        backend::BackendName,
        request::{Changes, Means, Request},
    },
    export::picture,
    files::{
        archive::is_archive,
        heightfile::{self, FILLED, Scale},
    },
    files::{read_by, refuse_over},
    report::{
        failure::{Failure, reason, remedy},
        progress::{self, Progress, Quiet},
        terminal::{self, Page},
    },
    stop,
};

/// How terrain is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum View {
    /// Elevation tints with light from the north-west; gentle terrain is exaggerated
    Map,
    /// Hillshade only, in grey, exaggerated in the same way
    Hillshade,
    /// A 3D view with sun and sky
    #[value(name = "3d")]
    Perspective,
}

/// Draws a picture of a graph's output or of a height file
///
/// For a graph, draws the first height output or the output that `--output` names: heights as `--view` selects, colours
/// unchanged, other numbers from black to white. The views `hillshade` and `3d` take heights alone; `--view 3d` needs a
/// graphics card or a software Vulkan driver. A height file can be GeoTIFF, grey PNG, OpenEXR, ESRI ASCII, SRTM (.hgt),
/// .r16 or .r32.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Graph file or height file
    #[arg(value_name = "GRAPH.ron|HEIGHT")]
    file: PathBuf,
    /// Picture to write
    #[arg(short, long, value_name = "PNG")]
    out: PathBuf,
    /// How terrain is drawn
    #[arg(long, value_enum, default_value_t = View::Map)]
    view: View,
    /// Output of the graph to draw
    #[arg(long, value_name = "NAME")]
    output: Option<String>,
    #[command(flatten)]
    changes: Changes,
    #[command(flatten)]
    means: Means,
    #[command(flatten)]
    scale: Scale,
    #[command(flatten)]
    sea: Sea,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
    #[command(flatten)]
    perspective: Perspective,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        if !self.out.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
            return Err(Failure::wrong(format!("`{}` does not end with .png", self.out.display()))
                .hint("pictures are PNG files: `-o picture.png`"));
        }
        match self.view {
            View::Perspective => self.perspective.check()?,
            View::Map | View::Hillshade => self.perspective.check_unused()?,
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
                    Failure::unable(format!("cannot write `{}`: {}", self.out.display(), reason(error))).hint(format!(
                        "an earlier file is unchanged; {}, or choose another place with `-o`",
                        remedy(error)
                    ))
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
            ("--window", changes.window.is_some()),
            ("--supersample", changes.supersample.is_some()),
            ("--seed", changes.seed.is_some()),
            ("--set", !changes.set.is_empty()),
            ("--cache", self.means.storage.cache.is_some()),
            ("--no-cache", self.means.storage.no_cache),
            ("--cache-trust", self.means.storage.cache_trust),
            ("--threads", self.means.threads.is_some()),
            ("--backend", self.means.backend != BackendName::Auto),
            ("--colour", self.perspective.colour.is_some()),
            ("--water", self.perspective.water.is_some()),
        ];
        if let Some((option, _)) = option.into_iter().find(|(_, given)| *given) {
            return Err(Failure::wrong(format!(
                "`{option}` is for graph files, and `{}` is a height file",
                self.file.display()
            )));
        }
        refuse_over(&self.out, [raster::sidecar_path(&self.file), self.file.clone()])?;
        let height = self.sea.around(heightfile::read(&self.file, &self.scale, FILLED)?.field);
        match self.view {
            View::Map => Ok(picture::of_height(&height, picture::View::Map)),
            View::Hillshade => Ok(picture::of_height(&height, picture::View::Hillshade)),
            View::Perspective => self.perspective.picture(&Seen { height, colour: None, water: None }),
        }
    }

    fn of_graph(&self, cancel: &Cancel) -> Result<Field, Failure> {
        if let Some(option) = self.scale.given() {
            return Err(Failure::wrong(format!("`{option}` is for height files; a graph states its world")));
        }
        let mut request = Request::new(&self.file, &self.changes, &orograph_nodes::registry(), !self.quiet)?;
        refuse_over(&self.out, read_by(&request.document).into_iter().chain([self.file.clone()]))?;
        let output = chosen(&self.file, &request.outputs, self.output.as_deref())?.clone();
        let undrawn = |what: &str| Failure::wrong(format!("`{}` has the type {}, {what}", output.name, output.ty));
        if output.ty.planes().is_none() {
            return Err(undrawn("which cannot be drawn").hint("name a raster with `--output`"));
        }
        let mut outputs = vec![output.clone()];
        match self.view {
            View::Hillshade if output.ty != PortType::Height => {
                let failure = undrawn("but `--view hillshade` shows heights");
                return Err(failure.hint("name a height with `--output`, or leave out `--view`"));
            }
            View::Perspective if output.ty != PortType::Height => {
                let failure = undrawn("but `--view 3d` shows heights");
                return Err(
                    failure.hint("name a height with `--output`; set the colours of the terrain with `--colour`")
                );
            }
            View::Perspective => outputs.extend(self.worn(&request.outputs)?),
            View::Map | View::Hillshade => {}
        }
        request.outputs = outputs;
        let ports: Vec<_> = request.outputs.iter().map(|output| output.port).collect();
        let progress: Box<dyn Progress> = if self.quiet { Box::new(Quiet) } else { progress::for_people() };
        let builder = Builder::new(&self.means, 0)?;
        let values = builder.evaluate(&request, &ports, cancel, &*progress);
        progress.ended();
        let (values, _) = values?;
        let mut fields = values.iter().map(Value::as_field);
        let Some(Some(field)) = fields.next() else {
            return Err(undrawn("which cannot be drawn"));
        };
        let field = self.sea.around(field.clone());
        match self.view {
            View::Map => Ok(picture::of_field(&field, output.ty, picture::View::Map)),
            View::Hillshade => Ok(picture::of_field(&field, output.ty, picture::View::Hillshade)),
            View::Perspective => {
                let mut next = |wanted: bool| if wanted { fields.next().flatten().cloned() } else { None };
                let colour = next(self.perspective.colour.is_some());
                let water = next(self.perspective.water.is_some());
                self.perspective.picture(&Seen { height: field, colour, water })
            }
        }
    }

    /// The outputs that `--colour` and `--water` name, in this order.
    fn worn(&self, outputs: &[OutputDecl]) -> Result<Vec<OutputDecl>, Failure> {
        let is_depth = |ty: PortType| matches!(ty, PortType::Scalar(_) | PortType::AnyScalar | PortType::Height);
        let named = [
            ("--colour", &self.perspective.colour, "colours"),
            ("--water", &self.perspective.water, "water depths in metres"),
        ];
        let mut worn = Vec::new();
        for (option, name, what) in named {
            let Some(name) = name else { continue };
            let output = chosen(&self.file, outputs, Some(name))?;
            let fits = if option == "--colour" { output.ty == PortType::Colour } else { is_depth(output.ty) };
            if !fits {
                return Err(Failure::wrong(format!(
                    "`{option}` takes {what}, but `{name}` has the type {}",
                    output.ty
                )));
            }
            worn.push(output.clone());
        }
        Ok(worn)
    }
}

/// The failure for an option of `--view 3d` with another view.
pub(super) fn wrong_view(option: &str) -> Failure {
    Failure::wrong(format!("`{option}` is for `--view 3d`"))
}

/// The output with this name, else the first height, else the first output that can be drawn.
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
                Failure::wrong(format!("`{}` has no output that can be drawn", file.display()))
                    .hint("add one, such as `outputs: { \"height\": \"NODE\" }`")
            })
        }
    }
}
