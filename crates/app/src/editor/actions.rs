//! What can be asked for by menu or key: one list, of which the menus, the keys, their help and the manual's table are made.

use egui::{
    Atom, Atoms, Button, Context, Event, Id, Key, KeyboardShortcut, Modifiers, Pos2, Response, Stroke, Ui, WidgetInfo,
    WidgetType, vec2,
};

use super::{app::Pane, canvas::Alignment};

/// What can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    New,
    Open,
    Examples,
    Save,
    SaveAs,
    Export,
    Picture,
    Quit,
    Undo,
    Redo,
    Cut,
    Copy,
    Paste,
    Duplicate,
    Delete,
    SelectAll,
    Find,
    Add,
    Frame,
    Arrange,
    Align(Alignment),
    Rename,
    Mute,
    Collapse,
    FitAll,
    Fit,
    FullSize,
    Overview,
    Show,
    Land,
    Map,
    Whole,
    Fly,
    Contours,
    Sea,
    Water,
    Shadows,
    Sky,
    Measure,
    Brush,
    Compare,
    Pane(Pane),
    ResetPanes,
    Keys,
}

/// The part of the window that carries an action out; its keys count there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Window,
    Graph,
    Land,
}

/// What is told of an action.
#[derive(Clone, Copy, Debug)]
pub(super) struct Told {
    pub(super) part: Part,
    /// As a line of a menu.
    pub(super) name: &'static str,
    /// In the list of keys, and below the pointer.
    pub(super) what: &'static str,
    keys: &'static [(Modifiers, Key)],
}

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const BOTH: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

impl Action {
    /// What is told of it.
    pub(super) const fn told(self) -> Told {
        const fn window(name: &'static str, what: &'static str, keys: &'static [(Modifiers, Key)]) -> Told {
            Told { part: Part::Window, name, what, keys }
        }
        const fn graph(name: &'static str, what: &'static str, keys: &'static [(Modifiers, Key)]) -> Told {
            Told { part: Part::Graph, name, what, keys }
        }
        const fn land(name: &'static str, what: &'static str) -> Told {
            Told { part: Part::Land, name, what, keys: &[] }
        }
        match self {
            Self::New => window("New", "New graph", &[(CTRL, Key::N)]),
            Self::Open => window("Open…", "Open a graph", &[(CTRL, Key::O)]),
            Self::Examples => window("Examples…", "Graphs that come with the program", &[]),
            Self::Save => window("Save", "Save", &[(CTRL, Key::S)]),
            Self::SaveAs => window("Save as…", "Save as another file", &[(BOTH, Key::S)]),
            Self::Export => window("Export…", "Export", &[(CTRL, Key::E)]),
            Self::Picture => window("Save picture…", "Save the land in 3D as a picture", &[]),
            Self::Quit => window("Quit", "Quit", &[(CTRL, Key::Q)]),
            Self::Undo => window("Undo", "Undo", &[(CTRL, Key::Z)]),
            Self::Redo => window("Redo", "Redo", &[(BOTH, Key::Z), (CTRL, Key::Y)]),
            Self::Cut => graph("Cut", "Cut", &[(CTRL, Key::X)]),
            Self::Copy => graph("Copy", "Copy as text that any editor reads", &[(CTRL, Key::C)]),
            Self::Paste => graph("Paste", "Paste", &[(CTRL, Key::V)]),
            Self::Duplicate => graph("Duplicate", "Duplicate", &[(CTRL, Key::D)]),
            Self::Delete => {
                graph("Delete", "Delete, and heal the wires", &[(NONE, Key::Delete), (NONE, Key::Backspace)])
            }
            Self::SelectAll => graph("Select all", "Select all", &[(CTRL, Key::A)]),
            Self::Find => graph("Find…", "Find a node", &[(CTRL, Key::F)]),
            Self::Add => graph("Add a node…", "Add a node", &[(NONE, Key::Tab), (NONE, Key::Space)]),
            Self::Frame => graph("Frame", "A frame with a note around the selection", &[(NONE, Key::C)]),
            Self::Arrange => graph("Arrange", "Arrange the selection, or all, in layers", &[(NONE, Key::L)]),
            Self::Align(how) => graph(how.name(), "Line up the selected nodes", &[]),
            Self::Rename => graph("Name and note…", "Name and note", &[(NONE, Key::F2)]),
            Self::Mute => graph("Mute", "Mute: build as if it were not there", &[(NONE, Key::M)]),
            Self::Collapse => graph("Collapse", "Collapse or expand", &[(NONE, Key::H)]),
            Self::FitAll => graph("Zoom to fit all", "Zoom to fit all", &[(NONE, Key::Home)]),
            Self::Fit => graph("Zoom to the selection", "Zoom to the selection", &[(NONE, Key::F)]),
            Self::FullSize => graph("Zoom to 100 %", "Zoom to 100 %", &[(NONE, Key::Num1)]),
            Self::Overview => graph("Overview", "The whole graph in a corner", &[(NONE, Key::O)]),
            Self::Show => graph("Keep in sight", "Keep in the land's pane whatever is selected", &[(NONE, Key::V)]),
            Self::Land => land("3D", "The land in three dimensions"),
            Self::Map => land("Map", "The land from above"),
            Self::Whole => land("Whole land", "Show the whole world"),
            Self::Fly => {
                land("Fly", "W A S D to fly, E and Q up and down, Shift faster, drag to look, wheel for the speed")
            }
            Self::Contours => land("Contours", "Lines of equal height"),
            Self::Sea => land("Sea", "The sea of the world"),
            Self::Water => land("Water", "The water that the shown node gives"),
            Self::Shadows => land("Shadows", "Shadows of the sun"),
            Self::Sky => land("Sky", "The sky behind the land"),
            Self::Measure => land("Measure", "Drag a line: its length, climb and profile"),
            Self::Brush => land("Brush", "Paint heights and masks; strokes are kept in a node"),
            Self::Compare => land("Compare", "Show another output beside this one"),
            Self::Pane(pane) => window(pane.name(), "Show or hide a pane", &[]),
            Self::ResetPanes => window("Reset panes", "All panes where they were at the start", &[]),
            Self::Keys => window("Keys and mouse", "This list", &[(NONE, Key::F1)]),
        }
    }

