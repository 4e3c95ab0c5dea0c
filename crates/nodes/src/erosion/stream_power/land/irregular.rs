//! Ridges, valleys and slopes that are irregular in plan.
//!
//! The law works alike on all rock of one hardness, so that ridges and valleys run straight, or in smooth curves, for
//! many cells. In real rock, joints, dykes and thin beds deflect them over all distances. The terrain at the end of a run
//! is therefore that at displaced places, h(x + d(x)). Each component of d is a sum of octaves of noise whose gradients
//! have one standard deviation, the parameter `irregularity`, from 4 √A₀ down to two cells: a ridge turns by that much in
//! each octave. As long as the gradient of d stays below one, no place is taken twice, so that the displaced terrain has
//! the same ridges, valleys and outlets.
//!
//! Some cells stay: those at sides that are not joined, at base level and below the sea, and where most of the detail
//! of the initial terrain is left. Towards them the displacement fades, as a step would tear the terrain.
//!
//! Only results are displaced. The land on which the time passes, and the state that a finer level goes on from, are not.

use orograph_graph::{Job, NodeError, mix};

use super::{Land, Work};
use crate::{
    erosion::stream_power::{
        Params,
        levels::{Around, Frame, Places},
    },
    numerics::{distance, par, waves::Waves},
};

/// The longest wavelength of the displacement in √A₀, and the shortest in cells.
const LONGEST: f64 = 4.0;
const SHORTEST_CELLS: f64 = 2.0;
/// The spectral slope at which waves of every length bend a line by the same angle.
const SPECTRAL_SLOPE: f64 = 4.0;
/// The direction of the lattices of noise.
const GRAIN: f64 = 0.6;
/// Standard deviation of the slope of an octave along one axis, per wavelength, over that of the octave.
const OCTAVE_SLOPE: f64 = 2.894;
/// The seeds of its components.
const SEEDS: [u32; 2] = [0x5EED_0006, 0x5EED_0007];
/// It fades towards cells that stay over so much of the longest wavelength.
const FADE: f64 = 0.25;
/// Detail of the initial terrain is as long as so many √A₀, for how much of it is left.
const DETAIL: f64 = 0.5;
/// Where more of it is left, cells stay.
const LEFT: f64 = 0.5;

/// The places that results come from.
pub struct Displacement {
    places: Places,
    nx: usize,
    /// How far east and south of each cell, in cells.
    shifts: [Vec<f32>; 2],
}

impl Displacement {
    /// Heights, or other samples that vary smoothly.
    #[must_use]
    pub fn smooth(&self, samples: &[f64]) -> Vec<f64> {
        par::map(samples.len(), |cell| self.around(cell).cubic(|cell| samples[cell]))
    }

    /// The same in single precision.
    #[must_use]
    pub fn smooth_single(&self, samples: &[f32]) -> Vec<f32> {
        par::map(samples.len(), |cell| self.around(cell).cubic(|cell| f64::from(samples[cell])) as f32)
    }

    /// Samples of the nearest cells, for what rivers alone have.
    #[must_use]
    pub fn nearest(&self, samples: &[f64]) -> Vec<f64> {
        par::map(samples.len(), |cell| samples[self.around(cell).nearest()])
    }

    fn around(&self, cell: usize) -> Around {
        let place = [cell % self.nx, cell / self.nx];
        self.places.around([0, 1].map(|axis| place[axis] as f64 + f64::from(self.shifts[axis][cell])))
    }
}

