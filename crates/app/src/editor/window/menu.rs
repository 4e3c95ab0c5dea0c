//! The menus, the keys of the window, and the status bar.

use std::path::{Path, PathBuf};

use egui::{Context, RichText, ThemePreference, Ui};
use orograph_graph::{Unit, bytes};

use super::{
    actions::{self, Action, Part, Status},
    menus::{self, Line, Lines},
    names::Named as _,
    state::{self, Recent},
    theme,
};
use crate::editor::{
    Detail, FileCommand, NodeState, Session,
    dialogs::{
        browser::{Browser, Outcome, Purpose},
        export::Export,
        gallery::Gallery,
        variations::Variations,
        welcome::Welcome,
    },
    session::worker::coarser,
};

/// A request of the menus to other parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum MenuRequest {
    Do(Action),
    /// Open a file.
    Open(PathBuf),
    /// Set the preview resolution: cells along the longer side.
    Cells(u32),
}

impl MenuRequest {
    /// Returns true if it concerns the window and its file, and no pane.
    pub(crate) fn is_of_window(&self) -> bool {
        match self {
            Self::Do(action) => action.part() == Part::Window,
            Self::Open(_) | Self::Cells(_) => true,
        }
    }
}

/// The menus and the dialogs that they open.
pub(crate) struct Menu {
    recent: Recent,
    browser: Option<Browser>,
    gallery: Option<Gallery>,
    welcome: Option<Welcome>,
    variations: Option<Variations>,
    /// True if the variations were asked for.
    varies: bool,
    export: Export,
    keys: bool,
    /// Where to write a picture of the 3D view.
    picture: Option<PathBuf>,
}

impl Menu {
    pub(crate) fn new(context: &Context) -> Self {
        let theme = match state::read("theme").as_deref() {
            Some("dark") => ThemePreference::Dark,
            Some("light") => ThemePreference::Light,
            _ => ThemePreference::System,
        };
        if theme != ThemePreference::System {
            context.set_theme(theme);
        }
        let scale = state::read("scale").and_then(|scale| scale.trim().parse().ok());
        if let Some(scale) = scale.filter(|scale| SCALES.contains(scale)) {
            context.set_zoom_factor(scale as f32 / 100.0);
        }
        Self {
            recent: Recent::load(),
            browser: None,
            gallery: None,
            welcome: None,
            variations: None,
            varies: false,
            export: Export::default(),
            keys: false,
            picture: None,
        }
    }

