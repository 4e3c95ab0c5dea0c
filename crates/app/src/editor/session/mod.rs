//! The work: a document, what is selected and shown of it, and what is known of its nodes. It draws nothing.

mod detail;
mod files;
mod journal;
mod outside;
mod recovery;
mod simulation;
mod unpacked;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use orograph_graph::{Document, Edit, Entry, EvalError, Evaluator, PortType, Registry, Store, Value};

pub use detail::{Detail, View};
use files::Opened;
pub use files::{Answer, Question, Wish};
pub use journal::Journals;
pub use recovery::Lost;
pub use simulation::Simulation;

use self::{
    detail::Close,
    journal::{Found, Journal, Trouble},
    unpacked::Unpacked,
};
use super::worker::{News, Order, Wanted, Worker};
use crate::{failure::Failure, watch::Watch};

/// How far a node is.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum NodeState {
    /// Nothing is known of it, or it is behind an edit.
    #[default]
    Waiting,
    /// Its kernel runs.
    Running {
        /// The finished part, 0 to 1.
        fraction: f32,
    },
    /// It lacks a wire, which is to come.
    Unwired {
        /// The input.
        input: &'static str,
        /// The node that lacks it, where it is another.
        at: Option<String>,
    },
    /// Its results are there.
    Fresh,
    /// It could not be built.
    Failed {
        /// Why.
        message: String,
        /// What would help.
        hint: Option<String>,
        /// The node at which it went wrong, where it is another.
        at: Option<String>,
    },
}

impl NodeState {
    /// What it waits for, in words, where it lacks a wire.
    #[must_use]
    pub fn lacks(&self) -> Option<String> {
        match self {
            Self::Unwired { input, at: None } => Some(format!("waits for a wire into {input}")),
            Self::Unwired { input, at: Some(at) } => Some(format!("waits for {at}, which needs a wire into {input}")),
            _ => None,
        }
    }
}

/// What is known of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeInfo {
    /// How far it is.
    pub state: NodeState,
    /// How long its kernel ran last, and with how many cells along the longer side.
    pub time: Option<(Duration, u32)>,
    /// Bytes of its results then.
    pub bytes: usize,
    /// What it warned of.
    pub warnings: Vec<String>,
}

/// An output that has been built.
#[derive(Clone, Debug)]
pub struct Built {
    /// Which state of the document it is of.
    pub revision: u64,
    /// Cells along the longer side.
    pub cells: u32,
    /// Rises while the kernel goes on; 0 for its result.
    pub step: u64,
    /// What it is.
    pub value: Value,
}

/// Something to tell the person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// What.
    pub message: String,
    /// Whether something could not be done.
    pub error: bool,
}

/// A document being worked on.
pub struct Session {
    document: Document,
    /// Rises with every change of what is built of the document.
    revision: u64,
    /// Rises with every change of the document.
    edits: u64,
    /// What [`Document::build`] was at the present revision.
    build: u64,
    /// The text as it is in the file.
    saved: Option<String>,
    /// Where the files of an archive are, for as long as it is worked on.
    unpacked: Option<Unpacked>,
    /// The example that it is a copy of, until it has a name of its own.
    example: Option<String>,
    selection: BTreeSet<String>,
    /// What the viewport shows, as `node.port`, in place of what is selected.
    pinned: Option<String>,
    /// What stands beside it, as `node.port`.
    compared: Option<String>,
    /// What else the viewport needs, as `node.port`.
    also: Vec<String>,
    /// Cells along the longer side of what is shown.
    cells: u32,
    worker: Worker,
    /// Rises with every order that is not of a finer part alone.
    orders: u64,
    /// Whether the worker is to be told of the present state.
    stale: bool,
    /// Whether the worker has more to tell of the present state.
    busy: bool,
    /// The node that is run step by step, if one is.
    simulation: Option<Simulation>,
    close: Close,
    nodes: BTreeMap<String, NodeInfo>,
    /// By `node.port`: with few cells, with those asked for, and with those while its kernel goes on.
    built: BTreeMap<String, [Option<Built>; 3]>,
    notes: Vec<Note>,
    /// An edit that goes on, such as a slider being dragged: whether it has been made once.
    gesture: Option<bool>,
    /// What the person must decide.
    question: Option<Question>,
    /// What comes after the answer.
    wish: Option<Wish>,
    /// Whether the window may close.
    over: bool,
    safety: Safety,
}

