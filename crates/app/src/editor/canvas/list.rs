//! The keys of a list below a search field.

use egui::{Key, Modifiers, Rect, Ui};

/// The keys that were pressed in this frame; a list takes them from the other widgets.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ListKeys {
    pub(super) up: bool,
    pub(super) down: bool,
    pub(super) enter: bool,
    pub(super) escape: bool,
}

impl ListKeys {
    pub(super) fn take(ui: &Ui) -> Self {
        let [up, down, enter, escape] = [Key::ArrowUp, Key::ArrowDown, Key::Enter, Key::Escape]
            .map(|key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key)));
        Self { up, down, enter, escape }
    }

    /// Returns true if the mark moves, so that the list has to follow it.
    pub(super) const fn moves(self) -> bool {
        self.up || self.down
    }

    /// The marked line of `count`, after the arrow keys.
    pub(super) fn marked(self, now: usize, count: usize) -> usize {
        let last = count.saturating_sub(1);
        match (self.up, self.down) {
            (true, _) => now.min(last).saturating_sub(1),
            (_, true) => (now + 1).min(last),
            _ => now.min(last),
        }
    }
}

/// Returns true if the pointer was pressed outside of a list, which closes it. It is not asked in the first frames, in
/// which the press that opened the list may still count.
pub(super) fn left(ui: &Ui, frames: u32, list: Rect) -> bool {
    let outside = !ui.ctx().pointer_latest_pos().is_some_and(|at| list.contains(at));
    frames > 2 && outside && ui.input(|input| input.pointer.any_pressed())
}
