//! More cells where the view is close: the part of the world in view is built at finer cells than the preview.
//!
//! The part is ordered when the view has rested and everything else is built. It is a little larger than the view and begins
//! on a coarse grid, so that a small move needs no other part. A node that needs the whole world rules it out: a part at
//! other cells would not be the terrain that an export gives.

use std::time::{Duration, Instant};

use orograph_graph::{EvalError, Value, Window, World};

use super::{Built, Session};
use crate::editor::worker::{self, Part, Wanted, coarser, longer};

/// How long the view rests before a part is ordered.
const REST: Duration = Duration::from_millis(150);
/// Pixels that a cell of the preview covers at most before a part is ordered.
const COARSE_PX: f64 = 2.0;
/// Pixels that a cell of a part covers at most, where there are cells enough.
const FINE_PX: f64 = 1.5;
/// How many times the document's cells a part has at most, along a side of the world.
const FINEST: u32 = 4;
/// The most cells of a part: those of a large screen.
const MOST_CELLS: usize = 1 << 21;
/// Cells between lines of the grid on which parts begin and end.
const GRID: f64 = 64.0;
/// Cells around the view that a part has at least, so that the view can move.
const MARGIN: f64 = 32.0;

/// What is in view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The part of the world in view in metres, from the north-west corner to the south-east one.
    pub part: [[f64; 2]; 2],
    /// Side of a pixel in metres.
    pub pixel_m: f64,
    /// Whether the view draws a finer part over the preview.
    pub draws: bool,
}

/// How a close view is served.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Detail {
    /// It has the cells of the build, since this node is computed for the whole world.
    OfBuild {
        /// The node's name in the document.
        node: String,
    },
    /// Only the map draws finer cells.
    OnMap,
    /// Finer cells are being built.
    Building,
    /// Finer cells are there.
    Built {
        /// Cells along the longer side of the whole world.
        cells: u32,
    },
    /// Finer cells cannot be built.
    Failed {
        /// Why.
        message: String,
    },
}

/// A part of an output.
#[derive(Clone, Debug, PartialEq)]
struct Target {
    revision: u64,
    port: String,
    window: Window,
}

/// What is known of the close view.
#[derive(Debug, Default)]
pub(super) struct Close {
    detail: Option<Detail>,
    /// What the view needs, and since when it needs that part.
    wanted: Option<(Target, Instant)>,
    ordered: Option<Target>,
    answer: Option<(Target, Result<Built, String>)>,
    /// Of an output at a revision and with so many cells: the node that rules parts out.
    whole: Option<((u64, String, [u32; 2]), Option<String>)>,
}

impl Session {
    /// How a close view is served. Returns None when the view is not closer than the preview is fine.
    #[must_use]
    pub const fn detail(&self) -> Option<&Detail> {
        self.close.detail.as_ref()
    }

    /// The newest part with finer cells, and the output (`node.port`) that it is of.
    #[must_use]
    pub fn finer(&self) -> Option<(&str, &Built)> {
        let (target, built) = self.close.answer.as_ref()?;
        Some((target.port.as_str(), built.as_ref().ok()?))
    }

