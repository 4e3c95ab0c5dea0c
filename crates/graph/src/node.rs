//! The declaration of a kind of node, as plain data.

use std::path::Path;

use serde::Serialize;

use crate::{
    averaging::Averaging,
    gpu::{GpuKernel, Ports},
    job::{Job, NodeError, Outputs, Wanted},
    migrate::Migration,
    param::{ParamSpec, ParamValues},
    process::Process,
    stated::Stated,
    unit::Unit,
    value::PortType,
    world::{Window, World},
};

/// A kind of node: everything that the registry, the loader, the evaluator, the manual, the editor and the tests need
/// to know.
///
/// It is a struct of static data and function pointers, written as a `static` in the node's own file. No consumer
/// refers to a particular node.
pub struct Node {
    /// Identifier in a file: the term of the field, one word in PascalCase. Chosen once; renaming a node keeps the old
    /// id as an alias.
    pub id: &'static str,
    /// Former ids.
    pub aliases: &'static [&'static str],
    /// Increases when a default, a range, a port or the result changes.
    pub version: u32,
    /// The steps from older versions, in order.
    pub migrations: &'static [Migration],
    /// Category in the palette, such as `generate`.
    pub category: &'static str,
    /// A one-sentence description.
    pub summary: &'static str,
    /// The manual's text in Markdown: equation, meaning, advice, differences from the source.
    pub doc: &'static str,
    /// Sources of the method: authors, year, title.
    pub sources: &'static [&'static str],
    /// Its inputs.
    pub inputs: &'static [Input],
    /// Its outputs; a wire that names no port refers to the first.
    pub outputs: &'static [Output],
    /// Outputs whose values on larger cells are not what [`Averaging::of`] their type says.
    pub averaging: &'static [(&'static str, Averaging)],
    /// The measures in its reports. Declared by nodes of the category `measure`; none by others.
    pub measures: &'static [MeasureSpec],
    /// Its parameters, usually `Params::specs`.
    pub params: fn() -> Vec<ParamSpec>,
    /// Parameters that replace [`Self::params`]: those of a use of [`SUBGRAPH`](crate::SUBGRAPH), declared by its file.
    pub declared: &'static [ParamSpec],
    /// How far around a cell it reads.
    pub reach: Reach,
    /// True if its result may depend on the world's sea level. Results of other nodes stay valid when the level
    /// changes.
    pub reads_sea: bool,
    /// True if its result may depend on where on Earth the world lies. Results of other nodes stay valid when that
    /// changes.
    pub reads_place: bool,
    /// The levels of cells on which it runs, if it does not run on those of the world alone. Only for nodes that read
    /// the whole world.
    pub levels: Option<Levels>,
    /// The peak memory that its kernel allocates besides inputs and outputs.
    pub scratch: Scratch,
    /// Refuses parameters and inputs that cannot be computed together; `None` if there are none. A check of a file asks
    /// it about each node that an output needs, so that a warning comes before the run. The kernel refuses the same.
    pub refuses: Option<Refuses>,
    /// The kernel that defines its result.
    pub cpu: Kernel,
    /// The kernel for a GPU; `None` if there is none.
    pub gpu: Option<&'static GpuKernel>,
    /// Starts its process, for callers that run it incrementally; `None` if it cannot be run step by step.
    pub process: Option<Begin>,
    /// Whether the result is bit-identical on every machine and for any number of threads.
    pub exactness: Exactness,
    /// How results at different cell sizes are related.
    pub resolution: Resolution,
    /// An example of its use that runs without changes: inputs and parameters as written inside the brackets in a graph
    /// file, after the [version](Self::written). Shown in the manual; tests of all nodes run it as well as the defaults.
    pub example: &'static str,
}

