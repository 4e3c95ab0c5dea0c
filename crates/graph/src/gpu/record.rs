//! Recording a kernel: scratch buffers, passes, and what is read back between them.

use super::{
    GpuKernel, Passes,
    shader::{Number, Role, Shader, Slot},
};
use crate::{
    job::{Job, NodeError},
    value::Value,
};

/// Receives what a kernel runs. Passes see the writes of all passes before them.
pub trait Recorder {
    /// Reserves a buffer for the time of this run. Its contents are undefined.
    ///
    /// # Errors
    /// When the device has no memory for it.
    fn scratch(&mut self, size: Size) -> Result<ScratchId, NodeError>;

    /// Reserves a buffer with these contents.
    ///
    /// # Errors
    /// When the device has no memory for it.
    fn table(&mut self, words: &[u32]) -> Result<ScratchId, NodeError>;

    /// Replaces the contents of a buffer, which has that many words, after all passes so far.
    ///
    /// # Errors
    /// As [`Self::pass`].
    fn write(&mut self, scratch: ScratchId, words: &[u32]) -> Result<(), NodeError>;

    /// Fills a buffer with zeros.
    ///
    /// # Errors
    /// As [`Self::pass`].
    fn clear(&mut self, scratch: ScratchId) -> Result<(), NodeError>;

    /// Runs a pass.
    ///
    /// # Errors
    /// When the run is cancelled, or the device fails.
    fn pass(&mut self, pass: &Pass<'_>) -> Result<(), NodeError>;

    /// Waits for all passes so far, and returns the first words of a buffer of words, such as a counter that decides
    /// how the kernel goes on. A way through the host: once in many passes.
    ///
    /// # Errors
    /// As [`Self::pass`].
    fn read(&mut self, scratch: ScratchId, words: usize) -> Result<Vec<u32>, NodeError>;

    /// Gives a wanted output that no shader writes, such as a report.
    fn give(&mut self, output: &'static str, value: Value);
}

/// A buffer of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ScratchId(pub usize);

/// The size of a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// Four bytes for each cell of the window.
    Cells,
    /// A number of words of four bytes.
    Words(usize),
}

/// A pass: one entry point of a shader over some invocations.
#[derive(Clone, Copy, Debug)]
pub struct Pass<'a> {
    /// The shader.
    pub shader: &'static Shader,
    /// Its entry point.
    pub entry: &'static str,
    /// What is bound to its slots, by the names of their variables. Slots of inputs and outputs that are not named have
    /// those; others that are not named are not used by the entry point.
    pub bind: &'a [(&'static str, Bind)],
    /// The numbers of [`Shader::values`].
    pub values: &'a [(&'static str, Scalar)],
    /// Its invocations.
    pub over: Over,
}

impl Pass<'_> {
    /// What is named for a slot, by the name of its variable.
    #[must_use]
    pub fn bound(&self, slot: &Slot) -> Option<Bind> {
        let found = |name: &str| self.bind.iter().find(|(bound, _)| *bound == name).map(|(_, bind)| *bind);
        match slot.role {
            // their variables have these names
            Role::Input(0) | Role::Cells | Role::Words => found(slot.name),
            Role::Input(_) | Role::Output(_) => found(&slot.variable()),
        }
    }
}

/// What is bound to a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bind {
    /// A plane of an input.
    Input(&'static str, usize),
    /// A plane of an output.
    Output(&'static str, usize),
    /// A buffer of the run.
    Scratch(ScratchId),
}

/// The invocations of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Over {
    /// One for each cell of the window, in workgroups of [`WORKGROUP`](super::WORKGROUP) along rows. An executor may
    /// divide it into bands of rows.
    Cells(Rows),
    /// One for each place of an array of so many columns and rows, in workgroups as over cells. An executor may divide it
    /// into bands of rows; buffers are bound as a whole.
    Array([u32; 2]),
    /// One workgroup of [`WORKGROUP`](super::WORKGROUP) for each tile of so many columns and rows of the window. An executor
    /// may divide it into bands of tiles; `p.row` is the first row of tiles. Rows are read around those of the tile.
    Tiles([u32; 2], Rows),
    /// A number of workgroups along each axis, as one dispatch.
    Groups([u32; 3]),
}

/// The rows that an invocation reads, in buffers of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rows {
    /// That many above and below its own.
    Around(u32),
    /// Any.
    All,
}

/// A number for a parameter struct.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar {
    /// `f32`.
    F32(f32),
    /// `i32`.
    I32(i32),
    /// `u32`.
    U32(u32),
}

impl Scalar {
    pub(super) const fn number(self) -> Number {
        match self {
            Self::F32(_) => Number::F32,
            Self::I32(_) => Number::I32,
            Self::U32(_) => Number::U32,
        }
    }

    pub(super) const fn bits(self) -> u32 {
        match self {
            Self::F32(v) => v.to_bits(),
            Self::I32(v) => v as u32,
            Self::U32(v) => v,
        }
    }
}

/// Records a kernel.
///
/// # Errors
/// That of the kernel or the recorder.
pub fn record(kernel: &GpuKernel, job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError> {
    match kernel.passes {
        Passes::One { rows, values } => {
            let Some(shader) = kernel.shaders.first() else {
                return Err(NodeError::failed("the kernel has no shader"));
            };
            let values = values(job);
            recorder.pass(&Pass { shader, entry: "main", bind: &[], values: &values, over: Over::Cells(rows(job)) })
        }
        Passes::Recorded(run) => run(job, recorder),
        Passes::Stepped(begin) => {
            let mut steps = begin(job, recorder)?;
            while !steps.moment().is_over() {
                steps.step(job, recorder)?;
                let moment = steps.moment();
                job.advance((moment.now / moment.end) as f32)?;
            }
            steps.outputs(job, recorder)
        }
    }
}
