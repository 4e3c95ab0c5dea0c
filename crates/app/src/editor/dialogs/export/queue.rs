//! The queue of builds: one runs at a time, the others wait.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    time::Duration,
};

use egui::{Button, CollapsingHeader, Context, Label, ProgressBar, RichText, Ui, UserAttentionType, ViewportCommand};
use orograph_graph::NodeIndex;

use super::{
    job::{Job, State},
    result,
};
use crate::{
    build::request::Request,
    editor::{Session, window::names::Named as _},
    export::outputs::OutputOptions,
    report::{
        failure::{Exit, Failure},
        progress::seconds,
    },
};

/// Builds in the order in which they were asked for.
#[derive(Debug, Default)]
pub(super) struct Queue {
    builds: Vec<Build>,
    /// Number of builds that were added so far.
    added: usize,
    /// True while the list scrolls to the last build, which may be below its end.
    follows: bool,
}

/// A build that waits, runs or has ended.
#[derive(Debug)]
struct Build {
    /// Distinguishes it from the others.
    id: usize,
    /// The graph, the folder, the outputs and the cells.
    title: String,
    folder: PathBuf,
    /// The files that it can write.
    files: Vec<PathBuf>,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    Waiting(Box<Order>),
    Running(Job),
    Ended(Box<State>),
}

/// The settings of a waiting build.
#[derive(Debug)]
struct Order {
    request: Request,
    options: OutputOptions,
    shares: BTreeMap<NodeIndex, f32>,
}

impl Queue {
    /// Adds a build of the document of a session in its current state, which can write these files.
    pub(super) fn add(
        &mut self,
        session: &Session,
        request: Request,
        (folder, files): (PathBuf, Vec<PathBuf>),
        options: OutputOptions,
    ) {
        let name = session.title();
        let outputs: Vec<&str> = request.outputs.iter().map(|output| output.name.as_str()).collect();
        let [nx, ny] = request.world.cells;
        let place = folder.file_name().unwrap_or_default().to_string_lossy();
        let samples = match request.supersample() {
            1 => String::new(),
            factor => format!(" of {factor} x {factor} samples"),
        };
        let title = format!("{name} to {place}: {}, {nx} x {ny} cells{samples}", outputs.join(", "));
        let shares = shares(session, &request);
        let stage = Stage::Waiting(Box::new(Order { request, options, shares }));
        self.builds.push(Build { id: self.added, title, folder, files, stage });
        self.added += 1;
        self.follows = true;
    }

    /// Returns true if a build that waits or runs can write a file.
    pub(super) fn writes(&self, file: &Path) -> bool {
        let is_open = |build: &&Build| !matches!(build.stage, Stage::Ended(_));
        self.builds.iter().filter(is_open).any(|build| build.files.iter().any(|other| other == file))
    }

    /// Starts the next build if none runs, and reports those that have ended.
    pub(super) fn poll(&mut self, context: &Context, session: &mut Session) {
        let mut ended = false;
        for build in &mut self.builds {
            let Stage::Running(job) = &build.stage else { continue };
            let state = job.state();
            if let Some(end) = &state.end {
                match end {
                    Ok(built) => {
                        let (files, folder) = (result::count(built), build.folder.display());
                        session.note(format!("Exported {files} to {folder} in {}", seconds(built.time)), false);
                        ended = true;
                    }
                    Err(failure) => ended |= build.failed(session, failure),
                }
                build.stage = Stage::Ended(Box::new(state));
            }
        }
        let runs = |build: &Build| matches!(build.stage, Stage::Running(_));
        while !self.builds.iter().any(runs)
            && let Some(next) = self.builds.iter_mut().find(|build| matches!(build.stage, Stage::Waiting(_)))
        {
            ended |= !next.begin(context, session);
        }
        if ended && !self.builds.iter().any(runs) {
            context.send_viewport_cmd(ViewportCommand::RequestUserAttention(UserAttentionType::Informational));
        }
    }

    /// The running build and the number of those that wait, as text. Returns None when none runs.
    pub(super) fn summary(&self) -> Option<String> {
        let running = self.builds.iter().find_map(|build| match &build.stage {
            Stage::Running(job) => Some(job.state()),
            _ => None,
        })?;
        let left = running.remaining().map_or_else(String::new, |time| format!(", {}", left(time)));
        let waiting = match self.builds.iter().filter(|build| matches!(build.stage, Stage::Waiting(_))).count() {
            0 => String::new(),
            waiting => format!(", {waiting} waiting"),
        };
        Some(format!("Exporting, {:.0} %{left}{waiting}", 100.0 * running.fraction()))
    }

    /// The list of builds.
    pub(super) fn ui(&mut self, ui: &mut Ui) {
        if self.builds.is_empty() {
            return;
        }
        ui.separator();
        ui.horizontal(|ui| {
            ui.strong("Exports");
            let ended = |build: &Build| matches!(build.stage, Stage::Ended(_));
            if self.builds.iter().filter(|build| ended(build)).count() > 1 && ui.small_button("Clear").clicked() {
                self.builds.retain(|build| !ended(build));
            }
        });
        let last = self.builds.last().map(|build| build.id);
        let mut gone = BTreeSet::new();
        for build in &self.builds {
            let is_last = last == Some(build.id);
            let (follows, ended) = (is_last && self.follows, matches!(build.stage, Stage::Ended(_)));
            if follows && ended {
                ui.scroll_to_cursor(Some(egui::Align::TOP));
                self.follows = false;
            }
            ui.add_space(4.0);
            if ui.push_id(build.id, |ui| build.ui(ui, is_last)).inner {
                gone.insert(build.id);
            }
            if follows && !ended {
                ui.scroll_to_cursor(Some(egui::Align::BOTTOM));
            }
        }
        self.builds.retain(|build| !gone.contains(&build.id));
    }
}

