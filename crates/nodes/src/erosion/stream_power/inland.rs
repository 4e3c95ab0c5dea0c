//! Sides beyond which the terrain continues.
//!
//! The run also computes a margin of a tenth of the world's shorter side, which is cut off at the end. Inputs are
//! mirrored into the margin, and heights are tilted outwards so that water leaves. It leaves through gates: the lowest
//! cell of each stretch of the outer edge keeps its height, while the edge between the gates rises with the terrain.
//! Rivers therefore gather into valleys before they reach the outer edge, and the visible part shows no rivers that run
//! straight to a side.

use orograph_graph::{Boundary, Edge, Field, Glimpses, InputValue, Job, Outputs, Value, Warnings, Window, World, mix};

use super::{
    Params,
    levels::{Frame, Ladder},
};
use crate::numerics::par;

/// How much the margin is inclined outwards, in metres per metre.
const INCLINE: f32 = 0.02;
/// Length of a stretch of the rim with one gate, in widths of the margin.
const STRETCH: f64 = 3.0;

/// Which of the sides west, east, north and south are `inland`.
#[must_use]
pub fn sides(world: &World) -> [bool; 4] {
    let Boundary { west, east, north, south } = world.boundary;
    [west, east, north, south].map(|edge| edge == Edge::Inland)
}

/// A world with its margin.
#[derive(Clone, Copy, Debug)]
pub struct Inland {
    inner: Window,
    outer: Window,
    /// Columns in the west and rows in the north that the margin adds.
    before: [usize; 2],
}

impl Inland {
    /// The margin of a job's world on a single grid, where it has one: that of the levels. Worlds so small that it has
    /// no cell have none.
    #[must_use]
    pub fn around(inner: Window, params: &Params) -> Option<Self> {
        Self::with_margin(inner, Ladder::new(inner, params).margin())
    }

    /// The same with a margin of so many cells.
    #[must_use]
    pub fn with_margin(inner: Window, margin: u32) -> Option<Self> {
        let world = inner.world;
        let [nx, ny] = world.cells;
        let [west, east, north, south] = sides(&world).map(|inland| if inland { margin } else { 0 });
        let cells = [nx + west + east, ny + north + south];
        if cells == world.cells {
            return None;
        }
        let size = cells.map(|cells| f64::from(cells) * inner.cell_m());
        let outer = Window::whole(World { size, cells, ..world });
        Some(Self { inner, outer, before: [west as usize, north as usize] })
    }

    /// Its cells.
    #[must_use]
    pub const fn frame(&self) -> Frame {
        Frame { inner: self.inner, outer: self.outer, before: self.before }
    }

    /// Cells with the margin.
    #[must_use]
    pub const fn cells(&self) -> usize {
        self.outer.len()
    }

