//! The content of a manual page as data; serialised, it is the page in JSON.

use std::path::Path;

use orograph_graph::{
    Document, Exactness, Expectation, Expectations, Fallback, Input, Kind, MeasureSpec, Node, OutputType, ParamSpec,
    ParamValue, ParamValues, PortType, Reach, Resolution, SUBGRAPH, Unit, World,
};
use serde::Serialize;
use serde_json::{Value, json};

/// The page of a node type.
#[derive(Debug, Serialize)]
pub struct NodePage {
    pub id: &'static str,
    pub version: u32,
    pub category: &'static str,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    pub aliases: &'static [&'static str],
    pub summary: &'static str,
    pub doc: &'static str,
    pub inputs: Vec<PageEntry>,
    pub parameters: Vec<PageEntry>,
    pub outputs: Vec<PageEntry>,
    /// The measures in its reports.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    pub measures: &'static [MeasureSpec],
    /// How far around a cell it reads, as text.
    pub reach: String,
    /// How exactly its result is reproduced on other machines, as text.
    pub exactness: String,
    /// How results at different cell sizes are related, as text.
    pub resolution: String,
    pub sources: &'static [&'static str],
    /// An example entry of a graph file.
    pub example: String,
    /// True if it has a picture in the manual: its first output is a raster.
    #[serde(skip)]
    pub pictured: bool,
}

/// An input, a parameter or an output.
#[derive(Debug, Serialize)]
pub struct PageEntry {
    pub name: &'static str,
    /// The type of a port or the kind of a parameter.
    #[serde(rename = "type")]
    pub ty: String,
    /// Symbol of the unit; empty for pure numbers.
    pub unit: &'static str,
    /// True if the input must be wired.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub required: bool,
    /// The default value, in base units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub default: Option<Value>,
    /// The allowed range, in base units; null for an open end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// The usual range, in base units.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub usual: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<Choice>,
    /// The only settings with which it has an effect, as text.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub when: Vec<String>,
    pub doc: &'static str,
    /// The default, as text with its unit.
    #[serde(skip)]
    pub default_text: String,
    /// The range, as text with its unit.
    #[serde(skip)]
    pub range_text: String,
    /// The usual range, as text with its unit; empty if it is the whole range.
    #[serde(skip)]
    pub usual_text: String,
}

/// An option of a choice.
#[derive(Debug, Serialize)]
pub struct Choice {
    pub name: &'static str,
    pub doc: &'static str,
}

impl NodePage {
    /// The page of a node.
    pub fn of(node: &'static Node) -> Self {
        let params = ParamValues::defaults(&node.specs());
        Self {
            id: node.id,
            version: node.version,
            category: node.category,
            aliases: node.aliases,
            summary: node.summary,
            doc: node.doc,
            inputs: node.inputs.iter().map(PageEntry::input).collect(),
            parameters: node.specs().iter().map(PageEntry::parameter).collect(),
            outputs: node
                .outputs
                .iter()
                .map(|output| {
                    let (ty, unit) = output_type(output.ty, &params);
                    PageEntry { ty, unit, ..PageEntry::blank(output.name, output.doc) }
                })
                .collect(),
            measures: node.measures,
            reach: match node.is_subgraph() {
                true => "what the nodes of the file read".to_owned(),
                false => reach(node.reach, &params),
            },
            exactness: match node.exactness {
                Exactness::Exact => {
                    let everywhere = "the same bits on every machine and with any number of threads";
                    match node.gpu {
                        Some(_) => format!("{everywhere}; on a graphics card within a stated tolerance"),
                        None => everywhere.to_owned(),
                    }
                }
                Exactness::Within { tolerance, why } => format!("equal everywhere within {tolerance:e}: {why}"),
            },
            resolution: match node.resolution {
                Resolution::Within(share) => {
                    format!("the same terrain at every cell size, within {} % of its standard deviation", share * 100.0)
                }
                Resolution::Cells(why) => format!("the result depends on the cell size: {why}"),
            },
            sources: node.sources,
            example: format!("\"{}\": {}", node.id.to_lowercase(), node.written(node.example)),
            pictured: is_pictured(node),
        }
    }
}

/// Returns true if an output of a node is a raster.
pub fn is_pictured(node: &Node) -> bool {
    let is_raster = |ty: &OutputType| match ty {
        OutputType::Fixed(ty) => ty.planes().is_some(),
        OutputType::SameAs(_) | OutputType::Chosen(_) => true,
    };
    !node.is_subgraph() && node.outputs.iter().any(|output| is_raster(&output.ty))
}

