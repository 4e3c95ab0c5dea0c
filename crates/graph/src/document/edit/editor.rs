//! How an edit changes the text: each step is a splice at spans of the tree, and the result is parsed again.

mod canvas;
mod expected;
mod named;
mod values;
mod worlds;

use std::ops::Range;

use super::EditError;
use crate::document::{
    check::{
        args::{args, kind_of, migrate, version},
        exposed::{Section, places},
    },
    subgraph::{self, Home, Loader},
    syntax::{
        self, Group, Item,
        lex::{Bracket, quote},
        literal::{Literal, is_name},
        splice::Draft,
    },
};
use crate::{closest, node::Node, registry::Registry};

/// A string that is a wire.
struct WireUse {
    /// The string with its quotes.
    span: Range<usize>,
    /// The part after the name, including the dot.
    port: String,
    /// The node and its input; `None` when the node is of an unknown kind.
    input: Option<(String, String)>,
}

/// Applies edits to a draft.
pub(crate) struct Editor<'a> {
    draft: &'a mut Draft,
    registry: &'a Registry,
    home: &'a Home,
}

impl<'a> Editor<'a> {
    pub(crate) fn new(draft: &'a mut Draft, registry: &'a Registry, home: &'a Home) -> Self {
        Self { draft, registry, home }
    }

    fn items(&self, field: &str) -> &[Item] {
        self.draft.field(field).map_or(&[], |group| &group.items)
    }

    pub(crate) fn item(&self, name: &str) -> Result<&Item, EditError> {
        self.draft.field("nodes").and_then(|nodes| nodes.get(name)).ok_or_else(|| {
            let names = self.items("nodes").iter().filter_map(|item| item.key.as_ref());
            let suggestion = closest(name, names.map(|key| key.text.as_str())).map(str::to_owned);
            EditError::UnknownNode { name: name.to_owned(), suggestion }
        })
    }

    /// The span of an output's name.
    fn output(&self, name: &str) -> Result<Range<usize>, EditError> {
        let item = self.draft.field("outputs").and_then(|outputs| outputs.get(name));
        item.and_then(|item| item.key.as_ref())
            .map(|key| key.span.clone())
            .ok_or_else(|| EditError::UnknownOutput(name.to_owned()))
    }

