//! What requests need: which nodes, in which order, on which windows.

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use petgraph::stable_graph::NodeIndex;

use super::{Request, error::EvalError, key::Origins};
use crate::{
    graph::{Graph, Instance},
    job::Wanted,
    node::{Fallback, OutputType, Reach, Sizing},
    param::ParamValues,
    value::PortType,
    world::{Edge, Window, World},
};

/// The nodes that requests need, each after those that it reads. A node is planned once per world.
///
/// Steps are in the order in which a recursive evaluation would finish them, which keeps few values alive at a time.
pub(super) struct Plan<'g> {
    pub(super) steps: Vec<Step<'g>>,
    /// Per request, its step and output, or why it cannot be evaluated.
    pub(super) targets: Vec<Result<Target, EvalError>>,
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
    /// Its wired inputs on the cells of [`Node::coarse`](crate::Node), one per input; empty without such cells. They
    /// follow from the inputs and the parameters, so that keys leave them out.
    pub(super) coarse: Vec<Source>,
    /// The types of its outputs.
    pub(super) types: Vec<PortType>,
    /// The window that its readers need: the smallest one that contains all of theirs.
    pub(super) wanted: Window,
    /// The window that its kernel computes: `wanted` grown by the halo of its reach.
    pub(super) window: Window,
    /// Outputs that are stored if the kernel runs anyway.
    pub(super) byproducts: Wanted,
    /// Why it cannot run: a fault of the step or of one that it reads.
    pub(super) fault: Option<EvalError>,
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
    coarse: Vec<Source>,
    types: Vec<PortType>,
    fault: Option<EvalError>,
}

/// A node in one of the worlds of the requests.
type Place = (usize, NodeIndex);

