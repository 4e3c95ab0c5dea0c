//! The menus, the keys of the window, and the line below everything.

use std::path::{Path, PathBuf};

use egui::{Context, RichText, ThemePreference, Ui};
use orograph_graph::bytes;

use super::{
    Detail, NodeState, Session, Wish,
    actions::{self, Action, Line, Lines, Part, Status},
    browser::{Browser, Outcome, Purpose},
    export::Export,
    gallery::Gallery,
    state::{self, Recent},
    theme,
};

/// What the menus ask for of others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Asked {
    Do(Action),
    /// To open a file.
    Open(PathBuf),
    /// To build what is shown with so many cells along the longer side.
    Cells(u32),
}

/// The menus and what they have opened.
pub(super) struct Menu {
    recent: Recent,
    browser: Option<Browser>,
    gallery: Option<Gallery>,
    export: Export,
    keys: bool,
    /// Where a picture of the land is to be written.
    picture: Option<PathBuf>,
}

impl Menu {
    pub(super) fn new(context: &Context) -> Self {
        let theme = match state::read("theme").as_deref() {
            Some("dark") => ThemePreference::Dark,
            Some("light") => ThemePreference::Light,
            _ => ThemePreference::System,
        };
        if theme != ThemePreference::System {
            context.set_theme(theme);
        }
        Self {
            recent: Recent::load(),
            browser: None,
            gallery: None,
            export: Export::default(),
            keys: false,
            picture: None,
        }
    }

    /// The bar at the top; gives what it or a key asks for. `status` tells how each line stands.
    pub(super) fn bar(&self, ui: &mut Ui, session: &Session, status: &dyn Fn(Action) -> Status) -> Option<Asked> {
        let typing = ui.ctx().text_edit_focused();
        // A text that is being typed has an undo of its own.
        let held = |action| matches!(action, Action::Undo | Action::Redo) && (typing || session.question().is_some());
        let mut asked = actions::pressed(ui.ctx(), |action| !held(action)).map(Asked::Do);
        egui::MenuBar::new().ui(ui, |ui| {
            let menus = [("File", actions::FILE), ("Edit", actions::EDIT), ("View", actions::VIEW)];
            for (name, lines) in menus.into_iter().chain([("Help", actions::HELP)]) {
                ui.menu_button(name, |ui| {
                    // In a small window the lines are more than it has room for.
                    let room = (ui.ctx().content_rect().height() - 60.0).max(80.0);
                    ui.set_max_height(room);
                    egui::ScrollArea::vertical().show(ui, |ui| {
                        asked = self.lines(ui, lines, session, status).or_else(|| asked.take());
                    });
                });
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let mark = if session.is_dirty() { "• " } else { "" };
                let name = egui::Label::new(RichText::new(format!("{mark}{}", file_name(session.path()))).weak());
                ui.add(name.truncate());
            });
        });
        asked
    }

    fn lines(&self, ui: &mut Ui, lines: Lines, session: &Session, status: &dyn Fn(Action) -> Status) -> Option<Asked> {
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
                            asked = Some(Asked::Do(action));
                        }
                    }
                    Line::Sub(name, of) => {
                        let ticks = of.iter().any(|action| status(*action).on.is_some());
                        ui.menu_button(named(name), |ui| {
                            for action in of {
                                if actions::item(ui, (*action, action.name()), status(*action), ticks) {
                                    asked = Some(Asked::Do(*action));
                                }
                            }
                        });
                    }
                    Line::Recent => {
                        let chosen = ui.menu_button(named("Open recent"), |ui| self.recent_files(ui)).inner.flatten();
                        asked = chosen.or(asked);
                    }
                    Line::Preview => {
                        let name = named("Cells of the preview");
                        let chosen = ui.menu_button(name, |ui| cells(ui, session, true)).inner.flatten();
                        asked = chosen.map(Asked::Cells).or(asked);
                    }
                    Line::Theme => drop(ui.menu_button(named("Theme"), themes)),
                }
            }
        }
        asked
    }

    fn recent_files(&self, ui: &mut Ui) -> Option<Asked> {
        let files = self.recent.files();
        if files.is_empty() {
            ui.weak("None yet");
        }
        let mut asked = None;
        for path in files {
            let whole = path.display().to_string();
            if ui.button(file_name(Some(&path))).on_hover_text(whole).clicked() {
                asked = Some(Asked::Open(path));
                ui.close();
            }
        }
        asked
    }

    /// Does what opens something above the panes, or asks for something of the session.
    pub(super) fn carry_out(&mut self, action: Action, session: &mut Session) {
        match action {
            Action::New => session.wish(Wish::New),
            Action::Open => self.browser = Some(Browser::new(Purpose::Open, session.path())),
            Action::Examples => self.gallery = Some(Gallery::default()),
            Action::Save => drop(session.save()),
            Action::SaveAs => session.ask_name(),
            Action::Export => self.export.open(session),
            Action::Picture => {
                let stem = session.path().and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned());
                let browser = Browser::new(Purpose::Picture, session.path());
                self.browser = Some(browser.named(stem.as_deref().unwrap_or("land"), "png"));
            }
            Action::Quit => session.wish(Wish::Close),
            Action::Undo => drop(session.undo()),
            Action::Redo => drop(session.redo()),
            Action::Keys => self.keys = true,
            // What others carry out.
            _ => {}
        }
    }

    /// What is open above the panes.
    pub(super) fn above(&mut self, context: &Context, session: &mut Session) {
        self.recent.see(session.path());
        self.export.ui(context, session);
        if let Some(gallery) = &mut self.gallery
            && let Some(wish) = gallery.ui(context)
        {
            self.gallery = None;
            if let Some(wish) = wish {
                session.wish(wish);
            }
        }
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
                Outcome::Chosen(path) => session.wish(Wish::Open(path)),
                Outcome::Cancelled => {}
            }
        }
    }

    /// Where a picture of the land is to be written, once.
    pub(super) const fn take_picture(&mut self) -> Option<PathBuf> {
        self.picture.take()
    }
}

