//! The files of a build: their names and formats, and how they appear all together or not at all.
//!
//! | output | file |
//! |---|---|
//! | height, mask, other scalar | `NAME.exr` or another format, with `NAME.exr.json` beside it |
//! | vector | the same twice: `NAME.x.exr` (east) and `NAME.y.exr` (south) |
//! | colour, normal, weights | `NAME.png` |
//! | any of these for an engine | its own files ([`Engine::ends`]), each with a JSON file, and a text of what to type there |
//! | lines | `NAME.geojson` |
//! | report | `NAME.json` |
//! | height as a mesh, where asked for | `NAME.glb` or `NAME.obj` |
//! | height, to look at | `NAME.preview.png`: shaded relief, tinted over its range, at most 2048 pixels a side |

use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
};

use orograph_graph::{Cancel, Field, OutputDecl, PortType, Value, World, memory::Leftover};
use orograph_nodes::raster::{self, Format, Meta, Problem, RasterError};
use serde_json::Map;
use tempfile::TempDir;

use crate::{
    engine::{Engine, sheet},
    failure::{Failure, reason},
    geojson,
    mesh::{MOST_TRIANGLES, Mesh, MeshFormat},
    picture,
    piece::{Content, Piece},
};

/// In which form outputs are written.
#[derive(Clone, Debug, clap::Args)]
pub struct Form {
    /// Format of heights, masks and other scalars; colours are PNG, lines GeoJSON, reports JSON
    ///
    /// png16 and r16 hold whole numbers from 0 to 65535, png8 from 0 to 255, over the range that the JSON file beside them
    /// states: 0 to 1 for masks, lowest to highest for the rest.
    #[arg(long, default_value = "exr", value_name = "FORMAT", value_parser = formats())]
    pub format: Format,
    /// Write heights, masks, weights, colours and normals as a game engine imports them, and what to type there
    ///
    /// What to type is printed and stands in ENGINE.txt and the JSON files. What an engine has no place for is as `--format`
    /// says.
    #[arg(long, value_enum, value_name = "ENGINE")]
    pub engine: Option<Engine>,
    /// Round to whole codes at random between the two nearest: a fine grain in place of terraces
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