impl<'g> Plan<'g> {
    pub(super) fn new(graph: &'g Graph, requests: &[Request], byproducts: &[Request]) -> Self {
        let mut worlds: Vec<World> = Vec::new();
        let mut place = |request: &Request| -> Place {
            let world = request.window.world;
            let known = worlds.iter().position(|known| *known == world);
            let at = known.unwrap_or_else(|| {
                worlds.push(world);
                worlds.len() - 1
            });
            (at, request.port.node)
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
        for (world, index) in &order {
            let steps = |node: NodeIndex| position[&(*world, node)];
            let mut step = wire(graph, *index, &steps, &wired);
            if let Some(coarse) = coarse_world(graph.instance(*index), &worlds[*world]) {
                let world = worlds.iter().position(|known| *known == coarse).expect("a world of the order");
                let source = |at| match graph.source(*index, at) {
                    Some(port) => Source::Wire { step: position[&(world, port.node)], output: port.output },
                    None => Source::Absent,
                };
                step.coarse = (0..step.inputs.len()).map(source).collect();
            }
            wired.push(step);
        }

        let windows = windows(graph, &order, &worlds, &wired, &targets);
        let mut steps: Vec<Step<'g>> = order
            .iter()
            .zip(wired)
            .zip(windows)
            .map(|(((_, index), Wired { inputs, coarse, types, fault }), (wanted, window))| {
                let instance = graph.instance(*index);
                let name = Arc::from(instance.name.as_str());
                let byproducts = Wanted::NONE;
                Step { index: *index, instance, name, inputs, coarse, types, wanted, window, byproducts, fault }
            })
            .collect();
        for request in byproducts.iter().filter(|request| check(graph, request).is_ok()) {
            let world = worlds.iter().position(|world| *world == request.window.world);
            let step = world.and_then(|world| position.get(&(world, request.port.node)));
            if let Some(step) = step.map(|at| &mut steps[*at]).filter(|step| step.wanted.contains(&request.window)) {
                step.byproducts = step.byproducts.with(request.port.output);
            }
        }
        Self { steps, targets }
    }

    /// Propagates faults to the steps that read a faulty one; these have no keys.
    pub(super) fn spread_faults(&mut self, origins: &mut [Option<Origins>]) {
        for (at, origins) in origins.iter_mut().enumerate() {
            let inherited = self.steps[at].wires().find_map(|(source, _)| self.steps[source].fault.clone());
            if self.steps[at].fault.is_none() {
                self.steps[at].fault = inherited;
            }
            if self.steps[at].fault.is_some() {
                *origins = None;
            }
        }
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
    /// The steps and outputs that it reads, one per wire.
    pub(super) fn wires(&self) -> impl Iterator<Item = (usize, usize)> {
        wires(&self.inputs).chain(wires(&self.coarse))
    }

    /// The wires of its inputs on the world's cells.
    pub(super) fn own_wires(&self) -> impl Iterator<Item = (usize, usize)> {
        wires(&self.inputs)
    }

    /// The wires of its inputs on other cells.
    pub(super) fn coarse_wires(&self) -> impl Iterator<Item = (usize, usize)> {
        wires(&self.coarse)
    }

    /// Size of one output on a window; zero for reports.
    pub(super) fn output_bytes(&self, output: usize, window: &Window) -> u64 {
        let cells = u64::from(window.cells[0]) * u64::from(window.cells[1]);
        cells * self.types[output].planes().unwrap_or(0) as u64 * size_of::<f32>() as u64
    }

    /// Memory that its kernel needs for the wanted outputs: the outputs on its window, its scratch memory, and crops of
    /// inputs that were computed on wider windows.
    pub(super) fn kernel_bytes(&self, wanted: Wanted, steps: &[Step<'_>]) -> u64 {
        let cuts = wires(&self.inputs).filter(|(source, _)| steps[*source].wanted != self.window);
        let cuts: u64 = cuts.map(|(source, output)| steps[source].output_bytes(output, &self.window)).sum();
        cuts + self.own_bytes(wanted, &self.window)
    }

    /// Size of the wanted outputs on a window, and of the scratch memory of the kernel that computes them there.
    pub(super) fn own_bytes(&self, wanted: Wanted, window: &Window) -> u64 {
        let given = (0..self.types.len()).filter(|output| wanted.contains(*output));
        let given: u64 = given.map(|output| self.output_bytes(output, window)).sum();
        let wired: Vec<bool> = self.inputs.iter().map(|source| matches!(source, Source::Wire { .. })).collect();
        let sizing = Sizing { params: &self.instance.params, window: *window, wired: &wired, wanted };
        given + self.instance.node.scratch.bytes(&sizing)
    }
}

fn wires(sources: &[Source]) -> impl Iterator<Item = (usize, usize)> {
    sources.iter().filter_map(|source| match source {
        Source::Wire { step, output } => Some((*step, *output)),
        Source::Constant(_) | Source::Absent => None,
    })
}

/// The cells on which a node also reads its inputs, where they are not those of the world.
fn coarse_world(instance: &Instance, world: &World) -> Option<World> {
    let coarse = (instance.node.coarse?)(&instance.params, world)?;
    (coarse.cells != world.cells).then_some(coarse)
}

fn check(graph: &Graph, Request { port, window }: &Request) -> Result<(), EvalError> {
    window.world.check()?;
    let Some(instance) = graph.get(port.node) else {
        return Err(EvalError::Request("a node was requested that is not in the graph".to_owned()));
    };
    let name = &instance.name;
    if port.output >= instance.node.outputs.len() {
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

/// The needed nodes, each after those that it reads: depth first along the inputs, without recursion, since a chain may
/// be long.
fn order(graph: &Graph, worlds: &mut Vec<World>, wanted: impl Iterator<Item = Place>) -> Vec<Place> {
    let mut order = Vec::new();
    let mut seen = HashSet::new();
    for root in wanted {
        let mut stack = vec![(root, 0)];
        if !seen.insert(root) {
            continue;
        }
        while let Some(((world, index), input)) = stack.last_mut() {
            let (mut world, index) = (*world, *index);
            let instance = graph.instance(index);
            let inputs = instance.node.inputs.len();
            let coarse = coarse_world(instance, &worlds[world]);
            if *input == if coarse.is_some() { 2 * inputs } else { inputs } {
                order.push((world, index));
                stack.pop();
                continue;
            }
            let source = graph.source(index, *input % inputs);
            if let Some(coarse) = coarse.filter(|_| *input >= inputs) {
                world = worlds.iter().position(|known| *known == coarse).unwrap_or(worlds.len());
                if world == worlds.len() {
                    worlds.push(coarse);
                }
            }
            *input += 1;
            if let Some(source) = source.map(|port| (world, port.node))
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
    Wired { inputs, coarse: Vec::new(), types, fault: inherited.or(fault) }
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
    worlds: &[World],
    wired: &[Wired],
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
        if let Some(coarse) = coarse_world(instance, &worlds[order[at].0]) {
            wires(&wired[at].coarse).for_each(|(step, _)| want(&mut wanted[step], &Window::whole(coarse)));
        }
        // A result computed for the whole world is kept whole: the next tile takes it from the cache.
        let kept = if matches!(instance.node.reach, Reach::World) { window } else { wanted_here };
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
            reach_m if reach_m > 0.0 => around(wanted.grown(reach_m)),
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
