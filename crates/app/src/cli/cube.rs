//! `orograph run --cube`: all terrains of a sweep in one Zarr store.

use std::path::PathBuf;

use orograph_graph::{Cancel, KEY_SCHEME};
use orograph_nodes::raster;
use serde_json::{Map, json};

use super::sweep::{SEED, Sweep, Variant, variants};
use crate::{
    build::{
        Builder,
        backend::BackendName,
        request::{Changes, Request},
    },
    export::cube::{Axis, CHECKED, Checked, Cube, Plan, holds},
    files::{contents, read_by},
    report::{
        failure::Failure,
        progress::Progress,
        terminal::{self, Page, counted},
    },
};

/// The options of a cube.
#[derive(Debug, clap::Args)]
pub struct CubeArgs {
    /// Write heights, masks and other scalars into one Zarr store, `DIR/GRAPH.zarr`, instead of files
    ///
    /// Each output is an array with a labelled dimension for each `--sweep`, for y and for x; of the terrains of a
    /// sweep, mean, quantiles and probabilities are stored for each cell. The same command continues a sweep that was
    /// stopped.
    #[arg(long, conflicts_with_all = ["format", "engine", "tiles", "mesh", "dither", "lines", "holes", "json", "timings"])]
    pub cube: bool,
    /// Quantiles of each cell over the terrains of a cube, from 0 to 1
    #[arg(long, value_name = "Q,Q", value_delimiter = ',', default_value = "0.05,0.5,0.95",
        requires_all = ["cube", "sweep"], value_parser = fraction)]
    pub quantiles: Vec<f64>,
    /// Store the fraction of terrains in which an output is above a value; can be given several times
    #[arg(long, value_name = "OUTPUT=VALUE", requires_all = ["cube", "sweep"])]
    pub above: Vec<String>,
}

fn fraction(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|number| (0.0..=1.0).contains(number)).ok_or_else(|| "it is not from 0 to 1".to_owned())
}

/// A cube to build.
pub struct Job<'a> {
    pub request: &'a Request,
    pub changes: &'a Changes,
    pub sweeps: &'a [Sweep],
    /// The folder in which the store lies.
    pub out: &'a std::path::Path,
    pub args: &'a CubeArgs,
    /// Members of different backends are not mixed.
    pub backend: BackendName,
    pub is_quiet: bool,
}

