//! The window: its menus, its panes, and its frame loop.

use std::{path::PathBuf, sync::Arc};

use egui_tiles::{Behavior, SimplificationOptions, TileId, Tiles, Tree, UiResponse};
use orograph_graph::{Registry, Store, Window};

use super::{
    actions::{Action, Part, Status},
    cells::{self, KeptCells},
    history::HistoryPane,
    input,
    menu::{self, Menu, MenuRequest},
    names,
    problems::Problems,
    theme,
    toasts::Toasts,
};
use crate::editor::{
    FileCommand, Journals, Session, canvas::Canvas, dialogs::questions::Questions, inspector::Inspector,
    viewport::Viewport,
};
use crate::{files::archive::is_archive, report::failure::Failure};

/// A pane of the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Pane {
    Viewport,
    Canvas,
    Inspector,
    Problems,
    History,
}

impl Pane {
    /// Its name.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Viewport => "Viewport",
            Self::Canvas => "Graph",
            Self::Inspector => "Inspector",
            Self::Problems => "Problems",
            Self::History => "History",
        }
    }
}

/// The editor's window.
pub struct App {
    panes: Panes,
    trees: [Tree<Pane>; 3],
    /// The only pane that is shown, if one is maximised.
    maximised: Option<Pane>,
    /// Requests that wait until a field has given up the focus.
    late: Vec<MenuRequest>,
    cells: KeptCells,
    toasts: Toasts,
    questions: Questions,
    menu: Menu,
}

/// The content of the panes, independent of their layout.
struct Panes {
    session: Session,
    canvas: Canvas,
    inspector: Inspector,
    viewport: Viewport,
    problems: Problems,
    history: HistoryPane,
}

impl App {
    /// Opens the editor on a file, or on an empty graph; results go to a store.
    ///
    /// # Errors
    /// When the file cannot be read, or the worker cannot be started.
    pub fn new(
        context: &eframe::CreationContext<'_>,
        file: Option<PathBuf>,
        store: Arc<Store>,
    ) -> Result<Self, Failure> {
        let registry: Registry = orograph_nodes::registry();
        theme::install(&context.egui_ctx);
        input::install(&context.egui_ctx);
        names::install(&context.egui_ctx);
        let wake = context.egui_ctx.clone();
        let session = Session::open(file, registry, store, move || wake.request_repaint())?;
        let panes = Panes {
            session,
            canvas: Canvas::default(),
            inspector: Inspector::default(),
            viewport: Viewport::new(context.wgpu_render_state.as_ref()),
            problems: Problems::default(),
            history: HistoryPane::default(),
        };
        let menu = Menu::new(&context.egui_ctx);
        let (toasts, questions) = (Toasts::default(), Questions::default());
        let cells = KeptCells::default();
        Ok(Self {
            panes,
            trees: Room::ALL.map(arrangement),
            maximised: None,
            late: Vec::new(),
            cells,
            toasts,
            questions,
            menu,
        })
    }

    /// Also keeps journals, so that a crash loses nothing, and follows changes of files by other programs.
    #[must_use]
    pub fn kept(mut self, context: &eframe::CreationContext<'_>, journals: Journals) -> Self {
        let wake = context.egui_ctx.clone();
        self.panes.session.keep(journals, move || wake.request_repaint());
        self
    }

    /// Also shows the welcome page, unless it is switched off.
    #[must_use]
    pub fn welcoming(mut self) -> Self {
        self.menu.welcome();
        self
    }

    /// The session.
    #[must_use]
    pub const fn session(&self) -> &Session {
        &self.panes.session
    }

    /// The state of the document ([`Session::revision`]) of the drawn terrain, and its cells along the longer side;
    /// drawing is a little later than building. Returns None while an intermediate result is drawn.
    #[must_use]
    pub fn seen(&self) -> Option<(u64, u32)> {
        self.panes.viewport.seen()
    }

    /// The window of the finer part, of the current state of the document, that is drawn over the shown output.
    /// Returns None when there is none.
    #[must_use]
    pub fn finer(&self) -> Option<Window> {
        self.panes.viewport.finer(&self.panes.session)
    }

    /// The session, mutably.
    pub const fn session_mut(&mut self) -> &mut Session {
        &mut self.panes.session
    }
}

impl std::fmt::Debug for App {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("App").field("session", &self.panes.session).finish_non_exhaustive()
    }
}

/// The size class of the window; each has its own pane layout.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Room {
    /// Viewport above the graph, and the inspector beside both.
    Wide,
    /// Panes above each other.
    Tall,
    /// One pane at a time, in tabs.
    Little,
}

