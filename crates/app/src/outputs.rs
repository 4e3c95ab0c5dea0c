//! The files of a build: their names and formats, and how they appear all together or not at all.
//!
//! | output | file |
//! |---|---|
//! | height, mask, other scalar | `NAME.exr` or another format, with `NAME.exr.json` beside it; a height for an engine in its |
//! | vector | the same twice: `NAME.x.exr` (east) and `NAME.y.exr` (south) |
//! | colour, normal, weights | `NAME.png` |
//! | lines | `NAME.geojson` |
//! | report | `NAME.json` |
//! | height as a mesh, where asked for | `NAME.glb` or `NAME.obj` |
//! | height, to look at | `NAME.preview.png`: shaded relief, tinted over its range, at most 2048 pixels a side |

use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
};

use orograph_graph::{Cancel, Field, OutputDecl, PortType, Value, World};
use orograph_nodes::raster::{self, Format, Meta, Problem, RasterError, Writing};
use serde_json::Map;
use tempfile::TempDir;

use crate::{
    engine::{Engine, Fitted},
    failure::{Failure, reason},
    geojson,
    mesh::{MOST_TRIANGLES, Mesh, MeshFormat},
    picture,
};

/// In which form outputs are written.
#[derive(Clone, Debug, clap::Args)]
pub struct Form {
    /// Format of heights, masks and other scalars; colours are PNG, lines GeoJSON, reports JSON
    ///
    /// png16 and r16 hold whole numbers from 0 to 65535 over the range that the JSON file beside them states: 0 to 1 for
    /// masks, lowest to highest for the rest.
    #[arg(long, default_value = "exr", value_name = "FORMAT", value_parser = formats())]
    pub format: Format,
    /// Write heights as a game engine imports them, and print what to type there; the rest is as `--format` says
    #[arg(long, value_enum, value_name = "ENGINE")]
    pub engine: Option<Engine>,
    /// Round to the codes of png16 and r16 at random between the two nearest: a fine grain in place of terraces
    #[arg(long)]
    pub dither: bool,
    /// Write each height as a mesh too (`NAME.glb` or `NAME.obj`), in metres with y up
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub mesh: Option<MeshFormat>,
    /// The most triangles of a mesh
    #[arg(long, value_name = "N", default_value_t = Form::TRIANGLES, requires = "mesh",
        value_parser = clap::value_parser!(u64).range(2..=MOST_TRIANGLES))]
    pub triangles: u64,
    /// Leave out the shaded pictures of heights (`NAME.preview.png`)
    #[arg(long)]
    pub no_preview: bool,
}

impl Default for Form {
    /// What the command line writes when it is told nothing.
    fn default() -> Self {
        Self {
            format: Format::Exr,
            engine: None,
            dither: false,
            mesh: None,
            triangles: Self::TRIANGLES,
            no_preview: false,
        }
    }
}

impl Form {
    /// The most triangles of a mesh, unless told otherwise.
    const TRIANGLES: u64 = 500_000;

    /// The engine that an output is written for.
    fn engine_of(&self, ty: PortType) -> Option<Engine> {
        self.engine.filter(|_| ty == PortType::Height)
    }

    /// The format of a height, mask or other scalar.
    fn format_of(&self, ty: PortType) -> Format {
        self.engine_of(ty).map_or(self.format, Engine::format)
    }
}

fn formats() -> impl clap::builder::TypedValueParser<Value = Format> {
    use clap::builder::{PossibleValuesParser, TypedValueParser as _};
    let names = PossibleValuesParser::new(Format::ALL.map(Format::name));
    names.try_map(|name| Format::from_name(&name).ok_or("no such format"))
}

/// The end of the name of a picture of heights.
const PREVIEW: &str = ".preview.png";

/// A file that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The output.
    pub output: String,
    /// The file.
    pub path: PathBuf,
    /// What it holds: `height`, `mask`, ..., `picture` or `mesh`.
    pub what: &'static str,
    /// Its length in bytes.
    pub bytes: u64,
    /// Lowest and highest value of a raster.
    pub range: Option<[f64; 2]>,
    /// Symbol of their unit.
    pub unit: &'static str,
    /// What to type where an engine imports it.
    pub import: Option<Import>,
}