/// The declarations of a graph file, as the event of `check --json --describe`.
#[derive(Debug, Serialize)]
pub struct GraphPage {
    pub event: &'static str,
    pub file: String,
    /// The description of the file.
    pub about: String,
    pub size_m: [f64; 2],
    pub cells: [u32; 2],
    pub seed: u32,
    /// Elevation of the sea, if there is one.
    pub sea_level_m: Option<f64>,
    pub inputs: Vec<PageEntry>,
    pub parameters: Vec<PageEntry>,
    pub outputs: Vec<PageEntry>,
    /// What must hold when it is run, if it states anything.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expect: Option<ExpectPage>,
    /// The files that it reads.
    pub uses: Vec<String>,
}

impl GraphPage {
    /// The page of a document without errors.
    pub fn of(document: &Document, file: &Path) -> Self {
        let NodePage { inputs, mut parameters, outputs, .. } = NodePage::of(document.declaration());
        parameters.drain(..SUBGRAPH.specs().len());
        let World { size, cells, seed, sea_level, .. } = document.world();
        Self {
            event: "described",
            file: file.display().to_string(),
            about: document.about(),
            size_m: size,
            cells,
            seed,
            sea_level_m: sea_level,
            inputs,
            parameters,
            outputs,
            expect: document.expectations().map(|expected| ExpectPage::of(expected)),
            uses: document.files().iter().map(|file| file.display().to_string()).collect(),
        }
    }
}

/// What a graph file expects of its terrain.
#[derive(Debug, Serialize)]
pub struct ExpectPage {
    /// The output that is measured; null if the file has none.
    pub output: Option<String>,
    /// The part of the world that is measured, in metres: x, y, width and height; null for the whole.
    pub part_m: Option<[f64; 4]>,
    /// Side of the cells on which it is measured; null for those of the world.
    pub cell_m: Option<f64>,
    pub measures: Vec<ExpectEntry>,
}

/// A measure that must lie within bounds.
#[derive(Debug, Serialize)]
pub struct ExpectEntry {
    #[serde(flatten)]
    pub measure: &'static MeasureSpec,
    /// In the unit of the measure; null for an open side.
    pub bounds: [f64; 2],
    /// The bounds, as text with their unit.
    #[serde(skip)]
    pub bounds_text: String,
}

impl ExpectPage {
    fn of(expected: &Expectations) -> Self {
        let entry = |one: &Expectation| ExpectEntry {
            measure: one.measure,
            bounds: one.bounds,
            bounds_text: one.bounds_text(),
        };
        Self {
            output: expected.output.clone(),
            part_m: expected.part_m,
            cell_m: expected.cell_m,
            measures: expected.list.iter().map(entry).collect(),
        }
    }
}

impl PageEntry {
    const fn blank(name: &'static str, doc: &'static str) -> Self {
        Self {
            name,
            ty: String::new(),
            unit: "",
            required: false,
            default: None,
            range: None,
            usual: None,
            choices: Vec::new(),
            when: Vec::new(),
            doc,
            default_text: String::new(),
            range_text: String::new(),
            usual_text: String::new(),
        }
    }

    fn input(input: &Input) -> Self {
        let unit = input.ty.unit();
        let mut entry = Self { ty: input.ty.to_string(), unit: unit.symbol(), ..Self::blank(input.name, input.doc) };
        match input.fallback {
            Fallback::Required => entry.required = true,
            Fallback::None => {}
            Fallback::Constant { default, hard, soft } => {
                entry.default = Some(json!(default));
                entry.default_text = unit.display(default);
                entry.ranges(unit, hard, soft);
            }
        }
        entry
    }

