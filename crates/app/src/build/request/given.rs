//! Arrays that a program gives to a request, instead of what nodes would compute.

use std::sync::Arc;

use orograph_graph::{Document, Expanded, Field, Given, Graph, GraphError, Port, PortType, Window, World, closest};
use orograph_nodes::import::given::GIVEN;

use super::Request;
use crate::report::failure::Failure;

/// An array of a program: rows and columns, after planes if there are several. Row 0 is north, column 0 west.
#[derive(Clone, Debug)]
pub struct Array {
    /// Its shape.
    pub shape: Vec<usize>,
    /// Its samples, the last index of the shape fastest.
    pub samples: Vec<f32>,
}

impl Request {
    /// Gives an array over the whole world to an input that the file exposes, or instead of an output of one of its
    /// nodes (`node`, `node.output`). If its cells are not those of the world, it is resampled.
    ///
    /// # Errors
    /// When there is nothing of that name, or the array does not fit.
    pub fn give(&mut self, name: &str, array: Array) -> Result<(), Failure> {
        let expanded = self.document.expand();
        let wrong = |text: String| Failure::wrong(format!("the array for `{name}` {text}"));
        let refused = |error: GraphError| wrong(format!("cannot be used: {error}"));
        let mut graph = Graph::clone(&self.graph);
        if let Some(input) = self.document.inputs().iter().find(|input| input.name == name) {
            let ty = if input.ty == PortType::AnyScalar { PortType::Height } else { input.ty };
            let given = self.given(array, ty).map_err(wrong)?;
            let port = graph.add_given(&format!("inputs.{name}"), &GIVEN, given).map_err(refused)?;
            for place in &input.places {
                let node = self.placed(&expanded, Port { node: place.node, output: 0 }).map_err(wrong)?.node;
                graph.connect(port, node, place.name).map_err(refused)?;
            }
        } else {
            let port = self.document.graph().port(name).map_err(|error| self.unknown(name, &error))?;
            let port = self.placed(&expanded, port).map_err(wrong)?;
            let given = self.given(array, graph.output_type(port)).map_err(wrong)?;
            let new = graph.add_given(&graph.port_name(port), &GIVEN, given).map_err(refused)?;
            graph.redirect(port, new).map_err(refused)?;
            self.outputs.iter_mut().filter(|output| output.port == port).for_each(|output| output.port = new);
        }
        self.graph = Arc::new(graph);
        Ok(())
    }

    fn unknown(&self, name: &str, error: &GraphError) -> Failure {
        let failure = Failure::wrong(error.to_string());
        let inputs = self.document.inputs().iter().map(|input| input.name.as_str());
        match closest(name, inputs) {
            Some(near) => failure.hint(format!("did you mean the input `{near}`?")),
            None => failure.hint("name an input that the file exposes, a node, or `node.output`"),
        }
    }

    /// A port of the document in the graph that is built.
    fn placed(&self, expanded: &Expanded, port: Port) -> Result<Port, String> {
        let document: &Document = &self.document;
        let instance = document.graph().instance(port.node);
        if instance.node.is_subgraph() {
            return Err(format!("would change `{}`, which is a graph file; name a node of this file", instance.name));
        }
        if document.is_muted(port.node) {
            return Err(format!("would change `{}`, which is muted", instance.name));
        }
        expanded.port(port).ok_or_else(|| format!("would change `{}`, which is not built", instance.name))
    }