    /// The same job on the world with its margin, watched by `glimpses`. [`Self::forward_warnings`] passes its warnings on.
    #[must_use]
    pub fn job<'a>(&self, job: &'a Job<'_>, glimpses: Option<Glimpses<'a>>) -> Job<'a> {
        let inputs = job.node.inputs.iter().zip(&job.inputs).map(|(input, value)| match value {
            InputValue::Value(Value::Field(field)) => {
                let incline = if input.name == "height" { INCLINE } else { 0.0 };
                InputValue::Value(Value::Field(self.reflect(field, incline)))
            }
            InputValue::Value(Value::Strata(strata)) => {
                InputValue::Value(strata.on(self.continued(strata.offset())).into())
            }
            other => other.clone(),
        });
        Job {
            node: job.node,
            params: job.params,
            inputs: inputs.collect(),
            window: self.outer,
            wanted: job.wanted,
            folder: job.folder.clone(),
            cancel: job.cancel.clone(),
            progress: job.progress,
            level: orograph_graph::LevelJob::default(),
            warnings: Warnings::default(),
            glimpses,
        }
    }

    /// Passes the warnings of the job with the margin on to the job without.
    pub fn forward_warnings(outer: &Job<'_>, inner: &Job<'_>) {
        outer.warnings.take().into_iter().for_each(|warning| inner.warn(warning));
    }

    /// A field that goes on in the margin as its reflection, `incline` lower for each metre.
    fn reflect(&self, field: &Field, incline: f32) -> Field {
        let (nx, samples) = (self.inner.nx(), field.samples());
        let fall_m = incline * self.inner.cell_m() as f32;
        let place = |at: usize, before: usize, count: usize| -> (usize, usize) {
            let at = at as isize - before as isize;
            let count = count as isize;
            let (mirrored, beyond) = if at < 0 {
                (-1 - at, -at)
            } else if at >= count {
                (2 * count - 1 - at, at - count + 1)
            } else {
                (at, 0)
            };
            (mirrored.clamp(0, count - 1) as usize, beyond as usize)
        };
        let mut reflected = vec![0.0; self.outer.len()];
        par::all(reflected.chunks_mut(self.outer.nx()), |y, row| {
            let (from, below) = place(y, self.before[1], self.inner.ny());
            for (x, sample) in row.iter_mut().enumerate() {
                let (column, beside) = place(x, self.before[0], nx);
                *sample = samples[from * nx + column] - fall_m * below.max(beside) as f32;
            }
        });
        Field::new(self.outer, reflected)
    }

    /// A field that goes on in the margin with the slope that it has inside: reflected in the nearest cell and
    /// inverted.
    fn continued(&self, field: &Field) -> Field {
        let (nx, samples) = (self.inner.nx(), field.samples());
        let place = |at: usize, before: usize, count: usize| -> [usize; 2] {
            let (at, last) = (at as isize - before as isize, count as isize - 1);
            let nearest = at.clamp(0, last);
            [nearest, (2 * nearest - at).clamp(0, last)].map(|at| at as usize)
        };
        let mut continued = vec![0.0; self.outer.len()];
        par::all(continued.chunks_mut(self.outer.nx()), |y, row| {
            let [near_y, mirrored_y] = place(y, self.before[1], self.inner.ny());
            for (x, sample) in row.iter_mut().enumerate() {
                let [near_x, mirrored_x] = place(x, self.before[0], nx);
                *sample = 2.0 * samples[near_y * nx + near_x] - samples[mirrored_y * nx + mirrored_x];
            }
        });
        Field::new(self.outer, continued)
    }

    /// Results without the margin.
    #[must_use]
    pub fn cut(&self, outputs: Outputs) -> Outputs {
        outputs.into_iter_named().fold(Outputs::default(), |cut, (name, value)| match value {
            Value::Field(field) => cut.with(name, self.inside(&field)),
            Value::Strata(strata) => cut.with(name, strata.on(self.inside(strata.offset()))),
            other => cut.with(name, other),
        })
    }

    fn inside(&self, field: &Field) -> Field {
        let (nx, outer_nx) = (self.inner.nx(), self.outer.nx());
        let mut samples = vec![0.0; self.inner.len()];
        par::all(samples.chunks_mut(nx), |y, row| {
            let first = (y + self.before[1]) * outer_nx + self.before[0];
            row.copy_from_slice(&field.samples()[first..first + nx]);
        });
        Field::new(self.inner, samples)
    }
}

