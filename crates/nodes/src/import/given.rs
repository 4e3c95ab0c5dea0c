//! Returns a raster that a program gives, such as a NumPy array, on the cells of the world.
//!
//! It covers the whole world. If its cells are those of the world, its samples are passed on without a copy; otherwise
//! they are resampled as by `Import`. Files cannot name this kind; [`Graph::add_given`](orograph_graph::Graph::add_given)
//! puts it into a graph.

use orograph_graph::{Input, InputValue, Output, Value};

use crate::{
    prelude::*,
    raster::{GridAxis, resample},
};

/// The kind of node that returns a given raster. Its output has the type of the raster.
pub static GIVEN: Node = Node {
    id: "Array",
    category: "import",
    summary: "Returns a raster that a program gives.",
    doc: "The raster covers the whole world; it is resampled if it has other cells.",
    inputs: &[Input::takes("raster", PortType::AnyScalar, "The raster, on its own cells.")],
    outputs: &[Output::gives("value", PortType::Height, "The raster.")],
    cpu: run,
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Some(InputValue::Value(Value::Field(given))) = job.inputs.first() else {
        return Err(NodeError::failed("no raster is given"));
    };
    let window = job.window();
    if given.window().contains(&window) {
        return Ok(Outputs::one("value", given.try_crop(&window)?));
    }
    let axes = [0, 1].map(|axis| {
        let source = given.window().cells[axis] as usize;
        GridAxis { source, offset: 0.0, step: source as f64 / f64::from(window.world.cells[axis]) }.snapped()
    });
    let mut samples = Vec::new();
    for plane in 0..given.planes() {
        let resampled = resample(given.plane(plane), axes, window.origin, window.cells, None, &|| job.check())?;
        if samples.is_empty() {
            samples = resampled
        } else {
            samples.extend(resampled)
        }
        job.advance((plane + 1) as f32 / given.planes() as f32)?;
    }
    Ok(Outputs::one("value", Field::with_planes(window, given.planes(), samples)))
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Evaluator, EvaluatorOptions, Given, Graph, Instance, Port, World};

    use super::*;
    use crate::{filter, registry};

    const WORLD: World = World { size: [640.0, 320.0], cells: [64, 32], ..DEFAULT };
    const DEFAULT: World = World {
        size: [1.0; 2],
        cells: [1; 2],
        seed: 0,
        boundary: orograph_graph::Boundary::all(orograph_graph::Edge::Open),
        sea_level: None,
        place: None,
    };

    fn field(cells: [u32; 2], of: impl Fn(usize) -> f32) -> Field {
        let window = Window::whole(World { cells, ..WORLD });
        Field::new(window, (0..window.len()).map(of).collect())
    }

    /// A graph with a given raster instead of the first node, and its output.
    fn graph(field: Field) -> (Graph, Port) {
        let mut graph = Graph::default();
        let kind = registry().get("Constant").expect("a node");
        let node = graph.add(Instance::new("a", kind)).expect("added");
        let slope = graph.add(Instance::new("b", &filter::blur::NODE)).expect("added");
        let a = Port { node, output: 0 };
        graph.connect(a, slope, filter::blur::NODE.inputs[0].name).expect("wired");
        let given = Given::new(field, PortType::Height).expect("a height");
        let port = graph.add_given("a.height", &GIVEN, given).expect("added");
        graph.redirect(a, port).expect("the same type");
        (graph, Port { node: slope, output: 0 })
    }

    #[test]
    fn samples_pass_without_a_copy() {
        let raster = field(WORLD.cells, |at| at as f32);
        let (graph, _) = graph(raster.clone());
        let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("threads");
        let port = graph.port("a").expect("a node");
        let port = Port { node: graph.find("a.height").expect("a node"), ..port };
        let values = evaluator.values(&graph, ".".as_ref(), &[port], Window::whole(WORLD)).expect("evaluates");
        let out = values[0].as_field().expect("a raster");
        assert_eq!(out.samples().as_ptr(), raster.samples().as_ptr());
    }

    #[test]
    fn keys_follow_the_content() {
        let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("threads");
        let key = |field: Field| {
            let (graph, port) = graph(field);
            evaluator.key(&graph, ".".as_ref(), port, Window::whole(WORLD)).expect("a key")
        };
        let first = key(field([64, 32], |at| at as f32));
        assert_eq!(first, key(field([64, 32], |at| at as f32)));
        assert_ne!(first, key(field([64, 32], |at| if at == 2047 { 0.0 } else { at as f32 })));
        assert_ne!(key(field([32, 16], |_| 1.0)), key(field([16, 8], |_| 1.0)));
    }

    /// Windows and coarser worlds get the same raster.
    #[test]
    fn other_cells_are_resampled() {
        let (graph, _) = graph(field([32, 16], |at| (at % 32) as f32));
        let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("threads");
        let port = Port { node: graph.find("a.height").expect("a node"), output: 0 };
        let on = |window| {
            let values = evaluator.values(&graph, ".".as_ref(), &[port], window).expect("evaluates");
            values[0].as_field().expect("a raster").clone()
        };
        let fine = on(Window::whole(WORLD));
        assert_eq!(fine.range(0), Some((0.0, 31.0)));
        let part = Window { world: WORLD, origin: [7, 5], cells: [11, 9] };
        assert_eq!(on(part), fine.crop(&part));
        let coarse = on(Window::whole(World { cells: [16, 8], ..WORLD }));
        assert_eq!(coarse.samples()[..3], [0.5, 2.5, 4.5]);
    }

    #[test]
    fn rasters_that_no_node_may_return_are_refused() {
        let holed = field([64, 32], |at| if at == 70 { f32::NAN } else { 0.0 });
        assert_eq!(Given::new(holed, PortType::Height).err().as_deref(), Some("has NaN in row 1, column 6"));
        let flat = field([64, 32], |_| 0.0);
        assert!(Given::new(flat.clone(), PortType::Colour).is_err_and(|wrong| wrong.contains("has 1 planes")));
        assert!(Given::new(flat, PortType::Lines).is_err());
    }
}
