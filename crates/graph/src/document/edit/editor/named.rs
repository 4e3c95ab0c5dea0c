//! Edits of the names that a file exposes.

use super::{Editor, node_of, values::has_value, wire_end};
use crate::{
    closest,
    document::{
        check::{
            args::kind_of,
            exposed::{Section, is_list, places, places_of},
            problems,
        },
        edit::EditError,
        syntax::lex::quote,
    },
    node::Fallback,
};

impl Editor<'_> {
    /// Removes the places of a node from the file's `inputs` and `parameters`, and the names that have no other place.
    pub(super) fn forget_places(&mut self, node: &str) {
        for section in Section::ALL {
            loop {
                let found = self.items(section.field()).iter().enumerate().find_map(|(position, item)| {
                    let all = places(&item.value, section, &self.draft.source);
                    let gone = all.iter().find(|(text, _)| node_of(text) == node).map(|(_, span)| span.clone())?;
                    Some((position, item.value.span.clone(), gone, all.len()))
                });
                let Some((position, value, gone, count)) = found else { break };
                let Some(group) = self.draft.field(section.field()) else { break };
                let changes = match count {
                    1 => self.draft.removal(group, position),
                    _ => self.draft.removal_within(value, &gone),
                };
                if changes.is_empty() {
                    break;
                }
                self.draft.change(changes);
            }
        }
    }

    /// Replaces a place with others, except for those that its entry lists already.
    pub(in crate::document) fn move_place(&mut self, from: &str, to: &[String]) {
        for section in Section::ALL {
            let found = self.items(section.field()).iter().find_map(|item| {
                let all = places(&item.value, section, &self.draft.source);
                let (_, span) = all.iter().find(|(text, _)| text == from)?.clone();
                let new: Vec<String> =
                    to.iter().filter(|to| all.iter().all(|(text, _)| text != *to)).map(|to| quote(to)).collect();
                let listed = places_of(&item.value, section)?.as_group().is_some_and(is_list);
                Some((item.value.span.clone(), span, new, listed))
            });
            let Some((value, span, new, listed)) = found else { continue };
            let changes = match new.as_slice() {
                [] => self.draft.removal_within(value, &span),
                [one] => vec![(span, one.clone())],
                many if listed => vec![(span, many.join(", "))],
                many => vec![(span, format!("[{}]", many.join(", ")))],
            };
            self.draft.change(changes);
        }
    }

    /// Sets a parameter of the file at all its places.
    pub(in crate::document) fn set_named(&mut self, name: &str, text: &str) -> Result<(), EditError> {
        let section = Section::Parameters;
        let Some(item) = self.draft.field(section.field()).and_then(|group| group.get(name)) else {
            return Err(self.unknown_name(name, &[section]));
        };
        for (place, _) in places(&item.value, section, &self.draft.source) {
            if let Some((node, part)) = place.split_once('.') {
                self.set_text(node, part, text)?;
            }
        }
        Ok(())
    }

    /// The error that no entry has this name, with a similar name, or all names.
    fn unknown_name(&self, name: &str, sections: &[Section]) -> EditError {
        let items = sections.iter().flat_map(|section| self.items(section.field()));
        let names: Vec<&str> = items.filter_map(|item| Some(item.key.as_ref()?.text.as_str())).collect();
        let hint = match closest(name, names.iter().copied()) {
            Some(near) => Some(format!("did you mean `{near}`?")),
            None if names.is_empty() => Some("write `node.param`".to_owned()),
            None => Some(format!("it has {}", problems::list(names))),
        };
        EditError::UnknownParameter { name: name.to_owned(), hint }
    }

    /// Exposes a value of a node.
    pub(in crate::document) fn expose(&mut self, node: &str, name: &str, to: &str) -> Result<(), EditError> {
        let kind = self.current(node)?;
        has_value(kind, node, name)?;
        let body = kind_of(&self.item(node)?.value).and_then(|(_, group)| group);
        let wired =
            body.and_then(|group| group.get(name)).and_then(|item| wire_end(item, &self.draft.source)).is_some();
        let section = match kind.input(name) {
            Some(input) if wired || !matches!(input.fallback, Fallback::Constant { .. }) => Section::Inputs,
            _ => Section::Parameters,
        };
        let place = quote(&format!("{node}.{name}"));
        let Some(item) = self.draft.field(section.field()).and_then(|group| group.get(to)) else {
            self.insert_entry(section.field(), to, &place);
            return Ok(());
        };
        let Some(said) = places_of(&item.value, section) else { return Ok(()) };
        let changes = match said.as_group().filter(|group| is_list(group)) {
            Some(group) => self.draft.insertion(group, &place, false),
            None => vec![(said.span.clone(), format!("[{}, {place}]", &self.draft.source[said.span.clone()]))],
        };
        self.draft.change(changes);
        Ok(())
    }

    /// The section that contains a name.
    fn section_of(&self, name: &str) -> Result<Section, EditError> {
        let stands =
            |section: &Section| self.draft.field(section.field()).is_some_and(|group| group.get(name).is_some());
        Section::ALL.into_iter().find(stands).ok_or_else(|| self.unknown_name(name, &Section::ALL))
    }

    pub(in crate::document) fn conceal(&mut self, name: &str) -> Result<(), EditError> {
        let section = self.section_of(name)?;
        self.remove_entry(section.field(), name);
        Ok(())
    }

    pub(in crate::document) fn rename_named(&mut self, from: &str, to: &str) -> Result<(), EditError> {
        let section = self.section_of(from)?;
        let key =
            self.draft.field(section.field()).and_then(|group| group.get(from)).and_then(|item| item.key.as_ref());
        if let Some(span) = key.map(|key| key.span.clone()) {
            self.draft.change(vec![(span, quote(to))]);
        }
        Ok(())
    }
}
