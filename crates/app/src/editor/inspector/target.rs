//! The target of a row of the inspector: the value that it changes, and the edits that change it.

use orograph_graph::{Edit, ParamValue};

use super::{form::FormState, value::ValueChange};
use crate::editor::Session;

/// The value that a row changes.
#[derive(Clone, Debug)]
pub(super) enum Target {
    /// A parameter of a node.
    Param { node: String, name: String },
    /// An input of a node.
    Input { node: String, name: String },
    /// An exposed parameter of the file, with its places: each a parameter or an input of a node.
    Named { name: String, places: Vec<Self> },
    /// The same parameter or input of several nodes.
    Several { name: String, places: Vec<Self> },
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
            (Self::Named { places, .. } | Self::Several { places, .. }, _) => {
                Edit::All(places.iter().map(|place| place.set(value)).collect())
            }
        }
    }

    /// The edit that sets a typed text.
    fn text(&self, text: String) -> Edit {
        match self {
            Self::Param { node, name } | Self::Input { node, name } => {
                Edit::SetText { node: node.clone(), name: name.clone(), text }
            }
            Self::Named { name, .. } => Edit::SetNamed { name: name.clone(), text },
            Self::Several { places, .. } => Edit::All(places.iter().map(|place| place.text(text.clone())).collect()),
        }
    }

    /// Identifies the target.
    pub(super) fn key(&self) -> [&str; 2] {
        match self {
            Self::Param { node, name } | Self::Input { node, name } => [node, name],
            Self::Named { name, .. } | Self::Several { name, .. } => ["", name],
        }
    }

    /// The label of its row.
    pub(super) fn label(&self) -> &str {
        self.key()[1]
    }

    /// The edit that resets the value to its default.
    pub(super) fn reset(&self) -> Edit {
        match self {
            Self::Param { node, name } | Self::Input { node, name } => {
                Edit::Reset { node: node.clone(), name: name.clone() }
            }
            Self::Named { places, .. } | Self::Several { places, .. } => {
                Edit::All(places.iter().map(Self::reset).collect())
            }
        }
    }

    /// Carries out the change of a row.
    pub(super) fn carry_out(&self, asked: ValueChange, line: egui::Id, form: &mut FormState, session: &mut Session) {
        let edit = match asked {
            ValueChange::Drag(value) => {
                form.drag();
                session.gesture(&self.set(&value));
                return;
            }
            ValueChange::Set(value) => self.set(&value),
            ValueChange::Text(text) => self.text(text),
            ValueChange::Wrong(reason) => {
                form.judge(line, Err(reason));
                return;
            }
        };
        form.judge(line, session.attempt(&edit));
    }
}
