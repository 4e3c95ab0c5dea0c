//! Random chains of nodes, with random and extreme parameters: a window, computed on any number of threads and at any
//! SIMD level, equals that part of the whole world byte for byte.

use std::{collections::BTreeMap, num::NonZero, sync::Arc};

use orograph_graph::{
    EvalError, Evaluator, EvaluatorOptions, Exactness, Fallback, Graph, Instance, Kind, Node, ParamValue, Port, Reach,
    Store, Value, Window, World,
};
use orograph_nodes::{numerics::simd::Level, registry};
pub(super) use orograph_tests::Draw;
use orograph_tests::{LAND, SELECTION, data_folder};

const CELLS: u32 = 112;
/// The widest halo of a chain in cells: much smaller than the world, so that windows are only parts of it.
const MOST_HALO: f64 = 36.0;
/// Number of chains that end in each node.
const CHAINS: u32 = 8;
/// Sides of worlds in metres, so that a length in metres can be few cells or many.
const SIDES: [f64; 3] = [4_000.0, 16_384.0, 60_000.0];

/// A part of the world; sometimes it touches the sides.
fn window(draw: &mut Draw, world: World) -> Window {
    let mut window = Window::whole(world);
    for axis in 0..2 {
        let cells = 1 + draw.below(40) as u32;
        let room = (CELLS - cells) as usize;
        let inside = draw.below(room);
        window.origin[axis] = draw.one(&[0, room, inside, inside]) as u32;
        window.cells[axis] = cells;
    }
    window
}

/// A chain, the total reach of its nodes in cells, and the ports so far.
struct Chain {
    graph: Graph,
    halo: f64,
    ports: Vec<Port>,
    cell_m: f64,
}

impl Chain {
    fn new(cell_m: f64) -> Self {
        let mut graph = Graph::default();
        let nodes = registry();
        let [ramp, flow, layers, path] = ["Ramp", "Flow", "Stratify", "Path"].map(|id| nodes.get(id).expect("a node"));
        let [ramp, flow, layers, path, selection, land] = [ramp, flow, layers, path, &SELECTION, &LAND]
            .map(|node| Port { node: graph.add(Instance::new(node.id, node)).expect("a new name"), output: 0 });
        // colours, drainage, rock at depth and lines, for nodes that read them
        graph.connect(land, ramp.node, "value").expect("the types fit");
        graph.connect(land, flow.node, "height").expect("the types fit");
        graph.connect(land, layers.node, "height").expect("the types fit");
        let [drainage, rock] = ["Flow.flow", "Stratify.strata"].map(|port| graph.port(port).expect("an output"));
        Self { graph, halo: 0.0, ports: vec![ramp, drainage, rock, path, selection, land], cell_m }
    }

    /// Adds a node that reads the last one if possible. Returns false when no parameters keep the halo small, or no
    /// port fits an input.
    fn add(&mut self, node: &'static Node, draw: &mut Draw) -> bool {
        for _ in 0..12 {
            let mut instance = Instance::new(format!("n{}", self.ports.len()), node);
            for spec in node.specs() {
                if let Some(value) = draw.value(&spec.kind) {
                    instance.params.set(spec.name, value);
                }
            }
            let reach = match node.reach {
                Reach::Point => 0.0,
                Reach::Metres(from) => (from(&instance.params, self.cell_m) / self.cell_m).ceil(),
                Reach::World => f64::INFINITY,
            };
            if self.halo + reach <= MOST_HALO && self.wire(instance, draw) {
                self.halo += reach;
                return true;
            }
        }
        false
    }

    fn wire(&mut self, instance: Instance, draw: &mut Draw) -> bool {
        let node = instance.node;
        let mut sources = Vec::new();
        for input in node.inputs {
            let suits: Vec<Port> = self
                .ports
                .iter()
                .rev()
                .copied()
                .filter(|port| input.ty.accepts(self.graph.output_type(*port)))
                .collect();
            let required = input.fallback == Fallback::Required;
            match suits.first() {
                None if required => return false,
                Some(newest) if required => sources.push((input.name, *newest)),
                Some(_) if draw.share() < 0.4 => sources.push((input.name, draw.one(&suits))),
                _ => {}
            }
        }
        let at = self.graph.add(instance).expect("a new name");
        for (input, port) in sources {
            self.graph.connect(port, at, input).expect("the types fit");
        }
        let fields = (0..node.outputs.len()).map(|output| Port { node: at, output });
        let fields: Vec<Port> = fields.filter(|port| self.graph.output_type(*port).planes().is_some()).collect();
        self.ports.extend(fields);
        true
    }

