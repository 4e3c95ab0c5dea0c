//! The session: a document, its selection and preview, and the state of its nodes. It draws nothing.

mod detail;
mod files;
mod journal;
pub(crate) mod live;
mod measuring;
mod outside;
mod past;
mod preferred;
mod recovery;
mod results;
mod reuse;
mod simulation;
mod snapshots;
mod state;
mod unpacked;
pub mod worker;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::Arc,
};

use orograph_graph::{Document, Edit, Evaluator, Expectations, JournalEntry, Port, PortType, Registry, Store};

pub use detail::{Detail, View};
use files::Opened;
pub use files::{Answer, FileCommand, Question};
pub use journal::Journals;
pub(crate) use preferred::Preferred;
pub use recovery::Lost;
pub use simulation::Simulation;
pub use snapshots::Snapshot;
pub use state::{Built, Measured, NodeInfo, NodeState, Note};

use self::{
    detail::Close,
    journal::{Found, Journal, Trouble},
    unpacked::Unpacked,
    worker::Worker,
};
use crate::{files::watch::Watch, report::failure::Failure};

/// A document that is being edited.
pub struct Session {
    document: Document,
    /// Increases with every change that affects the results.
    revision: u64,
    /// Increases with every change of the document.
    edits: u64,
    /// [`Document::build`] at the current revision.
    build: u64,
    /// True while exports run or wait.
    exporting: bool,
    /// The text as it is in the file.
    saved: Option<String>,
    /// Where the files of an archive are, while it is edited.
    unpacked: Option<Unpacked>,
    /// The example that this is a copy of, until it is saved under a name.
    example: Option<String>,
    /// Number of documents that were open before this one.
    number: u64,
    /// Number of graphs without a name so far, this one included.
    nameless: u32,
    selection: BTreeSet<String>,
    /// The pinned output of the viewport, as `node.port`, instead of the selected one.
    pinned: Option<String>,
    /// The backends that nodes should run on, by name.
    preferred: Preferred,
    /// The output in the viewport before the last change of the selection, as `node.port`.
    last: Option<String>,
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
    /// What the file expects at the current state.
    expected: Option<Arc<Expectations>>,
    /// The figures that were measured last.
    checked: Option<Measured>,
    notes: Vec<Note>,
    snapshots: Vec<Snapshot>,
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

/// State that protects the work from being lost.
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
        let nameless = u32::from(document.path().is_none());
        let mut session = Self {
            document,
            revision: 0,
            edits: 0,
            build: 0,
            exporting: false,
            saved,
            unpacked,
            example: None,
            number: 0,
            nameless,
            selection: BTreeSet::new(),
            pinned: None,
            preferred: Preferred::default(),
            last: None,
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
            expected: None,
            checked: None,
            notes: Vec::new(),
            snapshots: Vec::new(),
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
        let before = self.document.edits();
        self.document.apply(edit).map_err(|error| error.to_string())?;
        self.keep_preferred(edit);
        self.made(before);
        self.changed();
        Ok(())
    }

    /// Makes an edit that continues until [`Self::end_gesture`], such as the drag of a slider. Each call replaces the
    /// edit of the call before, and one undo reverts them all. Returns true if the edit was made.
    pub fn gesture(&mut self, edit: &Edit) -> bool {
        let goes_on = self.gesture.unwrap_or(false);
        let edits = self.document.edits() - usize::from(goes_on);
        let made = if goes_on { self.document.amend(edit) } else { self.document.apply(edit) };
        self.gesture = Some(self.document.edits() > edits);
        match made {
            Ok(()) => {
                if !goes_on {
                    self.made(edits);
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
        let selection = nodes.into_iter().filter(|name| self.has_node(name)).collect();
        if self.selection != selection {
            self.last = self.shown();
            self.selection = selection;
            self.stale = true;
        }
    }

    /// Selects only this node.
    pub fn select_only(&mut self, node: &str) {
        self.select([node.to_owned()]);
    }

    fn has_node(&self, name: &str) -> bool {
        self.document.node(name).is_some()
    }

    /// The output in the viewport, as `node.port`: the pinned one, otherwise the first output of the selected node,
    /// otherwise the document's first output. A document without outputs keeps the last shown one; at first it shows
    /// the last node in the order of the wires. Returns None when no node has an output.
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
        if let Some(output) = height.or_else(|| self.document.outputs().first()) {
            return name(output.port);
        }
        if let Some(port) = self.last.as_deref().and_then(|last| graph.port(last).ok()) {
            return name(port);
        }
        let has_field = |port: &Port| graph.output_type(*port).planes().is_some();
        let ends = graph.topological().into_iter().rev();
        let ports = ends.filter(|node| !graph.instance(*node).node.outputs.is_empty());
        ports.map(|node| Port { node, output: 0 }).find(has_field).and_then(name)
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

    /// The known state of a node.
    #[must_use]
    pub fn node(&self, name: &str) -> NodeInfo {
        self.info(name).clone()
    }

    /// The known state of a node, by reference, for callers that read many.
    pub(super) fn info(&self, name: &str) -> &NodeInfo {
        static NOTHING: NodeInfo =
            NodeInfo { state: NodeState::Waiting, time: None, bytes: 0, warnings: Vec::new(), on_device: false };
        self.nodes.get(name).unwrap_or(&NOTHING)
    }

    /// The newest value of an output (`node.port`): of the current state of the document if there is one, with the most
    /// cells available; otherwise of an older state.
    #[must_use]
    pub fn built(&self, port: &str) -> Option<&Built> {
        if let Some(live) = self.simulation.as_ref().filter(|simulation| simulation.has_values_of(port)) {
            // an output that was not shown before comes with the next picture
            return live.built(port);
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

    /// The figures of what the file expects, measured last. Returns None when nothing was measured.
    #[must_use]
    pub const fn checked(&self) -> Option<&Measured> {
        self.checked.as_ref()
    }

    /// Returns true while the current state is still being built.
    #[must_use]
    pub const fn is_busy(&self) -> bool {
        self.busy || self.stale
    }

    /// Adds a message for the user.
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
        if self.expected.as_ref() != document.expectations() {
            self.expected = document.expectations().cloned();
            self.checked = None;
            // the heights are built, so that this order only measures
            self.stale = true;
        }
        if std::mem::replace(&mut self.build, document.build()) == self.build {
            // The built graph is the same, so the results and the running work of the worker stay valid.
            return;
        }
        self.outdated();
    }

    /// Call after a change that affects the results.
    fn outdated(&mut self) {
        let document = &self.document;
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
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Session").field("path", &self.path()).field("revision", &self.revision).finish_non_exhaustive()
    }
}
