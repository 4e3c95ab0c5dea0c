//! The cells of the levels: they follow from the world and the parameters, not from the cells that are asked for.

use orograph_graph::{Below, Window, World};

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
        let (across, shorter_m) = (cells_across(size, params), size[0].min(size[1]));
        let rounded = [f64::round, f64::floor, f64::ceil].map(|round: fn(f64) -> f64| {
            size.map(|side_m| (round(side_m / shorter_m * f64::from(across)) as u32).max(1))
        });
        // the world on the cells of a level, which may be a little longer or shorter, must have the same levels
        let is_stable = |cells: &&[u32; 2]| cells_across(own_size(size, **cells), params) == across;
        let coarsest = *rounded.iter().find(is_stable).unwrap_or(&rounded[0]);
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

    /// What the results on the asked cells go on from: on those of the coarsest level they are means of the next, and
    /// on fewer cells means of these.
    #[must_use]
    pub fn below(&self) -> Below {
        if self.asked.cells[0] < self.coarsest[0] {
            return Below::Results(self.own(self.coarsest).world);
        }
        match self.finest.checked_sub(1) {
            Some(below) => Below::State(self.rung(below).inner.world),
            None => Below::Results(self.own(self.coarsest.map(|cells| 2 * cells)).world),
        }
    }

    /// Whether the asked cells are those of the coarsest level.
    #[must_use]
    pub fn is_coarsest(&self) -> bool {
        self.asked.cells == self.coarsest
    }

    /// Whether the asked cells are those of a level, and not between two of them.
    #[must_use]
    pub fn is_level(&self) -> bool {
        self.asked.cells == self.coarsest.map(|cells| cells << self.finest)
    }

    /// The world on other cells: square ones, so that it may end up to half a cell of the coarsest level elsewhere.
    fn own(&self, cells: [u32; 2]) -> Window {
        let world = self.asked.world;
        Window::whole(World { size: own_size(world.size, cells), cells, ..world })
    }

    /// A level. The finest has the cells that are asked for, where these are not fewer than those of the coarsest.
    #[must_use]
    pub fn rung(&self, number: u32) -> Rung {
        let world = self.asked.world;
        let cells = self.coarsest.map(|cells| cells << number);
        let coarsest_m = world.size[0] / f64::from(self.coarsest[0]);
        if number < self.finest || self.asked.cells[0] < self.coarsest[0] {
            return Rung { number, inner: self.own(cells), margin: self.margin << number, coarsest_m };
        }
        Rung { number, inner: self.asked, margin: self.margin(), coarsest_m }
    }

    /// Cells of the margin beyond `inland` sides on the asked cells: as wide in metres as on the levels.
    #[must_use]
    pub fn margin(&self) -> u32 {
        let finer = f64::from(self.asked.cells[0]) / f64::from(self.coarsest[0]);
        (f64::from(self.margin) * finer).round() as u32
    }
}

/// The size of a world of so many square cells, as wide as one of another size. To the last bit as large where it ends
/// there, so that both are one place in the store.
fn own_size([width_m, height_m]: [f64; 2], cells: [u32; 2]) -> [f64; 2] {
    let own_m = f64::from(cells[1]) * (width_m / f64::from(cells[0]));
    [width_m, if (own_m / height_m - 1.0).abs() < 1e-9 { height_m } else { own_m }]
}

/// Cells of the coarsest level along the shorter side.
fn cells_across(size: [f64; 2], params: &Params) -> u32 {
    let (shorter_m, longer_m) = (size[0].min(size[1]), size[0].max(size[1]));
    let heads_m2 = if params.headwater_area > 0.0 { params.headwater_area } else { params.critical_area };
    let short_slopes = shorter_m / f64::from(FEWEST_CELLS) > HILLSLOPE * heads_m2.sqrt();
    let mut across = if short_slopes { MOST_CELLS } else { FEWEST_CELLS };
    while across > 1 && longer_m / shorter_m * f64::from(across * across) > LARGEST {
        across /= 2;
    }
    across
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

    /// The levels of each level are those below it, also where worlds on its cells are a little longer or shorter.
    #[test]
    fn levels_have_the_levels_below_them() {
        let thresholds = [4.0, 4.003, 3.997, 16.03, 1.0, 1.0039, 1.5];
        for ratio in thresholds.into_iter().chain((0..60).map(|at| 1.0 + 0.071 * f64::from(at))) {
            // around 128 cells of 0.4 √A₀
            for shorter_m in [100.0, 35_900.0, 36_200.4, 36_203.9, 36_204.0, 36_210.0, 36_300.0, 3e5] {
                for size in [[ratio * shorter_m, shorter_m], [shorter_m, ratio * shorter_m]] {
                    let cells = size.map(|side_m| (side_m / shorter_m * 1000.0).round() as u32);
                    let mut above = ladder(size, cells);
                    while let Below::State(world) = above.below() {
                        let here = ladder(world.size, world.cells);
                        assert!(here.is_level() && world.check().is_ok(), "{size:?} {world:?}");
                        assert_eq!((here.finest() + 1, here.coarsest), (above.finest(), above.coarsest), "{size:?}");
                        assert_eq!(here.rung(here.finest()), above.rung(here.finest()), "{size:?}");
                        above = here;
                    }
                    assert_eq!(above.finest(), 0);
                }
            }
        }
    }

    #[test]
    fn worlds_of_one_size_have_one_place_per_level() {
        for size in [[16_384.0; 2], [24e3, 16e3], [10e3, 10e3 / 3.0], [30_000.1, 20_000.1]] {
            let world = |along: u32| World { size, ..World::default() }.with_cells_along_x(along);
            let below = |along: u32| ladder(size, world(along).cells).below();
            if let (Below::State(fine), Below::State(finer)) = (below(1100), below(1500)) {
                assert_eq!(fine, finer);
            }
        }
        let requested = World { size: [24e3, 16e3], cells: [768, 512], ..World::default() };
        assert_eq!(world_of(ladder(requested.size, [1536, 1024]).below()), requested.size);
    }

    fn world_of(below: Below) -> [f64; 2] {
        let (Below::State(world) | Below::Results(world)) = below;
        world.size
    }

    #[test]
    fn single_grids_have_no_levels() {
        let world = testing::world(512, 512, 50.0);
        let wired = vec![false; NODE.inputs.len()];
        for (changes, has_levels) in [("", true), ("schedule=full", false), ("method=analytical", true)] {
            let params = testing::with_params(&NODE, changes);
            let levels = NODE.levels.expect("levels");
            let (window, wanted) = (Window::whole(world), orograph_graph::Wanted::ALL);
            let state = (levels.state)(&orograph_graph::Sizing {
                params: &params,
                window,
                wired: &wired,
                wanted,
                folder: "".as_ref(),
            });
            assert_eq!(((levels.below)(&params, &world).is_some(), state > 0), (has_levels, has_levels), "{changes}");
        }
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
