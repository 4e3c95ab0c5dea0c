//! Building in stages, for worlds whose rasters fill the memory: nodes that need the whole world compute it whole, and
//! everything between runs in bands of rows, so that only what is read as a whole is in memory as a whole.
//!
//! A result is *whole* when its node reaches across the world, when such a node reads it, or when it is requested as a
//! whole. All others exist for one band at a time: a band of the requested rows is followed up the wires, with the
//! halos of the nodes' reaches, to whole results. Nodes give the same bytes in a band as in the world (tests of their
//! reach verify it), so the bands equal rows of the whole.

mod bands;
mod plan;

pub(super) use self::plan::{Stage, Stages};
use super::{
    Delivered, Delivery, Evaluation, Evaluator, Request,
    error::EvalError,
    event::Event,
    levels::LevelEvents,
    memory,
    needs::Needs,
    plan::{Level, Plan, Target},
    work::{Listener, Pinned, Work},
};
use crate::{job::Cancel, memory::OutOfMemory, value::Value, world::Window};

/// Approximate number of cells of a band; with fewer, starting a kernel becomes noticeable, more need more memory.
const BAND_CELLS: u32 = 1 << 20;
/// Smallest size of a plane, in bytes, at which stages are worth their overhead.
const LARGE: u64 = 16 << 20;

impl Evaluator {
    /// As [`Self::deliver`], with as little memory as the graph allows: a request for which `streamed` is true may be
    /// answered by several values, bands of its rows from north to south. Kernels run one after the other. Requests on
    /// different windows are answered as by `deliver`.
    pub fn deliver_in_bands(
        &self,
        evaluation: &Evaluation<'_>,
        streamed: &[bool],
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
        deliver: &(dyn Fn(usize, Delivery) + Sync),
    ) {
        let Some(window) = common_window(evaluation.requests).filter(|window| plane_bytes(window) >= LARGE) else {
            return self.deliver(evaluation, cancel, events, deliver);
        };
        self.build_in_stages(evaluation, &window, streamed, BAND_CELLS, cancel, events, deliver);
    }

    #[expect(clippy::too_many_arguments, reason = "what a build consists of")]
    pub(super) fn build_in_stages(
        &self,
        evaluation: &Evaluation<'_>,
        window: &Window,
        streamed: &[bool],
        band_cells: u32,
        cancel: &Cancel,
        events: &(dyn Fn(Event) + Sync),
        deliver: &(dyn Fn(usize, Delivery) + Sync),
    ) {
        let mut plan = Plan::new(evaluation.graph, evaluation.requests, &[]);
        if !self.store.keeps() {
            plan.drop_kept_states();
        }
        let origins = self.origins(&mut plan, evaluation.folder, cancel);
        let sound = |target: &Target| plan.steps[target.step].fault.is_none();
        if !plan.targets.iter().all(|target| target.as_ref().is_ok_and(sound)) {
            // Requests with a fault are answered there.
            return self.deliver(evaluation, cancel, events, deliver);
        }
        let planned = |plan: &Plan<'_>| {
            let needs = Needs::new(&self.store, &Pinned::default(), plan, &origins);
            let stages = Stages::new(plan, &needs, window, streamed, band_cells);
            let fits = memory::check_stages(plan, &stages, self.memory_limit);
            (needs, stages, fits)
        };
        let (mut needs, mut stages, mut fits) = planned(&plan);
        if fits.is_err() && plan.drop_kept_states() {
            (needs, stages, fits) = planned(&plan);
        }
        if let Err(error) = fits {
            for request in 0..evaluation.requests.len() {
                deliver(request, Err(error.clone()));
            }
            return;
        }
        events(LevelEvents::planned(&plan, &needs));
        let merged = LevelEvents::new(&plan, &needs, events);
        let events = |level: Option<&Level>, event: Event| {
            // each stage plans a part of what has been announced
            if !matches!(event, Event::Planned { .. }) {
                merged.hear(level, event);
            }
        };
        drop(needs);

        let course =
            Course { evaluator: self, evaluation, plan: &plan, origins: &origins, cancel, events: &events, deliver };
        let mut pinned = Pinned::default();
        let mut answered = vec![false; evaluation.requests.len()];
        for (at, stage) in stages.all.iter().enumerate() {
            if let Err(error) = course.pass(stage, &mut pinned, &mut answered) {
                for request in (0..answered.len()).filter(|request| !answered[*request]) {
                    deliver(request, Err(error.clone()));
                }
                return;
            }
            // Release what no later stage reads.
            pinned.retain(|slot, _| {
                stages.all[at + 1..].iter().any(|later| later.reads.iter().any(|read| course.slot(*read) == *slot))
            });
        }
    }
}

