//! What a line of the form changes, and by which edits.

use orograph_graph::{Edit, ParamValue};

use super::{form::Form, value::Asked};
use crate::editor::Session;

/// What a line changes.
#[derive(Clone, Debug)]
pub(super) enum Target {
    /// A parameter of a node.
    Param { node: String, name: String },
    /// An input of a node.
    Input { node: String, name: String },
    /// A parameter of the file, with its places: each a node, a name, and whether that is an input.
    Named { name: String, places: Vec<Self> },
}

impl Target {
    /// The edit that sets a value.
    fn set(&self, value: &ParamValue) -> Edit {
        match (self, value) {
            (Self::Input { node, name }, ParamValue::Float(value)) => {
                Edit::SetConstant { node: node.clone(), input: name.clone(), value: *value }
            }
            (Self::Param { node, name } | Self::Input { node, name }, _) => {
                Edit::SetParam { node: node.clone(), param: name.clone(), value: value.clone() }
            }
            (Self::Named { places, .. }, _) => Edit::All(places.iter().map(|place| place.set(value)).collect()),
        }
    }

    /// The edit that sets what was typed.
    fn text(&self, text: String) -> Edit {
        match self {
            Self::Param { node, name } | Self::Input { node, name } => {
                Edit::SetText { node: node.clone(), name: name.clone(), text }
            }
            Self::Named { name, .. } => Edit::SetNamed { name: name.clone(), text },
        }
    }

    /// What tells it from others.
    pub(super) fn key(&self) -> [&str; 2] {
        match self {
            Self::Param { node, name } | Self::Input { node, name } => [node, name],
            Self::Named { name, .. } => ["", name],
        }
    }

    /// What its line is called.
    pub(super) fn label(&self) -> &str {
        self.key()[1]
    }

    /// The edit that takes back what the file says.
    pub(super) fn reset(&self) -> Edit {
        match self {
            Self::Param { node, name } | Self::Input { node, name } => {
                Edit::Reset { node: node.clone(), name: name.clone() }
            }
            Self::Named { places, .. } => Edit::All(places.iter().map(Self::reset).collect()),
        }
    }

    /// Does what was asked for at a line.
    pub(super) fn carry_out(&self, asked: Asked, line: egui::Id, form: &mut Form, session: &mut Session) {
        let edit = match asked {
            Asked::Drag(value) => {
                form.drag();
                session.gesture(&self.set(&value));
                return;
            }
            Asked::Set(value) => self.set(&value),
            Asked::Text(text) => self.text(text),
            Asked::Wrong(reason) => {
                form.judge(line, Err(reason));
                return;
            }
        };
        form.judge(line, session.attempt(&edit));
    }
}
