//! What is computed whole and what in bands, and in which order.

use std::collections::HashSet;

use crate::{
    eval::{
        needs::Needs,
        plan::{Plan, Source, Step},
    },
    world::Window,
};

/// A part of a build: some results, computed together.
pub(in crate::eval) struct Stage {
    /// Steps and outputs that are available afterwards, or have been delivered in bands.
    pub(in crate::eval) results: Vec<(usize, usize)>,
    /// Whole results of earlier stages that it reads.
    pub(in crate::eval) reads: Vec<(usize, usize)>,
    /// Steps that it computes.
    pub(in crate::eval) steps: Vec<usize>,
    /// Rows of a band; `None` for a stage that is computed whole.
    pub(in crate::eval) band_rows: Option<u32>,
    /// Per result, the request whose bands are delivered instead of being assembled.
    pub(in crate::eval) streamed: Vec<Option<usize>>,
    /// The window of the results that is built.
    pub(in crate::eval) window: Window,
    /// Memory for computing it besides what it reads and the results that it assembles.
    pub(in crate::eval) bytes: u64,
}

/// The stages of a build, in order.
pub(in crate::eval) struct Stages {
    pub(in crate::eval) all: Vec<Stage>,
}

/// Largest number of cells that halos may add, as a fraction of the cells without them.
const HALO: f64 = 0.125;

impl Stages {
    pub(super) fn new(plan: &Plan<'_>, needs: &Needs, window: &Window, streamed: &[bool], band_cells: u32) -> Self {
        let mut build = Build { plan, needs, window: *window, band_cells, whole: HashSet::new(), all: Vec::new() };
        for (at, step) in plan.steps.iter().enumerate() {
            if needs.computes(at) && is_whole(step) {
                let computed = |(source, _): &(usize, usize)| needs.computes(*source);
                let inputs = step.own_wires().filter(computed).collect();
                build.band_stage(inputs, None, Window::whole(step.window.world));
                build.whole_stage(at);
            }
        }
        let requests = plan.targets.iter().enumerate();
        let mut last: Vec<((usize, usize), usize)> = Vec::new();
        for (request, target) in requests.filter_map(|(request, target)| Some((request, target.as_ref().ok()?))) {
            let result = (target.step, target.output);
            if !build.whole.contains(&result) && needs.computes(target.step) {
                last.push((result, request));
            }
        }
        let results: Vec<(usize, usize)> = last.iter().map(|(result, _)| *result).collect();
        // Two requests of one output share the whole raster.
        let alone = |result: &(usize, usize)| results.iter().filter(|other| *other == result).count() == 1;
        let requests = last.iter().map(|(result, request)| Some(*request).filter(|at| streamed[*at] && alone(result)));
        let requests: Vec<Option<usize>> = requests.collect();
        build.band_stage(results, Some(requests), *window);
        build.found();
        Self { all: build.all }
    }
}

struct Build<'a> {
    plan: &'a Plan<'a>,
    needs: &'a Needs,
    window: Window,
    /// Approximate number of cells of a band.
    band_cells: u32,
    /// Results that are available as a whole after the stages so far.
    whole: HashSet<(usize, usize)>,
    all: Vec<Stage>,
}

