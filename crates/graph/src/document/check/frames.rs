//! Frames: named areas of the canvas, each with a note. They do not affect the build.

use std::ops::Range;

use super::problems::Problems;
use crate::document::syntax::{
    Expr, Item,
    lex::{Bracket, quote},
    literal::{Literal, number_text, pair},
};
use crate::{colour::Srgb, diagnostic::Diagnostic, unit::Unit};

/// The fields of a frame.
pub(crate) const FIELDS: [&str; 4] = ["at", "size", "note", "colour"];

/// An area of the canvas, drawn behind the nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Its upper left corner, in the coordinates of [`NodeEntry::layout`](crate::NodeEntry::layout).
    pub at: [f64; 2],
    /// Its width and height, above 0.
    pub size: [f64; 2],
    /// Its note, shown below its name; may be empty.
    pub note: String,
    /// Its own colour, if any.
    pub colour: Option<Srgb>,
}

/// A frame of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameEntry {
    /// Its name, which is its title.
    pub name: String,
    /// Position, size, note and colour.
    pub frame: Frame,
    /// Byte range of the entry.
    pub span: Range<usize>,
}

impl Frame {
    /// Its fields as written in a file; `None` for a field that is left out.
    pub(crate) fn fields(&self) -> [(&'static str, Option<String>); 4] {
        let pair = |[x, y]: [f64; 2]| Some(format!("({}, {})", number_text(x), number_text(y)));
        let note = (!self.note.is_empty()).then(|| quote(&self.note));
        let colour = self.colour.map(|colour| quote(&colour.to_string()));
        let [at, size, said, tint] = FIELDS;
        [(at, pair(self.at)), (size, pair(self.size)), (said, note), (tint, colour)]
    }
}

/// Reads a frame, or reports its problems.
pub(crate) fn read(name: &str, item: &Item, source: &str, problems: &mut Problems) -> Option<FrameEntry> {
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
                let message = format!("the frame `{name}` needs `at` and `size`");
                problems.push(Diagnostic::error("frame", item.span(), message).hint(format!("write {takes}")));
            }
            None
        }
    }
}
