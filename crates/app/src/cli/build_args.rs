//! The arguments that `run` and `watch` share: a graph file, its outputs, and the folder for the files.

use std::path::PathBuf;

use orograph_graph::{OutputDecl, PortType};
use orograph_nodes::raster::Format;

use crate::{
    build::request::{Changes, Means, Request},
    export::outputs::OutputOptions,
    report::{failure::Failure, terminal},
};

/// What to build, and how.
#[derive(Debug, clap::Args)]
pub struct BuildArgs {
    /// Graph file or packed graph; `run` also takes `-` for standard input
    #[arg(value_name = "GRAPH.ron")]
    pub file: PathBuf,
    /// Folder for the files; created if it does not exist
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Build only this output; can be given several times
    #[arg(long, value_name = "NAME")]
    pub only: Vec<String>,
    #[command(flatten)]
    pub changes: Changes,
    #[command(flatten)]
    pub options: OutputOptions,
    #[command(flatten)]
    pub means: Means,
}

impl BuildArgs {
    /// Makes the request and prints the problems of the file; `warnings` decides whether warnings are printed too.
    ///
    /// # Errors
    /// As [`Request::new`], when there is nothing to build, and when an option has no effect.
    pub fn request(&self, warnings: bool) -> Result<Request, Failure> {
        let OutputOptions { dither, engine, format, .. } = self.options;
        if dither && engine.is_none() && format.largest_code().is_none() {
            return Err(Failure::wrong(format!(
                "`--dither` has no effect: `{}` stores numbers without rounding",
                format.name()
            ))
            .hint("choose png16, png8 or r16 with `--format`, or an `--engine`"));
        }
        let request = Request::new(&self.file, &self.changes, &orograph_nodes::registry(), warnings)?;
        let request = request.only(&self.only)?;
        if request.outputs.is_empty() {
            return Err(Failure::wrong(format!(
                "`{}` has no outputs, so there is nothing to build",
                self.file.display()
            ))
            .hint("add one, such as `outputs: { \"height\": \"NODE\" }`"));
        }
        if warnings {
            self.warn(&request.outputs);
        }
        Ok(request)
    }

    /// Warns of options that lose detail, and of options that change none of these outputs.
    fn warn(&self, outputs: &[OutputDecl]) {
        let options = &self.options;
        let has = |is: &dyn Fn(PortType) -> bool| outputs.iter().any(|output| is(output.ty));
        let is_coarse = |output: &&OutputDecl| output.ty == PortType::Height && options.has_format(output.ty);
        if let Some(height) = outputs.iter().find(is_coarse).filter(|_| options.format == Format::Png8) {
            terminal::warn(&format!(
                "png8 has 256 levels, which is too few for the height `{}`: build heights with `--format png16` and \
                 masks with png8, in two runs with `--only`",
                height.name
            ));
        }
        let is_raster = |ty: PortType| ty.planes().is_some();
        let has_mesh = |ty: PortType| matches!(ty, PortType::Height | PortType::Lines);
        let format = match options.engine {
            Some(_) => "the engine has its own formats for these outputs",
            None => "no output is a raster of numbers",
        };
        let idle = [
            ("--format", options.format != Format::Exr && !has(&|ty| options.has_format(ty)), format),
            ("--lines", options.lines.is_some() && !has(&|ty| ty == PortType::Lines), "no output has lines"),
            ("--tiles", options.tiles().is_some() && !has(&is_raster), "no output is a raster"),
            ("--mesh", options.mesh.is_some() && !has(&has_mesh), "no output is a height or has lines"),
        ];
        for (option, _, why) in idle.into_iter().filter(|(_, is_idle, _)| *is_idle) {
            terminal::warn(&format!("`{option}` has no effect: {why}"));
        }
    }
}