/// What keeps the work from being lost.
#[derive(Default)]
struct Safety {
    /// Where journals are kept; `None` where none are.
    journals: Option<Journals>,
    /// From the first edit on.
    journal: Option<Journal>,
    /// Why the journal cannot be written at present.
    trouble: Trouble,
    /// What the person was told of that.
    told: Option<String>,
    /// Work of earlier times that the person has not decided on.
    found: Vec<Found>,
    /// The file, and those that the graph reads.
    watch: Option<Watch>,
    watched: BTreeSet<PathBuf>,
    /// What has changed and is not dealt with: the file, files that the graph reads.
    changed: [bool; 2],
}

impl Session {
    /// A session on a file, or on an empty graph. `wake` is called when there is something new to show.
    ///
    /// # Errors
    /// When the file cannot be read, or there are no threads. A file with mistakes is opened as far as it goes.
    pub fn open(
        file: Option<PathBuf>,
        registry: Registry,
        store: Arc<Store>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Result<Self, Failure> {
        let Opened { document, saved, unpacked } = match file {
            Some(path) => Opened::new(&path, &registry)?,
            None => Opened { document: Document::empty(&registry), saved: None, unpacked: None },
        };
        let mut session = Self {
            document,
            revision: 0,
            edits: 0,
            build: 0,
            saved,
            unpacked,
            example: None,
            selection: BTreeSet::new(),
            pinned: None,
            compared: None,
            also: Vec::new(),
            cells: 512,
            worker: Worker::start(store, wake)?,
            orders: 0,
            stale: true,
            busy: false,
            simulation: None,
            close: Close::default(),
            nodes: BTreeMap::new(),
            built: BTreeMap::new(),
            notes: Vec::new(),
            gesture: None,
            question: None,
            wish: None,
            over: false,
            safety: Safety::default(),
        };
        session.changed();
        Ok(session)
    }

    /// The evaluator, with the results of all that has been shown.
    #[must_use]
    pub const fn evaluator(&self) -> &Arc<Evaluator> {
        self.worker.evaluator()
    }

    /// The document.
    #[must_use]
    pub const fn document(&self) -> &Document {
        &self.document
    }

    /// Rises with every change of what is built of the document; places on the canvas, notes and comments are no part of it.
    #[must_use]
    pub const fn revision(&self) -> u64 {
        self.revision
    }

    /// Rises with every change of the document.
    #[must_use]
    pub const fn edits(&self) -> u64 {
        self.edits
    }

    /// The file it is, if it is in one.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.document.path()
    }

    /// What the example is called that it is a copy of.
    #[must_use]
    pub fn example(&self) -> Option<&str> {
        self.example.as_deref()
    }

    /// Makes an edit. When it is refused, the reason is noted for the person, and it says no.
    pub fn apply(&mut self, edit: &Edit) -> bool {
        match self.attempt(edit) {
            Ok(()) => true,
            Err(reason) => {
                self.note(reason, true);
                false
            }
        }
    }

    /// Makes an edit, for who tells the person themselves why it was refused.
    ///
    /// # Errors
    /// The reason for which it was refused.
    pub fn attempt(&mut self, edit: &Edit) -> Result<(), String> {
        self.end_gesture();
        let before = self.document.steps();
        self.document.apply(edit).map_err(|error| error.to_string())?;
        self.made(before);
        self.changed();
        Ok(())
    }

