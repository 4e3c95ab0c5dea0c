//! The files of a build: their names and formats, and how they appear all together or not at all.
//!
//! | output | file |
//! |---|---|
//! | height, mask, other scalar | `NAME.exr` or another format, with `NAME.exr.json` beside it |
//! | vector | the same twice: `NAME.x.exr` (east) and `NAME.y.exr` (south) |
//! | colour, normal, weights | `NAME.png` |
//! | lines | `NAME.geojson` |
//! | report | `NAME.json` |
//! | height, to look at | `NAME.preview.png`: shaded relief, tinted over its range, at most 2048 pixels a side |

use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
};

use orograph_graph::{Cancel, Field, OutputDecl, PortType, Value, World};
use orograph_nodes::raster::{self, Format, Meta, Problem, RasterError};
use tempfile::TempDir;

use crate::{
    failure::{Failure, reason},
    geojson, picture,
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
    /// Leave out the shaded pictures of heights (`NAME.preview.png`)
    #[arg(long)]
    pub no_preview: bool,
}

fn formats() -> impl clap::builder::TypedValueParser<Value = Format> {
    use clap::builder::{PossibleValuesParser, TypedValueParser as _};
    let names = PossibleValuesParser::new(Format::ALL.map(Format::name));
    names.try_map(|name| Format::from_name(&name).ok_or("no such format"))
}

/// A file that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The output.
    pub output: String,
    /// The file.
    pub path: PathBuf,
    /// What it holds: `height`, `mask`, ..., or `picture`.
    pub what: &'static str,
    /// Its length in bytes.
    pub bytes: u64,
    /// Lowest and highest value of a raster.
    pub range: Option<[f64; 2]>,
    /// Symbol of their unit.
    pub unit: &'static str,
}

/// The names of an output's files; the first is the output itself.
fn names(output: &OutputDecl, form: &Form) -> Vec<String> {
    let name = &output.name;
    let extension = form.format.extension();
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
                names.push(format!("{name}.preview.png"));
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
                if let Some(preview) = names.get(2 * field.planes()) {
                    let path = self.place(preview);
                    raster::write_colour(&path, &picture::preview(field), &go_on)
                        .map_err(|error| self.failure(preview, error))?;
                    self.add(output, preview, "picture", None)?;
                }
                Ok(())
            }
        }
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
        let meta = Meta {
            quantity: quantity(output.ty).to_owned(),
            unit: output.ty.unit().symbol().to_owned(),
            graph_hash: Some(key.to_owned()),
        };
        let range = (output.ty == PortType::Mask).then_some([0.0, 1.0]);
        raster::write(&self.place(&names[0]), self.form.format, &single, range, &meta, go_on)
            .map_err(|error| self.failure(&names[0], error))?;
        let range = single.range(0).map(|(lo, hi)| [f64::from(lo), f64::from(hi)]);
        self.files.push(names[1].clone());
        self.add(output, &names[0], quantity(output.ty), range)
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
        self.written.push(Written { output: output.name.clone(), path, what, bytes, range, unit });
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
        let form = Form { format: Format::Exr, no_preview: false };
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
