//! A page of the manual for a terminal.

use std::fmt::Write as _;

use console::measure_text_width;
use orograph_graph::Unit;

use super::page::{ExpectPage, GraphPage, NodePage, PageEntry};
use crate::report::terminal::Page;

/// The page as text.
pub fn render(node: &NodePage, page: Page) -> String {
    let mut out = String::new();
    let place = format!("{} · version {}", node.category, node.version);
    let gap = page.width.saturating_sub(node.id.len() + measure_text_width(&place)).max(2);
    // Writing to a string cannot fail, here and below.
    let _ = writeln!(out, "{}{}{}", page.bold(node.id), " ".repeat(gap), page.dim(&place));
    out.push_str(&page.paragraphs(node.summary, 0));
    if !node.aliases.is_empty() {
        let _ = writeln!(out, "Earlier names: {}", node.aliases.join(", "));
    }
    out.push('\n');
    out.push_str(&page.paragraphs(node.doc, 2));
    let numbers = node.inputs.iter().any(|input| input.default.is_some());
    let inputs = if numbers { "a wire, or a number where there is a default" } else { "" };
    section(&mut out, page, ("Inputs", inputs), &node.inputs);
    section(&mut out, page, ("Parameters", ""), &node.parameters);
    section(&mut out, page, ("Outputs", ""), &node.outputs);
    if !node.measures.is_empty() {
        let title = format!("{}  {}", page.bold("Measures"), page.dim("names for `expect` in a graph file"));
        let _ = writeln!(out, "\n{title}");
        let lines = node.measures.iter().map(|measure| (measure.name, measure.unit, measure.doc));
        columns(&mut out, page, lines.collect());
    }

    heading(&mut out, page, "Example");
    let _ = writeln!(out, "  {}", page.name(&node.example));
    heading(&mut out, page, "Properties");
    for (name, text) in [("reads", &node.reach), ("result", &node.exactness), ("cells", &node.resolution)] {
        let _ = writeln!(out, "{}", labelled(page, name, text));
    }
    if !node.sources.is_empty() {
        heading(&mut out, page, "Sources");
        for source in node.sources {
            out.push_str(&page.paragraphs(&format!("- {source}"), 2));
        }
    }
    out
}

/// The page of a graph file as text. `world` describes its world.
pub fn describe(graph: &GraphPage, world: &str, page: Page) -> String {
    let mut out = page.bold(&graph.file) + "\n";
    out.push_str(&page.paragraphs(&graph.about, 0));
    // Writing to a string cannot fail.
    let _ = writeln!(out, "\n{}", labelled(page, "world", world));
    section(&mut out, page, ("Inputs", "what a graph that uses this file can wire"), &graph.inputs);
    section(&mut out, page, ("Parameters", "set with --set NAME=VALUE"), &graph.parameters);
    section(&mut out, page, ("Outputs", ""), &graph.outputs);
    if let Some(expected) = &graph.expect {
        expectations(&mut out, page, expected);
    }
    if !graph.uses.is_empty() {
        heading(&mut out, page, "Files");
        for file in &graph.uses {
            let _ = writeln!(out, "  {}", page.name(file));
        }
    }
    out
}

/// What a file expects.
fn expectations(out: &mut String, page: Page, expected: &ExpectPage) {
    let metres = |value: f64| Unit::Metres.display(value);
    let mut place = match &expected.output {
        Some(output) => format!("measured in `{output}`"),
        None => "not measured: no output is a height that is meant".to_owned(),
    };
    if let Some([x, y, width, height]) = expected.part_m.map(|part| part.map(metres)) {
        let _ = write!(place, ", {width} x {height} from ({x}, {y})");
    }
    if let Some(cell) = expected.cell_m {
        let _ = write!(place, ", on cells of {}", metres(cell));
    }
    let _ = writeln!(out, "\n{}  {}", page.bold("Expectations"), page.dim(&place));
    let lines = expected.measures.iter().map(|one| (one.measure.name, one.bounds_text.as_str(), one.measure.doc));
    columns(out, page, lines.collect());
}

/// Names with a short fact and a text.
fn columns(out: &mut String, page: Page, lines: Vec<(&str, &str, &str)>) {
    let width = |texts: &mut dyn Iterator<Item = &str>| texts.map(measure_text_width).max().unwrap_or(0) + 2;
    let first = width(&mut lines.iter().map(|line| line.0));
    let second = width(&mut lines.iter().map(|line| line.1));
    for (name, fact, doc) in lines {
        let [after_name, after_fact] =
            [(first, name), (second, fact)].map(|(width, text)| " ".repeat(width - measure_text_width(text)));
        let body = page.paragraphs(&one_line(doc), 2 + first + second);
        let _ = writeln!(out, "  {}{after_name}{}{after_fact}{}", page.name(name), page.dim(fact), body.trim());
    }
}

fn heading(out: &mut String, page: Page, text: &str) {
    let _ = writeln!(out, "\n{}", page.bold(text));
}

/// A name with a text beside it, wrapped to the width.
fn labelled(page: Page, name: &str, text: &str) -> String {
    const COLUMN: usize = 10;
    let body = page.paragraphs(text, COLUMN);
    let body = body.trim_start().trim_end();
    format!("  {}{}{body}", page.dim(name), " ".repeat((COLUMN - 2).saturating_sub(name.len()).max(1)))
}

fn section(out: &mut String, page: Page, (title, remark): (&str, &str), entries: &[PageEntry]) {
    if entries.is_empty() {
        return;
    }
    let title = format!("{}  {}", page.bold(title), page.dim(remark));
    let _ = writeln!(out, "\n{}", title.trim_end());
    let column = entries.iter().map(|entry| entry.name.len()).max().unwrap_or(0) + 4;
    for entry in entries {
        let pad = " ".repeat(column - 2 - entry.name.len());
        let facts = page.paragraphs(&facts(entry), column);
        let _ = writeln!(out, "  {}{pad}{}", page.name(entry.name), page.dim(facts.trim()));
        out.push_str(&page.paragraphs(entry.doc, column));
        for choice in &entry.choices {
            let text = format!("{}  {}", choice.name, one_line(choice.doc));
            out.push_str(&page.paragraphs(&format!("- {text}"), column));
        }
    }
}

/// The text on one line.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Type, default and ranges in one line.
fn facts(entry: &PageEntry) -> String {
    let mut facts = vec![entry.ty.clone()];
    if entry.required {
        facts.push("must be wired".to_owned());
    }
    if !entry.default_text.is_empty() {
        facts.push(format!("default {}", entry.default_text));
    }
    if !entry.range_text.is_empty() && entry.range_text != "any" {
        facts.push(entry.range_text.clone());
    }
    if !entry.usual_text.is_empty() {
        facts.push(format!("usually {}", entry.usual_text));
    }
    if !entry.when.is_empty() {
        facts.push(format!("only if {}", entry.when.join(" and ")));
    }
    facts.join(" · ")
}