    /// The kind of a node, and its brackets. A `Subgraph` has the declarations of its file, if the file can be used.
    fn known<'i>(&self, item: &'i Item) -> Option<(&'static Node, Option<&'i Group>)> {
        let (kind, group) = kind_of(&item.value)?;
        let mut node = self.registry.get(&self.draft.source[kind])?;
        if node.is_subgraph()
            && let Some(file) = subgraph::file_of(group, &self.draft.source)
            && let Ok(inner) = Loader::new(self.home).load(&self.home.folder.join(file), self.registry)
        {
            node = subgraph::interface(&inner);
        }
        let version = group.map_or(Some(1), |group| version(group, &self.draft.source))?;
        (version <= node.version).then_some((node, group))
    }

    pub(crate) fn add_node(&mut self, name: &str, kind: &str, at: Option<[f64; 2]>) -> Result<(), EditError> {
        if !is_name(kind) {
            return Err(refused(format!("`{}` is not a kind of node", kind.escape_debug())));
        }
        let written = self.registry.get(kind).map_or_else(|| format!("{kind}()"), |node| node.written(""));
        self.add_written(name, &written, at)
    }

    /// Adds a node as it is written in a file.
    pub(crate) fn add_written(&mut self, name: &str, text: &str, at: Option<[f64; 2]>) -> Result<(), EditError> {
        if self.draft.field("nodes").is_some_and(|nodes| nodes.get(name).is_some()) {
            return Err(refused(format!("there is a node `{name}` already")));
        }
        let (tree, problems) = syntax::parse(text);
        if !problems.is_empty() || tree.root.as_ref().and_then(kind_of).is_none() {
            return Err(refused(format!("`{}` is not a node", text.escape_debug())));
        }
        self.insert_entry("nodes", name, text);
        if at.is_some() {
            self.set_layout(name, at);
        }
        Ok(())
    }

    pub(crate) fn remove_node(&mut self, name: &str) -> Result<(), EditError> {
        self.item(name)?;
        for (node, input) in self.wires(name).into_iter().filter_map(|wire| wire.input) {
            if node != name {
                self.reset(&node, &input)?;
            }
        }
        let outputs: Vec<String> = self
            .items("outputs")
            .iter()
            .filter(|item| wire_end(item, &self.draft.source).is_some_and(|end| node_of(&end) == name))
            .filter_map(|item| item.key.as_ref().map(|key| key.text.clone()))
            .collect();
        for output in outputs {
            self.remove_entry("outputs", &output);
        }
        self.forget_places(name);
        self.set_muted(name, false)?;
        self.clear_canvas(name);
        self.remove_entry("nodes", name);
        Ok(())
    }

    pub(crate) fn rename_node(&mut self, from: &str, to: &str) -> Result<(), EditError> {
        self.item(from)?;
        if from != to && self.item(to).is_ok() {
            return Err(refused(format!("there is a node `{to}` already")));
        }
        let mut changes = self.renamed_on_canvas(from, to);
        let keys = self.items("nodes").iter().filter_map(|item| item.key.as_ref());
        changes.extend(keys.filter(|key| key.text == from).map(|key| (key.span.clone(), quote(to))));
        changes.extend(self.muted(from).map(|item| (item.value.span.clone(), quote(to))));
        for wire in self.wires(from) {
            changes.push((wire.span, quote(&format!("{to}{}", wire.port))));
        }
        for item in self.items("outputs") {
            if let Some(end) = wire_end(item, &self.draft.source).filter(|end| node_of(end) == from) {
                changes.push((item.value.span.clone(), quote(&format!("{to}{}", &end[from.len()..]))));
            }
        }
        for section in Section::ALL {
            for item in self.items(section.field()) {
                let of_node = places(&item.value, section, &self.draft.source);
                let of_node = of_node.into_iter().filter(|(text, _)| node_of(text) == from);
                changes.extend(of_node.map(|(text, span)| (span, quote(&format!("{to}{}", &text[from.len()..])))));
            }
        }
        self.draft.change(changes);
        Ok(())
    }

    /// All strings in nodes that are wires from a node; in nodes of an unknown kind, all strings that look like one.
    fn wires(&self, from: &str) -> Vec<WireUse> {
        let source = self.draft.source.as_str();
        let mut uses = Vec::new();
        for item in self.items("nodes") {
            let Some(group) = kind_of(&item.value).and_then(|(_, group)| group) else { continue };
            let mut named = args(group, source);
            // Without its file, it is unknown which strings are wires.
            let known = self.known(item).map(|(node, _)| node).filter(|node| !std::ptr::eq(*node, &subgraph::SUBGRAPH));
            if let Some(node) = known {
                migrate(&mut named, node, version(group, source).unwrap_or(1), &(0..0));
            }
            for arg in named {
                let end = arg.literal.as_wire().filter(|end| node_of(end) == from);
                if let Some(end) = end
                    && arg.item.is_some()
                    && known.is_none_or(|node| node.input(&arg.name).is_some())
                {
                    let key = item.key.as_ref().map_or_else(String::new, |key| key.text.clone());
                    let port = end[from.len()..].to_owned();
                    uses.push(WireUse { span: arg.span, port, input: known.map(|_| (key, arg.name)) });
                }
            }
        }
        uses
    }

    pub(crate) fn remove_output(&mut self, name: &str) -> Result<(), EditError> {
        self.output(name)?;
        self.remove_entry("outputs", name);
        Ok(())
    }

    pub(crate) fn rename_output(&mut self, from: &str, to: &str) -> Result<(), EditError> {
        let span = self.output(from)?;
        self.draft.change(vec![(span, quote(to))]);
        Ok(())
    }

    /// A wire without the name of the first output, which is implied.
    pub(crate) fn short_wire(&self, end: &str) -> String {
        let node = self.item(node_of(end)).ok().and_then(|item| self.known(item));
        match (end.split_once('.'), node) {
            (Some((name, port)), Some((node, _))) if node.output_index(port) == Some(0) => name.to_owned(),
            _ => end.to_owned(),
        }
    }

    pub(crate) fn set_entry(&mut self, field: &str, name: &str, text: &str) {
        match self.draft.field(field).and_then(|group| group.get(name)) {
            Some(item) => {
                let change = (item.value.span.clone(), text.to_owned());
                self.draft.change(vec![change]);
            }
            None => self.insert_entry(field, name, text),
        }
    }

    /// Adds `"name": text` to a field of the file; adds the field if it is missing.
    fn insert_entry(&mut self, field: &str, name: &str, text: &str) {
        if self.draft.field(field).is_none() {
            self.set_root(field, "{}");
        }
        let Some(group) = self.draft.field(field) else { return };
        let key = quote(name);
        // Align the value with the one above, if there is room.
        let column = group.items.last().and_then(|item| {
            let gap = item.span().start..item.value.span.start;
            (!self.draft.source[gap.clone()].contains('\n')).then_some(gap.len())
        });
        let width = match field {
            "nodes" => column.unwrap_or(0).max(key.len() + 2) - 1,
            _ => key.len() + 1,
        };
        let entry = format!("{:<width$} {text}", format!("{key}:"));
        let changes = self.draft.insertion(group, &entry, field == "nodes");
        self.draft.change(changes);
    }

    fn remove_entry(&mut self, field: &str, name: &str) {
        let Some(group) = self.draft.field(field) else { return };
        if let Some(position) = group.position(name) {
            let changes = self.draft.removal(group, position);
            self.draft.change(changes);
        }
    }

    fn set_root(&mut self, field: &str, text: &str) {
        let Some(root) = self.draft.root() else { return };
        let changes = match root.get(field) {
            Some(item) => vec![(item.value.span.clone(), text.to_owned())],
            None => self.draft.insertion(root, &format!("{field}: {text}"), true),
        };
        self.draft.change(changes);
    }

    /// The entries of a node in `muted`.
    fn muted(&self, node: &str) -> impl Iterator<Item = &Item> {
        let names = |item: &&Item| Literal::read(&item.value, &self.draft.source) == Literal::Text(node.to_owned());
        self.items("muted").iter().filter(names)
    }

    pub(crate) fn set_muted(&mut self, node: &str, muted: bool) -> Result<(), EditError> {
        self.item(node)?;
        let stands = self.muted(node).next().is_some();
        if muted && !stands {
            match self.draft.root().and_then(|root| root.get("muted")).map(|item| item.value.as_group()) {
                None => self.set_root("muted", &format!("[{}]", quote(node))),
                Some(Some(list)) if list.bracket == Bracket::Square => {
                    let changes = self.draft.insertion(list, &quote(node), false);
                    self.draft.change(changes);
                }
                Some(_) => return Err(refused("`muted` in the file is not a list".to_owned())),
            }
        }
        while !muted && self.muted(node).next().is_some() {
            let Some(list) = self.draft.field("muted") else { break };
            let names = |item: &Item| Literal::read(&item.value, &self.draft.source) == Literal::Text(node.to_owned());
            let Some(position) = list.items.iter().position(names) else { break };
            let changes = self.draft.removal(list, position);
            self.draft.change(changes);
        }
        if stands && !muted {
            self.remove_empty("muted");
        }
        Ok(())
    }

    /// Removes a field of the file that has become empty, if nothing is lost.
    fn remove_empty(&mut self, field: &str) {
        let Some(root) = self.draft.root() else { return };
        let (Some(position), Some(group)) = (root.position(field), self.draft.field(field)) else { return };
        let inner = group.open + 1..group.close.unwrap_or(group.open + 1);
        if self.draft.source[inner].trim().is_empty() {
            let changes = self.draft.removal(root, position);
            self.draft.change(changes);
        }
    }
}

pub(super) fn refused(message: String) -> EditError {
    EditError::Refused { message, hint: None }
}

/// The source of the wire in an entry.
fn wire_end(item: &Item, source: &str) -> Option<String> {
    Literal::read(&item.value, source).as_wire().map(str::to_owned)
}

/// The node in the source of a wire.
fn node_of(end: &str) -> &str {
    end.split_once('.').map_or(end, |(name, _)| name)
}
