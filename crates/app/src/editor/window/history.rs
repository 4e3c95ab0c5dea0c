//! The History pane: the steps of the undo history with what each changed, and snapshots to go back to or compare with.
//!
//! A step is described by the difference of the texts before and after it, as `orograph diff` prints it. Descriptions
//! are made when their rows are first seen, one in a frame.

use std::collections::BTreeMap;

use egui::{Button, Label, RichText, ScrollArea, Sense, Ui};
use orograph_graph::{Document, NodeEntry, ParamValue, diff};

use crate::{
    editor::{Session, window::names::Named as _},
    report::terminal::counted,
};

/// The History pane.
#[derive(Debug, Default)]
pub(crate) struct HistoryPane {
    /// What each step changed, by its number since the start of the session, which stays when old steps are forgotten.
    names: BTreeMap<usize, String>,
    /// The number of the session, and how many edits were made in it, when the descriptions were made.
    seen: (u64, usize),
}

impl HistoryPane {
    pub(crate) fn ui(&mut self, ui: &mut Ui, session: &mut Session) {
        self.follow(session);
        egui::Frame::new().inner_margin(egui::Margin::symmetric(10, 8)).show(ui, |ui| {
            ui.set_max_width(ui.available_width());
            snapshots(ui, session);
            ui.add_space(6.0);
            ui.strong("Steps");
            self.steps(ui, session);
        });
    }

    /// Forgets the descriptions of steps that are not the same any more.
    fn follow(&mut self, session: &Session) {
        let document = session.document();
        let now = (session.number(), document.edits_made());
        let (number, made) = std::mem::replace(&mut self.seen, now);
        if number != now.0 || made > now.1 {
            self.names.clear();
        } else if made < now.1 {
            // as many of the last steps are new or amended
            let kept = document.edits().saturating_sub(now.1 - made);
            self.names.retain(|number, _| *number < kept);
        }
    }

    fn steps(&mut self, ui: &mut Ui, session: &mut Session) {
        let (done, all) = (session.document().steps(), session.document().all_steps());
        let forgotten = forgotten(session.document());
        let height = ui.text_style_height(&egui::TextStyle::Body) + 4.0;
        let mut chosen = None;
        let mut lacks = None;
        let area = ScrollArea::vertical().auto_shrink(false).stick_to_bottom(true);
        area.show_rows(ui, height, all + 1, |ui, rows| {
            for row in rows {
                let text = match row.checked_sub(1) {
                    None => "Start".to_owned(),
                    Some(step) => self.names.get(&(forgotten + step)).cloned().unwrap_or_else(|| {
                        lacks.get_or_insert(step);
                        format!("Step {row}")
                    }),
                };
                let text = RichText::new(text.clone());
                let text = if row > done { text.weak().italics() } else { text };
                let label = ui.add(Button::selectable(row == done, text).truncate());
                if label.on_hover_text(self.hint(row, done, forgotten)).clicked() {
                    chosen = Some(row);
                }
            }
        });
        if let Some(step) = lacks {
            self.names.insert(forgotten + step, described(session.document(), step));
            ui.ctx().request_repaint();
        }
        if let Some(row) = chosen {
            session.go_to_step(row);
        }
    }

    fn hint(&self, row: usize, done: usize, forgotten: usize) -> String {
        let what =
            row.checked_sub(1).and_then(|step| self.names.get(&(forgotten + step))).map_or("the start", String::as_str);
        match row.cmp(&done) {
            std::cmp::Ordering::Less => format!("Undo back to: {what}"),
            std::cmp::Ordering::Equal => what.to_owned(),
            std::cmp::Ordering::Greater => format!("Redo up to: {what}"),
        }
    }
}

/// The number of steps before the first that can still be undone.
fn forgotten(document: &Document) -> usize {
    document.edits() - document.steps()
}

