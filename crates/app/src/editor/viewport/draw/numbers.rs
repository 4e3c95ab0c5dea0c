//! Fields for the numbers of a handle, next to it: the coordinates of a point, the length and direction of an arm.

use egui::{Area, Frame, Id, Key, Order, Pos2, RichText, TextEdit, Ui};
use orograph_graph::Unit;

use super::{handles::Grip, keys};
use crate::editor::{Session, arithmetic::calculated};

/// Width of a field in points.
const WIDTH: f32 = 90.0;

/// The open fields.
#[derive(Debug)]
pub(super) struct Numbers {
    node: String,
    pub(super) grip: Grip,
    fields: Vec<Field>,
    /// Why the typed text is no value.
    wrong: Option<String>,
    /// True before the fields are drawn for the first time.
    is_new: bool,
}

#[derive(Debug)]
struct Field {
    name: String,
    unit: Unit,
    /// The value as text, and the text in the field.
    before: String,
    text: String,
}

impl Numbers {
    /// Fields with the numbers of a handle of the selected node. Returns None when it has none.
    pub(super) fn of(grip: &Grip, session: &Session) -> Option<Self> {
        let node = session.selected()?;
        let field = |(name, unit, value): (String, Unit, f64)| {
            let before = unit.display(value);
            Field { name, unit, text: before.clone(), before }
        };
        let fields = keys::numbers(node, grip, session)?.into_iter().map(field).collect();
        Some(Self { node: node.to_owned(), grip: grip.clone(), fields, wrong: None, is_new: true })
    }

    /// Shows the fields, which close when another node is selected. Returns None while they stay open; otherwise whether
    /// the handle has the keyboard again.
    pub(super) fn ui(&mut self, ui: &Ui, at: Pos2, session: &mut Session) -> Option<bool> {
        let [escape, enter] = [Key::Escape, Key::Enter].map(|key| ui.input(|input| input.key_pressed(key)));
        let (mut has_focus, mut left) = (self.is_new, false);
        Area::new(Id::new("numbers of a handle")).order(Order::Foreground).fixed_pos(at).show(ui.ctx(), |ui| {
            Frame::popup(ui.style()).show(ui, |ui| {
                ui.horizontal(|ui| {
                    for (index, field) in self.fields.iter_mut().enumerate() {
                        let label = ui.label(&field.name);
                        let edit = TextEdit::singleline(&mut field.text).desired_width(WIDTH);
                        let response = ui.add(edit).labelled_by(label.id);
                        if self.is_new && index == 0 {
                            response.request_focus();
                        }
                        has_focus |= response.has_focus() || response.gained_focus();
                        left |= response.lost_focus();
                    }
                });
                if let Some(wrong) = &self.wrong {
                    ui.label(RichText::new(wrong).small().color(ui.visuals().error_fg_color));
                }
            });
        });
        self.is_new = false;
        let is_selected = session.selected() == Some(self.node.as_str());
        if has_focus && is_selected {
            return None;
        }
        if left && escape {
            return Some(true);
        }
        match self.apply(session) {
            Ok(()) => Some(enter && is_selected),
            Err(wrong) if enter && is_selected => {
                (self.wrong, self.is_new) = (Some(wrong), true);
                None
            }
            Err(wrong) => {
                session.note(wrong, true);
                Some(false)
            }
        }
    }

    /// Writes the typed numbers, if any is new and the handle still exists.
    fn apply(&self, session: &mut Session) -> Result<(), String> {
        if self.fields.iter().all(|field| field.text.trim() == field.before) {
            return Ok(());
        }
        // what was not typed keeps its digits
        let Some(now) = keys::numbers(&self.node, &self.grip, session) else { return Ok(()) };
        let value = |(at, field): (usize, &Field)| match now.get(at) {
            Some((.., value)) if field.text.trim() == field.before => Ok(*value),
            _ => field.unit.parse(&calculated(field.unit, field.text.trim())),
        };
        let values = self.fields.iter().enumerate().map(value).collect::<Result<Vec<f64>, _>>();
        let values = values.map_err(|error| error.to_string())?;
        if keys::set_numbers(&self.node, &self.grip, &values, session) {
            Ok(())
        } else {
            Err("the value is out of range".to_owned())
        }
    }
}
