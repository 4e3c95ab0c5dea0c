//! Tests of the document, with a few nodes that resemble real ones.

use super::*;
use crate::{
    CurvePoints, FileName, Input, MeasureSpec, Migration, Node, Output, PathPoints, PortType, Seed, Step, Unit,
};

mod costs;
mod edits;
mod effect;
mod expect;
mod extract;
mod form;
mod from;
mod fuzz;
mod hostile;
mod place;
mod reuse;
mod sea;
mod work;

#[expect(dead_code, reason = "only the declarations are looked at")]
mod nodes {
    use super::*;

    pub(super) mod ridged {
        use super::*;

        crate::choice! {
            /// A shape.
            pub enum Shape {
                /// Sharp.
                Sharp = "sharp",
                /// Billowy.
                Billow = "billow",
            }
        }

        crate::params! {
            /// Width of the largest ridges.
            wavelength: f64 = 8000.0, Metres, 1.0..=1e6;
            /// Octaves.
            octaves: i64 = 8, Count, 1..=24;
            /// Height.
            amplitude: f64 = 1000.0, Metres, 0.0..=10000.0;
            /// Shape.
            shape: Shape = Shape::Sharp, One, ..;
            /// Turned over.
            inverted: bool = false, One, ..;
            /// Seed.
            seed: Seed = Seed(0), Count, ..;
            /// Centre.
            centre: [f64; 2] = [0.0, 0.0], Metres, -1e6..=1e6;
            /// Profile.
            profile: CurvePoints = CurvePoints(vec![[0.0, 0.0], [1.0, 1.0]]), One, ..;
            /// Ridge.
            ridge: PathPoints = PathPoints(vec![[0.0, 0.0], [1.0, 1.0]]), Metres, -1e6..=1e6;
            /// File.
            file: FileName = FileName(String::new()), One, ..;
        }

        pub(in super::super) static NODE: Node = Node {
            id: "Ridged",
            params: Params::specs,
            outputs: &[
                Output::gives("height", PortType::Height, "H."),
                Output::gives("slope", PortType::Scalar(Unit::Degrees), "S."),
            ],
            ..Node::DEFAULT
        };
    }

    pub(super) mod rivers {
        use super::*;

        crate::params! {
            /// How long.
            duration: f64 = 1e6, Years, 0.0..=1e9;
            /// Exponent.
            m: f64 = 0.5, One, 0.0..=2.0;
        }

        pub(in super::super) static NODE: Node = Node {
            id: "StreamPower",
            params: Params::specs,
            inputs: &[
                Input::needs("height", PortType::Height, "H."),
                Input::number("erodibility", Unit::Erodibility, 2e-6, [0.0, 1.0], [0.0, 1e-4], "K."),
                Input::mask("mask", "M."),
            ],
            outputs: &[
                Output::same_as("height", "height", "H."),
                Output::gives("area", PortType::Scalar(Unit::SquareMetres), "A."),
            ],
            ..Node::DEFAULT
        };
    }

    pub(super) mod thermal {
        use super::*;

        crate::params! {
            /// Steps.
            passes: i64 = 60, Count, 0..=5000;
            /// Share.
            share: f64 = 0.25, One, 0.0..=0.5;
        }

        pub(in super::super) static NODE: Node = Node {
            id: "Thermal",
            version: 3,
            migrations: &[
                Migration {
                    from: 1,
                    steps: &[Step::Rename { from: "angle", to: "talus" }, Step::Keep { name: "passes", value: "40" }],
                },
                Migration {
                    from: 2,
                    steps: &[Step::Scale { name: "share", factor: 0.01 }, Step::Drop { name: "gpu" }],
                },
            ],
            params: Params::specs,
            inputs: &[
                Input::needs("height", PortType::Height, "H."),
                Input::number("talus", Unit::Degrees, 35.0, [5.0, 80.0], [20.0, 45.0], "T."),
            ],
            outputs: &[Output::same_as("height", "height", "H.")],
            ..Node::DEFAULT
        };
    }

    pub(super) mod coast {
        use super::*;

        crate::params! {
            /// Slope.
            slope: f64 = 0.1, One, 0.0..=1.0;
        }

        /// A kind that once had its own sea level.
        pub(in super::super) static NODE: Node = Node {
            id: "Coast",
            version: 3,
            migrations: &[
                Migration { from: 1, steps: &[Step::Rename { from: "water", to: "sea_level" }] },
                Migration { from: 2, steps: &[Step::SeaLevel { name: "sea_level", none: -12_000.0 }] },
            ],
            params: Params::specs,
            inputs: &[Input::needs("height", PortType::Height, "H.")],
            outputs: &[Output::same_as("height", "height", "H.")],
            reads_sea: true,
            ..Node::DEFAULT
        };
    }