    /// What it is called in menus.
    pub(super) const fn name(self) -> &'static str {
        self.told().name
    }

    /// What it does.
    pub(super) const fn what(self) -> &'static str {
        self.told().what
    }

    /// Who carries it out.
    pub(super) const fn part(self) -> Part {
        self.told().part
    }

    fn shortcuts(self) -> impl Iterator<Item = KeyboardShortcut> {
        self.told().keys.iter().map(|(modifiers, key)| KeyboardShortcut::new(*modifiers, *key))
    }

    /// Its keys for people, as this system writes them.
    pub(super) fn keys(self, context: &Context) -> String {
        self.shortcuts().map(|keys| context.format_shortcut(&keys)).collect::<Vec<_>>().join(" or ")
    }
}

/// A line of a menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Line {
    Do(Action),
    /// A menu of its own.
    Sub(&'static str, &'static [Action]),
    /// The files that were open last.
    Recent,
    /// How fine what is shown is built.
    Preview,
    /// Dark or light.
    Theme,
}

/// A menu, in groups.
pub(super) type Lines = &'static [&'static [Line]];

pub(super) const FILE: Lines = &[
    &[Line::Do(Action::New), Line::Do(Action::Open), Line::Recent, Line::Do(Action::Examples)],
    &[Line::Do(Action::Save), Line::Do(Action::SaveAs)],
    &[Line::Do(Action::Export), Line::Do(Action::Picture)],
    &[Line::Do(Action::Quit)],
];

