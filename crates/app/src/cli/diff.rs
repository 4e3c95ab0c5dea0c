//! `orograph diff`: what changed between two graph files.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use orograph_graph::Document;

use crate::{
    files::{archive::Source, contents, read_by},
    report::{failure::Failure, problems, terminal},
};

/// Lists what changed from one graph file to another
///
/// Comments, order, layout and the notation of values do not count: two files without a difference build the same
/// terrain. Of the files that both read by the same name, those whose contents differ are listed too.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The earlier file
    #[arg(value_name = "A.ron")]
    a: PathBuf,
    /// The later file
    #[arg(value_name = "B.ron")]
    b: PathBuf,
    /// Exit with 1 if there is a difference
    #[arg(long)]
    exit_code: bool,
    /// Print the changes as JSON: `{"changes":[TEXT,...]}`
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        let registry = orograph_nodes::registry();
        let (a, b) = (Source::open(&self.a)?, Source::open(&self.b)?);
        let a = problems::open_sound(&a, &registry, false)?;
        let b = problems::open_sound(&b, &registry, false)?;
        let mut changes = orograph_graph::diff(&a, &b);
        changes.extend(other_files(&a, &b));
        let text = match changes.is_empty() {
            _ if self.json => format!("{}\n", serde_json::json!({"changes": changes})),
            true => "no difference in what they build\n".to_owned(),
            false => changes.iter().map(|change| format!("{change}\n")).collect(),
        };
        terminal::print(&text)?;
        if self.exit_code && !changes.is_empty() { Err(Failure::silent(crate::Exit::Wrong)) } else { Ok(()) }
    }
}

/// The files that both graphs read by the same name, and whose contents differ. Graphs among them are compared as such.
fn other_files(a: &Document, b: &Document) -> Vec<String> {
    let inside = |document: &Document| -> BTreeSet<PathBuf> {
        let names = read_by(document).into_iter();
        names.filter_map(|path| path.strip_prefix(document.folder()).ok().map(Path::to_owned)).collect()
    };
    let hash = |document: &Document, name: &Path| contents(&document.folder().join(name)).ok();
    let both: Vec<PathBuf> = inside(a).intersection(&inside(b)).cloned().collect();
    let is_raster = |name: &&PathBuf| name.extension().is_none_or(|extension| extension != "ron");
    let differ = |name: &&PathBuf| a.folder() != b.folder() && hash(a, name) != hash(b, name);
    let changed = both.iter().filter(is_raster).filter(differ);
    changed.map(|name| format!("`{}`: contents differ", name.display())).collect()
}
