//! The look of the viewport: light, haze, colours, and water, which the map has too.

use orograph_graph::{PortType, Unit};

use crate::{
    editor::{
        Session,
        window::{actions::Action, names::Named as _},
    },
    view::{Background, Camera, Colouring, Contours, Scene, Sun, Terrain},
};

/// The colours of the terrain.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) enum Over {
    /// Colours by slope and height.
    #[default]
    Natural,
    /// The tints of a physical map.
    Map,
    /// One grey.
    Clay,
    /// An output of the graph: colours, a mask, or any numbers.
    Output(String),
}

/// The water on the terrain.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) enum Water {
    /// The water output of the shown node, if it has one.
    #[default]
    Own,
    /// None.
    None,
    /// An output of the graph.
    Output(String),
}

/// The settings of the 3D view.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Look {
    pub(super) over: Over,
    pub(super) water: Water,
    exaggeration: f64,
    haze: f64,
    texture: f64,
    clouds: f64,
    /// Solar time, 12 is noon.
    hour: f64,
    latitude_deg: f64,
    day: f64,
    shadows: bool,
    sky: bool,
    /// True if the world's sea is drawn.
    sea: bool,
    exposure: f32,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            over: Over::Natural,
            water: Water::Own,
            exaggeration: 1.0,
            haze: 1.0,
            texture: 1.0,
            clouds: 0.0,
            hour: 16.2,
            latitude_deg: 46.0,
            day: 172.0,
            shadows: true,
            sky: true,
            sea: true,
            exposure: 0.0,
        }
    }
}

impl Look {
    /// Vertical exaggeration.
    pub(super) const fn exaggeration(&self) -> f64 {
        self.exaggeration
    }

    /// Whether a menu item is on. Returns None when it is not a setting of the look.
    pub(super) fn switched(&self, action: Action) -> Option<bool> {
        match action {
            Action::Sea => Some(self.sea),
            Action::Water => Some(self.water != Water::None),
            Action::Shadows => Some(self.shadows),
            Action::Sky => Some(self.sky),
            _ => None,
        }
    }

    /// Switches a setting of the look on or off.
    pub(super) fn switch(&mut self, action: Action) {
        match action {
            Action::Sea => self.sea = !self.sea,
            Action::Water if self.water == Water::None => self.water = Water::Own,
            Action::Water => self.water = Water::None,
            Action::Shadows => self.shadows = !self.shadows,
            Action::Sky => self.sky = !self.sky,
            _ => {}
        }
    }

    /// The scene for a camera and a terrain; `sea_level` is that of the world.
    pub(super) fn scene(&self, camera: Camera, terrain: &Terrain, contours: bool, sea_level: Option<f64>) -> Scene {
        let [low, high] = terrain.range();
        Scene {
            sun: Sun::at(self.hour, self.latitude_deg, self.day),
            exaggeration: self.exaggeration,
            colouring: match self.over {
                // the shown output has colours or numbers
                _ if terrain.colour().is_some() => Colouring::Own,
                Over::Natural | Over::Output(_) => Colouring::Natural,
                Over::Map => Colouring::Map,
                Over::Clay => Colouring::Clay,
            },
            contours: contours.then(|| Contours::over(high - low)),
            sea_level: sea_level.filter(|_| self.sea),
            haze: self.haze,
            texture: self.texture,
            clouds: self.clouds,
            background: if self.sky { Background::Sky } else { Background::Plain([0.018; 3]) },
            shadows: self.shadows,
            exposure: self.exposure,
            ..Scene::new(camera)
        }
    }