    /// Notes what is in view. Returns the time after which [`Self::poll`] has to be called to order a part of it.
    pub fn look_at(&mut self, view: Option<View>) -> Option<Duration> {
        let found = view.and_then(|view| self.served(&view));
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

    /// What a view needs and how it is served; None when the preview is fine enough for it.
    fn served(&mut self, view: &View) -> Option<(Option<Target>, Detail)> {
        let port = self.shown().filter(|_| self.simulation.is_none())?;
        let graph = self.document.graph();
        graph.output_type(graph.port(&port).ok()?).planes()?;
        let document = self.document.world();
        let preview = coarser(document, self.cells);
        let sees_all = (0..2).all(|axis| view.part[0][axis] <= 0.0 && view.part[1][axis] >= preview.size[axis]);
        if sees_all || document.check().is_err() || preview.cell_m() <= COARSE_PX * view.pixel_m {
            return None;
        }
        let mut window = finer(document, preview, view)?;
        if let Some(node) = self.whole(&port, &window.world) {
            return Some((None, Detail::OfBuild { node }));
        }
        if !view.draws {
            return Some((None, Detail::OnMap));
        }
        let ordered = self.close.ordered.as_ref().map(|ordered| ordered.window);
        if let Some(before) = ordered.filter(|before| before.world == window.world && covers(before, view)) {
            window = before;
        }
        let target = Target { revision: self.revision, port, window };
        let detail = match &self.close.answer {
            Some((of, Ok(built))) if *of == target => Detail::Built { cells: built.cells },
            Some((of, Err(message))) if *of == target => Detail::Failed { message: message.clone() },
            _ => Detail::Building,
        };
        Some((Some(target), detail))
    }

    /// The node of the document that needs the whole world to compute a part of an output.
    fn whole(&mut self, port: &str, world: &World) -> Option<String> {
        let key = (self.revision, port.to_owned(), world.cells);
        if let Some((_, node)) = self.close.whole.as_ref().filter(|(of, _)| *of == key) {
            return node.clone();
        }
        let expanded = self.document.expand();
        let placed = self.document.graph().port(port).ok().and_then(|port| expanded.port(port));
        let node = placed.and_then(|port| expanded.graph.needs_whole_world(port.node, world));
        let name = node.map(|node| worker::outer(&expanded.graph.instance(node).name).to_owned());
        self.close.whole = Some((key, name.clone()));
        name
    }

    /// Orders the part that the view needs, once the view has rested and nothing else is being built.
    pub(super) fn order_detail(&mut self) {
        let Some((target, since)) = &self.close.wanted else { return };
        let current = target.revision == self.revision && self.shown().as_ref() == Some(&target.port);
        let ordered = self.close.ordered.as_ref() == Some(target);
        if ordered || !current || self.is_busy() || since.elapsed() < REST {
            return;
        }
        let target = target.clone();
        let mut order = self.order();
        let graph = self.document.graph();
        let placed = graph.port(&target.port).ok().and_then(|port| self.document.expand().port(port));
        let Some((port, (node, _))) = placed.zip(target.port.split_once('.')) else { return };
        let wanted = Wanted { node: node.to_owned(), name: target.port.clone(), port };
        order.part = Some(Part { wanted, window: target.window });
        self.close.ordered = Some(target);
        self.worker.submit(order);
    }

    /// Another order cancels that of a part, unless the part is there.
    pub(super) fn forget_ordered_detail(&mut self) {
        let answered = self.close.answer.as_ref().map(|(target, _)| target);
        if self.close.ordered.as_ref() != answered {
            self.close.ordered = None;
        }
    }

    pub(super) fn hear_detail(&mut self, revision: u64, port: String, window: Window, part: Result<Value, EvalError>) {
        let target = Target { revision, port, window };
        if self.close.ordered.as_ref() != Some(&target) {
            return;
        }
        let cells = longer(window.world.cells);
        let built = part.map(|value| Built { revision, cells, step: 0, value }).map_err(|error| error.to_string());
        self.close.answer = Some((target, built));
    }
}

/// The window of what is in view, in the coarsest world whose cells suit it. Returns None when no world has more cells than
/// the preview, or nothing of the world is in view.
fn finer(document: World, preview: World, view: &View) -> Option<Window> {
    let (least, all) = (longer(preview.cells), longer(document.cells));
    let below = std::iter::successors(Some(least), |cells| cells.checked_mul(2)).take_while(|cells| *cells < all);
    let from_document = (0..=FINEST.ilog2()).filter_map(|power| {
        let cells = [document.cells[0].checked_mul(1 << power)?, document.cells[1].checked_mul(1 << power)?];
        Some(World { cells, ..document })
    });
    let worlds = below.map(|cells| coarser(document, cells)).chain(from_document);
    let mut finest = None;
    for world in worlds.filter(|world| longer(world.cells) > least) {
        let window = around(world, view)?;
        if world.check().is_err() || window.len() > MOST_CELLS {
            break;
        }
        finest = Some(window);
        if world.cell_m() <= FINE_PX * view.pixel_m {
            break;
        }
    }
    finest
}

/// The window around what is in view, from line to line of the grid.
fn around(world: World, view: &View) -> Option<Window> {
    let mut window = Window::whole(world);
    for axis in 0..2 {
        let all = f64::from(world.cells[axis]);
        let [first, end] = [view.part[0][axis], view.part[1][axis]].map(|metres| metres / world.cell_m());
        if !(first < all && end > 0.0) {
            return None;
        }
        let first = (((first - MARGIN) / GRID).floor() * GRID).max(0.0);
        let end = (((end + MARGIN) / GRID).ceil() * GRID).min(all);
        window.origin[axis] = first as u32;
        window.cells[axis] = end as u32 - first as u32;
    }
    Some(window)
}

/// Returns true if the window has everything of the world that is in view.
fn covers(window: &Window, view: &View) -> bool {
    (0..2).all(|axis| {
        let first = f64::from(window.origin[axis]) * window.cell_m();
        let end = f64::from(window.origin[axis] + window.cells[axis]) * window.cell_m();
        let side = f64::from(window.world.cells[axis]) * window.cell_m();
        first <= view.part[0][axis].max(0.0) && end >= view.part[1][axis].min(side)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a world 8 km a side: 4 pixels are a cell of 512 along a side.
    const VIEW: View = View { part: [[3000.0, 3500.0], [5000.0, 4500.0]], pixel_m: 8000.0 / 2048.0, draws: true };

    fn world(cells: u32) -> World {
        World { size: [8000.0; 2], cells: [cells; 2], ..World::default() }
    }

    fn cells(document: u32, preview: u32, view: &View) -> Option<u32> {
        Some(finer(world(document), coarser(world(document), preview), view)?.world.cells[0])
    }

    #[test]
    fn a_part_has_as_many_cells_as_the_screen_and_the_document_allow() {
        assert_eq!(cells(1024, 512, &VIEW), Some(2048));
        assert_eq!(cells(8000, 512, &VIEW), Some(2048), "no more than there are pixels");
        assert_eq!(cells(1000, 512, &VIEW), Some(2000), "on the document's own cells where it can");
        assert_eq!(cells(300, 300, &VIEW), Some(1200), "four times the document's");
        let sharp = View { pixel_m: VIEW.pixel_m / 16.0, ..VIEW };
        assert_eq!(cells(65_536, 512, &sharp), Some(4096), "no more than a part may have");
        assert_eq!(cells(1024, 512, &View { part: [[9000.0; 2], [9500.0; 2]], ..VIEW }), None);
    }

    #[test]
    fn a_part_lies_on_the_grid_around_the_view() {
        let window = around(world(2048), &VIEW).expect("in view");
        // cells 768 to 1280 and 896 to 1152, with the margin
        assert_eq!((window.origin, window.cells), ([704, 832], [640, 384]));
        assert!(covers(&window, &VIEW));
        let moved = |by: f64| View { part: VIEW.part.map(|[x, y]| [x + by, y]), ..VIEW };
        assert!(covers(&window, &moved(32.0 * VIEW.pixel_m)) && !covers(&window, &moved(70.0 * VIEW.pixel_m)));
        let corner = View { part: [[-500.0; 2], [100.0; 2]], ..VIEW };
        let window = around(world(2048), &corner).expect("in view");
        assert_eq!((window.origin, window.cells), ([0; 2], [64; 2]));
        assert!(covers(&window, &corner));
    }
}
