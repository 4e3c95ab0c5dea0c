//! The histogram of a raster: its bars, with an axis of values and an axis of shares.

use egui::{Align2, FontId, Rect, Sense, Ui, WidgetInfo, WidgetType, pos2, vec2};
use orograph_graph::{Field, Unit, plain};

use super::shown::readable;
use crate::export::plot::round_values;

/// Bars of a histogram.
const BARS: usize = 64;
/// Height of the bars, and of the values below them, in points.
const HEIGHT: f32 = 72.0;
const BELOW: f32 = 18.0;
/// Room for the shares on the left.
const LEFT: f32 = 40.0;

/// The statistics of a plane of numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stats {
    pub(super) range: [f64; 2],
    pub(super) mean: f64,
    /// The standard deviation.
    pub(super) deviation: f64,
    /// The fraction of cells in each of [`BARS`] equal parts of the range.
    shares: Vec<f32>,
}

impl Stats {
    pub(super) fn of(field: &Field) -> Option<Self> {
        let (low, high) = field.range(0)?;
        let mut counts = [0_u64; BARS];
        let span = f64::from(high) - f64::from(low);
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0_u64);
        for value in field.plane(0).iter().filter(|value| value.is_finite()) {
            let above = f64::from(*value) - f64::from(low);
            sum += above;
            squares += above * above;
            count += 1;
            let bar = if span > 0.0 { (above / span * BARS as f64) as usize } else { 0 };
            counts[bar.min(BARS - 1)] += 1;
        }
        let mean = sum / count as f64;
        let deviation = (squares / count as f64 - mean * mean).max(0.0).sqrt();
        let shares = counts.iter().map(|bar| *bar as f32 / count as f32).collect();
        Some(Self { range: [f64::from(low), f64::from(high)], mean: f64::from(low) + mean, deviation, shares })
    }
}

/// Draws the histogram. The axis of shares is that of their square roots, so that rare values are visible beside common
/// ones.
pub(super) fn draw(ui: &mut Ui, stats: &Stats, unit: Unit) {
    let size = vec2(ui.available_width(), HEIGHT + BELOW);
    let (response, painter) = ui.allocate_painter(size, Sense::hover());
    let rect = Rect::from_min_max(response.rect.min + vec2(LEFT, 6.0), response.rect.max - vec2(3.0, BELOW));
    let visuals = ui.visuals();
    let (font, ink) = (FontId::proportional(10.5), visuals.weak_text_color());
    let stroke = visuals.widgets.noninteractive.bg_stroke;
    painter.rect_filled(rect, 2.0, visuals.extreme_bg_color);

    let most = stats.shares.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
    for part in [0.0, 0.5, 1.0_f32] {
        let y = rect.bottom() - part * rect.height();
        painter.hline(rect.x_range(), y, stroke);
        let share = percent(most * part * part);
        painter.text(pos2(rect.left() - 5.0, y), Align2::RIGHT_CENTER, share, font.clone(), ink);
    }
    let width = rect.width() / BARS as f32;
    for (at, share) in stats.shares.iter().enumerate() {
        let height = (share / most).sqrt() * rect.height();
        let left = rect.left() + at as f32 * width;
        let bar = Rect::from_min_max(pos2(left, rect.bottom() - height), pos2(left + width.max(1.0), rect.bottom()));
        painter.rect_filled(bar, 0.0, visuals.hyperlink_color.gamma_multiply(0.8));
    }

    let [low, high] = stats.range;
    let place = |value: f64| if high > low { ((value - low) / (high - low)) as f32 } else { 0.5 };
    let mut end = f32::NEG_INFINITY;
    for value in if high > low { round_values(stats.range, 4) } else { vec![low] } {
        let x = rect.left() + place(value) * rect.width();
        painter.vline(x, rect.bottom()..=rect.bottom() + 3.0, stroke);
        let text = painter.layout_no_wrap(readable(unit, value), font.clone(), ink);
        // A label that has no room beside the last one is left out.
        let right = response.rect.right() - text.size().x;
        let left = (x - text.size().x / 2.0).min(right).max(response.rect.left());
        if left > end + 4.0 {
            end = left + text.size().x;
            painter.galley(pos2(left, rect.bottom() + 4.0), text, ink);
        }
    }

    let say = |value: f64| readable(unit, value);
    let name = format!("histogram: {} to {}, at most {} of the cells in a bar", say(low), say(high), percent(most));
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Other, true, &name));
    if let Some(pointer) = response.hover_pos() {
        let at = (((pointer.x - rect.left()) / width).max(0.0) as usize).min(BARS - 1);
        let edge = |at: usize| say(low + (high - low) * at as f64 / BARS as f64);
        let share = percent(stats.shares[at]);
        response.on_hover_text_at_pointer(format!("{} to {}: {share} of the cells", edge(at), edge(at + 1)));
    }
}

/// A share, as text.
fn percent(share: f32) -> String {
    let percent = f64::from(share) * 100.0;
    let step = if percent < 1.0 { 100.0 } else { 10.0 };
    format!("{} %", plain((percent * step).round() / step))
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Window, World};

    use super::*;

    #[test]
    fn a_histogram_counts_every_cell_once() {
        let world = World { size: [4.0, 1.0], cells: [4, 1], ..World::default() };
        let stats = Stats::of(&Field::new(Window::whole(world), vec![0.0, 0.0, 1.0, 3.0])).expect("cells");
        assert_eq!((stats.range, stats.mean, stats.deviation), ([0.0, 3.0], 1.0, 1.5_f64.sqrt()));
        assert_eq!((stats.shares[0], stats.shares[BARS - 1], stats.shares.iter().sum::<f32>()), (0.5, 0.25, 1.0));
        let level = Stats::of(&Field::constant(Window::whole(world), 7.0)).expect("cells");
        assert_eq!((level.mean, level.deviation, level.shares[0]), (7.0, 0.0, 1.0));
    }
}
