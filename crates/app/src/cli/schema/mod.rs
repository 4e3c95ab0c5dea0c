//! `orograph schema`: the JSON Schema of graph files, and a graph file as JSON.

mod file;
mod values;

use std::path::PathBuf;

pub use file::schema;

use crate::{
    files::archive::Source,
    report::{failure::Failure, problems, terminal},
};

/// Prints the JSON Schema of graph files, for other programs
///
/// The schema (draft 2020-12) is made from the declarations of the nodes: ports, parameters, units, defaults, ranges
/// and documentation. It describes a graph file as JSON: records and maps are objects, tuples and lists are arrays, and
/// a node is an object with one member, {"Perlin": {"octaves": 6}}. With a graph file, that file is printed as JSON in
/// this form.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  orograph schema > orograph.schema.json     the schema
  orograph schema alps.ron > alps.json       a file in the form that the schema describes")]
pub struct Args {
    /// A graph file to print as JSON
    #[arg(value_name = "GRAPH.ron")]
    file: Option<PathBuf>,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        let registry = orograph_nodes::registry();
        let value = match &self.file {
            None => schema(&registry),
            Some(file) => {
                let source = Source::open(file)?;
                let document = problems::open_sound(&source, &registry, false)?;
                document.to_json().ok_or_else(|| Failure::wrong(format!("`{}` is not a graph file", file.display())))?
            }
        };
        terminal::print(&format!("{value:#}\n"))
    }
}
