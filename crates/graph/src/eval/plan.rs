//! What requests need: which nodes, in which order, on which windows.

use std::{
    collections::{HashMap, HashSet},
    path::Path,
    sync::Arc,
};

use petgraph::stable_graph::NodeIndex;

use super::{Request, error::EvalError, key::Origins, store::Form};
use crate::{
    graph::{Graph, Instance},
    job::{NodeError, Wanted},
    node::{Below, Fallback, OutputType, Reach, Sizing},
    param::ParamValues,
    stated::Stated,
    value::PortType,
    world::{Edge, Window, World},
};

/// The largest window on which a run keeps its state for a finer level that nobody has requested yet.
const MOST_KEPT_CELLS: usize = 1 << 22;

/// The nodes that requests need, each after those that it reads. A node is planned once per world; nodes with
/// [levels](crate::Levels), and what they read, also on the worlds of the levels below.
///
/// Steps are in the order in which a recursive evaluation would finish them, which keeps few values alive at a time.
pub(super) struct Plan<'g> {
    pub(super) steps: Vec<Step<'g>>,
    /// Per request, its step and output, or why it cannot be evaluated.
    pub(super) targets: Vec<Result<Target, EvalError>>,
    /// Steps that equal an earlier one, which is read in their place: the earlier one and the other.
    pub(super) twins: Vec<(usize, usize)>,
}

/// A requested value.
#[derive(Clone, Copy)]
pub(super) struct Target {
    pub(super) step: usize,
    pub(super) output: usize,
    pub(super) window: Window,
}

/// The evaluation of one node in one world.
pub(super) struct Step<'g> {
    pub(super) index: NodeIndex,
    pub(super) instance: &'g Instance,
    pub(super) name: Arc<str>,
    pub(super) inputs: Vec<Source>,
    /// What it goes on from. It follows from the inputs and the parameters, so that keys leave it out.
    pub(super) below: Coarser,
    /// The types of its outputs.
    pub(super) types: Vec<PortType>,
    /// True if it has a state for a finer level, which counts as the output after the declared ones.
    pub(super) has_state: bool,
    /// The level on which it runs.
    pub(super) level: Level,
    /// The requested world for which it is planned: its own, or that of the level above the levels.
    pub(super) asked: World,
    /// The window that its readers need: the smallest one that contains all of theirs.
    pub(super) wanted: Window,
    /// The window that its kernel computes: `wanted` grown by the halo of its reach.
    pub(super) window: Window,
    /// Outputs that are stored if the kernel runs anyway.
    pub(super) byproducts: Wanted,
    /// The folder that file parameters are relative to; known once files have been hashed for the keys.
    pub(super) folder: Arc<Path>,
    /// Why it cannot run: a fault of the step or of one that it reads.
    pub(super) fault: Option<EvalError>,
}

/// The step of the same node on other cells from which a step goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Coarser {
    /// It begins by itself.
    Nothing,
    /// From the state of that step.
    State(usize),
    /// From the outputs of that step; it reads no inputs.
    Results(usize),
}

/// The source of an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Source {
    /// An output of an earlier step.
    Wire { step: usize, output: usize },
    /// A number.
    Constant(f64),
    /// Nothing.
    Absent,
}

/// Inputs, output types and fault of a step.
struct Wired {
    inputs: Vec<Source>,
    types: Vec<PortType>,
    fault: Option<EvalError>,
}

/// A level of a node. If its results are averaged from finer cells, another step produces its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Level {
    pub(super) world: World,
    /// True for that other step.
    pub(super) is_state: bool,
}

/// A step: a node in one of the worlds, and whether it gives [a state alone](Level::is_state).
type Place = (usize, NodeIndex, bool);

/// The worlds of the requests, and those of the levels below.
#[derive(Default)]
struct Worlds {
    all: Vec<World>,
    /// Per world, the requested one for which it is here.
    asked: Vec<usize>,
}