    pub(super) static METRICS: Node = Node {
        id: "Metrics",
        category: "measure",
        measures: &[
            MeasureSpec { name: "relief", unit: "m", doc: "R." },
            MeasureSpec { name: "hypsometric_integral", unit: "", doc: "H." },
            MeasureSpec { name: "slope.p50", unit: "°", doc: "S." },
            MeasureSpec { name: "drainage_density", unit: "km/km²", doc: "D." },
        ],
        inputs: &[Input::needs("height", PortType::AnyScalar, "H."), Input::takes("mask", PortType::Mask, "M.")],
        outputs: &[Output::gives("report", PortType::Report, "R.")],
        ..Node::DEFAULT
    };

    pub(super) static FLOW: Node = Node {
        id: "Flow",
        inputs: &[Input::needs("height", PortType::Height, "H.")],
        outputs: &[
            Output::gives("area", PortType::Scalar(Unit::SquareMetres), "A."),
            Output::gives("flow", PortType::Flow, "F."),
            Output::gives("filled", PortType::Height, "H."),
        ],
        ..Node::DEFAULT
    };
}

pub(super) fn registry() -> Registry {
    Registry::new([
        &nodes::ridged::NODE,
        &nodes::rivers::NODE,
        &nodes::thermal::NODE,
        &nodes::coast::NODE,
        &nodes::METRICS,
        &nodes::FLOW,
    ])
}

/// The example for which the file format was designed.
pub(super) const ALPS: &str = r#"// An alpine range: ridges, carved by rivers.
(
    format: 1,
    world: (size: (16384, 16384), cells: (1024, 1024), seed: 7),
    nodes: {
        "base":   Ridged(wavelength: 6000, octaves: 12, amplitude: "2.4 km"),
        // hard granite in the middle
        "rivers": StreamPower(height: "base", erodibility: 4e-6, duration: 2e6), // two million years
        "scree":  Thermal(version: 3, height: "rivers.height", talus: 33),
        "report": Metrics(height: "scree"),
    },
    outputs: { "height": "scree", "flow": "rivers.area", "metrics": "report" },
    // as high as the Alps, and as steep
    expect: { "cell": "90 m", "relief": ("2 km", inf), "slope.p50": (23, 32) },
    layout: { "base": (0, 0), "rivers": (240, 80), "scree": (480, 80), "report": (720, 80) },
)
"#;

fn parse(source: &str) -> Document {
    Document::parse(source, &registry())
}

/// Problems of a file with these nodes and an output of `a`, as `code: message`.
fn errors(nodes: &str) -> Vec<String> {
    let document = parse(&format!("(nodes: {{ {nodes} }}, outputs: {{ \"o\": \"a\" }})"));
    document.problems().iter().map(|p| format!("{}: {}", p.code, p.message)).collect()
}

