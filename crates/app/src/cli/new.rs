//! `orograph new`: a graph of a real place, from an elevation model.

use std::path::{Path, PathBuf};

use orograph_graph::{Boundary, Document, Edge, GeoPlace, Unit, World, format_source};
use orograph_nodes::raster::{Cell, Head, Reader};

use crate::report::{
    failure::{Exit, Failure, reason, remedy},
    problems,
    terminal::{self, Page},
};

/// Writes a graph that imports an elevation model
///
/// The world gets the size, the cells and, if the file is in a projected coordinate system in metres, the place of the
/// elevation model, with which all outputs leave. The graph has one node, `Import`, and writes its height.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Elevation model: GeoTIFF, ESRI ASCII, SRTM (.hgt), or PNG, OpenEXR, .r16 and .r32 with a JSON file beside them
    #[arg(value_name = "HEIGHT")]
    file: PathBuf,
    /// Graph file to write, which must not exist
    #[arg(short, long, value_name = "GRAPH.ron")]
    output: PathBuf,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        let wrong = |what: String, hint: String| Err(Failure::wrong(what).hint(hint));
        let head = match Reader::open(&self.file) {
            Ok(reader) => reader.head,
            Err(error) => return wrong(error.to_string(), error.remedy().to_owned()),
        };
        let size = match head.cell_m() {
            Ok(Some(size)) => size,
            Ok(None) => {
                let what = format!("`{}` does not state its cell size", self.file.display());
                return wrong(what, "write the graph by hand, with `cell` in `Import`".to_owned());
            }
            Err(problem) => return wrong(format!("`{}`: {problem}", self.file.display()), problem.remedy().to_owned()),
        };
        for remark in head.notes.iter().cloned().chain(head.scale_remarks()) {
            let warning = Page::stderr().doubtful("warning:");
            terminal::remark(&format!("{warning} `{}`: {remark}\n", self.file.display()));
        }
        let world = world(&head, size);
        if let Err(error) = world.check() {
            return wrong(format!("`{}`: {error}", self.file.display()), "cut out a part of it first".to_owned());
        }
        if self.output.symlink_metadata().is_ok() {
            let what = format!("there is a file `{}` already", self.output.display());
            return wrong(what, "name another one with `-o`".to_owned());
        }
        let document = Document::parse_at(self.graph(&world)?, &self.output, &orograph_nodes::registry());
        if document.has_errors() {
            terminal::remark(&problems::report_all(&document, &self.output, Page::stderr()));
            return Err(Failure::silent(Exit::Wrong));
        }
        document.save(&self.output).map_err(|error| {
            Failure::unable(format!("cannot write `{}`: {}", self.output.display(), reason(&error)))
                .hint(remedy(&error))
        })?;
        let place = match world.place {
            Some(place) => format!("in EPSG:{}", place.epsg),
            None => "without a place on Earth".to_owned(),
        };
        let [nx, ny] = world.cells;
        let name = Page::stdout().name(&self.output.display().to_string());
        let cell = Unit::Metres.display(world.cell_m());
        terminal::print(&format!("wrote {name}: {nx} x {ny} cells of {cell}, {place}\n"))
    }

    /// The text of the graph.
    fn graph(&self, world: &World) -> Result<String, Failure> {
        let World { size: [width, height], cells: [nx, ny], .. } = world;
        let (place, placement) = match world.place {
            Some(GeoPlace { epsg, corner_m: [x, y] }) => {
                (format!(", place: (epsg: {epsg}, corner: ({x}, {y}))"), ", placement: place")
            }
            None => (String::new(), ""),
        };
        let version = orograph_nodes::import::import::NODE.version;
        let file = serde_json::json!(beside(&self.file, &self.output));
        let text = format!(
            "// Made by `orograph new` from an elevation model.\n(format: 1, world: (size: ({width}, {height}), cells: \
             ({nx}, {ny}), boundary: inland{place}), nodes: {{ \"land\": Import(version: {version}, file: {file}{placement}) }}, outputs: \
             {{ \"height\": \"land\" }})\n"
        );
        let unsound = || Failure::wrong(format!("the name `{}` cannot be written into a graph", self.file.display()));
        format_source(&text).map_err(|_| unsound().hint("rename the elevation model"))
    }
}

/// The world of a raster with cells of that size; terrain continues beyond it.
fn world(head: &Head, [dx, dy]: [f64; 2]) -> World {
    let side = |count: f64| count.round().clamp(1.0, f64::from(u32::MAX)) as u32;
    // Cells that are not square, such as those in degrees, take their north-south size.
    let columns = if (dx - dy).abs() > 1e-6 * dx { head.columns as f64 * dx / dy } else { head.columns as f64 };
    let cells = [side(columns), side(head.rows as f64)];
    let place = match (head.cell, head.origin, head.epsg) {
        (Some(Cell::Metres(_)), Some(corner_m), Some(epsg)) => Some(GeoPlace { epsg, corner_m }),
        _ => None,
    };
    let world = World { boundary: Boundary::all(Edge::Inland), place, ..World::default() };
    let world = World { size: cells.map(|cells| f64::from(cells) * dy), cells, ..world };
    if world.check().is_err() { World { place: None, ..world } } else { world }
}

/// The name of a file as a graph file writes it: relative to the graph's folder if it lies below it.
fn beside(file: &Path, graph: &Path) -> String {
    let folder = |path: &Path| std::path::absolute(path).ok();
    let relative = || {
        let graph = folder(graph)?;
        folder(file)?.strip_prefix(graph.parent()?).ok().map(Path::to_owned)
    };
    let path = relative().or_else(|| folder(file)).unwrap_or_else(|| file.to_owned());
    path.to_string_lossy().replace('\\', "/")
}
