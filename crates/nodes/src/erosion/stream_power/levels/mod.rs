//! Levels fixed in metres, so that a graph is the same terrain on any cells.
//!
//! The network of rivers that forms depends on the cells on which the time passes. So it passes on levels whose cells
//! follow from the world and the parameters, each half as large as those before. The coarsest passes all of the time T.
//! The next begins at T − s₁ with the land that the coarsest had then, the one after it at T − s₂ with that of the
//! second, and so on; each has less time, sₗ = 0.15 τ / 2^(l−1) with τ the time in which the land answers a change. So
//! every level ends at T, the finest with the cells that are asked for; it keeps the rivers of the coarser ones, and
//! adds what its own cells can resolve. How many levels follow changes none of those before.
//!
//! A level that would begin before τ is known, in the first half of the time, begins at the start instead.
//!
//! The coarsest level has passed all of its time on its cells and no coarser level has ended on them, so that its land
//! is further from that of the others than they are from each other. Results on its cells are means of the next level
//! instead, which goes on from its state.
//!
//! The analytical method passes the time of the coarsest level at once, and so the two parts of a finer level's time:
//! until the next level takes over, and until T.
//!
//! A level that begins at the start takes more steps, as its land is far from balance, and single grids take a hundred.
//!
//! A job is one level: the evaluator has the level below run first, with inputs that are made for its own cells, and
//! stores its [`Checkpoint`].

mod alone;
mod checkpoint;
mod ladder;
mod places;
mod resample;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use orograph_graph::{Below, Coarser, Glimpses, Levels, State, Window};

use self::ladder::Rung;
pub use self::{
    checkpoint::Checkpoint,
    ladder::Ladder,
    places::{Around, Frame, Places},
};
use super::{
    Inputs, Method, Params, Schedule, Wants, analytical, count_steps,
    inland::Inland,
    land::{Asked, Footing, Land, Work},
    results, warn_of_short_runs, warn_of_unresolved_hillslopes,
};
use crate::prelude::*;

/// The time of the second level, as a share of the response time.
const SHARE: f64 = 0.15;
/// What each further level has of the time of the one before.
const NEXT: f64 = 0.5;
/// Steps of a level.
const STEPS: f64 = 6.0;
/// How long the analytical method takes leaps on the coarsest level, in which soil creeps, in times of the next level.
const LEAPS: f64 = 2.0;
/// Steps of a level that begins at the start.
const STEPS_OF_ALL: f64 = 24.0;

/// The levels as they are declared.
pub const LEVELS: Levels = Levels {
    below: |params, world| {
        let params = Params::read(params);
        has_levels(&params).then(|| Ladder::new(Window::whole(*world), &params).below())
    },
    state: |sizing| super::memory::state(sizing),
    work: |params, world| {
        let (params, cells) = (Params::read(params), Window::whole(*world).len() as f64);
        let is_coarsest = Ladder::new(Window::whole(*world), &params).is_coarsest();
        cells * if is_coarsest { f64::from(count_steps(&params).0) } else { STEPS }
    },
};

/// Whether the time passes on levels.
#[must_use]
pub fn has_levels(params: &Params) -> bool {
    params.schedule == Schedule::CoarseToFine
}

/// When the levels begin and how long their steps are.
#[derive(Clone, Copy, Debug)]
struct Timetable {
    duration_yr: f64,
    /// True if time passes at once, without steps.
    at_once: bool,
    /// A step of the coarsest level.
    step_yr: f64,
    /// The longest step of the others that the file allows.
    longest_yr: f64,
    /// When the response time is measured.
    half_yr: f64,
    /// The response time; 0 until it is known.
    response_yr: f64,
}

impl Timetable {
    fn new(params: &Params) -> Self {
        let (count, step_yr) = count_steps(params);
        let at_once = params.method == Method::Analytical;
        let longest_yr = if params.time_step > 0.0 { step_yr } else { f64::INFINITY };
        let half_yr = f64::from(count.div_ceil(2)) * step_yr;
        Self { duration_yr: params.duration, at_once, step_yr, longest_yr, half_yr, response_yr: 0.0 }
    }

