//! Edits of a document as data.

pub(crate) mod diff;
pub(crate) mod editor;
mod excerpt;
pub(crate) mod extract;
pub(crate) mod fresh;
pub(crate) mod history;
pub(crate) mod inline;
pub(crate) mod journal;
pub(crate) mod merge;
pub(crate) mod moved;

use self::editor::Editor;
use super::{
    check::frames::Frame,
    subgraph::Home,
    syntax::{lex::quote, splice::Draft},
};
use crate::{param::ParamValue, registry::Registry, world::World};

/// A change of a document.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// Adds a node with the defaults of its kind.
    AddNode {
        /// Its name: a letter, then letters, digits, `_` and `-`.
        name: String,
        /// Its kind.
        kind: String,
        /// Its position in the editor.
        at: Option<[f64; 2]>,
    },
    /// Adds a node as it is written in a file.
    AddWritten {
        /// Its name.
        name: String,
        /// Its kind with its brackets, such as `Ridged(wavelength: 6000)`.
        text: String,
        /// Its position in the editor.
        at: Option<[f64; 2]>,
    },
    /// Removes a node with its wires, its outputs and its position.
    RemoveNode {
        /// Its name.
        name: String,
    },
    /// Renames a node; wires, outputs and its position follow.
    RenameNode {
        /// The old name.
        from: String,
        /// The new name.
        to: String,
    },
    /// Sets a parameter; a default is not written.
    SetParam {
        /// The node.
        node: String,
        /// The parameter.
        param: String,
        /// Its value.
        value: ParamValue,
    },
    /// Sets a parameter or an input from typed text: `2 km`, `0.3`, `max`, `(1, 2)` or a wire `base.height`.
    SetText {
        /// The node.
        node: String,
        /// The parameter or input.
        name: String,
        /// The typed text, with or without quotes.
        text: String,
    },
    /// Sets a parameter of the file, at every place that it drives, from typed text.
    SetNamed {
        /// Its name in `parameters`.
        name: String,
        /// The typed text, with or without quotes.
        text: String,
    },
    /// Exposes a value of a node to users of the file: in `inputs` if it has a wire or accepts nothing else, in
    /// `parameters` otherwise. If the name exists already, it gets this place as an additional one.
    Expose {
        /// The node.
        node: String,
        /// The parameter or input.
        name: String,
        /// The exposed name.
        to: String,
    },
    /// Removes a name from the file's `parameters` or `inputs`; the values stay.
    Conceal {
        /// The name.
        name: String,
    },
    /// Renames an entry of the file's `parameters` or `inputs`.
    RenameNamed {
        /// The old name.
        from: String,
        /// The new name.
        to: String,
    },
    /// Replaces a place in the file's `parameters` or `inputs` with others. A place that is not there is left alone.
    MovePlace {
        /// The place: `node.name`.
        from: String,
        /// The places that its entry lists instead; those that it lists already are not repeated.
        to: Vec<String>,
    },
    /// Writes a node as the present version of its kind, with the same meaning.
    Migrate {
        /// The node.
        node: String,
    },
    /// Resets a parameter or an input to its default.
    Reset {
        /// The node.
        node: String,
        /// The parameter or input.
        name: String,
    },
    /// Wires an output to an input, replacing what the input had.
    Connect {
        /// The output: `node`, or `node.port`.
        from: String,
        /// The node that the wire leads into.
        to: String,
        /// Its input.
        input: String,
    },
    /// Removes the wire or the constant of an input.
    Disconnect {
        /// The node.
        node: String,
        /// Its input.
        input: String,
    },
    /// Sets an input to a number, replacing its wire; a default is not written.
    SetConstant {
        /// The node.
        node: String,
        /// Its input.
        input: String,
        /// The number, in the input's base unit.
        value: f64,
    },
    /// Adds an output of the file, or rewires it.
    SetOutput {
        /// Its name.
        name: String,
        /// The source: `node`, or `node.port`.
        from: String,
    },
    /// Removes an output of the file.
    RemoveOutput {
        /// Its name.
        name: String,
    },
    /// Renames an output of the file.
    RenameOutput {
        /// The old name.
        from: String,
        /// The new name.
        to: String,
    },
    /// Sets or removes an entry of the file's `expect`: the bounds of a measure, `in`, or `cell`.
    SetExpected {
        /// The measure, `in`, or `cell`.
        name: String,
        /// Typed numbers and quantities: two bounds for a measure, of which an empty one is an open side; four for `in`;
        /// one for `cell`. None keeps what is written. An empty list removes the entry.
        values: Vec<Option<String>>,
    },
    /// Sets size, cells, seed, boundary and sea level; unchanged fields are not touched.
    SetWorld(World),
    /// Sets or removes a node's position in the editor.
    SetLayout {
        /// The node.
        node: String,
        /// Its position.
        at: Option<[f64; 2]>,
    },
    /// Sets the note of a node on the canvas; an empty text removes it.
    SetNote {
        /// The node.
        node: String,
        /// The note.
        note: String,
    },
    /// Sets the points that a wire passes on the canvas, in order from its source; none for a straight wire.
    SetReroutes {
        /// The node that the wire leads into.
        node: String,
        /// Its input.
        input: String,
        /// The points.
        places: Vec<[f64; 2]>,
    },
    /// Mutes a node, so that the build bypasses it, or unmutes it.
    SetMuted {
        /// The node.
        node: String,
        /// True to mute it.
        muted: bool,
    },
    /// Adds, changes or removes a frame on the canvas.
    SetFrame {
        /// Its name.
        name: String,
        /// The new frame; `None` to remove it.
        frame: Option<Frame>,
    },
    /// Renames a frame.
    RenameFrame {
        /// The old name.
        from: String,
        /// The new name.
        to: String,
    },
    /// Several edits as one: all or none are applied, and they are undone together.
    All(Vec<Edit>),
}

