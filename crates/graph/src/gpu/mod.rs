//! Kernels for a GPU, as plain data: which shader runs over which buffers.
//!
//! A node declares a [`GpuKernel`]. Its [`Shader`] is WGSL whose parameter struct, bindings and readers of inputs are
//! generated from the node's declaration ([`Shader::text`]), so that nothing is written twice. A kernel is recorded on
//! a [`Recorder`]: an executor with a device runs what is recorded, [`Count`] only counts it. So dispatches and bytes
//! of a kernel are known, and its shaders are validated, without any device.

mod count;
mod record;
mod shader;

pub use count::{Count, Work};
pub use record::{Bind, Over, Pass, Recorder, Rows, Scalar, ScratchId, Size, record};
pub use shader::{Access, FIRST_SLOT, JobNumbers, Number, Role, Shader, Slot, WORKGROUP};

use crate::{
    job::{Job, NodeError},
    param::ParamValues,
    process::Moment,
};

/// A kernel for a GPU. The CPU kernel of the same node defines the result.
pub struct GpuKernel {
    /// The shaders that it may run, for checks without a device.
    pub shaders: &'static [&'static Shader],
    /// What it runs.
    pub passes: Passes,
    /// Where its inputs and outputs are.
    pub ports: Ports,
    /// Returns true if it can run with these parameters; the CPU runs the others.
    pub covers: fn(&ParamValues) -> bool,
    /// How far its outputs may be from those of the CPU, in the order of the declaration.
    pub tolerance: &'static [Tolerance],
}

impl GpuKernel {
    /// Empty fields for `..GpuKernel::DEFAULT`: all parameters.
    pub const DEFAULT: Self = Self {
        shaders: &[],
        passes: Passes::Recorded(|_, _| Ok(())),
        ports: Ports::Device,
        covers: |_| true,
        tolerance: &[],
    };
}

/// Where the inputs and outputs of a kernel are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ports {
    /// On the device: rasters are brought there, and its shaders write the outputs.
    Device,
    /// On the host: it reads the inputs there, and [gives](Recorder::give) all outputs.
    Host,
}

/// What a kernel runs.
#[derive(Clone, Copy)]
pub enum Passes {
    /// One pass over all cells with the first shader, entry point `main`.
    One {
        /// Which rows around its own a cell reads.
        rows: fn(&Job<'_>) -> Rows,
        /// The numbers of the shader that are not in the declaration.
        values: fn(&Job<'_>) -> Vec<(&'static str, Scalar)>,
    },
    /// Whatever it records.
    Recorded(fn(&Job<'_>, &mut dyn Recorder) -> Result<(), NodeError>),
    /// A process from its start to its end, which can also be run step by step.
    Stepped(BeginSteps),
}

/// Starts a process on a device.
pub type BeginSteps = fn(&Job<'_>, &mut dyn Recorder) -> Result<Box<dyn Steps>, NodeError>;

/// A process on a device, as [`Process`](crate::Process) is one on the CPU. The recorders of all calls have the buffers
/// that the calls before have reserved.
pub trait Steps: Send + Sync {
    /// The position in time.
    fn moment(&self) -> Moment;

    /// Advances by one step.
    ///
    /// # Errors
    /// That of the recorder, or [`NodeError`].
    fn step(&mut self, job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError>;

    /// Records the node's current outputs.
    ///
    /// # Errors
    /// That of the recorder, or [`NodeError`].
    fn outputs(&mut self, job: &Job<'_>, recorder: &mut dyn Recorder) -> Result<(), NodeError>;

    /// As [`Process::take`](crate::Process::take).
    fn take(&mut self, params: &ParamValues) -> bool;
}

impl Passes {
    /// One pass in which each cell reads only its own.
    pub const POINT: Self = Self::point(|_| Vec::new());

    /// The same with numbers that are not in the declaration.
    #[must_use]
    pub const fn point(values: fn(&Job<'_>) -> Vec<(&'static str, Scalar)>) -> Self {
        Self::One { rows: |_| Rows::Around(0), values }
    }
}

/// How far an output may be from that of the CPU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// In the output's unit.
    pub absolute: f64,
    /// As a fraction of the largest magnitude in the output and in the inputs.
    pub relative: f64,
    /// The fraction of the cells that may be farther away: where a kernel decides between two values, rounding may
    /// decide otherwise.
    pub outliers: f64,
}

impl Tolerance {
    /// Every bit is equal on every device.
    pub const EXACT: Self = Self::absolute(0.0);
    /// Every bit is equal on devices that round each operation, as the CPU does. Others may contract a product and a
    /// sum; the difference is then a few units in the last place.
    pub const ROUNDING: Self = Self::relative(5e-7);

    /// A fraction of the largest magnitude in the output and in the inputs.
    #[must_use]
    pub const fn relative(relative: f64) -> Self {
        Self { absolute: 0.0, relative, outliers: 0.0 }
    }

    /// A distance in the output's unit.
    #[must_use]
    pub const fn absolute(absolute: f64) -> Self {
        Self { absolute, relative: 0.0, outliers: 0.0 }
    }

    /// The same, with a distance in the output's unit besides.
    #[must_use]
    pub const fn and_absolute(self, absolute: f64) -> Self {
        Self { absolute, ..self }
    }

    /// The same, except in a fraction of the cells.
    #[must_use]
    pub const fn except(self, outliers: f64) -> Self {
        Self { outliers, ..self }
    }
}
