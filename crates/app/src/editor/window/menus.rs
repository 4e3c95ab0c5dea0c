//! What the menus of the window contain.

use super::{
    actions::{Action, Way},
    app::Pane,
};
use crate::editor::canvas::Alignment;

/// An entry of a menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    Do(Action),
    /// A submenu.
    Sub(&'static str, &'static [Action]),
    /// The recently opened files.
    Recent,
    /// The preview resolution.
    Preview,
    /// The dark or the light theme.
    Theme,
    /// The size of texts and widgets.
    Scale,
}

/// A menu, in groups.
pub(crate) type Lines = &'static [&'static [Line]];

pub(crate) const FILE: Lines = &[
    &[Line::Do(Action::New), Line::Do(Action::Open), Line::Recent, Line::Do(Action::Examples)],
    &[Line::Do(Action::Save), Line::Do(Action::SaveAs)],
    &[Line::Do(Action::Export), Line::Do(Action::Picture)],
    &[Line::Do(Action::Quit)],
];

pub(crate) const EDIT: Lines = &[
    &[Line::Do(Action::Undo), Line::Do(Action::Redo)],
    &[
        Line::Do(Action::Cut),
        Line::Do(Action::Copy),
        Line::Do(Action::Paste),
        Line::Do(Action::Duplicate),
        Line::Do(Action::CopyParameters),
        Line::Do(Action::PasteParameters),
        Line::Do(Action::Delete),
    ],
    &[Line::Do(Action::SelectAll), Line::Do(Action::Find), Line::Do(Action::Variations)],
    &[Line::Do(Action::Rename), Line::Do(Action::Mute), Line::Do(Action::Collapse)],
    &[
        Line::Do(Action::Add),
        Line::Do(Action::Connect),
        Line::Do(Action::Frame),
        Line::Do(Action::Subgraph),
        Line::Do(Action::Inline),
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
        Line::Sub(
            "Move",
            &[Action::Move(Way::Left), Action::Move(Way::Right), Action::Move(Way::Up), Action::Move(Way::Down)],
        ),
    ],
];

pub(crate) const VIEW: Lines = &[
    &[
        Line::Do(Action::FitAll),
        Line::Do(Action::Fit),
        Line::Do(Action::FullSize),
        Line::Sub("Zoom", &[Action::ZoomIn, Action::ZoomOut]),
        Line::Do(Action::Overview),
        Line::Do(Action::PinToViewport),
    ],
    &[
        Line::Do(Action::View3d),
        Line::Do(Action::Map),
        Line::Do(Action::FitView),
        Line::Sub(
            "Camera",
            &[
                Action::Turn(Way::Left),
                Action::Turn(Way::Right),
                Action::Turn(Way::Up),
                Action::Turn(Way::Down),
                Action::Pan(Way::Left),
                Action::Pan(Way::Right),
                Action::Pan(Way::Up),
                Action::Pan(Way::Down),
                Action::Closer,
                Action::Farther,
            ],
        ),
        Line::Do(Action::Fly),
    ],
    &[
        Line::Do(Action::Contours),
        Line::Do(Action::Sea),
        Line::Do(Action::Water),
        Line::Do(Action::Shadows),
        Line::Do(Action::Sky),
    ],
    &[
        Line::Do(Action::Measure),
        Line::Do(Action::Brush),
        Line::Do(Action::Draw),
        Line::Do(Action::NextHandle),
        Line::Do(Action::PreviousHandle),
        Line::Do(Action::Compare),
        Line::Sub("Divider", &[Action::DividerLeft, Action::DividerRight]),
    ],
    &[
        Line::Sub(
            "Panes",
            &[
                Action::Pane(Pane::Viewport),
                Action::Pane(Pane::Canvas),
                Action::Pane(Pane::Inspector),
                Action::Pane(Pane::Problems),
                Action::Pane(Pane::History),
                Action::Maximise,
                Action::ResetPanes,
            ],
        ),
        Line::Preview,
        Line::Theme,
        Line::Scale,
        Line::Do(Action::Blender),
    ],
];

pub(crate) const HELP: Lines = &[&[Line::Do(Action::Welcome), Line::Do(Action::Keys)]];

/// All actions in the menus.
pub(crate) fn all() -> impl Iterator<Item = Action> {
    let lines = [FILE, EDIT, VIEW, HELP].into_iter().flatten().copied().flatten();
    lines.flat_map(|line| {
        let (one, more): (Option<Action>, &[Action]) = match line {
            Line::Do(action) => (Some(*action), &[]),
            Line::Sub(_, actions) => (None, actions),
            Line::Recent | Line::Preview | Line::Theme | Line::Scale => (None, &[]),
        };
        one.into_iter().chain(more.iter().copied())
    })
}
