//! The window: its menus, its panes, and what it does every frame.

use std::path::PathBuf;

use egui::{Key, Modifiers};
use egui_tiles::{Behavior, SimplificationOptions, TileId, Tiles, Tree, UiResponse};
use orograph_graph::Registry;

use super::{
    Journals, Session,
    canvas::Canvas,
    inspector::Inspector,
    menu::{self, Menu},
    problems::Problems,
    questions::Questions,
    theme,
    toasts::Toasts,
    viewport::Viewport,
};
use crate::failure::Failure;

/// A part of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pane {
    Viewport,
    Canvas,
    Inspector,
    Problems,
}

/// The editor's window.
pub struct App {
    panes: Panes,
    trees: [Tree<Pane>; 3],
    toasts: Toasts,
    questions: Questions,
    menu: Menu,
}

/// What the panes show, apart from their arrangement.
struct Panes {
    session: Session,
    canvas: Canvas,
    inspector: Inspector,
    viewport: Viewport,
    problems: Problems,
}

impl App {
    /// An editor on a file, or on an empty graph.
    ///
    /// # Errors
    /// When the file cannot be read, or the worker cannot be started.
    pub fn new(context: &eframe::CreationContext<'_>, file: Option<PathBuf>) -> Result<Self, Failure> {
        let registry: Registry = orograph_nodes::registry();
        theme::install(&context.egui_ctx);
        let wake = context.egui_ctx.clone();
        let session = Session::open(file, registry, move || wake.request_repaint())?;
        let panes = Panes {
            session,
            canvas: Canvas::default(),
            inspector: Inspector::default(),
            viewport: Viewport::new(context.wgpu_render_state.as_ref()),
            problems: Problems::default(),
        };
        let menu = Menu::new(&context.egui_ctx);
        let (toasts, questions) = (Toasts::default(), Questions::default());
        Ok(Self { panes, trees: Room::ALL.map(arrangement), toasts, questions, menu })
    }

    /// The same with journals kept, so that a crash loses nothing, and with files followed that other programs change.
    #[must_use]
    pub fn kept(mut self, context: &eframe::CreationContext<'_>, journals: Journals) -> Self {
        let wake = context.egui_ctx.clone();
        self.panes.session.keep(journals, move || wake.request_repaint());
        self
    }

    /// The work it shows.
    #[must_use]
    pub const fn session(&self) -> &Session {
        &self.panes.session
    }

    /// Of which state of the document ([`Session::revision`]) the land is that is drawn, and with how many cells along the
    /// longer side: what is built is drawn a little later. Nothing while it grows.
    #[must_use]
    pub fn seen(&self) -> Option<(u64, u32)> {
        self.panes.viewport.seen()
    }

    /// The work it shows, to be changed.
    pub const fn session_mut(&mut self) -> &mut Session {
        &mut self.panes.session
    }
}

impl std::fmt::Debug for App {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("App").field("session", &self.panes.session).finish_non_exhaustive()
    }
}

/// How much room there is for panes; each has an arrangement of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Room {
    /// For the land above the graph, and what is selected beside both.
    Wide,
    /// For one above the other.
    Tall,
    /// For one at a time.
    Little,
}

impl Room {
    const ALL: [Self; 3] = [Self::Wide, Self::Tall, Self::Little];
    /// The least that panes side by side take, and the least that three on top of each other take, in points.
    const LEAST: [egui::Vec2; 2] = [egui::vec2(620.0, 400.0), egui::vec2(300.0, 700.0)];

    fn of(size: egui::Vec2) -> Self {
        let fits = |least: egui::Vec2| size.x >= least.x && size.y >= least.y;
        match Self::LEAST.map(fits) {
            [true, _] => Self::Wide,
            [_, true] => Self::Tall,
            _ => Self::Little,
        }
    }
}

fn arrangement(room: Room) -> Tree<Pane> {
    let mut tiles = Tiles::default();
    let [viewport, canvas, inspector, problems] =
        [Pane::Viewport, Pane::Canvas, Pane::Inspector, Pane::Problems].map(|pane| tiles.insert_pane(pane));
    let row = |direction, parts: &[(TileId, f32)]| {
        let mut linear = egui_tiles::Linear::new(direction, parts.iter().map(|(tile, _)| *tile).collect());
        for (tile, share) in parts {
            linear.shares.set_share(*tile, *share);
        }
        linear
    };
    let vertical = egui_tiles::LinearDir::Vertical;
    let root = match room {
        Room::Wide => {
            let column = row(vertical, &[(viewport, 0.56), (canvas, 0.44)]);
            let work = tiles.insert_container(column);
            let side = tiles.insert_tab_tile(vec![inspector, problems]);
            let whole = row(egui_tiles::LinearDir::Horizontal, &[(work, 0.74), (side, 0.26)]);
            tiles.insert_container(whole)
        }
        Room::Tall => {
            let side = tiles.insert_tab_tile(vec![inspector, problems]);
            let column = row(vertical, &[(viewport, 0.35), (canvas, 0.35), (side, 0.3)]);
            tiles.insert_container(column)
        }
        Room::Little => tiles.insert_tab_tile(vec![viewport, canvas, inspector, problems]),
    };
    Tree::new(format!("panes, {room:?}"), root, tiles)
}

impl eframe::App for App {
    fn logic(&mut self, _: &egui::Context, _: &mut eframe::Frame) {
        self.panes.session.poll();
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        undo_keys(ui.ctx(), &mut self.panes.session);
        egui::Panel::top("menu").show(ui, |ui| self.menu.bar(ui, &mut self.panes.session));
        egui::Panel::bottom("status").show(ui, |ui| menu::status(ui, &mut self.panes.session));
        egui::CentralPanel::default().show(ui, |ui| {
            let room = Room::of(ui.ctx().content_rect().size());
            self.trees[room as usize].ui(&mut self.panes, ui);
        });
        self.menu.above(ui.ctx(), &mut self.panes.session);
        if let Some(path) = self.menu.take_picture() {
            self.panes.viewport.save_picture(&mut self.panes.session, &path);
        }
        self.questions.ui(ui.ctx(), &mut self.panes.session);
        self.toasts.ui(ui.ctx(), &mut self.panes.session);
    }
}

/// Undo and redo by key, save where a text is being typed, which has its own, and while something is asked.
fn undo_keys(context: &egui::Context, session: &mut Session) {
    if context.text_edit_focused() || session.question().is_some() {
        return;
    }
    let (both, control) = (Modifiers::COMMAND | Modifiers::SHIFT, Modifiers::COMMAND);
    let [redo, again, undo] = context.input_mut(|input| {
        [(both, Key::Z), (control, Key::Y), (control, Key::Z)].map(|(modifiers, key)| input.consume_key(modifiers, key))
    });
    if redo || again {
        session.redo();
    } else if undo {
        session.undo();
    }
}

impl Behavior<Pane> for Panes {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _: TileId, pane: &mut Pane) -> UiResponse {
        match pane {
            Pane::Viewport => self.viewport.ui(ui, &mut self.session),
            Pane::Canvas => self.canvas.ui(ui, &mut self.session),
            Pane::Inspector => self.inspector.ui(ui, &mut self.session),
            Pane::Problems => self.problems.ui(ui, &mut self.session),
        }
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> egui::WidgetText {
        match pane {
            Pane::Viewport => "Land".into(),
            Pane::Canvas => "Graph".into(),
            Pane::Inspector => "Inspector".into(),
            Pane::Problems => self.problems.title(&self.session).into(),
        }
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }
}
