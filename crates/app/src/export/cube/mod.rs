//! All terrains of a sweep in one Zarr store: an array for each output with a labelled dimension for each swept
//! parameter, for y and for x, and statistics of each cell over all terrains.
//!
//! The store is a folder, `NAME.zarr`. The metadata is written first. It contains a hash of everything that the
//! terrains depend on, so that a store is only continued by the sweep that began it. A chunk is a band of rows of one
//! terrain in a file of its own, as 32-bit numbers without compression, and appears whole ([`Part`]). A terrain all of
//! whose chunks exist is complete, and is not built again: after the program was killed, or the disk was full, the same
//! command goes on where it ended, and the store has the same bytes in the end.

mod axes;
mod checked;
mod metadata;
mod statistics;

use std::{
    collections::BTreeMap,
    fs,
    io::{self, BufWriter, Write as _},
    path::{Path, PathBuf},
};

use orograph_graph::{
    Cancel, Field, OutputDecl, PortType, Window,
    files::{self, Access, Part},
};
use serde_json::{Map, Value, json};

pub use self::{
    axes::Axis,
    checked::{CHECKED, Checked},
};
use self::{
    metadata::{Shape, centres, group, of_output, system},
    statistics::{Wanted, of_chunk},
};
use crate::report::failure::{Failure, reason, remedy};

/// The largest number of bytes of a chunk.
const CHUNK: usize = 64 << 20;

/// Arrays by name.
type Shapes = BTreeMap<String, Shape>;
/// The numbers of coordinates by name.
type Coordinates = BTreeMap<String, Vec<f64>>;

/// What a cube holds.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What is swept, the last one varying fastest. Empty for a single terrain.
    pub axes: Vec<Axis>,
    /// The outputs; those that are no numbers are left out.
    pub outputs: Vec<OutputDecl>,
    /// The part of the world.
    pub window: Window,
    /// Attributes of the whole, among them a hash of everything that the terrains depend on.
    pub attributes: Map<String, Value>,
    /// Fractions of the terrains for quantiles, from 0 to 1.
    pub quantiles: Vec<f64>,
    /// Outputs, and the values whose probability of being exceeded is stored.
    pub thresholds: Vec<(String, f64)>,
}

/// A store that is being written.
#[derive(Debug)]
pub struct Cube {
    folder: PathBuf,
    plan: Plan,
    /// The arrays that the terrains fill.
    arrays: Vec<Array>,
    /// Rows of a chunk.
    chunk_rows: usize,
}

/// An array with one plane of an output.
#[derive(Debug)]
struct Array {
    name: String,
    /// Index of the output.
    output: usize,
    plane: usize,
    thresholds: Vec<f64>,
}

/// Returns true if a cube holds outputs of a type.
#[must_use]
pub const fn holds(ty: PortType) -> bool {
    matches!(ty, PortType::Height | PortType::Mask | PortType::Scalar(_) | PortType::AnyScalar | PortType::Vector(_))
}

impl Cube {
    /// Begins a store, or continues one that the same sweep began.
    ///
    /// # Errors
    /// When names contradict each other, there is a store of something else, or the folder cannot be written to.
    pub fn open(folder: &Path, plan: Plan) -> Result<Self, Failure> {
        let (nx, ny) = (plan.window.nx(), plan.window.ny());
        let chunks = (size_of::<f32>() * nx * ny).div_ceil(CHUNK);
        let mut arrays = Vec::new();
        for (output, decl) in plan.outputs.iter().enumerate().filter(|(_, decl)| holds(decl.ty)) {
            let planes: &[&str] = if matches!(decl.ty, PortType::Vector(_)) { &["_x", "_y"] } else { &[""] };
            for (plane, end) in planes.iter().enumerate() {
                let above = plan.thresholds.iter().filter(|(name, _)| *name == decl.name);
                let thresholds = above.map(|(_, value)| *value).collect();
                arrays.push(Array { name: format!("{}{end}", decl.name), output, plane, thresholds });
            }
        }
        let cube = Self { folder: folder.to_owned(), plan, arrays, chunk_rows: ny.div_ceil(chunks.max(1)) };
        cube.begin()?;
        Ok(cube)
    }

