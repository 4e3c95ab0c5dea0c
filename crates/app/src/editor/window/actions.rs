//! The actions of menus and keys: one list, from which the menus, the keys, their help and the manual's table are
//! generated.

use egui::{
    Atom, Atoms, Button, Context, Event, Id, Key, KeyboardShortcut, Modifiers, Pos2, Response, Stroke, Ui, Vec2,
    WidgetInfo, WidgetType, vec2,
};

use super::{app::Pane, menus::all};
use crate::editor::canvas::Alignment;

/// A direction on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    Left,
    Right,
    Up,
    Down,
}

impl Way {
    /// A step of length 1; down is positive.
    pub(crate) const fn vector(self) -> Vec2 {
        match self {
            Self::Left => vec2(-1.0, 0.0),
            Self::Right => vec2(1.0, 0.0),
            Self::Up => vec2(0.0, -1.0),
            Self::Down => vec2(0.0, 1.0),
        }
    }

    /// The one of four that belongs to this direction.
    const fn of<T: Copy>(self, all: [T; 4]) -> T {
        all[self as usize]
    }
}

/// An action of a menu or key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Action {
    New,
    Open,
    Examples,
    Welcome,
    Variations,
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
    CopyParameters,
    PasteParameters,
    Delete,
    SelectAll,
    Find,
    Add,
    Frame,
    Arrange,
    Align(Alignment),
    Move(Way),
    Connect,
    Subgraph,
    Inline,
    Rename,
    Mute,
    Collapse,
    FitAll,
    Fit,
    FullSize,
    ZoomIn,
    ZoomOut,
    Overview,
    PinToViewport,
    View3d,
    Map,
    FitView,
    Turn(Way),
    Pan(Way),
    Closer,
    Farther,
    Fly,
    Contours,
    Sea,
    Water,
    Shadows,
    Sky,
    Measure,
    Brush,
    Draw,
    NextHandle,
    PreviousHandle,
    Compare,
    DividerLeft,
    DividerRight,
    Blender,
    Pane(Pane),
    Maximise,
    ResetPanes,
    Keys,
}

/// The part of the window that carries an action out; its keys apply there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Window,
    Graph,
    Viewport,
}

/// The texts and keys of an action.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ActionInfo {
    pub(crate) part: Part,
    /// The name in menus.
    pub(crate) name: &'static str,
    /// The description in the list of keys and in tooltips.
    pub(crate) what: &'static str,
    keys: &'static [(Modifiers, Key)],
}

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;
const BOTH: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);
const SHIFT: Modifiers = Modifiers::SHIFT;

/// The keys of the four directions.
const ARROWS: [&[(Modifiers, Key)]; 4] =
    [&[(NONE, Key::ArrowLeft)], &[(NONE, Key::ArrowRight)], &[(NONE, Key::ArrowUp)], &[(NONE, Key::ArrowDown)]];
const SHIFTED: [&[(Modifiers, Key)]; 4] =
    [&[(SHIFT, Key::ArrowLeft)], &[(SHIFT, Key::ArrowRight)], &[(SHIFT, Key::ArrowUp)], &[(SHIFT, Key::ArrowDown)]];
/// On many keyboards a plus is typed with Shift, on the key of the equals sign.
const PLUS: &[(Modifiers, Key)] = &[(NONE, Key::Plus), (NONE, Key::Equals), (SHIFT, Key::Plus)];
const MINUS: &[(Modifiers, Key)] = &[(NONE, Key::Minus)];