/// A build running through its stages.
struct Course<'a> {
    evaluator: &'a Evaluator,
    evaluation: &'a Evaluation<'a>,
    plan: &'a Plan<'a>,
    origins: &'a [Option<super::key::Origins>],
    cancel: &'a Cancel,
    /// With the level of the step.
    events: &'a (dyn Fn(Option<&Level>, Event) + Sync),
    deliver: &'a (dyn Fn(usize, Delivery) + Sync),
}

impl Course<'_> {
    fn slot(&self, (step, output): (usize, usize)) -> super::store::Slot {
        (self.origins[step].as_ref().expect("a step without a fault has a key").key, output)
    }

    fn request(&self, (step, output): (usize, usize), window: Window) -> Request {
        Request { port: crate::graph::Port { node: self.plan.steps[step].index, output }, window }
    }

    /// Computes the results of a stage; pins those that later stages read, and answers requests.
    fn pass(&self, stage: &Stage, pinned: &mut Pinned, answered: &mut [bool]) -> Result<(), EvalError> {
        let values = match stage.band_rows {
            Some(rows) => self.pass_bands(stage, rows, pinned, answered)?,
            None => {
                let requests: Vec<Request> = stage
                    .results
                    .iter()
                    .map(|result| self.request(*result, self.plan.steps[result.0].wanted))
                    .collect();
                let evaluation = Evaluation { requests: &requests, byproducts: &[], ..*self.evaluation };
                self.values(evaluation, pinned, true, self.events)?.into_iter().map(Some).collect()
            }
        };
        for (result, value) in stage.results.iter().zip(values) {
            let Some(value) = value else { continue };
            for (request, target) in self.plan.targets.iter().enumerate() {
                let Ok(target) = target else { continue };
                if (target.step, target.output) == *result && !answered[request] {
                    answered[request] = true;
                    let value = cut(&value, &target.window, &self.plan.steps[target.step].name)?;
                    (self.deliver)(request, Ok(Delivered { value, key: self.key(target) }));
                }
            }
            pinned.insert(self.slot(*result), value);
        }
        Ok(())
    }

    fn key(&self, target: &Target) -> super::Key {
        self.slot((target.step, target.output)).0.output(target.output, &target.window)
    }

    /// The values of requests, or the first error.
    fn values(
        &self,
        evaluation: Evaluation<'_>,
        pinned: &Pinned,
        keeps: bool,
        events: &(dyn Fn(Option<&Level>, Event) + Sync),
    ) -> Result<Vec<Value>, EvalError> {
        let answers = std::sync::Mutex::new(vec![Err(EvalError::Cancelled); evaluation.requests.len()]);
        let deliver = |request: usize, delivery: Delivery| {
            super::event::lock(&answers)[request] = delivery.map(|delivered| delivered.value);
        };
        let listener = Listener::Part(events);
        Work { evaluation, pinned, keeps, cancel: self.cancel, listener, deliver: &deliver }.carry_out(self.evaluator);
        answers.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner).into_iter().collect()
    }
}

fn cut(value: &Value, window: &Window, node: &str) -> Result<Value, EvalError> {
    let too_large =
        |refused: OutOfMemory| EvalError::TooLarge { node: node.to_owned(), needs: refused.bytes, available: None };
    match value {
        Value::Field(field) => field.try_crop(window).map(Value::Field).map_err(too_large),
        Value::Strata(strata) => strata.try_crop(window).map(Value::from).map_err(too_large),
        Value::Lines(_) | Value::Report(_) | Value::State(_) => Ok(value.clone()),
    }
}

/// The common window of all requests. Returns None when they differ.
fn common_window(requests: &[Request]) -> Option<Window> {
    let first = requests.first()?.window;
    requests
        .iter()
        .all(|request| request.window == first)
        .then_some(first)
        .filter(|window| window.world.check().is_ok())
}

fn plane_bytes(window: &Window) -> u64 {
    u64::from(window.cells[0]) * u64::from(window.cells[1]) * size_of::<f32>() as u64
}