/// How a node runs on levels of ever finer cells, each of which goes on from the one below.
///
/// The run on each level is planned, stored and reused like that of any other node: its inputs are made for its own
/// cells, and its [state](crate::State) is stored by the node, its inputs and the world on its cells. So a run on finer
/// cells passes only the levels that no run before it has passed.
#[derive(Clone, Copy, Debug)]
pub struct Levels {
    /// The level that a run continues from; `None` if it starts from scratch. A function of the parameters and the
    /// world; [`Below::State`] must have fewer cells, and [`Below::Results`] more. With [`Below::Results`], the results
    /// are averaged from the finer level. A run that only has to produce the state then starts from scratch, because the
    /// finer level in turn continues from that state.
    pub below: fn(&ParamValues, &World) -> Option<Below>,
    /// About the size in bytes of the state for a finer level, for the estimate before a run. 0 on cells on which no
    /// finer level goes on.
    pub state: fn(&Sizing<'_>) -> u64,
    /// The work of a run on a world, compared with that of its other levels; for the progress.
    pub work: fn(&ParamValues, &World) -> f64,
}

/// What a run goes on from: the run of the same node on the same place with other cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Below {
    /// From the state of the run on these cells.
    State(World),
    /// From its results on these cells, which are more than its own. It then reads no inputs.
    Results(World),
}

/// A kernel: a pure function of the job.
pub type Kernel = fn(&Job<'_>) -> Result<Outputs, NodeError>;

/// Returns an error for what cannot be computed, whatever the terrain.
pub type Refuses = fn(&Stated<'_>) -> Result<(), NodeError>;

/// Starts a [`Process`].
pub type Begin = fn(&Job<'_>) -> Result<Box<dyn Process>, NodeError>;

impl Node {
    /// A node of this kind as it is written in a graph file, with its version: one without is taken for version 1.
    #[must_use]
    pub fn written(&self, arguments: &str) -> String {
        let version = if self.version > 1 { format!("version: {}", self.version) } else { String::new() };
        let comma = if version.is_empty() || arguments.is_empty() { "" } else { ", " };
        format!("{}({version}{comma}{arguments})", self.id)
    }

    /// Returns true if it has a GPU kernel for these parameters.
    #[must_use]
    pub fn has_gpu_kernel(&self, params: &ParamValues) -> bool {
        self.levels.is_none() && self.gpu.is_some_and(|kernel| (kernel.covers)(params))
    }

    /// Returns true if the inputs and outputs of its GPU kernel stay on the host.
    #[must_use]
    pub fn has_ports_on_host(&self) -> bool {
        self.gpu.is_some_and(|kernel| kernel.ports == Ports::Host)
    }

    /// Empty fields for `..Node::DEFAULT`.
    pub const DEFAULT: Self = Self {
        id: "",
        aliases: &[],
        version: 1,
        migrations: &[],
        category: "",
        summary: "",
        doc: "",
        sources: &[],
        inputs: &[],
        outputs: &[],
        averaging: &[],
        measures: &[],
        params: Vec::new,
        declared: &[],
        reach: Reach::Point,
        reads_sea: false,
        reads_place: false,
        levels: None,
        scratch: Scratch::None,
        refuses: None,
        cpu: |_| Err(NodeError::failed("this node has no kernel")),
        gpu: None,
        process: None,
        exactness: Exactness::Exact,
        resolution: Resolution::Within(0.05),
        example: "",
    };

    /// The input of that name.
    #[must_use]
    pub fn input(&self, name: &str) -> Option<&'static Input> {
        self.inputs.iter().find(|input| input.name == name)
    }

    /// How values of the output at a position, which has this type, become those of larger cells.
    #[must_use]
    pub fn averaging(&self, output: usize, ty: PortType) -> Averaging {
        let name = self.outputs.get(output).map(|output| output.name);
        let own = self.averaging.iter().find(|(declared, _)| Some(*declared) == name);
        own.map_or_else(|| Averaging::of(ty), |(_, averaging)| *averaging)
    }

    /// Position of the output of that name.
    #[must_use]
    pub fn output_index(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|output| output.name == name)
    }

    /// Returns true if it measures a height: its category is `measure`, and the only wire that it requires is a height.
    #[must_use]
    pub fn measures_height(&self) -> bool {
        let mut required = self.inputs.iter().filter(|input| input.fallback == Fallback::Required);
        let is_height = |input: &Input| matches!(input.ty, PortType::Height | PortType::AnyScalar);
        self.category == "measure" && required.next().is_some_and(is_height) && required.next().is_none()
    }

    /// The specifications of its parameters.
    #[must_use]
    pub fn specs(&self) -> Vec<ParamSpec> {
        if self.declared.is_empty() { (self.params)() } else { self.declared.to_vec() }
    }
}

impl std::fmt::Debug for Node {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Node({} v{})", self.id, self.version)
    }
}

