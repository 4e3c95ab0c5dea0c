//! The session: a document, its selection and preview, and the state of its nodes. It draws nothing.

mod detail;
mod files;
mod journal;
pub(crate) mod live;
mod outside;
mod recovery;
mod simulation;
mod unpacked;
pub mod worker;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use orograph_graph::{Document, Edit, EvalError, Evaluator, JournalEntry, PortType, Registry, Store, Value};

pub use detail::{Detail, View};
use files::Opened;
pub use files::{Answer, FileCommand, Question};
pub use journal::Journals;
pub use recovery::Lost;
pub use simulation::Simulation;

use self::worker::{News, Order, Wanted, Worker};
use self::{
    detail::Close,
    journal::{Found, Journal, Trouble},
    unpacked::Unpacked,
};
use crate::{files::watch::Watch, report::failure::Failure};

/// The state of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum NodeState {
    /// Nothing is known about it, or its result is out of date.
    #[default]
    Waiting,
    /// Its kernel is running.
    Running {
        /// The finished part, 0 to 1.
        fraction: f32,
    },
    /// A required input is not wired yet.
    Unwired {
        /// The input.
        input: &'static str,
        /// The node that lacks the input, if it is another one.
        at: Option<String>,
    },
    /// Its results are up to date.
    Fresh,
    /// It could not be built.
    Failed {
        /// The reason.
        message: String,
        /// What to do about it.
        hint: Option<String>,
        /// The node that failed, if it is another one.
        at: Option<String>,
    },
}

impl NodeState {
    /// The missing input, as text for people. Returns None when no wire is missing.
    #[must_use]
    pub fn lacks(&self) -> Option<String> {
        match self {
            Self::Unwired { input, at: None } => Some(format!("Needs an input: {input}")),
            Self::Unwired { input, at: Some(at) } => Some(format!("Waiting for {at} (no {input} input)")),
            _ => None,
        }
    }
}

/// What is known about a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeInfo {
    /// Its state.
    pub state: NodeState,
    /// How long its kernel last ran, and with how many cells along the longer side.
    pub time: Option<(Duration, u32)>,
    /// The size of its results then, in bytes.
    pub bytes: usize,
    /// Its warnings.
    pub warnings: Vec<String>,
}

/// An output that has been built.
#[derive(Clone, Debug)]
pub struct Built {
    /// The state of the document that it was built from.
    pub revision: u64,
    /// Cells along the longer side.
    pub cells: u32,
    /// Increases with each intermediate result; 0 for the final result.
    pub step: u64,
    /// The value.
    pub value: Value,
}

/// A message for the person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The text.
    pub message: String,
    /// True if something failed.
    pub error: bool,
}

/// A document that is being edited.
pub struct Session {
    document: Document,
    /// Increases with every change that affects the results.
    revision: u64,
    /// Increases with every change of the document.
    edits: u64,
    /// [`Document::build`] at the current revision.
    build: u64,
    /// The text as it is in the file.
    saved: Option<String>,
    /// Where the files of an archive are, while it is edited.
    unpacked: Option<Unpacked>,
    /// The example that this is a copy of, until it is saved under a name.
    example: Option<String>,
    selection: BTreeSet<String>,
    /// The pinned output of the viewport, as `node.port`, instead of the selected one.
    pinned: Option<String>,
    /// The output to compare with, as `node.port`.
    compared: Option<String>,
    /// Other outputs that the viewport needs, as `node.port`.
    also: Vec<String>,
    /// Preview resolution: cells along the longer side.
    cells: u32,
    worker: Worker,
    /// Increases with every order except those that change only the finer part.
    orders: u64,
    /// True if the worker does not know the current state yet.
    stale: bool,
    /// True if the worker has not finished the current state.
    busy: bool,
    /// The node that runs live, if any.
    simulation: Option<Simulation>,
    close: Close,
    nodes: BTreeMap<String, NodeInfo>,
    /// By `node.port`: with few cells, with the requested cells, and intermediate results with those.
    built: BTreeMap<String, [Option<Built>; 3]>,
    notes: Vec<Note>,
    /// A running gesture, such as the drag of a slider: true if it has made an edit.
    gesture: Option<bool>,
    /// The open question.
    question: Option<Question>,
    /// The command to run after the answer.
    pending: Option<FileCommand>,
    /// True if the window may close.
    over: bool,
    safety: Safety,
}

