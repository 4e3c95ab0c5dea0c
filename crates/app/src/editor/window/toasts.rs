//! Messages, shown over the lower edge of the window for a while.

use egui::{Align2, Area, Color32, Frame, Id, Order, RichText, Sense, Stroke, vec2};

use crate::editor::{Note, Session};

/// How long a message is shown, and how long an error is, in seconds.
const SHOWN: [f64; 2] = [3.5, 7.0];
/// Maximum number of messages shown at once.
const MOST: usize = 4;

/// A message on the screen.
#[derive(Debug)]
struct Toast {
    note: Note,
    /// How often it was repeated.
    count: usize,
    until: f64,
}

/// The messages on the screen, the oldest first.
#[derive(Debug, Default)]
pub(crate) struct Toasts {
    shown: Vec<Toast>,
}

impl Toasts {
    pub(crate) fn ui(&mut self, context: &egui::Context, session: &mut Session) {
        let now = context.input(|input| input.time);
        self.shown.retain(|toast| toast.until > now);
        for note in session.take_notes() {
            let until = now + SHOWN[usize::from(note.error)];
            match self.shown.iter_mut().find(|toast| toast.note == note) {
                Some(toast) => {
                    toast.count += 1;
                    toast.until = until;
                }
                None => self.shown.push(Toast { note, count: 1, until }),
            }
        }
        let surplus = self.shown.len().saturating_sub(MOST);
        self.shown.drain(..surplus);
        let Some(next) = self.shown.iter().map(|toast| toast.until).min_by(f64::total_cmp) else { return };
        context.request_repaint_after_secs((next - now) as f32);
        let mut read = None;
        let window = context.content_rect();
        Area::new(Id::new("toasts"))
            .order(Order::Tooltip)
            .anchor(Align2::CENTER_BOTTOM, vec2(0.0, -14.0))
            .constrain_to(window.shrink(4.0))
            .show(context, |ui| {
                ui.set_max_width((window.width() - 24.0).min(560.0));
                for (position, toast) in self.shown.iter().enumerate() {
                    let visuals = ui.visuals();
                    let edge = if toast.note.error { visuals.error_fg_color } else { visuals.selection.stroke.color };
                    let frame = Frame::popup(ui.style()).stroke(Stroke::new(1.0, edge)).show(ui, |ui| {
                        let count = if toast.count > 1 { format!(" ({} times)", toast.count) } else { String::new() };
                        let ink: Color32 = if toast.note.error { edge } else { ui.visuals().text_color() };
                        ui.label(RichText::new(format!("{}{count}", toast.note.message)).color(ink));
                    });
                    if frame.response.interact(Sense::click()).clicked() {
                        read = Some(position);
                    }
                    ui.add_space(4.0);
                }
            });
        if let Some(position) = read {
            self.shown.remove(position);
        }
    }
}
