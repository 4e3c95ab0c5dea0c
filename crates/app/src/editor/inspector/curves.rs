//! The curves of a report, those of one name in one plot.

use egui::{Color32, Ui};
use egui_plot::{Bar, BarChart, HoverPosition, Legend, Line, LineStyle, Plot, PlotPoints, PlotUi};
use orograph_graph::Series;
use orograph_nodes::numerics::math;

use super::form::words;
use crate::{
    export::plot::{self, Theme},
    report::reading,
};

/// Height of a plot in points.
const HEIGHT: f32 = 150.0;

/// Shows the curves: that of what was measured, and dashed those of references.
pub(super) fn show(ui: &mut Ui, series: &[Series]) {
    for own in series.iter().filter(|series| series.of.is_none()) {
        ui.add_space(4.0);
        ui.strong(words(&own.name));
        let beside = series.iter().filter(|other| other.name == own.name && other.of.is_some());
        let beside: Vec<&Series> = beside.take(plot::CURVES - 1).collect();
        let [log_x, log_y] = [own.x.log, own.y.log];
        let plot = Plot::new(("series", &own.name)).height(HEIGHT).x_axis_label(plot::title(&own.x));
        let plot = plot.y_axis_label(plot::title(&own.y)).allow_scroll(false).allow_zoom(false).allow_drag(false);
        let plot = plot.x_axis_formatter(move |mark, _| tick(mark.value, log_x));
        let plot = plot.y_axis_formatter(move |mark, _| tick(mark.value, log_y));
        let plot = plot.label_formatter(move |hover| {
            let (HoverPosition::NearDataPoint { position, .. } | HoverPosition::Elsewhere { position }) = hover;
            let [x, y] =
                [(position.x, log_x), (position.y, log_y)].map(|(at, log)| reading::significant(number(at, log)));
            Some(format!("{x}, {y}"))
        });
        let plot = if beside.is_empty() { plot } else { plot.legend(Legend::default().background_alpha(0.6)) };
        let theme = if ui.visuals().dark_mode { Theme::Dark } else { Theme::Light };
        let colour = |at: usize| {
            let [r, g, b] = theme.colour(at);
            Color32::from_rgb(r, g, b)
        };
        plot.allow_boxed_zoom(false).show(ui, |plot| {
            let name = if beside.is_empty() { words(&own.name) } else { "this terrain".to_owned() };
            curve(plot, own, name, colour(0));
            for (at, other) in beside.iter().enumerate() {
                let name = other.of.clone().unwrap_or_default();
                let line = Line::new(name, PlotPoints::from(points(other))).color(colour(at + 1)).width(1.5);
                plot.line(line.style(LineStyle::dashed_dense()));
            }
        });
    }
}

/// The curve of what was measured: a line, or the bars of a histogram.
fn curve(plot: &mut PlotUi<'_>, series: &Series, name: String, colour: Color32) {
    match series.bars() {
        Some(bars) => {
            let bar = |[from, to, height]: [f64; 3]| Bar::new(0.5 * (from + to), height).width(to - from);
            let bars = bars.into_iter().filter(|bar| bar[2].is_finite()).map(bar).collect();
            plot.bar_chart(BarChart::new(name, bars).color(colour));
        }
        None => plot.line(Line::new(name, PlotPoints::from(points(series))).color(colour).width(1.5)),
    }
}

/// The points of a curve at their places on the axes; those of a histogram are the middles of its bars.
fn points(series: &Series) -> Vec<[f64; 2]> {
    let [log_x, log_y] = [series.x.log, series.y.log];
    let place = |value: f64, log: bool| if log { math::log10(value) } else { value };
    let pairs = match series.bars() {
        Some(bars) => bars.into_iter().map(|[from, to, height]| [0.5 * (from + to), height]).collect(),
        None => series.x.values.iter().zip(&series.y.values).map(|(x, y)| [*x, *y]).collect::<Vec<_>>(),
    };
    let points = pairs.into_iter().map(|[x, y]| [place(x, log_x), place(y, log_y)]);
    points.filter(|[x, y]| x.is_finite() && y.is_finite()).collect()
}

/// The number at a place of an axis.
fn number(place: f64, log: bool) -> f64 {
    if log { math::pow(10.0, place) } else { place }
}

/// The text of a mark on an axis. A logarithmic one has texts at powers of ten and at the numbers between that have few
/// digits.
fn tick(place: f64, log: bool) -> String {
    let shown = number(place, log);
    if log && place.fract() != 0.0 { reading::significant(shown) } else { plot::tick(shown, log) }
}

#[cfg(test)]
mod tests {
    use orograph_graph::Axis;

    use super::*;

    #[test]
    fn marks_of_a_logarithmic_axis_are_powers_of_ten() {
        assert_eq!(["10⁵", "100", "31.62"], [5.0, 2.0, 1.5].map(|place| tick(place, true)));
        assert_eq!(tick(-0.2, false), "−0.2");
    }

    #[test]
    fn points_of_a_histogram_are_the_middles_of_its_bars() {
        let of = |name: &str| {
            Series::new(name, Axis::new("slope from", "°", vec![0.0, 10.0]), Axis::new("share", "", vec![0.4, 0.6]))
        };
        assert_eq!(points(&of("slope_histogram")), [[5.0, 0.4], [15.0, 0.6]]);
        assert_eq!(points(&of("profile")), [[0.0, 0.4], [10.0, 0.6]]);
    }
}