    /// The menu of all settings.
    pub(super) fn menu(&mut self, ui: &mut egui::Ui, session: &Session) {
        egui::Grid::new("look").num_columns(2).spacing([12.0, 6.0]).show(ui, |ui| {
            ui.label("Colours");
            let name = match &self.over {
                Over::Natural => "by slope and height",
                Over::Map => "map",
                Over::Clay => "clay",
                Over::Output(port) => port,
            };
            choice(ui, "Colours", name.to_owned(), |ui| {
                ui.selectable_value(&mut self.over, Over::Natural, "by slope and height");
                ui.selectable_value(&mut self.over, Over::Map, "map");
                ui.selectable_value(&mut self.over, Over::Clay, "clay");
                let drapes = |ty: PortType| ty != PortType::Height && ty.planes().is_some();
                for (port, _) in super::ports(session).into_iter().filter(|(_, ty)| drapes(*ty)) {
                    ui.selectable_value(&mut self.over, Over::Output(port.clone()), port);
                }
            });
            ui.end_row();
            ui.label("Water");
            let name = match &self.water {
                Water::Own => "From the shown node",
                Water::None => "none",
                Water::Output(port) => port,
            };
            choice(ui, "Water", name.to_owned(), |ui| {
                ui.selectable_value(&mut self.water, Water::Own, "From the shown node");
                ui.selectable_value(&mut self.water, Water::None, "none");
                let depths = super::ports(session).into_iter().filter(|(_, ty)| *ty == PortType::Scalar(Unit::Metres));
                for (port, _) in depths {
                    ui.selectable_value(&mut self.water, Water::Output(port.clone()), port);
                }
            });
            ui.end_row();
            let level = session.document().world().sea_level;
            ui.add_enabled(level.is_some(), egui::Checkbox::new(&mut self.sea, "Sea"))
                .on_disabled_hover_text("The world has no sea; set a sea level in the file's inspector");
            ui.weak(level.map_or_else(|| "none".to_owned(), |level| Unit::Metres.display(level)));
            ui.end_row();
            ui.label("Vertical exaggeration");
            let _ = ui
                .add(egui::Slider::new(&mut self.exaggeration, 0.25..=10.0).logarithmic(true).max_decimals(2))
                .named("Vertical exaggeration");
            ui.end_row();
            ui.label("Time of day");
            let hour = |value: f64, _| format!("{:02}:{:02}", value as u32, (value.fract() * 60.0) as u32);
            let _ = ui.add(egui::Slider::new(&mut self.hour, 0.0..=24.0).custom_formatter(hour)).named("Time of day");
            ui.end_row();
            ui.label("Latitude");
            let _ = ui
                .add(egui::Slider::new(&mut self.latitude_deg, -90.0..=90.0).suffix("°").max_decimals(0))
                .named("Latitude");
            ui.end_row();
            ui.label("Day of the year");
            let _ = ui.add(egui::Slider::new(&mut self.day, 1.0..=365.0).max_decimals(0)).named("Day of the year");
            ui.end_row();
            ui.label("Haze");
            let _ = ui.add(egui::Slider::new(&mut self.haze, 0.0..=4.0).max_decimals(2)).named("Haze");
            ui.end_row();
            ui.label("Ground texture").on_hover_text("Unevenness below the size of a cell, seen from close by");
            let _ = ui.add(egui::Slider::new(&mut self.texture, 0.0..=2.0).max_decimals(2)).named("Ground texture");
            ui.end_row();
            ui.label("Cloud shadows").on_hover_text("Fraction of the terrain in the shadow of clouds");
            let _ = ui.add(egui::Slider::new(&mut self.clouds, 0.0..=1.0).max_decimals(2)).named("Cloud shadows");
            ui.end_row();
            ui.label("Exposure");
            let _ = ui.add(egui::Slider::new(&mut self.exposure, -3.0..=3.0).max_decimals(1)).named("Exposure");
            ui.end_row();
            ui.checkbox(&mut self.shadows, "Shadows");
            ui.checkbox(&mut self.sky, "Sky");
            ui.end_row();
        });
        if ui.button("Reset look").on_hover_text("Restore the default look").clicked() {
            *self = Self::default();
        }
    }
}

/// A list of choices beside the menu. It is a submenu, because a combo box would close the menu around it.
fn choice(ui: &mut egui::Ui, what: &str, chosen: String, choices: impl FnOnce(&mut egui::Ui)) {
    ui.with_layout(egui::Layout::top_down_justified(egui::Align::Min), |ui| {
        // All are equally wide, so that the list of one does not cover another.
        ui.set_min_width(170.0);
        let name = format!("{what}: {chosen}");
        let menu = ui.menu_button(chosen, |ui| {
            let room = (ui.ctx().content_rect().height() - 60.0).max(80.0);
            egui::ScrollArea::vertical().max_height(room).show(ui, choices);
        });
        let _ = menu.response.named(name);
    });
}
