//! What to build: a graph file, with the changes of the command line.

mod given;
mod part;

use std::{
    collections::BTreeSet,
    num::NonZero,
    path::{Path, PathBuf},
    str::FromStr,
    sync::Arc,
    thread::available_parallelism,
};

use orograph_graph::{
    Document, Edit, Graph, OutputDecl, Place, Registry, Unit, Window, World, WorldError, closest, files,
};

use orograph_nodes::raster::Projection;

pub use given::Array;
pub use part::Part;

use super::{
    backend::BackendName,
    storage::Storage,
    supersample::{MOST, finer},
};
use crate::{
    files::archive::Source,
    report::{failure::Failure, problems, terminal},
};

/// The changes of the command line.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Changes {
    /// Cells along the world's longer side, or along both (`2048x1024`). Cells stay square: along the shorter side, the world
    /// may change by half a cell
    #[arg(long, value_name = "N|WxH", allow_hyphen_values = true)]
    pub cells: Option<Cells>,
    /// Build only a part of the world: position of its north-west corner in the world, and extent
    ///
    /// For example `--window "4 km,6 km,2 km x 2 km"`; it is widened to whole cells, and `--cells` still counts the
    /// whole world. The files equal the same part of the whole build and state their position. Results that depend on
    /// the whole world, such as rivers, are computed for all of it.
    #[arg(long, value_name = "X,Y,W x H", allow_hyphen_values = true)]
    pub window: Option<Part>,
    /// Compute each cell from N x N finer ones: finer detail, and crests that are not jagged
    ///
    /// Heights, masks and colours are means, areas and discharges the largest values, the numbers that identify layers
    /// or basins the most common; lines and reports are those of the finer cells. 2 takes four times the time and
    /// memory.
    #[arg(long, value_name = "N", value_parser = factor)]
    pub supersample: Option<u32>,
    /// The world's seed
    #[arg(long, value_name = "N")]
    pub seed: Option<u32>,
    /// A parameter of the file or of one of its nodes, in the notation of the file; can be given several times
    ///
    /// For example `--set age="2 Myr"` with a name from the file's `parameters` (`orograph check --describe` lists
    /// them), `--set rivers.duration="2 Myr"`, or a wire: `--set scree.talus=strata.repose`.
    #[arg(long, value_name = "NAME|NODE.PARAM=VALUE")]
    pub set: Vec<Setting>,
}

/// How to build it.
#[derive(Clone, Debug, clap::Args)]
pub struct Means {
    /// What computes the nodes; the results of a graphics card are within a stated tolerance of those of the processor
    #[arg(long, value_enum, default_value_t = BackendName::Auto)]
    pub backend: BackendName,
    /// Number of threads; one per core by default, at most 256 or the number of cores, whichever is larger. The result
    /// is the same for any number
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<NonZero<usize>>,
    /// Where results are stored.
    #[command(flatten)]
    pub storage: Storage,
}

/// The largest number of threads on a machine with fewer cores. More only take time from each other: on two busy
/// cores, a run of a graph of one node takes 1.6 s with 256, and 17 s with 1024.
const MAX_THREADS: usize = 256;

fn threads(text: &str) -> Result<NonZero<usize>, String> {
    let most = available_parallelism().map_or(MAX_THREADS, |cores| cores.get().max(MAX_THREADS));
    let number = text.parse::<NonZero<usize>>().ok().filter(|number| number.get() <= most);
    number.ok_or_else(|| format!("it is not a whole number from 1 to {most}"))
}

fn factor(text: &str) -> Result<u32, String> {
    let factor = text.parse().ok().filter(|factor| (1..=MOST).contains(factor));
    factor.ok_or_else(|| format!("it is not a whole number from 1 to {MOST}"))
}

/// A typed number of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cells {
    /// Along the longer side.
    Longer(u32),
    /// Along x and y.
    Both([u32; 2]),
}

impl FromStr for Cells {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            let text = text.trim();
            let number = text.parse::<u32>().ok().filter(|number| *number > 0);
            number.ok_or_else(|| format!("`{text}` is not a whole number from 1 to {}", u32::MAX))
        };
        match text.split_once(['x', 'X', '×']) {
            Some((x, y)) => Ok(Self::Both([number(x)?, number(y)?])),
            None => number(text).map(Self::Longer),
        }
    }
}