impl Land<'_> {
    /// Where results come from. Returns None where that is everywhere the cell itself.
    ///
    /// # Errors
    /// [`NodeError::Cancelled`].
    pub fn displacement(&self, job: &Job<'_>, params: &Params) -> Result<Option<Displacement>, NodeError> {
        let window = job.window();
        let (nx, ny, hillslope_m) = (window.nx(), window.ny(), params.headwater_area.sqrt());
        let longest_m = LONGEST * hillslope_m;
        if params.irregularity <= 0.0 || longest_m < SHORTEST_CELLS * self.cell_m || self.time_yr <= 0.0 {
            return Ok(None);
        }
        let component = |seed: u32| {
            let seed = mix(job.seed() ^ mix(seed));
            let waves = Waves { longest_m, spectral_slope: SPECTRAL_SLOPE, stretch: 1.0, grain: GRAIN, seed };
            waves.field(job, &window, SHORTEST_CELLS * self.cell_m)
        };
        let [mut east, mut south] = [component(SEEDS[0])?, component(SEEDS[1])?];
        // the deviation of all octaves, of which the first has the part √(3/4)
        let deviation = params.irregularity * longest_m / (OCTAVE_SLOPE * 0.75_f64.sqrt());
        let per_k = self.time_yr * self.area.least_power() / (DETAIL * hillslope_m);
        let joined = self.grid.wraps();
        let stays = |cell: usize| {
            let is_side = [(cell % nx, nx, joined[0]), (cell / nx, ny, joined[1])]
                .iter()
                .any(|&(at, count, is_joined)| !is_joined && (at == 0 || at + 1 == count));
            let weakness = || self.bedrock.as_ref().map_or(1.0, |bedrock| bedrock.weakness(cell));
            is_side
                || self.is_base(cell)
                || self.heights[cell] < self.sea_level_m
                || self.detail_left(cell, weakness(), per_k) > LEFT
        };
        let faded = FADE * longest_m / self.cell_m;
        let squares = distance::squared(job, [1.0; 2], faded.ceil() as u32, stays)?;
        let amount = |cell: usize| (f64::from(squares[cell]).sqrt() / faded).min(1.0) * deviation / self.cell_m;
        for shifts in [&mut east, &mut south] {
            par::change_at(shifts, |cell, shift| *shift = (amount(cell) * f64::from(*shift)) as f32);
        }
        let frame = Frame { inner: window, outer: window, before: [0; 2] };
        Ok(Some(Displacement { places: Places::new(frame, frame), nx, shifts: [east, south] }))
    }

    /// Takes everything from displaced places: the terrain, the sediment, and what the last step did.
    pub fn displace(&mut self, displacement: &Displacement, work: &mut Work) {
        let before_m = self.total_m();
        self.heights = displacement.smooth(&self.heights);
        let displaced_m = self.total_m() - before_m;
        if let Some(budget) = &mut self.budget {
            budget.displace(displaced_m);
        }
        if let Some(thickness) = self.sediment.as_mut().and_then(|sediment| sediment.thickness.as_mut()) {
            *thickness = displacement.smooth_single(thickness);
        }
        if let Some(lowered) = &mut work.lowered {
            *lowered = displacement.smooth(lowered);
        }
        if let Some(flux) = &mut work.flux {
            *flux = displacement.nearest(flux);
        }
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Boundary, Edge, World};

    use super::{
        super::{Budget, Footing},
        *,
    };
    use crate::{
        erosion::stream_power::{Inputs, NODE},
        prelude::*,
        testing,
    };

    const COUNT: usize = 240;
    const CELL_M: f64 = 25.0;

    /// Cells that are at least `margin` cells from all sides.
    fn inner(margin: usize) -> impl Iterator<Item = usize> {
        (margin..COUNT - margin).flat_map(move |y| (margin..COUNT - margin).map(move |x| y * COUNT + x))
    }

    fn field(height: impl Fn(f64, f64) -> f64) -> Field {
        let side = COUNT as u32;
        testing::field(World { boundary: Boundary::all(Edge::Open), ..testing::world(side, side, CELL_M) }, height)
    }

    /// A land of which erosion has left no detail, and its displacement in waves of 750 m and shorter, to 50 m.
    fn land<'a>(job: &'a Job<'_>) -> Result<(Land<'a>, Displacement), NodeError> {
        let (params, start) = (Params::read(job.params), Inputs::read(job)?.height);
        let mut land = Land::new(job, &params, start, Footing::default())?;
        land.time_yr = 1e9;
        let displacement = land.displacement(job, &params)?.expect("an irregular terrain");
        Ok((land, displacement))
    }

    fn run(test: fn(&Job<'_>) -> Result<Outputs, NodeError>, irregularity: f64, height: &Field) {
        let node = Node { cpu: test, inputs: NODE.inputs, params: NODE.params, reads_sea: true, ..Node::DEFAULT };
        let params = testing::with_params(&NODE, &format!("irregularity={irregularity},headwater_area=35156"));
        testing::outputs(&node, &params, &[("height", height)]).expect("a land");
    }

    fn bends(job: &Job<'_>) -> Result<Outputs, NodeError> {
        let (land, displacement) = land(job)?;
        let found = displacement.smooth(&land.heights);
        // the plane rises to the east, and is level from cell to cell to the south
        let slope = |cell: usize| (found[cell + COUNT] - found[cell]) / CELL_M;
        let squares: Vec<f64> = inner(20).map(|cell| slope(cell) * slope(cell)).collect();
        let deviation = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        // differences from cell to cell have a part of the slope of the shortest of the four octaves
        assert!((0.17..0.2).contains(&deviation), "{deviation}");
        Ok(Outputs::default())
    }

    /// Four octaves, each of which bends by 0.1: 0.2 together.
    #[test]
    fn each_octave_bends_by_the_irregularity() {
        run(bends, 0.1, &field(|x, _| x));
    }

    fn meets(job: &Job<'_>) -> Result<Outputs, NodeError> {
        let (land, displacement) = land(job)?;
        assert_eq!(land.grid.wraps(), [true, false]);
        for shifts in &displacement.shifts {
            let steps = |here: usize, next: usize| -> f32 {
                (20..COUNT - 20).map(|y| (shifts[y * COUNT + here] - shifts[y * COUNT + next]).abs()).sum()
            };
            let inside = (20..COUNT - 20).map(|x| steps(x, x + 1)).fold(0.0, f32::max);
            let (seam, apart) = (steps(COUNT - 1, 0), steps(COUNT / 2, 0));
            assert!(seam < 1.1 * inside && apart > 2.0 * inside, "{seam} {apart} {inside}");
        }
        Ok(Outputs::default())
    }

    /// Terrain is displaced beside joined sides as it is elsewhere, and by the same on both of them.
    #[test]
    fn periodic_sides_have_no_seam() {
        let boundary = Boundary { west: Edge::Periodic, east: Edge::Periodic, ..Boundary::all(Edge::Open) };
        let world = World { boundary, ..testing::world(COUNT as u32, COUNT as u32, CELL_M) };
        run(meets, 0.2, &testing::field(world, |x, y| 0.5 * (x - 3000.0).abs() + 0.1 * y));
    }

    fn keeps_valleys(job: &Job<'_>) -> Result<Outputs, NodeError> {
        let (land, displacement) = land(job)?;
        let found = displacement.smooth(&land.heights);
        let is_pit = |cell: &usize| {
            let beside = [cell - 1, cell + 1].into_iter();
            let rows = (cell - COUNT - 1..=cell - COUNT + 1).chain(cell + COUNT - 1..=cell + COUNT + 1);
            beside.chain(rows).all(|beside| found[beside] > found[*cell])
        };
        let pits = inner(30).filter(is_pit).count();
        // sharp valleys pass between cells
        assert!(pits < 180 * 180 / 200, "{pits}");
        let mean_m = |heights: &[f64]| heights.iter().sum::<f64>() / heights.len() as f64;
        assert!((mean_m(&found) / mean_m(&land.heights) - 1.0).abs() < 0.01);
        Ok(Outputs::default())
    }

    /// Ridges and valleys stay whole: hardly any cell of a valley becomes a pit.
    #[test]
    fn valleys_still_drain() {
        run(keeps_valleys, 0.12, &field(|x, y| 0.2 * x + 0.4 * (y.rem_euclid(1500.0) - 750.0).abs()));
    }

    fn tears_nothing(job: &Job<'_>) -> Result<Outputs, NodeError> {
        let (_, displacement) = land(job)?;
        let apart = |shifts: &[f32], cell: usize| {
            [cell + 1, cell + COUNT].map(|next| (shifts[next] - shifts[cell]).abs()).into_iter().fold(0.0, f32::max)
        };
        let most =
            displacement.shifts.each_ref().map(|shifts| inner(1).map(|cell| apart(shifts, cell)).fold(0.0, f32::max));
        let far = displacement.shifts[0].iter().fold(0.0_f32, |far, shift| far.max(shift.abs()));
        assert!(far > 3.0 && most.iter().all(|most| *most < 1.0), "{far} {most:?}");
        Ok(Outputs::default())
    }

    /// Beside a cliff at the shore, which stays, the terrain moves by less than a cell from cell to cell.
    #[test]
    fn shores_are_not_torn() {
        let shore = field(|x, y| if x > 3000.0 { 100.0 + 0.1 * y } else { 900.0 });
        run(tears_nothing, 0.12, &testing::at_sea(&shore, 800.0));
    }

    fn keeps_the_sea(job: &Job<'_>) -> Result<Outputs, NodeError> {
        let (mut land, displacement) = land(job)?;
        let before = land.heights.clone();
        land.budget = Some(Budget::new(0.0, land.total_m()));
        land.displace(&displacement, &mut Work::default());
        let moved: Vec<usize> = (0..before.len()).filter(|&cell| land.heights[cell] != before[cell]).collect();
        assert!(moved.iter().all(|&cell| before[cell] >= 200.0) && moved.len() > before.len() / 4, "{}", moved.len());
        let report = land.report(1.0);
        assert!(report.ledger[0].error < 1e-9 && report.ledger[0].gained.len() == 2, "{report:?}");
        Ok(Outputs::default())
    }

    /// The balance contains what the displacement changed.
    #[test]
    fn land_below_the_sea_stays() {
        let shore = field(|x, y| 0.1 * x + 60.0 * (y / 90.0).rem_euclid(2.0));
        run(keeps_the_sea, 0.2, &testing::at_sea(&shore, 200.0));
    }

    /// What has not been eroded is not displaced.
    #[test]
    fn the_initial_terrain_stays_where_nothing_erodes() {
        let hills = field(|x, y| 50.0 * ((x / 300.0).rem_euclid(2.0) - 1.0).abs() + 0.1 * y);
        let nothing = Field::constant(*hills.window(), 0.0);
        let [regular, irregular] = ["0", "0.3"].map(|irregularity| {
            let changes = format!("duration=1e6,rounding=0,schedule=full,irregularity={irregularity}");
            let fields = [("height", &hills), ("erodibility", &nothing)];
            testing::run(&NODE, &testing::with_params(&NODE, &changes), &fields, "height").into_samples()
        });
        assert!(regular == irregular);
    }
}
