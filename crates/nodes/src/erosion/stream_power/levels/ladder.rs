//! The cells of the levels: they follow from the world and the parameters, not from the cells that are asked for.

use orograph_graph::{Window, World};

use crate::erosion::stream_power::{Params, inland};

/// Cells along the shorter side of the coarsest level.
const FEWEST_CELLS: u32 = 128;
/// The same where hillslopes are short compared with the world.
const MOST_CELLS: u32 = 256;
/// The coarsest level holds hillslopes where its cells are at most so long, in √A₀.
const HILLSLOPE: f64 = 0.4;
/// Worlds so long that the coarsest level would have more cells get fewer across.
const LARGEST: f64 = 65_536.0 * 4.0;

/// The levels of a run.
#[derive(Clone, Copy, Debug)]
pub struct Ladder {
    asked: Window,
    coarsest: [u32; 2],
    margin: u32,
    finest: u32,
}

/// The cells of one level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    /// 0 is the coarsest.
    pub number: u32,
    /// The world on its cells.
    pub inner: Window,
    /// Cells of the margin beyond `inland` sides.
    pub margin: u32,
    /// Side of a cell of the coarsest level in metres.
    pub coarsest_m: f64,
}

impl Ladder {
    /// The levels up to the cells of a window, which is a whole world.
    #[must_use]
    pub fn new(asked: Window, params: &Params) -> Self {
        let size = asked.world.size;
        let (shorter_m, longer_m) = (size[0].min(size[1]), size[0].max(size[1]));
        let heads_m2 = if params.headwater_area > 0.0 { params.headwater_area } else { params.critical_area };
        let short_slopes = shorter_m / f64::from(FEWEST_CELLS) > HILLSLOPE * heads_m2.sqrt();
        let mut across = if short_slopes { MOST_CELLS } else { FEWEST_CELLS };
        while across > 1 && longer_m / shorter_m * f64::from(across * across) > LARGEST {
            across /= 2;
        }
        let coarsest = size.map(|side_m| ((side_m / shorter_m * f64::from(across)).round() as u32).max(1));
        let margin = if inland::sides(&asked.world).contains(&true) {
            (World::MARGIN * f64::from(across)).round() as u32
        } else {
            0
        };
        let finer = f64::from(asked.cells[0]) / f64::from(coarsest[0]);
        let finest = (0..16).find(|level| f64::from(1_u32 << level) >= finer * (1.0 - 1e-9)).unwrap_or(16);
        Self { asked, coarsest, margin, finest }
    }

    /// The number of the finest level, from 0.
    #[must_use]
    pub const fn finest(&self) -> u32 {
        self.finest
    }

    /// A level. The finest has the cells that are asked for, where these are not fewer than those of the coarsest.
    #[must_use]
    pub fn rung(&self, number: u32) -> Rung {
        let world = self.asked.world;
        let cells = self.coarsest.map(|cells| cells << number);
        let coarsest_m = world.size[0] / f64::from(self.coarsest[0]);
        // square cells, so that the world may end up to half a cell of the coarsest level elsewhere
        let own = |cells: [u32; 2]| {
            let cell_m = world.size[0] / f64::from(cells[0]);
            Window::whole(World { size: [world.size[0], f64::from(cells[1]) * cell_m], cells, ..world })
        };
        if number < self.finest || self.asked.cells[0] < self.coarsest[0] {
            return Rung { number, inner: own(cells), margin: self.margin << number, coarsest_m };
        }
        let finer = f64::from(self.asked.cells[0]) / f64::from(self.coarsest[0]);
        Rung { number, inner: self.asked, margin: (f64::from(self.margin) * finer).round() as u32, coarsest_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{erosion::stream_power::NODE, testing};

    fn ladder(size: [f64; 2], cells: [u32; 2]) -> Ladder {
        let params = Params::read(&orograph_graph::ParamValues::defaults(&NODE.specs()));
        Ladder::new(Window::whole(World { size, ..testing::world(cells[0], cells[1], 1.0) }), &params)
    }

    #[test]
    fn levels_do_not_depend_on_the_cells_asked_for() {
        let few = ladder([16_384.0; 2], [512; 2]);
        let many = ladder([16_384.0; 2], [1000; 2]);
        assert_eq!((few.finest(), many.finest()), (2, 3));
        assert_eq!([0, 1].map(|number| few.rung(number)), [0, 1].map(|number| many.rung(number)));
        assert_eq!([0, 1, 2, 3].map(|number| many.rung(number).inner.cells[0]), [128, 256, 512, 1000]);
        assert_eq!(ladder([60e3; 2], [1024; 2]).rung(0).inner.cells, [256; 2]);
    }

    #[test]
    fn small_and_long_worlds_have_a_level() {
        assert_eq!(
            (ladder([100.0; 2], [10; 2]).finest(), ladder([100.0; 2], [10; 2]).rung(0).inner.cells),
            (0, [128; 2])
        );
        let strip = ladder([8000.0, 20.0], [400, 1]);
        assert!(strip.rung(strip.finest()).inner.len() < 1 << 19, "{strip:?}");
        assert_eq!(ladder([2.0, 1.0], [2000, 1000]).rung(0).inner.cells, [256, 128]);
    }
}
