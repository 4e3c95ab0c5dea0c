//! The look of the window, dark and light: neutral grey with one accent, so that the terrain has the colours.

use egui::{
    Color32, Context, CornerRadius, FontFamily, FontId, Id, Margin, Shadow, Stroke, Style, TextStyle, Theme, Visuals,
    style::{Selection, WidgetVisuals, Widgets},
    vec2,
};

/// The colours of a theme.
struct Palette {
    /// Background of panes.
    panel: Color32,
    /// Background of menus and dialogs.
    raised: Color32,
    /// Background of text fields, and between panes.
    sunk: Color32,
    /// Buttons: normal, hovered, pressed.
    buttons: [Color32; 3],
    /// Separators.
    edge: Color32,
    /// Text: normal, on buttons, highlighted, weak.
    text: [Color32; 4],
    /// Links, curves and marks.
    accent: Color32,
    /// Background of the selection, and its text.
    selection: [Color32; 2],
    warning: Color32,
    error: Color32,
    /// Opacity of shadows.
    shadow: u8,
}

const fn rgb(code: u32) -> Color32 {
    let [_, red, green, blue] = code.to_be_bytes();
    Color32::from_rgb(red, green, blue)
}

const DARK: Palette = Palette {
    panel: rgb(0x1e_21_24),
    raised: rgb(0x27_2b_2f),
    sunk: rgb(0x14_16_18),
    buttons: [rgb(0x33_38_3d), rgb(0x3e_44_4a), rgb(0x2a_2f_33)],
    edge: rgb(0x3a_3f_45),
    text: [rgb(0xc3_c9_ce), rgb(0xd6_db_df), rgb(0xf4_f6_f7), rgb(0x8d_96_9e)],
    accent: rgb(0x63_bd_b5),
    selection: [rgb(0x1f_66_66), rgb(0xe2_f6_f4)],
    warning: rgb(0xe3_ac_55),
    error: rgb(0xf2_7a_6b),
    shadow: 110,
};

const LIGHT: Palette = Palette {
    panel: rgb(0xf2_f3_f3),
    raised: rgb(0xfc_fc_fc),
    sunk: rgb(0xff_ff_ff),
    buttons: [rgb(0xe0_e4_e5), rgb(0xd3_d9_db), rgb(0xc3_cb_ce)],
    edge: rgb(0xc9_cf_d2),
    text: [rgb(0x38_3e_43), rgb(0x2c_31_35), rgb(0x0c_0f_11), rgb(0x63_6c_72)],
    accent: rgb(0x0d_73_70),
    selection: [rgb(0xb4_dd_d9), rgb(0x06_3f_3e)],
    warning: rgb(0x8f_5a_00),
    error: rgb(0xb3_2d_20),
    shadow: 30,
};

/// Applies the look to a window. The theme follows the system until you choose one.
pub(crate) fn install(context: &Context) {
    for (theme, palette) in [(Theme::Dark, &DARK), (Theme::Light, &LIGHT)] {
        context.style_mut_of(theme, |style| dress(style, theme, palette));
    }
}

fn dress(style: &mut Style, theme: Theme, palette: &Palette) {
    let proportional = |size| FontId::new(size, FontFamily::Proportional);
    style.text_styles = [
        (TextStyle::Small, proportional(11.0)),
        (TextStyle::Body, proportional(13.0)),
        (TextStyle::Button, proportional(13.0)),
        (TextStyle::Heading, proportional(17.0)),
        (TextStyle::Monospace, FontId::new(12.0, FontFamily::Monospace)),
    ]
    .into();
    let spacing = &mut style.spacing;
    spacing.item_spacing = vec2(7.0, 5.0);
    spacing.button_padding = vec2(7.0, 2.0);
    spacing.interact_size = vec2(36.0, 20.0);
    spacing.window_margin = Margin::same(12);
    spacing.menu_margin = Margin::same(6);
    spacing.tooltip_width = 380.0;
    spacing.scroll = egui::style::ScrollStyle::thin();
    style.interaction.selectable_labels = false;
    style.visuals = visuals(theme, palette);
}

/// A dialog above everything, with the margin of the other windows.
pub(crate) fn modal(context: &Context, id: Id) -> egui::Modal {
    let style = context.global_style();
    egui::Modal::new(id).frame(egui::Frame::popup(&style).inner_margin(style.spacing.window_margin))
}

fn visuals(theme: Theme, palette: &Palette) -> Visuals {
    let [text, pressed, strong, weak] = palette.text;
    let [rest, hover, active] = palette.buttons;
    let widget = |fill: Color32, edge: Color32, text: Color32| WidgetVisuals {
        bg_fill: fill,
        weak_bg_fill: fill,
        bg_stroke: Stroke::new(1.0, edge),
        corner_radius: CornerRadius::same(4),
        fg_stroke: Stroke::new(1.0, text),
        expansion: 0.0,
    };
    let shadow = Shadow { offset: [0, 4], blur: 16, spread: 0, color: Color32::from_black_alpha(palette.shadow) };
    Visuals {
        weak_text_color: Some(weak),
        widgets: Widgets {
            noninteractive: widget(palette.panel, palette.edge, text),
            inactive: WidgetVisuals { bg_stroke: Stroke::NONE, ..widget(rest, palette.edge, pressed) },
            hovered: widget(hover, palette.edge, strong),
            active: widget(active, palette.accent, strong),
            open: widget(active, palette.edge, strong),
        },
        selection: Selection { bg_fill: palette.selection[0], stroke: Stroke::new(1.0, palette.selection[1]) },
        hyperlink_color: palette.accent,
        faint_bg_color: palette.raised,
        extreme_bg_color: palette.sunk,
        code_bg_color: palette.raised,
        warn_fg_color: palette.warning,
        error_fg_color: palette.error,
        window_fill: palette.raised,
        window_stroke: Stroke::new(1.0, palette.edge),
        window_corner_radius: CornerRadius::same(6),
        menu_corner_radius: CornerRadius::same(6),
        panel_fill: palette.panel,
        window_shadow: shadow,
        popup_shadow: shadow,
        slider_trailing_fill: true,
        handle_shape: egui::style::HandleShape::Rect { aspect_ratio: 0.5 },
        ..theme.default_visuals()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance, as the Web Content Accessibility Guidelines define it.
    fn luminance(colour: Color32) -> f32 {
        let [red, green, blue, _] = egui::Rgba::from(colour).to_array();
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    }

    fn contrast(a: Color32, b: Color32) -> f32 {
        let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
        a.max(b) / a.min(b)
    }

    #[test]
    fn text_is_readable_on_every_background() {
        for palette in [&DARK, &LIGHT] {
            for ground in [palette.panel, palette.raised, palette.sunk] {
                for text in palette.text {
                    assert!(contrast(text, ground) >= 4.5, "{text:?} on {ground:?}: {}", contrast(text, ground));
                }
                for mark in [palette.accent, palette.warning, palette.error] {
                    assert!(contrast(mark, ground) >= 4.5, "{mark:?} on {ground:?}: {}", contrast(mark, ground));
                }
            }
            for button in palette.buttons {
                assert!(contrast(palette.text[1], button) >= 4.5, "{button:?}");
            }
            assert!(contrast(palette.selection[0], palette.selection[1]) >= 4.5);
        }
    }
}