    /// Makes an edit that goes on until [`Self::end_gesture`], such as a slider being dragged: each call takes the place of
    /// the one before, and all of them are undone at once. Says whether the edit was made.
    pub fn gesture(&mut self, edit: &Edit) -> bool {
        let goes_on = self.gesture.unwrap_or(false);
        let steps = self.document.steps() - usize::from(goes_on);
        let made = if goes_on { self.document.amend(edit) } else { self.document.apply(edit) };
        self.gesture = Some(self.document.steps() > steps);
        match made {
            Ok(()) => {
                if !goes_on {
                    self.made(steps);
                } else if self.gesture == Some(true) {
                    let entry = self.document.last_edit().map(Entry::Amended);
                    self.record(entry);
                } else {
                    self.record(Some(Entry::Dropped));
                }
                self.changed();
            }
            Err(_) if goes_on => {}
            Err(error) => {
                self.note(error.to_string(), true);
                return false;
            }
        }
        true
    }

    /// Ends what [`Self::gesture`] began; the next one is another step of undo.
    pub const fn end_gesture(&mut self) {
        self.gesture = None;
    }

    /// Takes the last edit back.
    pub fn undo(&mut self) -> bool {
        self.end_gesture();
        let undone = self.document.undo();
        self.record(undone.then_some(Entry::Undone));
        self.changed();
        undone
    }

    /// Makes the edit again that was taken back last.
    pub fn redo(&mut self) -> bool {
        self.end_gesture();
        let redone = self.document.redo();
        self.record(redone.then_some(Entry::Redone));
        self.changed();
        redone
    }

    /// The names of the selected nodes.
    pub fn selection(&self) -> impl Iterator<Item = &str> {
        self.selection.iter().map(String::as_str)
    }

    /// The one node that is selected, if it is one.
    #[must_use]
    pub fn selected(&self) -> Option<&str> {
        self.selection().next().filter(|_| self.selection.len() == 1)
    }

    /// Whether a node is selected.
    #[must_use]
    pub fn is_selected(&self, node: &str) -> bool {
        self.selection.contains(node)
    }

    /// Selects these nodes and no others.
    pub fn select(&mut self, nodes: impl IntoIterator<Item = String>) {
        let before = std::mem::take(&mut self.selection);
        self.selection = nodes.into_iter().filter(|name| self.has_node(name)).collect();
        self.stale |= self.selection != before;
    }

    /// Selects this node and no other.
    pub fn select_only(&mut self, node: &str) {
        self.select([node.to_owned()]);
    }

    fn has_node(&self, name: &str) -> bool {
        self.document.node(name).is_some()
    }

    /// The output that is shown, as `node.port`: the one that is pinned, else the first one of the selected node, else
    /// the document's first output.
    #[must_use]
    pub fn shown(&self) -> Option<String> {
        let graph = self.document.graph();
        let name = |port| Some(graph.port_name(port));
        if let Some(port) = self.pinned.as_deref().and_then(|pinned| graph.port(pinned).ok()) {
            return name(port);
        }
        if let Some(port) = self.selected().and_then(|node| graph.port(node).ok()) {
            return name(port);
        }
        let height = self.document.outputs().iter().find(|output| output.ty == PortType::Height);
        height.or_else(|| self.document.outputs().first()).and_then(|output| name(output.port))
    }

    /// Shows this output whatever is selected, or what is selected.
    pub fn pin(&mut self, port: Option<String>) {
        self.stale |= self.pinned != port;
        self.pinned = port;
    }

    /// The output that is shown whatever is selected.
    #[must_use]
    pub fn pinned(&self) -> Option<&str> {
        self.pinned.as_deref()
    }

    /// Shows this output beside the shown one, or none.
    pub fn compare(&mut self, port: Option<String>) {
        self.stale |= self.compared != port;
        self.compared = port;
    }

    /// The output that stands beside the shown one.
    #[must_use]
    pub fn compared(&self) -> Option<&str> {
        self.compared.as_deref()
    }

    /// Builds these outputs as well, with as many cells as the shown one.
    pub fn also_show(&mut self, ports: Vec<String>) {
        self.stale |= self.also != ports;
        self.also = ports;
    }

    /// Cells along the longer side of what is shown.
    #[must_use]
    pub const fn cells(&self) -> u32 {
        self.cells
    }

