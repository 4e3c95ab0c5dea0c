//! The menus of nodes, wires and the ground.

use egui::{Button, Id, Popup, PopupAnchor, PopupKind, Pos2, Ui};
use orograph_graph::{Edit, Frame, Srgb};

use super::{
    Canvas, Session,
    commands::{self, Alignment},
    hit::Hit,
    keys::{Command, key_of},
    model::{Model, Side, WireName},
    palette::{Palette, Purpose},
};

/// A menu while it is open.
#[derive(Debug)]
pub(super) struct Menu {
    of: Of,
    at: Pos2,
    /// It is shown from the frame after the one that opened it, which has a click outside of it.
    shown: bool,
}

/// What a menu is of.
#[derive(Debug)]
enum Of {
    Node,
    Input(WireName, bool),
    Wire(WireName),
    Bend(WireName, usize),
    Frame,
    Ground,
}

impl Menu {
    pub(super) fn new(hit: Hit, at: Pos2, model: &Model) -> Self {
        let of = match hit {
            Hit::Pin(spot) if spot.side == Side::Input => Of::Input(
                WireName { node: model.cards[spot.card].name.clone(), input: model.pin(spot).name },
                model.pin(spot).wired,
            ),
            Hit::Card(_) | Hit::Pin(_) => Of::Node,
            Hit::Wire(wire) => Of::Wire(wire),
            Hit::Bend(wire, at) => Of::Bend(wire, at),
            Hit::Head(_) | Hit::Corner(_) => Of::Frame,
            Hit::Ground => Of::Ground,
        };
        Self { of, at, shown: false }
    }
}

impl Canvas {
    pub(super) fn menu_ui(&mut self, ui: &Ui, session: &mut Session) {
        let Some(mut menu) = self.menu.take() else { return };
        if !std::mem::replace(&mut menu.shown, true) {
            ui.ctx().request_repaint();
            self.menu = Some(menu);
            return;
        }
        let mut open = true;
        Popup::new(Id::new("canvas menu"), ui.ctx().clone(), PopupAnchor::Position(menu.at), ui.layer_id())
            .kind(PopupKind::Menu)
            .layout(egui::Layout::top_down_justified(egui::Align::Min))
            .style(egui::containers::menu::menu_style)
            .open_bool(&mut open)
            .show(|ui| {
                ui.set_min_width(190.0);
                match &menu.of {
                    Of::Node => self.node_menu(ui, session),
                    Of::Input(wire, wired) => {
                        if ui.add_enabled(*wired, Button::new("Take the wire off")).clicked() {
                            self.apply(ui, session, &commands::disconnect(wire));
                        }
                        ui.separator();
                        self.node_menu(ui, session);
                    }
                    Of::Wire(wire) => self.wire_menu(ui, session, wire, menu.at),
                    Of::Bend(wire, at) => {
                        if ui.button("Remove this point").clicked() {
                            self.remove_bend(ui, session, wire, *at);
                        }
                        self.straighten(ui, session, wire);
                        ui.separator();
                        self.wire_menu(ui, session, wire, menu.at);
                    }
                    Of::Frame => {
                        self.item(ui, session, "Name and note…", Command::Rename, true);
                        self.frame_colours(ui, session);
                        ui.separator();
                        self.item(ui, session, "Delete the frame", Command::Delete, true);
                    }
                    Of::Ground => self.ground_menu(ui, session, menu.at),
                }
            });
        if open {
            self.menu = Some(menu);
        }
    }

    fn item(&mut self, ui: &mut Ui, session: &mut Session, text: &str, command: Command, enabled: bool) {
        if ui.add_enabled(enabled, Button::new(text).shortcut_text(key_of(command))).clicked() {
            self.run(ui, session, command);
        }
    }

