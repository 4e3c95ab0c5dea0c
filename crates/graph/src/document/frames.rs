//! Frames: named areas of the canvas, with a note each. They change nothing of what is built.

use std::ops::Range;

use super::{
    lex::{Bracket, quote},
    literal::{Literal, number_text, pair},
    problems::Problems,
    syntax::{Expr, Item},
};
use crate::{colour::Srgb, diagnostic::Diagnostic, unit::Unit};

/// The fields of a frame.
pub(super) const FIELDS: [&str; 4] = ["at", "size", "note", "colour"];

/// An area of the canvas, drawn behind the nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Its upper left corner, where [`NodeEntry::layout`](crate::NodeEntry::layout) places nodes.
    pub at: [f64; 2],
    /// Its width and height, above 0.
    pub size: [f64; 2],
    /// What it says below its name; empty for nothing.
    pub note: String,
    /// Its colour, if it has one of its own.
    pub colour: Option<Srgb>,
}

/// A frame of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameEntry {
    /// Its name, which is its title.
    pub name: String,
    /// What it is.
    pub frame: Frame,
    /// Bytes of the entry.
    pub span: Range<usize>,
}

impl Frame {
    /// Its fields as they are written; `None` for one that is not.
    pub(super) fn fields(&self) -> [(&'static str, Option<String>); 4] {
        let pair = |[x, y]: [f64; 2]| Some(format!("({}, {})", number_text(x), number_text(y)));
        let note = (!self.note.is_empty()).then(|| quote(&self.note));
        let colour = self.colour.map(|colour| quote(&colour.to_string()));
        let [at, size, said, tint] = FIELDS;
        [(at, pair(self.at)), (size, pair(self.size)), (said, note), (tint, colour)]
    }
}

/// Reads a frame, or reports what is wrong with it.
pub(super) fn read(name: &str, item: &Item, source: &str, problems: &mut Problems) -> Option<FrameEntry> {
    let takes = "a frame such as `(at: (0, 0), size: (400, 300), note: \"…\")`";
    let group = item.value.as_group().filter(|group| group.name.is_none() && group.bracket == Bracket::Round);
    let Some(group) = group else {
        problems.misplaced(&item.value, name, takes, source);
        return None;
    };
    problems.names(group, "a frame", &FIELDS);
    let mut sound = true;
    let mut wrong = |value: &Expr, field: &str, takes: &str, problems: &mut Problems| {
        sound = false;
        problems.misplaced(value, field, takes, source);
    };
    let mut places = [None; 2];
    for (place, field) in places.iter_mut().zip(FIELDS) {
        if let Some(item) = group.get(field) {
            let literal = Literal::read(&item.value, source);
            match pair(field, Unit::One, &literal) {
                Some(Ok(value)) if field == "at" || value.iter().all(|side| *side > 0.0) => *place = Some(value),
                _ => wrong(&item.value, field, "a pair of numbers, those of `size` above 0", problems),
            }
        }
    }
    let mut texts = [None, None];
    for (text, field) in texts.iter_mut().zip(&FIELDS[2..]) {
        if let Some(item) = group.get(field) {
            match Literal::read(&item.value, source) {
                Literal::Text(said) => *text = Some((said, &item.value)),
                _ => wrong(&item.value, field, "a text in quotes", problems),
            }
        }
    }
    let [note, colour] = texts;
    let colour = colour.and_then(|(text, value)| match text.parse() {
        Ok(colour) => Some(colour),
        Err(_) => {
            wrong(value, "colour", "a colour such as \"#7a9e77\"", problems);
            None
        }
    });
    match places {
        [Some(at), Some(size)] => {
            let note = note.map(|(text, _)| text).unwrap_or_default();
            Some(FrameEntry { name: name.to_owned(), frame: Frame { at, size, note, colour }, span: item.span() })
        }
        _ => {
            if sound && !problems.has_syntax_in(&item.span()) {
                let message = format!("the frame `{name}` does not say where it is");
                problems.push(Diagnostic::error("frame", item.span(), message).hint(format!("write {takes}")));
            }
            None
        }
    }
}