    /// The folder of the store.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writes the metadata and the coordinates, unless they are there.
    fn begin(&self) -> Result<(), Failure> {
        let (shapes, coordinates) = self.shapes()?;
        let root = text(&group(&self.plan.attributes, &shapes));
        let path = self.folder.join("zarr.json");
        match fs::read(&path) {
            Ok(found) if found == root => return Ok(()),
            Ok(_) => {
                let what = format!("`{}` is there already, and of another graph or sweep", self.folder.display());
                return Err(Failure::wrong(what).hint("remove it, or choose another folder with `-o`"));
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(self.unwritable(&path, &error)),
        }
        for (name, shape) in &shapes {
            let folder = self.folder.join(name);
            files::create_folders(&folder, Access::Usual).map_err(|error| self.unwritable(&folder, &error))?;
            self.write(&folder.join("zarr.json"), &text(&shape.json()))?;
        }
        for (name, numbers) in coordinates {
            let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
            self.write(&self.folder.join(name).join("c.0"), &bytes)?;
        }
        if shapes.contains_key(metadata::SYSTEM) {
            self.write(&self.folder.join(metadata::SYSTEM).join("c"), &[0; 4])?;
        }
        // the last file of those: without it, all are written again
        self.write(&path, &root)
    }

    /// All arrays by name, and the numbers of the coordinates.
    fn shapes(&self) -> Result<(Shapes, Coordinates), Failure> {
        let Plan { axes, window, .. } = &self.plan;
        let (mut shapes, mut numbers) = (BTreeMap::new(), BTreeMap::new());
        let mut add = |name: String, shape: Shape, of: Option<Vec<f64>>| {
            numbers.extend(of.map(|of| (name.clone(), of)));
            match shapes.insert(name.clone(), shape) {
                None => Ok(()),
                Some(_) => Err(Failure::wrong(format!("two arrays of the cube would be named `{name}`"))
                    .hint("rename the output or the parameter")),
            }
        };
        let mut swept = Vec::new();
        for axis in axes {
            let (of, attributes) = axis.coordinates();
            let name = axis.dimension();
            swept.push((name.clone(), of.len()));
            add(name.clone(), Shape::coordinate(&name, of.len(), attributes), Some(of))?;
        }
        let mut plane = Vec::new();
        for (name, of, attributes) in centres(window) {
            plane.push((name.to_owned(), of.len()));
            add(name.to_owned(), Shape::coordinate(name, of.len(), attributes), Some(of))?;
        }
        if let Some(system) = system(window) {
            add(metadata::SYSTEM.to_owned(), system, None)?;
        }
        let raster = |first: Vec<(String, usize)>, attributes: Map<String, Value>| Shape {
            chunks: first.iter().map(|_| 1).chain([self.chunk_rows, window.nx()]).collect(),
            dimensions: first.into_iter().chain(plane.clone()).collect(),
            numbers: "float32",
            attributes,
        };
        for array in &self.arrays {
            let decl = &self.plan.outputs[array.output];
            let attributes = of_output(&array.name, decl.ty, window);
            add(array.name.clone(), raster(swept.clone(), attributes.clone()), None)?;
            if axes.is_empty() {
                continue;
            }
            let with = |long_name: String, units: Option<&str>| {
                let mut all = attributes.clone();
                all.insert("long_name".to_owned(), json!(long_name));
                if let Some(units) = units {
                    all.remove("standard_name");
                    all.insert("units".to_owned(), json!(units));
                }
                all
            };
            let mean = with(format!("mean of {} over all terrains", array.name), None);
            add(format!("{}_mean", array.name), raster(Vec::new(), mean), None)?;
            let count = self.plan.quantiles.len();
            if count > 0 {
                let of = with(format!("quantiles of {} over all terrains", array.name), None);
                add(format!("{}_quantile", array.name), raster(vec![("quantile".to_owned(), count)], of), None)?;
            }
            if !array.thresholds.is_empty() {
                let dimension = format!("{}_threshold", array.name);
                let count = array.thresholds.len();
                let thresholds = with(format!("thresholds of {}", array.name), None);
                let coordinate = Shape::coordinate(&dimension, count, thresholds);
                add(dimension.clone(), coordinate, Some(array.thresholds.clone()))?;
                let of = with(format!("fraction of the terrains with {} above the threshold", array.name), Some("1"));
                add(format!("{}_above", array.name), raster(vec![(dimension, count)], of), None)?;
            }
        }
        if !axes.is_empty() && !self.plan.quantiles.is_empty() {
            let mut attributes = Map::new();
            attributes.insert("long_name".to_owned(), json!("fraction of the terrains that are lower"));
            let coordinate = Shape::coordinate("quantile", self.plan.quantiles.len(), attributes);
            add("quantile".to_owned(), coordinate, Some(self.plan.quantiles.clone()))?;
        }
        Ok((shapes, numbers))
    }

    /// Returns true if a terrain is complete.
    #[must_use]
    pub fn is_complete(&self, member: usize) -> bool {
        self.arrays.iter().all(|array| (0..self.chunks()).all(|chunk| self.chunk(array, member, chunk).is_file()))
    }

    /// Bands of rows of a terrain.
    fn chunks(&self) -> usize {
        self.plan.window.ny().div_ceil(self.chunk_rows)
    }

    fn chunk(&self, array: &Array, member: usize, chunk: usize) -> PathBuf {
        let (mut rest, mut places) = (member, Vec::new());
        for axis in self.plan.axes.iter().rev() {
            places.push(rest % axis.values.len());
            rest /= axis.values.len();
        }
        let places: String = places.iter().rev().map(|place| format!(".{place}")).collect();
        self.folder.join(&array.name).join(format!("c{places}.{chunk}.0"))
    }

    /// Begins a terrain.
    #[must_use]
    pub fn member(&self, member: usize) -> Member<'_> {
        let bands = self.arrays.iter().map(|_| Band { rows: 0, part: None }).collect();
        Member { cube: self, member, bands }
    }

