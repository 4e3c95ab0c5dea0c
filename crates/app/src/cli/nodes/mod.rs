//! `orograph nodes`: the manual of the nodes, generated from their declarations.

mod list;
mod markdown;
mod page;
mod text;

use std::path::Path;

use clap::ValueEnum;
use orograph_graph::{Document, Node, Registry, Unit, World};

use crate::report::{
    failure::Failure,
    terminal::{self, Page},
};
use page::{GraphPage, NodePage};

/// Prints the manual of the nodes: the list, or the page of one node
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  orograph nodes                                 what there is
  orograph nodes StreamPower                     one page, with units, defaults, ranges and sources
  orograph nodes StreamPower --format md > StreamPower.md")]
pub struct Args {
    /// Node type, such as `StreamPower`
    node: Option<String>,
    /// Output format
    #[arg(long, value_enum, default_value_t = Format::Table)]
    format: Format,
}

/// An output format of the manual.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// For a terminal
    Table,
    /// Markdown
    Md,
    /// JSON, for other programs
    Json,
}

impl Args {
    pub(super) fn run(self) -> Result<(), Failure> {
        let registry = orograph_nodes::registry();
        let text = match &self.node {
            Some(id) => {
                let page = NodePage::of(find(&registry, id)?);
                match self.format {
                    Format::Table => text::render(&page, Page::stdout()),
                    Format::Md => markdown::render(&page),
                    Format::Json => json(&page)?,
                }
            }
            None => match self.format {
                Format::Table => list::table(&registry, Page::stdout()),
                Format::Md => list::markdown(&registry),
                Format::Json => nodes_json(&registry)?,
            },
        };
        terminal::print(&text)
    }
}

/// The whole manual in Markdown, as file names and contents: the list, `README.md`, and a page for each node. Both show
/// the pictures `pictures/NODE.jpg`.
#[must_use]
pub fn manual(registry: &Registry) -> Vec<(String, String)> {
    let page = |node: &'static Node| (format!("{}.md", node.id), markdown::illustrated(&NodePage::of(node)));
    let list = ("README.md".to_owned(), list::contact_sheet(registry));
    std::iter::once(list).chain(registry.listed().map(page)).collect()
}

/// The declarations of all nodes, as JSON.
///
/// # Errors
/// When they cannot be written as JSON.
pub fn nodes_json(registry: &Registry) -> Result<String, Failure> {
    json(&registry.listed().map(NodePage::of).collect::<Vec<_>>())
}

/// The declarations of a graph file without errors, as JSON.
///
/// # Errors
/// When they cannot be written as JSON.
pub fn described(document: &Document, file: &Path) -> Result<String, Failure> {
    json(&GraphPage::of(document, file))
}

/// The declarations of a graph file without errors, as a page of text or as one line of JSON.
pub(super) fn describe(document: &Document, file: &Path, as_json: bool) -> Result<String, Failure> {
    let graph = GraphPage::of(document, file);
    if as_json {
        let line = serde_json::to_string(&graph);
        return line
            .map(|line| line + "\n")
            .map_err(|error| Failure::unable(format!("cannot write it as JSON: {error}")));
    }
    let World { cells: [nx, ny], seed, size, sea_level, .. } = document.world();
    let [width, height] = size.map(|metres| Unit::Metres.display(metres));
    let sea = sea_level.map_or_else(String::new, |level| format!(", sea at {}", Unit::Metres.display(level)));
    let world = format!("{width} x {height} in {nx} x {ny} cells, seed {seed}{sea}");
    Ok(text::describe(&graph, &world, Page::stdout()))
}

fn json(value: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value)
        .map(|text| text + "\n")
        .map_err(|error| Failure::unable(format!("cannot write the nodes as JSON: {error}")))
}

/// The node with this id; upper and lower case do not matter.
fn find(registry: &Registry, id: &str) -> Result<&'static Node, Failure> {
    let same = || registry.listed().find(|node| node.id.eq_ignore_ascii_case(id));
    registry.get(id).or_else(same).ok_or_else(|| {
        let failure = Failure::wrong(format!("there is no node `{id}`"));
        match registry.suggest(id) {
            Some(near) => failure.hint(format!("did you mean `{near}`?")),
            None => failure.hint("`orograph nodes` lists all of them"),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_node_has_a_page_in_every_format() {
        let page = Page { width: 130, colour: false, terminal: false };
        for node in orograph_nodes::registry().listed() {
            let entry = NodePage::of(node);
            let (text, md) = (text::render(&entry, page), markdown::render(&entry));
            for spec in node.specs() {
                assert!(text.contains(spec.name) && md.contains(spec.name), "{}.{}", node.id, spec.name);
            }
            assert!(text.contains(node.summary) && md.starts_with(&format!("# {}\n", node.id)), "{}", node.id);
            assert!(!text.contains("**"), "{}: stars are drawn as weight", node.id);
            let value = serde_json::to_value(&entry).expect("serialises");
            assert_eq!(value["id"], node.id);
        }
    }

    #[test]
    fn a_misspelt_node_gets_a_suggestion() {
        let registry = orograph_nodes::registry();
        assert_eq!(find(&registry, "constant").expect("case is forgiven").id, "Constant");
        let failure = find(&registry, "Constent").expect_err("misspelt");
        assert_eq!(failure.hint.as_deref(), Some("did you mean `Constant`?"));
        assert_eq!(find(&registry, "Zeppelin").expect_err("no such node").exit, crate::Exit::Wrong);
    }
}