/// An input: it takes a wire, or a constant if it has a numeric fallback.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// Name in a file, in snake case.
    pub name: &'static str,
    /// The type that may be wired to it.
    pub ty: PortType,
    /// What it falls back to without a wire.
    pub fallback: Fallback,
    /// Documentation; the first line is a sentence.
    pub doc: &'static str,
}

/// What an input falls back to without a wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fallback {
    /// A wire is required.
    Required,
    /// The input is optional; the kernel does without it.
    None,
    /// A number replaces the wire.
    Constant {
        /// Default value.
        default: f64,
        /// Range that a file may use.
        hard: [f64; 2],
        /// Range of the slider.
        soft: [f64; 2],
    },
}

impl Input {
    /// A required input.
    #[must_use]
    pub const fn needs(name: &'static str, ty: PortType, doc: &'static str) -> Self {
        Self { name, ty, fallback: Fallback::Required, doc }
    }

    /// An optional input.
    #[must_use]
    pub const fn takes(name: &'static str, ty: PortType, doc: &'static str) -> Self {
        Self { name, ty, fallback: Fallback::None, doc }
    }

    /// An input that takes a wire or a number; without either it is `default`. Its type is a scalar of `unit`.
    #[must_use]
    pub const fn number(
        name: &'static str,
        unit: Unit,
        default: f64,
        hard: [f64; 2],
        soft: [f64; 2],
        doc: &'static str,
    ) -> Self {
        Self { name, ty: PortType::Scalar(unit), fallback: Fallback::Constant { default, hard, soft }, doc }
    }

    /// An input that takes a wire of any height, mask or scalar, or a number; without either it is `default`.
    #[must_use]
    pub const fn any_number(
        name: &'static str,
        default: f64,
        hard: [f64; 2],
        soft: [f64; 2],
        doc: &'static str,
    ) -> Self {
        Self { name, ty: PortType::AnyScalar, fallback: Fallback::Constant { default, hard, soft }, doc }
    }

    /// An input that takes a mask or a number from 0 to 1; without either it is 1.
    #[must_use]
    pub const fn mask(name: &'static str, doc: &'static str) -> Self {
        Self {
            name,
            ty: PortType::Mask,
            fallback: Fallback::Constant { default: 1.0, hard: [0.0, 1.0], soft: [0.0, 1.0] },
            doc,
        }
    }
}

/// An output.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// Name in a file, in snake case.
    pub name: &'static str,
    /// Its type.
    pub ty: OutputType,
    /// Documentation; the first line is a sentence.
    pub doc: &'static str,
}

/// The type of an output.
#[derive(Clone, Copy, Debug)]
pub enum OutputType {
    /// Always the same.
    Fixed(PortType),
    /// The type of the wire into the named input; a height while nothing is wired.
    SameAs(&'static str),
    /// Chosen by the parameters.
    Chosen(fn(&ParamValues) -> PortType),
}

impl Output {
    /// An output of a fixed type.
    #[must_use]
    pub const fn gives(name: &'static str, ty: PortType, doc: &'static str) -> Self {
        Self { name, ty: OutputType::Fixed(ty), doc }
    }

    /// An output with the type of what is wired to `input`.
    #[must_use]
    pub const fn same_as(name: &'static str, input: &'static str, doc: &'static str) -> Self {
        Self { name, ty: OutputType::SameAs(input), doc }
    }

