//! The folder of a build: its files appear all together or not at all, even if the program is killed or the power
//! fails.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs, io,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use orograph_graph::{
    Cancel, Lines, OutputDecl, Report, Value, Window,
    files::{self, Change, CommitError, Staging},
    memory::Leftover,
};
use orograph_nodes::raster::{self, Problem, RasterError};

use super::{
    Holes, OutputOptions, OutputWriter, Written,
    names::{check_name, names, quantity, views},
};
use crate::{
    export::{
        engine::sheet,
        geojson::{self, Coordinates},
        surface::mesh_of_areas,
    },
    report::failure::{Failure, reason, remedy},
};

/// The output folder, and the hidden folder in it where files are written first.
///
/// Outputs can be written concurrently, from several threads and in any order. Dropped without [`Self::commit`], it
/// leaves everything unchanged.
#[derive(Debug)]
pub struct OutputFolder {
    folder: PathBuf,
    /// Folders that did not exist before, outermost first.
    made: Vec<PathBuf>,
    staging: Option<Staging>,
    pub(super) options: OutputOptions,
    /// The cells that are written without data.
    pub(super) holes: Option<Holes>,
    /// Finer cells along the side of each cell that the outputs are computed from.
    pub(super) supersample: u32,
    /// The names of the outputs in their order.
    outputs: Vec<String>,
    /// The files of each complete output, by its index.
    complete: Mutex<BTreeMap<usize, Vec<Staged>>>,
}

/// A complete file that has not been renamed into place.
#[derive(Clone, Debug)]
pub(super) struct Staged {
    /// Its final name.
    pub(super) name: String,
    /// False if there is no such file, and an earlier one is removed.
    pub(super) is_new: bool,
    /// Its entry in the report; None for a side file.
    pub(super) written: Option<Written>,
}

impl OutputFolder {
    /// Creates the folder if necessary, and checks that files of all names can appear in it.
    ///
    /// # Errors
    /// When an output's name is not a valid file name, two outputs would write the same file, or the folder is not
    /// writable.
    pub fn prepare(folder: &Path, outputs: &[OutputDecl], options: &OutputOptions) -> Result<Self, Failure> {
        let (mut taken, mut folded) = (BTreeSet::new(), BTreeSet::new());
        for output in outputs {
            check_name(&output.name)?;
            for name in names(output, options) {
                // some systems do not tell cases apart
                if !folded.insert(name.to_lowercase()) {
                    let what = format!("two outputs would both be written to `{name}`");
                    let is_case = !taken.contains(&name);
                    return Err(match is_case {
                        true => Failure::wrong(format!("{what} where file names have no case"))
                            .hint("give one of them a name that differs in more than its case"),
                        false => Failure::wrong(what).hint("rename one of them, or choose another `--format`"),
                    });
                }
                taken.insert(name);
            }
        }
        // output files never end in `.txt`
        taken.extend(options.engine.map(|engine| engine.sheet_name().to_owned()));
        if let Some(target) = taken.iter().map(|name| folder.join(name)).find(|target| target.is_dir()) {
            return Err(Failure::unable(format!(
                "`{}` is a folder, but a file must be written there",
                target.display()
            ))
            .hint("remove it, or choose another folder with `-o`"));
        }
        let mut prepared = Self {
            folder: folder.to_owned(),
            made: missing(folder),
            staging: None,
            options: options.clone(),
            holes: None,
            supersample: 1,
            outputs: outputs.iter().map(|output| output.name.clone()).collect(),
            complete: Mutex::default(),
        };
        let refused = |error: io::Error| {
            Failure::unable(format!("cannot write to the folder `{}`: {}", folder.display(), reason(&error)))
                .hint(format!("{}, or choose another folder with `-o`", remedy(&error)))
        };
        if folder.exists() && !folder.is_dir() {
            return Err(refused(io::ErrorKind::NotADirectory.into()));
        }
        let around: Vec<&Path> = prepared.made.iter().rev().map(PathBuf::as_path).collect();
        // removes them if memory runs out before `Staging` has noted them with its own folder
        let _noted = Leftover::note(&[], &around);
        files::create_folders(folder, files::Access::Usual).map_err(refused)?;
        let staging = Staging::begin(folder, &around).map_err(refused)?;
        prepared.staging = Some(staging);
        Ok(prepared)
    }

    /// Leaves cells without data in the files of writers that begin after it.
    pub fn leave(&mut self, holes: Holes) {
        self.holes = Some(holes);
    }

    /// Makes sidecars state that each cell is computed from N x N finer ones.
    pub const fn supersample(&mut self, factor: u32) {
        self.supersample = factor;
    }