/// What to type where an engine imports a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The engine.
    pub engine: Engine,
    /// Values by the engine's own names.
    pub settings: Map<String, serde_json::Value>,
}

/// The names of an output's files; the first is the output itself.
fn names(output: &OutputDecl, form: &Form) -> Vec<String> {
    let name = &output.name;
    let extension = form.format_of(output.ty).extension();
    let with_sidecar = |stem: String| [format!("{stem}.{extension}"), format!("{stem}.{extension}.json")];
    match output.ty {
        // the check of a document has refused it
        PortType::Flow => Vec::new(),
        PortType::Lines => vec![format!("{name}.geojson")],
        PortType::Report => vec![format!("{name}.json")],
        PortType::Colour | PortType::Normal | PortType::Weights => vec![format!("{name}.png")],
        PortType::Vector(_) => ["x", "y"].into_iter().flat_map(|axis| with_sidecar(format!("{name}.{axis}"))).collect(),
        PortType::Height | PortType::Mask | PortType::Scalar(_) | PortType::AnyScalar => {
            let mut names = with_sidecar(name.clone()).to_vec();
            if output.ty == PortType::Height && !form.no_preview {
                names.push(format!("{name}{PREVIEW}"));
            }
            if let Some(mesh) = form.mesh.filter(|_| output.ty == PortType::Height) {
                names.push(format!("{name}.{}", mesh.extension()));
            }
            names
        }
    }
}

/// A folder that outputs are to be written to, and the hidden folder in it where they are written first.
///
/// Dropped without [`Self::commit`], it leaves everything as it was.
#[derive(Debug)]
pub struct OutputFolder {
    folder: PathBuf,
    /// Folders that did not exist before, outermost first.
    made: Vec<PathBuf>,
    staging: Option<TempDir>,
    form: Form,
    written: Vec<Written>,
    files: Vec<String>,
}

impl OutputFolder {
    /// Makes the folder if it does not exist, and checks that files of all names can appear in it.
    ///
    /// # Errors
    /// When an output's name cannot be that of a file, two outputs would write the same file, or the folder cannot be
    /// written to.
    pub fn prepare(folder: &Path, outputs: &[OutputDecl], form: &Form) -> Result<Self, Failure> {
        let mut taken = BTreeSet::new();
        for output in outputs {
            check_name(&output.name)?;
            for name in names(output, form) {
                if !taken.insert(name.clone()) {
                    return Err(Failure::wrong(format!("two outputs would both be written to `{name}`"))
                        .hint("rename one of them, or choose another `--format`"));
                }
                let target = folder.join(name);
                if target.is_dir() {
                    return Err(Failure::unable(format!(
                        "`{}` is a folder; a file is to stand there",
                        target.display()
                    ))
                    .hint("remove it, or choose another folder with `-o`"));
                }
            }
        }
        let mut prepared = Self {
            folder: folder.to_owned(),
            made: missing(folder),
            staging: None,
            form: form.clone(),
            written: Vec::new(),
            files: Vec::new(),
        };
        let refused = |error: io::Error| {
            Failure::unable(format!("cannot write to the folder `{}`: {}", folder.display(), reason(&error)))
                .hint("choose another folder with `-o`")
        };
        if folder.exists() && !folder.is_dir() {
            return Err(refused(io::ErrorKind::NotADirectory.into()));
        }
        fs::create_dir_all(folder).map_err(refused)?;
        prepared.staging = Some(tempfile::Builder::new().prefix(".orograph-").tempdir_in(folder).map_err(refused)?);
        Ok(prepared)
    }

