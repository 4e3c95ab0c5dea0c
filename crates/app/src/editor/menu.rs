//! The menus, the keys of the window, and the line below everything.

use std::path::{Path, PathBuf};

use egui::{Button, Context, Key, KeyboardShortcut, Modifiers, RichText, ThemePreference, Ui};
use orograph_graph::bytes;

use super::{
    NodeState, Session, Wish,
    browser::{Browser, Outcome, Purpose},
    canvas,
    export::Export,
    gallery::Gallery,
    state::{self, Recent},
    theme,
};

/// What a menu or a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Command {
    New,
    Open,
    Examples,
    Save,
    SaveAs,
    Export,
    Picture,
    Quit,
    Keys,
}

const CONTROL: Modifiers = Modifiers::COMMAND;

impl Command {
    /// Every command of the menu of files, in its order, with what it is called.
    const FILE: [(Self, &'static str); 8] = [
        (Self::New, "New"),
        (Self::Open, "Open…"),
        (Self::Examples, "Examples…"),
        (Self::Save, "Save"),
        (Self::SaveAs, "Save as…"),
        (Self::Export, "Export…"),
        (Self::Picture, "Save picture…"),
        (Self::Quit, "Quit"),
    ];

    const fn shortcut(self) -> Option<KeyboardShortcut> {
        Some(match self {
            Self::New => KeyboardShortcut::new(CONTROL, Key::N),
            Self::Open => KeyboardShortcut::new(CONTROL, Key::O),
            Self::Examples | Self::Picture => return None,
            Self::Save => KeyboardShortcut::new(CONTROL, Key::S),
            Self::SaveAs => KeyboardShortcut::new(CONTROL.plus(Modifiers::SHIFT), Key::S),
            Self::Export => KeyboardShortcut::new(CONTROL, Key::E),
            Self::Quit => KeyboardShortcut::new(CONTROL, Key::Q),
            Self::Keys => KeyboardShortcut::new(Modifiers::NONE, Key::F1),
        })
    }
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

    /// The bar at the top.
    pub(super) fn bar(&mut self, ui: &mut Ui, session: &mut Session) {
        let mut chosen = pressed(ui.ctx());
        egui::MenuBar::new().ui(ui, |ui| {
            ui.menu_button("File", |ui| self.file(ui, session, &mut chosen));
            ui.menu_button("Edit", |ui| edit(ui, session));
            ui.menu_button("View", view);
            ui.menu_button("Help", |ui| item(ui, Command::Keys, "Keys and mouse", &mut chosen));
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                let mark = if session.is_dirty() { "• " } else { "" };
                let name = egui::Label::new(RichText::new(format!("{mark}{}", file_name(session.path()))).weak());
                ui.add(name.truncate());
            });
        });
        if let Some(command) = chosen {
            self.carry_out(command, session);
        }
    }

    fn file(&mut self, ui: &mut Ui, session: &mut Session, chosen: &mut Option<Command>) {
        for (command, name) in Command::FILE {
            if matches!(command, Command::Save | Command::Export | Command::Quit) {
                ui.separator();
            }
            item(ui, command, name, chosen);
            if command == Command::Open {
                ui.menu_button("Open recent", |ui| {
                    let files = self.recent.files();
                    if files.is_empty() {
                        ui.weak("None yet");
                    }
                    for path in files {
                        let whole = path.display().to_string();
                        if ui.button(file_name(Some(&path))).on_hover_text(whole).clicked() {
                            session.wish(Wish::Open(path));
                            ui.close();
                        }
                    }
                });
            }
        }
    }

    fn carry_out(&mut self, command: Command, session: &mut Session) {
        match command {
            Command::New => session.wish(Wish::New),
            Command::Open => self.browser = Some(Browser::new(Purpose::Open, session.path())),
            Command::Examples => self.gallery = Some(Gallery::default()),
            Command::Save => drop(session.save()),
            Command::SaveAs => session.ask_name(),
            Command::Export => self.export.open(session),
            Command::Picture => {
                let stem = session.path().and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned());
                let browser = Browser::new(Purpose::Picture, session.path());
                self.browser = Some(browser.named(stem.as_deref().unwrap_or("land"), "png"));
            }
            Command::Quit => session.wish(Wish::Close),
            Command::Keys => self.keys = true,
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

/// The command whose keys were pressed.
fn pressed(context: &Context) -> Option<Command> {
    // The one with more keys comes first, since it holds the other.
    let mut commands: Vec<Command> = Command::FILE.map(|(command, _)| command).to_vec();
    commands.push(Command::Keys);
    commands.sort_by_key(|command| *command != Command::SaveAs);
    let consumed = |command: &Command| {
        command.shortcut().is_some_and(|shortcut| context.input_mut(|input| input.consume_shortcut(&shortcut)))
    };
    commands.into_iter().find(consumed)
}

fn item(ui: &mut Ui, command: Command, name: &str, chosen: &mut Option<Command>) {
    let keys = command.shortcut().map_or_else(String::new, |shortcut| ui.ctx().format_shortcut(&shortcut));
    if ui.add(Button::new(name).shortcut_text(keys)).clicked() {
        *chosen = Some(command);
        ui.close();
    }
}

fn edit(ui: &mut Ui, session: &mut Session) {
    let keys = |keys: KeyboardShortcut| ui.ctx().format_shortcut(&keys);
    let undo = keys(KeyboardShortcut::new(CONTROL, Key::Z));
    let redo = keys(KeyboardShortcut::new(CONTROL.plus(Modifiers::SHIFT), Key::Z));
    if ui.add_enabled(session.document().can_undo(), Button::new("Undo").shortcut_text(undo)).clicked() {
        session.undo();
    }
    if ui.add_enabled(session.document().can_redo(), Button::new("Redo").shortcut_text(redo)).clicked() {
        session.redo();
    }
}

fn view(ui: &mut Ui) {
    ui.label(RichText::new("Theme").weak());
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
        let states = names.map(|name| (name, session.node(name)));
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

/// The choice of how fine what is shown is built.
fn preview(ui: &mut Ui, session: &mut Session) {
    let world = session.document().world();
    let whole = world.cells[0].max(world.cells[1]);
    let now = session.cells();
    let name = |cells: u32| if cells >= whole { format!("{whole} (all)") } else { cells.to_string() };
    let shown = egui::ComboBox::from_id_salt("preview").selected_text(format!("{} cells", name(now))).width(104.0);
    let response = shown.show_ui(ui, |ui| {
        for cells in PREVIEWS.into_iter().filter(|cells| *cells < whole).chain([whole]) {
            let response = ui.selectable_label(name(cells) == name(now), name(cells));
            if response.clicked() {
                session.set_cells(cells);
            }
        }
    });
    response.response.on_hover_text("Cells along the longer side of what is shown");
}

/// What keys do in the window, and what the mouse does in the graph and with values.
const FILES: [(&str, &str); 6] = [
    ("Ctrl+N, Ctrl+O", "New graph, open one"),
    ("Ctrl+S, Ctrl+Shift+S", "Save, save as another file"),
    ("Ctrl+E", "Export"),
    ("Ctrl+Z, Ctrl+Shift+Z", "Undo, redo"),
    ("Ctrl+Q", "Quit"),
    ("F1", "This list"),
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
            let graph =
                canvas::keys_told().chain([("Drag from a pin", "Wire; dropped on nothing it offers what fits")]);
            let parts = [("Window", FILES.to_vec()), ("Graph", graph.collect()), ("Values", VALUES.to_vec())];
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