    /// sₗ of a level above the coarsest, before it is compared with the duration.
    fn span_yr(&self, level: u32) -> f64 {
        (1..level).fold(SHARE * self.response_yr, |span_yr, _| span_yr * NEXT)
    }

    /// Returns true if a level begins at the start of the run.
    fn is_whole(&self, level: u32) -> bool {
        level == 0 || self.span_yr(level) > self.duration_yr - self.half_yr
    }

    /// The time at which the level after `level` takes over, where it does.
    fn handover_yr(&self, level: u32) -> Option<f64> {
        (!self.is_whole(level + 1)).then(|| self.duration_yr - self.span_yr(level + 1))
    }

    /// The time at which a level begins.
    fn begin_yr(&self, level: u32) -> f64 {
        if self.is_whole(level) { 0.0 } else { self.duration_yr - self.span_yr(level) }
    }

    /// The time from which the coarsest level takes leaps until the next one takes over, at most half of its time.
    fn leaps_begin_yr(&self, until_yr: f64) -> f64 {
        (until_yr - LEAPS * (self.duration_yr - until_yr)).max(until_yr / 2.0)
    }

    /// The longest step of a level.
    fn longest_yr(&self, level: u32) -> f64 {
        if level == 0 {
            return self.step_yr;
        }
        if self.is_whole(level) {
            return (self.duration_yr / STEPS_OF_ALL).min(self.longest_yr).max(self.step_yr);
        }
        if self.at_once { f64::INFINITY } else { (self.span_yr(level) / STEPS).min(self.longest_yr) }
    }
}

/// A level at work.
struct Run<'a, 'b> {
    job: &'a Job<'b>,
    land: Land<'a>,
    step: u32,
    /// True if steps are leaps.
    at_once: bool,
    /// The length of the last step and what it did.
    last: (f64, Work),
}

impl Run<'_, '_> {
    /// Passes time in equal steps. `progress` receives the time.
    fn pass(
        &mut self,
        until_yr: f64,
        longest_yr: f64,
        asked: Asked,
        progress: &dyn Fn(f64) -> Result<(), NodeError>,
    ) -> Result<(), NodeError> {
        let span_yr = until_yr - self.land.time_yr();
        if span_yr <= 1e-9 * until_yr {
            return Ok(());
        }
        let count = (span_yr / longest_yr - 1e-6).ceil().clamp(1.0, super::MAX_STEPS) as u32;
        let step_yr = span_yr / f64::from(count);
        for step in 0..count {
            progress(self.land.time_yr())?;
            if self.at_once {
                self.land.leap(self.job, step_yr, self.step)?;
            } else {
                let asked = if step + 1 == count { asked } else { Asked::default() };
                self.last = (step_yr, self.land.step(self.job, step_yr, self.step, asked)?);
            }
            self.step += 1;
            self.job.glimpse(|| super::glimpse(self.job, &self.land));
        }
        Ok(())
    }
}

/// Passes the time of a level. The state of the level below is the job's, or made here from resampled inputs.
///
/// # Errors
/// When an input is refused, or [`NodeError::Cancelled`].
pub fn run(job: &Job<'_>, params: &Params) -> Result<Outputs, NodeError> {
    let ladder = Ladder::new(job.window(), params);
    let wants_outputs = Wants::of(job).count() > 0;
    let below = match (ladder.below(), &job.level.below) {
        (Below::Results(world), _) if wants_outputs => return alone::means(job, params, world),
        (Below::Results(_), _) => None,
        (Below::State(_), Coarser::State(state)) => Some(Arc::clone(state)),
        (Below::State(world), _) => Some(Arc::new(alone::state(job, params, world)?)),
    };
    if wants_outputs {
        warn_of_unresolved_hillslopes(job, params);
    }
    pass(job, params, &ladder, below.as_deref(), wants_outputs)
}

/// The cells of a level with the margin of `inland` sides.
fn frame(rung: &Rung) -> (Option<Inland>, Frame) {
    let inland = Inland::with_margin(rung.inner, rung.margin);
    let frame = inland.map_or(Frame { inner: rung.inner, outer: rung.inner, before: [0; 2] }, |inland| inland.frame());
    (inland, frame)
}

