//! Merging two changes of one text: the changes made here are applied to the other text.
//!
//! The texts are compared item by item along their trees (fields of the file, nodes, and the contents of the nodes'
//! brackets), not line by line. The result is the other text, with its comments and its order, with the items that were
//! changed here. An item that both changed in different ways is a merge conflict, except for its position on the
//! canvas.

use super::history::added;
use crate::document::{
    Document,
    syntax::{
        Expr, Group,
        format::inline,
        lex::{Bracket, quote},
        parse,
        splice::Draft,
    },
};

/// Fields that do not affect the build, so that conflicts in them are resolved without asking.
const ON_CANVAS: [&str; 4] = ["layout", "reroutes", "notes", "frames"];

/// Empty brackets.
static NONE: Group = Group { name: None, bracket: Bracket::Round, open: 0, close: None, items: Vec::new() };

/// A text to compare.
#[derive(Clone, Copy)]
struct Side<'a> {
    source: &'a str,
    value: Option<&'a Expr>,
}

impl<'a> Side<'a> {
    /// Its contents, without white space and comments.
    fn said(&self) -> Option<String> {
        self.value.map(|value| inline(value, self.source))
    }

    /// Its brackets, if all items in them have names.
    fn group(&self) -> Option<&'a Group> {
        let group = self.value?.as_group()?;
        (group.bracket != Bracket::Square && group.items.iter().all(|item| item.key.is_some())).then_some(group)
    }

    fn within(&self, group: &'a Group, name: &str) -> Self {
        Self { value: group.get(name).map(|item| &item.value), ..*self }
    }

    /// The word before its brackets.
    fn word(&self, group: &Group) -> Option<&'a str> {
        group.name.clone().map(|name| &self.source[name])
    }
}

/// A change made here: the path of names from the outermost brackets, and the new value; `None` if it was removed.
type Change = (Vec<String>, Option<String>);

#[derive(Default)]
struct Comparison {
    changes: Vec<Change>,
    conflicts: Vec<String>,
}

impl Comparison {
    fn compare(&mut self, path: &[String], base: Side<'_>, mine: Side<'_>, theirs: Side<'_>) {
        let (was, here, there) = (base.said(), mine.said(), theirs.said());
        if here == was || here == there {
            return;
        }
        // Names that only the other text has need no change.
        if let (Some(ours), Some(others)) = (mine.group(), theirs.group())
            && ours.bracket == others.bracket
            && mine.word(ours) == theirs.word(others)
            && (base.value.is_none() || base.group().is_some_and(|group| base.word(group) == mine.word(ours)))
        {
            let before = base.group().unwrap_or(&NONE);
            let mut names: Vec<&str> = Vec::new();
            for key in before.items.iter().chain(&ours.items).filter_map(|item| item.key.as_ref()) {
                if !names.contains(&key.text.as_str()) {
                    names.push(&key.text);
                }
            }
            for name in names {
                let path: Vec<String> = path.iter().cloned().chain([name.to_owned()]).collect();
                self.compare(&path, base.within(before, name), mine.within(ours, name), theirs.within(others, name));
            }
        } else if there == was || path.first().is_some_and(|field| ON_CANVAS.contains(&field.as_str())) {
            let text = mine.value.map(|value| mine.source[value.span.clone()].to_owned());
            self.changes.push((path.to_vec(), text));
        } else {
            let named = if path.first().is_some_and(|field| field == "nodes") { &path[1..] } else { path };
            self.conflicts.push(if named.is_empty() { "the whole file".to_owned() } else { named.join(".") });
        }
    }
}

impl Document {
    /// Merges the changes made here and those made in `theirs`, both since `base`, into one text.
    ///
    /// # Errors
    /// The merge conflicts, such as `rivers.duration`, or the reason why the two versions cannot be merged.
    pub fn merge(&self, base: &str, theirs: &str) -> Result<String, Vec<String>> {
        let [was, here, there] = [base, self.source(), theirs].map(parse);
        if [&was, &here, &there].iter().any(|(_, mistakes)| !mistakes.is_empty()) {
            return Err(vec!["the whole file, since one of the two versions has syntax errors".to_owned()]);
        }
        let mut found = Comparison::default();
        let side = |source, value| Side { source, value };
        found.compare(
            &[],
            side(base, was.0.root.as_ref()),
            side(self.source(), here.0.root.as_ref()),
            side(theirs, there.0.root.as_ref()),
        );
        if !found.conflicts.is_empty() {
            return Err(found.conflicts);
        }
        let mut draft = Draft::new(theirs);
        for (path, text) in found.changes {
            put(&mut draft, &path, text);
        }
        let read = |source: &str| Self::with_home(source.to_owned(), &self.registry, self.home.clone());
        let (merged, theirs) = (read(&draft.source), read(theirs));
        match added(theirs.problems(), merged.problems(), false)
            .filter(|_| added(self.problems(), merged.problems(), false).is_some())
        {
            Some(problem) => Err(vec![problem.message.clone()]),
            None => Ok(draft.source),
        }
    }
}

/// Applies a change.
fn put(draft: &mut Draft, path: &[String], text: Option<String>) {
    let Some((name, around)) = path.split_last() else { return };
    let mut group = draft.root();
    for name in around {
        group = group.and_then(|group| group.get(name)?.value.as_group());
    }
    let Some(group) = group else { return };
    let changes = match (text, group.position(name)) {
        (Some(text), Some(at)) => vec![(group.items[at].value.span.clone(), text)],
        (Some(text), None) => {
            let key = if group.bracket == Bracket::Curly { quote(name) } else { name.clone() };
            draft.insertion(group, &format!("{key}: {text}"), around.len() < 2)
        }
        (None, Some(at)) => draft.removal(group, at),
        (None, None) => Vec::new(),
    };
    draft.change(changes);
}