pub(super) const EDIT: Lines = &[
    &[Line::Do(Action::Undo), Line::Do(Action::Redo)],
    &[
        Line::Do(Action::Cut),
        Line::Do(Action::Copy),
        Line::Do(Action::Paste),
        Line::Do(Action::Duplicate),
        Line::Do(Action::Delete),
    ],
    &[Line::Do(Action::SelectAll), Line::Do(Action::Find)],
    &[Line::Do(Action::Rename), Line::Do(Action::Mute), Line::Do(Action::Collapse)],
    &[
        Line::Do(Action::Add),
        Line::Do(Action::Frame),
        Line::Do(Action::Arrange),
        Line::Sub(
            "Align",
            &[
                Action::Align(Alignment::ALL[0]),
                Action::Align(Alignment::ALL[1]),
                Action::Align(Alignment::ALL[2]),
                Action::Align(Alignment::ALL[3]),
            ],
        ),
    ],
];

pub(super) const VIEW: Lines = &[
    &[
        Line::Do(Action::FitAll),
        Line::Do(Action::Fit),
        Line::Do(Action::FullSize),
        Line::Do(Action::Overview),
        Line::Do(Action::Show),
    ],
    &[Line::Do(Action::Land), Line::Do(Action::Map), Line::Do(Action::Whole), Line::Do(Action::Fly)],
    &[
        Line::Do(Action::Contours),
        Line::Do(Action::Sea),
        Line::Do(Action::Water),
        Line::Do(Action::Shadows),
        Line::Do(Action::Sky),
    ],
    &[Line::Do(Action::Measure), Line::Do(Action::Brush), Line::Do(Action::Compare)],
    &[
        Line::Sub(
            "Panes",
            &[
                Action::Pane(Pane::Viewport),
                Action::Pane(Pane::Canvas),
                Action::Pane(Pane::Inspector),
                Action::Pane(Pane::Problems),
                Action::ResetPanes,
            ],
        ),
        Line::Preview,
        Line::Theme,
    ],
];

pub(super) const HELP: Lines = &[&[Line::Do(Action::Keys)]];

/// All that is in the menus.
fn all() -> impl Iterator<Item = Action> {
    let lines = [FILE, EDIT, VIEW, HELP].into_iter().flatten().copied().flatten();
    lines.flat_map(|line| {
        let (one, more): (Option<Action>, &[Action]) = match line {
            Line::Do(action) => (Some(*action), &[]),
            Line::Sub(_, actions) => (None, actions),
            Line::Recent | Line::Preview | Line::Theme => (None, &[]),
        };
        one.into_iter().chain(more.iter().copied())
    })
}

/// What has keys in a part of the window.
pub(super) fn with_keys(part: Part) -> impl Iterator<Item = Action> {
    all().filter(move |action| action.part() == part && !action.told().keys.is_empty())
}

/// The action of the window whose keys were pressed.
pub(super) fn pressed(context: &Context, allowed: impl Fn(Action) -> bool) -> Option<Action> {
    let actions = with_keys(Part::Window).filter(|action| allowed(*action));
    let mut keys: Vec<(Action, KeyboardShortcut)> =
        actions.flat_map(|action| action.shortcuts().map(move |keys| (action, keys))).collect();
    // Those with more modifiers come first, since they hold the others.
    keys.sort_by_key(|(_, keys)| !keys.modifiers.shift);
    let consumed = |(_, keys): &(Action, KeyboardShortcut)| context.input_mut(|input| input.consume_shortcut(keys));
    keys.into_iter().find(consumed).map(|(action, _)| action)
}

/// The action of the graph that an event asks for.
pub(super) fn asked_by(event: &Event) -> Option<Action> {
    match event {
        Event::Copy => Some(Action::Copy),
        Event::Cut => Some(Action::Cut),
        Event::Key { key, pressed: true, modifiers, .. } => {
            let is = |keys: KeyboardShortcut| keys.logical_key == *key && modifiers.matches_exact(keys.modifiers);
            // The clipboard has events of its own.
            let own = |action: &Action| !matches!(action, Action::Cut | Action::Copy | Action::Paste);
            with_keys(Part::Graph).filter(own).find(|action| action.shortcuts().any(is))
        }
        _ => None,
    }
}