impl Build {
    /// Starts to build, if it waits. Returns false if it failed at once.
    fn begin(&mut self, context: &Context, session: &mut Session) -> bool {
        let nothing = Stage::Ended(Box::default());
        let order = match std::mem::replace(&mut self.stage, nothing) {
            Stage::Waiting(order) => *order,
            other => {
                self.stage = other;
                return true;
            }
        };
        let Order { request, options, shares } = order;
        let request = request.with_graph(|graph| session.preferences().applied(graph));
        match Job::start(session.evaluator(), request, self.folder.clone(), options, shares, context) {
            Ok(job) => self.stage = Stage::Running(job),
            Err(failure) => {
                self.failed(session, &failure);
                self.stage = Stage::Ended(Box::new(State::failed(failure)));
                return false;
            }
        }
        true
    }

    /// Reports a failure. Returns false if it is that the build was cancelled, which needs no message.
    fn failed(&self, session: &mut Session, failure: &Failure) -> bool {
        let is_failure = failure.exit != Exit::Stopped;
        if is_failure {
            session.note(format!("The export of {} failed: {failure}", self.title), true);
        }
        is_failure
    }

    /// The build with its progress or result. Returns true if it is to be removed.
    fn ui(&self, ui: &mut Ui, is_last: bool) -> bool {
        ui.add(Label::new(&self.title).truncate()).on_hover_text(self.folder.display().to_string());
        match &self.stage {
            Stage::Waiting(_) => {
                let mut gone = false;
                ui.horizontal(|ui| {
                    gone = ui.small_button("Cancel").named(format!("Cancel the export of {}", self.title)).clicked();
                    ui.weak("Waiting");
                });
                return gone;
            }
            Stage::Running(job) => {
                let state = job.state();
                ui.add(ProgressBar::new(state.fraction()).desired_height(8.0));
                ui.horizontal(|ui| {
                    let cancel = ui.add_enabled(!job.is_cancelled(), Button::new("Cancel").small());
                    if cancel.named(format!("Cancel the export of {}", self.title)).clicked() {
                        job.cancel();
                    }
                    ui.add(Label::new(doing(job, &state)).truncate());
                });
                warnings(ui, &state);
            }
            Stage::Ended(state) => {
                match &state.end {
                    Some(Ok(built)) if is_last => result::done(ui, built, &self.folder),
                    Some(Ok(built)) => {
                        let text = result::headline(built);
                        CollapsingHeader::new(text).show(ui, |ui| result::done(ui, built, &self.folder));
                    }
                    Some(Err(failure)) => result::failure(ui, failure),
                    None => {}
                }
                warnings(ui, state);
            }
        }
        false
    }
}

/// What a running build does now, as text.
fn doing(job: &Job, state: &State) -> String {
    let node = state.node.as_deref().unwrap_or_default();
    match (job.is_cancelled(), state.writing) {
        (true, _) => "Cancelling".to_owned(),
        (_, true) => "Writing files".to_owned(),
        _ => {
            let left = state.remaining().map_or_else(String::new, |time| format!("{}, ", left(time)));
            format!("{left}{} of {} nodes {node}", state.finished, state.planned)
        }
    }
}

/// A remaining time, rounded.
fn left(time: Duration) -> String {
    match time.as_secs_f64() {
        s if s < 10.0 => "a few seconds left".to_owned(),
        s if s < 95.0 => format!("about {:.0} s left", (s / 5.0).round() * 5.0),
        s if s < 5400.0 => format!("about {:.0} min left", s / 60.0),
        s => format!("about {:.1} h left", s / 3600.0),
    }
}

fn warnings(ui: &mut Ui, state: &State) {
    for warning in &state.warnings {
        ui.add(Label::new(RichText::new(warning).color(ui.visuals().warn_fg_color)).wrap());
    }
}

/// The share of each node of a request in the time of its build: by the times that nodes took in the preview. A node
/// whose time is not known takes as long as the mean of the others.
fn shares(session: &Session, request: &Request) -> BTreeMap<NodeIndex, f32> {
    let graph = &request.graph;
    let needed = graph.upstream(request.outputs.iter().map(|output| output.port.node));
    let time = |node: NodeIndex| session.info(&graph.instance(node).name).time.map(|(time, _)| time.as_secs_f32());
    let known: Vec<f32> = needed.iter().filter_map(|node| time(*node)).collect();
    let mean = if known.is_empty() { 1.0 } else { known.iter().sum::<f32>() / known.len() as f32 };
    let times = needed.iter().map(|node| (*node, time(*node).unwrap_or(mean).max(1e-4)));
    let times: BTreeMap<NodeIndex, f32> = times.collect();
    let sum: f32 = times.values().sum();
    times.into_iter().map(|(node, time)| (node, time / sum)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remaining_times_are_rounded() {
        let text = |seconds| left(Duration::from_secs(seconds));
        assert_eq!(text(4), "a few seconds left");
        assert_eq!(text(43), "about 45 s left");
        assert_eq!(text(250), "about 4 min left");
        assert_eq!(text(9000), "about 2.5 h left");
    }
}
