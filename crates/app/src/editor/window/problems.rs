//! The Problems pane: all problems of the file and of the results, each with a link to its node.

use egui::{Label, RichText, ScrollArea, Sense, Ui};
use orograph_graph::{Diagnostic, Severity};

use crate::editor::{NodeState, Session};

/// The code of the problem that nothing is written. Its text is for those who write the file by hand.
const NO_OUTPUTS: &str = "no-outputs";

/// The Problems pane.
#[derive(Debug, Default)]
pub(crate) struct Problems {}

/// A problem.
struct Line {
    severity: Severity,
    /// A line of the file, or a node.
    place: String,
    message: String,
    hint: Option<String>,
    node: Option<String>,
}

impl Problems {
    /// The pane's name, with the number of problems.
    pub(crate) fn title(&self, session: &Session) -> String {
        let failed = session
            .document()
            .nodes()
            .iter()
            .filter(|node| matches!(session.info(&node.name).state, NodeState::Failed { at: None, .. }));
        match problems(session).count() + failed.count() + missed(session).len() {
            0 => "Problems".to_owned(),
            count => format!("Problems ({count})"),
        }
    }

    pub(crate) fn ui(&mut self, ui: &mut Ui, session: &mut Session) {
        let (file, built, unknown) = (of_file(session), of_nodes(session), placeholders(session));
        let missed = missed(session);
        let mut chosen = None;
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            egui::Frame::new().inner_margin(egui::Margin::symmetric(10, 8)).show(ui, |ui| {
                ui.set_max_width(ui.available_width());
                if file.is_empty() && built.is_empty() && missed.is_empty() {
                    ui.weak("No problems.");
                }
                for (title, lines) in
                    [("In the file", &file), ("In the results", &built), ("Missed expectations", &missed)]
                {
                    if lines.is_empty() {
                        continue;
                    }
                    ui.strong(title);
                    for line in lines {
                        if show(ui, line) {
                            chosen.clone_from(&line.node);
                        }
                    }
                    ui.add_space(6.0);
                }
                expectations(ui, session);
                if !unknown.is_empty() {
                    ui.strong("Nodes that cannot be used");
                    ui.add(Label::new(RichText::new("They are kept in the file unchanged.").weak()).wrap());
                    for (name, kind) in &unknown {
                        if ui.link(format!("{name}: {kind}")).clicked() {
                            chosen = Some(name.clone());
                        }
                    }
                }
            });
        });
        if let Some(name) = chosen {
            session.select_only(&name);
        }
    }
}

/// Shows a problem. Returns true if its node was clicked.
fn show(ui: &mut Ui, line: &Line) -> bool {
    let (icon, colour) = match line.severity {
        Severity::Error => ("⛔", ui.visuals().error_fg_color),
        Severity::Warning => ("⚠", ui.visuals().warn_fg_color),
        Severity::Note => ("ℹ", ui.visuals().text_color()),
    };
    let mut clicked = false;
    ui.horizontal_top(|ui| {
        ui.colored_label(colour, icon);
        ui.vertical(|ui| {
            let message = ui.add(Label::new(&line.message).wrap().sense(Sense::click()));
            clicked |= message.clicked();
            if let Some(hint) = &line.hint {
                ui.add(Label::new(RichText::new(hint).weak()).wrap());
            }
            match &line.node {
                Some(node) => {
                    let way = ui.link(RichText::new(format!("{}, go to {node}", line.place)).small());
                    clicked |= way.clicked();
                }
                None => drop(ui.label(RichText::new(&line.place).small().weak())),
            }
        });
    });
    ui.add_space(3.0);
    clicked
}

/// The problems of the document. The missing outputs of an empty graph are none, because there is nothing to write yet.
fn problems(session: &Session) -> impl Iterator<Item = &Diagnostic> {
    let empty = session.document().nodes().is_empty();
    session.document().problems().iter().filter(move |problem| !empty || problem.code != NO_OUTPUTS)
}