impl Room {
    const ALL: [Self; 3] = [Self::Wide, Self::Tall, Self::Little];
    /// The smallest size for panes side by side, and the smallest for three panes above each other, in points.
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
    let [viewport, canvas, inspector, problems, history] =
        [Pane::Viewport, Pane::Canvas, Pane::Inspector, Pane::Problems, Pane::History]
            .map(|pane| tiles.insert_pane(pane));
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
            let side = tiles.insert_tab_tile(vec![inspector, problems, history]);
            let whole = row(egui_tiles::LinearDir::Horizontal, &[(work, 0.74), (side, 0.26)]);
            tiles.insert_container(whole)
        }
        Room::Tall => {
            let side = tiles.insert_tab_tile(vec![inspector, problems, history]);
            let column = row(vertical, &[(viewport, 0.35), (canvas, 0.35), (side, 0.3)]);
            tiles.insert_container(column)
        }
        Room::Little => tiles.insert_tab_tile(vec![viewport, canvas, inspector, problems, history]),
    };
    Tree::new(format!("panes, {room:?}"), root, tiles)
}

impl eframe::App for App {
    fn logic(&mut self, _: &egui::Context, _: &mut eframe::Frame) {
        self.cells.follow(&mut self.panes.session);
        self.panes.session.poll();
    }

    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let room = Room::of(ui.ctx().content_rect().size());
        let (panes, tree, maximised) = (&self.panes, &self.trees[room as usize], self.maximised);
        let status = |action| match action {
            Action::Maximise => Status::switch(true, maximised.is_some()),
            action => panes.status(action, tree),
        };
        let typing = ui.ctx().text_edit_focused();
        let asked = egui::Panel::top("menu").show(ui, |ui| self.menu.bar(ui, &panes.session, &status)).inner;
        // A text that is being typed is taken over before the file is saved or closed: its field still gets the keys of
        // this frame and loses the focus in the next one, in which such requests are answered.
        let late = std::mem::take(&mut self.late);
        let (later, now): (Vec<_>, Vec<_>) = asked.into_iter().partition(|request| typing && request.is_of_window());
        if !late.is_empty() || typing && ui.input(|input| input.viewport().close_requested()) {
            ui.memory_mut(|memory| memory.focused().into_iter().for_each(|field| memory.surrender_focus(field)));
        }
        if !later.is_empty() {
            ui.ctx().request_repaint();
        }
        self.late = later;
        now.into_iter().for_each(|request| self.answer(request, room, ui.ctx()));
        let tree = &self.trees[room as usize];
        let visible = self.maximised.map_or_else(|| is_seen(tree, Pane::Viewport), |pane| pane == Pane::Viewport);
        let drawing = visible && self.panes.viewport.is_drawing(&self.panes.session);
        let exporting = self.menu.exporting();
        self.panes.session.set_exporting(exporting.is_some());
        let status = |ui: &mut egui::Ui| menu::status(ui, &mut self.panes.session, drawing, exporting.as_deref());
        if egui::Panel::bottom("status").show(ui, status).inner {
            self.menu.carry_out(Action::Export, &mut self.panes.session);
        }
        egui::CentralPanel::default().show(ui, |ui| match self.maximised {
            Some(pane) => self.panes.show(ui, pane),
            None => self.trees[room as usize].ui(&mut self.panes, ui),
        });
        late.into_iter().for_each(|request| self.answer(request, room, ui.ctx()));
        self.take_dropped(ui.ctx());
        self.menu.above(ui.ctx(), &mut self.panes.session);
        if let Some(path) = self.menu.take_picture() {
            self.panes.viewport.save_picture(&mut self.panes.session, &path);
        }
        self.questions.ui(ui.ctx(), &mut self.panes.session);
        self.toasts.ui(ui.ctx(), &mut self.panes.session);
    }
}