fn pass(
    job: &Job<'_>,
    params: &Params,
    ladder: &Ladder,
    below: Option<&State>,
    wants_outputs: bool,
) -> Result<Outputs, NodeError> {
    let level = ladder.finest();
    let rung = ladder.rung(level);
    let (inland, frame_here) = frame(&rung);
    let below = below.map(|state| Checkpoint::read(state, frame(&ladder.rung(level - 1)).1)).transpose()?;
    let mut times = Timetable::new(params);
    times.response_yr = below.as_ref().map_or(0.0, |below| below.response_yr);

    let take = |outputs| {
        if let (Some(glimpses), Some(inland)) = (job.glimpses, inland) {
            (glimpses.take)(inland.cut(outputs));
        }
    };
    let outer =
        inland.map(|inland| inland.job(job, job.glimpses.map(|glimpses| Glimpses { due: glimpses.due, take: &take })));
    let on = outer.as_ref().unwrap_or(job);
    let (start, wants) = (Inputs::read(on)?.height, Wants::of(on));
    let places = below.as_ref().map(|below| Places::new(below.frame, frame_here));
    let gates = below.as_ref().zip(places).map(|(below, places)| places.gates(&below.gates, start.samples()));
    if let Some(gates) = gates.as_ref().filter(|_| !wants_outputs && times.handover_yr(level).is_none()) {
        // the next level begins at the start too
        return Ok(Outputs::default().with_state(Some(Checkpoint::of_start(gates, times.response_yr))));
    }

    let footing = Footing {
        gates,
        level: Some((rung.number, rung.coarsest_m)),
        goes_on: !times.is_whole(level),
        keeps_sediment: job.level.gives_state,
    };
    if times.at_once {
        analytical::check(on, params)?;
    }
    let mut land = Land::new(on, params, start, footing)?;
    if let (Some(below), Some(places)) = (below, places)
        && !times.is_whole(level)
    {
        land.take_over(on, level, start.samples(), &below, &places)?;
        land.make_ribs(on)?;
    }
    let mut run = Run { job: on, land, step: 0, at_once: times.at_once, last: (1.0, Work::default()) };
    let begin_yr = times.begin_yr(level);
    let until_yr = if wants_outputs { None } else { times.handover_yr(level).filter(|_| level > 0) };
    let span_yr = (until_yr.unwrap_or(params.duration) - begin_yr).max(1e-30);
    let progress = |time_yr: f64| job.advance(((time_yr - begin_yr) / span_yr).clamp(0.0, 0.99) as f32);
    let passes_at_once = times.at_once && level == 0;
    if passes_at_once {
        analytical::grow(on, params, &mut run.land)?;
    } else if times.is_whole(level) {
        run.pass(times.half_yr, times.longest_yr(level), Asked::default(), &progress)?;
    }
    if level == 0 {
        if params.duration > 0.0 {
            times.response_yr = run.land.response_yr(on, times.step_yr)?;
        }
    } else if times.is_whole(level) {
        run.land.make_ribs(on)?;
    }
    let handover_yr = times.handover_yr(level);
    if let Some(until_yr) = handover_yr {
        if passes_at_once {
            analytical::go_back(on, &mut run.land, times.leaps_begin_yr(until_yr))?;
        }
        run.pass(until_yr, times.longest_yr(level), Asked::default(), &progress)?;
    }
    let state = job.level.gives_state.then(|| match handover_yr {
        Some(_) => run.land.state(start.samples(), times.response_yr),
        None => Ok(Checkpoint::of_start(run.land.gates(), times.response_yr)),
    });
    let state = state.transpose()?;
    if !wants_outputs {
        return Ok(Outputs::default().with_state(state));
    }
    let asked = Asked { lowered: wants.erosion_rate, flux: wants.sediment_flux };
    run.pass(params.duration, times.longest_yr(level), asked, &progress)?;
    if times.at_once {
        run.last = analytical::wear(on, params, &mut run.land, asked)?;
    }
    warn_of_short_runs(job, params.duration, times.response_yr);
    let (step_yr, work) = run.last;
    let outputs = results(on, params, run.land, start, step_yr, work)?;
    let outputs = match inland {
        Some(inland) => inland.cut(outputs),
        None => outputs,
    };
    Ok(outputs.with_state(state))
}