/// A typed `name=value` or `node.param=value`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// A parameter of the file, or of a node.
    pub place: String,
    /// Its value.
    pub value: String,
}

impl Setting {
    /// Changes a document. `option` is the command line option, for messages.
    ///
    /// # Errors
    /// When there is no such parameter, or it does not accept the value.
    pub fn apply(&self, document: &mut Document, option: &str) -> Result<(), Failure> {
        let Self { place, value } = self;
        let edit = match place.split_once('.') {
            Some((node, name)) => Edit::SetText { node: node.to_owned(), name: name.to_owned(), text: value.clone() },
            None => Edit::SetNamed { name: place.clone(), text: value.clone() },
        };
        document.apply(&edit).map_err(|error| {
            let (what, hint) = error.into_parts();
            let hint = of_world(place).or(hint);
            Failure { hint, ..Failure::wrong(format!("`{option} {place}={value}`: {what}")) }
        })
    }
}

/// The option for what belongs to the world and is no parameter.
fn of_world(place: &str) -> Option<String> {
    match place.strip_prefix("world.").unwrap_or(place) {
        "seed" => Some("write `--seed N`".to_owned()),
        "cells" => Some("write `--cells N`".to_owned()),
        _ => place.starts_with("world.").then(|| "change the world in the file".to_owned()),
    }
}

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (place, value) = text.split_once('=').ok_or("there is no `=`; write `name=value` or `node.param=value`")?;
        let part = |text: &str| (!text.trim().is_empty()).then(|| text.trim().to_owned());
        let place = match place.split_once('.') {
            Some((node, name)) => part(node).zip(part(name)).map(|(node, name)| format!("{node}.{name}")),
            None => part(place),
        };
        let place = place.ok_or("no parameter is named; write `name=value` or `node.param=value`")?;
        match value.trim() {
            "" => Err(format!("there is no value; write `{place}=VALUE`")),
            value => Ok(Self { place, value: value.to_owned() }),
        }
    }
}

/// Returns true if two parameters, of the file or of its nodes, set the same value.
#[must_use]
pub fn same_value(document: &Document, a: &str, b: &str) -> bool {
    let places = |name: &str| -> BTreeSet<String> {
        let driven = document.parameters().iter().find(|parameter| parameter.name == name);
        let of = |place: &Place| format!("{}.{}", document.graph().instance(place.node).name, place.name);
        driven.map_or_else(|| BTreeSet::from([name.to_owned()]), |named| named.places.iter().map(of).collect())
    };
    !places(a).is_disjoint(&places(b))
}

/// A graph and what to build of it.
#[derive(Clone, Debug)]
pub struct Request {
    /// The file.
    pub path: PathBuf,
    /// Its text and graph, with the changes of the command line.
    pub document: Document,
    /// The graph to build: the document's, with the nodes of the files that it uses.
    pub graph: Arc<Graph>,
    /// The world to build.
    pub world: World,
    /// The part of the world to write.
    window: Window,
    /// Finer cells along the side of each cell.
    supersample: u32,
    /// The outputs to build, in that graph.
    pub outputs: Vec<OutputDecl>,
    /// Where the files of an archive are, while the request lives.
    source: Arc<Source>,
}

impl Request {
    /// Reads a file and applies the changes.
    ///
    /// # Errors
    /// When the file cannot be read or has errors, which are then printed, or a change is invalid.
    pub fn new(path: &Path, changes: &Changes, registry: &Registry, warnings: bool) -> Result<Self, Failure> {
        let source = Source::open(path)?;
        let document = problems::open_sound(&source, registry, warnings)?;
        let request = Self::of(document, path, changes, Arc::new(source))?;
        let (size, own) = (request.world.size, request.document.world().size);
        if warnings && size != own {
            let [x, y] = size.map(|side| Unit::Metres.display(side));
            let [nx, ny] = request.world.cells;
            terminal::warn(&format!("the world becomes {x} x {y}, so that {nx} x {ny} cells are square"));
        }
        Ok(request)
    }

    /// A request for an open document in its current state.
    ///
    /// # Errors
    /// When a change is invalid.
    pub fn of_document(document: Document, changes: &Changes) -> Result<Self, Failure> {
        let path = document.path().map_or_else(|| PathBuf::from("the graph"), Path::to_owned);
        let source = Arc::new(Source::file(&path));
        Self::of(document, &path, changes, source)
    }

