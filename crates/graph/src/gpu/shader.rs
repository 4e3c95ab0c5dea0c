//! Shaders: WGSL whose parameter struct and bindings come from the declaration of the node.

use std::fmt::Write as _;

use super::record::Scalar;
use crate::{
    job::Job,
    node::Node,
    param::{Kind, ParamSpec, ParamValue},
    world::Window,
};

/// Invocations of a workgroup along a row, for passes over cells. The fastest shape on a software driver, and two to
/// four subgroups on a graphics card, whose rows above and below come from its cache.
pub const WORKGROUP: u32 = 64;

/// A shader of a node.
#[derive(Debug)]
pub struct Shader {
    /// Its file in `shaders/`, without the extension, such as `combine/combine`.
    pub name: &'static str,
    /// Its own text.
    pub source: &'static str,
    /// Texts from `shaders/lib`, which come before its own.
    pub library: &'static [&'static str],
    /// Numbers in its parameter struct besides those of the declaration.
    pub values: &'static [(&'static str, Number)],
    /// What it reads and writes.
    pub slots: &'static [Slot],
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// `f32`.
    F32,
    /// `i32`.
    I32,
    /// `u32`.
    U32,
}

impl Number {
    const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::I32 => "i32",
            Self::U32 => "u32",
        }
    }
}

/// A buffer of a shader.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    /// Its name: that of the input or output, or any other for scratch and tables.
    pub name: &'static str,
    /// What is bound to it.
    pub role: Role,
    /// WGSL type of its elements.
    pub element: &'static str,
    /// Whether the shader writes it.
    pub access: Access,
}

/// What is bound to a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A plane of the input of that name; the shader calls `read_NAME(index)`, which also returns a constant.
    Input(usize),
    /// A plane of the output of that name; the shader calls it `out_NAME`, or `out_NAME_1` for plane 1, and writes
    /// `checked(value)`.
    Output(usize),
    /// A number of each cell between passes.
    Cells,
    /// Anything else: a table, sums, counters.
    Words,
}

/// Whether a shader writes a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// It only reads.
    Read,
    /// It only writes.
    Write,
    /// It reads and writes.
    Update,
}

impl Slot {
    /// The first plane of an input.
    #[must_use]
    pub const fn input(name: &'static str) -> Self {
        Self { name, role: Role::Input(0), element: "f32", access: Access::Read }
    }

    /// The first plane of an output.
    #[must_use]
    pub const fn output(name: &'static str) -> Self {
        Self { name, role: Role::Output(0), element: "f32", access: Access::Write }
    }

    /// Another plane of the same input or output.
    #[must_use]
    pub const fn plane(self, plane: usize) -> Self {
        let role = match self.role {
            Role::Input(_) => Role::Input(plane),
            Role::Output(_) => Role::Output(plane),
            other => other,
        };
        Self { role, ..self }
    }

    /// A number of each cell that the shader reads.
    #[must_use]
    pub const fn cells(name: &'static str, element: &'static str) -> Self {
        Self { name, role: Role::Cells, element, access: Access::Read }
    }

    /// A table that the shader reads.
    #[must_use]
    pub const fn words(name: &'static str, element: &'static str) -> Self {
        Self { name, role: Role::Words, element, access: Access::Read }
    }

    /// The same slot, which the shader only writes.
    #[must_use]
    pub const fn written(self) -> Self {
        Self { access: Access::Write, ..self }
    }

    /// The same slot, which the shader reads and writes.
    #[must_use]
    pub const fn updated(self) -> Self {
        Self { access: Access::Update, ..self }
    }

    /// The name of its variable.
    #[must_use]
    pub fn variable(&self) -> String {
        match self.role {
            Role::Input(0) | Role::Cells | Role::Words => self.name.to_owned(),
            Role::Input(plane) => format!("{}_{plane}", self.name),
            Role::Output(0) => format!("out_{}", self.name),
            Role::Output(plane) => format!("out_{}_{plane}", self.name),
        }
    }
}

/// The first binding of a slot: the parameters and the flag of faults come before.
pub const FIRST_SLOT: u32 = 2;