impl Action {
    /// Its texts and keys.
    pub(crate) const fn info(self) -> ActionInfo {
        const fn window(name: &'static str, what: &'static str, keys: &'static [(Modifiers, Key)]) -> ActionInfo {
            ActionInfo { part: Part::Window, name, what, keys }
        }
        const fn graph(name: &'static str, what: &'static str, keys: &'static [(Modifiers, Key)]) -> ActionInfo {
            ActionInfo { part: Part::Graph, name, what, keys }
        }
        const fn viewport(name: &'static str, what: &'static str, keys: &'static [(Modifiers, Key)]) -> ActionInfo {
            ActionInfo { part: Part::Viewport, name, what, keys }
        }
        match self {
            Self::New => window("New", "New graph", &[(CTRL, Key::N)]),
            Self::Open => window("Open…", "Open a graph", &[(CTRL, Key::O)]),
            Self::Examples => window("Examples…", "Open an example graph", &[]),
            Self::Welcome => window("Welcome…", "Start from an example, a recent file or a template", &[]),
            Self::Variations => window("Variations…", "Try other seeds or values", &[(CTRL, Key::R)]),
            Self::Save => window("Save", "Save", &[(CTRL, Key::S)]),
            Self::SaveAs => window("Save as…", "Save as another file", &[(BOTH, Key::S)]),
            Self::Export => window("Export…", "Export", &[(CTRL, Key::E)]),
            Self::Picture => window("Save picture…", "Save the 3D view as a picture", &[]),
            Self::Quit => window("Quit", "Quit", &[(CTRL, Key::Q)]),
            Self::Undo => window("Undo", "Undo", &[(CTRL, Key::Z)]),
            Self::Redo => window("Redo", "Redo", &[(BOTH, Key::Z), (CTRL, Key::Y)]),
            Self::Cut => graph("Cut", "Cut", &[(CTRL, Key::X)]),
            Self::Copy => graph("Copy", "Copy (as text)", &[(CTRL, Key::C)]),
            Self::Paste => graph("Paste", "Paste", &[(CTRL, Key::V)]),
            Self::Duplicate => graph("Duplicate", "Duplicate", &[(CTRL, Key::D)]),
            Self::CopyParameters => graph("Copy parameters", "Copy the parameters of the node", &[(BOTH, Key::C)]),
            Self::PasteParameters => {
                graph("Paste parameters", "Paste parameters into selected nodes of the same kind", &[(BOTH, Key::V)])
            }
            Self::Delete => graph(
                "Delete",
                "Delete the selected nodes and reconnect their neighbours",
                &[(NONE, Key::Delete), (NONE, Key::Backspace)],
            ),
            Self::SelectAll => graph("Select all", "Select all", &[(CTRL, Key::A)]),
            Self::Find => graph("Find…", "Find a node", &[(CTRL, Key::F)]),
            Self::Add => graph("Add a node…", "Add a node", &[(NONE, Key::Tab), (NONE, Key::Space)]),
            Self::Frame => graph("Frame", "Add a frame with a note around the selection", &[(NONE, Key::C)]),
            Self::Arrange => graph("Arrange", "Arrange the selected nodes, or all, in layers", &[(NONE, Key::L)]),
            Self::Align(how) => graph(how.name(), "Align the selected nodes", &[]),
            Self::Move(way) => graph(
                way.of(["Move left", "Move right", "Move up", "Move down"]),
                way.of([
                    "Move the selected nodes to the left, or the view if none is selected",
                    "Move the selected nodes to the right, or the view if none is selected",
                    "Move the selected nodes up, or the view if none is selected",
                    "Move the selected nodes down, or the view if none is selected",
                ]),
                way.of(ARROWS),
            ),
            Self::Connect => graph(
                "Connect…",
                "List the possible and existing wires of the selected nodes, to connect or disconnect them",
                &[(NONE, Key::W)],
            ),
            Self::Subgraph => {
                graph("Make subgraph…", "Move the selected nodes into a new graph file", &[(CTRL, Key::G)])
            }
            Self::Inline => {
                graph("Inline subgraph", "Replace a Subgraph with the nodes of its file", &[(BOTH, Key::G)])
            }
            Self::Rename => graph("Name and note…", "Name and note", &[(NONE, Key::F2)]),
            Self::Mute => graph("Mute", "Mute: bypass the node", &[(NONE, Key::M)]),
            Self::Collapse => graph("Collapse", "Collapse or expand", &[(NONE, Key::H)]),
            Self::FitAll => graph("Zoom to fit all", "Zoom to fit all", &[(NONE, Key::Home)]),
            Self::Fit => graph("Zoom to the selection", "Zoom to the selection", &[(NONE, Key::F)]),
            Self::FullSize => graph("Zoom to 100 %", "Zoom to 100 %", &[(NONE, Key::Num1)]),
            Self::ZoomIn => graph("Zoom in", "Zoom in", PLUS),
            Self::ZoomOut => graph("Zoom out", "Zoom out", MINUS),
            Self::Overview => graph("Overview", "Show an overview of the graph in a corner", &[(NONE, Key::O)]),
            Self::PinToViewport => graph("Pin to viewport", "Pin to viewport", &[(NONE, Key::V)]),
            Self::View3d => viewport("3D", "3D view", &[(NONE, Key::Num3)]),
            Self::Map => viewport("Map", "Map view from above", &[(NONE, Key::Num2)]),
            Self::FitView => viewport("Fit view", "Show the whole world", &[(NONE, Key::Home)]),
            Self::Turn(way) => viewport(
                way.of(["Orbit left", "Orbit right", "Raise the camera", "Lower the camera"]),
                way.of([
                    "Orbit to the left; on the map, pan",
                    "Orbit to the right; on the map, pan",
                    "Raise the camera; on the map, pan",
                    "Lower the camera; on the map, pan",
                ]),
                way.of(ARROWS),
            ),
            Self::Pan(way) => viewport(
                way.of(["Pan left", "Pan right", "Pan up", "Pan down"]),
                way.of(["Pan to the left", "Pan to the right", "Pan forward", "Pan back"]),
                way.of(SHIFTED),
            ),
            Self::Closer => viewport("Closer", "Zoom in", PLUS),
            Self::Farther => viewport("Farther", "Zoom out", MINUS),
            Self::Fly => viewport(
                "Fly",
                "Fly: W A S D to move, E and Q for up and down, Shift for faster, drag to look, wheel for the speed",
                &[(NONE, Key::G)],
            ),
            Self::Contours => viewport("Contours", "Show contour lines", &[(NONE, Key::C)]),
            Self::Sea => viewport("Sea", "Show the sea at the world's sea level", &[]),
            Self::Water => viewport("Water", "Show the water of the shown node", &[]),
            Self::Shadows => viewport("Shadows", "Show shadows cast by the sun", &[]),
            Self::Sky => viewport("Sky", "Show the sky", &[]),
            Self::Measure => viewport("Measure", "Drag a line to see its length, climb and profile", &[(NONE, Key::R)]),
            Self::Brush => {
                viewport("Brush", "Paint heights and masks; the strokes are stored in a node", &[(NONE, Key::B)])
            }
            Self::Draw => viewport(
                "Draw",
                "Draw paths and positions of the selected node: click to add points, drag them",
                &[(NONE, Key::P)],
            ),
            Self::NextHandle => window(
                "Next handle",
                "Move the keyboard focus to the next handle of the selected node",
                &[(CTRL, Key::J)],
            ),
            Self::PreviousHandle => {
                window("Previous handle", "Move the keyboard focus to the previous handle", &[(BOTH, Key::J)])
            }
            Self::Compare => viewport("Compare", "Compare with another output", &[(NONE, Key::X)]),
            Self::DividerLeft => {
                viewport("Divider left", "Move the divider of a comparison to the left", &[(NONE, Key::OpenBracket)])
            }
            Self::DividerRight => {
                viewport("Divider right", "Move the divider of a comparison to the right", &[(NONE, Key::CloseBracket)])
            }
            Self::Blender => viewport(
                "Blender navigation",
                "Middle drag orbits, with Shift it pans, with Ctrl it zooms; the left button is for handles",
                &[],
            ),
            Self::Pane(pane) => window(pane.name(), "Show or hide a pane", &[]),
            Self::Maximise => window(
                "Maximise pane",
                "Maximise the pane under the pointer, or restore the others",
                &[(CTRL, Key::Space)],
            ),
            Self::ResetPanes => window("Reset panes", "Restore the default pane layout", &[]),
            Self::Keys => window("Keys and mouse", "Show the keys and mouse actions", &[(NONE, Key::F1)]),
        }
    }

