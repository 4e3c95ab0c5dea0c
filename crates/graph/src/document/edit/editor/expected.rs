//! Edits of what a file expects of its terrain.

use super::{Editor, refused};
use crate::document::{
    edit::EditError,
    syntax::{Expr, lex::quote, literal::Literal, parse_value},
};

/// The field of the file.
const FIELD: &str = "expect";

impl Editor<'_> {
    /// Sets the values of an entry of `expect`, of which `None` stays as it is written; without values, removes it.
    pub(in crate::document) fn set_expected(&mut self, name: &str, values: &[Option<String>]) -> Result<(), EditError> {
        let entry = self.draft.field(FIELD).and_then(|group| group.get(name));
        if values.is_empty() {
            if entry.is_none() {
                return Err(refused(format!("`expect` has no entry `{name}`")));
            }
            self.remove_entry(FIELD, name);
            self.remove_empty(FIELD);
            return Ok(());
        }
        let written = entry.map(|item| parts(&item.value)).filter(|parts| parts.len() == values.len());
        if let Some(parts) = written {
            let spans = parts.iter().map(|part| part.span.clone());
            let changed = spans.zip(values).enumerate();
            let changed = changed.filter_map(|(at, (span, value))| Some((span, notation(at, value.as_deref()?))));
            let changes = changed.collect();
            self.draft.change(changes);
            return Ok(());
        }
        let texts: Vec<String> =
            values.iter().enumerate().map(|(at, value)| notation(at, value.as_deref().unwrap_or_default())).collect();
        let text = if let [only] = &texts[..] { only.clone() } else { format!("({})", texts.join(", ")) };
        self.set_entry(FIELD, name, &text);
        Ok(())
    }
}

/// The values of an entry: those in its brackets, or itself.
fn parts(value: &Expr) -> Vec<&Expr> {
    match value.as_group() {
        Some(group) => group.items.iter().map(|item| &item.value).collect(),
        None => vec![value],
    }
}

/// A typed value as a file states it: a number as it is, anything else in quotes. An empty text is an open side.
fn notation(at: usize, typed: &str) -> String {
    let typed = typed.trim();
    let is_number = parse_value(typed).is_some_and(|expr| matches!(Literal::read(&expr, typed), Literal::Number(..)));
    match typed {
        "" if at == 0 => "-inf".to_owned(),
        "" => "inf".to_owned(),
        number if is_number => number.to_owned(),
        quantity => quote(quantity),
    }
}