    fn of(mut document: Document, path: &Path, changes: &Changes, source: Arc<Source>) -> Result<Self, Failure> {
        for (at, Setting { place, .. }) in changes.set.iter().enumerate() {
            if let Some(other) = changes.set[..at].iter().find(|other| same_value(&document, &other.place, place)) {
                return Err(Failure::wrong(match other.place == *place {
                    true => format!("`{place}` is set twice"),
                    false => format!("`{}` and `{place}` set the same value", other.place),
                })
                .hint("remove one of the `--set` options"));
            }
        }
        changes.set.iter().try_for_each(|setting| setting.apply(&mut document, "--set"))?;
        let read = document.files();
        let folders: BTreeSet<&Path> = read.iter().filter_map(|file| file.parent()).collect();
        folders.into_iter().for_each(files::settle);
        let mut world = document.world();
        if let Some(epsg) = world.place.map(|place| place.epsg)
            && Projection::of(epsg).is_ok_and(|system| !system.is_in_metres())
        {
            return Err(Failure::wrong(format!(
                "the world's `place` has EPSG:{epsg}, whose coordinates are not metres"
            ))
            .hint("choose the zone of UTM in which it lies, such as `epsg: 32632`"));
        }
        world.seed = changes.seed.unwrap_or(world.seed);
        if let Some(cells) = changes.cells {
            world = with_cells(world, cells)?;
        }
        let window = match &changes.window {
            Some(part) => part.window(world)?,
            None => Window::whole(world),
        };
        let supersample = changes.supersample.unwrap_or(1);
        if !(1..=MOST).contains(&supersample) {
            return Err(Failure::wrong(format!("`--supersample {supersample}`: it is not from 1 to {MOST}")));
        }
        finer(window, supersample).world.check().map_err(|error| {
            Failure::wrong(format!("`--supersample {supersample}`: {error}"))
                .hint("compute on fewer finer cells, or write fewer with `--cells`")
        })?;
        let expanded = document.expand();
        let path = path.to_owned();
        Ok(Self {
            path,
            window,
            supersample,
            document,
            graph: expanded.graph,
            world,
            outputs: expanded.outputs,
            source,
        })
    }

    /// The same file with further changes, on top of those of the request.
    ///
    /// # Errors
    /// When a change is invalid.
    pub fn with(&self, settings: &[Setting], seed: Option<u32>, option: &str) -> Result<Self, Failure> {
        let mut document = self.document.clone();
        settings.iter().try_for_each(|setting| setting.apply(&mut document, option))?;
        let world = World { seed: seed.unwrap_or(self.world.seed), ..self.world };
        let window = Window { world, ..self.window };
        Ok(Self { world, window, ..self.edited(document) })
    }

    /// The same request for its document with further edits.
    #[must_use]
    pub fn edited(&self, document: Document) -> Self {
        let expanded = document.expand();
        let kept = |output: &OutputDecl| self.outputs.iter().any(|known| known.name == output.name);
        let outputs = expanded.outputs.into_iter().filter(kept).collect();
        Self { document, graph: expanded.graph, outputs, ..self.clone() }
    }

    /// The same request with its graph changed in a way that does not change its document, such as other backends.
    #[must_use]
    pub fn with_graph(self, change: impl FnOnce(Arc<Graph>) -> Arc<Graph>) -> Self {
        Self { graph: change(self.graph), ..self }
    }

    /// Keeps only the outputs of these names; all of them if there are none.
    ///
    /// # Errors
    /// When there is no such output.
    pub fn only(mut self, names: &[String]) -> Result<Self, Failure> {
        let known = |name: &String| self.outputs.iter().any(|output| output.name == *name);
        if let Some(name) = names.iter().find(|name| !known(name)) {
            let all: Vec<&str> = self.outputs.iter().map(|output| output.name.as_str()).collect();
            let failure = Failure::wrong(format!("`{}` has no output `{name}`", self.path.display()));
            return Err(match closest(name, all.iter().copied()) {
                Some(near) => failure.hint(format!("did you mean `{near}`?")),
                None => failure.hint(format!("it has `{}`", all.join("`, `"))),
            });
        }
        if !names.is_empty() {
            self.outputs.retain(|output| names.contains(&output.name));
        }
        Ok(self)
    }

    /// Where the graph file comes from.
    #[must_use]
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// Replaces temporary paths of an archive's files in a text by the path of the archive.
    #[must_use]
    pub fn shown(&self, text: &str) -> String {
        self.source.shown(text)
    }

