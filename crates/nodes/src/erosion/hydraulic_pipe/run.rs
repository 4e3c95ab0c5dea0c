//! The run: bands side by side, step after step.

use orograph_graph::{Job, Lane, NodeError};

use super::{
    band::{Band, HALO, STATES, STEPS_PER_SWEEP, Scene, State},
    flow::film,
    physics::{Pace, Physics, Sweep},
    spread::Spread,
};
use crate::numerics::par;

/// Minimum rows of a band: below that, the halo would cost more than a second thread gains.
const LEAST_ROWS: usize = 64;

/// Statistics of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pacing {
    pub steps: u64,
    pub shortest_s: f64,
    /// Sum of the time steps as used by the kernels.
    pub time_s: f64,
}

impl Pacing {
    /// Counts a sweep.
    pub fn add(&mut self, sweep: &Sweep, pace: &Pace) {
        self.steps += sweep.steps as u64;
        self.shortest_s = if self.shortest_s == 0.0 { sweep.dt_s } else { self.shortest_s.min(sweep.dt_s) };
        self.time_s += sweep.steps as f64 * f64::from(pace.dt_s);
    }
}

/// The bands of a run, and the buffers for exchanging their halos.
pub(super) struct Run {
    pub bands: Vec<Band>,
    spread: Spread,
    halos: Vec<f32>,
    /// Greatest depth of water before the last sweep.
    deepest_m: f32,
}

impl Run {
    /// Creates dry land with `loose` metres of loose ground on it.
    pub fn new(scene: &Scene<'_>, loose: Lane<'_>) -> Self {
        let [nx, ny] = scene.cells;
        let count = rayon::current_num_threads().min(ny / LEAST_ROWS).max(1);
        let start = |k: usize| ny * k / count;
        let bands = par::collect_all(0..count, |_, k| Band::new(scene, start(k)..start(k + 1), loose));
        let halos = vec![0.0; count * 2 * HALO * STATES.len() * (nx + 1)];
        Self { bands, spread: Spread::new(scene), halos, deepest_m: 0.0 }
    }

    /// Fills every cell with water of the given depth, in metres.
    pub fn fill(&mut self, depths: &[f32]) {
        for band in &mut self.bands {
            let (nx, rows) = (band.nx, band.world_rows());
            for y in rows.clone() {
                let depths = &depths[y * nx..][..nx];
                band.row_mut(State::Water, (y - rows.start) as isize)[..nx].copy_from_slice(depths);
                band.deepest_m = depths.iter().fold(band.deepest_m, |most, depth| most.max(*depth));
            }
        }
    }

    /// The band that holds a row of the world, and the row's number in it.
    fn find(&self, row: usize) -> (usize, isize) {
        let k = self.bands.partition_point(|band| band.world_rows().end <= row);
        (k, row as isize - self.bands[k].world_rows().start as isize)
    }

    /// A row of a state.
    pub fn row(&self, state: State, row: usize) -> &[f32] {
        let (k, y) = self.find(row);
        self.bands[k].row(state, y)
    }

    /// The time integral of discharge in a row, m².
    pub fn flow(&self, row: usize) -> &[f32] {
        let (k, y) = self.find(row);
        self.bands[k].flow(y as usize)
    }

    /// Computes the velocity of the water of a row in m/s, east (`axis` 0) or south (1): the mean discharge of
    /// opposite faces over the depth, 0 where there is only a film.
    pub fn velocity(&self, physics: &Physics, row: usize, axis: usize, out: &mut [f32]) {
        let (k, y) = self.find(row);
        let band = &self.bands[k];
        let pace = physics.pace(1.0);
        let (west, north, depth) = (band.row(State::West, y), band.row(State::North, y), band.row(State::Water, y));
        let south = band.row(State::North, y + 1);
        for (i, out) in out.iter_mut().enumerate() {
            let discharge = 0.5 * if axis == 0 { west[i] + west[i + 1] } else { north[i] + south[i] };
            let speed = discharge / depth[i].max(1e-6);
            *out = speed * film(depth[i], &pace);
        }
    }

    /// Updates the bands' copies of their neighbours' rows: first all are read, then all are written.
    fn exchange(&mut self, scene: &Scene<'_>) {
        let width = scene.cells[0] + 1;
        let mut halos = std::mem::take(&mut self.halos);
        let mut slots = halos.chunks_exact_mut(width);
        for band in &self.bands {
            for (_, row) in halo(band, scene) {
                for (state, slot) in STATES.into_iter().zip(&mut slots) {
                    slot.copy_from_slice(self.row(state, row));
                }
            }
        }
        let mut slots = halos.chunks_exact(width);
        for band in &mut self.bands {
            for (y, _) in halo(band, scene) {
                for (state, slot) in STATES.into_iter().zip(&mut slots) {
                    band.row_mut(state, y).copy_from_slice(slot);
                }
            }
        }
        self.halos = halos;
    }

    /// Returns the depth that limits the steps of a sweep: the greatest so far, plus its growth in the last sweep.
    fn deepest_m(&mut self) -> f32 {
        let deepest_m = self.bands.iter().fold(0.0_f32, |most, band| most.max(band.deepest_m));
        let grown_m = (deepest_m - self.deepest_m).max(0.0);
        self.deepest_m = deepest_m;
        deepest_m + grown_m
    }

    /// Advances by a sweep; returns the time left after it.
    pub fn sweep(
        &mut self,
        scene: &Scene<'_>,
        left_s: f64,
        pacing: &mut Pacing,
        job: &Job<'_>,
    ) -> Result<f64, NodeError> {
        let sweep = scene.physics.sweep(self.deepest_m(), left_s, STEPS_PER_SWEEP);
        let pace = scene.physics.pace(sweep.dt_s);
        self.exchange(scene);
        par::each(&mut self.bands, |_, band| band.sweep(scene, &pace, sweep.steps, job))?;
        self.exchange(scene);
        self.spread.run(&mut self.bands, scene, job)?;
        par::each(&mut self.bands, |_, band| band.slip(scene, job))?;
        pacing.add(&sweep, &pace);
        Ok(sweep.left_s)
    }
}

/// Rows of a band's halo that exist, with their numbers in the world.
fn halo(band: &Band, scene: &Scene<'_>) -> impl Iterator<Item = (isize, usize)> + use<> {
    let rows = band.world_rows();
    let (first, end, ny) = (rows.start as isize, rows.end as isize, scene.cells[1] as isize);
    let joined = scene.joined()[1];
    (first - HALO as isize..first)
        .chain(end..end + HALO as isize)
        .filter(move |row| joined || (0..ny).contains(row))
        .map(move |row| (row - first, row.rem_euclid(ny) as usize))
}