impl Worlds {
    /// The number of a world, which is new for a requested one or for that of a level above.
    fn add(&mut self, world: World, above: Option<usize>) -> usize {
        self.find(&world).unwrap_or_else(|| {
            self.asked.push(above.map_or(self.all.len(), |above| self.asked[above]));
            self.all.push(world);
            self.all.len() - 1
        })
    }

    fn find(&self, world: &World) -> Option<usize> {
        self.all.iter().position(|known| known == world)
    }
}

impl<'g> Plan<'g> {
    pub(super) fn new(graph: &'g Graph, requests: &[Request], byproducts: &[Request]) -> Self {
        let mut worlds = Worlds::default();
        let mut place = |Request { port, window }: &Request| -> Place {
            let is_state = is_split(graph, port.node, &window.world)
                && port.output == graph.instance(port.node).node.outputs.len();
            (worlds.add(window.world, None), port.node, is_state)
        };
        let checked: Vec<Result<Place, EvalError>> =
            requests.iter().map(|request| check(graph, request).map(|()| place(request))).collect();
        let order = order(graph, &mut worlds, checked.iter().flatten().copied());
        let position: HashMap<Place, usize> = order.iter().enumerate().map(|(at, place)| (*place, at)).collect();
        let target = |request: &Request, place: Place| Target {
            step: position[&place],
            output: request.port.output,
            window: request.window,
        };
        let targets: Vec<Result<Target, EvalError>> =
            requests.iter().zip(checked).map(|(request, place)| place.map(|place| target(request, place))).collect();

        let mut wired: Vec<Wired> = Vec::with_capacity(order.len());
        for (world, index, _) in &order {
            let steps = |node: NodeIndex| position[&(*world, node, false)];
            wired.push(wire(graph, *index, &steps, &wired));
        }
        let below: Vec<Coarser> = order
            .iter()
            .map(|place| {
                let step_of = |world: &World, is_state: bool| {
                    position[&(worlds.find(world).expect("a known world"), place.1, is_state)]
                };
                match below(graph, *place, &worlds) {
                    Some(Below::State(world)) => Coarser::State(step_of(&world, is_split(graph, place.1, &world))),
                    Some(Below::Results(world)) => Coarser::Results(step_of(&world, false)),
                    None => Coarser::Nothing,
                }
            })
            .collect();

        let nowhere: Arc<Path> = Path::new("").into();
        let windows = windows(graph, &order, &worlds, &wired, &below, &targets);
        let mut steps: Vec<Step<'g>> = order
            .iter()
            .zip(wired)
            .zip(below)
            .zip(windows)
            .map(|((((world, index, is_state), Wired { inputs, types, fault }), below), (wanted, window))| {
                let (index, instance) = (*index, graph.instance(*index));
                let level = Level { world: worlds.all[*world], is_state: *is_state };
                let name = Arc::from(instance.name.as_str());
                let (asked, byproducts, has_state) = (worlds.all[worlds.asked[*world]], Wanted::NONE, false);
                Step {
                    index,
                    instance,
                    name,
                    inputs,
                    below,
                    types,
                    has_state,
                    level,
                    asked,
                    wanted,
                    window,
                    byproducts,
                    folder: Arc::clone(&nowhere),
                    fault,
                }
            })
            .collect();
        let read: HashSet<usize> = steps
            .iter()
            .filter_map(|step| if let Coarser::State(below) = step.below { Some(below) } else { None })
            .collect();
        for (at, step) in steps.iter_mut().enumerate() {
            let gives_state = !matches!(step.below, Coarser::Results(_));
            step.has_state = gives_state && (read.contains(&at) || step.state_bytes(Wanted::NONE, &step.window) > 0);
            // kept for a finer level that may be requested later
            if step.has_state && step.window.len() <= MOST_KEPT_CELLS {
                step.byproducts = step.byproducts.with(step.types.len());
            }
        }
        for request in byproducts.iter().filter(|request| check(graph, request).is_ok()) {
            let world = worlds.find(&request.window.world);
            let step = world.and_then(|world| position.get(&(world, request.port.node, false)));
            if let Some(step) = step.map(|at| &mut steps[*at]).filter(|step| step.wanted.contains(&request.window)) {
                step.byproducts = step.byproducts.with(request.port.output);
            }
        }
        Self { steps, targets, twins: Vec::new() }
    }

