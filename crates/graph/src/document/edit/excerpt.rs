//! Nodes as the text of a graph file, to copy them or to move them into a file of their own.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
};

use super::{Edit, EditError};
use crate::{
    document::{
        Document, NodeEntry,
        syntax::{Expr, lex::quote, literal::number_text},
    },
    node::Input,
};

impl Document {
    /// The text of a graph file with some of the nodes: as they are written, with the comments above and behind them,
    /// with all wires into them, and with their mutes, notes and routes of wires. `places` has their positions on the
    /// canvas.
    ///
    /// # Errors
    /// [`EditError`] when the text cannot be edited, which needs a text with syntax errors.
    pub fn excerpt(&self, nodes: &BTreeSet<String>, places: &BTreeMap<String, [f64; 2]>) -> Result<String, EditError> {
        self.excerpt_under("", nodes, places)
    }

    /// As [`Self::excerpt`], with fields above the nodes, such as `format: 1,`.
    pub(super) fn excerpt_under(
        &self,
        fields: &str,
        nodes: &BTreeSet<String>,
        places: &BTreeMap<String, [f64; 2]>,
    ) -> Result<String, EditError> {
        let entries = || self.nodes().iter().filter(|entry| nodes.contains(&entry.name));
        let mut text = format!("({fields}\n    nodes: {{\n");
        for entry in entries() {
            text.push_str(&self.written(entry));
        }
        text.push_str("    },\n");
        let muted: Vec<String> = entries().filter(|entry| entry.muted).map(|entry| quote(&entry.name)).collect();
        if !muted.is_empty() {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "    muted: [{}],", muted.join(", "));
        }
        text.push_str("    layout: {\n");
        for (name, [x, y]) in entries().filter_map(|entry| places.get_key_value(&entry.name)) {
            let _ = writeln!(text, "        {}: ({}, {}),", quote(name), number_text(*x), number_text(*y));
        }
        text.push_str("    },\n)\n");
        let notes = entries().filter(|entry| !entry.note.is_empty());
        let notes = notes.map(|entry| Edit::SetNote { node: entry.name.clone(), note: entry.note.clone() });
        let ways = self.reroutes().iter().filter(|way| nodes.contains(&way.node));
        let ways = ways.map(|way| Edit::SetReroutes {
            node: way.node.clone(),
            input: way.input.clone(),
            places: way.places.clone(),
        });
        let extras: Vec<Edit> = notes.chain(ways).collect();
        if extras.is_empty() {
            return Ok(text);
        }
        let mut copy = Self::parse(text, self.registry());
        copy.apply(&Edit::All(extras))?;
        Ok(copy.source().to_owned())
    }

    /// The lines of a node in `nodes`: its entry, the comments on the lines above, and the one behind it.
    fn written(&self, entry: &NodeEntry) -> String {
        let source = self.source();
        let mut text = String::new();
        let line = source[..entry.span.start].rfind('\n').map_or(0, |feed| feed + 1);
        if source[line..entry.span.start].trim().is_empty() {
            let above: Vec<&str> = source[..line].lines().rev().map(str::trim).collect();
            let comments = above.into_iter().take_while(|line| line.starts_with("//")).collect::<Vec<_>>();
            for comment in comments.into_iter().rev() {
                let _ = writeln!(text, "        {comment}");
            }
        }
        let _ = write!(text, "        {},", &source[entry.span.clone()]);
        let rest = source[entry.span.end..].lines().next().unwrap_or_default();
        let rest = rest.trim_start().trim_start_matches(',').trim();
        if rest.starts_with("//") {
            let _ = write!(text, " {rest}");
        }
        text.push('\n');
        text
    }

    /// A field of the file as it is written. Returns None when the file does not have it.
    pub(super) fn field_text(&self, name: &str) -> Option<&str> {
        let root = self.read.parsed.tree.root.as_ref().and_then(Expr::as_group)?;
        Some(&self.source()[root.get(name)?.value.span.clone()])
    }

    /// The inputs of nodes, each with its node and its position.
    pub(super) fn all_inputs(
        &self,
    ) -> impl Iterator<Item = (petgraph::stable_graph::NodeIndex, usize, &'static Input)> {
        let graph = self.graph();
        graph.indices().flat_map(move |node| {
            graph.instance(node).node.inputs.iter().enumerate().map(move |(at, input)| (node, at, input))
        })
    }
}
