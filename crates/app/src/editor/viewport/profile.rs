//! The measuring tool: length, rise and profile along a line.

use egui_plot::{Legend, Line as PlotLine, Plot, PlotPoints};
use orograph_graph::Unit;

use super::{
    Shown,
    map::{Line, Pointer, cell, short},
};

/// The measured line.
#[derive(Debug, Default)]
pub(super) struct Profile {
    line: Option<Line>,
    /// The start of the line while it is being drawn.
    from: Option<[f64; 2]>,
    /// True if the pane is open. It opens and closes after a drag, because it changes the size of the view, and so the
    /// place under the pointer.
    open: bool,
}

impl Profile {
    pub(super) const fn line(&self) -> Option<Line> {
        self.line
    }

    /// Draws the line with the pointer while the button is pressed.
    pub(super) fn drag(&mut self, pointer: &Pointer) {
        match (pointer.pressed, pointer.place) {
            (true, Some(place)) => {
                let from = *self.from.get_or_insert(place);
                self.line = Some([from, place]);
            }
            (true, None) => {}
            (false, _) => self.from = None,
        }
    }

    pub(super) const fn clear(&mut self) {
        self.line = None;
    }

    /// The pane with the profile, if there is a line.
    pub(super) fn panel(&mut self, ui: &mut egui::Ui, shown: &Shown, compared: Option<&Shown>) {
        let length = self.line.map_or(0.0, |[a, b]| (b[0] - a[0]).hypot(b[1] - a[1]));
        if self.from.is_none() {
            self.open = length > 0.0;
        }
        let Some(line) = self.line.filter(|_| self.open) else { return };
        egui::Panel::bottom("profile").resizable(true).default_size(150.0).show(ui, |ui| {
            let own = samples(shown, line);
            let unit = shown.ty.unit();
            ui.horizontal(|ui| {
                ui.label(format!("length {}", short(Unit::Metres, length)));
                if let (Some(first), Some(last)) = (own.first(), own.last()) {
                    let rise = last[1] - first[1];
                    ui.label(format!("from {} to {}", short(unit, first[1]), short(unit, last[1])));
                    if unit == Unit::Metres && length > 0.0 {
                        ui.label(format!("mean slope {:.1}°", (rise / length).atan().to_degrees()));
                    }
                }
            });
            let plot = Plot::new("profile plot")
                .legend(Legend::default())
                .allow_scroll(false)
                .allow_drag(false)
                .allow_zoom(false);
            let plot = if compared.is_some() { plot.legend(Legend::default()) } else { plot };
            plot.x_axis_formatter(|mark, _| Unit::Metres.display(mark.value))
                .y_axis_formatter(move |mark, _| unit.display(mark.value))
                .show(ui, |plot| {
                    plot.line(PlotLine::new(shown.port.clone(), PlotPoints::from(own)));
                    if let Some(compared) = compared.filter(|compared| compared.ty.unit() == unit) {
                        let points = PlotPoints::from(samples(compared, line));
                        plot.line(PlotLine::new(compared.port.clone(), points));
                    }
                });
        });
    }
}

/// Distance and value along a line, one sample per cell, in at most 2000 steps.
fn samples(shown: &Shown, [a, b]: Line) -> Vec<[f64; 2]> {
    let length = (b[0] - a[0]).hypot(b[1] - a[1]);
    let steps = ((length / shown.field.window().cell_m()).ceil() as usize).clamp(1, 2000);
    let values = shown.field.plane(0);
    let point = |step: usize| {
        let share = step as f64 / steps as f64;
        let at = cell(shown, [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])])?;
        Some([share * length, f64::from(values[at])])
    };
    (0..=steps).filter_map(point).collect()
}