    /// The failure with temporary paths of an archive's files replaced by the path of the archive.
    #[must_use]
    pub fn shown_in(&self, mut failure: Failure) -> Failure {
        failure.message = self.shown(&failure.message);
        if let Some(place) = &mut failure.place {
            place.file = self.shown(&place.file);
        }
        failure
    }

    /// The folder that the graph's files are relative to.
    #[must_use]
    pub fn folder(&self) -> &Path {
        self.document.folder()
    }

    /// The part of the world to build; the whole world without `--window`.
    #[must_use]
    pub const fn window(&self) -> Window {
        self.window
    }

    /// Finer cells along the side of each cell on which the outputs are computed; 1 without `--supersample`.
    #[must_use]
    pub const fn supersample(&self) -> u32 {
        self.supersample
    }
}

/// The world at another resolution. Its cells must be square: of a number along the longer side, the shorter side becomes
/// a whole number of cells, which changes it by half a cell at most.
fn with_cells(world: World, cells: Cells) -> Result<World, Failure> {
    let axis = usize::from(world.size[1] > world.size[0]);
    let on_longer = |longer: u32| {
        if longer == 0 {
            return World { cells: [0; 2], ..world };
        }
        let cell_m = world.size[axis] / f64::from(longer);
        let (mut cells, mut size) = ([longer; 2], world.size);
        // the conversion saturates; the result is checked below
        cells[1 - axis] = ((size[1 - axis] / cell_m).round() as u32).max(1);
        let exact = World { cells, ..world };
        let fitted = f64::from(cells[1 - axis]) * cell_m;
        if (fitted - size[1 - axis]).abs() > 0.501 * cell_m || exact.check().is_ok() {
            return exact;
        }
        size[1 - axis] = fitted;
        World { size, ..exact }
    };
    let changed = match cells {
        Cells::Longer(longer) => on_longer(longer),
        Cells::Both(cells) => World { cells, ..world },
    };
    changed.check().map(|()| changed).map_err(|error| {
        let failure = Failure::wrong(format!("`--cells`: {error}"));
        match error {
            WorldError::NotSquare(..) => failure.hint("give the number of cells along the longer side alone"),
            _ => failure,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_follow_the_longer_side() {
        let world = World { size: [1000.0, 2000.0], cells: [100, 200], ..World::default() };
        assert_eq!(with_cells(world, Cells::Longer(50)).expect("square").cells, [25, 50]);
        assert_eq!(with_cells(world, Cells::Both([5, 10])).expect("square").cells, [5, 10]);
        let failure = with_cells(world, Cells::Both([25, 51])).expect_err("not square");
        assert!(failure.hint.is_some_and(|hint| hint.contains("longer side alone")));
        // 16.7 cells become 17
        let longer = World { size: [1000.0, 3000.0], cells: [100, 300], ..World::default() };
        let fitted = with_cells(longer, Cells::Longer(50)).expect("square");
        assert_eq!((fitted.cells, fitted.size), ([17, 50], [1020.0, 3000.0]));
        let strip = World { size: [10.0, 2000.0], cells: [1, 200], ..World::default() };
        assert!(with_cells(strip, Cells::Longer(51)).is_err(), "a quarter of a cell");
        assert!(with_cells(world, Cells::Longer(0)).expect_err("no cells").message.contains("is empty"));
        let failure = with_cells(World::default(), Cells::Longer(1_000_000_000)).expect_err("too many");
        assert!(failure.message.contains("EiB"), "{failure}");
    }

    #[test]
    fn typed_changes_are_parsed() {
        assert_eq!("512".parse(), Ok(Cells::Longer(512)));
        assert_eq!("512x256".parse(), Ok(Cells::Both([512, 256])));
        assert!("many".parse::<Cells>().is_err() && "-5".parse::<Cells>().is_err());
        let setting: Setting = "rivers.duration = 2 Myr".parse().expect("is one");
        assert_eq!((setting.place.as_str(), setting.value.as_str()), ("rivers.duration", "2 Myr"));
        assert_eq!("age = 2 Myr".parse::<Setting>().map(|setting| setting.place), Ok("age".into()));
        for text in ["rivers.duration", "=2", ".duration=2", "rivers.=2"] {
            assert!(text.parse::<Setting>().is_err(), "{text}");
        }
    }
}