/// The problems of the file.
fn of_file(session: &Session) -> Vec<Line> {
    let document = session.document();
    let lines = problems(session).map(|problem| {
        let (line, _) = problem.line_column(document.source());
        let at = problem.span.start;
        let node = document.nodes().iter().find(|node| node.span.contains(&at)).map(|node| node.name.clone());
        // A problem of an output belongs to the node of the output.
        let of_output = || {
            let output = document.outputs().iter().find(|output| output.span.contains(&at))?;
            Some(document.graph().instance(output.port.node).name.clone())
        };
        if problem.code == NO_OUTPUTS {
            return Line {
                severity: problem.severity,
                place: "outputs".to_owned(),
                message: "the graph has no outputs, so there is nothing to export".to_owned(),
                hint: Some("tick “output” on a node in the inspector".to_owned()),
                node: None,
            };
        }
        Line {
            severity: problem.severity,
            place: format!("line {line}"),
            message: problem.message.clone(),
            hint: problem.hint.clone(),
            node: node.or_else(of_output),
        }
    });
    lines.collect()
}

/// The nodes that failed themselves, and the warnings of nodes.
fn of_nodes(session: &Session) -> Vec<Line> {
    let mut lines = Vec::new();
    for node in session.document().nodes() {
        let info = session.info(&node.name);
        let line = |severity, message: String, hint| Line {
            severity,
            place: node.kind.clone(),
            message,
            hint,
            node: Some(node.name.clone()),
        };
        if let NodeState::Failed { message, hint, at: None } = &info.state {
            lines.push(line(Severity::Error, message.clone(), hint.clone()));
        }
        lines.extend(info.warnings.iter().map(|warning| line(Severity::Warning, warning.clone(), None)));
    }
    lines
}

/// The expectations that the terrain does not meet. A preview on larger cells than they are about misses none.
fn missed(session: &Session) -> Vec<Line> {
    let node = expected_node(session);
    let line = |message: String| Line {
        severity: Severity::Warning,
        place: "expectation".to_owned(),
        message,
        hint: None,
        node: node.clone(),
    };
    match session.checked().map(|measured| &measured.checked) {
        Some(Ok(checked)) => checked.missed().map(|figure| line(figure.text())).collect(),
        Some(Err(why)) => vec![line(format!("expectations cannot be measured: {why}"))],
        None => Vec::new(),
    }
}

/// The node whose output is measured.
fn expected_node(session: &Session) -> Option<String> {
    let document = session.document();
    let name = document.expectations()?.output.as_ref()?;
    let output = document.outputs().iter().find(|output| output.name == *name)?;
    Some(document.graph().instance(output.port.node).name.clone())
}

/// Lists what the file expects and is not among the problems, and says what the figures belong to.
fn expectations(ui: &mut Ui, session: &Session) {
    let Some(expected) = session.document().expectations() else { return };
    let Some(output) = &expected.output else { return };
    let measured = session.checked();
    let figures = measured.and_then(|measured| measured.checked.as_ref().ok());
    ui.strong("Expectations");
    let is_old = measured.is_none_or(|measured| measured.revision < session.revision());
    let state = match figures {
        _ if is_old && session.is_busy() => "Measured when everything is built.".to_owned(),
        _ if is_old => format!("Show {output} to measure it."),
        Some(checked) => format!("Measured in {output}, {}.", checked.place),
        None => String::new(),
    };
    ui.add(Label::new(RichText::new(state).small().weak()).wrap());
    for note in figures.iter().flat_map(|checked| &checked.notes) {
        ui.add(Label::new(RichText::new(note).small().weak()).wrap());
    }
    for one in &expected.list {
        let figure = figures.and_then(|checked| checked.figures.iter().find(|figure| figure.expectation == *one));
        let text = match figure {
            Some(figure) => {
                let is_coarse = figures.is_some_and(|checked| checked.is_coarse);
                let outside = match figure.is_met() {
                    true => "",
                    false if is_coarse => ", out of bounds at this cell size",
                    false => continue,
                };
                format!("{}: {} ({}{outside})", one.measure.name, one.display(figure.value), one.bounds_text())
            }
            None => format!("{}: {}", one.measure.name, one.bounds_text()),
        };
        ui.add(Label::new(text).wrap());
    }
    ui.add_space(6.0);
}

/// The nodes of unknown types.
fn placeholders(session: &Session) -> Vec<(String, String)> {
    let unknown = session.document().nodes().iter().filter(|node| node.index.is_none());
    unknown.map(|node| (node.name.clone(), node.kind.clone())).collect()
}