    /// The menu bar; returns the requests of keys and of a menu. `status` returns the status of each item.
    pub(crate) fn bar(&self, ui: &mut Ui, session: &Session, status: &dyn Fn(Action) -> Status) -> Vec<MenuRequest> {
        let typing = ui.ctx().text_edit_focused();
        // A text field has its own undo.
        let held = |action| matches!(action, Action::Undo | Action::Redo) && (typing || session.question().is_some());
        let pressed = actions::pressed(ui.ctx(), |action| !held(action)).into_iter().map(MenuRequest::Do);
        let mut asked: Vec<MenuRequest> = pressed.collect();
        egui::MenuBar::new().ui(ui, |ui| {
            let menus = [("File", menus::FILE), ("Edit", menus::EDIT), ("View", menus::VIEW)];
            for (name, lines) in menus.into_iter().chain([("Help", menus::HELP)]) {
                ui.menu_button(name, |ui| {
                    // In a small window the menu can be taller than the window.
                    let room = (ui.ctx().content_rect().height() - 60.0).max(80.0);
                    ui.set_max_height(room);
                    egui::ScrollArea::vertical().show(ui, |ui| {
                        asked.extend(self.lines(ui, lines, session, status));
                    });
                });
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let mark = if session.is_dirty() { "• " } else { "" };
                let name = egui::Label::new(RichText::new(format!("{mark}{}", session.title())).weak());
                ui.add(name.truncate());
            });
        });
        asked
    }

    fn lines(
        &self,
        ui: &mut Ui,
        lines: Lines,
        session: &Session,
        status: &dyn Fn(Action) -> Status,
    ) -> Option<MenuRequest> {
        let has = |line: &&Line| matches!(line, Line::Do(action) if status(*action).on.is_some());
        let ticks = lines.iter().copied().flatten().any(|line| has(&line));
        let named = |name: &str| actions::heading(name, ticks);
        let mut asked = None;
        for (position, group) in lines.iter().enumerate() {
            if position > 0 {
                ui.separator();
            }
            for line in *group {
                match *line {
                    Line::Do(action) => {
                        if actions::item(ui, (action, action.name()), status(action), ticks) {
                            asked = Some(MenuRequest::Do(action));
                        }
                    }
                    Line::Sub(name, of) => {
                        let ticks = of.iter().any(|action| status(*action).on.is_some());
                        ui.menu_button(named(name), |ui| {
                            for action in of {
                                if actions::item(ui, (*action, action.name()), status(*action), ticks) {
                                    asked = Some(MenuRequest::Do(*action));
                                }
                            }
                        });
                    }
                    Line::Recent => {
                        let chosen = ui.menu_button(named("Open recent"), |ui| self.recent_files(ui)).inner.flatten();
                        asked = chosen.or(asked);
                    }
                    Line::Preview => {
                        let name = named("Preview resolution");
                        let chosen = ui.menu_button(name, |ui| cells(ui, session, true)).inner.flatten();
                        asked = chosen.map(MenuRequest::Cells).or(asked);
                    }
                    Line::Theme => drop(ui.menu_button(named("Theme"), themes)),
                    Line::Scale => drop(ui.menu_button(named("UI scale"), scales)),
                }
            }
        }
        asked
    }

    fn recent_files(&self, ui: &mut Ui) -> Option<MenuRequest> {
        let files = self.recent.files();
        if files.is_empty() {
            ui.weak("None yet");
        }
        let mut asked = None;
        for path in files {
            let whole = path.display().to_string();
            if ui.button(file_name(&path)).on_hover_text(whole).clicked() {
                asked = Some(MenuRequest::Open(path));
                ui.close();
            }
        }
        asked
    }

    /// Carries out an action that opens a dialog or concerns the session.
    pub(crate) fn carry_out(&mut self, action: Action, session: &mut Session) {
        match action {
            Action::New => session.request(FileCommand::New),
            Action::Open => self.browser = Some(Browser::new(Purpose::Open, session.path())),
            Action::Examples => self.gallery = Some(Gallery::default()),
            Action::Variations => self.varies = true,
            Action::Welcome => self.welcome = Some(Welcome::default()),
            Action::Save => drop(session.save()),
            Action::SaveAs => session.ask_name(),
            Action::Export => self.export.open(session),
            Action::Picture => {
                let stem = session.path().and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned());
                let browser = Browser::new(Purpose::Picture, session.path());
                self.browser = Some(browser.named(stem.as_deref().unwrap_or("terrain"), "png"));
            }
            Action::Quit => session.request(FileCommand::Close),
            Action::Undo => drop(session.undo()),
            Action::Redo => drop(session.redo()),
            Action::Keys => self.keys = true,
            // Carried out elsewhere.
            _ => {}
        }
    }

    /// The open dialogs.
    pub(crate) fn above(&mut self, context: &Context, session: &mut Session) {
        self.recent.see(session.path());
        self.export.ui(context, session);
        if let Some(gallery) = &mut self.gallery
            && let Some(command) = gallery.ui(context)
        {
            self.gallery = None;
            if let Some(command) = command {
                session.request(command);
            }
        }
        if let Some(welcome) = &mut self.welcome
            && let Some(command) = welcome.ui(context, &self.recent.files())
        {
            self.welcome = None;
            if let Some(command) = command {
                session.request(command);
            }
        }
        if std::mem::take(&mut self.varies) {
            self.variations = Variations::start(context, session);
        }
        self.variations.take_if(|variations| !variations.ui(context, session));
        if self.keys {
            keys(context, &mut self.keys);
        }
        if let Some(browser) = &mut self.browser
            && let Some(outcome) = browser.show(context)
        {
            let purpose = browser.purpose();
            self.browser = None;
            match outcome {
                Outcome::Chosen(path) if purpose == Purpose::Picture => self.picture = Some(path),
                Outcome::Chosen(path) => session.request(FileCommand::Open(path)),
                Outcome::Cancelled => {}
            }
        }
    }

    /// Shows the welcome page, unless it is switched off.
    pub(crate) fn welcome(&mut self) {
        self.welcome = Welcome::is_wanted().then(Welcome::default);
    }

    /// The exports in the background, as text. Returns None when none runs.
    pub(crate) fn exporting(&self) -> Option<String> {
        self.export.summary()
    }

    /// Where to write a picture of the 3D view. Returns None after the first call.
    pub(crate) const fn take_picture(&mut self) -> Option<PathBuf> {
        self.picture.take()
    }
}

