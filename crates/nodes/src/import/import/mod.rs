//! Imports a raster file: places it, resamples it and fills its voids.
//!
//! The formats are read by [`crate::raster`]. Unless the file is placed by its coordinates, the world is a plane in
//! metres without a reference system: degrees and Web Mercator are converted to metres at the latitude of the raster's
//! centre, and coordinates determine only the size of cells, not their position. Whatever is assumed is a warning.

mod place;

use std::path::Path;

use self::place::{Grid, Mapping};
use crate::{
    prelude::*,
    quantity::{self, Quantity},
    raster::{Coarse, Head, Problem, Reader, Resampler, Voids, filling_bytes, filling_rows, presence},
};

choice! {
    /// Placement of the raster in the world.
    pub enum Placement {
        /// At true scale, its centre on the world's centre. If its cells are as large as the world's, it is moved by up
        /// to half a cell, so that samples are copied exactly.
        Centre = "centre",
        /// At true scale, its north-west corner on the world's.
        Corner = "corner",
        /// Stretched over the whole world; its own cell size is ignored.
        Stretch = "stretch",
        /// At its coordinates in a world with a `place`, warped if the world is in another coordinate system.
        Place = "place",
    }
}

choice! {
    /// Values beyond the raster.
    pub enum Beyond {
        /// The raster's edge continues.
        Extend = "extend",
        /// A plain at `level`.
        Level = "level",
    }
}

choice! {
    /// Values of cells without data.
    pub enum Voiding {
        /// Filled smoothly from the surroundings.
        Fill = "fill",
        /// Set to `level`.
        Level = "level",
    }
}

params! {
    /// The file, relative to the graph's folder.
    file: FileName = FileName::default(), One, ..;
    /// Quantity of the values, which decides what they can be wired to; a mask is clamped to 0..1.
    quantity: Quantity = Quantity::Height, One, ..;
    /// Values of the lowest and the highest code of PNG and r16.
    ///
    /// A range in a JSON file beside the raster takes precedence; without one, the range of a mask is always 0 to 1.
    range: [f64; 2] = RANGE, Metres, -1e6..=1e6;
    /// Cell size of the file; 0 reads it from the file.
    ///
    /// A file without a cell size is stretched over the world.
    cell: f64 = 0.0, Metres, 0.0..=1e6, soft 0.0..=100.0, when placement = "centre" | "corner";
    /// Placement in the world.
    placement: Placement = Placement::Centre, One, ..;
    /// Values beyond the raster.
    beyond: Beyond = Beyond::Extend, One, .., when placement = "centre" | "corner" | "place";
    /// Values of cells without data.
    voids: Voiding = Voiding::Fill, One, ..;
    /// Value for `beyond: level` and `voids: level`.
    level: f64 = 0.0, Metres, -1e6..=1e6, soft -500.0..=5000.0;
}