/// Numbers of every parameter struct: cells of the window, its position in the world, cells of the world, the first row
/// in the bound buffers, the first row of the dispatch, side of a cell in metres.
const PLACE: [(&str, Number); 9] = [
    ("nx", Number::U32),
    ("ny", Number::U32),
    ("left", Number::U32),
    ("top", Number::U32),
    ("world_nx", Number::U32),
    ("world_ny", Number::U32),
    ("first", Number::U32),
    ("row", Number::U32),
    ("cell_m", Number::F32),
];

/// The place of the first row in that list, which the row of the dispatch follows.
const FIRST: usize = 6;

/// What every shader may call.
const COMMON: &str = "\
/// Index of a cell of the window in the bound buffers.
fn at(x: u32, y: u32) -> u32 { return (y - p.first) * p.nx + x; }

/// The cell of an invocation, or its place in an array.
fn cell_of(id: vec3<u32>) -> vec2<u32> { return vec2<u32>(id.x, id.y + p.row); }

/// Whether an invocation has no cell.
fn is_outside(cell: vec2<u32>) -> bool { return cell.x >= p.nx || cell.y >= p.ny; }

/// Returns a sample of an output, and raises the flag of faults if it is not finite.
fn checked(v: f32) -> f32 {
    if ((bitcast<u32>(v) & 0x7f800000u) == 0x7f800000u) {
        atomicStore(&fault, 1u);
    }
    return v;
}

";

impl Shader {
    /// The whole text for a node.
    #[must_use]
    pub fn text(&self, node: &Node) -> String {
        let mut text = String::new();
        for spec in node.specs() {
            if let Kind::Choice { options, .. } = &spec.kind {
                for (at, (option, _)) in options.iter().enumerate() {
                    let name = format!("{}_{option}", spec.name).to_uppercase();
                    let _ = writeln!(text, "const {name}: u32 = {at}u;");
                }
            }
        }
        text.push_str("struct Params {\n");
        for (name, number) in self.members(node) {
            let _ = writeln!(text, "    {name}: {},", number.name());
        }
        text.push_str("}\n@group(0) @binding(0) var<uniform> p: Params;\n");
        text.push_str("@group(0) @binding(1) var<storage, read_write> fault: atomic<u32>;\n");
        for (binding, slot) in (FIRST_SLOT..).zip(self.slots) {
            let access = match slot.access {
                Access::Read => "read",
                Access::Write | Access::Update => "read_write",
            };
            let (variable, element) = (slot.variable(), slot.element);
            let _ =
                writeln!(text, "@group(0) @binding({binding}) var<storage, {access}> {variable}: array<{element}>;");
            if matches!(slot.role, Role::Input(_)) {
                let name = slot.name;
                let _ = writeln!(
                    text,
                    "fn read_{variable}(index: u32) -> f32 {{ return {variable}[index * p.{name}_step]; }}"
                );
            }
        }
        text.push_str(COMMON);
        for part in self.library {
            text.push_str(part);
            text.push('\n');
        }
        text.push_str(self.source);
        text
    }

    /// The members of the parameter struct.
    fn members(&self, node: &Node) -> Vec<(String, Number)> {
        let mut members: Vec<(String, Number)> = PLACE.iter().map(|(name, number)| ((*name).into(), *number)).collect();
        for spec in node.specs() {
            members.extend(of_spec(&spec));
        }
        members.extend(node.inputs.iter().map(|input| (format!("{}_step", input.name), Number::U32)));
        members.extend(node.outputs.iter().map(|output| (format!("wants_{}", output.name), Number::U32)));
        members.extend(self.values.iter().map(|(name, number)| ((*name).to_owned(), *number)));
        members
    }