/// Why an edit was refused. The document is unchanged.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EditError {
    /// The text has syntax errors, so that an edit could damage it.
    #[error("the file has syntax errors, which must be fixed by hand first: {0}")]
    Notation(String),
    /// There is no such node.
    #[error("there is no node `{name}`{}", hint_text(.suggestion.as_deref().map(|near| format!("did you mean `{near}`?")).as_deref()))]
    UnknownNode {
        /// The requested name.
        name: String,
        /// A similar name.
        suggestion: Option<String>,
    },
    /// The file has no such parameter.
    #[error("the file has no parameter `{name}`{}", hint_text(.hint.as_deref()))]
    UnknownParameter {
        /// The requested name.
        name: String,
        /// A similar name, or all names.
        hint: Option<String>,
    },
    /// There is no such output.
    #[error("there is no output `{0}`")]
    UnknownOutput(String),
    /// There is no such frame.
    #[error("there is no frame `{0}`")]
    UnknownFrame(String),
    /// The node is of a kind or version with unknown inputs and parameters.
    #[error("`{0}` is a node of a kind or version that this program does not know, so its values cannot be edited")]
    Placeholder(String),
    /// The file would become invalid.
    #[error("{message}{}", hint_text(.hint.as_deref()))]
    Refused {
        /// The problem.
        message: String,
        /// A possible remedy.
        hint: Option<String>,
    },
}

impl EditError {
    /// What is wrong, and the remedy, if there is one, which its text appends.
    #[must_use]
    pub fn into_parts(mut self) -> (String, Option<String>) {
        let hint = match &mut self {
            Self::UnknownNode { suggestion, .. } => suggestion.take().map(|near| format!("did you mean `{near}`?")),
            Self::UnknownParameter { hint, .. } | Self::Refused { hint, .. } => hint.take(),
            Self::Notation(_) | Self::UnknownOutput(_) | Self::UnknownFrame(_) | Self::Placeholder(_) => None,
        };
        (self.to_string(), hint)
    }
}