impl Job<'_> {
    /// Builds the terrains that are not yet in the store, then the statistics.
    ///
    /// # Errors
    /// When something cannot be built or written, or a terrain misses an expectation.
    pub fn run(&self, builder: &Builder, cancel: &Cancel, progress: &dyn Progress) -> Result<(), Failure> {
        let (axes, variants) = self.variants()?;
        let cube = Cube::open(&self.folder(), self.plan(axes)?)?;
        let names: Vec<String> = variants.iter().map(|variant| Checked::name(&variant.label())).collect();
        let mut checked = Checked::read(&cube)?;
        let is_expected = self.request.document.expectations().is_some();
        let is_done = |member: &usize| cube.is_complete(*member) && (!is_expected || checked.has(&names[*member]));
        let left: Vec<usize> = (0..variants.len()).filter(|member| !is_done(member)).collect();
        let done = variants.len() - left.len();
        if done > 0 && !self.is_quiet {
            terminal::remark(&format!("continuing: {} of {} are complete\n", done, variants.len()));
        }
        for (at, member) in left.into_iter().enumerate() {
            let label = variants[member].label();
            if !self.is_quiet && variants.len() > 1 {
                terminal::remark(&format!("{} of {}: {label}\n", done + at + 1, variants.len()));
            }
            let expected = builder.build_member(&variants[member].request, &cube, member, cancel, progress)?;
            let missed = expected.missed();
            if let Some(what) = &missed {
                terminal::remark(&format!("{} {label}: {what}\n", Page::stderr().bad("missed:")));
            }
            if is_expected {
                checked.note(&cube, &names[member], missed)?;
            }
        }
        cube.finish(cancel)?;
        // also those of the runs that this one continues
        let missed = checked.missed();
        if !self.is_quiet {
            let (page, count) = (Page::stdout(), counted(variants.len(), "terrain"));
            let name = page.name(&cube.folder().display().to_string());
            terminal::print(&format!("{} {name} of {count}\n", page.good("built")))?;
        }
        if missed == 0 {
            return Ok(());
        }
        let what = format!("{missed} of {} missed an expectation", counted(variants.len(), "terrain"));
        Err(Failure::wrong(what).hint(format!("the cube is complete; its `{CHECKED}` says which")))
    }

    /// The swept dimensions, the seed last, and every terrain.
    fn variants(&self) -> Result<(Vec<Axis>, Vec<Variant>), Failure> {
        let mut sweeps = self.sweeps.to_vec();
        sweeps.sort_by_key(|sweep| sweep.place() == SEED);
        let axes = sweeps.iter().map(|sweep| Axis { name: sweep.place().to_owned(), values: sweep.values().to_vec() });
        // no folder is made: the names only have to differ
        let template: PathBuf = sweeps.iter().map(|sweep| format!("{{{}}}", sweep.place())).collect();
        Ok((axes.collect(), variants(self.request, self.changes, &sweeps, &template)?))
    }

    fn folder(&self) -> PathBuf {
        let mut name = self.request.path.file_stem().unwrap_or_default().to_os_string();
        name.push(".zarr");
        self.out.join(name)
    }

    fn plan(&self, axes: Vec<Axis>) -> Result<Plan, Failure> {
        let outputs = self.request.outputs.clone();
        for output in outputs.iter().filter(|output| !holds(output.ty)) {
            let what =
                format!("`{}` has the type {}, which a cube cannot contain; it is left out", output.name, output.ty);
            terminal::warn(&what);
        }
        if !outputs.iter().any(|output| holds(output.ty)) {
            return Err(Failure::wrong("no output is a raster of numbers, so the cube would be empty")
                .hint("add a height or a mask to `outputs`"));
        }
        let mut thresholds = Vec::new();
        for text in &self.args.above {
            let wrong = |what: &str| Failure::wrong(format!("`--above {text}`: {what}"));
            let (name, value) =
                text.split_once('=').ok_or_else(|| wrong("there is no `=`").hint("write height=1200"))?;
            let Some(output) = outputs.iter().find(|output| output.name == name.trim() && holds(output.ty)) else {
                return Err(wrong("the cube has no such output").hint("name one of the graph's `outputs`"));
            };
            let value = output.ty.unit().parse(value.trim()).map_err(|error| wrong(&error.to_string()))?;
            thresholds.push((output.name.clone(), value));
        }
        let (window, quantiles) = (self.request.window(), self.args.quantiles.clone());
        let attributes = self.attributes(&axes, &format!("{quantiles:?} {thresholds:?}"))?;
        Ok(Plan { axes, outputs, window, attributes, quantiles, thresholds })
    }

    /// What the whole is, and a hash of everything that the terrains and their statistics depend on.
    fn attributes(&self, axes: &[Axis], statistics: &str) -> Result<Map<String, serde_json::Value>, Failure> {
        let Request { document, graph, world, .. } = self.request;
        let mut hash = blake3::Hasher::new();
        let mut part = |bytes: &[u8]| {
            hash.update(&(bytes.len() as u64).to_le_bytes());
            hash.update(bytes);
        };
        part(document.source().as_bytes());
        part(KEY_SCHEME.as_bytes());
        part(format!("{:?}", self.backend).as_bytes());
        part(format!("{world:?} {:?} {}", self.request.window(), self.request.supersample()).as_bytes());
        for index in graph.indices() {
            let node = graph.instance(index).node;
            part(format!("{} {}", node.id, node.version).as_bytes());
        }
        part(statistics.as_bytes());
        part(format!("{axes:?}").as_bytes());
        let swept = axes.iter().flat_map(|axis| &axis.values).map(|value| document.folder().join(value));
        let swept = swept.filter(|file| file.is_file()).flat_map(|file| [raster::sidecar_path(&file), file]);
        for path in read_by(document).into_iter().chain(swept) {
            let content = contents(&path).map_err(|_| Failure::unable(format!("cannot read `{}`", path.display())))?;
            part(content.as_bytes());
        }
        let title = self.request.path.file_stem().unwrap_or_default().to_string_lossy();
        let mut all = Map::new();
        all.insert("Conventions".to_owned(), json!("CF-1.11"));
        all.insert("title".to_owned(), json!(title));
        all.insert("source".to_owned(), json!(concat!("orograph ", env!("CARGO_PKG_VERSION"))));
        all.insert("graph".to_owned(), json!(document.source()));
        all.insert("seed".to_owned(), json!(world.seed));
        if self.request.supersample() > 1 {
            all.insert("supersample".to_owned(), json!(self.request.supersample()));
        }
        all.insert("graph_hash".to_owned(), json!(hash.finalize().to_hex().as_str()[..32]));
        Ok(all)
    }
}