    /// The words of the parameter struct of a pass: a multiple of four. `values` has the numbers of [`Self::values`],
    /// fastest in their order, `first` is the first row in the bound buffers and `row` the first one to compute.
    ///
    /// # Panics
    /// When a number is missing or of another type: a bug in a kernel, never the fault of a file.
    #[must_use]
    pub fn params(&self, job: &JobNumbers, values: &[(&'static str, Scalar)], rows: [u32; 2]) -> Vec<u32> {
        let mut words = Vec::with_capacity((job.0.len() + self.values.len()).next_multiple_of(4));
        words.extend_from_slice(&job.0);
        words[FIRST..FIRST + 2].copy_from_slice(&rows);
        for (at, (name, number)) in self.values.iter().enumerate() {
            let is_it = |(given, _): &&(&str, Scalar)| given == name;
            let given = values.get(at).filter(is_it).or_else(|| values.iter().find(is_it));
            let (_, given) = given.unwrap_or_else(|| panic!("`{}` needs a number `{name}`", self.name));
            assert_eq!(given.number(), *number, "`{name}` of `{}`", self.name);
            words.push(given.bits());
        }
        words.resize(words.len().next_multiple_of(4), 0);
        words
    }
}

/// The numbers that all passes of a run have in their parameter structs: those of its job.
#[derive(Clone, Debug)]
pub struct JobNumbers(Vec<u32>);

impl JobNumbers {
    /// Those of a job.
    #[must_use]
    pub fn of(job: &Job<'_>) -> Self {
        let Window { world, origin, cells } = job.window;
        let mut words = vec![cells[0], cells[1], origin[0], origin[1], world.cells[0], world.cells[1]];
        // the rows of a pass
        words.extend([0, 0]);
        words.push((job.cell_m() as f32).to_bits());
        for spec in job.node.specs() {
            words.extend(words_of(&spec, job));
        }
        words.extend(job.inputs.iter().map(|input| u32::from(input.is_wired())));
        words.extend((0..job.node.outputs.len()).map(|output| u32::from(job.wanted.contains(output))));
        Self(words)
    }
}

/// The name of a parameter's member; words that WGSL keeps for itself get an ending.
fn member(name: &str) -> String {
    const RESERVED: [&str; 5] = ["active", "filter", "from", "of", "throw"];
    if RESERVED.contains(&name) { format!("{name}_of") } else { name.to_owned() }
}

/// The members of a parameter. Curves, paths, layers and the like have none: a kernel passes them as tables.
fn of_spec(spec: &ParamSpec) -> Vec<(String, Number)> {
    let one = |number| vec![(member(spec.name), number)];
    match spec.kind {
        Kind::Float { .. } => one(Number::F32),
        Kind::Int { .. } => one(Number::I32),
        Kind::Bool { .. } | Kind::Choice { .. } | Kind::Seed { .. } => one(Number::U32),
        Kind::Point { .. } => ["x", "y"].map(|axis| (format!("{}_{axis}", spec.name), Number::F32)).to_vec(),
        Kind::Curve { .. }
        | Kind::Path { .. }
        | Kind::Stops { .. }
        | Kind::Waypoints { .. }
        | Kind::Layers { .. }
        | Kind::Strokes { .. }
        | Kind::File => Vec::new(),
    }
}

/// The words of these members. A seed is that of the run.
fn words_of(spec: &ParamSpec, job: &Job<'_>) -> Vec<u32> {
    match job.params.get(spec.name).unwrap_or(&spec.kind.default_value()) {
        ParamValue::Float(v) => vec![(*v as f32).to_bits()],
        ParamValue::Int(v) => vec![i32::try_from(*v).unwrap_or(i32::MAX) as u32],
        ParamValue::Bool(v) => vec![u32::from(*v)],
        ParamValue::Choice(name) => {
            let Kind::Choice { options, .. } = &spec.kind else { return vec![0] };
            vec![options.iter().position(|(option, _)| option == name).unwrap_or(0) as u32]
        }
        ParamValue::Seed(_) => vec![job.seed()],
        ParamValue::Point(point) => point.iter().map(|v| (*v as f32).to_bits()).collect(),
        ParamValue::Curve(_)
        | ParamValue::Path(_)
        | ParamValue::Stops(_)
        | ParamValue::Waypoints(_)
        | ParamValue::Layers(_)
        | ParamValue::Strokes(_)
        | ParamValue::File(_) => Vec::new(),
    }
}