    /// Its name in menus.
    pub(crate) const fn name(self) -> &'static str {
        self.info().name
    }

    /// What it does.
    pub(crate) const fn what(self) -> &'static str {
        self.info().what
    }

    /// The part that carries it out.
    pub(crate) const fn part(self) -> Part {
        self.info().part
    }

    fn shortcuts(self) -> impl Iterator<Item = KeyboardShortcut> {
        self.info().keys.iter().map(|(modifiers, key)| KeyboardShortcut::new(*modifiers, *key))
    }

    /// Its keys as text, in the notation of this system.
    pub(crate) fn keys(self, context: &Context) -> String {
        self.texts(|keys| context.format_shortcut(keys)).join(" or ")
    }

    /// The texts of its keys, with signs as they are printed on keys, and without the second way to type one.
    fn texts(self, format: impl Fn(&KeyboardShortcut) -> String) -> Vec<String> {
        const SIGNS: [(&str, &str); 5] =
            [("Plus", "+"), ("Minus", "-"), ("Equals", "="), ("OpenBracket", "["), ("CloseBracket", "]")];
        let shown = self.shortcuts().filter(|keys| keys.logical_key != Key::Plus || !keys.modifiers.shift);
        let text = |keys: KeyboardShortcut| {
            let text = format(&keys);
            SIGNS.iter().find(|(name, _)| *name == text).map_or(text, |(_, sign)| (*sign).to_owned())
        };
        shown.map(text).collect()
    }
}