    /// An output whose type the parameters choose.
    #[must_use]
    pub const fn chosen(name: &'static str, ty: fn(&ParamValues) -> PortType, doc: &'static str) -> Self {
        Self { name, ty: OutputType::Chosen(ty), doc }
    }
}

/// A measure of a terrain, as a report names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MeasureSpec {
    /// Name in a report and in the `expect` of a file: words in snake case, with dots between parts.
    pub name: &'static str,
    /// Symbol of the unit, empty for pure numbers.
    pub unit: &'static str,
    /// Documentation; the first line is a sentence.
    pub doc: &'static str,
}

/// How far around a cell a kernel reads; the halos of windows follow from it.
#[derive(Clone, Copy, Debug)]
pub enum Reach {
    /// Only the cell itself.
    Point,
    /// A distance in metres, computed from the parameters and the cell size in metres. Infinite where the parameters
    /// choose something that needs the whole world.
    Metres(fn(&ParamValues, f64) -> f64),
    /// The whole world.
    World,
}

impl Reach {
    /// Returns true if, with these parameters and cells of this size, a cell depends on the whole world.
    #[must_use]
    pub fn is_world(self, params: &ParamValues, cell_m: f64) -> bool {
        match self {
            Self::Point => false,
            Self::Metres(from) => !(0.0..f64::INFINITY).contains(&from(params, cell_m)),
            Self::World => true,
        }
    }
}

/// The peak memory that a kernel allocates besides its inputs and outputs. It is part of the estimate before a run; a
/// test measures it and allows a deviation of 20 %.
#[derive(Clone, Copy, Debug)]
pub enum Scratch {
    /// Nothing that grows with the window.
    None,
    /// Bytes per cell of the window.
    PerCell(f64),
    /// Bytes, computed from the request.
    Bytes(fn(&Sizing<'_>) -> u64),
}

/// What a kernel's memory depends on.
#[derive(Clone, Copy, Debug)]
pub struct Sizing<'a> {
    /// Checked parameters.
    pub params: &'a ParamValues,
    /// The window that the kernel computes.
    pub window: Window,
    /// Per declared input, true if a wire is connected.
    pub wired: &'a [bool],
    /// The outputs that are read.
    pub wanted: Wanted,
    /// The folder that file parameters are relative to.
    pub folder: &'a Path,
}

impl Sizing<'_> {
    /// A number of bytes for each cell of the window.
    #[must_use]
    pub fn cells(&self, bytes: f64) -> u64 {
        (bytes * self.window.len() as f64) as u64
    }

    /// Returns true if the declared input of that name has a wire.
    #[must_use]
    pub fn is_wired(&self, inputs: &[Input], name: &str) -> bool {
        inputs.iter().zip(self.wired).any(|(input, wired)| input.name == name && *wired)
    }
}

impl Scratch {
    /// The number of bytes.
    #[must_use]
    pub fn bytes(self, sizing: &Sizing<'_>) -> u64 {
        match self {
            Self::None => 0,
            Self::PerCell(bytes) => sizing.cells(bytes),
            Self::Bytes(of) => of(sizing),
        }
    }
}

/// Whether results are equal everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exactness {
    /// Bit-identical for any thread count, SIMD width and machine.
    Exact,
    /// Equal within an absolute tolerance, for the stated reason.
    Within {
        /// Largest difference, in the output's unit.
        tolerance: f64,
        /// Why it cannot be exact.
        why: &'static str,
    },
}

/// How results at different cell sizes are related.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// The same terrain: averaged to the coarser cells, results differ by less than this fraction of the output's
    /// standard deviation (root mean square) between 128 and 256 and between 256 and 512 cells a side of the tests'
    /// world. Smoothed over eight of the coarser cells they differ by less than 2 %, unless this is more than 5 %.
    Within(f32),
    /// It depends on the cell size, for the stated reason.
    Cells(&'static str),
}
