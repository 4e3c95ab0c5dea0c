//! The context menus of nodes, wires, frames and the background.

use egui::{Button, Id, Popup, PopupAnchor, PopupKind, Pos2, Ui};
use orograph_graph::{Edit, Frame, Srgb};

use super::{
    Canvas, Session,
    commands::{self, Alignment},
    hit::Hit,
    model::{Model, Side, WireName},
    palette::{Palette, Purpose},
};
use crate::editor::window::actions::{self, Action, Status};

/// An open menu.
#[derive(Debug)]
pub(super) struct Menu {
    of: Of,
    at: Pos2,
    /// False in the frame of the click that opened it, because that click is outside the menu and would close it.
    shown: bool,
}

/// The subject of a menu.
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
                        if ui.add_enabled(*wired, Button::new("Disconnect the wire")).clicked() {
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
                        self.item(ui, session, Action::Rename);
                        self.frame_colours(ui, session);
                        ui.separator();
                        self.item_as(ui, session, "Delete the frame", Action::Delete, false);
                    }
                    Of::Ground => self.ground_menu(ui, session, menu.at),
                }
            });
        if open {
            self.menu = Some(menu);
        }
    }

    fn item(&mut self, ui: &mut Ui, session: &mut Session, action: Action) {
        self.item_as(ui, session, action.name(), action, false);
    }

    /// A menu item whose name includes its subject; `ticks` if other items of the menu have check marks.
    fn item_as(&mut self, ui: &mut Ui, session: &mut Session, name: &str, action: Action, ticks: bool) {
        let status = self.status(session, action);
        if actions::item(ui, (action, name), status, ticks) {
            self.run(ui, session, action);
        }
    }

    fn node_menu(&mut self, ui: &mut Ui, session: &mut Session) {
        let groups: [&[Action]; 5] = [
            &[Action::PinToViewport, Action::Rename, Action::Collapse, Action::Mute, Action::Frame],
            &[
                Action::Cut,
                Action::Copy,
                Action::Paste,
                Action::Duplicate,
                Action::CopyParameters,
                Action::PasteParameters,
            ],
            &[Action::Subgraph, Action::Inline],
            &[Action::Arrange, Action::Fit],
            &[Action::Delete],
        ];
        for (position, group) in groups.into_iter().enumerate() {
            if position > 0 {
                ui.separator();
            }
            for action in group {
                if *action == Action::Arrange {
                    let several = self.chosen(session).len() > 1;
                    ui.add_enabled_ui(several, |ui| {
                        ui.menu_button(actions::heading("Align", true), |ui| {
                            for how in Alignment::ALL {
                                self.item(ui, session, Action::Align(how));
                            }
                        });
                    });
                }
                self.item_as(ui, session, action.name(), *action, true);
            }
        }
    }

    /// The colours for frames.
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
        self.item_as(ui, session, "Delete the wire", Action::Delete, false);
    }

    fn straighten(&mut self, ui: &mut Ui, session: &mut Session, wire: &WireName) {
        if ui.button("Remove all points of the wire").clicked() {
            self.bend_wire(ui, session, wire, &[]);
        }
    }

    fn ground_menu(&mut self, ui: &mut Ui, session: &mut Session, at: Pos2) {
        if actions::item(ui, (Action::Add, Action::Add.name()), Status::can(true), true)
            && let Some(lens) = self.lens
        {
            self.palette = Some(Palette::new(at, lens.to_graph(at), Purpose::Add));
        }
        let groups: [&[Action]; 2] = [
            &[Action::Paste, Action::Frame],
            &[Action::SelectAll, Action::Find, Action::Arrange, Action::FitAll, Action::Overview],
        ];
        for (position, group) in groups.into_iter().enumerate() {
            if position > 0 {
                ui.separator();
            }
            for action in group {
                self.item_as(ui, session, action.name(), *action, true);
            }
        }
    }
}
