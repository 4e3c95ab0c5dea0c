//! `orograph new`: a graph of a real place, from an elevation model.

use std::path::{Path, PathBuf};

use orograph_graph::{Boundary, Document, Edge, GeoPlace, Unit, World, format_source};
use orograph_nodes::raster::{self, Cell, Head, Problem, Reader};

use crate::{
    files::heightfile::Scale,
    report::{
        failure::{Exit, Failure, reason, remedy},
        problems,
        terminal::{self, Page},
    },
    stop,
};

/// Writes a graph that imports an elevation model
///
/// The world gets the size, the cells and the place of the elevation model, and all outputs are written with that
/// place. If the file is in degrees, in Web Mercator or in feet, the place is in the zone of UTM that fits. The graph
/// has one node, `Import`, and writes its height.
///
/// Several elevation models that lie side by side on one grid, such as SRTM tiles, are joined first, into a GeoTIFF
/// beside the graph.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Elevation model: GeoTIFF, ESRI ASCII, SRTM (.hgt), or PNG, OpenEXR, .r16 and .r32 with a JSON file beside them
    /// or with `--cell` and `--range`
    #[arg(value_name = "HEIGHT", required = true)]
    files: Vec<PathBuf>,
    /// Graph file to write, which must not exist
    #[arg(short, long, value_name = "GRAPH.ron", alias = "output")]
    out: PathBuf,
    #[command(flatten)]
    scale: Scale,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        let wrong = |what: String, hint: String| Err(Failure::wrong(what).hint(hint));
        if self.out.symlink_metadata().is_ok() {
            let what = format!("there is a file `{}` already", self.out.display());
            return wrong(what, "name another one with `-o`".to_owned());
        }
        let file = self.file()?;
        let written = self.write(&file);
        if written.is_err() && self.files.len() > 1 {
            // it would be in the way of the next try
            let _ = std::fs::remove_file(&file);
        }
        written
    }

    /// Writes the graph of an elevation model.
    fn write(&self, file: &Path) -> Result<(), Failure> {
        let wrong = |what: String, hint: String| Err(Failure::wrong(what).hint(hint));
        let mut head = match Reader::open(file) {
            Ok(reader) => reader.head,
            Err(error) => return wrong(error.to_string(), error.remedy().to_owned()),
        };
        if let Some(cell_m) = self.scale.cell {
            head = Head { cell: Some(Cell::Metres([cell_m; 2])), origin: None, epsg: None, ..head };
            head.notes.retain(|note| !raster::is_about_units(note));
        }
        let has_codes = head.coding.is_some_and(|coding| coding.range.is_none());
        if has_codes && self.scale.range.is_none() {
            let what = format!("`{}` has integer codes without a height range", file.display());
            return wrong(what, "add the range: `--range 0,2500`".to_owned());
        }
        if !has_codes && self.scale.range.is_some() {
            let what = format!("`--range` has no effect: `{}` states its heights", file.display());
            return wrong(what, "leave it out".to_owned());
        }
        let extent = match raster::extent(&head) {
            Ok(extent) => extent,
            Err(Problem::NoCellSize) => {
                let what = format!("`{}` does not state its cell size", file.display());
                return wrong(what, "add it in metres: `--cell 30`".to_owned());
            }
            Err(problem) => return wrong(format!("`{}`: {problem}", file.display()), problem.remedy().to_owned()),
        };
        for remark in head.notes.iter().chain(&extent.remarks) {
            terminal::warn(&format!("`{}`: {remark}", file.display()));
        }
        if let Some(quantity) = raster::other_quantity(file) {
            terminal::warn(&format!(
                "`{}`: the file beside it says that it holds {quantity}; the graph reads its values as heights",
                file.display()
            ));
        }
        // terrain continues beyond the raster
        let world = World { boundary: Boundary::all(Edge::Inland), ..extent.world() };
        if let Err(error) = world.check() {
            return wrong(format!("`{}`: {error}", file.display()), "cut out a part of it first".to_owned());
        }
        let document = Document::parse_at(self.graph(file, &world)?, &self.out, &orograph_nodes::registry());
        if document.has_errors() {
            terminal::remark(&problems::report_all(&document, &self.out, Page::stderr()));
            return Err(Failure::silent(Exit::Wrong));
        }
        document.save(&self.out).map_err(|error| {
            Failure::unable(format!("cannot write `{}`: {}", self.out.display(), reason(&error))).hint(remedy(&error))
        })?;
        let place = match world.place {
            Some(place) => format!("in EPSG:{}", place.epsg),
            None => "without a place on Earth".to_owned(),
        };
        let [nx, ny] = world.cells;
        let name = Page::stdout().name(&self.out.display().to_string());
        let cell = Unit::Metres.display(world.cell_m());
        terminal::print(&format!("wrote {name}: {nx} x {ny} cells of {cell}, {place}\n"))
    }

    /// The elevation model: the only one, or a new file of all of them.
    fn file(&self) -> Result<PathBuf, Failure> {
        if let [file] = &self.files[..] {
            return Ok(file.clone());
        }
        if let Some(option) = self.scale.given() {
            return Err(Failure::wrong(format!("`{option}` is for a single elevation model")));
        }
        let joined = self.out.with_extension("tif");
        if joined == self.out {
            let what = format!("`{}` would be both the graph and the joined model", joined.display());
            return Err(Failure::wrong(what).hint("name the graph with `.ron` at the end"));
        }
        if joined.symlink_metadata().is_ok() {
            let what = format!("there is a file `{}` already, where the joined model would be", joined.display());
            return Err(Failure::wrong(what).hint("name another graph with `-o`"));
        }
        let cancel = stop::on_interrupt()?;
        let remarks = raster::join(&self.files, &joined, &|| !cancel.is_cancelled()).map_err(|error| {
            let failed = match error.problem {
                Problem::Stopped => return Failure::stopped(),
                Problem::Unwritable(_) | Problem::OutOfMemory(_) => Failure::unable,
                _ => Failure::wrong,
            };
            failed(error.to_string()).hint(error.remedy())
        })?;
        for remark in remarks {
            terminal::warn(&remark);
        }
        Ok(joined)
    }

    /// The text of the graph.
    fn graph(&self, file: &Path, world: &World) -> Result<String, Failure> {
        let World { size: [width, height], cells: [nx, ny], .. } = world;
        let (place, placement) = match world.place {
            Some(GeoPlace { epsg, corner_m: [x, y] }) => {
                (format!(", place: (epsg: {epsg}, corner: ({x}, {y}))"), ", placement: place")
            }
            None => (String::new(), ""),
        };
        let Scale { cell, range } = self.scale;
        let cell = cell.map_or_else(String::new, |cell_m| format!(", cell: {cell_m}"));
        let range = range.map_or_else(String::new, |[low, high]| format!(", range: ({low}, {high})"));
        let version = orograph_nodes::import::import::NODE.version;
        let name = serde_json::json!(beside(file, &self.out));
        let text = format!(
            "// Made by `orograph new` from an elevation model.\n(format: 1, world: (size: ({width}, {height}), cells: \
             ({nx}, {ny}), boundary: inland{place}), nodes: {{ \"land\": Import(version: {version}, file: {name}{placement}{cell}{range}) }}, outputs: \
             {{ \"height\": \"land\" }})\n"
        );
        let unsound = || Failure::wrong(format!("the name `{}` cannot be written into a graph", file.display()));
        format_source(&text).map_err(|_| unsound().hint("rename the elevation model"))
    }
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
