//! What a request needs: which nodes, in which order, on which windows.

use std::{collections::HashMap, sync::Arc};

use petgraph::stable_graph::NodeIndex;

use super::error::EvalError;
use crate::{
    graph::{Graph, Instance, Port},
    node::{Fallback, OutputType, Reach},
    param::ParamValues,
    value::PortType,
    world::{Edge, Window},
};

/// The nodes that requests need, each after those that it reads.
///
/// Nodes stand in the order in which a recursive evaluation would finish them, which keeps few values alive at a time.
pub(super) struct Plan<'g> {
    pub(super) steps: Vec<Step<'g>>,
    /// Per request: step, output and window.
    pub(super) targets: Vec<Target>,
}

/// A requested value.
pub(super) struct Target {
    pub(super) step: usize,
    pub(super) output: usize,
    pub(super) window: Window,
}

/// The evaluation of one node.
pub(super) struct Step<'g> {
    pub(super) index: NodeIndex,
    pub(super) instance: &'g Instance,
    pub(super) name: Arc<str>,
    pub(super) inputs: Vec<Source>,
    /// The types of its outputs.
    pub(super) types: Vec<PortType>,
    /// The window its readers take from: the smallest one that contains what each of them wants.
    pub(super) wanted: Window,
    /// The window its kernel works on: `wanted` with the halo of its reach.
    pub(super) window: Window,
}

/// What stands at an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Source {
    /// An output of an earlier step.
    Wire { step: usize, output: usize },
    /// A number.
    Constant(f64),
    /// Nothing.
    Absent,
}

impl<'g> Plan<'g> {
    pub(super) fn new(graph: &'g Graph, requests: &[(Port, Window)]) -> Result<Self, EvalError> {
        check_requests(graph, requests)?;
        let order = order(graph, requests.iter().map(|(port, _)| port.node));
        let position: HashMap<NodeIndex, usize> = order.iter().enumerate().map(|(at, index)| (*index, at)).collect();
        let targets: Vec<Target> = requests
            .iter()
            .map(|(port, window)| Target { step: position[&port.node], output: port.output, window: *window })
            .collect();

        let mut wired: Vec<(Vec<Source>, Vec<PortType>)> = Vec::with_capacity(order.len());
        for index in &order {
            let inputs = sources(graph, *index, &position, &wired)?;
            let types = output_types(graph.instance(*index), &inputs, &wired);
            wired.push((inputs, types));
        }

        let windows = windows(graph, &order, &wired, &targets);
        let steps = order
            .into_iter()
            .zip(wired)
            .zip(windows)
            .map(|((index, (inputs, types)), (wanted, window))| {
                let instance = graph.instance(index);
                Step { index, instance, name: Arc::from(instance.name.as_str()), inputs, types, wanted, window }
            })
            .collect();
        Ok(Self { steps, targets })
    }
}

impl Step<'_> {
    /// The steps and outputs it reads, one per wire.
    pub(super) fn wires(&self) -> impl Iterator<Item = (usize, usize)> {
        self.inputs.iter().filter_map(|source| match source {
            Source::Wire { step, output } => Some((*step, *output)),
            Source::Constant(_) | Source::Absent => None,
        })
    }

    /// Bytes of one output on a window; none for reports.
    pub(super) fn output_bytes(&self, output: usize, window: &Window) -> u64 {
        let cells = u64::from(window.cells[0]) * u64::from(window.cells[1]);
        cells * self.types[output].planes().unwrap_or(0) as u64 * size_of::<f32>() as u64
    }
}

fn check_requests(graph: &Graph, requests: &[(Port, Window)]) -> Result<(), EvalError> {
    let Some((_, first)) = requests.first() else { return Ok(()) };
    first.world.check()?;
    for (port, window) in requests {
        let Some(instance) = graph.get(port.node) else {
            return Err(EvalError::Request("a node was asked for that is not in the graph".to_owned()));
        };
        let name = &instance.name;
        if port.output >= instance.node.outputs.len() {
            return Err(EvalError::Request(format!("`{name}` has no output number {}", port.output)));
        }
        if window.world != first.world {
            return Err(EvalError::Request(format!("`{name}` was asked for in another world than the rest")));
        }
        if window.is_empty() || !contains(&Window::whole(window.world), window) {
            let ([x, y], [nx, ny]) = (window.origin, window.cells);
            let [wx, wy] = window.world.cells;
            return Err(EvalError::Request(format!(
                "`{name}` was asked for in {nx} x {ny} cells from ({x}, {y}), which are not a part of the world's {wx} x {wy}"
            )));
        }
    }
    Ok(())
}

/// [`Window::contains`] for a window that may claim cells beyond any world.
fn contains(whole: &Window, part: &Window) -> bool {
    (0..2).all(|axis| part.origin[axis].checked_add(part.cells[axis]).is_some()) && whole.contains(part)
}