    /// Writes the statistics of each cell, once all terrains are complete.
    ///
    /// # Errors
    /// When a file cannot be read or written, or the program is stopped.
    pub fn finish(&self, cancel: &Cancel) -> Result<(), Failure> {
        let members: usize = self.plan.axes.iter().map(|axis| axis.values.len()).product();
        if self.plan.axes.is_empty() {
            return Ok(());
        }
        for array in &self.arrays {
            let wanted = Wanted { quantiles: self.plan.quantiles.clone(), thresholds: array.thresholds.clone() };
            for chunk in 0..self.chunks() {
                self.chunk_statistics(array, chunk, members, &wanted, cancel)?;
            }
        }
        Ok(())
    }

    fn chunk_statistics(
        &self,
        array: &Array,
        chunk: usize,
        members: usize,
        wanted: &Wanted,
        cancel: &Cancel,
    ) -> Result<(), Failure> {
        let of = |end: &str, place: String| {
            self.folder.join(format!("{}_{end}", array.name)).join(format!("c.{place}{chunk}.0"))
        };
        let mut targets = vec![of("mean", String::new())];
        targets.extend((0..wanted.quantiles.len()).map(|k| of("quantile", format!("{k}."))));
        targets.extend((0..wanted.thresholds.len()).map(|k| of("above", format!("{k}."))));
        let mut parts = Vec::new();
        for target in &targets {
            let part = Part::begin(target, Access::Usual).map_err(|error| self.unwritable(target, &error))?;
            parts.push(BufWriter::new(part));
        }
        let paths: Vec<PathBuf> = (0..members).map(|member| self.chunk(array, member, chunk)).collect();
        let unreadable = |path: &Path, error: io::Error| {
            Failure::unable(format!("cannot read `{}`: {}", path.display(), reason(&error)))
                .hint("run the same command again")
        };
        let cells = self.chunk_rows * self.plan.window.nx();
        of_chunk(&paths, cells, wanted, &unreadable, &mut |statistic, numbers| {
            if cancel.is_cancelled() {
                return Err(stopped());
            }
            let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
            parts[statistic].write_all(&bytes).map_err(|error| self.unwritable(&targets[statistic], &error))
        })?;
        for (part, target) in parts.into_iter().zip(&targets) {
            let persisted = part.into_inner().map_err(io::IntoInnerError::into_error).and_then(Part::persist);
            persisted.map_err(|error| self.unwritable(target, &error))?;
        }
        Ok(())
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> Result<(), Failure> {
        let written = Part::begin(path, Access::Usual).and_then(|mut part| {
            part.write_all(bytes)?;
            part.persist()
        });
        written.map(drop).map_err(|error| self.unwritable(path, &error))
    }

    fn unwritable(&self, path: &Path, error: &io::Error) -> Failure {
        Failure::unable(format!("cannot write `{}`: {}", path.display(), reason(error)))
            .hint(format!("{}, and run the same command again: it continues", remedy(error)))
    }
}

/// The failure of a command that was stopped with a store that can be continued.
#[must_use]
pub fn stopped() -> Failure {
    let failure = Failure::stopped();
    Failure { message: "stopped; the same command continues".to_owned(), ..failure }
}

fn text(json: &Value) -> Vec<u8> {
    format!("{json:#}\n").into_bytes()
}

/// A terrain that is being written. Dropped before all rows were there, its last chunks are missing.
#[derive(Debug)]
pub struct Member<'a> {
    cube: &'a Cube,
    member: usize,
    /// The rows of each array so far.
    bands: Vec<Band>,
}

