//! Lines from vector files: GeoJSON and SVG.
//!
//! Both are read into positions in metres from the world's north-west corner, east and south.

mod geojson;
mod svg;
#[cfg(test)]
mod tests;

use std::{fmt, io::Read as _, path::Path};

use orograph_graph::{NodeError, Waypoint, World, input};

/// Largest file that is read, in bytes: as a tree of JSON values it takes some twenty times that.
const MOST_BYTES: u64 = 2 << 20;
/// Most points of all lines.
const MOST_POINTS: usize = 2 * Waypoint::MOST;

/// Farthest that a point may lie from the world's corner along an axis.
const FARTHEST_M: f64 = 1e9;

/// A line of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    /// At least two, each different from the one before; of a closed line, the last is not the first.
    pub points: Vec<Waypoint>,
    /// True if the last point is joined to the first.
    pub closed: bool,
}

/// The lines of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// In the order of the file; at least one.
    pub lines: Vec<Polyline>,
    /// Number of elements that are not lines, such as points and texts.
    pub skipped: usize,
}

/// Why a file could not be read as lines, and a remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VectorError {
    message: String,
    remedy: String,
}

impl VectorError {
    fn new(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { message: message.into(), remedy: remedy.into() }
    }

    /// There are more than [`MOST_POINTS`].
    fn long() -> Self {
        let message = format!("its lines have more than {MOST_POINTS} points");
        Self::new(message, "simplify the lines, or cut out the part that is needed")
    }

    fn damaged(what: impl fmt::Display) -> Self {
        Self::new(what.to_string(), "export the file again; it may not have been copied whole")
    }
}

impl fmt::Display for VectorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for VectorError {}

/// Returns true if a file has lines, by its name.
#[must_use]
pub fn is_known(path: &Path) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_lowercase();
    matches!(extension.as_str(), "json" | "geojson" | "svg")
}

/// Reads the lines of a file; the name's extension gives the format.
///
/// # Errors
/// The file and its problem, with a remedy.
pub fn read(path: &Path, world: &World) -> Result<Drawing, NodeError> {
    let of =
        |VectorError { message, remedy }| NodeError::failed_with_hint(format!("{}: {message}", path.display()), remedy);
    let bytes = contents(path).map_err(of)?;
    let extension = path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_lowercase();
    let drawing = match extension.as_str() {
        "json" | "geojson" => geojson::read(&bytes, world),
        "svg" => svg::read(&bytes),
        _ => Err(VectorError::new("it is neither GeoJSON nor SVG", "name a file that ends in .geojson, .json or .svg")),
    };
    let drawing = drawing.map_err(of)?;
    let count: usize = drawing.lines.iter().map(|line| line.points.len()).sum();
    if count > MOST_POINTS {
        return Err(of(VectorError::long()));
    }
    let mut places = drawing.lines.iter().flat_map(|line| &line.points).map(|point| point.at);
    if let Some([x, y]) = places.find(|at| at.iter().any(|part| part.is_nan() || part.abs() > FARTHEST_M)) {
        let message = format!("it has a point {x:e} m east and {y:e} m south of the world's corner");
        return Err(of(VectorError::new(message, "correct the coordinates; they are metres")));
    }
    if drawing.lines.is_empty() {
        return Err(of(VectorError::new("it has no lines", "export lines or polygons, or paths")));
    }
    Ok(drawing)
}

fn contents(path: &Path) -> Result<Vec<u8>, VectorError> {
    let unreadable = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => {
            VectorError::new("there is no such file", "check the name; it is relative to the graph file's folder")
        }
        _ => VectorError::new(error.to_string(), "check that it is a file and may be read"),
    };
    let (file, metadata) = input::open(path).map_err(unreadable)?;
    if metadata.len() > MOST_BYTES {
        let message = format!("it has {} KiB, and at most {} are read", metadata.len() >> 10, MOST_BYTES >> 10);
        return Err(VectorError::new(message, "simplify the lines, or cut out the part that is needed"));
    }
    let mut bytes = Vec::new();
    file.take(MOST_BYTES).read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(bytes)
}

/// The line through points without those that repeat the one before. Returns None when fewer than two are left.
fn polyline(points: impl IntoIterator<Item = Waypoint>, closed: bool) -> Option<Polyline> {
    let mut points: Vec<Waypoint> = points.into_iter().collect();
    points.dedup_by(|later, earlier| later.at == earlier.at);
    if closed && points.len() > 2 && points.first().map(|point| point.at) == points.last().map(|point| point.at) {
        points.pop();
    }
    (points.len() > 1).then_some(Polyline { points, closed })
}