    /// Sets the cells along the longer side of what is shown.
    pub fn set_cells(&mut self, cells: u32) {
        self.stale |= self.cells != cells;
        self.cells = cells;
        // What has more cells would stand before what was asked for.
        for built in self.built.values_mut() {
            for level in &mut built[1..] {
                level.take_if(|built| built.cells > cells);
            }
        }
    }

    /// What is known of a node.
    #[must_use]
    pub fn node(&self, name: &str) -> NodeInfo {
        self.info(name).clone()
    }

    /// What is known of a node, for those who look at many.
    pub(super) fn info(&self, name: &str) -> &NodeInfo {
        static NOTHING: NodeInfo = NodeInfo { state: NodeState::Waiting, time: None, bytes: 0, warnings: Vec::new() };
        self.nodes.get(name).unwrap_or(&NOTHING)
    }

    /// The newest of an output (`node.port`): of the present state of the document if it is there, with as many cells as
    /// there are; else of an older state.
    #[must_use]
    pub fn built(&self, port: &str) -> Option<&Built> {
        if let Some(live) = self.simulation.as_ref().and_then(|simulation| simulation.built(port)) {
            return Some(live);
        }
        let [quick, full, glimpse] = self.built.get(port)?;
        match (quick, full) {
            (_, full) if glimpse.is_some() && full.as_ref().is_none_or(|full| full.revision < self.revision) => {
                glimpse.as_ref()
            }
            (Some(quick), Some(full)) if quick.revision > full.revision => Some(quick),
            (quick, full) => full.as_ref().or(quick.as_ref()),
        }
    }

    /// The newest of an output (`node.port`) with few cells, for a small picture.
    #[must_use]
    pub fn small(&self, port: &str) -> Option<&Built> {
        self.built.get(port)?[0].as_ref()
    }