/// The actions with keys in a part of the window.
pub(crate) fn with_keys(part: Part) -> impl Iterator<Item = Action> {
    all().filter(move |action| action.part() == part && !action.info().keys.is_empty())
}

/// The actions of the window whose keys were pressed, in their order.
pub(crate) fn pressed(context: &Context, allowed: impl Fn(Action) -> bool) -> Vec<Action> {
    let actions = with_keys(Part::Window).filter(|action| allowed(*action));
    let mut keys: Vec<(Action, KeyboardShortcut)> =
        actions.flat_map(|action| action.shortcuts().map(move |keys| (action, keys))).collect();
    // Shortcuts with more modifiers come first, because they include the others.
    keys.sort_by_key(|(_, keys)| !keys.modifiers.shift);
    let action_of = |event: &Event| {
        let Event::Key { key, pressed: true, modifiers, .. } = event else { return None };
        let is = |own: &KeyboardShortcut| own.logical_key == *key && modifiers.matches_logically(own.modifiers);
        keys.iter().find(|(_, keys)| is(keys)).map(|(action, _)| *action)
    };
    let mut actions = Vec::new();
    context.input_mut(|input| {
        input.events.retain(|event| {
            let action = action_of(event);
            actions.extend(action);
            action.is_none()
        });
    });
    actions
}

/// The actions of the clipboard, whose keys are its events.
const CLIPBOARD: [Action; 5] =
    [Action::Cut, Action::Copy, Action::Paste, Action::CopyParameters, Action::PasteParameters];

/// The action of a part of the window for an event, with the modifiers held. Returns None when there is none.
pub(crate) fn asked_by(part: Part, event: &Event, modifiers: Modifiers) -> Option<Action> {
    match event {
        // The system sends the same event with and without Shift.
        Event::Copy if part == Part::Graph && modifiers.command && modifiers.shift => Some(Action::CopyParameters),
        Event::Copy if part == Part::Graph => Some(Action::Copy),
        Event::Cut if part == Part::Graph => Some(Action::Cut),
        Event::Key { key, pressed: true, modifiers, .. } => {
            let is = |keys: KeyboardShortcut| keys.logical_key == *key && modifiers.matches_exact(keys.modifiers);
            // The clipboard has its own events.
            let own = |action: &Action| !CLIPBOARD.contains(action);
            with_keys(part).filter(own).find(|action| action.shortcuts().any(is))
        }
        _ => None,
    }
}

/// The status of a menu item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Status {
    /// True if it is available now.
    pub(crate) enabled: bool,
    /// Whether it is on; None for an action that is not a switch.
    pub(crate) on: Option<bool>,
}

