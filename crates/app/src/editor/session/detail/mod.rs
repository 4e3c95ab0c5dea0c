//! Close views at finer cells: the visible part of the world is built at smaller cells than those of the preview.
//!
//! The part is requested once the view has been still for a moment and everything else is built. Its window is a little
//! larger than the view and aligned to a coarse grid, so that a small move needs no new part. A node that needs the
//! whole world rules a part out: a part at other cells would differ from the exported terrain.

mod part;

use std::{
    collections::BTreeMap,
    time::{Duration, Instant},
};

use orograph_graph::{EvalError, Value, Window, World};

pub use self::part::View;
use self::part::{covers, finer};
use super::worker::{self, Part, Wanted, coarser, longer};
use super::{Built, Session};

/// How long the view must be still before a part is requested.
const REST: Duration = Duration::from_millis(150);
/// Cells of the preview may be this many pixels wide before a part is requested.
const COARSE_PX: f64 = 2.0;

/// The state of a close view.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Detail {
    /// The view keeps the cells of the preview because this node must be computed for the whole world.
    OfBuild {
        /// The node's name in the document.
        node: String,
    },
    /// The finer part is being built.
    Building,
    /// The finer part is built.
    Built {
        /// Cells along the longer side of the whole world.
        cells: u32,
    },
    /// The finer part cannot be built.
    Failed {
        /// The reason.
        message: String,
    },
}

/// A finer part of some outputs.
#[derive(Clone, Debug, PartialEq)]
struct Target {
    revision: u64,
    /// The outputs, as `node.port`.
    ports: Vec<String>,
    window: Window,
}

/// Outputs by name.
type Values = BTreeMap<String, Built>;

/// Whether a node rules out a part of some outputs, cached.
#[derive(Debug)]
struct RuledOut {
    /// The state of the document, the outputs, and the cells of the world that it applies to.
    of: (u64, Vec<String>, [u32; 2]),
    /// The node that needs the whole world. None if no node does.
    by: Option<String>,
}

/// The finer part of a close view.
#[derive(Debug, Default)]
pub(super) struct Close {
    detail: Option<Detail>,
    /// The part that the view needs, and when it was first needed.
    wanted: Option<(Target, Instant)>,
    ordered: Option<Target>,
    /// Outputs of the requested part that are built while others are not.
    come: Values,
    answer: Option<(Target, Result<Values, String>)>,
    whole: Vec<RuledOut>,
}

impl Session {
    /// The state of a close view. Returns None when the preview is fine enough for the view.
    #[must_use]
    pub const fn detail(&self) -> Option<&Detail> {
        self.close.detail.as_ref()
    }

    /// The newest finer part of an output (`node.port`) that the view needs finer cells of.
    #[must_use]
    pub fn finer(&self, port: &str) -> Option<&Built> {
        self.close.wanted.as_ref().filter(|(target, _)| target.ports.iter().any(|wanted| wanted == port))?;
        let (_, values) = self.close.answer.as_ref()?;
        values.as_ref().ok()?.get(port)
    }

    /// Sets the visible part of the world and the drawn outputs (`node.port`), of each side of a comparison. Returns
    /// the delay after which to call [`Self::poll`], which then requests a finer part.
    pub fn look_at(&mut self, view: Option<View>, sides: &[Vec<String>]) -> Option<Duration> {
        let found = view.and_then(|view| self.served(&view, sides));
        let (target, detail) = found.unzip();
        self.close.detail = detail;
        let Some(target) = target.flatten() else {
            self.close.wanted = None;
            return None;
        };
        let since = match &self.close.wanted {
            Some((before, since)) if before.window == target.window => *since,
            _ => Instant::now(),
        };
        let ordered = self.close.ordered.as_ref() == Some(&target);
        self.close.wanted = Some((target, since));
        (!ordered && !self.is_busy()).then(|| REST.saturating_sub(since.elapsed()))
    }

