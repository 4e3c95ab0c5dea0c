//! Input of slow frames. Mouse and keyboard go on while a frame is drawn, and the next frame gets all their events at
//! once; but egui has only one position of the pointer for all clicks of a frame, and the window and the graph read the
//! keys one after the other. So a frame gets only as many events as it can handle in their order, and later frames the
//! others.

use std::collections::VecDeque;

use egui::{Context, Event, Key, Modifiers, Plugin, RawInput};

/// Longest time in seconds between the press and the release of a click. They can be in different slow frames.
const CLICK: f64 = 3.0;

/// Longest time in seconds between the frames of two clicks that arrived together, so that they are a double-click.
const TOGETHER: f64 = 10.0;

/// Makes the window handle all input of slow frames.
pub(super) fn install(context: &Context) {
    let mut double_click = 0.0;
    context.options_mut(|options| {
        options.input_options.max_click_duration = CLICK;
        double_click = options.input_options.max_double_click_delay;
    });
    context.add_plugin(InOrder { waiting: VecDeque::new(), held: false, double_click });
}

/// Distributes events among frames.
struct InOrder {
    /// The events that no frame has got yet.
    waiting: VecDeque<Event>,
    /// True while a button of the mouse is pressed.
    held: bool,
    /// Longest time in seconds between two clicks of a double-click, if they did not arrive together.
    double_click: f64,
}

impl Plugin for InOrder {
    fn debug_name(&self) -> &'static str {
        "events in order"
    }

    fn input_hook(&mut self, context: &Context, input: &mut RawInput) {
        let late = !self.waiting.is_empty();
        self.waiting.extend(input.events.drain(..));
        let count = first(self.waiting.iter(), &mut self.held);
        input.events.extend(self.waiting.drain(..count));
        let delay = if late { TOGETHER } else { self.double_click };
        context.options_mut(|options| options.input_options.max_double_click_delay = delay);
        if !self.waiting.is_empty() {
            context.request_repaint();
        }
    }
}

/// A key press, or a command of the clipboard.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Pressed {
    Key(Key, Modifiers),
    Clipboard,
}

impl Pressed {
    fn of(event: &Event) -> Option<Self> {
        match event {
            Event::Key { key, pressed: true, modifiers, .. } => Some(Self::Key(*key, *modifiers)),
            Event::Copy | Event::Cut | Event::Paste(_) => Some(Self::Clipboard),
            _ => None,
        }
    }

    /// True if the window or the graph can have it as a shortcut, even while a text is typed.
    fn is_command(self) -> bool {
        match self {
            Self::Key(_, modifiers) => modifiers.command,
            Self::Clipboard => true,
        }
    }
}

/// The number of events that one frame handles in their order: up to the press of a button, or to the first click; up
/// to the end of a drag, without the release; and up to a different shortcut. `held` is true while a button is pressed.
fn first<'a>(events: impl Iterator<Item = &'a Event>, held: &mut bool) -> usize {
    let (mut down, mut clicked, mut dragged) = (false, false, false);
    let mut key: Option<Pressed> = None;
    let mut count = 0;
    for event in events {
        let releases = matches!(event, Event::PointerButton { pressed: false, .. });
        if clicked || (down && !releases) || (dragged && releases) {
            break;
        }
        dragged |= *held && matches!(event, Event::PointerMoved(_));
        if let Some(pressed) = Pressed::of(event) {
            let other = key.filter(|before| *before != pressed);
            if other.is_some_and(|before| before.is_command() || pressed.is_command()) {
                break;
            }
            key = Some(pressed);
        }
        clicked = releases;
        down = matches!(event, Event::PointerButton { pressed: true, .. });
        *held = down || (*held && !releases);
        count += 1;
    }
    count
}

#[cfg(test)]
mod tests {
    use egui::{PointerButton, pos2};

    use super::*;

    fn button(pressed: bool) -> Event {
        let (pos, modifiers) = (pos2(5.0, 5.0), Modifiers::NONE);
        Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers }
    }

    fn key(key: Key, modifiers: Modifiers) -> Event {
        Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers }
    }

    #[test]
    fn a_frame_ends_after_a_click_and_before_another_shortcut() {
        let moved = || Event::PointerMoved(pos2(9.0, 5.0));
        let letter = |letter: &str| Event::Text(letter.to_owned());
        let undo = || key(Key::Z, Modifiers::COMMAND);
        for (events, count) in [
            (vec![], 0),
            (vec![moved(), button(true), button(false), moved()], 3),
            (vec![moved(), button(true), moved(), moved(), button(false)], 2),
            (vec![button(true), button(false), button(true), button(false)], 2),
            (vec![undo(), undo(), undo(), key(Key::Y, Modifiers::COMMAND)], 3),
            (vec![key(Key::Delete, Modifiers::NONE), undo()], 1),
            (vec![Event::Copy, Event::Paste(String::new()), undo()], 2),
            (vec![key(Key::A, Modifiers::NONE), letter("a"), key(Key::B, Modifiers::NONE), letter("b")], 4),
        ] {
            assert_eq!(first(events.iter(), &mut false), count, "{events:?}");
        }
        let mut held = true;
        assert_eq!(first([moved(), moved(), button(false), button(true)].iter(), &mut held), 2);
        assert!(held);
        assert_eq!(first([button(false), button(true)].iter(), &mut held), 1);
        assert!(!held);
    }
}