/// What a step changed.
fn described(document: &Document, step: usize) -> String {
    let (Some(before), Some(after)) = (document.text_at(step), document.text_at(step + 1)) else {
        return format!("Step {}", step + 1);
    };
    let [before, after] = [before, after].map(|text| Document::parse_in(text, document.folder(), document.registry()));
    // the fonts of the window have no arrow
    let mut lines: Vec<String> =
        diff(&before, &after).iter().map(|line| shortened(&after, line).replace('→', "to")).collect();
    // what came or went says more than its wires
    lines.sort_by_key(|line| !is_of_node(line));
    let subgraph = |end: &str| lines.iter().find(|line| is_of_node(line) && line.ends_with(end));
    let name = |line: &str| line.split(' ').nth(1).unwrap_or_default().to_owned();
    let others = |end: &str| lines.iter().filter(|line| is_of_node(line) && line.ends_with(end)).count();
    if let Some(made) = lines.iter().find(|line| is_of_node(line) && line.contains("(Subgraph) added"))
        && others("removed") > 0
    {
        return format!("subgraph {} made of {}", name(made), counted(others("removed"), "node"));
    }
    if let Some(gone) = subgraph("(Subgraph) removed")
        && lines.iter().any(|line| is_of_node(line) && line.contains(" added"))
    {
        return format!("subgraph {} replaced by its nodes", name(gone));
    }
    match lines.as_slice() {
        [] => unbuilt(&before, &after).to_owned(),
        [one] => one.clone(),
        [first, rest @ ..] => format!("{first}, and {} more", rest.len()),
    }
}

/// Returns true for a line of a difference about a whole node.
fn is_of_node(line: &str) -> bool {
    line.starts_with("node ")
}

/// A line of a difference without the points of lists: `paint.strokes: 3 strokes`.
fn shortened(after: &Document, line: &str) -> String {
    let Some((place, _)) = line.split_once(' ').filter(|(place, rest)| place.contains('.') && rest.contains('['))
    else {
        return line.to_owned();
    };
    let value = place.split_once('.').and_then(|(node, name)| {
        let index = after.node(node)?.index?;
        after.graph().instance(index).params.get(name)
    });
    match value {
        Some(ParamValue::Strokes(strokes)) => format!("{place}: {}", counted(strokes.len(), "stroke")),
        Some(ParamValue::Path(points)) => format!("{place}: {}", counted(points.len(), "point")),
        Some(ParamValue::Waypoints(points)) => format!("{place}: {}", counted(points.len(), "point")),
        _ => format!("{place} changed"),
    }
}

/// What a step changed that does not affect the build.
fn unbuilt(before: &Document, after: &Document) -> &'static str {
    let differ = |of: &dyn Fn(&NodeEntry) -> String| {
        let all = |document: &Document| document.nodes().iter().map(of).collect::<Vec<_>>();
        all(before) != all(after)
    };
    if differ(&|entry| entry.note.clone()) {
        return "note changed";
    }
    if before.frames().len() != after.frames().len() {
        return "frame added or removed";
    }
    let places = |document: &Document| {
        let frames = document.frames().iter().map(|entry| format!("{} {:?}", entry.name, entry.frame));
        let routes = document.reroutes().iter().map(|route| format!("{:?}", route.places));
        frames.chain(routes).collect::<Vec<_>>()
    };
    if differ(&|entry| format!("{:?}", entry.layout)) || places(before) != places(after) {
        return "nodes arranged";
    }
    "comments changed"
}

/// The snapshots, and the button that makes one.
fn snapshots(ui: &mut Ui, session: &mut Session) {
    ui.horizontal(|ui| {
        ui.strong("Snapshots");
        let can = session.shown().is_some_and(|port| session.built(&port).is_some());
        let add = ui.add_enabled(can, Button::new("Take snapshot").small());
        if add.on_hover_text("Keep the file and the shown terrain as they are now").clicked() {
            session.take_snapshot();
        }
    });
    let (mut compared, mut restored, mut removed) = (None, None, None);
    for snapshot in session.snapshots() {
        ui.horizontal(|ui| {
            let is_compared = session.compared() == Some(snapshot.name());
            let name = snapshot.name();
            if ui
                .selectable_label(is_compared, "A|B")
                .named(format!("compare {name}"))
                .on_hover_text("Compare with what is shown")
                .clicked()
            {
                compared = Some((!is_compared).then(|| snapshot.name().to_owned()));
            }
            let restore = ui.small_button("Restore").named(format!("Restore {name}"));
            if restore.on_hover_text("Go back to the file as it was, as one undo step").clicked() {
                restored = Some(snapshot.name().to_owned());
            }
            let remove = ui.add(Button::new("✖").small().frame(false)).named(format!("remove {name}"));
            if remove.on_hover_text("Remove the snapshot").clicked() {
                removed = Some(snapshot.name().to_owned());
            }
            let text = format!("{}: {}", snapshot.name(), snapshot.port());
            ui.add(Label::new(text).truncate().sense(Sense::hover()));
        });
    }
    if let Some(compared) = compared {
        session.compare(compared);
    }
    if let Some(name) = restored {
        session.restore_snapshot(&name);
    }
    if let Some(name) = removed {
        session.remove_snapshot(&name);
    }
}