    /// What an engine calls the files of an output; none where it is written as without one.
    fn ends(&self, ty: PortType) -> &'static [&'static str] {
        self.engine.map_or(&[], |engine| engine.ends(ty))
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
    /// The output; empty for what is about all of them.
    pub output: String,
    /// The file.
    pub path: PathBuf,
    /// What it holds: `height`, `mask`, ..., `picture`, `mesh` or `what to type`.
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

impl Import {
    /// Names and values as they are read.
    pub fn lines(&self) -> impl Iterator<Item = (&str, String)> {
        let text = |value: &serde_json::Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        self.settings.iter().map(move |(name, value)| (name.as_str(), text(value)))
    }
}

/// The names of the files of an output's rasters; none where it has none.
fn rasters(output: &OutputDecl, form: &Form) -> Vec<String> {
    let (name, extension) = (&output.name, form.format.extension());
    let ends = form.ends(output.ty);
    if !ends.is_empty() {
        return ends.iter().map(|end| format!("{name}{end}")).collect();
    }
    match output.ty {
        // the check of a document has refused it
        PortType::Flow | PortType::Lines | PortType::Report => Vec::new(),
        PortType::Colour | PortType::Normal | PortType::Weights => vec![format!("{name}.png")],
        PortType::Vector(_) => ["x", "y"].map(|axis| format!("{name}.{axis}.{extension}")).to_vec(),
        PortType::Height | PortType::Mask | PortType::Scalar(_) | PortType::AnyScalar => {
            vec![format!("{name}.{extension}")]
        }
    }
}

/// Whether a JSON file stands beside each raster of an output.
fn is_described(output: &OutputDecl, form: &Form) -> bool {
    let picture = matches!(output.ty, PortType::Colour | PortType::Normal | PortType::Weights);
    !picture || !form.ends(output.ty).is_empty()
}

/// The names of what is drawn or built from an output's heights.
fn views(output: &OutputDecl, form: &Form) -> Vec<String> {
    if output.ty != PortType::Height {
        return Vec::new();
    }
    let preview = (!form.no_preview).then(|| format!("{}{PREVIEW}", output.name));
    let mesh = form.mesh.map(|mesh| format!("{}.{}", output.name, mesh.extension()));
    preview.into_iter().chain(mesh).collect()
}

/// The names of all files of an output.
fn names(output: &OutputDecl, form: &Form) -> Vec<String> {
    let name = &output.name;
    match output.ty {
        PortType::Lines => vec![format!("{name}.geojson")],
        PortType::Report => vec![format!("{name}.json")],
        _ => {
            let described = is_described(output, form);
            let rasters = rasters(output, form);
            let sidecars = rasters.iter().filter(|_| described).map(|name| sidecar(name)).collect::<Vec<_>>();
            [rasters, sidecars, views(output, form)].concat()
        }
    }
}

/// The name of the JSON file beside a raster.
fn sidecar(name: &str) -> String {
    format!("{name}.json")
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
    /// Removes what was made when the program ends for lack of memory.
    leftover: Option<Leftover>,
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
            }
        }
        // no output's file ends in `.txt`
        taken.extend(form.engine.map(|engine| engine.sheet_name().to_owned()));
        if let Some(target) = taken.iter().map(|name| folder.join(name)).find(|target| target.is_dir()) {
            return Err(Failure::unable(format!("`{}` is a folder; a file is to stand there", target.display()))
                .hint("remove it, or choose another folder with `-o`"));
        }
        let mut prepared = Self {
            folder: folder.to_owned(),
            made: missing(folder),
            staging: None,
            leftover: None,
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
        let staging = tempfile::Builder::new().prefix(".orograph-").tempdir_in(folder).map_err(refused)?;
        let around: Vec<&Path> = prepared.made.iter().rev().map(PathBuf::as_path).collect();
        prepared.leftover = Some(Leftover::note(staging.path(), &around));
        prepared.staging = Some(staging);
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
                    to.write_all(b"\n")
                });
                filled.map_err(|error| self.failure(&names[0], error))?;
                self.add(output, &names[0], quantity(output.ty), None)
            }
            Value::Field(field) => {
                let pieces = self.pieces(output, field, &go_on)?;
                for (piece, name) in pieces.into_iter().zip(rasters(output, &self.form)) {
                    self.write_piece(output, &name, piece, (key, &go_on))?;
                }
                for name in views(output, &self.form) {
                    let what = self.write_view(&name, field, &go_on)?;
                    self.add(output, &name, what, None)?;
                }
                Ok(())
            }
        }
    }

    /// What is written of a raster, in the order of [`rasters`].
    fn pieces(&self, output: &OutputDecl, field: &Field, go_on: raster::GoOn<'_>) -> Result<Vec<Piece>, Failure> {
        let (ty, form) = (output.ty, &self.form);
        if let Some(engine) = form.engine.filter(|_| !form.ends(ty).is_empty()) {
            return engine.fit(ty, field, form.dither, go_on).map_err(|_| Failure::stopped());
        }
        let piece = |field: Field, content: Content| Piece { field, content, import: Map::new() };
        let content = match ty {
            PortType::Colour => Content::Colour,
            PortType::Normal => Content::Normal,
            PortType::Weights => Content::Weights,
            _ => {
                let content = Content::numbers(ty, form.format, form.dither);
                if field.planes() > 1 {
                    let plane = |plane: usize| Field::new(*field.window(), field.plane(plane).to_vec());
                    return Ok((0..field.planes()).map(|at| piece(plane(at), content)).collect());
                }
                content
            }
        };
        Ok(vec![piece(field.clone(), content)])
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

    fn write_piece(
        &mut self,
        output: &OutputDecl,
        name: &str,
        piece: Piece,
        (key, go_on): (&str, raster::GoOn<'_>),
    ) -> Result<(), Failure> {
        let import = Some(&piece.import).filter(|import| !import.is_empty()).cloned();
        let meta = Meta {
            quantity: quantity(output.ty).to_owned(),
            unit: output.ty.unit().symbol().to_owned(),
            graph_hash: Some(key.to_owned()),
            import: import.clone(),
        };
        let described = is_described(output, &self.form);
        piece.write(&self.place(name), &meta, described, go_on).map_err(|error| self.failure(name, error))?;
        if described {
            self.files.push(sidecar(name));
        }
        self.add(output, name, quantity(output.ty), piece.range())?;
        if let Some(written) = self.written.last_mut() {
            written.import = self.form.engine.zip(import).map(|(engine, settings)| Import { engine, settings });
        }
        Ok(())
    }

    /// Writes what to type in the engine, where there is anything.
    fn write_sheet(&mut self) -> Result<(), Failure> {
        let Some((engine, text)) = self.form.engine.and_then(|to| Some((to, sheet(to, &self.written)?))) else {
            return Ok(());
        };
        let name = engine.sheet_name();
        let filled = raster::replace(&self.place(name), |to| to.write_all(text.as_bytes()));
        filled.map_err(|error| self.failure(name, error))?;
        self.files.push(name.to_owned());
        self.written.push(Written {
            output: String::new(),
            path: self.folder.join(name),
            what: "what to type",
            bytes: text.len() as u64,
            range: None,
            unit: "",
            import: None,
        });
        Ok(())
    }

    /// Renames everything into place.
    ///
    /// # Errors
    /// When a file cannot be renamed; those before it are in place then.
    pub fn commit(mut self) -> Result<Vec<Written>, Failure> {
        self.write_sheet()?;
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
        drop(self.leftover.take());
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