impl Status {
    /// The status of a plain action.
    pub(crate) const fn can(enabled: bool) -> Self {
        Self { enabled, on: None }
    }

    /// The status of a switch.
    pub(crate) const fn switch(enabled: bool, on: bool) -> Self {
        Self { enabled, on: Some(on) }
    }
}

/// Space for the check mark before the name of a switch.
const TICK: f32 = 10.0;

/// The name of a submenu; `ticks` if the items around it have space for check marks.
pub(crate) fn heading(name: &str, ticks: bool) -> Atoms<'static> {
    let gutter = ticks.then(|| Atom::custom(Id::new("tick"), vec2(TICK, TICK)));
    let mut atoms = Atoms::new(name.to_owned());
    if let Some(gutter) = gutter {
        atoms.push_left(gutter);
    }
    atoms
}

/// A menu item with its own name; `ticks` leaves space for check marks. Returns true if it was chosen.
pub(crate) fn item(ui: &mut Ui, (action, name): (Action, &str), status: Status, ticks: bool) -> bool {
    let gutter = Id::new("tick");
    let keys = action.texts(|keys| ui.ctx().format_shortcut(keys)).into_iter().next().unwrap_or_default();
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

/// Shows a tooltip for an action whose description adds to its name.
fn hint(response: &Response, action: Action) {
    let ActionInfo { name, what, .. } = action.info();
    if name.trim_end_matches('…') != what {
        response.clone().on_hover_text(what);
    }
}

#[cfg(test)]
mod tests {
    use egui::ModifierNames;

    use super::*;

    /// The keys of an action in the manual, with the same names on every system.
    fn written(action: Action) -> String {
        action.texts(|keys| keys.format(&ModifierNames::NAMES, false)).join(" or ")
    }

    #[test]
    fn no_two_actions_share_keys() {
        for action in all() {
            for other in all().filter(|other| *other != action) {
                // Keys of the window also apply in the graph.
                let apart = action.part() != other.part() && ![action, other].iter().any(|a| a.part() == Part::Window);
                let shared = action.shortcuts().any(|keys| other.shortcuts().any(|others| keys == others));
                assert!(apart || !shared, "{action:?} and {other:?}");
            }
            assert_eq!(all().filter(|other| *other == action).count(), 1, "{action:?} is in the menus once");
        }
    }

    #[test]
    fn the_table_of_habits_has_our_keys() {
        let manual = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/editor.md"));
        let manual = manual.expect("the manual is there");
        let rows: Vec<Vec<&str>> = manual.lines().map(|line| line.split('|').map(str::trim).collect()).collect();
        for (what, action) in [
            ("add a node", Action::Add),
            ("bypass a node", Action::Mute),
            ("delete a node and reconnect its neighbours", Action::Delete),
            ("duplicate", Action::Duplicate),
            ("keep a terrain in view", Action::PinToViewport),
            ("frame everything", Action::FitAll),
            ("frame the selection", Action::Fit),
            ("view from above", Action::Map),
            ("undo", Action::Undo),
            ("redo", Action::Redo),
            ("maximise a pane", Action::Maximise),
            ("draw a line", Action::Draw),
            ("build all outputs", Action::Export),
        ] {
            let row = rows.iter().find(|row| row.len() == 8 && row[1] == what);
            let ours = row.map(|row| row[6]).unwrap_or_default();
            let keys = written(action);
            let found = keys.split(" or ").any(|key| ours.split([' ', ',']).any(|word| word == key));
            assert!(found, "{what}: `{ours}` has none of {keys}");
        }
    }

    #[test]
    fn the_manual_lists_all_keys() {
        let manual = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/editor.md"));
        let manual = manual.expect("the manual is there");
        for action in [Part::Graph, Part::Viewport, Part::Window].into_iter().flat_map(with_keys) {
            let row = format!("| {} | {} |", written(action), action.what());
            assert!(manual.contains(&row), "docs/editor.md lacks: {row}");
        }
    }
}