/// How a line of a menu stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Status {
    /// Whether it can be done now.
    pub(super) enabled: bool,
    /// Whether it is switched on, of what is on or off.
    pub(super) on: Option<bool>,
}

impl Status {
    /// Of something that is done.
    pub(super) const fn can(enabled: bool) -> Self {
        Self { enabled, on: None }
    }

    /// Of something that is on or off.
    pub(super) const fn switch(enabled: bool, on: bool) -> Self {
        Self { enabled, on: Some(on) }
    }
}

/// Room for the tick before the name of what is on or off.
const TICK: f32 = 10.0;

/// The name of a menu in a menu; `ticks` says whether the lines around it have room for ticks.
pub(super) fn heading(name: &str, ticks: bool) -> Atoms<'static> {
    let gutter = ticks.then(|| Atom::custom(Id::new("tick"), vec2(TICK, TICK)));
    let mut atoms = Atoms::new(name.to_owned());
    if let Some(gutter) = gutter {
        atoms.push_left(gutter);
    }
    atoms
}

/// A line of a menu, with a name of its own; `ticks` leaves room for ticks. Says whether it was chosen.
pub(super) fn item(ui: &mut Ui, (action, name): (Action, &str), status: Status, ticks: bool) -> bool {
    let gutter = Id::new("tick");
    let keys = action.shortcuts().next().map_or_else(String::new, |keys| ui.ctx().format_shortcut(&keys));
    let label = format!("{name} {keys}");
    let button = Button::new(heading(name, ticks));
    let button = if keys.is_empty() { button } else { button.shortcut_text(keys) };
    let shown = ui.add_enabled_ui(status.enabled, |ui| button.atom_ui(ui)).inner;
    if let Some(on) = status.on {
        shown.response.widget_info(|| WidgetInfo::selected(WidgetType::Checkbox, status.enabled, on, label.trim_end()));
        if let Some(rect) = shown.rect(gutter).filter(|_| on) {
            let visuals = ui.style().interact(&shown.response);
            let colour = if status.enabled { visuals.text_color() } else { ui.visuals().weak_text_color() };
            let at = |x: f32, y: f32| -> Pos2 { rect.min + vec2(x, y) * TICK };
            ui.painter().line(vec![at(0.05, 0.55), at(0.35, 0.85), at(0.9, 0.15)], Stroke::new(1.6, colour));
        }
    }
    hint(&shown.response, action);
    let clicked = shown.response.clicked();
    if clicked {
        ui.close();
    }
    clicked
}

/// Tells what an action does where its name does not.
fn hint(response: &Response, action: Action) {
    let Told { name, what, .. } = action.told();
    if name.trim_end_matches('…') != what {
        response.clone().on_hover_text(what);
    }
}

#[cfg(test)]
mod tests {
    use egui::ModifierNames;

    use super::*;

    /// The keys of an action in the manual, where every system has the same names.
    fn written(action: Action) -> String {
        action.shortcuts().map(|keys| keys.format(&ModifierNames::NAMES, false)).collect::<Vec<_>>().join(" or ")
    }

    #[test]
    fn no_two_actions_share_keys() {
        for action in all() {
            for other in all().filter(|other| *other != action) {
                // Keys of the window count in the graph as well.
                let apart = action.part() != other.part() && ![action, other].iter().any(|a| a.part() == Part::Window);
                let shared = action.shortcuts().any(|keys| other.shortcuts().any(|others| keys == others));
                assert!(apart || !shared, "{action:?} and {other:?}");
            }
            assert_eq!(all().filter(|other| *other == action).count(), 1, "{action:?} is in the menus once");
        }
    }

    #[test]
    fn the_manual_tells_all_keys() {
        let manual = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/editor.md"));
        let manual = manual.expect("the manual is there");
        for action in [Part::Graph, Part::Window].into_iter().flat_map(with_keys) {
            let row = format!("| {} | {} |", written(action), action.what());
            assert!(manual.contains(&row), "docs/editor.md lacks: {row}");
        }
    }
}
