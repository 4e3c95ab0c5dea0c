//! Chooses the window and the cells of the finer part of a view.

use orograph_graph::{Window, World};

use crate::editor::session::worker::{coarser, longer};

/// A cell of the part is at most this many pixels wide, unless other limits apply.
const FINE_PX: f64 = 1.5;
/// Maximum cells of the part along a side of the world, as a multiple of the document's.
const FINEST: u32 = 4;
/// Maximum number of cells of a part: about the pixels of a large screen.
const MOST_CELLS: usize = 1 << 21;
/// Spacing in cells of the grid to which a part is aligned.
const GRID: f64 = 64.0;
/// Minimum margin of a part around the view in cells, so that the view can move.
const MARGIN: f64 = 32.0;

/// The visible part of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Its north-west and south-east corners in metres.
    pub part: [[f64; 2]; 2],
    /// Side of a pixel in metres.
    pub pixel_m: f64,
}

/// The window of a view, in the coarsest world whose cells are fine enough. Returns None when no such world has more
/// cells than the preview, or the view shows nothing of the world.
pub(super) fn finer(document: World, preview: World, view: &View) -> Option<Window> {
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

/// The window around a view, aligned to the grid. Returns None when the view shows nothing of the world.
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

/// Returns true if the window contains everything of the world that the view shows.
pub(super) fn covers(window: &Window, view: &View) -> bool {
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

    /// A view of a world 8 km wide, in which a cell of 512 along a side is 4 pixels wide.
    const VIEW: View = View { part: [[3000.0, 3500.0], [5000.0, 4500.0]], pixel_m: 8000.0 / 2048.0 };

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
