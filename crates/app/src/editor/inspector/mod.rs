//! The inspector of the selection, generated from the declaration of the node type: no node is named here.
//!
//! [`form`] lays out rows and holds the text being typed; [`value`] has a widget for every kind of parameter; [`node`]
//! shows the selected node, `file` the settings of the file while nothing is selected.

mod column;
mod curves;
mod expected;
mod eyedropper;
mod file;
mod form;
mod gradient;
mod histogram;
mod manual;
mod node;
mod note;
mod number;
mod outputs;
mod pad;
mod place;
mod row;
mod several;
mod shown;
mod target;
mod value;
mod waypoints;

pub(super) use number::short;

use super::Session;
use form::FormState;

/// The inspector.
#[derive(Debug, Default)]
pub(super) struct Inspector {
    form: FormState,
    /// The subject of the form: a node, or the file.
    about: Option<String>,
    kind: Kind,
    kept: Option<shown::Kept>,
    note: Option<note::Draft>,
}

/// What a form is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Kind {
    #[default]
    File,
    Node,
    Several,
}

impl Kind {
    const fn of(about: Option<&str>, selected: usize) -> Self {
        match (about, selected) {
            (Some(_), _) => Self::Node,
            (None, 0) => Self::File,
            (None, _) => Self::Several,
        }
    }
}

impl Inspector {
    pub(super) fn ui(&mut self, ui: &mut egui::Ui, session: &mut Session) {
        let mut about = session.selected().map(str::to_owned);
        let mut count = session.selection().count();
        let kind = Kind::of(about.as_deref(), count);
        let is_there = |node: &String| session.document().nodes().iter().any(|entry| entry.name == *node);
        if (about != self.about || kind != self.kind)
            && self.form.leave(ui)
            && self.kind != Kind::Several
            && self.about.as_ref().is_none_or(is_there)
        {
            // A value typed for another node, or for the file, is not lost: its field ends in this frame.
            (about, count) = (self.about.clone(), usize::from(self.about.is_some()));
            ui.ctx().request_repaint();
        } else if about != self.about || kind != self.kind {
            self.form.forget();
            self.kind = kind;
            // Text typed for another node is not lost.
            if let Some(note) = self.note.take() {
                note.take(session);
            }
            self.about.clone_from(&about);
        }
        let area = egui::ScrollArea::vertical().id_salt(&about).auto_shrink(false);
        area.show(ui, |ui| {
            egui::Frame::new().inner_margin(egui::Margin::symmetric(10, 8)).show(ui, |ui| {
                // Rows are laid out in the width of the frame, whatever they contain.
                ui.set_max_width(ui.available_width());
                ui.spacing_mut().item_spacing.y = 3.0;
                match (about, count) {
                    (Some(name), _) => {
                        node::show(ui, &mut self.form, (&mut self.kept, &mut self.note), session, &name);
                    }
                    (None, 0) => file::show(ui, &mut self.form, session),
                    _ => several::show(ui, &mut self.form, session),
                }
            });
        });
        self.form.settle(ui, session);
    }
}