    /// The array as a raster of this type.
    fn given(&self, Array { shape, samples }: Array, ty: PortType) -> Result<Arc<Given>, String> {
        let [nx, ny] = self.world.cells;
        let shaped = || format!("has the shape {}", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(" x "));
        let (planes, rows, columns) = match *shape {
            [rows, columns] => (1, rows, columns),
            [planes, rows, columns] => (planes, rows, columns),
            _ => return Err(format!("{}; it needs rows and columns, or planes, rows and columns", shaped())),
        };
        let of_world = || format!("rows and columns in the ratio of the world's {ny} x {nx} cells");
        let cells = [columns, rows].map(|count| u32::try_from(count).unwrap_or(u32::MAX));
        if u64::from(cells[0]) * u64::from(ny) != u64::from(cells[1]) * u64::from(nx) {
            return Err(format!("{}; it needs {}", shaped(), of_world()));
        }
        let world = World { cells, ..self.world };
        world.check().map_err(|error| format!("{}: {error}", shaped()))?;
        if planes * rows * columns != samples.len() {
            return Err(format!("{}, but {} samples", shaped(), samples.len()));
        }
        if ty == PortType::Mask && samples.iter().any(|sample| !(0.0..=1.0).contains(sample) && sample.is_finite()) {
            return Err("has numbers outside of 0 to 1, the range of a mask".to_owned());
        }
        Given::new(Field::with_planes(Window::whole(world), planes, samples), ty)
    }
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Evaluator, EvaluatorOptions};

    use super::*;
    use crate::build::request::Changes;

    const SOURCE: &str = r#"(
        world: (size: (400, 200), cells: (4, 2)),
        inputs: { "land": "sum.a" },
        nodes: {
            "base": Constant(value: 5),
            "cover": Import(version: 2, quantity: mask),
            "sum": Combine(mode: add, a: "base", b: "base", mask: "cover"),
        },
        outputs: { "height": "sum", "base": "base" },
    )"#;

    fn request() -> Request {
        let document = Document::parse(SOURCE, &orograph_nodes::registry());
        assert!(!document.has_errors(), "{:?}", document.problems());
        Request::of_document(document, &Changes::default()).expect("a request")
    }

    fn array(shape: &[usize], value: f32) -> Array {
        Array { shape: shape.to_vec(), samples: vec![value; shape.iter().product()] }
    }

    fn values(request: &Request) -> Vec<f32> {
        let evaluator = Evaluator::new(EvaluatorOptions::default()).expect("threads");
        let ports: Vec<Port> = request.outputs.iter().map(|output| output.port).collect();
        let values = evaluator.values(&request.graph, ".".as_ref(), &ports, request.window()).expect("evaluates");
        values.iter().map(|value| value.as_field().expect("a raster").samples()[5]).collect()
    }

    #[test]
    fn arrays_replace_outputs_and_feed_inputs() {
        let mut asked = request();
        // a file that is missing is not read
        asked.give("cover", array(&[2, 4], 1.0)).expect("fits");
        assert_eq!(values(&asked), [10.0, 5.0]);
        let mut replaced = asked.clone();
        replaced.give("base", array(&[4, 8], 7.0)).expect("fits");
        assert_eq!(values(&replaced), [14.0, 7.0]);
        asked.give("land", array(&[2, 4], 100.0)).expect("fits");
        assert_eq!(values(&asked), [105.0, 5.0]);
    }

    #[test]
    fn arrays_that_do_not_fit_are_refused() {
        for (name, array, said) in [
            (
                "base",
                array(&[4, 2], 0.0),
                "has the shape 4 x 2; it needs rows and columns in the ratio of the world's 2 x 4",
            ),
            ("base", array(&[8], 0.0), "has the shape 8; it needs rows and columns"),
            ("base", array(&[0, 0], 0.0), "is empty"),
            ("base", array(&[3, 2, 4], 0.0), "has 3 planes; a height (m) has 1"),
            ("base", array(&[2, 4], f32::NAN), "has NaN in row 0, column 0"),
            ("cover", array(&[2, 4], 2.0), "outside of 0 to 1"),
            ("bass", array(&[2, 4], 0.0), "did you mean `base`?"),
            ("base.area", array(&[2, 4], 0.0), "has no output `area`"),
        ] {
            let failure = request().give(name, array).expect_err(name);
            assert!(failure.message.contains(said), "{said}: {}", failure.message);
        }
    }
}