/// The name of a file as text.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The choice of the theme.
fn themes(ui: &mut Ui) {
    let now = ui.ctx().options(|options| options.theme_preference);
    for (preference, name, written) in [
        (ThemePreference::System, "Same as the system", "system"),
        (ThemePreference::Dark, "Dark", "dark"),
        (ThemePreference::Light, "Light", "light"),
    ] {
        if ui.radio(now == preference, name).clicked() {
            ui.ctx().set_theme(preference);
            state::write("theme", written);
            ui.close();
        }
    }
}

/// The sizes of texts and widgets, in per cent.
const SCALES: [u32; 8] = [75, 90, 100, 110, 125, 150, 200, 300];

/// The choice of the size of texts and widgets.
fn scales(ui: &mut Ui) {
    let now = (100.0 * ui.ctx().zoom_factor()).round() as u32;
    for scale in SCALES {
        if ui.radio(now == scale, format!("{scale} %")).clicked() {
            ui.ctx().set_zoom_factor(scale as f32 / 100.0);
            state::write("scale", &scale.to_string());
            ui.close();
        }
    }
}

/// The preview resolutions: cells along the longer side.
const PREVIEWS: [u32; 6] = [128, 256, 512, 1024, 2048, 4096];

/// The status bar: the running node, the shown output, and the preview resolution.
/// `drawing` is true while the viewport does not show the newest result yet; `exporting` is the text of the exports in the
/// background. Returns true if that was clicked.
pub(crate) fn status(ui: &mut Ui, session: &mut Session, drawing: bool, exporting: Option<&str>) -> bool {
    let mut asked = false;
    ui.horizontal(|ui| {
        let names = session.document().nodes().iter().map(|node| node.name.as_str());
        let states = names.map(|name| (name, session.info(name)));
        let (mut running, mut failed, mut memory) = (None, 0, 0);
        for (name, info) in states {
            memory += info.bytes as u64;
            match info.state {
                NodeState::Running { fraction } => running = Some((name.to_owned(), fraction)),
                NodeState::Failed { .. } => failed += 1,
                NodeState::Waiting | NodeState::Unwired { .. } | NodeState::Fresh => {}
            }
        }
        match (&running, session.is_busy()) {
            (Some((name, fraction)), true) => {
                ui.add(egui::Spinner::new().size(12.0));
                ui.label(format!("Building {name}, {:.0} %", fraction * 100.0));
            }
            (None, true) => {
                ui.add(egui::Spinner::new().size(12.0));
                ui.label("Building");
            }
            _ if drawing => {
                ui.add(egui::Spinner::new().size(12.0));
                ui.label("Drawing");
            }
            _ => drop(ui.weak("Ready")),
        }
        if failed > 0 {
            let nodes = if failed == 1 { "1 node failed".to_owned() } else { format!("{failed} nodes failed") };
            ui.colored_label(ui.visuals().error_fg_color, nodes);
        }
        if let Some(exporting) = exporting {
            asked = ui.link(exporting).on_hover_text("Show the exports").clicked();
        }
        if let Some(detail) = session.detail() {
            ui.add(egui::Label::new(RichText::new(detail_text(session, detail)).weak()).truncate());
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            preview(ui, session);
            ui.weak(extent_text(session))
                .on_hover_text("Extent of the world, from west to east and from south to north");
            ui.weak(bytes(memory)).on_hover_text("Memory used by the results of all nodes");
            if let Some(port) = session.shown() {
                let cells = session.built(&port).map_or(0, |built| built.cells);
                let took = port.split_once('.').and_then(|(node, _)| session.node(node).time);
                let took =
                    took.map_or_else(String::new, |(time, _)| format!(", {}", crate::report::progress::seconds(time)));
                let shown = format!("{port}: {cells} cells{took}");
                ui.add(egui::Label::new(RichText::new(shown).weak()).truncate());
            }
        });
    });
    asked
}

/// The state of a close view, as text.
fn detail_text(session: &Session, detail: &Detail) -> String {
    match detail {
        Detail::OfBuild { node } if session.cells() < whole(session) => {
            format!("Full detail at export: {node} is computed for the whole world")
        }
        Detail::OfBuild { node } => format!("Full detail: {node} is computed for the whole world"),
        Detail::Building => "Adding detail".to_owned(),
        Detail::Built { cells } => format!("Detail: {cells} cells"),
        Detail::Failed { message } => format!("No more detail: {message}"),
    }
}

/// The choice of the preview resolution.
fn preview(ui: &mut Ui, session: &mut Session) {
    let shown = egui::ComboBox::from_id_salt("preview").selected_text(preview_text(session)).width(104.0);
    let response = shown.show_ui(ui, |ui| cells(ui, session, false));
    if let Some(cells) = response.inner.flatten() {
        super::cells::choose(session, cells);
    }
    let [nx, ny] = coarser(session.document().world(), session.cells()).cells;
    let hint = format!("Preview resolution: {nx} x {ny} cells are computed");
    response.response.named("preview resolution").on_hover_text(hint);
}

