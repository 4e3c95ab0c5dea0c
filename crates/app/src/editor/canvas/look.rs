//! The colours of the canvas, for the dark and the light theme.

use egui::{Color32, Visuals};
use orograph_graph::PortType;

/// The port types, with a name for the legend.
pub(super) const MEANINGS: [(&str, PortType); 11] = [
    ("height", PortType::Height),
    ("mask", PortType::Mask),
    ("scalar", PortType::Scalar(orograph_graph::Unit::One)),
    ("vector", PortType::Vector(orograph_graph::Unit::One)),
    ("colour", PortType::Colour),
    ("normal", PortType::Normal),
    ("weights", PortType::Weights),
    ("flow", PortType::Flow),
    ("strata", PortType::Strata),
    ("lines", PortType::Lines),
    ("report", PortType::Report),
];

/// The colours of a theme.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub(super) dark: bool,
    pub(super) ground: Color32,
    pub(super) dots: Color32,
    pub(super) body: Color32,
    pub(super) well: Color32,
    pub(super) outline: Color32,
    pub(super) text: Color32,
    pub(super) weak: Color32,
    pub(super) chosen: Color32,
    pub(super) good: Color32,
    pub(super) busy: Color32,
    pub(super) doubtful: Color32,
    pub(super) bad: Color32,
}

const fn grey(level: u8) -> Color32 {
    Color32::from_gray(level)
}

impl Look {
    pub(super) const fn of(visuals: &Visuals) -> Self {
        if visuals.dark_mode {
            Self {
                dark: true,
                ground: Color32::from_rgb(26, 28, 31),
                dots: Color32::from_rgb(48, 51, 56),
                body: Color32::from_rgb(47, 50, 55),
                well: Color32::from_rgb(31, 33, 37),
                outline: Color32::from_rgb(16, 17, 19),
                text: grey(228),
                weak: Color32::from_rgb(158, 163, 171),
                chosen: Color32::from_rgb(255, 255, 255),
                good: Color32::from_rgb(104, 190, 120),
                busy: Color32::from_rgb(96, 170, 240),
                doubtful: Color32::from_rgb(238, 188, 74),
                bad: Color32::from_rgb(242, 104, 92),
            }
        } else {
            Self {
                dark: false,
                ground: Color32::from_rgb(226, 229, 233),
                dots: Color32::from_rgb(200, 204, 210),
                body: Color32::from_rgb(251, 251, 252),
                well: Color32::from_rgb(234, 236, 239),
                outline: Color32::from_rgb(170, 175, 182),
                text: grey(28),
                weak: Color32::from_rgb(92, 98, 107),
                chosen: Color32::from_rgb(20, 96, 200),
                good: Color32::from_rgb(38, 140, 60),
                busy: Color32::from_rgb(24, 110, 200),
                doubtful: Color32::from_rgb(178, 112, 0),
                bad: Color32::from_rgb(196, 42, 32),
            }
        }
    }

    /// The colour of pins and wires of a port type.
    pub(super) fn port(&self, ty: PortType) -> Color32 {
        let (r, g, b) = match ty {
            PortType::Height => (232, 170, 88),
            PortType::Mask => (206, 210, 216),
            PortType::Scalar(_) => (98, 160, 234),
            PortType::AnyScalar => (160, 184, 208),
            PortType::Vector(_) => (164, 126, 232),
            PortType::Colour => (236, 108, 168),
            PortType::Normal => (134, 146, 255),
            PortType::Weights => (146, 204, 96),
            PortType::Flow => (66, 200, 206),
            PortType::Strata => (176, 122, 84),
            PortType::Lines => (240, 112, 90),
            PortType::Report => (190, 182, 118),
        };
        let colour = Color32::from_rgb(r, g, b);
        if self.dark { colour } else { colour.lerp_to_gamma(Color32::BLACK, 0.28) }
    }

    /// The colour of a title, by the category of its node.
    pub(super) fn title(&self, category: &str) -> Color32 {
        let (r, g, b) = match category {
            "generate" => (92, 158, 92),
            "import" => (150, 150, 150),
            "tectonics" => (196, 94, 72),
            "erosion" => (196, 138, 66),
            "hydrology" => (66, 132, 200),
            "filter" => (136, 110, 196),
            "combine" => (62, 156, 150),
            "select" => (110, 132, 160),
            "render" => (196, 96, 146),
            "measure" => (158, 154, 82),
            _ => (124, 128, 134),
        };
        let share = if self.dark { 0.55 } else { 0.62 };
        Color32::from_rgb(r, g, b).lerp_to_gamma(self.body, share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance and contrast as in the Web Content Accessibility Guidelines 2.
    fn contrast(a: Color32, b: Color32) -> f32 {
        let light = |colour: Color32| {
            let [r, g, b] = [colour.r(), colour.g(), colour.b()].map(egui::ecolor::linear_f32_from_gamma_u8);
            0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05
        };
        let (a, b) = (light(a), light(b));
        (a / b).max(b / a)
    }

    #[test]
    fn text_has_enough_contrast() {
        let categories = [
            "generate",
            "import",
            "tectonics",
            "erosion",
            "hydrology",
            "filter",
            "combine",
            "select",
            "render",
            "measure",
            "other",
        ];
        for look in [Look::of(&Visuals::dark()), Look::of(&Visuals::light())] {
            assert!(contrast(look.text, look.body) > 7.0, "{look:?}");
            assert!(contrast(look.weak, look.body) > 4.5, "{look:?}");
            assert!(contrast(look.bad, look.body) > 4.0, "{look:?}");
            for category in categories {
                assert!(contrast(look.text, look.title(category)) > 4.5, "{category} {look:?}");
            }
            for (name, ty) in MEANINGS {
                assert!(contrast(look.port(ty), look.ground) > 1.8, "{name} {look:?}");
            }
        }
    }

    #[test]
    fn port_types_have_distinct_colours() {
        let look = Look::of(&Visuals::dark());
        for (position, (name, ty)) in MEANINGS.iter().enumerate() {
            let same = MEANINGS[position + 1..].iter().find(|(_, other)| look.port(*other) == look.port(*ty));
            assert!(same.is_none(), "{name} and {same:?}");
        }
    }
}