impl App {
    /// Opens a file that was dropped into the window.
    fn take_dropped(&mut self, context: &egui::Context) {
        let dropped = context.input(|input| input.raw.dropped_files.first().cloned());
        let Some(path) = dropped.map(|file| file.path().to_owned()) else { return };
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("ron")) || is_archive(&path) {
            self.panes.session.request(FileCommand::Open(path));
        } else {
            let reason = "it is not a graph; drop a file that ends with .ron or .orograph";
            self.panes.session.note(format!("cannot open `{}`: {reason}", path.display()), true);
        }
    }

    /// Carries out a request of the menus.
    fn answer(&mut self, request: MenuRequest, room: Room, context: &egui::Context) {
        match request {
            MenuRequest::Do(action) => self.carry_out(action, room, context.pointer_latest_pos()),
            MenuRequest::Open(path) => self.panes.session.request(FileCommand::Open(path)),
            MenuRequest::Cells(cells) => cells::choose(&mut self.panes.session, cells),
        }
    }

    /// Carries out an action of a menu or a key of the window, with the pointer at a position.
    fn carry_out(&mut self, action: Action, room: Room, pointer: Option<egui::Pos2>) {
        // An action of another pane shows that pane.
        self.maximised = self.maximised.filter(|pane| match (action.part(), action) {
            (Part::Graph, _) => *pane == Pane::Canvas,
            (Part::Viewport, _) | (Part::Window, Action::NextHandle | Action::PreviousHandle) => {
                *pane == Pane::Viewport
            }
            (Part::Window, action) => !matches!(action, Action::Pane(_) | Action::ResetPanes),
        });
        let tree = &mut self.trees[room as usize];
        match (action.part(), action) {
            (Part::Graph, _) => {
                bring(tree, Pane::Canvas);
                self.panes.canvas.ask(action);
            }
            (Part::Viewport, _) => {
                bring(tree, Pane::Viewport);
                self.panes.viewport.carry_out(action, &mut self.panes.session);
            }
            (Part::Window, Action::Pane(pane)) if is_seen(tree, pane) => {
                if let Some(tile) = tree.tiles.find_pane(&pane) {
                    tree.set_visible(tile, false);
                }
            }
            (Part::Window, Action::Pane(pane)) => bring(tree, pane),
            (Part::Window, Action::Maximise) => {
                let under = pointer.and_then(|at| pane_at(tree, at)).unwrap_or(Pane::Viewport);
                self.maximised = if self.maximised.is_some() { None } else { Some(under) };
            }
            (Part::Window, Action::NextHandle | Action::PreviousHandle) => {
                bring(tree, Pane::Viewport);
                self.panes.viewport.step_handle(action == Action::NextHandle);
            }
            (Part::Window, Action::ResetPanes) => self.trees = Room::ALL.map(arrangement),
            (Part::Window, _) => self.menu.carry_out(action, &mut self.panes.session),
        }
    }
}

/// Shows a pane, in front of those in the same tab group.
fn bring(tree: &mut Tree<Pane>, pane: Pane) {
    if let Some(tile) = tree.tiles.find_pane(&pane) {
        tree.set_visible(tile, true);
        tree.make_active(|other, _| other == tile);
    }
}

/// The visible pane at a position. Returns None when there is none.
fn pane_at(tree: &Tree<Pane>, at: egui::Pos2) -> Option<Pane> {
    let visible = tree.active_tiles();
    let mut panes = visible.into_iter().filter(|tile| tree.tiles.rect(*tile).is_some_and(|rect| rect.contains(at)));
    panes.find_map(|tile| tree.tiles.get_pane(&tile).copied())
}

/// Returns true if a pane is visible and not behind another tab.
fn is_seen(tree: &Tree<Pane>, pane: Pane) -> bool {
    tree.tiles.find_pane(&pane).is_some_and(|tile| tree.active_tiles().contains(&tile))
}

impl Panes {
    /// Whether an action is available, and whether it is on.
    fn status(&self, action: Action, tree: &Tree<Pane>) -> Status {
        let session = &self.session;
        match (action.part(), action) {
            (Part::Graph, _) => self.canvas.status(session, action),
            (Part::Viewport, _) => self.viewport.status(session, action),
            (Part::Window, Action::Undo) => Status::can(session.document().can_undo()),
            (Part::Window, Action::Redo) => Status::can(session.document().can_redo()),
            (Part::Window, Action::NextHandle | Action::PreviousHandle) => Status::can(session.selected().is_some()),
            (Part::Window, Action::Picture) => {
                Status::can(self.viewport.status(session, Action::View3d) == Status::switch(true, true))
            }
            (Part::Window, Action::Pane(pane)) => {
                let (seen, tiles) = (is_seen(tree, pane), tree.active_tiles());
                let others = tiles.iter().filter(|tile| tree.tiles.get_pane(tile).is_some_and(|other| *other != pane));
                Status::switch(!seen || others.count() > 0, seen)
            }
            (Part::Window, _) => Status::can(true),
        }
    }
}

impl Panes {
    fn show(&mut self, ui: &mut egui::Ui, pane: Pane) {
        match pane {
            Pane::Viewport => self.viewport.ui(ui, &mut self.session),
            Pane::Canvas => self.canvas.ui(ui, &mut self.session),
            Pane::Inspector => self.inspector.ui(ui, &mut self.session),
            Pane::Problems => self.problems.ui(ui, &mut self.session),
            Pane::History => self.history.ui(ui, &mut self.session),
        }
    }
}

impl Behavior<Pane> for Panes {
    fn pane_ui(&mut self, ui: &mut egui::Ui, _: TileId, pane: &mut Pane) -> UiResponse {
        self.show(ui, *pane);
        UiResponse::None
    }

    fn tab_title_for_pane(&mut self, pane: &Pane) -> egui::WidgetText {
        match pane {
            Pane::Problems => self.problems.title(&self.session).into(),
            pane => pane.name().into(),
        }
    }

    fn simplification_options(&self) -> SimplificationOptions {
        SimplificationOptions { all_panes_must_have_tabs: true, ..SimplificationOptions::default() }
    }
}