/// The needed nodes, each after those that it reads: depth first along the inputs, without recursion, since a chain
/// may be long.
fn order(graph: &Graph, wanted: impl Iterator<Item = NodeIndex>) -> Vec<NodeIndex> {
    let mut order = Vec::new();
    let mut seen = std::collections::HashSet::new();
    for root in wanted {
        let mut stack = vec![(root, 0)];
        if !seen.insert(root) {
            continue;
        }
        while let Some((index, input)) = stack.last_mut() {
            if *input == graph.instance(*index).node.inputs.len() {
                order.push(*index);
                stack.pop();
                continue;
            }
            let source = graph.source(*index, *input);
            *input += 1;
            if let Some(source) = source
                && seen.insert(source.node)
            {
                stack.push((source.node, 0));
            }
        }
    }
    order
}

fn sources(
    graph: &Graph,
    index: NodeIndex,
    position: &HashMap<NodeIndex, usize>,
    wired: &[(Vec<Source>, Vec<PortType>)],
) -> Result<Vec<Source>, EvalError> {
    let instance = graph.instance(index);
    let node = instance.node;
    let mut sources = Vec::with_capacity(node.inputs.len());
    for (at, input) in node.inputs.iter().enumerate() {
        let source = match (graph.source(index, at), input.fallback) {
            (Some(port), _) => {
                let step = position[&port.node];
                let gives = wired[step].1[port.output];
                if !input.ty.accepts(gives) {
                    return Err(EvalError::Type {
                        from: graph.port_name(port),
                        gives,
                        to: format!("{}.{}", instance.name, input.name),
                        takes: input.ty,
                    });
                }
                Source::Wire { step, output: port.output }
            }
            (None, Fallback::Required) => {
                return Err(EvalError::Unwired { node: instance.name.clone(), id: node.id, input: input.name });
            }
            (None, Fallback::None) => Source::Absent,
            (None, Fallback::Constant { default, .. }) => {
                let value = instance.constants.get(at).copied().flatten().unwrap_or(default);
                if !value.is_finite() {
                    return Err(EvalError::Constant { node: instance.name.clone(), input: input.name, value });
                }
                Source::Constant(value)
            }
        };
        sources.push(source);
    }
    Ok(sources)
}

/// As [`Graph::output_type`], without walking up the same chain once per node.
fn output_types(instance: &Instance, inputs: &[Source], wired: &[(Vec<Source>, Vec<PortType>)]) -> Vec<PortType> {
    let node = instance.node;
    let type_at = |name: &str| match node.inputs.iter().position(|input| input.name == name).map(|at| inputs[at]) {
        Some(Source::Wire { step, output }) => wired[step].1[output],
        _ => PortType::Height,
    };
    let types = node.outputs.iter().map(|output| match output.ty {
        OutputType::Fixed(ty) => ty,
        OutputType::Chosen(choose) => choose(&instance.params),
        OutputType::SameAs(input) => type_at(input),
    });
    types.collect()
}

/// Per step the window that its readers want and the one that its kernel works on: from the requests up the wires.
fn windows(
    graph: &Graph,
    order: &[NodeIndex],
    wired: &[(Vec<Source>, Vec<PortType>)],
    targets: &[Target],
) -> Vec<(Window, Window)> {
    let mut wanted: Vec<Option<Window>> = vec![None; order.len()];
    let want = |slot: &mut Option<Window>, window: &Window| {
        *slot = Some(slot.map_or(*window, |other| other.union(window)));
    };
    for target in targets {
        want(&mut wanted[target.step], &target.window);
    }
    let mut windows = Vec::with_capacity(order.len());
    for at in (0..order.len()).rev() {
        let instance = graph.instance(order[at]);
        let wanted_here = wanted[at].expect("a step is a target or the source of a later step");
        let window = reached(instance.node.reach, &instance.params, &wanted_here);
        for source in &wired[at].0 {
            if let Source::Wire { step, .. } = source {
                want(&mut wanted[*step], &window);
            }
        }
        // What was computed for the whole world is kept whole: the next tile takes it from the cache.
        let kept = if matches!(instance.node.reach, Reach::World) { window } else { wanted_here };
        windows.push((kept, window));
    }
    windows.reverse();
    windows
}

/// The window a kernel must work on for `wanted` to be right.
fn reached(reach: Reach, params: &ParamValues, wanted: &Window) -> Window {
    match reach {
        Reach::Point => *wanted,
        Reach::World => Window::whole(wanted.world),
        Reach::Metres(from) => match from(params, wanted.cell_m()) {
            0.0 => *wanted,
            reach_m if reach_m > 0.0 => around(wanted.grown(reach_m)),
            // not a distance: nothing less than the whole is certain to be enough
            _ => Window::whole(wanted.world),
        },
    }
}

/// A halo that comes to a periodic side goes on at the opposite one, so the window takes the whole of that axis.
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
