//! A page of the manual in Markdown.

use std::fmt::Write as _;

use super::page::{NodePage, PageEntry};

/// The page in Markdown.
pub fn render(node: &NodePage) -> String {
    page(node, "")
}

/// The page in Markdown with the node's picture.
pub fn illustrated(node: &NodePage) -> String {
    let picture = format!(
        "![What {0} gives. If it changes what it is given: before on the left, after on the right.]\
         (pictures/{0}.jpg)\n\n",
        node.id
    );
    page(node, if node.pictured { &picture } else { "" })
}

fn page(node: &NodePage, picture: &str) -> String {
    let mut out = format!("# {}\n\n{}\n\n{picture}{}\n", node.id, node.summary, node.doc.trim());
    // Writing to a string cannot fail, here and below.
    let _ = write!(out, "\nCategory: {}. Version: {}.", node.category, node.version);
    if !node.aliases.is_empty() {
        let _ = write!(out, " Earlier names: {}.", node.aliases.join(", "));
    }
    out.push('\n');
    section(&mut out, "Inputs", &node.inputs, "input");
    section(&mut out, "Parameters", &node.parameters, "parameter");
    section(&mut out, "Outputs", &node.outputs, "output");
    if !node.measures.is_empty() {
        out.push_str(
            "\n## Measures\n\nThe names are those of `expect` in a [graph file](../graph-files.md#expectations).\n\n",
        );
        out.push_str("| measure | unit | meaning |\n|---|---|---|\n");
        for measure in node.measures {
            let _ = writeln!(out, "| `{}` | {} | {} |", measure.name, measure.unit, cell(measure.doc));
        }
    }
    let _ = write!(out, "\n## Example\n\n```rust\n{}\n```\n", node.example);
    let _ = write!(
        out,
        "\n## Properties\n\n- Reads: {}.\n- Result: {}.\n- Cells: {}.\n",
        node.reach, node.exactness, node.resolution
    );
    if !node.sources.is_empty() {
        out.push_str("\n## Sources\n\n");
        for source in node.sources {
            let _ = writeln!(out, "- {source}");
        }
    }
    out
}

fn section(out: &mut String, title: &str, entries: &[PageEntry], noun: &str) {
    if entries.is_empty() {
        return;
    }
    let _ = write!(out, "\n## {title}\n\n");
    if noun == "input" && entries.iter().any(|entry| entry.default.is_some()) {
        out.push_str("Each takes a wire, or a number where there is a default.\n\n");
    }
    if noun == "output" {
        let _ = writeln!(out, "| {noun} | type | meaning |\n|---|---|---|");
    } else {
        let _ = writeln!(out, "| {noun} | type | default | range | usual | meaning |\n|---|---|---|---|---|---|");
    }
    for entry in entries {
        let only = match entry.when.is_empty() {
            true => String::new(),
            false => format!(" *Only if {}.*", entry.when.join(" and ")),
        };
        let meaning = cell(entry.doc) + &only;
        let meaning = entry
            .choices
            .iter()
            .fold(meaning, |text, choice| format!("{text}<br>`{}`: {}", choice.name, cell(choice.doc)));
        let ty = cell(&entry.ty);
        if noun == "output" {
            let _ = writeln!(out, "| `{}` | {ty} | {meaning} |", entry.name);
            continue;
        }
        let default = if entry.required { "must be wired" } else { &entry.default_text };
        let _ = writeln!(
            out,
            "| `{}` | {ty} | {} | {} | {} | {meaning} |",
            entry.name,
            cell(default),
            cell(&entry.range_text),
            cell(&entry.usual_text)
        );
    }
}

/// Text that does not break a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}
