//! The tool bar of the live run.

use egui::Ui;
use orograph_graph::Unit;

use crate::editor::{Session, window::names::Named as _};

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
            let _ = ui.add(steps).named("number of steps");
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
                    ui.add(egui::ProgressBar::new(part).desired_width(160.0).text(told));
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

/// A time with at most one decimal.
fn span(seconds: f64) -> String {
    Unit::Seconds.display(if seconds < 60.0 { (seconds * 10.0).round() / 10.0 } else { seconds.round() })
}
