//! Levels fixed in metres, so that a graph is the same terrain on any cells.
//!
//! The network of rivers that forms depends on the cells on which the time passes. So it passes on levels whose cells
//! follow from the world and the parameters, each half as large as those before. The coarsest passes all of the time T.
//! The next begins at T − s₁ with the land that the coarsest had then, the one after it at T − s₂ with that of the
//! second, and so on; each has less time, sₗ = 0.15 τ / 2^(l−1) with τ the time in which the land answers a change. So
//! every level ends at T, the finest with the cells that are asked for; it keeps the rivers of the coarser ones, and adds
//! what its own cells can resolve. How many levels follow changes none of those before.
//!
//! A level that would begin before τ is known, in the first half of the time, begins at the start instead.

mod ladder;
mod places;
mod resample;
#[cfg(test)]
mod tests;

use orograph_graph::{Glimpses, InputValue, Value, Warnings, Window, World};

use self::ladder::Rung;
pub use self::{
    ladder::Ladder,
    places::{Frame, Places},
};
use super::{
    Inputs, Method, Params, Schedule, Wants, count_steps,
    inland::Inland,
    land::{Asked, Footing, Land, Work},
    results, warn_of_short_runs,
};
use crate::prelude::*;

/// The time of the second level, as a share of the response time.
const SHARE: f64 = 0.15;
/// What each further level has of the time of the one before.
const NEXT: f64 = 0.5;
/// Steps of a level.
const STEPS: f64 = 6.0;

/// The land of a level at the time at which the next one begins.
pub struct Checkpoint {
    /// Its cells.
    pub frame: Frame,
    /// Heights at the start of the run in metres.
    pub start: Vec<f32>,
    /// Heights in metres.
    pub heights: Vec<f64>,
    /// Sediment, where there is deposition.
    pub loose: Option<Loose>,
    /// Cells of the rim of `inland` sides through which rivers leave, in rising order.
    pub gates: Vec<u32>,
    /// Years that have passed.
    pub time_yr: f64,
}

/// Loose material per cell, in metres.
pub struct Loose {
    /// What joins the rivers at the next step.
    pub debris: Vec<f64>,
    /// What lies on the rock, where it is wanted.
    pub thickness: Option<Vec<f32>>,
}

/// When the levels begin and how long their steps are.
#[derive(Clone, Copy, Debug)]
struct Timetable {
    duration_yr: f64,
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
        let longest_yr = if params.time_step > 0.0 { step_yr } else { f64::INFINITY };
        let half_yr = f64::from(count.div_ceil(2)) * step_yr;
        Self { duration_yr: params.duration, step_yr, longest_yr, half_yr, response_yr: 0.0 }
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

    /// The longest step of a level.
    fn longest_yr(&self, level: u32) -> f64 {
        if level == 0 {
            return self.step_yr;
        }
        let own_yr = (self.span_yr(level) / STEPS).min(self.duration_yr / STEPS).min(self.longest_yr);
        if self.is_whole(level) { own_yr.max(self.step_yr) } else { own_yr }
    }
}

/// A level at work.
struct Run<'a, 'b> {
    job: &'a Job<'b>,
    land: Land<'a>,
    step: u32,
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
            let asked = if step + 1 == count { asked } else { Asked::default() };
            self.last = (step_yr, self.land.step(self.job, step_yr, self.step, asked)?);
            self.step += 1;
            self.job.glimpse(|| super::glimpse(self.job, &self.land));
        }
        Ok(())
    }
}

/// Passes the time of a run on its levels.
///
/// # Errors
/// When an input is refused, or [`NodeError::Cancelled`].
pub fn run(job: &Job<'_>, params: &Params) -> Result<Outputs, NodeError> {
    let ladder = Ladder::new(job.window(), params);
    let mut times = Timetable::new(params);
    let mut below: Option<Checkpoint> = None;
    let mut done = 0.0;
    for level in 0..ladder.finest() {
        if !times.is_whole(level) || times.handover_yr(level).is_some() || level == 0 {
            below = Some(below_finest(job, params, &ladder, level, &mut times, below.as_ref(), done)?);
        }
        done += share_of_work(&ladder, level);
    }
    at_finest(job, params, &ladder, &mut times, below.as_ref(), done)
}