impl Build<'_> {
    fn whole_stage(&mut self, at: usize) {
        let step = &self.plan.steps[at];
        let wanted = self.needs.wanted[at];
        let results: Vec<_> = (0..step.outputs()).filter(|output| wanted.contains(*output)).map(|o| (at, o)).collect();
        self.whole.extend(&results);
        let streamed = vec![None; results.len()];
        let reads = step.wires(wanted).collect();
        let bytes = step.kernel_bytes(wanted, &self.plan.steps);
        let given: u64 = results.iter().map(|(_, output)| step.output_bytes(*output, &step.window)).sum();
        let bytes = bytes.saturating_sub(given);
        let (window, steps) = (step.wanted, vec![at]);
        self.all.push(Stage { results, reads, steps, band_rows: None, streamed, window, bytes });
    }

    fn band_stage(&mut self, results: Vec<(usize, usize)>, streamed: Option<Vec<Option<usize>>>, window: Window) {
        let streamed = streamed.unwrap_or_else(|| vec![None; results.len()]);
        let mut seen = HashSet::new();
        let mut all = results.into_iter().zip(streamed).collect::<Vec<_>>();
        all.retain(|(result, _)| !self.whole.contains(result) && seen.insert(*result));
        let (results, streamed): (Vec<_>, Vec<_>) = all.into_iter().unzip();
        if results.is_empty() {
            return;
        }
        let (mut steps, mut reads) = (Vec::new(), Vec::new());
        let mut stack: Vec<(usize, usize)> = results.clone();
        let mut visited = HashSet::new();
        while let Some(result) = stack.pop() {
            if self.whole.contains(&result) {
                reads.push(result);
            } else if self.needs.computes(result.0) && visited.insert(result.0) {
                steps.push(result.0);
                stack.extend(self.plan.steps[result.0].own_wires());
            }
        }
        steps.sort_unstable();
        reads.sort_unstable();
        reads.dedup();
        let (rows, bytes) = self.band_rows(&steps, &results, &window);
        self.whole.extend(results.iter().zip(&streamed).filter(|(_, streamed)| streamed.is_none()).map(|(r, _)| *r));
        self.all.push(Stage { results, reads, steps, band_rows: Some(rows), streamed, window, bytes });
    }

    /// Adds a stage that computes nothing, for requests that the store can answer.
    fn found(&mut self) {
        let stored = self.plan.targets.iter().filter_map(|target| target.as_ref().ok());
        let stored = stored.map(|target| (target.step, target.output)).filter(|(step, _)| !self.needs.computes(*step));
        let mut results: Vec<(usize, usize)> = stored.collect();
        results.sort_unstable();
        results.dedup();
        for result in results {
            let (window, streamed) = (self.window, vec![None]);
            let all = vec![result];
            let stage =
                Stage { results: all, reads: vec![], steps: vec![], band_rows: None, streamed, window, bytes: 0 };
            self.all.push(stage);
        }
    }

    /// Rows of a band, as few as halos allow, and the memory of a band in the middle.
    fn band_rows(&self, steps: &[usize], results: &[(usize, usize)], window: &Window) -> (u32, u64) {
        let mut rows = (self.band_cells / window.cells[0].max(1)).clamp(1, window.cells[1]);
        loop {
            let middle = window.origin[1] + (window.cells[1] - rows) / 2;
            let band = Window { origin: [window.origin[0], middle], cells: [window.cells[0], rows], ..*window };
            let (cells, bytes) = self.band_cost(steps, results, &band);
            let most = steps.len() as f64 * band.len() as f64 * (1.0 + HALO);
            if rows >= window.cells[1] || cells <= most {
                return (rows, bytes);
            }
            rows = (rows * 2).min(window.cells[1]);
        }
    }

    /// Cells that kernels compute for a band, and the peak memory.
    fn band_cost(&self, steps: &[usize], results: &[(usize, usize)], band: &Window) -> (f64, u64) {
        let mut wanted: Vec<Option<Window>> = vec![None; self.plan.steps.len()];
        for (step, _) in results {
            wanted[*step] = Some(*band);
        }
        let (mut cells, mut bytes) = (0.0, 0);
        for at in steps.iter().rev() {
            let step = &self.plan.steps[*at];
            let Some(here) = wanted[*at] else { continue };
            let window = crate::eval::plan::reached(step.instance.node.reach, &step.instance.params, &here);
            cells += window.len() as f64;
            let cuts = step.own_wires().map(|(source, output)| self.plan.steps[source].output_bytes(output, &window));
            bytes += step.own_bytes(self.needs.wanted[*at], &window) + cuts.sum::<u64>();
            for source in &step.inputs {
                if let Source::Wire { step, .. } = source {
                    let slot = &mut wanted[*step];
                    *slot = Some(slot.map_or(window, |other| other.union(&window)));
                }
            }
        }
        (cells, bytes)
    }
}

/// Returns true if a step is computed for the whole world, or its results cannot be split into rows.
fn is_whole(step: &Step<'_>) -> bool {
    let instance = step.instance;
    instance.node.reach.is_world(&instance.params, step.wanted.cell_m())
        || step.types.iter().any(|ty| ty.planes().is_none())
}
