//! Round numbers for scale bars and contour lines, and the bar itself.

use egui::{Color32, FontId, Rect, Stroke, pos2, vec2};
use orograph_graph::Unit;

/// The largest of 1, 2 and 5 times a power of ten that is not above `most`.
pub(super) fn round_below(most: f64) -> f64 {
    if !(most.is_finite() && most > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powf(most.log10().floor());
    let step = [5.0, 2.0, 1.0].into_iter().find(|step| step * power <= most * (1.0 + 1e-9));
    step.unwrap_or(1.0) * power
}

/// The contour interval for a range of heights: gives ten to twenty-five lines.
pub(super) fn contour_step(range: f64) -> f64 {
    round_below(range / 10.0)
}

/// Draws a scale bar of a round length in the lower left corner; `place` says for which part of the view it holds.
pub(super) fn bar(painter: &egui::Painter, pane: Rect, metres_per_point: f64, place: &str) {
    let length = round_below(metres_per_point * 140.0);
    let width = (length / metres_per_point) as f32;
    let start = pane.left_bottom() + vec2(14.0, -14.0);
    let end = start + vec2(width, 0.0);
    let text = format!("{}{place}", Unit::Metres.display(length));
    let text = painter.layout_no_wrap(text, FontId::proportional(11.0), Color32::WHITE);
    let wide = width.max(text.size().x);
    let back = Rect::from_min_max(pos2(start.x - 6.0, start.y - 22.0), start + vec2(wide + 6.0, 6.0));
    painter.rect_filled(back, 3.0, Color32::from_black_alpha(140));
    let stroke = Stroke::new(1.5, Color32::WHITE);
    painter.line_segment([start, end], stroke);
    for at in [start, end] {
        painter.line_segment([at - vec2(0.0, 4.0), at + vec2(0.0, 2.0)], stroke);
    }
    let left = start.x + ((width - text.size().x) / 2.0).max(0.0);
    painter.galley(pos2(left, start.y - 5.0 - text.size().y), text, Color32::WHITE);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_round() {
        for (most, round) in [(140.0, 100.0), (99.9, 50.0), (0.47, 0.2), (5000.0, 5000.0), (1e6, 1e6)] {
            assert!((round_below(most) / round - 1.0).abs() < 1e-9, "{most} {}", round_below(most));
        }
        assert_eq!(round_below(0.0), 1.0);
        assert_eq!(contour_step(2600.0), 200.0);
    }
}