    /// Whether something of the present state is still being built.
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        self.busy || self.stale
    }

    /// Tells the person something.
    pub fn note(&mut self, message: impl Into<String>, error: bool) {
        self.notes.push(Note { message: message.into(), error });
    }

    /// What there is to tell the person, once.
    pub fn take_notes(&mut self) -> Vec<Note> {
        std::mem::take(&mut self.notes)
    }

    /// After a change of the document.
    fn changed(&mut self) {
        self.edits += 1;
        let document = &self.document;
        self.selection.retain(|name| document.node(name).is_some());
        if std::mem::replace(&mut self.build, document.build()) == self.build {
            // The graph that is built is the same: what the worker does, and has done, still counts.
            return;
        }
        self.revision += 1;
        self.stale = true;
        self.nodes.retain(|name, _| document.node(name).is_some());
        self.built.retain(|port, _| port.split_once('.').is_some_and(|(node, _)| document.node(node).is_some()));
        for info in self.nodes.values_mut() {
            info.state = NodeState::Waiting;
        }
        for [.., glimpse] in self.built.values_mut() {
            *glimpse = None;
        }
        self.leave_what_is_gone();
    }

    /// Takes what the worker has to tell, and tells it what has changed. Called every frame; it returns at once.
    pub fn poll(&mut self) {
        self.look_outside();
        self.tell_trouble();
        let news: Vec<News> = self.worker.news().collect();
        for news in news {
            self.hear(news);
        }
        if self.stale {
            self.watch_files();
        }
        if std::mem::take(&mut self.stale) {
            self.busy = true;
            self.orders += 1;
            self.forget_ordered_detail();
            let order = self.order();
            self.follow_simulation(&order);
            self.worker.submit(order);
        }
        self.order_detail();
    }

    fn order(&self) -> Order {
        let expanded = self.document.expand();
        let graph = self.document.graph();
        let wanted = |port: orograph_graph::Port| {
            Some(Wanted {
                node: graph.instance(port.node).name.clone(),
                name: graph.port_name(port),
                port: expanded.port(port)?,
            })
        };
        let first = |node| wanted(orograph_graph::Port { node, output: 0 });
        let with_outputs =
            graph.topological().into_iter().filter(|node| !graph.instance(*node).node.outputs.is_empty());
        let behind = self.behind_simulation();
        let small = with_outputs.filter(|node| !behind.contains(node)).filter_map(first).collect();
        let names = [self.shown(), self.compared.clone()].into_iter().flatten().chain(self.also.iter().cloned());
        let mut shown: Vec<Wanted> = Vec::new();
        let ports = names.filter_map(|name| graph.port(&name).ok()).filter(|port| !behind.contains(&port.node));
        for wanted in ports.filter_map(wanted) {
            if !shown.contains(&wanted) {
                shown.push(wanted);
            }
        }
        let read = graph.indices().flat_map(|node| {
            let inputs = 0..graph.instance(node).node.inputs.len();
            inputs.filter_map(move |input| graph.source(node, input))
        });
        let byproducts =
            read.filter_map(|port| expanded.port(port)).chain(expanded.outputs.iter().map(|output| output.port));
        Order {
            number: self.orders,
            revision: self.revision,
            byproducts: byproducts.collect(),
            folder: self.document.folder().to_owned(),
            world: self.document.world(),
            shown,
            small,
            cells: self.cells,
            part: None,
            graph: expanded.graph,
        }
    }

    fn hear(&mut self, news: News) {
        match news {
            News::Running { revision, node, fraction } if revision == self.revision => {
                self.nodes.entry(node).or_default().state = NodeState::Running { fraction };
            }
            News::Finished { revision, node, time, bytes, cells, computed } if revision == self.revision => {
                let info = self.nodes.entry(node).or_default();
                info.state = NodeState::Fresh;
                if computed {
                    info.time = Some((time, cells));
                    info.bytes = bytes;
                    info.warnings.clear();
                }
            }
            // Told before fewer cells were asked for.
            News::Built { cells, .. } | News::Glimpsed { cells, .. }
                if cells > self.cells.max(super::worker::QUICK_CELLS) => {}
            News::Built { revision, name, cells, value } => {
                if let Some((node, _)) = name.split_once('.')
                    && revision == self.revision
                {
                    self.nodes.entry(node.to_owned()).or_default().state = NodeState::Fresh;
                }
                let built = self.built.entry(name).or_default();
                let level = usize::from(cells > super::worker::QUICK_CELLS);
                built[level] = Some(Built { revision, cells, step: 0, value });
                if level == 1 {
                    built[2] = None;
                }
            }
            News::Glimpsed { revision, name, cells, value } if revision == self.revision => {
                let [.., glimpse] = self.built.entry(name).or_default();
                let step = glimpse.as_ref().map_or(1, |glimpse| glimpse.step + 1);
                *glimpse = Some(Built { revision, cells, step, value });
            }
            News::Warned { revision, node, message } if revision == self.revision => {
                let warnings = &mut self.nodes.entry(node).or_default().warnings;
                if !warnings.contains(&message) {
                    warnings.push(message);
                }
            }
            News::Failed { revision, node, error } if revision == self.revision => {
                let at = error.node().filter(|at| *at != node).map(str::to_owned);
                let state = match error {
                    EvalError::Unwired { input, .. } => NodeState::Unwired { input, at },
                    error => NodeState::Failed { message: error.to_string(), hint: error.hint(), at },
                };
                self.nodes.entry(node).or_default().state = state;
            }
            News::Part { revision, name, window, value } => self.hear_detail(revision, name, window, value),
            News::Live { moment, held, cells, values, .. } => self.hear_simulation(moment, held, cells, values),
            News::LiveFailed { error, .. } => self.hear_trouble(&error),
            News::Done { revision } if revision == self.revision => self.busy = false,
            News::Running { .. }
            | News::Glimpsed { .. }
            | News::Finished { .. }
            | News::Warned { .. }
            | News::Failed { .. }
            | News::Done { .. } => {}
        }
    }
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("path", &self.path()).field("revision", &self.revision).finish_non_exhaustive()
    }
}
