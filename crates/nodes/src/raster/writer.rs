//! Writes a raster row by row in bounded memory; a file is complete or absent.

use std::{
    io::{self, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use orograph_graph::{Field, Window};

use super::{
    Content, Format, GoOn, Meta, Problem, RasterError, Sidecar, Writing,
    cells::Cells,
    codes::check_finite,
    exr,
    geotiff::{Cog, Frame},
    part::{Part, staged},
    png::{Picture, Stream, stored},
    sidecar_path,
};
use crate::numerics::par;

/// Bytes of the rows that are encoded at once if they are not compressed: few enough for the caches.
const BLOCK: usize = 1 << 20;

/// A raster file that is being written.
///
/// It accepts bands of rows from north to south and buffers about three megabytes of them, or the rows of a few tiles.
/// The bytes of the file do not depend on the number of rows per call. If it is dropped before [`Self::finish`], no
/// file is left.
pub struct Writer {
    path: PathBuf,
    window: Window,
    content: Content,
    cells: Cells,
    part: Part,
    container: Container,
    /// Rows written so far.
    done: usize,
    block: Vec<u8>,
    /// Lowest and highest finite sample so far.
    range: Option<(f32, f32)>,
    has_voids: bool,
}

/// The file format around the bytes of the rows.
enum Container {
    Nothing,
    Exr,
    Tiff,
    Cog(Box<Cog>),
    Png(Picture, Box<Stream>),
}

/// A complete file.
#[derive(Clone, Debug, PartialEq)]
pub struct Finished {
    /// Lowest and highest sample; `None` for pictures, and if no sample is finite.
    pub range: Option<[f64; 2]>,
    /// The JSON sidecar, if one was requested.
    pub sidecar: Option<Sidecar>,
}

impl Writer {
    /// Begins the file for a raster of this window.
    ///
    /// # Errors
    /// [`Problem::Unwritable`]; [`Problem::Misfit`] if the content [needs the whole](Content::needs_whole) raster
    /// first.
    pub fn begin(path: &Path, window: Window, content: Content) -> Result<Self, RasterError> {
        if content.needs_whole() {
            return Err(Problem::Misfit("codes over an unknown range need the whole raster first".into()).of(path));
        }
        let cells = Cells::of(content);
        let mut part = Part::begin(path)?;
        let unwritable = |error| Problem::Unwritable(error).of(path);
        let container = match content {
            Content::Numbers(Format::Cog, _) => Container::Cog(Box::new(Cog::begin(path, &window)?)),
            _ => container(&mut part, &window, content, &cells).map_err(unwritable)?,
        };
        let path = path.to_owned();
        let (done, block, range, has_voids) = (0, Vec::new(), None, false);
        Ok(Self { path, window, content, cells, part, container, done, block, range, has_voids })
    }

    /// Appends the next rows: a field whose window is a band of the raster's window.
    ///
    /// # Errors
    /// [`Problem::Unwritable`]; [`Problem::NotFinite`] if a format of codes cannot represent them; [`Problem::Stopped`]
    /// soon after `go_on` returns false; [`Problem::Misfit`] if they are not the next rows. The file cannot be
    /// completed then.
    pub fn rows(&mut self, band: &Field, go_on: GoOn<'_>) -> Result<(), RasterError> {
        let path = self.path.clone();
        self.check(band).map_err(|problem| problem.of(&path))?;
        if let Content::Numbers(_, writing) = self.content {
            let range = band.range(writing.plane);
            self.range = self.range.zip(range).map(|((a, b), (c, d))| (a.min(c), b.max(d))).or(self.range).or(range);
        }
        if matches!(self.container, Container::Tiff | Container::Cog(_)) {
            self.has_voids |= par::any(band.samples(), |v| v.is_nan());
        }
        // a failure below cannot be retried
        let first = std::mem::replace(&mut self.done, usize::MAX);
        let rows = band.window().ny();
        self.encode(band, first, go_on).map_err(|error| Part::fault(error, &path, go_on))?;
        self.done = first + rows;
        Ok(())
    }

    /// Rejects rows that are not the next ones, and values without a code.
    fn check(&self, band: &Field) -> Result<(), Problem> {
        let (whole, part) = (&self.window, band.window());
        let [west, north] = whole.origin;
        let next = u64::from(north) + self.done as u64;
        let end = u64::from(north) + u64::from(whole.cells[1]);
        let [from, to] = [0, part.cells[1]].map(|rows| u64::from(part.origin[1]) + u64::from(rows));
        if (part.world, part.origin[0], part.cells[0]) != (whole.world, west, whole.cells[0]) {
            return Err(Problem::Misfit("a band is of another world or of other columns".into()));
        }
        if self.done == usize::MAX {
            return Err(Problem::Misfit(format!("rows from {from} on come after others have failed")));
        }
        if from != next || to > end {
            let expected = format!("rows {from} to {to} come where {next} to at most {end} are expected");
            return Err(Problem::Misfit(expected));
        }
        if band.planes() < self.content.planes() {
            let (has, takes) = (band.planes(), self.content.planes());
            return Err(Problem::Misfit(format!("a band has {has} planes where {takes} are written")));
        }
        match self.cells {
            Cells::Codes { plane, .. } => check_finite(band.plane(plane)),
            _ => Ok(()),
        }
    }

    fn encode(&mut self, band: &Field, first: usize, go_on: GoOn<'_>) -> io::Result<()> {
        let Self { cells, part, container, block, .. } = self;
        if let (Container::Cog(cog), Content::Numbers(_, writing)) = (&mut *container, self.content) {
            return cog.rows(band.plane(writing.plane), go_on);
        }
        let (nx, rows) = (band.window().nx(), band.window().ny());
        let mut done = 0;
        while done < rows {
            if !go_on() {
                return Err(io::Error::other("stopped"));
            }
            if let Container::Png(_, stream) = container {
                let count = stream.wanted().min(rows - done);
                stream.rows(part, count, |out| cells.rows(band, done, out, |_| []))?;
                done += count;
                continue;
            }
            let before = if let Container::Exr = container { exr::BEFORE_ROW } else { 0 };
            let length = before + cells.step() * nx;
            let count = (BLOCK / length).clamp(1, rows - done);
            block.resize(count * length, 0);
            if let Container::Exr = container {
                cells.rows(band, done, block, |j| exr::before_row(first + j, nx));
            } else {
                cells.rows(band, done, block, |_| []);
            }
            part.write_all(block)?;
            done += count;
        }
        Ok(())
    }

    /// Completes the file, and writes its sidecar if `beside` is given.
    ///
    /// # Errors
    /// As [`Self::rows`]; [`Problem::Misfit`] if rows are missing. Earlier files of these names are then unchanged.
    pub fn finish(mut self, beside: Option<&Meta>, go_on: GoOn<'_>) -> Result<Finished, RasterError> {
        let path = self.path.clone();
        if !go_on() {
            return Err(Problem::Stopped.of(&path));
        }
        if self.done != self.window.ny() {
            return Err(Problem::Misfit("the file ends before its last row".into()).of(&path));
        }
        let sidecar = beside.map(|meta| self.sidecar(meta));
        let range = self.range.map(|(lo, hi)| [f64::from(lo), f64::from(hi)]);
        let unwritable = |error| Part::fault(error, &path, go_on);
        if let Container::Tiff = self.container {
            frame(&mut self.part, &self.window, self.has_voids).map_err(unwritable)?;
        }
        let part = match self.container {
            Container::Png(picture, stream) => {
                if stream.finish(&mut self.part).map_err(unwritable)? {
                    self.part
                } else {
                    stored(self.part, picture, &path, go_on)?
                }
            }
            Container::Cog(cog) => {
                cog.finish(&mut self.part, &self.window, self.has_voids, go_on).map_err(unwritable)?;
                self.part
            }
            Container::Nothing | Container::Exr | Container::Tiff => self.part,
        };
        let raster = part.complete(&path)?;
        if let Some(sidecar) = &sidecar {
            let beside = sidecar_path(&path);
            let text = staged(&beside, |to| {
                serde_json::to_writer_pretty(&mut *to, sidecar)?;
                to.write_all(b"\n")
            })?;
            // both files are complete; only the two renames can still fail
            raster.persist(&path)?;
            text.persist(&beside)?;
        } else {
            raster.persist(&path)?;
        }
        Ok(Finished { range, sidecar })
    }

    fn sidecar(&self, meta: &Meta) -> Sidecar {
        let of_window = Sidecar::of(&self.window, meta);
        let Content::Numbers(format, writing) = self.content else { return of_window };
        let own = self.range.map_or([0.0, 0.0], |(lo, hi)| [f64::from(lo), f64::from(hi)]);
        let Some(full) = format.largest_code() else { return Sidecar { range: Some(own), ..of_window } };
        let range = writing.range.unwrap_or(own);
        let step = Some((range[1] - range[0]) / f64::from(full));
        Sidecar { range: Some(range), step, dither: writing.dither.then_some(true), ..of_window }
    }
}

/// Writes the bytes of the file before its rows.
fn container(part: &mut Part, window: &Window, content: Content, cells: &Cells) -> io::Result<Container> {
    if let Some((colour, depth)) = cells.in_png() {
        let srgb = matches!(content, Content::Colour | Content::Tint);
        let picture = Picture { cells: window.cells, colour, depth, srgb };
        return Ok(Container::Png(picture, Box::new(Stream::begin(part, picture)?)));
    }
    match content {
        Content::Numbers(Format::Tiff, _) => {
            part.write_all(&Frame::of(window, false)?.head)?;
            Ok(Container::Tiff)
        }
        Content::Numbers(Format::R16 | Format::R32, _) => Ok(Container::Nothing),
        _ => {
            let red = matches!(content, Content::Control | Content::Numbers(_, Writing { red: true, .. }));
            part.write_all(&exr::header(window.cells, if red { "R" } else { "Y" })?)?;
            Ok(Container::Exr)
        }
    }
}

/// Writes the bytes after the samples of a TIFF, and the parts of its beginning that depend on the samples.
fn frame(part: &mut Part, window: &Window, has_voids: bool) -> io::Result<()> {
    let Frame { head, tail } = Frame::of(window, has_voids)?;
    part.write_all(&tail)?;
    part.seek(SeekFrom::Start(0))?;
    part.write_all(&head)
}