/// The preview resolution, as text.
fn preview_text(session: &Session) -> String {
    let whole = whole(session);
    format!("Preview {} of {whole}", session.cells().min(whole))
}

/// The extent of the world, as text.
fn extent_text(session: &Session) -> String {
    let [width, height] = session.document().world().size;
    format!("{} x {}", Unit::Metres.display(width), Unit::Metres.display(height))
}

/// Cells along the longer side of the world.
fn whole(session: &Session) -> u32 {
    let world = session.document().world();
    world.cells[0].max(world.cells[1])
}

/// The list of preview resolutions, in a menu or in a combo box; returns the chosen one.
fn cells(ui: &mut Ui, session: &Session, menu: bool) -> Option<u32> {
    let whole = whole(session);
    let mut chosen = None;
    for cells in PREVIEWS.into_iter().filter(|cells| *cells < whole).chain([whole]) {
        let on = session.cells().min(whole) == cells;
        let name = if cells == whole { format!("{whole} (full)") } else { cells.to_string() };
        let response = if menu { ui.radio(on, name) } else { ui.selectable_label(on, name) };
        if response.clicked() {
            chosen = Some(cells);
            ui.close();
        }
    }
    chosen
}

/// Mouse actions in the graph, in the viewport and on values.
const GRAPH: [(&str, &str); 4] = [
    ("Drag from a port", "Connect a wire; drop it on empty space to add a node that fits"),
    ("Double-click a wire", "Add a point to route it; double-click the point to remove it"),
    ("Wheel, middle drag", "Zoom, pan"),
    ("Double-click a node", "Pin to viewport"),
];
const VIEWPORT: [(&str, &str); 6] = [
    ("Drag", "Orbit; with Shift or another button, pan"),
    ("Wheel", "Zoom in at the pointer"),
    ("W A S D, E Q", "Fly, if Fly is on; Shift is faster"),
    ("Drag a yellow point", "Move a point of the selected node; with Ctrl, snap to a grid"),
    ("Drag a small point", "Insert a point into the line"),
    ("Delete", "Remove the point that was clicked last"),
];
const VALUES: [(&str, &str); 5] = [
    ("Drag a slider", "One undo step"),
    ("2 km, 35 deg, 1 mm/yr", "Type a value with its unit; Enter applies, Escape cancels"),
    ("2 km / 3, (1 km + 500) * 2", "Calculate with units"),
    ("… or right-click on a name", "Reset, expose as parameter, wire"),
    ("Double-click, right-click", "In curves: add a point, remove a point"),
];

fn keys(context: &Context, open: &mut bool) {
    let modal = theme::modal(context, egui::Id::new("keys")).show(context, |ui| {
        let room = ui.ctx().content_rect().size();
        ui.set_width((room.x - 60.0).clamp(200.0, 500.0));
        ui.heading("Keys and mouse");
        egui::ScrollArea::vertical().max_height((room.y - 140.0).max(80.0)).show(ui, |ui| {
            let by_key = |part| actions::with_keys(part).map(|action| (action.keys(context), action.what()));
            let by_hand = |lines: &[(&'static str, &'static str)]| -> Vec<(String, &'static str)> {
                lines.iter().map(|(keys, what)| ((*keys).to_owned(), *what)).collect()
            };
            let parts = [
                ("Window", by_key(Part::Window).collect()),
                ("Graph", by_key(Part::Graph).chain(by_hand(&GRAPH)).collect()),
                ("Viewport", by_key(Part::Viewport).chain(by_hand(&VIEWPORT)).collect()),
                ("Values", by_hand(&VALUES)),
            ];
            for (part, lines) in parts {
                ui.add_space(6.0);
                ui.strong(part);
                // The second columns of all parts are aligned.
                let first = 170.0_f32.min(0.4 * ui.available_width());
                egui::Grid::new(part).num_columns(2).spacing([16.0, 3.0]).min_col_width(first).show(ui, |ui| {
                    for (keys, what) in lines {
                        ui.label(keys);
                        ui.add(egui::Label::new(RichText::new(what).weak()).wrap());
                        ui.end_row();
                    }
                });
            }
        });
        ui.add_space(6.0);
        if ui.button("Close").clicked() {
            ui.close();
        }
    });
    *open = !modal.should_close();
}