/// The cells of the rim of `inland` sides through which rivers leave: the lowest of each stretch, in rising order.
#[must_use]
pub fn gates(window: &Window, heights: &[f32], seed: u32) -> Vec<u32> {
    let [nx, ny] = window.cells.map(|cells| cells as usize);
    let margin = World::MARGIN * nx.min(ny) as f64 / (1.0 + 2.0 * World::MARGIN);
    let longest = (STRETCH * margin).max(2.0);
    let mut gates = Vec::new();
    for (side, is_inland) in sides(&window.world).into_iter().enumerate() {
        if !is_inland {
            continue;
        }
        let count = if side < 2 { ny } else { nx };
        let cell = |at: usize| match side {
            0 => at * nx,
            1 => at * nx + nx - 1,
            2 => at,
            _ => (ny - 1) * nx + at,
        };
        let stretches = (count as f64 / longest).ceil().max(1.0) as usize;
        // ends between stretches are moved by up to a third of one
        let end = |at: usize| {
            if at == 0 || at == stretches {
                return at * count / stretches;
            }
            let draw = f64::from(mix(seed ^ mix((side * 4096 + at) as u32 + 1))) / 4_294_967_296.0 - 0.5;
            (((at as f64 + draw * 0.66) / stretches as f64) * count as f64) as usize
        };
        for stretch in 0..stretches {
            let cells = (end(stretch)..end(stretch + 1)).map(cell);
            gates.extend(cells.min_by(|a, b| heights[*a].total_cmp(&heights[*b])).map(|cell| cell as u32));
        }
    }
    gates.sort_unstable();
    gates.dedup();
    gates
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{erosion::stream_power::NODE, testing};

    fn around(window: Window) -> Option<Inland> {
        Inland::around(window, &Params::read(&testing::with_params(&NODE, "")))
    }

    fn world(nx: u32, ny: u32, boundary: Boundary) -> World {
        World { boundary, ..testing::world(nx, ny, 50.0) }
    }

    #[test]
    fn a_margin_is_a_tenth_of_the_shorter_side_where_sides_are_inland() {
        let all = around(Window::whole(world(100, 60, Boundary::all(Edge::Inland)))).expect("a margin");
        assert_eq!((all.outer.cells, all.outer.cell_m(), all.before), ([112, 72], 50.0, [6, 6]));
        let west = Boundary { west: Edge::Inland, ..Boundary::default() };
        let west = around(Window::whole(world(100, 60, west))).expect("a margin");
        assert_eq!((west.outer.cells, west.before), ([106, 60], [6, 0]));
        for window in [world(100, 60, Boundary::default()), world(4, 100, Boundary::all(Edge::Inland))] {
            assert!(around(Window::whole(window)).is_none());
        }
    }

    #[test]
    fn the_margin_reflects_and_falls_outwards_and_is_cut_off() {
        let window = Window::whole(world(40, 50, Boundary::all(Edge::Inland)));
        let field = testing::field(window.world, |x, y| x + 100.0 * y);
        let inland = around(window).expect("a margin");
        let plain = inland.reflect(&field, 0.0);
        assert_eq!(plain.samples()[4 * 48 + 3], field.samples()[0]);
        assert_eq!(plain.samples()[4 * 48], field.samples()[3]);
        let inclined = inland.reflect(&field, 0.02);
        assert_eq!(inclined.samples()[20 * 48], plain.samples()[20 * 48] - 4.0);
        assert_eq!(inland.inside(&inclined), field);
    }

    #[test]
    fn tilted_layers_keep_their_tilt_in_the_margin() {
        let window = Window::whole(world(40, 50, Boundary::all(Edge::Inland)));
        let field = testing::field(window.world, |x, y| x + 100.0 * y);
        let inland = around(window).expect("a margin");
        let continued = inland.continued(&field);
        let expected = testing::field(inland.outer.world, |x, y| (x - 200.0) + 100.0 * (y - 200.0));
        assert_eq!(continued.samples(), expected.samples());
    }

    /// Rivers leave through a few gates that keep their height; the rest of the rim rises with the land.
    #[test]
    fn gates_are_the_lowest_cells_of_stretches_of_the_rim() {
        let window = Window::whole(world(240, 200, Boundary { west: Edge::Wall, ..Boundary::all(Edge::Inland) }));
        let heights: Vec<f32> = (0..window.len()).map(|cell| (cell * 7919 % 1000) as f32).collect();
        let gates = gates(&window, &heights, 3);
        assert!((6..30).contains(&gates.len()) && gates.is_sorted(), "{gates:?}");
        for gate in gates {
            let (x, y) = (gate as usize % 240, gate as usize / 240);
            assert!(x == 239 || y == 0 || y == 199, "{x} {y}");
            assert!(heights[gate as usize] < 100.0);
        }
    }

    /// A plain run shows no side: the level land that rises everywhere stays as level at the sides as within.
    #[test]
    fn land_at_the_sides_is_as_that_within() {
        let height = testing::field(world(96, 96, Boundary::all(Edge::Inland)), |x, y| {
            200.0 * crate::erosion::stream_power::tests::white(x, y)
        });
        let [uplift, erodibility] = [0.001, 4e-6].map(|value| Field::constant(*height.window(), value));
        let fields = [("height", &height), ("uplift", &uplift), ("erodibility", &erodibility)];
        let params = testing::with_params(&NODE, "duration=2e6,time_step=1e5");
        let found = testing::run(&NODE, &params, &fields, "height");
        let mean = |keep: &dyn Fn(usize, usize) -> bool| {
            let cells = (0..96 * 96).filter(|cell| keep(cell % 96, cell / 96));
            let heights: Vec<f32> = cells.map(|cell| found.samples()[cell]).collect();
            testing::moments(&heights).0
        };
        let side = mean(&|x, y| x < 4 || y < 4 || x >= 92 || y >= 92);
        let within = mean(&|x, y| (24..72).contains(&x) && (24..72).contains(&y));
        // at sides at base level it is next to nothing
        assert!(side > 0.4 * within && within > 100.0, "{side} {within}");
    }

    #[test]
    fn narrow_worlds_and_the_sea_give_heights() {
        for (nx, ny) in [(1, 1), (3, 90), (12, 12), (90, 14)] {
            let height = testing::field(world(nx, ny, Boundary::all(Edge::Inland)), |x, y| 0.1 * x - 0.2 * y);
            let height = testing::at_sea(&height, 1.0);
            let params = testing::with_params(&NODE, "duration=1e6");
            let found = testing::run(&NODE, &params, &[("height", &height)], "height");
            assert!(found.samples().iter().all(|height| height.is_finite()), "{nx} {ny}");
        }
    }
}