outputs! {
    /// Contents of the file: a height, unless `quantity` is `mask` or `scalar`.
    value: Chosen(quantity::port_type);
    /// Where the file has data: 0 in voids and beyond the file, a fraction in larger cells at their edges.
    data: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Import",
    version: 2,
    migrations: &[Migration { from: 1, steps: &[] }],
    category: "import",
    summary: "Imports a raster file as terrain, placed and resampled into the world.",
    doc: include_str!("page.md"),
    sources: &[
        "E. Catmull, R. Rom, 1974, A class of local interpolating splines",
        "S. J. Gortler, R. Grzeszczuk, R. Szeliski, M. F. Cohen, 1996, The Lumigraph",
        "J. P. Snyder, 1987, Map Projections: A Working Manual, USGS Professional Paper 1395",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    reads_place: true,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    refuses: Some(|stated| require_file(&Params::read(stated.params).file.0, "file")),
    example: "file: \"glencoe_128.tif\", placement: stretch",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    // a file that cannot be read fails when it is imported
    let Ok(reader) = Reader::open(&sizing.folder.join(&params.file.0)) else { return 0 };
    let Head { columns, rows, .. } = reader.head;
    let wants = Wants::among(sizing.wanted);
    // a file that cannot be placed fails when it is imported
    let warp = place::warp(sizing.window.world.place, &params, &reader.head, &sizing.window).ok().flatten();
    let (nx, warped) = match &warp {
        Some(warp) => (warp.cells[0] as usize, warp.bytes() * if wants.data { 2 } else { 1 }),
        None => (sizing.window.nx(), 0),
    };
    let narrowed = |rows: usize| 4 * (rows * nx) as u64;
    // the value is resampled even if only the data is wanted
    let value = warped + if wants.value { 0 } else { sizing.cells(4.0) };
    let block = 4 * (reader.block_rows() * columns) as u64;
    let marked = if wants.data { block + narrowed(reader.block_rows()) } else { 0 };
    let streamed = value + reader.bytes() + narrowed(reader.block_rows()) + marked;
    if params.voids == Voiding::Level || !reader.may_have_voids() {
        return streamed;
    }
    let filled = filling_bytes(columns, rows) + narrowed(filling_rows(columns, rows));
    streamed.max(value + reader.bytes() + filled + marked)
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let path = job.file("file")?;
    job.advance(0.0)?;
    let reader = Reader::open(&path)?;
    let head = reader.head.clone();
    let mapping = Mapping::new(job, &params, &path, &head)?;
    let grid = mapping.grid(job, &params);
    let read = match streamed(job, &params, reader, &grid) {
        Ok(Some(read)) => Ok((read, "are set to `level`")),
        Ok(None) => filled(job, &params, &path, &head, &grid)
            .map(|read| (read, "are filled from those around; `data` is 0 there")),
        Err(problem) => Err(problem),
    };
    let (read, done) = match read {
        Ok(read) => read,
        Err(problem) => {
            job.check()?;
            return Err(problem.of(&path).into());
        }
    };
    let mut read = mapping.onto_cells(job, &params, read)?;
    let remarks = scale_remarks(&params, &head).into_iter().chain(mapping.remarks());
    for remark in remarks.chain(read.voids.remarks(&head, done)) {
        job.warn(remark);
    }
    if params.quantity == Quantity::Mask {
        read.value.iter_mut().for_each(|v| *v = v.clamp(0.0, 1.0));
    }
    job.advance(1.0)?;
    let value = Wants::of(job).value.then(|| Field::new(job.window(), read.value));
    Ok(Given { value, data: read.data.map(|data| Field::new(job.window(), data)) }.into())
}

/// A file on the cells of the world, or of a grid from which they are interpolated.
struct Resampled {
    value: Vec<f32>,
    /// Where the file has data, if that is wanted.
    data: Option<Vec<f32>>,
    /// The voids that were filled or set to a level.
    voids: Voids,
}

/// The values of the lowest and the highest code where neither the file nor the graph says them.
const RANGE: [f64; 2] = [0.0, 1000.0];

/// What is assumed about the file and its place in the world.
fn scale_remarks(params: &Params, head: &Head) -> Vec<String> {
    let mut remarks = head.notes.clone();
    if matches!(params.placement, Placement::Centre | Placement::Corner) && params.cell == 0.0 {
        match head.cell {
            Some(_) => remarks.extend(head.scale_remarks()),
            None => remarks.push("the file has no cell size and is stretched over the world; set `cell`".to_owned()),
        }
    }
    let has_no_range = head.coding.is_some_and(|coding| coding.range.is_none());
    if has_no_range && params.quantity != Quantity::Mask && params.range == RANGE {
        let [low, high] = RANGE.map(|metres| Unit::Metres.display(metres));
        remarks
            .push(format!("the file does not say what its codes mean, and is taken for {low} to {high}; set `range`"));
    }
    remarks
}

/// Values of the lowest and the highest code, if the file gives none.
fn range(params: &Params) -> [f64; 2] {
    if params.quantity == Quantity::Mask { [0.0, 1.0] } else { params.range }
}

/// Value beyond the raster, unless its edge continues.
fn beyond(params: &Params) -> Option<f32> {
    (params.beyond == Beyond::Level).then_some(params.level as f32)
}

/// Resamples the rows of a file as they are read. Returns None if it finds voids that have to be filled.
fn streamed(job: &Job<'_>, params: &Params, reader: Reader<'_>, grid: &Grid) -> Result<Option<Resampled>, Problem> {
    let Grid { axes, origin, cells, beyond, known_beyond } = *grid;
    let (coding, rows, columns) = (reader.head.coding, reader.head.rows, reader.head.columns);
    let (range, level) = (range(params), params.level as f32);
    let mut resampler = Resampler::new(axes, origin, cells, beyond)?;
    let mut known = Wants::of(job).data.then(|| Resampler::new(axes, origin, cells, known_beyond)).transpose()?;
    let mut has_voids = false;
    let read = reader.read(&|| job.check().is_ok(), &mut |first, samples| {
        if let Some(coding) = coding {
            coding.decode(range, samples);
        }
        if let Some(known) = &mut known {
            known.take(first, &presence(samples)?, &|| job.check()).map_err(failed)?;
        }
        match params.voids {
            Voiding::Fill => {
                let is_void = |row: &[f32]| row.iter().fold(false, |any, v| any | v.is_nan());
                has_voids = resampler.needed(first, samples).any(is_void);
            }
            Voiding::Level => samples.iter_mut().filter(|v| v.is_nan()).for_each(|v| *v = level),
        }
        if has_voids {
            return Err(Problem::Stopped);
        }
        resampler.take(first, samples, &|| job.check()).map_err(failed)?;
        let done = (first + samples.len() / columns) as f32 / rows as f32;
        job.advance(0.9 * done).map_err(failed)
    });
    match read {
        Err(_) if has_voids => Ok(None),
        read => {
            // those to be filled are beyond the world here
            let voids = read.map(|voids| if params.voids == Voiding::Level { voids } else { Voids::default() })?;
            let data = known.map(Resampler::into_samples);
            Ok(Some(Resampled { value: resampler.into_samples(), data, voids }))
        }
    }
}

/// Uses rows of a file, the first of which has that number.
type Take<'t> = dyn FnMut(usize, &mut [f32]) -> Result<(), NodeError> + 't;

/// Reads a file twice: once for the means from which its voids are filled, once to fill and resample it.
fn filled(job: &Job<'_>, params: &Params, path: &Path, head: &Head, grid: &Grid) -> Result<Resampled, Problem> {
    let Grid { axes, origin, cells, beyond, known_beyond } = *grid;
    let check = || job.check();
    let again = |each: &mut Take<'_>| {
        let reader = Reader::open(path).map_err(|error| error.problem)?;
        if reader.head != *head {
            return Err(Problem::Damaged("another program changes it at present".to_owned()));
        }
        reader.read(&|| job.check().is_ok(), &mut |first, samples| {
            if let Some(coding) = head.coding {
                coding.decode(range(params), samples);
            }
            each(first, samples).map_err(failed)
        })
    };
    let done = |first: usize, samples: &[f32]| (first + samples.len() / head.columns) as f32 / head.rows as f32;
    let mut coarse = Coarse::new(head.columns, head.rows).map_err(failed)?;
    again(&mut |first, samples| {
        coarse.take(samples, &check)?;
        job.advance(0.4 * done(first, samples))
    })?;
    let mut filling = coarse.complete(&check).map_err(failed)?;
    let mut resampler = Resampler::new(axes, origin, cells, beyond)?;
    let mut known = Wants::of(job).data.then(|| Resampler::new(axes, origin, cells, known_beyond)).transpose()?;
    let voids = again(&mut |first, samples| {
        if let Some(known) = &mut known {
            known.take(first, &presence(samples)?, &check)?;
        }
        filling.take(samples, &check, &mut |first, rows| resampler.take(first, rows, &check))?;
        job.advance(0.4 + 0.5 * done(first, samples))
    })?;
    Ok(Resampled { value: resampler.into_samples(), data: known.map(Resampler::into_samples), voids })
}

/// The problem of a file whose rows could not be used.
fn failed(error: NodeError) -> Problem {
    match error {
        NodeError::OutOfMemory(refused) => Problem::OutOfMemory(refused),
        _ => Problem::Stopped,
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod warp_tests;
