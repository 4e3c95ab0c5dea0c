//! Edits of a document as data.

use super::{editor::Editor, frames::Frame, lex::quote, splice::Draft, subgraph::Home};
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
        /// Where an editor shows it.
        at: Option<[f64; 2]>,
    },
    /// Adds a node as it is written in a file.
    AddWritten {
        /// Its name.
        name: String,
        /// Its kind with its brackets, such as `Ridged(wavelength: 6000)`.
        text: String,
        /// Where an editor shows it.
        at: Option<[f64; 2]>,
    },
    /// Removes a node with its wires, its outputs and its place.
    RemoveNode {
        /// Its name.
        name: String,
    },
    /// Gives a node another name; wires, outputs and its place follow.
    RenameNode {
        /// The name it has.
        from: String,
        /// The name it gets.
        to: String,
    },
    /// Sets a parameter; its default is not written.
    SetParam {
        /// The node.
        node: String,
        /// The parameter.
        param: String,
        /// Its value.
        value: ParamValue,
    },
    /// Sets a parameter or an input from what a person typed: `2 km`, `0.3`, `max`, `(1, 2)` or a wire `base.height`.
    SetText {
        /// The node.
        node: String,
        /// The parameter or input.
        name: String,
        /// What was typed, with or without quotes.
        text: String,
    },
    /// Sets a parameter of the file, at every place that it drives, from what a person typed.
    SetNamed {
        /// Its name in `parameters`.
        name: String,
        /// What was typed, with or without quotes.
        text: String,
    },
    /// Gives a value of a node a name of the file, which its users set or wire: in `inputs` what has a wire or takes nothing
    /// else, in `parameters` the rest. Where the name stands there already it leads to this place as well.
    Expose {
        /// The node.
        node: String,
        /// The parameter or input.
        name: String,
        /// The name it gets.
        to: String,
    },
    /// Takes a name out of the file's `parameters` or `inputs`; the values stay.
    Conceal {
        /// The name.
        name: String,
    },
    /// Gives an entry of the file's `parameters` or `inputs` another name.
    RenameNamed {
        /// The name it has.
        from: String,
        /// The name it gets.
        to: String,
    },
    /// Takes back what the file says of a parameter or an input.
    Reset {
        /// The node.
        node: String,
        /// The parameter or input.
        name: String,
    },
    /// Wires an output to an input, in place of what the input had.
    Connect {
        /// The output: `node`, or `node.port`.
        from: String,
        /// The node that takes it.
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
    /// Gives an input a number in place of a wire; its default is not written.
    SetConstant {
        /// The node.
        node: String,
        /// Its input.
        input: String,
        /// The number, in the input's base unit.
        value: f64,
    },
    /// Adds an output of the file, or wires it anew.
    SetOutput {
        /// Its name.
        name: String,
        /// What is written: `node`, or `node.port`.
        from: String,
    },
    /// Removes an output of the file.
    RemoveOutput {
        /// Its name.
        name: String,
    },
    /// Gives an output of the file another name.
    RenameOutput {
        /// The name it has.
        from: String,
        /// The name it gets.
        to: String,
    },
    /// Sets extent, cells, seed, boundary and sea level; what stays the same is not touched.
    SetWorld(World),
    /// Sets where an editor shows a node, or forgets it.
    SetLayout {
        /// The node.
        node: String,
        /// Its place.
        at: Option<[f64; 2]>,
    },
    /// Sets what is told of a node on the canvas; an empty text for nothing.
    SetNote {
        /// The node.
        node: String,
        /// What is told.
        note: String,
    },
    /// Sets the places that the wire into an input passes on the canvas, in the order from its source; none for a straight way.
    SetReroutes {
        /// The node that takes the wire.
        node: String,
        /// Its input.
        input: String,
        /// The places.
        places: Vec<[f64; 2]>,
    },
    /// Mutes a node, so that it is built as if it were not there, or takes that back.
    SetMuted {
        /// The node.
        node: String,
        /// Whether it is to be muted.
        muted: bool,
    },
    /// Adds a frame to the canvas, changes it, or removes it.
    SetFrame {
        /// Its name.
        name: String,
        /// What it is to be; `None` for nothing.
        frame: Option<Frame>,
    },
    /// Gives a frame another name.
    RenameFrame {
        /// The name it has.
        from: String,
        /// The name it gets.
        to: String,
    },
    /// Several edits as one: all or none are made, and they are undone together.
    All(Vec<Edit>),
}

/// Why an edit was refused. The document is as it was.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EditError {
    /// The text cannot be read everywhere, so that a change might spoil it.
    #[error("the file has mistakes of notation that must be repaired by hand first: {0}")]
    Notation(String),
    /// There is no such node.
    #[error("there is no node `{name}`{}", hint_text(.suggestion.as_deref().map(|near| format!("did you mean `{near}`?")).as_deref()))]
    UnknownNode {
        /// The name asked for.
        name: String,
        /// A name that is near.
        suggestion: Option<String>,
    },
    /// The file has no such parameter.
    #[error("the file has no parameter `{name}`{}", hint_text(.hint.as_deref()))]
    UnknownParameter {
        /// The name asked for.
        name: String,
        /// A name that is near, or all there are.
        hint: Option<String>,
    },
    /// There is no such output.
    #[error("there is no output `{0}`")]
    UnknownOutput(String),
    /// There is no such frame.
    #[error("there is no frame `{0}`")]
    UnknownFrame(String),
    /// What stands there is no node whose inputs and parameters are known.
    #[error("`{0}` is a node of a kind or version that this program does not know, so its values cannot be edited")]
    Placeholder(String),
    /// The file would be wrong.
    #[error("{message}{}", hint_text(.hint.as_deref()))]
    Refused {
        /// What would be wrong.
        message: String,
        /// What can be done about it.
        hint: Option<String>,
    },
}

fn hint_text(hint: Option<&str>) -> String {
    hint.map_or_else(String::new, |hint| format!("; {hint}"))
}

impl Edit {
    /// Whether it changes names, so that messages about what was wrong before may read differently after it.
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

    /// The places that edits begin with, which are written together.
    fn places(edits: &[Self]) -> Vec<(&str, [f64; 2])> {
        let place = |edit| match edit {
            &Self::SetLayout { ref node, at: Some(at) } => Some((node.as_str(), at)),
            _ => None,
        };
        edits.iter().map_while(place).collect()
    }

    /// Changes the draft. What it makes of the file is checked afterwards.
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