#[test]
fn a_valid_file_becomes_a_graph() {
    let document = parse(ALPS);
    assert_eq!(document.problems(), []);
    let graph = document.graph();
    assert_eq!(document.world(), World { seed: 7, ..World::default() });
    assert_eq!(
        document.nodes().iter().map(|n| n.name.as_str()).collect::<Vec<_>>(),
        ["base", "rivers", "scree", "report"]
    );
    let base = graph.instance(graph.find("base").expect("exists"));
    assert_eq!(base.params.read::<f64>("amplitude"), 2400.0);
    assert_eq!(base.params.read::<i64>("octaves"), 12);
    let rivers = graph.find("rivers").expect("exists");
    assert_eq!(graph.instance(rivers).constants, [None, Some(4e-6), None]);
    assert_eq!(graph.source(rivers, 0).map(|p| graph.port_name(p)), Some("base.height".into()));
    let outputs: Vec<_> = document.outputs().iter().map(|o| (o.name.as_str(), graph.port_name(o.port), o.ty)).collect();
    assert_eq!(
        outputs,
        [
            ("height", "scree.height".into(), PortType::Height),
            ("flow", "rivers.area".into(), PortType::Scalar(Unit::SquareMetres)),
            ("metrics", "report.report".into(), PortType::Report),
        ]
    );
    assert_eq!(document.nodes()[1].layout, Some([240.0, 80.0]));
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_a_run() {
    let source = r#"(nodes: { "base": Ridged, "water": Flow(height: "base") }, outputs: { "o": "water.flow" })"#;
    let document = parse(source);
    let [problem] = document.problems() else { panic!("one problem: {:?}", document.problems()) };
    assert_eq!(
        (problem.code, problem.message.as_str()),
        ("not-writable", "output `o` is a flow, which cannot be written to a file")
    );
    assert_eq!(problem.hint.as_deref(), Some("write `water.area` or `water.filled`"));
    assert_eq!(parse(&source.replace("water.flow", "water.area")).problems(), []);
}

#[test]
fn six_mistakes_are_six_problems() {
    let document = parse(
        r#"(
    format: 1,
    nodes: {
        "base":   Ridged(wavelenght: 6000, octaves: 99),
        "rivers": Streampower(height: "base"),
        "scree":  Thermal(version: 3, height: "rivers.height", talus: "33 km"),
        "more":   Thermal(version: 3, height: "base.slope"),
        "report": Metrics(height: "scre"),
    },
    outputs: { "height": "scree", "metrics": "report" },
)"#,
    );
    let found: Vec<_> =
        document.problems().iter().map(|p| (p.line_column(document.source()), p.message.as_str())).collect();
    assert_eq!(
        found,
        [
            ((4, 26), "`base` (Ridged) has no input or parameter `wavelenght`"),
            ((4, 53), "`base.octaves` is 99, but must be a whole number from 1 to 24"),
            ((5, 19), "unknown node `Streampower`"),
            (
                (6, 71),
                "`scree.talus` cannot be read: `km` is not a unit of an angle in °; write one of `°`, `deg`, `rad`"
            ),
            ((7, 47), "`base.slope` gives a scalar (°), but `more.height` takes a height (m)"),
            ((8, 35), "`report.height` is wired to `scre`, but there is no node `scre`"),
        ]
    );
    let hints: Vec<_> = document.problems().iter().filter_map(|p| p.hint.as_deref()).collect();
    assert_eq!(hints[0], "did you mean `wavelength`?");
    assert!(hints.contains(&"did you mean `StreamPower`?") && hints.contains(&"`base.height` would fit"), "{hints:?}");
}