    fn node_menu(&mut self, ui: &mut Ui, session: &mut Session) {
        let chosen = self.chosen(session);
        let one = chosen.len() == 1;
        let shown = session.pinned().is_some_and(|pinned| {
            chosen
                .iter()
                .any(|card| pinned.split_once('.').is_some_and(|(node, _)| node == self.model.cards[*card].name))
        });
        let show = if shown { "Stop showing in the viewport" } else { "Keep in the viewport" };
        self.item(ui, session, show, Command::Show, one);
        self.item(ui, session, "Name and note…", Command::Rename, one);
        let collapsed = chosen.iter().all(|card| self.model.cards[*card].collapsed);
        self.item(ui, session, if collapsed { "Expand" } else { "Collapse" }, Command::Collapse, true);
        let muted = chosen.iter().all(|card| self.model.cards[*card].muted);
        self.item(ui, session, if muted { "Unmute" } else { "Mute" }, Command::Mute, true);
        self.item(ui, session, "Frame", Command::Frame, true);
        ui.separator();
        self.item(ui, session, "Copy", Command::Copy, true);
        self.item(ui, session, "Cut", Command::Cut, true);
        self.item(ui, session, "Paste", Command::Paste, true);
        self.item(ui, session, "Duplicate", Command::Duplicate, true);
        ui.separator();
        ui.add_enabled_ui(chosen.len() > 1, |ui| {
            ui.menu_button("Align", |ui| {
                for (how, text) in Alignment::ALL {
                    self.item(ui, session, text, Command::Align(how), true);
                }
            });
        });
        self.item(ui, session, "Arrange", Command::Arrange, chosen.len() > 1);
        self.item(ui, session, "Zoom to the selection", Command::Fit, true);
        ui.separator();
        self.item(ui, session, "Delete", Command::Delete, true);
    }

    /// The colours that a frame may have.
    fn frame_colours(&mut self, ui: &mut Ui, session: &mut Session) {
        const COLOURS: [u32; 6] = [0xb0_5a_4a, 0xb8_8a_44, 0x6f_94_5a, 0x4a_8f_96, 0x54_78_b0, 0x8a_68_a8];
        let Some(area) = self.area.as_deref().and_then(|name| self.model.area(name)) else { return };
        let area = self.model.areas[area].clone();
        let mut chosen = None;
        ui.horizontal(|ui| {
            for colour in [None].into_iter().chain(COLOURS.map(|code| Some(Srgb::hex(code)))) {
                let (rect, response) = ui.allocate_exact_size(egui::Vec2::splat(20.0), egui::Sense::click());
                let fill =
                    colour.map_or(ui.visuals().weak_text_color(), |Srgb([r, g, b])| egui::Color32::from_rgb(r, g, b));
                let name = colour.map_or_else(|| "no colour".to_owned(), |colour| format!("colour {colour}"));
                response.widget_info(|| egui::WidgetInfo::labeled(egui::WidgetType::Button, true, &name));
                ui.painter().circle_filled(rect.center(), if response.hovered() { 9.0 } else { 7.5 }, fill);
                if colour == area.colour {
                    ui.painter().circle_stroke(rect.center(), 9.5, egui::Stroke::new(1.5, ui.visuals().text_color()));
                }
                if response.clicked() {
                    chosen = Some(colour);
                }
            }
        });
        if let Some(colour) = chosen {
            let frame = Some(Frame { colour, ..area.frame() });
            self.apply(ui, session, &Edit::SetFrame { name: area.name, frame });
            ui.close();
        }
    }

    fn wire_menu(&mut self, ui: &mut Ui, session: &mut Session, wire: &WireName, at: Pos2) {
        if ui.button("Insert a node…").clicked()
            && let Some(lens) = self.lens
        {
            self.palette = Some(Palette::new(at, lens.to_graph(at), Purpose::Insert(wire.clone())));
        }
        if ui.button("Add a point").clicked() {
            self.add_bend(ui, session, wire, at);
        }
        self.item(ui, session, "Delete the wire", Command::Delete, true);
    }

    fn straighten(&mut self, ui: &mut Ui, session: &mut Session, wire: &WireName) {
        if ui.button("Remove all points of the wire").clicked() {
            self.bend_wire(ui, session, wire, &[]);
        }
    }

    fn ground_menu(&mut self, ui: &mut Ui, session: &mut Session, at: Pos2) {
        if ui.add(Button::new("Add a node…").shortcut_text(key_of(Command::Add))).clicked()
            && let Some(lens) = self.lens
        {
            self.palette = Some(Palette::new(at, lens.to_graph(at), Purpose::Add));
        }
        self.item(ui, session, "Paste", Command::Paste, true);
        self.item(ui, session, "Add a frame", Command::Frame, true);
        ui.separator();
        let some = !self.model.cards.is_empty();
        self.item(ui, session, "Select all", Command::SelectAll, some);
        self.item(ui, session, "Find…", Command::Find, some);
        self.item(ui, session, "Arrange all", Command::Arrange, some);
        self.item(ui, session, "Zoom to fit", Command::FitAll, some);
        let map = if self.without_map { "Show the overview" } else { "Hide the overview" };
        self.item(ui, session, map, Command::Map, true);
    }
}