    /// The part that a view needs, and the state of its first side that can have one. Returns None when the preview is
    /// fine enough.
    fn served(&mut self, view: &View, sides: &[Vec<String>]) -> Option<(Option<Target>, Detail)> {
        let graph = self.document.graph();
        let has_picture = |port: &String| graph.port(port).is_ok_and(|port| graph.output_type(port).planes().is_some());
        let can = |side: &&Vec<String>| !side.is_empty() && side.iter().all(has_picture);
        let sides: Vec<&Vec<String>> = sides.iter().filter(can).collect();
        if self.simulation.is_some() || sides.is_empty() {
            return None;
        }
        let document = self.document.world();
        let preview = coarser(document, self.cells);
        let sees_all = (0..2).all(|axis| view.part[0][axis] <= 0.0 && view.part[1][axis] >= preview.size[axis]);
        if sees_all || document.check().is_err() || preview.cell_m() <= COARSE_PX * view.pixel_m {
            return None;
        }
        let mut window = finer(document, preview, view)?;
        let ruled_out: Vec<Option<String>> = sides.iter().map(|side| self.whole(side, &window.world)).collect();
        let of_build = ruled_out[0].clone().map(|node| Detail::OfBuild { node });
        let left = sides.into_iter().zip(&ruled_out).filter(|(_, by)| by.is_none());
        let mut ports: Vec<String> = left.flat_map(|(side, _)| side.iter().cloned()).collect();
        ports.sort();
        ports.dedup();
        if let Some(of_build) = of_build.clone().filter(|_| ports.is_empty()) {
            return Some((None, of_build));
        }
        let ordered = self.close.ordered.as_ref().map(|ordered| ordered.window);
        if let Some(before) = ordered.filter(|before| before.world == window.world && covers(before, view)) {
            window = before;
        }
        let target = Target { revision: self.revision, ports, window };
        let built = match &self.close.answer {
            Some((of, Ok(_))) if *of == target => Detail::Built { cells: longer(window.world.cells) },
            Some((of, Err(message))) if *of == target => Detail::Failed { message: message.clone() },
            _ => Detail::Building,
        };
        Some((Some(target), of_build.unwrap_or(built)))
    }

    /// The node of the document that needs the whole world to compute these outputs. Returns None when there is none.
    fn whole(&mut self, ports: &[String], world: &World) -> Option<String> {
        let of = (self.revision, ports.to_vec(), world.cells);
        self.close.whole.retain(|known| (known.of.0, known.of.2) == (of.0, of.2));
        if let Some(known) = self.close.whole.iter().find(|known| known.of == of) {
            return known.by.clone();
        }
        let expanded = self.document.expand();
        let placed = ports.iter().filter_map(|port| expanded.port(self.document.graph().port(port).ok()?));
        let node = placed.filter_map(|port| expanded.graph.needs_whole_world(port.node, world)).next();
        let by = node.map(|node| worker::outer(&expanded.graph.instance(node).name).to_owned());
        self.close.whole.push(RuledOut { of, by: by.clone() });
        by
    }

    /// Requests the part that the view needs, once the view has been still and nothing else is being built.
    pub(super) fn order_detail(&mut self) {
        let Some((target, since)) = &self.close.wanted else { return };
        let ordered = self.close.ordered.as_ref() == Some(target);
        if ordered || target.revision != self.revision || self.is_busy() || since.elapsed() < REST {
            return;
        }
        let target = target.clone();
        let mut order = self.order();
        let graph = self.document.graph();
        let expanded = self.document.expand();
        let wanted = target.ports.iter().map(|name| {
            let port = expanded.port(graph.port(name).ok()?)?;
            Some(Wanted { node: name.split_once('.')?.0.to_owned(), name: name.clone(), port })
        });
        let Some(wanted) = wanted.collect() else { return };
        order.part = Some(Part { wanted, window: target.window });
        self.close.ordered = Some(target);
        self.close.come.clear();
        self.worker.submit(order);
    }

    /// Call it before another order, which cancels an unfinished part.
    pub(super) fn forget_ordered_detail(&mut self) {
        let answered = self.close.answer.as_ref().map(|(target, _)| target);
        if self.close.ordered.as_ref() != answered {
            self.close.ordered = None;
        }
    }

    pub(super) fn hear_detail(&mut self, revision: u64, port: String, window: Window, part: Result<Value, EvalError>) {
        let ordered = self.close.ordered.as_ref();
        let is_ordered = |target: &&Target| target.revision == revision && target.window == window;
        let Some(target) = ordered.filter(is_ordered).filter(|target| target.ports.contains(&port)).cloned() else {
            return;
        };
        let cells = longer(window.world.cells);
        match part {
            Ok(value) => {
                self.close.come.insert(port, Built { revision, cells, step: 0, value });
                if self.close.come.len() == target.ports.len() {
                    self.close.answer = Some((target, Ok(std::mem::take(&mut self.close.come))));
                }
            }
            Err(error) => self.close.answer = Some((target, Err(error.to_string()))),
        }
    }
}