/// What protects the work from being lost.
#[derive(Default)]
struct Safety {
    /// Where journals are stored. None when there are none.
    journals: Option<Journals>,
    /// The journal, from the first edit on.
    journal: Option<Journal>,
    /// Why the journal cannot be written at present.
    trouble: Trouble,
    /// The failure that was last reported.
    reported: Option<String>,
    /// Unsaved work of earlier sessions that is not decided on yet.
    found: Vec<Found>,
    /// The watch on the file and on the files that the graph reads.
    watch: Option<Watch>,
    watched: BTreeSet<PathBuf>,
    /// Changes on disk that are not handled yet: of the file, of files that the graph reads.
    changed: [bool; 2],
}

impl Session {
    /// Opens a session on a file, or on an empty graph. Calls `wake` when there is something new to show.
    ///
    /// # Errors
    /// When the file cannot be read, or no thread can be started. A file with errors is opened as far as possible.
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
            pending: None,
            over: false,
            safety: Safety::default(),
        };
        session.changed();
        Ok(session)
    }

    /// The evaluator, with the results of everything shown so far.
    #[must_use]
    pub const fn evaluator(&self) -> &Arc<Evaluator> {
        self.worker.evaluator()
    }

    /// The document.
    #[must_use]
    pub const fn document(&self) -> &Document {
        &self.document
    }

    /// Increases with every change that affects the results; node positions, notes and comments do not.
    #[must_use]
    pub const fn revision(&self) -> u64 {
        self.revision
    }

    /// Increases with every change of the document.
    #[must_use]
    pub const fn edits(&self) -> u64 {
        self.edits
    }

    /// The file of the document. Returns None when it has none.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.document.path()
    }

    /// The title of the example that this is a copy of. Returns None when it is not one.
    #[must_use]
    pub fn example(&self) -> Option<&str> {
        self.example.as_deref()
    }

    /// Makes an edit. If the edit is refused, notes the reason and returns false.
    pub fn apply(&mut self, edit: &Edit) -> bool {
        match self.attempt(edit) {
            Ok(()) => true,
            Err(reason) => {
                self.note(reason, true);
                false
            }
        }
    }

    /// Makes an edit, for callers that report a refusal themselves.
    ///
    /// # Errors
    /// The reason for the refusal.
    pub fn attempt(&mut self, edit: &Edit) -> Result<(), String> {
        self.end_gesture();
        let before = self.document.steps();
        self.document.apply(edit).map_err(|error| error.to_string())?;
        self.made(before);
        self.changed();
        Ok(())
    }

    /// Makes an edit that continues until [`Self::end_gesture`], such as the drag of a slider. Each call replaces the
    /// edit of the call before, and one undo reverts them all. Returns true if the edit was made.
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
                    let entry = self.document.last_edit().map(JournalEntry::Amended);
                    self.record(entry);
                } else {
                    self.record(Some(JournalEntry::Dropped));
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

    /// Ends the gesture of [`Self::gesture`]; the next one is another undo step.
    pub const fn end_gesture(&mut self) {
        self.gesture = None;
    }

    /// Undoes the last edit.
    pub fn undo(&mut self) -> bool {
        self.end_gesture();
        let undone = self.document.undo();
        self.record(undone.then_some(JournalEntry::Undone));
        self.changed();
        undone
    }

    /// Redoes the edit that was undone last.
    pub fn redo(&mut self) -> bool {
        self.end_gesture();
        let redone = self.document.redo();
        self.record(redone.then_some(JournalEntry::Redone));
        self.changed();
        redone
    }

    /// The names of the selected nodes.
    pub fn selection(&self) -> impl Iterator<Item = &str> {
        self.selection.iter().map(String::as_str)
    }

    /// The selected node. Returns None when not exactly one node is selected.
    #[must_use]
    pub fn selected(&self) -> Option<&str> {
        self.selection().next().filter(|_| self.selection.len() == 1)
    }

    /// Returns true if a node is selected.
    #[must_use]
    pub fn is_selected(&self, node: &str) -> bool {
        self.selection.contains(node)
    }

    /// Selects exactly these nodes.
    pub fn select(&mut self, nodes: impl IntoIterator<Item = String>) {
        let before = std::mem::take(&mut self.selection);
        self.selection = nodes.into_iter().filter(|name| self.has_node(name)).collect();
        self.stale |= self.selection != before;
    }

    /// Selects only this node.
    pub fn select_only(&mut self, node: &str) {
        self.select([node.to_owned()]);
    }

    fn has_node(&self, name: &str) -> bool {
        self.document.node(name).is_some()
    }

    /// The output in the viewport, as `node.port`: the pinned one, otherwise the first output of the selected node,
    /// otherwise the document's first output.
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

    /// Pins an output to the viewport; None unpins it, so that the viewport follows the selection.
    pub fn pin(&mut self, port: Option<String>) {
        self.stale |= self.pinned != port;
        self.pinned = port;
    }

    /// The pinned output. Returns None when the viewport follows the selection.
    #[must_use]
    pub fn pinned(&self) -> Option<&str> {
        self.pinned.as_deref()
    }

    /// Compares the shown output with this one; None ends the comparison.
    pub fn compare(&mut self, port: Option<String>) {
        self.stale |= self.compared != port;
        self.compared = port;
    }

    /// The output that the shown one is compared with. Returns None when there is none.
    #[must_use]
    pub fn compared(&self) -> Option<&str> {
        self.compared.as_deref()
    }

    /// Also builds these outputs, at the resolution of the shown one.
    pub fn also_show(&mut self, ports: Vec<String>) {
        self.stale |= self.also != ports;
        self.also = ports;
    }

    /// The preview resolution: cells along the longer side.
    #[must_use]
    pub const fn cells(&self) -> u32 {
        self.cells
    }

    /// Sets the preview resolution: cells along the longer side.
    pub fn set_cells(&mut self, cells: u32) {
        self.stale |= self.cells != cells;
        self.cells = cells;
        // Results with more cells would be shown instead of the requested ones.
        for built in self.built.values_mut() {
            for level in &mut built[1..] {
                level.take_if(|built| built.cells > cells);
            }
        }
    }

    /// What is known about a node.
    #[must_use]
    pub fn node(&self, name: &str) -> NodeInfo {
        self.info(name).clone()
    }

    /// What is known about a node, by reference, for callers that read many.
    pub(super) fn info(&self, name: &str) -> &NodeInfo {
        static NOTHING: NodeInfo = NodeInfo { state: NodeState::Waiting, time: None, bytes: 0, warnings: Vec::new() };
        self.nodes.get(name).unwrap_or(&NOTHING)
    }

    /// The newest value of an output (`node.port`): of the current state of the document if there is one, with the most
    /// cells available; otherwise of an older state.
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

    /// The newest value of an output (`node.port`) with few cells, for a thumbnail.
    #[must_use]
    pub fn small(&self, port: &str) -> Option<&Built> {
        self.built.get(port)?[0].as_ref()
    }

    /// Returns true while the current state is still being built.
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        self.busy || self.stale
    }

    /// Adds a message for the person.
    pub fn note(&mut self, message: impl Into<String>, error: bool) {
        self.notes.push(Note { message: message.into(), error });
    }

    /// Takes the messages that have not been shown yet.
    pub fn take_notes(&mut self) -> Vec<Note> {
        std::mem::take(&mut self.notes)
    }

    /// Call after a change of the document.
    fn changed(&mut self) {
        self.edits += 1;
        let document = &self.document;
        self.selection.retain(|name| document.node(name).is_some());
        if std::mem::replace(&mut self.build, document.build()) == self.build {
            // The built graph is the same: the results and the running work of the worker stay valid.
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

    /// Receives messages of the worker and sends it changes. Called every frame; returns at once.
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
            // Reported before fewer cells were requested.
            News::Built { cells, .. } | News::Glimpsed { cells, .. }
                if cells > self.cells.max(self::worker::QUICK_CELLS) => {}
            News::Built { revision, name, cells, value } => {
                if let Some((node, _)) = name.split_once('.')
                    && revision == self.revision
                {
                    self.nodes.entry(node.to_owned()).or_default().state = NodeState::Fresh;
                }
                let built = self.built.entry(name).or_default();
                let level = usize::from(cells > self::worker::QUICK_CELLS);
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