    /// Writes an output's files, not yet under their names. `world` is where it lies, `key` the hash of what it comes
    /// from.
    ///
    /// # Errors
    /// When they cannot be written, or it is stopped.
    pub fn write(
        &mut self,
        output: &OutputDecl,
        value: &Value,
        world: &World,
        key: &str,
        cancel: &Cancel,
    ) -> Result<(), Failure> {
        let names = names(output, &self.form);
        let go_on = || !cancel.is_cancelled();
        match value {
            _ if !output.ty.is_writable() => {
                Err(Failure::wrong(format!("`{}` is a {}, which is not written to a file", output.name, output.ty)))
            }
            Value::Lines(lines) => {
                let path = self.place(&names[0]);
                let filled = raster::replace(&path, |to| geojson::write(to, lines, world));
                filled.map_err(|error| self.failure(&names[0], error))?;
                self.add(output, &names[0], quantity(output.ty), None)
            }
            Value::Report(report) => {
                let path = self.place(&names[0]);
                let filled = raster::replace(&path, |to| {
                    serde_json::to_writer_pretty(&mut *to, report.as_ref())?;
                    io::Write::write_all(to, b"\n")
                });
                filled.map_err(|error| self.failure(&names[0], error))?;
                self.add(output, &names[0], quantity(output.ty), None)
            }
            Value::Field(field) if matches!(output.ty, PortType::Colour | PortType::Normal | PortType::Weights) => {
                let write = match output.ty {
                    PortType::Normal => raster::write_normal,
                    PortType::Weights => raster::write_weights,
                    _ => raster::write_colour,
                };
                write(&self.place(&names[0]), field, &go_on).map_err(|error| self.failure(&names[0], error))?;
                self.add(output, &names[0], quantity(output.ty), None)
            }
            Value::Field(field) => {
                for plane in 0..field.planes() {
                    self.write_plane(output, &names[2 * plane..2 * plane + 2], field, plane, (key, &go_on))?;
                }
                for name in &names[2 * field.planes()..] {
                    let what = self.write_view(name, field, &go_on)?;
                    self.add(output, name, what, None)?;
                }
                Ok(())
            }
        }
    }