    /// All files that outputs can have in a folder.
    #[must_use]
    pub fn files(folder: &Path, outputs: &[OutputDecl], options: &OutputOptions) -> Vec<PathBuf> {
        let sheet = options.engine.map(|engine| engine.sheet_name().to_owned());
        let names = outputs.iter().flat_map(|output| names(output, options)).chain(sheet);
        names.map(|name| folder.join(name)).collect()
    }

    /// Refuses to replace a file that the graph reads, whatever links lead to it.
    ///
    /// # Errors
    /// When one of the outputs would be written over one of these files.
    pub fn protect(
        folder: &Path,
        outputs: &[OutputDecl],
        options: &OutputOptions,
        read: impl IntoIterator<Item = PathBuf>,
    ) -> Result<(), Failure> {
        let places: BTreeSet<PathBuf> = read.into_iter().filter_map(|file| fs::canonicalize(file).ok()).collect();
        for target in Self::files(folder, outputs, options) {
            if fs::canonicalize(&target).is_ok_and(|place| places.contains(&place)) {
                return Err(Failure::wrong(format!(
                    "`{}` would be written over, but the graph reads it",
                    target.display()
                ))
                .hint("choose another folder with `-o`, or rename the output"));
            }
        }
        Ok(())
    }

    /// A writer of an output's raster over a window, which accepts its rows as they are ready. The first rows open the
    /// files.
    ///
    /// # Errors
    /// When outputs of this type are not written to files.
    pub fn writer(&self, output: &OutputDecl, window: &Window) -> Result<OutputWriter<'_>, Failure> {
        check_type(output)?;
        Ok(OutputWriter::new(self, output, *window))
    }

    /// Writes an output's files under temporary names. `window` is the part of the world, `key` the hash of everything it
    /// depends on.
    ///
    /// # Errors
    /// When they cannot be written, or the build is cancelled.
    pub fn write(
        &self,
        output: &OutputDecl,
        value: &Value,
        window: &Window,
        key: &str,
        cancel: &Cancel,
    ) -> Result<(), Failure> {
        check_type(output)?;
        match value {
            Value::Field(field) => {
                let mut writer = self.writer(output, field.window())?;
                writer.rows(field, cancel)?;
                writer.finish(key, cancel)
            }
            Value::Lines(lines) => {
                let on = Coordinates::new(self.options.lines, &window.world)?;
                self.write_text(output, None, |to| geojson::write(to, lines, &on))?;
                self.write_surface(output, lines, window)
            }
            Value::Report(report) => self.write_text(output, Some(report), |to| {
                serde_json::to_writer_pretty(&mut *to, report.as_ref())?;
                to.write_all(b"\n")
            }),
            // `check_type` has refused strata, and a state is never delivered
            Value::Strata(_) | Value::State(_) => Ok(()),
        }
    }

    /// Writes the only file of an output that is not a raster.
    fn write_text(
        &self,
        output: &OutputDecl,
        report: Option<&Arc<Report>>,
        fill: impl FnOnce(&mut dyn io::Write) -> io::Result<()>,
    ) -> Result<(), Failure> {
        let Some(name) = names(output, &self.options).into_iter().next() else { return Ok(()) };
        raster::replace(&self.place(&name), fill).map_err(|error| self.failure(&name, error))?;
        let mut file = self.staged(output, &name, quantity(output.ty), None)?;
        file.written.iter_mut().for_each(|written| written.report = report.cloned());
        self.add(output, vec![file]);
        Ok(())
    }

    /// Writes the areas that an output's lines bound as a mesh, if one is requested and there are any.
    fn write_surface(&self, output: &OutputDecl, lines: &Lines, window: &Window) -> Result<(), Failure> {
        let Some(format) = self.options.mesh else { return Ok(()) };
        let Some(name) = views(output, &self.options).pop() else { return Ok(()) };
        let Some(mesh) = mesh_of_areas(lines, window) else {
            // the water of an earlier build is no longer there
            self.add(output, vec![Staged { name, is_new: false, written: None }]);
            return Ok(());
        };
        raster::replace(&self.place(&name), |to| mesh.write(format, to)).map_err(|error| self.failure(&name, error))?;
        let file = self.staged(output, &name, "mesh", None)?;
        self.add(output, vec![file]);
        Ok(())
    }

    /// Writes the import settings for the engine, if there are any.
    fn write_sheet(&self, files: &[Staged]) -> Result<Option<Staged>, Failure> {
        let written: Vec<Written> = files.iter().filter_map(|file| file.written.clone()).collect();
        let Some((engine, text)) = self.options.engine.and_then(|to| Some((to, sheet(to, &written)?))) else {
            return Ok(None);
        };
        let name = engine.sheet_name();
        let filled = raster::replace(&self.place(name), |to| to.write_all(text.as_bytes()));
        filled.map_err(|error| self.failure(name, error))?;
        let written = Written {
            output: String::new(),
            path: self.folder.join(name),
            what: "import settings",
            bytes: text.len() as u64,
            range: None,
            unit: "",
            import: None,
            report: None,
            is_described: false,
        };
        Ok(Some(Staged { name: name.to_owned(), is_new: true, written: Some(written) }))
    }

    /// Puts everything in place; returns the files in the order of the outputs, whatever the order in which they were
    /// written.
    ///
    /// # Errors
    /// When a file cannot be put in place; earlier files are then unchanged, or the hint says where they are.
    pub fn commit(mut self) -> Result<Vec<Written>, Failure> {
        let complete = std::mem::take(self.complete.get_mut().unwrap_or_else(PoisonError::into_inner));
        let mut files: Vec<Staged> = complete.into_values().flatten().collect();
        files.extend(self.write_sheet(&files)?);
        if let Some(staging) = self.staging.take() {
            staging.commit(&changes(&files)).map_err(|error| self.uncommitted(&error))?;
        }
        for above in self.made.iter().filter_map(|folder| folder.parent()) {
            // a folder that is lost with the power is no mixture
            let _ = files::flush_folder(above);
        }
        self.made.clear();
        Ok(files.into_iter().filter_map(|file| file.written).collect())
    }

    /// The path of a file before it is renamed.
    pub(super) fn place(&self, name: &str) -> PathBuf {
        self.staging.as_ref().map_or_else(|| self.folder.clone(), Staging::files).join(name)
    }

    /// A complete file of an output.
    pub(super) fn staged(
        &self,
        output: &OutputDecl,
        name: &str,
        what: &'static str,
        range: Option<[f64; 2]>,
    ) -> Result<Staged, Failure> {
        let bytes = fs::metadata(self.place(name)).map_err(|error| self.unwritable(name, &error))?.len();
        let path = self.folder.join(name);
        let unit = if range.is_some() { output.ty.unit().symbol() } else { "" };
        let written = Written {
            output: output.name.clone(),
            path,
            what,
            bytes,
            range,
            unit,
            import: None,
            report: None,
            is_described: false,
        };
        Ok(Staged { name: name.to_owned(), is_new: true, written: Some(written) })
    }

    /// Adds the files of a complete output.
    pub(super) fn add(&self, output: &OutputDecl, files: Vec<Staged>) {
        let place = self.outputs.iter().position(|name| *name == output.name).unwrap_or(self.outputs.len());
        self.complete.lock().unwrap_or_else(PoisonError::into_inner).entry(place).or_default().extend(files);
    }

    pub(super) fn failure(&self, name: &str, error: RasterError) -> Failure {
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
            .hint(format!("earlier files are unchanged; {}, or choose another folder with `-o`", remedy(error)))
    }

    fn uncommitted(&self, error: &CommitError) -> Failure {
        let failure = self.unwritable(&error.name, &error.error);
        let Some(left) = &error.left else { return failure };
        let (left, remedy) = (left.display(), remedy(&error.error));
        failure.hint(format!("earlier files are in `{left}`, and the next run puts them back; {remedy}"))
    }
}

