//! Computing a stage in bands.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
    time::Duration,
};

use petgraph::stable_graph::NodeIndex;

use super::{Course, Stage};
use crate::{
    eval::{
        Delivered, Evaluation, Request,
        error::EvalError,
        event::{Event, Origin, lock},
        plan::Level,
        work::Pinned,
    },
    field::Field,
    memory,
    value::Value,
    world::Window,
};

impl Course<'_> {
    /// Computes the results of a stage in bands; returns those that are assembled into whole rasters.
    pub(super) fn pass_bands(
        &self,
        stage: &Stage,
        rows: u32,
        pinned: &Pinned,
        answered: &mut [bool],
    ) -> Result<Vec<Option<Value>>, EvalError> {
        let bands = bands(&stage.window, rows);
        let level = Level { world: stage.window.world, is_state: false };
        let events = |event: Event| (self.events)(Some(&level), event);
        let teller = BandReporter::new(&events);
        let mut whole: Vec<Whole> = Vec::new();
        for (at, band) in bands.iter().enumerate() {
            let requests: Vec<Request> = stage.results.iter().map(|result| self.request(*result, *band)).collect();
            let evaluation = Evaluation { requests: &requests, byproducts: &[], ..*self.evaluation };
            let tell = |_: Option<&Level>, event: Event| teller.hear(event);
            let values = self.values(evaluation, pinned, bands.len() == 1, &tell)?;
            teller.advance((at + 1) as f32 / bands.len() as f32);
            for (position, value) in values.into_iter().enumerate() {
                let (step, request) = (stage.results[position].0, stage.streamed[position]);
                match request.and_then(|request| Some((request, self.plan.targets[request].as_ref().ok()?))) {
                    Some((request, target)) => {
                        // an error in a later band is its answer
                        answered[request] = at + 1 == bands.len();
                        (self.deliver)(request, Ok(Delivered { value, key: self.key(target) }));
                    }
                    None => {
                        let refuse = |refused| {
                            let instance = self.plan.steps[step].instance;
                            EvalError::OutOfMemory { node: instance.name.clone(), id: instance.node.id, refused }
                        };
                        Whole::add(&mut whole, position, &stage.window, value).map_err(refuse)?;
                    }
                }
            }
        }
        teller.end();
        let mut results = vec![None; stage.results.len()];
        for Whole { position, planes, samples, window } in whole {
            results[position] = Some(Field::with_planes(window, planes, samples).into());
        }
        Ok(results)
    }
}

/// Bands of a window, from north to south.
fn bands(window: &Window, rows: u32) -> Vec<Window> {
    let ends = (0..window.cells[1]).step_by(rows as usize);
    let band = |first: u32| Window {
        origin: [window.origin[0], window.origin[1] + first],
        cells: [window.cells[0], rows.min(window.cells[1] - first)],
        ..*window
    };
    ends.map(band).collect()
}

/// A result assembled from bands.
struct Whole {
    position: usize,
    planes: usize,
    samples: Vec<f32>,
    window: Window,
}

impl Whole {
    fn add(all: &mut Vec<Self>, position: usize, window: &Window, value: Value) -> Result<(), memory::OutOfMemory> {
        let Value::Field(band) = value else { return Ok(()) };
        if band.window() == window {
            let planes = band.planes();
            all.push(Self { position, planes, samples: band.into_samples(), window: *window });
            return Ok(());
        }
        let at = match all.iter().position(|whole| whole.position == position) {
            Some(at) => at,
            None => {
                let samples = memory::zeroed(band.planes() * window.len())?;
                all.push(Self { position, planes: band.planes(), samples, window: *window });
                all.len() - 1
            }
        };
        let first = (band.window().origin[1] - window.origin[1]) as usize * window.nx();
        for plane in 0..band.planes() {
            let from = band.plane(plane);
            all[at].samples[plane * window.len() + first..][..from.len()].copy_from_slice(from);
        }
        Ok(())
    }
}

/// Reports nodes that run once per band as if each ran once.
struct BandReporter<'a> {
    events: &'a (dyn Fn(Event) + Sync),
    told: Mutex<BTreeMap<NodeIndex, Node>>,
}

struct Node {
    name: Arc<str>,
    cells: [u32; 2],
    time: Duration,
    bytes: usize,
    origin: Option<Origin>,
    backend: &'static str,
}

impl<'a> BandReporter<'a> {
    fn new(events: &'a (dyn Fn(Event) + Sync)) -> Self {
        Self { events, told: Mutex::default() }
    }

    fn hear(&self, event: Event) {
        let passed = {
            let mut told = lock(&self.told);
            match event {
                Event::NodeStarted { node, name } => {
                    let blank = |name: Arc<str>| Node {
                        name,
                        cells: [0; 2],
                        time: Duration::ZERO,
                        bytes: 0,
                        origin: None,
                        backend: "",
                    };
                    let is_new = !told.contains_key(&node);
                    told.entry(node).or_insert_with(|| blank(name.clone()));
                    is_new.then_some(Event::NodeStarted { node, name })
                }
                Event::NodeFinished { node, cells, time, bytes, origin, backend, .. } => {
                    // Pinned and stored results are read for every band.
                    if let Some(known) = told.get_mut(&node).filter(|_| origin == Origin::Computed) {
                        known.time += time;
                        known.bytes += bytes;
                        (known.cells, known.origin, known.backend) = (cells, Some(origin), backend);
                    }
                    None
                }
                warning @ Event::Warning { .. } => Some(warning),
                Event::Planned { .. } | Event::NodeProgress { .. } | Event::NodeGlimpse { .. } => None,
            }
        };
        passed.into_iter().for_each(self.events);
    }

    fn advance(&self, fraction: f32) {
        let nodes: Vec<(NodeIndex, Arc<str>)> =
            lock(&self.told).iter().map(|(node, known)| (*node, known.name.clone())).collect();
        for (node, name) in nodes {
            (self.events)(Event::NodeProgress { node, name, fraction });
        }
    }

    fn end(self) {
        let told = self.told.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        for (node, Node { name, cells, time, bytes, origin, backend }) in told {
            if let Some(origin) = origin {
                (self.events)(Event::NodeFinished { node, name, cells, time, bytes, origin, backend });
            }
        }
    }
}
