//! The list of all nodes.

use std::fmt::Write as _;

use orograph_graph::{Node, Registry};

use super::page::is_pictured;
use crate::report::terminal::{Align, Page, Table, counted};

/// The nodes by category, in palette order.
fn categories(registry: &Registry) -> Vec<(&'static str, Vec<&'static Node>)> {
    let mut groups: Vec<(&str, Vec<&Node>)> = Vec::new();
    for node in registry.listed() {
        match groups.iter_mut().find(|(category, _)| *category == node.category) {
            Some((_, nodes)) => nodes.push(node),
            None => groups.push((node.category, vec![node])),
        }
    }
    groups
}

/// The list for a terminal.
pub fn table(registry: &Registry, page: Page) -> String {
    let mut table = Table::new(&[("category", Align::Left), ("node", Align::Left), ("what it does", Align::Left)]);
    for (category, nodes) in categories(registry) {
        for (at, node) in nodes.into_iter().enumerate() {
            let category = if at == 0 { page.dim(category) } else { String::new() };
            table.row([category, page.name(node.id), node.summary.to_owned()]);
        }
    }
    let mut out = table.render(page, 0);
    let count = counted(registry.listed().count(), "node");
    // Writing to a string cannot fail.
    let _ = writeln!(out, "\n{}", page.dim(&format!("{count}; `orograph nodes NODE` prints the page of a node")));
    out
}

/// The list in Markdown; each node links to its page.
pub fn markdown(registry: &Registry) -> String {
    listed(registry, "node | what it does", |node| format!("[{0}]({0}.md)", node.id))
}

/// The list in Markdown with the picture of each node.
pub fn contact_sheet(registry: &Registry) -> String {
    listed(registry, "picture | node | what it does", |node| {
        let picture = if is_pictured(node) { format!("![{0}](pictures/{0}.jpg)", node.id) } else { String::new() };
        format!("{picture} | [{0}]({0}.md)", node.id)
    })
}

fn listed(registry: &Registry, head: &str, node_cells: impl Fn(&Node) -> String) -> String {
    let rule = "---|".repeat(head.split('|').count());
    let mut out = String::from("# Nodes\n");
    for (category, nodes) in categories(registry) {
        let _ = write!(out, "\n## {category}\n\n| {head} |\n|{rule}\n");
        for node in nodes {
            let _ = writeln!(out, "| {} | {} |", node_cells(node), node.summary.replace('|', "\\|"));
        }
    }
    out
}