/// About the share of the work that a level takes.
fn share_of_work(ladder: &Ladder, level: u32) -> f64 {
    let work = |level: u32| {
        let steps = if level == 0 {
            100.0
        } else if level == ladder.finest() {
            STEPS
        } else {
            STEPS * NEXT
        };
        steps * ladder.rung(level).inner.len() as f64
    };
    work(level) / (0..=ladder.finest()).map(work).sum::<f64>()
}

/// The cells of a level with the margin of `inland` sides.
fn frame(rung: &Rung) -> (Option<Inland>, Frame) {
    let inland = Inland::with_margin(rung.inner, rung.margin);
    let frame = inland.map_or(Frame { inner: rung.inner, outer: rung.inner, before: [0; 2] }, |inland| inland.frame());
    (inland, frame)
}

fn below_finest(
    job: &Job<'_>,
    params: &Params,
    ladder: &Ladder,
    level: u32,
    times: &mut Timetable,
    below: Option<&Checkpoint>,
    done: f64,
) -> Result<Checkpoint, NodeError> {
    let rung = ladder.rung(level);
    let (inland, frame) = frame(&rung);
    let take = |outputs| offer(job, inland, outputs);
    let inner = on_cells(job, rung.inner, Some(&take));
    let outer = inland.map(|inland| inland.job(&inner, inner.glimpses));
    let on = outer.as_ref().unwrap_or(&inner);
    let start = Inputs::read(on)?.height;
    let mut run = begin(on, params, start, &rung, frame, times, below)?;
    let share = share_of_work(ladder, level);
    let progress = |time_yr: f64| job.advance((done + share * time_yr / params.duration) as f32);
    if level == 0 {
        run.measure(times, &progress)?;
    }
    if let Some(until_yr) = times.handover_yr(level) {
        run.pass(until_yr, times.longest_yr(level), Asked::default(), &progress)?;
    }
    Ok(run.land.checkpoint(frame, start.samples()))
}

fn at_finest(
    job: &Job<'_>,
    params: &Params,
    ladder: &Ladder,
    times: &mut Timetable,
    below: Option<&Checkpoint>,
    done: f64,
) -> Result<Outputs, NodeError> {
    let level = ladder.finest();
    let rung = ladder.rung(level);
    let (inland, frame) = frame(&rung);
    let take = |outputs| offer(job, inland, outputs);
    let inner = on_cells(job, rung.inner, Some(&take));
    let outer = inland.map(|inland| inland.job(&inner, inner.glimpses));
    let on = outer.as_ref().unwrap_or(&inner);
    let (start, wants) = (Inputs::read(on)?.height, Wants::of(on));
    let mut run = begin(on, params, start, &rung, frame, times, below)?;
    let progress =
        |time_yr: f64| job.advance((done + (1.0 - done) * time_yr / params.duration.max(1e-30)).min(0.99) as f32);
    if level == 0 {
        run.measure(times, &progress)?;
    }
    if let Some(until_yr) = times.handover_yr(level) {
        run.pass(until_yr, times.longest_yr(level), Asked::default(), &progress)?;
    }
    let asked = Asked { lowered: wants.erosion_rate, flux: wants.sediment_flux };
    run.pass(params.duration, times.longest_yr(level), asked, &progress)?;
    warn_of_short_runs(job, params.duration, times.response_yr);
    let (step_yr, work) = run.last;
    let outputs = results(on, &mut run.land, start, step_yr, work)?;
    Ok(given_back(job, inland, outputs))
}