impl Drop for OutputFolder {
    /// Removes the temporary files and the folders created for them. Those that cannot be removed are harmless.
    fn drop(&mut self) {
        drop(self.staging.take());
        for folder in self.made.iter().rev() {
            let _ = files::remove_folder(folder);
        }
    }
}

/// The changes of a commit, side files first. Since the earlier files leave in the opposite order, a raster is never
/// there without its side file.
fn changes(files: &[Staged]) -> Vec<Change> {
    let (side, others): (Vec<_>, Vec<_>) = files.iter().partition(|file| file.written.is_none());
    let change = |file: &Staged| Change { name: file.name.clone(), is_new: file.is_new };
    side.into_iter().chain(others).map(change).collect()
}

fn check_type(output: &OutputDecl) -> Result<(), Failure> {
    if output.ty.is_writable() {
        return Ok(());
    }
    Err(Failure::wrong(format!("`{}` has the type {}, which cannot be written to a file", output.name, output.ty)))
}

/// The missing folders on the path, outermost first.
fn missing(folder: &Path) -> Vec<PathBuf> {
    let above = folder.ancestors().filter(|path| !path.as_os_str().is_empty());
    let mut missing: Vec<PathBuf> = above.take_while(|path| !path.exists()).map(Path::to_owned).collect();
    missing.reverse();
    missing
}