fn hint_text(hint: Option<&str>) -> String {
    hint.map_or_else(String::new, |hint| format!("; {hint}"))
}

impl Edit {
    /// Returns true if the edit changes names, so that messages about earlier problems may differ after it.
    pub(super) fn renames(&self) -> bool {
        match self {
            Self::RenameNode { .. }
            | Self::RenameOutput { .. }
            | Self::RenameFrame { .. }
            | Self::RenameNamed { .. } => true,
            Self::All(edits) => edits.iter().any(Self::renames),
            _ => false,
        }
    }

    /// The positions at the start of the edits, which are written together.
    fn places(edits: &[Self]) -> Vec<(&str, [f64; 2])> {
        let place = |edit| match edit {
            &Self::SetLayout { ref node, at: Some(at) } => Some((node.as_str(), at)),
            _ => None,
        };
        edits.iter().map_while(place).collect()
    }

    /// Applies the edit to the draft. The resulting file is checked afterwards.
    pub(super) fn carry_out(&self, draft: &mut Draft, registry: &Registry, home: &Home) -> Result<(), EditError> {
        let mut editor = Editor::new(draft, registry, home);
        match self {
            Self::AddNode { name, kind, at } => editor.add_node(name, kind, *at),
            Self::AddWritten { name, text, at } => editor.add_written(name, text, *at),
            Self::RemoveNode { name } => editor.remove_node(name),
            Self::RenameNode { from, to } => editor.rename_node(from, to),
            Self::SetParam { node, param, value } => editor.set_param(node, param, value),
            Self::SetText { node, name, text } => editor.set_text(node, name, text),
            Self::SetNamed { name, text } => editor.set_named(name, text),
            Self::Expose { node, name, to } => editor.expose(node, name, to),
            Self::Conceal { name } => editor.conceal(name),
            Self::RenameNamed { from, to } => editor.rename_named(from, to),
            Self::MovePlace { from, to } => {
                editor.move_place(from, to);
                Ok(())
            }
            Self::Migrate { node } => editor.current(node).map(drop),
            Self::Reset { node, name } | Self::Disconnect { node, input: name } => editor.reset(node, name),
            Self::Connect { from, to, input } => {
                let wire = quote(&editor.short_wire(from));
                editor.set(to, input, &wire)
            }
            Self::SetConstant { node, input, value } => editor.set_constant(node, input, *value),
            Self::SetOutput { name, from } => {
                let wire = quote(&editor.short_wire(from));
                editor.set_entry("outputs", name, &wire);
                Ok(())
            }
            Self::RemoveOutput { name } => editor.remove_output(name),
            Self::RenameOutput { from, to } => editor.rename_output(from, to),
            Self::SetExpected { name, values } => editor.set_expected(name, values),
            Self::SetWorld(world) => editor.set_world(world),
            Self::SetLayout { node, at } => {
                editor.item(node)?;
                editor.set_layout(node, *at);
                Ok(())
            }
            Self::SetNote { node, note } => editor.set_note(node, note),
            Self::SetReroutes { node, input, places } => editor.set_reroutes(node, input, places),
            Self::SetMuted { node, muted } => editor.set_muted(node, *muted),
            Self::SetFrame { name, frame } => editor.set_frame(name, frame.as_ref()),
            Self::RenameFrame { from, to } => editor.rename_frame(from, to),
            Self::All(edits) => {
                let mut rest = edits.as_slice();
                while let Some(edit) = rest.first() {
                    let places = Self::places(rest);
                    if places.len() > 1 {
                        Editor::new(draft, registry, home).set_places(&places)?;
                    } else {
                        edit.carry_out(draft, registry, home)?;
                    }
                    rest = &rest[places.len().max(1)..];
                }
                Ok(())
            }
        }
    }
}