/// The land of a level when it begins.
fn begin<'a, 'b>(
    job: &'a Job<'b>,
    params: &Params,
    start: &Field,
    rung: &Rung,
    frame: Frame,
    times: &Timetable,
    below: Option<&Checkpoint>,
) -> Result<Run<'a, 'b>, NodeError> {
    let places = below.map(|below| Places::new(below.frame, frame));
    let gates = below.zip(places).map(|(below, places)| places.gates(&below.gates, start.samples()));
    let footing = Footing { gates, level: Some((rung.number, rung.coarsest_m)) };
    let mut land = Land::new(job, params, start, footing)?;
    if let (Some(below), Some(places)) = (below, places)
        && !times.is_whole(rung.number)
    {
        land.take_over(job, rung.number, start.samples(), below, &places)?;
    }
    Ok(Run { job, land, step: 0, last: (1.0, Work::default()) })
}

impl Run<'_, '_> {
    /// Passes the first half of the time on the coarsest level, and measures the response time.
    fn measure(
        &mut self,
        times: &mut Timetable,
        progress: &dyn Fn(f64) -> Result<(), NodeError>,
    ) -> Result<(), NodeError> {
        self.pass(times.half_yr, times.step_yr, Asked::default(), progress)?;
        if self.step > 0 {
            times.response_yr = self.land.response_yr(self.job, times.step_yr)?;
        }
        Ok(())
    }
}

/// The world on the cells of the coarsest level, where there are levels.
pub fn coarsest(params: &Params, world: &World) -> Option<World> {
    let has_levels = params.method == Method::Implicit && params.schedule == Schedule::CoarseToFine;
    has_levels.then(|| Ladder::new(Window::whole(*world), params).rung(0).inner.world)
}

/// The same job on the cells of a level; it warns nobody. Inputs are those that were made on these cells, where there are
/// such, and otherwise resampled.
fn on_cells<'a>(job: &'a Job<'_>, window: Window, take: Option<&'a (dyn Fn(Outputs) + Sync)>) -> Job<'a> {
    let made = |at: usize| match job.coarse.get(at) {
        Some(InputValue::Value(Value::Field(field))) if field.window().cells == window.cells => Some(field),
        _ => None,
    };
    let inputs = job.inputs.iter().enumerate().map(|(at, value)| match value {
        InputValue::Value(Value::Field(field)) if field.window().cells != window.cells => {
            let is_height = job.node.inputs[at].name == "height";
            let field = made(at).cloned().unwrap_or_else(|| resample::resampled(field, window, is_height));
            InputValue::Value(Value::Field(field))
        }
        other => other.clone(),
    });
    Job {
        node: job.node,
        params: job.params,
        inputs: inputs.collect(),
        window,
        wanted: job.wanted,
        folder: job.folder.clone(),
        cancel: job.cancel.clone(),
        progress: job.progress,
        coarse: Vec::new(),
        warnings: Warnings::default(),
        glimpses: job.glimpses.zip(take).map(|(glimpses, take)| Glimpses { due: glimpses.due, take }),
    }
}

/// Shows what a level has come to.
fn offer(job: &Job<'_>, inland: Option<Inland>, outputs: Outputs) {
    if let Some(glimpses) = job.glimpses {
        (glimpses.take)(given_back(job, inland, outputs));
    }
}

/// Results of a level on the cells that were asked for. Rivers are as large as the largest in a cell.
fn given_back(job: &Job<'_>, inland: Option<Inland>, outputs: Outputs) -> Outputs {
    let outputs = match inland {
        Some(inland) => inland.cut(outputs),
        None => outputs,
    };
    let asked = job.window();
    outputs.into_iter_named().fold(Outputs::default(), |given, (name, value)| match value {
        Value::Field(field) if field.window().cells != asked.cells => {
            let of_rivers = matches!(name, "area" | "sediment_flux") && field.window().cells[0] > asked.cells[0];
            let field =
                if of_rivers { resample::largest(&field, asked) } else { resample::resampled(&field, asked, false) };
            given.with(name, field)
        }
        other => given.with(name, other),
    })
}
