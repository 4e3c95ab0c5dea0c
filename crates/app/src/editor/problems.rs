//! The pane of problems: all that is wrong with the file, each with a way to its node.

use orograph_graph::Severity;

use super::Session;

/// The pane of problems.
#[derive(Debug, Default)]
pub(super) struct Problems {}

impl Problems {
    /// The pane's name, with how many there are.
    pub(super) fn title(&self, session: &Session) -> String {
        match session.document().problems().len() {
            0 => "Problems".to_owned(),
            count => format!("Problems ({count})"),
        }
    }

    pub(super) fn ui(&mut self, ui: &mut egui::Ui, session: &mut Session) {
        let mut chosen = None;
        egui::ScrollArea::vertical().show(ui, |ui| {
            for problem in session.document().problems() {
                let (line, _) = problem.line_column(session.document().source());
                let colour = match problem.severity {
                    Severity::Error => ui.visuals().error_fg_color,
                    Severity::Warning => ui.visuals().warn_fg_color,
                };
                let label = ui.add(
                    egui::Label::new(egui::RichText::new(format!("{line}: {}", problem.message)).color(colour))
                        .sense(egui::Sense::click()),
                );
                if label.clicked() {
                    let entry = session.document().nodes().iter().find(|node| node.span.contains(&problem.span.start));
                    chosen = entry.map(|node| node.name.clone());
                }
            }
        });
        if let Some(name) = chosen {
            session.select_only(&name);
        }
    }
}