    fn parameter(spec: &ParamSpec) -> Self {
        let when = spec.when.iter().map(ToString::to_string).collect();
        let mut entry = Self { unit: spec.unit.symbol(), when, ..Self::blank(spec.name, spec.doc) };
        let default = spec.kind.default_value();
        entry.default = Some(value(&default));
        entry.default_text = default.to_string();
        match &spec.kind {
            Kind::Float { default, hard, soft } => {
                entry.ty = "number".into();
                entry.default_text = spec.unit.display(*default);
                entry.ranges(spec.unit, *hard, *soft);
            }
            Kind::Int { hard, soft, .. } => {
                entry.ty = "integer".into();
                entry.ranges(spec.unit, hard.map(|v| v as f64), soft.map(|v| v as f64));
            }
            Kind::Bool { .. } => entry.ty = "true or false".into(),
            Kind::Choice { default, options } => {
                entry.ty = "choice".into();
                entry.default_text = (*default).to_owned();
                entry.choices = options.iter().map(|(name, doc)| Choice { name, doc }).collect();
            }
            Kind::Seed { .. } => entry.ty = "seed".into(),
            Kind::Point { default, hard, .. } => {
                entry.ty = "point (x, y)".into();
                entry.default_text = format!("({}, {})", spec.unit.display(default[0]), spec.unit.display(default[1]));
                entry.ranges(spec.unit, *hard, *hard);
            }
            Kind::Curve { .. } => entry.ty = "curve".into(),
            Kind::Path { hard, .. } => {
                entry.ty = "path [(x, y), ...]".into();
                entry.ranges(spec.unit, *hard, *hard);
            }
            Kind::Waypoints { hard, .. } => {
                entry.ty = "path [(x, y), (at, height, width), ...]".into();
                entry.ranges(spec.unit, *hard, *hard);
            }
            Kind::Stops { .. } => entry.ty = "colours [(value, \"#rrggbb\"), ...]".into(),
            Kind::Layers { .. } => entry.ty = "layers [(thickness, hardness, repose, colour), ...]".into(),
            Kind::Strokes { hard, timed } => {
                let time = if *timed { "time, " } else { "" };
                entry.ty = format!("strokes [(tool, radius, {time}points, ...), ...]");
                entry.ranges(spec.unit, *hard, *hard);
            }
            Kind::File => {
                entry.ty = "file".into();
                entry.default = None;
                entry.default_text = String::new();
            }
        }
        entry
    }

    fn ranges(&mut self, unit: Unit, hard: [f64; 2], soft: [f64; 2]) {
        self.range = Some(hard);
        self.range_text = between(hard, unit);
        if soft != hard {
            self.usual = Some(soft);
            self.usual_text = between(soft, unit);
        }
    }
}

/// A range as text: `1 m to 1000 km`.
fn between([lo, hi]: [f64; 2], unit: Unit) -> String {
    match (lo.is_finite(), hi.is_finite()) {
        (true, true) => format!("{} to {}", unit.display(lo), unit.display(hi)),
        (true, false) => format!("{} or more", unit.display(lo)),
        (false, true) => format!("{} or less", unit.display(hi)),
        (false, false) => "any".to_owned(),
    }
}

fn value(value: &ParamValue) -> Value {
    match value {
        ParamValue::Float(v) => json!(v),
        ParamValue::Int(v) => json!(v),
        ParamValue::Bool(v) => json!(v),
        ParamValue::Choice(v) => json!(v),
        ParamValue::Seed(v) => json!(v),
        ParamValue::Point(v) => json!(v),
        ParamValue::Curve(v) | ParamValue::Path(v) => json!(v),
        ParamValue::Waypoints(points) => json!(
            points
                .iter()
                .map(|point| json!({ "at": point.at, "height": point.height, "width": point.width }))
                .collect::<Vec<_>>()
        ),
        ParamValue::Stops(v) => {
            json!(v.iter().map(|stop| json!([stop.at, stop.colour.to_string()])).collect::<Vec<_>>())
        }
        ParamValue::Layers(layers) => json!(
            layers
                .iter()
                .map(|layer| json!([layer.thickness, layer.hardness, layer.repose, layer.colour.to_string()]))
                .collect::<Vec<_>>()
        ),
        // Node declarations do not have this kind.
        ParamValue::Strokes(v) => json!(v.len()),
        ParamValue::File(v) => json!(v),
    }
}

fn output_type(ty: OutputType, defaults: &ParamValues) -> (String, &'static str) {
    let unit = |ty: PortType| ty.unit().symbol();
    match ty {
        OutputType::Fixed(ty) => (ty.to_string(), unit(ty)),
        OutputType::SameAs(input) => (format!("same as `{input}`"), ""),
        OutputType::Chosen(choose) => {
            let ty = choose(defaults);
            (format!("{ty}, or as the parameters set it"), unit(ty))
        }
    }
}

fn reach(reach: Reach, defaults: &ParamValues) -> String {
    match reach {
        Reach::Point => "each cell by itself".to_owned(),
        Reach::World => "the whole world".to_owned(),
        Reach::Metres(metres) => {
            let cell_m = World::default().cell_m();
            let reach_m = metres(defaults, cell_m);
            if !reach_m.is_finite() {
                return "the whole world, at the defaults".to_owned();
            }
            let reach_m = Unit::Metres.display(reach_m);
            format!("{reach_m} around a cell, at the defaults and with cells of {cell_m} m")
        }
    }
}