    /// The outputs of the last node.
    fn ends(&self) -> Vec<Port> {
        let last = self.ports.last().expect("there are the sources").node;
        self.ports.iter().copied().filter(|port| port.node == last).collect()
    }

    /// Returns true if an error is that of a node whose mode is `power`.
    fn is_of_power(&self, error: &EvalError) -> bool {
        let node = error.node().and_then(|name| self.graph.find(name).ok());
        let mode = node.and_then(|at| self.graph.instance(at).params.get("mode"));
        mode == Some(&ParamValue::Choice("power"))
    }

    fn values(&self, window: Window, threads: usize) -> Result<Vec<Value>, EvalError> {
        let evaluator = Evaluator::new(EvaluatorOptions {
            store: Arc::new(Store::new(0, None)),
            threads: NonZero::new(threads),
            ..EvaluatorOptions::default()
        })?;
        evaluator.values(&self.graph, &data_folder(), &self.ends(), window)
    }
}

#[test]
fn windows_of_random_chains_equal_the_whole_at_every_width() {
    let local = |node: &&'static Node| {
        !matches!(node.reach, Reach::World)
            && node.exactness == Exactness::Exact
            && !node.specs().iter().any(|spec| spec.kind == Kind::File)
    };
    let nodes: Vec<&'static Node> = registry().nodes().iter().copied().filter(local).collect();
    assert!(nodes.len() > 25, "{} nodes", nodes.len());
    let mut compared: BTreeMap<&str, u32> = BTreeMap::new();
    let (mut faults, mut with_halo) = (Vec::new(), 0);
    for (number, node) in (0u32..).zip(nodes.iter().flat_map(|node| [*node; CHAINS as usize])) {
        let mut draw = Draw(number);
        let side = draw.one(&SIDES);
        let world = World { size: [side; 2], cells: [CELLS; 2], seed: number, ..World::default() };
        let mut chain = Chain::new(world.cell_m());
        for _ in 0..draw.below(3) {
            let before = draw.one(&nodes);
            chain.add(before, &mut draw);
        }
        if !chain.add(node, &mut draw) || chain.graph.instance(chain.ends()[0].node).node.id != node.id {
            continue;
        }
        let (window, threads) = (window(&mut draw, world), 1 + draw.below(4));
        let level = draw.one(&[Level::Baseline, Level::Avx2, Level::Avx512]);
        let whole = match chain.values(Window::whole(world), 2) {
            Ok(whole) => whole,
            // combinations that make no sense may be refused, with a remedy
            Err(EvalError::Node { hint: Some(_), .. }) => continue,
            // a power of extreme numbers is too large for any raster
            Err(error) if chain.is_of_power(&error) && error.to_string().contains("returned inf") => continue,
            Err(error) => panic!("chain {number} that ends in {}: {error}", node.id),
        };
        let part = orograph_nodes::numerics::simd::at(level, || chain.values(window, threads));
        let part = part.unwrap_or_else(|error| panic!("chain {number} that ends in {}: {error}", node.id));
        for (whole, part) in whole.iter().zip(&part) {
            if whole.as_field().map(|whole| whole.crop(&window)) != part.as_field().cloned() {
                let names: Vec<&str> = chain.graph.indices().map(|at| chain.graph.instance(at).node.id).collect();
                faults.push(format!("chain {number} ({}) at {:?}, {level:?}", names.join(", "), window.origin));
            }
        }
        *compared.entry(node.id).or_default() += 1;
        with_halo += u32::from(chain.halo > 0.0);
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    let missing: Vec<&str> = nodes.iter().map(|node| node.id).filter(|id| !compared.contains_key(id)).collect();
    assert!(missing.is_empty(), "never compared: {missing:?}");
    let all: u32 = compared.values().sum();
    assert!(all * 4 > nodes.len() as u32 * CHAINS * 3 && with_halo * 4 > all, "{all} chains, {with_halo} with a halo");
}
