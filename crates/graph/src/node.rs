//! The declaration of a kind of node, as plain data.

use crate::{
    job::{Job, NodeError, Outputs, Wanted},
    migrate::Migration,
    param::{ParamSpec, ParamValues},
    process::Process,
    unit::Unit,
    value::PortType,
    world::Window,
};

/// A kind of node: everything the registry, the loader, the evaluator, the manual, the editor and the tests know of it.
///
/// It is a struct of static data and function pointers, written as a `static` in the node's own file; no consumer
/// names a node.
pub struct Node {
    /// Identity in a file: the field's name of the thing, one word in PascalCase. Chosen once; renaming keeps an alias.
    pub id: &'static str,
    /// Ids it had before.
    pub aliases: &'static [&'static str],
    /// Rises when a default, a range, a port or the result changes.
    pub version: u32,
    /// The steps from older versions, ordered.
    pub migrations: &'static [Migration],
    /// Family in the palette, such as `noise`.
    pub category: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// The manual's text in Markdown: equation, meaning, advice, differences from the source.
    pub doc: &'static str,
    /// Where the method comes from: authors, year, title.
    pub sources: &'static [&'static str],
    /// What it takes.
    pub inputs: &'static [Input],
    /// What it gives; a wire that names no port takes the first.
    pub outputs: &'static [Output],
    /// Its parameters, usually `Params::specs`.
    pub params: fn() -> Vec<ParamSpec>,
    /// Parameters in place of [`Self::params`]: those of a use of [`SUBGRAPH`](crate::SUBGRAPH), which its file declares.
    pub declared: &'static [ParamSpec],
    /// How far around a cell it reads.
    pub reach: Reach,
    /// True if its result may depend on the world's sea level. The results of other nodes are kept when that changes.
    pub reads_sea: bool,
    /// What its kernel allocates beside its inputs and outputs, at its peak.
    pub scratch: Scratch,
    /// The definition of its result.
    pub cpu: Kernel,
    /// How what it does begins, for who runs it step by step; `None` for a node that cannot be.
    pub process: Option<Begin>,
    /// Whether the result is equal to the last bit on every machine and thread count.
    pub exactness: Exactness,
    /// How results at different cell sizes are related.
    pub resolution: Resolution,
    /// A use of it in a graph file that runs as it stands: inputs and parameters as they would be written inside the
    /// brackets. Shown in the manual; what the registry-wide tests run beside the defaults.
    pub example: &'static str,
}

/// A kernel: a pure function of the job.
pub type Kernel = fn(&Job<'_>) -> Result<Outputs, NodeError>;

/// Begins a [`Process`].
pub type Begin = fn(&Job<'_>) -> Result<Box<dyn Process>, NodeError>;

impl Node {
    /// Blank fields for `..Node::DEFAULT`.
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
        params: Vec::new,
        declared: &[],
        reach: Reach::Point,
        reads_sea: false,
        scratch: Scratch::None,
        cpu: |_| Err(NodeError::failed("this node has no kernel")),
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

    /// Position of the output of that name.
    #[must_use]
    pub fn output_index(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|output| output.name == name)
    }

    /// The specs of its parameters.
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

/// An input: it takes a wire, or a constant where it has a number to stand for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input {
    /// Name in a file, in snake case.
    pub name: &'static str,
    /// What may be wired to it.
    pub ty: PortType,
    /// What stands in when the file says nothing.
    pub fallback: Fallback,
    /// Documentation; the first line is a sentence.
    pub doc: &'static str,
}

/// What an input is without a wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fallback {
    /// It must be wired.
    Required,
    /// It may be left out; the kernel does without.
    None,
    /// A number stands where the wire would be.
    Constant {
        /// Value when the file says nothing.
        default: f64,
        /// What a file may say.
        hard: [f64; 2],
        /// What a slider covers.
        soft: [f64; 2],
    },
}

impl Input {
    /// An input that must be wired.
    #[must_use]
    pub const fn needs(name: &'static str, ty: PortType, doc: &'static str) -> Self {
        Self { name, ty, fallback: Fallback::Required, doc }
    }

    /// An input that may be left out.
    #[must_use]
    pub const fn takes(name: &'static str, ty: PortType, doc: &'static str) -> Self {
        Self { name, ty, fallback: Fallback::None, doc }
    }

    /// An input that takes a wire or a number, `default` unless the file says otherwise. Its type is a scalar of `unit`.
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

    /// An input for any height, mask or scalar that takes a wire or a number, `default` unless the file says otherwise.
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

    /// An input for a mask that takes a wire or a number from 0 to 1; 1 unless the file says otherwise.
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
    /// What it is.
    pub ty: OutputType,
    /// Documentation; the first line is a sentence.
    pub doc: &'static str,
}

/// The type of an output.
#[derive(Clone, Copy, Debug)]
pub enum OutputType {
    /// Always the same.
    Fixed(PortType),
    /// That of what is wired to the named input; the first of [`Output`]'s fallbacks, a height, while nothing is.
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

    /// An output of the type that is wired to `input`.
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

/// How far around a cell a kernel reads; halos of windows are derived from it.
#[derive(Clone, Copy, Debug)]
pub enum Reach {
    /// Only the cell itself.
    Point,
    /// A distance in metres, from the parameters and the cell size in metres.
    Metres(fn(&ParamValues, f64) -> f64),
    /// The whole world.
    World,
}

/// Memory that a kernel allocates beside its inputs and outputs, at its peak. Counted before a run, and held to within
/// 20 % by a test that measures it.
#[derive(Clone, Copy, Debug)]
pub enum Scratch {
    /// Nothing that grows with the window.
    None,
    /// So many bytes per cell of the window.
    PerCell(f64),
    /// Bytes, from what the kernel is asked for.
    Bytes(fn(&Sizing<'_>) -> u64),
}

/// What the memory of a kernel depends on.
#[derive(Clone, Copy, Debug)]
pub struct Sizing<'a> {
    /// Checked parameters.
    pub params: &'a ParamValues,
    /// What the kernel works on.
    pub window: Window,
    /// Per declared input, whether a wire's value stands there.
    pub wired: &'a [bool],
    /// The outputs that are read.
    pub wanted: Wanted,
}

impl Sizing<'_> {
    /// So many bytes for each cell of the window.
    #[must_use]
    pub fn cells(&self, bytes: f64) -> u64 {
        (bytes * self.window.len() as f64) as u64
    }

    /// Returns true if the input of that name, among those that the node declares, has a wire.
    #[must_use]
    pub fn is_wired(&self, inputs: &[Input], name: &str) -> bool {
        inputs.iter().zip(self.wired).any(|(input, wired)| input.name == name && *wired)
    }
}

impl Scratch {
    /// Bytes.
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

/// How a result at one cell size relates to that at another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// The same land: averaged to the coarser cells, results differ by less than this share of the output's standard
    /// deviation (root mean square) between 128 and 256 and between 256 and 512 cells a side of the tests' world. Smoothed over eight
    /// of the coarser cells they differ by less than 2 %, unless this is more than 5 %.
    Within(f32),
    /// It depends on the cells, for the stated reason.
    Cells(&'static str),
}
