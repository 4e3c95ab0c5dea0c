//! The tool bar of the live run.

use egui::Ui;
use orograph_graph::{Moment, Unit};

use crate::editor::{
    Session, Simulation,
    arithmetic::{calculated, typed},
    window::names::Named as _,
};

/// Width of the progress and of the slider beside it, in points.
const WIDTH: f32 = 160.0;

/// The tool bar, with its settings.
#[derive(Debug)]
pub(super) struct Bar {
    /// Number of steps per click on `Step`.
    steps: u32,
}

impl Default for Bar {
    fn default() -> Self {
        Self { steps: 10 }
    }
}

/// The `Live` button; present if a node runs live or the shown node can.
pub(super) fn toggle(ui: &mut Ui, session: &mut Session) {
    let running = session.simulation().map(|simulation| simulation.node().to_owned());
    let shown = session.shown().and_then(|port| Some(port.split_once('.')?.0.to_owned()));
    let Some(node) = running.clone().or(shown).filter(|node| session.can_simulate(node)) else { return };
    let mut on = running.is_some();
    let what = format!("Run `{node}` step by step and paint while it runs");
    if ui.toggle_value(&mut on, "Live").on_hover_text(what).changed() {
        if on {
            session.simulate(&node);
        } else {
            session.end_simulation();
        }
    }
}

impl Bar {
    pub(super) fn bar(&mut self, ui: &mut Ui, session: &mut Session) {
        let Some(simulation) = session.simulation().cloned() else { return };
        ui.horizontal_wrapped(|ui| {
            let begun = simulation.moment().is_some() && simulation.trouble().is_none();
            let on = begun && !simulation.is_over();
            let (name, what) = match simulation.goes() {
                true => ("Pause", "Pause the simulation"),
                false => ("Run", "Run to the end"),
            };
            if ui.add_enabled(on, egui::Button::new(name)).on_hover_text(what).clicked() {
                session.run_simulation(!simulation.goes());
            }
            let step = ui.add_enabled(on && !simulation.goes(), egui::Button::new("Step"));
            if step.on_hover_text("Advance by this many steps").clicked() {
                session.step_simulation(self.steps);
            }
            let steps = egui::DragValue::new(&mut self.steps).range(1..=10_000).speed(0.2).suffix(" steps");
            let _ = ui.add(typed(steps, Unit::One)).named("number of steps");
            pace(ui, session, simulation.pace());
            if ui.add_enabled(begun, egui::Button::new("Restart")).on_hover_text("Restart from the beginning").clicked() {
                session.restart_simulation();
            }
            ui.separator();
            match (simulation.trouble(), simulation.moment()) {
                (Some(trouble), _) => {
                    ui.colored_label(ui.visuals().error_fg_color, trouble);
                }
                (None, None) => {
                    ui.weak(format!("building the inputs of {} …", simulation.node()));
                }
                (None, Some(moment)) => {
                    let part = if moment.end > 0.0 { (moment.now / moment.end) as f32 } else { 1.0 };
                    let told = format!("{} of {}", span(moment.now), span(moment.end));
                    ui.add(egui::ProgressBar::new(part).desired_width(WIDTH).text(told));
                    scrub(ui, session, moment);
                    let hint = match moment.is_over() {
                        true => "Finished; the result is now the node's output.",
                        false => "Brush: raise or lower the ground, or add rain. Strokes are replayed at the time you painted them.",
                    };
                    ui.weak(hint);
                }
            }
        });
    }
}

/// The number that sets how long the whole run lasts.
fn pace(ui: &mut Ui, session: &mut Session, before: f64) {
    let mut seconds = before;
    let number = egui::DragValue::new(&mut seconds)
        .range(0.0..=3600.0)
        .speed(0.2)
        .max_decimals(1)
        .custom_formatter(|seconds, _| match seconds > 0.0 {
            true => format!("run lasts {} s", Unit::One.display(seconds)),
            false => "full speed".to_owned(),
        })
        .custom_parser(|text| Unit::One.parse(&calculated(Unit::One, text.trim().trim_end_matches('s'))).ok());
    let what = "Least time that the whole run takes, to watch it more slowly; 0 for full speed";
    if ui.add(number).on_hover_text(what).named("seconds of the run").changed() {
        session.pace_simulation(seconds);
    }
}

/// The slider that shows earlier moments. At its end it follows the run.
fn scrub(ui: &mut Ui, session: &mut Session, moment: Moment) {
    let times = session.earlier_times();
    if times.is_empty() {
        return;
    }
    let before = session.simulation().and_then(Simulation::shown_time);
    let now = before.unwrap_or(moment.now);
    let mut at = now;
    let slider = egui::Slider::new(&mut at, 0.0..=moment.end).show_value(false);
    let response = ui
        .scope(|ui| {
            ui.spacing_mut().slider_width = WIDTH;
            ui.add(slider)
        })
        .inner
        .named("time shown");
    let text = match before {
        Some(time) => format!("shows {}", span(time)),
        None => "shows the present".to_owned(),
    };
    ui.ctx().accesskit_node_builder(response.id, |node| node.set_value(text.clone()));
    if response.changed() {
        session.show_time(chosen(&times, moment.now, (now, at), response.dragged()));
    }
    response
        .on_hover_text("Drag to see earlier moments; the run itself does not change. At the end it follows the run");
    ui.label(text);
}

/// The moment for a new position of the slider: the nearest one; with a key, at least the next in that direction. Returns
/// None for the present.
fn chosen(times: &[f64], present: f64, (from, to): (f64, f64), dragged: bool) -> Option<f64> {
    let all = || times.iter().copied().chain([present]);
    let nearest =
        all().min_by(|a, b| (a - to).abs().total_cmp(&(b - to).abs())).filter(|time| dragged || *time != from);
    let next = || match to > from {
        true => all().find(|time| *time > from),
        false => times.iter().copied().rfind(|time| *time < from).or(times.first().copied()),
    };
    nearest.or_else(next).filter(|time| *time < present)
}

/// A time with at most one decimal.
fn span(seconds: f64) -> String {
    Unit::Seconds.display(if seconds < 60.0 { (seconds * 10.0).round() / 10.0 } else { seconds.round() })
}

#[cfg(test)]
mod tests {
    use super::chosen;

    #[test]
    fn the_slider_chooses_the_nearest_moment_and_keys_the_next() {
        let (times, present) = ([0.0, 100.0, 200.0], 290.0);
        let drag = |to| chosen(&times, present, (290.0, to), true);
        assert_eq!([drag(-5.0), drag(120.0), drag(151.0)], [Some(0.0), Some(100.0), Some(200.0)]);
        assert_eq!([drag(250.0), drag(1000.0)], [None, None], "nearer to the present, or beyond it");
        let press = |from, to| chosen(&times, present, (from, to), false);
        assert_eq!([press(290.0, 289.0), press(200.0, 199.0), press(0.0, -1.0)], [Some(200.0), Some(100.0), Some(0.0)]);
        assert_eq!([press(100.0, 101.0), press(200.0, 201.0)], [Some(200.0), None]);
        // A moment that is no longer in the list.
        assert_eq!([press(150.0, 151.0), press(150.0, 149.0)], [Some(200.0), Some(100.0)]);
    }
}
