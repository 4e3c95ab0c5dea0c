//! Imports a raster file: places it, resamples it and fills its voids.
//!
//! The formats are read by [`crate::raster`]. Unlike in a geographic information system, the world is a plane in metres
//! without a reference system. Degrees are converted to metres at the latitude of the raster's centre, and coordinates
//! determine only the size of cells, not their position.

use std::path::Path;

use crate::{
    prelude::*,
    quantity::{self, Quantity},
    raster::{self, GridAxis, Head, Problem, Raster, Reader, Resampler, fill_voids, resample},
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
    pub enum Voids {
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
    range: [f64; 2] = [0.0, 1000.0], Metres, -1e6..=1e6;
    /// Cell size of the file; 0 reads it from the file.
    ///
    /// A file without a cell size is stretched over the world.
    cell: f64 = 0.0, Metres, 0.0..=1e6, soft 0.0..=100.0, when placement = "centre" | "corner";
    /// Placement in the world.
    placement: Placement = Placement::Centre, One, ..;
    /// Values beyond the raster.
    beyond: Beyond = Beyond::Extend, One, .., when placement = "centre" | "corner";
    /// Values of cells without data.
    voids: Voids = Voids::Fill, One, ..;
    /// Value for `beyond: level` and `voids: level`.
    level: f64 = 0.0, Metres, -1e6..=1e6, soft -500.0..=5000.0;
}

outputs! {
    /// Contents of the file: a height, unless `quantity` is `mask` or `scalar`.
    value: Chosen(quantity::port_type);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Import",
    category: "import",
    summary: "Imports a raster file as terrain, placed and resampled into the world.",
    doc: include_str!("import.md"),
    sources: &[
        "E. Catmull, R. Rom, 1974, A class of local interpolating splines",
        "S. J. Gortler, R. Grzeszczuk, R. Szeliski, M. F. Cohen, 1996, The Lumigraph",
        "J. P. Snyder, 1987, Map Projections: A Working Manual, USGS Professional Paper 1395",
    ],
    outputs: Given::PORTS,
    params: Params::specs,
    scratch: Scratch::Bytes(scratch),
    cpu: run,
    example: "file: \"glencoe_128.tif\", placement: stretch",
    ..Node::DEFAULT
};

/// Memory that the kernel needs in addition to its inputs and outputs.
fn scratch(sizing: &Sizing<'_>) -> u64 {
    let params = Params::read(sizing.params);
    // a file that cannot be read fails when it is imported
    let Ok(reader) = Reader::open(&sizing.folder.join(&params.file.0)) else { return 0 };
    let Head { columns, rows, .. } = reader.head;
    let narrowed = |rows: usize| 4 * (rows * sizing.window.nx()) as u64;
    let streamed = reader.bytes() + narrowed(reader.block_rows());
    if params.voids == Voids::Level || !reader.may_have_voids() {
        return streamed;
    }
    // the whole raster with the pyramid that fills its voids
    let cells = 4 * (columns * rows) as u64;
    streamed.max(cells + reader.bytes().max(2 * cells / 3).max(narrowed(rows)))
}

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    let path = job.file("file")?;
    job.advance(0.0)?;
    let reader = Reader::open(&path)?;
    let axes = axes(&params, &reader.head, job.window()).map_err(|problem| problem.of(&path))?;
    let mut out = match streamed(job, &params, reader, axes) {
        Ok(Some(out)) => out,
        Ok(None) => filled(job, &params, &path, axes)?,
        Err(problem) => {
            job.check()?;
            return Err(problem.of(&path).into());
        }
    };
    if params.quantity == Quantity::Mask {
        out.iter_mut().for_each(|v| *v = v.clamp(0.0, 1.0));
    }
    job.advance(1.0)?;
    Ok(Given { value: Some(Field::new(job.window(), out)) }.into())
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
fn streamed(
    job: &Job<'_>,
    params: &Params,
    reader: Reader<'_>,
    axes: [GridAxis; 2],
) -> Result<Option<Vec<f32>>, Problem> {
    let Window { origin, cells, .. } = job.window();
    let (coding, rows, columns) = (reader.head.coding, reader.head.rows, reader.head.columns);
    let (range, level) = (range(params), params.level as f32);
    let mut resampler = Resampler::new(axes, origin, cells, beyond(params))?;
    let mut has_voids = false;
    let read = reader.read(&|| job.check().is_ok(), &mut |first, samples| {
        if let Some(coding) = coding {
            coding.decode(range, samples);
        }
        match params.voids {
            Voids::Fill => has_voids = resampler.needed(first, samples).flatten().any(|v| v.is_nan()),
            Voids::Level => samples.iter_mut().filter(|v| v.is_nan()).for_each(|v| *v = level),
        }
        if has_voids {
            return Err(Problem::Stopped);
        }
        let failed = |error| match error {
            NodeError::OutOfMemory(refused) => Problem::OutOfMemory(refused),
            _ => Problem::Stopped,
        };
        resampler.take(first, samples, &|| job.check()).map_err(failed)?;
        let done = (first + samples.len() / columns) as f32 / rows as f32;
        job.advance(0.9 * done).map_err(failed)
    });
    match read {
        Err(_) if has_voids => Ok(None),
        read => read.map(|()| Some(resampler.into_samples())),
    }
}

/// Reads a whole file, fills its voids and resamples it.
fn filled(job: &Job<'_>, params: &Params, path: &Path, axes: [GridAxis; 2]) -> Result<Vec<f32>, NodeError> {
    let raster = raster::read_while(path, &|| job.check().is_ok());
    job.check()?;
    let Raster { head: Head { columns, rows, .. }, mut samples } = raster?.decoded(range(params));
    let check = || job.check();
    fill_voids(columns, rows, &mut samples, &check)?;
    let Window { origin, cells, .. } = job.window();
    resample(&samples, axes, origin, cells, beyond(params), &check)
}

/// Returns the mapping of the world's cells to those of the raster.
fn axes(params: &Params, head: &Head, window: Window) -> Result<[GridAxis; 2], Problem> {
    let source = [head.columns, head.rows];
    let size = if params.cell > 0.0 { Some([params.cell; 2]) } else { head.cell_m()? };
    let axis = |axis: usize| {
        let (source, target) = (source[axis], f64::from(window.world.cells[axis]));
        let (step, offset) = match (params.placement, size) {
            (Placement::Stretch, _) | (_, None) => (source as f64 / target, 0.0),
            (Placement::Corner, Some(size)) => (window.cell_m() / size[axis], 0.0),
            (Placement::Centre, Some(size)) => {
                let step = window.cell_m() / size[axis];
                (step, 0.5 * (source as f64 - target * step))
            }
        };
        GridAxis { source, offset, step }.snapped()
    };
    Ok([axis(0), axis(1)])
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use orograph_graph::{Cancel, ParamValue, Warnings, World};

    use super::*;
    use crate::testing::world;

    fn folder() -> PathBuf {
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data")).to_owned()
    }

    fn params(file: &str, changes: &[(&'static str, ParamValue)]) -> ParamValues {
        let mut params = ParamValues::defaults(&Params::specs());
        params.set("file", ParamValue::File(file.to_owned()));
        for (name, value) in changes {
            params.set(name, value.clone());
        }
        params
    }

    fn outputs(params: &ParamValues, window: Window, cancel: Cancel) -> Result<Field, NodeError> {
        let progress = |fraction: f32| assert!((0.0..=1.0).contains(&fraction));
        let job = Job {
            node: &NODE,
            params,
            inputs: Vec::new(),
            window,
            wanted: orograph_graph::Wanted::ALL,
            folder: folder(),
            cancel,
            progress: &progress,
            level: orograph_graph::LevelJob::default(),
            warnings: Warnings::default(),
            glimpses: None,
        };
        (NODE.cpu)(&job).map(|mut outputs| outputs.take("value").unwrap().as_field().unwrap().clone())
    }

    fn import(file: &str, world: World, changes: &[(&'static str, ParamValue)]) -> Field {
        outputs(&params(file, changes), Window::whole(world), Cancel::default()).unwrap()
    }

    fn choice(name: &'static str) -> ParamValue {
        ParamValue::Choice(name)
    }

    fn mean(samples: &[f32]) -> f64 {
        samples.iter().map(|v| f64::from(*v)).sum::<f64>() / samples.len() as f64
    }

    #[test]
    fn cells_of_equal_size_are_copied() {
        let source = raster::read(&folder().join("glencoe_128.tif")).unwrap();
        let same = import("glencoe_128.tif", world(128, 128, 50.0), &[]);
        assert_eq!(same.samples(), source.samples);
        // an odd number of cells centred in an even one; beyond it the values of the edge, or a level
        let large = import("glencoe_128.tif", world(131, 131, 50.0), &[]);
        let level = [("beyond", choice("level")), ("level", ParamValue::Float(-7.0))];
        let framed = import("glencoe_128.tif", world(131, 131, 50.0), &level);
        let first = (0..131).find(|i| framed.samples()[65 * 131 + i] != -7.0).unwrap();
        for (j, row) in source.samples.chunks_exact(128).enumerate() {
            let at = (j + first) * 131 + first;
            assert_eq!(&large.samples()[at..at + 128], row);
            assert_eq!(&framed.samples()[at..at + 128], row);
        }
        assert_eq!(large.samples()[0], source.samples[0]);
        assert_eq!(framed.samples()[0], -7.0);
        assert_eq!(framed.samples().iter().filter(|v| **v == -7.0).count(), 131 * 131 - 128 * 128);
    }

    #[test]
    fn larger_cells_keep_the_volume() {
        let source = mean(&raster::read(&folder().join("glencoe_128.tif")).unwrap().samples);
        for cells in [64, 37, 5, 1] {
            let coarse = import("glencoe_128.tif", world(cells, cells, 6400.0 / f64::from(cells)), &[]);
            // rounding to single precision of means below 1400 m
            assert!((mean(coarse.samples()) - source).abs() < 1e-3, "{cells}");
        }
        // at true scale, a world of half the size shows the middle half, with either origin
        let corner = import("glencoe_128.tif", world(32, 32, 100.0), &[("placement", choice("corner"))]);
        let stretched = import("glencoe_128.tif", world(32, 32, 100.0), &[("placement", choice("stretch"))]);
        assert_ne!(corner, stretched);
        let whole = import("glencoe_128.tif", world(64, 64, 100.0), &[]);
        assert_eq!(corner.samples()[..32], whole.samples()[..32]);
        let centred = import("glencoe_128.tif", world(32, 32, 100.0), &[]);
        assert_eq!(centred.samples()[..32], whole.samples()[16 * 64 + 16..16 * 64 + 48]);
    }

    #[test]
    fn degrees_become_metres() {
        // 60 x 40 cells of 3 arc-seconds near 40 degrees north: 70.9 m by 92.5 m each, so 4257 m by 3701 m.
        let world = World { size: [4257.0, 3701.0], cells: [4257, 3701], ..World::default() };
        let level = [("beyond", choice("level")), ("level", ParamValue::Float(-1.0))];
        let field = import("frontrange_3arcsec.asc", world, &level);
        let outside = field.samples().iter().filter(|v| **v == -1.0).count();
        // the raster fills the world to within a few metres
        assert!(outside < 8 * (4257 + 3701), "{outside} m² are outside");
        let source = raster::read(&folder().join("frontrange_3arcsec.asc")).unwrap();
        let (row, column) = (30, 50);
        let (x, y) = ((column as f64 + 0.5) * 70.95, (row as f64 + 0.5) * 92.53);
        let found = field.samples()[y as usize * 4257 + x as usize];
        // within a metre of a cell's centre, on a slope below one
        assert!((found - source.samples[row * 60 + column]).abs() < 1.5);
    }

    #[test]
    fn voids_are_filled_or_levelled() {
        let file = "mandakini_basin_f32_nodata.tif";
        let source = raster::read(&folder().join(file)).unwrap();
        let (lo, hi) = source
            .samples
            .iter()
            .filter(|v| !v.is_nan())
            .fold((f32::MAX, f32::MIN), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
        let stretch = ("placement", choice("stretch"));
        let filled = import(file, world(100, 100, 10.0), std::slice::from_ref(&stretch));
        let levelled = import(file, world(100, 100, 10.0), &[stretch, ("voids", choice("level"))]);
        for ((before, filled), levelled) in source.samples.iter().zip(filled.samples()).zip(levelled.samples()) {
            if before.is_nan() {
                assert!((lo..=hi).contains(filled) && *levelled == 0.0);
            } else {
                assert!(filled == before && levelled == before);
            }
        }
    }

    #[test]
    fn codes_span_a_mask_and_a_file_without_cells_is_stretched() {
        let file = "glencoe_48x64_u16.png";
        let field = import(file, world(48, 64, 3.0), &[]);
        // the range from its sidecar
        assert_eq!(field.range(0), Some((11.7, 709.8)));
        let alone = tempfile::tempdir().unwrap();
        let copy = alone.path().join("alone.png");
        std::fs::copy(folder().join(file), &copy).unwrap();
        let copy = copy.to_str().unwrap();
        let mask = import(copy, world(48, 64, 3.0), &[("quantity", choice("mask"))]);
        assert_eq!(mask.range(0), Some((0.0, 1.0)));
        let range = ("range", ParamValue::Point([-50.0, 250.0]));
        assert_eq!(import(copy, world(48, 64, 3.0), &[range]).range(0), Some((-50.0, 250.0)));
    }

    #[test]
    fn a_window_equals_its_part_of_the_whole() {
        for (file, cell_m) in [("glencoe_128.tif", 50.0), ("glencoe_128.tif", 17.3), ("frontrange_3arcsec.asc", 210.0)]
        {
            let params = params(file, &[("beyond", choice("level"))]);
            let whole = Window::whole(world(60, 50, cell_m));
            let part = Window { origin: [13, 9], cells: [30, 22], ..whole };
            let all = outputs(&params, whole, Cancel::default()).unwrap();
            assert_eq!(outputs(&params, part, Cancel::default()).unwrap(), all.crop(&part), "{file}");
        }
    }

    /// Rows that are resampled as they are read give the bits of the whole raster.
    #[test]
    fn every_file_gives_the_bits_of_the_whole_raster() {
        let files = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
        let files: Vec<_> = files.filter(|path| Reader::open(path).is_ok()).collect();
        assert!(files.len() >= 20);
        for path in files {
            for (cells, cell_m) in [(5, 900.0), (97, 31.7)] {
                let world = world(cells, cells, cell_m);
                let name = path.to_str().unwrap();
                let found = import(name, world, &[("placement", choice("stretch"))]);
                let Raster { head, mut samples } = raster::read(&path).unwrap().decoded([0.0, 1000.0]);
                fill_voids(head.columns, head.rows, &mut samples, &|| Ok(())).unwrap();
                let axes = [head.columns, head.rows]
                    .map(|source| GridAxis { source, offset: 0.0, step: source as f64 / f64::from(cells) }.snapped());
                let whole = resample(&samples, axes, [0, 0], [cells; 2], None, &|| Ok(())).unwrap();
                assert!(found.samples() == whole, "{name} on {cells} cells");
            }
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_a_remedy() {
        let fails = |file: &str, cancel: Cancel| {
            outputs(&params(file, &[]), Window::whole(world(4, 4, 50.0)), cancel).unwrap_err()
        };
        for (file, words) in
            [("", "no file"), ("none.tif", "no such file"), (".", "folder"), ("README.md", "format is not known")]
        {
            let NodeError::Failed { message, hint } = fails(file, Cancel::default()) else { panic!("cancelled") };
            assert!(message.contains(words) && hint.is_some(), "{message}");
        }
        let cancel = Cancel::default();
        cancel.cancel();
        assert_eq!(fails("glencoe_128.tif", cancel), NodeError::Cancelled);
    }
}