/// The name of a file for people.
pub(super) fn file_name(path: Option<&Path>) -> String {
    let name = path.and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
    name.unwrap_or_else(|| "Untitled".to_owned())
}

/// The choice between dark and light.
fn themes(ui: &mut Ui) {
    let now = ui.ctx().options(|options| options.theme_preference);
    for (preference, name, written) in [
        (ThemePreference::System, "As the system", "system"),
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

/// Cells along the longer side that a preview may have.
const PREVIEWS: [u32; 6] = [128, 256, 512, 1024, 2048, 4096];

/// The line below everything: what is being built, what is shown, and with how many cells.
pub(super) fn status(ui: &mut Ui, session: &mut Session) {
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
            _ => drop(ui.weak("Ready")),
        }
        if failed > 0 {
            let nodes = if failed == 1 { "1 node failed".to_owned() } else { format!("{failed} nodes failed") };
            ui.colored_label(ui.visuals().error_fg_color, nodes);
        }
        if let Some(detail) = session.detail() {
            ui.add(egui::Label::new(RichText::new(detail_told(session, detail)).weak()).truncate());
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            preview(ui, session);
            ui.weak(bytes(memory)).on_hover_text("Memory of the results of all nodes");
            if let Some(port) = session.shown() {
                let cells = session.built(&port).map_or(0, |built| built.cells);
                let took = port.split_once('.').and_then(|(node, _)| session.node(node).time);
                let took = took.map_or_else(String::new, |(time, _)| format!(", {}", crate::progress::seconds(time)));
                let shown = format!("{port}: {cells} cells{took}");
                ui.add(egui::Label::new(RichText::new(shown).weak()).truncate());
            }
        });
    });
}

/// How a close view is served, for people.
fn detail_told(session: &Session, detail: &Detail) -> String {
    match detail {
        Detail::OfBuild { node } if session.cells() < whole(session) => {
            format!("Full detail at export: {node} is computed for the whole world")
        }
        Detail::OfBuild { node } => format!("Full detail: {node} is computed for the whole world"),
        Detail::OnMap => "The map shows this place in more detail".to_owned(),
        Detail::Building => "Adding detail".to_owned(),
        Detail::Built { cells } => format!("Detail of {cells} cells"),
        Detail::Failed { message } => format!("No more detail: {message}"),
    }
}

/// The choice of how fine what is shown is built.
fn preview(ui: &mut Ui, session: &mut Session) {
    let shown =
        egui::ComboBox::from_id_salt("preview").selected_text(format!("{} cells", cells_told(session))).width(104.0);
    let response = shown.show_ui(ui, |ui| cells(ui, session, false));
    if let Some(cells) = response.inner.flatten() {
        session.set_cells(cells);
    }
    response.response.on_hover_text("Cells along the longer side of what is shown");
}

/// The cells along the longer side of what is shown, for people.
fn cells_told(session: &Session) -> String {
    let whole = whole(session);
    if session.cells() >= whole { format!("{whole} (all)") } else { session.cells().to_string() }
}

/// Cells along the longer side of the world.
fn whole(session: &Session) -> u32 {
    let world = session.document().world();
    world.cells[0].max(world.cells[1])
}

/// The numbers of cells that can be chosen, in a menu or in a list; gives the one that was.
fn cells(ui: &mut Ui, session: &Session, menu: bool) -> Option<u32> {
    let whole = whole(session);
    let mut chosen = None;
    for cells in PREVIEWS.into_iter().filter(|cells| *cells < whole).chain([whole]) {
        let on = session.cells().min(whole) == cells;
        let name = if cells == whole { format!("{whole} (all)") } else { cells.to_string() };
        let response = if menu { ui.radio(on, name) } else { ui.selectable_label(on, name) };
        if response.clicked() {
            chosen = Some(cells);
            ui.close();
        }
    }
    chosen
}

/// What the mouse does in the graph, in the land and with values.
const GRAPH: [(&str, &str); 4] = [
    ("Drag from a pin", "Wire; dropped on nothing it offers what fits"),
    ("Double click a wire", "Lead it around something; again takes the point away"),
    ("Wheel, middle drag", "Zoom, and move the view"),
    ("Double click a node", "Keep it in the land's pane"),
];
const LAND: [(&str, &str); 3] = [
    ("Drag", "Turn; with Shift or another button, move"),
    ("Wheel", "Come nearer, at the place under the pointer"),
    ("W A S D, E Q", "Fly, where that is on; Shift is faster"),
];
const VALUES: [(&str, &str); 4] = [
    ("Drag a slider", "One step of undo"),
    ("2 km, 35 deg, 1 mm/yr", "Typed with the unit: Enter takes it, Escape takes it back"),
    ("… or right click on a name", "Reset, name it for users of the file, wire"),
    ("Double click, right click", "In curves: add a point, remove one"),
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
                ("Land", by_hand(&LAND)),
                ("Values", by_hand(&VALUES)),
            ];
            for (part, lines) in parts {
                ui.add_space(6.0);
                ui.strong(part);
                // The second columns of all parts are one below the other.
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
