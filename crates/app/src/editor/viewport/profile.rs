//! The measuring tool: length, rise and profile along a line.

use egui_plot::{GridInput, GridMark, Legend, Line as PlotLine, Plot, PlotPoints};
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
                .x_grid_spacer(round_numbers(10.0))
                .y_grid_spacer(round_numbers(2.0))
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

/// Lines at multiples of 1, 2 or 5 times a power of ten, so many times the least distance apart that each has room for
/// its number. The plot's own steps are powers of ten, of which a range may have none.
fn round_numbers(apart: f64) -> impl Fn(GridInput) -> Vec<GridMark> {
    const MOST: f64 = 100.0;
    move |GridInput { bounds: (low, high), base_step_size }| {
        let least = apart * base_step_size;
        let power = 10_f64.powi(least.log10().floor() as i32);
        let step_size = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * power).into_iter().find(|step| *step >= least);
        let Some(step_size) = step_size.filter(|step| step.is_finite() && (high - low) / step < MOST) else {
            return Vec::new();
        };
        let first = (low / step_size).ceil() as i64;
        let last = (high / step_size).floor() as i64;
        (first..=last).map(|count| GridMark { value: count as f64 * step_size, step_size }).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_at_round_numbers_with_room_between() {
        let marks = |bounds, base_step_size| -> Vec<f64> {
            round_numbers(3.5)(GridInput { bounds, base_step_size }).iter().map(|mark| mark.value).collect()
        };
        assert_eq!(marks((270.0, 910.0), 50.0), [400.0, 600.0, 800.0]);
        assert_eq!(marks((-0.25, 0.25), 0.02), [-0.2, -0.1, 0.0, 0.1, 0.2]);
        assert!(marks((0.0, 1e9), 1e-3).is_empty());
    }
}
