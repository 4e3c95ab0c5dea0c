//! The result of a node: the histogram of a raster, the measures and curves of a report, or the number of lines.

use std::sync::Arc;

use egui::{Grid, Label, RichText, Ui};
use orograph_graph::{Lines, PortType, Report, Unit, Value, plain};

use super::{
    form::{section, words},
    histogram::{self, Stats},
};
use crate::{
    editor::Session,
    report::{reading, terminal::counted},
};

/// The histogram of a raster, cached until the raster changes.
#[derive(Debug)]
pub(super) struct Kept {
    /// The output, and the address of its samples: they never change in place.
    of: (String, usize),
    stats: Option<Arc<Stats>>,
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
    histogram::draw(ui, stats, ty.unit());
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
pub(super) fn readable(unit: Unit, value: f64) -> String {
    unit.display(format!("{value:.3e}").parse().unwrap_or(value))
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