/// Rows of an array of a terrain.
#[derive(Debug)]
struct Band {
    /// Rows that were written.
    rows: usize,
    /// The chunk that is not yet complete.
    part: Option<BufWriter<Part>>,
}

impl Member<'_> {
    /// Writes the next rows of an output.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn rows(&mut self, output: usize, field: &Field) -> Result<(), Failure> {
        let Self { cube, member, bands } = self;
        let (nx, ny) = (cube.plan.window.nx(), cube.plan.window.ny());
        for (array, band) in cube.arrays.iter().zip(bands).filter(|(array, _)| array.output == output) {
            for row in field.plane(array.plane).chunks_exact(nx) {
                let path = cube.chunk(array, *member, band.rows / cube.chunk_rows);
                band.row(row, &path, cube.chunk_rows, ny).map_err(|error| cube.unwritable(&path, &error))?;
            }
        }
        Ok(())
    }
}

impl Band {
    fn row(&mut self, row: &[f32], path: &Path, chunk_rows: usize, ny: usize) -> io::Result<()> {
        let mut part = match self.part.take() {
            Some(part) => part,
            None => BufWriter::with_capacity(1 << 18, Part::begin(path, Access::Usual)?),
        };
        row.iter().try_for_each(|number| part.write_all(&number.to_le_bytes()))?;
        self.rows += 1;
        if !self.rows.is_multiple_of(chunk_rows) && self.rows < ny {
            self.part = Some(part);
            return Ok(());
        }
        // the last chunk is as long as the others
        for _ in 0..(self.rows.next_multiple_of(chunk_rows) - self.rows) * row.len() {
            part.write_all(&f32::NAN.to_le_bytes())?;
        }
        part.into_inner().map_err(io::IntoInnerError::into_error)?.persist().map(drop)
    }
}