#[test]
fn every_kind_of_mistake_is_one_problem_with_its_code() {
    for (nodes, expected) in [
        (r#""a": Ridged, "a": Ridged"#, "duplicate: `a` appears twice in `nodes`"),
        (r#""a": Ridged(octaves: 3, octaves: 4)"#, "duplicate: `octaves` appears twice in `a`"),
        (r#""a": Ridged(3)"#, "unnamed: found a value without a name in `a`"),
        (r#""a": Metrics"#, "unwired: `a` (Metrics) needs a wire into `height`"),
        (
            r#""a": Metrics(heigth: "b"), "b": Ridged"#,
            "unknown-parameter: `a` (Metrics) has no input or parameter `heigth`",
        ),
        (
            r#""a": Metrics(height: 3)"#,
            "type: `a.height` is the number `3`, but takes a wire from a height, mask or scalar",
        ),
        (
            r#""a": Metrics(height: "b.heigth"), "b": Ridged"#,
            "unknown-port: `a.height` is wired to `b.heigth`, but `b` (Ridged) has no output `heigth`",
        ),
        (r#""a": Metrics(height: "b"), "b": Nonsense"#, "unknown-node: unknown node `Nonsense`"),
        (r#""a": Metrics(height: "b"), "b": 3"#, "type: `b` is the number `3`, but takes a node such as `Perlin(…)`"),
        (
            r#""a": StreamPower(height: "b"), "b": StreamPower(height: "c"), "c": StreamPower(height: "a")"#,
            "cycle: the wires form a cycle: a → c → b → a",
        ),
        (r#""a": StreamPower(height: "a")"#, "cycle: the wires form a cycle: a → a"),
        (r#""a": Ridged(wavelength: 1e999)"#, "value: `a.wavelength` is infinite, or too large for a number"),
        (r#""a": Ridged(wavelength: NaN)"#, "value: `a.wavelength` is not a number (NaN)"),
        (r#""a": Ridged(wavelength: -inf)"#, "value: `a.wavelength` is infinite, or too large for a number"),
        (
            r#""a": Ridged(wavelength: 0.5)"#,
            "range: `a.wavelength` is 0.5 m, but must be a length in m from 1 m to 1000 km",
        ),
        (r#""a": Ridged(wavelength: 2km)"#, "value: `a.wavelength` is `2km`, which is not a number"),
        (r#""a": Ridged(wavelength: far)"#, "type: `a.wavelength` is the word `far`, but takes a length in m"),
        (
            r#""a": Ridged(octaves: 2.5)"#,
            "type: `a.octaves` is the number `2.5`, but takes a whole number from 1 to 24",
        ),
        (r#""a": Ridged(seed: -1)"#, "range: `a.seed` is -1, but must be a whole number from 0 to 4294967295"),
        (r#""a": Ridged(shape: sharpe)"#, "type: `a.shape` is the word `sharpe`, but takes one of `sharp`, `billow`"),
        (r#""a": Ridged(inverted: 1)"#, "type: `a.inverted` is the number `1`, but takes `true` or `false`"),
        (
            r#""a": Ridged(profile: [(0, 0), (0, 1)])"#,
            "range: `a`: the points of `profile` must rise in x: 0 follows 0",
        ),
        (
            r#""a": Ridged(ridge: [("1 km", 0), (1000, 0)])"#,
            "range: `a.ridge` has the same place twice in a row: (1000, 0)",
        ),
        (
            r#""a": Ridged(ridge: (1, 0))"#,
            "type: `a.ridge` is 2 items in round brackets, but takes a list of places `[(x, y), ...]`, each a length in m \
             from -1000 km to 1000 km",
        ),
        (
            r#""a": Ridged(file: x)"#,
            "type: `a.file` is the word `x`, but takes a file name in quotes, relative to the graph file",
        ),
        (
            r#""a": Thermal(version: 4, height: "b"), "b": Ridged"#,
            "version: `a` (Thermal) has version 4, but this program supports versions up to 3",
        ),
        (r#""a": Ridged(version: 0)"#, "version: the version of `a` is not a whole number of at least 1"),
        (
            r#""a": StreamPower(height: "b", mask: 1.5), "b": Ridged"#,
            "range: `a.mask` is 1.5, but must be a mask from 0 to 1",
        ),
        (
            r#""a": StreamPower(height: "b", erodibility: base), "b": Ridged"#,
            "type: `a.erodibility` is the word `base`, but takes an erodibility in m^(1−2m)/yr",
        ),
        (r#""a": Ridged(octaves: 3; amplitude: 5)"#, "syntax: `;` has no meaning here"),
        (r#""a": Ridged(octaves: 3 amplitude: 5)"#, "syntax: a comma is missing"),
        (r#""a": Ridged, "b c": Ridged"#, "name: `b c` cannot name a node"),
    ] {
        assert_eq!(errors(nodes), [expected], "{nodes}");
    }
    assert_eq!(
        errors(r#""a": Ridged, "b": StreamPower(height: "b"), "c": StreamPower(height: "d"), "d": StreamPower(height: "c")"#).len(),
        2,
        "two cycles are two problems"
    );
}

#[test]
fn wires_from_outside_a_part_of_a_file_are_listed() {
    let source =
        r#"(nodes: { "a": StreamPower(height: "x.height", uplift: 0.001), "b": Metrics(height: "a", mask: "y") })"#;
    let document = Document::parse(source, &registry());
    let loose: Vec<[&str; 3]> =
        document.loose_wires().iter().map(|wire| [wire.node.as_str(), wire.input, wire.from.as_str()]).collect();
    assert_eq!(loose, [["a", "height", "x.height"], ["b", "mask", "y"]]);
}

#[test]
fn consequences_of_a_mistake_are_not_reported() {
    // The type of `b` is unknown, so the wire from it is not reported.
    assert_eq!(
        errors(r#""a": Metrics(height: "c", mask: "b"), "b": StreamPower(height: "x"), "c": Ridged"#),
        ["unknown-wire: `b.height` is wired to `x`, but there is no node `x`"]
    );
    // Wires are checked from the sources on, whatever the order in the file.
    assert_eq!(errors(r#""a": StreamPower(height: "b"), "b": StreamPower(height: "c"), "c": Ridged"#), [""; 0]);
}

#[test]
fn problems_outside_nodes_are_found() {
    let one = |source: &str| {
        let document = parse(source);
        let found: Vec<_> = document.problems().iter().map(|p| p.message.clone()).collect();
        assert_eq!(found.len(), 1, "{source}: {found:?}");
        found[0].clone()
    };
    let world =
        |world: &str| one(&format!("(world: {world}, nodes: {{ \"a\": Ridged }}, outputs: {{ \"o\": \"a\" }})"));
    assert_eq!(one(""), "the file is empty");
    assert_eq!(one("[1]"), "a graph file begins with `(`");
    assert_eq!(one("(format: 2, nodez: 3)"), "the file has format 2, but this program reads formats up to 1");
    assert_eq!(one("(nodes: {}, outputs: {})"), "the file has no outputs, so a run writes nothing");
    assert_eq!(
        one("(format: 0.5, nodes: {\"a\": Ridged}, outputs: {\"a\": \"a\"})"),
        "`format` is the number `0.5`, but takes a whole number from 1"
    );
    assert!(one("(nodes: {\"a\": Ridged}, outputs: {\"o\": \"b\"})").contains("output `o` is wired to `b`"));
    assert!(one("(nodes: {\"a\": Ridged}, outputs: {\"o\": 3})").contains("takes a node, or one of its outputs"));
    assert!(one("(node: {}, nodes: {\"a\": Ridged}, outputs: {\"o\": \"a\"})").contains("has no field `node`"));
    assert!(one("(nodes: {\"a\": Ridged}, outputs: {\"../o\": \"a\"})").contains("cannot name an output"));
    assert_eq!(
        one("(nodes: {\"a\": Ridged}, outputs: {\"o\": \"a\"}, layout: {\"b\": (0, 0)})"),
        "`layout` places `b`, but there is no such node"
    );
    assert!(world("(cells: 0)").contains("give it at least 1 x 1"));
    assert!(world("(cells: (1000000000, 1000000000))").contains("EiB"), "names the memory it would take");
    assert!(world("(cells: 99999999999)").contains("GiB"));
    assert!(world("(cells: (1024, 512))").contains("must be square"));
    assert!(world("(size: (1, -3))").contains("has no extent"));
    assert!(world("(size: 1e-30)").contains("are too small; the smallest are 0.000001 m"));
    assert!(world("(size: \"200000 km\")").contains("is too large; the longest is 100000000 m"));
    assert!(world("(size: \"16 yr\")").contains("is not a unit of a length"));
    assert!(world("(boundary: bse)").contains("`wall`"));
    assert!(world("(boundary: (west: periodic))").contains("opposite side"));
    assert!(world("(sizes: 3)").contains("has no field `sizes`"));
    let read = parse("(world: (size: (\"16 km\", 8000), cells: 1000, boundary: (west: wall)), nodes: {}, outputs: {})")
        .world();
    assert_eq!((read.size, read.cells, read.boundary.west.name()), ([16e3, 8e3], [1000, 500], "wall"));
}

/// Whoever writes a node by hand expects the defaults of the manual.
#[test]
fn a_node_without_a_version_has_a_warning_if_its_first_version_differs() {
    let document = parse(
        r#"(nodes: {
        "base": Ridged,
        "old": Thermal(height: "base"),
        "first": Thermal(version: 1, height: "base"),
    }, outputs: { "o": "old" })"#,
    );
    assert_eq!(document.problems().len(), 1, "{:?}", document.problems());
    let problem = &document.problems()[0];
    assert!(!document.has_errors() && problem.message.starts_with("`old` has no `version`"), "{problem:?}");
    assert!(problem.hint.as_ref().is_some_and(|hint| hint.contains("`Thermal(version: 3, …)`")), "{problem:?}");
}

#[test]
fn older_versions_of_nodes_are_migrated() {
    let document = parse(
        r#"(nodes: {
        "base": Ridged,
        "one": Thermal(version: 1, height: "base", angle: 30, share: 20, gpu: true),
        "two": Thermal(version: 2, height: "base", talus: 30),
    }, outputs: { "o": "one" })"#,
    );
    assert_eq!(document.problems(), []);
    let instance = |name: &str| document.graph().instance(document.graph().find(name).expect("exists")).clone();
    let (one, two) = (instance("one"), instance("two"));
    assert_eq!(
        (one.constants[1], one.params.read::<i64>("passes"), one.params.read::<f64>("share")),
        (Some(30.0), 40, 0.2)
    );
    assert_eq!((two.constants[1], two.params.read::<i64>("passes")), (Some(30.0), 60));
}

#[test]
fn files_are_loaded_and_saved_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("g.ron");
    let load = |path: &std::path::Path| Document::load(path, &registry()).map(|_| ()).expect_err("refused").to_string();
    assert!(load(&path).contains("there is no file"));
    assert!(load(folder.path()).contains("is a folder"));
    std::fs::write(&path, b"(\xff)").expect("written");
    assert!(load(&path).contains("byte 1 is not"));
    std::fs::write(&path, vec![b' '; (16 << 20) + 1]).expect("written");
    assert!(load(&path).contains("more than 16.0 MiB"));
    parse(ALPS).save(&path).expect("saved");
    let again = Document::load(&path, &registry()).expect("loaded");
    assert_eq!(again.source(), ALPS);
    assert!(again.save(folder.path().join("nowhere/g.ron")).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 1, "no temporary file is left");
}

#[test]
fn what_is_accepted_is_ron() {
    assert!(ron2::ast::parse_document(ALPS).is_ok());
}
