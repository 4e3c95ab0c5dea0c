//! The result of a node: the histogram of a raster, the measures and curves of a report, or the number of lines.

use std::sync::Arc;

use egui::{Grid, Label, RichText, Ui, vec2};
use orograph_graph::{Field, Lines, PortType, Report, Unit, Value, plain};

use super::form::{section, words};
use crate::{
    editor::Session,
    report::{reading, terminal::counted},
};

/// Bars of a histogram.
const BARS: usize = 64;

/// The histogram of a raster, cached until the raster changes.
#[derive(Debug)]
pub(super) struct Kept {
    /// The output, and the address of its samples: they never change in place.
    of: (String, usize),
    stats: Option<Arc<Stats>>,
}

/// The statistics of a plane of numbers.
#[derive(Clone, Debug, PartialEq)]
struct Stats {
    range: [f64; 2],
    mean: f64,
    /// The standard deviation.
    deviation: f64,
    /// The fraction of cells in each of [`BARS`] equal parts of the range.
    shares: Vec<f32>,
}

impl Stats {
    fn of(field: &Field) -> Option<Self> {
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

/// Shows the result of a node at the output in the viewport, or at its first output.
pub(super) fn show(ui: &mut Ui, kept: &mut Option<Kept>, session: &Session, node: &str) {
    let of_node = |port: &String| port.split_once('.').is_some_and(|(name, _)| name == node);
    let graph = session.document().graph();
    let Some(port) =
        session.shown().filter(of_node).or_else(|| graph.port(node).ok().map(|port| graph.port_name(port)))
    else {
        return;
    };
    let Some(built) = session.built(&port) else { return };
    let Ok(index) = graph.port(&port) else { return };
    let ty = graph.output_type(index);
    section(ui, "Result");
    let old = if built.revision < session.revision() && session.is_busy() { ", updating" } else { "" };
    ui.add(Label::new(RichText::new(format!("{port} at {} cells{old}", built.cells)).small().weak()).truncate());
    match &built.value {
        Value::Field(field) if field.planes() == 1 => {
            let of = (port, field.samples().as_ptr() as usize);
            if kept.as_ref().is_none_or(|kept| kept.of != of) {
                *kept = Some(Kept { of, stats: Stats::of(field).map(Arc::new) });
            }
            match kept.as_ref().and_then(|kept| kept.stats.clone()) {
                Some(stats) => numbers(ui, &stats, ty),
                None => drop(ui.weak("No cell has a value")),
            }
        }
        Value::Field(field) => {
            let names = planes(ty);
            for plane in 0..field.planes() {
                let (low, high) =
                    field.range(plane).map_or((0.0, 0.0), |(low, high)| (f64::from(low), f64::from(high)));
                let name = names.get(plane).map_or_else(|| (plane + 1).to_string(), |name| (*name).to_owned());
                ui.label(format!("{name}: {} to {}", plain(low), plain(high)));
            }
        }
        Value::Strata(found) => {
            let layers = &found.column().layers;
            ui.weak(counted(layers.len(), "layer"));
            super::column::draw(ui, layers, 120.0);
        }
        Value::Lines(found) => lines(ui, found),
        Value::Report(found) => report(ui, found),
        // never delivered
        Value::State(_) => {}
    }
}

/// The names of the planes of a raster with several.
const fn planes(ty: PortType) -> &'static [&'static str] {
    match ty {
        PortType::Colour | PortType::Normal => &["red", "green", "blue"],
        PortType::Weights => &["first", "second", "third", "fourth"],
        PortType::Vector(_) => &["east", "south"],
        _ => &[],
    }
}

fn numbers(ui: &mut Ui, stats: &Stats, ty: PortType) {
    histogram(ui, stats, ty.unit());
    let say = |value: f64| readable(ty.unit(), value);
    Grid::new("numbers").num_columns(2).spacing([12.0, 2.0]).show(ui, |ui| {
        let mut line = |name: &str, value: String| {
            ui.weak(name);
            ui.label(value);
            ui.end_row();
        };
        line("range", format!("{} to {}", say(stats.range[0]), say(stats.range[1])));
        line("mean", say(stats.mean));
        line("standard deviation", say(stats.deviation));
        if ty == PortType::Mask {
            line("coverage", format!("{} %", plain((stats.mean * 1000.0).round() / 10.0)));
        }
    });
}

/// A value with four digits and its unit.
fn readable(unit: Unit, value: f64) -> String {
    unit.display(format!("{value:.3e}").parse().unwrap_or(value))
}

fn histogram(ui: &mut Ui, stats: &Stats, unit: Unit) {
    let (response, painter) = ui.allocate_painter(vec2(ui.available_width(), 64.0), egui::Sense::hover());
    let rect = response.rect;
    let visuals = ui.visuals();
    painter.rect_filled(rect, 4.0, visuals.extreme_bg_color);
    let inside = rect.shrink(3.0);
    let most = stats.shares.iter().copied().fold(f32::MIN_POSITIVE, f32::max);
    let width = inside.width() / BARS as f32;
    for (at, share) in stats.shares.iter().enumerate() {
        // The square root makes rare values visible beside common ones.
        let height = (share / most).sqrt() * inside.height();
        let left = inside.left() + at as f32 * width;
        let bar = egui::Rect::from_min_max(
            egui::pos2(left, inside.bottom() - height),
            egui::pos2(left + width.max(1.0), inside.bottom()),
        );
        painter.rect_filled(bar, 0.0, visuals.hyperlink_color.gamma_multiply(0.8));
    }
    if let Some(pointer) = response.hover_pos() {
        let at = (((pointer.x - inside.left()) / width) as usize).min(BARS - 1);
        let [low, high] = stats.range;
        let edge = |at: usize| readable(unit, low + (high - low) * at as f64 / BARS as f64);
        let share = plain(f64::from((stats.shares[at] * 1e4).round() / 100.0));
        response.on_hover_text_at_pointer(format!("{} to {}: {share} % of the cells", edge(at), edge(at + 1)));
    }
}

fn lines(ui: &mut Ui, lines: &Lines) {
    let length = |line: &orograph_graph::Line| -> f64 {
        let pieces = line.vertices.windows(2);
        pieces
            .map(|pair| {
                let [a, b] = [pair[0].position_m, pair[1].position_m];
                ((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1])).sqrt()
            })
            .sum()
    };
    let total: f64 = lines.lines.iter().map(length).sum();
    let order = lines.lines.iter().map(|line| line.order).max().unwrap_or(0);
    let (count, length) = (counted(lines.lines.len(), "line"), readable(Unit::Metres, total));
    ui.label(format!("{count}, {length} in total, up to order {order}"));
}

fn report(ui: &mut Ui, report: &Report) {
    for note in &report.notes {
        ui.add(Label::new(RichText::new(note).color(ui.visuals().warn_fg_color)).wrap());
    }
    Grid::new("measures").num_columns(2).spacing([12.0, 2.0]).striped(true).show(ui, |ui| {
        for measure in &report.measures {
            ui.weak(words(&measure.name));
            ui.label(reading::value(measure));
            ui.end_row();
        }
    });
    for balance in &report.ledger {
        ui.add_space(4.0);
        ui.strong(words(&balance.material));
        Grid::new(("balance", &balance.material)).num_columns(2).spacing([12.0, 2.0]).striped(true).show(ui, |ui| {
            for [name, value] in reading::rows(balance) {
                ui.weak(name);
                ui.label(value);
                ui.end_row();
            }
        });
    }
    super::curves::show(ui, &report.series);
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
