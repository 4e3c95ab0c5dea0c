//! Edits of canvas data: positions, notes, routes of wires, frames.

use std::{
    collections::{HashMap, HashSet},
    ops::Range,
};

use super::{Editor, node_of, refused};
use crate::document::{
    check::frames::Frame,
    edit::EditError,
    syntax::{
        Item,
        lex::{Bracket, quote},
        literal::number_text,
        splice::Change,
    },
};

/// A position as written in a file.
fn place_text([x, y]: [f64; 2]) -> String {
    format!("({}, {})", number_text(x), number_text(y))
}

impl Editor<'_> {
    pub(in crate::document) fn set_layout(&mut self, node: &str, at: Option<[f64; 2]>) {
        match at {
            Some(at) => self.set_entry("layout", node, &place_text(at)),
            None => self.remove_entry("layout", node),
        }
    }

    /// Sets the positions of many nodes at once, with the same result as one after the other.
    pub(in crate::document) fn set_places(&mut self, places: &[(&str, [f64; 2])]) -> Result<(), EditError> {
        let keys = self.items("nodes").iter().filter_map(|item| item.key.as_ref());
        let nodes: HashSet<&str> = keys.map(|key| key.text.as_str()).collect();
        for (node, _) in places.iter().filter(|(node, _)| !nodes.contains(node)) {
            self.item(node)?;
        }
        if self.draft.field("layout").is_none() {
            self.set_root("layout", "{}");
        }
        let Some(group) = self.draft.field("layout") else { return Ok(()) };
        let mut stands: HashMap<&str, &Item> = HashMap::new();
        for item in &group.items {
            if let Some(key) = &item.key {
                stands.entry(&key.text).or_insert(item);
            }
        }
        let last: HashMap<&str, [f64; 2]> = places.iter().copied().collect();
        let mut written = HashSet::new();
        let (mut changes, mut added) = (Vec::new(), Vec::new());
        for (node, _) in places {
            if !written.insert(*node) {
                continue;
            }
            let text = place_text(last[node]);
            match stands.get(node) {
                Some(item) => changes.push((item.value.span.clone(), text)),
                None => added.push(format!("{}: {text}", quote(node))),
            }
        }
        if !added.is_empty() {
            changes.extend(self.draft.insertions(group, &added, false));
        }
        self.draft.change(changes);
        Ok(())
    }

    pub(in crate::document) fn set_note(&mut self, node: &str, note: &str) -> Result<(), EditError> {
        self.item(node)?;
        if note.is_empty() {
            self.drop_entry("notes", node);
        } else {
            self.set_entry("notes", node, &quote(note));
        }
        Ok(())
    }

    pub(in crate::document) fn set_reroutes(
        &mut self,
        node: &str,
        input: &str,
        places: &[[f64; 2]],
    ) -> Result<(), EditError> {
        self.item(node)?;
        let wire = format!("{node}.{input}");
        if places.is_empty() {
            self.drop_entry("reroutes", &wire);
        } else {
            let places: Vec<String> = places.iter().copied().map(place_text).collect();
            self.set_entry("reroutes", &wire, &format!("[{}]", places.join(", ")));
        }
        Ok(())
    }

    /// Removes everything on the canvas that belongs to a node being removed.
    pub(super) fn clear_canvas(&mut self, node: &str) {
        let keys = self.items("reroutes").iter().filter_map(|item| item.key.as_ref());
        let gone: Vec<String> = keys.filter(|key| node_of(&key.text) == node).map(|key| key.text.clone()).collect();
        for wire in gone {
            self.drop_entry("reroutes", &wire);
        }
        self.drop_entry("notes", node);
        self.remove_entry("layout", node);
    }

    /// Removes an entry, and its field with the last entry.
    fn drop_entry(&mut self, field: &str, name: &str) {
        if self.draft.field(field).is_some_and(|group| group.get(name).is_some()) {
            self.remove_entry(field, name);
            self.remove_empty(field);
        }
    }

    /// The changes that rename the entries of a node on the canvas.
    pub(super) fn renamed_on_canvas(&self, from: &str, to: &str) -> Vec<Change> {
        let keys = |field| self.items(field).iter().filter_map(|item| item.key.as_ref());
        let own = ["layout", "notes"].into_iter().flat_map(keys).filter(|key| key.text == from);
        let wires = keys("reroutes").filter(|key| node_of(&key.text) == from);
        own.chain(wires).map(|key| (key.span.clone(), quote(&format!("{to}{}", &key.text[from.len()..])))).collect()
    }

    pub(in crate::document) fn set_frame(&mut self, name: &str, frame: Option<&Frame>) -> Result<(), EditError> {
        let Some(frame) = frame else {
            self.frame(name)?;
            self.drop_entry("frames", name);
            return Ok(());
        };
        let fields = frame.fields();
        let group = |editor: &Self| {
            let item = editor.draft.field("frames")?.get(name)?;
            item.value.as_group().filter(|group| group.name.is_none() && group.bracket == Bracket::Round).cloned()
        };
        if group(self).is_none() {
            let said = fields.iter().filter_map(|(field, text)| Some(format!("{field}: {}", text.as_ref()?)));
            let text = format!("({})", said.collect::<Vec<_>>().join(", "));
            self.set_entry("frames", name, &text);
            return Ok(());
        }
        for (field, text) in fields {
            let Some(group) = group(self) else { break };
            let changes = match (text, group.position(field)) {
                (Some(text), Some(at)) => vec![(group.items[at].value.span.clone(), text)],
                (Some(text), None) => self.draft.insertion(&group, &format!("{field}: {text}"), false),
                (None, Some(at)) => self.draft.removal(&group, at),
                (None, None) => Vec::new(),
            };
            self.draft.change(changes);
        }
        Ok(())
    }

    pub(in crate::document) fn rename_frame(&mut self, from: &str, to: &str) -> Result<(), EditError> {
        let span = self.frame(from)?;
        if from != to && self.frame(to).is_ok() {
            return Err(refused(format!("there is a frame `{to}` already")));
        }
        self.draft.change(vec![(span, quote(to))]);
        Ok(())
    }

    /// The span of a frame's name.
    fn frame(&self, name: &str) -> Result<Range<usize>, EditError> {
        let item = self.draft.field("frames").and_then(|frames| frames.get(name));
        let key = item.and_then(|item| item.key.as_ref());
        key.map(|key| key.span.clone()).ok_or_else(|| EditError::UnknownFrame(name.to_owned()))
    }
}