    /// Propagates faults to the steps that read a faulty one; these have no keys.
    pub(super) fn spread_faults(&mut self, origins: &mut [Option<Origins>]) {
        for (at, origins) in origins.iter_mut().enumerate() {
            let inherited = self.steps[at].sources().find_map(|source| self.steps[source].fault.clone());
            if self.steps[at].fault.is_none() {
                self.steps[at].fault = inherited;
            }
            if self.steps[at].fault.is_some() {
                *origins = None;
            }
        }
    }

    /// Keeps no states but those that are read. Returns false if none are kept.
    pub(super) fn drop_kept_states(&mut self) -> bool {
        let mut dropped = false;
        for step in &mut self.steps {
            dropped |= step.byproducts.contains(step.types.len());
            step.byproducts = step.byproducts.without(step.types.len());
        }
        dropped
    }

    /// Per step, the requests for it.
    pub(super) fn requests_of_steps(&self) -> Vec<Vec<usize>> {
        let mut of_steps = vec![Vec::new(); self.steps.len()];
        for (request, target) in self.targets.iter().enumerate() {
            if let Ok(target) = target {
                of_steps[target.step].push(request);
            }
        }
        of_steps
    }
}

impl Step<'_> {
    /// The steps and outputs that it reads for the wanted outputs: one per wire, and what it goes on from.
    pub(super) fn wires(&self, wanted: Wanted) -> impl Iterator<Item = (usize, usize)> {
        let state = self.types.len();
        let below = (0..=state).filter_map(move |output| match self.below {
            Coarser::State(step) if output == state => Some((step, output)),
            Coarser::Results(step) if output < state && wanted.contains(output) => Some((step, output)),
            _ => None,
        });
        self.own_wires().chain(below)
    }

    /// The wires of the inputs that it reads.
    pub(super) fn own_wires(&self) -> impl Iterator<Item = (usize, usize)> {
        wires(self.read_inputs())
    }

    /// The inputs that it reads.
    pub(super) fn read_inputs(&self) -> &[Source] {
        if matches!(self.below, Coarser::Results(_)) { &[] } else { &self.inputs }
    }

    /// The steps on which it depends, whatever is wanted.
    pub(super) fn sources(&self) -> impl Iterator<Item = usize> {
        let below = match self.below {
            Coarser::State(step) | Coarser::Results(step) => Some(step),
            Coarser::Nothing => None,
        };
        wires(&self.inputs).map(|(step, _)| step).chain(below)
    }

    /// True for the step of the requested results, and not of a level on the way to them.
    pub(super) fn is_asked(&self) -> bool {
        self.level.world == self.asked && !self.level.is_state
    }

    /// The number of its outputs, including the state.
    pub(super) fn outputs(&self) -> usize {
        self.types.len() + usize::from(self.has_state)
    }

    /// What an output consists of.
    pub(super) fn form(&self, output: usize) -> Form {
        self.types.get(output).map_or(Form::State, |ty| Form::of(*ty))
    }

    /// Size of one output on a window; zero for reports.
    pub(super) fn output_bytes(&self, output: usize, window: &Window) -> u64 {
        let cells = u64::from(window.cells[0]) * u64::from(window.cells[1]);
        match self.form(output) {
            Form::Strata => cells * size_of::<f32>() as u64,
            Form::Planes(planes) => cells * planes as u64 * size_of::<f32>() as u64,
            Form::State => self.state_bytes(Wanted::NONE, window),
            Form::Lines | Form::Report => 0,
        }
    }

    /// Size of its state; zero if it has none.
    fn state_bytes(&self, wanted: Wanted, window: &Window) -> u64 {
        self.instance.node.levels.map_or(0, |levels| self.size(wanted, window, levels.state))
    }

    /// The work of its kernel, compared with that of the same node on other cells.
    pub(super) fn work(&self) -> f64 {
        let (params, world) = (&self.instance.params, &self.window.world);
        self.instance.node.levels.map_or(self.window.len() as f64, |levels| (levels.work)(params, world))
    }

    /// Memory that its kernel needs for the wanted outputs: the outputs on its window, its scratch memory, and crops of
    /// inputs that were computed on wider windows.
    pub(super) fn kernel_bytes(&self, wanted: Wanted, steps: &[Step<'_>]) -> u64 {
        let cuts = self.own_wires().filter(|(source, _)| steps[*source].wanted != self.window);
        let cuts: u64 = cuts.map(|(source, output)| steps[source].output_bytes(output, &self.window)).sum();
        cuts + self.own_bytes(wanted, &self.window)
    }

    /// Size of the wanted outputs on a window, and of the scratch memory of the kernel that computes them there.
    pub(super) fn own_bytes(&self, wanted: Wanted, window: &Window) -> u64 {
        let given = (0..self.outputs()).filter(|output| wanted.contains(*output));
        let given: u64 = given.map(|output| self.output_bytes(output, window)).sum();
        if matches!(self.below, Coarser::Results(_)) {
            return given;
        }
        given + self.size(wanted, window, |sizing| self.instance.node.scratch.bytes(sizing))
    }

    fn size(&self, wanted: Wanted, window: &Window, bytes: impl Fn(&Sizing<'_>) -> u64) -> u64 {
        let wired: Vec<bool> = self.inputs.iter().map(|source| matches!(source, Source::Wire { .. })).collect();
        let folder = &self.folder;
        bytes(&Sizing { params: &self.instance.params, window: *window, wired: &wired, wanted, folder })
    }
}

fn wires(sources: &[Source]) -> impl Iterator<Item = (usize, usize)> {
    sources.iter().filter_map(|source| match source {
        Source::Wire { step, output } => Some((*step, *output)),
        Source::Constant(_) | Source::Absent => None,
    })
}

/// What a step goes on from.
fn below(graph: &Graph, (world, index, is_state): Place, worlds: &Worlds) -> Option<Below> {
    of_levels(graph, index, &worlds.all[world]).filter(|_| !is_state)
}

/// Whether results and state of a node in a world are two steps.
fn is_split(graph: &Graph, index: NodeIndex, world: &World) -> bool {
    matches!(of_levels(graph, index, world), Some(Below::Results(_)))
}

fn of_levels(graph: &Graph, index: NodeIndex, world: &World) -> Option<Below> {
    let instance = graph.instance(index);
    (instance.node.levels?.below)(&instance.params, world)
}

fn check(graph: &Graph, Request { port, window }: &Request) -> Result<(), EvalError> {
    window.world.check()?;
    let Some(instance) = graph.get(port.node) else {
        return Err(EvalError::Request("a node was requested that is not in the graph".to_owned()));
    };
    let name = &instance.name;
    // a state is requested by stages only
    if port.output >= instance.node.outputs.len() + usize::from(instance.node.levels.is_some()) {
        return Err(EvalError::Request(format!("`{name}` has no output number {}", port.output)));
    }
    if window.is_empty() || !contains(&Window::whole(window.world), window) {
        let ([x, y], [nx, ny]) = (window.origin, window.cells);
        let [wx, wy] = window.world.cells;
        return Err(EvalError::Request(format!(
            "`{name}` was requested on {nx} x {ny} cells from ({x}, {y}), which are not a part of the world's {wx} x {wy}"
        )));
    }
    Ok(())
}

/// [`Window::contains`] for a window that may extend beyond any world.
fn contains(whole: &Window, part: &Window) -> bool {
    (0..2).all(|axis| part.origin[axis].checked_add(part.cells[axis]).is_some()) && whole.contains(part)
}

/// The needed nodes, each after those that it reads: depth first along the level below and the inputs, without
/// recursion, since a chain may be long. Levels come before inputs: of a level only its state is alive when the inputs
/// of the next one are made.
fn order(graph: &Graph, worlds: &mut Worlds, wanted: impl Iterator<Item = Place>) -> Vec<Place> {
    let mut order = Vec::new();
    let mut seen = HashSet::new();
    for root in wanted {
        let mut stack = vec![(root, 0)];
        if !seen.insert(root) {
            continue;
        }
        while let Some((place, input)) = stack.last_mut() {
            let (world, index, _) = *place;
            if *input > graph.instance(index).node.inputs.len() {
                order.push(*place);
                stack.pop();
                continue;
            }
            let source = match *input {
                0 => below(graph, *place, worlds).map(|below| {
                    let (coarser, is_state) = match below {
                        Below::State(coarser) => (coarser, is_split(graph, index, &coarser)),
                        Below::Results(finer) => (finer, false),
                    };
                    (worlds.add(coarser, Some(world)), index, is_state)
                }),
                input => graph.source(index, input - 1).map(|port| (world, port.node, false)),
            };
            *input += 1;
            if let Some(source) = source
                && seen.insert(source)
            {
                stack.push((source, 0));
            }
        }
    }
    order
}

/// Inputs and output types of a node; the nodes that it reads come first.
fn wire(graph: &Graph, index: NodeIndex, steps: &dyn Fn(NodeIndex) -> usize, wired: &[Wired]) -> Wired {
    let instance = graph.instance(index);
    let mut fault = None;
    let mut inputs = Vec::with_capacity(instance.node.inputs.len());
    for at in 0..instance.node.inputs.len() {
        let (source, wrong) = source(graph, index, at, steps, wired);
        inputs.push(source);
        fault = fault.or(wrong);
    }
    let types = output_types(instance, &inputs, wired);
    let inherited = inputs.iter().find_map(|source| match source {
        Source::Wire { step, .. } => wired[*step].fault.clone(),
        Source::Constant(_) | Source::Absent => None,
    });
    let fault = inherited.or(fault).or_else(|| refused(instance, &inputs));
    Wired { inputs, types, fault }
}

/// Why a node cannot be computed with its parameters and inputs, whatever the terrain.
fn refused(instance: &Instance, inputs: &[Source]) -> Option<EvalError> {
    let is_wired = |input: usize| matches!(inputs[input], Source::Wire { .. });
    match instance.node.refuses?(&Stated::of_instance(instance, is_wired)) {
        Err(NodeError::Failed { message, hint }) => {
            Some(EvalError::Node { node: instance.name.clone(), id: instance.node.id, message, hint })
        }
        _ => None,
    }
}

fn source(
    graph: &Graph,
    index: NodeIndex,
    at: usize,
    steps: &dyn Fn(NodeIndex) -> usize,
    wired: &[Wired],
) -> (Source, Option<EvalError>) {
    let instance = graph.instance(index);
    let input = &instance.node.inputs[at];
    match (graph.source(index, at), input.fallback) {
        (Some(port), _) => {
            let step = steps(port.node);
            // The types of a step with a fault are unknown.
            let gives = wired[step].types[port.output];
            let fits = wired[step].fault.is_some() || input.ty.accepts(gives);
            let fault = (!fits).then(|| EvalError::Type {
                from: graph.port_name(port),
                gives,
                to: format!("{}.{}", instance.name, input.name),
                takes: input.ty,
            });
            (Source::Wire { step, output: port.output }, fault)
        }
        (None, Fallback::Required) => {
            let (node, id) = (instance.name.clone(), instance.node.id);
            (Source::Absent, Some(EvalError::Unwired { node, id, input: input.name }))
        }
        (None, Fallback::None) => (Source::Absent, None),
        (None, Fallback::Constant { default, .. }) => {
            let value = instance.constants.get(at).copied().flatten().unwrap_or(default);
            let fault = || EvalError::Constant { node: instance.name.clone(), input: input.name, value };
            (Source::Constant(value), (!value.is_finite()).then(fault))
        }
    }
}

/// As [`Graph::output_type`], without walking up the same chain once per node.
fn output_types(instance: &Instance, inputs: &[Source], wired: &[Wired]) -> Vec<PortType> {
    let node = instance.node;
    if let Some(given) = &instance.given {
        return vec![given.ty(); node.outputs.len()];
    }
    let type_at = |name: &str| match node.inputs.iter().position(|input| input.name == name).map(|at| inputs[at]) {
        Some(Source::Wire { step, output }) => wired[step].types[output],
        _ => PortType::Height,
    };
    let types = node.outputs.iter().map(|output| match output.ty {
        OutputType::Fixed(ty) => ty,
        OutputType::Chosen(choose) => choose(&instance.params),
        OutputType::SameAs(input) => type_at(input),
    });
    types.collect()
}

/// Per step, the window that its readers need and the one that its kernel computes: from the requests up the wires.
fn windows(
    graph: &Graph,
    order: &[Place],
    worlds: &Worlds,
    wired: &[Wired],
    below: &[Coarser],
    targets: &[Result<Target, EvalError>],
) -> Vec<(Window, Window)> {
    let mut wanted: Vec<Option<Window>> = vec![None; order.len()];
    let want = |slot: &mut Option<Window>, window: &Window| {
        *slot = Some(slot.map_or(*window, |other| other.union(window)));
    };
    for target in targets.iter().flatten() {
        want(&mut wanted[target.step], &target.window);
    }
    let mut windows = Vec::with_capacity(order.len());
    for at in (0..order.len()).rev() {
        let instance = graph.instance(order[at].1);
        let wanted_here = wanted[at].expect("a step is a target or the source of a later step");
        let window = reached(instance.node.reach, &instance.params, &wanted_here);
        for source in &wired[at].inputs {
            if let Source::Wire { step, .. } = source {
                want(&mut wanted[*step], &window);
            }
        }
        if let Coarser::State(step) | Coarser::Results(step) = below[at] {
            want(&mut wanted[step], &Window::whole(worlds.all[order[step].0]));
        }
        // A result computed for the whole world is kept whole: the next tile takes it from the cache.
        let whole = instance.node.reach.is_world(&instance.params, wanted_here.cell_m());
        let kept = if whole { window } else { wanted_here };
        windows.push((kept, window));
    }
    windows.reverse();
    windows
}

/// The window that a kernel must compute for `wanted` to be correct.
pub(super) fn reached(reach: Reach, params: &ParamValues, wanted: &Window) -> Window {
    match reach {
        Reach::Point => *wanted,
        Reach::World => Window::whole(wanted.world),
        Reach::Metres(from) => match from(params, wanted.cell_m()) {
            0.0 => *wanted,
            reach_m if reach_m > 0.0 && reach_m.is_finite() => around(wanted.grown(reach_m)),
            // not a distance: only the whole world is certain to be enough
            _ => Window::whole(wanted.world),
        },
    }
}

/// A halo that reaches a periodic side continues at the opposite one, so the window covers the whole axis.
fn around(mut window: Window) -> Window {
    let world = window.world;
    let sides = [[world.boundary.west, world.boundary.east], [world.boundary.north, world.boundary.south]];
    for (axis, sides) in sides.iter().enumerate() {
        let ends = [window.origin[axis] == 0, window.origin[axis] + window.cells[axis] == world.cells[axis]];
        if sides.contains(&Edge::Periodic) && ends.contains(&true) {
            window.origin[axis] = 0;
            window.cells[axis] = world.cells[axis];
        }
    }
    window
}