    /// Writes a picture or a mesh of heights; says which.
    fn write_view(&self, name: &str, height: &Field, go_on: raster::GoOn<'_>) -> Result<&'static str, Failure> {
        let path = self.place(name);
        let written = match self.form.mesh {
            Some(format) if !name.ends_with(PREVIEW) => {
                let mesh = Mesh::of(height, self.form.triangles, go_on).map_err(|_| Failure::stopped())?;
                raster::replace(&path, |to| mesh.write(format, to)).map(|()| "mesh")
            }
            _ => raster::write_colour(&path, &picture::preview(height), go_on).map(|()| "picture"),
        };
        written.map_err(|error| self.failure(name, error))
    }

    fn write_plane(
        &mut self,
        output: &OutputDecl,
        names: &[String],
        field: &Field,
        plane: usize,
        (key, go_on): (&str, raster::GoOn<'_>),
    ) -> Result<(), Failure> {
        let single = match field.planes() {
            1 => field.clone(),
            _ => Field::new(*field.window(), field.plane(plane).to_vec()),
        };
        let dither = self.form.dither;
        let fitted = match self.form.engine_of(output.ty) {
            Some(engine) => Some((engine, engine.fit(&single, dither, go_on).map_err(|_| Failure::stopped())?)),
            None => None,
        };
        let (single, writing, import) = match fitted {
            Some((engine, Fitted { height, writing, import })) => {
                (height, writing, Some(Import { engine, settings: import }))
            }
            None => {
                let range = (output.ty == PortType::Mask).then_some([0.0, 1.0]);
                (single, Writing { range, dither, red: false }, None)
            }
        };
        let meta = Meta {
            quantity: quantity(output.ty).to_owned(),
            unit: output.ty.unit().symbol().to_owned(),
            graph_hash: Some(key.to_owned()),
            import: import.as_ref().map(|import| import.settings.clone()),
        };
        let format = self.form.format_of(output.ty);
        raster::write(&self.place(&names[0]), format, &single, writing, &meta, go_on)
            .map_err(|error| self.failure(&names[0], error))?;
        let range = single.range(0).map(|(lo, hi)| [f64::from(lo), f64::from(hi)]);
        self.files.push(names[1].clone());
        self.add(output, &names[0], quantity(output.ty), range)?;
        if let Some(written) = self.written.last_mut() {
            written.import = import;
        }
        Ok(())
    }

    /// Renames everything into place.
    ///
    /// # Errors
    /// When a file cannot be renamed; those before it are in place then.
    pub fn commit(mut self) -> Result<Vec<Written>, Failure> {
        for name in &self.files {
            fs::rename(self.place(name), self.folder.join(name)).map_err(|error| self.unwritable(name, &error))?;
        }
        self.made.clear();
        Ok(std::mem::take(&mut self.written))
    }

    /// Where a file is before it is renamed.
    fn place(&self, name: &str) -> PathBuf {
        self.staging.as_ref().map_or(self.folder.as_path(), TempDir::path).join(name)
    }

    fn add(
        &mut self,
        output: &OutputDecl,
        name: &str,
        what: &'static str,
        range: Option<[f64; 2]>,
    ) -> Result<(), Failure> {
        let bytes = fs::metadata(self.place(name)).map_err(|error| self.unwritable(name, &error))?.len();
        self.files.push(name.to_owned());
        let path = self.folder.join(name);
        let unit = if range.is_some() { output.ty.unit().symbol() } else { "" };
        self.written.push(Written { output: output.name.clone(), path, what, bytes, range, unit, import: None });
        Ok(())
    }

    fn failure(&self, name: &str, error: RasterError) -> Failure {
        match &error.problem {
            Problem::Unwritable(error) => self.unwritable(name, error),
            Problem::Stopped => Failure::stopped(),
            problem => {
                let path = self.folder.join(name);
                Failure::unable(format!("`{}`: {problem}", path.display())).hint(error.remedy())
            }
        }
    }

    fn unwritable(&self, name: &str, error: &io::Error) -> Failure {
        Failure::unable(format!("cannot write `{}`: {}", self.folder.join(name).display(), reason(error)))
            .hint("earlier files are as they were; make room, or choose another folder with `-o`")
    }
}

impl Drop for OutputFolder {
    /// Removes what was made for nothing. What cannot be removed stays, and does no harm.
    fn drop(&mut self) {
        drop(self.staging.take());
        for folder in self.made.iter().rev() {
            let _ = fs::remove_dir(folder);
        }
    }
}

/// The folders above and including this one that do not exist, outermost first.
fn missing(folder: &Path) -> Vec<PathBuf> {
    let above = folder.ancestors().filter(|path| !path.as_os_str().is_empty());
    let mut missing: Vec<PathBuf> = above.take_while(|path| !path.exists()).map(Path::to_owned).collect();
    missing.reverse();
    missing
}

/// Refuses names that are no names of files everywhere.
fn check_name(name: &str) -> Result<(), Failure> {
    let odd = |c: char| c.is_control() || matches!(c, '/' | '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|');
    if name.is_empty() || name.starts_with('.') || name.contains(odd) || name.len() > 200 {
        return Err(Failure::wrong(format!("the output `{}` cannot be the name of a file", name.escape_debug()))
            .hint("rename it in `outputs`, with letters, digits, `_` and `-`"));
    }
    Ok(())
}

const fn quantity(ty: PortType) -> &'static str {
    match ty {
        PortType::Height => "height",
        PortType::Mask => "mask",
        PortType::Scalar(_) | PortType::AnyScalar => "scalar",
        PortType::Vector(_) => "vector",
        PortType::Colour => "colour",
        PortType::Normal => "normal",
        PortType::Weights => "weights",
        PortType::Flow => "flow",
        PortType::Lines => "lines",
        PortType::Report => "report",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_leave_the_folder_are_refused() {
        for name in ["", "../up", "a/b", ".hidden", "a:b", "a\nb", "c:\\d"] {
            assert_eq!(check_name(name).expect_err(name).exit, crate::Exit::Wrong);
        }
        assert_eq!(check_name("flow-accumulation_2.x"), Ok(()));
    }

    #[test]
    fn nothing_is_left_of_a_build_that_failed() {
        let root = tempfile::tempdir().expect("a folder");
        let form =
            Form { format: Format::Exr, engine: None, dither: false, mesh: None, triangles: 2, no_preview: false };
        let folder = root.path().join("a/b");
        let prepared = OutputFolder::prepare(&folder, &[], &form).expect("can be made");
        assert!(folder.is_dir());
        drop(prepared);
        assert_eq!(fs::read_dir(root.path()).expect("is there").count(), 0);
        let file = root.path().join("file");
        fs::write(&file, "x").expect("written");
        for folder in [file.clone(), file.join("below")] {
            let failure = OutputFolder::prepare(&folder, &[], &form).expect_err("a file stands there");
            assert_eq!(failure.exit, crate::Exit::Unable, "{failure}");
        }
    }
}
